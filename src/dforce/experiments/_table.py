"""Collects what is found point after point into a Dataset."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.quantities import OBSERVABLES
from dforce.results import Status, describe
from dforce.solvers.transient import Row

if TYPE_CHECKING:
    import xarray as xr

    from dforce.solvers.integrator import Integrator
    from dforce.solvers.transient import Steady


def status_of(found: Steady) -> Status:
    """Return what became of a point."""
    if not found.motion.is_finite or not all(map(math.isfinite, found.values["amplitude"])):
        return Status.FAILED
    if not found.settled:
        return Status.NOT_SETTLED
    return Status.OK if found.repeats else Status.NOT_REPEATING


class Table:
    """Arrays that fill up point by point; points never filled stay NaN, with the status `NOT_COMPUTED`."""

    def __init__(self, dims: tuple[str, ...], coords: dict[str, Any], integrator: Integrator) -> None:
        self.dims, self.coords = dims, coords
        self.shape = tuple(len(coords[dim]) for dim in dims)
        self.status = np.full(self.shape, Status.NOT_COMPUTED, dtype=np.int8)
        self.arrays: dict[str, np.ndarray[Any, Any]] = {}
        self.founds: list[tuple[tuple[int, ...], Mapping[str, Any]]] = []
        modes, tones = len(integrator.problem.modes), len(integrator.problem.tones)
        self.inner = {
            "tone": tones,
            "mode": modes,
            "harmonic": integrator.harmonics if tones == 1 else 0,
            "multiplier": 2 * modes,
        }

    def put(self, place: tuple[int, ...], found: Steady) -> Status:
        """Take one point; what is not finite becomes NaN."""
        status = status_of(found)
        self.founds.append((place, found.values))
        self.status[place] = status  # last, so that Ctrl-C in between leaves the point not computed
        return status

    def _fill(self) -> None:
        """Write the points taken into the arrays, those of one stretch together."""
        stretches: dict[int, tuple[dict[str, Any], list[tuple[int, ...]], list[int]]] = {}
        for place, values in self.founds:
            if isinstance(values, Row):
                stretch, index = values.stretch, values.index
            else:
                stretch, index = {name: np.asarray(value)[None] for name, value in values.items()}, 0
            _, places, indices = stretches.setdefault(id(stretch), (stretch, [], []))
            places.append(place)
            indices.append(index)
        for stretch, places, indices in stretches.values():
            where = tuple(np.array(places, dtype=int).reshape(len(places), len(self.dims)).T)
            for name, column in stretch.items():
                array = self.arrays.setdefault(name, np.full(self.shape + column.shape[1:], np.nan))
                array[where] = column[indices] if self.dims else column[indices][0]
        failed = self.status == Status.FAILED
        if failed.any():
            for array in self.arrays.values():
                array[failed] = np.nan
        self.founds.clear()

    def dataset(self) -> xr.Dataset:
        """Return the Dataset, with units and words."""
        import xarray as xr

        self._fill()
        variables = {name: (self.dims + OBSERVABLES[name].dims, array) for name, array in self.arrays.items()}
        used = {dim for name in self.arrays for dim in OBSERVABLES[name].dims}
        counted = {dim: np.arange(1, size + 1) for dim, size in self.inner.items() if size and dim in used}
        data = xr.Dataset(variables | {"status": (self.dims, self.status)}, coords=self.coords | counted)
        return describe(data)
