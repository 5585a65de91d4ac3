"""Figures beside the curves: the force against distance with its parts, and the map of basins."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

import dforce as df
from dforce.case import case_of
from dforce.experiments.basins import starts_of_states
from dforce.gui.case.fields import with_models
from dforce.gui.curves.chart import Chart, label_of, legend, packed, plain, title, unit_of
from dforce.gui.curves.figures import LIGHT, MARGIN, WIDTH, Drawn, Figure
from dforce.gui.document.compute import BEHIND, LIVE_CURVES, Overtaken, in_thread
from dforce.results.dataset import reader_unit

if TYPE_CHECKING:
    import xarray as xr

LEAST_PART = 1e-6  # of the unit of the force: a part below it is none
PART_COLORS = (2, 3, 4, 5)


class ForceChart(Chart):
    """The force against distance, computed once there is time for it."""

    def __init__(self) -> None:
        super().__init__("force against distance")
        self._of: df.Case | None = None  # the case that it shows

    def has_law(self, case: df.Case) -> bool:
        """Return whether it shows the law of a case, if perhaps over other distances."""
        return self._of is not None and _law(self._of) == _law(case)

    async def follow(self, case: df.Case, overtaken: Callable[[], bool]) -> bool:
        """Show the force of a case with its parts; return whether it does so before something newer is asked for."""

        def figure() -> Figure:
            LIVE_CURVES.give_way(overtaken)
            curve = df.force_curve(case)
            return force_distance(curve, df.force_parts(curve.isel(direction=[0])))

        if case != self._of:
            try:
                made = await in_thread(BEHIND, figure)
            except Overtaken:
                return False
            await self.draw(made)
            self._of = case
        return True

    async def preview(self, curve: xr.Dataset) -> None:
        """Show the force of a law that is no part of the case yet."""
        self._of = None
        await self.draw(force_distance(curve))


def _law(case: df.Case) -> tuple[object, ...]:
    return case.problem.forces, case.problem.a0


def force_distance(result: xr.Dataset, parts: xr.Dataset | None = None) -> Figure:
    """Return the small figure of the total force against distance, both directions where they differ.

    With the parts that :func:`dforce.force_parts` gives, each of several has a thin line.
    """
    (x_scale, x_unit), (scale, unit) = reader_unit(result["distance"]), unit_of(result["force"])
    force = result["force"].values
    ways = (0, 1) if not np.array_equal(force[0], force[1]) else (0,)
    data = []
    for way in ways:
        direction = str(result["direction"].values[way])
        look = {"color": 0, "width": WIDTH, "simplify": False}
        data.append(
            {
                "x": packed(result["distance"].values / x_scale),
                "y": packed(force[way] / scale),
                "meta": "force",
                "type": "scatter",
                "mode": "lines",
                "name": direction,
                "line": look,
                "opacity": LIGHT.get(direction, 1.0),
                "showlegend": False,
                "hovertemplate": f"distance %{{x:.3g}} {x_unit}<br>force %{{y:.3g}} {unit}<extra></extra>",
            }
        )
    shown = (
        [] if parts is None else [one for one in parts["force_part"] if np.abs(one.values).max() > LEAST_PART * scale]
    )
    for number, one in enumerate(shown if len(shown) > 1 else []):
        name = with_models(str(one["interaction"].values))
        data.append(
            {
                "x": packed(result["distance"].values / x_scale),
                "y": packed(one.values[0] / scale),
                "meta": "force part",
                "type": "scatter",
                "mode": "lines",
                "name": name,
                "showlegend": True,
                "line": {"color": PART_COLORS[number % len(PART_COLORS)], "width": 1.2, "dash": "dot"},
                "hovertemplate": f"distance %{{x:.3g}} {x_unit}<br>{name} %{{y:.3g}} {unit}<extra></extra>",
            }
        )
    layout = {
        "margin": {"l": 50, "r": 8, "t": 6, "b": 42},
        "showlegend": len(shown) > 1,
        # at the right, where the force is small
        "legend": {"x": 1, "xanchor": "right", "y": 1, "yanchor": "top", "font": {"size": 10}},
        "hovermode": "closest",
        "xaxis": {"title": {"text": f"distance <i>d</i> ({x_unit})"}},
        "yaxis": {"title": {"text": f"force ({unit})"}, "zeroline": True},
    }
    return {"data": data, "layout": layout}


def basins(result: xr.Dataset) -> Drawn:
    """Return which state is reached from which start, as a map."""
    vertical, across = (str(dim) for dim in result["reached"].dims)
    (x_scale, x_unit), (y_scale, y_unit) = reader_unit(result[across]), reader_unit(result[vertical])
    count = result.sizes["state"]
    # a color for each state, none for starts that lead to none
    steps = [(n + more) / (count + 1) for n in range(count + 1) for more in (0, 1)]
    colors: list[Any] = [name for n in range(count + 1) for name in [n - 1 if n else "grid"] * 2]
    trace = {
        "type": "heatmap",
        "x": packed(result[across].values / x_scale),
        "y": packed(result[vertical].values / y_scale),
        "z": packed(result["reached"].values),
        "zmin": -0.5,
        "zmax": count + 0.5,
        "meta": "reached",
        "colorscale": [list(pair) for pair in zip(steps, colors, strict=True)],
        "showscale": False,
        "hovertemplate": f"{label_of(result[across])} %{{x:.4g}} {plain(x_unit)}<br>"
        f"{label_of(result[vertical])} %{{y:.4g}} {plain(y_unit)}<br>to state %{{z}}<extra></extra>",
    }
    states = [
        {
            "type": "scatter",
            "x": [None],
            "y": [None],
            "mode": "markers",
            "showlegend": True,
            "name": plain(f"{finding.label}: {finding.text}"),
            "marker": {"symbol": "square", "size": 10, "color": n},
        }
        for n, finding in enumerate(finding for finding in df.summary(result) if finding.name == "share")
    ]
    up, right = starts_of_states(result, case_of(result).problem.tones[0])
    states.append(
        {
            "type": "scatter",
            "x": packed(right / x_scale),
            "y": packed(up / y_scale),
            "mode": "markers",
            "meta": "states",
            "showlegend": False,
            "marker": {"symbol": "circle", "size": 11, "color": "ink"},
            "text": [plain(finding.label) for finding in df.summary(result) if finding.name == "share"],
            "hovertemplate": "%{text}<extra></extra>",
        }
    )
    layout = {
        "margin": MARGIN | {"t": 10 + 18 * len(states)},
        "hovermode": "closest",
        "showlegend": True,
        "legend": legend()
        | {"orientation": "v", "x": 0.0, "xanchor": "left", "itemclick": False, "itemdoubleclick": False},
        "xaxis": {"title": {"text": title(result[across], x_unit)}, "showgrid": False},
        "yaxis": {"title": {"text": title(result[vertical], y_unit)}, "showgrid": False},
    }
    return Drawn({"data": [trace, *states], "layout": layout, "bar": "hover"}, (None,) * (1 + len(states)))
