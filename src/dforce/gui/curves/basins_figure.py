"""The figure of basins: which state is reached from which start, with a dot where each state is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dforce as df
from dforce.findings.coexisting import starts_of_states
from dforce.gui.curves.chart import packed
from dforce.gui.curves.figures import MARGIN, Drawn, label_of, legend, plain, title
from dforce.results.dataset import reader_unit

if TYPE_CHECKING:
    import xarray as xr


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
    up, right = starts_of_states(result)
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
