"""Least squares with a penalty on the curvature: a force at nodes from its integrals along paths.

A force bends much near a contact and little far away. So the size of its curvature is found around each node, from the data.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.optimize

from dforce.core.arrays import Array

LEAST = 1e-12  # smallest singular value that counts, as a share of the largest: below it is rounding
MORE = 2.0  # times the number of points: a chi2 beyond is no noise
BEYOND = 0.25  # of the number of nodes: after as many more a force ends
AROUND = 10.0  # nodes whose curvatures have about one size
ALIKE = 1.0  # curvatures that the data must constrain around a node, to count as much as the curvatures of all nodes
PASSES = 2  # of finding the sizes
WEIGHTS = 240  # of the penalty that are tried for the evidence


class LeastSquares(NamedTuple):
    r"""A solution of least squares.

    Attributes
    ----------
    values
        The values at the nodes.
    gain
        Their derivatives by the data, shape (nodes, points).
    noise, smoothing
        Covariance of the values by errors of the data, and by the smoothing of the penalty, shape (nodes, nodes). The values
        are normal with the sum of both if their curvatures are normal with the variance :math:`\tau^2/\lambda`.
    chi2
        Sum of the squared residuals over the errors.
    reached
        Whether `chi2` is about the number of points, as it should be.
    """

    values: Array
    gain: Array
    noise: Array
    smoothing: Array
    chi2: float
    reached: bool

    @property
    def error(self) -> Array:
        """Standard deviation of the values by noise and smoothing."""
        return np.asarray(np.sqrt(np.diag(self.noise) + np.diag(self.smoothing)))


class _Standard(NamedTuple):
    """Least squares in the curvatures, each as a share of its size, by singular values."""

    smooth: Array  # values by curvatures
    u: Array
    s: Array
    vt: Array
    share: Array  # of the data along each singular vector
    rest: float  # of their square that no values explain

    def chi2(self, weight: float) -> float:
        damped = weight / (self.s**2 + weight)
        return self.rest + float(np.sum((damped * self.share) ** 2))

    def evidence(self, logs: Array) -> Array:
        """Return the logarithm of how likely the data are, for logarithms of weights."""
        size = np.exp(-logs)[:, None] * self.s**2
        return np.asarray(-0.5 * (np.sum(np.log1p(size) + self.share**2 / (1.0 + size), axis=1) + self.rest))


def _standard(matrix: Array, data: Array, error: Array, size: Array) -> _Standard:
    nodes = matrix.shape[1]
    bend = np.zeros((nodes, nodes))
    place = np.arange(nodes - 2)
    bend[place, place], bend[place, place + 1], bend[place, place + 2] = 1.0, -2.0, 1.0
    # slope and value at the last node are sums of random curvatures beyond it, before the force ends
    beyond = BEYOND * nodes
    bend[-2, -2:], bend[-1, -1] = np.array([1.0, -1.0]) / np.sqrt(beyond), np.sqrt(3.0 / beyond**3)
    smooth = scipy.linalg.solve_triangular(bend, np.diag(size))
    u, s, vt = scipy.linalg.svd(matrix / error[:, None] @ smooth, full_matrices=False)
    kept = s > LEAST * s[0]
    share = u[:, kept].T @ (data / error)
    rest = max(float(np.sum((data / error) ** 2) - share @ share), 0.0)
    return _Standard(smooth, u[:, kept], s[kept], vt[kept], share, rest)


def evidence(matrix: Array, data: Array, error: Array) -> float:
    """Return the logarithm of how likely data are if the curvatures are random, with the size that makes it largest.

    (MacKay, Neural Computation 4, 415 (1992).) It compares ways to lay nodes.
    """
    made = _standard(matrix, data, error, np.ones(matrix.shape[1]))
    around = np.log(1e8)
    return float(
        made.evidence(np.linspace(2.0 * np.log(made.s[-1]) - around, 2.0 * np.log(made.s[0]) + around, WEIGHTS)).max()
    )


def _weight(made: _Standard) -> float:
    """Return the weight of the penalty that makes the data most likely."""
    low, high = 2.0 * np.log(made.s[-1]), 2.0 * np.log(made.s[0]) + 20.0
    tried = np.linspace(low, high, WEIGHTS)
    best, step = float(tried[np.argmax(made.evidence(tried))]), float(tried[1] - tried[0])
    found = scipy.optimize.minimize_scalar(
        lambda x: -made.evidence(np.array([x]))[0], bounds=(best - step, best + step), method="bounded"
    )
    return float(np.exp(found.x))


def _sizes(made: _Standard, weight: float) -> Array:
    r"""Return the size of the curvatures around each node, over the assumed size.

    It is the root of :math:`\lambda \sum c^2 / \sum \gamma` with weights that fall with the distance from the node, where
    :math:`\gamma` is the share of a curvature c that the data determine (MacKay).
    """
    share = made.s**2 / (made.s**2 + weight)
    curvature, told = (share / made.s * made.share) @ made.vt, share @ made.vt**2
    place = np.arange(len(told))
    near = np.exp(-0.5 * ((place[:, None] - place) / AROUND) ** 2)
    return np.asarray(np.sqrt((near @ curvature**2 * weight + ALIKE) / (near @ told + ALIKE)))


def solve(matrix: Array, data: Array, error: Array) -> LeastSquares:
    r"""Return the values that are most likely if their curvatures are random, of the size that makes the data most likely.

    Minimizes :math:`\chi^2 + \lambda |L F / \tau|^2` with second differences L between neighboring nodes, and at the last node
    the value and the first difference. The weight :math:`\lambda` has the largest evidence, and :math:`\tau` is the size of the
    curvatures around each node, found with it (MacKay, Neural Computation 4, 415 (1992)). A weight that makes :math:`\chi^2`
    the number of points (Morozov) varies with the noise: values would scatter by more than their covariance.
    """
    size = np.ones(matrix.shape[1])
    made = _standard(matrix, data, error, size)
    for _ in range(PASSES):
        size = size * _sizes(made, _weight(made))
        size /= np.sqrt(np.mean(size**2))
        made = _standard(matrix, data, error, size)
    weight, s = _weight(made), made.s
    back = made.smooth @ made.vt.T
    gain = back * (s / (s**2 + weight)) @ made.u.T / error
    hidden = made.smooth - back @ made.vt  # by curvatures that the data do not touch
    smoothing = (back * (weight / (s**2 + weight) ** 2)) @ back.T + hidden @ hidden.T / weight
    chi2 = made.chi2(weight)
    return LeastSquares(gain @ data, gain, (gain * error**2) @ gain.T, smoothing, chi2, chi2 < MORE * len(data))
