"""The figure of a reconstructed force: its band, what the curve does not tell, and the law where it is known."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.gui.curves.chart import packed
from dforce.gui.curves.figures import MARGIN, Drawn, Figure, title, unit_of

if TYPE_CHECKING:
    import xarray as xr

BAND = 2.0  # errors
FILL = "rgba(128,128,128,0.25)"


def figure_of(result: xr.Dataset) -> Drawn:
    """Return force against distance with a band of two errors; gaps are shaded, the law, if known, is beside it."""
    (x_scale, x_unit), (scale, unit) = unit_of(result["distance"]), unit_of(result["force"])
    x, force, error = (np.asarray(result[name].values, dtype=float) for name in ("distance", "force", "force_error"))
    data: list[Figure] = []

    def add(y: Any, meta: str, name: str, line: Figure) -> None:
        data.append(
            {
                "x": packed(x / x_scale),
                "y": packed(y / scale),
                "type": "scatter",
                "mode": "lines",
                "meta": meta,
                "name": name,
                "line": line,
                "hovertemplate": f"%{{x:.3g}} {x_unit}, %{{y:.3g}} {unit}<extra>{name}</extra>",
            }
        )

    known = np.isfinite(force) & np.isfinite(error)
    for part in np.split(np.flatnonzero(known), np.flatnonzero(np.diff(np.flatnonzero(known)) > 1) + 1):
        around = np.concatenate([force[part] + BAND * error[part], (force[part] - BAND * error[part])[::-1]])
        data.append(
            {
                "x": packed(np.concatenate([x[part], x[part][::-1]]) / x_scale),
                "y": packed(around / scale),
                "type": "scatter",
                "mode": "lines",
                "meta": "force_error",
                "name": "two errors",
                "line": {"color": "soft", "width": 0},
                "fill": "toself",
                "fillcolor": FILL,
                "hoverinfo": "skip",
                "showlegend": False,
            }
        )
    if "law_force" in result:
        add(result["law_force"].values, "law_force", "law", {"color": "soft", "dash": "dash", "width": 2})
    add(force, "force", "reconstructed, with two errors", {"color": 0, "dash": "solid", "width": 2})
    gaps: list[Figure] = [
        {
            "type": "rect",
            "xref": "x",
            "yref": "paper",
            "x0": float(low / x_scale),
            "x1": float(high / x_scale),
            "y0": 0,
            "y1": 1,
            "layer": "below",
            "line": {"width": 0},
            "fillcolor": FILL,
        }
        for low, high in zip(result["gap_low"].values, result["gap_high"].values, strict=True)
    ]
    words = [
        {
            "text": "force unknown",
            "x": 0.5 * (gap["x0"] + gap["x1"]),
            "y": 1,
            "yref": "paper",
            "yanchor": "top",
            "showarrow": False,
            "textangle": -90,
        }
        for gap in gaps
    ]
    layout = {
        "margin": MARGIN,
        "hovermode": "closest",
        "showlegend": True,
        "shapes": gaps,
        "annotations": words,
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.0, "yanchor": "bottom"},
        "xaxis": {"title": {"text": title(result["distance"], x_unit)}},
        "yaxis": {"title": {"text": title(result["force"], unit)}, "zeroline": True},
    }
    return Drawn({"data": data, "layout": layout, "bar": "hover"}, (None,) * len(data))
