"""The boundaries of a map of regimes as lines, each joined from row to row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from dforce.core.arrays import Array

# boundaries that are drawn alike: their name, and their line
EDGES = {
    "fold": ("a state ends", "solid"),
    "end": ("a state ends", "solid"),
    "instability": ("a state ends", "solid"),
    "grazing": ("a state ends", "solid"),
    "lost": ("a line was lost", "dashdot"),
    "net force": ("net force is zero", "dashed"),
    "contact": ("the tip just touches", "dotted"),
}
FARTHEST = 0.3  # of the range: boundary points of neighboring rows farther apart are not joined


@dataclass(frozen=True)
class BoundaryLine:
    """A boundary: its name, its style ("solid", "dashed", "dotted", "dashdot"), and its points (SI) along and across rows."""

    name: str
    style: str
    along: Array
    rows: Array


def boundary_lines(regimes: xr.Dataset) -> Iterator[BoundaryLine]:
    """Give the boundaries of a result of :func:`dforce.regimes`; `rows` are values of its second parameter."""
    along, row = map(str, regimes["regime"].dims)  # lines go along the first, a row each
    values, rows = (regimes[f"edge_{name}"].values for name in (along, row))
    kinds = regimes["edge_kind"].values.astype(str)
    width = float(np.ptp(regimes[along].values))
    for name, style in sorted(set(EDGES.values())):
        which = np.array([EDGES[kind] == (name, style) for kind in kinds], dtype=bool)
        for chain in _chains(values[which], rows[which], FARTHEST * width):
            yield BoundaryLine(name, style, chain[:, 0], chain[:, 1])


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
