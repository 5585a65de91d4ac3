"""The chart element: figures as plain data go in, clicks on points come out; and how numbers and titles are written in them."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import html
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.errors import shorten
from dforce.core.notation import html_symbol
from dforce.core.quantities import OBSERVABLES
from dforce.core.units import parse, spelled, usual_unit
from dforce.results.dataset import unit_for

if TYPE_CHECKING:
    import xarray as xr

LIBRARY = "/assets/plotly.js"
PATIENCE = 5.0  # s; a browser that takes longer to draw is asked again at the next change


def library_file() -> Path:
    """Return the file of plotly.js that the plotly package brings."""
    return Path(str(resources.files("plotly"))) / "package_data" / "plotly.min.js"


def packed(values: object) -> dict[str, Any]:
    """Return numbers as plotly.js reads them without text: base64 of a typed array."""
    array = np.ascontiguousarray(values, dtype="<f8")
    packed_array: dict[str, Any] = {"dtype": "f8", "bdata": base64.b64encode(array.tobytes()).decode("ascii")}
    if array.ndim == 2:
        packed_array["shape"] = f"{array.shape[0]}, {array.shape[1]}"
    return packed_array


def ring(x: float, y: float, radius: int) -> dict[str, Any]:
    """Return a ring around a point of a figure; a shape, which is drawn in half the time of a trace of marks."""
    place: dict[str, Any] = {"type": "circle", "xsizemode": "pixel", "ysizemode": "pixel", "xanchor": x, "yanchor": y}
    ends = {"x0": -radius, "x1": radius, "y0": -radius, "y1": radius}
    return place | ends | {"line": {"color": "ink", "width": 2}}


def legend() -> dict[str, Any]:
    """Return the usual legend: lines above the frames, for which the chart makes room."""
    return {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.0, "yref": "container", "yanchor": "top"}


def name_of_axis(kind: str, tag: int) -> str:
    """Return the name of an axis, counted from 0."""
    return kind if tag == 0 else f"{kind}{tag + 1}"


def unit_of(variable: xr.DataArray) -> tuple[float, str]:
    """Return scale and name of the unit in which a quantity reads best; the usual one where it is zero everywhere."""
    size = float(np.abs(variable.values).max(initial=0.0, where=np.isfinite(variable.values)))
    return unit_of_size(size, stored_unit(variable), str(variable.name))


def unit_of_size(size: float, stored: str, name: str) -> tuple[float, str]:
    """Return scale and name of the unit in which a value of a quantity reads best; the usual one where it is zero."""
    if not size:
        usual = OBSERVABLES[name].shown if name in OBSERVABLES else usual_unit(stored)
        with contextlib.suppress(df.ParameterError):  # a phase or a percentage
            return parse(f"1 {usual}", stored), spelled(usual)
    return unit_for(size, stored, name)


def label_of(variable: xr.DataArray) -> str:
    """Return the name of a quantity in words."""
    return plain(str(variable.attrs.get("long_name") or variable.name).partition(";")[0])


def hover_of(variable: xr.DataArray, letter: str, unit: str) -> str:
    """Return the text at the pointer: the name of a quantity, its value on the axis `letter`, and its unit."""
    return f"{label_of(variable)} %{{{letter}:.4g}}{'' if unit == '1' else f' {plain(unit)}'}"


def title(variable: xr.DataArray, unit: str) -> str:
    """Return the title of an axis: name, symbol and unit."""
    name = plain(str(variable.attrs.get("long_name", variable.name)))
    symbol = html_symbol(str(variable.attrs.get("symbol", "")))
    return f"{name}{f' <i>{symbol}</i>' if symbol else ''}{_in_brackets(unit)}"


def title_of_several(variables: Sequence[xr.DataArray], unit: str) -> str:
    """Return the title of an axis that several quantities share: their symbols and their unit."""
    symbols = [
        html_symbol(str(variable.attrs.get("symbol", ""))) or plain(str(variable.name)) for variable in variables
    ]
    return f"<i>{', '.join(symbols)}</i>{_in_brackets(unit)}"


def _in_brackets(unit: str) -> str:
    return f" ({plain(unit)})" if unit not in ("1", "") else ""


def stored_unit(variable: xr.DataArray) -> str:
    """Return the unit in which a quantity is stored."""
    return str(variable.attrs.get("units", "1"))


def plain(text: str) -> str:
    """Return text that a figure shows as it is, not as HTML."""
    return html.escape(shorten(text, 120))


class Chart(ui.element, component="chart.js"):
    """A chart that answers when it is drawn, so that no update waits behind another.

    Parameters
    ----------
    label
        Its content, for screen readers.
    on_point
        Called when a curve is clicked, or a point of it chosen with arrow keys and Enter. Its arguments are `curve` and `index`
        (counted from 0), `x`, `y`, the curve's `id`, and its figure, which may be the figure before the last.
    on_limit
        Called when the first shape of a figure with `drag` was dragged, with its place upward.
    holds
        Whether its axes stay while a slider is dragged, with a ghost of the curves before.
    """

    def __init__(
        self,
        label: str,
        on_point: Callable[[dict[str, Any], dict[str, Any]], None] | None = None,
        on_limit: Callable[[float], None] | None = None,
        holds: bool = False,
    ) -> None:
        super().__init__()
        self.props.update(library=LIBRARY, label=label, holds=holds, walks=on_point is not None)
        self.revision = 0
        self._drawing: asyncio.Task[None] | None = None
        self._there: dict[str, Any] | None = None  # the figure that the browser has drawn
        # the last two figures by revision: a click may come before the last one is drawn
        self._sent: dict[int, dict[str, Any]] = {}
        if on_point is not None:

            def clicked(event: GenericEventArguments) -> None:
                figure = self._sent.get(event.args["revision"])
                if figure is not None:
                    on_point(dict(event.args), figure)

            self.on("point", clicked)
        if on_limit is not None:
            self.on("limit", lambda event: on_limit(float(event.args)))

    async def draw(self, figure: dict[str, Any], label: str = "") -> None:
        """Draw a figure (`data` and `layout` of Plotly) once the browser has drawn the one before; the same is not sent."""
        await self.drawn()
        if figure == self._there:
            return
        if label and self.props.get("label") != label:
            self.props["label"] = label
            self.update()
        self._drawing = asyncio.get_running_loop().create_task(self._send(figure))

    async def drawn(self) -> None:
        """Wait until the browser has drawn the last figure."""
        if self._drawing is not None:
            await self._drawing

    async def _send(self, figure: dict[str, Any]) -> None:
        before = {number: one for number, one in self._sent.items() if number == self.revision}
        self.revision += 1
        self._sent, self._there = before | {self.revision: figure}, None
        # without an answer the connection was cut, or the page is hidden and its browser saves power
        with contextlib.suppress(TimeoutError):
            await self.run_method("draw", figure, self.revision, timeout=PATIENCE)
            self._there = figure

    def dim(self, stale: bool) -> None:
        """Show that the chart does not follow the last input."""
        self.run_method("dim", stale)
