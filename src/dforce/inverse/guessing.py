"""Guesses of the quantities in the columns of a file: by their names, their units, and the course of their numbers.

The reader takes a column by its name alone. A guess goes further, and a person confirms it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.placing import HEIGHTS, NEEDED, columns_by_name
from dforce.inverse.table import Column, MeasuredTable
from dforce.inverse.words import DENSITY, bare, is_of, quantity_of

# beginnings of words in headings that no reader has as a whole; single letters are whole words
STEMS = {
    "height": ("z", "height", "piezo", "ramp", "dist", "sep", "ext", "stage", "scanner", "position"),
    "amplitude": ("amp", "mag", "rms", "r"),
    "phase": ("ph", "theta", "lag", "angle"),
}
UNITS = {"height": ("m",), "amplitude": ("m", "V"), "phase": ("degree",)}
NAME, UNIT, WAY = 2.0, 1.0, 0.5  # weights of the evidence for a guess
WINDING = 2.2  # times its range: a height walks once to the sample and back


class Guess(NamedTuple):
    """A column of a quantity, and whether its name alone decides."""

    column: Column
    sure: bool


def guess_spectrum(table: MeasuredTable) -> dict[str, Guess]:
    """Return the columns of a thermal spectrum, `frequency` and `density`; empty for a table of something else."""
    found: dict[str, Guess] = {}
    for column in table.numbers:
        if quantity_of(column.name, table.reader.names) == "frequency" or bare(column.name) == "f":
            found.setdefault("frequency", Guess(column, True))
        elif bare(column.name) in (*DENSITY, "spectraldensity"):
            found.setdefault("density", Guess(column, True))
        elif column.unit is not None and "/Hz" in column.unit:
            found.setdefault("density", Guess(column, False))
    is_curve = any(quantity_of(column.name, table.reader.names) in (*HEIGHTS, "phase") for column in table.columns)
    return found if len(found) == 2 and not is_curve else {}


def guess_curve(table: MeasuredTable) -> dict[str, Guess]:
    """Return the columns of a curve by quantity, each column once; a quantity that nothing speaks for is missing."""
    claims = columns_by_name(table)
    found = {quantity: _first(quantity, columns) for quantity, columns in claims.items()}
    heights = [name for name in HEIGHTS if name in found]
    if heights:  # as a reader takes them: the sensor before the piezo
        found["height"] = found[heights[0]]
        found = {name: guess for name, guess in found.items() if name == "height" or name not in HEIGHTS}
    claimed = [column for columns in claims.values() for column in columns]
    rest = [column for column in table.numbers if not any(column is one for one in claimed)]
    wanted = [quantity for quantity in NEEDED if quantity not in found]
    votes = sorted(_votes(wanted, rest), key=lambda vote: -vote[0])
    taken: list[Column] = []
    for _, quantity, column in votes:
        if quantity not in found and not any(column is one for one in taken):
            found[quantity] = Guess(column, False)
            taken.append(column)
    return found


def _first(quantity: str, columns: Sequence[Column]) -> Guess:
    fitting = [column for column in columns if _suits(quantity, column.unit)]
    return Guess((fitting or list(columns))[0], len(columns) == 1)


def _suits(quantity: str, unit: str | None) -> bool:
    """Return whether a unit suits a quantity; a missing unit does."""
    return not unit or quantity not in UNITS or any(is_of(unit, stored) for stored in UNITS[quantity])


def _votes(wanted: Sequence[str], columns: Sequence[Column]) -> Iterator[tuple[float, str, Column]]:
    """Give how much speaks for each quantity in each column, where anything does."""
    for quantity in wanted:
        for column in columns:
            if not _suits(quantity, column.unit):
                continue
            words = re.findall(r"[^\W\d_]+", column.name.casefold())
            named = any(
                word.startswith(stem) if len(stem) > 1 else word == stem for word in words for stem in STEMS[quantity]
            )
            vote = NAME * named + UNIT * bool(column.unit)
            vote += WAY * (quantity == "height" and _walks(np.asarray(column.values, dtype=float)))
            if vote:
                yield vote, quantity, column


def _walks(values: Array) -> bool:
    """Return whether numbers go one way, or there and back."""
    values = values[np.isfinite(values)]
    return len(values) > 2 and 0.0 < float(np.abs(np.diff(values)).sum()) < WINDING * float(np.ptp(values))
