"""The dialog that adds a force, and the field of an own law, whose force curve follows each letter."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.forces import grouped
from dforce.forces.custom import NAMES_IN_LAW
from dforce.gui.case.entry import LONGEST
from dforce.gui.case.fields import first_line, name_of
from dforce.gui.case.words import in_words, plain
from dforce.gui.curves.other_figures import force_distance
from dforce.gui.document.compute import DRAFTS, Latest, in_thread
from dforce.gui.document.document import Path, path_of, written
from dforce.gui.window.dialogs import dialog

if TYPE_CHECKING:
    from dforce.gui.case.fields import Field
    from dforce.gui.window.view import View

TO_NEW_FORCE = "dforceFocus.go('.df-card:nth-last-child(1 of .df-card) :is(textarea, .df-box)')"


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
    return {"name": model.name, "title": name_of(model), "text": plain(first_line(model))}


class OwnLaw(ui.element, component="own_law.js"):
    """A law in a field.

    While one types, the plain Python law gives the small force curve, and mistakes are told at once. Nothing is compiled.
    With Enter it becomes part of the case.
    """

    def __init__(self, view: View, path: Path, field: Field) -> None:
        super().__init__()
        self.view, self.path = view, path
        name = written(path)
        self.props.update(path=name, label=field.label, help=field.help, longest=LONGEST)
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
        """Show the law of the case, or what is wrong with it; nothing is sent where nothing changed."""
        known = {key: value for key, value in changed.items() if key in ("text", "error", "mistake")}
        if any(self.props.get(key) != value for key, value in known.items()):
            self.props.update(known)

    def settle(self) -> None:
        """Do nothing: this field has no text ahead of the page."""

    async def _show_force(self, text: str) -> None:
        """Draw the force of what is being typed; say what is wrong with it."""
        document = self.view.document.put(self.path, " ".join(text.split()))
        try:
            case = document.case()
            curve = await in_thread(DRAFTS, lambda: df.force_curve(case))
        except (df.DForceError, TypeError) as error:
            of_law = path_of(document, str(error))[: len(self.path)] == self.path
            self.show(mistake=in_words(document, str(error)) if of_law else "")
            return
        self.show(mistake="")
        await self.view.force.draw(force_distance(curve))
