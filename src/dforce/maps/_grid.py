"""The problems of a sweep as arrays for the solvers, without building a case for each problem.

A problem has pieces: the modes, the tones, the contact, each force. Each piece depends on few swept parameters. It is
computed only for the combinations of these, by the same code as for a single case, and all problems are put together by
indexing.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from dforce.case import Case
from dforce.case.paths import with_number
from dforce.core.arrays import Array, stacked
from dforce.core.errors import DForceError, ParameterError
from dforce.forces import Force
from dforce.kernel import TWO_PI
from dforce.kernel.codegen import FIRST_DRIVE
from dforce.maps.axes import Axis, dims_of
from dforce.problem import Problem
from dforce.solvers.blocks import composition_of
from dforce.solvers.problem_batch import ProblemBatch

MODES, TONES, CONTACT = "modes", "tones", "contact"
LAW, KINKS = FORCE_PARTS = ("law", "kinks")
NOWHERE = -1.0  # m; a distance that no tip reaches fills up the kinks of a force that has fewer than others


class ProblemGrid:
    """All problems of a grid of numbers, numbered in the order of the dimensions, the last one fastest.

    Parameters
    ----------
    case, axes
        The case and the varied parameters; axes of one dimension vary together.

    Attributes
    ----------
    example
        The first problem.
    alike
        Whether all have the same laws, so that one kernel solves them.
    """

    def __init__(self, case: Case, axes: Sequence[Axis]) -> None:
        self.case, self.axes = case, list(axes)
        dims = dims_of(axes)
        self.shape = tuple(dims.values())
        self.size = math.prod(self.shape)
        self._along = [list(dims).index(axis.dim) for axis in axes]
        self.example = self.problem(0)
        self.alike = True
        self.pieces: dict[str, tuple[list[int], Array]] = {}
        self._fill()

    def problem(self, number: int) -> Problem:
        """Return one problem."""
        return self._problem(np.unravel_index(number, self.shape) if self.shape else ())

    def _problem(self, place: Sequence[Any]) -> Problem:
        case = self.case
        for axis, value in self._values(place):
            case = with_number(case, axis.path, value)
        try:
            return Problem.build(case.instrument, case.forces)
        except DForceError as error:
            where = ", ".join(f"{axis.path} = {value:g}" for axis, value in self._values(place))
            raise ParameterError(f"at {where}: {error}") from None

    def _values(self, place: Sequence[Any]) -> list[tuple[Axis, Any]]:
        """Return the value of each axis at a place in the grid."""
        return [(axis, axis.values[place[dim]]) for axis, dim in zip(self.axes, self._along, strict=True)]

    def _fill(self) -> None:
        """Compute each piece for all combinations of the parameters that it depends on."""
        wanted = {
            MODES: self._axes_of("cantilever", "medium"),
            TONES: self._axes_of("cantilever", "medium", "drive"),
            CONTACT: self._axes_of("contact"),
        }
        for place, force in zip(self.example.places, self.example.forces, strict=True):
            for part in FORCE_PARTS:
                wanted[f"{part} {place}"] = self._axes_of_force(place, force)
        together: dict[tuple[int, ...], list[str]] = {}
        for name, axes in wanted.items():
            together.setdefault(tuple(axes), []).append(name)
        for of_piece, names in together.items():
            rows: dict[str, list[Any]] = {name: [] for name in names}
            for index in itertools.product(*(range(self.shape[i]) for i in of_piece)):
                where = [0] * len(self.shape)
                for i, value in zip(of_piece, index, strict=True):
                    where[i] = value
                problem = self._problem(where)
                self.alike = self.alike and composition_of(problem) == composition_of(self.example)
                for name in names:
                    rows[name].append(_piece(problem, name))
            for name in names:
                table = stacked([np.array(row, dtype=float) for row in rows[name]], NOWHERE)
                shape = tuple(self.shape[i] for i in of_piece)
                self.pieces[name] = (list(of_piece), table.reshape(*shape, table.shape[1]))

    def _axes_of(self, *sections: str) -> list[int]:
        return self._dims([axis.path.split(".")[0] in sections for axis in self.axes])

    def _dims(self, chosen: Sequence[bool]) -> list[int]:
        """Return the dimensions of the axes that are chosen."""
        return sorted({dim for dim, one in zip(self._along, chosen, strict=True) if one})

    def _axes_of_force(self, place: int, force: Force) -> list[int]:
        """Return the dimensions that a force depends on; `place` is its place in the case."""
        names = {str(place + 1), force.name}
        needed = set(force.shared_fields().values())
        if "contact.E_eff" in needed:
            needed |= {f"{part}.{name}" for part in ("tip", "sample") for name in ("youngs_modulus", "poisson_ratio")}
        sections = [path.split(".")[0] for path in needed]
        found = []
        for axis in self.axes:
            section, *rest = axis.path.split(".")
            own = section == "forces" and rest[0] in names
            lever = section in ("cantilever", "medium") and ("cantilever" in sections or "medium" in sections)
            found.append(own or lever or axis.path in needed)
        return self._dims(found)

    def batch(self, numbers: Any) -> ProblemBatch:
        """Return some of the problems, by their numbers, as arrays."""
        numbers = np.asarray(numbers)
        place = np.unravel_index(numbers, self.shape) if self.shape else ()

        def piece(name: str) -> Array:
            axes, table = self.pieces[name]
            if not axes:
                return np.broadcast_to(table, (len(numbers), table.shape[-1]))
            return np.asarray(table[tuple(place[axis] for axis in axes)])

        example = self.example
        count = len(example.modes)
        modes = piece(MODES)[:, : 3 * count].reshape(len(numbers), -1, 3)
        tones = piece(TONES).reshape(len(numbers), len(example.tones), -1)
        f0, k, Q = modes[:, :, 0], modes[:, :, 1], modes[:, :, 2]
        length, omega = tones[:, 0, 2], TWO_PI * tones[:, 0, 0]
        ratio = TWO_PI * f0 / omega[:, None]
        per_mode = np.stack([ratio**2, ratio / Q, ratio**2 / (k * length[:, None])], axis=2)
        first = np.stack([np.zeros(len(numbers)), length, length * omega, omega, piece(CONTACT)[:, 0]], axis=1)
        laws, kinks = ([piece(f"{part} {place}") for place in example.places] for part in FORCE_PARTS)
        fluid = piece(MODES)[:, 3 * count :] / omega[:, None]
        table = np.zeros((len(numbers), len(example.tones), FIRST_DRIVE + 2 * count + 3))
        drive = tones[:, :, 6:].reshape(len(numbers), -1, count, 2)
        table[:, :, 0], table[:, :, 1] = TWO_PI * tones[:, :, 0] / omega[:, None], tones[:, :, 1]
        scaled = (ratio**2)[:, None, :, None] * drive / (k * length[:, None])[:, None, :, None]
        table[:, :, FIRST_DRIVE:-3] = np.moveaxis(scaled, 3, 2).reshape(len(numbers), -1, 2 * count)
        table[:, :, -3:-1], table[:, :, -1] = tones[:, :, 3:5] / length[:, None, None], tones[:, :, 5]
        return ProblemBatch(
            example,
            np.concatenate([first, per_mode.reshape(len(numbers), -1), fluid, *laws], axis=1),
            table,
            _distinct(np.concatenate([np.empty((len(numbers), 0)), *kinks], axis=1)),
        )


def _piece(problem: Problem, name: str) -> list[float]:
    if name == MODES:
        rows = []
        for mode in problem.modes:
            frequency, Q = mode.oscillator
            rows += [frequency, mode.k, Q]
        memories = [mode.memory for mode in problem.modes if mode.memory is not None]
        return rows + [number for memory in memories for number in (*memory.rates, *memory.weights)]
    if name == TONES:
        rows, turns = [], problem.readout.turns or (0.0,) * len(problem.tones)
        for tone, base, turn, drive in zip(problem.tones, problem.base, turns, problem.tip_drive, strict=True):
            numbers = tone.frequency, tone.phase, tone.A0, base.real, base.imag, turn
            rows += [*numbers, *drive.view(float)]  # real and imaginary part in turns
        return rows
    if name == CONTACT:
        return [problem.a0]
    part, place = name.split()
    force = problem.forces[problem.places.index(int(place))]
    return list(force.numbers() if part == LAW else force.kinks())


def _distinct(kinks: Array) -> Array:
    """Return the kinks in order, without kinks that coincide in all rows."""
    kinks = np.sort(kinks, axis=1)
    keep = np.append(True, (np.diff(kinks, axis=1) != 0.0).any(axis=0)) if kinks.size else slice(None)
    return kinks[:, keep]
