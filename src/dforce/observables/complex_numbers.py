"""Modulus, angle and product of complex numbers, the same to the last bit at any place in memory.

NumPy, up to 2.0, uses another routine with other rounding where a result happens to lie within a stride behind strided
numbers. Sums, products and roots of real numbers are rounded by IEEE 754 in every routine.
"""

from __future__ import annotations

import numpy as np

from dforce.core.arrays import Array, Complexes


def modulus(c: Complexes) -> Array:
    """Return the modulus of complex numbers, whose squares have to be within the range of floating point."""
    return np.asarray(np.sqrt(c.real * c.real + c.imag * c.imag))


def angle(c: Complexes) -> Array:
    """Return the angle (degrees) of complex numbers, in (-180°, 180°]."""
    # parts of complex numbers always are strided, copies of them are not
    return np.degrees(np.arctan2(np.array(c.imag, order="C"), np.array(c.real, order="C")))


def phase_lag(c: Complexes) -> Array:
    """Return the phase lag (degrees) of complex amplitudes, in (-90°, 270°].

    Never folded, and without a jump near 0° (far below resonance) and 180° (strong attraction).
    """
    return np.asarray(270.0 - (270.0 + angle(c)) % 360.0)


def product(a: Complexes, b: Complexes) -> Complexes:
    """Return the products of complex numbers."""
    out = np.empty(np.broadcast(a, b).shape, dtype=complex)
    out.real, out.imag = a.real * b.real - a.imag * b.imag, a.real * b.imag + a.imag * b.real
    return out
