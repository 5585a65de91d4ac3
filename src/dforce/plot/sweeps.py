"""Some cases of a sweep, laid over each other."""

from __future__ import annotations

import itertools
import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.errors import ParameterError
from dforce.plot._style import head, new_figure
from dforce.plot.laid_over import lay_over
from dforce.plot.maps import map as map_of_two
from dforce.results.curves import Picture, drawable, first_state, goes_along
from dforce.results.dataset import reader_unit
from dforce.results.kinds import swept
from dforce.results.status import check_computed

MOST = 12  # cases in a picture, so that each has its own color and a line in the legend
FIRST = ("share", "amplitude", "phase", "peak_force", "max_indentation")  # drawn before other quantities
PANELS, MAPS = 3, 2


def sweep_overview(dataset: xr.Dataset, figure: FigureBase | None = None) -> list[Axes]:
    """Draw some cases of a sweep over each other, and return all axes.

    Curves are drawn along their own parameter. Dwells, and the state of basins that most starts lead to, are drawn along the
    parameter with the most values. Of many cases some are drawn. Over one parameter all states at a set point are drawn, over
    two the first states.

    Raises
    ------
    ParameterError
        When the sweep has no quantity that can be drawn.
    """
    at_set_point, along = "crossing" in dataset.dims, usual_along(dataset)
    over = [name for name in swept(dataset) if dataset[name].dtype.kind == "f" and dataset.sizes[name] > 1]
    if at_set_point and len(over) > 1:
        return _maps_at_set_point(dataset, over, figure)
    layers = _states(dataset, along) if at_set_point else cases_of(first_state(dataset), along)
    known = drawable(next(iter(layers.values())), along) if along and layers else []
    left_out = {along, "amplitude"} if at_set_point else {along}  # there the amplitude is fixed
    names = [name for name in dict.fromkeys((*FIRST, *known)) if name in known and name not in left_out][:PANELS]
    if not names:
        check_computed(dataset)
        raise ParameterError("this sweep has no quantity along a distance or a parameter, so it has no overview")
    axes = lay_over(layers, Picture(along, tuple(names)), figure)
    if len(layers) > 1 and not at_set_point:
        total = math.prod(dataset.sizes[name] for name in swept(dataset, along))
        head(axes[0], dataset, f"{len(layers)} of {total} cases" if len(layers) < total else "")
    return axes


def usual_along(dataset: xr.Dataset) -> str:
    """Return the abscissa for the quantities of a result: the parameter of its curves, or the longest axis of a sweep.

    Empty where no such axis has plain numbers.
    """
    numbers = [name for name in swept(dataset) if dataset[name].dtype.kind == "f"]
    own = "" if "crossing" in dataset.dims else goes_along(dataset)  # states at a set point are one each
    return own or max(numbers, key=lambda name: dataset.sizes[name], default="")


def cases_of(dataset: xr.Dataset, along: str) -> dict[str, xr.Dataset]:
    """Return the results of a sweep along one parameter, by the values of its other parameters.

    Of too many to distinguish, some are returned, spread evenly over the sweep.
    """
    over = swept(dataset, along)
    places = list(itertools.product(*(range(dataset.sizes[name]) for name in over)))
    which = np.unique(np.linspace(0, len(places) - 1, min(len(places), MOST)).round().astype(int))
    chosen = [dict(zip(over, places[i], strict=True)) for i in which]
    return {_words(dataset, case): dataset.isel(case) for case in chosen}


def _states(dataset: xr.Dataset, along: str) -> dict[str, xr.Dataset]:
    """Return the states at a set point along a parameter by their numbers, of others at their first values."""
    first = dataset.isel(dict.fromkeys(swept(dataset, along), 0))
    found = [first.isel(crossing=number) for number in range(first.sizes["crossing"])]
    return {f"state {number}": one for number, one in enumerate(found, start=1) if one["zc"].notnull().any()}


def _maps_at_set_point(dataset: xr.Dataset, over: list[str], figure: FigureBase | None) -> list[Axes]:
    """Draw the first states at a set point over the first two of some parameters, of others at their first values."""
    known = [name for name in dict.fromkeys((*FIRST, *map(str, dataset.data_vars))) if name in dataset]
    names = [name for name in known if name != "amplitude"][:MAPS]  # the amplitude is fixed
    first = dataset.isel({name: 0 for name in swept(dataset) if name not in over[:2]})
    parts = new_figure(figure, 6.4, 4.8 * len(names)).subfigures(len(names), 1, squeeze=False).ravel()
    return [map_of_two(first, over[1], over[0], name, figure=part) for name, part in zip(names, parts, strict=True)]


def _words(dataset: xr.Dataset, case: dict[str, int]) -> str:
    """Return the parameters of a case that differ from case to case."""
    words = []
    for name, place in case.items():
        axis = dataset[name]
        scale, unit = reader_unit(axis) if axis.dtype.kind == "f" else (1.0, "1")
        value = f"{axis.values[place] / scale:.4g}" if axis.dtype.kind == "f" else str(axis.values[place])
        words.append(f"{name} = {value}" + (f" {unit}" if unit != "1" else ""))
    return ", ".join(words)
