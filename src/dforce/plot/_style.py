"""What all pictures share: colors, units for the reader, axes of one color, titles, saving."""

from __future__ import annotations

import os
import textwrap
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase, SubFigure

from dforce.errors import ParameterError, nearest
from dforce.results import COLUMN_DIMS, check_target, reader_unit, whole_file

Floats = np.ndarray[Any, np.dtype[np.float64]]

# Okabe and Ito, Color Universal Design (2008): told apart by the color-blind, and in print
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
)
COLORS = (BLUE, GREEN, VERMILLION, PURPLE, ORANGE, SKY)
GRAY, LIGHT = "0.45", "0.88"
DIRECTIONS: dict[str, dict[str, Any]] = {
    "approach": {"color": BLUE, "linestyle": "-", "label": "← approach"},
    "retract": {"color": VERMILLION, "linestyle": (0, (4, 1.5)), "label": "retract →"},
}
FORMATS = (".png", ".pdf", ".svg")
LABELS = {"zc": "average distance"}  # shorter than the standard name, for an axis
MOST_POINTS = 20_000  # of a line; more are not seen, but make a PDF heavy


def new_figure(figure: FigureBase | None, width: float, height: float) -> FigureBase:
    """Return the given figure, or a new one of this size in inches that pyplot does not know of."""
    return Figure(figsize=(width, height), layout="constrained") if figure is None else figure


def take(dataset: xr.Dataset, name: str, *dims: str) -> xr.DataArray:
    """Return a variable of a result that has no dimensions but `dims` and columns (tones, modes, ...).

    Raises
    ------
    ParameterError
        For a name that the result lacks, and for more dimensions, such as those of a sweep.
    """
    if name not in dataset.variables:
        known = [str(variable) for variable in dataset.data_vars]
        raise ParameterError(f"this result has no '{name}'{nearest(name, known)}")
    more = [str(dim) for dim in dataset[name].dims if dim not in {*dims, *COLUMN_DIMS}]
    if more:
        raise ParameterError(f"'{name}' also has the dimension {', '.join(more)}; choose one point with .isel")
    return dataset[name]


def shown(variable: xr.DataArray) -> tuple[Floats, str]:
    """Return values in the unit that reads best, and the text of their axis."""
    scale, unit = reader_unit(variable)
    return np.asarray(variable.values, dtype=float) / scale, axis_text(variable, unit)


def axis_text(variable: xr.DataArray, unit: str) -> str:
    """Return the text of an axis: name, symbol, unit."""
    name = LABELS.get(str(variable.name), str(variable.attrs.get("long_name", variable.name)))
    symbol = variable.attrs.get("symbol", "")
    return " ".join([name, *([f"${symbol}$"] if symbol else []), *([f"({unit})"] if unit != "1" else [])])


def thin(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return a line of at most :data:`MOST_POINTS` points that looks the same: extremes of stretches."""
    stride = -(-2 * len(x) // MOST_POINTS)
    if stride <= 2:
        return x, y
    whole = len(x) // stride * stride
    parts = y[:whole].reshape(-1, stride)
    ends = np.sort(np.stack([parts.argmin(axis=1), parts.argmax(axis=1)], axis=1), axis=1)
    chosen = (ends + stride * np.arange(len(parts))[:, None]).ravel()
    return x[chosen], y[chosen]


def tidy(axes: Axes) -> None:
    """Give axes a quiet grid behind the data."""
    axes.grid(True, color=LIGHT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.ticklabel_format(axis="both", useOffset=False) if _linear(axes) else None


def _linear(axes: Axes) -> bool:
    return axes.get_xscale() == axes.get_yscale() == "linear"


def colored_axes(host: Axes, count: int) -> list[Axes]:
    """Return `count` axes over one abscissa, each with a scale of its own color: left, then right."""
    every = [host]
    for number in range(1, count):
        twin = host.twinx()
        twin.spines["right"].set_position(("outward", 58.0 * (number - 1)))
        every.append(twin)
    if count > 1:
        for number, (axes, color) in enumerate(zip(every, color_cycle(count), strict=True)):
            side = "right" if number else "left"
            axes.tick_params(axis="y", colors=color)
            axes.yaxis.label.set_color(color)
            axes.spines[side].set_color(color)
            axes.spines["left" if number else "right"].set_visible(False)
            axes.spines["top"].set_visible(False)
    return every


def color_cycle(count: int) -> list[str]:
    """Return colors for `count` lines."""
    return [COLORS[number % len(COLORS)] for number in range(count)]


def head(target: Axes | FigureBase, dataset: xr.Dataset, extra: str = "") -> None:
    """Write the title of a result, as it is (a dollar is no formula), on axes or a whole figure."""
    title = str(dataset.attrs.get("title", ""))
    text = ", ".join(part for part in (title, extra) if part)
    if not text:
        return
    lines = "\n".join(textwrap.wrap(text, 70, max_lines=2, placeholder=" ..."))
    if isinstance(target, Axes):
        target.set_title(lines, fontsize="medium", parse_math=False)
    else:
        target.suptitle(lines, fontsize="medium", parse_math=False)


def figure_of(axes: Any) -> Any:
    """Return the whole figure that holds axes, one or a list of them."""
    holder = axes if isinstance(axes, FigureBase) else np.ravel(np.asarray(axes, dtype=object))[0].figure
    return holder.figure if isinstance(holder, SubFigure) else holder


def save(axes: Any, path: str | os.PathLike[str], dpi: float = 150) -> Path:
    """Write the picture that holds `axes` (one, or a list of them) to PNG, PDF or SVG, whole or not at all.

    Raises
    ------
    ResultError
        For another ending, or a place that cannot be written.
    """
    target = check_target(path, FORMATS)
    figure = figure_of(axes)
    with matplotlib.rc_context({"svg.fonttype": "none", "pdf.fonttype": 42}), whole_file(target) as temporary:
        figure.savefig(temporary, format=target.suffix[1:].lower(), dpi=dpi)
    return target
