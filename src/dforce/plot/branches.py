"""Pictures of curves of states, and of resonance curves."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from dforce.core.errors import ParameterError, checked
from dforce.plot._states import THIN, UNSTABLE, check_states, draw_states, repeats
from dforce.plot._style import BLUE, GRAY, VERMILLION, axis_text, color_cycle, head, new_figure, take, tidy
from dforce.plot.distances import free_phase, phase_axis
from dforce.results.dataset import reader_unit
from dforce.results.kinds import measured
from dforce.results.status import Status

SWEEPS: dict[str, dict[str, Any]] = {
    "up": {"color": BLUE, "linestyle": "-", "label": "up →"},
    "down": {"color": VERMILLION, "linestyle": (0, (4, 1.5)), "label": "← down"},
}
FORCES = ("peak_force", "min_force")
ENERGIES = ("total_virial", "total_dissipated_energy")


@checked
def branches(dataset: xr.Dataset, tone: int = 1, figure: FigureBase | None = None) -> list[Axes]:
    """Draw amplitude and phase of all states along the parameter, unstable states dashed.

    Under a lock, the two measured quantities take the place of amplitude and phase. Each connected curve has its own color;
    folds, period doublings and grazing points are marked. Thin lines are motions that repeat only after several periods.

    Raises
    ------
    ParameterError
        When the result has no curves of states, or no such tone.
    """
    check_states(dataset)
    figure = new_figure(figure, 6.0, 6.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    for axes, name in zip((upper, lower), measured(dataset), strict=True):
        _states(axes, [_tone(take(dataset, name, "point"), tone)], dataset)
    _finish_pair(upper, lower, dataset, str(dataset.attrs["along"]))
    _legend(upper, dataset)
    return [upper, lower]


@checked
def resonance(dataset: xr.Dataset, tone: int = 1, figure: FigureBase | None = None) -> list[Axes]:
    """Draw amplitude and phase of a tone against the frequency, upward and downward.

    Under a lock, the two measured quantities take the place of amplitude and phase.

    Raises
    ------
    ParameterError
        When the result is not a frequency sweep, or has no such tone.
    """
    if "frequency" not in take(dataset, "amplitude", "frequency", "direction").dims:
        raise ParameterError("this result is not a frequency sweep; use df.frequency_sweep")
    figure = new_figure(figure, 6.0, 6.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    for axes, name in zip((upper, lower), measured(dataset), strict=True):
        _sweeps(axes, _tone(take(dataset, name, "frequency", "direction"), tone), dataset)
    _finish_pair(upper, lower, dataset, "frequency")
    handles, labels = upper.get_legend_handles_labels()
    if handles:
        upper.legend(handles, labels, framealpha=0.85, fontsize="small", loc="best")
    return [upper, lower]


def branches_overview(dataset: xr.Dataset, figure: FigureBase | None = None) -> list[Axes]:
    """Draw amplitude and phase of all states beside their forces and energies."""
    figure = new_figure(figure, 10.0, 6.0)
    left, right = figure.subfigures(1, 2, squeeze=False)[0]
    axes = branches(dataset, figure=left)
    upper, lower = right.subplots(2, 1, sharex=True)
    _states(upper, [take(dataset, name, "point") for name in FORCES], dataset, "largest and lowest force")
    _states(lower, [take(dataset, name, "point") for name in ENERGIES], dataset, "virial, dissipated energy")
    upper.set_xlabel("")
    return [*axes, upper, lower]


def _tone(variable: xr.DataArray, tone: int) -> xr.DataArray:
    if tone not in variable["tone"].values:
        raise ParameterError(f"this result has no tone {tone}; it has {variable.sizes['tone']}, counted from 1")
    return variable.sel(tone=tone, drop=True)


def _states(axes: Axes, variables: list[xr.DataArray], dataset: xr.Dataset, text: str = "") -> None:
    """Draw quantities of one unit along all curves, in pieces that are stable or not."""
    along = dataset[str(dataset.attrs["along"])]
    across, x_unit = reader_unit(along)
    scale, y_unit = reader_unit(max(variables, key=lambda variable: float(np.abs(variable).max())))
    numbers = np.unique(dataset["branch"].values).tolist()
    colors = dict(zip(numbers, color_cycle(len(numbers)), strict=True))
    for variable in variables:
        draw_states(axes, np.asarray(along.values) / across, np.asarray(variable.values) / scale, dataset, colors)
    axes.set_xlabel(axis_text(along, x_unit))
    axes.set_ylabel(f"{text} ({y_unit})" if text else axis_text(variables[0], y_unit))
    tidy(axes)


def _sweeps(axes: Axes, variable: xr.DataArray, dataset: xr.Dataset) -> None:
    across, x_unit = reader_unit(dataset["frequency"])
    scale, y_unit = reader_unit(variable)
    x = np.asarray(dataset["frequency"].values) / across
    order = np.argsort(x, kind="stable")
    ways = [str(way) for way in dataset["direction"].values] if "direction" in dataset.dims else [""]
    for way in ways:
        one = variable.sel(direction=way) if way else variable
        status = dataset["status"].sel(direction=way) if way else dataset["status"]
        y = np.asarray(one.values) / scale
        look = SWEEPS.get(way, SWEEPS["up"] | {"label": ""})
        axes.plot(x[order], y[order], linewidth=1.4, **look)
        restless = (np.asarray(status.values) == Status.NOT_SETTLED) & np.isfinite(y)
        if restless.any():
            ring = {"markerfacecolor": "none", "color": look["color"], "label": "did not settle"}
            axes.plot(x[restless], y[restless], "o", **ring)
    axes.set_xlabel(axis_text(dataset["frequency"], x_unit))
    axes.set_ylabel(axis_text(variable, y_unit))
    tidy(axes)


def _finish_pair(upper: Axes, lower: Axes, dataset: xr.Dataset, along: str) -> None:
    upper.set_xlabel("")
    upper.set_ylim(bottom=min(0.0, upper.get_ylim()[0]))
    if along == "frequency":  # off resonance the phase does not distinguish attraction and repulsion
        lower.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 1.5, 3, 4.5, 9, 10]))
    elif measured(dataset)[1] == "phase":
        phase_axis(lower, free_phase(dataset))
    held = dataset["zc"] if "zc" in dataset.coords and dataset["zc"].ndim == 0 else None
    extra = ""
    if held is not None:
        scale, unit = reader_unit(held)
        extra = f"at zc = {float(held) / scale:.4g} {unit}"
    head(upper, dataset, extra)


def _legend(axes: Axes, dataset: xr.Dataset) -> None:
    stable = dataset["stable"].values
    looks: list[tuple[Any, str, bool]] = [("-", "stable", bool(stable.any())), (UNSTABLE, "unstable", not stable.all())]
    lines = [Line2D([], [], color=GRAY, linestyle=style, label=label) for style, label, there in looks if there]
    lines += [
        Line2D([], [], color=GRAY, linewidth=THIN, label=f"repeats after {periods} periods")
        for periods in np.unique(repeats(dataset))[1:]
    ]
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        [*lines, *handles],
        [*(str(line.get_label()) for line in lines), *labels],
        framealpha=0.85,
        fontsize="small",
        loc="best",
    )
