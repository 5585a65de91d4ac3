"""The picture that says most about a result, chosen by its kind."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.errors import ParameterError, checked
from dforce.plot._states import check_under
from dforce.plot._style import head, new_figure
from dforce.plot.basins import basins
from dforce.plot.branches import branches_overview, resonance
from dforce.plot.distances import amplitude_phase, curves
from dforce.plot.fits import fit
from dforce.plot.forces import force_curve, force_distance
from dforce.plot.maps import map
from dforce.plot.measured import measured
from dforce.plot.motion import at_distance, main_frequency, phase_portrait, spectrum, traces
from dforce.plot.plans import plan
from dforce.plot.reconstruction import reconstruction
from dforce.plot.sweeps import sweep_overview
from dforce.plot.thermal import thermal_spectrum
from dforce.results.curves import swept
from dforce.results.kinds import kind_of
from dforce.results.status import check_computed

LONG_RECORD = 20  # periods beyond which the whole record is shown: the transient was asked for
FORCES = ("peak_force", "min_force")
ENERGIES = ("total_dissipated_energy", "virial")


@checked
def overview(dataset: xr.Dataset, figure: FigureBase | None = None, states: xr.Dataset | None = None) -> list[Axes]:
    """Draw a whole result and return all its axes.

    An approach gives amplitude and phase of every tone, the forces and the energies against distance; a dwell
    gives traces, spectrum, force against distance and phase portrait; a prescribed motion gives distance and force over
    time; branches give amplitude, phase, forces and energy of all states; a frequency sweep gives the resonance curve; a
    thermal spectrum, basins and a force curve give themselves; a fit gives data, model and residuals; measured curves,
    reconstructed forces, plans and regime maps give their own pictures. A sweep gives some of its cases, laid over each
    other.

    Under an approach, `states`, a result of :func:`dforce.branches` of the same case, are drawn as thin black lines, the
    unstable ones dashed.

    Raises
    ------
    ParameterError
        For a dataset that is none of these, and for `states` under another result than an approach, of another case or
        along another parameter.
    """
    if states is not None:
        check_under(states, dataset)
    if kind := kind_of(dataset):
        return _of_kind(dataset, kind, figure)
    if swept(dataset):
        return sweep_overview(dataset, figure)
    if "time" in dataset.dims and "zc" not in dataset.coords:  # of a motion that was prescribed
        return traces(dataset, ("distance", "force"), None, figure)
    if "time" in dataset.dims:
        return _dwell(dataset, figure)
    if "distance" in dataset.dims and "force" in dataset:
        return [force_curve(dataset, figure)]
    if "zc" in dataset.dims and "amplitude" in dataset:
        return _approach(dataset, figure, states)
    if "reached" in dataset:
        return [basins(dataset, figure=figure)]
    if "point" in dataset.dims and "amplitude" in dataset:
        return branches_overview(dataset, figure)
    if "frequency" in dataset.dims and "amplitude" in dataset:
        return resonance(dataset, figure=figure)
    check_computed(dataset)
    raise ParameterError("this dataset is the result of no experiment, nor a force curve; there is no overview of it")


def _of_kind(dataset: xr.Dataset, kind: str, figure: FigureBase | None) -> list[Axes]:
    """Draw a result of a kind of its own."""
    if kind == "fit":
        return fit(dataset, figure)
    if kind == "measured":
        return list(measured(dataset, figure))
    if kind == "reconstruction":
        return [reconstruction(dataset, figure)]
    if kind == "plan":
        return [plan(dataset, figure)]
    if kind == "thermal_spectrum":
        return [thermal_spectrum(dataset, figure)]
    if kind == "regimes":
        x, y = (str(name) for name in dataset["regime"].dims if name != "state")
        return [map(dataset, x, y, "regime", figure=figure)]
    raise ParameterError(f"there is no picture of this result ({kind.replace('_', ' ')}); df.summary gives its numbers")


def _approach(dataset: xr.Dataset, figure: FigureBase | None, states: xr.Dataset | None) -> list[Axes]:
    tones = [int(tone) for tone in dataset["tone"].values]
    figure = new_figure(figure, 4.4 * (len(tones) + 1), 6.0)
    columns = figure.subfigures(1, len(tones) + 1, squeeze=False)[0]
    axes: list[Axes] = []
    for tone, column in zip(tones, columns, strict=False):
        axes += amplitude_phase(dataset, tone, column, states)
        axes[-2].set_title(f"tone {tone}" if len(tones) > 1 else "", fontsize="medium")
    upper, lower = columns[-1].subplots(2, 1, sharex=True)
    for host, names in ((upper, FORCES), (lower, ENERGIES)):
        axes += curves(host, [dataset[name] for name in names if name in dataset], dataset, states, states_named=False)
    upper.set_xlabel("")
    head(figure, dataset)
    return axes


def _dwell(dataset: xr.Dataset, figure: FigureBase | None) -> list[Axes]:
    figure = new_figure(figure, 11.0, 7.0)
    upper, lower = figure.subfigures(2, 1, squeeze=False)[:, 0]
    length = float(dataset["time"][-1] - dataset["time"][0]) * main_frequency(dataset)
    axes = traces(dataset, periods=None if length > LONG_RECORD else 3, figure=upper)
    left, middle, right = lower.subfigures(1, 3, squeeze=False)[0]
    axes += [spectrum(dataset, figure=left), force_distance(dataset, middle), phase_portrait(dataset, right)]
    for one in axes:
        one.set_title("")
    head(figure, dataset, at_distance(dataset))
    return axes
