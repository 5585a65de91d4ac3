"""A stable orbit followed while a parameter changes so slowly that the motion stays on it.

Predictor: the cubic through the last two orbits and their slopes. Corrector: ``newton``. A step is accepted where the orbit
is stable and either agrees with the prediction, or is close to the last orbit with a chord that fits both slopes. Otherwise it
is shortened, so that the curve does not depend on the values asked for. Where no step is accepted the state has ended: at a
fold, a doubling, or a force that jumps (``continuation`` locates folds on curves). Where samples of the motion pass a
kink of the force the map has small edges, at which Newton's method may fail: a stable orbit close behind continues the state
as well.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dforce.kernel.vocabulary import motion_size
from dforce.solvers.newton import CONVERGED, begin, central_differences, longest, march_once
from dforce.solvers.period_map import NOTHING, carry
from dforce.solvers.stability import is_stable

LARGEST = 0.1  # of the parameter's unit: step
FIRST = 0.01  # of the parameter's unit: first step, predicted by a slope alone
SMALLEST = 1e-7  # of the parameter's unit: a state that has no step so short has ended
EXACT = 1e-8  # of the free amplitude: where predictions are so good, as far from the surface, steps may be longer
GROWTH, SHRINK = 3.0, 0.25  # of the next step after one that was taken, and after one that was not
PREDICTED = 1e-4  # of the free amplitude: an orbit so near to its prediction continues the one before
CHORD = 0.02  # of the free amplitude: so near to the one before, another test will do as well:
BENT = 0.1  # of a step times the slope: how far the chord may differ from that of the mean slope
TURNED = 0.01  # of the free amplitude: change of the slope, times the step; with more a test may be passed by chance
BRIDGES = (1e-6, 1e-5, 1e-4)  # of the parameter's unit: steps tried over an edge of the map
SAME = 1e-3  # of the free amplitude: an orbit so near behind an edge continues the one before it
FARTHEST = 10.0  # times the distance of the last two orbits: beyond, the cubic through them is worse than a line
COLUMNS = 32  # motions marched at once where there are few problems: several orbits ahead
SHORT, MOST_SHORT = (
    1e-4,
    300,
)  # of the parameter's unit: with more steps so short between two values the map is too rough
FOLLOWED, ENDED, TOO_ROUGH = 0, 1, 2


class Path(NamedTuple):
    """Where each problem's state is followed to: values of the parameter one way, and how many of them count.

    Attributes
    ----------
    values, counts
        (problems, values) and (problems,).
    predicted
        So near to its prediction (of the free amplitude) an orbit continues the one before.
    wanted
        What of the orbits at the values will be read, as in `Slots`.
    """

    values: Any
    counts: Any
    predicted: float
    wanted: int


class Branch(NamedTuple):
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
        Value at which the last two orbits foretell a fold; NaN where they foretell none ahead.
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


class Course(NamedTuple):
    """How far `follow` has come, between two calls.

    Attributes
    ----------
    before, x_before, slope_before
        Of each problem the orbit before its last one, as in `Branch`.
    reach, bridge, short
        Its next step, of the parameter's unit; which bridge is tried, from 1 on, or 0; steps in a row that were so short.
    fresh, going
        Whether its first orbit is still to be found, and whether it goes on: 1 or 0.
    sought, place, guesses
        Number of orbits under search, (1,); the place of each on the path, or -1; its predicted state.
    """

    before: Any
    x_before: Any
    slope_before: Any
    reach: Any
    bridge: Any
    short: Any
    fresh: Any
    going: Any
    sought: Any
    place: Any
    guesses: Any


def set_out(branch: Branch, slots: int) -> Course:
    """Return the course of problems at their starts, of which so many orbits at most are sought at once."""
    cases, size = branch.last_x.shape
    return Course(
        branch.last_value.copy(),
        branch.last_x.copy(),
        branch.last_slope.copy(),
        np.full(cases, FIRST),
        np.zeros(cases, np.int64),
        np.zeros(cases, np.int64),
        np.ones(cases, np.int64),
        np.ones(cases, np.int64),
        np.zeros(1, np.int64),
        np.empty(slots, np.int64),
        np.empty((slots, size)),
    )


def predict(
    start: float, x: Any, slope: Any, before: float, x_before: Any, slope_before: Any, at: float, out: Any
) -> None:
    """Write the state at a scaled parameter by the cubic through two orbits, or by a line where there is only one."""
    span = start - before
    for k in range(out.shape[0]):
        if abs(at - start) > FARTHEST * abs(span):
            out[k] = x[k] + slope[k] * (at - start)
            continue
        s = (at - start) / span  # 0 at the last orbit, -1 at the one before
        rise = x[k] - x_before[k]
        a, b = span * slope[k], span * slope_before[k]
        out[k] = x[k] + s * (a + s * ((2.0 * a + b - 3.0 * rise) + s * (a + b - 2.0 * rise)))


def follow(
    path: Any, branch: Any, course: Any, slots: Any, orbits: Any, room: Any, model: Any, drive: Any, marches: int
) -> bool:
    """Follow the stable orbit near each problem's start along its path, and measure it at each value.

    The first orbit is sought at the start. A problem without a stable orbit there has ENDED with nothing done. `slots` and
    `orbits` hold as many for each problem as orbits are looked for ahead. A call ends after so many marches, and the next one
    goes on there, to the last bit. Return whether all is done.
    """
    which = np.empty(slots.case.shape[0], np.int64)
    for _ in range(marches):
        if course.sought[0] == 0:
            look_ahead(path, branch, course, slots, orbits, model)
            if course.sought[0] == 0:
                return True
            begin(orbits, course.sought[0])
        if not march_once(slots, course.sought[0], True, model, drive, orbits, which, room):
            go_ahead(path, branch, course, slots, orbits, which, room, model, drive)
            course.sought[0] = 0
    return False


def look_ahead(path: Any, branch: Any, course: Any, slots: Any, orbits: Any, model: Any) -> None:
    """Choose where the next orbits of each problem are sought, and predict them."""
    size, cases, most = motion_size(), path.counts.shape[0], slots.case.shape[0]
    states, branches, ahead = model.memory_scale.shape[0], model.hysteresis, most // cases
    place, guesses, change, count = course.place, course.guesses, np.empty(size + 1), 0
    for case in range(cases):
        if course.going[case] == 0:
            continue
        unit, start, at = model.unit[case], branch.last_value[case], branch.done[case]
        if course.fresh[case] == 1:
            slots.case[count], slots.value[count] = case, start
            place[count] = 0 if path.values[case, 0] == start and path.counts[case] > 0 else -1
            for k in range(size):
                guesses[count, k] = branch.last_x[case, k]
            count += 1
            continue
        way = 1.0 if path.values[case, at] > start else -1.0
        step, most_now, several = course.reach[case], ahead, 0
        if course.bridge[case] > 0:
            step, most_now = BRIDGES[course.bridge[case] - 1], 1
        while several < most_now and at + several < path.counts[case]:
            if abs(path.values[case, at + several] - start) > step * unit:
                break
            slots.case[count], slots.value[count] = case, path.values[case, at + several]
            place[count] = at + several
            count, several = count + 1, several + 1
        if several == 0:
            slots.case[count], slots.value[count], place[count] = case, start + way * step * unit, -1
            count, several = count + 1, 1
        for s in range(count - several, count):
            predict(
                start / unit,
                branch.last_x[case],
                branch.last_slope[case],
                course.before[case] / unit,
                course.x_before[case],
                course.slope_before[case],
                slots.value[s] / unit,
                guesses[s],
            )
    for s in range(count):
        case = slots.case[s]
        for k in range(size):
            slots.x[s, k] = guesses[s, k]
        for k in range(states):
            slots.memory[s, k] = branch.last_memory[case, k]
        for k in range(branches):
            slots.branch[s, k] = branch.last_branch[case, k]
        for k in range(size):
            change[k] = guesses[s, k] - branch.last_x[case, k]
        change[size] = (slots.value[s] - branch.last_value[case]) / model.unit[case]
        carry(slots, s, change)
        slots.wanted[s] = path.wanted if place[s] >= 0 else NOTHING
        orbits.unit[s] = model.unit[case]
    course.sought[0] = count


def go_ahead(
    path: Any, branch: Any, course: Any, slots: Any, orbits: Any, which: Any, room: Any, model: Any, drive: Any
) -> None:
    """Go to the orbits found that continue the last ones of their problems; choose the next steps."""
    size, count, place, guesses = motion_size(), course.sought[0], course.place, course.guesses
    fits = np.empty(count, np.bool_)
    fitting = 0
    for s in range(count):
        case = slots.case[s]
        last = branch.last_value[case], branch.last_x[case], branch.last_slope[case]
        fits[s] = True
        if s > 0 and slots.case[s - 1] == case:
            last, fits[s] = (slots.value[s - 1], slots.x[s - 1], orbits.slope[s - 1]), fits[s - 1]
        fits[s] &= orbits.outcome[s] == CONVERGED
        if fits[s] and course.fresh[case] == 0:
            fits[s] = continues(
                s, last, slots, orbits, guesses[s], model.unit[case], course.bridge[case], path.predicted
            )
        if fits[s]:
            which[fitting] = s
            fitting += 1
    if fitting > 0:
        central_differences(slots, which, fitting, model, drive, orbits, room)
    s = 0
    while s < count:
        case, begun, done = slots.case[s], branch.last_value[slots.case[s]], branch.done[slots.case[s]]
        unit, refused = model.unit[case], False
        while s < count and slots.case[s] == case:
            if not refused:
                refused = not (fits[s] and is_stable(orbits.monodromy[s]))
                if refused and course.fresh[case] == 1:
                    course.going[case], branch.outcome[case] = 0, ENDED
                elif refused and course.bridge[case] > 0:
                    course.bridge[case] += 1
                elif refused:
                    course.reach[case] = SHRINK * abs(slots.value[s] - branch.last_value[case]) / unit
                else:
                    if course.fresh[case] == 0 and branch.last_value[case] == begun:
                        course.before[case] = begun
                        for k in range(size):
                            course.x_before[case, k] = branch.last_x[case, k]
                            course.slope_before[case, k] = branch.last_slope[case, k]
                    take(s, place[s], slots, orbits, branch)
                    if course.fresh[case] == 1:
                        course.before[case] = branch.last_value[case]
            s += 1
        if not refused and course.fresh[case] == 0:
            astray, longer = 0.0, max(course.reach[case], GROWTH * abs(branch.last_value[case] - begun) / unit)
            for k in range(size):
                astray = max(astray, abs(slots.x[s - 1, k] - guesses[s - 1, k]))
            course.reach[case] = longer if astray < EXACT else min(LARGEST, longer)
        if not refused and course.bridge[case] > 0:
            course.bridge[case], course.reach[case] = 0, abs(branch.last_value[case] - begun) / unit
        course.fresh[case] = 0
        if course.reach[case] < SMALLEST and course.bridge[case] == 0:
            course.bridge[case] = 1
        if course.bridge[case] > len(BRIDGES):
            course.going[case], branch.outcome[case] = 0, ENDED
        if branch.done[case] > done:
            course.short[case] = 0
        elif abs(branch.last_value[case] - begun) < SHORT * unit:
            course.short[case] += 1
        if course.short[case] > MOST_SHORT:
            course.going[case], branch.outcome[case] = 0, TOO_ROUGH
        if branch.done[case] == path.counts[case]:
            course.going[case] = 0


def continues(
    s: int, last: Any, slots: Any, orbits: Any, guess: Any, unit: float, bridge: int, predicted: float
) -> bool:
    """Say whether the orbit of a slot continues the last one of its problem: value, state and slope."""
    size, (value, x, slope) = slots.x.shape[1], last
    step = (slots.value[s] - value) / unit
    astray, chord, bent, turned = 0.0, 0.0, 0.0, 0.0
    for k in range(size):
        moved = slots.x[s, k] - x[k]
        astray = max(astray, abs(slots.x[s, k] - guess[k]))
        chord = max(chord, abs(moved))
        turned = max(turned, abs(step * (orbits.slope[s, k] - slope[k])))
        bent = max(bent, abs(moved - 0.5 * step * (orbits.slope[s, k] + slope[k])))
    if bridge > 0:
        return chord < SAME
    steepest = max(longest(orbits.slope[s]), longest(slope))
    near = chord < CHORD and bent < BENT * abs(step) * steepest
    return bool(turned < TURNED and (astray < predicted or near))


def fold_ahead(value: float, slope: float, value_before: float, slope_before: float) -> float:
    """Return the value at which a fold is expected from the slopes of two orbits, the largest component of each; or NaN.

    Near a fold the state moves like the square root of the distance to it, so the inverse square of the slope falls linearly to
    zero.
    """
    if not (slope > slope_before > 0.0):
        return np.nan
    return value + (value - value_before) * slope_before**2 / (slope**2 - slope_before**2)


def take(s: int, at: int, slots: Any, orbits: Any, branch: Any) -> None:
    """Make the orbit of a slot the last one of its problem, and keep it where it lies on the path."""
    case, size = slots.case[s], slots.x.shape[1]
    branch.fold[case] = fold_ahead(
        slots.value[s], longest(orbits.slope[s]), branch.last_value[case], longest(branch.last_slope[case])
    )
    branch.last_value[case] = slots.value[s]
    for k in range(size):
        branch.last_x[case, k], branch.last_slope[case, k] = slots.x[s, k], orbits.slope[s, k]
        for j in range(size):
            branch.last_monodromy[case, k, j] = orbits.monodromy[s, k, j]
    for k in range(slots.memory.shape[1]):
        branch.last_memory[case, k] = slots.memory[s, k]
    for k in range(slots.branch.shape[1]):
        branch.last_branch[case, k] = slots.branch[s, k]
    if at < 0:
        return
    for k in range(size):
        branch.x[case, at, k] = slots.x[s, k]
        for j in range(size):
            branch.monodromy[case, at, k, j] = orbits.monodromy[s, k, j]
    for k in range(slots.memory.shape[1]):
        branch.memory[case, at, k] = slots.memory[s, k]
    for k in range(slots.branch.shape[1]):
        branch.branch[case, at, k] = slots.branch[s, k]
    for period in range(slots.rows.shape[1]):
        for k in range(slots.rows.shape[2]):
            branch.rows[case, at, period, k] = slots.rows[s, period, k]
    branch.residual[case, at], branch.steps[case, at] = orbits.residual[s], orbits.steps[s]
    branch.done[case] = at + 1
