"""Frequency sweep: the resonance curve at a distance, up and down, with its hysteresis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
import pydantic

from dforce import units
from dforce.errors import ParameterError, shorten
from dforce.experiments._experiment import (
    MOST_POINTS,
    CaseLike,
    Experiment,
    Progress,
    Start,
    initial_motion,
    tapping_distance,
)
from dforce.experiments._restart import restore, stop
from dforce.parameters import Parameters, param

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.solvers import SolverSettings


class FrequencyGrid(Parameters):
    """Evenly spaced frequencies from `start` to `stop`, both included."""

    title_of: ClassVar[str] = "frequency"

    start: float = param(unit="Hz", symbol="f", above="0 Hz", high="10 GHz", doc="first frequency")
    stop: float = param(unit="Hz", symbol="f", above="0 Hz", high="10 GHz", doc="last frequency")
    points: int = pydantic.Field(201, ge=1, le=MOST_POINTS, description="number of frequencies")

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


class FrequencySweep(Experiment):
    """The drive frequency of tone 1 goes up or down at constant driving force; the motion settles at each.

    The force is the one that gives the free amplitude `A0` at the case's own drive frequency, as on an instrument
    where the drive is set at resonance and only its frequency is swept: `A0` is the amplitude of the free curve there.
    """

    kind: Literal["frequency_sweep"] = "frequency_sweep"
    frequency: Annotated[FrequencyGrid | tuple[float, ...], pydantic.BeforeValidator(_frequencies)] = param(
        unit="Hz", symbol="f", above="0 Hz", high="10 GHz",
        doc="frequencies of tone 1: a grid {start, stop, points} or a list; the driving force stays as it is",
    )  # fmt: skip
    zc: float = param(unit="m", symbol="z_c", doc="average tip–surface distance")
    direction: Literal["up", "down", "both"] = pydantic.Field(
        "both", description="up (low to high), down (high to low), or both one after the other"
    )
    carry_state: bool = pydantic.Field(
        True, description="start each frequency from the motion at the one before; otherwise each from `start`"
    )
    start: Start = pydantic.Field("free", description="motion at the start: free, rest, or an amplitude and a phase")

    def frequencies(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the frequencies (Hz), as given."""
        return self.frequency.values() if isinstance(self.frequency, FrequencyGrid) else np.array(self.frequency)

    def visits(self) -> list[tuple[int, ...]]:
        """Return the places of the result in the order in which the drive comes to them."""
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
        self, problem: Problem, settings: SolverSettings, progress: Progress, earlier: xr.Dataset | None = None,
        case: CaseLike | None = None,
    ) -> xr.Dataset:  # fmt: skip
        """Return the resonance curve; see :class:`Experiment`."""
        from dforce.experiments._table import Table
        from dforce.results import Status, describe
        from dforce.solvers.integrator import INTEGRATORS
        from dforce.solvers.response import Response

        frequencies, visits = self.frequencies(), self.visits()
        # the lowest frequency needs the most samples per period for the same modes
        integrator = INTEGRATORS[settings.integrator](
            problem.at_frequency(float(frequencies.min())), settings, self.harmonics
        )

        def place(frequency: float) -> None:
            integrator.take(problem.at_frequency(frequency))
            integrator.place(self.zc)

        coords: dict[str, Any] = {"frequency": frequencies}
        if self.direction == "both":
            coords["direction"] = ["up", "down"]
        table = Table(tuple(coords), coords, integrator)
        done = 0

        def watch() -> None:
            note = units.show(float(frequencies[visits[min(done, len(visits) - 1)][0]]), "Hz", 6)
            progress(done, len(visits), f"frequency = {note}")

        response = Response(integrator, place, float(frequencies.min()), float(frequencies.max()))
        motion = initial_motion(integrator, self.start)
        if earlier is not None:
            done, motion = restore(table, earlier, visits, motion)
            if done:
                response.go(float(frequencies[visits[done - 1][0]]))
                response.take_up(motion)
        try:
            for visit in visits[done:]:
                watch()
                response.go(float(frequencies[visit[0]]))
                if not done or not self.carry_state or not motion.is_finite:
                    found = response.settled(initial_motion(integrator, self.start), watch)
                else:
                    found = response.carried(watch)
                table.put([visit], found)
                motion, done = found.motion, done + 1
            progress(done, len(visits), "")
        except KeyboardInterrupt:
            pass
        table.write()
        for place_of in visits[done:]:
            table.status[place_of] = Status.NOT_COMPUTED  # even if stopped just before it counted as done
        data = describe(table.dataset().assign_coords(zc=self.zc))
        data.attrs["samples_per_period"] = integrator.points
        if done < len(visits):
            stop(data, motion)
        return data

    def problem_at(self, problem: Problem, point: xr.Dataset, case: CaseLike) -> Problem:
        """Return the problem at the frequency of a point; see :class:`Experiment`."""
        return problem.at_frequency(float(point["frequency"]))
