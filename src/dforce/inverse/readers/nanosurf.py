"""Nanosurf's .nid: a text of sections and keys, ``#!``, then the channels as blocks of whole numbers.

A channel of a spectroscopy has a row for each curve. Its numbers fill the range `Dim2Min` to `Dim2Min + Dim2Range`; the
heights of the rows are equal steps over `Dim0Range`, or a channel of the sensor.
"""

from __future__ import annotations

import configparser
import math
from typing import Any, NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import ResultError
from dforce.inverse.table import APPROACH, RETRACT, Column, MeasuredTable, Reader
from dforce.inverse.words import known_unit

START, END = b"[DataSet]", b"#!"
FRAMES = {"Spec forward": APPROACH, "Spec backward": RETRACT}
SPECTRUM = "Spectrum FFT"
MOST_CHANNELS = 10_000


class Channel(NamedTuple):
    """A channel: its keys, and where its block begins, counted from the first block (bytes)."""

    keys: dict[str, str]
    start: int

    def whole(self, key: str) -> int:
        """Return a whole number, not negative."""
        number = int(self.keys[key])
        if number < 0:
            raise ValueError(key)
        return number

    @property
    def size(self) -> int:
        """Bytes of the block."""
        return self.whole("Points") * self.whole("Lines") * self.whole("SaveBits") // 8

    def row(self, blocks: bytes, line: int) -> Array:
        """Return a row of the block in the channel's unit; a curve may be shorter than the row."""
        bits = self.whole("SaveBits")
        if bits not in (16, 32) or self.keys.get("SaveSign") != "Signed" or self.keys.get("SaveOrder") != "Intel":
            raise ValueError("numbers of another kind")
        start = self.start + line * self.whole("Points") * bits // 8
        raw = np.frombuffer(blocks, f"<i{bits // 8}", self.length(line), start)
        share = (raw.astype(float) + 2.0 ** (bits - 1)) / 2.0**bits
        return float(self.keys["Dim2Min"]) + share * float(self.keys["Dim2Range"])

    def length(self, line: int) -> int:
        """Return how many numbers of a row belong to its curve."""
        points = self.whole("Points")
        return min(points, int(self.keys.get(f"LineDim{line}Points", points)))

    def heights(self, line: int) -> Array:
        """Return the heights (or frequencies) of a row, as they were commanded."""
        kept = self.length(line)
        low = float(self.keys.get(f"LineDim{line}Min", self.keys["Dim0Min"]))
        span = float(self.keys.get(f"LineDim{line}Range", self.keys["Dim0Range"]))
        return low + span * np.arange(kept) / max(kept - 1, 1)


def read(content: bytes, name: str) -> list[MeasuredTable]:
    """Return the curves in a .nid file; a spectrum of the thermal noise counts as one.

    Raises
    ------
    ResultError
        When it is damaged or was cut short, or holds images alone.
    """
    try:
        settings, channels, blocks = _parts(content)
        notes = {
            key: value
            for section in ("DataSet-Info", "DataSet\\DataSetInfos\\Global", "DataSet\\DataSetInfos\\Spec")
            if settings.has_section(section)
            for key, value in settings[section].items()
            if value
        }
        tables = _curves(channels, blocks, notes)
    except (ArithmeticError, LookupError, ValueError, configparser.Error) as error:
        raise ResultError(f"{name} is damaged or was cut short") from error
    if not tables:
        raise ResultError(f"{name} contains no spectroscopy, only images")
    return tables


def _parts(content: bytes) -> tuple[configparser.ConfigParser, list[Channel], bytes]:
    """Return the sections, the channels in the order of their blocks, and all blocks."""
    end = content.index(END)
    settings = configparser.ConfigParser(
        interpolation=None, strict=False, delimiters=("=",), comment_prefixes=(), empty_lines_in_values=False
    )
    settings.optionxform = str  # type: ignore[assignment, method-assign]
    settings.read_string(content[:end].decode("utf-8", "replace").replace("\r\n", "\n"))
    data, channels, start = settings["DataSet"], [], 0
    for group in range(int(data["GroupCount"])):
        for number in range(int(data[f"Gr{group}-Count"])):
            section = data.get(f"Gr{group}-Ch{number}")
            if section is None or not settings.has_section(section):
                continue
            channels.append(Channel(dict(settings[section]), start))
            start += channels[-1].size
            if len(channels) > MOST_CHANNELS:
                raise ValueError("more channels than a file has")
    blocks = content[end + len(END) :]
    if len(blocks) != start:
        raise ValueError("the blocks differ from the list of sections")
    return settings, channels, blocks


def _curves(channels: list[Channel], blocks: bytes, notes: dict[str, str]) -> list[MeasuredTable]:
    """Return a table for each curve: the channels of both directions, one below the other."""
    groups: dict[str, list[Channel]] = {}
    for channel in channels:
        frame = channel.keys.get("Frame", "")
        if frame in FRAMES or frame == SPECTRUM:
            groups.setdefault(frame, []).append(channel)
    if not groups:
        return []
    lines = min(channel.whole("Lines") for group in groups.values() for channel in group)
    last = min(int(channel.keys.get("CurLine", lines - 1)) for group in groups.values() for channel in group)
    return [_curve(groups, blocks, line, notes) for line in range(min(lines, last + 1))]


def _curve(groups: dict[str, list[Channel]], blocks: bytes, line: int, notes: dict[str, str]) -> MeasuredTable:
    parts = [_part(group, blocks, line) for group in groups.values()]
    common = [key for key in parts[0] if all(key in part for part in parts)]
    columns = []
    for key in common:
        values = np.concatenate([part[key] for part in parts])
        columns.append(Column(key[0], known_unit(key[1]), values))
    frames = [FRAMES.get(frame, "") for frame in groups]
    rows = [len(part[common[0]]) for part in parts]
    segments = np.repeat(frames, rows) if all(frames) else None
    return MeasuredTable(tuple(columns), notes, segments)


def _part(group: list[Channel], blocks: bytes, line: int) -> dict[tuple[str, str], Array]:
    """Return the channels of one direction by name and unit, the commanded height first."""
    first = group[0]
    found: dict[tuple[str, str], Any] = {
        (first.keys.get("Dim0Name", "Z-Axis").rstrip("*"), first.keys.get("Dim0Unit", "")): first.heights(line)
    }
    for channel in group:
        found[channel.keys["Dim2Name"], channel.keys.get("Dim2Unit", "")] = channel.row(blocks, line)
    if not all(math.isfinite(value) for column in found.values() for value in column[:1]):
        raise ValueError("a range that is not a number")
    if len({len(column) for column in found.values()}) != 1:
        raise ValueError("channels of different lengths")
    return found


READER = Reader(
    kind="Nanosurf .nid",
    maker="Nanosurf",
    endings=(".nid",),
    is_one=lambda content: content.startswith(START),
    read=read,
    height_grows={"height_sensor": "toward", "height_piezo": "toward"},
    notes={"k": "Spring Constant:", "instrument": "Head type"},
    how="each row of a spectroscopy is a curve",
    seen="heights and numbers: one file (FlexAFM, software 3.10); amplitude and phase: no",
    export=(
        "**Nanosurf.** dForce reads the `.nid` itself. In the tested file heights grow toward the sample, and the retract is "
        "in "
        "the order of the approach; both are reversed. An amplitude in volts needs `sensitivity`."
    ),
)
