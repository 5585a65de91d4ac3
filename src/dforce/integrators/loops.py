"""The common part of the compiled loops: time and drive within a period, records of a period, the forces' memory.

These arguments are passed together:

- `drive`: the tone table, the tones' phases at the start of a period, the number of the period, and its number of steps;
- `u`: the drive on each mode at the start, in the middle and at the end of a step;
- `forces`: memory and branches of the forces, the distances (m) of their kinks, and room for the memory within a step, (8,
  states): row 0 has the memory after the step, rows 1 to 4 its rates of change at the stages, and rows 5 to 7 serve the parts
  of a step;
- `limits`: the distances (m) of the kinks on either side, both just inside.
"""

from __future__ import annotations

import math
from typing import Any

from dforce.core.arrays import FADED
from dforce.kernel.codegen import FIRST_DRIVE, OMEGA
from dforce.kernel.vocabulary import latch_count, memory_size, mode_count, motion_size

TAU = 2.0 * math.pi


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
    """Set the memory to its values after the last step; faded values become 0."""
    memory, _, _, room = forces
    for k in range(memory_size(memory)):
        memory[k] = room[0, k] if abs(room[0, k]) > FADED else 0.0
