"""The compiled steps of a lever that thermal motion shakes; see ``langevin``."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.integrators.loops import TAU, phases, risen, seconds
from dforce.kernel.vocabulary import (
    distance,
    evolve,
    fluid_size,
    force,
    from_vector,
    latch_count,
    memory_size,
    mode_count,
    motion_size,
    rate_of,
)
from dforce.observables.lockin import lock_in_turned
from dforce.solvers.philox import normals


def march(
    ys: Any,
    memories: Any,
    branches: Any,
    keys: Any,
    first: int,
    periods: int,
    tones: Any,
    free: Any,
    carry: Any,
    spread: Any,
    gains: Any,
    p: Any,
    kinks: Any,
    block: Any,
    turns: Any,
    weights: Any,
    decay: float,
    lock_ins: Any,
    out: Any,
    lowest: Any,
) -> None:
    """Advance lanes by whole periods; out[j, i] holds the lock-in of lane j over period i, see ``lock_in_turned``.

    Parameters
    ----------
    ys, memories, branches
        Scaled motions, memories and branches of the lanes at the start, then at the end, (lanes, numbers).
    keys
        Two words for each lane, (lanes, 2): what its random numbers depend on, beside the count of its steps.
    free
        Complex amplitudes of the steady motion without forces, real and imaginary parts, (2, tones, numbers).
    carry, spread
        Of each mode: the linear step of its free motion, and the root of the covariance that noise adds to it, of deflection,
        velocity and late fluid: what each leads to stands in a row, (modes, numbers, numbers).
    gains
        Acceleration of each mode for each newton on the tip.
    weights, decay, lock_ins
        How a lock-in sees each mode at each tone, (tones, modes); the step over the time constant of its poles; what these
        hold, (lanes, tones, poles, 2): without poles each period is read by itself.
    block
        Scratch, which holds the samples of the last period of the last lane in the end.
    lowest
        Least distance (m) of each lane; lowered.
    """
    points = turns.cosine.shape[1] - 1
    bases, z, change = np.empty(tones.shape[0]), np.empty(points + 1), np.empty((2, max(memory_size(), 1)))
    steady = np.empty((points + 1, motion_size()))
    for i in range(periods):
        phases(tones, first + i, bases)
        if i == 0 or tones.shape[0] > 1:  # the first tone alone repeats every period
            tabulate_free(tones, bases, free, steady)
        for j in range(ys.shape[0]):
            least = advance(
                ys[j],
                memories[j],
                branches[j],
                keys[j, 0],
                keys[j, 1],
                first + i,
                steady,
                carry,
                spread,
                gains,
                p,
                kinks,
                change,
                block,
            )
            lowest[j] = min(lowest[j], least)
            if lock_ins.shape[2] == 0:
                lock_in_turned(block, turns, bases, z, out[j, i])
            else:
                low_pass(block, turns, bases, weights, decay, lock_ins[j], out[j, i])


def low_pass(block: Any, turns: Any, bases: Any, weights: Any, decay: float, held: Any, out: Any) -> None:
    """Take a lock-in over a period; write the mean of its last pole at each tone, real and imaginary part.

    What a period alone would say, once a period, is not the same: noise at twice the frequency would count as if it were slow.
    """
    points, kept = turns.cosine.shape[1] - 1, math.exp(-decay)
    for j in range(bases.shape[0]):
        c, s = math.cos(bases[j]), math.sin(bases[j])
        out[2 * j], out[2 * j + 1] = 0.0, 0.0
        before = np.zeros(2)
        for i in range(points + 1):
            z = 0.0
            for n in range(mode_count()):
                z += weights[j, n] * block[i, 2 * n]
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


def advance(
    y: Any,
    memory: Any,
    branch: Any,
    k0: int,
    k1: int,
    period: int,
    steady: Any,
    carry: Any,
    spread: Any,
    gains: Any,
    p: Any,
    kinks: Any,
    change: Any,
    block: Any,
) -> float:
    """Advance one lane by a period; return its least distance (m). block[i] holds sample i, both ends included."""
    points = steady.shape[0] - 1
    h = TAU / points
    start, dt, total = seconds(period * TAU, p), seconds(h, p), gains.sum()
    random, ahead, least, mean = np.empty(motion_size()), np.empty(own_size()), math.inf, 0.0
    for i in range(points):
        t = start + i * dt
        f = kick(y, 0.5 * h, t, memory, branch, gains, total, p)
        keep_sample(block, i, y, memory, branch, f)
        push(y, 0.5 * h * f, gains)
        before = from_vector(y)
        d, rate = distance(before, p), rate_of(before, p)
        normals(period * points + i, k0, k1, random)
        drift(y, i, steady, carry, spread, random, ahead)
        after = from_vector(y)
        least = min(least, distance(after, p))
        share = passed_kink(d, distance(after, p), kinks)
        if share > 0.0:
            # the step again, with the impulse of its whole way: else how disturbances pass the kink has an error of order 1
            mean = mean_force(d, rate, distance(after, p), rate_of(after, p), share, t, memory, branch, p)
            take_back(block, i, y)
            push(y, 0.5 * h * mean, gains)
            drift(y, i, steady, carry, spread, random, ahead)
            after = from_vector(y)
        if memory_size():
            remember(d, rate, distance(after, p), rate_of(after, p), h, t, memory, branch, change, p)
        for _ in range(latch_count()):
            which = risen(after, t + dt, branch, p)
            if which >= 0:
                branch[which] = 1.0 - branch[which]
        if share > 0.0:
            push(y, 0.5 * h * mean, gains)
        else:
            push(y, 0.5 * h * kick(y, 0.5 * h, t + dt, memory, branch, gains, total, p), gains)
    end = from_vector(y)
    f = force(distance(end, p), rate_of(end, p), start + points * dt, memory, branch, p)
    keep_sample(block, points, y, memory, branch, f)
    return min(least, distance(end, p))


def drift(y: Any, i: int, steady: Any, carry: Any, spread: Any, random: Any, ahead: Any) -> None:
    """Take the motion about the driven one over step i, exactly, with its noise; `ahead` is scratch."""
    for n in range(mode_count()):
        for k in range(own_size()):
            ahead[k] = steady[i + 1, place(n, k)]
        for m in range(own_size()):
            here, shaken = y[place(n, m)] - steady[i, place(n, m)], random[place(n, m)]
            for k in range(own_size()):
                ahead[k] += carry[n, m, k] * here + spread[n, m, k] * shaken
        for k in range(own_size()):
            y[place(n, k)] = ahead[k]


def own_size() -> int:
    """Return how many numbers of a motion are those of one mode: its deflection, velocity and late fluid."""
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


def mean_force(
    d0: float, v0: float, d1: float, v1: float, share: float, t: float, memory: Any, branch: Any, p: Any
) -> float:
    """Return the mean force (N) along a way that passes a kink, by Simpson's rule before and behind it."""
    total, aside = 0.0, 1e-9
    for part in range(2):
        first, width = (0.0, share - aside) if part == 0 else (share + aside, 1.0 - share - aside)
        for node in range(3):
            s = first + 0.5 * node * width
            f = force(d0 + s * (d1 - d0), v0 + s * (v1 - v0), t, memory, branch, p)
            total += width / 6.0 * f * (4.0 if node == 1 else 1.0)
    return total


def take_back(block: Any, i: int, y: Any) -> None:
    """Take the motion back to sample i of a period."""
    for k in range(motion_size()):
        y[k] = block[i, k]


def kick(y: Any, h: float, t: float, memory: Any, branch: Any, gains: Any, total: float, p: Any) -> float:
    """Return the mean force (N) of a kick of a scaled duration at one place: that in its middle, for the velocity changes."""
    now = from_vector(y)
    d, rate = distance(now, p), rate_of(now, p)
    f = force(d, rate, t, memory, branch, p)
    return force(d, rate + 0.5 * h * p[2] * total * f, t, memory, branch, p)


def push(y: Any, impulse: float, gains: Any) -> None:
    """Add an impulse, force times scaled time, to the velocity of each mode."""
    for n in range(mode_count()):
        y[2 * n + 1] += gains[n] * impulse


def remember(
    d0: float, v0: float, d1: float, v1: float, h: float, t: float, memory: Any, branch: Any, change: Any, p: Any
) -> None:
    """Advance the forces' memory over a step by the midpoint rule."""
    evolve(d0, v0, t, memory, branch, change[0], p)
    for k in range(memory_size()):
        change[1, k] = memory[k] + 0.5 * h * change[0, k]
    middle = t + seconds(0.5 * h, p)
    evolve(0.5 * (d0 + d1), 0.5 * (v0 + v1), middle, change[1], branch, change[0], p)
    for k in range(memory_size()):
        memory[k] += h * change[0, k]


def keep_sample(block: Any, i: int, y: Any, memory: Any, branch: Any, f: float) -> None:
    """Write motion, memory, branches and force as sample i of a period."""
    for k in range(motion_size()):
        block[i, k] = y[k]
    first = motion_size()
    for k in range(memory_size()):
        block[i, first + k] = memory[k]
    first += memory_size()
    for k in range(latch_count()):
        block[i, first + k] = branch[k]
    block[i, first + latch_count()] = f


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
