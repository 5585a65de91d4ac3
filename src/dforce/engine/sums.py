"""The part of a step in the sums and extremes of an interval."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

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
from dforce.engine.step import bend, inside
from dforce.engine.tableau import STAGES, A


@compiled
def begin_sums(lane: Any, sums: Any) -> None:
    """Set the sums of an interval to nothing."""
    sums[:], lane.fourier[:] = 0.0, 0.0
    sums[Z_MIN], sums[F_MIN], sums[D_MIN] = np.inf, np.inf, np.inf
    sums[Z_MAX], sums[F_MAX] = -np.inf, -np.inf


@compiled
def end_sums(lane: Any, sums: Any) -> None:
    """Write the Fourier sums of an interval."""
    for k in range(lane.pairs.shape[0]):
        for part in range(2):
            total = 0.0
            for j in range(STAGES):
                total += lane.fourier[k, part, j]
            sums[FIRST_PAIR + 2 * k + part] = total


@compiled
def add_fourier(fourier: Any, push: Any, turn: Any, wave: Any, swing: Any, t: float) -> None:
    """Add a step to the force's Fourier sums, stage by stage; a harmonic follows from the one before by a rotation."""
    tones, width = turn.shape[0], push.shape[1]
    for j in range(tones - 1, -1, -1):  # the first tone is the last of all: its harmonics follow
        co0, si0 = math.cos(turn[j, 0] * t), math.sin(turn[j, 0] * t)
        for i in range(width):
            part = A[STAGES, i] * push[0, i]
            co, si = co0 * wave[j, 0, i] - si0 * wave[j, 1, i], si0 * wave[j, 0, i] + co0 * wave[j, 1, i]
            swing[0, i], swing[1, i], swing[2, i], swing[3, i] = co, si, part * co, part * si
            fourier[j, 0, i] += part * co
            fourier[j, 1, i] -= part * si
    for k in range(tones, fourier.shape[0]):
        for i in range(width):
            co, si = swing[0, i], swing[1, i]
            re, im = swing[2, i] * co - swing[3, i] * si, swing[3, i] * co + swing[2, i] * si
            swing[2, i], swing[3, i] = re, im
            fourier[k, 0, i] += re
            fourier[k, 1, i] -= im


@compiled
def add_sums(lane: Any, h: float, sums: Any) -> None:
    """Add a step to the sums over an interval."""
    numbers, state, push, stage = lane.numbers, lane.state, lane.push, lane.stage
    f, fz, fv, fastest = 0.0, 0.0, 0.0, max(abs(state[V0]), abs(state[V1]))
    for j in range(STAGES):
        part = A[STAGES, j] * push[0, j]
        f += part
        fz += part * stage[0, j]
        fv += part * stage[1, j]
    sums[SUM_F] += f
    sums[SUM_Z] += fz * numbers[LENGTH]
    sums[SUM_V] += fv * numbers[SPEED]
    add_fourier(lane.fourier, push, lane.turn, lane.wave, lane.swing, state[T])
    if state[HIGH] <= numbers[CONTACT]:
        sums[TOUCHED] += h
    sums[D_MIN] = min(sums[D_MIN], state[D0], state[D1])
    sums[V_MAX] = max(sums[V_MAX], fastest * numbers[SPEED])
    sums[F_MIN], sums[F_MAX] = min(sums[F_MIN], lane.force[0], state[F1]), max(sums[F_MAX], lane.force[0], state[F1])


@compiled
def deflection(lane: Any, h: float, bent_x: float, bent_v: float, s: float) -> Any:
    """Return the scaled deflection from a base that moves, and its velocity, a time s into the step that was tried."""
    turn = lane.turn
    z, v = inside(lane.mode, turn, lane.u, bent_x, bent_v, h, s)
    for j in range(turn.shape[0]):
        ratio, angle = turn[j, 0], turn[j, 5] + turn[j, 0] * (lane.state[T] + s)
        co, si = math.cos(angle), math.sin(angle)
        z -= turn[j, 6] * co - turn[j, 7] * si
        v += ratio * (turn[j, 6] * si + turn[j, 7] * co)
    return z, v


@compiled
def add_deflection(lane: Any, h: float, bent_x: float, bent_v: float, sums: Any) -> None:
    """Take the extremes of the deflection from a base that moves."""
    z0, v0 = deflection(lane, h, bent_x, bent_v, 0.0)
    z1, v1 = deflection(lane, h, bent_x, bent_v, h)
    sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z0, z1), max(sums[Z_MAX], z0, z1)
    if v0 * v1 < 0.0:
        low, high = 0.0, h
        for _ in range(30):
            s = 0.5 * (low + high)
            z, v = deflection(lane, h, bent_x, bent_v, s)
            if v * v0 > 0.0:
                low = s
            else:
                high = s
        sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z), max(sums[Z_MAX], z)


@compiled
def velocity(lane: Any, h: float, bent: Any, s: float) -> float:
    """Return the scaled velocity a time s into the tried step: a quartic adds the effect of its forces, see ``bend``."""
    bent_x, bent_v, start, last = bent
    r = s / h
    rest = 30.0 * (bent_x / h - 0.5 * bent_v - h * (start - last) / 12.0)
    added = r * r * (3.0 - 2.0 * r) * bent_v + r * (1.0 - r) * (
        h * ((1.0 - r) * start - r * last) + rest * r * (1.0 - r)
    )
    return float(inside(lane.mode, lane.turn, lane.u, 0.0, 0.0, 1.0, s)[1] + added)


@compiled
def add_speed_and_turn(lane: Any, h: float, turns: bool, sums: Any) -> None:
    """Take the largest speed within a step, and the place of a turn close behind its end."""
    numbers, turn = lane.numbers, lane.turn
    length, zc, e = numbers[LENGTH], numbers[ZC], 1e-3 * h
    bent = bend(lane, h)
    rise = velocity(lane, h, bent, e) - lane.state[V0]
    last = lane.state[V1] - velocity(lane, h, bent, h - e)
    if rise * last < 0.0:
        s = h * rise / (rise - last)
        for _ in range(3):
            before, here = velocity(lane, h, bent, s - e), velocity(lane, h, bent, s)
            after = velocity(lane, h, bent, s + e)
            curve = after - 2.0 * here + before
            if curve != 0.0:
                s = min(max(s - 0.5 * e * (after - before) / curve, e), h - e)
        sums[V_MAX] = max(sums[V_MAX], abs(velocity(lane, h, bent, s)) * numbers[SPEED])
    for j in range(turn.shape[0]):
        if turn[j, 6] != 0.0 or turn[j, 7] != 0.0:
            add_deflection(lane, h, bent[0], bent[1], sums)
            return
    z0, z1 = (lane.state[D0] - zc) / length, (lane.state[D1] - zc) / length
    sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z0, z1), max(sums[Z_MAX], z0, z1)
    if turns and last != 0.0:
        z = (lane.state[D1] - zc) / length - 0.5 * lane.state[V1] ** 2 * e / last
        sums[D_MIN] = min(sums[D_MIN], zc + length * z)
        sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z), max(sums[Z_MAX], z)
