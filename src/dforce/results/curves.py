"""The lines of a result that can be drawn, for pictures on paper and in the window alike."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dforce.core.arrays import AnyArray, Array, Indices
from dforce.core.errors import ParameterError, checked, nearest, shorten
from dforce.results.dataset import COLUMN_DIMS
from dforce.results.kinds import LISTS, Picture, kind_of, swept
from dforce.results.status import check_computed

if TYPE_CHECKING:
    import xarray as xr


__all__ = [
    "BELOW",
    "Line",
    "Picture",
    "by_case",
    "drawable",
    "first_state",
    "goes_along",
    "lines_of",
    "pictures_of",
    "row_of",
    "start_across",
]

BELOW = 30.0  # how far below the strongest resonance a logarithmic picture of a density begins: white noise alone
NO_ROWS = frozenset({*COLUMN_DIMS, "direction"})
MARKED = ("fold", "period_doubling", "torus", "grazing", "end")  # special points that pictures mark


@dataclass(frozen=True)
class Line:
    """One line of a picture.

    Attributes
    ----------
    x, y
        Values in SI; NaN where the line has a gap.
    name
        Its name among the lines of its quantity, such as ``"retract, tone 2"``; may be empty.
    direction
        "approach", "retract", "up", "down" or nothing.
    column
        Number of its tone, mode or harmonic, counted from 0.
    stable
        Whether its points are states that an experiment can show.
    row
        Dimension along which its points lie.
    places
        Place of each point along `row`; -1 in gaps.
    chosen
        Indices along other dimensions, such as the direction.
    marks
        Special points by place in the line, such as a fold.
    """

    x: Array
    y: Array
    name: str
    direction: str
    column: int
    stable: bool
    row: str
    places: Indices
    chosen: Mapping[str, int]
    marks: Mapping[int, str]


@checked
def drawable(dataset: xr.Dataset, along: str | None = None) -> list[str]:
    """Return the names of the quantities that can be drawn, the parameters of the curve first.

    Parameters
    ----------
    dataset
        A result.
    along
        Only quantities that can be drawn against this one.
    """
    variables = dataset.variables
    rows = {str(name): _row_of(variables[name]) for name in (*dataset.coords, *dataset.data_vars)}
    wanted = rows.get(along) if along is not None else None
    return [name for name, row in rows.items() if row and (along is None or row == wanted)]


def _variable(dataset: xr.Dataset, name: str) -> xr.Variable:
    if name not in dataset.variables:
        check_computed(dataset)
        raise ParameterError(
            f"this result has no '{shorten(name)}'{nearest(name, map(str, dataset.variables), 'printing the result')}"
        )
    return dataset.variables[name]


@checked
def row_of(dataset: xr.Dataset, name: str) -> str:
    """Return the dimension along which a quantity makes a line; empty where it makes none.

    Raises
    ------
    ParameterError
        When the result has no such quantity.
    """
    return _row_of(_variable(dataset, name))


def _row_of(variable: xr.Variable) -> str:
    rows = [str(dim) for dim in variable.dims if dim not in NO_ROWS]
    return rows[0] if variable.dtype.kind == "f" and len(rows) == 1 and rows[0] not in LISTS else ""


def by_case(dataset: xr.Dataset, name: str, row: str, over: Sequence[str]) -> AnyArray:
    """Return a quantity of a sweep over parameters `over` as (cases, directions, points of a row, columns ...).

    Any other result is one case, and a result without directions has one; a quantity without such dimensions is repeated.
    """
    dims = [*over, *(dim for dim in ("direction",) if dim in dataset.dims), row]
    variable = dataset.variables[name]
    values = variable.transpose(*(dim for dim in dims if dim in variable.dims), ...).values
    values = values[tuple(slice(None) if dim in variable.dims else None for dim in dims)]
    columns = values.shape[len(dims) :]
    values = np.broadcast_to(values, (*(dataset.sizes[dim] for dim in dims), *columns))
    cases = math.prod(dataset.sizes[dim] for dim in over)  # computed, because a result may have no columns
    return values.reshape(cases, dataset.sizes.get("direction", 1), dataset.sizes[row], *columns)


def first_state(dataset: xr.Dataset) -> xr.Dataset:
    """Return a sweep with the first of the states at a set point, or of basins, alone; any other result as it is."""
    several = next((dim for dim in ("crossing", "state") if dim in dataset.dims and swept(dataset)), None)
    return dataset.isel({several: 0}) if several is not None else dataset


@checked
def goes_along(dataset: xr.Dataset) -> str:
    """Return the quantity that a curve goes along: the distance, the frequency or the parameter of branches; or time."""
    if "along" in dataset.attrs:
        return str(dataset.attrs["along"])
    return next((name for name in ("time", "zc", "frequency") if name in dataset.dims), "")


@checked
def pictures_of(dataset: xr.Dataset) -> list[Picture]:
    """Return the pictures that suit a result, the most useful first; none for a map, which is a picture itself."""
    kind, along, known = kind_of(dataset), goes_along(dataset), set(drawable(dataset))
    named = [dataclasses.replace(one, x=one.x or along) for one in (kind.pictures if kind is not None else ())]
    return [picture for picture in named if {picture.x, *picture.y} <= known]


@checked
def lines_of(dataset: xr.Dataset, x: str, y: str) -> Iterator[Line]:
    """Give the lines of a quantity: one for each direction and tone (mode, harmonic), stable and unstable states apart.

    Raises
    ------
    ParameterError
        For names that the result lacks, and for quantities that do not go along the same dimension.
    """
    for name in (x, y):
        if name not in dataset.variables or not row_of(dataset, name):
            raise ParameterError(
                f"this result has no '{name}' to draw{nearest(name, drawable(dataset), 'printing the result')}"
            )
    row = row_of(dataset, y)
    if row_of(dataset, x) != row:
        raise ParameterError(f"'{y}' cannot be drawn against '{x}': its values lie along {row}")
    variables = dataset.variables
    columns = [str(dim) for dim in variables[y].dims if dim in COLUMN_DIMS]
    directions = list(dataset["direction"].values) if "direction" in dataset.dims else []
    several = "direction" in {*variables[x].dims, *variables[y].dims}
    for index in np.ndindex(*(dataset.sizes[dim] for dim in columns)):
        words = [
            f"{dim} {dataset[dim].values[n]}" for dim, n in zip(columns, index, strict=True) if dataset.sizes[dim] > 1
        ]
        for number, direction in enumerate(directions if several else [""]):
            chosen = {"direction": number} if several else {}
            picked = dict(zip(columns, index, strict=True))
            values = [_values(variables[name], row, chosen, picked) for name in (x, y)]
            name = ", ".join([str(direction)] * bool(direction) + words)
            yield from _parts(dataset, row, values[0], values[1], name, str(direction), sum(index), chosen)


def _values(variable: xr.Variable, row: str, chosen: Mapping[str, int], picked: Mapping[str, int]) -> Array:
    """Return the values of a variable along a row; of columns that the other quantity lacks the first."""
    places = {**chosen, **picked}
    index = tuple(slice(None) if dim == row else places.get(str(dim), 0) for dim in variable.dims)
    return np.asarray(variable.values[index], dtype=float)


def _parts(
    dataset: xr.Dataset, row: str, x: Array, y: Array, name: str, direction: str, column: int, chosen: Mapping[str, int]
) -> Iterator[Line]:
    """Give a line as it is, or its stable and unstable parts with gaps between its pieces."""
    places = np.arange(len(x))
    if row != "point" or "stable" not in dataset:
        yield Line(x, y, name, direction, column, True, row, places, chosen, {})
        return
    stable, branch = dataset["stable"].values.astype(bool), dataset["branch"].values
    special = dataset["special"].values.astype(str)
    same = branch[1:] == branch[:-1]
    breaks = np.flatnonzero(~same) + 1
    for wanted, word in ((stable, "stable"), (~stable, "unstable")):
        if not wanted.any():
            continue
        kept = wanted.copy()
        kept[1:] |= wanted[:-1] & same  # each piece reaches the next point of the curve
        xs, ys = (np.insert(np.where(kept, values, np.nan), breaks, np.nan) for values in (x, y))
        at = np.insert(np.where(kept, places, -1), breaks, -1)
        marks = {i: special[p] for i, p in enumerate(at) if p >= 0 and wanted[p] and special[p] in MARKED}
        yield Line(
            xs,
            ys,
            ", ".join([*([name] if name else []), word]),
            direction,
            column,
            word == "stable",
            row,
            at,
            chosen,
            marks,
        )


def start_across(lines: Iterable[Line]) -> float:
    """Return where a logarithmic picture of densities begins: so far below the highest peak that nothing but noise is left."""
    tops = [line for line in lines if np.isfinite(line.y).any()]
    highest = max(tops, key=lambda line: float(np.nanmax(line.y)))
    return float(highest.x[np.nanargmax(highest.y)]) / BELOW
