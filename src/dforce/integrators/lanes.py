"""Runge–Kutta steps of many motions side by side, so that the compiler uses vector instructions.

The same method as ``rk4``, for forces without memory and branches: the innermost loops go over the lanes, and nothing in
them branches or calls. Where a lane passes a kink of the force, its step is done again by itself, cut at the kink.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.integrators.divided_lanes import (
    BEGIN,
    BESIDE,
    COUNTS,
    CROSSED,
    END,
    HIGH,
    LANES,
    LOW,
    STATES,
    copy_columns,
    divide_lanes,
    divide_whole,
    room_of,
    strides,
    weigh_roots,
    weigh_spikes,
)
from dforce.integrators.loops import INSIDE, TAU, held, seconds
from dforce.integrators.rk4 import CLOSE, NEAR, TRIES, cut_at_kink
from dforce.integrators.steps import REACH, STRIDE, step
from dforce.kernel.linker import apart, by_address, inlined
from dforce.kernel.vocabulary import (
    bent,
    coasted,
    column,
    distance,
    drive_between,
    fluid_size,
    fluid_slopes,
    followed,
    force,
    forced,
    free_acceleration,
    lane_drive,
    motion_size,
    parameters_of,
    pushed,
    put_column,
    rate_of,
    root_count,
    waves_at,
)
from dforce.observables.interpolant import cubic, cubic_rate

SCRATCH = 9  # numbers of each lane while steps are cut, beside the motion
FAR = 1000.0  # times the free amplitude: a motion so much farther from the surface meets no force to speak of


def padded(count: int) -> int:
    """Return the number of lanes that hold so many motions."""
    return LANES * ((count + LANES - 1) // LANES)


@apart
@by_address(
    "i8(f8[:,:,::1],f8[:,::1],f8[:,::1],f8[:,::1],f8[:,:,::1],f8[::1],i8,i8,f8[:,::1],i8[::1],f8[::1],f8[:,::1],{p})"
)
def advance_lanes(
    block: Any,
    numbers: Any,
    drive: Any,
    kinks: Any,
    tones: Any,
    phases: Any,
    period: int,
    points: int,
    waves: Any,
    crossed: Any,
    nothing: Any,
    work: Any,
    p: Any,
) -> int:
    """Advance motions of different problems by one period, cut at kinks, and keep their samples.

    block[i] holds sample i: the motion and, behind it, the force, one column a lane. A block of only two rows is used in
    turns. Returns the row where the period ends. `numbers`, `kinks` and `drive` (real parts of each tone on each mode, then
    imaginary ones) have one column a lane, tones[j] is the tone table of lane j, with `phases` at the start of the period.
    `waves` holds cosine and minus sine of each tone at the ends and middles of the steps, (2 tones, 2 points + 1). `crossed`
    is scratch, `nothing` an empty array in the place of memory and branches. Each lane's own numbers take the place of those
    of `p`.
    """
    h = TAU / points
    rows, size = block.shape[0], block.shape[2]
    place = motion_size()
    cuts = np.empty((place + SCRATCH, LANES))
    room = room_of()
    for i in range(points):
        here, there = block[i % rows], block[(i + 1) % rows]
        c0, c1, c2 = waves_at(waves, 2 * i), waves_at(waves, 2 * i + 1), waves_at(waves, 2 * i + 2)
        for j in range(size):
            p = parameters_of(numbers, j)
            u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
            t = seconds(period * TAU + i * h, p)
            y = column(here, j)
            f = force(distance(y, p), rate_of(y, p), t, None, None, p)
            here[place, j] = f
            put_column(there, j, step(y, f, u0, u1, u2, h, t, None, None, None, None, None, p))
        marked = mark_crossed(here, there, numbers, kinks, h, crossed)
        if marked & BESIDE:
            divide_whole(here, there, numbers, kinks, drive, c0, c1, c2, h, period * TAU + i * h, crossed, room, work)
        if marked & CROSSED:
            for first in range(0, size, LANES):
                cut_lanes(
                    here,
                    there,
                    numbers,
                    kinks,
                    drive,
                    c0,
                    c1,
                    c2,
                    h,
                    period * TAU + i * h,
                    first,
                    crossed,
                    cuts,
                    room,
                    nothing,
                    work,
                )
            for j in range(size):
                if crossed[j]:
                    p = parameters_of(numbers, j)
                    end = cut_at_kink(
                        column(here, j),
                        column(there, j),
                        here[place, j],
                        lane_drive(drive, j, c0),
                        lane_drive(drive, j, c1),
                        lane_drive(drive, j, c2),
                        i * h,
                        h,
                        period,
                        nothing,
                        nothing,
                        tones[j],
                        phases,
                        kinks[:, j].copy(),
                        work[0],
                        work,
                        p,
                    )
                    put_column(there, j, end)
    end_row = points % rows
    last = block[end_row]
    for j in range(size):
        p = parameters_of(numbers, j)
        y = column(last, j)
        last[place, j] = force(distance(y, p), rate_of(y, p), seconds(period * TAU + points * h, p), None, None, p)
    return end_row


def cut_lanes(
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
    first: int,
    crossed: Any,
    cuts: Any,
    room: Any,
    nothing: Any,
    work: Any,
) -> None:
    """Cut the steps of some lanes, from the first one on, where they pass one kink, and unmark those for which it is done.

    The way is that of `cut_at_kink`, which is left the rest: two kinks in a step, or one where Newton's method does not land.
    No lane depends on those beside it. `cuts` is scratch, a column for each of the lanes.
    """
    found, size, count = 0, motion_size(), cuts.shape[1]
    for i in range(count):
        found |= crossed[first + i]
    if found == 0:
        return
    limits, level, passes = cuts[size : size + 4], cuts[size + 4], cuts[size + 5]
    share, back, more = cuts[size + 6], cuts[size + 7], cuts[size + 8]
    careful = root_count() > 0 or strides(here, there, numbers, first, count)
    surround(here, there, numbers, kinks, first, limits, level, passes)
    for i in range(count):
        j = first + i
        p = parameters_of(numbers, j)
        y, end = column(here, j), column(there, j)
        guess = passed_at(level[i], seconds(h, p), distance(y, p), rate_of(y, p), distance(end, p), rate_of(end, p))
        share[i], more[i] = h * guess + 0.5 * NEAR * h, 0.0
    for _ in range(TRIES):
        for i in range(count):
            j = first + i
            p = parameters_of(numbers, j)
            y, f, t, at = column(here, j), here[size, j], seconds(tau, p), share[i] + more[i]
            u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
            um, uh = drive_between(u0, u1, u2, 0.5 * at / h), drive_between(u0, u1, u2, at / h)
            landed = step(y, f, u0, um, uh, at, t, nothing, nothing, (limits[0, i], limits[1, i]), nothing, work, p)
            share[i] = at
            put_column(cuts, i, landed)
        if careful:
            copy_columns(here, first, room, 0)
            divide_part(cuts, limits, 0, share, passes, numbers, kinks, drive, c0, c1, c2, h, tau, first, room, work)
        for i in range(count):
            p = parameters_of(numbers, first + i)
            y, landed = column(here, first + i), column(cuts, i)
            past = distance(landed, p) - level[i]
            past = -past if distance(y, p) > level[i] else past
            back[i] = 0.5 * NEAR * h - past * p[3] / abs(rate_of(landed, p))
        astray = False
        for i in range(count):
            more[i] = 0.0 if abs(back[i]) < CLOSE * h else back[i]
            astray |= passes[i] == 1.0 and abs(back[i]) >= CLOSE * h
        if not astray:
            break
    for i in range(count):
        j = first + i
        p = parameters_of(numbers, j)
        y, landed, t, at = column(here, j), column(cuts, i), seconds(tau, p), share[i]
        u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
        # so near, what is left of the way is that of a motion whose acceleration stays
        d = held(distance(landed, p), (limits[0, i], limits[1, i]))
        f = force(d, rate_of(landed, p), t + seconds(at, p), nothing, nothing, p)
        a = forced(free_acceleration(drive_between(u0, u1, u2, at / h), landed, p), f, p)
        near = landed
        landed = pushed(bent(coasted(near, back[i]), 0.5 * back[i] * back[i], a), back[i], a)
        if fluid_size():
            landed = followed(landed, near, back[i], fluid_slopes(near, p))
        done = abs(back[i]) < CLOSE * h and 0.0 < at + back[i] < h
        done = done and (distance(landed, p) > level[i]) != (distance(y, p) > level[i])
        share[i], passes[i] = at + back[i], passes[i] if done else 0.0
        put_column(cuts, i, landed)
    if careful:
        copy_columns(cuts, 0, room, 0)
    for i in range(count):
        j = first + i
        p = parameters_of(numbers, j)
        landed, t, at = column(cuts, i), seconds(tau + share[i], p), share[i]
        u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
        uh, um = drive_between(u0, u1, u2, at / h), drive_between(u0, u1, u2, 0.5 + 0.5 * at / h)
        f = force(held(distance(landed, p), (limits[2, i], limits[3, i])), rate_of(landed, p), t, nothing, nothing, p)
        end = step(landed, f, uh, um, u2, h - at, t, nothing, nothing, (limits[2, i], limits[3, i]), nothing, work, p)
        put_column(cuts, i, end)
    if careful:
        divide_part(cuts, limits, 2, share, passes, numbers, kinks, drive, c0, c1, c2, h, tau, first, room, work)
    for i in range(count):
        d = distance(column(cuts, i), parameters_of(numbers, first + i))
        passes[i] = passes[i] if limits[2, i] < d < limits[3, i] else 0.0
    for i in range(count):
        if crossed[first + i] and passes[i] == 1.0:
            crossed[first + i] = 0
            for k in range(size):
                there[k, first + i] = cuts[k, i]


def divide_part(
    cuts: Any,
    limits: Any,
    side: int,
    share: Any,
    passes: Any,
    numbers: Any,
    kinks: Any,
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
    """Divide the part of steps before their cut (0) or behind it (2), which leads to `cuts`; the room holds its start."""
    copy_columns(cuts, 0, room, motion_size())
    for i in range(share.shape[0]):
        room[BEGIN, i], room[END, i] = (0.0, share[i] / h) if side == 0 else (share[i] / h, 1.0)
        room[LOW, i], room[HIGH, i], room[COUNTS, i] = limits[side, i], limits[side + 1, i], passes[i]
    weigh_roots(numbers, kinks, h, first, room)
    weigh_spikes(numbers, kinks, h, tau, first, room)
    if divide_lanes(numbers, drive, c0, c1, c2, h, tau, first, room, work):
        for i in range(share.shape[0]):
            for k in range(motion_size()):
                cuts[k, i] = room[STATES + 3 * motion_size() + k, i]


def surround(here: Any, there: Any, numbers: Any, kinks: Any, first: int, limits: Any, level: Any, passes: Any) -> None:
    """Write the distances between which the force is smooth before and behind a step, the kink passed, and how many are."""
    count = level.shape[0]
    for i in range(count):
        level[i], passes[i] = 0.0, 0.0
        limits[0, i], limits[1, i], limits[2, i], limits[3, i] = -np.inf, np.inf, -np.inf, np.inf
    for k in range(kinks.shape[0]):
        for i in range(count):
            p = parameters_of(numbers, first + i)
            before, after = distance(column(here, first + i), p), distance(column(there, first + i), p)
            kink, inside = kinks[k, first + i], INSIDE * p[1]
            limits[0, i] = max(limits[0, i], kink + inside if kink < before else -np.inf)
            limits[1, i] = min(limits[1, i], np.inf if kink < before else kink - inside)
            limits[2, i] = max(limits[2, i], kink + inside if kink < after else -np.inf)
            limits[3, i] = min(limits[3, i], np.inf if kink < after else kink - inside)
            level[i] = kink if (before > kink) != (after > kink) else level[i]
            passes[i] += 1.0 if (before > kink) != (after > kink) else 0.0


@inlined
def passed_at(level: float, h: float, d0: float, v0: float, d1: float, v1: float) -> float:
    """Return the share of a step at which its cubic passes a level between its ends, by Newton's method."""
    s = (level - d0) / (d1 - d0)
    s -= (cubic(s, h, d0, v0, d1, v1) - level) / (h * cubic_rate(s, h, d0, v0, d1, v1))
    s -= (cubic(s, h, d0, v0, d1, v1) - level) / (h * cubic_rate(s, h, d0, v0, d1, v1))
    return s - (cubic(s, h, d0, v0, d1, v1) - level) / (h * cubic_rate(s, h, d0, v0, d1, v1))


def mark_crossed(here: Any, there: Any, numbers: Any, kinks: Any, h: float, crossed: Any) -> int:
    """Mark the lanes that pass a kink between two samples, may touch one (see `grazes`), or lie near one; return all marks."""
    for j in range(crossed.shape[0]):
        crossed[j] = 0
    for k in range(kinks.shape[0]):
        for j in range(crossed.shape[0]):
            p = parameters_of(numbers, j)
            before = distance(column(here, j), p) > kinks[k, j]
            middle = distance(coasted(column(here, j), 0.5 * h), p) > kinks[k, j]
            after = distance(column(there, j), p) > kinks[k, j]
            crossed[j] |= (CROSSED if before != after else 0) | (CROSSED if before != middle else 0)
            d0, d1 = distance(column(here, j), p), distance(column(there, j), p)
            far0 = 2.0 * REACH * abs(distance(coasted(column(here, j), 0.5 * h), p) - d0)
            far1 = 2.0 * REACH * abs(distance(coasted(column(there, j), 0.5 * h), p) - d1)
            close = abs(d0 - kinks[k, j]) < far0 or abs(d1 - kinks[k, j]) < far1
            inside = root_count() > 0 and not before and not after
            outside = before and after and abs(d1 - d0) > STRIDE * min(d0, d1)
            crossed[j] |= BESIDE if close and (inside or outside) else 0
    found = 0
    for j in range(crossed.shape[0]):
        found |= crossed[j]
    return found
