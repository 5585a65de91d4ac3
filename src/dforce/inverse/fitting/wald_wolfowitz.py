"""Whether residuals are noise: by the number of runs of one sign."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def runs_test(result: xr.Dataset) -> float:
    """Return the probability of so few runs in the residuals of a fit, if they were noise.

    Source: A. Wald, J. Wolfowitz, Ann. Math. Stat. 11, 147 (1940).
    """
    used = result["used"].values & ~result["lost"].values
    order = np.lexsort((result["height"].values[used], result["branch"].values[used]))
    excess, variance = 0.0, 0.0
    for name in ("amplitude_residual", "phase_residual"):
        for column in result[name].values.T:
            sign = column[used][order] > 0.0
            above, count = int(sign.sum()), len(sign)
            expected = 1.0 + 2.0 * above * (count - above) / count
            excess += 1 + int((sign[1:] != sign[:-1]).sum()) - expected
            variance += (expected - 1.0) * (expected - 2.0) / max(count - 1, 1)
    return 0.5 * math.erfc(-excess / math.sqrt(2.0 * variance)) if variance > 0.0 else 0.0
