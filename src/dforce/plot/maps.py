"""A quantity over two parameters, as colors with lines of equal value."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, TwoSlopeNorm
from matplotlib.figure import FigureBase
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.ticker import MaxNLocator

from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, checked, nearest
from dforce.plot._style import LIGHT, axis_text, head, new_figure, shown, take
from dforce.plot.distances import RESONANCE
from dforce.plot.regimes import draw_edges, fill_regimes, is_regime_map
from dforce.results.curves import first_state
from dforce.results.dataset import COLUMN_DIMS, reader_unit
from dforce.results.significance import is_none

LINES = 7  # of equal value, about
ONE_SIDED, TWO_SIDED = "viridis", "RdBu_r"
EVEN = 1e-6  # of a step: values of a range are as even as this


@checked
def map(
    dataset: xr.Dataset,
    x: str,
    y: str,
    quantity: str,
    levels: Sequence[float] | None = None,
    figure: FigureBase | None = None,
) -> Axes:
    """Draw a quantity over two parameters: colors, with lines of equal value on top.

    An axis with equal factors between its values is logarithmic. A phase lag has its neutral color at 90°, a quantity of both
    signs at 0. An amount below its estimated error is drawn as 0. The first of several tones, modes, harmonics or states is
    drawn; points without a result are gray. The lines interpolate linearly between the values, also across jumps. The
    quantity `regime` of a regime map (:func:`dforce.regimes`) has a color for each regime, with its boundaries.

    Parameters
    ----------
    dataset
        A sweep over exactly these two parameters; of further parameters choose a value with ``.isel`` or ``.sel``.
    x, y
        Names of the parameters, such as ``"A0"``; the distance `zc` of curves may be one of them.
    quantity
        Name of the quantity.
    levels
        Values of the lines in SI (phases in degrees); default: some round values.
    figure
        See :mod:`dforce.plot`.

    Raises
    ------
    ParameterError
        When the result lacks these names, the parameters are not numbers of a grid, or the quantity has other dimensions.
    """
    sides = [_side(dataset, name) for name in (x, y)]
    if quantity == "regime" and is_regime_map(dataset):
        return _regimes(dataset, x, y, sides, figure)
    if x == y:
        raise ParameterError(f"x and y are both '{x}'; a map is over two parameters")
    first = first_state(dataset)
    variable = take(first, quantity, x, y)
    for name in (x, y):
        if name not in variable.dims:
            raise ParameterError(f"'{quantity}' does not vary along '{name}', so it has no map over it")
    variable = variable.where(~is_none(first, quantity), 0.0)  # an amount below its error is none
    variable = variable.isel(dict.fromkeys((dim for dim in variable.dims if dim in COLUMN_DIMS), 0)).transpose(y, x)
    values, text = shown(variable)
    scale, _ = reader_unit(variable)
    axes = new_figure(figure, 6.4, 4.8).subplots()
    axes.set_facecolor(LIGHT)
    colors, norm = _colors(values, variable)
    (at_x, x_text), (at_y, y_text) = sides
    mesh = axes.pcolormesh(edges_of(at_x), edges_of(at_y), values, cmap=colors, norm=norm, rasterized=True)
    _lines(axes, at_x, at_y, values, None if levels is None else [level / scale for level in levels])
    for name, at in (("x", at_x), ("y", at_y)):
        if is_log(at):
            getattr(axes, f"set_{name}scale")("log")
    axes.set(xlabel=x_text, ylabel=y_text)
    axes.figure.colorbar(mesh, ax=axes, label=text)
    if is_regime_map(dataset) and {x, y} == set(dataset["regime"].dims):
        draw_edges(axes, dataset, x, y)
    head(axes, dataset)
    return axes


def regimes(dataset: xr.Dataset, figure: FigureBase | None = None) -> Axes:
    """Draw a map of regimes over its two parameters."""
    x, y = (str(name) for name in dataset["regime"].dims if name != "state")
    return map(dataset, x, y, "regime", figure=figure)


def _regimes(dataset: xr.Dataset, x: str, y: str, sides: list[tuple[Array, str]], figure: FigureBase | None) -> Axes:
    """Draw the regimes of a map, and the boundaries that were solved."""
    if {x, y} != set(dataset["regime"].dims):
        raise ParameterError(
            f"the regimes lie along {' and '.join(str(dim) for dim in dataset['regime'].dims)}; draw them over these"
        )
    axes = new_figure(figure, 6.4, 5.4).subplots()
    (at_x, x_text), (at_y, y_text) = sides
    fill_regimes(axes, dataset, x, y, (edges_of(at_x), edges_of(at_y)))
    draw_edges(axes, dataset, x, y)
    for name, at in (("x", at_x), ("y", at_y)):
        if is_log(at):
            getattr(axes, f"set_{name}scale")("log")
    axes.set(xlabel=x_text, ylabel=y_text, xlim=(at_x.min(), at_x.max()), ylim=(at_y.min(), at_y.max()))
    head(axes, dataset)
    return axes


def _side(dataset: xr.Dataset, name: str) -> tuple[Array, str]:
    """Return the values of a parameter as they are shown, and the text of its axis."""
    if name not in dataset.coords:
        raise ParameterError(
            f"this result has no parameter '{name}'{nearest(name, (str(key) for key in dataset.coords))}"
        )
    axis = dataset[name]
    if axis.dims != (name,) or axis.dtype.kind not in "fi" or axis.size < 2:
        raise ParameterError(f"'{name}' is not a parameter with a grid of two or more numbers, so it has no map")
    scale, unit = reader_unit(axis)
    name = str(axis.attrs.get("long_name", name)).partition(";")[0]  # without the explanation behind it
    return np.asarray(axis.values, dtype=float) / scale, axis_text(axis.assign_attrs(long_name=name), unit)


def is_log(at: Array) -> bool:
    """Return whether values have equal factors, and not equal steps as well."""
    steps = np.diff(at)
    if len(at) < 3 or not (at > 0.0).all() or np.ptp(steps) <= EVEN * np.abs(steps).max():
        return False
    factors = np.diff(np.log(at))
    return bool(np.ptp(factors) <= EVEN * np.abs(factors).max())


def edges_of(at: Array) -> Array:
    """Return the borders of cells around values: halfway between them, on the scale of their axis."""
    on_scale = np.log(at) if is_log(at) else at
    middle = 0.5 * (on_scale[1:] + on_scale[:-1])
    first, last = 2.0 * on_scale[0] - middle[0], 2.0 * on_scale[-1] - middle[-1]
    edges = np.concatenate([[first], middle, [last]])
    return np.asarray(np.exp(edges) if is_log(at) else edges)


def _colors(values: Array, variable: xr.DataArray) -> tuple[str, Normalize]:
    """Return the colors of a quantity, and how its values become colors."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    is_phase = str(variable.name) in ("phase", "mode_phase")
    middle = RESONANCE if is_phase else 0.0
    if is_phase or low < 0.0 < high:
        reach = max(high - middle, middle - low, math.ulp(1.0))
        return TWO_SIDED, TwoSlopeNorm(middle, middle - reach, middle + reach)
    return ONE_SIDED, Normalize(low, high if high > low else low + 1.0)


def _lines(axes: Axes, x: Array, y: Array, values: Array, levels: Any) -> None:
    """Draw lines of equal value, where there are any."""
    finite = values[np.isfinite(values)]
    if not finite.size or finite.min() == finite.max():
        return
    chosen = MaxNLocator(LINES).tick_values(finite.min(), finite.max()) if levels is None else sorted(levels)
    chosen = [level for level in chosen if finite.min() < level < finite.max()]
    if chosen:
        lines = axes.contour(x, y, np.ma.masked_invalid(values), levels=chosen, colors="black", linewidths=0.8)
        halo: list[AbstractPathEffect] = [
            withStroke(linewidth=2.4, foreground="white")
        ]  # seen on dark and light colors
        lines.set_path_effects(halo)
        for label in axes.clabel(lines, fontsize="small", fmt="%g"):
            label.set_path_effects(halo)
