"""A reader of files, and its tables: columns as in the file, before their quantities are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from dforce.core.arrays import Array, Indices, Texts
from dforce.inverse.words import ABOVE_THE_SAMPLE, bare, quantity_of

APPROACH, RETRACT, PAUSE = "approach", "retract", "pause"
SEGMENTS = {
    **dict.fromkeys(("approach", "extend", "extending", "ext", "ex", "trace", "forward", "fwd", "in"), APPROACH),
    **dict.fromkeys(("retract", "retracting", "ret", "rt", "retrace", "backward", "bwd", "withdraw", "out"), RETRACT),
    **dict.fromkeys(("pause", "dwell", "hold"), PAUSE),
}
"""The words of makers for the parts of a curve."""


class Column(NamedTuple):
    """A column of a file: its name, its unit if the file contains it, and its values, numbers or words."""

    name: str
    unit: str | None
    values: Array | Texts


@dataclass(frozen=True)
class Reader:
    """A kind of file with measured curves: its test, its reader, and the conventions of its maker.

    Attributes
    ----------
    kind
        Kind of file, in words: ``"Nanosurf .nid"``.
    endings
        Endings of the names of such files, in small letters: ``(".nid",)``.
    is_one
        Takes the bytes of a file, and returns whether it is of this kind.
    read
        Takes the bytes of such a file and its name for a sentence, and returns its curves. It raises ``ResultError``
        with one sentence for a file that is damaged or has no curve.
    maker
        Maker of the instrument; empty for a format of many programs.
    height_grows
        Direction of larger numbers, ``"away"`` from the sample or ``"toward"`` it, for each of ``"height_sensor"``,
        ``"height_piezo"`` and ``"height"`` with a known sign in the maker's files. Any other sign is found from the curve,
        or asked for.
    names
        Quantity of :data:`dforce.inverse.words.MEANINGS` by a name of a column that means another one elsewhere.
    notes
        Key of the file for each of ``k f0 Q A0 drive_frequency sensitivity instrument`` that it notes.
    amplitude_by_version
        Whether amplitudes are rms or zero to peak by the version of the maker's software, so that a user is asked.
    not_read
        Beginning of files of this maker that no reader takes, and the sentence with the remedy.
    how, seen, export
        For the documentation: how such a file is read, whether on a file of an instrument, and how to export a curve.
    """

    kind: str
    endings: tuple[str, ...]
    is_one: Callable[[bytes], bool]
    read: Callable[[bytes, str], list[MeasuredTable]]
    maker: str = ""
    height_grows: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)
    amplitude_by_version: bool = False
    not_read: Mapping[bytes, str] = field(default_factory=dict)
    how: str = ""
    seen: str = ""
    export: str = ""

    def __str__(self) -> str:
        return f"{self.kind} of {self.maker}" if self.maker and self.maker not in self.kind else self.kind

    def tables(self, content: bytes, name: str) -> list[MeasuredTable]:
        """Return the curves in a file of this kind, each with its reader.

        Raises
        ------
        ResultError
            When the file is damaged or has no curve.
        """
        return [replace(table, reader=self) for table in self.read(content, name)]

    def sign_of(self, column: str) -> str | None:
        """Return the direction of larger heights, "away" or "toward", if the maker or the name of the column determines it."""
        grows = self.height_grows.get(quantity_of(column, self.names) or "")
        return "away" if grows is None and bare(column) in ABOVE_THE_SAMPLE else grows


OF_NOBODY = Reader("table", (), lambda content: False, lambda content, name: [])


@dataclass(frozen=True)
class MeasuredTable:
    """A curve as in its file.

    Attributes
    ----------
    columns
        All of one length.
    notes
        Other entries of the file, as written there.
    segments
        Part of the curve of each row, in the words of :data:`SEGMENTS`; None where the file does not contain it.
    lines
        Line of each row in the file; None where it has no lines.
    position
        Place of the curve on a map, x and y (m).
    label
        Name of the curve in the file; may be empty.
    reader
        Its reader, set by :meth:`Reader.tables`.
    """

    columns: tuple[Column, ...]
    notes: Mapping[str, str] = field(default_factory=dict)
    segments: Texts | None = None
    lines: Indices | None = None
    position: tuple[float, float] | None = None
    label: str = ""
    reader: Reader = OF_NOBODY

    @property
    def numbers(self) -> list[Column]:
        """The columns of numbers."""
        return [column for column in self.columns if column.values.dtype.kind == "f"]

    def place(self, row: int) -> str:
        """Return the place of a row (from 0), for a sentence."""
        return f"row {row + 1}" if self.lines is None else f"line {self.lines[row]}"

    def part(self, rows: Any, position: tuple[float, float] | None = None, label: str = "") -> MeasuredTable:
        """Return some of the rows."""
        return replace(
            self,
            columns=tuple(column._replace(values=column.values[rows]) for column in self.columns),
            segments=None if self.segments is None else self.segments[rows],
            lines=None if self.lines is None else self.lines[rows],
            position=position or self.position,
            label=label or self.label,
        )


def segment_of(word: str) -> str | None:
    """Return the part of a curve for a maker's word."""
    return SEGMENTS.get(word.strip().strip("\"'").lower())
