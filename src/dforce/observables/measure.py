"""All measurements over one period of the first tone, from its samples.

Deflections are summed over the samples. Forces are not smooth, so their averages are taken step by step between samples: by
Simpson's rule where the force is flat enough, else by Gauss–Legendre quadrature. Its points lie on the Hermite interpolants of
the motion (distance, velocity and acceleration at both ends) and of the forces' memory. A step is cut in pieces where the
motion turns, the force has a kink or a branch switches, see ``cuts``. The pieces also give the contact time and the extremes
between samples.

Beside the common arguments of ``cuts`` and ``integrators.loops``, `path` has distance, velocity, force and acceleration at the
samples, and the accelerations' part in the quintics of the steps, in SI units. `middle` has distance, velocity and force in the
middle of each step.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.kernel.codegen import CONTACT, FIRST_DRIVE, LENGTH, OMEGA, SPEED, ZC
from dforce.kernel.linker import by_address, inlined, reordered
from dforce.kernel.vocabulary import (
    branches_begin,
    distance,
    each_force,
    evolve,
    has_states,
    mode_count,
    motion,
    motion_of,
    motion_size,
    rate_of,
    row,
    unpacked,
)
from dforce.observables.cuts import (
    AT_HIGH,
    AT_LOW,
    D_HIGH,
    D_LOW,
    F_HIGH,
    F_LOW,
    FASTEST,
    NODES,
    PIECE,
    PLAIN,
    STEP,
    SUM,
    SUM_V,
    SUM_Z,
    SUMS,
    TOUCHED,
    WEIGHTS,
    add_pieces,
    force_at,
    refine,
    whole_piece,
)
from dforce.observables.interpolant import MOST_CUTS, bends, cubic, cubic_rate, fastest, quintic, quintic_rate, turning
from dforce.observables.lockin import TAU, add_lock_in, dot, lock_in_at, total

# columns of a row: means of the deflection, of the force, and of the force times deflection and times velocity; share of the
# time in contact; extremes; then real and imaginary parts, of the deflection for each tone of each mode and of all, and for
# each harmonic, and of the force for each tone
Z, F, F_Z, F_V, IN_CONTACT, Z_MIN, Z_MAX, F_MIN, F_MAX, D_MIN, V_MAX, FIRST = range(12)

BENT = 0.01  # relative second difference of the force over a step up to which Simpson's rule is good to a millionth
ROOM = 10  # rows of scratch, one number a sample
# how the force is averaged over a step: Simpson, Gauss–Legendre, in pieces, with the nodes for a kink as it is beside one;
# BROKEN has been cut at an event
FLAT, STEEP, CUTS, BESIDE, BROKEN = 0.0, 1.0, 2.0, 3.0, 4.0


def measure(samples: Any, turns: Any, drive: Any, kinks: Any, p: Any, room: Any, out: Any) -> None:
    """Write the averages, extremes and lock-ins of one period into `out`.

    Deflections and their lock-ins are scaled by the free amplitude; all other columns are in SI units.

    `room` is scratch, (ROOM, samples), allocated once: fresh memory costs more than the work in it.
    """
    tones, bases, _, _ = drive
    for k in range(out.shape[0]):
        out[k] = 0.0
    measure_motion(samples, turns, bases, room, out)
    measure_force(samples, (turns.cosine, turns.sine), drive, kinks, p, room, out)
    for j in range(tones.shape[0]):
        if tones[j, FIRST_DRIVE + 2 * mode_count()] != 0.0 or tones[j, FIRST_DRIVE + 2 * mode_count() + 1] != 0.0:
            deflection_extremes(samples, turns, tones, bases, room, out)
            return


def measure_motion(samples: Any, turns: Any, bases: Any, room: Any, out: Any) -> None:
    """Measure the deflection at the samples."""
    modes, tones, points = mode_count(), turns.cosine.shape[0], turns.cosine.shape[1] - 1
    x, z = room[0], room[1]
    for i in range(points + 1):
        z[i] = 0.0
    for n in range(modes + 1):
        if n < modes:
            for i in range(points + 1):
                x[i] = samples[i, 2 * n]
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


def deflection_extremes(samples: Any, turns: Any, tones: Any, bases: Any, room: Any, out: Any) -> None:
    """Write the extremes of the deflection from a moving base, after the tip's extremes."""
    points, place = turns.cosine.shape[1] - 1, FIRST_DRIVE + 2 * mode_count()
    z, v = room[0], room[1]
    for i in range(points + 1):
        z[i], v[i] = 0.0, 0.0
        for n in range(mode_count()):
            z[i] += samples[i, 2 * n]
            v[i] += samples[i, 2 * n + 1]
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


@by_address("void(f8[:,::1],UniTuple(f8[:,::1],2),Tuple((f8[:,::1],f8[::1],i8,i8)),f8[::1],{tip},f8[:,::1],f8[::1])")
def measure_force(samples: Any, waves: Any, drive: Any, kinks: Any, tip: Any, room: Any, out: Any) -> None:
    """Measure the force and the extremes of the motion, step by step between the samples.

    `waves` are cosine and sine of the tones at the samples from phase 0 on, (tones, points + 1).
    """
    (tones, bases, period, points), (cosine, sine), p = drive, waves, unpacked(tip)
    h, start = TAU / points / p[OMEGA], period * TAU / p[OMEGA]
    d, v, f = room[0], room[1], room[2]
    last = samples.shape[1] - 1
    for i in range(points + 1):
        y = motion_of(samples, i)
        d[i], v[i], f[i] = distance(y, p), rate_of(y, p), samples[i, last]
    states = branches_begin(p) - motion_size()
    stage, rates = np.zeros(states), np.empty((points + 1, states))
    if has_states():
        for i in range(points + 1 if states else 0):
            memory = samples[i, motion_size() : branches_begin(p)]
            evolve(d[i], v[i], start + i * h, memory, rates[i], p)
    path, middle, kind = (d, v, f, room[7], room[8], room[9]), (room[3], room[4], room[5]), room[6]
    record, result = (samples, h, start, rates, stage, kinks), (np.empty(SUMS), np.empty((2, PIECE)), out)
    sort_steps(path, middle, kind, record, p)
    accelerations(path, waves, record, drive, p)
    sums, tops, _ = result
    extremes(h, d, v, f, sums)
    sums[SUM], sums[SUM_Z], sums[SUM_V] = flat_sums(path, middle, kind, p[ZC])
    for j in range(tones.shape[0]):
        half = 0.5 * tones[j, 0] * TAU / points
        real, imaginary = flat_lock_in(f, middle[2], kind, cosine[j], sine[j], math.cos(half), math.sin(half))
        column = out.shape[0] - 2 * tones.shape[0] + 2 * j
        add_lock_in(real, imaginary, math.cos(bases[j]), math.sin(bases[j]), points, out, column)
    add_steep(path, kind, waves, record, drive, room[3:6], result, p)
    cuts, phasor, piece = np.empty((2, MOST_CUTS + 1)), np.empty((2, tones.shape[0])), np.empty(PIECE)
    tops[0, STEP] = tops[1, STEP] = -1.0
    for i in range(points):
        if kind[i] >= CUTS:
            for j in range(tones.shape[0]):
                c, s = math.cos(bases[j]), math.sin(bases[j])
                phasor[0, j] = cosine[j, i] * c - sine[j, i] * s
                phasor[1, j] = sine[j, i] * c + cosine[j, i] * s
            whole_piece(i, path, piece)
            events = add_pieces(piece, kind[i] == BESIDE, record, drive, phasor, cuts, result, p)
            kind[i] = BROKEN if events else CUTS
    out[F_MAX] = highest(1.0, path, kind, piece, record, result, p)
    out[F_MIN] = -highest(-1.0, path, kind, piece, record, result, p)
    out[F], out[F_Z], out[F_V] = sums[SUM] / points, sums[SUM_Z] / points, sums[SUM_V] / points
    out[IN_CONTACT], out[D_MIN], out[V_MAX] = sums[TOUCHED] / points, sums[D_LOW], sums[FASTEST]
    out[Z_MIN], out[Z_MAX] = (sums[D_LOW] - p[ZC]) / p[LENGTH], (sums[D_HIGH] - p[ZC]) / p[LENGTH]


def highest(sign: float, path: Any, kind: Any, piece: Any, record: Any, result: Any, p: Any) -> float:
    """Return the largest of sign times the force between samples: in the piece known, or in the steps beside a sample."""
    sums, tops, _ = result
    best, at, top = (sums[F_HIGH], sums[AT_HIGH], 0) if sign > 0.0 else (-sums[F_LOW], sums[AT_LOW], 1)
    if tops[top, STEP] == at:
        return refine(sign, best, tops[top], record, p)
    for i in (max(int(at) - 1, 0), int(at)):
        if kind[i] != BROKEN:
            whole_piece(i, path, piece)
            best = refine(sign, best, piece, record, p)
    return best


def accelerations(path: Any, waves: Any, record: Any, drive: Any, p: Any) -> None:
    """Write the tip's acceleration (m/s^2) at all samples, and its part in the quintics of the steps."""
    (d, v, f, a, b0, b1), (cosine, sine), (samples, h, _, _, _, _), (tones, bases, _, _) = path, waves, record, drive
    nothing = row(np.zeros((1, mode_count())), 0)
    for i in range(d.shape[0]):
        a[i] = rate_of(motion(nothing, f[i], motion_of(samples, i), p), p) * p[OMEGA]
    for j in range(tones.shape[0]):
        real, imaginary = 0.0, 0.0
        for n in range(mode_count()):
            real += tones[j, FIRST_DRIVE + n] * p[SPEED] * p[OMEGA]
            imaginary += tones[j, FIRST_DRIVE + mode_count() + n] * p[SPEED] * p[OMEGA]
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


def forces_at(s: float, first: int, d: Any, v: Any, out: Any, record: Any, p: Any) -> None:
    """Write the forces at the share s of the steps from `first` on, where distances and velocities are these."""
    _, h, start, _, _, _ = record
    if has_states():
        for i in range(out.shape[0]):
            out[i] = force_at(d[i], v[i], s, first + i, False, record, p)
    else:
        each_force(d, v, start + (first + s) * h, h, out, p)


def sort_steps(path: Any, middle: Any, kind: Any, record: Any, p: Any) -> None:
    """Write distance, velocity and force in the middle of each step, and how the force is to be averaged over it."""
    (d, v, f, _, _, _), (d_middle, v_middle, f_middle), (samples, h, _, _, _, kinks) = path, middle, record
    points = d.shape[0] - 1
    near = p[CONTACT]
    for kink in kinks:
        near = max(near, kink)
    for i in range(points):
        d_middle[i] = cubic(0.5, h, d[i], v[i], d[i + 1], v[i + 1])
        v_middle[i] = cubic_rate(0.5, h, d[i], v[i], d[i + 1], v[i + 1])
    forces_at(0.5, 0, d_middle[:points], v_middle[:points], f_middle[:points], record, p)
    for i in range(points):
        d0, v0, d1, v1, fm = d[i], v[i], d[i + 1], v[i + 1], f_middle[i]
        flat = abs(f[i] - 2.0 * fm + f[i + 1]) <= BENT * (abs(f[i]) + abs(f[i + 1]))
        outside = d0 > near and d1 > near
        whole = v0 * v1 > 0.0 and not (d0 - p[CONTACT]) * (d1 - p[CONTACT]) < 0.0
        kind[i] = (FLAT if flat and outside else STEEP) if whole else CUTS
    for k in range(branches_begin(p), samples.shape[1] - 1):
        for i in range(points):
            kind[i] = kind[i] if samples[i, k] == samples[i + 1, k] else CUTS
    mark_kinks(d, kinks, kind)


def mark_kinks(d: Any, kinks: Any, kind: Any) -> None:
    """Mark the steps that pass a kink, and the steps beside them on its near side, where a force may still be like a root."""
    last = d.shape[0] - 2
    for kink in kinks:
        for i in range(last + 1):
            if (d[i] - kink) * (d[i + 1] - kink) < 0.0:
                kind[i] = CUTS
                for k in (max(i - 1, 0), min(i + 1, last)):
                    if k != i and d[k] < kink and d[k + 1] < kink:
                        kind[k] = BESIDE


@reordered
def flat_sums(path: Any, middle: Any, kind: Any, zc: float) -> Any:
    """Return the sums of the force, and of force times deflection and velocity, over the flat steps by Simpson's rule."""
    (d, v, f, _, _, _), (d_middle, v_middle, f_middle) = path, middle
    force_sum, with_z, with_v = 0.0, 0.0, 0.0
    for i in range(d.shape[0] - 1):
        flat = kind[i] == FLAT
        f0, fm, f1 = (f[i] if flat else 0.0), (4.0 * f_middle[i] if flat else 0.0), (f[i + 1] if flat else 0.0)
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


def add_steep(path: Any, kind: Any, waves: Any, record: Any, drive: Any, scratch: Any, result: Any, p: Any) -> None:
    """Add the steep steps by Gauss–Legendre quadrature, each node in all steps at once; `scratch` has three rows."""
    (d, v, _, _, b0, b1), (cosine, sine), h, (tones, bases, _, points) = path, waves, record[1], drive
    sums, _, out = result
    first, after, inside = points, 0, 0
    for i in range(points):
        if kind[i] == STEEP:
            first, after = min(first, i), i + 1
            inside += 1 if d[i] < p[CONTACT] else 0
    sums[TOUCHED] += inside
    count = max(after - first, 0)
    kind, d, v, b0, b1 = kind[first:], d[first:], v[first:], b0[first:], b1[first:]
    here, rate, f = scratch[0, :count], scratch[1, :count], scratch[2, :count]
    for q in range(PLAIN if count else 0):
        s, weight = NODES[q], WEIGHTS[q]
        for i in range(count):
            here[i] = quintic(s, h, d[i], v[i], d[i + 1], v[i + 1], b0[i], b1[i])
            rate[i] = quintic_rate(s, h, d[i], v[i], d[i + 1], v[i + 1], b0[i], b1[i])
        forces_at(s, first, here, rate, f, record, p)
        for i in range(count):
            if kind[i] == STEEP:
                note_force(f[i], first + i, sums)
            else:
                f[i] = 0.0
        force_sum, with_z, with_v = steep_sums(here, rate, f, p[ZC])
        sums[SUM] += weight * force_sum
        sums[SUM_Z] += weight * with_z
        sums[SUM_V] += weight * with_v
        for j in range(tones.shape[0]):
            angle, column = bases[j] + tones[j, 0] * TAU / points * s, out.shape[0] - 2 * tones.shape[0] + 2 * j
            real = weight * dot(f, cosine[j, first:after])
            imaginary = weight * dot(f, sine[j, first:after])
            add_lock_in(real, imaginary, math.cos(angle), math.sin(angle), points, out, column)


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
