"""Where the motions of a block settle while the parameter stays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.core.arrays import AnyArray, Array, Bools, Indices
from dforce.solvers.block import Block
from dforce.solvers.newton import solve_each
from dforce.solvers.period_map import REPEATED, Slots, foretell, unrest
from dforce.solvers.quasi_static import Stretch
from dforce.solvers.relaxation import ARRIVED
from dforce.solvers.states import States
from dforce.solvers.transient import LATE, still_ahead, wanders

ROUGH, FINE = 1e-3, 1e-5  # of the free amplitude: settling tolerances before Newton's method takes over
SAME_STATE = 10.0  # times the rest of the way: an orbit farther from the rough state is another one
AWAY, MOST_AWAY = 0.1, 60  # of the free amplitude: so far a motion has left; decay times for that, at most
AT_REST = 1e-9  # of the free amplitude: a motion that gets no farther than this has stopped
STAYS = 20  # quarters of a decay time: a motion that has stopped for so long does not leave
MEMORY_STEPS = 8  # periods in which a memory comes to rest with other samples, at most
NEARLY = 0.35  # of its distance from rest in the first of them: the remainder changes an error little
MOST_GHOSTS = 20  # retries behind the ghost of a saddle-node: a slow passage that looks settled


def polished(block: Block, cases: Indices, start: States, at: Array, cycles: int = 1) -> Stretch:
    """Return the orbits that Newton's method finds near some states, where they are stable."""
    return block.follow(cases, start, at, at[:, None], repeats=cycles)


def remeasured(
    block: Block, which: Indices, states: States, at: Array, monodromy: Array
) -> tuple[Array, States, Array]:
    """Return the measurement, (problems, periods, columns), of the orbits that one Newton step from some states leads to.

    Also returned: the states there, and the length of the next step, (problems,). `monodromy` are matrices of the same orbits
    with other samples. A memory comes nearly to rest, with as many Newton steps: else its error with the other samples would
    not count.
    """
    rows, out, steps = np.empty((len(which), block.common, block.columns)), states.copy(), np.empty(len(which))
    for part in block.parts(len(which)):
        slots, matrix = block.slots(states.take(part), at[part]), np.eye(block.size) - monodromy[part]
        slots.case[:] = which[part]
        last = np.zeros((len(slots.case), 2, slots.memory.shape[1]))
        for attempt in range(MEMORY_STEPS):
            block.march(slots, measured=attempt > 0)
            step = solve_each(matrix, (slots.ends[:, 0] - slots.x)[:, :, None])[:, :, 0]
            left = _unrest(block, slots)
            if attempt == 0:
                enough = np.maximum(NEARLY * left, REPEATED)
            elif attempt == MEMORY_STEPS - 1 or (left <= enough).all():
                break
            slots.x[:] += step
            _take_rest(block, slots, last, attempt > 0)
        steps[part] = np.nan_to_num(np.abs(step).max(axis=1), nan=np.inf)
        rows[part] = slots.rows
        out.put(part, States(slots.x, slots.memory, slots.branch))
        block.check_cancelled()
    return rows, out, steps


def _unrest(block: Block, slots: Slots) -> Array:
    """Return how far from rest the memory of slots was before a period, as a share of its scale, (slots,)."""
    if block.is_smooth:
        return np.zeros(len(slots.case))
    ends = zip(slots.memory_after, slots.memory, slots.branch_after, slots.branch, block.gain[slots.case], strict=True)
    return np.array([unrest(*one, block.memory_scale) for one in ends])


def _take_rest(block: Block, slots: Slots, last: Array, known: bool) -> None:
    """Extrapolate the memory of slots to its state of rest behind a period."""
    for s, gain in enumerate(block.gain[slots.case] if len(block.memory_scale) else ()):
        foretell(slots.memory_after[s], slots.memory[s].copy(), last[s], known, gain, block.elements)
    slots.memory[:], slots.branch[:] = slots.memory_after, slots.branch_after


def settled(block: Block, cases: Indices, start: States, at: Array) -> tuple[States, Stretch, Any, Array]:
    """Return where motions come to, the orbits there, which of these are sure, and how many periods it took."""
    if not block.is_smooth:
        return _settled_in_time(block, cases, start, at)
    state, arrived, periods = block.relax(cases, start, at)
    found = polished(block, cases, state, at)
    good = arrived & (found.done == 1) & (apart(found.last_x, state.x) < 4.0 * ARRIVED)
    for _ in range(MOST_GHOSTS):
        left = np.flatnonzero(arrived & ~good)  # slow beside a fold, where an orbit has just ceased to be
        if not len(left):
            break
        spans = block.decay(cases[left])
        after = later(block, cases[left], state.take(left), at[left], spans)
        after, arrived[left], took = block.relax(cases[left], after, at[left])
        state.put(left, after)
        periods[left] += took + spans * block.common
        near = polished(block, cases[left], after, at[left])
        for old, new in zip(found, near, strict=True):
            old[left] = new
        good[left] = arrived[left] & (near.done == 1) & (apart(near.last_x, after.x) < 4.0 * ARRIVED)
    return state, found, good, periods


def _settled_in_time(block: Block, cases: Indices, start: States, at: Array) -> tuple[States, Stretch, Any, Array]:
    """Return the same by integrating through all periods, as forces with memory or hysteresis need.

    Where the motion has settled and a slow memory has not, that is taken from the orbit nearby, and the motion settles on. A
    motion that has not settled roughly does not settle finely.
    """
    state, periods = start, np.zeros(len(cases))
    found = block.empty_stretch(start, at, (len(cases), 1), 1)
    good, given_up = np.zeros(len(cases), dtype=bool), np.zeros(len(cases), dtype=bool)
    for tolerance in (ROUGH, FINE, FINE):
        left = np.flatnonzero(~good & ~given_up)
        if not len(left):
            break
        rough, drift, took, given_up[left] = _settle(block, cases[left], state.take(left), at[left], tolerance)
        state.put(left, rough)
        periods[left] += took
        near = polished(block, cases[left], rough, at[left])
        sure = (near.done == 1) & (apart(near.last_x, rough.x) < SAME_STATE * np.maximum(drift, 1e-9))
        for old, new in zip(found, near, strict=True):
            old[left] = new
        good[left] = sure
        if tolerance == FINE and len(block.memory_scale):  # which creeps where the motion has come to rest
            creeping = left[(near.done == 1) & ~sure]
            state.memory[creeping] = found.last_memory[creeping]
            periods[creeping] += math.log(1.0 / FINE) * block.common * block.gain[cases[creeping]].max(axis=1)
    return state, found, good, periods


def _settle(
    block: Block, cases: Indices, start: States, at: Array, tolerance: float
) -> tuple[States, Array, Array, Bools]:
    """Integrate until motions stop moving from one decay time of the slowest mode to the next, or wander.

    Returns
    -------
    The motions, the estimated rest of the way, the periods, and which motions did not stop.
    """
    count = len(cases)
    state, decay = start.copy(), block.decay(cases)
    most = block.most_periods(cases)
    former: Array = np.full(count, np.inf)
    drift: Array = np.full(count, np.inf)
    periods = np.zeros(count, np.int64)
    going, path, moves = np.arange(count), list[AnyArray](), np.ones(count, dtype=bool)
    while len(going):
        before = state.take(going)
        after = later(block, cases[going], before, at[going], decay[going])
        state.put(going, after)
        periods[going] += decay[going]
        change = apart(after.x, before.x)
        drift[going], over = still_ahead(change, former[going], tolerance)
        former[going], moves[going] = change, ~over
        path = [*path, state.x[:, 0] + 1j * state.x[:, 1]][-LATE:]
        rests = np.array([not wanders(np.array(path)[:, i]) for i in going])
        going = going[~over & rests & (periods[going] < most[going]) & np.isfinite(change)]
    return state, drift, np.asarray(periods * float(block.common), dtype=float), moves


def gone(block: Block, cases: Indices, start: States, last: States, at: Array) -> States:
    """Integrate motions away from ended states, until they are far away or get no farther; return the motions."""
    state, going = start.copy(), np.arange(len(cases))
    spans = np.maximum(1, block.decay(cases) // 4)
    farthest, nearer = np.zeros(len(cases)), np.zeros(len(cases), np.int64)
    for _ in range(4 * MOST_AWAY):
        after = later(block, cases[going], state.take(going), at[going], spans[going])
        state.put(going, after)
        far = apart(after.x, last.x[going])
        nearer[going] = np.where(far > farthest[going] + AT_REST, 0, nearer[going] + 1)
        farthest[going] = np.maximum(farthest[going], far)
        going = going[(far < AWAY) & (nearer[going] < STAYS) & np.isfinite(after.x).all(axis=1)]
        if not len(going):
            break
    return state


def held_back(block: Block, case: int, state: States, before: float, at: float) -> States:
    """Return a problem's state where the average distance has changed (m), but the tip stays where it was on the sample."""
    compliances, held = np.array([1.0 / mode.k for mode in block.problem(case, at)[0].modes]), state.copy()
    bend = (at - before) / float(block.batch.length[case]) * compliances / compliances.sum()
    held.x[:, : 2 * len(bend) : 2] -= bend
    return held


def later(block: Block, cases: Indices, start: States, at: Array, spans: Indices) -> States:
    """Return states `spans` common periods later, each by its own number: it must not depend on its neighbors."""
    state = start.copy()
    for span in np.unique(spans):
        alike = np.flatnonzero(spans == span)
        state.put(alike, block.advance(cases[alike], start.take(alike), at[alike], int(span)))
    return state


def apart(a: Array, b: Array) -> Array:
    """Return how far states are apart, a row each, relative to the free amplitude; infinite where one is no number."""
    with np.errstate(invalid="ignore"):  # of motions that have gone to infinity
        return np.asarray(np.nan_to_num(np.abs(a - b), nan=np.inf).max(axis=1))


def comes_near(block: Block, case: int, found: Stretch, edge: Array, near: float, cycles: int) -> bool:
    """Return whether the last orbit found comes near a place after any of its periods: it may repeat some periods later."""
    one, state = np.array([case]), States.last_of(found)
    for _ in range(cycles):
        if np.abs(state.x[0] - edge).max() <= near:
            return True
        state = block.advance(one, state, found.last_value, 1)
    return False
