"""Approach: amplitude, phase and every other quantity against the average distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pydantic

from dforce.core.arrays import Array
from dforce.core.parameters import Part, param, part
from dforce.experiments.base import (
    PROTOCOL,
    CurveExperiment,
    CurvePlan,
    DistanceExperiment,
    Distances,
    Grid,
    Place,
    ProtocolName,
    RelativeGrid,
    Start,
    starts_anew_by_steps,
    visits,
    whole_range,
)

if TYPE_CHECKING:
    from dforce.problem import Problem

WAYS = ("approach", "retract")


class Approach(DistanceExperiment, CurveExperiment):
    """The tip goes through a list of average distances, slowly or by sudden steps, and the steady motion at each is solved."""

    kind: Literal["approach"] = "approach"
    zc: Part[Distances] = param(
        unit="m", symbol="z_c", doc="average distances: a grid {start, stop, points}, a list, or shares of A0"
    )
    direction: Literal["approach", "retract", "both"] = pydantic.Field(
        default="approach",
        title="Direction",
        description="approach (far to near), retract (near to far), or both one after the other",
    )
    protocol: ProtocolName = PROTOCOL
    carry_state: bool = pydantic.Field(
        default=True,
        description="stepwise: start each distance from the motion at the distance before; otherwise from `start`",
    )
    start: Part[Start] = part("free", description="motion at the start: free, rest, or an amplitude and a phase")

    _starts_anew_by_steps = starts_anew_by_steps

    def distances(self, A0: float = 1.0) -> Array:
        """Return the average distances (m) in your order; shares refer to `A0` (m)."""
        if isinstance(self.zc, RelativeGrid):
            return np.asarray(self.zc.values() * A0)
        return self.zc.values() if isinstance(self.zc, Grid) else np.array(self.zc)

    def visits(self) -> list[Place]:
        """Return the indices of the result in the order of the tip's path."""
        return visits(self.distances(), self.direction, *WAYS, falls=True)

    def plan(self, problem: Problem) -> CurvePlan:
        """Return the curve; see :class:`CurveExperiment`."""
        return CurvePlan(
            "zc",
            self.distances(problem.tones[0].A0),
            self.visits(),
            WAYS if self.direction == "both" else (),
            WAYS,
            self.start,
            self.protocol,
            self.carry_state,
            self.distances() if isinstance(self.zc, RelativeGrid) else None,
        )

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return typical distances; see :class:`Experiment`."""
        return {"zc": whole_range(problem)}
