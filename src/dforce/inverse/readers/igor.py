"""Igor's binary waves (.ibw), as Asylum Research's software writes them, read by igor2.

A wave holds a column for each channel, whose labels say which it is, and a note with a line for each setting. The units of
the channels stand nowhere: they are those that the software gives to these names.
"""

from __future__ import annotations

import io
import logging
import struct
from typing import Any

import numpy as np

from dforce.errors import ResultError
from dforce.inverse.table import APPROACH, PAUSE, RETRACT, Column, Table, Words

UNITS = {
    "raw": "m", "zsnsr": "m", "defl": "m", "amp": "m", "amp2": "m", "phase": "deg", "phase2": "deg", "phas2": "deg",
    "freq": "Hz",
}  # fmt: skip
NAMES = {"phas2": "Phase2"}  # labels that are cut
VERSIONS = (2, 5)
DIRECTIONS = {1.0: APPROACH, -1.0: RETRACT, 0.0: PAUSE}


def is_igor(content: bytes) -> bool:
    """Say whether a file begins as a binary wave, whichever way its bytes go."""
    if len(content) < 64:
        return False
    return struct.unpack("<h", content[:2])[0] in VERSIONS or struct.unpack(">h", content[:2])[0] in VERSIONS


def read(content: bytes, name: str) -> list[Table]:
    """Return the curve in a binary wave.

    Raises
    ------
    ResultError
        When igor2 is not installed, the file is damaged, or the wave is no table of named channels.
    """
    try:
        from igor2 import binarywave
    except ImportError:
        raise ResultError(
            f"{name} is a binary wave of Igor, which igor2 reads: python -m pip install 'dforce[readers]'"
        ) from None
    logging.getLogger("igor2").addHandler(logging.NullHandler())  # it prints what it cannot read
    try:
        wave = binarywave.load(io.BytesIO(content))["wave"]
        values, labels, note = np.asarray(wave["wData"]), wave["labels"], wave["note"]
    except Exception as error:  # a damaged file surfaces as any error of igor2, struct or NumPy
        raise ResultError(f"{name} is damaged or was cut short") from error
    named = [_text(label) for label in (labels[1] if len(labels) > 1 else []) if label]
    if values.ndim != 2 or values.dtype.kind not in "fiu" or values.shape[1] != len(named):
        raise ResultError(f"{name} holds no channels with names, as a curve of Asylum's software does")
    notes = _notes(_text(note))
    columns = []
    for number, label in enumerate(named):
        key = label.lower()
        columns.append(Column(NAMES.get(key, label), UNITS.get(key), np.array(values[:, number], dtype=float)))
    segments = _segments(notes, len(values))
    return [Table(tuple(columns), "Igor binary wave", "Asylum Research", notes, segments)]


def _text(content: Any) -> str:
    return content.decode("cp1252", "replace") if isinstance(content, bytes) else str(content)


def _notes(note: str) -> dict[str, str]:
    lines = (line.partition(":") for line in note.replace("\n", "\r").split("\r"))
    return {key.strip(): value.strip() for key, colon, value in lines if colon and value.strip()}


def _segments(notes: dict[str, str], rows: int) -> Words | None:
    """Return the part that each row belongs to: the note lists where parts end, and which way each goes."""
    ends, ways = _numbers(notes.get("Indexes", "")), _numbers(notes.get("Direction", ""))
    if len(ends) < 2 or len(ends) != len(ways) or ends != sorted(ends) or not 0 <= ends[0] <= ends[-1] <= rows:
        return None
    segments = np.full(rows, PAUSE, dtype="<U8")
    for start, end, way in zip(ends, ends[1:], ways[1:], strict=False):
        first = int(start) + (start > ends[0])  # where a part ends belongs to it
        segments[first : int(end) + 1] = DIRECTIONS.get(way, PAUSE)
    return segments


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.replace(";", ",").split(",") if part.strip()]
    except ValueError:
        return []
