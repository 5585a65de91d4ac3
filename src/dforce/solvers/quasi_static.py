"""A stable orbit followed while a parameter changes so slowly that the motion stays on it.

Predictor: the cubic through the last two orbits and their slopes. Corrector: ``newton``. An orbit continues the orbit before
if it is stable and either agrees with the prediction, or is close to the orbit before with a chord that fits both slopes. These
tests also yield how much longer the step might have been, and so the next step. A step that fails is shortened, so that the
curve does not depend on the requested values. Near a fold the state changes like the root of the distance to it: predictions
are cubics of that root, and steps lead three quarters of the way. A step over which multipliers may have passed +1 or -1 is
shortened, too: a narrow window of instability may lie there. If no step is accepted the state has ended: at a fold, a doubling,
or a force that jumps (``continuation`` locates folds on curves). Where samples of the motion pass a kink of the force the map
has small edges, at which Newton's method may fail. A stable orbit close behind continues the state as well.

Several orbits ahead are sought at once, as vector lanes cost little. Each is compared with the prediction from the orbits
before it, so that the same orbits count as with one at a time.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dforce.solvers.newton import begin, central_differences, longest, march_once
from dforce.solvers.period_map import NOTHING, carry, put_numbers, put_rows
from dforce.solvers.quasi_static_steps import (
    TINY,
    TOWARDS,
    before_of,
    fold_ahead,
    last_of,
    longer_by,
    margins_of,
    may_have_passed,
    next_step,
    predict,
    shortened,
)
from dforce.solvers.stability import is_stable

FIRST = 0.01  # of the parameter's unit: first step, predicted by a slope alone
SMALLEST = 1e-7  # of the parameter's unit: a state that has no step so short has ended
LEAP = 4.0  # steps to the last orbit that is sought at once, at most: from farther Newton's method starts too badly
BRIDGES = (1e-6, 1e-5, 1e-4)  # of the parameter's unit: steps tried over an edge of the map
COLUMNS = 32  # motions that are marched at once for each problem: several orbits ahead, with their neighbors
SHORT = 1e-4  # of the parameter's unit: a step so short
MOST_SHORT = 300  # such steps between two values, at most: with more the map is too rough
FOLLOWED, ENDED, TOO_ROUGH = 0, 1, 2


class Path(NamedTuple):
    """The path of each problem's state: values of the parameter in one direction, and how many of them count.

    Attributes
    ----------
    values, counts
        (problems, values) and (problems,).
    predicted
        Largest distance from its prediction (of the free amplitude) at which an orbit continues the orbit before.
    wanted
        The measurements to take of the orbits at the values, as in `Slots`.
    """

    values: Any
    counts: Any
    predicted: float
    wanted: int


class Stretch(NamedTuple):
    """The stretch of stable orbits of each problem along its path, and the last orbit of all, on the path or not.

    Attributes
    ----------
    x, memory, branch, monodromy, rows, residual, steps
        Of each orbit, (problems, values, ...), as in `Slots` and `Orbits`.
    done
        How many values of the path were reached.
    outcome
        FOLLOWED to the end of the path, ENDED before, or given up where the map is TOO_ROUGH.
    last_value, last_x, last_memory, last_branch, last_monodromy, last_slope
        The last orbit: where a path ends, or just before the end of the state. To begin with: the start.
    fold
        Value at which the last two orbits predict a fold; NaN where they predict none ahead.
    """

    x: Any
    memory: Any
    branch: Any
    monodromy: Any
    rows: Any
    residual: Any
    steps: Any
    done: Any
    outcome: Any
    last_value: Any
    last_x: Any
    last_memory: Any
    last_branch: Any
    last_monodromy: Any
    last_slope: Any
    fold: Any

    def take(self, which: Any) -> Stretch:
        """Return the stretches of some problems."""
        return Stretch(*(array[which] for array in self))


class Course(NamedTuple):
    """How far `follow` has come, between two calls.

    Attributes
    ----------
    before, x_before, slope_before
        Of each problem the orbit before its last one, as in `Stretch`.
    margin, closing
        Margins of its last orbit's multipliers from +1 and -1, and how fast both fell on the way there, per unit.
    reach, bridge, short
        Its next step, of the parameter's unit; which bridge is tried, from 1 on, or 0; steps in a row that were so short.
    fresh, going
        Whether its first orbit is still to be found, and whether it goes on: 1 or 0.
    sought, place
        Number of orbits under search, (1,); the place of each on the path, or -1.
    """

    before: Any
    x_before: Any
    slope_before: Any
    margin: Any
    closing: Any
    reach: Any
    bridge: Any
    short: Any
    fresh: Any
    going: Any
    sought: Any
    place: Any


def set_out(stretch: Stretch, slots: int) -> Course:
    """Return the course of problems at their starts, of which so many orbits at most are sought at once."""
    cases = len(stretch.last_x)
    return Course(
        stretch.last_value.copy(),
        stretch.last_x.copy(),
        stretch.last_slope.copy(),
        np.zeros((cases, 2)),
        np.zeros((cases, 2)),
        np.full(cases, FIRST),
        np.zeros(cases, np.int64),
        np.zeros(cases, np.int64),
        np.ones(cases, np.int64),
        np.ones(cases, np.int64),
        np.zeros(1, np.int64),
        np.empty(slots, np.int64),
    )


def follow(path: Any, stretch: Any, course: Any, slots: Any, orbits: Any, marching: Any, marches: int) -> bool:
    """Follow the stable orbit near each problem's start along its path, and measure it at each value.

    The first orbit is sought at the start. A problem without a stable orbit there has ENDED with nothing done. `slots` and
    `orbits` hold as many for each problem as orbits are looked for ahead. A call ends after so many marches, and the next one
    goes on there, to the last bit. Return whether all is done.
    """
    which = np.empty(slots.case.shape[0], np.int64)
    for _ in range(marches):
        if course.sought[0] == 0:
            look_ahead(path, stretch, course, slots, orbits, marching.model.unit)
            if course.sought[0] == 0:
                return True
            begin(orbits, course.sought[0])
        if not march_once(slots, course.sought[0], True, orbits, which, marching):
            longer = np.empty(course.sought[0])
            fitting = judge(path, stretch, course, slots, orbits, marching.model.unit, longer, which)
            if fitting > 0:
                central_differences(slots, which, fitting, orbits, marching)
            go_ahead(path, stretch, course, slots, orbits, marching.model.unit, longer)
    return False


def look_ahead(path: Any, stretch: Any, course: Any, slots: Any, orbits: Any, units: Any) -> None:
    """Choose where the next orbits of each problem are sought, and predict them."""
    size, cases, most = slots.x.shape[1], path.counts.shape[0], slots.case.shape[0]
    change, count = np.empty(size + 1), 0
    for case in range(cases):
        begun, start, unit = count, stretch.last_value[case], units[case]
        if course.going[case] == 1 and course.fresh[case] == 1:
            slots.value[count] = start
            course.place[count] = 0 if path.values[case, 0] == start and path.counts[case] > 0 else -1
            put_numbers(slots.x[count], stretch.last_x[case])
            count += 1
        elif course.going[case] == 1:
            count += choose_values(case, count, most // cases, path, stretch, course, slots, unit)
            for s in range(begun, count):
                predict(last_of(stretch, case), before_of(course, case), unit, slots.value[s], slots.x[s])
        for s in range(begun, count):
            slots.case[s], orbits.unit[s] = case, unit
            slots.wanted[s] = path.wanted if course.place[s] >= 0 else NOTHING
            put_numbers(slots.memory[s], stretch.last_memory[case])
            put_numbers(slots.branch[s], stretch.last_branch[case])
            for k in range(size):
                change[k] = slots.x[s, k] - stretch.last_x[case, k]
            change[size] = (slots.value[s] - start) / unit
            carry(slots, s, change)
    course.sought[0] = count


def choose_values(
    case: int, first: int, most: int, path: Any, stretch: Any, course: Any, slots: Any, unit: float
) -> int:
    """Write the values at which the next orbits of a problem are sought, from a slot on; return how many.

    They are the values of the path, with even steps between values that are farther apart than a step.
    """
    start, at, values = stretch.last_value[case], stretch.done[case], path.values[case]
    (_, _, slope), (before, _, slope_before) = last_of(stretch, case), before_of(course, case)
    fold = fold_ahead(start, longest(slope), before, longest(slope_before))
    way = 1.0 if values[at] > start else -1.0
    reach, farthest = course.reach[case] * unit, LEAP * course.reach[case] * unit
    if course.bridge[case] > 0:
        reach, most, fold = BRIDGES[course.bridge[case] - 1] * unit, 1, np.nan
    value, count = start, 0
    while count < most and at < path.counts[case]:
        left = way * (fold - value)
        if left > 0.0:
            if left < (1.0 - TOWARDS) ** 2 * abs(fold - start):  # where it lies is known better from nearby
                break
            reach = min(reach, max(TOWARDS * left, SMALLEST * unit))
        steps = np.ceil((1.0 - TINY) * abs(values[at] - value) / reach)
        value = values[at] if steps <= 1.0 else value + (values[at] - value) / steps
        if count > 0 and abs(value - start) > farthest:
            break
        slots.value[first + count] = value
        course.place[first + count] = at if steps <= 1.0 else -1
        at, count = at + (1 if steps <= 1.0 else 0), count + 1
    return count


def judge(path: Any, stretch: Any, course: Any, slots: Any, orbits: Any, units: Any, longer: Any, which: Any) -> int:
    """Write how much longer the steps to the orbits found might be, and the numbers of the fitting ones; return how many."""
    fitting = 0
    for s in range(course.sought[0]):
        longer[s] = longer_by(s, longer, slots, orbits, stretch, course, units[slots.case[s]], path.predicted)
        if longer[s] >= 1.0:
            which[fitting] = s
            fitting += 1
    return fitting


def go_ahead(path: Any, stretch: Any, course: Any, slots: Any, orbits: Any, units: Any, longer: Any) -> None:
    """Go to the orbits found that continue the last ones of their problems; choose the next steps."""
    count, margin = course.sought[0], np.empty(2)
    course.sought[0] = 0
    s = 0
    while s < count:
        case, done, refused, step = slots.case[s], stretch.done[slots.case[s]], False, np.inf
        unit, begun, fresh = units[case], stretch.last_value[case], course.fresh[case] == 1
        while s < count and slots.case[s] == case:
            gap = abs(slots.value[s] - stretch.last_value[case]) / unit
            stable = longer[s] >= 1.0 and is_stable(orbits.monodromy[s])
            margins_of(orbits.monodromy[s], margin)
            if stable and not refused and not may_have_passed(margin, course.margin[case], course.closing[case], gap):
                keep_before(stretch, course, case)
                for k in range(2):
                    fallen = course.margin[case, k] - margin[k]
                    course.closing[case, k] = 0.0 if fresh or gap == 0.0 else fallen / gap
                    course.margin[case, k] = margin[k]
                take(s, course.place[s], slots, orbits, stretch)
                step = min(step, next_step(longer[s], gap, course.reach[case]))
                if fresh:  # there is no other one before
                    keep_before(stretch, course, case)
            elif not refused:
                refused = True
                if fresh:
                    course.going[case], stretch.outcome[case] = 0, ENDED
                elif course.bridge[case] > 0:
                    course.bridge[case] += 1
                else:
                    course.reach[case] = shortened(longer[s]) * gap
            s += 1
        if not refused and course.bridge[case] > 0:
            course.bridge[case], course.reach[case] = 0, gap
        elif not refused and not fresh:
            course.reach[case] = step
        course.fresh[case] = 0
        if course.reach[case] < SMALLEST and course.bridge[case] == 0:
            course.bridge[case] = 1
        if course.bridge[case] > len(BRIDGES):
            course.going[case], stretch.outcome[case] = 0, ENDED
        if stretch.done[case] > done:
            course.short[case] = 0
        elif abs(stretch.last_value[case] - begun) < SHORT * unit:
            course.short[case] += 1
        if course.short[case] > MOST_SHORT:
            course.going[case], stretch.outcome[case] = 0, TOO_ROUGH
        if stretch.done[case] == path.counts[case]:
            course.going[case] = 0


def keep_before(stretch: Any, course: Any, case: int) -> None:
    """Keep a problem's last orbit as the one before."""
    course.before[case] = stretch.last_value[case]
    put_numbers(course.x_before[case], stretch.last_x[case])
    put_numbers(course.slope_before[case], stretch.last_slope[case])


def take(s: int, at: int, slots: Any, orbits: Any, stretch: Any) -> None:
    """Make the orbit of a slot the last one of its problem, and keep it where it lies on the path."""
    case = slots.case[s]
    stretch.fold[case] = fold_ahead(
        slots.value[s], longest(orbits.slope[s]), stretch.last_value[case], longest(stretch.last_slope[case])
    )
    stretch.last_value[case] = slots.value[s]
    put_numbers(stretch.last_x[case], slots.x[s])
    put_numbers(stretch.last_memory[case], slots.memory[s])
    put_numbers(stretch.last_branch[case], slots.branch[s])
    put_numbers(stretch.last_slope[case], orbits.slope[s])
    put_rows(stretch.last_monodromy[case], orbits.monodromy[s])
    if at < 0:
        return
    put_numbers(stretch.x[case, at], slots.x[s])
    put_numbers(stretch.memory[case, at], slots.memory[s])
    put_numbers(stretch.branch[case, at], slots.branch[s])
    put_rows(stretch.monodromy[case, at], orbits.monodromy[s])
    put_rows(stretch.rows[case, at], slots.rows[s])
    stretch.residual[case, at], stretch.steps[case, at] = orbits.residual[s], orbits.steps[s]
    stretch.done[case] = at + 1
