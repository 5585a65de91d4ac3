"""Curves of periodic orbits along a parameter, stable or not, through folds: pseudo-arclength continuation.

An orbit is predicted along the curve's tangent and corrected by Newton's method in the plane across it, so that a fold
is a point like any other. Lengths along a curve are scaled as in ``fixed_point``.

Sources: H. B. Keller, in Applications of Bifurcation Theory, Academic Press (1977), p. 359; R. Seydel, Practical
Bifurcation and Stability Analysis, Springer (2010), chapters 4 and 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from dforce.kernel import Array
from dforce.solvers.fixed_point import (
    END,
    FOLD,
    GRAZING,
    PERIOD_DOUBLING,
    TORUS,
    Orbit,
    PeriodMap,
    along_parameter,
    correct,
)
from dforce.solvers.transient import Watch

EASY, HARD = 3, 6  # corrections up to which the step grows, and from which on it shrinks
GROWTH = 1.5
SMALLEST = 1e-6  # step at which a curve is given up
LOOP = 4  # points before a curve may close
STRAIGHT = 0.9  # cosine of the largest turn of the tangent in a step
ASTRAY = 0.5  # of a step: an orbit farther from its prediction may be on another curve
SHARP = 1e-7  # of a step: how well a special point is located
MERGES = 4.0  # times the step: motions of both periods nearer to each other have become one within it


class Curve:
    """A connected curve of orbits, grown in two directions from the orbit where it was found."""

    def __init__(self, start: Orbit) -> None:
        self.forth = [start]
        self.back = [start.reversed()]

    @classmethod
    def of_places(cls, orbits: Mapping[int, Orbit]) -> Curve:
        """Return the curve that has these orbits at these places."""
        curve = cls(orbits[0])
        curve.forth += [orbits[place] for place in sorted(orbits) if place > 0]
        curve.back += [orbits[place] for place in sorted(orbits, reverse=True) if place < 0]
        return curve

    @property
    def repeats(self) -> int:
        """After how many common periods the motions on it repeat."""
        return self.forth[0].repeats

    @property
    def points(self) -> list[Orbit]:
        """The orbits in order along the curve."""
        return [*reversed(self.back[1:]), *self.forth]

    @property
    def places(self) -> list[int]:
        """The places of these orbits, counted from the one where the curve was found; those behind it are negative."""
        return [*range(1 - len(self.back), 0), *range(len(self.forth))]

    def grow(self, period_map: PeriodMap, largest: float, most: int, watch: Watch) -> None:
        """Trace it both ways in steps of at most `largest` (scaled), up to so many points in all, on from what there is."""
        if _is_closed(self.back):
            return
        closed = trace(period_map, self.forth, largest, most, watch)
        if not closed and trace(period_map, self.back, largest, most - len(self.forth) + 1, watch):
            del self.forth[1:]  # the other way led all around: what was traced before lies on it


def trace(period_map: PeriodMap, points: list[Orbit], largest: float, most: int, watch: Watch) -> bool:
    """Extend a curve beyond its last point until it leaves the parameter's range; return whether it closed.

    A curve of doubled motions ends where they repeat after half the periods, at a period doubling. Any curve ends, with its
    last point marked ``end``, where no step however short leads on, and after `most` points. All that the next point
    depends on is kept in the first and the last one, so that a curve may be traced in parts.
    """
    start, last = points[0], points[-1]
    if _is_closed(points) or (len(points) > 1 and last.special):
        return _is_closed(points)
    step = last.step or 0.1 * largest
    across = along_parameter(period_map.size)
    while len(points) < most:
        watch()
        ahead = float(last.tangent[-1])
        bound = period_map.high if ahead > 0.0 else period_map.low
        reach = (bound - last.u[-1]) / ahead if ahead else math.inf
        if reach < SMALLEST:
            return False
        lands = reach <= step
        guess = last.u + min(step, reach) * last.tangent
        if lands:
            guess[-1] = bound
        normal = math.copysign(1.0, ahead) * across if lands else last.tangent
        found = correct(period_map, guess, normal, last.latched, (last.jacobian, last.slope))
        if found is not None:
            found = replace(found, step=min(largest, step * _growth(found)))
            if _halves(period_map, last, found, min(step, reach)):
                return False
        if found is None or not _is_next(period_map, last, found, guess, min(step, reach)):
            step = 0.5 * min(step, reach)
            if step < SMALLEST:
                points[-1] = replace(last, special=last.special or _ending(period_map, last))
                return False
            continue
        between = specials(period_map, last, found)
        closed = len(points) + len(between) >= LOOP and _passes(last, found, start)
        points += [*between, replace(start, tangent=found.tangent) if closed else found]
        if closed or lands:
            return closed
        last, step = found, found.step
    points[-1] = replace(last, special=last.special or END)
    return False


def _is_closed(points: list[Orbit]) -> bool:
    """Say whether a curve has come back to its start."""
    return len(points) > LOOP and np.array_equal(points[-1].u, points[0].u)


def _growth(found: Orbit) -> float:
    """Return by how much the next step is longer than the one that led to an orbit."""
    corrections = found.values["corrections"]
    return GROWTH if corrections <= EASY else 1.0 / GROWTH if corrections >= HARD else 1.0


def _is_next(period_map: PeriodMap, last: Orbit, found: Orbit, guess: Array, step: float) -> bool:
    """Say whether an orbit is the curve's next one, and not one of a neighboring curve or outside the range."""
    room = 1e-12 * (1.0 + abs(period_map.high))
    inside = period_map.low - room <= found.u[-1] <= period_map.high + room
    straight = float(found.tangent @ last.tangent) > STRAIGHT
    near = float(np.linalg.norm(found.u - guess)) < ASTRAY * step
    return inside and straight and near and found.orientation == last.orientation


def _halves(period_map: PeriodMap, last: Orbit, found: Orbit, step: float) -> bool:
    """Say whether doubled motions have become motions of half the period in a step: the two taps change places there."""
    if period_map.repeats % 2:
        return False
    before, after = (alternation(period_map, orbit) for orbit in (last, found))
    return float(np.linalg.norm(before)) < MERGES * step and float(before @ after) <= SHARP * float(before @ before)


def alternation(period_map: PeriodMap, orbit: Orbit) -> Array:
    """Return by how much a state on an orbit differs from that half the periods later, scaled."""
    period_map.put(orbit.u[-1])
    return period_map.repeated(period_map.repeats // 2).end(orbit.u[:-1], orbit.latched) - orbit.u[:-1]


def _ending(period_map: PeriodMap, last: Orbit) -> str:
    """Say where a curve ends: where the tip grazes a kink, by less than steps in time can resolve, or anywhere else."""
    integrator = period_map.integrator
    dip = 0.5 * (math.pi / integrator.points) ** 2 * integrator.scales.length
    return GRAZING if (np.abs(last.gaps) < dip).any() else END


def _passes(last: Orbit, found: Orbit, start: Orbit) -> bool:
    """Say whether the step from one orbit to the next passes the point where the curve started."""
    chord, there = found.u - last.u, start.u - last.u
    share = float(there @ chord) / float(chord @ chord)
    aside = float(np.linalg.norm(there - share * chord))
    along = float(start.tangent @ chord) > 0.0
    return along and 0.0 < share <= 1.0 and aside < 0.1 * float(np.linalg.norm(chord))


def specials(period_map: PeriodMap, a: Orbit, b: Orbit) -> list[Orbit]:
    """Return the special points between two neighboring orbits, in order."""
    found = []
    for name, test in _tests(a, b):
        if test(a) * test(b) < 0.0:
            found.append(replace(_located(period_map, a, b, test), special=name))
    if not found and a.is_stable != b.is_stable:
        point = _located(period_map, a, b, lambda orbit: abs(orbit.multipliers[0]) - 1.0)
        found.append(replace(point, special=TORUS))
    return sorted(found, key=lambda point: float((point.u - a.u) @ (b.u - a.u)))


def _tests(a: Orbit, b: Orbit) -> Iterator[tuple[str, Callable[[Orbit], float]]]:
    """Give the functions that pass zero at a special point; all but the tangent's are independent of the direction."""
    yield FOLD, lambda orbit: float(orbit.tangent[-1])
    yield PERIOD_DOUBLING, lambda orbit: float(np.linalg.det(orbit.jacobian + np.eye(len(orbit.slope))))
    for which in range(len(a.gaps)):
        yield GRAZING, lambda orbit, which=which: float(orbit.gaps[which])  # type: ignore[misc]


def _located(period_map: PeriodMap, a: Orbit, b: Orbit, test: Callable[[Orbit], float]) -> Orbit:
    """Return the orbit between two neighbors at which a function passes zero, or the one found nearest to that."""
    from scipy.optimize import brentq

    chord = b.u - a.u
    normal = chord / np.linalg.norm(chord)
    found = {0.0: a, 1.0: b}

    def at(share: float) -> float:
        if share not in found:
            near = a if share < 0.5 else b
            orbit = correct(period_map, a.u + share * chord, normal, near.latched, (near.jacobian, near.slope))
            if orbit is None:
                raise ArithmeticError
            found[share] = orbit
        return test(found[share])

    try:
        return found[brentq(at, 0.0, 1.0, xtol=SHARP)]
    except ArithmeticError:  # the way there is lost, where the map is rough
        return min(found.values(), key=lambda orbit: abs(test(orbit)))
