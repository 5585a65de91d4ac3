"""Collects what is found point after point into a Dataset."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.quantities import OBSERVABLES
from dforce.results import Status, describe

if TYPE_CHECKING:
    import xarray as xr

    from dforce.solvers.integrator import Integrator
    from dforce.solvers.orbit import Orbits
    from dforce.solvers.transient import Steady


def statuses(found: Steady | Orbits) -> np.ndarray[Any, np.dtype[np.int8]]:
    """Return what became of each point of those that were found together."""
    became = (Status.OK if found.repeats else Status.NOT_REPEATING) if found.settled else Status.NOT_SETTLED
    finite = np.isfinite(found.columns["amplitude"]).all(axis=1) & found.motion.is_finite
    return np.where(finite, became, Status.FAILED).astype(np.int8)


def status_of(found: Steady) -> Status:
    """Return what became of a point."""
    return tuple(Status)[int(statuses(found)[0])]


class Table:
    """Arrays that fill up point by point; points never filled stay NaN, with the status `NOT_COMPUTED`."""

    def __init__(self, dims: tuple[str, ...], coords: dict[str, Any], integrator: Integrator) -> None:
        self.dims, self.coords = dims, coords
        self.shape = tuple(len(coords[dim]) for dim in dims)
        self.status = np.full(self.shape, Status.NOT_COMPUTED, dtype=np.int8)
        self.arrays: dict[str, np.ndarray[Any, Any]] = {}
        self._waiting: list[tuple[Sequence[tuple[int, ...]], Steady | Orbits]] = []
        modes, tones = len(integrator.problem.modes), len(integrator.problem.tones)
        self.inner = {
            "tone": tones,
            "mode": modes,
            "harmonic": integrator.harmonics if tones == 1 else 0,
            "multiplier": 2 * modes,
        }

    def put(self, places: Sequence[tuple[int, ...]], found: Steady | Orbits) -> None:
        """Take the points found, one for each place."""
        self._waiting.append((places, found))

    def write(self) -> None:
        """Write what was put: orbits all at once, as most of the time goes into a small call for each quantity."""
        from dforce.solvers.orbit import Orbits, joined

        waiting, self._waiting = self._waiting, []
        stretches = [(places, found) for places, found in waiting if isinstance(found, Orbits)]
        if stretches:
            self._write([place for places, _ in stretches for place in places], joined(*(o for _, o in stretches)))
        for places, found in waiting:
            if not isinstance(found, Orbits):
                self._write(places, found)

    def _write(self, places: Sequence[tuple[int, ...]], found: Steady | Orbits) -> None:
        """Write points, one for each place; what is not finite becomes NaN."""
        became = statuses(found)
        failed = became == Status.FAILED
        where = tuple(np.array(places, dtype=int).reshape(len(places), len(self.dims)).T)
        for name, column in found.columns.items():
            if failed.any():
                column = column.astype(float)
                column[failed] = np.nan
            if name not in self.arrays:
                self.arrays[name] = np.full(self.shape + column.shape[1:], np.nan)
            self.arrays[name][where] = column if self.dims else column[0]
        self.status[where] = became if self.dims else became[0]

    def dataset(self, others: Mapping[str, Any] | None = None) -> xr.Dataset:
        """Return the Dataset, with units and words; `others` are variables that go with it."""
        import xarray as xr

        self.write()
        variables = {name: (self.dims + OBSERVABLES[name].dims, array) for name, array in self.arrays.items()}
        used = {dim for name in self.arrays for dim in OBSERVABLES[name].dims}
        counted = tuple((dim, size) for dim, size in self.inner.items() if size and dim in used)
        coords = _counted(counted).merge(xr.Coordinates(self.coords)).coords
        data = xr.Dataset(variables | {"status": (self.dims, self.status)} | dict(others or {}), coords=coords)
        return describe(data)


@functools.lru_cache(maxsize=64)  # making indexes takes longer than solving ten points
def _counted(sizes: tuple[tuple[str, int], ...]) -> xr.Coordinates:
    """Return coordinates that count from 1."""
    import xarray as xr

    return xr.Coordinates({dim: np.arange(1, size + 1) for dim, size in sizes})
