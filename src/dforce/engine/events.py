"""Events on which a step ends: kinks of a law, turns of the tip, switches of a force's branch, crests of the force."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.engine.lanes import BEGIN, D0, D1, HIGH, LENGTH, LOW, OMEGA, SIDE, SPEED, V0, ZC, T, compiled
from dforce.engine.laws import call_over_points
from dforce.engine.step import BESIDE, DISTANCE_STEP, RATE_STEP, bend, inside
from dforce.engine.tableau import C

NOTHING, KINK, TURN, SWITCH, PEAK = 0, 1, 2, 3, 4
LAW, SWITCHING = 0, 2  # columns of the addresses of laws
CREST = 1e-6  # of the largest force: more than this beyond both ends of a step is a crest of the force


@compiled
def place_between(lane: Any, side: int) -> None:
    """Let a lane lie between two kinks, the one number `side` and the one below."""
    lane.state[SIDE] = side
    lane.state[LOW] = lane.kinks[side - 1] if side > 0 else -np.inf
    lane.state[HIGH] = lane.kinks[side] if side < lane.kinks.shape[0] else np.inf


@compiled
def root(lane: Any, h: float, bent_x: float, bent_v: float, level: float, wanted: int, last: float) -> float:
    """Return when in the step that was tried the tip passes a deflection (KINK) or turns (TURN), before the time `last`."""
    mode, turn, u = lane.mode, lane.turn, lane.u
    low, high = 0.0, last
    x, v = inside(mode, turn, u, bent_x, bent_v, h, last)
    above = (x > level) if wanted == KINK else (v > 0.0)
    s = 0.5 * last
    for _ in range(40):
        x, v = inside(mode, turn, u, bent_x, bent_v, h, s)
        if ((x > level) if wanted == KINK else (v > 0.0)) == above:
            high = s
        else:
            low = s
        if wanted == KINK:
            new = s - (x - level) / v if v != 0.0 else 0.5 * (low + high)
        else:
            slope = (inside(mode, turn, u, bent_x, bent_v, h, min(s + 1e-4 * h, h))[1] - v) / (1e-4 * h)
            new = s - v / slope if slope != 0.0 else 0.5 * (low + high)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - s) < 1e-7 * h:
            return new
        s = new
    return s


@compiled
def event_in(lane: Any, h: float, turned: bool) -> Any:
    """Return the first event in a step that passes a kink or turns: KINK or TURN, the kink, and its time."""
    low, high, d1, last, level = lane.state[LOW], lane.state[HIGH], lane.state[D1], h, 0.0
    zc, length = lane.numbers[ZC], lane.numbers[LENGTH]
    bent_x, bent_v, _, _ = bend(lane, h)
    if turned:
        last = root(lane, h, bent_x, bent_v, 0.0, TURN, h)
        d1 = zc + length * inside(lane.mode, lane.turn, lane.u, bent_x, bent_v, h, last)[0]
        if low <= d1 <= high:
            return TURN, level, last
    level = low if d1 < low else high
    return KINK, level, root(lane, h, bent_x, bent_v, (level - zc) / length, KINK, last)


@compiled
def call_law(lane: Any, laws: Any, f: int, kind: int, d: float, v: float, s: float) -> float:
    """Add a law's force to the result, or write its switch there, which is positive where its latch changes; return the result.

    The time is s after the start of the next step; memory and branches have their values at its start.
    """
    numbers, at, latch = lane.numbers, lane.at, laws.place[f, 3]
    lane.d[0], lane.rate[0] = d, v * numbers[SPEED]
    lane.t[0] = (lane.state[BEGIN] + lane.state[T] + s) / numbers[OMEGA]
    kept_at, side = at[4] + 8 * laws.place[f, 1], lane.latched[latch] if latch >= 0 else 0.0
    own = at[6] + 8 * laws.place[f, 0]
    call_over_points(laws.address[f, kind], (1, at[0], at[1], at[2], kept_at, side, numbers[ZC], own, at[3]))
    return float(lane.result[0])


@compiled
def largest_switch(lane: Any, laws: Any, d: float, v: float, s: float) -> float:
    """Return the largest switch of all forces at a distance and velocity, a time s after the start of the next step."""
    largest = -np.inf
    for f in range(laws.address.shape[0]):
        if laws.address[f, 2] != 0:
            largest = max(largest, call_law(lane, laws, f, SWITCHING, d, v, s))
    return largest


@compiled
def change_latches(lane: Any, laws: Any, d: float, v: float) -> bool:
    """Change the latches whose switch is positive; return whether there are any."""
    changed = False
    for f in range(laws.address.shape[0]):
        if laws.address[f, 2] != 0 and call_law(lane, laws, f, SWITCHING, d, v, 0.0) > 0.0:
            latch = laws.place[f, 3]
            lane.latched[latch] = 1.0 - lane.latched[latch]
            changed = True
    return changed


@compiled
def force_now(lane: Any, laws: Any) -> float:
    """Return the force at the start of the next step."""
    state = lane.state
    return float(force_at(lane, laws, min(max(state[D0], state[LOW] + BESIDE), state[HIGH] - BESIDE), state[V0]))


@compiled
def force_at(lane: Any, laws: Any, d: float, v: float) -> float:
    """Return the force at a distance and velocity, with time, memory and branches at the start of the next step."""
    lane.result[0] = 0.0
    for m in range(lane.memory.shape[1]):
        lane.kept[0, m] = lane.memory[0, m]
    for f in range(laws.address.shape[0]):
        call_law(lane, laws, f, LAW, d, v, 0.0)
    return float(lane.result[0])


@compiled
def crest(force: Any, f1: float, lowest: float, highest: float) -> float:
    """Return the share of a step at which the force, a cubic, exceeds its ends and the known range; 0 if nowhere."""
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


@compiled
def slopes_of_switch(lane: Any, laws: Any, d: float, v: float) -> Any:
    """Return the slopes of the largest switch by scaled deflection, velocity and time; by distance alone (1, 0, 0)."""
    largest, by_x, by_v, by_t = -np.inf, 1.0, 0.0, 0.0
    for f in range(laws.address.shape[0]):
        if laws.address[f, 2] != 0:
            value = call_law(lane, laws, f, SWITCHING, d, v, 0.0)
            if value > largest:
                largest = value
                by_x = (call_law(lane, laws, f, SWITCHING, d + DISTANCE_STEP, v, 0.0) - value) / DISTANCE_STEP
                by_v = (call_law(lane, laws, f, SWITCHING, d, v + RATE_STEP, 0.0) - value) / RATE_STEP
                by_t = (call_law(lane, laws, f, SWITCHING, d, v, RATE_STEP) - value) / RATE_STEP
    by_x *= lane.numbers[LENGTH]
    return (by_x, by_v, by_t) if by_v != 0.0 or by_t != 0.0 else (1.0, 0.0, 0.0)


@compiled
def salt(lane: Any, jump: float, v: float, before: float, slopes: Any) -> None:
    """Apply the saltation matrix of a jump of the force to the derivatives of the motion, the columns of u.

    A neighboring motion meets the jump earlier or later: where a function of deflection, velocity and time, with these
    slopes, passes zero. The force `before` (N) acts until then.

    Source: R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, Springer (2004).
    """
    length, mode, turn, u, a, (by_x, by_v, by_t) = lane.numbers[LENGTH], lane.mode, lane.turn, lane.u, 0.0, slopes
    for j in range(turn.shape[0]):
        a -= turn[j, 0] * turn[j, 0] * (turn[j, 1] * turn[j, 3] - turn[j, 2] * turn[j, 4])
    for n in range(u.shape[0]):
        a += mode[n, 3] * before - mode[n, 2] * u[n, 0, 0] - 2.0 * mode[n, 0] * u[n, 1, 0]
    rise = by_x * v + by_v * a + by_t
    for k in range(1, u.shape[2]):
        moved, faster = lane.unit[k - 1] / length, 0.0
        for n in range(u.shape[0]):
            moved += u[n, 0, k]
            faster += u[n, 1, k]
        ahead = by_x * moved + by_v * faster
        for n in range(u.shape[0]):
            u[n, 0, k] -= mode[n, 4] * jump * ahead / rise
            u[n, 1, k] -= mode[n, 3] * jump * ahead / rise
