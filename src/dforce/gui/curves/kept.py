"""The results that are kept: a row of names with colors, the shown results, and their differences."""

from __future__ import annotations

import asyncio
import dataclasses
from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.notation import html_symbol
from dforce.gui.case.fields import name_of
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.document.document import LONGEST_NAME, KeptResult
from dforce.gui.document.store import differences
from dforce.gui.window.dialogs import telling
from dforce.gui.window.view import View

if TYPE_CHECKING:
    import xarray as xr

NOW = "now"  # name of the curve that follows the fields among others


class Strip(ui.element, component="kept.js"):
    """The row of results."""


class KeptResults:
    """The results kept, as one page shows them."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.strip = Strip()
        self.strip.props["longest"] = LONGEST_NAME
        self.strip.on("keep", self._keep)
        self.strip.on("shown", lambda event: self._change(event, shown=bool(event.args["shown"])))
        self.strip.on("rename", lambda event: self._change(event, name=str(event.args["name"])[:LONGEST_NAME]))
        self.strip.on("remove", self._remove)

    def layers(self, result: xr.Dataset | None) -> list[Layer]:
        """Return the layers to draw: the shown results, and on top the result that follows the fields."""
        session = self.view.session
        own = session.kept_as(result)
        found = [
            Layer(session.results_of[kept.id], kept.name, kept.color)
            for kept in session.document.results
            if kept.shown and kept.id in session.results_of and kept is not own
        ]
        if result is not None and (own is None or own.shown):
            found.append(Layer(result, NOW, 0) if own is None else Layer(result, own.name, own.color))
        return found

    def names(self, result: xr.Dataset | None) -> dict[str, str]:
        """Return the names of all results by identifier, the top one first."""
        session = self.view.session
        own = session.kept_as(result)
        found = {"": NOW} if result is not None and own is None else {}
        listed = sorted(session.document.results, key=lambda kept: kept is not own)
        return found | {kept.id: kept.name for kept in listed}

    async def take(self, identifier: str) -> xr.Dataset:
        """Return a result by its identifier; without one, that which follows the fields.

        Raises
        ------
        ResultError
            When it is no longer there.
        """
        if identifier:
            return await asyncio.to_thread(self.view.session.results.take, identifier)
        if self.view.result is None:
            raise df.ResultError("no result is left")
        return self.view.result

    def show(self, result: xr.Dataset | None) -> None:
        """Show the row."""
        document = self.view.document
        follows = result is not None and self.view.session.kept_as(result) is None
        changed = {"items": [dataclasses.asdict(kept) for kept in document.results], "now": follows}
        if any(self.strip.props.get(key) != value for key, value in changed.items()):
            self.strip.props.update(changed)
            self.strip.update()

    async def _keep(self) -> None:
        if self.view.result is not None:
            with telling("the result could not be kept"):
                await self.view.session.keep(self.view.result)

    async def _remove(self, event: GenericEventArguments) -> None:
        with telling("the result could not be removed"):
            await self.view.session.drop(str(event.args))

    def _change(self, event: GenericEventArguments, **changes: Any) -> None:
        document, identifier = self.view.document, str(event.args["id"])

        def changed(kept: KeptResult) -> KeptResult:
            return dataclasses.replace(kept, **changes) if kept.id == identifier else kept

        self.view.session.look(dataclasses.replace(document, results=tuple(map(changed, document.results))))


SAME = "The cases of these results do not differ in any parameter."


class DifferencesTable(ui.element, component="differences.js"):
    """The table."""


class Differences(Panel):
    """The parameters in which results differ, a column for each result."""

    title = "What differs"

    def suits(self, scene: Scene) -> bool:
        """Return whether there are several results."""
        return len(scene.layers) > 1

    def make(self) -> None:
        """Make the table, in the container that is open."""
        self.element = DifferencesTable()

    def show(self, scene: Scene | None = None) -> None:
        """Show the differences between the results of a scene."""
        if scene is None:
            return
        rows = [
            dataclasses.asdict(row) | {"symbol": html_symbol(row.symbol), "values": tuple(map(_named, row.values))}
            for row in differences([layer.result for layer in scene.layers])
        ]
        changed = {
            "rows": rows,
            "names": [layer.name for layer in scene.layers],
            "colors": [layer.color for layer in scene.layers],
            "text": SAME,
        }
        if any(self.element.props.get(key) != value for key, value in changed.items()):
            self.element.props.update(changed)
            self.element.update()


def _named(value: str) -> str:
    """Return a value in words: of a force model its name, in the place of its key."""
    return name_of(df.forces.REGISTRY[value]) if value in df.forces.REGISTRY else value
