"""The classical Runge–Kutta method with fixed steps locked to the drive.

Order 4 (M. W. Kutta, Z. Math. Phys. 46, 435 (1901)). A step is cut in two where it passes a kink of the force, or the switch
of a force with two branches. Without the cut the order is lost, and a force that jumps never settles.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.integrators.events import grazes, margin, passed, risen, touches_a_jump, turn_behind
from dforce.integrators.loops import TAU, keep_rest, phases, remember, seconds, tabulate
from dforce.integrators.steps import beside, divided, part_step, step
from dforce.kernel.codegen import OMEGA
from dforce.kernel.linker import by_address, inlined, uncounted
from dforce.kernel.vocabulary import (
    bent,
    blend,
    coasted,
    distance,
    drive_at,
    drive_between,
    fluid_size,
    fluid_slopes,
    followed,
    force,
    forced,
    free_acceleration,
    has_states,
    keep,
    mode_count,
    pushed,
    rate_of,
    row,
    unpacked,
)
from dforce.observables.interpolant import between_kinks, crossing, held
from dforce.observables.lockin import lock_in
from dforce.observables.measure import ROOM, measure

MOST_CUTS = 12  # of one step; a force that switches more often has no branch to be on
NEAR = 2e-6  # how near behind a kink is near enough, relative to the step: for so long the force is off
TRIES = 4  # to land behind a kink
CLOSE = 1e-5  # relative to the step: from so near a Taylor step leads on to there
DRIVE, FORCES = "Tuple((f8[:,::1],f8[::1],i8,i8))", "Tuple((f8[::1],f8[::1],f8[::1],f8[:,::1]))"  # types, see ``loops``
ON_SWITCH = 1e-6  # of how far a step leads past a switch: a motion so near to it when the step begins is on it
LANDED = 1e-8  # relative to the step: how near behind a switch a cut is, and a rest of the step that is left out


@uncounted
def cut_at_kink(y: Any, end: Any, f: float, u: Any, i: int, drive: Any, forces: Any, p: Any) -> Any:
    """Return the motion after step i, cut where it passes a kink or a branch switches; the forces' states are updated.

    `f` is the force at its start, `end` the motion after the whole step. Without memory and branches:

    1. the cubic through both ends gives the time `first` to the kink, and Newton's method corrects it;
    2. a step leads there, with the force held on this side, and a short Taylor step from there to just behind the kink;
    3. a step with the force of the other side leads on to the end.

    The drive is interpolated between the three of `u`, to an error below the step's. `cut_step` handles all else, such as
    more than one kink in a step.
    """
    (_, _, period, points), (memory, latched, kinks, _), (u0, u1, u2) = drive, forces, u
    h = TAU / points
    tau = i * h
    t, dt = seconds(period * TAU + tau, p), seconds(h, p)
    which = passed(y, end, t + dt, forces, p)
    if which < 0:
        if not touches_a_jump(y, h, t, forces, p):
            remember(forces)
            return end
        end = driven_step(y, tau, h, drive, forces, p)
    elif not has_states():
        limits = between_kinks(distance(y, p), kinks, p)
        first = h * (share_to(kinks[which], y, end, dt, p) + 0.5 * NEAR)
        for _ in range(TRIES):
            if not 0.0 < first < h:
                break
            um, uh = drive_between(u0, u1, u2, 0.5 * first / h), drive_between(u0, u1, u2, first / h)
            landed = part_step(y, f, (u0, um, uh), first, t, forces, points, p)
            past = margin(which, y, landed, t, forces, p)
            wanted = NEAR * h * abs(rate_of(landed, p)) / p[OMEGA]
            off = (past - 0.5 * wanted) / wanted
            first -= off * NEAR * h
            if not abs(off) < CLOSE / NEAR:
                continue
            # so near, the acceleration is constant over the rest of the way
            back, reached = -off * NEAR * h, held(distance(landed, p), limits)
            before = force(reached, rate_of(landed, p), t + seconds(first, p), memory, latched, p)
            a = forced(free_acceleration(uh, landed, p), before, p)
            near = landed
            landed = pushed(bent(coasted(near, back), 0.5 * back * back, a), back, a)
            if fluid_size():
                landed = followed(landed, near, back, fluid_slopes(near, p))
            if passed(y, landed, t, forces, p) != which:
                break
            left, between = h - first, t + seconds(first, p)
            limits = between_kinks(distance(landed, p), kinks, p)
            behind = force(held(distance(landed, p), limits), rate_of(landed, p), between, memory, latched, p)
            um = drive_between(u0, u1, u2, 0.5 + 0.5 * first / h)
            end = part_step(landed, behind, (uh, um, u2), left, between, forces, points, p)
            if passed(landed, end, t + dt, forces, p) >= 0:
                break
            return end
        end = driven_step(y, tau, h, drive, forces, p)
    return cut_step(y, end, tau, h, drive, forces, p)


def share_to(kink: float, y: Any, end: Any, dt: float, p: Any) -> float:
    """Return the share of a step of length `dt` (s) at which a kink lies, nearly, by the cubic through both ends."""
    return crossing(kink, 0.0, 1.0, 1e-5, (dt, distance(y, p), rate_of(y, p), distance(end, p), rate_of(end, p)))


@uncounted
def cut_step(y: Any, end: Any, tau: float, h: float, drive: Any, forces: Any, p: Any) -> Any:
    """Return the motion one step later, cut where it passes a kink or a branch switches; the forces' states are updated.

    `end` is where the whole step leads.
    """
    (_, _, period, _), (_, latched, kinks, _) = drive, forces
    left, known = h, True
    for _ in range(MOST_CUTS):
        start = tau + h - left
        t = seconds(period * TAU + start, p)
        which = risen(y, t, latched, p)
        if which >= 0:
            latched[which] = 1.0 - latched[which]
            known = False
            continue
        done = left
        if not known:
            end = driven_step(y, start, done, drive, forces, p)
        which = passed(y, end, t + seconds(done, p), forces, p)
        share = turn_behind(y, end, seconds(done, p), kinks, p) if which < 0 else 0.0
        if share > 0.0:
            done *= share
            end = driven_step(y, start, done, drive, forces, p)
            which = passed(y, end, t + seconds(done, p), forces, p)
        sticks = False
        if which >= kinks.shape[0]:
            sticks, end = on_switch(y, end, which, start, done, drive, forces, p)
        if which >= 0 and not sticks:
            done, end = first_event(y, end, start, done, drive, forces, p)
        y, known = end, False
        remember(forces)
        left -= done
        if left <= LANDED * h:
            return y
    end = driven_step(y, tau + h - left, left, drive, forces, p)
    remember(forces)
    return end


@uncounted
def on_switch(y: Any, end: Any, event: int, start: float, h: float, drive: Any, forces: Any, p: Any) -> Any:
    """Return whether a motion stays on a switch, because both branches drive it back, and the motion after the step.

    It lies between the motions on both branches: a tip that sticks (A. F. Filippov, Differential Equations with
    Discontinuous Righthand Sides, Kluwer (1988)). On its own branch the motion passes the switch, to `end`.
    """
    (_, _, period, _), (_, latched, kinks, _) = drive, forces
    t, which = seconds(period * TAU + start, p), event - kinks.shape[0]
    now = t + seconds(h, p)
    past = margin(event, y, end, now, forces, p)
    if abs(margin(event, y, y, t, forces, p)) > ON_SWITCH * past:
        return False, end
    latched[which] = 1.0 - latched[which]
    other = driven_step(y, start, h, drive, forces, p)
    if passed(y, other, now, forces, p) != event:
        latched[which] = 1.0 - latched[which]
        return False, end
    beyond = margin(event, y, other, now, forces, p)
    return True, blend(other, beyond / (past + beyond), end, 0.0, end)


@uncounted
def before_kink(y: Any, landed: Any, t: float, now: float, share: float, forces: Any, p: Any) -> int:
    """Return the latch that switches on the way to a kink, clearly before it, or -1; `share` of a step leads there."""
    _, latched, kinks, _ = forces
    which = risen(landed, now, latched, p)
    if which >= 0:
        event = which + kinks.shape[0]
        below, above = margin(event, y, y, t, forces, p), margin(event, y, landed, now, forces, p)
        if share * above < 2.0 * NEAR * (above - below):
            return -1
    return which


@uncounted
def first_event(y: Any, end: Any, start: float, h: float, drive: Any, forces: Any, p: Any) -> Any:
    """Return a time within a step just after the first event in it, and the motion then; the memory has not moved yet.

    The first guess comes from the cubic through both ends, the next ones from secants aimed at either side.
    """
    (_, _, period, _), (_, _, kinks, _) = drive, forces
    t = seconds(period * TAU + start, p)
    low, high, which = 0.0, h, passed(y, end, t + seconds(h, p), forces, p)
    below = margin(which, y, y, t, forces, p)
    above = margin(which, y, end, t + seconds(h, p), forces, p)
    guess = low + (high - low) * below / (below - above)
    if which < kinks.shape[0]:
        guess = h * (share_to(kinks[which], y, end, seconds(h, p), p) + 0.5 * NEAR)
    side = 1.0
    for attempt in range(60):
        if high - low <= 3.0 * LANDED * h:
            break
        if attempt > 0:
            guess = low + (high - low) * below / (below - above) + side * LANDED * h
        if attempt % 4 == 3 or not low < guess < high:
            guess = 0.5 * (low + high)
        middle = driven_step(y, start, guess, drive, forces, p)
        now = t + seconds(guess, p)
        found = passed(y, middle, now, forces, p)
        if 0 <= found < kinks.shape[0]:
            latch = before_kink(y, middle, t, now, guess / h, forces, p)
            found = latch + kinks.shape[0] if latch >= 0 else found
        if found < 0:
            low, below, side = guess, margin(which, y, middle, now, forces, p), 1.0
        elif found == which:
            high, above, side = guess, margin(which, y, middle, now, forces, p), -1.0
            rate = abs(rate_of(middle, p)) / p[OMEGA]
            if which < kinks.shape[0] and above < NEAR * h * rate:
                return high, middle
        else:  # another event comes before it
            which, high, side, low = found, guess, -1.0, 0.0
            below = margin(which, y, y, t, forces, p)
            above = margin(which, y, middle, now, forces, p)
    return high, driven_step(y, start, high, drive, forces, p)


@uncounted
def driven_step(y: Any, tau: float, h: float, drive: Any, forces: Any, p: Any) -> Any:
    """Take a step of any length from any time within the period, with the drive evaluated anew, on one side of all kinks."""
    (tones, bases, period, points), (memory, latched, kinks, _) = drive, forces
    t = seconds(period * TAU + tau, p)
    f = force(held(distance(y, p), between_kinks(distance(y, p), kinks, p)), rate_of(y, p), t, memory, latched, p)
    u = drive_at(tones, bases, tau), drive_at(tones, bases, tau + 0.5 * h), drive_at(tones, bases, tau + h)
    return part_step(y, f, u, h, t, forces, points, p)


@by_address(f"{{y}}({{y}},{{y}},f8,i8,{DRIVE},f8[:,::1],{FORCES},{{tip}})")
def cut(y: Any, uncut: Any, f: float, i: int, drive: Any, table: Any, forces: Any, tip: Any) -> Any:
    """Return the motion after step i, taken again beside a kink or a switch; the forces' states are updated.

    `f` is the force at its start, `uncut` is where the whole step leads.
    """
    (_, _, period, points), (_, _, kinks, _), p = drive, forces, unpacked(tip)
    h = TAU / points
    dt = seconds(h, p)
    t = seconds(period * TAU, p) + i * dt
    u = row(table, 2 * i), row(table, 2 * i + 1), row(table, 2 * i + 2)
    if passed(y, uncut, t + dt, forces, p) >= 0 or grazes(y, h, kinks, p):
        return cut_at_kink(y, uncut, f, u, i, drive, forces, p)
    end = divided(y, uncut, f, u, h, t, forces, p)
    remember(forces)
    return end


@inlined
def next_sample(y: Any, f: float, i: int, drive: Any, table: Any, forces: Any, tip: Any, p: Any) -> Any:
    """Return the motion after step i from the force at its start; the forces' states are updated."""
    (_, _, period, points), (_, _, kinks, _) = drive, forces
    h = TAU / points
    dt = seconds(h, p)
    t = seconds(period * TAU, p) + i * dt
    u = row(table, 2 * i), row(table, 2 * i + 1), row(table, 2 * i + 2)
    end = step(y, f, u, h, t, forces, None, p)
    if passed(y, end, t + dt, forces, p) >= 0 or grazes(y, h, kinks, p) or beside(y, end, h, kinks, p):
        return cut(y, end, f, i, drive, table, forces, tip)
    remember(forces)
    return end


@by_address(f"{{y}}({{y}},{DRIVE},f8[:,::1],{FORCES},f8[:,::1],{{tip}})")
def advance(y: Any, drive: Any, table: Any, forces: Any, samples: Any, tip: Any) -> Any:
    """Return the motion one period later; samples[i] holds sample i of the period, both ends included.

    `table` is the drive on each mode at the ends and middles of all steps, (2 points + 1, modes).
    """
    (_, _, period, points), (memory, latched, _, _), p = drive, forces, unpacked(tip)
    start, dt = seconds(period * TAU, p), seconds(TAU / points, p)
    for i in range(points):
        f = force(distance(y, p), rate_of(y, p), start + i * dt, memory, latched, p)
        keep(samples, i, y)
        keep_rest(samples, i, memory, latched, f)
        y = next_sample(y, f, i, drive, table, forces, tip, p)
    f = force(distance(y, p), rate_of(y, p), start + points * dt, memory, latched, p)
    keep(samples, points, y)
    keep_rest(samples, points, memory, latched, f)
    return y


def march(y: Any, forces: Any, first: int, tones: Any, turns: Any, samples: Any, p: Any, out: Any) -> Any:
    """Advance whole periods and measure each into a row of `out`: the lock-in, two columns a tone, or all columns."""
    points, bases = samples.shape[0] - 1, np.empty(tones.shape[0])
    room, table = np.empty((ROOM, points + 1)), np.empty((2 * points + 1, mode_count()))
    for i in range(out.shape[0]):
        if i == 0 or tones.shape[0] > 1:  # the first tone alone repeats every period
            phases(tones, first + i, bases)
            tabulate(tones, bases, points, table)
        drive = tones, bases, first + i, points
        y = advance(y, drive, table, forces, samples, p)
        if out.shape[1] > 2 * tones.shape[0]:
            measure(samples, turns, drive, forces[2], p, room, out[i])
        else:
            lock_in(samples, turns, bases, room[0], out[i])
    return y
