"""Results of dForce itself: an approach as if it had been measured, a spectrum, or a measured curve that was kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import ResultError
from dforce.inverse.table import APPROACH, Column, MeasuredTable, Reader
from dforce.results.files import decoded, is_sealed
from dforce.results.kinds import is_kind
from dforce.results.status import repeats

if TYPE_CHECKING:
    import xarray as xr

TONES = ((1, ""), (2, "_2"))


def kept_in(content: bytes, name: str) -> xr.Dataset | None:
    """Return the measured curve in a file of dForce, as it was kept; None for any other file.

    Raises
    ------
    ResultError
        When the file is damaged.
    """
    if not is_sealed(content):
        return None
    result = decoded(content, name)
    if not is_kind(result, "measured"):
        return None
    lines = np.atleast_1d(result.attrs.get("history", []))  # a file gives a list of sentences back as an array
    return result.assign_attrs(history=[str(line) for line in lines])


def read(content: bytes, name: str) -> list[MeasuredTable]:
    """Return the curves of an approach, or the spectrum of a simulated thermal motion.

    Raises
    ------
    ResultError
        When the file is damaged, of another kind, or a result of many cases.
    """
    result = decoded(content, name)
    if "spectral_density" in result:
        wanted = {"frequency": "Hz", "spectral_density": "m^2/Hz"}
        return [
            MeasuredTable(
                tuple(Column(key, unit, np.asarray(result[key].values, float)) for key, unit in wanted.items())
            )
        ]
    if is_kind(result, "fit"):
        raise ResultError(f"{name} is a fit, not a measured curve; dforce fit repeats it with its curve")
    if "zc" not in result.dims or "tone" not in result.dims or not {"amplitude", "phase"} <= set(result.data_vars):
        raise ResultError(
            f"{name} is a result of dForce without amplitude and phase against zc, and without a thermal spectrum"
        )
    more = set(map(str, result["amplitude"].dims)) - {"zc", "direction", "tone"}
    if more:
        raise ResultError(
            f"{name} contains curves of many cases, over {', '.join(sorted(more))}; choose one with .isel"
        )
    return [_table(result)]


def _table(result: xr.Dataset) -> MeasuredTable:
    """Return the curves of an approach, one direction below the other, without the points that have no settled motion."""
    directions = (
        [str(word) for word in np.atleast_1d(result["direction"].values)] if "direction" in result else [APPROACH]
    )
    curves = [result.sel(direction=word) if "direction" in result.dims else result for word in directions]
    kept = [
        repeats(curve["status"].values) if "status" in curve else np.ones(curve.sizes["zc"], bool) for curve in curves
    ]

    def stacked(name: str, tone: int | None = None) -> Array:
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
    return MeasuredTable(tuple(columns), notes, segments)


READER = Reader(
    kind="result of dForce",
    maker="dForce",
    endings=(".nc",),
    is_one=is_sealed,
    read=read,
    height_grows={"height": "away"},
    how="an approach, both directions, or a saved measured curve",
    seen="yes",
)
