"""How an interrupted curve goes on: with the points that it has, from the state after the last of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dforce.quantities import OBSERVABLES

if TYPE_CHECKING:
    import xarray as xr

    from dforce.experiments._table import Table
    from dforce.solvers.integrator import Motion

RESTART = "restart"  # variable that holds the state after the last point of an interrupted run


def stop(data: xr.Dataset, motion: Motion) -> None:
    """Mark a result as interrupted, and keep the state after its last point."""
    data.attrs["interrupted"] = 1
    data[RESTART] = ("state", [motion.period, *motion.y, *motion.memory, *motion.latched])


def restore(table: Table, earlier: xr.Dataset, visits: list[tuple[int, ...]], fresh: Motion) -> tuple[int, Motion]:
    """Take over the points of an interrupted result; return how many there are and the state after the last.

    `fresh` is a motion of the same problem.
    """
    from dforce.results import Status
    from dforce.solvers.integrator import Motion

    table.status[...] = earlier["status"].values
    for name in earlier.data_vars:
        if name in OBSERVABLES:
            table.arrays[str(name)] = np.array(earlier[name].values)
    done = sum(table.status[place] != Status.NOT_COMPUTED for place in visits)
    period, *state = (float(value) for value in earlier[RESTART].values)
    y_end, memory_end = len(fresh.y), len(fresh.y) + len(fresh.memory)
    memory, latched = np.array(state[y_end:memory_end]), np.array(state[memory_end:])
    return done, Motion(tuple(state[:y_end]), memory, latched, int(period))
