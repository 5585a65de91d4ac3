"""The steady motion as an experiment finds it: integrate in time until it has settled, then measure."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.core.arrays import AnyArray, Array
from dforce.observables import measure
from dforce.observables.averaging import LONGEST, common_period, weights, window_length
from dforce.observables.finish import finish
from dforce.problem import Problem
from dforce.solvers.integrator import Integrator, Motion

DECAY_TIMES = 40  # of the slowest mode before giving up, unless max_periods says otherwise
LEAST_MOST = 400  # periods allowed at least
LEAST_SPANS = 5  # windows allowed at least, where they are longer than the decay
CHUNK_SECONDS = 0.1  # between checks for a stop, so that Ctrl-C and Stop answer at once
LONGER = 4  # times the window, where averages over tones that never repeat together still differ
LATE = 10  # decay times after which the rest of a transient is below the smallest change that counts
LONG, LEAST_LONG = 256, 16  # periods, and common periods at least, to measure a motion without a steady state
WANDERS = 4.0  # times its whole range: a motion whose way from period to period is longer does not come to rest
CALMS = 0.7  # share of the range of the first half: a motion with less in the second half does come to rest
REPEATS = 100.0  # times the settling tolerance: more change than this between windows is no settled motion
BOUNCE = 8  # steps: a tip whose bounces at a jump of the force are as short rests there, but for the steps

CancelCheck = Callable[[], None]  # called now and then; stops the run by raising


def never_cancelled(*_: int) -> None:
    """Watch for nothing."""


@dataclass(frozen=True)
class Steady:
    """The settled motion at one distance.

    Attributes
    ----------
    values
        Observables in SI units by name, see :mod:`dforce.core.quantities`.
    motion
        The state to go on from.
    settled, repeats
        Whether amplitudes and phases stopped moving, and whether they are the same in all windows measured.
    accuracy
        The accuracy promised; None: none is.
    stays
        Whether its error hardly falls with more samples.
    is_misled
        Whether its tip rests at a jump of the force, or it does not repeat and errors of its steps may be the reason.
    """

    values: Mapping[str, Any]
    motion: Motion
    settled: bool
    repeats: bool
    accuracy: float | None = None
    stays: bool = False
    is_misled: bool = False

    @property
    def columns(self) -> dict[str, Array]:
        """The observables as of many motions, of which this is the only one."""
        return {name: np.asarray(value)[None] for name, value in self.values.items()}


def decay_periods(problem: Problem) -> int:
    """Return the decay time of the slowest free mode, Q T / pi, in periods of the first tone."""
    first = problem.tones[0].frequency
    return max(1, math.ceil(max(mode.Q * first / (math.pi * mode.f0) for mode in problem.modes)))


def march(
    integrator: Integrator, motion: Motion, periods: int, check_cancelled: CancelCheck, kept: int = 1
) -> tuple[Motion, AnyArray]:
    """Advance and check for a stop now and then; return the motion and the complex amplitudes of the last periods `kept`."""
    last = np.empty((0, len(integrator.tones)), dtype=complex)
    for count in chunks(periods, check_cancelled):
        motion, c = integrator.lock_in(motion, count)
        last = np.concatenate([last, c])[-kept:]
        if not motion.is_finite:
            break
    return motion, last


def observe(integrator: Integrator, motion: Motion, periods: int, check_cancelled: CancelCheck) -> tuple[Motion, Array]:
    """Advance with checks for a stop; return the motion and the measurements over each period."""
    parts = []
    for count in chunks(periods, check_cancelled):
        motion, rows = integrator.observe(motion, count)
        parts.append(rows)
    return motion, np.concatenate(parts)


def chunks(periods: float, check_cancelled: CancelCheck, chunk: int = 16) -> Iterator[int]:
    """Give the number of periods, or of work as long as a period, to compute next, so that a stop is noticed in time.

    `chunk` is the first number.
    """
    done = 0
    while done < periods:
        count = int(min(chunk, periods - done))
        start = time.perf_counter()
        yield count
        took = time.perf_counter() - start
        done += count
        check_cancelled()
        chunk = max(1, min(4 * chunk, int(count * CHUNK_SECONDS / max(took, 1e-9))))


def still_ahead(change: Any, before: Any, tolerance: float) -> tuple[Any, Any]:
    """Return how far motions still have to go, and whether they have settled, from two changes in a row over equal spans.

    The changes c1 and c2 continue as a geometric series: the rest is c2 r / (1 - r) with r = c2 / c1, and never less than c2
    itself. It is infinite where the change before is.
    """
    known = np.isfinite(before)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(before > 0.0, np.minimum(np.divide(change, before), 0.999), 0.0)
        rest = np.where(known, change * np.maximum(1.0, ratio / (1.0 - ratio)), np.inf)
    return rest, known & (np.minimum(rest, 100.0 * change) < tolerance)


def settle(integrator: Integrator, motion: Motion, check_cancelled: CancelCheck) -> tuple[Motion, bool, float, int]:
    """Integrate until the tones' complex amplitudes stop moving from one decay time of the slowest mode to the next.

    Amplitudes of tones that never repeat together are averages over a window. Where they still differ long after the
    transient, a beat of a high order is slower than the window, which then becomes longer.

    Returns
    -------
    motion, settled, drift, window
        The state; whether the estimated rest of the way is within the tolerance; this estimate, relative to the free amplitude,
        infinite for a motion that wanders; the periods to average over. A motion that wanders by less than a change that counts
        does so by errors of its steps: it has settled, within this range.
    """
    problem, settings = integrator.problem, integrator.settings
    frequencies = [tone.frequency for tone in problem.tones]
    window = window_length(frequencies)
    decay = max(4, decay_periods(problem))
    span = window * math.ceil(decay / window)
    most = settings.max_periods or max(LEAST_MOST, DECAY_TIMES * decay, LEAST_SPANS * span)
    longest = min(LONGEST, settings.max_periods // 3 if settings.max_periods else LONGER**2 * window)
    if common_period(frequencies) is not None:
        longest = window
    size = np.array([tone.A0 for tone in problem.tones]) / integrator.scales.length
    mean = weights(frequencies, window)
    before, change_before, drift, path = None, math.inf, math.inf, list[AnyArray]()
    start, is_longer = motion.period, False
    while motion.period - start < most:
        motion, c = march(integrator, motion, min(span, most - (motion.period - start)), check_cancelled, window)
        if not motion.is_finite:
            return motion, False, math.nan, window
        if len(c) < window:
            break
        now = mean @ c
        path.append(now / size)
        if before is not None:
            change = float(np.max(np.abs(now - before) / size))
            drift, is_settled = still_ahead(change, change_before, settings.settle_tolerance)
            if is_longer and change < settings.settle_tolerance:
                drift, is_settled = change, True
            if is_settled:
                return motion, True, float(drift), window
            change_before, done = change, motion.period - start
            if change > settings.settle_tolerance and done >= LATE * decay and LONGER * window <= longest:
                window, span, is_longer = LONGER * window, LONGER * window, True
                mean, before, change_before, path = weights(frequencies, window), None, math.inf, []
                most = settings.max_periods or max(most, done + 2 * window)
                continue
        before = now
        late = np.array(path[-LATE:])
        if wanders(late[:, 0]):
            reach = max(_range(c) for c in late.T)
            is_small = reach < REPEATS * settings.settle_tolerance
            return motion, is_small, reach if is_small else math.inf, window
    return motion, False, float(drift), window


def steady(integrator: Integrator, motion: Motion, check_cancelled: CancelCheck) -> Steady:
    """Settle at the integrator's distance, then measure over whole windows; the motion ends at the start of a common period."""
    problem, settings = integrator.problem, integrator.settings
    start, frequencies = motion.period, [tone.frequency for tone in problem.tones]
    if settings.settle == "fixed":
        window = window_length(frequencies)
        motion, before = march(integrator, motion, settings.periods, check_cancelled, window)
        settled, drift = False, math.nan
    else:
        motion, settled, drift, window = settle(integrator, motion, check_cancelled)
    periods = motion.period - start
    count = window * math.ceil(settings.measured_periods / window)
    lasting = not settled and motion.is_finite and common_period(frequencies) is not None
    lasting = lasting and settings.settle == "converged" and periods >= LATE * decay_periods(problem)
    long = window * max(LEAST_LONG, LONG // window)
    motion, rows = observe(integrator, motion, max(count, long) if lasting else count, check_cancelled)
    if lasting:
        settled, rows, drift = _lasting(integrator, rows, count, window, drift)
    values = finish(problem, integrator.harmonics, rows, weights(frequencies, len(rows)))
    values |= {"settling_periods": float(periods), "drift": drift}
    motion, _ = march(integrator, motion, -motion.period % (common_period(frequencies) or 1), check_cancelled)
    repeats = _repeats(integrator, rows, frequencies)
    if settled and not lasting and not repeats:  # it was the same by chance, or by its period, where it was compared
        after = observe(integrator, motion, long, check_cancelled)[1]
        values["drift"] = _lasting(integrator, after, count, window, math.inf)[2]
    if settings.settle == "fixed":  # the same in all windows is the only sign that the count was long enough
        alone = len(rows) == common_period(frequencies)
        settled = repeats and not (alone and _moves(integrator, rows, before))
    rests = _is_at_rest(integrator, values)
    return Steady(values, motion, settled, repeats, stays=rests, is_misled=rests)


def still_at_rest(integrator: Integrator, motion: Motion, check_cancelled: CancelCheck) -> Steady | None:
    """Return the motion of a tip that rests where the force jumps, which need not settle; None of a tip that does not."""
    frequencies = [tone.frequency for tone in integrator.problem.tones]
    periods = LEAST_LONG * (common_period(frequencies) or window_length(frequencies))
    motion, rows = observe(integrator, motion, periods, check_cancelled)
    values = finish(integrator.problem, integrator.harmonics, rows, weights(frequencies, periods))
    values |= {"settling_periods": 0.0, "drift": math.nan}
    return Steady(values, motion, True, False, stays=True, is_misled=True) if _is_at_rest(integrator, values) else None


def _is_at_rest(integrator: Integrator, values: Mapping[str, Any]) -> bool:
    r"""Return whether the tip rests where the force jumps, because both sides drive it back: it bounces by the steps alone.

    Between bounces that last a time T under the force F it comes as far as :math:`F T^2 / 8 m`.
    """
    problem, span, lowest = integrator.problem, 2.0 * values["half_peak_to_peak"], values["min_distance"]
    if not any(lowest < at < lowest + span for force in problem.forces for at in force.jumps()):
        return False
    time = BOUNCE / (integrator.points * problem.tones[0].frequency)
    inverse_mass = sum((2.0 * np.pi * mode.f0) ** 2 / mode.k for mode in problem.modes)
    return bool(span < (values["peak_force"] - values["min_force"]) * time**2 / 8.0 * inverse_mass)


def _lasting(integrator: Integrator, rows: Array, count: int, window: int, drift: float) -> tuple[bool, Array, float]:
    """Look for a lasting motion that is no steady state: subharmonic, or without any period.

    With an infinite drift, whole decay times have shown that the motion wanders; the rows are often fewer.

    Returns
    -------
    Whether it is one; the rows for its measurement; and its deviation from its period, or its range, or the drift. The rows are
    whole periods of a subharmonic motion, all of a motion without period, and `count` of a motion that has not settled yet.
    """
    tolerance = integrator.settings.settle_tolerance
    c = _means(integrator, rows, window)
    size = float(np.max(np.abs(c - c[0])))
    if size > REPEATS * tolerance:
        for n in range(1, 1 + len(c) // 4):
            miss = float(np.max(np.abs(c[n:] - c[:-n])))
            if miss < tolerance:
                if n == 1:  # it drifts, slowly
                    return False, rows[:count], drift
                cycles = min(math.ceil(count / (n * window)), len(c) // n)
                return True, rows[: cycles * n * window], miss
        if wanders(c) or drift == math.inf:
            return True, rows, size
    return False, rows[:count], drift


def wanders(c: AnyArray) -> bool:
    """Return whether successive complex amplitudes move to and fro and do not come to rest."""
    if len(c) < LATE:
        return False
    calms = _range(c[len(c) // 2 :]) < CALMS * _range(c[: len(c) // 2])
    return not calms and float(np.abs(np.diff(c)).sum()) > WANDERS * float(np.abs(c - c[0]).max())


def _range(c: AnyArray) -> float:
    return float(max(np.ptp(c.real), np.ptp(c.imag)))


def _means(integrator: Integrator, rows: Array, size: int) -> Array:
    """Return the complex amplitude at the first tone in each of the windows of a size in periods."""
    place = measure.FIRST + 2 * len(integrator.problem.modes)
    c = rows[:, place] + 1j * rows[:, place + 1]
    each = weights([tone.frequency for tone in integrator.problem.tones], size)
    return np.array([each @ c[start : start + size] for start in range(0, len(c) - size + 1, size)])


def _moves(integrator: Integrator, rows: Array, before: AnyArray) -> bool:
    """Return whether the amplitude at the first tone in the only common period measured differs from the period before."""
    if len(before) < len(rows):
        return True
    change = abs(_means(integrator, rows, len(rows))[0] - before[:, 0].mean())
    return not change <= REPEATS * integrator.settings.settle_tolerance


def _repeats(integrator: Integrator, rows: Array, frequencies: list[float]) -> bool:
    """Return whether the amplitude at the first tone is the same in all windows measured.

    Tones that never repeat are measured over one window; there its halves are compared.
    """
    means = _means(integrator, rows, common_period(frequencies) or len(rows) // 2)
    spread = float(np.max(np.abs(means - means[0])))
    return not spread > REPEATS * integrator.settings.settle_tolerance
