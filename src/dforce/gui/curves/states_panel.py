"""All coexisting states at the set point or at a distance, as a tab: what each is, and its motion at a press."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.arrays import Array
from dforce.findings.set_point import at_distance
from dforce.gui.case.values import with_point
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.curves.setpoint import cell_of, nones_of, of_quantity
from dforce.gui.window.view import View
from dforce.results.curves import goes_along

if TYPE_CHECKING:
    import xarray as xr

COLUMNS = ("zc", "frequency", "amplitude", "phase", "peak_force", "max_indentation")
LOOKING = "The states are being looked for ..."
NONE = "No state is here."
UNKNOWN = "The states of this curve cannot be followed."
LONGEST = 40  # characters of a distance


class StatesTable(ui.element, component="states_panel.js"):
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
        waiting = LOOKING if self.looking() else UNKNOWN
        shown["text"] = "" if shown["rows"] else wrong or (NONE if found is not None else waiting)
        if any(self.element.props.get(key) != value for key, value in shown.items()):
            self.element.props.update(shown)
            self.element.update()

    def _found(self, states: xr.Dataset) -> xr.Dataset:
        """Return the states at the chosen place."""
        if self.distance and goes_along(states) == "zc":
            return at_distance(states, df.parse(with_point(self.distance), "m"))
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
    """Return states in order: the stable ones first, the farthest from the sample at the beginning."""
    return [int(n) for n in np.lexsort((-found["zc"].values, ~found["stable"].values))]


def nearest(states: xr.Dataset, one: xr.Dataset) -> int:
    """Return the number of the point of branches whose motion is nearest to a state, by distance, amplitude and phase."""

    def apart(name: str) -> Array:
        values = states[name].values.reshape(states.sizes["point"], -1)[:, 0]
        return np.asarray(
            (values - float(np.ravel(one[name].values)[0])) / max(float(np.ptp(values)), np.finfo(float).tiny)
        )

    return int(np.nanargmin(sum(apart(name) ** 2 for name in (goes_along(states), "amplitude", "phase"))))
