"""Where a still lever snaps into contact on its way to the surface: a random distance, which depends on the speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, UnitError, checked
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.thermal._snap import at_rest, barrier_at, of_high_Q

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem

FARTHEST = 1e-6  # m from a0, beyond which no attraction is looked for
PLACES = 4000
NEAREST, WIDER = 1e-4, 1.1  # first distance from the end of the barrier, of its zc, and how the next ones grow
NEVER = 1e-300  # 1/m: a chance of 0 has no logarithm
RARE = 1e-6  # chance to have snapped in farther out, that is left out


@checked
def snap_in_distance(case: Case, speed: Any) -> xr.Dataset:
    r"""Return the distance at which a still, undriven lever snaps into contact, for a speed of approach.

    .. math:: \frac{\mathrm{d} p}{\mathrm{d} z_c} = \frac{\Gamma(z_c)}{v}\, p, \qquad
              \langle z_c \rangle = z_0 + \int_{z_0}^\infty (1 - p)\, \mathrm{d} z_c

    with the probability p of a free lever, the rate :math:`\Gamma` of :func:`snap_in_rate`, and the distance :math:`z_0` at
    which the barrier ends: there the lever snaps in without noise. The limits of the rate apply. On a fast approach the lever
    snaps in near :math:`z_0`: the result is then a rough value, and the time of the fall is neglected.

    Parameters
    ----------
    case
        Lever, medium and forces; the drive has no effect.
    speed
        Speeds of the approach (m/s, or text with a unit): one, or a list.

    Returns
    -------
    xarray.Dataset
        Over `speed` (m/s): the mean `snap_in_zc` and its standard deviation `snap_in_spread` (m); `static_snap_in_zc`, the end
        of the barrier (m). ``attrs["note"]`` is a sentence if the rate is only a bound, else empty.

    Raises
    ------
    ParameterError
        When a speed is not above 0, or the lever does not snap in or changes with its height. Also for
        ``noise.thermal = false``, and when a force has memory or branches or depends on `zc` or on time.
    """
    import xarray as xr

    speeds, problem = _speeds(speed), case.problem
    end = _end_of_the_barrier(problem)
    away, rates = _rates(problem, end, float(speeds.min()))
    bound = np.array([_moments(away, rates / v) for v in speeds])
    data = xr.Dataset(
        {
            "snap_in_zc": ("speed", end + bound[:, 0]),
            "snap_in_spread": ("speed", bound[:, 1]),
            "static_snap_in_zc": end,
        },
        {"speed": speeds},
    )
    data.attrs = of_case(case, case.to_toml()) | {"note": " ".join(of_high_Q(problem))}
    return describe(data)


def _speeds(given: object) -> Array:
    try:
        found = np.array(units.parse_all(given, "m/s"))
    except UnitError as error:
        raise UnitError(f"speed {error}") from None
    if not found.size or found.min() <= 0.0:
        raise ParameterError("speed needs speeds of the approach above 0 m/s")
    return found


def _end_of_the_barrier(problem: Problem) -> float:
    r"""Return the average distance (m) at which the rest position far from the surface ends.

    At rest at d the lever is at :math:`z_c(d) = d - F(d) / k`, which has a minimum there.
    """
    from scipy.optimize import minimize_scalar

    problem.refuse_changing_lever("the snap-in distance")
    if any("zc" in force.leading() for force in problem.forces):
        raise ParameterError("the snap-in distance needs forces of the tip distance alone, not of zc")
    force, k = at_rest(problem, 0.0), problem.modes[0].k

    def rests_from(d: float) -> float:
        return d - force(d) / k

    places = problem.a0 + np.geomspace(FARTHEST, 1e-3 * problem.a0, PLACES)
    zc = np.array([rests_from(d) for d in places])
    rising = np.flatnonzero(np.diff(zc) > 0.0)
    if not rising.size or not rising[0]:
        raise ParameterError("the lever does not snap in: it is stiffer than the attraction, or no attraction exists")
    around = (places[rising[0] + 1], places[rising[0] - 1])
    return float(minimize_scalar(rests_from, bounds=around, method="bounded", options={"xatol": 1e-15}).fun)


def _rates(problem: Problem, end: float, slowest: float) -> tuple[Array, Array]:
    """Return distances beyond the end of the barrier (m), so far that nothing happens there, and the rates there (1/s)."""
    away, rates, step = [], [], NEAREST * end
    while True:
        found = barrier_at(problem, end + step)
        if found is not None:
            away.append(step)
            rates.append(found.rate)
            if found.rate * step < RARE * slowest and len(away) > 1:  # a curve takes two
                return np.array(away), np.array(rates)
        if step > FARTHEST:
            raise ParameterError("the lever does not stay free for long at any distance; raise the speed")
        step *= WIDER


def _moments(away: Array, hazard: Array) -> tuple[float, float]:
    """Return mean and standard deviation of the distance (m) at which it happens, of so much chance for each meter."""
    from scipy.interpolate import PchipInterpolator

    x = np.concatenate([np.linspace(0.0, away[0], 50)[:-1], np.geomspace(away[0], away[-1], PLACES)])
    each = np.exp(PchipInterpolator(np.log(away), np.log(np.maximum(hazard, NEVER)))(np.log(np.maximum(x, away[0]))))
    steps = np.diff(x)
    beyond = np.append(np.cumsum((0.5 * steps * (each[1:] + each[:-1]))[::-1])[::-1], 0.0)
    gone = -np.expm1(-beyond)

    def whole(values: Array) -> float:
        return float((0.5 * steps * (values[1:] + values[:-1])).sum())

    mean = whole(gone)
    return mean, float(np.sqrt(max(2.0 * whole(x * gone) - mean**2, 0.0)))
