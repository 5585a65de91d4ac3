"""A limit that is drawn across the lines of a quantity: what it allows, in words and as a number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dforce.core.units import parse
from dforce.findings.set_point import states_meant
from dforce.gui.curves.figures import unit_of
from dforce.gui.study.explore import Choice, axis_of, cut

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class DrawnLimit:
    """A limit of the quantity (SI), and whether what is allowed lies above it."""

    value: float
    above: bool = False


def scale_of(result: xr.Dataset, choice: Choice) -> tuple[float, str]:
    """Return the scale and the unit in which the lines of a choice are drawn."""
    return unit_of(cut(result, choice.quantity, choice).load())


def usual_limit(result: xr.Dataset, choice: Choice, above: bool) -> DrawnLimit | None:
    """Return a limit in the middle of the lines of a choice; None where there are none."""
    values = cut(result, choice.quantity, choice).values
    values = values[np.isfinite(values)]
    return DrawnLimit(float(0.5 * (values.min() + values.max())), above) if len(values) else None


def shown_limit(result: xr.Dataset, choice: Choice, limit: DrawnLimit) -> str:
    """Return a limit as text, in the unit of the lines."""
    scale, unit = scale_of(result, choice)
    return f"{limit.value / scale:.4g}{'' if unit == '1' else f' {unit}'}"


def read_limit(result: xr.Dataset, choice: Choice, text: str, above: bool) -> DrawnLimit:
    """Return a limit that was typed; a plain number is in the unit of the lines.

    Raises
    ------
    ParameterError
        When it is none.
    """
    scale, _ = scale_of(result, choice)
    try:
        return DrawnLimit(float(text.replace(",", ".")) * scale, above)
    except ValueError:
        return DrawnLimit(parse(text, str(result[choice.quantity].attrs.get("units", "1"))), above)


def allowed(result: xr.Dataset, choice: Choice, limit: DrawnLimit) -> str:
    """Return in words where along the lines the limit holds, and for which states."""
    meant = states_meant(result)
    variable = cut(result, choice.quantity, choice)
    values = variable.transpose(choice.x, ...).values.reshape(variable.sizes[choice.x], -1)
    there = np.isfinite(values).any(axis=1)
    with np.errstate(invalid="ignore"):
        fails = (values < limit.value if limit.above else values > limit.value).any(axis=1)
    holds = np.flatnonzero(there & ~fails)
    if not len(holds):
        return f"The limit holds nowhere here for {meant}."
    x, _ = axis_of(result, choice.x)
    unit = unit_of(result[choice.x])[1]
    ends = [f"{x[place]:.4g}{'' if unit == '1' else f' {unit}'}" for place in (holds[0], holds[-1])]
    gaps = "" if len(holds) == holds[-1] - holds[0] + 1 else ", with gaps"
    return f"The limit holds from {ends[0]} to {ends[1]}{gaps}, for {meant}."
