r"""The lever with thermal motion: a stochastic step that is exact for the free lever at any length.

.. math:: m_n \ddot z_n + \frac{k_n}{\omega_n Q_n} \dot z_n + k_n z_n = \dots + \xi_n, \qquad
          \langle \xi_n(t) \xi_n(t') \rangle = \frac{2 k_B T k_n}{\omega_n Q_n} \delta(t - t')

A step has half a kick by the forces on the tip, the exact motion of the damped lever about its driven motion with the exact
noise of that time, and another half kick. So frequency, quality factor, driven amplitude and equipartition of the free
lever have no error; in contact the error is of order 2. Late fluid belongs to the lever, and adds its noise. Drag and memory
of the forces add no noise.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Complexes
from dforce.core.errors import ParameterError
from dforce.instrument import ModeNumbers
from dforce.instrument.noise import time_constant
from dforce.problem import Problem
from dforce.solvers import _langevin_loops as loops
from dforce.solvers._langevin_loops import NoisyLanes
from dforce.solvers.integrator import Integrator, Motion
from dforce.solvers.philox import WORD
from dforce.solvers.settings import SolverSettings

__all__ = ["Langevin", "NoisyLanes", "free_motion", "linear_step", "noise_root"]

ENTRIES: dict[str, Callable[..., Any]] = {"march_noisy": loops.march, "steepest": loops.steepest}
STEEP, GRID = 2e-9, 512  # m above the least distance where the force's slope is looked for, and in how many places
NODES = 32  # of the quadrature over a step: exact to rounding up to a period of the mode, and ten times in which fluid follows
LONGEST = 1.0  # contact's angular frequency times the step: beyond, the step is no motion
DEEPER = 0.05e-9  # m, that the motion gets nearer before the slope is looked for again


def free_motion(mode: ModeNumbers) -> tuple[Array, Array]:
    r"""Return the matrices A and B of a free mode that thermal noise shakes, :math:`dy/d\tau = A y + B \xi(\tau)`.

    With the angular frequency :math:`\Omega` and the damping :math:`\gamma` of the mode's oscillator, and the rates
    :math:`s_j` and weights :math:`W_j` of fluid that follows late (:class:`dforce.instrument.history.FluidMemory`)

    .. math:: \ddot z = -\Omega^2 z - \gamma \dot z + \sum_j W_j q_j + \sqrt{2 \epsilon (\gamma - \Sigma_j W_j)}\, \xi_0
              + \sum_j \sqrt{2 \epsilon W_j}\, \xi_j, \qquad
              \dot q_j = s_j (\dot z - q_j) - s_j \sqrt{2 \epsilon / W_j}\, \xi_j, \qquad \epsilon = \frac{k_B T}{m}

    with white noises :math:`\langle \xi_i(t) \xi_j(t') \rangle = \delta_{ij} \delta(t - t')`. A part of the fluid is a mass
    :math:`m W_j / s_j` on a dashpot :math:`m W_j`, whose noise pushes mass and lever apart. The vector y has z,
    :math:`\dot z` and all :math:`q_j`, in units of :math:`\sqrt{k_B T / k}` and :math:`\sqrt{k_B T / m}`; :math:`\tau` is
    :math:`\Omega t`.
    """
    frequency, Q = mode.oscillator
    own = 2.0 * math.pi * frequency
    known = ((), ()) if mode.memory is None else (mode.memory.rates, mode.memory.weights)
    rates, weights = (np.array(part, dtype=float) / own for part in known)
    late = len(rates)
    A, B = np.zeros((2 + late, 2 + late)), np.zeros((2 + late, 1 + late))
    A[0, 1], A[1, 0], A[1, 1], A[1, 2:] = 1.0, -1.0, -1.0 / Q, weights
    A[2:, 1], A[2:, 2:] = rates, -np.diag(rates)
    B[1, 0] = math.sqrt(2.0 * max(1.0 / Q - float(weights.sum()), 0.0))
    B[1, 1:] = np.sqrt(2.0 * weights)
    for j in np.flatnonzero(weights):  # fluid that weighs nothing pushes nothing
        B[2 + j, 1 + j] = -rates[j] * math.sqrt(2.0 / weights[j])
    return A, B


def linear_step(mode: ModeNumbers, h: float) -> Array:
    """Return the matrix that takes a free mode, its deflection (m), velocity and late fluid (m/s), a time (s) further."""
    from scipy.linalg import expm

    A, _ = free_motion(mode)
    own = 2.0 * math.pi * mode.oscillator[0]
    unit = np.array([1.0, *[own] * (len(A) - 1)])
    part = expm(A * (0.25 * own * h))  # of a longer time, up to a period, it would lose a digit
    return np.asarray(np.linalg.matrix_power(part, 4) * unit[:, None] / unit)


def noise_root(mode: ModeNumbers, h: float, kT: float) -> Array:
    r"""Return the lower triangular root of the covariance that noise adds to a free mode over a time (s), at an energy kT (J).

    Normal numbers times this root are that noise. Its covariance is

    .. math:: \Sigma = \int_0^h e^{A s} B B^T e^{A^T s} ds = P - M P M^T

    with the matrices of :func:`free_motion` and the covariance P in equilibrium, by quadrature: the difference is rounding
    where a step is short and Q is high. The root is taken from the terms of the quadrature, not from their sum. If the noises
    of a lever and its fluid are nearly one, the sum is singular by rounding.
    """
    from scipy.linalg import expm

    A, B = free_motion(mode)
    own = 2.0 * math.pi * mode.oscillator[0]
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    moved = expm(A * (0.5 * own * h * (nodes + 1.0))[:, None, None]) @ B
    terms = np.sqrt(0.5 * own * h * weights)[:, None, None] * moved
    _, upper = np.linalg.qr(terms.transpose(0, 2, 1).reshape(-1, len(A)))
    lower = (upper * np.where(np.diag(upper) < 0.0, -1.0, 1.0)[:, None]).T
    length = math.sqrt(kT / mode.k)
    return np.asarray(np.array([length, *[length * own] * (len(A) - 1)])[:, None] * lower)


class Langevin(Integrator):
    """Half kick, exact noisy linear step, half kick: thermal motion.

    Source: B. Leimkuhler, C. Matthews, Appl. Math. Res. Express 2013, 34 (2013), for such splittings.
    """

    name = "langevin"

    def __init__(self, problem: Problem, settings: SolverSettings, harmonics: int, points: int | None = None) -> None:
        if not problem.noise.thermal:
            raise ParameterError(
                "solver.integrator = langevin simulates thermal motion, but noise.thermal = false; choose rk4 for motion "
                "without noise"
            )
        self._looked, self._decay, self._poles = math.inf, 0.0, 0
        super().__init__(problem, settings, harmonics, points)

    def take(self, problem: Problem) -> None:
        """Go over to a problem with other numbers; see :class:`Integrator`."""
        super().take(problem)
        self.noisy = kernel.load(problem, ENTRIES)
        h, modes, late = 2.0 * math.pi / self.points / self.scales.omega, problem.modes, problem.late_fluid
        scale = np.array([self.scales.length, *[self.scales.speed] * (1 + late)])
        carry = np.array([(linear_step(mode, h) * scale / scale[:, None]).T for mode in modes])
        spread = np.array([(noise_root(mode, h, problem.noise.kT) / scale[:, None]).T for mode in modes])
        w, numbers = self.tones[:, :1], np.array(self.p)
        x = kernel.drive_of(self.tones, len(modes)) / kernel.stiffness_of(numbers, len(modes), late, w)
        fluid = kernel.fluid_amplitudes(numbers, problem, self.tones[:, 0], 1j * w * x)
        free = np.concatenate([np.stack([x, 1j * w * x], axis=-1).reshape(len(w), -1), fluid], axis=-1)
        ratios = [2.0 * math.pi * mode.oscillator[0] / self.scales.omega for mode in modes]
        gains = np.array([r**2 / (mode.k * self.scales.length) for r, mode in zip(ratios, modes, strict=True)])
        self._lever = loops.ShakenLever(self.tones, np.stack([free.real, free.imag]), carry, spread, gains)
        self._looked = math.inf

    def place(self, zc: float) -> None:
        """Go to an average distance (m)."""
        super().place(zc)
        self._looked = math.inf

    def read_by(self, bandwidth: float, poles: int) -> None:
        """Let lanes be read by a lock-in of an equivalent noise bandwidth (Hz) and so many equal poles."""
        self._decay = 1.0 / (self.points * self.problem.tones[0].frequency * time_constant(bandwidth, poles))
        self._poles = poles

    def lanes(self, starts: Sequence[Motion], seeds: Sequence[int]) -> NoisyLanes:
        """Return motions as lanes, each with the noise of its seed."""
        return NoisyLanes(
            starts[0].period,
            np.array([start.y for start in starts]),
            np.array([start.memory for start in starts]),
            np.array([start.branch for start in starts]),
            np.array([self.key(seed) for seed in seeds], dtype=np.int64),
            np.full(len(starts), np.inf),
            np.zeros((len(starts), len(self.tones), self._poles, 2)),
        )

    def key(self, seed: int) -> tuple[int, int]:
        """Return the key of the random numbers of a seed, at this distance of this problem."""
        # nine digits: the last ones of a number may depend on the machine
        text = " ".join(f"{number:.9g}" for number in (*self.p, *self.tones.ravel(), self.points))
        case = zlib.crc32(text.encode())
        return (seed & WORD) ^ case, (seed >> 32) & WORD ^ (case * 0x9E3779B1 & WORD)

    def run(self, lanes: NoisyLanes, periods: int) -> tuple[NoisyLanes, Complexes]:
        """Advance lanes; return them and the scaled complex amplitude of each at each tone, (lanes, periods, tones).

        It is the tip's amplitude in each period alone; or the detector's reading of the modes by a lock-in, see `read_by`.

        Raises
        ------
        ParameterError
            When the step is too long for the stiffness that the tip has met.
        """
        out = np.empty((len(lanes.y), periods, 2 * len(self.problem.tones)))
        after = lanes.copy()
        reading = loops.Reading(self.turns, np.array(self.problem.readout.weights), self._decay)
        march = self.noisy.entry("march_noisy")
        march(after, periods, self._lever, reading, self.kinks, self.samples, self.p, out)
        self._check_step(float(after.lowest.min()))
        return after._replace(period=lanes.period + periods), out[..., ::2] + 1j * out[..., 1::2]

    def _march(self, motion: Motion, periods: int, every: bool, out: Array) -> Motion:
        lanes = self.lanes([motion], [self.problem.noise.seed])
        if every:
            for i in range(periods):
                lanes, _ = self.run(lanes, 1)
                self.measure(motion.period + i, out[i])
        else:
            lanes, c = self.run(lanes, periods)
            out[:, ::2], out[:, 1::2] = c[0].real, c[0].imag
        y = tuple(map(float, lanes.y[0]))
        return replace(motion, y=y, memory=lanes.memory[0], branch=lanes.latched[0], period=lanes.period)

    def turn_rate(self, low: float) -> float:
        r"""Return the largest :math:`\omega_c h`, step times the tip's angular frequency in contact, down to a distance (m)."""
        memory, branch = np.zeros(self.memory_size), np.zeros(self.latch_count)
        slope = self.noisy.entry("steepest")(low, low + STEEP, GRID, memory, branch, self.kinks, self.p)
        own = max(mode.oscillator[0] / self.problem.tones[0].frequency for mode in self.problem.modes)
        return 2.0 * math.pi / self.points * math.sqrt(own**2 + slope * self._lever.gains.sum() * self.scales.length)

    def _check_step(self, low: float) -> None:
        if not math.isfinite(low) or low > self._looked - DEEPER:
            return
        self._looked = low
        # a step that is far too long throws the tip deeper than any contact is
        turn = self.turn_rate(max(low, self.problem.a0 - self.scales.length))
        if turn > LONGEST:
            wanted = 16 * math.ceil(self.points * turn / (0.3 * 16.0))
            raise ParameterError(
                f"solver.points_per_period = {self.points} is too few for the stiffness of the contact (the step turns it by "
                f"{turn:.2g} rad, at most {LONGEST:g}); use {wanted}"
            )
