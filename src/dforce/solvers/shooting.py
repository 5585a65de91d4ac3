"""Periodic orbits by shooting: Newton's method on the map over one common period of all tones.

The map is that of ``rk4``, cut at kinks. Its tangent comes from neighboring motions: side by side in lanes where the
force is a continuous function of the motion, one after the other where it has memory, branches or jumps. (R. Seydel, Practical
Bifurcation and Stability Analysis, Springer (2010), chapter 7.)
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.kernel.link import inlined
from dforce.kernel.slots import at_distance, from_vector, latch_count, memory_size, mode_count
from dforce.observables.measure import D_MIN, measure
from dforce.solvers._loops import phases, tabulate
from dforce.solvers.guess import NUDGE, best_order, correction, look_ahead, predict
from dforce.solvers.lanes import advance_copies
from dforce.solvers.rk4 import advance

FRESH = 1e-5  # of the free amplitude: a tangent taken farther from the orbit is taken anew on it
CONTRACTS = 0.1  # a tangent is kept while each correction lowers the miss by this at least
SHORTEST = 0.01  # of a correction: less than this is not tried
LARGEST = 0.3  # of the free amplitude: longer corrections are shortened
LANES = 4  # neighbors are filled up to a multiple of this: the width of a vector register
AHEAD = 4  # orbits that are guessed side by side
ASTRAY = 0.01  # of the free amplitude: a guess that needed a longer correction is not used
CONVERGED, LOST, UNSTABLE = 0, 1, 2  # what became of an orbit

# A step of the distance kicks the motion: it stands off the orbit that continues its state.
SMALL = 1e-4  # of the free amplitude: a smaller kick is none
LARGE = 0.2  # of the free amplitude: after a larger kick the first period does not show yet where the motion goes
SUSPECT = 0.05  # share of the way to other states, as estimated from two tangents, from which on the map is asked
HARD = 0.8  # share from which on it is open where the motion ends
OVERSHOOT = 1.5  # times a step in distance: how much nearer the tip may come before it has settled


def refill(target: Any, source: Any) -> None:
    """Copy an array element by element: a slice assignment would bring numba's text of its errors into the kernel."""
    for k in range(target.shape[0]):
        target[k] = source[k]


def over_common_period(
    y: Any, memory: Any, latched: Any, first: int, common: int, points: int, tones: Any, bases: Any, table: Any,
    kinks: Any, stage: Any, work: Any, block: Any, p: Any,
) -> Any:  # fmt: skip
    """Return the motion one common period later."""
    for k in range(common):
        if common > 1:
            phases(tones, first + k, bases)
            tabulate(tones, bases, points, table)
        y = advance(y, memory, latched, first + k, points, tones, bases, table, kinks, stage, work, block, p)
    return y


@inlined
def are_lanes_enough(smooth: bool) -> bool:
    """Say whether neighbors can be marched side by side: the force is a continuous function of the motion."""
    return smooth and memory_size() == 0 and latch_count() == 0


def tangent(
    y: Any, memory: Any, latched: Any, smooth: bool, first: int, common: int, points: int, tones: Any,
    bases: Any, table: Any, kinks: Any, stage: Any, work: Any, block: Any, p: Any, jacobian: Any,
) -> None:  # fmt: skip
    """Write the derivative of the map at y into `jacobian`, by central differences; memory and branches start as given."""
    size = 2 * mode_count()
    if are_lanes_enough(smooth):
        width = LANES * ((2 * size + LANES - 1) // LANES)
        lanes, other, zc = np.empty((size, width)), np.empty((size, width)), np.full(width, p[0])
        for i in range(size):
            for j in range(width):
                lanes[i, j] = y[i] + (NUDGE if j == 2 * i else 0.0) - (NUDGE if j == 2 * i + 1 else 0.0)
        for k in range(common):
            if common > 1:
                phases(tones, first + k, bases)
                tabulate(tones, bases, points, table)
            advance_copies(
                lanes, other, zc, points, table, first + k, memory, latched, tones, bases, kinks, stage, work, p
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
    size = jacobian.shape[0]
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
    y: Any, memory: Any, latched: Any, smooth: bool, first: int, common: int, points: int, tones: Any, bases: Any,
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
        for k in range(memory_size()):
            memory_before[k] = memory[k]
        for k in range(latch_count()):
            latched_before[k] = latched[k]
        end = over_common_period(
            y, memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block, p
        )
        worst = 0.0
        for i in range(size):
            miss[i] = end[i] - y[i]
            worst = max(worst, abs(miss[i]))
        for k in range(memory_size()):
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
                    y, memory_before, latched_before, smooth, first, common, points, tones, bases, table, kinks, stage,
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


def is_suspect(
    orbits: Any, tangents: Any, nearest: Any, zc: Any, i: int, kinks: Any, bent: Any, matrix: Any, away: Any
) -> bool:
    """Say whether the step to orbit i may be a hard kick: as tangents change, or as it takes the tip past a kink.

    `nearest` holds the least distances on the orbits before it and on it. `bent`, `matrix` and `away` are scratch.
    """
    size, largest = bent.shape[0], 0.0
    for a in range(size):
        bent[a] = 0.0
        for b in range(size):
            bent[a] += 0.5 * (tangents[i - 1, a, b] - tangents[i, a, b]) * (orbits[i - 1, b] - orbits[i, b])
        largest = max(largest, abs(orbits[i - 1, a] - orbits[i, a]))
    if largest < SMALL:
        return False
    correction(tangents[i], bent, matrix, away)
    found = False
    for a in range(size):
        found = found or abs(away[a]) > SUSPECT * largest
    reached = nearest[0] + OVERSHOOT * (zc[i] - zc[i - 1])
    for kink in kinks:
        found = found or (nearest[0] > kink) == (nearest[1] > kink) != (reached > kink)
    return found


def kick(before: Any, end: Any, orbit: Any, tangent: Any, bent: Any, matrix: Any, away: Any) -> float:
    r"""Return how hard a motion is kicked, as a share of the way to other states; infinite where a period cannot tell.

    The motion :math:`x` stands off the orbit :math:`x_*` by :math:`e = x - x_*`, and the map takes it to
    :math:`P(x) = x_* + J e + D` (`end`), with :math:`D` what the tangent :math:`J` leaves out. Where :math:`D` is quadratic,
    the next orbit, beyond which motions go elsewhere, stands where :math:`(1 - J) e = D`: the share is
    :math:`|(1 - J)^{-1} D| / |e|`. `bent`, `matrix` and `away` are scratch.
    """
    size, largest, farthest = bent.shape[0], 0.0, 0.0
    for a in range(size):
        bent[a] = end[a] - orbit[a]
        for b in range(size):
            bent[a] -= tangent[a, b] * (before[b] - orbit[b])
        largest = max(largest, abs(before[a] - orbit[a]))
    if largest > LARGE:
        return np.inf
    correction(tangent, bent, matrix, away)
    for a in range(size):
        farthest = max(farthest, abs(away[a]))
    return farthest / largest


def follow(
    y: Any, memory: Any, latched: Any, smooth: bool, zc: Any, first: int, common: int, points: int, tones: Any, kinks: Any,
    work: Any, block: Any, p: Any, sizes: Any, tolerance: float, most: int, order: int, harmonics: int,
    orbits: Any, jacobians: Any, infos: Any, rows: Any,
) -> int:  # fmt: skip
    """Follow a stable orbit through the distances `zc`, and measure it at each; return how many were done.

    It starts from the motion y, and stops before the first distance at which no stable orbit is found. rows[i, k] is what
    was measured over period k of the orbit at distance i; infos[i] holds what ``shoot`` says, and the :func:`kick` of the
    step to it.
    """
    bases, stage = np.empty(tones.shape[0]), work[0]
    table = np.empty((2 * points + 1, mode_count()))
    size = 2 * mode_count()
    jacobian, vector = np.empty((size, size)), np.empty(size)
    guesses, tangents, strays, until = np.empty((AHEAD, size)), np.empty((AHEAD, size, size)), np.empty(AHEAD), 0
    matrix, away, nearest = np.empty_like(jacobian), np.empty_like(vector), np.full(2, np.inf)
    phases(tones, first, bases)
    tabulate(tones, bases, points, table)
    guess = y
    for i in range(zc.shape[0]):
        here = at_distance(p, zc[i])
        if are_lanes_enough(smooth) and i == max(until, 3) and i + AHEAD <= zc.shape[0]:
            until = i + AHEAD
            look_ahead(
                orbits, zc, i, best_order(orbits, zc, i, order, vector), first, common, points, memory, latched, tones,
                bases, table, kinks, stage, work, p, guesses, tangents, strays,
            )  # fmt: skip
        w = i - until + AHEAD
        known = i < until and strays[w] < ASTRAY
        if known:
            guess = from_vector(guesses[w])
            for k in range(size):
                for j in range(size):
                    jacobian[k, j] = tangents[w, k, j]
        elif i > 0:
            predict(orbits, zc, i, i, best_order(orbits, zc, i, order, vector), vector)
            guess = from_vector(vector)
        memory_before, latched_before = memory.copy(), latched.copy()
        y = shoot(
            guess, memory, latched, smooth, first, common, points, tones, bases, table, kinks, stage, work, block, here,
            sizes, tolerance, most, jacobian, known, infos[i],
        )  # fmt: skip
        infos[i, 3] += strays[w] if known else 0.0
        if infos[i, 2] == CONVERGED and infos[i, 3] > FRESH:
            # memory and branches are those of the orbit's end, and so of its start
            tangent(
                y, memory, latched, smooth, first, common, points, tones, bases, table, kinks, stage, work, block, here,
                jacobian,
            )  # fmt: skip
            if not are_lanes_enough(smooth):  # then the neighbors have left their samples in the block
                over_common_period(
                    y, memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block, here
                )
        if infos[i, 2] == CONVERGED and not is_stable(jacobian):
            infos[i, 2] = UNSTABLE
        if infos[i, 2] != CONVERGED:
            refill(memory, memory_before)
            refill(latched, latched_before)
            return i
        for k in range(size):
            orbits[i, k] = y[k]
            for j in range(size):
                jacobians[i, k, j] = jacobian[k, j]
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
        if i > 0 and is_suspect(orbits, jacobians, nearest, zc, i, kinks, vector, matrix, away):
            end = over_common_period(
                from_vector(orbits[i - 1]), memory.copy(), latched.copy(), first, common, points, tones, bases, table,
                kinks, stage, work, block, here,
            )  # fmt: skip
            infos[i, 4] = kick(orbits[i - 1], end, orbits[i], jacobians[i], vector, matrix, away)
    return zc.shape[0]
