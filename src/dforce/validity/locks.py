"""Advice where the usual formulas for a frequency shift or an excitation under a lock do not apply."""

from __future__ import annotations

import numpy as np

from dforce.results.status import Status
from dforce.validity._advice import Advice, percent, shown
from dforce.validity._evidence import Evidence
from dforce.validity.laws import force_at

PULL = 0.05  # of the indentation or a0, the smaller: shift of the turning point by harmonics
FALSE = 0.1  # of the energy that a mode loses: energy that harmonics dissipate in the medium
OFF = 0.1  # of the width of the resonance: distance of the free lock from f0
LONG, STEPS = 100.0, 200  # distances, in units of a0, at which the attraction is looked at
DERIVED = "the Fourier components of the equation of motion of a mode"


def free_lock(seen: Evidence) -> Advice | None:
    """Compare the frequency of the free lock with the resonance of its mode."""
    [tone, *others] = seen.problem.tones
    if tone.lock is None or others or "phase" not in tone.lock.held:
        return None
    mode = seen.problem.modes[tone.mode]
    off = abs(tone.frequency - mode.f0) * mode.Q / mode.f0
    if off <= OFF:
        return None
    return Advice(
        "free_lock",
        off,
        OFF,
        f"The free lock is at {shown(tone.frequency, 'Hz')}, not at f0 = {shown(mode.f0, 'Hz')}. "
        "frequency_shift is relative to the free lock. Before you compare with a shift relative to f0, "
        "correct for the difference.",
        DERIVED,
        (seen.of_tone(0, "phase_set_point"), seen.of_tone(0, "signal")),
    )


def harmonics_pull(seen: Evidence) -> Advice | None:
    r"""Compare how far harmonics pull the turning point with the indentation.

    A short contact has all low harmonics :math:`2 \langle F \rangle`, and the lever answers harmonic h with :math:`-1/(k (h^2 -
    1))`: together :math:`-\tfrac{3}{2} \langle F \rangle / k`.
    """
    [tone, *others] = seen.problem.tones
    force, depth = seen.values("mean_force"), seen.amounts("max_indentation")
    if tone.lock is None or others or not depth.size or depth.shape != force.shape or not depth.any():
        return None
    pulled = 1.5 * np.abs(force) / seen.problem.modes[tone.mode].k
    share = float(np.max(pulled / np.maximum(depth, seen.problem.a0)))
    if share <= PULL:
        return None
    return Advice(
        "harmonics_pull",
        share,
        PULL,
        f"Higher harmonics move the turning point by up to {percent(share)} of the indentation. The usual formula for the "
        "frequency shift of a sinusoidal motion is not valid; this result includes the harmonics. A stiffer lever makes the "
        "effect smaller.",
        DERIVED,
        (seen.of_mode(tone.mode, "k"),),
    )


def false_dissipation(seen: Evidence) -> Advice | None:
    """Compare the energy that a mode loses at its tone with the energy that the sample takes."""
    [tone, *others] = seen.problem.tones
    of_mode, of_sample = seen.values("dissipated_energy"), seen.values("total_dissipated_energy")
    if tone.lock is None or others or not of_mode.size or of_mode.shape != of_sample.shape:
        return None
    mode = seen.problem.modes[tone.mode]
    seen_at_all = np.abs(of_mode) > 1e-3 * np.pi * mode.k * seen.free_motion(0) ** 2 / mode.Q
    if not seen_at_all.any():
        return None
    share = float(np.max(1.0 - of_sample[seen_at_all] / of_mode[seen_at_all]))
    if share <= FALSE:
        return None
    return Advice(
        "false_dissipation",
        share,
        FALSE,
        f"Up to {percent(share)} of the energy in the excitation channel is lost to the medium by higher harmonics. "
        "dissipated_energy includes it; total_dissipated_energy is the loss in the sample.",
        DERIVED,
        ("drive.operation",),
    )


def sticks(seen: Evidence) -> Advice | None:
    """Compare the largest attraction with the force of the spring at full amplitude, where a locked state ended."""
    [tone, *others], status = seen.problem.tones, seen.array("status")
    if tone.lock is None or others or (status is not None and not (status == Status.NO_STATE).any()):
        return None
    forces = [one for one in seen.problem.forces if one.leading() == ("d", "rate", "t")]
    distances = seen.problem.a0 * np.geomspace(1.0, LONG, STEPS)
    pull = -min(sum(force_at(seen, force, d, 0.0) for force in forces) for d in distances.tolist())
    spring = seen.problem.modes[tone.mode].k * seen.free_motion(0)
    if pull <= spring:
        return None
    return Advice(
        "sticks",
        pull,
        spring,
        f"The largest attraction, {shown(pull, 'N')}, exceeds the force of the spring at full amplitude, {shown(spring, 'N')}: "
        "near the sample the tip may stick, and the locked state ends. Choose a stiffer lever or a larger amplitude.",
        "F. J. Giessibl, Phys. Rev. B 56, 16010 (1997): condition against a jump to contact",
        (seen.of_mode(tone.mode, "k"), seen.of_tone(0, "A0")),
    )


def found_in_time(seen: Evidence) -> Advice | None:
    """Count the points of two tones that controllers found in time, as no torus did."""
    settling, count = seen.values("settling_periods"), seen.values("mean_deflection").size
    if not (seen.problem.is_locked and len(seen.problem.tones) > 1 and settling.size):
        return None
    return Advice(
        "found_in_time",
        settling.size,
        0.0,
        f"Controllers in time found the locked motion at {settling.size} of {count} points: the balance of harmonics did not "
        "converge or does not apply. For these points solver.accuracy has no effect. "
        'For the smallest error write solver.integrator = "engine".',
        DERIVED,
        ("forces", "solver.integrator"),
    )


PIECES = (free_lock, harmonics_pull, false_dissipation, sticks, found_in_time)
