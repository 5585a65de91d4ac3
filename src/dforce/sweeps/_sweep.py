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
from dforce.errors import ParameterError, nearest
from dforce.experiments import Approach, Dwell, InitialMotion
from dforce.experiments._experiment import Progress, initial_motion
from dforce.quantities import JUMPS, OBSERVABLES
from dforce.runs import watched
from dforce.solvers.crew import Crew, Stopped
from dforce.sweeps._advice import advice_on_sweep
from dforce.sweeps._axes import DISTANCE, MOST_POINTS, Axis, count, make_axes
from dforce.validity import attributes

if TYPE_CHECKING:
    import xarray as xr

    from dforce.kernel import Array
    from dforce.solvers.lot import Lot
    from dforce.solvers.orbit import Jump
    from dforce.sweeps._grid import Grid

BLOCK = 256  # cases side by side, at most; fewer where there would not be a block for each worker
LEAST_BLOCK = 8


def sweep(
    case: Case,
    over: Mapping[str, Any],
    workers: int | None = None,
    progress: Progress | bool | None = None,
    quantities: Iterable[str] | None = None,
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
        Names of the quantities to keep; left out: all.

    Returns
    -------
    xarray.Dataset
        The dimensions of the sweep first, in the order given and named by the last word of each path (the whole path where
        that is ambiguous), then `zc` and `direction` of an approach. A status for each point. The jumps of the curves lie
        along `jump`, filled up with NaN (and empty directions) where a curve has fewer than others.

    Raises
    ------
    ParameterError
        For a path that the case does not have, a value that is not allowed, or a case without such an experiment.
    """
    if not isinstance(case.experiment, Approach | Dwell):
        raise ParameterError("a sweep repeats an approach or a dwell; give the case one of them as experiment")
    axes = make_axes(case, over)
    kept = _kept(quantities)
    visits = case.experiment.visits() if isinstance(case.experiment, Approach) else [()]
    if count(axes) * len(visits) > MOST_POINTS:
        raise ParameterError(
            f"the sweep has {count(axes)} cases of {len(visits)} points; at most {MOST_POINTS} are allowed"
        )
    choices = [axis for axis in axes if axis.quantity is None]
    numbers = [axis for axis in axes if axis.quantity is not None]
    cases = [
        type(case)(**changed(case, zip((axis.path for axis in choices), values, strict=True)))
        for values in itertools.product(*(axis.values for axis in choices))
    ]
    parts, interrupted = [], False
    with watched(progress, case.title) as tell:
        crew = Crew(count(axes) * len(visits), tell, workers)
        for chosen in cases:
            part = Part(chosen, numbers, crew, kept)
            parts.append(part)
            if not interrupted:
                interrupted = not part.run()
    return _dataset(case, axes, choices, numbers, parts, interrupted)


def _kept(given: Iterable[str] | None) -> frozenset[str]:
    known = OBSERVABLES | JUMPS
    names = frozenset(known if given is None else given)
    for name in sorted(names - known.keys()):
        raise ParameterError(f"there is no quantity '{name}'{nearest(name, known)}")
    return names


class Part:
    """The cases of a sweep that differ in numbers only."""

    def __init__(self, case: Case, axes: list[Axis], crew: Crew, kept: frozenset[str]) -> None:
        from dforce.results import Status
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
        self.status = np.full(self.zc.shape, Status.NOT_COMPUTED, dtype=np.int8)
        self.arrays: dict[str, Array] = {}
        self.jumps: list[list[Jump]] = [[] for _ in range(size)]
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

        self._load_kernels()
        whole = self.crew.run(self._jobs())
        for array in self.arrays.values():
            array[self.status == Status.FAILED] = np.nan
        return whole

    def _load_kernels(self) -> None:
        """Load the kernels once, before threads ask for them at the same time."""
        from dforce.solvers.integrator import load_kernels

        load_kernels(self.grid.example)

    def _jobs(self) -> Iterable[Callable[[], None]]:
        from dforce.solvers.lot import fits
        from dforce.sweeps._grid import NOWHERE

        if not self.grid.alike or not fits(self.grid.example, self.case.solver):
            for number in range(len(self.numbers)):
                yield functools.partial(self._alone, number)
            return
        lot = self.grid.lot(self.numbers)
        # where the force jumps, orbits are lost so often that lanes gain nothing
        alone = (lot.jumps != NOWHERE).any(axis=1)
        for number in np.flatnonzero(alone).tolist():
            yield functools.partial(self._alone, number)
        samples, phase = lot.samples(self.case.solver), lot.tones[:, 0, 1]
        order = np.lexsort((phase, samples))
        order = order[~alone[order]]
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
            self.jumps[number] = found_on_the_way
        points = block.points
        for name, values in points.values(lot, self.experiment.harmonics).items():
            if name in self.kept:
                self._array(name, values.shape[2:])[which] = values
        status = np.where(points.orbit, Status.OK, Status.NOT_COMPUTED)
        for place, found in points.others.items():
            status[place] = self._outcome(found)
        self.status[which] = status

    def _alone(self, number: int) -> None:
        """Compute one case by itself."""
        from dforce.solvers.batch import walk_alone
        from dforce.solvers.find import make_finder

        approach = self.experiment if isinstance(self.experiment, Approach) else None

        def put(at: int, found: Any) -> None:
            for name, value in found.values.items():
                if name in self.kept:
                    self._array(name, np.shape(value))[number, at] = value
            self.status[number, at] = self._outcome(found)
            self.crew.add(1)

        finder = make_finder(
            self.grid.problem(int(self.numbers[number])), self.case.solver, self.experiment.harmonics
        )  # fmt: skip
        self.jumps[number] = finder.jumps  # grows on the way
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
            if name not in self.arrays:
                self.arrays[name] = np.full((*self.zc.shape, *inner), np.nan)
            return self.arrays[name]


def _dataset(
    case: Case, axes: list[Axis], choices: list[Axis], numbers: list[Axis], parts: list[Part], interrupted: bool
) -> xr.Dataset:
    """Put the parts together, and give everything its words."""
    import xarray as xr

    from dforce.results import Status, describe, provenance

    experiment = case.experiment
    inner: dict[str, Any] = {}
    visits: list[tuple[int, ...]] = [()]
    if isinstance(experiment, Approach):
        visits = experiment.visits()
        inner["zc"] = experiment.distances()
        if experiment.direction == "both":
            inner["direction"] = ["approach", "retract"]
    order = [axes.index(axis) for axis in (*choices, *numbers)]
    places = tuple(np.array(visits, dtype=int).reshape(len(visits), -1).T)

    def over_axes(table: Any) -> Any:
        """Return an array with a row for each part and each of its cases as one over the axes."""
        split = [len(axis.values) for axis in (*choices, *numbers)]
        return np.moveaxis(table.reshape(*split, *table.shape[2:]), range(len(order)), order)

    def whole(filled: list[Any], fill: Any) -> Any:
        """Return one array over the axes, the inner dimensions, and what is behind."""
        behind = next((array.shape[2:] for array in filled if array is not None), ())
        out = np.full((len(parts), len(parts[0].zc), *map(len, inner.values()), *behind), fill)
        for row, array in zip(out, filled, strict=True):
            if array is not None and inner:
                row[(slice(None), *places)] = array
            elif array is not None:
                row[:] = array[:, 0]
        return over_axes(out)

    dims = (*(axis.dim for axis in axes), *inner)
    names = {name for part in parts for name in part.arrays}
    variables: dict[str, Any] = {
        name: ((*dims, *OBSERVABLES[name].dims), whole([part.arrays.get(name) for part in parts], np.nan))
        for name in OBSERVABLES
        if name in names
    }
    variables["status"] = dims, whole([part.status for part in parts], np.int8(Status.NOT_COMPUTED))
    for name, table in _jumps([part.jumps for part in parts]).items():
        if name in parts[0].kept:
            variables[name] = (*(axis.dim for axis in axes), "jump"), over_axes(table)
    counted = {
        dim: np.arange(1, variables[name][1].shape[len(dims)] + 1)
        for name in variables.keys() & OBSERVABLES
        for dim in OBSERVABLES[name].dims
    }
    data = describe(xr.Dataset(variables, coords=inner | counted))
    if isinstance(experiment, Dwell) and all(axis.path != DISTANCE for axis in axes):
        data = describe(data.assign_coords(zc=experiment.zc))
    data = data.assign_coords({axis.dim: axis.coordinate() for axis in axes})
    data.attrs = provenance(case.to_toml(complete=True), case.title) | {"over": " ".join(axis.path for axis in axes)}
    data.attrs |= attributes(advice_on_sweep(case, axes, data))
    return data.assign_attrs(interrupted=1) if interrupted else data


def _jumps(found: list[list[list[Jump]]]) -> dict[str, Any]:
    """Return the jumps of all cases as tables (parts, cases, jumps), filled up to the most that a case has; none: nothing."""
    most = max(len(jumps) for cases in found for jumps in cases)
    tables: dict[str, Any] = {}
    for name in JUMPS if most else ():
        empty = "" if name == "jump_direction" else np.nan
        rows = [
            [getattr(jump, name.removeprefix("jump_")) for jump in jumps] + [empty] * (most - len(jumps))
            for cases in found for jumps in cases
        ]  # fmt: skip
        tables[name] = np.array(rows).reshape(len(found), -1, most)
    return tables
