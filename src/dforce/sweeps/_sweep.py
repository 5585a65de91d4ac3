"""Runs a sweep: blocks of cases over threads, progress, Ctrl-C, and the Dataset."""

from __future__ import annotations

import contextlib
import functools
import itertools
import threading
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from dforce.case import Case
from dforce.case._paths import changed
from dforce.errors import ParameterError
from dforce.experiments import Approach, Dwell, InitialMotion
from dforce.experiments._experiment import Progress, initial_motion
from dforce.runs import watched
from dforce.solvers.crew import Crew, Stopped
from dforce.sweeps._axes import DISTANCE, MOST_POINTS, Axis, count, make_axes
from dforce.sweeps._result import Found, Layout, dataset, split
from dforce.sweeps._resume import check_same, quantities_of

if TYPE_CHECKING:
    import xarray as xr

    from dforce.kernel import Array
    from dforce.solvers.lot import Lot
    from dforce.sweeps._grid import Grid

BLOCK = 256  # cases side by side, at most; fewer where there would not be a block for each worker
LEAST_BLOCK = 8


def sweep(
    case: Case,
    over: Mapping[str, Any],
    workers: int | None = None,
    progress: Progress | bool | None = None,
    quantities: Iterable[str] | None = None,
    resume: xr.Dataset | None = None,
) -> xr.Dataset:
    """Return the result of a case's experiment for all combinations of parameter values, many cases at once.

    Cases with one tone and forces without memory, branches or jumps are solved side by side in vector lanes, all others
    one by one; threads share the cases. Amplitudes, forces and distances equal those of single runs to 1e-6 of the free
    amplitude and largest force (both are orbits that miss their start by at most 1e-9 of it, and the motion's Q times that may
    lie between them), multipliers to 1e-3. Which state is reached is decided by the same rules; within the accuracy of the
    settling, a jump may come one distance earlier or later.

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
        True for a bar, or a function called as ``progress(points done, points in all, note)``; Ctrl-C keeps what is done.
    quantities
        Names of the quantities to keep; left out: all, or those of `resume`.
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
        done = all(
            Part(chosen, layout.numbers, crew, kept, found).run() for chosen, found in zip(cases, founds, strict=True)
        )
    return dataset(case, layout, founds, kept, interrupted=not done)


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

        if self.todo.any():
            self._load_kernels()
        whole = self.crew.run(self._jobs())
        empty = np.isin(self.found.status, (Status.FAILED, Status.NOT_COMPUTED))
        for array in self.found.arrays.values():
            array[empty] = np.nan
        return whole

    def _load_kernels(self) -> None:
        """Load the kernels once, before threads ask for them at the same time."""
        from dforce.solvers.integrator import load_kernels

        load_kernels(self.grid.example)

    def _jobs(self) -> Iterable[Callable[[], None]]:
        from dforce.solvers.lot import fits
        from dforce.sweeps._grid import NOWHERE

        if not self.grid.alike or not fits(self.grid.example, self.case.solver):
            for number in np.flatnonzero(self.todo).tolist():
                yield functools.partial(self._alone, number)
            return
        lot = self.grid.lot(self.numbers)
        # where the force jumps, orbits are lost so often that lanes gain nothing
        alone = (lot.jumps != NOWHERE).any(axis=1)
        for number in np.flatnonzero(alone & self.todo).tolist():
            yield functools.partial(self._alone, number)
        samples, phase = lot.samples(self.case.solver), lot.tones[:, 0, 1]
        order = np.lexsort((phase, samples))
        order = order[(self.todo & ~alone)[order]]
        same = (np.diff(samples[order]) == 0) & (np.diff(phase[order]) == 0.0)
        size = min(BLOCK, max(LEAST_BLOCK, -(-len(order) // self.crew.workers)))
        for group in np.split(order, np.flatnonzero(~same) + 1):
            for start in range(0, len(group), size):
                which = group[start : start + size]
                yield functools.partial(self._block, which, int(samples[which[0]]))

    def _block(self, which: Any, samples: int) -> None:
        """Compute cases side by side."""
        from dforce.results import Status
        from dforce.solvers.batch import Block

        lot = self.grid.lot(self.numbers[which])
        block = Block(
            lot, lambda i: self.grid.problem(int(self.numbers[which[i]])), self.case.solver, self.experiment.harmonics,
            samples, self.crew.watch,
        )  # fmt: skip
        carry = isinstance(self.experiment, Approach) and self.experiment.carry_state
        with contextlib.suppress(Stopped):  # what is done is kept
            block.walk(self._starts(lot), self.zc[which], self.crew.add, carry)
        for number, found_on_the_way in zip(which, block.jumps, strict=True):
            self.found.jumps[number] = found_on_the_way
        points = block.points
        for name, values in points.values(lot, self.experiment.harmonics).items():
            if name in self.kept:
                self._array(name, values.shape[2:])[which] = values
        status = np.where(points.orbit, Status.OK, Status.NOT_COMPUTED)
        for place, found in points.others.items():
            status[place] = self._outcome(found)
        self.found.status[which] = status

    def _alone(self, number: int) -> None:
        """Compute one case by itself."""
        from dforce.results import Status
        from dforce.solvers.batch import walk_alone
        from dforce.solvers.find import make_finder

        approach = self.experiment if isinstance(self.experiment, Approach) else None

        def put(at: int, found: Any) -> None:
            for name, value in found.values.items():
                if name in self.kept:
                    self._array(name, np.shape(value))[number, at] = value
            self.found.status[number, at] = self._outcome(found)
            self.crew.add(1)

        finder = make_finder(
            self.grid.problem(int(self.numbers[number])), self.case.solver, self.experiment.harmonics
        )  # fmt: skip
        self.found.status[number] = Status.NOT_COMPUTED  # what a stopped sweep has of this case is found anew
        self.found.jumps[number] = finder.jumps  # grows on the way
        walk_alone(
            finder, lambda integrator: initial_motion(integrator, self.experiment.start), self.zc[number],
            approach is not None and approach.carry_state, self.crew.watch, put,
        )  # fmt: skip

    @staticmethod
    def _outcome(found: Any) -> int:
        from dforce.experiments._table import status_of

        return int(status_of(found))

    def _starts(self, lot: Lot) -> Array:
        start = self.experiment.start
        if isinstance(start, InitialMotion):
            return lot.moving(lot.example.tones[0].mode, start.amplitude, start.phase)
        return lot.free() if start == "free" else np.zeros_like(lot.free())

    def _array(self, name: str, inner: tuple[int, ...]) -> Array:
        with self._lock:
            arrays = self.found.arrays
            if name not in arrays:
                arrays[name] = np.full((*self.zc.shape, *inner), np.nan)
            return arrays[name]
