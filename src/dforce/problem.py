"""The problem: the checked, frozen input of kernel and solvers, in SI units."""

from __future__ import annotations

import cmath
import dataclasses
import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from dforce.core import units
from dforce.core.arrays import Complexes
from dforce.core.errors import ParameterError
from dforce.forces import Force, refuse_double_counting
from dforce.instrument import (
    BaseMotion,
    Cantilever,
    Contact,
    Drive,
    Heights,
    Medium,
    ModeNumbers,
    Noise,
    NoiseNumbers,
    Readout,
    ReadoutNumbers,
    Sample,
    Tip,
    ToneNumbers,
    heights_of,
)
from dforce.instrument.operation import free_lock
from dforce.instrument.shared import instrument_values, with_values

LATEST = 3e6  # periods: in a later return a change per period is rounding, beside the steps that give derivatives
WIDEST = 1e4  # ratio of the frequencies of modes and tones; a drive so slow or fast is a slip, and would take hours
SMALLEST, LARGEST = 1e-150, 1e150  # squares and quotients of such numbers are still floats


class Instrument(NamedTuple):
    """The parts of an instrument, as in a case."""

    cantilever: Cantilever
    drive: Drive
    tip: Tip = Tip()
    sample: Sample = Sample()
    contact: Contact = Contact()
    medium: Medium = Medium()
    readout: Readout = Readout()


@dataclass(frozen=True)
class Problem:
    r"""A cantilever of several modes, driven by several tones over a sum of forces.

    .. math:: m_n \ddot z_n + \frac{m_n \omega_n}{Q_n} \dot z_n + k_n z_n
              = \mathrm{Re} \sum_j \hat F_{jn} e^{i (\omega_j t + \theta_j)} + F_\mathrm{ts}(d, \dot d), \qquad
              d = z_c + Y + \sum_n z_n, \qquad m_n = k_n / \omega_n^2

    with the forces :math:`\hat F_{jn}` of :attr:`drive`, and the motion Y of the base, 0 under a force.

    Attributes
    ----------
    modes, tones
        The numbers of each mode and tone.
    acts_on
        ``"all_modes"`` or ``"own_mode"``: the modes that a force acts on.
    readout
        The reading of the detector.
    shaken
        The base's motion; None under a force.
    noise
        Thermal noise and detector noise; steady motion has none.
    heights
        Modes and tones at each distance, where they change with it; see :meth:`at_height`.
    forces
        Force models, bound to the instrument, in the order of their names: the numbers and the compiled code do not
        depend on the order in a case.
    places
        Place of each of them in the case, counted from 0.
    a0
        Intermolecular distance (m): contact is at d < a0.
    """

    modes: tuple[ModeNumbers, ...]
    tones: tuple[ToneNumbers, ...]
    acts_on: str
    forces: tuple[Force, ...]
    places: tuple[int, ...]
    a0: float
    readout: ReadoutNumbers
    shaken: BaseMotion | None = None
    noise: NoiseNumbers = dataclasses.field(default_factory=NoiseNumbers)
    heights: Heights | None = None

    @classmethod
    def build(cls, instrument: Instrument, forces: Iterable[Force] = (), noise: Noise | None = None) -> Self:
        """Return the problem of an instrument, with every default filled in.

        Raises
        ------
        ParameterError
            When a force needs a missing value, two forces count one interaction, a tone drives a missing mode, or a
            number is too small or large to compute with.
        """
        cantilever, drive, tip, sample, contact, medium, readout = instrument
        if tip.radius is None and cantilever.tip_radius is not None:
            tip = tip.model_copy(update={"radius": cantilever.tip_radius})
        modes = cantilever.resolve(medium)
        tones = drive.resolve(modes, readout)
        shaken = drive.base()
        _refuse_unknown_fluid(cantilever, modes, shaken, medium)
        values = instrument_values(modes, tip, sample, contact, medium)
        chosen = tuple(forces)
        refuse_double_counting(chosen)
        _refuse_extremes(modes, tones)
        _refuse_wide_band(noise, tones)
        bound = [with_values(force, values) for force in chosen]
        places = sorted(range(len(bound)), key=lambda place: _rank(bound[place]))
        numbers = ReadoutNumbers(tuple(readout.weights(len(modes), tone.mode) for tone in tones), readout.sees_base)
        problem = cls(
            modes=modes,
            tones=tones,
            acts_on=drive.acts_on,
            forces=tuple(bound[place] for place in places),
            places=tuple(places),
            a0=contact.a0,
            readout=numbers,
            shaken=shaken,
            noise=(noise or Noise()).resolve(medium.temperature),
            heights=heights_of(cantilever, drive, medium, readout, modes, tones),
        )
        if problem.is_locked:
            return problem._at_free_lock(readout)
        tuned = [tone.frequency == "peak" for tone in drive.tones or (drive,)]
        free = [readout.phase_reference == "free" or (readout.phase_reference is None and peak) for peak in tuned]
        if not any(free):
            return problem
        lags = [tone.phase - cmath.phase(c) for tone, c in zip(tones, problem.detected_free, strict=True)]
        turns = tuple(math.pi / 2.0 - lag if one else 0.0 for lag, one in zip(lags, free, strict=True))
        return dataclasses.replace(problem, readout=dataclasses.replace(numbers, turns=turns))

    @functools.cached_property
    def drive(self) -> Complexes:
        r"""Complex amplitude (N) of the force of each tone on each mode, shape (tones, modes).

        Under a force :math:`F_j e^{-i\lambda_j}` on all modes, or on the tone's own; over a shaken base
        :meth:`dforce.instrument.BaseMotion.force`.
        """
        force = np.empty((len(self.tones), len(self.modes)), dtype=complex)
        for j, tone in enumerate(self.tones):
            for n, mode in enumerate(self.modes):
                if self.shaken is not None:
                    force[j, n] = self.shaken.force(mode, tone.frequency) * self.base[j]
                else:
                    acts = self.acts_on == "all_modes" or n == tone.mode
                    force[j, n] = tone.force * cmath.exp(-1j * tone.lag) if acts else 0.0
        force.flags.writeable = False
        return force

    @functools.cached_property
    def base(self) -> Complexes:
        r"""Complex amplitude (m) of the base at each tone, :math:`Y = \mathrm{Re} \sum_j Y_j e^{i (\omega_j t + \theta_j)}`."""
        base = np.zeros(len(self.tones), dtype=complex)
        if self.shaken is not None:
            for j, tone in enumerate(self.tones):
                base[j] = tone.base * self.shaken.piezo_response(tone.frequency) * cmath.exp(-1j * tone.lag)
        base.flags.writeable = False
        return base

    @functools.cached_property
    def tip_drive(self) -> Complexes:
        r"""Complex amplitude (N) of the forces that would move the tip as the drive does, shape (tones, modes).

        The force on the tip depends only on d. So the base's motion at a tone may be added to the deflection of the tone's
        own mode: :math:`w_n = z_n + Y_j` obeys the equation of :math:`z_n` under the force :math:`\hat F_{jn} + k_n
        (1 - r^2 + i r / Q_n) Y_j`, and :math:`d = z_c + \sum_n w_n`. Solvers use :math:`w_n`.
        """
        force = self.drive.copy()
        for j, tone in enumerate(self.tones):
            if self.base[j]:
                force[j, tone.mode] += self.modes[tone.mode].stiffness(tone.frequency) * self.base[j]
        force.flags.writeable = False
        return force

    @property
    def is_locked(self) -> bool:
        """Whether controllers hold the amplitude or the phase of a tone."""
        return any(tone.lock is not None for tone in self.tones)

    @property
    def unlocked(self) -> Self:
        """The problem in amplitude modulation, at the frequency and drive of its tones."""
        return dataclasses.replace(self, tones=tuple(dataclasses.replace(tone, lock=None) for tone in self.tones))

    def refuse_lock(self, subject: str) -> None:
        """Raise :class:`ParameterError` where controllers hold amplitude or phase; `subject` begins the sentence."""
        names = [tone.lock.operation for tone in self.tones if tone.lock is not None]
        if names:
            raise ParameterError(
                f'{subject} needs drive.operation = "am"; "{names[0]}" suits an approach, branches and a dwell'
            )

    def _at_free_lock(self, readout: Readout) -> Self:
        """Return the problem with the frequency and drive of each tone that its controllers find without tip–sample forces."""
        if readout.phase_reference == "free":
            raise ParameterError(
                'readout.phase_reference = "free" needs drive.operation = "am"; a lock counts its phase from the drive'
            )
        found = self
        for j, tone in enumerate(self.tones):
            if tone.lock is None:
                continue

            def response(frequency: float, j: int = j) -> complex:
                return self.driven(frequency, 1.0, j).signal(j)

            self.refuse_changing_lever(f'drive.operation = "{tone.lock.operation}"')
            frequency = tone.frequency
            if "phase" in tone.lock.held:
                frequency = free_lock(response, self.modes[tone.mode], tone.lock.phase)
            found = found.driven(frequency, tone.A0 / abs(response(frequency)), j)
        return found

    def signal(self, tone: int) -> complex:
        """Return the complex amplitude (m) that a tone's lock-in reads without tip–sample forces, relative to the drive."""
        given = self.tones[tone]
        is_mode = given.lock is not None and given.lock.of_mode
        read = self.free[tone, given.mode] if is_mode else self.detected_free[tone]
        return complex(read * cmath.exp(-1j * given.phase))

    @property
    def lagging(self) -> bool:
        """Whether :attr:`tip_drive` may have imaginary parts."""
        return self.shaken is not None or any(tone.lag != 0.0 for tone in self.tones)

    @property
    def late_fluid(self) -> int:
        """Number of states of each mode for the late fluid; 0 where it has no memory."""
        memory = self.modes[0].memory
        return 0 if memory is None else len(memory.rates)

    @property
    def late_surface(self) -> Force | None:
        """The force whose surface returns so late that no motion repeats in practice; None where there is none."""
        latest = LATEST / self.tones[0].frequency
        return next((force for force in self.forces if force.recovery_time > latest), None)

    def refuse_changing_lever(self, subject: str) -> None:
        """Raise :class:`ParameterError` where the lever changes with its height; `subject` begins the sentence."""
        if self.heights is not None:
            raise ParameterError(
                f"{subject} needs a lever that is constant over distance; remove cantilever.drift, or write "
                'cantilever.beam.wall = "at_sample"'
            )

    @property
    def own_modes(self) -> list[int]:
        """The mode that each tone is meant for."""
        return [tone.mode for tone in self.tones]

    @functools.cached_property
    def free(self) -> Complexes:
        r"""Steady motion without tip–sample forces, complex amplitudes (m) of shape (tones, modes).

        Mode n moves as :math:`z_n = \mathrm{Re} \sum_j X_{jn} e^{i \omega_j t}` with

        .. math:: X_{jn} = \frac{\hat F_{jn} e^{i \theta_j}}{k_n (1 - r^2 + i r / Q_n)},
                  \qquad r = \omega_j / \omega_n
        """
        motion = np.empty((len(self.tones), len(self.modes)), dtype=complex)
        for j, tone in enumerate(self.tones):
            for n, mode in enumerate(self.modes):
                motion[j, n] = self.drive[j, n] * np.exp(1j * tone.phase) * (1.0 / mode.stiffness(tone.frequency))
        motion.flags.writeable = False
        return motion

    @functools.cached_property
    def detected_free(self) -> Complexes:
        """Complex amplitude (m) that the detector reads at each tone without tip–sample forces, shape (tones,)."""
        phases = np.exp(1j * np.array([tone.phase for tone in self.tones]))
        read = np.asarray((self.free * self.readout.weights).sum(axis=1) + self.readout.base * self.base * phases)
        read.flags.writeable = False
        return read

    def free_lag(self, tone: int) -> float:
        """Return the phase (degrees) that the detector reads at a tone without tip–sample forces, from -90° to 270°."""
        turn = self.readout.turns[tone] if self.readout.turns else 0.0
        lag = self.tones[tone].phase - cmath.phase(self.detected_free[tone]) + turn
        return (math.degrees(lag) + 90.0) % 360.0 - 90.0

    @property
    def tip_differs(self) -> bool:
        """Whether tip motion and detector signal differ."""
        others = any(weight != 1.0 for weights in self.readout.weights for weight in weights)
        return others or self.shaken is not None or any(self.readout.turns)

    @functools.cached_property
    def tip_share(self) -> float:
        """Free amplitude of the tip at the first tone over its reading A0: lengths of the motion are in multiples of it."""
        if not self.tip_differs:
            return 1.0
        tone = self.tones[0]
        return float(abs(self.free[0, tone.mode] + self.base[0] * cmath.exp(1j * tone.phase)) / tone.A0)

    def at_height(self, zc: float) -> Self:
        """Return the problem as it is at an average distance (m), where the lever changes with it; else the same one.

        Phases are counted from where they were.
        """
        if self.heights is None:
            return self
        modes, tones = self.heights.at(zc)
        return dataclasses.replace(self, modes=modes, tones=tones, heights=None)

    def at_frequency(self, frequency: float, tone: int = 0) -> Self:
        """Return the problem with another frequency (Hz) of a tone (counted from 0), under the same driving force or base.

        The tone's `A0` does not change: it is the free amplitude that this drive gives at the earlier frequency.
        """
        changed = dataclasses.replace(self.tones[tone], frequency=frequency)
        if self.shaken is not None:
            moved = changed.base * self.shaken.piezo_response(frequency)
            force = abs(self.shaken.force(self.modes[changed.mode], frequency) * moved)
            changed = dataclasses.replace(changed, force=force)
        tones = (*self.tones[:tone], changed, *self.tones[tone + 1 :])
        return dataclasses.replace(self, tones=tones)

    def driven(self, frequency: float, ratio: float, tone: int = 0) -> Self:
        """Return the problem with another frequency (Hz) of a tone, and so many times its driving force or base motion."""
        there = self.at_frequency(frequency, tone)
        given = there.tones[tone]
        stronger = dataclasses.replace(given, force=ratio * given.force, base=ratio * given.base)
        return dataclasses.replace(there, tones=(*there.tones[:tone], stronger, *there.tones[tone + 1 :]))


def _rank(force: Force) -> tuple[str, ...]:
    """Return the sort key of a force: its name and its text, but no number, which a sweep may change."""
    return (force.name, *(value for _, value in force if isinstance(value, str)))


def _refuse_unknown_fluid(
    cantilever: Cantilever, modes: tuple[ModeNumbers, ...], shaken: BaseMotion | None, medium: Medium
) -> None:
    """Raise :class:`ParameterError` where fluid is to move with the base and its mass is not known."""
    if shaken is None or not shaken.fluid_follows:
        return
    if medium.name == "vacuum":
        raise ParameterError(
            "drive.fluid_follows is above 0, but the medium is vacuum: vacuum has no fluid to follow the base"
        )
    for n, mode in enumerate(modes, start=1):
        if mode.added_mass is None:
            key = f"cantilever.modes.{n}.added_mass" if cantilever.modes else "cantilever.added_mass"
            raise ParameterError(
                f"drive.fluid_follows needs the share of the fluid in the mass of mode {n}: write {key}, or use a beam in a "
                f"fluid"
            )


def _refuse_wide_band(noise: Noise | None, tones: tuple[ToneNumbers, ...]) -> None:
    """Raise :class:`ParameterError` where the lock-in's bandwidth exceeds a drive frequency."""
    slowest = min(tone.frequency for tone in tones)
    if noise is not None and noise.bandwidth is not None and noise.bandwidth > slowest:
        band, drive = units.show(noise.bandwidth, "Hz", 4), units.show(slowest, "Hz", 4)
        raise ParameterError(f"noise.bandwidth = {band} is above the drive frequency, {drive}")


def _refuse_extremes(modes: tuple[ModeNumbers, ...], tones: tuple[ToneNumbers, ...]) -> None:
    """Raise :class:`ParameterError` where numbers that follow from the given ones are too small or large to compute with."""
    frequencies = [*(mode.f0 for mode in modes), *(tone.frequency for tone in tones)]
    if max(frequencies) > WIDEST * min(frequencies):
        spread = units.show_range(min(frequencies), max(frequencies), "Hz", 4)
        raise ParameterError(
            f"the frequencies of modes and drive range from {spread}, and may differ by a factor of {WIDEST:g} at "
            "most; correct f0 or drive.frequency"
        )
    named: dict[str, float] = {}
    for n, mode in enumerate(modes, start=1):
        named |= {f"cantilever mode {n}: {name}": getattr(mode, name) for name in ("f0", "k", "Q")}
    for j, tone in enumerate(tones, start=1):
        named |= {f"drive tone {j}: {name}": getattr(tone, name) for name in ("frequency", "A0", "force", "base")}
    for name, value in named.items():
        if value and math.isfinite(value) and not SMALLEST < abs(value) < LARGEST:
            raise ParameterError(
                f"{name} = {value:g} is too {'small' if abs(value) <= SMALLEST else 'large'} to compute with"
            )
