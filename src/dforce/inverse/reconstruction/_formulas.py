r"""The formulas in common use, which take each path for a sinusoid and each distance for one point.

With :math:`\Omega = -V / k A^2`, the relative frequency shift that the same virial makes under phase lock, D the closest
approach :math:`z_c - A`, and :math:`g = A^{3/2} \Omega`:

Sader and Jarvis, Appl. Phys. Lett. 84, 1801 (2004); for an amplitude that changes along the curve the derivative acts on g:

.. math:: F(D) = 2k \int_D^\infty \Big[1 + \frac{\sqrt A}{8 \sqrt{\pi (t - D)}}\Big] \Omega
          - \frac{1}{\sqrt{2 (t - D)}} \frac{dg}{dt}\, dt

Hölscher, Appl. Phys. Lett. 89, 123109 (2006): the last term alone, from D to D + 2A. Payam and others, Nanotechnology 26,
185706 (2015), as their users compute it: without the second term.

Between neighboring points g and the rest are straight, and the singular kernels are integrated exactly.
"""

from __future__ import annotations

import numpy as np

from dforce.core.arrays import Array

FORMULAS = ("sader_jarvis", "holscher", "payam", "sinusoid")


def sader_jarvis(distance: Array, shift: Array, amplitude: Array, k: float) -> Array:
    """Return the force (N) at rising closest distances (m) of relative shifts, by Sader and Jarvis."""
    small = _half(distance, np.sqrt(amplitude) * shift) / (8.0 * np.sqrt(np.pi))
    return np.asarray(2.0 * k * (_integral(distance, shift) + small) + holscher(distance, shift, amplitude, k, np.inf))


def payam(distance: Array, shift: Array, amplitude: Array, k: float) -> Array:
    """Return the force (N) without the term in the root of the amplitude."""
    return np.asarray(2.0 * k * _integral(distance, shift) + holscher(distance, shift, amplitude, k, np.inf))


def holscher(distance: Array, shift: Array, amplitude: Array, k: float, reach: float = 2.0) -> Array:
    """Return the force (N) for amplitudes that are large against its length; `reach` is in amplitudes."""
    slope = np.diff(amplitude**1.5 * shift) / np.diff(distance)
    start, stop = _ends(distance, distance + reach * amplitude if np.isfinite(reach) else None)
    return np.asarray(-2.0 * k * ((np.sqrt(stop) - np.sqrt(start)) * np.sqrt(2.0)) @ slope)


def _ends(distance: Array, last: Array | None) -> tuple[Array, Array]:
    """Return where each stretch between points starts and ends, counted from each distance, shape (points, stretches)."""
    ends = distance if last is None else np.minimum(distance, last[:, None])
    away = np.maximum(ends - distance[:, None], 0.0)
    return away[:, :-1], away[:, 1:]


def _integral(distance: Array, values: Array) -> Array:
    """Return the integral from each distance to the last one."""
    parts = 0.5 * (values[1:] + values[:-1]) * np.diff(distance)
    return np.append(np.cumsum(parts[::-1])[::-1], 0.0)


def _half(distance: Array, values: Array) -> Array:
    r"""Return :math:`\int_D g(t) / \sqrt{t - D}\, dt`, g straight between points."""
    start, stop = _ends(distance, None)
    slope = np.diff(values) / np.diff(distance)
    first = 2.0 * (np.sqrt(stop) - np.sqrt(start))
    second = 2.0 / 3.0 * (stop**1.5 - start**1.5)
    inside = np.where(stop > 0.0, first * values[:-1] + slope * (second - start * first), 0.0)
    return np.asarray(inside.sum(axis=1))
