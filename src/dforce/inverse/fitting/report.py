"""A fit in words, and several of them beside each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core import units
from dforce.core.errors import ParameterError, checked
from dforce.core.listing import aligned, in_parts
from dforce.findings.finding import with_error
from dforce.findings.fits import NO_MODEL, VERDICTS, WHY, fitted, independent, judged_fit, verdict, without_error
from dforce.inverse.fitting.points import BESIDE_JUMP, NOT_SELECTED, SPIKE
from dforce.validity import advice_in

if TYPE_CHECKING:
    import xarray as xr

TELLING = 0.5  # correlations from here on are listed
UNDECIDED = 6.0  # of AIC or BIC: models nearer to the best are not excluded
ALIKE = 1.2  # ratio of the errors to both sides from which both are reported
OPEN = 100.0  # times the standard deviation: a side where chi2 has not risen by then has no end
NAMED = 12  # heights of points left out are listed up to this number
NOISE = ("amplitude_error", "phase_error", "height_error")  # attributes
LITTLE = 0.01  # of an error: a smaller part from given values is not reported


@checked
def fit_report(result: xr.Dataset) -> str:
    """Return a fit as text: data, statistics, parameters, correlations and advice. For :func:`fit_many` return a table.

    Raises
    ------
    ParameterError
        When the result is not a fit.
    """
    if result.attrs.get("kind") == "fits":
        return _table(result)
    check_fit(result)
    lines = [line for line in (verdict(result), str(result.attrs.get("title", ""))) if line]
    lines += [*_data_lines(result), "", "statistics", *_statistics(result), "", _heading(result), *_parameters(result)]
    if rows := _minima(result):
        lines += ["", "minima not excluded by the data, all within the intervals of 95 %", *rows]
    if given := _given(result):
        lines += ["", "errors from fixed values, to be added in squares", *given]
    if drawn := _bootstrap(result):
        lines += ["", *drawn]
    if pairs := _correlations(result):
        lines += ["", f"correlations above {TELLING:g}", *pairs]
    notes = [piece.text for piece in advice_in(result)]
    return "\n".join([*lines, *([""] if notes else []), *(f"advice: {note}" for note in notes)])


def _table(result: xr.Dataset) -> str:
    """Return a row for each of many fits, and below why others could not be made."""
    names = result["parameter"].values.tolist()
    rows, below = [("", *(name.split(".")[-1] for name in names), "chi2", "lost")], []
    if held := str(result.attrs.get("holds_for", "")):
        below.append(f"all values are valid for {held}")
    for curve in result["curve"].values.tolist():
        one = result.sel(curve=curve)
        if message := str(one["message"].values):
            below.append(f"not fitted: {curve}: {message}")
            continue
        doubt = str(one["doubt"].values) if "doubt" in one else ""  # a file of an older version has none
        if doubt:
            below.append(f"{curve}: {doubt}")
        meaningless = doubt == VERDICTS[NO_MODEL]
        cells = ["no answer" if meaningless else fitted(one.sel(parameter=name)) for name in names]
        chi2 = f"{float(one['chi2']):.1f} / {float(one['degrees_of_freedom']):.0f}"
        rows.append((curve, *cells, chi2, f"{float(one['lost_points']):.0f}"))
        if bool(one["advised"]):
            below.append(f"with advice; fit this curve alone to read it: {curve}")
    return "\n\n".join([*(aligned(part) for part in in_parts(rows)), *(["\n".join(below)] if below else [])])


def check_fit(result: xr.Dataset) -> None:
    """Raise ParameterError for a result that is no fit."""
    if result.attrs.get("kind") != "fit":
        raise ParameterError("this result is not a fit; get a fit from df.fit(case, data, free=[...])")


def _data_lines(result: xr.Dataset) -> list[str]:
    used = int(result["used"].sum())
    branches = {1: "from free motion", -1: "behind the jump"}
    counts = [
        f"{int((result['used'] & (result['branch'] == number)).sum())} {words}" for number, words in branches.items()
    ]
    sigma = np.atleast_1d(result.attrs["amplitude_error"]), np.atleast_1d(result.attrs["phase_error"])
    lines = [
        f"data: {used} of {result.sizes['point']} points, {', '.join(counts)}; errors {sigma[0][0] * 1e9:.3g} nm, "
        f"{sigma[1][0]:.3g} deg"
    ]
    if reasons := list(_left_out(result)):
        lines.append(f"left out: {'; '.join(reasons)}")
    unsure = float(result.attrs.get("height_error", 0.0))
    if unsure:
        lines.append(f"noise: heights have an error of {unsure * 1e9:.2g} nm, important on steep parts of the curve")
    wider = math.sqrt(float(result.attrs.get("inflation", 1.0)))
    if wider > 1.0:
        lines.append(f"noise: neighbors are correlated, so all errors are {wider:.2f} times as large")
    return lines


def _left_out(result: xr.Dataset) -> Iterator[str]:
    """Give the points that are left out, by their reason, with their heights where the user did not choose them."""
    if "left_out" not in result:  # a file of an older version
        return
    why, heights = result["left_out"].values.astype(str), result["height"].values
    for reason in (SPIKE, BESIDE_JUMP, NOT_SELECTED):
        places = heights[why == reason]
        where = ", ".join(units.show(float(height), "m", 4) for height in places) if len(places) <= NAMED else ""
        if len(places):
            yield f"{len(places)} {reason}" + (f" at {where}" if where and reason != NOT_SELECTED else "")


def _each(result: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Give each parameter of a fit by its name."""
    return ((name, result.sel(parameter=name)) for name in result["parameter"].values.tolist())


def _indented(rows: Sequence[Sequence[str]]) -> list[str]:
    return ["  " + line for line in aligned(rows).splitlines()]


def _statistics(result: xr.Dataset) -> list[str]:
    attrs = result.attrs
    rows = [
        (
            "chi2",
            f"{attrs['chi2']:.2f} for {attrs['degrees_of_freedom']} degrees of freedom, {judged_fit(result).word}",
        ),
        ("AIC, BIC", f"{attrs['aic']:.2f}, {attrs['bic']:.2f}"),
        ("lost points", str(attrs["lost_points"])),
        ("residuals", f"p = {independent(result):.2g} for independent neighbors"),
    ]
    return _indented(rows)


@checked
def chi2_in_words(result: xr.Dataset) -> str:
    """Return the verdict on the chi2 of a fit (as expected, too large, too small) and its meaning, in one or two sentences.

    Raises
    ------
    ParameterError
        When the result is not a fit of one curve.
    """
    check_fit(result)
    chi2, attrs = judged_fit(result), result.attrs
    return f"χ² is {chi2.word}, {attrs['chi2']:.4g} for {attrs['degrees_of_freedom']} degrees of freedom: {WHY[chi2.word]}."


def _parameters(result: xr.Dataset) -> list[str]:
    rows = []
    for name, one in _each(result):
        value, error, unit = with_error(float(one["value"]), float(one["error"]), str(one["unit"].values))
        if why := without_error(one):
            rows.append((name, f"{value} {unit}".strip(), why, ""))
            continue
        told = _both_sides(one, error, unit)
        if "offset" not in name and math.isfinite(float(one["error"])):
            share = 100.0 * abs(float(one["error"]) / float(one["value"]))
            told += f" ({share:.2g} %)" if share < 99.5 else f" ({share:.0f} %)"
        prior = (
            f"prior {float(one['prior']):.4g} +- {float(one['prior_error']):.2g}" if np.isfinite(one["prior"]) else ""
        )
        start = with_error(float(one["start"]), math.nan, str(one["unit"].values))
        rows.append((name, value, told, prior or f"start {start[0]} {start[2]}"))
    return _indented(rows)


def _heading(result: xr.Dataset) -> str:
    """Return the heading of the parameters with the values that they hold for: curves with other k or R are as good."""
    held = str(result.attrs.get("holds_for", ""))
    others = "other values, a wrong sensitivity and wrong heights scale the forces, and chi2 may hide it"
    return f"parameters, for {held}; {others}" if held else "parameters"


def _minima(result: xr.Dataset) -> list[str]:
    """Return values and chi2 of the minima within the interval of 95 %, where there are several, and that interval."""
    if "minimum_excluded" not in result:
        return []
    places = np.flatnonzero(~result["minimum_excluded"].values)
    if len(places) < 2:
        return []
    rows = [("chi2", *(f"{float(result['minimum_chi2'][place]):.2f}" for place in places), "interval of 95 %")]
    for name, one in _each(result):
        plain, error = str(one["unit"].values), float(one["error"])
        numbers = [*(one["minimum_value"][place] for place in places), one["interval_low"], one["interval_high"]]
        told = [" ".join(with_error(float(number), error, plain)[::2]).strip() for number in numbers]
        rows.append((name, *told[:-2], without_error(one) or " to ".join(told[-2:])))
    return _indented(rows)


def _both_sides(one: xr.Dataset, error: str, unit: str) -> str:
    """Return an error with its unit as text, as two where the sides differ."""
    sides = {sign: float(one[name]) for sign, name in (("-", "error_low"), ("+", "error_high"))}
    ends = {sign: side for sign, side in sides.items() if side < OPEN * float(one["error"])}
    if not ends or (len(ends) == 2 and max(ends.values()) < ALIKE * min(ends.values())):
        return f"+- {error} {unit}".rstrip()
    value, plain = float(one["value"]), str(one["unit"].values)
    told = " ".join(f"{sign}{with_error(value, side, plain)[1]}" for sign, side in ends.items())
    missing = {"-": ", no end below", "+": ", no end above"}
    return f"{told} {unit}".rstrip() + "".join(words for sign, words in missing.items() if sign not in ends)


def _given(result: xr.Dataset) -> list[str]:
    """Return the part of each error from parameters with known values, where it counts."""
    rows = []
    for name, one in _each(result):
        given = float(one["error_given"])
        if given > LITTLE * float(one["error"]):
            _, error, unit = with_error(float(one["value"]), given, str(one["unit"].values))
            rows.append((name, f"+- {error} {unit}".rstrip()))
    return _indented(rows)


def _bootstrap(result: xr.Dataset) -> list[str]:
    """Return the errors by redrawn residuals, beside the errors by the covariance."""
    if "bootstrap_error" not in result:
        return []
    rows = []
    for name, one in _each(result):
        if bool(one["seen"]):
            _, error, unit = with_error(float(one["value"]), float(one["bootstrap_error"]), str(one["unit"].values))
            ratio = float(one["bootstrap_error"]) / float(one["error"])
            rows.append((name, f"+- {error} {unit}".rstrip(), f"{ratio:.2f} times the error from the covariance"))
    block = int(result.attrs["bootstrap_block"])
    words = "one by one" if block == 1 else f"in blocks of {block} points"
    heading = f"errors by bootstrap: {result.sizes['draw']} fits to redrawn residuals {words}"
    return [heading, *_indented(rows)]


def _correlations(result: xr.Dataset) -> list[str]:
    names, values = result["parameter"].values.tolist(), result["correlation"].values
    pairs = [
        (abs(values[i, j]), f"  {names[i]}, {names[j]}: {values[i, j]:+.3f}")
        for i in range(len(names))
        for j in range(i)
        if abs(values[i, j]) >= TELLING
    ]
    return [text for _, text in sorted(pairs, reverse=True)]


def _noise(fit: xr.Dataset, name: str) -> Any:
    """Return a standard deviation of each tone; a file gives back a list of one number as that number."""
    return np.atleast_1d(fit.attrs.get(name, 0.0))


@checked
def compare_fits(fits: Mapping[str, Any]) -> xr.Dataset:
    r"""Compare several models on the same data.

    With known errors :math:`\mathrm{AIC} = \chi^2 + 2 k` and :math:`\mathrm{BIC} = \chi^2 + k \ln n`, for k parameters and n
    measured numbers. A model is not excluded if its AIC is less than 6 above the lowest AIC.

    Parameters
    ----------
    fits
        Results of :func:`fit` by the names of their models.

    Returns
    -------
    xarray.Dataset
        Over `model`, the lowest AIC first: `chi2`, `parameters` (their number), `aic`, `bic`, `delta_aic`, `delta_bic`,
        `lost_points`, and `not_excluded`.

    Raises
    ------
    ParameterError
        For fewer than two fits, or fits of different data.
    """
    import xarray as xr

    if len(fits) < 2:
        raise ParameterError("a comparison needs at least two fits of the same data")
    every = list(fits.values())
    for one in every:
        check_fit(one)
    columns = ("height", "amplitude", "phase", "used")
    for one in every[1:]:
        same = all(one[name].shape == every[0][name].shape and (one[name] == every[0][name]).all() for name in columns)
        alike = all(np.array_equal(_noise(one, name), _noise(every[0], name)) for name in NOISE)
        if not same or not alike:
            raise ParameterError("these fits have different points or errors, so their chi2 cannot be compared")
    order = np.argsort([one.attrs["aic"] for one in every], kind="stable")
    names = [list(fits)[i] for i in order]
    table = {
        name: ("model", np.array([every[i].attrs[name] for i in order]))
        for name in ("chi2", "parameters", "aic", "bic", "lost_points")
    }
    out = xr.Dataset(table, {"model": names})
    out["delta_aic"], out["delta_bic"] = out["aic"] - out["aic"].min(), out["bic"] - out["bic"].min()
    out["not_excluded"] = out["delta_aic"] < UNDECIDED
    return out
