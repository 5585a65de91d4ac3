"""Operating points: the steady states in which a feedback holds the amplitude at a set point.

At each operating point the orbit and the average distance are unknown, and the equations are

    P(x, zc) = x,    A(x, zc) = s A0.

All orbits are followed along the distance side by side. The secant method finds the distance between the two points of a
curve on either side of the set point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from dforce.core.arrays import Array, Bools
from dforce.core.quantities import MOTION, REPEATS
from dforce.observables.averaging import common_period, weights
from dforce.observables.finish import first_ratios
from dforce.procedures.motion import rows_of, states_of
from dforce.procedures.statuses import statuses
from dforce.results.status import Status
from dforce.solvers.accuracy import assure
from dforce.solvers.block import Block
from dforce.solvers.blocks import side_by_side
from dforce.solvers.points import Points
from dforce.solvers.states import States
from dforce.solvers.transient import never_cancelled

if TYPE_CHECKING:
    from dforce.case import Case
    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.transient import CancelCheck

MOST_STEPS = 12  # of the secant method; from a curve of some hundred points it takes four
CLOSE = 1e-10  # of the free amplitude: how well the amplitude is met
NUDGE = 1e-4  # of the free amplitude: a first step along the distance, which gives the slope
LARGEST = 0.1  # of the free amplitude: longer steps are shortened
SHORTER = 0.4  # times a step on which the orbit is lost: the next one is at most so long
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
    zc, motions
        Average distances (m), and motions there in SI to start from, memory and branches of the forces included.
    """

    problems: Sequence[Problem]
    set_points: Array
    zc: Array
    motions: Array

    def take(self, which: Any) -> Wanted:
        """Return some of them."""
        return Wanted([self.problems[i] for i in which], self.set_points[which], self.zc[which], self.motions[which])


@dataclass
class OperatingPoints:
    """Operating points that were found.

    Attributes
    ----------
    found
        Whether a point was found, (points,).
    zc, motions
        Average distances (m), and motions at the start of a period in SI.
    columns
        Observables by name, (points, ...), NaN where there is none.
    status
        A status for each point.
    """

    found: Bools
    zc: Array
    motions: Array
    columns: dict[str, Array]
    status: np.ndarray[Any, np.dtype[np.int8]]


def solve(wanted: Wanted, settings: SolverSettings, harmonics: int, check_cancelled: CancelCheck) -> OperatingPoints:
    """Return the operating points near motions; a motion that ends at a fold before the set point has none."""
    count = len(wanted.problems)
    out = OperatingPoints(
        np.zeros(count, dtype=bool),
        wanted.zc.copy(),
        wanted.motions.copy(),
        {},
        np.full(count, Status.FAILED, dtype=np.int8),
    )
    for which, block in side_by_side(wanted.problems, settings, harmonics, check_cancelled):
        _Search(block, wanted.take(which)).write(out, which)
    return out


def at_value(
    cases: Sequence[Case], _name: str, value: float, near: Mapping[str, Array]
) -> tuple[dict[str, Array], Bools]:
    """Return the stable states of curves, a case for each, at an amplitude ratio, and where one was found.

    Parameters
    ----------
    near
        Guesses: "zc", the motion in SI, and the periods after which it repeats, states first.
    """
    problems, experiment, count = [case.problem for case in cases], cast(Any, cases[0].experiment), len(cases)
    common = [common_period([tone.frequency for tone in problem.tones]) for problem in problems]
    good = np.array(
        [period == repeats for period, repeats in zip(common, np.round(near[REPEATS]).tolist(), strict=True)]
    )
    some = np.flatnonzero(good)
    wanted = Wanted([problems[i] for i in some], np.full(len(some), value), near["zc"][some], near[MOTION][some])
    found = solve(wanted, cases[0].solver, experiment.harmonics, never_cancelled)
    good[some] = found.found
    length = np.array([problem.tones[0].A0 for problem in wanted.problems])
    out = {}
    for name, values in (found.columns | {"zc": found.zc, "zc_ratio": found.zc / length}).items():
        out[name] = np.full((count, *values.shape[1:]), np.nan)
        out[name][some] = values
    return out, good


class _Search:
    """The secant method for the distances of a block of problems."""

    def __init__(self, block: Block, wanted: Wanted) -> None:
        self.block, self.wanted = block, wanted
        self.length = block.batch.length
        self.zc = wanted.zc.copy()
        self.points = Points.empty(block, 1)
        scales, base = self._units()
        self.points.states.put((slice(None), 0), states_of(wanted.motions, block.batch.example, scales, base))
        self.points.steps[:], self.points.settling[:] = 0.0, 0.0
        self.miss: Array = np.full(len(self.zc), np.nan)  # amplitude ratio minus set point
        self.slope: Array = np.full(len(self.zc), np.nan)  # of the amplitude ratio by zc / A0
        self.longest = LARGEST * self.length

    def write(self, out: OperatingPoints, which: Any) -> None:
        """Find the points, and write them into their places."""
        everything = np.arange(len(self.zc))
        self._move(everything, self.zc)
        for nudge in (NUDGE, -NUDGE):  # a stretch without stable orbits may lie on one side
            some = np.flatnonzero(np.isnan(self.slope) & np.isfinite(self.miss))
            if len(some):
                self._move(some, self.zc[some] + nudge * self.length[some])
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
        states = self.points.states.take((slice(None), 0))
        out.motions[which] = rows_of(states, *self._units(), self.block.batch.example)
        status = statuses(self.points, self.block, self.zc[:, None])[:, 0]
        out.status[which] = np.where(near, status, Status.FAILED)
        for name, values in columns.items():
            if name not in out.columns:
                out.columns[name] = np.full((len(out.zc), *values.shape[2:]), np.nan)
            out.columns[name][which] = np.where(near.reshape(-1, *[1] * (values.ndim - 2)), values[:, 0], np.nan)

    def _units(self) -> tuple[Array, Array]:
        """Return the units of the numbers of scaled motions, and the part of each number that is the base's."""
        everything = np.arange(len(self.zc))
        return self.block.scales_of(everything, self.zc), self.block.base_of(everything, self.zc)

    def _step(self, which: Any, miss: Array) -> Array:
        longest = self.longest[which]
        with np.errstate(divide="ignore", invalid="ignore"):  # a slope of 0: the longest step
            step = self.length[which] * miss / self.slope[which]
        return np.asarray(np.clip(np.nan_to_num(step), -longest, longest))

    def _move(self, which: Any, to: Array, keep_slope: bool = False) -> None:
        """Follow orbits to other distances; a lost orbit stays, and its next step is shorter."""
        block, points = self.block, self.points
        found = block.follow(which, points.states.take((which, 0)), self.zc[which], to[:, None])
        there = found.done == 1
        even, (_, tones) = weights(block.frequencies, block.common), block.tables(self.zc[:, None])
        ratio = first_ratios(block.batch.example, found.rows[:, 0], even, tones[which])
        miss, step = ratio - self.wanted.set_points[which], to - self.zc[which]
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = (miss - self.miss[which]) / step * self.length[which]
        if not keep_slope:
            self.slope[which] = np.where(there & np.isfinite(slope), slope, self.slope[which])
        self.longest[which] = np.where(there, LARGEST * self.length[which], SHORTER * np.abs(step))
        moved = which[there]
        self.miss[moved], self.zc[moved] = miss[there], to[there]
        last = States.last_of(found)
        points.states.put((moved, 0), last.take(there))
        points.rows[moved], points.monodromy[moved] = found.rows[there], found.monodromy[there]
        points.residual[moved], points.error[moved] = found.residual[there], np.nan

    def _measured(self) -> dict[str, Array]:
        """Return the observables of the orbits, as accurate as asked for."""
        points, at = self.points, self.zc[:, None]
        points.cycles[:] = np.where(np.isfinite(points.residual), 1, -1)
        assure(self.block, at, points)
        return points.columns(self.block, at)
