"""Curves of periodic orbits along a parameter, stable or not, through folds: pseudo-arclength continuation.

An orbit is predicted along the curve's tangent and corrected by Newton's method in the plane across it, so that a fold is an
ordinary point. Lengths along a curve are lengths of ``Orbit.u``, scaled. The continuation depends only on the curve's orbits.

Sources: H. B. Keller, in Applications of Bifurcation Theory, Academic Press (1977), p. 359; R. Seydel, Practical
Bifurcation and Stability Analysis, Springer (2010), chapters 4 and 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.orbit import END, FOLD, GRAZING, PERIOD_DOUBLING, TORUS, Orbit
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.transient import CancelCheck

FIRST = 0.1  # of the largest step: the first one
EASY = 0.1  # of a step: where the orbit is so near to its prediction the next step grows
GROWTH = 1.5
SMALLEST = 1e-6  # step at which a curve is given up
LOOP = 4  # points before a curve may close
STRAIGHT = 0.9  # cosine of the largest turn of the tangent in a step
ASTRAY = 0.5  # of a step: an orbit farther from its prediction may be on another curve
SHARP = 1e-7  # of a step: how well a special point is located
MERGES = 4.0  # times the step: motions of both periods nearer to each other have become one within it


class Curve:
    """A connected curve of orbits, grown in two directions from the orbit where it was found.

    Parameters
    ----------
    start
        That orbit.
    way
        1 or -1: whether it is traced along the tangent first, or against it.
    """

    def __init__(self, start: Orbit, way: int = 1) -> None:
        self.way, self.forth, self.back = way, [start], [start]

    @classmethod
    def of_points(cls, points: list[Orbit], begun: int) -> Curve:
        """Return the curve with these orbits in order, from its :attr:`begun`."""
        start = abs(begun) - 1
        curve = cls(points[start], 1 if begun > 0 else -1)
        curve.forth, curve.back = points[start:], points[start::-1]
        return curve

    @classmethod
    def rising(cls, start: Orbit, sense: float = 1.0) -> Curve:
        """Return the curve that is traced first to where the parameter rises, or falls where `sense` is negative."""
        return cls(start, 1 if sense * start.tangent[-1] > 0.0 else -1)

    @property
    def repeats(self) -> int:
        """After how many common periods the motions on it repeat."""
        return self.forth[0].repeats

    @property
    def points(self) -> list[Orbit]:
        """The orbits in order along the curve."""
        return [*reversed(self.back[1:]), *self.forth]

    @property
    def begun(self) -> int:
        """At which of its points, counted from 1, it was found; negative where it was traced against the tangent first."""
        return self.way * len(self.back)

    def grow(self, among: ParameterRange, largest: float, most: int, check_cancelled: CancelCheck) -> None:
        """Extend the curve both ways in steps of at most `largest` (scaled), up to so many points in all."""
        if _is_closed(self.back):
            return
        closed = trace(among, self.forth, self.way, largest, most, check_cancelled)
        if not closed and trace(among, self.back, -self.way, largest, most - len(self.forth) + 1, check_cancelled):
            del self.forth[1:]  # the other way led all around: the points traced before lie on it


def trace(
    among: ParameterRange, points: list[Orbit], way: int, largest: float, most: int, check_cancelled: CancelCheck
) -> bool:
    """Extend a curve beyond its last point until it leaves the parameter's range; return whether it closed.

    `way` is 1 along the tangent and -1 against it. A curve of doubled motions ends where they repeat after half the periods,
    at a period doubling. Any curve ends, with its last point marked ``end``, where even the shortest step fails, and after
    `most` points. The next point depends on the points alone, so that a curve may be traced in parts.
    """
    start, last = points[0], points[-1]
    if _is_closed(points) or (len(points) > 1 and last.special):
        return _is_closed(points)
    step = _next_step(points, largest)
    while len(points) < most:
        check_cancelled()
        ahead = way * float(last.tangent[-1])
        bound = among.high if ahead > 0.0 else among.low
        reach = (bound - last.u[-1]) / ahead if ahead else math.inf
        if reach < SMALLEST:
            return False
        step = min(step, reach)
        guess = last.u + way * step * last.tangent
        if step == reach:
            guess[-1] = bound
        found = among.find(guess, last.kept.branch, None if step == reach else last.tangent, last.repeats)
        if found is not None and _halves(among, last, found, step):
            return False
        if found is None or not _is_next(among, last, found, guess):
            step = 0.5 * step
            if step < SMALLEST:
                points[-1] = replace(last, special=last.special or _ending(among, last))
                return False
            continue
        between = bifurcations(among, last, found)
        along = way * float(start.tangent @ (found.u - last.u)) > 0.0
        closed = along and len(points) + len(between) >= LOOP and passes(last.u, found.u, start.u)
        points += [*between, start if closed else found]
        if closed or step == reach:
            return closed
        last, step = found, _next_step(points, largest)
    points[-1] = replace(last, special=last.special or END)
    return False


def _is_closed(points: list[Orbit]) -> bool:
    """Return whether a curve has come back to its start."""
    return len(points) > LOOP and np.array_equal(points[-1].u, points[0].u)


def _next_step(points: list[Orbit], largest: float) -> float:
    """Return the step to be tried from the last point: as the last one, longer where that was predicted well."""
    last = points[-1]
    before = next((point for point in reversed(points[:-1]) if not point.special), None)
    if before is None:
        return FIRST * largest
    chord = last.u - before.u
    step = abs(float(chord @ before.tangent))
    astray = math.sqrt(max(0.0, float(chord @ chord) - step * step))
    return min(largest, step * (GROWTH if astray < EASY * step else 1.0))


def _is_next(among: ParameterRange, last: Orbit, found: Orbit, guess: Array) -> bool:
    """Return whether an orbit is the curve's next orbit, and not on a neighboring curve or outside the range."""
    room = 1e-12 * (1.0 + abs(among.high))
    inside = among.low - room <= found.u[-1] <= among.high + room
    straight = float(found.tangent @ last.tangent) > STRAIGHT
    astray, step = float(np.linalg.norm(found.u - guess)), float(np.linalg.norm(guess - last.u))
    return inside and straight and astray < ASTRAY * step


def _halves(among: ParameterRange, last: Orbit, found: Orbit, step: float) -> bool:
    """Return whether doubled motions have become motions of half the period in a step: their two periods change places."""
    if last.repeats % 2:
        return False
    before, after = (alternation(among, orbit) for orbit in (last, found))
    return float(np.linalg.norm(before)) < MERGES * step and float(before @ after) <= SHARP * float(before @ before)


def alternation(among: ParameterRange, orbit: Orbit) -> Array:
    """Return by how much the motion on an orbit differs from that half the periods later, scaled."""
    difference: Array = among.vectors(among.later(orbit.state, orbit.u[-1], orbit.repeats // 2))[0] - orbit.x
    return difference


def _ending(among: ParameterRange, last: Orbit) -> str:
    """Return the kind of a curve's end: the tip grazes a kink, by less than steps in time can resolve, or any other end."""
    dip = 0.5 * (math.pi / among.points) ** 2 * among.problem_at(last.value).tones[0].A0
    return GRAZING if (np.abs(last.gaps) < dip).any() else END


def passes(a: Array, b: Array, u: Array) -> bool:
    """Return whether the step from one point to the next passes a third point."""
    chord, there = b - a, u - a
    share = float(there @ chord) / float(chord @ chord)
    aside = float(np.linalg.norm(there - share * chord))
    return 0.0 < share <= 1.0 and aside < 0.1 * float(np.linalg.norm(chord))


def bifurcations(among: ParameterRange, a: Orbit, b: Orbit) -> list[Orbit]:
    """Return the special points between two neighboring orbits, in order."""
    found = []
    for name, test in _test_functions(a, b):
        if test(a) * test(b) < 0.0:
            found.append(replace(located(among, a, b, test), special=name))
    if not found and _growth(a) * _growth(b) < 0.0:
        point = located(among, a, b, _growth)
        if point.multipliers[0].imag:  # else it is the fold or doubling of the next step, beside which last bits decide
            found.append(replace(point, special=TORUS))
    return sorted(found, key=lambda point: float((point.u - a.u) @ (b.u - a.u)))


def _growth(orbit: Orbit) -> float:
    """Return by how much a disturbance along the largest multiplier grows over a period, relative to itself."""
    return float(np.abs(orbit.multipliers).max(initial=0.0)) - 1.0


def _test_functions(a: Orbit, b: Orbit) -> Iterator[tuple[str, Callable[[Orbit], float]]]:
    """Give the functions that pass zero at a special point; none depends on the direction."""
    yield FOLD, lambda orbit: float(orbit.tangent[-1])
    yield PERIOD_DOUBLING, lambda orbit: float(np.linalg.det(orbit.monodromy + np.eye(len(orbit.monodromy))))
    for which in range(len(a.gaps)):
        yield GRAZING, lambda orbit, which=which: float(orbit.gaps[which])  # type: ignore[misc]


def located(among: ParameterRange, a: Orbit, b: Orbit, test: Callable[[Any], float]) -> Any:
    """Return the orbit between two neighbors at which a test function passes zero, by Brent's method.

    Where the way there is lost the orbit found nearest to zero is returned.
    """
    from scipy.optimize import brentq

    chord = b.u - a.u
    normal = chord / np.linalg.norm(chord)
    found: dict[float, Orbit] = {0.0: a, 1.0: b}

    def at(share: float) -> float:
        if share not in found:
            near = a if share < 0.5 else b
            point = among.find(a.u + share * chord, near.kept.branch, normal, near.repeats)
            if point is None:
                raise ArithmeticError
            found[share] = point
        return test(found[share])

    try:
        return found[brentq(at, 0.0, 1.0, xtol=SHARP)]
    except ArithmeticError:  # the way there is lost, where the map is rough
        return min(found.values(), key=lambda point: abs(test(point)))
