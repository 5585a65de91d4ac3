"""Basins: which of the steady states at one distance is reached from which start."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from dforce.case import Case
from dforce.core.arrays import Array, Complexes, Indices
from dforce.core.errors import ParameterError
from dforce.core.parallel import Crew
from dforce.core.quantities import OBSERVABLES
from dforce.experiments import Basins
from dforce.experiments.base import Progress
from dforce.experiments.basins import MOST_STARTS
from dforce.problem import Problem
from dforce.procedures.statuses import statuses
from dforce.results.status import REPEATING, Status
from dforce.solvers import SolverSettings
from dforce.solvers.blocks import block_type
from dforce.solvers.integrator import Integrator, Motion, free_amplitudes, load_kernels, with_amplitudes
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.protocols import STEPWISE, Protocol, make_protocol
from dforce.solvers.quasi_static_walk import Walk
from dforce.solvers.sample_counts import sample_counts
from dforce.solvers.states import States
from dforce.solvers.transient import CancelCheck

BLOCK, LEAST_BLOCK = 256, 8  # starts that settle side by side; where the force has memory or branches
ALIKE = 5e-3  # of the free amplitude: states whose complex amplitudes are so near are one


def basins(case: Case, plan: Basins, report_progress: Progress, _earlier: xr.Dataset | None) -> xr.Dataset:
    """Return which state each start leads to, and the states; see :func:`dforce.runs.carry_out`."""
    problem, grids = case.problem.at_height(plan.zc), plan.coordinates(case.problem)
    if np.prod([float(len(grid)) for grid in grids.values()]) > MOST_STARTS:
        raise ParameterError(f"experiment has more than {MOST_STARTS} starts; give its grids fewer points")
    shape = tuple(map(len, grids.values()))
    (kind, first), (_, second) = grids.items()
    starts = Starts(problem, case.solver, plan.harmonics, plan.zc, first, second, kind)
    crew = Crew(len(starts), report_progress)
    whole = crew.run(starts.jobs(crew), f"{shape[0]} × {shape[1]} starts")
    order = starts.by_share()
    number = np.zeros(len(starts.states) + 1, dtype=np.int64)  # behind the states: of no state
    number[order] = np.arange(1, len(order) + 1)
    data = xr.Dataset(
        {
            "reached": (tuple(grids), number[starts.reached].reshape(shape)),
            "status": (tuple(grids), starts.status.reshape(shape)),
            **starts.table(order),
        },
        coords={**grids, "state": np.arange(1, len(order) + 1), "zc": plan.zc},
    )
    for dim in ("tone", "mode", "harmonic", "multiplier"):
        if dim in data.dims:
            data[dim] = np.arange(1, data.sizes[dim] + 1)
    if not whole:
        data.attrs["interrupted"] = 1
    return data


@dataclass
class State:
    """A steady state: complex amplitudes at the tones (m), its observables, whether it repeats, and its first start."""

    amplitudes: Complexes
    values: dict[str, Any]
    repeats: bool
    first: int


@dataclass
class Starts:
    """The starts of a grid, and the states that they reach."""

    problem: Problem
    settings: SolverSettings
    harmonics: int
    zc: float
    first: Array
    second: Array
    kind: str
    states: list[State] = field(default_factory=list)

    def __post_init__(self) -> None:

        self._lock = threading.Lock()  # blocks of starts are done on several threads
        self.reached = np.full(len(self), -1)
        self.status = np.full(len(self), Status.NOT_COMPUTED, dtype=np.int8)

    def __len__(self) -> int:
        return len(self.first) * len(self.second)

    def jobs(self, crew: Crew) -> Iterable[Callable[[], None]]:
        """Give what is to be done: blocks of starts."""
        load_kernels(self.problem)  # before threads ask for them at the same time
        template = block_type(self.settings).of_one(self.problem, self.settings, self.harmonics, crew.check_cancelled)
        motions = [self.motion(template.integrator(0, self.zc), number) for number in range(len(self))]
        size = BLOCK if template.is_smooth else LEAST_BLOCK
        for start in range(0, len(self), size):
            which = np.arange(start, min(start + size, len(self)), dtype=np.int64)
            yield functools.partial(self._settle, which, motions, crew)

    def motion(self, integrator: Integrator, number: int) -> Motion:
        """Return one start, as an integrator takes it."""
        one, other = self.first[number // len(self.second)], self.second[number % len(self.second)]
        amplitudes, tone = free_amplitudes(integrator), integrator.problem.tones[0]
        amplitudes[0] = 0.0
        if self.kind == "start_amplitude":
            amplitudes[0, tone.mode] = one * np.exp(1j * (tone.phase - np.radians(other)))
        else:
            amplitudes[0, tone.mode] = one - 1j * other / (2.0 * np.pi * tone.frequency)
        return with_amplitudes(integrator, amplitudes)

    def _settle(self, which: Indices, motions: list[Motion], crew: Crew) -> None:
        """Settle a block of starts; those that need more samples with more."""
        plain = block_type(self.settings).of_one(self.problem, self.settings, self.harmonics, crew.check_cancelled)
        crew_add: Callable[[int], None] = crew.add
        for points, is_last in sample_counts(plain.points, self.settings):
            which = self._settle_with(points, which, motions, crew.check_cancelled, crew_add, is_last)
            if not len(which):
                return
            crew_add = _nothing  # they are counted

    def _settle_with(
        self,
        points: int,
        which: Indices,
        motions: list[Motion],
        check_cancelled: CancelCheck,
        report_done: Callable[[int], None],
        is_last: bool,
    ) -> Indices:
        """Settle starts side by side; return those that have to be settled again."""
        batch = ProblemBatch.of([self.problem]).take(np.zeros(len(which), dtype=np.int64))
        block = block_type(self.settings)(
            batch, lambda _, zc: (self.problem, zc), self.settings, self.harmonics, points, check_cancelled
        )
        values = np.full((len(which), 1), self.zc)
        starts = [motions[i] for i in which]
        if block.is_periodic:
            solver: Protocol = Walk(block, values, States.of(*starts), report_done)
        else:
            solver = make_protocol(STEPWISE, block, values, starts, report_done)
        solver.run()
        columns, status = solver.points.columns(block, values), statuses(solver.points, block, values)[:, 0]
        wrong = status == Status.UNRESOLVED
        for place in np.flatnonzero(~wrong if not is_last else np.ones_like(wrong)).tolist():
            number = int(which[place])
            self.status[number] = status[place]
            if status[place] in (*REPEATING, Status.NOT_REPEATING):
                of_start = {name: value[place, 0] for name, value in columns.items()}
                self._sort_in(number, of_start, status[place] in REPEATING)
        return which[wrong] if not is_last else which[:0]

    def _sort_in(self, number: int, values: dict[str, Any], repeats: bool) -> None:
        """Give a start its state: one found before, or a new one. All motions that do not repeat count as one state."""
        amplitudes = np.asarray(values["amplitude"]) * np.exp(-1j * np.radians(values["phase"]))
        nearness = ALIKE * self.problem.tones[0].A0
        with self._lock:
            for i, state in enumerate(self.states):
                near = bool(np.max(np.abs(state.amplitudes - amplitudes)) < nearness)
                if state.repeats == repeats and (near or not repeats):
                    self.reached[number] = i
                    if number < state.first:  # whichever thread comes first, the numbers are the same
                        self.states[i] = State(amplitudes, values, repeats, number)
                    break
            else:
                self.states.append(State(amplitudes, values, repeats, number))
                self.reached[number] = len(self.states) - 1

    def by_share(self) -> list[int]:
        """Return the states' numbers, the most frequently reached first."""
        return sorted(range(len(self.states)), key=lambda i: (-int(np.sum(self.reached == i)), self.states[i].first))

    def table(self, order: list[int]) -> dict[str, Any]:
        """Return the observables and shares of the states, as variables of a Dataset."""
        count = max(1, int(np.sum(self.reached >= 0)))
        table: dict[str, Any] = {"share": ("state", [float(np.sum(self.reached == i)) / count for i in order])}
        for name, observable in OBSERVABLES.items():
            column = [self.states[i].values[name] for i in order if name in self.states[i].values]
            if column and len(column) == len(order) and name not in ("settling_periods", "drift", "corrections"):
                table[name] = (("state", *observable.dims), np.array(column))
        return table


def _nothing(points: int) -> None:
    """Count nothing."""
