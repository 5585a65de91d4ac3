"""The periods to average over, and their weights.

Tones with commensurate frequencies repeat after a common period: averages over whole common periods are exact. Other
tones never repeat. There the motion of a period depends on the phases of the tones. An average with the weight sin^6(pi s) over
the window 0 < s < 1 approximates the average over all time. The remaining part of a beat with n turns in the window falls like
1/n^7, 3e-7 at n = 12 (G. Gómez, J. M. Mondelo, C. Simó, Discrete Contin. Dyn. Syst. B 14, 41 (2010)). So the window contains
twelve turns of the slowest beat of low order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations, product
from math import ceil, lcm

import numpy as np

from dforce.core.arrays import Array

LONGEST_COMMON = 200  # periods of the first tone; beyond this tones count as incommensurate
SAME = 1e-10  # relative difference of a frequency ratio from a fraction that is rounding
TURNS = 12  # of the slowest beat within a window
SHORTEST, LONGEST = 256, 32_768  # periods of the first tone that a window over incommensurate tones holds
ORDER = 6  # multiples of a tone that beat with the first; higher ones are small
PAIR_ORDER = 2  # the same for two tones that beat with each other and the first


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
    """Return the shortest window (periods of the first tone) over which averages mean something.

    Tones that beat more slowly than twelve times in the longest window are averaged over that one.
    """
    common = common_period(frequencies)
    if common is not None:
        return common
    beats = [beat for beat in _beats(frequencies) if beat > SAME]
    return min(max(SHORTEST, ceil(TURNS / min(beats))), LONGEST) if beats else SHORTEST


def _beats(frequencies: Sequence[float]) -> Iterator[float]:
    """Give the turns per period of the first tone of all beats of low order."""
    ratios = [frequency / frequencies[0] for frequency in frequencies[1:]]
    for ratio in ratios:
        for m in range(1, ORDER + 1):
            yield abs(m * ratio - round(m * ratio))
    orders = [m for m in range(-PAIR_ORDER, PAIR_ORDER + 1) if m]
    for first, second in combinations(ratios, 2):
        for m, n in product(orders, orders):
            yield abs(m * first + n * second - round(m * first + n * second))


def weights(frequencies: Sequence[float], periods: int) -> Array:
    """Return the weight of each period in an average; they sum to one."""
    if common_period(frequencies) is not None:
        return np.full(periods, 1.0 / periods)
    bump = np.sin(np.pi * (np.arange(periods) + 0.5) / periods) ** 6
    return np.asarray(bump / bump.sum())
