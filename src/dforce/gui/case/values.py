"""Between the values of a document and the texts of fields: decimal commas, units, plain numbers, and mistakes."""

from __future__ import annotations

import math
import re
from typing import Any

import dforce as df
from dforce.core import units
from dforce.core.errors import shorten
from dforce.core.units import parse, show, split_unit, unit_choices
from dforce.gui.case.fields import Field, Shape
from dforce.gui.document import bounds

NEEDED = "this needs a value"
# numbers that stay texts, as :func:`read` says
TOO_LARGE = re.compile(r"[+-]?\d{19,}|[+-]?\d+(\.\d*)?[eE]\+?\d+")
COMMA = re.compile(r"\s*([+-]?)(\d*),(\d+)((?:[eE][+-]?\d+)?)(.*)", re.DOTALL)


def with_point(text: str) -> str:
    """Return a text with a decimal point in the place of a decimal comma.

    Raises
    ------
    ParameterError
        For a comma that could as well separate thousands.
    """
    match = COMMA.fullmatch(text)
    if match is None:
        return text.strip()
    sign, whole, decimals, exponent, rest = match.groups()
    if len(decimals) == 3 and whole.strip("0") and len(whole) <= 3:
        raise df.ParameterError(
            f"is {shorten(text, 40)}, where the comma may mean a decimal point or thousands; write it without comma"
        )
    return f"{sign}{whole or '0'}.{decimals}{exponent}{rest}".strip()


def composed(text: str, unit: str) -> str:
    """Return number and unit as a text of a case; a unit that was typed wins over the one shown."""
    number = with_point(text)
    parts = split_unit(number)
    if parts is None or parts[1] or unit in ("", "1"):
        return number
    return f"{number} {unit}"


def taken_apart(text: str, unit: str) -> tuple[str, str]:
    """Return the number and the unit that a field shows for a text of a case; `unit` where it has none."""
    parts = split_unit(text)
    if parts is None:
        return text, unit
    return parts[0], parts[1] or unit


def fits(unit: str, stored: str) -> bool:
    """Return whether a unit is one of the quantity that is stored in another."""
    try:
        parse(f"1 {unit}", stored)
    except df.ParameterError:
        return False
    return True


def in_unit(text: str, old: str, new: str, stored: str) -> str:
    """Return a number in another unit, the same quantity: 10 (nm) is 0.01 (um); a text that is none stays."""
    try:
        value = parse(composed(text, old), stored)
        scale = parse(f"1 {new}", stored) - parse(f"0 {new}", stored)
        offset = parse(f"0 {new}", stored)
    except df.ParameterError:
        return text
    return f"{(value - offset) / scale:.12g}"


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
    text, own = taken_apart(value, unit)
    # a unit that is wrong or half typed stays in the text: the next number must not inherit it
    return (text, own) if own == unit or fits(own, field.unit) else (value, unit)


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
            return composed(text, unit)
        if shape.kind == "numbers":
            return [composed(part, unit) for part in text.split(";") if part.strip()]
        number = with_point(text)
        meant = int(number) if shape.kind == "whole" else float(number)
        return meant if abs(meant) < bounds.WHOLE else text  # what cannot be kept as a number stays as it was typed
    except (ValueError, df.ParameterError):
        return text


def check(field: Field, shape: Shape, value: Any) -> str:
    """Return what is wrong with a value by itself, as a sentence; empty when nothing is.

    Whether the values make sense together is for the case as a whole to say.
    """
    if value in (None, ""):
        return NEEDED if field.required else ""
    try:
        if field.quantity is not None and shape.kind == "quantity":
            field.quantity.check(parse(_pointed(value), field.quantity.unit))
        elif field.quantity is not None and shape.kind == "numbers" and isinstance(value, list):
            for item in value:
                field.quantity.check(parse(_pointed(item), field.quantity.unit))
        elif shape.kind in ("whole", "number") and isinstance(value, str):
            words = (
                "is too large" if TOO_LARGE.fullmatch(value) else f"is not a {'whole ' * (shape.kind == 'whole')}number"
            )
            return f"{shorten(value, 40)} {words}"
        elif shape.kind == "number" and not math.isfinite(value):
            return "this is not a finite number"
    except df.ParameterError as error:
        words = str(error)
        return words.removeprefix("= ") if words.startswith("= ") else f"this {words}"
    return ""


def _pointed(value: object) -> Any:
    return with_point(value) if isinstance(value, str) else value
