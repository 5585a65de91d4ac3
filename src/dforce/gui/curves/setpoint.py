"""The quantities at the set point: a field for A/A0, and a table of the states in which the curves reach it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.arrays import AnyArray, Bools
from dforce.core.notation import html_symbol
from dforce.core.quantities import AMOUNTS, NONE
from dforce.findings.set_point import SHOWN, read_at_set_point
from dforce.gui.curves.chart import unit_of_size
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.document.document import HIGHEST_SET_POINT, LOWEST_SET_POINT
from dforce.results.curves import Picture, goes_along, row_of
from dforce.results.kinds import OF_CURVES
from dforce.results.significance import ERRORS, is_none

if TYPE_CHECKING:
    import xarray as xr

    from dforce.gui.window.view import View

ASKED_FIRST = next(picture.y for picture in OF_CURVES if picture.x == "amplitude_ratio")
MOST_COLUMNS = 10
MOST_ROWS = 30
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
NO_STATE = "No state on these curves has this amplitude."
TOO_NEAR = "The amplitude is below this value everywhere; begin the curve farther from the surface (Experiment)."


class SetPointTable(ui.element, component="setpoint.js"):
    """The field and the table."""

    def show(self, changed: dict[str, Any]) -> None:
        """Show other numbers; nothing is sent where nothing changed."""
        if any(self.props.get(key) != value for key, value in changed.items()):
            with self.props.suspend_updates():
                self.props.update(changed)
            self.run_method("take", changed)


class SetPoint(Panel):
    """Reads the quantities at the set point off the curves of one page."""

    title = "Set point"

    def __init__(self, view: View) -> None:
        super().__init__(view)
        self._marked: tuple[Any, list[Layer]] = (None, [])  # the layers marked last, and their input

    def make(self) -> None:
        """Make the field and the table, in the container that is open."""
        self.element = SetPointTable()
        self.element.props.update(low=100.0 * LOWEST_SET_POINT, high=100.0 * HIGHEST_SET_POINT)
        self.element.on("percent", self._changed)

    def ringed(self, layers: Sequence[Layer], wanted: Picture) -> list[Layer]:
        """Return layers, each curve with rings where its lines meet the set point: nothing is solved for them."""
        share = self.view.document.set_point
        return [dataclasses.replace(layer, rings=rings_of(layer.result, share, wanted)) for layer in layers]

    def marked(self, layers: Sequence[Layer], wanted: Picture) -> list[Layer]:
        """Return layers, each curve with its states at the set point; the last that were solved are remembered."""
        share = self.view.document.set_point
        asked = share, wanted, [(layer.name, layer.color, id(layer.result)) for layer in layers]
        if self._marked[0] != asked:
            marked = [dataclasses.replace(layer, states=states_of(layer.result, share, wanted)) for layer in layers]
            self._marked = asked, marked
        return self._marked[1]

    def suits(self, scene: Scene) -> bool:
        """Return whether curves with set points are drawn."""
        return scene.picture is not None and any(layer.states is not None for layer in scene.layers)

    def show(self, scene: Scene | None = None) -> None:
        """Show the states of the layers."""
        with_states = [] if scene is None else [layer for layer in scene.layers if layer.states is not None]
        if scene is None or scene.picture is None or not with_states:
            return
        columns, rows = table_of(with_states, scene.picture)
        changed = {
            "percent": round(100.0 * self.view.document.set_point, 6),
            "rows": rows[:MOST_ROWS],
            "columns": [column.head for column in columns],
            "text": "" if rows else self._why(with_states),
        }
        self.element.show(changed)

    def _why(self, layers: Sequence[Layer]) -> str:
        """Return why there is no row."""
        most = max(float(np.nanmax(layer.result["amplitude_ratio"].values, initial=0.0)) for layer in layers)
        near = all("zc" in layer.result.dims for layer in layers) and 0.0 < most < self.view.document.set_point
        return TOO_NEAR if near else NO_STATE

    def _changed(self, event: GenericEventArguments) -> None:
        share = float(event.args) / 100.0
        if LOWEST_SET_POINT <= share <= HIGHEST_SET_POINT:
            self.view.session.look(dataclasses.replace(self.view.document, set_point=share))


def states_of(result: xr.Dataset, share: float, wanted: Picture) -> xr.Dataset | None:
    """Return the states of a result at a set point with the quantities that a picture shows; None where it is no curve."""
    along = goes_along(result)
    row = row_of(result, along) if along else ""
    names = dict.fromkeys([*ASKED_FIRST, wanted.x, *wanted.y, *SHOWN, *ERRORS])
    known = [name for name in names if name in result.variables and row_of(result, name) == row]
    try:
        return df.at_set_point(result, share, known)
    except df.ParameterError:  # it is no curve
        return None


def rings_of(result: xr.Dataset, share: float, wanted: Picture) -> dict[str, AnyArray]:
    """Return the quantities of a picture where the lines of a result meet a set point; none where it is no curve."""
    try:
        return read_at_set_point(result, share, {wanted.x, *wanted.y})
    except df.ParameterError:
        return {}


def table_of(layers: Sequence[Layer], wanted: Picture) -> tuple[list[ReadoutColumn], list[dict[str, Any]]]:
    """Return the columns and the rows of the table for layers that have states."""
    columns = _columns(layers, wanted)
    return columns, [row for layer in layers for row in _rows(layer, columns, len(layers) > 1)]


@dataclasses.dataclass(frozen=True)
class ReadoutColumn:
    """A column of the table: a quantity, its tone or mode, and its heading."""

    name: str
    index: tuple[int, ...]
    head: dict[str, str]


def _columns(layers: Sequence[Layer], wanted: Picture) -> list[ReadoutColumn]:
    first = layers[-1]
    assert first.states is not None
    names = dict.fromkeys([str(first.states.attrs["along"]), *ASKED_FIRST, *wanted.y])
    found = (column for name in names if name in first.states for column in of_quantity(first.states, name))
    return list(found)[:MOST_COLUMNS]


def of_quantity(states: xr.Dataset, name: str) -> Iterator[ReadoutColumn]:
    """Give the columns of a quantity, one for each tone or mode."""
    variable = states.variables[name]
    dims = variable.dims[1:]
    for index in np.ndindex(*variable.shape[1:]):
        which = [f"{dim} {n + 1}" for dim, n in zip(dims, index, strict=True) if variable.sizes[dim] > 1]
        label = ", ".join([str(variable.attrs.get("long_name", name)), *which])
        yield ReadoutColumn(name, index, {"label": label, "symbol": html_symbol(str(variable.attrs.get("symbol", "")))})


def nones_of(states: xr.Dataset, columns: Sequence[ReadoutColumn]) -> dict[str, Bools]:
    """Return where amounts are below their estimated error, by the names of the columns."""
    names = {column.name for column in columns if column.name in AMOUNTS and column.name in states}
    return {name: is_none(states, name) for name in names}


def cell_of(states: xr.Dataset, none: Mapping[str, Any], column: ReadoutColumn, crossing: int) -> str:
    """Return a value with three digits, a frequency with five, and the unit in which it reads best, as in a text."""
    if column.name not in states:
        return "–"
    variable = states.variables[column.name]
    value = float(variable.values[(crossing, *column.index)])
    if not np.isfinite(value):
        return "–"
    if column.name in none and none[column.name][(crossing, *column.index)]:
        return NONE
    scale, unit = unit_of_size(abs(value), str(variable.attrs.get("units", "1")), column.name)
    number = f"{value / scale:.5g}" if column.name == "frequency" else three_digits(value / scale)
    return f"{number}{'' if unit in ('1', '°') else ' '}{'' if unit == '1' else unit}"


def three_digits(value: float) -> str:
    """Return a number with three digits, with a power of ten where it would be long."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        digits = f"{value:.3g}"
        return f"{float(digits):.0f}" if "e" in digits else digits
    digits, power = f"{value:.2e}".split("e")
    return f"{float(digits):g} × 10{str(int(power)).translate(RAISED)}"


def _rows(layer: Layer, columns: Sequence[ReadoutColumn], several: bool) -> list[dict[str, Any]]:
    """Return the rows of a layer; directions in which the state is the same share one."""
    states = layer.states
    assert states is not None
    merged: dict[tuple[str, ...], list[str]] = {}
    none = nones_of(states, columns)
    words = {name: states.variables[name].values for name in ("stable", "regime", "direction") if name in states}
    for n in range(states.sizes["crossing"]):
        state = " ".join(["unstable"] * ("stable" in words and not words["stable"][n]) + [str(words["regime"][n])])
        cells = tuple(cell_of(states, none, column, n) for column in columns)
        ways = merged.setdefault((state, *cells), [])
        ways += [str(words["direction"][n])] if "direction" in words else []
    name = {"name": layer.name, "color": layer.color} if several else {}
    return [{"ways": " and ".join(ways), "state": key[0], "cells": key[1:], **name} for key, ways in merged.items()]
