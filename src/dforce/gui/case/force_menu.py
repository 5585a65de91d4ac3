"""The dialog that adds a force: all models under their headings, with a search."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.notation import first_sentence
from dforce.forces import grouped
from dforce.gui.case.fields import name_of
from dforce.gui.case.words import plain


class ForceList(ui.element, component="force_menu.js"):
    """The models in groups, with a search."""


def choose_force(take: Callable[[str], None]) -> None:
    """Ask for a force model; `take` is called with the key of the one chosen."""
    with ui.dialog(value=True).props('aria-label="add a force"') as dialog, ui.card().classes("df-dialog"):
        models = ForceList()
        models.props["groups"] = [
            {"title": title, "items": [_item(model) for model in members]}
            for title, members in grouped(df.forces.REGISTRY.values()).items()
        ]

    def taken(event: GenericEventArguments) -> None:
        if event.args in df.forces.REGISTRY:
            dialog.close()
            take(str(event.args))

    models.on("take", taken)
    dialog.on("hide", dialog.delete)


def _item(model: type[df.forces.Force]) -> dict[str, str]:
    return {"name": model.name, "title": name_of(model), "text": plain(first_sentence(model.__doc__ or ""))}
