"""Newton's method for the periodic orbits of a block of problems.

An orbit is a fixed point of the map P over one common period, P(x) = x. The Newton step is (I - M)^-1 (P(x) - x) with the
monodromy matrix M = dP/dx, and the orbit's slope along the parameter is (I - M)^-1 dP/dvalue. Memory and branches of the
forces follow the motion: they are carried on from period to period until they repeat with it.

Source: R. Seydel, Practical Bifurcation and Stability Analysis, Springer (2010), chapter 7.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dforce.kernel.slots import mode_count
from dforce.solvers.period_map import FD_STEP, MEMORY_PASSES, march

TOLERANCE = 1e-9  # of the free amplitude: Newton step at which an orbit is accepted
RESIDUAL = 1e-11  # of the free amplitude: residual that is rounding, whatever the Newton step
ROUGH_RESIDUAL = 1e-9  # the same where forces that jump leave the map so rough
NEAR = 1e-5  # of the free amplitude: a monodromy matrix taken so near to the orbit is its own
CONTRACTS = 0.5  # each Newton step has to be shorter than the one before by this
LARGEST = 0.3  # of the free amplitude: longer Newton steps are shortened
MOST_STEPS, MOST_PASSES = 10, 4
PENDING, NEARBY, CONVERGED, FAILED = 0, 1, 2, 3  # what became of a slot


class Orbits(NamedTuple):
    """What Newton's method finds for slots, a row for each.

    Attributes
    ----------
    monodromy, slope
        Derivatives of the map by the motion and of the orbit by the parameter (per unit), (slots, size, size), (slots, size).
    residual, steps
        How far from its start the orbit ends, relative to the free amplitude; Newton steps taken.
    outcome
        PENDING, NEARBY, CONVERGED or FAILED.
    """

    monodromy: Any
    slope: Any
    residual: Any
    steps: Any
    outcome: Any


def solve_both(monodromy: Any, first: Any, second: Any, matrix: Any) -> bool:
    """Solve (I - M) x = b for two right sides in place, by elimination with pivots; return whether there is a solution."""
    size = 2 * mode_count()
    for i in range(size):
        for j in range(size):
            matrix[i, j] = (1.0 if i == j else 0.0) - monodromy[i, j]
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if not abs(matrix[pivot, k]) > 0.0:
            return False
        if pivot != k:
            for j in range(size):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            first[k], first[pivot] = first[pivot], first[k]
            second[k], second[pivot] = second[pivot], second[k]
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k, size):
                matrix[i, j] -= factor * matrix[k, j]
            first[i] -= factor * first[k]
            second[i] -= factor * second[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            first[k] -= matrix[k, j] * first[j]
            second[k] -= matrix[k, j] * second[j]
        first[k] /= matrix[k, k]
        second[k] /= matrix[k, k]
    return True


def longest(vector: Any) -> float:
    """Return the largest modulus of a vector's numbers."""
    most = 0.0
    for value in vector:
        most = max(most, abs(value)) if abs(value) < np.inf else np.inf
    return most


def solve_orbits(slots: Any, count: int, model: Any, drive: Any, orbits: Any, room: Any) -> None:
    """Find the orbits near the states of the first `count` slots, and measure them; `slots` holds them in the end."""
    size = 2 * mode_count()
    which, before = np.empty(count, np.int64), np.full(count, np.inf)
    first, second, matrix = np.empty(size), np.empty(size), np.empty((size, size))
    for s in range(count):
        orbits.outcome[s], orbits.steps[s], orbits.residual[s] = PENDING, 0, np.inf
    for _ in range(MOST_STEPS):
        going = 0
        for s in range(count):
            if orbits.outcome[s] == PENDING:
                which[going] = s
                going += 1
        if going == 0:
            break
        march(slots, which, going, size + 2, False, model, drive, room)
        for g in range(going):
            s = which[g]
            unit = FD_STEP
            for k in range(size):
                first[k] = slots.ends[s, 0, k] - slots.x[s, k]
                second[k] = (slots.ends[s, size + 1, k] - slots.ends[s, 0, k]) / unit
                for j in range(size):
                    orbits.monodromy[s, k, j] = (slots.ends[s, 1 + j, k] - slots.ends[s, 0, k]) / FD_STEP
            regular = solve_both(orbits.monodromy[s], first, second, matrix)
            step = longest(first)
            orbits.steps[s] += 1
            if not regular or not step < np.inf or (step > CONTRACTS * before[s] and step > NEAR):
                orbits.outcome[s] = FAILED
                continue
            share = min(1.0, LARGEST / step) if step > 0.0 else 1.0
            for k in range(size):
                slots.x[s, k] += share * first[k]
                orbits.slope[s, k] = second[k]
            slots.memory[s], slots.branch[s] = slots.memory_after[s], slots.branch_after[s]
            before[s] = step if share == 1.0 else np.inf
            if step < NEAR:
                orbits.outcome[s] = NEARBY
                before[s] = np.inf
    passes = MEMORY_PASSES if model.memory_scale.shape[0] > 0 else MOST_PASSES
    for attempt in range(passes):
        going = 0
        for s in range(count):
            if orbits.outcome[s] == NEARBY:
                which[going] = s
                going += 1
        if going == 0:
            break
        march(slots, which, going, 1, True, model, drive, room)
        for g in range(going):
            s = which[g]
            polish(slots, s, orbits, before, attempt == passes - 1, model, first, second, matrix)
    going = 0
    for s in range(count):
        if orbits.outcome[s] != CONVERGED:
            orbits.outcome[s] = FAILED
        else:
            which[going] = s
            going += 1
    if going > 0:
        balance(slots, which, going, model, drive, orbits, room)


def balance(slots: Any, which: Any, count: int, model: Any, drive: Any, orbits: Any, room: Any) -> None:
    """Average monodromy matrices, taken to one side, with those to the other: the error falls from first to second order."""
    size = 2 * mode_count()
    march(slots, which, count, size, False, model, drive, room)
    for g in range(count):
        s = which[g]
        for k in range(size):
            for j in range(size):
                other = (slots.ends[s, 0, k] - slots.ends[s, 1 + j, k]) / FD_STEP
                orbits.monodromy[s, k, j] = 0.5 * (orbits.monodromy[s, k, j] + other)


def polish(
    slots: Any, s: int, orbits: Any, before: Any, last: bool, model: Any, first: Any, second: Any, matrix: Any
) -> None:
    """Accept the state of a slot that was marched alone as its orbit, or take a last Newton step."""
    size, residual, rest = 2 * mode_count(), 0.0, 0.0
    for k in range(size):
        first[k] = slots.ends[s, 0, k] - slots.x[s, k]
        second[k] = 0.0
    residual = longest(first)
    for k in range(model.memory_scale.shape[0]):
        rest = max(rest, abs(slots.memory_after[s, k] - slots.memory[s, k]) / model.memory_scale[k])
    for k in range(model.hysteresis):
        rest = np.inf if slots.branch_after[s, k] != slots.branch[s, k] else rest
    solve_both(orbits.monodromy[s], first, second, matrix)
    step = longest(first)
    orbits.residual[s] = max(residual, rest)
    if rest < TOLERANCE and (step < TOLERANCE or residual < RESIDUAL):
        orbits.outcome[s] = CONVERGED
        return
    slow = step > CONTRACTS * before[s] and rest < TOLERANCE
    if not step < NEAR or slow or last:
        orbits.outcome[s] = CONVERGED if residual < ROUGH_RESIDUAL and rest < TOLERANCE else FAILED
        return
    before[s] = step
    for k in range(size):
        slots.x[s, k] += first[k]
    slots.memory[s], slots.branch[s] = slots.memory_after[s], slots.branch_after[s]


def is_stable(monodromy: Any) -> bool:
    """Say whether all multipliers lie within the unit circle: whether powers of the monodromy matrix die out."""
    size = 2 * mode_count()
    if size == 2:
        area = monodromy[0, 0] * monodromy[1, 1] - monodromy[0, 1] * monodromy[1, 0]
        return bool(abs(area) < 1.0 and abs(monodromy[0, 0] + monodromy[1, 1]) < 1.0 + area)
    power, product = monodromy.copy(), np.empty((size, size))
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
    return bool(growth < 0.0)
