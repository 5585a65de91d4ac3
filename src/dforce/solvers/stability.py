r"""The decision whether small disturbances of a periodic motion die out, with a margin for the error of the derivative.

Differences of motions give the derivative M of the map over a common period with an error E. In all later periods together a
disturbance moves the state by at most :math:`S = \sum_k \|M^k\|` times its size. If :math:`S \|E\| < 1` no matrix as near to
M has a multiplier on the unit circle, because :math:`\|(z - M)^{-1}\| \le S` there. Otherwise the last bits of a sum would
decide, as beside a fold: multipliers are the less certain the nearer they are to each other, as at high Q.

Sources: L. N. Trefethen, M. Embree, Spectra and Pseudospectra, Princeton University Press (2005), chapters 14 and 16;
C. F. Van Loan, Contemp. Math. 47, 465 (1985), distance to instability.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.newton import multiply
from dforce.solvers.period_map import FD_STEP

STABLE, CRITICAL, UNSTABLE = 1, 0, -1
# of the largest entry of M: its error, from the rounding of a motion over a period (some 10 ulps) between neighbors so near
ERROR = 10.0 * float(np.finfo(float).eps) / FD_STEP
SMALL = 0.1  # a power of M, times its size, so small: later powers are negligible


def is_stable(monodromy: Any) -> bool:
    """Return whether small disturbances die out for any error of M; compiled, as :func:`stability` in Python."""
    size = monodromy.shape[0]
    power, product = monodromy.copy(), np.empty((size, size))
    error, total, periods = 0.0, 1.0, 1.0
    while True:
        largest = 0.0
        for i in range(size):
            for j in range(size):
                entry = abs(power[i, j])
                if not entry < np.inf:
                    return False
                largest = max(largest, entry)
        if periods == 1.0:
            error = ERROR * largest
        total += periods * largest  # as if the powers up to the next square were as large
        if not total * error < 1.0:
            return False
        if size * largest < SMALL:
            return True
        multiply(power, power, product)
        power, product = product, power
        periods *= 2.0


def stability(monodromy: Array) -> int:
    """Return whether disturbances die out (STABLE), grow (UNSTABLE), or either within the error of M (CRITICAL).

    They grow by more than the error if they die out as clearly with the largest multiplier mirrored at the unit circle.
    """
    if not np.isfinite(monodromy).all():
        return UNSTABLE
    largest = float(np.abs(np.linalg.eigvals(monodromy)).max(initial=0.0))
    inside = monodromy if largest < 1.0 else monodromy / largest**2
    if not _dies_out(inside):
        return CRITICAL
    return STABLE if largest < 1.0 else UNSTABLE


def _dies_out(monodromy: Array) -> bool:
    """Do as :func:`is_stable`, for matrices of any size."""
    error, power = ERROR * float(np.abs(monodromy).max(initial=0.0)), monodromy
    total, periods = 1.0, 1.0
    while True:
        largest = float(np.abs(power).max(initial=0.0))
        total += periods * largest
        if not total * error < 1.0:
            return False
        if len(power) * largest < SMALL:
            return True
        power, periods = power @ power, 2.0 * periods
