"""A measured curve in a figure of curves: its points under the lines of the model, the best fit, and residuals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dforce.core.arrays import Array
from dforce.core.notation import html_symbol
from dforce.findings.residuals import residuals
from dforce.gui.curves.chart import name_of_axis, packed
from dforce.gui.curves.figures import TITLED, Drawn, Figure, stacked
from dforce.gui.document.document import DATA
from dforce.results.curves import Picture
from dforce.results.measured import QUANTITIES, by_model, moved

if TYPE_CHECKING:
    import xarray as xr

MOST_POINTS = 4000  # of a curve that are drawn; more are not seen
SYMBOLS = {"approach": "circle", "retract": "circle-open"}
LOW = 0.4  # height of a frame of residuals, relative to a frame of curves
SIGMAS = 2.0  # standard deviations: the band of residuals
MODEL = "model"
BRANCHES = (1, -1)  # from free motion, and behind a jump


@dataclass(frozen=True)
class Beside:
    """A measured curve to draw.

    Attributes
    ----------
    curve
        A result of :func:`dforce.calibrate`.
    shift
        Offset that is added to its heights (m).
    turn
        Offset that is subtracted from its phases (degrees).
    fit
        Its fit, where there is one.
    stale
        Whether the fit is of another case than the model.
    """

    curve: xr.Dataset
    shift: float = 0.0
    turn: float = 0.0
    fit: xr.Dataset | None = None
    stale: bool = False

    def moved(self) -> xr.Dataset:
        """Return the curve with heights that are average distances, and phases as the model counts them."""
        return moved(self.curve, self.shift, self.turn)

    def on_branches(self) -> xr.Dataset:
        """Return the curve as :meth:`moved`, with the branch that the fit found for each point."""
        curve = self.moved()
        if self.fit is None or self.fit.sizes["point"] != curve.sizes["point"]:
            return curve
        return curve.assign_coords(branch=("point", self.fit["branch"].values))


def shows(wanted: Picture) -> bool:
    """Return whether a picture has room for a measured curve."""
    return wanted.x in QUANTITIES and bool({*QUANTITIES} & {*wanted.y}) and not wanted.logarithmic


def with_measured(drawn: Drawn, wanted: Picture, beside: Beside, model: xr.Dataset | None = None) -> Drawn:
    """Return a figure with the points of a measured curve under its lines, and with its fit where there is one.

    A good fit lies on the points: then they are above the lines.

    Below are the residuals of `model`, the curve on top, at the points that the fit used. Only quantities that were measured
    get points; a picture of others stays as it is.
    """
    there = by_model(beside.moved())
    names = [name for name in wanted.y if name in there and name in drawn.places]
    if wanted.x not in there or not names or wanted.logarithmic:
        return drawn
    below, above = list(_points(drawn, wanted, beside, there, names)), list[Figure]()
    layout, lines = dict(drawn.figure["layout"]), list(drawn.figure["data"])
    if not layout["showlegend"]:  # a curve alone needs no name, beside a measured curve it does
        lines[0] = lines[0] | {"name": MODEL, "showlegend": True}
    if beside.fit is not None and wanted.x == "zc":
        above += _lines(drawn, beside.fit, beside, names)
        if not wanted.together and model is not None:
            extra, layout = _residuals(drawn, beside.fit, beside, residuals(model, beside.on_branches()))
            above += extra
    layout["showlegend"] = True
    data = [*below, *lines, *above]
    traces = (*(None,) * len(below), *drawn.traces, *(None,) * len(above))
    return replace(drawn, figure={**drawn.figure, "data": data, "layout": layout}, traces=traces)


def _points(
    drawn: Drawn, wanted: Picture, beside: Beside, there: Mapping[str, list[Array]], names: list[str]
) -> Iterator[Figure]:
    """Give the measured points, a trace for each quantity, tone and direction."""
    directions = beside.curve["direction"].values.astype(str)
    step = -(-len(directions) // MOST_POINTS)
    named: set[str] = set()
    for name in names:
        place = drawn.places[name]
        for tone, values in enumerate(there[name]):
            across = there[wanted.x][min(tone, len(there[wanted.x]) - 1)]
            for word, symbol in SYMBOLS.items():
                rows = np.flatnonzero(directions == word)[::step]
                if not len(rows):
                    continue
                words = f"measured, {word}"
                yield {
                    "x": packed(across[rows] / drawn.x_scale),
                    "y": packed(values[rows] / place.scale),
                    "xaxis": place.x_axis,
                    "yaxis": place.y_axis,
                    "type": "scatter",
                    "mode": "markers",
                    "meta": f"measured {name}",
                    "name": words,
                    "marker": {"symbol": symbol, "size": 5, "color": DATA},
                    **({} if beside.fit is None else {"zorder": 1}),
                    "showlegend": words not in named,
                    "hovertemplate": place.hover(words),
                }
                named.add(words)


def _lines(drawn: Drawn, fit: xr.Dataset, beside: Beside, names: list[str]) -> Iterator[Figure]:
    """Give the curves of the best fit."""
    first = True
    for name in names:
        if f"{name}_fit" not in fit:
            continue
        x_axis, y_axis, scale, _ = drawn.places[name]
        for tone in range(fit.sizes["tone"]):
            x, y = along(fit, fit[f"{name}_fit"].values[:, tone])
            turn = beside.turn if name == "phase" and not tone else 0.0
            yield {
                "x": packed((x + beside.shift) / drawn.x_scale),
                "y": packed((y - turn) / scale),
                "xaxis": x_axis,
                "yaxis": y_axis,
                "type": "scatter",
                "mode": "lines",
                "meta": f"fit {name}",
                "name": "fit of another case" if beside.stale else "best fit",
                "line": {"color": "ink", "width": 1.4, "dash": "solid"},
                "showlegend": first,
                "hoverinfo": "skip",
            }
            first = False


def along(fit: xr.Dataset, values: Array) -> tuple[Array, Array]:
    """Return the heights and values of the points that a fit used, branch by branch, with gaps between them."""
    height, branch, used = (fit[name].values for name in ("height", "branch", "used"))
    xs, ys = list[Array](), list[Array]()
    for kind in BRANCHES:
        rows = np.flatnonzero(used & (branch == kind))
        rows = rows[np.argsort(height[rows], kind="stable")]
        xs += [height[rows], np.array([np.nan])]
        ys += [values[rows], np.array([np.nan])]
    return np.concatenate(xs), np.concatenate(ys)


def _residuals(
    drawn: Drawn, fit: xr.Dataset, beside: Beside, found: Mapping[str, Array]
) -> tuple[list[Figure], Figure]:
    """Return the residuals in frames below the curves' frames, and the layout with room for them."""
    names = [name for name in found if name in drawn.places]
    layout: Figure = dict(drawn.figure["layout"])
    curves = [key for key in layout if key.startswith("yaxis")]
    frames = stacked([1.0] * len(curves) + [LOW] * len(names))
    layout |= {key: layout[key] | {"domain": domain} for key, domain in zip(curves, frames, strict=False)}
    layout["margin"] = layout["margin"] | {"l": TITLED}
    tag = len(curves)
    shapes, traces = list(layout.get("shapes", [])), list[Figure]()
    used = fit["used"].values if fit.sizes["point"] == beside.curve.sizes["point"] else slice(None)
    x = beside.moved()["height"].values[used]
    for number, name in enumerate(names):
        y_axis = name_of_axis("y", tag + number)
        symbol = html_symbol(str(fit[name].attrs.get("symbol", "")))
        layout[name_of_axis("yaxis", tag + number)] = {
            "anchor": "x",
            "domain": frames[tag + number],
            "zeroline": True,
            "title": {"text": f"residual Δ<i>{symbol}</i> / σ, band: ±{SIGMAS:.0f}"},
        }
        layout["xaxis"] = layout["xaxis"] | {"anchor": y_axis}
        shapes.append(
            {
                "type": "rect",
                "xref": "x domain",
                "yref": y_axis,
                "x0": 0,
                "x1": 1,
                "y0": -SIGMAS,
                "y1": SIGMAS,
                "layer": "below",
                "line": {"width": 0},
                "fillcolor": "rgba(128,128,128,0.14)",
            }
        )
        for tone, y in enumerate(found[name][used].T):
            traces.append(
                {
                    "x": packed(x / drawn.x_scale),
                    "y": packed(y),
                    "xaxis": "x",
                    "yaxis": y_axis,
                    "type": "scatter",
                    "mode": "markers",
                    "meta": f"residual {name}",
                    "name": "residual",
                    "showlegend": False,
                    "marker": {"symbol": "circle", "size": 4, "color": 2 * tone},
                    "hovertemplate": "residual %{y:.3g} standard deviations<extra></extra>",
                }
            )
    layout |= {"shapes": shapes, "uirevision": f"{layout.get('uirevision')} fit"}
    return traces, layout
