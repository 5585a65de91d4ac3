"""The tip equations of problems that differ in numbers only, along a parameter: the average distance or the frequency."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Indices
from dforce.core.lazy import lazy_property
from dforce.kernel.codegen import FIRST_DRIVE, FIRST_MODE, OMEGA, PER_MODE, SPEED, parameter_count
from dforce.observables import measure
from dforce.observables.averaging import common_period
from dforce.observables.lockin import turns_of
from dforce.problem import Problem
from dforce.solvers.compiled import TipFunctions, load_kernels
from dforce.solvers.model import DISTANCE, FREQUENCY, Model, SharedDrive, retune
from dforce.solvers.problem_batch import Levers, ProblemBatch


class TipEquations:
    """The tip equations of a batch of problems with the same samples per period, phases and ratios of the tones.

    Parameters
    ----------
    batch
        The problems' numbers.
    problem
        Gives one problem by its number and the value of the parameter.
    zc
        Average distances (m), (problems,), where the frequency is varied; left out: the distance is varied.
    """

    def __init__(
        self,
        batch: ProblemBatch,
        problem: Callable[[int, float], tuple[Problem, float]],
        harmonics: int,
        points: int,
        zc: Array | None = None,
    ) -> None:
        example = batch.example
        self.batch, self.problem, self.harmonics, self.points = batch, problem, harmonics, points
        self.parameter = DISTANCE if zc is None else FREQUENCY
        self.frequencies = [tone.frequency for tone in example.tones]
        self.common = common_period(self.frequencies) or 1
        self.modes, self.late, self.size = len(example.modes), example.late_fluid, kernel.size_of(example)
        self.memory_scale = np.array([force.memory_scale for force in example.forces for _ in range(force.memory)])
        self.hysteresis = sum(force.switch is not None for force in example.forces)
        self.columns = measure.FIRST + 2 * len(example.tones) * (len(example.modes) + 2) + 2 * harmonics
        self.numbers, self.unit, self.reference = batch.numbers.copy(), batch.length, 1.0 / batch.period
        self.responses = np.empty((len(batch), len(example.tones), 0))
        if zc is not None:
            self.numbers[:, 0] = zc
            self.responses = np.repeat(kernel.responses(example)[None], len(batch), axis=0)
            self.unit = self.reference / np.array([max(mode.Q for mode in example.modes)])
        own, self._solvers = load_kernels(example)
        self._tip = TipFunctions(own, example)
        self._drives: dict[int, SharedDrive] = {}

    @property
    def is_smooth(self) -> bool:
        """Whether the force is a function of the motion: then motions march side by side."""
        return len(self.memory_scale) == 0 and self.hysteresis == 0

    @functools.cached_property
    def gain(self) -> Array:
        """How far from rest each number of the memory is, in changes over a common period, (problems, states)."""
        out = np.ones((len(self.batch), len(self.memory_scale)))
        for case in range(len(out) if out.size else 0):
            problem, _ = self.problem(case, math.inf if self.parameter == DISTANCE else float(self.reference[case]))
            rates = [np.resize(force.rates or math.inf, force.memory) for force in problem.forces if force.memory]
            out[case] = -1.0 / np.expm1(-self.common * self.batch.period[case] * np.concatenate(rates))
        return out

    @functools.cached_property
    def elements(self) -> Indices:
        """Where the memory of each element of the sample begins, and the end of the last."""
        forces = [force for force in self.batch.example.forces if force.memory]
        sizes = [len(force.rates) or force.memory for force in forces]
        counts = [force.memory // size for force, size in zip(forces, sizes, strict=True)]
        return np.cumsum([0, *np.repeat(sizes, counts)])

    def drive(self, repeats: int) -> SharedDrive:
        """Return the drive over `repeats` common periods."""
        if repeats not in self._drives:
            self._drives[repeats] = self._new_drive(repeats)
        return self._drives[repeats]

    def _new_drive(self, repeats: int) -> SharedDrive:
        tones, periods = self.batch.tones[0], self.common * repeats
        turns = np.arange(periods)[:, None] * tones[:, 0]
        phases = tones[:, 1] + 2.0 * math.pi * (turns - np.floor(turns))
        angles = math.pi / self.points * np.arange(2 * self.points + 1) * tones[:, :1]
        angles = phases[:, :, None] + angles
        waves = np.stack([np.cos(angles), -np.sin(angles)], axis=2).reshape(periods, 2 * len(tones), -1)
        turns = turns_of(tones[:, 0], self.points, self.harmonics)
        return SharedDrive(phases, waves, turns, self.points, periods)

    def tables(self, values: Array) -> tuple[Array, Array]:
        """Return the kernel's parameters and tone tables at each value of each problem, (problems values, ...)."""
        return self.tables_of(np.repeat(np.arange(len(values)), values.shape[1]), values.ravel())

    def tables_of(self, which: Indices, values: Array) -> tuple[Array, Array]:
        """Return the kernel's parameters and tone tables of problems at values of the parameter, one for each."""
        numbers = self.numbers[which]
        if self.parameter == FREQUENCY:  # as `place_column` does
            ratio = (values / self.reference[which])[:, None]
            numbers[:, [SPEED, OMEGA]] *= ratio
            for n in range(self.modes):
                first = FIRST_MODE + PER_MODE * n
                numbers[:, first : first + PER_MODE] /= ratio ** np.array([2, 1, 2])
            numbers[:, FIRST_MODE + PER_MODE * self.modes : parameter_count(self.modes, self.late)] /= ratio
        elif self.batch.levers is not None:
            modes, tones = self.batch.levers.at(which, values)
            numbers[:, FIRST_MODE : FIRST_MODE + modes.shape[1]] = modes
            return numbers, tones
        return numbers, self._tones_at(which, values)

    def _tones_at(self, which: Indices, values: Array) -> Array:
        """Return the tone tables of problems at values of the parameter, one for each."""
        tones = self.batch.tones[which]
        if self.batch.levers is not None:
            return self.batch.levers.at(which, values)[1]
        if self.parameter == FREQUENCY:
            ratio = values / self.reference[which]
            if self.batch.example.shaken is None:
                tones[:, :, FIRST_DRIVE : FIRST_DRIVE + 2 * self.modes] /= (ratio * ratio)[:, None, None]
                return tones
            for rows, responses, g in zip(tones, self.responses[which], ratio, strict=True):
                for row, response in zip(rows, responses, strict=True):
                    retune(row, response, self.modes, g)
        return tones

    @functools.cached_property
    def _levers(self) -> Levers:
        """The levers that change with their height; for constant levers a lever without distances."""
        count, tones = len(self.batch), self.batch.tones.shape[1:]
        nowhere = Levers(np.zeros(count, np.int64), np.empty((1, 0)), np.empty((1, 0, 0)), np.empty((1, 0, *tones)))
        return self.batch.levers or nowhere

    def base_of(self, which: Any, values: Array) -> Array:
        """Return the base's part of each number of scaled motions, for problems at values of the parameter."""
        if self.batch.example.shaken is None:
            return np.zeros((*np.broadcast(which, values).shape, self.size))
        which, values = np.broadcast_arrays(which, values)
        tones = self._tones_at(which.ravel(), values.ravel())
        return kernel.base_in_motion(self.batch.example, tones).reshape(*values.shape, self.size)

    def scales_of(self, which: Any, values: Array) -> Array:
        """Return the unit (m, m/s) of each number of a motion, for problems at values of the parameter."""
        length, omega = self.batch.length[which], 2.0 * math.pi * self.reference[which]
        if self.parameter == FREQUENCY:
            omega = 2.0 * math.pi * values
        return kernel.units_of(self.batch.example, *np.broadcast_arrays(length, length * omega))

    @lazy_property
    def _compiled(self) -> tuple[Array, tuple[Any, ...]]:
        """The numbers of all problems, and the tip equation of one, as the compiled solvers take them."""
        names = [*(["advance_lanes", "cut_lanes"] if self.is_smooth else ["advance", "cut"]), "measure_force"]
        tip = self._tip.at(kernel.parameters(self.batch.example, 0.0), names)
        return self._tip.numbers(self.numbers), tip

    def model(self, which: Indices) -> Model:
        """Return the tip equations of some problems as the compiled solvers take them."""
        (numbers, tip), levers = self._compiled, self._levers
        return Model(
            numbers.take(which, 1),
            self.batch.kinks.T.take(which, 1),
            self.batch.tones.take(which, 0),
            self.responses.take(which, 0),
            self.parameter,
            self.unit.take(which),
            self.reference.take(which),
            levers.which.take(which),
            levers.zc,
            levers.modes,
            levers.tones,
            self.memory_scale,
            self.gain.take(which, 0),
            self.elements,
            self.hysteresis,
            tip,
        )
