"""Motions marched side by side over whole periods or parts of one, and the measurements on the way, as arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from dforce.core.arrays import Array, Complexes
from dforce.engine.lanes import FIRST_PAIR, SUM_F, Lanes
from dforce.engine.laws import Laws, entry, laws_of
from dforce.engine.parts import Parts, parts_of
from dforce.kernel import base_of, drive_of, fluid_amplitudes, stiffness_of
from dforce.kernel.codegen import FIRST_MODE, OMEGA, parameter_count
from dforce.observables import measure
from dforce.problem import Problem

TAU = 2.0 * math.pi
ENGINE = "tableau", "laws", "lanes", "step", "events", "sums", "advance"  # files of its compiled code
RESOLVED = 2.0  # of the shortest relaxation time: longest step


class Start(NamedTuple):
    """Where motions start.

    Attributes
    ----------
    numbers, tones, kinks
        The kernel's parameters and tone tables, and the distances (m) where a law is not smooth, a row for each motion.
    x, memory, branch
        Scaled motion, the forces' memory and their branches.
    period
        Periods of the first tone that are over.
    """

    numbers: Array
    tones: Array
    kinks: Array
    x: Array
    memory: Array
    branch: Array
    period: int = 0


class Marched(NamedTuple):
    """The ends of motions, and the measurements on the way.

    Attributes
    ----------
    path
        Scaled motion at the start and at the end of each interval, (motions, intervals + 1, size).
    memory, branch
        The forces' memory and branches at the end, a row for each motion.
    columns
        Derivatives of the end by the motion at the start and by the distance (per unit), (motions, size, size + 1), or none.
    rows
        The measurements over each interval, (motions, intervals, columns), see ``observables``, or none.
    samples
        Memory, branches and force (N) at the same times as `path`, or none.
    """

    path: Array
    memory: Array
    branch: Array
    columns: Array
    rows: Array
    samples: Array


@dataclass(frozen=True)
class Marcher:
    """Marches motions of problems with the modes, tones and forces of one.

    Attributes
    ----------
    example
        The problem.
    laws
        Its forces' laws, compiled.
    """

    example: Problem
    laws: Laws

    @classmethod
    def of(cls, example: Problem) -> Self:
        """Return the marcher of a problem; its laws are compiled or loaded."""
        return cls(example, laws_of(example.forces))

    def march(
        self,
        start: Start,
        periods: int,
        limits: tuple[float, float, float] | Array,
        *,
        harmonics: int | None = None,
        per_period: int = 1,
        sampled: bool = False,
        unit: Array | None = None,
    ) -> Marched:
        """March motions over so many periods of the first tone.

        Parameters
        ----------
        limits
            Errors allowed in a step: of the scaled motion, of the columns, and of the fastest harmonic; or a row of them for
            each motion.
        harmonics
            Given: each period is measured, with so many harmonics; not for parts of a period.
        per_period
            Intervals in a period.
        sampled
            Whether the forces' memory, their branches and the force are wanted at the ends of the intervals.
        unit
            Given: columns are wanted, and this is the unit of the distance (m), (motions,).
        """
        count, size = start.x.shape
        example, intervals, ratios = self.example, periods * per_period, start.tones[0, :, 0]
        modes, late = len(example.modes), example.late_fluid
        omega = np.broadcast_to(ratios[:, None], (count, len(ratios), modes))
        free = drive_of(start.tones, modes) / stiffness_of(start.numbers[:, None], modes, late, omega)
        tip, base, part_of = free.sum(axis=2), base_of(start.tones), parts_of(start.numbers, modes, late)
        table = np.empty((*tip.shape, 5))
        for k, column in enumerate((ratios, tip.real, tip.imag, base.real, base.imag)):
            table[..., k] = column
        fluid = fluid_amplitudes(start.numbers, example, ratios, 1j * omega * free)
        whole, part = np.divmod(np.arange(intervals + 1), per_period)
        turns = np.outer(start.period + whole, ratios)
        phases = start.tones[0, :, 1] + TAU * (turns - np.floor(turns)) + TAU / per_period * np.outer(part, ratios)
        still = _motion(free, fluid, ratios, phases)
        path: Array = np.full(still.shape, np.nan)
        path[:, 0] = start.x
        columns = 0 if unit is None else size + 1
        deviation = np.zeros((count, part_of.numbers.shape[1], 2, 1 + columns))
        by = np.zeros((count, columns))
        if unit is not None:
            deviation[..., 1 : 1 + size], by[:, size] = part_of.split.reshape(*deviation.shape[:3], size), unit
        pairs = np.empty(0) if harmonics is None else np.append(ratios, np.arange(2.0, harmonics + 1.0))
        states, latches = start.memory.shape[1], start.branch.shape[1]
        lanes = Lanes(
            np.concatenate([start.numbers[:, :FIRST_MODE], start.numbers[:, parameter_count(modes, late) :]], axis=1),
            *part_of,
            table,
            TAU / per_period,
            TAU * (start.period + whole[:-1] + part[:-1] / per_period),
            np.ascontiguousarray(phases[:-1]),
            np.ascontiguousarray(start.kinks),
            self._limits(start.numbers, limits),
            deviation,
            by,
            start.memory.copy(),
            np.array([force.memory_scale for force in self.example.forces for _ in range(force.memory)]),
            start.branch.copy(),
            pairs,
            np.empty((count, intervals, 0 if harmonics is None else FIRST_PAIR + 2 * len(pairs))),
            still,
            path,
            np.empty((count, intervals + 1 if sampled else 0, states + latches + 1 if sampled else 0)),
        )
        entry("advance", "the engine", ENGINE)(lanes, self.laws)
        rows = np.empty((count, intervals, 0))
        if harmonics is not None:
            rows = measured(part_of, free, ratios, phases, path - still, harmonics, lanes.sums)
        derived = part_of.join @ deviation[..., 1:].reshape(count, part_of.join.shape[2], columns)
        return Marched(path, lanes.memory, lanes.latched, derived, rows, lanes.samples)

    def _limits(self, numbers: Array, limits: tuple[float, float, float] | Array) -> Array:
        """Return the limits of a step of each motion; the fastest relaxation of a memory limits its length."""
        fastest = max((force.fastest_rate for force in self.example.forces), default=0.0)
        out = np.full((len(numbers), 4), np.inf)
        out[:, :3] = limits
        if fastest > 0.0:
            out[:, 3] = RESOLVED * numbers[:, OMEGA] / fastest
        return out


def measured(
    parts: Parts, free: Complexes, ratios: Array, phases: Array, ends: Array, harmonics: int, sums: Array
) -> Array:
    """Return the rows of each period for ``observables``, from the sums over it.

    The Fourier sums U of the deviation u of a part follow from the force's sums F and from its ends, with c = 2 eta:
    (K - w^2 + i w c) U = (g + (i w + c) b) F - [(v + (i w + c) u) exp(-i w t)] from start to end.
    """
    modes, tones, orders = free.shape[2], len(ratios), np.arange(1.0, harmonics + 1.0)
    eta, _, stiff, gain, lift = np.moveaxis(parts.numbers[:, None, None], 4, 0)
    ends = ends @ np.swapaxes(parts.split, 1, 2)
    force = sums[..., FIRST_PAIR::2] + 1j * sums[..., FIRST_PAIR + 1 :: 2]
    u, v, turned = ends[:, :, None, ::2], ends[:, :, None, 1::2], np.exp(1j * phases[:-1])
    # at the tones, at the harmonics, and the mean
    w = np.concatenate([ratios, orders, [0.0]])[:, None]
    of_pairs = [*range(tones), 0, *range(tones, force.shape[2])][: tones + harmonics]
    push = np.concatenate([force[..., of_pairs], sums[..., SUM_F, None]], axis=2)
    turn = 1j * w + 2.0 * eta
    edge = v + turn * u
    edge = edge[:, 1:] * np.exp(-1j * w * TAU) - edge[:, :-1]
    moved = ((gain + turn * lift) * push[..., None] - edge) / (stiff - w * w + 2j * w * eta)
    moved = moved.reshape(*moved.shape[:3], modes, -1).sum(axis=4)
    for j, ratio in enumerate(ratios):
        swing = 0.5 * free[:, None, None, j] * turned[:, j, None, None]
        moved += swing * _window(ratio - w) + swing.conj() * _window(-ratio - w)
    total = moved.sum(axis=3)
    at_tones = np.concatenate([moved, total[..., None]], axis=3)[:, :, :tones] / turned[:, :, None]
    at_harmonics = total[:, :, tones:-1] / turned[:, :1] ** orders
    at_tones, of_force = at_tones.reshape(*total.shape[:2], -1), force[..., :tones] / turned
    pairs = np.concatenate([at_tones, at_harmonics, of_force], axis=2) * (2.0 / TAU)
    rows = np.empty((*sums.shape[:2], measure.FIRST + 2 * pairs.shape[2]))
    rows[..., measure.FIRST :: 2], rows[..., measure.FIRST + 1 :: 2] = pairs.real, pairs.imag
    rows[..., measure.Z] = total[:, :, -1].real / TAU
    rows[..., measure.F : measure.FIRST] = sums[..., :FIRST_PAIR]  # in the same order
    rows[..., measure.F : measure.Z_MIN] /= TAU  # the means; behind them are extremes
    return rows


def _motion(free: Complexes, fluid: Complexes, ratios: Array, phases: Array) -> Array:
    """Return the scaled free motion at phases of the tones, (motions, instants, size)."""
    lever = np.stack([free, 1j * ratios[:, None] * free], axis=3).reshape(*free.shape[:2], -1)
    amplitudes = np.concatenate([lever, fluid], axis=2)[:, None]
    return np.asarray((amplitudes * np.exp(1j * phases)[:, :, None]).sum(axis=2).real)


def _window(a: Array) -> Complexes:
    """Return the integral of exp(i a t) over a period of the first tone."""
    turn = 1j * np.where(np.abs(a) < 1e-12, 1e-12, a)
    return np.asarray(np.expm1(TAU * turn) / turn)
