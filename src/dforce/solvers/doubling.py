r"""Doubled motions: where a multiplier of an orbit passes -1, the tip begins to alternate between two taps.

Orbits that repeat only after twice the periods leave the curve there. On both sides of it they are one motion, begun
at the one tap or at the other, and lie along the eigenvector of the multiplier, at first across the parameter.

Source: Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, Springer (2004), sections 5.4 and 10.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from dforce.kernel import Array
from dforce.solvers.continuation import Curve, alternation
from dforce.solvers.fixed_point import MOST_REPEATS, PERIOD_DOUBLING, Orbit, PeriodMap, along_parameter, correct
from dforce.solvers.transient import Watch

OFFSETS = (
    0.1,
    0.03,
    0.01,
    0.003,
)  # of the largest step along a curve: how far from the point a doubled motion is sought
DISTANCES = (0.003, 0.01, 0.03, 0.1, 0.2, 0.3)  # of the free amplitude, between a doubled motion and the single one
APART = 1e-4  # of the free amplitude: motions nearer to each other are one


def doublings(period_map: PeriodMap, curves: list[Curve], largest: float, watch: Watch) -> Iterator[Orbit]:
    """Give a doubled motion beside each period doubling from which none of the curves leads away.

    `curves` is to grow by the curve of each orbit, of steps of at most `largest` (scaled), before the next one is asked for.
    """
    number = 0
    while number < len(curves):  # which grow meanwhile: the curves of doubled motions have period doublings, too
        curve = curves[number]
        number += 1
        for orbit in curve.points:
            if orbit.special == PERIOD_DOUBLING and 2 * orbit.repeats <= MOST_REPEATS:
                watch()
                found = None if _is_left(period_map, curves, orbit, largest) else beside(period_map, orbit, largest)
                if found is not None:
                    yield found


def beside(period_map: PeriodMap, orbit: Orbit, largest: float) -> Orbit | None:
    """Return a doubled motion near a period doubling, its tangent away from there; None where there is none.

    It is sought around the single motion a little to one side of the point and to the other: at the point itself both are
    one, and Newton's method, from there, comes to either.
    """
    single, across = period_map.repeated(orbit.repeats), along_parameter(period_map.size)
    for offset, side in product(OFFSETS, (1.0, -1.0)):
        away = side * offset * largest
        guess = orbit.u + orbit.tangent * (away / orbit.tangent[-1])
        if not period_map.low <= guess[-1] <= period_map.high:
            continue
        there = correct(single, guess, across, orbit.latched, (orbit.jacobian, orbit.slope))
        found = [] if there is None else doubled_beside(period_map, there, 2 * orbit.repeats)
        if found:
            nearest = found[0]
            return replace(nearest if side * nearest.tangent[-1] > 0.0 else nearest.reversed(), special="")
    return None


def doubled_beside(period_map: PeriodMap, orbit: Orbit, repeats: int) -> list[Orbit]:
    """Return the orbits of so many common periods, a power of two, that Newton's method finds around another."""
    if repeats == orbit.repeats:
        return [orbit]
    if repeats % (2 * orbit.repeats):
        return []
    doubled, flip = period_map.repeated(2 * orbit.repeats), np.append(flip_vector(orbit), 0.0)
    across = along_parameter(period_map.size)
    found: list[Orbit] = []
    for distance in DISTANCES:
        one = correct(doubled, orbit.u + distance * flip, across, orbit.latched)
        if one is None or float(np.abs(alternation(doubled, one)).max()) < APART:
            continue
        if all(float(np.abs(one.u - other.u).max()) > APART for other in found):
            found.append(one)
    return [last for one in found for last in doubled_beside(period_map, one, repeats)]


def flip_vector(orbit: Orbit) -> Array:
    """Return the unit eigenvector of the multiplier next to -1."""
    values, vectors = np.linalg.eig(orbit.jacobian)
    flip = np.real(vectors[:, int(np.argmin(np.abs(values + 1.0)))])
    return np.asarray(flip / np.linalg.norm(flip), dtype=float)


def _is_left(period_map: PeriodMap, curves: list[Curve], orbit: Orbit, largest: float) -> bool:
    """Say whether a curve of doubled motions comes so near to a period doubling that it begins or ends there."""
    ends = [
        end for curve in curves if curve.repeats == 2 * orbit.repeats for end in (curve.points[0], curve.points[-1])
    ]
    u = orbit.u
    for _ in range(orbit.repeats):  # the curve may go along the motion as begun in another period
        if any(float(np.linalg.norm(end.u - u)) < largest for end in ends):
            return True
        period_map.put(u[-1])
        u = np.append(period_map.end(u[:-1], orbit.latched), u[-1])
    return False
