"""Dwell: the motion at one distance, as traces over time and a spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pydantic

from dforce.core import units
from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, Parameters, Part, param, part
from dforce.experiments.base import CurveExperiment, CurvePlan, Start, tapping_distance

if TYPE_CHECKING:
    from dforce.problem import Problem

PERIODS = 6.0  # of the drive in the inverse of the largest bandwidth: a lock-in is late by one


class Controllers(Parameters):
    """A phase-locked loop and an amplitude control, simulated in time."""

    title_of = "experiment.controllers"

    phase_bandwidth: Number = param("500 Hz", unit="Hz", above="0 Hz", doc="bandwidth of the phase-locked loop")
    amplitude_bandwidth: Number = param("500 Hz", unit="Hz", above="0 Hz", doc="bandwidth of the amplitude control")
    lock_in_order: int = pydantic.Field(
        default=0,
        ge=0,
        le=8,
        description="stages of the low-pass behind the lock-in, five times as fast as the controllers; 0: mean over a period",
    )


class Dwell(CurveExperiment):
    """The tip stays at one average distance; its motion is recorded after settling."""

    procedure = "procedures.dwell:dwell"
    unswept = ("time", "frequency", "loop_time")
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

    controllers: Part[Controllers | None] = part(
        None, description="real controllers that lock in time; default: the locked motion is solved"
    )

    @property
    def is_whole(self) -> bool:
        """Whether the record begins at the start of the motion, instead of after settling."""
        return self.record == "all"

    def check(self, problem: Problem) -> None:
        """Raise :class:`ParameterError` if the controllers do not suit the case; see :class:`Experiment`."""
        super().check(problem)
        if self.controllers is None:
            return
        where = "experiment.controllers"
        if not problem.is_locked or len(problem.tones) > 1:
            raise ParameterError(
                f'{where} needs one tone with drive.operation = "fm", "ce_fm" or "pm"; remove controllers'
            )
        if problem.late_fluid or any(force.timed for force in problem.forces):
            raise ParameterError(
                f"{where} takes no fluid with a memory and no force that depends on time; remove controllers"
            )
        fastest = problem.tones[0].frequency / PERIODS
        for name in ("phase_bandwidth", "amplitude_bandwidth"):
            if getattr(self.controllers, name) > fastest:
                raise ParameterError(
                    f"{where}.{name} is above a sixth of the drive frequency; write at most {units.show(fastest, 'Hz', 3)}"
                )

    def plan(self, problem: Problem) -> CurvePlan:
        """Return the curve of one point; see :class:`CurveExperiment`."""
        return CurvePlan("zc", np.array([self.zc]), [()], start=self.start)

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return a typical distance; see :class:`Experiment`."""
        return {"zc": tapping_distance(problem)}
