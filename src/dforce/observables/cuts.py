"""Averages of the force over steps that are cut: at turns, kinks of the force, switches of a branch, and first contact.

The integrator has cut its steps, too, see ``integrators.rk4``, but its samples lie at even times. So the steps between them are
cut again here, for the averages over a period.

The force differs on both sides of a kink, and no smooth interpolant leads across it. One Runge–Kutta step from a known motion
and a short Taylor step lead to the kink: each piece has the motion and its accelerations at both ends. Next to a kink a force
may start like the root of the distance to it, which the substitution s = u^2 (3 - 2u) makes smooth.

These arguments are passed together, beside the `drive` of ``integrators.loops``:

- `record`: the samples of a period, the length of a step, the time of the first sample (s), the memory's rates of change at
  all samples, room for the memory, and the distances (m) of the kinks;
- `piece`: a part of a step, see `FROM`; before the step is cut, all of it;
- `limits`: the least and the largest distance (m) between the kinks on either side of a piece, both just inside;
- `result`: the sums, the pieces in which the force is highest and lowest, and the row that is measured, whose last columns
  are the lock-ins of the force.
"""

from __future__ import annotations

import math
from typing import Any

from dforce.kernel.codegen import CONTACT, OMEGA, ZC
from dforce.kernel.linker import inlined
from dforce.kernel.vocabulary import (
    arrived,
    bent,
    branches_begin,
    coasted,
    distance,
    drive_at,
    force,
    forced,
    free_acceleration,
    has_states,
    motion,
    motion_of,
    motion_size,
    pushed,
    rate_of,
    switch,
)
from dforce.observables.interpolant import (
    bends,
    between_kinks,
    cubic,
    cubic_rate,
    cut_at,
    held,
    insert,
    quintic,
    quintic_rate,
    turning,
)
from dforce.observables.lockin import TAU, add_lock_in, turned

# Gauss–Legendre on (0, 1) with three nodes, for whole steps and pieces of a step that turns; then, without weight, just
# inside both ends of a piece, where the force has its extremes at a kink; then six after the substitution, for pieces that
# end at a kink
PLAIN, TURNED, CUT = 3, 5, 11
NODES = (
    0.1127016653792583,
    0.5,
    0.8872983346207417,
    1e-9,
    0.999999999,
    0.003343283942477668,
    0.0763627911457814,
    0.3244323018146883,
    0.6755676981853117,
    0.9236372088542186,
    0.9966567160575223,
)
WEIGHTS = (
    0.2777777777777778,
    0.4444444444444444,
    0.2777777777777778,
    0.0,
    0.0,
    0.01676846244060248,
    0.1522780409672892,
    0.3309534965921084,
    0.3309534965921084,
    0.1522780409672892,
    0.01676846244060248,
)
TURN, SWITCH = -1.0, -2.0  # events other than levels of the distance, which are counted from 0; latch k is SWITCH - k
TRIES, NEAR = 3, 1e-3  # Runge–Kutta steps to an event; share of a step that a Taylor step leads over at most
SECTIONS = 6  # of the golden section: to a tenth of the piece, where a parabola through three places gives the extreme
GOLDEN = 0.6180339887498949
TOP = 4.0  # the top of a parabola lies at most half so many times the outer places' distance from their middle

# sums over the steps: force, force times deflection and velocity, and time in contact; extremes, and the steps with them
SUM, SUM_Z, SUM_V, TOUCHED, F_LOW, F_HIGH, AT_LOW, AT_HIGH, D_LOW, D_HIGH, FASTEST, SUMS = range(12)
# a piece: the part of the step that it is interpolated over, the motion at both ends of that, and the shares of it between
# which it reaches; whether it has the branches at the end of the step, and the number of the step
FROM, TO, D0, V0, A0, D1, V1, A1, BEGIN, END, LATE, STEP, PIECE = range(13)


@inlined
def force_at(d: float, rate: float, share: float, i: int, late: bool, record: Any, p: Any) -> float:
    """Return the force at a share of step i; `late` takes the branches from its end."""
    samples, h, start, rates, stage, _ = record
    t = start + i * h
    if has_states():
        place, which = motion_size(), i + 1 if late else i
        for k in range(stage.shape[0]):
            begin, end = samples[i, place + k], samples[i + 1, place + k]
            stage[k] = cubic(share, h * p[OMEGA], begin, rates[i, k], end, rates[i + 1, k])
        return force(d, rate, t + share * h, stage, samples[which, branches_begin(p) :], p)
    return force(d, rate, t + share * h, stage, stage, p)


@inlined
def force_beside(y: Any, share: float, limits: Any, piece: Any, record: Any, p: Any) -> float:
    """Return the force on a motion at a share of the step, on the piece's side of all kinks."""
    d = held(distance(y, p), limits)
    return force_at(d, rate_of(y, p), share, int(piece[STEP]), piece[LATE] == 1.0, record, p)


@inlined
def whole_piece(i: int, path: Any, piece: Any) -> None:
    """Write step i as a piece; `path` holds distance, velocity, force and acceleration at the samples."""
    d, v, _, a, _, _ = path
    piece[FROM], piece[D0], piece[V0], piece[A0] = 0.0, d[i], v[i], a[i]
    piece[TO], piece[D1], piece[V1], piece[A1] = 1.0, d[i + 1], v[i + 1], a[i + 1]
    piece[BEGIN], piece[END], piece[LATE], piece[STEP] = 0.0, 1.0, 0.0, i


def add_pieces(piece: Any, rooted: bool, record: Any, drive: Any, phasor: Any, cuts: Any, result: Any, p: Any) -> int:
    """Add a step piece by piece, from the whole of it; return how many events it holds besides a turn.

    `phasor` holds the tones' cosine and sine at its start. Where it is `rooted` the force may be like a root near it. `cuts` is
    scratch.
    """
    (samples, h, _, _, _, kinks), (tones, bases, _, points), sums, i = record, drive, result[0], int(piece[STEP])
    d0, v0, d1, v1, a1 = piece[D0], piece[V0], piece[D1], piece[V1], piece[A1]
    top = turning(h, d0, v0, d1, v1) if v0 * v1 < 0.0 else 0.0
    turns = insert(cuts, 0, top, TURN)
    count, event, contact_is_kink, ends = turns, 0.0, False, (h, d0, v0, d1, v1)
    for kink in kinks:
        count = cut_at(cuts, count, kink, event, top, ends)
        contact_is_kink = contact_is_kink or kink == p[CONTACT]
        event += 1.0
    if not contact_is_kink:
        count = cut_at(cuts, count, p[CONTACT], event, top, ends)
    if has_states():
        for which in range(samples.shape[1] - 1 - branches_begin(p)):
            count = insert(cuts, count, switching_share(which, i, record, p), SWITCH - which)
    if count == turns:
        if turns:
            piece[END] = turned_at(top, h, piece)
            d = within(piece[END], h, piece)
            sums[D_LOW], sums[D_HIGH] = min(sums[D_LOW], d), max(sums[D_HIGH], d)
            first, after = (PLAIN, CUT) if rooted else (0, TURNED)
            add_piece(piece, first, after, record, drive, phasor, result, p)
            piece[BEGIN] = piece[END]
        piece[END] = 1.0
        first, after = (PLAIN, CUT) if rooted else (0, TURNED if turns else PLAIN)
        add_piece(piece, first, after, record, drive, phasor, result, p)
        return 0
    y, tau, reached = motion_of(samples, i), i * TAU / points, 0.0
    cuts[0, count] = 1.0
    for k in range(count + 1):
        guess = cuts[0, k]
        d = cubic(0.5 * (reached + guess), h, d0, v0, d1, v1)
        limits, share = between_kinks(d, kinks, p), piece[FROM]
        if k > 0:  # the acceleration on this side of the event
            piece[D0], piece[V0] = distance(y, p), rate_of(y, p)
            f = force_beside(y, share, limits, piece, record, p)
            piece[A0] = acceleration(y, f, tau + share * h * p[OMEGA], tones, bases, p)
        if k < count:
            y, share = landed(y, max(guess, share), cuts[1, k], limits, piece, record, drive, p)
            piece[TO], piece[D1], piece[V1] = share, distance(y, p), rate_of(y, p)
            f = force_beside(y, share, limits, piece, record, p)
            piece[A1] = acceleration(y, f, tau + share * h * p[OMEGA], tones, bases, p)
            sums[D_LOW], sums[D_HIGH] = min(sums[D_LOW], piece[D1]), max(sums[D_HIGH], piece[D1])
            sums[FASTEST] = max(sums[FASTEST], abs(piece[V1]))
        else:
            piece[TO], piece[D1], piece[V1], piece[A1] = 1.0, d1, v1, a1
        if piece[TO] > piece[FROM]:
            add_piece(piece, PLAIN, CUT, record, drive, phasor, result, p)
        piece[FROM], reached = piece[TO], guess
        if k < count and cuts[1, k] <= SWITCH:
            piece[LATE] = 1.0
    return count - turns


@inlined
def acceleration(y: Any, f: float, tau: float, tones: Any, bases: Any, p: Any) -> float:
    """Return the tip's acceleration (m/s^2) under a force."""
    return rate_of(motion(drive_at(tones, bases, tau), f, y, p), p) * p[OMEGA]


@inlined
def within(s: float, h: float, piece: Any) -> float:
    """Return the distance at a share of a piece's range of interpolation."""
    step = (piece[TO] - piece[FROM]) * h
    b0, b1 = bends(step, piece[D0], piece[V0], piece[A0], piece[D1], piece[V1], piece[A1])
    return quintic(s, step, piece[D0], piece[V0], piece[D1], piece[V1], b0, b1)


def turned_at(guess: float, h: float, piece: Any) -> float:
    """Return where the interpolant of a whole step turns, by the secant method."""
    b0, b1 = bends(h, piece[D0], piece[V0], piece[A0], piece[D1], piece[V1], piece[A1])
    low, high, s = 0.0, 1.0, guess
    for _ in range(20):
        rate = quintic_rate(s, h, piece[D0], piece[V0], piece[D1], piece[V1], b0, b1)
        ahead = quintic_rate(s + 1e-6, h, piece[D0], piece[V0], piece[D1], piece[V1], b0, b1)
        low, high = (s, high) if (rate > 0.0) == (piece[V0] > 0.0) else (low, s)
        step = rate / (ahead - rate) * 1e-6 if ahead != rate else 1.0
        if not low < s - step < high:
            step = s - 0.5 * (low + high)
        s -= step
        if abs(step) < 1e-9:
            break
    return s


@inlined
def landed(y: Any, guess: float, event: float, limits: Any, piece: Any, record: Any, drive: Any, p: Any) -> Any:
    """Return the motion at an event near a guess, from that where a piece begins, and the share of the step at which it is."""
    (_, h, _, _, _, _), (tones, bases, _, points), share = record, drive, piece[FROM]
    tau, step, end, there = int(piece[STEP]) * TAU / points, h * p[OMEGA], y, share
    for _ in range(TRIES):
        there = guess
        end = carried(y, there, limits, piece, record, drive, p)
        f = force_beside(end, there, limits, piece, record, p)
        bend = acceleration(end, f, tau + there * step, tones, bases, p)
        off = time_to(event, distance(end, p), rate_of(end, p), bend, there, int(piece[STEP]), record, p) / h
        if abs(off) < NEAR:
            back = off * step
            a = forced(free_acceleration(drive_at(tones, bases, tau + there * step), end, p), f, p)
            return pushed(bent(coasted(end, back), 0.5 * back * back, a), back, a), there + off
        guess = there + off
        if not share <= guess <= 1.0:
            break
    return end, there


@inlined
def time_to(event: float, d: float, rate: float, a: float, share: float, i: int, record: Any, p: Any) -> float:
    """Return the time (s) from a share of step i to an event, for a tip with constant acceleration."""
    samples, h, start, _, _, kinks = record
    if event == TURN:
        return -rate / a
    if event > TURN:
        level, off = kinks[int(event)] if event < kinks.shape[0] else p[CONTACT], 0.0
        for _ in range(4):
            off -= (d + off * (rate + 0.5 * off * a) - level) / (rate + off * a)
        return off
    if has_states():
        which, t = int(SWITCH - event), start + i * h + share * h
        latched, off, near = samples[i, branches_begin(p) :], 0.0, 1e-9 / p[OMEGA]
        for _ in range(4):
            here = switch(which, latched, d + off * (rate + 0.5 * off * a), rate + off * a, t + off, p)
            off += near
            ahead = switch(which, latched, d + off * (rate + 0.5 * off * a), rate + off * a, t + off, p)
            off -= near * (1.0 + here / (ahead - here))
        return off
    return math.inf


@inlined
def carried(y: Any, there: float, limits: Any, piece: Any, record: Any, drive: Any, p: Any) -> Any:
    """Return the motion at another share of a step than where a piece begins, by one classical Runge–Kutta step."""
    (_, h, _, _, _, _), (tones, bases, _, points), share = record, drive, piece[FROM]
    step, middle_share = (there - share) * h * p[OMEGA], 0.5 * (share + there)
    start = int(piece[STEP]) * TAU / points + share * h * p[OMEGA]
    u1 = drive_at(tones, bases, start + 0.5 * step)
    middle, last = coasted(y, 0.5 * step), coasted(y, step)
    f = force_beside(y, share, limits, piece, record, p)
    a1 = forced(free_acceleration(drive_at(tones, bases, start), y, p), f, p)
    ya = pushed(middle, 0.5 * step, a1)
    a2 = forced(free_acceleration(u1, ya, p), force_beside(ya, middle_share, limits, piece, record, p), p)
    yb = pushed(bent(middle, 0.25 * step * step, a1), 0.5 * step, a2)
    a3 = forced(free_acceleration(u1, yb, p), force_beside(yb, middle_share, limits, piece, record, p), p)
    yc = pushed(bent(last, 0.5 * step * step, a2), step, a3)
    f = force_beside(yc, there, limits, piece, record, p)
    a4 = forced(free_acceleration(drive_at(tones, bases, start + step), yc, p), f, p)
    return arrived(last, step, a1, a2, a3, a4)


def add_piece(piece: Any, first: int, after: int, record: Any, drive: Any, phasor: Any, result: Any, p: Any) -> None:
    """Add the nodes from `first` to `after` of a piece."""
    (_, h, _, _, _, _), (tones, _, _, points), (sums, tops, out) = record, drive, result
    i, late, column = int(piece[STEP]), piece[LATE] == 1.0, out.shape[0] - 2 * tones.shape[0]
    share, width = piece[FROM], piece[TO] - piece[FROM]
    step, begin, length = width * h, piece[BEGIN], piece[END] - piece[BEGIN]
    d0, v0, d1, v1 = piece[D0], piece[V0], piece[D1], piece[V1]
    b0, b1 = bends(step, d0, v0, piece[A0], d1, v1, piece[A1])
    if quintic(begin + 0.5 * length, step, d0, v0, d1, v1, b0, b1) < p[CONTACT]:
        sums[TOUCHED] += width * length
    force_sum, with_z, with_v = 0.0, 0.0, 0.0
    for q in range(first, after):
        s = begin + NODES[q] * length
        d, rate = quintic(s, step, d0, v0, d1, v1, b0, b1), quintic_rate(s, step, d0, v0, d1, v1, b0, b1)
        f = force_at(d, rate, share + s * width, i, late, record, p)
        if f > sums[F_HIGH]:
            sums[F_HIGH], sums[AT_HIGH] = f, i
            for k in range(PIECE):
                tops[0, k] = piece[k]
        if f < sums[F_LOW]:
            sums[F_LOW], sums[AT_LOW] = f, i
            for k in range(PIECE):
                tops[1, k] = piece[k]
        part = WEIGHTS[q] * width * length * f
        force_sum += part
        with_z += part * (d - p[ZC])
        with_v += part * rate
        for j in range(tones.shape[0]):
            c, sine = turned(phasor[0, j], phasor[1, j], tones[j, 0] * TAU / points * (share + s * width))
            add_lock_in(part, 0.0, c, sine, points, out, column + 2 * j)
    sums[SUM], sums[SUM_Z], sums[SUM_V] = sums[SUM] + force_sum, sums[SUM_Z] + with_z, sums[SUM_V] + with_v


def switching_share(which: int, i: int, record: Any, p: Any) -> float:
    """Return where in step i a branch switched, or 1 when it did not."""
    samples, h, start, _, _, _ = record
    place, t = branches_begin(p), start + i * h
    if samples[i, place + which] == samples[i + 1, place + which]:
        return 1.0
    a, b = motion_of(samples, i), motion_of(samples, i + 1)
    d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
    low, high = 0.0, 1.0
    for _ in range(40):
        s = 0.5 * (low + high)
        d, rate = cubic(s, h, d0, v0, d1, v1), cubic_rate(s, h, d0, v0, d1, v1)
        if switch(which, samples[i, branches_begin(p) :], d, rate, t + s * h, p) > 0.0:
            high = s
        else:
            low = s
    return high


def refine(sign: float, best: float, piece: Any, record: Any, p: Any) -> float:
    """Return the extreme of sign times the force on a piece, by golden section, no worse than `best`."""
    low, high = piece[BEGIN], piece[END]
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = sign * force_on(left, piece, record, p), sign * force_on(right, piece, record, p)
    for _ in range(SECTIONS):
        best = max(best, at_left, at_right)
        if at_left > at_right:
            high, right, at_right = right, left, at_left
            left = high - GOLDEN * (high - low)
            at_left = sign * force_on(left, piece, record, p)
        else:
            low, left, at_left = left, right, at_right
            right = low + GOLDEN * (high - low)
            at_right = sign * force_on(right, piece, record, p)
    middle = sign * force_on(0.5 * (left + right), piece, record, p)
    best, bend, rise = max(best, at_left, at_right, middle), 2.0 * middle - at_left - at_right, at_right - at_left
    if bend > 0.0 and abs(rise) < TOP * bend:
        best = max(best, middle + 0.125 * rise * rise / bend)
    return best


@inlined
def force_on(s: float, piece: Any, record: Any, p: Any) -> float:
    """Return the force at a share of a piece's range of interpolation."""
    width, h = piece[TO] - piece[FROM], record[1]
    b0, b1 = bends(width * h, piece[D0], piece[V0], piece[A0], piece[D1], piece[V1], piece[A1])
    d = quintic(s, width * h, piece[D0], piece[V0], piece[D1], piece[V1], b0, b1)
    rate = quintic_rate(s, width * h, piece[D0], piece[V0], piece[D1], piece[V1], b0, b1)
    return force_at(d, rate, piece[FROM] + s * width, int(piece[STEP]), piece[LATE] == 1.0, record, p)
