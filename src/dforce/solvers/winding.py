"""Winding number of P(x) - x along the edge of a square of the Poincaré plane: the sum of the fixed points' indices inside."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.parameter_range import ParameterRange

SAMPLES, FINER, TURN = 64, 12, 0.7  # samples of a side, number of halvings, and the largest turn between neighbors
CORNERS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])


@dataclass(frozen=True)
class Square:
    """A square of the Poincaré plane, in scaled deflection and velocity."""

    center: Array
    half: float

    def parts(self) -> list[Square]:
        """Return its four quarters."""
        return [
            Square(self.center + 0.5 * self.half * np.array(way), 0.5 * self.half)
            for way in product((-1.0, 1.0), repeat=2)
        ]

    def holds(self, x: Array) -> bool:
        """Return whether a state lies in the square."""
        return bool(np.abs(x - self.center).max() < self.half)

    def winding_number(self, among: ParameterRange, value: float) -> int | None:
        """Return the winding number of P(x) - x along its edge; None where samples do not resolve it."""
        none = np.zeros((1, 0))
        places = np.linspace(0.0, 4.0, 4 * SAMPLES + 1)
        for _ in range(FINER):
            edge = np.column_stack([np.interp(places, np.arange(5.0), CORNERS[:, i]) for i in range(2)])
            x = self.center + self.half * edge
            moves = among.vectors(among.later(among.states(x, none), value, 1)) - x
            angles = np.arctan2(moves[:, 1], moves[:, 0])
            turned = (np.diff(angles) + math.pi) % (2.0 * math.pi) - math.pi
            if np.isnan(turned).any():  # a motion has no end: no sample between resolves it
                return None
            coarse = np.abs(turned) >= TURN
            if not coarse.any():
                return round(float(turned.sum()) / (2.0 * math.pi))
            places = np.sort(np.append(places, 0.5 * (places[1:] + places[:-1])[coarse]))
        return None
