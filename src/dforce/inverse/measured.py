"""Measured curves: from the table in a file to a Dataset in SI units, with a list of every step."""

from __future__ import annotations

import functools
import hashlib
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, Unpack

import numpy as np

from dforce.core import units
from dforce.core.errors import DForceError, ParameterError, ResultError, checked, shorten
from dforce.inverse.curve import ReadKeywords, ReadOptions, curve_of
from dforce.inverse.heights import WAYS, is_disordered
from dforce.inverse.placing import FEWEST, LARGEST, place, split_curves
from dforce.inverse.readers import content_of, own, tables_in
from dforce.inverse.table import APPROACH, MeasuredTable
from dforce.inverse.words import MEANINGS

if TYPE_CHECKING:
    import xarray as xr

CHANNELS = ("amplitude", "phase", "amplitude_2", "phase_2", "frequency_shift")
T = TypeVar("T")


@checked
def read_measured(path: str | os.PathLike[str], *, curve: int | None = None, **how: Unpack[ReadKeywords]) -> xr.Dataset:
    """Return a measured curve of amplitude and phase against height.

    It reads text, HDF5, results of dForce, and files of the makers in ``dforce read --help``. If something is missing, dForce
    asks in a sentence and never guesses. The attribute `history` lists each step.

    Parameters
    ----------
    path
        The file.
    columns
        Name of the column of a quantity, if its heading is not known: ``{"amplitude": "Lock-in R"}``.
    units
        Unit of a column without a unit: ``{"amplitude": "nm", "phase": "deg"}``. For heights in volts the sensitivity of the
        piezo: ``{"height": "20 nm/V"}``.
    sensitivity
        Sensitivity that converts volts (m/V, or text such as ``"52 nm/V"``).
    amplitude_is
        Kind of the amplitudes in the file: ``"peak"`` (zero to peak), ``"rms"`` or ``"peak-to-peak"``.
    phase_convention
        The phases in the file, relative to the lag behind the drive (90° when free at resonance, above in net attraction):
        ``"lag"``, ``"lag-90"``, ``"90-lag"`` or ``"lead"``. Without a convention here and in the file, the phases are
        unchanged: then pass the convention to :func:`dforce.calibrate`.
    height
        ``"sensor"`` or ``"piezo"``, if the file has both; default: the sensor.
    height_grows
        Direction of larger heights: ``"away"`` from the sample or ``"toward"`` the sample. Default: as in the files of the
        maker, else from the curve, whose amplitude falls toward the sample. An ambiguous curve is refused.
    direction
        ``"approach"`` or ``"retract"``, for a file with one direction that is not named there.
    curve
        Number of the curve, from 1, in a file with several curves; :func:`read_curves` returns all curves.

    Returns
    -------
    xarray.Dataset
        Along `point`, in the order of the measurement: `height` (m, larger is farther from the sample), `amplitude` (m, zero to
        peak), `phase` (degrees); the coordinate `direction`. If the file has them, also `amplitude_2`, `phase_2`, `deflection`
        (m), `frequency`, `frequency_shift` (Hz), `excitation`, `time` (s), `branch` (1 attractive, -1 repulsive). Attributes:
        settings in the file, such as `k`, `f0` and `Q`, and `history`.

    Raises
    ------
    ResultError
        For a file that cannot be read, is incomplete, or contains no curve: with the row and the reason.
    ParameterError
        If a necessary setting is missing in the file, or a setting is not allowed.
    """
    found = [make() for make in _each(path, ReadOptions.of(how), curve)]
    if len(found) > 1:
        raise ParameterError(
            f"'{shorten(str(path))}' contains {len(found)} curves: choose one with curve = 1 to {len(found)}, or read all of "
            "them with df.read_curves"
        )
    return found[0]


@checked
def read_curves(path: str | os.PathLike[str], **how: Unpack[ReadKeywords]) -> list[xr.Dataset]:
    """Return all curves of a file, each as from :func:`read_measured`; on a map with the attributes `x` and `y` (m).

    A column `curve`, or the columns `x` and `y`, distinguish the curves; in HDF5 each group is a curve, in .nid each row.

    Parameters
    ----------
    path
        The file.
    **how
        `columns`, `units`, `sensitivity`, `amplitude_is`, `phase_convention`, `height`, `height_grows` and `direction`, as in
        :func:`read_measured`.

    Raises
    ------
    ResultError
        As :func:`read_measured`, for the first curve that cannot be read.
    ParameterError
        As :func:`read_measured`.
    """
    return [make() for make in _each(path, ReadOptions.of(how), None)]


def each_curve(path: str | os.PathLike[str], how: Mapping[str, Any]) -> list[xr.Dataset | DForceError]:
    """Return all curves of a file; the error in the place of a curve that cannot be read.

    Parameters
    ----------
    path
        The file.
    how
        Further arguments of :func:`read_measured`; with a `curve` only this curve is returned.

    Raises
    ------
    DForceError
        When the file itself cannot be read.
    """
    keywords = dict(how)
    number = keywords.pop("curve", None)
    out: list[xr.Dataset | DForceError] = []
    for make in _each(path, ReadOptions.of(keywords), number):
        try:
            out.append(make())
        except DForceError as error:
            out.append(error)
    return out


def _each(path: str | os.PathLike[str], asked: ReadOptions, number: int | None) -> list[Callable[[], xr.Dataset]]:
    """Return the functions that make the curves of a file."""
    content, name = content_of(path)
    kept = own.kept_in(content, name)
    if kept is not None:
        whole = _chosen([kept], number, name) if number is not None else kept
        return [lambda: whole]
    tables = [
        part
        for table in tables_in(content, name)
        for part in split_curves(table, place(table, asked.columns, None, name), name)
    ]
    if number is not None:
        tables = [_chosen(tables, number, name)]
    source = {"source": Path(path).name, "sha256": hashlib.sha256(content).hexdigest()}
    several = len(tables) > 1

    def made(place: int, table: MeasuredTable) -> xr.Dataset:
        counted = place if several else number
        label = table.label if table.label not in ("", str(counted)) else ""
        called = f"curve {place}{f' ({label} in the file)' if label else ''} of {name}"
        curve = curve_of(table, asked, called if several else name)
        numbered = {} if counted is None else {"curve": counted} | ({"label": label} if label else {})
        return curve.assign_attrs(source | numbered)

    return [functools.partial(made, place, table) for place, table in enumerate(tables, start=1)]


def _chosen(tables: list[T], number: int, name: str) -> T:
    if not 1 <= number <= len(tables):
        raise ParameterError(f"{name} has no curve {number}; it contains {len(tables)}")
    return tables[number - 1]


def check_measured(data: xr.Dataset) -> None:
    """Refuse a Dataset that is no measured curve.

    Raises
    ------
    ParameterError
        When something is missing or makes no sense; the message names it.
    ResultError
        With the first point that has no number.
    """
    missing = [name for name in ("height", "amplitude", "phase") if name not in data]
    if missing or data["height"].dims != ("point",):
        fault = f"has no {' and no '.join(missing)}" if missing else "does not lie along 'point'"
        raise ParameterError(f"data {fault}, so it is not a measured curve; get a curve from df.read_measured")
    if data.sizes["point"] < FEWEST:
        raise ParameterError(f"data has {data.sizes['point']} points, but a curve needs {FEWEST} or more")
    for name in ("height", *CHANNELS):
        if name not in data:
            continue
        values = data[name].values
        if values.dtype.kind not in "fiu" or data[name].dims != ("point",):
            raise ParameterError(f"the {name} of data is not a row of real numbers along 'point'")
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise ResultError(f"the {name} of data is not a finite number at point {bad[0] + 1}; remove such points")
        if name.startswith("amplitude") and values.min() < 0.0:
            raise ParameterError(f"the {name} of data is below zero at point {int(np.argmax(values < 0.0)) + 1}")
        size = np.ptp(values) if name == "height" else np.abs(values).max()
        if MEANINGS[name].unit == "m" and size > LARGEST:
            raise ParameterError(f"the {name} of data reaches {units.show(float(size), 'm', 3)}; lengths are in m")


def check_directions(data: xr.Dataset) -> None:
    """Refuse a measured curve whose points are in no order, or whose directions are unknown.

    Raises
    ------
    ParameterError
        When points are in no order or directions are unknown; the message contains the remedy.
    """
    if "direction" not in data.variables:
        raise ParameterError(
            "data has no coordinate 'direction': data.assign_coords(direction=('point', ['approach', ...])) adds it"
        )
    words = data["direction"].values
    for word in dict.fromkeys(words.tolist()):
        if word not in WAYS:
            raise ParameterError(f"the direction '{shorten(str(word))}' of data is neither approach nor retract")
        own = np.asarray(data["height"].values[words == word], dtype=float)
        if WAYS[word] * (own[-1] - own[0]) < 0.0 or is_disordered(own):
            way = "fall" if word == APPROACH else "rise"
            raise ParameterError(f"the heights of the {word} do not {way} from point to point; sort the points of data")
