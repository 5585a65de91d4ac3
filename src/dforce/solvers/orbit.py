"""The steady motion itself: periodic orbits found by shooting and followed along the distance.

What is followed is the state that the experiment would be in: it starts from the transient's state, and where the orbit
ceases to exist or to be stable, the transient from the last stable state decides what comes next.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dforce.kernel import Array
from dforce.observables.finish import finish_all, first_amplitudes, multipliers
from dforce.observables.window import common_period, weights
from dforce.solvers.integrator import Integrator, Motion
from dforce.solvers.kicks import HARD, patience
from dforce.solvers.shooting import AT_ONCE, DOUBTED
from dforce.solvers.transient import Steady, Watch, decay_periods, march, settle, steady

MISS = 1e-9  # of the free amplitude: how far from its start an orbit may end
MOST_CORRECTIONS = 12
ORDER = 4  # of the extrapolation that predicts the next orbit from those before it, at most
EARLY = (2, 1)  # decay times after each of which an orbit near the motion is looked for, before the motion has settled
CHUNK, LEAST_CHUNK = 65_536, 16  # steps of the map between looks at the watch; distances at least
ROUGH = 1e-3  # settling tolerance before Newton's method takes over
SAME_STATE = 10.0  # times what is still to come: an orbit farther from the rough state is another one
SAME_ORBIT = 1e-5  # of the free amplitude: orbits so near to one another are one
WIDE = 0.1  # of the free amplitude: a step that moves the orbit farther, and kicks hard, may lead to another state
PARTS = 8  # into which a step is cut where the orbit is lost on the way
BRIDGES = 2  # rounds of such parts in which an orbit that was not found in one step is looked for
FINEST = PARTS**-2.9  # of the step: so exactly a jump is located at least


@dataclass(frozen=True)
class Jump:
    """A sudden change of state: at which distance (m) the old one ceased, on which way, and the amplitudes (m)."""

    zc: float
    before: float
    after: float
    direction: str


@dataclass(frozen=True)
class Orbits:
    """Steady motions found as periodic orbits, at one distance after another.

    Attributes
    ----------
    zc
        Distances (m), shape (n,).
    y, memory, latched
        Motion, memory and branches at the start of a common period, each with the distances first.
    tangents
        Derivatives of the motion one common period later by the motion, (n, size, size).
    rows
        What was measured over each period, (n, periods, columns).
    infos
        What the search says about each, see ``shooting.follow``.
    period
        At which period they start.
    settling
        Periods that were integrated before each of them.
    """

    follower: Follower
    zc: Array
    y: Array
    memory: Array
    latched: Array
    tangents: Array
    rows: Array
    infos: Array
    settling: Array
    period: int

    settled = repeats = True

    def __len__(self) -> int:
        return len(self.zc)

    def __getitem__(self, part: slice) -> Orbits:
        arrays: dict[str, Any] = {name: getattr(self, name)[part] for name in _ARRAYS}
        return replace(self, **arrays)

    def motion_at(self, i: int) -> Motion:
        """Return the state at one of the distances."""
        return Motion(tuple(self.y[i].tolist()), self.memory[i].copy(), self.latched[i].copy(), self.period)

    @property
    def motion(self) -> Motion:
        """The state to go on from."""
        return self.motion_at(-1)

    @functools.cached_property
    def columns(self) -> dict[str, Array]:
        """Observables in SI units by name, with the distances first."""
        return self.follower.finish(self)

    @property
    def amplitudes(self) -> Array:
        """Amplitude at the first tone (m)."""
        integrator = self.follower.integrator
        even = weights(self.follower.frequencies, self.follower.common or 1)
        return first_amplitudes(integrator.problem, integrator.scales, self.rows, even)

    def points(self) -> Iterator[Steady]:
        """Give each of them by itself."""
        for i in range(len(self)):
            yield Steady({name: column[i] for name, column in self.columns.items()}, self.motion_at(i), True, True)


_ARRAYS = ("zc", "y", "memory", "latched", "tangents", "rows", "infos", "settling")


def joined(*stretches: Orbits | None) -> Orbits:
    """Return stretches as one; some may be none."""
    parts = [stretch for stretch in stretches if stretch is not None]
    if len(parts) == 1:
        return parts[0]
    both: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    return replace(parts[0], **both)


class Follower:
    """Follows the steady motion of one problem from distance to distance.

    Attributes
    ----------
    jumps
        The jumps met so far.
    """

    def __init__(self, integrator: Integrator) -> None:
        self.integrator = integrator
        problem = integrator.problem
        self.frequencies = [tone.frequency for tone in problem.tones]
        self.common = common_period(self.frequencies)
        self.chunk = max(LEAST_CHUNK, CHUNK // (integrator.points * (self.common or 1)))
        self.patience = patience(sum(len(force.jumps()) for force in problem.forces))
        self.decay = math.ceil(decay_periods(problem) / (self.common or 1))
        self.jumps: list[Jump] = []
        self._found: list[Orbits] = []

    def along(self, motion: Motion, zc: Array, watch: Watch) -> Iterator[Steady]:
        """Give the steady motion at each distance (m), each started from the one before; end where it is lost."""
        for found in self.stretches(motion, zc, watch):
            yield from found.points()

    def stretches(
        self, motion: Motion, zc: Array, watch: Watch, before: float | None = None
    ) -> Iterator[Steady | Orbits]:
        """Give the same, those distances together that were solved together.

        `before` is the distance at which the motion was found, where the distances continue others.
        """
        done, doubt = 0, False
        last: Orbits | None = None  # the last orbits, on the way to the next distance
        fresh: Orbits | None = None  # one not given yet
        # the last orbit before a state was lost, the distance where it was, and the first of `zc` without: some there may
        # not settle
        origin: tuple[Orbits, float, int] | None = None
        if before is not None:
            zc, done = np.append(before, zc), 1
            found, _ = self._follow(zc[:1], motion)
            last = found if len(found) else None
        while done < len(zc):
            if fresh is None:
                watch()
            if last is None:
                self.integrator.place(float(zc[done]))
                first = self._settled(motion, watch, doubt)
                if origin is not None and first.settled:
                    end, lost, gone = origin
                    way = np.append(end.zc, zc[gone : done + 1])
                    self._note_jump(end, first, way, lost, abs(float(zc[gone] - zc[gone - 1])))
                    origin = None
                if isinstance(first, Orbits):
                    fresh = last = first  # given together with those that follow
                else:
                    yield first
                motion, done, doubt = first.motion, done + 1, True
                if not motion.is_finite:
                    return
                continue
            part = one_way(zc, done, self.chunk)
            part = part[1:] if part[0] != zc[done] else part[:1]
            if len(last) > 1 and (last.zc[-1] - last.zc[-2]) * (part[0] - last.zc[-1]) <= 0.0:
                last = last[-1:]
            found, doubted = self._follow(part, last.motion, last)
            self._note_wide_steps(joined(last[-1:], found))
            done += len(found)
            if len(found) or fresh is not None:
                self._found.append(joined(fresh, found))
                yield self._found[-1]
                fresh, last = None, joined(last[-ORDER - 1 :], found[-ORDER - 1 :])[-ORDER - 1 :]
                motion = last.motion
            if len(found) == len(part):
                continue
            end, lost, doubt = last[-1:], float(zc[done]), True
            if not doubted:
                reached, lost = self._bridge(end, float(zc[done]), BRIDGES)
                self.integrator.place(float(zc[done]))
                if reached.zc[0] != zc[done]:
                    end = reached
                elif (home := self.home(motion, reached.motion)) is not None:
                    yield home
                    done, last, motion = done + 1, home, home.motion
                    continue
            origin, last = (end, lost, done), None
        if fresh is not None:
            yield fresh

    def _settled(self, motion: Motion, watch: Watch, doubt: bool) -> Steady | Orbits:
        """Return the steady motion at the integrator's distance: at once by Newton, else after a rough settling."""
        if self.common is None:
            return steady(self.integrator, motion, watch)
        near = self._again(motion) if doubt else self.home(motion)
        if near is not None:
            return near
        begun, decay = motion.period, max(4, decay_periods(self.integrator.problem))
        span, most = self.common * math.ceil(decay / self.common), self.integrator.settings.max_periods
        for spans in EARLY:
            spans = spans if most is None else min(spans, (most - (motion.period - begun)) // span)
            if spans < 1:
                break
            motion, _ = march(self.integrator, motion, spans * span, watch)
            near = self.home(motion) if motion.is_finite else None
            if near is not None:
                return replace(near, settling=near.settling + (motion.period - begun))
        rough, settled, drift = settle(self.integrator, motion, watch, ROUGH)
        if settled:
            polished, _ = self._follow(self._here, rough)
            if len(polished) and _distance(polished.motion, rough) < SAME_STATE * max(drift, MISS):
                return replace(polished, settling=polished.settling + (rough.period - begun))
        return steady(self.integrator, rough if rough.is_finite else motion, watch)

    def _again(self, motion: Motion) -> Orbits | None:
        """Return the orbit that was found at this distance before, if the motion is sure to settle on it."""
        for orbits in self._found:
            for i in np.flatnonzero(orbits.zc == self.integrator.p[0])[:1]:
                goal = orbits.motion_at(int(i))
                if (goal.period - motion.period) % (self.common or 1) == 0:
                    return self.home(motion, replace(goal, period=motion.period))
        return None

    @property
    def _here(self) -> Array:
        """The integrator's distance."""
        return np.array([self.integrator.p[0]])

    def home(self, motion: Motion, goal: Motion | None = None) -> Orbits | None:
        """Return the orbit near a motion on which it is sure to settle, or None; `goal` is one that was found already."""
        near, _ = self._follow(self._here, goal or motion, start=motion)
        if len(near) and (goal is None or _distance(near.motion, goal) < SAME_ORBIT):
            return near
        return None

    def _follow(
        self, zc: Array, guess: Motion, known: Orbits | None = None, start: Motion | None = None, wary: bool = True
    ) -> tuple[Orbits, bool]:
        """Follow a stable orbit through the distances, from a guess or from those known before them.

        Returns
        -------
        The orbits before it ends or is not surely the one that the motion of the distance before settles on, and whether
        it was the latter; that is asked only where it is `wary`. From `start`, a motion, the first one has to be settled on.
        """
        integrator = self.integrator
        common, count, size, past = self.common or 1, len(zc), len(guess.y), 0 if known is None else len(known)
        shapes: dict[str, tuple[int, ...]] = {
            "zc": (), "y": (size,), "memory": (len(guess.memory),), "latched": (len(guess.latched),),
            "tangents": (size, size), "rows": (common, integrator.columns), "infos": (5,), "settling": (),
        }  # fmt: skip
        arrays: dict[str, Any] = {name: np.empty((past + count, *shape)) for name, shape in shapes.items()}
        if known is not None:
            for name, array in arrays.items():
                array[:past] = getattr(known, name)
        arrays["zc"][past:], arrays["settling"][past:] = zc, 0.0
        lanes = [] if integrator.memory_size or integrator.latch_count else ["advance_copies"]
        tip = integrator.tip("advance", "measure_force", *lanes)
        done = integrator.solvers.entry("follow")(
            guess.y, guess.memory.copy(), guess.latched.copy(), np.array(start.y if start else ()), arrays["zc"], past,
            wary, self.patience, self.decay, guess.period, common, integrator.points, integrator.tones, integrator.kinks,
            integrator.work, integrator.block, tip, integrator.sizes, MISS, MOST_CORRECTIONS, ORDER,
            integrator.harmonics, arrays["y"], arrays["tangents"], arrays["memory"], arrays["latched"], arrays["infos"],
            arrays["rows"],
        )  # fmt: skip
        doubted = done < past + count and arrays["infos"][done, 2] == DOUBTED
        # where a law has no value on a part of the orbit, the orbits end
        finite = np.isfinite(arrays["tangents"][past:done]).all(axis=(1, 2))
        if not finite.all():
            done, doubted = past + int(np.argmin(finite)), False
        return Orbits(self, **{name: array[past:done] for name, array in arrays.items()}, period=guess.period), doubted

    def finish(self, orbits: Orbits) -> dict[str, Array]:
        """Return the observables of orbits, see :mod:`dforce.quantities`."""
        integrator = self.integrator
        columns = finish_all(
            integrator.problem, integrator.scales, integrator.harmonics, orbits.rows,
            weights(self.frequencies, self.common or 1),
        )  # fmt: skip
        modulus, angle = multipliers(orbits.tangents)
        return columns | {
            "settling_periods": orbits.settling,
            "drift": orbits.infos[:, 0],
            "corrections": orbits.infos[:, 1],
            "multiplier_modulus": modulus,
            "multiplier_angle": angle,
        }

    def _bridge(self, last: Orbits, high: float, rounds: int) -> tuple[Orbits, float]:
        """Return the last orbit on the way to the distance `high` that continues another one, in finer and finer steps.

        The number is the first distance without, or `high` where it is reached.
        """
        steps = np.linspace(float(last.zc[-1]), high, PARTS + 1)[1:]
        done = 0
        while done < PARTS:
            found, _ = self._follow(steps[done:], last.motion, last, wary=False)
            done, last = done + len(found), joined(last, found)
            if done < PARTS:
                last, lost = last[-1:], float(steps[done])
                if rounds > 1:
                    last, lost = self._bridge(last, lost, rounds - 1)
                if last.zc[0] != steps[done]:
                    return last, lost
                done += 1
        return last[-1:], high

    def _note_wide_steps(self, orbits: Orbits) -> None:
        """Note the jumps among orbits one step apart: Newton's method may land on another state, and the motion as well."""
        moved = np.abs(np.diff(orbits.y, axis=0)).max(axis=1)
        for i in 1 + np.flatnonzero((orbits.infos[1:, 4] >= HARD) & (moved > WIDE)):
            before, after = orbits[i - 1 : i], orbits[i : i + 1]
            low, high = orbits.zc[i - 1 : i + 1].tolist()
            self._note_jump(before, after, orbits.zc[i - 1 : i + 1], high, abs(high - low))

    def note_jump(self, motion: Motion, first: Steady | Orbits, zc: Array) -> None:
        """Note a jump from the orbit of a motion at the first of some distances to the steady motion at the last."""
        last, _ = self._follow(zc[:1], motion)
        if len(last):
            self._note_jump(last, first, zc, float(zc[-1]), abs(float(zc[1] - zc[0])))

    def _note_jump(self, last: Orbits, first: Steady | Orbits, zc: Array, lost: float, step: float) -> None:
        """Note a jump from the first to the last of some distances, located by following the old orbit in finer steps.

        It was `lost` on the way, at the last of them at the latest.
        """
        low, high = float(zc[0]), lost
        if len(np.unique(np.sign(np.diff(zc)))) != 1 or low == high:
            return  # the tip turned around between
        while abs(high - low) > FINEST * step:
            steps = np.linspace(low, high, PARTS + 1)[1:]
            found, _ = self._follow(steps, last.motion, last, wary=False)
            if len(found) == PARTS:
                if high != zc[-1]:  # states are compared at one distance
                    steps = np.linspace(high, float(zc[-1]), PARTS + 1)[1:]
                    found, _ = self._follow(steps, found.motion, found, wary=False)
                if len(found) == PARTS and _distance(found.motion, first.motion) < AT_ONCE:
                    return  # a kick or a guess too far off, but the same state
                break
            high = float(steps[len(found)])
            if len(found):
                last, low = found[-1:], float(found.zc[-1])
        way = "approach" if zc[-1] < zc[0] else "retract"
        before = float(last[-1:].amplitudes[0])
        after = float(first.amplitudes[0] if isinstance(first, Orbits) else first.columns["amplitude"][0, 0])
        self.jumps.append(Jump(0.5 * (low + high), before, after, way))


def _distance(a: Motion, b: Motion) -> float:
    """Return how far two motions are apart, relative to the free amplitude."""
    return max(abs(p - q) for p, q in zip(a.y, b.y, strict=True)) if a.is_finite and b.is_finite else math.inf


def one_way(zc: Array, done: int, most: int) -> Array:
    """Return the distances to come, `most` at most, as far as they go one way, led by the one before where it is another."""
    start = done - 1 if zc[done] != zc[done - 1] else done
    steps = np.sign(np.diff(zc[start : done + most]))
    turns = np.nonzero(steps != steps[:1])[0]
    return zc[start : start + 1 + (int(turns[0]) if turns.size else steps.size)]
