"""The declaration of one number of a parameter: unit, bounds, symbol and meaning; it reads and checks values."""

from __future__ import annotations

import functools
import math
import operator
import re
from dataclasses import dataclass
from typing import Any

from dforce.core import units
from dforce.core.errors import ParameterError, shorten

TOLD = 6  # digits of a number in a sentence
# The largest size (SI), by its unit, of a number without its own bound on that side. A larger number lacks its unit, such as a
# distance of 12. Each is far beyond the range of an instrument.
UTMOST = {"m": 1e-3, "rad": 2.0 * math.pi, "J": 1e-15, "J/m^2": 10.0, "N": 1e-3, "V": 1e3, "C/m^2": 10.0, "m/s": 1e3}
# The largest size (SI) of any number, and the least of one that may not be zero: their products and powers are floats.
LEAST, MOST = 1e-40, 1e40
NO_UNIT = re.compile(r"\s*[-+.\deE]+\s*")
LEAST_TYPED = 1e-3  # the least size of a number that people write in front of a unit
in_si = functools.cache(units.parse)  # bounds, with which each value is compared


@dataclass(frozen=True)
class ParameterQuantity:
    """The declaration of one number: its SI unit, bounds (SI text), symbol and meaning."""

    unit: str
    symbol: str = ""
    doc: str = ""
    low: str | float | None = None
    above: str | float | None = None
    high: str | float | None = None
    below: str | float | None = None

    def __call__(self, schema: dict[str, Any]) -> None:
        """Write this declaration into a field's JSON schema: a number in SI, or text with a unit."""
        number: dict[str, Any] = {"type": "number"}
        for bound, key in (
            (self.low, "minimum"),
            (self.above, "exclusiveMinimum"),
            (self.high, "maximum"),
            (self.below, "exclusiveMaximum"),
        ):
            if bound is not None:
                number[key] = units.parse(bound, self.unit)
        text = {"type": "string", "pattern": r"^\s*[-+]?[0-9.]"}
        kept: dict[str, Any] = {key: schema[key] for key in ("title", "description", "default") if key in schema}
        forms = [schema, *schema.get("anyOf", []), *schema.get("oneOf", [])]
        one: list[dict[str, Any]] = [number, text]
        several = [{"type": "array", "items": {"anyOf": one}}] if any("items" in form for form in forms) else []
        tables = [{"$ref": form["$ref"]} for form in forms if "$ref" in form]  # such as a grid
        words = [{"const": form["const"]} for form in forms if "const" in form]
        schema.clear()
        schema.update(kept, anyOf=[*one, *words, *several, *tables])
        schema["unit"] = self.unit
        if self.symbol:
            schema["symbol"] = self.symbol

    def check(self, value: float) -> None:
        """Raise :class:`ParameterError` when an SI value is outside the bounds, or too small or large."""
        least, most = self._ends()
        for bound, broken, words in (
            (None if self.above is not None else least, operator.lt, "is below"),
            (self.above, operator.le, "is not above"),
            (None if self.below is not None else most, operator.gt, "is above"),
            (self.below, operator.ge, "is not below"),
        ):
            if bound is None:
                continue
            edge = in_si(bound, self.unit)
            if broken(value, edge):
                limit = bound if isinstance(bound, str) else units.show(bound, self.unit)
                brief = units.show(value, self.unit, TOLD)
                # one that lies beyond the bound by less than that is told in full
                told = brief if broken(units.parse(brief, self.unit), edge) else units.show(value, self.unit)
                raise ParameterError(f"= {told} {words} {limit}")
        small = abs(value) < LEAST and self.above is not None and in_si(self.above, self.unit) == 0.0
        if small or abs(value) > MOST:
            size = "small" if small else "large"
            raise ParameterError(f"= {units.show(value, self.unit, TOLD)} is too {size} to compute with")

    def _ends(self) -> tuple[str | float | None, str | float | None]:
        """Return the bounds as they are declared, else the utmost size of the unit."""
        utmost = UTMOST.get(self.unit)
        least = self.low if self.low is not None else self.above
        most = self.high if self.high is not None else self.below
        return (
            -utmost if least is None and utmost is not None else least,
            utmost if most is None and utmost is not None else most,
        )

    def read(self, given: object) -> float:
        """Return the SI value of a number or a text with a unit; the error on a value out of bounds suggests the likely one.

        Raises
        ------
        ParameterError
            When the value cannot be read, or is outside the bounds.
        """
        value = units.parse(given, self.unit)
        if self.unit == "1" and isinstance(given, str) and given.rstrip().endswith("%") and self.bounds()[1] > 1.0:
            raise ParameterError(f"is '{shorten(given)}', but is not a share; write a number without %")
        try:
            self.check(value)
        except ParameterError as error:
            raise ParameterError(f"{error}{self._meant(given, value)}") from None
        return value

    def _meant(self, given: object, value: float) -> str:
        """Return the likely value of a number that lacks its unit, as the end of a sentence."""
        with_unit = isinstance(given, str) and not NO_UNIT.fullmatch(given)
        if with_unit or abs(value) < LEAST_TYPED:  # 1e-8 was meant in meters, not in nanometers
            return ""
        usual = "%" if self.unit == "1" else units.usual_unit(self.unit)
        try:
            self.check(units.parse(f"{value!r} {usual}", self.unit))
        except ParameterError:
            return ""
        return units.percent_hint(value) if usual == "%" else f"; did you mean '{value:g} {usual}'?"

    def bounds(self) -> tuple[float, float]:
        """Return the lower and upper bound in SI, or the utmost size of the unit; infinite where there is none."""
        least, most = self._ends()
        return (
            -math.inf if least is None else in_si(least, self.unit),
            math.inf if most is None else in_si(most, self.unit),
        )
