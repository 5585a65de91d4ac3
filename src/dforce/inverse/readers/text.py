"""Tables of text: comma, semicolon, tab or blank between the cells, a point or a comma in the numbers, any line ends.

The columns' headings are the line above the numbers, or a comment there; a maker's reader may find them elsewhere. Both
directions may be side by side.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Texts
from dforce.core.errors import ResultError, shorten
from dforce.inverse.readers._pairs import has_pairs, paired
from dforce.inverse.table import Column, MeasuredTable, Reader, segment_of
from dforce.inverse.words import known_unit, split_heading

POINT = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?")
COMMA = re.compile(r"[+-]?(?:\d+(?:,\d*)?|,\d+)(?:[eE][+-]?\d{1,3})?")
LIKE_NUMBER = re.compile(r"[+-]?[\d.,]")
OTHER_WORDS = ("true", "false")  # of a column of marks
NOTHING = ("", "nan", "-nan", "inf", "+inf", "-inf", "infinity", "-infinity", "null", "none", "n/a", "na", "--")
MARKS = ("#", "%")  # of comments
NOTE = re.compile(r"([A-Za-z][\w .\-/]{0,80}?)\s*[:=]\s*(.+)")
MOST_CELLS = 10_000_000
BEGINNING = 100_000  # bytes of a file that show whose software wrote it
MOST_COLUMNS = 1000
SEPARATORS = ",;\t "
LONGEST_QUOTED = 10_000  # characters of a line whose quotes are heeded
COMPRESSED = "is compressed; unpack it"


class TextLine(NamedTuple):
    """A line of the file: its number, its text, and whether it is a comment."""

    number: int
    text: str
    comment: bool


class Style(NamedTuple):
    """The separator of the cells of a line, and the form of a number; no separator means blanks."""

    separator: str
    number: re.Pattern[str]

    def cells(self, text: str) -> list[str]:
        """Return the cells of a line; separators between quotes belong to a cell."""
        if '"' in text and len(text) < LONGEST_QUOTED:
            parts = next(csv.reader([text.strip(" ")], delimiter=self.separator or " ", skipinitialspace=True))
        else:
            parts = text.split(self.separator) if self.separator else text.split()
        return [part.strip().strip('"') for part in parts]

    def value(self, cell: str) -> float | None:
        """Return the number in a cell, NaN for a missing number, None for a word."""
        if self.number.fullmatch(cell):
            return float(cell.replace(",", "."))
        if cell.lower() in NOTHING:
            return float("nan") if "inf" not in cell.lower() else float("inf")
        return None


STYLES = tuple(Style(separator, number) for separator in ("\t", ";", ",", "") for number in (POINT, COMMA))


def read_text(
    content: bytes, name: str, headings_in: Callable[[Sequence[TextLine], int], list[str] | None] | None = None
) -> list[MeasuredTable]:
    """Return the curve in a text file.

    Parameters
    ----------
    content, name
        The file, and its name for a sentence.
    headings_in
        Finds the headings that a maker's software writes in the lines above the numbers, the nearest first, for so many
        columns; None where there are none.

    Raises
    ------
    ResultError
        For a file that is no table of numbers, or was cut short.
    """
    text = decoded(content)
    if text is None:
        raise ResultError(f"{name} is not text")
    lines = list(_lines(text))
    style, rows = _table(lines, name)
    _refuse_cut(text, lines, rows, name)
    first, row = next(iter(rows.items()))
    named = headings_in(lines[:first][::-1], len(row)) if headings_in is not None else None
    headings = named or _headings(lines, first, style, name)
    table = _columns(headings, lines, rows, style)
    return [paired(table) if has_pairs(table) else table]


def decoded(content: bytes) -> str | None:
    """Return the text of a file from any program; None for a file that is no text."""
    zeros = [set(content[start:200:2]) == {0} for start in (0, 1)]  # in UTF-16 every other byte of Latin letters
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings: tuple[str, ...] = ("utf-16",)
    elif any(zeros):
        encodings = ("utf-16-be" if zeros[0] else "utf-16-le",)
    else:
        encodings = ("utf-8-sig", "cp1252")
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text.replace("\r\n", "\n").replace("\r", "\n").replace("\N{MINUS SIGN}", "-")
    return None


def beginning(content: bytes) -> str:
    """Return the beginning of a text file, to recognize a maker's software; empty for a file that is no text."""
    for end in range(BEGINNING, BEGINNING - 4, -1):  # a letter of several bytes may be cut
        text = decoded(content[:end])
        if text is not None:
            return text
    return ""


def _lines(text: str) -> Iterable[TextLine]:
    for number, line in enumerate(text.split("\n"), start=1):
        stripped = line.strip()
        if stripped.strip(SEPARATORS):  # Excel ends a table in rows of separators
            comment = stripped.startswith(MARKS)
            yield TextLine(number, stripped.lstrip("#% ").strip() if comment else line.strip("\n"), comment)


def _is_row(cells: Sequence[str], style: Style) -> bool:
    """Return whether cells are a row of numbers; words of directions, and blanks, may be among them."""
    values = [style.value(cell) for cell in cells]
    numbers = sum(value is not None and bool(cell.strip()) for value, cell in zip(values, cells, strict=True))
    words = [cell for value, cell in zip(values, cells, strict=True) if value is None]
    return numbers >= 2 and all(segment_of(word) is not None or word.lower() in OTHER_WORDS for word in words)


def _table(lines: Sequence[TextLine], name: str) -> tuple[Style, dict[int, list[str]]]:
    """Return how cells are separated, and the cells of each row of the table by its line: the way that makes most rows."""
    plain = [place for place, line in enumerate(lines) if not line.comment]
    best: tuple[int, int, Style, dict[int, list[str]]] | None = None
    sample = [place for place in plain if any(sign.isdigit() for sign in lines[place].text)]
    for rank, style in enumerate(STYLES):
        there = [place for place in sample if style.separator in lines[place].text]
        rows = {place: cells for place in there if _is_row(cells := style.cells(lines[place].text), style)}
        if rows and (best is None or (len(rows), -rank) > best[:2]):
            best = len(rows), -rank, style, rows
        if len(rows) == len(sample):  # no later way makes more
            break
    if best is None:
        raise ResultError(f"{name} contains no table of numbers{_word_between([lines[place] for place in sample])}")
    style, rows = best[2], best[3]
    first, row = next(iter(rows.items()))
    if len(rows) * len(row) > MOST_CELLS:
        raise ResultError(f"{name} contains more than {MOST_CELLS} numbers, too many for a curve")
    width = Counter(map(len, rows.values())).most_common(1)[0][0]
    if width > MOST_COLUMNS:
        raise ResultError(f"{name} has {width} columns; a curve has at most {MOST_COLUMNS}")
    broken = [place for place in plain if place >= first and len(rows.get(place, ())) != width]
    if broken:
        _refuse_broken(lines, broken[0], plain[-1], width, style, name)
    return style, rows


def _word_between(lines: Sequence[TextLine]) -> str:
    """Return the words between numbers for which rows are none, for a sentence; nothing where there are no such rows."""
    for line in lines:
        most, fewest = 0, list[str]()  # the words of the way with most numbers: by another way "1,5" is a word, too
        for style in STYLES:
            cells = style.cells(line.text) if style.separator else []
            words = [cell for cell in cells if style.value(cell) is None and segment_of(cell) is None]
            like = sum(LIKE_NUMBER.match(word) is not None for word in words)
            numbers = len(cells) - len(words)
            if words and numbers + like >= 2 and (not fewest or numbers > most):
                most, fewest = numbers, words
        if fewest:
            remedy = "write numbers as 1234.5 or 1.2345E3" if most < 2 else "remove columns of words, except directions"
            return f": '{shorten(fewest[0], 30)}' in line {line.number} is not a number; {remedy}"
    return ""


def _refuse_broken(lines: Sequence[TextLine], place: int, last: int, width: int, style: Style, name: str) -> None:
    line, cells = lines[place], style.cells(lines[place].text)
    if place == last and len(cells) <= width:
        raise _cut(line, name)
    words = [cell for cell in cells if style.value(cell) is None and segment_of(cell) is None]
    remedy = "remove this line, or the lines above it"
    if len(cells) != width:
        raise ResultError(f"{name} has {len(cells)} cells in line {line.number} and {width} in the others; {remedy}")
    raise ResultError(
        f"{name} has '{shorten(words[0] if words else line.text, 30)}' in line {line.number}, which is not a number; {remedy}"
    )


def _cut(line: TextLine, name: str) -> ResultError:
    return ResultError(
        f"{name} ends in the middle of line {line.number}: the file is incomplete; "
        "copy it again, or remove this line to read the rest"
    )


def _refuse_cut(text: str, lines: Sequence[TextLine], rows: Mapping[int, Sequence[str]], name: str) -> None:
    """Refuse a last number that may have lost its last digits: the file ends with it, and it is the shortest of all."""
    if text.endswith("\n") or len(rows) < 2 or len(lines) - 1 not in rows:
        return
    ends = [cells[-1] for cells in rows.values()]
    if not ends[-1]:
        raise _cut(lines[-1], name)
    if len(ends[-1]) < min(map(len, ends[:-1])):
        raise ResultError(
            f"{name} ends without a line end at '{shorten(ends[-1], 30)}', shorter than every other number of its "
            "column: the file may be incomplete; end the line, or remove it"
        )


def _headings(lines: Sequence[TextLine], first: int, style: Style, name: str) -> list[str]:
    """Return the headings of the columns: the nearest line above the numbers that has as many words."""
    row = style.cells(lines[first].text)
    width, filled, above = len(row), len(_trimmed(row)), list(reversed(lines[:first]))
    for place, line in enumerate(above):
        for cells in (style.cells(line.text), line.text.split("\t"), line.text.split(",")):
            cells = _trimmed([cell.strip() for cell in cells])
            if filled <= len(cells) <= width and all(style.value(cell) is None for cell in cells if cell):
                found = _with_units(cells, above[place + 1 :], style)
                return found + [""] * (width - len(found))
        if not line.comment:
            found = [cell for cell in style.cells(line.text) if cell]
            if len(found) > 1 and len(found) != width and len(found) * 2 == width and style.separator == ",":
                raise ResultError(
                    f"{name} has {len(found)} headings above {width} columns: commas separate the numbers and are also in "
                    "them; export it with semicolons or tabs"
                )
            break
    return [f"column {number}" for number in range(1, width + 1)]


def _trimmed(cells: list[str]) -> list[str]:
    """Return cells without the empty ones at their end, which a separator at the end of a line makes."""
    return cells[: max((place for place, cell in enumerate(cells, start=1) if cell), default=0)]


def _with_units(cells: list[str], above: Sequence[TextLine], style: Style) -> list[str]:
    """Return headings with their units, where the line of names is above a line of units.

    Below the units there may be a line of remarks.
    """
    names = _trimmed(style.cells(above[0].text)) if above and not above[0].comment else []
    if len(names) != len(cells):
        return cells
    if _are_units(cells):
        return [f"{name} [{unit.strip('[]()')}]" for name, unit in zip(names, cells, strict=True)]
    found = _with_units(names, above[1:], style) if _are_units(names) else names
    return cells if found is names else found


def _are_units(cells: Sequence[str]) -> bool:
    insides = (cell.strip("[]()") for cell in cells)
    return all(known_unit(inside) is not None or split_heading(f"of [{inside}]")[1] for inside in insides)


def _columns(
    headings: Sequence[str], lines: Sequence[TextLine], rows: Mapping[int, Sequence[str]], style: Style
) -> MeasuredTable:
    """Return the table of a file."""
    columns = []
    for number, heading in enumerate(headings):
        column = [row[number] for row in rows.values()]
        values = [style.value(cell) for cell in column]
        title, unit = split_heading(heading)
        if not title and not any(column):
            continue
        if any(value is None for value in values):
            columns.append(Column(title, None, np.array(column)))
        else:
            columns.append(Column(title, unit, np.array(values, dtype=float)))
    numbers = np.array([lines[place].number for place in rows])
    notes = _notes(line for line in lines if line.comment)
    return MeasuredTable(tuple(columns), notes, _segments(lines, list(rows)), numbers)


def _notes(comments: Iterable[TextLine]) -> dict[str, str]:
    """Return the settings that the comments of a file note."""
    notes: dict[str, str] = {}
    for line in comments:
        match = NOTE.fullmatch(line.text)
        if match:
            notes.setdefault(match[1].strip(), match[2].strip())
    return notes


def _segments(lines: Sequence[TextLine], rows: Sequence[int]) -> Texts | None:
    """Return the part of the curve of each row, from comments between the blocks."""
    said = {
        place: segment_of(line.text.partition(":")[2])
        for place, line in enumerate(lines)
        if line.comment and line.text.partition(":")[0].strip().lower() in ("segment", "direction")
    }
    said = {place: word for place, word in said.items() if word is not None}
    if not said or min(said) > rows[0]:
        return None
    starts = np.array(sorted(said))
    latest = starts[np.searchsorted(starts, np.array(rows), side="right") - 1]
    return np.array([said[place] for place in latest])


READER = Reader(
    kind="text",
    endings=(".csv", ".tsv", ".txt", ".dat", ".asc"),
    is_one=lambda content: decoded(content) is not None,
    read=read_text,
    not_read={
        b"\x1f\x8b": COMPRESSED,
        b"BZh": COMPRESSED,
        b"\xfd7zXZ": COMPRESSED,
        b"\xd0\xcf\x11\xe0": "is a workbook of Excel; save the sheet as CSV",
    },
    how="comma, semicolon, tab or blanks; points or commas in the numbers; comments with `#` or `%`",
    seen="–",
    export="**Nanonis, home-built.** Any table with headings and units; a lock-in's `R` is usually rms.",
)
