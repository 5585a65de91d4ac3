"""A line of a summary, and how its number is written."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dforce.core.listing import Listing, aligned, html_table
from dforce.core.quantities import NONE
from dforce.core.units import reader_unit
from dforce.results.dataset import unit_for

DIGITS = 3  # of computed numbers: the default accuracy promises them, and not always another digit
GIVEN_DIGITS = 5  # of a user's values, and of frequencies: they distinguish a narrow resonance from the drive
GIVEN = ("zc", "frequency", "distance", "free_amplitude")
LEAST = 0.001
FINEST = 7  # place, counted from its first digit, beyond which no digit of a value is written, however small its error
DEGREE = "degree"  # unit of phases in results, an angle for the parser of units


@dataclass(frozen=True)
class Finding:
    """A line of a summary: a label, with its value as text for a reader and as an SI number for a program."""

    name: str
    label: str
    text: str
    value: float | list[float] | None
    unit: str
    direction: str = ""


class Findings(Listing[Finding]):
    """The result of :func:`dforce.summary`: a list, shown as a table with a column for each direction."""

    def rows(self) -> list[tuple[str, ...]]:
        """Return a row for each label, with a text for each direction; where there are several, the first names them."""
        ways = list(dict.fromkeys(finding.direction for finding in self))
        rows: dict[str, dict[str, str]] = {}
        for finding in self:
            rows.setdefault(finding.label, {})[finding.direction] = finding.text
        body = [(label, *(texts.get(way, "") for way in ways)) for label, texts in rows.items()]
        return [("", *ways), *body] if len(ways) > 1 else body

    def as_text(self) -> str:
        """Return the rows in columns."""
        return aligned(self.rows()) or "nothing found"

    def as_html(self) -> str:
        """Return the rows as a table."""
        return html_table(self.rows())


def number(value: float, unit: str, name: str = "", none: bool = False, size: float | None = None) -> str:
    """Return an SI number for a reader, with the digits that are known: ``218 pN``, ``54.2°``, ``10.4 %``.

    With `none` the text is "none". The unit suits a value of the `size`, by default the number itself.
    """
    if not np.isfinite(value):
        return "-"
    if none:
        return NONE
    if value == 0.0:
        return "0"
    scale, shown = unit_for(abs(value) if size is None else size, unit, name)
    suffix = "" if shown == "1" else shown if shown == "°" else f" {shown}"
    if abs(value) < LEAST * scale and unit != "1":  # below the smallest unit that anyone uses
        return f"< {LEAST}{suffix}"
    if shown == "1" and float(value).is_integer():
        return f"{value:.0f}"  # a count
    digits = GIVEN_DIGITS if unit == "Hz" or name.startswith(GIVEN) else DIGITS
    return f"{float(f'{value / scale:.{digits}g}'):.{GIVEN_DIGITS}g}{suffix}"  # 1230, not 1.23e+03


def finding(
    name: str, label: str, value: float, unit: str, way: str = "", more: str = "", none: bool = False
) -> Finding:
    """Return the line of a number; `more` is text behind it."""
    text = number(value, unit, name, none) + more * (not none)
    return Finding(name, label, text, value if np.isfinite(value) else None, unit, way)


def with_error(value: float, error: float, unit: str) -> tuple[str, str, str]:
    """Return value, error and unit as text, with two digits of the error where both have these places; "none" if unknown."""
    if unit == DEGREE or not math.isfinite(value):
        scale, name = 1.0, "deg" if unit == DEGREE else unit
    else:
        scale, name = reader_unit(abs(value) if value else error, unit)
    value, error = value / scale, error / scale
    name = "" if name == "1" else name
    known = math.isfinite(error) and error > 0.0
    if not math.isfinite(value):
        return "none", "none", name
    power = math.floor(math.log10(abs(value))) if value else 0
    ending = ""
    if abs(value) >= 1e5 or 0.0 < abs(value) < 1e-3:
        value, error, ending = value / 10.0**power, error / 10.0**power, f"e{power:+03d}"
    if not known:
        return f"{value:.5g}{ending}", "none", name
    first = math.floor(math.log10(abs(value))) if value else -FINEST
    digits = max(min(1 - math.floor(math.log10(error)), FINEST - first), 0)
    told = f"{error:.{digits}f}"
    return f"{value:.{digits}f}{ending}", f"{told if float(told) else f'{error:.1g}'}{ending}", name
