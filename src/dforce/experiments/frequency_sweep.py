"""Frequency sweep: the resonance curve at a distance, up and down, with its hysteresis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import pydantic

from dforce.core import units
from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, Part, param, part
from dforce.experiments.base import (
    MOST_POINTS,
    PROTOCOL,
    CurvePlan,
    Even,
    PathExperiment,
    ProtocolName,
    Start,
    listed,
    tapping_distance,
    values_of,
)

if TYPE_CHECKING:
    from dforce.problem import Problem


class FrequencyGrid(Even):
    """Evenly spaced frequencies from `start` to `stop`, both included."""

    title_of: ClassVar[str] = "frequency"

    start: Number = param(unit="Hz", symbol="f", above="0 Hz", high="10 GHz", doc="first frequency")
    stop: Number = param(unit="Hz", symbol="f", above="0 Hz", high="10 GHz", doc="last frequency")
    points: int = pydantic.Field(default=201, ge=1, le=MOST_POINTS, description="number of frequencies")


class FrequencySweep(PathExperiment):
    """The drive frequency of tone 1 goes up or down at constant driving force, slowly or by sudden steps.

    The force produces the free amplitude `A0` at the drive frequency of the case, as on an instrument with a constant drive
    signal. `A0` is the amplitude of the free curve at this frequency.
    """

    both_ways = ("up", "down")
    falls_first = False
    locks = True

    kind: Literal["frequency_sweep"] = "frequency_sweep"
    frequency: Part[Annotated[FrequencyGrid | tuple[float, ...], listed("frequencies", "Hz")]] = param(
        unit="Hz",
        symbol="f",
        above="0 Hz",
        high="10 GHz",
        doc="frequencies of tone 1: a grid {start, stop, points} or a list; the driving force is constant",
    )
    zc: Number = param(unit="m", symbol="z_c", doc="average tip–surface distance")
    direction: Literal["up", "down", "both"] = pydantic.Field(
        default="both",
        title="Direction",
        description="up (low to high), down (high to low), or both one after the other",
    )
    protocol: ProtocolName = PROTOCOL
    carry_state: bool = pydantic.Field(
        default=True,
        description="stepwise: start each frequency from the motion at the frequency before; otherwise from `start`",
    )
    start: Part[Start] = part("free", description="motion at the start: free, rest, or an amplitude and a phase")

    def check(self, problem: Problem) -> None:
        """Raise :class:`ParameterError` if a lock sets the frequency; see :class:`Experiment`."""
        super().check(problem)
        tone = problem.tones[0]
        if problem.is_locked and (tone.lock is None or "phase" in tone.lock.held or len(problem.tones) > 1):
            raise ParameterError(
                'a frequency sweep needs drive.operation = "am" or "pm" with one tone, because the other modes of '
                'operation find the frequency; for the frequency shift along zc write experiment.kind = "approach"'
            )

    @property
    def path(self) -> str:
        """The path of the varied parameter, the frequency of the first tone; see :class:`Experiment`."""
        return "drive.frequency"

    def plan(self, problem: Problem) -> CurvePlan:
        """Return the resonance curve; see :class:`CurveExperiment`."""
        return self.along("frequency", values_of(self.frequency), zc=self.zc)

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return a typical distance, and five half-widths on both sides of the resonance; see :class:`Experiment`."""
        mode = problem.modes[0]
        low, high = (units.show(mode.f0 * max(1.0 + side * 2.5 / mode.Q, 0.1), "Hz", 4) for side in (-1.0, 1.0))
        return {"frequency": {"start": low, "stop": high}, "zc": tapping_distance(problem)}
