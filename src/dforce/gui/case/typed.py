"""What people type into a field, as the text of a case: decimal commas, units, plain numbers."""

from __future__ import annotations

import re

import dforce as df
from dforce.core.errors import shorten
from dforce.core.units import parse, split_unit

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
