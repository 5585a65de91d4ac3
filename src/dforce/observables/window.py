"""Over which periods to average, and with which weights.

Tones with commensurate frequencies repeat after a common period: averages over whole common periods are exact. Other
tones never repeat; there, averages with the weight exp(-1/(s (1 - s))) over the window 0 < s < 1 approach those over all
time faster than any power of its length (S. Das, Y. Saiki, E. Sander, J. A. Yorke, Nonlinearity 30, 4111 (2017)).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import lcm
from typing import Any

import numpy as np

LONGEST_COMMON = 200  # periods of the first tone; beyond this tones count as incommensurate
SAME = 1e-10  # relative difference of a frequency ratio from a fraction that is rounding
QUASIPERIODIC = 256  # periods of the first tone that a window over incommensurate tones holds


def common_period(frequencies: Sequence[float]) -> int | None:
    """Return after how many periods of the first tone all tones repeat together, or None."""
    periods = 1
    for frequency in frequencies[1:]:
        ratio = frequency / frequencies[0]
        near = Fraction(ratio).limit_denominator(LONGEST_COMMON)
        if abs(float(near) - ratio) > SAME * ratio:
            return None
        periods = lcm(periods, near.denominator)
    return periods if periods <= LONGEST_COMMON else None


def window_length(frequencies: Sequence[float]) -> int:
    """Return the shortest window (periods of the first tone) over which averages mean something."""
    return common_period(frequencies) or QUASIPERIODIC


def weights(frequencies: Sequence[float], periods: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the weight of each period in an average; they sum to one."""
    if common_period(frequencies) is not None:
        return np.full(periods, 1.0 / periods)
    s = (np.arange(periods) + 0.5) / periods
    bump = np.exp(-1.0 / (s * (1.0 - s)))
    return np.asarray(bump / bump.sum())
