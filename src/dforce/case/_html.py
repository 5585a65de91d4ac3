"""A case as a table for a notebook: every parameter with its symbol, value, unit and meaning."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping
from typing import Any

from dforce.core import units
from dforce.core.notation import html_symbol
from dforce.core.parameters import Parameters
from dforce.forces import Force

LEFT = 'style="text-align: left"'


def html_of(title: str, shows: str, sections: Mapping[str, object]) -> str:
    """Return a case as HTML; text that a user wrote is escaped, and defaults are gray."""
    head = f"<strong>{html.escape(title)}</strong>" if title else ""
    below = f"<br>{html.escape(shows)}" if shows else ""
    rows = "".join(row for name, content in sections.items() for row in _section(name, content))
    return f"<div>{head}{below}<table><tbody>{rows}</tbody></table></div>"


def _section(name: str, content: Any) -> Iterator[str]:
    """Give the heading and the rows of a section, and of each part of it."""
    if isinstance(content, tuple):
        for number, part in enumerate(content, start=1):
            label = part.name if isinstance(part, Force) else str(number)
            yield from _section(f"{name}.{label}", part)
        return
    if content is None:
        return
    parts, rows = [], []
    for key in content.keys():  # noqa: SIM118 the method of Parameters
        value = getattr(content, key)
        if isinstance(value, Parameters) or (isinstance(value, tuple) and value and isinstance(value[0], Parameters)):
            parts.append((key, value))
        elif value is not None and value != () and value != "":
            rows.append(_row(content, key, value))
    if rows or isinstance(content, Force):  # a force may take all it needs from the instrument
        yield f'<tr><th colspan="4" {LEFT}>{html.escape(name)}</th></tr>'
        yield from rows
    for key, value in parts:
        yield from _section(f"{name}.{key}", value)


def _row(owner: Parameters, key: str, value: Any) -> str:
    quantity = owner.quantities().get(key)
    description = (type(owner).model_fields[key].description or "").replace("`", "")
    symbol = f"<i>{html_symbol(quantity.symbol)}</i>" if quantity is not None and quantity.symbol else ""
    gray = "" if key in owner.model_fields_set else "; opacity: 0.6"
    cells = (
        html.escape(key),
        symbol,
        html.escape(_shown(value, quantity.unit if quantity else "")),
        html.escape(description),
    )
    return "<tr>" + "".join(f'<td style="text-align: left{gray}">{cell}</td>' for cell in cells) + "</tr>"


def _shown(value: object, unit: str) -> str:
    if isinstance(value, tuple):
        first = ", ".join(_shown(item, unit) for item in value[:3])
        return f"{first}, ... ({len(value)} values)" if len(value) > 3 else first
    if isinstance(value, float) and unit:
        return units.show(value, unit)
    return str(value).lower() if isinstance(value, bool) else str(value)
