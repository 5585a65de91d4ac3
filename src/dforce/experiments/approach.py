"""Approach: amplitude, phase and every other quantity against the average distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
import pydantic

from dforce.core.parameters import Part, param, part
from dforce.experiments.base import (
    PROTOCOL,
    CaseLike,
    DistanceExperiment,
    Distances,
    Grid,
    Progress,
    ProtocolName,
    RelativeGrid,
    Start,
    refuse_fresh_starts,
    whole_range,
)

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.solvers import SolverSettings


class Approach(DistanceExperiment):
    """The tip goes through a list of average distances, slowly or by sudden steps, and the steady motion at each is found."""

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
        description="stepwise: start each distance from the motion at the one before; otherwise each from `start`",
    )
    start: Part[Start] = part("free", description="motion at the start: free, rest, or an amplitude and a phase")

    @pydantic.model_validator(mode="after")
    def _starts_anew_by_steps(self) -> Self:
        refuse_fresh_starts(self.protocol, self.carry_state)
        return self

    def distances(self, A0: float = 1.0) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the average distances (m), as given; shares are those of `A0` (m)."""
        if isinstance(self.zc, RelativeGrid):
            return np.asarray(self.zc.values() * A0)
        return self.zc.values() if isinstance(self.zc, Grid) else np.array(self.zc)

    def visits(self) -> list[tuple[int, ...]]:
        """Return the places of the result in the order in which the tip comes to them."""
        far_to_near = [int(i) for i in np.argsort(-self.distances(), kind="stable")]
        if self.direction == "approach":
            return [(i,) for i in far_to_near]
        if self.direction == "retract":
            return [(i,) for i in reversed(far_to_near)]
        there, back = [(i, 0) for i in far_to_near], [(i, 1) for i in reversed(far_to_near)]
        return [*there, *back]

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return typical distances; see :class:`Experiment`."""
        return {"zc": whole_range(problem)}

    def run(
        self,
        problem: Problem,
        settings: SolverSettings,
        progress: Progress,
        earlier: xr.Dataset | None = None,
        case: CaseLike | None = None,
    ) -> xr.Dataset:
        """Return the curve; see :class:`Experiment`."""
        from dforce.experiments._curve import Curve
        from dforce.experiments.table import with_levers
        from dforce.solvers.block import Block

        coords: dict[str, Any] = {"zc": self.distances(problem.tones[0].A0)}
        if self.direction == "both":
            coords["direction"] = ["approach", "retract"]

        def make(points: int | None) -> Block:
            return Block.of_one(problem, settings, self.harmonics, points=points)

        curve = Curve(
            make,
            coords,
            self.visits(),
            self.protocol,
            self.carry_state,
            self.start,
            "jump_zc",
            ("approach", "retract"),
            lambda zc: f"zc = {1e9 * zc:.4g} nm",
        )
        data = curve.run(progress, earlier)
        if problem.heights is None:
            return data
        return with_levers(data, "zc", [problem.at_height(float(zc)) for zc in data["zc"].values])
