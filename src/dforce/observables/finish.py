"""Turns what was measured over each period into the quantities that a result holds, in SI units."""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.kernel import Array, Scales
from dforce.observables import measure as m
from dforce.problem import Problem

Complex = np.ndarray[Any, np.dtype[np.complex128]]


def angle(c: Complex) -> Array:
    """Return the angle (degrees) of complex numbers, in (-180°, 180°], the same wherever they lie in memory."""
    # NumPy 1.26 rounds otherwise where the result happens to lie within a stride behind numbers that are strided: the parts
    # of complex ones always are, copies of them are not
    return np.degrees(np.arctan2(np.array(c.imag, order="C"), np.array(c.real, order="C")))


def phase_lag(c: Complex) -> Array:
    """Return the phase lag (degrees) of complex amplitudes, in (-90°, 270°].

    Never folded, and without a jump near 0° (far below resonance) and 180° (strong attraction).
    """
    return np.asarray(270.0 - (270.0 + angle(c)) % 360.0)


def finish(problem: Problem, scales: Scales, harmonics: int, rows: Array, weights: Array) -> dict[str, Any]:
    """Return every scalar observable of a settled motion.

    Parameters
    ----------
    problem, scales
        What was solved, and the units it was solved in.
    harmonics
        Number of harmonics that were measured.
    rows
        One row a period, as ``measure`` writes them, shape (periods, columns).
    weights
        Weight of each period, shape (periods,).

    Returns
    -------
    dict
        SI values by the names of :data:`dforce.quantities.OBSERVABLES`: floats, and arrays over tones, modes or
        harmonics.
    """
    return {name: value[0] for name, value in finish_all(problem, scales, harmonics, rows[None], weights).items()}


def finish_all(problem: Problem, scales: Scales, harmonics: int, rows: Array, weights: Array) -> dict[str, Array]:
    """Return the same for many motions at once: `rows` of shape (motions, periods, columns), results (motions, ...)."""
    length, period = np.array([scales.length]), np.array([1.0 / problem.tones[0].frequency])
    return finish_each(problem, harmonics, rows, weights, length, period, np.array([problem.a0]))


def finish_each(
    problem: Problem, harmonics: int, rows: Array, weights: Array, length: Array, period: Array, a0: Array
) -> dict[str, Array]:
    """Return the same for motions of different problems, whose scales and contact distances are arrays (motions,).

    Of `problem` only the modes' and tones' numbers count, and which tone drives which mode.
    """
    modes, tones = len(problem.modes), len(problem.tones)
    mean = np.einsum("k,ikc->ic", weights, rows)
    pairs = mean[:, m.FIRST :: 2] + 1j * mean[:, m.FIRST + 1 :: 2]
    by_tone = pairs[:, : tones * (modes + 1)].reshape(-1, tones, modes + 1)
    total = by_tone[:, :, -1]
    of_harmonics = pairs[:, tones * (modes + 1) :][:, :harmonics]
    of_force = pairs[:, tones * (modes + 1) + harmonics :]
    driver = [driving_tone(problem, n) for n in range(modes)]
    of_modes = by_tone[:, driver, range(modes)]
    lengths = length[:, None]
    work = of_force[:, driver] * of_modes.conj() * lengths
    z_mean = mean[:, m.Z] * length
    z_min = rows[:, :, m.Z_MIN].min(1) * length
    z_max = rows[:, :, m.Z_MAX].max(1) * length
    d_min = rows[:, :, m.D_MIN].min(1)
    values = {
        "amplitude": np.abs(total) * lengths,
        "amplitude_ratio": np.abs(total[:, 0]),  # lengths are in units of A0
        "phase": phase_lag(total),
        "mode_amplitude": np.abs(of_modes) * lengths,
        "mode_phase": phase_lag(of_modes),
    }
    if tones == 1:
        values |= {
            "harmonic_amplitude": np.abs(of_harmonics) * lengths,
            "harmonic_phase": phase_lag(of_harmonics),
        }
    return values | {
        "mean_deflection": z_mean,
        "min_deflection": z_min,
        "max_deflection": z_max,
        "half_peak_to_peak": 0.5 * (z_max - z_min),
        "peak_force": rows[:, :, m.F_MAX].max(1),
        "min_force": rows[:, :, m.F_MIN].min(1),
        "mean_force": mean[:, m.F],
        "min_distance": d_min,
        "max_indentation": np.maximum(a0 - d_min, 0.0),
        "contact_time": mean[:, m.CONTACT] * period,
        "contact_fraction": mean[:, m.CONTACT],
        "peak_velocity": rows[:, :, m.V_MAX].max(1),
        "virial": 0.5 * work.real,
        "dissipated_energy": -np.pi * work.imag,
        "total_virial": mean[:, m.F_Z] - mean[:, m.F] * z_mean,
        "total_dissipated_energy": -mean[:, m.F_V] * period,
        "power": -mean[:, m.F_V],
    }


def first_amplitudes(problem: Problem, scales: Scales, rows: Array, weights: Array) -> Array:
    """Return the amplitude (m) at the first tone alone, for many motions as in :func:`finish_all`."""
    place = m.FIRST + 2 * len(problem.modes)
    mean = np.einsum("k,ikc->ic", weights, rows[:, :, place : place + 2])
    return np.asarray(np.abs(mean[:, 0] + 1j * mean[:, 1])) * scales.length


def driving_tone(problem: Problem, mode: int) -> int:
    """Return which tone drives a mode; the first one where none does."""
    return next((j for j, tone in enumerate(problem.tones) if tone.mode == mode), 0)


def multipliers(tangents: Array) -> tuple[Array, Array]:
    """Return moduli and angles (degrees) of the eigenvalues of each tangent, the largest first."""
    if tangents.shape[1] == 2:  # by hand: LAPACK takes as long for a small matrix as the orbit itself
        half = 0.5 * (tangents[:, 0, 0] + tangents[:, 1, 1])
        product = tangents[:, 0, 0] * tangents[:, 1, 1] - tangents[:, 0, 1] * tangents[:, 1, 0]
        root = np.sqrt((half * half - product).astype(complex))
        found = np.stack([half + root, half - root], axis=1)
    else:
        found = np.full(tangents.shape[:2], np.nan, dtype=complex)
        known = np.isfinite(tangents).all(axis=(1, 2))
        found[known] = np.linalg.eigvals(tangents[known])
    found = np.take_along_axis(found, np.argsort(-np.abs(found), axis=1, kind="stable"), 1)
    return np.abs(found), angle(found)
