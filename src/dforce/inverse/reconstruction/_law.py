"""A force law by values at nodes: dense near the sample, cubic between nodes, a power of the distance beyond the last."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dforce.core.arrays import Array

FALL = 2.0  # exponent of the force beyond the last node: van der Waals between sphere and plane


class Law(NamedTuple):
    r"""A force law by values at nodes.

    The nodes lie evenly in :math:`s = \ln(1 + (d - d_0)/w)`; between them the values follow the cubic through four.

    Attributes
    ----------
    low, width
        Distance (m) of the first node, and the distance w within which nodes lie closest.
    step
        Spacing of the nodes in s.
    force, damping
        Force (N) and damping coefficient (kg/s) at the nodes.
    length
        Length (m) of the force beyond the last node: :math:`F_N (1 + (d - d_N)/\ell)^{-2}`.
    """

    low: float
    width: float
    step: float
    force: Array
    damping: Array
    length: float

    @property
    def nodes(self) -> Array:
        """Distances of the nodes (m)."""
        return np.asarray(self.low + self.width * np.expm1(self.step * np.arange(len(self.force))))


def laid(low: float, high: float, width: float, count: int) -> Law:
    """Return a law without force with nodes between two distances."""
    step = float(np.log1p((high - low) / width)) / (count - 1)
    return Law(low, width, step, np.zeros(count), np.zeros(count), high - low)


def shares(law: Law, distance: Array) -> tuple[Any, Array]:
    """Return the first of four nodes beside each distance, and the share of each, shape (4, ...)."""
    last = len(law.force) - 1
    s = np.log1p(np.maximum(distance - law.low, 0.0) / law.width) / law.step
    first = np.clip(s.astype(int) - 1, 0, last - 3)
    x = s - first
    share = np.stack(
        [
            -(x - 1.0) * (x - 2.0) * (x - 3.0) / 6.0,
            x * (x - 2.0) * (x - 3.0) / 2.0,
            -x * (x - 1.0) * (x - 3.0) / 2.0,
            x * (x - 1.0) * (x - 2.0) / 6.0,
        ]
    )
    beyond = s > last
    if beyond.any():
        share[:, beyond] = 0.0
        share[3, beyond] = (1.0 + (distance[beyond] - law.nodes[-1]) / law.length) ** -FALL
    return first, share


def force_of(law: Law, values: Array, distance: Array) -> Array:
    """Interpolate values at the nodes to distances; below the first node its own value."""
    first, share = shares(law, distance)
    return np.asarray(sum(share[number] * values[first + number] for number in range(len(share))))
