"""Collects what is found point after point into a Dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import AnyArray, Array
from dforce.core.quantities import OBSERVABLES
from dforce.kernel import size_of
from dforce.observables.averaging import weights
from dforce.observables.misfit import GROSS, is_wrong, misfit_of_rows
from dforce.results.status import Status, graded

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.solvers.block import Block
    from dforce.solvers.points import Points
    from dforce.solvers.transient import Steady


def status_of(found: Steady, problem: Problem) -> Status:
    """Return what became of a point of a problem."""
    if not (np.isfinite(found.values["amplitude"]).all() and found.motion.is_finite):
        return Status.FAILED
    # an orbit of several common periods holds the balance as well
    is_orbit = found.repeats or "multiplier_modulus" in found.values
    columns = {name: np.asarray(value)[None] for name, value in found.values.items()}
    if is_wrong(problem, columns, found.settled, is_orbit)[0]:
        return Status.UNRESOLVED
    if not found.settled:
        return Status.NOT_SETTLED
    if not found.repeats:
        return Status.NOT_REPEATING
    if "error_estimate" not in found.values:
        return Status.OK
    (grade,) = graded(np.atleast_1d(found.values["error_estimate"]), found.accuracy).tolist()
    return next(status for status in Status if status == grade)


def statuses(points: Points, block: Block, values: Array) -> np.ndarray[Any, np.dtype[np.int8]]:
    """Return what became of each point of a block, found at values of its parameter (problems, values)."""
    became = np.full(points.cycles.shape, Status.NOT_COMPUTED, dtype=np.int8)
    is_orbit = points.is_orbit
    if is_orbit.any():  # from the rows: making all observables twice takes long
        numbers, tones = (table[is_orbit.ravel()] for table in block.tables(values))
        even = weights(block.frequencies, block.common)
        good = misfit_of_rows(block.batch.example, points.rows[is_orbit], even, numbers, tones) <= GROSS
        became[is_orbit] = np.where(good, graded(points.error[is_orbit], block.settings.accuracy), Status.UNRESOLVED)
    for (case, place), found in points.others.items():
        became[case, place] = status_of(found, block.problem(case, float(values[case, place]))[0])
    return became


class Table:
    """Arrays that fill up point by point; points never filled stay NaN, with the status `NOT_COMPUTED`."""

    def __init__(self, dims: tuple[str, ...], coords: dict[str, Any], problem: Problem, harmonics: int) -> None:
        self.dims, self.coords = dims, coords
        self.shape = tuple(len(coords[dim]) for dim in dims)
        self.status = np.full(self.shape, Status.NOT_COMPUTED, dtype=np.int8)
        self.arrays: dict[str, AnyArray] = {}

        modes, tones = len(problem.modes), len(problem.tones)
        self.inner = {
            "tone": tones,
            "mode": modes,
            "harmonic": harmonics if tones == 1 else 0,
            "multiplier": size_of(problem),
        }

    def put(self, place: tuple[int, ...], found: Steady, problem: Problem) -> None:
        """Take a point, a motion of the problem."""
        columns = {name: np.asarray(value)[None] for name, value in found.values.items()}
        self._write([place], columns, [status_of(found, problem)])

    def put_points(
        self,
        places: Sequence[tuple[int, ...]],
        points: Points,
        became: AnyArray,
        which: slice,
        block: Block,
        values: Array,
    ) -> None:
        """Take some of the points of a block of one problem, found at values of its parameter, one for each place.

        `became` holds the status of each.
        """
        if not len(places):
            return
        columns = {name: column[0, which] for name, column in points.columns(block, values[None]).items()}
        if block.settings.accuracy is not None:  # a run that was stopped knows the errors of its last points not yet
            unknown = (points.is_orbit & np.isnan(points.error))[0, which]
            became = np.where(unknown & (became == Status.OK), Status.INACCURATE, became)
        self._write(places, columns, became)

    def take_over(self, earlier: xr.Dataset, places: Sequence[tuple[int, ...]]) -> None:
        """Take over points of an earlier result."""
        where = tuple(np.array(places, dtype=int).T)
        self.status[where] = earlier["status"].values[where]
        for name in earlier.data_vars:
            if name in OBSERVABLES:
                column = earlier[name].values
                self.arrays[str(name)] = np.full(column.shape, np.nan)
                self.arrays[str(name)][where] = column[where]

    def _write(self, places: Sequence[tuple[int, ...]], columns: Mapping[str, Any], became: Any) -> None:
        """Write points, one for each place; of those that mean nothing no number is kept."""
        became = np.asarray(became)
        failed = (became == Status.FAILED) | (became == Status.UNRESOLVED)
        where = tuple(np.array(places, dtype=int).reshape(len(places), len(self.dims)).T)
        for name, column in columns.items():
            if failed.any():
                column = column.astype(float)
                column[failed] = np.nan
            if name not in self.arrays:
                self.arrays[name] = np.full(self.shape + column.shape[1:], np.nan)
            self.arrays[name][where] = column if self.dims else column[0]
        self.status[where] = became if self.dims else became[0]

    def dataset(self, others: Mapping[str, Any] | None = None, coords: Mapping[str, Any] | None = None) -> xr.Dataset:
        """Return the Dataset, without words; `others` are variables that go with it, `coords` coordinates."""
        import xarray as xr

        variables = {name: (self.dims + OBSERVABLES[name].dims, array) for name, array in self.arrays.items()}
        used = {dim for name in self.arrays for dim in OBSERVABLES[name].dims}
        counted = {dim: np.arange(1, size + 1) for dim, size in self.inner.items() if size and dim in used}
        return xr.Dataset(
            variables | {"status": (self.dims, self.status)} | dict(others or {}),
            coords=xr.Coordinates(self.coords | counted | dict(coords or {})),
        )


def with_levers(data: xr.Dataset, dim: str, problems: Sequence[Problem]) -> xr.Dataset:
    """Return a result with the lever at each of its points, one problem each, where it changes from one to the other."""
    data["resonance_frequency"] = (dim, "mode"), [[mode.f0 for mode in one.modes] for one in problems]
    data["quality_factor"] = (dim, "mode"), [[mode.Q for mode in one.modes] for one in problems]
    data["free_amplitude"] = (dim, "tone"), [np.abs(one.detected_free) for one in problems]
    return data
