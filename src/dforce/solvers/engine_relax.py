"""The way of motions to their states on the engine, in leaps over many periods; see ``relaxation``."""

from __future__ import annotations

import numpy as np

from dforce.core.arrays import Array, Bools, Indices
from dforce.solvers.engine_follow import OrbitFinder
from dforce.solvers.relaxation import ARRIVED, CORRECTED, GROWTH, LONGEST, SAFETY, SHRINK
from dforce.solvers.stability import is_stable
from dforce.solvers.states import States


def relaxed(block: OrbitFinder, which: Indices, states: States, at: Array, most: Indices) -> tuple[Array, Bools, Array]:
    """Return where motions come to, which are near a stable orbit there, and the common periods that it took."""
    count, size = states.x.shape
    x, tried, change = states.x.copy(), states.x.copy(), np.zeros((count, size))
    monodromy, span, gone = np.zeros((count, size, size)), np.zeros(count, np.int64), np.zeros(count, np.int64)
    settled, going = np.zeros(count, dtype=bool), np.arange(count)
    while len(going):
        here = States(tried[going], states.memory[going], states.branch[going])
        out = block.derived(which[going], here, at[going], 1)
        new, spans = out.path[:, -1] - tried[going], span[going]
        lost = ~np.isfinite(new).all(axis=1)
        _, foretold = leap(change[going], monodromy[going], spans)
        missed = (spans - 1.0) * (2.0 * spans - 1.0) / (6.0 * np.maximum(spans, 1))
        moved = np.where((spans > 1)[:, None], missed[:, None] * (new - foretold), 0.0)
        error = np.maximum(np.abs(moved).max(axis=1), 1e-300)
        with np.errstate(invalid="ignore"):
            ahead = np.where(spans > 1, SAFETY * (CORRECTED / error) ** (1.0 / 3.0), np.where(spans == 1, GROWTH, 1.0))
        ahead = np.where(lost, SHRINK, ahead)
        refused = (spans > 1) & (ahead < SAFETY)
        given_up = lost & (spans <= 1)
        span[going[refused]] = np.maximum(1, (spans * np.maximum(ahead, SHRINK)).astype(np.int64))[refused]
        taken = np.flatnonzero(~refused & ~given_up)
        at_taken = going[taken]
        gone[at_taken] += spans[taken]
        monodromy[at_taken] = out.columns[taken, :, :size]
        x[at_taken] = tried[at_taken] + moved[taken]
        change[at_taken] = new[taken] - moved[taken] + np.einsum("ijk,ik->ij", monodromy[at_taken], moved[taken])
        matrix = np.eye(size) - monodromy[at_taken]
        with np.errstate(all="ignore"):
            regular = np.abs(np.linalg.det(matrix)) > 0.0
            matrix[~regular] = np.eye(size)
            length = np.abs(np.linalg.solve(matrix, change[at_taken, :, None])[..., 0]).max(axis=1)
        near = regular & (length < ARRIVED)
        for i in np.flatnonzero(near).tolist():
            settled[at_taken[i]] = is_stable(monodromy[at_taken[i]])
        over = settled[at_taken] | (gone[at_taken] >= most[at_taken])
        longer = np.where(spans[taken] > 0, np.maximum(spans[taken], 1) * np.minimum(ahead[taken], GROWTH), 1.0)
        left = np.minimum(longer, np.minimum(LONGEST, most[at_taken] - gone[at_taken]))
        span[at_taken] = np.maximum(1, left.astype(np.int64))
        going = np.sort(np.concatenate([going[refused], at_taken[~over]]))
        tried[going] = x[going] + leap(change[going], monodromy[going], span[going])[0]
        block.check_cancelled()
    return x, settled, gone.astype(float)


def leap(change: Array, monodromy: Array, span: Indices) -> tuple[Array, Array]:
    """Return the way that a linear map leads in so many periods, and the change over the period after them."""
    count, size = change.shape
    power, total = np.tile(np.eye(size), (count, 1, 1)), np.zeros((count, size, size))
    for bit in range(int(span.max(initial=0)).bit_length() - 1, -1, -1):
        begun = (span >> bit > 0)[:, None, None]
        total = np.where(begun, total + power @ total, total)
        power = np.where(begun, power @ power, power)
        odd = ((span >> bit) & 1 > 0)[:, None, None]
        total = np.where(odd, monodromy @ total + np.eye(size), total)
        power = np.where(odd, monodromy @ power, power)
    return (total @ change[..., None])[..., 0], (power @ change[..., None])[..., 0]
