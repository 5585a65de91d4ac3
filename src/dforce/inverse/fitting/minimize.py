"""The sum of squares, and its minimum near a start: least squares of SciPy on exact derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import DForceError
from dforce.inverse.fitting.model import CurveModel, Prediction
from dforce.inverse.fitting.unknowns import limits

OUTSIDE = 1e3  # standard deviations at each point, where there is no problem at all
EXACT, ROUGH = 1e-11, 1e-3  # relative changes of chi2 at which a minimum is found
SHORT = 1e-8  # the same of steps: shorter ones wander over the small edges of the sampled map
MOST = 60  # evaluations for one minimum


@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum, or the lowest place that was met, or a place to start from.

    Attributes
    ----------
    varied, chi2
        Where, and how low.
    prediction
        Of the model there; None where there is no problem, and of starts.
    """

    varied: Array
    chi2: float
    prediction: Prediction | None = None

    @property
    def lost(self) -> int:
        """How many points have no state there."""
        return 0 if self.prediction is None else int(self.prediction.lost.sum())

    @property
    def predicted(self) -> Prediction:
        """The prediction, where there is a problem: at each minimum that is kept."""
        assert self.prediction is not None
        return self.prediction


class Objective:
    """The sum of squares of a model over a part of the unknowns; the others stay.

    Attributes
    ----------
    best
        The lowest place that was met, also where the search was stopped.
    """

    def __init__(
        self,
        model: CurveModel,
        varied: Array,
        free: Sequence[int] | None = None,
        on_run: Callable[[Objective], None] | None = None,
    ) -> None:
        self.model, self.start = model, varied.copy()
        self.free = list(range(len(varied))) if free is None else list(free)
        self.on_run = on_run or (lambda objective: None)
        self.runs = 0
        self.best = Minimum(varied.copy(), math.inf)
        self._last: tuple[bytes, Prediction | None] = (b"", None)

    def whole(self, free: Array) -> Array:
        """Return all that is varied."""
        out = self.start.copy()
        out[self.free] = free
        return out

    def predict(self, varied: Array) -> Prediction | None:
        """Return the prediction of the model, the last one from memory."""
        key = varied.tobytes()
        if self._last[0] != key:
            self.runs += 1
            try:
                found = self.model.predict(varied)
            except DForceError:  # the values are not allowed together: no step leads there
                found = None
            self._last = key, found
        return self._last[1]

    def residuals(self, free: Array) -> Array:
        """Return all residuals in standard deviations: of the points, then of the priors."""
        varied = self.whole(free)
        predicted = self.predict(varied)
        if predicted is None:
            return np.concatenate([np.full(self.model.measured.size, OUTSIDE), self.model.priors(varied)])
        out = self.model.all_residuals(varied, predicted)
        chi2 = float(out @ out)
        if chi2 < self.best.chi2:
            self.best = Minimum(varied, chi2, predicted)
        self.on_run(self)
        return out

    def jacobian(self, free: Array) -> Array:
        """Return the derivatives of the residuals by the varied numbers."""
        varied = self.whole(free)
        predicted = self.predict(varied)
        if predicted is None:
            return np.zeros((len(self.residuals(free)), len(self.free)))
        return jacobian(self.model, varied, predicted, both_sides=False)[:, self.free]

    def minimize(self, tolerance: float = EXACT, most: int = MOST) -> Minimum:
        """Return the minimum near the start; Ctrl-C is passed on, with the lowest point so far in `best`."""
        from scipy.optimize import least_squares

        low, high = limits(self.model.unknowns)
        low, high = low[self.free], high[self.free]
        start = np.clip(self.start[self.free], low, high)
        # scipy wants to start within its bounds, not on them
        inside = np.where(np.isfinite(high - low), 1e-6 * (high - low), 1e-9)
        start = np.minimum(np.maximum(start, low + inside), high - inside)
        least_squares(
            self.residuals,
            start,
            self.jacobian,
            bounds=(low, high),
            x_scale="jac",
            method="trf",
            ftol=tolerance,
            xtol=max(tolerance, SHORT),
            gtol=1e-12,
            max_nfev=most,
        )
        return self.best


def jacobian(model: CurveModel, varied: Array, predicted: Prediction, both_sides: bool = True) -> Array:
    """Return the derivatives of residuals, then priors, by the varied numbers; see :meth:`CurveModel.slopes`."""
    slopes = model.slopes(varied, predicted, both_sides) / model.sigma[..., None]
    known = [i for i, one in enumerate(model.unknowns) if one.prior is not None]
    each = zip(model.unknowns, model.values(varied), strict=True)
    of_priors = np.diag([one.slope(float(value)) / one.prior[1] if one.prior else 0.0 for one, value in each])[known]
    return np.concatenate([slopes.reshape(-1, len(varied)), of_priors])
