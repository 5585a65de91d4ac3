"""A check: a number found, the number expected, how far apart they may be; parts of checks make a report."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Check:
    """A number compared with its expected value.

    Attributes
    ----------
    group, name
        The part of the validation, and the check in it.
    found, expected
        Both in `unit`; a disagreement has no expected value.
    unit
        SI unit, ``°`` or ``1``.
    error
        Their difference relative to the size that the check names, or the disagreement itself.
    limit
        The largest error that meets the check; None where the figure is only reported.
    source
        Source of the expected value, or the case with the disagreement.
    note
        Reason for the limit, where it is not the number of printed digits.
    """

    group: str
    name: str
    found: float
    expected: float | None
    unit: str
    error: float
    limit: float | None
    source: str = ""
    note: str = ""

    @property
    def met(self) -> bool:
        """Whether the error is within the limit."""
        return self.limit is None or bool(self.error <= self.limit)


@dataclass(frozen=True)
class ValidationPart:
    """A part of the validation.

    Attributes
    ----------
    name, title, text
        Its key, its heading, and a description.
    checks
        All checks.
    cases
        Case files by the names in the checks.
    """

    name: str
    title: str
    text: str
    checks: tuple[Check, ...]
    cases: dict[str, str]

    @property
    def missed(self) -> tuple[Check, ...]:
        """The checks that are not met."""
        return tuple(check for check in self.checks if not check.met)


def half_a_digit(text: str) -> float:
    """Return half a unit of the last digit of a number as written, relative to it.

    >>> half_a_digit("-2.5e-9")
    0.02
    """
    mantissa = text.lower().split("e")[0].lstrip("+-")
    decimals = len(mantissa.partition(".")[2])
    # slightly more, so that a value of exactly half a digit is within the limit
    return 0.5 * 10.0**-decimals / abs(float(mantissa)) * (1.0 + 1e-9) if float(mantissa) else math.inf


def deviation(found: float, expected: str, within: float | None = None, of: float | None = None) -> tuple[float, float]:
    """Return the error of a number against one as written, and its limit: half a unit of the last digit, or `within`.

    Both are relative to the expected value, or to the size `of`.
    """
    value = float(expected)
    size = abs(value) if of is None else of
    limit = half_a_digit(expected) * abs(value) / size if within is None else within
    return abs(found - value) / size, limit


def as_table(parts: tuple[ValidationPart, ...]) -> list[dict[str, Any]]:
    """Return the parts as plain data, for JSON."""
    return [
        {
            "name": part.name,
            "title": part.title,
            "text": part.text,
            "met": not part.missed,
            "checks": [{**vars(check), "met": check.met} for check in part.checks],
            "cases": part.cases,
        }
        for part in parts
    ]
