"""The steady motions of many problems at once, each along its own distances.

What each problem does is what its own run would do (``orbit`` and ``transient``): orbits are followed as far as they
exist, and where they end, or where the transient is asked for, the motion settles in time. Here this is done for a block of
problems side by side; only what cannot be done in lanes is left to the single run's solvers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dforce.kernel import Array
from dforce.observables import measure
from dforce.observables.finish import finish_each, multipliers
from dforce.problem import Problem
from dforce.solvers import SolverSettings
from dforce.solvers.find import SUDDEN, Transient
from dforce.solvers.integrator import RK4, Integrator, Motion
from dforce.solvers.kicks import HARD
from dforce.solvers.lot import Indices, Lot
from dforce.solvers.orbit import ROUGH, SAME_STATE, Follower, Jump, one_way
from dforce.solvers.shooting import AT_ONCE
from dforce.solvers.side_by_side import SideBySide, Stretch
from dforce.solvers.transient import Steady, Watch, steady

CHUNK = 64  # distances between looks at the watch
BRIDGES = (8, 64)  # parts of a step in which an orbit that was not found in one is looked for


@dataclass
class Points:
    """What was found: for each problem and distance a row of measurements, or a steady motion of the single run's kind.

    Attributes
    ----------
    rows, tangents, drift, corrections, settling
        Of the orbits found side by side, shape (problems, distances, ...).
    orbit
        Whether there is such an orbit.
    others
        The other steady motions, by problem and distance.
    """

    rows: Array
    tangents: Array
    drift: Array
    corrections: Array
    settling: Array
    orbit: np.ndarray[Any, np.dtype[np.bool_]]
    others: dict[tuple[int, int], Steady] = field(default_factory=dict)

    @classmethod
    def empty(cls, problems: int, distances: int, columns: int, size: int) -> Points:
        """Return room for so many points."""
        shape = (problems, distances)
        return cls(
            np.full((*shape, columns), np.nan), np.full((*shape, size, size), np.nan), np.full(shape, np.nan),
            np.full(shape, np.nan), np.zeros(shape), np.zeros(shape, dtype=bool),
        )  # fmt: skip

    def values(self, lot: Lot, harmonics: int) -> dict[str, Array]:
        """Return the observables of all points, (problems, distances, ...), NaN where there is none."""
        shape = self.orbit.shape
        each = [np.repeat(numbers, shape[1]) for numbers in (lot.length, lot.period, lot.a0)]
        rows = self.rows.reshape(-1, 1, self.rows.shape[-1])
        out = finish_each(lot.example, harmonics, rows, np.ones(1), *each)
        modulus, angle = multipliers(self.tangents.reshape(-1, *self.tangents.shape[2:]))
        out |= {
            "settling_periods": np.where(self.orbit, self.settling, np.nan).ravel(), "drift": self.drift.ravel(),
            "corrections": self.corrections.ravel(), "multiplier_modulus": modulus, "multiplier_angle": angle,
        }  # fmt: skip
        out = {name: value.reshape(*shape, *value.shape[1:]) for name, value in out.items()}
        for (case, at), found in self.others.items():
            for name, value in found.values.items():
                out[name][case, at] = value
        return out


class Block:
    """A block of problems that walk through their distances side by side.

    Attributes
    ----------
    points
        What was found.
    jumps
        The jumps of each problem, in the order in which it came to them.
    """

    def __init__(
        self, lot: Lot, problem: Callable[[int], Problem], settings: SolverSettings, harmonics: int, points: int,
        watch: Watch,
    ) -> None:  # fmt: skip
        """`problem` gives one of the lot's problems by its number, for what is done one by one."""
        self.lot, self.problem, self.settings, self.harmonics, self.watch = lot, problem, settings, harmonics, watch
        self.lanes = SideBySide(lot, settings, harmonics, points, watch)
        self.periodic = settings.method == "periodic"
        self.points = Points.empty(0, 0, 0, 0)
        self.jumps: list[list[Jump]] = [[] for _ in range(len(lot))]
        # of each problem: the place of its last orbit or settled transient, if none came after it, and that motion
        self._origins, self._orbits = np.full(len(lot), -1), np.empty((len(lot), self.lanes.size))
        self._alone: RK4 | None = None

    def walk(
        self, starts: Array, zc: Array, told: Callable[[int], None], carry: bool = True, near: bool = True
    ) -> None:
        """Find the steady motions, :attr:`points`, along each problem's distances `zc` (problems, distances).

        Each starts from its motion in `starts` (problems, 2 modes), and each further distance from the motion at the one
        before, or with `carry` off from the start again. `told` is called with the number of points done. With `near` off
        no orbit is looked for near the starts before they have settled.
        """
        cases, steps = zc.shape
        points = self.points = Points.empty(cases, steps, self.lanes.columns, self.lanes.size)
        y, at = starts.copy(), np.zeros(cases, np.int64)
        doubt = np.full(cases, not near)
        while True:
            todo = np.flatnonzero(at < steps)
            if not len(todo):
                return
            before = int(at.sum())
            if carry and self.periodic:
                ended = todo[(at[todo] > 0) & points.orbit[todo, at[todo] - 1]]
                self._origins[ended], self._orbits[ended] = at[ended] - 1, y[ended]
            was = at[todo]
            try:
                on_orbit = self._settle(points, todo, at, y, zc, doubt)
            finally:  # points that were found before a stop have their jumps, too
                reached = todo[at[todo] > was]
                if self.periodic:
                    self._note_jumps(points, reached[self._origins[reached] >= 0], at, y, zc)
                elif carry:
                    self._note_jumps_of_transients(points, reached, at, y, zc)
            doubt[:] = False
            lost = ~np.isfinite(y).all(axis=1)
            y[lost] = starts[lost]
            if not carry:
                y[todo] = starts[todo]
            told(int(at.sum()) - before)
            while carry and self.periodic and len(on_orbit):
                before = int(at.sum())
                on_orbit = self._go_on(points, on_orbit[at[on_orbit] < steps], at, y, zc, doubt)
                told(int(at.sum()) - before)

    def _settle(
        self, points: Points, todo: Indices, at: Indices, y: Array, zc: Array, doubt: np.ndarray[Any, Any]
    ) -> Indices:
        """Find the steady motion of some problems where they are; return those of them that are on an orbit."""
        here = zc[todo, at[todo]][:, None]
        left = np.ones(len(todo), dtype=bool)
        if self.periodic:
            tried = np.flatnonzero(~doubt[todo])
            near = self.lanes.follow(todo[tried], y[todo[tried]], here[tried])
            close = np.abs(near.orbits[:, 0] - y[todo[tried]]).max(axis=1) < AT_ONCE
            good = np.flatnonzero((near.done == 1) & close)
            self._take(points, near, good, todo[tried[good]], at, y)
            left[tried[good]] = False
        rest = np.flatnonzero(left)
        if len(rest):
            tolerance = ROUGH if self.periodic else self.settings.settle_tolerance
            rough = self.lanes.settle(todo[rest], y[todo[rest]], here[rest, 0], tolerance)
            found = self.lanes.follow(todo[rest], rough.motions, here[rest])
            apart = np.abs(found.orbits[:, 0] - rough.motions).max(axis=1)
            # the rough motion was not cut at kinks, so the orbit may lie a little off however well it has settled
            same = apart < np.maximum(SAME_STATE * rough.drift, AT_ONCE)
            good = np.flatnonzero(rough.settled & (found.done == 1) & same)
            self._take(points, found, good, todo[rest[good]], at, y, rough.periods[good])
            if not self.periodic:
                points.drift[todo[rest[good]], at[todo[rest[good]]] - 1] = rough.drift[good]
            left[rest[good]] = False
            for place in np.flatnonzero(left[rest]):
                self._alone_at(points, int(todo[rest[place]]), at, y, rough.motions[place], float(here[rest[place], 0]))
        return todo[~left]

    def _note_jumps(self, points: Points, cases: Indices, at: Indices, y: Array, zc: Array) -> None:
        """Note the jumps of problems that were on an orbit before they settled where they are now."""
        for case in cases.tolist():
            origin, now = int(self._origins[case]), int(at[case]) - 1
            alone = points.others.get((case, now))
            if alone is None or alone.settled:
                first = alone or self._as_steady(case, y[case], points.rows[case, now])
                self._note_jump(case, self._orbits[case], first, zc[case, origin : now + 1])
            if alone is None or alone.settled or not alone.motion.is_finite:
                self._origins[case] = -1

    def _note_jump(self, case: int, last: Array, first: Steady, zc: Array) -> None:
        """Note a jump from an orbit to a steady motion, if it is one, as the problem's own run would."""
        follower = Follower(self._integrator(case))
        follower.note_jump(as_motion(last), first, zc)
        self.jumps[case] += follower.jumps

    def _note_jumps_of_transients(self, points: Points, cases: Indices, at: Indices, y: Array, zc: Array) -> None:
        """Note the jumps of problems between distances at which their motion has settled, as their own runs would."""
        for case in cases.tolist():
            before, origin, now = self._orbits[case], int(self._origins[case]), int(at[case]) - 1
            alone = points.others.get((case, now))
            if alone is not None and not (alone.settled and alone.repeats):
                if not alone.motion.is_finite:
                    self._origins[case] = -1  # it starts anew
                continue
            if origin >= 0 and np.abs(y[case] - before).max() >= SUDDEN:  # else not worth an integrator
                finder = Transient(self._integrator(case))
                finder.integrator.place(float(zc[case, now]))
                finder.note_jump(as_motion(before), as_motion(y[case]), zc[case, origin : now + 1])
                self.jumps[case] += finder.jumps
            self._origins[case], self._orbits[case] = now, y[case]

    def _as_steady(self, case: int, y: Array, row: Array) -> Steady:
        """Return an orbit found side by side as the single run's kind, with its amplitude alone."""
        real, imag = row[measure.FIRST + self.lanes.size :][:2]  # behind the amplitudes of the modes
        return Steady({"amplitude": [np.hypot(real, imag) * self.lot.length[case]]}, as_motion(y), True, True)

    def _take(
        self, points: Points, found: Stretch, which: Indices, cases: Indices, at: Indices, y: Array,
        periods: Any = 0.0,
    ) -> None:  # fmt: skip
        """Store orbits found at one distance each, and go on from them."""
        where = (cases, at[cases])
        points.rows[where], points.tangents[where] = found.rows[which, 0], found.tangents[which, 0]
        points.drift[where], points.corrections[where] = found.infos[which, 0, 0], found.infos[which, 0, 1]
        points.settling[where], points.orbit[where] = periods, True
        y[cases] = found.orbits[which, 0]
        at[cases] += 1

    def _alone_at(self, points: Points, case: int, at: Indices, y: Array, rough: Array, zc: float) -> None:
        """Settle one problem by itself from a motion, as its own run would."""
        integrator = self._integrator(case)
        integrator.place(zc)
        motion = as_motion(rough)
        found = steady(integrator, motion, self.watch)
        points.others[case, int(at[case])] = found
        y[case] = found.motion.y
        at[case] += 1

    def _integrator(self, case: int) -> RK4:
        if self._alone is None:
            self._alone = RK4(self.problem(case), self.settings, self.harmonics)
        else:
            self._alone.take(self.problem(case))
        return self._alone

    def _go_on(
        self, points: Points, cases: Indices, at: Indices, y: Array, zc: Array, doubt: np.ndarray[Any, Any]
    ) -> Indices:
        """Follow orbits along the distances to come; return the problems that can go on after a look at the watch."""
        if not len(cases):
            return cases
        parts = [one_way(zc[case], int(at[case]), CHUNK) for case in cases]
        lead = np.array([int(part[0] != zc[case, at[case]]) for part, case in zip(parts, cases, strict=True)])
        counts = np.array([len(part) for part in parts])
        ways = np.empty((len(cases), counts.max()))
        for row, part in zip(ways, parts, strict=True):
            row[: len(part)], row[len(part) :] = part, part[-1]
        found = self.lanes.follow(cases, y[cases], ways, counts)
        going = []
        for place, case in enumerate(cases):
            done, first = int(found.done[place]), int(lead[place])
            last = max(done, first)
            for i in first + np.flatnonzero(found.infos[place, first:done, 4] >= HARD):
                if not self._stays(case, found.orbits[place, i - 1], found.orbits[place, i], ways[place, i]):
                    last = int(i)
                    break
                there = self._as_steady(case, found.orbits[place, i], found.rows[place, i])
                self._note_jump(case, found.orbits[place, i - 1], there, ways[place, i - 1 : i + 1])
            doubt[case] = last < done
            count = last - first
            if count > 0:
                where, these = slice(at[case], at[case] + count), slice(first, last)
                points.rows[case, where] = found.rows[place, these]
                points.tangents[case, where] = found.tangents[place, these]
                points.drift[case, where] = found.infos[place, these, 0]
                points.corrections[case, where] = found.infos[place, these, 1]
                points.orbit[case, where] = True
                y[case] = found.orbits[place, last - 1]
                at[case] += count
            if not doubt[case] and (last == counts[place] or at[case] == zc.shape[1]):
                going.append(case)
        stopped = np.array([case for case in cases if case not in set(going) and not doubt[case]], dtype=np.int64)
        bridged = self._bridge(points, stopped, at, y, zc, doubt)
        return np.concatenate([np.array(going, dtype=np.int64), bridged])

    def _stays(self, case: int, y: Array, orbit: Array, zc: float) -> bool:
        """Say whether a motion, put to another distance, settles on the orbit there that continues its state."""
        integrator = self._integrator(case)
        integrator.place(zc)
        return Follower(integrator).home(as_motion(y), as_motion(orbit)) is not None

    def _bridge(
        self, points: Points, cases: Indices, at: Indices, y: Array, zc: Array, doubt: np.ndarray[Any, Any]
    ) -> Indices:
        """Look in finer steps for the orbits that continue; return the problems where there is one."""
        reached = []
        for parts in BRIDGES:
            if not len(cases):
                break
            share = np.linspace(0.0, 1.0, parts + 1)
            low, high = zc[cases, at[cases] - 1][:, None], zc[cases, at[cases]][:, None]
            found = self.lanes.follow(cases, y[cases], low + (high - low) * share)
            for place in np.flatnonzero(found.done == parts + 1):
                case = int(cases[place])
                end = found.last()
                if self._stays(case, y[case], end.orbits[place, 0], zc[case, at[case]]):
                    self._take(points, end, np.array([place]), np.array([case]), at, y)
                    reached.append(case)
                else:
                    doubt[case] = True
            cases = cases[found.done != parts + 1]
        return np.array(reached, dtype=np.int64)


def as_motion(y: Array) -> Motion:
    """Return a scaled motion as the single run's kind."""
    return Motion(tuple(y.tolist()), np.zeros(0), np.zeros(0), 0)


def walk_alone(
    finder: Transient | Follower, start: Callable[[Integrator], Motion], zc: Array, carry: bool, watch: Watch,
    put: Callable[[int, Steady], None],
) -> None:  # fmt: skip
    """Find the steady motions of a problem that cannot be solved side by side, as its own run would.

    `start` gives the motion to start from, and `put` takes the steady motion at each of the distances `zc`.
    """
    motion, done = start(finder.integrator), 0
    while done < len(zc):
        watch()
        for found in finder.along(motion, zc[done:] if carry else zc[done : done + 1], watch):
            put(done, found)
            motion, done = found.motion, done + 1
        if not carry or not motion.is_finite:
            motion = start(finder.integrator)
