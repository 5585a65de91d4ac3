"""Runs a sweep: blocks of cases over threads, progress, Ctrl-C, and the Dataset."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
import threading
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from dforce.case import Case
from dforce.case._paths import changed
from dforce.errors import ParameterError, checked
from dforce.experiments import Approach, Dwell, InitialMotion
from dforce.experiments._experiment import Progress, initial_motion
from dforce.experiments._motion import components, motions
from dforce.quantities import MOTION
from dforce.runs import watched
from dforce.solvers.crew import Crew, Stopped
from dforce.sweeps._axes import DISTANCE, MOST_POINTS, Axis, count, make_axes
from dforce.sweeps._result import Found, Layout, dataset, split, to_result
from dforce.sweeps._resume import check_same, quantities_of

if TYPE_CHECKING:
    import xarray as xr

    from dforce.kernel import Array
    from dforce.problem import Problem
    from dforce.solvers.block import Block
    from dforce.solvers.integrator import Motion
    from dforce.solvers.lot import Lot
    from dforce.sweeps._grid import Grid

BLOCK = 256  # cases side by side, at most; fewer where there would not be a block for each worker
LEAST_BLOCK = 8


@checked
def sweep(
    case: Case,
    over: Mapping[str, Any],
    workers: int | None = None,
    progress: Progress | bool | None = None,
    quantities: Iterable[str] | None = None,
    resume: xr.Dataset | None = None,
) -> xr.Dataset:
    """Return the result of a case's experiment for all combinations of parameter values, many cases at once.

    A single run is a block of one case, and a sweep solves blocks of many by the same solver: cases whose forces have no
    memory and no branches march side by side in vector lanes. Threads share the blocks.

    Parameters
    ----------
    case
        The case; its experiment is an approach or a dwell. Of a dwell only the scalars are kept.
    over
        Values by path, such as ``{"sample.youngs_modulus": ["1 GPa", "2 GPa"], "drive.A0": np.linspace(5e-9, 20e-9, 31)}``:
        SI numbers or texts with units. Any parameter of the case may be named, and ``experiment.zc`` of a dwell. Numbers of
        the instrument, the sample and the forces cost next to nothing a case; every value of any other parameter (a
        choice, a solver's setting) builds the case anew.
    workers
        Threads; left out: one for each core.
    progress
        True for a bar, or a function called as ``progress(points done, points in all, note)``; Ctrl-C and SIGTERM
        keep what is done.
    quantities
        Names of the quantities to keep; left out: all, or those of `resume`. Jumps are kept in any case.
    resume
        An interrupted result of the same case over the same values, to be continued: cases with all their points are
        kept as they are, the others are computed.

    Returns
    -------
    xarray.Dataset
        The dimensions of the sweep first, in the order given and named by the last word of each path (the whole path where
        that is ambiguous), then `zc` and `direction` of an approach. A status for each point. The jumps of the curves lie
        along `jump`, filled up with NaN (and empty directions) where a curve has fewer than others.

    Raises
    ------
    ParameterError
        For a path that the case does not have, a value that is not allowed, a case without such an experiment, or a
        `resume` that is complete or belongs to another sweep.
    """
    if not isinstance(case.experiment, Approach | Dwell):
        raise ParameterError("a sweep repeats an approach or a dwell; give the case one of them as experiment")
    axes = make_axes(case, over)
    layout = Layout(case.experiment, axes)
    points = count(axes) * len(layout.visits)
    if points > MOST_POINTS:
        raise ParameterError(
            f"the sweep has {count(axes)} cases of {len(layout.visits)} points; at most {MOST_POINTS} are allowed"
        )
    if resume is not None:
        check_same(case, layout, resume)
    kept = quantities_of(quantities, resume)
    cases = [
        type(case)(**changed(case, zip((axis.path for axis in layout.choices), values, strict=True)))
        for values in itertools.product(*(axis.values for axis in layout.choices))
    ]
    founds = (
        [Found.nothing((layout.cases, len(layout.visits))) for _ in cases] if resume is None else split(resume, layout)
    )
    with watched(progress, case.title) as tell:
        crew = Crew(points, tell, workers)
        crew.add(sum(int(found.whole.sum()) for found in founds) * len(layout.visits))
        parts = [Part(chosen, layout.numbers, crew, kept, found) for chosen, found in zip(cases, founds, strict=True)]
        done = all(part.run() for part in parts)
    data = dataset(case, layout, founds, kept, interrupted=not done)
    return data.assign_coords(components(parts[0].grid.example)) if MOTION in data else data


class Part:
    """The cases of a sweep that differ in numbers only; those that are whole in `found` are not computed again."""

    def __init__(self, case: Case, axes: list[Axis], crew: Crew, kept: frozenset[str], found: Found) -> None:
        from dforce.sweeps._grid import Grid

        self.case, self.crew, self.kept = case, crew, kept
        self.experiment = cast(Approach | Dwell, case.experiment)
        self.grid: Grid = Grid(case, [axis for axis in axes if axis.path != DISTANCE])
        self.shape = tuple(len(axis.values) for axis in axes)
        size = int(np.prod(self.shape, dtype=int))
        place = np.unravel_index(np.arange(size), self.shape) if axes else ()
        of_grid = [i for i, axis in zip(place, axes, strict=True) if axis.path != DISTANCE]
        self.numbers = np.ravel_multi_index(of_grid, self.grid.shape) if of_grid else np.zeros(size, dtype=np.int64)
        self.zc = self._distances(axes, place, size)
        self.found, self.todo = found, ~found.whole
        self._lock = threading.Lock()

    def _distances(self, axes: list[Axis], place: Any, size: int) -> Array:
        """Return the average distances of each case, (cases, points), in the order in which the tip comes to them."""
        if isinstance(self.experiment, Approach):
            order = [visit[0] for visit in self.experiment.visits()]
            return np.broadcast_to(self.experiment.distances()[order], (size, len(order)))
        for axis, i in zip(axes, place, strict=True):
            if axis.path == DISTANCE:
                return np.asarray(np.array(axis.values)[i][:, None])
        return np.full((size, 1), self.experiment.zc)

    def run(self) -> bool:
        """Compute all points; return False when stopped before the end."""
        from dforce.results import Status

        if not self.todo.any():
            return True
        self._load_kernels()
        whole = self.crew.run(self._jobs())
        empty = np.isin(self.found.status, (Status.FAILED, Status.NOT_COMPUTED, Status.UNRESOLVED))
        for array in self.found.arrays.values():
            array[empty] = np.nan
        return whole

    def _load_kernels(self) -> None:
        """Load the kernels once, before threads ask for them at the same time."""
        from dforce.solvers.integrator import load_kernels

        load_kernels(self.grid.example)

    def _jobs(self) -> Iterable[Callable[[], None]]:
        if not self.grid.alike:
            for number in np.flatnonzero(self.todo):
                yield functools.partial(self._block, np.array([number]), True)
            return
        todo = np.flatnonzero(self.todo)
        lot = self.grid.lot(self.numbers[todo])
        # cases march together that have the same samples per period, and the same phases and ratios of their tones
        same = np.column_stack([self._samples(todo, lot), lot.tones[:, :, 0], lot.tones[:, :, 1]])
        _, group = np.unique(same, axis=0, return_inverse=True)
        smooth = all(not force.memory and force.switch is None for force in self.grid.example.forces)
        size = BLOCK if smooth else LEAST_BLOCK
        size = min(size, max(LEAST_BLOCK, -(-len(todo) // self.crew.workers)))
        for which in range(int(group.max()) + 1):
            members = todo[group.ravel() == which]
            for start in range(0, len(members), size):
                yield functools.partial(self._block, members[start : start + size])

    def _samples(self, todo: Any, lot: Lot) -> Any:
        """Return the samples per period of each case."""
        from dforce.solvers.integrator import sample_count
        from dforce.solvers.lot import has_own_samples

        if has_own_samples(self.grid.example, self.case.solver):
            return lot.samples(self.case.solver)
        numbers, place = np.unique(self.numbers[todo], return_inverse=True)
        each = [sample_count(self.grid.problem(int(number)), self.case.solver) for number in numbers]
        return np.array(each)[place.ravel()]

    def _block(self, which: Any, alone: bool = False) -> None:
        """Compute cases side by side, and those that need more samples again with more."""
        from dforce.results import Status
        from dforce.solvers.integrator import sample_count
        from dforce.solvers.refine import sample_counts

        first = self.grid.problem(int(self.numbers[which[0]]))
        told = self.crew.add
        with contextlib.suppress(Stopped):  # what is done is kept
            for points, _ in sample_counts(sample_count(first, self.case.solver), self.case.solver):
                self._solve(which, alone, points, first, told)
                which = which[(self.found.status[which] == Status.UNRESOLVED).any(axis=1)]
                if not len(which):
                    break
                told = _nothing  # they are counted

    def _solve(self, which: Any, alone: bool, points: int, first: Problem, told: Callable[[int], None]) -> None:
        """Compute cases side by side with so many samples per period; `first` is the problem of one of them."""
        from dforce.experiments._table import statuses
        from dforce.solvers.block import Block
        from dforce.solvers.lot import Lot
        from dforce.solvers.protocols import make_protocol

        numbers, zc = self.numbers[which], self.zc[which]
        lot = Lot.of([first]) if alone else dataclasses.replace(self.grid.lot(numbers), example=first)

        def at(case: int, zc: float) -> tuple[Problem, float]:
            return self.grid.problem(int(numbers[case])), zc

        block = Block(lot, at, self.case.solver, self.experiment.harmonics, points, self.crew.watch)
        approach = self.experiment if isinstance(self.experiment, Approach) else None
        protocol, carry = (approach.protocol, approach.carry_state) if approach else ("quasi_static", True)
        solver = make_protocol(protocol, block, zc, self._starts(lot, block), told, carry)
        try:
            solver.run()
        finally:
            for number, jumps in zip(which, solver.jumps, strict=True):
                self.found.jumps[number] = [to_result(jump) for jump in jumps]
            found = solver.points.columns(block, zc) | motions(solver.points, block, zc)
            for name, values in found.items():
                if name in self.kept:
                    self._array(name, values.shape[2:])[which] = values
            self.found.status[which] = statuses(solver.points, block, zc)

    def _starts(self, lot: Lot, block: Block) -> list[Motion]:
        start = self.experiment.start
        if not self.grid.alike or len(lot.example.tones) > 1:
            return [initial_motion(block.integrator(case, 0.0), start) for case in range(len(lot))]
        rest = initial_motion(block.integrator(0, 0.0), "rest")
        mode = lot.example.tones[0].mode
        if isinstance(start, InitialMotion):
            rows = lot.moving(mode, start.amplitude, start.phase)
        else:
            rows = lot.free() if start == "free" else lot.moving(mode, 0.0, 0.0)
        return [dataclasses.replace(rest, y=tuple(row)) for row in rows.tolist()]

    def _array(self, name: str, inner: tuple[int, ...]) -> Array:
        with self._lock:
            arrays = self.found.arrays
            if name not in arrays:
                arrays[name] = np.full((*self.zc.shape, *inner), np.nan)
            return arrays[name]


def _nothing(points: int) -> None:
    """Count nothing."""
