"""How far each unknown may be off to either side, by how chi2 rises there.

The covariance takes the model for a straight line. Where the branch of free motion ends just behind its last point the curve
is far steeper on one side of the best fit than on the other, and the covariance knows only the slope between them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import DForceError
from dforce.inverse.fitting.certainty import Certainty
from dforce.inverse.fitting.folds import fold_beside
from dforce.inverse.fitting.minimize import Minimum, Objective
from dforce.inverse.fitting.model import CurveModel, allowed
from dforce.inverse.fitting.profile import Way, end_of
from dforce.inverse.fitting.unknowns import NUISANCE, limits

SURE = 1.96  # standard deviations of an interval of 95 %
WIDEST = 1.0  # of a logarithm: farthest place where chi2 is asked for
UNEVEN = 0.05  # of 1.96 errors of the covariance: ends of intervals farther from there are asked for
PROFILED = (
    0.25  # the same: ends farther away still are found by minimizing chi2, where its rise there is not as expected
)
BENT = 0.5  # of the root of the distance from a fold: the same for steps that change it by more
MOST = 4.0  # times the error of the covariance: chi2 that rises so slowly tells no end


@dataclass(frozen=True)
class Sides:
    """How far below and above the best each unknown may be (of what is varied), (unknowns,).

    Attributes
    ----------
    low, high
        One standard deviation.
    low_95, high_95
        An interval of 95 %.
    """

    low: Array
    high: Array
    low_95: Array
    high_95: Array

    def joined(self, other: Sides, apart: Array) -> Sides:
        """Return the sides of a minimum and another one, so far away, as those of the first; NaN: it is too high for them."""
        mine, others = (
            (self.low, self.high, self.low_95, self.high_95),
            (other.low, other.high, other.low_95, other.high_95),
        )
        return Sides(
            *(
                np.where(np.isnan(one), np.nan, np.fmax(one, ends + way))
                for one, ends, way in zip(mine, others, (-apart, apart, -apart, apart), strict=True)
            )
        )


def not_excluded(minima: Sequence[Minimum]) -> list[Minimum]:
    """Return the minima that an interval of 95 % covers, the lowest first: no point is lost there, unless at the lowest."""
    best = minima[0]
    return [one for one in minima if one is best or (one.chi2 - best.chi2 < SURE**2 and not one.lost)]


def plain_sides(certain: Certainty) -> Sides:
    """Return the sides that the covariance gives."""
    errors = certain.errors
    return Sides(errors, errors, SURE * errors, SURE * errors)


def sides_of(
    model: CurveModel, best: Minimum, by: Array, certain: Certainty, floor: float, on_run: Callable[[Objective], None]
) -> Sides | Minimum:
    """Return the sides of all unknowns, or a lower minimum where one is met.

    Chi2 is asked for at 1.96 errors of the covariance and halfway, with the other unknowns where they lower it most: first
    along the covariance, then one step of Gauss and Newton beside it. Where it rises unevenly, it is asked for once more where
    it seems to have risen by 3.84. All these curves are followed at once. Where that still differs from the covariance, or
    points are lost on the way, chi2 is minimized over the others.

    Parameters
    ----------
    model, best, by, certain
        The minimum, with the derivatives of all residuals there, and the covariance.
    floor
        The chi2 above which rises count: that of the lowest minimum.
    """
    errors = certain.errors
    moving = certain.seen & np.isfinite(errors) & (errors > 0.0)
    if best.prediction is None or not model.curves.is_smooth or not moving.any():
        return plain_sides(certain)
    root = math.sqrt(certain.inflation)
    which = np.repeat(np.flatnonzero(moving), 2)
    side = np.tile([-1.0, 1.0], int(moving.sum()))
    is_log = np.array([one.is_log for one in model.unknowns])
    step = np.where(is_log, np.minimum(SURE * errors / root, WIDEST), SURE * errors / root)[which]
    fold = fold_beside(model, by)
    beside_fold = by if fold is None else fold.columns(by)
    along, ahead = np.empty((len(which), len(errors))), []
    for row, i in enumerate(which.tolist()):
        mine = by if fold is None or i == fold.height else beside_fold
        ahead.append(_rest(mine, moving, i))
        along[row] = -ahead[row] @ mine[:, i] * (side * step)[row]
        along[row, i] = (side * step)[row]

    def moved(rows: Any, steps: Array) -> Array:
        return np.stack(
            [
                best.varied + one if fold is None or which[row] == fold.height else fold.moved(best.varied, one)
                for row, one in zip(rows, steps, strict=True)
            ]
        )

    every = range(len(which))
    residuals = _residuals(model, moved(every, along))
    beside = -np.einsum("cur,cr->cu", np.stack(ahead), np.nan_to_num(residuals))
    places = np.concatenate([moved(every, along + beside), moved(every, 0.5 * along + 0.25 * beside)])
    chi2 = (residuals**2).sum(axis=1)
    chi2_far, chi2_half = (_residuals(model, places) ** 2).sum(axis=1).reshape(2, -1)
    shares = np.tile([0.5, 1.0, np.nan], (len(which), 1))  # of the steps, and chi2 there
    lowest = np.stack([chi2_half, np.fmin(chi2, chi2_far), np.full(len(which), np.nan)], axis=1)
    before = math.sqrt(max(best.chi2 - floor, 0.0))

    def reaches(level: float) -> Array:
        rises = np.sqrt(np.maximum(lowest - floor, 0.0))
        rows = zip(shares * step[:, None], rises, errors[which] / root, strict=True)
        return np.array([_reach(level, before, *row) for row in rows])

    share = reaches(SURE) / step
    more = np.flatnonzero((np.abs(share - 1.0) > UNEVEN) & np.isfinite(lowest[:, 1]))
    shares[more, 2] = share[more]
    away = share[more, None]
    if len(more):
        there = moved(more.tolist(), away * along[more] + away**2 * beside[more])
        lowest[more, 2] = (_residuals(model, there) ** 2).sum(axis=1)
    share = reaches(SURE) / step
    both = {level: reaches(level) for level in (1.0, SURE)}
    known = np.isfinite(lowest[:, :2]).all(axis=1) & (np.isfinite(lowest[:, 2]) | np.isnan(shares[:, 2]))
    if fold is not None:  # no straight line in the root leads so far
        known &= (which == fold.height) | (np.abs(along[:, fold.height]) < BENT * fold.root)
    met = np.abs(np.sqrt(np.maximum(lowest[:, 2] - floor, 0.0)) - SURE) < PROFILED * SURE
    # the offsets of a measurement move curves straight on: their covariance is right
    asked = np.array([one.prior is None and one.name.removesuffix("_2") not in NUISANCE for one in model.unknowns])
    for row in np.flatnonzero(asked[which] & (~known | ((np.abs(share - 1.0) > PROFILED) & ~met))).tolist():
        others = np.flatnonzero(moving & (np.arange(len(moving)) != which[row])).tolist()
        first = moved([row], along[[row]])[0]
        way = Way(int(which[row]), (first - best.varied) / step[row], others, float(step[row]))
        end = end_of(model, best, way, floor, on_run)
        if isinstance(end, Minimum):
            return end
        for level, reach in both.items():
            plain = level * float(errors[which[row]]) / root
            reach[row] = min(end.reach(level), max(MOST * plain, *end.ways))
            if math.inf in end.roots:  # a search may miss a state that exists
                reach[row] = max(reach[row], plain)
    out = []
    for level, reach in both.items():
        pair = np.stack([errors * level, errors * level])
        pair[(side > 0.0).astype(int), which] = root * reach
        out += list(pair)
    return Sides(*out)


def _rest(by: Array, moving: Any, index: int) -> Array:
    """Return the step of all unknowns but one that takes residuals away, (unknowns, residuals)."""
    out = np.zeros(by.T.shape)
    others = moving.copy()
    others[index] = False
    out[others] = np.linalg.pinv(by[:, others])
    return out


def _residuals(model: CurveModel, places: Array) -> Array:
    """Return all residuals at some places, (places, residuals); NaN beyond bounds, and where points are lost."""
    low, high = limits(model.unknowns)
    fine = np.array([bool((low <= row).all() and (row <= high).all()) and allowed(model, row) for row in places])
    priors = sum(one.prior is not None for one in model.unknowns)
    out = np.full((len(places), model.measured.size + priors), np.nan)
    if not fine.any():
        return out
    try:
        predicted = model.predict_many(places[fine])
    except DForceError:  # values that are allowed one by one may still not be solved side by side
        return out
    for row, place, one in zip(np.flatnonzero(fine), places[fine], predicted, strict=True):
        if not one.lost.any():
            out[row] = np.concatenate([model.residuals(one).ravel(), Objective(model, place).priors(place)])
    return out


def _reach(level: float, before: float, ways: Array, rises: Array, error: float) -> float:
    """Return how far the root of the rise of chi2 comes to a level, from its values at some distances, NaN where not known.

    It goes on straight beyond. Without the first two values the distance is that of the covariance. `before` is the root of
    the rise at no distance: where it is above the level, the distance is NaN.
    """
    if before > level:
        return math.nan
    if not np.isfinite(rises[:2]).all():
        return level * error
    known = np.isfinite(rises)
    order = np.argsort(ways[known])
    ways = np.concatenate([[0.0], ways[known][order]])
    rises = np.maximum.accumulate(np.concatenate([[before], rises[known][order]]))
    if level <= rises[-1]:
        found = float(np.interp(level, rises, ways))
    else:
        steep = (rises[-1] - rises[-2]) / (ways[-1] - ways[-2])
        found = float(ways[-1] + (level - rises[-1]) / steep) if steep > 0.0 else math.inf
    return min(found, MOST * level * error)
