"""Sentences, menus and questions to a person."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Awaitable, Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.gui.document.store import why

log = logging.getLogger("dforce.gui")

UNKNOWN = "An error inside dForce, please report it."


def say(sentence: str) -> None:
    """Show a sentence until it has been read, or another one comes: of a group Quasar shows the last."""
    ui.notify(
        sentence,
        type="negative",
        multi_line=True,
        close_button="Close",
        timeout=60_000,
        group="sentence",
        badge_class="hidden",
    )


def as_sentence(words: str) -> str:
    """Return the words of an error as a sentence."""
    first = words.partition(" ")[0]
    is_name = any(sign in first for sign in "._=")  # of a file or a key: it stays as it is written
    return f"{words[:1] if is_name else words[:1].upper()}{words[1:]}{'' if words.endswith(('.', '?')) else '.'}"


@contextlib.contextmanager
def telling(failure: str) -> Iterator[None]:
    """Show a sentence on why the work inside failed; `failure` names it, such as "the file could not be opened"."""
    try:
        yield
    except df.DForceError as error:
        say(as_sentence(str(error)))
    except OSError as error:  # a full disk, say, or a folder that may not be written: nothing that dForce can mend
        say(as_sentence(f"{failure}: {why(error)}"))
    except Exception:  # a defect must not leave a person without a message
        log.exception(failure)
        say(UNKNOWN)


Item = tuple[str, str, Callable[[], object]]  # title, sentence (empty for none), function for a press


def menu(*groups: Iterable[Item], titles: Sequence[str] = ("",)) -> ui.menu:
    """Make the menu of the button that is the current container; arrow keys go through it.

    Each of several groups of items has a title.
    """
    with ui.menu().props("max-height=70vh") as made, ui.element("div").classes("df-menu").props("role=presentation"):
        for heading, items in zip(titles, groups, strict=True):
            with ui.element("div").props(f'role=group aria-label="{heading}"' if heading else "role=presentation"):
                if heading:
                    ui.label(heading).classes("df-menu-heading").props("aria-hidden=true")
                for title, sentence, press in items:
                    # the roles of a menu, where Quasar has the roles of a list
                    with ui.menu_item(on_click=press).props("role=menuitem"), ui.element("div"):
                        ui.label(title).classes("df-menu-title")
                        if sentence:
                            ui.label(sentence).classes("df-menu-text")
    return made


@contextlib.contextmanager
def dialog(name: str, look: str = "") -> Iterator[ui.dialog]:
    """Open a dialog with a name for screen readers and the elements made inside; it goes once it is closed."""
    with ui.dialog(value=True) as made, ui.card().classes(f"df-dialog {look}"):
        made.props["aria-label"] = name
        yield made
    made.on("hide", made.delete, js_handler="() => { window.dforceFocus.back(); emit(); }")


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
    """Ask, and call `save` with the answers; the answer of a choice is always among its values.

    `why` is a sentence above the questions, which then have room for longer words; `button` sends the answers.
    """
    with dialog(title) as made:
        form = SaveForm()
        form.props.update(title=title, fields=list(fields), why=why, button=button)

    async def answered(event: GenericEventArguments) -> None:
        given = [str(value)[:LONGEST] for value in event.args][: len(fields)]
        allowed = (
            "options" not in field or value in [option["value"] for option in field["options"]]
            for field, value in zip(fields, given, strict=True)
        )
        if all(allowed):
            made.close()
            await save(*given)

    form.on("save", answered)
    form.on("cancel", made.close)
