"""Dwell: the motion at one distance, as traces over time and a spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pydantic

from dforce.core.parameters import Number, Part, param, part
from dforce.experiments.base import CurveExperiment, CurvePlan, Start, tapping_distance

if TYPE_CHECKING:
    from dforce.problem import Problem


class Dwell(CurveExperiment):
    """The tip stays at one average distance; its motion is recorded after settling."""

    procedure = "procedures.dwell:dwell"
    unswept = ("time", "frequency")
    locks = True

    kind: Literal["dwell"] = "dwell"
    zc: Number = param(unit="m", symbol="z_c", doc="average tip–surface distance")
    start: Part[Start] = part("free", description="motion at the start: free, rest, or an amplitude and a phase")
    record: Literal["settled", "all"] = pydantic.Field(
        default="settled",
        title="What is recorded",
        description="record the settled motion only, or everything from the start",
    )
    recorded_periods: int = pydantic.Field(
        default=8, ge=1, le=100_000, description="recorded periods of the first tone after settling"
    )

    @property
    def is_whole(self) -> bool:
        """Whether everything from the start is recorded, not the settled motion alone."""
        return self.record == "all"

    def plan(self, problem: Problem) -> CurvePlan:
        """Return its one point; see :class:`CurveExperiment`."""
        return CurvePlan("zc", np.array([self.zc]), [()], start=self.start)

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return typical distances; see :class:`Experiment`."""
        return {"zc": tapping_distance(problem)}
