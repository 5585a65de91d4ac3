"""The last steps to a minimum beside the end of a branch.

Beside a fold a curve changes with the root of its distance from the fold, and beyond the fold there is no such state. So the
steps are taken in that root, in place of the offset of the heights, and along the fold in all other unknowns. A measured point
shows that its branch reaches it: a place where a point is lost is left for the nearest one without.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.fitting.curves import BranchPoints
from dforce.inverse.fitting.minimize import Minimum, Objective, jacobian
from dforce.inverse.fitting.model import CurveModel, Prediction
from dforce.inverse.fitting.points import FROM_FREE
from dforce.inverse.fitting.unknowns import HEIGHT, limits

NEAR = 0.02  # of the free amplitude: folds farther behind the last point of a branch do not bend the curve
NEAREST = 1e-5  # of the free amplitude: how near to a fold the last point may be
MOST, MOST_BACK = 30, 6  # evaluations, and steps back to a place without lost points
DAMPING, LESS, MORE, LARGEST = 1e-3, 8.0, 8.0, 1e8  # of Levenberg and Marquardt, relative
ENOUGH = 1e-4  # of chi2: two steps that lower it by less are the last


@dataclass(frozen=True)
class Fold:
    """The fold nearest behind the last point of a branch.

    Attributes
    ----------
    height
        Place of the offset of the heights among the unknowns.
    side
        1 where a larger offset leads away from the fold, -1 where a smaller one does.
    root
        Root of the distance between the last point and the fold, in free amplitudes.
    along
        By how much the fold moves with each unknown, in offsets.
    """

    height: int
    side: float
    root: float
    along: Array

    def columns(self, by: Array) -> Array:
        """Return derivatives by the root, in the place of the height, and along the fold by all others."""
        out = by + np.outer(by[:, self.height], self.along)
        out[:, self.height] = by[:, self.height] * 2.0 * self.side * self.root
        return out

    def moved(self, varied: Array, step: Array) -> Array:
        """Return where a step in these coordinates leads; no step leads over the fold."""
        root = max(self.root + step[self.height], math.sqrt(NEAREST))
        out = np.asarray(varied + step)
        out[self.height] = varied[self.height] + self.along @ step + self.side * (root**2 - self.root**2)
        return out


def height_of(model: CurveModel) -> int | None:
    """Return the place of the offset of the heights among the unknowns."""
    return next((i for i, one in enumerate(model.unknowns) if one.kind == HEIGHT), None)


def fold_beside(model: CurveModel, by: Array) -> Fold | None:
    """Return the nearest fold, from the derivatives of all residuals by all unknowns; None where none is near.

    The inverse square of the slope over the height falls to zero at a fold like a straight line.
    """
    height = height_of(model)
    if height is None:
        return None
    rows = by[: model.measured.size].reshape(len(model.points), -1, by.shape[1])
    found: list[tuple[float, Fold]] = []
    for stretch in model.stretches:
        ends = stretch.distinct[-2:]
        if len(ends) < 2:
            continue
        less, steep = (np.abs(rows[place, :, height]).max() for place in stretch.places[ends])
        if not steep > less > 0.0:
            continue
        apart = abs(float(np.diff(stretch.heights[ends])[0])) / model.unknowns[height].scale
        distance = float(max(apart * less**2 / (steep**2 - less**2), NEAREST))
        if distance < NEAR:
            along = _along(rows[stretch.places[-1]], height)
            found.append((distance, Fold(height, _side(stretch), math.sqrt(distance), along)))
    return min(found, key=lambda one: one[0])[1] if found else None


def _side(stretch: BranchPoints) -> float:
    """Return 1 where larger heights lead away from the end of a branch, -1 where smaller ones do."""
    return 1.0 if stretch.kind == FROM_FREE else -1.0


def _along(rows: Array, height: int) -> Array:
    """Return the change of the height that makes up for each unknown, from derivatives at the end of a branch."""
    out = -(rows.T @ rows[:, height]) / float(rows[:, height] @ rows[:, height])
    out[height] = 0.0
    return np.asarray(out)


def reached(model: CurveModel, varied: Array, predicted: Prediction | None) -> Array | None:
    """Return the nearest heights at which the branches that end too early reach their last points; None without any."""
    height = height_of(model)
    if height is None or predicted is None or not np.isfinite(predicted.short).all():
        return None
    scale, out = model.unknowns[height].scale, varied.copy()
    for stretch, short in zip(model.stretches, predicted.short, strict=True):
        if short > 0.0:
            out[height] += _side(stretch) * (short / scale + NEAREST)
    return out


def lowest(objective: Objective) -> Minimum:
    """Return the minimum near the start of a search, by plain steps and, beside a fold, by steps along it."""
    return slide(objective, objective.minimize())


def slide(
    objective: Objective, start: Minimum, away: bool = False, most: int = MOST, enough: float = ENOUGH
) -> Minimum:
    """Return the minimum beside a fold that other steps have come near to.

    The start is returned where no fold is near, but for steps that go on `away` from folds, and where no place without lost
    points is near. The steps end after `most` evaluations, or two that lower chi2 by less than `enough`.
    """
    model, free = objective.model, np.array(objective.free)
    here = _Place.at(objective, _back(objective, start.varied))
    if here is None:
        return start
    damping, small, last = DAMPING, 0, objective.runs + most
    while objective.runs < last and small < 2:
        by = jacobian(model, here.varied, here.predicted, both_sides=False)
        fold = fold_beside(model, by)
        if fold is None and not start.lost and not away:
            break
        if height_of(model) not in objective.free:
            fold = None
        columns = (by if fold is None else fold.columns(by))[:, free]
        square, down = columns.T @ columns, -columns.T @ here.residuals
        found = None
        while found is None and damping < LARGEST and objective.runs < last:
            step = np.zeros(len(here.varied))
            step[free] = np.linalg.lstsq(square + damping * np.diag(np.diag(square)), down, rcond=None)[0]
            there = here.varied + step if fold is None else fold.moved(here.varied, step)
            found = _Place.at(objective, np.clip(there, *limits(model.unknowns)), below=here.chi2)
            damping *= MORE if found is None else 1.0 / LESS
        if found is None:
            break
        small = small + 1 if here.chi2 - found.chi2 < enough else 0
        here, damping = found, max(damping, 1e-9)
    if here.chi2 < start.chi2 or start.lost:
        return Minimum(here.varied, here.chi2, here.predicted)
    return start


def _back(objective: Objective, varied: Array) -> Array:
    """Return a place where all branches reach their last points, if there is one near, else one on the way there.

    The steps change the residuals of all other points least.
    """
    model, free = objective.model, objective.free
    height = height_of(model)
    for _ in range(MOST_BACK):
        predicted = objective.predict(varied)
        if height is None or predicted is None or not predicted.lost.any() or not np.isfinite(predicted.short).all():
            break
        if height in free and np.count_nonzero(predicted.short) == 1:
            moved = reached(model, varied, predicted)
            if moved is not None:
                objective.residuals(moved[free])
                there = objective.predict(moved)
                if there is not None and not there.lost.any():
                    return moved
        by = jacobian(model, varied, predicted, both_sides=False)
        rows = by[: model.measured.size].reshape(len(model.points), -1, by.shape[1])
        away = np.array([_side(part) * -_along(rows[part.places[-1]], height) for part in model.stretches])
        away[:, height] = [_side(part) for part in model.stretches]
        wanted = np.where(predicted.short > 0.0, predicted.short / model.unknowns[height].scale + NEAREST, 0.0)
        kept = np.concatenate([~np.repeat(predicted.lost, rows.shape[1]), np.ones(len(by) - model.measured.size, bool)])
        loose = np.linalg.pinv(by[kept][:, free].T @ by[kept][:, free])
        step = np.zeros(len(varied))
        step[free] = loose @ away[:, free].T @ np.linalg.pinv(away[:, free] @ loose @ away[:, free].T) @ wanted
        varied = np.clip(varied + step, *limits(model.unknowns))
    return varied


@dataclass(frozen=True)
class _Place:
    """A place without lost points."""

    varied: Array
    residuals: Array
    predicted: Prediction

    @property
    def chi2(self) -> float:
        return float(self.residuals @ self.residuals)

    @classmethod
    def at(cls, objective: Objective, varied: Array, below: float = math.inf) -> _Place | None:
        """Return a place, or that where its branches reach all points; None where there is none so low."""
        for _ in range(2):
            residuals, predicted = objective.residuals(varied[objective.free]), objective.predict(varied)
            if predicted is not None and not predicted.lost.any():
                return cls(varied, residuals, predicted) if float(residuals @ residuals) < below else None
            again = reached(objective.model, varied, predicted)
            if again is None or height_of(objective.model) not in objective.free:
                return None
            varied = again
        return None
