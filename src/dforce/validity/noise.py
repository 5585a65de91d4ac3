"""Advice where noise, or the memory of the fluid, matters beside the steady motion."""

from __future__ import annotations

import numpy as np

from dforce.core import units
from dforce.validity._advice import Advice, percent, rounded, shown
from dforce.validity._evidence import Evidence

NEAR = 5.0  # times the noise along most of a curve
SHARE = 0.5  # of the noise's square, from which on the detector limits
LIQUID_Q = 5.0
AWAY = 0.3  # of the resonance frequency
OFTEN = 0.01  # switches while a curve is taken
HARMONIC = 0.05  # of the amplitude


def noise_near_fold(seen: Evidence) -> Advice | None:
    """Compare the largest noise along a curve with that along most of it."""
    noise = seen.values("phase_noise")
    if noise.size < 5:
        return None
    usual, largest = float(np.median(noise)), float(noise.max())
    if not largest > NEAR * usual:
        return None
    return Advice(
        "noise_near_fold",
        largest / usual,
        NEAR,
        f"Toward the end of a state the noise of the phase grows to {rounded(largest)}°, {rounded(largest / usual)} times the "
        "usual noise of the curve. It is no longer a small disturbance: thermal motion may switch the state before its end. "
        "Compute the switching rate (df.switching_rate).",
        "linear noise grows as 1/(1 - |multiplier|)",
        ("noise.bandwidth",),
    )


def detector_limited(seen: Evidence) -> Advice | None:
    """Compare the detector's part of the amplitude's noise with the whole."""
    noise, floor = seen.values("amplitude_noise"), seen.problem.noise.detector
    band = None if seen.result is None else seen.result.attrs.get("noise_bandwidth")
    if not noise.size or band is None or not floor:
        return None
    share = float(np.median(2.0 * floor**2 * band / noise**2))
    if share <= SHARE:
        return None
    return Advice(
        "detector_limited",
        share,
        SHARE,
        f"Detector noise is {percent(share)} of the mean square amplitude noise; the rest is thermal motion. A better detector "
        "reduces the noise, a lower temperature hardly does.",
        "U. Dürig et al., J. Appl. Phys. 72, 1778 (1992)",
        ("noise.detector",),
    )


def fluid_memory(seen: Evidence) -> Advice | None:
    """Look for motion in a liquid at frequencies where the mode's constant mass and damping do not hold."""
    tone = seen.problem.tones[0]
    mode, medium = seen.problem.modes[tone.mode], seen.case.medium
    if mode.Q >= LIQUID_Q or mode.memory is not None or not medium.density or not medium.viscosity:
        return None
    away = abs(tone.frequency / mode.f0 - 1.0)
    second, amplitude = seen.harmonic(2), seen.values("amplitude")
    if away > AWAY:
        found, limit, where = away, AWAY, f"The drive is {percent(away)} away from the resonance"
    elif second.size and second.shape == amplitude.shape:
        share = float((second / amplitude).max())
        if share <= HARMONIC:
            return None
        found, limit, where = share, HARMONIC, f"The second harmonic is {percent(share)} of the amplitude"
    else:
        return None
    return Advice(
        "fluid_memory",
        found,
        limit,
        f"{where}, at a mode with Q = {mode.Q:.2g}. Mass and damping by the liquid depend on the frequency, so "
        "amplitudes at twice this frequency and above have an error of 7 to 13 %, and phases of some degrees. "
        'Use cantilever.beam with fluid = "history".',
        "J. E. Sader, J. Appl. Phys. 84, 64 (1998)",
        (seen.of_mode(tone.mode, "Q"), seen.of_tone(0, "frequency")),
    )


def thermal_switching(seen: Evidence) -> Advice | None:
    """Compare how often thermal motion switches a state with how long it was watched."""
    rates = seen.array("switching_rate")
    if rates is None or rates.ndim != 1 or not np.isfinite(rates).any():
        return None
    rate = float(rates[np.isfinite(rates)][0])
    expected = rate * 1.0  # in a second, about the time in which an instrument stays at a point or crosses a loop
    if expected <= OFTEN:
        return None
    return Advice(
        "thermal_switching",
        expected,
        OFTEN,
        f"Thermal motion switches this state {rounded(rate)} times a second (after {shown(1.0 / rate, 's')} on average). A "
        f"slow microscope cannot follow this state to its fold. At {units.show(seen.problem.noise.temperature, 'K', 4)} jumps "
        "are random, and their place depends on the speed.",
        "H. A. Kramers, Physica 7, 284 (1940)",
        ("medium.temperature",),
    )


PIECES = (noise_near_fold, detector_limited, fluid_memory)
