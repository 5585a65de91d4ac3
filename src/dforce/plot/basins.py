"""The picture of basins: which start leads to which state."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import FigureBase
from matplotlib.patches import Patch

from dforce.case import case_of
from dforce.core.errors import ParameterError, checked
from dforce.experiments.basins import starts_of_states
from dforce.plot._style import LIGHT, color_cycle, head, new_figure, shown, take
from dforce.plot.motion import at_distance
from dforce.results.dataset import reader_unit

NO_STATE = "not settled"


@checked
def basins(dataset: xr.Dataset, tone: int = 1, figure: FigureBase | None = None) -> Axes:
    """Draw the starts in the color of their final state, with amplitude, phase and share of each state.

    The legend lists amplitude and phase of a drive tone. A dot marks the motion of each state among the starts.

    Raises
    ------
    ParameterError
        When the result has no basins, or no such tone.
    """
    axes_of_starts = [str(dim) for dim in dataset.dims if str(dim).startswith("start_")]
    reached = take(dataset, "reached", *axes_of_starts)
    if tone not in dataset.get("tone", [tone]):
        raise ParameterError(f"this result has no tone {tone}; it has {dataset.sizes['tone']}, counted from 1")
    rows, columns = reached.dims
    axes = new_figure(figure, 6.4, 4.8).subplots()
    (y, y_text), (x, x_text) = shown(dataset[rows]), shown(dataset[columns])
    count = dataset.sizes["state"]
    colors = color_cycle(count)
    axes.pcolormesh(
        x,
        y,
        reached.values,
        cmap=ListedColormap([LIGHT, *colors]),
        vmin=-0.5,
        vmax=count + 0.5,
        shading="nearest",
        rasterized=True,
    )
    handles = [Patch(color=color, label=_words(dataset, i, tone)) for i, color in enumerate(colors)]
    if (reached.values == 0).any():
        handles.append(Patch(color=LIGHT, label=NO_STATE))
    if count:
        places = starts_of_states(dataset, case_of(dataset).problem.tones[0])
        up, right = (own / reader_unit(dataset[dim])[0] for own, dim in zip(places, reached.dims, strict=True))
        axes.plot(right, up, linestyle="", marker="o", color="white", markeredgecolor="black", clip_on=False)
    axes.set_xlabel(x_text)
    axes.set_ylabel(y_text)
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False, fontsize="small")
    head(axes, dataset, at_distance(dataset))
    return axes


def _words(dataset: xr.Dataset, i: int, tone: int) -> str:
    """Return the line of the legend for one state."""
    amplitude = dataset["amplitude"].isel(state=i).sel(tone=tone)
    scale, unit = reader_unit(amplitude)
    lag, share = float(dataset["phase"].isel(state=i).sel(tone=tone)), float(dataset["share"][i])
    return f"$A$ = {float(amplitude) / scale:.4g} {unit}, $\\phi$ = {lag:.4g}°: {100.0 * share:.3g} % of the starts"
