"""Exact balances of force, virial and energy that every steady motion obeys.

Left sides come from the force along the motion, right sides from the motion alone, so that they check integrators, lock-in
and averages at once.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from dforce.case import Case, example
from dforce.checks.validation.checks import Check, ValidationPart
from dforce.checks.validation.comparison import find
from dforce.experiments import InitialMotion
from dforce.experiments.base import Start
from dforce.observables.averaging import window_length
from dforce.observables.finish import driving_tone
from dforce.problem import Problem

TAU = 2.0 * math.pi
LEAST = 0.01  # of the free amplitude: balances of smaller motions are relative to the work that this would take
FORCE, ENERGY = 1e-4, 1e-5  # errors of 4096 samples over the kinks of the strongest contacts
SOURCES = {
    "mean force": "A. San Paulo, R. Garcia, Phys. Rev. B 64, 193411 (2001): Σ 1/k_n ⟨F⟩ = ⟨z⟩",
    "virial": "J. R. Lozano, R. Garcia, Phys. Rev. Lett. 100, 076102 (2008): ½ k A [(1 - r²) A - (F/k) cos φ]",
    "energy": "J. P. Cleveland et al., Appl. Phys. Lett. 72, 2613 (1998): π F A sin φ - π k r A²/Q",
    "total energy": "work of the drives minus loss by the damping of the modes",
    "conserved energy": "a force of the distance alone dissipates nothing in a period",
    "multipliers": "Liouville: for a force of the distance alone their product is exp(-Σ ω_n T / Q_n)",
}
SIZES = {
    "mean force": "⟨F⟩ and 0.01 F0",
    "virial": "π F A",
    "energy": "π F A",
    "total energy": "π Σ F A",
    "conserved energy": "π Σ F A",
    "multipliers": "1",
}
TEXT = (
    "Balances of every steady motion, for any force, on the shipped examples at 4096 samples a period. Each is relative to "
    "the named size. Mean forces must close to 1e-4, energies to 1e-5 of the drive's work."
)
POINTS = 4096
EXAMPLES: tuple[tuple[str, float, Start], ...] = (
    ("figure-2", 0.5e-9, InitialMotion(amplitude="0.52 nm", phase="32 deg")),
    ("figure-3-air", 8e-9, InitialMotion(amplitude="8.3 nm", phase="56 deg")),
    ("figure-3-air", 8e-9, InitialMotion(amplitude="7.8 nm", phase="128 deg")),
    ("figure-3-air-jump", 9e-9, "free"),
    ("figure-3-water", 5e-9, "free"),
    ("figure-4-hard", 5e-9, "free"),
    ("figure-4-soft", 5e-9, "free"),
    ("figure-5", 0.2e-9, "free"),
    ("table-1-am", 4e-9, "free"),
    ("figure-6", 8e-9, "free"),
    ("figure-7-low", 12e-9, "free"),
    ("figure-7-high", 12e-9, "free"),
)
QUICK = ("figure-2", "figure-3-air", "figure-5", "figure-6")


def closures(problem: Problem, values: Mapping[str, Any], mean_squares: Any) -> dict[str, float]:
    """Return by how much each balance fails to close, relative to its size of :data:`SIZES`."""
    out = {}
    bend = float(values["mean_deflection"]) / sum(1.0 / mode.k for mode in problem.modes)
    mean_force = float(values["mean_force"])
    out["mean force"] = abs(mean_force - bend) / (abs(mean_force) + 0.01 * problem.tones[0].force)
    virials, energies, works = [], [], []
    for n, mode in enumerate(problem.modes):
        j = driving_tone(problem, n)
        r, a = problem.tones[j].frequency / mode.f0, float(values["mode_amplitude"][n])
        given = problem.drive[j, n] * a * cmath.exp(1j * math.radians(float(values["mode_phase"][n])))
        virial = 0.5 * mode.k * (1.0 - r * r) * a * a - 0.5 * given.real
        energy = math.pi * given.imag - math.pi * mode.k * r * a * a / mode.Q
        # a tip that is stuck moves next to nothing
        work = math.pi * abs(problem.tip_drive[j, n]) * max(a, LEAST * problem.tones[j].A0)
        virials.append(abs(float(values["virial"][n]) - virial) / work)
        energies.append(abs(float(values["dissipated_energy"][n]) - energy) / work)
        works.append(work)
    out["virial"], out["energy"] = max(virials), max(energies)
    damping = sum(m.k / (TAU * m.f0 * m.Q) * v2 for m, v2 in zip(problem.modes, mean_squares, strict=True))
    total, period = float(values["total_dissipated_energy"]), 1.0 / problem.tones[0].frequency
    power = sum(
        0.5 * TAU * tone.frequency * float((drive * moved.conj()).imag.sum())
        for tone, drive, moved in zip(problem.tones, problem.tip_drive, _moves(problem, values), strict=True)
    )
    out["total energy"] = abs(total - (power - damping) * period) / sum(works)
    if not any(force.dissipative or force.timed for force in problem.forces):
        out["conserved energy"] = abs(total) / sum(works)
        if "multiplier_modulus" in values:
            out["multipliers"] = _area(problem, np.asarray(values["multiplier_modulus"]))
    return out


def _moves(problem: Problem, values: Mapping[str, Any]) -> Any:
    """Return the complex amplitude (m) of each mode at each tone, in the solver's coordinates, (tones, modes).

    A force on all modes works on the tip alone: there the first mode has the tip's motion. Otherwise it follows only for one
    tone, or for two modes with a tone on each.
    """
    base, tones, modes = problem.base, len(problem.tones), len(problem.modes)
    names = ("tip_amplitude", "tip_phase") if problem.tip_differs else ("amplitude", "phase")
    tip = np.asarray(values[names[0]]) * np.exp(-1j * np.radians(values[names[1]]))
    own = np.asarray(values["mode_amplitude"]) * np.exp(-1j * np.radians(values["mode_phase"]))
    moves = np.zeros((tones, modes), dtype=complex)
    if problem.shaken is None and problem.acts_on == "all_modes":
        moves[:, 0] = tip
    elif tones == 1:
        moves[0] = own
        moves[0, problem.tones[0].mode] += base[0]
    elif modes == 2 and sorted(problem.own_modes) == [0, 1]:
        for j, n in enumerate(problem.own_modes):
            moves[j, n] = own[n] + base[j]
            moves[j, 1 - n] = tip[j] - moves[j, n]
    else:
        moves[:] = np.nan
    return moves


def _area(problem: Problem, multipliers: Any) -> float:

    seconds = window_length([tone.frequency for tone in problem.tones]) / problem.tones[0].frequency
    kept = math.exp(-sum(TAU * mode.f0 / mode.Q for mode in problem.modes) * seconds)
    return abs(float(np.prod(multipliers)) - kept)


def limit(name: str) -> float:
    """Return the limit of a balance."""
    return FORCE if name == "mean force" else 1e-6 if name == "multipliers" else ENERGY


def on_example(name: str, zc: float, start: Start) -> Iterator[Check]:
    """Give the balances of a shipped example at a distance."""
    case: Case = example(name)
    found = find(case, zc, POINTS, start)
    if found is None:
        raise ArithmeticError(f"the example {name} does not settle at {zc} m")
    lag = float(found.values["phase"][0])
    for balance, error in closures(case.problem, found.values, found.mean_squares()).items():
        where = f"{name}, {1e9 * zc:g} nm, φ = {lag:.1f}°"
        yield Check(balance, where, error, None, "1", error, limit(balance), SOURCES[balance], f"of {SIZES[balance]}")


def part(quick: bool) -> ValidationPart:
    """Return this part of the validation."""
    chosen = [row for row in EXAMPLES if not quick or row[0] in QUICK]
    checks = [check for row in chosen for check in on_example(*row)]
    checks.sort(key=lambda check: list(SOURCES).index(check.group))
    return ValidationPart("identities", "Exact identities", TEXT, tuple(checks), {})
