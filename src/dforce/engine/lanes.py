"""Motions side by side, and one of them with its scratch: the arrays of the compiled engine, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np

from dforce.engine.tableau import STAGES, WIDTH

Function = TypeVar("Function", bound=Callable[..., Any])
# contract, arcp and nsz let the compiler fuse and reorder products but keep NaN and infinity meaningful
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract", "arcp", "nsz"}}
ZC, LENGTH, SPEED, OMEGA, CONTACT, FIRST_MODE, PER_MODE = 0, 1, 2, 3, 4, 5, 3  # places in the kernel's parameters
# places of a lane's state: time in the interval; distance (m) and velocity at both ends of the step; force (N) at its end;
# the kinks (m) around it, and the number of the upper one; time at which the interval begins; sign of the next velocity
T, D0, V0, D1, V1, F1, LOW, HIGH, SIDE, BEGIN, HEADING, STATES = range(12)
# places of the sums: force, times deflection, times velocity, contact; extremes; then the force's Fourier sums
SUM_F, SUM_Z, SUM_V, TOUCHED, Z_MIN, Z_MAX, F_MIN, F_MAX, D_MIN, V_MAX, FIRST_PAIR = range(11)


def compiled(function: Function) -> Function:
    """Compile a function when it is first called."""
    return numba.njit(**OPTIONS)(function)  # type: ignore[no-any-return]


def inlined(function: Function) -> Function:
    """Do so, and put it in the place of each call."""
    return numba.njit(forceinline=True, **OPTIONS)(function)  # type: ignore[no-any-return]


class Lanes(NamedTuple):
    """Motions that are advanced, a row for each.

    Attributes
    ----------
    numbers
        The lever's scaled numbers and those of the laws behind, (lanes, numbers).
    tones
        Frequency ratio of each tone, real and imaginary part of the base's motion and of the free motion of each mode, (lanes,
        tones, 3 + 2 modes).
    span, begin, phases
        Length of the intervals over which sums are taken (scaled time), the scaled time at the start of each, (intervals,), and
        the phase of each tone then, (intervals, tones).
    kinks
        Distances (m) at which a law is not smooth, and a0, rising, (lanes, kinks).
    limits
        Of a step: error in the motion, in the columns, in the fastest Fourier sum; longest (scaled time), (lanes, 4).
    deviation
        Deviation from the free motion and its derivatives, (lanes, modes, 2, 1 + columns).
    unit
        What the distance changes by (m) in each column of itself, (lanes, columns).
    memory, scale, latched
        Of the forces: memory, (lanes, states), its scale, (states,), and branches, (lanes, latches).
    pairs
        Frequency ratios of the Fourier sums of the force, (pairs,).
    sums
        What is summed over each interval, (lanes, intervals, FIRST_PAIR + 2 pairs); or nothing, (lanes, intervals, 0).
    still, path
        Scaled free motion, and motion, at the start and the end of each interval, (lanes, intervals + 1, 2 modes).
    samples
        Memory, branches and force (N) at the start and at the end of each interval, (lanes, intervals + 1, states + latches +
        1); or nothing, (lanes, 0, 0).
    count
        Attempts, and steps taken; negative where the motion was given up, (lanes, 2).
    """

    numbers: Any
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
    count: Any


class Lane(NamedTuple):
    """One motion: what it is made of, where it is, and room for the stages of a step (q = 1 + columns)."""

    numbers: Any
    mode: Any  # (modes, 4): half damping, square of the damped frequency, stiffness, gain
    turn: Any  # (tones, 8): ratio; free tip, complex; cosine and sine at the start of the step; phase; base, complex
    kinks: Any
    limits: Any
    pairs: Any
    unit: Any
    u: Any  # (modes, 2, q): deviation and columns at the start of the step
    end: Any  # the same at its end
    w: Any  # (2, q): the same of the tip, at a stage
    push: Any  # (q, WIDTH): force at each stage and its change for each column, times the pace of time
    table: Any  # (modes, 6, WIDTH): what a mode does up to each stage, see ``step``
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
    at: Any  # (7,): addresses of d, rate, t, result, kept, change and the laws' numbers
    state: Any  # (STATES,): what goes from step to step, see the places below


@compiled
def lane_of(lanes: Any, i: int) -> Lane:
    """Return one motion with room to advance it."""
    numbers, tones, scale, kinks = lanes.numbers[i], lanes.tones[i], lanes.scale, lanes.kinks[i]
    modes, q, states = lanes.deviation.shape[1], lanes.deviation.shape[3], scale.shape[0]
    mode, turn = np.empty((modes, 4)), np.zeros((tones.shape[0], 8))
    for n in range(modes):
        first = FIRST_MODE + PER_MODE * n
        stiff, drag, gain = numbers[first], numbers[first + 1], numbers[first + 2]
        mode[n, 0], mode[n, 1], mode[n, 2], mode[n, 3] = 0.5 * drag, stiff - 0.25 * drag * drag, stiff, gain
    for j in range(tones.shape[0]):
        turn[j, 0], turn[j, 6], turn[j, 7] = tones[j, 0], tones[j, 1], tones[j, 2]
        for n in range(modes):
            turn[j, 1] += tones[j, 3 + 2 * n]
            turn[j, 2] += tones[j, 4 + 2 * n]
    d, rate, t, result = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    kept, change, at = np.zeros((3, states)), np.zeros((STAGES, states)), np.empty(7, np.int64)
    at[0], at[1], at[2], at[3] = d.ctypes.data, rate.ctypes.data, t.ctypes.data, result.ctypes.data
    at[4], at[5], at[6] = (
        kept.ctypes.data,
        change.ctypes.data,
        numbers.ctypes.data + 8 * (FIRST_MODE + PER_MODE * modes),
    )
    u, memory = lanes.deviation[i].copy(), np.zeros((2, states))
    for m in range(states):
        memory[0, m] = lanes.memory[i, m]
    return Lane(
        numbers,
        mode,
        turn,
        kinks,
        lanes.limits[i],
        lanes.pairs,
        lanes.unit[i],
        u,
        np.empty((modes, 2, q)),
        np.empty((2, q)),
        np.zeros((q, WIDTH)),
        np.empty((modes, 6, WIDTH)),
        np.empty((3, WIDTH)),
        np.empty((tones.shape[0], 2, WIDTH)),
        np.empty((4, WIDTH)),
        np.zeros((lanes.pairs.shape[0], 2, WIDTH)),
        np.empty(WIDTH),
        np.empty((2, WIDTH)),
        memory,
        change,
        scale,
        lanes.latched[i],
        d,
        rate,
        t,
        result,
        kept,
        at,
        np.zeros(STATES),
    )
