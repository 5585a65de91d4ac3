"""Runge–Kutta steps of many motions side by side, so that the compiler uses vector instructions.

The same method as ``rk4``, for forces without memory and branches: the innermost loops go over the lanes, and nothing in
them branches or calls. Where a lane passes a kink of the force, its step is done again by itself, cut at the kink.
"""

from __future__ import annotations

from typing import Any

from dforce.kernel.link import by_address, inlined
from dforce.kernel.slots import (
    arrived,
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
    turns_at,
    yielding,
)
from dforce.solvers._loops import TAU, seconds
from dforce.solvers.rk4 import cut_at_kink

LANES = 8  # the compiler takes so many at once: fewer go one by one, and take longer
FAR = 1000.0  # times the free amplitude: a motion so much farther from the surface meets no force to speak of


def padded(count: int) -> int:
    """Return the number of lanes that hold so many motions."""
    return LANES * ((count + LANES - 1) // LANES)


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
    "i8(f8[:,:,::1],f8[:,::1],f8[:,::1],f8[:,::1],f8[:,:,::1],f8[::1],i8,i8,f8[:,::1],i8[::1],f8[::1],f8[:,::1],{p})"
)
def advance_lanes(
    block: Any, numbers: Any, drive: Any, kinks: Any, tones: Any, phases: Any, period: int, points: int, cosine: Any,
    crossed: Any, nothing: Any, work: Any, p: Any,
) -> int:  # fmt: skip
    """Advance motions of different problems by one period, cut at kinks, and keep their samples.

    block[i] holds sample i: the motion and, behind it, the force, one column a lane. A block of only two rows is used in
    turns. Returns the row where the period ends. `numbers`, `kinks` and `drive` (each tone on each mode) have one column a
    lane, tones[j] is the tone table of lane j, with `phases` at the start of the period. `cosine` holds the cosine of each
    tone at the ends and middles of the steps, (tones, 2 points + 1). `crossed` is scratch,
    `nothing` an empty array in the place of memory and branches. Each lane's own numbers take the place of those of `p`.
    """
    h = TAU / points
    rows, size = block.shape[0], block.shape[2]
    place = 2 * mode_count()
    for i in range(points):
        here, there = block[i % rows], block[(i + 1) % rows]
        c0, c1, c2 = turns_at(cosine, 2 * i), turns_at(cosine, 2 * i + 1), turns_at(cosine, 2 * i + 2)
        for j in range(size):
            p = parameters_of(numbers, j)
            u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
            t, dt = seconds(period * TAU + i * h, p), seconds(h, p)
            y = column(here, j)
            f = force(distance(y, p), rate_of(y, p), t, None, None, p)
            here[place, j] = f
            put_column(there, j, smooth_step(y, f, u0, u1, u2, h, t, dt, None, None, p))
        if mark_crossed(here, there, numbers, kinks, h, crossed):
            for j in range(size):
                if crossed[j]:
                    p = parameters_of(numbers, j)
                    end = cut_at_kink(
                        column(here, j), column(there, j), here[place, j], lane_drive(drive, j, c0),
                        lane_drive(drive, j, c1), lane_drive(drive, j, c2), i * h, h, period, nothing, nothing,
                        tones[j], phases, kinks[:, j].copy(), work[0], work, p,
                    )  # fmt: skip
                    put_column(there, j, end)
    end_row = points % rows
    last = block[end_row]
    for j in range(size):
        p = parameters_of(numbers, j)
        y = column(last, j)
        last[place, j] = force(distance(y, p), rate_of(y, p), seconds(period * TAU + points * h, p), None, None, p)
    return end_row


def mark_crossed(here: Any, there: Any, numbers: Any, kinks: Any, h: float, crossed: Any) -> int:
    """Mark the lanes that pass a kink between two samples, or may touch one (see `grazes`); return whether there is any."""
    for j in range(crossed.shape[0]):
        crossed[j] = 0
    for k in range(kinks.shape[0]):
        for j in range(crossed.shape[0]):
            p = parameters_of(numbers, j)
            before = distance(column(here, j), p) > kinks[k, j]
            middle = distance(coasted(column(here, j), 0.5 * h), p) > kinks[k, j]
            after = distance(column(there, j), p) > kinks[k, j]
            crossed[j] |= (1 if before != after else 0) | (1 if before != middle else 0)
    found = 0
    for j in range(crossed.shape[0]):
        found |= crossed[j]
    return found
