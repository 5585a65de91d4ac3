"""Both directions side by side: ``Amp Trace`` and ``Amp Retrace``; ``Height_nm_Ex`` and ``Height_nm_Rt`` of NanoScope."""

from __future__ import annotations

import re

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.table import APPROACH, RETRACT, SEGMENTS, Column, MeasuredTable
from dforce.inverse.words import split_heading

PHASES = ("in", "out")  # in a heading the phases of a lock-in: "in phase"
TOKENS = {word: part for word, part in SEGMENTS.items() if part in (APPROACH, RETRACT) and word not in PHASES}

Heading = tuple[str, str | None]  # name and unit


def _parted(column: Column) -> tuple[Heading, str | None]:
    """Return a heading without its word for a direction, and the direction; None without one."""
    tokens = re.split(r"([\s_]+)", column.name)
    for place in range(2, len(tokens), 2):
        part = TOKENS.get(tokens[place].lower())
        if part is not None:
            name = "".join(tokens[: place - 1] + tokens[place + 1 :])
            return ((name, column.unit) if column.unit is not None else split_heading(name)), part
    return (column.name, column.unit), None


def has_pairs(table: MeasuredTable) -> bool:
    """Return whether a table has both directions side by side."""
    found = [_parted(column) for column in table.columns]
    approach, retract = ({heading for heading, part in found if part == one} for one in (APPROACH, RETRACT))
    return bool(approach & retract)


def paired(table: MeasuredTable) -> MeasuredTable:
    """Return a table with the retract below the approach; numbers without a direction count for both."""
    halves: dict[str, dict[Heading, Array]] = {APPROACH: {}, RETRACT: {}}
    shared: dict[Heading, Array] = {}
    for column in table.columns:
        heading, part = _parted(column)
        if column.values.dtype.kind == "f":
            (shared if part is None else halves[part])[heading] = np.asarray(column.values, dtype=float)
    both = [heading for heading in halves[APPROACH] if heading in halves[RETRACT]]
    rows = {part: _filled([half[heading] for heading in both]) for part, half in halves.items()}
    columns = tuple(
        Column(
            *heading, np.concatenate([(shared | halves[part])[heading][: rows[part]] for part in (APPROACH, RETRACT)])
        )
        for heading in dict.fromkeys((*shared, *both))
    )
    segments = np.repeat([APPROACH, RETRACT], [rows[APPROACH], rows[RETRACT]])
    lines = table.lines
    if lines is not None:
        lines = np.concatenate([lines[: rows[part]] for part in (APPROACH, RETRACT)])
    return MeasuredTable(columns, table.notes, segments, lines)


def _filled(columns: list[Array]) -> int:
    """Return how many rows are filled: the shorter direction ends in blanks."""
    filled = np.flatnonzero(np.any([np.isfinite(column) for column in columns], axis=0))
    return int(filled[-1]) + 1 if len(filled) else 0
