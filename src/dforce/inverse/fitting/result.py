"""A fit as a Dataset: values, errors, data, model and residuals, and all that repeats it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import repeat
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.case.paths import value_at
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError
from dforce.core.notation import first_phrase
from dforce.core.quantities import AXES, OBSERVABLES
from dforce.experiments import Approach
from dforce.findings.fits import verdict
from dforce.inverse.fitting.advice import advice_on
from dforce.inverse.fitting.certainty import known_products
from dforce.inverse.fitting.curves import wrapped
from dforce.inverse.fitting.fitted import Fitted
from dforce.inverse.fitting.independence import independence
from dforce.inverse.fitting.points import SPIKE
from dforce.inverse.fitting.sides import not_excluded
from dforce.inverse.fitting.unknowns import CASE, HEIGHT, Unknown
from dforce.inverse.quantities import FITS
from dforce.inverse.values import with_unit
from dforce.results.provenance import of_case
from dforce.validity import advice_in, attributes

if TYPE_CHECKING:
    import xarray as xr

KIND = "fit"  # of a result, in its attributes
LARGEST = 700.0  # logarithm of a number
MIDDLE = (0.1587, 0.8413)  # shares of normal numbers below one standard deviation to each side
POINTS = 201  # of the curve that the best case computes
DATA = "data_"  # before attributes of the measured curve


def to_dataset(found: Fitted, data: xr.Dataset) -> xr.Dataset:
    """Return a fit as a Dataset."""
    import xarray as xr

    best, unknowns = found.best, found.model.unknowns
    values = found.model.values(best.varied)
    variables = _of_parameters(found, values) | _of_points(found) | _of_profiles(found) | _of_bootstrap(found)
    variables["search_chi2"] = ("search", np.array([start.chi2 for start in found.starts]))
    for kind, places in (("search", found.starts), ("minimum", found.minima)):
        rows = [found.model.values(place.varied) for place in places]
        variables[f"{kind}_value"] = ((kind, "parameter"), np.array(rows).reshape(-1, len(unknowns)))
    variables["minimum_chi2"] = ("minimum", np.array([one.chi2 for one in found.minima]))
    covered = not_excluded(found.minima, found.certain)
    variables["minimum_excluded"] = ("minimum", np.array([one not in covered for one in found.minima]))
    names = [one.name for one in unknowns]
    coords = {
        "parameter": names,
        "parameter_2": names,
        "unit": ("parameter", [one.unit for one in unknowns]),
        "symbol": ("parameter", [one.symbol for one in unknowns]),
        "label": ("parameter", [first_phrase(one.doc) for one in unknowns]),
        "tone": np.arange(1, found.model.data.tones + 1),
        "branch": ("point", found.model.data.branch),
    }
    if "direction" in data.variables:
        coords["direction"] = ("point", np.asarray(data["direction"].values).astype(str))
    if found.profiles:
        coords["profiled"] = list(found.profiles)
    out = xr.Dataset(variables, coords)
    for name, variable in out.variables.items():
        row = FITS.get(str(name)) or OBSERVABLES.get(str(name)) or AXES.get(str(name))
        if row is not None and name != "branch":
            variable.attrs.update(row.words)
    out.attrs = _attributes(found, values) | {f"{DATA}{key}": value for key, value in found.model.data.attrs.items()}
    noise = independence(out)
    out.attrs |= attributes(advice_on(found, noise)) | {"independence": noise}
    if "branch" not in data.variables:
        out.attrs["branches_found"] = 1
    if found.interrupted:
        out.attrs["interrupted"] = 1
    return out


def _of_parameters(found: Fitted, values: Array) -> dict[str, Any]:
    unknowns, certain = found.model.unknowns, found.certain
    slope = np.array([one.slope(float(value)) for one, value in zip(unknowns, values, strict=True)])
    errors = certain.errors
    low, high, *interval = (np.array(ends) for ends in zip(*map(_ends, range(len(values)), repeat(found)), strict=True))
    priors = [one.prior or (math.nan, math.nan) for one in unknowns]
    start = np.array([one.start for one in unknowns])
    columns = {
        "value": values,
        "error": errors * slope,
        "error_low": values - low,
        "error_high": high - values,
        "interval_low": interval[0],
        "interval_high": interval[1],
        "error_given": found.passed * slope,
        "start": start,
        "prior": np.array([one[0] for one in priors]),
        "prior_error": np.array([one[1] for one in priors]),
        "at_bound": found.at_bound,
        "seen": certain.seen,
    }
    out: dict[str, Any] = {name: ("parameter", column) for name, column in columns.items()}
    return out | {"correlation": (("parameter", "parameter_2"), certain.correlation)}


def _ends(index: int, found: Fitted) -> list[float]:
    """Return the values at one standard deviation below and above, and at the ends of the interval of 95 %."""
    one, best, sides = found.model.unknowns[index], float(found.best.varied[index]), found.sides
    profile = found.profiles.get(one.name)
    ways = [float(side[index]) for side in sides] if profile is None else profile.ends
    return [_value(one, best + sign * way) for sign, way in zip((-1.0, 1.0, -1.0, 1.0), ways, strict=True)]


def _value(one: Unknown, varied: float) -> float:
    """Return the value of an unknown at a varied number; infinite beyond all numbers."""
    return math.inf if one.is_log and varied > LARGEST else one.value(varied)


def _of_points(found: Fitted) -> dict[str, Any]:
    model, data = found.model, found.model.data
    tones, count = data.tones, len(data.height)
    offset = model.sum_of(HEIGHT, model.values(found.best.varied))
    fitted, lost = np.full((count, 2 * tones), np.nan), np.zeros(count, bool)
    if found.best.prediction is not None:
        fitted[model.points] = found.best.prediction.values
        lost[model.points] = found.best.prediction.lost
    apart = fitted - data.values
    apart[:, tones:] = wrapped(apart[:, tones:])
    apart /= data.spread
    both = ("point", "tone")
    return {
        "height": ("point", data.height),
        "zc": ("point", data.height + offset),
        "amplitude": (both, data.amplitude),
        "phase": (both, data.phase),
        "amplitude_fit": (both, fitted[:, :tones]),
        "phase_fit": (both, fitted[:, tones:]),
        "amplitude_residual": (both, apart[:, :tones]),
        "phase_residual": (both, apart[:, tones:]),
        "used": ("point", data.used),
        "left_out": ("point", np.asarray(data.left_out)),
        "lost": ("point", lost),
    }


def _of_profiles(found: Fitted) -> dict[str, Any]:
    if not found.profiles:
        return {}
    unknowns = {one.name: one for one in found.model.unknowns}
    most = max(len(profile.varied) for profile in found.profiles.values())
    along, chi2 = np.full((len(found.profiles), most), np.nan), np.full((len(found.profiles), most), np.nan)
    for row, (name, profile) in enumerate(found.profiles.items()):
        along[row, : len(profile.varied)] = [unknowns[name].value(varied) for varied in profile.varied]
        chi2[row, : len(profile.chi2)] = profile.chi2
    return {"profile_varied": (("profiled", "step"), along), "profile_chi2": (("profiled", "step"), chi2)}


def _of_bootstrap(found: Fitted) -> dict[str, Any]:
    if found.bootstrap is None:
        return {}
    values = np.array([found.model.values(row) for row in found.bootstrap.varied])
    low, high = np.quantile(values, MIDDLE, axis=0)
    error = np.where(found.certain.seen, 0.5 * (high - low), np.nan)
    return {"bootstrap_value": (("draw", "parameter"), values), "bootstrap_error": ("parameter", error)}


def _attributes(found: Fitted, values: Array) -> dict[str, Any]:
    model, data, best = found.model, found.model.data, found.best
    count = int(found.certain.seen.sum())
    rest = model.priors(best.varied) if best.prediction is not None else np.zeros(0)
    case = best_case(found, values)
    asked = model.case.model_copy(update={"fit": found.settings})
    return (
        of_case(case, title=model.case.title)
        | {
            "kind": KIND,
            "chi2": best.chi2,
            "chi2_of_data": best.chi2 - float(rest @ rest),
            "points": int(data.used.sum()),
            "numbers": data.count,
            "parameters": count,
            "degrees_of_freedom": found.degrees_of_freedom,
            "aic": best.chi2 + 2 * count,
            "bic": best.chi2 + count * math.log(data.count),
            "lost_points": best.lost,
            "amplitude_error": data.amplitude_error.tolist(),
            "phase_error": data.phase_error.tolist(),
            "height_error": data.height_error,
            "neighbor_correlation": data.correlation,
            "inflation": found.certain.inflation,
            "interval_rises": list(found.certain.rises),
            "samples_per_period": model.curves.samples,
            "sampling_change": found.coarse,
            "evaluations": found.runs,
            "forces": " + ".join(force.name for force in model.case.forces),
            "products": "\n".join(known_products(found.certain.dead, model.unknowns)),
            "start_case": asked.to_toml(complete=True),
            "holds_for": holds_for(found),
        }
        | ({} if found.bootstrap is None else {"bootstrap_block": found.bootstrap.block})
    )


def holds_for(found: Fitted) -> str:
    """Return spring constant, Q and tip radius that the values hold for, where these are not fitted."""
    case, fitted = found.model.case, {one.path for one in found.model.unknowns if one.kind == CASE}
    modes = case.cantilever.modes
    levers = [f"cantilever.modes.{number}" for number in range(1, len(modes) + 1)] if modes else ["cantilever"]
    lever = [f"{one}.{name}" for one in levers for name in ("k", "Q")]
    paths = [path for path in (*lever, "tip.radius") if path not in fitted]
    known = [(path, value_at(case, path)) for path in paths]
    return ", ".join(
        f"{path} = {with_unit(float(value), case.quantity(path).unit)}" for path, value in known if value is not None
    )


def best_case(found: Fitted, values: Array) -> Case:
    """Return the case with the values that were found, and an approach over the measured distances."""
    model, data = found.model, found.model.data
    case = model.case.model_copy(update={"fit": None, "data": None, "sweep": None})
    for one, value in zip(model.unknowns, values, strict=True):
        if one.kind == CASE:
            case = case.replace(one.path, float(value))
    heights = data.height[data.used] + model.sum_of(HEIGHT, values)
    grid = {"start": float(heights.max()), "stop": float(heights.min()), "points": POINTS}
    return case.replace(experiment=Approach(zc=grid, direction="both"))


def together(done: Mapping[str, xr.Dataset | str], case: Case) -> xr.Dataset:
    """Return the fits of many curves as one Dataset.

    Raises
    ------
    ParameterError
        When none was fitted, with the reason of the first.
    """
    import xarray as xr

    fits = {name: one for name, one in done.items() if not isinstance(one, str)}
    if not fits:
        first = next(iter(done.values()), "there is none")
        raise ParameterError(f"none of the {len(done)} curves could be fitted: {first}")
    some = next(iter(fits.values()))

    each = [None if isinstance(one, str) else one for one in done.values()]

    def noted(name: str) -> tuple[str, list[float]]:
        return "curve", [math.nan if one is None else float(one.attrs[name]) for one in each]

    both, none = ("curve", "parameter"), np.full(some.sizes["parameter"], np.nan)
    variables: dict[str, Any] = {
        name: (both, [none if one is None else one[name].values for one in each])
        for name in ("value", "error", "error_low", "error_high", "error_given")
    }
    variables["seen"] = both, [none > 0.0 if one is None else one["seen"].values for one in each]
    variables["message"] = "curve", [one if isinstance(one, str) else "" for one in done.values()]
    variables["advised"] = "curve", [one is not None and bool(advice_in(one)) for one in each]
    variables["doubt"] = "curve", ["" if one is None else verdict(one) for one in each]
    variables |= {name: noted(name) for name in ("chi2", "degrees_of_freedom", "lost_points")}
    places = {
        name: noted(f"{DATA}{name}")
        for name in ("x", "y")
        if all(f"{DATA}{name}" in one.attrs for one in fits.values())
    }
    return xr.Dataset(
        variables,
        {"curve": list(done), "parameter": some["parameter"].values, "unit": ("parameter", some["unit"].values)}
        | places,
        of_case(case, some.attrs["start_case"]) | {"kind": "fits", "holds_for": some.attrs["holds_for"]},
    )


def data_of(result: xr.Dataset) -> xr.Dataset:
    """Return the measured curve that a fit was made of, from its result; branches that the fit found are no data."""
    import xarray as xr

    known = ("height",) if result.attrs.get("branches_found") else ("height", "branch")
    columns = {name: ("point", result[name].values) for name in known}
    if "left_out" in result:  # not in a file of an older version
        columns["spike"] = ("point", result["left_out"].values == SPIKE)
    for tone, ending in enumerate(("", "_2")[: result.sizes["tone"]]):
        for name in ("amplitude", "phase"):
            columns[f"{name}{ending}"] = ("point", result[name].values[:, tone])
    coords = {"direction": ("point", result["direction"].values)} if "direction" in result.coords else {}
    attrs = {str(key).removeprefix(DATA): value for key, value in result.attrs.items() if str(key).startswith(DATA)}
    return xr.Dataset(columns, coords, attrs)
