"""The cases of a sweep that differ in numbers only, solved in blocks."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import threading
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from dforce.case import Case
from dforce.core.parallel import Crew, Stopped, uncounted
from dforce.core.stopping import watching
from dforce.experiments.base import DISTANCE, CurveExperiment, initial_motions
from dforce.maps._grid import ProblemGrid
from dforce.maps._result import SweepLayout, finished
from dforce.maps.axes import Axis, amplitude_axis, count, dims_of
from dforce.procedures.found import Found, dataset, split
from dforce.procedures.motion import motions
from dforce.procedures.statuses import need_samples, statuses, without_failed
from dforce.results.status import Status
from dforce.solvers.accuracy import assure, assure_in_grace
from dforce.solvers.block import Block
from dforce.solvers.blocks import block_type
from dforce.solvers.compiled import load_kernels
from dforce.solvers.integrator import sample_count
from dforce.solvers.problem_batch import ProblemBatch, has_own_samples
from dforce.solvers.protocols import Stepwise, make_protocol
from dforce.solvers.quasi_static_walk import Walk
from dforce.solvers.sample_counts import sample_counts
from dforce.solvers.transient import never_cancelled

if TYPE_CHECKING:
    import xarray as xr

    from dforce.core.arrays import Array, Bools
    from dforce.problem import Problem

BLOCK = 256  # cases side by side, at most; fewer where there would not be a block for each worker
LEAST_BLOCK = 8
_loading = threading.Lock()


class SideBySide:
    """The cases of a sweep, curves or points along the distance, solved in blocks."""

    def __init__(self, layout: SweepLayout) -> None:
        self.layout = layout
        self.founds = [Found.empty(layout.cases, layout.points) for _ in range(layout.parts)]
        self.example: Problem = layout.case.problem

    def take(self, earlier: xr.Dataset) -> int:
        """Take over the cases that an interrupted sweep has whole; return the number of their points."""
        self.founds = split(earlier, self.layout)
        return sum(int(found.whole.sum()) for found in self.founds) * self.layout.points

    def compute(self, crew: Crew, kept: frozenset[str]) -> bool:
        """Compute the cases that are missing, with the quantities that are kept; return False when stopped before the end."""
        parts = [
            SweepPart(case, self.layout.numbers, crew, kept, found)
            for case, found in zip(self.layout.side_by_side, self.founds, strict=True)
        ]
        self.example = parts[0].grid.example
        return all(part.run() for part in parts)

    def result(self, asked: Case) -> xr.Dataset:
        """Return the finished cases, with the words and the case of the sweep."""
        return finished(dataset(self.layout, self.founds, self.example), asked, self.layout)


class SweepPart:
    """The cases of a sweep that differ in numbers only; complete cases in `found` are not computed again."""

    def __init__(self, case: Case, axes: list[Axis], crew: Crew, kept: frozenset[str], found: Found) -> None:
        self.case, self.crew, self.kept = case, crew, kept
        self.experiment = cast(CurveExperiment, case.experiment)
        self.plan, self.settings = self.experiment.plan(case.problem), self.experiment.solved_with(case.solver)
        self.grid: ProblemGrid = ProblemGrid(case, [axis for axis in axes if axis.path != DISTANCE])
        dims = dims_of(axes)
        size = count(axes)
        place = dict(zip(dims, np.unravel_index(np.arange(size), tuple(dims.values())) if axes else (), strict=True))
        of_grid = [place[dim] for dim in dims_of(self.grid.axes)]
        self.numbers = np.ravel_multi_index(of_grid, self.grid.shape) if of_grid else np.zeros(size, dtype=np.int64)
        self.zc = self._distances(axes, place, size)
        self.found, self.todo = found, ~found.whole

    def _distances(self, axes: list[Axis], place: Any, size: int) -> Array:
        """Return the average distances of each case, (cases, points), in the order in which the tip comes to them."""
        for axis in axes:
            if axis.path == DISTANCE:
                return np.asarray(np.array(axis.values)[place[axis.dim]][:, None])
        order = [visit[0] if visit else 0 for visit in self.plan.visits]
        if self.plan.shares is None:
            return np.broadcast_to(self.plan.values[order], (size, len(order)))
        free = amplitude_axis(self.case, axes)
        A0 = np.array(free.values)[place[free.dim]] if free else np.full(size, self.case.problem.tones[0].A0)
        return np.asarray(np.multiply.outer(A0, self.plan.shares[order]))

    def run(self) -> bool:
        """Compute all points; return False when stopped before the end."""
        if not self.todo.any():
            return True
        load(self.grid.example)
        return self.crew.run(self._jobs())

    def _jobs(self) -> Iterable[Callable[[], None]]:
        if not self.grid.alike:
            for number in np.flatnonzero(self.todo):
                yield functools.partial(self._block, np.array([number]))
            return
        todo = np.flatnonzero(self.todo)
        batch = self.grid.batch(self.numbers[todo])
        # cases march together that have the same samples per period, and the same phases and ratios of their tones
        same = np.column_stack([self._samples(todo, batch), batch.tones[:, :, 0], batch.tones[:, :, 1]])
        _, group = np.unique(same, axis=0, return_inverse=True)
        smooth = all(not force.memory and force.switch is None for force in self.grid.example.forces)
        size = BLOCK if smooth else LEAST_BLOCK
        size = min(size, max(LEAST_BLOCK, -(-len(todo) // self.crew.workers)))
        for which in range(int(group.max()) + 1):
            members = todo[group.ravel() == which]
            for start in range(0, len(members), size):
                yield functools.partial(self._block, members[start : start + size])

    def _samples(self, todo: Any, batch: ProblemBatch) -> Any:
        """Return the samples per period of each case."""
        if has_own_samples(self.grid.example, self.settings):
            return batch.samples(self.settings)
        if self.grid.example.heights is not None:  # of a dwell the lever is that at its distance
            return np.array([sample_count(self._problem(int(case)), self.settings) for case in todo])
        numbers, place = np.unique(self.numbers[todo], return_inverse=True)
        each = [sample_count(self.grid.problem(int(number)), self.settings) for number in numbers]
        return np.array(each)[place.ravel()]

    def _problem(self, case: int) -> Problem:
        """Return the problem of a case, as a single run has it."""
        problem = self.grid.problem(int(self.numbers[case]))
        return problem.at_height(float(self.zc[case, 0])) if not self.plan.coords else problem

    def _block(self, which: Any) -> None:
        """Compute cases side by side, and again with more samples where cases need more."""
        first = self._problem(int(which[0]))
        report_done: Callable[[int], None] = self.crew.add
        with contextlib.suppress(Stopped):  # finished points are kept
            for points in sample_counts(sample_count(first, self.settings), self.settings):
                which = which[self._solve(which, points, first, report_done)]
                if not len(which):
                    break
                report_done = uncounted  # they were counted

    def _solve(self, which: Any, points: int, first: Problem, report_done: Callable[[int], None]) -> Bools:
        """Compute cases side by side with so many samples per period; return which of them need more.

        `first` is the problem of one of them.
        """
        zc = self.zc[which]
        if not self.grid.alike or self.grid.example.heights is not None:
            batch = ProblemBatch.of([self._problem(case) for case in which.tolist()])
        else:
            batch = dataclasses.replace(self.grid.batch(self.numbers[which]), example=first)

        def at(case: int, zc: float) -> tuple[Problem, float]:
            return self._problem(int(which[case])).at_height(zc), zc

        block = block_type(self.settings)(
            batch, at, self.settings, self.experiment.harmonics, points, self.crew.check_cancelled
        )
        plan = self.plan
        solver = make_protocol(
            plan.protocol, block, zc, initial_motions(block, zc[:, 0], plan.start), report_done, plan.carry
        )
        try:
            solver.run()
            assure(block, zc, solver.points)
        finally:
            with watching(never_cancelled):  # finished points are kept, with full accuracy
                assure_in_grace(block, zc, solver.points)
                block.check_cancelled = never_cancelled
                self._keep(which, solver, block, zc)
        return need_samples(solver.points, self.found.status[which])

    def _keep(self, which: Any, solver: Walk | Stepwise, block: Block, zc: Array) -> None:
        """Keep the points found, without orbits of unknown error: a continued sweep finds these again."""
        became = statuses(solver.points, block, zc)
        became[solver.points.is_orbit & np.isnan(solver.points.error)] = Status.NOT_COMPUTED
        for number, jumps in zip(which, solver.jumps, strict=True):
            self.found.jumps[number] = jumps
        found = solver.points.columns(block, zc) | motions(solver.points, block, zc)
        kept = {name: values for name, values in found.items() if name in self.kept}
        self.found.keep(which, without_failed(kept, became), became)


def load(problem: Problem) -> None:
    """Load the kernels of a problem once, before threads ask for them at the same time."""
    with _loading:
        load_kernels(problem)
