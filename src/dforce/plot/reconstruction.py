"""The picture of a reconstructed force: its band, its gaps, the formulas in use, and the law where it is known."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.arrays import Array
from dforce.core.errors import checked
from dforce.plot._style import (
    BLUE,
    GRAY,
    GREEN,
    LIGHT,
    ORANGE,
    PURPLE,
    SKY,
    head,
    new_figure,
    shown,
    take,
    tidy,
    with_numbers,
)
from dforce.results.dataset import reader_unit

BAND = 2.0  # errors
SHOWN = 0.02  # of the range of the force: further out there is nothing to see
LOOKS = {
    "sader_jarvis": (GREEN, "Sader and Jarvis"),
    "holscher": (ORANGE, "Hölscher"),
    "payam": (PURPLE, "Payam"),
    "sinusoid": (SKY, "sinusoid for a path"),
}


@checked
def reconstruction(
    dataset: xr.Dataset, figure: FigureBase | None = None, formulas: bool = False, width: float | None = None
) -> Axes:
    """Draw a reconstructed force against distance with a band of two errors; gaps are shaded, and a known law is drawn behind.

    Parameters
    ----------
    dataset
        The result of :func:`dforce.reconstruct`.
    formulas
        Whether to draw the forces by the formulas in use.
    width
        Range of the distance axis (m), from the closest point on; default: the range of the force.

    Raises
    ------
    ParameterError
        When the dataset has no reconstructed force.
    """
    x, across = shown(take(dataset, "distance", "distance"))
    force = take(dataset, "force_error", "distance") * 0.0 + take(dataset, "force", "distance")
    force.attrs, force.name = dict(dataset["force"].attrs), "force"
    scale = reader_unit(with_numbers(force))[0]
    y, error = np.asarray(force.values) / scale, np.asarray(dataset["force_error"].values) / scale
    figure = new_figure(figure, 6.0, 4.2)
    axes = figure.subplots()
    to_nm = reader_unit(dataset["distance"])[0]
    for number, (low, high) in enumerate(zip(dataset["gap_low"].values, dataset["gap_high"].values, strict=True)):
        axes.axvspan(low / to_nm, high / to_nm, color=LIGHT, linewidth=0.0, label=None if number else "force unknown")
    if "law_force" in dataset:
        axes.plot(x, dataset["law_force"].values / scale, color=GRAY, linewidth=2.6, alpha=0.7, label="law")
    axes.fill_between(x, y - BAND * error, y + BAND * error, color=BLUE, alpha=0.25, linewidth=0.0, label="two errors")
    axes.plot(x, y, color=BLUE, linewidth=1.3, label="reconstructed")
    if formulas:
        for name, (color, label) in LOOKS.items():
            values = dataset["classic_force"].sel(formula=name).values / scale
            axes.plot(x, values, color=color, linewidth=1.0, linestyle=(0, (4, 1.5)), label=label)
    axes.axhline(0.0, color=GRAY, linewidth=0.6)
    axes.set_xlim(x[0], x[0] + width / to_nm if width is not None else _felt(x, y))
    _frame(axes, y, error)
    axes.set_xlabel(across)
    axes.set_ylabel(shown(force)[1])
    axes.legend(fontsize="small", framealpha=0.85, loc="best")
    tidy(axes)
    head(axes, dataset)
    return axes


def _felt(x: Array, y: Array) -> float:
    """Return how far the force is felt, with room."""
    felt = np.abs(y) >= SHOWN * np.nanmax(np.abs(y))  # all of it where there is no force
    return float(x[0] + 1.3 * (x[felt].max() - x[0]))


def _frame(axes: Axes, y: Array, error: Array) -> None:
    """Show the force whole, and its band where that is no larger."""
    room = 0.15 * float(np.nanmax(y) - np.nanmin(y)) or 1.0  # as around any line without a height
    axes.set_ylim(
        max(float(np.nanmin(y - BAND * error)), float(np.nanmin(y)) - 3.0 * room) - room / 3.0,
        min(float(np.nanmax(y + BAND * error)), float(np.nanmax(y)) + 3.0 * room) + room / 3.0,
    )
