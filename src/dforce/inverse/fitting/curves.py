"""The branches of a case at measured heights, as arrays, and how they change with parameters.

A branch is followed quasi-statically, as in an experiment, and never across a jump: the points behind its end are lost. The
derivatives by a parameter follow from the orbits by the implicit function theorem. With the period map P(x, p) and its
monodromy matrix M the orbit moves by (1 - M)^-1 dP/dp. Its own neighbors, one Newton step beside it, are measured, so no other
curve is followed and none can leave its branch. With memory or hysteresis of a force, curves on both sides are followed
instead.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Bools, Indices
from dforce.core.errors import ParameterError
from dforce.inverse.fitting.edges import over_edges, past_stability
from dforce.inverse.fitting.points import BEHIND_JUMP, FROM_FREE
from dforce.observables.averaging import weights
from dforce.observables.complex_numbers import phase_lag
from dforce.observables.finish import finish_each
from dforce.problem import Problem
from dforce.solvers import SolverSettings
from dforce.solvers.block import Block
from dforce.solvers.blocks import block_type
from dforce.solvers.integrator import sample_count
from dforce.solvers.period_map import MOTION
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.quasi_static import Stretch
from dforce.solvers.quasi_static_walk import AT_ONCE
from dforce.solvers.settling import apart, polished, remeasured, settled
from dforce.solvers.states import States

FAR = 1.15  # of the free amplitude: from there on the branch of free motion is followed
AS_MEASURED = 0.1  # of the free amplitude: a stable state so near to the measured motion behind a jump is that motion
PREDICTED = 1e-2  # of the free amplitude: an orbit so near to its prediction continues the one before
SAME_HEIGHT = 1e-14  # m: points so near to each other lie at one height, which is followed once
BESIDE_END = 2e-5  # of the free amplitude: the chord between the end of a branch and this far before it goes on beyond


@dataclass(frozen=True)
class BranchPoints:
    """Points on one branch: their places in the data, and their heights (m) in the order in which they are followed."""

    kind: int
    places: Any
    heights: Array
    amplitude: Array
    phase: Array

    @functools.cached_property
    def which_height(self) -> Indices:
        """Number of the height of each point: approach and retract often have the same heights."""
        return np.cumsum(np.diff(np.round(self.heights / SAME_HEIGHT), prepend=np.nan) != 0.0) - 1

    @property
    def distinct(self) -> Indices:
        """The first point at each height."""
        return np.unique(self.which_height, return_index=True)[1]


@dataclass
class SolvedCurve:
    """The motions found for some problems at all points.

    Attributes
    ----------
    values
        Amplitudes (m), then phases (degrees), (problems, points, 2 tones).
    lost
        Where a branch has no such state, (problems, points); values go on there along a steep straight line.
    short
        How far each branch ends before its last point (m), 0 where it does not, (problems, branches).
    states, monodromy, at
        The orbits, for `ModelBranches.slopes`: (problems, points, size), (problems, points, size, size), (problems, points).
    """

    values: Array
    lost: Bools
    short: Array
    x: Array
    memory: Array
    branch: Array
    monodromy: Array
    at: Array


class ModelBranches:
    """The branches of problems that differ in numbers only, at the same measured heights.

    Parameters
    ----------
    problem
        One of them.
    stretches
        The points to follow.
    settings
        Settings for the orbits; the samples per period are `problem`'s, times `finer`.
    tones
        Number of tones that are read, from the first on.
    """

    def __init__(
        self,
        problem: Problem,
        stretches: Sequence[BranchPoints],
        settings: SolverSettings,
        tones: int,
        finer: int = 1,
        check_cancelled: Callable[[], None] | None = None,
    ) -> None:
        if settings.method != "periodic":
            settings = SolverSettings(points_per_period=settings.points_per_period)
        self.settings, self.stretches = settings, list(stretches)
        self.check_cancelled = check_cancelled or (lambda: None)
        self.samples = finer * sample_count(problem, settings)
        self.count = sum(len(stretch.heights) for stretch in stretches)
        self.tones, self.columns = tones, 2 * tones
        block = self._block([problem])
        if not block.repeats_together:
            raise ParameterError(
                "the tones' frequencies have no common period of up to 200 periods of the first tone; a fit follows "
                "periodic motions, so choose a simple ratio, such as 6.2"
            )
        self.is_smooth = block.is_smooth

    def _block(self, problems: Sequence[Problem]) -> Block:
        batch = ProblemBatch.of(problems)
        block = block_type(self.settings)(
            batch,
            lambda case, zc: (problems[case].at_height(zc), zc),
            self.settings,
            1,
            self.samples,
            self.check_cancelled,
        )
        block.predicted, block.wanted = PREDICTED, MOTION
        return block

    def solve(self, problems: Sequence[Problem], offsets: Array, turns: Array) -> SolvedCurve:
        """Return the branches of some problems.

        Parameters
        ----------
        problems, offsets
            The problems, and the offset of the measured heights of each (m).
        turns
            Offsets of the measured phases (degrees), to recognize motions behind a jump, (tones,).
        """
        block = self._block(problems)
        out = self._empty(block, problems, offsets)
        for number, stretch in enumerate(self.stretches):
            self._follow(block, stretch, offsets, turns, out, out.short[:, number])
        return out

    def _empty(self, block: Block, problems: Sequence[Problem], offsets: Array) -> SolvedCurve:
        """Return an empty result, filled with free motion."""
        cases, points, size = len(problems), self.count, block.size
        values = np.empty((cases, points, self.columns))
        for case, problem in enumerate(problems):
            at = [math.inf] if problem.heights is None else self._heights() + offsets[case]
            free = [free_response(problem.at_height(float(zc))) for zc in at]
            values[case] = np.concatenate([np.array(part)[:, : self.tones] for part in zip(*free, strict=True)], axis=1)
        return SolvedCurve(
            values,
            np.ones((cases, points), bool),
            np.full((cases, len(self.stretches)), np.inf),
            np.full((cases, points, size), np.nan),
            np.full((cases, points, len(block.memory_scale)), np.nan),
            np.full((cases, points, block.hysteresis), np.nan),
            np.full((cases, points, size, size), np.nan),
            np.full((cases, points), np.nan),
        )

    def _follow(
        self, block: Block, stretch: BranchPoints, offsets: Array, turns: Array, out: SolvedCurve, short: Array
    ) -> None:
        every = np.arange(len(offsets))
        values = stretch.heights + offsets[:, None]
        first = values[:, 0]
        if stretch.kind == FROM_FREE:
            first = np.maximum(first, FAR * block.batch.example.tip_share * block.batch.length)
            start = _motions(block, block.batch.at_heights(first).free())
        else:
            start = _motions(block, moving(block.batch.at_heights(first), stretch.amplitude, stretch.phase - turns))
        found = polished(block, every, start, first)
        near = AT_ONCE if stretch.kind == FROM_FREE else AS_MEASURED
        good = (found.done == 1) & (apart(found.last_x, start.x) < near)
        begun = States.last_of(found)
        left = np.flatnonzero(~good)
        if len(left):
            _, found, sure, _ = settled(block, left, start.take(left), first[left])
            if stretch.kind == BEHIND_JUMP:
                sure &= self._are_behind(block, left, first[left], found.rows[:, 0])
            begun.put(left, States.last_of(found))
            good[left] = sure
        which = np.flatnonzero(good)
        if not len(which):
            return
        path = np.ascontiguousarray(values[which][:, stretch.distinct])
        found = block.follow(which, begun.take(which), first[which], path)
        if block.is_smooth:
            over_edges(block, which, found, path)
            past_stability(block, which, found, path)
        found = _at_each_point(found, stretch.which_height)
        last = States.last_of(found)
        ended = np.flatnonzero(found.done < values.shape[1])
        ends = np.zeros((len(which), self.columns))
        if len(ended):
            at = found.last_value[ended]
            rows, _, _ = remeasured(block, which[ended], last.take(ended), at, found.last_monodromy[ended])
            ends[ended] = self.read(block, which[ended], at, rows)
        for i, case in enumerate(which.tolist()):
            if self._keep(block, stretch, case, found.take(i), values[case], ends[i], out):
                short[case] = abs(values[case, -1] - found.last_value[i])

    def _keep(
        self,
        block: Block,
        stretch: BranchPoints,
        case: int,
        found: Stretch,
        values: Array,
        end: Array,
        out: SolvedCurve,
    ) -> bool:
        """Keep the points of one problem's branch, and its end if it ends before the last point.

        Return whether there are any.
        """
        done, places = int(found.done), stretch.places
        if done == 0:
            return False
        known = places[:done]
        cases = np.full(done, case)
        read = self.read(block, cases, values[:done], found.rows[:done])
        out.values[case, known], out.lost[case, known], out.at[case, known] = read, False, values[:done]
        out.x[case, known], out.monodromy[case, known] = found.x[:done], found.monodromy[:done]
        out.memory[case, known], out.branch[case, known] = found.memory[:done], found.branch[:done]
        if done < len(places):
            away = np.abs(values - found.last_value) / block.batch.length[case]
            end = end if np.isfinite(end).all() else read[-1]  # at a fold a Newton step may lead nowhere
            out.values[case, places[done:]] = beyond(end, read, away[:done], away[done:])
        return True

    def _are_behind(self, block: Block, cases: Any, at: Array, rows: Array) -> Any:
        """Return which motions, not near the measured one, are behind a jump: their phase is below the phase of free motion."""
        free = [free_response(block.problem(int(case), float(zc))[0])[1][0] for case, zc in zip(cases, at, strict=True)]
        return self.read(block, cases, at, np.nan_to_num(rows))[:, self.tones] < free

    def read(self, block: Block, cases: Any, at: Array, rows: Array) -> Array:
        """Return amplitudes (m) and phases (degrees) from measurements at some distances (m), (motions, 2 tones)."""
        even = weights(block.frequencies, block.common)
        found = finish_each(block.batch.example, 1, rows, even, *block.tables_of(cases, at))
        return np.concatenate([found["amplitude"][:, : self.tones], found["phase"][:, : self.tones]], axis=1)

    def slopes(
        self, above: Sequence[Problem], below: Sequence[Problem], shift: float, solved: SolvedCurve, turns: Array
    ) -> Array:
        """Return the difference of the curve above and below, (parameters, points, 2 tones).

        Parameters
        ----------
        above, below
            Problems to both sides of the solved problem, a pair for each parameter; the last is the problem itself, for the
            heights. A single problem below serves all.
        shift
            Shift of the heights for the last pair (m), up, and down if `below` has more than one problem.
        solved
            The solved curve of the problem.
        turns
            As of :meth:`solve`.
        """
        beside, shifts = [*above, *below], np.zeros(len(above) + len(below))
        shifts[len(above) - 1], shifts[-1] = shift, -shift if len(below) > 1 else 0.0
        values = (
            self._beside(beside, shifts, solved)
            if self.from_orbits(solved)
            else self._anew(beside, shifts, solved, turns)
        )
        return difference(values[: len(above)], values[len(above) :])

    def from_orbits(self, solved: SolvedCurve) -> bool:
        """Return whether derivatives follow from the orbits found; else curves beside them are followed anew."""
        return self.is_smooth and not bool(solved.lost.any())

    def _beside(self, beside: Sequence[Problem], shifts: Array, solved: SolvedCurve) -> Array:
        """Return the curves of problems, one Newton step beside the orbits of one problem."""
        block, times = self._block(beside), (len(beside), 1)
        which = np.repeat(np.arange(len(beside)), self.count)
        at = (solved.at[0] + shifts[:, None]).ravel()
        states = States(*(np.tile(part[0], times) for part in (solved.x, solved.memory, solved.branch)))
        rows, _, _ = remeasured(block, which, states, at, np.tile(solved.monodromy[0], (*times, 1)))
        return self.read(block, which, at, rows).reshape(len(beside), self.count, self.columns)

    def _anew(self, beside: Sequence[Problem], shifts: Array, solved: SolvedCurve, turns: Array) -> Array:
        """Return the same from curves that are followed anew."""
        offsets = solved.at[0] - self._heights()
        offset = float(np.nanmean(offsets)) if np.isfinite(offsets).any() else 0.0  # no point has a state there
        return self.solve(beside, offset + shifts, turns).values

    def _heights(self) -> Array:
        heights = np.empty(self.count)
        for stretch in self.stretches:
            heights[stretch.places] = stretch.heights
        return heights


def _at_each_point(found: Stretch, which_height: Indices) -> Stretch:
    """Return the values found at each height, one for each point there."""
    names = ("x", "memory", "branch", "monodromy", "rows", "residual", "steps")
    parts = {name: getattr(found, name)[:, which_height] for name in names}
    return found._replace(**parts, done=np.searchsorted(which_height, found.done))


def difference(above: Array, below: Array) -> Array:
    """Return above - below of amplitudes and phases, (..., 2 tones), phases within half a turn."""
    out = above - below
    tones = out.shape[-1] // 2
    out[..., tones:] = wrapped(out[..., tones:])
    return out


def wrapped(angle: Array) -> Array:
    """Return angles (degrees) within half a turn of 0."""
    return np.asarray((angle + 180.0) % 360.0 - 180.0)


def beyond(end: Array, known: Array, before: Array, behind: Array) -> Array:
    """Return values behind the end of a branch, (points, 2 tones).

    A measured state there shows that the branch of the sample does not end so early, so they leave the measured ones fast:
    along the chord that ends the branch. Beside a fold values change with the root of the distance from it.

    Parameters
    ----------
    end
        Values at the end, (2 tones,).
    known, before
        Values at points on the branch, (points, 2 tones), and how far before the end they are, in free amplitudes.
    behind
        How far behind the end the points are.
    """
    order = np.argsort(before)
    root = np.concatenate([[0.0], np.sqrt(before[order])])
    moved = np.concatenate([np.zeros((1, len(end))), difference(known[order], end)])
    chord = np.array([np.interp(math.sqrt(BESIDE_END), root, column) for column in moved.T])
    return np.asarray(end - behind[:, None] / BESIDE_END * chord)


def free_response(problem: Problem) -> tuple[Array, Array]:
    """Return amplitudes (m) and phases (degrees) of free motion as the detector reads them, (tones,) each."""
    phases = np.array([tone.phase for tone in problem.tones])
    turned = problem.detected_free * np.exp(-1j * (phases + np.array(problem.readout.turns or np.zeros(len(phases)))))
    return np.abs(turned), phase_lag(turned)


def moving(batch: ProblemBatch, amplitude: Array, phase: Array) -> Array:
    """Return scaled motions whose modes follow their tones with amplitudes (m) and lags (degrees), (problems, size)."""
    out = kernel.base_in_motion(batch.example, batch.tones)
    for j, tone in enumerate(batch.example.tones[: len(amplitude)]):
        turn = (amplitude[j] / batch.length) * np.exp(1j * (batch.tones[:, j, 1] - np.radians(phase[j])))
        out[:, 2 * tone.mode] += turn.real
        out[:, 2 * tone.mode + 1] -= turn.imag * batch.tones[:, j, 0]
    return np.asarray(out)


def _motions(block: Block, x: Array) -> States:
    """Return scaled motions as states with the forces' memory at rest."""
    count = len(x)
    return States(x, np.zeros((count, len(block.memory_scale))), np.zeros((count, block.hysteresis)))
