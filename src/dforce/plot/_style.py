"""The common part of all pictures: colors, units for the reader, axes of one color, titles, saving."""

from __future__ import annotations

import io
import os
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from dforce.core.errors import ParameterError, UnitError, checked, nearest, shorten

try:
    import matplotlib
except ValueError as error:  # it reads the variable when it is imported
    if "MPLBACKEND" not in os.environ:
        raise
    raise ParameterError(
        f"matplotlib has no backend '{shorten(os.environ['MPLBACKEND'])}', which the environment variable MPLBACKEND names; "
        "unset it, or write MPLBACKEND=agg"
    ) from error
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure, FigureBase, SubFigure
from matplotlib.text import Text

from dforce.core import units
from dforce.core.argument_kinds import as_text
from dforce.core.arrays import Array
from dforce.core.files import check_target, write_whole
from dforce.core.notation import first_phrase
from dforce.results.dataset import COLUMN_DIMS, reader_unit
from dforce.results.status import check_computed

# Okabe and Ito, Color Universal Design (2008): distinct for the color-blind, and in print
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
COLORS = (BLUE, GREEN, VERMILLION, PURPLE, ORANGE, SKY)
SCALE, LIGHTEST = "viridis", 0.93  # of more lines than colors; its last part is hardly seen on white
GRAY, LIGHT = "0.45", "0.88"
DIRECTIONS: dict[str, dict[str, Any]] = {
    "approach": {"color": BLUE, "linestyle": "-", "label": "← approach"},
    "retract": {"color": VERMILLION, "linestyle": (0, (4, 1.5)), "label": "retract →"},
}
FORMATS = (".png", ".pdf", ".svg")
LABELS = {"zc": "average distance"}  # shorter than the standard name, for an axis
INCH = 0.0254  # m
LEAST_WIDTH, LARGEST_WIDTH = 0.03, 1.0  # m; of a picture on paper
LEAST_DPI, LARGEST_DPI = 10, 5000
SMALLEST_TEXT = 0.7  # of its size as drawn; smaller is not read in print
LONGEST_LINE = 70  # characters of a title
UNBROKEN = "\N{NO-BREAK SPACE}"
MOST_POINTS = 20_000  # of a line; more are not seen, but make a PDF heavy


class Sheet(Figure):
    """A figure for a file: no window or notebook shows it, and its picture sets its size.

    Python frees its memory, so a program may draw any number of sheets, in any thread.
    """

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        """Take the arguments of matplotlib's Figure."""
        super().__init__(*arguments, **settings)


def new_figure(figure: FigureBase | None, width: float, height: float) -> FigureBase:
    """Return the figure to draw on: the argument, or pyplot's, which a notebook and ``plt.show()`` show.

    A :class:`Sheet` and a new figure get this size in inches. A figure without a layout gets the constrained layout, or axes
    and labels would be cut off.
    """
    if figure is None:
        from matplotlib import pyplot  # here: it may look for a screen

        return pyplot.figure(figsize=(width, height), layout="constrained")
    if isinstance(figure, Sheet):
        figure.set_size_inches(width, height)
    whole = figure_of(figure)
    if whole.get_layout_engine() is None:
        whole.set_layout_engine("constrained")
    return figure


def take(dataset: xr.Dataset, name: str, *dims: str) -> xr.DataArray:
    """Return a variable of a result that has no dimensions but `dims` and columns (tones, modes, ...).

    Raises
    ------
    ParameterError
        For a name that the result lacks, and for more dimensions, as in a sweep.
    """
    if name not in dataset.variables:
        check_computed(dataset)
        known = [str(variable) for variable in dataset.data_vars]
        raise ParameterError(f"this result has no '{name}'{nearest(name, known, 'printing the result')}")
    more = [str(dim) for dim in dataset[name].dims if dim not in {*dims, *COLUMN_DIMS}]
    if more:
        raise ParameterError(f"'{name}' also has the dimension {', '.join(more)}; choose one point with .isel")
    return dataset[name]


def with_numbers(variable: xr.DataArray) -> xr.DataArray:
    """Return a variable that sets the scale of its picture.

    Raises
    ------
    ParameterError
        Where none of its values is a number.
    """
    if not np.isfinite(variable.values).any():
        raise ParameterError(f"'{variable.name}' has no numbers, so it has no picture")
    return variable


def shown(variable: xr.DataArray) -> tuple[Array, str]:
    """Return values in the unit that reads best, and the text of their axis."""
    scale, unit = reader_unit(variable)
    return np.asarray(variable.values, dtype=float) / scale, axis_text(variable, unit)


def axis_text(variable: xr.DataArray, unit: str) -> str:
    """Return the text of an axis: name, symbol, unit."""
    name = LABELS.get(str(variable.name), str(variable.attrs.get("long_name", variable.name)))
    name = first_phrase(name) if "path" in variable.attrs else name  # a parameter, explained further
    symbol = variable.attrs.get("symbol", "")
    return " ".join([name, *([f"${symbol}$"] if symbol else []), *([f"({unit})"] if unit != "1" else [])])


def thin(x: Array, y: Array) -> tuple[Array, Array]:
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


def without_errors(axes: Axes, sizes: Array, error: float, scale: float) -> None:
    """Show as a line at 0 an amount that is below its estimated error throughout."""
    if 0.0 < np.max(np.abs(sizes), initial=0.0, where=np.isfinite(sizes)) < error:
        axes.set_ylim(-error / scale, error / scale)


def _linear(axes: Axes) -> bool:
    return axes.get_xscale() == axes.get_yscale() == "linear"


def colored_axes(host: Axes, count: int) -> list[Axes]:
    """Return `count` axes over one abscissa, each with its own colored scale: left, then right."""
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
    """Return a color for each of `count` lines, all different: more than have names take a scale from dark to light."""
    if count <= len(COLORS):
        return list(COLORS[:count])
    return [to_hex(color) for color in matplotlib.colormaps[SCALE](np.linspace(0.0, LIGHTEST, count))]


def head(target: Axes | FigureBase, dataset: xr.Dataset, extra: str = "") -> None:
    """Write the title of a result, as it is (a dollar is no formula), on axes or a whole figure."""
    title = str(dataset.attrs.get("title", ""))
    text = ", ".join(part for part in (title, extra.replace(" ", UNBROKEN)) if part)
    if not text:
        return
    lines = wrapped(text, LONGEST_LINE).replace(UNBROKEN, " ")
    if isinstance(target, Axes):
        target.set_title(lines, fontsize="medium", parse_math=False)
    else:
        target.suptitle(lines, fontsize="medium", parse_math=False)


def figure_of(axes: object) -> Figure:
    """Return the whole figure that holds axes, one or a list of them, or a part of a figure.

    Raises
    ------
    ParameterError
        When it is none of these.
    """
    several = isinstance(axes, list | tuple | np.ndarray)
    first = next(iter(np.ravel(np.asarray(axes, dtype=object))), None) if several else axes
    holder: Any = first if isinstance(first, FigureBase) else getattr(first, "figure", None)
    if not isinstance(holder, Figure | SubFigure):
        raise ParameterError(f"axes = {as_text(axes)} is not a result of a function of df.plot")
    whole: Figure = holder.figure if isinstance(holder, SubFigure) else holder
    return whole


def wrapped(text: str, length: int) -> str:
    """Return a title in at most two lines of this length."""
    return "\n".join(textwrap.wrap(text, length, max_lines=2, placeholder=" ..."))


@checked
def save(axes: object, path: str | os.PathLike[str], dpi: float = 150, width: float | str | None = None) -> Path:
    """Write the picture of `axes` (one, or a list) to PNG, PDF or SVG, whole or not at all.

    Parameters
    ----------
    axes
        The result of a function of this module.
    path
        File to write; its ending chooses the format.
    dpi
        Pixels per inch of a PNG.
    width
        Width of the picture (m), or text with a unit such as ``"85 mm"``; default: the drawn width. The height is scaled in
        proportion, and texts in a narrow picture become smaller, to 70 % at least.

    Raises
    ------
    ResultError
        For another ending, or a file that cannot be written.
    ParameterError
        For a width that is not a length, or not between 3 cm and 1 m, and for `dpi` not between 10 and 5000.
    """
    if not LEAST_DPI <= dpi <= LARGEST_DPI:
        raise ParameterError(f"dpi = {dpi} is not between {LEAST_DPI} and {LARGEST_DPI}")
    target = check_target(path, FORMATS)
    figure = figure_of(axes)
    if width is not None:
        resize(figure, width)
    content = io.BytesIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "pdf.fonttype": 42}):
        figure.savefig(content, format=target.suffix[1:].lower(), dpi=dpi)
    write_whole(target, content.getvalue())
    return target


@checked
def check_width(width: float | str) -> float:
    """Return the width of a picture (m, or text with a unit such as ``"85 mm"``) in inches.

    Raises
    ------
    ParameterError
        For a width that is no length, or not between 3 cm and 1 m.
    """
    try:
        inches = units.parse(width, "m") / INCH
    except UnitError as error:
        raise UnitError(f"the width {error}") from None
    if not LEAST_WIDTH <= inches * INCH <= LARGEST_WIDTH:
        low, high = units.show(LEAST_WIDTH, "m"), units.show(LARGEST_WIDTH, "m")
        raise ParameterError(f"the width {units.show(inches * INCH, 'm', 4)} is not between {low} and {high}")
    return inches


def resize(figure: Figure, width: float | str) -> None:
    """Give a figure another width (m, or text with a unit), in proportion; its texts shrink with it to a limit."""
    inches = check_width(width)
    before, height = figure.get_size_inches()
    figure.set_size_inches(inches, height * inches / before)
    factor = max(inches / before, SMALLEST_TEXT)
    if factor >= 1.0:
        return
    for text in figure.findobj(Text):
        text.set_fontsize(text.get_fontsize() * factor)
    length = int(LONGEST_LINE * inches / before / factor)
    for axes in figure.axes:
        axes.title.set_text(wrapped(axes.title.get_text().replace("\n", " "), length))
    if figure.get_suptitle():
        size = matplotlib.rcParams["font.size"] * factor
        figure.suptitle(wrapped(figure.get_suptitle().replace("\n", " "), length), fontsize=size)
    for axes in figure.axes:
        for side in ("x", "y"):  # labels of ticks that are made when the figure is drawn
            labels = [label.get_fontsize() for label in getattr(axes, f"get_{side}ticklabels")()]
            if labels:
                axes.tick_params(axis=side, labelsize=min(labels))
