"""The certainty of the unknowns at a minimum: covariance, unseen unknowns, and known products."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dforce.core.arrays import Array, Bools
from dforce.inverse.fitting.unknowns import Unknown

DEAD = 1e-10  # of the largest eigenvalue of the scaled information: a direction that the data do not constrain
UNSEEN = 1.0  # error of a logarithm beyond which a parameter is not seen, even with all others known
FAINT = 1e-6  # the same for others: of the largest column
CORRELATED = 0.1  # of neighbors: below, the noise counts as white
QUARTER, NEAR_QUARTER = 0.25, 0.02  # powers in a product are rounded to quarters, where they are near
PIVOTS = ("radius", ".k", ".Q")  # the factors of strengths in a product: H R, E sqrt(R), ...
ONE, MOST = 1.0, 3.84  # rise of chi2 at one standard deviation, and at 95 %
SURE = 1.96  # standard deviations of an interval of 95 %
SMALL_POWER = 0.1  # powers below are none
TOGETHER = 0.98  # correlation beyond which two parameters are known only together
NOT_TOLD = 0.5  # relative error beyond which a parameter is not constrained


@dataclass(frozen=True)
class Certainty:
    """The certainty of unknowns.

    Attributes
    ----------
    seen
        Which of them the data constrain at all, (unknowns,).
    covariance
        Covariance of the varied numbers, NaN where a number is not seen, (unknowns, unknowns).
    dead
        Directions in which nothing is known: powers of each unknown, (directions, unknowns).
    inflation
        Factor by which correlated noise of neighbors has raised the covariance.
    widening
        Factors by which intervals of 68 % and 95 % are wider than for known noise.
    """

    seen: Bools
    covariance: Array
    dead: Array
    inflation: float = 1.0
    widening: tuple[float, float] = (1.0, 1.0)

    @classmethod
    def unknown(cls, count: int) -> Certainty:
        """Return the certainty of `count` unknowns about which nothing is known."""
        return cls(np.ones(count, bool), np.full((count, count), np.nan), np.zeros((0, count)))

    @property
    def errors(self) -> Array:
        """Standard deviations of the varied numbers; infinite where only a product is known."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def levels(self) -> tuple[float, float]:
        """Standard deviations from a value to the ends of its intervals of 68 % and 95 %."""
        return self.widening[0], SURE * self.widening[1]

    @property
    def rises(self) -> tuple[float, float]:
        """Rises of chi2 at these ends."""
        return self.inflation * ONE * self.widening[0] ** 2, self.inflation * MOST * self.widening[1] ** 2

    @property
    def without_errors(self) -> Certainty:
        """The same with no error known."""
        return replace(self, covariance=np.full_like(self.covariance, np.nan), dead=self.dead[:0])

    @property
    def correlation(self) -> Array:
        """Correlations, NaN where one is not known."""
        errors = self.errors
        with np.errstate(invalid="ignore"):
            return np.asarray(self.covariance / np.outer(errors, errors))

    @property
    def closest(self) -> tuple[float, tuple[int, int]]:
        """The correlation farthest from 0, and the pair of unknowns that has it; 0 where none is known."""
        strength = np.nan_to_num(np.triu(self.correlation, 1))
        i, j = np.unravel_index(int(np.argmax(np.abs(strength))), strength.shape)
        return float(strength[i, j]), (int(i), int(j))


def certainty(
    jacobian: Array, unknowns: Sequence[Unknown], inflation: float = 1.0, widening: tuple[float, float] = (1.0, 1.0)
) -> Certainty:
    """Return the certainty of unknowns from the derivatives of all residuals by the varied numbers."""
    size = len(unknowns)
    norms = np.sqrt((jacobian**2).sum(axis=0))
    seen = np.array(
        [
            norm > 1.0 / UNSEEN if one.is_log else norm > FAINT * norms.max()
            for one, norm in zip(unknowns, norms, strict=True)
        ],
        dtype=bool,
    )
    covariance = np.full((size, size), np.nan)
    dead = np.zeros((0, size))
    if seen.any():
        scaled = jacobian[:, seen] / norms[seen]
        _, singular, directions = np.linalg.svd(scaled, full_matrices=False)
        flat = singular**2 < DEAD * singular[0] ** 2
        kept = directions[~flat] / singular[~flat, None]
        inner = kept.T @ kept / np.outer(norms[seen], norms[seen])
        unknown = directions[flat] / norms[seen]  # in units of the varied numbers
        touched = np.zeros(int(seen.sum()), bool)
        for row in unknown:
            touched |= np.abs(row) > SMALL_POWER * np.abs(row).max()
        inner[touched] = np.nan
        inner[:, touched] = np.nan
        inner[touched, touched] = np.inf
        covariance[np.ix_(seen, seen)] = inner
        dead = np.zeros((int(flat.sum()), size))
        dead[:, seen] = unknown
    return Certainty(seen, inflation * covariance, dead, inflation, widening)


def known_products(dead: Array, unknowns: Sequence[Unknown]) -> list[str]:
    """Return the products of powers that the data constrain, where dead directions leave only these.

    A product of powers w is known if it does not change along any dead direction: w is normal to all of them.
    """
    if not len(dead):
        return []
    among = np.flatnonzero((np.abs(dead) > SMALL_POWER * np.abs(dead).max(axis=1, keepdims=True)).any(axis=0)).tolist()
    geometry = [i for i in among if unknowns[i].name.endswith(PIVOTS)]
    first = (geometry or among)[0]
    rest = [i for i in among if i != first]
    out = []
    for other in rest:  # each with the first one: E sqrt(R), H R, ...
        ratio = -dead[0, other] / dead[0, first]
        near = round(ratio / QUARTER) * QUARTER
        power = near if abs(ratio - near) < NEAR_QUARTER else ratio
        out.append(f"{unknowns[other].name} * {unknowns[first].name}^{power:g}")
    return out


def passed_on(jacobian: Array, certain: Certainty, beside: Array, errors: Array) -> Array:
    """Return the errors that known errors of fixed parameters leave in the unknowns, (unknowns,).

    Parameters
    ----------
    jacobian, certain
        At the minimum.
    beside
        Derivatives of the residuals by the varied numbers of the fixed parameters, (residuals, parameters).
    errors
        Their standard deviations.
    """
    shift = np.nan_to_num(certain.covariance, posinf=0.0) @ jacobian.T @ beside
    return np.asarray(np.sqrt(((shift * errors) ** 2).sum(axis=1)))
