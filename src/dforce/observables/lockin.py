"""Lock-in detection over one period of the first tone.

The complex amplitude of a signal at a tone is c = 2 <z exp(-i (w t + theta))>, so that z = |c| cos(wt + theta - phase)
with phase = -arg c: the lag behind the drive, never folded. Sums are trapezoidal over the samples, which is exact to
rounding for periodic motion that is resolved.
"""

from __future__ import annotations

import math
from typing import Any

from dforce.kernel.slots import mode_count

TAU = 2.0 * math.pi


def deflection(block: Any, i: int) -> float:
    """Return the scaled total deflection at sample i."""
    x = 0.0
    for n in range(mode_count()):
        x += block[i, 2 * n]
    return x


def column(block: Any, n: int, i: int) -> float:
    """Return the scaled deflection of mode n at sample i, or the total one where n is the number of modes."""
    return deflection(block, i) if n == mode_count() else block[i, 2 * n]


def lock_in_column(block: Any, n: int, points: int, ratio: float, base: float, out: Any, place: int) -> None:
    """Write the real and imaginary part of c for one column at the tone of a frequency ratio and phase."""
    h = TAU / points
    # the tone's phasor by rotation; one period is too short for the rounding to grow
    turn_c, turn_s = math.cos(ratio * h), math.sin(ratio * h)
    c, s = math.cos(base), math.sin(base)
    x = 0.5 * column(block, n, 0)
    real, imaginary = x * c, -x * s
    for i in range(1, points):
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
        x = column(block, n, i)
        real += x * c
        imaginary -= x * s
    c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    x = 0.5 * column(block, n, points)
    out[place] = 2.0 * (real + x * c) / points
    out[place + 1] = 2.0 * (imaginary - x * s) / points


def lock_in(block: Any, points: int, tones: Any, bases: Any, out: Any) -> None:
    """Write the real and imaginary part of c for the total deflection at each tone, tone after tone."""
    for j in range(tones.shape[0]):
        lock_in_column(block, mode_count(), points, tones[j, 0], bases[j], out, 2 * j)
