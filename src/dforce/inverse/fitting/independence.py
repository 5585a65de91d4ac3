"""Whether residuals are noise: by the correlation of neighbors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

DATA_POINTS = "data_noise_points"


def independence(fit: xr.Dataset) -> float:
    r"""Return the probability of so large a correlation of neighboring residuals, if they were the noise of the free part.

    The correlation of N independent neighbors scatters by :math:`1/\sqrt{N}` (M. S. Bartlett, J. R. Stat. Soc. Suppl. 8, 27
    (1946)). A correlation found in the free part counts with its own error.
    """
    used = np.flatnonzero(fit["used"].values & ~fit["lost"].values)
    ways = fit["direction"].values if "direction" in fit.coords else np.zeros(fit.sizes["point"])
    branch, height = fit["branch"].values, fit["height"].values
    order = used[np.lexsort((height[used], ways[used], branch[used]))]
    beside = (ways[order][1:] == ways[order][:-1]) & (branch[order][1:] == branch[order][:-1])
    rest = np.concatenate([fit[name].values[order] for name in ("amplitude_residual", "phase_residual")], axis=1)
    power, count = float((rest**2).mean()), int(beside.sum()) * rest.shape[1]
    if not (power > 0.0 and count):
        return 1.0
    known = float(fit.attrs.get("neighbor_correlation", 0.0))
    found = float((rest[1:] * rest[:-1])[beside].sum()) / (count * power)
    there = math.inf if known == 0.0 else float(fit.attrs.get(DATA_POINTS, math.inf)) * rest.shape[1]
    error = math.sqrt((1.0 - known**2) * (1.0 / count + 1.0 / there))
    return 0.5 * math.erfc((found - known) / (math.sqrt(2.0) * error))
