r"""The search for all periodic orbits at one value of a parameter, and a check that none is missing.

Orbits are fixed points of the map P over a common period. Transients lead to the stable ones, the edge between two basins to
a saddle, and Newton's method from many starts to any; deflation keeps it from what is known.

The check: where the map is continuous and all motions end in a bounded region, the indices of its fixed points,
:math:`\mathrm{sign} \det(1 - M)` with the monodromy matrix M, add up to one. Turn the tip–sample force down by a factor
s from 1 to 0. No fixed point comes from or goes to infinity on the way, as the damped lever holds all of them in a bounded
region, so the degree of 1 - P there stays what it is at s = 0: that of the free lever, whose one orbit has its multipliers
in complex pairs within the unit circle, and so the index +1. Stable states and saddles with one multiplier below -1 count
+1, saddles with one above +1 count -1. A sum other than one says that a state is missing. It is one, too, where two of
opposite index are missing. A force that jumps or has branches leaves the map discontinuous, and proves nothing.

Sources: N. Levinson, Ann. Math. 45, 723 (1944), for one mode; M. A. Krasnosel'skii, The Operator of Translation along the
Trajectories of Differential Equations, AMS (1968), for any number; P. E. Farrell, Á. Birkisson, S. W. Funke, SIAM J. Sci.
Comput. 37, A2026 (2015), for deflation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, islice, product

import numpy as np

from dforce.kernel import Array
from dforce.problem import Problem
from dforce.solvers.continuation import Curve
from dforce.solvers.fixed_point import LARGEST, MOST_REPEATS, Orbit, PeriodMap, along_parameter, correct, orbit_from
from dforce.solvers.integrator import Motion, free_amplitudes, with_amplitudes
from dforce.solvers.transient import Watch, decay_periods

SAME = 1e-5  # of the free amplitude: orbits nearer to each other are one
NEAR = 0.05  # of the free amplitude: how near to a known orbit another is looked at closely
SHARES = (0.3, 0.7, 1.05)  # of the room for the amplitude: with which a transient starts
LAGS = (20.0, 60.0, 100.0, 140.0)  # degrees: phase lags with which it starts
SEARCH_DECAYS, MOST_SEARCH = 6, 1000  # decay times and periods after which Newton's method takes a transient over
EDGE = 1e-12  # of the free amplitude: how near to the edge between two basins a saddle is sought
EDGE_PERIODS = 300  # common periods for which a motion on the edge is watched
ALIKE = 0.02  # of the free amplitude: a motion so near to an orbit settles there
LEAST_STARTS, MOST_STARTS = 24, 240  # of Newton's method with deflation: at any rate, and while states are missing
STEPS = 20  # of it, from each start
CLOSE = 1e-3  # of the free amplitude: shorter Newton steps are left to the corrector
ROOMY = 1.5  # times the known motions: the box of starts
DEEPEST = 10.0  # free amplitudes: no starts are put near a sample that is farther away
STILL = 1e-12  # m/s, of a tip that turns
ROUNDING = 1e-12
JUMPS = 1e-6  # of the force: more than rounding


@dataclass(frozen=True)
class Crossing:
    """Where a curve crosses a value of the parameter: the orbit interpolated there, and its index along the curve."""

    orbit: Orbit
    index: int


def crossings(curve: Curve, value: float) -> list[Crossing]:
    r"""Return where a curve crosses a scaled value of the parameter.

    The index follows from the direction of travel, so that it needs no derivative near a fold: the tangent's last component
    is :math:`\det(M - 1)` over the determinant of the equations bordered by the tangent, whose sign is that of the whole curve.
    """
    points = curve.points
    values = np.array([point.u[-1] for point in points]) - value
    values[np.abs(values) < ROUNDING * (1.0 + abs(value))] = 0.0
    if len(points) == 1:
        return [Crossing(points[0], points[0].index)] if values[0] == 0.0 else []
    sense = (-1.0) ** (len(points[0].u) - 1) * curve.forth[0].orientation
    passed = (values[:-1] * values[1:] < 0.0) | (values[:-1] == 0.0)
    passed[-1:] |= values[-1] == 0.0
    found = []
    for i in np.flatnonzero(passed):
        share = values[i] / (values[i] - values[i + 1]) if values[i] != values[i + 1] else 0.0
        u = points[i].u + share * (points[i + 1].u - points[i].u)
        u[-1] = value
        near = points[i] if share < 0.5 else points[i + 1]
        found.append(Crossing(replace(near, u=u), int(sense * np.sign(values[i + 1] - values[i]))))
    return found


def index_sum(curves: list[Curve], value: float) -> int:
    """Return the sum of the indices of the known orbits at a scaled value of the parameter, those of one common period."""
    return sum(crossing.index for curve in curves if curve.repeats == 1 for crossing in crossings(curve, value))


def why_unproven(problem: Problem) -> str:
    """Return why the sum of the indices need not be one with these forces; empty where it must."""
    for force in problem.forces:
        if force.switch is not None:
            return f"{force.name} has two branches"
        if force.memory:
            return f"{force.name} has a memory"
        if force.jumps():
            return f"{force.name} jumps at {1e9 * force.jumps()[0]:.3g} nm"
        law, leading, values = force.law_function(), force.leading(), force.values()
        places = (0.0,) if "zc" in leading else ()
        for d in (-1e-9, *force.kinks(), 1e-10, 1e-9, 1e-8):
            away, toward = (law(d, rate, 0.0, *places, *values) for rate in (STILL, -STILL))
            if abs(away - toward) > JUMPS * max(abs(away), abs(toward)):
                return f"{force.name} jumps where the tip turns"
    return ""


class Known:
    """The orbits known at one scaled value of the parameter, as curves that may become more cross it."""

    def __init__(self, period_map: PeriodMap, curves: list[Curve], value: float) -> None:
        self.period_map, self.curves, self.value = period_map, curves, value
        self._exact: list[list[Orbit]] = []

    @property
    def index_sum(self) -> int:
        """The sum of their indices."""
        return index_sum(self.curves, self.value)

    def orbits(self) -> list[Orbit]:
        """Return them, corrected; interpolated where that fails."""
        for curve in self.curves[len(self._exact) :]:
            self._exact.append([self._corrected(crossing.orbit) for crossing in crossings(curve, self.value)])
        return [orbit for exact in self._exact for orbit in exact]

    def _corrected(self, near: Orbit) -> Orbit:
        period_map = self.period_map.repeated(near.repeats)
        across = along_parameter(period_map.size)
        found = correct(period_map, near.u, across, near.latched, (near.jacobian, near.slope))
        return near if found is None or np.abs(found.u - near.u).max() > ALIKE else found

    def hold(self, orbit: Orbit) -> bool:
        """Say whether an orbit is one of them, begun in any of its periods."""
        alike = [known for known in self.orbits() if known.repeats == orbit.repeats]
        x = orbit.u[:-1]
        for _ in range(orbit.repeats):
            if any(self._is(known, x, orbit) for known in alike):
                return True
            self.period_map.put(self.value)
            x = self.period_map.end(x, orbit.latched)
        return False

    def _is(self, known: Orbit, x: Array, orbit: Orbit) -> bool:
        """Say whether a known orbit, that may be interpolated, passes a state of another one."""
        apart = float(np.abs(known.u[:-1] - x).max())
        if not SAME <= apart < NEAR:
            return apart < SAME
        period_map = self.period_map.repeated(orbit.repeats)
        there = correct(
            period_map, known.u, along_parameter(period_map.size), orbit.latched, (orbit.jacobian, orbit.slope)
        )
        return there is not None and float(np.abs(there.u[:-1] - x).max()) < SAME


def search(known: Known, watch: Watch) -> Iterator[Orbit]:
    """Give orbits that are not known, each one curve's first.

    The curves are to grow by that of each orbit before the next one is asked for.
    """
    for orbit in _candidates(known, watch):
        if not known.hold(orbit):
            yield orbit


def _candidates(known: Known, watch: Watch) -> Iterator[Orbit]:
    yield from _of_transients(known, watch)
    yield from _of_edges(known, watch)
    if not why_unproven(known.period_map.integrator.problem):
        yield from _of_newton(known, watch)


def _of_transients(known: Known, watch: Watch) -> Iterator[Orbit]:
    """Give orbits that Newton's method finds from the ends of transients, and stable ones of several periods."""
    period_map = known.period_map
    for motion in _transients(period_map, known.value):
        watch()
        x = period_map.state(motion)
        if any(np.abs(orbit.u[:-1] - x).max() < ALIKE for orbit in known.orbits()):
            continue
        found = orbit_from(period_map, motion, known.value)
        if found is not None:
            yield found
        if found is None or np.abs(found.u[:-1] - x).max() > ALIKE:
            several = _repeating(period_map, motion, known.value)
            if several is not None:
                yield several


def _repeating(period_map: PeriodMap, motion: Motion, value: float) -> Orbit | None:
    """Return the stable orbit of several common periods that a motion is near to; None where there is none of few periods."""
    period_map.put(value)
    x = period_map.state(motion)
    after = period_map.end(x, motion.latched)
    for repeats in range(2, MOST_REPEATS + 1):
        after = period_map.end(after, motion.latched)
        if np.abs(after - x).max() < ALIKE:
            found = orbit_from(period_map.repeated(repeats), motion, value)
            if (
                found is not None
                and np.abs(found.u[:-1] - x).max() < ALIKE
                and repeats == least_repeats(period_map, found)
            ):
                return found
    return None


def least_repeats(period_map: PeriodMap, orbit: Orbit) -> int:
    """Return after how many common periods an orbit, found as one of several, repeats in truth."""
    period_map.put(orbit.u[-1])
    x = orbit.u[:-1]
    for repeats in range(1, orbit.repeats):
        x = period_map.end(x, orbit.latched)
        if np.abs(x - orbit.u[:-1]).max() < SAME:
            return repeats
    return orbit.repeats


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


def _of_edges(known: Known, watch: Watch) -> Iterator[Orbit]:
    """Give unstable orbits between stable ones, as long as a saddle is missing."""
    stable = [orbit for orbit in known.orbits() if orbit.is_stable and orbit.repeats == 1]
    for a, b in combinations(stable, 2):
        if known.index_sum <= 1:
            return
        found = _on_the_edge(known.period_map, a, b, known.value, watch)
        if found is not None:
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


def _of_newton(known: Known, watch: Watch) -> Iterator[Orbit]:
    """Give orbits that Newton's method finds from many starts, deflated by those known, as long as any must be missing."""
    period_map, latched = known.period_map, np.zeros(0)
    for number, start in enumerate(islice(_starts(known), MOST_STARTS)):
        if number >= LEAST_STARTS and known.index_sum == 1:
            return
        watch()
        period_map.put(known.value)
        x = _deflated(period_map, start, [orbit.u[:-1] for orbit in known.orbits() if orbit.repeats == 1])
        if x is not None:
            found = correct(period_map, np.append(x, known.value), along_parameter(period_map.size), latched)
            if found is not None:
                yield found


def _starts(known: Known) -> Iterator[Array]:
    """Give starts of Newton's method: between known orbits, then all over a box around them and one that reaches the sample.

    The points are frac(i sqrt(p)), with a prime p for each number of the state: H. Niederreiter, Random Number Generation and
    Quasi-Monte Carlo Methods, SIAM (1992), chapter 3.
    """
    period_map = known.period_map
    orbits = [orbit.u[:-1] for orbit in known.orbits() if orbit.repeats == 1]
    yield from (0.5 * (a + b) for a, b in combinations(orbits, 2))
    integrator, n = period_map.integrator, period_map.size
    first = integrator.problem.tones[0].frequency
    speeds = np.array([mode.f0 / first for mode in integrator.problem.modes])
    free = np.abs(free_amplitudes(integrator)).sum(0) / integrator.scales.length
    reach = np.abs([np.zeros(n), *orbits]).max(0)
    size = ROOMY * np.maximum(reach[::2], np.maximum(reach[1::2] / speeds, free))
    gap = integrator.p[0] / integrator.scales.length
    deep = size.copy()
    deep[0] = max(deep[0], ROOMY * gap) if gap < DEEPEST else deep[0]
    steps = np.sqrt(_primes(n))
    i = 0
    while True:
        i += 1
        place = 2.0 * ((i * steps) % 1.0) - 1.0
        box = deep if i % 2 else size
        yield place * np.column_stack([box, box * speeds]).ravel()


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in found):
            found.append(number)
        number += 1
    return found


def _deflated(period_map: PeriodMap, start: Array, known: list[Array]) -> Array | None:
    r"""Return a state near a fixed point of the map that is none of those known; None where Newton's method finds none.

    It solves :math:`m(x) (P(x) - x) = 0` with :math:`m = \prod_i (1 + |x - x_i|^{-2})`, whose Newton step is that of
    :math:`P(x) - x`, called s, over :math:`1 - s \cdot \nabla \ln m`.
    """
    x, latched, one = start, np.zeros(0), np.eye(period_map.size)
    for _ in range(STEPS):
        after = period_map.end(x, latched)
        if not np.isfinite(after).all():
            return None
        try:
            step = np.linalg.solve(period_map.monodromy(x, latched, after) - one, x - after)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(step).all():
            return None
        pull = 0.0
        for other in known:
            square = float((x - other) @ (x - other))
            if square == 0.0:
                return None
            pull -= 2.0 * float(step @ (x - other)) / (square * (1.0 + square))
        if float(np.abs(step).max()) < CLOSE and abs(pull) < 1.0:
            return np.asarray(x + step, dtype=float)
        step = step / (1.0 - pull) if pull != 1.0 else step
        longest = float(np.abs(step).max())
        x = x + step * min(1.0, LARGEST / longest)
    return None
