"""Branches: all steady states along the distance or any other parameter, stable and unstable, through folds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import pydantic

from dforce.core.errors import ParameterError, shorten
from dforce.core.marks import words
from dforce.core.parameters import Number, Parameters, Part, param
from dforce.experiments.base import DISTANCE, DistanceExperiment, whole_range

if TYPE_CHECKING:
    from dforce.problem import Problem


class Span(Parameters):
    """A range of average distances; the first curve of states begins at `start`."""

    title_of: ClassVar[str] = "zc"

    start: Number = param(unit="m", symbol="z_c", doc="first average distance; far away, with one state")
    stop: Number = param(unit="m", symbol="z_c", doc="last average distance")


def _span_of_pair(given: Any) -> Any:
    """Turn a pair of distances into a range."""
    return {"start": given[0], "stop": given[1]} if isinstance(given, tuple) and len(given) == 2 else given


class Branches(DistanceExperiment):
    """All steady states along a parameter, stable or not: the curves of periodic orbits, through folds."""

    procedure = "procedures.branches:branches"
    locks = True

    kind: Literal["branches"] = "branches"
    zc: Part[Annotated[Span | float, pydantic.BeforeValidator(_span_of_pair)]] = param(
        unit="m", symbol="z_c", doc="range {start, stop} of average distances; one distance with a parameter"
    )
    parameter: str | None = words(
        None,
        max_length=200,
        title="Parameter to vary instead of the distance",
        examples=["sample.youngs_modulus", "drive.A0", "drive.frequency", "cantilever.Q", "tip.radius"],
        description="path of the parameter to vary instead of zc, such as sample.youngs_modulus; "
        "a drive frequency is varied at constant driving force",
    )
    start: float | str | None = words(None, description="first value of the parameter")
    stop: float | str | None = words(None, description="last value of the parameter")
    largest_step: float = pydantic.Field(
        default=0.01,
        gt=0.0,
        le=0.5,
        description="largest step along a curve, relative to the range and to the free amplitude",
    )
    max_points: int = pydantic.Field(default=10_000, ge=2, le=1_000_000, description="points of all curves, at most")
    search: int = pydantic.Field(
        default=7, ge=0, le=1000, description="number of values at which states on other curves are searched"
    )

    @pydantic.model_validator(mode="after")
    def _one_range(self) -> Self:
        if self.parameter is None:
            if not isinstance(self.zc, Span):
                raise ParameterError("experiment.zc is one distance; write a range, or a parameter with start and stop")
            if self.zc.start == self.zc.stop:
                raise ParameterError("experiment.zc starts and stops at one distance; write two distances")
            if self.start is not None or self.stop is not None:
                raise ParameterError("experiment.start and stop need a parameter; zc is already a range")
        elif isinstance(self.zc, Span):
            raise ParameterError(
                f"experiment.zc is a range, and so is the range of {self.parameter}; write one distance"
            )
        elif self.start is None or self.stop is None:
            raise ParameterError(f"experiment.start and stop (the range of {self.parameter}) are missing")
        return self

    def check(self, problem: Problem) -> None:
        """Raise :class:`ParameterError` for a lock with two tones or with a `parameter`; see :class:`Experiment`."""
        if self.parameter is not None:
            problem.refuse_lock(f"experiment.parameter = {shorten(self.parameter)}")
        super().check(problem)
        if len(problem.tones) > 1:
            problem.refuse_lock("branches with two tones")

    @property
    def path(self) -> str:
        """The path of the varied parameter; see :class:`Experiment`."""
        return self.parameter or DISTANCE

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return a typical range of distances; see :class:`Experiment`."""
        return {"zc": whole_range(problem)}
