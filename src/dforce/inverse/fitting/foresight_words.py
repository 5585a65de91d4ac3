"""The findings of `df.identify`, as a table and in sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dforce.core import units
from dforce.core.errors import ParameterError, checked, shorten
from dforce.core.listing import aligned, in_parts
from dforce.findings.finding import DEGREE
from dforce.inverse.fitting.certainty import NOT_TOLD
from dforce.inverse.fitting.foresight import NOT_CONSTRAINED, ONLY_PRODUCT, PRIOR, UNSEEN

if TYPE_CHECKING:
    import xarray as xr


@checked
def identify_report(result: xr.Dataset, known: str = PRIOR) -> str:
    """Return the expected errors as text, a row for each curve: relative errors of positive parameters, else with a unit.

    An error in brackets is so large that the parameter is not constrained. A second table has the most correlated pair of
    parameters for each curve.

    Parameters
    ----------
    result
        The result of :func:`identify`.
    known
        Knowledge of the instrument: ``sample``, ``prior`` or ``all``, see :func:`identify`.

    Raises
    ------
    ParameterError
        When the result is not from :func:`identify`, or for another word.
    """
    _check(result, known)
    part = result.sel(known=known)
    names = [
        name
        for name in part["parameter"].values.tolist()
        if np.isfinite(part["error"].sel(parameter=name)).any() or (part["verdict"].sel(parameter=name) != "").any()
    ]
    rows = [("", *(name.split(".")[-1] for name in names))]
    pairs = [("", "closest pair", "correlation")]
    for curve in part["curve"].values.tolist():
        row = part.sel(curve=curve)
        cells = [_cell(row.sel(parameter=name)) for name in names]
        rows.append((curve, *cells))
        pair = ", ".join(_short(str(row["worst_pair"].values).split(", ")))
        pairs.append((curve, pair, f"{float(row['worst_correlation']):+.4f}"))
    lines = ["\n\n".join(aligned(part) for part in [*in_parts(rows), pairs])]
    mine = [line for line in result.attrs["products"].splitlines() if f", {known}: " in line]
    if any(cell.startswith("(") for row in rows for cell in row):
        lines.append("in brackets: so large that the parameter is not constrained")
    return "\n".join([*lines, *(f"only products are constrained: {line}" for line in mine)])


@checked
def identify_in_words(result: xr.Dataset, known: str = PRIOR, curve: str | None = None) -> dict[str, str]:
    """Return a sentence for each fitted parameter that a curve does not constrain, by path; empty if all are constrained.

    Parameters
    ----------
    result
        The result of :func:`identify`.
    known
        Knowledge of the instrument: ``sample``, ``prior`` or ``all``, see :func:`identify`.
    curve
        A value of `curve` in the result; default: the first.

    Raises
    ------
    ParameterError
        When the result is not from :func:`identify`, or lacks this curve.
    """
    _check(result, known)
    names = [str(name) for name in result["curve"].values]
    if curve is not None and curve not in names:
        raise ParameterError(f"this result has no curve '{shorten(curve)}'; its curves: {', '.join(names)}")
    one = result.sel(known=known, curve=curve or names[0])
    fitted = np.atleast_1d(result.attrs["free"]).tolist()
    found: dict[str, str] = {}
    for name in fitted:
        sentence = _sentence(one.sel(parameter=name))
        if sentence:
            found[name] = sentence
    return found


def _sentence(one: xr.Dataset) -> str:
    """Return why a curve does not constrain a parameter; empty where it does."""
    name, verdict = str(one["parameter"].values), str(one["verdict"].values)
    if verdict == UNSEEN:
        return f"This range does not constrain {name}: the curve does not depend on it."
    if verdict == ONLY_PRODUCT:
        return f"This range does not constrain {name}: only a product with another parameter is constrained."
    error = float(one["error"])
    if verdict == NOT_CONSTRAINED:
        return f"This range does not constrain {name}: the error would be {100.0 * error:.0f} %."
    return ""


def _check(result: xr.Dataset, known: str) -> None:
    if result.attrs.get("kind") != "identify" or known not in result["known"].values:
        raise ParameterError("this result is not from df.identify; call df.identify(case, free=[...])")


def _short(names: Sequence[str]) -> list[str]:
    """Return the last parts of names, with the number of the mode where they are alike otherwise."""
    last = [name.split(".")[-1] for name in names]
    if len(set(last)) == len(last):
        return last
    return [name.removeprefix("cantilever.") for name in names]


def _cell(one: xr.Dataset) -> str:
    """Return an error in a few signs."""
    error, verdict, unit = float(one["error"]), str(one["verdict"].values), str(one["unit"].values)
    if not math.isfinite(error):
        return verdict or "-"
    if unit == "1":
        told = f"{100 * error:.0f} %" if error >= 1 else f"{100 * error:.2g} %"
        return told if error <= NOT_TOLD else f"({told})"
    return f"{error:.2g} deg" if unit == DEGREE else units.show(error, unit, 2)
