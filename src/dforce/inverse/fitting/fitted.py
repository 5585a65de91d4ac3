"""The result of a fit, before it is written as a Dataset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from dforce.case import Case, Fit
from dforce.core.arrays import Array
from dforce.inverse.fitting.bootstrap import Bootstrap
from dforce.inverse.fitting.certainty import Certainty
from dforce.inverse.fitting.minimize import Minimum
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.points import MeasuredPoints
from dforce.inverse.fitting.profile import Profile
from dforce.inverse.fitting.sides import Sides
from dforce.inverse.fitting.starts import SearchStart
from dforce.inverse.fitting.unknowns import Unknown


@dataclass
class Fitted:
    """The result of a fit.

    Attributes
    ----------
    case, settings, data, unknowns
        What was asked.
    minima, starts
        The minima, the lowest first; where the searches began, and how low chi2 was there.
    certain, sides
        How well the unknowns are known: near the best, and to both sides of it.
    passed
        Errors passed on from fixed parameters, (unknowns,).
    profiles
        By the name of the unknown.
    bootstrap
        Fits to redrawn residuals, where they were asked for.
    model
        With which it was found.
    interrupted
        Whether it was stopped.
    """

    case: Case
    settings: Fit
    data: MeasuredPoints
    unknowns: list[Unknown]
    minima: list[Minimum]
    starts: list[SearchStart]
    certain: Certainty
    sides: Sides
    passed: Array
    profiles: dict[str, Profile]
    bootstrap: Bootstrap | None
    model: CurveModel
    coarse: float
    runs: int
    interrupted: bool = False
    unseen: list[str] = field(default_factory=list)

    @property
    def best(self) -> Minimum:
        """The lowest minimum."""
        return self.minima[0]

    @property
    def count(self) -> int:
        """How many parameters the data see."""
        return len(self.unknowns) - len(self.unseen)

    @property
    def degrees_of_freedom(self) -> int:
        """Numbers measured and priors, less the parameters."""
        return degrees_of_freedom(self.data, self.unknowns, self.count)


def degrees_of_freedom(data: MeasuredPoints, unknowns: Sequence[Unknown], seen: int) -> int:
    """Return the numbers measured and priors, less the parameters that the data see."""
    return data.count + sum(one.prior is not None for one in unknowns) - seen
