"""The blocks that solve problems: for the integrator of the settings, and for problems that march together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Indices
from dforce.kernel import signature
from dforce.solvers.block import Block
from dforce.solvers.integrator import sample_count
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.settings import SolverSettings

if TYPE_CHECKING:
    from dforce.problem import Problem
    from dforce.solvers.transient import CancelCheck


def block_type(settings: SolverSettings) -> type[Block]:
    """Return the kind of block that solves with these settings."""
    if settings.integrator != "engine" or settings.method != "periodic":
        return Block
    from dforce.solvers.engine_block import EngineBlock  # loads the compiler

    return EngineBlock


def composition_of(problem: Problem) -> tuple[Any, ...]:
    """Return all that decides how a problem is computed but its numbers."""
    heights = 0 if problem.heights is None else len(problem.heights.zc)
    laws = [(signature(force), force.timed) for force in problem.forces]
    return len(problem.modes), problem.lagging, problem.late_fluid, heights, *laws


def side_by_side(
    problems: Sequence[Problem], settings: SolverSettings, harmonics: int, check_cancelled: CancelCheck
) -> Iterator[tuple[Indices, Block]]:
    """Give the numbers of problems that march together, and their block: same laws, samples, phases and ratios of tones."""
    groups: dict[tuple[Any, ...], list[int]] = {}
    for number, problem in enumerate(problems):
        first = problem.tones[0].frequency
        tones = tuple((round(tone.frequency / first, 12), tone.phase) for tone in problem.tones)
        groups.setdefault((sample_count(problem, settings), tones, composition_of(problem)), []).append(number)
    for (samples, *_), numbers in groups.items():
        some = [problems[number] for number in numbers]

        def at(case: int, zc: float, some: list[Problem] = some) -> tuple[Problem, float]:
            return some[case].at_height(zc), zc

        batch = ProblemBatch.of(some)
        yield np.array(numbers), block_type(settings)(batch, at, settings, harmonics, samples, check_cancelled)
