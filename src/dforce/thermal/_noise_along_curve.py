"""The noise of amplitude and phase along a curve, from the tangent of its motions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case, case_of
from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, ResultError, UnitError, checked
from dforce.core.quantities import MOTION, REPEATS
from dforce.core.stopping import heard
from dforce.experiments.base import Progress
from dforce.observables.averaging import common_period
from dforce.procedures.motion import motion_of
from dforce.procedures.varied import problem_at
from dforce.results.dataset import describe
from dforce.results.status import REPEATING
from dforce.runs import watched
from dforce.solvers.integrator import RK4
from dforce.solvers.linear_noise import linear_noise
from dforce.validity import advice, attributes

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem

MULTIPLIERS = "multiplier_modulus"
MOST_NUMBERS = 200  # of motion and memory together: of more, the map of a step takes longer than a simulation


@checked
def noise(
    curve: xr.Dataset, bandwidth: Any = None, poles: int | None = None, progress: Progress | bool | None = None
) -> xr.Dataset:
    r"""Return a result with the noise of amplitude and phase at each of its points.

    .. math:: P = M P M^T + D, \qquad \delta A = \sqrt{P_{AA}}, \qquad \delta\phi = \frac{\sqrt{P_{\phi\phi}}}{A}

    with the covariance P of motion and lock-in, the monodromy matrix M of a period, and the covariance D added by noise in a
    period. The method is linear, without Monte Carlo: it is valid if the noise is small relative to the distance to the next
    fold. It uses `noise` of the case: thermal motion at the temperature of the medium, and the detector.

    Parameters
    ----------
    curve
        A result with the motion at each point: of an approach, a frequency sweep, branches or a dwell.
    bandwidth
        Equivalent noise bandwidth of the lock-in (Hz, or text with a unit); default: `noise.bandwidth` of the case.
    poles
        Number of equal poles of the low-pass filter of the lock-in; default: `noise.poles` of the case.
    progress
        See :func:`run`.

    Returns
    -------
    xarray.Dataset
        The result with `amplitude_noise` (m) and `phase_noise` (degrees), standard deviations at each tone; NaN if the motion
        does not repeat or is unstable. After Ctrl-C the remaining points are NaN, and ``attrs["interrupted"]`` is 1.

    Raises
    ------
    ParameterError
        When the bandwidth is missing or above the drive frequency. Also for a whole sweep, a lock, and a force whose memory has
        too many states.
    ResultError
        When the result contains no motions, as a result of basins.
    """
    if "over" in curve.attrs and MOTION in curve and curve["status"].ndim > 2:
        raise ParameterError("the noise belongs to one curve; choose one case of the sweep with .sel or .isel")
    if MOTION not in curve.variables:
        raise ResultError(
            "this result contains no motions, needed for the noise; compute an approach, a frequency sweep, branches or a dwell"
        )
    case = case_of(curve)
    case.problem.refuse_lock("the noise along a curve")
    band, count = lock_in_of(case.problem, bandwidth, poles)
    kept = [
        name for name in (MOTION, REPEATS, MULTIPLIERS, "amplitude", "phase", "status", "zc") if name in curve.variables
    ]
    slim, shape = curve[kept], curve["status"].shape
    tones = len(case.problem.tones)
    found = {name: np.full((*shape, tones), np.nan) for name in ("amplitude_noise", "phase_noise")}
    places, interrupted = list(np.ndindex(shape)), False
    with watched(progress, f"noise: {case.title}") as report_progress:
        try:
            for number, place in enumerate(places):
                report_progress(number, len(places), "noise")
                point = slim.isel(dict(zip(curve["status"].dims, place, strict=True)))
                numbers = _at(case, point, curve.attrs.get("samples_per_period"), band, count)
                if numbers is not None:
                    found["amplitude_noise"][place], found["phase_noise"][place] = numbers
            report_progress(len(places), len(places), "")
        except KeyboardInterrupt:
            heard()
            interrupted = True
    return _finished(curve, case, found, band, count, interrupted)


def lock_in_of(problem: Problem, bandwidth: object, poles: int | None) -> tuple[float, int]:
    """Return bandwidth (Hz) and poles of the lock-in: the arguments, or the values of the case."""
    try:
        band = problem.noise.bandwidth if bandwidth is None else units.parse(bandwidth, "Hz")
    except UnitError as error:
        raise UnitError(f"bandwidth {error}") from None
    if band is None:
        raise ParameterError('the noise depends on the lock-in: pass for example bandwidth = "1 kHz"')
    slowest = min(tone.frequency for tone in problem.tones)
    if not 0.0 < band <= slowest:
        raise ParameterError(
            f"bandwidth = {units.show(band, 'Hz', 4)} is not between 0 Hz and the drive frequency, "
            f"{units.show(slowest, 'Hz', 4)}"
        )
    count = problem.noise.poles if poles is None else poles
    if not isinstance(count, int) or not 1 <= count <= 8:
        raise ParameterError(f"poles = {count} is not a whole number from 1 to 8")
    return band, count


def _at(case: Case, point: xr.Dataset, points: int | None, band: float, poles: int) -> Any:
    """Return the noise of amplitude (m) and phase (degrees) at a point, or None."""
    if int(point["status"]) not in REPEATING or case.experiment is None:
        return None
    if MULTIPLIERS in point and not _dies_out(point[MULTIPLIERS].values):
        return None
    problem = problem_at(case, point)
    common = common_period([tone.frequency for tone in problem.tones])
    repeats = float(point[REPEATS]) if REPEATS in point else np.nan
    periods = int(repeats) if np.isfinite(repeats) else common
    if periods is None or not np.isfinite(point[MOTION].values).all():
        return None
    if len(point[MOTION]) > MOST_NUMBERS:
        names = ", ".join(force.name for force in problem.forces if force.memory)
        raise ParameterError(
            f"the memory of {names} has too many states for the noise along a curve (at most {MOST_NUMBERS}); lower its "
            "elements, or simulate with df.noisy_motion"
        )
    integrator = RK4(problem, case.solver.replace(method="transient", integrator="rk4"), 1, points)
    integrator.place(float(point["zc"]))
    found = linear_noise(integrator, motion_of(point, problem), periods, band, poles)
    if found is None:
        return None
    turns = np.array(problem.readout.turns or np.zeros(len(problem.tones)))
    read = point["amplitude"].values * np.exp(1j * (turns - np.radians(point["phase"].values)))
    return found.amplitude_and_phase(read)


def _dies_out(moduli: Array) -> bool:
    """Return whether a disturbance dies out, by the moduli of its solver; a transient has no moduli yet."""
    return not bool((moduli >= 1.0).any())


def _finished(
    curve: xr.Dataset, case: Case, found: dict[str, Any], band: float, poles: int, interrupted: bool
) -> xr.Dataset:

    data = curve.copy()
    for name, values in found.items():
        data[name] = ((*curve["status"].dims, "tone"), values)
    data.attrs |= {"noise_bandwidth": band, "noise_poles": poles}
    if interrupted:
        data.attrs["interrupted"] = 1
    data.attrs |= attributes(advice(case, data))
    return describe(data)
