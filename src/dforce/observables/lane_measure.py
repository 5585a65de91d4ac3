"""Everything that is measured over one period, of many motions side by side.

The same quantities by the same rules as ``measure``, for problems with one tone and forces without memory and branches.
Steps without a cut are measured in all lanes at once, the others lane by lane.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.kernel.link import inlined
from dforce.kernel.slots import column, distance, force, mode_count, parameters_of, rate_of
from dforce.observables.lockin import TAU
from dforce.observables.measure import (
    AT_HIGH,
    AT_LOW,
    BENT,
    CONTACT,
    D_HIGH,
    D_LOW,
    D_MIN,
    F_HIGH,
    F_LOW,
    F_MAX,
    F_MIN,
    F_V,
    F_Z,
    FIRST,
    GOLDEN,
    NODES,
    PLAIN,
    SUM,
    SUM_V,
    SUM_Z,
    SUMS,
    V_MAX,
    WEIGHTS,
    Z_MAX,
    Z_MIN,
    F,
    Z,
    clear,
    measure_pieces,
)
from dforce.observables.pieces import MOST_CUTS, fastest

# rows of the sums: force, force times deflection and velocity, its lock-in, contact; extremes and the steps they are in
S_F, S_FZ, S_FV, S_RE, S_IM, S_CONTACT, LOW, HIGH, LOW_AT, HIGH_AT, D_FIRST, D_LAST, FAST, ROWS = range(14)


@inlined
def between(s: float, h: float, x0: float, v0: float, x1: float, v1: float) -> float:
    """Return the Hermite interpolant at the share s of a step."""
    r = 1.0 - s
    return r * r * ((1.0 + 2.0 * s) * x0 + s * h * v0) + s * s * ((1.0 + 2.0 * r) * x1 - r * h * v1)


@inlined
def rate_between(s: float, inverse: float, x0: float, v0: float, x1: float, v1: float) -> float:
    """Return the slope of the Hermite interpolant at the share s of a step; `inverse` is one over its length."""
    r = 1.0 - s
    return 6.0 * s * r * (x1 - x0) * inverse + r * (r - 2.0 * s) * v0 + s * (s - 2.0 * r) * v1


def measure_cases(
    block: Any, parameters: Any, kinks: Any, tones: Any, case_of: Any, bases: Any, points: int, harmonics: int,
    work: Any, out: Any,
) -> None:  # fmt: skip
    """Write what is measured over the period that a block holds into `out`, one row a lane; see ``advance_samples``."""
    out[:, :] = 0.0
    size, place = block.shape[2], 2 * mode_count()
    forces = measure_motions(block, points, bases[0], harmonics, out)
    acc, kind = np.zeros((ROWS, size)), np.empty(size, np.int64)
    near, steps, phasors = np.empty(size), np.empty((2, size)), np.empty((2, 1))
    sums, cuts, pair = np.empty((size, SUMS)), np.empty(MOST_CUTS + 1), np.empty((2, place + 1))
    for j in range(size):
        clear(sums[j])
        steps[0, j] = TAU / points / parameters[3, j]  # in seconds, and the inverse
        steps[1, j] = 1.0 / steps[0, j]
        near[j] = parameters[4, j]
        for k in range(kinks.shape[0]):
            near[j] = max(near[j], kinks[k, j])
        acc[LOW, j], acc[HIGH, j], acc[D_FIRST, j], acc[D_LAST, j] = np.inf, -np.inf, np.inf, -np.inf
    for i in range(points):
        here, there = block[i], block[i + 1]
        angle = bases[0] + TAU / points * i
        phasors[0, 0], phasors[1, 0] = math.cos(angle), math.sin(angle)
        extremes(here, there, parameters, steps, i, acc, kind)
        if smooth_steps(here, there, parameters, near, steps, points, angle, acc, kind):
            if whole_steps(here, there, parameters, kinks, kind):
                plain_steps(here, there, parameters, steps, points, angle, i, acc, kind)
            for j in range(size):
                if kind[j] == 2:
                    p = parameters_of(parameters, j)
                    copy_pair(here, there, j, pair)
                    measure_pieces(
                        pair, 0, i, steps[0, j], 0.0, points, tones[case_of[j]], phasors, p, kinks[:, j], work[0], cuts,
                        sums[j], forces, out[j],
                    )  # fmt: skip
    where = np.empty((2, size), np.int64)
    for j in range(size):
        p = parameters_of(parameters, j)
        finish_lane(p, points, forces, acc[:, j], sums[j], out[j])
        high, low = acc[HIGH, j] >= sums[j, F_HIGH], acc[LOW, j] <= sums[j, F_LOW]
        where[0, j] = int(acc[HIGH_AT, j] if high else sums[j, AT_HIGH])
        where[1, j] = int(acc[LOW_AT, j] if low else sums[j, AT_LOW])
        acc[HIGH, j] = max(acc[HIGH, j], sums[j, F_HIGH])
        acc[LOW, j] = -min(acc[LOW, j], sums[j, F_LOW])
    before = np.maximum(where - 1, 0)
    for which in (before, where):
        refine_lanes(block, parameters, steps, 1.0, which[0], acc[HIGH])
        refine_lanes(block, parameters, steps, -1.0, which[1], acc[LOW])
    for j in range(size):
        out[j, F_MAX], out[j, F_MIN] = acc[HIGH, j], -acc[LOW, j]


def measure_motions(block: Any, points: int, base: float, harmonics: int, out: Any) -> int:
    """Measure the deflections at the samples; return the first column of the force's lock-ins."""
    modes, size = mode_count(), block.shape[2]
    cosine, sine = np.empty(points), np.empty(points)
    for i in range(points):
        cosine[i], sine[i] = math.cos(TAU / points * i), math.sin(TAU / points * i)
    acc = np.zeros((2 * (modes + harmonics) + 1, size))
    even, odd = np.empty((modes + 1, size)), np.empty((modes + 1, size))
    for i in range((points - 1) // 2 + 1):  # samples i and points - i: sum with the cosine, difference with the sine
        fold(block, i, points, even, odd)
        add_folded(even, odd, cosine, sine, i, points, harmonics, acc)
    if points % 2 == 0:
        fold(block, points // 2, points, even, odd)
        even *= 0.5
        odd[:, :] = 0.0
        add_folded(even, odd, cosine, sine, points // 2, points, harmonics, acc)
    c, s = math.cos(base), math.sin(base)
    for j in range(size):
        for n in range(modes):
            real, imaginary = acc[2 * n, j], acc[2 * n + 1, j]
            out[j, FIRST + 2 * n] = 2.0 * (real * c + imaginary * s) / points
            out[j, FIRST + 2 * n + 1] = 2.0 * (imaginary * c - real * s) / points
            out[j, FIRST + 2 * modes] += out[j, FIRST + 2 * n]
            out[j, FIRST + 2 * modes + 1] += out[j, FIRST + 2 * n + 1]
        out[j, Z] = acc[2 * (modes + harmonics), j] / points
    place = FIRST + 2 * modes + 2
    for k in range(harmonics):
        ck, sk = math.cos((k + 1) * base), math.sin((k + 1) * base)
        for j in range(size):
            real, imaginary = acc[2 * (modes + k), j], acc[2 * (modes + k) + 1, j]
            out[j, place] = 2.0 * (real * ck + imaginary * sk) / points
            out[j, place + 1] = 2.0 * (imaginary * ck - real * sk) / points
        place += 2
    return place


def fold(block: Any, i: int, points: int, even: Any, odd: Any) -> None:
    """Write the sum and difference of the deflections at samples i and points - i: of each mode, and in all."""
    modes = mode_count()
    one, other = block[i], block[points - i]
    weight = 0.5 if i == 0 else 1.0
    for j in range(even.shape[1]):
        even[modes, j], odd[modes, j] = 0.0, 0.0
    for n in range(modes):
        for j in range(even.shape[1]):
            even[n, j] = weight * (one[2 * n, j] + other[2 * n, j])
            odd[n, j] = weight * (one[2 * n, j] - other[2 * n, j])
            even[modes, j] += even[n, j]
            odd[modes, j] += odd[n, j]


def add_folded(even: Any, odd: Any, cosine: Any, sine: Any, i: int, points: int, harmonics: int, acc: Any) -> None:
    """Add two samples to the lock-ins of the modes at the drive and of the whole at all harmonics."""
    modes, size = mode_count(), even.shape[1]
    for n in range(modes):
        add_product(even, odd, n, cosine[i], sine[i], acc, 2 * n)
    for k in range(harmonics):
        turn = (k + 1) * i % points
        add_product(even, odd, modes, cosine[turn], sine[turn], acc, 2 * (modes + k))
    for j in range(size):
        acc[2 * (modes + harmonics), j] += even[modes, j]


@inlined
def add_product(even: Any, odd: Any, n: int, c: float, s: float, acc: Any, place: int) -> None:
    """Add one product of each to a lock-in."""
    for j in range(even.shape[1]):
        acc[place, j] += c * even[n, j]
        acc[place + 1, j] -= s * odd[n, j]


def extremes(here: Any, there: Any, parameters: Any, steps: Any, i: int, acc: Any, kind: Any) -> None:
    """Take the extremes at sample i, and the largest speed in the step from it; `kind` is scratch."""
    place = 2 * mode_count()
    at = float(i)
    for j in range(here.shape[1]):
        p = parameters_of(parameters, j)
        inverse = steps[1, j]
        a, b = column(here, j), column(there, j)
        d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
        f = here[place, j]
        acc[HIGH_AT, j] = at if f > acc[HIGH, j] else acc[HIGH_AT, j]
        acc[HIGH, j] = f if f > acc[HIGH, j] else acc[HIGH, j]
        acc[LOW_AT, j] = at if f < acc[LOW, j] else acc[LOW_AT, j]
        acc[LOW, j] = f if f < acc[LOW, j] else acc[LOW, j]
        acc[D_FIRST, j] = d0 if d0 < acc[D_FIRST, j] else acc[D_FIRST, j]
        acc[D_LAST, j] = d0 if d0 > acc[D_LAST, j] else acc[D_LAST, j]
        acc[FAST, j] = abs(v0) if abs(v0) > acc[FAST, j] else acc[FAST, j]
        rise = 6.0 * (d1 - d0) * inverse
        first, last = rise - 4.0 * v0 - 2.0 * v1, 2.0 * v0 + 4.0 * v1 - rise
        kind[j] = 1 if first * last < 0.0 else 0
    found = 0
    for j in range(here.shape[1]):
        found |= kind[j]
    if found:
        for j in range(here.shape[1]):
            if kind[j]:  # the acceleration changes its sign: the speed has a peak between the samples
                p = parameters_of(parameters, j)
                a, b = column(here, j), column(there, j)
                speed = fastest(steps[0, j], distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p))
                acc[FAST, j] = max(acc[FAST, j], speed)


def smooth_steps(
    here: Any, there: Any, parameters: Any, near: Any, steps: Any, points: int, angle: float, acc: Any, kind: Any
) -> int:
    """Measure the lanes whose step lies outside all kinks by Simpson's rule; return whether there are others.

    `kind` gets 0 for a lane that is done, else 1.
    """
    place = 2 * mode_count()
    turn = TAU / points
    c0, s0 = math.cos(angle), math.sin(angle)
    cm, sm = math.cos(angle + 0.5 * turn), math.sin(angle + 0.5 * turn)
    c1, s1 = math.cos(angle + turn), math.sin(angle + turn)
    for j in range(here.shape[1]):
        p = parameters_of(parameters, j)
        h, inverse = steps[0, j], steps[1, j]
        a, b = column(here, j), column(there, j)
        d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
        dm, vm = between(0.5, h, d0, v0, d1, v1), rate_between(0.5, inverse, d0, v0, d1, v1)
        f0, f1 = here[place, j], there[place, j]
        fm = force(dm, vm, 0.0, None, None, p)
        nearest = d0 if d0 < d1 else d1
        bent = abs(f0 - 2.0 * fm + f1) - BENT * (abs(f0) + abs(f1))
        smooth = 1 if v0 * v1 > 0.0 else 0
        smooth &= 1 if nearest > near[j] else 0
        smooth &= 1 if bent <= 0.0 else 0
        kind[j] = 1 - smooth
        weight = 1.0 / (6.0 * points) if smooth else 0.0
        middle = 4.0 * fm
        acc[S_F, j] += weight * (f0 + middle + f1)
        acc[S_FZ, j] += weight * (f0 * (d0 - p[0]) + middle * (dm - p[0]) + f1 * (d1 - p[0]))
        acc[S_FV, j] += weight * (f0 * v0 + middle * vm + f1 * v1)
        acc[S_RE, j] += 2.0 * weight * (f0 * c0 + middle * cm + f1 * c1)
        acc[S_IM, j] -= 2.0 * weight * (f0 * s0 + middle * sm + f1 * s1)
    left = 0
    for j in range(here.shape[1]):
        left |= kind[j]
    return left


def whole_steps(here: Any, there: Any, parameters: Any, kinks: Any, kind: Any) -> int:
    """Give the kind 2 to lanes of kind 1 whose step must be cut; return whether there are others of kind 1."""
    for j in range(here.shape[1]):
        p = parameters_of(parameters, j)
        a, b = column(here, j), column(there, j)
        cut = 1 if rate_of(a, p) * rate_of(b, p) <= 0.0 else 0
        cut |= 1 if (distance(a, p) - p[4]) * (distance(b, p) - p[4]) < 0.0 else 0
        kind[j] += kind[j] & cut
    for k in range(kinks.shape[0]):
        for j in range(here.shape[1]):
            p = parameters_of(parameters, j)
            d0, d1 = distance(column(here, j), p), distance(column(there, j), p)
            cut = 1 if (d0 - kinks[k, j]) * (d1 - kinks[k, j]) < 0.0 else 0
            kind[j] += kind[j] & cut  # of kind 2 the lowest bit is clear
    whole = 0
    for j in range(here.shape[1]):
        whole |= kind[j] & 1
    return whole


def plain_steps(
    here: Any, there: Any, parameters: Any, steps: Any, points: int, angle: float, i: int, acc: Any, kind: Any
) -> None:
    """Measure the lanes of kind 1 by Gauss–Legendre quadrature over the whole step."""
    at = float(i)
    for q in range(PLAIN):
        s, share = NODES[q], WEIGHTS[q]
        c, sine = math.cos(angle + s * TAU / points), math.sin(angle + s * TAU / points)
        for j in range(here.shape[1]):
            p = parameters_of(parameters, j)
            h, inverse = steps[0, j], steps[1, j]
            a, b = column(here, j), column(there, j)
            d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
            d, v = between(s, h, d0, v0, d1, v1), rate_between(s, inverse, d0, v0, d1, v1)
            f = force(d, v, 0.0, None, None, p)
            chosen = kind[j] == 1
            weighted = share / points * f if chosen else 0.0
            acc[S_F, j] += weighted
            acc[S_FZ, j] += weighted * (d - p[0])
            acc[S_FV, j] += weighted * v
            acc[S_RE, j] += 2.0 * weighted * c
            acc[S_IM, j] -= 2.0 * weighted * sine
            high = f if chosen else -np.inf
            low = f if chosen else np.inf
            acc[HIGH_AT, j] = at if high > acc[HIGH, j] else acc[HIGH_AT, j]
            acc[HIGH, j] = high if high > acc[HIGH, j] else acc[HIGH, j]
            acc[LOW_AT, j] = at if low < acc[LOW, j] else acc[LOW_AT, j]
            acc[LOW, j] = low if low < acc[LOW, j] else acc[LOW, j]
    for j in range(here.shape[1]):
        p = parameters_of(parameters, j)
        inside = 1.0 / points if distance(column(here, j), p) < p[4] else 0.0
        acc[S_CONTACT, j] += inside if kind[j] == 1 else 0.0


def copy_pair(here: Any, there: Any, j: int, pair: Any) -> None:
    """Copy two samples of one lane into a block of their own."""
    for k in range(pair.shape[1]):
        pair[0, k], pair[1, k] = here[k, j], there[k, j]


def finish_lane(p: Any, points: int, forces: int, acc: Any, sums: Any, out: Any) -> None:
    """Put together what the steps of one lane gave."""
    out[F] = acc[S_F] + sums[SUM] / points
    out[F_Z] = acc[S_FZ] + sums[SUM_Z] / points
    out[F_V] = acc[S_FV] + sums[SUM_V] / points
    out[CONTACT] += acc[S_CONTACT]
    out[forces] += acc[S_RE]
    out[forces + 1] += acc[S_IM]
    d_min, d_max = min(acc[D_FIRST], sums[D_LOW]), max(acc[D_LAST], sums[D_HIGH])
    out[D_MIN], out[V_MAX] = d_min, acc[FAST]
    out[Z_MIN], out[Z_MAX] = (d_min - p[0]) / p[1], (d_max - p[0]) / p[1]


def refine_lanes(block: Any, parameters: Any, steps: Any, sign: float, which: Any, best: Any) -> None:
    """Raise `best` to the largest force times sign in one step of each lane, by golden section as in ``refine``."""
    size, place = best.shape[0], 2 * mode_count()
    ends = np.empty((2, place + 1, size))
    for j in range(size):
        for k in range(place):
            ends[0, k, j], ends[1, k, j] = block[which[j], k, j], block[which[j] + 1, k, j]
    # ends of the bracket, its inner points, and the force there
    low, high, left, right = np.zeros(size), np.ones(size), np.full(size, 1.0 - GOLDEN), np.full(size, GOLDEN)
    at_left, at_right = np.empty(size), np.empty(size)
    force_at(ends, parameters, steps, sign, left, at_left)
    force_at(ends, parameters, steps, sign, right, at_right)
    point, found, to_left = np.empty(size), np.empty(size), np.empty(size, np.int64)
    for j in range(size):
        best[j] = max(best[j], at_left[j], at_right[j])
    for _ in range(7):
        for j in range(size):
            leftward = at_left[j] > at_right[j]
            to_left[j] = 1 if leftward else 0
            high[j], low[j] = (right[j] if leftward else high[j]), (low[j] if leftward else left[j])
            width = GOLDEN * (high[j] - low[j])
            s = high[j] - width if leftward else low[j] + width
            kept, at_kept = (left[j] if leftward else right[j]), (at_left[j] if leftward else at_right[j])
            point[j] = s
            left[j], right[j] = (s if leftward else kept), (kept if leftward else s)
            at_left[j], at_right[j] = at_kept, at_kept
        force_at(ends, parameters, steps, sign, point, found)
        for j in range(size):
            at_left[j] = found[j] if to_left[j] else at_left[j]
            at_right[j] = at_right[j] if to_left[j] else found[j]
            best[j] = found[j] if found[j] > best[j] else best[j]


def force_at(ends: Any, parameters: Any, steps: Any, sign: float, point: Any, found: Any) -> None:
    """Write each lane's force times sign at a share of the step between two samples."""
    here, there = ends[0], ends[1]
    for j in range(point.shape[0]):
        p = parameters_of(parameters, j)
        h, inverse = steps[0, j], steps[1, j]
        a, b = column(here, j), column(there, j)
        d0, v0, d1, v1 = distance(a, p), rate_of(a, p), distance(b, p), rate_of(b, p)
        d, v = between(point[j], h, d0, v0, d1, v1), rate_between(point[j], inverse, d0, v0, d1, v1)
        found[j] = sign * force(d, v, 0.0, None, None, p)
