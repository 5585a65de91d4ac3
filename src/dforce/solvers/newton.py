"""Newton's method for the periodic orbits of a block of problems.

An orbit is a fixed point of the map P over one common period or several, P(x, value) = x. The bordered system has one row
more, `normal`: it fixes the parameter, or makes the correction orthogonal to the tangent of a curve of orbits
(pseudo-arclength). With the monodromy matrix M = dP/dx the Newton step (dx, dv) solves

    (I - M) dx - dP/dv dv = P(x) - x,    normal (dx, dv) = 0.

Memory and branches of the forces follow the motion: they are carried on from period to period until they repeat with it.
So M is the response of the motion after the memory has responded, too. If the memory relaxes, det(1 - M) equals the
determinant of motion and memory together except for a positive factor: folds and the signs of indices are the same. Other
multipliers differ if the memory lasts about as long as a period, and the memory's multipliers are missing. Where they count,
the memory belongs to the vector x; see ``parameter_range``.

`choose_next` chooses the slots to integrate, and `take_steps` uses their ends: any integrator can work between them.

Source: R. Seydel, Practical Bifurcation and Stability Analysis, Springer (2010), chapters 4 and 7.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.kernel.linker import uncounted
from dforce.kernel.vocabulary import motion_size
from dforce.solvers.period_map import FD_STEP, carry, go_on, march, unrest

TOLERANCE = 1e-9  # of the free amplitude: Newton step at which an orbit is accepted
RESIDUAL = 1e-11  # of the free amplitude: residual that is rounding, for any Newton step
ROUGH_RESIDUAL = 1e-9  # the same where forces that jump leave the map so rough
NEAR = 1e-5  # of the free amplitude: a monodromy matrix taken so near to the orbit is its own
CONTRACTS = 0.5  # each Newton step has to be shorter than the one before by this
LARGEST = 0.3  # of the free amplitude: longer Newton steps are shortened
MOST_STEPS, MOST_PASSES = 10, 4
PENDING, NEARBY, CONVERGED, FAILED = 0, 1, 2, 3  # outcome of a slot


class Orbits(NamedTuple):
    """The orbits that Newton's method finds, a row for each slot.

    Attributes
    ----------
    normal
        The row that borders the equations, (slots, size + 1): normal to the plane, in which the parameter counts in its unit.
    unit
        Unit of the parameter, (slots,).
    monodromy, by_parameter
        Derivatives of the map by the motion and by the parameter (per unit), (slots, size, size), (slots, size).
    slope
        Derivative of the orbit by the parameter (per unit), where the row that borders holds the parameter, (slots, size).
    residual, steps
        How far from its start the orbit ends, relative to the free amplitude; Newton steps taken.
    outcome
        PENDING, NEARBY, CONVERGED or FAILED.
    passes, before
        How often the state was advanced alone; length of the Newton step before.
    """

    normal: Any
    unit: Any
    monodromy: Any
    by_parameter: Any
    slope: Any
    residual: Any
    steps: Any
    outcome: Any
    passes: Any
    before: Any


def empty_orbits(slots: int, size: int) -> Orbits:
    """Return room for orbits that are sought at their values of the parameter."""
    normal = np.zeros((slots, size + 1))
    normal[:, size] = 1.0
    return Orbits(
        normal,
        np.empty(slots),
        np.empty((slots, size, size)),
        np.empty((slots, size)),
        np.empty((slots, size)),
        np.empty(slots),
        np.empty(slots, np.int64),
        np.empty(slots, np.int64),
        np.empty(slots, np.int64),
        np.empty(slots),
    )


def subtract_from_one(monodromy: Any, matrix: Any) -> None:
    """Write I - M into the upper left of a matrix."""
    for i in range(monodromy.shape[0]):
        for j in range(monodromy.shape[0]):
            matrix[i, j] = (1.0 if i == j else 0.0) - monodromy[i, j]


def border(orbits: Any, s: int, matrix: Any) -> None:
    """Write the equations of the Newton step of a slot into a matrix, (size + 1, size + 1)."""
    size = orbits.slope.shape[1]
    subtract_from_one(orbits.monodromy[s], matrix)
    for k in range(size):
        matrix[k, size] = -orbits.by_parameter[s, k]
    for k in range(size + 1):
        matrix[size, k] = orbits.normal[s, k]


def solve_both(matrix: Any, first: Any, second: Any) -> bool:
    """Solve linear equations for two right sides in place, by elimination with pivots; return whether there is a solution."""
    size = matrix.shape[0]
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


def solve_each(matrix: Array, sides: Array) -> Array:
    """Return the solutions of many systems of linear equations, (systems, size, sides); NaN where there is none."""
    out = np.full(sides.shape, np.nan)
    regular = np.asarray(np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(sides).all(axis=(1, 2)))
    regular[regular] = np.linalg.slogdet(matrix[regular]).sign != 0.0  # many small pivots make no zero of it
    out[regular] = np.linalg.solve(matrix[regular], sides[regular])
    return out


def longest(vector: Any) -> float:
    """Return the largest modulus of a vector's numbers."""
    most = 0.0
    for value in vector:
        most = max(most, abs(value)) if abs(value) < np.inf else np.inf
    return most


def find_orbits(slots: Any, orbits: Any, marching: Any) -> None:
    """Iterate by Newton's method. The monodromy matrix comes from the last full step, by forward differences."""
    count = slots.case.shape[0]
    which = np.empty(count, np.int64)
    for s in range(count):
        orbits.unit[s] = marching.model.unit[slots.case[s]]
    begin(orbits, count)
    while march_once(slots, count, False, orbits, which, marching):
        pass


def begin(orbits: Any, count: int) -> None:
    """Make the first `count` slots ready for Newton's method."""
    for s in range(count):
        orbits.outcome[s], orbits.steps[s], orbits.passes[s] = PENDING, 0, 0
        orbits.residual[s], orbits.before[s] = np.inf, np.inf


def march_once(slots: Any, count: int, measured: bool, orbits: Any, which: Any, marching: Any) -> bool:
    """Advance the next of the first `count` slots, and take their Newton steps; return whether there were any."""
    going, each = choose_next(slots, count, orbits, which)
    if going > 0:
        march(slots, which, going, each, measured, marching)
        take_steps(slots, which, going, each, marching.model.gain, marching.model.memory_scale, orbits)
    return bool(going > 0)


@uncounted
def choose_next(slots: Any, count: int, orbits: Any, which: Any) -> Any:
    """Write the numbers of the next slots among the first `count`; return how many, and the columns of each.

    First slots far from their orbits, each with its neighbors, which give the derivatives; then slots nearby, alone.
    """
    size = slots.x.shape[1]
    for phase in range(2):
        going = 0
        for s in range(count):
            if orbits.outcome[s] == (PENDING if phase == 0 else NEARBY):
                which[going] = s
                going += 1
        if going > 0:
            return going, size + 2 if phase == 0 else 1
    return 0, 1


def take_steps(slots: Any, which: Any, count: int, each: int, gain: Any, memory_scale: Any, orbits: Any) -> None:
    """Take a Newton step from the states of the slots that `choose_next` has chosen, or accept them."""
    size = slots.x.shape[1]
    first, second, matrix = np.empty(size + 1), np.empty(size + 1), np.empty((size + 1, size + 1))
    for g in range(count):
        if each > 1:
            newton_step(slots, which[g], orbits, first, second, matrix)
        else:
            simplified_newton_step(slots, which[g], orbits, gain, memory_scale, first, second, matrix)


def newton_step(slots: Any, s: int, orbits: Any, first: Any, second: Any, matrix: Any) -> None:
    """Take a Newton step from a state that was advanced with its neighbors, whose differences are the derivatives."""
    size = slots.x.shape[1]
    for k in range(size):
        first[k], second[k] = slots.ends[s, 0, k] - slots.x[s, k], 0.0
        orbits.by_parameter[s, k] = (slots.ends[s, size + 1, k] - slots.ends[s, 0, k]) / FD_STEP
        for j in range(size):
            orbits.monodromy[s, k, j] = (slots.ends[s, 1 + j, k] - slots.ends[s, 0, k]) / FD_STEP
    first[size], second[size] = 0.0, 1.0
    border(orbits, s, matrix)
    regular = solve_both(matrix, first, second)
    step = longest(first)
    orbits.steps[s] += 1
    if not regular or not step < np.inf or (step > CONTRACTS * orbits.before[s] and step > NEAR):
        orbits.outcome[s] = FAILED
        return
    share = min(1.0, LARGEST / step) if step > 0.0 else 1.0
    for k in range(size + 1):
        first[k] *= share
    for k in range(size):
        slots.x[s, k] += first[k]
        orbits.slope[s, k] = second[k]
    slots.value[s] += first[size] * orbits.unit[s]
    go_on(slots, s)
    carry(slots, s, first)
    orbits.before[s] = step if share == 1.0 else np.inf
    if step < NEAR:
        orbits.outcome[s] = NEARBY
        orbits.before[s] = np.inf
    elif orbits.steps[s] == MOST_STEPS:
        orbits.outcome[s] = FAILED


def central_differences(slots: Any, which: Any, count: int, orbits: Any, marching: Any) -> None:
    """Replace forward by central differences in the monodromy matrices: an error of second order."""
    size = motion_size()
    march(slots, which, count, size, False, marching)
    for g in range(count):
        s = which[g]
        for k in range(size):
            for j in range(size):
                other = (slots.ends[s, 0, k] - slots.ends[s, 1 + j, k]) / FD_STEP
                orbits.monodromy[s, k, j] = 0.5 * (orbits.monodromy[s, k, j] + other)


def simplified_newton_step(
    slots: Any, s: int, orbits: Any, gain: Any, memory_scale: Any, first: Any, second: Any, matrix: Any
) -> None:
    """Accept a state that was advanced alone as its orbit, or take one more Newton step with the derivatives from before."""
    size = slots.x.shape[1]
    for k in range(size):
        first[k], second[k] = slots.ends[s, 0, k] - slots.x[s, k], 0.0
    first[size], second[size] = 0.0, 0.0
    residual = longest(first)
    memories, branches = (slots.memory_after[s], slots.memory[s]), (slots.branch_after[s], slots.branch[s])
    rest = unrest(memories[0], memories[1], branches[0], branches[1], gain[slots.case[s]], memory_scale)
    border(orbits, s, matrix)
    solve_both(matrix, first, second)
    step = longest(first)
    orbits.residual[s] = max(residual, rest)
    orbits.passes[s] += 1
    if rest < TOLERANCE and (step < TOLERANCE or residual < RESIDUAL):
        orbits.outcome[s] = CONVERGED
        return
    slow = step > CONTRACTS * orbits.before[s] and rest < TOLERANCE
    if not step < NEAR or slow or orbits.passes[s] == MOST_PASSES:
        orbits.outcome[s] = CONVERGED if residual < ROUGH_RESIDUAL and rest < TOLERANCE else FAILED
        return
    if rest >= TOLERANCE:  # the memory first: beside a fold the motion answers its errors too strongly
        go_on(slots, s)
        orbits.outcome[s] = PENDING
        return
    orbits.before[s] = step
    for k in range(size):
        slots.x[s, k] += first[k]
    slots.value[s] += first[size] * orbits.unit[s]
    go_on(slots, s)
    carry(slots, s, first)


def multiply(a: Any, b: Any, out: Any) -> None:
    """Write the product of two square matrices."""
    size = out.shape[0]
    for i in range(size):
        for j in range(size):
            out[i, j] = 0.0
            for k in range(size):
                out[i, j] += a[i, k] * b[k, j]
