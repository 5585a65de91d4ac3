"""Least squares with a penalty on the curvature: a force at nodes from what it does along paths."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import scipy.optimize

Array = np.ndarray[Any, np.dtype[np.float64]]

LEAST = 1e-12  # smallest singular value that counts, as a share of the largest: below it is rounding
MORE = 2.0  # times the least chi2 that no force goes below
WEIGHTS = 240  # of the penalty that are tried for the evidence


class Fit(NamedTuple):
    r"""A solution of least squares.

    Attributes
    ----------
    values
        At the nodes.
    gain
        What each of the data does to them, shape (nodes, points).
    noise, smoothing
        Covariance of the values by errors of the data, and by what the penalty hides, shape (nodes, nodes): the values are
        normal with the sum of both where their curvatures are normal with the variance :math:`1/\lambda`.
    chi2
        Sum of the squared residuals over the errors.
    reached
        Whether `chi2` is the number of points, as it should be.
    """

    values: Array
    gain: Array
    noise: Array
    smoothing: Array
    chi2: float
    reached: bool


class _Standard(NamedTuple):
    """Least squares in the curvatures, by singular values."""

    smooth: Array  # values by curvatures
    u: Array
    s: Array
    vt: Array
    share: Array  # of the data along each singular vector
    rest: float  # of their square that no values explain

    def chi2(self, weight: float) -> float:
        damped = weight / (self.s**2 + weight)
        return self.rest + float(np.sum((damped * self.share) ** 2))


def _standard(matrix: Array, data: Array, error: Array) -> _Standard:
    nodes = matrix.shape[1]
    bend = np.zeros((nodes, nodes))
    place = np.arange(nodes - 2)
    bend[place, place], bend[place, place + 1], bend[place, place + 2] = 1.0, -2.0, 1.0
    bend[-2, -2:], bend[-1, -1] = (1.0, -1.0), 1.0  # far away a force ends
    smooth = scipy.linalg.solve_triangular(bend, np.eye(nodes))
    u, s, vt = scipy.linalg.svd(matrix / error[:, None] @ smooth, full_matrices=False)
    kept = s > LEAST * s[0]
    share = u[:, kept].T @ (data / error)
    rest = max(float(np.sum((data / error) ** 2) - share @ share), 0.0)
    return _Standard(smooth, u[:, kept], s[kept], vt[kept], share, rest)


def evidence(matrix: Array, data: Array, error: Array) -> float:
    """Return the logarithm of how likely data are if the curvatures are random, with the size that makes it largest.

    (MacKay, Neural Computation 4, 415 (1992).) It compares ways to lay nodes.
    """
    made = _standard(matrix, data, error)
    size = np.geomspace(1e-8 * made.s[0] ** -2, 1e8 * made.s[-1] ** -2, WEIGHTS)[:, None] * made.s**2
    found = -0.5 * np.sum(np.log1p(size) + made.share**2 / (1.0 + size), axis=1)
    return float(found.max()) - 0.5 * made.rest


def solve(matrix: Array, data: Array, error: Array) -> Fit:
    r"""Return the smoothest values whose residuals are as large as the errors.

    Minimizes :math:`\chi^2 + \lambda |L F|^2` with second differences L between neighboring nodes, and at the last node the
    value and the first difference. The weight :math:`\lambda` makes :math:`\chi^2` the number of points (Morozov, Soviet Math.
    Dokl. 7, 414 (1966)), or twice the least one where none does: the errors are too small then.
    """
    made = _standard(matrix, data, error)
    s, count = made.s, len(data)
    low, high = 2.0 * np.log(s[-1]), 2.0 * np.log(s[0]) + 20.0
    least = made.chi2(np.exp(low))
    reached, wanted = least < count, max(float(count), MORE * least)
    if made.chi2(np.exp(high)) > wanted:
        weight = float(np.exp(scipy.optimize.brentq(lambda x: made.chi2(np.exp(x)) - wanted, low, high)))
    else:
        weight = float(np.exp(high))
    back = made.smooth @ made.vt.T
    gain = back * (s / (s**2 + weight)) @ made.u.T / error
    hidden = made.smooth @ made.smooth.T - back @ back.T  # curvatures that the data do not touch
    smoothing = (back * (weight / (s**2 + weight) ** 2)) @ back.T + hidden / weight
    return Fit(gain @ data, gain, (gain * error**2) @ gain.T, smoothing, made.chi2(weight), reached)
