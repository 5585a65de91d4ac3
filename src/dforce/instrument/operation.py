"""The mode of operation of a tone: an instrument holds two of its four numbers (drive, frequency, amplitude, phase)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import pydantic

from dforce.core import units
from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, Parameters, param
from dforce.instrument.modes import ModeNumbers

# the two numbers that each mode of operation holds; it measures the other two
HELD = {
    "am": ("drive", "frequency"),
    "fm": ("amplitude", "phase"),
    "ce_fm": ("drive", "phase"),
    "pm": ("amplitude", "frequency"),
}
BESIDE = (0.01, 0.03, 0.1, 0.3, 0.6, 0.9)  # of the way to 0 and 180 degrees: lags around the free lock


@dataclass(frozen=True)
class Lock:
    """The set points of a tone's controllers, which hold amplitude or phase.

    Attributes
    ----------
    operation
        A name in :data:`HELD`, other than "am".
    phase
        Set point of the phase lag (rad).
    of_mode
        Whether the lock-in reads the tone's own mode; otherwise the detector's signal.
    """

    operation: str
    phase: float
    of_mode: bool

    @property
    def held(self) -> tuple[str, str]:
        """The two numbers that are held."""
        return HELD[self.operation]


class Operated(Parameters):
    """How a tone is controlled: its mode of operation, the set point of its phase, and the signal of its lock-in."""

    unfolded: ClassVar[Mapping[str, tuple[str, ...]]] = {"operation": ("phase_set_point", "signal")}

    operation: Literal["am", "fm", "ce_fm", "pm"] = pydantic.Field(
        default="am",
        title="Mode of operation",
        description="am: constant drive and frequency (tapping mode); fm: constant amplitude and phase (FM-AFM); ce_fm: "
        "constant drive and phase; pm: constant amplitude and frequency",
    )
    phase_set_point: Number = param(
        "90 deg",
        symbol=r"\phi_\mathrm{set}",
        above="0 deg",
        below="180 deg",
        doc="phase lag that the controller holds; for fm and ce_fm",
    )
    signal: Literal["total", "mode"] = pydantic.Field(
        default="total",
        title="Lock-in reads",
        description="fm, ce_fm, pm: total: the detector's signal; mode: the deflection of the tone's own mode",
    )

    @pydantic.model_validator(mode="after")
    def _held_and_given(self) -> Self:
        held = HELD[self.operation]
        if "phase" not in held and self.phase_set_point != math.pi / 2.0:
            raise ParameterError(
                f'has phase_set_point, but operation = "{self.operation}" holds no phase; write operation = "fm" or "ce_fm"'
            )
        if self.operation == "am" and self.signal == "mode":
            raise ParameterError('has signal = "mode", but operation = "am" locks nothing; remove signal')
        if self.operation != "am" and getattr(self, "base_amplitude", None) is not None:
            raise ParameterError(f'has base_amplitude, but operation = "{self.operation}" needs A0; write A0 instead')
        if "frequency" not in held and getattr(self, "frequency", None) is not None:
            raise ParameterError(f'has a frequency, but operation = "{self.operation}" finds it; remove frequency')
        return self

    @property
    def lock(self) -> Lock | None:
        """The lock of the tone; None in amplitude modulation."""
        if self.operation == "am":
            return None
        return Lock(self.operation, self.phase_set_point, self.signal == "mode")


def free_lock(response: Callable[[float], complex], mode: ModeNumbers, phase: float) -> float:
    r"""Return the frequency (Hz) at which a signal without tip–sample forces has a phase lag (rad).

    For a mode alone :math:`1 - r^2 = (r / Q) \cot\phi`. Other modes contribute to the total deflection: of several
    frequencies, the nearest to this solution counts.

    Parameters
    ----------
    response
        Complex amplitude of the signal at a frequency (Hz), relative to the drive.

    Raises
    ------
    ParameterError
        When no frequency near the mode's resonance has this lag.
    """
    from scipy.optimize import brentq  # loading it takes long

    def alone(lag: float) -> float:
        cot = 1.0 / math.tan(lag)
        return float(mode.f0 * (-cot / (2.0 * mode.Q) + math.sqrt(1.0 + cot * cot / (4.0 * mode.Q**2))))

    def miss(frequency: float) -> float:
        turned = response(frequency) * complex(math.cos(phase), math.sin(phase))
        return math.atan2(-turned.imag, turned.real)

    for share in BESIDE:
        low, high = alone(phase * (1.0 - share)), alone(phase + (math.pi - phase) * share)
        below, above = miss(low), miss(high)
        if low > 0.0 and below <= 0.0 < above < below + math.pi:
            return float(brentq(miss, low, high, xtol=1e-13 * mode.f0, rtol=1e-15))
    remedy = "write one near 90 deg"
    if abs(miss(alone(phase))) > math.pi / 2.0:
        remedy = 'the signal is inverted: add 180 deg to the lag of this tone (lag = "180 deg")'
    raise ParameterError(
        f"no frequency near the resonance of its mode has the phase lag phase_set_point = {units.show(phase, 'rad', 4)}; "
        f"{remedy}"
    )
