"""Motions side by side, and one of them with its scratch: the arrays of the compiled engine, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np
from numba import carray  # type: ignore[attr-defined]
from numba.extending import intrinsic

from dforce.engine.tableau import STAGES, WIDTH
from dforce.kernel.pointers import pointer_to

Function = TypeVar("Function", bound=Callable[..., Any])
# contract, arcp and nsz let the compiler fuse and reorder products but keep NaN and infinity meaningful
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract", "arcp", "nsz"}}
# Python never calls these: without a wrapper for it, their machine code is made once, inside the function that it calls
INNER: dict[str, Any] = OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
ZC, LENGTH, SPEED, OMEGA, CONTACT, FIRST_LAW = range(6)  # places in a lane's numbers
# places of a lane's state: time in the interval; distance (m) and velocity at both ends of the step; force (N) at its end;
# the kinks (m) around it, and the number of the upper one; time at which the interval begins; sign of the velocity until the
# next turn; attempts at steps
T, D0, V0, D1, V1, F1, LOW, HIGH, SIDE, BEGIN, HEADING, ATTEMPTS, STATES = range(13)
# places of the sums: force, times deflection, times velocity, contact, and extremes, in the order of ``observables.measure``;
# then the force's Fourier sums
SUM_F, SUM_Z, SUM_V, TOUCHED, Z_MIN, Z_MAX, F_MIN, F_MAX, D_MIN, V_MAX, FIRST_PAIR = range(11)


def called(function: Function) -> Function:
    """Compile a function when Python first calls it."""
    return numba.njit(**OPTIONS)(function)  # type: ignore[no-any-return]


def compiled(function: Function) -> Function:
    """Compile a function when a compiled one first calls it."""
    return numba.njit(**INNER)(function)  # type: ignore[no-any-return]


def inlined(function: Function) -> Function:
    """Do so, and put it in the place of each call."""
    return numba.njit(forceinline=True, **INNER)(function)  # type: ignore[no-any-return]


class Lanes(NamedTuple):
    """The motions to advance, a row for each.

    Attributes
    ----------
    numbers
        Distance and units, and the numbers of the laws behind, (lanes, numbers).
    parts, split, join
        The parts of the modes, see :class:`dforce.engine.parts.Parts`.
    tones
        Frequency ratio of each tone, free motion of the tip and motion of the base (real, imaginary), (lanes, tones, 5).
    span, begin, phases
        Length of the intervals over which sums are taken (scaled time), the scaled time at the start of each, (intervals,), and
        the phase of each tone then, (intervals, tones).
    kinks
        Distances (m) at which a law is not smooth, and a0, rising, (lanes, kinks).
    limits
        For a step: error in the motion, in the columns, in the fastest Fourier sum; longest (scaled time), (lanes, 4).
    deviation
        Deviation of each part from the free motion, and its derivatives, (lanes, parts, 2, 1 + columns).
    unit
        Direct change of the distance (m) for each column, (lanes, columns).
    memory, scale, latched
        Of the forces: memory, (lanes, states), its scale, (states,), and branches, (lanes, latches).
    pairs
        Frequency ratios of the Fourier sums of the force, (pairs,).
    sums
        The sums over each interval, (lanes, intervals, FIRST_PAIR + 2 pairs); or nothing, (lanes, intervals, 0).
    still, path
        Scaled free motion, and motion, at the start and the end of each interval, (lanes, intervals + 1, size).
    samples
        Memory, branches and force (N) at the start and at the end of each interval, (lanes, intervals + 1, states + latches +
        1); or nothing, (lanes, 0, 0).
    """

    numbers: Any
    parts: Any
    split: Any
    join: Any
    tones: Any
    span: float
    begin: Any
    phases: Any
    kinks: Any
    limits: Any
    deviation: Any
    unit: Any
    memory: Any
    scale: Any
    latched: Any
    pairs: Any
    sums: Any
    still: Any
    path: Any
    samples: Any


class Lane(NamedTuple):
    """One motion: its numbers, its state, and room for the stages of a step (q = 1 + columns)."""

    room: Any  # owner of all arrays outside a motion's row: they are views without memory of their own
    numbers: Any
    mode: Any  # (parts, NUMBERS): the parts of the modes, which are modes to all that follows
    turn: Any  # (tones, 8): ratio; free tip, complex; cosine and sine at the start of the step; phase; base, complex
    kinks: Any
    limits: Any
    pairs: Any
    unit: Any
    u: Any  # (modes, 2, q): deviation and columns at the start of the step
    end: Any  # the same at its end
    moved: Any  # (modes, 2, q, WIDTH): in the frame, deviation and columns at each stage, at the end, and two errors
    w: Any  # (2, q): the same of the tip, at a stage
    push: Any  # (q, WIDTH): force at each stage and its change for each column, times the pace of time
    table: Any  # (modes, 6, WIDTH): propagation of a mode up to each stage, see ``step``
    tip: Any  # (3, WIDTH): free deflection and velocity of the tip at each stage, and its time
    wave: Any  # (tones, 2, WIDTH): cosine and sine of a tone's angle since the start of the step
    swing: Any  # (4, WIDTH): waves of the first tone and of its harmonics, one after another
    fourier: Any  # (pairs, 2, WIDTH): Fourier sums of the force over the interval, stage by stage
    force: Any  # (WIDTH,)
    stage: Any  # (2, WIDTH): scaled deflection and velocity of the tip
    memory: Any  # (2, states): at the start and the end of the step
    change: Any  # (stages, states): of the memory, over the step
    scale: Any  # (states,)
    latched: Any
    d: Any  # (3,): distance (m), rate (m/s) and time (s) at which laws are asked for, and their sum (N)
    rate: Any
    t: Any
    result: Any
    kept: Any  # (3, states): memory there
    at: Any  # addresses of d, rate, t, result, kept, change and the laws' numbers
    state: Any  # (STATES,): state passed from step to step, see the places below


def _pointer(context: Any, at: Any) -> Any:
    return pointer_to(at)


pointer: Any = intrinsic(_pointer)


@inlined
def address_of(array: Any) -> int:
    """Return where the numbers of an array lie."""
    return array.ctypes.data  # type: ignore[no-any-return]


@inlined
def unowned(array: Any) -> Any:
    """Return the same array as a view that holds nothing: who calls holds it. Holding costs an atomic count at each use."""
    return carray(pointer(array.ctypes.data), array.shape, np.float64)


@inlined
def carved(room: Any, taken: Any, shape: Any) -> Any:
    """Return the next part of a room as a view that holds nothing; `taken` counts the numbers that are taken, (1,)."""
    count, at = 1, taken[0]
    for size in shape:
        count *= size
    taken[0] = at + count
    return carray(pointer(room.ctypes.data + 8 * at), shape, np.float64)


@compiled
def lane_of(lanes: Any, i: int) -> Lane:
    """Return one motion with room to advance it."""
    modes, states, q = lanes.deviation.shape[1], lanes.scale.shape[0], lanes.deviation.shape[3]
    tones, pairs, taken = lanes.tones.shape[1], lanes.pairs.shape[0], np.zeros(1, np.int64)
    room = np.zeros(  # as many numbers as all parts below have
        modes * (2 * q + 2 * q + 6 * WIDTH + 2 * q * WIDTH)
        + tones * (8 + 2 * WIDTH)
        + (2 + WIDTH) * q
        + WIDTH * (3 + 4 + 2 * pairs + 1 + 2)
        + states * (2 + STAGES + 3)
        + 4 * 3
        + STATES
    )
    numbers, change, kept = (
        unowned(lanes.numbers[i]),
        carved(room, taken, (STAGES, states)),
        carved(room, taken, (3, states)),
    )
    d, rate = carved(room, taken, (3,)), carved(room, taken, (3,))
    t, result = carved(room, taken, (3,)), carved(room, taken, (3,))
    of_motion = address_of(d), address_of(rate), address_of(t), address_of(result)
    at = (*of_motion, address_of(kept), address_of(change), address_of(numbers) + 8 * FIRST_LAW)
    lane = Lane(
        room=room,
        numbers=numbers,
        mode=unowned(lanes.parts[i]),
        turn=carved(room, taken, (tones, 8)),
        kinks=unowned(lanes.kinks[i]),
        limits=unowned(lanes.limits[i]),
        pairs=unowned(lanes.pairs),
        unit=unowned(lanes.unit[i]),
        u=carved(room, taken, (modes, 2, q)),
        end=carved(room, taken, (modes, 2, q)),
        moved=carved(room, taken, (modes, 2, q, WIDTH)),
        w=carved(room, taken, (2, q)),
        push=carved(room, taken, (q, WIDTH)),
        table=carved(room, taken, (modes, 6, WIDTH)),
        tip=carved(room, taken, (3, WIDTH)),
        wave=carved(room, taken, (tones, 2, WIDTH)),
        swing=carved(room, taken, (4, WIDTH)),
        fourier=carved(room, taken, (pairs, 2, WIDTH)),
        force=carved(room, taken, (WIDTH,)),
        stage=carved(room, taken, (2, WIDTH)),
        memory=carved(room, taken, (2, states)),
        change=change,
        scale=unowned(lanes.scale),
        latched=unowned(lanes.latched[i]),
        d=d,
        rate=rate,
        t=t,
        result=result,
        kept=kept,
        at=at,
        state=carved(room, taken, (STATES,)),
    )
    assert taken[0] == room.shape[0]
    for n in range(modes):
        for part in range(2):
            for k in range(q):
                lane.u[n, part, k] = lanes.deviation[i, n, part, k]
    for j in range(tones):
        for k in range(3):
            lane.turn[j, k] = lanes.tones[i, j, k]
        lane.turn[j, 6], lane.turn[j, 7] = lanes.tones[i, j, 3], lanes.tones[i, j, 4]
    for m in range(states):
        lane.memory[0, m] = lanes.memory[i, m]
    return lane
