r"""The parts of modes: oscillators whose sum moves as the modes do, with the memory of the fluid where it has one.

A mode without memory is one part. With memory, lever and fluid are one linear system, whose eigenvalues, two by two, belong to
oscillators. The transfer function from the force to the deflection is the sum of theirs:

.. math:: \dot x = v + b F, \qquad \dot v = -K x - 2 \eta v + g F

Each x is a share of the deflection, and each v one of the velocity: the sum of all b is zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.kernel import modes_of
from dforce.kernel.codegen import FIRST_MODE, PER_MODE

NUMBERS = 5  # of a part: half damping, square of the damped frequency, stiffness, gains of velocity and of deflection


class Parts(NamedTuple):
    """The parts of all modes, in scaled units.

    Attributes
    ----------
    numbers
        Numbers of each part, (motions, parts, NUMBERS).
    split, join
        Matrices from a deviation from the free motion to parts (x, v, x, v, ...), (motions, 2 parts, size), and back.
    """

    numbers: Array
    split: Array
    join: Array


def parts_of(numbers: Array, modes: int, late: int) -> Parts:
    """Return the parts of modes whose fluid has so many states each; `numbers` are the kernel's parameters, a row a motion."""
    count, fluid, lever = len(numbers), FIRST_MODE + PER_MODE * modes, modes_of(numbers, modes)
    if not late:
        stiff, drag, gain = np.moveaxis(lever, 2, 0)
        parts = np.stack([0.5 * drag, stiff - 0.25 * drag**2, stiff, gain, np.zeros(stiff.shape)], axis=2)
        same = np.tile(np.eye(2 * modes), (count, 1, 1))
        return Parts(parts, same, same)
    memory = numbers[:, fluid : fluid + 2 * late * modes].reshape(count, modes, 2, late)
    each = 1 + (late + 1) // 2  # parts of a mode
    parts, split = np.empty((count, modes, each, NUMBERS)), np.zeros((count, modes, 2 * each, (2 + late) * modes))
    join = np.zeros((count, (2 + late) * modes, modes, 2 * each))
    for i in range(count):
        for n in range(modes):
            first = 2 * modes + late * n
            own = [2 * n, 2 * n + 1, *range(first, first + late)]
            parts[i, n], split[i, n][:, own], join[i, own, n] = _with_memory(lever[i, n], memory[i, n], 2 * each)
    return Parts(
        parts.reshape(count, -1, NUMBERS),
        split.reshape(count, 2 * modes * each, -1),
        join.reshape(count, -1, 2 * modes * each),
    )


def _with_memory(lever: Array, memory: Array, size: int) -> tuple[Array, Array, Array]:
    """Return the numbers of the parts of one mode, and the matrices to them and back; fluid that weighs nothing is left out."""
    (stiff, drag, gain), (rates, weights) = lever, memory
    matrix = np.diag(np.concatenate([[0.0, -drag], -rates]))
    matrix[0, 1], matrix[1, 0], matrix[1, 2:], matrix[2:, 1] = 1.0, -stiff, weights, rates
    counts = np.append([0, 1], 2 + np.flatnonzero(weights))
    values, vectors = np.linalg.eig(matrix[np.ix_(counts, counts)])
    order = np.lexsort([values.real, -np.abs(values.imag)])  # pairs that swing, then the others
    values, vectors = values[order].astype(complex), vectors[:, order] / vectors[0, order]
    idle = size - len(values)  # values that complete pairs, with no motion
    values = np.append(values, values[-1].real * 0.5 ** np.arange(1.0, 1.0 + idle))
    to, back = np.zeros((size, 2 + len(rates)), complex), np.zeros((2 + len(rates), size), complex)
    to[: len(counts), counts], back[counts, : len(counts)] = np.linalg.inv(vectors), vectors
    a, b = values[::2], values[1::2]
    split, join = np.empty(to.shape), np.empty(back.shape)
    split[::2], split[1::2] = (to[::2] + to[1::2]).real, (a[:, None] * to[::2] + b[:, None] * to[1::2]).real
    join[:, ::2] = ((b * back[:, ::2] - a * back[:, 1::2]) / (b - a)).real
    join[:, 1::2] = ((back[:, 1::2] - back[:, ::2]) / (b - a)).real
    eta, stiff = -0.5 * (a + b).real, (a * b).real
    return np.stack([eta, stiff - eta**2, stiff, gain * split[1::2, 1], gain * split[::2, 1]], axis=1), split, join
