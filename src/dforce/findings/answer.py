"""A result in words: the sentence above its picture."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from dforce.case import case_of
from dforce.core.errors import ParameterError, checked
from dforce.core.notation import plain_math
from dforce.core.units import parse_share, show
from dforce.findings.crossings import RATIO, SHIFT
from dforce.findings.fits import fitted, is_constrained, verdict
from dforce.findings.material import material
from dforce.findings.set_point import SetPointState, at_set_point, states_at, why_none
from dforce.findings.summary import summary
from dforce.results.curves import goes_along, row_of
from dforce.results.kinds import is_kind, known_kind, measured, swept
from dforce.results.status import check_computed
from dforce.validity import Evidence
from dforce.validity.laws import other_forces

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import xarray as xr

    from dforce.findings.finding import Finding

DIGITS = 3
MOST_LINES = 3  # of a summary
SYMBOL = r"\w{1,2}\b|\w*\d"  # k, a0, zc


@checked
def answer(result: xr.Dataset, set_point: float | str = 0.8) -> str:
    """Return a result in words.

    For a curve along the distance: its stable states at a set point, the approach first, with peak force and indentation. For
    a curve in AM-FM also the effective modulus there (:func:`dforce.material`). For a fit: its parameters with their errors.
    For any other result: the first lines of :func:`dforce.summary`.

    Parameters
    ----------
    result
        Any result.
    set_point
        The share :math:`A / A_0`, above 0 and at most 1: 0.8 or ``"80 %"``.

    Raises
    ------
    ParameterError
        When the dataset is not a result or has no points, and when the set point is not a share above 0 and at most 1.
    """
    check_computed(result)
    known_kind(result)
    text = answer_with(result, parse_share(set_point, "set_point"))
    joined = other_forces(Evidence(case_of(result), result)) if goes_along(result) and not swept(result) else None
    return text if joined is None else f"{text} {joined.text}"


def answer_with(
    result: xr.Dataset, share: float, states: xr.Dataset | None = None, all_states: Sequence[SetPointState] = ()
) -> str:
    """Return a result in words.

    `states` is a result of :func:`dforce.at_set_point` for this share, if known. With `all_states` of the case at this share
    the answer names states in regimes that the curve does not reach, too.
    """
    if is_kind(result, "fit"):
        return _of_fit(result)
    along = goes_along(result)
    row = row_of(result, along) if along else ""
    in_am = along == "zc" and measured(result) == ("amplitude", "phase")
    if not in_am or swept(result, along) or RATIO not in result or row_of(result, RATIO) != row:
        lines = summary(result)
        ways = len({line.direction for line in lines if line.direction}) > 1
        return " ".join(_in_words(line, ways) for line in lines[:MOST_LINES])
    met = [state for state in states_at(result, share, states) if state.stable]
    if not met:
        return why_none(result, share)
    regimes = {state.regime for state in met}
    unmet = [state for state in all_states if state.stable and state.regime not in regimes]
    found = dict.fromkeys((state.regime, _details(state)) for state in (*met, *unmet))
    (regime, details), *others = found
    first = f"{regime} at {100.0 * share:.4g} %" if regime else f"at {100.0 * share:.4g} %"
    sentences = [f"{first[0].upper()}{first[1:]}: {details}."]
    rest = [", ".join(filter(None, pair)) for pair in others]
    if rest:
        sentences.append(f"{'Another state exists' if len(rest) == 1 else 'Other states exist'}: {'; '.join(rest)}.")
    return " ".join([*sentences, *_modulus(result, share)])


def _in_words(line: Finding, ways: bool) -> str:
    """Return a line of a summary as a sentence; symbols keep their letter, because A0 is not a0."""
    label = f"{line.label} ({line.direction})" if ways and line.direction else line.label
    start = label if re.match(SYMBOL, label) else f"{label[0].upper()}{label[1:]}"
    return f"{start}: {line.text.removesuffix('.')}."


def _modulus(curve: xr.Dataset, share: float) -> Iterator[str]:
    """Give the modulus of AM-FM at a set point, in a sentence, where tone 2 stays within the contact."""
    if SHIFT not in curve:
        return
    states = at_set_point(curve, share)
    try:
        found = material(states.assign_attrs(curve.attrs))
    except ParameterError:  # a tip without a radius
        return
    within = states["max_indentation"] > states["amplitude"].isel(tone=1)
    for modulus in found["E_eff"].where(within).dropna("crossing").values[:1]:
        true = f"; the true one is {show(float(found['true_E_eff']), 'Pa', DIGITS)}" if "true_E_eff" in found else ""
        yield f"The frequency shift of mode 2 gives an effective modulus of {show(modulus, 'Pa', DIGITS)}{true}."


def _of_fit(fit: xr.Dataset) -> str:
    """Return the fitted parameters of the case in words, with k, Q and R for which they hold, behind the verdict on the fit."""
    words = "label" if "label" in fit.coords else "symbol"  # a fit of an older version has symbols alone
    found = [
        f"{plain_math(str(one[words].values))} {'=' if is_constrained(one) else 'is'} {fitted(one)}"
        for one in (fit.sel(parameter=name) for name in fit["parameter"].values)
        if "." in str(one["parameter"].values)  # the others are offsets of the measurement
    ]
    held = [part.partition(" = ") for part in str(fit.attrs.get("holds_for", "")).split(", ") if part]
    known = [f"{_symbol_of(path)} = {value}" for path, _, value in held]
    text = f"{', '.join(found)}{', for ' if known else ''}{', '.join(known)}."
    text = f"{text[0].upper()}{text[1:]}" if words == "label" else text
    doubt = verdict(fit)
    return f"{doubt} {text}" if doubt else text


def _symbol_of(path: str) -> str:
    """Return the symbol of a value of lever or tip; with several modes it names the mode."""
    if path == "tip.radius":
        return "R"
    *parts, name = path.split(".")
    return f"{name} of mode {parts[-1]}" if "modes" in parts else name


def _details(state: SetPointState) -> str:
    """Return peak force and indentation of a state."""
    deep = state.max_indentation > 0.0
    if not deep and not state.repels:
        return "no contact"
    force = show(state.peak_force, "N", DIGITS) if state.repels and math.isfinite(state.peak_force) else ""
    depth = f"{show(state.max_indentation, 'm', DIGITS)} deep" if deep else ""
    return ", ".join(filter(None, (force, depth)))
