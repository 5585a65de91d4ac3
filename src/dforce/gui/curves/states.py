"""Coexisting states behind the curve of a page: faint lines, found once nothing has changed for a moment."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

import dforce as df
from dforce.findings.coexisting import coexisting
from dforce.gui.curves.chart import packed
from dforce.gui.curves.figures import Drawn, Figure
from dforce.gui.document.compute import LIVE, Latest, in_thread
from dforce.results.curves import Line, Picture, drawable, lines_of

if TYPE_CHECKING:
    import xarray as xr

    from dforce.gui.document.document import Document
    from dforce.gui.window.shown import DrawnResult
    from dforce.gui.window.view import View

REST = 0.3  # s without a change after which the states are looked for
PATIENCE = 20.0  # s; what was found by then is drawn
NAMES = {True: "stable states", False: "unstable states"}
ONE = {True: "a stable state", False: "an unstable state"}


@dataclass(frozen=True)
class FoundStates:
    """The states of a document's case; None where its curve has none to look for."""

    document: Document
    states: xr.Dataset | None


class CoexistingStates:
    """Looks for the states behind the curve of one page."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.found: FoundStates | None = None
        self._latest = Latest(self._find)
        view.on_beside.append(self._ask)

    def of(self, curve: DrawnResult | None) -> xr.Dataset | None:
        """Return the states behind a curve; None while they are not known."""
        found = self.found
        if curve is None or found is None or not found.document.same_case(curve.document):
            return None
        return found.states

    def is_looking(self, curve: DrawnResult | None) -> bool:
        """Return whether the states behind a curve are not known yet."""
        found = self.found
        return curve is not None and (found is None or not found.document.same_case(curve.document))

    def _ask(self) -> None:
        curve = self.view.curve
        if curve is not None and self.is_looking(curve):
            self._latest.ask(curve)

    async def _find(self, curve: DrawnResult) -> None:
        await asyncio.sleep(REST)
        if self._overtaken(curve):
            return
        began = time.monotonic()

        def report_progress(done: int, total: int, note: str) -> None:
            if self._overtaken(curve) or time.monotonic() - began > PATIENCE:
                raise KeyboardInterrupt

        def find() -> xr.Dataset | None:
            try:
                return coexisting(curve.result, report_progress)
            except (df.DForceError, KeyboardInterrupt):  # no such curve, or another one is wanted by now
                return None

        states = await in_thread(LIVE, find)
        if self._overtaken(curve):
            return
        self.found = FoundStates(curve.document, states)
        if states is not None:
            self.view.show_anew()

    def _overtaken(self, curve: DrawnResult) -> bool:
        """Return whether another case is typed by now."""
        return self._latest.overtaken or not self.view.document.same_case(curve.document)


def with_states(drawn: Drawn, wanted: Picture, states: xr.Dataset) -> Drawn:
    """Return a figure of curves with faint lines of all states under them: dashes where a state is unstable."""
    names = [name for name in wanted.y if name in drawn.places and name in drawable(states, wanted.x)]
    if wanted.logarithmic or not names:
        return drawn
    lines = [(name, line) for name in names for line in lines_of(states, wanted.x, name) if np.isfinite(line.y).any()]
    data, layout = drawn.figure["data"], drawn.figure["layout"] | {"showlegend": True}
    figure = {**drawn.figure, "data": [*data, *_traces(drawn, lines)], "layout": layout}
    behind = {len(data) + number: line for number, (_, line) in enumerate(lines)}
    return replace(drawn, figure=figure, traces=(*drawn.traces, *(None,) * len(lines)), behind=behind)


def _traces(drawn: Drawn, lines: list[tuple[str, Line]]) -> Iterator[Figure]:
    named: set[bool] = set()
    for name, line in lines:
        place = drawn.places[name]
        look = {"width": 4, "dash": "solid"} if line.stable else {"width": 1.5, "dash": "dash"}
        yield {
            "x": packed(line.x / drawn.x_scale),
            "y": packed(line.y / place.scale),
            "xaxis": place.x_axis,
            "yaxis": place.y_axis,
            "zorder": -1,  # under the curves, whose numbers stay as they are
            "type": "scatter",
            "mode": "lines",
            "meta": f"states {name}",
            "name": NAMES[line.stable],
            "line": {"color": "soft", **look},
            "opacity": 0.35 if line.stable else 0.7,
            "showlegend": line.stable not in named,
            "hovertemplate": place.hover(ONE[line.stable]),
        }
        named.add(line.stable)
