"""The thermal spectrum of a lever, as a calibration shows it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core import units
from dforce.core.errors import checked
from dforce.plot._style import BLUE, VERMILLION, axis_text, head, new_figure, shown, take, tidy, with_numbers
from dforce.results.curves import BELOW
from dforce.results.dataset import reader_unit

WIDE = 10.0  # highest over lowest frequency of a logarithmic axis


@checked
def thermal_spectrum(dataset: xr.Dataset, figure: FigureBase | None = None) -> Axes:
    """Draw the spectral density of a lever and its fit against frequency, both on logarithmic scales.

    The legend lists the fitted frequency and quality factor of each mode.

    Parameters
    ----------
    dataset
        Result of a thermal spectrum.

    Raises
    ------
    ParameterError
        When the result has no spectral density.
    """
    density, fitted = (
        with_numbers(take(dataset, "spectral_density", "frequency")),
        take(dataset, "fitted_density", "frequency"),
    )
    figure = new_figure(figure, 6.5, 4.0)
    axes = figure.subplots()
    across, text = shown(dataset["frequency"])
    scale, unit = reader_unit(density)
    fitted_f0, fitted_Q = (np.atleast_1d(dataset[name].values) for name in ("fitted_f0", "fitted_Q"))
    told = fitted_f0[np.isfinite(fitted_f0)]
    peaks = [
        f"{units.show(f0, 'Hz', 4)}, Q = {Q:.3g}" if np.isfinite(f0) else "not told"
        for f0, Q in zip(fitted_f0, fitted_Q, strict=True)
    ]
    axes.plot(across, density.values / scale, color=BLUE, linewidth=0.7, label="record")
    axes.plot(across, fitted.values / scale, color=VERMILLION, linewidth=1.4, label="\n".join(["fit", *peaks]))
    axes.set_yscale("log")
    lowest = float(told.min() / BELOW / dataset["frequency"][-1]) * across[-1] if len(told) else 0.0
    lowest = max(lowest, across[0])
    axes.set_xscale("log" if across[-1] > WIDE * lowest else "linear")  # a narrow one has no powers of ten
    axes.set_xlim(lowest, across[-1])
    axes.set_xlabel(text)
    axes.set_ylabel(axis_text(density, unit))
    axes.legend(loc="upper left", fontsize="small", framealpha=0.85)
    tidy(axes)
    head(axes, dataset)
    return axes
