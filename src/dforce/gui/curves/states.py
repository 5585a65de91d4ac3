"""Coexisting states of a page: found once nothing has changed for a moment, faint lines behind the curve, and a tab."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.case import case_of
from dforce.core.arrays import Array
from dforce.findings.coexisting import coexisting
from dforce.findings.set_point import SetPointState, at_distance, states_at
from dforce.gui.case.values import composed
from dforce.gui.curves.chart import packed
from dforce.gui.curves.figures import Drawn, Figure, Layer
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.curves.setpoint import cell_of, nones_of, of_quantity
from dforce.gui.document.compute import (
    BEHIND,
    LIVE_CURVES,
    LULL,
    MOST_RECENT,
    Overtaken,
    RecentCurves,
    in_thread,
    key_of,
)
from dforce.gui.window.view import View
from dforce.results.curves import Line, Picture, drawable, goes_along, lines_of
from dforce.results.kinds import measured

if TYPE_CHECKING:
    import xarray as xr

    from dforce.gui.document.document import Document
    from dforce.gui.window.shown import DrawnResult

REST = 0.3  # s without a live curve of any page, after which the states are looked for
PATIENCE = 20.0  # s of computing; the states found by then are drawn
CURVE = "this curve"
NAMES = {True: "stable states", False: "unstable states"}
ONE = {True: "a stable state", False: "an unstable state"}
RECENT_STATES = RecentCurves(MOST_RECENT)


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
        self._met: tuple[xr.Dataset | None, float, list[SetPointState]] = (None, 0.0, [])  # at a set point, the last
        self._latest = view.latest(self._find)
        view.on_beside.append(self._ask)

    def of(self, curve: DrawnResult | None) -> xr.Dataset | None:
        """Return the states behind a curve; None while they are not known."""
        found = self.found
        if curve is None or found is None or not found.document.same_case(curve.document):
            return None
        return found.states

    def met(self, curve: DrawnResult | None, share: float) -> list[SetPointState]:
        """Return the states behind a curve at a set point; the last that were solved are remembered. Blocking."""
        states = self.of(curve)
        if states is None or goes_along(states) != "zc" or "amplitude" not in measured(states):
            return []
        if self._met[0] is not states or self._met[1] != share:
            self._met = states, share, states_at(states, share)
        return self._met[2]

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
        while not self._overtaken(curve) and not LIVE_CURVES.rest(REST):
            await asyncio.sleep(LULL)
        began = 0.0

        def overtaken() -> bool:
            return self._overtaken(curve)

        def report_progress(done: int, total: int, note: str) -> None:
            LIVE_CURVES.give_way(overtaken)
            if time.thread_time() - began > PATIENCE:
                raise KeyboardInterrupt

        def find() -> xr.Dataset | None:
            nonlocal began
            LIVE_CURVES.give_way(overtaken)
            began = time.thread_time()
            try:
                states = RECENT_STATES.take(key := key_of(case_of(curve.result)))
                if states is None:
                    states = coexisting(curve.result, report_progress)
                    if not states.attrs.get("interrupted"):
                        RECENT_STATES.keep(key, states)
            except (df.DForceError, KeyboardInterrupt):  # no such curve, or no state by then
                return None
            return states

        try:
            states = await in_thread(BEHIND, find)
        except Overtaken:
            return
        if overtaken():
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
    data, layout = list(drawn.figure["data"]), drawn.figure["layout"] | {"showlegend": True}
    if not drawn.figure["layout"]["showlegend"]:  # the curve alone needs no name, beside states it does
        data[0] = data[0] | {"name": CURVE, "showlegend": True}
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
            "hovertemplate": place.hover(f"{ONE[line.stable]} at %{{x:.4g}} {drawn.x_unit}"),
        }
        named.add(line.stable)


COLUMNS = ("zc", "frequency", "amplitude", "phase", "peak_force", "max_indentation")
LOOKING = "The states are being looked for ..."
NO_STATE = "No state exists here."
HELD = "a controller keeps this amplitude constant; choose a distance"
UNFOLLOWED = "dForce cannot follow the states of this curve."
LONGEST = 40  # characters of a distance
READER = "nm"  # unit of a distance typed as a number alone


class StatesTable(ui.element, component="states.js"):
    """The choice of the place, and the table."""


class StatesPanel(Panel):
    """The tab of one page.

    Parameters
    ----------
    states
        Returns the states behind the curve, None while they are not known.
    looking
        Returns whether they are being looked for.
    open_motion
        Shows the motion at a point of a result, given as a layer and its places.
    """

    title = "States"

    def __init__(
        self,
        view: View,
        states: Callable[[], xr.Dataset | None],
        looking: Callable[[], bool],
        open_motion: Callable[[Layer, dict[str, int]], None],
    ) -> None:
        super().__init__(view)
        self.states, self.looking, self.open_motion = states, looking, open_motion
        self.distance = ""  # as typed; empty: at the set point

    def make(self) -> None:
        """Make the table, in the container that is open."""
        self.element = StatesTable()
        self.element.on("distance", lambda event: self._at(str(event.args)[:LONGEST].strip()))
        self.element.on("motion", self._motion)

    def suits(self, scene: Scene) -> bool:
        """Return whether a curve is drawn that may have several states."""
        result = scene.result
        return scene.picture is not None and result is not None and goes_along(result) in ("zc", "frequency")

    def show(self, scene: Scene | None = None) -> None:
        """Show the states at the chosen place."""
        if not self.in_sight:
            return
        all_states, wrong = self.states(), ""
        shown: dict[str, Any] = {"share": f"{100.0 * self.view.document.set_point:.4g} %", "distance": self.distance}
        shown |= {"columns": [], "rows": [], "along": all_states is not None and goes_along(all_states) == "zc"}
        try:
            found = None if all_states is None else self._found(all_states)
        except df.DForceError as error:
            found, wrong = None, f"{str(error)[:1].upper()}{str(error)[1:]}."
        if found is not None:
            columns = [column for name in COLUMNS if name in found.variables for column in of_quantity(found, name)]
            none = nones_of(found, columns)
            shown["columns"] = [column.head for column in columns]
            shown["rows"] = [
                {
                    "state": str(found["regime"].values[n]) or "free",
                    "stable": bool(found["stable"].values[n]),
                    "cells": [cell_of(found, none, column, n) for column in columns],
                }
                for n in order_of(found)
            ]
        waiting = LOOKING if self.looking() else UNFOLLOWED
        shown["text"] = "" if shown["rows"] else wrong or (NO_STATE if found is not None else waiting)
        if any(self.element.props.get(key) != value for key, value in shown.items()):
            self.element.props.update(shown)
            self.element.update()

    def _found(self, states: xr.Dataset) -> xr.Dataset:
        """Return the states at the chosen place."""
        if self.distance and goes_along(states) == "zc":
            return at_distance(states, df.parse(composed(self.distance, READER), "m"))
        if "amplitude" not in measured(states):
            raise df.ParameterError(HELD)
        return df.at_set_point(states, self.view.document.set_point)

    def _at(self, distance: str) -> None:
        self.distance = distance
        self.show()

    def _motion(self, event: GenericEventArguments) -> None:
        """Show the motion of a state, at the nearest point that was computed."""
        states = self.states()
        if states is None:
            return
        found = self._found(states)
        place = int(event.args)
        if 0 <= place < found.sizes["crossing"]:
            self.open_motion(Layer(states), {"point": nearest(states, found.isel(crossing=order_of(found)[place]))})


def order_of(found: xr.Dataset) -> list[int]:
    """Return states in order: the stable ones first, the largest distance or frequency at the beginning."""
    along = -found[str(found.attrs["along"])].values
    return [int(n) for n in np.lexsort((along, ~found["stable"].values))]


def nearest(states: xr.Dataset, one: xr.Dataset) -> int:
    """Return the number of the point of branches whose motion is nearest to a state, by distance, amplitude and phase."""

    def apart(name: str) -> Array:
        values = states[name].values.reshape(states.sizes["point"], -1)[:, 0]
        return np.asarray(
            (values - float(np.ravel(one[name].values)[0])) / max(float(np.ptp(values)), np.finfo(float).tiny)
        )

    return int(np.nanargmin(sum(apart(name) ** 2 for name in (goes_along(states), "amplitude", "phase"))))
