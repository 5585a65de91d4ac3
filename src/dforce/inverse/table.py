"""What a reader of files gives: columns as they are written, before anyone says what they mean."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

Floats = np.ndarray[Any, np.dtype[np.float64]]
Words = np.ndarray[Any, np.dtype[np.str_]]

APPROACH, RETRACT, PAUSE = "approach", "retract", "pause"
SEGMENTS = {
    **dict.fromkeys(("approach", "extend", "extending", "ext", "ex", "trace", "forward", "fwd", "in"), APPROACH),
    **dict.fromkeys(("retract", "retracting", "ret", "rt", "retrace", "backward", "bwd", "withdraw", "out"), RETRACT),
    **dict.fromkeys(("pause", "dwell", "hold"), PAUSE),
}
"""The words of makers for the parts of a curve."""


class Column(NamedTuple):
    """A column of a file: its name, its unit where the file tells it, and its values, numbers or words."""

    name: str
    unit: str | None
    values: Floats | Words


@dataclass(frozen=True)
class Table:
    """A curve as a file holds it.

    Attributes
    ----------
    columns
        All of one length.
    source
        Kind of file, in words.
    maker
        Maker of the instrument, where the file tells it.
    notes
        What else the file tells, as it is written there.
    segments
        Part of the curve that each row belongs to, in the words of :data:`SEGMENTS`; None where the file does not tell.
    lines
        Line of the file that each row stands in; None where it has no lines.
    position
        Place of the curve on a map, x and y (m).
    label
        What the file calls the curve among others; may be empty.
    """

    columns: tuple[Column, ...]
    source: str
    maker: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)
    segments: Words | None = None
    lines: np.ndarray[Any, np.dtype[np.int64]] | None = None
    position: tuple[float, float] | None = None
    label: str = ""

    def place(self, row: int) -> str:
        """Return where a row (from 0) stands, for a sentence."""
        return f"row {row + 1}" if self.lines is None else f"line {self.lines[row]}"

    def part(self, rows: Any, position: tuple[float, float] | None = None, label: str = "") -> Table:
        """Return some of the rows."""
        return Table(
            tuple(column._replace(values=column.values[rows]) for column in self.columns),
            self.source,
            self.maker,
            self.notes,
            None if self.segments is None else self.segments[rows],
            None if self.lines is None else self.lines[rows],
            position or self.position,
            label or self.label,
        )


def segment_of(word: str) -> str | None:
    """Return the part of a curve that a word of a maker stands for."""
    return SEGMENTS.get(word.strip().strip("\"'").lower())
