"""A motion under thermal noise, simulated in many lanes at once."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case, case_of
from dforce.core.arrays import Complexes
from dforce.core.errors import ParameterError, ResultError, checked
from dforce.core.quantities import MOTION
from dforce.core.stopping import heard
from dforce.core.units import Length
from dforce.instrument.noise import detector_readings, time_constant
from dforce.observables.complex_numbers import phase_lag
from dforce.procedures.motion import motion_of
from dforce.procedures.varied import problem_at
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.runs import dwell, watched
from dforce.solvers.langevin import Langevin, NoisyLanes
from dforce.solvers.transient import LATE, decay_periods
from dforce.thermal._noise_along_curve import lock_in_of

if TYPE_CHECKING:
    import xarray as xr

    from dforce.experiments.base import Progress
    from dforce.instrument import NoiseNumbers
    from dforce.problem import Problem
    from dforce.solvers.integrator import Motion

CHUNK = 64  # periods between checks for a stop
MOST_NUMBERS = 200_000_000  # of a record: more than a GB
MOST_SEED = 2**62


@checked
def noisy_motion(
    case: Case | xr.Dataset,
    zc: Any = None,
    seeds: int | Sequence[int] = 200,
    periods: int = 1000,
    settling: int | None = None,
    bandwidth: Any = None,
    poles: int | None = None,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    """Return amplitude and phase of each period under thermal noise, for many runs at once.

    Each run has its own seed and does not depend on the other runs. All runs start from the steady motion without noise.

    Parameters
    ----------
    case
        A case, or one point of a result whose motion is the start.
    zc
        Average distance (m, or text with a unit) for a case; default: the distance of its dwell. A point has its own distance.
    seeds
        Number of runs, with seeds from `noise.seed` of the case on; or a list of seeds.
    periods
        Number of recorded periods of the first tone.
    settling
        Number of periods before the record; default: ten decay times of the slowest mode, and of the lock-in.
    bandwidth, poles
        Equivalent noise bandwidth (Hz) of a lock-in, far below the drive frequency, and its poles; default: amplitude and phase
        of each period alone.
    progress
        See :func:`run`.

    Returns
    -------
    xarray.Dataset
        `amplitude` (m) and `phase` (degrees), over `seed`, `time` (s) and `tone`, with detector noise; `min_distance` (m) of
        each run. After Ctrl-C the finished periods, and ``attrs["interrupted"]`` is 1.

    Raises
    ------
    ParameterError
        For numbers that are not allowed, `zc` with a point, and an optical lever without `bandwidth`.
    ResultError
        When the result is not one point with a motion.
    """
    import xarray as xr

    asked, problem, place, start = start_of(case, zc)
    given = _seeds(problem.noise.seed, seeds)
    band = None if bandwidth is None else lock_in_of(problem, bandwidth, poles)
    if periods < 1 or not given:
        raise ParameterError("a noisy motion needs at least one period and one seed")
    if settling is not None and settling < 0:
        raise ParameterError(f"settling = {settling} is below 0")
    if len(given) * periods * len(problem.tones) > MOST_NUMBERS:
        raise ParameterError(f"{len(given)} runs of {periods} periods are too long a record; reduce either")
    wait = settling_periods(problem, band) if settling is None else settling
    integrator = langevin(asked, problem, place)
    if band is not None:
        integrator.read_by(*band)
    lanes = integrator.lanes([start] * len(given), given)
    with watched(progress, f"noisy motion: {asked.title}") as report_progress:
        parts, lanes = march(integrator, lanes, wait + periods, report_progress)
        c = read_out(integrator, parts, given, band)[:, wait:]
        report_progress(wait + periods, wait + periods, "")
    turns = np.array(problem.readout.turns or np.zeros(len(problem.tones)))
    times = (np.arange(c.shape[1]) + 0.5) / problem.tones[0].frequency
    data = xr.Dataset(
        {
            "amplitude": (("seed", "time", "tone"), np.abs(c)),
            "phase": (("seed", "time", "tone"), phase_lag(c * np.exp(-1j * turns))),
            "min_distance": ("seed", lanes.lowest),
        },
        {"seed": [*given], "time": times, "tone": np.arange(1, len(problem.tones) + 1), "zc": place},
    )
    if c.shape[1] < periods:
        data.attrs["interrupted"] = 1
    data.attrs |= of_case(asked) | {"samples_per_period": integrator.points}
    return describe(data)


def _seeds(first: int, given: int | Sequence[int]) -> Sequence[int]:
    """Return the seed of each run: a number of seeds from `first` on, or the given seeds."""
    if isinstance(given, int | np.integer):
        return range(first, first + int(given))
    counts = Counter(int(seed) for seed in given)
    for seed, count in counts.items():
        if not 0 <= seed <= MOST_SEED:
            raise ParameterError(f"seed = {seed} is not between 0 and 2^62")
        if count > 1:
            raise ParameterError(f"seeds contains {seed} twice: both runs would be equal")
    return [*counts]


def start_of(case: Case | xr.Dataset, zc: Length | None) -> tuple[Case, Problem, float, Motion]:
    """Return case, problem, distance (m) and the motion without noise that a case settles to, or that a point keeps."""
    if isinstance(case, Case):
        quiet = case.solver.replace(method="periodic", integrator="rk4", settle="converged")
        asked, point = case, dwell(case.replace(solver=quiet), zc)
        problem = case.problem.at_height(float(point["zc"]))
    else:
        if zc is not None:
            raise ParameterError("a point of a result has its own distance; pass no zc")
        asked, point = case_of(case), case
        if MOTION not in point.variables or point["status"].ndim:
            raise ResultError(
                "a noisy motion starts from one point of a result with motions; choose it with .sel or .isel"
            )
        problem = problem_at(asked, point)
    if MOTION not in point.variables:
        raise ResultError("no motion exists at this distance")
    motion = motion_of(point, problem)
    if not motion.is_finite:
        raise ResultError("this point has no motion")
    return asked, problem, float(point["zc"]), motion


def langevin(case: Case, problem: Problem, zc: float) -> Langevin:
    """Return the integrator of a problem under thermal noise, at a distance (m)."""
    settings = case.solver.replace(method="transient", integrator="langevin")
    integrator = Langevin(problem, settings, 1)
    integrator.place(zc)
    return integrator


def settling_periods(problem: Problem, band: tuple[float, int] | None) -> int:
    """Return after how many periods of the first tone start and lock-in are forgotten."""
    of_lock_in = 0.0 if band is None else LATE * band[1] * time_constant(*band) * problem.tones[0].frequency
    return LATE * decay_periods(problem) + math.ceil(of_lock_in)


def march(integrator: Langevin, lanes: NoisyLanes, periods: int, report_progress: Any) -> tuple[Complexes, NoisyLanes]:
    """Advance lanes, with checks for a stop; return scaled complex amplitudes (lanes, periods, tones), and the lanes.

    At Ctrl-C the finished periods are returned.
    """
    parts, done = [np.empty((len(lanes.y), 0, len(integrator.tones)), dtype=complex)], 0
    try:
        while done < periods:
            report_progress(done, periods, "periods")
            count = min(CHUNK, periods - done)
            lanes, c = integrator.run(lanes, count)
            parts.append(c)
            done += count
    except KeyboardInterrupt:
        heard()
    return np.concatenate(parts, axis=1), lanes


def read_out(integrator: Langevin, c: Complexes, seeds: Sequence[int], band: tuple[float, int] | None) -> Complexes:
    """Return the detector's readings (m), with its own noise; through the lock-in where there is one."""
    problem = integrator.problem
    if band is None and any(weight != 1.0 for weights in problem.readout.weights for weight in weights):
        raise ParameterError("an optical lever needs a lock-in: pass its bandwidth")
    seen = np.array([weights[tone.mode] for weights, tone in zip(problem.readout.weights, problem.tones, strict=True)])
    read = c * integrator.scales.length + (problem.readout.base - seen) * problem.base
    return np.asarray(read + _detector(problem.noise, c.shape, seeds, problem, band))


def _detector(
    noise: NoiseNumbers, shape: tuple[int, ...], seeds: Sequence[int], problem: Problem, band: tuple[float, int] | None
) -> Any:
    """Return the detector's noise in the reading of each period (m)."""
    if not noise.detector:
        return 0.0
    frequency = problem.tones[0].frequency
    added = np.array([detector_readings(noise, seed, frequency, *shape[1:]) for seed in seeds])
    return added if band is None else _low_pass(added, frequency, *band)


def _low_pass(read: Complexes, frequency: float, bandwidth: float, poles: int) -> Complexes:
    """Return noise of periods behind equal poles."""
    from scipy.signal import lfilter

    kept = math.exp(-1.0 / (frequency * time_constant(bandwidth, poles)))
    for _ in range(poles):
        read = lfilter([1.0 - kept], [1.0, -kept], read, axis=1)
    return read
