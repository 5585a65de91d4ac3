"""How an interrupted run goes on: with the points that it has, from the state after the last of them.

Curves of orbits go on from the orbits themselves, which a result does not hold whole: what it lacks is kept beside it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.quantities import OBSERVABLES

if TYPE_CHECKING:
    import xarray as xr

    from dforce.experiments._table import Table
    from dforce.kernel import Array
    from dforce.solvers.continuation import Curve
    from dforce.solvers.fixed_point import Orbit, PeriodMap
    from dforce.solvers.integrator import Motion

RESTART = "restart"  # variable that holds the state after the last point of an interrupted run, or orbits
UNDER_WAY = "under_way"  # its attribute, of orbits: how far the search is


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


def stop_curves(data: xr.Dataset, curves: list[Curve], under_way: tuple[int, int]) -> None:
    """Mark curves of orbits as interrupted, and keep what they go on from.

    `under_way` is the number of the search under way, 0 before the first one, and how many curves there were before it.
    """
    data.attrs["interrupted"] = 1
    if curves:
        rows = [_row(place, orbit) for curve in curves for place, orbit in zip(curve.places, curve.points, strict=True)]
        data[RESTART] = (("point", "state"), np.array(rows))
        data[RESTART].attrs[UNDER_WAY] = np.array(under_way)


def restore_curves(earlier: xr.Dataset, period_map: PeriodMap) -> tuple[list[Curve], tuple[int, int]]:
    """Return the curves of an interrupted result, and which search was under way; see :func:`stop_curves`."""
    from dforce.solvers.continuation import Curve

    kept = earlier[RESTART]
    values = {str(name): earlier[name].values for name in earlier.data_vars if name in OBSERVABLES}
    found: dict[int, dict[int, Orbit]] = {}
    for i, row in enumerate(kept.values):
        orbit = _orbit(row[1:], period_map, {name: every[i] for name, every in values.items()})
        special = str(earlier["special"].values[i])
        found.setdefault(int(earlier["branch"].values[i]), {})[int(row[0])] = replace(orbit, special=special)
    curves = [Curve.of_places(orbits) for orbits in found.values()]
    number, before = kept.attrs[UNDER_WAY]
    return curves, (int(number), int(before))


def _parts(orbit: Orbit) -> list[Array]:
    return [orbit.u, orbit.tangent, orbit.slope, orbit.jacobian.ravel(), orbit.latched, orbit.gaps]


def _row(place: int, orbit: Orbit) -> Array:
    return np.concatenate([[place, orbit.step], *_parts(orbit)])


def _orbit(row: Array, period_map: PeriodMap, values: dict[str, Any]) -> Orbit:
    from dforce.solvers.fixed_point import Orbit

    n, integrator = period_map.size, period_map.integrator
    ends = np.cumsum([n + 1, n + 1, n, n * n, integrator.latch_count, len(integrator.kinks)])
    u, tangent, slope, jacobian, latched, gaps = np.split(row[1:], ends[:-1])
    return Orbit(u, latched, jacobian.reshape(n, n), slope, tangent, values, gaps, step=float(row[0]))
