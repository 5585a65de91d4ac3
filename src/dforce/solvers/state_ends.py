"""How a followed state ends, which way motions leave it there, and where they land."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.integrator import Motion
from dforce.solvers.quasi_static import Branch

NEARER = 0.2  # times the distance of the next multiplier from the unit circle: that of a state close to a fold
STILL_INSIDE = 0.1  # how far from the unit circle the multiplier of a state that ends may still be


class End(NamedTuple):
    """Where a state ends: its last motion and value, the place (scaled motion and value) of the end itself, its periods."""

    last: Motion
    value: float
    edge: Array
    place: float
    cycles: int


class Left(NamedTuple):
    """A state that ended, while its motion is on the way: its amplitude (m), and the value from which the motion went."""

    end: End
    amplitude: float
    at: float


class Landing(NamedTuple):
    """An orbit on which a motion settled: its start (scaled), and what is measured over its periods."""

    x: Array
    rows: Array


def directions(ends: Branch, way: Array) -> tuple[Any, Any, Array]:
    """Return which states end in a period doubling, which in a fold, and the unit vectors along which motions leave.

    At a fold this is the direction in which the state moves: on its other side lies the unstable one. Where no multiplier is
    near the unit circle, as where the force jumps, the motion starts from the end itself.
    """
    count, size = ends.last_x.shape
    doubling, folding, aside = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool), np.zeros((count, size))
    for i in range(count):
        if not np.isfinite(ends.last_monodromy[i]).all():
            continue
        values, vectors = np.linalg.eig(ends.last_monodromy[i])
        *_, second, largest = np.argsort(np.abs(values)).tolist()
        if abs(values[largest]) < 1.0 - STILL_INSIDE:
            continue
        vector = vectors[:, largest].real
        if abs(values[largest].imag) < 1e-9 and values[largest].real > 0.0:
            vector = way[i] * ends.last_slope[i]
            folding[i] = 1.0 - abs(values[largest]) < NEARER * (1.0 - abs(values[second]))
        doubling[i] = values[largest].real < 0.0 and abs(values[largest].imag) < 1e-9
        aside[i] = vector / max(float(np.abs(vector).max()), 1e-300)
    return doubling, folding, aside
