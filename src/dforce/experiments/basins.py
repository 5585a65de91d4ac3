"""Basins: which of the steady states at one distance is reached from which start."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, Parameters, Part, param, part
from dforce.experiments.base import CaseLike, MotionExperiment, Progress, tapping_distance

if TYPE_CHECKING:
    import xarray as xr

    from dforce.core.parallel import Crew
    from dforce.kernel import Array
    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.integrator import Integrator, Motion
    from dforce.solvers.problem_batch import Indices
    from dforce.solvers.protocols import Protocol
    from dforce.solvers.transient import Watch

BLOCK, LEAST_BLOCK = 256, 8  # starts that settle side by side; where the force has memory or branches
ALIKE = 5e-3  # of the free amplitude: states whose complex amplitudes are so near are one
MOST_POINTS = 4096  # along one axis
MOST_STARTS = 1_000_000


class Even(Parameters):
    """Evenly spaced values from `start` to `stop`, both included."""

    points: int = pydantic.Field(default=41, ge=1, le=MOST_POINTS, description="number of values")

    def values(self) -> Array:
        """Return the values in SI."""
        return np.linspace(getattr(self, "start"), getattr(self, "stop"), self.points)  # noqa: B009 of the subclasses


class AmplitudeGrid(Even):
    """Initial amplitudes."""

    title_of: ClassVar[str] = "amplitude"

    start: Number = param("0 nm", unit="m", symbol="A", low="0 m", doc="first initial amplitude")
    stop: Number = param(unit="m", symbol="A", low="0 m", doc="last initial amplitude")


class PhaseGrid(Even):
    """Initial phase lags behind the first tone."""

    title_of: ClassVar[str] = "phase"

    points: int = pydantic.Field(default=40, ge=1, le=MOST_POINTS, description="number of values")
    start: Number = param("0 deg", symbol=r"\phi", doc="first initial phase lag")
    stop: Number = param("351 deg", symbol=r"\phi", doc="last initial phase lag")


class DeflectionGrid(Even):
    """Initial deflections."""

    title_of: ClassVar[str] = "deflection"

    start: Number = param(unit="m", symbol="z", doc="first initial deflection")
    stop: Number = param(unit="m", symbol="z", doc="last initial deflection")


class VelocityGrid(Even):
    """Initial velocities."""

    title_of: ClassVar[str] = "velocity"

    start: Number = param(unit="m/s", symbol=r"\dot z", doc="first initial velocity")
    stop: Number = param(unit="m/s", symbol=r"\dot z", doc="last initial velocity")


class Basins(MotionExperiment):
    """At one average distance the motion starts from every point of a grid, and settles to a state.

    The grid sets the start of the first tone's mode: amplitude and phase lag, or deflection and velocity at phase zero of the
    drive. Modes of other tones start with their free motion, and the sample starts relaxed.
    """

    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "amplitude and phase": ("amplitude", "phase"),
        "deflection and velocity": ("deflection", "velocity"),
    }

    kind: Literal["basins"] = "basins"
    zc: Number = param(unit="m", symbol="z_c", doc="average tip–surface distance")
    amplitude: Part[AmplitudeGrid | None] = part(
        None, description="initial amplitudes; default: up to 1.2 times the free amplitude"
    )
    phase: Part[PhaseGrid | None] = part(None, description="initial phase lags; default: 0 to 360 degrees")
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

    def grids(self, problem: Problem) -> dict[str, Array]:
        """Return the two axes of the starts, in SI (phases in degrees), by the names of their coordinates."""
        if self.deflection is not None and self.velocity is not None:
            return {"start_deflection": self.deflection.values(), "start_velocity": self.velocity.values()}
        amplitude = self.amplitude or AmplitudeGrid(stop=1.2 * problem.tones[0].A0)
        phase = self.phase or PhaseGrid()
        return {"start_amplitude": amplitude.values(), "start_phase": np.degrees(phase.values())}

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
        """Return the state of each start, and the states; see :class:`Experiment`."""
        import xarray as xr

        from dforce.core.parallel import Crew
        from dforce.results.dataset import describe

        problem, grids = problem.at_height(self.zc), self.grids(problem)
        if np.prod([float(len(grid)) for grid in grids.values()]) > MOST_STARTS:
            raise ParameterError(f"experiment has more than {MOST_STARTS} starts; use fewer points in its grids")
        shape = tuple(map(len, grids.values()))
        (kind, first), (_, second) = grids.items()
        starts = Starts(problem, settings, self.harmonics, self.zc, first, second, kind)
        crew = Crew(len(starts), progress)
        whole = crew.run(starts.jobs(crew), f"{shape[0]} × {shape[1]} starts")
        order = starts.by_share()
        number = np.zeros(len(starts.states) + 1, dtype=np.int64)  # behind the states: of no state
        number[order] = np.arange(1, len(order) + 1)
        data = xr.Dataset(
            {
                "reached": (tuple(grids), number[starts.reached].reshape(shape)),
                "status": (tuple(grids), starts.status.reshape(shape)),
                **starts.table(order),
            },
            coords={**grids, "state": np.arange(1, len(order) + 1), "zc": self.zc},
        )
        for dim in ("tone", "mode", "harmonic", "multiplier"):
            if dim in data.dims:
                data[dim] = np.arange(1, data.sizes[dim] + 1)
        if not whole:
            data.attrs["interrupted"] = 1
        return describe(data)


@dataclass
class State:
    """A steady state: complex amplitudes at the tones (m), its observables, and whether it repeats."""

    amplitudes: np.ndarray[Any, np.dtype[np.complex128]]
    values: dict[str, Any]
    repeats: bool


@dataclass
class Starts:
    """The starts of a grid, and the states that they reach."""

    problem: Problem
    settings: SolverSettings
    harmonics: int
    zc: float
    first: Array
    second: Array
    kind: str
    states: list[State] = field(default_factory=list)

    def __post_init__(self) -> None:
        from dforce.results.status import Status

        self._lock = threading.Lock()  # blocks of starts are done on several threads
        self.reached = np.full(len(self), -1)
        self.status = np.full(len(self), Status.NOT_COMPUTED, dtype=np.int8)

    def __len__(self) -> int:
        return len(self.first) * len(self.second)

    def jobs(self, crew: Crew) -> Iterable[Callable[[], None]]:
        """Give what is to be done: blocks of starts."""
        from dforce.solvers.block import Block
        from dforce.solvers.integrator import load_kernels

        load_kernels(self.problem)  # before threads ask for them at the same time
        template = Block.of_one(self.problem, self.settings, self.harmonics, crew.watch)
        motions = [self.motion(template.integrator(0, self.zc), number) for number in range(len(self))]
        size = BLOCK if template.is_smooth else LEAST_BLOCK
        for start in range(0, len(self), size):
            which = np.arange(start, min(start + size, len(self)), dtype=np.int64)
            yield functools.partial(self._settle, which, motions, crew)

    def motion(self, integrator: Integrator, number: int) -> Motion:
        """Return one start, as an integrator takes it."""
        from dforce.solvers.integrator import free_amplitudes, with_amplitudes

        one, other = self.first[number // len(self.second)], self.second[number % len(self.second)]
        amplitudes, tone = free_amplitudes(integrator), integrator.problem.tones[0]
        amplitudes[0] = 0.0
        if self.kind == "start_amplitude":
            amplitudes[0, tone.mode] = one * np.exp(1j * (tone.phase - np.radians(other)))
        else:
            amplitudes[0, tone.mode] = one - 1j * other / (2.0 * np.pi * tone.frequency)
        return with_amplitudes(integrator, amplitudes)

    def _settle(self, which: Indices, motions: list[Motion], crew: Crew) -> None:
        """Settle a block of starts; those that need more samples with more."""
        from dforce.solvers.block import Block
        from dforce.solvers.sample_counts import sample_counts

        plain = Block.of_one(self.problem, self.settings, self.harmonics, crew.watch)
        crew_add: Callable[[int], None] = crew.add
        for points, is_last in sample_counts(plain.points, self.settings):
            which = self._settle_with(points, which, motions, crew.watch, crew_add, is_last)
            if not len(which):
                return
            crew_add = _nothing  # they are counted

    def _settle_with(
        self,
        points: int,
        which: Indices,
        motions: list[Motion],
        watch: Watch,
        told: Callable[[int], None],
        is_last: bool,
    ) -> Indices:
        """Settle starts side by side; return those that have to be settled again."""
        from dforce.experiments.table import statuses
        from dforce.results.status import REPEATING, Status
        from dforce.solvers.block import Block
        from dforce.solvers.problem_batch import Lot
        from dforce.solvers.protocols import STEPWISE, make_protocol
        from dforce.solvers.quasi_static_walk import Walk
        from dforce.solvers.states import States

        lot = Lot.of([self.problem]).take(np.zeros(len(which), dtype=np.int64))
        block = Block(lot, lambda _, zc: (self.problem, zc), self.settings, self.harmonics, points, watch)
        values = np.full((len(which), 1), self.zc)
        starts = [motions[i] for i in which]
        if block.is_periodic:
            solver: Protocol = Walk(block, values, States.of(*starts), told)
        else:
            solver = make_protocol(STEPWISE, block, values, starts, told)
        solver.run()
        columns, status = solver.points.columns(block, values), statuses(solver.points, block, values)[:, 0]
        wrong = status == Status.UNRESOLVED
        for place in np.flatnonzero(~wrong if not is_last else np.ones_like(wrong)).tolist():
            number = int(which[place])
            self.status[number] = status[place]
            if status[place] in (*REPEATING, Status.NOT_REPEATING):
                of_start = {name: value[place, 0] for name, value in columns.items()}
                self._sort_in(number, of_start, status[place] in REPEATING)
        return which[wrong] if not is_last else which[:0]

    def _sort_in(self, number: int, values: dict[str, Any], repeats: bool) -> None:
        """Give a start its state: one found before, or a new one. All motions that do not repeat count as one state."""
        amplitudes = np.asarray(values["amplitude"]) * np.exp(-1j * np.radians(values["phase"]))
        nearness = ALIKE * self.problem.tones[0].A0
        with self._lock:
            for i, state in enumerate(self.states):
                near = bool(np.max(np.abs(state.amplitudes - amplitudes)) < nearness)
                if state.repeats == repeats and (near or not repeats):
                    self.reached[number] = i
                    break
            else:
                self.states.append(State(amplitudes, values, repeats))
                self.reached[number] = len(self.states) - 1

    def by_share(self) -> list[int]:
        """Return the states' numbers, the most frequently reached first."""
        return sorted(range(len(self.states)), key=lambda i: -int(np.sum(self.reached == i)))

    def table(self, order: list[int]) -> dict[str, Any]:
        """Return the observables and shares of the states, as variables of a Dataset."""
        from dforce.core.quantities import OBSERVABLES

        count = max(1, int(np.sum(self.reached >= 0)))
        table: dict[str, Any] = {"share": ("state", [float(np.sum(self.reached == i)) / count for i in order])}
        for name, observable in OBSERVABLES.items():
            column = [self.states[i].values[name] for i in order if name in self.states[i].values]
            if column and len(column) == len(order) and name not in ("settling_periods", "drift", "corrections"):
                table[name] = (("state", *observable.dims), np.array(column))
        return table


def _nothing(points: int) -> None:
    """Count nothing."""
