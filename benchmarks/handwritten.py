"""Loops written by hand for one case each, which the compiled solvers are measured against.

Lengths in units of the free amplitude, time in 1/omega, as a careful author would write them for this one problem.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

OPTIONS: dict[str, Any] = {
    "nogil": True, "error_model": "numpy", "fastmath": {"contract", "arcp", "nsz"},
}  # fmt: skip
LANES = 16


@njit(nogil=True)
def hertz(
    surface: float, stiffness: float, g: float, cosine: Any, sine: Any, points: int, periods: int
) -> tuple[float, float]:
    """Integrate a tapping tip over a Hertz contact by RK4; return the lock-in sums of its deflection."""
    h = 2.0 * math.pi / points
    x = v = real = imaginary = 0.0
    for _ in range(periods):
        for i in range(points):
            c0, c1, c2 = g * cosine[2 * i], g * cosine[2 * i + 1], g * cosine[2 * i + 2]
            real += x * cosine[2 * i]
            imaginary += x * sine[2 * i]
            depth = max(-(surface + x), 0.0)
            a1 = c0 - x - g * v + stiffness * depth * math.sqrt(depth)
            x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
            depth = max(-(surface + x2), 0.0)
            a2 = c1 - x2 - g * v2 + stiffness * depth * math.sqrt(depth)
            x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
            depth = max(-(surface + x3), 0.0)
            a3 = c1 - x3 - g * v3 + stiffness * depth * math.sqrt(depth)
            x4, v4 = x + h * v3, v + h * a3
            depth = max(-(surface + x4), 0.0)
            a4 = c2 - x4 - g * v4 + stiffness * depth * math.sqrt(depth)
            x += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
            v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return real, imaginary


@njit(**OPTIONS)
def sticky(d: float, v: float, a0: float, stiffness: float, attraction: float, adhesion: float, drag: float) -> float:
    """Return the force of DMT and Kelvin–Voigt together, in scaled units."""
    depth = a0 - d
    if depth > 0.0:
        root = math.sqrt(depth)
        return stiffness * depth * root - adhesion - drag * root * v
    return -attraction / (d * d)


@njit(**OPTIONS)
def dmt_kelvin_voigt(zc: float, law: Any, g: float, cosine: Any, points: int, periods: int) -> float:
    """Integrate a tapping tip over DMT and Kelvin–Voigt by RK4; return its last deflection."""
    a0, stiffness, attraction, adhesion, drag = law
    h = 2.0 * math.pi / points
    x = v = 0.0
    for _ in range(periods):
        for i in range(points):
            c0, c1, c2 = g * cosine[2 * i], g * cosine[2 * i + 1], g * cosine[2 * i + 2]
            a1 = c0 - x - g * v + sticky(zc + x, v, a0, stiffness, attraction, adhesion, drag)
            x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
            a2 = c1 - x2 - g * v2 + sticky(zc + x2, v2, a0, stiffness, attraction, adhesion, drag)
            x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
            a3 = c1 - x3 - g * v3 + sticky(zc + x3, v3, a0, stiffness, attraction, adhesion, drag)
            x4, v4 = x + h * v3, v + h * a3
            a4 = c2 - x4 - g * v4 + sticky(zc + x4, v4, a0, stiffness, attraction, adhesion, drag)
            x += h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
            v += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
    return x


@njit(nogil=True, fastmath=True)
def hertz_lanes(
    surface: Any, stiffness: float, g: float, cosine: Any, points: int, periods: int, x: Any, v: Any
) -> None:
    """Integrate many tapping tips over Hertz contacts side by side."""
    h = 2.0 * math.pi / points
    for _ in range(periods):
        for i in range(points):
            c0, c1, c2 = g * cosine[2 * i], g * cosine[2 * i + 1], g * cosine[2 * i + 2]
            for j in range(LANES):
                xj, vj, s = x[j], v[j], surface[j]
                depth = max(-(s + xj), 0.0)
                a1 = c0 - xj - g * vj + stiffness * depth * math.sqrt(depth)
                x2, v2 = xj + 0.5 * h * vj, vj + 0.5 * h * a1
                depth = max(-(s + x2), 0.0)
                a2 = c1 - x2 - g * v2 + stiffness * depth * math.sqrt(depth)
                x3, v3 = xj + 0.5 * h * v2, vj + 0.5 * h * a2
                depth = max(-(s + x3), 0.0)
                a3 = c1 - x3 - g * v3 + stiffness * depth * math.sqrt(depth)
                x4, v4 = xj + h * v3, vj + h * a3
                depth = max(-(s + x4), 0.0)
                a4 = c2 - x4 - g * v4 + stiffness * depth * math.sqrt(depth)
                x[j] = xj + h / 6.0 * (vj + 2.0 * (v2 + v3) + v4)
                v[j] = vj + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)


def tables(points: int) -> tuple[Any, Any]:
    """Return cosine and sine of the drive's phase at the ends and middles of all steps of a period."""
    angle = np.arange(2 * points + 1) * np.pi / points
    return np.cos(angle), np.sin(angle)
