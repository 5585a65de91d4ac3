"""Runge–Kutta steps of many motions side by side, so that the compiler uses vector instructions.

The same method as ``rk4``, for forces without memory and branches: the innermost loops go over the lanes, and nothing in
them branches or calls. Where a lane passes a kink of the force, its step is done again by itself, cut at the kink.
"""

from __future__ import annotations

from typing import Any

from dforce.kernel.link import inlined
from dforce.kernel.slots import (
    column,
    distance,
    force,
    motion,
    moved,
    moved4,
    put_column,
    rate_of,
    row,
)
from dforce.solvers._loops import TAU, passed, seconds
from dforce.solvers.rk4 import cut_step

REACH = 1e-3  # of the free amplitude: farther apart copies of one motion are not meant to be


@inlined
def smooth_step(
    y: Any, f: float, u0: Any, u1: Any, u2: Any, h: float, t: float, dt: float, memory: Any, latched: Any, p: Any
) -> Any:
    """Return the motion one step later under forces that are functions of the motion alone; `f` is theirs at the start."""
    k1 = motion(u0, f, y, p)
    ya = moved(y, 0.5 * h, k1)
    k2 = motion(u1, force(distance(ya, p), rate_of(ya, p), t + 0.5 * dt, memory, latched, p), ya, p)
    yb = moved(y, 0.5 * h, k2)
    k3 = motion(u1, force(distance(yb, p), rate_of(yb, p), t + 0.5 * dt, memory, latched, p), yb, p)
    yc = moved(y, h, k3)
    k4 = motion(u2, force(distance(yc, p), rate_of(yc, p), t + dt, memory, latched, p), yc, p)
    return moved4(y, h, k1, k2, k3, k4)


def advance_copies(
    lanes: Any, other: Any, points: int, table: Any, period: int, memory: Any, latched: Any, tones: Any, bases: Any,
    kinks: Any, stage: Any, work: Any, p: Any,
) -> None:  # fmt: skip
    """Advance motions of one problem that are close to each other, the columns of `lanes`, by one period.

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
            y = column(before, j)
            f = force(distance(y, p), rate_of(y, p), t, memory, latched, p)
            put_column(after, j, smooth_step(y, f, u0, u1, u2, h, t, dt, memory, latched, p))
        d0, d1 = distance(column(before, 0), p), distance(column(after, 0), p)
        if comes_near(kinks, min(d0, d1), max(d0, d1), REACH * p[1]):
            for j in range(lanes.shape[1]):
                y, end = column(before, j), column(after, j)
                if passed(y, end, t + dt, latched, kinks, p) >= 0:
                    end = cut_step(y, end, i * h, h, period, memory, latched, tones, bases, kinks, stage, work, p)
                    put_column(after, j, end)
        before, after = after, before
    if points % 2:
        for j in range(lanes.shape[1]):
            put_column(lanes, j, column(before, j))


def comes_near(kinks: Any, low: float, high: float, reach: float) -> bool:
    """Say whether a kink lies between two distances, or within reach of them."""
    near = False
    for kink in kinks:
        near = near or low - reach < kink < high + reach
    return near
