"""Cantilevers by name: nominal values of makers, and cantilevers in a user's own file.

A file is a CSV table with a head: `name`, `f0`, `k`, and, where known, `Q`, `length`, `width`, `thickness`, `tip_radius`,
`maker` and `source`; numbers in SI or with a unit, lines that begin with ``#`` left out. Shipped sizes agree with f0 and k of
a rectangular silicon beam.
"""

from __future__ import annotations

import csv
import functools
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from dforce.core import units
from dforce.core.columns import lines_of
from dforce.core.errors import Catalog, ParameterError, shorten
from dforce.core.listing import Shown, aligned, html_table

UNITS = {"f0": "Hz", "k": "N/m", "Q": "1", "length": "m", "width": "m", "thickness": "m", "tip_radius": "m"}
WORDS = ("name", "maker", "source")
NOMINAL = "f0 is uncertain by 20 to 30 %, k by a factor of 2 to 4: measure f0 and Q, and calibrate k"


@dataclass(frozen=True)
class Probe:
    """A cantilever known by name, with its nominal values in SI; None for an unknown value."""

    name: str
    f0: float
    k: float
    Q: float | None = None
    length: float | None = None
    width: float | None = None
    thickness: float | None = None
    tip_radius: float | None = None
    maker: str = ""
    source: str = ""

    def cells(self) -> tuple[str, ...]:
        """Return the cells of its row in a table: name, maker, f0, k, tip radius."""
        shown = (units.show(self.f0, "Hz", 4), units.show(self.k, "N/m", 4))
        return (self.name, self.maker, *shown, "" if self.tip_radius is None else units.show(self.tip_radius, "m", 3))

    def as_text(self) -> str:
        """Return all that is known of it, a line for each value."""
        numbers = [(key, getattr(self, key), unit) for key, unit in UNITS.items()]
        lines = [
            (key.replace("_", " "), units.show(value, unit, 4)) for key, value, unit in numbers if value is not None
        ]
        if self.Q is None:
            lines.append(("Q", "not known: give Q" + ', or medium = "air" (theory of Sader)' * bool(self.width)))
        return aligned([*lines, ("maker", self.maker), ("source", self.source), ("nominal", NOMINAL)])


HEAD = ("name", "maker", "f0", "k", "tip radius")


class Probes(Shown, Catalog[Probe]):
    """The result of :func:`cantilevers`: a dict by name, shown as a table."""

    kind = "cantilever"
    listed_by = "dforce cantilevers"

    def as_text(self) -> str:
        """Return a row for each."""
        return f"{aligned([HEAD, *(probe.cells() for probe in self.values())])}\nnominal values: {NOMINAL}"

    def as_html(self) -> str:
        """Return a row for each."""
        return html_table([probe.cells() for probe in self.values()], HEAD)


@functools.cache
def cantilevers() -> Probes:
    """Return the known cantilevers by name, in SI, with nominal values; a notebook draws the dict as a table."""
    text = (resources.files(__package__) / "cantilevers.csv").read_text(encoding="utf-8")
    return _read(text.splitlines(), "the shipped list")


def own_cantilevers(file: Path) -> Probes:
    """Return the cantilevers of a user's own file.

    Raises
    ------
    ParameterError
        When it cannot be read, or is no such table.
    """
    key = "cantilever.library"
    return _read(lines_of(file, key), f"{key} = '{shorten(file.name)}'")


def _read(lines: Iterable[str], table: str) -> Probes:
    try:
        rows = [row for row in csv.reader(lines, skipinitialspace=True) if row and not row[0].startswith("#")]
    except csv.Error as error:
        raise ParameterError(f"{table} is not a table: {error}") from None
    columns = [column.strip() for column in rows[0]] if rows else []
    for column in ("name", "f0", "k"):
        if column not in columns:
            raise ParameterError(f"{table} has no column '{column}'; its first line must name the columns")
    for column in columns:
        if column not in (*UNITS, *WORDS):
            raise ParameterError(f"{table} has a column '{shorten(column)}'; allowed are {', '.join((*WORDS, *UNITS))}")
        if columns.count(column) > 1:
            raise ParameterError(f"{table} has two columns '{column}'")
    found = Probes()
    for number, row in enumerate(rows[1:], start=1):
        here = f"{table}, cantilever {number}"
        if len(row) != len(columns):
            raise ParameterError(f"{here}: it has {len(row)} cells for {len(columns)} columns")
        given = dict.fromkeys((*UNITS, *WORDS), "") | {
            key: cell.strip() for key, cell in zip(columns, row, strict=True)
        }
        numbers = {}
        for key in filter(given.__getitem__, UNITS):
            try:
                numbers[key] = units.parse(given[key], UNITS[key])
            except ParameterError as error:
                raise ParameterError(f"{here}: {key} {error}") from None
        if not given["name"] or not {"f0", "k"} <= set(numbers) or not all(value > 0.0 for value in numbers.values()):
            raise ParameterError(f"{here}: write a name, f0 and k, and no number below 0")
        if given["name"] in found:
            raise ParameterError(f"{here}: '{shorten(given['name'])}' appears twice")
        words = {key: given[key] for key in WORDS}
        found[given["name"]] = Probe(**words, **numbers)  # type: ignore[arg-type]
    return found
