"""How a parameter is declared: unit, default, bounds, symbol and a sentence, all in one place.

>>> class Spring(Parameters):
...     stiffness: float = param("1 N/m", symbol="k", above="0 N/m", doc="spring constant")
>>> Spring(stiffness="2 mN/m").stiffness
0.002

Forms, case files, schema, documentation and error messages are made from these declarations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, Self, TypeVar, get_args, get_origin

import pydantic
from pydantic_core import PydanticUndefined

from dforce.core import files, units
from dforce.core.errors import ParameterError, UnitError, checked, nearest, shorten
from dforce.core.marks import may_be_read
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.refusals import refusal
from dforce.core.signatures import ParametersType, signature_of

if TYPE_CHECKING:
    # The types of a field for type checkers: its type once it is read, and the types that are accepted for it.
    Read = TypeVar("Read")

    class Number:
        """A number in SI; text with a unit is accepted."""

        def __get__(self, owner: object, kind: type | None = None) -> float: ...
        def __set__(self, owner: object, value: float | str) -> None: ...

    class MaybeNumber:
        """A number that may be left out."""

        def __get__(self, owner: object, kind: type | None = None) -> float | None: ...
        def __set__(self, owner: object, value: float | str | None) -> None: ...

    class Part(Generic[Read]):
        """An object; a table with its keys, or a list of several, is accepted. The run checks which."""

        def __get__(self, owner: object, kind: type | None = None) -> Read: ...
        def __set__(self, owner: object, value: object) -> None: ...

    Numbers = Part[tuple[float, ...]]
else:
    Number, MaybeNumber, Numbers = float, float | None, tuple[float, ...]

    class Part:
        """The type of a field, for pydantic."""

        def __class_getitem__(cls, kind: object) -> Any:
            return kind


@dataclass(frozen=True)
class Shared:
    """A parameter that the instrument gives: `path` names where, such as ``tip.radius``."""

    path: str

    def __call__(self, schema: dict[str, Any]) -> None:
        """Note the origin of the value in the JSON schema."""
        schema["sharedFrom"] = self.path


@checked
def param(
    default: object = PydanticUndefined,
    *,
    unit: str | None = None,
    symbol: str = "",
    doc: str,
    low: str | float | None = None,
    above: str | float | None = None,
    high: str | float | None = None,
    below: str | float | None = None,
) -> Any:
    """Declare a quantity of a :class:`Parameters` class.

    Parameters
    ----------
    default
        Text with a unit, an SI number, or None (an optional value); without a default the value is required.
    unit
        SI unit; by default from the first text among default and bounds, else ``"1"``.
    symbol
        Symbol of the field, as LaTeX without dollars.
    doc
        One phrase with the meaning.
    low, high, above, below
        Bounds: `low` and `high` are allowed values, `above` and `below` are not.
    """
    texts = [text for text in (default, low, above, high, below) if isinstance(text, str)]
    if unit is None:
        match = units.NUMBER.fullmatch(texts[0]) if texts else None
        unit = (match[2] if match else "") or "1"
    quantity = ParameterQuantity(units.stored(unit), symbol, doc, low, above, high, below)
    return pydantic.Field(default, description=doc, validate_default=True, json_schema_extra=quantity)


def part(default: object, *, description: str, **limits: Any) -> Any:
    """Declare a field of the kind :class:`Part`, which has a default."""
    return pydantic.Field(default, description=description, **limits)


@checked
def shared(path: str) -> Any:
    """Declare a parameter that comes from the instrument, by its path such as ``"tip.radius"``: all forces share one tip."""
    return pydantic.Field(None, exclude=True, repr=False, validate_default=False, json_schema_extra=Shared(path))


class Parameters(pydantic.BaseModel, metaclass=ParametersType):
    """A frozen set of parameters; the base class of all input.

    Unknown names are errors with the nearest known name; quantities accept SI numbers and text with a unit.

    Raises
    ------
    ParameterError
        With one sentence: the value, and the allowed values.
    """

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", validate_default=True, ser_json_inf_nan="constants")

    title_of: ClassVar[str] = ""  # how messages call this section; the class's name when empty
    # typical values of the parameters without a default, for forms and checks
    example: ClassVar[Mapping[str, Any]] = {}
    # groups of fields of which a user sets one, by the name of the group
    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    # fields that a form always shows, each with the fields that it also shows once this field is set
    unfolded: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    hints: ClassVar[Mapping[str, str]] = {}  # the key to write instead of a name that other programs use

    _quantities: ClassVar[dict[str, ParameterQuantity]] = {}
    _shared: ClassVar[dict[str, str]] = {}
    _keys: ClassVar[list[str]] = []

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        declared = {name: field.json_schema_extra for name, field in cls.model_fields.items()}
        cls._quantities = {name: one for name, one in declared.items() if isinstance(one, ParameterQuantity)}
        cls._shared = {name: one.path for name, one in declared.items() if isinstance(one, Shared)}
        cls._keys = [name for name in declared if name not in cls._shared]
        cls.__signature__ = signature_of({name: cls.model_fields[name] for name in cls.keys()})  # noqa: SIM118

    def __init__(self, *unnamed: Any, **data: Any) -> None:
        """Take the parameters by name."""
        if unnamed:
            raise ParameterError(self._by_name(unnamed[0]))
        try:
            super().__init__(**data)
        except pydantic.ValidationError as error:
            raise refusal(error, type(self), self.root()) from None

    # Inside another model pydantic then validates without __init__, so that an error keeps its whole path.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def _by_name(cls, given: object) -> str:
        """Return the name for a value without a name."""
        keys = cls.keys()
        key = "name" if isinstance(given, str) and "name" in keys else keys[0]
        value = repr(given) if isinstance(given, str | int | float) else "..."
        return f"{cls.__name__} takes its parameters by name: write {cls.__name__}({key}={shorten(value)})"

    def __dir__(self) -> list[str]:
        """Return the fields, and the names that dForce gives the class: none of pydantic's."""
        return sorted({*dir(type(self)), *self.keys()})

    def __setattr__(self, name: str, value: object) -> None:
        self._refuse_change(name)
        super().__setattr__(name, value)  # a name with an underscore is the class's own business

    def __delattr__(self, name: str) -> None:
        self._refuse_change(name)
        super().__delattr__(name)

    def _refuse_change(self, name: str) -> None:
        if name.startswith("_"):
            return
        if name not in type(self).model_fields:
            raise ParameterError(f"{self.section()} has no parameter '{name}'{nearest(name, self.keys())}")
        raise ParameterError(f"{self.section()}.{name} cannot be changed: a case is frozen; {self._other_way(name)}")

    def _other_way(self, name: str) -> str:
        """Return how a copy with another value is made."""
        return f"{self.section().split('.')[-1]}.replace({name}=...) gives a changed copy, and so does case.replace"

    @classmethod
    def root(cls) -> str:
        """Return the path that messages start with when this class is built by itself."""
        return cls.section()

    @classmethod
    def quantities(cls) -> dict[str, ParameterQuantity]:
        """Return the declared quantities by field name, in order, shared ones excluded."""
        return cls._quantities

    @classmethod
    def shared_fields(cls) -> dict[str, str]:
        """Return the instrument's path of each shared field, by field name."""
        return cls._shared

    @classmethod
    def keys(cls) -> list[str]:
        """Return the names that a user may give."""
        return cls._keys

    @classmethod
    def section(cls) -> str:
        """Return the name that messages call this section by."""
        return cls.title_of or cls.__name__.lower()

    @pydantic.model_validator(mode="before")
    @classmethod
    def _known_keys_only(cls, data: object) -> Any:
        if not isinstance(data, dict):
            return data
        for key in data:
            if key in cls.shared_fields():
                raise ParameterError(f"takes '{key}' from the instrument: set {cls.shared_fields()[key]} instead")
            if key not in cls.model_fields:
                hint = f"; {cls.hints[key]}" if key in cls.hints else nearest(shorten(str(key), 40), cls.keys())
                raise ParameterError(f"has no parameter '{shorten(str(key), 40)}'{hint}")
        return data

    @pydantic.field_validator("*", mode="before")
    @classmethod
    def _text_to_si(cls, given: object, info: pydantic.ValidationInfo) -> Any:
        name = info.field_name or ""
        quantity = cls.quantities().get(name)
        if files.guests_only and may_be_read(field := cls.model_fields[name]) and given != field.default:
            raise ParameterError(files.FOR_GUESTS)
        if quantity is None:
            if isinstance(given, bool) and not _takes_bool(cls.model_fields[name].annotation):
                raise ParameterError(f"= {shorten(given)} is not allowed here")  # pydantic takes true for 1
            return given
        if given is None or isinstance(given, dict | pydantic.BaseModel):
            return given  # a table for many values, such as a grid
        words = _words(cls.model_fields[name].annotation)
        if isinstance(given, str) and given in words:
            return given
        one = isinstance(given, str | type) or getattr(given, "shape", None) == ()
        if not one and hasattr(given, "__iter__"):
            return tuple(map(quantity.read, given))  # such as the Q of every mode
        try:
            return quantity.read(given)
        except UnitError as error:
            raise UnitError(f"{error}{''.join(f', nor the word {word!r}' for word in words)}") from None

    def needed(self, field: str) -> float:
        """Return the number in an optional field, or raise :class:`ParameterError` when it was not given."""
        value = getattr(self, field)
        if value is None:
            meaning = self.quantities()[field].doc.partition(";")[0]
            raise ParameterError(f"{self.section()}.{field} ({meaning}) is missing")
        return float(value)

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some parameters changed, validated again."""
        given = {name: getattr(self, name) for name in self.model_fields_set if name not in self.shared_fields()}
        return type(self)(**(given | changes))

    def _repr_fields(self) -> Iterator[tuple[str, str]]:
        quantities = self.quantities()
        for name in self.keys():
            value = getattr(self, name)
            if value is None or value == () or value == "":
                continue
            if name in quantities and isinstance(value, float):
                text = units.show(value, quantities[name].unit)
                yield name, repr(text) if quantities[name].unit != "1" else text
            else:
                yield name, repr(value)

    def __repr__(self) -> str:
        """Show the parameters with units, as they would be typed."""
        return f"{type(self).__name__}({', '.join(f'{name}={text}' for name, text in self._repr_fields())})"

    __str__ = __repr__


def _words(annotation: object) -> tuple[Any, ...]:
    """Return the words that may replace a number, such as for a frequency that is to be found."""
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    return tuple(word for part in get_args(annotation) for word in _words(part))


def _takes_bool(annotation: object) -> bool:
    return annotation in (bool, Any) or any(_takes_bool(part) for part in get_args(annotation))
