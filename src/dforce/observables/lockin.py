"""Lock-in detection over one period of the first tone.

The complex amplitude of a signal at a tone is c = 2 <z exp(-i (w t + theta))>, so that z = |c| cos(wt + theta - phase)
with phase = -arg c: the lag behind the drive, never folded. Sums are trapezoidal over the samples, which is exact to
rounding for periodic motion that is resolved.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dforce.kernel.link import inlined, reordered
from dforce.kernel.slots import mode_count

TAU = 2.0 * math.pi


@reordered
def dot(a: Any, b: Any) -> float:
    """Return the sum of the products of two arrays."""
    result = 0.0
    for i in range(a.shape[0]):
        result += a[i] * b[i]
    return result


def turns(start: float, step: float, cosine: Any, sine: Any) -> None:
    """Write cosine and sine of start, start + step, ...: what is there is turned as a whole, so that few roundings add up."""
    cosine[0], sine[0] = math.cos(start), math.sin(start)
    done = 1
    while done < cosine.shape[0]:
        c, s = math.cos(done * step), math.sin(done * step)
        for i in range(min(done, cosine.shape[0] - done)):
            cosine[done + i] = cosine[i] * c - sine[i] * s
            sine[done + i] = sine[i] * c + cosine[i] * s
        done *= 2


@reordered
def turned_sums(even: Any, odd: Any, first_c: Any, first_s: Any, c: Any, s: Any) -> Any:
    """Turn the phasors (c, s) by (first_c, first_s); return the sums of their products with `even` and `odd`."""
    real, imaginary = 0.0, 0.0
    for i in range(c.shape[0]):
        turned_c = c[i] * first_c[i] - s[i] * first_s[i]
        turned_s = s[i] * first_c[i] + c[i] * first_s[i]
        c[i], s[i] = turned_c, turned_s
        real += even[i] * turned_c
        imaginary += odd[i] * turned_s
    return real, imaginary


def tones_turns(tones: Any, points: int, cosine: Any, sine: Any) -> None:
    """Write cosine and sine of each tone over a period of the first one that begins at phase 0, (tones, points + 1)."""
    for j in range(tones.shape[0]):
        turns(0.0, tones[j, 0] * TAU / points, cosine[j], sine[j])


def lock_in_at(x: Any, cosine: Any, sine: Any, base: float, out: Any, place: int) -> None:
    """Write the real and imaginary part of c for samples whose first and last count half; `base` is the tone's phase."""
    points = x.shape[0] - 1
    out[place] = out[place + 1] = 0.0
    add_lock_in(dot(x, cosine), dot(x, sine), math.cos(base), math.sin(base), points, out, place)


@inlined
def add_lock_in(real: float, imaginary: float, c: float, s: float, points: int, out: Any, place: int) -> None:
    """Add to c the sums of samples times cosine and sine of an angle that is still to be turned by that of (c, s)."""
    out[place] += 2.0 * (real * c - imaginary * s) / points
    out[place + 1] -= 2.0 * (imaginary * c + real * s) / points


def lock_in_turned(block: Any, bases: Any, cosine: Any, sine: Any, z: Any, out: Any) -> None:
    """Write the real and imaginary part of c for the total deflection at each tone; `z` is scratch, (points + 1,)."""
    last = z.shape[0] - 1
    for i in range(last + 1):
        z[i] = 0.0
        for n in range(mode_count()):
            z[i] += block[i, 2 * n]
    z[0], z[last] = 0.5 * z[0], 0.5 * z[last]
    for j in range(bases.shape[0]):
        lock_in_at(z, cosine[j], sine[j], bases[j], out, 2 * j)


def lock_in(block: Any, points: int, tones: Any, bases: Any, out: Any) -> None:
    """Write the real and imaginary part of c for the total deflection at each tone, tone after tone."""
    cosine, sine = np.empty((tones.shape[0], points + 1)), np.empty((tones.shape[0], points + 1))
    tones_turns(tones, points, cosine, sine)
    lock_in_turned(block, bases, cosine, sine, np.empty(points + 1), out)


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
