"""One step of high order in the frame of the free oscillators.

The motion of each mode is the free, driven one plus a deviation u = (x, v). In the frame that moves as the free oscillator,
w = exp(-L s) u with s counted from the start of the step, only the force changes anything: w' = exp(-L s) (0, g F). So a free
lever is exact at any Q and step. Columns, derivatives of the motion, obey the same equation with the change of the force.

A step from or to a kink of the law counts its time by a square, s = c^2 h or s = (2 c - c^2) h: there forces such as Hertz'
begin like powers of a root, which are smooth in c.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.engine.lanes import BEGIN, D0, D1, F1, HIGH, LENGTH, LOW, OMEGA, SPEED, V0, V1, ZC, T, compiled, inlined
from dforce.engine.laws import call_block
from dforce.engine.tableau import FIFTH, STAGES, THIRD, A, B, C

TERMS = 8  # of the series of cosine and sine, to the last digit up to 1 rad
EVEN = 1.0 / ((2.0 * np.arange(TERMS) + 1.0) * (2.0 * np.arange(TERMS) + 2.0))
ODD = 1.0 / ((2.0 * np.arange(TERMS) + 2.0) * (2.0 * np.arange(TERMS) + 3.0))
PLAIN, LEAVING, ARRIVING = 0, 1, 2  # how a step counts its time
DISTANCE_STEP, RATE_STEP = 1e-15, 1e-6  # m, and share of the unit of speed: differences of the law
MEMORY = 1e3  # times the error allowed in the motion: that in a memory, as a share of its scale
BESIDE = 1e-20  # m: how far beside a kink a law is asked at least


@inlined
def waves(z: float) -> Any:
    """Return cos(sqrt(z)) and sin(sqrt(z))/sqrt(z), for negative z, too."""
    halvings = 0
    while z > 1.0 or z < -1.0:
        z *= 0.25
        halvings += 1
    c, s = 1.0, 1.0
    for k in range(TERMS - 1, -1, -1):  # Taylor, from the last term on
        c = 1.0 - z * EVEN[k] * c
        s = 1.0 - z * ODD[k] * s
    for _ in range(halvings):
        s *= c
        c = 2.0 * c * c - 1.0
    return c, s


@inlined
def free_tip(turn: Any, s: float) -> Any:
    """Return deflection and velocity of the free tip a time s into the step."""
    x, v = 0.0, 0.0
    for j in range(turn.shape[0]):
        w = turn[j, 0]
        c, q = waves(w * w * s * s)
        q *= w * s
        co, si = turn[j, 3] * c - turn[j, 4] * q, turn[j, 4] * c + turn[j, 3] * q
        x += turn[j, 1] * co - turn[j, 2] * si
        v -= w * (turn[j, 1] * si + turn[j, 2] * co)
    return x, v


@inlined
def span(kind: int, c: float, h: float) -> float:
    """Return the time at a share of a step."""
    return c * c * h if kind == LEAVING else (2.0 * c - c * c) * h if kind == ARRIVING else c * h


@inlined
def embedded(fifth: float, third: float) -> float:
    """Return the error of a step from its differences to the methods of order 5 and 3."""
    square = fifth * fifth
    under = square + 0.01 * third * third
    return square / math.sqrt(under) if under > 0.0 else 0.0


@compiled
def attempt(lane: Any, laws: Any, kind: int, h: float, measured: bool) -> float:
    """Try a step; return its error, relative to what is allowed.

    The arrays are taken out of the lane once: each time costs the compiled code a counted reference.
    """
    mode, turn, u, end, w, push, way = lane.mode, lane.turn, lane.u, lane.end, lane.w, lane.push, lane.way
    force, stage, memory, change, kept, at = lane.force, lane.stage, lane.memory, lane.change, lane.kept, lane.at
    asked_d, asked_rate, asked_t, result, numbers, state = (
        lane.d,
        lane.rate,
        lane.t,
        lane.result,
        lane.numbers,
        lane.state,
    )
    latched, unit, pairs, limits = lane.latched, lane.unit, lane.pairs, lane.limits
    address, place, of_rate = laws.address, laws.place, laws.rate
    modes, q, states, forces = u.shape[0], u.shape[2], memory.shape[1], address.shape[0]
    zc, length, speed, omega = numbers[ZC], numbers[LENGTH], numbers[SPEED], numbers[OMEGA]
    low, high, begin = state[LOW], state[HIGH], state[BEGIN] + state[T]
    derived = q > 1
    rate_step = RATE_STEP * speed
    for i in range(STAGES + 1):
        last = i == STAGES  # the end of the step
        c = C[i] if not last else 1.0
        s, pace = c * h, h
        if kind == LEAVING:
            s, pace = c * c * h, 2.0 * c * h
        elif kind == ARRIVING:
            s, pace = (2.0 * c - c * c) * h, 2.0 * (1.0 - c) * h
        x, v = 0.0, 0.0
        for j in range(turn.shape[0]):
            ratio = turn[j, 0]
            co, si = waves(ratio * ratio * s * s)
            si *= ratio * s
            co, si = turn[j, 3] * co - turn[j, 4] * si, turn[j, 4] * co + turn[j, 3] * si
            x += turn[j, 1] * co - turn[j, 2] * si
            v -= ratio * (turn[j, 1] * si + turn[j, 2] * co)
        for k in range(q):
            w[0, k], w[1, k] = 0.0, 0.0
        for n in range(modes):
            eta, stiff, gain = mode[n, 0], mode[n, 2], mode[n, 3]
            co, si = waves(mode[n, 1] * s * s)
            si *= s
            down = math.exp(-eta * s)
            e00, e01, e10, e11 = down * (co + eta * si), down * si, -down * stiff * si, down * (co - eta * si)
            if not last:
                way[i, n, 0], way[i, n, 1] = -si * gain / down, (co + eta * si) * gain / down
            for k in range(q):
                wx, wv = u[n, 0, k], u[n, 1, k]
                for j in range(i):
                    part = (B[j] if last else A[i, j]) * push[j, k]
                    wx += part * way[j, n, 0]
                    wv += part * way[j, n, 1]
                end[n, 0, k], end[n, 1, k] = e00 * wx + e01 * wv, e10 * wx + e11 * wv
                w[0, k] += end[n, 0, k]
                w[1, k] += end[n, 1, k]
        x += w[0, 0]
        v += w[1, 0]
        d, rate, t = zc + length * x, speed * v, (begin + s) / omega
        if last:
            state[D1], state[V1] = d, v
        for m in range(states):
            value = memory[0, m]
            for j in range(i):
                value += (B[j] if last else A[i, j]) * change[j, m]
            kept[0, m] = value
            if last:
                memory[1, m] = value
        d = min(max(d, low + BESIDE), high - BESIDE)
        count, step = 1, DISTANCE_STEP
        asked_d[0], asked_rate[0], asked_t[0] = d, rate, t
        if derived and not last:
            count = 2
            step = step if d + step < high else -step
            asked_d[1], asked_rate[1], asked_t[1] = d + step, rate, t
            if of_rate:
                asked_d[2], asked_rate[2], asked_t[2] = d, rate + rate_step, t
                count = 3
        for k in range(count):
            result[k] = 0.0
        for f in range(forces):
            latch = place[f, 3]
            call_block(
                address[f, 0],
                count,
                at[0],
                at[1],
                at[2],
                at[4] + 8 * place[f, 1],
                latched[latch] if latch >= 0 else 0.0,
                zc,
                at[6] + 8 * place[f, 0],
                at[3],
            )
        if last:
            state[F1] = result[0]
            break
        for f in range(forces):
            if place[f, 2] > 0:
                call_block(
                    address[f, 1],
                    1,
                    at[0],
                    at[1],
                    at[2],
                    at[4] + 8 * place[f, 1],
                    0.0,
                    zc,
                    at[6] + 8 * place[f, 0],
                    at[5] + 8 * (i * states + place[f, 1]),
                )
        for m in range(states):
            change[i, m] *= pace / omega
        force[i], stage[i, 0], stage[i, 1] = result[0], x, v
        push[i, 0] = pace * result[0]
        if derived:
            by_distance = (result[1] - result[0]) / step
            by_rate = (result[2] - result[0]) / rate_step if of_rate else 0.0
            for k in range(1, q):
                moved = length * w[0, k] + unit[k - 1]
                push[i, k] = pace * (by_distance * moved + by_rate * speed * w[1, k])
    worst = 0.0
    for n in range(modes):
        for k in range(q):
            x5, v5, x3, v3 = 0.0, 0.0, 0.0, 0.0
            for j in range(STAGES):
                px, pv = push[j, k] * way[j, n, 0], push[j, k] * way[j, n, 1]
                x5 += FIFTH[j] * px
                v5 += FIFTH[j] * pv
                x3 += THIRD[j] * px
                v3 += THIRD[j] * pv
            error = max(embedded(x5, x3), embedded(v5, v3))
            worst = max(worst, error / (limits[0] if k == 0 else limits[1]))
    for m in range(states):
        fifth, third = 0.0, 0.0
        for j in range(STAGES):
            fifth += FIFTH[j] * change[j, m]
            third += THIRD[j] * change[j, m]
        worst = max(worst, embedded(fifth, third) / (MEMORY * lane.scale[m] * limits[0]))
    if measured:  # the fastest of the force's Fourier sums
        ratio = pairs[pairs.shape[0] - 1]
        re5, im5, re3, im3 = 0.0, 0.0, 0.0, 0.0
        for j in range(STAGES):
            angle = ratio * span(kind, C[j], h)
            co, si = push[j, 0] * math.cos(angle), push[j, 0] * math.sin(angle)
            re5, im5 = re5 + FIFTH[j] * co, im5 + FIFTH[j] * si
            re3, im3 = re3 + THIRD[j] * co, im3 + THIRD[j] * si
        error = mode[0, 3] * max(embedded(re5, re3), embedded(im5, im3)) / max(ratio * ratio - 1.0, 1.0)
        worst = max(worst, error / limits[2])
    return worst


@compiled
def inside(mode: Any, turn: Any, u: Any, end: Any, length: float, zc: float, h: float, s: float) -> Any:
    """Return distance (m) and scaled velocity a time s into the step that was tried, near enough to aim by.

    The free motion and that without new forces are exact, and a cubic adds what the forces of the step do.
    """
    x, v = free_tip(turn, s)
    r, moved, slope = s / h, 0.0, 0.0
    for n in range(mode.shape[0]):
        eta, kappa, stiff = mode[n, 0], mode[n, 1], mode[n, 2]
        co, si = waves(kappa * s * s)
        si *= s
        down = math.exp(-eta * s)
        ux, uv = u[n, 0, 0], u[n, 1, 0]
        x += down * ((co + eta * si) * ux + si * uv)
        v += down * (-stiff * si * ux + (co - eta * si) * uv)
        co, si = waves(kappa * h * h)
        si *= h
        down = math.exp(-eta * h)
        moved += end[n, 0, 0] - down * ((co + eta * si) * ux + si * uv)
        slope += end[n, 1, 0] - down * (-stiff * si * ux + (co - eta * si) * uv)
    # p(0) = p'(0) = 0, p(h) = moved, p'(h) = slope
    a, b = 3.0 * moved - h * slope, h * slope - 2.0 * moved
    x += r * r * (a + b * r)
    v += r * (2.0 * a + 3.0 * b * r) / h
    return zc + length * x, v


@compiled
def take_step(lane: Any, h: float) -> None:
    """Go to the end of the step that was tried."""
    for n in range(lane.u.shape[0]):
        for k in range(lane.u.shape[2]):
            lane.u[n, 0, k], lane.u[n, 1, k] = lane.end[n, 0, k], lane.end[n, 1, k]
    for m in range(lane.memory.shape[1]):
        lane.memory[0, m] = lane.memory[1, m]
    lane.state[T] += h
    for j in range(lane.turn.shape[0]):
        angle = lane.turn[j, 5] + lane.turn[j, 0] * lane.state[T]
        lane.turn[j, 3], lane.turn[j, 4] = math.cos(angle), math.sin(angle)
    lane.state[D0], lane.state[V0] = lane.state[D1], lane.state[V1]
