"""Problems side by side on the engine: adaptive steps, derivatives carried along, Newton's method in NumPy over slots."""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.core.errors import ParameterError
from dforce.engine.marching import Marched, Marcher
from dforce.kernel import Array
from dforce.kernel.codegen import CONTACT, FIRST_MODE, PER_MODE
from dforce.solvers.block import DISTANCE, ENDED, FOLLOWED, Block
from dforce.solvers.period_map import Slots
from dforce.solvers.problem_batch import Indices
from dforce.solvers.quasi_static import (
    BENT,
    CHORD,
    EXACT,
    FARTHEST,
    FIRST,
    GROWTH,
    LARGEST,
    SHRINK,
    SMALLEST,
    TURNED,
    Branch,
    fold_ahead,
)
from dforce.solvers.relaxation import CORRECTED, SAFETY
from dforce.solvers.relaxation import LONGEST as LONGEST_LEAP
from dforce.solvers.stability import is_stable
from dforce.solvers.states import States

MOTION, COLUMNS, HARMONIC = 0.3, 0.3, 0.1  # of the accuracy times a mode's damping: error of a step; see `_tolerance`
ACCURACY = 1e-4  # where none is promised
NEARBY = 1e-5  # of the free amplitude: Newton step from which the derivatives are those of the orbit
ACCEPTED = 3e-3  # of the accuracy: Newton step, in free amplitudes, at which an orbit is accepted
LONG = 0.3  # of the free amplitude: longest Newton step
CONTRACTS, MOST_STEPS, MOST_PASSES = 0.5, 10, 6
AHEAD = 16  # orbits of one problem that are looked for at once
BESIDE = 1e-4  # of the unit of the parameter, or of the free amplitude: neighbors, where differences give derivatives
REPEATED, MOST_REPEATS = 1e-8, 200  # of its scale: change of a memory that repeats; periods that it gets for that


class EngineBlock(Block):
    """Problems that differ in numbers only, on the engine."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        if self.late:
            raise ParameterError('solver.integrator = engine does not take fluid = "history"; write integrator = "rk4"')
        self.marcher = Marcher.of(self.lot.example, self.harmonics, self.common)
        self._fineness = 1.0

    def finer(self, points: int) -> Block:
        """Return the block with smaller errors: as many times smaller as RK4 of order 6 would have them with these samples."""
        block = super().finer(points)
        assert isinstance(block, EngineBlock)
        block._fineness = self._fineness * (points / self.points) ** 6
        return block

    # marching

    def _tolerance(self, numbers: Array) -> Array:
        """Return the tolerances of motions: their errors add up over as many periods as the slowest mode rings."""
        modes = numbers[:, FIRST_MODE : FIRST_MODE + PER_MODE * self.modes].reshape(len(numbers), -1, PER_MODE)
        damping = np.minimum(modes[:, :, 1].min(axis=1), 1.0)
        accuracy = (self.settings.accuracy or ACCURACY) / self._fineness
        return np.stack([MOTION * accuracy * damping, COLUMNS * damping, np.full(len(damping), HARMONIC * accuracy)], axis=1)

    def marched(
        self, which: Indices, states: States, at: Array, repeats: int = 1, derived: bool = False, measured: bool = False
    ) -> tuple[Marched, Array]:
        """March motions over so many common periods; return where they end and derivatives, (motions, size, size + 1).

        The last column is by the parameter (per unit). Where a force has memory, it is carried on until it repeats: that is
        the map which Newton's method solves.
        """
        numbers, tones = self.tables_of(which, at)
        if self.parameter == DISTANCE:
            numbers[:, 0] = at
        kinks = np.sort(np.concatenate([self.lot.kinks[which], numbers[:, CONTACT : CONTACT + 1]], axis=1), axis=1)
        kinks[:, 1:][kinks[:, 1:] == kinks[:, :-1]] = np.inf  # each once
        kinks = np.sort(kinks, axis=1)
        by_columns = derived and len(self.memory_scale) == 0
        direct = self.parameter == DISTANCE and self.lot.levers is None
        out = self.marcher.march(
            numbers, tones, kinks, (states.x, states.memory, states.branch), self._tolerance(numbers), repeats,
            self.unit[which] if by_columns else None, measured,
        )  # fmt: skip
        if not derived:
            return out, out.columns
        if by_columns and direct:
            return out, out.columns
        derivatives = np.empty((len(which), self.size, self.size + 1))
        if by_columns:
            derivatives[...] = out.columns
        else:
            for k in range(self.size):
                moved = states.copy()
                moved.x[:, k] += BESIDE
                derivatives[:, :, k] = (self._settled_memory(which, moved, at, out, repeats) - out.x) / BESIDE
        there = at + BESIDE * self.unit[which]
        if by_columns:
            derivatives[:, :, -1] = (self.marched(which, states, there, repeats)[0].x - out.x) / BESIDE
        else:
            derivatives[:, :, -1] = (self._settled_memory(which, states, there, out, repeats) - out.x) / BESIDE
        return out, derivatives

    def _settled_memory(self, which: Indices, states: States, at: Array, first: Marched, repeats: int) -> Array:
        """Return where motions end once the forces' memory repeats, which begins as another one left it."""
        memory, branch = first.memory, first.branch
        for _ in range(MOST_REPEATS):
            out, _ = self.marched(which, States(states.x, memory, branch), at, repeats)
            change = np.abs(out.memory - memory) / self.memory_scale
            memory, branch = out.memory, out.branch
            if not change.max(initial=0.0) > REPEATED:
                break
        return out.x

    def advance(self, which: Indices, states: States, at: Array, periods: int) -> States:
        """Return states so many common periods later."""
        out = states.copy()
        for done in range(0, periods, 16):
            marched, _ = self.marched(which, out, at, min(16, periods - done))
            out = States(marched.x, marched.memory, marched.branch)
            self.watch()
        return out

    def march(self, slots: Slots, repeats: int = 1, measured: bool = False) -> None:
        """Advance motions of the first problem by so many common periods, and measure them if asked for."""
        which, states = np.zeros(len(slots.case), np.int64), States(slots.x, slots.memory, slots.branch)
        out, _ = self.marched(which, states, slots.value, repeats, measured=measured)
        slots.ends[:, 0], slots.memory_after[:], slots.branch_after[:] = out.x, out.memory, out.branch
        if measured:
            slots.rows[:] = out.rows

    # Newton's method

    def orbits(self, which: Indices, states: States, at: Array, wanted: Any, repeats: int = 1) -> dict[str, Array]:
        """Return the orbits that Newton's method finds near states, at values of the parameter.

        With P the map and M its derivative the step dx solves (1 - M) dx = P(x) - x. From NEARBY on M stays, and the last
        march measures those that are `wanted`.
        """
        count, size, periods = len(which), self.size, self.common * repeats
        accepted = ACCEPTED * min(self.settings.accuracy or ACCURACY, ACCURACY) / min(self._fineness, 10.0)
        found: dict[str, Any] = {
            "states": states.copy(), "good": np.zeros(count, bool), "steps": np.zeros(count, np.int64),
            "monodromy": np.full((count, size, size), np.nan), "slope": np.full((count, size), np.nan),
            "residual": np.full(count, np.nan), "rows": np.full((count, periods, self.columns), np.nan),
        }  # fmt: skip
        before: Array = np.full(count, np.inf)
        state = found["states"]
        going = np.arange(count)
        near: list[Indices] = []
        for _ in range(MOST_STEPS):
            if not len(going):
                break
            out, derivatives = self.marched(which[going], state.take(going), at[going], repeats, derived=True)
            miss, M = out.x - state.x[going], derivatives[:, :, :size]
            both = np.stack([miss, derivatives[:, :, size]], axis=2)
            step, slope, regular = _solve(M, both)
            length = np.abs(step).max(axis=1)
            good = regular & (length < np.inf) & ~((length > CONTRACTS * before[going]) & (length > NEARBY))
            share = np.minimum(1.0, LONG / np.maximum(length, 1e-300))
            going, M, slope, step, length, share = (array[good] for array in (going, M, slope, step, length, share))
            found["steps"][going] += 1
            found["monodromy"][going], found["slope"][going] = M, slope
            state.x[going] += share[:, None] * step
            state.memory[going], state.branch[going] = out.memory[good], out.branch[good]
            before[going] = np.where(share == 1.0, length, np.inf)
            near.append(going[length < NEARBY])
            going = going[~(length < NEARBY)]
        going = np.concatenate(near) if near else going[:0]
        before[:] = np.inf
        for _ in range(MOST_PASSES if not len(self.memory_scale) else MOST_REPEATS):
            if not len(going):
                break
            measured = bool(np.any(wanted[going]))
            out, _ = self.marched(which[going], state.take(going), at[going], repeats, measured=measured)
            miss = out.x - state.x[going]
            step, _, _ = _solve(found["monodromy"][going], np.stack([miss, miss], axis=2))
            length = np.abs(step).max(axis=1)
            rest = (np.abs(out.memory - state.memory[going]) / self.memory_scale).max(axis=1, initial=0.0)
            rest = np.where((out.branch == state.branch[going]).all(axis=1), rest, np.inf)
            found["residual"][going] = np.maximum(np.abs(miss).max(axis=1), rest)
            if measured:
                found["rows"][going] = out.rows
            state.x[going] += step
            state.memory[going], state.branch[going] = out.memory, out.branch
            done = (length < accepted) & (rest < 1e-6)
            found["good"][going[done]] = True
            lost = ~(length < NEARBY) | ((length > CONTRACTS * before[going]) & (rest < 1e-6))
            before[going] = length
            going = going[~done & ~lost]
        return found

    # following

    def follow(
        self, which: Indices, starts: States, at: Array, values: Array, counts: Indices | None = None, repeats: int = 1
    ) -> Branch:
        """Follow the stable orbit near each start, `at` a value of the parameter, along `values` (problems, values).

        See ``quasi_static``: cubics through the last two orbits predict, steps are accepted where the orbit is stable and
        continues the one before, and a state that has no step as short as SMALLEST has ended.
        """
        cases, total = values.shape
        counts = np.full(cases, total, dtype=np.int64) if counts is None else counts
        found = self._new_branch(starts, at, cases, total, repeats)
        ways = [_Way(float(at[case]), starts.x[case]) for case in range(cases)]
        ahead = max(1, AHEAD // cases)
        while True:
            ask = []
            for case, way in enumerate(ways):
                if way.going:
                    ask += way.asked(case, values[case, : counts[case]], int(found.done[case]), float(self.unit[which[case]]), ahead)
            if not ask:
                return found
            case = np.array([one[0] for one in ask])
            value, place = np.array([one[1] for one in ask]), np.array([one[2] for one in ask])
            guess = np.array([one[3] for one in ask])
            start = States(guess.copy(), found.last_memory[case].copy(), found.last_branch[case].copy())
            orbits = self.orbits(which[case], start, value, place >= 0, repeats)
            stable = np.array([good and is_stable(M) for good, M in zip(orbits["good"], orbits["monodromy"], strict=True)])
            for one in np.unique(case):
                mine = np.flatnonzero(case == one)
                self._accept(int(one), ways[one], mine, value, place, guess, orbits, stable, found, counts)
            self.watch()

    def _accept(
        self, case: int, way: _Way, mine: Indices, value: Array, place: Indices, guess: Array, orbits: dict[str, Any],
        stable: Any, found: Branch, counts: Indices,
    ) -> None:  # fmt: skip
        """Take the orbits of one problem that continue the last one, and decide how far to go next."""
        unit, begun, refused, fresh = way.unit, way.value, False, way.fresh
        states = orbits["states"]
        astray = 0.0
        last = (way.value, way.x, way.slope)
        for s in mine.tolist():
            x, slope = states.x[s], orbits["slope"][s]
            fits = bool(stable[s])
            if fits and not fresh:
                fits = _continues(value[s], x, slope, last, guess[s], unit, self.predicted)
            if not fits:
                refused = True
                if fresh:
                    way.going, found.outcome[case] = False, ENDED
                else:
                    way.reach = SHRINK * abs(value[s] - way.value) / unit
                break
            astray = float(np.abs(x - guess[s]).max())
            if not fresh and way.value == begun:
                way.before = (way.value, way.x, way.slope)
            found.fold[case] = fold_ahead(
                float(value[s]), float(np.abs(slope).max()), float(found.last_value[case]),
                float(np.abs(found.last_slope[case]).max()),
            )  # fmt: skip
            way.value, way.x, way.slope = float(value[s]), x.copy(), slope.copy()
            last = (way.value, way.x, way.slope)
            found.last_value[case], found.last_x[case], found.last_slope[case] = value[s], x, slope
            found.last_memory[case], found.last_branch[case] = states.memory[s], states.branch[s]
            found.last_monodromy[case] = orbits["monodromy"][s]
            if fresh:
                way.before = (way.value, way.x, way.slope)
            if place[s] >= 0:
                k = int(place[s])
                found.x[case, k], found.memory[case, k], found.branch[case, k] = x, states.memory[s], states.branch[s]
                found.monodromy[case, k], found.rows[case, k] = orbits["monodromy"][s], orbits["rows"][s]
                found.residual[case, k], found.steps[case, k] = orbits["residual"][s], orbits["steps"][s]
                found.done[case] = k + 1
        if not refused and not fresh:
            longer = max(way.reach, GROWTH * abs(way.value - begun) / unit)
            way.reach = longer if astray < EXACT else min(LARGEST, longer)
        way.fresh = False
        if way.reach < SMALLEST and way.going:
            way.going, found.outcome[case] = False, ENDED
        if found.done[case] == counts[case]:
            way.going = False

    def _new_branch(self, starts: States, at: Array, cases: int, steps: int, repeats: int) -> Branch:
        size, states, branches = self.size, len(self.memory_scale), self.hysteresis
        shapes = ((size,), (states,), (branches,), (size, size), (self.common * repeats, self.columns), ())
        return Branch(
            *(np.full((cases, steps, *shape), np.nan) for shape in shapes),
            np.zeros((cases, steps), np.int64), np.zeros(cases, np.int64), np.full(cases, FOLLOWED, np.int64), at.astype(float),
            starts.x.copy(), starts.memory.copy(), starts.branch.copy(), np.full((cases, size, size), np.nan),
            np.zeros((cases, size)), np.full(cases, np.nan),
        )  # fmt: skip

    def remeasure(self, which: Indices, states: States, at: Array, monodromy: Array) -> Array:
        """Return what is measured on the orbits that one Newton step from some states leads to."""
        out, _ = self.marched(which, states, at)
        step, _, _ = _solve(monodromy, np.stack([out.x - states.x] * 2, axis=2))
        moved = States(states.x + step, out.memory, out.branch)
        self.watch()
        return self.marched(which, moved, at, measured=True)[0].rows

    # settling

    def relax(self, which: Indices, states: States, at: Array) -> tuple[States, Any, Array]:
        """Return where motions come to, which of them are near a stable orbit there, and the periods that it took them.

        In leaps over many periods, see ``relaxation``.
        """
        count, size = len(which), self.size
        x, change = states.x.copy(), np.zeros((count, size))
        M, span = np.zeros((count, size, size)), np.zeros(count, np.int64)
        gone, most = np.zeros(count, np.int64), self.most_periods(which)
        settled, going, tried = np.zeros(count, bool), np.arange(count), states.x.copy()
        while len(going):
            out, derivatives = self.marched(
                which[going], States(tried[going], states.memory[going], states.branch[going]), at[going], derived=True
            )
            still = []
            for g, s in enumerate(going.tolist()):
                new, ahead, moved = out.x[g] - tried[s], 1.0, np.zeros(size)
                if not np.isfinite(new).all():
                    if span[s] <= 1:
                        continue
                    ahead = 0.1
                elif span[s] > 1:
                    _, foretold = _leap(M[s], change[s], int(span[s]))
                    missed = (span[s] - 1.0) * (2.0 * span[s] - 1.0) / (6.0 * span[s])
                    moved = missed * (new - foretold)
                    ahead = SAFETY * (CORRECTED / max(float(np.abs(moved).max()), 1e-300)) ** (1.0 / 3.0)
                elif span[s] == 1:
                    ahead = 3.0
                if span[s] > 1 and ahead < SAFETY:
                    span[s] = max(1, int(span[s] * max(ahead, 0.1)))
                else:
                    gone[s] += span[s]
                    M[s] = derivatives[g, :, :size]
                    x[s] = tried[s] + moved
                    change[s] = new - moved + M[s] @ moved
                    step, _, regular = _solve(M[s][None], np.stack([change[s], change[s]], axis=1)[None])
                    if regular[0] and np.abs(step).max() < 3e-4 and is_stable(M[s]):
                        settled[s] = True
                        continue
                    if gone[s] >= most[s]:
                        continue
                    longer = int(max(span[s], 1) * min(ahead, 3.0)) if span[s] > 0 else 1
                    span[s] = max(1, min(longer, LONGEST_LEAP, most[s] - gone[s]))
                tried[s] = x[s] + _leap(M[s], change[s], int(span[s]))[0]
                still.append(s)
            going = np.array(still, dtype=np.int64)
            self.watch()
        return States(x, states.memory.copy(), states.branch.copy()), settled, np.asarray(gone * float(self.common))


class _Way:
    """How far one problem has come along its values: the last orbit, the one before, and how long the next step is."""

    def __init__(self, value: float, x: Array) -> None:
        self.value, self.x, self.slope = value, x.copy(), np.zeros(len(x))
        self.before = (value, self.x, self.slope)
        self.reach, self.fresh, self.going, self.unit = FIRST, True, True, 1.0

    def asked(self, case: int, values: Array, done: int, unit: float, ahead: int) -> list[tuple[int, float, int, Array]]:
        """Return what is looked for next: the problem, a value, its place among the values (-1: none of them) and a guess."""
        self.unit = unit
        if self.fresh:
            on_path = len(values) > 0 and values[0] == self.value
            return [(case, self.value, 0 if on_path else -1, self.x)]
        step = self.reach * unit
        near = values[done : done + ahead]
        near = near[np.cumprod(np.abs(near - self.value) <= step) > 0]
        if len(near):
            return [(case, float(value), done + k, self.predicted(value / unit)) for k, value in enumerate(near)]
        value = self.value + (step if values[done] > self.value else -step)
        return [(case, value, -1, self.predicted(value / unit))]

    def predicted(self, scaled: float) -> Array:
        """Return the state by the cubic through the last two orbits, or by a line where there is only one."""
        value, (before, x_before, slope_before) = self.value / self.unit, self.before
        span = value - before / self.unit
        if abs(scaled - value) > FARTHEST * abs(span):
            return np.asarray(self.x + self.slope * (scaled - value))
        s, rise = (scaled - value) / span, self.x - x_before
        a, b = span * self.slope, span * slope_before
        return np.asarray(self.x + s * (a + s * ((2.0 * a + b - 3.0 * rise) + s * (a + b - 2.0 * rise))))


def _continues(
    value: float, x: Array, slope: Array, last: tuple[float, Array, Array], guess: Array, unit: float, predicted: float
) -> bool:
    """Say whether an orbit continues the last one."""
    before, x_before, slope_before = last
    step = (value - before) / unit
    astray, chord = np.abs(x - guess).max(), np.abs(x - x_before).max()
    turned = np.abs(step * (slope - slope_before)).max()
    bent = np.abs(x - x_before - 0.5 * step * (slope + slope_before)).max()
    steepest = max(np.abs(slope).max(), np.abs(slope_before).max())
    near = chord < CHORD and bent < BENT * abs(step) * steepest
    return bool(turned < TURNED and (astray < predicted or near))


def _solve(M: Array, sides: Array) -> tuple[Array, Array, Any]:
    """Solve (1 - M) y = side for two sides of each motion; say where that is possible."""
    matrix = np.eye(M.shape[1]) - M
    regular = np.isfinite(M).all(axis=(1, 2)) & np.isfinite(sides).all(axis=(1, 2))
    regular &= np.abs(np.linalg.det(np.where(regular[:, None, None], matrix, 0.0))) > 0.0
    out = np.full(sides.shape, np.nan)
    if regular.any():
        out[regular] = np.linalg.solve(matrix[regular], sides[regular])
    return out[..., 0], out[..., 1], regular


def _leap(M: Array, change: Array, span: int) -> tuple[Array, Array]:
    """Return the way that a linear map leads in so many periods, and the change over the period after them."""
    power, total = np.eye(len(M)), np.zeros_like(M)
    for bit in bin(span)[2:]:
        total, power = total + power @ total, power @ power
        if bit == "1":
            total, power = M @ total + np.eye(len(M)), M @ power
    return total @ change, power @ change
