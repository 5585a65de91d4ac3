"""States that repeat after several common periods: found behind a period doubling, and measured."""

from __future__ import annotations

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.block import Block
from dforce.solvers.points import values_of_orbit
from dforce.solvers.quasi_static import Stretch
from dforce.solvers.settling import apart, polished
from dforce.solvers.states import States
from dforce.solvers.transient import Steady

KICKS = np.geomspace(0.002, 0.3, 17)  # of the free amplitude: guesses of how far a doubled state is from the single one
JUMP = 1e-3  # of the free amplitude: states that differ by less are one


def doubled(block: Block, case: int, at: float, single: States, aside: Array, cycles: int) -> States | None:
    """Return the state of twice the period behind a period doubling of one that repeats after `cycles`; None if there is none.

    It stands on both sides of the single state, which has lost its stability, along the unit vector `aside`.
    """
    guesses = single.take(np.zeros(len(KICKS), dtype=int))
    guesses.x[:] += KICKS[:, None] * aside
    same, there = np.full(len(KICKS), case), np.full(len(KICKS), at)
    found = polished(block, same, guesses, there, 2 * cycles)
    states = States.last_of(found)
    between = block.advance(same, states, there, cycles)
    # on both sides of the single state, in turns
    around = apart(0.5 * (between.x + states.x), single.x) < KICKS[-1]
    good = np.flatnonzero((found.done == 1) & (apart(between.x, states.x) > JUMP) & around)
    return states.take(good[:1]) if len(good) else None


def repeated(block: Block, case: int, value: float, found: Stretch, place: tuple[int, int]) -> Steady:
    """Return an orbit found at a value of the parameter, as it was measured over all its periods."""
    numbers = 0.0, found.residual[place], found.steps[place]
    values = values_of_orbit(block, case, value, found.rows[place], found.monodromy[place], numbers)
    row, k = place
    states = States(found.x[row], found.memory[row], found.branch[row])
    return Steady(values, states.motion(k), True, False)
