"""The rows of a CSV file: a case each, with a column for each parameter."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import Any

from dforce.core.errors import CaseError, shorten
from dforce.core.files import reason


def read_rows(path: str | os.PathLike[str]) -> dict[str, list[Any]]:
    """Return the columns of a CSV file by path: SI numbers where a cell is a number, else its text.

    The first row holds the paths; lines that start with ``#`` are comments.

    Raises
    ------
    CaseError
        When the file cannot be read, holds no case, names a column twice, or has a row of another length.
    """
    name = f"'{shorten(str(path), 200)}'"
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as file:
            lines = csv.reader(line for line in file if not line.startswith("#"))
            head = [cell.strip() for cell in next(lines, [])]
            rows = [row for row in lines if row]
    except (OSError, ValueError, csv.Error) as error:
        said = reason(error) if isinstance(error, OSError | ValueError) else str(error)
        raise CaseError(f"{name} cannot be read: {said}") from None
    if not rows:
        raise CaseError(f"{name} holds no case; its first row names parameters, and each other row is a case")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(head):
            raise CaseError(f"case {number} of {name} has {len(row)} values, and {len(head)} parameters are named")
    for column in head:
        if head.count(column) > 1:
            raise CaseError(f"{name} names {column} twice")
    return {column: [_value(row[place]) for row in rows] for place, column in enumerate(head)}


def _value(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell.strip()
