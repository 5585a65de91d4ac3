"""Approach: amplitude, phase and every other quantity against the average distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import pydantic

from dforce.core.arrays import Array
from dforce.core.errors import ParameterError
from dforce.core.parameters import Part, param, part
from dforce.experiments.base import (
    PROTOCOL,
    CurvePlan,
    DistanceExperiment,
    Distances,
    PathExperiment,
    ProtocolName,
    RelativeGrid,
    Start,
    values_of,
    whole_range,
)

if TYPE_CHECKING:
    from dforce.problem import Problem


class Approach(DistanceExperiment, PathExperiment):
    """Average distances in order, with slow or sudden changes: the steady motion at each distance is solved."""

    both_ways = ("approach", "retract")
    falls_first = True
    locks = True

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

    def distances(self, A0: float | None = None) -> Array:
        """Return the average distances (m) in your order; shares need their reference, `A0` (m).

        Raises
        ------
        ParameterError
            For shares without `A0`.
        """
        values = values_of(self.zc)
        if not isinstance(self.zc, RelativeGrid):
            return values
        if A0 is None:
            raise ParameterError("experiment.zc has shares of A0; pass the free amplitude, such as distances(10e-9)")
        return values * A0

    def plan(self, problem: Problem) -> CurvePlan:
        """Return the curve; see :class:`CurveExperiment`."""
        shares = values_of(self.zc) if isinstance(self.zc, RelativeGrid) else None
        return self.along("zc", self.distances(problem.tones[0].A0), shares)

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return typical distances; see :class:`Experiment`."""
        return {"zc": whole_range(problem)}
