"""The map of a block of motions over one common period of all tones, and its derivative.

A block has motions of problems that differ in numbers only, each at its own value of a parameter: the average distance or the
frequency of the first tone. Motions under a force without memory and hysteresis are marched side by side in lanes, others one
after the other. The callers of `march` do not depend on this choice.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dforce.integrators.fitted import fit
from dforce.integrators.lanes import FAR, LANES, advance_lanes, padded
from dforce.integrators.loops import TAU
from dforce.integrators.rk4 import advance
from dforce.kernel.codegen import FIRST_DRIVE, LENGTH, OTHERS, ZC
from dforce.kernel.vocabulary import fluid_size, from_vector, mode_count, motion_size, of_case, shaped
from dforce.observables.measure import ROOM, measure, measure_motion
from dforce.solvers.model import place_column

FD_STEP = 2e-7  # of the free amplitude, or of the parameter's unit: distance of the neighbors that give derivatives
REPEATED = 1e-11  # of its scale: how far a memory that repeats is from rest
ROUNDING = 1e-13  # of its scale: change of a memory over a period that is rounding
MEMORY_PASSES = 200  # periods that a memory gets to repeat
MOST_VAIN = 20  # of these in a row that lead no nearer to rest than one before: the memory does not come to rest
MOST_CHANGES = 4  # of these in which a branch changes: the motion then has several periods, or none
NOTHING, MOTION, ALL = 0, 1, 2  # the measurements to take: none, of the motion alone, or of the forces, too


class Slots(NamedTuple):
    """States that are marched together: their problems, values of the parameter, starts and ends.

    Attributes
    ----------
    case, value
        Problem and parameter, (slots,).
    x, memory, branch
        Scaled motion, the forces' memory and their branches at the start of a common period, a row for each slot.
    ends
        Motion one common period later, of the state itself and then of its neighbors, (slots, 2 + size, size).
    memory_after, branch_after
        Memory and branches then, of the state itself.
    apart
        Difference of the memory of each neighbor, as last found for its problem, (problems, 2 + size, states).
    rows
        The measurements over each period, (slots, periods, columns).
    wanted
        The measurements to take, (slots,): :data:`NOTHING`, :data:`MOTION` or :data:`ALL`, which costs more than marching.
    """

    case: Any
    value: Any
    x: Any
    memory: Any
    branch: Any
    ends: Any
    memory_after: Any
    branch_after: Any
    apart: Any
    rows: Any
    wanted: Any


def march(slots: Any, which: Any, count: int, each: int, measured: bool, marching: Any) -> None:
    """Advance slots by one common period: each state alone, with its neighbors, or its neighbors on the other side alone.

    Parameters
    ----------
    which, count
        Numbers of the slots that are advanced, and how many.
    each
        Columns a slot: 1, the state; 1 + size, with its neighbors by each number of the motion; 2 + size, also with the
        neighbor by the parameter; size, only neighbors on the other side.
    measured
        Whether to measure states that are advanced alone, as far as their slots want it.
    """
    size, total, model = motion_size(), count * each, marching.model
    side = -1.0 if each == size else 1.0
    smooth = model.memory_scale.shape[0] == 0 and model.hysteresis == 0
    lanes = padded(total) if smooth else total
    numbers, kinks = np.empty((model.numbers.shape[0], lanes)), np.empty((model.kinks.shape[0], lanes))
    tones = np.empty((lanes, model.tones.shape[1], model.tones.shape[2]))
    forcing, starts = np.empty((2 * model.tones.shape[1] * mode_count(), lanes)), np.empty((size, lanes))
    for j in range(lanes):
        s, e = (which[j // each], first_column(each) + j % each) if j < total else (which[0], 0)
        case, value = slots.case[s], slots.value[s]
        if e == size + 1:
            value += FD_STEP * model.unit[case]
        place_column(model, case, value, numbers, kinks, tones, j)
        if fluid_size() == 0:
            fit(numbers[:, j], tones[j], mode_count(), TAU / marching.drive.points)
        for k in range(forcing.shape[0]):
            tone, n = k // (2 * mode_count()), k % (2 * mode_count())
            forcing[k, j] = tones[j, tone, FIRST_DRIVE + n]
        for k in range(size):
            starts[k, j] = slots.x[s, k] + (side * FD_STEP if e == k + 1 else 0.0)
        if j >= total:
            numbers[ZC, j] += FAR * numbers[LENGTH, j]
    columns, chosen = (numbers, kinks, tones, forcing, starts), (which, count, each)
    if smooth:
        march_lanes(slots, chosen, measured, columns, marching)
    else:
        march_columns(slots, chosen, measured, columns, marching)


def is_any_wanted(slots: Any, which: Any, count: int) -> bool:
    """Return whether any of the advanced slots is to be measured."""
    found = False
    for j in range(count):
        found |= slots.wanted[which[j]] != NOTHING
    return found


def first_column(each: int) -> int:
    """Return the number of the first of so many columns of a slot: 0, the state itself, or 1, its first neighbor."""
    return 1 if each == motion_size() else 0


def march_lanes(slots: Any, chosen: Any, measured: bool, columns: Any, marching: Any) -> None:
    """Advance columns side by side, see `march`; `chosen` are `which`, `count` and `each`."""
    (numbers, kinks, tones, forcing, starts), (which, count, each) = columns, chosen
    model, drive, room = marching
    size, lanes = starts.shape
    kept = measured and each == 1 and is_any_wanted(slots, which, count)
    rows = drive.points + 1 if kept else 2
    samples = shaped(room, rows, size + 1, lanes)
    records, scratch = np.empty((LANES, rows, size + 1)), np.empty((ROOM, rows))
    kinks_here, others = np.empty(kinks.shape[0]), np.empty(numbers.shape[0] - OTHERS)
    crossed, work = np.empty(lanes, np.int64), np.empty((8, kinks.shape[0] + 1))
    put_rows(samples[0], starts)
    for period in range(drive.periods):
        shared = drive.phases[period], period, drive.points, drive.waves[period]
        end = advance_lanes(samples, (numbers, forcing, kinks, tones), shared, crossed, work, model.tip)
        if kept:
            for j in range(count):
                if j % LANES == 0:  # of all that lie side by side at once: the memory is read once
                    for i in range(rows):
                        for k in range(size + 1):
                            for lane in range(LANES):
                                records[lane, i, k] = samples[i, k, j + lane]
                if slots.wanted[which[j]] != NOTHING:
                    desk = records[j % LANES], scratch, kinks_here, others
                    take_measure(slots, which[j], period, model, drive, columns, j, desk)
        if end > 0:
            put_rows(samples[0], samples[end])
    for j in range(count * each):
        for k in range(size):
            slots.ends[which[j // each], first_column(each) + j % each, k] = samples[0, k, j]


def march_columns(slots: Any, chosen: Any, measured: bool, columns: Any, marching: Any) -> None:
    """Advance columns one after the other, see `march_lanes`.

    For the derivatives the memory belongs to the motion: each column goes through the period, from the same motion, until its
    memory and branches repeat.
    """
    (numbers, kinks, tones, _, starts), (which, count, each) = columns, chosen
    model, drive, _ = marching
    side = -1.0 if each == motion_size() else 1.0
    size, states, branches = starts.shape[0], model.memory_scale.shape[0], model.hysteresis
    table = np.empty((2 * drive.points + 1, mode_count()))
    desk = (
        np.empty((drive.points + 1, size + states + branches + 1)),
        np.empty((ROOM, drive.points + 1)),
        np.empty(kinks.shape[0]),
        np.empty(numbers.shape[0] - OTHERS),
    )
    samples, work, others = desk[0], np.empty((8, max(states, 1))), np.empty(numbers.shape[0] - OTHERS)
    for j in range(count * each):
        s = which[j // each]
        start, e, gain = from_vector(starts[:, j].copy()), first_column(each) + j % each, model.gain[slots.case[s]]
        memory = slots.memory[s].copy() if e == 0 else slots.memory_after[s].copy()
        apart = slots.apart[slots.case[s], e]
        for k in range(states):
            memory[k] += side * apart[k]
        branch = slots.branch[s].copy() if e == 0 else slots.branch_after[s].copy()
        p = of_case(model.tip, numbers, j, others)
        y, last, settled, changes = start, np.zeros((2, states)), False, 0
        least, vain = np.inf, 0
        for attempt in range(MEMORY_PASSES if each > 1 else 1):
            y, memory_before, branch_before = start, memory.copy(), branch.copy()
            for period in range(drive.periods):
                tabulate_steps(tones[j], drive.waves[period], table)
                of_period = tones[j], drive.phases[period], period, drive.points
                y = advance(y, of_period, table, (memory, branch, kinks[:, j].copy(), work), samples, p)
                if measured and each == 1 and slots.wanted[s] != NOTHING:
                    take_measure(slots, s, period, model, drive, columns, j, desk)
            rest = unrest(memory, memory_before, branch, branch_before, gain, model.memory_scale)
            settled = rest < REPEATED
            changes += 0 if rest < np.inf else 1
            least, vain = min(least, rest), 0 if rest < least else vain + 1
            if settled or changes == MOST_CHANGES or vain == MOST_VAIN:
                break
            if each > 1:
                foretell(memory, memory_before, last, attempt > 0, gain, model.elements)
        for k in range(size):
            slots.ends[s, e, k] = y[k]
        if e == 0:
            put_numbers(slots.memory_after[s], memory)
            put_numbers(slots.branch_after[s], branch)
        else:
            for k in range(states):
                apart[k] = side * (memory[k] - slots.memory_after[s, k]) if settled else 0.0


def put_numbers(place: Any, numbers: Any) -> None:
    """Write numbers to a place one by one: to assign an array brings code for the words of its errors."""
    for k in range(numbers.shape[0]):
        place[k] = numbers[k]


def put_rows(place: Any, rows: Any) -> None:
    """Write the rows of a table to a place."""
    for i in range(rows.shape[0]):
        put_numbers(place[i], rows[i])


def go_on(slots: Any, s: int) -> None:
    """Take the memory and the branches of a slot as they were after its period."""
    put_numbers(slots.memory[s], slots.memory_after[s])
    put_numbers(slots.branch[s], slots.branch_after[s])


def carry(slots: Any, s: int, change: Any) -> None:
    """Add to a slot's memory its answer to a small change of motion and parameter, as its neighbors have shown it."""
    for e in range(change.shape[0]):
        for k in range(slots.memory.shape[1]):
            slots.memory[s, k] += slots.apart[slots.case[s], 1 + e, k] * change[e] / FD_STEP


def foretell(memory: Any, before: Any, last: Any, known: bool, gain: Any, elements: Any) -> None:
    """Extrapolate a memory to its state of rest, from its values before and behind a period.

    Each number is extrapolated by the geometric series of its own rate. For elements that relax differently the error is a
    multiple of one direction each. A secant through the pass before finds it; `last` has start and step of that pass.

    Source: D. G. Anderson, J. ACM 12, 547 (1965), with one pass before.
    """
    for n in range(elements.shape[0] - 1):
        along, square = 0.0, 0.0
        for k in range(elements[n], elements[n + 1]):
            step = gain[k] * (memory[k] - before[k])
            along += step * (step - last[1, k])
            square += (step - last[1, k]) ** 2
        share = along / square if known and square > 0.0 else 0.0
        for k in range(elements[n], elements[n + 1]):
            step = gain[k] * (memory[k] - before[k])
            memory[k] = before[k] + step - share * (before[k] - last[0, k] + step - last[1, k])
            last[0, k], last[1, k] = before[k], step


def unrest(memory: Any, memory_before: Any, branch: Any, branch_before: Any, gain: Any, scale: Any) -> float:
    """Return the distance of a memory from rest, relative to its scale; infinite where a branch has changed in the period."""
    most = 0.0
    for k in range(memory.shape[0]):
        change = abs(memory[k] - memory_before[k]) / scale[k] - ROUNDING
        most = max(most, gain[k] * change) if change < np.inf else np.inf
    for k in range(branch.shape[0]):
        most = most if branch[k] == branch_before[k] else np.inf
    return most


def tabulate_steps(tones: Any, waves: Any, table: Any) -> None:
    """Write the drive of one problem on each mode at the ends and middles of the steps, (2 points + 1, modes)."""
    for i in range(table.shape[0]):
        for n in range(mode_count()):
            table[i, n] = 0.0
            for k in range(tones.shape[0]):
                re, im = tones[k, FIRST_DRIVE + n], tones[k, FIRST_DRIVE + mode_count() + n]
                table[i, n] += re * waves[2 * k, i] + im * waves[2 * k + 1, i]


def take_measure(slots: Any, s: int, period: int, model: Any, drive: Any, columns: Any, j: int, desk: Any) -> None:
    """Measure a period of slot s, which is column j, as far as that is wanted.

    `desk` holds the samples, and scratch for the measurement, for kinks and for the tip equation's numbers.
    """
    numbers, kinks, tones, _, _ = columns
    samples, room, kinks_here, others = desk
    rows = slots.rows[s, period]
    if slots.wanted[s] == MOTION:
        for k in range(rows.shape[0]):
            rows[k] = 0.0
        measure_motion(samples, drive.turns, drive.phases[period], room, rows)
        return
    p = of_case(model.tip, numbers, j, others)
    for k in range(kinks.shape[0]):
        kinks_here[k] = kinks[k, j]
    driven = tones[j], drive.phases[period], period, drive.points
    measure(samples, drive.turns, driven, kinks_here, p, room, rows)


def advance_block(slots: Any, periods: int, marching: Any) -> None:
    """Advance all slots by `periods` common periods."""
    count = slots.case.shape[0]
    which = np.empty(count, np.int64)
    for s in range(count):
        which[s] = s
    for _ in range(periods):
        march(slots, which, count, 1, False, marching)
        for s in range(count):
            put_numbers(slots.x[s], slots.ends[s, 0])
            go_on(slots, s)
