"""The numbers of a case that can be varied: those of its forces, and those of its sections that count."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import dforce as df
from dforce.core.notation import html_symbol
from dforce.gui.case.fields import Field, fields
from dforce.gui.case.values import shown
from dforce.gui.case.words import label_of
from dforce.gui.document.document import Document, Path
from dforce.problem import values_used

SHARED = ("sample", "contact", "tip", "medium")  # sections whose values count where a force uses them


@dataclass(frozen=True)
class ParameterRow:
    """A parameter: its name as a path of the case, where it stands in the document, label, symbol, and value as text."""

    name: str
    path: Path
    label: str
    symbol: str
    value: str


def rows_of(document: Document, sections: Sequence[str]) -> list[ParameterRow]:
    """Return the parameters of a document that hold one number with a unit, those of the forces first."""
    return [*_of_forces(document), *(row for name in sections for row in _of_section(document, name))]


def _of_forces(document: Document) -> Iterator[ParameterRow]:
    """Give the parameters of the forces that take part, by their models, or by their numbers where those are alike."""
    forces = document.value(("forces",)) or []
    on = [place for place in range(len(forces)) if place not in document.off]
    names = [str(forces[place].get("model")) for place in on]
    for number, (place, name) in enumerate(zip(on, names, strict=True), start=1):
        model = df.forces.REGISTRY.get(name)
        for field in fields(model) if model is not None else ():
            which = name if names.count(name) == 1 else str(number)
            yield from _row(document, ("forces", place, field.key), f"forces.{which}.{field.key}", field)


def _of_section(document: Document, section: str) -> Iterator[ParameterRow]:
    """Give the parameters of a section; those that only forces need, where one uses them."""
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
