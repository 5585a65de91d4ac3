"""The search for states of a lock that no known curve passes: where controllers lead motions of several amplitudes and phases.

After each period a phase-locked loop and an amplitude control correct frequency and drive, as in ``controlled``; here many
motions go side by side, and Newton's method takes over from where they settle. It finds states that are stable under fast
controllers; curves lead from them to unstable ones. No sum of indices proves that none is missing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array
from dforce.solvers.locked import Locked
from dforce.solvers.locked_orbits import LockedOrbit, LockedRange
from dforce.solvers.period_map import MOTION
from dforce.solvers.search import LAGS, Known, of_amplitudes, periods_of_transients
from dforce.solvers.transient import CancelCheck

SPEED = 0.3  # of an error, which a controller corrects in a period
SLOWEST, FASTEST = 0.5, 2.0  # of the frequency of the free lock


def candidates(known: Known, check_cancelled: CancelCheck) -> Iterator[LockedOrbit]:
    """Give the states to which controllers lead, at the value of the parameter that is searched."""
    among: Any = known.among
    assert isinstance(among, LockedRange)
    check_cancelled()
    guess, branch = settled(among.locked, known.value)
    there = np.flatnonzero(np.isfinite(guess).all(axis=1))
    found = among.locked.newton(guess[there], branch[there])
    for i in np.flatnonzero(found.good).tolist():
        yield among.on_curve(found.take([i]))


def settled(locked: Locked, at: float) -> tuple[Array, Array]:
    """Return the unknowns and branches to which controllers lead motions at a scaled distance."""
    unknowns, branch = _starts(locked, at)
    [mode] = {locked.problem.modes[tone.mode] for tone in locked.problem.tones}
    offset, unit = locked.scales["frequency"]
    column = {name: locked.motion + place for place, name in enumerate(locked.free)}
    # the zero of each controller cancels the pole of the lever, in periods
    pole, example = math.pi / mode.Q, locked.block.batch.example
    middle, push = locked.number(unknowns, "frequency"), locked.number(unknowns, "drive")
    for _ in range(periods_of_transients(locked.problem)):
        zc, at_frequency, ratio = locked.driven(unknowns)
        after, rows = locked.block.driven(zc, locked.motions(unknowns, branch), at_frequency, ratio, MOTION)
        signal = locked.signal(unknowns, rows) * np.exp(1j * locked.lock.phase)
        branch, unknowns[:, locked.block.size : locked.motion] = after.branch, after.memory / locked.block.memory_scale
        speed = np.ones(len(zc))
        if "frequency" in column:
            late = SPEED * np.angle(signal) / (2.0 * math.pi) * at_frequency
            middle = middle + pole * late
            frequency = np.clip(middle + late, SLOWEST * offset, FASTEST * offset)
            unknowns[:, column["frequency"]], speed = (frequency - offset) / unit, at_frequency / frequency
        if "drive" in column:
            short = SPEED * (1.0 - np.abs(signal))
            push = push + short
            unknowns[:, column["drive"]] = push + short / pole - 1.0
        unknowns[:, : locked.block.size] = after.x * kernel.units_of(example, np.ones(len(zc)), speed)
    return unknowns, branch


def _starts(locked: Locked, at: float) -> tuple[Array, Array]:
    """Return unknowns of free motions at a scaled distance, on each branch of the forces, and these branches."""
    integrator = locked.block.integrator(0, locked.reference)
    lags = [math.degrees(locked.lock.phase)] if "phase" in locked.held else LAGS
    states = of_amplitudes(integrator, at * locked.length, lags)
    branches = np.array(list(product((0.0, 1.0), repeat=states.branch.shape[1])))
    unknowns = np.zeros((len(states), len(locked.weights)))
    unknowns[:, : locked.motion] = np.concatenate([states.x, states.memory / locked.block.memory_scale], axis=1)
    unknowns[:, -1] = at
    return np.tile(unknowns, (len(branches), 1)), np.repeat(branches, len(states), axis=0)
