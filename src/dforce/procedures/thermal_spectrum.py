"""The thermal spectrum of a free lever, and the spring constant by each calibration."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import xarray as xr
from scipy.signal import lfilter, welch

from dforce.case import Case
from dforce.core.arrays import Array
from dforce.core.stopping import until_stopped
from dforce.experiments import ThermalSpectrum
from dforce.experiments.base import Progress
from dforce.experiments.thermal_spectrum import rate_of, segment_of
from dforce.instrument import ModeNumbers, beam
from dforce.instrument.resonances import Resonance, most_likely
from dforce.problem import Problem
from dforce.results.status import Status
from dforce.solvers.langevin import free_motion, noise_root

CHUNK = 100_000  # of them simulated at once
WIDTHS = 15.0  # line widths on either side that are fitted
NEAR = 0.4  # of the frequency, where a fluid with memory makes the resonance of another form farther off
MOST_UNSURE = 0.2  # relative error of a number of a resonance, beyond which the spectrum does not constrain it
# Factor of errors over independent points: neighbors in a spectrum of Hann's window are correlated by 2/3 and 1/6.
TOGETHER = math.sqrt(1.0 + 2.0 * (2.0 / 3.0) ** 2 + 2.0 * (1.0 / 6.0) ** 2)
ROUNDS = 4  # in which modes are fitted over each other: in water their peaks overlap
UNKNOWN = Resonance(math.nan, math.nan, math.nan, math.nan)
FACTORS = ("static, 0.817", "static, no factor", "each mode", "each mode, 0.817", "Sader")


def thermal_spectrum(
    case: Case, plan: ThermalSpectrum, report_progress: Progress, _earlier: xr.Dataset | None
) -> xr.Dataset:
    """Return the spectrum, its fit and the spring constants; see :func:`dforce.runs.carry_out`.

    A part of a record is not kept.
    """
    free = _far_from_the_sample(case, case.problem)
    plan.check(free)
    with until_stopped() as stop:
        data = _spectrum(plan.duration, free, case, report_progress)
    if stop.came:
        return xr.Dataset({"status": int(Status.NOT_COMPUTED)}, attrs={"interrupted": 1})
    return data


def _spectrum(duration: float, problem: Problem, case: Case, progress: Progress) -> xr.Dataset:
    rate, kT = rate_of(problem), problem.noise.kT
    sensitivity = np.array(case.readout.replace(kind="optical_lever").sensitivities(len(problem.modes)))
    parts = math.ceil(int(duration * rate) / CHUNK) * len(problem.modes)
    reading = _record(problem, sensitivity, duration, lambda done: progress(done, parts + 1, "recording"))
    progress(parts, parts + 1, "fitting")
    length = segment_of(problem, rate)
    frequency, density = welch(reading, rate, nperseg=length, detrend="constant")
    peaks, errors = _fitted(problem, sensitivity, frequency, density, _scatter(len(reading), length))
    shown = (frequency > 0.0) & (frequency < 1.6 * max(mode.f0 for mode in problem.modes))
    line = _line(problem, peaks, frequency)[shown]
    peaks = [UNKNOWN if math.isnan(error) else peak for peak, error in zip(peaks, errors, strict=True)]
    squares = np.array([peak.mean_square for peak in peaks])
    found = _constants(case, peaks[0], kT / squares[0], kT / squares[0] * sensitivity[0] ** 2)
    first = problem.modes[0]
    static = first.k / beam.static_factor()
    truth = {name: first.k if name == "each mode" else static for name in found}
    truth |= {"Sader": static / case.cantilever.normal_factor} if "Sader" in found else {}
    data = xr.Dataset(
        {
            "spectral_density": ("frequency", density[shown]),
            "fitted_density": ("frequency", line),
            "fitted_f0": ("mode", [peak.f0 for peak in peaks]),
            "fitted_Q": ("mode", [peak.Q for peak in peaks]),
            "mode_spring_constant": ("mode", kT / squares * sensitivity**2),
            "true_mode_spring_constant": ("mode", [mode.k for mode in problem.modes]),
            "spring_constant": ("calibration", [*found.values()]),
            "true_spring_constant": ("calibration", [*truth.values()]),
            "spring_constant_ratio": ("calibration", [found[name] / truth[name] for name in found]),
            "spring_constant_error": errors[0],
            "status": int(Status.OK),
        },
        {"frequency": frequency[shown], "mode": np.arange(1, len(peaks) + 1), "calibration": [*found]},
        {"duration": duration, "sampling_rate": rate},
    )
    progress(parts + 1, parts + 1, "")
    return data


def _far_from_the_sample(case: Case, problem: Problem) -> Problem:
    """Return a problem without the flow between lever and sample."""
    if case.cantilever.beam is None or case.cantilever.beam.tip_height is None:
        return problem
    return case.replace("cantilever.beam.wall", "at_sample").replace("cantilever.beam.tip_height", None).problem


def _record(problem: Problem, sensitivity: Array, length: float, report_progress: Callable[[int], None]) -> Array:
    """Return the detector's record (m): each mode's exact motion at the samples, and the detector's own noise.

    `report_progress` is called with the finished parts, so many for each mode.
    """
    rate, noise = rate_of(problem), problem.noise
    count = int(length * rate)
    parts = math.ceil(count / CHUNK)
    random = np.random.Generator(np.random.Philox(noise.seed))
    reading = np.zeros(count)
    for n, mode in enumerate(problem.modes):
        for part, motion in enumerate(_thermal_motion(mode, count, 1.0 / rate, noise.kT, random)):
            report_progress(n * parts + part)
            reading[part * CHUNK : (part + 1) * CHUNK] += sensitivity[n] * motion
    if noise.detector:
        reading += noise.detector * math.sqrt(0.5 * rate) * random.standard_normal(count)
    return reading


def _thermal_motion(mode: ModeNumbers, count: int, h: float, kT: float, random: np.random.Generator) -> Iterator[Array]:
    """Give a mode's thermal deflection (m) at so many samples, from equilibrium on, in parts of :data:`CHUNK`.

    Along each left eigenvector of its free motion, late fluid included, it is a number that turns, decays and is kicked.
    """
    A, _ = free_motion(mode)
    rates, right = np.linalg.eig(A)
    size, omega = len(A), 2.0 * math.pi * mode.oscillator[0]
    # a part of the fluid weighs W / s of the mode
    squares = np.array([1.0, 1.0, *np.divide(A[2:, 1], A[1, 2:], out=np.zeros(size - 2), where=A[1, 2:] > 0.0)])
    unit = math.sqrt(kT / mode.k) * np.array([1.0, *[omega] * (size - 1)])
    own = rates.imag >= 0.0  # one of two conjugate rates gives both
    left, turns = np.linalg.inv(right)[own], np.exp(omega * h * rates[own])
    seen = math.sqrt(kT / mode.k) * right[0, own] * np.where(rates[own].imag > 0.0, 2.0, 1.0)
    start, kicked = np.sqrt(squares) * random.standard_normal(size), (left / unit @ noise_root(mode, h, kT)).T
    held = np.zeros((len(turns), 1), dtype=complex)
    for first in range(0, count, CHUNK):
        kicks = random.standard_normal((min(CHUNK, count - first), size)) @ kicked
        if not first:
            kicks[0] = left @ start
        for j, turn in enumerate(turns):
            kicks[:, j], held[j] = lfilter([1.0], [1.0, -turn], kicks[:, j], zi=held[j])
        yield (kicks @ seen).real


def _fitted(
    problem: Problem, sensitivity: Array, frequency: Array, density: Array, scatter: float
) -> tuple[list[Resonance], list[float]]:
    """Return each mode's resonance, fitted to the spectrum near it over the other modes, and the error of its mean square.

    A resonance that the spectrum does not constrain, such as below the detector's noise, is the expected one, with error NaN.
    """
    windows = [_window(mode, frequency) for mode in problem.modes]
    expected = [
        Resonance(mode.f0, mode.Q, problem.noise.kT / mode.k * seen**2, float(density[near].min()))
        for mode, seen, near in zip(problem.modes, sensitivity.tolist(), windows, strict=True)
    ]
    peaks, errors = [*expected], [math.nan] * len(expected)
    for _ in range(ROUNDS if len(peaks) > 1 else 1):
        for n, (mode, near) in enumerate(zip(problem.modes, windows, strict=True)):
            x = frequency[near]
            others = sum((_alone(peak).density(x) for peak in peaks[:n] + peaks[n + 1 :]), np.zeros(len(x)))
            fit = most_likely(x, density[near], expected[n], others)
            own = abs(fit.peak.f0 - mode.f0) < min(1.0 / mode.Q, NEAR) * mode.f0
            larger = scatter * math.sqrt(fit.averages)  # than by how much the points are off the fit
            told = own and max(fit.errors) * larger < MOST_UNSURE
            peaks[n], errors[n] = (fit.peak, fit.errors[2] * larger) if told else (expected[n], math.nan)
    return peaks, errors


def _line(problem: Problem, peaks: list[Resonance], frequency: Array) -> Array:
    """Return the density that was fitted, with the white noise beside the nearest mode; NaN where nothing was fitted."""
    nearest = np.argmin([abs(frequency / mode.f0 - 1.0) for mode in problem.modes], axis=0)
    line = np.array([peak.background for peak in peaks])[nearest]
    line = line + np.sum([_alone(peak).density(frequency) for peak in peaks], axis=0)
    fitted = np.any([_window(mode, frequency) for mode in problem.modes], axis=0)
    return np.where(fitted, line, math.nan)


def _scatter(count: int, length: int) -> float:
    """Return how much points of a spectrum of so many samples scatter, in segments of a length, as independent ones would.

    Segments overlap by half, so that next ones go together by 1/6.
    """
    segments = 2 * count // length - 1
    return TOGETHER * math.sqrt((1.0 + 2.0 * (1.0 / 6.0) ** 2) / segments)


def _window(mode: ModeNumbers, frequency: Array) -> Any:
    """Return which frequencies lie near a resonance."""
    width = min(WIDTHS / mode.Q, math.inf if mode.memory is None else NEAR) * mode.f0
    return (frequency > max(mode.f0 - width, 0.05 * mode.f0)) & (frequency < min(mode.f0 + width, 2.0 * mode.f0))


def _alone(peak: Resonance) -> Resonance:
    """Return a resonance without its background."""
    return dataclasses.replace(peak, background=0.0)


def _constants(case: Case, peak: Resonance, of_reading: float, of_mode: float) -> dict[str, float]:
    """Return the spring constant (N/m) by each calibration: kT over the mean square of the reading, and of the mode's own."""
    factor = beam.lever_factor(1) ** 2 / beam.static_factor()
    values = [factor * of_reading, of_reading, of_mode, factor * of_mode]
    found = dict(zip(FACTORS[:-1], values, strict=True))
    sizes, medium = case.cantilever.sizes, case.medium
    if sizes is not None and medium.density and medium.viscosity:
        found["Sader"] = beam.sader_stiffness(peak.f0, peak.Q, *sizes, medium.density, medium.viscosity)
    return found
