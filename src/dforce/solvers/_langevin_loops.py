"""The compiled steps of a lever with thermal motion; see ``langevin``. `forces` is described in ``integrators.loops``."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from dforce.integrators.events import risen
from dforce.integrators.loops import TAU, keep_rest, phases, seconds
from dforce.kernel.codegen import SPEED
from dforce.kernel.vocabulary import (
    distance,
    evolve,
    fluid_size,
    force,
    from_vector,
    keep,
    latch_count,
    memory_size,
    mode_count,
    motion_size,
    rate_of,
)
from dforce.observables.lockin import lock_in
from dforce.solvers.philox import normals


class NoisyLanes(NamedTuple):
    """Motions of one problem at the start of a period, each with its own random numbers.

    Attributes
    ----------
    period
        Periods of the first tone since the start, the same for all.
    y, memory, latched
        Scaled motions, memories and branches, a row each.
    keys
        Keys of the random numbers, which depend on them and the count of steps, (lanes, 2).
    lowest
        Least distance so far (m), (lanes,).
    lock_ins
        Values of the poles of a lock-in, (lanes, tones, poles, 2); without poles each period is read by itself.
    """

    period: int
    y: Any
    memory: Any
    latched: Any
    keys: Any
    lowest: Any
    lock_ins: Any

    def part(self, which: Any) -> NoisyLanes:
        """Return some of them."""
        return NoisyLanes(self.period, *(one[which] for one in self[1:]))

    def copy(self) -> NoisyLanes:
        """Return a copy, to be advanced."""
        return NoisyLanes(self.period, *(one.copy() for one in self[1:]))


class ShakenLever(NamedTuple):
    """The lever without forces: drive, motion and noise.

    Attributes
    ----------
    tones
        The kernel's tone table.
    free
        Complex amplitudes of the steady motion, real and imaginary parts, (2, tones, numbers).
    carry, spread
        For each mode: the linear step of its deflection, velocity and late fluid, and the root of the covariance that noise
        adds; results along rows, (modes, numbers, numbers).
    gains
        Acceleration of each mode for each newton on the tip.
    """

    tones: Any
    free: Any
    carry: Any
    spread: Any
    gains: Any


class Reading(NamedTuple):
    """How a lock-in reads the motion.

    Attributes
    ----------
    turns
        Of the tones, see ``observables.lockin``.
    weights
        How it sees each mode at each tone, (tones, modes).
    decay
        Step over the time constant of its poles.
    """

    turns: Any
    weights: Any
    decay: float


def march(lanes: Any, periods: int, lever: Any, reading: Any, kinks: Any, samples: Any, p: Any, out: Any) -> None:
    """Advance lanes by whole periods; out[j, i] holds the lock-in of lane j over period i, see ``lock_in``.

    `samples` is scratch, which holds the samples of the last period of the last lane in the end.
    """
    tones, turns = lever.tones, reading.turns
    points = turns.cosine.shape[1] - 1
    bases, z, change = np.empty(tones.shape[0]), np.empty(points + 1), np.empty((2, max(lanes.memory.shape[1], 1)))
    steady = np.empty((points + 1, motion_size()))
    for i in range(periods):
        phases(tones, lanes.period + i, bases)
        if i == 0 or tones.shape[0] > 1:  # the first tone alone repeats every period
            tabulate_free(tones, bases, lever.free, steady)
        for j in range(lanes.y.shape[0]):
            forces = lanes.memory[j], lanes.latched[j], kinks, change
            least = advance(lanes.y[j], forces, lanes.keys[j], lanes.period + i, lever, steady, samples, p)
            lanes.lowest[j] = min(lanes.lowest[j], least)
            if lanes.lock_ins.shape[2] == 0:
                lock_in(samples, turns, bases, z, out[j, i])
            else:
                low_pass(samples, reading, bases, lanes.lock_ins[j], out[j, i])


def low_pass(samples: Any, reading: Any, bases: Any, held: Any, out: Any) -> None:
    """Take a lock-in over a period; write the mean of its last pole at each tone, real and imaginary part.

    Readings of single periods, once a period, are not the same: noise at twice the frequency would count as slow noise.
    """
    turns, weights, decay = reading
    points, kept = turns.cosine.shape[1] - 1, math.exp(-decay)
    for j in range(bases.shape[0]):
        c, s = math.cos(bases[j]), math.sin(bases[j])
        out[2 * j], out[2 * j + 1] = 0.0, 0.0
        before = np.zeros(2)
        for i in range(points + 1):
            z = 0.0
            for n in range(mode_count()):
                z += weights[j, n] * samples[i, 2 * n]
            cosine, sine = turns.cosine[j, i], turns.sine[j, i]
            for part in range(2):
                now = 2.0 * z * (cosine * c - sine * s if part == 0 else -(sine * c + cosine * s))
                first, last = before[part], now
                before[part] = now
                if i == 0:
                    continue
                for pole in range(held.shape[1]):
                    was = held[j, pole, part]
                    held[j, pole, part] = kept * was + (1.0 - kept) * 0.5 * (first + last)
                    first, last = was, held[j, pole, part]
                out[2 * j + part] += last / points


def tabulate_free(tones: Any, bases: Any, free: Any, steady: Any) -> None:
    """Write the steady motion without forces at the ends of all steps of a period."""
    points = steady.shape[0] - 1
    for i in range(points + 1):
        for k in range(motion_size()):
            steady[i, k] = 0.0
        for j in range(tones.shape[0]):
            angle = tones[j, 0] * TAU * i / points + bases[j]
            c, s = math.cos(angle), math.sin(angle)
            for k in range(motion_size()):
                steady[i, k] += free[0, j, k] * c - free[1, j, k] * s


def advance(y: Any, forces: Any, keys: Any, period: int, lever: Any, steady: Any, samples: Any, p: Any) -> float:
    """Advance one lane by a period; return its least distance (m). samples[i] holds sample i, both ends included."""
    points, (memory, branch, kinks, _), gains = steady.shape[0] - 1, forces, lever.gains
    h = TAU / points
    start, dt, total = seconds(period * TAU, p), seconds(h, p), gains.sum()
    random, ahead, least, mean = np.empty(motion_size()), np.empty(own_size()), math.inf, 0.0
    for i in range(points):
        t = start + i * dt
        f = kick(y, 0.5 * h, t, forces, total, p)
        before = from_vector(y)
        keep(samples, i, before)
        keep_rest(samples, i, memory, branch, f)
        push(y, 0.5 * h * f, gains)
        before = from_vector(y)
        normals(period * points + i, keys[0], keys[1], random)
        drift(y, i, steady, lever, random, ahead)
        after = from_vector(y)
        least = min(least, distance(after, p))
        share = passed_kink(distance(before, p), distance(after, p), kinks)
        if share > 0.0:
            # the step again, with the impulse of its whole way: else how disturbances pass the kink has an error of order 1
            mean = mean_force(before, after, share, t, forces, p)
            for k in range(motion_size()):
                y[k] = samples[i, k]
            push(y, 0.5 * h * mean, gains)
            drift(y, i, steady, lever, random, ahead)
            after = from_vector(y)
        if memory_size(memory):
            advance_memory(before, after, h, t, forces, p)
        for _ in range(latch_count(branch)):
            which = risen(after, t + dt, branch, p)
            if which >= 0:
                branch[which] = 1.0 - branch[which]
        if share > 0.0:
            push(y, 0.5 * h * mean, gains)
        else:
            push(y, 0.5 * h * kick(y, 0.5 * h, t + dt, forces, total, p), gains)
    end = from_vector(y)
    f = force(distance(end, p), rate_of(end, p), start + points * dt, memory, branch, p)
    keep(samples, points, end)
    keep_rest(samples, points, memory, branch, f)
    return min(least, distance(end, p))


def drift(y: Any, i: int, steady: Any, lever: Any, random: Any, ahead: Any) -> None:
    """Take the motion about the driven one over step i, exactly, with its noise; `ahead` is scratch."""
    for n in range(mode_count()):
        for k in range(own_size()):
            ahead[k] = steady[i + 1, place(n, k)]
        for m in range(own_size()):
            here, shaken = y[place(n, m)] - steady[i, place(n, m)], random[place(n, m)]
            for k in range(own_size()):
                ahead[k] += lever.carry[n, m, k] * here + lever.spread[n, m, k] * shaken
        for k in range(own_size()):
            y[place(n, k)] = ahead[k]


def own_size() -> int:
    """Return how many numbers of a motion belong to one mode: its deflection, velocity and late fluid."""
    return motion_size() // mode_count()


def place(n: int, k: int) -> int:
    """Return the place in a motion of number k of mode n."""
    return 2 * n + k if k < 2 else 2 * mode_count() + n * (fluid_size() // mode_count()) + k - 2


def passed_kink(d0: float, d1: float, kinks: Any) -> float:
    """Return the share of the way between two distances at which the first kink lies, or 0."""
    share = 0.0
    for kink in kinks:
        if (d0 > kink) != (d1 > kink):
            here = (kink - d0) / (d1 - d0)
            share = here if share == 0.0 else min(share, here)
    return share


def mean_force(before: Any, after: Any, share: float, t: float, forces: Any, p: Any) -> float:
    """Return the mean force (N) along a way that passes a kink, by Simpson's rule before and behind it."""
    (memory, branch, _, _), total, aside = forces, 0.0, 1e-9
    d0, v0, d1, v1 = distance(before, p), rate_of(before, p), distance(after, p), rate_of(after, p)
    for part in range(2):
        first, width = (0.0, share - aside) if part == 0 else (share + aside, 1.0 - share - aside)
        for node in range(3):
            s = first + 0.5 * node * width
            f = force(d0 + s * (d1 - d0), v0 + s * (v1 - v0), t, memory, branch, p)
            total += width / 6.0 * f * (4.0 if node == 1 else 1.0)
    return total


def kick(y: Any, h: float, t: float, forces: Any, gain: float, p: Any) -> float:
    """Return the mean force (N) of a kick of a scaled duration at one place: that in its middle, for the velocity changes."""
    now, (memory, branch, _, _) = from_vector(y), forces
    d, rate = distance(now, p), rate_of(now, p)
    f = force(d, rate, t, memory, branch, p)
    return force(d, rate + 0.5 * h * p[SPEED] * gain * f, t, memory, branch, p)


def push(y: Any, impulse: float, gains: Any) -> None:
    """Add an impulse, force times scaled time, to the velocity of each mode."""
    for n in range(mode_count()):
        y[2 * n + 1] += gains[n] * impulse


def advance_memory(before: Any, after: Any, h: float, t: float, forces: Any, p: Any) -> None:
    """Advance the forces' memory over a step by the midpoint rule."""
    memory, _, _, change = forces
    d0, v0, d1, v1 = distance(before, p), rate_of(before, p), distance(after, p), rate_of(after, p)
    evolve(d0, v0, t, memory, change[0], p)
    for k in range(memory_size(memory)):
        change[1, k] = memory[k] + 0.5 * h * change[0, k]
    middle = t + seconds(0.5 * h, p)
    evolve(0.5 * (d0 + d1), 0.5 * (v0 + v1), middle, change[1], change[0], p)
    for k in range(memory_size(memory)):
        memory[k] += h * change[0, k]


def steepest(low: float, high: float, count: int, memory: Any, branch: Any, kinks: Any, p: Any) -> float:
    """Return the largest slope (N/m) of the force at rest against the distance, on a grid, jumps at kinks left out.

    The first interval is a small one at the lower end: a stiff contact is not deeper than the others are wide.
    """
    most = 0.0
    for i in range(count + 1):
        width = (high - low) / count if i else 1e-4 * (high - low) / count
        d = low + max(i - 1, 0) * width
        broken = False
        for kink in kinks:
            broken |= d <= kink <= d + width
        if not broken:
            rise = force(d + width, 0.0, 0.0, memory, branch, p) - force(d, 0.0, 0.0, memory, branch, p)
            most = max(most, abs(rise) / width)
    return most
