"""Everything that is measured over one period of the first tone, from its samples.

Deflections are summed over the samples. Forces are not smooth, so their averages are taken piece by piece: each step
between samples is cut where the motion turns, where the force has a kink and where a branch switches, and each piece
is integrated by Gauss–Legendre quadrature on the cubic Hermite interpolant of the motion and of the forces' memory.
The same pieces give the contact time and the extremes between samples. Next to a kink a force may start like the root
of the distance to it, which the substitution s = u^2 (3 - 2u) makes smooth.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.kernel.slots import (
    distance,
    evolve,
    force,
    latch_count,
    memory_size,
    mode_count,
    motion_of,
    rate_of,
    switch,
)
from dforce.observables.lockin import TAU, deflection, lock_in_column
from dforce.observables.pieces import MOST_CUTS, cubic, cubic_rate, cut_at, fastest, insert, turning

# columns of the result, then 2 per tone and mode, 2 per tone (total), 2 per harmonic, 2 per tone (force)
Z, F, F_Z, F_V, CONTACT, Z_MIN, Z_MAX, F_MIN, F_MAX, D_MIN, V_MAX, FIRST = range(12)

# Gauss–Legendre on (0, 1) with three nodes, for whole steps and pieces of a step that turns; then, without weight, just
# inside both ends of a piece, where the force has its extremes at a kink; then six after the substitution, for pieces that
# end at a kink
PLAIN, TURNED, CUT = 3, 5, 11
NODES = (
    0.1127016653792583, 0.5, 0.8872983346207417,
    1e-9, 0.999999999,
    0.003343283942477668, 0.0763627911457814, 0.3244323018146883, 0.6755676981853117, 0.9236372088542186, 0.9966567160575223,
)  # fmt: skip
WEIGHTS = (
    0.2777777777777778, 0.4444444444444444, 0.2777777777777778,
    0.0, 0.0,
    0.01676846244060248, 0.1522780409672892, 0.3309534965921084, 0.3309534965921084, 0.1522780409672892, 0.01676846244060248,
)  # fmt: skip
BENT = 0.01  # relative second difference of the force over a step up to which Simpson's rule is good to a millionth
GOLDEN = 0.6180339887498949


def force_within(s: float, h: float, block: Any, i: int, t: float, stage: Any, late: bool, p: Any) -> float:
    """Return the force at the share s of step i; `late` takes the branches from the step's end.

    `stage` has room for the memory and, behind it, its rates of change at both ends of the step (`rates_of_memory`).
    """
    a, b = motion_of(block, i), motion_of(block, i + 1)
    d = cubic(s, h, distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p))
    rate = cubic_rate(s, h, distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p))
    place = 2 * mode_count()
    size = memory_size()
    for k in range(size):
        start, end = block[i, place + k], block[i + 1, place + k]
        stage[k] = cubic(s, h * p[3], start, stage[size + k], end, stage[2 * size + k])
    place += size
    if latch_count():
        which = i + 1 if late else i
        return force(d, rate, t + s * h, stage, block[which, place : place + latch_count()], p)
    return force(d, rate, t + s * h, stage, stage, p)


def rates_of_memory(h: float, block: Any, i: int, t: float, stage: Any, p: Any) -> None:
    """Write the rates of change of the forces' memory at both ends of step i behind the room for the memory."""
    size = memory_size()
    place = 2 * mode_count()
    for end in range(2):
        y = motion_of(block, i + end)
        memory = block[i + end, place : place + size]
        change = stage[(1 + end) * size : (2 + end) * size]
        evolve(distance(y, p), rate_of(y, p), t + end * h, memory, memory, change, p)


def switching_share(block: Any, i: int, h: float, t: float, p: Any) -> float:
    """Return where in step i a branch switched, or 1 when none did."""
    place = 2 * mode_count() + memory_size()
    a, b = motion_of(block, i), motion_of(block, i + 1)
    d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
    first = 1.0
    for which in range(latch_count()):
        if block[i, place + which] == block[i + 1, place + which]:
            continue
        low, high = 0.0, 1.0
        for _ in range(40):
            s = 0.5 * (low + high)
            d, rate = cubic(s, h, d0, v0, d1, v1), cubic_rate(s, h, d0, v0, d1, v1)
            if switch(which, block[i, place : place + latch_count()], d, rate, t + s * h, p) > 0.0:
                high = s
            else:
                low = s
        first = min(first, high)
    return first


def refine(h: float, block: Any, i: int, t: float, stage: Any, sign: float, best: float, p: Any) -> float:
    """Return the extreme of sign times the force within step i, by golden section, no worse than `best`."""
    if memory_size():
        rates_of_memory(h, block, i, t, stage, p)
    low, high = 0.0, 1.0
    left, right = 1.0 - GOLDEN, GOLDEN
    at_left = sign * force_within(left, h, block, i, t, stage, False, p)
    at_right = sign * force_within(right, h, block, i, t, stage, False, p)
    best = max(best, at_left, at_right)
    for _ in range(7):  # to a hundredth of the step, where the force is flat to a millionth
        if at_left > at_right:
            high, right, at_right = right, left, at_left
            left = high - GOLDEN * (high - low)
            at_left = sign * force_within(left, h, block, i, t, stage, False, p)
            best = max(best, at_left)
        else:
            low, left, at_left = left, right, at_right
            right = low + GOLDEN * (high - low)
            at_right = sign * force_within(right, h, block, i, t, stage, False, p)
            best = max(best, at_right)
    return best


def measure(
    block: Any, period: int, points: int, tones: Any, bases: Any, p: Any, kinks: Any, harmonics: int, out: Any
) -> None:
    """Write the averages, extremes and lock-ins of one period into `out`; lengths are scaled, forces and times SI."""
    for k in range(out.shape[0]):
        out[k] = 0.0
    forces = measure_motion(block, points, tones, bases, harmonics, out)
    stage = np.zeros(max(3 * memory_size(), 1))
    measure_force(block, period, points, tones, bases, p, kinks, stage, forces, out)


def measure_motion(block: Any, points: int, tones: Any, bases: Any, harmonics: int, out: Any) -> int:
    """Measure the deflection at the samples; return the first column of the force's lock-ins."""
    modes = mode_count()
    place = FIRST
    for j in range(tones.shape[0]):
        total = place + 2 * modes
        for n in range(modes):
            lock_in_column(block, n, points, tones[j, 0], bases[j], out, place + 2 * n)
            out[total] += out[place + 2 * n]
            out[total + 1] += out[place + 2 * n + 1]
        place = total + 2
    half = (
        points - 1
    ) // 2  # samples i and points - i go together: their sum with the cosine, difference with the sine
    even, odd = np.zeros(half + 2), np.zeros(half + 2)
    cosine, sine = np.empty(points), np.empty(points)
    turn_c, turn_s = math.cos(TAU / points), math.sin(TAU / points)
    c, s = 1.0, 0.0
    for i in range(points):
        cosine[i], sine[i] = c, s
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    first = 0.5 * (deflection(block, 0) + deflection(block, points))
    opposite = deflection(block, points // 2) if points % 2 == 0 else 0.0
    total_z = first + opposite
    for i in range(1, half + 1):
        one, other = deflection(block, i), deflection(block, points - i)
        even[i], odd[i] = one + other, one - other
        total_z += even[i]
    out[Z] = total_z / points
    for k in range(1, harmonics + 1):
        real, imaginary = first + (opposite if k % 2 == 0 else -opposite), 0.0
        real_too, imaginary_too, angle = 0.0, 0.0, 0  # two sums each, so that one need not wait for the other
        for i in range(1, half + 1, 2):
            angle += k
            if angle >= points:
                angle -= points
            real += even[i] * cosine[angle]
            imaginary -= odd[i] * sine[angle]
            angle += k
            if angle >= points:
                angle -= points
            real_too += even[i + 1] * cosine[angle]
            imaginary_too -= odd[i + 1] * sine[angle]
        real, imaginary = real + real_too, imaginary + imaginary_too
        c, s = math.cos(k * bases[0]), math.sin(k * bases[0])
        out[place] = 2.0 * (real * c + imaginary * s) / points
        out[place + 1] = 2.0 * (imaginary * c - real * s) / points
        place += 2
    return place


def measure_force(
    block: Any, period: int, points: int, tones: Any, bases: Any, p: Any, kinks: Any, stage: Any, forces: int, out: Any
) -> None:
    """Measure the force and the extremes of the motion, step by step between the samples."""
    h = TAU / points / p[3]
    last = block.shape[1] - 1
    start = period * TAU / p[3]
    cuts = np.empty(MOST_CUTS + 1)
    sums = np.empty(SUMS)
    clear(sums)
    phasors = np.empty((4, tones.shape[0]))  # of each tone: cosine and sine now, and the turn of half a step
    nodes = np.empty((2 * PLAIN, tones.shape[0]))  # the turn to each node of a step that is not cut
    near = p[4]
    for kink in kinks:
        near = max(near, kink)
    for j in range(tones.shape[0]):
        half = 0.5 * tones[j, 0] * TAU / points
        phasors[0, j], phasors[1, j] = math.cos(bases[j]), math.sin(bases[j])
        phasors[2, j], phasors[3, j] = math.cos(half), math.sin(half)
        for q in range(PLAIN):
            nodes[2 * q, j], nodes[2 * q + 1, j] = math.cos(2.0 * NODES[q] * half), math.sin(2.0 * NODES[q] * half)
    d_min, d_max, fast = np.inf, -np.inf, 0.0
    f_min, f_max, lowest, highest = np.inf, -np.inf, 0, 0
    f_sum, fz_sum, fv_sum = 0.0, 0.0, 0.0
    b = motion_of(block, 0)
    d1, v1 = distance(b, p), rate_of(b, p)
    for i in range(points):
        t = start + i * h
        d0, v0 = d1, v1
        b = motion_of(block, i + 1)
        d1, v1 = distance(b, p), rate_of(b, p)
        f0, f1 = block[i, last], block[i + 1, last]
        d_min, d_max = min(d_min, d0), max(d_max, d0)
        fast = max(fast, fastest(h, d0, v0, d1, v1))
        if memory_size():
            rates_of_memory(h, block, i, t, stage, p)
        if f0 > f_max:
            f_max, highest = f0, i
        if f0 < f_min:
            f_min, lowest = f0, i
        if v0 * v1 > 0.0 and not latch_count() and not kink_between(d0, d1, kinks, p[4]):
            if d0 > near and d1 > near:
                fm = force_within(0.5, h, block, i, t, stage, False, p)
                if abs(f0 - 2.0 * fm + f1) <= BENT * (abs(f0) + abs(f1)):
                    dm, vm = cubic(0.5, h, d0, v0, d1, v1), cubic_rate(0.5, h, d0, v0, d1, v1)
                    f_sum += f0 + 4.0 * fm + f1
                    fz_sum += f0 * (d0 - p[0]) + 4.0 * fm * (dm - p[0]) + f1 * (d1 - p[0])
                    fv_sum += f0 * v0 + 4.0 * fm * vm + f1 * v1
                    add_smooth(phasors, f0, 4.0 * fm, f1, 1.0 / (3.0 * points), forces, out)
                    continue
            for q in range(PLAIN):
                s = NODES[q]
                f = force_within(s, h, block, i, t, stage, False, p)
                weighted = 6.0 * WEIGHTS[q] * f
                if f > f_max:
                    f_max, highest = f, i
                if f < f_min:
                    f_min, lowest = f, i
                f_sum += weighted
                fz_sum += weighted * (cubic(s, h, d0, v0, d1, v1) - p[0])
                fv_sum += weighted * cubic_rate(s, h, d0, v0, d1, v1)
                add_node(phasors, nodes, q, weighted / (3.0 * points), forces, out)
            if d0 < p[4]:
                out[CONTACT] += 1.0 / points
            add_smooth(phasors, 0.0, 0.0, 0.0, 0.0, forces, out)
            continue
        measure_pieces(block, i, i, h, t, points, tones, phasors, p, kinks, stage, cuts, sums, forces, out)
        add_smooth(phasors, 0.0, 0.0, 0.0, 0.0, forces, out)
    if sums[F_HIGH] > f_max:
        f_max, highest = sums[F_HIGH], int(sums[AT_HIGH])
    if sums[F_LOW] < f_min:
        f_min, lowest = sums[F_LOW], int(sums[AT_LOW])
    for i in (max(highest - 1, 0), highest):
        f_max = refine(h, block, i, start + i * h, stage, 1.0, f_max, p)
    for i in (max(lowest - 1, 0), lowest):
        f_min = -refine(h, block, i, start + i * h, stage, -1.0, -f_min, p)
    out[F] = (f_sum / 6.0 + sums[SUM]) / points
    out[F_Z] = (fz_sum / 6.0 + sums[SUM_Z]) / points
    out[F_V] = (fv_sum / 6.0 + sums[SUM_V]) / points
    d_min, d_max = min(d_min, sums[D_LOW]), max(d_max, sums[D_HIGH])
    out[F_MIN], out[F_MAX], out[D_MIN], out[V_MAX] = f_min, f_max, d_min, fast
    out[Z_MIN], out[Z_MAX] = (d_min - p[0]) / p[1], (d_max - p[0]) / p[1]


# what the steps taken in pieces add up: force, and force times deflection and velocity; extremes, and in which steps
SUM, SUM_Z, SUM_V, F_LOW, F_HIGH, AT_LOW, AT_HIGH, D_LOW, D_HIGH, SUMS = range(10)


def clear(sums: Any) -> None:
    """Make the sums ready for a period."""
    for k in range(SUMS):
        sums[k] = 0.0
    sums[F_LOW], sums[F_HIGH], sums[D_LOW], sums[D_HIGH] = np.inf, -np.inf, np.inf, -np.inf


def measure_pieces(
    block: Any, i: int, at: int, h: float, t: float, points: int, tones: Any, phasors: Any, p: Any, kinks: Any,
    stage: Any, cuts: Any, sums: Any, forces: int, out: Any,
) -> None:  # fmt: skip
    """Measure the force over the step from sample i of the block, piece by piece; it is step `at` of the period."""
    a, b = motion_of(block, i), motion_of(block, i + 1)
    d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
    turn = turning(h, d0, v0, d1, v1) if v0 * v1 < 0.0 else 0.0
    turns = insert(cuts, 0, turn)
    count = turns
    contact_is_kink = False
    for kink in kinks:
        count = cut_at(cuts, count, kink, turn, h, d0, v0, d1, v1)
        contact_is_kink = contact_is_kink or kink == p[4]
    if not contact_is_kink:
        count = cut_at(cuts, count, p[4], turn, h, d0, v0, d1, v1)
    switched = 1.0
    if latch_count():
        switched = switching_share(block, i, h, t, p)
        count = insert(cuts, count, switched)
    first, after = (PLAIN, CUT) if count > turns else (0, TURNED if turns else PLAIN)
    simple = memory_size() == 0 and latch_count() == 0
    cuts[count] = 1.0
    d = cubic(turn, h, d0, v0, d1, v1)
    sums[D_LOW], sums[D_HIGH] = min(sums[D_LOW], d), max(sums[D_HIGH], d)
    low = 0.0
    for k in range(count + 1):
        high = cuts[k]
        middle = 0.5 * (low + high)
        if cubic(middle, h, d0, v0, d1, v1) < p[4]:
            out[CONTACT] += (high - low) / points
        for q in range(first, after):
            s = low + NODES[q] * (high - low)
            d, rate = cubic(s, h, d0, v0, d1, v1), cubic_rate(s, h, d0, v0, d1, v1)
            if simple:
                f = force(d, rate, t + s * h, stage, stage, p)
            else:
                f = force_within(s, h, block, i, t, stage, middle > switched, p)
            weight = WEIGHTS[q] * (high - low)
            if f > sums[F_HIGH]:
                sums[F_HIGH], sums[AT_HIGH] = f, at
            if f < sums[F_LOW]:
                sums[F_LOW], sums[AT_LOW] = f, at
            sums[SUM] += weight * f
            sums[SUM_Z] += weight * f * (d - p[0])
            sums[SUM_V] += weight * f * rate
            for j in range(tones.shape[0]):
                c, sine = turned(phasors[0, j], phasors[1, j], tones[j, 0] * TAU / points * s)
                out[forces + 2 * j] += 2.0 * weight * f * c / points
                out[forces + 2 * j + 1] -= 2.0 * weight * f * sine / points
        low = high


def turned(c: float, s: float, x: float) -> Any:
    """Return the cosine and sine of an angle increased by x, a small angle (to the last digit below 0.4)."""
    q = x * x
    cos_x = 1.0 - q / 2.0 * (
        1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0))))
    )
    sin_x = x * (
        1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0 * (1.0 - q / 156.0)))))
    )
    return c * cos_x - s * sin_x, s * cos_x + c * sin_x


def kink_between(d0: float, d1: float, kinks: Any, a0: float) -> bool:
    """Say whether a kink, or contact, lies between two distances."""
    for kink in kinks:
        if (d0 - kink) * (d1 - kink) < 0.0:
            return True
    return (d0 - a0) * (d1 - a0) < 0.0


def add_node(phasors: Any, nodes: Any, q: int, weighted: float, place: int, out: Any) -> None:
    """Add one node of a step to the force's lock-ins."""
    for j in range(phasors.shape[1]):
        c0, s0, turn_c, turn_s = phasors[0, j], phasors[1, j], nodes[2 * q, j], nodes[2 * q + 1, j]
        out[place + 2 * j] += weighted * (c0 * turn_c - s0 * turn_s)
        out[place + 2 * j + 1] -= weighted * (s0 * turn_c + c0 * turn_s)


def add_smooth(phasors: Any, f0: float, fm: float, f1: float, weight: float, place: int, out: Any) -> None:
    """Add a step to the force's lock-ins from its start, middle and end, and turn the tones' phasors to its end."""
    for j in range(phasors.shape[1]):
        c0, s0, turn_c, turn_s = phasors[0, j], phasors[1, j], phasors[2, j], phasors[3, j]
        cm, sm = c0 * turn_c - s0 * turn_s, s0 * turn_c + c0 * turn_s
        c1, s1 = cm * turn_c - sm * turn_s, sm * turn_c + cm * turn_s
        out[place + 2 * j] += weight * (f0 * c0 + fm * cm + f1 * c1)
        out[place + 2 * j + 1] -= weight * (f0 * s0 + fm * sm + f1 * s1)
        phasors[0, j], phasors[1, j] = c1, s1
