"""Elements of a form: a field, its companions, a heading, a button."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement
from nicegui.events import GenericEventArguments

if TYPE_CHECKING:
    from dforce.gui.case.fields import Field
    from dforce.gui.document.document import Path

LONGEST = 2000  # characters of a field


class Caption(NamedTuple):
    """Words for a field: `symbol` is HTML made by :func:`dforce.core.notation.html_symbol`, the others are text."""

    label: str
    symbol: str = ""
    help: str = ""


class Entry(ui.element, component="entry.js"):
    """One field: label, symbol, text or choice or switch, unit, error, advice and a button for a slider.

    Parameters
    ----------
    path
        Name of the parameter in the case, shown as help.
    caption
        Words for it.
    kind
        "text", "choice" or "switch".
    known
        Texts that are offered, such as the names of known media; others may be typed.
    on_typed
        Called with the text and the unit shown, as typed; a switch gives "true" or "false".
    on_unit
        Called with a unit that was chosen.
    on_slider
        Called when the slider's button is pressed; without it there is none.
    """

    def __init__(
        self,
        path: str,
        caption: Caption,
        *,
        on_typed: Callable[[str, str], None],
        kind: str = "text",
        known: Sequence[str] = (),
        numeric: bool = False,
        on_unit: Callable[[str], None] | None = None,
        on_slider: Callable[[], None] | None = None,
    ) -> None:
        super().__init__()
        self._ahead = False  # the browser was told a text that the page's own list of properties does not hold yet
        self.props.update(
            path=path,
            **caption._asdict(),
            kind=kind,
            known=list(known),
            numeric=numeric,
            slidable=on_slider is not None,
            longest=LONGEST,
        )

        def typed(event: GenericEventArguments) -> None:
            on_typed(str(event.args["text"])[:LONGEST], str(event.args["unit"])[:40])
            self.client.run_javascript(f"dforceUnsent.arrived({json.dumps(path)}, {int(event.args.get('number', 0))})")

        self.on("typed", typed)
        if on_unit is not None:
            self.on("unit", lambda event: on_unit(str(event.args)[:40]))
        if on_slider is not None:
            self.on("slider", lambda: on_slider())

    def show(self, **changed: Any) -> None:
        """Show other texts, units, options, an error, a note or advice; nothing is sent where nothing changed."""
        different = {key: value for key, value in changed.items() if self.props.get(key) != value}
        if set(different) <= {"text", "unit"} and "text" in self.props:
            with self.props.suspend_updates():
                self.props.update(different)
            if different:
                self._ahead = True
                self.run_method("take", self.props["text"], self.props.get("unit", ""))
        else:
            self.props.update(different)

    def settle(self) -> None:
        """Let the page know the text for good: a field that is not on show now takes it from there when it is."""
        if self._ahead:
            self._ahead = False
            self.update()


class Companion(Protocol):
    """What stands at the fields of numbers: sliders, and the fit of a measured curve."""

    def clear(self) -> None:
        """Forget all fields: they are made anew."""

    def place(self, path: Path, field: Field) -> None:
        """Make what stands at a field, in the container that is open."""

    def show(self) -> None:
        """Show the document."""


def heading(text: str) -> None:
    """Show the heading of a section."""
    TextElement(tag="h2", text=text).classes("df-heading")


def button(text: str, icon: str, press: Callable[[], None], label: str = "") -> None:
    """Show a quiet button."""
    made = ui.button(text, icon=icon, on_click=press, color=None).props("flat dense no-caps").classes("df-button")
    if label:
        made.props.update({"aria-label": label, "title": f"{label[0].upper()}{label[1:]}"})
