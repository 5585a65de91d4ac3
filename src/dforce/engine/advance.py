"""Motions advanced in time: steps of high order in the frame of the free oscillators, ending on kinks, switches and turns.

The motion of each mode is the free, driven one plus a deviation u = (x, v). In the frame that moves as the free oscillator,
w = exp(-L s) u with s counted from the start of the step, only the force changes anything: w' = exp(-L s) (0, g F). So a free
lever is exact at any Q and step. Columns, derivatives of the motion, obey the same equation with the change of the force.

A step from or to a kink of the law counts its time by a square, s = c^2 h or s = (2 c - c^2) h: there forces such as Hertz'
begin like powers of a root, which are smooth in c.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from dforce.engine.laws import call_block
from dforce.engine.tableau import A, B, C, FIFTH, STAGES, THIRD

OPTIONS: dict[str, Any] = dict(nogil=True, cache=True, error_model="numpy", fastmath={"contract", "arcp", "nsz"})
INNER = OPTIONS | dict(forceinline=True)
ZC, LENGTH, SPEED, OMEGA, CONTACT, FIRST_MODE, PER_MODE = 0, 1, 2, 3, 4, 5, 3
PLAIN, LEAVING, ARRIVING = 0, 1, 2  # how a step counts its time
NOTHING, KINK, TURN, SWITCH, PEAK = 0, 1, 2, 3, 4  # what a step ends on
LONGEST = 1.2  # rad of the first tone: step
FIRST = 0.3  # rad: first step of an interval
SMALLEST = 1e-9  # rad: step
SAFE, SHRINK, GROWTH = 0.9, 0.25, 5.0
BEYOND = 1.3  # times the way to the next kink at the present speed: longest step towards it
LANDED = 1e-9  # of the free amplitude: how near to a kink a step ends
CREST = 1e-6  # of the largest force: more than this beyond both ends of a step is a crest of the force
SWITCHED, MOST_TRIES = 1e-12, 60  # rad: how close behind a switch a step ends; attempts at it
MOST_STEPS = 4000  # in an interval
DISTANCE_STEP, RATE_STEP = 1e-15, 1e-6  # m, and share of the unit of speed: differences of the law
BESIDE = 1e-20  # m: how far beside a kink a law is asked at least
# sums: F, F z, F v, contact; extremes
SUM_F, SUM_Z, SUM_V, TOUCHED, Z_MIN, Z_MAX, F_MIN, F_MAX, D_MIN, V_MAX, FIRST_PAIR = range(11)


class Lanes(NamedTuple):
    """Motions that are advanced, a row for each.

    Attributes
    ----------
    numbers
        The lever's scaled numbers and those of the laws behind, (lanes, numbers).
    tones
        Frequency ratio of each tone, real and imaginary part of the base's motion and of the free motion of each mode, (lanes,
        tones, 3 + 2 modes).
    span, begin, phases
        Length of the intervals over which sums are taken (scaled time), the scaled time at the start of each, (intervals,), and
        the phase of each tone then, (intervals, tones).
    kinks
        Distances (m) at which a law is not smooth, and a0, rising, (lanes, kinks).
    limits
        Of a step: error in the motion, in the columns, in the fastest Fourier sum; longest (scaled time), (lanes, 4).
    deviation
        Deviation from the free motion and its derivatives, (lanes, modes, 2, 1 + columns).
    unit
        What the distance changes by (m) in each column of itself, (lanes, columns).
    memory, scale, latched
        Of the forces: memory, (lanes, states), its scale, (states,), and branches, (lanes, latches).
    pairs
        Frequency ratios of the Fourier sums of the force, (pairs,).
    sums
        What is summed over each interval, (lanes, intervals, FIRST_PAIR + 2 pairs); or nothing, (lanes, intervals, 0).
    ends
        Deviation at the end of each interval, (lanes, intervals, 2 modes).
    samples
        Memory, branches and force (N) at the start and at the end of each interval, (lanes, intervals + 1, states + latches +
        1); or nothing, (lanes, 0, 0).
    count
        Attempts, and steps taken; negative where the motion was given up, (lanes, 2).
    """

    numbers: Any
    tones: Any
    span: float
    begin: Any
    phases: Any
    kinks: Any
    limits: Any
    deviation: Any
    unit: Any
    memory: Any
    scale: Any
    latched: Any
    pairs: Any
    sums: Any
    ends: Any
    samples: Any
    count: Any


class Lane(NamedTuple):
    """Scratch of one motion."""

    mode: Any  # (modes, 4): half damping, square of the damped frequency, stiffness, gain
    turn: Any  # (tones, 8): ratio, free tip, cosine and sine at the start of the step, phase, motion of the base counted in
    u: Any  # (modes, 2, q) at the start of the step
    end: Any  # at its end
    w: Any  # in the frame, at a stage
    push: Any  # (stages, q): change of the force at each stage, times the rate of time
    way: Any  # (stages, modes, 2): what a unit of it does to the modes, in the frame
    force: Any  # (stages,)
    stage: Any  # (stages, 2): scaled deflection from the free motion and velocity of the tip
    memory: Any  # (3, states): at the start, at the end, at a stage
    change: Any  # (stages, states)
    scale: Any  # (states,)
    d: Any  # (points,): distance, rate and time at which laws are asked for
    rate: Any
    t: Any
    result: Any
    kept: Any  # (points, states): memory there
    numbers: Any
    at: Any  # (6,): addresses of d, rate, t, result, kept, change, numbers
    state: Any  # what has to be known from step to step, see below


T, D0, V0, D1, V1, F1, LOW, HIGH, SIDE, BEGIN, HEADING, STATES = range(12)


@njit(**INNER)
def waves(z: float) -> Any:
    """Return cos(sqrt(z)) and sin(sqrt(z))/sqrt(z), for negative z, too."""
    halvings = 0
    while z > 1.0 or z < -1.0:
        z *= 0.25
        halvings += 1
    c = 1.0 - z / 2.0 * (1.0 - z / 12.0 * (1.0 - z / 30.0 * (1.0 - z / 56.0 * (1.0 - z / 90.0 * (
        1.0 - z / 132.0 * (1.0 - z / 182.0 * (1.0 - z / 240.0)))))))  # fmt: skip
    s = 1.0 - z / 6.0 * (1.0 - z / 20.0 * (1.0 - z / 42.0 * (1.0 - z / 72.0 * (1.0 - z / 110.0 * (
        1.0 - z / 156.0 * (1.0 - z / 210.0 * (1.0 - z / 272.0)))))))  # fmt: skip
    for _ in range(halvings):
        s *= c
        c = 2.0 * c * c - 1.0
    return c, s


@njit(**INNER)
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


@njit(**OPTIONS)
def attempt(
    lane: Any, laws: Any, latched: Any, first: int, unit: Any, kind: int, h: float, pairs: Any, limits: Any
) -> float:  # fmt: skip
    """Try a step; return its error, relative to what is allowed.

    The arrays are taken out of the lane once: each time costs the compiled code a counted reference.
    """
    mode, turn, u, end, w, push, way = lane.mode, lane.turn, lane.u, lane.end, lane.w, lane.push, lane.way
    force, stage, memory, change, kept, at = lane.force, lane.stage, lane.memory, lane.change, lane.kept, lane.at
    asked_d, asked_rate, asked_t, result, numbers, state = lane.d, lane.rate, lane.t, lane.result, lane.numbers, lane.state
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
                address[f, 0], count, at[0], at[1], at[2], at[4] + 8 * place[f, 1], latched[latch] if latch >= 0 else 0.0, zc,
                at[6] + 8 * (first + place[f, 0]), at[3],
            )  # fmt: skip
        if last:
            state[F1] = result[0]
            break
        for f in range(forces):
            if place[f, 2] > 0:
                call_block(
                    address[f, 1], 1, at[0], at[1], at[2], at[4] + 8 * place[f, 1], 0.0, zc, at[6] + 8 * (first + place[f, 0]),
                    at[5] + 8 * (i * states + place[f, 1]),
                )  # fmt: skip
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
        worst = max(worst, embedded(fifth, third) / (lane.scale[m] * limits[0]))
    if pairs.shape[0] > 0:  # the fastest of the force's Fourier sums
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


@njit(**INNER)
def span(kind: int, c: float, h: float) -> float:
    """Return the time at a share of a step."""
    return c * c * h if kind == LEAVING else (2.0 * c - c * c) * h if kind == ARRIVING else c * h


@njit(**INNER)
def embedded(fifth: float, third: float) -> float:
    """Return the error of a step from its differences to the methods of order 5 and 3."""
    square = fifth * fifth
    under = square + 0.01 * third * third
    return square / math.sqrt(under) if under > 0.0 else 0.0


@njit(**OPTIONS)
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


@njit(**OPTIONS)
def root(lane: Any, length: float, zc: float, h: float, level: float, wanted: int, last: float) -> float:
    """Return when in the step that was tried the tip passes a distance (KINK) or turns (TURN), before the time `last`."""
    mode, turn, u, end = lane.mode, lane.turn, lane.u, lane.end
    low, high = 0.0, last
    d, v = inside(mode, turn, u, end, length, zc, h, last)
    above = (d > level) if wanted == KINK else (v > 0.0)
    s = 0.5 * last
    for _ in range(40):
        d, v = inside(mode, turn, u, end, length, zc, h, s)
        value = (d - level) / length if wanted == KINK else v
        if ((d > level) if wanted == KINK else (v > 0.0)) == above:
            high = s
        else:
            low = s
        if wanted == KINK:
            slope = v
        else:
            slope = (inside(mode, turn, u, end, length, zc, h, min(s + 1e-4 * h, h))[1] - v) / (1e-4 * h)
        new = s - value / slope if slope != 0.0 else 0.5 * (low + high)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - s) < 1e-7 * h:
            return new
        s = new
    return s


@njit(**OPTIONS)
def place_between(lane: Any, kinks: Any, side: int) -> None:
    """Let a lane lie between two kinks, the one number `side` and the one below."""
    lane.state[SIDE] = side
    lane.state[LOW] = kinks[side - 1] if side > 0 else -np.inf
    lane.state[HIGH] = kinks[side] if side < kinks.shape[0] else np.inf


@njit(**OPTIONS)
def begin_interval(lane: Any, phases: Any, numbers: Any, kinks: Any) -> None:
    """Put a lane to the start of an interval."""
    lane.state[T] = 0.0
    for j in range(lane.turn.shape[0]):
        lane.turn[j, 5] = phases[j]
        lane.turn[j, 3], lane.turn[j, 4] = math.cos(phases[j]), math.sin(phases[j])
    x, v = free_tip(lane.turn, 0.0)
    for n in range(lane.u.shape[0]):
        x += lane.u[n, 0, 0]
        v += lane.u[n, 1, 0]
    d = numbers[ZC] + numbers[LENGTH] * x
    lane.state[D0], lane.state[V0], lane.state[HEADING] = d, v, 1.0 if v > 0.0 else -1.0
    side = 0
    while side < kinks.shape[0] and (kinks[side] < d or (kinks[side] == d and v > 0.0)):
        side += 1
    place_between(lane, kinks, side)


@njit(**OPTIONS)
def switch_value(lane: Any, laws: Any, numbers: Any, latched: Any, first: int, f: int, d: float, v: float) -> float:
    """Return the switch of a force, which is positive where its latch changes."""
    lane.d[0], lane.rate[0] = d, v * numbers[SPEED]
    lane.t[0] = (lane.state[BEGIN] + lane.state[T]) / numbers[OMEGA]
    call_block(
        laws.address[f, 2], 1, lane.at[0], lane.at[1], lane.at[2], lane.at[4], latched[laws.place[f, 3]], numbers[ZC],
        lane.at[6] + 8 * (first + laws.place[f, 0]), lane.at[3],
    )  # fmt: skip
    return lane.result[0]


@njit(**OPTIONS)
def largest_switch(lane: Any, laws: Any, numbers: Any, latched: Any, first: int, d: float, v: float) -> float:
    """Return the largest switch of all forces at a distance and velocity."""
    largest = -np.inf
    for f in range(laws.address.shape[0]):
        if laws.address[f, 2] != 0:
            largest = max(largest, switch_value(lane, laws, numbers, latched, first, f, d, v))
    return largest


@njit(**OPTIONS)
def change_latches(lane: Any, laws: Any, numbers: Any, latched: Any, first: int, d: float, v: float) -> bool:
    """Change the latches whose switch is positive; say whether there are any."""
    changed = False
    for f in range(laws.address.shape[0]):
        if laws.address[f, 2] != 0 and switch_value(lane, laws, numbers, latched, first, f, d, v) > 0.0:
            latch = laws.place[f, 3]
            latched[latch] = 1.0 - latched[latch]
            changed = True
    return changed


@njit(**OPTIONS)
def force_now(lane: Any, laws: Any, latched: Any, first: int) -> float:
    """Return the force at the start of the next step."""
    numbers, state = lane.numbers, lane.state
    for m in range(lane.memory.shape[1]):
        lane.kept[0, m] = lane.memory[0, m]
    lane.d[0], lane.rate[0] = min(max(state[D0], state[LOW] + BESIDE), state[HIGH] - BESIDE), state[V0] * numbers[SPEED]
    lane.t[0], lane.result[0] = (state[BEGIN] + state[T]) / numbers[OMEGA], 0.0
    for f in range(laws.address.shape[0]):
        latch = laws.place[f, 3]
        call_block(
            laws.address[f, 0], 1, lane.at[0], lane.at[1], lane.at[2], lane.at[4] + 8 * laws.place[f, 1],
            latched[latch] if latch >= 0 else 0.0, numbers[ZC], lane.at[6] + 8 * (first + laws.place[f, 0]), lane.at[3],
        )  # fmt: skip
    return lane.result[0]


@njit(**OPTIONS)
def add_sums(lane: Any, numbers: Any, pairs: Any, kind: int, h: float, f_end: float, sums: Any) -> None:
    """Add a step to what is summed over a period."""
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


@njit(**OPTIONS)
def crest(force: Any, f1: float, lowest: float, highest: float) -> float:
    """Return at which share of a step the force is beyond what is known and both ends, by a cubic; 0 where it is not."""
    f0, fa, fb, ca, cb = force[0], force[5], force[8], C[5], C[8]
    p1, p2 = (fa - f0) / ca, 0.0
    p2 = ((fb - fa) / (cb - ca) - p1) / cb
    p3 = ((f1 - fb) / (1.0 - cb) - (fb - fa) / (cb - ca)) / (1.0 - ca) - p2
    a3, a2, a1 = p3, p2 - p3 * (ca + cb), p1 - ca * p2 + ca * cb * p3  # of the powers of the share
    under, found = a2 * a2 - 3.0 * a1 * a3, 0.0
    best = CREST * (max(f0, f1, highest) - min(f0, f1, lowest))
    if under > 0.0:
        for sign in (-1.0, 1.0):
            below = -a2 + sign * math.sqrt(under)
            c = a1 / below if below != 0.0 else 0.0
            if 0.02 < c < 0.98:
                value = f0 + c * (a1 + c * (a2 + c * a3))
                beyond = max(value - max(f0, f1, highest), min(f0, f1, lowest) - value)
                if beyond > best:
                    best, found = beyond, c
    return found


@njit(**OPTIONS)
def deflection(lane: Any, numbers: Any, h: float, s: float) -> Any:
    """Return the scaled deflection from a base that moves, and its velocity, a time s into the step that was tried."""
    turn = lane.turn
    d, v = inside(lane.mode, turn, lane.u, lane.end, numbers[LENGTH], numbers[ZC], h, s)
    z = (d - numbers[ZC]) / numbers[LENGTH]
    for j in range(turn.shape[0]):
        ratio, angle = turn[j, 0], turn[j, 5] + turn[j, 0] * (lane.state[T] + s)
        co, si = math.cos(angle), math.sin(angle)
        z -= turn[j, 6] * co - turn[j, 7] * si
        v += ratio * (turn[j, 6] * si + turn[j, 7] * co)
    return z, v


@njit(**OPTIONS)
def add_deflection(lane: Any, numbers: Any, h: float, sums: Any) -> None:
    """Take the extremes of the deflection from a base that moves."""
    z0, v0 = deflection(lane, numbers, h, 0.0)
    z1, v1 = deflection(lane, numbers, h, h)
    sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z0, z1), max(sums[Z_MAX], z0, z1)
    if v0 * v1 < 0.0:
        low, high = 0.0, h
        for _ in range(30):
            s = 0.5 * (low + high)
            z, v = deflection(lane, numbers, h, s)
            if v * v0 > 0.0:
                low = s
            else:
                high = s
        sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z), max(sums[Z_MAX], z)


@njit(**OPTIONS)
def add_speed_and_turn(lane: Any, numbers: Any, h: float, turns: bool, sums: Any) -> None:
    """Take the largest speed within a step, and the place of a turn close behind its end."""
    mode, turn, u, end = lane.mode, lane.turn, lane.u, lane.end
    length, zc, e = numbers[LENGTH], numbers[ZC], 1e-3 * h
    rise = inside(mode, turn, u, end, length, zc, h, e)[1] - lane.state[V0]
    last = lane.state[V1] - inside(mode, turn, u, end, length, zc, h, h - e)[1]
    if rise * last < 0.0:
        s = h * rise / (rise - last)
        for _ in range(3):
            before, here = inside(mode, turn, u, end, length, zc, h, s - e)[1], inside(mode, turn, u, end, length, zc, h, s)[1]
            after = inside(mode, turn, u, end, length, zc, h, s + e)[1]
            bend = after - 2.0 * here + before
            if bend != 0.0:
                s = min(max(s - 0.5 * e * (after - before) / bend, e), h - e)
        sums[V_MAX] = max(sums[V_MAX], abs(inside(mode, turn, u, end, length, zc, h, s)[1]) * numbers[SPEED])
    for j in range(turn.shape[0]):
        if turn[j, 6] != 0.0 or turn[j, 7] != 0.0:
            add_deflection(lane, numbers, h, sums)
            return
    z0, z1 = (lane.state[D0] - zc) / length, (lane.state[D1] - zc) / length
    sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z0, z1), max(sums[Z_MAX], z0, z1)
    if turns and last != 0.0:
        z = (lane.state[D1] - zc) / length - 0.5 * lane.state[V1] ** 2 * e / last
        sums[D_MIN] = min(sums[D_MIN], zc + length * z)
        sums[Z_MIN], sums[Z_MAX] = min(sums[Z_MIN], z), max(sums[Z_MAX], z)


@njit(**OPTIONS)
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


@njit(**OPTIONS)
def fastest_turn(lane: Any) -> float:
    """Return the largest frequency ratio of tones and modes."""
    fast = 1.0
    for j in range(lane.turn.shape[0]):
        fast = max(fast, lane.turn[j, 0])
    for n in range(lane.mode.shape[0]):
        fast = max(fast, math.sqrt(lane.mode[n, 2]))
    return fast


@njit(**OPTIONS)
def speed_bound(lane: Any) -> float:
    """Return a scaled speed that the tip does not exceed without new forces."""
    speed = 0.0
    for j in range(lane.turn.shape[0]):
        speed += lane.turn[j, 0] * math.hypot(lane.turn[j, 1], lane.turn[j, 2])
    for n in range(lane.mode.shape[0]):
        speed += math.hypot(lane.u[n, 1, 0], math.sqrt(lane.mode[n, 2]) * lane.u[n, 0, 0])
    return speed


@njit(**OPTIONS)
def longest_step(lane: Any, length: float, fast: float, speed: float, measured: bool) -> float:
    """Return how long a step may be, so that the tip neither turns twice in it nor passes a kink and comes back."""
    if measured or lane.state[LOW] == -np.inf:
        return LONGEST / fast
    away = (lane.state[D0] - lane.state[LOW]) / length
    if lane.state[HIGH] < np.inf:
        away = min(away, (lane.state[HIGH] - lane.state[D0]) / length)
    return max(LONGEST / fast, min(LONGEST, away / speed))


@njit(**OPTIONS)
def march(
    lane: Any, laws: Any, numbers: Any, kinks: Any, latched: Any, first: int, unit: Any, pairs: Any, limits: Any, sums: Any,
    count: Any, interval: float,
) -> bool:  # fmt: skip
    """Advance a lane over one interval; return whether it came to the end."""
    measured, switches = sums.shape[0] > 0, latched.shape[0] > 0
    length, zc = numbers[LENGTH], numbers[ZC]
    if switches:
        change_latches(lane, laws, numbers, latched, first, lane.state[D0], lane.state[V0])
    want, kind = FIRST, PLAIN
    if measured:
        for k in range(sums.shape[0]):
            sums[k] = 0.0
        sums[Z_MIN], sums[F_MIN], sums[D_MIN] = np.inf, np.inf, np.inf
        sums[Z_MAX], sums[F_MAX] = -np.inf, -np.inf
    steps, crested, fast = 0, False, fastest_turn(lane)
    speed = speed_bound(lane)
    while lane.state[T] < interval:
        left = interval - lane.state[T]
        h = min(want, left, limits[3], longest_step(lane, length, fast, speed, measured))
        v0 = lane.state[V0]
        if kind == PLAIN and v0 < 0.0 and lane.state[LOW] > -np.inf:
            h = min(h, max(BEYOND * (lane.state[LOW] - lane.state[D0]) / (length * v0), 1e-3))
        if left - h < 1e-3 * h:
            h = left
        begun, aim, level, tries = kind, NOTHING, 0.0, 0
        low_s, high_s, low_g, high_g, error = 0.0, 0.0, 0.0, 0.0, 0.0
        while True:
            steps += 1
            if steps > MOST_STEPS:
                return False
            count[0] += 1
            error = attempt(lane, laws, latched, first, unit, kind, h, pairs if measured else pairs[:0], limits)
            if not (error >= 0.0 and error < 1e300):
                if h < SMALLEST:
                    return False
                h, aim, kind = h * SHRINK, NOTHING, begun
                continue
            fit = SAFE * max(error, 1e-10) ** (-1.0 / 8.0)
            d1, v1 = lane.state[D1], lane.state[V1]
            if aim == KINK:
                off = (d1 - level) / length
                if abs(off) > LANDED and tries < 8 and abs(off) < 0.5 * h * abs(v1):
                    h, tries = h - off / v1, tries + 1
                    if h > left:
                        h, aim, kind = left, NOTHING, begun
                    continue
                if error > 1.0 and h > SMALLEST:
                    h, aim, kind = h * max(SHRINK, min(0.7, fit)), NOTHING, begun
                    continue
                if switches:  # one that changes on the way, not at the kink itself
                    before = level + (2.0 if v1 < 0.0 else -2.0) * LANDED * length
                    high_g = largest_switch(lane, laws, numbers, latched, first, before, v1)
                    if high_g > 0.0:
                        low_g = largest_switch(lane, laws, numbers, latched, first, lane.state[D0], v0)
                        low_s, high_s, tries, aim, kind, h = 0.0, h, 0, SWITCH, begun, 0.5 * h
                        continue
                break
            if aim == SWITCH:
                value = largest_switch(lane, laws, numbers, latched, first, d1, v1)
                if value > 0.0:
                    if h == high_s or h - low_s < SWITCHED or tries > MOST_TRIES:
                        break
                    high_s, high_g, low_g = h, value, 0.5 * low_g
                else:
                    low_s, low_g, high_g = h, value, 0.5 * high_g
                tries += 1
                h = low_s + (high_s - low_s) * low_g / (low_g - high_g)  # Illinois
                if high_s - low_s < SWITCHED or tries > MOST_TRIES:
                    h = high_s
                continue
            if aim == TURN or aim == PEAK:
                if error > 1.0 and h > SMALLEST:
                    h, aim, kind = h * max(SHRINK, min(0.7, fit)), NOTHING, begun
                    continue
                if switches:
                    high_g = largest_switch(lane, laws, numbers, latched, first, d1, v1)
                    if high_g > 0.0:
                        low_g = largest_switch(lane, laws, numbers, latched, first, lane.state[D0], v0)
                        low_s, high_s, tries, aim, kind, h = 0.0, h, 0, SWITCH, begun, 0.5 * h
                        continue
                break
            leaves = d1 < lane.state[LOW] or d1 > lane.state[HIGH]
            turned = lane.state[HEADING] * v1 < 0.0
            if (leaves or turned) and error < 1e4:
                last, s = h, h
                if turned:
                    last = root(lane, length, zc, h, 0.0, TURN, h)
                    d_turn, _ = inside(lane.mode, lane.turn, lane.u, lane.end, length, zc, h, last)
                    s, aim = last, TURN
                    if d_turn < lane.state[LOW] or d_turn > lane.state[HIGH]:
                        aim = KINK
                        level = lane.state[LOW] if d_turn < lane.state[LOW] else lane.state[HIGH]
                else:
                    aim, level = KINK, lane.state[LOW] if d1 < lane.state[LOW] else lane.state[HIGH]
                if aim == KINK:
                    s = root(lane, length, zc, h, level, KINK, last)
                    kind = ARRIVING if begun == PLAIN else begun
                elif abs(last - h) < 1e-6 * h and error <= 1.0:
                    break
                h, tries = max(s, 1e-12), 0
                continue
            if error > 1.0 and h > SMALLEST:
                h *= max(SHRINK, min(0.9, fit))
                continue
            if switches:
                high_g = largest_switch(lane, laws, numbers, latched, first, d1, v1)
                if high_g > 0.0:
                    low_g = largest_switch(lane, laws, numbers, latched, first, lane.state[D0], v0)
                    low_s, high_s, tries, aim, h = 0.0, h, 0, SWITCH, 0.5 * h
                    continue
            break
        if measured and aim != PEAK and aim != SWITCH and not crested:
            share = crest(lane.force, lane.state[F1], sums[F_MIN], sums[F_MAX])
            if share > 0.0:  # the step is made again, to end there
                h, kind, aim, crested = span(kind, share, h), begun, PEAK, True
                count[0] += 1
                error = attempt(lane, laws, latched, first, unit, kind, h, pairs, limits)
        elif aim != PEAK:
            crested = False
        # the step is taken
        count[1] += 1
        f1 = lane.state[F1]
        if measured:
            add_sums(lane, numbers, pairs, kind, h, f1, sums)
            add_speed_and_turn(lane, numbers, h, aim == TURN, sums)
        fit = h * min(GROWTH, max(0.3, SAFE * max(error, 1e-10) ** (-1.0 / 8.0)))
        want = fit if aim == NOTHING else max(fit, want)
        take_step(lane, h)
        if lane.state[T] > interval - 1e-13:
            lane.state[T] = interval
        kind = PLAIN
        if aim == KINK:
            down = v1 < 0.0
            side = int(lane.state[SIDE])
            place_between(lane, kinks, side - 1 if level == lane.state[LOW] else side + 1)
            lane.state[D0] = level
            before = f1
            if switches:
                change_latches(lane, laws, numbers, latched, first, level + (-1e-15 if down else 1e-15), v1)
            f0 = force_now(lane, laws, latched, first)
            if f0 != before:
                salt(lane, before - f0, length, unit, v1)
            kind = LEAVING
        elif aim == SWITCH:
            before = f1
            change_latches(lane, laws, numbers, latched, first, lane.state[D0], lane.state[V0])
            f0 = force_now(lane, laws, latched, first)
            salt(lane, before - f0, length, unit, v1)
        elif aim == TURN:
            lane.state[HEADING] = -lane.state[HEADING]
    return True


@njit(**OPTIONS)
def salt(lane: Any, jump: float, length: float, unit: Any, v: float) -> None:
    """Let the columns pass a jump of the force at a distance: a neighbor meets it earlier or later.

    Source: R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, Springer (2004).
    """
    for k in range(1, lane.u.shape[2]):
        moved = unit[k - 1] / length
        for n in range(lane.u.shape[0]):
            moved += lane.u[n, 0, k]
        for n in range(lane.u.shape[0]):
            lane.u[n, 1, k] -= lane.mode[n, 3] * jump * moved / v


@njit(**OPTIONS)
def take_sample(lane: Any, laws: Any, latched: Any, first: int, sample: Any) -> None:
    """Write memory, branches and force where the lane is."""
    states = lane.memory.shape[1]
    for m in range(states):
        sample[m] = lane.memory[0, m]
    for k in range(latched.shape[0]):
        sample[states + k] = latched[k]
    sample[sample.shape[0] - 1] = force_now(lane, laws, latched, first)


@njit(**OPTIONS)
def lane_of(numbers: Any, tones: Any, scale: Any, modes: int, columns: int) -> Lane:
    """Return room for one motion, with its lever and its free tip."""
    mode, turn = np.empty((modes, 4)), np.zeros((tones.shape[0], 8))
    for n in range(modes):
        at = FIRST_MODE + PER_MODE * n
        stiff, drag, gain = numbers[at], numbers[at + 1], numbers[at + 2]
        mode[n, 0], mode[n, 1], mode[n, 2], mode[n, 3] = 0.5 * drag, stiff - 0.25 * drag * drag, stiff, gain
    for j in range(tones.shape[0]):
        turn[j, 0], turn[j, 6], turn[j, 7] = tones[j, 0], tones[j, 1], tones[j, 2]
        for n in range(modes):
            turn[j, 1] += tones[j, 3 + 2 * n]
            turn[j, 2] += tones[j, 4 + 2 * n]
    q, states = 1 + columns, scale.shape[0]
    d, rate, t, result = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    kept, change, at = np.zeros((3, states)), np.zeros((STAGES, states)), np.empty(7, np.int64)
    at[0], at[1], at[2], at[3] = d.ctypes.data, rate.ctypes.data, t.ctypes.data, result.ctypes.data
    at[4], at[5], at[6] = kept.ctypes.data, change.ctypes.data, numbers.ctypes.data
    return Lane(
        mode, turn, np.empty((modes, 2, q)), np.empty((modes, 2, q)), np.empty((2, q)), np.empty((STAGES, q)),
        np.empty((STAGES, modes, 2)), np.empty(STAGES), np.empty((STAGES, 2)), np.zeros((2, states)), change, scale, d, rate, t,
        result, kept, numbers, at, np.zeros(STATES),
    )  # fmt: skip


@njit(**OPTIONS)
def advance(lanes: Lanes, laws: Any, first: int) -> None:
    """Advance each lane over all intervals; `first` is the place of the laws' first number."""
    modes, columns = lanes.deviation.shape[1], lanes.deviation.shape[3] - 1
    for i in range(lanes.numbers.shape[0]):
        lane = lane_of(lanes.numbers[i], lanes.tones[i], lanes.scale, modes, columns)
        lane.u[:] = lanes.deviation[i]
        lane.memory[0] = lanes.memory[i]
        good, sampled = True, lanes.samples.shape[1] > 0
        for k in range(lanes.phases.shape[0]):
            lane.state[BEGIN] = lanes.begin[k]
            begin_interval(lane, lanes.phases[k], lanes.numbers[i], lanes.kinks[i])
            if sampled and k == 0:
                if lanes.latched.shape[1] > 0:
                    change_latches(lane, laws, lanes.numbers[i], lanes.latched[i], first, lane.state[D0], lane.state[V0])
                take_sample(lane, laws, lanes.latched[i], first, lanes.samples[i, 0])
            good = march(
                lane, laws, lanes.numbers[i], lanes.kinks[i], lanes.latched[i], first, lanes.unit[i], lanes.pairs,
                lanes.limits[i], lanes.sums[i, k], lanes.count[i], lanes.span,
            )  # fmt: skip
            if not good:
                break
            for n in range(modes):
                lanes.ends[i, k, 2 * n], lanes.ends[i, k, 2 * n + 1] = lane.u[n, 0, 0], lane.u[n, 1, 0]
            if sampled:
                take_sample(lane, laws, lanes.latched[i], first, lanes.samples[i, k + 1])
        if not good:
            lane.u[:] = np.nan
        lanes.deviation[i] = lane.u
        lanes.memory[i] = lane.memory[0]
