"""A value with its error, as people write it: ``"2.7(2) N/m"``, ``"180(4)"``, or a pair of both."""

from __future__ import annotations

import re
from typing import NamedTuple

from dforce.core import units
from dforce.core.errors import ParameterError, UnitError, shorten
from dforce.findings.finding import with_error

WITH_ERROR = re.compile(r"\s*([+-]?\d+(?:\.(\d+))?)\((\d+(?:\.\d+)?)\)((?:[eE][+-]?\d{1,3})?)\s*(.*?)\s*")


class ValueWithError(NamedTuple):
    """A value in SI units, and its standard error; None where none is known."""

    value: float
    error: float | None


def measured(given: object, unit: str, name: str) -> ValueWithError:
    """Return a value with its error, of a number, a text with a unit, a text such as ``"2.7(2) N/m"``, or a pair.

    Raises
    ------
    ParameterError
        For anything else, and an error that is not above zero.
    """
    try:
        if isinstance(given, str) and (match := WITH_ERROR.fullmatch(given[:100])):
            number, places, error, power, written = match.groups()
            digits = 0 if "." in error else len(places or "")
            value = units.parse(f"{number}{power} {written}", unit)
            scale = units.parse(f"1{power} {written}", unit) - units.parse(f"0 {written}", unit)
            return _checked(ValueWithError(value, float(error) * 10.0**-digits * scale), name)
        if isinstance(given, tuple | list):
            if len(given) != 2:
                raise ParameterError(f"{name} = {shorten(given)} is not a pair of value and error")
            error_given = None if given[1] is None else units.parse(given[1], unit)
            return _checked(ValueWithError(units.parse(given[0], unit), error_given), name)
        return _checked(ValueWithError(units.parse(given, unit), None), name)
    except UnitError as problem:
        raise UnitError(f"{name} {problem}") from None


def _checked(found: ValueWithError, name: str) -> ValueWithError:
    if found.error is not None and found.error <= 0.0:
        raise ParameterError(f"{name} has an error that is not above 0")
    return found


def ends(given: object, unit: str, name: str, what: str) -> tuple[float, float]:
    """Return the two ends of a range in SI units, the lower first.

    Raises
    ------
    ParameterError
        For anything but a pair of quantities.
    """
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise ParameterError(f"{name} = {shorten(given)} is not the lowest and the highest {what}")
    try:
        low, high = sorted(units.parse(end, unit) for end in given)
    except UnitError as error:
        raise UnitError(f"{name} {error}") from None
    return low, high


def show(value: float, error: float | None, unit: str) -> str:
    """Return a value with its error for a sentence: ``29.98 ± 0.02 nm``."""
    if unit == "deg":
        return f"{value:.3f}°" if error is None else f"{value:.3f}° ± {error:.2g}°"
    if error is None:
        return units.show(value, unit, 5)
    return "{} ± {} {}".format(*with_error(value, error, unit)).rstrip()
