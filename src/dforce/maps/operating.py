"""Operating points: the steady states in which a feedback holds the amplitude at a set point.

At each operating point the orbit and the average distance are unknown, and the equations are

    P(x, zc) = x,    A(x, zc) = s A0.

The orbit is followed along the distance, side by side with those of all other points, and the distance is found by the
secant method between the two points of a curve that lie on either side of the set point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Array, Bools
from dforce.observables.averaging import weights
from dforce.observables.finish import finish_each
from dforce.procedures.statuses import statuses
from dforce.results.status import Status
from dforce.solvers.accuracy import assure
from dforce.solvers.block import Block
from dforce.solvers.blocks import block_type
from dforce.solvers.integrator import sample_count
from dforce.solvers.points import Points
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.states import States

if TYPE_CHECKING:
    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.transient import CancelCheck

MOST_STEPS = 12  # of the secant method; from a curve of some hundred points it takes four
CLOSE = 1e-10  # of the free amplitude: how well the amplitude is met
NUDGE = 1e-4  # of the free amplitude: a first step along the distance, which gives the slope
LARGEST = 0.1  # of the free amplitude: longer steps are shortened
POLISH = 4  # times that the distance is corrected for the samples of a finer orbit


@dataclass
class Wanted:
    """Operating points that are sought: a problem, a set point, and a motion near it at some distance.

    Attributes
    ----------
    problems
        A problem for each point.
    set_points
        Shares of the free amplitudes.
    zc
        Average distances (m) of the motions.
    states
        Motions to start from, scaled, memory and branches of the forces included.
    """

    problems: Sequence[Problem]
    set_points: Array
    zc: Array
    states: States

    def take(self, which: Any) -> Wanted:
        """Return some of them."""
        return Wanted(
            [self.problems[i] for i in which], self.set_points[which], self.zc[which], self.states.take(which)
        )


@dataclass
class OperatingPoints:
    """Operating points that were found.

    Attributes
    ----------
    found
        Whether a point was found, (points,).
    zc
        Average distances (m).
    states
        Motions at the start of a period, scaled.
    columns
        Observables by name, (points, ...), NaN where there is none.
    status
        A status for each point.
    """

    found: Bools
    zc: Array
    states: States
    columns: dict[str, Array]
    status: np.ndarray[Any, np.dtype[np.int8]]


def solve(wanted: Wanted, settings: SolverSettings, harmonics: int, check_cancelled: CancelCheck) -> OperatingPoints:
    """Return the operating points near motions; those that end at a fold before the set point are not found."""
    count = len(wanted.problems)
    out = OperatingPoints(
        np.zeros(count, dtype=bool),
        wanted.zc.copy(),
        wanted.states.copy(),
        {},
        np.full(count, Status.FAILED, dtype=np.int8),
    )
    for which, samples in _alike(wanted.problems, settings):
        some = wanted.take(which)
        batch = ProblemBatch.of(some.problems)

        def at(case: int, zc: float, some: Wanted = some) -> tuple[Problem, float]:
            return some.problems[case], zc

        _Search(block_type(settings)(batch, at, settings, harmonics, samples, check_cancelled), some).write(out, which)
    return out


def _alike(problems: Sequence[Problem], settings: SolverSettings) -> list[tuple[Any, int]]:
    """Return the numbers of problems that march side by side: with the same samples, phases and ratios of their tones."""
    groups: dict[tuple[Any, ...], list[int]] = {}
    for number, problem in enumerate(problems):
        first = problem.tones[0].frequency
        samples = sample_count(problem, settings)
        tones = tuple((round(tone.frequency / first, 12), tone.phase) for tone in problem.tones)
        groups.setdefault((samples, tones), []).append(number)
    return [(np.array(numbers), key[0]) for key, numbers in groups.items()]


class _Search:
    """The secant method for the distances of a block of problems."""

    def __init__(self, block: Block, wanted: Wanted) -> None:
        self.block, self.wanted = block, wanted
        self.length = block.batch.length
        self.zc = wanted.zc.copy()
        self.points = Points.empty(block, 1)
        self.points.states.put((slice(None), 0), wanted.states)
        self.points.steps[:], self.points.settling[:] = 0.0, 0.0
        self.miss: Array = np.full(len(self.zc), np.nan)  # amplitude ratio minus set point
        self.slope: Array = np.full(len(self.zc), np.nan)  # of the amplitude ratio by zc / A0

    def write(self, out: OperatingPoints, which: Any) -> None:
        """Find the points, and write them into their places."""
        everything = np.arange(len(self.zc))
        self._move(everything, self.zc)
        self._move(everything, self.zc + NUDGE * self.length)
        for _ in range(MOST_STEPS):
            left = np.flatnonzero(np.abs(self.miss) > CLOSE)
            if not len(left):
                break
            self._move(left, self.zc[left] - self._step(left, self.miss[left]))
        columns = self._measured()
        for _ in range(POLISH):
            miss = columns["amplitude_ratio"][:, 0] - self.wanted.set_points
            left = np.flatnonzero(np.abs(miss) > CLOSE)
            if not len(left):
                break
            self._move(left, self.zc[left] - self._step(left, miss[left]), keep_slope=True)
            columns = self._measured()
        near = np.abs(columns["amplitude_ratio"][:, 0] - self.wanted.set_points) < 1e3 * CLOSE
        out.found[which], out.zc[which] = near, self.zc
        out.states.put(which, self.points.states.take((slice(None), 0)))
        status = statuses(self.points, self.block, self.zc[:, None])[:, 0]
        out.status[which] = np.where(near, status, Status.FAILED)
        for name, values in columns.items():
            if name not in out.columns:
                out.columns[name] = np.full((len(out.zc), *values.shape[2:]), np.nan)
            out.columns[name][which] = np.where(near.reshape(-1, *[1] * (values.ndim - 2)), values[:, 0], np.nan)

    def _step(self, which: Any, miss: Array) -> Array:
        longest = LARGEST * self.length[which]
        with np.errstate(divide="ignore", invalid="ignore"):  # a slope of 0: the longest step
            step = self.length[which] * miss / self.slope[which]
        return np.asarray(np.clip(np.nan_to_num(step), -longest, longest))

    def _move(self, which: Any, to: Array, keep_slope: bool = False) -> None:
        """Follow orbits to other distances; one that ends before is lost."""
        block, points = self.block, self.points
        branch = block.follow(which, points.states.take((which, 0)), self.zc[which], to[:, None])
        there = branch.done == 1
        numbers, tones = block.tables(self.zc[:, None])
        even = weights(block.frequencies, block.common)
        ratio = finish_each(block.batch.example, 1, branch.rows[:, 0], even, numbers[which], tones[which])[
            "amplitude_ratio"
        ]
        miss = np.where(there, ratio - self.wanted.set_points[which], np.nan)
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = (miss - self.miss[which]) / (to - self.zc[which]) * self.length[which]
        if not keep_slope:
            self.slope[which] = np.where(np.isfinite(slope), slope, self.slope[which])
        self.miss[which], self.zc[which] = miss, np.where(there, to, self.zc[which])
        last = States(branch.last_x, branch.last_memory, branch.last_branch)
        points.states.put((which[there], 0), last.take(there))
        points.rows[which], points.monodromy[which] = branch.rows, branch.monodromy
        points.residual[which] = np.where(there[:, None], branch.residual, np.nan)
        points.error[which] = np.nan

    def _measured(self) -> dict[str, Array]:
        """Return the observables of the orbits, as accurate as asked for."""
        points, at = self.points, self.zc[:, None]
        points.cycles[:] = np.where(np.isfinite(points.residual), 1, -1)
        assure(self.block, at, points)
        return points.columns(self.block, at)
