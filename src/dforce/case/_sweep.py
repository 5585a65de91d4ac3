"""The table `[sweep]` of a case: which parameters take which values, for many cases at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

import pydantic

from dforce.core.errors import ParameterError, shorten
from dforce.core.marks import file_name, words
from dforce.core.parameters import Parameters, Part
from dforce.core.refusals import refusal

MOST_VALUES = 10_000_000  # of a parameter; more are a slip of the keyboard


class Range(Parameters):
    """Values from `start` to `stop`, both included, by equal steps or by equal factors."""

    title_of: ClassVar[str] = "range"

    start: float | str = words(description="first value: a number in SI, or text with a unit")
    stop: float | str = words(description="last value")
    points: int = pydantic.Field(ge=1, le=MOST_VALUES, description="number of values")
    spacing: Literal["linear", "log"] = pydantic.Field(
        default="linear", description="linear: by equal steps; log: by equal factors"
    )


class Sweep(Parameters):
    """Parameters to vary, with their values; the experiment runs for each case."""

    title_of: ClassVar[str] = "sweep"

    over: Part[dict[str, Range | tuple[Any, ...]]] = words(
        {},
        description="values by the path of a parameter, for all combinations: a list, or "
        '{ start, stop, points, spacing = "log" }',
    )
    along: Literal["combinations", "cases"] = pydantic.Field(
        default="combinations",
        description="combinations: all combinations of the values of `over`; cases: its lists have equal length, and each "
        "position "
        "is a case",
    )
    rows: str = file_name(
        "",
        max_length=1000,
        through_named=True,
        description="instead of `over`, a CSV file beside the case file, with a case in each row; its first row contains paths",
    )

    @pydantic.field_validator("over", mode="before")
    @classmethod
    def _values_by_path(cls, given: object) -> Any:
        if not isinstance(given, Mapping):
            raise ParameterError(f"= {shorten(given)} is not a table with values by path")
        return {str(path): _values(str(path), values) for path, values in given.items()}

    @pydantic.model_validator(mode="after")
    def _says_one_thing(self) -> Self:
        if bool(self.over) == bool(self.rows):
            said = "has both over and rows" if self.over else "has neither over nor rows"
            raise ParameterError(f"{said}; write values by path as over, or a CSV file of cases as rows")
        if self.rows and self.along == "cases":
            raise ParameterError("along needs over; rows are cases already")
        return self


def _values(path: str, given: object) -> Any:
    """Return values as they are kept; the sweep checks them against the case."""
    if isinstance(given, Range):
        return given
    if isinstance(given, Mapping):
        try:
            return Range(**{str(key): value for key, value in given.items()})
        except ParameterError as error:
            raise type(error)(f"sweep.over.{path}: {error}") from None
        except pydantic.ValidationError as error:
            raise refusal(error, Range, f"sweep.over.{path}") from None
    if isinstance(given, str) or not hasattr(given, "__iter__"):
        raise ParameterError(f"sweep.over.{path} = {shorten(given)} is neither a list of values nor a range")
    return tuple(given.tolist() if hasattr(given, "tolist") else given)
