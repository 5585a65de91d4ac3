"""The numbers behind the curves that are drawn, as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from nicegui import ui

import dforce as df
from dforce.core.arrays import AnyArray
from dforce.core.quantities import NONE
from dforce.gui.curves.chart import unit_of
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.panel import Panel, Scene
from dforce.results.curves import Line
from dforce.results.kinds import is_kind
from dforce.results.significance import along, is_none
from dforce.validity import advice_in

if TYPE_CHECKING:
    import xarray as xr

MOST_ROWS = 1000
DIGITS = 6
EMPTY = "–"
MORE = f"The first {MOST_ROWS} rows; save the result (menu File) for all rows."


class NumbersTable(ui.element, component="numbers.js"):
    """The table."""


@dataclass
class RowGroup:
    """Rows that share their values across: one result in one direction, stable or not; cells are texts."""

    x: AnyArray
    columns: dict[str, list[str]] = field(default_factory=dict)


class Numbers(Panel):
    """The table of the drawn values."""

    title = "Numbers"

    def suits(self, scene: Scene) -> bool:
        """Return whether curves are drawn."""
        return scene.picture is not None

    def make(self) -> None:
        """Make the table, in the container that is open."""
        self.sheet = NumbersTable()

    def show(self, scene: Scene | None = None) -> None:
        """Show the numbers of a figure of curves."""
        if scene is None or scene.picture is None:
            return
        drawn, wanted = scene.drawn, scene.picture
        pairs = zip(drawn.figure["data"], drawn.traces, strict=False)  # an empty figure has none
        lines = [(str(data["meta"]), *shown) for data, shown in pairs if shown is not None]
        layers = list({id(layer.result): layer for _, layer, _ in lines}.values())
        blocks, heads = _blocks(lines, layers, wanted.x)
        rows = [row for words, block in blocks.items() for row in _rows(words, block, heads[1:])]
        skipped = 0 if any(blocks) else 1  # one curve needs no name
        self.sheet.props.update(
            heads=["curve", *heads][skipped:],
            rows=[row[skipped:] for row in rows[:MOST_ROWS]],
            text=MORE if len(rows) > MOST_ROWS else "",
        )
        self.sheet.update()


def _blocks(
    lines: Sequence[tuple[str, Layer, Line]], layers: Sequence[Layer], x: str
) -> tuple[dict[str, RowGroup], list[str]]:
    """Return the rows by their words, and the headings of their columns, the axis across first."""
    across, first = _head(layers, x)
    heads, blocks = {first: None}, dict[str, RowGroup]()
    for name, layer, line in lines:
        # with a quantity for each tone across, each tone has its own rows
        whose = any(dim in layer.result[x].dims for dim in ("tone", "mode", "harmonic", "multiplier"))
        words = line.name.split(", ") if line.name else []
        apart = [word for word in words if whose or word in (line.direction, "stable", "unstable")]
        scale, head = _head(layers, name, [word for word in words if word not in apart])
        heads[head] = None
        key = ", ".join([layer.name] * (len(layers) > 1) + apart)
        blocks.setdefault(key, RowGroup(line.x / across)).columns[head] = _cells(layer, name, line, scale)
    return blocks, list(heads)


def _head(layers: Sequence[Layer], name: str, more: Sequence[str] = ()) -> tuple[float, str]:
    """Return the scale of a quantity, and the heading of its column with its unit."""
    scale, unit = max(unit_of(layer.result[name]) for layer in layers)
    words = ", ".join([str(layers[0].result[name].attrs.get("long_name", name)), *more])
    return scale, words if unit == "1" else f"{words} ({unit})"


def _rows(words: str, block: RowGroup, heads: Sequence[str]) -> Iterator[list[str]]:
    """Give the rows of a block as texts; gaps between pieces of a curve are left out."""
    columns = [block.columns.get(head, [EMPTY] * len(block.x)) for head in heads]
    for x, *cells in zip(block.x, *columns, strict=True):
        if np.isfinite(x):
            yield [words, _text(x), *cells]


def _cells(layer: Layer, name: str, line: Line, scale: float) -> list[str]:
    """Return the values of a line as texts; of an amount below its error there is none."""
    none = along(is_none(layer.result, name), layer.result[name].dims, line)
    return [NONE if there else _text(y / scale) for there, y in zip(none, line.y, strict=True)]


def _text(value: float) -> str:
    return f"{value:.{DIGITS}g}" if np.isfinite(value) else EMPTY


class FitNumbers(Panel):
    """The table of resonances from thermal spectra, a column for each drawn spectrum."""

    title = "Thermal tune"
    name = "numbers of the fit"

    def suits(self, scene: Scene) -> bool:
        """Return whether such a result is drawn."""
        return bool(self._drawn(scene))

    def make(self) -> None:
        """Make the table, in the container that is open."""
        self.sheet = NumbersTable().classes("df-fit-numbers")
        self.sheet.props["label"] = self.name

    def show(self, scene: Scene | None = None) -> None:
        """Show the findings in the drawn results."""
        drawn = [] if scene is None else self._drawn(scene)
        if not drawn:
            return
        found = [self.found(layer.result) for layer in drawn]
        labels = dict.fromkeys(label for texts in found for label in texts)
        self.sheet.props.update(
            heads=["quantity", *(layer.name for layer in drawn)] if len(drawn) > 1 else [],
            rows=[[label, *(texts.get(label, "–") for texts in found)] for label in labels],
        )
        self.sheet.update()

    def _drawn(self, scene: Scene) -> list[Layer]:
        return [layer for layer in scene.layers if scene.picture is not None and self.tells(layer.result)]

    def tells(self, result: xr.Dataset) -> bool:
        """Return whether numbers are found in a result."""
        return is_kind(result, "thermal_spectrum")

    def found(self, result: xr.Dataset) -> dict[str, str]:
        """Return the numbers found in a result as texts by their labels."""
        return {one.label: one.text for one in df.summary(result)}


class MaterialNumbers(FitNumbers):
    """The table of modulus and viscosity by the formulas of AM-FM, beside the true values."""

    title = "Material"
    name = "modulus and viscosity"

    def tells(self, result: xr.Dataset) -> bool:
        """Return whether a result is a curve of two tones with a lock."""
        return is_kind(result, "approach") and "mean_stiffness" in result and result.sizes["tone"] == 2

    def found(self, result: xr.Dataset) -> dict[str, str]:
        """Return the results of the formulas, and the terms that they neglect."""
        try:
            found = df.material(result)
        except df.ParameterError as error:  # a tip without a radius
            return {str(error): ""}
        return super().found(found) | {piece.finding: "" for piece in advice_in(found)}
