"""`df.file_head`: the columns of a file with their first rows, and a guess of each quantity."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dforce.core.arrays import Array, Texts
from dforce.core.errors import checked
from dforce.core.listing import Shown, aligned, html_table
from dforce.inverse.curve import height_sign
from dforce.inverse.guessing import Guess, guess_curve, guess_spectrum
from dforce.inverse.placing import split_curves
from dforce.inverse.readers import content_of, tables_in
from dforce.inverse.table import MeasuredTable
from dforce.inverse.words import amplitude_kind

CURVE, SPECTRUM = "curve", "thermal spectrum"
ROWS = 8
DIGITS = 6


@dataclass(frozen=True)
class HeadColumn:
    """A column of a file.

    Attributes
    ----------
    name, unit
        Its heading; the unit is None without one in the file.
    quantity
        The guess: `height`, `amplitude`, `phase` and others of :func:`dforce.read_measured`, or `frequency` and `density` of a
        thermal spectrum; empty without a guess. No quantity has two columns.
    sure
        Whether a reader takes the column by its name, without a question.
    values
        All its values, as in the file: numbers, or words.
    """

    name: str
    unit: str | None
    quantity: str
    sure: bool
    values: Array | Texts


@dataclass(frozen=True, repr=False)
class FileHead(Shown):
    """The head of a measured file.

    Attributes
    ----------
    kind
        Content: ``"curve"`` or ``"thermal spectrum"``.
    format
        Format of the file, in words.
    curves
        Number of curves in the file.
    columns
        Columns of the first table in the file, in their order.
    height_grows
        Guess of the sign of the heights, as in :func:`dforce.read_measured`; None if neither file nor curve shows the sign.
    amplitude_is
        ``"rms"``, ``"peak"`` or ``"peak-to-peak"`` by the heading; None if the heading has none.
    phase_convention
        Convention of the phases in the notes of the file; None if they have none.
    """

    kind: str
    format: str
    curves: int
    columns: tuple[HeadColumn, ...]
    height_grows: str | None = None
    amplitude_is: str | None = None
    phase_convention: str | None = None

    def roles(self) -> dict[str, str]:
        """Return the name of the column of each guessed quantity, for `columns` of a reader."""
        return {column.quantity: self.name_of(column) for column in self.columns if column.quantity}

    def name_of(self, column: HeadColumn) -> str:
        """Return the name by which a reader finds a column: with its unit, if another column has the same name."""
        alone = sum(other.name == column.name for other in self.columns) == 1
        return column.name if alone or not column.unit else f"{column.name} ({column.unit})"

    def rows(self, count: int = ROWS) -> list[tuple[str, ...]]:
        """Return the first rows as text, each number with six digits."""
        return [
            tuple(_cell(value) for value in row)
            for row in zip(*(one.values[:count] for one in self.columns), strict=True)
        ]

    def _heading(self) -> list[tuple[str, ...]]:
        names = tuple(f"{one.name} ({one.unit})" if one.unit else one.name for one in self.columns)
        roles = tuple(one.quantity + ("" if one.sure or not one.quantity else "?") for one in self.columns)
        return [names, roles]

    def as_text(self) -> str:
        """Return the table as text: headings, guesses (with a question mark where unsure), first rows."""
        return "\n".join([f"{self.format}, {self.kind}", aligned([*self._heading(), *self.rows()])])

    def as_html(self) -> str:
        """Return the table as HTML."""
        names, roles = self._heading()
        return html_table([roles, *self.rows()], names)


def _cell(value: object) -> str:
    return f"{value:.{DIGITS}g}" if isinstance(value, float | np.floating) else str(value)


@checked
def file_head(path: str | os.PathLike[str]) -> FileHead:
    """Return the columns of a measured file with their first rows, and a guess of the quantity in each.

    The guess follows from names and units: ``Ph``, ``Ampl.`` and ``Piezo Z`` are phase, amplitude and height. A column never
    has two quantities. Pass the confirmed columns to :func:`dforce.read_measured` or :func:`dforce.thermal_tune`.

    Parameters
    ----------
    path
        The file, of any kind that :func:`dforce.read_measured` reads.

    Raises
    ------
    ResultError
        For a file that cannot be read, is incomplete, or contains no table.
    """
    content, name = content_of(path)
    return head_of(tables_in(content, name), name)


def head_of(tables: list[MeasuredTable], name: str) -> FileHead:
    """Return the head of a file from its tables; `name` is for sentences."""
    table = tables[0]
    spectrum = guess_spectrum(table)
    guesses = spectrum or guess_curve(table)
    of_column = {id(guess.column): (quantity, guess.sure) for quantity, guess in guesses.items()}
    columns = tuple(
        HeadColumn(one.name, one.unit, *of_column.get(id(one), ("", False)), one.values) for one in table.columns
    )
    return FileHead(
        SPECTRUM if spectrum else CURVE,
        str(table.reader),
        len(tables) if spectrum else sum(_curves_in(one, name) for one in tables),
        columns,
        None if spectrum else _height_grows(guesses, table, name),
        amplitude_kind(guesses["amplitude"].column.name) if "amplitude" in guesses else None,
        table.notes.get("phase_convention"),
    )


def _curves_in(table: MeasuredTable, name: str) -> int:
    """Return the number of curves in a table, as a reader finds them."""
    sure = {quantity: guess.column for quantity, guess in guess_curve(table).items() if guess.sure}
    return len(split_curves(table, sure, name))


def _height_grows(guesses: Mapping[str, Guess], table: MeasuredTable, name: str) -> str | None:
    """Return the direction of larger heights: from the maker or the name, else from the curve."""
    if "height" not in guesses:
        return None
    column = guesses["height"].column
    known = table.reader.sign_of(column.name)
    signal = next((key for key in ("frequency_shift", "amplitude") if key in guesses), None)
    if known is not None or signal is None:
        return known
    values = {key: np.asarray(guesses[key].column.values, dtype=float) for key in ("height", signal)}
    whole = np.isfinite(values["height"]) & np.isfinite(values[signal])
    return height_sign({key: one[whole] for key, one in values.items()})
