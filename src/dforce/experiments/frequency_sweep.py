"""Frequency sweep: the resonance curve at a distance, up and down, with its hysteresis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
import pydantic

from dforce.core import units
from dforce.core.errors import ParameterError, shorten
from dforce.core.parameters import Number, Parameters, Part, param, part
from dforce.experiments.base import (
    MOST_POINTS,
    PROTOCOL,
    CaseLike,
    MotionExperiment,
    Progress,
    ProtocolName,
    Start,
    refuse_fresh_starts,
    tapping_distance,
)

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.solvers import SolverSettings


class FrequencyGrid(Parameters):
    """Evenly spaced frequencies from `start` to `stop`, both included."""

    title_of: ClassVar[str] = "frequency"

    start: Number = param(unit="Hz", symbol="f", above="0 Hz", high="10 GHz", doc="first frequency")
    stop: Number = param(unit="Hz", symbol="f", above="0 Hz", high="10 GHz", doc="last frequency")
    points: int = pydantic.Field(default=201, ge=1, le=MOST_POINTS, description="number of frequencies")

    def values(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the frequencies (Hz)."""
        return np.linspace(self.start, self.stop, self.points)


def _frequencies(given: Any) -> Any:
    """Refuse what is neither a grid nor a list of frequencies."""
    if isinstance(given, tuple) and not 0 < len(given) <= MOST_POINTS:
        raise ParameterError(f"has {len(given)} frequencies; give 1 to {MOST_POINTS}")
    if isinstance(given, float):
        return (given,)
    if not isinstance(given, FrequencyGrid | dict | tuple):
        raise ParameterError(f"is {shorten(given)}, which is not a list of frequencies or a grid")
    return given


class FrequencySweep(MotionExperiment):
    """The drive frequency of tone 1 goes up or down at constant driving force, slowly or by sudden steps.

    The force produces the free amplitude `A0` at the drive frequency of the case, as on an instrument with a constant drive
    signal: `A0` is the amplitude of the free curve at this frequency.
    """

    kind: Literal["frequency_sweep"] = "frequency_sweep"
    frequency: Part[Annotated[FrequencyGrid | tuple[float, ...], pydantic.BeforeValidator(_frequencies)]] = param(
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

    @pydantic.model_validator(mode="after")
    def _starts_anew_by_steps(self) -> Self:
        refuse_fresh_starts(self.protocol, self.carry_state)
        return self

    def frequencies(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the frequencies (Hz) in your order."""
        return self.frequency.values() if isinstance(self.frequency, FrequencyGrid) else np.array(self.frequency)

    def visits(self) -> list[tuple[int, ...]]:
        """Return the indices of the result in the order of the sweep."""
        upward: list[int] = [int(i) for i in np.argsort(self.frequencies(), kind="stable")]
        if self.direction == "up":
            return [(i,) for i in upward]
        if self.direction == "down":
            return [(i,) for i in reversed(upward)]
        return [(i, way) for way, order in enumerate((upward, reversed(upward))) for i in order]

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return five half-widths of the resonance to both sides; see :class:`Experiment`."""
        mode = problem.modes[0]
        low, high = (units.show(mode.f0 * max(1.0 + side * 2.5 / mode.Q, 0.1), "Hz", 4) for side in (-1.0, 1.0))
        return {"frequency": {"start": low, "stop": high}, "zc": tapping_distance(problem)}

    def run(
        self,
        problem: Problem,
        settings: SolverSettings,
        progress: Progress,
        earlier: xr.Dataset | None = None,
        case: CaseLike | None = None,
    ) -> xr.Dataset:
        """Return the resonance curve; see :class:`Experiment`."""
        from dforce.experiments._curve import Curve
        from dforce.results.dataset import describe
        from dforce.solvers.block import Block

        problem, frequencies = problem.at_height(self.zc), self.frequencies()
        coords: dict[str, Any] = {"frequency": frequencies}
        if self.direction == "both":
            coords["direction"] = ["up", "down"]
        lowest = float(frequencies.min())

        def make(points: int | None) -> Block:
            return Block.along_frequency(problem, self.zc, lowest, settings, self.harmonics, points)

        curve = Curve(
            make,
            coords,
            self.visits(),
            self.protocol,
            self.carry_state,
            self.start,
            "jump_frequency",
            ("down", "up"),
            lambda frequency: f"frequency = {units.show(frequency, 'Hz', 6)}",
        )
        return describe(curve.run(progress, earlier).assign_coords(zc=self.zc))

    def problem_at(self, problem: Problem, point: xr.Dataset, case: CaseLike) -> Problem:
        """Return the problem at the frequency of a point; see :class:`Experiment`."""
        return problem.at_height(self.zc).at_frequency(float(point["frequency"]))
