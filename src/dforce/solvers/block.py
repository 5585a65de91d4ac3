"""Problems that differ in numbers only, made ready to be solved side by side: one problem is a block of one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from dforce.core.arrays import Array, Indices
from dforce.core.lazy import lazy_property
from dforce.integrators.lanes import LANES, padded
from dforce.kernel.codegen import FIRST_DRIVE
from dforce.observables.averaging import common_period
from dforce.problem import Problem
from dforce.solvers import SolverSettings
from dforce.solvers.integrator import INTEGRATORS, Integrator, sample_count
from dforce.solvers.model import DISTANCE, FREQUENCY, Marching, Model
from dforce.solvers.newton import CONVERGED, Orbits, empty_orbits
from dforce.solvers.period_map import ALL, FD_STEP, NOTHING, Slots
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.quasi_static import COLUMNS, FOLLOWED, Course, Path, Stretch, set_out
from dforce.solvers.quasi_static_steps import PREDICTED
from dforce.solvers.relaxation import GOING, LOOKS, LOST, MOST_LOOKS, SETTLED, Leaps
from dforce.solvers.states import States
from dforce.solvers.tip_equations import TipEquations
from dforce.solvers.transient import DECAY_TIMES, LATE, LEAST_MOST, CancelCheck, chunks, never_cancelled

ABREAST = 64  # problems solved in one call: their samples stay in the cache; with memory, which takes long, one
LONGEST = 64  # periods in one call: so that Ctrl-C and Stop answer at once
FIRST = 500_000  # samples, times one more than numbers of memory, that the first call of `follow` marches: milliseconds
LEAPT = 20  # leaps may lead over so many times the periods after which motions are given up: each costs three or four


class Block(TipEquations):
    """A batch of problems to be solved, see `TipEquations`.

    Attributes
    ----------
    predicted, wanted
        Largest distance from its prediction at which an orbit continues the orbit before, and the measurements to take: see
        `Path`.
    """

    predicted, wanted = PREDICTED, ALL

    def __init__(
        self,
        batch: ProblemBatch,
        problem: Callable[[int, float], tuple[Problem, float]],
        settings: SolverSettings,
        harmonics: int,
        points: int,
        check_cancelled: CancelCheck = never_cancelled,
        zc: Array | None = None,
    ) -> None:
        super().__init__(batch, problem, harmonics, points, zc)
        self.settings, self.check_cancelled = settings, check_cancelled
        self._alone: Integrator | None = None
        self._finer: dict[int, Block] = {}

    @classmethod
    def of_one(
        cls,
        problem: Problem,
        settings: SolverSettings,
        harmonics: int,
        check_cancelled: CancelCheck = never_cancelled,
        points: int | None = None,
        unit: float | None = None,
    ) -> Block:
        """Return the block of one problem, along the distance, whose unit (m) is the free amplitude where it is left out."""
        samples = points or sample_count(problem, settings)
        batch = ProblemBatch.of([problem])
        block = cls(batch, lambda _, zc: (problem.at_height(zc), zc), settings, harmonics, samples, check_cancelled)
        block.unit = block.unit if unit is None else np.array([unit])
        return block

    @classmethod
    def along_frequency(
        cls,
        problem: Problem,
        zc: float,
        lowest: float,
        settings: SolverSettings,
        harmonics: int,
        points: int | None = None,
    ) -> Block:
        """Return the block of one problem at a distance (m), along the first tone's frequency from the lowest one (Hz) on."""

        def at(_: int, frequency: float) -> tuple[Problem, float]:
            return problem.at_frequency(frequency), zc

        # the lowest frequency needs the most samples per period for the same modes
        samples = points or sample_count(problem.at_frequency(lowest), settings)
        return cls(ProblemBatch.of([problem]), at, settings, harmonics, samples, zc=np.array([zc]))

    def one(self, case: int) -> Block:
        """Return the block of one of the problems."""
        alone = len(self.batch) == 1
        return self if alone else self._like([case], lambda _, value: self.problem(case, value), self.points)

    def finer(self, points: int) -> Block:
        """Return the block of the same problems with other samples per period."""
        if points not in self._finer:
            self._finer[points] = self._like(slice(None), self.problem, points)
        block = self._finer[points]
        block.check_cancelled = self.check_cancelled
        return block

    def _like(self, which: Any, problem: Callable[[int, float], tuple[Problem, float]], points: int) -> Block:
        """Return the block of some of the problems."""
        zc = self.numbers[which, 0] if self.parameter == FREQUENCY else None
        part, settings = self.batch.take(which), self.settings
        block = type(self)(part, problem, settings, self.harmonics, points, self.check_cancelled, zc)
        block.unit = self.unit[which]
        return block

    @property
    def repeats_together(self) -> bool:
        """Whether the tones have a common period, the same at all values of the parameter."""
        stays = self.parameter == DISTANCE or len(self.frequencies) == 1  # only the first tone's frequency changes
        return stays and common_period(self.frequencies) is not None

    @property
    def is_periodic(self) -> bool:
        """Whether periodic orbits themselves are looked for."""
        return self.settings.method == "periodic" and self.repeats_together

    def decay(self, which: Any) -> Indices:
        """Return decay times of the slowest mode, in whole common periods."""
        return np.asarray(np.ceil(np.maximum(4, self.batch.decay[which]) / self.common), dtype=np.int64)

    def follow(
        self,
        which: Indices,
        starts: States,
        at: Array,
        values: Array,
        counts: Indices | None = None,
        repeats: int = 1,
        report: Callable[[Stretch], None] = lambda found: None,
    ) -> Stretch:
        """Follow the stable orbit near each start, `at` a value of the parameter, along `values` (problems, values).

        `counts` is the number of values of each problem; left out: all. The orbits last `repeats` common periods. `report` is
        called with the stretch found so far, now and then.
        """
        counts = np.full(len(values), values.shape[1], dtype=np.int64) if counts is None else counts
        found = self.empty_stretch(starts, at, values.shape, repeats)
        for _ in self._follow(found, which, values, counts, repeats):
            report(found)
        return found

    def _follow(self, found: Stretch, which: Indices, values: Array, counts: Indices, repeats: int) -> Iterator[None]:
        """Follow stable orbits from the last ones found on, and pause now and then."""
        goes_on = values.shape[1] > 1 or not np.array_equal(values[:, 0], found.last_value)
        ahead = max(1, COLUMNS // (self.size + 2)) if self.is_smooth and goes_on else 1
        for part in self.parts(len(values)):
            most, stretch = len(counts[part]) * ahead, found.take(part)
            path = Path(np.ascontiguousarray(values[part]), counts[part], self.predicted, self.wanted)
            here = path, stretch, set_out(stretch, most), self._slots(most, self.common * repeats)
            yield from self._go_on(which[part], repeats, *here, empty_orbits(most, self.size))

    def _go_on(
        self, which: Indices, repeats: int, path: Path, stretch: Stretch, course: Course, slots: Slots, orbits: Orbits
    ) -> Iterator[None]:
        """Follow the stable orbits of problems that march together, see ``quasi_static.follow``."""
        follow, marching = self._solvers.entry("follow"), self.marching(which, len(slots.case), self.size + 2, repeats)
        first = max(1, FIRST // (len(marching.room) * self.common * repeats * (1 + len(self.memory_scale))))
        for marches in chunks(math.inf, self.check_cancelled, first):
            if follow(path, stretch, course, slots, orbits, marching, marches):
                break
            yield
        self.check_cancelled()

    def empty_stretch(self, starts: States, at: Array, shape: tuple[int, ...], repeats: int) -> Stretch:
        """Return empty stretches along paths, (problems, values), from the start of each."""
        cases, size = len(at), self.size

        def room(*inner: int) -> Array:
            return np.full((*shape, *inner), np.nan)

        return Stretch(
            room(size),
            room(len(self.memory_scale)),
            room(self.hysteresis),
            room(size, size),
            room(self.common * repeats, self.columns),
            room(),
            np.zeros(shape, np.int64),
            np.zeros(cases, np.int64),
            np.full(cases, FOLLOWED, np.int64),
            at.astype(float),
            starts.x.copy(),
            starts.memory.copy(),
            starts.branch.copy(),
            np.full((cases, size, size), np.nan),
            np.zeros((cases, size)),
            np.full(cases, np.nan),
        )

    def parts(self, cases: int) -> Iterator[slice]:
        """Give the problems that are solved in one call."""
        abreast = 1 if len(self.memory_scale) else ABREAST
        for start in range(0, cases, abreast):
            yield slice(start, start + abreast)

    def advance(self, which: Indices, states: States, at: Array, periods: int) -> States:
        """Return states `periods` common periods later."""
        out = states.copy()
        if self.settings.integrator != "rk4":
            for i, case in enumerate(which.tolist()):
                motion, _ = self.integrator(case, at[i]).lock_in(out.motion(i), periods * self.common)
                out.put([i], States.of(motion))
            return out
        advance = self._solvers.entry("advance_block")
        for part in self.parts(len(which)):
            slots = self.slots(out.take(part), at[part])
            marching = self.marching(which[part], len(slots.case), 1)
            for done in range(0, periods, LONGEST):
                advance(slots, min(LONGEST, periods - done), marching)
                self.check_cancelled()
            out.x[part], out.memory[part], out.branch[part] = slots.x, slots.memory, slots.branch
        return out

    def march(self, slots: Slots, repeats: int = 1, measured: bool = False) -> None:
        """Advance motions by `repeats` common periods, and measure them if `measured`."""
        count = len(slots.case)
        if self.settings.integrator != "rk4":
            states, periods = States(slots.x, slots.memory, slots.branch), self.common * repeats
            for s in range(count):
                integrator = self.integrator(int(slots.case[s]), slots.value[s])
                if measured:
                    end, slots.rows[s] = integrator.observe(states.motion(s), periods)
                else:
                    end, _ = integrator.lock_in(states.motion(s), periods)
                slots.ends[s, 0], slots.memory_after[s], slots.branch_after[s] = end.y, end.memory, end.branch
            return
        marching = Marching(self._all, self.drive(repeats), self._room(count, 1))
        self._solvers.entry("march")(slots, np.arange(count), count, 1, measured, marching)

    def driven(self, zc: Array, states: States, at: Array, ratio: Array, wanted: int) -> tuple[States, Array]:
        """March motions of the first problem over a common period at distances (m), frequencies (Hz) and relative drives.

        The second array has the measurements, :data:`MOTION` or :data:`ALL`, (motions, periods, columns).
        """
        out, rows = states.copy(), np.empty((len(zc), self.common, self.columns))
        march = self._solvers.entry("march")
        for start in range(0, len(zc), ABREAST):
            part = slice(start, start + ABREAST)
            slots = self.slots(states.take(part), at[part])
            order, model = np.arange(len(slots.case)), self._driven
            slots.wanted[:] = wanted
            model.numbers[0, : len(order)] = zc[part]
            drive = self.batch.tones[0, :, FIRST_DRIVE:-1]
            model.tones[: len(order), :, FIRST_DRIVE:-1] = ratio[part, None, None] * drive
            march(slots, order, len(order), 1, True, Marching(model, self.drive(1), self._room(len(order), 1)))
            out.put(part, States(slots.ends[:, 0], slots.memory_after, slots.branch_after))
            rows[part] = slots.rows
            self.check_cancelled()
        return out, rows

    def tables_driven(self, zc: Array, at: Array, ratio: Array) -> tuple[Array, Array]:
        """Return the kernel's parameters and tone tables of such motions."""
        numbers, tones = self.tables_of(np.zeros(len(zc), np.int64), at)
        numbers[:, 0] = zc
        tones[:, :, FIRST_DRIVE:-1] *= ratio[:, None, None]
        return numbers, tones

    def find(self, which: Indices, slots: Slots, orbits: Orbits, repeats: int) -> None:
        """Find the orbits of some problems near motions by Newton's method."""
        marching = self.marching(which, len(slots.case), self.size + 2, repeats)
        self._solvers.entry("find_orbits")(slots, orbits, marching)

    def shifts(self, which: Indices, states: States, at: Array, slopes: Array, repeats: int) -> Array:
        """Return how far (SI), along the parameter, curves lie from steep orbits found with other samples; NaN if unknown.

        Each orbit is found again in the plane across its curve, as at a fold none may be left at the same value.
        `slopes` are the curves' slopes there (per unit of the parameter).
        """
        out = np.empty(len(which))
        for part in self.parts(len(which)):
            slots, orbits = self.slots(states.take(part), at[part], repeats), empty_orbits(len(which[part]), self.size)
            slots.wanted[:] = NOTHING
            orbits.normal[:, :-1] = slopes[part]
            orbits.normal[:] /= np.linalg.norm(orbits.normal, axis=1)[:, None]
            self.find(which[part], slots, orbits, repeats)
            out[part] = np.where(orbits.outcome == CONVERGED, slots.value - at[part], np.nan)
        return out

    def take_step(self, slots: Slots, each: int, orbits: Orbits) -> None:
        """Take the Newton step of the only slot, which holds no memory, see ``newton.take_steps``."""
        nothing = np.empty(0)
        self._solvers.entry("take_steps")(slots, np.zeros(1, np.int64), 1, each, nothing[None], nothing, orbits)

    @lazy_property
    def _driven(self) -> Model:
        """The tip equation of the first problem many times, to be changed for motions that are marched together."""
        return self.model(np.zeros(ABREAST, np.int64))

    @lazy_property
    def _all(self) -> Model:
        return self.model(np.arange(len(self.batch)))

    def relax(self, which: Indices, states: States, at: Array) -> tuple[States, Any, Array]:
        """Return where motions come to, which of them are near a stable orbit there, and the periods that it took them.

        Of forces that are functions of the motion; see ``relaxation``.
        """
        leaps = Leaps.begun(states.x, self.most_periods(which) * (1 if self.settings.max_periods else LEAPT))
        late, take = np.maximum(LEAST_MOST // self.common, LATE * self.decay(which)), self._solvers.entry("take_leaps")
        for look in range(1, MOST_LOOKS + 1):
            going = np.flatnonzero(leaps.outcome == GOING)
            if not len(going):
                break
            self.check_cancelled()
            here = States(leaps.tried[going], states.memory[going], states.branch[going])
            take(going, *self.derivatives(which[going], here, at[going]), leaps)
            if look % LOOKS == 0:
                # after so long a motion is on no way to a state that is held at less than a period a leap
                leaps.outcome[(leaps.outcome == GOING) & (look >= late) & (leaps.periods < look)] = LOST
        settled = leaps.outcome == SETTLED
        return States(leaps.x, states.memory.copy(), states.branch.copy()), settled, leaps.periods * float(self.common)

    def derivatives(self, which: Indices, states: States, at: Array) -> tuple[Array, Array]:
        """Return where motions end one common period later, and the map's derivatives there; without a memory."""
        slots, count, columns = self.slots(states, at), len(which), 1 + self.size
        marching = self.marching(which, count, columns)
        self._solvers.entry("march")(slots, np.arange(count), count, columns, False, marching)
        ends = slots.ends[:, :columns]
        slopes = (ends[:, 1:] - ends[:, :1]).swapaxes(1, 2) / FD_STEP
        return ends[:, 0].copy(), np.ascontiguousarray(slopes)

    def most_periods(self, which: Any) -> Indices:
        """Return the number of common periods after which motions are given up."""
        if self.settings.max_periods is not None:
            return np.full(len(which), max(1, self.settings.max_periods // self.common), dtype=np.int64)
        return np.asarray(np.maximum(LEAST_MOST // self.common, DECAY_TIMES * self.decay(which)), dtype=np.int64)

    def integrator(self, case: int, value: float) -> Integrator:
        """Return the integrator of one problem at a value of the parameter."""
        problem, zc = self.problem(case, value)
        if self._alone is None:
            self._alone = INTEGRATORS[self.settings.integrator](problem, self.settings, self.harmonics, self.points)
        elif self._alone.problem != problem:
            self._alone.take(problem)
        self._alone.place(zc)
        return self._alone

    def slots(self, states: States, at: Array, repeats: int = 1) -> Slots:
        """Return slots that hold copies of states, one of each problem, at values of the parameter."""
        slots = self._slots(len(states), self.common * repeats)
        slots.case[:], slots.value[:] = np.arange(len(states)), at
        slots.x[:], slots.memory[:], slots.branch[:] = states.x, states.memory, states.branch
        return slots

    def _slots(self, count: int, periods: int) -> Slots:
        size, states, branches = self.size, len(self.memory_scale), self.hysteresis
        return Slots(
            np.empty(count, np.int64),
            np.empty(count),
            np.empty((count, size)),
            np.empty((count, states)),
            np.empty((count, branches)),
            np.empty((count, size + 2, size)),
            np.empty((count, states)),
            np.empty((count, branches)),
            np.zeros((max(count, len(self.batch)), size + 2, states)),  # of each problem
            np.empty((count, periods, self.columns)),
            np.full(count, self.wanted),
        )

    def marching(self, which: Indices, slots: int, each: int, repeats: int = 1) -> Marching:
        """Return equations, drive and scratch for so many slots of some problems, with so many columns each."""
        return Marching(self.model(which), self.drive(repeats), self._room(slots, each))

    def _room(self, slots: int, each: int) -> Array:
        """Return scratch for the samples of slots alone, or of the ends of each with its neighbors."""
        count = (self.size + 1) * max((self.points + 1) * padded(slots), 2 * padded(slots * each))
        room = np.empty(count + LANES)
        # a vector of lanes is one line of the cache
        return room[-room.__array_interface__["data"][0] // room.itemsize % LANES :]
