"""`df.fit` and `df.fit_again`: parameters of a case from a measured curve."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import numpy as np

from dforce.case import Case, Fit
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, checked, shorten
from dforce.core.stopping import heard, late_stop_waits
from dforce.findings.fits import POOR
from dforce.inverse.fitting.bootstrap import Bootstrap, bootstrap
from dforce.inverse.fitting.certainty import Certainty, certainty, passed_on
from dforce.inverse.fitting.fitted import Fitted, degrees_of_freedom
from dforce.inverse.fitting.folds import lowest
from dforce.inverse.fitting.independence import inflation
from dforce.inverse.fitting.load import measured_curve
from dforce.inverse.fitting.minimize import Minimum, Objective, jacobian
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.points import MeasuredPoints
from dforce.inverse.fitting.profile import Profile, profile_of
from dforce.inverse.fitting.report import check_fit
from dforce.inverse.fitting.result import data_of, to_dataset
from dforce.inverse.fitting.selection import checked_reading, measured
from dforce.inverse.fitting.sides import Sides, not_excluded, plain_sides, sides_of
from dforce.inverse.fitting.starts import different, first_guess, is_shallow, refined, searched
from dforce.inverse.fitting.unknowns import (
    CASE,
    HEIGHT,
    Unknown,
    given_values,
    make_unknowns,
    start_vector,
    usual_nuisance,
    with_free_part,
)
from dforce.inverse.fitting.viscosity import MissingViscosity, missing_viscosity
from dforce.runs import watched

if TYPE_CHECKING:
    import xarray as xr

    from dforce.experiments.base import Progress

NUMBERS_EACH = 5  # measured numbers that each unknown needs, at least
TOO_COARSE = 0.1  # standard deviations that more samples may change the curve by
MOST_LOWER = 4  # minima that are met on the way to the ends of intervals
FINEST = 4  # times the samples of the case
USUAL_RUNS = 60  # of the model in a fit: the scale of the progress bar


class FitSettings(TypedDict, total=False):
    """Settings of a fit, as under `[fit]`."""

    nuisance: Sequence[str] | None
    priors: Mapping[str, object] | None
    bounds: Mapping[str, object] | None
    start: Mapping[str, object] | None
    given: Mapping[str, object] | None
    errors: Mapping[str, object] | None
    branch: Literal["measured", "attractive", "repulsive"] | None
    margin: int | None
    search: bool | None
    profile: Sequence[str] | None
    bootstrap: int | None


@checked
def fit(
    case: Case,
    data: xr.Dataset | str | os.PathLike[str] | None = None,
    free: Sequence[str] | None = None,
    progress: Progress | bool | None = None,
    **settings: Unpack[FitSettings],
) -> xr.Dataset:
    r"""Return parameters of a case, with errors, from a measured curve of amplitude and phase.

    The fit minimizes :math:`\chi^2 = \sum (A_\mathrm{model} - A)^2 / \sigma_A^2 + \sum (\phi_\mathrm{model} - \phi)^2 /
    \sigma_\phi^2` over all points and tones, plus :math:`(p - p_0)^2 / s^2` for each prior. The model is the case itself, with
    its drive and detector. Each branch is followed slowly, in the direction of the measurement and never across a jump. The
    place of a jump is not used.

    Parameters
    ----------
    case
        Instrument, sample and forces, at the start of the fit; its table `[fit]` has the defaults of all settings.
    data
        A file, read and calibrated with the table `[data]` of the case; default: the file in this table. Or a curve over
        `point`, the result of :func:`dforce.calibrate`, with `height` (m, larger is farther), `amplitude` (m) and `phase`
        (degrees of lag, 90 when free at resonance). Optional are `amplitude_2` and `phase_2`, `direction` and `branch` (1
        before, -1 behind a jump). Its attributes are `amplitude_error` (m), `phase_error` (degrees), and optional
        `height_error` (m), `neighbor_correlation` and `noise_points` (number of points that the noise was measured in).
    free
        Paths of the parameters to fit, such as ``["sample.youngs_modulus"]``.
    progress
        See :func:`dforce.run`.
    settings
        Other keys of the table `[fit]`: `nuisance`, `priors`, `bounds`, `start`, `given`, `errors`, `branch`, `margin`,
        `search`, `profile`, `bootstrap`.

    Returns
    -------
    xarray.Dataset
        Over `parameter`, in the SI unit `unit`: `value`, `error`, `error_low`, `error_high` (one standard deviation),
        `interval_low`, `interval_high` (95 %), `error_given` (from `given`), `start`, `prior`, `prior_error`, `at_bound`,
        `seen`; `correlation`; over `point` the data, the model and the residuals in standard deviations. The attributes
        contain `chi2`, `degrees_of_freedom`, `aic`, `bic`, `lost_points`, advice, the best case (`case`) and the settings to
        repeat the fit. A fit whose model is far from the data has no errors. A stopped fit contains the best values so far,
        and ``attrs["interrupted"]`` is 1; without a minimum it has no errors.

    Raises
    ------
    ParameterError
        For unknown parameters and settings, parameters without effect in the case, parameters with only their product
        constrained, too many parameters for the data, incomplete data, and a lock.
    ResultError
        For a file that cannot be read.
    """
    asked = settings_of(case, free, settings)
    data = measured_curve(case, data)
    with late_stop_waits() as stop, watched(progress, case.title) as report_progress:
        found = fitted(case, data, asked, report_progress)
        report_progress(USUAL_RUNS, USUAL_RUNS, "")
    found.interrupted |= stop.is_heard
    return to_dataset(found, data)


@checked
def fit_again(result: xr.Dataset, progress: Progress | bool | None = None) -> xr.Dataset:
    """Repeat a fit from its own result, with the same case, settings and data.

    Parameters
    ----------
    result
        The result of :func:`fit`.
    progress
        See :func:`dforce.run`.

    Raises
    ------
    ParameterError
        When the result is not a fit, or is from an incompatible version of dForce.
    """
    check_fit(result)
    text = result.attrs.get("start_case")
    if not isinstance(text, str):
        raise ParameterError("the result does not contain the settings of its fit")
    return fit(Case.from_toml(text), data_of(result), progress=progress)


def settings_of(case: Case, free: Sequence[str] | None, settings: Mapping[str, object]) -> Fit:
    """Return the settings of a fit: the arguments, else the case's settings."""
    given = {key: value for key, value in settings.items() if value is not None}
    if free is not None:
        given["free"] = tuple(free)
    return Fit(**given) if case.fit is None else case.fit.replace(**given)


def fitted(case: Case, data: xr.Dataset, settings: Fit, report_progress: Progress) -> Fitted:
    """Return the result of a fit."""
    use = case.data.use if case.data is not None else {}
    reading = checked_reading(
        settings.branch, settings.margin, settings.errors, use.get("height"), str(use.get("direction", ""))
    )
    read = measured(data, reading)
    case.problem.refuse_lock("a fit")
    if read.tones > len(case.problem.tones):
        raise ParameterError(f"the curve has tone {read.tones}, but the case has only {len(case.problem.tones)} tone")
    nuisance, priors = usual_nuisance(case, settings, read), dict(settings.priors)
    unknowns = make_unknowns(case, read.tones, settings.free, nuisance, priors, settings.bounds, settings.start)
    unknowns = with_free_part(unknowns, read, set(settings.priors))
    if len(unknowns) * NUMBERS_EACH > read.count:
        raise ParameterError(
            f"{len(unknowns)} unknowns are too many for {read.count} measured numbers; each needs {NUMBERS_EACH}"
        )
    names = [one.name for one in unknowns]
    for one in given_values(case, read.tones, settings.given, names):
        if one.kind == CASE and one.prior:
            case = case.replace(one.path, one.prior[0])
    for name in settings.profile:
        if name not in names:
            raise ParameterError(f"profile has '{shorten(name)}', but the fit does not vary it")
    return _FitRun(case, settings, read, unknowns, report_progress).run()


class _FitRun:
    """The way of a fit from its starts to its errors; a stopped fit keeps its results so far."""

    def __init__(
        self, case: Case, settings: Fit, data: MeasuredPoints, unknowns: list[Unknown], report_progress: Progress
    ) -> None:
        self.settings, self.report_progress = settings, report_progress
        self.runs, self.chi2 = 0, np.inf
        self.starts: list[Minimum] = []
        self.minima: list[Minimum] = []
        self.model = CurveModel(case, unknowns, data, check_cancelled=self.check_cancelled)
        self.case, self.data, self.unknowns = case, data, self.model.unknowns
        self.met: Minimum | None = None
        self.redrawn: Bootstrap | None = None
        self._by: tuple[Minimum | None, Array] = None, np.empty(0)

    def check_cancelled(self) -> None:
        note = f"chi2 {self.chi2:.6g}" if np.isfinite(self.chi2) else "looking for starts"
        self.report_progress(min(self.runs, USUAL_RUNS - 1), USUAL_RUNS, note)

    def on_run(self, objective: Objective) -> None:
        best = objective.best
        self.runs, self.chi2 = self.runs + 1, min(self.chi2, best.chi2)
        if objective.model is self.model and (self.met is None or best.chi2 < self.met.chi2):
            self.met = best
        self.check_cancelled()

    def run(self) -> Fitted:
        """Run the fit and return its result."""
        interrupted, coarse = False, np.nan
        profiles: dict[str, Profile] = {}
        sides: Sides | None = None
        missing: MissingViscosity | None = None
        try:
            self._find()
            coarse = self._enough_samples()
            if not self._is_poor():
                sides = self._sides()
                missing = self._missing_viscosity()
                profiles = self._profiles()
                self._bootstrap()
        except KeyboardInterrupt:
            heard()
            interrupted = True
        passed = np.zeros(len(self.unknowns))
        if not self.minima:  # it was stopped before a minimum, and derivatives yield errors only at a minimum
            self.minima = [self._lowest()]
            certain = Certainty.unknown(len(self.unknowns))
        else:
            certain = self._certainty()
            passed = self._passed_on(certain) if self.settings.given else passed
            if self._is_poor():
                certain, sides = certain.without_errors, None
        return Fitted(
            settings=self.settings,
            model=self.model,
            minima=self.minima,
            starts=self.starts,
            certain=certain,
            sides=sides or plain_sides(certain),
            passed=passed,
            profiles=profiles,
            bootstrap=self.redrawn,
            missing=missing,
            coarse=coarse,
            runs=self.runs,
            interrupted=interrupted,
        )

    def _lowest(self) -> Minimum:
        """Return the lowest place that was met on all points."""
        start = self.starts[0].varied if self.starts else self._first_guesses()[0]
        objective = Objective(self.model, start)
        objective.residuals(start)
        met = self.met
        return met if met is not None and met.chi2 < objective.best.chi2 else objective.best

    def _first_guesses(self) -> list[Array]:
        """Return the first guess, with the user's offset of the heights where the data prefer it: soft samples yield.

        If the amplitude hardly falls, only refined fits show which offset the data prefer: both are returned.
        """
        guess = first_guess(self.data, self.unknowns, set(self.settings.start), self.model.case.problem.tip_share)
        own = np.where([one.kind == HEIGHT for one in self.unknowns], start_vector(self.unknowns), guess)
        if (own == guess).all():
            return [guess]
        if is_shallow(self.data) and self.settings.search:
            return [guess, own]
        places = [Objective(self.model, varied) for varied in (guess, own)]
        for place in places:
            place.residuals(place.start)
        return [min(places, key=lambda place: place.best.chi2).start]

    def _find(self) -> None:
        guesses = self._first_guesses()
        self.check_cancelled()
        found = [searched(self.model, one) if self.settings.search else [Minimum(one, np.nan)] for one in guesses]
        self.starts = sorted((start for starts in found for start in starts), key=lambda start: start.chi2)
        self.minima = refined(self.model, self.starts, self.on_run)
        self._leave_unseen()

    def _leave_unseen(self) -> None:
        """Put parameters that the data do not see back to where they started, and minimize over the others once more."""
        best = self.minima[0]
        if best.prediction is None:
            raise ParameterError("no value of the fit is valid in the case; check its bounds and start")
        certain = certainty(self._derivatives(), self.unknowns)
        if certain.seen.all():
            return
        back = best.varied.copy()
        for i in np.flatnonzero(~certain.seen):
            back[i] = self.unknowns[i].varied(self.unknowns[i].start)
        others = np.flatnonzero(certain.seen).tolist()
        again = Objective(self.model, back, others, self.on_run).minimize() if others else best
        if again.chi2 < best.chi2 - 1.0:  # the data may see all of them there
            self.minima[0] = lowest(Objective(self.model, again.varied, on_run=self.on_run))
            self._leave_unseen()
        elif again.chi2 < best.chi2 + 1.0:
            self.minima[0] = again

    def _enough_samples(self) -> float:
        """Take more samples per period while they would change the curve; return by how much they still do, in sigma."""
        while True:
            best, finer = self.minima[0], 2 * self.model.finer
            fine = CurveModel(self.case, self.unknowns, self.data, finer, check_cancelled=self.check_cancelled)
            there = fine.predict(best.varied)
            both = ~(there.lost | best.predicted.lost)
            apart = (fine.residuals(there) - self.model.residuals(best.predicted))[both]
            change = float(np.abs(apart).max(initial=0.0))
            if change < TOO_COARSE or finer > FINEST or self.case.solver.accuracy is None:
                return change
            self.model = fine
            self.minima = [lowest(Objective(fine, best.varied, on_run=self.on_run)), *self.minima[1:]]

    def _profiles(self) -> dict[str, Profile]:
        certain = self._certainty()
        return {
            name: profile_of(self.model, self.minima[0], index, certain, self.on_run)
            for index, name in enumerate(one.name for one in self.unknowns)
            if name in self.settings.profile and certain.seen[index]
        }

    def _bootstrap(self) -> None:
        count = self.settings.bootstrap
        if not count:
            return

        def done(so_far: Bootstrap) -> None:
            self.redrawn = so_far
            self.report_progress(USUAL_RUNS - 1, USUAL_RUNS, f"redrawn residuals, {len(so_far.varied)} of {count}")

        seen = np.flatnonzero(self._certainty().seen).tolist()
        bootstrap(self.model, self.minima[0], seen, count, done)

    def _sides(self) -> Sides | None:
        """Return how far the unknowns may be off, over all minima; where that leads to a lower minimum, it is taken."""
        for _ in range(MOST_LOWER):
            found = self._sides_of_all()
            if isinstance(found, Sides):
                return found
            seen = np.flatnonzero(self._certainty().seen).tolist()
            met = lowest(Objective(self.model, found.varied, seen, self.on_run))
            self.minima = different([met, *self.minima], self.model)
        return None

    def _sides_of_all(self) -> Sides | Minimum:
        """Return the sides of the best minimum, and of all others that the data do not exclude, or a lower minimum."""
        best, out = self.minima[0], None
        for one in not_excluded(self.minima, self._certainty()):
            by = self._derivatives() if one is best else jacobian(self.model, one.varied, one.predicted)
            certain = self._certainty(by)
            sides = sides_of(self.model, one, by, certain, best.chi2, self.on_run)
            if isinstance(sides, Minimum):
                return sides
            out = sides if out is None else out.joined(sides, one.varied - best.varied)
        assert out is not None
        return out

    def _derivatives(self) -> Array:
        """Return the derivatives of all residuals at the best, from memory while it stays."""
        best = self.minima[0]
        if self._by[0] is not best:
            self._by = best, jacobian(self.model, best.varied, best.predicted)
        return self._by[1]

    def _certainty(self, by: Array | None = None) -> Certainty:
        """Return how well the unknowns are known, by derivatives at the best or elsewhere; the residuals are of the best."""
        by = self._derivatives() if by is None else by
        larger = inflation(self.model, self.minima[0].predicted)
        return certainty(by, self.unknowns, larger, self.data.widening)

    def _missing_viscosity(self) -> MissingViscosity | None:
        return missing_viscosity(self.model, self.minima[0], self._derivatives(), self._certainty().inflation)

    def _is_poor(self) -> bool:
        """Return whether the model is so far from the data that its values have no errors, and no ends of intervals."""
        return self.minima[0].chi2 > POOR * degrees_of_freedom(self.model, self._certainty())

    def _passed_on(self, certain: Certainty) -> Array:
        """Return the errors passed on from fixed parameters."""
        by, best = self._derivatives(), self.minima[0]
        fixed = given_values(self.case, self.data.tones, self.settings.given, ())
        both = CurveModel(self.case, [*fixed, *self.unknowns], self.data, self.model.finer)
        start = np.array([one.varied(one.prior[0]) for one in fixed if one.prior])
        here = np.concatenate([start, best.varied])
        slopes = both.slopes(here, best.predicted) / both.sigma[..., None]
        slopes = slopes.reshape(-1, len(here))[:, : len(fixed)]
        beside = np.zeros((len(by), len(fixed)))
        beside[: len(slopes)] = slopes
        errors = np.array([one.prior[1] / one.slope(one.prior[0]) for one in fixed if one.prior])
        return passed_on(by, certain, beside, errors)
