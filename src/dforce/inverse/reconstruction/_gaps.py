"""Distances at which no motion turned: the curve does not constrain the force there, and the force elsewhere less."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.reconstruction._law import Law, force_of
from dforce.inverse.reconstruction._path import Rows

WIDER = 4.0  # times the spacing of the points beside it: a gap
BESIDE = 5  # points on each side for the spacing
ERRORS = 6.0  # of the distances: a gap that is narrower may be chance
LEAST = 1.0 / 400.0  # of the range of distances; a narrower gap hides nothing
SHAPES = 3  # half waves of an unknown force between two points
SAMPLES = 31  # of the force around them


class Gap(NamedTuple):
    """A stretch between two distances (m) of closest approach, none in between."""

    low: float
    high: float


def gaps_in(closest: Array, error: float) -> list[Gap]:
    """Return the gaps between closest distances (m) with an error (m).

    A gap is four times as wide as the mean spacing of five points on either side of it, the larger of both.
    """
    place = np.sort(closest)
    step = np.diff(place)
    found = []
    for number in range(len(step)):
        left, right = place[max(number - BESIDE, 0) : number + 1], place[number + 1 : number + 2 + BESIDE]
        beside = [np.ptp(side) / (len(side) - 1) for side in (left, right) if len(side) > 2]
        if beside and step[number] > max(WIDER * max(beside), ERRORS * error, LEAST * np.ptp(place)):
            found.append(Gap(float(place[number]), float(place[number + 1])))
    return found


def hidden_forces(closest: Array, law: Law) -> Array:
    r"""Return forces (N) that may hide between neighboring closest distances, a standard deviation each, (forces, nodes).

    They are half waves :math:`S \sin(m \pi t) / m` from one distance to the next. S is the deviation of the force from a line
    within half a step of both: next to nothing where points lie close.
    """
    place = np.unique(closest)
    low, high = place[:-1], place[1:]
    width = high - low
    around = np.linspace(
        np.maximum(low - 0.5 * width, law.nodes[0]), np.minimum(high + 0.5 * width, law.nodes[-1]), SAMPLES
    )
    force = force_of(law, law.force, around)
    size = np.ptp(force - np.linspace(force[0], force[-1], SAMPLES), axis=0)
    share = (law.nodes - low[:, None]) / width[:, None]
    inside = (share > 0.0) & (share < 1.0)
    waves = [np.where(inside, size[:, None] / m * np.sin(m * np.pi * share), 0.0) for m in range(1, SHAPES + 1)]
    return np.concatenate(waves)


def hidden_error(law: Law, gain: Array, rows: Rows) -> Array:
    """Return the error of the force (N) at the nodes by forces that hide between points."""
    hidden = hidden_forces(rows.closest, law)
    seen = hidden @ rows.virial.T @ gain.T - hidden  # the part that is found, minus the hidden force
    return np.asarray(np.sqrt(np.sum(seen**2, axis=0)))
