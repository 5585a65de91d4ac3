"""Tables of the declarations of parameters: unit, default, bounds, meaning."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any, get_args

import dforce as df
from dforce.core.parameters import Parameters

SIGNS = {"low": "≥", "above": ">", "high": "≤", "below": "<"}


def list_table(header: Sequence[str], rows: Iterable[Sequence[str]], widths: str = "auto") -> str:
    """Return a table in reStructuredText."""
    lines = [".. list-table::", "   :header-rows: 1", "   :class: wide", f"   :widths: {widths}", ""]
    for row in (header, *rows):
        for place, cell in enumerate(row):
            lines.append(f"   {'*' if place == 0 else ' '} - {cell}".rstrip())
    return "\n".join(lines) + "\n"


def plain(text: str) -> str:
    """Return a sentence for a page, whose first initials would else be taken for the numbers of a list: "K. L. Johnson"."""
    return re.sub(r"^(?=\w+[.)]\s)", r"\\", text)


def parameter_table(model: type[Parameters], keys: Iterable[str]) -> str:
    """Return the table of a class's own parameters."""
    rows = [_row(model, key) for key in keys]
    return list_table(("key", "symbol", "unit of a number", "default", "allowed", "meaning"), rows)


def _row(model: type[Parameters], key: str) -> tuple[str, ...]:
    field, quantity = model.model_fields[key], model.quantities().get(key)
    symbol = f":math:`{quantity.symbol}`" if quantity is not None and quantity.symbol else ""
    unit = quantity.unit if quantity is not None else ""
    default = "*required*" if field.is_required() else shown(field.default)
    return f"``{key}``", symbol, "–" if unit == "1" else unit, default, _allowed(model, key), field.description or ""


def _allowed(model: type[Parameters], key: str) -> str:
    field, quantity = model.model_fields[key], model.quantities().get(key)
    choices = ", ".join(shown(choice) for choice in _choices(field.annotation))
    if quantity is not None:
        bounds = [(sign, getattr(quantity, name)) for name, sign in SIGNS.items()]
    else:
        limits = {"low": "ge", "above": "gt", "high": "le", "below": "lt"}
        found = {name: value for item in field.metadata for name, value in _limits(item, limits)}
        bounds = [(sign, found.get(name)) for name, sign in SIGNS.items()]
    numbers = " and ".join(f"{sign} {_bound(value)}" for sign, value in bounds if value is not None)
    return ", or ".join(text for text in (choices, numbers) if text)


def _limits(item: Any, names: dict[str, str]) -> Iterable[tuple[str, Any]]:
    return [(name, getattr(item, short)) for name, short in names.items() if hasattr(item, short)]


def _choices(annotation: Any) -> Iterable[Any]:
    for part in get_args(annotation):
        if isinstance(part, str | int) and not isinstance(part, bool):
            yield part
        else:
            yield from _choices(part)


def _bound(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else f"{value:,}" if isinstance(value, int) else str(value)


def shown(value: Any) -> str:
    """Return a value as it is typed in a case file."""
    if value is None or value in ((), ""):
        return "*left out*"
    if isinstance(value, bool):
        return f"``{str(value).lower()}``"
    if isinstance(value, float):
        return f"``{value:g}``"
    if isinstance(value, Parameters):
        return f"see {type(value).section()}"
    return f"``{value}``"


def instrument_meaning(path: str) -> str:
    """Return the meaning of a shared parameter, from the instrument's own declaration."""
    section, key = path.split(".")
    if (section, key) == ("contact", "E_eff"):
        return "effective modulus, from the moduli and Poisson's ratios of tip and sample"
    owner = {"tip": df.Tip, "sample": df.Sample, "contact": df.Contact, "cantilever": df.Mode, "medium": df.Medium}[
        section
    ]
    return owner.model_fields[key].description or ""
