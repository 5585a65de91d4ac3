"""Errors found by going there: chi2 minimized over all other unknowns at values beside the best."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.fitting.certainty import Certainty
from dforce.inverse.fitting.folds import slide
from dforce.inverse.fitting.minimize import EXACT, ROUGH, Minimum, Objective
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.unknowns import limits

STEPS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)  # of the error, to each side, until both levels are passed
MOST_RUNS = 15  # of the model at each value
TRIES, MOST_STEPS = 5, 20  # values at which an end of an interval is sought, and evaluations at each
ROUGHLY = 0.01  # of chi2: two steps that lower it by less end the search for an end of an interval
HALFWAY = 0.5
CLOSE_ENOUGH = 0.15  # of the root of the rise: ends are interpolated from there
STUCK = 2.0  # times that root: a search that ends so high may have missed the least
LOWER = 0.05  # of chi2: a point so much lower is another minimum
WIDEST = 1.0  # of the logarithm: longest step where the error is larger or not known


@dataclass(frozen=True)
class Profile:
    """Chi2 along one unknown.

    Attributes
    ----------
    varied, chi2
        The varied number, in order, and the least chi2 there.
    ends
        Distances below and above the best (of the varied number) to the ends of the interval of 68 %, then of 95 %; infinite
        where chi2 does not rise so far.
    """

    varied: Array
    chi2: Array
    ends: list[float]


def profile_of(
    model: CurveModel, best: Minimum, index: int, certain: Certainty, on_run: Callable[[Objective], None]
) -> Profile:
    """Return the profile of one unknown."""
    error = float(certain.errors[index])
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
                there = slide(objective, objective.minimize(EXACT, MOST_RUNS))
            else:
                objective.residuals(start[others])
                there = objective.best
            found.append((float(start[index]), there.chi2))
            last = there.varied
            if there.chi2 > best.chi2 + certain.rises[1]:
                break
    found.sort()
    varied, chi2 = (np.array(column) for column in zip(*found, strict=True))
    away, roots = varied - best.varied[index], np.sqrt(np.maximum(chi2 - best.chi2, 0.0))
    ends = []
    for level in np.sqrt(certain.rises).tolist():
        for mine in (away <= 0.0, away >= 0.0):
            ends.append(reach(level, np.abs(away[mine]), roots[mine]) if roots[mine].max() >= level else math.inf)
    return Profile(varied, chi2, ends)


@dataclass(frozen=True)
class Way:
    """The way of one unknown from a minimum: its place, all unknowns along a unit of it, the free unknowns, a step.

    The goal is the root of the rise of chi2 at the end of the interval.
    """

    index: int
    along: Array
    others: list[int]
    step: float
    goal: float


@dataclass(frozen=True)
class ProfilePoint:
    """How far along one unknown chi2 was minimized over the others, and the root of its rise there; infinite: no state."""

    ways: list[float]
    roots: list[float]

    def reach(self, level: float) -> float:
        """Return how far the root comes to a level; see :func:`reach`."""
        return reach(level, np.array(self.ways), np.array(self.roots))


def reach(level: float, ways: Array, roots: Array, chord: int = 0) -> float:
    """Return how far the root of the rise of chi2 comes to a level, from its values at some distances; NaN if all are above.

    It ends where there is no state. Beyond the last place it goes on straight, by the chord from place `chord` on.
    """
    order = np.argsort(ways)
    ways, roots = ways[order], np.maximum.accumulate(roots[order])
    if level < roots[0]:
        return math.nan
    over = int(np.argmax(roots >= level)) if roots[-1] >= level else 0
    if over and math.isinf(roots[over]):
        return float(ways[over])
    if over:
        return float(np.interp(level, roots[over - 1 : over + 1], ways[over - 1 : over + 1]))
    slope = (roots[-1] - roots[chord]) / (ways[-1] - ways[chord]) if len(ways) > 1 else 0.0
    return float(ways[-1] + (level - roots[-1]) / slope) if slope > 0.0 else math.inf


def end_of(
    model: CurveModel, best: Minimum, way: Way, floor: float, known: ProfilePoint, on_run: Callable[[Objective], None]
) -> ProfilePoint | Minimum:
    """Return how chi2 rises along one unknown up to its goal above a floor, or a minimum below the floor where one is met.

    Known points count. One place lies about halfway: it yields one standard deviation.
    """
    goal, (low, high) = way.goal, limits(model.unknowns)
    ends = ProfilePoint([0.0, *known.ways], [math.sqrt(max(best.chi2 - floor, 0.0)), *known.roots])
    ahead, far, root, tries, doubted = way.along, way.step, math.inf, 0, False
    while tries <= TRIES:
        is_last = tries == TRIES or abs(root - goal) < CLOSE_ENOUGH * goal
        if is_last:
            far = HALFWAY * ends.reach(goal)
            if not math.isfinite(far) or any(abs(one - far) < HALFWAY * far for one in ends.ways):
                break
        start = best.varied + far * ahead
        if not low[way.index] <= start[way.index] <= high[way.index]:
            break
        there = _beside(Objective(model, np.clip(start, low, high), way.others, on_run), floor + (STUCK * goal) ** 2)
        is_state = there.prediction is not None and not there.lost
        if is_state and there.chi2 < floor - LOWER:
            return there
        root = math.sqrt(max(there.chi2 - floor, 0.0)) if is_state else math.inf
        ends.ways.append(far)
        ends.roots.append(root)
        if is_last:
            break
        if is_state:
            ahead = (there.varied - best.varied) / far
        tries, beyond = tries + 1, _doubtful(ends, goal, far, root)
        if beyond is None or doubted:
            far = _next(ends, goal, far)
        else:
            doubted, far = True, ends.ways.pop(beyond)
            ends.roots.pop(beyond)
    return ends


def _doubtful(ends: ProfilePoint, goal: float, far: float, root: float) -> int | None:
    """Return which place above the goal is nearer than where a lower place leads; from there it may be found lower, too."""
    over = [(way, i) for i, (way, one) in enumerate(zip(ends.ways, ends.roots, strict=True)) if goal <= one < math.inf]
    if not over or not 0.0 < root < goal or far * goal / root <= min(over)[0]:
        return None
    return min(over)[1]


def _beside(objective: Objective, stuck: float) -> Minimum:
    """Return the least chi2 with an unknown held, roughly; where it is as high as `stuck`, plain steps are tried as well."""
    objective.residuals(objective.start[objective.free])
    found = slide(objective, objective.best, away=True, most=MOST_STEPS, enough=ROUGHLY)
    if not found.lost and found.chi2 < stuck:
        return found
    again = slide(objective, objective.minimize(ROUGH, MOST_STEPS), away=True, most=MOST_STEPS, enough=ROUGHLY)
    return again if found.lost or (again.chi2 < found.chi2 and not again.lost) else found


def _next(ends: ProfilePoint, goal: float, far: float) -> float:
    """Return where to ask for chi2 next: between places on both sides of the goal, halfway if one is far off, else farther."""
    tried = list(zip(ends.ways, ends.roots, strict=True))
    inside = max(way for way, root in tried if root < goal or way == 0.0)
    outside, above = min(((way, root) for way, root in tried if root >= goal), default=(math.inf, math.inf))
    guess = ends.reach(goal)
    if math.isinf(outside):
        return min(guess, 2.0 * far)
    return guess if above < STUCK * goal and inside < guess < outside else 0.5 * (inside + outside)
