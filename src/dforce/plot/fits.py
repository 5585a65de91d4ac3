"""Pictures of a fit: data, model and residuals; correlations and profiles."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.errors import ParameterError, checked
from dforce.plot._style import BLUE, GRAY, VERMILLION, axis_text, head, new_figure, tidy
from dforce.results.dataset import reader_unit

BRANCHES = {1: (BLUE, "from free motion"), -1: (VERMILLION, "behind the jump")}
SIGMAS = 2.0  # band of residuals


@checked
def fit(result: xr.Dataset, figure: FigureBase | None = None) -> list[Axes]:
    """Draw a fit: amplitude and phase with the model, and below each the residuals in standard deviations.

    Colors distinguish the branches; unused points are gray, lost points hollow. The band is two standard deviations.

    Parameters
    ----------
    result
        The result of :func:`dforce.fit`.
    figure
        See :mod:`dforce.plot`.

    Raises
    ------
    ParameterError
        When the result is not a fit.
    """
    _check(result)
    tones = result.sizes["tone"]
    grid = new_figure(figure, 5.6 * tones, 8.0).subplots(
        4, tones, sharex=True, squeeze=False, gridspec_kw={"height_ratios": (3, 1, 3, 1)}
    )
    for tone in range(tones):
        part = result.isel(tone=tone)
        for row, name in ((0, "amplitude"), (2, "phase")):
            _draw(part, name, grid[row, tone], grid[row + 1, tone])
        _, unit = reader_unit(result["zc"])
        grid[3, tone].set_xlabel(axis_text(result["zc"], unit))
    grid[0, 0].legend(framealpha=0.85, fontsize="small", loc="best")
    freedom = int(result.attrs["degrees_of_freedom"])
    independent = result.attrs.get("independence", result.attrs.get("runs_test", 1.0))  # of an older version
    words = f"chi2 = {result.attrs['chi2']:.1f} for {freedom}, p = {independent:.2g} for independent residuals"
    head(grid[0, 0], result, words)
    return list(grid.ravel())


def _draw(part: xr.Dataset, name: str, upper: Axes, lower: Axes) -> None:
    """Draw one quantity of one tone, and its residuals."""
    across, _ = reader_unit(part["zc"])
    scale, unit = reader_unit(part[name])
    zc = part["zc"].values / across
    used, lost = part["used"].values, part["lost"].values
    residual = part[f"{name}_residual"].values
    upper.plot(zc[~used], part[name].values[~used] / scale, ".", color=GRAY, markersize=3.0)
    for number, (color, words) in BRANCHES.items():
        mine = used & (part["branch"].values == number)
        if not mine.any():
            continue
        for axes, values in ((upper, part[name].values / scale), (lower, residual)):
            axes.plot(zc[mine & ~lost], values[mine & ~lost], ".", color=color, markersize=4.0, label=words)
            if (mine & lost).any():
                axes.plot(
                    zc[mine & lost], values[mine & lost], "o", markerfacecolor="none", color=color, markersize=5.0
                )
        order = np.flatnonzero(mine)[np.argsort(zc[mine])]
        upper.plot(zc[order], part[f"{name}_fit"].values[order] / scale, "-", color="black", linewidth=0.9)
    lower.axhspan(-SIGMAS, SIGMAS, color="0.93", zorder=0)
    lower.axhline(0.0, color=GRAY, linewidth=0.6)
    upper.set_ylabel(axis_text(part[name], unit))
    lower.set_ylabel(r"residual ($\sigma$)")
    tidy(upper)
    tidy(lower)


@checked
def fit_errors(result: xr.Dataset, figure: FigureBase | None = None) -> list[Axes]:
    """Draw the correlations of a fit, and the requested profiles of chi2.

    Parameters
    ----------
    result
        The result of :func:`dforce.fit`.
    figure
        See :mod:`dforce.plot`.

    Raises
    ------
    ParameterError
        When the result is not a fit.
    """
    _check(result)
    profiled = result["profiled"].values.tolist() if "profiled" in result.coords else []
    row = new_figure(figure, 5.2 + 3.6 * len(profiled), 4.4).subplots(1, 1 + len(profiled), squeeze=False)[0]
    names = [name.split(".")[-1] for name in result["parameter"].values.tolist()]
    shown = row[0].imshow(result["correlation"].values, vmin=-1.0, vmax=1.0, cmap="RdBu_r")
    row[0].set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize="small")
    row[0].set_yticks(range(len(names)), names, fontsize="small")
    row[0].figure.colorbar(shown, ax=row[0], label="correlation", shrink=0.8)
    for axes, name in zip(row[1:], profiled, strict=True):
        part = result.sel(profiled=name)
        along = xr.DataArray(
            part["profile_varied"].values, attrs={"units": str(result["unit"].sel(parameter=name).values)}
        )
        scale, unit = reader_unit(along.rename("profile_varied"))
        rise = part["profile_chi2"].values - result.attrs["chi2"]
        axes.plot(along.values / scale, rise, ".-", color=BLUE)
        for level in np.atleast_1d(result.attrs.get("interval_rises", (1.0, 3.84))):
            axes.axhline(level, color=GRAY, linewidth=0.6, linestyle="--")
        axes.set_xlabel(f"{name.split('.')[-1]} ({unit})")
        axes.set_ylabel("rise of chi2")
        tidy(axes)
    head(row[0], result)
    return list(row)


def _check(result: xr.Dataset) -> None:
    if result.attrs.get("kind") != "fit":
        raise ParameterError("this result is not a fit; get a fit from df.fit(case, data, free=[...])")
