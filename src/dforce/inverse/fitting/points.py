"""A measured curve for a fit: points, errors, and the branch of each point.

A point lies on one of two branches. The branch of free motion is followed from the far end to the near end, the branch behind
a jump from its nearest point outward. The place of a jump is not used: it depends on the steps and on the noise.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri, stdtrit

from dforce.core.arrays import Array, Bools, Indices, Texts

FROM_FREE, BEHIND_JUMP = 1, -1  # the two branches, as the variable `branch` of measured curves numbers them
BESIDE_JUMP, SPIKE, NOT_SELECTED = "beside a jump", "spike", "not selected"  # why points are left out
NEIGHBORS = 4  # steps on both sides for the slope of a curve
STRETCH = 5.0  # errors of a height to each side: over that the noise of the heights does not flatten a slope


@dataclass(frozen=True)
class MeasuredPoints:
    """Points of a measured curve.

    Attributes
    ----------
    height
        m, larger is farther from the sample, (points,).
    amplitude, phase
        m and degrees of lag, (points, tones).
    branch
        :data:`FROM_FREE` or :data:`BEHIND_JUMP`, (points,).
    used
        Which points count in the fit, (points,).
    amplitude_error, phase_error
        Their standard deviations, (tones,).
    correlation
        Correlation of the noise of neighbors.
    attrs
        Other attributes of the data.
    noise_points
        Number of points behind the standard deviations, for their uncertainty; infinite where they are known.
    height_error
        Standard deviation of a height (m).
    direction
        Direction of each point, (points,); None where the data do not distinguish them.
    left_out
        Why each point is left out of the fit, empty where it counts, (points,).
    """

    height: Array
    amplitude: Array
    phase: Array
    branch: Indices
    used: Bools
    amplitude_error: Array
    phase_error: Array
    correlation: float
    attrs: Mapping[str, Any]
    noise_points: float = math.inf
    height_error: float = 0.0
    direction: Texts | None = None
    left_out: Texts | None = None

    @property
    def tones(self) -> int:
        """How many tones were measured."""
        return int(self.amplitude.shape[1])

    @property
    def widening(self) -> tuple[float, float]:
        r"""How much wider intervals of 68 % and 95 % are than for known noise: quantiles of Student's t over normal ones.

        The noise of n free points comes from the differences of neighbors. Its square scatters as with
        :math:`\nu = 2 (n - 1)^2 / (3 n - 4)` degrees of freedom (J. von Neumann et al., Ann. Math. Stat. 12, 153 (1941)), so
        :math:`(\hat p - p) / s` of a parameter known from one channel has the distribution of t. Amplitude and phase have each
        their own noise: a parameter known from both has :math:`\nu` to :math:`2 \nu` degrees of freedom (F. E. Satterthwaite,
        Biometrics Bull. 2, 110 (1946)). The smaller number counts.
        """
        if math.isinf(self.noise_points):
            return 1.0, 1.0
        freedom = 2.0 * (self.noise_points - 1.0) ** 2 / (3.0 * self.noise_points - 4.0)
        one, most = (float(stdtrit(freedom, share) / ndtri(share)) for share in (ndtr(1.0), 0.975))
        return one, most

    @property
    def count(self) -> int:
        """How many numbers count in the fit."""
        return 2 * self.tones * int(self.used.sum())

    @property
    def sigma(self) -> Array:
        """Standard deviations of amplitudes, then phases, (2 tones,)."""
        return np.concatenate([self.amplitude_error, self.phase_error])

    @functools.cached_property
    def spread(self) -> Array:
        """Standard deviations of amplitudes, then phases, at each point, (points, 2 tones).

        On a steep part of a curve the noise of its heights adds to the noise of the values (the effective variance; J. Orear,
        Am. J. Phys. 50, 912 (1982)).
        """
        plain = np.broadcast_to(self.sigma, self.values.shape)
        return np.hypot(plain, self._steepness() * self.height_error) if self.height_error else plain

    def _steepness(self) -> Array:
        """Return the slope of each value over the height, by a line through its neighbors, (points, 2 tones)."""
        out = np.zeros(self.values.shape)
        for kind in (FROM_FREE, BEHIND_JUMP):
            places = np.flatnonzero(self.branch == kind)
            order = places[np.argsort(self.height[places], kind="stable")]
            for number, place in enumerate(order):
                near = np.abs(self.height[order] - self.height[place]) <= STRETCH * self.height_error
                near[max(number - NEIGHBORS, 0) : number + NEIGHBORS + 1] = True
                x = self.height[order[near]] - self.height[order[near]].mean()
                if x.any():
                    out[place] = x @ self.values[order[near]] / (x @ x)
        return out

    @property
    def values(self) -> Array:
        """Amplitudes, then phases, (points, 2 tones)."""
        return np.concatenate([self.amplitude, self.phase], axis=1)
