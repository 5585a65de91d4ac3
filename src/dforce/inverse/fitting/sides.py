"""The errors of each unknown to either side, by the rise of chi2 there.

The covariance takes the model for a straight line. If the branch of free motion ends just behind its last point, the curve is
far steeper on one side of the best fit than on the other. The covariance contains only the slope between them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Array, Bools, Indices
from dforce.core.errors import DForceError
from dforce.inverse.fitting.certainty import MOST, Certainty
from dforce.inverse.fitting.folds import fold_beside
from dforce.inverse.fitting.minimize import Minimum, Objective, jacobian
from dforce.inverse.fitting.model import CurveModel, allowed
from dforce.inverse.fitting.profile import ProfilePoint, Way, end_of, reach
from dforce.inverse.fitting.unknowns import limits

WIDEST = 1.0  # of a logarithm: farthest place where chi2 is asked for
UNEVEN = 0.05  # of the interval of the covariance: ends of intervals farther from there are asked for
BENT = 0.5  # of the root of the distance from a fold: no straight line leads so far in it
FARTHEST = 4.0  # times the error of the covariance: chi2 that rises so slowly has no end
BEYOND = 1.2  # times the farthest place where chi2 was sought: an end is extrapolated so far
MOST_STEPS = 6  # of Gauss and Newton beside each place
LEFT = 0.05  # of chi2: largest gain of another step at a minimum
STRAIGHT = ("A0", "phase_offset", "amplitude_scale")  # these scale or shift a curve: their covariance is right


class Sides(NamedTuple):
    """The errors of each unknown below and above the best (of the varied number), (unknowns,).

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
        """Return the joint sides of a minimum and another one at a distance `apart`; NaN: the other is too high for them."""
        each = zip(self, other, (-apart, apart, -apart, apart), strict=True)
        return Sides(*(np.where(np.isnan(mine), np.nan, np.fmax(mine, ends + way)) for mine, ends, way in each))


def not_excluded(minima: Sequence[Minimum], certain: Certainty) -> list[Minimum]:
    """Return the minima that an interval of 95 % covers, the lowest first: no point is lost there, unless at the lowest."""
    best, most = minima[0], certain.levels[1] ** 2
    return [one for one in minima if one is best or (one.chi2 - best.chi2 < most and not one.lost)]


def plain_sides(certain: Certainty) -> Sides:
    """Return the sides that the covariance gives."""
    one, most = (level * certain.errors for level in certain.levels)
    return Sides(one, one, most, most)


def sides_of(
    model: CurveModel, best: Minimum, by: Array, certain: Certainty, floor: float, on_run: Callable[[Objective], None]
) -> Sides | Minimum:
    """Return the sides of all unknowns, or a lower minimum where one is met.

    Chi2 is computed halfway to the interval of 95 % of the covariance and there, with the other unknowns at its minimum. They
    go first along the covariance, then by steps of Gauss and Newton beside it. If chi2 rises unevenly, it is computed once more
    at the expected end of the interval. All these curves are followed at once. If the steps do not end, or points are lost on
    the way, chi2 is minimized over the others.

    Parameters
    ----------
    model, best, by, certain
        The minimum, with the derivatives of all residuals there, and the covariance.
    floor
        The chi2 above which rises count: the lowest minimum's.
    """
    errors, (one, sure) = certain.errors, certain.levels
    moving = certain.seen & np.isfinite(errors) & (errors > 0.0)
    if not model.curves.is_smooth or not moving.any():
        return plain_sides(certain)
    root = math.sqrt(certain.inflation)
    ways = _Ways(model, best.varied, by, moving, sure * errors / root)
    which, step, along, every = ways.which, ways.step, ways.along, np.arange(len(ways.which))
    shares = np.tile([0.5, 1.0, np.nan], (len(which), 1))  # of the steps, at which chi2 is asked for
    lowest = np.full((len(which), 3), np.nan)
    lowest[:, 1], far = ways.eased(every, along)
    lowest[:, 0], _ = ways.eased(every, 0.5 * along + 0.25 * (far - along))
    lowest[ways.is_bent | ways.falls_on(lowest[:, 1], far)] = np.nan
    before = math.sqrt(max(best.chi2 - floor, 0.0))

    def reaches(level: float) -> Array:
        rises = np.sqrt(np.maximum(lowest - floor, 0.0))
        rows = zip(shares * step[:, None], rises, errors[which] / root, strict=True)
        return np.array([_reach(level, before, *row) for row in rows])

    share = reaches(sure) / step
    more = np.flatnonzero((np.abs(share - 1.0) > UNEVEN) & np.isfinite(lowest[:, 1]))
    shares[more, 2], away = share[more], share[more, None]
    lowest[more, 2], _ = ways.eased(more, away * along[more] + away**2 * (far - along)[more])
    both = {level: reaches(level) for level in (one, sure)}
    known = np.isfinite(lowest[:, :2]).all(axis=1) & (np.isfinite(lowest[:, 2]) | np.isnan(shares[:, 2]))
    asked = np.array([it.prior is None and it.name.removesuffix("_2") not in STRAIGHT for it in model.unknowns])
    for row in np.flatnonzero(asked[which] & ~known).tolist():
        others = np.flatnonzero(moving & (np.arange(len(moving)) != which[row])).tolist()
        first = ways.places(np.array([row]), along[[row]])[0]
        goal = math.sqrt(MOST) * certain.widening[1]
        way = Way(int(which[row]), (first - best.varied) / step[row], others, float(step[row]), goal)
        there = np.isfinite(lowest[row])
        rises = np.sqrt(np.maximum(lowest[row, there] - floor, 0.0))
        found = ProfilePoint((shares[row, there] * step[row]).tolist(), rises.tolist())
        end = end_of(model, best, way, floor, found, on_run)
        if isinstance(end, Minimum):
            return end
        for level, reached in both.items():
            plain = level * float(errors[which[row]]) / root
            reached[row] = min(end.reach(level), max(FARTHEST * plain, BEYOND * max(end.ways)))
            if math.inf in end.roots:  # a search may miss a state that exists
                reached[row] = max(reached[row], plain)
    out = []
    for level, reached in both.items():
        pair = np.stack([errors * level, errors * level])
        pair[(ways.side > 0.0).astype(int), which] = root * reached
        out += list(pair)
    return Sides(*out)


class _Ways:
    """Ways along each unknown to both sides of a minimum, beside a fold in its coordinates.

    Attributes
    ----------
    which, side, step
        The unknown, -1 or 1, and a step of it, (ways,).
    along
        The same step of all unknowns, the others where they lower chi2 most if the model is a straight line, (ways, unknowns).
    """

    def __init__(self, model: CurveModel, best: Array, by: Array, moving: Bools, steps: Array) -> None:
        self.model, self.best = model, best
        self.which = np.repeat(np.flatnonzero(moving), 2)
        self.side = np.tile([-1.0, 1.0], int(moving.sum()))
        is_log = np.array([one.is_log for one in model.unknowns])
        self.step = np.where(is_log, np.minimum(steps, WIDEST), steps)[self.which]
        self.fold = fold_beside(model, by)
        beside_fold = by if self.fold is None else self.fold.columns(by)
        self.by = np.stack([by if self._is_plain(i) else beside_fold for i in self.which.tolist()])
        # steps of all unknowns but one that take residuals away
        self.ahead = np.zeros((len(self.which), by.shape[1], by.shape[0]))
        self.along = np.zeros((len(self.which), by.shape[1]))
        for row, i in enumerate(self.which):
            others = moving & (np.arange(len(moving)) != i)
            self.ahead[row, others] = np.linalg.pinv(self.by[row][:, others])
            self.along[row] = -self.ahead[row] @ self.by[row][:, i]
            self.along[row, i] = 1.0
        self.along *= (self.side * self.step)[:, None]

    @property
    def is_bent(self) -> Bools:
        """Which ways change the root of the distance from a fold too much for straight lines."""
        if self.fold is None:
            return np.zeros(len(self.which), bool)
        height = self.fold.height
        return np.asarray((self.which != height) & (np.abs(self.along[:, height]) >= BENT * self.fold.root))

    def falls_on(self, chi2: Array, steps: Array) -> Bools:
        """Return at which steps, with a known chi2, the curve's own derivatives lead to a lower one, beside a fold.

        There the derivatives of the minimum are far too large on the side that leads away from the fold.
        """
        out = np.zeros(len(chi2), bool)
        for row in np.flatnonzero(np.isfinite(chi2)).tolist() if self.fold is not None else ():
            (place,) = self.places(np.array([row]), steps[[row]])
            predicted = self.model.predict(place)
            residuals = self.model.all_residuals(place, predicted)
            others = np.flatnonzero(self.ahead[row].any(axis=1))
            by = jacobian(self.model, place, predicted, both_sides=False)[:, others]
            off = by @ np.linalg.pinv(by) @ residuals
            out[row] = float(off @ off) > LEFT
        return out

    def _is_plain(self, index: int) -> bool:
        return self.fold is None or index == self.fold.height

    def places(self, rows: Indices, steps: Array) -> Array:
        """Return where steps along some ways lead, (rows, unknowns)."""
        out = [
            self.best + step
            if self.fold is None or self._is_plain(self.which[row])
            else self.fold.moved(self.best, step)
            for row, step in zip(rows, steps, strict=True)
        ]
        return np.array(out).reshape(len(rows), len(self.best))

    def eased(self, rows: Indices, steps: Array) -> tuple[Array, Array]:
        """Return the least chi2 at some steps, NaN where it is not found, and these steps with the others where it is."""
        chi2, left = np.full(len(rows), np.inf), np.full(len(rows), np.inf)
        going, steps, tried = np.arange(len(rows)), steps.copy(), steps.copy()
        for _ in range(MOST_STEPS):
            if not len(going):
                break
            residuals = _residuals(self.model, self.places(rows[going], tried[going]))
            here = np.nan_to_num((residuals**2).sum(axis=1), nan=np.inf)
            lower = here < chi2[going]
            going, residuals = going[lower], residuals[lower]
            beside = -np.einsum("cur,cr->cu", self.ahead[rows[going]], residuals)
            chi2[going], steps[going] = here[lower], tried[going]
            left[going] = (np.einsum("cru,cu->cr", self.by[rows[going]], beside) ** 2).sum(axis=1)
            tried[going] += beside
            going = going[left[going] > LEFT]
        return np.where(left <= LEFT, chi2, np.nan), steps


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
            out[row] = model.all_residuals(place, one)
    return out


def _reach(level: float, before: float, ways: Array, rises: Array, error: float) -> float:
    """Return how far the root of the rise of chi2 comes to a level, from its values at some distances, NaN where not known.

    `before` is the root of the rise at no distance; see :func:`reach`. Without the first two values the distance is the
    covariance's.
    """
    if before > level:
        return math.nan
    if not np.isfinite(rises[:2]).all():
        return level * error
    known = np.isfinite(rises)
    found = reach(level, np.concatenate([[0.0], ways[known]]), np.concatenate([[before], rises[known]]), chord=-2)
    return min(found, FARTHEST * level * error)
