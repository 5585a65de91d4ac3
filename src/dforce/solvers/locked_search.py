"""The search for states of a lock that no known curve passes: where controllers lead motions of several amplitudes and phases.

Controllers act on many motions side by side, see ``settled`` in ``locked_orbits``, then Newton's method takes over. It finds
states that are stable under fast controllers; curves lead from them to unstable ones.
No sum of indices proves that all are found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.locked import Locked
from dforce.solvers.locked_orbits import LockedOrbit, LockedRange, settled
from dforce.solvers.search import LAGS, Known, of_amplitudes
from dforce.solvers.transient import CancelCheck


def candidates(known: Known, check_cancelled: CancelCheck) -> Iterator[LockedOrbit]:
    """Give the states to which controllers lead, at the value of the parameter that is searched."""
    among: Any = known.among
    assert isinstance(among, LockedRange)
    check_cancelled()
    guess, branch = settled(among.locked, *_starts(among.locked, known.value))
    there = np.flatnonzero(np.isfinite(guess).all(axis=1))
    found = among.locked.newton(guess[there], branch[there])
    for i in np.flatnonzero(found.good).tolist():
        yield among.on_curve(found.take([i]))


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
