"""Motions of several problems at once, each at the start of a common period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.integrator import Motion
from dforce.solvers.quasi_static import Stretch


@dataclass(frozen=True)
class States:
    """States at the start of a common period: scaled motion, forces' memory and branches, a row for each."""

    x: Array
    memory: Array
    branch: Array

    def __len__(self) -> int:
        return len(self.x)

    def take(self, which: Any) -> States:
        """Return some of them."""
        return States(self.x[which], self.memory[which], self.branch[which])

    def put(self, which: Any, others: States) -> None:
        """Write others in the place of some of them."""
        self.x[which], self.memory[which], self.branch[which] = others.x, others.memory, others.branch

    def copy(self) -> States:
        """Return a copy."""
        return States(self.x.copy(), self.memory.copy(), self.branch.copy())

    def motion(self, i: int) -> Motion:
        """Return one of them as integrators take it."""
        return Motion(tuple(self.x[i].tolist()), self.memory[i].copy(), self.branch[i].copy(), 0)

    def vectors(self, memory_scale: Array) -> Array:
        """Return scaled motions and memories side by side, (states, numbers)."""
        return np.concatenate([self.x, self.memory / memory_scale], axis=1)

    @classmethod
    def of_vectors(cls, vectors: Array, branch: Array, memory_scale: Array) -> States:
        """Return the states with these scaled motions and memories, and the branches of one state."""
        motion = vectors.shape[1] - len(memory_scale)
        return cls(vectors[:, :motion], vectors[:, motion:] * memory_scale, np.repeat(branch, len(vectors), axis=0))

    @classmethod
    def last_of(cls, found: Stretch) -> States:
        """Return the last states that were found along paths."""
        return cls(found.last_x, found.last_memory, found.last_branch)

    @classmethod
    def of(cls, *motions: Motion) -> States:
        """Return motions as states."""
        return cls(*(np.array([getattr(one, name) for one in motions]) for name in ("y", "memory", "branch")))
