"""Lines of several results laid over each other, a color for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from dforce.plot._points import draw_points
from dforce.plot._states import MARKS, UNSTABLE
from dforce.plot._style import GRAY, axis_text, color_cycle, colored_axes, head, new_figure, tidy, without_errors
from dforce.results.curves import Line, Picture, lines_of
from dforce.results.dataset import COLUMN_DIMS, reader_unit
from dforce.results.significance import largest_error

BACK = (0, (4, 1.5))  # dashes of the way back
DEPTH = 1e-7  # of the largest value on a logarithmic axis: below it there is rounding only
LONGEST_NAME = 40
MOST_INSIDE = 6  # entries of a legend that leave room for lines; a longer legend is below the axes
Layers = Mapping[str, xr.Dataset]


def lay_over(
    layers: Layers, picture: Picture, figure: FigureBase | None = None, measured: xr.Dataset | None = None
) -> list[Axes]:
    """Draw a picture of results by name, which all have its quantities, and return all axes.

    `measured` is a curve as :func:`dforce.calibrate` gives it, drawn as gray points.
    """
    return _Drawing(layers, picture, measured).on(figure)


class _Drawing:
    """One picture of results that all have its quantities."""

    def __init__(self, layers: Layers, picture: Picture, measured: xr.Dataset | None) -> None:
        self.layers, self.picture, self.several = layers, picture, len(layers) > 1
        self.measured = None if picture.logarithmic else measured
        self.first = next(iter(layers.values()))
        self.looks: dict[str, Any] = {}  # of the legend
        self.colors = color_cycle(len(layers) if self.several else self._most())

    def on(self, figure: FigureBase | None) -> list[Axes]:
        """Draw, and return the axes."""
        names = self.picture.y
        units = list(dict.fromkeys(self._unit(name) for name in names))
        if self.picture.together:
            figure = new_figure(figure, 6.0 + 0.8 * max(len(units) - 2, 0), 4.0)
            axes = colored_axes(figure.subplots(), len(units))
            for one, unit in zip(axes, units, strict=True):
                self._frame(one, [name for name in names if self._unit(name) == unit])
                if one is not axes[0]:
                    one.grid(False)
        else:
            figure = new_figure(figure, 6.0, 1.5 + 2.2 * len(names) + 0.12 * max(len(self.layers) - MOST_INSIDE, 0))
            axes = list(np.ravel(figure.subplots(len(names), 1, sharex=True)))
            for one, name in zip(axes, names, strict=True):
                self._frame(one, [name])
            for one in axes[:-1]:
                one.set_xlabel("")
        looks = dict(sorted(self.looks.items(), key=lambda look: look[1].get_color() == GRAY))
        entries = list(looks.values()), list(looks)
        if len(looks) > MOST_INSIDE:
            figure.legend(*entries, fontsize="small", loc="outside lower center", ncols=2)
        elif len(looks) > 1:
            on = axes[-1 if self.picture.together else 0]
            on.legend(*entries, framealpha=0.85, fontsize="small", loc="best")
        if not self.several:
            head(axes[0], self.first)
        return axes

    def _most(self) -> int:
        """Return how many colors the lines of one result need: two for each column, and one more for each quantity."""
        last = (
            sum(size - 1 for dim, size in self.first[y].sizes.items() if dim in COLUMN_DIMS) for y in self.picture.y
        )
        return 2 * max(last) + 1 + len(self.picture.y)

    def _unit(self, name: str) -> str:
        return str(self.first[name].attrs.get("units", "1"))

    def _scale(self, names: Sequence[str]) -> tuple[float, str]:
        return max(reader_unit(result[name]) for result in self.layers.values() for name in names)

    def _error(self, names: Sequence[str]) -> float:
        return max(largest_error(result, name) for result in self.layers.values() for name in names)

    def _frame(self, axes: Axes, names: Sequence[str]) -> None:
        (across, x_unit), (scale, unit) = self._scale([self.picture.x]), self._scale(names)
        for number, result in enumerate(self.layers.values()):
            for name in names:
                for line in lines_of(result, self.picture.x, name):
                    self._line(axes, line, across, scale, self._look(number, line, name))
        if self.measured is not None:
            for name in names:
                for handle in draw_points(axes, self.measured, (self.picture.x, across), (name, scale)):
                    self.looks.setdefault(str(handle.get_label()), handle)
        axes.set_xlabel(axis_text(self.first[self.picture.x], x_unit))
        words = [axis_text(self.first[name], "1") for name in names]
        axes.set_ylabel(", ".join(words) + (f" ({unit})" if unit != "1" else ""))
        if self.picture.logarithmic:
            axes.set_yscale("log")
        if self.picture.logarithmic_across:
            axes.set_xscale("log")
        tidy(axes)
        sizes = np.concatenate([np.ravel(result[name].values) for result in self.layers.values() for name in names])
        without_errors(axes, sizes, self._error(names), scale)

    def _line(self, axes: Axes, line: Line, across: float, scale: float, look: dict[str, Any]) -> None:
        y = np.maximum(line.y, DEPTH * np.nanmax(line.y)) if self.picture.logarithmic else line.y
        axes.plot(line.x / across, y / scale, linewidth=1.4, **look)
        for place, mark in line.marks.items():
            axes.plot(
                line.x[place] / across,
                y[place] / scale,
                marker=MARKS[mark]["marker"],
                color=look["color"],
                markersize=5.0,
            )

    def _look(self, number: int, line: Line, name: str) -> dict[str, Any]:
        """Return color and dash of a line, and note their meaning for the legend."""
        back = line.direction in ("retract", "down")
        dash: Any = UNSTABLE if not line.stable else BACK if back else "-"
        if self.several:
            color = self.colors[number]
            self._note(list(self.layers)[number][:LONGEST_NAME], color, "-")
            if line.direction or not line.stable:
                self._note(line.direction or "unstable", GRAY, dash)
            return {"color": color, "linestyle": dash}
        together = self.picture.together and len(self.picture.y) > 1
        place = self.picture.y.index(name) if together else 0
        color = self.colors[place + 2 * line.column + (back and not together)]
        words = [str(self.first[name].attrs.get("long_name", name))] * together + [line.name] * bool(line.name)
        self._note(", ".join(words), color, dash)
        return {"color": color, "linestyle": dash}

    def _note(self, words: str, color: Any, dash: Any) -> None:
        if words:
            self.looks.setdefault(words.replace("$", r"\$"), Line2D([], [], color=color, linestyle=dash))
