"""Text with a unit to SI numbers and back; the only module that uses pint.

Inside dForce every quantity is a float in SI units; a unit appears only where a user reads or types. A table has the units of
nearly every case. pint, which takes a second to load, converts only the others.
"""

from __future__ import annotations

import functools
import hashlib
import math
import re
from collections.abc import Iterable, Mapping
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from dforce.core.errors import ParameterError, UnitError, checked, shorten
from dforce.core.places import not_own, user_folder

if TYPE_CHECKING:
    import pint

# The accepted types of a quantity: a number in SI, or text with a unit; several in an array, a list, or a grid.
Length: TypeAlias = "float | str"
Time: TypeAlias = "float | str"
Lengths: TypeAlias = "Length | Iterable[Length] | Mapping[str, object]"
Frequencies: TypeAlias = "float | str | Iterable[float | str] | Mapping[str, object]"

NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?)\s*(.*?)\s*", re.DOTALL)
# The grammar of a unit: names, 1, and groups of them, multiplied or divided, each with at most one small power. pint receives
# nothing else, because it evaluates its text, and a tower of powers takes minutes.
LONGEST_UNIT = 40  # characters
_NAME = r"(?:[^\W\d]\w*|°\w*|%|1(?!\w))"
_POWER = r"(?:\s?(?:\*\*|\^)\s?(?:[+-]?\d(?:\.\d)?|\(\s?[+-]?\d(?:\.\d|\s?/\s?\d)?\s?\))(?![\w.*^]))?"
_TIMES = r"(?:\s?[*/·.]\s?|\s)"
_PRODUCT = rf"{_NAME}{_POWER}(?:{_TIMES}{_NAME}{_POWER})*"
_FACTOR = rf"(?:{_NAME}|\(\s?{_PRODUCT}\s?\)){_POWER}"
UNIT = re.compile(rf"{_FACTOR}(?:{_TIMES}{_FACTOR})*")

# The unit that a reader expects, by the SI unit in which a quantity is stored.
SHOWN: dict[str, tuple[str, ...]] = {
    "m": ("m", "mm", "um", "nm", "pm"),
    "Hz": ("Hz", "kHz", "MHz", "GHz"),
    "N": ("N", "mN", "uN", "nN", "pN", "fN"),
    "N/m": ("N/m", "mN/m"),
    "Pa": ("Pa", "kPa", "MPa", "GPa"),
    "Pa s": ("Pa s", "mPa s", "kPa s"),
    "J/m^2": ("J/m^2", "mJ/m^2"),
    "s": ("s", "ms", "us", "ns"),
    "m/s": ("m/s", "mm/s", "um/s", "nm/s"),
    "V": ("V", "mV"),
    "C/m^2": ("C/m^2", "mC/m^2"),
    "rad": ("deg",),
    "J": ("J", "aJ", "zJ"),
    "W": ("W", "pW", "fW", "aW"),
    "K": ("K",),
    "mol/m^3": ("mol/m^3", "mmol/l", "mol/l"),
}

# The units that need no pint: their SI unit, and their size in it. A test compares each with pint.
PREFIXES = {
    "z": 1e-21, "a": 1e-18, "f": 1e-15, "p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9,
    "T": 1e12,
}  # fmt: skip
PREFIXED = {
    "m": "m u n p",
    "Hz": "k M G",
    "N": "m u n p f",
    "N/m": "m",
    "Pa": "k M G T",
    "Pa s": "m k",
    "J": "a z",
    "J/m^2": "m",
    "s": "m u n",
    "m/s": "m u n",
    "V": "m",
    "W": "p f",
    "K": "",
    "kg/m^3": "",
    "1": "",
}
QUICK: dict[str, tuple[str, float]] = {
    prefix + unit: (unit, PREFIXES[prefix]) for unit, prefixes in PREFIXED.items() for prefix in ("", *prefixes.split())
} | {"": ("1", 1.0), "rad": ("rad", 1.0), "deg": ("rad", math.pi / 180.0)}


# SI units of quantities that are declared in other units than these.
STORED = {"mC/m^2": "C/m^2", "degC": "K", "mol/l": "mol/m^3", "mmol/l": "mol/m^3", "1/nm": "1/m", "nm^3": "m^3"}


def stored(unit: str) -> str:
    """Return the SI unit that values declared in a unit are stored in, without loading pint."""
    return QUICK[unit][0] if unit in QUICK else STORED.get(unit, unit)


@functools.cache
def registry() -> pint.UnitRegistry[Any]:
    """Return the one unit registry of the process."""
    import pint

    try:
        folder = _cache_folder(Path(pint.__file__))
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return pint.UnitRegistry(cache_folder=None if not_own(folder) else folder)  # pint keeps pickles, which are code
    except Exception:  # the cache is truncated, or not writable: the definitions are read anew  # noqa: BLE001
        return pint.UnitRegistry()


def _cache_folder(where: Path) -> Path:
    """Return where pint keeps its definitions: each copy of it by itself, for they name files beside it."""
    own = hashlib.sha256(str(where).encode()).hexdigest()[:16]
    return user_folder("cache") / "units" / own


@functools.lru_cache(maxsize=4096)
def unit_scale(unit: str) -> tuple[float, float]:
    """Return (scale, offset) of a unit: SI value = number * scale + offset.

    Raises :class:`UnitError` for a unit that is not known.
    """
    if unit in QUICK:
        return QUICK[unit][1], 0.0
    if len(unit) > LONGEST_UNIT or not UNIT.fullmatch(" ".join(unit.split())):
        raise UnitError(f"'{shorten(unit, LONGEST_UNIT)}' is not a unit")
    quantity = registry().Quantity
    try:
        one = quantity(1.0, _pint_unit(unit)).to_base_units()
        zero = quantity(0.0, _pint_unit(unit)).to_base_units()
    except Exception as error:  # pint raises a dozen kinds, tokenizer errors of Python among them
        raise UnitError(f"'{shorten(unit, LONGEST_UNIT)}' is not a known unit") from error
    return _decimal(float(one.magnitude - zero.magnitude)), float(zero.magnitude)


def _decimal(scale: float) -> float:
    """Return the exact decimal number of a scale, such as 1e-9, where the conversion by base units rounds.

    A scale that is not a short decimal number, such as the degree's, stays as it is.
    """
    short = float(f"{scale:.12g}")
    return short if abs(short - scale) <= 4.0 * math.ulp(scale) else scale


def _pint_unit(unit: str) -> Any:
    return registry().parse_units(re.sub(r"·|\.(?!\d)", " ", unit).replace("^", "**"))  # N.m is N m


@functools.lru_cache(maxsize=4096)
def _mismatch(unit: str, wanted: str) -> str | None:
    """Return why `unit` cannot measure a quantity in `wanted`; None when it can."""
    if unit in QUICK and wanted in QUICK and QUICK[unit][0] == QUICK[wanted][0]:
        return None
    given, asked = _pint_unit(unit), _pint_unit(wanted)
    if given.dimensionality != asked.dimensionality:
        return f"is {_kind(unit)}, not {_kind(wanted)}"
    # pint takes the radian for 1, so that rad/s would pass for Hz and be wrong by 2 pi.
    angular = _is_angular(given)
    if wanted == "Hz" and (angular or "hertz" not in str(given)):
        return "is not a frequency in Hz; divide an angular frequency by 2 pi"
    if wanted != "rad" and angular:
        return f"is an angle, not {_kind(wanted)}"
    if wanted == "rad" and not angular:
        return "is not an angle; write deg or rad"
    return None


def _is_angular(unit: object) -> bool:
    """Return whether an angle is part of a unit of pint."""
    return not set(re.findall(r"[a-z_]+", str(unit))).isdisjoint(ANGLES)


ANGLES = {
    "radian", "milliradian", "degree", "turn", "revolution", "cycle", "revolutions_per_minute", "arcminute", "arcsecond",
}  # fmt: skip
KINDS = {
    "m": "length", "Hz": "frequency", "N": "force", "N/m": "spring constant", "Pa": "pressure or modulus",
    "Pa s": "viscosity", "J": "energy", "J/m^2": "surface energy", "s": "time", "m/s": "velocity",
    "V": "voltage", "C/m^2": "surface charge density", "rad": "angle", "K": "temperature",
    "kg/m^3": "density", "1": "plain number", "W": "power", "mol/m^3": "concentration", "kg": "mass",
    "T": "magnetic field", "A m^2": "magnetic moment", "1/m": "inverse length", "m^3": "volume",
}  # fmt: skip


def _kind(unit: str) -> str:
    """Return the words for the dimension of a unit: 'a length' for nm."""
    word = KINDS.get(unit)
    if word is None:
        given = _pint_unit(unit)
        angle = not given.dimensionality and _is_angular(given)  # pint takes the radian for 1
        alike = (w for known, w in KINDS.items() if _pint_unit(known).dimensionality == given.dimensionality)
        word = KINDS["rad"] if angle else KINDS["1"] if not given.dimensionality else next(alike, f"quantity in {unit}")
    return f"an {word}" if word[0] in "aei" else f"a {word}"


def parse(given: object, unit: str) -> float:
    """Return the SI value of `given`: a number in SI units, or text such as ``"48.9 kHz"``.

    Parameters
    ----------
    given
        An int or float (already SI), or text with a number and a unit. Text without a unit is an SI number.
    unit
        The SI unit of the quantity, for example ``"N/m"``; ``"1"`` for a plain number.

    Raises
    ------
    UnitError
        For text that is not a number with a unit, an unknown unit, a unit of another dimension, NaN, infinity, and
        anything except text and numbers.
    """
    if not isinstance(unit, str):  # by hand, because all numbers of all cases come this way
        raise UnitError(f"unit = {shorten(unit)} is not text")
    if isinstance(given, bool) or not isinstance(given, str | int | float):
        if hasattr(given, "item") and getattr(given, "shape", None) == ():
            return parse(given.item(), unit)  # a NumPy scalar
        raise UnitError(f"is {shorten(given)}, which is neither a number nor text with a unit{_example(unit)}")
    if not isinstance(given, str):
        return _finite(float(given) if abs(given) < 1e308 else math.inf, given)
    match = _number(given)
    if match is None:
        raise UnitError(f"is '{shorten(given)}', which is not a number{_example(unit, ' with a unit')}")
    number, written = match[1], match[2]
    if not written:
        return _finite(float(number), given)
    if comma := re.match(r",\d+([.,]?)", written):
        point = "" if comma[1] or "." in number else f", a decimal comma; write a point: '{number}.{written[1:]}'"
        raise UnitError(f"is '{shorten(given)}'{point or '; write the number without separators of thousands'}")
    stored, _ = unit_scale(unit)
    try:
        scale, offset = unit_scale(written)
        problem = _mismatch(written, unit)
    except UnitError as error:
        raise UnitError(f"is '{shorten(given)}', where {error}{_example(unit)}") from None
    if problem:
        raise UnitError(f"is '{shorten(given)}', which {problem}{_example(unit)}")
    try:
        # Decimal, so that "0.165 nm" is the float nearest to 0.165e-9 and survives a round trip.
        value = float(Decimal(number) * Decimal(repr(scale / stored)))
    except (InvalidOperation, OverflowError):
        value = math.inf
    return _finite(value + offset, given)


# The unit that a message suggests, where people in the field would not write the SI unit.
SUGGESTED = {
    "m": "nm",
    "J": "zJ",
    "Hz": "kHz",
    "N": "nN",
    "Pa": "GPa",
    "J/m^2": "mJ/m^2",
    "s": "us",
    "rad": "deg",
    "m/s": "um/s",
}


def parse_share(given: object, name: str) -> float:
    """Return a share, above 0 and at most 1, of a number or a text such as ``"80 %"``; `name` begins each sentence.

    Raises
    ------
    ParameterError
        For anything else; for a number in percent, with the text to write.
    """
    try:
        value = parse(given, "1")
    except UnitError as error:
        raise UnitError(f"{name} {error}") from None
    if not value > 0.0:
        raise ParameterError(f"{name} = {shorten(given)} is not above 0")
    if value > 1.0:
        raise ParameterError(f"{name} = {shorten(given)} is above 1{percent_hint(value)}")
    return value


def percent_hint(value: float) -> str:
    """Return the text to write for a number that may be in percent, as the end of a sentence."""
    return f"; did you mean {value / 100.0:g} or '{value:g} %'?" if 1.0 < value <= 100.0 else ""


def parse_all(given: object, unit: str) -> list[float]:
    """Return the SI values of a quantity, or of each in a list; see :func:`parse`."""
    if isinstance(given, str) or not isinstance(given, Iterable) or getattr(given, "shape", None) == ():
        return [parse(given, unit)]
    return [parse(item, unit) for item in given]


def _example(unit: str, before: str = "") -> str:
    return f"{before} (for example in {'degC' if unit == 'K' else SUGGESTED.get(unit, unit)})" if unit != "1" else ""


def _finite(value: float, given: object) -> float:
    if not math.isfinite(value):
        raise UnitError(f"is {shorten(given)}, which is not a finite number")
    return value + 0.0  # minus zero is zero


@checked
def split_unit(text: str) -> tuple[str, str] | None:
    """Return number and unit of a text, both as written; None for a text that does not start with a number."""
    match = _number(text)
    return (match[1], match[2]) if match else None


def _number(text: str) -> re.Match[str] | None:
    """Return number and unit in a text, whose minus may be a typeset one; None for a text that does not start with a number."""
    return NUMBER.fullmatch(text.replace("\N{MINUS SIGN}", "-")) if len(text) <= 100 else None


@checked
def unit_choices(unit: str) -> tuple[str, ...]:
    """Return the units in which people in the field give a quantity that is stored in `unit`."""
    return SHOWN.get(unit, (unit,))


@checked
def usual_unit(unit: str) -> str:
    """Return the unit in which people in the field mostly give a quantity that is stored in `unit`."""
    return SUGGESTED.get(unit, unit)


@checked
@functools.lru_cache(maxsize=4096, typed=True)  # a case has most numbers of the case before
def show(value: float, unit: str, digits: int | None = None) -> str:
    """Return an SI value as text with a unit chosen for the reader.

    Without `digits` the text contains the exact value: ``parse(show(x, unit), unit) == x``.

    Parameters
    ----------
    value
        The value in SI.
    unit
        Its SI unit, for example ``"N/m"``; ``"1"`` for a plain number.
    digits
        Number of significant digits.

    >>> show(4.89e4, "Hz"), show(1.65e-10, "m"), show(4.0553735e-9, "m", 5)
    ('48.9 kHz', '0.165 nm', '4.0554 nm')
    """
    value = float(value) + 0.0  # a number of NumPy is written otherwise; minus zero is zero
    scale, chosen = reader_unit(abs(value), unit)
    suffix = f" {chosen}" if chosen != "1" else ""
    if not math.isfinite(value):
        return f"{value}{suffix}"
    if digits is not None:
        return f"{float(f'{value / scale:.{digits}g}'):.15g}{suffix}"  # 140, not 1.4e+02
    exact = Decimal(repr(value)) / Decimal(repr(scale))
    digits_of_it = len(exact.normalize().as_tuple().digits)  # where the unit only shifts the point, none can be spared
    for places in range(digits_of_it if digits_of_it < 18 else 1, 18):
        text = f"{exact:.{places}g}"
        if "e" in text or "E" in text:
            text = f"{float(text):.17g}" if float(text).is_integer() else repr(float(text))
        if parse(text + suffix, unit) == value:
            return text + suffix
    return f"{value!r} {unit}" if unit != "1" else repr(value)


def show_range(low: float, high: float, unit: str, digits: int, between: str = "to") -> str:
    """Return a range of SI values as text, both ends in the unit of the larger one unless they differ by more than 1000.

    >>> show_range(-6.9e-10, -8.1e-12, "m", 3), show_range(9e-7, 1.2e-6, "m", 3, "and")
    ('-0.69 nm to -0.0081 nm', '0.9 µm and 1.2 µm')
    """
    largest = max(abs(low), abs(high))

    def text(end: float) -> str:
        scale, chosen = reader_unit(abs(end) if 0.0 < abs(end) < 0.999e-3 * largest else largest, unit)
        return f"{float(f'{end / scale + 0.0:.{digits}g}'):.15g}{f' {spelled(chosen)}' if chosen != '1' else ''}"

    return f"{text(low)} {between} {text(high)}"


def spelled(unit: str) -> str:
    """Return a unit in the spelling of print: µm/s, m²/Hz."""
    return re.sub(r"^u(?=[a-zA-Z])", "µ", unit).replace("^2", "²").replace("^3", "³")


@functools.lru_cache(maxsize=4096)
def _factor(chosen: str, unit: str) -> float:
    return unit_scale(chosen)[0] / unit_scale(unit)[0]


def reader_unit(size: float, unit: str) -> tuple[float, str]:
    """Return (scale, name) of the unit in which a value of this size reads best: nm rather than 1e-9 m.

    The number shown is the SI value divided by `scale`.
    """
    names = SHOWN.get(unit, (unit,))
    if unit == "1":
        return 1.0, "1"
    for name in (ordered := sorted(names, key=lambda name: -_factor(name, unit))):
        # 0.1 nm rather than 100 pm, 0.9 N/m rather than 900 mN/m: so the field writes them.
        least = 0.1 if name in ("nm", "N/m") else 1.0
        if size >= least * _factor(name, unit) * (1 - 1e-12):
            return _factor(name, unit), name
    # zero, or smaller than every unit on the list: the smallest for a value, the first for zero
    name = ordered[-1] if size > 0.0 else names[0]
    return _factor(name, unit), name
