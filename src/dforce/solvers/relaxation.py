"""The way of motions to their states, in leaps over many periods.

Under weak damping a motion changes little from one period to the next. The map P over a common period is nearly linear for
many periods: x_h = x + (1 + M + ... + M^(h-1)) (P(x) - x), with the derivative M at x. This is exact for the linear part of the
map. After each leap the change over the next period, P(x_h) - x_h, is compared with its prediction, M^h (P(x) - x). This defect
grows as the square of the periods: its sum over the leap, the defect times the sum of (j/h)^2 over j < h, estimates the leap's
error. It corrects the leap, and its size decides whether leaps are refused, shortened or lengthened. A leap over one period is
the map itself.

Sources: L. R. Petzold, SIAM J. Numer. Anal. 18, 455 (1981), envelope-following; M. Hochbruck, A. Ostermann, Acta Numerica
19, 209 (2010), exponential Rosenbrock methods.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dforce.core.arrays import Array, Indices
from dforce.kernel.vocabulary import motion_size
from dforce.solvers.newton import longest, multiply, solve_both, subtract_from_one
from dforce.solvers.period_map import put_numbers, put_rows
from dforce.solvers.stability import is_stable

CORRECTED = 1e-3  # of the free amplitude: correction of a leap
ARRIVED = 3e-4  # of the free amplitude: Newton step from which an orbit is near
GROWTH, SHRINK = 3.0, 0.1  # of the next leap, at most and at least
SAFETY = 0.7  # of the cube root of the correction allowed over the correction
LONGEST = 1 << 20  # periods in a leap
MOST_LOOKS = 16_384  # leaps: behind so many they are short, and plain integration is quicker
LOOKS = 64  # leaps after which the motions that still leap are checked
GOING, SETTLED, LOST = 0, 1, 2  # outcome of a motion


class Leaps(NamedTuple):
    """Motions on their way, a row for each.

    Attributes
    ----------
    x, change, monodromy
        State of each, its change over the next common period, and the map's derivative there; (motions, size, ...).
    tried
        End of the current leap.
    span
        Common periods of the current leap; 0 before the first.
    periods, most
        Common periods so far, and their largest number.
    outcome
        GOING, SETTLED or LOST.
    """

    x: Any
    change: Any
    monodromy: Any
    tried: Any
    span: Any
    periods: Any
    most: Any
    outcome: Any

    @classmethod
    def begun(cls, x: Array, most: Indices) -> Leaps:
        """Return motions before their first period."""
        count, size = x.shape
        periods = np.zeros(count, np.int64)
        motions = x.copy(), np.zeros((count, size)), np.zeros((count, size, size)), x.copy()
        return cls(*motions, periods, periods.copy(), most, np.full(count, GOING, np.int64))


def leap(change: Any, monodromy: Any, span: int, way: Any, change_after: Any) -> None:
    """Write the way that a linear map leads in so many periods, and the change over the period after them.

    By squaring: over h periods the way is S_h c and the change after them M^h c, with S_2h = S_h + M^h S_h.
    """
    size = motion_size()
    power, total, product = np.eye(size), np.zeros((size, size)), np.empty((size, size))
    for bit in range(62, -1, -1):
        if (span >> bit) == 0:
            continue
        multiply(power, total, product)  # double the periods
        for i in range(size):
            for j in range(size):
                total[i, j] += product[i, j]
        multiply(power, power, product)
        power, product = product, power
        if (span >> bit) & 1:  # and one more
            multiply(monodromy, total, product)
            total, product = product, total
            for i in range(size):
                total[i, i] += 1.0
            multiply(monodromy, power, product)
            power, product = product, power
    for i in range(size):
        way[i], change_after[i] = 0.0, 0.0
        for j in range(size):
            way[i] += total[i, j] * change[j]
            change_after[i] += power[i, j] * change[j]


def take_leaps(going: Any, ends: Any, slopes: Any, leaps: Any) -> None:
    """Judge the current leaps of some motions by their ends one common period later, and begin the next leaps.

    `slopes` are the map's derivatives where the leaps have led, (motions, size, size).
    """
    size = motion_size()
    matrix, change, way, predicted = np.empty((size, size)), np.empty(size), np.empty(size), np.empty(size)
    for g in range(going.shape[0]):
        s, monodromy = going[g], slopes[g]
        for k in range(size):
            change[k] = ends[g, k] - leaps.tried[s, k]
        span, ahead = leaps.span[s], 1.0
        if not longest(change) < np.inf:
            if span <= 1:
                leaps.outcome[s] = LOST
                continue
            ahead = SHRINK
        elif span > 0:
            leap(leaps.change[s], leaps.monodromy[s], span, way, predicted)
            missed = (span - 1.0) * (2.0 * span - 1.0) / (6.0 * span)
            for k in range(size):
                predicted[k] = missed * (change[k] - predicted[k])
            ahead = SAFETY * (CORRECTED / max(longest(predicted), 1e-300)) ** (1.0 / 3.0) if span > 1 else GROWTH
        if span > 1 and ahead < SAFETY:  # refused
            leaps.span[s] = max(1, int(span * max(ahead, SHRINK)))
        else:
            leaps.periods[s] += span
            put_numbers(leaps.x[s], leaps.tried[s])
            put_numbers(leaps.change[s], change)
            put_rows(leaps.monodromy[s], monodromy)
            for k in range(size if span > 1 else 0):
                leaps.x[s, k] += predicted[k]
                leaps.change[s, k] -= predicted[k]
                for j in range(size):
                    leaps.change[s, k] += monodromy[k, j] * predicted[j]
            for k in range(size):
                change[k], predicted[k] = leaps.change[s, k], 0.0
            subtract_from_one(monodromy, matrix)
            near = solve_both(matrix, change, predicted) and longest(change) < ARRIVED
            if near and is_stable(monodromy):
                leaps.outcome[s] = SETTLED
                continue
            if leaps.periods[s] >= leaps.most[s]:
                leaps.outcome[s] = LOST
                continue
            longer = int(max(span, 1) * min(ahead, GROWTH)) if span > 0 else 1
            leaps.span[s] = max(1, min(longer, LONGEST, leaps.most[s] - leaps.periods[s]))
        leap(leaps.change[s], leaps.monodromy[s], leaps.span[s], way, predicted)
        for k in range(size):
            leaps.tried[s, k] = leaps.x[s, k] + way[k]
