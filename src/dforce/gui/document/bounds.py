"""What a document that comes from a file may hold: plain values of a size that forms can show and files can keep.

Each function returns what it was given where that is within its bounds.

Raises
------
ValueError, TypeError
    When it is not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

LARGEST = 1e100  # of a number on a slider, so that no step of one overflows
WHOLE = 2**63  # whole numbers are below, as in TOML
LONGEST_TEXT = 4000  # characters; those of a case are no longer
MOST_ITEMS = 100  # of a list of tables: modes, tones, forces
MOST_VALUES = 600_000  # of a table with all that is in it; the text of a case has room for fewer
DEEPEST = 12  # tables in tables


def number(given: object, low: float, high: float) -> float:
    """Return a finite number within bounds."""
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise TypeError("no number")
    if not low <= given <= high:  # NaN is not, either
        raise ValueError("a number out of bounds")
    return float(given)


def whole(given: object, low: int, high: int) -> int:
    """Return a whole number within bounds."""
    if isinstance(given, bool) or not isinstance(given, int):
        raise TypeError("no whole number")
    if not low <= given <= high:
        raise ValueError("a whole number out of bounds")
    return given


def text(given: object, longest: int) -> str:
    """Return a text that is not too long and can be written."""
    if not isinstance(given, str):
        raise TypeError("no text")
    given.encode()  # half of a surrogate pair cannot be: that is a ValueError
    if len(given) > longest:
        raise ValueError("a text that is too long")
    return given


def items(given: object, most: int) -> list[Any]:
    """Return a list that is not too long."""
    if not isinstance(given, list | tuple):
        raise TypeError("no list")
    if len(given) > most:
        raise ValueError("a list that is too long")
    return list(given)


def path(given: object) -> tuple[str | int, ...]:
    """Return the path of a value in a document."""
    steps = items(given, DEEPEST)
    return tuple(text(step, 100) if isinstance(step, str) else whole(step, 0, MOST_ITEMS) for step in steps)


def table(given: object) -> dict[str, Any]:
    """Return a copy of a table of a case as it was typed: tables, lists, texts, numbers, true and false."""
    if not isinstance(given, Mapping):
        raise TypeError("no table")
    left = [MOST_VALUES]
    copied: dict[str, Any] = _value(given, DEEPEST, left)
    return copied


def _value(given: object, depth: int, left: list[int]) -> Any:
    left[0] -= 1
    if left[0] < 0 or depth < 0:
        raise ValueError("a table that is too large")
    if isinstance(given, Mapping):
        return {text(key, 300): _value(value, depth - 1, left) for key, value in given.items()}
    if isinstance(given, list | tuple):
        if given and isinstance(given[0], Mapping):
            items(given, MOST_ITEMS)
        return [_value(value, depth - 1, left) for value in given]
    if isinstance(given, str):
        return text(given, LONGEST_TEXT)
    if isinstance(given, bool) or given is None:
        return given
    if isinstance(given, int):
        return whole(given, -WHOLE, WHOLE - 1)
    if not isinstance(given, float) or not math.isfinite(given):
        raise ValueError("no number")
    return given
