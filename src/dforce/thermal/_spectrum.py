"""The thermal spectrum of a free lever, and what each calibration makes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core import units
from dforce.core.errors import ParameterError, UnitError, checked
from dforce.instrument import beam
from dforce.instrument.lever import normal_factor
from dforce.instrument.noise import thermal_density
from dforce.runs import watched
from dforce.thermal._noise_along_curve import Progress

if TYPE_CHECKING:
    import xarray as xr

    from dforce.instrument import ModeNumbers
    from dforce.kernel import Array
    from dforce.problem import Problem

OVERSAMPLED = 8  # samples a period of the fastest mode
MOST_SAMPLES = 30_000_000  # of a record
CHUNK = 100_000  # of them simulated at once
LINES = 12.0  # points of the spectrum across a resonance
WIDTHS = 15.0  # line widths on either side that are fitted
NEAR = 0.4  # of the frequency, where a fluid with memory makes the resonance of another form farther off
SHORTEST = 4  # segments that the spectrum is the mean of, at least
FACTORS = ("static, 0.817", "static, no factor", "each mode", "each mode, 0.817", "Sader")


@dataclass(frozen=True)
class Peak:
    """A resonance as it is fitted: frequency (Hz), quality factor, mean square (m^2) and white noise (m^2/Hz)."""

    f0: float
    Q: float
    mean_square: float
    white: float

    def density(self, frequency: Array) -> Array:
        """Return the one-sided spectral density (m^2/Hz)."""
        return self.white + np.asarray(thermal_density(frequency, self.f0, 1.0, self.Q, self.mean_square))


@checked
def thermal_spectrum(case: Case, duration: Any = "1 s", progress: Progress = None) -> xr.Dataset:
    r"""Return the thermal spectrum that a detector records of a free lever, and the spring constants that users make of it.

    The record is simulated, exactly at its samples, with the fluid's memory where the lever has it: its density is then
    :math:`\frac{4 k_B T}{\omega}\, \mathrm{Im}\left(-\frac{z}{F}\right)`. Each mode's resonance is fitted as white noise and

    .. math:: S(f) = \frac{4 \langle z^2 \rangle}{\omega_0 Q}\, \frac{1}{(1 - r^2)^2 + r^2 / Q^2}, \qquad r = f / f_0

    as an optical lever reads it that is calibrated by a force curve on a hard sample: :math:`\langle z^2 \rangle =
    s_n^2 k_B T / k_n`, with its sensitivity to the mode. With the fluid's memory that form holds near the resonance, so that
    what lies within 40 % of it is fitted.

    Parameters
    ----------
    case
        Lever, medium and noise; drive, sample and forces do not count.
    duration
        Length of the record (s, or text with a unit).
    progress
        See :func:`run`.

    Returns
    -------
    xarray.Dataset
        `spectral_density` and `fitted_density` (m^2/Hz) over `frequency`; over `mode` `fitted_f0`, `fitted_Q`,
        `mode_spring_constant` by the mode's own calibration, and `true_mode_spring_constant`; over `calibration`
        `spring_constant`, beside `true_spring_constant`, the one that the calibration means to give, and their ratio
        `spring_constant_ratio`. `spring_constant_error` is the standard deviation of the ratio by the length of the record,
        :math:`\sqrt{2 Q / \omega_0 T}`. The calibrations: ``"static, 0.817"``, the right one for a static sensitivity;
        ``"static, no factor"``; ``"each mode"``; ``"each mode, 0.817"``, that factor with a sensitivity to which it does not
        belong; ``"Sader"``, from frequency and Q, where the lever's sizes and the medium are known: the constant of the lever
        itself, not that across the sample, where it is tilted.

    Raises
    ------
    ParameterError
        When the record is too short to show the resonances, or too long to keep.

    Sources: H.-J. Butt, M. Jaschke, Nanotechnology 6, 1 (1995); J. E. Sader, J. W. M. Chon, P. Mulvaney, Rev. Sci. Instrum.
    70, 3967 (1999).
    """
    import xarray as xr
    from scipy.signal import welch

    from dforce.results.dataset import describe
    from dforce.results.provenance import provenance

    try:
        length = units.parse(duration, "s")
    except UnitError as error:
        raise UnitError(f"duration {error}") from None
    problem = case.problem
    if problem.noise.kT <= 0.0:
        raise ParameterError("noise.thermal = false, so there is no thermal spectrum")
    with watched(progress, f"thermal spectrum: {case.title}") as tell:
        tell(0, 2, "recording")
        rate = OVERSAMPLED * max(mode.f0 for mode in problem.modes)
        segment = _segment(problem, length, rate)
        reading = _record(problem, _sensitivities(case), length, rate)
        tell(1, 2, "fitting")
        frequency, density = welch(reading, rate, nperseg=segment, detrend="constant")
        peaks = [_fit(mode, frequency, density) for mode in problem.modes]
        tell(2, 2, "")
    shown = (frequency > 0.0) & (frequency < 1.6 * max(mode.f0 for mode in problem.modes))
    line = sum(peak.density(frequency[shown]) - peak.white for peak in peaks) + peaks[0].white
    kT, sensitivity = problem.noise.kT, np.array(_sensitivities(case))
    squares = np.array([peak.mean_square for peak in peaks])
    found = _constants(case, peaks[0], kT / squares[0], kT / squares[0] * sensitivity[0] ** 2)
    first = problem.modes[0]
    static = first.k / beam.static_factor()
    truth = {name: first.k if name == "each mode" else static for name in found}
    truth |= {"Sader": static / _across(case)} if "Sader" in found else {}
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
            "spring_constant_error": math.sqrt(first.Q / (math.pi * first.f0 * length)),
        },
        {
            "frequency": frequency[shown], "mode": np.arange(1, len(peaks) + 1), "calibration": [*found],
        },
    )  # fmt: skip
    data.attrs = provenance(case.to_toml(), case.title) | {"duration": length, "sampling_rate": rate}
    return describe(data)


def _sensitivities(case: Case) -> tuple[float, ...]:
    """Return how a lever of light that is calibrated by a force curve sees each mode."""
    given = case.readout.mode_sensitivity
    count = len(case.problem.modes)
    return tuple(given) if len(given) == count else tuple(beam.lever_factor(n) for n in range(1, count + 1))


def _segment(problem: Problem, length: float, rate: float) -> int:
    """Return how many samples a segment takes to resolve the sharpest resonance."""
    sharpest = min(mode.f0 / mode.Q for mode in problem.modes)
    segment = math.ceil(rate * LINES / sharpest)
    if length * rate < SHORTEST * segment:
        wanted = units.show(SHORTEST * segment / rate, "s", 2)
        raise ParameterError(
            f"duration = {units.show(length, 's', 4)} is too short to resolve the resonance; it takes {wanted} at least"
        )
    if length * rate > MOST_SAMPLES:
        raise ParameterError(
            f"duration = {units.show(length, 's', 4)} is too long to keep; at most {units.show(MOST_SAMPLES / rate, 's', 2)} is"
        )
    return segment


def _record(problem: Problem, sensitivity: tuple[float, ...], length: float, rate: float) -> Array:
    """Return what the detector reads (m): each mode exactly as it moves at the samples, and its own noise."""
    count, noise = int(length * rate), problem.noise
    random = np.random.Generator(np.random.Philox(noise.seed))
    reading = np.zeros(count)
    for seen, mode in zip(sensitivity, problem.modes, strict=True):
        reading += seen * _thermal_motion(mode, count, 1.0 / rate, noise.kT, random)
    if noise.detector:
        reading += noise.detector * math.sqrt(0.5 * rate) * random.standard_normal(count)
    return reading


def _thermal_motion(mode: ModeNumbers, count: int, h: float, kT: float, random: np.random.Generator) -> Array:
    """Return a mode's thermal deflection (m) at so many samples, from equilibrium on.

    Along each left eigenvector of its free motion, late fluid included, it is a number that turns, decays and is kicked.
    """
    from scipy.signal import lfilter

    from dforce.solvers.langevin import free_motion, noise_root

    A, _ = free_motion(mode)
    rates, right = np.linalg.eig(A)
    size, omega = len(A), 2.0 * math.pi * mode.oscillator[0]
    # a part of the fluid weighs W / s of the mode
    squares = np.array([1.0, 1.0, *np.divide(A[2:, 1], A[1, 2:], out=np.zeros(size - 2), where=A[1, 2:] > 0.0)])
    unit = math.sqrt(kT / mode.k) * np.array([1.0, *[omega] * (size - 1)])
    own = rates.imag >= 0.0  # of two that are conjugate one tells both
    left, turns = np.linalg.inv(right)[own], np.exp(omega * h * rates[own])
    seen = math.sqrt(kT / mode.k) * right[0, own] * np.where(rates[own].imag > 0.0, 2.0, 1.0)
    start, kicked = np.sqrt(squares) * random.standard_normal(size), (left / unit @ noise_root(mode, h, kT)).T
    motion, held = np.empty(count), np.zeros((len(turns), 1), dtype=complex)
    for first in range(0, count, CHUNK):
        part = slice(first, min(first + CHUNK, count))
        kicks = random.standard_normal((part.stop - first, size)) @ kicked
        if not first:
            kicks[0] = left @ start
        for j, turn in enumerate(turns):
            kicks[:, j], held[j] = lfilter([1.0], [1.0, -turn], kicks[:, j], zi=held[j])
        motion[part] = (kicks @ seen).real
    return motion


def _fit(mode: ModeNumbers, frequency: Array, density: Array) -> Peak:
    """Return the resonance near a mode that makes a spectrum most likely (Whittle's likelihood)."""
    from scipy.optimize import minimize

    width = min(WIDTHS / mode.Q, math.inf if mode.memory is None else NEAR) * mode.f0
    near = (frequency > max(mode.f0 - width, 0.05 * mode.f0)) & (frequency < min(mode.f0 + width, 2.0 * mode.f0))
    x, y = frequency[near], density[near]
    area, floor = float(y.sum() * (x[1] - x[0])), float(np.median(y))
    start = np.log([mode.f0, mode.Q, area, max(min(floor, y.min() * 2.0), 1e-300)])

    def unlikely(logs: Array) -> float:
        model = Peak(*np.exp(logs)).density(x)
        return float(np.mean(np.log(model / y) + y / model))

    found = minimize(unlikely, start, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-12, "maxiter": 4000})
    return Peak(*map(float, np.exp(found.x)))


def _constants(case: Case, peak: Peak, of_reading: float, of_mode: float) -> dict[str, float]:
    """Return the spring constant (N/m) by each calibration: kT over the mean square of the reading, and of the mode's own."""
    factor = beam.lever_factor(1) ** 2 / beam.static_factor()
    values = [factor * of_reading, of_reading, of_mode, factor * of_mode]
    found = dict(zip(FACTORS[:-1], values, strict=True))
    sizes = _sizes(case)
    medium = case.medium
    if sizes is not None and medium.density and medium.viscosity:
        found["Sader"] = beam.sader_stiffness(peak.f0, peak.Q, *sizes, medium.density, medium.viscosity)
    return found


def _across(case: Case) -> float:
    """Return by how much a tilted lever is stiffer across the sample, where static calibrations are made."""
    lever = case.cantilever
    return normal_factor(lever.tilt if lever.beam is None else lever.beam.tilt)


def _sizes(case: Case) -> tuple[float, float] | None:
    """Return length and width (m) of the lever, where they are known."""
    from dforce.library.cantilevers import cantilevers

    lever = case.cantilever
    if lever.beam is not None:
        return lever.beam.length, lever.beam.width
    if lever.name is None or lever.library is not None:
        return None
    known = cantilevers()[lever.name]
    return (known.length, known.width) if known.length is not None and known.width is not None else None
