"""Motions advanced over intervals of time, each with its own steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.engine.events import (
    KINK,
    NOTHING,
    PEAK,
    SWITCH,
    TURN,
    change_latches,
    crest,
    event_in,
    force_at,
    force_now,
    largest_switch,
    place_between,
    salt,
    slopes_of_switch,
)
from dforce.engine.lanes import (
    ATTEMPTS,
    BEGIN,
    D0,
    D1,
    F1,
    F_MAX,
    F_MIN,
    HEADING,
    HIGH,
    LENGTH,
    LOW,
    SIDE,
    V0,
    V1,
    ZC,
    T,
    called,
    compiled,
    lane_of,
)
from dforce.engine.step import FARTHEST, attempt, free_tip, inside, take_step, time_at
from dforce.engine.sums import add_speed_and_turn, add_sums, begin_sums, end_sums
from dforce.engine.tableau import ARRIVING, LEAVING, PLAIN

LONGEST = 1.2  # rad of the first tone: step
FIRST = 0.6  # rad: first step of an interval
SMALLEST = 1e-9  # rad: step
SAFE, SHRINK, GROWTH = 0.9, 0.25, 5.0
AIMED = 1e-3  # of the way to a kink: how near the guess is by which a step is aimed at it
BEYOND = 1.3  # times the way to the next kink at the present speed: longest step towards it
LANDED = 1e-9  # of the free amplitude: how near to a kink a step ends where the force jumps
NEAR = 0.01  # times the root of a step's error: how near where the force only bends, as the error then goes with the square
SWITCHED, MOST_TRIES = 1e-12, 60  # rad: how close behind a switch a step ends; attempts at it
MOST_STEPS = 40_000  # in an interval
MOST_SWITCHES = 3  # of each latch within REST: a force that switches more often keeps its branch as long
REST = 0.005  # rad


@compiled
def begin_interval(lane: Any, begin: float, phases: Any) -> None:
    """Put a lane to the start of an interval."""
    numbers, kinks = lane.numbers, lane.kinks
    lane.state[T], lane.state[BEGIN], lane.state[ATTEMPTS] = 0.0, begin, 0.0
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
    place_between(lane, side)


@compiled
def fastest_turn(lane: Any) -> float:
    """Return the largest frequency ratio of tones and modes, or rate of damping."""
    fast = 1.0
    for j in range(lane.turn.shape[0]):
        fast = max(fast, lane.turn[j, 0])
    for n in range(lane.mode.shape[0]):
        fast = max(fast, math.sqrt(lane.mode[n, 2]), 2.0 * lane.mode[n, 0])
    return fast


@compiled
def speed_bound(lane: Any) -> float:
    """Return a scaled speed that the tip does not exceed without new forces."""
    speed = 0.0
    for j in range(lane.turn.shape[0]):
        speed += lane.turn[j, 0] * math.hypot(lane.turn[j, 1], lane.turn[j, 2])
    for n in range(lane.mode.shape[0]):
        speed += math.hypot(lane.u[n, 1, 0], math.sqrt(lane.mode[n, 2]) * lane.u[n, 0, 0])
    return speed


@compiled
def longest_step(lane: Any, fast: float, speed: float, measured: bool) -> float:
    """Return how long a step may be, so that the tip neither turns twice in it nor passes a kink and comes back."""
    length = lane.numbers[LENGTH]
    if measured or lane.state[LOW] == -np.inf:
        return LONGEST / fast
    away = (lane.state[D0] - lane.state[LOW]) / length
    if lane.state[HIGH] < np.inf:
        away = min(away, (lane.state[HIGH] - lane.state[D0]) / length)
    return float(max(LONGEST / fast, min(LONGEST, FARTHEST / fast, away / speed)))


@compiled
def kink_ahead(lane: Any, force: float, longest: float) -> Any:
    """Return the kink towards which the tip moves, and when it is there if the force does not change; 0 where it is not."""
    state, mode, turn, u = lane.state, lane.mode, lane.turn, lane.u
    level = state[LOW] if state[V0] < 0.0 else state[HIGH]
    way = (level - state[D0]) / lane.numbers[LENGTH]
    s = way / state[V0]
    if not 0.0 < s < 2.0 * longest:
        return level, 0.0
    target, gain = (level - lane.numbers[ZC]) / lane.numbers[LENGTH], 0.0
    for n in range(mode.shape[0]):
        gain += mode[n, 3]
    for _ in range(5):
        x, v = inside(mode, turn, u, 0.0, 0.0, 1.0, s)
        off, v = x + 0.5 * gain * force * s * s - target, v + gain * force * s
        if v * state[V0] <= 0.0:
            return level, 0.0
        s -= off / v
        if not 0.0 < s < longest:
            return level, 0.0
        if abs(off) < AIMED * abs(way):
            return level, s
    return level, 0.0


@compiled
def landing(lane: Any, laws: Any, level: float, v: float) -> float:
    """Return how near to a kink a step has to end, scaled: the nearer, the larger the jump of the force there."""
    near = max(LANDED, NEAR * math.sqrt(lane.limits[0]))
    if lane.latched.shape[0] > 0:
        return LANDED
    beside = 2.0 * LANDED * lane.numbers[LENGTH]
    jump = abs(force_at(lane, laws, level + beside, v) - force_at(lane, laws, level - beside, v))
    swing, gain = lane.limits[0] * abs(v), 0.0
    for n in range(lane.mode.shape[0]):
        gain += lane.mode[n, 3]
    return float(max(LANDED, min(near, 0.1 * swing / (gain * jump) if jump > 0.0 else near)))


@compiled
def try_step(lane: Any, laws: Any, kind: int, h: float, left: float, f1: float, measured: bool, watched: bool) -> Any:
    """Try a step until it ends on its event; return length, kind, event, kink, error, and whether it does.

    It is at most `h` long, or `left`, to land on a kink. It ends on the first event, at a kink as near as `landing` asks.
    `f1` is the force at its start; `watched`: whether a switch may end it.
    """
    state, length = lane.state, lane.numbers[LENGTH]
    v0, begun, aim, tries, near = state[V0], kind, NOTHING, 0, -1.0
    level, low_s, high_s, low_g, high_g, error = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if kind == PLAIN:
        level, s = kink_ahead(lane, f1, h)
        if s > 0.0:
            h, kind, aim = s, ARRIVING, KINK
        elif v0 < 0.0 and state[LOW] > -np.inf:
            h = min(h, max(BEYOND * (state[LOW] - state[D0]) / (length * v0), 1e-3))
    guessed = aim == KINK
    while state[ATTEMPTS] < MOST_STEPS:
        state[ATTEMPTS] += 1.0
        error = attempt(lane, laws, kind, h, measured)
        if not (error >= 0.0 and error < 1e300):
            if h < SMALLEST:
                break
            h, aim, kind = h * SHRINK, NOTHING, begun
            continue
        d1, v1 = state[D1], state[V1]
        if aim == SWITCH:
            value = largest_switch(lane, laws, d1, v1, h)
            if value > 0.0:
                if h == high_s or h - low_s < SWITCHED or tries > MOST_TRIES:
                    return h, kind, aim, level, error, True
                high_s, high_g, low_g = h, value, 0.5 * low_g
            else:
                low_s, low_g, high_g = h, value, 0.5 * high_g
            tries += 1
            h = low_s + (high_s - low_s) * low_g / (low_g - high_g)  # Illinois
            if high_s - low_s < SWITCHED or tries > MOST_TRIES:
                h = high_s
            continue
        if aim == KINK:
            off = (d1 - level) / length
            if guessed and not (abs(off) < 0.1 * h * abs(v1) and v0 * v1 > 0.0):  # the force turned the tip elsewhere
                guessed, aim, kind, h = False, NOTHING, begun, 0.9 * h
                continue
            if near < 0.0:
                near = landing(lane, laws, level, v1)
            if abs(off) > near and tries < 8 and abs(off) < 0.5 * h * abs(v1):
                h, tries = h - off / v1, tries + 1
                if h > left:
                    h, aim, kind = left, NOTHING, begun
                continue
            d1 = level + (2.0 if v1 < 0.0 else -2.0) * LANDED * length  # a switch on the way, not at the kink itself
        if aim == NOTHING:
            leaves = d1 < state[LOW] or d1 > state[HIGH]
            turned = state[HEADING] * v1 < 0.0
            if (leaves or turned) and error < 1e4:
                aim, level, s = event_in(lane, h, turned)
                if aim == KINK:
                    kind = ARRIVING if begun == PLAIN else begun
                elif abs(s - h) < 1e-6 * h and error <= 1.0:
                    return h, kind, aim, level, error, True
                h, tries = max(s, 1e-12), 0
                continue
        if error > 1.0 and h > SMALLEST:
            h *= max(SHRINK, min(0.9 if aim == NOTHING else 0.7, SAFE * max(error, 1e-10) ** (-1.0 / 8.0)))
            aim, kind = NOTHING, begun
            continue
        high_g = largest_switch(lane, laws, d1, v1, h) if watched else 0.0
        if not high_g > 0.0:
            return h, kind, aim, level, error, True
        low_g = largest_switch(lane, laws, state[D0], v0, 0.0)
        low_s, high_s, tries, aim, kind, h = 0.0, h, 0, SWITCH, begun, 0.5 * h
    return h, kind, aim, level, error, False


@compiled
def march(lane: Any, laws: Any, interval: float, sums: Any) -> bool:
    """Advance a lane over one interval; return whether it came to the end."""
    measured, switches = sums.shape[0] > 0, lane.latched.shape[0] > 0
    if switches:
        change_latches(lane, laws, lane.state[D0], lane.state[V0])
    want, kind = FIRST, PLAIN
    if measured:
        begin_sums(lane, sums)
    crested, fast, changes, since, rest = False, fastest_turn(lane), 0, 0.0, 0.0
    speed, f1 = speed_bound(lane), force_now(lane, laws)
    while lane.state[T] < interval:
        watched = switches and lane.state[T] >= rest
        if watched and rest > 0.0:
            change_latches(lane, laws, lane.state[D0], lane.state[V0])
            f1, rest = force_now(lane, laws), 0.0
        left = (rest if rest > 0.0 else interval) - lane.state[T]
        h = min(want, left, lane.limits[3], longest_step(lane, fast, speed, measured))
        if left - h < 1e-3 * h:
            h = left
        begun = kind
        h, kind, aim, level, error, good = try_step(lane, laws, kind, h, left, f1, measured, watched)
        if not good:
            return False
        v1 = lane.state[V1]
        if measured and aim != SWITCH and not crested:
            share = crest(lane.force, lane.state[F1], sums[F_MIN], sums[F_MAX])
            if share > 0.0:  # the step is made again, to end there
                h, kind, aim, crested = time_at(kind, share, h), begun, PEAK, True
                error = attempt(lane, laws, kind, h, measured)
        else:
            crested = False
        # the step is taken
        before = f1 = lane.state[F1]
        if measured:
            add_sums(lane, h, sums)
            add_speed_and_turn(lane, h, aim == TURN, sums)
        fit = h * min(GROWTH, max(0.3, SAFE * max(error, 1e-10) ** (-1.0 / 8.0)))
        want = fit if aim == NOTHING else max(fit, want)
        take_step(lane, h)
        if lane.state[T] > interval - 1e-13:
            lane.state[T] = interval
        kind = PLAIN
        if aim == KINK:
            side = int(lane.state[SIDE])
            place_between(lane, side - 1 if level == lane.state[LOW] else side + 1)
            lane.state[D0], kind = level, LEAVING
            if switches:
                change_latches(lane, laws, level + (-1e-15 if v1 < 0.0 else 1e-15), v1)
            f1 = force_now(lane, laws)
            if f1 != before:
                salt(lane, before - f1, v1, before, (1.0, 0.0, 0.0))
        elif aim == SWITCH:
            slopes = slopes_of_switch(lane, laws, lane.state[D0], lane.state[V0])
            change_latches(lane, laws, lane.state[D0], lane.state[V0])
            f1 = force_now(lane, laws)
            salt(lane, before - f1, v1, before, slopes)
            if lane.state[T] - since > REST:
                changes, since = 0, lane.state[T]
            changes += 1
            if changes > MOST_SWITCHES * lane.latched.shape[0]:
                rest = min(lane.state[T] + REST, interval)
        elif aim == TURN:
            lane.state[HEADING] = -lane.state[HEADING]
            if laws.rate and lane.u.shape[2] > 1:  # a law may jump with the sign of the velocity
                d, rate = lane.state[D0], SWITCHED * lane.state[HEADING]
                before = force_at(lane, laws, d, -rate)
                salt(lane, before - force_at(lane, laws, d, rate), v1, before, (0.0, 1.0, 0.0))
    if measured:
        end_sums(lane, sums)
    return True


@compiled
def write_deviation(lanes: Any, i: int, k: int, u: Any) -> None:
    """Write the deviation of each part at the start of an interval, from the path: results depend on no cut into calls."""
    for r in range(lanes.split.shape[1]):
        total = 0.0
        for c in range(lanes.split.shape[2]):
            total += lanes.split[i, r, c] * (lanes.path[i, k, c] - lanes.still[i, k, c])
        u[r // 2, r % 2, 0] = total


@compiled
def write_path(lanes: Any, i: int, k: int, u: Any) -> None:
    """Write the path at the end of an interval."""
    for c in range(lanes.join.shape[1]):
        total = lanes.still[i, k, c]
        for r in range(lanes.join.shape[2]):
            total += lanes.join[i, c, r] * u[r // 2, r % 2, 0]
        lanes.path[i, k, c] = total


@compiled
def take_sample(lane: Any, laws: Any, sample: Any) -> None:
    """Write memory, branches and force where the lane is."""
    states = lane.memory.shape[1]
    for m in range(states):
        sample[m] = lane.memory[0, m]
    for k in range(lane.latched.shape[0]):
        sample[states + k] = lane.latched[k]
    sample[sample.shape[0] - 1] = force_now(lane, laws)


@called
def advance(lanes: Any, laws: Any) -> None:
    """Advance each lane over all intervals."""
    sampled = lanes.samples.shape[1] > 0
    for i in range(lanes.numbers.shape[0]):
        lane, good = lane_of(lanes, i), True
        for k in range(lanes.phases.shape[0]):
            write_deviation(lanes, i, k, lane.u)
            begin_interval(lane, lanes.begin[k], lanes.phases[k])
            if sampled and k == 0:
                change_latches(lane, laws, lane.state[D0], lane.state[V0])
                take_sample(lane, laws, lanes.samples[i, 0])
            good = march(lane, laws, lanes.span, lanes.sums[i, k])
            if not good:
                break
            write_path(lanes, i, k + 1, lane.u)
            if sampled:
                take_sample(lane, laws, lanes.samples[i, k + 1])
        if not good:
            lane.u[:] = np.nan
        lanes.deviation[i] = lane.u
        lanes.memory[i] = lane.memory[0]
