"""The kinds of mistakes that dForce reports; every message is one sentence."""

from __future__ import annotations

import difflib
import functools
import reprlib
from collections.abc import Callable, Iterable
from typing import ParamSpec, TypeVar

from dforce.core.argument_kinds import full_signature, miscall, misfit

P = ParamSpec("P")
R = TypeVar("R")

SAYS_SOMETHING = 3  # letters; fewer begin too many names


class DForceError(Exception):
    """Base of the errors of dForce for the user; its message is one sentence."""


class ParameterError(DForceError, ValueError):
    """A value, key or name from the user cannot be accepted."""


class UnitError(ParameterError):
    """A text with a unit cannot be read, or its unit has another dimension."""


class CaseError(DForceError, ValueError):
    """A case file cannot be read as a case."""


class ForceError(DForceError, TypeError):
    """A force model breaks the contract of :class:`dforce.Force`."""


class ResultError(DForceError, OSError):
    """A file of results cannot be read or written."""


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Make a public function refuse arguments of a wrong kind, as its annotations tell it, with one sentence.

    Raises
    ------
    ParameterError
        At a call: which argument, what was given, and what is taken.
    """

    @functools.wraps(function)
    def careful(*args: P.args, **kwargs: P.kwargs) -> R:
        sentence, unknown = miscall(function, args, kwargs)
        if sentence:
            raise ParameterError(sentence + (nearest(unknown, full_signature(function).parameters) if unknown else ""))
        found = misfit(function, args, kwargs)
        if found is not None:
            raise ParameterError(found)
        return function(*args, **kwargs)

    if any(str(kind).startswith("Unpack[") for kind in function.__annotations__.values()):
        careful.__signature__ = full_signature(function)  # type: ignore[attr-defined]
    return careful


@checked
def nearest(name: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" for the known name nearest to `name`, else the list of known names."""
    names = sorted(known)
    bare = _bare(name)
    fits = str.startswith if len(bare) >= SAYS_SOMETHING else str.__eq__
    begun = [other for other in names if fits(_bare(other), bare)]
    if begun:  # figure3 for figure-3-air: the first letters say more than the length
        return f"; did you mean '{min(begun, key=len)}'?"
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if close:
        return f"; did you mean '{close[0]}'?"
    if not names:
        return ""
    return f"; known: {', '.join(names)}"


def _bare(name: str) -> str:
    """Return a name without what people leave out: dashes, spaces, capitals."""
    return "".join(c for c in name.casefold() if c.isalnum())


@checked
def shorten(value: object, length: int = 60) -> str:
    """Return the value as text of at most `length` characters, safe to print in a sentence."""
    if isinstance(value, str):
        text = value
    elif isinstance(value, bool):
        text = str(value).lower()  # as TOML and JSON write it
    else:
        text = _repr(value)
    printable = "".join(c if c.isprintable() else "?" for c in text[: length + 1])
    return printable if len(printable) <= length else printable[: length - 3] + "..."


def _repr(value: object) -> str:
    if isinstance(value, int) and abs(value) > 10**100:
        return "a number of more than 100 digits"  # Python refuses to write out one of 5000
    brief = reprlib.Repr()  # plain repr takes long on a list of a million numbers
    brief.maxlevel, brief.maxother, brief.maxstring = 3, 200, 200
    return brief.repr(value)
