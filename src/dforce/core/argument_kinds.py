"""Arguments of a public function: the kinds that its annotations allow, in words and as a check.

Unchecked, a wrong kind of argument would end deep inside, in an error of Python that does not help a user.
"""

from __future__ import annotations

import functools
import inspect
import numbers
import os
import reprlib
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

WHERE = "get a case from df.example or df.load_case"
CLASSES = {
    "Case": ("dforce.case", "Case", "a case", WHERE),
    "xr.Dataset": ("xarray", "Dataset", "a result", "get a result from df.run or df.read"),
    "xr.DataArray": ("xarray", "DataArray", "a quantity of a result", "result['amplitude'] is one"),
    "FigureBase": ("matplotlib.figure", "FigureBase", "a figure", "matplotlib.pyplot.figure() gives one"),
    "Picture": ("dforce.results.curves", "Picture", "a picture", "dforce.results.curves.pictures_of gives some"),
    "ThermalTune": ("dforce.inverse.thermal", "ThermalTune", "a thermal tune", "df.thermal_tune gives one"),
    "type[Force]": ("dforce.forces", "Force", "a class of forces", "df.forces.DMT is one"),
}
"""Things known by their class: module, name there, in words, and where one comes from."""

OF_MEASURED = (
    "df.read_measured reads a measured curve from a file; pandas writes one by .to_csv('curve.csv', index=False)"
)
PLAIN: dict[str, tuple[Callable[[Any], bool], str]] = {
    "None": (lambda given: given is None, ""),
    "str": (lambda given: isinstance(given, str), "text"),
    "bytes": (lambda given: isinstance(given, bytes), "bytes"),
    "memoryview": (lambda given: isinstance(given, memoryview), "bytes"),
    "os.PathLike[str]": (lambda given: isinstance(given, os.PathLike), "a path"),
    "bool": (lambda given: type(given).__name__ in ("bool", "bool_"), "True or False"),  # bool_: NumPy's
    "int": (lambda given: isinstance(given, numbers.Integral) and not isinstance(given, bool), "a whole number"),
    "float": (lambda given: _is_number(given), "a number"),
    "Progress": (lambda given: callable(given) and not isinstance(given, type), "a function"),
    "Callable": (lambda given: callable(given) and not isinstance(given, type), "a function"),
    "Mapping": (lambda given: isinstance(given, Mapping) and not hasattr(given, "dims"), "a table"),  # no Dataset
    "dict": (lambda given: isinstance(given, dict), "a table"),
}
SEVERAL = ("Sequence", "Collection", "Iterable")
# the parameters of a case check these themselves
ANYTHING = ("Any", "object", "ArrayLike", "Length", "Lengths", "Frequencies", "Time", "Start", "Literal")
LONGEST = 60  # characters that a message repeats


@dataclass(frozen=True)
class ArgumentKind:
    """A kind that an argument may have.

    Attributes
    ----------
    fits
        Whether something given is of this kind.
    words
        Its name; empty for None, an argument left out.
    source
        Where to get a value of this kind; may be empty.
    """

    fits: Callable[[Any], bool]
    words: str
    source: str = ""


def kind_of(annotation: str) -> ArgumentKind | None:
    """Return the kind that an annotation names, without unions; None where anything goes.

    Raises
    ------
    LookupError
        For an annotation that is not known here.
    """
    if annotation.partition("[")[0] in ANYTHING:
        return None
    if annotation in CLASSES:
        module, name, words, source = CLASSES[annotation]
        return ArgumentKind(functools.partial(_is_one, module, name, annotation.startswith("type[")), words, source)
    outer, _, inner = annotation.partition("[")
    if outer in SEVERAL:
        item = kind_of(inner.removesuffix("]"))
        return ArgumentKind(functools.partial(_are_all, item), f"a list of {item.words}" if item else "a list")
    plain = PLAIN.get(annotation) or PLAIN.get(outer)
    if plain is None:
        raise LookupError(f"'{annotation}' is no kind of argument in {__name__}")
    return ArgumentKind(*plain)


def _is_one(module: str, name: str, as_class: bool, given: object) -> bool:
    """Return whether something is of a class: never where the module of the class is not imported."""
    wanted = getattr(sys.modules.get(module), name, None)
    if wanted is None:
        return False
    return isinstance(given, type) and issubclass(given, wanted) if as_class else isinstance(given, wanted)


def is_dataset(given: object) -> bool:
    """Return whether something is a Dataset of xarray."""
    return _is_one("xarray", "Dataset", False, given)


def _are_all(item: ArgumentKind | None, given: object) -> bool:
    if isinstance(given, str | bytes | type) or not isinstance(given, Iterable):
        return False
    # an iterator can be read only once: its items are not checked
    return item is None or isinstance(given, Iterator) or all(map(item.fits, given))


def _is_number(given: Any) -> bool:
    if isinstance(given, (float, int, numbers.Real)):  # the first two checks are quicker
        return not isinstance(given, bool)
    return getattr(given, "shape", None) == () and _is_number(given.item())  # an array of one number


def members(annotation: str) -> list[str]:
    """Return the members of a union, as written."""
    found, depth = [""], 0
    for sign in annotation:
        depth += (sign in "[(") - (sign in "])")
        if sign == "|" and depth == 0:
            found.append("")
        else:
            found[-1] += sign
    return [member.strip() for member in found]


@functools.cache
def taken(function: Callable[..., Any]) -> dict[str, tuple[ArgumentKind, ...]]:
    """Return the kinds that each argument of a function may have, by name, in order; none where any kind may be."""
    kinds = {}
    for name, annotation in _annotations(function).items():
        allowed = [kind_of(member) for member in members(annotation)] if annotation else [None]
        kinds[name] = tuple(kind for kind in allowed if kind is not None) if None not in allowed else ()
    return kinds


def _annotations(function: Callable[..., Any]) -> dict[str, str]:
    """Return the annotation of each argument; the arguments in a table (Unpack) have their own names."""
    return {
        name: "" if parameter.annotation is parameter.empty else str(parameter.annotation)
        for name, parameter in full_signature(function).parameters.items()
    }


@functools.cache
def full_signature(function: Callable[..., Any]) -> inspect.Signature:
    """Return a signature in which a table of arguments (Unpack) is written out, each by its own name."""
    signature = inspect.signature(function)
    found = []
    for parameter in signature.parameters.values():
        given = str(parameter.annotation)
        if parameter.kind is not parameter.VAR_KEYWORD or not given.startswith("Unpack["):
            found.append(parameter)
            continue
        table = vars(sys.modules[function.__module__])[given[len("Unpack[") : -1]]
        found += [
            inspect.Parameter(key, parameter.KEYWORD_ONLY, default=None, annotation=hint.__forward_arg__)
            for key, hint in table.__annotations__.items()
        ]
    return signature.replace(parameters=found)


def miscall(function: Callable[..., Any], args: tuple[object, ...], kwargs: Mapping[str, object]) -> tuple[str, str]:
    """Return a sentence on a call with too many or too few arguments or a name that the function lacks, and that name."""
    parameters = full_signature(function).parameters
    placed, rest, needed = _places(function)
    if len(args) > len(placed) and not rest:
        others = [name for name in parameters if name not in placed]
        hint = f"; name the others, such as {others[0]}=..." if others else ""
        names = ", ".join(placed) or "none"
        return f"{function.__name__} takes at most {len(placed)} arguments without their names ({names}){hint}", ""
    if kwargs and not any(one.kind is one.VAR_KEYWORD for one in parameters.values()):
        unknown = next((name for name in kwargs if name not in parameters), "")
        if unknown:
            return f"{function.__name__} has no argument '{unknown}'", unknown
    given = {*placed[: len(args)], *kwargs}
    for name in needed:
        if name not in given:
            return f"{function.__name__} needs the argument '{name}'", ""
    return "", ""


@functools.cache
def _places(function: Callable[..., Any]) -> tuple[tuple[str, ...], str, tuple[str, ...]]:
    """Return the names of the positional arguments, of the argument with a star, and of the required arguments."""
    parameters = inspect.signature(function).parameters.values()
    placed = tuple(one.name for one in parameters if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD))
    rest = {one.kind: one.name for one in parameters if one.kind in (one.VAR_POSITIONAL, one.VAR_KEYWORD)}
    needed = tuple(one.name for one in parameters if one.default is one.empty and one.kind not in rest)
    return placed, rest.get(inspect.Parameter.VAR_POSITIONAL, ""), needed


def misfit(function: Callable[..., Any], args: tuple[object, ...], kwargs: Mapping[str, object]) -> str | None:
    """Return a sentence on the first argument of a call that is of a wrong kind; None where all are right."""
    kinds, (placed, rest, _) = taken(function), _places(function)
    given = [*zip(placed, args, strict=False), *kwargs.items()]
    if rest:
        given += [(rest, one) for one in args[len(placed) :]]
    for name, one in given:
        allowed = kinds.get(name, ())
        if allowed and not any(kind.fits(one) for kind in allowed):
            return _sentence(name, allowed, one)
    return None


def _sentence(name: str, allowed: tuple[ArgumentKind, ...], given: object) -> str:
    words = list(dict.fromkeys(kind.words for kind in allowed if kind.words))
    denied = f"not {words[0]}" if len(words) == 1 else f"neither {' nor '.join(words)}"
    measured = [OF_MEASURED] if name == "data" else []
    sources = "; ".join(measured or (kind.source for kind in allowed if kind.source))
    return f"{name} = {as_text(given)} is {denied}{f'; {sources}' if sources else ''}"


def as_text(given: object) -> str:
    """Return an argument as text: in words, or as it would be typed."""
    for module, name, words, _ in CLASSES.values():
        if _is_one(module, name, False, given):
            return f"({words})"
    if given is None or isinstance(given, str | bytes | int | float | list | tuple | dict | set):
        brief = reprlib.Repr()
        brief.maxlevel, brief.maxstring, brief.maxlong = 2, LONGEST, LONGEST
        text = brief.repr(given)
        return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
    return f"({'class' if isinstance(given, type) else 'object of the class'} {_class(given)})"


def _class(given: object) -> str:
    return (given if isinstance(given, type) else type(given)).__name__
