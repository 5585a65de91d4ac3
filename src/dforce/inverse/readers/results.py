"""Results of dForce itself: an approach as if it had been measured, or a measured curve that was written before."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from dforce.core.errors import ResultError
from dforce.inverse.table import APPROACH, Column, Table
from dforce.results.files import SEAL, SEAL_LENGTH, is_whole
from dforce.results.files import read as read_result
from dforce.results.status import repeats

if TYPE_CHECKING:
    import xarray as xr

TONES = ((1, ""), (2, "_2"))


def is_own(content: bytes, name: str) -> bool:
    """Say whether an HDF5 file was written by dForce.

    Raises
    ------
    ResultError
        When it was, and is not as it was written.
    """
    sealed = content[-SEAL_LENGTH:].startswith(SEAL)
    if sealed and not is_whole(content):
        raise ResultError(f"{name} is damaged or was cut short")
    return sealed


def read(path: str | os.PathLike[str], name: str) -> xr.Dataset | Table:
    """Return a measured curve as it was written, or an approach as a table.

    Raises
    ------
    ResultError
        When the result is of another kind, or one of many cases.
    """
    result = read_result(path)
    if result.attrs.get("kind") == "fit":
        raise ResultError(f"{name} is a fit, and no measured curve; dforce fit does it again, with its curve")
    if "point" in result.dims and "height" in result:
        return _again(result)
    if "zc" not in result.dims or "tone" not in result.dims or not {"amplitude", "phase"} <= set(result.data_vars):
        raise ResultError(f"{name} is a result of dForce, but no approach: it has no amplitude and phase against zc")
    more = set(map(str, result["amplitude"].dims)) - {"zc", "direction", "tone"}
    if more:
        raise ResultError(f"{name} holds curves of many cases, over {', '.join(sorted(more))}; choose one with .isel")
    return _table(result)


def spectrum_in(path: str | os.PathLike[str], name: str) -> Table:
    """Return the spectrum of a simulated thermal motion as a table.

    Raises
    ------
    ResultError
        When the result is of another kind.
    """
    result = read_result(path)
    if "spectral_density" not in result:
        raise ResultError(f"{name} is a result of dForce, but no thermal spectrum")
    wanted = {"frequency": "Hz", "spectral_density": "m^2/Hz"}
    columns = [Column(column, unit, np.asarray(result[column].values, float)) for column, unit in wanted.items()]
    return Table(tuple(columns), "result of dForce", "dForce")


def _again(result: xr.Dataset) -> xr.Dataset:
    """Return a measured curve with its list of sentences, which a file gives back as an array."""
    result.attrs["history"] = [str(line) for line in np.atleast_1d(result.attrs.get("history", []))]
    return result


def _table(result: xr.Dataset) -> Table:
    """Return the curves of an approach, one direction below the other, without the points that have no settled motion."""
    directions = (
        [str(word) for word in np.atleast_1d(result["direction"].values)] if "direction" in result else [APPROACH]
    )
    curves = [result.sel(direction=word) if "direction" in result.dims else result for word in directions]
    kept = [
        repeats(curve["status"].values) if "status" in curve else np.ones(curve.sizes["zc"], bool) for curve in curves
    ]

    def stacked(name: str, tone: int | None = None) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        variables = [curve[name] if tone is None else curve[name].sel(tone=tone) for curve in curves]
        return np.concatenate([np.asarray(v.values, float)[mask] for v, mask in zip(variables, kept, strict=True)])

    columns = [Column("height", "m", stacked("zc"))]
    for tone, ending in TONES:
        if tone in result["tone"].values:
            columns.append(Column(f"amplitude{ending}", "m", stacked("amplitude", tone)))
            columns.append(Column(f"phase{ending}", "deg", stacked("phase", tone)))
    if "mean_deflection" in result:
        columns.append(Column("mean_deflection", "m", stacked("mean_deflection")))
    lost = sum(int((~mask).sum()) for mask in kept)
    notes = {"phase_convention": "lag"} | ({"points left out": str(lost)} if lost else {})
    segments = np.concatenate([np.repeat(word, int(mask.sum())) for word, mask in zip(directions, kept, strict=True)])
    return Table(tuple(columns), "result of dForce", "dForce", notes, segments)
