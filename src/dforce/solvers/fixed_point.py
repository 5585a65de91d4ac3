r"""Single periodic orbits, stable or not: Newton's method on the map over one common period of all tones.

An orbit is a fixed point of the map, :math:`P(x, \lambda) = x`, with x the motion and the forces' memory at the start
of a common period; one that repeats only after n of them is a fixed point of :math:`P^n`. The unknown is :math:`u = (x,
\lambda)`, scaled: lengths by the first tone's free amplitude, the parameter by its range. A plane in which the orbit is
sought makes up for the one equation that is missing.

Source: R. Seydel, Practical Bifurcation and Stability Analysis, Springer (2010), chapters 4 and 7.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dforce.errors import ParameterError
from dforce.kernel import Array
from dforce.observables import measure
from dforce.observables.finish import finish
from dforce.observables.window import common_period, weights
from dforce.solvers.integrator import Integrator, Motion, free_amplitudes, with_amplitudes
from dforce.solvers.transient import Steady

NUDGE = 1e-6  # of the free amplitude, or of the parameter's range: distance of the neighbors that give derivatives
MISS = 1e-10  # of the free amplitude: how far from its start an orbit may end
STALLED = 1e-8  # the same where corrections no longer help: forces that jump leave the map so rough
FRESH = 1e-6  # derivatives at a motion that misses by more are taken anew for the orbit
CONTRACTS = 0.1  # derivatives are kept while each correction lowers the miss by this at least
MOST_CORRECTIONS = 12
ROUNDING = 1e-12  # of the range
MOST_REPEATS = 4  # common periods: motions that repeat only after more are not sought
LARGEST = 0.3  # of the free amplitude: longer corrections are shortened

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
    step
        Scaled length of the step along the curve to be tried from it; 0 where none is known yet.
    repeats
        After how many common periods the motion repeats.
    """

    u: Array
    latched: Array
    jacobian: Array
    slope: Array
    tangent: Array
    values: dict[str, Any]
    gaps: Array
    special: str = ""
    step: float = 0.0
    repeats: int = 1

    def reversed(self) -> Orbit:
        """Return it with the tangent the other way."""
        return replace(self, tangent=-self.tangent)

    @functools.cached_property
    def multipliers(self) -> np.ndarray[Any, np.dtype[np.complex128]]:
        """Floquet multipliers over the period after which the motion repeats, the largest first."""
        found = np.linalg.eigvals(self.jacobian).astype(complex)
        return found[np.argsort(-np.abs(found), kind="stable")]

    @functools.cached_property
    def orientation(self) -> float:
        """Sign of the determinant of the equations bordered by the tangent: the same all along a curve."""
        return float(np.linalg.slogdet(bordered(self.jacobian, self.slope, self.tangent))[0])

    @property
    def index(self) -> int:
        """Sign of det(1 - M), its index as a fixed point of the map; see ``search``."""
        return int(np.sign(np.linalg.det(np.eye(len(self.slope)) - self.jacobian)))

    @property
    def is_stable(self) -> bool:
        """Whether small disturbances die out; where stability is just lost, they do not."""
        return bool(abs(self.multipliers[0]) < 1.0) and self.special not in (FOLD, PERIOD_DOUBLING, TORUS)


@dataclass
class Stand:
    """The scaled value of the parameter at which an integrator stands."""

    value: float = math.nan


class PeriodMap:
    """The map of a scaled state over one common period of all tones, or several, at any value of a parameter.

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
        self.integrator, self._place, self.common, self.repeats = integrator, place, common, 1
        self.low, self.high = low / (high - low), high / (high - low)
        self.span, self._ends = high - low, (low, high)
        self.even = weights(frequencies, common)
        self.motion_size = 2 * len(integrator.problem.modes)
        self.size = self.motion_size + integrator.memory_size
        self._stand = Stand()

    def repeated(self, times: int) -> PeriodMap:
        """Return the map over so many common periods; both stand at the same value."""
        if times == self.repeats:
            return self
        other = copy.copy(self)
        other.repeats, other.common = times, self.common // self.repeats * times
        other.even = weights([tone.frequency for tone in self.integrator.problem.tones], other.common)
        return other

    def put(self, value: float) -> None:
        """Go to a scaled value of the parameter."""
        if value != self._stand.value:
            there = value * self.span
            # an end of the range is met to the last digit: the parameter may not be allowed beyond
            self._place(next((end for end in self._ends if abs(end - there) < ROUNDING * self.span), there))
            self._stand.value = value

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
        x = u[:-1]
        here = self.end(x, latched)
        jacobian = self.monodromy(x, latched, here)
        inward = NUDGE if u[-1] < 0.5 * (self.low + self.high) else -NUDGE
        self.put(u[-1] + inward)
        slope = (self.end(x, latched) - here) / inward
        self.put(u[-1])
        return jacobian, slope

    def monodromy(self, x: Array, latched: Array, here: Array) -> Array:
        """Return the derivative of the map by the state, where `here` is its value; the monodromy matrix of an orbit."""
        jacobian = np.empty((self.size, self.size))
        for j in range(self.size):
            ahead, behind = x.copy(), x.copy()
            ahead[j] += NUDGE
            behind[j] -= NUDGE
            # of memory there may be much, and its part of the derivative needs no more than one side
            back = self.end(behind, latched) if j < self.motion_size else here
            jacobian[:, j] = (self.end(ahead, latched) - back) / (NUDGE if back is here else 2.0 * NUDGE)
        return jacobian


def bordered(jacobian: Array, slope: Array, normal: Array) -> Array:
    """Return the matrix of the map's linear equations, with the plane across `normal` as the last one."""
    return np.vstack([np.column_stack([jacobian - np.eye(len(slope)), slope]), normal])


def along_parameter(size: int) -> Array:
    """Return the unit vector of the parameter: a plane across it holds the parameter fixed."""
    return np.append(np.zeros(size), 1.0)


def correct(
    period_map: PeriodMap, guess: Array, normal: Array, latched: Array, known: tuple[Array, Array] | None = None
) -> Orbit | None:
    """Return the orbit near a guess in the plane through it across `normal`; None where Newton's method finds none.

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
    tangent /= np.linalg.norm(tangent)
    return Orbit(u, latched, jacobian, slope, tangent, values, gaps, repeats=period_map.repeats)


def _solve(known: tuple[Array, Array], normal: Array, right: Array) -> Array | None:
    """Solve the map's linear equations, bordered by the plane across `normal`; None where they have no solution."""
    try:
        found = np.linalg.solve(bordered(*known, normal), right)
    except np.linalg.LinAlgError:
        return None
    return np.asarray(found, dtype=float) if np.isfinite(found).all() else None


def as_steady(period_map: PeriodMap, orbit: Orbit) -> Steady:
    """Return an orbit as what is found at a point, with its largest multipliers, two for each mode."""
    kept = orbit.multipliers[: period_map.motion_size]
    multipliers = {"multiplier_modulus": np.abs(kept), "multiplier_angle": np.degrees(np.angle(kept))}
    motion = period_map.motion(orbit.u[:-1], orbit.latched)
    return Steady(orbit.values | multipliers, motion, True, orbit.repeats == 1)


def free_orbit(period_map: PeriodMap, value: float) -> Orbit | None:
    """Return the orbit at a scaled value of the parameter that Newton's method finds from the motion without forces."""
    period_map.put(value)
    motion = with_amplitudes(period_map.integrator, free_amplitudes(period_map.integrator))
    return orbit_from(period_map, motion, value)


def orbit_from(period_map: PeriodMap, motion: Motion, value: float) -> Orbit | None:
    """Return the orbit at a scaled value of the parameter that Newton's method finds from a motion."""
    guess = np.append(period_map.state(motion), value)
    return correct(period_map, guess, along_parameter(period_map.size), motion.latched)
