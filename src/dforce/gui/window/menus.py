"""Menus: each item with a title, and a sentence below it."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from nicegui import ui

Item = tuple[str, str, Callable[[], object]]  # title, sentence (empty for none), what a press does


def menu(items: Iterable[Item]) -> ui.menu:
    """Make the menu of the button that is the current container; arrow keys go through it."""
    with ui.menu().props("max-height=70vh") as made, ui.element("div").classes("df-menu").props("role=presentation"):
        for title, sentence, press in items:
            # the roles of a menu, where Quasar has those of a list
            with ui.menu_item(on_click=press).props("role=menuitem"), ui.element("div"):
                ui.label(title).classes("df-menu-title")
                if sentence:
                    ui.label(sentence).classes("df-menu-text")
    return made
