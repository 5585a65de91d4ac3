"""Steady states under controllers: two of the four numbers of a tone are held, the other two are found.

The equations are those of a periodic orbit, bordered by a row for each number that is held: the motion (with the forces'
memory) repeats after a common period, and the lock-in reads the amplitude and the phase of the set points. The unknowns are the
motion and those of frequency and drive that are not held. Unlike the orbit's own matrix, the bordered one is regular at the
folds of amplitude modulation, so a curve passes through bistable ranges without a jump.
"""

from __future__ import annotations

import contextlib
import math
from typing import NamedTuple

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Bools, Indices
from dforce.observables.finish import held_signals
from dforce.problem import Problem
from dforce.solvers.block import Block
from dforce.solvers.blocks import block_type
from dforce.solvers.period_map import ALL, MOTION
from dforce.solvers.settings import SolverSettings
from dforce.solvers.states import States
from dforce.solvers.transient import CancelCheck

BESIDE = 1e-6  # of the unknowns' units: neighbors that give derivatives
FOUND, FLOOR = 1e-9, 1e-8  # Newton step of a state that is found; of one where rounding lets no step be smaller
ROUGH = 1e-5  # Newton step of a state that is a guess for others
NEAR = 1e-7  # Newton step behind which the next one, with the same derivatives, is smaller than that
FARTHEST = 0.3  # of the free amplitude: longest Newton step
CONTRACTS = 0.3  # of the step before: the next one, or the derivatives are worked out again
MOST_MATRICES, MOST_STEPS = 6, 8  # of a search, and with the same derivatives
FIRST, LARGEST, SMALLEST = 0.1, 0.5, 1e-6  # of the free amplitude: steps along the distance
AIMED, ASTRAY = 0.05, 0.2  # how far from its prediction a state should be, and may be
SHRINK, GROWTH = 0.25, 2.5
FAR = (
    0.0,
    0.25,
    0.5,
    1.0,
    2.0,
    4.0,
    8.0,
    16.0,
    32.0,
)  # free amplitudes above the first distance: where a curve may begin


class Anchor(NamedTuple):
    """A state on the way along the distance: its unknowns, their derivatives by the distance (1/m), branches, and matrix."""

    zc: float
    unknowns: Array
    slope: Array
    branch: Array
    matrix: Array


class LockedStates(NamedTuple):
    """What was found, a row for each state.

    Attributes
    ----------
    zc
        Average distance (m).
    unknowns
        Scaled motion, the forces' memory over its scale, then of frequency and drive those that are not held, see `frequency`.
    branch
        The forces' branches.
    matrix
        Derivatives of the equations by the unknowns, and in the last column by the distance, in free amplitudes.
    good
        Whether it was found.
    """

    zc: Array
    unknowns: Array
    branch: Array
    matrix: Array
    good: Bools

    def take(self, which: Indices | Bools) -> LockedStates:
        """Return some of them."""
        zc, unknowns, branch, matrix, good = self
        return LockedStates(zc[which], unknowns[which], branch[which], matrix[which], good[which])


class Locked:
    """The locked states of one problem, along the distance.

    Parameters
    ----------
    problem
        A problem of one tone with a lock.
    """

    def __init__(
        self,
        problem: Problem,
        settings: SolverSettings,
        harmonics: int,
        check_cancelled: CancelCheck,
        points: int | None = None,
    ) -> None:
        [tone] = problem.tones
        assert tone.lock is not None
        self.problem, self.lock, self.reference = problem, tone.lock, tone.frequency
        kind, free = block_type(settings), problem.unlocked
        self.block: Block = kind.along_frequency(free, 0.0, tone.frequency, settings, harmonics, points)
        self.block.check_cancelled = check_cancelled
        self.length, self.width = tone.A0, 1.0 / max(mode.Q for mode in problem.modes)
        self.size, self.states = self.block.size, len(self.block.memory_scale)
        self.free = [name for name in ("frequency", "drive") if name not in self.lock.held]
        self.held = [name for name in ("amplitude", "phase") if name in self.lock.held]
        self.found = min(FOUND, 0.01 * (settings.accuracy or 1.0))
        self.near = NEAR / FOUND * self.found
        self._direction = 0.0

    def finer(self, times: int) -> Block:
        """Return the block with so many times the samples."""
        return self.block if times == 1 else self.block.finer(times * self.block.points)

    def frequency(self, unknowns: Array) -> Array:
        """Return the drive frequency (Hz) of states."""
        u = self._free_number(unknowns, "frequency", 0.0)
        return np.asarray(self.reference * (1.0 + self.width * u))

    def drive(self, unknowns: Array) -> Array:
        """Return the drive of states relative to that of the free lock."""
        return self._free_number(unknowns, "drive", 1.0)

    def _free_number(self, unknowns: Array, name: str, held: float) -> Array:
        if name not in self.free:
            return np.full(len(unknowns), held)
        return np.asarray(unknowns[:, self.size + self.states + self.free.index(name)])

    def motions(self, unknowns: Array, branch: Array) -> States:
        """Return the motions of states."""
        x, memory = unknowns[:, : self.size], unknowns[:, self.size : self.size + self.states]
        return States(x.copy(), memory * self.block.memory_scale, branch.copy())

    def march(
        self, zc: Array, unknowns: Array, branch: Array, times: int = 1, wanted: int = MOTION
    ) -> tuple[Array, Array, Array]:
        """Return how far the equations are from being met, the branches one period later, and what was measured."""
        block, at, ratio = self.finer(times), self.frequency(unknowns), self.drive(unknowns)
        before = self.motions(unknowns, branch)
        after, rows = block.driven(zc, before, at, ratio, wanted)
        base = np.zeros(len(zc), dtype=complex)
        if self.problem.shaken is not None:
            base = kernel.base_of(block.tables_driven(zc, at, ratio)[1])[:, 0]
        signal = held_signals(block.batch.example, rows[:, 0], base[:, None], self.lock.of_mode)[:, 0]
        turned = signal * np.exp(1j * self.lock.phase)
        missed = {"amplitude": np.abs(signal) - 1.0, "phase": np.angle(turned)}
        parts = [after.x - before.x, (after.memory - before.memory) / block.memory_scale]
        return np.concatenate([*parts, *(missed[name][:, None] for name in self.held)], axis=1), after.branch, rows

    def derived(self, zc: Array, unknowns: Array, branch: Array) -> tuple[Array, Array, Array]:
        """Return the same without what was measured, and the derivatives by unknowns and distance."""
        count, size = unknowns.shape
        each = size + 2
        beside, where = np.repeat(unknowns[:, None], each, axis=1), np.repeat(zc[:, None], each, axis=1)
        beside[:, range(1, size + 1), range(size)] += BESIDE
        where[:, size + 1] += BESIDE * self.length
        missed, after, _ = self.march(where.ravel(), beside.reshape(-1, size), np.repeat(branch, each, axis=0))
        missed = missed.reshape(count, each, size)
        by = np.moveaxis(missed[:, 1:] - missed[:, :1], 1, 2) / BESIDE
        return missed[:, 0], after[::each], by

    def newton(
        self, zc: Array, unknowns: Array, branch: Array, matrix: Array | None = None, rough: bool = False
    ) -> LockedStates:
        """Find the states near guesses, with guessed derivatives as far as they lead there.

        Rough states are guesses themselves.
        """
        enough = ROUGH if rough else self.found
        count, size = unknowns.shape
        out = LockedStates(
            zc, unknowns.copy(), branch.copy(), np.full((count, size, size + 1), np.nan), np.zeros(count, bool)
        )
        going = np.arange(count)
        for _ in range(MOST_MATRICES):
            if matrix is None:
                missed, after, out.matrix[going] = self.derived(zc[going], out.unknowns[going], out.branch[going])
            else:
                out.matrix[:], matrix = matrix, None
                missed, after, _ = self.march(zc, unknowns, branch)
            before, left, turned = np.full(len(going), np.inf), going, np.arange(len(going))
            again = []
            for _ in range(MOST_STEPS):
                step = -solved(out.matrix[left][:, :, :-1], missed)
                length = np.abs(step).max(axis=1)
                share = np.minimum(1.0, FARTHEST / np.maximum(length, 1e-300))
                fine = np.isfinite(length)
                out.unknowns[left[fine]] += (share[:, None] * step)[fine]
                same = (after == out.branch[left]).all(axis=1)
                out.branch[left] = after
                done = same & ((length < enough) | ((length < FLOOR) & (length > 0.5 * before[turned])))
                slow = fine & ~done & ((share < 1.0) | (length > CONTRACTS * before[turned]))
                out.good[left[done]] = True
                again.append(left[slow])
                before[turned] = length
                keep = fine & ~done & ~slow
                left, turned = left[keep], turned[keep]
                if not len(left):
                    break
                missed, after, _ = self.march(zc[left], out.unknowns[left], out.branch[left])
            going = np.concatenate([*again, left])
            if not len(going):
                break
        return out

    def is_stable(self, found: LockedStates) -> Bools:
        """Return which states are stable under ideal controllers, which pin the motion of the tone's own mode.

        Nothing else may grow from period to period: other modes, the fluid, the forces' memory. And no fold in the distance
        lies between the state and the free lock: there the mean deflection snaps, and the determinant changes its sign.
        """
        mode = self.problem.tones[0].mode
        rest = [i for i in range(self.size + self.states) if i // 2 != mode or i >= self.size]
        within = found.matrix[:, rest][:, :, rest] + np.eye(len(rest))
        with np.errstate(invalid="ignore"):
            sign = np.linalg.slogdet(found.matrix[:, :, :-1])[0]
        stable = np.asarray(sign == self._direction)
        if rest:
            stable[stable] = np.abs(np.linalg.eigvals(within[stable])).max(axis=1) < 1.0
        return stable

    def begin(self, zc: float, start: States) -> Anchor | None:
        """Return the state at a distance that an approach from far away leads to; None where it ends before."""
        rest = np.concatenate([start.x, start.memory / self.block.memory_scale], axis=1)
        guess = np.concatenate(
            [rest, np.tile([0.0 if name == "frequency" else 1.0 for name in self.free], (1, 1))], axis=1
        )
        for away in FAR:
            found = self.newton(np.array([zc + away * self.length]), guess, start.branch)
            if found.good[0] and np.abs(found.unknowns - guess).max() < ASTRAY:
                self._direction = float(np.linalg.slogdet(found.matrix[:, :, :-1])[0][0])
                first = self._anchor(found)
                return first if away == 0.0 else self.reach(first, zc)
        return None

    def _anchor(self, found: LockedStates) -> Anchor:
        """Return the only state as an anchor."""
        slope = -solved(found.matrix[:, :, :-1], found.matrix[:, :, -1])[0] / self.length
        return Anchor(float(found.zc[0]), found.unknowns[0], slope, found.branch[0], found.matrix[0])

    def reach(self, first: Anchor, zc: float) -> Anchor | None:
        """Return the state at a distance that leads there from another one; None where it ends before."""
        last = self.walk(first, zc)[-1]
        return last if last.zc == zc else None

    def walk(self, first: Anchor, stop: float) -> list[Anchor]:
        """Return states on the way from one of them to a distance, as far as they go on; the last one lies there exactly."""
        anchors, step = [first], FIRST * self.length
        while anchors[-1].zc != stop:
            last = anchors[-1]
            left = abs(stop - last.zc)
            length = left if step > 0.7 * left else step
            to = stop if length == left else last.zc + math.copysign(length, stop - last.zc)
            predicted = cubic(anchors[-2:], to) if len(anchors) > 1 else last.unknowns + (to - last.zc) * last.slope
            found = self.newton(np.array([to]), predicted[None], last.branch[None], rough=True)
            astray = float(np.abs(found.unknowns[0] - predicted).max())
            if not (found.good[0] and astray < ASTRAY and self.is_stable(found)[0]):
                step = SHRINK * length
                if step < SMALLEST * self.length:
                    return anchors
                continue
            anchors.append(self._anchor(found))
            step = min(LARGEST * self.length, length * min(GROWTH, max(SHRINK, (AIMED / max(astray, 1e-12)) ** 0.25)))
        return anchors

    def between(self, anchors: list[Anchor], zc: Array) -> LockedStates:
        """Find the states at distances between anchors; each guess is a cubic through the nearest two."""
        sign = 1.0 if anchors[-1].zc > anchors[0].zc else -1.0
        places = np.array([sign * one.zc for one in anchors])
        after = np.clip(np.searchsorted(places, sign * zc), 1, len(anchors) - 1)
        guess = np.array([cubic(anchors[i - 1 : i + 1], at) for i, at in zip(after.tolist(), zc.tolist(), strict=True)])
        matrix, branch = (np.array([getattr(one, name) for one in anchors]) for name in ("matrix", "branch"))
        share = ((zc - sign * places[after - 1]) / (sign * (places[after] - places[after - 1])))[:, None, None]
        found = self.newton(zc, guess, branch[after - 1], (1.0 - share) * matrix[after - 1] + share * matrix[after])
        found.good[:] &= (np.abs(found.unknowns - guess).max(axis=1) < ASTRAY) & self.is_stable(found)
        return found

    def along(self, first: Anchor, zc: Array) -> tuple[LockedStates, Anchor]:
        """Find the states at distances that rise or fall, from one at the first of them on; return the last one, too."""
        anchors = self.walk(first, float(zc[-1]))
        if len(anchors) == 1:
            anchors = [first, first._replace(zc=first.zc + SMALLEST * self.length)]
        found = self.between(anchors, zc)
        reached = np.abs(zc - first.zc) <= abs(anchors[-1].zc - first.zc)
        found.good[:] &= reached
        for i in np.flatnonzero(
            ~found.good & reached
        ).tolist():  # a guess between anchors led astray: go there by steps
            before = [one for one in anchors if abs(one.zc - first.zc) <= abs(zc[i] - first.zc)][-1]
            at = self.reach(before, float(zc[i]))
            if at is not None:
                one = self.newton(zc[i : i + 1], at.unknowns[None], at.branch[None])
                for whole, part in zip(found, one, strict=True):
                    whole[i] = part[0]
        return found, anchors[-1]

    def measured(self, found: LockedStates, times: int) -> Array:
        """Move states to where they are with so many times the samples; return what is measured, (states, periods, columns)."""
        step: Array = np.full(1, np.inf)
        for _ in range(MOST_STEPS):
            if times == 1 or not np.abs(step).max(initial=0.0) > self.near:
                break
            missed, found.branch[:], _ = self.march(found.zc, found.unknowns, found.branch, times)
            step = np.nan_to_num(-solved(found.matrix[:, :, :-1], missed))
            found.unknowns[:] += step
        return self.march(found.zc, found.unknowns, found.branch, times, ALL)[2]


def cubic(pair: list[Anchor], zc: float) -> Array:
    """Return the unknowns at a distance, on the cubic with the values and the slopes of two states."""
    first, second = pair
    span = second.zc - first.zc
    t = (zc - first.zc) / span
    out = first.unknowns + t * t * (3.0 - 2.0 * t) * (second.unknowns - first.unknowns)
    return np.asarray(out + span * t * (1.0 - t) * ((1.0 - t) * first.slope - t * second.slope))


def solved(matrix: Array, side: Array) -> Array:
    """Return the solutions of many systems of equations; NaN where there is none."""
    with contextlib.suppress(np.linalg.LinAlgError):
        return np.asarray(np.linalg.solve(matrix, side[:, :, None])[:, :, 0])
    out = np.full(side.shape, np.nan)
    regular = np.asarray(np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(side).all(axis=1))
    regular[regular] = np.abs(np.linalg.det(matrix[regular])) > 0.0
    out[regular] = np.linalg.solve(matrix[regular], side[regular, :, None])[:, :, 0]
    return out
