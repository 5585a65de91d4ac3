"""One step of the classical Runge–Kutta method, and steps that become shorter beside a kink, at roots and spikes.

A force may be like a square root of the distance to a kink, or have a spike there that is narrower than a step.

On the inner side of such a kink the force goes like the root of the time since the kink was passed, or until it is reached. A
step of the length h leaves an error like h^1.5. So the step is also taken in parts, which end where the cube root of the time
has grown by equal amounts: all parts have similar errors. The result is a blend of both. The weight of the parts falls to zero
with the distance from the kink: the end of a step is a continuous function of its beginning. A spike, such as the attraction
just before contact for a tip that crosses its whole range in a step, is treated the same way.

Two kinks may be so close that a step passes both. The way between them has the same length with any number of steps a period,
and more steps would not reduce its error. So its number of parts grows with the number of steps.

Source: H. Brunner, Collocation Methods for Volterra Integral and Related Functional Differential Equations, Cambridge (2004),
chapter 6.2: graded meshes.
"""

from __future__ import annotations

import math
from typing import Any

from dforce.integrators.loops import TAU, remember, seconds
from dforce.kernel.codegen import FIRST_MODE, LENGTH, OMEGA
from dforce.kernel.linker import inlined, uncounted
from dforce.kernel.vocabulary import (
    arrived,
    bent,
    blend,
    coasted,
    distance,
    drive_between,
    evolve,
    fluid_mean,
    fluid_size,
    fluid_slopes,
    followed,
    force,
    forced,
    free_acceleration,
    is_rooted,
    memory_size,
    pushed,
    rate_of,
    yielding,
)
from dforce.observables.interpolant import between_kinks, cubic, cubic_rate, held

PARTS = 4  # of a step beside such a kink
SPARSE = 64  # steps a period with which one between two near kinks would have one part
EVEN = 1e4  # steps behind a root from where on parts are all but equal
REACH = 2.0  # steps from it, within which steps are divided
# second difference of the force over a part, as a share of the forces there, from which it counts as a spike, and from which
# it counts fully; and the same for its change of the velocity, as a share of omega A0, where Q is below UNDAMPED: a lever of a
# higher Q adds up the errors of more periods
SPIKE, SPIKE_FULLY = 0.2, 0.35
PUSH, PUSH_FULLY = 1e-6, 1e-5
UNDAMPED, DAMPING = 10.0, FIRST_MODE + 1
STRIDE = 1.0  # lengths of a step over the distance: a shorter step has no spike, a step of twice this may count fully


@inlined
def step(y: Any, f: float, u: Any, h: float, t: float, forces: Any, limits: Any, p: Any) -> Any:
    """Return the motion one step later, from the force `f` at its start; other forces are evaluated within the limits.

    `u` and `forces` are described in ``loops``.
    """
    (u0, u1, u2), (memory, latched, _, room) = u, forces
    half = seconds(0.5 * h, p)
    full = seconds(h, p)
    size = memory_size(memory)
    stage = room[0] if size else memory
    d = distance(y, p)
    rate = rate_of(y, p)
    middle, last = coasted(y, 0.5 * h), coasted(y, h)
    # each distance is first computed without the latest force, whose part is added later: the next force starts sooner
    b1 = free_acceleration(u0, y, p)
    a1 = forced(b1, f, p)
    ya = pushed(middle, 0.5 * h, a1)
    if fluid_size():
        q1 = fluid_slopes(y, p)
        ya = followed(ya, y, 0.5 * h, q1)
    da, ra = held(distance(middle, p), limits), rate_of(ya, p)
    if size:
        evolve(d, rate, t, memory, room[1], p)
        for i in range(size):
            stage[i] = memory[i] + 0.5 * h * room[1, i]
        evolve(da, ra, t + half, stage, room[2], p)
    fa = force(da, ra, t + half, stage, latched, p)
    b2 = free_acceleration(u1, ya, p)
    a2 = forced(b2, fa, p)
    bend = 0.25 * h * h
    yb = pushed(bent(middle, bend, a1), 0.5 * h, a2)
    if fluid_size():
        q2 = fluid_slopes(ya, p)
        yb = followed(yb, y, 0.5 * h, q2)
    db, rb = held(distance(bent(middle, bend, b1), p) + bend * yielding(p) * f, limits), rate_of(yb, p)
    if size:
        for i in range(size):
            stage[i] = memory[i] + 0.5 * h * room[2, i]
        evolve(db, rb, t + half, stage, room[3], p)
    a3 = forced(free_acceleration(u1, yb, p), force(db, rb, t + half, stage, latched, p), p)
    bend = 0.5 * h * h
    yc = pushed(bent(last, bend, a2), h, a3)
    if fluid_size():
        q3 = fluid_slopes(yb, p)
        yc = followed(yc, y, h, q3)
    dc, rc = held(distance(bent(last, bend, b2), p) + bend * yielding(p) * fa, limits), rate_of(yc, p)
    if size:
        for i in range(size):
            stage[i] = memory[i] + h * room[3, i]
        evolve(dc, rc, t + full, stage, room[4], p)
    a4 = forced(free_acceleration(u2, yc, p), force(dc, rc, t + full, stage, latched, p), p)
    if size:
        for i in range(size):
            stage[i] = memory[i] + h / 6.0 * (room[1, i] + 2.0 * (room[2, i] + room[3, i]) + room[4, i])
    end = arrived(last, h, a1, a2, a3, a4)
    if fluid_size():
        end = followed(end, y, h, fluid_mean(q1, q2, q3, fluid_slopes(yc, p)))
    return end


@uncounted
def whole_step(y: Any, f: float, u: Any, h: float, t: float, forces: Any, limits: Any, p: Any) -> Any:
    """Return the motion one step later: `step`, not inlined, so that it is compiled once."""
    return step(y, f, u, h, t, forces, limits, p)


@inlined
def weight(steps: float) -> float:
    """Return how much parts count in a step that begins, or ends, so many of its lengths from a root."""
    return float(1.0 - smooth(steps / REACH))


@inlined
def smooth(x: float) -> float:
    """Return 0 for a number below 0, 1 for one above 1, and a cubic between."""
    x = min(max(x, 0.0), 1.0)
    return float(x * x * (3.0 - 2.0 * x))


@inlined
def spike(f0: float, fm: float, f1: float, stride: float, h: float, p: Any) -> float:
    """Return the weight, 0 to 1, of a step's parts for a spike, from the forces at its beginning, middle and end.

    `stride` is the length of the step against the distance from the surface.
    """
    bend = abs(f0 - 2.0 * fm + f1)
    share = bend / (abs(f0) + 2.0 * abs(fm) + abs(f1) + 1e-300)
    push = bend * h * yielding(p) / p[LENGTH] / min(1.0, UNDAMPED * p[DAMPING])
    counts = smooth((share - SPIKE) / (SPIKE_FULLY - SPIKE)) * smooth((push - PUSH) / (PUSH_FULLY - PUSH))
    return float(counts * smooth(stride / STRIDE - 1.0))


@inlined
def node(steps: float, k: int, parts: int) -> float:
    """Return the share of a step at which part k ends, where the step begins so many of its lengths behind a root."""
    first, last = steps ** (1.0 / 3.0), (steps + 1.0) ** (1.0 / 3.0)
    return float((first + (last - first) * k / parts) ** 3 - steps)


def since_root(y: Any, h: float, kinks: Any, p: Any) -> float:
    """Return how many steps ago a motion came in over a kink, at most `REACH`."""
    d, rate, ago = distance(y, p), rate_of(y, p), REACH
    for kink in kinks:
        if d < kink and rate < 0.0:
            ago = min(ago, (d - kink) / rate * p[OMEGA] / h)
    return ago


def until_root(y: Any, end: Any, h: float, kinks: Any, p: Any) -> float:
    """Return in how many steps from its end a step leads out over a kink that it began within, as `since_root` does."""
    d, rate, left = distance(end, p), rate_of(end, p), REACH
    for kink in kinks:
        if distance(y, p) < kink and rate > 0.0:
            left = min(left, max(kink - d, 0.0) / rate * p[OMEGA] / h)
    return left


@uncounted
def part_step(y: Any, f: float, u: Any, h: float, t: float, forces: Any, points: int, p: Any) -> Any:
    """Return the motion after a part, of length h, of a step, on one side of all kinks; a period has `points` steps.

    It is divided between two kinks that are passed within a step, near a root, and near a spike.
    """
    _, _, kinks, _ = forces
    low, high = limits = between_kinks(distance(y, p), kinks, p)
    if (high - low) * p[OMEGA] * points < TAU * abs(rate_of(y, p)):
        return in_parts(y, (EVEN, math.ceil(h * points * points / (TAU * SPARSE)), False), u, h, t, forces, p)
    end = whole_step(y, f, u, h, t, forces, limits, p)
    around = near_spikes(y, end, f, h, t, forces, near_roots(y, end, h, kinks, p), p)
    return with_parts(y, end, around, u, h, t, forces, p)


def beside(y: Any, end: Any, h: float, kinks: Any, p: Any) -> bool:
    """Return whether a step that passes no kink is so near a kink that it may have to be `divided`."""
    if is_rooted(p) and min(since_root(y, h, kinks, p), until_root(y, end, h, kinks, p)) < REACH:
        return True
    return strides(y, end, h, kinks, p)


@uncounted
def divided(y: Any, whole: Any, f: float, u: Any, h: float, t: float, forces: Any, p: Any) -> Any:
    """Return where a step that passes no kink leads in parts where that is needed; the whole step leads to `whole`."""
    _, _, kinks, _ = forces
    around = near_roots(y, whole, h, kinks, p)
    if strides(y, whole, h, kinks, p):
        around = near_spikes(y, whole, f, h, t, forces, around, p)
    return with_parts(y, whole, around, u, h, t, forces, p)


def strides(y: Any, end: Any, h: float, kinks: Any, p: Any) -> bool:
    """Return whether a step outside a kink, and near it, is long against the distance: it may contain a spike."""
    d0, d1, far, found = distance(y, p), distance(end, p), REACH * h / p[OMEGA], False
    if abs(d1 - d0) > STRIDE * min(d0, d1):
        for kink in kinks:
            found |= 0.0 < d0 - kink < far * abs(rate_of(y, p)) or 0.0 < d1 - kink < far * abs(rate_of(end, p))
    return found


@uncounted
def near_spikes(y: Any, end: Any, f: float, h: float, t: float, forces: Any, around: Any, p: Any) -> Any:
    """Return `around`, see `with_parts`, with the weights that a spike beside a kink asks for."""
    (before, after, at_begin, at_end), (memory, latched, kinks, room) = around, forces
    dt, d0, v0, d1, v1 = seconds(h, p), distance(y, p), rate_of(y, p), distance(end, p), rate_of(end, p)
    if not 0.0 <= STRIDE * min(d0, d1) < abs(d1 - d0):
        return around
    limits = between_kinks(distance(y, p), kinks, p)
    dm, vm = held(cubic(0.5, dt, d0, v0, d1, v1), limits), cubic_rate(0.5, dt, d0, v0, d1, v1)
    fm = force(dm, vm, t + 0.5 * dt, memory, latched, p)
    f1 = force(held(d1, limits), v1, t + dt, room[0] if memory_size(memory) else memory, latched, p)
    steep, first = spike(f, fm, f1, abs(d1 - d0) / min(d0, d1), h, p), abs(f) > abs(f1)
    steps = REACH
    for kink in kinks:
        steps = min(steps, abs(d0 - kink) / abs(v0) * p[OMEGA] / h, abs(d1 - kink) / abs(v1) * p[OMEGA] / h)
    steep *= weight(steps)
    if first and steep > at_begin:
        before, at_begin = 0.0, steep
    if not first and steep > at_end:
        after, at_end = 0.0, steep
    return before, after, at_begin, at_end


@uncounted
def near_roots(y: Any, end: Any, h: float, kinks: Any, p: Any) -> Any:
    """Return `around`, see `with_parts`, for a step near roots."""
    if is_rooted(p):
        before, after = since_root(y, h, kinks, p), until_root(y, end, h, kinks, p)
        return before, after, weight(before), weight(after)
    return REACH, REACH, 0.0, 0.0


@uncounted
def with_parts(y: Any, whole: Any, around: Any, u: Any, h: float, t: float, forces: Any, p: Any) -> Any:
    """Return a step's end blended with the end of its parts, and blend the memory; the whole step leads to `whole`.

    `around` has the distance, in steps, from a root behind to its beginning, and from its end to a root ahead. Then it has the
    weights, 0 to 1, of parts that become longer from its beginning, and of parts that become shorter to its end.
    """
    (before, after, at_begin, at_end), (memory, _, _, room) = around, forces
    if at_begin == 0.0 and at_end == 0.0:
        return whole
    size = memory_size(memory)
    for k in range(size):
        room[5, k], room[6, k] = room[0, k], room[0, k]
    first, last = whole, whole
    if at_begin > 0.0:
        first = in_parts(y, (before, PARTS, False), u, h, t, forces, p)
        for k in range(size):
            room[6, k] += at_begin * (room[0, k] - room[5, k])
    if at_end > 0.0:
        last = in_parts(y, (after, PARTS, True), u, h, t, forces, p)
        for k in range(size):
            room[6, k] += at_end * (room[0, k] - room[5, k])
    for k in range(size):
        room[0, k] = room[6, k]
    return blend(whole, at_begin, first, at_end, last)


@uncounted
def in_parts(y: Any, mesh: Any, u: Any, h: float, t: float, forces: Any, p: Any) -> Any:
    """Return the motion one step later, taken in parts.

    `mesh` has the distance, in steps, from a root behind to its beginning, the number of parts, and whether the distance goes
    from its end to a root ahead instead.
    """
    (steps, parts, mirrored), (u0, u1, u2), (memory, latched, kinks, room) = mesh, u, forces
    share, now, limits = 0.0, room[7], between_kinks(distance(y, p), kinks, p)
    for k in range(memory_size(memory)):
        now[k] = memory[k]
    inside = now, latched, kinks, room
    for k in range(1, parts + 1):
        end = 1.0 - node(steps, parts - k, parts) if mirrored else node(steps, k, parts)
        f = force(held(distance(y, p), limits), rate_of(y, p), t + seconds(share * h, p), now, latched, p)
        middle = drive_between(u0, u1, u2, 0.5 * (share + end))
        driven = drive_between(u0, u1, u2, share), middle, drive_between(u0, u1, u2, end)
        y = whole_step(y, f, driven, (end - share) * h, t + seconds(share * h, p), inside, limits, p)
        remember(inside)
        share = end
    return y
