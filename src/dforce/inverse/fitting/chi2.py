"""Whether chi2 is as large as noise makes it, too large or too small."""

from __future__ import annotations

import math
from typing import NamedTuple

MOST = 3.0  # times its standard deviation: how far reduced chi2 may be from 1
AS_EXPECTED, TOO_LARGE, TOO_SMALL = "as expected", "too large", "too small"
WHY = {
    AS_EXPECTED: "the model describes the data within their noise",
    TOO_LARGE: (
        "the model does not describe the data within their noise, so the errors are lower bounds. Check the residuals: "
        "another force, base excitation, a drift or a wrong phase offset"
    ),
    TOO_SMALL: "the noise is smaller than assumed. The errors are too large by the square root of chi2",
}


class JudgedChi2(NamedTuple):
    """Reduced chi2, its limit on that side of 1, and one of the words of :data:`WHY`."""

    reduced: float
    limit: float
    word: str


def judged(chi2: float, freedom: float, noise_points: float = math.inf) -> JudgedChi2:
    r"""Return what chi2 says of a fit.

    Reduced chi2 scatters by :math:`\sqrt{2/n}` for n degrees of freedom, and by as much for the noise found in m points.
    """
    reduced, width = chi2 / freedom, math.sqrt(2.0 / freedom + 2.0 / noise_points)
    word = AS_EXPECTED if abs(reduced - 1.0) < MOST * width else TOO_LARGE if reduced > 1.0 else TOO_SMALL
    return JudgedChi2(reduced, 1.0 + math.copysign(MOST * width, reduced - 1.0), word)
