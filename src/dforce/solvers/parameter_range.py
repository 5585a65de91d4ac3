r"""A range of any parameter in which periodic orbits are sought, stable or not.

An orbit is sought in a plane of the space of :math:`u = (x, \lambda)`, the state at the start of a common period and the
parameter. Lengths are scaled by the first tone's free amplitude, the parameter by its range; see ``newton``. The forces' memory
is part of the state. If it lasts about a period or longer, the multipliers of motion and memory together differ from the
multipliers of the motion alone.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import ParameterError
from dforce.observables import measure
from dforce.observables.averaging import common_period, weights
from dforce.observables.complex_numbers import angle
from dforce.observables.finish import finish
from dforce.problem import Problem
from dforce.solvers import SolverSettings
from dforce.solvers.block import Block
from dforce.solvers.blocks import block_type
from dforce.solvers.integrator import Integrator, sample_count, with_amplitudes
from dforce.solvers.newton import CONVERGED, Orbits, begin, choose_next, empty_orbits
from dforce.solvers.orbit import Orbit
from dforce.solvers.period_map import FD_STEP, NOTHING, Slots
from dforce.solvers.states import States
from dforce.solvers.transient import Steady

ROUNDING = 1e-12  # of the range: values nearer to its ends are these
# change of the motion by the parameter on a steep part: of free amplitudes by free amplitudes of distance, or by the range
STEEP = 10.0
MOST_REPEATS = 4  # common periods: motions that repeat only after more are not sought


class ParameterRange:
    """A range of a parameter in which periodic orbits are sought.

    Parameters
    ----------
    problem_at
        Gives the problem at a value (SI) of the parameter.
    start, stop
        Ends of the range (SI).
    zc
        The average distance (m); left out: it is the parameter.
    points
        Samples per period; left out: as many as the range needs.

    Attributes
    ----------
    unit
        The range in free amplitudes, where the distance is the parameter; else 1.
    side
        Scaled distance of the neighbors that give the derivatives on an orbit.

    Raises
    ------
    ParameterError
        When the tones have no common period, or not the same one at all values.
    """

    side = FD_STEP

    def __init__(
        self,
        problem_at: Callable[[float], Problem],
        start: float,
        stop: float,
        settings: SolverSettings,
        harmonics: int,
        zc: float | None = None,
        points: int | None = None,
    ) -> None:
        self._whole_at, self.zc = problem_at, zc
        among = [self.problem_at(value) for value in (start, 0.5 * (start + stop), stop)]
        periods = {common_period([tone.frequency for tone in problem.tones]) for problem in among}
        if len(periods) > 1:
            raise ParameterError(
                "the ratio of the tones' frequencies changes with the parameter, so no periodic orbits exist to "
                "follow; write the frequency of every tone, or drive with one tone"
            )
        if None in periods:
            raise ParameterError(
                "the tones' frequencies have no common period of up to 200 periods of the first tone, so "
                "no periodic orbits exist to follow; choose a simple ratio, such as 6.2"
            )
        self.settings, self.harmonics = settings, harmonics
        self.points = points or max(sample_count(problem, settings) for problem in among)
        self._ends = min(start, stop), max(start, stop)
        self.span = self._ends[1] - self._ends[0]
        self.low, self.high = self._ends[0] / self.span, self._ends[1] / self.span
        self.unit = 1.0 if zc is not None else self.span / among[0].tones[0].A0
        self._block = functools.lru_cache(maxsize=4)(self._new_block)
        self._finer: dict[int, ParameterRange] = {}
        self.problem, self.has_changing_lever = among[0], zc is None and problem_at(start).heights is not None
        block = self.block(start)
        self._motion, self._memory_scale, self.is_smooth = block.size, block.memory_scale, block.is_smooth
        self.size, self.common = block.size + len(block.memory_scale), block.common
        # the average distance, and motions that march in lanes: then everything is compiled
        self._is_compiled = zc is None and settings.method == "periodic" and self.is_smooth

    def problem_at(self, value: float) -> Problem:
        """Return the problem at a value (SI), with the lever as it is at the distance there."""
        return self._whole_at(value).at_height(self.distance(value))

    def problem_of(self, orbit: Orbit) -> Problem:
        """Return the problem of an orbit."""
        return self.problem_at(orbit.value)

    def _new_block(self, value: float) -> Block:
        problem = self._whole_at(value) if self.zc is None else self.problem_at(value)
        return block_type(self.settings).of_one(
            problem, self.settings, self.harmonics, points=self.points, unit=self.span
        )

    def finer(self, times: int) -> ParameterRange:
        """Return the same range with `times` the samples; of RK4, where an integrator chooses its own steps."""
        if times == 1:
            return self
        if times not in self._finer:
            finer, points, settings = copy.copy(self), times * self.points, self.settings
            finer.points, finer._finer = points, {}
            is_adaptive = settings.method == "transient" and settings.integrator != "rk4"
            if is_adaptive:
                finer.settings = settings.replace(integrator="rk4", accuracy=None)
            make = finer._new_block if is_adaptive else lambda value: self._block(value).finer(points)
            finer._block = functools.lru_cache(maxsize=4)(make)
            self._finer[times] = finer
        return self._finer[times]

    def block(self, value: float) -> Block:
        """Return the problem at a value (SI), as a block along the distance."""
        return self._block(self._ends[0] if self.zc is None else value)

    def distance(self, value: float) -> float:
        """Return the average distance (m) at a value (SI)."""
        return value if self.zc is None else self.zc

    def integrator(self, scaled: float) -> Integrator:
        """Return the integrator at a scaled value."""
        value = self.value_of(scaled)
        return self.block(value).integrator(0, self.distance(value))

    def value_of(self, scaled: float) -> float:
        """Return the value (SI) of a scaled one: near an end of the range that end, beyond which it may not be allowed."""
        there = scaled * self.span
        return next((end for end in self._ends if abs(end - there) < ROUNDING * self.span), there)

    def states(self, x: Array, branch: Array) -> States:
        """Return scaled motions and memories, (states, size), with the branches of a state."""
        return States.of_vectors(x, branch, self._memory_scale)

    def vectors(self, states: States) -> Array:
        """Return the scaled motions and memories of states, (states, size)."""
        return states.vectors(self._memory_scale)

    def later(self, states: States, scaled: float, periods: int) -> States:
        """Return states at a scaled value of the parameter `periods` common periods later."""
        value, count = self.value_of(scaled), len(states)
        at = np.full(count, self.distance(value))
        return self.block(value).advance(np.zeros(count, np.int64), states, at, periods)

    def derivatives(self, x: Array, scaled: float) -> tuple[Array, Array]:
        """Return where motions without memory end one common period later, and the map's derivatives there."""
        value, which = self.value_of(scaled), np.zeros(len(x), np.int64)
        at = np.full(len(x), self.distance(value))
        return self.block(value).derivatives(which, self.states(x, np.zeros((1, 0))), at)

    def find(self, guess: Array, branch: Array, normal: Array | None = None, repeats: int = 1) -> Orbit | None:
        """Return the orbit of `repeats` common periods that Newton's method finds from a guess; None where it finds none.

        Parameters
        ----------
        guess
            Scaled motion, memory and parameter, (size + 1,).
        branch
            First guess of the forces' branches, (1, branches).
        normal
            The orbit is sought in the plane through the guess across this vector; left out: at the guessed parameter.
        """
        value, orbits = self.value_of(float(guess[-1])), empty_orbits(1, self.size)
        if normal is not None:
            orbits.normal[0] = normal
        try:
            slots = self._solve(guess[None, :-1], branch, value, orbits, repeats)
            if orbits.outcome[0] != CONVERGED:
                return None
            return self._found(slots.x, slots.branch, float(slots.value[0]), float(orbits.steps[0]), repeats)
        except ParameterError:  # the parameter has left its allowed range
            return None

    def across(self, orbit: Orbit) -> Array:
        """Return the normal of the plane in which an orbit is found with other samples.

        The value stays, but where the curve is steep: at a fold no orbit may be left there. Then the plane is across the curve.
        """
        *motion, ahead = np.abs(orbit.tangent)
        stays = orbit.value in self._ends or max(motion) < STEEP * self.unit * ahead
        return np.eye(1, self.size + 1, self.size)[0] if stays else orbit.tangent

    def found_again(self, orbit: Orbit) -> Orbit | None:
        """Return an orbit that was found with other samples, in that plane; None where it is not found."""
        found = self.find(orbit.u, orbit.kept.branch, self.across(orbit), orbit.repeats)
        return None if found is None else replace(found, special=orbit.special, steps=orbit.steps)

    def remeasured(self, orbit: Orbit) -> tuple[Array, Array]:
        """Return the unknowns after one Newton step in the plane of `across`, and the measurement over each period there."""
        u, rows = orbit.u.copy(), np.full(orbit.rows.shape, np.nan)
        ends, _ = self._march(orbit.x[None], orbit.value, orbit.kept.branch, orbit.repeats)
        if np.isfinite(ends).all():
            equations, miss = np.vstack([orbit.equations, self.across(orbit)]), np.append(orbit.x - ends[0], 0.0)
            u += np.linalg.lstsq(equations, miss, rcond=None)[0]  # which has a solution where curves cross, too
            _, slots = self._march(u[None, :-1], self.value_of(u[-1]), orbit.kept.branch, orbit.repeats, True)
            rows = slots.rows[0]
        return u, rows

    def scales_of(self, value: float) -> Array:
        """Return the units (m, m/s) of the numbers of a motion at a value (SI)."""
        return self.block(value).scales_of(np.zeros(1, np.int64), np.array([self.distance(value)]))

    def _found(self, x: Array, branch: Array, value: float, steps: float, repeats: int) -> Orbit | None:
        """Return the orbit with these unknowns at a value (SI)."""
        state = self.states(x, branch)
        kept = States(state.x * self.scales_of(value), state.memory, state.branch)
        return self.orbit(value, kept, steps, repeats)

    def orbit(self, value: float, kept: States, steps: float, repeats: int) -> Orbit:
        """Return the orbit with a state, its motion in m and m/s, at a value (SI)."""
        state = States(kept.x / self.scales_of(value), kept.memory, kept.branch)
        x = self.vectors(state)
        measured = self._measured(x, value, kept.branch, repeats)
        return Orbit(np.append(x, value / self.span), state, value, kept, *measured, steps, repeats=repeats)

    def _measured(
        self, x: Array, value: float, branch: Array, repeats: int
    ) -> tuple[Array, Array, Array, Array, float]:
        """Return the derivatives of the map by the unknowns and by the parameter, then `rows` to `residual` of an `Orbit`."""
        here, slots = self._march(x, value, branch, repeats, True)
        # of memory there may be much, and its part of the derivative needs no more than one side
        beside = self.side * np.concatenate([np.eye(self.size), -np.eye(self._motion, self.size)])
        ends, _ = self._march(x + beside, value, branch, repeats)
        derivative = (ends[: self.size] - here).T / self.side
        derivative[:, : self._motion] = 0.5 * (ends[: self._motion] - ends[self.size :]).T / self.side
        by_parameter = self._by_parameter(x, value, branch, repeats, here[0])
        gaps = slots.rows[0, :, measure.D_MIN].min() - self.block(value).batch.kinks[0]
        return derivative, by_parameter, slots.rows[0], gaps, float(np.abs(here - x).max())

    def _solve(self, x: Array, branch: Array, value: float, orbits: Orbits, repeats: int) -> Slots:
        """Return the only slot of the orbit near a state, after Newton's method."""
        if self._is_compiled:
            block = self.block(value)
            slots = block.slots(self.states(x, branch), np.array([value]), repeats)
            block.find(np.zeros(1, np.int64), slots, orbits, repeats)
            return slots
        which, nothing, ends = np.zeros(1, np.int64), np.empty((1, 0)), np.empty((1, self.size + 2, self.size))
        rows, wanted = np.empty((1, 0, 0)), np.full(1, NOTHING)
        slots = Slots(
            which, np.array([value]), x.copy(), nothing, branch.copy(), ends, nothing, branch.copy(), rows, rows, wanted
        )
        beside = np.concatenate([np.zeros((1, self.size)), FD_STEP * np.eye(self.size)])
        orbits.unit[:] = self.span
        begin(orbits, 1)
        while True:
            going, each = choose_next(slots, 1, orbits, which)
            if going == 0:
                return slots
            value = float(slots.value[0])
            starts = slots.x + beside[:each]
            ends[0, : len(starts)], marched = self._march(starts, value, slots.branch, repeats)
            if each > 1:
                change = self._by_parameter(slots.x, value, slots.branch, repeats, ends[0, 0])
                ends[0, -1] = ends[0, 0] + FD_STEP * change
            slots.branch_after[:] = marched.branch_after[:1]
            self.block(value).take_step(slots, each, orbits)

    def _by_parameter(self, x: Array, value: float, branch: Array, repeats: int, here: Array) -> Array:
        """Return the derivative of the map by the scaled parameter, where its value is `here`."""
        step = math.copysign(FD_STEP, sum(self._ends) - 2.0 * value)  # into the range: the parameter may end there
        ends, _ = self._march(x, value + step * self.span, branch, repeats)
        return np.asarray((ends[0] - here) / step)

    def _march(
        self, x: Array, value: float, branch: Array, repeats: int, measured: bool = False
    ) -> tuple[Array, Slots]:
        """Return the ends of motions and memories `repeats` common periods later, (states, size), and the slots."""
        block = self.block(value)
        slots = block.slots(self.states(x, branch), np.full(len(x), self.distance(value)), repeats)
        slots.case[:] = 0
        block.march(slots, repeats, measured)
        return self.vectors(States(slots.ends[:, 0], slots.memory_after, slots.branch_after)), slots

    def steady(self, orbit: Orbit) -> Steady:
        """Return an orbit as the result at a point, with as many of its largest multipliers as a motion has numbers.

        The largest is below 1 where the orbit is stable, and nowhere else: a value that may be 1 is at least 1.
        """
        integrator = self.integrator(orbit.value / self.span)
        even = weights([tone.frequency for tone in integrator.problem.tones], len(orbit.rows))
        values = finish(integrator.problem, self.harmonics, orbit.rows, even)
        found = orbit.multipliers[: self._motion]
        modulus = np.abs(found)
        if not orbit.is_stable:
            modulus[0] = max(modulus[0], 1.0)
        values |= {
            "drift": orbit.residual,
            "corrections": orbit.steps,
            "multiplier_modulus": modulus,
            "multiplier_angle": angle(found),
        }
        if not math.isnan(orbit.error):
            values["error_estimate"] = orbit.error
        return Steady(values, orbit.state.motion(0), True, orbit.repeats == 1, self.settings.accuracy)

    def free_orbit(self, scaled: float) -> Orbit | None:
        """Return the orbit at a scaled value that Newton's method finds from the motion without forces."""
        integrator = self.integrator(scaled)
        start = States.of(with_amplitudes(integrator, integrator.problem.free))
        return self.find(np.append(self.vectors(start), scaled), start.branch)
