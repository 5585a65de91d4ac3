"""The modes of a lever as numbers, and its tilt."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

from dforce.core.parameters import param
from dforce.instrument.history import FluidMemory

MOST_MODES = 10

# at 0.5 and below the mode does not oscillate by itself: no resonance, and no decay time 2Q/omega
quality = functools.partial(param, unit="1", symbol="Q", above=0.5, high=1e9)
amplitude = functools.partial(param, unit="m", above="0 nm", high="1 mm")
TILT = param(
    None,
    unit="rad",
    symbol=r"\alpha",
    low="0 deg",
    high="60 deg",
    doc="tilt of the lever against the sample, often 11 degrees; normal to the sample it is stiffer by 1/cos^2",
)


@dataclass(frozen=True)
class ModeNumbers:
    """A mode in its medium.

    Attributes
    ----------
    f0, k, Q
        Resonance frequency (Hz), spring constant (N/m) and quality factor.
    base_coupling
        Coupling to the motion of the base; 1 for a point mass.
    added_mass
        Share of the fluid in its mass; None where it is not known.
    memory
        The fluid's load in time; None where it is a mass and a damping. f0 and Q are always the resonance's.
    """

    f0: float
    k: float
    Q: float
    base_coupling: float = 1.0
    added_mass: float | None = None
    memory: FluidMemory | None = None

    @property
    def oscillator(self) -> tuple[float, float]:
        """Frequency (Hz) and Q of the equation of motion; with the fluid's memory only its instantaneous part counts."""
        return (self.f0, self.Q) if self.memory is None else (self.memory.frequency, self.memory.Q)

    def stiffness(self, frequency: Any) -> Any:
        r"""Return the force over the deflection (N/m) at frequencies (Hz), where both go as :math:`e^{i \omega t}`.

        .. math:: k (1 - r^2 + i r / Q), \qquad r = \omega / \omega_0

        or, with the fluid's memory, :meth:`dforce.instrument.history.FluidMemory.stiffness`.
        """
        if self.memory is not None:
            return self.k * self.memory.stiffness(frequency)
        r = frequency / self.f0
        return self.k * ((1.0 - r) * (1.0 + r) + 1j * r / self.Q)


def normal_factor(tilt: float | None) -> float:
    r"""Return by how much a lever that is tilted (rad) is stiffer across the sample than across itself.

    .. math:: \frac{k_\perp}{k} = \frac{1}{\cos^2 \alpha}

    Source: L.-O. Heim, M. Kappl, H.-J. Butt, Langmuir 20, 2760 (2004), without the moment of the tip's height.
    """
    return 1.0 / math.cos(tilt or 0.0) ** 2
