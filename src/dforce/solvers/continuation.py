r"""Curves of periodic orbits along a parameter, stable or not, through folds: pseudo-arclength continuation.

An orbit is a fixed point of the map over one common period of all tones, :math:`P(x, \lambda) = x`, with x the motion and
the forces' memory at the start of that period. The unknown :math:`u = (x, \lambda)` is predicted along the curve's tangent
and corrected by Newton's method in the plane across it, so that a fold is a point like any other. All is scaled: lengths
by the first tone's free amplitude, the parameter by its range.

Sources: H. B. Keller, in Applications of Bifurcation Theory, Academic Press (1977), p. 359; R. Seydel, Practical Bifurcation
and Stability Analysis, Springer (2010), chapters 4 and 7.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dforce.errors import ParameterError
from dforce.kernel import Array
from dforce.observables import measure
from dforce.observables.finish import finish
from dforce.observables.window import common_period, weights
from dforce.solvers.integrator import Integrator, Motion, free_amplitudes, with_amplitudes
from dforce.solvers.transient import Steady, Watch, decay_periods

NUDGE = 1e-6  # of the free amplitude, or of the parameter's range: distance of the neighbors that give derivatives
MISS = 1e-10  # of the free amplitude: how far from its start an orbit may end
STALLED = 1e-8  # the same where corrections no longer help: forces that jump leave the map so rough
FRESH = 1e-6  # derivatives at a motion that misses by more are taken anew for the orbit
CONTRACTS = 0.1  # derivatives are kept while each correction lowers the miss by this at least
MOST_CORRECTIONS = 12
LARGEST = 0.3  # of the free amplitude: longer corrections are shortened
EASY, HARD = 3, 6  # corrections up to which the step grows, and from which on it shrinks
GROWTH = 1.5
SMALLEST = 1e-6  # step at which a curve is given up
STRAIGHT = 0.9  # cosine of the largest turn of the tangent in a step
ASTRAY = 0.5  # of a step: an orbit farther from its prediction may be on another curve
SHARP = 1e-7  # of a step: how well a special point is located
SAME = 1e-5  # of the free amplitude: orbits nearer to each other are one
NEAR = 0.05  # of the free amplitude: how near to a known curve an orbit is looked at closely
SHARES = (0.3, 0.7, 1.05)  # of the room for the amplitude: with which a search starts
LAGS = (20.0, 60.0, 100.0, 140.0)  # degrees: phase lags with which it starts
SEARCH_DECAYS, MOST_SEARCH = 6, 1000  # decay times and periods after which Newton's method takes a search over
ALIKE = 0.02  # of the free amplitude: a motion so near to an orbit settles there

END, FOLD, PERIOD_DOUBLING, TORUS, GRAZING = "end", "fold", "period_doubling", "torus", "grazing"


@dataclass(frozen=True)
class Orbit:
    """A periodic orbit on a curve.

    Attributes
    ----------
    u
        Scaled motion and memory at the start of a common period, then the scaled parameter, shape (n + 1,).
    latched
        The forces' branches there.
    jacobian, slope
        Derivative of the map by the state, (n, n), and by the scaled parameter, (n,).
    tangent
        Unit tangent of the curve, (n + 1,).
    values
        Observables in SI units by name.
    gaps
        Least distance minus each distance at which a force is not smooth (m).
    special
        What is special about it: ``""``, ``fold``, ``period_doubling``, ``torus``, ``grazing`` or ``end``.
    """

    u: Array
    latched: Array
    jacobian: Array
    slope: Array
    tangent: Array
    values: dict[str, Any]
    gaps: Array
    special: str = ""

    def reversed(self) -> Orbit:
        """Return it with the tangent the other way."""
        return replace(self, tangent=-self.tangent)

    @functools.cached_property
    def multipliers(self) -> np.ndarray[Any, np.dtype[np.complex128]]:
        """Floquet multipliers over a common period, the largest first."""
        found = np.linalg.eigvals(self.jacobian).astype(complex)
        return found[np.argsort(-np.abs(found), kind="stable")]

    @functools.cached_property
    def orientation(self) -> float:
        """Sign of the determinant of the equations bordered by the tangent: the same all along a curve."""
        return float(np.linalg.slogdet(_bordered(self.jacobian, self.slope, self.tangent))[0])

    @property
    def is_stable(self) -> bool:
        """Whether small disturbances die out."""
        return bool(abs(self.multipliers[0]) < 1.0)


class Curve:
    """A connected curve of orbits, grown in two directions from the orbit where it was found."""

    def __init__(self, start: Orbit) -> None:
        self.forth = [start]
        self.back = [start.reversed()]

    @property
    def points(self) -> list[Orbit]:
        """The orbits in order along the curve."""
        return [*reversed(self.back[1:]), *self.forth]

    def grow(self, period_map: PeriodMap, largest: float, most: int, watch: Watch) -> None:
        """Trace it both ways in steps of at most `largest` (scaled), up to so many points in all."""
        closed = trace(period_map, self.forth, largest, most, watch)
        if not closed:
            trace(period_map, self.back, largest, most - len(self.forth) + 1, watch)


class PeriodMap:
    """The map of a scaled state over one common period of all tones, at any value of a parameter.

    Parameters
    ----------
    integrator
        Integrates one problem after another of the same kind.
    place
        Puts the integrator at a value (SI) of the parameter.
    low, high
        Range of the parameter (SI).

    Raises
    ------
    ParameterError
        When the tones have no common period.
    """

    def __init__(self, integrator: Integrator, place: Callable[[float], None], low: float, high: float) -> None:
        frequencies = [tone.frequency for tone in integrator.problem.tones]
        common = common_period(frequencies)
        if common is None:
            raise ParameterError(
                "the tones' frequencies have no common period of up to 200 periods of the first tone, so that "
                "there are no periodic orbits to follow; choose a simple ratio, such as 6.2"
            )
        self.integrator, self._place, self.common = integrator, place, common
        self.low, self.high = low / (high - low), high / (high - low)
        self.span = high - low
        self.even = weights(frequencies, common)
        self.motion_size = 2 * len(integrator.problem.modes)
        self.size = self.motion_size + integrator.memory_size
        self.scale = np.concatenate([np.ones(self.motion_size), integrator.sizes])
        self._at = math.nan

    def put(self, value: float) -> None:
        """Go to a scaled value of the parameter."""
        if value != self._at:
            self._place(value * self.span)
            self._at = value

    def motion(self, x: Array, latched: Array) -> Motion:
        """Return the motion of a scaled state."""
        y = tuple(map(float, x[: self.motion_size]))
        return Motion(y, x[self.motion_size :] * self.integrator.sizes, latched.copy(), 0)

    def state(self, motion: Motion) -> Array:
        """Return the scaled state of a motion."""
        return np.concatenate([motion.y, motion.memory / self.integrator.sizes])

    def end(self, x: Array, latched: Array) -> Array:
        """Return the state one common period later."""
        return self.state(self.integrator.lock_in(self.motion(x, latched), self.common)[0])

    def derivatives(self, u: Array, latched: Array) -> tuple[Array, Array]:
        """Return the derivatives of the map by the state and by the scaled parameter."""
        self.put(u[-1])
        x, jacobian = u[:-1], np.empty((self.size, self.size))
        here = self.end(x, latched)
        for j in range(self.size):
            ahead, behind = x.copy(), x.copy()
            ahead[j] += NUDGE
            behind[j] -= NUDGE
            # of memory there may be much, and its part of the derivative needs no more than one side
            back = self.end(behind, latched) if j < self.motion_size else here
            jacobian[:, j] = (self.end(ahead, latched) - back) / (NUDGE if back is here else 2.0 * NUDGE)
        inward = NUDGE if u[-1] < 0.5 * (self.low + self.high) else -NUDGE
        self.put(u[-1] + inward)
        slope = (self.end(x, latched) - here) / inward
        self.put(u[-1])
        return jacobian, slope


def _bordered(jacobian: Array, slope: Array, normal: Array) -> Array:
    return np.vstack([np.column_stack([jacobian - np.eye(len(slope)), slope]), normal])


def along_parameter(size: int) -> Array:
    """Return the unit vector of the parameter: a plane across it holds the parameter fixed."""
    return np.append(np.zeros(size), 1.0)


def correct(
    period_map: PeriodMap, guess: Array, normal: Array, latched: Array, known: tuple[Array, Array] | None = None
) -> Orbit | None:
    """Return the orbit near a guess in the plane through it across `normal`, found by Newton's method; None where none is.

    `known` are derivatives of the map to begin with. The orbit's tangent points to the same side as `normal`.
    """
    u, before, fresh = guess.copy(), math.inf, False
    for attempt in range(MOST_CORRECTIONS + 1):
        try:
            period_map.put(u[-1])
        except ParameterError:  # the parameter has left what is allowed
            return None
        after, rows = period_map.integrator.observe(period_map.motion(u[:-1], latched), period_map.common)
        misses = period_map.state(after) - u[:-1]
        miss = float(np.abs(misses).max())
        if not math.isfinite(miss):
            return None
        switched = not np.array_equal(after.latched, latched)
        if not switched and (miss < MISS or (miss < STALLED and miss > 0.5 * before)):
            return _orbit(period_map, u, normal, latched, known if fresh else None, rows, miss, attempt)
        latched = after.latched
        if known is None or miss > CONTRACTS * before:
            known = period_map.derivatives(u, latched)
            fresh = miss < FRESH
        step = _solve(known, normal, np.append(-misses, 0.0))
        if step is None:
            return None
        if abs(normal[-1]) == 1.0:  # the parameter is held, to the last digit
            step[-1] = 0.0
        longest = float(np.abs(step).max())
        u = u + step * min(1.0, LARGEST / longest) if longest > 0.0 else u
        before = miss
    return None


def _orbit(
    period_map: PeriodMap, u: Array, normal: Array, latched: Array, known: tuple[Array, Array] | None, rows: Array,
    miss: float, corrections: int,
) -> Orbit | None:  # fmt: skip
    integrator = period_map.integrator
    values = finish(integrator.problem, integrator.scales, integrator.harmonics, rows, period_map.even)
    gaps = rows[:, measure.D_MIN].min() - integrator.kinks
    jacobian, slope = known if known is not None else period_map.derivatives(u, latched)
    tangent = _solve((jacobian, slope), normal, along_parameter(len(slope)))
    if tangent is None:
        return None
    values |= {"drift": miss, "corrections": float(corrections)}
    return Orbit(u, latched, jacobian, slope, tangent / np.linalg.norm(tangent), values, gaps)


def _solve(known: tuple[Array, Array], normal: Array, right: Array) -> Array | None:
    """Solve the map's linear equations, bordered by the plane across `normal`; None where they have no solution."""
    try:
        found = np.linalg.solve(_bordered(*known, normal), right)
    except np.linalg.LinAlgError:
        return None
    return np.asarray(found, dtype=float) if np.isfinite(found).all() else None


def as_steady(period_map: PeriodMap, orbit: Orbit) -> Steady:
    """Return an orbit as what is found at a point, with its largest multipliers, two for each mode."""
    kept = orbit.multipliers[: period_map.motion_size]
    multipliers = {"multiplier_modulus": np.abs(kept), "multiplier_angle": np.degrees(np.angle(kept))}
    motion = period_map.motion(orbit.u[:-1], orbit.latched)
    return Steady(orbit.values | multipliers, motion, True, True, motion.y)


def trace(period_map: PeriodMap, points: list[Orbit], largest: float, most: int, watch: Watch) -> bool:
    """Extend a curve beyond its last point until it leaves the parameter's range; return whether it closed.

    It also ends, with its last point marked ``end``, where no step however short leads on, and after `most` points.
    """
    start = last = points[-1]
    first, step = len(points), 0.1 * largest
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
        if found is None or not _is_next(period_map, last, found, guess, min(step, reach)):
            step = 0.5 * min(step, reach)
            if step < SMALLEST:
                points[-1] = replace(last, special=last.special or _ending(period_map, last))
                return False
            continue
        points += specials(period_map, last, found)
        closed = len(points) > first + 2 and _passes(last, found, start)
        points.append(replace(start, tangent=found.tangent) if closed else found)
        if closed or lands:
            return closed
        corrections = found.values["corrections"]
        factor = GROWTH if corrections <= EASY else 1.0 / GROWTH if corrections >= HARD else 1.0
        last, step = found, min(largest, step * factor)
    return False


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


def crossings(curves: list[Curve], value: float) -> Iterator[Array]:
    """Give where known curves cross a scaled value of the parameter, interpolated between their points."""
    for curve in curves:
        points = curve.points
        values = np.array([point.u[-1] for point in points]) - value
        for i in np.flatnonzero(values[:-1] * values[1:] <= 0.0):
            share = values[i] / (values[i] - values[i + 1]) if values[i] != values[i + 1] else 0.0
            u = points[i].u + share * (points[i + 1].u - points[i].u)
            u[-1] = value
            yield u


def is_known(period_map: PeriodMap, curves: list[Curve], orbit: Orbit) -> bool:
    """Say whether an orbit lies on a curve that was traced before."""
    across = along_parameter(period_map.size)
    for guess in crossings(curves, float(orbit.u[-1])):
        if np.abs(guess - orbit.u).max() < NEAR:
            there = correct(period_map, guess, across, orbit.latched, (orbit.jacobian, orbit.slope))
            if there is not None and np.abs(there.u - orbit.u).max() < SAME:
                return True
    return False


def free_orbit(period_map: PeriodMap, value: float) -> Orbit | None:
    """Return the orbit at a scaled value of the parameter that Newton's method finds from the motion without forces."""
    period_map.put(value)
    motion = with_amplitudes(period_map.integrator, free_amplitudes(period_map.integrator))
    return orbit_from(period_map, motion, value)


def orbit_from(period_map: PeriodMap, motion: Motion, value: float) -> Orbit | None:
    """Return the orbit at a scaled value of the parameter that Newton's method finds from a motion."""
    guess = np.append(period_map.state(motion), value)
    return correct(period_map, guess, along_parameter(period_map.size), motion.latched)


def search(period_map: PeriodMap, curves: list[Curve], value: float, watch: Watch) -> Iterator[Orbit]:
    """Give orbits at a scaled value of the parameter that lie on none of the curves, as far as transients find them.

    The transients start from several amplitudes and phases of the first tone; the amplitudes are shares of the free
    amplitude, or of the distance where that is less. `curves` may grow meanwhile.
    """
    integrator = period_map.integrator
    periods = min(SEARCH_DECAYS * decay_periods(integrator.problem), MOST_SEARCH)
    periods = period_map.common * math.ceil(periods / period_map.common)
    seen: list[Array] = []
    for share in SHARES:
        for lag in LAGS:
            watch()
            period_map.put(value)
            first, zc = integrator.problem.tones[0], integrator.p[0]
            room = min(first.A0, zc) if zc > 0.0 else first.A0
            amplitudes = free_amplitudes(integrator)
            amplitudes[0] = 0.0
            amplitudes[0, first.mode] = share * room * np.exp(1j * (first.phase - math.radians(lag)))
            motion, _ = integrator.lock_in(with_amplitudes(integrator, amplitudes), periods)
            if not motion.is_finite:
                continue
            x = period_map.state(motion)
            if any(np.abs(u[:-1] - x).max() < ALIKE for u in [*seen, *crossings(curves, value)]):
                continue
            found = orbit_from(period_map, motion, value)
            if found is not None:
                seen.append(found.u)
                if not is_known(period_map, curves, found):
                    yield found
