"""Errors by bootstrap: fits to residuals redrawn in blocks, for noise that differs from the free part's."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.fitting.certainty import CORRELATED
from dforce.inverse.fitting.minimize import Minimum, Objective
from dforce.inverse.fitting.model import CurveModel

TIMES = 3.0  # lengths of correlation in a block
LEAST_BLOCKS = 5  # in a branch
TOLERANCE, MOST_RUNS = 1e-6, 30  # of each fit: chi2 to 1e-6 is a value to some hundredths of its error
SEED = 1  # a fit that is done again gives the same


@dataclass(frozen=True)
class Bootstrap:
    """Fits to redrawn residuals.

    Attributes
    ----------
    varied
        The results of the fits, (draws, unknowns).
    block
        Neighbors that were drawn together.
    """

    varied: Array
    block: int


def block_length(residuals: Sequence[Array], correlation: float) -> int:
    """Return how many neighbors are drawn together: three lengths of the correlation of the noise or of the residuals.

    Parameters
    ----------
    residuals
        Of each branch, in the order in which it was measured, (points, numbers).
    correlation
        Of neighbors in the free part.
    """
    both = sum(float((part[1:] * part[:-1]).sum()) for part in residuals)
    square = sum(float((part**2).sum()) for part in residuals)
    together = max(both / square if square else 0.0, correlation)
    if together <= CORRELATED:
        return 1
    most = max(max(len(part) for part in residuals) // LEAST_BLOCKS, 1)
    return most if together >= 1.0 else min(math.ceil(TIMES / -math.log(together)), most)


def bootstrap(
    model: CurveModel, best: Minimum, seen: Sequence[int], count: int, done: Callable[[Bootstrap], None]
) -> None:
    """Fit to redrawn residuals as often as asked for; `done` gets all that there are after each fit."""
    draw, values = np.random.default_rng(SEED), model.values(best.varied)
    residuals = model.residuals(best.predicted)
    groups = [np.flatnonzero(model.data.branch[model.points] == kind) for kind in np.unique(model.data.branch)]
    groups = [group for group in groups if len(group)]
    length = block_length([residuals[group] for group in groups], model.data.correlation)
    # a fit leaves residuals that are smaller than the noise
    larger = math.sqrt(residuals.size / max(residuals.size - len(seen), 1))
    found: list[Array] = []
    for _ in range(count):
        again, drawn = copy.copy(model), residuals.copy()
        for group in groups:
            drawn[group] = residuals[group[_in_blocks(len(group), length, draw)]]
        again.measured = best.predicted.values - larger * drawn * model.sigma
        again.unknowns = [
            one if one.prior is None else replace(one, prior=(float(draw.normal(value, one.prior[1])), one.prior[1]))
            for one, value in zip(model.unknowns, values, strict=True)
        ]
        found.append(Objective(again, best.varied, seen).minimize(TOLERANCE, MOST_RUNS).varied)
        done(Bootstrap(np.array(found), length))


def _in_blocks(count: int, length: int, draw: np.random.Generator) -> Any:
    """Return places of so many rows, drawn in blocks of neighbors; the last row's neighbor is the first."""
    starts = draw.integers(0, count, math.ceil(count / length))
    return (starts[:, None] + np.arange(length)).ravel()[:count] % count
