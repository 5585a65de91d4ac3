"""On which branch each point of a measured curve lies, and where the curve jumps from one to the other."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Array, Bools, Indices
from dforce.inverse.fitting.points import BEHIND_JUMP, FROM_FREE, NEIGHBORS, MeasuredPoints

if TYPE_CHECKING:
    import xarray as xr

STEP_SIGMAS, STEP_MEDIANS = 6.0, 5.0  # a step of amplitude or phase beyond both is a jump
FOUND = 1  # default margin: points left out beside a jump that is found in the data
BACK = 0.5  # of a step: a point whose neighbors differ by less is a spike
RIGHT_ANGLE = 90.0
ATTRACTED = 4.0  # errors by which a phase of attraction is above that, at least, and of free motion below, at most


def branches(data: xr.Dataset, found: MeasuredPoints, margin: int | None) -> tuple[Any, Any, Any]:
    """Return the branch of each point, which points are beside a jump, and which are spikes.

    Where the data name the branch of each point, no spike is sought beside the spikes of the calibration.
    """
    free = float(data.attrs.get("free_phase", RIGHT_ANGLE))
    found = replace(found, phase=found.phase + (RIGHT_ANGLE - free))  # of net attraction above a right angle
    height = found.height
    spikes = data["spike"].values.astype(bool) if "spike" in data else np.zeros(len(height), bool)
    if "branch" in data.variables:
        branch = np.where(np.asarray(data["branch"].values, dtype=float) < 0.0, BEHIND_JUMP, FROM_FREE)
        return branch, _beside_known_jump(height, branch, margin or 0), spikes
    margin = FOUND if margin is None else margin
    branch, beside = np.full(len(height), FROM_FREE), np.zeros(len(height), bool)
    ways, walks = found.direction, []
    for way in dict.fromkeys(ways.tolist()) if ways is not None else [None]:
        chosen = np.flatnonzero(ways == way) if way is not None else np.arange(len(height))
        order = chosen[np.argsort(-height[chosen], kind="stable")]  # from far to near
        order = order[~spikes[order]]
        spikes[order] = _spikes(found, order)
        order = order[~spikes[order]]
        walks.append(_Walk(str(way), order, _jumps(found, order)))
    for walk in _with_hidden_jump(found, walks):
        for cut in walk.cuts:
            beside[walk.order[max(0, cut - margin) : cut + margin]] = True
        for start, stop in itertools.pairwise([0, *(walk.cuts or _turn(found, walk.order)), len(walk.order)]):
            if start > 0 and _is_behind(found, walk.order[start:stop]):
                branch[walk.order[start:stop]] = BEHIND_JUMP
        for place in np.flatnonzero(spikes & (ways == walk.way if ways is not None else True)).tolist():
            branch[place] = branch[walk.order[np.argmin(np.abs(height[walk.order] - height[place]))]]
    return branch, beside, spikes


@dataclass(frozen=True)
class _Walk:
    """One direction of a curve: its points from far to near, and before which of them it jumps."""

    way: str
    order: Indices
    cuts: list[int]


def _is_behind(found: MeasuredPoints, stretch: Indices) -> bool:
    """Return whether the nearest points of a stretch are repulsive."""
    return bool(np.median(found.phase[stretch[-3:], 0]) < RIGHT_ANGLE)


def _with_hidden_jump(found: MeasuredPoints, walks: list[_Walk]) -> list[_Walk]:
    """Return the two directions of a curve; where one shows no jump, it is cut at its steepest fall.

    Where one direction jumps, a state ends at a fold, so the other one does not lead from state to state smoothly either. The
    retract jumps farther away than the approach, or as far.
    """
    if len(walks) != 2 or bool(walks[0].cuts) == bool(walks[1].cuts):
        return walks
    jumping, other = sorted(walks, key=lambda walk: not walk.cuts)
    if not (_is_behind(found, jumping.order) and _is_behind(found, other.order)):
        return walks
    cut = jumping.cuts[-1]
    edges = found.height[jumping.order[cut - 1 : cut + 1]]
    middle = 0.5 * (found.height[other.order[1:]] + found.height[other.order[:-1]])
    there = middle >= edges.min() if other.way == "retract" else middle <= edges.max()
    phase = found.phase[other.order, 0]
    there &= phase[:-1] > RIGHT_ANGLE - ATTRACTED * found.phase_error[0]  # it leaves free motion, or attraction
    if not there.any():
        return walks
    falls = np.where(there, np.diff(phase), np.inf)
    return [jumping, replace(other, cuts=[int(np.argmin(falls)) + 1])]


def _turn(found: MeasuredPoints, order: Indices) -> list[int]:
    """Return before which place a curve without a jump turns from attraction to repulsion: the largest fall of the phase.

    A jump may hide in that step. Without one both branches lead to the same states, so nothing is lost.
    """
    phase = found.phase[order, 0]
    if not _is_behind(found, order) or phase.max() < RIGHT_ANGLE + ATTRACTED * found.phase_error[0]:
        return []
    return [int(np.argmin(np.where(phase[:-1] > RIGHT_ANGLE, np.diff(phase), np.inf))) + 1]


def _beside_known_jump(height: Array, branch: object, margin: int) -> Any:
    """Return which points are beside a jump where the branch of each is known.

    The branch from free motion ends where the other goes on nearer; the other one where the first reaches farther.
    """
    beside = np.zeros(len(height), bool)
    first, second = np.flatnonzero(branch == FROM_FREE), np.flatnonzero(branch == BEHIND_JUMP)
    if margin == 0 or not len(first) or not len(second):
        return beside
    if height[second].min() < height[first].min():
        beside[first[np.argsort(height[first], kind="stable")[:margin]]] = True
    if height[first].max() > height[second].max():
        beside[second[np.argsort(-height[second], kind="stable")[:margin]]] = True
    return beside


def _spikes(found: MeasuredPoints, order: Indices) -> Bools:
    """Return which points along a curve are spikes: large steps of amplitude or phase lead to them and back, none remains.

    A large step to the last point is a spike, too, unless it leads from attraction to repulsion, as a jump does.
    """
    back, jumps = np.zeros((2, len(order)), bool)
    same = len(np.unique(found.phase[order[-2:], 0] < RIGHT_ANGLE)) == 1
    for values, over in _large_steps(found, order):
        step = np.diff(values)
        large = np.maximum(np.abs(step[:-1]) * over[:-1], np.abs(step[1:]) * over[1:])
        returns = np.abs(step[:-1] + step[1:]) < BACK * large
        back[1:-1] |= returns
        jumps[1:-1] |= (large > 0.0) & ~returns
        back[-1:] |= over[-1:] & same
    return np.asarray(back & ~jumps)


def _jumps(found: MeasuredPoints, order: Indices) -> list[int]:
    """Return before which places along a curve amplitude or phase jumps."""
    over = np.any([large for _, large in _large_steps(found, order)], axis=0)
    return [int(cut) + 1 for cut in np.flatnonzero(over)]


def _large_steps(found: MeasuredPoints, order: Indices) -> Iterator[tuple[Array, Bools]]:
    """Give amplitude and phase along a curve, each with which of its steps are too large for noise and slope."""
    for values, sigma in ((found.amplitude[:, 0], found.amplitude_error[0]), (found.phase[:, 0], found.phase_error[0])):
        step = np.abs(np.diff(values[order]))
        over = np.zeros(len(step), bool)
        least = max(STEP_SIGMAS * math.sqrt(2.0) * sigma, STEP_MEDIANS * float(np.median(step)) if len(step) else 0.0)
        for place in np.flatnonzero(step > least).tolist():
            beside = np.delete(step[max(0, place - NEIGHBORS) : place + NEIGHBORS + 1], min(place, NEIGHBORS))
            over[place] = not len(beside) or step[place] > STEP_MEDIANS * np.median(beside)  # a steep onset is no jump
        yield values[order], over
