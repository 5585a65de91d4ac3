"""Runge–Kutta steps of many motions side by side, so that the compiler uses vector instructions.

The same method as ``rk4``, for forces without memory and branches: the innermost loops go over the lanes, and nothing in
them branches or calls. Where a lane passes a kink of the force, its step is done again by itself, cut at the kink: by code
that is compiled once for all forces.
"""

from __future__ import annotations

from typing import Any

from dforce.integrators.loops import TAU, seconds
from dforce.integrators.rk4 import cut_at_kink
from dforce.integrators.steps import REACH, STRIDE, divided, step
from dforce.kernel.linker import apart, by_address
from dforce.kernel.vocabulary import (
    coasted,
    column,
    distance,
    force,
    is_rooted,
    lane_drive,
    motion_size,
    parameters_of,
    put_column,
    rate_of,
    waves_at,
)

LANES = 8  # the compiler takes so many at once: fewer go one by one, and take longer
CROSSED, BESIDE = 1, 2  # marks of lanes whose step passes a kink, or lies near one
COLUMNS = "Tuple((f8[:,::1],f8[:,::1],f8[:,::1],f8[:,:,::1]))"
PERIOD = "Tuple((f8[::1],i8,i8,f8[:,::1]))"
FAR = 1000.0  # times the free amplitude: a motion so much farther from the surface meets no force to speak of


def padded(count: int) -> int:
    """Return the number of lanes that hold so many motions."""
    return LANES * ((count + LANES - 1) // LANES)


@by_address(f"void(f8[:,::1],f8[:,::1],i8,{COLUMNS},{PERIOD},i8[::1],f8[:,::1],{{tip}})")
def cut_lanes(here: Any, there: Any, i: int, lanes: Any, drive: Any, crossed: Any, work: Any, tip: Any) -> None:
    """Do step i again in each lane that is marked as `crossed`, from its sample `here` to the one `there`."""
    (numbers, forcing, kinks, tones), (phases, period, points, waves) = lanes, drive
    h, place, levels = TAU / points, motion_size(), work[1, : kinks.shape[0]]
    forces = work[0, :0], work[0, :0], levels, work  # no memory, no branches
    c0, c1, c2 = waves_at(waves, 2 * i), waves_at(waves, 2 * i + 1), waves_at(waves, 2 * i + 2)
    for j in range(crossed.shape[0]):
        if crossed[j]:
            p = parameters_of(numbers, j)
            y, uncut, f = column(here, j), column(there, j), here[place, j]
            u = lane_drive(forcing, j, c0), lane_drive(forcing, j, c1), lane_drive(forcing, j, c2)
            for k in range(kinks.shape[0]):
                levels[k] = kinks[k, j]
            if crossed[j] & CROSSED:
                end = cut_at_kink(y, uncut, f, u, i, (tones[j], phases, period, points), forces, p)
            else:
                end = divided(y, uncut, f, u, h, seconds(period * TAU + i * h, p), forces, p)
            put_column(there, j, end)


@apart
@by_address(f"i8(f8[:,:,::1],{COLUMNS},{PERIOD},i8[::1],f8[:,::1],{{tip}})")
def advance_lanes(samples: Any, lanes: Any, drive: Any, crossed: Any, work: Any, tip: Any) -> int:
    """Advance motions of different problems by one period, cut at kinks, and keep their samples.

    samples[i] is sample i: the motion and, behind it, the force, one column a lane. Two rows alone are used in turns. Returns
    the row where the period ends. `lanes` has the numbers of the tip equations, the drives (real parts of each tone on each
    mode, then imaginary parts) and the kinks, one column a lane; then the tone tables, (lanes, tones, columns).
    `drive` is common to all lanes. It has the tones' phases at the start of the period, the number of the period, and the
    number of steps. Last are cosine and minus sine of each tone at the ends and middles of the steps, (2 tones, 2 points + 1).
    `crossed` and `work`, with a column for each kink, are scratch. Of `tip` only the addresses matter: each lane has its own
    parameters.
    """
    (numbers, forcing, kinks, _), (_, period, points, waves) = lanes, drive
    h = TAU / points
    rows, size = samples.shape[0], samples.shape[2]
    place, forces = motion_size(), (None, None, None, None)
    for i in range(points):
        here, there = samples[i % rows], samples[(i + 1) % rows]
        c0, c1, c2 = waves_at(waves, 2 * i), waves_at(waves, 2 * i + 1), waves_at(waves, 2 * i + 2)
        for j in range(size):
            p = parameters_of(numbers, j)
            u = lane_drive(forcing, j, c0), lane_drive(forcing, j, c1), lane_drive(forcing, j, c2)
            t = seconds(period * TAU + i * h, p)
            y = column(here, j)
            f = force(distance(y, p), rate_of(y, p), t, None, None, p)
            here[place, j] = f
            put_column(there, j, step(y, f, u, h, t, forces, None, p))
        if mark_crossed(here, there, numbers, kinks, h, crossed):
            cut_lanes(here, there, i, lanes, drive, crossed, work, tip)
    end_row = points % rows
    last = samples[end_row]
    for j in range(size):
        p = parameters_of(numbers, j)
        y = column(last, j)
        last[place, j] = force(distance(y, p), rate_of(y, p), seconds(period * TAU + points * h, p), None, None, p)
    return end_row


def mark_crossed(here: Any, there: Any, numbers: Any, kinks: Any, h: float, crossed: Any) -> int:
    """Mark the lanes that pass a kink between two samples, may touch one (see `grazes`), or lie near one; return all marks."""
    found = 0
    for k in range(kinks.shape[0]):
        for j in range(crossed.shape[0]):
            p = parameters_of(numbers, j)
            d0, d1 = distance(column(here, j), p), distance(column(there, j), p)
            middle = distance(coasted(column(here, j), 0.5 * h), p)
            far0 = 2.0 * REACH * abs(middle - d0)
            far1 = 2.0 * REACH * abs(distance(coasted(column(there, j), 0.5 * h), p) - d1)
            close = abs(d0 - kinks[k, j]) < far0 or abs(d1 - kinks[k, j]) < far1
            before, after = d0 > kinks[k, j], d1 > kinks[k, j]
            inside = is_rooted(p) and not before and not after
            outside = before and after and abs(d1 - d0) > STRIDE * min(d0, d1)
            mark = (CROSSED if before != after or before != (middle > kinks[k, j]) else 0) | (
                BESIDE if close and (inside or outside) else 0
            )
            crossed[j] = mark if k == 0 else crossed[j] | mark
            found |= mark
    return found
