"""One step of high order in the frame of the free oscillators.

The motion of each mode is the free, driven motion plus a deviation u = (x, v). In the frame of the free oscillator,
w = exp(-L s) u with s counted from the start of the step, only the force changes w: w' = exp(-L s) (0, g F). So a free lever
is exact at any Q and step. Columns, derivatives of the motion, obey the same equation with the change of the force.

A step from or to a kink of the law counts its time by a square, s = c^2 h or s = (2 c - c^2) h: there forces such as Hertz'
begin like powers of a root, which are smooth in c.
"""

from __future__ import annotations

import math
from typing import Any

from dforce.core.arrays import FADED
from dforce.engine.lanes import BEGIN, D0, D1, F1, HIGH, LENGTH, LOW, OMEGA, SPEED, V0, V1, ZC, T, compiled, inlined
from dforce.engine.laws import call_over_points
from dforce.engine.tableau import ARRIVING, FIFTH, LEAVING, PACE, SHARE, STAGES, THIRD, WEIGHTS, A

# coefficients of the squares of an angle in its cosine, and in its sine over the angle
C1, C2, C3, C4, C5, C6, C7, C8, C9 = ((-1.0) ** k / math.factorial(2 * k) for k in range(1, 10))
S1, S2, S3, S4, S5, S6, S7, S8, S9 = ((-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 10))
FARTHEST = 4.8  # rad: largest angle for which ``waves`` holds to the last digits
DISTANCE_STEP, RATE_STEP = 1e-15, 1e-6  # m, and share of the unit of speed: differences of the law
MEMORY = 1e3  # times the error allowed in the motion: that in a memory, as a share of its scale
BESIDE = 1e-20  # m: how far beside a kink a law is asked at least
ROOT = 3e-4  # of a step from or to a kink: where the slope of a force that begins there like a root is taken
XX, XV, VX, VV, PUSH_X, PUSH_V = range(6)  # rows of a mode's table
X, V, S = 0, 1, 2  # rows of the free tip: deflection, velocity, time since the start of the step


@inlined
def waves(square: float) -> Any:
    """Return cos(a) and sin(a)/a from the square of an angle a, which may be negative.

    Taylor's series at a quarter of the angle, doubled twice: without a branch, so that loops over it become vectors.
    """
    z = 0.0625 * square
    c = 1.0 + z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * (C6 + z * (C7 + z * (C8 + z * C9))))))))
    s = 1.0 + z * (S1 + z * (S2 + z * (S3 + z * (S4 + z * (S5 + z * (S6 + z * (S7 + z * (S8 + z * S9))))))))
    s *= c
    c = 2.0 * c * c - 1.0
    return 2.0 * c * c - 1.0, s * c


@inlined
def propagator(eta: float, kappa: float, stiff: float, s: float) -> Any:
    """Return a mode's propagator over a time without forces, row by row, and the second column of its inverse."""
    grow, shrink = waves(-eta * eta * s * s)
    c, q = waves(kappa * s * s)
    q, shrink = q * s, eta * s * shrink
    down, up = grow - shrink, grow + shrink  # exp(-eta s) and exp(eta s)
    return down * (c + eta * q), down * q, -down * stiff * q, down * (c - eta * q), -up * q, up * (c + eta * q)


@inlined
def tone_at(ratio: float, re: float, im: float, co0: float, si0: float, s: float) -> Any:
    """Return a tone's share of deflection and velocity of the free tip, and the wave of its angle since the start."""
    c, q = waves(ratio * ratio * s * s)
    q *= ratio * s
    co, si = co0 * c - si0 * q, si0 * c + co0 * q
    return re * co - im * si, -ratio * (re * si + im * co), c, q


@compiled
def prepare(mode: Any, turn: Any, table: Any, tip: Any, wave: Any, share: Any, kind: int, h: float) -> None:
    """Write all that the stages of a step need and that no force changes: loops without branches over whole vectors."""
    for i in range(share.shape[1]):
        tip[X, i], tip[V, i], tip[S, i] = 0.0, 0.0, h * share[kind, i]
    for j in range(turn.shape[0]):
        ratio, re, im, co0, si0 = turn[j, 0], turn[j, 1], turn[j, 2], turn[j, 3], turn[j, 4]
        for i in range(share.shape[1]):
            x, v, wave[j, 0, i], wave[j, 1, i] = tone_at(ratio, re, im, co0, si0, h * share[kind, i])
            tip[X, i] += x
            tip[V, i] += v
    for n in range(mode.shape[0]):
        eta, kappa, stiff, gain, lift = mode[n, 0], mode[n, 1], mode[n, 2], mode[n, 3], mode[n, 4]
        for i in range(share.shape[1]):
            xx, xv, vx, vv, push_x, push_v = propagator(eta, kappa, stiff, h * share[kind, i])
            table[n, XX, i], table[n, XV, i], table[n, VX, i], table[n, VV, i] = xx, xv, vx, vv
            table[n, PUSH_X, i] = gain * push_x + lift * (push_v + 2.0 * eta * push_x)
            table[n, PUSH_V, i] = gain * push_v - lift * stiff * push_x


@compiled
def free_tip(turn: Any, s: float) -> Any:
    """Return deflection and velocity of the free tip a time s into the step."""
    x, v = 0.0, 0.0
    for j in range(turn.shape[0]):
        more_x, more_v, _, _ = tone_at(turn[j, 0], turn[j, 1], turn[j, 2], turn[j, 3], turn[j, 4], s)
        x += more_x
        v += more_v
    return x, v


@inlined
def time_at(kind: int, c: float, h: float) -> float:
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
    """Try a step; return its error relative to the allowed error.

    The arrays are taken out of the lane once: each time costs the compiled code a counted reference.
    """
    u, end, moved, w, push, table = lane.u, lane.end, lane.moved, lane.w, lane.push, lane.table
    tip, stage, force, memory, change, kept = lane.tip, lane.stage, lane.force, lane.memory, lane.change, lane.kept
    d, rate, t, result = lane.d, lane.rate, lane.t, lane.result
    at, latched, unit, limits, numbers, state = lane.at, lane.latched, lane.unit, lane.limits, lane.numbers, lane.state
    address, place, of_rate = laws.address, laws.place, laws.rate
    modes, q, states, forces = u.shape[0], u.shape[2], memory.shape[1], address.shape[0]
    zc, length, speed, omega = numbers[ZC], numbers[LENGTH], numbers[SPEED], numbers[OMEGA]
    low, high, begin = state[LOW] + BESIDE, state[HIGH] - BESIDE, state[BEGIN] + state[T]
    derived, rate_step, step, worst = q > 1, RATE_STEP * speed, DISTANCE_STEP, 0.0
    prepare(lane.mode, lane.turn, table, tip, lane.wave, SHARE, kind, h)
    for n in range(modes):
        for part in range(2):
            for k in range(q):
                for i in range(moved.shape[3]):
                    moved[n, part, k, i] = u[n, part, k] if i <= STAGES else 0.0
    for i in range(STAGES + 1):
        last = i == STAGES  # the end of the step
        for k in range(q):
            w[0, k], w[1, k] = 0.0, 0.0
        for n in range(modes):
            xx, xv, vx, vv = table[n, XX, i], table[n, XV, i], table[n, VX, i], table[n, VV, i]
            for k in range(q):
                wx, wv = moved[n, 0, k, i], moved[n, 1, k, i]
                x, v = xx * wx + xv * wv, vx * wx + vv * wv
                end[n, 0, k], end[n, 1, k] = x, v
                w[0, k] += x
                w[1, k] += v
        x, v = tip[X, i] + w[0, 0], tip[V, i] + w[1, 0]
        stage[0, i], stage[1, i] = x, v
        for m in range(states):
            value = memory[0, m]
            for j in range(i):
                value += A[i, j] * change[j, m]
            kept[0, m] = value
        here = zc + length * x
        if last:
            state[D1], state[V1] = here, v
            for m in range(states):
                memory[1, m] = kept[0, m]
        here, count, pace = min(max(here, low), high), 1, PACE[kind, i] * h
        pace_by = pace
        if derived and not last:
            count, step = 2, DISTANCE_STEP if here + DISTANCE_STEP < high else -DISTANCE_STEP
            edge = low if (v > 0.0) == (kind == LEAVING) else high
            if pace == 0.0 and abs(edge) < math.inf:
                # at the kink itself the slope may be infinite, but not its product with the pace
                reach = max(ROOT * ROOT * h * abs(v) * length, BESIDE)
                here, step, pace_by = edge, reach if edge == low else -reach, ROOT * h
            d[1], rate[1], t[1] = here + step, speed * v, (begin + tip[S, i]) / omega
            if of_rate:
                count, rate_step = 3, math.copysign(rate_step, v)  # a law may jump with the sign of the velocity
                d[2], rate[2], t[2] = here, rate[1] + rate_step, t[1]
        d[0], rate[0], t[0] = here, speed * v, (begin + tip[S, i]) / omega
        for k in range(count):
            result[k] = 0.0
        for f in range(forces):
            latch = place[f, 3]
            kept_at, side, own = at[4] + 8 * place[f, 1], latched[latch] if latch >= 0 else 0.0, at[6] + 8 * place[f, 0]
            call_over_points(address[f, 0], (count, at[0], at[1], at[2], kept_at, side, zc, own, at[3]))
        if last:
            state[F1] = result[0]
            break
        force[i], push[0, i] = result[0], pace * result[0]
        if derived:
            by_distance = (result[1] - result[0]) / step
            by_rate = (result[2] - result[0]) / rate_step if of_rate else 0.0
            for k in range(1, q):
                way = length * w[0, k] + unit[k - 1]
                push[k, i] = pace_by * (by_distance * way + by_rate * speed * w[1, k])
        for n in range(modes):
            for k in range(q):
                by_x, by_v = push[k, i] * table[n, PUSH_X, i], push[k, i] * table[n, PUSH_V, i]
                for j in range(moved.shape[3]):
                    moved[n, 0, k, j] += WEIGHTS[i, j] * by_x
                    moved[n, 1, k, j] += WEIGHTS[i, j] * by_v
        if states > 0:
            for f in range(forces):
                if place[f, 2] > 0:
                    kept_at, own = at[4] + 8 * place[f, 1], at[6] + 8 * place[f, 0]
                    rates = at[5] + 8 * (i * states + place[f, 1])
                    call_over_points(address[f, 1], (1, at[0], at[1], at[2], kept_at, 0.0, zc, own, rates))
            for m in range(states):
                change[i, m] *= pace / omega
    for n in range(modes):
        for k in range(q):
            x5, v5, x3, v3 = moved[n, 0, k, FIFTH], moved[n, 1, k, FIFTH], moved[n, 0, k, THIRD], moved[n, 1, k, THIRD]
            error = max(embedded(x5, x3), embedded(v5, v3))
            worst = max(worst, error / (limits[0] if k == 0 else limits[1]))
    for m in range(states):
        fifth, third = 0.0, 0.0
        for j in range(STAGES):
            fifth += A[FIFTH, j] * change[j, m]
            third += A[THIRD, j] * change[j, m]
        worst = max(worst, embedded(fifth, third) / (MEMORY * lane.scale[m] * limits[0]))
    if measured:
        pairs = lane.pairs
        worst = max(worst, swing_error(pairs[pairs.shape[0] - 1], push, tip, lane.swing) * lane.mode[0, 3] / limits[2])
    return worst


@compiled
def swing_error(ratio: float, push: Any, tip: Any, swing: Any) -> float:
    """Return the error of the deflection at a frequency over a step, per unit of gain, from the force's Fourier sum."""
    for j in range(tip.shape[1]):
        s = 0.5 * ratio * tip[S, j]
        c, q = waves(s * s)  # of half of the angle, so that the tenth harmonic finds it small enough
        q *= s
        swing[0, j], swing[1, j] = 2.0 * c * c - 1.0, 2.0 * c * q
    re5, im5, re3, im3 = 0.0, 0.0, 0.0, 0.0
    for j in range(STAGES):
        co, si = push[0, j] * swing[0, j], push[0, j] * swing[1, j]
        re5, im5 = re5 + A[FIFTH, j] * co, im5 + A[FIFTH, j] * si
        re3, im3 = re3 + A[THIRD, j] * co, im3 + A[THIRD, j] * si
    return float(max(embedded(re5, re3), embedded(im5, im3)) / max(ratio * ratio - 1.0, 1.0))


@compiled
def bend(lane: Any, h: float) -> Any:
    """Return the deflection and velocity due to force at the end of the step tried, and the accelerations at both ends."""
    mode, u, end, bent_x, bent_v, start, last = lane.mode, lane.u, lane.end, 0.0, 0.0, 0.0, 0.0
    for n in range(mode.shape[0]):
        xx, xv, vx, vv, _, _ = propagator(mode[n, 0], mode[n, 1], mode[n, 2], h)
        x = end[n, 0, 0] - xx * u[n, 0, 0] - xv * u[n, 1, 0]
        v = end[n, 1, 0] - vx * u[n, 0, 0] - vv * u[n, 1, 0]
        bent_x += x
        bent_v += v
        start += mode[n, 3] * lane.force[0]
        last += mode[n, 3] * lane.state[F1] - mode[n, 2] * x - 2.0 * mode[n, 0] * v
    return bent_x, bent_v, start, last


@compiled
def inside(mode: Any, turn: Any, u: Any, bent_x: float, bent_v: float, h: float, s: float) -> Any:
    """Return scaled deflection and velocity a time s into the step that was tried, near enough to aim by.

    The motion without new forces is exact. A cubic adds the effect of the step's forces, see ``bend``.
    """
    x, v = free_tip(turn, s)
    for n in range(mode.shape[0]):
        xx, xv, vx, vv, _, _ = propagator(mode[n, 0], mode[n, 1], mode[n, 2], s)
        x += xx * u[n, 0, 0] + xv * u[n, 1, 0]
        v += vx * u[n, 0, 0] + vv * u[n, 1, 0]
    r, a, b = s / h, 3.0 * bent_x - h * bent_v, h * bent_v - 2.0 * bent_x
    return x + r * r * (a + b * r), v + r * (2.0 * a + 3.0 * b * r) / h


@compiled
def take_step(lane: Any, h: float) -> None:
    """Go to the end of the step that was tried; memory that has faded is nothing."""
    for n in range(lane.u.shape[0]):
        for k in range(lane.u.shape[2]):
            lane.u[n, 0, k], lane.u[n, 1, k] = lane.end[n, 0, k], lane.end[n, 1, k]
    for m in range(lane.memory.shape[1]):
        lane.memory[0, m] = lane.memory[1, m] if abs(lane.memory[1, m]) > FADED else 0.0
    lane.state[T] += h
    for j in range(lane.turn.shape[0]):
        angle = lane.turn[j, 5] + lane.turn[j, 0] * lane.state[T]
        lane.turn[j, 3], lane.turn[j, 4] = math.cos(angle), math.sin(angle)
    lane.state[D0], lane.state[V0] = lane.state[D1], lane.state[V1]
