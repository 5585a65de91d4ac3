"""Advice where the drive and the read-out change the meaning of amplitude and phase."""

from __future__ import annotations

import math

import numpy as np

from dforce.validity._advice import Advice, amount, percent, shown
from dforce.validity._evidence import Evidence

LOW_Q = 10.0  # there a shaken base moves by some 6 % of the amplitude
VISIBLE = 0.1  # of the free amplitude, that the base moves by
MISLED = 0.02  # of the drive's work in a period, that amplitude and phase err by
XU_RAMAN = "X. Xu, A. Raman, J. Appl. Phys. 102, 034303 (2007)"


def low_Q(seen: Evidence) -> Advice | None:
    """Compare the Q of the modes that a force drives with the Q at which a base and the fluid move visibly."""
    problem = seen.problem
    number = min((tone.mode for tone in problem.tones), key=lambda n: problem.modes[n].Q)
    mode = problem.modes[number]
    if problem.shaken is not None or mode.Q >= LOW_Q or not mode.base_coupling:
        return None
    share = 1.0 / (abs(mode.base_coupling) * math.hypot(1.0, mode.Q))
    more = " Each tap excites mode 2, too: add this mode." if len(problem.modes) == 1 else ""
    return Advice(
        "low_Q",
        mode.Q,
        LOW_Q,
        f"Mode {number + 1} has Q = {mode.Q:.3g}, and the drive is a force on the tip. A driven base (acoustic drive) "
        f"would move by {percent(share)} of the free amplitude and change phases and energies: for base excitation write "
        f'excitation = "base" under [drive].{more}',
        XU_RAMAN,
        (seen.of_mode(number, "Q"),),
    )


def base_in_liquid(seen: Evidence) -> Advice | None:
    """Compare the motion of a shaken base with the free amplitude."""
    problem = seen.problem
    shares = [abs(base) / tone.A0 for base, tone in zip(problem.base, problem.tones, strict=True)]
    number = int(np.argmax(shares))
    if problem.shaken is None or shares[number] <= VISIBLE:
        return None
    base = shown(float(abs(problem.base[number])), "m")
    in_liquid = problem.modes[problem.tones[number].mode].Q < LOW_Q
    return Advice(
        "base_in_liquid",
        shares[number],
        VISIBLE,
        f"The base moves by {base}, {percent(shares[number])} of the free amplitude: tip motion and deflection differ "
        "(tip_amplitude, tip_phase). "
        + (
            "The drive depends strongly on the share of the fluid that moves with the base. "
            "Run drive.fluid_follows = 0 and 1 before you compare with an experiment."
            if in_liquid
            else "A0 is the amplitude of the deflection; to set the motion of the base, give base_amplitude under [drive]."
        ),
        XU_RAMAN,
        ("drive.excitation", "drive.fluid_follows"),
    )


def apparent_dissipation(seen: Evidence) -> Advice | None:
    """Compare the energy from the usual formula for amplitude and phase with the energy that the sample dissipates."""
    problem = seen.problem
    if not problem.tip_differs:
        return None
    apparent, taken = (seen.amounts(f"{name}_dissipated_energy") for name in ("apparent", "total"))
    if not apparent.size or apparent.shape != taken.shape:
        return None
    tone = problem.tones[0]
    work = math.pi * tone.force * seen.free_motion(0)
    wrong = int(np.argmax(np.abs(apparent - taken)))
    off = float(abs(apparent[wrong] - taken[wrong])) / work
    if off <= MISLED:
        return None
    return Advice(
        "apparent_dissipation",
        off,
        MISLED,
        f"The usual formula from amplitude and phase gives {amount(float(apparent[wrong]), 'J')} a period, and the sample "
        f"dissipates {amount(float(taken[wrong]), 'J')}. The formula is valid only for a force drive of one mode, and its "
        "deflection. "
        "Use total_dissipated_energy, or compare apparent_dissipated_energy with an experiment.",
        "J. P. Cleveland et al., Appl. Phys. Lett. 72, 2613 (1998)",
        ("drive.excitation", "readout.kind"),
    )


PIECES = (low_Q, base_in_liquid, apparent_dissipation)
