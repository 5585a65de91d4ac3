"""Locked states as orbits on a curve, so that it is followed through its folds as any other; see ``continuation``.

Frequency and drive change the more, the stiffer the contact is: they count by the width of the resonance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array
from dforce.observables import measure
from dforce.problem import Problem
from dforce.solvers.continuation import trace
from dforce.solvers.locked import Locked, LockedAnchor, LockedStates
from dforce.solvers.orbit import FOLD, Orbit
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.period_map import ALL, MOTION
from dforce.solvers.points import StateJump
from dforce.solvers.search import LAGS, Known, of_amplitudes, periods_of_transients
from dforce.solvers.stability import CRITICAL, STABLE, UNSTABLE
from dforce.solvers.transient import CancelCheck

FARTHEST = 100.0  # free amplitudes
LARGEST = 0.1  # of the curve's unit: step through a fold
BEFORE = 0.01  # of it: where the way through a fold begins
MOST = 300  # points on this way
SPEED = 0.3  # of an error, which a controller corrects in a period
SLOWEST, FASTEST = 0.5, 2.0  # of the frequency of the free lock


@dataclass(frozen=True)
class LockedOrbit(Orbit):
    """A locked state on a curve, with its scaled motion and the monodromy matrix of the motion that ideal controllers leave.

    Attributes
    ----------
    found
        The same state as the only row of a table.
    equations
        Derivatives of the equations by the scaled unknowns.
    steady
        Whether it is stable.
    """

    found: Any = None
    equations: Any = None
    steady: bool = True

    @property
    def stability(self) -> int:
        """Whether small disturbances die out or grow under ideal controllers."""
        return CRITICAL if self.special == FOLD else STABLE if self.steady else UNSTABLE

    @property
    def index(self) -> int:
        """Sign of the determinant of the equations at a constant parameter."""
        return int(np.linalg.slogdet(self.equations[:, :-1]).sign)


class LockedRange(ParameterRange):
    """A range of the parameter of locked states, between two of its scaled values."""

    def __init__(self, locked: Locked, start: float, stop: float) -> None:
        self.locked, self.problem, self.zc = locked, locked.problem, None
        self.low, self.high = min(start, stop), max(start, stop)
        self.points, self.common, self.has_changing_lever = locked.block.points, locked.block.common, False
        offset, self.span = locked.scales[locked.numbers[-1]]
        self._ends = offset + self.low * self.span, offset + self.high * self.span

    def problem_at(self, value: float) -> Problem:
        """Return the problem; see :class:`ParameterRange`."""
        return self.problem

    def problem_of(self, orbit: Orbit) -> Problem:
        """Return the problem in amplitude modulation, at the frequency and drive of a state."""
        assert isinstance(orbit, LockedOrbit)
        _, at, ratio = self.locked.driven(orbit.found.unknowns)
        return self.problem.unlocked.driven(float(at[0]), float(ratio[0]))

    def find(self, guess: Array, branch: Array, normal: Array | None = None, repeats: int = 1) -> Orbit | None:
        """Return the state near a guess; see :meth:`ParameterRange.find`."""
        weights = self.locked.weights
        across = None if normal is None else (normal * weights)[None]
        found = self.locked.newton((guess / weights)[None], branch, across=across)
        return self.on_curve(found) if found.good[0] else None

    def free_orbit(self, scaled: float) -> Orbit | None:
        """Return the state to which an approach from far away leads; see :meth:`ParameterRange.free_orbit`."""
        first = self.locked.begin(scaled)
        found = None if first is None else follow(self.locked, first, np.array([scaled]))[0]
        return self.on_curve(found) if found is not None and found.good[0] else None

    def on_curve(self, found: LockedStates) -> LockedOrbit:
        """Return the only state as an orbit."""
        locked, (unknowns, branch, matrix, _) = self.locked, found
        missed, _, matrix[:, :-1] = locked.derived(unknowns, branch)  # where it is, not where it was guessed
        _, _, rows = locked.march(unknowns, branch, wanted=ALL)
        states = locked.motions(unknowns, branch)
        return LockedOrbit(
            unknowns[0] * locked.weights,
            states,
            float(locked.number(unknowns, locked.numbers[-1])[0]),
            states,
            locked.left_free(found)[0],
            np.empty(0),
            rows[0],
            rows[0, :, measure.D_MIN].min() - locked.block.batch.kinks[0],
            float(np.abs(missed[:, : locked.motion]).max()),
            0.0,
            found=found,
            equations=matrix[0, :-1] / locked.weights,
            steady=bool(locked.is_stable(found)[0]),
        )

    def kept(self, orbits: Sequence[Any]) -> Array:
        """Return numbers of states from which a stopped run goes on, a row for each; see :meth:`restored`."""
        return np.array(
            [np.concatenate([*(part.ravel() for part in one.found[:2]), one.found.matrix[0, -1]]) for one in orbits]
        )

    def restored(self, rows: Array) -> list[Orbit]:
        """Return the states with these numbers."""
        self.locked.begin(self.high)  # the free lock decides the stability
        size, out = len(self.locked.weights), list[Orbit]()
        for row in rows:
            matrix = np.tile(row[-size:], (1, size, 1))
            out.append(
                self.on_curve(LockedStates(row[None, :size], row[None, size:-size], matrix, np.ones(1, dtype=bool)))
            )
        return out


def follow(locked: Locked, first: LockedAnchor, at: Array) -> tuple[LockedStates, list[StateJump], LockedAnchor]:
    """Find the stable states from a state on at values that rise or fall, and note jumps; return the last state, too.

    Behind a fold the curve leads to the stable state at the next value. Where the curve ends, controllers find the state, at
    the next value at which they have a state.
    """
    way, parts, jumps = math.copysign(1.0, at[-1] - first.at), [], []
    behind = int(np.sum(way * (at - first.at) < 0.0))
    parts = [LockedStates.lost(first, behind)]
    at = at[behind:]
    while len(at):
        anchors = locked.walk(first, float(at[-1]))
        reached = int(np.sum(way * (at - anchors[-1].at) <= 0.0))
        parts += [locked.between(anchors, at[:reached])] if reached else []
        at, first = at[reached:], anchors[-1]
        if not len(at):
            break
        landed = _behind_fold(locked, anchors, float(at[0])) or _behind_end(locked, anchors[-1], at)
        if landed is None:
            parts.append(LockedStates.lost(first, len(at)))
            break
        first = landed[1]
        jumps += landed[0]
        missed = int(np.sum(way * (at - first.at) < 0.0))
        parts, at = [*parts, LockedStates.lost(first, missed)], at[missed:]
    return LockedStates.joined(parts), jumps, first


def _behind_fold(locked: Locked, anchors: list[LockedAnchor], to: float) -> tuple[list[StateJump], LockedAnchor] | None:
    """Return the stable state at a value to which the curve leads around folds, and the jump there; None where it ends."""
    way = math.copysign(1.0, to - anchors[-1].at)
    last = next((one for one in reversed(anchors) if abs(one.at - anchors[-1].at) > BEFORE), anchors[0])
    among = LockedRange(locked, to, anchors[0].at - way * FARTHEST)
    found = locked.newton(last.unknowns[None], last.branch[None])
    if not found.good[0]:
        return None
    points: list[Orbit] = [among.on_curve(found)]
    forth = 1 if way * points[0].tangent[-1] > 0.0 else -1
    trace(among, points, forth, LARGEST, MOST, locked.block.check_cancelled)
    end = points[-1]
    assert isinstance(end, LockedOrbit)
    if end.u[-1] != to or not end.is_stable:
        return None
    folds = [point for point in points if isinstance(point, LockedOrbit) and point.special == FOLD][:1]
    before, after = (
        locked.length * float(np.abs(locked.signal(one.found.unknowns, one.rows[None])[0]))
        for one in (*folds, end, end)[:2]
    )
    jumps = [StateJump(fold.value, before, after, way > 0.0) for fold in folds]
    return jumps, locked.anchor(end.found)


def _behind_end(locked: Locked, last: LockedAnchor, at: Array) -> tuple[list[StateJump], LockedAnchor] | None:
    """Return the first stable state to which controllers lead at one of some values, and the jump; None without one."""
    start = np.tile(last.unknowns, (len(at), 1))
    start[:, -1] = at
    found = locked.newton(*settled(locked, start, np.tile(last.branch, (len(at), 1))))
    there = np.flatnonzero(found.good)
    there = there[locked.is_stable(found.take(there))]
    if not len(there):
        return None
    end = locked.anchor(found.take(there[:1]))
    states = np.array([last.unknowns, end.unknowns]), np.array([last.branch, end.branch])
    before, after = np.abs(locked.signal(states[0], locked.march(*states)[2])) * locked.length
    where = locked.number(states[0], locked.numbers[-1])[0]
    return [StateJump(float(where), float(before), float(after), end.at > last.at)], end


def settled(locked: Locked, unknowns: Array, branch: Array) -> tuple[Array, Array]:
    """Return the unknowns and branches to which controllers lead motions at a constant parameter.

    After each period a phase-locked loop and an amplitude control correct frequency and drive, as in ``controlled``.
    """
    unknowns = unknowns.copy()
    [mode] = {locked.problem.modes[tone.mode] for tone in locked.problem.tones}
    offset, unit = locked.scales["frequency"]
    column = {name: locked.motion + place for place, name in enumerate(locked.free)}
    # the zero of each controller cancels the pole of the lever, in periods
    pole, example = math.pi / mode.Q, locked.block.batch.example
    middle, push = locked.number(unknowns, "frequency"), locked.number(unknowns, "drive")
    for _ in range(periods_of_transients(locked.problem)):
        zc, at_frequency, ratio = locked.driven(unknowns)
        after, rows = locked.block.driven(zc, locked.motions(unknowns, branch), at_frequency, ratio, MOTION)
        signal = locked.signal(unknowns, rows) * np.exp(1j * locked.lock.phase)
        branch, unknowns[:, locked.block.size : locked.motion] = after.branch, after.memory / locked.block.memory_scale
        speed = np.ones(len(zc))
        if "frequency" in column:
            late = SPEED * np.angle(signal) / (2.0 * math.pi) * at_frequency
            middle = middle + pole * late
            frequency = np.clip(middle + late, SLOWEST * offset, FASTEST * offset)
            unknowns[:, column["frequency"]], speed = (frequency - offset) / unit, at_frequency / frequency
        if "drive" in column:
            short = SPEED * (1.0 - np.abs(signal))
            push = push + short
            unknowns[:, column["drive"]] = push + short / pole - 1.0
        unknowns[:, : locked.block.size] = after.x * kernel.units_of(example, np.ones(len(zc)), speed)
    return unknowns, branch


def candidates(known: Known, check_cancelled: CancelCheck) -> Iterator[LockedOrbit]:
    """Give the states to which controllers lead motions of several amplitudes and phases, for ``search``.

    They are stable under fast controllers, see `settled`; curves lead from them to unstable ones. No sum of indices proves that
    all are found.
    """
    among: Any = known.among
    assert isinstance(among, LockedRange)
    check_cancelled()
    guess, branch = settled(among.locked, *_starts(among.locked, known.value))
    there = np.flatnonzero(np.isfinite(guess).all(axis=1))
    found = among.locked.newton(guess[there], branch[there])
    for i in np.flatnonzero(found.good).tolist():
        yield among.on_curve(found.take([i]))


def _starts(locked: Locked, at: float) -> tuple[Array, Array]:
    """Return unknowns of free motions at a scaled distance, on each branch of the forces, and these branches."""
    integrator = locked.block.integrator(0, locked.reference)
    lags = [math.degrees(locked.lock.phase)] if "phase" in locked.held else LAGS
    states = of_amplitudes(integrator, at * locked.length, lags)
    branches = np.array(list(product((0.0, 1.0), repeat=states.branch.shape[1])))
    unknowns = np.zeros((len(states), len(locked.weights)))
    unknowns[:, : locked.motion] = states.vectors(locked.block.memory_scale)
    unknowns[:, -1] = at
    return np.tile(unknowns, (len(branches), 1)), np.repeat(branches, len(states), axis=0)
