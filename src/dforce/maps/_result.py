"""The Dataset of a sweep: put together from what was found for its cases, and taken apart again to be continued."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core.arrays import Array, Bools
from dforce.core.quantities import MOTION, OBSERVABLES, REPEATS, jumps_along
from dforce.experiments.approach import WAYS
from dforce.experiments.base import DISTANCE, CurveExperiment, CurvePlan
from dforce.maps.axes import Axis, amplitude_axis, dims_of
from dforce.procedures.motion import COMPONENT, components
from dforce.results.dataset import describe
from dforce.results.provenance import provenance
from dforce.results.status import Status
from dforce.solvers.points import StateJump

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem

RATIO = "zc_ratio"  # dimension of distances that are shares of an amplitude which varies
JUMPS = jumps_along("zc")
NO_JUMP = (np.nan, np.nan, np.nan, "")  # fills up the jumps of a case that has fewer than others
KEPT = frozenset(OBSERVABLES) | {MOTION, REPEATS}  # of each point
QUANTITIES = "quantities"  # attribute of an interrupted sweep: the names of those that are kept


@dataclass
class Found:
    """What was found for cases that differ in numbers only.

    Attributes
    ----------
    status
        A status for each point, (cases, points), in the order in which the tip comes to them.
    arrays
        Observables by name, (cases, points, ...).
    jumps
        The jumps of each case.
    """

    status: np.ndarray[Any, np.dtype[np.int8]]
    arrays: dict[str, Array]
    jumps: list[list[StateJump]]

    @classmethod
    def of(cls, layout: Layout) -> list[Found]:
        """Return room for each part of a sweep."""
        status = np.full((layout.parts, layout.cases, layout.points), Status.NOT_COMPUTED, dtype=np.int8)
        return [cls(of_part, {}, [[] for _ in of_part]) for of_part in status]

    @property
    def whole(self) -> Bools:
        """Whether all points of each case were computed."""
        return np.asarray((self.status != Status.NOT_COMPUTED).all(axis=1))


class Layout:
    """Where the cases of a sweep, and the points of each of them, lie in its result.

    A part is all cases with the same choices; inside it the cases are those of the numbers, the last one fastest.

    Attributes
    ----------
    plan
        The curve that each case is, where curves along the distance are solved side by side; None: each case by itself.
    inner
        Dimensions of each case that are known beforehand, with their coordinates.
    points
        Number of points of each case.
    """

    def __init__(self, case: Case, axes: list[Axis]) -> None:
        experiment, problem = case.experiment, case.problem
        assert experiment is not None
        plan = experiment.plan(problem) if isinstance(experiment, CurveExperiment) else None
        self.jumps = jumps_along(plan.name) if plan is not None and plan.coords else []
        self.plan: CurvePlan | None = plan if plan is not None and plan.zc is None else None
        self.axes, self.lengths = axes, dims_of(axes)
        self.choices = [axis for axis in axes if axis.quantity is None]
        self.numbers = [axis for axis in axes if axis.quantity is not None]
        self.inner = experiment.coordinates(problem)
        shares = None if plan is None else plan.shares
        # the axis of the amplitude of which the distances are shares
        self.free = None if shares is None else amplitude_axis(case, axes)
        if self.free is not None:
            self.inner = {RATIO if dim == "zc" else dim: values for dim, values in self.inner.items()}
            self.inner[RATIO] = shares
        self.points = math.prod(map(len, self.inner.values()))
        lengths = dims_of((*self.choices, *self.numbers))
        self.shape = tuple(lengths.values())
        self.parts, self.cases = math.prod(self.shape[: len(self.choices)]), math.prod(self.shape[len(self.choices) :])
        self._order = [self.dims.index(dim) for dim in lengths]
        if self.plan is not None:
            self._places = tuple(np.array(self.plan.visits, dtype=int).reshape(self.points, -1).T)

    @property
    def dims(self) -> tuple[str, ...]:
        """The dimensions of the parameters."""
        return tuple(self.lengths)

    @property
    def distances(self) -> tuple[tuple[str, str], Any] | None:
        """The coordinate `zc` of distances that are shares of an amplitude which varies: dimensions and values (m)."""
        if self.free is None:
            return None
        return (self.free.dim, RATIO), np.multiply.outer(np.array(self.free.values), self.inner[RATIO])

    def over_axes(self, table: Any) -> Any:
        """Return an array with a row for each part and each of its cases as one over the axes."""
        return np.moveaxis(table.reshape(*self.shape, *table.shape[2:]), range(len(self.shape)), self._order)

    def by_case(self, array: Any) -> Any:
        """Undo :meth:`over_axes`."""
        rows = np.moveaxis(array, self._order, range(len(self.shape)))
        return rows.reshape(self.parts, self.cases, *array.shape[len(self.shape) :])

    def over_all(self, filled: list[Any], fill: Any) -> Any:
        """Return arrays of the parts, (cases, points, ...), as one over the axes, the inner dimensions, and what is behind."""
        shapes = [array.shape[2:] for array in filled if array is not None]
        behind = tuple(map(max, zip(*shapes, strict=True)))  # some cases may have more modes, or more to remember
        out = np.full((self.parts, self.cases, *map(len, self.inner.values()), *behind), fill)
        for row, array in zip(out, filled, strict=True):
            if array is None:
                continue
            own = (..., *map(slice, array.shape[2:]))
            if self.inner:
                row[own][(slice(None), *self._places)] = array
            else:
                row[own] = array[:, 0]
        return self.over_axes(out)

    def by_point(self, array: Any) -> Any:
        """Undo :meth:`over_all`, in a copy: (parts, cases, points, ...)."""
        rows = self.by_case(array)
        return rows[(slice(None), slice(None), *self._places)] if self.inner else rows[:, :, None].copy()


def table(case: Case, layout: Layout, parts: list[Found], example: Problem) -> xr.Dataset:
    """Put the parts together, and give everything its words; `example` is one of the problems."""
    import xarray as xr

    assert layout.plan is not None
    dims = (*layout.dims, *layout.inner)
    names = {name for part in parts for name in part.arrays}
    variables: dict[str, Any] = {
        name: ((*dims, *OBSERVABLES[name].dims), layout.over_all([part.arrays.get(name) for part in parts], np.nan))
        for name in OBSERVABLES
        if name in names
    }
    counts = {part.arrays[MOTION].shape[2:] for part in parts if MOTION in part.arrays}
    for name, behind in ((MOTION, (COMPONENT,)), (REPEATS, ())):
        if name in names and (name != MOTION or len(counts) == 1):  # forces of another choice may remember more
            variables[name] = (*dims, *behind), layout.over_all([part.arrays.get(name) for part in parts], np.nan)
    variables["status"] = dims, layout.over_all([part.status for part in parts], np.int8(Status.NOT_COMPUTED))
    for name, table in _tables([part.jumps for part in parts]).items():
        variables[name] = (*layout.dims, "jump"), layout.over_axes(table)
    counted = {
        dim: np.arange(1, variables[name][1].shape[len(dims)] + 1)
        for name in variables.keys() & OBSERVABLES
        for dim in OBSERVABLES[name].dims
    }
    data = xr.Dataset(variables, coords=layout.inner | counted)
    if not layout.inner and all(axis.path != DISTANCE for axis in layout.axes):
        data = data.assign_coords(zc=float(layout.plan.values[0]))
    if layout.distances is not None:
        data = data.assign_coords(zc=layout.distances).assign_attrs(along=RATIO)
    data = finished(data, case, layout)
    return data.assign_coords(components(example)) if MOTION in data else data


def finished(data: xr.Dataset, case: Case, layout: Layout) -> xr.Dataset:
    """Give a sweep its axes, its words and its provenance."""
    data = describe(data).assign_coords({axis.name: axis.coordinate() for axis in layout.axes})
    over = {"over": " ".join(axis.path for axis in layout.axes)}
    data.attrs = provenance(case.to_toml(complete=True), case.title) | over | data.attrs
    return data


def unfinished(kept: frozenset[str]) -> dict[str, Any]:
    """Return the attributes by which a sweep that is not complete goes on."""
    return {"interrupted": 1, QUANTITIES: " ".join(sorted(kept))}


def split(data: xr.Dataset, layout: Layout) -> list[Found]:
    """Return what an interrupted sweep has of each part."""
    status = layout.by_point(data["status"].values)
    arrays = {str(name): layout.by_point(data[name].values) for name in data.data_vars if name in KEPT}
    tables = {str(name): layout.by_case(data[name].values) for name in data.data_vars if name in JUMPS}
    return [
        Found(
            status[part],
            {name: array[part] for name, array in arrays.items()},
            [_jumps({name: table[part, case] for name, table in tables.items()}) for case in range(status.shape[1])],
        )
        for part in range(len(status))
    ]


def _tables(found: list[list[list[StateJump]]]) -> dict[str, Any]:
    """Return the jumps of all cases as tables (parts, cases, jumps), filled up to the most that a case has; none: nothing."""
    most = max(len(jumps) for cases in found for jumps in cases)
    rows = [
        [(jump.at, jump.before, jump.after, WAYS[jump.rising]) for jump in jumps] + [NO_JUMP] * (most - len(jumps))
        for cases in found
        for jumps in cases
    ]
    columns = ([[jump[i] for jump in row] for row in rows] for i in range(len(JUMPS) if most else 0))
    return {name: np.array(column).reshape(len(found), -1, most) for name, column in zip(JUMPS, columns, strict=False)}


def _jumps(columns: dict[str, Any]) -> list[StateJump]:
    """Return the jumps of one case from its row in the tables."""
    rows = zip(*(columns[name].tolist() for name in JUMPS if columns), strict=True)
    return [StateJump(at, before, after, WAYS.index(way) == 1) for at, before, after, way in rows if way]
