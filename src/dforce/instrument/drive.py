"""The drive: tones, each a force that gives its mode a free amplitude."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import pydantic

from dforce.errors import ParameterError
from dforce.instrument.lever import MOST_MODES, ModeNumbers
from dforce.parameters import MaybeNumber, Number, Parameters, Part, param, part


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
        Free amplitude of its mode (m).
    mode
        Its mode, counted from 0.
    force
        Amplitude of the driving force (N).
    """

    frequency: float
    phase: float
    A0: float
    mode: int
    force: float


def drive_force(mode: ModeNumbers, A0: float, frequency: float) -> float:
    r"""Return the force (N) that moves a free mode by the amplitude `A0` (m) at a frequency (Hz).

    .. math:: F = k A_0 \sqrt{(1 - r^2)^2 + (r / Q)^2}, \qquad r = \omega / \omega_0

    which is :math:`k A_0 / Q` at resonance.
    """
    r = frequency / mode.f0
    return mode.k * A0 * math.hypot((1.0 - r) * (1.0 + r), r / mode.Q)


class Tone(Parameters):
    """One tone of the drive, by the free amplitude that it gives its mode."""

    A0: Number = param(
        unit="m", symbol="A_0", above="0 nm", high="1 mm", doc="free amplitude of its mode at its frequency"
    )
    frequency: MaybeNumber = param(
        None,
        unit="Hz",
        symbol="f",
        above="0 Hz",
        high="10 GHz",
        doc="drive frequency; left out: the f0 of its mode",
    )
    mode: int | None = pydantic.Field(
        default=None,
        ge=1,
        le=MOST_MODES,
        description="mode that A0 is meant for, from 1; left out: the tone's place in the list",
    )
    phase: Number = param(
        "0 deg", symbol=r"\theta", low="-360 deg", high="360 deg", doc="phase of the tone at time zero"
    )


class Drive(Parameters):
    """The drive, a force at the tip: one tone by `A0` (`frequency`, `mode`, `phase`), or `tones`."""

    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "one tone": ("A0", "frequency", "mode", "phase"), "several tones": ("tones",),
    }  # fmt: skip

    A0: MaybeNumber = param(
        None, unit="m", symbol="A_0", above="0 nm", high="1 mm", doc="free amplitude; of several tones each has its own"
    )
    frequency: MaybeNumber = param(
        None,
        unit="Hz",
        symbol="f",
        above="0 Hz",
        high="10 GHz",
        doc="drive frequency; left out: the f0 of its mode",
    )
    mode: int | None = pydantic.Field(
        default=None, ge=1, le=MOST_MODES, description="mode that is driven, from 1; left out: 1"
    )
    phase: Number = param(
        "0 deg", symbol=r"\theta", low="-360 deg", high="360 deg", doc="phase of the drive at time zero"
    )
    tones: Part[tuple[Tone, ...]] = part((), max_length=MOST_MODES, description="tones, instead of a single one")
    acts_on: Literal["all_modes", "own_mode"] = pydantic.Field(
        default="all_modes",
        title="A tone acts on",
        description="all_modes: a tone is a force on the tip, so on every mode; own_mode: only on its own",
    )

    @pydantic.model_validator(mode="after")
    def _one_description(self) -> Self:
        single = [name for name in ("A0", "frequency", "mode", "phase") if getattr(self, name)]
        if self.tones and single:
            raise ParameterError(f"drive has both {single[0]} and tones; give only one of them")
        if not self.tones:
            self.needed("A0")
        return self

    def resolve(self, modes: tuple[ModeNumbers, ...]) -> tuple[ToneNumbers, ...]:
        """Return the tones with mode, frequency and force filled in.

        Raises
        ------
        ParameterError
            When a tone is meant for a mode that the cantilever does not have.
        """
        if self.tones:
            return tuple(
                _tone(f"drive.tones.{place}.mode", tone.A0, tone, tone.mode or place, modes)
                for place, tone in enumerate(self.tones, start=1)
            )
        return (_tone("drive.mode", self.needed("A0"), self, self.mode or 1, modes),)


def _tone(path: str, A0: float, given: Tone | Drive, mode: int, modes: tuple[ModeNumbers, ...]) -> ToneNumbers:
    if mode > len(modes):
        count = "1 mode" if len(modes) == 1 else f"{len(modes)} modes"
        raise ParameterError(f"{path} = {mode}, but the cantilever has only {count}")
    own = modes[mode - 1]
    frequency = own.f0 if given.frequency is None else given.frequency
    return ToneNumbers(frequency, given.phase, A0, mode - 1, drive_force(own, A0, frequency))
