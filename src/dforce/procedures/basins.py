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
from dforce.core.parallel import Crew, uncounted
from dforce.experiments import Basins
from dforce.experiments.base import CurvePlan, Progress
from dforce.experiments.basins import MOST_STARTS
from dforce.problem import Problem
from dforce.procedures.found import Found, Layout, dataset
from dforce.procedures.statuses import need_samples, statuses
from dforce.results.status import REPEATING, Status
from dforce.solvers import SolverSettings
from dforce.solvers.accuracy import assure
from dforce.solvers.blocks import block_type
from dforce.solvers.compiled import load_kernels
from dforce.solvers.integrator import Integrator, Motion, with_amplitudes
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.protocols import QUASI_STATIC, make_protocol
from dforce.solvers.sample_counts import sample_counts
from dforce.solvers.transient import CancelCheck

BLOCK, LEAST_BLOCK = 256, 8  # starts that settle side by side; where the force has memory or branches
OF_STARTS = frozenset(
    {"settling_periods", "drift", "corrections"}
)  # observables of the way to a state, not of the state
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
            "share": ("state", starts.shares(order)),
        },
        coords={**grids, "zc": plan.zc},
    )
    data = data.merge(_table([starts.states[i] for i in order], problem))
    return data if whole else data.assign_attrs(interrupted=1)


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
        """Give the jobs: blocks of starts."""
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
        amplitudes, tone = integrator.problem.free.copy(), integrator.problem.tones[0]
        amplitudes[0] = 0.0
        if self.kind == "start_amplitude":
            amplitudes[0, tone.mode] = one * np.exp(1j * (tone.phase - np.radians(other)))
        else:
            amplitudes[0, tone.mode] = one - 1j * other / (2.0 * np.pi * tone.frequency)
        return with_amplitudes(integrator, amplitudes)

    def _settle(self, which: Indices, motions: list[Motion], crew: Crew) -> None:
        """Settle a block of starts, with more samples where needed."""
        plain = block_type(self.settings).of_one(self.problem, self.settings, self.harmonics, crew.check_cancelled)
        crew_add: Callable[[int], None] = crew.add
        for points in sample_counts(plain.points, self.settings):
            which = self._settle_with(points, which, motions, crew.check_cancelled, crew_add)
            if not len(which):
                return
            crew_add = uncounted  # they were counted

    def _settle_with(
        self,
        points: int,
        which: Indices,
        motions: list[Motion],
        check_cancelled: CancelCheck,
        report_done: Callable[[int], None],
    ) -> Indices:
        """Settle starts side by side; return the starts that need more samples."""
        batch = ProblemBatch.of([self.problem]).take(np.zeros(len(which), dtype=np.int64))
        block = block_type(self.settings)(
            batch, lambda _, zc: (self.problem, zc), self.settings, self.harmonics, points, check_cancelled
        )
        values = np.full((len(which), 1), self.zc)
        solver = make_protocol(QUASI_STATIC, block, values, [motions[i] for i in which], report_done)
        solver.run()
        assure(block, values, solver.points)
        columns, status = solver.points.columns(block, values), statuses(solver.points, block, values)[:, 0]
        self.status[which] = status
        for place in np.flatnonzero(np.isin(status, (*REPEATING, Status.NOT_REPEATING))).tolist():
            of_start = {name: value[place, 0] for name, value in columns.items()}
            self._sort_in(int(which[place]), of_start, status[place] in REPEATING)
        return np.asarray(which[need_samples(solver.points, status[:, None])])

    def _sort_in(self, number: int, values: dict[str, Any], repeats: bool) -> None:
        """Give a start its state: one found before, or a new one. All motions that do not repeat count as one state."""
        amplitudes = np.asarray(values["amplitude"]) * np.exp(-1j * np.radians(values["phase"]))
        nearness = ALIKE * self.problem.tones[0].A0
        with self._lock:
            for i, state in enumerate(self.states):
                near = bool(np.max(np.abs(state.amplitudes - amplitudes)) < nearness)
                if state.repeats == repeats and (near or not repeats):
                    self.reached[number] = i
                    if number < state.first:  # the numbers are the same in any order of the threads
                        self.states[i] = State(amplitudes, values, repeats, number)
                    break
            else:
                self.states.append(State(amplitudes, values, repeats, number))
                self.reached[number] = len(self.states) - 1

    def by_share(self) -> list[int]:
        """Return the states' numbers, the most frequently reached first."""
        return sorted(range(len(self.states)), key=lambda i: (-int(np.sum(self.reached == i)), self.states[i].first))

    def shares(self, order: list[int]) -> list[float]:
        """Return the share of the starts that settle which leads to each state."""
        count = max(1, int(np.sum(self.reached >= 0)))
        return [float(np.sum(self.reached == i)) / count for i in order]


def _table(states: list[State], problem: Problem) -> xr.Dataset:
    """Return the observables that all states have."""
    numbers, found = np.arange(1, len(states) + 1), Found.empty(1, len(states))
    for place, state in enumerate(states):
        shown = set.intersection(*(set(one.values) for one in states)) - OF_STARTS
        found.keep((0, place), {name: value for name, value in state.values.items() if name in shown}, Status.OK)
    plan = CurvePlan("state", numbers.astype(float), [(place,) for place in range(len(states))])
    return dataset(Layout([plan], {"state": numbers}), [found], problem).drop_vars("status")
