"""A measured curve as a case predicts it, as a function of the unknowns, with its derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.case import Case
from dforce.case.paths import with_number
from dforce.core.arrays import Array, Bools
from dforce.core.errors import DForceError, ParameterError
from dforce.inverse.fitting.curves import BranchPoints, ModelBranches, SolvedCurve, wrapped
from dforce.inverse.fitting.points import BEHIND_JUMP, FROM_FREE, MeasuredPoints
from dforce.inverse.fitting.unknowns import CASE, HEIGHT, PHASE, SCALE, Unknown
from dforce.problem import Problem

ANEW = 100.0  # times the steps
FAR = 10.0  # times free amplitude and range of heights: how far from the sample an offset may put the nearest point


@dataclass(frozen=True)
class Prediction:
    """The model's prediction at some values of the unknowns.

    Attributes
    ----------
    values
        Amplitudes (m), then phases (degrees), as they would be measured, (points, 2 tones).
    lost
        Where the case has no such state, (points,).
    short
        How far each branch ends before its last point (m); 0 where it does not, (branches,).
    solved
        The orbits.
    """

    values: Array
    lost: Bools
    short: Array
    solved: SolvedCurve


class CurveModel:
    """The branches of a case at the heights of a measured curve.

    Parameters
    ----------
    case, unknowns
        The case, and the unknowns to vary.
    data
        The measured curve; its unused points are left out.
    finer
        Factor of the samples per period of the case.
    which
        Places of the points to model, among the used points; left out: all.
    """

    def __init__(
        self,
        case: Case,
        unknowns: Sequence[Unknown],
        data: MeasuredPoints,
        finer: int = 1,
        which: Any = None,
        check_cancelled: Callable[[], None] | None = None,
    ) -> None:
        self.case, self.unknowns, self.data = case, list(unknowns), data
        self.finer, self.check_cancelled = finer, check_cancelled
        used = np.flatnonzero(data.used)
        self.points = used if which is None else used[which]
        self.measured, self.sigma = data.values[self.points], data.spread[self.points]
        self.tones = data.tones
        stretches = [_stretch(data, self.points, kind) for kind in (FROM_FREE, BEHIND_JUMP)]
        self.stretches = [stretch for stretch in stretches if len(stretch.places)]
        self.curves = ModelBranches(case.problem, self.stretches, case.solver, self.tones, finer, check_cancelled)

    def problem(self, values: Array) -> Problem:
        """Return the problem at values of the unknowns.

        Raises
        ------
        DForceError
            For values that are not allowed, and an offset that leads far from the sample: no curve there shows where to.
        """
        case, heights, offset = self.case, self.data.height[self.data.used], self.sum_of(HEIGHT, values)
        if offset and abs(heights.min() + offset) > FAR * (case.problem.tones[0].A0 + np.ptp(heights)):
            raise ParameterError(f"zc_offset = {offset:g} m leads far away from the sample")
        for one, value in zip(self.unknowns, values, strict=True):
            if one.kind == CASE:
                case = with_number(case, one.path, float(value))
        return Problem.build(case.instrument, case.forces)

    def values(self, varied: Array) -> Array:
        """Return values (SI) of the unknowns from the varied numbers."""
        return np.array([one.value(number) for one, number in zip(self.unknowns, varied, strict=True)])

    def predict(self, varied: Array) -> Prediction:
        """Return the prediction of the model; all points are lost where no such problem exists."""
        return self.predict_many(varied[None])[0]

    def predict_many(self, varied: Array) -> list[Prediction]:
        """Return the same for many values side by side, (cases, unknowns).

        Raises
        ------
        DForceError
            When the values of one of them are not allowed.
        """
        values = [self.values(row) for row in varied]
        problems = [self.problem(row) for row in values]
        offsets = np.array([self.sum_of(HEIGHT, row) for row in values])
        # motions behind a jump start as measured: the offset of the first of these is as good as any
        solved = self.curves.solve(problems, offsets, self._turns(values[0]))
        return [self._prediction(solved, case, row) for case, row in enumerate(values)]

    def _prediction(self, solved: SolvedCurve, case: int, values: Array) -> Prediction:
        out = solved.values[case].copy()
        out[:, : self.tones] *= self._scales(values)
        out[:, self.tones :] += self._turns(values)
        alone = SolvedCurve(*(part[case : case + 1] for part in vars(solved).values()))
        return Prediction(out, solved.lost[case], solved.short[case], alone)

    def sum_of(self, kind: str, values: Array, tone: int = 0) -> float:
        """Return the sum of the values of one kind of unknown: the offset of the heights (m), or of a phase (degrees)."""
        mine = [one.kind == kind and one.tone == tone for one in self.unknowns]
        return float(sum(values[mine]))

    def _turns(self, values: Array) -> Array:
        return np.array([self.sum_of(PHASE, values, tone) for tone in range(self.tones)])

    def _scales(self, values: Array) -> Array:
        known = {one.tone: value for one, value in zip(self.unknowns, values, strict=True) if one.kind == SCALE}
        return np.array([known.get(tone, 1.0) for tone in range(self.tones)])

    def slopes(self, varied: Array, predicted: Prediction, both_sides: bool = True) -> Array:
        """Return the derivatives of the prediction by the varied numbers, (points, 2 tones, unknowns).

        They are differences to both sides, or to one: half the work, and as good for the search of a minimum.
        """
        values = self.values(varied)
        from_orbits = self.curves.from_orbits(predicted.solved)
        both_sides |= not self.curves.is_smooth
        # curves that are followed anew need longer steps
        steps = np.array([one.step * (1.0 if from_orbits else ANEW) for one in self.unknowns])
        of_case = [i for i, one in enumerate(self.unknowns) if one.kind == CASE]
        here = self.problem(values)
        beside = []
        for side in (1.0, -1.0) if both_sides else (1.0,):
            moved = varied + side * np.diag(steps)[of_case]
            beside.append([*(self.problem(self.values(row)) for row in moved), here])
        above, below = beside if both_sides else (*beside, [here])
        shift = next((s * one.scale for one, s in zip(self.unknowns, steps, strict=True) if one.kind == HEIGHT), 0.0)
        found = self.curves.slopes(above, below, float(shift), predicted.solved, self._turns(values))
        widths = 2.0 * steps if both_sides else steps
        scales = np.concatenate([self._scales(values), np.ones(self.tones)])
        out = np.zeros((*predicted.values.shape, len(self.unknowns)))
        for row, i in enumerate(of_case):
            out[:, :, i] = found[row] / widths[i] * scales
        for i, one in enumerate(self.unknowns):
            if one.kind == HEIGHT:
                out[:, :, i] = found[-1] / widths[i] * scales
            elif one.kind == PHASE:
                out[:, self.tones + one.tone, i] = one.scale
            elif one.kind == SCALE:
                out[:, one.tone, i] = predicted.values[:, one.tone]  # by the logarithm
        return out

    def priors(self, varied: Array) -> Array:
        """Return the deviations of the unknowns from their priors, in standard deviations."""
        known = [(one.prior, value) for one, value in zip(self.unknowns, self.values(varied), strict=True)]
        return np.array([(value - prior[0]) / prior[1] for prior, value in known if prior is not None])

    def residuals(self, predicted: Prediction) -> Array:
        """Return prediction minus measurement, in standard deviations, (points, 2 tones)."""
        out = predicted.values - self.measured
        out[:, self.tones :] = wrapped(out[:, self.tones :])
        return np.asarray(out / self.sigma)

    def all_residuals(self, varied: Array, predicted: Prediction) -> Array:
        """Return the residuals of the points, then the deviations of the unknowns from their priors, in standard deviations."""
        return np.concatenate([self.residuals(predicted).ravel(), self.priors(varied)])


def _stretch(data: MeasuredPoints, points: Any, kind: int) -> BranchPoints:
    """Return the points on one branch, in the order in which it is followed."""
    places = np.flatnonzero(data.branch[points] == kind)
    heights = data.height[points[places]]
    order = np.argsort(-heights if kind == FROM_FREE else heights, kind="stable")
    places, heights = places[order], heights[order]
    first = points[places[:1]]
    return BranchPoints(kind, places, heights, data.amplitude[first].ravel(), data.phase[first].ravel())


def allowed(model: CurveModel, varied: Array) -> bool:
    """Return whether a problem exists at some values of the unknowns."""
    try:
        model.problem(model.values(varied))
    except DForceError:
        return False
    return True
