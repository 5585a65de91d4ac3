"""The motions found for one case or for the cases of a sweep, and the Dataset that they become."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Array, Bools
from dforce.core.quantities import MOTION, OBSERVABLES, REPEATS, jumps_along
from dforce.experiments.base import CurvePlan
from dforce.procedures.motion import COMPONENT, components
from dforce.procedures.statuses import status_of, without_failed
from dforce.results.status import Status
from dforce.solvers.points import StateJump

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.solvers.transient import Steady

KEPT = frozenset(OBSERVABLES) | {MOTION, REPEATS}  # of each point
COUNTED = ("tone", "mode", "harmonic", "multiplier")  # dimensions of the observables of a point
NO_JUMP = (np.nan, np.nan, np.nan, "", np.nan)  # fills up the jumps of a case that has fewer than others


@dataclass
class Found:
    """The results found for cases with the same points.

    Attributes
    ----------
    status
        A status for each point, (cases, points), in the order in which the points are found.
    arrays
        Observables and motions by name, (cases, points, ...).
    jumps
        The jumps of each case.
    """

    status: np.ndarray[Any, np.dtype[np.int8]]
    arrays: dict[str, Array]
    jumps: list[list[StateJump]]
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    @classmethod
    def empty(cls, cases: int = 1, points: int = 1) -> Found:
        """Return room for so many points of each case."""
        status = np.full((cases, points), Status.NOT_COMPUTED, dtype=np.int8)
        return cls(status, {}, [[] for _ in range(cases)])

    @classmethod
    def of(cls, motions: Sequence[Steady], problems: Sequence[Problem]) -> Found:
        """Return motions of problems, one each, as the points of one case."""
        found = cls.empty(1, len(motions))
        for place, (one, problem) in enumerate(zip(motions, problems, strict=True)):
            became = status_of(one, problem)
            found.keep((0, place), without_failed(one.values, became), became)
        return found

    def keep(self, where: Any, columns: Mapping[str, Any], became: Any) -> None:
        """Keep the results of points at some places, from any thread."""
        outer = np.ndim(self.status[where])
        for name, column in columns.items():
            with self._lock:
                if name not in self.arrays:
                    self.arrays[name] = np.full((*self.status.shape, *np.shape(column)[outer:]), np.nan)
            self.arrays[name][where] = column
        self.status[where] = became

    @property
    def whole(self) -> Bools:
        """Whether all points of each case were computed."""
        return np.asarray((self.status != Status.NOT_COMPUTED).all(axis=1))


class Layout:
    """Where the points of cases lie in a result.

    Parameters
    ----------
    plans
        The curve of the cases of each part of a sweep: they may go over their points in another order. None where each case is
        a result by itself.
    inner
        Dimensions of each case that are known beforehand, with their coordinates.
    lengths
        Dimensions of the parameters that differ from case to case, and their lengths.
    order
        The same dimensions as the cases are numbered, part after part, the last one fastest.
    """

    def __init__(
        self,
        plans: Sequence[CurvePlan],
        inner: Mapping[str, Any],
        lengths: Mapping[str, int] | None = None,
        order: Sequence[str] = (),
    ) -> None:
        self.plan, self.inner, self.lengths = plans[0] if plans else None, dict(inner), dict(lengths or {})
        self.points = math.prod(map(len, self.inner.values()))
        self.shape = tuple(self.lengths[dim] for dim in order)
        self.parts = max(1, len(plans))
        self.cases = math.prod(self.shape) // self.parts
        self._order = [self.dims.index(dim) for dim in order]
        shape = self.points, len(self.inner)
        self._places = [tuple(np.array(plan.visits, dtype=int).reshape(shape).T) for plan in plans]

    @property
    def dims(self) -> tuple[str, ...]:
        """The dimensions of the parameters."""
        return tuple(self.lengths)

    def over_axes(self, table: Any) -> Any:
        """Return an array with a row for each part and each of its cases as one over the parameters."""
        return np.moveaxis(table.reshape((*self.shape, *table.shape[2:])), range(len(self.shape)), self._order)

    def by_case(self, array: Any) -> Any:
        """Undo :meth:`over_axes`."""
        rows = np.moveaxis(array, self._order, range(len(self.shape)))
        return rows.reshape(self.parts, self.cases, *array.shape[len(self.shape) :])

    def over_all(self, filled: list[Any], fill: Any) -> Any:
        """Return arrays of the parts, (cases, points, ...), over the parameters, the inner dimensions, and any others."""
        shapes = [array.shape[2:] for array in filled if array is not None]
        behind = tuple(map(max, zip(*shapes, strict=True)))  # some cases may have more modes, or more to remember
        out = np.full((self.parts, self.cases, *map(len, self.inner.values()), *behind), fill)
        for row, array, places in zip(out, filled, self._places, strict=True):
            if array is not None:
                own = (..., *map(slice, array.shape[2:]))
                row[own][(slice(None), *places)] = array if self.inner else array[:, 0]
        return self.over_axes(out) if self.shape else out[0, 0]

    def by_point(self, array: Any) -> Any:
        """Undo :meth:`over_all`, in a copy: (parts, cases, points, ...)."""
        rows = self.by_case(array)
        parts = zip(rows, self._places, strict=True)
        return np.stack([row[(slice(None), *places)] if self.inner else row[:, None] for row, places in parts])


def dataset(layout: Layout, parts: Sequence[Found], example: Problem) -> xr.Dataset:
    """Put the parts together in a Dataset, without words; `example` is one of the problems."""
    import xarray as xr

    assert layout.plan is not None
    dims, plan = (*layout.dims, *layout.inner), layout.plan

    def joined(name: str) -> Any:
        return layout.over_all([part.arrays.get(name) for part in parts], np.nan)

    names = dict.fromkeys(name for part in parts for name in part.arrays)
    variables = {name: ((*dims, *OBSERVABLES[name].dims), joined(name)) for name in names if name in OBSERVABLES}
    sizes = {dim: size for along, array in variables.values() for dim, size in zip(along, array.shape, strict=True)}
    coords = layout.inner | {dim: np.arange(1, sizes[dim] + 1) for dim in COUNTED if dim in sizes}
    variables["status"] = dims, layout.over_all([part.status for part in parts], np.int8(Status.NOT_COMPUTED))
    for name, table in zip(jumps_along(plan.name), _tables([part.jumps for part in parts], plan.ways), strict=False):
        variables[name] = (*layout.dims, "jump"), layout.over_axes(table)
    if len({part.arrays[MOTION].shape[2:] for part in parts if MOTION in part.arrays}) == 1:
        variables[MOTION] = (*dims, COMPONENT), joined(MOTION)  # forces of another choice may remember more
        coords |= components(example)
    if REPEATS in names:
        variables[REPEATS] = dims, joined(REPEATS)
    if not layout.inner and plan.name not in dims:
        coords[plan.name] = float(plan.values[0])
    return xr.Dataset(variables, xr.Coordinates(coords))


def tabled(states: Sequence[Mapping[str, Any] | None]) -> tuple[dict[str, Array], Bools]:
    """Return the quantities of states as columns, NaN where there is no state, and where there is one."""
    out: dict[str, Array] = {}
    for i, state in enumerate(states):
        for name, value in (state or {}).items():
            out.setdefault(name, np.full((len(states), *np.shape(value)), np.nan))[i] = value
    return out, np.array([state is not None for state in states])


def split(data: xr.Dataset, layout: Layout) -> list[Found]:
    """Return the parts of an interrupted result; the inverse of :func:`dataset`."""
    assert layout.plan is not None
    status, ways = layout.by_point(data["status"].values), layout.plan.ways
    arrays = {str(name): layout.by_point(data[name].values) for name in data.data_vars if name in KEPT}
    tables = [layout.by_case(data[name].values) for name in jumps_along(layout.plan.name) if name in data]

    def jumps(part: int, case: int) -> list[StateJump]:
        rows = zip(*(table[part, case].tolist() for table in tables), strict=True)
        noted = [row for row in rows if row[3]]  # without an error in a file of an older version
        return [StateJump(at, before, after, ways.index(way) == 1, *error) for at, before, after, way, *error in noted]

    return [
        Found(
            status[part],
            {name: array[part] for name, array in arrays.items()},
            [jumps(part, case) for case in range(layout.cases)],
        )
        for part in range(layout.parts)
    ]


def _tables(found: list[list[list[StateJump]]], ways: tuple[str, str]) -> list[Any]:
    """Return the jumps of all cases as tables (parts, cases, jumps), filled up to the most that a case has; none: nothing."""
    most = max(len(jumps) for cases in found for jumps in cases)
    rows = [
        [(jump.at, jump.before, jump.after, ways[jump.rising], jump.error) for jump in jumps]
        + [NO_JUMP] * (most - len(jumps))
        for cases in found
        for jumps in cases
    ]
    columns = ([[jump[i] for jump in row] for row in rows] for i in range(len(NO_JUMP) if most else 0))
    return [np.array(column).reshape(len(found), -1, most) for column in columns]


def with_levers(data: xr.Dataset, dim: str, problems: Sequence[Problem]) -> xr.Dataset:
    """Return a result with the lever at each of its points, one problem each, where it changes from one to the other."""
    data["resonance_frequency"] = (dim, "mode"), [[mode.f0 for mode in one.modes] for one in problems]
    data["quality_factor"] = (dim, "mode"), [[mode.Q for mode in one.modes] for one in problems]
    data["free_amplitude"] = (dim, "tone"), [np.abs(one.detected_free) for one in problems]
    return data
