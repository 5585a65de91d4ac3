"""Everything that is measured over one period of the first tone, from its samples.

Deflections are summed over the samples. Forces are not smooth, so their averages are taken step by step between samples:
by Simpson's rule where the force is flat enough, else by Gauss–Legendre quadrature on the Hermite interpolant of the motion,
through distance, velocity and acceleration at both ends, and of the forces' memory. Where the motion turns, the force has a
kink or a branch switches, a step is cut in pieces, see ``cuts``; these give the contact time and the extremes between
samples, too.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.kernel.codegen import FIRST_DRIVE
from dforce.kernel.linker import by_address, inlined, reordered
from dforce.kernel.vocabulary import (
    distance,
    each_force,
    evolve,
    latch_count,
    memory_size,
    mode_count,
    motion,
    motion_of,
    motion_size,
    rate_of,
    row,
)
from dforce.observables.cuts import (
    A0,
    A1,
    AT_HIGH,
    AT_LOW,
    BEGIN,
    D0,
    D1,
    D_HIGH,
    D_LOW,
    END,
    F_HIGH,
    F_LOW,
    FASTEST,
    FROM,
    LATE,
    NODES,
    PIECE,
    PLAIN,
    STEP,
    SUM,
    SUM_V,
    SUM_Z,
    SUMS,
    TO,
    TOUCHED,
    V0,
    V1,
    WEIGHTS,
    add_pieces,
    force_at,
    refine,
)
from dforce.observables.interpolant import MOST_CUTS, bends, cubic, cubic_rate, fastest, quintic, quintic_rate, turning
from dforce.observables.lockin import TAU, add_lock_in, dot, lock_in_at, total

# columns of the result, then 2 per tone and mode, 2 per tone (total), 2 per harmonic, 2 per tone (force)
Z, F, F_Z, F_V, CONTACT, Z_MIN, Z_MAX, F_MIN, F_MAX, D_MIN, V_MAX, FIRST = range(12)

BENT = 0.01  # relative second difference of the force over a step up to which Simpson's rule is good to a millionth
ROOM = 10  # rows of scratch, one number a sample
# how the force is averaged over a step: Simpson, Gauss–Legendre, in pieces, with the nodes for a kink as it is beside one;
# BROKEN has been cut at an event
FLAT, STEEP, CUTS, BESIDE, BROKEN = 0.0, 1.0, 2.0, 3.0, 4.0


def measure(block: Any, period: int, turns: Any, tones: Any, bases: Any, p: Any, kinks: Any, out: Any) -> None:
    """Write the averages, extremes and lock-ins of one period into `out`; lengths are scaled, forces and times SI."""
    measure_in(block, period, turns, tones, bases, p, kinks, np.empty((ROOM, turns.cosine.shape[1])), out)


def measure_in(
    block: Any, period: int, turns: Any, tones: Any, bases: Any, p: Any, kinks: Any, room: Any, out: Any
) -> None:
    """Do so in a room (ROOM, samples), taken once: fresh memory costs more than what is done with it."""
    for k in range(out.shape[0]):
        out[k] = 0.0
    points = turns.cosine.shape[1] - 1
    forces = measure_motion(block, turns, bases, room, out)
    measure_force(block, period, points, tones, bases, turns.cosine, turns.sine, p, kinks, room, forces, out)
    for j in range(tones.shape[0]):
        if tones[j, FIRST_DRIVE + 2 * mode_count()] != 0.0 or tones[j, FIRST_DRIVE + 2 * mode_count() + 1] != 0.0:
            deflection_extremes(block, turns, tones, bases, room, out)
            return


def measure_motion(block: Any, turns: Any, bases: Any, room: Any, out: Any) -> int:
    """Measure the deflection at the samples; return the first column of the force's lock-ins."""
    modes, tones, points = mode_count(), turns.cosine.shape[0], turns.cosine.shape[1] - 1
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
            signal, place = x if n < modes else z, FIRST + 2 * (j * (modes + 1) + n)
            lock_in_at(signal, turns.cosine[j], turns.sine[j], bases[j], out, place)
    # samples i and points - i go together: their sum with the cosine, difference with the sine
    half = points // 2 + 1
    even, odd = room[2, :half], room[3, :half]
    for i in range(half):
        even[i], odd[i] = z[i] + z[points - i], z[i] - z[points - i]
    if points % 2 == 0:
        even[half - 1] *= 0.5
    out[Z] = total(even) / points
    place = FIRST + 2 * tones * (modes + 1)
    for k in range(turns.harmonic_cosine.shape[0]):
        real, imaginary = dot(even, turns.harmonic_cosine[k]), dot(odd, turns.harmonic_sine[k])
        turn_c, turn_s = math.cos((k + 1) * bases[0]), math.sin((k + 1) * bases[0])
        out[place] = 2.0 * (real * turn_c - imaginary * turn_s) / points
        out[place + 1] = -2.0 * (imaginary * turn_c + real * turn_s) / points
        place += 2
    return place


def deflection_extremes(block: Any, turns: Any, tones: Any, bases: Any, room: Any, out: Any) -> None:
    """Write the extremes of the deflection from a base that moves; those of the tip are known then."""
    points, place = turns.cosine.shape[1] - 1, FIRST_DRIVE + 2 * mode_count()
    z, v = room[0], room[1]
    for i in range(points + 1):
        z[i], v[i] = 0.0, 0.0
        for n in range(mode_count()):
            z[i] += block[i, 2 * n]
            v[i] += block[i, 2 * n + 1]
    for j in range(tones.shape[0]):
        c, s = math.cos(bases[j]), math.sin(bases[j])
        real, imaginary = tones[j, place] * c - tones[j, place + 1] * s, tones[j, place] * s + tones[j, place + 1] * c
        for i in range(points + 1):
            z[i] -= real * turns.cosine[j, i] - imaginary * turns.sine[j, i]
            v[i] += tones[j, 0] * (real * turns.sine[j, i] + imaginary * turns.cosine[j, i])
    low, high, h = z[0], z[0], TAU / points
    for i in range(points):
        low, high = min(low, z[i + 1]), max(high, z[i + 1])
        if v[i] * v[i + 1] < 0.0:
            top = cubic(turning(h, z[i], v[i], z[i + 1], v[i + 1]), h, z[i], v[i], z[i + 1], v[i + 1])
            low, high = min(low, top), max(high, top)
    out[Z_MIN], out[Z_MAX] = low, high


@by_address("void(f8[:,::1],i8,i8,f8[:,::1],f8[::1],f8[:,::1],f8[:,::1],{p},f8[::1],f8[:,::1],i8,f8[::1])")
def measure_force(
    block: Any,
    period: int,
    points: int,
    tones: Any,
    bases: Any,
    cosine: Any,
    sine: Any,
    p: Any,
    kinks: Any,
    room: Any,
    forces: int,
    out: Any,
) -> None:
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
    place = motion_size()
    if memory_size():
        for i in range(points + 1):
            memory = block[i, place : place + memory_size()]
            evolve(d[i], v[i], start + i * h, memory, memory, rates[i], p)
    d_middle, v_middle, middle, kind, a, b0, b1 = room[3], room[4], room[5], room[6], room[7], room[8], room[9]
    sort_steps(block, h, start, d, v, f, kinks, rates, stage, p, d_middle, v_middle, middle, kind)
    accelerations(block, h, d, v, f, tones, bases, cosine, sine, p, a, b0, b1)
    sums = np.empty(SUMS)
    extremes(h, d, v, f, sums)
    sums[SUM], sums[SUM_Z], sums[SUM_V] = flat_sums(d, v, f, d_middle, v_middle, middle, kind, p[0])
    for j in range(tones.shape[0]):
        half = 0.5 * tones[j, 0] * TAU / points
        real, imaginary = flat_lock_in(f, middle, kind, cosine[j], sine[j], math.cos(half), math.sin(half))
        add_lock_in(real, imaginary, math.cos(bases[j]), math.sin(bases[j]), points, out, forces + 2 * j)
    add_steep(
        block, h, start, d, v, b0, b1, kind, points, tones, bases, cosine, sine, p, rates, stage, room[3:6], sums,
        forces, out,
    )  # fmt: skip
    cuts, phasor, piece, tops = (
        np.empty((2, MOST_CUTS + 1)),
        np.empty((2, tones.shape[0])),
        np.empty(PIECE),
        np.empty((2, PIECE)),
    )
    tops[0, STEP] = tops[1, STEP] = -1.0
    for i in range(points):
        if kind[i] >= CUTS:
            for j in range(tones.shape[0]):
                c, s = math.cos(bases[j]), math.sin(bases[j])
                phasor[0, j] = cosine[j, i] * c - sine[j, i] * s
                phasor[1, j] = sine[j, i] * c + cosine[j, i] * s
            t = start + i * h
            events = add_pieces(
                block, i, h, t, points, tones, bases, phasor, p, kinks, rates, stage, a[i], a[i + 1],
                kind[i] == BESIDE, cuts, piece, tops, sums, forces, out,
            )  # fmt: skip
            kind[i] = BROKEN if events else CUTS
    # peak force, and the lowest force
    out[F_MAX] = highest(
        block, h, start, d, v, a, kind, rates, stage, 1.0, sums[F_HIGH], int(sums[AT_HIGH]), tops[0], piece, p
    )
    out[F_MIN] = -highest(
        block, h, start, d, v, a, kind, rates, stage, -1.0, -sums[F_LOW], int(sums[AT_LOW]), tops[1], piece, p
    )
    out[F], out[F_Z], out[F_V] = sums[SUM] / points, sums[SUM_Z] / points, sums[SUM_V] / points
    out[CONTACT], out[D_MIN], out[V_MAX] = sums[TOUCHED] / points, sums[D_LOW], sums[FASTEST]
    out[Z_MIN], out[Z_MAX] = (sums[D_LOW] - p[0]) / p[1], (sums[D_HIGH] - p[0]) / p[1]


def highest(
    block: Any,
    h: float,
    start: float,
    d: Any,
    v: Any,
    a: Any,
    kind: Any,
    rates: Any,
    stage: Any,
    sign: float,
    best: float,
    at: int,
    top: Any,
    piece: Any,
    p: Any,
) -> float:
    """Return the largest of sign times the force between samples: in the piece `top`, or in the steps beside a sample."""
    if top[STEP] == at:
        return refine(block, h, start + at * h, rates, stage, sign, best, top, p)
    for i in (max(at - 1, 0), at):
        if kind[i] != BROKEN:
            piece[FROM], piece[TO], piece[BEGIN], piece[END], piece[LATE], piece[STEP] = 0.0, 1.0, 0.0, 1.0, 0.0, i
            piece[D0], piece[V0], piece[A0], piece[D1], piece[V1], piece[A1] = (
                d[i],
                v[i],
                a[i],
                d[i + 1],
                v[i + 1],
                a[i + 1],
            )
            best = refine(block, h, start + i * h, rates, stage, sign, best, piece, p)
    return best


def accelerations(
    block: Any,
    h: float,
    d: Any,
    v: Any,
    f: Any,
    tones: Any,
    bases: Any,
    cosine: Any,
    sine: Any,
    p: Any,
    a: Any,
    b0: Any,
    b1: Any,
) -> None:
    """Write the tip's acceleration (m/s^2) at all samples, and what it adds to the cubics of the steps."""
    nothing = row(np.zeros((1, mode_count())), 0)
    for i in range(d.shape[0]):
        a[i] = rate_of(motion(nothing, f[i], motion_of(block, i), p), p) * p[3]
    for j in range(tones.shape[0]):
        real, imaginary = 0.0, 0.0
        for n in range(mode_count()):
            real += tones[j, FIRST_DRIVE + n] * p[2] * p[3]
            imaginary += tones[j, FIRST_DRIVE + mode_count() + n] * p[2] * p[3]
        c, s = math.cos(bases[j]), math.sin(bases[j])
        with_cosine, with_sine = real * c - imaginary * s, real * s + imaginary * c
        for i in range(d.shape[0]):
            a[i] += cosine[j, i] * with_cosine - sine[j, i] * with_sine
    for i in range(d.shape[0] - 1):
        b0[i], b1[i] = bends(h, d[i], v[i], a[i], d[i + 1], v[i + 1], a[i + 1])


def extremes(h: float, d: Any, v: Any, f: Any, sums: Any) -> None:
    """Begin the sums with the extremes at the samples, and the largest speed between samples, too."""
    low, high, at_low, at_high = f[0], f[0], 0, 0
    d_low, d_high, fast = d[0], d[0], abs(v[0])
    for i in range(d.shape[0] - 1):
        if f[i] > high:
            high, at_high = f[i], i
        if f[i] < low:
            low, at_low = f[i], i
        d_low, d_high, fast = min(d_low, d[i]), max(d_high, d[i]), max(fast, abs(v[i]))
        rise = 6.0 * (d[i + 1] - d[i]) / h
        if (rise - 4.0 * v[i] - 2.0 * v[i + 1]) * (2.0 * v[i] + 4.0 * v[i + 1] - rise) < 0.0:
            fast = max(fast, fastest(h, d[i], v[i], d[i + 1], v[i + 1]))
    for k in range(SUMS):
        sums[k] = 0.0
    sums[F_LOW], sums[F_HIGH], sums[AT_LOW], sums[AT_HIGH] = low, high, at_low, at_high
    sums[D_LOW], sums[D_HIGH], sums[FASTEST] = d_low, d_high, fast


def forces_at(
    s: float, first: int, block: Any, h: float, start: float, d: Any, v: Any, rates: Any, stage: Any, p: Any, out: Any
) -> None:
    """Write the forces at the share s of the steps from `first` on, where distances and velocities are these."""
    if memory_size() or latch_count():
        for i in range(out.shape[0]):
            at = first + i
            out[i] = force_at(d[i], v[i], s, block, at, start + at * h, h, rates, stage, False, p)
    else:
        each_force(d, v, start + (first + s) * h, h, out, p)


def sort_steps(
    block: Any,
    h: float,
    start: float,
    d: Any,
    v: Any,
    f: Any,
    kinks: Any,
    rates: Any,
    stage: Any,
    p: Any,
    d_middle: Any,
    v_middle: Any,
    middle: Any,
    kind: Any,
) -> None:
    """Write distance, velocity and force in the middle of each step, and how the force is to be averaged over it."""
    points = d.shape[0] - 1
    near = p[4]
    for kink in kinks:
        near = max(near, kink)
    for i in range(points):
        d_middle[i] = cubic(0.5, h, d[i], v[i], d[i + 1], v[i + 1])
        v_middle[i] = cubic_rate(0.5, h, d[i], v[i], d[i + 1], v[i + 1])
    forces_at(0.5, 0, block, h, start, d_middle[:points], v_middle[:points], rates, stage, p, middle[:points])
    for i in range(points):
        d0, v0, d1, v1, fm = d[i], v[i], d[i + 1], v[i + 1], middle[i]
        flat = abs(f[i] - 2.0 * fm + f[i + 1]) <= BENT * (abs(f[i]) + abs(f[i + 1]))
        outside = d0 > near and d1 > near
        whole = v0 * v1 > 0.0 and not (d0 - p[4]) * (d1 - p[4]) < 0.0
        kind[i] = (FLAT if flat and outside else STEEP) if whole else CUTS
    for k in range(block.shape[1] - 1 - latch_count(), block.shape[1] - 1):
        for i in range(points):
            kind[i] = kind[i] if block[i, k] == block[i + 1, k] else CUTS
    mark_kinks(d, kinks, kind)


def mark_kinks(d: Any, kinks: Any, kind: Any) -> None:
    """Mark the steps that pass a kink, and those beside them on its near side, where a force may still be like a root."""
    last = d.shape[0] - 2
    for kink in kinks:
        for i in range(last + 1):
            if (d[i] - kink) * (d[i + 1] - kink) < 0.0:
                kind[i] = CUTS
                for k in (max(i - 1, 0), min(i + 1, last)):
                    if k != i and d[k] < kink and d[k + 1] < kink:
                        kind[k] = BESIDE


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
    block: Any,
    h: float,
    start: float,
    d: Any,
    v: Any,
    b0: Any,
    b1: Any,
    kind: Any,
    points: int,
    tones: Any,
    bases: Any,
    cosine: Any,
    sine: Any,
    p: Any,
    rates: Any,
    stage: Any,
    scratch: Any,
    sums: Any,
    forces: int,
    out: Any,
) -> None:
    """Add the steep steps by Gauss–Legendre quadrature, each node in all steps at once; `scratch` has three rows."""
    first, after, inside = points, 0, 0
    for i in range(points):
        if kind[i] == STEEP:
            first, after = min(first, i), i + 1
            inside += 1 if d[i] < p[4] else 0
    sums[TOUCHED] += inside
    count = max(after - first, 0)
    kind, d, v, b0, b1 = kind[first:], d[first:], v[first:], b0[first:], b1[first:]
    here, rate, f = scratch[0, :count], scratch[1, :count], scratch[2, :count]
    for q in range(PLAIN if count else 0):
        s, weight = NODES[q], WEIGHTS[q]
        for i in range(count):
            here[i] = quintic(s, h, d[i], v[i], d[i + 1], v[i + 1], b0[i], b1[i])
            rate[i] = quintic_rate(s, h, d[i], v[i], d[i + 1], v[i + 1], b0[i], b1[i])
        forces_at(s, first, block, h, start, here, rate, rates, stage, p, f)
        for i in range(count):
            if kind[i] == STEEP:
                note_force(f[i], first + i, sums)
            else:
                f[i] = 0.0
        force_sum, with_z, with_v = steep_sums(here, rate, f, p[0])
        sums[SUM] += weight * force_sum
        sums[SUM_Z] += weight * with_z
        sums[SUM_V] += weight * with_v
        for j in range(tones.shape[0]):
            angle = bases[j] + tones[j, 0] * TAU / points * s
            real = weight * dot(f, cosine[j, first:after])
            imaginary = weight * dot(f, sine[j, first:after])
            add_lock_in(real, imaginary, math.cos(angle), math.sin(angle), points, out, forces + 2 * j)


@reordered
def steep_sums(d: Any, v: Any, f: Any, zc: float) -> Any:
    """Return the sums of forces, and of forces times deflection and velocity."""
    force_sum, with_z, with_v = 0.0, 0.0, 0.0
    for i in range(f.shape[0]):
        force_sum += f[i]
        with_z += f[i] * (d[i] - zc)
        with_v += f[i] * v[i]
    return force_sum, with_z, with_v


@inlined
def note_force(f: float, i: int, sums: Any) -> None:
    """Take a force within step i into account for the extremes."""
    if f > sums[F_HIGH]:
        sums[F_HIGH], sums[AT_HIGH] = f, i
    if f < sums[F_LOW]:
        sums[F_LOW], sums[AT_LOW] = f, i
