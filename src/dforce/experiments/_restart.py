"""How interrupted branches go on: from the orbits themselves, which a result does not hold whole."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.quantities import OBSERVABLES

if TYPE_CHECKING:
    import xarray as xr

    from dforce.kernel import Array
    from dforce.solvers.continuation import Curve
    from dforce.solvers.fixed_point import Orbit, PeriodMap

RESTART = "restart"  # variable that holds what a result lacks of its orbits
UNDER_WAY = "under_way"  # its attribute, of orbits: how far the search is


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
        special, periods = str(earlier["special"].values[i]), int(earlier["repeat_periods"].values[i])
        orbit = replace(orbit, special=special, repeats=periods // period_map.common)
        found.setdefault(int(earlier["branch"].values[i]), {})[int(row[0])] = orbit
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
