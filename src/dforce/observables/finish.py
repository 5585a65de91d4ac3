"""Turns the measurements over each period into the quantities of a result, in SI units."""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Complexes
from dforce.kernel.codegen import CONTACT, LENGTH, OMEGA
from dforce.observables import measure as m
from dforce.observables.complex_numbers import angle, modulus, phase_lag, product
from dforce.problem import Problem


def finish(
    problem: Problem, harmonics: int, rows: Array, weights: Array, added: Complexes | None = None
) -> dict[str, Any]:
    """Return every scalar observable of a settled motion.

    Parameters
    ----------
    problem
        The solved problem.
    harmonics
        Number of measured harmonics.
    rows
        One row a period, as ``measure`` writes them, shape (periods, columns).
    weights
        Weight of each period, shape (periods,).
    added
        The detector's noise in the complex amplitude of each tone (m), shape (tones,).

    Returns
    -------
    dict
        SI values by the names of :data:`dforce.core.quantities.OBSERVABLES`: floats, and arrays over tones, modes or
        harmonics.
    """
    numbers, tones = np.array([kernel.parameters(problem, 0.0)]), kernel.tone_table(problem)[None]
    more = None if added is None else added / kernel.scales(problem).length
    found = finish_each(problem, harmonics, rows[None], weights, numbers, tones, more)
    return {name: value[0] for name, value in found.items()}


def finish_each(
    problem: Problem,
    harmonics: int,
    rows: Array,
    weights: Array,
    numbers: Array,
    tables: Array,
    added: Complexes | None = None,
) -> dict[str, Array]:
    """Return the same for motions of different problems with as many modes and tones as `problem`, (motions, ...).

    `rows` have the shape (motions, periods, columns), `numbers` are the kernel's parameters (motions, parameters), `tables` its
    tone tables (motions, tones, columns), `added` is in scaled units.
    """
    modes, tones = len(problem.modes), len(problem.tones)
    length, a0, period = numbers[:, LENGTH], numbers[:, CONTACT], 2.0 * np.pi / numbers[:, OMEGA]
    mean = np.einsum("k,ikc->ic", weights, rows)
    pairs = mean[:, m.FIRST :: 2] + 1j * mean[:, m.FIRST + 1 :: 2]
    by_tone = pairs[:, : tones * (modes + 1)].reshape(-1, tones, modes + 1)
    of_harmonics = pairs[:, tones * (modes + 1) :][:, :harmonics]
    of_force = pairs[:, tones * (modes + 1) + harmonics :]
    tip, base = by_tone[:, :, -1], kernel.base_of(tables)
    # the base's motion was counted to each tone's own mode
    by_tone[:, range(tones), problem.own_modes] -= base
    of_harmonics[:, :1] -= base[:, :1]
    read = detected(problem, by_tone[:, :, :-1], tip, base)
    if added is not None:
        read = read + added
    total = product(read, np.exp(-1j * tables[:, :, -1])) if problem.readout.turns else read
    driver = [driving_tone(problem, n) for n in range(modes)]
    of_modes = by_tone[:, driver, range(modes)]
    lengths = length[:, None]
    work = product(of_force[:, driver], of_modes.conj()) * lengths
    z_mean = mean[:, m.Z] * length
    z_min = rows[:, :, m.Z_MIN].min(1) * length
    z_max = rows[:, :, m.Z_MAX].max(1) * length
    d_min = rows[:, :, m.D_MIN].min(1)
    values = {
        "amplitude": modulus(read) * lengths,
        "amplitude_ratio": modulus(read[:, 0]),  # lengths are in units of A0
        "phase": phase_lag(total),
        "mode_amplitude": modulus(of_modes) * lengths,
        "mode_phase": phase_lag(of_modes),
    }
    if tones == 1:
        values |= {"harmonic_amplitude": modulus(of_harmonics) * lengths, "harmonic_phase": phase_lag(of_harmonics)}
    with_base = product(of_force, base.conj()) * lengths
    if problem.tip_differs:
        values |= {"tip_amplitude": modulus(tip) * lengths, "tip_phase": phase_lag(tip)}
    if problem.shaken is not None:
        values |= {
            "base_amplitude": modulus(base) * lengths,
            "base_energy": -np.pi * (tables[:, :, 0] * with_base.imag).sum(axis=1),
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
        "contact_time": mean[:, m.IN_CONTACT] * period,
        "contact_fraction": mean[:, m.IN_CONTACT],
        "peak_velocity": rows[:, :, m.V_MAX].max(1),
        "virial": 0.5 * work.real,
        "dissipated_energy": -np.pi * work.imag,
        "total_virial": mean[:, m.F_Z] - mean[:, m.F] * z_mean - 0.5 * with_base.real.sum(axis=1),
        "total_dissipated_energy": -mean[:, m.F_V] * period,
        "apparent_dissipated_energy": apparent_energy(problem, total, numbers, tables),
        "power": -mean[:, m.F_V],
    }


def first_amplitude(problem: Problem, rows: Array, weights: Array) -> float:
    """Return the amplitude (m) at the first tone alone, as :func:`finish` does."""
    mean, length = np.einsum("k,ikc->ic", weights, rows[None]), kernel.scales(problem).length
    signal = held_signals(problem, mean, np.full((1, 1), problem.base[0] / length), of_mode=False)
    return float((modulus(signal[:, 0]) * length)[0])


def first_ratios(problem: Problem, rows: Array, weights: Array, tables: Array) -> Array:
    """Return the amplitude ratios of the first tone alone, (motions,), as :func:`finish_each` does."""
    mean = np.einsum("k,ikc->ic", weights, rows)
    return modulus(held_signals(problem, mean, kernel.base_of(tables)[:, :1], of_mode=False)[:, 0])


def held_signals(problem: Problem, mean: Array, base: Complexes, of_mode: Any) -> Complexes:
    """Return the lock-ins' readings of tones from the first on, relative to the drives and in units of A0, (motions, tones).

    That is the deflection of the tone's own mode, or the signal of the detector. Given are means of rows, (motions, columns),
    and the scaled motion of the base at these tones, (motions, tones).
    """
    count, width = base.shape[1], len(problem.modes) + 1
    pairs = mean[:, m.FIRST : m.FIRST + 2 * count * width]
    by_tone = (pairs[:, ::2] + 1j * pairs[:, 1::2]).reshape(-1, count, width)
    moves, own = by_tone[:, :, :-1], (slice(None), range(count), problem.own_modes[:count])
    moves[own] -= base
    return np.where(of_mode, moves[own], detected(problem, moves, by_tone[:, :, -1], base))


def detected(problem: Problem, moves: Complexes, tip: Complexes, base: Complexes) -> Complexes:
    """Return the detector's readings at tones from the first on, (motions, tones).

    Given are the deflections of the modes, (motions, tones, modes), the tip's motion, (motions, tones), and the base's.
    """
    if not problem.tip_differs:
        return tip
    weights = np.array(problem.readout.weights)[: moves.shape[1]]
    return np.asarray((moves * weights).sum(axis=2) + problem.readout.base * base)


def apparent_energy(problem: Problem, total: Complexes, numbers: Array, tables: Array) -> Array:
    r"""Return the energy (J) that the sample takes in a period of each tone by amplitude and phase alone, (motions, tones).

    .. math:: E = \frac{\pi k r A}{Q} (A_0 \sin\phi - A), \qquad r = \omega / \omega_0

    with the numbers of the tone's own mode, its free amplitude, and the lag behind the force. It is the energy where a force
    drives the lever at resonance, and the detector reads that mode alone.

    Source: J. P. Cleveland, B. Anczykowski, A. E. Schmid, V. B. Elings, Appl. Phys. Lett. 72, 2613 (1998).
    """
    gain = kernel.modes_of(numbers, len(problem.modes))[:, problem.own_modes, 2]
    stiffness, _, free = free_signals(problem, numbers, tables)
    if problem.shaken is None:  # a phase behind the drive counts from the force, which may lag, too
        each = range(len(problem.tones))
        force = kernel.drive_of(tables, len(problem.modes))[:, each, problem.own_modes]
        total = product(total, np.exp(np.where(tables[:, :, -1] == 0.0, -1j * np.angle(force), 0.0)))
    lost = modulus(free) * -total.imag - modulus(total) ** 2
    # k r / Q is the imaginary part of the force over the deflection
    return np.asarray(np.pi * stiffness.imag / gain * numbers[:, LENGTH, None] * lost)


def free_signals(problem: Problem, numbers: Array, tables: Array) -> tuple[Complexes, Complexes, Complexes]:
    """Return the stiffness and the free signals at each tone, (motions, tones), scaled.

    These are the force over the deflection of the tone's own mode, its free deflection, and the detector's reading of that.
    """
    count, own, each = len(problem.modes), problem.own_modes, range(len(problem.tones))
    w = np.repeat(tables[:, :, :1], count, axis=2)
    stiffness = kernel.stiffness_of(numbers[:, None], count, problem.late_fluid, w)[:, each, own]
    base, seen = kernel.base_of(tables), np.array(problem.readout.weights)[each, own]
    moved = kernel.drive_of(tables, count)[:, each, own] / stiffness - base  # as solved, it has the base in it
    return stiffness, moved, seen * moved + problem.readout.base * base


def driving_tone(problem: Problem, mode: int) -> int:
    """Return which tone drives a mode; the first one where none does."""
    return next((j for j, tone in enumerate(problem.tones) if tone.mode == mode), 0)


def multipliers(monodromy: Array) -> tuple[Array, Array]:
    """Return moduli and angles (degrees) of the eigenvalues of monodromy matrices, (matrices, size), the largest first."""
    if monodromy.shape[1] == 2:  # by hand: LAPACK takes as long for a small matrix as the orbit itself
        half = 0.5 * (monodromy[:, 0, 0] + monodromy[:, 1, 1])
        determinant = monodromy[:, 0, 0] * monodromy[:, 1, 1] - monodromy[:, 0, 1] * monodromy[:, 1, 0]
        root = np.sqrt((half * half - determinant).astype(complex))
        found = np.stack([half + root, half - root], axis=1)
    else:
        found = np.full(monodromy.shape[:2], np.nan, dtype=complex)
        known = np.isfinite(monodromy).all(axis=(1, 2))
        found[known] = np.linalg.eigvals(monodromy[known])
    found = np.take_along_axis(found, np.argsort(-modulus(found), axis=1, kind="stable"), 1)
    return modulus(found), angle(found)
