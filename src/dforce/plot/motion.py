"""Pictures of the motion at one distance: traces over time, spectrum, phase portrait."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.ticker import MaxNLocator

from dforce.core import units
from dforce.core.errors import ParameterError, checked
from dforce.plot._style import (
    BLUE,
    GRAY,
    LIGHT,
    VERMILLION,
    color_cycle,
    colored_axes,
    head,
    new_figure,
    shown,
    take,
    thin,
    tidy,
    with_numbers,
)

DYNAMIC_RANGE = 1e-7  # of a spectrum: below it, relative to the largest line, there is rounding only
STRONG = 1e-3  # of the largest line: a line that no picture may leave out
MOST_LABELS = 12  # harmonics with a number each; more would overlap


@checked
def traces(
    dataset: xr.Dataset,
    names: str | Sequence[str] = ("deflection", "velocity", "force"),
    periods: float | None = 3,
    figure: FigureBase | None = None,
) -> list[Axes]:
    """Draw quantities over time in one picture, each with a scale in its color.

    Contact is shaded, except in a picture of the whole record.

    Parameters
    ----------
    dataset
        Result of a dwell.
    names
        One name or several. The modes of a quantity are drawn on one scale.
    periods
        Number of the last periods to show; None for the whole record.

    Raises
    ------
    ParameterError
        For a quantity that the result lacks or that does not depend on time.
    """
    chosen = [names] if isinstance(names, str) else list(names)
    if not chosen:
        raise ParameterError("nothing to draw; name a quantity")
    variables = [take(dataset, name, "time") for name in chosen]
    for variable in variables:
        if "time" not in variable.dims:
            raise ParameterError(f"'{variable.name}' is not a trace; it has no values over time")
    time = take(dataset, "time", "time")
    if periods is not None:
        start = float(time[-1]) - periods / main_frequency(dataset)
        recent = (time >= start).values
        variables = [variable.isel(time=recent) for variable in variables]
        time = time.isel(time=recent)
    figure = new_figure(figure, 7.0 + 0.8 * max(len(chosen) - 2, 0), 3.8)
    host = figure.subplots()
    x, text = shown(time)
    every = colored_axes(host, len(chosen))
    for axes, variable, color in zip(every, variables, color_cycle(len(chosen)), strict=True):
        values, label = shown(variable.transpose(..., "time"))
        for number, row in enumerate(np.atleast_2d(values)):
            line = ("-", "--", ":", "-.")[number % 4]
            axes.plot(*thin(x, row), color=color, linewidth=1.2, linestyle=line, label=f"mode {number + 1}")
        axes.set_ylabel(label)
        axes.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 2, 2.5, 5, 10]))
        axes.margins(x=0.0, y=0.08)
        if values.ndim > 1 and len(values) > 1:
            axes.legend(fontsize="small", loc="upper right")
    host.set_xlabel(text)
    if "indentation" in dataset and periods is not None:
        touching = dataset["indentation"].sel(time=time).values > 0.0
        host.fill_between(
            x,
            0.0,
            1.0,
            where=touching.tolist(),
            transform=host.get_xaxis_transform(),
            color=LIGHT,
            linewidth=0.0,
            zorder=0,
        )
    head(host, dataset, at_distance(dataset))
    return every


def main_frequency(dataset: xr.Dataset) -> float:
    """Return the frequency (Hz) of the largest part of the motion."""
    if "spectrum" in dataset:
        return float(dataset["frequency"][1 + int(np.argmax(dataset["spectrum"].values[1:]))])  # not the mean
    deflection = take(dataset, "deflection", "time").values
    time = dataset["time"].values
    lines = np.abs(np.fft.rfft(deflection - deflection.mean()))
    return float(max(np.argmax(lines), 1) / (len(time) * (time[1] - time[0])))


def at_distance(dataset: xr.Dataset) -> str:
    """Return the words for the average distance of a dwell."""
    return (
        f"zc = {units.show(float(dataset['zc']), 'm', 4)}" if dataset.get("zc", xr.DataArray([0, 0])).ndim == 0 else ""
    )


@checked
def spectrum(
    dataset: xr.Dataset, decibel: bool = False, up_to: float | None = None, figure: FigureBase | None = None
) -> Axes:
    """Draw the amplitude spectrum of the deflection on a logarithmic scale, with the harmonics marked.

    Parameters
    ----------
    dataset
        Result of a dwell.
    decibel
        Whether to show dB relative to the largest line, instead of amplitudes.
    up_to
        Highest frequency (Hz); default: at least ten harmonics, and every line above 0.1 % of the largest.

    Raises
    ------
    ParameterError
        When the result has no spectrum, or `up_to` lies below the frequency of the motion.
    """
    line = with_numbers(take(dataset, "spectrum", "frequency"))
    figure = new_figure(figure, 6.5, 3.8)
    axes = figure.subplots()
    frequency, amplitude = dataset["frequency"].values, line.values
    largest = float(np.nanmax(amplitude)) or 1.0
    first = main_frequency(dataset)
    if up_to is None:
        up_to = max(10.5 * first, 1.3 * float(frequency[amplitude > STRONG * largest].max(initial=0.0)))
    if not up_to >= first:
        raise ParameterError(
            f"up_to = {up_to:g} Hz is below the spectrum; the motion is at {units.show(first, 'Hz', 4)}"
        )
    seen = frequency <= up_to
    across, text = shown(dataset["frequency"].isel(frequency=seen))
    scale = frequency[seen][-1] / across[-1]
    y, label = shown(line)
    y = np.maximum(y, DYNAMIC_RANGE * (y.max() or 1.0))
    if decibel:
        y, label = 20.0 * np.log10(y / y.max()), "amplitude (dB of the largest line)"
    else:
        axes.set_yscale("log")
    axes.plot(across, y[seen], color=BLUE, linewidth=0.9)
    multiples = np.arange(1, int(frequency[seen][-1] / first + 1e-6) + 1)
    places = [int(np.argmin(np.abs(frequency - multiple * first))) for multiple in multiples]
    # the flank of a stronger line is no harmonic
    marked = [
        (int(multiple), y[k])
        for multiple, k in zip(multiples, places, strict=True)
        if y[k] > y.min() and y[k] >= y[max(k - 2, 0) : k + 3].max()
    ]
    for multiple, height in marked:
        axes.plot(multiple * first / scale, height, "o", color=VERMILLION, markersize=3.5)
        if multiple <= MOST_LABELS or multiple % 10 == 0:
            axes.annotate(
                f"{multiple}",
                (multiple * first / scale, height),
                (0, 4),
                textcoords="offset points",
                ha="center",
                va="bottom",
                color=GRAY,
                fontsize="x-small",
            )
    lowest = min(height for _, height in [*marked, (0, -80.0 if decibel else 1e-4 * float(y.max()))])
    if decibel:
        axes.set_ylim(max(lowest - 25.0, float(y.min())), 12.0)
    else:
        axes.set_ylim(max(lowest / 20.0, float(y.min())), 6.0 * float(y.max()))
    axes.set_xlim(0.0, across[-1])
    axes.set_xlabel(text)
    axes.set_ylabel(label)
    tidy(axes)
    head(axes, dataset, at_distance(dataset))
    return axes


@checked
def phase_portrait(dataset: xr.Dataset, figure: FigureBase | None = None) -> Axes:
    """Draw velocity against deflection: a closed orbit for a settled motion.

    Raises
    ------
    ParameterError
        When the result has no traces.
    """
    figure = new_figure(figure, 4.6, 4.2)
    axes = figure.subplots()
    x, across = shown(take(dataset, "deflection", "time"))
    y, up = shown(take(dataset, "velocity", "time"))
    axes.plot(x, y, color=BLUE, linewidth=0.9)
    axes.axhline(0.0, color=GRAY, linewidth=0.6)
    axes.axvline(0.0, color=GRAY, linewidth=0.6)
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    tidy(axes)
    head(axes, dataset, at_distance(dataset))
    return axes
