"""Frictionless contact with an elastic layer bonded to a rigid support, solved numerically.

The displacement under a pressure is a half-space's, with each wave number k of the pressure weighted by a kernel L(kh). The
contact of an axisymmetric tip then is the Fredholm equation

    f(x) + (1/pi h) int_0^a [m((x + t)/h) + m((x - t)/h)] f(t) dt = depth - g(x),   m(s) = int_0^inf (L(w)
    - 1) cos(w s) dw

with the force 2 E_eff int_0^a f dx. g is the one-dimensional profile of the tip (x²/R for a sphere, (pi/2) x cot(theta) for a
cone, 0 for a punch), and f(a) = 0 where the profile is smooth.

Source: N. N. Lebedev, Y. S. Ufliand, J. Appl. Math. Mech. 22, 442 (1958); derived again here.
"""

from __future__ import annotations

from functools import lru_cache
from math import pi

import numpy as np

from dforce.core.arrays import Array

WAVES = 200  # quadrature points in the wave number; L - 1 decays as exp(-2 w) and is smooth
FARTHEST = 30.0  # largest wave number times thickness, where L - 1 is 1e-22
POINTS = 48  # quadrature points over the contact


def legendre(count: int, low: float, high: float) -> tuple[Array, Array]:
    """Return Gauss–Legendre points and weights on an interval."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (high - low) * (x + 1.0) + low, 0.5 * (high - low) * w


@lru_cache(maxsize=64)
def _kernel(poisson: float) -> tuple[Array, Array]:
    """Return wave numbers and the weights (L - 1) dw of the quadrature."""
    w, weight = legendre(WAVES, 0.0, FARTHEST)
    kappa = 3.0 - 4.0 * poisson
    decay = np.exp(-2.0 * w)
    top = kappa * (1.0 - decay**2) - 4.0 * w * decay
    bottom = kappa * (1.0 + decay**2) + (4.0 * w**2 + 1.0 + kappa**2) * decay
    return w, weight * (top / bottom - 1.0)


def kernel_moments(poisson: float) -> tuple[float, float]:
    """Return A_0 = int (L - 1) dw and A_2 = -1/4 int (L - 1) w² dw of a layer of this Poisson ratio."""
    w, weighted = _kernel(poisson)
    return float(weighted.sum()), float(-0.25 * (weighted * w**2).sum())


def contact(profile: str, poisson: float, radius: float) -> tuple[float, float]:
    """Return depth X and the force, relative to a half-space's there, for a contact radius in thicknesses.

    The depth is as in the series: contact radius of the half-space over thickness for a sphere and a punch, tan(theta)
    depth over thickness for a cone.
    """
    w, weighted = _kernel(poisson)
    x, dx = legendre(POINTS, 0.0, radius)
    waves = np.cos(np.outer(x, w))
    edge = np.cos(radius * w)
    coupling = 2.0 / pi * (waves * weighted) @ waves.T * dx
    matrix = np.eye(POINTS) + coupling
    shape = {"sphere": x**2, "cone": 0.5 * pi * x, "punch": 0.0 * x}[profile]
    rim = {"sphere": radius**2, "cone": 0.5 * pi * radius, "punch": 0.0}[profile]
    unit, bent = np.linalg.solve(matrix, np.stack([np.ones(POINTS), shape], axis=1)).T
    if profile == "punch":
        return radius, float(dx @ unit) / radius
    # f(a) = depth (1 - K unit) - (rim - K bent) = 0 gives the depth
    row = 2.0 / pi * (edge * weighted) @ waves.T * dx
    depth = float((rim - row @ bent) / (1.0 - row @ unit))
    force = float(dx @ (depth * unit - bent))
    if profile == "sphere":  # R = h = 1: half-space force 2 (2/3) depth^1.5 in units of 2 E_eff
        return depth**0.5, force / (2.0 / 3.0 * depth**1.5)
    return depth, force / (depth**2 / pi)
