"""What differs between the results that are drawn, as a tab."""

from __future__ import annotations

import dataclasses

from nicegui import ui

from dforce.core.notation import html_symbol
from dforce.gui.curves import compare
from dforce.gui.curves.panel import Panel, Scene

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
        """Show what differs between the results of a scene."""
        if scene is None:
            return
        rows = compare.differences([layer.result for layer in scene.layers])
        changed = {
            "rows": [dataclasses.asdict(row) | {"symbol": html_symbol(row.symbol)} for row in rows],
            "names": [layer.name for layer in scene.layers],
            "colors": [layer.color for layer in scene.layers],
            "text": SAME,
        }
        if any(self.element.props.get(key) != value for key, value in changed.items()):
            self.element.props.update(changed)
            self.element.update()
