"""Runge–Kutta steps of many motions side by side, so that the compiler uses vector instructions.

The same method as ``rk4``, for forces without memory and branches: the innermost loops go over the lanes, and nothing in
them branches or calls. Where a lane passes a kink of the force, its step is done again by itself, cut at the kink.
"""

from __future__ import annotations

from typing import Any

from dforce.kernel.link import by_address, inlined, reordered
from dforce.kernel.slots import (
    arrived,
    at_distance,
    bent,
    coasted,
    column,
    distance,
    force,
    forced,
    free_acceleration,
    lane_drive,
    mode_count,
    parameters_of,
    pushed,
    put_column,
    rate_of,
    row,
    yielding,
)
from dforce.solvers._loops import TAU, passed, phases, seconds, tabulate
from dforce.solvers.rk4 import cut_at_kink

LANES = 8  # the compiler takes so many at once: fewer go one by one, and take longer
FAR = 1000.0  # times the free amplitude: a motion so much farther from the surface meets no force to speak of


def filled(count: int) -> int:
    """Return the number of lanes that this many motions are filled up to."""
    return LANES * ((count + LANES - 1) // LANES)


def park(zc: Any, count: int, p: Any) -> None:
    """Put the motions after the first `count` far from the surface, where they take no time for kinks."""
    for j in range(count, zc.shape[0]):
        zc[j] = p[0] + FAR * p[1]


@inlined
def smooth_step(
    y: Any, f: float, u0: Any, u1: Any, u2: Any, h: float, t: float, dt: float, memory: Any, latched: Any, p: Any
) -> Any:
    """Return the motion one step later under forces that are functions of the motion alone; `f` is theirs at the start."""
    middle, last = coasted(y, 0.5 * h), coasted(y, h)
    b1 = free_acceleration(u0, y, p)
    a1 = forced(b1, f, p)
    ya = pushed(middle, 0.5 * h, a1)
    fa = force(distance(middle, p), rate_of(ya, p), t + 0.5 * dt, memory, latched, p)
    b2 = free_acceleration(u1, ya, p)
    a2 = forced(b2, fa, p)
    bend = 0.25 * h * h
    yb = pushed(bent(middle, bend, a1), 0.5 * h, a2)
    db = distance(bent(middle, bend, b1), p) + bend * yielding(p) * f
    a3 = forced(free_acceleration(u1, yb, p), force(db, rate_of(yb, p), t + 0.5 * dt, memory, latched, p), p)
    bend = 0.5 * h * h
    yc = pushed(bent(last, bend, a2), h, a3)
    dc = distance(bent(last, bend, b2), p) + bend * yielding(p) * fa
    a4 = forced(free_acceleration(u2, yc, p), force(dc, rate_of(yc, p), t + dt, memory, latched, p), p)
    return arrived(last, h, a1, a2, a3, a4)


@by_address(
    "void(f8[:,::1],f8[:,::1],f8[::1],i8,f8[:,::1],i8,f8[::1],f8[::1],f8[:,::1],f8[::1],f8[::1],f8[::1],f8[:,::1],{p})"
)
def advance_copies(
    lanes: Any, other: Any, zc: Any, points: int, table: Any, period: int, memory: Any, latched: Any, tones: Any,
    bases: Any, kinks: Any, stage: Any, work: Any, p: Any,
) -> None:  # fmt: skip
    """Advance motions of one problem, the columns of `lanes`, each at its own distance `zc`, by one period.

    `other` is scratch of the same shape.
    """
    h = TAU / points
    dt = seconds(h, p)
    start = seconds(period * TAU, p)
    before, after = lanes, other
    for i in range(points):
        t = start + i * dt
        u0, u1, u2 = row(table, 2 * i), row(table, 2 * i + 1), row(table, 2 * i + 2)
        for j in range(lanes.shape[1]):
            here = at_distance(p, zc[j])
            y = column(before, j)
            f = force(distance(y, here), rate_of(y, here), t, memory, latched, here)
            put_column(after, j, smooth_step(y, f, u0, u1, u2, h, t, dt, memory, latched, here))
        for kink in kinks:
            if any_passes(before, after, zc, kink, p):
                for j in range(lanes.shape[1]):
                    here = at_distance(p, zc[j])
                    y, end = column(before, j), column(after, j)
                    if passed(y, end, t + dt, latched, kinks, here) >= 0:
                        f = force(distance(y, here), rate_of(y, here), t, memory, latched, here)
                        end = cut_at_kink(
                            y, end, f, u0, u1, u2, i * h, h, period, memory, latched, tones, bases, kinks, stage, work, here,
                        )  # fmt: skip
                        put_column(after, j, end)
                break
        before, after = after, before
    if points % 2:
        for j in range(lanes.shape[1]):
            put_column(lanes, j, column(before, j))


def lanes_over_common_period(
    lanes: Any, other: Any, zc: Any, first: int, common: int, points: int, memory: Any, latched: Any, tones: Any,
    bases: Any, table: Any, kinks: Any, stage: Any, work: Any, p: Any,
) -> None:  # fmt: skip
    """Advance motions like `advance_copies`, by one common period of all tones."""
    for k in range(common):
        if common > 1:
            phases(tones, first + k, bases)
            tabulate(tones, bases, points, table)
        advance_copies(lanes, other, zc, points, table, first + k, memory, latched, tones, bases, kinks, stage, work, p)


@reordered
def any_passes(before: Any, after: Any, zc: Any, kink: float, p: Any) -> bool:
    """Say whether a kink lies between two samples of any lane."""
    found = 0
    for j in range(zc.shape[0]):
        here = at_distance(p, zc[j])
        above, below = distance(column(before, j), here) > kink, distance(column(after, j), here) > kink
        found |= 1 if above != below else 0
    return found > 0


def advance_cases(
    lanes: Any, parameters: Any, drive: Any, points: int, cosine: Any, periods: int, lock_ins: Any
) -> None:
    """Advance motions of different problems with one tone each by whole periods, without cuts at kinks.

    `parameters` and `drive` hold the parameters and the scaled drive on each mode, one column a lane; `cosine` the drive's
    cosine, and behind it the sine, at the ends and middles of the steps, (2, 2 points + 1). `lock_ins` gets the real and
    the imaginary part of each lane's complex amplitude over the last period. The forces must not depend on the time.
    """
    h = TAU / points
    lock_ins[:, :] = 0.0
    for period in range(periods):
        last = period == periods - 1
        for i in range(points):
            c0, c1, c2 = cosine[0, 2 * i], cosine[0, 2 * i + 1], cosine[0, 2 * i + 2]
            if last:
                add_lock_in(lanes, c0, cosine[1, 2 * i], (0.5 if i == 0 else 1.0) * 2.0 / points, lock_ins)
            for j in range(lanes.shape[1]):
                p = parameters_of(parameters, j)
                u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
                y = column(lanes, j)
                f = force(distance(y, p), rate_of(y, p), 0.0, None, None, p)
                put_column(lanes, j, smooth_step(y, f, u0, u1, u2, h, 0.0, 0.0, None, None, p))
    add_lock_in(lanes, cosine[0, 2 * points], cosine[1, 2 * points], 1.0 / points, lock_ins)


def add_lock_in(lanes: Any, c: float, s: float, weight: float, lock_ins: Any) -> None:
    """Add one sample of the total deflection to each lane's lock-in."""
    for n in range(mode_count()):
        for j in range(lanes.shape[1]):
            lock_ins[0, j] += weight * c * lanes[2 * n, j]
            lock_ins[1, j] -= weight * s * lanes[2 * n, j]


@by_address(
    "i8(f8[:,:,::1],f8[:,::1],f8[:,::1],f8[:,::1],f8[:,:,::1],i8[::1],f8[::1],i8,f8[:,::1],i8[::1],f8[::1],f8[:,::1],{p})"
)
def advance_samples(
    block: Any, parameters: Any, drive: Any, kinks: Any, tones: Any, case_of: Any, bases: Any, points: int, cosine: Any,
    crossed: Any, nothing: Any, work: Any, p: Any,
) -> int:  # fmt: skip
    """Advance motions of different problems with one tone each by one period, cut at kinks, and keep their samples.

    block[i] holds sample i: the motion and, behind it, the force, one column a lane. A block of only two rows is used in
    turns. Returns the row where the period ends. `kinks` has one column a lane, tones[case_of[j]] is the tone table of
    lane j; `crossed` is scratch, `nothing` an empty array in the place of memory and branches. Each lane's own numbers
    take the place of those of `p`.
    """
    h = TAU / points
    rows, size = block.shape[0], block.shape[2]
    place = 2 * mode_count()
    for i in range(points):
        here, there = block[i % rows], block[(i + 1) % rows]
        c0, c1, c2 = cosine[0, 2 * i], cosine[0, 2 * i + 1], cosine[0, 2 * i + 2]
        for j in range(size):
            p = parameters_of(parameters, j)
            u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
            y = column(here, j)
            f = force(distance(y, p), rate_of(y, p), 0.0, None, None, p)
            here[place, j] = f
            put_column(there, j, smooth_step(y, f, u0, u1, u2, h, 0.0, 0.0, None, None, p))
        if mark_crossed(here, there, parameters, kinks, crossed):
            for j in range(size):
                if crossed[j]:
                    p = parameters_of(parameters, j)
                    end = cut_at_kink(
                        column(here, j), column(there, j), here[place, j], lane_drive(drive, j, c0),
                        lane_drive(drive, j, c1), lane_drive(drive, j, c2), i * h, h, 0, nothing, nothing,
                        tones[case_of[j]], bases, kinks[:, j].copy(), work[0], work, p,
                    )  # fmt: skip
                    put_column(there, j, end)
    end_row = points % rows
    last = block[end_row]
    for j in range(size):
        p = parameters_of(parameters, j)
        y = column(last, j)
        last[place, j] = force(distance(y, p), rate_of(y, p), 0.0, None, None, p)
    return end_row


def mark_crossed(here: Any, there: Any, parameters: Any, kinks: Any, crossed: Any) -> int:
    """Mark the lanes that pass a kink between two samples; return whether there is any."""
    for j in range(crossed.shape[0]):
        crossed[j] = 0
    for k in range(kinks.shape[0]):
        for j in range(crossed.shape[0]):
            p = parameters_of(parameters, j)
            before = distance(column(here, j), p) > kinks[k, j]
            after = distance(column(there, j), p) > kinks[k, j]
            crossed[j] |= 1 if before != after else 0
    found = 0
    for j in range(crossed.shape[0]):
        found |= crossed[j]
    return found
