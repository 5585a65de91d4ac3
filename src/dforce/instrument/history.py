r"""The memory of the fluid around a beam: its load depends on frequency, and in time on the past motion.

On a mode that moves as :math:`z e^{p t}` the fluid acts by

.. math:: -m_v T \left[ \Gamma_r - i \Gamma_i \right] p^2 z
          = -m_v T \left[ a p^2 + c\, p + \sum_j w_j \frac{p^2}{p + s_j} \right] z, \qquad p = i \omega

with the mode's mass in vacuum :math:`m_v` and the load T of the fluid, see :func:`dforce.instrument.beam.fluid_mode`. The parts
are mass that follows at once, drag, and fluid that follows late by dashpots, at the rates :math:`s_j`. No part is negative,
because the flow only loses energy: the numbers follow from Γ by non-negative least squares. A Basset force, whose Γ goes as
:math:`\sigma(1 - i)`, is the sum of many such parts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import ParameterError

STATES = 10  # of a mode: Γ is met within 0.2 %
LOWEST, HIGHEST = 0.1, 30.0  # of the first resonance, between which Γ is met; and beyond for modes above
ABOVE = 3.0  # of the highest resonance
# rates lie from the lowest angular frequency over SLOWER to FASTER times the highest: with them a root of the frequency is
# met within 0.5 % over three decades, and faster ones would take shorter steps
SLOWER, FASTER = 3.0, 1.5
PLACES = 60  # frequencies at which Γ is met


@dataclass(frozen=True)
class FluidMemory:
    r"""The load of the fluid on a mode, and the lever's own, as a motion in time.

    .. math:: \ddot z + \gamma \dot z + \Omega^2 z - \sum_j W_j q_j = F / m, \qquad \dot q_j = s_j (\dot z - q_j)

    Attributes
    ----------
    frequency
        :math:`\Omega / 2 \pi` (Hz) with m, the mass of the lever and of the fluid that follows at once.
    Q
        :math:`\Omega / \gamma`, with the damping by the late fluid as well.
    added_mass
        Share of the fluid in m.
    rates, weights
        :math:`s_j` and :math:`W_j` (1/s).
    """

    frequency: float
    Q: float
    added_mass: float
    rates: tuple[float, ...]
    weights: tuple[float, ...]

    def drag(self, frequency: Any) -> Any:
        r"""Return the part of drag in force over deflection at frequencies (Hz), in units of the spring constant.

        .. math:: \frac{i \omega}{\Omega^2} \left[ \gamma - \sum_j \frac{W_j s_j}{s_j + i \omega} \right]
        """
        late = 0.0
        for rate, weight in zip(self.rates, self.weights, strict=True):
            late = late + weight * rate / (rate + 2j * math.pi * frequency)
        own = 2.0 * math.pi * self.frequency
        return 1j * frequency / self.frequency * (1.0 / self.Q - late / own)

    def stiffness(self, frequency: Any) -> Any:
        """Return force over deflection at frequencies (Hz), in units of the spring constant."""
        r = frequency / self.frequency
        return (1.0 - r) * (1.0 + r) + self.drag(frequency)

    def resonance(self) -> tuple[float, float]:
        """Return the frequency (Hz) at which force and deflection are 90 degrees apart, and the quality factor there.

        Raises
        ------
        ParameterError
            Where there is none.
        """
        from scipy.optimize import brentq

        low, high = LOWEST * self.frequency, self.frequency
        if self.stiffness(low).real <= 0.0:
            raise ParameterError(
                "cantilever.beam has no resonance in this medium; write measured f0, k and Q instead of a beam"
            )
        found = float(brentq(lambda f: self.stiffness(f).real, low, high, xtol=1e-12 * high, rtol=1e-14))
        return found, 1.0 / self.stiffness(found).imag


def late_flow(gamma: Callable[[float], complex], low: float, high: float) -> tuple[float, float, Array]:
    r"""Return a, c (1/s) and all :math:`w_j` of a flow between two frequencies (Hz), for the rates of :func:`rates_of`.

    `gamma` is :math:`\Gamma_r + i \Gamma_i` at a frequency (Hz).
    """
    from scipy.optimize import nnls

    frequencies = np.geomspace(low, high, PLACES)
    p = 2j * math.pi * frequencies[:, None]
    parts = np.concatenate([np.ones_like(p), 1.0 / p, 1.0 / (p + rates_of(low, high))], axis=1)
    wanted = np.conj([gamma(float(f)) for f in frequencies])
    relative, unit = parts / np.abs(wanted)[:, None], wanted / np.abs(wanted)
    both = np.concatenate([relative.real, relative.imag])
    size = np.linalg.norm(both, axis=0)
    found = nnls(both / size, np.concatenate([unit.real, unit.imag]))[0] / size
    return float(found[0]), float(found[1]), found[2:]


def rates_of(low: float, high: float) -> Array:
    """Return the rates (1/s) of the fluid that follows late between two frequencies (Hz)."""
    return 2.0 * math.pi * np.geomspace(low / SLOWER, FASTER * high, STATES)


def fluid_memory(
    vacuum_frequency: float, load: float, gamma: Callable[[float], complex], low: float, high: float
) -> FluidMemory:
    r"""Return the memory of a fluid of `load` T on a mode, whose frequency in vacuum is known (Hz).

    Parameters
    ----------
    gamma
        :math:`\Gamma_r + i \Gamma_i` of the mode at a frequency (Hz).
    low, high
        Frequencies (Hz) between which it is met.
    """
    a, c, weights = late_flow(gamma, low, high)
    mass = 1.0 + load * a  # over the lever's mass
    frequency = vacuum_frequency / math.sqrt(mass)
    return FluidMemory(
        frequency=frequency,
        Q=2.0 * math.pi * frequency / (load / mass * (c + float(weights.sum()))),
        added_mass=load * a / mass,
        rates=tuple(rates_of(low, high).tolist()),
        weights=tuple((load / mass * weights).tolist()),
    )


def band(resonances: Sequence[float]) -> tuple[float, float]:
    """Return between which frequencies (Hz) the flow counts for a beam with these resonances (Hz)."""
    return LOWEST * min(resonances), max(HIGHEST * min(resonances), ABOVE * max(resonances))
