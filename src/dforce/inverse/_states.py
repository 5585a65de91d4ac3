"""The states of a plan: operating points of many cases, whether others exist beside them, and which limits hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from dforce.case import Case
from dforce.case.paths import value_at, with_number
from dforce.core.arrays import Array, Bools, Texts
from dforce.inverse.wishes import Goal
from dforce.maps.seeds import Curves
from dforce.problem import Problem
from dforce.procedures.motion import scaled
from dforce.procedures.operating import OperatingPoints, Wanted, solve
from dforce.solvers.blocks import side_by_side
from dforce.solvers.states import States

SAME = 1e-4  # of the free amplitude: distances and motions so near are one state
SLOPE_STEP = 5e-3  # of the logarithm of a parameter: the phase bends little over it
CancelCheck = Callable[[], None]


@dataclass
class PlannedPoints:
    """Operating points that are evaluated together.

    Attributes
    ----------
    values
        Values (SI) of the parameters that vary, (points, parameters).
    set_points
        Shares of the free amplitudes.
    near
        For each, the number of the grid's case whose curves show the other states.
    zc, motions
        Average distances (m), and motions in SI, to start from, or as found.
    """

    values: Array
    set_points: Array
    near: Any
    zc: Array
    motions: Array

    def take(self, which: object) -> PlannedPoints:
        """Return some of them."""
        return PlannedPoints(
            *(getattr(self, name)[which] for name in ("values", "set_points", "near", "zc", "motions"))
        )

    def places(self, shape: Sequence[int], shares: Array) -> Any:
        """Return the place of each in the grid of all values and set points, (points, axes)."""
        return np.column_stack([*np.unravel_index(self.near, shape[:-1]), np.searchsorted(shares, self.set_points)])

    def __len__(self) -> int:
        return len(self.zc)


class Solver:
    """Solves operating points of a case whose parameters at some paths vary."""

    def __init__(self, case: Case, paths: Sequence[str], curves: Curves, check_cancelled: CancelCheck) -> None:
        self.case, self.paths, self.curves, self.check_cancelled = case, list(paths), curves, check_cancelled
        self._problems: dict[tuple[float, ...], Problem] = {}

    def case_at(self, values: Sequence[float]) -> Case:
        """Return the case at values of the parameters, without any check."""
        case = self.case
        for path, value in zip(self.paths, values, strict=True):
            case = with_number(case, path, float(value))
        return case

    def problem(self, values: Sequence[float]) -> Problem:
        """Return the problem at values of the parameters."""
        key = tuple(map(float, values))
        if key not in self._problems:
            case = self.case_at(values)
            self._problems[key] = Problem.build(case.instrument, case.forces)
        return self._problems[key]

    def solve(self, points: PlannedPoints) -> OperatingPoints:
        """Return the operating points near some; their motions are written into `points`."""
        problems = [self.problem(values) for values in points.values]
        found = solve(
            Wanted(problems, points.set_points, points.zc, points.motions), self.case.solver, 1, self.check_cancelled
        )
        points.zc, points.motions[:] = found.zc.copy(), found.motions
        return found

    def _states(self, problems: Sequence[Problem], motions: Array) -> Any:
        """Return motions in SI as scaled states."""
        each = [scaled(motion[None], problem) for problem, motion in zip(problems, motions, strict=True)]
        return States(*(np.concatenate([getattr(one, name) for one in each]) for name in ("x", "memory", "branch")))

    def has_others(self, points: PlannedPoints) -> Bools:
        """Return whether the curves beside each point have another stable state at the same distance."""
        out = np.zeros(len(points), dtype=bool)
        pairs = [
            (i, zc, motion)
            for i in range(len(points))
            for zc, motion in self.curves.beside(int(points.near[i]), float(points.zc[i]))
        ]
        problems = [self.problem(points.values[i]) for i, *_ in pairs]
        for numbers, block in side_by_side(problems, self.case.solver, 1, self.check_cancelled):
            some, own = [problems[n] for n in numbers], np.array([pairs[n][0] for n in numbers])
            start = self._states(some, np.array([pairs[n][2] for n in numbers]))
            here = self._states(some, points.motions[own])
            begun = np.array([pairs[n][1] for n in numbers])
            found = block.follow(np.arange(len(some)), start, begun, points.zc[own][:, None])
            apart = np.abs(found.last_x - here.x).max(axis=1)
            out[own[(found.done == 1) & (apart > SAME)]] = True
        return out

    def slopes(self, points: PlannedPoints, path: str) -> Array:
        """Return the slope of the phase (degrees) by the logarithm of a parameter, at constant amplitude."""
        beside, values = self, points.values
        if path not in self.paths:  # it stays as in the case
            beside = Solver(self.case, [*self.paths, path], self.curves, self.check_cancelled)
            values = np.column_stack([values, np.full(len(values), float(value_at(self.case, path)))])
        own = beside.paths.index(path)
        phases: list[Array] = []
        for sign in (1.0, -1.0):
            moved = points.take(np.arange(len(points)))
            moved.values = values.copy()
            moved.values[:, own] *= np.exp(sign * SLOPE_STEP)
            found = beside.solve(moved)
            phases.append(np.where(found.found, found.columns["phase"][:, 0], np.nan))
        return np.asarray((phases[0] - phases[1]) / (2.0 * SLOPE_STEP))


def one_of_each(points: PlannedPoints, length: Array) -> Any:
    """Return the numbers of points without repetitions of an earlier point's state."""
    order = np.lexsort((points.zc, points.set_points, points.near))
    kept: list[int] = []
    for number in order.tolist():
        if kept:
            last = kept[-1]
            same = points.near[number] == points.near[last] and points.set_points[number] == points.set_points[last]
            if same and abs(points.zc[number] - points.zc[last]) < SAME * length[number]:
                continue
        kept.append(number)
    return np.array(kept, dtype=np.int64)


@dataclass(frozen=True)
class Rest:
    """The rest of a plan, beside the states themselves.

    Attributes
    ----------
    room
        Distance of each state from the nearest boundary, in margins.
    edges
        Where limits begin to fail: parameters and set point, and the limit.
    goals
        The quantity of each goal at all states.
    marks
        Which states are recommended, best, on the Pareto front, or violate the limits least.
    walked
        Numbers of the cases whose branches were followed.
    """

    room: Array
    edges: list[tuple[Array, str]]
    goals: Mapping[Goal, Array]
    marks: Mapping[str, Bools]
    walked: frozenset[int]

    def chosen(self, judged: Judged) -> set[int]:
        """Return the numbers of the cases with a recommended or best state."""
        return set(judged.points.near[self.marks["recommended"] | self.marks.get("best", False)].tolist())


@dataclass
class Judged:
    """Operating points, judged by the limits.

    Attributes
    ----------
    points, found
        Their places, and their observables.
    others
        Whether another stable state is at the same distance.
    hit
        Name of the first limit that fails at each; empty where all hold.
    bounds
        The bound of each limit at each, by name.
    excess
        Excess over all limits together, as a share of their bounds; 1 for a regime or a number of states.
    """

    points: PlannedPoints
    found: OperatingPoints
    others: Bools
    hit: Texts
    bounds: Mapping[str, Array]
    excess: Array

    def joined(self, which: Any, others: Judged) -> Judged:
        """Return some of these points, with other points after them."""

        def both(own: Any, new: Any) -> Any:
            if isinstance(own, dict):
                return {name: both(values, new[name]) for name, values in own.items()}
            if isinstance(own, np.ndarray):
                return np.concatenate([own[which], new])
            return type(own)(*(both(getattr(own, field.name), getattr(new, field.name)) for field in fields(own)))

        joined: Judged = both(self, others)
        return joined
