"""The kinds of mistakes that dForce reports; every message is one sentence."""

from __future__ import annotations

import difflib
import functools
import re
import reprlib
import traceback
from collections.abc import Callable, Iterable
from typing import ClassVar, Never, ParamSpec, TypeVar

from dforce.core.argument_kinds import full_signature, is_dataset, miscall, misfit

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

SAYS_SOMETHING = 3  # letters; fewer begin too many names
FEW = 3  # names of an answer
LONGEST_LIST = 150  # characters of names that are listed all
# in which NumPy and xarray end where a result lacks a variable or a dimension, or has others
OF_CHANGED_RESULTS = (LookupError, StopIteration, TypeError, ValueError, AttributeError, NotImplementedError)


class DForceError(Exception):
    """Base class of the errors of dForce; the message is one sentence."""


class ParameterError(DForceError, ValueError):
    """A value, key or name from the user cannot be accepted."""


class UnitError(ParameterError):
    """A text with a unit cannot be read, or its unit has another dimension."""


class CaseError(DForceError, ValueError):
    """A file of a case, of a plan or of the rows of a sweep cannot be read or written."""


class ForceError(DForceError, TypeError):
    """A force model breaks the contract of :class:`dforce.Force`, or its file fails."""


class ResultError(DForceError, OSError):
    """A result, a measured file or a picture cannot be read or written, or a result lacks the necessary motion."""


class ChangedResultError(ParameterError):
    """NumPy or xarray fails on a Dataset: it was changed too much, or the error is inside dForce."""


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Make a public function refuse arguments that do not fit its annotations, with one sentence.

    A function whose first argument is a Dataset also refuses a changed Dataset on which NumPy or xarray fail.

    Raises
    ------
    ParameterError
        At a call: the argument, its value, and the allowed kinds.
    """

    @functools.wraps(function)
    def careful(*args: P.args, **kwargs: P.kwargs) -> R:
        sentence, unknown = miscall(function, args, kwargs)
        if sentence:
            raise ParameterError(sentence + (nearest(unknown, full_signature(function).parameters) if unknown else ""))
        found = misfit(function, args, kwargs)
        if found is not None:
            raise ParameterError(found)
        try:
            return function(*args, **kwargs)
        except OF_CHANGED_RESULTS as error:
            first = next(iter((*args, *kwargs.values())), None)
            if isinstance(error, DForceError) or not is_dataset(first) or _in_one_of((*args, *kwargs.values()), error):
                raise
            reason = shorten(f"{type(error).__name__}: {error}".partition("\n")[0], 120)
            raise ChangedResultError(
                f"{function.__name__} cannot use this Dataset ({reason}); pass it as dForce returned it, or choose parts by "
                "lists, such as .isel(tone=[0]). If it is unchanged, report this error"
            ) from error

    if any(str(kind).startswith("Unpack[") for kind in function.__annotations__.values()):
        careful.__signature__ = full_signature(function)  # type: ignore[attr-defined]
    return careful


def _in_one_of(given: tuple[object, ...], error: BaseException) -> bool:
    """Return whether an error arose in a function among the arguments, such as a progress function."""
    codes = {code for one in given if (code := getattr(one, "__code__", None)) is not None}
    return any(frame.f_code in codes for frame, _ in traceback.walk_tb(error.__traceback__))


@checked
def nearest(name: str, known: Iterable[str], listed_by: str = "") -> str:
    """Return "; did you mean 'x'?" for the known name that is meant, else the known names, or the nearest of many.

    Meant is a name that begins so, has this synonym or these initials (vdw), contains it, or is spelled much like it.

    Parameters
    ----------
    name, known
        The name as typed, and the names that exist.
    listed_by
        The command that lists all of them, for many.
    """
    names = {other: _bare(other) for other in sorted(known)}
    bare = _bare(name)
    fits = str.startswith if len(bare) >= SAYS_SOMETHING else str.__eq__
    begun = [other for other, letters in names.items() if fits(letters, bare)]
    if begun:  # figure3 for figure-3-air: the first letters matter more than the length
        return f"; did you mean '{min(begun, key=len)}'?"
    meant = [other for other, words in _synonyms(known).items() if bare in map(_bare, words)] or short_for(name, names)
    meant = meant or [other for other, letters in names.items() if len(bare) >= SAYS_SOMETHING and bare in letters]
    meant = meant or difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if meant:
        return "; did you mean " + " or ".join(f"'{other}'" for other in meant[:FEW]) + "?"
    if not names:
        return ""
    listed = ", ".join(names)
    if len(listed) <= LONGEST_LIST:
        return f"; known: {listed}"
    near = difflib.get_close_matches(name, names, n=FEW, cutoff=0.45)
    hints = [f"the nearest of {len(names)}: {', '.join(near)}"] if near else []
    hints += [f"{listed_by} lists all"] if listed_by else []
    return "".join(f"; {hint}" for hint in hints) or f"; known: {shorten(listed, LONGEST_LIST)}"


@checked
def short_for(name: str, known: Iterable[str]) -> list[str]:
    """Return the known names that differ by capitals and signs only, else names with these initials: vdw, KV."""
    bare, every = _bare(name), list(known)
    same = [other for other in every if _bare(other) == bare]
    words = {other: re.findall(r"[^\W_]+", other.casefold()) for other in every}
    return same or [other for other in every if len(bare) > 1 and "".join(word[0] for word in words[other]) == bare]


class UnknownNameError(ParameterError, KeyError):
    """A catalog has no entry of this name."""

    __str__ = Exception.__str__  # a KeyError shows its sentence in quotes


class Catalog(dict[str, T]):
    """A dict by names that users type: an unknown one is answered with the nearest, and with the command that lists all."""

    kind: ClassVar[str] = "entry"
    listed_by: ClassVar[str] = ""

    def __missing__(self, name: object) -> Never:
        """Refuse an unknown name."""
        hint = nearest(str(name)[:100], self, self.listed_by)
        raise UnknownNameError(f"there is no {self.kind} '{shorten(str(name))}'{hint}")

    def meant(self, name: str) -> T:
        """Return the entry of a typed name, regardless of capitals and signs; refuse an unknown name."""
        short = short_for(name[:100], self)
        return self[short[0] if len(short) == 1 else name]

    def synonyms(self) -> dict[str, tuple[str, ...]]:
        """Return the other words that the field has for entries."""
        return {}


def _synonyms(known: Iterable[str]) -> dict[str, tuple[str, ...]]:
    return known.synonyms() if isinstance(known, Catalog) else {}


def _bare(name: str) -> str:
    """Return a name without dashes, spaces and capitals, which people leave out."""
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
