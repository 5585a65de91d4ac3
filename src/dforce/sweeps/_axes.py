"""The axes of a sweep: a parameter by its path, and the values that it takes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce import quantities, units
from dforce.case import Case
from dforce.case._paths import quantity_at, value_at
from dforce.errors import ParameterError, shorten
from dforce.experiments import Dwell
from dforce.parameters import Quantity

INSTRUMENT = ("cantilever", "drive", "readout", "tip", "sample", "contact", "medium", "forces")
DISTANCE = "experiment.zc"
MOST_POINTS = 20_000_000  # of a result: 40 numbers each are 6 GB


@dataclass(frozen=True)
class Axis:
    """One parameter of a sweep.

    Attributes
    ----------
    path
        Where it is in the case.
    dim
        Its dimension in the result: the last word of the path, or the whole path where that would be ambiguous.
    values
        Its values: SI numbers, or whatever the case takes.
    quantity
        What is declared about it, where its values are plain numbers of the instrument, the sample or a force, or the
        distance of a dwell; None for a choice, which is validated with the whole case.
    """

    path: str
    dim: str
    values: tuple[Any, ...]
    quantity: Quantity | None

    def coordinate(self) -> tuple[str, Any, dict[str, str]]:
        """Return the coordinate of the result."""
        if self.quantity is None:
            plain = all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.values)
            return (
                self.dim,
                np.array(self.values if plain else [str(value) for value in self.values]),
                {"path": self.path},
            )
        words = {"units": self.quantity.unit, "long_name": self.quantity.doc, "symbol": self.quantity.symbol}
        return self.dim, np.array(self.values, dtype=float), {k: v for k, v in words.items() if v} | {"path": self.path}


def make_axes(case: Case, over: Mapping[str, Any]) -> list[Axis]:
    """Return the axes that a user asks for.

    Raises
    ------
    ParameterError
        For a path that the case does not have, no values, or a value that is not allowed.
    """
    if not isinstance(over, Mapping) or not over:
        raise ParameterError('over must say what to vary, such as {"sample.youngs_modulus": ["1 GPa", "2 GPa"]}')
    paths = list(over)
    last = [str(path).split(".")[-1] for path in paths]
    taken = {*quantities.OBSERVABLES, *quantities.AXES, "status"} - {"zc", "frequency"}
    if case.experiment is not None and not isinstance(case.experiment, Dwell):
        taken.add("zc")
    axes = []
    for path, name in zip(paths, last, strict=True):
        dim = name if last.count(name) == 1 and name not in taken else path
        quantity = _number_at(case, path)
        axes.append(Axis(path, dim, _values(path, over[path], quantity), quantity))
    return axes


def _number_at(case: Case, path: str) -> Quantity | None:
    """Return the declaration of a plain number that can be changed without building the case anew, else None."""
    value = value_at(case, path)
    if path == DISTANCE and isinstance(case.experiment, Dwell):
        return quantity_at(case, path)
    if path == DISTANCE:
        raise ParameterError("experiment.zc can be swept over in a dwell only; an approach has its own distances")
    if path.split(".")[0] not in INSTRUMENT or not (value is None or isinstance(value, float)):
        return None
    try:
        return quantity_at(case, path)
    except ParameterError:
        return None


def _values(path: str, given: Any, quantity: Quantity | None) -> tuple[Any, ...]:
    if isinstance(given, str | Mapping) or not hasattr(given, "__iter__"):
        raise ParameterError(f"{path} = {shorten(given)} is not a list of values")
    items = given.tolist() if isinstance(given, np.ndarray) and given.ndim == 1 else list(given)
    if not items:
        raise ParameterError(f"{path} has no values; give at least one")
    if quantity is None:
        return tuple(items)
    try:
        numbers = tuple(units.parse(item, quantity.unit) for item in items)
        for extreme in (min(numbers), max(numbers)):
            quantity.check(extreme)
    except ParameterError as error:
        raise type(error)(f"{path} {error}") from None
    return numbers


def count(axes: list[Axis]) -> int:
    """Return the number of cases."""
    return math.prod(len(axis.values) for axis in axes)
