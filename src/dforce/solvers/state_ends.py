"""How a followed state ends, which way motions leave it there, and where they land."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from dforce.core.arrays import Array, Bools, Indices
from dforce.solvers.accuracy import FINER, ORDER, SURE, TWICE
from dforce.solvers.block import Block
from dforce.solvers.integrator import Motion
from dforce.solvers.parameter_range import STEEP
from dforce.solvers.quasi_static import ENDED, Stretch
from dforce.solvers.sample_counts import MOST_SAMPLES
from dforce.solvers.settling import apart, polished
from dforce.solvers.states import States

NEARER = 0.2  # of the next multiplier's distance from the unit circle: beside a fold the largest is nearer
FORETOLD = 1e-4  # of the parameter's unit: largest distance of a predicted fold behind the last orbit
ALIKE = 1e-3  # of the parameter's unit: an end found with more samples is the same one, if it is so near
DOUBLED = 1e-3  # of the parameter's unit: how far behind the period doubling the doubled state is sought
KICKS = np.geomspace(0.002, 0.3, 17)  # of the free amplitude: guesses of how far a doubled state is from the single one
JUMP = 1e-3  # of the free amplitude: states that differ by less are one
STILL_INSIDE = 0.1  # how far from the unit circle the multiplier of a state that ends may still be


class End(NamedTuple):
    """Where a state ends.

    Attributes
    ----------
    last, value
        Its last motion, and the value (SI) there.
    edge, place
        The end itself, a little behind: scaled motion and value (SI).
    cycles
        Common periods after which the state repeats.
    error
        Estimated error of the place, as a share of the parameter's unit; infinite where it is unknown.
    """

    last: Motion
    value: float
    edge: Array
    place: float
    cycles: int
    error: float


class Left(NamedTuple):
    """A state that ended, while its motion is on the way.

    `amplitude` (m) belongs to the state; the motion left at the value `at`.
    """

    end: End
    amplitude: float
    at: float
    motion: Motion


def directions(ends: Stretch, way: Array) -> tuple[Any, Any, Array]:
    """Return which states end in a period doubling, which in a fold, and the unit vectors along which motions leave.

    At a fold this is the direction in which the state moves: on its other side lies the unstable one. Where no multiplier is
    near the unit circle, as where the force jumps, the motion starts from the end itself.
    """
    count, size = ends.last_x.shape
    doubling, folding, aside = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool), np.zeros((count, size))
    for i in range(count):
        if not np.isfinite(ends.last_monodromy[i]).all():
            continue
        values, vectors = np.linalg.eig(ends.last_monodromy[i])
        *_, second, largest = np.argsort(np.abs(values)).tolist()
        if abs(values[largest]) < 1.0 - STILL_INSIDE:
            continue
        vector = vectors[:, largest].real
        if abs(values[largest].imag) < 1e-9 and values[largest].real > 0.0:
            vector = way[i] * ends.last_slope[i]
            folding[i] = 1.0 - abs(values[largest]) < NEARER * (1.0 - abs(values[second]))
        doubling[i] = values[largest].real < 0.0 and abs(values[largest].imag) < 1e-9
        aside[i] = vector / max(float(np.abs(vector).max()), 1e-300)
    return doubling, folding, aside


def ahead_of(ends: Stretch, way: Array, folding: Bools, unit: Array) -> Array:
    """Return the distances (SI) of the predicted folds behind the last orbits of states; zero where there is none."""
    ahead = np.where(folding, way * (ends.fold - ends.last_value), np.nan)
    return np.where((ahead > 0.0) & (ahead < FORETOLD * unit), ahead, 0.0)


class Ended(NamedTuple):
    """States that ended.

    Attributes
    ----------
    cases, ends, places
        Their problems, their stretches with the last orbits, and where they end (SI).
    way
        1 where the parameter rises, or -1.
    before, values, behind
        The points before the ends, which may lie on another state, their values (SI), and the values behind the ends.
    cycles
        Common periods after which the motions repeat.
    """

    cases: Indices
    ends: Stretch
    places: Array
    way: Array
    before: States
    values: Array
    behind: Array
    cycles: int

    def take(self, which: Indices) -> Ended:
        """Return some of them."""
        return Ended._make([*(part.take(which) for part in self[:-1]), self.cycles])

    @property
    def is_steep(self) -> Bools:
        """Whether the states move fast where they end, as beside folds."""
        return np.asarray(np.abs(self.ends.last_slope).max(axis=1) > STEEP)

    def again(self, block: Block) -> Ended:
        """Return them as they are with the samples of another block, followed from the points before."""
        behind = self.behind[:, None]
        ends = block.follow(self.cases, self.before, self.values, behind, repeats=self.cycles)
        _, folding, _ = directions(ends, self.way)
        places = ends.last_value + self.way * ahead_of(ends, self.way, folding, block.unit[self.cases])
        has_ended = (ends.outcome == ENDED) & np.isfinite(ends.last_monodromy).all(axis=(1, 2))
        return self._replace(ends=ends, places=np.where(has_ended, places, np.nan))

    def errors(self, finer: Block) -> Array:
        """Return the estimated errors of the places, as shares of the parameter's unit, from a block with twice the samples.

        The last orbit is found again with these. Where the state does not move fast there, it is followed again; infinite
        where either fails.
        """
        steep = self.is_steep
        change = np.empty(len(steep))
        some, others = self.take(np.flatnonzero(steep)), self.take(np.flatnonzero(~steep))
        last, at = States.last_of(some.ends), some.ends.last_value
        change[steep] = finer.shifts(some.cases, last, at, some.ends.last_slope, self.cycles)
        if len(others.cases):
            change[~steep] = others.again(finer).places - others.places
        error = np.abs(change) / finer.unit[self.cases] / (1.0 - TWICE**-ORDER)
        return np.asarray(np.nan_to_num(error, nan=np.inf))


def assured_places(block: Block, ended: Ended) -> tuple[Array, Array]:
    """Return where states ended as accurately as asked for, with the estimated errors as shares of the parameter's unit.

    Where the error of a steep end is too large the state is followed again with more samples. Other ends stay: their places
    may depend on the steps that lead there. A jump lies between the points beside it: a place found outside is not taken, and
    its distance from the first one counts as an error.
    """
    accuracy, unit = block.settings.accuracy, block.unit[ended.cases]
    places, errors = ended.places.copy(), ended.errors(block.finer(TWICE * block.points))
    for i in np.flatnonzero(ended.is_steep & (errors > SURE * (accuracy or np.inf))).tolist():
        for times in FINER:
            if TWICE * times * block.points > MOST_SAMPLES:
                break
            found = ended.take(np.array([i])).again(block.finer(times * block.points))
            if not found.is_steep[0] or not abs(found.places[0] - places[i]) < ALIKE * unit[i]:
                break
            places[i], errors[i] = found.places[0], found.errors(block.finer(TWICE * times * block.points))[0]
            if errors[i] <= SURE * (accuracy or 0.0):
                break
    between = (places - ended.values) * (ended.behind - places) > 0.0
    errors += np.where(between, 0.0, np.abs(places - ended.places) / unit)
    return np.where(between, places, ended.places), errors


def behind_doublings(
    block: Block, cases: Indices, ends: Stretch, way: Array, aside: Array, which: Indices, cycles: int
) -> Iterator[tuple[int, float, States]]:
    """Give the doubled states behind some of these ends: the number of each, its value of the parameter, and the state.

    The value may lie behind the next one of the path: the state is followed back then.
    """
    for i in which.tolist():
        case, unit, ended = int(cases[i]), float(block.unit[cases[i]]), float(ends.last_value[i])
        at = ended + math.copysign(DOUBLED * unit, way[i])
        single = States.last_of(ends).take([i])
        single.x[:] += ends.last_slope[i] * (at - ended) / unit
        state = doubled(block, case, at, single, aside[i], cycles)
        if state is not None:
            yield i, at, state


def doubled(block: Block, case: int, at: float, single: States, aside: Array, cycles: int) -> States | None:
    """Return the doubled state behind a period doubling of a state that repeats after `cycles`; None if there is none.

    It lies on both sides of the single state, which has lost its stability, along the unit vector `aside`.
    """
    each = len(KICKS) if block.is_smooth else 1  # others march one after the other
    for kicks in KICKS.reshape(-1, each):
        guesses = single.take(np.zeros(each, dtype=int))
        guesses.x[:] += kicks[:, None] * aside
        same, there = np.full(each, case), np.full(each, at)
        found = polished(block, same, guesses, there, 2 * cycles)
        states = States.last_of(found)
        between = block.advance(same, states, there, cycles)
        # on both sides of the single state, in turns
        around = apart(0.5 * (between.x + states.x), single.x) < KICKS[-1]
        good = np.flatnonzero((found.done == 1) & (apart(between.x, states.x) > JUMP) & around)
        if len(good):
            return states.take(good[:1])
    return None
