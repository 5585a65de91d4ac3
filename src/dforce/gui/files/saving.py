"""The dialog that asks how something is saved, or what a file does not tell."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

LONGEST = 200  # characters of an answer

Field = dict[str, Any]  # a question


class SaveForm(ui.element, component="save.js"):
    """The questions of the dialog."""


def choice(label: str, words: Mapping[str, str]) -> Field:
    """Return a question with some answers, by value; the first one is suggested."""
    options = [{"value": value, "label": text} for value, text in words.items()]
    return {"label": label, "options": options, "value": options[0]["value"]}


def text(label: str, suggested: str) -> Field:
    """Return a question that is answered in words."""
    return {"label": label, "value": suggested}


def ask(
    title: str, fields: Sequence[Field], save: Callable[..., Awaitable[None]], *, why: str = "", button: str = "Save"
) -> None:
    """Ask, and call `save` with the answers; those of a choice are always among its values.

    `why` is a sentence above the questions, which then have room for longer words; `button` sends the answers.
    """
    with ui.dialog() as dialog, ui.card().classes("df-dialog"):
        form = SaveForm()
        form.props.update(title=title, fields=list(fields), why=why, button=button)

    async def answered(event: GenericEventArguments) -> None:
        given = [str(value)[:LONGEST] for value in event.args][: len(fields)]
        allowed = (
            "options" not in field or value in [option["value"] for option in field["options"]]
            for field, value in zip(fields, given, strict=True)
        )
        if all(allowed):
            dialog.close()
            await save(*given)

    form.on("save", answered)
    form.on("cancel", dialog.close)
    dialog.on("hide", dialog.delete)
    dialog.open()
