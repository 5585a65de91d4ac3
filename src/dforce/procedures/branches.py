"""Branches: all steady states along the distance or any other parameter, stable and unstable, through folds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np
import xarray as xr

from dforce.case import Case
from dforce.core import units
from dforce.core.arrays import Array, Bools
from dforce.core.errors import ParameterError, UnitError
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.quantities import ENDS, MOTION, MOTIONS, REPEATS
from dforce.core.quantity import words
from dforce.core.stopping import until_stopped
from dforce.experiments import Branches
from dforce.experiments.base import CurvePlan, Progress
from dforce.experiments.branches import Span
from dforce.problem import Problem
from dforce.procedures import locked
from dforce.procedures.found import Found, Layout, dataset, tabled, with_levers
from dforce.procedures.motion import base_of, rows_of, scales_of, split_rows, states_of
from dforce.procedures.varied import VariedParameter, varied_by
from dforce.solvers import locked_orbits
from dforce.solvers.accuracy import assured
from dforce.solvers.continuation import Curve
from dforce.solvers.doubling import doublings
from dforce.solvers.escape import UnstableStates, escape
from dforce.solvers.locked import Locked
from dforce.solvers.locked_orbits import LockedRange
from dforce.solvers.orbit import Orbit
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.search import Known, candidates, index_sum, search, why_unproven
from dforce.solvers.transient import never_cancelled

UNDER_WAY = "under_way"  # of a stopped run: the number of the search, 0 before the first one, and the curves before it
SHARP = 1e-11  # of the way between two points of a branch: how well a state at a set point is located
UNKNOWNS = "unknowns"  # of a stopped run of locked states: their scaled numbers
BEGUN = "begun"  # of a stopped run: where each curve was found, see `Curve`


def branches(case: Case, plan: Branches, report_progress: Progress, earlier: xr.Dataset | None) -> xr.Dataset:
    """Return the points of all curves, one curve after the other; see :func:`dforce.runs.carry_out`."""
    path, quantity, is_locked = varied_by(case), _quantity(plan, case), case.problem.is_locked
    start, stop = _range(plan, case, quantity)
    if is_locked:
        states = Locked(case.problem, case.solver, plan.harmonics, lambda: check_cancelled())
        among: ParameterRange = LockedRange(states, start / states.length, stop / states.length)
    else:
        among = _among(case, plan)
    searched = np.linspace(start, stop, plan.search)
    curves: list[Curve] = []
    kept: list[Curve] = []  # of an earlier run, from the search that it was stopped in on
    # which search, and how many curves there were before it; after the last one doubled motions are followed
    under_way, total = (0, 0), 1 + plan.search + (not is_locked)

    def check_cancelled() -> None:
        done = under_way[0]
        if not curves:
            return report_progress(done, total, "")
        last = max((curves[-1].forth, curves[-1].back), key=len)[-1]
        here = units.show(last.value, quantity.unit, 4)
        return report_progress(done, total, f"curve {len(curves)}, {path.name} = {here}")

    if earlier is not None:
        kept, under_way = _restored(earlier, among, path.name), tuple(earlier.attrs[UNDER_WAY].tolist())
        curves, kept = kept[: under_way[1]], kept[under_way[1] :]

    def grow(curve: Curve) -> bool:
        left = plan.max_points - sum(len(curve.points) for curve in curves)
        if left > 1:
            # a search that is done again finds the same orbits in the same order
            curves.append(kept.pop(0) if kept else curve)
            curves[-1].grow(among, plan.largest_step, left, check_cancelled)
        return left > 1

    def found() -> Iterator[Curve]:
        number, _ = under_way
        if number <= plan.search:
            known = Known(among, curves, searched[number - 1] / among.span)
            return search(known, check_cancelled, locked_orbits.candidates if is_locked else candidates)
        return doublings(among, curves, plan.largest_step, check_cancelled)

    orbits: list[Orbit] = []

    with until_stopped() as stopped:
        first = among.free_orbit(start / among.span) if under_way[0] == 0 else None
        if first is not None:
            grow(Curve.rising(first, stop - start))
        elif under_way[0] == 0 == plan.search:
            raise ParameterError(
                "experiment.search = 0 looks near the free motion alone, where no state is; write 1 or more"
            )
        for number in range(max(1, under_way[0]), total):
            under_way = number, len(curves)
            for curve in found():
                if not grow(curve):
                    break
            while kept and grow(kept[0]):  # a search on another machine may miss a curve
                pass
        for point in (point for curve in curves for point in curve.points):
            check_cancelled()
            orbits.append(_assured(among, point))
        report_progress(total, total, "")
    if isinstance(among, LockedRange):
        among.locked.block.check_cancelled = never_cancelled  # the orbits found are measured, even after a stop
    if stopped.came:  # a run goes on from the orbits as they were followed
        curves += kept
        orbits = [point for curve in curves for point in curve.points]
    data = _dataset(plan, among, curves, orbits, path, quantity, searched)
    if stopped.came:
        begun = np.array([curve.begun for curve in curves], dtype=int)
        data.attrs |= {"interrupted": 1, UNDER_WAY: np.array(under_way), BEGUN: begun}
        if curves and isinstance(among, LockedRange):
            data[UNKNOWNS] = ("point", "unknown"), among.kept([point for curve in curves for point in curve.points])
        data.attrs["completeness"] = "not checked: the run was stopped"
    return data


def _among(case: Case, plan: Branches) -> ParameterRange:
    """Return the range of the parameter in which orbits are sought."""
    path = varied_by(case)
    start, stop = _range(plan, case, _quantity(plan, case))
    low, high = min(start, stop), max(start, stop)

    def at(value: float) -> Problem:
        return path.at(min(max(value, low), high))  # beyond the range, by a rounding, it may not be allowed

    return ParameterRange(at, start, stop, case.solver, plan.harmonics, path.zc)


def at_value(
    cases: Sequence[Case], name: str, value: float, near: Mapping[str, Array]
) -> tuple[dict[str, Array], Bools]:
    """Return the orbits on branches of one case, stable or not, on which a quantity has a value, and where one was found.

    Parameters
    ----------
    near
        Of the points before and after each: the parameter and the motion; and the periods after which it repeats.
    """
    case, experiment = cases[0], cast(Branches, cases[0].experiment)
    among, parameter = _among(case, experiment), varied_by(case).name
    found: list[dict[str, Any] | None] = []
    for i, repeats in enumerate(np.nan_to_num(near[REPEATS]).round().astype(int)):
        ends = [_unknowns(among, *end) for end in zip(near[ENDS][i].tolist(), near[MOTIONS][i], strict=True)]
        orbit = assured(among, partial(_meeting, name, value, ends, int(repeats) // among.common))
        found.append(None if orbit is None else {**among.steady(orbit).values, parameter: orbit.value})
    return tabled(found)


def _unknowns(among: ParameterRange, value: float, motion: Array) -> tuple[Array, Array]:
    """Return a motion in SI and the parameter as scaled unknowns, with the forces' branches."""
    problem = among.problem_at(value)
    state = states_of(motion[None], problem, among.scales_of(value), base_of(problem))
    return np.append(among.vectors(state), value / among.span), np.round(state.branch)


def _assured(among: ParameterRange, orbit: Orbit) -> Orbit:
    """Return an orbit of a curve as accurate as asked for, with its estimated error; locked states have one already."""
    if isinstance(among, LockedRange):
        return orbit
    return assured(among, lambda finer: finer.found_again(orbit), orbit) or orbit


def _meeting(
    name: str, value: float, ends: Sequence[tuple[Array, Array]], repeats: int, among: ParameterRange
) -> Orbit | None:
    """Return the orbit between two of a branch on which a quantity has a value, each sought in a plane across their chord."""
    from scipy.optimize import brentq

    (first, branch), (last, _) = ends
    found: list[Orbit] = []

    def miss(share: float) -> float:
        orbit = among.find(first + share * (last - first), branch, last - first, repeats)
        if orbit is None:
            raise ValueError("no orbit between the points")
        found.append(orbit)
        return float(np.ravel(among.steady(orbit).values[name])[0]) - value

    try:
        brentq(miss, 0.0, 1.0, xtol=SHARP)
    except ValueError:
        return None
    return found[-1]


def _restored(earlier: xr.Dataset, among: ParameterRange, name: str) -> list[Curve]:
    """Return the curves of an interrupted result, computed from their motions."""
    special = [str(one) for one in earlier["special"].values]
    if isinstance(among, LockedRange):
        found: list[Orbit] = among.restored(earlier[UNKNOWNS].values)
    else:
        found = _orbits_of(earlier, among, earlier[name].values.tolist())
    orbits = [replace(orbit, special=one) for orbit, one in zip(found, special, strict=True)]
    places = [np.flatnonzero(earlier["branch"].values == n + 1) for n in range(np.size(earlier.attrs[BEGUN]))]
    return [
        Curve.of_points([orbits[i] for i in some], int(begun))
        for some, begun in zip(places, np.atleast_1d(earlier.attrs[BEGUN]), strict=True)
    ]


def _orbits_of(earlier: xr.Dataset, among: ParameterRange, values: list[float]) -> list[Orbit]:
    """Return the orbits of a result at values of the parameter."""
    states = split_rows(earlier[MOTION].values, among.problem)
    for i, value in enumerate(values):
        problem = among.problem_at(value)
        states.x[i] += base_of(problem) * scales_of(problem)
    steps, repeats = earlier["corrections"].values.tolist(), (earlier[REPEATS].values // among.common).tolist()
    return [among.orbit(value, states.take([i]), steps[i], repeats[i]) for i, value in enumerate(values)]


def _quantity(plan: Branches, case: Case) -> ParameterQuantity:
    """Return the declaration of the parameter."""
    return Span.quantities()["start"] if plan.parameter is None else case.quantity(plan.parameter)


def _range(plan: Branches, case: Case, quantity: ParameterQuantity) -> tuple[float, float]:
    """Return start and stop (SI)."""
    if isinstance(plan.zc, Span):
        return plan.zc.start, plan.zc.stop
    start, stop = (_parsed(key, getattr(plan, key), quantity.unit) for key in ("start", "stop"))
    if start == stop:
        raise ParameterError(f"the range of {plan.path} starts where it stops; give two values")
    for end in (start, stop):
        case.replace(plan.path, end)  # refuses a value that is not allowed
    return start, stop


def _dataset(
    plan: Branches,
    among: ParameterRange,
    curves: list[Curve],
    points: list[Orbit],
    path: VariedParameter,
    quantity: ParameterQuantity,
    searched: Array,
) -> xr.Dataset:
    numbers = [number for number, curve in enumerate(curves, start=1) for _ in curve.points]
    orbits = list(zip(numbers, points, strict=True))
    problems = [among.problem_of(orbit) for _, orbit in orbits]
    values = np.array([orbit.value for _, orbit in orbits], dtype=float)
    places = CurvePlan("point", values, [(i,) for i in range(len(orbits))])
    if orbits and isinstance(among, LockedRange):
        found, values = locked.on_curve(among.locked, [orbit for _, orbit in orbits])
    else:
        found = Found.of([among.steady(orbit) for _, orbit in orbits], problems)
    if orbits and MOTION not in found.arrays:
        bases = [base_of(problem) * scales_of(problem) for problem in problems]
        rows = [
            rows_of(one.kept, np.ones(1), base, among.problem) for (_, one), base in zip(orbits, bases, strict=True)
        ]
        found.arrays[MOTION] = np.concatenate(rows)[None]
    data = dataset(Layout([places], {"point": np.arange(1, len(orbits) + 1)}), [found], among.problem)
    if among.has_changing_lever:
        data = with_levers(data, "point", problems)
    unstable = UnstableStates(curves, among)
    escapes = [escape(orbit, unstable, problem) for (_, orbit), problem in zip(orbits, problems, strict=True)]
    data["escape"] = ("point", np.array(escapes, dtype=float))
    name = path.name
    data.coords[name] = ("point", values)
    data.coords["branch"] = ("point", np.array([number for number, _ in orbits], dtype=int))
    data["stable"] = ("point", np.array([orbit.is_stable for _, orbit in orbits], dtype=bool))
    data["special"] = ("point", np.array([orbit.special for _, orbit in orbits], dtype=np.str_))
    repeats = [orbit.repeats * among.common for _, orbit in orbits]
    data[REPEATS] = ("point", np.array(repeats, dtype=int))
    sums = [index_sum(curves, value / among.span) for value in searched]
    if sums:
        data.coords["searched"] = ("search", searched)
        data["searched"].attrs["units"] = quantity.unit
    if sums and not among.problem.is_locked:
        data["index_sum"] = ("search", np.array(sums, dtype=int))
    if path.zc is not None:
        data.coords["zc"] = path.zc
        data[name].attrs.update(words(quantity.unit, quantity.doc, quantity.symbol))
    unproven, is_full = why_unproven(among.problem), len(orbits) >= plan.max_points - 1
    data.attrs |= {
        "along": name,
        "samples_per_period": among.points,
        "completeness": _completeness(sums, unproven, is_full),
    }
    if isinstance(among, LockedRange):
        data.attrs |= locked.attributes(among.locked)
    return data


def _completeness(sums: list[int], unproven: str, is_full: bool) -> str:
    """Return a sentence on whether the indices of the states show that none is missing."""
    if not sums:
        return "not checked: search = 0"
    if unproven:
        return f"not proven: {unproven}, so that the indices of the states need not add up to 1"
    missing = sum(one != 1 for one in sums)
    if missing:
        limit = "; max_points is reached" if is_full else ""
        return (
            f"states are missing: their indices do not add up to 1 at {missing} of {len(sums)} searched values{limit}"
        )
    return "no single state is missing: their indices add up to 1 at all searched values"


def _parsed(key: str, given: Any, unit: str) -> float:
    try:
        return units.parse(given, unit)
    except UnitError as error:
        raise UnitError(f"experiment.{key} {error}") from None
