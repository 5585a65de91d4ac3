"""Branches followed over edges of the sampled map, and on where they lose their stability.

Where a sample of the motion enters or leaves the contact the map has a small edge. Newton's method may find no orbit close
behind it, and a branch seems to end there. A fit would lose all points behind, at one set of values and not at the next.

Where its period doubles, or where it becomes a torus, a motion stays around the orbit that it leaves: amplitude and phase
change smoothly there. Only at a fold is there no orbit ahead.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.block import Block
from dforce.solvers.newton import CONVERGED, empty_orbits
from dforce.solvers.period_map import NOTHING
from dforce.solvers.quasi_static import FIRST, Stretch
from dforce.solvers.settling import apart, polished, remeasured
from dforce.solvers.states import States

STEPS = (3e-5, 1e-4, 2e-4, 3e-4, 5e-4, 1e-3, 2e-3)  # of the block's unit: tried in turns from the last orbit on
MOST = 30  # steps that are tried along a state
SAME = 5e-3  # of the free amplitude: a stable orbit so near to the last one continues it; another state is farther


def over_edges(block: Block, which: Any, stretch: Stretch, values: Array) -> None:
    """Go on along `values` (problems, values) with states that have not ended: a stable orbit ahead is near.

    Values within such a step get the orbit between its ends, corrected by one Newton step. The orbits are written into
    `stretch`, after the orbits followed so far.
    """
    rung = np.zeros(len(which), np.int64)
    for _ in range(MOST):
        left = np.flatnonzero((stretch.done > 0) & (stretch.done < values.shape[1]) & (rung < len(STEPS)))
        if not len(left):
            return
        change = np.sign(values[left, stretch.done[left]] - stretch.last_value[left]) * np.array(STEPS)[rung[left]]
        last = stretch.last_x[left]
        tangent = stretch.last_slope[left] * change[:, None]
        guess = States(last + tangent, stretch.last_memory[left], stretch.last_branch[left])
        ahead = polished(block, which[left], guess, stretch.last_value[left] + change * block.unit[which[left]])
        goes_on = (ahead.done == 1) & (apart(ahead.last_x, last) < SAME)
        rung[left] = np.where(goes_on, 0, rung[left] + 1)
        for i in np.flatnonzero(goes_on).tolist():
            _go_on(block, which, stretch, values[left[i]], int(left[i]), ahead.take(slice(i, i + 1)))


def past_stability(block: Block, which: Any, stretch: Stretch, values: Array) -> None:
    """Go on along `values` with states that have ended, from orbit to orbit, stable or not; see :func:`over_edges`."""
    for case in np.flatnonzero((stretch.done > 0) & (stretch.done < values.shape[1])).tolist():
        same, begun = which[case : case + 1], int(stretch.done[case])
        while stretch.done[case] < values.shape[1] and _step_on(block, same, stretch, values[case], case):
            pass
        new = slice(begun, int(stretch.done[case]))
        states = States(*(part[case, new] for part in (stretch.x, stretch.memory, stretch.branch)))
        every = np.repeat(same, new.stop - begun)
        stretch.rows[case, new] = remeasured(block, every, states, values[case, new], stretch.monodromy[case, new])[0]


def _step_on(block: Block, same: Any, stretch: Stretch, values: Array, case: int) -> bool:
    """Go to the next value of one stretch, or on the way there; return whether there is an orbit of the same branch."""
    done, last = int(stretch.done[case]), States.last_of(stretch).take([case])
    unit, at = block.unit[same], stretch.last_value[[case]]
    ahead = (values[done] - at) / unit
    share = 1.0 / np.ceil(np.abs(ahead) / FIRST)
    target = np.where(share < 1.0, at + share * ahead * unit, values[done])
    last.x[:] += stretch.last_slope[case] * share * ahead
    slots, orbits = block.slots(last, target), empty_orbits(1, block.size)
    slots.wanted[:] = NOTHING
    block.find(same, slots, orbits, 1)
    if orbits.outcome[0] != CONVERGED or not apart(slots.x, last.x)[0] < block.predicted:
        return False
    both = np.stack([orbits.monodromy[0], stretch.last_monodromy[case]])
    # derivatives that overflowed show no fold; a state with them is not followed, either
    if not np.isfinite(both).all() or np.ptp(np.linalg.slogdet(np.eye(block.size) - both).sign):  # behind a fold
        return False
    found = (target[0], slots.x[0], slots.memory[0], slots.branch[0], orbits.monodromy[0], orbits.slope[0])
    names = ("value", "x", "memory", "branch", "monodromy", "slope")
    for name, part in zip(names, found, strict=True):
        getattr(stretch, f"last_{name}")[case] = part
    if share[0] == 1.0:
        for name, part in list(zip(names, found, strict=True))[1:-1]:
            getattr(stretch, name)[case, done] = part
        stretch.done[case] = done + 1
    return True


def _go_on(block: Block, which: Any, stretch: Stretch, values: Array, case: int, ahead: Stretch) -> None:
    """Take the orbit ahead of one stretch, the orbits on the way to it, and the orbits behind it."""
    same, done = which[case : case + 1], int(stretch.done[case])
    start, stop = stretch.last_value[case], ahead.last_value[0]
    share = (values[done:] - start) / (stop - start)
    passed = share[: int(np.argmax(share > 1.0)) if (share > 1.0).any() else len(share)]
    count = len(passed)
    if count:
        here = slice(done, done + count)
        x = stretch.last_x[case] + passed[:, None] * (ahead.last_x[0] - stretch.last_x[case])
        memory, hysteresis = (np.repeat(part, count, axis=0) for part in (ahead.last_memory, ahead.last_branch))
        monodromy = np.repeat(ahead.last_monodromy, count, axis=0)
        stretch.rows[case, here], _, _ = remeasured(
            block, np.repeat(same, count), States(x, memory, hysteresis), values[here], monodromy
        )
        stretch.x[case, here], stretch.memory[case, here], stretch.branch[case, here] = x, memory, hysteresis
        stretch.monodromy[case, here], stretch.done[case] = monodromy, done + count
    done += count
    more = ahead
    if done < len(values):
        begin = States.last_of(ahead)
        more = block.follow(same, begin, ahead.last_value, values[None, done:])
        new = int(more.done[0])
        for name in ("x", "memory", "branch", "monodromy", "rows"):
            getattr(stretch, name)[case, done : done + new] = getattr(more, name)[0, :new]
        stretch.done[case] = done + new
    for name in ("last_value", "last_x", "last_memory", "last_branch", "last_monodromy", "last_slope"):
        getattr(stretch, name)[case] = getattr(more, name)[0]
