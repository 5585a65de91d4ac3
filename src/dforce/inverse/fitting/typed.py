"""Numbers that a user of a fit types: text with units, values with errors."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from dforce.core import units
from dforce.core.errors import ParameterError, UnitError, shorten
from dforce.findings.finding import DEGREE

BRIEF = re.compile(r"\s*([+-]?\d+(?:\.(\d+))?)\((\d+)\)((?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)  # such as 180(4) Hz


def number_of(name: str, given: object, unit: str) -> float:
    """Return the SI value (degrees of phases) of a number or a text with a unit.

    Raises
    ------
    ParameterError
        With the name of what was given, where it is no such number.
    """
    try:
        if unit != DEGREE:
            return units.parse(given, unit)
        if isinstance(given, str):
            return math.degrees(units.parse(given, "rad"))
        return units.parse(given, "1")
    except UnitError as error:
        raise ParameterError(f"{name} {error}") from None


def value_and_error(name: str, given: object, unit: str) -> tuple[float, float]:
    """Return value and standard deviation of a prior: a pair, or text such as ``"2.70(15) N/m"``.

    Raises
    ------
    ParameterError
        Where it is neither, or the error is not above 0.
    """
    if isinstance(given, str):
        match = BRIEF.fullmatch(given)
        if match is None:
            raise ParameterError(f"{name} = '{shorten(given)}' has no error; write value and error, such as 180(4)")
        digits, decimals, last, power, written = match.groups()
        value = number_of(name, f"{digits}{power} {written}", unit)
        # the digits in brackets stand under the last ones of the value
        error = number_of(name, f"{int(last)}e{-len(decimals or '')} {written}", unit) * 10.0 ** int(power[1:] or 0)
    elif isinstance(given, Sequence) and len(given) == 2:
        value, error = (number_of(name, part, unit) for part in given)
    else:
        raise ParameterError(f"{name} = {shorten(given)} is not a value with its error, such as [180, 4] or '180(4)'")
    if not error > 0.0:
        raise ParameterError(f"{name} has the error {error:g}; it must be above 0")
    return value, error


def with_unit(value: float, unit: str) -> str:
    """Return a value with its unit, as sentences print it."""
    if not math.isfinite(value):
        return f"{value:g}"
    return f"{value:g} deg" if unit == DEGREE else units.show(value, unit, 5)
