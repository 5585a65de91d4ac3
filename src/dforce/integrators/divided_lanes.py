"""Steps of many motions side by side that become shorter beside a root, see ``steps``."""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.integrators.loops import INSIDE, held, seconds
from dforce.integrators.steps import PARTS, REACH, STRIDE, node, spike, step, weight
from dforce.kernel.linker import inlined
from dforce.kernel.vocabulary import (
    column,
    distance,
    drive_between,
    force,
    lane_drive,
    motion_size,
    parameters_of,
    put_column,
    rate_of,
    root_count,
)
from dforce.observables.interpolant import cubic, cubic_rate

CROSSED, BESIDE = 1, 2  # marks of lanes whose step passes a kink, or lies near one
LANES = 8  # the compiler takes so many at once: fewer go one by one, and take longer
# rows of the room: how much parts count that start at the beginning, or at the end; steps since a root, and until one; shares
# of the step between which the part lies; limits of the distance; 1 where the lane counts; then the motions: at the start,
# where the whole step leads, on the way, and where the parts lead
AT_BEGIN, AT_END, SINCE, UNTIL, BEGIN, END, LOW, HIGH, COUNTS, STATES = range(10)


def room_of() -> Any:
    """Return scratch for the lanes that are divided together."""
    return np.zeros((STATES + 4 * motion_size(), LANES))


def copy_columns(motions: Any, first: int, room: Any, place: int) -> None:
    """Copy motions, from the first one on, to a place among the states of the room."""
    for k in range(motion_size()):
        for i in range(room.shape[1]):
            room[STATES + place + k, i] = motions[k, first + i]


def divide_whole(
    here: Any,
    there: Any,
    numbers: Any,
    kinks: Any,
    drive: Any,
    c0: Any,
    c1: Any,
    c2: Any,
    h: float,
    tau: float,
    marks: Any,
    room: Any,
    work: Any,
) -> None:
    """Divide the steps of lanes that are marked as near a kink, where that is needed, and take those marks away."""
    size, count = motion_size(), room.shape[1]
    for first in range(0, marks.shape[0], count):
        found = 0
        for i in range(count):
            found |= marks[first + i] & BESIDE
            room[COUNTS, i] = 1.0 if marks[first + i] == BESIDE else 0.0
            marks[first + i] &= CROSSED
        if found == 0:
            continue
        surround(here, numbers, kinks, first, room)
        copy_columns(here, first, room, 0)
        copy_columns(there, first, room, size)
        weigh_roots(numbers, kinks, h, first, room)
        weigh_spikes(numbers, kinks, h, tau, first, room)
        if divide_lanes(numbers, drive, c0, c1, c2, h, tau, first, room, work):
            for k in range(size):
                for i in range(count):
                    there[k, first + i] = room[STATES + 3 * size + k, i]


def strides(here: Any, there: Any, numbers: Any, first: int, count: int) -> bool:
    """Say whether a step of any of some lanes is long against its distance from the surface."""
    found = False
    for i in range(count):
        p = parameters_of(numbers, first + i)
        d0, d1 = distance(column(here, first + i), p), distance(column(there, first + i), p)
        found |= abs(d1 - d0) > STRIDE * min(d0, d1)
    return found


def surround(here: Any, numbers: Any, kinks: Any, first: int, room: Any) -> None:
    """Write the distances between which the force is smooth, for whole steps."""
    for i in range(room.shape[1]):
        room[LOW, i], room[HIGH, i], room[BEGIN, i], room[END, i] = -np.inf, np.inf, 0.0, 1.0
    for k in range(kinks.shape[0]):
        for i in range(room.shape[1]):
            p = parameters_of(numbers, first + i)
            y, kink, inside = column(here, first + i), kinks[k, first + i], INSIDE * p[1]
            before = distance(y, p) > kink
            room[LOW, i] = max(room[LOW, i], kink + inside if before else -np.inf)
            room[HIGH, i] = min(room[HIGH, i], np.inf if before else kink - inside)


def divide_lanes(
    numbers: Any, drive: Any, c0: Any, c1: Any, c2: Any, h: float, tau: float, first: int, room: Any, work: Any
) -> bool:
    """Write where steps, or parts of them, lead in parts; return whether those of any lane count."""
    size, count, begin, end = motion_size(), room.shape[1], 0.0, 0.0
    for i in range(count):
        begin, end = max(begin, room[AT_BEGIN, i]), max(end, room[AT_END, i])
    if begin == 0.0 and end == 0.0:
        return False
    for k in range(size):
        for i in range(count):
            room[STATES + 3 * size + k, i] = room[STATES + size + k, i]
    if begin > 0.0:
        add_parts(AT_BEGIN, numbers, drive, c0, c1, c2, h, tau, first, room, work)
    if end > 0.0:
        add_parts(AT_END, numbers, drive, c0, c1, c2, h, tau, first, room, work)
    return True


def weigh_roots(numbers: Any, kinks: Any, h: float, first: int, room: Any) -> None:
    """Write how much parts count beside roots."""
    size, count = motion_size(), room.shape[1]
    starts, whole = room[STATES : STATES + size], room[STATES + size : STATES + 2 * size]
    for i in range(count):
        room[SINCE, i], room[UNTIL, i] = REACH, REACH
    if root_count():
        for k in range(kinks.shape[0]):
            for i in range(count):
                p = parameters_of(numbers, first + i)
                y, last, long = column(starts, i), column(whole, i), (room[END, i] - room[BEGIN, i]) * h
                d, kink = distance(y, p), kinks[k, first + i]
                came = d < kink and rate_of(y, p) < 0.0
                goes = d < kink and rate_of(last, p) > 0.0
                ago = (d - kink) / rate_of(y, p) * p[3] / long
                left = max(kink - distance(last, p), 0.0) / rate_of(last, p) * p[3] / long
                room[SINCE, i] = min(room[SINCE, i], ago if came else REACH)
                room[UNTIL, i] = min(room[UNTIL, i], left if goes else REACH)
    for i in range(count):
        room[AT_BEGIN, i] = room[COUNTS, i] * weight(room[SINCE, i])
        room[AT_END, i] = room[COUNTS, i] * weight(room[UNTIL, i])


def weigh_spikes(numbers: Any, kinks: Any, h: float, tau: float, first: int, room: Any) -> None:
    """Raise how much parts count where the force has a spike at one end."""
    size, count = motion_size(), room.shape[1]
    starts, whole = room[STATES : STATES + size], room[STATES + size : STATES + 2 * size]
    away = np.full(count, REACH * h)
    for k in range(kinks.shape[0]):
        for i in range(count):
            p = parameters_of(numbers, first + i)
            y, last, kink = column(starts, i), column(whole, i), kinks[k, first + i]
            at_begin = abs(distance(y, p) - kink) / abs(rate_of(y, p))
            at_end = abs(distance(last, p) - kink) / abs(rate_of(last, p))
            away[i] = min(away[i], min(at_begin, at_end) * p[3])
    for i in range(count):
        p = parameters_of(numbers, first + i)
        y, last, limits = column(starts, i), column(whole, i), (room[LOW, i], room[HIGH, i])
        long, t = (room[END, i] - room[BEGIN, i]) * h, seconds(tau + room[BEGIN, i] * h, p)
        dt, d0, v0, d1, v1 = seconds(long, p), distance(y, p), rate_of(y, p), distance(last, p), rate_of(last, p)
        dm, vm = cubic(0.5, dt, d0, v0, d1, v1), cubic_rate(0.5, dt, d0, v0, d1, v1)
        f0 = force(held(d0, limits), v0, t, None, None, p)
        fm = force(held(dm, limits), vm, t + 0.5 * dt, None, None, p)
        f1 = force(held(d1, limits), v1, t + dt, None, None, p)
        stride = abs(d1 - d0) / min(d0, d1)
        steep = room[COUNTS, i] * weight(away[i] / long) * spike(f0, fm, f1, stride, long, p)
        at_begin = steep > room[AT_BEGIN, i] and abs(f0) > abs(f1)
        at_end = steep > room[AT_END, i] and not abs(f0) > abs(f1)
        room[AT_BEGIN, i], room[SINCE, i] = (steep, 0.0) if at_begin else (room[AT_BEGIN, i], room[SINCE, i])
        room[AT_END, i], room[UNTIL, i] = (steep, 0.0) if at_end else (room[AT_END, i], room[UNTIL, i])


def add_parts(
    side: int,
    numbers: Any,
    drive: Any,
    c0: Any,
    c1: Any,
    c2: Any,
    h: float,
    tau: float,
    first: int,
    room: Any,
    work: Any,
) -> None:
    """Add what parts change that start at the beginning, or at the end, to where the steps lead."""
    size, count = motion_size(), room.shape[1]
    now, ends = room[STATES + 2 * size : STATES + 3 * size], np.zeros((PARTS + 1, count))
    for i in range(count):
        if room[side, i] > 0.0:  # roots take long
            for k in range(1, PARTS + 1):
                steps = room[SINCE + side, i]
                ends[k, i] = node(steps, k) if side == AT_BEGIN else 1.0 - node(steps, PARTS - k)
    for k in range(size):
        for i in range(count):
            now[k, i] = room[STATES + k, i]
    for k in range(PARTS):
        for i in range(count):
            p = parameters_of(numbers, first + i)
            y, width = column(now, i), room[END, i] - room[BEGIN, i]
            low, high = room[BEGIN, i] + width * ends[k, i], room[BEGIN, i] + width * ends[k + 1, i]
            t, limits = seconds(tau + low * h, p), (room[LOW, i], room[HIGH, i])
            f = force(held(distance(y, p), limits), rate_of(y, p), t, None, None, p)
            put_column(now, i, part(y, f, low, high, first + i, drive, c0, c1, c2, h, t, limits, work, p))
    for k in range(size):
        for i in range(count):
            change = now[k, i] - room[STATES + size + k, i]
            room[STATES + 3 * size + k, i] += room[side, i] * change if room[side, i] > 0.0 else 0.0


@inlined
def part(
    y: Any,
    f: float,
    low: float,
    high: float,
    j: int,
    drive: Any,
    c0: Any,
    c1: Any,
    c2: Any,
    h: float,
    t: float,
    limits: Any,
    work: Any,
    p: Any,
) -> Any:
    """Return the motion of lane j after the part of a step between two of its shares."""
    u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
    v0, v2 = drive_between(u0, u1, u2, low), drive_between(u0, u1, u2, high)
    v1 = drive_between(u0, u1, u2, 0.5 * (low + high))
    return step(y, f, v0, v1, v2, (high - low) * h, t, None, None, limits, None, work, p)
