"""The figure of a quantity over one or two parameters: lines of all states, or a map with its boundaries and points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.gui.curves.chart import packed, title, unit_of
from dforce.gui.curves.figures import Figure
from dforce.gui.document.document import RESULT_COLORS
from dforce.gui.study.explore import STATES, WORDS, Choice, DrawnLimit, axis_of, cut, label_of, with_unit
from dforce.results.kinds import is_kind
from dforce.results.plan_regions import MARGINS, limits_between
from dforce.results.regime_lines import boundary_lines

if TYPE_CHECKING:
    import xarray as xr

NO_LIMIT, NO_STATE, NO_MARGIN = "all limits hold", "no state", "a margin fails"
MARKS = (
    ("recommended", "most room", "circle", 11),
    ("best", "best by the goal", "star", 13),
    ("least_violation", "least violation", "x", 11),
)
ALLOWED, FAILING = 2, (1, 3, 4, 0, 5)  # colors of series
DASHES = {"solid": "solid", "dashed": "dash", "dotted": "dot", "dashdot": "dashdot"}
LEGEND = {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.0, "yanchor": "bottom"}
SAME = 1e-3  # relative difference of values that belong to one motion
ROOM = 0.08  # of the range, above and below the lines


def figure(
    result: xr.Dataset,
    choice: Choice,
    limit: DrawnLimit | None = None,
    regimes: xr.Dataset | None = None,
    picked: Choice | None = None,
) -> Figure:
    """Return the figure of a choice. Blocking: only the shown part of a store is read.

    Parameters
    ----------
    regimes
        A map of regimes over the same parameters, whose boundaries are drawn on the map.
    picked
        The point that was clicked.
    """
    drawn = _map(result, choice, regimes) if choice.y else _lines(result, choice, limit)
    drawn["layout"]["uirevision"] = f"{choice.quantity} {choice.x} {choice.y}"
    if picked is not None:
        _mark(result, picked, drawn)
    return drawn


def _mark(result: xr.Dataset, picked: Choice, drawn: Figure) -> None:
    """Mark the point that was clicked: a ring on a map, an upright line across lines."""
    at = [
        float(result[dim].values[picked.places[dim]]) / unit_of(result[dim])[0] for dim in (picked.x, picked.y) if dim
    ]
    if len(at) == 2:
        ring = _entry("clicked", "circle-open", 14, "ink") | {"x": packed([at[0]]), "y": packed([at[1]])}
        drawn["data"].append(ring | {"showlegend": False, "hoverinfo": "skip"})
    else:
        line = {"type": "line", "x0": at[0], "x1": at[0], "yref": "paper", "y0": 0, "y1": 1, "editable": False}
        shapes = drawn["layout"].setdefault("shapes", [])
        shapes.append(line | {"line": {"color": "ink", "width": 1, "dash": "dot"}})


def _hover(result: xr.Dataset, *dims: str) -> str:
    """Return the names, values and units of the parameters at a point under the pointer."""
    said = []
    for dim, letter in zip(dims, "xy", strict=False):
        unit = unit_of(result[dim])[1]
        said.append(f"{label_of(result, dim)} {with_unit(f'%{{{letter}:.4g}}', unit)}")
    return ", ".join(said)


def _map(result: xr.Dataset, choice: Choice, regimes: xr.Dataset | None) -> Figure:
    (x, x_axis), (y, y_axis) = axis_of(result, choice.x), axis_of(result, choice.y)
    trace: Figure = {"type": "heatmap", "meta": choice.quantity}
    legend: list[Figure] = []
    if choice.quantity in WORDS:
        x, y, words = _words(result, choice, x, y)
        names = sorted({str(word) for word in words.ravel()}, key=lambda word: (word != NO_LIMIT, word))
        ranks = {name: float(rank) for rank, name in enumerate(names)}
        codes = np.array([[ranks[str(word)] for word in row] for row in words])
        known = {NO_LIMIT: ALLOWED, NO_STATE: "grid", "": "grid"}
        colors = [known.get(name, FAILING[rank % len(FAILING)]) for rank, name in enumerate(names)]
        count = len(names)
        trace |= {
            "z": packed(codes),
            "zmin": -0.5,
            "zmax": count - 0.5,
            "colorscale": [[(n + more) / count, colors[n]] for n in range(count) for more in (0, 1)],
            "showscale": False,
            "opacity": 0.75,
            "text": words.tolist(),
            "hovertemplate": f"{_hover(result, choice.x, choice.y)}: %{{text}}<extra></extra>",
        }
        legend = [
            _entry(name.replace("_", " ") or NO_STATE, "square", 10, color)
            for name, color in zip(names, colors, strict=True)
        ]
    else:
        variable = cut(result, choice.quantity, choice).transpose(choice.y, choice.x)
        variable.load()
        scale, unit = unit_of(variable)
        bar = {"title": {"text": title(variable, unit), "side": "right"}, "thickness": 14, "outlinewidth": 0}
        value = f"{label_of(result, choice.quantity)} %{{z:.4g}} {unit}"
        trace |= {
            "z": packed(variable.values / scale),
            "colorscale": "Viridis",
            "colorbar": bar,
            "hovertemplate": f"{_hover(result, choice.x, choice.y)}: {value}<extra></extra>",
        }
    trace |= {"x": packed(x), "y": packed(y)}
    if regimes is None and is_kind(result, "regimes"):
        regimes = result
    edges = [] if regimes is None else list(_boundaries(result, choice, regimes))
    marks = _marks(result, choice)
    named = len(legend) + len(marks) + sum(bool(edge["showlegend"]) for edge in edges)
    layout: Figure = {
        "margin": {"l": 58, "r": 14, "t": 14 + 16 * -(-named // 2), "b": 48},
        "hovermode": "closest",
        "xaxis": {**x_axis, "showgrid": False},
        "yaxis": {**y_axis, "showgrid": False},
        "showlegend": bool(named),
        "legend": LEGEND,
    }
    return {"data": [trace, *legend, *edges, *marks], "layout": layout, "bar": False}


def _entry(name: str, symbol: str, size: int, color: object) -> Figure:
    marker = {"symbol": symbol, "size": size, "color": color}
    return {"type": "scatter", "x": [None], "y": [None], "mode": "markers", "name": name, "marker": marker}


def _words(result: xr.Dataset, choice: Choice, x: Any, y: Any) -> tuple[Any, Any, Any]:
    """Return the words of a map with their places; words of limits end at the located boundaries."""
    words = cut(result, choice.quantity, choice)
    if choice.quantity != "limit_hit":
        values = words.transpose(choice.y, choice.x).values
        names = str(words.attrs.get("flag_meanings", "")).split()
        return x, y, np.array(names)[values] if names else values.astype(str)
    plane = result.isel({dim: place for dim, place in choice.places.items() if dim in result["limit_hit"].dims})
    across, up, hit = limits_between(plane, choice.x, choice.y)
    scales = [unit_of(result[dim])[0] for dim in (choice.x, choice.y)]
    said = np.where(hit == "", NO_LIMIT, np.where(hit == MARGINS, NO_MARGIN, hit))
    return across / scales[0], up / scales[1], said


def _boundaries(result: xr.Dataset, choice: Choice, regimes: xr.Dataset) -> Iterator[Figure]:
    """Give the boundaries of regimes as lines, where their map lies in the plane that is looked at."""
    along, row = map(str, regimes["regime"].dims)
    if {along, row} != {choice.x, choice.y}:
        return
    named: set[str] = set()
    for one in boundary_lines(regimes):
        pair = {along: one.along / unit_of(result[along])[0], row: one.rows / unit_of(result[row])[0]}
        yield {
            "type": "scatter",
            "mode": "lines" if len(one.along) > 1 else "markers",
            "x": packed(pair[choice.x]),
            "y": packed(pair[choice.y]),
            "name": one.name,
            "showlegend": one.name not in named,
            "line": {"color": "ink", "width": 1.6, "dash": DASHES[one.style]},
            "marker": {"size": 4, "color": "ink"},
            "hovertemplate": f"{one.name}<extra></extra>",
        }
        named.add(one.name)


def _marks(result: xr.Dataset, choice: Choice) -> list[Figure]:
    """Return the points that a plan names, if they lie in the shown part."""
    found = []
    for name, words, symbol, size in MARKS:
        if name == "recommended" and result.attrs.get("limits") == "":  # room between limits
            continue
        if name not in result or not {choice.x, choice.y} <= set(map(str, result[name].dims)):
            continue
        mark = result[name].any("state") if "state" in result[name].dims else result[name]
        mark = mark.isel({dim: place for dim, place in choice.places.items() if dim in mark.dims})
        at = np.argwhere(mark.transpose(choice.x, choice.y).values)
        if len(at):
            x, y = (
                result[dim].values[at[:, n]] / unit_of(result[dim])[0] for n, dim in enumerate((choice.x, choice.y))
            )
            found.append(_entry(words, symbol, size, "ink") | {"x": packed(x), "y": packed(y)})
    return found


def _lines(result: xr.Dataset, choice: Choice, limit: DrawnLimit | None) -> Figure:
    """Return the lines of all states along a parameter; a limit that can be dragged, and its allowed side."""
    x, x_axis = axis_of(result, choice.x)
    variable = cut(result, choice.quantity, choice)
    states = [str(dim) for dim in variable.dims if dim in STATES]
    variable = variable.transpose(choice.x, *states).load()
    scale, unit = unit_of(variable)
    values = variable.values.reshape(len(x), -1) / scale
    traces = list[Figure]()
    for number, (name, (across, up)) in enumerate(_states(result, choice, x, values).items()):
        value = f"{label_of(result, choice.quantity)} %{{y:.4g}} {unit}"
        color = RESULT_COLORS[number % len(RESULT_COLORS)]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "x": packed(across),
                "y": packed(up),
                "name": name,
                "meta": choice.quantity,
                "line": {"color": color, "width": 2},
                "marker": {"size": 5, "color": color},
                "hovertemplate": f"{_hover(result, choice.x)}: {value}<extra>{name}</extra>",
            }
        )
    y_axis: Figure = {"title": {"text": title(variable, unit)}}
    layout: Figure = {
        "margin": {"l": 62, "r": 14, "t": 30, "b": 48},
        "hovermode": "closest",
        "xaxis": x_axis,
        "yaxis": y_axis,
        "showlegend": any(trace["name"] for trace in traces),
        "legend": LEGEND,
    }
    seen = values[np.isfinite(values)].tolist()
    if limit is not None:
        at = limit.value / scale
        low, high = _range([*seen, at])
        y_axis["range"] = [low, high]
        layout["shapes"] = _limit_shapes(at, high if limit.above else low)
    elif seen:
        y_axis["range"] = list(_range(seen))
    return {"data": traces, "layout": layout, "bar": False, "drag": limit is not None}


def _limit_shapes(at: float, end: float) -> list[Figure]:
    """Return a limit as a line that can be dragged, with its allowed side shaded."""
    across = {"xref": "paper", "x0": 0, "x1": 1, "y0": at}
    line = {"type": "line", "y1": at, "line": {"color": "ink", "width": 2, "dash": "dash"}}
    shade = {"type": "rect", "y1": end, "layer": "below", "line": {"width": 0}, "fillcolor": "rgba(0,122,90,0.13)"}
    return [across | line, across | shade | {"editable": False}]


def _states(result: xr.Dataset, choice: Choice, x: Any, values: Any) -> dict[str, tuple[Any, Any]]:
    """Return the lines of the states by their names; directions in which a state is the same share one."""
    regimes, ways = (_state_names(result, name, choice, values.shape) for name in ("regime", "direction"))
    lines: dict[str, tuple[Any, Any]] = {}
    for regime in sorted(set(regimes[np.isfinite(values)])):
        parts: dict[str, tuple[Any, Any]] = {}
        for way in sorted(set(ways[np.isfinite(values) & (regimes == regime)])):
            rows, columns = np.nonzero((regimes == regime) & (ways == way) & np.isfinite(values))
            parts[str(way)] = x[rows], values[rows, columns]
        first = next(iter(parts.values()))
        if all(len(part[1]) == len(first[1]) and np.allclose(part, first, rtol=SAME) for part in parts.values()):
            lines[str(regime)] = first
        else:
            lines |= {", ".join(filter(None, (str(regime), way))): part for way, part in parts.items()}
    return lines


def _state_names(result: xr.Dataset, name: str, choice: Choice, shape: Sequence[int]) -> Any:
    """Return a word for each state of lines, such as its regime; empty ones where the result has none."""
    if name in result.variables and choice.x in result[name].dims:
        part = cut(result, name, choice)
        words = part.transpose(choice.x, *(dim for dim in part.dims if dim in STATES)).values.reshape(shape[0], -1)
        if words.shape == tuple(shape):
            return words.astype(str)
    return np.full(shape, "")


def _range(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    more = max(ROOM * (high - low), SAME * max(abs(low), abs(high))) or 1.0
    return low - more, high + more
