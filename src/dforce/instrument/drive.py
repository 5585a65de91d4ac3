"""The drive: tones that push the tip, or shake the base, so that each gives its mode a free amplitude."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import MaybeNumber, Number, Part, param, part
from dforce.instrument.base import BaseMotion, Piezo, peak_ratio
from dforce.instrument.modes import MOST_MODES, ModeNumbers, amplitude
from dforce.instrument.operation import Lock, Operated
from dforce.instrument.readout import Readout

SEVERAL_TONES = (
    'several tones are tables [[drive.tones]] in a file, drive = { tones = [{ A0 = "10 nm" }, { A0 = "1 nm" }] }'
)
BASE_OR_FORCE = (
    'write excitation = "base" for a shaken base (acoustic drive), "force" for a magnetic or photothermal drive'
)
FARTHEST = 1000.0  # free amplitudes: a base that has to move more cannot drive its mode
angle = functools.partial(param, "0 deg", low="-360 deg", high="360 deg")
BASE_AMPLITUDE = amplitude(None, symbol="Y", doc="amplitude of the driven base, instead of A0")
FREQUENCY = param(
    None,
    unit="Hz",
    symbol="f",
    above="0 Hz",
    high="10 GHz",
    doc="drive frequency; peak: at the largest free response of its mode; default: the f0 of its mode",
)
LAG = angle(
    symbol=r"\lambda", doc="lag of the force, or of the base, behind the drive signal, as in photothermal drive"
)

if TYPE_CHECKING:

    class MaybeTuned:
        """A frequency, or how it is found, or nothing."""

        def __get__(self, owner: object, kind: type | None = None) -> float | Literal["peak"] | None: ...
        def __set__(self, owner: object, value: float | str | None) -> None: ...
else:
    MaybeTuned = float | Literal["peak"] | None


@dataclass(frozen=True)
class ToneNumbers:
    """One tone of the drive.

    Attributes
    ----------
    frequency
        Hz.
    phase
        Phase at time zero (rad).
    A0
        Free amplitude of its mode (m), as the detector reads it.
    mode
        Its mode, counted from 0.
    force
        Amplitude of the force that drives its mode (N).
    lag
        Lag of the force, or of the base, behind the drive signal (rad).
    base
        Amplitude of the base far below the piezo's resonance (m); 0 under a force.
    lock
        The quantities that its controllers hold; None in amplitude modulation. Where they hold amplitude or phase, the
        frequency, force and base of the free lock.
    """

    frequency: float
    phase: float
    A0: float
    mode: int
    force: float
    lag: float = 0.0
    base: float = 0.0
    lock: Lock | None = None


def drive_force(mode: ModeNumbers, A0: float, frequency: float) -> float:
    r"""Return the force (N) that moves a free mode by the amplitude `A0` (m) at a frequency (Hz).

    .. math:: F = k A_0 \sqrt{(1 - r^2)^2 + (r / Q)^2}, \qquad r = \omega / \omega_0

    which is :math:`k A_0 / Q` at resonance.
    """
    return float(A0 * abs(mode.stiffness(frequency)))


class Tone(Operated):
    """One tone of the drive, by the free amplitude of its mode, or by the amplitude of the base."""

    A0: MaybeNumber = amplitude(None, symbol="A_0", doc="free amplitude of its mode, at its frequency")
    base_amplitude: MaybeNumber = BASE_AMPLITUDE
    frequency: MaybeTuned = FREQUENCY
    mode: int | None = pydantic.Field(
        default=None, ge=1, le=MOST_MODES, description="mode of the tone, from 1; default: the position in the list"
    )
    phase: Number = angle(symbol=r"\theta", doc="phase of the tone at time zero")
    lag: Number = LAG

    @pydantic.model_validator(mode="after")
    def _an_amplitude(self) -> Self:
        if self.A0 is None and self.base_amplitude is None:
            raise ParameterError("has neither A0 (free amplitude) nor base_amplitude; write one of them")
        if self.A0 is not None and self.base_amplitude is not None:
            raise ParameterError("has both A0 and base_amplitude; write one of them")
        return self


class Drive(Operated):
    """The drive: one tone (`A0`, `frequency`, `mode`, `phase`) or several `tones`, by a force on the tip or by the base."""

    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "one tone": ("A0", "base_amplitude", "frequency", "mode", "phase", "lag", *Operated.model_fields),
        "several tones": ("tones",),
    }

    A0: MaybeNumber = amplitude(None, symbol="A_0", doc="free amplitude; with several tones each has its own")
    base_amplitude: MaybeNumber = BASE_AMPLITUDE
    frequency: MaybeTuned = FREQUENCY
    mode: int | None = pydantic.Field(default=None, ge=1, le=MOST_MODES, description="driven mode, from 1; default: 1")
    phase: Number = angle(symbol=r"\theta", doc="phase of the drive at time zero")
    lag: Number = LAG
    tones: Part[tuple[Tone, ...]] = part((), max_length=MOST_MODES, description="tones, instead of a single one")
    excitation: Literal["force", "base"] = pydantic.Field(
        default="force",
        title="Driven by",
        description="force: magnetic or photothermal, a force on the tip; base: a piezo moves the base of the lever",
    )
    acts_on: Literal["all_modes", "own_mode"] = pydantic.Field(
        default="all_modes",
        title="A tone acts on",
        description="all_modes: a tone is a force on the tip, so on every mode; own_mode: only on its mode",
    )
    fluid_follows: Number = param(
        0.0,
        unit="1",
        symbol="s",
        low=0.0,
        high=1.0,
        doc="share of the fluid that moves with the base; 0: fluid at rest, 1: the whole cell moves",
    )
    piezo: Part[Piezo | None] = part(None, description="resonance of the piezo that drives the base")

    hints: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("kind", "type", "base", "acoustic"), BASE_OR_FORCE),
        **dict.fromkeys(("A1", "A2", "A01", "A02", "f2"), SEVERAL_TONES),
        **dict.fromkeys(("set_point", "setpoint"), "write set_point under [experiment]"),
    }

    @pydantic.model_validator(mode="before")
    @classmethod
    def _several_tones(cls, data: object) -> object:
        A0 = data.get("A0") if isinstance(data, dict) else None
        if isinstance(data, list | tuple) or isinstance(A0, list | tuple):
            raise ParameterError(f"{'has several A0' if A0 is not None else 'is a list'}; {SEVERAL_TONES}")
        return data

    @pydantic.model_validator(mode="after")
    def _one_description(self) -> Self:
        usual = vars(Tone(A0=1e-9)) | {"A0": None}
        single = [name for name in self.ways["one tone"] if getattr(self, name) != usual[name]]
        if self.tones and single:
            raise ParameterError(f"drive has both {single[0]} and tones; write only one of them")
        if not self.tones and self.base_amplitude is None:
            self.needed("A0")
        if self.A0 is not None and self.base_amplitude is not None:
            raise ParameterError("drive has both A0 and base_amplitude; write one of them")
        self._of_a_base()
        return self

    def _of_a_base(self) -> None:
        if self.excitation == "base":
            if self.acts_on == "own_mode":
                raise ParameterError("drive.acts_on needs a force; a driven base acts on every mode")
            return
        for name in ("fluid_follows", "piezo"):
            if getattr(self, name):
                raise ParameterError(f'drive.{name} needs base excitation; write excitation = "base"')
        if self.base_amplitude is not None or any(tone.base_amplitude is not None for tone in self.tones):
            raise ParameterError('drive.base_amplitude needs base excitation; write excitation = "base"')

    def base(self) -> BaseMotion | None:
        """Return the motion of the base; None if a force drives the tip."""
        if self.excitation == "force":
            return None
        return BaseMotion(self.fluid_follows, *((self.piezo.f0, self.piezo.Q) if self.piezo else ()))

    def resolve(self, modes: tuple[ModeNumbers, ...], readout: Readout) -> tuple[ToneNumbers, ...]:
        """Return the tones in SI, each with its mode, its frequency, and the amplitudes of force and base.

        Raises
        ------
        ParameterError
            When the cantilever lacks the mode of a tone, or the base cannot drive it.
        """
        base = self.base()
        if self.tones:
            return tuple(
                _tone(f"drive.tones.{place}", tone, tone.mode or place, modes, base, readout)
                for place, tone in enumerate(self.tones, start=1)
            )
        return (_tone("drive", self, self.mode or 1, modes, base, readout),)


def _tone(
    path: str,
    given: Tone | Drive,
    number: int,
    modes: tuple[ModeNumbers, ...],
    base: BaseMotion | None,
    readout: Readout,
) -> ToneNumbers:
    if number > len(modes):
        count = "1 mode" if len(modes) == 1 else f"{len(modes)} modes"
        raise ParameterError(
            f"{path}.mode = {number}, but the cantilever has only {count}; add modes by cantilever.higher_modes, "
            "cantilever.modes or cantilever.beam.modes"
        )
    mode = modes[number - 1]
    seen = readout.weights(len(modes), number - 1)[number - 1]
    if given.frequency == "peak":
        frequency = mode.f0 * peak_ratio(mode, base, f"{path}.frequency")
    else:
        frequency = mode.f0 if given.frequency is None else given.frequency
    if base is None:
        A0 = given.needed("A0")
        force = drive_force(mode, A0 / abs(seen), frequency)
        return ToneNumbers(frequency, given.phase, A0, number - 1, force, given.lag, lock=given.lock)
    push = base.force(mode, frequency)  # N per meter of the base
    response = abs(seen * push / mode.stiffness(frequency) + readout.sees_base)
    if push == 0.0 or response * FARTHEST < 1.0:
        raise ParameterError(
            f"{path}: the base cannot drive mode {number} at {frequency:.6g} Hz; it would need to move by more than "
            f"{FARTHEST:g} times A0"
        )
    if given.base_amplitude is not None:
        moved, A0 = given.base_amplitude, response * given.base_amplitude
    else:
        A0 = given.needed("A0")
        moved = A0 / response
    static = moved / abs(base.piezo_response(frequency))
    return ToneNumbers(frequency, given.phase, A0, number - 1, abs(push) * moved, given.lag, static, given.lock)
