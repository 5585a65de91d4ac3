"""The picture of a measured curve: amplitude and phase against height, both directions, the free part marked."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.errors import ParameterError, checked
from dforce.plot._style import DIRECTIONS, GRAY, axis_text, head, new_figure, tidy
from dforce.plot.distances import RESONANCE, phase_axis
from dforce.results.dataset import reader_unit

MARKER = {"approach": "o", "retract": "s"}


@checked
def measured(dataset: xr.Dataset, figure: FigureBase | None = None) -> tuple[Axes, Axes]:
    """Draw amplitude and phase of a measured curve against height, one above the other.

    Approach and retract have their own colors and marks; points of the free part (from :func:`dforce.calibrate`) are filled
    gray. A bar shows one standard deviation of a point on both sides, if it is larger than a mark. Above the line at the
    free phase the net force is attractive, below the line repulsive.

    Parameters
    ----------
    dataset
        The result of :func:`dforce.read_measured` or :func:`dforce.calibrate`.
    figure
        See :mod:`dforce.plot`.

    Raises
    ------
    ParameterError
        When the result is not a measured curve of amplitude and phase.
    """
    missing = [name for name in ("height", "amplitude", "phase", "direction") if name not in dataset.variables]
    if missing or dataset["height"].dims != ("point",) or dataset["amplitude"].dims != ("point",):
        raise ParameterError(
            "dataset is not a measured curve of amplitude and phase; get a curve from df.read_measured"
        )
    upper, lower = new_figure(figure, 6.0, 6.0).subplots(2, 1, sharex=True)
    across, unit = reader_unit(dataset["height"])
    height = np.asarray(dataset["height"].values, dtype=float) / across
    for axes, name in ((upper, "amplitude"), (lower, "phase")):
        scale, own = reader_unit(dataset[name])
        values = np.asarray(dataset[name].values, dtype=float) / scale
        error = float(dataset.attrs.get(f"{name}_error", 0.0)) / scale
        for word, look in DIRECTIONS.items():
            rows = dataset["direction"].values == word
            if rows.any():
                axes.errorbar(
                    height[rows],
                    values[rows],
                    yerr=error or None,
                    fmt=MARKER[word],
                    markersize=3.0,
                    elinewidth=0.6,
                    linewidth=0.6,
                    linestyle="-",
                    color=look["color"],
                    markerfacecolor="white",
                    label=look["label"],
                )
        if "free" in dataset:
            free = np.asarray(dataset["free"].values, dtype=bool)
            axes.plot(height[free], values[free], ".", color=GRAY, markersize=4.0, zorder=5, label="free part")
        axes.set_ylabel(axis_text(dataset[name], own))
        tidy(axes)
    upper.set_ylim(bottom=min(0.0, upper.get_ylim()[0]))
    if dataset.attrs.get("phase_convention") == "lag":
        phase_axis(lower, float(dataset.attrs.get("free_phase", RESONANCE)))
    else:
        lower.set_ylabel("phase as in the file (°)")
    lower.set_xlabel(axis_text(dataset["height"], unit))
    upper.legend(framealpha=0.85, fontsize="small", loc="best")
    head(upper, dataset, str(dataset.attrs.get("source", "")))
    return upper, lower
