"""A single periodic orbit, stable or not: all its numbers follow from the state in a result, to the last bit."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from dforce.core.arrays import Array, Complexes
from dforce.solvers.stability import CRITICAL, STABLE, stability
from dforce.solvers.states import States

END, FOLD, PERIOD_DOUBLING, TORUS, GRAZING = "end", "fold", "period_doubling", "torus", "grazing"


@dataclass(frozen=True)
class Orbit:
    """A periodic orbit on a curve.

    Attributes
    ----------
    u
        Scaled motion and memory at the start of a common period, then the scaled parameter, shape (size + 1,).
    state
        The same motion, with memory and branches in SI.
    value, kept
        The parameter, and the state with its motion in m and m/s, as in a result.
    monodromy, by_parameter
        Derivative of the map by motion and memory, (size, size), and by the scaled parameter, (size,).
    rows
        The measurements over each period, see ``observables``.
    gaps
        Least distance minus each distance at which a force is not smooth (m).
    residual, steps
        Distance of its end from its start, relative to the free amplitude; Newton steps that led to it.
    special
        Its kind of special point: ``""``, ``fold``, ``period_doubling``, ``torus``, ``grazing`` or ``end``.
    repeats
        Number of common periods after which the motion repeats.
    error
        Estimated error, see `accuracy`; NaN where it is unknown.
    """

    u: Array
    state: States
    value: float
    kept: States
    monodromy: Array
    by_parameter: Array
    rows: Array
    gaps: Array
    residual: float
    steps: float
    special: str = ""
    repeats: int = 1
    error: float = math.nan

    @property
    def x(self) -> Array:
        """The scaled motion and memory."""
        return self.u[:-1]

    @functools.cached_property
    def multipliers(self) -> Complexes:
        """Floquet multipliers over the period after which the motion repeats, the largest first."""
        found = np.linalg.eigvals(self.monodromy).astype(complex)
        return found[np.argsort(-np.abs(found), kind="stable")]

    @property
    def equations(self) -> Array:
        """Derivatives of the residuals by the scaled unknowns, (size, size + 1)."""
        return np.column_stack([self.monodromy - np.eye(len(self.x)), self.by_parameter])

    @functools.cached_property
    def tangent(self) -> Array:
        """Unit tangent of the curve, (size + 1,), so that the equations bordered by it have a positive determinant.

        So it points the same way all along a curve.
        """
        tangent = np.linalg.svd(self.equations)[2][-1]
        return np.asarray(tangent * np.linalg.slogdet(np.vstack([self.equations, tangent]))[0])

    @property
    def index(self) -> int:
        """Sign of det(1 - M), its index as a fixed point of the map; see ``search``."""
        return int(np.linalg.slogdet(np.eye(len(self.monodromy)) - self.monodromy).sign)

    @functools.cached_property
    def stability(self) -> int:
        """Whether small disturbances die out or grow; where stability is lost, neither. See ``stability``."""
        return CRITICAL if self.special in (FOLD, PERIOD_DOUBLING, TORUS) else stability(self.monodromy)

    @property
    def is_stable(self) -> bool:
        """Whether small disturbances die out."""
        return self.stability == STABLE
