"""The motion at each point of a result, from which anything can go on: in SI, at the start of a common period."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.errors import ParameterError
from dforce.core.quantities import MOTION, REPEATS
from dforce.kernel import base_in_motion, tone_table, units_of
from dforce.solvers.states import States

if TYPE_CHECKING:
    from dforce.core.arrays import Array
    from dforce.problem import Problem
    from dforce.solvers.block import Block
    from dforce.solvers.integrator import Motion
    from dforce.solvers.points import Points

COMPONENT = "component"


def scales_of(problem: Problem) -> Array:
    """Return the units (m, m/s) of the numbers of a scaled motion: deflection and velocity of one mode after the other."""
    tone = problem.tones[0]
    return units_of(problem, tone.A0, tone.A0 * 2.0 * math.pi * tone.frequency)


def base_of(problem: Problem) -> Array:
    """Return the base's share of the numbers of a scaled motion."""
    return base_in_motion(problem, tone_table(problem))


def rows_of(states: States, scales: Array, base: Array, problem: Problem) -> Array:
    """Return scaled states of problems like one as rows in SI.

    They are all deflections, all velocities, the fluid's memory, then memory and branches of the forces.
    """
    x, moves = (states.x - base) * scales, 2 * len(problem.modes)
    return np.concatenate([x[..., :moves:2], x[..., 1:moves:2], x[..., moves:], states.memory, states.branch], axis=-1)


def split_rows(rows: Array, problem: Problem) -> States:
    """Return rows in SI as states of a problem whose motions are in SI, too; the inverse of :func:`rows_of` of scale 1."""
    places = np.cumsum([count for count, _ in _counts(problem).values()])
    if rows.shape[-1:] != places[-1:]:
        raise ParameterError("the motions of this result have lost numbers; keep its dimension component whole")
    z, v, fluid, kept, branch = np.split(rows, places[:-1], axis=-1)
    moves = np.stack([z, v], axis=-1).reshape(*z.shape[:-1], -1)
    return States(np.concatenate([moves, fluid], axis=-1), kept, branch)


def states_of(rows: Array, problem: Problem, scales: Array, base: Array) -> States:
    """Return rows in SI as scaled states of a problem; the inverse of :func:`rows_of`."""
    states = split_rows(rows, problem)
    return States(states.x / scales + base, states.memory, states.branch)


def _counts(problem: Problem) -> dict[str, tuple[int, str]]:
    """Return the parts of a row in order: how many numbers each has, and their unit."""
    return {
        "z": (len(problem.modes), "m"),
        "v": (len(problem.modes), "m/s"),
        "fluid": (len(problem.modes) * problem.late_fluid, "m/s"),
        "memory": (sum(force.memory for force in problem.forces), "SI"),
        "branch": (sum(force.switch is not None for force in problem.forces), "1"),
    }


def components(problem: Problem) -> dict[str, Any]:
    """Return the coordinates that name the numbers of a row and give their units."""
    counts = _counts(problem)
    names = [f"{name}_{number + 1}" for name, (count, _) in counts.items() for number in range(count)]
    units = [unit for count, unit in counts.values() for _ in range(count)]
    return {COMPONENT: (COMPONENT, names), "component_units": (COMPONENT, units)}


def motions(points: Points, block: Block, values: Array) -> dict[str, Array]:
    """Return the motions at all points of a block, (problems, values, components), and after how many periods they repeat."""
    which = np.arange(len(values))[:, None]
    scales, base = block.scales_of(which, values), block.base_of(which, values)
    cycles = np.where(points.cycles > 0, points.cycles * float(block.common), np.nan)
    return {MOTION: rows_of(points.states, scales, base, block.batch.example), REPEATS: cycles}


def in_si(states: States, problem: Problem) -> Array:
    """Return scaled states of one problem as rows in SI."""
    return rows_of(states, scales_of(problem), base_of(problem), problem)


def scaled(rows: Array, problem: Problem) -> States:
    """Return rows in SI as scaled states of one problem; the inverse of :func:`in_si`."""
    return states_of(rows, problem, scales_of(problem), base_of(problem))


def motion_of(point: Any, problem: Problem) -> Motion:
    """Return the motion that is kept at one point of a result."""
    return scaled(point[MOTION].values[None], problem).motion(0)
