"""Figures of results as plain data for Plotly.

A color is a name that chart.js looks up in the theme, such as "ink" or "soft", or the number of a series. :mod:`dforce` chooses
the pictures and their lines; here they get colors, dashes and axes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dforce.core.arrays import AnyArray, Array
from dforce.findings.jumps import Jump, jumps_of_all
from dforce.gui.curves.chart import (
    hover_of,
    legend,
    name_of_axis,
    packed,
    plain,
    ring,
    stored_unit,
    title,
    title_of_several,
    unit_of,
)
from dforce.gui.document.document import RESULT_COLORS
from dforce.results.curves import Line, Picture, drawable, goes_along, lines_of, start_across
from dforce.results.dataset import reader_unit
from dforce.results.kinds import swept
from dforce.results.significance import along, error_of, largest_error

if TYPE_CHECKING:
    import xarray as xr

Figure = dict[str, Any]
TITLE = 0.08  # of the height, above each of several frames
SIDE = 62  # px, for each further axis on a side
MOST_AXES = 4  # in one frame
MOST_FRAMES = 6
DEPTH = 1e-7  # of the largest value on a logarithmic axis: below it there is rounding only
FAINT = 1e-5  # of the largest value: a logarithmic picture does not show smaller values at first
WIDTH = 2.5  # px, of a curve
LIGHT = {"retract": 0.45, "down": 0.45}  # opacity of the way back
UNSTABLE = "dash"
JUMPING = ("zc", "zc_ratio", "frequency")  # the parameters along which a curve may jump
DOTTED = {"dash": "dot", "width": 1.5}
JUMP: Figure = {"type": "scatter", "mode": "lines", "meta": "jump", "name": "jump", "hoverinfo": "skip"}
OTHERS = ("solid", "dashdot", "longdash", "longdashdot")  # of quantities that share a frame and a color
SIGNS = {
    "fold": "circle",
    "period_doubling": "square",
    "torus": "diamond",
    "grazing": "line-ns-open",
    "end": "x-thin-open",
}
RING = 5  # px, radius
MARGIN = {"l": 64, "r": 20, "t": 28, "b": 48}
TITLED = 52  # px, at the left of frames with their titles above


@dataclass(frozen=True)
class Layer:
    """A result in a figure, with its name and color where it is one of several, and its states at the set point.

    `rings` are the quantities of a picture where its lines meet the set point.
    """

    result: xr.Dataset
    name: str = ""
    color: int = 0
    states: xr.Dataset | None = None
    rings: Mapping[str, AnyArray] = field(default_factory=dict)


class Place(NamedTuple):
    """The place of a quantity in a figure: its axes, the divisor of its values, and its words under the pointer."""

    x_axis: str
    y_axis: str
    scale: float
    words: str

    def hover(self, *which: str) -> str:
        """Return the words under the pointer, with the kind of point that they belong to."""
        return f"{', '.join([self.words, *which])}<extra></extra>"


@dataclass(frozen=True)
class Drawn:
    """A figure, and the layer and line of each of its traces; None for marks.

    For curves, also the place of each quantity, scale and unit across, and by the numbers of their traces the lines of all
    states behind the curves.
    """

    figure: Figure
    traces: tuple[tuple[Layer, Line] | None, ...] = ()
    places: Mapping[str, Place] = field(default_factory=dict)
    x_scale: float = 1.0
    x_unit: str = ""
    behind: Mapping[int, Line] = field(default_factory=dict)


def picture(layers: Sequence[Layer], wanted: Picture) -> Drawn:
    """Return a picture of results, the last on top.

    One result gets a color for each tone; several have a color each. The way back is lighter, unstable states are dashed.
    """
    able = [layer for layer in layers if {wanted.x, *wanted.y} <= set(drawable(layer.result, wanted.x))]
    if not able:
        return Drawn(empty("Nothing to draw: these results lack the chosen quantities."))
    return _FigureBuilder(able, wanted).drawn()


class _FigureBuilder:
    """Makes one figure."""

    def __init__(self, layers: Sequence[Layer], wanted: Picture) -> None:
        self.layers, self.wanted = layers, wanted
        self.several = len(layers) > 1
        self.quantities = {name: layers[0].result[name] for name in (wanted.x, *wanted.y)}
        if wanted.together:  # an axis for each unit
            unit_of_each = {name: stored_unit(self.quantities[name]) for name in wanted.y}
            units = list(dict.fromkeys(unit_of_each.values()))[:MOST_AXES]
            self.frames = [[[name for name in wanted.y if unit_of_each[name] == unit] for unit in units]]
        else:
            self.frames = [[[name]] for name in wanted.y[:MOST_FRAMES]]
        self.x_scale, self.x_unit = self._scale([wanted.x])
        self.across = hover_of(self.quantities[wanted.x], "x", self.x_unit)
        self.scales: dict[str, tuple[float, str]] = {}  # scale of each quantity's axis
        self.data: list[Figure] = []
        self.traces: list[tuple[Layer, Line] | None] = []
        self.named: set[str] = set()
        self.dotted: list[Figure] = []  # lines across jumps, which come last
        self.jumps: dict[int, Mapping[int, list[Jump]]] = {}  # of each result, by its identity
        self.places: dict[str, Place] = {}
        margin = MARGIN | {"l": TITLED} if len(self.frames) > 1 else dict(MARGIN)
        layout: Figure = {"margin": margin, "legend": legend(), "showlegend": True}
        # where a curve is over its axis, one line across all frames shows the values of all of them
        self.unified = wanted.x in layers[0].result.coords
        layout |= {"hovermode": "x unified" if self.unified else "closest", "hoversubplots": "axis"}
        layout["shapes"] = []
        layout["uirevision"] = f"{wanted.x} {wanted.y} {wanted.together} {wanted.logarithmic}"
        self.layout = layout

    def drawn(self) -> Drawn:
        """Return the figure."""
        tag = 0
        for number, groups in enumerate(self.frames):
            host = tag
            for place, names in enumerate(groups):
                self._axis(tag, host, number, place, names)
                for name in names:
                    self._lines(tag, name)
                tag += 1
        self._x_axis(host)
        if self.several:
            self._legend_of_dashes()
        for trace in self.dotted:
            self._add(None, trace)
        self.layout["showlegend"] = len(self.named) > 1 or (self.several and bool(self.named))
        figure = {"data": self.data, "layout": self.layout, "bar": "hover"}
        return Drawn(figure, tuple(self.traces), self.places, self.x_scale, self.x_unit)

    def _scale(self, names: Sequence[str]) -> tuple[float, str]:
        """Return the scale and unit in which the largest of some quantities reads best."""
        found = [unit_of(layer.result[name]) for layer in self.layers for name in names]
        return max(found)

    def _largest(self, names: Sequence[str]) -> float:
        """Return the largest size of some quantities in all layers."""
        sizes = (np.abs(layer.result.variables[name].values) for layer in self.layers for name in names)
        return max(float(np.max(size, initial=0.0, where=np.isfinite(size))) for size in sizes)

    def _axis(self, tag: int, host: int, number: int, place: int, names: Sequence[str]) -> None:
        """Add an upright axis: in a frame the first one at the left, the second at the right, then outward."""
        several = [self.quantities[name] for name in names]
        scale, unit = self._scale(names)
        noise = max(largest_error(layer.result, name) for layer in self.layers for name in names)
        is_noise = 0.0 < self._largest(names) < noise
        if is_noise:
            scale, unit = reader_unit(several[0].copy(data=np.full(several[0].shape, noise)))
        self.scales |= dict.fromkeys(names, (scale, unit))
        words = title(several[0], unit) if len(names) == 1 else title_of_several(several, unit)
        axis: Figure = {"title": {"text": words}}
        if not place:
            axis["domain"] = stacked([1.0] * len(self.frames))[number]
        if self.wanted.logarithmic:
            axis |= {"type": "log", "exponentformat": "power", "dtick": 1}
        if len(self.frames[number]) > 1 and len(names) == 1 and not self.several:
            axis["color"] = _color(self.wanted.y.index(names[0]))
        if is_noise:
            axis["range"] = [-noise / scale, noise / scale]
        if place:
            right = place % 2
            axis |= {
                "overlaying": name_of_axis("y", host),
                "tickmode": "auto",
                "side": "right" if right else "left",
                "showgrid": False,
            }
            if place > 1:
                axis |= {"anchor": "free", "position": float(right), "shift": SIDE if right else -SIDE}
            self.layout["margin"]["r" if right else "l"] = MARGIN["l"] + SIDE * (place > 1)
        if place < 2:
            axis["anchor"] = "x"
        self.layout[name_of_axis("yaxis", tag)] = axis

    def _x_axis(self, lowest: int) -> None:
        """Add the axis across, which all frames share, below the lowest one."""
        axis: Figure = {"anchor": name_of_axis("y", lowest)}
        axis["title"] = {"text": title(self.quantities[self.wanted.x], self.x_unit)}
        if self.unified:
            axis |= {"unifiedhovertitle": {"text": self.across}, "showspikes": True, "spikemode": "across"}
            axis |= {"spikethickness": 1, "spikedash": "solid", "spikesnap": "hovered data"}
        if self.wanted.logarithmic_across:
            begin = start_across(line for _, line in filter(None, self.traces)) / self.x_scale
            axis |= {"type": "log", "range": [math.log10(begin), math.log10(self._last_x())]}
        elif self.wanted.logarithmic:
            axis["range"] = [0.0, self._last_x()]
        self.layout["xaxis"] = axis

    def _last_x(self) -> float:
        """Return how far out there is something on a logarithmic picture."""
        ends = [0.0]
        for trace in self.traces:
            if trace is not None:
                seen = trace[1].y > FAINT * np.nanmax(trace[1].y)
                ends.append(float(np.nanmax(np.where(seen, trace[1].x, 0.0))))
        return 1.05 * max(ends) / self.x_scale

    def _lines(self, tag: int, name: str) -> None:
        """Add the traces of one quantity: a line for each direction, branch or case, and marks at its jumps."""
        scale, unit = self.scales[name]
        x_axis, y_axis = "x", name_of_axis("y", tag)
        self.places[name] = Place(x_axis, y_axis, scale, hover_of(self.quantities[name], "y", unit))
        for layer in self.layers:
            errors = error_of(layer.result, name)
            for whole in lines_of(layer.result, self.wanted.x, name):
                line, across = _parted(whole, self._jumps(layer))
                y = np.maximum(line.y, DEPTH * np.nanmax(line.y)) if self.wanted.logarithmic else line.y
                y = np.where(np.abs(y) <= along(errors, layer.result.variables[name].dims, line), 0.0, y)
                look = self._look(layer, line, name)
                hover = self._hover(name, [line.name, layer.name if self.several else ""])
                self._add(
                    (layer, line),
                    {
                        "x": packed(line.x / self.x_scale),
                        "y": packed(y / scale),
                        "xaxis": x_axis,
                        "yaxis": y_axis,
                        "type": "scatter",
                        "mode": "lines",
                        "meta": name,
                        "hovertemplate": hover,
                        **look,
                    },
                )
                for mark in _marks(line, self.x_scale, scale, look["line"]["color"]):
                    self._add(None, {"xaxis": x_axis, "yaxis": y_axis, **mark})
                if across.size:
                    ends = {"xaxis": x_axis, "x": packed(across[0] / self.x_scale), "y": packed(across[1] / scale)}
                    self.dotted.append(look | JUMP | ends | {"yaxis": y_axis, "line": look["line"] | DOTTED})
            if {self.wanted.x, name} <= layer.rings.keys():
                rings = _rings(layer.rings[self.wanted.x] / self.x_scale, layer.rings[name] / scale)
                self.layout["shapes"] += [{"xref": x_axis, "yref": y_axis, **ring} for ring in rings]

    def _jumps(self, layer: Layer) -> Mapping[int, list[Jump]]:
        """Return the jumps of a curve by the number of its direction; looked for once."""
        result, along = layer.result, goes_along(layer.result)
        if id(result) not in self.jumps:
            has = along in JUMPING and {along, "amplitude"} <= {*result.dims, *result} and not swept(result, along)
            self.jumps[id(result)] = {way: found for _, way, found in jumps_of_all(result, along)} if has else {}
        return self.jumps[id(result)]

    def _hover(self, name: str, which: Sequence[str]) -> str:
        """Return names, values and units of the point under the pointer, and of which curve it is."""
        place, words = self.places[name], [plain(word) for word in which if word]
        return (
            place.hover(*words) if self.unified else "<br>".join([self.across, place.words, *words]) + "<extra></extra>"
        )

    def _add(self, shown: tuple[Layer, Line] | None, trace: Figure) -> None:
        words = "" if self.several and shown is not None else str(trace["name"])
        trace["showlegend"] = bool(words) and words not in self.named
        self.named |= {words} - {""}
        self.data.append(trace)
        self.traces.append(shown)

    def _look(self, layer: Layer, line: Line, name: str) -> Figure:
        """Return name, color and dash of a line."""
        place = self.wanted.y.index(name)
        dash = "solid" if line.stable else UNSTABLE
        if self.several:
            color = layer.color
            if self.wanted.together and dash == "solid":
                dash = OTHERS[place % len(OTHERS)]
        elif self.wanted.together:
            color = _color(place + line.column)
        else:
            color = _color(line.column)
        words = [str(self.quantities[name].attrs.get("long_name", name))] * (
            self.wanted.together and len(self.wanted.y) > 1
        )
        text = ", ".join([*words, *([line.name] if line.name else [])])
        look = {"color": color, "dash": dash, "width": WIDTH, "simplify": False}
        return {"name": plain(text), "line": look, "opacity": LIGHT.get(line.direction, 1.0)}

    def _legend_of_dashes(self) -> None:
        """Explain the dashes of directions and of jumps; the list of results shows their colors."""
        found = {
            line.direction or ("stable" if line.stable else "unstable"): line for _, line in filter(None, self.traces)
        }
        if "unstable" not in found:  # one direction alone, which needs no name
            found.pop("stable", None)
        looks: dict[str, Figure] = {
            word: {
                "line": {"dash": "solid" if line.stable else UNSTABLE, "width": WIDTH},
                "opacity": LIGHT.get(line.direction, 1.0),
            }
            for word, line in found.items()
            if len(found) > 1
        }
        if self.dotted:
            looks["jump"] = {"line": DOTTED}
        for word, look in looks.items():
            trace = {"x": [None], "y": [None], "type": "scatter", "mode": "lines", "name": word}
            self._add(None, trace | look | {"line": look["line"] | {"color": "soft"}})


def _color(number: int) -> int:
    return RESULT_COLORS[number % len(RESULT_COLORS)]


def _parted(line: Line, jumps: Mapping[int, list[Jump]]) -> tuple[Line, Array]:
    """Return a line with gaps at its jumps, and the lines across them: x and y with gaps between, (2, 3 jumps)."""
    found = jumps.get(line.chosen.get("direction", 0), []) if line.row in JUMPING else []
    if not found:
        return line, np.empty((2, 0))
    ends = np.array([sorted((jump.before, jump.after)) for jump in found])
    behind = ends[:, 1]
    x, y = (np.insert(values, behind, np.nan) for values in (line.x, line.y))
    across = np.array([np.insert(values[ends], 2, np.nan, axis=1).ravel() for values in (line.x, line.y)])
    return replace(line, x=x, y=y, places=np.insert(line.places, behind, -1)), across


def _marks(line: Line, x_scale: float, scale: float, color: int) -> Iterator[Figure]:
    """Give the special points of a line, one trace for each kind."""
    for kind in dict.fromkeys(line.marks.values()):
        places = [place for place, word in line.marks.items() if word == kind]
        yield {
            "x": packed(line.x[places] / x_scale),
            "y": packed(line.y[places] / scale),
            "type": "scatter",
            "mode": "markers",
            "name": kind.replace("_", " "),
            "marker": {"symbol": SIGNS[kind], "size": 8, "color": color},
            "hovertemplate": f"{plain(kind.replace('_', ' '))}<extra></extra>",
        }


def _rings(across: AnyArray, upward: AnyArray) -> Iterator[Figure]:
    """Give a ring for each state at the set point, and each column of it."""
    for x, values in zip(across, upward, strict=True):
        for y in np.ravel(values):
            yield ring(float(np.ravel(x)[0]), float(y), RING)


def empty(text: str) -> Figure:
    """Return an empty figure with a sentence on the reason."""
    note = {"text": plain(text), "x": 0.5, "y": 0.5, "xref": "paper", "yref": "paper", "showarrow": False}
    hidden = {"visible": False}
    return {"data": [], "layout": {"annotations": [note], "xaxis": hidden, "yaxis": hidden, "margin": MARGIN}}


def stacked(heights: Sequence[float]) -> list[list[float]]:
    """Return the domains of frames of relative heights, one below the other, with room for a title above each.

    One frame alone has its title at its side.
    """
    if len(heights) == 1:
        return [[0.0, 1.0]]
    parts = np.array(heights) * (1.0 - TITLE * len(heights)) / sum(heights)
    bottoms = 1.0 - np.cumsum(parts + TITLE)
    return [[max(float(low), 0.0), float(low + part)] for low, part in zip(bottoms, parts, strict=True)]
