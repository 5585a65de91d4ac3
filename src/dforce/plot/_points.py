"""The points of a measured curve in a picture of curves that were computed."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from dforce.plot._style import GRAY
from dforce.results.measured import by_model

FILLED = {"approach": GRAY, "retract": "none"}


def draw_points(
    axes: Axes, measured: xr.Dataset, across: tuple[str, float], up: tuple[str, float], tone: int = 0
) -> list[Line2D]:
    """Draw the measured points of one quantity against another, where both were measured, and return the lines.

    Parameters
    ----------
    measured
        A calibrated curve.
    across, up
        The quantities, by the names of the model, and the divisors of their values.
    tone
        The tone to draw, from 1; 0: all.
    """
    there, out = by_model(measured), list[Line2D]()
    if across[0] not in there or up[0] not in there:
        return out
    for number, values in enumerate(there[up[0]]):
        if tone not in (0, number + 1):
            continue
        x = there[across[0]][min(number, len(there[across[0]]) - 1)]
        for word, inside in FILLED.items():
            rows = np.asarray(measured["direction"].values == word)
            if rows.any():
                out += axes.plot(
                    x[rows] / across[1],
                    values[rows] / up[1],
                    "o",
                    markersize=2.5,
                    markeredgewidth=0.6,
                    color=GRAY,
                    markerfacecolor=inside,
                    zorder=1.5,
                    label=f"measured, {word}",
                )
    return out
