"""Stable orbits of the engine followed while a parameter changes, see ``quasi_static``: first anchors, then all between.

Steps lead to anchors, each as far as the last anchors predict it. The orbits at values that a step passed lie between two
anchors. Polynomials through the nearest anchors and their slopes predict them so well that they are found side by side, most
of them by one march.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from dforce.core.arrays import Array, Bools, Indices
from dforce.solvers.newton import CONVERGED, Orbits, empty_orbits
from dforce.solvers.period_map import ALL, NOTHING, Slots
from dforce.solvers.quasi_static import ENDED, FIRST, FOLLOWED, SMALLEST, Stretch
from dforce.solvers.quasi_static_steps import (
    BENT,
    CHORD,
    EXACT,
    FARTHEST,
    GROWTH,
    LARGEST,
    SHRINK,
    TURNED,
    fold_ahead,
    hermite,
)
from dforce.solvers.stability import is_stable
from dforce.solvers.states import States

ANCHORS = 4  # through so many the orbits between are predicted
ABREAST = 128  # motions in one call, so that Ctrl-C and Stop answer at once
APART = 0.25  # of the way to a value: distance of the two anchors that predict it, at least
AIMED = 0.2  # of the largest error allowed in a prediction: aim for the next prediction
SHORTER = 0.7  # of a step that was refused: the next step, at most
ONE_BY_ONE = 1  # values in a step, after the values that a step passed were not found


class OrbitFinder(Protocol):
    """A block that finds orbits of problems side by side."""

    predicted: float
    unit: Array

    def slots(self, states: States, at: Array, repeats: int) -> Slots:
        """Return slots that hold copies of states."""

    def find(self, which: Indices, slots: Slots, orbits: Orbits, repeats: int, at_once: bool) -> None:
        """Find the orbits near motions."""

    def check_cancelled(self) -> Any:
        """Raise when the run is to stop."""


class Anchor(NamedTuple):
    """An orbit that a step led to, and the number of the last value of the path up to it."""

    value: float
    x: Array
    slope: Array
    memory: Array
    branch: Array
    place: int


class Follower:
    """Problems on the way along `values` (problems, values), from the stable orbit near each start, with which `found` begins.

    The first orbit is sought at the start. A problem without a stable orbit there has ENDED with nothing done. Where a state
    ends, it ends between two anchors: no step between them is as short as SMALLEST.
    """

    def __init__(
        self, block: OrbitFinder, which: Indices, values: Array, counts: Indices, repeats: int, found: Stretch
    ) -> None:
        cases = len(values)
        self.block, self.which, self.values, self.counts = block, which, values, counts
        self.repeats, self.found, self.unit = repeats, found, block.unit[which]
        self.reach, self.going = np.full(cases, FIRST), np.ones(cases, bool)
        self.most = np.full(cases, values.shape[1])  # values up to which a step may lead
        self.way = np.where(values[np.arange(cases), np.maximum(counts - 1, 0)] < found.last_value, -1.0, 1.0)
        self.anchors: list[list[Anchor]] = [[] for _ in range(cases)]
        self.place = np.full(cases, -1)  # the last value of the path that the anchors have come to

    def step(self) -> bool:
        """Go to the next anchors, or find the values that they passed; return whether there was work."""
        going = np.flatnonzero(self.going)
        if len(going):
            self._next(going)
        elif not self._fill():
            return False
        self.block.check_cancelled()
        return True

    def _next(self, going: Indices) -> None:
        """Look for the next anchor of some problems."""
        found, last, unit = self.found, self.found.last_value[going], self.unit[going]
        ahead = self.way[going, None] * (self.values[going] - last[:, None]) / unit[:, None]
        index = np.arange(self.values.shape[1])
        open_to = (index > self.place[going, None]) & (index < self.counts[going, None])
        open_to &= index <= (self.place + self.most)[going, None]
        within = open_to & (ahead <= self.reach[going, None])
        fresh = np.array([not self.anchors[case] for case in going.tolist()])
        at_start = open_to & (ahead == 0.0) & (index == 0)
        place = np.where(within.any(axis=1), within.shape[1] - 1 - within[:, ::-1].argmax(axis=1), -1)
        place = np.where(fresh, np.where(at_start.any(axis=1), 0, -1), place)
        value = np.where(place >= 0, self.values[going, place], last + self.way[going] * self.reach[going] * unit)
        value = np.where(fresh & (place < 0), last, value)
        guess = np.array([self._foretold(*one) for one in zip(going.tolist(), value.tolist(), strict=True)])
        states = States(guess, found.last_memory[going], found.last_branch[going])
        # the others are measured side by side with the values that they passed; near a fold that would be another orbit
        wanted = (place >= 0) & (fresh | (self.most[going] == ONE_BY_ONE) | np.isfinite(found.fold[going]))
        slots, orbits = self._sought(going, states, value, wanted)
        converged = orbits.outcome == CONVERGED
        fits = converged.copy()
        for i in np.flatnonzero(fits).tolist():
            fits[i] = is_stable(orbits.monodromy[i])
        fits &= fresh | self._continues(going, value, slots.x, orbits.slope, guess)
        astray = np.abs(slots.x - guess).max(axis=1)
        self._refuse(going[~fits], value[~fits], np.where(converged, astray, np.inf)[~fits])
        for i in np.flatnonzero(fits).tolist():
            self._take(int(going[i]), int(place[i]), i, slots, orbits, astray[i])
            if wanted[i]:
                self.keep(int(going[i]), int(place[i]), i, slots, orbits)
        self.going[going] &= self.found.outcome[going] == FOLLOWED
        self.going[going] &= self.place[going] < self.counts[going] - 1

    def _sought(
        self, cases: Indices, states: States, value: Array, wanted: Bools, at_once: bool = False
    ) -> tuple[Slots, Orbits]:
        """Return the orbits that are found near states of some problems; the wanted ones are measured."""
        slots, orbits = self.block.slots(states, value, self.repeats), empty_orbits(len(cases), states.x.shape[1])
        slots.wanted[:] = np.where(wanted, ALL, NOTHING)
        self.block.find(self.which[cases], slots, orbits, self.repeats, at_once)
        return slots, orbits

    def _foretold(self, case: int, value: float) -> Array:
        """Return the state at a value by the cubic through the last anchor and one far enough before, or by a line.

        From anchors close together their small errors would be foretold, many times as large.
        """
        if not self.anchors[case]:
            return np.asarray(self.found.last_x[case])
        *before, last = self.anchors[case]
        way = abs(value - last.value)
        far = [one for one in reversed(before) if abs(one.value - last.value) >= APART * way][:1] or before[:1]
        is_far = not far or way > FARTHEST * abs(last.value - far[0].value)
        return self._through([last] if is_far else [last, *far], case, value)

    def _through(self, anchors: list[Anchor], case: int, value: float) -> Array:
        """Return the state at a value by the polynomial through anchors and their slopes."""
        away = np.array([(one.value - value) / self.unit[case] for one in anchors])
        return hermite(away, np.array([one.x for one in anchors]), np.array([one.slope for one in anchors]))

    def _continues(self, going: Indices, value: Array, here: Array, slopes: Array, guess: Array) -> Bools:
        """Return which orbits continue the last orbits of their problems in value, state and slope."""
        found = self.found
        x, slope = found.last_x[going], found.last_slope[going]
        step = ((value - found.last_value[going]) / self.unit[going])[:, None]
        moved = here - x
        with np.errstate(invalid="ignore"):
            astray, chord = np.abs(here - guess).max(axis=1), np.abs(moved).max(axis=1)
            turned = np.abs(step * (slopes - slope)).max(axis=1)
            bent = np.abs(moved - 0.5 * step * (slopes + slope)).max(axis=1)
            steepest = np.maximum(np.abs(slopes).max(axis=1), np.abs(slope).max(axis=1))
            near = (chord < CHORD) & (bent < BENT * np.abs(step[:, 0]) * steepest)
            return np.asarray((turned < TURNED) & ((astray < self.block.predicted) | near))

    def _fitting(self, astray: Any) -> Any:
        """Return by which factor a step changes whose orbit was so far from its prediction, of the fourth order."""
        return (AIMED * self.block.predicted / np.maximum(astray, 1e-300)) ** 0.25

    def _refuse(self, cases: Indices, value: Array, astray: Array) -> None:
        """Shorten the steps of problems whose orbits do not continue the last ones; end their states where there are none."""
        ended = np.array([not self.anchors[case] for case in cases.tolist()], dtype=bool)
        shorter = np.clip(self._fitting(astray), SHRINK, SHORTER)
        self.reach[cases] = shorter * np.abs(value - self.found.last_value[cases]) / self.unit[cases]
        ended |= self.reach[cases] < SMALLEST
        self.found.outcome[cases[ended]] = ENDED

    def _take(self, case: int, place: int, i: int, slots: Slots, orbits: Orbits, astray: float) -> None:
        """Make an orbit the next anchor of a problem."""
        found, begun = self.found, float(self.found.last_value[case])
        slopes = float(np.abs(orbits.slope[i]).max()), float(np.abs(found.last_slope[case]).max())
        found.fold[case] = fold_ahead(float(slots.value[i]), slopes[0], begun, slopes[1])
        found.last_value[case], found.last_x[case] = slots.value[i], slots.x[i]
        found.last_memory[case], found.last_branch[case] = slots.memory[i], slots.branch[i]
        found.last_slope[case], found.last_monodromy[case] = orbits.slope[i], orbits.monodromy[i]
        if place >= 0:
            self.place[case] = place
        if self.anchors[case]:
            step = abs(slots.value[i] - begun) / self.unit[case]
            fitting = self._fitting(astray)
            longer = step * max(1.0, fitting) if fitting < GROWTH else max(self.reach[case], GROWTH * step)
            self.reach[case] = longer if astray < EXACT else min(LARGEST, longer)
        state = slots.x[i], orbits.slope[i], slots.memory[i], slots.branch[i]
        self.anchors[case].append(Anchor(float(slots.value[i]), *state, int(self.place[case])))

    def keep(self, case: int, place: int, i: int, slots: Slots, orbits: Orbits) -> None:
        """Keep an orbit at a value of its path."""
        found, where = self.found, (case, place)
        found.x[where], found.memory[where], found.branch[where] = slots.x[i], slots.memory[i], slots.branch[i]
        found.monodromy[where], found.rows[where] = orbits.monodromy[i], slots.rows[i]
        found.residual[where], found.steps[where] = orbits.residual[i], orbits.steps[i]

    def _fill(self) -> bool:
        """Find the orbits that steps have passed; return whether a problem goes on from an earlier anchor."""
        found = self.found
        passed = np.isnan(found.residual) & (np.arange(self.values.shape[1]) <= self.place[:, None])
        cases, places = np.nonzero(passed)
        again = False
        for start in range(0, len(cases), ABREAST):
            case, place = cases[start : start + ABREAST], places[start : start + ABREAST]
            value = self.values[case, place]
            guesses = [self._between(*one) for one in zip(case.tolist(), place.tolist(), strict=True)]
            states = States(*(np.array(column) for column in zip(*guesses, strict=True)))
            slots, orbits = self._sought(case, states, value, np.ones(len(case), bool), at_once=True)
            with np.errstate(invalid="ignore"):
                fits = (orbits.outcome == CONVERGED) & (np.abs(slots.x - states.x).max(axis=1) < self.block.predicted)
            for i in range(len(case)):
                if fits[i] and is_stable(orbits.monodromy[i]):
                    self.keep(int(case[i]), int(place[i]), i, slots, orbits)
            self.block.check_cancelled()
        for one in range(len(self.values)):
            missing = np.flatnonzero(np.isnan(found.residual[one, : self.place[one] + 1]))
            if len(missing):
                self._go_back(one, int(missing[0]))
                again = again or bool(self.going[one])
        found.done[:] = self.place + 1
        return again

    def _between(self, case: int, place: int) -> tuple[Array, Array, Array]:
        """Return the state at a value between two anchors: by a polynomial through the nearest, with memory and branches."""
        anchors = self.anchors[case]
        after = next(k for k, anchor in enumerate(anchors) if anchor.place >= place)
        first = max(0, min(after - ANCHORS // 2, len(anchors) - ANCHORS))
        x = self._through(anchors[first : first + ANCHORS], case, float(self.values[case, place]))
        before = anchors[max(after - 1, 0)]
        return x, before.memory, before.branch

    def _go_back(self, case: int, place: int) -> None:
        """Let a problem go on from the anchor before a value whose orbit was not found, value by value."""
        found, anchors = self.found, self.anchors[case]
        after = next(k for k, anchor in enumerate(anchors) if anchor.place >= place)
        del anchors[after:]
        last = anchors[-1]
        self.most[case] = ONE_BY_ONE
        self.place[case] = last.place
        found.residual[case, last.place + 1 :] = np.nan
        found.last_value[case], found.last_x[case], found.last_slope[case] = last.value, last.x, last.slope
        found.last_memory[case], found.last_branch[case] = last.memory, last.branch
        found.outcome[case], self.going[case] = FOLLOWED, True
        self.reach[case] = min(self.reach[case], LARGEST)
