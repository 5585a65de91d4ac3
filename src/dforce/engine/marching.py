"""Motions marched over common periods side by side, and what is measured on the way, as arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from dforce.engine.advance import (
    D_MIN,
    F_MAX,
    F_MIN,
    FIRST_PAIR,
    SUM_F,
    SUM_V,
    SUM_Z,
    TAU,
    TOUCHED,
    V_MAX,
    Z_MAX,
    Z_MIN,
    Lanes,
    advance,
)
from dforce.engine.laws import Laws, laws_of
from dforce.kernel import Array, base_of, drive_of, stiffness_of
from dforce.kernel.codegen import FIRST_MODE, LENGTH, PER_MODE, parameter_count
from dforce.observables import measure
from dforce.problem import Problem

Complex = np.ndarray[Any, np.dtype[np.complex128]]


class Marched(NamedTuple):
    """Where motions end.

    Attributes
    ----------
    x, memory, branch
        Scaled motion, the forces' memory and their branches, a row for each motion.
    columns
        Derivatives of x by the motion at the start, and by the distance (per unit), (motions, size, size + 1), or none.
    rows
        What was measured over each period, (motions, periods, columns), see ``observables``, or none.
    """

    x: Array
    memory: Array
    branch: Array
    columns: Array
    rows: Array


@dataclass(frozen=True)
class Marcher:
    """Marches motions of problems with the modes, tones and forces of one.

    Attributes
    ----------
    example
        The problem.
    harmonics
        Harmonics of the first tone that are measured.
    periods
        Periods of the first tone in a common period.
    """

    example: Problem
    harmonics: int
    periods: int
    laws: Laws

    @classmethod
    def of(cls, example: Problem, harmonics: int, periods: int) -> Marcher:
        """Return the marcher of a problem; its laws are compiled or loaded."""
        return cls(example, harmonics, periods, laws_of(example.forces))

    def march(
        self,
        numbers: Array,
        tones: Array,
        kinks: Array,
        start: tuple[Array, Array, Array],
        tolerance: Array,
        repeats: int = 1,
        unit: Array | None = None,
        measured: bool = False,
    ) -> Marched:
        """March motions over so many common periods.

        Parameters
        ----------
        numbers, tones, kinks
            Parameters, tone tables and kinks (m) of each motion.
        start
            Scaled motion, memory and branches of each.
        tolerance
            Error of a step in the motion, in the columns and in the fastest harmonic, (motions, 3).
        unit
            Given: columns are wanted, and this is the unit of the distance (m), (motions,).
        """
        x, memory, branch = start
        count, size, periods = len(x), x.shape[1], self.periods * repeats
        modes = size // 2
        ratios, first = tones[:, :, 0], parameter_count(modes, 0)
        columns = 0 if unit is None else size + 1
        omega = np.repeat(ratios[:, :, None], modes, axis=2)
        free = drive_of(tones, modes) / stiffness_of(numbers[:, None], modes, 0, omega)
        base = base_of(tones)
        table = np.empty((count, ratios.shape[1], 3 + 2 * modes))
        table[:, :, 0], table[:, :, 1], table[:, :, 2] = ratios, base.real, base.imag
        table[:, :, 3::2], table[:, :, 4::2] = free.real, free.imag
        turns = np.arange(periods + 1)[:, None] * ratios[0]
        phases = tones[0, :, 1] + TAU * (turns - np.floor(turns))
        deviation = np.zeros((count, modes, 2, 1 + columns))
        deviation[..., 0] = (x - _motion(free, ratios, phases[0])).reshape(count, modes, 2)
        by = np.zeros((count, columns))
        if unit is not None:
            deviation[..., 1 : 1 + size] = np.eye(size).reshape(modes, 2, size)
            by[:, size] = unit
        pairs = np.concatenate([ratios[0], np.arange(2.0, self.harmonics + 1.0)]) if measured else np.empty(0)
        sums = np.empty((count, periods, FIRST_PAIR + 2 * len(pairs) if measured else 0))
        ends = np.empty((count, periods + 1, size))
        ends[:, 0] = deviation[..., 0].reshape(count, size)
        lanes = Lanes(
            np.ascontiguousarray(numbers), table, phases[:-1], np.ascontiguousarray(kinks), np.ascontiguousarray(tolerance), deviation,
            by, memory.copy(), branch.copy(), pairs, sums, ends[:, 1:].copy(), np.zeros((count, 2), np.int64),
        )  # fmt: skip
        advance(lanes, self.laws, first)
        ends[:, 1:] = lanes.ends
        after = deviation[..., 0].reshape(count, size) + _motion(free, ratios, phases[-1])
        rows = np.empty((count, periods, 0))
        if measured:
            rows = self._rows(numbers, free, ratios[0], phases, ends, pairs, sums)
        derivatives = deviation[..., 1:].reshape(count, size, columns)
        return Marched(after, lanes.memory, lanes.latched, derivatives, rows)

    def _rows(
        self, numbers: Array, free: Complex, ratios: Array, phases: Array, ends: Array, pairs: Array, sums: Array
    ) -> Array:
        """Return what ``observables`` reads, from the sums over each period.

        The Fourier sums of the deviation u of a mode follow from those of the force and its ends:
        (r^2 - w^2 + i w c) U = g F - [(v + (i w + c) u) exp(-i w t)] from start to end.
        """
        count, modes, tones = len(numbers), free.shape[2], len(ratios)
        lever = numbers[:, FIRST_MODE : FIRST_MODE + PER_MODE * modes].reshape(count, 1, modes, PER_MODE)
        stiff, drag, gain = lever[..., 0], lever[..., 1], lever[..., 2]
        force = sums[..., FIRST_PAIR::2] + 1j * sums[..., FIRST_PAIR + 1 :: 2]
        u, v = ends[..., ::2], ends[..., 1::2]

        def moved(w: float, push: Any, period: int) -> Complex:
            """Return the Fourier sum of each mode over one period at a frequency, (motions, modes)."""
            turn = np.exp(-1j * w * TAU)
            edge = (v[:, period + 1] + (1j * w + drag[:, 0]) * u[:, period + 1]) * turn
            edge = edge - v[:, period] - (1j * w + drag[:, 0]) * u[:, period]
            of_force = (gain[:, 0] * push[:, None] - edge) / (stiff[:, 0] - w * w + 1j * w * drag[:, 0])
            for j, ratio in enumerate(ratios):
                swing = free[:, j] * np.exp(1j * phases[period, j])
                of_force = of_force + 0.5 * swing * _window(ratio - w) + 0.5 * swing.conj() * _window(-ratio - w)
            return np.asarray(of_force)

        width = measure.FIRST + 2 * tones * (modes + 1) + 2 * self.harmonics + 2 * tones
        rows = np.empty((count, sums.shape[1], width))
        for period in range(sums.shape[1]):
            out, given = rows[:, period], sums[:, period]
            found: list[Complex] = []
            for j, ratio in enumerate(ratios):
                of_modes = moved(float(ratio), force[:, period, j], period) * np.exp(-1j * phases[period, j])
                found += [*of_modes.T, of_modes.sum(axis=1)]
            for k in range(1, self.harmonics + 1):
                push = force[:, period, 0 if k == 1 else tones + k - 2]
                found.append(moved(float(k), push, period).sum(axis=1) * np.exp(-1j * k * phases[period, 0]))
            found += [force[:, period, j] * np.exp(-1j * phases[period, j]) for j in range(tones)]
            pairs_of = np.stack(found, axis=1) * (2.0 / TAU)
            out[:, measure.FIRST :: 2], out[:, measure.FIRST + 1 :: 2] = pairs_of.real, pairs_of.imag
            out[:, measure.Z] = moved(0.0, given[:, SUM_F], period).sum(axis=1).real / TAU
            for place, sum_of in ((measure.F, SUM_F), (measure.F_Z, SUM_Z), (measure.F_V, SUM_V), (measure.CONTACT, TOUCHED)):
                out[:, place] = given[:, sum_of] / TAU
            for place, extreme in (
                (measure.Z_MIN, Z_MIN), (measure.Z_MAX, Z_MAX), (measure.F_MIN, F_MIN), (measure.F_MAX, F_MAX),
                (measure.D_MIN, D_MIN), (measure.V_MAX, V_MAX),
            ):  # fmt: skip
                out[:, place] = given[:, extreme]
        return rows


def _motion(free: Complex, ratios: Array, phases: Array) -> Array:
    """Return the scaled free motion at phases of the tones, (motions, size)."""
    turned = free * np.exp(1j * phases)[:, None]
    x, v = turned.sum(axis=1).real, (1j * ratios[:, :, None] * turned).sum(axis=1).real
    return np.stack([x, v], axis=2).reshape(len(free), -1)


def _window(a: float) -> complex:
    """Return the integral of exp(i a t) over a period of the first tone."""
    if abs(a) < 1e-12:
        return TAU
    return complex(math.sin(a * TAU) / a, (1.0 - math.cos(a * TAU)) / a)
