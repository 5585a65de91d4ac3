"""Regions of a plan's settings in which limits hold: between values of the grid they end at the located boundaries."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr

from dforce.core.arrays import Array, Bools, Texts

FINE = 160  # places along a parameter, at least, of a map that ends at the boundaries
MARGINS = "margin"  # where limits hold, but not within their margins
CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1))  # of a cell of the grid, one after the other
SAME = 1e-9  # relative difference of values that are one line of the grid


def nodes(dataset: xr.Dataset, x: str, y: str) -> tuple[Bools, Bools, Texts]:
    """Return at each setting (y, x) whether a state is allowed, whether its limits hold, and which limit fails else."""
    allowed = np.asarray(dataset["allowed"].transpose(y, x, "state").values.any(axis=-1))
    hit = dataset["limit_hit"].transpose(y, x, "state").values.astype(str)
    holds = np.asarray(((hit == "") | np.char.startswith(hit, "margin")).any(axis=-1))
    return allowed, holds, np.where(holds, "", hit[..., 0])


def everywhere(first: Texts) -> Texts:
    """Return the limit that fails at each place of the grid; where none does, that at the nearest place."""
    bad, out = np.argwhere(first != ""), first.copy()
    for row, column in np.argwhere(first == "") if len(bad) else ():
        near = bad[np.abs(bad - (row, column)).sum(axis=1).argmin()]
        out[row, column] = first[near[0], near[1]]
    return out


def limits_between(dataset: xr.Dataset, x: str, y: str) -> tuple[Array, Array, Texts]:
    """Return which limit fails on a grid so fine that it ends at the located boundaries.

    Parameters
    ----------
    dataset
        A plan, at one place along all dimensions but `x`, `y` and `state`.

    Returns
    -------
    tuple
        Values of `x` and of `y` (SI), the plan's own among them, and words (y, x): empty where all limits hold,
        ``"margin"`` where only a margin fails.
    """
    allowed, holds, first = nodes(dataset, x, y)
    coarse = [np.asarray(dataset[name].values, dtype=float) for name in (x, y)]
    parts = [-(-FINE // max(len(values) - 1, 1)) for values in coarse]
    fine = [
        np.interp(np.arange((len(values) - 1) * n + 1) / n, np.arange(len(values)), values)
        for values, n in zip(coarse, parts, strict=True)
    ]
    near = [np.rint(np.arange(len(one)) / n).astype(int) for one, n in zip(fine, parts, strict=True)]
    words = everywhere(first)[np.ix_(near[1], near[0])].astype("<U80")
    for inside, with_margins, word in ((holds, False, MARGINS), (allowed, True, "")):
        for polygon in region(dataset, x, y, inside, with_margins):
            _fill(words, fine, polygon, word)
    own = np.ix_(np.arange(len(coarse[1])) * parts[1], np.arange(len(coarse[0])) * parts[0])
    words[own] = np.where(allowed, "", np.where(holds, MARGINS, first))
    return fine[0], fine[1], words


def _fill(words: Texts, fine: list[Array], polygon: Array, word: str) -> None:
    """Write a word at the places of a fine grid inside a convex polygon, its edge included."""
    spans = [
        slice(
            np.searchsorted(values, column.min() * (1.0 - SAME)), np.searchsorted(values, column.max() * (1.0 + SAME))
        )
        for values, column in zip(fine, polygon.T, strict=True)
    ]
    x, y = fine[0][spans[0]][None, :], fine[1][spans[1]][:, None]
    size = np.ptp(fine[0]) * np.ptp(fine[1])
    turns = [
        (bx - ax) * (y - ay) - (by - ay) * (x - ax) for (ax, ay), (bx, by) in itertools.pairwise([*polygon, polygon[0]])
    ]
    inside = np.all([turn >= -SAME * size for turn in turns], axis=0)
    words[spans[1], spans[0]] = np.where(inside, word, words[spans[1], spans[0]])


def located(dataset: xr.Dataset, x: str, y: str) -> Array:
    """Return the located boundaries (SI) in the plane of a picture, (edges, 2)."""
    pairs = np.column_stack([dataset[f"edge_{name}"].values for name in (x, y)])
    if "set_point" in (x, y):
        return pairs
    apart = np.abs(dataset["edge_set_point"].values - float(dataset["set_point"]))
    return pairs[apart < SAME]


def region(dataset: xr.Dataset, x: str, y: str, inside: Bools, with_margins: bool) -> list[Array]:
    """Return polygons (SI) of the settings around the places of the grid that are inside.

    Between a place inside and a place outside they end at the boundary on that line of the grid, or before it by the margin.
    Without a located boundary they end at the place inside.
    """
    grid = [np.asarray(dataset[name].values, dtype=float) for name in (x, y)]
    sides = _Sides(dataset, (x, y), grid, located(dataset, x, y), with_margins)
    polygons: list[Array] = []
    for row, column in np.ndindex(len(grid[1]) - 1, len(grid[0]) - 1):
        corners = [(column + right, row + up) for right, up in CORNERS]
        holding = [bool(inside[at[1], at[0]]) for at in corners]
        walk: list[list[Array]] = [[]]
        for n, (a, b) in enumerate(itertools.pairwise([*corners, corners[0]])):
            if holding[n]:
                walk[-1].append(sides.place(a))
            if holding[n] != holding[(n + 1) % 4]:
                walk[-1].append(sides.end(a, b) if holding[n] else sides.end(b, a))
                if holding[n]:
                    walk.append([])  # the region is left here
        if len(walk) > 1 and holding[0]:
            walk[0] = walk.pop() + walk[0]
        polygons += [np.array(shape) for shape in walk if len(shape) > 2]
    return polygons


class _Sides:
    """The lines of the grid, with the boundaries on them."""

    def __init__(
        self, dataset: xr.Dataset, names: tuple[str, str], grid: list[Array], edges: Array, margins: bool
    ) -> None:
        self.grid, self.edges = grid, edges
        asked = str(dataset.attrs.get("limits", "")).split("; ")
        paths = {path.rpartition(".")[2]: path for path in str(dataset.attrs["plan_over"]).split()}
        self.margins = [
            dataset[name].attrs if margins and f"margin {paths.get(name, name)}" in asked else {} for name in names
        ]

    def place(self, at: tuple[int, int]) -> Array:
        """Return a place of the grid."""
        return np.array([self.grid[0][at[0]], self.grid[1][at[1]]])

    def end(self, inside: tuple[int, int], outside: tuple[int, int]) -> Array:
        """Return where the region ends between a place inside and its neighbor outside."""
        here, there = self.place(inside), self.place(outside)
        axis = 0 if inside[0] != outside[0] else 1
        way = np.sign(there[axis] - here[axis])
        on_line = np.abs(self.edges[:, 1 - axis] - here[1 - axis]) <= SAME * abs(here[1 - axis])
        beyond = way * (self.edges[:, axis] - here[axis])
        ahead = self.edges[on_line & (beyond >= 0.0), axis]
        if not len(ahead):
            return here
        nearest = float(ahead[np.abs(ahead - here[axis]).argmin()])
        attrs = self.margins[axis]
        if attrs:
            size = float(attrs["margin"])
            nearest = nearest * float(np.exp(-way * size)) if attrs["margin_is_relative"] else nearest - way * size
        here[axis] = np.clip(nearest, min(here[axis], there[axis]), max(here[axis], there[axis]))
        return here
