"""The two things that a lot of problems can do side by side: follow their periodic orbits, and settle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce import kernel
from dforce.kernel import Array
from dforce.observables import measure
from dforce.solvers import SolverSettings, lane_orbits
from dforce.solvers.integrator import CALLED, load_kernels
from dforce.solvers.kicks import patience
from dforce.solvers.lot import Indices, Lot
from dforce.solvers.orbit import MISS, MOST_CORRECTIONS
from dforce.solvers.transient import DECAY_TIMES, LEAST_MOST, LEAST_SPANS, Watch

ABREAST = 64  # orbits followed in one call: their samples stay in the cache
LANES = 256  # motions that settle in one call
GRAIN = 8  # periods; spans are multiples, so that lanes with nearly the same Q are looked at together
LONGEST = 64  # periods between looks at the watch
ORDER = 4  # of the extrapolation along the distance, at most


@dataclass(frozen=True)
class Stretch:
    """Orbits of some problems along some distances, and how many of the distances were done.

    Attributes
    ----------
    orbits, tangents, infos, rows
        As ``lane_orbits.follow_cases`` leaves them: (problems, distances, ...).
    done
        Number of distances, from the first, at which there is an orbit.
    """

    orbits: Array
    tangents: Array
    infos: Array
    rows: Array
    done: Indices

    def last(self) -> Stretch:
        """Return the stretch's last distance alone."""
        orbits, tangents, infos, rows = (part[:, -1:] for part in (self.orbits, self.tangents, self.infos, self.rows))
        return Stretch(orbits, tangents, infos, rows, self.done)


@dataclass(frozen=True)
class Settled:
    """Where motions settled: scaled motion, whether they did, what is still to come, and after how many periods."""

    motions: Array
    settled: np.ndarray[Any, np.dtype[np.bool_]]
    drift: Array
    periods: Indices


class SideBySide:
    """A lot of problems with the same number of samples and phase of the drive, made ready to be solved."""

    def __init__(self, lot: Lot, settings: SolverSettings, harmonics: int, points: int, watch: Watch) -> None:
        self.lot, self.settings, self.harmonics, self.points, self.watch = lot, settings, harmonics, points, watch
        modes = len(lot.example.modes)
        self.kernel, self.solvers = load_kernels(lot.example)
        self._tip = kernel.Tip(self.kernel, modes, CALLED)
        angles = lot.tones[0, 0, 1] + math.pi / points * np.arange(2 * points + 1)
        self.cosine = np.array([np.cos(angles), np.sin(angles)])
        self.bases = np.array([lot.tones[0, 0, 1]])
        self.size, self.columns = 2 * modes, measure.FIRST + 2 * (modes + 1) + 2 * harmonics + 2

    def follow(self, which: Indices, starts: Array, zc: Array, counts: Indices | None = None) -> Stretch:
        """Follow the orbit near each start through the distances `zc` (problems, distances), as far as it exists.

        `counts` says how many of its distances each has; left out: all.
        """
        cases, steps = zc.shape
        counts = np.full(cases, steps) if counts is None else counts
        found = Stretch(
            np.empty((cases, steps, self.size)), np.empty((cases, steps, self.size, self.size)),
            np.zeros((cases, steps, 5)), np.empty((cases, steps, self.columns)), np.zeros(cases, np.int64),
        )  # fmt: skip
        tip = self._tip.at(kernel.parameters(self.lot.example, 0.0), ("advance_samples", "measure_force"))
        follow = self.solvers.entry("follow_cases")
        for start in range(0, cases, ABREAST):
            part = slice(start, start + ABREAST)
            lot = self.lot.take(which[part])
            follow(
                np.ascontiguousarray(starts[part]), np.ascontiguousarray(zc[part]), counts[part].astype(np.int64),
                _lanes(lot.numbers), _lanes(lot.kinks), _lanes(lot.tones[:, 0, 2:]), lot.tones, self.bases, self.points,
                self.cosine, np.zeros((9, 1)), tip, MISS, MOST_CORRECTIONS, ORDER, patience(lot.jumps.size),
                self.harmonics, found.orbits[part],
                found.tangents[part], found.infos[part], found.rows[part], found.done[part],
            )  # fmt: skip
            self.watch()
        return found

    def settle(self, which: Indices, starts: Array, zc: Array, tolerance: float) -> Settled:
        """Integrate each motion until it has settled, by the rule of :func:`dforce.solvers.transient.settle`.

        Steps are not cut at kinks here: the motion is good enough to start an orbit from. Lanes that are done make room
        for the next motions.
        """
        count = len(which)
        motions, settled = starts.copy(), np.zeros(count, dtype=bool)
        drift, periods = np.full(count, np.inf), np.zeros(count, np.int64)
        decay = np.maximum(4, self.lot.decay[which])
        span = GRAIN * np.ceil(decay / GRAIN).astype(np.int64)
        most = np.maximum(np.maximum(LEAST_MOST, DECAY_TIMES * decay), LEAST_SPANS * span)
        if self.settings.max_periods is not None:
            most = np.full(count, self.settings.max_periods)
        checks = np.minimum(span, most)
        before, change_before = np.full(count, np.nan, dtype=complex), np.full(count, np.inf)
        advance = self.kernel.entry("advance_cases")
        running = np.arange(min(LANES, count))
        waiting = len(running)
        packed = self._pack(which, motions, zc, running)
        while len(running):
            chunk = int(min(LONGEST, (checks - periods)[running].min()))
            y, parameters, drive = packed
            lock_ins = np.empty((2, y.shape[1]))
            advance(y, parameters, drive, self.points, self.cosine, chunk, lock_ins)
            self.watch()
            periods[running] += chunk
            motions[running] = y[:, : len(running)].T
            due = np.flatnonzero(periods[running] == checks[running])
            cases = running[due]
            now = lock_ins[0, due] + 1j * lock_ins[1, due]
            change = np.abs(now - before[cases])
            former = change_before[cases]
            with np.errstate(invalid="ignore", divide="ignore"):
                ratio = np.where(former > 0.0, np.minimum(change / former, 0.999), 0.0)
                ahead = change * np.maximum(1.0, ratio / (1.0 - ratio))
            known = np.isfinite(former)
            drift[cases] = np.where(np.isfinite(now), np.where(known, ahead, np.inf), np.nan)
            settled[cases] = known & (np.minimum(ahead, 100.0 * change) < tolerance)
            change_before[cases] = np.where(np.isnan(change), np.inf, change)
            before[cases] = now
            over = settled[cases] | (periods[cases] >= most[cases]) | ~np.isfinite(now)
            checks[cases] = np.minimum(checks[cases] + span[cases], most[cases])
            if over.any():
                ended = np.zeros(count, dtype=bool)
                ended[cases[over]] = True
                fresh = np.arange(waiting, min(count, waiting + int(over.sum())))
                waiting += len(fresh)
                running = np.concatenate([running[~ended[running]], fresh])
                packed = self._pack(which, motions, zc, running)
        return Settled(motions, settled, drift, periods)

    def _pack(self, which: Indices, motions: Array, zc: Array, running: Indices) -> tuple[Array, Array, Array]:
        """Return the motions, parameters and drive of what is running, one column a lane, filled up to whole vectors."""
        lanes = np.resize(running, lane_orbits.padded(len(running)))
        lot = self.lot.take(which[lanes])
        parameters = _lanes(lot.numbers)
        parameters[0] = zc[lanes]
        return _lanes(motions[lanes]), parameters, _lanes(lot.tones[:, 0, 2:])


def _lanes(array: Array) -> Array:
    """Return an array with the problems last."""
    return np.array(array.T, order="C")
