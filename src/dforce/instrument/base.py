r"""The shaken base: how its motion, and the fluid that moves with it, drive the modes.

A mode's deflection :math:`z_n` is relative to the base, which moves by Y. Mass and drag act on the absolute motion:

.. math:: m_n \ddot z_n + \frac{m_n \omega_n}{Q_n} \dot z_n + k_n z_n
          = -\chi_n \left[ m_n (1 - s \mu_n) \ddot Y + (1 - s) \frac{m_n \omega_n}{Q_n} \dot Y \right] + F_\mathrm{ts}

with the share s of the fluid that moves with the base, and the share :math:`\mu_n` of the fluid in the mode's mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, Parameters, param
from dforce.instrument.modes import ModeNumbers


class Piezo(Parameters):
    """The piezo under the base, as an oscillator. Far below its resonance the base follows the drive."""

    f0: Number = param(unit="Hz", symbol="f_p", above="0 Hz", high="10 GHz", doc="resonance frequency of the piezo")
    Q: Number = param(unit="1", symbol="Q_p", above=0.0, high=1e9, doc="quality factor of the piezo")


@dataclass(frozen=True)
class BaseMotion:
    """How the base is shaken: the share of the fluid that follows it, and the piezo's resonance (Hz), if any."""

    fluid_follows: float
    piezo_f0: float = math.inf
    piezo_Q: float = 1.0

    def piezo_response(self, frequency: float) -> complex:
        """Return the motion of the base at a frequency (Hz) over that far below the piezo's resonance."""
        r = frequency / self.piezo_f0
        return 1.0 / complex(1.0 - r * r, r / self.piezo_Q)

    def couplings(self, mode: ModeNumbers) -> tuple[float, float]:
        r"""Return the couplings of a mode's mass and drag to the base, :math:`\chi (1 - s\mu)` and :math:`\chi (1 - s)`."""
        s = self.fluid_follows
        share = mode.added_mass if mode.memory is None else mode.memory.added_mass
        return mode.base_coupling * (1.0 - s * (share or 0.0)), mode.base_coupling * (1.0 - s)

    def force(self, mode: ModeNumbers, frequency: float) -> complex:
        r"""Return the modal force (N/m) for each meter that the base moves at a frequency (Hz).

        .. math:: \hat F / Y = k \chi \left[ r^2 (1 - s\mu) - i (1 - s)\, r / Q \right], \qquad r = \omega / \omega_0

        and with the fluid's memory in the same way, by its drag.
        """
        mass, drag = self.couplings(mode)
        if mode.memory is None:
            r = frequency / mode.f0
            return mode.k * complex(r * r * mass, -drag * r / mode.Q)
        r = frequency / mode.memory.frequency
        return complex(mode.k * (r * r * mass - drag * mode.memory.drag(frequency)))


def peak_ratio(mode: ModeNumbers, base: BaseMotion | None, path: str) -> float:
    r"""Return at which share of `f0` the free response of a mode is largest, under a force or a shaken base.

    The square of the response is :math:`N(x) / D(x)` with :math:`x = r^2`, :math:`D = (1 - x)^2 + x / Q^2`, and N = 1 under a
    force, :math:`N = p^2 x^2 + (q / Q)^2 x` over a base with its couplings p and q. The piezo's resonance is left out.

    Raises
    ------
    ParameterError
        When the response falls from low frequencies on, or rises without end.
    """
    if mode.memory is not None:
        return _peak_with_memory(mode, base, path)
    mass, drag = base.couplings(mode) if base is not None else (0.0, 0.0)
    n0, n1, n2 = (1.0 if base is None else 0.0), (drag / mode.Q) ** 2, mass**2
    linear = 1.0 / mode.Q**2 - 2.0
    # N' D - N D' = 0
    a, b, c = n2 * linear - n1, 2.0 * (n2 - n0), n1 - n0 * linear
    inner = b * b - 4.0 * a * c
    roots = (
        [-c / b] if a == 0.0 else [(-b + side * math.sqrt(inner)) / (2.0 * a) for side in (1.0, -1.0) if inner >= 0.0]
    )
    peaks = [x for x in roots if x > 0.0 and 2.0 * a * x + b < 0.0]
    if not peaks:
        raise ParameterError(f"{path} = 'peak', but the free response of the mode has no peak at Q = {mode.Q:.4g}")
    return math.sqrt(peaks[0])


def _peak_with_memory(mode: ModeNumbers, base: BaseMotion | None, path: str) -> float:
    """Return the same for a mode whose fluid has memory: the largest response that is no end of the range it is known in."""
    import numpy as np
    from scipy.optimize import minimize_scalar

    def response(ratio: float) -> float:
        push = 1.0 if base is None else abs(base.force(mode, ratio * mode.f0)) / mode.k
        return float(push * mode.k / abs(mode.stiffness(ratio * mode.f0)))

    ratios = np.geomspace(0.1, 3.0, 200)
    heights = np.array([response(float(ratio)) for ratio in ratios])
    top = int(heights.argmax())
    if top in (0, len(ratios) - 1):
        raise ParameterError(f"{path} = 'peak', but the free response of the mode has no peak at Q = {mode.Q:.4g}")
    bounds = (float(ratios[top - 1]), float(ratios[top + 1]))
    found = minimize_scalar(lambda ratio: -response(ratio), bounds=bounds, method="bounded", options={"xatol": 1e-9})
    return float(found.x)
