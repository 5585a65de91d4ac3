"""Common part of experiments: the grid of distances, the start of the motion, the plan of a curve, the base class."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
import pydantic

from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, shorten
from dforce.core.parameters import Number, Numbers, Parameters, Part, param

if TYPE_CHECKING:
    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.block import Block
    from dforce.solvers.integrator import Integrator, Motion

Progress = Callable[[int, int, str], None]  # points done, points in all, the current work
Place = tuple[int, ...]  # in the arrays of a result

DISTANCE = "experiment.zc"
SET_POINT = 0.8  # of the free amplitude: a common choice, neither light nor hard tapping
MOST_POINTS = 1_000_000  # a grid beyond this is a slip of the keyboard
MOST_SHARE = 50.0  # of the free amplitude; more are per cent


class Even(Parameters):
    """Evenly spaced values from `start` to `stop`, both included; a subclass declares these and `points`."""

    @pydantic.model_validator(mode="after")
    def _has_different_ends(self) -> Self:
        start, stop, points = (getattr(self, name) for name in ("start", "stop", "points"))
        if start == stop and points > 1:
            raise ParameterError(f"has equal start and stop, so its {points} points are equal; change stop")
        return self

    def values(self) -> Array:
        """Return the values in SI."""
        return np.linspace(getattr(self, "start"), getattr(self, "stop"), getattr(self, "points"))  # noqa: B009


class Grid(Even):
    """Evenly spaced distances from `start` to `stop`, both included."""

    title_of: ClassVar[str] = "zc"

    start: Number = param(unit="m", symbol="z_c", doc="first average distance")
    stop: Number = param(unit="m", symbol="z_c", doc="last average distance")
    points: int = pydantic.Field(default=201, ge=1, le=MOST_POINTS, description="number of distances")


class RelativeGrid(Even):
    """Evenly spaced distances from `start` to `stop`, both included, as shares of the free amplitude."""

    title_of: ClassVar[str] = "zc"
    title: ClassVar[str] = "shares of A0"

    example: ClassVar[Mapping[str, Any]] = {"of": "drive.A0", "start": 1.15, "stop": 0.3}

    of: Literal["drive.A0"] = pydantic.Field(description="the reference of the shares: the first tone's free amplitude")
    start: float = pydantic.Field(
        ge=-MOST_SHARE, le=MOST_SHARE, description="first average distance as a share of A0, such as 1.15"
    )
    stop: float = pydantic.Field(ge=-MOST_SHARE, le=MOST_SHARE, description="last average distance as a share of A0")
    points: int = pydantic.Field(default=201, ge=1, le=MOST_POINTS, description="number of distances")


def listed(words: str, unit: str) -> pydantic.BeforeValidator:
    """Turn a value, or a list such as ("12 nm", "1 nm"), into the numbers that pydantic validates; leave grids alone."""

    def numbers(given: Any) -> Any:
        if isinstance(given, Even | dict):
            return given
        try:
            items = [given] if isinstance(given, str | int | float) else list(given)
        except TypeError:
            raise ParameterError(f"is {shorten(given)}, which is not a list of {words} or a grid") from None
        if not 0 < len(items) <= MOST_POINTS:
            raise ParameterError(f"has {len(items)} {words}; give 1 to {MOST_POINTS}")
        return tuple(units.parse(item, unit) for item in items)

    return pydantic.BeforeValidator(numbers)


def values_of(given: Even | tuple[float, ...]) -> Array:
    """Return the values (SI) of a grid or a list."""
    return given.values() if isinstance(given, Even) else np.array(given)


def _kind_of_distances(given: Any) -> str:
    """Return the kind of distances of a value: in a union of tables, messages name the keys of this kind."""
    if isinstance(given, RelativeGrid) or (isinstance(given, dict) and "of" in given):
        return "relative"
    return "grid" if isinstance(given, Grid | dict) else "list"


Distances = Annotated[
    Annotated[Grid, pydantic.Tag("grid")]
    | Annotated[tuple[float, ...], pydantic.Tag("list")]
    | Annotated[RelativeGrid, pydantic.Tag("relative")],
    pydantic.Discriminator(_kind_of_distances),
    listed("distances", "m"),
]


class InitialMotion(Parameters):
    """A start of the motion at the first drive tone: z = A cos(wt - phase)."""

    title_of: ClassVar[str] = "start"

    amplitude: Number = param(unit="m", symbol="A", low="0 m", doc="initial amplitude")
    phase: Number = param("90 deg", symbol=r"\phi", doc="initial phase lag behind the first tone")


Start = Literal["free", "rest"] | InitialMotion
ProtocolName = Literal["quasi_static", "stepwise"]
PROTOCOL: Any = pydantic.Field(
    default="quasi_static",
    title="How the parameter changes",
    description="quasi_static: the parameter changes so slowly that the motion stays on its state until the state ends. "
    "stepwise: each point from the motion at the point before, after a sudden step",
)


@dataclass(frozen=True)
class CurvePlan:
    """A curve: the values of a parameter, their order, and how the motion is carried from one value to the next.

    Attributes
    ----------
    name
        Of the parameter in the result: "zc" or "frequency".
    values
        Its values (SI), as they lie in the result.
    visits
        Places of the result in the order in which the parameter comes to them.
    directions
        Names of the directions, where there are two one after the other.
    ways
        Names of the directions in which the parameter falls and rises.
    start, protocol, carry
        Where the motion starts, and how it is carried along.
    shares
        The values as shares of the free amplitude, if the user gave shares.
    zc
        Average distance (m), where it is not the parameter.
    """

    name: str
    values: Array
    visits: list[Place]
    directions: tuple[str, ...] = ()
    ways: tuple[str, str] = ("approach", "retract")
    start: Start = "free"
    protocol: ProtocolName = "quasi_static"
    carry: bool = True
    shares: Array | None = None
    zc: float | None = None

    @property
    def coords(self) -> dict[str, Any]:
        """The dimensions of the result with their coordinates; none for one point alone."""
        ways = {"direction": list(self.directions)} if self.directions else {}
        return {self.name: self.values} | ways if self.visits != [()] else {}


def _refuse_tones(problem: Problem) -> None:
    """Raise :class:`ParameterError` where several tones with a lock have no steady motion that the solver finds."""
    modes, am = {tone.mode for tone in problem.tones}, 'write operation = "am" for each tone'
    if len(problem.tones) > 2:
        raise ParameterError(
            f"drive has {len(problem.tones)} tones, but a lock allows two at most; remove tones, or {am}"
        )
    if len(modes) < 2:
        raise ParameterError(
            f"both tones of drive drive mode {modes.pop() + 1}, but a lock needs another mode for each; {am}"
        )


class Experiment(Parameters):
    """The plan of a run; one subclass, in one file, for each kind.

    Attributes
    ----------
    procedure
        The function that carries the plan out, as ``"module:name"`` below `dforce`, loaded when it is called; see
        :func:`dforce.runs.carry_out`.
    unswept
        Dimensions of variables that a sweep drops, such as the samples of a record.
    locks
        Whether it works under controllers that hold amplitude or phase.
    """

    title_of: ClassVar[str] = "experiment"
    procedure: ClassVar[str]
    unswept: ClassVar[tuple[str, ...]] = ()
    locks: ClassVar[bool] = False

    kind: str

    @classmethod
    @abstractmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return keys without a default, as text that suits an instrument: the first values of a form."""

    @property
    def path(self) -> str:
        """Path in the case of the parameter that it goes along; a distance where there is one alone."""
        return DISTANCE

    def coordinates(self, problem: Problem) -> dict[str, Any]:
        """Return the dimensions of its result that are known before it is done, with their coordinates."""
        return {}

    def check(self, problem: Problem) -> None:
        """Raise :class:`ParameterError`, as soon as a case is made, where an instrument does not allow the experiment."""
        if problem.is_locked and not self.locks:
            problem.refuse_lock(f"experiment.kind = {self.kind}")
        for key, only in (("protocol", "quasi_static"), ("start", "free"), ("record", "settled")):
            if problem.is_locked and getattr(self, key, None) not in (None, only):
                problem.refuse_lock(f"experiment.{key} = {shorten(getattr(self, key))}")
        for force in problem.forces:
            if force.timed:  # with its own period, which the lock's period may not fit
                problem.refuse_lock(f"the force {force.name}, which depends on time,")
        if problem.is_locked and len(problem.tones) > 1:
            _refuse_tones(problem)

    def range_of_zc(self, problem: Problem) -> tuple[float, float] | None:
        """Return the nearest and the farthest average distance (m); None where the plan does not contain them."""
        zc: Any = getattr(self, "zc", None)
        if zc is None:
            return None
        if isinstance(zc, float | tuple):
            ends = zc if isinstance(zc, tuple) else (zc,)
        else:
            unit = problem.tones[0].A0 if isinstance(zc, RelativeGrid) else 1.0
            ends = (unit * zc.start, unit * zc.stop)
        return min(ends), max(ends)


class MotionExperiment(Experiment):
    """An experiment that gives steady motions of the driven tip, and so their harmonics."""

    harmonics: int = pydantic.Field(
        default=10, ge=1, le=100, description="number of reported harmonics of the first tone"
    )


class DistanceExperiment(MotionExperiment):
    """An experiment that gives the amplitude along the distance, and so the states at a set point."""

    set_point: Numbers = param(
        SET_POINT,
        unit="1",
        symbol="A/A_0",
        above=0.0,
        high=1.0,
        doc="set points whose states the table of results shows, as shares of the free amplitude (one, or a list)",
    )

    @pydantic.field_validator("set_point", mode="before")
    @classmethod
    def _one_or_many(cls, given: Any) -> Any:
        return given if isinstance(given, list | tuple) else (given,)


class CurveExperiment(MotionExperiment):
    """One whose motions lie on a curve along a parameter."""

    procedure = "procedures.curve:curve"

    @abstractmethod
    def plan(self, problem: Problem) -> CurvePlan:
        """Return the curve."""

    def solved_with(self, settings: SolverSettings) -> SolverSettings:
        """Return the solver settings for its motions, from the settings of the case."""
        return settings

    def coordinates(self, problem: Problem) -> dict[str, Any]:
        """Return the dimensions of the curve; see :class:`Experiment`."""
        return self.plan(problem).coords


class PathExperiment(CurveExperiment):
    """An experiment that changes a parameter in one direction, the other, or both in turn, slowly or by sudden steps.

    Attributes
    ----------
    both_ways
        Names of the directions; a run of both has this order.
    falls_first
        Whether the parameter falls in the first of them.
    """

    both_ways: ClassVar[tuple[str, str]]
    falls_first: ClassVar[bool]

    if TYPE_CHECKING:  # fields of each of them, behind the values of its parameter
        direction: str
        protocol: ProtocolName
        carry_state: bool
        start: Part[Start]

    @pydantic.model_validator(mode="after")
    def _starts_anew_by_steps(self) -> Self:
        if self.protocol == "quasi_static" and not self.carry_state:
            raise ParameterError('experiment.carry_state = false needs protocol = "stepwise"; write both')
        return self

    def along(self, name: str, values: Array, shares: Array | None = None, zc: float | None = None) -> CurvePlan:
        """Return the plan of the curve over the values of a parameter."""
        there = np.argsort(-values if self.falls_first else values, kind="stable").tolist()
        is_both, orders = self.direction == "both", {self.both_ways[0]: there, self.both_ways[1]: there[::-1]}
        visits: list[Place] = [(i, way) for way, order in enumerate(orders.values()) for i in order]
        if not is_both:
            visits = [(i,) for i in orders[self.direction]]
        falls_and_rises = self.both_ways if self.falls_first else self.both_ways[::-1]
        how = self.start, self.protocol, self.carry_state
        return CurvePlan(name, values, visits, self.both_ways if is_both else (), falls_and_rises, *how, shares, zc)


def tapping_distance(problem: Problem) -> str:
    """Return a distance at which a tip taps."""
    return units.show(SET_POINT * problem.tones[0].A0 * problem.tip_share, "m", 3)


def whole_range(problem: Problem) -> dict[str, str]:
    """Return a range of distances from free motion to a tenth of its amplitude."""
    A0 = problem.tones[0].A0 * problem.tip_share
    return {"start": units.show(1.2 * A0, "m", 3), "stop": units.show(0.1 * A0, "m", 3)}


def initial_motion(integrator: Integrator, start: Start) -> Motion:
    """Return the motion that `start` asks for, at the start of a common period."""
    from dforce.solvers.integrator import with_amplitudes

    amplitudes = integrator.problem.free.copy()
    if isinstance(start, InitialMotion):
        first = integrator.problem.tones[0]
        amplitudes[0] = 0.0
        amplitudes[0, first.mode] = start.amplitude * np.exp(1j * (first.phase - start.phase))
    elif start == "rest":
        amplitudes[:] = 0.0
    return with_amplitudes(integrator, amplitudes)


def initial_motions(block: Block, at: Array, start: Start) -> list[Motion]:
    """Return the motions that `start` asks for, of each problem of a block at its value of the parameter.

    A problem alone starts as the same one in a sweep, to the last bit.
    """
    from dforce.solvers.integrator import Motion
    from dforce.solvers.model import FREQUENCY

    tones = block.batch.example.tones
    if block.parameter == FREQUENCY or len(tones) > 1:
        return [initial_motion(block.integrator(case, value), start) for case, value in enumerate(at.tolist())]
    batch = block.batch.at_heights(at)
    if isinstance(start, InitialMotion):
        rows = batch.moving(tones[0].mode, start.amplitude, start.phase)
    else:
        rows = batch.free() if start == "free" else batch.moving(tones[0].mode, 0.0, 0.0)
    memory, branch = np.zeros(len(block.memory_scale)), np.zeros(block.hysteresis)
    return [Motion(tuple(row), memory, branch, 0) for row in rows.tolist()]
