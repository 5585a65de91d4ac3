"""Lock-in detection over one period of the first tone.

The complex amplitude of a signal at a tone is c = 2 <z exp(-i (w t + theta))>. So z = |c| cos(wt + theta - phase) with
phase = -arg c, the lag behind the drive, never folded. Sums are trapezoidal over the samples, which is exact to
rounding for a resolved periodic motion.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from dforce.kernel.linker import inlined, reordered
from dforce.kernel.vocabulary import mode_count

TAU = 2.0 * math.pi


class Turns(NamedTuple):
    """Tones, and harmonics of the first one, at the samples of one of its periods, from phase 0 on.

    Attributes
    ----------
    cosine, sine
        Of each tone, (tones, points + 1).
    harmonic_cosine, harmonic_sine
        Of each harmonic from the first on, over the first half of the period, (harmonics, points // 2 + 1).
    """

    cosine: Any
    sine: Any
    harmonic_cosine: Any
    harmonic_sine: Any


def turns_of(ratios: Any, points: int, harmonics: int) -> Turns:
    """Return the turns of tones whose frequencies are these multiples of the first one's, for so many samples a period."""
    whole, half = np.arange(points + 1), np.arange(points // 2 + 1)
    angles = TAU * np.outer(ratios, whole) / points
    orders = TAU * (np.outer(np.arange(1, harmonics + 1), half) % points) / points
    return Turns(np.cos(angles), np.sin(angles), np.cos(orders), np.sin(orders))


@reordered
def total(a: Any) -> float:
    """Return the sum of an array."""
    result = 0.0
    for i in range(a.shape[0]):
        result += a[i]
    return result


@reordered
def dot(a: Any, b: Any) -> float:
    """Return the sum of the products of two arrays."""
    result = 0.0
    for i in range(a.shape[0]):
        result += a[i] * b[i]
    return result


def lock_in_at(x: Any, cosine: Any, sine: Any, base: float, out: Any, place: int) -> None:
    """Write the real and imaginary part of c for samples whose first and last count half; `base` is the tone's phase."""
    points = x.shape[0] - 1
    out[place] = out[place + 1] = 0.0
    add_lock_in(dot(x, cosine), dot(x, sine), math.cos(base), math.sin(base), points, out, place)


@inlined
def add_lock_in(real: float, imaginary: float, c: float, s: float, points: int, out: Any, place: int) -> None:
    """Add the sums of samples times cosine and sine of an angle, turned by the angle of (c, s)."""
    out[place] += 2.0 * (real * c - imaginary * s) / points
    out[place + 1] -= 2.0 * (imaginary * c + real * s) / points


def lock_in(samples: Any, turns: Any, bases: Any, z: Any, out: Any) -> None:
    """Write the real and imaginary part of c for the total deflection at each tone; `z` is scratch, (points + 1,)."""
    last = z.shape[0] - 1
    for i in range(last + 1):
        z[i] = 0.0
        for n in range(mode_count()):
            z[i] += samples[i, 2 * n]
    z[0], z[last] = 0.5 * z[0], 0.5 * z[last]
    for j in range(bases.shape[0]):
        lock_in_at(z, turns.cosine[j], turns.sine[j], bases[j], out, 2 * j)


def turned(c: float, s: float, x: float) -> Any:
    """Return the cosine and sine of an angle increased by x, a small angle (to the last digit below 0.4)."""
    q = x * x
    cos_x = 1.0 - q / 2.0 * (
        1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0))))
    )
    sin_x = x * (
        1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0 * (1.0 - q / 156.0)))))
    )
    return c * cos_x - s * sin_x, s * cos_x + c * sin_x
