"""Which points of a measured curve a fit takes, and with which errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, shorten
from dforce.inverse.fitting.branches import RIGHT_ANGLE, branches
from dforce.inverse.fitting.points import BEHIND_JUMP, BESIDE_JUMP, FROM_FREE, NOT_SELECTED, SPIKE, MeasuredPoints
from dforce.inverse.values import number_of

if TYPE_CHECKING:
    import xarray as xr

BRANCHES = {"attractive": FROM_FREE, "repulsive": BEHIND_JUMP}
FEWEST = 8  # points
MISTYPED = 1000.0  # times the range of a curve: an error so large was typed without its unit


@dataclass(frozen=True)
class PointSelection:
    """The selection of the points of a curve.

    Attributes
    ----------
    branch
        ``measured``: each point's own; ``attractive`` or ``repulsive``: one branch alone counts.
    margin
        Number of points left out beside each jump. None: 0 if the data have the branch of each point, else 1, because branches
        may be wrong beside a jump.
    errors
        Standard deviations that replace the data's own: m and degrees, by the names of the variables.
    height
        Ranges of heights (m) that count.
    direction
        ``approach`` or ``retract``: one direction alone counts.
    """

    branch: str = "measured"
    margin: int | None = None
    errors: Mapping[str, float] | None = None
    height: Sequence[tuple[float, float]] = ()
    direction: str = ""


def measured(data: xr.Dataset, reading: PointSelection) -> MeasuredPoints:
    """Return a measured curve ready for a fit.

    Raises
    ------
    ParameterError
        When a variable, an error or the noise is missing, for numbers that are none, and where nothing is left to fit.
    """
    if data.attrs.get("kind") == "fit":
        raise ParameterError("the data are a fit; pass its measured curve, or repeat the fit (fit_again)")
    second = [name for name in ("amplitude_2", "phase_2") if name in data]
    if len(second) == 1:
        raise ParameterError(f"the data have {second[0]} alone of tone 2; remove it to fit the first tone")
    height, names = _column(data, "height"), ("", "_2")[: 1 + len(second) // 2]
    amplitude, phase = ([_column(data, f"{name}{ending}") for ending in names] for name in ("amplitude", "phase"))
    points = float(data.attrs.get("noise_points", math.inf))
    if {f"{channel}{name}" for channel in ("amplitude", "phase") for name in names} <= set(reading.errors or {}):
        points = math.inf
    attrs = {**data.attrs, "noise_points": points}
    if math.isinf(points):
        del attrs["noise_points"]
    found = MeasuredPoints(
        height,
        np.stack(amplitude, axis=1),
        np.stack(phase, axis=1),
        np.ones(len(height), np.int64),
        np.ones(len(height), bool),
        np.array([_error(data, reading, f"amplitude{name}", "m") for name in names]),
        np.array([_error(data, reading, f"phase{name}", "deg") for name in names]),
        float(data.attrs.get("neighbor_correlation", 0.0)),
        attrs,
        points,
        _height_error(data, reading),
        np.asarray(data["direction"].values).astype(str) if "direction" in data.variables else None,
    )
    branch, beside, spikes = branches(data, found, reading.margin)
    asked = _chosen(found, reading)
    used = asked & ~beside & ~spikes
    if reading.branch != "measured":
        asked &= _on_branch(found, branch, used, reading.branch)
        used &= asked
    if used.sum() < FEWEST:
        raise ParameterError(f"a fit needs at least {FEWEST} points, {used.sum()} are left: widen the range of use")
    left_out = np.select([used, ~asked, spikes], ["", NOT_SELECTED, SPIKE], BESIDE_JUMP)
    return replace(found, branch=branch, used=used, left_out=left_out)


def _column(data: xr.Dataset, name: str) -> Array:
    if name not in data:
        raise ParameterError(f"the data have no '{name}'; a measured curve needs height, amplitude and phase")
    values = np.asarray(data[name].values, dtype=float)
    if values.ndim != 1:
        raise ParameterError(f"'{name}' of the data has {values.ndim} dimensions; a measured curve has one, `point`")
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise ParameterError(f"'{name}' of the data is not a number at point {int(bad[0]) + 1}; leave that point out")
    return values


def _error(data: xr.Dataset, reading: PointSelection, name: str, unit: str) -> float:
    given = (reading.errors or {}).get(name, data.attrs.get(f"{name}_error"))
    if given is None:
        raise ParameterError(
            f"the noise of '{name}' is unknown: calibrate the data (df.calibrate), or write errors, such as "
            f'{{"{name}": {"0.05e-9" if unit == "m" else "0.3"}}} in {unit}'
        )
    value = float(given)
    if not (math.isfinite(value) and value > 0.0):
        raise ParameterError(f"the error of '{name}' is {value:g} {unit}; it must be above 0")
    return _of_the_unit(value, data, name, unit)


def _height_error(data: xr.Dataset, reading: PointSelection) -> float:
    value = float((reading.errors or {}).get("height", data.attrs.get("height_error", 0.0)))
    if not (math.isfinite(value) and value >= 0.0):
        raise ParameterError(f"the error of 'height' is {value:g} m; it must not be below 0")
    return _of_the_unit(value, data, "height", "m")


def _of_the_unit(value: float, data: xr.Dataset, name: str, unit: str) -> float:
    """Return an error; refuse one so much larger than the span of the curve that its unit must be missing."""
    known = data[name].values[np.isfinite(data[name].values)]
    span = float(np.ptp(known)) if len(known) else math.inf
    if 0.0 < MISTYPED * span < value:
        raise ParameterError(
            f"the error of '{name}' is {units.show(value, unit, 4)}, more than {MISTYPED:g} times the "
            f"{units.show(span, unit, 4)} span of the curve; is the unit missing?"
        )
    return value


def _chosen(found: MeasuredPoints, reading: PointSelection) -> Any:
    """Return which points lie in the range and the direction asked for."""
    height = found.height
    chosen = np.ones(len(height), bool)
    if reading.height:
        chosen &= np.any([(height >= low) & (height <= high) for low, high in map(sorted, reading.height)], axis=0)
    if reading.direction:
        if found.direction is None:
            raise ParameterError("the data do not distinguish approach and retract; add a column 'direction'")
        chosen &= found.direction == reading.direction
    return chosen


def _on_branch(found: MeasuredPoints, branch: Any, used: Any, name: str) -> Any:
    """Return which points lie on one branch.

    Raises
    ------
    ParameterError
        When no point does.
    """
    wanted = branch == BRANCHES[name]
    if not (wanted & used).any():
        above = bool((found.phase[used, 0] > RIGHT_ANGLE).all())
        why = "all phases are above 90 degrees" if name == "repulsive" and above else "no point lies on it"
        raise ParameterError(f'branch = "{name}", but {why}')
    return wanted


def checked_reading(branch: str, margin: int | None, errors: Any, height: Any, direction: str) -> PointSelection:
    """Return the selection of points, after a check of the arguments.

    Raises
    ------
    ParameterError
        For an unknown word or number.
    """
    if branch not in ("measured", *BRANCHES):
        raise ParameterError(f"branch = '{shorten(branch)}' is not measured, attractive or repulsive")
    if direction not in ("", "approach", "retract"):
        raise ParameterError(f"direction = '{shorten(direction)}' is not approach or retract")
    if margin is not None and not 0 <= margin <= 1000:
        raise ParameterError(f"margin = {margin} is not between 0 and 1000 points")
    known = ("amplitude", "phase", "amplitude_2", "phase_2", "height")
    given: dict[str, float] = {}
    for name, value in (errors or {}).items():
        if name not in known:
            raise ParameterError(f"errors has '{shorten(name)}'; known: {', '.join(known)}")
        if value == "from free part":
            continue
        given[name] = number_of(f"errors.{name}", value, "degree" if name.startswith("phase") else "m")
    return PointSelection(branch, margin, given, _ranges(height), direction)


def _ranges(given: Any) -> list[tuple[float, float]]:
    """Return ranges of heights (m) from a pair of heights, or several pairs."""
    if given is None:
        return []
    several = _is_list(given) and any(_is_list(one) for one in given)
    out = []
    for pair in given if several else [given]:
        if not _is_list(pair) or len(pair) != 2:
            raise ParameterError(
                f"use.height = {shorten(given)} is neither a range, such as ['5 nm', '40 nm'], nor a list of ranges"
            )
        low, high = (number_of("use.height", value, "m") for value in pair)
        out.append((low, high))
    return out


def _is_list(given: object) -> bool:
    return isinstance(given, Sequence) and not isinstance(given, str)
