"""States at a set point: states of a curve in which the amplitude has a chosen ratio to the free amplitude."""

from __future__ import annotations

import functools
from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import AnyArray
from dforce.core.errors import ParameterError, UnitError, checked, nearest
from dforce.core.quantities import OBSERVABLES
from dforce.core.units import parse, parse_share
from dforce.findings.crossings import RATIO, SHIFT, Crossings
from dforce.results.curves import drawable, goes_along, row_of
from dforce.results.dataset import COLUMN_DIMS
from dforce.results.kinds import check_shape, measured, swept
from dforce.results.significance import ERRORS, is_none
from dforce.results.status import WITHOUT_RESULT, Status, check_computed, repeats

if TYPE_CHECKING:
    import xarray as xr


@checked
def at_set_point(
    result: xr.Dataset,
    set_point: float | str = 0.8,
    names: Collection[str] | None = None,
    frequency_shift: float | str | None = None,
) -> xr.Dataset:
    r"""Return the states of curves at a ratio of the first tone's amplitude to its free amplitude, or at a frequency shift.

    .. math:: A / A_0 = \text{set point}

    Between two neighboring points of a curve along the distance, or of branches, the state is solved, with the parameter as one
    more unknown; then `solved` is True. For frequency sweeps and for motions found in time, the state is interpolated linearly
    between the points. No state is sought across a jump or beside a point that did not settle. A curve contains its jumps; if
    its states are not carried from point to point, or have no orbits, a sudden step counts as a jump (:func:`dforce.summary`).

    Parameters
    ----------
    result
        Result of an approach, of branches, of a frequency sweep, or a sweep of curves over parameters.
    set_point
        The share :math:`A / A_0`, above 0 and at most 1: 0.8 or ``"80 %"``.
    names
        Names of the quantities; default: all along the curves.
    frequency_shift
        Frequency shift (Hz, or text with a unit) that the feedback holds in FM-AFM, instead of the ratio.

    Returns
    -------
    xarray.Dataset
        The quantities over `crossing`, with the coordinate of the curve, `solved`, and `direction` and `stable` if the curve
        has them. If the result contains the virial, also `regime` (:func:`regime`). For a sweep its parameters come first;
        cases with fewer states end in NaN (and empty words), and `status` is the largest of each case.

    Raises
    ------
    ParameterError
        When the result has no points, is not a curve with an amplitude ratio, or lacks a quantity. Also when the set point is
        not a share above 0 and at most 1.
    """
    if frequency_shift is not None:
        if SHIFT not in result:
            raise ParameterError('this result has no frequency shift; at_set_point needs drive.operation = "fm" for it')
        try:
            shift = parse(frequency_shift, "Hz")
        except UnitError as error:
            raise UnitError(f"frequency_shift {error}") from None
        return _states(result, SHIFT, shift, names).assign_attrs(frequency_shift=shift)
    set_point = parse_share(set_point, "set_point")
    if "amplitude" not in measured(result):
        raise ParameterError(
            "a controller keeps the amplitude of this result constant; write frequency_shift, not set_point"
        )
    return _states(result, RATIO, set_point, names).assign_attrs(set_point=set_point)


@checked
def read_at_set_point(result: xr.Dataset, set_point: float, names: Collection[str]) -> dict[str, AnyArray]:
    """Return quantities of the states of :func:`at_set_point`, read on straight lines between points: quick, for a picture.

    Raises
    ------
    ParameterError
        See :func:`at_set_point`.
    """
    found, _, known = _met(result, RATIO, set_point)
    return {name: found.read(result, name) for name in names if name in known}


@checked
def at_distance(result: xr.Dataset, distance: float, names: Collection[str] | None = None) -> xr.Dataset:
    """Return the states at an average distance (m), as :func:`at_set_point` does at a set point.

    Raises
    ------
    ParameterError
        When the result is not a curve along the distance.
    """
    if goes_along(result) != "zc":
        raise ParameterError("this result is not a curve along the distance")
    return _states(result, "zc", float(distance), names)


def _met(result: xr.Dataset, met: str, value: float) -> tuple[Crossings, str, list[str]]:
    """Return where curves meet the value of a quantity, along which quantity, and the names of all along them."""
    check_computed(result)
    check_shape(result)
    if "crossing" in result.dims:
        raise ParameterError("this result lists the states at a set point already; choose the curve itself")
    along = goes_along(result)
    over = swept(result, along)
    if over and "branch" in result:  # the points of each case have places of their own
        chosen = ", ".join(f"{dim}=0" for dim in over)
        raise ParameterError(f"the branches of each case have points of their own; choose a case with .isel({chosen})")
    first = result.isel(dict.fromkeys(over, 0)) if over else result
    row = row_of(first, along) if along else ""
    if row and RATIO not in result and "amplitude" in result:
        raise ParameterError(f"this result has no '{RATIO}'; add it to the quantities of the sweep")
    if not row or RATIO not in result or row_of(first, RATIO) != row:
        raise ParameterError("this result is not a curve of amplitudes, so it has no set points")
    if "status" not in result.variables:
        raise ParameterError("this result has lost its status, without which no point is used; keep it")
    known = [name for name in drawable(first, along) if name != "stable"]  # a number once .where was applied
    return Crossings.of(result, along, row, over, met, value), along, known


def _states(result: xr.Dataset, met: str, value: float, names: Collection[str] | None) -> xr.Dataset:
    """Return the states of curves at which the quantity `met` has a value, solved where they can be."""
    import xarray as xr

    found, along, known = _met(result, met, value)
    over = found.over
    always = [along, *(name for name in ("zc", "virial") if name in known)]
    wanted = dict.fromkeys([*always, *(known if names is None else names)])
    for name in wanted:
        if name not in known:
            raise ParameterError(f"this curve has no '{name}'{nearest(name, known)}")
    values = {name: found.read(result, name) for name in wanted}
    columns, solved = found.solved(result, along, met, value)
    for name in wanted.keys() & columns.keys():
        values[name][solved] = _kept(columns[name][solved], result, name)
    variables = {name: found.laid_out(result, name, one) for name, one in values.items()}
    coords: dict[str, Any] = {name: variables.pop(name) for name in dict.fromkeys((along, "zc")) if name in variables}
    if "virial" in variables:
        dims, virial, _ = variables["virial"]
        words = np.where(virial[..., 0] > 0.0, "attractive", np.where(virial[..., 0] < 0.0, "repulsive", ""))
        coords["regime"] = dims[:-1], words
    if "direction" in result.variables[RATIO].dims:
        coords["direction"] = found.table(result.variables["direction"].values[found.way], "")
    if "stable" in result:
        stable = result.variables["stable"].values.astype(bool)
        coords["stable"] = found.table(stable[found.before] & stable[found.after], False)
    coords["solved"] = found.table(solved, False)
    # a user may have chosen some harmonics, or one
    used = {str(dim) for dims, *_ in variables.values() for dim in dims}
    labels_of = {dim: result.variables[dim] for dim in COLUMN_DIMS if dim in result.coords}
    coords |= {dim: labels for dim, labels in labels_of.items() if set(labels.dims) <= used}
    if over:
        coords |= {str(name): axis for name, axis in result.coords.items() if axis.dims and set(axis.dims) <= set(over)}
    data = xr.Dataset(variables, coords, {"along": along})
    if not over:
        return data
    status = result["status"].variable
    largest = status.max([dim for dim in status.dims if dim not in over], keep_attrs=True)
    return data.assign(status=largest).assign_attrs(result.attrs)


def _kept(solved: AnyArray, result: xr.Dataset, name: str) -> AnyArray:
    """Return the columns of a quantity that a result has kept: a user may have chosen one or some of its harmonics."""
    if solved.ndim == 1:
        return solved
    (dim,) = OBSERVABLES[name].dims
    if dim not in result.coords:
        raise ParameterError(f"{name} of this result has lost its {dim}; choose a list, such as .isel({dim}=[0])")
    return np.asarray(solved[..., result.variables[dim].values - 1])


@checked
def states_meant(states: xr.Dataset) -> str:
    """Return words for the states at a set point in a result: the states of an approach, or all on the branches.

    Parameters
    ----------
    states
        A result of :func:`at_set_point`, of a sweep at a set point, or of :func:`dforce.plan`.
    """
    found = str(states.attrs.get("findings", "")).partition("\n")[0]
    if "plan_over" in states.attrs:
        return found.removeprefix("The limits apply to ").rstrip(".") or "the states that were solved"
    if "stable" in states.coords:
        return "the states on the branches"
    ways = sorted(set(np.unique(states["direction"].values.astype(str)))) if "direction" in states.coords else []
    return f"the states on {' and '.join(way for way in ways if way) or 'approach'}"


@checked
def without_states(states: xr.Dataset) -> xr.DataArray:
    """Return at which values of its parameters a result contains no state at the set point.

    Parameters
    ----------
    states
        A sweep at a set point, or a plan.

    Returns
    -------
    xarray.DataArray
        Over the parameters, and the set point of a plan: True where no curve meets the set point.

    Raises
    ------
    ParameterError
        When the result has no states at a set point.
    """
    dim = next((dim for dim in ("crossing", "state") if dim in states.dims), "")
    values = [one for one in states.data_vars.values() if dim in one.dims and one.dtype.kind == "f"]
    if not values:
        raise ParameterError("this result has no states at a set point")
    found = [one.notnull().any([d for d in one.dims if d == dim or d in COLUMN_DIMS]) for one in values]
    return (~functools.reduce(lambda one, other: one | other, found)).reset_coords(drop=True).rename("without_states")


@checked
def regime(point: xr.Dataset) -> str:
    """Return whether the force is net attractive or net repulsive in the motion at one point of a result.

    The sign of the virial of the first mode decides. At resonance this is equivalent to a phase lag above or below 90°.

    Returns
    -------
    str
        ``"attractive"``, ``"repulsive"``, or an empty text without a force.

    Raises
    ------
    ParameterError
        When the argument is not one point of a result.
    """
    if "virial" not in point.variables or point.variables["virial"].dims != ("mode",):
        raise ParameterError("point is not one point of a result; choose it with .isel")
    virial = float(point["virial"].values[0])
    return "attractive" if virial > 0.0 else "repulsive" if virial < 0.0 else ""


@dataclass(frozen=True)
class SetPointState:
    """A state at a set point, in SI, the phase lag of the first tone in degrees; NaN where the result does not keep it.

    Attributes
    ----------
    set_point, zc, direction
        The share A/A0, the average distance (m), and the direction of a curve that has several.
    peak_force, phase, max_indentation
        The result's values there.
    repels
        Whether the peak force is above its estimated error.
    regime, stable
        The words of :func:`regime`, and whether the state is stable, where the result shows it.
    """

    set_point: float
    zc: float
    peak_force: float
    phase: float
    max_indentation: float
    repels: bool
    direction: str = ""
    regime: str = ""
    stable: bool = True


SHOWN = ("peak_force", "phase", "max_indentation")


def states_at(curve: xr.Dataset, set_point: float, found: xr.Dataset | None = None) -> list[SetPointState]:
    """Return the states of one curve along the distance at a set point, of each direction the farthest first.

    `found` is a result of :func:`at_set_point` that contains them already.
    """
    if found is None:
        known = drawable(curve, goes_along(curve))
        found = _states(curve, RATIO, set_point, [name for name in (*SHOWN, *ERRORS) if name in known])
    repels = ~is_none(found, "peak_force") if "peak_force" in found else np.ones(found.sizes["crossing"], dtype=bool)
    way = found["direction"].values if "direction" in found.coords else np.zeros(found.sizes["crossing"])
    states = []
    names = [name for name in (*SHOWN, "zc") if name in found]
    words = [name for name in ("direction", "regime", "stable") if name in found.coords]
    read = {name: found.variables[name].values for name in (*names, *words)}
    for place in np.lexsort((-read["zc"], way)):
        values: dict[str, Any] = dict.fromkeys(SHOWN, np.nan)
        values |= {name: float(np.ravel(read[name][place])[0]) for name in names}
        values |= {name: read[name][place].item() for name in words}
        states.append(SetPointState(set_point, repels=bool(repels[place]), **values))
    return states


def why_none(curve: xr.Dataset, set_point: float) -> str:
    """Return why no state of a curve is at a set point, and the remedy, in two sentences."""
    ratio, status = curve[RATIO].values, curve["status"].values
    wanders = status == Status.NOT_REPEATING
    steady = ratio[repeats(status)]
    low, high = np.nanmin(steady, initial=np.inf), np.nanmax(steady, initial=-np.inf)
    share = f"{100.0 * set_point:.4g} %"
    if wanders.any() and np.nanmin(ratio[wanders]) <= set_point <= np.nanmax(ratio[wanders]):
        return (
            f"No steady state at {share}: there the motion of this curve does not repeat from period to period. Choose another "
            "set point, a larger A0 or a stiffer lever."
        )
    if np.isin(status, WITHOUT_RESULT).all():
        why = next(one for one in WITHOUT_RESULT if (status == one).any()).sentence.partition(";")[0]
        return f"No state at {share}, because no point of this curve has a result: {why}. Check the forces."
    if low > high:
        slow = (status == Status.NOT_SETTLED).any()
        change = "Raise the number of periods to settle" if slow else "Widen experiment.zc"
        return f"No state at {share}: no motion on this curve settled. {change}."
    if low < set_point < high:
        return (
            f"No state at {share}: the amplitude jumps across this set point. Choose another set point, or draw all states "
            'with experiment.kind = "branches".'
        )
    end = "stop nearer to the sample" if low >= set_point else "start farther from the sample"
    return (
        f"No state at {share}: A/A0 on this curve is {100.0 * low:.3g} to {100.0 * high:.3g} %. "
        f"Let experiment.zc {end}."
    )
