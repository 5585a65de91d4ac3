"""Results over parameters: quantities, parameters, places, and a limit drawn across the lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr

from dforce.core.arrays import Array, Bools
from dforce.core.quantities import AMOUNTS
from dforce.core.units import parse
from dforce.findings.set_point import states_meant, without_states
from dforce.gui.curves.chart import title, unit_of
from dforce.gui.curves.figures import Figure
from dforce.results.dataset import COLUMN_DIMS, reader_unit
from dforce.results.kinds import kind_of
from dforce.results.significance import is_none

OVER = ("over", "plan_over", "map_over")  # attributes that name the parameters of a result
STATES = ("crossing", "state")  # dimensions of the states at one setting
FIRST = (  # asked for first; the window folds the others
    "limit_hit",
    "peak_force",
    "min_force",
    "max_indentation",
    "contact_time",
    "amplitude",
    "phase",
    "total_dissipated_energy",
    "mean_force",
    "zc",
)
WORDS = {"limit_hit": "which limit fails", "regime": "regime"}  # quantities that are words
LEFT_OUT = ("status", "motion", "component")
MOST = 300  # values along an axis that are drawn; of more some are left out
EVEN = 1e-6
MOST_BYTES = 20_000_000  # of a quantity that is read for a sentence


@dataclass(frozen=True)
class Choice:
    """The view chosen: a quantity along `x`, and along `y` unless that is empty, at places along other dimensions."""

    quantity: str = ""
    x: str = ""
    y: str = ""
    places: Mapping[str, int] = field(default_factory=dict)


def paths_of(result: xr.Dataset) -> dict[str, str]:
    """Return the paths of the parameters of a result, by their dimensions; none for a result of one case."""
    names = next((str(result.attrs[key]).split() for key in OVER if result.attrs.get(key)), [])
    pairs = ((name, path) for path in names for name in (path, path.rpartition(".")[2]))
    return {name: path for name, path in pairs if name in result.dims}


def is_explorable(result: xr.Dataset) -> bool:
    """Return whether a result goes over parameters, so that it is looked at along them."""
    kind = kind_of(result)
    return kind is not None and kind.panel in ("curves", "parameters") and bool(paths_of(result))


def quantities(result: xr.Dataset) -> list[str]:
    """Return the quantities that can be looked at, the most useful first."""
    kinds = {name: variable.dtype.kind for name, variable in result.variables.items()}
    numbers = [str(name) for name in (*result.data_vars, "zc") if kinds.get(name) == "f" and name not in result.dims]
    without = {"limit_hit"} if result.attrs.get("limits") == "" else set()  # of a plan
    words = [name for name in WORDS if name in result.variables and name not in without]
    names = [name for name in dict.fromkeys([*FIRST, *words, *numbers]) if name in (*numbers, *words)]
    fewest = dict.fromkeys(words, 2)  # words are drawn as colors of a map, numbers as lines as well
    return [name for name in names if name not in LEFT_OUT and len(axes_of(result, name)) >= fewest.get(name, 1)]


def axes_of(result: xr.Dataset, quantity: str) -> list[str]:
    """Return the dimensions along which a quantity can be drawn, the parameters first."""
    dims = [str(dim) for dim in result[quantity].dims if dim not in (*COLUMN_DIMS, *STATES)]
    numbers = [dim for dim in dims if dim in result.coords and result[dim].dtype.kind == "f" and result.sizes[dim] > 1]
    return sorted(numbers, key=lambda dim: dim not in paths_of(result))


def fitting(result: xr.Dataset, wanted: Choice) -> Choice:
    """Return a choice that a result has, as near as possible to a wanted choice.

    Raises
    ------
    ValueError
        When there is nothing to look at.
    """
    names = quantities(result)
    if not names:
        raise ValueError("no quantity along a parameter")
    quantity = wanted.quantity if wanted.quantity in names else names[0]
    axes = axes_of(result, quantity)
    x = wanted.x if wanted.x in axes else axes[0]
    others = [axis for axis in axes if axis != x]
    y = wanted.y if wanted.y in others or (wanted.y == "" and wanted.quantity) else next(iter(others), "")
    if quantity in WORDS and others and not y:
        y = others[0]
    rest = sliced(result, Choice(quantity, x, y))
    places = {dim: min(max(wanted.places.get(dim, _first(result, dim)), 0), result.sizes[dim] - 1) for dim in rest}
    return Choice(quantity, x, y, places)


def _first(result: xr.Dataset, dim: str) -> int:
    """Return the place along a dimension that is looked at first: of numbers that in the middle."""
    return result.sizes[dim] // 2 if dim in result.coords and result[dim].dtype.kind == "f" else 0


def sliced(result: xr.Dataset, choice: Choice) -> list[str]:
    """Return the dimensions along which one place is looked at; lines and limits show all states."""
    dims = [str(dim) for dim in result[choice.quantity].dims]
    all_states = not choice.y or choice.quantity == "limit_hit"
    return [dim for dim in dims if dim not in (choice.x, choice.y) and not (all_states and dim in STATES)]


def places_of(result: xr.Dataset, dim: str) -> list[str]:
    """Return the places along a dimension in words."""
    if dim not in result.coords:
        return [str(number + 1) for number in range(result.sizes[dim])]
    axis = result[dim]
    if axis.dtype.kind != "f":
        return [str(value) for value in axis.values]
    scale, unit = unit_of(axis)
    return [with_unit(f"{value / scale:.5g}", unit) for value in axis.values]


def with_unit(number: str, unit: str) -> str:
    """Return a number with its unit, if it has one."""
    return number if unit == "1" else f"{number} {unit}"


def label_of(result: xr.Dataset, name: str) -> str:
    """Return a quantity or a dimension in words."""
    words = str(result[name].attrs.get("long_name", "")) if name in result.variables else ""
    return WORDS.get(name) or words.partition(";")[0] or name.replace("_", " ")


def cut(result: xr.Dataset, name: str, choice: Choice) -> xr.DataArray:
    """Return a variable at the places of a choice, with no more values than are drawn; 0 where it is below its error."""
    steps = {dim: slice(None, None, -(-result.sizes[dim] // MOST)) for dim in (choice.x, choice.y) if dim}

    def part(one: str) -> xr.DataArray:
        variable = result[one].reset_coords(drop=True)
        at = {dim: place for dim, place in choice.places.items() if dim in variable.dims}
        return variable.isel(at | {dim: step for dim, step in steps.items() if dim in variable.dims})

    variable = part(name)
    if name not in AMOUNTS:
        return variable
    unit, dims = result[name].attrs.get("units"), {*result[name].dims}
    beside = [one for one in AMOUNTS if one in result and result[one].attrs.get("units") == unit]
    errors = [one for one in ("error_estimate", *beside) if one in result and {*result[one].dims} <= dims]
    none = is_none(xr.Dataset({one: part(one) for one in {*errors, name}}), name)
    return variable.copy(data=np.where(none, 0.0, variable.values))


def axis_of(result: xr.Dataset, dim: str) -> tuple[Array, Figure]:
    """Return the values along a dimension as they are shown, and the axis."""
    step = -(-result.sizes[dim] // MOST)
    scale, unit = unit_of(result[dim])
    values = np.asarray(result[dim].values[::step], dtype=float) / scale
    words = result[dim].assign_attrs(long_name=label_of(result, dim))
    axis: Figure = {"title": {"text": title(words, unit)}}
    if len(values) > 2 and (values > 0.0).all() and np.ptp(np.diff(np.log(values))) < EVEN:
        axis |= {"type": "log", "tickformat": "~g"}  # numbers in full: of 0.3 Plotly writes the digit alone
    return values, axis


def picked(result: xr.Dataset, choice: Choice, x: float, y: float) -> Choice:
    """Return a choice with the places of a clicked point, in shown units."""
    places = dict(choice.places)
    for dim, value in ((choice.x, x), (choice.y, y)):
        if dim:
            shown = result[dim].values / unit_of(result[dim])[0]
            places[dim] = int(np.argmin(np.abs(shown - value)))
    return replace(choice, places=places)


def settings_at(result: xr.Dataset, choice: Choice) -> dict[str, tuple[float, str]]:
    """Return the parameters and the set point of a clicked point with their SI units, by path."""
    known = paths_of(result) | ({"set_point": "set_point"} if "set_point" in result.dims else {})
    return {
        path: (float(result[dim].values[choice.places[dim]]), str(result[dim].attrs.get("units", "1")))
        for dim, path in known.items()
        if dim in choice.places and result[dim].dtype.kind == "f"
    }


def gaps_of(result: xr.Dataset, quantity: str) -> str:
    """Return a sentence on the parameter values without a state; empty where every value has one.

    Empty for a large result, such as a store: only its shown part is read.
    """
    name = quantity if quantity in result.data_vars and result[quantity].dtype.kind == "f" else "peak_force"
    if name not in result.data_vars or not set(STATES) & {*result[name].dims} or result[name].nbytes > MOST_BYTES:
        return ""
    if not paths_of(result):
        return ""
    missing = without_states(result[[name]])
    count, several = int(missing.sum()), [str(dim) for dim in missing.dims if missing.sizes[dim] > 1]
    if not count:
        return ""
    dim = several[0] if several else str(missing.dims[0])
    words, others = places_of(result, dim), several[1:]
    if not others:
        flat = missing.any([other for other in missing.dims if other != dim]).values
        return f"No state meets the set point at these values of {label_of(result, dim)}: {_runs(flat, words)}."
    if len(others) > 1:
        return f"No state meets the set point at {count} of {missing.size} settings."
    (other,) = others
    rows = missing.any([one for one in missing.dims if one not in (dim, other)]).transpose(other, dim).values
    said = [
        f"{label_of(result, other)} {place}: {_runs(rows[number], words)}"
        for number, place in enumerate(places_of(result, other))
        if rows[number].any()
    ]
    return f"No state meets the set point at these values of {label_of(result, dim)}: {'; '.join(said)}."


def _runs(there: Bools, words: Sequence[str]) -> str:
    """Return the places along a dimension where something is true, in words, as ranges."""
    places = np.flatnonzero(there)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    return ", ".join(words[run[0]] if len(run) == 1 else f"{words[run[0]]} to {words[run[-1]]}" for run in runs)


def words_of(settings: Mapping[str, tuple[float, str]], labels: Mapping[str, str]) -> str:
    """Return settings in words."""
    found = []
    for path, (value, unit) in settings.items():
        scale, name = reader_unit(xr.DataArray([value], name=path, attrs={"units": unit}))
        found.append(f"{labels.get(path, path)} {with_unit(f'{value / scale:.4g}', name)}")
    return ", ".join(found)


@dataclass(frozen=True)
class DrawnLimit:
    """A limit of the quantity (SI), and whether the allowed values lie above it."""

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
    return with_unit(f"{limit.value / scale:.4g}", unit)


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
    # the findings of a plan begin with its states
    meant = "" if "plan_over" in result.attrs else f", for {states_meant(result)}"
    variable = cut(result, choice.quantity, choice)
    values = variable.transpose(choice.x, ...).values.reshape(variable.sizes[choice.x], -1)
    there = np.isfinite(values).any(axis=1)
    with np.errstate(invalid="ignore"):
        fails = (values < limit.value if limit.above else values > limit.value).any(axis=1)
    holds = there & ~fails
    if not holds.any():
        return f"The limit holds nowhere here{meant}."
    x, _ = axis_of(result, choice.x)
    unit = unit_of(result[choice.x])[1]
    words = [with_unit(f"{value:.4g}", unit) for value in x]
    return f"The limit holds at {label_of(result, choice.x)} {_runs(holds, words)}{meant}."
