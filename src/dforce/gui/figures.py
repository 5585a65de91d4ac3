"""Figures of results as plain data for Plotly.

A color is a name that chart.js looks up in the theme, "ink" or "soft" say, or the number of a series. `figure` chooses what
suits a result; more plots are further functions of a Dataset that return the same kind of dict.
"""

from __future__ import annotations

import html
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

import dforce as df
from dforce.gui.chart import packed

if TYPE_CHECKING:
    import xarray as xr

Figure = dict[str, Any]
GAP = 0.07  # of the height, between two panels
UNSTABLE = "dash"
DIRECTIONS = {"approach": (0, "solid"), "retract": (1, "dash"), "up": (0, "solid"), "down": (1, "dash")}
MARGIN = {"l": 64, "r": 20, "t": 28, "b": 48}


def figure(result: xr.Dataset) -> Figure:
    """Return the figure that suits a result: curves, motion, or basins."""
    if "reached" in result:
        return basins(result)
    if "amplitude" in result and any(dim in result["amplitude"].dims for dim in ("zc", "frequency", "point")):
        return curves(result, ("amplitude", "phase"))
    return motion(result)


def curves(result: xr.Dataset, names: tuple[str, ...]) -> Figure:
    """Return quantities against what the result goes along, one panel above the other."""
    along = along_of(result)
    x_scale, x_unit = df.reader_unit(result[along])
    data: list[dict[str, Any]] = []
    layout: Figure = {"margin": MARGIN, "hovermode": "closest", "legend": _legend(), "showlegend": True}
    for panel, name in enumerate(names):
        tag = "" if panel == 0 else str(panel + 1)
        scale, unit = df.reader_unit(result[name])
        layout[f"yaxis{tag}"] = {"title": {"text": title(result[name], unit)}, "domain": _domain(panel, len(names))}
        layout[f"xaxis{tag}"] = {"anchor": f"y{tag}", "matches": "x"} if panel else {"anchor": "y"}
        last = panel == len(names) - 1
        layout[f"xaxis{tag}"] |= (
            {"title": {"text": title(result[along], x_unit)}} if last else {"showticklabels": False}
        )
        for x, y, style in lines(result, name, along):
            data.append(
                {
                    "x": packed(x / x_scale),
                    "y": packed(y / scale),
                    "xaxis": f"x{tag}",
                    "yaxis": f"y{tag}",
                    "showlegend": panel == 0,
                    "meta": name,
                    "hovertemplate": f"%{{x:.4g}} {html.escape(x_unit)}, %{{y:.4g}} {html.escape(unit)}<extra></extra>",
                    **style,
                }
            )
    if not sum(bool(trace["showlegend"]) for trace in data) > 1:
        layout["showlegend"] = False
    return {"data": data, "layout": layout, "bar": "hover"}


def along_of(result: xr.Dataset) -> str:
    """Return the name of what a curve goes along."""
    if "along" in result.attrs:
        return str(result.attrs["along"])
    return "frequency" if "frequency" in result["amplitude"].dims else "zc"


def lines(result: xr.Dataset, name: str, along: str) -> Iterator[tuple[Any, Any, dict[str, Any]]]:
    """Give x, y and style of each line of a quantity: a line for each direction and tone, stable and unstable apart."""
    variable = result[name]
    x = result[along].values
    more = [dim for dim in variable.dims if dim not in (along, "point", "direction")]
    for index in np.ndindex(*(variable.sizes[dim] for dim in more)):
        one = variable.isel(dict(zip(more, index, strict=True)))
        color = 2 * index[0] if index else 0
        tag = "".join(
            f", {dim} {result[dim].values[n]}" for dim, n in zip(more, index, strict=True) if result.sizes[dim] > 1
        )
        if "direction" in one.dims:
            for way in result["direction"].values:
                shade, dash = DIRECTIONS.get(str(way), (0, "solid"))
                yield x, one.sel(direction=way).values, _line(f"{way}{tag}", color + shade, dash)
        elif "stable" in result and one.dims == ("point",):
            stable = result["stable"].values.astype(bool)
            for dash, wanted, word in (("solid", stable, "stable"), (UNSTABLE, ~stable, "unstable")):
                if wanted.any():
                    yield *_pieces(x, one.values, result["branch"].values, wanted), _line(f"{word}{tag}", color, dash)
        else:
            yield x, one.values, _line(f"{name}{tag}" if tag else "", color, "solid")


def _pieces(x: Any, y: Any, branch: Any, wanted: Any) -> tuple[Any, Any]:
    """Return a curve's points of one kind, with gaps between its pieces; each piece reaches the next point of the curve."""
    kept = wanted.copy()
    same = branch[1:] == branch[:-1]
    kept[1:] |= wanted[:-1] & same
    xs, ys = np.where(kept, x, np.nan), np.where(kept, y, np.nan)
    breaks = np.flatnonzero(~same) + 1
    return np.insert(xs, breaks, np.nan), np.insert(ys, breaks, np.nan)


def motion(result: xr.Dataset) -> Figure:
    """Return deflection and force over time."""
    names = [name for name in ("deflection", "force", "indentation") if name in result and "time" in result[name].dims]
    layout: Figure = {"margin": MARGIN, "hovermode": "closest", "showlegend": False}
    data = []
    for panel, name in enumerate(names):
        tag = "" if panel == 0 else str(panel + 1)
        x_scale, x_unit = df.reader_unit(result["time"])
        scale, unit = df.reader_unit(result[name])
        layout[f"yaxis{tag}"] = {"title": {"text": title(result[name], unit)}, "domain": _domain(panel, len(names))}
        layout[f"xaxis{tag}"] = {"anchor": f"y{tag}"} | ({"matches": "x"} if panel else {})
        last = panel == len(names) - 1
        layout[f"xaxis{tag}"] |= (
            {"title": {"text": title(result["time"], x_unit)}} if last else {"showticklabels": False}
        )
        data.append(
            {
                "x": packed(result["time"].values / x_scale),
                "y": packed(result[name].values / scale),
                "xaxis": f"x{tag}",
                "yaxis": f"y{tag}",
                "meta": name,
                **_line("", panel, "solid"),
            }
        )
    return {"data": data, "layout": layout, "bar": "hover"}


def basins(result: xr.Dataset) -> Figure:
    """Return which state is reached from which start, as a map."""
    vertical, across = (str(dim) for dim in result["reached"].dims)
    (x_scale, x_unit), (y_scale, y_unit) = df.reader_unit(result[across]), df.reader_unit(result[vertical])
    trace = {
        "type": "heatmap",
        "x": packed(result[across].values / x_scale),
        "y": packed(result[vertical].values / y_scale),
        "z": packed(result["reached"].values),
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": "state"}, "outlinewidth": 0, "thickness": 12, "dtick": 1},
        "meta": "reached",
    }
    layout = {
        "margin": MARGIN,
        "xaxis": {"title": {"text": title(result[across], x_unit)}},
        "yaxis": {"title": {"text": title(result[vertical], y_unit)}},
    }
    return {"data": [trace], "layout": layout, "bar": "hover"}


def force_distance(result: xr.Dataset) -> Figure:
    """Return the small figure of the total force against distance, both directions where they differ."""
    (x_scale, x_unit), (scale, unit) = df.reader_unit(result["distance"]), df.reader_unit(result["force"])
    force = result["force"].values
    ways = (0, 1) if not np.array_equal(force[0], force[1]) else (0,)
    data = []
    for way in ways:
        shade, dash = DIRECTIONS[str(result["direction"].values[way])]
        data.append(
            {
                "x": packed(result["distance"].values / x_scale),
                "y": packed(force[way] / scale),
                "meta": "force",
                "hovertemplate": f"%{{x:.3g}} {x_unit}, %{{y:.3g}} {unit}<extra></extra>",
                **_line(str(result["direction"].values[way]), shade, dash),
            }
        )
    layout = {
        "margin": {"l": 54, "r": 12, "t": 8, "b": 38},
        "showlegend": False,
        "hovermode": "closest",
        "xaxis": {"title": {"text": f"distance <i>d</i> ({x_unit})"}},
        "yaxis": {"title": {"text": f"force ({unit})"}, "zeroline": True},
    }
    return {"data": data, "layout": layout}


def empty(text: str) -> Figure:
    """Return a figure that says in a sentence why it is empty."""
    note = {"text": html.escape(text), "x": 0.5, "y": 0.5, "xref": "paper", "yref": "paper", "showarrow": False}
    hidden = {"visible": False}
    return {"data": [], "layout": {"annotations": [note], "xaxis": hidden, "yaxis": hidden, "margin": MARGIN}}


def title(variable: xr.DataArray, unit: str) -> str:
    """Return the title of an axis: name, symbol and unit."""
    name = html.escape(str(variable.attrs.get("long_name", variable.name)))
    symbol = df.html_symbol(str(variable.attrs.get("symbol", "")))
    shown = f" ({html.escape(unit)})" if unit not in ("1", "") else ""
    return f"{name}{f' <i>{symbol}</i>' if symbol else ''}{shown}"


def _line(name: str, color: int, dash: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "line": {"color": color, "dash": dash, "width": 2, "simplify": False},
    }


def _legend() -> dict[str, Any]:
    return {"orientation": "h", "x": 1, "xanchor": "right", "y": 1.0, "yanchor": "bottom"}


def _domain(panel: int, panels: int) -> list[float]:
    height = (1.0 - GAP * (panels - 1)) / panels
    top = 1.0 - panel * (height + GAP)
    return [max(0.0, top - height), top]
