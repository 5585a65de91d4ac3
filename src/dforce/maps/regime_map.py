"""The regime map: where attractive and repulsive states exist over two parameters, with solved boundaries.

For each set point, or each value of a second parameter, the operating points are followed along the first parameter as lines,
through folds and unstable stretches. At a boundary a stable stretch ends, the net force changes its sign, or the tip just
touches. Each is located on its line, and none depends on a grid.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.case.paths import with_number
from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, checked
from dforce.core.quantities import AXES, OBSERVABLES
from dforce.core.stopping import heard
from dforce.experiments.base import Progress
from dforce.maps.axes import Axis, make_axes
from dforce.maps.loci import FreeParameter, LineOrbit
from dforce.maps.seeds import Curves, curves_of
from dforce.maps.state_lines import REGIMES, Row, StateLine, cells, lines_at
from dforce.observables.averaging import common_period
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.runs import watched

if TYPE_CHECKING:
    import xarray as xr


SCALARS = (
    "amplitude",
    "phase",
    "peak_force",
    "min_force",
    "mean_force",
    "min_distance",
    "max_indentation",
    "contact_time",
    "total_dissipated_energy",
)
MOST_SET_POINTS = 200
MOST_VALUES = 2000  # of a parameter
RANGE_OF_FACTORS = 1e-6  # values whose factors are as even as this lie on a logarithmic scale


@checked
def regimes(
    case: Case, over: Mapping[str, Any], set_points: Any = None, progress: Progress | bool | None = None
) -> xr.Dataset:
    r"""Return the regime map: the states at set points over a parameter, with boundaries solved by continuation.

    At each set point :math:`s` the orbit, the distance and the parameter :math:`p` satisfy :math:`P(x, z_c, p) = x` and
    :math:`A(x, z_c, p) = s A_0`, with the map :math:`P` of the motion :math:`x` over a period. Lines along the parameter
    begin at the states on approach and retract, at the listed values. They also find states that no approach leads to.

    Parameters
    ----------
    case
        The case; its experiment is not used.
    over
        One path with its values, such as ``{"drive.A0": {"start": "2 nm", "stop": "40 nm", "points": 39}}``, or two, for a map
        over both at one set point; lines follow the first path.
    set_points
        Shares :math:`A / A_0`: a list, or ``{"start": 0.5, "stop": 0.95, "points": 19}``, the default. With two paths: one
        share.
    progress
        True for a bar, or a function called as ``progress(done, total, note)``; Ctrl-C keeps the finished rows of the map.

    Returns
    -------
    xarray.Dataset
        Over the parameter and `set_point`, or over both parameters: `states`, the number of stable states, and `regime`. The
        attributes of `regime` explain its numbers: ``"none"``, ``"no contact"`` (net attraction, and the tip never touches),
        ``"attractive"``, ``"both"``, ``"repulsive"``. Along `edge` the boundaries: `edge_kind` (``"fold"``, ``"net force"``,
        ``"contact"``, ``"end"``, ``"instability"``, ``"grazing"``, ``"lost"``), their parameters, distance, phase and forces.
        Along `point` the lines, with `line_stable`. :func:`dforce.plot.map` draws it.

    Raises
    ------
    ParameterError
        For an unknown path, more than two paths, and values or set points that are not allowed. Also for a lock, a lever that
        changes with distance, tones without a common period, and ``solver.method = "transient"``.
    """
    axes = make_axes(case, over)
    shares = shares_of(set_points)
    free_parameter = free_parameter_of(axes, shares)
    refuse_others(case)
    for axis in axes:
        if len(axis.values) > MOST_VALUES:
            raise ParameterError(f"{axis.path} has {len(axis.values)} values; at most {MOST_VALUES} are allowed here")
    bare = case.model_copy(update={"sweep": None})
    rows = [Row(bare, float(share), float(share)) for share in shares]
    if len(axes) == 2:
        second = axes[1]
        rows = [Row(with_number(bare, second.path, value), float(shares[0]), value) for value in second.values]
    with watched(progress, case.title) as report_progress:
        lines, done = _lines(rows, axes, free_parameter, report_progress)
    data = _dataset(case, axes, free_parameter, rows[:done], lines, float(shares[0]))
    return data if done == len(rows) else data.assign_attrs(interrupted=1)


def _lines(
    rows: Sequence[Row], axes: Sequence[Axis], free_parameter: FreeParameter, report_progress: Progress
) -> tuple[list[StateLine], int]:
    """Return the lines of all rows, and how many rows are done."""
    lines: list[StateLine] = []
    done, lowest, curves = 0, min(row.share for row in rows), Curves([])
    values = {axes[0].path: np.array(axes[0].values)}

    def report(note: str, *_: Any) -> None:
        report_progress(done, len(rows), note)

    try:
        for done, row in enumerate(rows):
            report(f"row {done + 1}")
            if not curves.parts or len(axes) == 2:
                # the curves show nothing of their own progress, and can be stopped
                curves = curves_of(row.case, values, lowest, partial(report, "curves"))
            if curves.interrupted:
                return lines, done
            lines += lines_at(row, axes[0], free_parameter, curves, partial(report, f"row {done + 1}"))
        report_progress(len(rows), len(rows), "")
    except KeyboardInterrupt:
        heard()
        return lines, done
    return lines, len(rows)


def shares_of(given: Any) -> Array:
    """Return set points in rising order.

    Raises
    ------
    ParameterError
        When there are none or too many, or a set point is not between 0 and 1.
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
        start, stop = (units.parse_share(given[end], f"set_points.{end}") for end in ("start", "stop"))
        given = np.linspace(start, stop, given["points"])
    several = not isinstance(given, str | type) and hasattr(given, "__iter__") and getattr(given, "shape", None) != ()
    items = list(itertools.islice(given, MOST_SET_POINTS + 1)) if several else [given]
    shares = np.unique([units.parse_share(item, "set_points") for item in items])
    if not 1 <= len(shares) <= MOST_SET_POINTS:
        raise ParameterError(f"set_points has {shares.size} values; 1 to {MOST_SET_POINTS} are allowed")
    for share in shares:
        if not 0.0 < share < 1.0:
            raise ParameterError(f"set_points contains {share:g}, which is not between 0 and 1")
    return shares


def free_parameter_of(axes: Sequence[Axis], shares: Array) -> FreeParameter:
    """Return the parameter along which lines go, with its range."""
    if len(axes) > 2:
        raise ParameterError(
            f"over has {len(axes)} paths; a regime map is over one path and the set point, or over two paths"
        )
    if len(axes) == 2 and len(shares) > 1:
        raise ParameterError(
            "a regime map over two parameters is at one set point; write for example set_points = [0.8]"
        )
    for axis in axes:
        if axis.quantity is None:
            raise ParameterError(f"{axis.path} is not a plain number, so no boundary can be followed along it")
        if axis.path == "contact.a0":
            raise ParameterError("contact.a0 defines the start of contact, so no map goes over it")
    axis = axes[0]
    low, high = min(axis.values), max(axis.values)
    if len(axis.values) < 2 or low == high:
        raise ParameterError(f"{axis.path} has one value; a map needs a range")
    values = np.sort(np.array(axis.values))
    with np.errstate(divide="ignore", invalid="ignore"):
        factors = np.diff(np.log(values)) if low > 0.0 else np.array([np.nan, 0.0])
    even = low > 0.0 and len(values) > 2 and bool(np.ptp(factors) < RANGE_OF_FACTORS * factors.max())
    return FreeParameter(axis.path, low, high, is_log=even)


def refuse_others(case: Case) -> None:
    """Raise ParameterError for a lever that changes, a lock, tones without a common period, and transients."""
    case.problem.refuse_lock("a search for operating points")
    case.problem.refuse_changing_lever("a search for operating points")
    if common_period([tone.frequency for tone in case.problem.tones]) is None:
        raise ParameterError(
            "the tones have no common period, so no periodic orbits exist at a set point; "
            "choose a simple ratio of their frequencies, such as 6.2"
        )
    if case.solver.method != "periodic":
        raise ParameterError('operating points are periodic orbits; remove solver.method, or write method = "periodic"')


def _dataset(
    case: Case,
    axes: Sequence[Axis],
    free_parameter: FreeParameter,
    rows: Sequence[Row],
    lines: list[StateLine],
    share: float,
) -> xr.Dataset:
    import xarray as xr

    axis, row_name = axes[0], axes[1].name if len(axes) == 2 else "set_point"
    at = np.array([row.row for row in rows])
    regime, count = cells(lines, np.array(axis.values, dtype=float), at, free_parameter, case.problem.a0)
    row_words = {"units": "1", "long_name": "set point", "symbol": "A/A_0"}
    row_axis = (row_name, at, axes[1].coordinate()[2] if len(axes) == 2 else row_words)
    data = xr.Dataset(coords={axis.name: axis.coordinate(), row_name: row_axis})
    data["regime"] = (axis.name, row_name), regime
    data["states"] = (axis.name, row_name), count
    meanings = " ".join(word.replace(" ", "_") for word in REGIMES)
    data["regime"].attrs = {"flag_values": np.arange(len(REGIMES)), "flag_meanings": meanings, "long_name": "regime"}
    data["states"].attrs = {"units": "1", "long_name": "number of stable states"}
    edges = [(line, place) for line in lines for _, place in line.edges]
    points = [(line, place) for line in lines for place in line.places]
    numbers = {id(line): number for number, line in enumerate(lines, start=1)}
    data["edge_kind"] = "edge", np.array([kind for line in lines for kind, _ in line.edges], dtype=np.str_)
    data["line"] = "point", np.array([numbers[id(line)] for line, _ in points], dtype=np.int64)
    data["line_stable"] = "point", np.array([place.is_stable for _, place in points], dtype=bool)
    words = {axis.name: axis.coordinate()[2], row_name: row_axis[2]}
    for prefix, dim, found in (("edge", "edge", edges), ("line", "point", points)):
        for name, column in _columns(axis.name, row_name, free_parameter, found).items():
            data[f"{prefix}_{name}"] = dim, column
            data[f"{prefix}_{name}"].attrs = words.get(name) or _words(name)
    data = describe(data)
    data.attrs = of_case(case.model_copy(update={"sweep": None}))
    data.attrs["map_over"] = " ".join([*(one.path for one in axes), *["set_point"] * (len(axes) == 1)])
    return data if len(axes) == 1 else data.assign_attrs(set_point=share)


def _columns(
    name: str, row_name: str, free_parameter: FreeParameter, found: Sequence[tuple[StateLine, LineOrbit]]
) -> dict[str, Array]:
    columns: dict[str, Array] = {
        name: np.array([free_parameter.value(place.value) for _, place in found]),
        row_name: np.array([line.row for line, _ in found]),
        "zc": np.array([float(place.u[0]) * line.length for line, place in found]),
    }
    for scalar in SCALARS:
        columns[scalar] = np.array([place.measured.get(scalar, np.nan) for _, place in found])
    return columns


def _words(name: str) -> dict[str, str]:
    return (OBSERVABLES.get(name) or AXES[name]).words
