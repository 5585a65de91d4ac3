"""The sum of compiled force laws over many points of a motion at once, kept on disk with the engine's code."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from dforce.core.arrays import Array
from dforce.engine.laws import Laws, call_over_points
from dforce.engine.on_disk import entry


@numba.njit(nogil=True)
def add_laws(address: Any, place: Any, zc: float, numbers: Any, d: Any, rate: Any, out: Any) -> None:
    """Add the forces (N) at distances (m) and rates (m/s) at time zero to `out`; no law has a memory or branches."""
    at_rest = np.zeros(d.shape[0])
    for f in range(address.shape[0]):
        motion = d.ctypes.data, rate.ctypes.data, at_rest.ctypes.data
        call_over_points(
            address[f, 0], (d.shape[0], *motion, 0, 0.0, zc, numbers.ctypes.data + 8 * place[f, 0], out.ctypes.data)
        )


def force_over(laws: Laws, numbers: Array, zc: float, d: Array, rate: Array) -> Array:
    """Return the force (N) at points of a motion about an average distance `zc` (m), of the shape of `d`.

    Parameters
    ----------
    laws, numbers
        Laws without memory, branches or explicit time, and their numbers one behind the other.
    d, rate
        Distances (m) and their rates of change (m/s), contiguous.
    """
    out = np.zeros(d.size)
    compiled = entry("add_laws", "the sum of force laws", ("laws", "over_points"))
    compiled(laws.address, laws.place, float(zc), numbers, d.ravel(), rate.ravel(), out)
    return out.reshape(d.shape)
