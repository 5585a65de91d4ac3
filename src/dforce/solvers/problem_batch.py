"""Many problems that differ in numbers only, as arrays, to be solved side by side."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Indices
from dforce.kernel.codegen import FIRST_MODE, LENGTH, OMEGA, PER_MODE
from dforce.problem import Problem
from dforce.solvers import SolverSettings
from dforce.solvers.integrator import LEAST_SAMPLES, enough_samples


def has_own_samples(problem: Problem, settings: SolverSettings) -> bool:
    """Return whether :meth:`ProblemBatch.samples` suffices for the number of samples of such problems."""
    return (
        len(problem.tones) == 1
        and problem.heights is None
        and settings.integrator == "rk4"
        and not any(force.memory for force in problem.forces)
        and not problem.late_fluid
    )


@dataclass(frozen=True)
class Levers:
    """Levers that change with their height, as tables over some distances.

    Attributes
    ----------
    which
        The lever of each problem, (problems,).
    zc
        The distances (m), which rise, (levers, heights).
    modes
        The kernel's parameters of the modes there, (levers, heights, 3 modes).
    tones
        The kernel's tone tables there, (levers, heights, tones, columns).
    """

    which: Indices
    zc: Array
    modes: Array
    tones: Array

    @classmethod
    def of(cls, problems: Sequence[Problem]) -> Levers | None:
        """Return the levers of problems, each once; None for constant levers."""
        several: dict[int, Problem] = {}
        for problem in problems:
            several.setdefault(id(problem.heights), problem)
        rows: list[tuple[Any, Any, Any]] = []
        for problem in several.values():
            if problem.heights is None:
                return None
            there = [problem.at_height(zc) for zc in problem.heights.zc]
            modes = [kernel.parameters(one, 0.0)[FIRST_MODE : FIRST_MODE + PER_MODE * len(one.modes)] for one in there]
            rows.append((problem.heights.zc, modes, [kernel.tone_table(one) for one in there]))
        places = {which: place for place, which in enumerate(several)}
        return cls(
            np.array([places[id(problem.heights)] for problem in problems]),
            *(np.array(column) for column in zip(*rows, strict=True)),
        )

    def take(self, which: Any) -> Levers:
        """Return the levers of some problems, by their numbers."""
        return dataclasses.replace(self, which=self.which[which])

    def at(self, which: Any, zc: Array) -> tuple[Array, Array]:
        """Return the parameters of the modes and the tone tables of problems at distances (m), one for each."""
        lever = self.which[which]
        place = np.empty(len(lever), dtype=np.int64)
        for one in np.unique(lever):
            place[lever == one] = np.searchsorted(self.zc[one], zc[lever == one], "right") - 1
        place = np.clip(place, 0, self.zc.shape[1] - 2)
        low, high = self.zc[lever, place], self.zc[lever, place + 1]
        share = np.clip((zc - low) / (high - low), 0.0, 1.0)
        a, b = share[:, None], share[:, None, None]
        modes = (1.0 - a) * self.modes[lever, place] + a * self.modes[lever, place + 1]
        return modes, (1.0 - b) * self.tones[lever, place] + b * self.tones[lever, place + 1]


@dataclass(frozen=True)
class ProblemBatch:
    """Problems with the same modes, tones and force models, one row each.

    Attributes
    ----------
    example
        One of them; only its common properties count.
    numbers
        The kernel's parameters, with 0 in the place of zc, shape (problems, parameters).
    tones
        The kernel's tone tables, shape (problems, tones, columns).
    kinks
        Distances (m) at which the forces are not smooth, shape (problems, kinks).
    levers
        The levers that change with their height, whose numbers hold far away; None for constant levers.
    """

    example: Problem
    numbers: Array
    tones: Array
    kinks: Array
    levers: Levers | None = None

    @classmethod
    def of(cls, problems: Sequence[Problem]) -> ProblemBatch:
        """Return problems as a batch."""
        far = [problem.at_height(math.inf) for problem in problems]
        for problem in problems:
            problem.refuse_lock("this")
        return cls(
            far[0],
            np.array([kernel.parameters(problem, 0.0) for problem in far]),
            np.array([kernel.tone_table(problem) for problem in far]),
            np.array([kernel.kink_distances(problem) for problem in far]),
            Levers.of(problems),
        )

    def take(self, which: Any) -> ProblemBatch:
        """Return some of the problems, by their numbers."""
        levers = None if self.levers is None else self.levers.take(which)
        return ProblemBatch(self.example, self.numbers[which], self.tones[which], self.kinks[which], levers)

    def at_heights(self, zc: Array) -> ProblemBatch:
        """Return the problems with their levers as they are at distances (m), one for each."""
        if self.levers is None:
            return self
        numbers = self.numbers.copy()
        modes, tones = self.levers.at(np.arange(len(self)), zc)
        numbers[:, FIRST_MODE : FIRST_MODE + modes.shape[1]] = modes
        return dataclasses.replace(self, numbers=numbers, tones=tones, levers=None)

    def __len__(self) -> int:
        return len(self.numbers)

    @property
    def length(self) -> Array:
        """Units of length (m): the free amplitudes."""
        return self.numbers[:, LENGTH]

    @property
    def period(self) -> Array:
        """Periods of the drive (s)."""
        return np.asarray(2.0 * math.pi / self.numbers[:, OMEGA])

    @functools.cached_property
    def decay(self) -> Indices:
        """Decay times of the slowest mode, in periods of the drive."""
        own = np.sqrt(self._modes[:, :, 0])
        drag = kernel.stiffness_of(self.numbers, own.shape[1], self.example.late_fluid, own).imag / own
        slowest = drag.min(1)  # ratio / Q
        return np.asarray(np.maximum(1, np.ceil(1.0 / (math.pi * slowest))), dtype=np.int64)

    def samples(self, settings: SolverSettings) -> Indices:
        """Return the samples per period of each, as :func:`dforce.solvers.integrator.sample_count` does."""
        fastest = np.sqrt(self._modes[:, :, 0].max(axis=1))
        return np.asarray(enough_samples(LEAST_SAMPLES * np.maximum(fastest, 1.0), settings))

    def moving(self, mode: int, amplitude: float, phase: float) -> Array:
        """Return scaled motions at the start of a period: a mode deflects by an amplitude (m) with a phase lag (rad)."""
        out = kernel.base_in_motion(self.example, self.tones)
        turn = (amplitude / self.length) * np.exp(1j * (self.tones[:, 0, 1] - phase))
        out[:, 2 * mode] += turn.real
        out[:, 2 * mode + 1] -= turn.imag
        return self._with_fluid(out)

    def free(self) -> Array:
        """Return the scaled motions without tip–sample forces at the start of a period."""
        modes = len(self.example.modes)
        drive = kernel.drive_of(self.tones[:, 0], modes) * np.exp(1j * self.tones[:, :1, 1])
        motion = drive / kernel.stiffness_of(self.numbers, modes, self.example.late_fluid, np.ones(drive.shape))
        moves = np.stack([motion.real, -motion.imag], axis=2).reshape(len(self), -1)
        room = np.zeros((len(self), kernel.size_of(self.example) - moves.shape[1]))
        return self._with_fluid(np.concatenate([moves, room], axis=1))

    def _with_fluid(self, motions: Array) -> Array:
        """Return motions at the first tone's frequency with the fluid as it follows them."""
        count = 2 * len(self.example.modes)
        speeds = motions[:, 1:count:2] + 1j * motions[:, :count:2]
        behind = kernel.steady_fluid_memory(self.numbers, self.example, np.ones((len(self), 1)), speeds[:, None])
        return np.concatenate([motions[:, :count], behind], axis=1)

    @property
    def _modes(self) -> Array:
        """Stiffness, damping and gain of each mode, (problems, modes, 3)."""
        return kernel.modes_of(self.numbers, len(self.example.modes))
