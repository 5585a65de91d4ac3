"""Runge–Kutta steps of many motions side by side, so that the compiler uses vector instructions.

The same method as ``rk4``, for forces without memory and branches, and without cuts at kinks: the innermost loop goes over
the lanes, and nothing in it branches or calls.
"""

from __future__ import annotations

from typing import Any

from dforce.kernel.link import inlined
from dforce.kernel.slots import (
    column,
    distance,
    force,
    lane_drive,
    motion,
    moved,
    moved4,
    parameters_of,
    put_column,
    rate_of,
    row,
)
from dforce.solvers._loops import TAU, seconds


@inlined
def smooth_step(y: Any, u0: Any, u1: Any, u2: Any, h: float, t: float, dt: float, p: Any) -> Any:
    """Return the motion one step later under forces that are functions of the motion alone."""
    k1 = motion(u0, force(distance(y, p), rate_of(y, p), t, None, None, p), y, p)
    ya = moved(y, 0.5 * h, k1)
    k2 = motion(u1, force(distance(ya, p), rate_of(ya, p), t + 0.5 * dt, None, None, p), ya, p)
    yb = moved(y, 0.5 * h, k2)
    k3 = motion(u1, force(distance(yb, p), rate_of(yb, p), t + 0.5 * dt, None, None, p), yb, p)
    yc = moved(y, h, k3)
    k4 = motion(u2, force(distance(yc, p), rate_of(yc, p), t + dt, None, None, p), yc, p)
    return moved4(y, h, k1, k2, k3, k4)


def advance_copies(lanes: Any, points: int, table: Any, start: float, p: Any) -> None:
    """Advance motions of one problem, the columns of `lanes`, by one period that starts at a time (s)."""
    h = TAU / points
    dt = seconds(h, p)
    for i in range(points):
        t = start + i * dt
        u0, u1, u2 = row(table, 2 * i), row(table, 2 * i + 1), row(table, 2 * i + 2)
        for j in range(lanes.shape[1]):
            put_column(lanes, j, smooth_step(column(lanes, j), u0, u1, u2, h, t, dt, p))


def advance_cases(lanes: Any, parameters: Any, drive: Any, points: int, cosine: Any, period: int) -> None:
    """Advance motions of different problems with one tone each by one period.

    `parameters` and `drive` hold the parameters and the scaled drive on each mode, one column a lane; `cosine` the drive's
    phase at the ends and middles of the steps.
    """
    h = TAU / points
    for i in range(points):
        c0, c1, c2 = cosine[2 * i], cosine[2 * i + 1], cosine[2 * i + 2]
        tau = period * TAU + i * h
        for j in range(lanes.shape[1]):
            p = parameters_of(parameters, j)
            u0, u1, u2 = lane_drive(drive, j, c0), lane_drive(drive, j, c1), lane_drive(drive, j, c2)
            put_column(
                lanes, j, smooth_step(column(lanes, j), u0, u1, u2, h, seconds(tau, p), seconds(h, p), p)
            )
