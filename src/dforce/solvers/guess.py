"""Guesses of periodic orbits from those before them, and their corrections by Newton's method."""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.kernel.slots import mode_count
from dforce.solvers.lanes import lanes_over_common_period

FRESH = 1e-5  # of the free amplitude: a tangent taken farther from the orbit is taken anew on it
ASTRAY = 0.01  # of the free amplitude: a guess that needed a longer correction is not used
NUDGE = 1e-6  # of the free amplitude: distance of the neighbors that give the tangent


def correction(jacobian: Any, miss: Any, matrix: Any, step: Any) -> None:
    """Solve (J - 1) step = -miss by elimination with pivots; `matrix` is scratch."""
    size = 2 * mode_count()
    for i in range(size):
        for j in range(size):
            matrix[i, j] = jacobian[i, j] - (1.0 if i == j else 0.0)
        step[i] = -miss[i]
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if matrix[pivot, k] == 0.0:
            step[:] = np.nan
            return
        if pivot != k:
            for j in range(size):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            step[k], step[pivot] = step[pivot], step[k]
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k, size):
                matrix[i, j] -= factor * matrix[k, j]
            step[i] -= factor * step[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            step[k] -= matrix[k, j] * step[j]
        step[k] /= matrix[k, k]


def predict(orbits: Any, zc: Any, i: int, at: int, order: int, vector: Any) -> None:
    """Write a guess for the orbit at the distance numbered `at`, extrapolated through up to order + 1 orbits before i."""
    start = max(0, i - 1 - order)
    for k in range(2 * mode_count()):
        vector[k] = 0.0
    for a in range(start, i):
        weight = 1.0
        for b in range(start, i):
            if b != a:
                weight *= (zc[at] - zc[b]) / (zc[a] - zc[b])
        for k in range(2 * mode_count()):
            vector[k] += weight * orbits[a, k]


def best_order(orbits: Any, zc: Any, i: int, most: int, vector: Any) -> int:
    """Return the order of extrapolation that would have come closest to the orbit before distance i; `vector` is scratch.

    A smooth branch can be extrapolated far; where the tip touches, sampling leaves a roughness that high orders amplify.
    """
    best, least = 1, np.inf
    for order in range(1, min(most, i - 2) + 1):
        predict(orbits, zc, i - 1, i - 1, order, vector)
        error = 0.0
        for k in range(2 * mode_count()):
            error = max(error, abs(vector[k] - orbits[i - 1, k]))
        if error < least:
            best, least = order, error
    return best


def look_ahead(
    orbits: Any, zc: Any, i: int, order: int, first: int, common: int, points: int, memory: Any, latched: Any,
    tones: Any, bases: Any, table: Any, kinks: Any, stage: Any, work: Any, p: Any, guesses: Any, tangents: Any,
    strays: Any,
) -> None:  # fmt: skip
    """Write guesses and tangents for the orbits at the distances from the one numbered i on, as many as there is room for.

    Guesses are extrapolated and corrected: their neighbors at all distances are marched side by side. `strays` gets how
    long the last corrections are. They are corrected a second time where that is so long that tangents would be too far
    off, but where none is astray.
    """
    count, size = guesses.shape[0], 2 * mode_count()
    width = 2 * size
    lanes, other = np.empty((size, count * width)), np.empty((size, count * width))
    here, miss, step, matrix = np.empty(count * width), np.empty(size), np.empty(size), np.empty((size, size))
    for w in range(count):
        predict(orbits, zc, i, i + w, order, guesses[w])
        for j in range(width):
            here[w * width + j] = zc[i + w]
    for _ in range(2):
        for w in range(count):
            for j in range(width):
                for k in range(size):
                    lanes[k, w * width + j] = guesses[w, k]
                lanes[j // 2, w * width + j] += NUDGE if j % 2 == 0 else -NUDGE
        lanes_over_common_period(
            lanes, other, here, first, common, points, memory, latched, tones, bases, table, kinks, stage, work, p
        )
        longest = 0.0
        for w in range(count):
            for k in range(size):
                total = 0.0
                for j in range(size):
                    ahead, behind = lanes[k, w * width + 2 * j], lanes[k, w * width + 2 * j + 1]
                    tangents[w, k, j] = (ahead - behind) / (2.0 * NUDGE)
                    total += ahead + behind
                miss[k] = total / width - guesses[w, k]
            correction(tangents[w], miss, matrix, step)
            strays[w] = 0.0
            for k in range(size):
                guesses[w, k] += step[k]
                strays[w] = max(strays[w], abs(step[k])) if abs(step[k]) < np.inf else np.inf
            longest = max(longest, strays[w])
        if not FRESH < longest < ASTRAY:
            return
