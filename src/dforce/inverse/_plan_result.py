"""The Dataset of a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core.arrays import Array, Bools
from dforce.core.quantities import OBSERVABLES
from dforce.experiments import Dwell
from dforce.inverse._plan_words import UNSTEADY, missing_damping, sentences
from dforce.inverse._states import Rest
from dforce.inverse.wishes import SLOPE, Goal, Wishes
from dforce.maps.axes import Axis
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.runs import run
from dforce.validity import advice_in, attributes

if TYPE_CHECKING:
    import xarray as xr

    from dforce.inverse._states import Judged

LEFT_OUT = (
    "corrections", "settling_periods", "drift", "harmonic_amplitude", "harmonic_phase", "multiplier_modulus",
    "multiplier_angle",
)  # fmt: skip
SAME = 1e-3  # relative difference of amplitudes of one motion
LEAST_ROOM = 1e-6  # margins; a point with less lies on a boundary and is not recommended
TRACES = ("deflection", "velocity", "distance", "force", "indentation")


def result_of(
    case: Case, axes: Sequence[Axis], shares: Array, wishes: Wishes, judged: Judged, rest: Rest | None, unsteady: Bools
) -> xr.Dataset:
    """Put a plan together; without the rest the plan is a stopped one. `unsteady` is over the grid and the set points."""
    import xarray as xr

    lengths = (*(len(axis.values) for axis in axes), len(shares))
    dims = (*(axis.dim for axis in axes), "set_point")
    places = judged.points.places(lengths, shares)
    rank = _ranks(places, judged.points.zc)
    shape, where = (*lengths, int(rank.max(initial=0)) + 1), (*places.T, rank)

    def spread(values: Any, fill: Any) -> Any:
        table = np.full((*shape, *values.shape[1:]), fill, dtype=values.dtype)
        table[where] = values
        return table

    nothing = Rest(np.full(len(rank), np.nan), [], {}, {"recommended": np.zeros(len(rank), dtype=bool)}, frozenset())
    room, edges, goals, marks = (getattr(rest or nothing, name) for name in ("room", "edges", "goals", "marks"))
    allowed = judged.hit == ""
    virial = judged.found.columns["virial"][:, 0]
    words = np.where(virial > 0.0, "attractive", np.where(virial < 0.0, "repulsive", ""))
    columns = {
        name: values for name, values in judged.found.columns.items() if name in OBSERVABLES and name not in LEFT_OUT
    }
    variables: dict[str, Any] = {
        name: ((*dims, "state", *OBSERVABLES[name].dims), spread(values, np.nan)) for name, values in columns.items()
    }
    whole = (*dims, "state")
    variables["zc"] = whole, spread(judged.points.zc, np.nan)
    variables["status"] = whole, spread(judged.found.status, np.int8(-1))
    variables["regime"] = whole, spread(words, "")
    variables["others"] = whole, spread(judged.others, False)
    variables["allowed"] = whole, spread(allowed, False)
    variables["limit_hit"] = whole, spread(judged.hit, "no state")
    variables["unsteady"] = dims, unsteady
    variables["room"] = whole, spread(room, 0.0)
    if any(goal.key == SLOPE for goal in goals):
        variables[SLOPE] = whole, spread(next(values for goal, values in goals.items() if goal.key == SLOPE), np.nan)
    for name, mark in marks.items():
        variables[name] = whole, spread(mark, False)
    coords: dict[str, Any] = {axis.name: axis.coordinate() for axis in axes}
    data = describe(xr.Dataset(variables, coords=coords | {"set_point": shares}))
    if SLOPE in data:
        data[SLOPE].attrs = {"units": "degree", "long_name": "slope of the phase by the logarithm of the parameter"}
    data["room"].attrs = {"units": "1", "long_name": "distance from the nearest boundary in margins"}
    for i, axis in enumerate(axes):
        data[f"edge_{axis.name}"] = "edge", np.array([at[i] for at, _ in edges], dtype=float)
        data[f"edge_{axis.name}"].attrs = dict(axis.coordinate()[2])
    data["edge_set_point"] = "edge", np.array([at[-1] for at, _ in edges], dtype=float)
    data["edge_kind"] = "edge", np.array([name for _, name in edges], dtype=np.str_)
    data.attrs = of_case(case) | {
        "plan_over": " ".join(axis.path for axis in axes),
        "limits": "; ".join(_limits(wishes)),
        "goal": "; ".join(f"{'minimize' if goal.sign > 0 else 'maximize'} {_text(goal)}" for goal in goals),
    }
    for name, path in [*((axis.name, axis.path) for axis in axes), ("set_point", "set_point")]:
        margin = wishes.margins[path]  # below and above a value of 1, as factors or as differences
        data[name].attrs["margin"] = margin.size
        data[name].attrs["margin_is_relative"] = int(margin.is_relative)
    if rest is None:
        data = data.assign_attrs(interrupted=1)
    else:
        said = sentences(axes, shares, wishes, judged, rest)
        if any(unsteady[tuple(places[number])] for number in np.flatnonzero(marks["recommended"])):
            said.append(f"At the recommended settings {UNSTEADY}.")
        said += [] if allowed.any() else missing_damping(case)
        data = data.assign_attrs(findings="\n".join(said))
    return _with_dwell(case, axes, judged, marks.get("recommended"), data)


def _text(goal: Goal) -> str:
    return f"{goal.name}:{goal.path}" if goal.path else goal.name


def _limits(wishes: Wishes) -> list[str]:
    found = [f"{limit.name} {limit.text}" for limit in wishes.limits]
    found += [f"regime {wishes.regime}"] * bool(wishes.regime) + ["states one"] * wishes.one_state
    return [*found, *(f"margin {path}" for path in sorted(wishes.asked_margins))]


def _ranks(places: Any, zc: Array) -> Any:
    """Return the number of each point among the points at its place, the farthest from the sample first."""
    rank = np.zeros(len(zc), dtype=np.int64)
    seen: dict[tuple[int, ...], int] = {}
    for number in np.argsort(-zc, kind="stable").tolist():
        place = tuple(places[number].tolist())
        rank[number] = seen.get(place, 0)
        seen[place] = int(rank[number]) + 1
    return rank


def marks_of(judged: Judged, room: Array, goals: Mapping[Goal, Array]) -> dict[str, Any]:
    """Return which points are recommended, best, on the Pareto front, or violate the limits least."""
    allowed, count = judged.hit == "", len(room)
    if not allowed.any():
        least = np.argmin(np.where(np.isfinite(judged.excess), judged.excess, np.inf))
        return {"recommended": np.zeros(count, dtype=bool), "least_violation": np.arange(count) == least}
    wanted = np.array([goal.sign * values for goal, values in goals.items()]) if goals else np.zeros((0, count))
    tie = wanted[0] if len(wanted) else np.zeros(count)
    order = np.lexsort((np.nan_to_num(tie, nan=np.inf), -np.where(allowed, room, -1.0)))
    marks = {"recommended": (np.arange(count) == order[0]) & (room > LEAST_ROOM)}
    if len(wanted):
        usable = allowed & np.isfinite(wanted).all(axis=0)
        marks["pareto"] = usable & ~_beaten(wanted, usable)
        if len(wanted) == 1 and usable.any():
            marks["best"] = np.arange(count) == int(np.argmin(np.where(usable, wanted[0], np.inf)))
    return marks


def _beaten(wanted: Array, usable: Any) -> Any:
    """Return the points to which another point is equal in every goal and better in one."""
    out = np.zeros(wanted.shape[1], dtype=bool)
    others = wanted[:, usable]
    for i in np.flatnonzero(usable):
        own = wanted[:, i : i + 1]
        out[i] = bool(((others <= own).all(axis=0) & (others < own).any(axis=0)).any())
    return out


def _with_dwell(case: Case, axes: Sequence[Axis], judged: Judged, chosen: Any, data: xr.Dataset) -> xr.Dataset:
    """Return a plan with the motion at its recommended point, and the case whose dwell it is."""
    if chosen is None or not chosen.any():
        return data
    number = int(np.flatnonzero(chosen)[0])
    columns = judged.found.columns
    for axis, value in zip(axes, judged.points.values[number], strict=True):
        case = case.replace(axis.path, float(value))
    start = {
        "amplitude": float(columns["amplitude"][number, 0]),
        "phase": float(np.radians(columns["phase"][number, 0])),
    }
    case = case.replace(experiment=Dwell(zc=float(judged.points.zc[number]), start=start))
    data.attrs["recommended_case"] = case.to_toml()
    dwell = run(case)
    if abs(float(dwell["amplitude"][0]) / start["amplitude"] - 1.0) < SAME:  # a fragile state may be left
        for name in TRACES:
            data[name] = dwell[name].reset_coords(drop=True)
        pieces = [replace(piece, text=f"At the recommended settings: {piece.text}") for piece in advice_in(dwell)]
        data.attrs |= attributes(pieces)
    return data
