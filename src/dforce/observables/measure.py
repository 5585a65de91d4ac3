"""Everything that is measured over one period of the first tone, from its samples.

Deflections are summed over the samples. Forces are not smooth, so their averages are taken step by step between samples:
by Simpson's rule where the force is flat enough, else by Gauss–Legendre quadrature on the cubic Hermite interpolant of the
motion and of the forces' memory. A step is cut in pieces where the motion turns, where the force has a kink and where a
branch switches; the pieces give the contact time and the extremes between samples, too. Next to a kink a force may start
like the root of the distance to it, which the substitution s = u^2 (3 - 2u) makes smooth.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.kernel.link import by_address, inlined, reordered
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
from dforce.observables.lockin import TAU, add_lock_in, dot, lock_in_at, tones_turns, turned_sums
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
ROOM = 7  # rows of scratch, one number a sample
FLAT, STEEP, CUTS = 0.0, 1.0, 2.0  # how the force is averaged over a step: Simpson, Gauss–Legendre, in pieces


def measure(
    block: Any, period: int, points: int, tones: Any, bases: Any, p: Any, kinks: Any, harmonics: int, out: Any
) -> None:
    """Write the averages, extremes and lock-ins of one period into `out`; lengths are scaled, forces and times SI."""
    for k in range(out.shape[0]):
        out[k] = 0.0
    cosine, sine = np.empty((tones.shape[0], points + 1)), np.empty((tones.shape[0], points + 1))
    tones_turns(tones, points, cosine, sine)
    room = np.empty((ROOM, points + 1))  # taken once: fresh memory costs more than what is done with it
    forces = measure_motion(block, points, bases, cosine, sine, harmonics, room, out)
    measure_force(block, period, points, tones, bases, cosine, sine, p, kinks, room, forces, out)


def measure_motion(
    block: Any, points: int, bases: Any, cosine: Any, sine: Any, harmonics: int, room: Any, out: Any
) -> int:
    """Measure the deflection at the samples; return the first column of the force's lock-ins."""
    modes, tones = mode_count(), cosine.shape[0]
    x, z = room[0], room[1]
    for i in range(points + 1):
        z[i] = 0.0
    for n in range(modes + 1):
        if n < modes:
            for i in range(points + 1):
                x[i] = block[i, 2 * n]
            x[0], x[points] = 0.5 * x[0], 0.5 * x[points]
            for i in range(points + 1):
                z[i] += x[i]
        for j in range(tones):
            lock_in_at(x if n < modes else z, cosine[j], sine[j], bases[j], out, FIRST + 2 * (j * (modes + 1) + n))
    # samples i and points - i go together: their sum with the cosine, difference with the sine
    half = points // 2 + 1
    even, odd, c, s = room[2, :half], room[3, :half], room[4, :half], room[5, :half]
    for i in range(half):
        even[i], odd[i] = z[i] + z[points - i], z[i] - z[points - i]
        c[i], s[i] = 1.0, 0.0
    if points % 2 == 0:
        even[half - 1] *= 0.5
    out[Z] = dot(even, c) / points
    place = FIRST + 2 * tones * (modes + 1)
    for k in range(1, harmonics + 1):
        real, imaginary = turned_sums(even, odd, cosine[0], sine[0], c, s)
        turn_c, turn_s = math.cos(k * bases[0]), math.sin(k * bases[0])
        out[place] = 2.0 * (real * turn_c - imaginary * turn_s) / points
        out[place + 1] = -2.0 * (imaginary * turn_c + real * turn_s) / points
        place += 2
    return place


@by_address("void(f8[:,::1],i8,i8,f8[:,::1],f8[::1],f8[:,::1],f8[:,::1],{p},f8[::1],f8[:,::1],i8,f8[::1])")
def measure_force(
    block: Any, period: int, points: int, tones: Any, bases: Any, cosine: Any, sine: Any, p: Any, kinks: Any, room: Any,
    forces: int, out: Any,
) -> None:  # fmt: skip
    """Measure the force and the extremes of the motion, step by step between the samples."""
    h, start = TAU / points / p[3], period * TAU / p[3]
    d, v, f = room[0], room[1], room[2]
    last = block.shape[1] - 1
    for i in range(points + 1):
        y = motion_of(block, i)
        d[i], v[i], f[i] = distance(y, p), rate_of(y, p), block[i, last]
    stage, rates = (
        np.zeros(max(memory_size(), 1)),
        np.empty((points + 1 if memory_size() else 1, max(memory_size(), 1))),
    )
    place = 2 * mode_count()
    if memory_size():
        for i in range(points + 1):
            memory = block[i, place : place + memory_size()]
            evolve(d[i], v[i], start + i * h, memory, memory, rates[i], p)
    d_middle, v_middle, middle, kind = room[3], room[4], room[5], room[6]
    sort_steps(block, h, start, d, v, f, kinks, rates, stage, p, d_middle, v_middle, middle, kind)
    sums = np.empty(SUMS)
    out[V_MAX] = extremes(h, d, v, f, sums)
    sums[SUM], sums[SUM_Z], sums[SUM_V] = flat_sums(d, v, f, d_middle, v_middle, middle, kind, p[0])
    for j in range(tones.shape[0]):
        half = 0.5 * tones[j, 0] * TAU / points
        real, imaginary = flat_lock_in(f, middle, kind, cosine[j], sine[j], math.cos(half), math.sin(half))
        add_lock_in(real, imaginary, math.cos(bases[j]), math.sin(bases[j]), points, out, forces + 2 * j)
    add_steep(
        block, h, start, d, v, kind, points, tones, bases, cosine, sine, p, rates, stage, middle, sums, forces, out
    )
    cuts, phasor = np.empty(MOST_CUTS + 1), np.empty((2, tones.shape[0]))
    for i in range(points):
        if kind[i] == CUTS:
            for j in range(tones.shape[0]):
                c, s = math.cos(bases[j]), math.sin(bases[j])
                phasor[0, j] = cosine[j, i] * c - sine[j, i] * s
                phasor[1, j] = sine[j, i] * c + cosine[j, i] * s
            t = start + i * h
            add_pieces(block, i, h, t, points, tones, phasor, p, kinks, rates, stage, cuts, sums, forces, out)
    f_max, f_min = sums[F_HIGH], sums[F_LOW]
    highest, lowest = int(sums[AT_HIGH]), int(sums[AT_LOW])
    for i in (max(highest - 1, 0), highest):
        f_max = refine(h, block, i, start + i * h, rates, stage, 1.0, f_max, p)
    for i in (max(lowest - 1, 0), lowest):
        f_min = -refine(h, block, i, start + i * h, rates, stage, -1.0, -f_min, p)
    out[F], out[F_Z], out[F_V] = sums[SUM] / points, sums[SUM_Z] / points, sums[SUM_V] / points
    out[F_MIN], out[F_MAX], out[D_MIN] = f_min, f_max, sums[D_LOW]
    out[Z_MIN], out[Z_MAX] = (sums[D_LOW] - p[0]) / p[1], (sums[D_HIGH] - p[0]) / p[1]


# what is added up step by step: force, and force times deflection and velocity; extremes, and in which steps
SUM, SUM_Z, SUM_V, F_LOW, F_HIGH, AT_LOW, AT_HIGH, D_LOW, D_HIGH, SUMS = range(10)


def extremes(h: float, d: Any, v: Any, f: Any, sums: Any) -> float:
    """Begin the sums with the extremes at the samples; return the largest speed on the interpolant."""
    low, high, at_low, at_high = f[0], f[0], 0, 0
    d_low, d_high, fast = d[0], d[0], abs(v[0])
    for i in range(d.shape[0] - 1):
        d0, v0, d1, v1 = d[i], v[i], d[i + 1], v[i + 1]
        if f[i] > high:
            high, at_high = f[i], i
        if f[i] < low:
            low, at_low = f[i], i
        d_low, d_high, fast = min(d_low, d0), max(d_high, d0), max(fast, abs(v0))
        rise = 6.0 * (d1 - d0) / h
        if (rise - 4.0 * v0 - 2.0 * v1) * (2.0 * v0 + 4.0 * v1 - rise) < 0.0:
            fast = max(fast, fastest(h, d0, v0, d1, v1))
    for k in range(SUMS):
        sums[k] = 0.0
    sums[F_LOW], sums[F_HIGH], sums[AT_LOW], sums[AT_HIGH] = low, high, at_low, at_high
    sums[D_LOW], sums[D_HIGH] = d_low, d_high
    return fast


def sort_steps(
    block: Any, h: float, start: float, d: Any, v: Any, f: Any, kinks: Any, rates: Any, stage: Any, p: Any,
    d_middle: Any, v_middle: Any, middle: Any, kind: Any,
) -> None:  # fmt: skip
    """Write distance, velocity and force in the middle of each step, and how the force is to be averaged over it."""
    points = d.shape[0] - 1
    if latch_count():  # any step may hold a switch
        for i in range(points):
            # the sums over flat steps take these times nothing, and fresh memory may hold what is no number
            kind[i], d_middle[i], v_middle[i], middle[i] = CUTS, 0.0, 0.0, 0.0
        return
    near = p[4]
    for kink in kinks:
        near = max(near, kink)
    for i in range(points):
        d0, v0, d1, v1 = d[i], v[i], d[i + 1], v[i + 1]
        fm = force_between(0.5, h, d0, v0, d1, v1, block, i, start + i * h, rates, stage, False, p)
        flat = abs(f[i] - 2.0 * fm + f[i + 1]) <= BENT * (abs(f[i]) + abs(f[i + 1]))
        outside = d0 > near and d1 > near
        whole = v0 * v1 > 0.0 and not (d0 - p[4]) * (d1 - p[4]) < 0.0
        d_middle[i], v_middle[i] = cubic(0.5, h, d0, v0, d1, v1), cubic_rate(0.5, h, d0, v0, d1, v1)
        middle[i] = fm
        kind[i] = (FLAT if flat and outside else STEEP) if whole else CUTS
    for kink in kinks:
        for i in range(points):
            kind[i] = CUTS if (d[i] - kink) * (d[i + 1] - kink) < 0.0 else kind[i]


@reordered
def flat_sums(d: Any, v: Any, f: Any, d_middle: Any, v_middle: Any, middle: Any, kind: Any, zc: float) -> Any:
    """Return the sums of the force, and of force times deflection and velocity, over the flat steps by Simpson's rule."""
    force_sum, with_z, with_v = 0.0, 0.0, 0.0
    for i in range(d.shape[0] - 1):
        flat = kind[i] == FLAT
        f0, fm, f1 = (f[i] if flat else 0.0), (4.0 * middle[i] if flat else 0.0), (f[i + 1] if flat else 0.0)
        force_sum += f0 + fm + f1
        with_z += f0 * (d[i] - zc) + fm * (d_middle[i] - zc) + f1 * (d[i + 1] - zc)
        with_v += f0 * v[i] + fm * v_middle[i] + f1 * v[i + 1]
    return force_sum / 6.0, with_z / 6.0, with_v / 6.0


@reordered
def flat_lock_in(f: Any, middle: Any, kind: Any, cosine: Any, sine: Any, c: float, s: float) -> Any:
    """Return the sums of the force times a tone's cosine and sine over the flat steps; c and s turn by half a step."""
    real, imaginary = 0.0, 0.0
    for i in range(f.shape[0] - 1):
        flat = kind[i] == FLAT
        f0, fm, f1 = (f[i] if flat else 0.0), (4.0 * middle[i] if flat else 0.0), (f[i + 1] if flat else 0.0)
        real += f0 * cosine[i] + fm * (cosine[i] * c - sine[i] * s) + f1 * cosine[i + 1]
        imaginary += f0 * sine[i] + fm * (sine[i] * c + cosine[i] * s) + f1 * sine[i + 1]
    return real / 6.0, imaginary / 6.0


def add_steep(
    block: Any, h: float, start: float, d: Any, v: Any, kind: Any, points: int, tones: Any, bases: Any, cosine: Any,
    sine: Any, p: Any, rates: Any, stage: Any, scratch: Any, sums: Any, forces: int, out: Any,
) -> None:  # fmt: skip
    """Add the steep steps by Gauss–Legendre quadrature, each node in all steps at once."""
    first, after, inside = points, 0, 0
    for i in range(points):
        if kind[i] == STEEP:
            first, after = min(first, i), i + 1
            inside += 1 if d[i] < p[4] else 0
    out[CONTACT] += inside / points
    for q in range(PLAIN if first < after else 0):
        force_sum, with_z, with_v = steep_sums(
            NODES[q], WEIGHTS[q], block, h, start, d, v, kind, first, after, p, rates, stage, scratch
        )
        sums[SUM], sums[SUM_Z], sums[SUM_V] = sums[SUM] + force_sum, sums[SUM_Z] + with_z, sums[SUM_V] + with_v
        for i in range(first, after):
            if kind[i] == STEEP:
                note_force(scratch[i] / WEIGHTS[q], i, sums)
        for j in range(tones.shape[0]):
            angle = bases[j] + tones[j, 0] * TAU / points * NODES[q]
            shares = scratch[first:after]
            real, imaginary = dot(shares, cosine[j, first:after]), dot(shares, sine[j, first:after])
            add_lock_in(real, imaginary, math.cos(angle), math.sin(angle), points, out, forces + 2 * j)


@reordered
def steep_sums(
    s: float, weight: float, block: Any, h: float, start: float, d: Any, v: Any, kind: Any, first: int, after: int,
    p: Any, rates: Any, stage: Any, scratch: Any,
) -> Any:  # fmt: skip
    """Return sums like those of `flat_sums` over one node of the steep steps; `scratch` gets what each step adds."""
    force_sum, with_z, with_v = 0.0, 0.0, 0.0
    for i in range(first, after):
        d0, v0, d1, v1 = d[i], v[i], d[i + 1], v[i + 1]
        f = force_between(s, h, d0, v0, d1, v1, block, i, start + i * h, rates, stage, False, p)
        share = weight * f if kind[i] == STEEP else 0.0
        scratch[i] = share
        force_sum += share
        with_z += share * (cubic(s, h, d0, v0, d1, v1) - p[0])
        with_v += share * cubic_rate(s, h, d0, v0, d1, v1)
    return force_sum, with_z, with_v


@inlined
def note_force(f: float, i: int, sums: Any) -> None:
    """Take a force within step i into account for the extremes."""
    if f > sums[F_HIGH]:
        sums[F_HIGH], sums[AT_HIGH] = f, i
    if f < sums[F_LOW]:
        sums[F_LOW], sums[AT_LOW] = f, i


def add_pieces(
    block: Any, i: int, h: float, t: float, points: int, tones: Any, phasor: Any, p: Any, kinks: Any, rates: Any,
    stage: Any, cuts: Any, sums: Any, forces: int, out: Any,
) -> None:  # fmt: skip
    """Add a step piece by piece; `phasor` holds the tones' cosine and sine at its start."""
    a, b = motion_of(block, i), motion_of(block, i + 1)
    d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
    top = turning(h, d0, v0, d1, v1) if v0 * v1 < 0.0 else 0.0
    turns = insert(cuts, 0, top)
    count = turns
    contact_is_kink = False
    for kink in kinks:
        count = cut_at(cuts, count, kink, top, h, d0, v0, d1, v1)
        contact_is_kink = contact_is_kink or kink == p[4]
    if not contact_is_kink:
        count = cut_at(cuts, count, p[4], top, h, d0, v0, d1, v1)
    switched = 1.0
    if latch_count():
        switched = switching_share(block, i, h, t, p)
        count = insert(cuts, count, switched)
    first, after = (PLAIN, CUT) if count > turns else (0, TURNED if turns else PLAIN)
    cuts[count] = 1.0
    d = cubic(top, h, d0, v0, d1, v1)
    sums[D_LOW], sums[D_HIGH] = min(sums[D_LOW], d), max(sums[D_HIGH], d)
    force_sum, with_z, with_v, low = 0.0, 0.0, 0.0, 0.0
    for k in range(count + 1):
        high = cuts[k]
        middle = 0.5 * (low + high)
        if cubic(middle, h, d0, v0, d1, v1) < p[4]:
            out[CONTACT] += (high - low) / points
        for q in range(first, after):
            s = low + NODES[q] * (high - low)
            f = force_between(s, h, d0, v0, d1, v1, block, i, t, rates, stage, middle > switched, p)
            note_force(f, i, sums)
            share = WEIGHTS[q] * (high - low) * f
            force_sum += share
            with_z += share * (cubic(s, h, d0, v0, d1, v1) - p[0])
            with_v += share * cubic_rate(s, h, d0, v0, d1, v1)
            for j in range(tones.shape[0]):
                c, sine = turned(phasor[0, j], phasor[1, j], tones[j, 0] * TAU / points * s)
                add_lock_in(share, 0.0, c, sine, points, out, forces + 2 * j)
        low = high
    sums[SUM], sums[SUM_Z], sums[SUM_V] = sums[SUM] + force_sum, sums[SUM_Z] + with_z, sums[SUM_V] + with_v


@inlined
def force_between(
    s: float, h: float, d0: float, v0: float, d1: float, v1: float, block: Any, i: int, t: float, rates: Any, stage: Any,
    late: bool, p: Any,
) -> float:  # fmt: skip
    """Return the force at the share s of step i; `late` takes the branches from the step's end.

    `rates` holds the rates of change of the memory at all samples, `stage` has room for the memory.
    """
    d, rate = cubic(s, h, d0, v0, d1, v1), cubic_rate(s, h, d0, v0, d1, v1)
    place = 2 * mode_count()
    size = memory_size()
    for k in range(size):
        begin, end = block[i, place + k], block[i + 1, place + k]
        stage[k] = cubic(s, h * p[3], begin, rates[i, k], end, rates[i + 1, k])
    place += size
    if latch_count():
        which = i + 1 if late else i
        return force(d, rate, t + s * h, stage, block[which, place : place + latch_count()], p)
    return force(d, rate, t + s * h, stage, stage, p)


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


def refine(h: float, block: Any, i: int, t: float, rates: Any, stage: Any, sign: float, best: float, p: Any) -> float:
    """Return the extreme of sign times the force within step i, by golden section, no worse than `best`."""
    a, b = motion_of(block, i), motion_of(block, i + 1)
    d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
    low, high, s = 0.0, 1.0, 1.0 - GOLDEN
    left, right, at_left = s, GOLDEN, sign * force_between(s, h, d0, v0, d1, v1, block, i, t, rates, stage, False, p)
    at_right = sign * force_between(right, h, d0, v0, d1, v1, block, i, t, rates, stage, False, p)
    best = max(best, at_left, at_right)
    for _ in range(7):  # to a hundredth of the step, where the force is flat to a millionth
        leftward = at_left > at_right
        low, high = (low, right) if leftward else (left, high)
        s = high - GOLDEN * (high - low) if leftward else low + GOLDEN * (high - low)
        found = sign * force_between(s, h, d0, v0, d1, v1, block, i, t, rates, stage, False, p)
        left, right = (s, left) if leftward else (right, s)
        at_left, at_right = (found, at_left) if leftward else (at_right, found)
        best = max(best, found)
    return best


def top_speed(h: float, d: Any, v: Any) -> float:
    """Return the largest speed on the interpolant of the samples."""
    fast = 0.0
    for i in range(d.shape[0] - 1):
        fast = max(fast, fastest(h, d[i], v[i], d[i + 1], v[i + 1]))
    return fast


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
