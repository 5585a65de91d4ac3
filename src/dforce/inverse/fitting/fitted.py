"""The result of a fit, before it is written as a Dataset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dforce.case import Fit
from dforce.core.arrays import Array, Bools
from dforce.inverse.fitting.bootstrap import Bootstrap
from dforce.inverse.fitting.certainty import Certainty
from dforce.inverse.fitting.minimize import Minimum
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.profile import Profile
from dforce.inverse.fitting.sides import Sides
from dforce.inverse.fitting.unknowns import limits
from dforce.inverse.fitting.viscosity import MissingViscosity

AT_BOUND = 1e-3  # of the varied number: a value nearer to a bound lies at it


@dataclass
class Fitted:
    """The result of a fit.

    Attributes
    ----------
    settings, model
        The settings, and the model of case and data.
    minima, starts
        The minima, the lowest first; the starts of the searches, with their chi2.
    certain, sides
        The certainty of the unknowns: near the best, and to both sides of it.
    passed
        Errors passed on from fixed parameters, (unknowns,).
    profiles
        Profiles by the name of the unknown.
    bootstrap
        Fits to redrawn residuals, if requested.
    missing
        The viscosity that the residuals ask for, if it was looked for.
    coarse, runs
        Change of the curve by more samples, in standard deviations; evaluations of the model.
    interrupted
        Whether it was stopped.
    """

    settings: Fit
    model: CurveModel
    minima: list[Minimum]
    starts: list[Minimum]
    certain: Certainty
    sides: Sides
    passed: Array
    profiles: dict[str, Profile]
    bootstrap: Bootstrap | None
    missing: MissingViscosity | None
    coarse: float
    runs: int
    interrupted: bool

    @property
    def best(self) -> Minimum:
        """The lowest minimum."""
        return self.minima[0]

    @property
    def at_bound(self) -> Bools:
        """Which unknowns lie at a bound of their range."""
        away = [np.abs(self.best.varied - edge) for edge in limits(self.model.unknowns)]
        return np.asarray(np.min(away, axis=0) < AT_BOUND)

    @property
    def unseen(self) -> list[str]:
        """The parameters that the data do not see."""
        return [one.name for one, seen in zip(self.model.unknowns, self.certain.seen, strict=True) if not seen]

    @property
    def degrees_of_freedom(self) -> int:
        """Numbers measured and priors, less the parameters."""
        return degrees_of_freedom(self.model, self.certain)


def degrees_of_freedom(model: CurveModel, certain: Certainty) -> int:
    """Return the numbers measured and priors, less the parameters that the data see."""
    return model.data.count + sum(one.prior is not None for one in model.unknowns) - int(certain.seen.sum())
