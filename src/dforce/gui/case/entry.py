"""Elements of a form: fields with companions, the field of an own law, headings, buttons, the dialog that adds a force."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.forces import grouped
from dforce.forces.custom import NAMES_IN_LAW
from dforce.gui.case.fields import first_line, in_words, name_of, plain
from dforce.gui.document.compute import DRAFTS, Latest, in_thread
from dforce.gui.document.document import Path, path_of, written
from dforce.gui.window.dialogs import dialog

if TYPE_CHECKING:
    from dforce.gui.case.fields import Field
    from dforce.gui.window.view import View

LONGEST = 2000  # characters of a field
TO_NEW_FORCE = "dforceFocus.go('.df-card:nth-last-child(1 of .df-card) :is(textarea, .df-box)')"


class QuietElement(ui.element):
    """An element that receives only changes."""

    def show(self, **changed: Any) -> None:
        """Show other values of its properties."""
        self.props.update({key: value for key, value in changed.items() if self.props.get(key) != value})


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
        self._ahead = False  # the browser has a text that the page's own list of properties does not contain yet
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
        """Write the text to the page: a hidden field takes it from there when it is shown."""
        if self._ahead:
            self._ahead = False
            self.update()


class OwnLaw(QuietElement, component="own_law.js"):
    """A law in a field.

    During typing the plain Python law gives the small force curve, and mistakes appear at once. Nothing is compiled.
    With Enter it becomes part of the case.
    """

    def __init__(self, view: View, path: Path, field: Field) -> None:
        super().__init__()
        self.view, self.path = view, path
        name = written(path)
        opened = zlib.crc32(repr(view.document.opened).encode())  # another case has other drafts
        self.props.update(path=name, place=f"{opened} {name}", label=field.label, help=field.help, longest=LONGEST)
        self.props["names"] = [{"name": key, **row._asdict()} for key, row in NAMES_IN_LAW.items()]
        self._preview = Latest(self._show_force)
        self.on("draft", lambda event: self._preview.ask(str(event.args)[:LONGEST]))

        def typed(event: GenericEventArguments) -> None:
            self.enter(str(event.args["text"])[:LONGEST])
            self.client.run_javascript(f"dforceUnsent.arrived({json.dumps(name)}, {int(event.args.get('number', 0))})")

        self.on("typed", typed)

    def enter(self, text: str) -> None:
        """Take a law into the case."""
        self.view.edit(self.view.document.put(self.path, " ".join(text.split())), name=".".join(map(str, self.path)))

    def show(self, **changed: Any) -> None:
        """Show the law of the case, or its error."""
        super().show(**{key: value for key, value in changed.items() if key in ("text", "error", "mistake")})

    def settle(self) -> None:
        """Do nothing: this field has no text ahead of the page."""

    async def _show_force(self, text: str) -> None:
        """Draw the force of the typed law, or show its error."""
        document = self.view.document.put(self.path, " ".join(text.split()))
        try:
            case = document.case()
            curve = await in_thread(DRAFTS, lambda: df.force_curve(case))
        except (df.DForceError, TypeError) as error:
            of_law = path_of(document, str(error))[: len(self.path)] == self.path
            self.show(mistake=in_words(document, str(error)) if of_law else "")
            return
        self.show(mistake="")
        await self.view.force.preview(curve)


class Companion(Protocol):
    """The additions to the fields of numbers: sliders, and the fit of a measured curve."""

    def clear(self) -> None:
        """Forget all fields: they are made anew."""

    def place(self, path: Path, field: Field) -> None:
        """Make the elements at a field, in the open container."""

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


class ForceList(ui.element, component="force_menu.js"):
    """The models in groups, with a search."""


def choose_force(take: Callable[[str], None]) -> None:
    """Ask for a force model; `take` is called with the key of the one chosen."""
    with dialog("add a force") as made:
        models = ForceList()
        models.props["groups"] = [
            {"title": title, "items": [_item(model) for model in members]}
            for title, members in grouped(df.forces.REGISTRY.values()).items()
        ]

    def taken(event: GenericEventArguments) -> None:
        if event.args in df.forces.REGISTRY:
            made.close()
            take(str(event.args))
            models.client.run_javascript(TO_NEW_FORCE)

    models.on("take", taken)


def _item(model: type[df.forces.Force]) -> dict[str, str]:
    also = ", ".join(model.also_called)
    return {"name": model.name, "title": name_of(model), "also": also, "text": plain(first_line(model))}
