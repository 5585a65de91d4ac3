"""The steady motions of a block of problems while a parameter changes slowly: the quasi-static protocol.

A motion stays on its state as long as the state exists and is stable. Where the state ends the parameter is held, and the
motion is integrated from just beyond the end, along the unstable direction, until it settles. The new state is followed from
there. A motion that does not repeat settles in time at each value. ``quasi_static`` follows one state.

A state that was followed on the way there is reused on the way back, unless a force has a memory.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from dforce.core.arrays import Array, Indices
from dforce.solvers.accuracy import assure, assure_repeated, assure_settled, unless_stuck
from dforce.solvers.block import Block
from dforce.solvers.model import DISTANCE
from dforce.solvers.points import Points, StateJump, amplitude_at, amplitude_of, as_kept, repeated
from dforce.solvers.quasi_static import ENDED, FOLLOWED, SMALLEST, TOO_ROUGH, Stretch
from dforce.solvers.quasi_static_steps import CHORD
from dforce.solvers.settling import apart, comes_near, gone, held_back, polished, settled
from dforce.solvers.state_ends import End, Ended, Left, ahead_of, assured_places, behind_doublings, directions
from dforce.solvers.states import States
from dforce.solvers.transient import steady, still_at_rest

CHUNK = 64  # values that are followed in one stretch: at its start only the state is known, where a run can go on
AT_ONCE = 1e-4  # of the free amplitude: the motion settles to an orbit so near to the start
BEYOND = 4.0 * SMALLEST  # of the parameter's unit: distance behind the end from which the motion is sure to leave
KICK = 0.02  # of the free amplitude: how far from its end, to the side to which it leaves, a motion starts
STRIDE = 0.02  # of the parameter's unit: step between values at which motions settle in time, or a longer one:
MOST_STRIDES = 10  # from one value to the next, so that a point far from the last one costs no hours
SUDDEN = CHORD  # of the free amplitude: a smaller change is no jump, for a step may lead across it
SAME = 1e-6  # of the free amplitude: orbits so near to each other are one
MOST_ENDS = 3  # of a state in a row that goes on behind each: the map is too rough there
MOST_CYCLES = 12  # common periods after which states repeat, at most


class Walk:
    """Problems of a block on their ways along a parameter.

    Parameters
    ----------
    values
        The values (SI) in the order in which each problem comes to them, (problems, values).
    starts
        The motions to start from at the first value.
    report_done
        Called with the number of points done.

    Attributes
    ----------
    points, jumps
        The points found, and the jumps of each problem in the order in which it came to them.
    """

    def __init__(self, block: Block, values: Array, starts: States, report_done: Callable[[int], None]) -> None:
        self.block, self.values, self.report_done = block, values, report_done
        cases = len(values)
        self.points = Points.empty(block, values.shape[1])
        self.jumps: list[list[StateJump]] = [[] for _ in range(cases)]
        self.starts, self.state = starts, starts.copy()
        self.done, self.cycles = np.zeros(cases, np.int64), np.zeros(cases, np.int64)
        self.at, self.turn = values[:, 0].copy(), _turns(values)
        self.ends = np.zeros(cases, np.int64)  # of states in a row that led neither to a value nor to another state
        self.left: list[Left | None] = [None] * cases
        self.loose = np.full(cases, np.nan)  # amplitude (m) at the value before, of motions that did not repeat there
        self.stuck = np.zeros(cases, dtype=bool)  # whether the last motion was, see `unless_stuck`
        # number of the state of each point; the states before and behind an end have different numbers
        self.state_of, self.number = np.full(values.shape, -1), np.zeros(cases, np.int64)

    def go_on_from(self, done: int, cycles: int, amplitude: float) -> None:
        """Go on with motions that were found at the value before place `done`.

        They repeat after so many common periods, or do not: then `cycles` is 0. The amplitude (m) is the first tone's.
        """
        self.done[:], self.cycles[:], self.at = done, cycles, self.values[:, done - 1].copy()
        self.loose[:] = np.nan if cycles > 0 else amplitude

    def run(self) -> None:
        """Find the steady motions at all values that are left."""
        self.reported = int(self.done.sum())
        fresh = np.flatnonzero(self.done == 0)
        if len(fresh):
            self._begin(fresh)
        while True:
            going = np.flatnonzero(self.done < self.values.shape[1])
            if not len(going):
                return
            self.block.check_cancelled()
            at_start = going[self.done[going] % CHUNK == 0]
            self.state.put(at_start, as_kept(self.block, at_start, self.state.take(at_start), self.at[at_start]))
            back = going[(self.done[going] >= self.turn[going]) & (self.cycles[going] == 1)]
            if len(back) and self.block.is_smooth:
                self._take_over(back)
                going = going[self.done[going] < self.values.shape[1]]
            of_going = self.cycles[going]  # a copy: while some go on, others may come to repeat after as many periods
            for cycles in sorted({*of_going.tolist()}):
                some = going[of_going == cycles]
                if cycles > 0:
                    self._follow(some, cycles)
                else:
                    for case in some:
                        self._in_time(int(case))
            self._report()

    def _report(self) -> None:
        """Report the points that are done since the report before."""
        new = int(self.done.sum()) - self.reported
        if new:
            self.reported += new
            self.report_done(new)

    def _begin(self, cases: Indices) -> None:
        """Find the states that the starts settle to at the first values."""
        here = self.values[cases, 0]
        start = self.state.take(cases)
        found = polished(self.block, cases, start, here)
        near = (found.done == 1) & (apart(found.last_x, start.x) < AT_ONCE)
        self._keep_first(cases, found, near, np.zeros(len(cases)))
        left = cases[~near]
        if len(left):
            found, good, periods = self._settled(left, self.state.take(left), here[~near])
            self._keep_first(left, found, good, periods)
            for case in left[~good]:
                self._in_time(int(case))
        self._report()

    def _keep_first(self, cases: Indices, found: Stretch, good: Any, periods: Array) -> None:
        which = np.flatnonzero(good)
        self._store(cases, found, which, np.minimum(found.done, 1), 1)
        self.points.settling[cases[which], 0] = periods[which]
        self.cycles[cases[which]] = 1

    def _settled(self, cases: Indices, start: States, at: Array) -> tuple[Stretch, Any, Array]:
        """Return the orbits on which motions settle, which of them are sure, and how many periods it took."""
        state, found, good, periods = settled(self.block, cases, start, at)
        self.state.put(cases, state)
        return found, good, periods

    def _follow(self, cases: Indices, cycles: int) -> None:
        """Follow states to the end of the stretch, or of the state."""
        done = self.done[cases]
        turn = np.where(done < self.turn[cases], self.turn[cases], self.values.shape[1])
        stop = np.minimum((done // CHUNK + 1) * CHUNK, turn)
        # from between two values it may step back to the next value, whose state the way there may have
        counts = np.where(self.at[cases] == self.values[cases, done - 1], stop - done, 1)
        places = done[:, None] + np.minimum(np.arange(counts.max()), counts[:, None] - 1)
        values = self.values[cases[:, None], places]

        def keep(found: Stretch) -> None:
            if cycles == 1:  # others may come to repeat after half the periods
                self._store(cases, found, np.arange(len(cases)), found.done, cycles, done)
                self._report()

        found = self.block.follow(cases, self.state.take(cases), self.at[cases], values, counts, cycles, keep)
        halved = np.zeros(len(cases), dtype=bool)
        if cycles > 1:
            for i in range(len(cases)):
                halved[i] = self._halve(cases, found, i, values[i], cycles)
        self._store(cases, found, np.flatnonzero(~halved), found.done, cycles, done)
        ended = np.flatnonzero((found.outcome == ENDED) & ~halved)
        if len(ended):
            targets = values[ended, np.minimum(found.done[ended], counts[ended] - 1)]
            self._leave(cases[ended], found.take(ended), targets, cycles)
        lost = (found.outcome == TOO_ROUGH) | (self.ends[cases] > MOST_ENDS)
        for case in cases[lost & (self.cycles[cases] > 0) & ~halved].tolist():
            self.loose[case] = amplitude_at(self.block, case, self.state.motion(case), self.at[case], cycles)
            self.cycles[case] = 0
        self.number[cases[(found.outcome != FOLLOWED) | halved]] += 1

    def _take_over(self, cases: Indices) -> None:
        """Take over from the way there the points that the way back comes to on the same state."""
        points, there = self.points, slice(0, int(self.turn[cases].max()))
        assure(self.block, self.values[:, there], points[there])
        is_orbit = points.is_orbit
        for case in cases.tolist():
            values, done, at = self.values[case], int(self.done[case]), self.at[case]
            here = np.flatnonzero((values[:done] == at) & is_orbit[case, :done])[:1]
            if not len(here) or apart(points.states.x[case, here], self.state.x[[case]])[0] > SAME:
                continue
            first = int(here[0]) - int(values[done] != at)
            places = np.arange(first, -1, -1)[: len(values) - done]
            same = values[done : done + len(places)] == values[places]
            same &= self.state_of[case, places] == self.state_of[case, here[0]]
            count = int(np.argmin(np.append(same, False)))
            if count:
                new = slice(done, done + count)
                points.repeat(case, places[:count], new)
                self.state_of[case, new] = self.state_of[case, here[0]]
                self.done[case], self.at[case] = new.stop, values[new.stop - 1]
                self.state.put(case, points.states.take((case, new.stop - 1)))

    def _halve(self, cases: Indices, found: Stretch, i: int, values: Array, cycles: int) -> bool:
        """Halve the periods where orbits repeat after half of them, as behind a reversed period doubling; return whether."""
        case, done = int(cases[i]), int(found.done[i])
        x = np.append(found.x[i, :done], found.last_x[i : i + 1], axis=0)
        memory = np.append(found.memory[i, :done], found.last_memory[i : i + 1], axis=0)
        branch = np.append(found.branch[i, :done], found.last_branch[i : i + 1], axis=0)
        at, states = np.append(values[:done], found.last_value[i]), States(x, memory, branch)
        after = self.block.advance(np.full(len(at), case), states, at, cycles // 2)
        same = np.flatnonzero(apart(after.x, x) < SAME)
        if not len(same):
            return False
        first = int(same[0])
        self._store(cases, found, np.array([i]), np.full(len(cases), first), cycles)
        self.state.put(np.array([case]), states.take([first]))
        self.at[case], self.cycles[case] = at[first], cycles // 2
        return True

    def _store(
        self, cases: Indices, found: Stretch, which: Indices, counts: Indices, cycles: int, begun: Indices | None = None
    ) -> None:
        """Keep orbits found from the next place of each problem on, and go to the last of them.

        `begun` are the places of the first orbits found, of which some may be kept already.
        """
        points = self.points
        for i in which.tolist():
            case = int(cases[i])
            kept = 0 if begun is None else int(self.done[case] - begun[i])
            count, new = int(counts[i]) - kept, slice(kept, int(counts[i]))
            where = (case, slice(int(self.done[case]), int(self.done[case]) + count))
            self.state_of[where] = self.number[case]
            states = States(found.x[i, new], found.memory[i, new], found.branch[i, new])
            points.states.put(where, states)
            points.cycles[where] = cycles
            if cycles == 1:
                points.rows[where], points.monodromy[where] = found.rows[i, new], found.monodromy[i, new]
                points.residual[where], points.steps[where] = found.residual[i, new], found.steps[i, new]
                points.settling[where] = 0.0
            else:
                for k in range(count):
                    place = int(self.done[case]) + k
                    value = float(self.values[case, place])
                    alone, one = self.block.one(case), repeated(self.block, case, value, found, (i, k))
                    points.others[case, place] = found_again = assure_repeated(alone, value, one, cycles)
                    points.stays[case, place] = found_again.stays
            self.done[case] += count
            self.ends[case] = 0 if count else self.ends[case]
            if np.isfinite(found.last_monodromy[i]).all():
                self.state.put(case, States.last_of(found).take(i))
                self.at[case] = found.last_value[i]

    def _leave(self, cases: Indices, ends: Stretch, targets: Array, cycles: int) -> None:
        """Integrate away from the ends of states, until each motion is on another one; behind a doubling that is at hand.

        A motion starts just behind the end, a little to the side on which it leaves. It notes a jump, unless it comes to the
        state where that ended: then the state goes on.
        """
        unit = self.block.unit[cases]
        known = np.isfinite(ends.last_monodromy).all(axis=(1, 2))
        last = States.last_of(ends)
        way = np.sign(targets - ends.last_value)
        doubling, folding, aside = directions(ends, way)
        left = np.ones(len(cases), dtype=bool)
        doubling &= known & (2 * cycles <= MOST_CYCLES)
        for i, at, state in behind_doublings(self.block, cases, ends, way, aside, np.flatnonzero(doubling), cycles):
            left[i] = False
            self.state.put(cases[[i]], state)
            self.at[cases[i]], self.cycles[cases[i]] = at, 2 * cycles
        rest = np.flatnonzero(left)
        if not len(rest):
            return
        cases, unit, way, targets = cases[rest], unit[rest], way[rest], targets[rest]
        ends, last, aside = ends.take(rest), last.take(rest), aside[rest]
        ahead = ahead_of(ends, way, folding[rest], unit)
        place = ends.last_value + way * ahead
        beyond = place + way * BEYOND * unit
        beyond = np.where(way * (targets - beyond) < 0.0, targets, beyond)
        start = last.copy()
        start.x[:] += KICK * aside
        away = start if self.block.is_smooth else gone(self.block, cases, start, last, beyond)
        self.state.put(cases, away)
        self.at[cases], self.cycles[cases] = beyond, 0
        self.ends[cases] += 1
        found, good, _ = self._settled(cases, away, beyond)
        # up to a fold the state moves like the root of the way that is left: by twice its slope
        edge = last.x + 2.0 * ends.last_slope * (way * ahead / unit)[:, None]
        goes_on = good & (np.nan_to_num(np.abs(found.last_x - edge), nan=np.inf).max(axis=1) <= SUDDEN)
        some = np.flatnonzero(~goes_on & np.isfinite(self.state.x[cases]).all(axis=1))
        before = cases, self.done[cases] - 1
        those = Ended(cases, ends, place, way, self.points.states.take(before), self.values[before], targets, cycles)
        exact, errors = assured_places(self.block, those.take(some))
        for i, at, error in zip(some.tolist(), exact.tolist(), errors.tolist(), strict=True):
            end = End(last.motion(i), float(ends.last_value[i]), edge[i], at, cycles, error)
            self._note_jump(int(cases[i]), end, found.rows[i, 0] if good[i] else None)
        self.cycles[cases[good]] = 1
        self.state.put(cases[good], States.last_of(found).take(good))

    def _note_jump(self, case: int, end: End, landed: Array | None) -> None:
        """Note a sudden change of state to an orbit with `landed` measured on it; a motion on no orbit is waited for."""
        value = float(self.at[case])
        # measured anew: beside a fold Newton's method may find no stable orbit from the last one itself
        first = amplitude_at(self.block, case, end.last, end.value, end.cycles)
        if landed is None:
            self.left[case] = Left(end, first, value, self.state.motion(case))
        else:
            self._note(case, end, first, amplitude_of(self.block, case, value, landed), value)
            self.ends[case] = 0

    def _in_time(self, case: int) -> None:
        """Let a motion settle in time at its next value, or on the way there, and look for a stable orbit."""
        block, points, place, before = self.block, self.points, int(self.done[case]), float(self.at[case])
        target = float(self.values[case, place])
        far = abs(target - float(self.values[case, max(place - 1, 0)]))
        stride = math.inf if self.stuck[case] else max(STRIDE * float(block.unit[case]), far / MOST_STRIDES)
        known = bool(np.isfinite(self.state.x[case]).all())
        value = before + min(max(target - before, -stride), stride) if known and place > 0 else target
        start, integrator = (self.state if known else self.starts).take([case]), block.integrator(case, value)
        held = known and bool(self.stuck[case]) and block.parameter == DISTANCE
        start = held_back(block, case, start, before, value) if held else start
        found = still_at_rest(integrator, start.motion(0), block.check_cancelled) if held else None
        found = found or steady(integrator, start.motion(0), block.check_cancelled)
        found = unless_stuck(block.one(case), value, found, bool(self.stuck[case]))
        one, at, motion = np.array([case]), np.array([value]), States.of(found.motion)
        self.state.put(one, motion)
        self.at[case], self.cycles[case], self.stuck[case] = value, 0, found.stays
        self.number[case] += 1
        for cycles in self._returns(case, motion, value) if found.motion.is_finite and not found.stays else ():
            orbit = polished(self.block, one, motion, at, cycles)
            if orbit.done[0] == 1 and apart(orbit.last_x, motion.x)[0] < AT_ONCE:
                self._note_capture(case, before, value, orbit, cycles)
                self.cycles[case], self.loose[case] = cycles, np.nan
                if value == target:
                    self._store(one, orbit, np.array([0]), orbit.done, cycles)
                    points.settling[case, place] = found.values["settling_periods"]
                else:
                    self.state.put(one, States.last_of(orbit))
                return
        self._note_loss(case)
        if value == target:
            found = assure_settled(block.one(case), value, found, settles_on=False)
            points.put_other(case, place, found)
            self.done[case], self.ends[case] = self.done[case] + 1, 0  # a run that goes on from here has no ends
        amplitude = float(found.values["amplitude"][0])
        self._note_change(case, before, value, amplitude, amplitude, value)
        self.loose[case] = amplitude

    def _returns(self, case: int, motion: States, value: float) -> Iterator[int]:
        """Give the numbers of common periods after which a motion is back, or all but back."""
        one, at, later = np.array([case]), np.array([value]), motion
        for cycles in range(1, MOST_CYCLES + 1):
            later = self.block.advance(one, later, at, 1)
            if apart(later.x, motion.x)[0] < AT_ONCE:
                yield cycles

    def _note_capture(self, case: int, before: float, value: float, orbit: Stretch, cycles: int) -> None:
        """Note a jump to an orbit from a state that ended, or from a motion that did not repeat at the value before.

        The orbit is followed back to where the motion came from. Where it ends on the way there, the motion came from no orbit.
        """
        left, block, one = self.left[case], self.block, np.array([case])
        if left is None and (value == before or np.isnan(self.loose[case])):
            return
        back = block.follow(one, States.last_of(orbit), np.array([value]), np.array([[before]]), repeats=cycles)
        at = float(back.last_value[0])
        there = amplitude_at(block, case, States.last_of(back).motion(0), at, cycles)
        if left is not None and back.done[0] == 1:
            self.left[case] = None
            if not comes_near(block, case, back, left.end.edge, SUDDEN, cycles):
                self._note(case, left.end, left.amplitude, there, value)
            return
        self._note_loss(case)
        after = amplitude_at(block, case, States.last_of(orbit).motion(0), value, cycles)
        self._note_change(case, before, value, after, there, at)

    def _note_loss(self, case: int) -> None:
        """Note a jump from a state that ended, where its motion comes to no orbit: both are compared beside the end."""
        left, block, self.left[case] = self.left[case], self.block, None
        if left is None:
            return
        found = steady(block.integrator(case, left.at), left.motion, block.check_cancelled)
        self.loose[case] = amplitude = float(found.values["amplitude"][0])
        if abs(amplitude - left.amplitude) > SUDDEN * block.batch.length[case]:
            self._note(case, left.end, left.amplitude, amplitude, left.at)

    def _note_change(self, case: int, before: float, value: float, after: float, there: float, at: float) -> None:
        """Note a jump to the amplitude `after` (m) from a motion that did not repeat at the value before.

        That is one if `there`, the amplitude at a value on the way, is farther off than a state may move on the way, twice.
        """
        last, unit = float(self.loose[case]), float(self.block.unit[case])
        if abs(there - last) > (SUDDEN + 2.0 * abs(at - before) / unit) * self.block.batch.length[case]:
            error = 0.5 * abs(value - before) / unit
            self.jumps[case].append(StateJump(0.5 * (before + value), last, after, value > before, error))

    def _note(self, case: int, end: End, before: float, after: float, value: float) -> None:
        """Note a jump from the end of a state, with the amplitudes (m) there and at the value of the parameter behind."""
        self.jumps[case].append(StateJump(end.place, before, after, value > end.value, end.error))


def _turns(values: Array) -> Indices:
    """Return the place of each row at which the values turn back, or stay; their number where they never do."""
    steps = np.diff(values, axis=1, append=values[:, -1:])
    return np.asarray(np.argmax(steps * steps[:, :1] <= 0.0, axis=1) + 1)
