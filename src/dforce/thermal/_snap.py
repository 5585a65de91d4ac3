"""The snap of a still lever into contact by thermal motion, by Kramers' rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core import units
from dforce.core.errors import ForceError, ParameterError, UnitError, checked
from dforce.results.dataset import describe
from dforce.results.provenance import of_case

if TYPE_CHECKING:
    import xarray as xr

    from dforce.instrument import ModeNumbers
    from dforce.problem import Problem

GRID = 4000  # places between the surface and the rest position where the balance is looked at
SLOPE = 1e-4  # of the barrier's distance: step of the numerical slope
LEAST_BARRIER = 3.0  # thermal energies: below, Kramers' rate is no longer one
HIGHEST_Q = 3.0  # above, energy comes and goes too slowly for it


@checked
def snap_in_rate(case: Case, zc: Any) -> xr.Dataset:
    r"""Return the rate at which thermal motion takes a still, undriven lever across the barrier to the surface.

    .. math:: \Gamma = \frac{\lambda}{2 \pi} \sqrt{\frac{k_a}{k_b}}\, e^{-\Delta U / k_B T}, \qquad
              U(d) = \tfrac{1}{2} k (d - z_c)^2 - \int F\, \mathrm{d}d, \qquad
              \lambda = \sqrt{\frac{\gamma^2}{4} + \omega_b^2} - \frac{\gamma}{2}, \quad \gamma = \frac{\omega_0}{Q}

    with the curvatures of U at its minimum, :math:`k_a`, and on its barrier, :math:`-k_b = -m \omega_b^2`. The lever leaves the
    barrier at the rate :math:`\lambda`; with the memory of the fluid, lever and fluid leave the barrier together. The lever
    moves in its first mode under the static force. The formula is valid for barriers above 3 :math:`k_B T` and Q up to about 3;
    for higher Q the true rate is lower.

    Sources: H. A. Kramers, Physica 7, 284 (1940); with memory R. F. Grote, J. T. Hynes, J. Chem. Phys. 73, 2715 (1980).

    Parameters
    ----------
    case
        Lever, medium and forces; the drive has no effect.
    zc
        Average distance: the distance of the tip without any force (m, or text with a unit).

    Returns
    -------
    xarray.Dataset
        `barrier` (J), `switching_rate` (1/s), `barrier_distance` and `rest_distance` (m, of the tip on the barrier and at
        rest). ``attrs["note"]`` is a sentence if the rate is a rough value or only a bound, else empty.

    Raises
    ------
    ParameterError
        When the lever has no barrier at this distance, a force has memory or branches or depends on time, and for
        ``noise.thermal = false``.
    """
    import xarray as xr

    try:
        place = units.parse(zc, "m")
    except UnitError as error:
        raise UnitError(f"zc {error}") from None
    problem = case.problem
    found = barrier_at(problem, place)
    if found is None:
        raise ParameterError(
            f"at zc = {units.show(place, 'm', 4)} the lever has no barrier to the surface: it is in contact, snaps in "
            "without noise, or pulls off any contact"
        )
    low = "The barrier is below 3 kT: Kramers' rate is only a rough value there."
    notes = [low] if found.height < LEAST_BARRIER * problem.noise.kT else []
    data = xr.Dataset(
        {
            "barrier": found.height,
            "switching_rate": found.rate,
            "rest_distance": found.rest,
            "barrier_distance": found.top,
        },
        {"zc": place},
    )
    data.attrs = of_case(case, case.to_toml()) | {"note": " ".join([*notes, *of_high_Q(problem.at_height(place))])}
    return describe(data)


@dataclass(frozen=True)
class Barrier:
    """The barrier before the surface: distance of the rest position and of its top (m), height (J), rate across it (1/s)."""

    rest: float
    top: float
    height: float
    rate: float


def barrier_at(problem: Problem, zc: float) -> Barrier | None:
    """Return the barrier of a still lever at a distance (m); None where there is none.

    Raises
    ------
    ParameterError
        When there is no thermal motion, or a force has memory or branches or depends on time.
    """
    from scipy.integrate import quad
    from scipy.optimize import brentq

    kT, mode, force = problem.noise.kT, problem.at_height(zc).modes[0], at_rest(problem, zc)
    if kT <= 0.0:
        raise ParameterError("noise.thermal = false, but switching needs thermal motion")

    def net(d: float) -> float:
        return mode.k * (d - zc) - force(d)

    ways = np.linspace(zc, problem.a0, GRID)
    values = np.array([net(d) for d in ways])
    turns = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0.0)
    if len(turns) < 2 or not values[0] > 0.0:
        return None
    rest, top = (float(brentq(net, ways[i + 1], ways[i], xtol=1e-22, rtol=1e-14)) for i in turns[:2])
    height = -quad(net, top, rest, epsrel=1e-12)[0]
    step = SLOPE * (rest - top)
    well, crest = (abs(_slope(net, d, step)) for d in (rest, top))
    rate = _falls(mode, crest) * math.sqrt(well / crest) / (2.0 * math.pi) * math.exp(-height / kT)
    return Barrier(rest, top, height, rate)


def of_high_Q(problem: Problem) -> list[str]:
    """Return the note on a lever whose rate is no more than a bound, where it is one."""
    return (
        ["Q is above 3, so thermal energy comes slowly: the true rate is lower."]
        if problem.modes[0].Q > HIGHEST_Q
        else []
    )


def at_rest(problem: Problem, zc: float) -> Callable[[float], float]:
    """Return the force (N) on a tip that does not move, at an average distance (m).

    The function raises ForceError where a law has no finite value.
    """
    forces = problem.forces
    for force in forces:
        if force.memory or force.switch is not None or force.timed:
            why = "depends on time" if force.timed else "has memory or two branches"
            raise ParameterError(f"{force.name} {why}, so the energy is not a function of distance")
    laws = [(force.plain_law(), (zc,) if "zc" in force.leading() else (), force.values()) for force in forces]

    def total(d: float) -> float:
        found = sum(law(d, 0.0, 0.0, *place, *values) for law, place, values in laws)
        if not math.isfinite(found):
            names = ", ".join(force.name for force in forces)
            raise ForceError(
                f"the law of {names} gives no finite number at d = {units.show(d, 'm', 3)}; make it finite there"
            )
        return found

    return total


def _falls(mode: ModeNumbers, crest: float) -> float:
    """Return the rate (1/s) at which a mode falls off a barrier of a curvature (N/m): the root where the forces balance."""
    from scipy.optimize import brentq

    def left(rate: float) -> float:
        return float(complex(mode.stiffness(rate / (2j * math.pi))).real) - mode.k - crest

    undamped = 2.0 * math.pi * mode.oscillator[0] * math.sqrt(crest / mode.k)
    return float(brentq(left, 0.0, undamped, xtol=1e-13 * undamped, rtol=1e-13))


def _slope(function: Callable[[float], float], x: float, h: float) -> float:
    """Return a derivative by differences of fourth order."""
    return (8.0 * (function(x + h) - function(x - h)) - function(x + 2.0 * h) + function(x - 2.0 * h)) / (12.0 * h)
