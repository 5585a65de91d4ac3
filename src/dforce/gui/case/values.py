"""Numbers of a case as texts of fields, and the other way: decimal commas, units, mistakes, and the rows that can be varied."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import dforce as df
from dforce.core import units
from dforce.core.errors import shorten
from dforce.core.notation import html_symbol
from dforce.core.units import parse, show, split_unit, unit_choices
from dforce.gui.case.fields import Field, Shape, fields, label_of
from dforce.gui.document.document import WHOLE, Document, Path
from dforce.instrument.shared import values_used

NEEDED = "this needs a value"
# numbers that stay texts, see :func:`read`
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
    text, own = taken_apart(value, unit if split_unit(value) is None else field.unit)  # a number alone is in SI
    # a unit that is wrong or half typed stays in the text: the next number must not inherit it
    return (text, own) if own == unit or fits(own, field.unit) else (value, unit)


def nominal_value(document: Document, path: Path) -> float | None:
    """Return the value (SI) of an empty field of a cantilever by name; None where it has none.

    It is from the library, unless the name is from the user's own file. A missing Q is from the medium.
    """
    section, *key = path
    if section != "cantilever" or key not in (["f0"], ["k"], ["Q"], ["tip_radius"]):
        return None
    given = document.value(("cantilever",))
    given = given if isinstance(given, dict) else {"name": given}  # a link may have a text alone
    probe = df.cantilevers().get(str(given.get("name"))) if given.get("library") is None else None
    value: float | None = getattr(probe, str(key[0]), None)
    if value is None and probe is not None and key == ["Q"]:
        with contextlib.suppress(df.DForceError, TypeError):  # the case is typed halfway
            return float(f"{document.case().problem.modes[0].Q:.3g}")
    return value


def usual_unit(field: Field) -> str:
    """Return the unit that an empty field shows: the unit of its default or bounds, unless they are in plain SI."""
    declared = [field.default, *((field.quantity.low, field.quantity.above) if field.quantity is not None else ())]
    written = [parts[1] for text in declared if isinstance(text, str) and (parts := split_unit(text))]
    return next((unit for unit in written if unit not in ("", field.unit)), units.usual_unit(field.unit))


def units_of(field: Field, unit: str) -> list[str]:
    """Return the units to choose from, the one shown among them."""
    known = [*unit_choices(field.unit)]
    return known if unit in known else [unit, *known]


def read(field: Field, shape: Shape, text: str, unit: str) -> Any:
    """Return the value of a typed text for the document; text without a value yet stays as it is."""
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
        return meant if abs(meant) < WHOLE else text  # input that cannot be kept as a number stays text
    except (ValueError, df.ParameterError):
        return text


def check(field: Field, shape: Shape, value: Any) -> str:
    """Return the error of a value by itself, as a sentence; empty without one.

    The check of the case as a whole covers the values together.
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


SHARED = ("sample", "contact", "tip", "medium")  # sections whose values count where a force uses them


@dataclass(frozen=True)
class ParameterRow:
    """A parameter: its name as a path of the case, its path in the document, label, symbol, and value as text."""

    name: str
    path: Path
    label: str
    symbol: str
    value: str


def rows_of(document: Document, sections: Sequence[str]) -> list[ParameterRow]:
    """Return the parameters of a document that are one number with a unit, the forces' parameters first."""
    return [*_of_forces(document), *(row for name in sections for row in _of_section(document, name))]


def _of_forces(document: Document) -> Iterator[ParameterRow]:
    """Give the parameters of the forces that take part, by their models, or by their numbers where models are alike."""
    forces = document.value(("forces",)) or []
    on = [place for place in range(len(forces)) if place not in document.off]
    names = [str(forces[place].get("model")) for place in on]
    for number, (place, name) in enumerate(zip(on, names, strict=True), start=1):
        model = df.forces.REGISTRY.get(name)
        for field in fields(model) if model is not None else ():
            which = name if names.count(name) == 1 else str(number)
            yield from _row(document, ("forces", place, field.key), f"forces.{which}.{field.key}", field)


def _of_section(document: Document, section: str) -> Iterator[ParameterRow]:
    """Give the parameters of a section; parameters for forces only if a force uses them."""
    models = [df.forces.REGISTRY.get(str(force.get("model"))) for force in document.value(("forces",)) or []]
    used = values_used(model for model in models if model is not None)
    for field in fields(df.Case.model_fields[section].annotation):  # type: ignore[arg-type]
        name = f"{section}.{field.key}"
        if section not in SHARED or name in used:
            yield from _row(document, (section, field.key), name, field)


def _row(document: Document, path: Path, name: str, field: Field) -> Iterator[ParameterRow]:
    """Give the row of a field that holds one number with a unit, as typed or by default."""
    value = document.value(path)
    value = field.default if value is None else value
    if field.quantity is None or value is None or isinstance(value, Mapping | list | tuple):
        return
    text, unit = shown(field, value)
    words = f"{text} {'' if unit == '1' else unit}".strip()
    yield ParameterRow(name, path, label_of(document, path) or name, html_symbol(field.symbol), words)
