"""How far each unknown may be off to either side, by how chi2 rises there.

The covariance takes the model for a straight line. Where the branch of free motion ends just behind its last point the curve
is far steeper on one side of the best fit than on the other, and the covariance knows only the slope between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.core.errors import DForceError
from dforce.inverse.fitting.certainty import Certainty
from dforce.inverse.fitting.minimize import Minimum, Objective
from dforce.inverse.fitting.model import Model, allowed
from dforce.inverse.fitting.unknowns import limits
from dforce.kernel import Array

SURE = 1.96  # standard deviations of an interval of 95 %
WIDEST = 1.0  # of a logarithm: farthest place where chi2 is asked for
UNEVEN = 0.05  # of 1.96 errors of the covariance: ends of intervals farther from there are asked for
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


def plain_sides(certain: Certainty) -> Sides:
    """Return the sides that the covariance gives."""
    errors = certain.errors
    return Sides(errors, errors, SURE * errors, SURE * errors)


def sides_of(model: Model, best: Minimum, by: Array, certain: Certainty) -> Sides:
    """Return the sides of all unknowns.

    Chi2 is asked for at 1.96 errors of the covariance and halfway, with the other unknowns where they lower it most: first
    along the covariance, then one step of Gauss and Newton beside it. Where it rises unevenly, it is asked for once more where
    it seems to have risen by 3.84. All these curves are followed at once.

    Parameters
    ----------
    model, best, by, certain
        The minimum, with the derivatives of all residuals there, and the covariance.
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
    covariance = np.nan_to_num(certain.covariance, posinf=0.0)
    along = (covariance[:, which] / covariance[which, which]).T * (side * step)[:, None]
    ahead = np.stack([_rest(by, moving, i) for i in which.tolist()])
    far = best.varied + along
    residuals = _residuals(model, far)
    beside = -np.einsum("cur,cr->cu", ahead, np.nan_to_num(residuals))
    places = np.concatenate([far + beside, best.varied + 0.5 * along + 0.25 * beside])
    chi2 = (residuals**2).sum(axis=1)
    chi2_far, chi2_half = (_residuals(model, places) ** 2).sum(axis=1).reshape(2, -1)
    shares = np.tile([0.5, 1.0, np.nan], (len(which), 1))  # of the steps, and chi2 there
    lowest = np.stack([chi2_half, np.fmin(chi2, chi2_far), np.full(len(which), np.nan)], axis=1)

    def reaches(level: float) -> Array:
        rises = np.sqrt(np.maximum(lowest - best.chi2, 0.0))
        rows = zip(shares * step[:, None], rises, errors[which] / root, strict=True)
        return np.array([_reach(level, *row) for row in rows])

    share = reaches(SURE) / step
    more = np.flatnonzero((np.abs(share - 1.0) > UNEVEN) & np.isfinite(lowest[:, 1]))
    shares[more, 2] = share[more]
    away = share[more, None]
    lowest[more, 2] = (_residuals(model, best.varied + away * along[more] + away**2 * beside[more]) ** 2).sum(axis=1)
    out = []
    for level in (1.0, SURE):
        reach = reaches(level)
        both = np.stack([errors * level, errors * level])
        both[(side > 0.0).astype(int), which] = root * reach
        out += list(both)
    return Sides(*out)


def _rest(by: Array, moving: Any, index: int) -> Array:
    """Return the step of all unknowns but one that takes residuals away, (unknowns, residuals)."""
    out = np.zeros(by.T.shape)
    others = moving.copy()
    others[index] = False
    out[others] = np.linalg.pinv(by[:, others])
    return out


def _residuals(model: Model, places: Array) -> Array:
    """Return all residuals at some places, (places, residuals); NaN where there is no problem, or beyond a bound."""
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
        out[row] = np.concatenate([model.residuals(one).ravel(), Objective(model, place).priors(place)])
    return out


def _reach(level: float, ways: Array, rises: Array, error: float) -> float:
    """Return how far the root of the rise of chi2 comes to a level, from its values at some distances, NaN where not known.

    It goes on straight beyond. Without the first two values the distance is that of the covariance.
    """
    if not np.isfinite(rises[:2]).all():
        return level * error
    known = np.isfinite(rises)
    order = np.argsort(ways[known])
    ways = np.concatenate([[0.0], ways[known][order]])
    rises = np.maximum.accumulate(np.concatenate([[0.0], rises[known][order]]))
    if level <= rises[-1]:
        found = float(np.interp(level, rises, ways))
    else:
        steep = (rises[-1] - rises[-2]) / (ways[-1] - ways[-2])
        found = float(ways[-1] + (level - rises[-1]) / steep) if steep > 0.0 else math.inf
    return min(found, MOST * level * error)
