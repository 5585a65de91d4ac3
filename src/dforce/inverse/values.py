"""Values as typed or read: numbers with a unit, and values with an error, ``"2.7(2) N/m"``, ``"180(4)"`` or a pair."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from dforce.core import units
from dforce.core.errors import ParameterError, UnitError, shorten
from dforce.findings.finding import DEGREE, with_error

WITH_ERROR = re.compile(r"\s*([+-]?\d+(?:\.(\d+))?)\((\d+(?:\.\d+)?)\)((?:[eE][+-]?\d{1,3})?)\s*(.*?)\s*", re.DOTALL)


class ValueWithError(NamedTuple):
    """A value in SI units, and its standard error; None where none is known."""

    value: float
    error: float | None


def number_of(name: str, given: object, unit: str) -> float:
    """Return the SI value of a number or a text with a unit; degrees for phases, also for plain numbers.

    Raises
    ------
    UnitError
        For anything else, with its name.
    """
    try:
        if unit != DEGREE:
            return units.parse(given, unit)
        words = units.split_unit(given) if isinstance(given, str) else None
        is_plain = not isinstance(given, str) or (words is not None and not words[1])
        return units.parse(given, "1") if is_plain else math.degrees(units.parse(given, "rad"))
    except UnitError as error:
        raise UnitError(f"{name} {error}") from None


def above_zero(name: str, given: object, unit: str) -> float:
    """Return the SI value of a number or a text with a unit that must be above 0.

    Raises
    ------
    ParameterError
        For anything else, with its name.
    """
    value = number_of(name, given, unit)
    if not value > 0.0:
        raise ParameterError(f"{name} = {shorten(given)} is not above 0")
    return value


def measured(given: object, unit: str, name: str) -> ValueWithError:
    """Return a value with its error, of a number, a text with a unit, a text such as ``"2.7(2) N/m"``, or a pair.

    Raises
    ------
    ParameterError
        For anything else, and an error that is not above zero.
    """
    error: float | None = None
    if isinstance(given, str) and (match := WITH_ERROR.fullmatch(given[:100])):
        number, places, brackets, power, written = match.groups()
        digits = 0 if "." in brackets else len(places or "")  # in brackets are the last digits of the value
        value = number_of(name, f"{number}{power} {written}", unit)
        one, none = (number_of(name, f"{size} {written}", unit) for size in (f"1{power}", "0"))
        error = float(f"{brackets}e-{digits}") * (one - none)
    elif isinstance(given, tuple | list):
        if len(given) != 2:
            raise ParameterError(f"{name} = {shorten(given)} is not a pair of value and error")
        value = number_of(name, given[0], unit)
        error = None if given[1] is None else number_of(name, given[1], unit)
    else:
        value = number_of(name, given, unit)
    if error is not None and not error > 0.0:
        raise ParameterError(f"{name} has an error that is not above 0")
    return ValueWithError(value, error)


def value_and_error(name: str, given: object, unit: str) -> tuple[float, float]:
    """Return value and error, as :func:`measured`; both are required.

    Raises
    ------
    ParameterError
        For anything else.
    """
    found = measured(given, unit, name)
    if found.error is None:
        told = f"'{shorten(given)}'" if isinstance(given, str) else shorten(given)
        raise ParameterError(f"{name} = {told} has no error; write value and error, such as [180, 4] or '180(4)'")
    return found.value, found.error


def ends(given: object, unit: str, name: str, noun: str) -> tuple[float, float]:
    """Return the two ends of a range in SI units, the lower first.

    Raises
    ------
    ParameterError
        For anything but a pair of quantities.
    """
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise ParameterError(f"{name} = {shorten(given)} is not the lowest and the highest {noun}")
    low, high = sorted(number_of(name, end, unit) for end in given)
    return low, high


def show(value: float, error: float | None, unit: str) -> str:
    """Return a value with its error for a sentence: ``29.98 ± 0.02 nm``."""
    if unit == "deg":
        return f"{value:.3f}°" if error is None else f"{value:.3f}° ± {error:.2g}°"
    if error is None:
        return units.show(value, unit, 5)
    return "{} ± {} {}".format(*with_error(value, error, unit)).rstrip()


def with_unit(value: float, unit: str) -> str:
    """Return a value with its unit for a sentence, also of a phase and an infinite bound."""
    if not math.isfinite(value):
        return f"{value:g}"
    return f"{value:g} deg" if unit == DEGREE else units.show(value, unit, 5)
