"""Dwell: the motion at one distance, as traces over time and a spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pydantic

from dforce.core.parameters import Number, Part, param, part
from dforce.core.stopping import heard
from dforce.experiments.base import CaseLike, MotionExperiment, Progress, Start, initial_motions, tapping_distance
from dforce.experiments.recording import Record, record_spectrum, record_traces

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.solvers import SolverSettings


class Dwell(MotionExperiment):
    """The tip stays at one average distance; its motion is recorded after settling."""

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

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return typical distances; see :class:`Experiment`."""
        return {"zc": tapping_distance(problem)}

    def run(
        self,
        problem: Problem,
        settings: SolverSettings,
        progress: Progress,
        earlier: xr.Dataset | None = None,
        case: CaseLike | None = None,
    ) -> xr.Dataset:
        """Return traces, spectrum and scalars; see :class:`Experiment`."""
        problem = problem.at_height(self.zc)
        asked = Record(self.zc, self.start, self.record == "all", self.recorded_periods, self.harmonics)
        if settings.integrator == "langevin":
            from dforce.experiments._thermal import thermal_dwell

            return thermal_dwell(asked, problem, settings, progress)
        from dforce.experiments.motion import base_of, rows_of, scales_of, with_motions
        from dforce.experiments.table import Table
        from dforce.results.status import Status
        from dforce.solvers.block import Block
        from dforce.solvers.protocols import settle_at
        from dforce.solvers.sample_counts import sample_counts
        from dforce.solvers.states import States

        if asked.whole:  # the whole way there is asked for, so it has to be gone
            settings = settings.replace(method="transient")
        table = Table((), {}, problem, self.harmonics)
        plain = Block.of_one(problem, settings, self.harmonics)
        try:
            progress(0, 1, "settling")
            for points, _ in sample_counts(plain.points, settings):
                block = Block.of_one(problem, settings, self.harmonics, lambda: progress(0, 1, "settling"), points)
                [first] = initial_motions(block, np.array([self.zc]), self.start)
                found = settle_at(block, first, self.zc)
                table.put((), found, problem)
                if table.status[()] != Status.UNRESOLVED:
                    break
        except KeyboardInterrupt:
            heard()
            data = Table((), {}, problem, self.harmonics).dataset().assign_coords(zc=self.zc)
            data.attrs["interrupted"] = 1
            return data
        data = table.dataset().assign_coords(zc=self.zc)
        integrator = block.integrator(0, self.zc)
        data.attrs["samples_per_period"] = integrator.points
        if table.status[()] not in (Status.FAILED, Status.UNRESOLVED):
            settling = int(found.values["settling_periods"])
            motion, count = found.motion, self.recorded_periods
            if asked.whole:
                motion, count = first, settling + self.recorded_periods
            asked.check_length(count, integrator.points)
            motion = record_traces(data, integrator, motion, count)
            data = with_motions(
                data, (), rows_of(States.of(found.motion), scales_of(problem), base_of(problem), problem)[0], problem
            )
            record_spectrum(data, integrator, motion, self.recorded_periods)
        progress(1, 1, "")
        return data
