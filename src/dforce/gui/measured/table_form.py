"""The dialog that reads a measured table: its head, the quantity of each column, signs, and the curve drawn small."""

from __future__ import annotations

import copy
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

from dforce.gui.measured.reading import AMPLITUDES, HEIGHTS, PHASES, UNITS, Place, with_answers
from dforce.gui.window.dialogs import LONGEST, Field
from dforce.inverse.heads import FileHead, HeadColumn

ROWS = 5  # of the head
MOST_POINTS = 300  # of the small curve
NEEDED = ("height", "amplitude", "phase")
CONVENTION, SENSITIVITY = ("phase_convention",), ("read", "sensitivity")
AMPLITUDE_IS, HEIGHT_GROWS = ("read", "amplitude_is"), ("read", "height_grows")


class TableForm(ui.element, component="table_form.js"):
    """What the dialog shows."""


def ask_table(
    title: str,
    why: str,
    head: FileHead,
    settings: Mapping[str, Any],
    more: Mapping[Place, Field],
    read: Callable[[dict[str, Any]], Awaitable[None]],
) -> None:
    """Ask how a table is read, and call `read` with the settings of `[data]` that say so.

    Parameters
    ----------
    title, why
        Above the table: the name of the file, and a sentence on what is missing or wrong.
    head
        The columns, with their guesses.
    settings
        What is answered already, as keys of a table `[data]`.
    more
        Questions beside those of the table, by where their answers belong.
    """
    with ui.dialog() as dialog, ui.card().classes("df-dialog df-table-dialog"):
        form = TableForm()
        form.props.update(title=title, why=why, **_shown(head, settings, more))

    async def answered(event: GenericEventArguments) -> None:
        dialog.close()
        await read(told(head, settings, list(more), event.args))

    form.on("read", answered)
    form.on("cancel", dialog.close)
    dialog.on("hide", dialog.delete)
    dialog.open()


def _shown(head: FileHead, settings: Mapping[str, Any], more: Mapping[Place, Field]) -> dict[str, Any]:
    """Return the properties of the form: guesses, over them what is answered already."""
    named = {name: quantity for quantity, name in dict(settings.get("columns") or {}).items()}
    units, read = dict(settings.get("units") or {}), dict(settings.get("read") or {})
    columns: list[dict[str, Any]] = []
    for one in head.columns:
        role = named.get(head.name_of(one), one.quantity if one.quantity not in named.values() else "")
        columns.append(
            {
                "name": one.name,
                "unit": one.unit or "",
                "typed": str(units.get(role) or UNITS.get(role, "nm")),
                "role": role,
                "sure": one.sure and role == one.quantity,
                "numbers": _few(one),
                "cells": [row[len(columns)] for row in head.rows(ROWS)],
            }
        )
    return {
        "columns": columns,
        "needed": list(NEEDED),
        "phases": PHASES,
        "convention": str(settings.get("phase_convention") or head.phase_convention or ""),
        "heights": HEIGHTS,
        "grows": str(read.get("height_grows") or head.height_grows or ""),
        "amplitudes": AMPLITUDES,
        "amplitude": str(read.get("amplitude_is") or head.amplitude_is or ""),
        "sensitivity": str(read.get("sensitivity") or ""),
        "more": [{**field, "value": _answered(settings, place) or field["value"]} for place, field in more.items()],
    }


def _answered(settings: Mapping[str, Any], place: Place) -> str:
    """Return what stands in settings at a place as text; empty where there is nothing."""
    found: Any = settings
    for key in place:
        found = found.get(key) if isinstance(found, Mapping) else None
    return "" if found is None else str(found)


def _few(column: HeadColumn) -> list[float | None]:
    """Return the numbers of a column for the small curve; empty for words."""
    if column.values.dtype.kind != "f":
        return []
    step = -(-len(column.values) // MOST_POINTS)
    return [float(value) if np.isfinite(value) else None for value in column.values[::step]]


def told(
    head: FileHead, settings: Mapping[str, Any], more: Sequence[Place], answer: Mapping[str, Any]
) -> dict[str, Any]:
    """Return settings with what a person chose; what a reader does by itself is not named."""
    found = copy.deepcopy(dict(settings))
    found.pop("columns", None)
    found.pop("units", None)
    roles = [str(role) for role in answer["roles"]]
    for one, role, unit in zip(head.columns, roles, answer["units"], strict=True):
        if not role or roles.count(role) > 1:
            continue
        if not (one.sure and role == one.quantity):
            found.setdefault("columns", {})[role] = head.name_of(one)
        if not one.unit and role in NEEDED and str(unit).strip():
            found.setdefault("units", {})[role] = str(unit).strip()[:LONGEST]
    places: list[Place] = [CONVENTION, *more]
    answers = [str(answer["convention"]), *map(str, answer["more"])]
    grows, amplitude = str(answer["grows"]), str(answer["amplitude"])
    if grows == "toward" or grows != head.height_grows:
        places, answers = [*places, HEIGHT_GROWS], [*answers, grows]
    if amplitude and amplitude != head.amplitude_is:
        places, answers = [*places, AMPLITUDE_IS], [*answers, amplitude]
    if str(answer["sensitivity"]).strip():
        places, answers = [*places, SENSITIVITY], [*answers, str(answer["sensitivity"])]
    return with_answers(found, places, [text[:LONGEST] for text in answers])
