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

# a color for each regime, in the order of their numbers: red attracts, blue repels, as in maps of the phase
COLORS = ("#ffffff", "#fbe3d4", "#f0a582", "#d9cfe3", "#84b8d9")
# boundaries that are drawn alike: what they are called, and their line
EDGES = {
    "fold": ("a state ends", "solid"),
    "end": ("a state ends", "solid"),
    "instability": ("a state ends", "solid"),
    "lost": ("a line was lost", "dashdot"),
    "net force": ("net force is zero", "dashed"),
    "contact": ("the tip just touches", "dotted"),
}
LINES: dict[str, Any] = {name: name for name in ("solid", "dashed", "dotted", "dashdot")}
FARTHEST = 0.3  # of the picture's width: boundary points of neighboring rows farther apart are not joined


def is_regime_map(dataset: xr.Dataset) -> bool:
    """Say whether a result holds regimes with their boundaries."""
    return "edge_kind" in dataset and "map_over" in dataset.attrs


def fill_regimes(axes: Axes, dataset: xr.Dataset, x: str, y: str, edges: tuple[Array, Array]) -> None:
    """Color the cells of a picture by regime, with a legend of those that there are."""
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
    along, row = map(str, dataset["regime"].dims)  # lines go along the first, a row each
    values, rows = (dataset[f"edge_{name}"].values / reader_unit(dataset[name])[0] for name in (along, row))
    kinds = dataset["edge_kind"].values.astype(str)
    width = float(np.ptp(dataset[along].values)) / reader_unit(dataset[along])[0]
    for word, style in sorted(set(EDGES.values())):
        which = np.array([EDGES[kind] == (word, style) for kind in kinds], dtype=bool)
        for chain in _chains(values[which], rows[which], FARTHEST * width):
            pair = (chain[:, 0], chain[:, 1]) if along == x else (chain[:, 1], chain[:, 0])
            marker = "." if len(chain) == 1 else ""
            axes.plot(*pair, color="black", linestyle=style, linewidth=1.4, marker=marker)


def _chains(values: Array, rows: Array, farthest: float) -> list[Array]:
    """Return points of boundaries joined from row to row, each to the nearest on the next one."""
    chains: list[list[tuple[float, float]]] = []
    growing: list[list[tuple[float, float]]] = []
    for row in np.unique(rows):
        free = sorted(values[rows == row].tolist())
        taken: list[list[tuple[float, float]]] = []
        pairs = sorted((abs(chain[-1][0] - value), i, value) for i, chain in enumerate(growing) for value in free)
        used: set[int] = set()
        for distance, i, value in pairs:
            if distance < farthest and i not in used and value in free:
                growing[i].append((value, float(row)))
                taken.append(growing[i])
                used.add(i)
                free.remove(value)
        for value in free:
            chains.append([(value, float(row))])
            taken.append(chains[-1])
        growing = taken
    return [np.array(chain) for chain in chains]
