"""The rectangular cantilever: Euler–Bernoulli modes in vacuum, and Sader's theory in a fluid.

Pure functions of floats in SI units. A mode's shape is one at the free end: its spring constant, force and deflection
refer to the tip. Tapered and V-shaped levers are not such beams: give their modes.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from dforce.core.errors import ParameterError

ITERATIONS = 200  # of the frequency in a fluid; the slowest case met took 30


class BeamMode(NamedTuple):
    """One flexural mode: frequency (Hz) and spring constant (N/m)."""

    frequency: float
    stiffness: float


class FluidMode(NamedTuple):
    """One flexural mode in a fluid: frequency (Hz), quality factor, and the fluid's share in the moving mass."""

    frequency: float
    Q: float
    added_mass: float


def wavenumber(n: int) -> float:
    r"""Return :math:`\kappa_n`, the n-th root (from 1) of :math:`1 + \cos\kappa \cosh\kappa = 0`.

    Source: any text on vibration, for example S. S. Rao, Vibration of Continuous Systems, Wiley (2007).
    """
    kappa = (n - 0.5) * math.pi
    for _ in range(20):
        # divided by cosh, so that high modes do not overflow
        value = math.cos(kappa) + 1.0 / math.cosh(kappa)
        slope = -math.sin(kappa) - math.tanh(kappa) / math.cosh(kappa)
        step = value / slope
        kappa -= step
        if abs(step) < 1e-15 * kappa:
            break
    return kappa


def static_stiffness(youngs_modulus: float, length: float, width: float, thickness: float) -> float:
    r"""Return the spring constant (N/m) for a steady force at the end, :math:`E b h^3 / 4 L^3`."""
    return youngs_modulus * width * thickness**3 / (4.0 * length**3)


def static_factor() -> float:
    r"""Return the spring constant of mode 1 over that for a steady force at the end, :math:`\kappa_1^4 / 12`: 1.0302."""
    return wavenumber(1) ** 4 / 12.0


def vacuum_mode(
    n: int, youngs_modulus: float, density: float, length: float, width: float, thickness: float
) -> BeamMode:
    r"""Return frequency (Hz) and spring constant (N/m) of mode `n` (from 1) in vacuum.

    .. math:: \omega_n = \frac{\kappa_n^2}{L^2} \sqrt{\frac{E I}{\rho b h}}, \qquad
              k_n = \frac{\kappa_n^4}{12}\, \frac{E b h^3}{4 L^3}, \qquad I = \frac{b h^3}{12}

    so that every mode moves a quarter of the beam's mass. The domain is a slender beam: a length far above
    width and thickness.
    """
    kappa = wavenumber(n)
    radius_of_gyration = thickness / math.sqrt(12.0)  # sqrt(I / b h)
    omega = (kappa / length) ** 2 * math.sqrt(youngs_modulus / density) * radius_of_gyration
    stiffness = kappa**4 / 12.0 * static_stiffness(youngs_modulus, length, width, thickness)
    return BeamMode(omega / (2.0 * math.pi), stiffness)


def shape(n: int, x: Any) -> Any:
    r"""Return the shape of mode `n` (from 1) at places x from 0, the base, to 1; it is 1 at the end.

    .. math:: \phi_n \propto \cosh\kappa x - \cos\kappa x
              - \frac{\cosh\kappa + \cos\kappa}{\sinh\kappa + \sin\kappa} (\sinh\kappa x - \sin\kappa x)
    """
    import numpy as np

    kappa = wavenumber(n)
    ratio = (math.cosh(kappa) + math.cos(kappa)) / (math.sinh(kappa) + math.sin(kappa))

    def form(y: Any) -> Any:
        # cosh - ratio sinh by exponentials, so that high modes lose no digits
        rest = 0.5 * ((1.0 - ratio) * np.exp(y) + (1.0 + ratio) * np.exp(-y))
        return rest - np.cos(y) + ratio * np.sin(y)

    return form(kappa * np.asarray(x, dtype=float)) / form(np.asarray(kappa))


def end_slope(n: int) -> float:
    r"""Return the slope at the end over the deflection there, times the length, of mode `n` (from 1).

    .. math:: \frac{\phi_n'(1)}{\phi_n(1)}
              = \frac{\kappa \sin\kappa \tanh\kappa}{\sin\kappa - \cos\kappa \tanh\kappa}
    """
    kappa = wavenumber(n)
    sine, cosine, tanh = math.sin(kappa), math.cos(kappa), math.tanh(kappa)
    return kappa * sine * tanh / (sine - cosine * tanh)


def base_coupling(n: int) -> float:
    r"""Return how strongly a base that moves drives mode `n` (from 1), :math:`\chi_n`; all of them add up to 1.

    .. math:: \chi_n = \frac{\int \phi_n}{\int \phi_n^2} = (-1)^{n+1} \frac{4}{\kappa}\,
              \frac{\cosh\kappa + \cos\kappa}{\sinh\kappa + \sin\kappa}, \qquad \phi_n(1) = 1
    """
    kappa = wavenumber(n)
    ratio = (math.cosh(kappa) + math.cos(kappa)) / (math.sinh(kappa) + math.sin(kappa))
    return (1.0 if n % 2 else -1.0) * 4.0 * ratio / kappa


def lever_factor(n: int) -> float:
    """Return the sensitivity of an optical lever to mode `n`, relative to that to a steady load at the end.

    The lever measures the slope at the end; a steady end load has 3/2 of deflection over length.
    """
    return end_slope(n) / 1.5


def reynolds_number(frequency: float, width: float, density: float, viscosity: float) -> float:
    r"""Return :math:`\mathrm{Re} = \rho \omega b^2 / 4 \mu` of a beam of `width` in a fluid."""
    return density * 2.0 * math.pi * frequency * width**2 / (4.0 * viscosity)


def hydrodynamic_function(reynolds: float) -> complex:
    r"""Return :math:`\Gamma(\mathrm{Re})` of a rectangular beam that moves across its width.

    .. math:: \Gamma = \Omega \left[ 1 + \frac{4 i K_1(-i \sqrt{i \mathrm{Re}})}
              {\sqrt{i \mathrm{Re}}\, K_0(-i \sqrt{i \mathrm{Re}})} \right]

    with Sader's rational :math:`\Omega(\log_{10} \mathrm{Re})`: within 4e-5 of a direct solution of the flow
    for Re from 0.1 to 100, within 0.1 % at 1000.

    Source: J. E. Sader, J. Appl. Phys. 84, 64 (1998).
    """
    from scipy.special import kve

    root = complex(1.0, 1.0) * math.sqrt(reynolds / 2.0)  # sqrt(i Re)
    # scaled Bessel functions: the same ratio, and no underflow at large Re
    ratio = complex(kve(1, -1j * root)) / complex(kve(0, -1j * root))
    circle = 1.0 + 4.0j * ratio / root
    tau = math.log10(reynolds)
    real = _polynomial(tau, 0.91324, -0.48274, 0.46842, -0.12886, 0.044055, -0.0035117, 0.00069085) / _polynomial(
        tau, 1.0, -0.56964, 0.48690, -0.13444, 0.045155, -0.0035862, 0.00069085
    )
    imaginary = _polynomial(tau, -0.024134, -0.029256, 0.016294, -0.00010961, 0.000064577, -0.000044510) / _polynomial(
        tau, 1.0, -0.59702, 0.55182, -0.18357, 0.079156, -0.014369, 0.0028361
    )
    return complex(real, imaginary) * circle


def _polynomial(x: float, *coefficients: float) -> float:
    value = 0.0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value


def fluid_mode(
    vacuum_frequency: float, beam_density: float, width: float, thickness: float, density: float, viscosity: float
) -> FluidMode:
    r"""Return frequency (Hz) and Q of a mode in a fluid of `density` (kg/m^3) and `viscosity` (Pa s).

    .. math:: f = \frac{f_\mathrm{vac}}{\sqrt{1 + \frac{\pi \rho b}{4 \rho_c h} \Gamma_r(\omega)}}, \qquad
              Q = \frac{\frac{4 \rho_c h}{\pi \rho b} + \Gamma_r(\omega)}{\Gamma_i(\omega)}

    at the frequency in the fluid. Domain: length far above width, width far above thickness, Q of one or more, no wall
    near by, and for higher modes a bending wavelength far above the width.

    Raises
    ------
    ParameterError
        When no frequency satisfies the equation.

    Source: J. E. Sader, J. Appl. Phys. 84, 64 (1998).
    """
    load = math.pi * density * width / (4.0 * beam_density * thickness)
    frequency = vacuum_frequency
    for _ in range(ITERATIONS):
        reynolds = reynolds_number(frequency, width, density, viscosity)
        if not 1e-12 < reynolds < 1e12:
            break
        gamma = hydrodynamic_function(reynolds)
        before, frequency = frequency, vacuum_frequency / math.sqrt(1.0 + load * gamma.real)
        if abs(frequency - before) <= 1e-14 * frequency:
            fluid = load * gamma.real
            return FluidMode(frequency, (1.0 / load + gamma.real) / gamma.imag, fluid / (1.0 + fluid))
    raise ParameterError(
        "cantilever.beam has no resonance in this medium, by Sader's theory; write measured f0, k and Q instead of a beam"
    )


def sader_stiffness(frequency: float, Q: float, length: float, width: float, density: float, viscosity: float) -> float:
    r"""Return the static spring constant (N/m) from frequency (Hz) and Q of mode 1 in a fluid.

    .. math:: k = 0.1906\, \rho\, b^2 L\, Q\, \Gamma_i(\omega)\, \omega^2

    Source: J. E. Sader, J. W. M. Chon and P. Mulvaney, Rev. Sci. Instrum. 70, 3967 (1999).
    """
    gamma = hydrodynamic_function(reynolds_number(frequency, width, density, viscosity))
    omega = 2.0 * math.pi * frequency
    return 0.1906 * density * width**2 * length * Q * gamma.imag * omega**2
