"""Whether residuals are noise: by the number of runs of one sign."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def runs_test(result: xr.Dataset) -> float:
    """Return the probability of so few runs in the residuals of a fit, if they were noise correlated like the free part.

    Neighbors with the correlation r have different signs with the probability arccos(r) / pi (S. O. Rice,
    Bell Syst. Tech. J. 24, 46 (1945)).

    Source: A. Wald, J. Wolfowitz, Ann. Math. Stat. 11, 147 (1940).
    """
    used = result["used"].values & ~result["lost"].values
    ways = result["direction"].values if "direction" in result.coords else np.zeros(len(used))
    order = np.lexsort((result["height"].values[used], ways[used], result["branch"].values[used]))
    excess, variance = 0.0, 0.0
    r = float(result.attrs.get("neighbor_correlation", 0.0))
    share = 2.0 * math.acos(r) / math.pi  # of the changes of sign of white noise
    for name in ("amplitude_residual", "phase_residual"):
        for column in result[name].values.T:
            sign = column[used][order] > 0.0
            above, count = int(sign.sum()), len(sign)
            expected = 1.0 + 2.0 * above * (count - above) / count
            excess += int((sign[1:] != sign[:-1]).sum()) - share * (expected - 1.0)
            wider = share * (2.0 - share) * (1.0 + r * r)  # by simulation within 15 % up to r = 0.9
            variance += wider * (expected - 1.0) * (expected - 2.0) / max(count - 1, 1)
    return 0.5 * math.erfc(-excess / math.sqrt(2.0 * variance)) if variance > 0.0 else 0.0
