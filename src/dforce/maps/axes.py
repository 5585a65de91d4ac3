"""The axes of a sweep: a parameter by its path, and the values that it takes."""

from __future__ import annotations

import csv
import dataclasses
import io
import itertools
import math
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.case import MOST_VALUES, Case, Range, Sweep
from dforce.case.paths import place_of, quantity_at, value_at
from dforce.core import quantities, units
from dforce.core.errors import CaseError, ParameterError, nearest, shorten
from dforce.core.files import named, read_input, text_of
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.quantity import words
from dforce.experiments.base import DISTANCE

INSTRUMENT = ("cantilever", "drive", "readout", "tip", "sample", "contact", "medium", "forces")
ROW = "case"  # dimension of cases that are rows of a table
WAYS = COMBINATIONS, CASES = "combinations", "cases"
MOST_POINTS = 20_000_000  # of a result: 40 numbers each are 6 GB
MOST_BYTES = 200_000_000  # a larger table of cases is no sweep of one machine


@dataclass(frozen=True)
class Axis:
    """One parameter of a sweep; parameters of one dimension vary together.

    Attributes
    ----------
    path
        Its path in the case.
    name
        Its name in the result: the last word of the path, or the whole path where that would be ambiguous.
    dim
        Its dimension in the result: its name, or `case` where each case is a row of a table.
    values
        Its values: SI numbers, or any values that the case takes.
    quantity
        Its declaration, if its values are plain numbers of the instrument, the sample or a force, or the one distance of an
        experiment. None for a choice, which is validated with the whole case.
    """

    path: str
    name: str
    dim: str
    values: tuple[Any, ...]
    quantity: ParameterQuantity | None

    def text(self, place: int) -> str:
        """Return path and value at a place for a reader."""
        value = self.values[place]
        return f"{self.path} = {units.show(value, self.quantity.unit, 4) if self.quantity is not None else value}"

    def coordinate(self) -> tuple[str, Any, dict[str, str]]:
        """Return the coordinate of the result."""
        if self.quantity is None:
            plain = all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.values)
            return (
                self.dim,
                np.array(self.values if plain else [str(value) for value in self.values]),
                {"path": self.path},
            )
        said = words(self.quantity.unit, self.quantity.doc, self.quantity.symbol)
        return self.dim, np.array(self.values, dtype=float), said | {"path": self.path}


def make_axes(case: Case, over: Mapping[str, Any]) -> list[Axis]:
    """Return the axes of all combinations of values.

    Raises
    ------
    ParameterError
        For a path that the case does not have, two paths that lead to one parameter, no values, or a value that is not
        allowed.
    """
    if not isinstance(over, Mapping) or not over:
        raise ParameterError(
            'over must name the parameters to vary, such as {"sample.youngs_modulus": ["1 GPa", "2 GPa"]}'
        )
    return _axes(case, over)


def make_rows(case: Case, rows: Mapping[str, Any]) -> list[Axis]:
    """Return the axes of a table with a row for each case and a column for each path.

    Raises
    ------
    ParameterError
        As :func:`make_axes`, for columns of different lengths, and for a parameter that is no plain number.
    """
    if not isinstance(rows, Mapping) or not rows:
        raise ParameterError(
            'single cases are columns by path, such as {"sample.youngs_modulus": moduli, "drive.A0": amplitudes}'
        )
    axes = _axes(case, rows)
    first = axes[0]
    for axis in axes:
        if axis.quantity is None:
            raise ParameterError(
                f"{axis.path} is not a plain number, so it cannot differ from case to case; vary it in combinations"
            )
        if len(axis.values) != len(first.values):
            raise ParameterError(
                f"{axis.path} has {len(axis.values)} values and {first.path} has {len(first.values)}; each case needs one value"
            )
    return [dataclasses.replace(axis, dim=ROW) for axis in axes]


def axes_of(
    case: Case, over: Mapping[str, Any] | None, rows: Mapping[str, Any] | None, along: str | None = None
) -> tuple[Case, list[Axis]]:
    """Return the axes from the arguments, else from the case's own table; and the case, without an unused table.

    `along` is "combinations" (also where it is left out) or "cases".

    Raises
    ------
    ParameterError
        As :func:`make_axes` and :func:`make_rows`, with both arguments, or without any parameter to vary.
    CaseError
        When the file of a case's rows cannot be read.
    """
    if over is not None and rows is not None:
        raise ParameterError(
            "over and rows exclude each other; over varies all combinations of values, rows lists single cases"
        )
    if along not in (None, *WAYS):
        raise ParameterError(f"along = '{shorten(along)}' is not one of {', '.join(WAYS)}{nearest(str(along), WAYS)}")
    if along is not None and over is None:
        raise ParameterError("along needs over; it sets how the values of over combine")
    if over is None and rows is None and case.sweep is not None:
        if case.sweep.rows:
            return case, make_rows(case, read_rows(named(case.sweep.rows, "sweep.rows", case.folder)))
        return case, (make_rows if case.sweep.along == CASES else make_axes)(case, case.sweep.over)
    case = case.model_copy(update={"sweep": None})
    if along == CASES:
        return case, make_rows(case, over or {})
    return case, make_axes(case, over or {}) if rows is None else make_rows(case, rows)


def _axes(case: Case, over: Mapping[str, Any]) -> list[Axis]:
    paths = [str(path) for path in over]
    last = [path.split(".")[-1] for path in paths]
    taken = {*quantities.OBSERVABLES, *quantities.AXES, "status", ROW} - {"zc", "frequency"}
    if case.experiment is not None:
        taken |= {*case.experiment.coordinates(case.problem), case.experiment.path.split(".")[-1]}
    if _one_distance(case):
        taken.discard("zc")
    axes: list[Axis] = []
    places: dict[tuple[str | int, ...], str] = {}
    for path, word in zip(paths, last, strict=True):
        name = word if last.count(word) == 1 and word not in taken else path
        same = places.setdefault(place_of(case, path), path)
        if same != path:
            raise ParameterError(f"{same} and {path} are the same parameter; list its values once")
        quantity = _number_at(case, path)
        axes.append(Axis(path, name, name, _values(path, over[path], quantity), quantity))
    return axes


def _number_at(case: Case, path: str) -> ParameterQuantity | None:
    """Return the declaration of a plain number that can be changed without building the case anew, else None."""
    value = value_at(case, path)
    if path == DISTANCE and _one_distance(case):
        return quantity_at(case, path)
    if path == DISTANCE:
        raise ParameterError(
            "experiment.zc can be swept over where it is one distance; this experiment has a range of its own"
        )
    if path.split(".", maxsplit=1)[0] not in INSTRUMENT or not (value is None or isinstance(value, float)):
        return None
    try:
        return quantity_at(case, path)
    except ParameterError:
        return None


def _one_distance(case: Case) -> bool:
    """Return whether the experiment of a case has one distance."""
    return isinstance(getattr(case.experiment, "zc", None), float)


def _values(path: str, given: Any, quantity: ParameterQuantity | None) -> tuple[Any, ...]:
    if isinstance(given, Mapping):
        given = Sweep(over={path: given}).over[path]
    if isinstance(given, Range):
        given = _spread(path, given, quantity)
    if isinstance(given, str) or not hasattr(given, "__iter__"):
        raise ParameterError(f"{path} = {shorten(given)} is not a list of values")
    if hasattr(given, "__len__") and len(given) > MOST_VALUES:
        raise ParameterError(f"{path} has {len(given)} values; at most {MOST_VALUES} are allowed")
    if not hasattr(given, "__len__"):  # it may go on for ever
        given = list(itertools.islice(given, MOST_VALUES + 1))
        if len(given) > MOST_VALUES:
            raise ParameterError(f"{path} has more than {MOST_VALUES} values, which are not allowed")
    items = given.tolist() if isinstance(given, np.ndarray) and given.ndim == 1 else list(given)
    if not items:
        raise ParameterError(f"{path} has no values; list at least one")
    if quantity is None:
        return tuple(items)
    try:
        numbers = tuple(map(quantity.read, items))
    except ParameterError as error:
        raise type(error)(f"{path} {error}") from None
    return numbers


def _spread(path: str, given: Range, quantity: ParameterQuantity | None) -> Any:
    """Return the values of a range (SI)."""
    if quantity is None:
        raise ParameterError(f"{path} is not a plain number, so it has no range; list its values")
    try:
        start, stop = units.parse(given.start, quantity.unit), units.parse(given.stop, quantity.unit)
    except ParameterError as error:
        raise type(error)(f"{path} {error}") from None
    if start == stop and given.points > 1:
        same = units.show(start, quantity.unit)
        raise ParameterError(f"{path} starts and stops at {same}, so its {given.points} points are equal; change stop")
    if given.spacing == "linear":
        return np.linspace(start, stop, given.points)
    if not start * stop > 0.0:
        first, last = units.show(start, quantity.unit), units.show(stop, quantity.unit)
        raise ParameterError(f"{path} goes from {first} to {last}, so it cannot have equal factors; use linear spacing")
    return np.geomspace(start, stop, given.points)


def amplitude_axis(case: Case, axes: Sequence[Axis]) -> Axis | None:
    """Return the axis along which the first tone's free amplitude goes, for distances that are shares of it; None: it stays.

    Raises
    ------
    ParameterError
        When the drive has no `A0`, or another one with every value of a choice.
    """
    if case.drive.A0 is None and (not case.drive.tones or case.drive.tones[0].A0 is None):
        raise ParameterError(
            "experiment.zc is a share of drive.A0, but the drive has no A0; write drive.A0, or distances"
        )
    place = place_of(case, "drive.tones.1.A0")
    for axis in axes:
        own = place_of(case, axis.path)
        if own == place:
            return axis
        if own == place[: len(own)]:
            raise ParameterError(
                f"experiment.zc is a share of drive.A0, but {axis.path} may change A0; write distances"
            )
    return None


def dims_of(axes: Sequence[Axis]) -> dict[str, int]:
    """Return the dimensions of axes in order, and their lengths."""
    return {axis.dim: len(axis.values) for axis in axes}


def count(axes: Sequence[Axis]) -> int:
    """Return the number of cases."""
    return math.prod(dims_of(axes).values())


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
    text = io.StringIO(text_of(content, name, CaseError), newline="")
    try:
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
