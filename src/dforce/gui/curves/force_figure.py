"""The small figure of the force against distance, with its parts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dforce.gui.curves.chart import packed
from dforce.gui.curves.figures import LIGHT, WIDTH, Figure
from dforce.results.dataset import reader_unit

if TYPE_CHECKING:
    import xarray as xr

LEAST_PART = 1e-6  # of the unit of the force: a part below it is none
PART_COLORS = (2, 3, 4, 5)


def force_distance(result: xr.Dataset, parts: xr.Dataset | None = None) -> Figure:
    """Return the small figure of the total force against distance, both directions where they differ.

    With the parts that :func:`dforce.force_parts` gives, each of several has a thin line.
    """
    (x_scale, x_unit), (scale, unit) = reader_unit(result["distance"]), reader_unit(result["force"])
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
        [] if parts is None else [one for one in parts["force_part"] if float(np.abs(one).max()) > LEAST_PART * scale]
    )
    for number, one in enumerate(shown if len(shown) > 1 else []):
        name = str(one["interaction"].values)
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
