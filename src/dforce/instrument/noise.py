"""Noise: thermal motion of the lever, and the detector's own noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import pydantic

from dforce.core.parameters import MaybeNumber, Parameters, param

BOLTZMANN = 1.380649e-23  # J/K, exact since 2019
ROOM = 298.15  # K


@dataclass(frozen=True)
class NoiseNumbers:
    """The noise of the lever and of its reading.

    Attributes
    ----------
    temperature
        Of the medium (K).
    thermal
        Whether thermal motion counts.
    detector
        Noise of the detector (m/Hz^0.5), as it reads deflections.
    bandwidth, poles
        Equivalent noise bandwidth of the lock-in (Hz), and its poles; None where it is not given.
    seed
        Of the random numbers.
    """

    temperature: float = ROOM
    thermal: bool = True
    detector: float = 0.0
    bandwidth: float | None = None
    poles: int = 1
    seed: int = 1

    @property
    def kT(self) -> float:
        """Thermal energy (J); 0 where thermal motion does not count."""
        return BOLTZMANN * self.temperature if self.thermal else 0.0


class Noise(Parameters):
    """Noise of the lever and of the detector: for `df.noise`, and for runs with `integrator = "langevin"`."""

    thermal: bool = pydantic.Field(
        default=True, title="Thermal motion", description="whether the lever has thermal motion"
    )
    detector: MaybeNumber = param(
        None,
        unit="m/Hz^0.5",
        symbol="n_d",
        low="0 m/Hz^0.5",
        high="1e-9 m/Hz^0.5",
        doc="white noise of the detector, as a deflection; added to thermal noise",
    )
    bandwidth: MaybeNumber = param(
        None, unit="Hz", symbol="B", above="0 Hz", high="10 GHz", doc="equivalent noise bandwidth of the lock-in"
    )
    poles: int = pydantic.Field(default=1, ge=1, le=8, description="poles of the lock-in's low-pass filter, all equal")
    seed: int = pydantic.Field(
        default=1, ge=0, le=2**62, description="seed of the random numbers: equal seeds give equal noise"
    )

    def resolve(self, temperature: float) -> NoiseNumbers:
        """Return the noise in SI at a temperature (K)."""
        return NoiseNumbers(temperature, self.thermal, self.detector or 0.0, self.bandwidth, self.poles, self.seed)


def time_constant(bandwidth: float, poles: int) -> float:
    r"""Return the time constant (s) of each of so many equal poles, of an equivalent noise bandwidth (Hz).

    .. math:: \tau = \frac{\Gamma(n - \tfrac{1}{2})}{4 \sqrt{\pi}\, \Gamma(n)\, B}

    which is :math:`1 / 4B` for one pole.
    """
    return math.gamma(poles - 0.5) / (4.0 * math.sqrt(math.pi) * math.gamma(poles) * bandwidth)


def detector_readings(noise: NoiseNumbers, seed: int, frequency: float, periods: int, tones: int) -> Any:
    """Return the detector's noise in the complex amplitude (m) of each period, (periods, tones).

    It is white: periods of the first tone, with the given frequency (Hz), are independent.
    """
    import numpy as np

    random = np.random.Generator(np.random.Philox(seed)).standard_normal((periods, tones, 2))
    return noise.detector * math.sqrt(frequency) * random @ np.array([1.0, 1j])
