"""Collects what is found point after point into a Dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.results import Status, describe

if TYPE_CHECKING:
    import xarray as xr

    from dforce.solvers.integrator import Integrator
    from dforce.solvers.transient import Steady


def status_of(found: Steady) -> Status:
    """Return what became of a point."""
    if not found.motion.is_finite or not np.isfinite(found.values["amplitude"]).all():
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
        modes, tones = len(integrator.problem.modes), len(integrator.problem.tones)
        self.inner = {"tone": tones, "mode": modes, "harmonic": integrator.harmonics if tones == 1 else 0}

    def put(self, place: tuple[int, ...], found: Steady) -> Status:
        """Store one point; what is not finite becomes NaN."""
        status = status_of(found)
        for name, value in found.values.items():
            array = self.arrays.setdefault(name, np.full(self.shape + np.shape(value), np.nan))
            array[place] = value if status is not Status.FAILED else np.nan
        self.status[place] = status  # last, so that Ctrl-C in between leaves the point not computed
        return status

    def dataset(self) -> xr.Dataset:
        """Return the Dataset, with units and words."""
        import xarray as xr

        from dforce.quantities import OBSERVABLES

        variables = {name: (self.dims + OBSERVABLES[name].dims, array) for name, array in self.arrays.items()}
        counted = {dim: np.arange(1, size + 1) for dim, size in self.inner.items() if size}
        data = xr.Dataset(variables | {"status": (self.dims, self.status)}, coords=self.coords | counted)
        return describe(data)
