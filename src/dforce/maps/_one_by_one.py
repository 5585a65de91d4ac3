"""The cases of a sweep, each run by itself: the results of any experiment, put together along the axes.

The longest case (in states, points of branches, jumps) sets the length of a dimension. The other cases are filled up with
NaN, 0, False or empty text.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core.arrays import stacked
from dforce.core.parallel import Crew
from dforce.experiments.base import MotionExperiment
from dforce.maps._kept import ALL
from dforce.maps._part import SideBySide, load
from dforce.maps._result import SweepLayout, finished
from dforce.results.status import Status
from dforce.runs import carry_out

if TYPE_CHECKING:
    import xarray as xr

RAGGED = ("point", "state", "jump")  # dimensions along which a case may have more than others
ALWAYS = ("status", "jump_")  # beginnings of the names that are always kept


def cases_of(layout: SweepLayout) -> SideBySide | OneByOne:
    """Return the cases of a sweep, or of a block of it: side by side where that is possible, else one by one."""
    return SideBySide(layout) if layout.plan is not None else OneByOne(layout)


class OneByOne:
    """The cases of a sweep, in the order of its dimensions."""

    def __init__(self, layout: SweepLayout) -> None:
        self.layout = layout
        self.places = [
            dict(zip(layout.dims, place, strict=True))
            for place in np.ndindex(*(layout.lengths[dim] for dim in layout.dims))
        ]
        self.found: list[xr.Dataset | None] = [None] * len(self.places)

    def take(self, earlier: xr.Dataset) -> int:
        """Take over the cases that an interrupted sweep has; return the number of their points."""
        for i, place in enumerate(self.places):
            part = earlier.isel(place, drop=True)
            if (part["status"] != Status.NOT_COMPUTED).any():
                self.found[i] = part.drop_vars([axis.name for axis in self.layout.axes if axis.name in part.coords])
        return sum(one is not None for one in self.found) * self.layout.points

    def compute(self, crew: Crew, kept: frozenset[str]) -> bool:
        """Compute the cases that are missing; return False when stopped before the end."""
        missing = [i for i, one in enumerate(self.found) if one is None]
        return crew.run(functools.partial(self._compute, i, crew, kept) for i in missing)

    def _compute(self, i: int, crew: Crew, kept: frozenset[str]) -> None:
        """Carry out one case, in a thread of the crew; it counts as it goes."""
        case, told = self.layout.case_at(self.places[i]), 0

        def report_progress(done: int, total: int, note: str) -> None:
            nonlocal told
            crew.check_cancelled()
            points = self.layout.points * done // max(total, 1)
            crew.add(points - told)
            told = points

        if isinstance(case.experiment, MotionExperiment):
            load(case.problem)
        self.found[i] = self._reduced(carry_out(case, report_progress), kept)
        report_progress(1, 1, "")

    def _reduced(self, data: xr.Dataset, kept: frozenset[str]) -> xr.Dataset:
        """Return the kept results of a case. A status for each point of a ragged dimension becomes one number."""
        assert self.layout.case.experiment is not None
        data = data.drop_dims(self.layout.case.experiment.unswept, errors="ignore")
        status = data["status"]
        ragged = [dim for dim in status.dims if dim in RAGGED]
        if ragged:
            worst = status.max(ragged) if status.size else status.sum(ragged) + Status.FAILED
            data["status"] = worst.astype(np.int8).assign_attrs(status.attrs)
        names = [str(name) for name in data.data_vars]
        dropped = [name for name in names if kept != ALL and name not in kept and not name.startswith(ALWAYS)]
        axes = [axis.name for axis in self.layout.axes if axis.name in data.coords]
        return data.drop_vars([*dropped, *axes])

    def result(self, asked: Case) -> xr.Dataset:
        """Return the finished cases, with the words and the case of the sweep."""
        import xarray as xr

        cases = [one for one in self.found if one is not None]
        shape, inner = tuple(self.layout.lengths.values()), self.layout.inner
        nothing = np.full((*shape, *map(len, inner.values())), np.int8(Status.NOT_COMPUTED))
        variables: dict[str, Any] = {"status": ((*self.layout.dims, *inner), nothing)}
        coords: dict[str, Any] = dict(inner)
        differing = set()  # dimensions whose coordinates are not the same in all cases, such as other modes' motion
        for name in dict.fromkeys(str(name) for one in cases for name in one.variables):
            having = [one for one in cases if name in one.variables]
            longest = max((one.variables[name] for one in having), key=lambda variable: variable.size)
            if name in longest.dims:
                coords[name] = longest
                if not all(np.array_equal(longest.values[: one.sizes[name]], one[name].values) for one in having):
                    differing.add(name)
            elif name in having[0].coords and not longest.dims:
                coords[name] = longest
            else:
                dims, array = self._stacked(name, longest)
                target = coords if name in having[0].coords else variables
                target[name] = dims, array.reshape(*shape, *array.shape[1:]), longest.attrs
        data = xr.Dataset(variables, coords).drop_dims(differing)
        data = finished(data, asked, self.layout)
        return data.assign_attrs(along=cases[0].attrs["along"]) if cases and "along" in cases[0].attrs else data

    def _stacked(self, name: str, like: xr.Variable) -> tuple[tuple[str, ...], Any]:
        """Return a variable of all cases, (cases, ...), filled up where a case has less."""
        arrays = [
            None if one is None or name not in one.variables else one.variables[name].values for one in self.found
        ]
        return (*self.layout.dims, *map(str, like.dims)), stacked(arrays, fill(name, like.dtype))


def fill(name: str, dtype: np.dtype[Any]) -> Any:
    """Return the value of a variable where a case has none."""
    if name == "status":
        return np.int8(Status.NOT_COMPUTED)
    return {"f": np.nan, "b": False, "U": "", "O": "", "T": ""}.get(dtype.kind, 0)


def unpadded(part: xr.Dataset) -> xr.Dataset:
    """Return one case of a sweep as its experiment gives it, without the padding."""
    for dim in (dim for dim in RAGGED if dim in part.dims):
        filled = np.zeros(part.sizes[dim], dtype=bool)
        for name, one in part.variables.items():
            if dim in one.dims and name != dim:
                empty = one.isnull().values if one.dtype.kind == "f" else one.values == fill(str(name), one.dtype)
                filled |= ~empty.all(axis=tuple(i for i, other in enumerate(one.dims) if other != dim))
        part = part.isel({dim: slice(int(filled.nonzero()[0].max(initial=-1)) + 1)})
    if "point" in part.dims and not part["status"].dims:
        part = part.assign(status=part["status"].expand_dims(point=part.sizes["point"]))
    return part
