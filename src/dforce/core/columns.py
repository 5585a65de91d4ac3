"""Small tables that a case names: CSV files whose first line names the columns, with their units in brackets."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

from dforce.core import units
from dforce.core.errors import ParameterError, shorten
from dforce.core.files import read_input, text_of

MOST_BYTES = 1_000_000  # a larger file is no small table
LONGEST_HEADING = 200  # characters
HEADING = re.compile(r"\s*(.*?)\s*(?:\[(.*)\]|\((.*)\))?\s*")


def lines_of(file: Path, key: str) -> list[str]:
    """Return the lines of a CSV file that a key of a case names.

    Raises
    ------
    ParameterError
        When the file cannot be read, or is not text.
    """
    table = f"{key} = '{shorten(file.name)}'"
    if file.suffix != ".csv":
        raise ParameterError(f"{table} is not a CSV file: its name must end in .csv")
    content = read_input(file, "table of a case", MOST_BYTES, ParameterError, name=table)
    return text_of(content, table, ParameterError).splitlines()


def read_columns(file: Path, key: str, known: Mapping[str, str]) -> dict[str, list[float]]:
    """Return the columns of a CSV file in SI by name; `known` has the allowed names, each with its SI unit.

    The first line names the columns, such as ``height [nm]`` or ``height (nm)``; numbers without a unit are in SI. Lines that
    begin with ``#`` are comments.

    Raises
    ------
    ParameterError
        When the file cannot be read, a column is not known or named twice, or a cell is no number.
    """
    table = f"{key} = '{shorten(file.name)}'"
    rows = [
        (number, [cell.strip() for cell in next(csv.reader([line]), [])])
        for number, line in enumerate(lines_of(file, key), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise ParameterError(f"{table} is empty; its first line names the columns: {', '.join(known)}")
    headings = [_heading(cell, known, table) for cell in rows[0][1]]
    names = [name for name, _ in headings]
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f"{table} has two columns '{name}'; remove one")
    columns: dict[str, list[float]] = {name: [] for name in names}
    for number, cells in rows[1:]:
        if len(cells) != len(names):
            raise ParameterError(f"{table}, line {number}: it has {len(cells)} cells for {len(names)} columns")
        for (name, unit), cell in zip(headings, cells, strict=True):
            try:
                columns[name].append(units.parse(f"{cell} {unit}".strip(), known[name]))
            except ParameterError as error:
                raise ParameterError(f"{table}, line {number}: {name} {error}") from None
    return columns


def _heading(cell: str, known: Mapping[str, str], table: str) -> tuple[str, str]:
    """Return the name and the unit of a column; the unit is empty where the heading has none."""
    match = HEADING.fullmatch(cell) if len(cell) <= LONGEST_HEADING else None
    name, unit = (match[1], match[2] or match[3] or "") if match else (cell, "")
    if name not in known:
        raise ParameterError(f"{table} has a column '{shorten(name)}'; allowed are {', '.join(known)}")
    if unit:
        try:
            units.parse(f"1 {unit}", known[name])
        except ParameterError as error:
            raise ParameterError(f"{table}: the unit of {name} {error}") from None
    return name, unit
