"""The regime map: where attractive and repulsive states exist over a parameter and the set point, with solved boundaries.

For each set point the operating points are followed along the parameter as lines, through folds and unstable stretches. A
boundary is where a stable stretch ends, where the net force changes its sign, or where the tip just touches; each is
located on its line, and none depends on a grid.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.case._paths import with_number
from dforce.errors import ParameterError, checked
from dforce.experiments._experiment import Progress
from dforce.runs import watched
from dforce.sweeps._axes import Axis, make_axes
from dforce.sweeps._seeds import Curves, Seed, curves_of
from dforce.sweeps.loci import Condition, Knob, Lines, Place

if TYPE_CHECKING:
    import xarray as xr

    from dforce.kernel import Array

# what a cell of the map says; its numbers stand in the result
REGIMES = ("none", "no contact", "attractive", "both", "repulsive")
FOLD, UNSTABLE, NET_FORCE, CONTACT, END = "fold", "instability", "net force", "contact", "end"
SCALARS = (
    "amplitude", "phase", "peak_force", "min_force", "mean_force", "min_distance", "max_indentation", "contact_time",
    "total_dissipated_energy",
)  # fmt: skip
SAME = 0.01  # of the free amplitude: a motion so near to a line lies on it
DEEPEST = -3.0  # free amplitudes: lines are not followed to smaller distances
MOST_SET_POINTS = 200
MOST_VALUES = 2000
RANGE_OF_FACTORS = 1e-6  # values whose factors are as even as this lie on a logarithmic scale


@dataclass
class Line:
    """The operating points at a set point along the parameter, in order, and the boundaries on it."""

    set_point: float
    places: list[Place]
    edges: list[tuple[str, Place]]


@checked
def regimes(
    case: Case,
    over: Mapping[str, Any],
    set_points: Any = None,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    r"""Return the regime map: which states there are at set points, over a parameter, with boundaries solved by continuation.

    At each set point :math:`s` the orbit, the distance and the parameter :math:`p` satisfy
    :math:`P(x, z_c, p) = x` and :math:`A(x, z_c, p) = s A_0`. The states that approach and retract meet at the values given are
    the starts of lines along the parameter, which also find states that no approach leads to.

    Parameters
    ----------
    case
        The case; its experiment is not used. Its forces have no memory and no branches.
    over
        One path with its values, such as ``{"drive.A0": {"start": "2 nm", "stop": "40 nm", "points": 39}}``.
    set_points
        Shares :math:`A / A_0`: a list, or ``{"start": 0.5, "stop": 0.95, "points": 19}``; left out: that.
    progress
        True for a bar, or a function called as ``progress(done, total, note)``; Ctrl-C keeps the set points that are done.

    Returns
    -------
    xarray.Dataset
        Over the parameter and `set_point`: `regime`, a number whose meaning is in its attributes (``"none"``,
        ``"no contact"``: net attraction, and the tip never touches; ``"attractive"``, ``"both"``, ``"repulsive"``), and
        `states`, how many stable states there are. Along `edge` the boundaries: `edge_kind` (``"fold"``, ``"net force"``,
        ``"contact"``, ``"end"``, ``"instability"``), their parameter, set point, distance, phase and forces. Along `point` the
        lines themselves, with `line_stable`. :func:`dforce.plot.map` draws it.

    Raises
    ------
    ParameterError
        For a path that the case does not have, more than one, values or set points that are not allowed, and forces with
        memory or branches.
    """
    axes = make_axes(case, over)
    shares = shares_of(set_points)
    knob = knob_of(axes)
    refuse_others(case)
    if len(axes[0].values) > MOST_VALUES:
        raise ParameterError(f"{axes[0].path} has {len(axes[0].values)} values; at most {MOST_VALUES} are allowed here")
    bare = case.model_copy(update={"sweep": None})
    with watched(progress, case.title) as tell:
        curves = curves_of(bare, {axes[0].path: np.array(axes[0].values)}, float(shares.min()), _nothing)
        lines: list[Line] = []
        done = 0
        try:
            if curves.interrupted:
                raise KeyboardInterrupt
            for done, share in enumerate(shares):
                note = f"A/A0 = {share:.3g}"
                tell(done, len(shares), note)
                lines += lines_at(bare, axes[0], knob, curves, float(share), _watch(tell, done, len(shares), note))
            done = len(shares)
            tell(done, done, "")
        except KeyboardInterrupt:
            pass
    data = _dataset(case, axes[0], knob, shares, lines)
    return data if done == len(shares) else data.assign_attrs(interrupted=1)


def _watch(tell: Progress, done: int, total: int, note: str) -> Callable[[], None]:
    return lambda: tell(done, total, note)


def _nothing(done: int, total: int, note: str) -> None:
    """Tell nobody."""


def shares_of(given: Any) -> Array:
    """Return set points in rising order.

    Raises
    ------
    ParameterError
        When there are none, too many, or one that is not between 0 and 1.
    """
    given = {"start": 0.5, "stop": 0.95, "points": 19} if given is None else given
    if isinstance(given, Mapping):
        missing = {"start", "stop", "points"} ^ set(given)
        if missing:
            raise ParameterError("set_points must be a list or { start, stop, points }")
        if not isinstance(given["points"], int) or not 1 <= given["points"] <= MOST_SET_POINTS:
            raise ParameterError(
                f"set_points.points = {given['points']} is not a whole number from 1 to {MOST_SET_POINTS}"
            )
        given = np.linspace(float(given["start"]), float(given["stop"]), given["points"])
    try:
        shares = np.unique(np.atleast_1d(np.asarray(given, dtype=float)))
    except (TypeError, ValueError):
        raise ParameterError("set_points are not a list of numbers between 0 and 1") from None
    if shares.ndim != 1 or not 1 <= len(shares) <= MOST_SET_POINTS:
        raise ParameterError(f"set_points has {shares.size} values; 1 to {MOST_SET_POINTS} are allowed")
    for share in shares:
        if not 0.0 < share < 1.0:
            raise ParameterError(f"set_points holds {share:g}, which is not between 0 and 1")
    return shares


def knob_of(axes: Sequence[Axis]) -> Knob:
    """Return the only parameter that varies, with its range."""
    if len(axes) != 1:
        raise ParameterError("a regime map is over one parameter and the set point; give one path")
    axis = axes[0]
    if axis.quantity is None:
        raise ParameterError(f"{axis.path} takes no plain number, so no boundary can be followed along it")
    low, high = min(axis.values), max(axis.values)
    if len(axis.values) < 2 or low == high:
        raise ParameterError(f"{axis.path} has one value; a map needs a range")
    values = np.sort(np.array(axis.values))
    with np.errstate(divide="ignore", invalid="ignore"):
        factors = np.diff(np.log(values)) if low > 0.0 else np.array([np.nan, 0.0])
    even = low > 0.0 and len(values) > 2 and bool(np.ptp(factors) < RANGE_OF_FACTORS * factors.max())
    return Knob(axis.path, low, high, is_log=even)


def refuse_others(case: Case) -> None:
    """Raise ParameterError for forces with memory or branches, tones without a common period, and transients."""
    from dforce.observables.window import common_period

    for force in case.problem.forces:
        if force.memory or force.switch is not None:
            raise ParameterError(
                f"{force.name} remembers earlier motion, and operating points are solved for forces that do not"
            )
    if common_period([tone.frequency for tone in case.problem.tones]) is None:
        raise ParameterError("the tones have no common period, so there are no periodic orbits at a set point; "
                             "choose a simple ratio of their frequencies, such as 6.2")  # fmt: skip
    if case.solver.method != "periodic":
        raise ParameterError(
            'operating points are periodic orbits; leave out solver.method, or write method = "periodic"'
        )


def lines_at(
    case: Case, axis: Axis, knob: Knob, curves: Curves, share: float, watch: Callable[[], None]
) -> list[Line]:  # fmt: skip
    """Return the lines of operating points at a set point."""
    length = max(problem_at(case, [axis], (float(value),)).tones[0].A0 for value in axis.values)
    lines = Lines(case, [knob], [Condition(lambda found, _: float(found["amplitude_ratio"]) - share)], length, watch)
    out: list[Line] = []
    for seed in curves.seeds([share]):
        value = float(axis.values[seed.case])
        if any(_lies_on(line.places, lines, knob.scaled(value), seed, value, case, axis) for line in out):
            continue
        start = lines.seed(scaled_motion(problem_at(case, [axis], (value,)), seed.motion), seed.zc, [value])
        if start is None:
            continue
        places = lines.trace(start, lambda place: bool(place.u[lines.size] > DEEPEST))
        out.append(Line(share, places, _edges(lines, places, case.problem.a0)))
    return out


def problem_at(case: Case, axes: Sequence[Axis], values: Sequence[float]) -> Any:
    """Return the problem at values of the parameters."""
    from dforce.problem import Problem

    for axis, value in zip(axes, values, strict=True):
        case = with_number(case, axis.path, value)
    return Problem.build(
        case.cantilever, case.drive, case.tip, case.sample, case.contact, case.medium, case.forces, case.readout
    )


def scaled_motion(problem: Any, motion: Array) -> Array:
    """Return a motion in SI as the scaled motion of a problem."""
    from dforce.experiments._motion import base_of, scales_of, states_of

    return np.asarray(states_of(motion[None], problem, scales_of(problem), base_of(problem)).x[0])


def _lies_on(
    places: list[Place], lines: Lines, scaled: float, seed: Seed, value: float, case: Case, axis: Axis
) -> bool:  # fmt: skip
    """Say whether a seed lies on a line, where that passes its value of the parameter."""
    x = scaled_motion(problem_at(case, [axis], (value,)), seed.motion)
    for u in _crossings(places, scaled, lines.size + 1):
        # the seed is beside the set point: both its motion and its distance differ from the line's by as much
        moved = abs(seed.zc / lines.length - u[lines.size])
        if np.abs(x - u[: lines.size]).max() < SAME + 2.0 * moved and moved < 5.0 * SAME:
            return True
    return False


def _crossings(places: list[Place], scaled: float, first: int) -> list[Array]:
    """Return the points of a line, interpolated, at a scaled value of the parameter."""
    out = []
    for a, b in itertools.pairwise(places):
        low, high = a.u[first] - scaled, b.u[first] - scaled
        if low == 0.0 or low * high < 0.0:
            share = 0.0 if low == 0.0 else low / (low - high)
            out.append(np.asarray(a.u + share * (b.u - a.u)))
    if places and places[-1].u[first] == scaled:
        out.append(places[-1].u)
    return out


def _edges(lines: Lines, places: list[Place], a0: float) -> list[tuple[str, Place]]:
    """Return the boundaries between stable stretches of a line and others, located."""
    tests: dict[str, Callable[[Place], float]] = {
        FOLD: lambda place: place.index,
        NET_FORCE: lambda place: place.measured["virial"],
        CONTACT: lambda place: place.measured["min_distance"] - a0,
    }
    found = [(END, place) for place in places if place.is_turn and place.is_stable]
    for a, b in itertools.pairwise(places):
        if not (a.is_stable or b.is_stable):
            continue
        kinds = [kind for kind, test in tests.items() if test(a) * test(b) < 0.0]
        found += [(kind, lines.between(a, b, tests[kind])) for kind in kinds]
        if a.is_stable != b.is_stable and FOLD not in kinds:
            found.append((UNSTABLE, a if a.is_stable else b))
    return found


def _kind(place: Place, a0: float) -> str:
    if place.measured["virial"] < 0.0:
        return "repulsive"
    return "no contact" if place.measured["min_distance"] > a0 else "attractive"


def cells(lines: Sequence[Line], axis_values: Array, shares: Array, knob: Knob, a0: float) -> tuple[Any, Any]:
    """Return the regime (its number) and how many stable states there are, (values, set points)."""
    regime = np.zeros((len(axis_values), len(shares)), dtype=np.int8)
    count = np.zeros_like(regime)
    for j, share in enumerate(shares):
        of_share = [line for line in lines if line.set_point == share]
        for i, value in enumerate(axis_values):
            kinds: list[str] = []
            for line in of_share:
                kinds += _stable_at(line.places, knob.scaled(value), a0)
            count[i, j] = len(kinds)
            regime[i, j] = REGIMES.index(_together(set(kinds)))
    return regime, count


def _stable_at(places: list[Place], scaled: float, a0: float) -> list[str]:
    """Return the regimes of the stable states of a line at a value of the parameter; of two neighbors the nearer decides."""
    out = []
    first = places[0].size + 1
    for a, b in itertools.pairwise(places):
        low, high = a.u[first] - scaled, b.u[first] - scaled
        if low == 0.0 or low * high < 0.0 or (high == 0.0 and b is places[-1]):
            near = a if abs(low) <= abs(high) else b
            if near.is_stable:
                out.append(_kind(near, a0))
    return out


def _together(kinds: set[str]) -> str:
    if not kinds:
        return "none"
    if "repulsive" in kinds:
        return "repulsive" if kinds == {"repulsive"} else "both"
    return "attractive" if "attractive" in kinds else "no contact"


def _dataset(case: Case, axis: Axis, knob: Knob, shares: Array, lines: list[Line]) -> xr.Dataset:
    import xarray as xr

    from dforce.results import describe, provenance

    a0 = case.problem.a0
    values = np.array(axis.values, dtype=float)
    regime, count = cells(lines, values, shares, knob, a0)
    data = xr.Dataset(coords={axis.name: axis.coordinate(), "set_point": shares})
    data["regime"] = (axis.name, "set_point"), regime
    data["states"] = (axis.name, "set_point"), count
    meanings = " ".join(word.replace(" ", "_") for word in REGIMES)
    data["regime"].attrs = {"flag_values": np.arange(len(REGIMES)), "flag_meanings": meanings, "long_name": "regime"}
    data["states"].attrs = {"units": "1", "long_name": "number of stable states"}
    edges = [(line.set_point, kind, place) for line in lines for kind, place in line.edges]
    points = [(line.set_point, number, place) for number, line in enumerate(lines, start=1) for place in line.places]
    data["edge_kind"] = "edge", np.array([kind for _, kind, _ in edges], dtype=np.str_)
    data["line"] = "point", np.array([number for _, number, _ in points], dtype=np.int64)
    data["line_stable"] = "point", np.array([place.is_stable for *_, place in points], dtype=bool)
    length = max(problem_at(case, [axis], (float(value),)).tones[0].A0 for value in values)
    for prefix, dim, rows in (("edge", "edge", edges), ("line", "point", points)):
        for name, column in _columns(axis, knob, length, [(row[0], row[-1]) for row in rows]).items():
            data[f"{prefix}_{name}"] = dim, column
            data[f"{prefix}_{name}"].attrs = _words(axis, name)
    data = describe(data)
    data["set_point"].attrs = {"units": "1", "long_name": "set point", "symbol": "A/A_0"}
    bare = case.model_copy(update={"sweep": None})
    data.attrs = provenance(bare.to_toml(complete=True), case.title) | {"map_over": f"{axis.path} set_point"}
    return data


def _columns(axis: Axis, knob: Knob, length: float, rows: list[tuple[float, Place]]) -> dict[str, Array]:
    columns: dict[str, Array] = {
        axis.name: np.array([knob.value(float(place.u[place.size + 1])) for _, place in rows]),
        "set_point": np.array([share for share, _ in rows]),
        "zc": np.array([float(place.u[place.size]) * length for _, place in rows]),
    }
    for name in SCALARS:
        columns[name] = np.array([place.measured.get(name, np.nan) for _, place in rows])
    return columns


def _words(axis: Axis, name: str) -> dict[str, str]:
    from dforce.quantities import AXES, OBSERVABLES

    if name == axis.name and axis.quantity is not None:
        return {"units": axis.quantity.unit, "long_name": axis.quantity.doc}
    if name == "set_point":
        return {"units": "1", "long_name": "set point"}
    row = OBSERVABLES.get(name) or AXES[name]
    return {"units": row.unit, "long_name": row.label, "symbol": row.symbol}
