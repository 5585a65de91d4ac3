"""The compiled tangent of each step of an orbit: how a small disturbance at its start arrives at its end."""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.integrators.loops import TAU, seconds, tabulate
from dforce.integrators.rk4 import next_sample
from dforce.kernel.vocabulary import distance, force, from_vector, mode_count, motion_size, rate_of, unpacked

ASIDE = 2e-6  # of the scale: steps are short, so that the rounding of their differences counts more than the bend of the force


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
