r"""Noise of a periodic motion without Monte Carlo: its covariance from the tangent of each step.

Small disturbances follow the tangent of the motion. Thermal noise adds to them on the way, and a lock-in, whose poles are part
of the linear system, reads them. The covariance that repeats after a period obeys

.. math:: P = A P A^T + D

with the map A of a whole period and the covariance D that noise adds in a period. Both are products and sums over the steps.
The tangents belong to the Runge–Kutta steps, with kinks, jumps and memory of the force. Near a fold the noise grows as
:math:`1 / (1 - |\lambda|)`, until it is no longer small.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Complexes
from dforce.instrument.noise import time_constant
from dforce.integrators.loops import TAU, seconds, tabulate
from dforce.integrators.rk4 import next_sample
from dforce.kernel.vocabulary import distance, force, from_vector, mode_count, motion_size, rate_of, unpacked
from dforce.problem import Problem
from dforce.solvers.compiled import CALLED
from dforce.solvers.integrator import Integrator, Motion
from dforce.solvers.langevin import free_motion
from dforce.solvers.stability import STABLE, stability

DOUBLINGS = 60  # of the periods that are summed: with a multiplier below 1 by rounding they are still enough
ASIDE = 2e-6  # of the scale: steps are short, so that the rounding of their differences counts more than the bend of the force


@dataclass(frozen=True)
class LinearNoise:
    """The noise of a periodic motion.

    Attributes
    ----------
    state
        Covariance of deflection (m) and velocity (m/s) of each mode at the start of a period, (2 modes, 2 modes).
    quadratures
        Covariance (m^2) of real and imaginary part of the lock-in's reading at each tone, the mean over a period, (tones,
        2, 2).
    """

    state: Array
    quadratures: Array

    def amplitude_and_phase(self, read: Complexes) -> tuple[Array, Array]:
        """Return the standard deviation of amplitude (m) and phase (degrees) beside mean complex amplitudes (m)."""
        turned = np.exp(-1j * np.angle(read))
        along = np.stack([turned.real, -turned.imag], axis=-1)
        across = np.stack([turned.imag, turned.real], axis=-1)
        of_amplitude, of_phase = (
            np.sqrt(np.einsum("jk,jkl,jl->j", way, self.quadratures, way)) for way in (along, across)
        )
        return of_amplitude, np.degrees(of_phase / np.abs(read))


def linear_noise(
    integrator: Integrator, motion: Motion, periods: int, bandwidth: float, poles: int
) -> LinearNoise | None:
    """Return the noise of a motion that repeats after so many periods of the first tone; None where it is not stable.

    Parameters
    ----------
    integrator
        Runge–Kutta, at the motion's distance.
    motion
        The motion at the start of a period.
    periods
        Periods of the first tone after which it repeats.
    bandwidth, poles
        Equivalent noise bandwidth (Hz) of the lock-in, and the number of its poles.
    """
    problem, scales = integrator.problem, integrator.scales
    decay = 2.0 * math.pi / integrator.points / (time_constant(bandwidth, poles) * scales.omega)
    steps = [step for row in _periods(integrator, motion, periods) for step in _augmented(problem, *row, decay, poles)]
    size = len(steps[0][0])
    whole, added = np.eye(size), np.zeros((size, size))
    for A, D in steps:
        whole, added = A @ whole, A @ added @ A.T + D
    inner = size - 2 * len(problem.tones) * poles
    if stability(whole[:inner, :inner]) != STABLE:  # of motion and memory: the lock-in only reads them
        return None
    start = _stationary(whole, added)
    now, tones = start, len(problem.tones)
    total = np.zeros((size, size))
    for A, D in steps:
        now = A @ now @ A.T + D
        total += now
    total /= len(steps)
    count = 2 * len(problem.modes)
    units = kernel.units_of(problem, scales.length, scales.speed)[:count]
    first = size - 2 * tones
    last = total[first:, first:] * scales.length**2
    read = np.array([last[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] for j in range(tones)])
    read += 2.0 * problem.noise.detector**2 * bandwidth * np.eye(2)
    return LinearNoise(start[:count, :count] * np.outer(units, units), read)


def _stationary(whole: Array, added: Array) -> Array:
    """Return the covariance that comes back after each period: the sum over all periods before, doubled until it stays."""
    total, power = added, whole
    for _ in range(DOUBLINGS):
        more = power @ total @ power.T
        total, power = total + more, power @ power
        if np.abs(more).max() <= 1e-15 * np.abs(total).max():
            break
    return total


def _periods(integrator: Integrator, motion: Motion, periods: int) -> list[tuple[Array, Array]]:
    """Return the tangents of all steps of each period, and the phases of the tones at its start."""
    problem = integrator.problem
    tangents_of = kernel.load(problem, {"tangents": tangents}, tuple(CALLED.values())).entry("tangents")
    tip = integrator.tip("cut")
    size, states = kernel.size_of(problem), integrator.memory_size
    rows = []
    for _ in range(periods):
        bases, change = integrator.phases(motion.period), np.empty((integrator.points, size + states, size + states))
        drive = integrator.tones, bases, motion.period, integrator.points
        motion, block = integrator.record(motion)
        scale, work, ends = (
            np.maximum(integrator.sizes, 1e-300),
            np.zeros_like(integrator.work),
            np.empty((2, size + states)),
        )
        tangents_of(block, drive, integrator.kinks, scale, tip, change, work, ends)
        rows.append((change, bases))
    return rows


def tangents(block: Any, drive: Any, kinks: Any, scale: Any, tip: Any, change: Any, work: Any, ends: Any) -> None:
    """Write the derivative of the end of each step of a recorded period by its start, change[i] (numbers, numbers).

    Each is the difference of two steps that start beside the sample on both sides, cut at kinks and switches as any step is.

    Parameters
    ----------
    block
        Samples of the period, both ends included: motion, memory, branches.
    drive
        See ``loops``.
    scale
        Scale of each number of the forces' memory.
    work, ends
        Scratch: (8, memory), and (2, numbers).
    """
    (tones, bases, period, points), size, states, p = drive, motion_size(), scale.shape[0], unpacked(tip)
    table = np.empty((2 * points + 1, mode_count()))
    tabulate(tones, bases, points, table)
    memory, branch, motion = np.empty(states), np.empty(block.shape[1] - 1 - size - states), np.empty(size)
    forces = memory, branch, kinks, work
    for i in range(points):
        t = seconds(period * TAU + i * TAU / points, p)
        for e in range(size + states):
            apart = 0.0  # as the numbers have it: the steps' lengths are rounded
            for side in range(2):
                aside = ASIDE * (2.0 * side - 1.0)
                for k in range(size):
                    motion[k] = block[i, k] + (aside if k == e else 0.0)
                for k in range(states):
                    memory[k] = block[i, size + k] + (aside * scale[k] if size + k == e else 0.0)
                reached = motion[e] if e < size else memory[e - size] / scale[e - size]
                apart = reached - apart
                for k in range(branch.shape[0]):
                    branch[k] = block[i, size + states + k]
                y = from_vector(motion)
                f = force(distance(y, p), rate_of(y, p), t, memory, branch, p)
                end = next_sample(y, f, i, drive, table, forces, tip, p)
                for k in range(size):
                    ends[side, k] = end[k]
                for k in range(states):
                    ends[side, size + k] = memory[k] / scale[k]
            for k in range(size + states):
                change[i, k, e] = (ends[1, k] - ends[0, k]) / apart


def _augmented(problem: Problem, change: Array, bases: Array, decay: float, poles: int) -> list[tuple[Array, Array]]:
    """Return map and added covariance of each step, of motion, memory and lock-in together.

    The lock-in's poles follow the motion, tone after tone, real and imaginary part; `decay` is the step over their time
    constant. Between the ends of a step the deflection is a cubic.
    """
    points, inner, _ = change.shape
    h = 2.0 * math.pi / points
    tones, modes = len(problem.tones), len(problem.modes)
    outer = 2 * tones * poles
    kept, half = math.exp(-decay), math.exp(-0.5 * decay)
    place, speed = np.zeros((tones, inner)), np.zeros((tones, inner))
    place[:, : 2 * modes : 2] = problem.readout.weights
    speed[:, 1 : 2 * modes : 2] = problem.readout.weights
    before, after = 0.5 * place + h / 8.0 * speed, 0.5 * place - h / 8.0 * speed
    ratios = np.array([tone.frequency / problem.tones[0].frequency for tone in problem.tones])

    def turns(share: float) -> Array:
        angles = bases + np.multiply.outer(h * (np.arange(points) + share), ratios)
        return np.stack([np.cos(angles), -np.sin(angles)], axis=-1)  # (points, tones, 2)

    weight = decay / 3.0  # 2 z e^-iwt, by Simpson's rule
    first = weight * kept * np.einsum("ijc,jx->ijcx", turns(0.0), place)
    middle = 4.0 * weight * half * turns(0.5)
    from_start = (first + np.einsum("ijc,jx->ijcx", middle, before)).reshape(points, 2 * tones, inner)
    last = weight * np.einsum("ijc,jx->ijcx", turns(1.0), place)
    from_end = (last + np.einsum("ijc,jx->ijcx", middle, after)).reshape(points, 2 * tones, inner)
    A = np.zeros((points, inner + outer, inner + outer))
    noise_in = np.zeros((points, inner + outer, inner))  # how noise at the end of a step enters
    A[:, :inner, :inner] = change
    noise_in[:, :inner] = np.eye(inner)
    for pole in range(poles):
        rows = slice(inner + 2 * tones * pole, inner + 2 * tones * (pole + 1))
        if pole == 0:
            A[:, rows, :inner] = from_start + from_end @ change
            noise_in[:, rows] = from_end
        else:
            pre = slice(rows.start - 2 * tones, rows.start)
            A[:, rows] = 0.5 * (1.0 - kept) * A[:, pre]
            A[:, rows, pre] += 0.5 * (1.0 - kept) * np.eye(2 * tones)
            noise_in[:, rows] = 0.5 * (1.0 - kept) * noise_in[:, pre]
        A[:, rows, rows] += kept * np.eye(2 * tones)
    added = noise_in @ _step_noise(problem, change, h) @ noise_in.transpose(0, 2, 1)
    return list(zip(A, added, strict=True))


def _step_noise(problem: Problem, change: Array, h: float) -> Array:
    """Return the covariance that thermal noise adds to motion and memory over each step, by Simpson's rule."""
    inner = change.shape[1]
    strength, scale = np.zeros((inner, inner)), kernel.scales(problem)
    late = 2 * len(problem.modes) + np.arange(problem.late_fluid)
    for n, mode in enumerate(problem.modes):
        _, B = free_motion(mode)
        omega = 2.0 * math.pi * mode.oscillator[0]
        # kT / m in scaled units of velocity, per unit of time
        unit = problem.noise.kT * omega**2 / mode.k / scale.speed**2 * (omega / scale.omega)
        own = np.array([2 * n, 2 * n + 1, *(late + n * problem.late_fluid)])
        strength[np.ix_(own, own)] = unit * B @ B.T
    rest = change - np.eye(inner)
    # the root of the tangent, which leads over half a step
    root = np.eye(inner) + 0.5 * rest @ (np.eye(inner) - 0.25 * rest @ (np.eye(inner) - 0.5 * rest))
    whole = change @ strength @ change.transpose(0, 2, 1)
    return np.asarray(h / 6.0 * (strength + 4.0 * root @ strength @ root.transpose(0, 2, 1) + whole))
