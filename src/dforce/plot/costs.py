"""The picture of what accuracy costs: error against time, a line for each method."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.errors import ParameterError, checked, nearest
from dforce.plot._style import color_cycle, new_figure, tidy

LEAST = 1e-10  # nm, degrees: an error below it is drawn there
ERRORS = (("amplitude_error", 1e9, "amplitude error (nm)"), ("phase_error", 1.0, "phase error (°)"))


@checked
def cost_of_accuracy(
    result: dict[str, Any], case: str = "table-1-am", figure: FigureBase | None = None
) -> tuple[Axes, Axes]:
    """Draw the errors of amplitude and phase of a settled point against the time that it takes, for each method.

    Parameters
    ----------
    result
        What :func:`dforce.checks.benchmark.accuracy.cost_of_accuracy` returns.
    case
        The shipped case that the point belongs to.
    figure
        See :mod:`dforce.plot`.

    Raises
    ------
    ParameterError
        When the result has no such case, or is another table.
    """
    if not {"rows", "reference"} <= {*result}:
        raise ParameterError("result is not what dforce.checks.benchmark.accuracy.cost_of_accuracy returns")
    rows = [row for row in result["rows"] if row["case"] == case]
    if not rows:
        raise ParameterError(f"this result has no case '{case}'{nearest(case, result['reference'])}")
    left, right = new_figure(figure, 9.0, 4.0).subplots(1, 2)
    methods = list(dict.fromkeys(row["method"] for row in rows))
    for axes, (name, scale, label) in zip((left, right), ERRORS, strict=True):
        for method, color in zip(methods, color_cycle(len(methods)), strict=True):
            own = [row for row in rows if row["method"] == method]
            x, y = [1e3 * row["seconds"] for row in own], [max(scale * row[name], LEAST) for row in own]
            axes.plot(x, y, color=color, marker="o", markersize=4, label=method)
        axes.set(xscale="log", yscale="log", xlabel="time to the settled point (ms)", ylabel=label)
        tidy(axes)
    left.legend(frameon=False, fontsize="small")
    return left, right
