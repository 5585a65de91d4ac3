"""The jumps of curves: jumps noted where orbits were followed, else sudden steps of the motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dforce.case import Case, case_of
from dforce.core.arrays import AnyArray
from dforce.core.errors import DForceError
from dforce.observables.averaging import common_period
from dforce.results.curves import by_case, goes_along
from dforce.results.kinds import swept

if TYPE_CHECKING:
    import xarray as xr

LEAST = 0.1  # smallest sudden step that counts as a jump, as a share of the largest amplitude
RELATIVE = "zc_ratio"  # distances as shares of the free amplitude
RISING = ("retract", "up")  # directions in which the distance or the frequency grows


@dataclass(frozen=True)
class Jump:
    """A sudden change of the first tone's motion from one distance (or frequency) to the next.

    Attributes
    ----------
    at
        Where: the place noted, or the first point behind a sudden step.
    before, after
        Places in the curve's arrays of the points that it lies between, in order of travel.
    """

    at: float
    before: int
    after: int


def jumps(curve: xr.Dataset, direction: str = "") -> list[Jump]:
    """Return the jumps of a curve over distance or frequency in one direction.

    Where orbits were followed from point to point, or jumps noted, the noted jumps count. Else a jump is a step of the first
    tone's complex amplitude of at least a tenth of the largest amplitude. It is three times larger than the steps before and
    after it, and twice the median step: a coarse grid shows none.
    """
    ((_, _, found),) = jumps_of_all(curve, goes_along(curve), direction)
    return found


def jumps_of_all(result: xr.Dataset, along: str, direction: str = "") -> Iterator[tuple[int, int, list[Jump]]]:
    """Give the jumps of each curve of a result: the number of its case and of its direction, counted from 0, and its jumps.

    `direction` names the direction of a result that is one direction of another result.
    """
    x, where, over = result.variables[along].values, _noted_as(along), swept(result, along)
    case = None if where in result and "direction" in result.dims else _case(result)
    noted = _are_noted(result, along, case)
    # distances that are shares of the free amplitude were noted in meters, and differ from case to case
    places_of = by_case(result, "zc", along, over)[:, 0] if along == RELATIVE else np.broadcast_to(x, (1, len(x)))
    motions = by_case(result, "amplitude_ratio" if "amplitude_ratio" in result else "amplitude", along, over)
    motions = motions.reshape(*motions.shape[:3], -1)[..., 0]
    if "phase" in result:
        motions = motions * np.exp(-1j * np.radians(by_case(result, "phase", along, over)[..., 0]))
    if where in result:
        places, words = (result[name].values.reshape(len(motions), -1) for name in (where, "jump_direction"))
    ways = result["direction"].values.tolist() if "direction" in result.dims else [direction or _way(result, case)]
    for number, of_case in enumerate(motions):
        x = places_of[number % len(places_of)]
        for index, (way, motion) in enumerate(zip(ways, of_case, strict=True)):
            there = np.flatnonzero(np.isfinite(motion))
            order = there[np.argsort(x[there], kind="stable")]
            if not noted:
                yield number, index, _sudden(x, motion, order if way in RISING else order[::-1])
            elif where in result:
                yield number, index, list(_noted(x[order], order, places[number], words[number], way))
            else:
                yield number, index, []


def _case(result: xr.Dataset) -> Case | None:
    """Return the case that a result comes from; none where this version cannot read it."""
    try:
        return case_of(result)
    except DForceError:
        return None


def _are_noted(result: xr.Dataset, along: str, case: Case | None) -> bool:
    """Return whether jumps were noted: the state was carried along the curve, and its orbits were followed."""
    if _noted_as(along) in result:
        return True
    if case is None:
        return "corrections" in result
    followed = "corrections" in result
    if swept(result) and not followed:  # it may keep other quantities only
        periodic = case.solver.method == "periodic"
        followed = periodic and common_period([tone.frequency for tone in case.problem.tones]) is not None
    return followed and bool(getattr(case.experiment, "carry_state", False))


def _noted_as(along: str) -> str:
    """Return the name of the places of jumps along a quantity."""
    return f"jump_{'zc' if along == RELATIVE else along}"


def _way(result: xr.Dataset, case: Case | None) -> str:
    """Return the direction of a result that has one only; nothing where it is not known."""
    if "direction" in result.coords:
        return str(result["direction"].values)
    way = str(getattr(case.experiment, "direction", "")) if case is not None else ""
    return "" if way == "both" else way


def _noted(x: AnyArray, order: AnyArray, places: AnyArray, words: AnyArray, way: str) -> Iterator[Jump]:
    """Give the jumps noted that belong to a direction, between points in rising order."""
    for at, word in zip(places.tolist(), words.tolist(), strict=True):
        # a sudden step jumps at the point that it leads to; NaN, which fills up the table of a sweep, is behind all points
        after = int(np.searchsorted(x, at, side="left" if word in RISING else "right"))
        if way in ("", word) and 0 < after < len(x):
            pair = (after - 1, after) if word in RISING else (after, after - 1)
            yield Jump(at, int(order[pair[0]]), int(order[pair[1]]))


def _sudden(x: AnyArray, motion: AnyArray, order: AnyArray) -> list[Jump]:
    """Return the sudden steps between points in order of travel."""
    if len(order) < 5:
        return []
    steps, largest = np.abs(np.diff(motion[order])), np.abs(motion[order]).max()
    beside = np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
    sudden = (steps > LEAST * largest) & (steps > 3.0 * beside) & (steps > 2.0 * np.median(steps))
    return [Jump(float(x[order[i + 1]]), int(order[i]), int(order[i + 1])) for i in np.flatnonzero(sudden)]
