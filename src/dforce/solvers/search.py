r"""The search for all periodic orbits at one value of a parameter, and a check that none is missing.

Orbits are fixed points of the map P over a common period. Transients lead to stable orbits, the edge between two basins to a
saddle, and Newton's method from many starts to any orbit; deflation keeps it from known orbits. In a plane (one mode without
memory) squares are quartered if the winding number along their edge shows an unknown orbit inside.

The check: if the map is continuous and all motions end in a bounded region, the indices of its fixed points add up to one:
:math:`\mathrm{sign} \det(1 - M)` with the monodromy matrix M. Turn the tip–sample force down by a factor s from
1 to 0. No fixed point comes from or goes to infinity on the way, because damping keeps all of them in a bounded region. So the
degree of 1 - P keeps its value at s = 0. The free lever's one orbit has its multipliers in complex pairs within the unit
circle, and so the index +1. Stable states and saddles with one multiplier below -1 count +1, saddles with one above +1 count
-1. With a sum other than one a state is missing. The sum is also one if two states of opposite index are missing. In a plane
the indices inside a square add up to the winding number of P(x) - x along its edge. With a force that jumps or has branches the
map is discontinuous, and nothing is proven.

Sources: N. Levinson, Ann. Math. 45, 723 (1944), for one mode; M. A. Krasnosel'skii, The Operator of Translation along the
Trajectories of Differential Equations, AMS (1968), for any number; P. E. Farrell, Á. Birkisson, S. W. Funke, SIAM J. Sci.
Comput. 37, A2026 (2015), for deflation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice, product

import numpy as np

from dforce.core.arrays import Array
from dforce.forces import in_first_contact
from dforce.problem import Problem
from dforce.solvers.continuation import Curve
from dforce.solvers.integrator import Integrator, with_amplitudes
from dforce.solvers.newton import LARGEST
from dforce.solvers.orbit import Orbit
from dforce.solvers.parameter_range import MOST_REPEATS, ParameterRange
from dforce.solvers.states import States
from dforce.solvers.transient import CancelCheck, decay_periods
from dforce.solvers.winding import Square

SAME = 1e-5  # of the free amplitude: orbits nearer to each other are one
NEAR = 0.05  # of the free amplitude: how near to a known orbit another is looked at closely
SHARES = (0.3, 0.7, 1.05)  # of the room for the amplitude: with which a transient starts
LAGS = (20.0, 60.0, 100.0, 140.0)  # degrees: phase lags with which it starts
SEARCH_DECAYS, MOST_SEARCH = 6, 1000  # decay times and periods after which Newton's method takes a transient over
EDGE = 1e-12  # of the free amplitude: how near to the edge between two basins a saddle is sought
EDGE_STARTS = 7  # motions between two states that are integrated side by side
EDGE_TRIES = 5  # of Newton's method, where a motion on the edge moves least
ALIKE = 0.02  # of the free amplitude: a motion so near to an orbit settles there
STARTS, ROUNDS, STEPS = 24, 10, 20  # of Newton's method with deflation: side by side; how often; from each start
CLOSE = 1e-3  # of the free amplitude: shorter Newton steps are left to the corrector
ROOMY = 1.5  # times the known motions: the box of starts
DEEPEST = 10.0  # free amplitudes: no starts are put near a sample that is farther away
LARGER = 2.0  # times that: half the side of the square in which a missing orbit is enclosed
OFF_CENTER = np.array([0.0414, 0.0732])  # of it: orbits on an axis shall not lie on the edges of its quarters
MOST_SQUARES = 400  # that are looked at
SMALLEST = 1e-6  # free amplitudes: half the side of the smallest square
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

    The index follows from the direction of travel, so that it needs no derivative near a fold. The tangent's last component
    is :math:`\det(M - 1)` over the determinant of the equations bordered by the tangent, which is positive.
    """
    points = curve.points
    values = np.array([point.u[-1] for point in points]) - value
    values[np.abs(values) < ROUNDING * (1.0 + abs(value))] = 0.0
    if len(points) == 1:
        return [Crossing(points[0], points[0].index)] if values[0] == 0.0 else []
    passed = (values[:-1] * values[1:] < 0.0) | (values[:-1] == 0.0)
    passed[-1:] |= values[-1] == 0.0
    found = []
    for i in np.flatnonzero(passed):
        share = values[i] / (values[i] - values[i + 1]) if values[i] != values[i + 1] else 0.0
        u = points[i].u + share * (points[i + 1].u - points[i].u)
        u[-1] = value
        near = points[i] if share < 0.5 else points[i + 1]
        found.append(Crossing(replace(near, u=u), int(curve.way * np.sign(values[i + 1] - values[i]))))
    return found


def index_sum(curves: list[Curve], value: float) -> int:
    """Return the sum of the indices of the known orbits of one common period at a scaled value of the parameter."""
    return sum(crossing.index for curve in curves if curve.repeats == 1 for crossing in crossings(curve, value))


def why_unproven(problem: Problem) -> str:
    """Return why the sum of the indices need not be one with these forces; empty where it must."""
    if problem.is_locked:
        return "a lock changes frequency and drive"
    for force in problem.forces:
        if force.switch is not None:
            return f"{force.name} has two branches"
        if force.memory:
            return f"{force.name} has a memory"
        if force.jumps():
            return f"{force.name} jumps at {1e9 * force.jumps()[0]:.3g} nm"
        for d in (-1e-9, *force.kinks(), 1e-10, 1e-9, 1e-8):
            away, toward = (in_first_contact(force, d, rate, 0.0) for rate in (STILL, -STILL))
            if abs(away - toward) > JUMPS * max(abs(away), abs(toward)):
                return f"{force.name} jumps where the tip turns"
    return ""


class Known:
    """The orbits known at one scaled value of the parameter, as curves that may become more cross it."""

    def __init__(self, among: ParameterRange, curves: list[Curve], value: float) -> None:
        self.among, self.curves, self.value = among, curves, value
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

    def single(self) -> list[Orbit]:
        """Return the orbits that repeat after one common period."""
        return [orbit for orbit in self.orbits() if orbit.repeats == 1]

    def _corrected(self, near: Orbit) -> Orbit:
        found = self.among.find(near.u, near.kept.branch, repeats=near.repeats)
        return near if found is None or np.abs(found.u - near.u).max() > ALIKE else found

    def hold(self, orbit: Orbit) -> bool:
        """Return whether an orbit is known, begun in any of its periods."""
        alike = [known for known in self.orbits() if known.repeats == orbit.repeats]
        x, state = orbit.x, orbit.state
        for turn in range(orbit.repeats):
            if turn:
                state = self.among.later(state, self.value, 1)
                x = self.among.vectors(state)[0]
            if any(self._is(known, x, orbit) for known in alike):
                return True
        return False

    def _is(self, known: Orbit, x: Array, orbit: Orbit) -> bool:
        """Return whether a known orbit, which may be interpolated, passes a state of another orbit."""
        apart = float(np.abs(known.x - x).max())
        if not SAME <= apart < NEAR:
            return apart < SAME
        there = self.among.find(known.u, orbit.kept.branch, repeats=orbit.repeats)
        return there is not None and float(np.abs(there.x - x).max()) < SAME


def candidates(known: Known, check_cancelled: CancelCheck, rounds: int | None = None) -> Iterator[Orbit]:
    """Give orbits, known or not, as long as one may be missing; in one round from few starts."""
    yield from _of_transients(known, check_cancelled)
    yield from _of_edges(known, check_cancelled)
    if why_unproven(known.among.problem):
        return
    starts = _starts(known)
    for turn in range(ROUNDS if rounds is None else rounds):
        yield from _of_newton(known, starts, check_cancelled)
        if turn == 0 and rounds != 1 and known.among.size == 2:
            yield from _of_squares(known, check_cancelled)
        if known.index_sum == 1:
            return


def search(
    known: Known, check_cancelled: CancelCheck, candidates: Callable[[Known, CancelCheck], Iterator[Orbit]] = candidates
) -> Iterator[Curve]:
    """Give the beginnings of curves through orbits that are not known.

    The known curves are to grow by each before the next one is asked for.
    """
    for orbit in candidates(known, check_cancelled):
        if not known.hold(orbit):
            yield Curve.rising(orbit)


def _of_transients(known: Known, check_cancelled: CancelCheck) -> Iterator[Orbit]:
    """Give orbits that Newton's method finds from the ends of transients, and stable ones of several periods."""
    among, value = known.among, known.value
    check_cancelled()
    integrator = among.integrator(value)
    ends = among.later(of_amplitudes(integrator, integrator.p[0], LAGS), value, _periods(among))
    for i in np.flatnonzero(np.isfinite(ends.x).all(axis=1)).tolist():
        check_cancelled()
        end = ends.take([i])
        x = among.vectors(end)
        if any(np.abs(orbit.x - x).max() < ALIKE for orbit in known.orbits()):
            continue
        found = among.find(np.append(x, value), end.branch)
        if found is not None:
            yield found
        if found is None or np.abs(found.x - x).max() > ALIKE:
            several = _repeating(among, end, value)
            if several is not None:
                yield several


def _repeating(among: ParameterRange, state: States, value: float) -> Orbit | None:
    """Return the stable orbit of several common periods that a state is near to; None where there is none of few periods."""
    x, after = among.vectors(state), among.later(state, value, 1)
    for repeats in range(2, MOST_REPEATS + 1):
        after = among.later(after, value, 1)
        if np.abs(among.vectors(after) - x).max() < ALIKE:
            found = among.find(np.append(x, value), state.branch, repeats=repeats)
            near = found is not None and np.abs(found.x - x).max() < ALIKE
            if found is not None and near and repeats == least_repeats(among, found):
                return found
    return None


def least_repeats(among: ParameterRange, orbit: Orbit) -> int:
    """Return after how many common periods an orbit, found as one of several, repeats in truth."""
    state = orbit.state
    for repeats in range(1, orbit.repeats):
        state = among.later(state, orbit.u[-1], 1)
        if np.abs(among.vectors(state) - orbit.x).max() < SAME:
            return repeats
    return orbit.repeats


def _periods(among: ParameterRange) -> int:
    """Return the common periods of a search's transients."""
    return math.ceil(periods_of_transients(among.problem) / among.common)


def periods_of_transients(problem: Problem) -> int:
    """Return the periods of the first tone after which Newton's method takes a transient over."""
    return min(SEARCH_DECAYS * decay_periods(problem), MOST_SEARCH)


def of_amplitudes(integrator: Integrator, zc: float, lags: Sequence[float]) -> States:
    """Return states with several amplitudes and these phase lags (degrees) at the first tone.

    The amplitudes are shares of the free amplitude, or of the distance (m) where that is less.
    """
    first = integrator.problem.tones[0]
    room = min(first.A0, zc) if zc > 0.0 else first.A0
    amplitudes = integrator.problem.free.copy()
    amplitudes[0] = 0.0
    motions = []
    for share, lag in product(SHARES, lags):
        amplitudes[0, first.mode] = share * room * np.exp(1j * (first.phase - math.radians(lag)))
        motions.append(with_amplitudes(integrator, amplitudes))
    return States.of(*motions)


def _of_edges(known: Known, check_cancelled: CancelCheck) -> Iterator[Orbit]:
    """Give unstable orbits between stable ones, as long as a saddle is missing."""
    stable = [orbit for orbit in known.single() if orbit.is_stable]
    for a, b in combinations(stable, 2):
        if known.index_sum <= 1:
            return
        yield from _on_the_edge(known.among, a, b, known.value, check_cancelled)


def _on_the_edge(
    among: ParameterRange, a: Orbit, b: Orbit, value: float, check_cancelled: CancelCheck
) -> Iterator[Orbit]:
    """Give saddles on the edge between the basins of two stable orbits, found by cutting the way between them."""
    near_a, near_b = a.x, b.x
    # where motions march one after the other, halving takes the fewest
    shares = np.arange(1.0, EDGE_STARTS + 1.0)[:, None] / (EDGE_STARTS + 1.0) if among.is_smooth else np.array([[0.5]])
    while np.abs(near_a - near_b).max() > EDGE:
        check_cancelled()
        way = np.concatenate([near_a[None], near_a + shares * (near_b - near_a), near_b[None]])
        ends = among.vectors(among.later(among.states(way[1:-1], a.kept.branch), value, _periods(among)))
        if not np.isfinite(ends).all():
            return
        to_a, to_b = (np.abs(ends - end.x).max(axis=1) for end in (a, b))
        first = int(np.argmax(np.append(to_a >= to_b, True)))
        near_a, near_b = way[first], way[first + 1]
    # until the time at which the ends differ, the motion on the edge stays near a saddle, where it moves least
    path, state = [near_a], among.states(near_a[None], a.kept.branch)
    for _ in range(_periods(among)):
        state = among.later(state, value, 1)
        path.append(among.vectors(state)[0])
    changes = np.abs(np.diff(path, axis=0)).max(axis=1)
    is_least = np.diff(np.sign(np.diff(changes, prepend=math.inf, append=math.inf))) > 0
    for i in sorted(np.flatnonzero(is_least), key=lambda place: changes[place])[:EDGE_TRIES]:
        found = among.find(np.append(path[i], value), a.kept.branch)
        if found is not None:
            yield found


def _of_squares(known: Known, check_cancelled: CancelCheck) -> Iterator[Orbit]:
    """Give orbits in squares of the Poincaré plane whose winding number is not the sum of the known indices inside."""
    among = known.among
    half = LARGER * max(float(_size(known)[1].max()), 1.0)
    root = Square(half * OFF_CENTER, half)
    squares = [root]
    for _ in range(MOST_SQUARES):
        if not squares or known.index_sum == 1:
            return
        check_cancelled()
        square = squares.pop()
        winding = square.winding_number(among, known.value)
        inside = [orbit.index for orbit in known.single() if square.holds(orbit.x)]
        if winding == sum(inside) and square is not root:
            continue
        found = among.find(np.append(square.center, known.value), np.zeros((1, 0)))
        if found is not None:
            yield found
        if square.half > SMALLEST:
            squares += square.parts()


def _of_newton(known: Known, starts: Iterator[Array], check_cancelled: CancelCheck) -> Iterator[Orbit]:
    """Give orbits that Newton's method finds from the next starts, deflated by the known orbits."""
    check_cancelled()
    among = known.among
    x = _deflated(among, known.value, np.array(list(islice(starts, STARTS))), [one.x for one in known.single()])
    for one in x:
        found = among.find(np.append(one, known.value), np.zeros((1, 0)))
        if found is not None:
            yield found


def _starts(known: Known) -> Iterator[Array]:
    """Give starts of Newton's method: between known orbits, then over a box around them and a box that reaches the sample.

    The points are frac(i sqrt(p)), with a prime p for each number of the state: H. Niederreiter, Random Number Generation and
    Quasi-Monte Carlo Methods, SIAM (1992), chapter 3.
    """
    yield from (0.5 * (a.x + b.x) for a, b in combinations(known.single(), 2))
    boxes, steps = _size(known), np.sqrt(_primes(known.among.size))
    i = 0
    while True:
        i += 1
        yield (2.0 * ((i * steps) % 1.0) - 1.0) * boxes[i % 2]


def _size(known: Known) -> Array:
    """Return half the sides of a box around the known orbits with room, and of a box that reaches the sample."""
    integrator = known.among.integrator(known.value)
    problem = integrator.problem
    speeds = np.array([mode.f0 for mode in problem.modes]) / problem.tones[0].frequency
    free = np.abs(problem.free).sum(0) / integrator.scales.length
    reach = np.abs([np.zeros(known.among.size), *(orbit.x for orbit in known.single())]).max(0)[: 2 * len(speeds)]
    size = ROOMY * np.maximum(reach[::2], np.maximum(reach[1::2] / speeds, free))
    deep, gap = size.copy(), integrator.p[0] / integrator.scales.length
    deep[0] = max(deep[0], ROOMY * gap) if gap < DEEPEST else deep[0]
    boxes = [np.column_stack([box, box * speeds]).ravel() for box in (size, deep)]
    return np.array([[*box, *np.repeat(box[1::2], problem.late_fluid)] for box in boxes])  # fluid follows its mode


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in found):
            found.append(number)
        number += 1
    return found


def _deflated(among: ParameterRange, value: float, starts: Array, known: list[Array]) -> Array:
    r"""Return motions near unknown fixed points of the map, from the starts that lead to any.

    Newton's method solves :math:`m(x) (P(x) - x) = 0` with :math:`m = \prod_i (1 + |x - x_i|^{-2})`. Its step is the step s
    for :math:`P(x) - x` over :math:`1 - s \cdot \nabla \ln m`.
    """
    x, going = starts.copy(), np.arange(len(starts))
    close: list[int] = []
    for _ in range(STEPS):
        after, monodromy = among.derivatives(x[going], value)
        matrix = monodromy - np.eye(among.size)
        with np.errstate(invalid="ignore"):
            good = np.isfinite(after).all(axis=1) & (np.abs(np.linalg.det(matrix)) > 0.0)
        here, going = x[going[good]], going[good]
        step = np.linalg.solve(matrix[good], (here - after[good])[:, :, None])[:, :, 0]
        away = here[:, None] - np.array(known).reshape(1, -1, among.size)
        square = (away**2).sum(axis=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            pull = -2.0 * ((step[:, None] * away).sum(axis=2) / (square * (1.0 + square))).sum(axis=1)
        arrived = (np.abs(step).max(axis=1) < CLOSE) & (np.abs(pull) < 1.0)
        x[going[arrived]] = here[arrived] + step[arrived]
        close += going[arrived].tolist()
        left = ~arrived & np.isfinite(step).all(axis=1) & np.isfinite(pull)
        going, step = going[left], step[left] / np.where(pull[left] != 1.0, 1.0 - pull[left], 1.0)[:, None]
        if not len(going):
            break
        longest = np.maximum(np.abs(step).max(axis=1), 1e-300)
        x[going] = here[left] + step * np.minimum(1.0, LARGEST / longest)[:, None]
    return x[sorted(close)]
