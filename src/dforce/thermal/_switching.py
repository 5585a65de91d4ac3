"""How often thermal motion takes a state of a driven lever to another one, by simulation."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core import units
from dforce.core.errors import ParameterError, UnitError, checked
from dforce.instrument.noise import BOLTZMANN
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.runs import watched
from dforce.solvers.integrator import RK4, Motion
from dforce.thermal._lanes import CHUNK, langevin, settling_periods, start_of
from dforce.validity import Evidence, attributes
from dforce.validity.noise import thermal_switching

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case
    from dforce.experiments.base import Progress
    from dforce.problem import Problem

ARRIVED = 0.25  # of the way between both states: a motion so near to the other one has switched
LEAST = 10  # events that a rate takes
CONFIDENCE = 0.95


@dataclasses.dataclass(frozen=True)
class Count:
    """Switches seen, and the time (s) in which they could have happened."""

    events: int
    watched: float

    def rate(self) -> float:
        """Return the rate (1/s); NaN from fewer than ten events."""
        return self.events / self.watched if self.events >= LEAST else math.nan

    def interval(self) -> tuple[float, float]:
        """Return the exact interval of the rate of a Poisson process (1/s), of 95 % confidence."""
        from scipy.stats import chi2

        aside = 0.5 * (1.0 - CONFIDENCE)
        low = chi2.ppf(aside, 2 * self.events) if self.events else 0.0
        return low / (2.0 * self.watched), chi2.ppf(1.0 - aside, 2 * self.events + 2) / (2.0 * self.watched)


@checked
def switching_rate(
    state: xr.Dataset,
    other: xr.Dataset,
    lanes: int = 200,
    periods: int = 5000,
    temperature: Any = None,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    r"""Return the rate at which thermal motion switches a steady state to another, counted in simulations.

    Each simulation (lane) starts in the state. It ends when its amplitude and phase come to within a quarter of the way from
    the other state, or when the time is over. Switches during the settling of the noise are not counted. The rate of N
    switches in a time t is N / t, with the confidence interval of a Poisson count; t is the sum over all lanes before their
    switch.

    Parameters
    ----------
    state, other
        One point each of results at the same distance, such as ``curve.sel(zc=..., direction="approach")`` and
        ``direction="retract"``.
    lanes
        Number of simulations, with seeds from `noise.seed` of the case on.
    periods
        Largest number of periods of the first tone for each lane.
    temperature
        Temperatures (K): one, or a list; default: the temperature of the medium. At higher temperatures the state switches more
        often. From these rates you can extrapolate a rate that is too low to be counted.
    progress
        See :func:`run`.

    Returns
    -------
    xarray.Dataset
        Over `temperature`: `switching_rate` (1/s), NaN from fewer than 10 switches, `switching_rate_low` and
        `switching_rate_high` (95 % confidence), `switches` and `watched_time` (s). With two or more rates: `barrier` (J), by
        :math:`\ln \Gamma = \mathrm{const} - \Delta U / k_B T`.

    Raises
    ------
    ParameterError
        When both points are the same state or lie at different distances, and when all lanes switch during the settling.
    ResultError
        When a result is not one point with a motion.
    """
    import xarray as xr

    case, problem, zc, start = start_of(state, None)
    _, _, there, goal = start_of(other, None)
    if abs(there - zc) > 1e-9 * problem.tones[0].A0 + 1e-15:
        raise ParameterError(
            f"the states lie at zc = {units.show(zc, 'm', 5)} and {units.show(there, 'm', 5)}; choose two at one distance"
        )
    if lanes < 1 or periods < 1:
        raise ParameterError("a rate needs at least one lane and one period")
    given = _temperatures(problem, temperature)
    counts = []
    with watched(progress, f"switching: {case.title}") as report_progress:
        for number, kelvin in enumerate(given):
            warm = dataclasses.replace(problem, noise=dataclasses.replace(problem.noise, temperature=kelvin))

            def report_run(done: int, total: int, number: int = number) -> None:
                report_progress(number * total + done, len(given) * total, "periods")

            counts.append(_count(case, warm, zc, start, goal, lanes, periods, report_run))
        report_progress(1, 1, "")
    low, high = zip(*(count.interval() for count in counts), strict=True)
    data = xr.Dataset(
        {
            "switching_rate": ("temperature", [count.rate() for count in counts]),
            "switching_rate_low": ("temperature", list(low)),
            "switching_rate_high": ("temperature", list(high)),
            "switches": ("temperature", [count.events for count in counts]),
            "watched_time": ("temperature", [count.watched for count in counts]),
        },
        {"temperature": given, "zc": zc},
    )
    barrier = _barrier(given, counts)
    if barrier is not None:
        data["barrier"] = barrier
    few = [units.show(kelvin, "K", 4) for kelvin, count in zip(given, counts, strict=True) if count.events < LEAST]
    note = f"Fewer than {LEAST} switches at {', '.join(few)}: no rate, only an upper limit." if few else ""
    data.attrs = of_case(case) | {"note": note}
    often = thermal_switching(Evidence(case, data))
    data.attrs |= attributes([] if often is None else [often])
    return describe(data)


def _temperatures(problem: Problem, given: object) -> list[float]:
    try:
        found = units.parse_all(problem.noise.temperature if given is None else given, "K")
    except UnitError as error:
        raise UnitError(f"temperature {error}") from None
    if not found or min(found) <= 0.0:
        raise ParameterError("temperature is a list of temperatures above 0 K")
    return found


def _count(
    case: Case, problem: Problem, zc: float, start: Motion, goal: Motion, lanes: int, periods: int, report_run: Any
) -> Count:
    """Return how many of the lanes switch, and for how long all of them were at risk."""
    quiet = RK4(problem, case.solver.replace(method="transient", integrator="rk4"), 1)
    quiet.place(zc)
    own, far = (quiet.lock_in(motion, 1)[1][0] for motion in (start, goal))
    way = np.linalg.norm(far - own)
    if not way > 0.01:
        raise ParameterError("both points are the same state; choose two different states")
    integrator = langevin(case, problem, zc)
    seed = problem.noise.seed
    running = integrator.lanes([start] * lanes, range(seed, seed + lanes))
    wait, done, events, at_risk = settling_periods(problem, None), 0, 0, 0
    while done < wait + periods and len(running.y):
        report_run(done, wait + periods)
        count = min(CHUNK, wait - done if done < wait else wait + periods - done)
        running, c = integrator.run(running, count)
        arrived = np.linalg.norm(c - far, axis=-1) < ARRIVED * way
        switched = arrived.any(axis=1)
        if done >= wait:
            events += int(switched.sum())
            at_risk += int(np.where(switched, arrived.argmax(axis=1) + 1, count).sum())
        running = running.part(np.flatnonzero(~switched))
        done += count
    if at_risk == 0:
        raise ParameterError("all lanes switched while the noise settled; this state does not last at this temperature")
    return Count(events, at_risk / problem.tones[0].frequency)


def _barrier(temperatures: Sequence[float], counts: list[Count]) -> float | None:
    """Return the energy (J) by which the rates go with temperature; None from fewer than two rates."""
    known = [(kelvin, count) for kelvin, count in zip(temperatures, counts, strict=True) if count.events >= LEAST]
    if len({kelvin for kelvin, _ in known}) < 2:
        return None
    inverse = np.array([1.0 / (BOLTZMANN * kelvin) for kelvin, _ in known])
    logs = np.log([count.rate() for _, count in known])
    weights = np.sqrt([count.events for _, count in known])  # ln of a count of N is known to 1 / sqrt(N)
    return -float(np.polyfit(inverse / inverse.mean(), logs, 1, w=weights)[0] / inverse.mean())
