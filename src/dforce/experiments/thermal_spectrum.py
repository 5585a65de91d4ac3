"""The thermal spectrum of a free lever, from which spring constants are calibrated."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

from dforce.core import units
from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, param
from dforce.experiments.base import Experiment

if TYPE_CHECKING:
    from dforce.problem import Problem

OVERSAMPLED = 8  # samples a period of the fastest mode
MOST_SAMPLES = 30_000_000  # of a record
LINES = 12.0  # points of the spectrum across a resonance
BROAD = 10.0  # quality factor below which a resonance gets more of them: it is not narrow against its frequency
SHORTEST = 4  # segments that the spectrum is the mean of, at least


class ThermalSpectrum(Experiment):
    """Thermal motion of the undriven lever, far from the sample; a fit to its spectrum calibrates spring constants."""

    procedure = "procedures.thermal_spectrum:thermal_spectrum"
    unswept = ("frequency",)

    kind: Literal["thermal_spectrum"] = "thermal_spectrum"
    duration: Number = param("1 s", above="0 s", doc="length of the record")

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return a record long enough for the resonances; see :class:`Experiment`."""
        shortest, longest = _allowed(problem)
        return {"duration": units.show(min(max(1.0, 2.0 * shortest), 0.9 * longest), "s", 3)}

    def check(self, problem: Problem) -> None:
        """Raise :class:`ParameterError` without thermal motion, or for an unsuitable length; see :class:`Experiment`."""
        if problem.noise.kT <= 0.0:
            raise ParameterError("noise.thermal = false, but a thermal spectrum needs thermal motion")
        shortest, longest = _allowed(problem)
        asked = f"experiment.duration = {units.show(self.duration, 's', 4)}"
        if self.duration < shortest:
            wanted = units.show(1.006 * shortest, "s", 3)  # which three digits do not bring below
            raise ParameterError(f"{asked} is too short to resolve the resonance; use {wanted} or more")
        if self.duration > longest:
            raise ParameterError(f"{asked} is too long; use at most {units.show(0.994 * longest, 's', 3)}")


def rate_of(problem: Problem) -> float:
    """Return the samples in a second."""
    return OVERSAMPLED * max(mode.f0 for mode in problem.modes)


def segment_of(problem: Problem, rate: float) -> int:
    """Return how many samples a segment takes to resolve the sharpest resonance."""
    return math.ceil(rate * LINES / min(mode.f0 / max(mode.Q, BROAD) for mode in problem.modes))


def _allowed(problem: Problem) -> tuple[float, float]:
    """Return the shortest record that resolves the resonances, and the longest that is kept (s)."""
    rate = rate_of(problem)
    return SHORTEST * segment_of(problem, rate) / rate, MOST_SAMPLES / rate
