r"""Lines of orbits at a set point, along a parameter of a case.

Unknown are the orbit, the average distance and the parameter. With the map P over a common period, the equations

.. math:: P(x, z_c, p) = x, \quad A(x, z_c, p) = s A_0

are one fewer than the unknowns: their solutions are lines. The forces' memory belongs to x. Lines are followed as any curve,
see ``continuation``. A line may turn back along the parameter; its states begin or end there. Where a force with two branches
is about to switch, P jumps and the lines end. Motion and distance are scaled by free amplitudes, the parameter by its range.

Source: R. Seydel, Practical Bifurcation and Stability Analysis, Springer (2010), chapters 4 and 5.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dforce.case import Case
from dforce.case.paths import with_number
from dforce.core.arrays import Array
from dforce.observables.averaging import weights
from dforce.observables.finish import finish, first_ratios
from dforce.problem import Problem
from dforce.solvers.orbit import Orbit
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.period_map import ALL, FD_STEP, MOTION, Slots
from dforce.solvers.stability import stability
from dforce.solvers.states import States

SIDE = 1e-5  # scaled: neighbors that give derivatives; nearer ones show the edges of the map where the tip just touches
LARGEST = 0.03  # scaled: step along a line; with 0.06 a line was lost
MOST_POINTS = 800  # of a line
JUMP = 0.1  # of the neighbors' distance: bend of the map between them at which a force switches there
DEEPEST = -3.0  # free amplitudes: lines are not followed to smaller distances


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that varies along lines: its path, and its range (SI), on a scale of equal steps or equal factors."""

    path: str
    low: float
    high: float
    is_log: bool = False

    def value(self, scaled: float) -> float:
        """Return the value (SI) of a scaled one, 0 to 1 from the lowest to the highest."""
        if self.is_log:
            return float(self.low * (self.high / self.low) ** scaled)
        return self.low + scaled * (self.high - self.low)

    def scaled(self, value: float) -> float:
        """Undo :meth:`value`."""
        if self.is_log:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True)
class LineOrbit(Orbit):
    """An orbit on a line: `u` has the scaled distance first, and the parameter last; at `fold` the line turns back along it.

    Attributes
    ----------
    equations
        Derivatives of the equations by the scaled unknowns.
    measured
        The observables.
    """

    equations: Any = None
    measured: dict[str, float] = field(default_factory=dict)

    @functools.cached_property
    def stability(self) -> int:
        """Whether small disturbances die out at this distance, or grow; see ``solvers.stability``."""
        return stability(self.monodromy)

    @property
    def determinant(self) -> float:
        """The number det(1 - M), which changes its sign at a fold along the distance."""
        return float(np.linalg.det(np.eye(len(self.monodromy)) - self.monodromy))


class Lines(ParameterRange):
    """Lines along a parameter of a case at a set point (a share of A0).

    The distance is one more unknown, and the set point one more equation: an orbit is a fixed point of the map of distance and
    motion to the distance plus the miss of the set point, and to the motion one common period later.

    Parameters
    ----------
    values
        Values (SI) of the parameter. The largest free amplitude among them, `length` (m), is the unit of the distance.
    """

    def __init__(self, case: Case, free_parameter: FreeParameter, set_point: float, values: Sequence[float]) -> None:
        self.case, self.free_parameter, self.set_point = case, free_parameter, set_point
        self.length = max(self.problem_with(value).tones[0].A0 for value in values)

        def at(scaled: float) -> Problem:
            return self.problem_with(free_parameter.value(min(max(scaled, 0.0), 1.0)))

        super().__init__(at, 0.0, 1.0, case.solver, 1, zc=0.0)
        self._motion, self.size, self._is_compiled = self._motion + 1, self.size + 1, False
        self.has_branches = self.block(0.0).hysteresis > 0
        # where a force is about to switch neighbors must not
        self.side = FD_STEP if self.has_branches else SIDE

    def problem_with(self, value: float) -> Problem:
        """Return the problem at a value (SI) of the parameter."""
        case = with_number(self.case, self.free_parameter.path, value)
        return Problem.build(case.instrument, case.forces)

    def seed(self, state: States, zc: float, value: float) -> Any:
        """Return the orbit of a line near a motion at a distance (m) and a value (SI) of the parameter; None without one."""
        guess = np.concatenate([[zc / self.length], *self.vectors(state), [self.free_parameter.scaled(value)]])
        return self.find(guess, state.branch)

    def switches_beside(self, last: LineOrbit) -> bool:
        """Return whether a line ends at an orbit because the map jumps beside it: another force switches there."""
        return self._is_torn(last.u[None, :-1], last.value, last.kept.branch, 2.0 * FD_STEP)

    def _is_torn(self, x: Array, value: float, branch: Array, side: float) -> bool:
        """Return whether the map jumps between an orbit and its neighbors so far away, as where a force switches."""
        if not self.has_branches:
            return False
        beside = side * np.eye(self._motion, self.size)
        ends, _ = self._march(np.concatenate([x, x + beside, x - beside]), value, branch, 1)
        here, (ahead, behind) = ends[0], np.split(ends[1:], 2)
        return not np.abs(ahead + behind - 2.0 * here).max() < JUMP * side

    def _march(
        self, x: Array, value: float, branch: Array, repeats: int, measured: bool = False
    ) -> tuple[Array, Slots]:
        """Return where the map leads from distances, motions and memories; see :class:`ParameterRange`."""
        block = self.block(value)
        slots = block.slots(self.states(x[:, 1:], branch), x[:, 0] * self.length, repeats)
        slots.case[:] = 0
        slots.wanted[:] = ALL if measured else MOTION
        block.march(slots, repeats, True)
        even, (_, tones) = weights(block.frequencies, len(slots.rows[0])), block.tables_of(slots.case, slots.value)
        missed = first_ratios(block.batch.example, slots.rows, even, tones) - self.set_point
        after = self.vectors(States(slots.ends[:, 0], slots.memory_after, slots.branch_after))
        return np.column_stack([x[:, 0] + missed, after]), slots

    def _found(self, x: Array, branch: Array, value: float, steps: float, repeats: int) -> Orbit | None:
        """Return the orbit with these unknowns; None where it is too deep, or a force switches beside it."""
        if not x[0, 0] > DEEPEST or self._is_torn(x, value, branch, FD_STEP):
            return None
        derivative, by_parameter, rows, gaps, residual = self._measured(x, value, branch, repeats)
        problem, state = self.problem_at(value), self.states(x[:, 1:], branch)
        found = finish(problem, 1, rows, weights([tone.frequency for tone in problem.tones], len(rows)))
        return LineOrbit(
            np.append(x, value),
            state,
            value,
            state,
            derivative[1:, 1:],
            by_parameter[1:],
            rows,
            gaps,
            residual,
            steps,
            equations=np.column_stack([derivative - np.eye(self.size), by_parameter]),
            measured={name: float(np.ravel(each)[0]) for name, each in found.items() if np.size(each)},
        )
