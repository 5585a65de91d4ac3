"""Igor's binary waves (.ibw), as Asylum Research's software writes them, read by igor2.

A wave has a labeled column for each channel, and a note with a line for each setting. It does not contain the units of the
channels: they are the software's units for these labels.
"""

from __future__ import annotations

import io
import logging
import math
import struct

import numpy as np

from dforce.core.arrays import Texts
from dforce.core.errors import ResultError
from dforce.inverse.table import APPROACH, PAUSE, RETRACT, Column, MeasuredTable, Reader

UNITS = {
    **dict.fromkeys(("raw", "zsnsr", "defl", "amp", "amp2"), "m"),
    **dict.fromkeys(("phase", "phase2", "phas2"), "deg"),
    "freq": "Hz",
}
NAMES = {"phas2": "Phase2"}  # labels that are cut
VERSION, HEADERS = 5, 384  # of files with columns; bytes of the headers of the file and of the wave
SPARE = 64  # bytes by which files of some versions are shorter
DIRECTIONS = {1.0: APPROACH, -1.0: RETRACT, 0.0: PAUSE}


def is_igor(content: bytes) -> bool:
    """Return whether a file begins as a binary wave, in either byte order."""
    return len(content) > HEADERS and _order(content) is not None


def _order(content: bytes) -> str | None:
    return next((order for order in "<>" if struct.unpack(f"{order}h", content[:2])[0] == VERSION), None)


def _fits(content: bytes) -> bool:
    """Return whether the lengths in the headers fit the file: igor2 would try for minutes to read wrong lengths."""
    order = _order(content)
    sizes = struct.unpack_from(f"{order}12i", content, 8)  # formula, note, units and labels, each with its length
    (points,) = struct.unpack_from(f"{order}i", content, 76)
    shape = [length for length in struct.unpack_from(f"{order}4i", content, 132) if length]
    parts = sizes[:11]
    if min(*parts, points, *shape, 1) < 0 or math.prod(shape) != points:
        return False
    return bool(HEADERS + points + sum(parts) <= len(content) + SPARE)


def read(content: bytes, name: str) -> list[MeasuredTable]:
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
            f'{name} is a binary wave of Igor and needs igor2: python -m pip install "dforce[readers]"'
        ) from None
    if not _fits(content):
        raise ResultError(f"{name} is damaged or was cut short")
    logging.getLogger("igor2").addHandler(logging.NullHandler())  # it prints parts that it cannot read
    try:
        wave = binarywave.load(io.BytesIO(content))["wave"]
        values, labels, note = np.asarray(wave["wData"]), wave["labels"], wave["note"]
    except Exception as error:  # a damaged file surfaces as any error of igor2, struct or NumPy
        raise ResultError(f"{name} is damaged or was cut short") from error
    named = [_text(label) for label in (labels[1] if len(labels) > 1 else []) if label]
    if values.ndim != 2 or values.dtype.kind not in "fiu" or values.shape[1] != len(named):
        raise ResultError(f"{name} contains no named channels, unlike a curve of Asylum's software")
    notes = _notes(_text(note))
    columns = []
    for number, label in enumerate(named):
        key = label.lower()
        columns.append(Column(NAMES.get(key, label), UNITS.get(key), np.array(values[:, number], dtype=float)))
    segments = _segments(notes, len(values))
    return [MeasuredTable(tuple(columns), notes, segments)]


def _text(content: object) -> str:
    return content.decode("cp1252", "replace") if isinstance(content, bytes) else str(content)


def _notes(note: str) -> dict[str, str]:
    lines = (line.partition(":") for line in note.replace("\n", "\r").split("\r"))
    return {key.strip(): value.strip() for key, colon, value in lines if colon and value.strip()}


def _segments(notes: dict[str, str], rows: int) -> Texts | None:
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


READER = Reader(
    kind="Igor binary wave",
    maker="Asylum Research",
    endings=(".ibw",),
    is_one=is_igor,
    read=read,
    height_grows={"height_sensor": "toward", "height_piezo": "toward"},
    notes={
        "k": "SpringConstant",
        "f0": "ThermalFrequency",
        "Q": "ThermalQ",
        "drive_frequency": "DriveFrequency",
        "sensitivity": "AmpInvOLS",
        "instrument": "MicroscopeModel",
    },
    how="with igor2, the extra `dforce[readers]`",
    seen="no: test files follow the layout of the format",
    export=(
        "**Asylum Research (Igor).** Text is needed only without the extra `readers`. Save the waves of the force curve "
        "(`ZSnsr`, "
        "`Amp`, `Phase`) with *Data, Save Waves, Save Delimited Text*. `Amp` is in m, `ZSnsr` grows toward the sample: "
        '`height_grows="toward"`.'
    ),
)
