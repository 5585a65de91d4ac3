"""The integrators as objects: each advances a motion by whole periods and measures it on the way."""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from dforce import kernel
from dforce.core.arrays import AnyArray, Array, Complexes
from dforce.core.errors import ParameterError
from dforce.integrators import loops, lsoda
from dforce.integrators.fitted import fit
from dforce.observables import lockin, measure
from dforce.problem import Problem
from dforce.solvers.compiled import TipFunctions, load_kernels
from dforce.solvers.settings import SolverSettings

if TYPE_CHECKING:
    from dforce.engine.marching import Marched

LEAST_SAMPLES = 32  # per period of a mode or tone
PHASE_ERROR = 1e-4  # rad that RK4's own error may turn the slowest-damped mode by, at most
FOLLOWED = 1.2  # of the shortest time in which a fluid follows: longest step; its errors count for little
RELAXED = 0.5  # of the shortest relaxation time: longest step; at 2.8 RK4 is unstable, here it errs by 3e-4
MOST_POINTS = 1_000_000  # samples per period
ROUND = 16  # sample counts are multiples of this
SLACK = 1e-9  # of the samples needed: one so few more is rounding
HARMONIC = 100.0  # times the tolerance: error of a step of the engine in the fastest harmonic of the force
STEPS_PER_PERIOD = 60  # of the fastest mode, that LSODA takes at least: so that it cannot step over a contact


@dataclass(frozen=True)
class Motion:
    """The state of cantilever and sample at the start of a period of the first tone, scaled (see ``kernel``)."""

    y: tuple[float, ...]
    memory: Array
    branch: Array
    period: int

    @property
    def is_finite(self) -> bool:
        """Whether all numbers are finite."""
        return all(map(math.isfinite, self.y)) and all(map(math.isfinite, self.memory))


def sample_count(problem: Problem, settings: SolverSettings) -> int:
    """Return the samples per period of the first tone: the setting, or more where a mode or tone needs them.

    Every tone and mode gets at least :data:`LEAST_SAMPLES` per period, and the relaxation of a force's memory a step of at
    most :data:`RELAXED` of its time. In a fluid with a memory the lever is not fitted to the steps (see ``fitted``). RK4 turns
    a mode's phase at resonance by 2 Q (wh)^4 / 120, from its leading error term, and the step h is made small enough for
    :data:`PHASE_ERROR`. A lever that changes with its height counts with its values far away.

    Raises
    ------
    ParameterError
        When more than :data:`MOST_POINTS` samples are needed; of a force that relaxes too fast, with its name.
    """
    first, modes = problem.tones[0].frequency, problem.at_height(math.inf).modes
    needs = [LEAST_SAMPLES * tone.frequency / first for tone in problem.tones]
    for mode in modes:
        least = float(LEAST_SAMPLES)
        if settings.integrator == "rk4" and mode.memory is not None:
            least = max(least, 2.0 * math.pi * (2.0 * mode.Q / (120.0 * PHASE_ERROR)) ** 0.25)
        needs.append(least * mode.f0 / first)
        if mode.memory is not None and settings.integrator != "langevin":  # whose step is exact for lever and fluid
            needs.append(max(mode.memory.rates) / (FOLLOWED * first))
    for force in problem.forces:
        needs.append(force.fastest_rate / (RELAXED * first))
        if needs[-1] > MOST_POINTS:
            raise ParameterError(
                f"{force.name} relaxes in {1.0 / force.fastest_rate:.3g} s, so fast relative to the period of "
                f"{1.0 / first:.3g} s that more than {MOST_POINTS} samples per period are needed; use a longer relaxation time"
            )
    return int(enough_samples(np.array(max(needs)), settings))


def enough_samples(needs: Array, settings: SolverSettings) -> Any:
    """Return the samples per period asked for, or, where more are needed, the next multiple of :data:`ROUND`.

    Ratios of frequencies fall on such multiples: rounding does not decide between them.

    Raises
    ------
    ParameterError
        When more than :data:`MOST_POINTS` are needed.
    """
    if (most := np.max(needs)) > MOST_POINTS:
        raise ParameterError(
            f"the fastest mode, tone or memory needs {most:.2g} samples per period of the drive, and {MOST_POINTS} are the "
            "limit; use a higher drive frequency"
        )
    needed = needs * (1.0 - SLACK)
    raised = ROUND * np.ceil(needed / ROUND).astype(np.int64)
    return np.where(needed <= settings.points_per_period, settings.points_per_period, raised)


class Integrator(ABC):
    """A problem made ready to be integrated by one method, at one distance after another."""

    name: ClassVar[str]

    def __init__(self, problem: Problem, settings: SolverSettings, harmonics: int, points: int | None = None) -> None:
        self.settings, self.harmonics = settings, harmonics
        self.points = points or sample_count(problem, settings)
        modes, count = len(problem.modes), len(problem.tones)
        self.memory_size = sum(force.memory for force in problem.forces)
        self.latch_count = sum(force.switch is not None for force in problem.forces)
        self.columns = measure.FIRST + 2 * count * (modes + 1) + 2 * harmonics + 2 * count
        width = kernel.size_of(problem) + self.memory_size + self.latch_count + 1
        self.samples = np.zeros((self.points + 1, width))
        self.work = np.zeros((8, max(self.memory_size, 1)))
        self.room = np.empty((measure.ROOM, self.points + 1))
        self.take(problem)

    def take(self, problem: Problem) -> None:
        """Go over to a problem with other numbers in the same modes, tones and forces; `place` has to follow."""
        self.problem = problem
        self.kernel, self.solvers = load_kernels(problem)  # a number may decide which law a force has
        self.scales = kernel.scales(problem)
        self.tones = kernel.tone_table(problem)
        self.kinks = kernel.kink_distances(problem)
        self.sizes = np.array([force.memory_scale for force in problem.forces for _ in range(force.memory)])
        self.p = kernel.parameters(problem, 0.0)
        self._tip = TipFunctions(self.kernel, problem)
        self._turns: lockin.Turns | None = None

    @property
    def turns(self) -> lockin.Turns:
        """The tones' turns over the samples of a period."""
        if self._turns is None:
            self._turns = lockin.turns_of(self.tones[:, 0], self.points, self.harmonics)
        return self._turns

    def place(self, zc: float) -> None:
        """Go to an average distance (m)."""
        self.p = (float(zc), *self.p[1:])

    def tip(self, *names: str) -> tuple[Any, ...]:
        """Return the tip equation at the distance as the solvers take it, which call these functions."""
        return self._tip.at(self.p, names)

    def phases(self, period: int) -> Array:
        """Return the tones' phases at the start of a period."""
        bases = np.empty(len(self.tones))
        self.kernel.entry("phases")(self.tones, period, bases)
        return bases

    def measure(self, period: int, row: Array) -> None:
        """Measure the period whose samples are kept, into a row."""
        drive = self.tones, self.phases(period), period, self.points
        tip = self.tip("measure_force")
        self.solvers.entry("measure")(self.samples, self.turns, drive, self.kinks, tip, self.room, row)

    def lock_in(self, motion: Motion, periods: int) -> tuple[Motion, Complexes]:
        """Advance; return the motion and the scaled complex amplitude at each tone, (periods, tones)."""
        out = np.empty((periods, 2 * len(self.problem.tones)))
        motion = self._march(motion, periods, False, out)
        return motion, out[:, ::2] + 1j * out[:, 1::2]

    def observe(self, motion: Motion, periods: int) -> tuple[Motion, Array]:
        """Advance; return the motion and all that is measured over each period, see ``observables``."""
        out = np.empty((periods, self.columns))
        return self._march(motion, periods, True, out), out

    def record(self, motion: Motion) -> tuple[Motion, Array]:
        """Advance one period; return the motion and its samples, both ends included."""
        motion = self._march(motion, 1, False, np.empty((1, 2 * len(self.problem.tones))))
        return motion, self.samples.copy()

    @abstractmethod
    def _march(self, motion: Motion, periods: int, every: bool, out: Array) -> Motion: ...


def with_amplitudes(integrator: Integrator, amplitudes: AnyArray) -> Motion:
    """Return the state at the start of a common period that deflects with these complex amplitudes (m), (tones, modes).

    The forces' memories are at rest. Motion without forces has the amplitudes `free` of a problem.
    """
    omega = kernel.TWO_PI * np.array([tone.frequency for tone in integrator.problem.tones])
    base = kernel.base_in_motion(integrator.problem, integrator.tones)[: 2 * amplitudes.shape[1]]
    speeds = 1j * omega[:, None] * amplitudes / integrator.scales.speed
    x = amplitudes.sum(0).real / integrator.scales.length + base[::2]
    v = (1j * omega[:, None] * amplitudes).sum(0).real / integrator.scales.speed + base[1::2]
    moved = 1j * integrator.tones[:, 0] * kernel.base_of(integrator.tones) * np.exp(1j * integrator.tones[:, 1])
    speeds[range(len(omega)), integrator.problem.own_modes] += moved
    late = kernel.steady_fluid_memory(np.array(integrator.p), integrator.problem, integrator.tones[:, 0], speeds)
    y = np.append(np.stack([x, v], axis=1), late)
    return Motion(tuple(y.tolist()), np.zeros(integrator.memory_size), np.zeros(integrator.latch_count), 0)


class RK4(Integrator):
    """Runge–Kutta with fixed steps, locked to the first tone."""

    name = "rk4"

    def take(self, problem: Problem) -> None:
        """Go over to a problem with other numbers in the same modes, tones and forces; `place` has to follow."""
        super().take(problem)
        if problem.late_fluid == 0:
            numbers = np.array(self.p)
            fit(numbers, self.tones, len(problem.modes), loops.TAU / self.points)
            self.p = tuple(numbers.tolist())

    def _march(self, motion: Motion, periods: int, every: bool, out: Array) -> Motion:
        memory, branch = motion.memory.copy(), motion.branch.copy()
        forces = memory, branch, self.kinks, self.work
        tip = self.tip("advance", "cut", *(["measure_force"] if every else []))
        y = self.solvers.entry("march_rk4")(
            motion.y, forces, motion.period, self.tones, self.turns, self.samples, tip, out
        )
        return Motion(y, memory, branch, motion.period + periods)


class Engine(Integrator):
    """Steps that fit the motion, in the frame of the free lever; they end on kinks, turns and changes of branches."""

    name = "engine"

    def take(self, problem: Problem) -> None:
        """Go over to a problem with other numbers in the same modes, tones and forces; `place` has to follow."""
        from dforce.engine.marching import Marcher  # loads the compiler

        super().take(problem)
        self._marcher = Marcher.of(problem)
        self._limits = (self.settings.relative_tolerance, math.inf, HARMONIC * self.settings.relative_tolerance)
        self._places = np.unique(np.append(self.kinks, problem.a0))

    def record(self, motion: Motion) -> tuple[Motion, Array]:
        """Advance one period; return the motion and its samples, both ends included."""
        found = self._marched(motion, 1, per_period=self.points, sampled=True)
        return self._end(found, motion.period + 1), np.concatenate([found.path[0], found.samples[0]], axis=1)

    def _march(self, motion: Motion, periods: int, every: bool, out: Array) -> Motion:
        found = self._marched(motion, periods, harmonics=self.harmonics if every else 0)
        if every:
            out[:] = found.rows[0]
        else:  # the lock-ins of the whole deflection
            modes, tones = len(self.problem.modes), len(self.tones)
            pairs = found.rows[0, :, measure.FIRST :].reshape(periods, -1, 2)
            out.reshape(periods, tones, 2)[:] = pairs[:, modes : tones * (modes + 1) : modes + 1]
        return self._end(found, motion.period + periods)

    def _marched(self, motion: Motion, periods: int, **wanted: Any) -> Marched:
        from dforce.engine.marching import Start

        p, x = np.array([self.p]), np.array([motion.y])
        start = Start(
            p, self.tones[None], self._places[None], x, motion.memory[None], motion.branch[None], motion.period
        )
        return self._marcher.march(start, periods, self._limits, **wanted)

    def _end(self, found: Marched, period: int) -> Motion:
        return Motion(tuple(found.path[0, -1].tolist()), found.memory[0], found.branch[0], period)


class LSODA(Integrator):
    """SciPy's LSODA over the compiled right-hand side."""

    name = "lsoda"

    def __init__(self, problem: Problem, settings: SolverSettings, harmonics: int, points: int | None = None) -> None:
        super().__init__(problem, settings, harmonics, points)
        self._flow: lsoda.Flow | None = None
        self._left: Motion | None = None  # the motion at the place of the flow
        self._first = 0  # the period in which it started

    def place(self, zc: float) -> None:
        """Go to an average distance (m)."""
        super().place(zc)
        self._left = None

    def _flow_from(self, motion: Motion) -> lsoda.Flow:
        """Return a flow at a motion: the last flow if it is there, so that results do not depend on the chunk size."""
        if self._flow is not None and motion is self._left:
            return self._flow
        latched, bases = motion.branch.copy(), self.phases(motion.period)
        fastest = max(1.0, *(mode.f0 / self.problem.tones[0].frequency for mode in self.problem.modes))
        self._first = motion.period
        return lsoda.Flow(
            self.kernel.entry("derivative"),
            self.kernel.entry("sample"),
            np.concatenate([motion.y, motion.memory]),
            (motion.period * loops.TAU, latched, self.tones, bases, self.p),
            self.settings.relative_tolerance,
            loops.TAU / STEPS_PER_PERIOD / fastest,
        )

    def _march(self, motion: Motion, periods: int, every: bool, out: Array) -> Motion:
        flow, lock_in = self._flow_from(motion), self.kernel.entry("lock_in")
        out.fill(np.nan)
        for row in range(periods):
            period = motion.period + row
            start = (period - self._first) * loops.TAU
            flow.sample(self.samples, 0)
            with warnings.catch_warnings(action="ignore"):  # SciPy's, of steps that fail: they end as NaN
                for i in range(1, self.points + 1):
                    flow.advance(start + i * loops.TAU / self.points, self.samples, i)
            if not np.isfinite(flow.state).all():
                break
            if every:
                self.measure(period, out[row])
            else:
                lock_in(self.samples, self.turns, self.phases(period), self.room[0], out[row])
        size = len(motion.y)
        y = tuple(map(float, flow.state[:size]))
        left = Motion(y, flow.state[size:].copy(), flow.latched.copy(), motion.period + periods)
        self._flow, self._left = flow, left
        return left


INTEGRATORS: dict[str, type[Integrator]] = {cls.name: cls for cls in (RK4, Engine, LSODA)}
