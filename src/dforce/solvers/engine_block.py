"""Problems side by side on the engine: steps that fit the motion, derivatives carried along, Newton's method over slots."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from dforce.core.arrays import Array, Indices
from dforce.core.errors import ParameterError
from dforce.engine.marching import Marched, Marcher, Start
from dforce.kernel import modes_of
from dforce.kernel.codegen import CONTACT
from dforce.solvers.block import Block
from dforce.solvers.model import DISTANCE
from dforce.solvers.newton import CONVERGED, FAILED, Orbits, solve_each
from dforce.solvers.period_map import NOTHING, Slots
from dforce.solvers.quasi_static import Course, Path, Stretch, go_ahead, judge, look_ahead
from dforce.solvers.states import States

MOTION, COLUMNS, HARMONIC = 0.03, 0.003, 0.1  # of the accuracy times a mode's damping: error of a step; see `limits`
ROUNDING = 1e-15  # of the free amplitude: steps cannot have smaller errors
ACCURACY = 1e-4  # where none is promised
NEARBY = 1e-5  # of the free amplitude: Newton step behind which the next one is smaller than rounding
STRAY = 1e-3  # of the free amplitude: longest Newton step with the derivatives from before, as marches that are measured differ
ACCEPTED = 3e-3  # of the accuracy: Newton step, in free amplitudes, with which an orbit is accepted as it was marched
LONG, CONTRACTS = 0.3, 0.5  # of the free amplitude: longest Newton step; of the step before: the next one
MOST_STEPS, MOST_PASSES = 10, 6
BESIDE = 1e-4  # of the free amplitude, or of the parameter's unit: neighbors, where differences give derivatives
FINE = 0.01  # times the errors of steps, for such neighbors
LONGEST = 16  # periods in one call, so that Ctrl-C and Stop answer at once
FINER = 4.0  # errors of steps fall with this power of the samples that a finer block is asked for


class EngineBlock(Block):
    """Problems that differ in numbers only, on the engine."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        remembering = ["the fluid"] * bool(self.late)
        remembering += [force.name for force in self.batch.example.forces if force.memory]
        if remembering:
            raise ParameterError(
                f'solver.integrator = "engine" finds no periodic orbit with the memory of {remembering[0]}; '
                'write integrator = "rk4", or method = "transient"'
            )
        self._marcher = Marcher.of(self.batch.example)
        self._places = np.unique(
            np.concatenate([self.batch.kinks, self.numbers[:, CONTACT : CONTACT + 1]], axis=1), axis=1
        )
        self._fineness = 1.0

    def finer(self, points: int) -> EngineBlock:
        """Return the block of the same problems with smaller errors of steps."""
        block = super().finer(points)
        assert isinstance(block, EngineBlock)
        block._fineness = self._fineness * (points / self.points) ** FINER
        return block

    @property
    def accuracy(self) -> float:
        """Error that quantities may have, as a share of their scales."""
        return (self.settings.accuracy or ACCURACY) / self._fineness

    def limits(self, numbers: Array, share: float = 1.0) -> Array:
        """Return the errors of steps that motions may have: errors add up over as many periods as the slowest mode rings."""
        damping = np.minimum(modes_of(numbers, self.modes)[:, :, 1].min(axis=1), 1.0)
        accuracy = share * self.accuracy
        motion, harmonic = np.maximum(MOTION * accuracy * damping, ROUNDING), np.full(len(damping), HARMONIC * accuracy)
        return np.stack([motion, COLUMNS * share * damping, harmonic], axis=1)

    def marched(
        self, which: Indices, states: States, at: Array, periods: int, *, share: float = 1.0, **wanted: Any
    ) -> Marched:
        """March motions over `periods` periods of the first tone; see `Marcher.march`."""
        numbers, tones = self.tables_of(which, at)
        if self.parameter == DISTANCE:
            numbers[:, 0] = at
        start = Start(numbers, tones, self._places[which], states.x, states.memory, states.branch)
        return self._marcher.march(start, periods, self.limits(numbers, share), **wanted)

    def derived(self, which: Indices, states: States, at: Array, repeats: int) -> Marched:
        """March over `repeats` common periods, with the map's derivatives.

        The last of its columns is by the parameter (per unit): by differences where all numbers change with it.
        """
        periods, unit = self.common * repeats, self.unit[which]
        out = self.marched(which, states, at, periods, unit=unit)
        if self.parameter == DISTANCE and self.batch.levers is None:
            return out
        ends = [
            self.marched(which, states, value, periods, share=FINE).path[:, -1] for value in (at, at + BESIDE * unit)
        ]
        out.columns[:, :, -1] = (ends[1] - ends[0]) / BESIDE
        return out

    def find(self, which: Indices, slots: Slots, orbits: Orbits, repeats: int) -> None:
        """Find the orbits of some problems near motions by Newton's method; see :meth:`Block.find`."""
        count, size, periods = len(which), self.size, self.common * repeats
        wanted = slots.wanted != NOTHING
        harmonics = self.harmonics if wanted.any() else None
        accepted = ACCEPTED * min(self.accuracy, ACCURACY)
        for part in (orbits.monodromy, orbits.by_parameter, orbits.slope, orbits.residual):
            part[:] = np.nan
        orbits.steps[:], orbits.outcome[:] = 0, FAILED
        state, before = States(slots.x, slots.memory, slots.branch), np.full(count, np.inf)
        going, near = np.arange(count), [np.empty(0, np.int64)]
        for _ in range(MOST_STEPS):
            if not len(going):
                break
            out = self.derived(which[going], state.take(going), slots.value[going], repeats)
            by, miss = out.columns, out.path[:, -1] - state.x[going]
            step, slope = bordered(by, orbits.normal[going], miss)
            length = np.abs(step[:, :size]).max(axis=1)
            fine = (length < np.inf) & ~((length > CONTRACTS * before[going]) & (length > NEARBY))
            going, by, miss, step, slope, length = (one[fine] for one in (going, by, miss, step, slope, length))
            orbits.steps[going] += 1
            orbits.monodromy[going], orbits.by_parameter[going] = by[:, :, :size], by[:, :, size]
            orbits.slope[going], orbits.residual[going] = slope[:, :size], np.abs(miss).max(axis=1)
            part = np.minimum(1.0, LONG / np.maximum(length, 1e-300))
            state.x[going] += part[:, None] * step[:, :size]
            slots.value[going] += part * step[:, size] * self.unit[which[going]]
            state.memory[going], state.branch[going] = out.memory[fine], out.branch[fine]
            before[going] = np.where(part == 1.0, length, np.inf)
            close = length < NEARBY
            done = close & ~wanted[going]
            orbits.outcome[going[done]] = CONVERGED
            near.append(going[close & ~done])
            going = going[~close]
        going = np.concatenate(near)
        before[:] = np.inf
        for _ in range(MOST_PASSES):
            if not len(going):
                break
            out = self.marched(which[going], state.take(going), slots.value[going], periods, harmonics=harmonics)
            miss = out.path[:, -1] - state.x[going]
            by = np.concatenate([orbits.monodromy[going], orbits.by_parameter[going, :, None]], axis=2)
            step, _ = bordered(by, orbits.normal[going], miss)
            length = np.abs(step[:, :size]).max(axis=1)
            same = (out.branch == state.branch[going]).all(axis=1)
            orbits.residual[going] = np.where(same, np.abs(miss).max(axis=1), np.inf)
            if harmonics is not None:
                slots.rows[going] = out.rows
            lost = ~(length < STRAY) | ((length > CONTRACTS * before[going]) & same)
            done = (length < accepted) & same
            kept = ~lost
            state.x[going[kept]] += step[kept, :size]
            slots.value[going[kept]] += step[kept, size] * self.unit[which[going[kept]]]
            state.memory[going], state.branch[going] = out.memory, out.branch
            orbits.outcome[going[done]] = CONVERGED
            before[going] = length
            going = going[~done & ~lost]

    def _go_on(
        self, which: Indices, repeats: int, path: Path, stretch: Stretch, course: Course, slots: Slots, orbits: Orbits
    ) -> Iterator[None]:
        """Follow the stable orbits of problems that march together, see ``quasi_static.follow``."""
        unit, longer, fitting = self.unit[which], np.empty(len(slots.case)), np.empty(len(slots.case), np.int64)
        while True:
            look_ahead(path, stretch, course, slots, orbits, unit)
            some = slice(course.sought[0])
            if not some.stop:
                return
            found = Slots(*(part[some] for part in slots)), Orbits(*(part[some] for part in orbits))
            self.find(which[slots.case[some]], *found, repeats)
            judge(path, stretch, course, slots, orbits, unit, longer, fitting)
            go_ahead(path, stretch, course, slots, orbits, unit, longer)
            self.check_cancelled()
            yield

    def advance(self, which: Indices, states: States, at: Array, periods: int) -> States:
        """Return states `periods` common periods later."""
        out = states.copy()
        for done in range(0, periods, LONGEST):
            found = self.marched(which, out, at, self.common * min(LONGEST, periods - done))
            out = States(found.path[:, -1].copy(), found.memory, found.branch)
            self.check_cancelled()
        return out

    def march(self, slots: Slots, repeats: int = 1, measured: bool = False) -> None:
        """Advance motions by `repeats` common periods, and measure them if `measured`."""
        states, harmonics = States(slots.x, slots.memory, slots.branch), self.harmonics if measured else None
        out = self.marched(slots.case, states, slots.value, self.common * repeats, harmonics=harmonics)
        slots.ends[:, 0], slots.memory_after[:], slots.branch_after[:] = out.path[:, -1], out.memory, out.branch
        if measured:
            slots.rows[:] = out.rows

    def driven(self, zc: Array, states: States, at: Array, ratio: Array, wanted: int) -> tuple[States, Array]:
        """March motions at distances, frequencies and relative drives; see :meth:`Block.driven`."""
        numbers, tones = self.tables_driven(zc, at, ratio)
        places = self._places[np.zeros(len(zc), np.int64)]
        start = Start(numbers, tones, places, states.x, states.memory, states.branch)
        out = self._marcher.march(start, self.common, self.limits(numbers), harmonics=self.harmonics)
        return States(out.path[:, -1].copy(), out.memory, out.branch), out.rows

    def derivatives(self, which: Indices, states: States, at: Array) -> tuple[Array, Array]:
        """Return where motions end one common period later, and the map's derivatives there."""
        out = self.derived(which, states, at, 1)
        return out.path[:, -1].copy(), out.columns[:, :, : self.size].copy()


def bordered(by: Array, normal: Array, miss: Array) -> tuple[Array, Array]:
    """Solve (1 - M) dx - dP/dv dv = miss with normal (dx, dv) = 0; and, for the slope, = 0 with normal (dx, dv) = 1.

    Rows are NaN where there is no solution.
    """
    count, size = miss.shape
    matrix = np.empty((count, size + 1, size + 1))
    matrix[:, :size] = -by
    matrix[:, range(size), range(size)] += 1.0
    matrix[:, size] = normal
    sides = np.zeros((count, size + 1, 2))
    sides[:, :size, 0], sides[:, size, 1] = miss, 1.0
    out = solve_each(matrix, sides)
    return out[..., 0], out[..., 1]
