"""The read-out: the detector's signal of the motion, and the reference of its phase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import MaybeNumber, Numbers, Parameters, param
from dforce.instrument import beam


@dataclass(frozen=True)
class ReadoutNumbers:
    """The reading of the detector.

    Attributes
    ----------
    weights
        Weight of each mode's deflection at each tone, a row for each tone.
    base
        Weight of the base's motion.
    turns
        Offset of the phase at each tone (rad).
    """

    weights: tuple[tuple[float, ...], ...]
    base: float = 0.0
    turns: tuple[float, ...] = ()


class Readout(Parameters):
    """The detector. Amplitude and phase of a result, A0 and the set point refer to its signal."""

    kind: Literal["deflection", "optical_lever", "interferometer"] = pydantic.Field(
        default="deflection",
        title="Detector",
        description="deflection: sum of the modes; optical_lever: slope at the end of the lever; interferometer: position of "
        "the tip, with the base",
    )
    calibrated: Literal["static", "each_mode"] = pydantic.Field(
        default="static",
        title="Optical lever calibrated",
        description="static: by a force curve on a hard sample; each_mode: each mode by itself",
    )
    mode_sensitivity: Numbers = param(
        (),
        unit="1",
        symbol="s_n",
        low=-1e3,
        high=1e3,
        doc="sensitivity of the optical lever to each mode over its static sensitivity; default: a uniform beam",
    )
    invols: MaybeNumber = param(
        None,
        unit="m/V",
        above="0 nm/V",
        high="1 mm/V",
        doc="inverse sensitivity of the optical lever, from a force curve on a hard sample: A0 may then be in volts",
    )
    phase_reference: Literal["drive", "free"] | None = pydantic.Field(
        default=None,
        title="Phase counts from",
        description="drive: lag behind the drive; free: 90 degrees in free motion; default: the drive, or the free motion "
        'at the frequency "peak"',
    )

    @pydantic.model_validator(mode="after")
    def _of_a_lever_of_light(self) -> Self:
        if self.kind != "optical_lever":
            for name, given in (
                ("mode_sensitivity", self.mode_sensitivity),
                ("calibrated", self.calibrated == "each_mode"),
            ):
                if given:
                    raise ParameterError(f'readout.{name} needs kind = "optical_lever"')
        if 0.0 in self.mode_sensitivity:
            raise ParameterError("readout.mode_sensitivity has a 0, but an invisible mode cannot be calibrated")
        return self

    def sensitivities(self, modes: int) -> tuple[float, ...]:
        """Return the weight of each mode's deflection in the signal, before each mode is calibrated by itself.

        Raises
        ------
        ParameterError
            When the number of sensitivities differs from the number of modes.
        """
        if self.kind != "optical_lever":
            return (1.0,) * modes
        given = self.mode_sensitivity or tuple(beam.lever_factor(n) for n in range(1, modes + 1))
        if len(given) != modes:
            raise ParameterError(
                f"readout.mode_sensitivity has {len(given)} values for {modes} modes; write one for each"
            )
        return given

    def weights(self, modes: int, mode: int) -> tuple[float, ...]:
        """Return the weight of each mode in the signal at the tone of `mode` (counted from 0)."""
        given = self.sensitivities(modes)
        return tuple(one / given[mode] for one in given) if self.calibrated == "each_mode" else given

    @property
    def sees_base(self) -> float:
        """Weight of the base's motion in the signal: 1 for an interferometer, else 0."""
        return 1.0 if self.kind == "interferometer" else 0.0
