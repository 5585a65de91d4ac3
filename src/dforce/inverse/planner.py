"""Plans: the settings at which limits hold, and the one among them that is farthest from all boundaries."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core.arrays import Array, Bools
from dforce.core.errors import ParameterError, checked
from dforce.core.stopping import heard
from dforce.experiments.base import Progress
from dforce.inverse._plan_result import marks_of, result_of
from dforce.inverse._plan_words import why_no_state
from dforce.inverse._states import Judged, PlannedPoints, Rest, Solver, one_of_each
from dforce.inverse.wishes import SLOPE, Goal, Wishes, read_wishes
from dforce.maps.axes import Axis, make_axes
from dforce.maps.regime_map import refuse_others, shares_of
from dforce.maps.seeds import Curves, Seed, curves_of, walk
from dforce.runs import watched

if TYPE_CHECKING:
    import xarray as xr


MOST_POINTS = 50_000  # of a plan: cases times set points; each takes some milliseconds
HALVINGS = 18  # of the way between two neighbors of the grid, to locate a boundary
MOST_WALKED = 40  # cases whose branches are followed; each takes a second, or some where motions double
MOST_WITH_MEMORY = 13  # the same for forces with memory, which take some twenty times as long
STAGES = 6  # that progress counts, beside the cases whose branches are followed


@checked
def plan(
    case: Case,
    vary: Mapping[str, Any],
    set_points: Any = None,
    limits: Mapping[str, Any] | None = None,
    goal: Mapping[str, Any] | None = None,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    r"""Return the settings at which limits hold, the best setting, and the setting farthest from all boundaries.

    Each operating point is solved: orbit and distance such that :math:`A = s A_0`, for all stable states on the branches of
    each case. With more than 40 cases (13 for forces with memory) branches are followed only at recommended and best points.
    All other states of such a plan are those on approach and retract (see ``attrs["findings"]``). Bisection locates the
    boundaries of the allowed settings. A plan contains nothing outside the ranges. A plan does not find an instability that the
    memory of a force causes.

    Parameters
    ----------
    case
        The case; its experiment is not used.
    vary
        One or two paths with their values, such as ``{"drive.A0": {"start": "1 nm", "stop": "10 nm", "points": 19}}``; a pair
        of texts, ``["1 nm", "10 nm"]``, is a range of 19 values.
    set_points
        Shares :math:`s = A / A_0`: a list, or ``{"start": 0.5, "stop": 0.95, "points": 19}``, the default.
    limits
        All limits: quantities such as ``{"peak_force": "< 100 pN", "max_indentation": "< 20 % of sample.thickness"}``,
        ``"regime": "attractive"`` or ``"repulsive"``, ``"states": "one"`` (no other stable state at the same distance), and
        ``"margin": {"set_point": 0.03, "drive.A0": "5 %"}``: the limits also hold within this margin, with its corners.
    goal
        ``{"minimize": "peak_force"}``, ``{"maximize": "slope_of_phase:sample.youngs_modulus"}`` (degrees by the logarithm
        of the parameter, at constant amplitude), or several goals, with a Pareto front.
    progress
        True for a bar, or a function called as ``progress(done, total, note)``. After Ctrl-C the solved states are returned
        with their limits, without margins, boundaries and a recommended point, and ``attrs["interrupted"]`` is 1.

    Returns
    -------
    xarray.Dataset
        Over the parameters, `set_point` and `state` (the farthest from the sample first): all scalars, `zc`, `regime`,
        `others` (whether another stable state exists at this distance), `allowed`, `limit_hit` (the first limit that fails).
        `unsteady` is true where a branch passes a set point without a stable state: motions alternate or beat there, with
        unknown forces. `room` is the distance from the nearest boundary or end of a range, in units of the margins (default 5 %
        and 0.03). `recommended` is the allowed point with the most room, if any. With one goal also `best`, with any goals
        `pareto`; if nothing is allowed, `least_violation`. Along `edge` the located boundaries. Along `time` the motion at the
        recommended point.

    Raises
    ------
    ParameterError
        For an unknown path, more than two paths, unknown limits, too many points, and if no state has any of the set points.
    KeyboardInterrupt
        When the plan is stopped before the states are solved.
    """
    axes = make_axes(case, {path: _pair(path, values) for path, values in vary.items()})
    shares = shares_of(set_points)
    wishes = read_wishes(case, [axis.path for axis in axes], limits, goal)
    _check(case, axes, shares)
    bare = case.model_copy(update={"sweep": None, "experiment": None})
    grid = np.array(list(itertools.product(*(axis.values for axis in axes))), dtype=float)
    with watched(progress, case.title) as report_progress:
        stages = STAGES + _walks(case, len(grid))
        report_progress(0, stages, "curves")
        rows = {axis.path: column for axis, column in zip(axes, grid.T, strict=True)}
        curves = curves_of(bare, rows, float(shares.min()), lambda *_: report_progress(0, stages, "curves"))
        if curves.interrupted:
            raise KeyboardInterrupt
        work = _Work(bare, axes, shares, wishes, grid, curves, report_progress)
        data = work.run()
        if not data.attrs.get("interrupted"):
            report_progress(stages, stages, "")
    return data


def _pair(path: str, given: object) -> Any:
    """Return a pair of values as a range."""
    if isinstance(given, list | tuple) and len(given) == 2 and isinstance(given[0], str):
        return {"start": given[0], "stop": given[1], "points": 19}
    return given


def _check(case: Case, axes: Sequence[Axis], shares: Array) -> None:
    if len(axes) > 2:
        raise ParameterError(f"plan.vary has {len(axes)} paths; one or two are allowed")
    for axis in axes:
        if axis.quantity is None:
            raise ParameterError(f"plan.vary: {axis.path} is not a plain number, so no boundary can be found along it")
    refuse_others(case)
    count = math.prod(len(axis.values) for axis in axes) * len(shares)
    if count > MOST_POINTS:
        raise ParameterError(f"the plan has {count} points; at most {MOST_POINTS} are allowed; use fewer values")


def _most_walked(case: Case) -> int:
    """Return of how many cases at most the branches are followed."""
    return MOST_WITH_MEMORY if any(force.memory for force in case.problem.forces) else MOST_WALKED


def _walks(case: Case, count: int) -> int:
    """Return of how many cases the branches are followed first: of all, or of none of many."""
    return count if count <= _most_walked(case) else 0


class _Work:
    """A plan while it is made."""

    def __init__(
        self,
        case: Case,
        axes: list[Axis],
        shares: Array,
        wishes: Wishes,
        grid: Array,
        curves: Curves,
        report_progress: Progress,
    ) -> None:
        self.case, self.axes, self.shares, self.wishes = case, axes, shares, wishes
        self.grid, self.curves, self.report_progress, self.stage = grid, curves, report_progress, "branches"
        self.number, self.walks = 1, _walks(case, len(grid))
        self.solver = Solver(case, [axis.path for axis in axes], curves, self.check_cancelled)
        self.shape = (*(len(axis.values) for axis in axes), len(shares))
        self.unsteady = np.zeros(self.shape, dtype=bool)
        self.located: tuple[Any, list[tuple[Array, str]]] = None, []  # places where limits held, and their edges

    def check_cancelled(self) -> None:
        """Report the progress of the plan."""
        self.report_progress(self.number, STAGES + self.walks, self.stage)

    def next(self, stage: str) -> None:
        """Begin another stage."""
        self.stage, self.number = stage, min(self.number + 1, STAGES + self.walks - 1)
        self.check_cancelled()

    def run(self) -> xr.Dataset:
        """Return the plan."""
        for case in range(self.walks):
            self._walk(case)
            self.next(self.stage)
        self.next("states")
        judged = self.judge(self._states(), tells_others=True)
        rest = None
        try:
            whole, goals = self._around(judged)
            rest = self._rest(whole, goals)
            while (number := self._not_walked(whole, rest)) is not None:
                self.stage = "branches"
                self._walk(number)
                others = np.flatnonzero(judged.points.near != number)
                new = self.judge(self._states(number), tells_others=True)
                judged = judged.joined(others, new)
                new, new_goals = self._around(new)
                goals = {goal: np.concatenate([values[others], new_goals[goal]]) for goal, values in goals.items()}
                whole = whole.joined(others, new)
                rest = self._rest(whole, goals)
            judged = whole
        except KeyboardInterrupt:  # the states are solved, and are kept
            heard()
            rest = None
        return result_of(self.case, self.axes, self.shares, self.wishes, judged, rest, self.unsteady)

    def _around(self, judged: Judged) -> tuple[Judged, dict[Goal, Array]]:
        """Return states with the margins that fail around them, and their goals."""
        out = replace(judged, hit=judged.hit.copy())
        self.next("margins")
        self._margins(out)
        self.next("goal")
        return out, {goal: self._goal(out, goal) for goal in self.wishes.goals}

    def _rest(self, judged: Judged, goals: Mapping[Goal, Array]) -> Rest:
        """Return boundaries and room around states, and the points that are recommended or best."""
        self.next("boundaries")
        holds = (judged.hit == "") | np.char.startswith(judged.hit, "margin")
        places = sorted(map(tuple, judged.points.take(holds).places(self.shape, self.shares).tolist()))
        if places != self.located[0]:
            self.located = places, self._edges(judged, holds)
        room = self._room(judged.points, holds, self.located[1])
        return Rest(room, self.located[1], goals, marks_of(judged, room, goals), frozenset(self.curves.walked))

    def _not_walked(self, judged: Judged, rest: Rest) -> int | None:
        """Return a case with a recommended or best point whose branches are still to be followed, if any."""
        left = rest.chosen(judged) - self.curves.walked.keys()
        return min(left) if left and len(self.curves.walked) < _most_walked(self.case) else None

    def _walk(self, number: int) -> None:
        """Follow the branches of a case."""
        case = self.solver.case_at(self.grid[number])
        walk(self.curves, number, case, float(self.shares.min()), self.check_cancelled)

    def _states(self, only: int | None = None) -> PlannedPoints:
        """Return where all stable states at the set points are, each once; of one case alone on demand."""
        seeds = list(self.curves.seeds(self.shares, only))
        if not seeds:
            raise ParameterError(why_no_state(self.case, self.curves, self.shares))
        near = np.array([seed.case for seed in seeds])
        points = PlannedPoints(
            self.grid[near],
            self.shares[[seed.set_point for seed in seeds]],
            near,
            np.array([seed.zc for seed in seeds]),
            np.array([seed.motion for seed in seeds]),
        )
        found = self.solver.solve(points)
        stable = found.columns["multiplier_modulus"][:, 0] < 1.0
        self._note_unsteady(seeds, found.found & stable)
        points = points.take(np.flatnonzero(found.found & stable))
        if not len(points) and only is None:
            raise ParameterError(why_no_state(self.case, self.curves, self.shares))
        length = np.array([self.solver.problem(values).tones[0].A0 for values in points.values])
        return points.take(one_of_each(points, length))

    def _note_unsteady(self, seeds: Sequence[Seed], steady: Bools) -> None:
        """Note where branches pass set points without a stable state there: the motion alternates or beats."""
        pairs: dict[tuple[int, int, tuple[float, float]], bool] = {}
        for seed, is_steady in zip(seeds, steady.tolist(), strict=True):
            if seed.between is not None:
                key = seed.case, seed.set_point, seed.between
                pairs[key] = pairs.get(key, False) or is_steady
        for (case, set_point, _), is_steady in pairs.items():
            self.unsteady.reshape(-1, len(self.shares))[case, set_point] |= not is_steady

    def judge(self, points: PlannedPoints, tells_others: bool = False) -> Judged:
        """Solve operating points near some, and hold the limits against them; a point that is not found fails the first.

        Other states are looked for where a limit or `tells_others` asks for it.
        """
        found = self.solver.solve(points)
        wishes, count = self.wishes, len(points)
        wanted = wishes.one_state or tells_others
        others = self.solver.has_others(points) if wanted else np.zeros(count, dtype=bool)
        hit, excess = np.full(count, "", dtype="<U80"), np.zeros(count)
        lost = ~found.found
        hit[lost], excess[lost] = "no state", np.inf
        cases = [self.solver.case_at(values) for values in points.values]
        every = {limit.name: limit.bounds(cases) for limit in wishes.limits}
        for limit in wishes.limits:
            values, bounds = found.columns[limit.name].reshape(count, -1)[:, 0], every[limit.name]
            over = limit.sign * (values - bounds)
            fails = ~(over < 0.0)
            hit[fails & (hit == "")] = limit.name
            excess += np.where(fails & ~lost, over / np.maximum(np.abs(bounds), np.finfo(float).tiny), 0.0)
        if wishes.regime:
            virial = found.columns["virial"][:, 0]
            fails = ~(virial > 0.0) if wishes.regime == "attractive" else ~(virial < 0.0)
            hit[fails & (hit == "")] = "regime"
            excess += np.where(fails & ~lost, 1.0, 0.0)
        if wishes.one_state:
            hit[others & (hit == "")] = "states"
            excess += np.where(others & ~lost, 1.0, 0.0)
        return Judged(points, found, others, hit, every, excess)

    def _margins(self, judged: Judged) -> None:
        """Write which limit fails within the margins of each point at which all hold."""
        asked = [
            path for path in (*(axis.path for axis in self.axes), "set_point") if path in self.wishes.asked_margins
        ]
        good = np.flatnonzero(judged.hit == "")
        for steps in itertools.product((-1.0, 0.0, 1.0), repeat=len(asked)) if asked else ():
            good = good[judged.hit[good] == ""]
            if not any(steps) or not len(good):
                continue
            around = self._moved(judged.points.take(good), dict(zip(asked, steps, strict=True)))
            inside = (around.set_points > 0.0) & (around.set_points < 1.0)
            hit = np.full(len(good), "set_point", dtype="<U80")
            if inside.any():
                hit[inside] = self.judge(around.take(np.flatnonzero(inside))).hit
            fails = hit != ""
            judged.hit[good[fails]] = np.char.add("margin: ", hit[fails])

    def _moved(self, points: PlannedPoints, steps: Mapping[str, float]) -> PlannedPoints:
        """Return points moved by so many margins."""
        values, shares = points.values.copy(), points.set_points.copy()
        for path, step in steps.items():
            margin = self.wishes.margins[path]
            if path == "set_point":
                shares = margin.moved(shares, step)
            else:
                column = [axis.path for axis in self.axes].index(path)
                values[:, column] = margin.moved(values[:, column], step)
        return self._carried(points, values, shares)

    def _carried(self, points: PlannedPoints, values: Array, shares: Array) -> PlannedPoints:
        """Return points at other values, with motions to start from."""
        before = np.array([self.solver.problem(one).tones[0].A0 for one in points.values])
        after = np.array([self.solver.problem(one).tones[0].A0 for one in values])
        ratio = after / before
        # the way to another set point is followed along the distance: a motion beside its branch may lead to another one
        return PlannedPoints(values, shares, points.near, points.zc * ratio, points.motions * ratio[:, None])

    def _edges(self, judged: Judged, holds: Bools) -> list[tuple[Array, str]]:
        """Return where limits begin to fail between neighbors of the grid: parameters and set point, and the limit."""
        places = judged.points.places(self.shape, self.shares)
        by_place: dict[tuple[int, ...], list[int]] = {}
        for number, place in enumerate(map(tuple, places.tolist())):
            by_place.setdefault(place, []).append(number)
        pairs: list[tuple[int, tuple[int, ...]]] = []
        for number in np.flatnonzero(holds).tolist():
            for axis, step in itertools.product(range(len(self.shape)), (-1, 1)):
                other = list(places[number])
                other[axis] += step
                if 0 <= other[axis] < self.shape[axis] and not holds[by_place.get(tuple(other), [])].any():
                    pairs.append((number, tuple(other)))
        if not pairs:
            return []
        inside = judged.points.take(np.array([number for number, _ in pairs]))
        far = np.array([self._values(other) for _, other in pairs])
        low, high = np.column_stack([inside.values, inside.set_points]), far
        names = np.full(len(pairs), "", dtype="<U80")
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            tried = self.judge(self._carried(inside, middle[:, :-1], middle[:, -1]))
            good = tried.hit == ""
            low[good], high[~good] = middle[good], middle[~good]
            names[~good] = tried.hit[~good]
            for name in ("values", "set_points", "zc", "motions"):
                getattr(inside, name)[good] = getattr(tried.points, name)[good]
        first = self.judge(self._carried(inside, far[:, :-1], far[:, -1])).hit
        names[names == ""] = first[names == ""]
        return [(0.5 * (a + b), str(name)) for a, b, name in zip(low, high, names, strict=True)]

    def _values(self, place: Sequence[int]) -> list[float]:
        """Return the parameters and the set point at a place in the grid."""
        return [
            *(float(axis.values[i]) for axis, i in zip(self.axes, place, strict=False)),
            float(self.shares[place[-1]]),
        ]

    def _room(self, points: PlannedPoints, holds: Bools, edges: list[tuple[Array, str]]) -> Array:
        """Return the distance of each point from the nearest boundary, in units of the margins: the largest along any axis.

        The ends of the ranges are boundaries, too, as nothing is known beyond. Points at which a limit fails have none.
        """
        margins = [self.wishes.margins[axis.path] for axis in self.axes] + [self.wishes.margins["set_point"]]

        def scaled(table: Array) -> Array:
            return np.column_stack([margin.scaled(table[:, i]) for i, margin in enumerate(margins)])

        own = scaled(np.column_stack([points.values, points.set_points]))
        room = np.where(holds, np.inf, 0.0)
        allowed_places = {tuple(place) for place in points.places(self.shape, self.shares)[holds].tolist()}
        bad = [place for place in np.ndindex(*self.shape) if place not in allowed_places]
        walls = [*(np.array(self._values(place)) for place in bad), *(at for at, _ in edges)]
        if walls:
            there = scaled(np.array(walls))
            for one in np.flatnonzero(holds).tolist():
                room[one] = np.abs(there - own[one]).max(axis=1).min()
        for i, ends in enumerate([*(axis.values for axis in self.axes), self.shares]):
            if len(ends) > 1:
                for end in (min(ends), max(ends)):
                    room = np.minimum(room, np.abs(own[:, i] - margins[i].scaled(np.array([end]))[0]))
        return np.where(holds, room, 0.0)

    def _goal(self, judged: Judged, goal: Goal) -> Array:
        """Return the quantity of a goal at all points."""
        if goal.key == SLOPE:
            return self.solver.slopes(judged.points, goal.path)
        return np.asarray(judged.found.columns[goal.name].reshape(len(judged.points), -1)[:, 0])
