"""The most useful picture of a result, chosen by its kind."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.errors import ParameterError, checked
from dforce.plot._states import check_under
from dforce.plot._style import head, new_figure
from dforce.plot.distances import amplitude_phase, curves
from dforce.plot.forces import force_curve, force_distance
from dforce.plot.motion import at_distance, main_frequency, phase_portrait, spectrum, traces
from dforce.results.kinds import AMPLITUDE_AND_PHASE, NO_RESULT, known_kind, measured
from dforce.results.status import WITHOUT_RESULT, check_computed, count_status

LONG_RECORD = 20  # periods beyond which the whole record is shown: the transient was asked for
FORCES = ("peak_force", "min_force")
ENERGIES = ("total_dissipated_energy", "virial")


@checked
def overview(dataset: xr.Dataset, figure: FigureBase | None = None, states: xr.Dataset | None = None) -> list[Axes]:
    """Draw a whole result and return all its axes.

    An approach: amplitude and phase of every tone, the forces and the energies against distance. A dwell: traces, spectrum,
    force against distance and phase portrait. A prescribed motion: distance and force over time. Branches: amplitude, phase,
    forces and energies of all states. A frequency sweep: the resonance curve. A fit: data, model and residuals. A sweep: some
    of its cases in one picture. Results of :func:`dforce.material` and :func:`dforce.identify` have no picture; other results
    have one.

    For an approach, `states` may be a result of :func:`dforce.branches` of the same case. All states are then thin black lines
    behind the curves, unstable states dashed.

    Raises
    ------
    ParameterError
        For a dataset without a picture. For `states` with a result that is not an approach, of another case, or along another
        parameter.
    """
    if states is not None:
        check_under(states, dataset)
    return known_kind(dataset).drawn(dataset, figure=figure, **({} if states is None else {"states": states}))


def approach(dataset: xr.Dataset, figure: FigureBase | None = None, states: xr.Dataset | None = None) -> list[Axes]:
    """Draw amplitude and phase of every tone, the forces and the energies against the distance.

    Under a lock the two numbers that it does not hold take the place of amplitude and phase.

    Raises
    ------
    ParameterError
        When the result keeps no amplitude along the distance, or lists states at a set point.
    """
    if "crossing" in dataset.dims:
        raise ParameterError(
            "states at a set point of one curve have no picture; draw the curve, or list them by df.summary"
        )
    if "zc" not in dataset.dims or "amplitude" not in dataset:
        check_computed(dataset)
        raise ParameterError(NO_RESULT)
    tones = [int(tone) for tone in dataset["tone"].values]
    figure = new_figure(figure, 4.4 * (len(tones) + 1), 6.0)
    columns = figure.subfigures(1, len(tones) + 1, squeeze=False)[0]
    axes: list[Axes] = []
    for index, (tone, column) in enumerate(zip(tones, columns, strict=False)):
        if (names := measured(dataset, index)) != AMPLITUDE_AND_PHASE:
            shown = [dataset[name].sel(tone=tone) for name in names]
            for host, one in zip(column.subplots(len(shown), 1, sharex=True), shown, strict=True):
                axes += curves(host, [one], dataset, states, states_named=False)
            continue
        axes += amplitude_phase(dataset, tone, column, states)
        axes[-2].set_title(f"tone {tone}" if len(tones) > 1 else "", fontsize="medium")
    upper, lower = columns[-1].subplots(2, 1, sharex=True)
    for host, names in ((upper, FORCES), (lower, ENERGIES)):
        axes += curves(host, [dataset[name] for name in names if name in dataset], dataset, states, states_named=False)
    upper.set_xlabel("")
    head(figure, dataset)
    return axes


def dwell(dataset: xr.Dataset, figure: FigureBase | None = None) -> list[Axes]:
    """Draw the traces of a motion, its spectrum where it has one, the force against distance and the phase portrait.

    Raises
    ------
    ParameterError
        When the motion was not recorded, or has no result.
    """
    if "time" not in dataset.dims:
        check_computed(dataset)
        for status in count_status(dataset):
            if status in WITHOUT_RESULT:
                raise ParameterError(f"no motion can be drawn: {status.sentence}")
        raise ParameterError(NO_RESULT)
    figure = new_figure(figure, 11.0, 7.0)
    upper, lower = figure.subfigures(2, 1, squeeze=False)[:, 0]
    length = float(dataset["time"][-1] - dataset["time"][0]) * main_frequency(dataset)
    axes = traces(dataset, periods=None if length > LONG_RECORD else 3, figure=upper)
    *first, middle, right = lower.subfigures(1, 3 if "spectrum" in dataset else 2, squeeze=False)[0]
    axes += [spectrum(dataset, figure=left) for left in first]
    axes += [force_distance(dataset, middle), phase_portrait(dataset, right)]
    for one in axes:
        one.set_title("")
    head(figure, dataset, at_distance(dataset))
    return axes


def forces(dataset: xr.Dataset, figure: FigureBase | None = None) -> list[Axes]:
    """Draw the force along a path: against distance, or with the distance over time where a motion was prescribed."""
    if "time" in dataset.dims:
        return traces(dataset, ("distance", "force"), None, figure)
    return [force_curve(dataset, figure)]
