"""Basins: which of the steady states at one distance is reached from which start."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, Part, param, part
from dforce.experiments.base import Even, MotionExperiment, tapping_distance

if TYPE_CHECKING:
    import xarray as xr

    from dforce.core.arrays import Array
    from dforce.instrument import ToneNumbers
    from dforce.problem import Problem

MOST_POINTS = 4096  # along one axis
MOST_STARTS = 1_000_000


class StartGrid(Even):
    """Evenly spaced starts from `start` to `stop`, both included."""

    points: int = pydantic.Field(default=41, ge=1, le=MOST_POINTS, description="number of values")


class AmplitudeGrid(StartGrid):
    """Initial amplitudes."""

    title_of: ClassVar[str] = "amplitude"

    start: Number = param("0 nm", unit="m", symbol="A", low="0 m", doc="first initial amplitude")
    stop: Number = param(unit="m", symbol="A", low="0 m", doc="last initial amplitude")


class PhaseGrid(StartGrid):
    """Initial phase lags behind the first tone."""

    title_of: ClassVar[str] = "phase"

    points: int = pydantic.Field(default=40, ge=1, le=MOST_POINTS, description="number of values")
    start: Number = param("0 deg", symbol=r"\phi", doc="first initial phase lag")
    stop: Number = param("351 deg", symbol=r"\phi", doc="last initial phase lag")


class DeflectionGrid(StartGrid):
    """Initial deflections."""

    title_of: ClassVar[str] = "deflection"

    start: Number = param(unit="m", symbol="z", doc="first initial deflection")
    stop: Number = param(unit="m", symbol="z", doc="last initial deflection")


class VelocityGrid(StartGrid):
    """Initial velocities."""

    title_of: ClassVar[str] = "velocity"

    start: Number = param(unit="m/s", symbol=r"\dot z", doc="first initial velocity")
    stop: Number = param(unit="m/s", symbol=r"\dot z", doc="last initial velocity")


class Basins(MotionExperiment):
    """At one average distance the motion starts from every point of a grid, and settles to a state.

    The grid sets the start of the first tone's mode: amplitude and phase lag, or deflection and velocity at phase zero of the
    drive. Modes of other tones start with their free motion, and the sample starts relaxed.
    """

    procedure = "procedures.basins:basins"
    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "amplitude and phase": ("amplitude", "phase"),
        "deflection and velocity": ("deflection", "velocity"),
    }

    kind: Literal["basins"] = "basins"
    zc: Number = param(unit="m", symbol="z_c", doc="average tip–surface distance")
    amplitude: Part[AmplitudeGrid | None] = part(
        None, description="initial amplitudes; default: up to 1.2 times the free amplitude"
    )
    phase: Part[PhaseGrid | None] = part(None, description="initial phase lags; default: 40 from 0 to 351 degrees")
    deflection: Part[DeflectionGrid | None] = part(
        None, description="initial deflections, with velocities, instead of amplitudes and phases"
    )
    velocity: Part[VelocityGrid | None] = part(None, description="initial velocities, with deflections")

    @pydantic.model_validator(mode="after")
    def _one_kind_of_start(self) -> Self:
        if (self.deflection is None) != (self.velocity is None):
            raise ParameterError("experiment needs both deflection and velocity, or neither")
        if self.deflection is not None and (self.amplitude is not None or self.phase is not None):
            raise ParameterError("experiment has both amplitude or phase and deflection; write one kind of start")
        return self

    def coordinates(self, problem: Problem) -> dict[str, Any]:
        """Return the two axes of the starts, in SI (phases in degrees); see :class:`Experiment`."""
        if self.deflection is not None and self.velocity is not None:
            return {"start_deflection": self.deflection.values(), "start_velocity": self.velocity.values()}
        amplitude = self.amplitude or AmplitudeGrid(stop=1.2 * problem.tones[0].A0 * problem.tip_share)
        phase = self.phase or PhaseGrid()
        return {"start_amplitude": amplitude.values(), "start_phase": np.degrees(phase.values())}

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return a typical distance; see :class:`Experiment`."""
        return {"zc": tapping_distance(problem)}


def starts_of_states(basins: xr.Dataset, tone: ToneNumbers) -> tuple[Array, Array]:
    """Return where each state of basins lies among the starts: along the first and the second dimension of `reached` (SI).

    The grid holds motions of the first tone's mode, so a state is its motion, not its reading. Phases (degrees) lie within the
    range of the starts' phases.
    """
    first, second = map(str, basins["reached"].dims)
    amplitude, phase = (basins[name].isel(mode=tone.mode).values for name in ("mode_amplitude", "mode_phase"))
    if first == "start_amplitude":
        low = float(basins[second].min())
        return amplitude, low + (phase - low) % 360.0
    motion = amplitude * np.exp(1j * (tone.phase - np.radians(phase)))
    return motion.real, -2.0 * np.pi * tone.frequency * motion.imag
