"""The error that finite steps leave in orbits: estimated with fewer samples, lowered with more where it is too large.

An orbit is measured again with half and with three quarters of the samples, where one Newton step from it leads: what changes
tells, by the order of the errors, what is left. Behind a kink of the force the two swing, each its own way, and so their mean
is taken. An orbit that is not accurate enough is found again with twice as many samples, and more. Each point
stands by itself: what is done to it does not depend on those beside it.
"""

from __future__ import annotations

import numpy as np

from dforce.kernel import Array
from dforce.observables.averaging import weights
from dforce.observables.deviation import deviations
from dforce.observables.finish import finish_each
from dforce.solvers.block import Block
from dforce.solvers.points import Points
from dforce.solvers.problem_batch import Indices
from dforce.solvers.sample_counts import MOST_SAMPLES
from dforce.solvers.settling import apart, polished
from dforce.solvers.states import States

COARSER = (1 / 2, 3 / 4)  # times the samples
FINER = (2, 4, 16, 64)  # times the samples, one after the other
SURE = 1 / 3  # of the accuracy: nine in ten of the errors estimated from fewer samples are right within a factor 3
NEAR = 0.05  # of the free amplitude: an orbit found with more samples is the same one, if it is so near
ORDER = 3.0  # of the errors, as random cases show it: the method's 4 where the force is smooth, less behind kinks


class _Orbits:
    """Some orbits of a block: of which problems, at which values, where they start, and what was found on them."""

    def __init__(self, block: Block, values: Array, points: Points, places: tuple[Indices, Indices]) -> None:
        self.block, self.cases = block, places[0]
        self.at, self.states = values[places], points.states.take(places)
        self.rows, self.monodromy, self.residual = (
            points.rows[places],
            points.monodromy[places],
            points.residual[places],
        )
        self.tables = block.tables_of(self.cases, self.at)
        self.error: Array = np.full(len(self.at), np.nan)
        self.found: dict[str, Array] = {}  # what they measure, by name

    def measured(self, rows: Array, which: Indices) -> dict[str, Array]:
        """Return the observables of some of them from what was measured."""
        block, (numbers, tones) = self.block, (table[which] for table in self.tables)
        even = weights(block.frequencies, block.common)
        return finish_each(block.lot.example, block.harmonics, rows, even, numbers, tones)

    def apart(self, a: dict[str, Array], b: dict[str, Array], which: Indices) -> Array:
        """Return how far two measurements are apart, (orbits, names); infinite where one is no number."""
        numbers, tones = (table[which] for table in self.tables)
        return np.nan_to_num(deviations(self.block.lot.example, numbers, tones, a, b), nan=np.inf)

    def judge(self) -> None:
        """Estimate all errors."""
        blocks = [self.block.finer(round(share * self.block.points)) for share in COARSER]
        rows = [coarse.remeasure(self.cases, self.states, self.at, self.monodromy) for coarse in blocks]
        count = len(self.at)
        every = np.tile(np.arange(count), 1 + len(rows))  # all at once: a call costs more than a hundred orbits
        measured = self.measured(np.concatenate([self.rows, *rows]), every)
        self.found = {name: values[:count] for name, values in measured.items()}
        fine = {name: values[every[count:]] for name, values in self.found.items()}
        coarse = {name: values[count:] for name, values in measured.items()}
        changes = self.apart(fine, coarse, every[count:]).reshape(len(rows), count, -1)
        errors = [left(change, self.block.points / one.points) for change, one in zip(changes, blocks, strict=True)]
        self.error = np.mean(errors, axis=0)

    def find_again(self, some: Indices, times: int, finer: float) -> Indices:
        """Find some again with so many times the block's samples, and their own before; return those that were found."""
        states = self.states.take(some)
        branch = polished(self.block.finer(times * self.block.points), self.cases[some], states, self.at[some])
        same = np.flatnonzero((branch.done == 1) & (apart(branch.last_x, states.x) < NEAR))
        some = some[same]
        if len(some):
            measured = self.measured(branch.rows[same, 0], some)
            before = {name: values[some] for name, values in self.found.items()}
            self.error[some] = left(self.apart(measured, before, some), finer)
            for name, values in measured.items():
                self.found[name][some] = values
            self.rows[some], self.monodromy[some] = branch.rows[same, 0], branch.monodromy[same, 0]
            self.residual[some] = branch.residual[same, 0]
            self.states.put(some, States(branch.last_x[same], branch.last_memory[same], branch.last_branch[same]))
        return some


def left(change: Array, finer: float) -> Array:
    """Return the largest error that is left, (orbits,), after a change (orbits, names) by so many times finer steps."""
    return np.asarray(change.max(axis=1) / (finer**ORDER - 1.0))


def assure(block: Block, values: Array, points: Points) -> None:
    """Write the estimated error of each orbit that has none yet, and find those again that are not as accurate as asked for.

    `values` (problems, values) are those of the block's parameter, in SI. The states stay those with the block's samples.
    """
    cases, steps = np.nonzero(points.is_orbit & np.isnan(points.error))
    if not len(cases):
        return
    places = cases, steps
    orbits, accuracy = _Orbits(block, values, points, places), block.settings.accuracy
    orbits.judge()
    if accuracy is not None:
        doubtful, before = np.flatnonzero(orbits.error > SURE * accuracy), 1
        for times in FINER:
            if not len(doubtful) or times * block.points > MOST_SAMPLES:
                break
            found = orbits.find_again(doubtful, times, times / before)
            doubtful, before = found[orbits.error[found] > SURE * accuracy], times
    points.rows[places], points.monodromy[places] = orbits.rows, orbits.monodromy
    points.residual[places], points.error[places] = orbits.residual, orbits.error
