"""Any quantities against any other, of one result or several laid over each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from dforce.core.errors import ParameterError, checked
from dforce.plot._points import draw_points
from dforce.plot._states import MARKS, UNSTABLE
from dforce.plot._style import COLORS, GRAY, axis_text, colored_axes, head, new_figure, tidy, without_rounding
from dforce.plot.branches import branches, resonance
from dforce.plot.distances import amplitude_phase
from dforce.plot.forces import force_distance
from dforce.plot.motion import phase_portrait, spectrum
from dforce.plot.overview import overview
from dforce.plot.thermal import thermal_spectrum
from dforce.results.curves import Line, Picture, drawable, goes_along, lines_of, pictures_of, rounding
from dforce.results.dataset import reader_unit

BACK = (0, (4, 1.5))  # dashes of the way back
DEPTH = 1e-7  # of the largest value on a logarithmic axis: below it there is rounding only
LONGEST_NAME = 40
Layers = Mapping[str, xr.Dataset]


@checked
def draw(
    results: xr.Dataset | Mapping[str, xr.Dataset], picture: Picture | None = None, figure: FigureBase | None = None,
    measured: xr.Dataset | None = None,
) -> list[Axes]:  # fmt: skip
    """Draw quantities against another one, and return all axes.

    Parameters
    ----------
    results
        A result, or several by name, which get a color each.
    picture
        What is drawn; left out: the one that says most, and of one result its overview.
    measured
        A curve as :func:`dforce.calibrate` gives it, drawn as gray points where a picture shows what was measured; its heights
        count as average distances.

    Raises
    ------
    ParameterError
        When no result has these quantities.
    """
    layers = {"": results} if isinstance(results, xr.Dataset) else dict(results)
    first = next(iter(layers.values()), None)
    if first is None:
        raise ParameterError("there is no result to draw")
    if len(layers) == 1 and ((picture is None and measured is None) or "reached" in first):
        return overview(first, figure)
    picture = picture or next(iter(pictures_of(first)), None)
    if picture is None:
        raise ParameterError("a map of basins is drawn by itself, not over others")
    own = _own(first, picture, measured) if len(layers) == 1 else None
    if own is not None:
        return list(np.ravel(np.asarray(own(figure), dtype=object)))
    wanted = {picture.x, *picture.y}
    able = {name: result for name, result in layers.items() if wanted <= set(drawable(result, picture.x))}
    if not able:
        raise ParameterError(f"these results lack {' or '.join(sorted(wanted))}, so there is nothing to draw")
    return _Drawing(able, picture, measured).on(figure)


def _own(
    result: xr.Dataset, picture: Picture, measured: xr.Dataset | None
) -> Callable[[FigureBase | None], Any] | None:  # fmt: skip
    """Return the function that draws this very picture, with what a reader of it looks for; None where there is none."""
    if picture not in pictures_of(result):
        return None
    if "fitted_density" in picture.y:
        return lambda figure: thermal_spectrum(result, figure)
    if goes_along(result) == "time":
        made: dict[tuple[str, ...], Callable[[FigureBase | None], Any]] = {
            ("spectrum",): lambda figure: spectrum(result, figure=figure),
            ("force",): lambda figure: force_distance(result, figure),
            ("velocity",): lambda figure: phase_portrait(result, figure),
        }
        return made.get(picture.y)
    if picture != pictures_of(result)[0] or result.sizes.get("tone", 1) > 1:
        return None
    by: dict[str, Callable[..., Any]] = {"point": branches, "frequency": resonance, "zc": amplitude_phase}
    dim, own = next((dim, function) for dim, function in by.items() if dim in result["amplitude"].dims)
    points = {"measured": measured} if dim == "zc" else {}
    return lambda figure: own(result, figure=figure, **points)


class _Drawing:
    """One picture of results that all have its quantities."""

    def __init__(self, layers: Layers, picture: Picture, measured: xr.Dataset | None) -> None:
        self.layers, self.picture, self.several = layers, picture, len(layers) > 1
        self.measured = None if picture.logarithmic else measured
        self.first = next(iter(layers.values()))
        self.looks: dict[str, Any] = {}  # of the legend

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
            figure = new_figure(figure, 6.0, 1.5 + 2.2 * len(names))
            axes = list(np.ravel(figure.subplots(len(names), 1, sharex=True)))
            for one, name in zip(axes, names, strict=True):
                self._frame(one, [name])
            for one in axes[:-1]:
                one.set_xlabel("")
        if len(self.looks) > 1:
            axes[-1 if self.picture.together else 0].legend(
                list(self.looks.values()), list(self.looks), framealpha=0.85, fontsize="small", loc="best"
            )
        if not self.several:
            head(axes[0], self.first)
        return axes

    def _unit(self, name: str) -> str:
        return str(self.first[name].attrs.get("units", "1"))

    def _scale(self, names: Sequence[str]) -> tuple[float, str]:
        return max(reader_unit(result[name]) for result in self.layers.values() for name in names)

    def _rounding(self, names: Sequence[str]) -> float:
        return max(rounding(result, name) for result in self.layers.values() for name in names)

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
        without_rounding(axes, sizes, self._rounding(names), scale)

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
        """Return color and dash of a line, and note what they mean for the legend."""
        back = line.direction in ("retract", "down")
        dash: Any = UNSTABLE if not line.stable else BACK if back else "-"
        if self.several:
            color = COLORS[number % len(COLORS)]
            self._note(list(self.layers)[number][:LONGEST_NAME], color, "-")
            if line.direction or not line.stable:
                self._note(line.direction or "unstable", GRAY, dash)
            return {"color": color, "linestyle": dash}
        together = self.picture.together and len(self.picture.y) > 1
        place = self.picture.y.index(name) if together else 0
        color = COLORS[(place + 2 * line.column + (back and not together)) % len(COLORS)]
        words = [str(self.first[name].attrs.get("long_name", name))] * together + [line.name] * bool(line.name)
        self._note(", ".join(words), color, dash)
        return {"color": color, "linestyle": dash}

    def _note(self, words: str, color: Any, dash: Any) -> None:
        if words:
            self.looks.setdefault(words.replace("$", r"\$"), Line2D([], [], color=color, linestyle=dash))
