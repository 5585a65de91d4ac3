"""Advice on a fit: where its numbers mean less than they seem to."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from dforce.core import units
from dforce.findings.fits import AS_EXPECTED, POOR, TOO_LARGE, WHY, judged
from dforce.inverse.checks import doubts
from dforce.inverse.fitting.certainty import NOT_TOLD, TOGETHER, known_products
from dforce.inverse.fitting.independence import neighbors
from dforce.inverse.fitting.sides import not_excluded
from dforce.inverse.steps import FAR_FORCES, LEFT_OUT
from dforce.inverse.values import show
from dforce.solvers.stability import UNSTABLE, stability
from dforce.validity import Advice

if TYPE_CHECKING:
    from dforce.inverse.fitting.fitted import Fitted
    from dforce.inverse.fitting.minimize import Minimum

NEAR_EQUAL = 9.0  # of chi2: a second minimum so near is not excluded by the data
COARSE = 0.3  # standard deviations
OUTLIER, NEAR, FEW = (
    7.0,
    4.0,
    0.05,
)  # standard deviations of an outlier and of its neighbors, and its share of the points
VISCOUS = 3.0  # standard deviations of a viscosity that a model lacks
SCORE = "C. R. Rao, Proc. Camb. Philos. Soc. 44, 50 (1948)"
STATISTICS = "W. H. Press et al., Numerical Recipes, chapter 15"
SPEC = "numbers of this fit"


def advice_on(found: Fitted, independence: float) -> list[Advice]:
    """Return the advice on a fit, with the probability that its residuals are noise; of a stopped one without its minimum."""
    if found.interrupted and bool(np.isnan(found.certain.covariance).all()):
        return list(_doubts(found))
    pieces = (_viscosity, _unstable, _minima, _bounds, _unseen, _products, _untold, _together, _sampling)
    every = [
        _doubts(found),
        _lost(found),
        _outliers(found),
        _chi2(found, independence),
        *(piece(found) for piece in pieces),
    ]
    return list(chain.from_iterable(every))


def _doubts(found: Fitted) -> Iterator[Advice]:
    # the model has the forces that reach far, the offset is fitted, and spikes are left out
    told = [text for text in doubts(found.model.data.attrs) if not text.endswith((FAR_FORCES, LEFT_OUT))]
    if told:
        text = f"doubts about the measured curve: {'; '.join(told)}."
        yield Advice("doubted_data", float(len(told)), 0.0, text, SPEC, ())


def _lost(found: Fitted) -> Iterator[Advice]:
    if lost := found.best.lost:
        text = (
            f"the best fit has no such state at {lost} of {int(found.model.data.used.sum())} points, so the fit failed there. "
            "Values and errors are biased. Leave out more points beside the jump (margin), or check the model."
        )
        yield Advice("lost_points", float(lost), 0.0, text, SPEC, ("fit.margin",))


def _unstable(found: Fitted) -> Iterator[Advice]:
    known = found.best.predicted.solved.monodromy[0]
    count = sum(stability(one) == UNSTABLE for one in known[np.isfinite(known).all(axis=(1, 2))])
    if count:
        text = (
            f"the motion of the best fit doubles its period, or becomes a torus, at {count} of "
            f"{int(found.model.data.used.sum())} points. The fit takes the orbit at the center of this motion."
        )
        yield Advice("unstable_points", float(count), 0.0, text, SPEC, ())


def _outliers(found: Fitted) -> Iterator[Advice]:
    model, data, predicted = found.model, found.model.data, found.best.predicted
    every = np.where(predicted.lost[:, None], 0.0, model.residuals(predicted) ** 2)
    rest = np.sqrt(every.max(axis=1))
    ways = np.zeros(len(data.height)) if data.direction is None else data.direction
    out = []
    for row in neighbors(data.branch[model.points], ways[model.points], data.height[model.points]):
        beside = np.pad(rest[row], 1)
        out += row[(rest[row] > OUTLIER) & (np.maximum(beside[:-2], beside[2:]) < NEAR)].tolist()
    others = judged(found.best.chi2 - float(every[out].sum()), found.degrees_of_freedom, data.noise_points)
    if 0 < len(out) < FEW * len(rest) and others.word != TOO_LARGE and others.reduced < POOR:
        told = ", ".join(units.show(float(height), "m", 5) for height in data.height[model.points[out]])
        text = (
            f"far off the best fit, which describes all others: points at heights {told}. Remove them, and fit again."
        )
        yield Advice("outliers", float(rest[out].max()), OUTLIER, text, SPEC, ())


def _chi2(found: Fitted, independence: float) -> Iterator[Advice]:
    chi2 = judged(found.best.chi2, found.degrees_of_freedom, found.model.data.noise_points, independence)
    if chi2.word != AS_EXPECTED:
        text = f"chi2 is {chi2.reduced:.3g} for each degree of freedom: {WHY[chi2.word]}."
        yield Advice("reduced_chi2", chi2.reduced, chi2.limit, text, STATISTICS, ())


def _viscosity(found: Fitted) -> Iterator[Advice]:
    if found.missing is not None and found.missing.deviation > VISCOUS:
        text = (
            "the model dissipates no energy in contact, but the residuals show a viscosity of "
            f"{show(found.missing.value, found.missing.error, 'Pa s')}. The other values may be wrong by more than their "
            "errors. Add the force kelvin_voigt, and fit its viscosity, too."
        )
        yield Advice("missing_viscosity", found.missing.deviation, VISCOUS, text, SCORE, ("forces",))


def _minima(found: Fitted) -> Iterator[Advice]:
    others = [one for one in found.minima[1:] if one.chi2 - found.best.chi2 < NEAR_EQUAL and not one.lost]
    if not others:
        return
    told = "; ".join(f"chi2 {one.chi2:.1f} at {_place(found, one)}" for one in others)
    inside = len(not_excluded(found.minima, found.certain)) - 1
    joined = {
        0: "The intervals of 95 % do not cover these values, but they are excluded by less than 3 standard deviations",
        len(others): "The data do not distinguish them, and the intervals of 95 % cover all",
    }.get(inside, f"The data do not distinguish the lowest {inside + 1}, and the intervals of 95 % cover their values")
    text = f"chi2 has more than one minimum: {found.best.chi2:.1f} at the values of this fit, and {told}. {joined}."
    names = tuple(
        one.name
        for i, one in enumerate(found.model.unknowns)
        if any(abs(other.varied[i] - found.best.varied[i]) > found.certain.errors[i] for other in others)
    )
    yield Advice("second_minimum", others[0].chi2 - found.best.chi2, NEAR_EQUAL, text, STATISTICS, names)


def _place(found: Fitted, one: Minimum) -> str:
    """Return the values of the fitted parameters at a minimum as text."""
    values = zip(found.model.unknowns, found.model.values(one.varied), strict=True)
    return ", ".join(
        f"{each.name} = {units.show(float(value), each.unit, 3)}"
        for each, value in values
        if each.name in found.settings.free
    )


def _bounds(found: Fitted) -> Iterator[Advice]:
    names = [one.name for one, is_near in zip(found.model.unknowns, found.at_bound, strict=True) if is_near]
    if names:
        said = f"{', '.join(names)} lies at a bound of its range."
        text = f"{said} Its error is meaningless: the best value is beyond the bound."
        yield Advice("at_bound", float(len(names)), 0.0, text, SPEC, tuple(names))


def _unseen(found: Fitted) -> Iterator[Advice]:
    names = found.unseen
    if names and found.best.chi2 <= POOR * found.degrees_of_freedom:  # else no value means anything
        values = zip(found.model.unknowns, found.model.values(found.best.varied), strict=True)
        held = ", ".join(f"{one.name} = {units.show(float(v), one.unit, 4)}" for one, v in values if one.name in names)
        text = (
            f"not constrained by these data: {', '.join(names)}. The value is meaningless and has no error. The other values "
            f"and errors are valid for {held} only. dforce fit --identify finds a measurement that constrains it."
        )
        yield Advice("not_seen", float(len(names)), 0.0, text, SPEC, tuple(names))


def _products(found: Fitted) -> Iterator[Advice]:
    if products := known_products(found.certain.dead, found.model.unknowns):
        text = f"the data constrain only products: {', '.join(products)}. Remove one of the parameters, or add a prior."
        yield Advice("only_products", float(len(products)), 0.0, text, SPEC, ())


def _untold(found: Fitted) -> Iterator[Advice]:
    errors = found.certain.errors
    names = [
        one.name
        for one, error in zip(found.model.unknowns, errors, strict=True)
        if one.is_log and math.isfinite(error) and error > NOT_TOLD
    ]
    if names:
        worst = float(max(error for error in errors if math.isfinite(error)))
        text = f"not constrained by this curve, with an error above 50 %: {', '.join(names)}."
        yield Advice("not_told", worst, NOT_TOLD, text, SPEC, tuple(names))


def _together(found: Fitted) -> Iterator[Advice]:
    worst, pair = found.certain.closest
    if abs(worst) >= TOGETHER:
        names = tuple(found.model.unknowns[i].name for i in pair)
        text = f"{' and '.join(names)} are constrained only together: their correlation is {abs(worst):.4f}."
        yield Advice("only_together", abs(worst), TOGETHER, text, SPEC, names)


def _sampling(found: Fitted) -> Iterator[Advice]:
    if found.coarse > COARSE:
        text = (
            f"twice as many samples a period change the curve by up to {found.coarse:.2g} standard deviations. "
            "Raise solver.points_per_period."
        )
        yield Advice("sampling", found.coarse, COARSE, text, SPEC, ("solver.points_per_period",))
