r"""Doubled motions: where a multiplier of an orbit passes -1, the tip begins to alternate between two taps.

Orbits that repeat only after twice the periods leave the curve there. Both sides have the same motion, begun at either tap.
They lie along the eigenvector of the multiplier, at first across the parameter.

Source: Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, Springer (2004), sections 5.4 and 10.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.continuation import Curve, alternation
from dforce.solvers.orbit import PERIOD_DOUBLING, Orbit
from dforce.solvers.parameter_range import MOST_REPEATS, ParameterRange
from dforce.solvers.transient import CancelCheck

# of the largest step along a curve: how far from the point a doubled motion is sought
OFFSETS = (0.1, 0.03, 0.01, 0.003)
DISTANCES = (0.003, 0.01, 0.03, 0.1, 0.2, 0.3)  # of the free amplitude, between a doubled motion and the single one
APART = 1e-4  # of the free amplitude: motions nearer to each other are one


def doublings(
    among: ParameterRange, curves: list[Curve], largest: float, check_cancelled: CancelCheck
) -> Iterator[Curve]:
    """Give the beginning of a curve of doubled motions beside each period doubling from which none of the curves leads away.

    `curves` is to grow by each of them, of steps of at most `largest` (scaled), before the next one is asked for.
    """
    number = 0
    while number < len(curves):  # which grow meanwhile: the curves of doubled motions have period doublings, too
        curve = curves[number]
        number += 1
        for orbit in curve.points:
            if orbit.special == PERIOD_DOUBLING and 2 * orbit.repeats <= MOST_REPEATS:
                check_cancelled()
                found = None if _is_left(among, curves, orbit, largest) else beside(among, orbit, largest)
                if found is not None:
                    yield found


def beside(among: ParameterRange, orbit: Orbit, largest: float) -> Curve | None:
    """Return a doubled motion near a period doubling, as a curve that leads away from it; None where there is none.

    It is sought around the single motion a little to both sides of the point: at the point itself both motions are one, and
    Newton's method may find either.
    """
    for offset, side in product(OFFSETS, (1.0, -1.0)):
        guess = orbit.u + orbit.tangent * (side * offset * largest / orbit.tangent[-1])
        if not among.low <= guess[-1] <= among.high:
            continue
        there = among.find(guess, orbit.kept.branch, repeats=orbit.repeats)
        found = [] if there is None else doubled_beside(among, there, 2 * orbit.repeats)
        if found:
            return Curve.rising(found[0], side)
    return None


def doubled_beside(among: ParameterRange, orbit: Orbit, repeats: int) -> list[Orbit]:
    """Return the orbits of `repeats` common periods, a power of two, that Newton's method finds around another."""
    if repeats == orbit.repeats:
        return [orbit]
    if repeats % (2 * orbit.repeats):
        return []
    flip, found = np.append(flip_vector(orbit), 0.0), list[Orbit]()
    for distance in DISTANCES:
        one = among.find(orbit.u + distance * flip, orbit.kept.branch, repeats=2 * orbit.repeats)
        if one is None or float(np.abs(alternation(among, one)).max()) < APART:
            continue
        if all(float(np.abs(one.u - other.u).max()) > APART for other in found):
            found.append(one)
    return [last for one in found for last in doubled_beside(among, one, repeats)]


def flip_vector(orbit: Orbit) -> Array:
    """Return the unit eigenvector of the multiplier next to -1."""
    values, vectors = np.linalg.eig(orbit.monodromy)
    flip = np.real(vectors[:, int(np.argmin(np.abs(values + 1.0)))])
    return np.asarray(flip / np.linalg.norm(flip), dtype=float)


def _is_left(among: ParameterRange, curves: list[Curve], orbit: Orbit, largest: float) -> bool:
    """Return whether a curve of doubled motions comes so near to a period doubling that it begins or ends there."""
    ends = [
        end for curve in curves if curve.repeats == 2 * orbit.repeats for end in (curve.points[0], curve.points[-1])
    ]
    state = orbit.state
    for _ in range(orbit.repeats):  # the curve may go along the motion as begun in another period
        u = np.append(among.vectors(state)[0], orbit.u[-1])
        if any(float(np.linalg.norm(end.u - u)) < largest for end in ends):
            return True
        state = among.later(state, orbit.u[-1], 1)
    return False
