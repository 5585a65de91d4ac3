"""The exponential of the laws: without a call, so that many motions march side by side, and soon known."""

from __future__ import annotations

import numpy as np

# powers of two in steps of 1/256: the remainder of a step needs only a short polynomial
LAST, SHIFT = 255, 44  # of the steps; places of the exponent's bits behind the bits of the steps
PER_E = 369.3299304675746  # steps to a factor of e: 256 / ln 2
REACH = 708.0 * PER_E  # beyond it on either side the result is 0 or infinity
ROUNDER = 6755399441055744.0  # 1.5 * 2^52: a number added to it is rounded to a whole number in the last bits
# the bits of 2^(k / 256), less the bits of k at their place
POWERS = (2.0 ** (np.arange(LAST + 1) / (LAST + 1))).view(np.int64) - (np.arange(LAST + 1, dtype=np.int64) << SHIFT)
# (2^(r / 256) - 1) / r to a relative error of 5e-18 for |r| < 1/2, interpolated at Chebyshev's nodes
C1, C2, C3, C4 = 0.0027076061740622767, 3.665565596910102e-06, 3.308302983772032e-09, 2.2393953277133572e-12


def exponential(x: float) -> float:
    """Return exp(x), not a number where x is none.

    The error is a few units in the last place, plus the change by such a unit of x.
    """
    return raised(x * PER_E, 1.0)


def raised(x: float, factor: float) -> float:
    """Return factor * 2^(x / 256), that is factor * exp(x / PER_E): quicker for a law with x in these steps."""
    if abs(x) < REACH:
        shifted = x + ROUNDER
        whole = np.float64(shifted).view(np.int64)
        scale = factor * np.int64(POWERS[whole & LAST] + (whole << SHIFT)).view(np.float64)
        r = x - (shifted - ROUNDER)
        r2 = r * r
        return scale * ((1.0 + C1 * r) + r2 * ((C2 + C3 * r) + C4 * r2))
    return np.float64(0.0) if x < 0.0 else factor * x * np.float64(np.inf)
