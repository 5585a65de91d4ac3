"""Signatures of classes of parameters for completion and `help`: their own names, and the kinds of values that they take."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin

import pydantic
from pydantic.fields import FieldInfo

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(pydantic.BaseModel)

# the name in a signature for a number with a unit, in SI or as text
WORDS_OF_UNITS = {
    "1": "Number",
    "m": "Length",
    "Hz": "Frequency",
    "s": "Time",
    "rad": "Angle",
    "N/m": "Stiffness",
    "Pa": "Pressure",
    "Pa s": "Viscosity",
    "J": "Energy",
    "J/m^2": "SurfaceEnergy",
    "V": "Voltage",
    "K": "Temperature",
    "kg/m^3": "Density",
}
OF_PYDANTIC = frozenset(name for name in dir(pydantic.BaseModel) if not name.startswith("__"))


class SignatureWord(str):
    """A word in a signature, without quotes."""

    __slots__ = ()
    __repr__ = str.__str__


class ParametersType(ModelMetaclass):
    """The metaclass of parameters, for completion and `help`."""

    def __dir__(cls) -> list[str]:
        """Return the names that dForce gives a class: none of pydantic's, nor of Python's own."""
        own = (name for name in super().__dir__() if not name.startswith("_") and name not in OF_PYDANTIC)
        return sorted({*own, "__init__"})


def signature_of(fields: Mapping[str, FieldInfo]) -> inspect.Signature:
    """Return the call that makes an object of fields: by name, each with the kind of value that it takes."""
    shown = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.is_required() else _default(field.default),
            annotation=SignatureWord(_taken(field)),
        )
        for name, field in fields.items()
    ]
    return inspect.Signature(shown)


def _default(value: object) -> object:
    return SignatureWord(f"{type(value).__name__}()") if isinstance(value, pydantic.BaseModel) else value


def _taken(field: FieldInfo) -> str:
    """Return the types accepted for a field: a number by its dimension."""
    unit = getattr(field.json_schema_extra, "unit", None)
    number = "float" if unit is None else WORDS_OF_UNITS.get(unit, "Quantity")
    return " | ".join(dict.fromkeys(_kinds_in(field.annotation, number)))


def _kinds_in(annotation: Any, number: str) -> list[str]:
    """Return the names of the types that an annotation allows, without None; a float has the name `number`."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if annotation in (type(None), float):
        return [number] if annotation is float else []
    if origin is Literal:
        return [repr(word) for word in inner]
    if origin is tuple:
        return [f"list[{' | '.join(_kinds_in(inner[0], number))}]"]
    if origin in (dict, list):
        return [origin.__name__]
    parts = inner[:1] if origin is Annotated else inner
    if parts:
        return [name for part in parts for name in _kinds_in(part, number)]
    return [getattr(annotation, "__name__", str(annotation))]
