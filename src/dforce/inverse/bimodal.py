r"""Modulus and viscosity of a contact from the observables of AM-FM and FM-FM, and where their formulas break.

.. math:: \langle k_\mathrm{ts} \rangle = k_2 \left[ (f_2 / f_{02})^2 - 1 \right], \qquad
          V_1 = \tfrac{1}{2} A_1 \left[ k_1 (1 - r_1^2) A_1 - F_1 \cos\phi_1 \right], \qquad
          E_1 = \pi A_1 \left[ F_1 \sin\phi_1 - k_1 r_1 A_1 / Q_1 \right]

and for a contact :math:`F = c\, \delta^m` with an indentation much smaller than :math:`A_1` and much larger than :math:`A_2`

.. math:: \delta = -\left( m + \tfrac{1}{2} \right) \frac{V_1}{A_1 \langle k_\mathrm{ts} \rangle}, \qquad
          c = \frac{\pi \sqrt{2 A_1}\, \langle k_\mathrm{ts} \rangle}{m\, B(\tfrac{1}{2}, m)\, \delta^{m - 1/2}}, \qquad
          \tan\rho = \frac{E_1}{2 \pi |V_1|} = \frac{\omega_1 \eta^*}{E_\mathrm{eff}}

which for a paraboloid on resonance is the formula of R. Garcia, R. Proksch, Eur. Polym. J. 49, 1897 (2013), with
:math:`\sqrt{A_1}\, /\, (A_{01} \cos\phi_1)`; derived here for any power.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Array

PHASES = 4096  # points of a period, for the Fourier coefficients of the force


class Contact(NamedTuple):
    """A contact F = E_eff s d^m: its power m, and s (m^(2 - m))."""

    power: float
    shape: float

    @classmethod
    def punch(cls, radius: float) -> Contact:
        """Return a flat punch of a radius (m)."""
        return cls(1.0, 2.0 * radius)

    @classmethod
    def paraboloid(cls, radius: float) -> Contact:
        """Return a paraboloid, as Hertz' sphere, of a radius (m)."""
        return cls(1.5, 4.0 / 3.0 * math.sqrt(radius))

    @classmethod
    def cone(cls, half_angle: float) -> Contact:
        """Return a cone of a half angle (rad)."""
        return cls(2.0, 2.0 / math.pi * math.tan(half_angle))


class Observed(NamedTuple):
    """Observables of two tones at points of a curve, in SI; the phase (rad) is the lag of mode 1.

    `k`, `Q` and `f0` are those of both modes; frequencies, amplitudes, `drive` (N, tone 1) and `phase` are arrays.
    """

    k: tuple[float, float]
    Q: tuple[float, float]
    f0: tuple[float, float]
    frequency: tuple[Array, Array]
    amplitude: tuple[Array, Array]
    drive: Array
    phase: Array

    @property
    def mean_stiffness(self) -> Array:
        """Mean stiffness of the contact that mode 2 sees (N/m)."""
        return np.asarray(self.k[1] * ((self.frequency[1] / self.f0[1]) ** 2 - 1.0))

    @property
    def virial(self) -> Array:
        """Virial of tone 1 (J)."""
        A, r = self.amplitude[0], self.frequency[0] / self.f0[0]
        return np.asarray(0.5 * A * (self.k[0] * (1.0 - r**2) * A - self.drive * np.cos(self.phase)))

    @property
    def dissipated_energy(self) -> Array:
        """Energy that the sample takes from tone 1 per period (J)."""
        A, r = self.amplitude[0], self.frequency[0] / self.f0[0]
        return np.asarray(np.pi * A * (self.drive * np.sin(self.phase) - self.k[0] * r * A / self.Q[0]))


class Estimate(NamedTuple):
    """A contact from observables: effective modulus (Pa), indentation (m), viscosity (Pa s), loss tangent, peak force (N).

    The viscosity is that of `kelvin_voigt`, twice that of a Kelvin–Voigt solid. Where no elastic contact explains a point, its
    numbers are NaN.
    """

    E_eff: Array
    indentation: Array
    viscosity: Array
    loss_tangent: Array
    peak_force: Array


def estimate(seen: Observed, contact: Contact) -> Estimate:
    """Return the contact that the formulas find in observables."""
    m, A, stiffness, virial = contact.power, seen.amplitude[0], seen.mean_stiffness, seen.virial
    repels = (stiffness > 0.0) & (virial < 0.0)
    stiffness, virial = np.where(repels, stiffness, np.nan), np.where(repels, virial, np.nan)
    beta = math.sqrt(math.pi) * math.gamma(m) / math.gamma(m + 0.5)  # B(1/2, m)
    indentation = -(m + 0.5) * virial / (A * stiffness)
    c = np.pi * np.sqrt(2.0 * A) * stiffness / (m * beta * indentation ** (m - 0.5))
    modulus, tangent = c / contact.shape, -seen.dissipated_energy / (2.0 * np.pi * virial)
    viscosity = modulus * tangent / (np.pi * seen.frequency[0])
    return Estimate(modulus, indentation, viscosity, tangent, c * indentation**m)


def neglected(seen: Observed, contact: Contact, found: Estimate) -> dict[str, Array]:
    """Return what the formulas neglect, each as a share of what they assume to be much larger.

    `harmonics`: answer of mode 2 to the harmonics of tone 1 next to its resonance, over the indentation; `path`: change of
    mode 1's path by the peak force, over its amplitude; `amplitude_2`: amplitude of tone 2 over the indentation; `indentation`:
    indentation over the amplitude of tone 1.
    """
    A, f1 = seen.amplitude[0], seen.frequency[0]
    theta = 2.0 * np.pi / PHASES * np.arange(PHASES)
    depth = np.maximum(found.indentation[..., None] - A[..., None] * (1.0 - np.cos(theta)), 0.0)
    force = np.where(depth > 0.0, (depth / found.indentation[..., None]) ** contact.power, 0.0)
    nearest = np.round(seen.f0[1] / f1)
    answer = np.zeros_like(A)
    for beside in (-1.0, 0.0, 1.0):
        h = nearest + beside
        r = h * f1 / seen.f0[1]
        pushed = 2.0 * found.peak_force * (force * np.cos(h[..., None] * theta)).mean(axis=-1)
        answer += np.abs(pushed / (seen.k[1] * (1.0 - r**2 + 1j * r / seen.Q[1])))
    return {
        "harmonics": answer / found.indentation,
        "path": found.peak_force / (seen.k[0] * A),
        "amplitude_2": seen.amplitude[1] / found.indentation,
        "indentation": found.indentation / A,
    }
