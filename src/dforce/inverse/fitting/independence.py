"""Whether residuals are noise, and how much correlated noise widens errors: by the correlation of neighbors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Array, Indices
from dforce.inverse.fitting.certainty import CORRELATED

if TYPE_CHECKING:
    import xarray as xr

    from dforce.inverse.fitting.model import CurveModel, Prediction

DATA_POINTS = "data_noise_points"
SURE = 2.0  # standard deviations beyond which neighboring residuals are correlated
REACH = 16  # of the longest row the correlation is tested over: 1 / REACH
WINDOW = 5.0  # times the length of the correlation: so far it is summed
SHARE = 2  # of the longest row the correlation is summed over, at most: 1 / SHARE


def neighbors(branch: Indices, ways: Any, height: Array) -> list[Indices]:
    """Return places of neighbors, in the order of their heights, for each direction on each branch."""
    order = np.lexsort((height, ways, branch))
    cuts = np.flatnonzero((np.diff(branch[order]) != 0) | (ways[order][1:] != ways[order][:-1])) + 1
    return np.split(order, cuts)


def _lagged(rows: list[Array], lag: int) -> float:
    """Return the sum of products of residuals so many places apart."""
    return sum(float((row[lag:] * row[: len(row) - lag]).sum()) for row in rows if len(row) > lag)


def independence(fit: xr.Dataset) -> float:
    r"""Return the probability of so large a correlation of neighboring residuals, if they were the noise of the free part.

    The correlation of N independent neighbors scatters by :math:`1/\sqrt{N}` (M. S. Bartlett, J. R. Stat. Soc. Suppl. 8, 27
    (1946)). Sums over 1, 2, 4, ... lags show a weak correlation that is long, as of a wrong model; the least of their
    probabilities counts, times their number. A correlation found in the free part counts with its own error, at lag 1.
    """
    used = np.flatnonzero(fit["used"].values & ~fit["lost"].values)
    ways = fit["direction"].values if "direction" in fit.coords else np.zeros(fit.sizes["point"])
    rest = np.concatenate([fit[name].values[used] for name in ("amplitude_residual", "phase_residual")], axis=1)
    rows = [rest[row] for row in neighbors(fit["branch"].values[used], ways[used], fit["height"].values[used])]
    power, tones = float((rest**2).mean()) if rest.size else 0.0, rest.shape[1]
    longest = max(map(len, rows))
    if not (power > 0.0 and longest > 1):
        return 1.0
    known = float(fit.attrs.get("neighbor_correlation", 0.0))
    most = max(longest // REACH, 1)
    pairs = np.array([tones * sum(max(len(row) - lag, 0) for row in rows) for lag in range(1, most + 1)])
    if known != 0.0:
        there = float(fit.attrs.get(DATA_POINTS, math.inf)) * tones
        error = math.sqrt((1.0 - known**2) * (1.0 / pairs[0] + 1.0 / there))
        return _by_chance((_lagged(rows, 1) / (pairs[0] * power) - known) / error)
    found = np.cumsum([_lagged(rows, lag) for lag in range(1, most + 1)] / (pairs * power))
    errors = np.sqrt(np.cumsum(1.0 / pairs))
    lags = 2 ** np.arange(most.bit_length())
    return min(1.0, len(lags) * min(_by_chance(found[lag - 1] / errors[lag - 1]) for lag in lags.tolist()))


def _by_chance(deviation: float) -> float:
    """Return the probability of a deviation so large, in standard deviations."""
    return 0.5 * math.erfc(deviation / math.sqrt(2.0))


def inflation(model: CurveModel, predicted: Prediction) -> float:
    r"""Return the factor by which correlated noise raises the covariance of a fit, 1 for white noise.

    The correlation r of neighbors in the free part raises it by :math:`(1 + r) / (1 - r)`, the correlation of residuals by
    their :func:`lasting`; the larger counts.
    """
    data, known = model.data, model.data.correlation
    places = np.flatnonzero(~predicted.lost)
    points, rest = model.points[places], model.residuals(predicted)[places]
    ways = np.zeros(len(data.height)) if data.direction is None else data.direction
    rows = neighbors(data.branch[points], ways[points], data.height[points])
    least = (1.0 + known) / (1.0 - known) if known > CORRELATED else 1.0
    return max(least, lasting([rest[row] for row in rows]))


def lasting(rows: list[Array]) -> float:
    r"""Return the variance of the sum of residuals, relative to white noise; 1 where neighbors are not correlated.

    With autocovariances :math:`c_k` in standard deviations it is :math:`c_0 + 2 \sum c_k`. The sum ends at five times the
    length of the correlation (A. D. Sokal, in Functional Integration, ed. C. DeWitt-Morette et al., p. 131 (1997)). Neighbors
    are correlated beyond two standard deviations.

    Parameters
    ----------
    rows
        Residuals of neighbors, in standard deviations, (points, numbers) each.
    """
    power, count = _lagged(rows, 0), sum(row.size for row in rows)
    if not _lagged(rows, 1) > SURE * power / math.sqrt(max(count, 1)):
        return 1.0
    longer, lag, most = 1.0, 0, max(len(row) for row in rows) // SHARE
    while lag < most and lag < WINDOW * longer:
        lag += 1
        longer += 2.0 * _lagged(rows, lag) / power
    return max(1.0, longer * max(power / count, 1.0))
