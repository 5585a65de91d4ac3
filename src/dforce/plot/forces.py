"""Pictures of the force against distance: over a cycle of the motion, and of the model itself."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.errors import checked
from dforce.plot._style import DIRECTIONS, GRAY, LIGHT, head, new_figure, shown, take, tidy, with_numbers
from dforce.plot.distances import sweeps
from dforce.plot.motion import at_distance
from dforce.results.dataset import reader_unit

FELT = 0.01  # of the largest force: further out there is nothing to see


@checked
def force_distance(dataset: xr.Dataset, figure: FigureBase | None = None) -> Axes:
    """Draw the force on the tip against the instantaneous distance, for both halves of the motion.

    The area of a loop between both halves is the dissipated energy. The picture shows only the range of the force.

    Raises
    ------
    ParameterError
        When the result has no traces.
    """
    figure = new_figure(figure, 5.2, 4.0)
    axes = figure.subplots()
    x, across = shown(with_numbers(take(dataset, "distance", "time")))
    y, up = shown(with_numbers(take(dataset, "force", "time")))
    velocity = take(dataset, "velocity", "time").values
    for direction, half in (("approach", velocity <= 0.0), ("retract", velocity >= 0.0)):
        look = dict(DIRECTIONS[direction])
        # a gap where the tip goes the other way, so that a line never joins two cycles
        axes.plot(np.where(half, x, np.nan), np.where(half, y, np.nan), linewidth=1.3, **look)
    felt = np.abs(y) > FELT * np.abs(y).max() if np.abs(y).max() > 0.0 else np.full(len(y), True)
    low, high = float(x.min()), float(x[felt].max())
    room = 0.08 * (high - low) or 1.0
    axes.set_xlim(low - room, min(high + 6.0 * room, float(x.max()) + room))
    axes.axhline(0.0, color=GRAY, linewidth=0.6)
    indentation = dataset.get("indentation")
    if indentation is not None and float(indentation.max()) > 0.0:
        scale = reader_unit(dataset["distance"])[0]
        deepest = int(np.argmax(indentation.values))
        contact = (float(dataset["distance"][deepest]) + float(indentation[deepest])) / scale
        axes.axvline(contact, color=GRAY, linewidth=0.8, linestyle=":")
        low_side = y.max() < -y.min()  # away from the line of no force
        axes.annotate(
            "$a_0$",
            (contact, 0.02 if low_side else 0.98),
            (3, 0),
            xycoords=axes.get_xaxis_transform(),
            textcoords="offset points",
            annotation_clip=True,  # the frame may be far from the contact
            va="bottom" if low_side else "top",
            color=GRAY,
            fontsize="small",
        )
    _finish(axes, across, up)
    head(axes, dataset, at_distance(dataset))
    return axes


def against_distance(dataset: xr.Dataset, figure: FigureBase | None = None) -> Axes:
    """Draw the force against distance along a path, or along the distances of a slow curve."""
    return (force_distance if "time" in dataset.dims else force_curve)(dataset, figure)


@checked
def force_curve(dataset: xr.Dataset, figure: FigureBase | None = None) -> Axes:
    """Draw the force of the model against distance, in slow approach and retract; hysteresis is shaded.

    Parameters
    ----------
    dataset
        The result of :func:`dforce.force_curve`: `force` over `distance`, with or without `direction`.

    Raises
    ------
    ParameterError
        When the dataset has no force.
    """
    figure = new_figure(figure, 5.6, 4.0)
    axes = figure.subplots()
    x, across = shown(take(dataset, "distance", "distance"))
    force = take(dataset, "force", "distance", "direction")
    scale = reader_unit(force)[0]
    halves = {direction: np.asarray(half.values, dtype=float) / scale for direction, half in sweeps(force)}
    first, last = next(iter(halves.values())), list(halves.values())[-1]
    same = np.array_equal(first, last, equal_nan=True)
    if not same:
        axes.fill_between(x, first, last, color=LIGHT, linewidth=0.0, label="hysteresis")
    for direction, y in halves.items():
        look = dict(DIRECTIONS.get(direction, DIRECTIONS["approach"]))
        axes.plot(x, y, linewidth=1.4, **({**look, "label": "both directions"} if same else look))
        if same:
            break
    axes.axhline(0.0, color=GRAY, linewidth=0.6)
    axes.margins(x=0.0)
    _finish(axes, across, shown(force)[1])
    head(axes, dataset)
    return axes


def _finish(axes: Axes, across: str, up: str) -> None:
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.legend(fontsize="small", framealpha=0.85, loc="best")
    tidy(axes)
