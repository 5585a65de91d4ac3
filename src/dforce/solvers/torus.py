"""The steady motion under two tones that never repeat together, where two of four numbers of each tone are held.

The motion is a function of two phases, the sum of z_pq exp(i (p theta_1 + q theta_2)): a torus. The force is computed on a grid
of both phases, and the lever responds to each of its Fourier coefficients alone. Phases count from the readings of the
lock-ins, not from the drives: a drive then balances a force without turning the motion, and the equations are nearly linear.
Newton's method solves them, each step by GMRES, preconditioned by the exact matrix of the coefficients with the largest
responses.

Source: D. A. Knoll, D. E. Keyes, J. Comput. Phys. 193, 357 (2004), for Newton–Krylov methods.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.fft import fft2, irfft2, rfft2
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import LinearOperator, gmres

from dforce.core.arrays import AnyArray, Array, Complexes
from dforce.core.blas_threads import one_blas_thread
from dforce.instrument.modes import ModeNumbers

EXACT = 60  # coefficients whose matrix conditions GMRES
FARTHEST = 60, 8  # multiples of the tones among which these are
MOST_TURNS, CLOSE = 40, 1e-2  # of GMRES; of the mismatch, which it leaves
SHORTEST = 1.0 / 64.0  # of Newton's step, before the search gives up
DIFFERENCE = 1e-6  # of scaled deflection, velocity, frequency and drive: for derivatives
TONES = (np.array([1, 0]), np.array([0, 1]))  # where both tones lie among coefficients

Force = Callable[[Array, Array], Array]


class Held(NamedTuple):
    """The numbers of a tone that are held, two of four; None: the motion decides. The phase (rad) is a lag."""

    drive: float | None = None
    frequency: float | None = None
    amplitude: float | None = None
    phase: float | None = None


class TwoToneLever(NamedTuple):
    """A lever under two tones.

    Attributes
    ----------
    modes
        Its modes.
    frequency, stiffness
        Units of frequency (Hz) and stiffness (N/m); with a unit of length they scale everything else.
    acts, sees
        Share of the drive of each tone on each mode, and weight of each mode for the lock-in of each tone, (2, modes).
    """

    modes: tuple[ModeNumbers, ...]
    frequency: float
    stiffness: float
    acts: AnyArray
    sees: AnyArray

    def responses(self, omega: AnyArray) -> Complexes:
        """Return the deflection of each mode over the force on it at angular frequencies, (modes, ...)."""
        return np.stack([self.stiffness / mode.stiffness(self.frequency * omega) for mode in self.modes])

    def driven(self, omega: Array, drive: AnyArray, force: AnyArray) -> Complexes:
        """Return the complex amplitude of each mode at each tone, (2, modes), under drives and coefficients of the force."""
        return np.asarray(self.responses(omega).T * (self.acts * drive[:, None] + 2.0 * force[:, None]))


class Torus(NamedTuple):
    """A motion over both phases.

    Attributes
    ----------
    z
        Fourier coefficients of the deflection, (N1, N2 / 2 + 1) as of ``rfft2``.
    omega, drive
        Angular frequency and complex drive of each tone, (2,).
    """

    z: Complexes
    omega: Array
    drive: Complexes

    @property
    def grid(self) -> tuple[int, int]:
        """Number of phases of each tone."""
        return len(self.z), 2 * (self.z.shape[1] - 1)

    @property
    def frequencies(self) -> Array:
        """Angular frequency of each coefficient."""
        p, q = multiples(self.grid)
        return np.asarray(p * self.omega[0] + q * self.omega[1])

    @property
    def numbers(self) -> Array:
        """Frequencies and drives as real numbers, (6,)."""
        return np.concatenate([self.omega, self.drive.real, self.drive.imag])

    def with_numbers(self, numbers: Array) -> Torus:
        """Return the torus with other frequencies and drives."""
        omega, real, imaginary = np.split(numbers, 3)
        return Torus(self.z, omega, real + 1j * imaginary)

    def moved(self, way: Array) -> Torus:
        """Return the torus after a step back along a vector of real numbers: of the coefficients, then six."""
        moved = self.with_numbers(self.numbers - way[-6:])
        return moved._replace(z=self.z - way[:-6].view(complex).reshape(self.z.shape))

    def finer(self, second: bool) -> Torus:
        """Return the torus on a grid with twice the phases of the first or the second tone."""
        half, width = len(self.z) // 2, self.z.shape[1]
        z = np.zeros((2 * half, 2 * width - 1) if second else (4 * half, width), complex)
        z[:half, :width], z[-half:, :width] = self.z[:half], self.z[-half:]
        return self._replace(z=z)

    def deflection(self) -> Array:
        """Return the deflection on the grid."""
        return over_phases(self.z)

    def velocity(self) -> Array:
        """Return the velocity on the grid."""
        return over_phases(1j * self.frequencies * self.z)


@functools.lru_cache(maxsize=8)
def multiples(grid: tuple[int, int]) -> tuple[Array, Array]:
    """Return how many times both frequencies count in the frequency of each coefficient."""
    return np.asarray(np.fft.fftfreq(grid[0], 1.0 / grid[0])[:, None]), np.arange(grid[1] // 2 + 1.0)


def over_phases(coefficients: Complexes) -> Array:
    """Return the values on the grid."""
    grid = len(coefficients), 2 * (coefficients.shape[1] - 1)
    return np.asarray(irfft2(coefficients, grid, norm="forward"))


def coefficients_of(values: Array) -> Complexes:
    """Return the Fourier coefficients of values on the grid; the highest of each phase, whose sign is unknown, are 0."""
    found = rfft2(values, norm="forward")
    found[:, -1] = 0.0
    found[len(found) // 2] = 0.0
    return np.asarray(found)


def weight_of(response: Complexes) -> Array:
    """Return by how much the differences of coefficients count: as forces where the response is large."""
    return np.asarray(1.0 / np.maximum(1.0, np.abs(response)))


@dataclass(frozen=True)
class FoundTorus:
    """A torus with its force.

    Attributes
    ----------
    torus
        The motion.
    force
        Fourier coefficients of the force.
    response
        Deflection over force at each coefficient.
    differences
        Differences of the coefficients from the answers of the lever, as forces where these are large, then of held numbers
        from their values; a vector of real numbers.
    """

    torus: Torus
    force: Complexes
    response: Complexes
    differences: Array

    @property
    def needs_second(self) -> bool:
        """Whether the force is resolved worse along the phase of the second tone than along the first."""
        size, first, second = np.abs(self.force), len(self.force) // 2, self.force.shape[1] - 1
        first_tail = size[first - first // 4 : first + first // 4].sum()
        return bool(size[:, second - second // 4 :].sum() > first_tail)

    @property
    def mismatch(self) -> float:
        """The largest difference, in units of length, or of force over stiffness; not finite where the law is not."""
        return float(np.abs(self.differences).max())


@dataclass(frozen=True)
class TorusBalance:
    """The equations of a torus.

    Attributes
    ----------
    lever, held
        The lever, and the held numbers of each tone.
    force
        Function that returns the scaled force at scaled deflections and velocities.
    has_rate
        Whether the force depends on the velocity.
    """

    lever: TwoToneLever
    held: tuple[Held, Held]
    force: Force
    has_rate: bool

    def free(self, grid: tuple[int, int], omega: Array) -> Torus:
        """Return the motion without a force at two angular frequencies, on a grid of both phases."""
        read = (self.lever.driven(omega, np.ones(2), np.zeros(2)) * self.lever.sees).sum(axis=1)
        size = [one.drive or (one.amplitude or 0.0) / abs(per) for one, per in zip(self.held, read, strict=True)]
        start = Torus(np.zeros((grid[0], grid[1] // 2 + 1), complex), omega, size * np.exp(-1j * np.angle(read)))
        return start._replace(z=self.answer(start, start.z, start.z))

    @one_blas_thread()
    def find(self, start: Torus, tolerance: float, most: int = 60) -> FoundTorus:
        """Return the motion near a start; where its mismatch is not below the tolerance, none was found.

        The force is computed about `most` times at most.
        """
        exact = _largest(self.lever, start)
        now, count = self.at(start), 1
        while now.mismatch > tolerance and count < most and math.isfinite(now.mismatch):
            way, share = _Linear(self, now, exact).step(), 1.0
            after, count = self.at(now.torus.moved(way)), count + 1
            while not after.mismatch < now.mismatch and share > SHORTEST:
                share *= 0.25
                after, count = self.at(now.torus.moved(share * way)), count + 1
            now = after
        return now

    def at(self, torus: Torus) -> FoundTorus:
        """Return a torus with its force."""
        velocity = torus.velocity() if self.has_rate else np.zeros(torus.grid)
        force = coefficients_of(self.force(torus.deflection(), velocity))
        response = self.lever.responses(torus.frequencies).sum(axis=0)
        off = weight_of(response) * (torus.z - self.answer(torus, response, force))
        return FoundTorus(torus, force, response, np.append(off.ravel().view(float), self.misses(torus, force[TONES])))

    def misses(self, torus: Torus, force: Complexes) -> Array:
        """Return by how much the held numbers are missed, (6,), with coefficients of the force at the tones.

        Three for each tone: the phase of the signal, from which phases count, and the two that are held.
        """
        largest = np.abs(self.lever.responses(torus.omega)).max(axis=0)
        read, out = (self.lever.driven(torus.omega, torus.drive, force) * self.lever.sees).sum(axis=1), []
        for j, one in enumerate(self.held):
            out.append(read[j].imag / largest[j])
            if one.drive is not None:
                out.append(abs(torus.drive[j]) - one.drive)
            if one.frequency is not None:
                out.append(torus.omega[j] / one.frequency - 1.0)
            if one.amplitude is not None:
                out.append((read[j].real - one.amplitude) / largest[j])
            if one.phase is not None:
                out.append((torus.drive[j] * np.exp(-1j * one.phase)).imag)
        return np.array(out)

    def answer(self, torus: Torus, response: Complexes, force: Complexes) -> Complexes:
        """Return the coefficients of the deflection that a force and the drives lead to."""
        out = response * force
        out[TONES] += 0.5 * self.lever.driven(torus.omega, torus.drive, np.zeros(2)).sum(axis=1)
        out[-1, 0] = out[1, 0].conj()
        return out


def _largest(lever: TwoToneLever, torus: Torus) -> tuple[AnyArray, AnyArray]:
    """Return both tones and the multiples of their frequencies with the largest answers; of p, q and -p, -q one."""
    along, across = (min(most, phases // 4) for most, phases in zip(FARTHEST, torus.grid, strict=True))
    p, q = np.meshgrid(np.arange(-along, along + 1), np.arange(across + 1), indexing="ij")
    p, q = (one[(q > 0) | (p >= 0)] for one in (p, q))
    answer = np.abs(lever.responses(p * torus.omega[0] + q * torus.omega[1]).sum(axis=0))
    order = np.argsort(-answer / (1.0 + q), kind="stable")
    chosen = order[(np.arange(len(order)) < EXACT) | (np.abs(p) + q == 1)[order]]
    return np.asarray(p[chosen]), np.asarray(q[chosen])


class _Linear:
    """The equations linearized at one motion."""

    def __init__(self, balance: TorusBalance, now: FoundTorus, exact: tuple[AnyArray, AnyArray]) -> None:
        self.balance, self.now, self.exact, self.has_rate = balance, now, exact, balance.has_rate
        self.weight, torus, tones, held = weight_of(now.response), now.torus, now.force[TONES], now.differences[-6:]
        z, v = torus.deflection(), torus.velocity()
        force = balance.force(z, v)
        self.by_z = (balance.force(z + DIFFERENCE, v) - force) / DIFFERENCE
        self.by_v = (balance.force(z, v + DIFFERENCE) - force) / DIFFERENCE if self.has_rate else np.zeros((1, 1))
        others = [torus.with_numbers(torus.numbers + DIFFERENCE * unit) for unit in np.eye(6)]
        responses = [balance.lever.responses(other.frequencies).sum(axis=0) for other in others[:2]] + 4 * [
            now.response
        ]
        answers = [balance.answer(*each, now.force) for each in zip(others, responses, strict=True)]
        answered = balance.answer(torus, now.response, now.force)
        changes = [(answered - answer) / DIFFERENCE for answer in answers]
        self.by_omega, self.by_numbers = changes[:2], np.array([change[exact] for change in changes]).T
        self.held_by_numbers = np.array([(balance.misses(one, tones) - held) / DIFFERENCE for one in others]).T
        # held numbers by the real and imaginary parts of the force at the tones
        parts = DIFFERENCE * np.array([[1, 0], [0, 1], [1j, 0], [0, 1j]])
        self.held_by_force = np.array([(balance.misses(torus, tones + part) - held) / DIFFERENCE for part in parts]).T
        self.factors = lu_factor(self._matrix(), check_finite=False)

    def step(self) -> Array:
        """Return Newton's step."""
        size = len(self.now.differences)
        operator = LinearOperator((size, size), lambda x: self._differences(self._conditioned(x)), dtype=float)
        found, _ = gmres(operator, self.now.differences, rtol=CLOSE, restart=MOST_TURNS, maxiter=1)
        return self._conditioned(found)

    def _matrix(self) -> Array:
        """Return the matrix of the chosen coefficients, by their real and imaginary parts, and of the held numbers."""
        (p, q), torus = self.exact, self.now.torus
        omega, count = p * torus.omega[0] + q * torus.omega[1], len(p)
        less, more = (p[:, None] - p, q[:, None] - q), (p[:, None] + p, q[:, None] + q)
        # a change of the force with the motion is a product on the grid: each coefficient with each other and its conjugate
        by_z, by_v = fft2(self.by_z, norm="forward"), fft2(self.by_v, norm="forward")
        plain, conjugate = by_z[less], by_z[more]
        if self.has_rate:
            plain, conjugate = plain + 1j * omega * by_v[less], conjugate - 1j * omega * by_v[more]
        conjugate[:, (p == 0) & (q == 0)] = 0.0
        force = np.concatenate([plain + conjugate, 1j * (plain - conjugate)], axis=1)
        tones = np.concatenate([force[(p == first) & (q == second)] for first, second in np.transpose(TONES)])
        moved = self.now.response[p, q, None] * force
        weight = np.tile(self.weight[p, q], 2)[:, None]
        upper = np.hstack(
            [
                np.eye(2 * count) - np.vstack([moved.real, moved.imag]),
                np.vstack([self.by_numbers.real, self.by_numbers.imag]),
            ]
        )
        return np.vstack(
            [
                weight * upper,
                np.hstack([self.held_by_force @ np.vstack([tones.real, tones.imag]), self.held_by_numbers]),
            ]
        )

    def _conditioned(self, x: Array) -> Array:
        """Return the step by the matrix alone; other coefficients follow the force."""
        p, q = self.exact
        z = x[:-6].view(complex).reshape(self.now.force.shape).copy()
        way = lu_solve(self.factors, np.concatenate([z[p, q].real, z[p, q].imag, x[-6:]]), check_finite=False)
        z /= self.weight
        real, imaginary = np.split(way[:-6], 2)
        z[p, q] = real + 1j * imaginary
        z[-p[q == 0], 0] = z[p[q == 0], 0].conj()
        return np.concatenate([z.ravel().view(float), way[-6:]])

    def _differences(self, way: Array) -> Array:
        """Return the change of all differences along a step."""
        torus = self.now.torus
        first, second, *drives = way[-6:]
        drive = np.array(drives[:2]) + 1j * np.array(drives[2:])
        change = torus._replace(z=way[:-6].view(complex).reshape(torus.z.shape), drive=drive)
        force = self.by_z * change.deflection()
        if self.has_rate:
            force += self.by_v * change.velocity()
        pushed = coefficients_of(force)
        off = change.z - self.balance.answer(change, self.now.response, pushed)
        off += first * self.by_omega[0] + second * self.by_omega[1]
        tones = pushed[TONES]
        held = self.held_by_force @ np.concatenate([tones.real, tones.imag]) + self.held_by_numbers @ way[-6:]
        return np.concatenate([(self.weight * off).ravel().view(float), held])
