"""The rows of a CSV file: a case each, with a column for each parameter."""

from __future__ import annotations

import csv
import io
import os
from collections import Counter
from typing import Any

from dforce.core.errors import CaseError, shorten
from dforce.core.files import read_input

MOST_BYTES = 200_000_000  # a larger table of cases is no sweep of one machine


def read_rows(path: str | os.PathLike[str]) -> dict[str, list[Any]]:
    """Return the columns of a CSV file by path: SI numbers where a cell is a number, else its text.

    The first row holds the paths; lines that start with ``#`` are comments.

    Raises
    ------
    CaseError
        When the file cannot be read, holds no case, names a column twice, or has a row of another length.
    """
    name = f"'{shorten(str(path), 200)}'"
    content = read_input(path, "table of cases", MOST_BYTES, CaseError)
    try:
        text = io.StringIO(content.decode("utf-8-sig"), newline="")
        lines = csv.reader(line for line in text if not line.startswith("#"))
        head = [cell.strip() for cell in next(lines, [])]
        rows = [row for row in lines if row]
    except (ValueError, csv.Error) as error:
        raise CaseError(f"{name} cannot be read: {error}") from None
    if not rows:
        raise CaseError(f"{name} contains no case; its first row names parameters, and each other row is a case")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(head):
            raise CaseError(f"case {number} of {name} has {len(row)} values for {len(head)} parameters")
    for column, times in Counter(head).items():
        if times > 1:
            raise CaseError(f"{name} names {shorten(column)} twice")
    return {column: [_value(row[place]) for row in rows] for place, column in enumerate(head)}


def _value(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell.strip()
