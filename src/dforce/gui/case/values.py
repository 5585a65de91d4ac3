"""Between the values of a document and the texts of fields."""

from __future__ import annotations

from typing import Any

import dforce as df
from dforce.core import units
from dforce.core.units import show, split_unit, unit_choices
from dforce.gui.case import typed
from dforce.gui.case.fields import Field, Shape
from dforce.gui.document import bounds


def shown(field: Field, value: object) -> tuple[str, str]:
    """Return text and unit that a field shows for a value of the document."""
    unit = usual_unit(field)
    if value is None or value == ():
        return "", unit
    if isinstance(value, list | tuple):
        parts = [shown(field, item) for item in value]
        same = all(part[1] == parts[0][1] for part in parts)
        text = "; ".join(part[0] if same else " ".join(part) for part in parts)
        return text, parts[0][1] if parts else unit
    if not isinstance(value, str):
        if not isinstance(value, int | float) or isinstance(value, bool):
            return "", unit
        value = show(float(value), field.unit)
    text, own = typed.taken_apart(value, unit)
    # a unit that is wrong or half typed stays in the text: the next number must not inherit it
    return (text, own) if own == unit or typed.fits(own, field.unit) else (value, unit)


def usual_unit(field: Field) -> str:
    """Return the unit that an empty field shows: that of its default or bounds, where they do not stand in plain SI."""
    declared = [field.default, *((field.quantity.low, field.quantity.above) if field.quantity is not None else ())]
    written = [parts[1] for text in declared if isinstance(text, str) and (parts := split_unit(text))]
    return next((unit for unit in written if unit not in ("", field.unit)), units.usual_unit(field.unit))


def units_of(field: Field, unit: str) -> list[str]:
    """Return the units to choose from, the one shown among them."""
    known = [*unit_choices(field.unit)]
    return known if unit in known else [unit, *known]


def read(field: Field, shape: Shape, text: str, unit: str) -> Any:
    """Return what a typed text means as a value of the document; text that means nothing yet stays as it is."""
    text = text.strip() if shape.kind != "text" else text
    if text == "":
        return None
    if shape.kind == "switch":
        return text == "true"
    if shape.kind == "text":
        return text
    try:
        if shape.kind == "quantity":
            return typed.composed(text, unit)
        if shape.kind == "numbers":
            return [typed.composed(part, unit) for part in text.split(";") if part.strip()]
        number = typed.with_point(text)
        meant = int(number) if shape.kind == "whole" else float(number)
        return meant if abs(meant) < bounds.WHOLE else text  # what cannot be kept as a number stays as it was typed
    except (ValueError, df.ParameterError):
        return text
