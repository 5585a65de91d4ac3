"""What the compiled solvers share: the drive within a period, records of a period, and branch switches.

These go down together:

- `drive`: the tone table, the tones' phases at the start of a period, the number of that period and of the steps in it;
- `u`: the drive on each mode at the start, in the middle and at the end of a step;
- `forces`: memory and branches of the forces, the distances (m) of their kinks, and room for the memory within a step, (8,
  states): row 0 holds the memory that the step leads to, rows 1 to 4 its rates of change at the stages, and rows 5 to 7 serve
  the parts of a step;
- `limits`: the distances (m) of the kinks on either side, both just inside.
"""

from __future__ import annotations

import math
from typing import Any

from dforce.core.arrays import FADED
from dforce.kernel.codegen import FIRST_DRIVE, LENGTH, OMEGA
from dforce.kernel.vocabulary import (
    coasted,
    distance,
    force,
    latch_count,
    memory_size,
    mode_count,
    motion_size,
    rate_of,
    switch,
)
from dforce.observables.interpolant import INSIDE, cubic, turning

TAU = 2.0 * math.pi
JUMPS = 1e-3  # of the forces on both sides: a larger difference is a jump


def seconds(tau: float, p: Any) -> float:
    """Return a scaled time in seconds."""
    return tau / p[OMEGA]


def phases(tones: Any, period: int, bases: Any) -> None:
    """Write the phase of each tone at the start of a period of the first tone."""
    for j in range(tones.shape[0]):
        turns = tones[j, 0] * period
        bases[j] = tones[j, 1] + TAU * (turns - math.floor(turns))


def tabulate(tones: Any, bases: Any, points: int, table: Any) -> None:
    """Write the drive on each mode at the ends and middles of all steps of a period."""
    h = TAU / points
    for i in range(2 * points + 1):
        for n in range(mode_count()):
            table[i, n] = 0.0
    for j in range(tones.shape[0]):
        lagging = False
        for n in range(mode_count()):
            lagging |= tones[j, FIRST_DRIVE + mode_count() + n] != 0.0
        if not lagging:
            for i in range(2 * points + 1):
                c = math.cos(tones[j, 0] * (0.5 * h * i) + bases[j])
                for n in range(mode_count()):
                    table[i, n] += tones[j, FIRST_DRIVE + n] * c
            continue
        # turned from step to step: off by some 1e-14 at the end, and cheaper than a sine beside each cosine
        c, s = math.cos(bases[j]), math.sin(bases[j])
        turn_c, turn_s = math.cos(0.5 * h * tones[j, 0]), math.sin(0.5 * h * tones[j, 0])
        for i in range(2 * points + 1):
            for n in range(mode_count()):
                table[i, n] += tones[j, FIRST_DRIVE + n] * c - tones[j, FIRST_DRIVE + mode_count() + n] * s
            c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s


def keep_rest(samples: Any, i: int, memory: Any, latched: Any, f: float) -> None:
    """Write memory, branches and force as part of sample i of a period."""
    place = motion_size()
    for k in range(memory_size(memory)):
        samples[i, place + k] = memory[k]
    place += memory_size(memory)
    for k in range(latch_count(latched)):
        samples[i, place + k] = latched[k]
    samples[i, place + latch_count(latched)] = f


def remember(forces: Any) -> None:
    """Take the memory to where the last step has led it; what has faded is nothing."""
    memory, _, _, room = forces
    for k in range(memory_size(memory)):
        memory[k] = room[0, k] if abs(room[0, k]) > FADED else 0.0


def risen(y: Any, t: float, latched: Any, p: Any) -> int:
    """Return the first latch whose switching function is above zero, or -1."""
    d = distance(y, p)
    rate = rate_of(y, p)
    for which in range(latch_count(latched)):
        if switch(which, latched, d, rate, t, p) > 0.0:
            return which
    return -1


def passed(y: Any, end: Any, t: float, forces: Any, p: Any) -> int:
    """Return which kink (0, 1, ...) or latch (counted on from the kinks) lies between two motions, or -1.

    Of several kinks it is the first one that the motion comes to. `t` is the time (s) of the second motion.
    """
    _, latched, kinks, _ = forces
    d0, d1, first = distance(y, p), distance(end, p), -1
    for which in range(kinks.shape[0]):
        if (d0 > kinks[which]) != (d1 > kinks[which]) and (
            first < 0 or abs(kinks[which] - d0) < abs(kinks[first] - d0)
        ):
            first = which
    if first >= 0:
        return first
    which = risen(end, t, latched, p)
    return which + kinks.shape[0] if which >= 0 else -1


def grazes(y: Any, h: float, kinks: Any, p: Any) -> bool:
    """Say whether a step that begins and ends on one side of a kink may come to its other side on the way.

    Neither the parabola through the step nor the stages of the method reach farther than the tangent at the start does in
    the middle of the step.
    """
    d, middle = distance(y, p), distance(coasted(y, 0.5 * h), p)
    found = False
    for kink in kinks:
        found |= (d > kink) != (middle > kink)
    return found


def touches_a_jump(y: Any, h: float, t: float, forces: Any, p: Any) -> bool:
    """Say whether the force jumps at a kink that a step may touch.

    Where it only bends, a step that dips behind the kink and back is left whole: what it misses vanishes with the depth of
    the dip, while a cut would change the error of the step at once.
    """
    memory, latched, kinks, _ = forces
    d, middle, rate, found = distance(y, p), distance(coasted(y, 0.5 * h), p), rate_of(y, p), False
    aside = INSIDE * p[LENGTH]
    for kink in kinks:
        if (d > kink) != (middle > kink):
            above = force(kink + aside, rate, t, memory, latched, p)
            below = force(kink - aside, rate, t, memory, latched, p)
            found |= abs(above - below) > JUMPS * (abs(above) + abs(below))
    return found


def turn_behind(y: Any, end: Any, dt: float, kinks: Any, p: Any) -> float:
    """Return the share of a step (s) at which the motion turns behind a kink that both ends lie before, or 0."""
    d0, v0, d1, v1 = distance(y, p), rate_of(y, p), distance(end, p), rate_of(end, p)
    if v0 * v1 < 0.0:
        share = turning(dt, d0, v0, d1, v1)
        farthest = cubic(share, dt, d0, v0, d1, v1)
        for kink in kinks:
            if (d0 > kink) == (d1 > kink) and (d0 > kink) != (farthest > kink):
                return share
    return 0.0


def margin(which: int, y: Any, end: Any, t: float, forces: Any, p: Any) -> float:
    """Return how far a motion is past an event that `passed` found: negative before it, positive after."""
    _, latched, kinks, _ = forces
    if which < kinks.shape[0]:
        past = distance(end, p) - kinks[which]
        return -past if distance(y, p) > kinks[which] else past
    return switch(which - kinks.shape[0], latched, distance(end, p), rate_of(end, p), t, p)
