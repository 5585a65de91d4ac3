"""The regime map: which states there are over a parameter and the set point, with the boundaries that were solved."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from dforce.core.arrays import Array
from dforce.results.dataset import reader_unit
from dforce.results.regime_lines import EDGES, boundary_lines

# a color for each regime, in the order of their numbers: red attracts, blue repels, as in maps of the phase
COLORS = ("#ffffff", "#fbe3d4", "#f0a582", "#d9cfe3", "#84b8d9")
LINES: dict[str, Any] = {name: name for name in ("solid", "dashed", "dotted", "dashdot")}


def is_regime_map(dataset: xr.Dataset) -> bool:
    """Return whether a result contains regimes with their boundaries."""
    return "edge_kind" in dataset and "map_over" in dataset.attrs


def fill_regimes(axes: Axes, dataset: xr.Dataset, x: str, y: str, edges: tuple[Array, Array]) -> None:
    """Color the cells of a picture by regime, with a legend of the regimes in it."""
    variable = dataset["regime"].transpose(y, x)
    colors = ListedColormap(list(COLORS))
    norm = BoundaryNorm(np.arange(len(COLORS) + 1) - 0.5, len(COLORS))
    axes.pcolormesh(*edges, variable.values, cmap=colors, norm=norm, rasterized=True)
    names = [word.replace("_", " ") for word in str(variable.attrs["flag_meanings"]).split()]
    there = np.unique(variable.values)
    patches: list[Any] = [Patch(facecolor=COLORS[n], edgecolor="gray", label=names[n]) for n in there]
    drawn = {EDGES[kind] for kind in np.unique(dataset["edge_kind"].values).tolist()}
    patches += [Line2D([], [], color="black", linestyle=LINES[style], label=word) for word, style in sorted(drawn)]
    axes.legend(
        handles=patches, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, frameon=False, fontsize="small"
    )


def draw_edges(axes: Axes, dataset: xr.Dataset, x: str, y: str) -> None:
    """Draw the boundaries of a regime map as lines through the points that were solved, on each row."""
    along = str(dataset["regime"].dims[0])
    scales = [reader_unit(dataset[name])[0] for name in map(str, dataset["regime"].dims)]
    for one in boundary_lines(dataset):
        pair = one.along / scales[0], one.rows / scales[1]
        marker = "." if len(one.along) == 1 else ""
        axes.plot(
            *(pair if along == x else pair[::-1]), color="black", linestyle=one.style, linewidth=1.4, marker=marker
        )
