"""The document that a person works on, as one immutable value: the case as typed, sliders, plots, results shown."""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BeforeValidator, TypeAdapter
from pydantic import Field as Bounded

import dforce as df
from dforce.core.units import split_unit
from dforce.results.curves import Picture

FIRST = "hysteresis"  # the example in a new window
MOST_SLIDERS = 12
MOST_PLOTS = 10
MOST_RESULTS = 50
MOST_QUANTITIES = 100  # of a picture
LONGEST_NAME = 120
LONGEST_FILE = 255  # characters of the name of a file, as file systems have it
NAMED = ("cantilever", "medium")  # sections that a name alone may replace
PLUGINS = "plugins are Python files, not run here; install them as a package"
COLORS = 6  # that the theme has for series
DATA = 1  # the color of measured points, which no result has
RESULT_COLORS = tuple(number for number in range(COLORS) if number != DATA)
NAMING = ("title", "about", "data", "fit", "sweep")  # sections that change no curve: names, and work beside it
LOOKS = ("results", "plots", "set_point", "measured")  # attributes that are not typed: no step of undo changes them
FARTHEST = 1.0  # m, by which measured heights may be shifted
EDITED = ", edited"  # after the title of an example in which something was changed
LOWEST_SET_POINT, HIGHEST_SET_POINT = 0.01, 0.999
LARGEST = 1e100  # of a number on a slider, so that no step of one overflows
WHOLE = 2**63  # whole numbers are below, as in TOML
LONGEST_TEXT = 4000  # characters; texts of a case are no longer
MOST_ITEMS = 100  # of a list of tables: modes, tones, forces
MOST_VALUES = 600_000  # of a table with all that is in it; the text of a case has room for fewer
DEEPEST = 12  # tables in tables


def _plain(given: object, depth: int, left: list[int]) -> Any:
    """Return a copy of a value of a case as it was typed: tables, lists, texts, numbers, true and false."""
    left[0] -= 1
    if left[0] < 0 or depth < 0:
        raise ValueError("a table that is too large")
    if isinstance(given, Mapping):
        return {_text(key, 300): _plain(value, depth - 1, left) for key, value in given.items()}
    if isinstance(given, list | tuple):
        if given and isinstance(given[0], Mapping) and len(given) > MOST_ITEMS:
            raise ValueError("a list that is too long")
        return [_plain(value, depth - 1, left) for value in given]
    if isinstance(given, str):
        return _text(given, LONGEST_TEXT)
    if given is None or isinstance(given, bool):
        return given
    if not (-WHOLE <= given < WHOLE if isinstance(given, int) else isinstance(given, float) and math.isfinite(given)):
        raise ValueError("no number")
    return given


def _text(given: str, longest: int) -> str:
    given.encode()  # half of a surrogate pair cannot be written
    if len(given) > longest:
        raise ValueError("a text that is too long")
    return given


def _renewed(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a case, as an older window may have kept it, with the solver's keys of now."""
    return {name: df.SolverSettings.renewed(given) if name == "solver" else given for name, given in table.items()}


def _with_range(slider: Slider) -> Slider:
    if not slider.low < slider.high:
        raise ValueError("a slider without a range")
    return slider


def _of_quantities(picture: Picture) -> Picture:
    if not 0 < len(picture.y) <= MOST_QUANTITIES or max(map(len, (picture.x, *picture.y))) > LONGEST_NAME:
        raise ValueError("a picture of nothing, or of too much")
    return dataclasses.replace(picture, title="")


# allowed values in a document from a file: of a size that forms can show and files can keep
Name = Annotated[str, Bounded(max_length=LONGEST_NAME)]
Place = Annotated[int, Bounded(strict=True, ge=0, le=MOST_ITEMS)]
Path = Annotated[tuple[Annotated[str, Bounded(max_length=100)] | Place, ...], Bounded(max_length=DEEPEST)]
"""``("forces", 0, "hamaker")``; places in lists count from 0."""
Number = Annotated[float, Bounded(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Table = Annotated[Mapping[str, Any], BeforeValidator(lambda given: _plain(given, DEEPEST, [MOST_VALUES]))]
CaseTable = Annotated[Table, AfterValidator(_renewed)]


@dataclass(frozen=True)
class Slider:
    """A parameter on a slider: its path, and its range in a unit, empty for the unit of the field."""

    path: Path
    low: Number
    high: Number
    unit: Annotated[str, Bounded(max_length=40)] = ""


@dataclass(frozen=True)
class KeptResult:
    """A result that is kept: its identifier in the store, its name, the number of its color, and whether it is drawn."""

    id: Name
    name: Name
    color: Annotated[int, Bounded(strict=True, ge=0, le=COLORS - 1)]
    shown: bool = True


@dataclass(frozen=True)
class MeasuredData:
    """The measured curve that is drawn beside the model.

    Attributes
    ----------
    id, name
        Its identifier among the session's files, and the name of its file.
    settings
        Settings for reading and calibrating the file, as in the table `[data]` of a case.
    shift
        Offset from its heights to average tip-surface distances (m).
    turn
        Offset that is subtracted from its phases (degrees).
    fit
        The identifier of its last fit; empty where there is none.
    confirmed
        The lever and the tip that a person confirmed for it, of :func:`dforce.gui.measured.fitting.lever_and_tip`.
    """

    id: Name
    name: Annotated[str, Bounded(max_length=LONGEST_FILE)]
    settings: Table = field(default_factory=dict)
    shift: Annotated[Number, Bounded(ge=-FARTHEST, le=FARTHEST)] = 0.0
    turn: Annotated[Number, Bounded(ge=-360.0, le=360.0)] = 0.0
    fit: Name = ""
    confirmed: Table = field(default_factory=dict)


@dataclass(frozen=True)
class Document:
    """The case as plain tables with the typed texts, and the settings of its display.

    Nothing in it changes: every edit gives a new document.

    Attributes
    ----------
    table
        The tables of a case file. Texts that are not yet a value stay as they are, so that nothing typed is lost.
    off
        Places of the forces that are switched off for comparison.
    aside
        Input under choices that are not chosen now, by path and choice.
    sliders
        The parameters on sliders.
    plots
        The pictures chosen, each for the results that have its quantities; other results have their usual pictures.
    results
        The results kept, the newest last; they are in :mod:`dforce.gui.document.store`.
    set_point
        The share of the free amplitude at which quantities are read from the curves.
    opened
        The tables as they were opened: a description in them belongs to this case.
    measured
        The measured curve, None while there is none.
    """

    table: CaseTable
    off: Annotated[tuple[Place, ...], Bounded(max_length=MOST_ITEMS)] = ()
    aside: Table = field(default_factory=dict)
    sliders: Annotated[
        tuple[Annotated[Slider, AfterValidator(_with_range)], ...], Bounded(max_length=MOST_SLIDERS)
    ] = ()
    plots: Annotated[
        tuple[Annotated[Picture, AfterValidator(_of_quantities)], ...], Bounded(max_length=MOST_PLOTS)
    ] = ()
    results: Annotated[tuple[KeptResult, ...], Bounded(max_length=MOST_RESULTS)] = ()
    set_point: Annotated[Number, Bounded(ge=LOWEST_SET_POINT, le=HIGHEST_SET_POINT)] = 0.8
    opened: CaseTable = field(default_factory=dict)
    measured: MeasuredData | None = None

    @classmethod
    def of(cls, case: df.Case) -> Self:
        """Return the document of a case, with its free amplitude on a slider."""
        table = tomllib.loads(case.to_toml())
        for name in NAMED:
            if isinstance(table.get(name), str):  # the short form of a file; fields need a place each
                table[name] = {"name": table[name]}
        return cls(table, sliders=_first_slider(table), opened=table)

    @classmethod
    def first(cls) -> Self:
        """Return the document that a new window shows."""
        return cls.of(df.example(FIRST))

    def case(self) -> df.Case:
        """Return the case without the forces that are switched off; its description stays while it is true.

        Once the case is edited, the description goes, and its title shows the change.

        Raises
        ------
        ParameterError
            When the input is not a case; :func:`path_of` returns the path of the wrong value.
        """
        table = dict(self.table)
        if table.pop("plugins", None):
            raise df.ParameterError(PLUGINS)
        if self.edited:
            table.pop("about", None)
        if isinstance(table.get("title"), str):
            table["title"] = self.title
        forces = table.get("forces", [])
        table["forces"] = [force for place, force in enumerate(forces) if place not in self.off]
        if self.measured is not None:
            table["data"] = {**table.get("data", {}), **self.measured.settings, "file": self.measured.name}
        return df.Case(**copy.deepcopy(table))

    @property
    def title(self) -> str:
        """The title; the title of a described case, such as an example, shows when the case has been edited."""
        title = str(self.table.get("title") or "")
        described = "about" in self.opened and title == str(self.opened.get("title") or "")
        return f"{title}{EDITED}" if title and described and self.edited else title

    @property
    def edited(self) -> bool:
        """Whether more than the title differs from the opened case, so that its description may no longer be true."""
        return bool(self.off) or _unnamed(self.table) != _unnamed(self.opened)

    def same_case(self, other: Document) -> bool:
        """Return whether another document has the same case, under any name and display."""
        return self.off == other.off and _unnamed(self.table) == _unnamed(other.table)

    def value(self, path: Path) -> Any:
        """Return the value at a path, None where there is none."""
        found: Any = self.table
        for step in path:
            if isinstance(found, Mapping):
                found = found.get(step)
            elif isinstance(found, list) and isinstance(step, int) and step < len(found):
                found = found[step]
            else:
                return None
        return found

    def put(self, path: Path, value: object) -> Self:
        """Return the document with a value at a path; None removes the value."""
        return dataclasses.replace(self, table=_put(self.table, path, value))

    def add(self, path: Path, item: object) -> Self:
        """Return the document with one more item at the end of a list."""
        return self.put(path, [*(self.value(path) or []), item])

    def remove(self, path: Path) -> Self:
        """Return the document without an item of a list; sliders on it go, sliders behind it move up."""
        *above, place = path
        items = [item for n, item in enumerate(self.value(tuple(above)) or []) if n != place]
        changed = self.put(tuple(above), items)
        sliders = tuple(
            dataclasses.replace(slider, path=moved)
            for slider in self.sliders
            if (moved := _moved(slider.path, path)) is not None
        )
        off = self.off
        if above == ["forces"] and isinstance(place, int):
            off = tuple(n - (n > place) for n in self.off if n != place)
        return dataclasses.replace(changed, sliders=sliders, off=off)

    def switch(self, place: int, on: bool) -> Self:
        """Return the document with a force switched on or off."""
        off = set(self.off) - {place} if on else set(self.off) | {place}
        return dataclasses.replace(self, off=tuple(sorted(off)))

    def choose(self, path: Path, old: str, new: str, value: object) -> Self:
        """Return the document with another choice at a path; the old choice's values are put aside and come back with it.

        `value` is the start of the new choice if it has no earlier input.
        """
        name = ".".join(map(str, path))
        aside = {**self.aside, f"{name}/{old}": self.value(path)}
        return dataclasses.replace(self.put(path, aside.pop(f"{name}/{new}", value)), aside=aside)

    def to_plain(self) -> dict[str, Any]:
        """Return the document as data that JSON can hold."""
        return dataclasses.asdict(self)

    @classmethod
    def from_plain(cls, plain: Any) -> Self:
        """Return a document from the result of :meth:`to_plain`.

        Raises
        ------
        CaseError
            When the data are not a document.
        """
        try:
            return cls._reader().validate_python(plain)
        except (TypeError, ValueError):
            raise df.CaseError("the last project cannot be read") from None

    @classmethod
    @functools.cache  # made anew it takes fifty times as long as reading a document, at every keeping of one
    def _reader(cls) -> TypeAdapter[Self]:
        return TypeAdapter(cls)


def _first_slider(table: Mapping[str, Any]) -> tuple[Slider, ...]:
    """Return a slider of the free amplitude: down to half of it, and up so far that a curve still begins in free motion."""
    drive = table.get("drive", {})
    path: Path = ("drive", "tones", 0, "A0") if drive.get("tones") else ("drive", "A0")
    given = drive["tones"][0].get("A0") if drive.get("tones") else drive.get("A0")
    parts = split_unit(given) if isinstance(given, str) else None
    if parts is None or not float(parts[0]) > 0.0:
        return ()
    value = float(parts[0])
    return (Slider(path, float(f"{0.6 * value:.3g}"), float(f"{1.1 * value:.3g}"), parts[1]),)


def _unnamed(table: Mapping[str, object]) -> dict[str, Any]:
    return {name: part for name, part in table.items() if name not in NAMING}


def _put(table: Any, path: Path, value: Any) -> Any:
    first, *rest = path
    inner = _put(_inside(table, first), tuple(rest), value) if rest else value
    if isinstance(table, list):
        return [inner if place == first else item for place, item in enumerate(table)]
    kept = {key: item for key, item in table.items() if key != first or inner is not None}
    return kept if inner is None else {**kept, first: inner}


def _inside(table: Any, step: str | int) -> Any:
    found = table[step] if isinstance(table, list) and isinstance(step, int) else table.get(step)
    return found if isinstance(found, dict | list) else {}


def _moved(path: Path, removed: Path) -> Path | None:
    """Return a path after an item was removed from a list; None when it led into that item."""
    depth = len(removed) - 1
    place, gone = path[depth] if len(path) > depth else None, removed[-1]
    if path[:depth] != removed[:-1] or not isinstance(place, int) or not isinstance(gone, int) or place < gone:
        return path
    return None if place == gone else (*path[:depth], place - 1, *path[depth + 1 :])


def written(path: Path) -> str:
    """Return a path as sentences about a case file write it, with places counted from 1."""
    return ".".join(str(step + 1) if isinstance(step, int) else step for step in path)


def path_of(document: Document, words: str) -> Path:
    """Return the path that a sentence of dForce starts with, as far as the document has it; () when it has none.

    Sentences count lists from 1, name a force by its model where it is the only one, and do not count forces that are
    switched off.
    """
    path: list[str | int] = []
    on = [n for n in range(len(document.value(("forces",)) or [])) if n not in document.off]
    for step in _words(words):
        here = document.value(tuple(path))
        if path == ["forces"]:
            place = next((n for n in on if document.value(("forces", n, "model")) == step), None)
            if step.isdigit():
                place = on[int(step) - 1] if 0 < int(step) <= len(on) else None
            if place is None:
                return tuple(path)
            path.append(place)
        elif isinstance(here, list):
            if not step.isdigit() or not 0 < int(step) <= len(here):
                return tuple(path)
            path.append(int(step) - 1)
        elif not path and step not in df.Case.model_fields:
            return ()
        else:
            path.append(step)
    return tuple(path)


def _words(sentence: str) -> Iterator[str]:
    """Give the parts of the value that a sentence is about: its first word, or else the first value of a case in it."""
    first, *others = (word.rstrip(":,;") for word in sentence.split(" "))
    if first in df.forces.REGISTRY and others[:1] == ["needs"] and "." not in others[1]:
        first = f"{first}.{others[1]}"
    if "." in first and first.split(".")[0] in df.forces.REGISTRY:  # a sentence of a force starts with its own name
        first = f"forces.{first}"
    if first.split(".")[0] not in df.Case.model_fields:
        first = next((word for word in others if "." in word and word.split(".")[0] in df.Case.model_fields), first)
    yield from first.split(".") if first else ()
