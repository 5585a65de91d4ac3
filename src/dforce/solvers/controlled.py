r"""The motion under a phase-locked loop and an amplitude control as they act in time, one period after the other.

The oscillator of the loop sets the period. At its end the lock-in gives amplitude and phase, and two controllers with a
proportional and an integral part correct frequency and drive by the errors of the phase, e, and of the amplitude as a share,
:math:`\epsilon`

.. math:: \omega = \omega_I - b\, e, \quad \dot\omega_I = -\frac{\omega_0}{2 Q}\, b\, e, \qquad
          F = F_I + \frac{k A}{Q} \frac{2 Q}{\omega_0}\, a\, \epsilon, \quad \dot F_I = \frac{k A}{Q}\, a\, \epsilon

The zero of each controller cancels the pole of the lever: far from the sample both loops respond like :math:`b / s` and
:math:`a / s` at any quality factor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array
from dforce.engine.marching import Marcher, Start
from dforce.observables.finish import held_signal
from dforce.problem import Problem
from dforce.solvers.integrator import HARMONIC, Motion
from dforce.solvers.settings import SolverSettings
from dforce.solvers.transient import CancelCheck, never_cancelled

FILTERED = 5.0  # times the larger bandwidth of the controllers: that of the low-pass behind the lock-in
LONGEST = 1000.0  # response times of the slower controller, and of the lever: then the loops are given up


@dataclass(frozen=True)
class Controllers:
    """What two controllers hold, and how fast.

    Attributes
    ----------
    phase, amplitude
        Set points (rad, m); None: that controller is off.
    phase_bandwidth, amplitude_bandwidth
        Hz.
    order
        Stages of the low-pass behind the lock-in; 0: it gives the mean over a period.
    of_mode
        Whether the lock-in reads the tone's own mode; otherwise the detector's signal.
    """

    phase: float | None
    amplitude: float | None
    phase_bandwidth: float
    amplitude_bandwidth: float
    order: int = 0
    of_mode: bool = False

    @property
    def rates(self) -> tuple[float, float]:
        """Inverse response times of both controllers (rad/s); 0 of one that is off."""
        rates = ((self.phase, self.phase_bandwidth), (self.amplitude, self.amplitude_bandwidth))
        b, a = (0.0 if held is None else 2.0 * math.pi * bandwidth for held, bandwidth in rates)
        return b, a

    def filtered(self, read: complex, stages: list[complex], period: float) -> complex:
        """Return what the low-pass gives after a period (s), and let its stages follow."""
        if stages:
            corner = FILTERED * max(self.rates) / math.sqrt(2.0 ** (1.0 / len(stages)) - 1.0)
            for k in range(len(stages)):
                stages[k] -= math.expm1(-corner * period) * (read - stages[k])
                read = stages[k]
        return read


class Followed(NamedTuple):
    """Motion under the controllers.

    Attributes
    ----------
    frequency, ratio, amplitude, phase
        Frequency (Hz), drive as a multiple of that at the start, amplitude (m) and phase (rad) in each period.
    problem
        The problem at the last frequency and drive.
    motion
        At the end, scaled as this problem is.
    settled
        Whether both loops came to rest.
    """

    frequency: Array
    ratio: Array
    amplitude: Array
    phase: Array
    problem: Problem
    motion: Motion
    settled: bool


def follow(
    problem: Problem,
    zc: float,
    start: Motion,
    loops: Controllers,
    settings: SolverSettings,
    check_cancelled: CancelCheck = never_cancelled,
) -> Followed:
    """Follow a motion at an average distance (m) until both loops have settled.

    Errors of phase (rad) and amplitude (as a share) are then below `settle_tolerance` for a response time of the slower one.
    """
    tone, mode = problem.tones[0], problem.modes[problem.tones[0].mode]
    (b, a), pole = loops.rates, math.pi * mode.f0 / mode.Q
    unit = mode.k * (loops.amplitude or tone.A0) / mode.Q / tone.force
    slowest = min(rate for rate in (b, a, pole) if rate)
    omega = middle = 2.0 * math.pi * tone.frequency
    ratio = push = 1.0
    marcher, places = Marcher.of(problem), np.unique(np.append(kernel.kink_distances(problem), problem.a0))[None]
    limits = (settings.relative_tolerance, math.inf, HARMONIC * settings.relative_tolerance)
    motion, stages, rows, calm, time = start, [0j] * loops.order, [], 0.0, 0.0
    there, unit_before = problem, kernel.units_of(problem, *_units(problem))
    while calm * slowest < 1.0 and time * slowest < LONGEST and motion.is_finite:
        check_cancelled()
        there, period = problem.driven(omega / (2.0 * math.pi), ratio), 2.0 * math.pi / omega
        units = kernel.units_of(problem, *_units(there))
        numbers, tones = np.array([kernel.parameters(there, zc)]), kernel.tone_table(there)[None]
        x = np.array([motion.y]) * unit_before / units
        found = marcher.march(
            Start(numbers, tones, places, x, motion.memory[None], motion.latched[None]), 1, limits, harmonics=0
        )
        motion = Motion(tuple(found.path[0, -1].tolist()), found.memory[0], found.branch[0], 0)
        unit_before, time = units, time + period
        read = complex(held_signal(there, found.rows[0], kernel.base_of(tones)[:, 0], loops.of_mode)[0]) * tone.A0
        read = loops.filtered(read, stages, period)
        rows.append((omega / (2.0 * math.pi), ratio, abs(read), -np.angle(read)))
        e = 0.0 if loops.phase is None else rows[-1][3] - loops.phase
        short = 0.0 if loops.amplitude is None else 1.0 - rows[-1][2] / loops.amplitude
        middle, push = middle - b * pole * e * period, push + unit * a * short * period
        omega, ratio = middle - b * e, push + unit * a / pole * short
        calm = calm + period if max(abs(e), abs(short)) < settings.settle_tolerance else 0.0
    frequency, drive, amplitude, phase = np.array(rows).T
    return Followed(frequency, drive, amplitude, phase, there, motion, calm * slowest >= 1.0)


def _units(problem: Problem) -> tuple[float, float]:
    scale = kernel.scales(problem)
    return scale.length, scale.speed
