"""The picture of a plan: where limits hold, their boundaries, and the recommended point with its margins."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, checked
from dforce.plot._style import BLUE, VERMILLION, axis_text, head, new_figure
from dforce.plot.maps import edges_of, is_log
from dforce.results.dataset import reader_unit
from dforce.results.plan_regions import everywhere, located, nodes, region

ALLOWED, MARGINS = "#bfe3cf", "#eef6d6"
FAILING = ("#f3d9c8", "#e9c3d3", "#d6d0e8", "#f4e8b8", "#cfdde6", "#e3e3e3")


@checked
def plan(dataset: xr.Dataset, figure: FigureBase | None = None) -> Axes:
    """Draw the settings at which the limits of a plan hold, and the failing limit elsewhere.

    With one parameter the axes are the parameter and the set point; with two, both parameters at the recommended set point.
    Black dots are located boundaries of the allowed region. A red dot is the recommended point, with its margins as a dashed
    frame; a star is the best point by a single goal. Small circles are the Pareto front of several goals. If nothing is
    allowed, a cross is the point of least violation.

    Parameters
    ----------
    dataset
        A result of :func:`dforce.plan`.
    figure
        See :mod:`dforce.plot`.

    Raises
    ------
    ParameterError
        When the dataset is not a plan, or its parameters are not ranges.
    """
    if "plan_over" not in dataset.attrs:
        raise ParameterError("this dataset is not a plan")
    marked = _place(dataset, "recommended") or _place(dataset, "least_violation")
    dims = [str(dim) for dim in dataset["allowed"].dims[:-1]]
    if len(dims) == 3:
        dataset = dataset.isel(set_point=marked[dims.index("set_point")] if marked else 0)
        dims.remove("set_point")
    x, y = dims
    for name in (x, y):
        if dataset.sizes[name] < 2:
            raise ParameterError(f"'{name}' has one value, so it has no picture")
    axes = new_figure(figure, 6.4, 5.4).subplots()
    at = [np.asarray(dataset[name].values, dtype=float) / reader_unit(dataset[name])[0] for name in (x, y)]
    handles = _fill(axes, dataset, x, y, at)
    scales = [reader_unit(dataset[name])[0] for name in (x, y)]
    axes.plot(*(located(dataset, x, y) / scales).T, linestyle="", marker=".", markersize=4, color="black")
    handles += _marks(axes, dataset, x, y, at)
    for name, values, axis in (("x", at[0], x), ("y", at[1], y)):
        words = str(dataset[axis].attrs.get("long_name", axis)).partition(";")[0]
        if is_log(values):
            getattr(axes, f"set_{name}scale")("log")
        getattr(axes, f"set_{name}label")(
            axis_text(dataset[axis].assign_attrs(long_name=words), reader_unit(dataset[axis])[1])
        )
        getattr(axes, f"set_{name}lim")(values.min(), values.max())
    axes.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, frameon=False, fontsize="small"
    )
    head(axes, dataset)
    return axes


def _place(dataset: xr.Dataset, name: str) -> tuple[int, ...]:
    """Return where a point is marked; nothing where none is."""
    found = np.argwhere(dataset[name].values) if name in dataset else np.empty((0, 0))
    return tuple(int(i) for i in found[0]) if len(found) else ()


def _fill(axes: Axes, dataset: xr.Dataset, x: str, y: str, at: list[Array]) -> list[Any]:
    """Color failing cells of the grid, and above them the allowed regions, up to the located boundaries."""
    allowed, holds, first = nodes(dataset, x, y)
    names = sorted(set(first.ravel().tolist()) - {""})
    failing = [FAILING[i % len(FAILING)] for i in range(len(names))]
    if names:
        numbers = np.searchsorted(names, everywhere(first))
        norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names)) if len(names) > 1 else None
        axes.pcolormesh(*map(edges_of, at), numbers, cmap=ListedColormap(failing), norm=norm, rasterized=True)
    scales = [reader_unit(dataset[name])[0] for name in (x, y)]
    looks = [("their margins fail", MARGINS, holds, False)] if (holds & ~allowed).any() else []
    looks.append(("all limits hold", ALLOWED, allowed, True))
    for _, color, inside, with_margins in looks:
        shapes = [shape / scales for shape in region(dataset, x, y, inside, with_margins)]
        axes.add_collection(PolyCollection(shapes, facecolors=color, edgecolors="none", gid=color))
    found = [(word, color) for word, color, *_ in reversed(looks)]
    found += [(name.replace("_", " "), color) for name, color in zip(names, failing, strict=True)]
    return [Patch(facecolor=color, edgecolor="gray", label=word) for word, color in found]


def _marks(axes: Axes, dataset: xr.Dataset, x: str, y: str, at: list[Array]) -> list[Any]:
    """Mark the points that a plan names."""
    looks = (
        ("pareto", "Pareto front", {"marker": "o", "markersize": 5, "color": "none", "markeredgecolor": BLUE}),
        ("best", "best by the goal", {"marker": "*", "markersize": 12, "color": BLUE}),
        ("recommended", "most room", {"marker": "o", "markersize": 8, "color": VERMILLION}),
        ("least_violation", "least violation", {"marker": "x", "markersize": 9, "color": VERMILLION}),
    )
    handles: list[Any] = []
    for name, word, look in looks:
        if name not in dataset:
            continue
        found = np.argwhere(dataset[name].transpose(x, y, "state").values)
        if len(found) and not (name == "pareto" and "best" in dataset):
            axes.plot(at[0][found[:, 0]], at[1][found[:, 1]], linestyle="", clip_on=False, **look)  # type: ignore[arg-type]
            handles.append(Line2D([], [], linestyle="", label=word, **look))  # type: ignore[arg-type]
    corner = np.argwhere(dataset["recommended"].transpose(x, y, "state").values)
    if len(corner):
        spans = [_margin(dataset[name], place) for name, place in zip((x, y), corner[0], strict=False)]
        (left, right), (low, high) = spans
        axes.add_patch(
            Rectangle((left, low), right - left, high - low, fill=False, edgecolor=VERMILLION, linestyle="dashed")
        )
        handles.append(Patch(facecolor="none", edgecolor=VERMILLION, linestyle="dashed", label="its margins"))
    return handles


def _margin(axis: xr.DataArray, place: int) -> tuple[float, float]:
    """Return the ends of the margins around a value, as it is shown."""
    value, size = float(axis.values[place]), float(axis.attrs["margin"])
    scale, _ = reader_unit(axis)
    if axis.attrs["margin_is_relative"]:
        return value * float(np.exp(-size)) / scale, value * float(np.exp(size)) / scale
    return (value - size) / scale, (value + size) / scale
