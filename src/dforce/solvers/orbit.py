"""The steady motion itself: periodic orbits found by shooting and followed along the distance.

What is followed is the state that the experiment would be in: it starts from the transient's state, and where the orbit
ceases to exist or to be stable, the transient from the last stable state decides what comes next.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dforce.kernel import Array
from dforce.observables.finish import finish_all
from dforce.observables.window import common_period, weights
from dforce.solvers.integrator import Integrator, Motion
from dforce.solvers.shooting import HARD, LARGE, SMALL
from dforce.solvers.transient import Row, Steady, Watch, decay_periods, march, settle, steady

MISS = 1e-9  # of the free amplitude: how far from its start an orbit may end
MOST_CORRECTIONS = 20
ORDER = 4  # of the extrapolation that predicts the next orbit from those before it, at most
EARLY = 3  # decay times after which an orbit near the motion is looked for, before the motion has settled
CHUNK, LEAST_CHUNK = 65_536, 16  # steps of the map between looks at the watch; distances at least
JUMPY = 8  # times fewer distances where the force jumps: each costs more, and kicks that change the state are frequent
ROUGH = 1e-3  # settling tolerance before Newton's method takes over
SAME_STATE = 10.0  # times what is still to come: an orbit farther from the rough state is another one
AT_ONCE = 5e-3  # of the free amplitude: an orbit so near to the start is the one that the motion settles to
LOOKS, REST = 32, 7  # looks at a motion after a kick before it is left to settle, and common periods between them
NEAR = 0.1  # share of the way to other states (``shooting.kick``) from which on a motion stays
CALMED = 0.5  # share of the kick that is left then at most
BRIDGES = 2  # rounds of eight parts in which an orbit that was not found in one step is looked for
HALVINGS = 3  # rounds of eight parts in which a jump is located: to 1/512 of the step


@dataclass(frozen=True)
class Jump:
    """A sudden change of state: at which distance (m) the old one ceased, on which way, and the amplitudes (m)."""

    zc: float
    before: float
    after: float
    direction: str


@dataclass(frozen=True)
class PeriodicOrbit(Steady):
    """A steady motion found as a periodic orbit.

    Attributes
    ----------
    tangent
        Derivative of the motion one common period later by the motion.
    kick
        How hard the step from the orbit before is, see ``shooting.kick``.
    """

    tangent: Array
    kick: float


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
        self.force_jumps = [jump for force in problem.forces for jump in force.jumps()]
        slow = JUMPY if self.force_jumps else 1
        self.chunk = max(LEAST_CHUNK, CHUNK // (integrator.points * (self.common or 1) * slow))
        self.jumps: list[Jump] = []

    def at(self, motion: Motion, zc: float, watch: Watch) -> Steady:
        """Return the steady motion that settles at one distance (m) from a given motion."""
        return next(iter(self.along(motion, np.array([zc]), watch)))

    def along(self, motion: Motion, zc: Array, watch: Watch, before: float | None = None) -> Iterator[Steady]:
        """Give the steady motion at each distance (m), each started from the one before; end where it is lost.

        `before` is the distance at which the motion was found, where the distances continue others.
        """
        done, lost, doubt = 0, True, False
        last: Steady | None = None
        # the last orbit, and where it was: points close to the end of its branch that did not settle may lie between
        origin: tuple[PeriodicOrbit, int] | None = None
        if before is not None:
            zc, done = np.append(before, zc), 1
            last = next(iter(self._follow(motion, zc[:1])), None)
            lost = last is None
        while done < len(zc):
            if lost:
                self.integrator.place(float(zc[done]))
                first = self._settled(motion, watch, doubt)
                if origin is not None and first.settled:
                    self.note_jump(origin[0], first, zc[origin[1] : done + 1])
                    origin = None
                yield first
                motion, last, done = first.motion, first, done + 1
                if not motion.is_finite:
                    return
            lost, doubt = True, False
            while isinstance(last, PeriodicOrbit) and done < len(zc):
                part = one_way(zc, done, self.chunk)
                watch()
                found = self._follow(motion, part)
                # the point before came along, where the direction is kept: it is what the extrapolation starts from
                for point in found[int(part[0] != zc[done]) :]:
                    doubt = point.kick >= HARD and not self._stays(motion, point, float(zc[done]))
                    if doubt:
                        break
                    yield point
                    motion, last, done = point.motion, point, done + 1
                origin = last, done - 1
                if doubt:
                    break
                if len(found) < len(part):
                    bridged = self._bridge(last.motion, float(zc[done - 1]), float(zc[done]), BRIDGES)
                    if bridged is None or not self._stays(motion, bridged, float(zc[done])):
                        break
                    yield bridged
                    motion, last, done = bridged.motion, bridged, done + 1

    def _stays(self, motion: Motion, point: PeriodicOrbit, zc: float) -> bool:
        """Say whether a motion, put to another distance (m), comes near the orbit there that continues its state."""
        self.integrator.place(zc)
        return stays(self.integrator, motion, point.motion.y, point.tangent, self.common or 1)

    def _settled(self, motion: Motion, watch: Watch, doubt: bool = False) -> Steady:
        """Return the steady motion at the integrator's distance: at once by Newton, else after a rough settling."""
        if self.common is None:
            return steady(self.integrator, motion, watch)
        here = np.array([self.integrator.p[0]])
        near = None if doubt else self._home(motion, here)
        if near is not None:
            return near
        begun, decay = motion.period, max(4, decay_periods(self.integrator.problem))
        span, most = self.common * math.ceil(decay / self.common), self.integrator.settings.max_periods
        for _ in range(EARLY if most is None else min(EARLY, most // span)):
            motion, _ = march(self.integrator, motion, span, watch)
            near = self._home(motion, here) if motion.is_finite else None
            if near is not None:
                return replace(near, values=dict(near.values) | {"settling_periods": float(motion.period - begun)})
        rough, settled, drift = settle(self.integrator, motion, watch, ROUGH)
        if settled:
            periods = rough.period - begun
            polished = self._follow(rough, here)
            if polished and _distance(polished[0].motion, rough) < SAME_STATE * max(drift, MISS):
                values = dict(polished[0].values) | {"settling_periods": float(periods)}
                return replace(polished[0], values=values)
        if not rough.is_finite:
            return steady(self.integrator, motion, watch)
        return steady(self.integrator, rough, watch)

    def _home(self, motion: Motion, here: Array) -> PeriodicOrbit | None:
        """Return the orbit that a motion is so near to that it settles there, or None."""
        near = self._follow(motion, here)
        apart = _distance(near[0].motion, motion) if near else math.inf
        if apart < AT_ONCE or (apart < LARGE and self._stays(motion, near[0], float(here[0]))):
            return near[0]
        return None

    def _follow(self, motion: Motion, zc: Array) -> list[PeriodicOrbit]:
        """Follow a stable orbit from near a motion through the distances; return what was found before it ends."""
        integrator, common = self.integrator, self.common
        if common is None:
            return []
        count, size = len(zc), len(motion.y)
        orbits, jacobians = np.empty((count, size)), np.empty((count, size, size))
        infos, rows = np.empty((count, 5)), np.empty((count, common, integrator.columns))
        memory, latched = motion.memory.copy(), motion.latched.copy()
        done = integrator.kernel.entry("follow")(
            motion.y, memory, latched, not self.force_jumps, zc, motion.period, common, integrator.points, integrator.tones,
            integrator.kinks, integrator.work, integrator.block, integrator.p, integrator.sizes, MISS, MOST_CORRECTIONS,
            ORDER, integrator.harmonics, orbits, jacobians, infos, rows,
        )  # fmt: skip
        # where a law has no value on a part of the orbit, the orbits end
        done = int(np.argmin(np.append(np.isfinite(jacobians[:done]).all(axis=(1, 2)), False)))
        if not done:
            return []
        infos = infos[:done]
        stretch = finish_all(
            integrator.problem, integrator.scales, integrator.harmonics, rows[:done], weights(self.frequencies, common)
        )
        found = np.linalg.eigvals(jacobians[:done])
        multipliers = np.take_along_axis(found, np.argsort(-np.abs(found), axis=1, kind="stable"), 1)
        stretch |= {
            "settling_periods": np.zeros(done),
            "drift": infos[:, 0],
            "corrections": infos[:, 1],
            "multiplier_modulus": np.abs(multipliers),
            "multiplier_angle": np.degrees(np.angle(multipliers)),
        }
        motions = [Motion(tuple(y), memory, latched, motion.period) for y in orbits[:done].tolist()]
        return [
            PeriodicOrbit(Row(stretch, i), there, True, True, jacobians[i], kick)
            for i, (there, kick) in enumerate(zip(motions, infos[:, 4].tolist(), strict=True))
        ]

    def _bridge(self, motion: Motion, low: float, high: float, finer: int) -> PeriodicOrbit | None:
        """Return the orbit at `high` that continues the one at `low`, reached in finer and finer steps, or None."""
        at, step = low, (high - low) / 8.0
        for _ in range(8):
            found = self._follow(motion, np.array([at, at + step]))
            if len(found) == 2:
                last = found[1]
            else:
                finer_still = self._bridge(motion, at, at + step, finer - 1) if finer > 1 else None
                if finer_still is None:
                    return None
                last = finer_still
            motion, at = last.motion, at + step
        return last

    def note_jump(self, last: Steady, first: Steady, zc: Array) -> None:
        """Note a jump from the first to the last of some distances, located by following the old orbit in finer steps."""
        low, high = float(zc[0]), float(zc[-1])
        if len(np.unique(np.sign(np.diff(zc)))) != 1 or low == high:
            return  # the tip turned around between
        before, motion = float(last.values["amplitude"][0]), last.motion
        for _ in range(HALVINGS):
            steps = np.linspace(low, high, 9)
            found = self._follow(motion, steps)
            if len(found) == len(steps) and _distance(found[-1].motion, first.motion) < AT_ONCE:
                return  # a kick or a guess too far off, but the same state
            if not found or len(found) == len(steps):
                break
            low, high, motion = float(steps[len(found) - 1]), float(steps[len(found)]), found[-1].motion
            before = float(found[-1].values["amplitude"][0])
        way = "approach" if zc[-1] < zc[0] else "retract"
        self.jumps.append(Jump(0.5 * (low + high), before, float(first.values["amplitude"][0]), way))


def stays(integrator: Integrator, motion: Motion, orbit: Sequence[float], tangent: Array, common: int) -> bool:
    """Say whether a motion at the integrator's distance comes near an orbit.

    No is also said where that is not clear before the motion has settled.
    """
    there, flat = np.array(orbit), np.linalg.inv(np.eye(len(orbit)) - tangent)
    enough = max(SMALL, CALMED * float(np.abs(np.array(motion.y) - there).max()))
    for _ in range(LOOKS):
        after, _ = integrator.lock_in(motion, common)
        if not after.is_finite:
            return False
        left = np.array(motion.y) - there
        size = float(np.abs(left).max())
        away = np.abs(flat @ (np.array(after.y) - there - tangent @ left)).max()
        if size < enough and away < NEAR * max(size, SMALL):
            return True
        motion, _ = integrator.lock_in(after, REST * common)
    return False


def _distance(a: Motion, b: Motion) -> float:
    """Return how far two motions are apart, relative to the free amplitude."""
    return max(abs(p - q) for p, q in zip(a.y, b.y, strict=True)) if a.is_finite and b.is_finite else math.inf


def one_way(zc: Array, done: int, most: int) -> Array:
    """Return the distances to come, `most` at most, as far as they go one way, led by the one before where it is another."""
    start = done - 1 if zc[done] != zc[done - 1] else done
    steps = np.sign(np.diff(zc[start : done + most]))
    turns = np.nonzero(steps != steps[:1])[0]
    return zc[start : start + 1 + (int(turns[0]) if turns.size else steps.size)]
