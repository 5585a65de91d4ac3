"""The misfit of measured force and motion in the tip equation.

Over the period of a steady motion each mode's equation holds for every Fourier component, for any force:

    (k - m w^2 + i c w) X = D + f,    k <z> = <F>

with X the mode's complex amplitude at its tone, D its drive and f the component of the force there. The residual is the
error of the integration: it acts on the mode like a spurious force, and changes amplitude and phase accordingly.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Bools
from dforce.kernel.codegen import LENGTH
from dforce.observables import measure as m
from dforce.observables.finish import driving_tone
from dforce.problem import Problem

OF_MODES = ("mode_amplitude", "mode_phase", "virial", "dissipated_energy")
MEASURED = (*OF_MODES, "mean_deflection", "mean_force")  # the inputs of a misfit

GROSS = 0.02  # of the drive: more than this is refined, or no result
GAINED = 0.05  # of the energy that the drive can give in a period
HELD = 0.02  # largest difference of the mean force and the force in the lever's spring, as a share of them
FARTHEST = 2.0  # times the largest amplitude that the drives can maintain; an impact oscillator reaches 1.22 times it
PERIODS = 100  # that a motion which never repeats is measured over, at least


def misfit(problem: Problem, values: Mapping[str, Any]) -> Array:
    """Return the error as a force in units of each mode's drive: the largest over the modes, (points,).

    `values` are observables by name, with the points first, as from :func:`dforce.observables.finish.finish_each`.
    """
    tables = np.array([kernel.parameters(problem, 0.0)]), kernel.tone_table(problem)[None]
    return misfit_each(problem, values, *tables)


def misfit_each(example: Problem, values: Mapping[str, Any], numbers: Array, tones: Array) -> Array:
    """Return the same for points of different problems with as many modes and tones as an example.

    `numbers` are the kernel's parameters (points, parameters), `tones` its tone tables (points, tones, columns).
    """
    c = values["mode_amplitude"] * np.exp(-1j * np.radians(values["mode_phase"]))
    work = 2.0 * values["virial"] - 1j * values["dissipated_energy"] / np.pi
    with np.errstate(invalid="ignore", divide="ignore"):
        f = np.where(c != 0.0, work / np.conj(c), 0.0)
    base = kernel.base_of(tones) * numbers[:, LENGTH, None]
    for j, n in enumerate(example.own_modes):
        if driving_tone(example, n) == j:  # the drive in the tables acts on the mode and the base together
            c[:, n] += base[:, j]
    return _misfit(example, c, f, values["mean_deflection"], values["mean_force"], numbers, tones)


def misfit_of_rows(problem: Problem, rows: Array, weights: Array, numbers: Array, tones: Array) -> Array:
    """Return the same from the measurements over each period, (points, periods, columns)."""
    mean = np.einsum("k,ikc->ic", weights, rows)
    count, length = len(problem.modes), numbers[:, LENGTH]
    driver = [driving_tone(problem, n) for n in range(count)]
    of_modes = m.FIRST + 2 * (np.array(driver) * (count + 1) + np.arange(count))
    of_force = mean.shape[1] - 2 * len(problem.tones) + 2 * np.array(driver)
    c, f = (mean[:, place] + 1j * mean[:, place + 1] for place in (of_modes, of_force))
    return _misfit(problem, c * length[:, None], f, mean[:, m.Z] * length, mean[:, m.F], numbers, tones)


def _misfit(example: Problem, c: Any, f: Any, mean_z: Array, mean_f: Array, numbers: Array, tones: Array) -> Array:
    count, length = len(example.modes), numbers[:, LENGTH, None]
    square, _, gain = np.moveaxis(kernel.modes_of(numbers, count), 2, 0)
    driver = [driving_tone(example, n) for n in range(count)]
    drives = kernel.drive_of(tones, count)
    omega, drive = tones[:, driver, 0], drives[:, driver, np.arange(count)]
    largest = np.abs(drives / gain[:, None, :]).max(axis=(1, 2))  # of the driving forces (N)
    left = kernel.stiffness_of(numbers, count, example.late_fluid, omega) * c / length - drive - gain * f
    of_modes = np.abs(left) / np.where(drive != 0.0, np.abs(drive), gain * largest[:, None])
    compliance = (gain / square).sum(axis=1) * length[:, 0]
    of_mean = np.abs(mean_f - mean_z / compliance) / (np.abs(mean_f) + largest)
    return np.asarray(np.maximum(of_modes.max(axis=1), of_mean))


def reach(problem: Problem) -> float:
    r"""Return the amplitude (m) that the drives can maintain over a passive sample: of free motion at resonance.

    A drive :math:`F` on damping :math:`c` gives no more than the power :math:`F^2 / 2 c`; a mode whose amplitude is :math:`A`
    loses :math:`k \omega A^2 / 2 Q`.
    """
    damping = np.array([mode.k / (2.0 * np.pi * mode.f0 * mode.Q) for mode in problem.modes])
    power = float((np.abs(problem.tip_drive) ** 2 / (2.0 * damping)).sum())
    return float(sum(np.sqrt(power * mode.Q / (np.pi * mode.f0 * mode.k)) for mode in problem.modes))


def is_wrong(problem: Problem, values: Mapping[str, Any], settled: bool, repeats: bool) -> Bools:
    """Return the points with wrong numbers: they violate the tip equation or the conservation of energy.

    On long means a motion that never repeats loses no more energy than the drives supply, a passive sample supplies none, and
    the mean force bends the lever. No motion is larger than the drives can maintain. NaN is wrong, too; a motion that has not
    settled is checked for NaN alone.
    """
    wrong: Bools = ~np.isfinite(values["amplitude"]).all(axis=1)
    if settled and repeats:
        wrong |= misfit(problem, values) > GROSS
    elif settled:
        taken, forces = values["total_dissipated_energy"], np.abs(problem.tip_drive).max(axis=1)
        tip = values.get("tip_amplitude", values["amplitude"])
        slack = GAINED * np.pi * (forces @ [tone.A0 for tone in problem.tones])
        wrong |= taken > (1.0 + GAINED) * np.pi * (tip * forces).sum(axis=1) + slack
        if all(force.is_passive for force in problem.forces):
            wrong |= -taken > slack
            if problem.shaken is None:
                wrong |= values["half_peak_to_peak"] > FARTHEST * reach(problem)
        k = 1.0 / sum(1.0 / mode.k for mode in problem.modes)
        bend, held = k * values["mean_deflection"], values["mean_force"]
        passing = k * values["half_peak_to_peak"] / (np.pi * PERIODS)  # momentum that stays at the end of the record
        wrong |= np.abs(held - bend) > HELD * (np.abs(held) + np.abs(bend)) + passing
    return wrong
