"""The Dormand–Prince method with step control that lands on the force's kinks: the accurate reference.

Order 5(4) (J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6, 19 (1980)). Steps also end at the samples; what is
measured is measured on more of them, so that the interpolation between samples errs less than the motion itself. A step
that would cross a kink, or a branch's switch, is shortened to end just past it; so every step sees a smooth force and the
order is kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.integrators.loops import TAU, held, interval, keep_rest, passed, phases, seconds
from dforce.kernel.vocabulary import (
    blend,
    distance,
    drive_at,
    error_norm,
    evolve,
    force,
    keep,
    memory_size,
    motion,
    rate_of,
)
from dforce.observables.lockin import lock_in_turned
from dforce.observables.measure import measure

C2, C3, C4, C5 = 1 / 5, 3 / 10, 4 / 5, 8 / 9
A2 = (1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
A3 = (3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0, 0.0)
A4 = (44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0, 0.0)
A5 = (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0, 0.0)
A6 = (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0, 0.0)
B5 = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0.0)
# difference of the fifth-order weights and the embedded fourth-order ones
ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)

ABSOLUTE = 1e-6  # of the free amplitude: below it errors count against this, so that rounding is never chased
SMALLEST = 1e-13  # of a step, relative to the period: shorter ones are taken as they are
LANDED = 1e-11  # how near to a kink a step must end, relative to the period
MEASURED = 4096  # samples a period, at least, that averages and extremes are taken from
MOST_LANDINGS = 12  # between two samples; a force that switches more often has no branch to be on


def slope(
    y: Any, tau: float, t0: float, memory: Any, latched: Any, tones: Any, bases: Any, limits: Any, change: Any, p: Any
) -> Any:
    """Return dy/dtau, and write that of the forces' states into `change`; forces are evaluated within the limits."""
    d, rate, t = held(distance(y, p), limits), rate_of(y, p), t0 + seconds(tau, p)
    if memory_size():
        evolve(d, rate, t, memory, latched, change, p)
    return motion(drive_at(tones, bases, tau), force(d, rate, t, memory, latched, p), y, p)


def remember(h: float, weights: Any, memory: Any, work: Any, target: int) -> None:
    """Write the forces' states after a stage into row `target` of the workspace."""
    for i in range(memory_size()):
        total = 0.0
        for s in range(7):
            total += weights[s] * work[1 + s, i]
        work[target, i] = memory[i] + h * total


def attempt(
    y: Any,
    tau: float,
    h: float,
    t0: float,
    memory: Any,
    latched: Any,
    tones: Any,
    bases: Any,
    kinks: Any,
    work: Any,
    sizes: Any,
    p: Any,
) -> Any:
    """Return the motion after a step and its error, relative to the motion; the memory then is in work[0].

    The whole step sees the forces on the side of all kinks on which it starts.
    """
    limits = interval(y, kinks, p)
    if memory_size():
        work[1:9] = 0.0
    k1 = slope(y, tau, t0, memory, latched, tones, bases, limits, work[1], p)
    remember(h, A2, memory, work, 0)
    y2 = blend(y, h, A2, k1, k1, k1, k1, k1, k1, k1)
    k2 = slope(y2, tau + C2 * h, t0, work[0], latched, tones, bases, limits, work[2], p)
    remember(h, A3, memory, work, 0)
    y3 = blend(y, h, A3, k1, k2, k1, k1, k1, k1, k1)
    k3 = slope(y3, tau + C3 * h, t0, work[0], latched, tones, bases, limits, work[3], p)
    remember(h, A4, memory, work, 0)
    y4 = blend(y, h, A4, k1, k2, k3, k1, k1, k1, k1)
    k4 = slope(y4, tau + C4 * h, t0, work[0], latched, tones, bases, limits, work[4], p)
    remember(h, A5, memory, work, 0)
    y5 = blend(y, h, A5, k1, k2, k3, k4, k1, k1, k1)
    k5 = slope(y5, tau + C5 * h, t0, work[0], latched, tones, bases, limits, work[5], p)
    remember(h, A6, memory, work, 0)
    y6 = blend(y, h, A6, k1, k2, k3, k4, k5, k1, k1)
    k6 = slope(y6, tau + h, t0, work[0], latched, tones, bases, limits, work[6], p)
    end = blend(y, h, B5, k1, k2, k3, k4, k5, k6, k1)
    remember(h, B5, memory, work, 0)
    k7 = slope(end, tau + h, t0, work[0], latched, tones, bases, limits, work[7], p)
    error = error_norm(h, ERROR, y, end, ABSOLUTE, k1, k2, k3, k4, k5, k6, k7)
    for i in range(memory_size()):
        total = 0.0
        for s in range(7):
            total += ERROR[s] * work[1 + s, i]
        error = max(error, abs(h * total) / (ABSOLUTE * sizes[i] + max(abs(memory[i]), abs(work[0, i]))))
    return end, error


def advance(
    y: Any,
    memory: Any,
    latched: Any,
    period: int,
    points: int,
    tones: Any,
    bases: Any,
    kinks: Any,
    tolerance: float,
    sizes: Any,
    work: Any,
    block: Any,
    p: Any,
) -> Any:
    """Return the motion one period later; block[i] holds sample i of the period, both ends included."""
    sample = TAU / points
    t0 = seconds(period * TAU, p)
    wanted = sample
    for i in range(points):
        tau = i * sample
        end_of_sample = (i + 1) * sample
        keep(block, i, y)
        f = force(distance(y, p), rate_of(y, p), t0 + seconds(tau, p), memory, latched, p)
        keep_rest(block, i, memory, latched, f)
        landings = 0
        while end_of_sample - tau > SMALLEST * TAU:
            h = min(wanted, end_of_sample - tau)
            end, error = attempt(y, tau, h, t0, memory, latched, tones, bases, kinks, work, sizes, p)
            if error > tolerance and h > SMALLEST * TAU:
                wanted = h * max(0.1, 0.9 * (tolerance / error) ** 0.2)
                continue
            # NaN compares false: a step that is no number is taken, and found at the end of the period
            which = passed(y, end, t0 + seconds(tau + h, p), latched, kinks, p)
            if which >= 0 and landings == MOST_LANDINGS:
                which = -1
            if which >= 0:
                landings += 1
                low, high = 0.0, h
                while high - low > LANDED * TAU:
                    middle = 0.5 * (low + high)
                    end, error = attempt(y, tau, middle, t0, memory, latched, tones, bases, kinks, work, sizes, p)
                    found = passed(y, end, t0 + seconds(tau + middle, p), latched, kinks, p)
                    if found < 0:
                        low = middle
                    else:
                        which, high = found, middle
                h = high
                end, error = attempt(y, tau, h, t0, memory, latched, tones, bases, kinks, work, sizes, p)
            else:
                longer = h * min(5.0, 0.9 * (tolerance / max(error, 1e-30)) ** 0.2)
                wanted = max(wanted, longer) if h < wanted else longer
            tau += h
            y = end
            for k in range(memory_size()):
                memory[k] = work[0, k]
            if which >= kinks.shape[0]:
                latched[which - kinks.shape[0]] = 1.0 - latched[which - kinks.shape[0]]
    keep(block, points, y)
    f = force(distance(y, p), rate_of(y, p), t0 + seconds(TAU, p), memory, latched, p)
    keep_rest(block, points, memory, latched, f)
    return y


def march(
    y: Any,
    memory: Any,
    latched: Any,
    first: int,
    periods: int,
    points: int,
    tones: Any,
    p: Any,
    kinks: Any,
    work: Any,
    block: Any,
    tolerance: float,
    sizes: Any,
    turns: Any,
    every: bool,
    out: Any,
) -> Any:
    """Advance whole periods; out[i] holds what was measured over period i: lock-in only, or everything."""
    finest = turns.cosine.shape[1] - 1
    samples = np.empty((finest + 1, block.shape[1])) if finest > points else block
    bases, z = np.empty(tones.shape[0]), np.empty(points + 1)
    for i in range(periods):
        phases(tones, first + i, bases)
        y = advance(y, memory, latched, first + i, finest, tones, bases, kinks, tolerance, sizes, work, samples, p)
        if every:
            measure(samples, first + i, turns, tones, bases, p, kinks, out[i])
        else:
            lock_in_turned(block, turns, bases, z, out[i])
    return y
