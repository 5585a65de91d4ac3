r"""Lines of orbits at a set point, along a parameter of a case.

Unknown are the orbit, the average distance and the parameter. With the map P over a common period, the equations

.. math:: P(x, z_c, p) = x, \quad A(x, z_c, p) = s A_0

are one fewer than the unknowns: their solutions are lines. The forces' memory belongs to x. A point is predicted along the
line's tangent and corrected by Newton's method in the plane across it (pseudo-arclength continuation). A line may turn back
along the parameter; its states begin or end there. Where a force with two branches is about to switch, P jumps and the lines
end. Motion and distance are scaled by free amplitudes, the parameter by its range.

Source: R. Seydel, Practical Bifurcation and Stability Analysis, Springer (2010), chapters 4 and 5.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dforce.case import Case
from dforce.case.paths import with_number
from dforce.core.arrays import Array
from dforce.core.errors import DForceError
from dforce.observables.averaging import weights
from dforce.observables.finish import finish_each
from dforce.problem import Problem
from dforce.solvers.blocks import side_by_side
from dforce.solvers.continuation import LOOP, located, passes
from dforce.solvers.period_map import FD_STEP
from dforce.solvers.stability import stability
from dforce.solvers.states import States

if TYPE_CHECKING:
    from dforce.solvers.transient import CancelCheck

SIDE = 1e-5  # scaled: neighbors on either side that give derivatives
TOLERANCE, NEAR = 1e-8, 1e-6  # scaled: Newton step at which a point is accepted, and after the most steps
MOST_STEPS, EASY = 8, 4  # Newton steps of a point, at most; with fewer the next step along the line is longer
FIRST, LARGEST, SMALLEST = 0.01, 0.03, 1e-7  # scaled: steps along a line; with 0.06 a line was lost
GROWTH = 1.5
STRAIGHT = 0.9  # cosine of the largest turn of the tangent in a step
MOST_POINTS = 400  # of a line, each way
JUMP = 0.1  # of the neighbors' distance: bend of the map between them at which a force switches there


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
class LinePoint:
    """A point of a line.

    Attributes
    ----------
    u, branch
        Scaled motion and memory, `size` numbers, then distance and parameter; the forces' branches, (1, branches).
    equations
        Derivatives of the equations, (size + 1, size + 2).
    measured
        The measured sums over a common period.
    bend
        By how much the derivatives on both sides differ.
    is_turn
        Whether the line turns back along the parameter.
    """

    u: Array
    branch: Array
    equations: Array
    size: int
    measured: dict[str, float]
    bend: float = 0.0
    is_turn: bool = False

    @functools.cached_property
    def monodromy(self) -> Array:
        """How the map answers to the motion, (size, size)."""
        return np.asarray(self.equations[: self.size, : self.size] + np.eye(self.size))

    @functools.cached_property
    def stability(self) -> int:
        """Whether small disturbances die out at this distance, or grow; see ``solvers.stability``."""
        return stability(self.monodromy)

    @property
    def is_stable(self) -> bool:
        """Whether small disturbances die out at this distance."""
        return self.stability > 0

    @property
    def index(self) -> float:
        """The number det(1 - M), which changes its sign at a fold along the distance."""
        return float(np.linalg.det(np.eye(self.size) - self.monodromy))

    @functools.cached_property
    def tangent(self) -> Array:
        """Unit tangent of the line; its sign is arbitrary."""
        return np.asarray(np.linalg.svd(self.equations)[2][-1])


class Lines:
    """Lines along a parameter of a case at a set point (a share of A0).

    Parameters
    ----------
    values
        Values (SI) of the parameter. The largest free amplitude among them, `length` (m), is the unit of the distance.
    check_cancelled
        Called now and then; it stops the work by raising KeyboardInterrupt.
    """

    def __init__(
        self,
        case: Case,
        free_parameter: FreeParameter,
        set_point: float,
        values: Sequence[float],
        check_cancelled: CancelCheck,
    ) -> None:
        self.case, self.free_parameter, self.set_point = case, free_parameter, set_point
        self.check_cancelled = check_cancelled
        self.length = max(self.problem(value).tones[0].A0 for value in values)
        self._problem = functools.lru_cache(maxsize=64)(lambda scaled: self.problem(free_parameter.value(scaled)))
        [(_, block)] = side_by_side([self._problem(0.0)], case.solver, 1, check_cancelled)
        self.memory_scale = block.memory_scale
        self.size, self.has_branches = block.size + len(block.memory_scale), block.hysteresis > 0
        # where a force is about to switch neighbors must not; of memory there may be much, and one side is enough
        side = FD_STEP if self.has_branches else SIDE
        self._sides = np.array([side] * block.size + [FD_STEP] * len(block.memory_scale) + [side, side])
        self._both = np.delete(np.arange(self.size + 2), np.arange(block.size, self.size))

    def problem(self, value: float) -> Problem:
        """Return the problem at a value (SI) of the parameter."""
        case = with_number(self.case, self.free_parameter.path, value)
        return Problem.build(case.instrument, case.forces)

    def _march(self, us: Array, branch: Array) -> tuple[Array, Array, Array, dict[str, float]]:
        """Return motions one common period later, the branches of the first, all amplitude ratios, and the sums of the first.

        Each may be at another value of the parameter.
        """
        ends: Array = np.empty((len(us), self.size))
        ratios: Array = np.empty(len(us))
        after, measured = branch, {}
        values, which = np.unique(us[:, -1], return_inverse=True)
        problems = [self._problem(value) for value in values.tolist()]
        for those, block in side_by_side(problems, self.case.solver, 1, self.check_cancelled):
            some = np.flatnonzero(np.isin(which, those))
            start = States.of_vectors(us[some, : self.size], branch, self.memory_scale)
            slots = block.slots(start, us[some, self.size] * self.length)
            slots.case[:] = np.searchsorted(those, which[some])
            block.march(slots, 1, True)
            end = States(slots.ends[:, 0], slots.memory_after, slots.branch_after)
            ends[some] = end.vectors(self.memory_scale)
            even, tables = weights(block.frequencies, block.common), block.tables_of(slots.case, slots.value)
            with np.errstate(all="ignore"):
                found = finish_each(block.batch.example, 1, slots.rows, even, *tables)
            ratios[some] = found["amplitude_ratio"]
            if some[0] == 0:
                after = end.branch[:1]
                measured = {name: float(np.ravel(each[0])[0]) for name, each in found.items() if np.size(each[0])}
        return ends, after, ratios, measured

    def _look(self, u: Array, branch: Array, wider: float = 1.0) -> tuple[Array, Array, LinePoint]:
        """Return the residual of the equations at a point, the branches a period later, and the point with derivatives."""
        count, both, sides = len(u), self._both, wider * self._sides
        near = np.diag(sides)
        ends, after, ratios, measured = self._march(np.concatenate([u[None], u + near, (u - near)[both]]), branch)
        table = np.column_stack([ends, ratios - self.set_point])
        here, ahead, behind = table[0], table[1 : count + 1], table[count + 1 :]
        slopes = (ahead - here) / sides[:, None]
        slopes[both] = (ahead[both] - behind) / (2.0 * sides[both, None])
        equations = slopes.T - np.eye(count - 1, count) * (np.arange(count) < self.size)
        bends = (ahead[both] + behind - 2.0 * here)[:, : self.size] / sides[both, None]
        residual = here - np.append(u[: self.size], 0.0)
        return residual, after, LinePoint(u, branch, equations, self.size, measured, float(np.abs(bends).max()))

    def correct(self, guess: Array, branch: Array, normal: Array) -> tuple[LinePoint, int] | None:
        """Return the point of a line in the plane through a guess across `normal`, and how many steps led there."""
        u, before = guess.copy(), np.inf
        for steps in range(1, MOST_STEPS + 1):
            try:
                residual, after, place = self._look(u, branch)
                step = np.linalg.solve(np.vstack([place.equations, normal]), np.append(residual, 0.0))
            except (DForceError, np.linalg.LinAlgError, ValueError):  # outside the allowed range, or not a number
                return None
            longest = float(np.abs(step).max())
            if not longest < 0.5 or (longest > 2.0 * before):
                return None
            if (longest < TOLERANCE and np.array_equal(after, branch)) or (steps == MOST_STEPS and longest < NEAR):
                return None if self.has_branches and place.bend > JUMP else (place, steps)
            u, branch, before = u - step, after, longest
        return None

    def seed(self, state: States, zc: float, value: float) -> LinePoint | None:
        """Return the point of a line near a motion at a distance (m), at this value (SI) of the parameter or near it."""
        [x] = state.vectors(self.memory_scale)
        guess = np.concatenate([x, [zc / self.length, self.free_parameter.scaled(value)]])
        found = self.correct(guess, state.branch, np.eye(len(guess))[-1])
        return None if found is None else found[0]

    def trace(self, start: LinePoint, inside: Callable[[LinePoint], bool]) -> list[LinePoint]:
        """Return a line through a point, both ways up to the ends of the parameter's range or to where it leaves `inside`."""
        tangent = start.tangent
        back, forth = (self._one_way(start, way * tangent, inside) for way in (-1.0, 1.0))
        return [*reversed(back), start, *forth]

    def _one_way(self, start: LinePoint, ahead: Array, inside: Callable[[LinePoint], bool]) -> list[LinePoint]:
        points: list[LinePoint] = []
        last, step = start, FIRST
        while len(points) < MOST_POINTS and step > SMALLEST:
            self.check_cancelled()
            reach = _room(float(last.u[-1]), float(ahead[-1]))
            if reach < SMALLEST:
                break
            is_end, normal = step >= reach, ahead
            if is_end:
                normal, step = np.eye(len(ahead))[-1], reach
            found = self.correct(last.u + step * ahead, last.branch, normal)
            if found is None or not self._follows(last, found[0], ahead, step):
                step *= 0.5
                continue
            place, steps = found
            tangent = place.tangent * np.sign(place.tangent @ ahead)
            if tangent[-1] * ahead[-1] < 0.0:
                points.append(self._turn(last, place))
            points.append(place)
            if is_end or not inside(place) or (len(points) >= LOOP and passes(last.u, place.u, start.u)):
                break
            last, ahead = place, tangent
            step = min(LARGEST, step * (GROWTH if steps <= EASY else 1.0))
        return points

    def switches_beside(self, place: LinePoint) -> bool:
        """Return whether a line ends at a point because the map jumps beside it: another force switches there."""
        return self.has_branches and self._look(place.u, place.branch, 2.0)[2].bend > JUMP

    def between(self, a: LinePoint, b: LinePoint, test: Callable[[LinePoint], float]) -> LinePoint:
        """Return the point between two neighbors at which a function passes zero, as near as it was found."""

        def find(u: Array, near: LinePoint, normal: Array) -> LinePoint | None:
            found = self.correct(u, near.branch, normal)
            return None if found is None else found[0]

        point: LinePoint = located(find, a, b, test)
        return point

    def _turn(self, a: LinePoint, b: LinePoint) -> LinePoint:
        """Return the point between two neighbors at which the line turns back along the parameter."""
        chord = b.u - a.u
        turn = self.between(a, b, lambda point: float(point.tangent[-1] * np.sign(point.tangent @ chord)))
        return replace(turn, is_turn=True)

    def _follows(self, last: LinePoint, place: LinePoint, ahead: Array, step: float) -> bool:
        turn = abs(float(place.tangent @ ahead))
        return turn > STRAIGHT and float(np.linalg.norm(place.u - last.u - step * ahead)) < 0.5 * step


def _room(scaled: float, way: float) -> float:
    """Return how far it is along a direction to the end of the parameter's range."""
    return max(0.0, ((1.0 if way > 0.0 else 0.0) - scaled) / way) if way else np.inf
