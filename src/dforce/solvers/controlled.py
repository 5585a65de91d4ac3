r"""The motion under phase-locked loops and amplitude controls that act in time, after each period or each longer window.

The oscillator of the loop sets the period. At its end the lock-in gives amplitude and phase. Two controllers with a
proportional and an integral part correct frequency and drive by the errors of the phase, e, and of the amplitude as a share,
:math:`\epsilon`

.. math:: \omega = \omega_I - b\, e, \quad \dot\omega_I = -\frac{\omega_0}{2 Q}\, b\, e, \qquad
          F = F_I + \frac{k A}{Q} \frac{2 Q}{\omega_0}\, a\, \epsilon, \quad \dot F_I = \frac{k A}{Q}\, a\, \epsilon

The zero of each controller cancels the pole of the lever: far from the sample both loops respond like :math:`b / s` and
:math:`a / s` at any quality factor. Several tones each have their own controllers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Bools, Complexes
from dforce.instrument.drive import ToneNumbers
from dforce.observables.averaging import SHORTEST, weights, window_length
from dforce.observables.finish import held_signals
from dforce.problem import Problem
from dforce.solvers.integrator import Integrator, Motion
from dforce.solvers.transient import never_cancelled

FILTERED = 5.0  # times the larger bandwidth of the controllers: bandwidth of the low-pass behind the lock-in
LONGEST = 60.0  # response times of the slowest controller or lever: then the loops are given up
RESPONSE = 0.3  # of an error, which a controller corrects in a window over several tones
WIDEST = 4096  # periods of such a window
FAST = 16  # periods after which controllers of the first tone act: its motion at constant drive may be unstable
SPAN = 12  # windows in which errors that are noise change their signs, so that half of their sum or more cancels
NOISE = 10.0  # times the accuracy: largest noise, which is averaged over so many windows
IRREGULAR = 16384  # periods without drift or decay of errors that are no noise: such a motion does not repeat


@dataclass(frozen=True)
class ToneControllers:
    """The values that the controllers of a tone hold, and how fast.

    Attributes
    ----------
    phase, amplitude
        Set points (rad, m); None: that controller is off.
    phase_bandwidth, amplitude_bandwidth
        Hz; of several tones the window decides.
    order
        Stages of the low-pass behind the lock-in; 0: it gives the mean over the window.
    of_mode
        Whether the lock-in reads the tone's own mode; otherwise the detector's signal.
    """

    phase: float | None
    amplitude: float | None
    phase_bandwidth: float = 0.0
    amplitude_bandwidth: float = 0.0
    order: int = 0
    of_mode: bool = False

    @classmethod
    def of(cls, tone: ToneNumbers, *settings: Any) -> Self:
        """Return the controllers of a tone's lock, with bandwidths and order."""
        lock, held = tone.lock, tone.lock.held if tone.lock is not None else ()
        phase = lock.phase if lock is not None and "phase" in held else None
        made = cls(phase, tone.A0 if "amplitude" in held else None, *settings)
        return replace(made, of_mode=lock is not None and lock.of_mode)


class ControlledMotion(NamedTuple):
    """Motion under the controllers.

    Attributes
    ----------
    frequency, ratio, amplitude, phase
        Frequency (Hz), drive as a multiple of that at the start, amplitude (m) and phase (rad) of each tone in each window,
        (windows, tones).
    motion
        At the end, scaled as the integrator's last problem is.
    settled, repeats
        Whether all loops came to rest, or fluctuate about it; whether the motion repeats: else all are means of many windows.
    periods
        Of the first tone until then.
    rows
        Measurements of each period of the last window, see ``observables``.
    """

    frequency: Array
    ratio: Array
    amplitude: Array
    phase: Array
    motion: Motion
    settled: bool
    repeats: bool
    periods: int
    rows: Array


def follow(
    integrator: Integrator,
    way: Sequence[float],
    start: Motion,
    loops: Sequence[ToneControllers],
    report: Callable[..., None] = never_cancelled,
) -> ControlledMotion:
    """Follow a motion along average distances (m), and at the last distance until all loops have settled.

    The controllers act after each period of one tone, or after each window over several tones, in which their beats cancel; the
    first tone's controllers act more often. Each action has a distance. `report` is called with the periods done and the
    expected number. In the end errors of phase (rad) and amplitude (as a share), and their changes, are below
    `settle_tolerance` for a response time of the slowest loop, or are noise. The integrator starts from its problem, and keeps
    the last frequencies, drives and phases of the tones.
    """
    problem, settings = integrator.problem, integrator.settings
    tones, modes = problem.tones, [problem.modes[tone.mode] for tone in problem.tones]
    held = np.array([(one.phase is not None, one.amplitude is not None) for one in loops]).T
    rates = 2.0 * math.pi * np.array([(one.phase_bandwidth, one.amplitude_bandwidth) for one in loops]).T
    set_phase = np.array([one.phase or 0.0 for one in loops])
    set_amplitude = np.array([one.amplitude or tone.A0 for one, tone in zip(loops, tones, strict=True)])
    pole = np.array([math.pi * mode.f0 / mode.Q for mode in modes])
    unit = set_amplitude * [mode.k / mode.Q / tone.force for mode, tone in zip(modes, tones, strict=True)]
    several, fast = len(tones) > 1, np.arange(len(tones)) == 0
    omega = middle = 2.0 * math.pi * np.array([tone.frequency for tone in tones])
    ratio = push = np.ones(len(tones))
    turned, read = np.array([tone.phase for tone in tones]), np.zeros(len(tones), complex)
    motion, stages = start, [read] * loops[0].order
    rows: list[tuple[Array, ...]] = []
    recent: list[Array] = []
    errors: list[tuple[Array, ...]] = []
    calm = age = 0.0
    periods, total, many, repeats = 0, 1, SPAN, True

    def correct(read: Complexes, period: float, who: Bools) -> tuple[Array, Array]:
        """Let controllers of some tones act on the readings of their lock-ins, and return the errors."""
        nonlocal middle, push, omega, ratio
        b, a = np.where(who, held * (RESPONSE / period if several else rates), 0.0)
        e = np.where(held[0], -np.angle(read) - set_phase, 0.0)
        short = np.where(held[1], 1.0 - np.abs(read) / set_amplitude, 0.0)
        middle, push = middle - b * pole * e * period, push + unit * a * short * period
        omega, ratio = np.where(who, middle - b * e, omega), np.where(who, push + unit * a / pole * short, ratio)
        return e, short

    while calm < 1.0 and age < LONGEST and motion.is_finite:
        report(periods, total)
        before, window = read, window_over(omega)
        parts: list[Array] = []
        acting: list[tuple[Array, Array]] = []
        part = FAST if several and held[:, 0].any() else window
        for _ in range(window // part):
            units, period = _units(integrator.problem), 2.0 * math.pi * part / omega[0]
            integrator.take(_driven(problem, omega, ratio, turned))
            integrator.place(way[min(len(rows), len(way) - 1)])
            there = tuple((np.array(motion.y) * units / _units(integrator.problem)).tolist())
            motion, measured = integrator.observe(Motion(there, motion.memory, motion.branch, 0), part)
            parts, acting, turned = [*parts, measured], [*acting, (omega, ratio)], turned + omega * period
            read = _read(integrator, measured, loops, weights(omega.tolist(), part))
            for k in range(len(stages)):
                corner = FILTERED * (held * rates).max() / math.sqrt(2.0 ** (1.0 / len(stages)) - 1.0)
                stages[k] = stages[k] - math.expm1(-corner * period) * (read - stages[k])
                read = stages[k]
            e, short = correct(read, period, fast)
            if not motion.is_finite:
                break
        mean_omega, mean_ratio = np.mean(acting, axis=0)
        measured, period = np.concatenate(parts), 2.0 * math.pi * window / mean_omega[0]
        if several:
            read = _read(integrator, measured, loops, weights(mean_omega.tolist(), len(measured)))
            e, short = correct(read, period, ~fast)
        rows.append((mean_omega / (2.0 * math.pi), mean_ratio, np.abs(read), -np.angle(read)))
        change, periods = (read - before) / set_amplitude, periods + window
        acts = held * (RESPONSE / period if several else rates)
        slowest = min(rate for rate in (*acts.ravel(), *pole) if rate)
        responses = 1.0 - math.log(settings.settle_tolerance)  # in which errors fall by that, and one more
        total = max(total, periods + window, window * len(way) + math.ceil(responses * window / (period * slowest)))
        many = max(SPAN, IRREGULAR // window) if several else SPAN
        errors = [*errors[1 - many :], (e, short, change.real, change.imag)]
        recent = [*recent[1 - many :], measured]
        age, there_long = age + period * slowest, len(rows) >= len(way)
        calm = calm + period * slowest if there_long and np.abs(errors[-1]).max() < settings.settle_tolerance else 0.0
        waited, averaged = len(rows) - len(way), 0
        if several and waited >= SPAN and _is_noise(np.array(errors[-SPAN:]), settings.accuracy or 0.0):
            averaged = SPAN
        elif several and waited >= many and _is_stationary(np.array(errors)):
            averaged, repeats = many, False
        if averaged:
            measured = np.concatenate(recent[-averaged:])
            rows[-1] = tuple(np.mean(rows[-averaged:], axis=0))
            break
    integrator.take(_driven(problem, 2.0 * math.pi * rows[-1][0], rows[-1][1], turned))
    integrator.place(way[-1])
    settled = age < LONGEST and motion.is_finite
    frequency, drive, amplitude, phase = np.array(rows).swapaxes(0, 1)
    return ControlledMotion(
        frequency, drive, amplitude, phase, replace(motion, period=0), settled, repeats, periods, measured
    )


def _read(integrator: Integrator, rows: Array, loops: Sequence[ToneControllers], each: Array) -> Complexes:
    """Return the lock-in reading of each tone (m) over periods with these weights, relative to the drives."""
    base, of_mode = kernel.base_of(integrator.tones)[None], [one.of_mode for one in loops]
    found = held_signals(integrator.problem, (each @ rows)[None], base, of_mode)[0]
    return np.asarray(found * integrator.problem.tones[0].A0)


def window_over(omega: Array) -> int:
    """Return the periods of the first tone in a window over tones with these frequencies."""
    if len(omega) == 1:
        return 1
    least = window_length(omega.tolist())
    return min(FAST * math.ceil(max(least, SHORTEST) / FAST), WIDEST)


def _is_noise(errors: Array, accuracy: float) -> bool:
    """Return whether errors, (windows, ...), are below an accuracy, or small with changing signs."""
    return bool(np.abs(errors).max() < (NOISE if _changes_signs(errors) else 1.0) * accuracy)


def _is_stationary(errors: Array) -> bool:
    """Return whether errors, (windows, ...), change their signs in both halves, and are no smaller in the second one."""
    first, second = np.array_split(errors, 2)
    return _changes_signs(first) and _changes_signs(second) and bool(np.std(second) > 0.5 * np.std(first))


def _changes_signs(errors: Array) -> bool:
    """Return whether half of the sum of errors, (windows, ...), or more cancels."""
    return bool((np.abs(errors.sum(axis=0)) <= 0.5 * np.abs(errors).sum(axis=0)).all())


def _units(problem: Problem) -> Array:
    scale = kernel.scales(problem)
    return kernel.units_of(problem, scale.length, scale.speed)


def _driven(problem: Problem, omega: Array, ratio: Array, phase: Array) -> Problem:
    """Return the problem with other frequencies (rad/s), multiples of the drives and phases (rad) of the tones."""
    for j, (frequency, drive) in enumerate(zip((omega / (2.0 * math.pi)).tolist(), ratio.tolist(), strict=True)):
        problem = problem.driven(frequency, drive, j)
    tones = zip(problem.tones, phase.tolist(), strict=True)
    return replace(problem, tones=tuple(replace(tone, phase=at) for tone, at in tones))
