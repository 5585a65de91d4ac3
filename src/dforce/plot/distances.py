"""Pictures against the average distance: amplitude and phase, or any other quantity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from dforce.case import case_of
from dforce.core.arrays import AnyArray, Array
from dforce.core.errors import DForceError, ParameterError, checked
from dforce.plot._points import draw_points
from dforce.plot._states import check_under, draw_under
from dforce.plot._style import (
    DIRECTIONS,
    GRAY,
    VERMILLION,
    axis_text,
    color_cycle,
    colored_axes,
    head,
    new_figure,
    take,
    tidy,
    without_errors,
)
from dforce.results.dataset import COLUMN_DIMS, reader_unit
from dforce.results.significance import largest_error
from dforce.results.status import Status

WORDS = {"m": "length", "N": "force", "J": "energy", "s": "time", "degree": "phase lag"}
CURVE = ("zc", "direction")  # dimensions of the quantities that are drawn against the distance
RESONANCE = 90.0  # degrees: the phase of free motion at resonance; above it attraction prevails, below it repulsion
FEW_POINTS = 40  # so few that each is worth a dot


@checked
def amplitude_phase(
    dataset: xr.Dataset,
    tone: int = 1,
    figure: FigureBase | None = None,
    states: xr.Dataset | None = None,
    measured: xr.Dataset | None = None,
) -> tuple[Axes, Axes]:
    """Draw amplitude and phase of a drive tone against the average distance, one above the other.

    Approach and retract have their own colors and dashes; points that did not settle have a ring, points
    without a result a cross. Above the line at the free phase (90° at resonance) the net force is attractive, below the
    line repulsive.
    `states` is a result of :func:`dforce.branches` of the same case: thin black lines behind the curve, unstable states
    dashed. `measured` is a curve from :func:`dforce.calibrate`: gray points, with its heights as average distances.

    Raises
    ------
    ParameterError
        When the result has no amplitudes against zc, or no such tone, and when `states` are of another case or along
        another parameter.
    """
    variables = [_column(take(dataset, name, *CURVE), tone) for name in ("amplitude", "phase")]
    if states is not None:
        check_under(states, dataset)
    figure = new_figure(figure, 6.0, 6.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    for axes, variable in zip((upper, lower), variables, strict=True):
        _lines(axes, variable, dataset)
        if states is not None:
            under = take(states, str(variable.name), "point").sel(tone=tone, drop=True)
            draw_under(axes, under, states, reader_unit(variable)[0])
        if measured is not None:
            across, up = ("zc", reader_unit(dataset["zc"])[0]), (str(variable.name), reader_unit(variable)[0])
            draw_points(axes, measured, across, up, tone)
    upper.set_xlabel("")
    upper.set_ylim(bottom=min(0.0, upper.get_ylim()[0]))
    phase_axis(lower, free_phase(dataset, tone))
    _legend(upper)
    extra = f"tone {tone}" if dataset.sizes.get("tone", 1) > 1 else ""
    head(upper, dataset, extra)
    return upper, lower


def free_phase(dataset: xr.Dataset, tone: int = 1) -> float:
    """Return the phase of free motion (degrees) in the case of a result; 90 where it has none."""
    try:
        problem = case_of(dataset).problem
    except DForceError:
        return RESONANCE
    return problem.free_lag(tone - 1) if tone <= len(problem.tones) else RESONANCE


def phase_axis(axes: Axes, free: float) -> None:
    """Give a phase its axis: ticks at parts of a turn, and a line at the free phase, between attraction and repulsion."""
    low, high = axes.dataLim.intervaly
    low, high = (low, high) if np.isfinite([low, high]).all() else (free, free)
    low, high = min(low, free - 15.0), max(high, free + 15.0)
    margin = 0.05 * (high - low)
    bottom = max(low - margin, 0.0) if low >= 0.0 else low - margin
    top = min(high + margin, 180.0) if high <= 180.0 else high + margin
    axes.set_ylim(bottom, top)
    axes.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 1.5, 3, 5, 10]))
    axes.axhline(free, color=GRAY, linewidth=0.8, linestyle=":", zorder=1)
    for text, side, place in (("net attraction", 3.0, "bottom"), ("net repulsion", -3.0, "top")):
        axes.annotate(
            text,
            (0.01, free),
            (0.0, side),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            va=place,
            ha="left",
            color=GRAY,
            fontsize="x-small",
        )


@checked
def curve(
    dataset: xr.Dataset, names: str | Sequence[str], figure: FigureBase | None = None, states: xr.Dataset | None = None
) -> list[Axes]:
    """Draw any quantities against the average distance, each with its own colored axis.

    Parameters
    ----------
    dataset
        Result of an approach.
    names
        One name or several, such as ``["peak_force", "total_dissipated_energy"]``. Quantities in the same unit share an axis.
        All tones, modes or harmonics of a quantity are drawn.
    states
        A result of :func:`dforce.branches` of the same case. All states are thin black lines behind the curve, unstable states
        dashed.

    Raises
    ------
    ParameterError
        For a quantity that the result lacks or that does not depend on zc, and for `states` of another case or along
        another parameter.
    """
    chosen = [names] if isinstance(names, str) else list(names)
    if not chosen:
        raise ParameterError("nothing to draw; name a quantity")
    variables = [take(dataset, name, *CURVE) for name in chosen]
    for variable in variables:
        if "zc" not in variable.dims:
            raise ParameterError(f"'{variable.name}' has no values against zc; it cannot be drawn as a curve")
    if states is not None:
        check_under(states, dataset)
    figure = new_figure(figure, 6.0 + 0.8 * max(len(chosen) - 2, 0), 4.0)
    axes = curves(figure.subplots(), variables, dataset, states)
    head(axes[0], dataset)
    return axes


def curves(
    host: Axes,
    variables: Sequence[xr.DataArray],
    dataset: xr.Dataset,
    states: xr.Dataset | None = None,
    states_named: bool = True,
) -> list[Axes]:
    """Draw variables on axes, with an axis for each unit, and behind them all states, in the legend or not."""
    units = list(dict.fromkeys(str(variable.attrs.get("units", "1")) for variable in variables))
    axes = colored_axes(host, len(units))
    groups = [[v for v in variables if str(v.attrs.get("units", "1")) == unit] for unit in units]
    every = [label for variable in variables for _, label in _parts(variable)]
    colors = dict(zip(every, color_cycle(len(every)), strict=True)) if len(every) > 1 else {}
    for one, group in zip(axes, groups, strict=True):
        scale, unit = reader_unit(max(group, key=lambda variable: float(np.abs(variable).max())))
        lines = [(part, label) for variable in group for part, label in _parts(variable)]
        for part, label in lines:
            _lines(one, part, dataset, color=colors.get(label), scale=scale)
        if states is not None:
            for variable in group:
                _under(one, variable, states, scale, states_named)
        text = axis_text(group[0], "1") if len(group) == 1 else _common(group)
        one.set_ylabel(f"{text} ({unit})" if unit != "1" else text)
        sizes = np.concatenate([np.ravel(variable.values) for variable in group])
        without_errors(one, sizes, max(largest_error(dataset, str(variable.name)) for variable in group), scale)
        if len(units) > 1:  # the axis has the color of its line, or of none where it has several
            color = colors[lines[0][1]] if len(lines) == 1 else "black"
            one.yaxis.label.set_color(color)
            one.tick_params(axis="y", colors=color)
            one.spines["left" if one is host else "right"].set_color(color)
        if one is not host:
            one.grid(False)
    named = colors if len(every) > len(units) else {}
    _legend(host, axes, named)
    return axes


def _under(axes: Axes, variable: xr.DataArray, states: xr.Dataset, scale: float, named: bool) -> None:
    """Draw a quantity of all states behind its curves, for each tone, mode or harmonic that both have."""
    wanted = {label for _, label in _parts(variable)}
    for part, label in _parts(take(states, str(variable.name), "point")):
        if label in wanted:
            draw_under(axes, part, states, scale, named)


def _common(group: Sequence[xr.DataArray]) -> str:
    """Return the text of an axis that quantities in the same unit share."""
    word = WORDS.get(str(group[0].attrs.get("units")))
    return word or ", ".join(str(variable.attrs.get("long_name", variable.name)) for variable in group)


def _parts(variable: xr.DataArray) -> Iterator[tuple[xr.DataArray, str]]:
    """Give each tone, mode or harmonic of a variable, and the name of its line."""
    name = str(variable.attrs.get("long_name", variable.name))
    for dim in COLUMN_DIMS:
        if dim in variable.dims:
            for label in variable[dim].values:
                part = variable.sel({dim: label}, drop=True)
                yield part, f"{name}, {dim} {label}" if variable.sizes[dim] > 1 else name
            return
    yield variable, name


def _column(variable: xr.DataArray, tone: int) -> xr.DataArray:
    if tone not in variable["tone"].values:
        raise ParameterError(f"this result has no tone {tone}; it has {variable.sizes['tone']}, counted from 1")
    if "zc" not in variable.dims:
        raise ParameterError("this result is not a curve against zc")
    return variable.sel(tone=tone, drop=True)


def sweeps(variable: xr.DataArray) -> Iterator[tuple[str, xr.DataArray]]:
    """Give each direction of a variable and its values; one without a name where there is no direction."""
    if "direction" not in variable.dims:
        yield "", variable
        return
    for direction in variable["direction"].values:
        yield str(direction), variable.sel(direction=direction, drop=True)


def _lines(
    axes: Axes, variable: xr.DataArray, dataset: xr.Dataset, *, color: str | None = None, scale: float | None = None
) -> None:
    """Draw a line for each direction, and mark the points that have no result or did not settle."""
    across, x_unit = reader_unit(dataset["zc"])
    own, unit = reader_unit(variable)
    scale = own if scale is None else scale
    x = np.asarray(dataset["zc"].values, dtype=float) / across
    order = np.argsort(x, kind="stable")
    status = dict(sweeps(dataset["status"])) if "status" in dataset else {}
    for direction, sweep in sweeps(variable):
        look = DIRECTIONS.get(direction, DIRECTIONS["approach"]) | ({"color": color} if color else {})
        look["label"] = look["label"] if direction else ""
        y = np.asarray(sweep.values, dtype=float) / scale
        dot = "." if len(x) < FEW_POINTS else ""
        axes.plot(x[order], y[order], linewidth=1.4, marker=dot, markersize=4.0, **look)
        if direction in status:
            _mark(axes, x, y, np.asarray(status[direction].values), look["color"])
    axes.set_xlabel(axis_text(dataset["zc"], x_unit))
    axes.set_ylabel(axis_text(variable, unit))
    tidy(axes)


def _mark(axes: Axes, x: Array, y: Array, status: AnyArray, color: str) -> None:
    restless = (status == Status.NOT_SETTLED) & np.isfinite(y)
    if restless.any():
        axes.plot(
            x[restless],
            y[restless],
            "o",
            markersize=6.0,
            markerfacecolor="none",
            markeredgecolor=color,
            label="did not settle",
        )
    lost = np.isin(status, (Status.FAILED, Status.UNRESOLVED, Status.BROKEN))
    if lost.any():
        axes.plot(
            x[lost],
            np.zeros(lost.sum()),
            "x",
            color=VERMILLION,
            markersize=6.0,
            clip_on=False,
            zorder=5,
            transform=axes.get_xaxis_transform(),
            label="no result",
        )


def _legend(host: Axes, axes: Sequence[Axes] = (), named: Mapping[str, str] | None = None) -> None:
    """Put one legend on the picture: colors for lines, dashes for directions, then marks."""
    every = list(axes) or [host]
    found: dict[Any, Artist] = {}
    for one in every:
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    entries: dict[Any, Artist] = {name: Line2D([], [], color=color) for name, color in (named or {}).items()}
    for look in DIRECTIONS.values():
        if look["label"] in found:
            # of several colors none is the direction's
            gray = {"color": GRAY} if named or len(every) > 1 else {}
            entries[look["label"]] = Line2D([], [], **(look | gray))
    entries |= {label: handle for label, handle in found.items() if label not in entries}
    if entries:
        # on the axes drawn last, so that no line covers it
        every[-1].legend(list(entries.values()), list(entries), framealpha=0.85, fontsize="small", loc="best")
