"""What a step adds to the sums and extremes of an interval."""

from __future__ import annotations

import math
from typing import Any

from dforce.engine.lanes import (
    CONTACT,
    D0,
    D1,
    D_MIN,
    F1,
    F_MAX,
    F_MIN,
    FIRST_PAIR,
    HIGH,
    LENGTH,
    SPEED,
    SUM_F,
    SUM_V,
    SUM_Z,
    TOUCHED,
    V0,
    V1,
    V_MAX,
    Z_MAX,
    Z_MIN,
    ZC,
    T,
    compiled,
)
from dforce.engine.step import inside, span
from dforce.engine.tableau import STAGES, B, C


@compiled
def add_sums(lane: Any, kind: int, h: float, sums: Any) -> None:
    """Add a step to what is summed over a period."""
    numbers, pairs, f_end = lane.numbers, lane.pairs, lane.state[F1]
    length, speed = numbers[LENGTH], numbers[SPEED]
    f, fz, fv = 0.0, 0.0, 0.0
    for j in range(STAGES):
        push = B[j] * lane.push[j, 0]
        f += push
        fz += push * lane.stage[j, 0]
        fv += push * lane.stage[j, 1]
        for k in range(pairs.shape[0]):
            angle = pairs[k] * (lane.state[T] + span(kind, C[j], h))
            sums[FIRST_PAIR + 2 * k] += push * math.cos(angle)
            sums[FIRST_PAIR + 2 * k + 1] -= push * math.sin(angle)
    sums[SUM_F] += f
    sums[SUM_Z] += fz * length
    sums[SUM_V] += fv * speed
    if lane.state[HIGH] <= numbers[CONTACT]:
        sums[TOUCHED] += h
    sums[D_MIN] = min(sums[D_MIN], lane.state[D0], lane.state[D1])
    sums[V_MAX] = max(sums[V_MAX], abs(lane.state[V0] * speed), abs(lane.state[V1] * speed))
    sums[F_MIN], sums[F_MAX] = min(sums[F_MIN], lane.force[0], f_end), max(sums[F_MAX], lane.force[0], f_end)


@compiled
def deflection(lane: Any, h: float, s: float) -> Any:
    """Return the scaled deflection from a base that moves, and its velocity, a time s into the step that was tried."""
    numbers = lane.numbers
    turn = lane.turn
    d, v = inside(lane.mode, turn, lane.u, lane.end, numbers[LENGTH], numbers[ZC], h, s)
    z = (d - numbers[ZC]) / numbers[LENGTH]
    for j in range(turn.shape[0]):
        ratio, angle = turn[j, 0], turn[j, 5] + turn[j, 0] * (lane.state[T] + s)
        co, si = math.cos(angle), math.sin(angle)
        z -= turn[j, 6] * co - turn[j, 7] * si
        v += ratio * (turn[j, 6] * si + turn[j, 7] * co)
    return z, v


@compiled
def add_deflection(lane: Any, h: float, sums: Any) -> None:
    """Take the extremes of the deflection from a base that moves."""
    z0, v0 = deflection(lane, h, 0.0)
    z1, v1 = deflection(lane, h, h)
    sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z0, z1), max(sums[Z_MAX], z0, z1)
    if v0 * v1 < 0.0:
        low, high = 0.0, h
        for _ in range(30):
            s = 0.5 * (low + high)
            z, v = deflection(lane, h, s)
            if v * v0 > 0.0:
                low = s
            else:
                high = s
        sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z), max(sums[Z_MAX], z)


@compiled
def add_speed_and_turn(lane: Any, h: float, turns: bool, sums: Any) -> None:
    """Take the largest speed within a step, and the place of a turn close behind its end."""
    numbers = lane.numbers
    mode, turn, u, end = lane.mode, lane.turn, lane.u, lane.end
    length, zc, e = numbers[LENGTH], numbers[ZC], 1e-3 * h
    rise = inside(mode, turn, u, end, length, zc, h, e)[1] - lane.state[V0]
    last = lane.state[V1] - inside(mode, turn, u, end, length, zc, h, h - e)[1]
    if rise * last < 0.0:
        s = h * rise / (rise - last)
        for _ in range(3):
            before, here = (
                inside(mode, turn, u, end, length, zc, h, s - e)[1],
                inside(mode, turn, u, end, length, zc, h, s)[1],
            )
            after = inside(mode, turn, u, end, length, zc, h, s + e)[1]
            bend = after - 2.0 * here + before
            if bend != 0.0:
                s = min(max(s - 0.5 * e * (after - before) / bend, e), h - e)
        sums[V_MAX] = max(sums[V_MAX], abs(inside(mode, turn, u, end, length, zc, h, s)[1]) * numbers[SPEED])
    for j in range(turn.shape[0]):
        if turn[j, 6] != 0.0 or turn[j, 7] != 0.0:
            add_deflection(lane, h, sums)
            return
    z0, z1 = (lane.state[D0] - zc) / length, (lane.state[D1] - zc) / length
    sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z0, z1), max(sums[Z_MAX], z0, z1)
    if turns and last != 0.0:
        z = (lane.state[D1] - zc) / length - 0.5 * lane.state[V1] ** 2 * e / last
        sums[D_MIN] = min(sums[D_MIN], zc + length * z)
        sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z), max(sums[Z_MAX], z)
