"""Stretches of distance at which no motion turned: what a curve cannot tell, and what that does to the rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.reconstruction._law import Law, force_of
from dforce.inverse.reconstruction._path import Rows

WIDER = 4.0  # times the spacing of the points beside it: a gap
BESIDE = 5  # points on each side that tell the spacing
ERRORS = 6.0  # of the distances: a gap that is narrower may be chance
LEAST = 1.0 / 400.0  # of the range of distances; what is narrower hides nothing
SHAPES = 3  # half waves of what is not known within a gap


class Gap(NamedTuple):
    """A stretch between two distances (m) of closest approach, none in between."""

    low: float
    high: float


def gaps_in(closest: Array, error: float) -> list[Gap]:
    """Return the gaps between closest distances (m) whose error (m) is given.

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


def hidden_force(gap: Gap, law: Law) -> Array:
    r"""Return forces (N) that may hide in a gap, one standard deviation each, shape (shapes, nodes).

    Half waves :math:`S \sin(m \pi t) / m` between the ends of the gap, with S the range of the force within a gap's width
    of it.
    """
    width = gap.high - gap.low
    near = np.linspace(gap.low - width, gap.high + width, 201)
    near = near[(near >= law.nodes[0]) & (near <= law.nodes[-1])]
    size = float(np.ptp(force_of(law, law.force, near)))
    share = (law.nodes - gap.low) / width
    inside = (share > 0.0) & (share < 1.0)
    return np.stack([np.where(inside, size / m * np.sin(m * np.pi * share), 0.0) for m in range(1, SHAPES + 1)])


def gap_covariance(gaps: list[Gap], law: Law, gain: Array, rows: Rows) -> Array:
    """Return the covariance of the force (N^2) by what the gaps hide, shape (nodes, nodes)."""
    total = np.zeros((len(law.force), len(law.force)))
    for gap in gaps:
        hidden = hidden_force(gap, law)
        seen = hidden @ rows.virial.T @ gain.T - hidden  # what is found of it, less what is there
        total += seen.T @ seen
    return total
