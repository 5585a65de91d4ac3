"""The contact viscosity that a model without dissipation lacks, from the residuals of its fit: a score test.

Source: C. R. Rao, Proc. Camb. Philos. Soc. 44, 50 (1948).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.forces import KelvinVoigt
from dforce.inverse.fitting.minimize import Minimum
from dforce.inverse.fitting.model import CurveModel, allowed

PROBE = 1e-2  # of the elastic force of a contact: its drag, for the derivative
FELT = 1e-4  # standard deviations: a smaller change of the curve by this drag is no contact


class MissingViscosity(NamedTuple):
    """The viscosity (Pa s) that residuals ask for, in :class:`~dforce.forces.KelvinVoigt`, with its standard deviation."""

    value: float
    error: float

    @property
    def deviation(self) -> float:
        """How far it is from 0, in standard deviations."""
        return self.value / self.error


def missing_viscosity(model: CurveModel, best: Minimum, by: Array, inflation: float) -> MissingViscosity | None:
    """Return the viscosity that the residuals of a fit ask for; None for a sample that dissipates, or without contact.

    Parameters
    ----------
    model, best
        The model of the fit, and its minimum.
    by
        Derivatives of all residuals by the unknowns.
    inflation
        Factor by which correlated noise raises covariances.
    """
    case = model.case
    if any(force.dissipative for force in case.forces) or case.sample.youngs_modulus is None:
        return None
    shapes = [shape for one in case.forces if (shape := getattr(one, "geometry", "")) in ("cone", "pyramid", "punch")]
    drag = KelvinVoigt(viscosity=0.0, geometry=shapes[0] if shapes else "sphere")
    still = CurveModel(case.replace(forces=[*case.forces, drag]), model.unknowns, model.data, model.finer)
    if not allowed(still, best.varied):  # such as a case without a tip
        return None
    problem = still.problem(still.values(best.varied))
    [modulus] = [one.needed("E_eff") for one in problem.forces if isinstance(one, KelvinVoigt)]
    viscosity = PROBE * modulus / (2.0 * math.pi * problem.tones[0].frequency)
    viscous = CurveModel(
        case.replace(forces=[*case.forces, drag.replace(viscosity=viscosity)]),
        model.unknowns,
        model.data,
        model.finer,
        check_cancelled=model.check_cancelled,
    )
    there = viscous.predict(best.varied)
    change = model.residuals(there) - model.residuals(best.predicted)
    change[there.lost | best.predicted.lost] = 0.0
    column, residuals = np.zeros(len(by)), model.all_residuals(best.varied, best.predicted)
    column[: change.size] = change.ravel()
    own = column - by @ np.linalg.lstsq(by, column, rcond=None)[0]  # as no unknown changes the curve
    information = float(own @ own)
    if math.sqrt(information) < FELT:
        return None
    return MissingViscosity(
        -viscosity * float(own @ residuals) / information, viscosity * math.sqrt(inflation / information)
    )
