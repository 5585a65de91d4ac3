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
from itertools import combinations, product

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
    orbit_from,
)
from dforce.solvers.integrator import Motion, free_amplitudes, with_amplitudes
from dforce.solvers.transient import Watch, decay_periods

EASY, HARD = 3, 6  # corrections up to which the step grows, and from which on it shrinks
GROWTH = 1.5
SMALLEST = 1e-6  # step at which a curve is given up
LOOP = 4  # points before a curve may close
STRAIGHT = 0.9  # cosine of the largest turn of the tangent in a step
ASTRAY = 0.5  # of a step: an orbit farther from its prediction may be on another curve
SHARP = 1e-7  # of a step: how well a special point is located
SAME = 1e-5  # of the free amplitude: orbits nearer to each other are one
NEAR = 0.05  # of the free amplitude: how near to a known curve an orbit is looked at closely
SHARES = (0.3, 0.7, 1.05)  # of the room for the amplitude: with which a search starts
LAGS = (20.0, 60.0, 100.0, 140.0)  # degrees: phase lags with which it starts
SEARCH_DECAYS, MOST_SEARCH = 6, 1000  # decay times and periods after which Newton's method takes a search over
EDGE = 1e-12  # of the free amplitude: how near to the edge between two basins a saddle is sought
EDGE_PERIODS = 300  # common periods for which a motion on the edge is watched
ALIKE = 0.02  # of the free amplitude: a motion so near to an orbit settles there


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

    It also ends, with its last point marked ``end``, where no step however short leads on, and after `most` points. All that
    the next point depends on is kept in the first and the last one, so that a curve may be traced in parts.
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


def crossings(curves: list[Curve], value: float) -> list[Orbit]:
    """Return where known curves cross a scaled value of the parameter, interpolated between their points."""
    found = []
    for curve in curves:
        points = curve.points
        values = np.array([point.u[-1] for point in points]) - value
        passed = (values[:-1] * values[1:] < 0.0) | (values[:-1] == 0.0)
        passed[-1:] |= values[-1] == 0.0
        for i in np.flatnonzero(passed):
            share = values[i] / (values[i] - values[i + 1]) if values[i] != values[i + 1] else 0.0
            u = points[i].u + share * (points[i + 1].u - points[i].u)
            u[-1] = value
            found.append(replace(points[i], u=u))
    return found


def is_known(period_map: PeriodMap, curves: list[Curve], orbit: Orbit) -> bool:
    """Say whether an orbit lies on a curve that was traced before."""
    across = along_parameter(period_map.size)
    for near in crossings(curves, float(orbit.u[-1])):
        if np.abs(near.u - orbit.u).max() < NEAR:
            there = correct(period_map, near.u, across, orbit.latched, (orbit.jacobian, orbit.slope))
            if there is not None and np.abs(there.u - orbit.u).max() < SAME:
                return True
    return False


def search(period_map: PeriodMap, curves: list[Curve], value: float, watch: Watch) -> Iterator[Orbit]:
    """Give orbits at a scaled value of the parameter that lie on none of the curves, each one curve's first.

    `curves` is to grow by the curve of each orbit before the next one is asked for.
    """
    seen: list[Array] = []
    for motion in _transients(period_map, value):
        watch()
        x = period_map.state(motion)
        if any(np.abs(u[:-1] - x).max() < ALIKE for u in [*seen, *(near.u for near in crossings(curves, value))]):
            continue
        found = orbit_from(period_map, motion, value)
        if found is not None:
            seen.append(found.u)
            if not is_known(period_map, curves, found):
                yield found
    yield from _saddles(period_map, curves, value, watch)


def _periods(period_map: PeriodMap) -> int:
    """Return the periods of a search's transients: whole common periods of the tones."""
    periods = min(SEARCH_DECAYS * decay_periods(period_map.integrator.problem), MOST_SEARCH)
    return period_map.common * math.ceil(periods / period_map.common)


def _transients(period_map: PeriodMap, value: float) -> Iterator[Motion]:
    """Give the ends of transients from several amplitudes and phases of the first tone.

    The amplitudes are shares of the free amplitude, or of the distance where that is less.
    """
    integrator = period_map.integrator
    for share, lag in product(SHARES, LAGS):
        period_map.put(value)
        first, zc = integrator.problem.tones[0], integrator.p[0]
        room = min(first.A0, zc) if zc > 0.0 else first.A0
        amplitudes = free_amplitudes(integrator)
        amplitudes[0] = 0.0
        amplitudes[0, first.mode] = share * room * np.exp(1j * (first.phase - math.radians(lag)))
        motion, _ = integrator.lock_in(with_amplitudes(integrator, amplitudes), _periods(period_map))
        if motion.is_finite:
            yield motion


def _saddles(period_map: PeriodMap, curves: list[Curve], value: float, watch: Watch) -> Iterator[Orbit]:
    """Give unstable orbits between stable ones, as long as some must be missing.

    The signs of det(1 - J) of all orbits add up to one, since all motions end in a bounded region (M. Krasnosel'skii,
    The Operator of Translation along the Trajectories of Differential Equations, AMS (1968)): two stable states come
    with a saddle.
    """
    one = np.eye(period_map.size)
    for a, b in combinations([near for near in crossings(curves, value) if near.is_stable], 2):
        if sum(np.sign(np.linalg.det(one - near.jacobian)) for near in crossings(curves, value)) <= 1.0:
            return
        found = _on_the_edge(period_map, a, b, value, watch)
        if found is not None and not is_known(period_map, curves, found):
            yield found


def _on_the_edge(period_map: PeriodMap, a: Orbit, b: Orbit, value: float, watch: Watch) -> Orbit | None:
    """Return the saddle on the edge between the basins of two stable orbits, found by halving the way between them."""
    integrator = period_map.integrator
    period_map.put(value)
    ends = a.u[:-1], b.u[:-1]
    near_a, near_b = ends
    while np.abs(near_a - near_b).max() > EDGE:
        watch()
        middle = 0.5 * (near_a + near_b)
        motion, _ = integrator.lock_in(period_map.motion(middle, a.latched), _periods(period_map))
        if not motion.is_finite:
            return None
        to_a, to_b = (float(np.abs(period_map.state(motion) - end).max()) for end in ends)
        near_a, near_b = (middle, near_b) if to_a < to_b else (near_a, middle)
    # on the edge the motion comes to the saddle, and leaves it in the end: it is nearest where it moves least
    x, slowest, least = near_a, near_a, math.inf
    for _ in range(EDGE_PERIODS):
        after = period_map.end(x, a.latched)
        change = float(np.abs(after - x).max())
        if change < least:
            slowest, least = x, change
        x = after
    return correct(period_map, np.append(slowest, value), along_parameter(period_map.size), a.latched)
