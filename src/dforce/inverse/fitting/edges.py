"""Branches followed over edges of the sampled map.

Where a sample of the motion enters or leaves the contact the map has a small edge. Newton's method may find no orbit close
behind it, and a branch seems to end there. A fit would lose all points behind, at one set of values and not at the next.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.block import Block
from dforce.solvers.quasi_static import Branch
from dforce.solvers.settling import apart, polished
from dforce.solvers.states import States

STEPS = (3e-5, 1e-4, 2e-4, 3e-4, 5e-4, 1e-3, 2e-3)  # of the block's unit: tried in turns from the last orbit on
MOST = 30  # steps that are tried along a branch
SAME = 5e-3  # of the free amplitude: a stable orbit so near to the last one continues it; another state is farther


def over_edges(block: Block, which: Any, branch: Branch, values: Array) -> None:
    """Go on along `values` (problems, values) with branches that have not ended: a stable orbit ahead is near.

    Values within such a step get the orbit between its ends, as one Newton step corrects it. What is found is written into
    `branch`, which holds what was followed so far.
    """
    rung = np.zeros(len(which), np.int64)
    for _ in range(MOST):
        left = np.flatnonzero((branch.done > 0) & (branch.done < values.shape[1]) & (rung < len(STEPS)))
        if not len(left):
            return
        change = np.sign(values[left, branch.done[left]] - branch.last_value[left]) * np.array(STEPS)[rung[left]]
        last = branch.last_x[left]
        tangent = branch.last_slope[left] * change[:, None]
        guess = States(last + tangent, branch.last_memory[left], branch.last_branch[left])
        ahead = polished(block, which[left], guess, branch.last_value[left] + change * block.unit[which[left]])
        goes_on = (ahead.done == 1) & (apart(ahead.last_x, last) < SAME)
        rung[left] = np.where(goes_on, 0, rung[left] + 1)
        for i in np.flatnonzero(goes_on).tolist():
            _go_on(block, which, branch, values[left[i]], int(left[i]), Branch(*(part[i : i + 1] for part in ahead)))


def _go_on(block: Block, which: Any, branch: Branch, values: Array, case: int, ahead: Branch) -> None:
    """Take the orbit ahead of one branch, those on the way to it, and what follows."""
    same, done, start, stop = (
        which[case : case + 1],
        int(branch.done[case]),
        branch.last_value[case],
        ahead.last_value[0],
    )
    share = (values[done:] - start) / (stop - start)
    passed = share[: int(np.argmax(share > 1.0)) if (share > 1.0).any() else len(share)]
    count = len(passed)
    if count:
        here = slice(done, done + count)
        x = branch.last_x[case] + passed[:, None] * (ahead.last_x[0] - branch.last_x[case])
        memory, hysteresis = (np.repeat(part, count, axis=0) for part in (ahead.last_memory, ahead.last_branch))
        monodromy = np.repeat(ahead.last_monodromy, count, axis=0)
        branch.rows[case, here], _, _ = block.remeasure(
            np.repeat(same, count), States(x, memory, hysteresis), values[here], monodromy
        )
        branch.x[case, here], branch.memory[case, here], branch.branch[case, here] = x, memory, hysteresis
        branch.monodromy[case, here], branch.done[case] = monodromy, done + count
    done += count
    more = ahead
    if done < len(values):
        begin = States.last_of(ahead)
        more = block.follow(same, begin, ahead.last_value, values[None, done:])
        new = int(more.done[0])
        for name in ("x", "memory", "branch", "monodromy", "rows"):
            getattr(branch, name)[case, done : done + new] = getattr(more, name)[0, :new]
        branch.done[case] = done + new
    for name in ("last_value", "last_x", "last_memory", "last_branch", "last_monodromy", "last_slope"):
        getattr(branch, name)[case] = getattr(more, name)[0]
