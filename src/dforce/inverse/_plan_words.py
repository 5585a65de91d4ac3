"""The sentences of a plan: the states, the recommendation, or the remedies where no setting is allowed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core.arrays import Array
from dforce.core.quantities import OBSERVABLES
from dforce.core.units import show, show_range
from dforce.instrument.lever import DENSEST
from dforce.inverse.wishes import Wishes
from dforce.maps.axes import Axis
from dforce.maps.seeds import NEAR, Curves

if TYPE_CHECKING:
    from dforce.inverse._states import Judged, Rest

WALKED = "the stable states on the branches of each case"
MET = "the states on approach and retract"
FEW = "with fewer cases also the states on the branches"
THERE = "the states on the branches count only where a setting is recommended or best"
UNSTEADY = "a motion exists that alternates or beats, with a force that is not known"
DIGITS = 3
LIQUID = 10.0  # quality factor below which a lever is in a liquid


def sentences(axes: Sequence[Axis], shares: Array, wishes: Wishes, judged: Judged, rest: Rest) -> list[str]:
    """Return the sentences of a plan."""
    allowed, chosen, cases = judged.hit == "", rest.marks["recommended"], rest.chosen(judged)
    met = f"{MET}; {THERE if cases and cases <= rest.walked else FEW}"
    have = "limits apply to" if wishes.limits or wishes.regime or wishes.one_state else "plan has"
    said = [f"The {have} {WALKED if set(judged.points.near.tolist()) <= rest.walked else met}."]
    if chosen.any():
        return [*said, *_beside(wishes, judged, int(np.flatnonzero(chosen)[0]))]
    ranges = ", ".join([*map(_range, axes), f"set points {_in_percent(shares)}"])
    if allowed.any():
        return [
            *said,
            f"No setting is recommended: no allowed setting has room around it. The search covered {ranges}. Limits hold at "
            f"the end of these ranges: {', '.join(_binding(axes, shares, judged, allowed)) or 'none'}. Widen these ranges, "
            "or add values between.",
        ]
    return [*said, f"No setting is allowed. The search covered {ranges}.", *_ratios(axes, wishes, judged)]


def why_no_state(case: Case, curves: Curves, shares: Array) -> str:
    """Return why no curve has a stable state at any set point, and the remedy."""
    lowest, change = curves.lowest_ratio(), "choose other set points, or other values under vary."
    share = f"the lowest A/A0 down to zc = {NEAR[-1] * case.problem.tip_share:.3g} A0 is {100.0 * lowest:.3g} %"
    if lowest < shares.max():
        why = f"the motion alternates or beats, or the amplitude jumps across them ({share})"
        return f"no curve has a stable state at any of the set points: {why}; {change}"
    return " ".join([f"no curve reaches any of the set points: {share}; {change}", *missing_damping(case)])


def missing_damping(case: Case) -> Iterator[str]:
    """Name the damping of sample and liquid that a case leaves out: where no setting is allowed, it may decide."""
    if not any(force.dissipative for force in case.problem.forces):
        yield (
            "The sample of this case dissipates no energy. Soft samples do: add a force with viscosity, such as kelvin_voigt "
            "or sls."
        )
    beam, lowest = case.cantilever.beam, min(mode.Q for mode in case.problem.modes)
    if (lowest < LIQUID or (case.medium.density or 0.0) > DENSEST) and (beam is None or beam.tip_height is None):
        yield (
            "The damping by the liquid squeezed between lever and sample is left out: describe the lever by cantilever.beam "
            "with tip_height, or write the Q measured close to the sample."
        )


def _beside(wishes: Wishes, judged: Judged, number: int) -> Iterator[str]:
    """Name the limits that another state at the recommended settings fails, at another distance."""
    points = judged.points
    here = (points.near == points.near[number]) & (points.set_points == points.set_points[number])
    for other in np.flatnonzero(here & (judged.hit != "")):
        hit = str(judged.hit[other])
        name = hit.removeprefix("margin: ")
        fails = "fails a limit" if name == hit else "fails a limit within the margins"
        value = "" if name not in OBSERVABLES else f", {_shown(name, _values(judged, name)[other])}"
        where = show(float(points.zc[other]), "m", 4)
        yield f"At the recommended settings another stable state, at zc = {where}, {fails}: {name}{value}."


def _range(axis: Axis) -> str:
    unit = axis.quantity.unit if axis.quantity is not None else "1"
    return f"{axis.path} {_ends(np.asarray(axis.values, dtype=float), unit)}"


def _ends(values: Array, unit: str) -> str:
    low, high = float(values.min()), float(values.max())
    return show(low, unit, 4) if low == high else show_range(low, high, unit, 4)


def _binding(axes: Sequence[Axis], shares: Array, judged: Judged, allowed: Any) -> Iterator[str]:
    """Give the ranges at whose ends limits hold."""
    columns = [*judged.points.values[allowed].T, judged.points.set_points[allowed]]
    for name, values, own in zip(
        [*(axis.path for axis in axes), "set_points"], [*(axis.values for axis in axes), shares], columns, strict=True
    ):
        if len(values) > 1 and bool(np.isin(own, (min(values), max(values))).any()):
            yield name


def _ratios(axes: Sequence[Axis], wishes: Wishes, judged: Judged) -> Iterator[str]:
    """Give how near each limit comes to being kept, over states of the requested regime and number."""
    virial = judged.found.columns["virial"][:, 0] * (1.0 if wishes.regime == "attractive" else -1.0)
    usable = np.flatnonzero(((virial > 0.0) | (not wishes.regime)) & ~(judged.others & wishes.one_state))
    asked = " and ".join([wishes.regime] * bool(wishes.regime) + ["alone at its distance"] * wishes.one_state)
    of_them = f" by a state that is {asked}" if asked else ""
    if not len(usable):
        yield f"No state is {asked}."
        return
    kept = 0
    for limit in wishes.limits:
        values, bounds = _values(judged, limit.name)[usable], judged.bounds[limit.name][usable]
        place = int(np.argmin(limit.sign * (values - bounds)))
        if limit.sign * (values[place] - bounds[place]) < 0.0:
            kept += 1
            continue
        ratio = f", {values[place] / bounds[place]:.3g} times its limit" if bounds[place] > 0.0 else ""
        yield (
            f"{limit.name} {limit.text} holds nowhere{of_them}: the best value is {_shown(limit.name, values[place])}{ratio}, "
            f"at {_setting(axes, judged, usable[place])}. Search beyond, or relax the limit."
        )
    if kept == len(wishes.limits):
        yield "Each limit holds somewhere, but no setting meets all with their margins: relax a limit, or widen the ranges."


def _setting(axes: Sequence[Axis], judged: Judged, place: int) -> str:
    """Return the parameters and the set point of a point."""
    values = zip(axes, judged.points.values[place], strict=True)
    said = [
        f"{axis.path} = {show(float(value), axis.quantity.unit if axis.quantity else '1', 4)}" for axis, value in values
    ]
    return ", ".join([*said, f"set point {_in_percent(judged.points.set_points[place])}"])


def _in_percent(shares: Array) -> str:
    """Return a share, or the range of several, for a reader."""
    low, high = (f"{100.0 * float(end):.3g} %" for end in (np.min(shares), np.max(shares)))
    return low if low == high else f"{low} to {high}"


def _values(judged: Judged, name: str) -> Array:
    return np.asarray(judged.found.columns[name].reshape(len(judged.points), -1)[:, 0])


def _shown(name: str, value: float) -> str:
    unit = OBSERVABLES[name].unit
    return f"{value:.{DIGITS}g}°" if unit == "degree" else show(float(value), unit, DIGITS)
