"""Steady states under controllers: two of the four numbers of a tone are held, the other two are found.

The equations of a periodic orbit are bordered by a row for each number that is held. The motion (with the forces' memory)
repeats after a common period, and the lock-in reads the amplitude and the phase of the set points. The unknowns are the motion
and the free numbers, frequency or drive. Unlike the orbit's own matrix, the bordered matrix is regular at the folds of
amplitude modulation, so a curve passes through bistable ranges without a jump. The parameter along which states are followed
is another unknown, and each state is sought in a plane: of a constant parameter, or across the curve.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Bools, Complexes
from dforce.observables.finish import held_signals
from dforce.problem import Problem
from dforce.solvers.block import Block
from dforce.solvers.blocks import block_type
from dforce.solvers.integrator import with_amplitudes
from dforce.solvers.newton import solve_each
from dforce.solvers.period_map import ALL, MOTION
from dforce.solvers.settings import SolverSettings
from dforce.solvers.states import States
from dforce.solvers.transient import CancelCheck

BESIDE = 1e-6  # of the unknowns' units: neighbors that give derivatives
FOUND, FLOOR = 1e-9, 1e-8  # Newton step of a state that is found; of one where rounding lets no step be smaller
ROUGH = 1e-5  # Newton step of a state that is a guess for others
NEAR = 0.3  # of the accuracy: Newton step behind which the next one, with the same derivatives, is much smaller
FARTHEST = 0.3  # of the free amplitude: longest Newton step
CONTRACTS = 0.3  # of the step before: the next one, or the derivatives are worked out again
MOST_MATRICES, MOST_STEPS = 6, 8  # of a search; of states that are moved to more samples
FIRST, LARGEST, SMALLEST = 0.1, 0.5, 1e-4  # of the free amplitude: steps along the distance
AIMED, ASTRAY = 0.003, 0.2  # how far from its prediction a state should be, and may be
SHRINK, GROWTH = 0.25, 2.5
FAR = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # free amplitudes above the first distance


class LockedStates(NamedTuple):
    """The states found, a row for each.

    Attributes
    ----------
    unknowns
        Scaled motion, the forces' memory over its scale, the free ones of frequency and drive, and the parameter of the curve;
        see :meth:`Locked.number`.
    branch
        The forces' branches.
    matrix
        Derivatives of the equations by the unknowns; the last row is normal to the plane in which the state was sought.
    good
        Whether it was found.
    """

    unknowns: Array
    branch: Array
    matrix: Array
    good: Bools

    def take(self, which: Any) -> LockedStates:
        """Return some of them."""
        unknowns, branch, matrix, good = self
        return LockedStates(unknowns[which], branch[which], matrix[which], good[which])

    @classmethod
    def joined(cls, parts: Sequence[LockedStates]) -> LockedStates:
        """Return the rows of several tables as one."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))

    @classmethod
    def lost(cls, like: LockedAnchor, count: int) -> LockedStates:
        """Return `count` rows without a state."""
        unknowns, branch, matrix = (np.full((count, *part.shape), np.nan) for part in like[:3])
        return cls(unknowns, branch, matrix, np.zeros(count, dtype=bool))


class LockedAnchor(NamedTuple):
    """A state on the way along a parameter, and how its unknowns change with the parameter."""

    unknowns: Array
    branch: Array
    matrix: Array
    slope: Array

    @property
    def at(self) -> float:
        """The parameter, scaled."""
        return float(self.unknowns[-1])


class Locked:
    """The locked states of one problem, along the distance or the frequency.

    Parameters
    ----------
    problem
        A problem of one tone with a lock.
    along
        The parameter: "zc" or "frequency".
    zc
        Average distance (m), where the frequency is the parameter.
    level
        Ratio of the amplitude to A0 as one more equation, where a drive is held: a set point, with the distance unknown.
    """

    def __init__(
        self,
        problem: Problem,
        settings: SolverSettings,
        harmonics: int,
        check_cancelled: CancelCheck,
        along: str = "zc",
        zc: float = 0.0,
        level: float | None = None,
    ) -> None:
        [tone] = problem.tones
        assert tone.lock is not None
        self.problem, self.lock, self.reference = problem, tone.lock, tone.frequency
        self.block: Block = block_type(settings).along_frequency(
            problem.unlocked, 0.0, tone.frequency, settings, harmonics
        )
        self.block.check_cancelled = check_cancelled
        self.length, width = tone.A0, 1.0 / max(mode.Q for mode in problem.modes)
        self.motion = self.block.size + len(self.block.memory_scale)
        self.free = [name for name in ("frequency", "drive") if name not in self.lock.held]
        self.held = [name for name in ("amplitude", "phase") if name in self.lock.held]
        self.held += ["amplitude"] if level is not None else []
        self.level = level or 1.0
        self.numbers = [*self.free, along]
        # the value of each number at 0, and its unit
        self.scales = {"zc": (zc, tone.A0), "frequency": (tone.frequency, width * tone.frequency), "drive": (1.0, 1.0)}
        self.weights = np.array([1.0] * self.motion + [width] * len(self.free) + [1.0])
        self.found = min(FOUND, 0.01 * (settings.accuracy or 1.0))
        self.near = NEAR * (settings.accuracy or ROUGH)
        self._direction = 0.0

    def finer(self, times: int) -> Block:
        """Return the block with `times` the samples."""
        return self.block if times == 1 else self.block.finer(times * self.block.points)

    def number(self, unknowns: Array, name: str) -> Array:
        """Return a number of states: "zc" (m), "frequency" (Hz), or "drive", relative to the free lock's drive."""
        offset, unit = self.scales[name]
        if name not in self.numbers:
            return np.full(len(unknowns), offset)
        return np.asarray(offset + unit * unknowns[:, self.motion + self.numbers.index(name)])

    def driven(self, unknowns: Array) -> list[Array]:
        """Return the distances (m), frequencies (Hz) and relative drives of states."""
        return [self.number(unknowns, name) for name in ("zc", "frequency", "drive")]

    def motions(self, unknowns: Array, branch: Array) -> States:
        """Return the motions of states."""
        x, memory = unknowns[:, : self.block.size], unknowns[:, self.block.size : self.motion]
        return States(x.copy(), memory * self.block.memory_scale, branch.copy())

    def march(self, unknowns: Array, branch: Array, times: int = 1, wanted: int = MOTION) -> tuple[Array, Array, Array]:
        """Return the residuals of the equations, the branches one period later, and the measurements."""
        block, before = self.finer(times), self.motions(unknowns, branch)
        zc, at, ratio = self.driven(unknowns)
        after, rows = block.driven(zc, before, at, ratio, wanted)
        signal = self.signal(unknowns, rows) * np.exp(1j * self.lock.phase)
        missed = {"amplitude": np.abs(signal) - self.level, "phase": np.angle(signal)}
        parts = [after.x - before.x, (after.memory - before.memory) / block.memory_scale]
        return np.concatenate([*parts, *(missed[name][:, None] for name in self.held)], axis=1), after.branch, rows

    def tables(self, unknowns: Array) -> tuple[Array, Array]:
        """Return the kernel's parameters and tone tables of states."""
        return self.block.tables_driven(*self.driven(unknowns))

    def signal(self, unknowns: Array, rows: Array) -> Complexes:
        """Return the reading of the lock-in, relative to the drive and in units of the set point."""
        base = np.zeros((len(rows), 1), dtype=complex)
        if self.problem.shaken is not None:
            base = kernel.base_of(self.tables(unknowns)[1])
        return np.asarray(held_signals(self.block.batch.example, rows[:, 0], base, self.lock.of_mode)[:, 0])

    def derived(self, unknowns: Array, branch: Array) -> tuple[Array, Array, Array]:
        """Return the same without the measurements, and the derivatives by the unknowns."""
        count, size = unknowns.shape
        beside = BESIDE * np.concatenate([np.zeros((1, size)), np.eye(size), -np.eye(size)])
        missed, after, _ = self.march(
            (unknowns[:, None] + beside).reshape(-1, size), np.repeat(branch, len(beside), axis=0)
        )
        missed = missed.reshape(count, len(beside), -1)
        by = np.moveaxis(missed[:, 1 : size + 1] - missed[:, size + 1 :], 1, 2) / (2.0 * BESIDE)
        return missed[:, 0], after[:: len(beside)], by

    def newton(
        self,
        unknowns: Array,
        branch: Array,
        matrix: Array | None = None,
        across: Array | None = None,
        enough: float | None = None,
    ) -> LockedStates:
        """Find the states near guesses, with guessed derivatives as far as they lead there.

        Parameters
        ----------
        across
            Normal of the plane through each guess in which a state is sought; left out: a constant parameter.
        enough
            Newton step of a state that is found.
        """
        enough, (count, size), rows = enough or self.found, unknowns.shape, self.motion + len(self.held)
        out = LockedStates(
            unknowns.copy(), branch.copy(), np.full((count, size, size), np.nan), np.zeros(count, dtype=bool)
        )
        out.matrix[:, -1] = np.eye(1, size, size - 1) if across is None else across
        if matrix is not None:
            out.matrix[:] = matrix
        going, before, stale, matrices = np.arange(count), np.full(count, np.inf), np.full(count, matrix is None), 0
        while len(going) and matrices < MOST_MATRICES:
            which = going[~stale[going]]
            if len(which):
                missed, after, _ = self.march(out.unknowns[which], out.branch[which])
            else:  # derivatives are worked out together
                which, matrices, before[going] = going, matrices + 1, np.inf
                missed, after, out.matrix[which, :rows] = self.derived(out.unknowns[which], out.branch[which])
            step = steps(out.matrix[which], missed)
            length, far = np.abs(step).max(axis=1), np.abs(step * self.weights).max(axis=1)
            share = np.minimum(1.0, FARTHEST / np.maximum(far, 1e-300))
            fine = np.isfinite(length)
            out.unknowns[which[fine]] += (share[:, None] * step)[fine]
            same = (after == out.branch[which]).all(axis=1)
            out.branch[which] = after
            done = same & ((length < enough) | ((length < FLOOR) & (length > 0.5 * before[which])))
            out.good[which[done]] = True
            stale[which] = (share < 1.0) | (length > CONTRACTS * before[which])
            before[which] = np.where(fine, length, -1.0)
            going = going[~out.good[going] & (before[going] >= 0.0)]
        return out

    def left_free(self, found: LockedStates) -> Array:
        """Return the derivative of the map over a period by the unknowns that ideal controllers, which pin the mode, leave."""
        mode, size = self.problem.tones[0].mode, self.block.size
        rest = [i for i in range(self.motion) if i // 2 != mode or i >= size]
        return found.matrix[:, rest][:, :, rest] + np.eye(len(rest))

    def is_stable(self, found: LockedStates) -> Bools:
        """Return which states are stable under ideal controllers.

        Nothing that they leave free may grow from period to period: other modes, the fluid, the forces' memory. And no fold
        lies between the state and the free lock: there the mean deflection snaps, and the determinant changes its sign.
        """
        within = self.left_free(found)
        with np.errstate(invalid="ignore"):
            sign = np.linalg.slogdet(found.matrix[:, :-1, :-1])[0]
        stable = np.asarray(sign == self._direction)
        if within.size:
            stable[stable] = np.abs(np.linalg.eigvals(within[stable])).max(axis=1) < 1.0
        return stable

    @property
    def free_motion(self) -> States:
        """The motion at the free lock."""
        integrator = self.block.integrator(0, self.reference)
        return States.of(with_amplitudes(integrator, integrator.problem.free))

    def begin(self, at: float) -> LockedAnchor | None:
        """Return the state at a distance (scaled) or far above it, from motion without forces; None where there is none."""
        guess, start = np.zeros((1, len(self.weights))), self.free_motion
        guess[:, : self.motion] = start.vectors(self.block.memory_scale)
        for away in FAR:
            guess[:, -1] = at + away
            found = self.newton(guess, start.branch)
            if found.good[0] and np.abs(found.unknowns - guess).max() < ASTRAY:
                self._direction = float(np.linalg.slogdet(found.matrix[:, :-1, :-1])[0][0])
                return self.anchor(found)
        return None

    def begin_at(self, other: Locked, found: LockedStates) -> LockedAnchor | None:
        """Return a state found along the distance as a state along the frequency, at the frequency of the case."""
        self._direction = other._direction
        guess = found.unknowns.copy()
        guess[:, -1] = 0.0
        here = self.newton(guess, found.branch)
        return self.anchor(here) if here.good[0] else None

    def anchor(self, found: LockedStates) -> LockedAnchor:
        """Return the only state as an anchor."""
        matrix = found.matrix[0]
        matrix[-1] = 0.0
        matrix[-1, -1] = 1.0
        slope = np.append(-np.linalg.solve(matrix[:-1, :-1], matrix[:-1, -1]), 1.0)
        return LockedAnchor(found.unknowns[0], found.branch[0], matrix, slope)

    def walk(self, first: LockedAnchor, stop: float) -> list[LockedAnchor]:
        """Return states on the way from one of them to a value, as far as they go on; the last one lies there exactly."""
        anchors, step = [first], FIRST
        while anchors[-1].at != stop:
            last = anchors[-1]
            left = abs(stop - last.at)
            length = left if step > 0.7 * left else step
            to = stop if length == left else last.at + math.copysign(length, stop - last.at)
            unknowns, _, _, slope = (np.array(part) for part in zip(*anchors[-2:], strict=True))
            predicted = hermite(unknowns[:, -1] - to, unknowns, slope)
            predicted[-1] = to
            found = self.newton(predicted[None], last.branch[None], enough=ROUGH)
            astray = float(np.abs((found.unknowns[0] - predicted) * self.weights).max())
            if not (found.good[0] and astray < ASTRAY and self.is_stable(found)[0]):
                step = SHRINK * length
                if step < SMALLEST:
                    return anchors
                continue
            anchors.append(self.anchor(found))
            step = min(LARGEST, length * min(GROWTH, max(SHRINK, (AIMED / max(astray, 1e-12)) ** 0.25)))
        return anchors

    def between(self, anchors: list[LockedAnchor], at: Array) -> LockedStates:
        """Find the states at values between anchors; each guess is a cubic through the nearest two."""
        if len(anchors) == 1:
            anchors = [*anchors, anchors[0]._replace(unknowns=anchors[0].unknowns + SMALLEST * anchors[0].slope)]
        unknowns, branch, matrix, slope = (np.array(part) for part in zip(*anchors, strict=True))
        sign = math.copysign(1.0, anchors[-1].at - anchors[0].at)
        after = np.clip(np.searchsorted(sign * unknowns[:, -1], sign * at), 1, len(anchors) - 1)
        pair = np.stack([after - 1, after])
        guess = hermite(unknowns[pair, -1] - at, unknowns[pair], slope[pair])
        guess[:, -1] = at
        share = ((at - unknowns[after - 1, -1]) / (unknowns[after, -1] - unknowns[after - 1, -1]))[:, None, None]
        mean = (1.0 - share) * matrix[after - 1] + share * matrix[after]
        found = self.newton(guess, branch[after - 1], mean, enough=self.near)
        astray = np.abs((found.unknowns - guess) * self.weights).max(axis=1)
        found.good[:] &= (astray < ASTRAY) & self.is_stable(found)
        for i in np.flatnonzero(~found.good).tolist():  # a guess between anchors led astray: go there by steps
            last = self.walk(anchors[after[i] - 1], float(at[i]))[-1]
            if last.at == at[i]:
                one = self.newton(last.unknowns[None], last.branch[None])
                for whole, part in zip(found, one, strict=True):
                    whole[i] = part[0]
        return found

    def measured(self, found: LockedStates, times: int) -> Array:
        """Move states to their places with so many times the samples; return the measurements, (states, periods, columns)."""
        step: Array = np.full(1, np.inf)
        for _ in range(MOST_STEPS):
            if times == 1 or not np.abs(step).max(initial=0.0) > self.near:
                break
            missed, found.branch[:], _ = self.march(found.unknowns, found.branch, times)
            step = np.nan_to_num(steps(found.matrix, missed))
            found.unknowns[:] += step
        return self.march(found.unknowns, found.branch, times, ALL)[2]


def hermite(at: Array, x: Array, slope: Array) -> Array:
    """Return the value at 0 of the polynomial with values x and slopes at some places, (places, ...), a row or more each."""
    nodes, table = np.repeat(at, 2, axis=0), np.repeat(x, 2, axis=0)
    out, factor = table[0], np.ones(at.shape[1:])
    for order in range(1, len(nodes)):
        run = (nodes[order:] - nodes[:-order])[..., None]
        table = np.where(run == 0.0, 0.0, np.diff(table, axis=0) / np.where(run == 0.0, 1.0, run))
        if order == 1:
            table[::2] = slope
        factor = -factor * nodes[order - 1]
        out = out + factor[..., None] * table[0]
    return np.asarray(out)


def steps(matrix: Array, missed: Array) -> Array:
    """Return the Newton steps of many states, each in its plane; NaN where there is none."""
    side = np.zeros((*matrix.shape[:2], 1))
    side[:, : missed.shape[1], 0] = -missed
    return solve_each(matrix, side)[:, :, 0]
