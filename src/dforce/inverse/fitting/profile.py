"""Errors found by going there: chi2 minimized over all other unknowns at values beside the best."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dforce.inverse.fitting.minimize import EXACT, Minimum, Objective
from dforce.inverse.fitting.model import Model
from dforce.inverse.fitting.unknowns import limits
from dforce.kernel import Array

STEPS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)  # of the error, to each side, until both levels are passed
ONE, MOST = 1.0, 3.84  # rise of chi2 at one standard deviation, and at 95 %
MOST_RUNS = 15  # of the model at each value
WIDEST = 1.0  # of the logarithm: longest step where the error is larger or not known


@dataclass(frozen=True)
class Profile:
    """Chi2 along one unknown.

    Attributes
    ----------
    varied, chi2
        What is varied, in order, and the least chi2 there.
    low, high
        How far below and above the best chi2 has risen by 1 (of what is varied); infinite where it does not.
    low_95, high_95
        The same for 3.84: an interval of 95 %.
    """

    varied: Array
    chi2: Array
    low: float
    high: float
    low_95: float
    high_95: float


def profile_of(model: Model, best: Minimum, index: int, error: float, on_run: Callable[[Objective], None]) -> Profile:
    """Return the profile of one unknown."""
    step = min(error, WIDEST) if math.isfinite(error) else WIDEST
    others = [i for i in range(len(best.varied)) if i != index]
    low, high = limits(model.unknowns)
    found = [(float(best.varied[index]), best.chi2)]
    for side in (-1.0, 1.0):
        last = best.varied
        for share in STEPS:
            start = last.copy()
            start[index] = best.varied[index] + side * share * step
            if not low[index] <= start[index] <= high[index]:
                break
            objective = Objective(model, start, others, on_run)
            if others:
                objective.minimize(EXACT, MOST_RUNS)
            else:
                objective.residuals(start[others])
            there = objective.best
            found.append((float(start[index]), there.chi2))
            last = there.varied
            if there.chi2 > best.chi2 + MOST:
                break
    found.sort()
    varied, chi2 = (np.array(column) for column in zip(*found, strict=True))
    at = [_reach(varied, chi2, best, index, level, side) for level in (ONE, MOST) for side in (-1.0, 1.0)]
    return Profile(varied, chi2, *at)


def _reach(varied: Array, chi2: Array, best: Minimum, index: int, level: float, side: float) -> float:
    """Return how far from the best chi2 has risen by so much, by its root, which is nearly straight."""
    mine = side * (varied - best.varied[index]) >= 0.0
    way, rise = side * (varied[mine] - best.varied[index]), np.sqrt(np.maximum(chi2[mine] - best.chi2, 0.0))
    order = np.argsort(way)
    way, rise = way[order], np.maximum.accumulate(rise[order])
    if rise[-1] < math.sqrt(level):
        return math.inf
    return float(np.interp(math.sqrt(level), rise, way))
