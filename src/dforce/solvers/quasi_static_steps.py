"""Predictions of the next orbit of a state along a parameter, and tests whether an orbit continues the state.

An orbit has a value, a state and a slope (per unit of the parameter).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.solvers.newton import CONVERGED, longest, solve_both

LARGEST = 0.1  # of the parameter's unit: step
EXACT = 1e-8  # of the free amplitude: where predictions are so good, as far from the surface, steps may be longer
SAFETY, GROWTH = 0.9, 3.0  # of the step that the tests allow; of the one before, at most
SHRINK, SHORTENED = 0.25, 0.5  # of a step that failed: at least, and at most
FOLDING, TOWARDS = 1.0, 0.75  # slope (per unit) from which a fold is predicted; share of the way there in a step
TINY = 1e-12  # of the limit of a test, or of a step
PREDICTED = 1e-4  # of the free amplitude: an orbit so near to its prediction continues the orbit before
CHORD = 0.02  # of the free amplitude: so near to the one before, another test will do as well:
BENT = 0.1  # of a step times the slope: allowed difference of the chord and the mean slope times the step
TURNED = 0.01  # of the free amplitude: change of the slope, times the step; with more a test may be passed by chance
CLOSE, FORETOLD = 0.1, 2.0  # margin within which no window is sought; its change over the predicted change
SAME = 1e-3  # of the free amplitude: an orbit so near behind an edge continues the one before it
FARTHEST = 10.0  # times the distance of the last two orbits: beyond, the cubic through them is worse than a line


def last_of(stretch: Any, case: int) -> Any:
    """Return value, state and slope of a problem's last orbit."""
    return stretch.last_value[case], stretch.last_x[case], stretch.last_slope[case]


def before_of(course: Any, case: int) -> Any:
    """Return value, state and slope of the orbit before the last one."""
    return course.before[case], course.x_before[case], course.slope_before[case]


def predict(last: Any, before: Any, unit: float, value: float, out: Any) -> None:
    """Write the state at a value by the cubic through two orbits, or by a line where there is only one.

    Near a fold the cubic is one of the root of the distance to it.
    """
    (start, x, slope), (begun, x_before, slope_before) = last, before
    start, begun, at, rate, rate_before = start / unit, begun / unit, value / unit, 1.0, 1.0
    fold = fold_ahead(start, longest(slope), begun, longest(slope_before))
    if (fold - at) * (fold - start) > 0.0:
        way = 1.0 if fold > start else -1.0
        start, begun, at = -(abs(fold - start) ** 0.5), -(abs(fold - begun) ** 0.5), -(abs(fold - at) ** 0.5)
        rate, rate_before = -2.0 * way * start, -2.0 * way * begun
    span, reached = start - begun, at - start
    for k in range(out.shape[0]):
        if abs(reached) > FARTHEST * abs(span):
            out[k] = x[k] + rate * slope[k] * reached
            continue
        s = reached / span  # 0 at the last orbit, -1 at the one before
        rise = x[k] - x_before[k]
        a, b = span * rate * slope[k], span * rate_before * slope_before[k]
        out[k] = x[k] + s * (a + s * ((2.0 * a + b - 3.0 * rise) + s * (a + b - 2.0 * rise)))


def fold_ahead(value: float, slope: float, value_before: float, slope_before: float) -> float:
    """Return the value at which a fold is expected from the slopes of two orbits, the largest component of each; or NaN.

    Near a fold the state moves like the square root of the distance to it, so the inverse square of the slope falls linearly to
    zero.
    """
    if not (slope > slope_before > FOLDING):
        return np.nan
    return value + (value - value_before) * slope_before**2 / (slope**2 - slope_before**2)


def longer_by(
    s: int, longer: Any, slots: Any, orbits: Any, stretch: Any, course: Any, unit: float, predicted: float
) -> float:
    """Return how much longer the step to the orbit of a slot might be; below 1 it does not continue the one before.

    `longer` holds the same of the slots before.
    """
    case, guess = slots.case[s], np.empty(slots.x.shape[1])
    last, before = last_of(stretch, case), before_of(course, case)
    if s > 0 and slots.case[s - 1] == case:
        before, last = last, (slots.value[s - 1], slots.x[s - 1], orbits.slope[s - 1])
        if s > 1 and slots.case[s - 2] == case:
            before = slots.value[s - 2], slots.x[s - 2], orbits.slope[s - 2]
        if longer[s - 1] < 1.0:
            return 0.0
    if orbits.outcome[s] != CONVERGED:
        return 0.0
    if course.fresh[case] == 1:
        return 1.0
    predict(last, before, unit, slots.value[s], guess)
    (_, x, slope), step = last, (slots.value[s] - last[0]) / unit
    astray, chord, bent, turned = 0.0, 0.0, 0.0, 0.0
    for k in range(guess.shape[0]):
        moved = slots.x[s, k] - x[k]
        astray = max(astray, abs(slots.x[s, k] - guess[k]))
        chord = max(chord, abs(moved))
        turned = max(turned, abs(step * (orbits.slope[s, k] - slope[k])))
        bent = max(bent, abs(moved - 0.5 * step * (orbits.slope[s, k] + slope[k])))
    if course.bridge[case] > 0:
        return 1.0 if chord < SAME else 0.0
    allowed = BENT * abs(step) * max(longest(orbits.slope[s]), longest(slope))
    near = min(room_for(chord, CHORD, 1.0), room_for(bent, allowed, 2.0))
    most = np.inf if astray < EXACT else max(1.0, LARGEST / max(abs(step), TINY))
    return min(most, room_for(turned, TURNED, 2.0), max(near, room_for(astray, predicted, 4.0)))


def margins_of(monodromy: Any, out: Any) -> None:
    """Write how far the multipliers are from +1 and from -1: the roots of |det(M - 1)| and |det(M + 1)|."""
    size = monodromy.shape[0]
    for side in range(2):
        matrix, product = monodromy.copy(), 1.0
        for k in range(size):
            matrix[k, k] += 2.0 * side - 1.0
        regular = solve_both(matrix, np.zeros(size), np.zeros(size))  # it leaves the pivots on the diagonal
        for k in range(size):
            product *= abs(matrix[k, k])
        out[side] = product**0.5 if regular else 0.0


def may_have_passed(margin: Any, before: Any, closing: Any, gap: float) -> bool:
    """Return whether multipliers may have passed +1 or -1 between two orbits: in a narrow window of instability.

    They may if both margins together do not exceed the fall that the way to the first orbit predicts.
    """
    passed = False
    for side in range(2):
        passed |= CLOSE < margin[side] + before[side] < FORETOLD * closing[side] * gap
    return passed


def next_step(longer: float, gap: float, reach: float) -> float:
    """Return the next step behind an orbit, by how much longer the gap before it might have been."""
    longer *= SAFETY
    return longer * gap if longer < GROWTH else max(reach, GROWTH * gap)  # a small gap does not predict a far one


def shortened(longer: float) -> float:
    """Return how much of a step is tried again, by how much longer it might have been; stability refuses 1 or more."""
    return SHRINK if longer >= 1.0 else min(max(SAFETY * longer, SHRINK), SHORTENED)


def room_for(found: float, allowed: float, order: float) -> float:
    """Return the factor by which a step may grow until an error, which grows with a power of it, reaches its limit."""
    return float(max(found / allowed, TINY) ** (-1.0 / order)) if allowed > 0.0 else 0.0
