"""Lines of states, stable ones solid and unstable ones dashed: of a picture of their own, or under a curve."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from dforce.case import case_of
from dforce.core.arrays import Array, Bools, Indices
from dforce.core.errors import DForceError, ParameterError
from dforce.results.dataset import reader_unit

MARKS: dict[str, dict[str, Any]] = {
    "fold": {"marker": "o", "label": "fold"},
    "period_doubling": {"marker": "s", "label": "period doubling"},
    "torus": {"marker": "D", "label": "torus"},
    "grazing": {"marker": "|", "label": "grazing", "markersize": 9.0},
    "end": {"marker": "x", "label": "end"},
}
UNSTABLE = (0, (3, 2))  # dashes
WIDTH, THIN = 1.4, 0.7  # of a line; of one whose motions repeat only after several common periods
APART = ("title", "about", "experiment", "solver")  # parts of a case that do not decide which states it has
BEHIND = 1.6  # zorder of states under a curve, whose own is 2
UNDER: dict[str, dict[str, Any]] = {
    "stable states": {"color": "black", "linewidth": THIN, "linestyle": "-"},
    "unstable states": {"color": "black", "linewidth": THIN, "linestyle": UNSTABLE},
}


def check_states(states: xr.Dataset) -> None:
    """Raise :class:`ParameterError` where a result has no curves of states."""
    if not {"branch", "stable", "special"} <= {*states.variables} or "along" not in states.attrs:
        raise ParameterError("this result has no curves of states; compute them with df.branches")


def check_under(states: xr.Dataset, dataset: xr.Dataset) -> None:
    """Raise :class:`ParameterError` where states do not belong to the case of a curve, along the distance."""
    check_states(states)
    along = states.attrs["along"]
    if along != "zc":
        raise ParameterError(
            f"these states lie along {along}, not along zc; compute them with df.branches(case, zc=...)"
        )
    if "zc" not in dataset.dims:
        raise ParameterError("states are drawn under the curve of an approach, but this result is not an approach")
    try:
        same = _matter(dataset) == _matter(states)
    except DForceError:  # the case of a version that knew other keys
        same = dataset.attrs.get("case") == states.attrs.get("case")
    if not same:
        raise ParameterError("states and curve have different instruments, samples or forces")


def _matter(result: xr.Dataset) -> Any:
    """Return the part of a result's case that decides its states: all without experiment and solver."""
    case = case_of(result)
    return {name: getattr(case, name) for name in type(case).model_fields if name not in APART}


def draw_states(axes: Axes, x: Array, y: Array, states: xr.Dataset, colors: Mapping[int, str]) -> None:
    """Draw values along all curves, in pieces that are stable or not, and mark special points; a color for each curve."""
    several = are_several(states)
    for number, points, stable in _pieces(states):
        style: Any = "-" if stable else UNSTABLE
        width = THIN if several[points[0]] else WIDTH
        axes.plot(x[points], y[points], color=colors[number], linestyle=style, linewidth=width)
    for name, look in MARKS.items():
        there = states["special"].values == name
        if there.any():
            axes.plot(x[there], y[there], linestyle="none", color="black", zorder=4, **({"markersize": 4.0} | look))


def draw_under(axes: Axes, variable: xr.DataArray, states: xr.Dataset, scale: float, named: bool = True) -> None:
    """Draw a quantity of states thinly behind a curve against zc, with its folds, to be named in a legend or not.

    `scale` is the scale of the curve.
    """
    across, _ = reader_unit(states["zc"])
    x, y = np.asarray(states["zc"].values) / across, np.asarray(variable.values) / scale
    said = set() if named else {*UNDER}
    for _, points, stable in _pieces(states):
        name = "stable states" if stable else "unstable states"
        axes.plot(x[points], y[points], label="" if name in said else name, zorder=BEHIND, **UNDER[name])
        said.add(name)
    folds = states["special"].values == "fold"
    if folds.any():
        axes.plot(x[folds], y[folds], "o", color="black", markersize=3.0, zorder=BEHIND, label="fold" if named else "")


def are_several(states: xr.Dataset) -> Bools:
    """Return at which points the motion repeats only after several of the shortest time that any needs."""
    periods = repeats(states)
    return np.asarray(periods > periods.min())


def repeats(states: xr.Dataset) -> Indices:
    """Return after how many periods the motion at each point repeats; 1 in a result of an older version without them."""
    if "repeat_periods" in states:
        return np.asarray(states["repeat_periods"].values, dtype=np.int64)
    return np.ones(states.sizes["point"], dtype=np.int64)


def _pieces(states: xr.Dataset) -> Iterator[tuple[int, Indices, bool]]:
    """Give the pieces of all curves that are stable or not: the curve's number, the points, and whether they are stable."""
    curve, stable = states["branch"].values, states["stable"].values
    for number in np.unique(curve):
        (points,) = np.nonzero(curve == number)
        cuts = np.flatnonzero(np.diff(stable[points])) + 1
        for piece in np.split(points, cuts):
            # a piece reaches to the next one's first point, so that the curve has no gaps
            reach = np.append(piece, piece[-1] + 1) if piece[-1] < points[-1] else piece
            yield int(number), reach, bool(stable[piece[0]])
