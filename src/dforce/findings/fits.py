"""A fit in words: whether its model describes the data, and each parameter with its error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from dforce.findings.finding import Finding, with_error

if TYPE_CHECKING:
    import xarray as xr

MOST = 3.0  # times its standard deviation: how far reduced chi2 may be from 1
POOR = 10.0  # of chi2 for each degree of freedom: the values of a worse model mean nothing
BY_CHANCE = 1.35e-3  # probability of a deviation by three standard deviations to one side: less is no noise
AS_EXPECTED, TOO_LARGE, TOO_SMALL = "as expected", "too large", "too small"
DECEPTIVE, NO_MODEL = "deceptive", "far too large"
LOWER_BOUNDS = (
    "so the errors are lower bounds. Check residuals: another force, base excitation, a drift, a wrong sensitivity or "
    "phase offset"
)
WHY = {
    AS_EXPECTED: "the model describes the data within their noise",
    TOO_LARGE: f"the model does not describe the data within their noise, {LOWER_BOUNDS}",
    TOO_SMALL: "the noise is smaller than assumed. The errors are too large by the square root of chi2",
    DECEPTIVE: f"neighboring residuals are correlated. They are not noise, {LOWER_BOUNDS}",
    NO_MODEL: (
        "the model does not describe the data. Its values are not valid and have no errors. Check the forces, the lever, "
        "the sensitivity, and the signs of height and phase"
    ),
}
UNSEEN = "not constrained by these data"
VERDICTS = {
    TOO_LARGE: "The model does not describe the data within their noise: the errors are lower bounds.",
    DECEPTIVE: "The model does not describe the data: their residuals are systematic, and the errors are lower bounds.",
    NO_MODEL: "No answer: the model does not describe the data, so its values are not valid.",
}


class JudgedChi2(NamedTuple):
    """Reduced chi2, its limit on that side of 1, and one of the words of :data:`WHY`."""

    reduced: float
    limit: float
    word: str


def judged(chi2: float, freedom: float, noise_points: float = math.inf, independence: float = 1.0) -> JudgedChi2:
    r"""Return the judgment on chi2 of a fit.

    Reduced chi2 scatters by :math:`\sqrt{2/n}` for n degrees of freedom, and by as much for the noise found in m points.
    With few of these it shows little, but neighboring residuals show whether they are noise.

    Parameters
    ----------
    chi2, freedom
        Sum of squares and degrees of freedom.
    noise_points
        Number of points that the noise was found in.
    independence
        Probability of residuals so alike if they were noise.
    """
    reduced, width = chi2 / freedom, math.sqrt(2.0 / freedom + 2.0 / noise_points)
    if reduced > POOR:
        word = NO_MODEL
    elif reduced - 1.0 >= MOST * width:
        word = TOO_LARGE
    elif independence < BY_CHANCE:
        word = DECEPTIVE
    else:
        word = TOO_SMALL if 1.0 - reduced >= MOST * width else AS_EXPECTED
    return JudgedChi2(reduced, 1.0 + math.copysign(MOST * width, reduced - 1.0), word)


def judged_fit(fit: xr.Dataset) -> JudgedChi2:
    """Return the judgment on a fit."""
    attrs = fit.attrs
    points = attrs.get("data_noise_points", math.inf)
    return judged(attrs["chi2"], attrs["degrees_of_freedom"], points, independent(fit))


def independent(fit: xr.Dataset) -> float:
    """Return the probability that the residuals of a fit are noise; a fit of an older version has its runs test."""
    return float(fit.attrs.get("independence", fit.attrs.get("runs_test", 1.0)))


def verdict(fit: xr.Dataset) -> str:
    """Return the first sentence on a fit whose values mean less than they seem to; empty for a good fit."""
    if fit.attrs.get("interrupted"):
        return "The fit was stopped: these are the best values so far."
    text = VERDICTS.get(judged_fit(fit).word, "")
    lost = int(fit.attrs["lost_points"])
    if text or not lost:
        return text
    return f"The fit failed at {lost} point{'s' * (lost > 1)}: its values and errors are biased."


def is_seen(one: xr.Dataset) -> bool:
    """Return whether the data of a fit see one of its parameters; its error is below its value, but for an offset."""
    size, error = abs(float(one["value"])), float(one["error"])
    far = "offset" not in str(one["parameter"].values) and size < error < math.inf
    return ("seen" not in one or bool(one["seen"])) and not far


def is_constrained(one: xr.Dataset) -> bool:
    """Return whether the data of a fit constrain one of its parameters."""
    return is_seen(one) and not math.isinf(float(one["error"]))


def without_error(one: xr.Dataset) -> str:
    """Return why one parameter of a fit has no error; empty where it has one."""
    if not is_seen(one):
        return UNSEEN
    if math.isinf(float(one["error"])):
        return "constrained only as a product"
    if "at_bound" in one and bool(one["at_bound"]):
        return "at a bound of its range"
    return "" if float(one["error"]) > 0.0 else "error unknown"


def fitted(one: xr.Dataset) -> str:
    """Return value and error of one parameter of a fit, or why it has none."""
    value, error, unit = with_error(float(one["value"]), float(one["error"]), str(one["unit"].values))
    why = without_error(one)
    if why == UNSEEN:  # its value is the start, or may be any
        return why
    return f"{value} {unit}".strip() + f", {why}" if why else f"{value} ± {error} {unit}".strip()


def fit(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the verdict, the fitted parameters, chi2 and the points that the best fit loses."""
    if doubt := verdict(dataset):
        yield Finding("verdict", "verdict", doubt, None, "1")
    for name in dataset["parameter"].values:
        one = dataset.sel(parameter=name)
        value, unit = float(one["value"]), str(one["unit"].values)
        yield Finding(str(name), str(name), fitted(one), value, unit)
    chi2, lost = dataset.attrs["chi2"], int(dataset.attrs["lost_points"])
    yield Finding("chi2", "chi2", f"{chi2:.1f} for {dataset.attrs['degrees_of_freedom']}", chi2, "1")
    yield Finding("lost_points", "lost points", str(lost), float(lost), "1")
