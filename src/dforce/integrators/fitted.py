r"""A lever with which Runge–Kutta steps give the free motion of the true lever, exactly.

A step of length h multiplies a motion :math:`e^{\lambda t}` by :math:`R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24`, with
:math:`z = \lambda h`, instead of :math:`e^z`. So the method gets a lever with another stiffness and damping, such that
:math:`R(z') = e^z` for both roots of each mode. Its drive is another complex number, such that the free steady motion is
exact. These numbers differ by :math:`h^4`. Without the fit a lever of the quality factor Q adds up the errors of Q periods;
with it only the force's part of a step has an error, once.

Source: P. Chartier, E. Hairer, G. Vilmart, Math. Comp. 76, 1941 (2007), integrators based on modified differential equations.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.kernel.codegen import FIRST_DRIVE, FIRST_MODE, PER_MODE

LARGEST = 0.7  # of a mode's roots z: a step does not resolve faster motions of any lever
STEPS = 3  # of Newton's method; it begins with an error of z^5 / 120, and squares it


def growth(z: Any) -> Any:
    """Return by how much a step multiplies a motion of root z."""
    return 1.0 + z * (1.0 + z * (0.5 + z * (1.0 / 6.0 + z / 24.0)))


def fitted_root(z: Any) -> Any:
    """Return the root, real or complex, for which a step multiplies a motion by exp(z)."""
    root, wanted = z, np.exp(z)
    for _ in range(STEPS):
        all_of_it = growth(root)
        root -= (all_of_it - wanted) / (all_of_it - root * root * root * root / 24.0)
    return root


def fitted_mode(square: float, damping: float, h: float) -> Any:
    """Return the stiffness and the damping of a mode for steps of length h (all scaled)."""
    middle, apart = -0.5 * h * damping, h * h * (0.25 * damping * damping - square)
    if middle * middle + abs(apart) > LARGEST * LARGEST:
        return square, damping
    if apart < 0.0:
        root = fitted_root(complex(middle, math.sqrt(-apart)))
        return (root.real * root.real + root.imag * root.imag) / (h * h), -2.0 * root.real / h
    fast, slow = fitted_root(middle - math.sqrt(apart)), fitted_root(middle + math.sqrt(apart))
    return fast * slow / (h * h), -(fast + slow) / h


def fitted_drive(square: float, damping: float, fitted: Any, omega: float, h: float) -> Any:
    """Return the factor of a drive of angular frequency omega on a mode, for steps of length h with a fitted mode.

    With the mode's matrix M for one step, of trace s and determinant q, a step is x -> R(M) x + h S(M) u. Polynomials of M
    are r0 + r1 M, because M^2 = s M - q.
    """
    s, q = -h * fitted[1], h * h * fitted[0]
    r0 = 1.0 - q / 2.0 - s * q / 6.0 - (s * s - q) * q / 24.0
    r1 = 1.0 + s / 2.0 + (s * s - q) / 6.0 + (s * s - 2.0 * q) * s / 24.0
    half = complex(math.cos(0.5 * omega * h), math.sin(0.5 * omega * h))
    s0 = (1.0 + 4.0 * half + half * half - q * (1.0 + half) / 2.0 - s * q / 4.0) / 6.0
    s1 = (1.0 + 2.0 * half + s * (1.0 + half) / 2.0 + (s * s - q) / 4.0) / 6.0
    ahead = half * half - r0
    left = ahead * (ahead - r1 * s) + r1 * r1 * q
    return left / (h * h * (s0 * r1 + s1 * ahead) * complex(square - omega * omega, damping * omega))


def fit(numbers: Any, tones: Any, modes: int, h: float) -> None:
    """Fit the modes among the numbers of a tip equation, and the drive in its tone table, to steps of length h."""
    for n in range(modes):
        place, cosine, sine = FIRST_MODE + PER_MODE * n, FIRST_DRIVE + n, FIRST_DRIVE + modes + n
        square, damping = numbers[place], numbers[place + 1]
        fitted = fitted_mode(square, damping, h)
        numbers[place], numbers[place + 1] = fitted
        for k in range(tones.shape[0]):
            share = fitted_drive(square, damping, fitted, tones[k, 0], h)
            real, imaginary = tones[k, cosine], tones[k, sine]
            tones[k, cosine] = share.real * real - share.imag * imaginary
            tones[k, sine] = share.real * imaginary + share.imag * real
