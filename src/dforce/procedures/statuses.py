"""The outcome of the points that were found, and which of them keep their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import AnyArray, Array, Bools
from dforce.observables.averaging import weights
from dforce.observables.misfit import GROSS, is_wrong, misfit_of_rows
from dforce.results.status import Status, graded

if TYPE_CHECKING:
    from dforce.problem import Problem
    from dforce.solvers.block import Block
    from dforce.solvers.points import Points
    from dforce.solvers.transient import Steady

EMPTY = (Status.FAILED, Status.NOT_COMPUTED, Status.UNRESOLVED, Status.NO_STATE)  # points without numbers


def status_of(found: Steady, problem: Problem) -> Status:
    """Return the status of a point of a problem."""
    if not (np.isfinite(found.values["amplitude"]).all() and found.motion.is_finite):
        return Status.FAILED
    # an orbit of several common periods holds the balance as well
    is_orbit = found.repeats or "multiplier_modulus" in found.values
    if found.is_misled or is_wrong(problem, found.columns, found.settled, is_orbit)[0]:
        return Status.UNRESOLVED
    if not found.settled:
        return Status.NOT_SETTLED
    if not found.repeats:
        return Status.NOT_REPEATING
    (grade,) = graded(np.atleast_1d(found.values.get("error_estimate", np.inf)), found.accuracy).tolist()
    return next(status for status in Status if status == grade)


def statuses(points: Points, block: Block, values: Array) -> np.ndarray[Any, np.dtype[np.int8]]:
    """Return the status of each point of a block, found at values of its parameter (problems, values)."""
    became = np.full(points.cycles.shape, Status.NOT_COMPUTED, dtype=np.int8)
    is_orbit = points.is_orbit
    if is_orbit.any():  # from the rows: making all observables twice takes long
        numbers, tones = (table[is_orbit.ravel()] for table in block.tables(values))
        even = weights(block.frequencies, block.common)
        good = misfit_of_rows(block.batch.example, points.rows[is_orbit], even, numbers, tones) <= GROSS
        became[is_orbit] = np.where(good, graded(points.error[is_orbit], block.settings.accuracy), Status.UNRESOLVED)
    for (case, place), found in points.others.items():
        became[case, place] = status_of(found, block.problem(case, float(values[case, place]))[0])
    return became


def need_samples(points: Points, became: AnyArray) -> Bools:
    """Return the problems that more samples may resolve, from the statuses of their points (problems, values).

    The first unresolved point of each decides, because later points start there: not if its error hardly falls with them.
    """
    wrong = became == Status.UNRESOLVED
    return np.asarray((wrong & ~points.stays)[np.arange(len(wrong)), wrong.argmax(axis=1)])


def without_failed(columns: Mapping[str, Any], became: Any) -> dict[str, AnyArray]:
    """Return the columns of points with these statuses, NaN where a point has no result."""
    empty = np.isin(became, EMPTY)
    if not empty.any():
        return dict(columns)
    return {
        name: np.where(empty.reshape(empty.shape + (1,) * (np.ndim(column) - empty.ndim)), np.nan, column)
        for name, column in columns.items()
    }
