"""Results over parameters: what of them can be looked at, and the figure of a quantity along one or two of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Array
from dforce.core.units import parse
from dforce.gui.curves.chart import packed
from dforce.gui.curves.figures import Figure, title, unit_of
from dforce.results.dataset import COLUMN_DIMS, reader_unit
from dforce.results.kinds import kind_of

if TYPE_CHECKING:
    import xarray as xr

OVER = ("over", "plan_over", "map_over")  # attributes that name the parameters of a result
STATES = ("crossing", "state")  # dimensions of the states at one setting
FIRST = ("limit_hit", "peak_force", "max_indentation", "contact_time", "amplitude", "phase")
WORDS = {"limit_hit": "which limit fails", "regime": "regime"}  # quantities that are words
NO_LIMIT, NO_STATE = "all limits hold", "no state"
LEFT_OUT = ("status", "motion", "component")
MOST = 300  # values along an axis that are drawn; of more some are left out
MARKS = (
    ("recommended", "most room", "circle", 11),
    ("best", "best by the goal", "star", 13),
    ("least_violation", "least violation", "x", 11),
)
ALLOWED, FAILING = 2, (1, 3, 4, 0, 5)  # colors of series
EVEN = 1e-6
LEGEND = {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.0, "yanchor": "bottom"}
SAME = 1e-3  # relative difference of values that are those of one motion
ROOM = 0.08  # of the range, above and below the lines


@dataclass(frozen=True)
class Choice:
    """What is looked at: a quantity along `x`, and along `y` unless that is empty, at places along other dimensions."""

    quantity: str = ""
    x: str = ""
    y: str = ""
    places: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class DrawnLimit:
    """A limit of the quantity (SI), and whether what is allowed lies above it."""

    value: float
    above: bool = False


def paths_of(result: xr.Dataset) -> dict[str, str]:
    """Return the paths of the parameters of a result, by their dimensions; none for a result of one case."""
    names = next((str(result.attrs[key]).split() for key in OVER if result.attrs.get(key)), [])
    pairs = ((name, path) for path in names for name in (path, path.rpartition(".")[2]))
    return {name: path for name, path in pairs if name in result.dims}


def is_explorable(result: xr.Dataset) -> bool:
    """Return whether a result goes over parameters, so that it is looked at along them."""
    kind = kind_of(result)
    return kind is not None and kind.panel in ("curves", "parameters") and bool(paths_of(result))


def quantities(result: xr.Dataset) -> list[str]:
    """Return the quantities that can be looked at, those that are asked for first at the beginning."""
    kinds = {name: variable.dtype.kind for name, variable in result.variables.items()}
    numbers = [str(name) for name in result.data_vars if kinds[name] == "f"]
    words = [name for name in WORDS if name in result.variables]
    names = [name for name in dict.fromkeys([*FIRST, *words, *numbers]) if name in (*numbers, *words)]
    fewest = dict.fromkeys(words, 2)  # words are drawn as colors of a map, numbers as lines as well
    return [name for name in names if name not in LEFT_OUT and len(axes_of(result, name)) >= fewest.get(name, 1)]


def axes_of(result: xr.Dataset, quantity: str) -> list[str]:
    """Return the dimensions along which a quantity can be drawn, the parameters first."""
    dims = [str(dim) for dim in result[quantity].dims if dim not in (*COLUMN_DIMS, *STATES)]
    numbers = [dim for dim in dims if dim in result.coords and result[dim].dtype.kind == "f" and result.sizes[dim] > 1]
    return sorted(numbers, key=lambda dim: dim not in paths_of(result))


def fitting(result: xr.Dataset, wanted: Choice) -> Choice:
    """Return a choice that a result has, as near as may be to one that is wanted.

    Raises
    ------
    ValueError
        When there is nothing to look at.
    """
    names = quantities(result)
    if not names:
        raise ValueError("no quantity along a parameter")
    quantity = wanted.quantity if wanted.quantity in names else names[0]
    axes = axes_of(result, quantity)
    x = wanted.x if wanted.x in axes else axes[0]
    others = [axis for axis in axes if axis != x]
    y = wanted.y if wanted.y in others or (wanted.y == "" and wanted.quantity) else next(iter(others), "")
    if quantity in WORDS and others and not y:
        y = others[0]
    rest = sliced(result, Choice(quantity, x, y))
    places = {dim: min(max(wanted.places.get(dim, _first(result, dim)), 0), result.sizes[dim] - 1) for dim in rest}
    return Choice(quantity, x, y, places)


def _first(result: xr.Dataset, dim: str) -> int:
    """Return the place along a dimension that is looked at first: of numbers that in the middle."""
    return result.sizes[dim] // 2 if dim in result.coords and result[dim].dtype.kind == "f" else 0


def sliced(result: xr.Dataset, choice: Choice) -> list[str]:
    """Return the dimensions along which one place is looked at; lines show all states, and so does what limits do."""
    dims = [str(dim) for dim in result[choice.quantity].dims]
    all_states = not choice.y or choice.quantity == "limit_hit"
    return [dim for dim in dims if dim not in (choice.x, choice.y) and not (all_states and dim in STATES)]


def places_of(result: xr.Dataset, dim: str) -> list[str]:
    """Return the places along a dimension in words."""
    if dim not in result.coords:
        return [str(number + 1) for number in range(result.sizes[dim])]
    axis = result[dim]
    if axis.dtype.kind != "f":
        return [str(value) for value in axis.values]
    scale, unit = unit_of(axis)
    return [f"{value / scale:.5g}{'' if unit == '1' else f' {unit}'}" for value in axis.values]


def label_of(result: xr.Dataset, name: str) -> str:
    """Return a quantity or a dimension in words."""
    words = str(result[name].attrs.get("long_name", "")) if name in result.variables else ""
    return WORDS.get(name) or words.partition(";")[0] or name.replace("_", " ")


def figure(result: xr.Dataset, choice: Choice, limit: DrawnLimit | None = None) -> Figure:
    """Return the figure of a choice. Blocking: of a store, what is looked at is read, and nothing else."""
    drawn = _map(result, choice) if choice.y else _lines(result, choice, limit)
    drawn["layout"]["uirevision"] = f"{choice.quantity} {choice.x} {choice.y}"
    return drawn


def _cut(result: xr.Dataset, name: str, choice: Choice) -> xr.DataArray:
    """Return a variable at the places of a choice, with no more values than are drawn."""
    variable = result[name].reset_coords(drop=True)
    steps = {dim: slice(None, None, -(-result.sizes[dim] // MOST)) for dim in (choice.x, choice.y) if dim}
    at = {dim: place for dim, place in choice.places.items() if dim in variable.dims}
    return variable.isel(at | {dim: step for dim, step in steps.items() if dim in variable.dims})


def _axis(result: xr.Dataset, dim: str) -> tuple[Array, Figure]:
    """Return the values along a dimension as they are shown, and the axis."""
    step = -(-result.sizes[dim] // MOST)
    scale, unit = unit_of(result[dim])
    values = np.asarray(result[dim].values[::step], dtype=float) / scale
    words = result[dim].assign_attrs(long_name=label_of(result, dim))
    axis: Figure = {"title": {"text": title(words, unit)}}
    if len(values) > 2 and (values > 0.0).all() and np.ptp(np.diff(np.log(values))) < EVEN:
        axis["type"] = "log"
    return values, axis


def _map(result: xr.Dataset, choice: Choice) -> Figure:
    (x, x_axis), (y, y_axis) = _axis(result, choice.x), _axis(result, choice.y)
    trace: Figure = {"type": "heatmap", "x": packed(x), "y": packed(y), "meta": choice.quantity}
    legend: list[Figure] = []
    if choice.quantity in WORDS:
        words = _words(result, choice)
        names = sorted({str(word) for word in words.ravel()}, key=lambda word: (word != NO_LIMIT, word))
        ranks = {name: float(rank) for rank, name in enumerate(names)}
        codes = np.array([[ranks[str(word)] for word in row] for row in words])
        known = {NO_LIMIT: ALLOWED, NO_STATE: "grid", "": "grid"}
        colors = [known.get(name, FAILING[rank % len(FAILING)]) for rank, name in enumerate(names)]
        count = len(names)
        scale = [[(n + more) / count, colors[n]] for n in range(count) for more in (0, 1)]
        trace |= {
            "z": packed(codes),
            "zmin": -0.5,
            "zmax": count - 0.5,
            "colorscale": scale,
            "showscale": False,
            "opacity": 0.75,
            "text": words.tolist(),
            "hovertemplate": "%{x:.4g}, %{y:.4g}: %{text}<extra></extra>",
        }
        legend = [
            _entry(name.replace("_", " ") or NO_STATE, "square", 10, color)
            for name, color in zip(names, colors, strict=True)
        ]
    else:
        variable = _cut(result, choice.quantity, choice).transpose(choice.y, choice.x)
        variable.load()
        scale_, unit = unit_of(variable)
        bar = {"title": {"text": title(variable, unit), "side": "right"}, "thickness": 14, "outlinewidth": 0}
        trace |= {
            "z": packed(variable.values / scale_),
            "colorscale": "Viridis",
            "colorbar": bar,
            "hovertemplate": f"%{{x:.4g}}, %{{y:.4g}}: %{{z:.4g}} {unit}<extra></extra>",
        }
    marks = _marks(result, choice)
    layout: Figure = {
        "margin": {"l": 58, "r": 14, "t": 14 + 16 * -(-(len(legend) + len(marks)) // 2), "b": 48},
        "hovermode": "closest",
        "xaxis": {**x_axis, "showgrid": False},
        "yaxis": {**y_axis, "showgrid": False},
        "showlegend": bool(legend or marks),
        "legend": LEGEND,
    }
    return {"data": [trace, *legend, *marks], "layout": layout, "bar": False}


def _entry(name: str, symbol: str, size: int, color: object) -> Figure:
    marker = {"symbol": symbol, "size": size, "color": color}
    return {"type": "scatter", "x": [None], "y": [None], "mode": "markers", "name": name, "marker": marker}


def _words(result: xr.Dataset, choice: Choice) -> Any:
    """Return the words of a map; of limits those of the first one that fails in the state that comes nearest."""
    words = _cut(result, choice.quantity, choice)
    if choice.quantity != "limit_hit":
        return words.transpose(choice.y, choice.x).values.astype(str)
    words = words.transpose(choice.y, choice.x, "state")
    hit = words.values.astype(str)
    return np.where((hit == "").any(axis=-1), NO_LIMIT, hit[..., 0])


def _marks(result: xr.Dataset, choice: Choice) -> list[Figure]:
    """Return the points that a plan names, where they lie in what is looked at."""
    found = []
    for name, words, symbol, size in MARKS:
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
    """Return the lines of all states along a parameter; a limit that can be dragged, and what it allows."""
    x, x_axis = _axis(result, choice.x)
    variable = _cut(result, choice.quantity, choice)
    states = [str(dim) for dim in variable.dims if dim in STATES]
    variable = variable.transpose(choice.x, *states).load()
    scale, unit = unit_of(variable)
    values = variable.values.reshape(len(x), -1) / scale
    traces = list[Figure]()
    for number, (name, (across, up)) in enumerate(_states(result, choice, x, values).items()):
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "x": packed(across),
                "y": packed(up),
                "name": name,
                "meta": choice.quantity,
                "line": {"color": number, "width": 2},
                "marker": {"size": 5, "color": number},
                "hovertemplate": f"%{{x:.4g}}, %{{y:.4g}} {unit}<extra>{name}</extra>",
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
        across = {"xref": "paper", "x0": 0, "x1": 1, "y0": at}
        layout["shapes"] = [
            across | {"type": "line", "y1": at, "line": {"color": "ink", "width": 2, "dash": "dash"}},
            across
            | {
                "type": "rect",
                "y1": high if limit.above else low,
                "layer": "below",
                "line": {"width": 0},
                "fillcolor": "rgba(0,122,90,0.13)",
                "editable": False,
            },
        ]
    elif seen:
        y_axis["range"] = list(_range(seen))
    return {"data": traces, "layout": layout, "bar": False, "drag": limit is not None}


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
        part = _cut(result, name, choice)
        words = part.transpose(choice.x, *(dim for dim in part.dims if dim in STATES)).values.reshape(shape[0], -1)
        if words.shape == tuple(shape):
            return words.astype(str)
    return np.full(shape, "")


def _range(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    more = max(ROOM * (high - low), SAME * max(abs(low), abs(high))) or 1.0
    return low - more, high + more


def scale_of(result: xr.Dataset, choice: Choice) -> tuple[float, str]:
    """Return the scale and the unit in which the lines of a choice are drawn."""
    return unit_of(_cut(result, choice.quantity, choice).load())


def usual_limit(result: xr.Dataset, choice: Choice, above: bool) -> DrawnLimit | None:
    """Return a limit in the middle of the lines of a choice; None where there are none."""
    values = _cut(result, choice.quantity, choice).values
    values = values[np.isfinite(values)]
    return DrawnLimit(float(0.5 * (values.min() + values.max())), above) if len(values) else None


def picked(result: xr.Dataset, choice: Choice, x: float, y: float) -> Choice:
    """Return a choice whose places are those of a point that was clicked, given as it is shown."""
    places = dict(choice.places)
    for dim, value in ((choice.x, x), (choice.y, y)):
        if dim:
            shown = result[dim].values / unit_of(result[dim])[0]
            places[dim] = int(np.argmin(np.abs(shown - value)))
    return replace(choice, places=places)


def settings_at(result: xr.Dataset, choice: Choice) -> dict[str, tuple[float, str]]:
    """Return the parameters and the set point of a clicked point with their SI units, by path."""
    known = paths_of(result) | ({"set_point": "set_point"} if "set_point" in result.dims else {})
    return {
        path: (float(result[dim].values[choice.places[dim]]), str(result[dim].attrs.get("units", "1")))
        for dim, path in known.items()
        if dim in choice.places and result[dim].dtype.kind == "f"
    }


def words_of(settings: Mapping[str, tuple[float, str]], labels: Mapping[str, str]) -> str:
    """Return settings in words."""
    import xarray as xr

    found = []
    for path, (value, unit) in settings.items():
        scale, name = reader_unit(xr.DataArray([value], attrs={"units": unit}))
        found.append(f"{labels.get(path, path)} {value / scale:.4g}{'' if name == '1' else f' {name}'}")
    return ", ".join(found)


def shown_limit(result: xr.Dataset, choice: Choice, limit: DrawnLimit) -> str:
    """Return a limit as text, in the unit of the lines."""
    scale, unit = scale_of(result, choice)
    return f"{limit.value / scale:.4g}{'' if unit == '1' else f' {unit}'}"


def read_limit(result: xr.Dataset, choice: Choice, text: str, above: bool) -> DrawnLimit:
    """Return a limit that was typed; a plain number is in the unit of the lines.

    Raises
    ------
    ParameterError
        When it is none.
    """
    scale, _ = scale_of(result, choice)
    try:
        return DrawnLimit(float(text.replace(",", ".")) * scale, above)
    except ValueError:
        return DrawnLimit(parse(text, str(result[choice.quantity].attrs.get("units", "1"))), above)


def allowed(result: xr.Dataset, choice: Choice, limit: DrawnLimit) -> str:
    """Return in words where along the lines the limit holds, for all states there are."""
    variable = _cut(result, choice.quantity, choice)
    values = variable.transpose(choice.x, ...).values.reshape(variable.sizes[choice.x], -1)
    there = np.isfinite(values).any(axis=1)
    with np.errstate(invalid="ignore"):
        fails = (values < limit.value if limit.above else values > limit.value).any(axis=1)
    holds = np.flatnonzero(there & ~fails)
    if not len(holds):
        return "The limit holds nowhere here for all states."
    x, _ = _axis(result, choice.x)
    unit = unit_of(result[choice.x])[1]
    ends = [f"{x[place]:.4g}{'' if unit == '1' else f' {unit}'}" for place in (holds[0], holds[-1])]
    gaps = "" if len(holds) == holds[-1] - holds[0] + 1 else ", with gaps"
    return f"For all states the limit holds from {ends[0]} to {ends[1]}{gaps}."
