"""Periodic orbits by shooting: Newton's method on the map over one common period of all tones.

The map is that of ``rk4``, cut at kinks. Its tangent comes from neighboring motions: side by side in lanes where the
force is a function of the motion, one after the other where it has memory or branches. (R. Seydel, Practical
Bifurcation and Stability Analysis, Springer (2010), chapter 7.)
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.kernel.slots import at_distance, from_vector, mode_count
from dforce.observables.measure import D_MIN, measure
from dforce.solvers._loops import phases, tabulate
from dforce.solvers.guess import ASTRAY, FRESH, NUDGE, best_order, correction, look_ahead, predict
from dforce.solvers.kicks import (
    HARD,
    MEMO,
    NEAR,
    SMALL,
    are_lanes_enough,
    is_suspect,
    kick,
    off_by,
    remember,
    stay,
    suspicion,
)  # fmt: skip
from dforce.solvers.lanes import filled, lanes_over_common_period, park
from dforce.solvers.rk4 import advance, over_common_period

CONTRACTS = 0.1  # a tangent is kept while each correction lowers the miss by this at least
SHORTEST = 0.01  # of a correction: less than this is not tried
LARGEST = 0.3  # of the free amplitude: longer corrections are shortened
AHEAD = 4  # orbits that are guessed side by side
AT_ONCE = 5e-3  # of the free amplitude: an orbit so near to the start is the one that the motion settles to
FAR, PERIODS = 0.02, 3  # of the free amplitude: off an orbit by more, a motion is asked for so many common periods
DOUBTS = 8  # steps at most from one that kicks hard until it is looked into, all together
CONVERGED, LOST, UNSTABLE, DOUBTED = 0, 1, 2, 3  # what became of an orbit


def refill(target: Any, source: Any) -> None:
    """Copy an array element by element: a slice assignment would bring numba's text of its errors into the kernel."""
    for k in range(target.shape[0]):
        target[k] = source[k]


def tangent(
    y: Any, memory: Any, latched: Any, first: int, common: int, points: int, tones: Any,
    bases: Any, table: Any, kinks: Any, stage: Any, work: Any, block: Any, p: Any, jacobian: Any,
) -> None:  # fmt: skip
    """Write the derivative of the map at y into `jacobian`, by central differences; memory and branches start as given."""
    size = 2 * mode_count()
    if are_lanes_enough(memory, latched):
        width = filled(2 * size)
        lanes, other, zc = np.empty((size, width)), np.empty((size, width)), np.full(width, p[0])
        park(zc, 2 * size, p)
        for i in range(size):
            for j in range(width):
                lanes[i, j] = y[i] + (NUDGE if j == 2 * i else 0.0) - (NUDGE if j == 2 * i + 1 else 0.0)
        lanes_over_common_period(
            lanes, other, zc, first, common, points, memory, latched, tones, bases, table, kinks, stage, work, p
        )
        for i in range(size):
            for j in range(size):
                jacobian[i, j] = (lanes[i, 2 * j] - lanes[i, 2 * j + 1]) / (2.0 * NUDGE)
        return
    vector = np.empty(size)
    for j in range(size):
        for side in (1.0, -1.0):
            for i in range(size):
                vector[i] = y[i] + (side * NUDGE if i == j else 0.0)
            there = over_common_period(
                from_vector(vector), memory.copy(), latched.copy(), first, common, points, tones, bases, table, kinks,
                stage, work, block, p,
            )  # fmt: skip
            for i in range(size):
                if side > 0.0:
                    jacobian[i, j] = there[i] / (2.0 * NUDGE)
                else:
                    jacobian[i, j] -= there[i] / (2.0 * NUDGE)


def is_stable(jacobian: Any) -> bool:
    """Say whether all multipliers lie within the unit circle: whether powers of the tangent die out."""
    size = 2 * mode_count()
    if size == 2:
        area = jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0]
        return abs(area) < 1.0 and abs(jacobian[0, 0] + jacobian[1, 1]) < 1.0 + area
    power, product = jacobian.copy(), np.empty((size, size))
    growth, weight = 0.0, 1.0
    for _ in range(30):  # the power 2^30: decides a multiplier of 1 - 1e-8
        largest = 0.0
        for i in range(size):
            for j in range(size):
                largest = max(largest, abs(power[i, j]))
        if not largest < np.inf:
            return False
        if largest == 0.0:
            return True
        growth += weight * np.log(largest)
        weight *= 0.5
        for i in range(size):
            for j in range(size):
                total = 0.0
                for k in range(size):
                    total += power[i, k] / largest * power[k, j] / largest
                product[i, j] = total
        power, product = product, power
    return growth < 0.0


def shoot(
    y: Any, memory: Any, latched: Any, first: int, common: int, points: int, tones: Any, bases: Any,
    table: Any, kinks: Any, stage: Any, work: Any, block: Any, p: Any, sizes: Any, tolerance: float, most: int,
    jacobian: Any, known: bool, info: Any,
) -> Any:  # fmt: skip
    """Return the orbit's motion at the start of a common period, found from a guess.

    `jacobian` holds a tangent to start with where `known`, and the last one used in the end. `info` gets the miss (how far
    from its start the orbit ends, relative to the free amplitude), the number of corrections, whether it converged, and
    how far from the orbit its tangent was taken. The block holds the samples of the orbit's last period.
    """
    size = 2 * mode_count()
    miss, step, matrix, vector = np.empty(size), np.empty(size), np.empty((size, size)), np.empty(size)
    start, memory_before, latched_before = np.empty(size), memory.copy(), latched.copy()
    before, shorter = np.inf, 1.0
    info[2], info[3] = LOST, 0.0 if known else np.inf
    for attempt in range(most + 1):
        for k in range(memory.shape[0]):
            memory_before[k] = memory[k]
        for k in range(latched.shape[0]):
            latched_before[k] = latched[k]
        end = over_common_period(
            y, memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block, p
        )
        worst = 0.0
        for i in range(size):
            miss[i] = end[i] - y[i]
            worst = max(worst, abs(miss[i]))
        for k in range(memory.shape[0]):
            worst = max(worst, abs(memory[k] - memory_before[k]) / sizes[k])
        info[0], info[1] = worst, attempt
        if worst < tolerance:
            info[2] = CONVERGED
            return y
        if attempt == most or not worst < np.inf:
            return y
        if worst > before and shorter > SHORTEST:
            # the correction went too far: take less of it, from where it started
            shorter *= 0.25
        else:
            if not known or worst > CONTRACTS * before:
                tangent(
                    y, memory_before, latched_before, first, common, points, tones, bases, table, kinks, stage,
                    work, block, p, jacobian,
                )  # fmt: skip
                known = True
                info[3] = 0.0
            before = worst
            correction(jacobian, miss, matrix, step)
            longest = 0.0
            for i in range(size):
                start[i] = y[i]
                longest = max(longest, abs(step[i]))
            if not longest < np.inf:
                return y
            shorter = min(1.0, LARGEST / longest) if longest > 0.0 else 1.0
        for i in range(size):
            vector[i] = start[i] + shorter * step[i]
            info[3] = max(info[3], shorter * abs(step[i]))
        y = from_vector(vector)
    return y


def follow(
    guess: Any, memory: Any, latched: Any, start: Any, zc: Any, known: int, wary: bool, patience: int, decay: int,
    first: int, common: int, points: int, tones: Any, kinks: Any, work: Any, block: Any, p: Any, sizes: Any,
    tolerance: float, most: int, order: int, harmonics: int, orbits: Any, jacobians: Any, memories: Any, latches: Any,
    infos: Any, rows: Any,
) -> int:  # fmt: skip
    """Follow a stable orbit through the distances `zc`, and measure it at each; return how many there are in the end.

    The first `known` of them are given. If there are none, the first orbit is found from a guess; where `start` is a motion,
    not empty, it has to be the one that this motion settles on. It stops before the first distance at which no stable orbit
    is found, or, if it is `wary`, at which it is not clear that the motion of the distance before settles on it. `memory`
    and `latched` are those of the guess, or of the last known orbit; for `patience` and `decay` see ``kicks``. rows[i, k] is
    what was measured over period k of the orbit at distance i; infos[i] holds what ``shoot`` says, and the :func:`kick` of
    the step to it.
    """
    bases, stage = np.empty(tones.shape[0]), work[0]
    table = np.empty((2 * points + 1, mode_count()))
    size = 2 * mode_count()
    jacobian, vector = np.empty((size, size)), np.empty(size)
    guesses, tangents, strays, until = np.empty((AHEAD, size)), np.empty((AHEAD, size, size)), np.empty(AHEAD), 0
    matrix, away = np.empty((size, size)), np.empty(size)
    nearest, memo = np.full(2, np.inf), np.full(MEMO, np.inf)
    memo[0] = 0.0
    # steps that kick hard, and what was before them
    hard, asked = np.empty(DOUBTS, np.int64), 0
    kicked, kicked_memory = np.empty((DOUBTS, size)), np.empty((DOUBTS, memory.shape[0]))
    kicked_latched = np.empty((DOUBTS, latched.shape[0]))
    phases(tones, first, bases)
    tabulate(tones, bases, points, table)
    for k in range(common if known > 0 else 0):
        nearest[1] = min(nearest[1], rows[known - 1, k, D_MIN])
    end = zc.shape[0]
    for i in range(known, zc.shape[0]):
        here = at_distance(p, zc[i])
        if are_lanes_enough(memory, latched) and i >= max(until, 3) and i + AHEAD <= zc.shape[0]:
            until = i + AHEAD
            look_ahead(
                orbits, zc, i, best_order(orbits, zc, i, order, vector), first, common, points, memory, latched, tones,
                bases, table, kinks, stage, work, p, guesses, tangents, strays,
            )  # fmt: skip
        w = i - until + AHEAD
        ahead = i < until and strays[w] < ASTRAY
        if ahead:
            guess = from_vector(guesses[w])
            for k in range(size):
                for j in range(size):
                    jacobian[k, j] = tangents[w, k, j]
        elif i > 0:
            predict(orbits, zc, i, i, best_order(orbits, zc, i, order, vector), vector)
            guess = from_vector(vector)
        memory_before, latched_before = memory.copy(), latched.copy()
        y = shoot(
            guess, memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block, here, sizes,
            tolerance, most, jacobian, ahead, infos[i],
        )  # fmt: skip
        infos[i, 3] += strays[w] if ahead else 0.0
        if infos[i, 2] == CONVERGED and infos[i, 3] > FRESH:
            # memory and branches are those of the orbit's end, and so of its start
            tangent(
                y, memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block, here,
                jacobian,
            )  # fmt: skip
            if not are_lanes_enough(memory, latched):  # then the neighbors have left their samples in the block
                over_common_period(
                    y, memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block, here
                )
        if infos[i, 2] == CONVERGED and not is_stable(jacobian):
            infos[i, 2] = UNSTABLE
        if infos[i, 2] != CONVERGED:
            end = i
            break
        for k in range(size):
            orbits[i, k] = y[k]
            for j in range(size):
                jacobians[i, k, j] = jacobian[k, j]
        refill(memories[i], memory)
        refill(latches[i], latched)
        if common == 1:
            measure(block, first, points, tones, bases, here, kinks, harmonics, rows[i, 0])
        else:
            for k in range(common):
                phases(tones, first + k, bases)
                tabulate(tones, bases, points, table)
                y = advance(y, memory, latched, first + k, points, tones, bases, table, kinks, stage, work, block, here)
                measure(block, first + k, points, tones, bases, here, kinks, harmonics, rows[i, k])
        nearest[0], nearest[1], infos[i, 4] = nearest[1], np.inf, 0.0
        for k in range(common):
            nearest[1] = min(nearest[1], rows[i, k, D_MIN])
        if i > 0:
            refill(kicked[asked], orbits[i - 1])
            share = suspicion(orbits, jacobians, nearest, zc, i, kinks, vector, matrix, away) if wary else 0.0
            far = wary and off_by(orbits[i - 1], orbits[i]) > FAR
            if far or is_suspect(share, patience, memo):
                infos[i, 4] = ask(
                    orbits[i - 1], memory_before.copy(), latched_before.copy(), orbits[i], jacobians[i], far, first,
                    common, points, tones, bases, table, kinks, stage, work, block, here,
                )  # fmt: skip
                if not far:
                    remember(share, infos[i, 4], memo)
        elif start.shape[0] > 0:
            refill(kicked[asked], start)
            largest = off_by(start, orbits[0])
            if largest > AT_ONCE:
                infos[0, 4] = np.inf
            elif largest > SMALL:
                infos[0, 4] = ask(
                    start, memory_before.copy(), latched_before.copy(), orbits[0], jacobians[0], False, first, common,
                    points, tones, bases, table, kinks, stage, work, block, here,
                )  # fmt: skip
        if infos[i, 4] >= HARD:
            refill(kicked_memory[asked], memory_before)
            refill(kicked_latched[asked], latched_before)
            hard[asked] = i
            asked += 1
        if asked > 0 and (asked == DOUBTS or i == 0 or i - hard[0] >= DOUBTS):
            done = sure(
                i + 1, hard, asked, kicked, kicked_memory, kicked_latched, orbits, jacobians, zc, rows, decay, first,
                common, points, tones, bases, table, kinks, stage, work, block, p, infos,
            )  # fmt: skip
            if done <= i:
                return done
            asked = 0
    return sure(
        end, hard, asked, kicked, kicked_memory, kicked_latched, orbits, jacobians, zc, rows, decay, first,
        common, points, tones, bases, table, kinks, stage, work, block, p, infos,
    )  # fmt: skip


def ask(
    motion: Any, memory: Any, latched: Any, orbit: Any, jacobian: Any, far: bool, first: int, common: int, points: int,
    tones: Any, bases: Any, table: Any, kinks: Any, stage: Any, work: Any, block: Any, p: Any,
) -> float:  # fmt: skip
    """Return how hard a motion is kicked off an orbit; memory and branches are changed.

    One common period tells, but where it is `far` off: there some are asked, and less of a kick is a hard one.
    """
    size = 2 * mode_count()
    bent, matrix, away = np.empty(size), np.empty((size, size)), np.empty(size)
    start, end, hardest = motion.copy(), np.empty(size), 0.0
    for _ in range(PERIODS if far else 1):
        y = over_common_period(
            from_vector(start), memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block,
            p,
        )  # fmt: skip
        for k in range(size):
            end[k] = y[k]
        hardest = max(hardest, kick(start, end, orbit, jacobian, bent, matrix, away))
        refill(start, end)
    return hardest * HARD / NEAR if far else hardest


def sure(
    done: int, hard: Any, asked: int, kicked: Any, memories: Any, latches: Any, orbits: Any, jacobians: Any, zc: Any,
    rows: Any, decay: int, first: int, common: int, points: int, tones: Any, bases: Any, table: Any, kinks: Any,
    stage: Any, work: Any, block: Any, p: Any, infos: Any,
) -> int:  # fmt: skip
    """Return how many of the orbits found the motion settles on, step by step, now that the hard steps are looked into."""
    size = kicked.shape[1]
    goals, tangents = np.empty((asked, size)), np.empty((asked, size, size))
    where, rooms, answers = np.empty(asked), np.full(asked, np.inf), np.zeros(asked, np.int64)
    for j in range(asked):
        where[j] = zc[hard[j]]
        nearest = np.inf
        for k in range(common):
            nearest = min(nearest, rows[hard[j], k, D_MIN])
        for kink in kinks:
            rooms[j] = min(rooms[j], abs(nearest - kink) / p[1])
        for k in range(size):
            goals[j, k] = orbits[hard[j], k]
            for m in range(size):
                tangents[j, k, m] = jacobians[hard[j], k, m]
    if asked > 0:
        stay(
            kicked, memories, latches, goals, tangents, where, rooms, decay, asked, first, common, points, tones, bases,
            table, kinks, stage, work, block, p, answers,
        )  # fmt: skip
    for j in range(asked):
        if answers[j] == 0:
            infos[hard[j], 2] = DOUBTED
            return hard[j]
    return done
