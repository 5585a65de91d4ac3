"""The exponential of the laws: without a call, so that many motions march side by side, and one does not wait for it."""

from __future__ import annotations

import numpy as np

LOW, HIGH = -708.0, 709.0  # beyond these the result is 0 and infinity
PER_LN2 = 1.4426950408889634
# ln 2 in two parts: multiples of the first are exact
LN2, LN2_REST = 0.6931471526622772, 2.7897668087737545e-08
ROUNDER = 6755399441055744.0  # 1.5 * 2^52: what is added to it is rounded to a whole number, found in the last bits
BIAS = 1023  # of the exponent in a number's bits
# (exp(r) - 1 - r) / r^2 to a relative error of exp(r) of 2e-17 for |r| < ln(2)/2, interpolated at Chebyshev's nodes
C0, C1, C2, C3, C4 = 0.5, 0.16666666666666669, 0.04166666666662413, 0.008333333333330062, 0.0013888888917213717
C5, C6, C7 = 0.00019841269863053618, 2.4801521295954376e-05, 2.7557268459997064e-06
C8, C9 = 2.7620088445409746e-07, 2.510038549551032e-08


def exponential(x: float) -> float:
    """Return exp(x) to a few units in the last place; not a number for what is none."""
    if x < LOW:
        return np.float64(0.0)
    if x > HIGH:
        return np.float64(np.inf)
    shifted = x * PER_LN2 + ROUNDER
    whole = shifted - ROUNDER
    r = x - whole * LN2 - whole * LN2_REST
    r2 = r * r
    r4 = r2 * r2
    low = (C0 + C1 * r) + r2 * (C2 + C3 * r)
    high = (C4 + C5 * r) + r2 * (C6 + C7 * r)
    rest = low + r4 * (high + r4 * (C8 + C9 * r))
    bits = (np.float64(shifted).view(np.int64) + BIAS) << 52
    return np.int64(bits).view(np.float64) * (1.0 + r + r2 * rest)
