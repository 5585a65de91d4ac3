"""Both directions side by side, as Bruker's NanoScope exports them: ``Height_Sensor_nm_Ex`` beside ``Height_Sensor_nm_Rt``."""

from __future__ import annotations

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.table import APPROACH, RETRACT, Column, MeasuredTable
from dforce.inverse.words import split_heading

TOKENS = {"ex": APPROACH, "rt": RETRACT}


def _part(name: str) -> tuple[str, str | None]:
    """Return a heading without its sign of a direction, and the direction."""
    tokens = name.split("_")
    for place, token in enumerate(tokens):
        if token.lower() in TOKENS and place > 0:
            return "_".join(tokens[:place] + tokens[place + 1 :]), TOKENS[token.lower()]
    return name, None


def has_pairs(table: MeasuredTable) -> bool:
    """Say whether a table holds both directions side by side."""
    found = [_part(_whole(column)) for column in table.columns]
    names = [{name for name, part in found if part == direction} for direction in (APPROACH, RETRACT)]
    return bool(names[0] & names[1])


def _whole(column: Column) -> str:
    return column.name if column.unit is None else f"{column.name}_{column.unit}"


def paired(table: MeasuredTable) -> MeasuredTable:
    """Return a table in which the retract stands below the approach; columns without a direction are left out."""
    halves: dict[str, dict[str, Array]] = {APPROACH: {}, RETRACT: {}}
    for column in table.columns:
        name, part = _part(_whole(column))
        if part is not None and column.values.dtype.kind == "f":
            halves[part][name] = np.asarray(column.values, dtype=float)
    names = [name for name in halves[APPROACH] if name in halves[RETRACT]]
    rows = {part: _filled([half[name] for name in names]) for part, half in halves.items()}
    columns = []
    for name in names:
        values = np.concatenate([halves[part][name][: rows[part]] for part in (APPROACH, RETRACT)])
        title, unit = split_heading(name)
        columns.append(Column(title, unit, values))
    segments = np.repeat([APPROACH, RETRACT], [rows[APPROACH], rows[RETRACT]])
    lines = table.lines
    if lines is not None:
        lines = np.concatenate([lines[: rows[part]] for part in (APPROACH, RETRACT)])
    return MeasuredTable(tuple(columns), table.notes, segments, lines)


def _filled(columns: list[Array]) -> int:
    """Return how many rows are filled: the shorter direction ends in blanks."""
    filled = np.flatnonzero(np.any([np.isfinite(column) for column in columns], axis=0))
    return int(filled[-1]) + 1 if len(filled) else 0
