"""The advice on the case that is typed, as a tab with its count."""

from __future__ import annotations

from nicegui import ui

from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.window.shown import Said

NONE = "No advice on this case."


class Advice(Panel):
    """The list; each piece stands at its field, too."""

    title = "Advice"

    @property
    def label(self) -> str:
        """The title with the count."""
        count = len(self.view.said.advice)
        return f"{self.title} {count}" if count else self.title

    def make(self) -> None:
        """Make the list, in the container that is open."""
        self.list = ui.element("ul").classes("df-pieces")
        self.told: tuple[str, ...] | None = None
        self.view.on_said.append(self._said)
        self._said(self.view.said)

    def show(self, scene: Scene | None = None) -> None:
        """Show the advice."""
        self._said(self.view.said)

    def _said(self, said: Said) -> None:
        pieces = tuple(dict.fromkeys(text for _, text in said.advice)) or (NONE,)
        if pieces != self.told:
            self.told = pieces
            self.list.clear()
            with self.list:
                for text in pieces:
                    with ui.element("li"):
                        ui.label(text)
