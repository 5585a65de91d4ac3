"""What goes with a set point: the states of a curve in which the amplitude is a given share of the free amplitude."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.errors import ParameterError, nearest
from dforce.findings import jumps
from dforce.results import Status
from dforce.series import drawable, goes_along, row_of

if TYPE_CHECKING:
    import xarray as xr

RATIO = "amplitude_ratio"
FOR_JUMPS = ("amplitude", "phase", "corrections", "jump_zc", "jump_direction")
Floats = np.ndarray[Any, np.dtype[np.float64]]
Places = np.ndarray[Any, np.dtype[np.intp]]


def at_set_point(result: xr.Dataset, set_point: float = 0.8, names: Collection[str] | None = None) -> xr.Dataset:
    r"""Return the states of a curve in which the amplitude of the first tone is a share of its free amplitude.

    .. math:: A / A_0 = \text{set point}

    Each lies on a straight line between two neighboring points of the curve. Where the motion jumps from one state to
    another there is none in between, nor is there beside a point that did not settle.

    Parameters
    ----------
    result
        Result of an approach, of branches or of a frequency sweep.
    set_point
        The share :math:`A / A_0`, above 0.
    names
        Quantities that are wanted; left out: all that go along the curve.

    Returns
    -------
    xarray.Dataset
        The quantities over `crossing`, with the coordinate that the curve goes along and `regime`, as :func:`regime` says
        it; `direction` and `stable` where the curve has them.

    Raises
    ------
    ParameterError
        When the result is no curve with an amplitude ratio, lacks a quantity, or the set point is not above 0.
    """
    import xarray as xr

    along = goes_along(result)
    row = row_of(result, along) if along else ""
    if not row or RATIO not in result or row_of(result, RATIO) != row:
        raise ParameterError("this result is no curve of amplitudes, so no set point lies on it")
    if not set_point > 0.0:
        raise ParameterError(f"set_point = {set_point} is not above 0")
    wanted = dict.fromkeys([along, "virial", *(drawable(result, along) if names is None else names)])
    for name in wanted:
        if name not in result.variables or row_of(result, name) != row:
            raise ParameterError(f"this curve has no '{name}'{nearest(name, drawable(result, along))}")
    ways = [str(way) for way in result["direction"].values] if "direction" in result[RATIO].dims else [""]
    found = [_Crossings.of(result, along, number, way, set_point) for number, way in enumerate(ways)]
    variables = {name: _between(result.variables[name], row, found) for name in wanted}
    words = [_word(virial) for virial in variables["virial"][1][:, 0]]
    coords: dict[str, Any] = {along: variables.pop(along), "regime": ("crossing", np.array(words, dtype=np.str_))}
    if ways != [""]:
        coords["direction"] = ("crossing", np.repeat(ways, [len(one.share) for one in found]))
    if "stable" in result:
        stable = result["stable"].values.astype(bool)
        coords["stable"] = ("crossing", stable[found[0].before] & stable[found[0].after])
    return xr.Dataset(variables, coords, {"along": along, "set_point": set_point})


def regime(point: xr.Dataset) -> str:
    """Return whether the force is net attractive or net repulsive in the motion at one point of a result.

    The sign of the first mode's virial says so; at resonance a phase lag above or below 90° says the same.

    Returns
    -------
    str
        ``"attractive"``, ``"repulsive"``, or nothing where there is no force.
    """
    return _word(float(point["virial"].values[0]))


def _word(virial: float) -> str:
    return "attractive" if virial > 0.0 else "repulsive" if virial < 0.0 else ""


@dataclass(frozen=True)
class _Crossings:
    """Where a curve in one direction crosses the set point: the points before and after, and how far between them."""

    chosen: Mapping[str, int]
    before: Places
    after: Places
    share: Floats

    @classmethod
    def of(cls, result: xr.Dataset, along: str, number: int, way: str, set_point: float) -> _Crossings:
        """Find the crossings of one direction, `number` in the result."""
        chosen = {"direction": number} if way else {}
        ratio, status = (result.variables[name].isel(chosen).values for name in (RATIO, "status"))
        x = result.variables[along].values
        order = np.arange(len(x)) if "branch" in result else np.argsort(x, kind="stable")
        above = ratio[order] - set_point
        steady = np.isfinite(above) & (status[order] == Status.OK)
        crossed = ((above[1:] < 0.0) != (above[:-1] < 0.0)) & steady[1:] & steady[:-1]
        if "branch" in result:
            crossed &= np.diff(result["branch"].values) == 0
        elif crossed.any():
            names = [name for name in FOR_JUMPS if name in result]
            for jump in jumps(result[names].isel(chosen, missing_dims="ignore"), way) if _may_jump(result) else ():
                step = np.searchsorted(x[order], jump.at, side="left" if way in ("retract", "up") else "right") - 1
                crossed[max(int(step), 0)] = False
        first = np.flatnonzero(crossed)
        return cls(chosen, order[first], order[first + 1], above[first] / (above[first] - above[first + 1]))


def _may_jump(result: xr.Dataset) -> bool:
    """Return whether a curve may have jumps; where orbits were followed, jumps are noted in the result."""
    return "jump_zc" in result or "corrections" not in result


def _between(
    variable: xr.Variable, row: str, found: list[_Crossings]
) -> tuple[tuple[str, ...], Floats, Mapping[Any, Any]]:
    """Return the values of a variable at the crossings of all directions, with dimensions and attributes."""
    parts = []
    for one in found:
        values = variable.isel(one.chosen, missing_dims="ignore").transpose(row, ...).values
        share = one.share.reshape(-1, *[1] * (values.ndim - 1))
        parts.append((1.0 - share) * values[one.before] + share * values[one.after])
    others = tuple(str(dim) for dim in variable.dims if dim not in (row, "direction"))
    return ("crossing", *others), np.concatenate(parts), variable.attrs
