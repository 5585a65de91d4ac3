"""Summaries of the result of an experiment, of a sweep, and of a force along a path."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import case_of
from dforce.core.errors import DForceError
from dforce.core.notation import first_phrase
from dforce.experiments.base import SET_POINT
from dforce.findings.crossings import RATIO
from dforce.findings.finding import Finding, finding, number
from dforce.findings.jumps import Jump, jumps, jumps_of_all
from dforce.findings.set_point import SetPointState, regime, states_at
from dforce.results.curves import goes_along
from dforce.results.kinds import measured, swept
from dforce.results.significance import is_none, scaled
from dforce.results.status import WITHOUT_RESULT, Status, count_status

if TYPE_CHECKING:
    import xarray as xr


def free_amplitudes(dataset: xr.Dataset) -> list[float]:
    """Return the amplitude (m) of each tone far from the sample, from the case that a result carries."""
    try:
        free = case_of(dataset).problem.detected_free
    except DForceError:  # the case of a version that knew other keys: still worth a summary
        return []
    return [float(amplitude) for amplitude in np.abs(free)]


def _ways(dataset: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    if "direction" not in dataset.dims:
        yield "", dataset
        return
    for way in dataset["direction"].values:
        yield str(way), dataset.sel(direction=way, drop=True)


def _label(variable: xr.DataArray) -> str:
    return str(variable.attrs.get("long_name", variable.name))


def _unit(variable: xr.DataArray) -> str:
    return str(variable.attrs.get("units", "1"))


DWELL = (
    "amplitude",
    "phase",
    "frequency_shift",
    "drive_ratio",
    "mean_deflection",
    "half_peak_to_peak",
    "peak_force",
    "min_force",
    "mean_force",
    "min_distance",
    "max_indentation",
    "contact_fraction",
    "contact_time",
    "peak_velocity",
    "total_virial",
    "total_dissipated_energy",
    "power",
    "settling_periods",
)


def dwell(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the quantities of a motion at one distance."""
    dataset = _with_scales(dataset)
    yield finding("zc", "average distance", float(dataset["zc"]), "m")
    for name in (name for name in DWELL if name in dataset):
        variable = dataset[name]
        if "tone" not in variable.dims:
            none = bool(is_none(dataset, name))
            yield finding(name, _label(variable), float(variable), _unit(variable), none=none)
            continue
        for tone in variable["tone"].values:
            several = variable.sizes["tone"] > 1
            label = f"{_label(variable)}, tone {tone}" if several else _label(variable)
            key = f"{name}_tone{tone}"
            yield finding(key, label, float(variable.sel(tone=tone)), _unit(variable))


EXTREMES = (
    ("peak_force", "largest peak force"),
    ("min_force", "lowest force"),
    ("max_indentation", "deepest indentation"),
    ("contact_fraction", "longest contact"),
    ("total_dissipated_energy", "most dissipated energy"),
)


def approach(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give amplitude, phase, jumps and extremes of each direction."""
    for way, one in _ways(_with_scales(dataset)):
        yield from _curve(one, "zc", way)
    yield from _at_set_points(dataset)


def frequency_sweep(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the resonance and the other findings of each direction."""
    for way, one in _ways(_with_scales(dataset)):
        yield _peak(one, way)
        yield from _curve(one, "frequency", way)


def _curve(sweep: xr.Dataset, name_along: str, way: str) -> Iterator[Finding]:
    along = sweep[name_along]
    free = free_amplitudes(sweep)
    for index, tone in enumerate(sweep["tone"].values if "tone" in sweep else ()):
        one, shown = sweep.sel(tone=tone), measured(sweep, index)
        tag = f", tone {tone}" if sweep.sizes["tone"] > 1 else ""
        if index < len(free):
            label = "amplitude set point" if "amplitude" not in shown else "free amplitude"
            yield finding(f"free_amplitude_tone{tone}", label + tag, free[index], "m", way)
        for name in shown:
            if name in sweep:  # one case of a sweep may keep none
                yield _range(one[name], f"{name}_tone{tone}", _label(sweep[name]) + tag, way)
    if name_along in sweep.dims and ("amplitude" in sweep or "amplitude_ratio" in sweep):
        found = jumps(sweep, way)
        texts = [f"{number(jump.at, _unit(along), str(along.name))}{_change(sweep, jump)}" for jump in found[:3]]
        texts += [f"{len(found) - 3} more"] if len(found) > 3 else []
        yield Finding("jumps", "jumps", "; ".join(texts) or "none", [jump.at for jump in found], _unit(along), way)
    for name, label in EXTREMES:
        if name in sweep and np.isfinite(sweep[name].values).any():
            values = sweep[name].values
            index = int(np.nanargmin(values) if name == "min_force" else np.nanargmax(values))
            place, none = (
                f" at {number(float(along[index]), _unit(along), str(along.name))}",
                bool(is_none(sweep, name)[index]),
            )
            yield finding(name, label, float(values[index]), _unit(sweep[name]), way, place, none)
    if "status" in sweep:  # states at a set point have none
        yield _points(sweep, way)


def _change(sweep: xr.Dataset, jump: Jump) -> str:
    """Return how the phase changes in a jump, where it is known."""
    if "phase" not in sweep:
        return ""
    lag = sweep["phase"].isel(tone=0).values
    return f" ({lag[jump.before]:.0f}° to {lag[jump.after]:.0f}°)"


def _peak(sweep: xr.Dataset, way: str) -> Finding:
    amplitude = sweep["amplitude"].isel(tone=0).values
    if not np.isfinite(amplitude).any():
        return Finding("resonance", "resonance", "-", None, "Hz", way)
    is_held = "amplitude" not in measured(sweep)
    index = int(np.nanargmin(sweep["drive_force"].isel(tone=0)) if is_held else np.nanargmax(amplitude))
    at, ends = float(sweep["frequency"][index]), sweep["frequency"].values[np.isfinite(amplitude)][[0, -1]]
    height = number(float(amplitude[index]), "m")
    if at not in ends:
        return finding("resonance", "resonance", at, "Hz", way, f" ({height})")
    side = "above" if at == ends.max() else "below"  # the sweep ends before it
    text = f"{side} {number(at, 'Hz', 'frequency')} ({height} there)"
    return Finding("resonance", "resonance", text, None, "Hz", way)


def sweep(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the parameters of a each, then the extremes over all its cases, with the case in which they are met."""
    over = swept(dataset)
    for name in over:
        yield _values_of(dataset[name])
    cases = math.prod(dataset.sizes[name] for name in over)
    yield Finding("cases", "cases", str(cases), float(cases), "1")
    if "crossing" in dataset.dims:
        yield set_point_not_met(dataset)
    along = goes_along(dataset)
    for way, each in _ways(dataset):
        for name in ("amplitude", "phase"):
            for tone in each["tone"].values if name in each else ():
                tag = f", tone {tone}" if each.sizes["tone"] > 1 else ""
                yield _range(each[name].sel(tone=tone), f"{name}_tone{tone}", _label(each[name]) + tag, way)
        if along in each.dims and "crossing" not in each.dims and ("amplitude" in each or "amplitude_ratio" in each):
            count = sum(bool(found) for _, _, found in jumps_of_all(each, along, way))
            yield Finding("jumps", "curves with jumps", f"{count} of {cases}", float(count), "1", way)
        for name, label in EXTREMES:
            if name in each and np.isfinite(each[name].values).any():
                where = each[name].argmin(...) if name == "min_force" else each[name].argmax(...)
                found = each[name].isel(where)
                place = ", ".join(f"{dim} = {_one(each[dim][at])}" for dim, at in where.items())
                none = bool(is_none(_with_scales(each.isel(where)), name))
                yield finding(name, label, float(found), _unit(found), way, f" at {place}", none)
        yield _points(each, way)


def set_point_not_met(dataset: xr.Dataset) -> Finding:
    """Name the cases of a sweep whose curves do not meet its set point."""
    over = swept(dataset)
    met = dataset["zc"].notnull().any("crossing") | (dataset["status"] == Status.NOT_COMPUTED)
    places = np.argwhere(~met.transpose(*over).values)
    texts = [
        ", ".join(f"{dim} = {_one(dataset[dim][i])}" for dim, i in zip(over, at, strict=True)) for at in places[:3]
    ]
    texts += [f"{len(places) - 3} more"] if len(places) > 3 else []
    return Finding("not_met", "set point not met", "; ".join(texts) or "none", float(len(places)), "1")


def _set_points(dataset: xr.Dataset) -> tuple[float, ...]:
    """Return the set points whose states a curve along the distance is to show."""
    try:
        return getattr(case_of(dataset).experiment, "set_point", ())
    except DForceError:  # the case of a version that knew other keys
        return (SET_POINT,)


def states_of(curve: xr.Dataset) -> dict[float, list[SetPointState]]:
    """Return the states of a curve along the distance at each set point of its case; nothing for another result."""
    along = "zc_ratio" if "zc_ratio" in curve.dims else "zc"
    if (
        swept(curve)
        or "crossing" in curve.dims
        or goes_along(curve) != along
        or RATIO not in curve
        or "status" not in curve
    ):
        return {}
    return {share: states_at(curve, share) for share in _set_points(curve)}


def _at_set_points(curve: xr.Dataset) -> Iterator[Finding]:
    """Give the peak force of each state at the set points of the case."""
    for share, found in states_of(curve).items():
        for way, states in itertools.groupby(found, lambda state: state.direction):
            for count, state in enumerate(states, start=1):
                which = f", state {count}" if count > 1 else ""
                more = [f" at {number(state.zc, 'm')}", f"{state.phase:.0f}°", "" if state.stable else "unstable"]
                force = number(state.peak_force, "N", none=not state.repels)
                yield Finding(
                    "at_set_point",
                    f"peak force at {100.0 * share:.4g} %{which}",
                    force + ", ".join(filter(None, more)),
                    state.peak_force if math.isfinite(state.peak_force) else None,
                    "N",
                    way,
                )


def _with_scales(dataset: xr.Dataset) -> xr.Dataset:
    """Return the result of one case with the scales of its errors; as it is where its case cannot be read."""
    try:
        return scaled(dataset, case_of(dataset).problem)
    except DForceError:  # the case of a version that knew other keys: still worth a summary
        return dataset


def _values_of(axis: xr.DataArray) -> Finding:
    """Return the values of a parameter, of many the first and the last."""
    few = axis.size <= 3
    text = ", ".join(_one(value) for value in axis) if few else f"{_one(axis[0])} ... {_one(axis[-1])}"
    numbers = [float(value) for value in axis.values] if axis.dtype.kind in "fi" else None
    return Finding(str(axis.name), str(axis.name), text + (f" ({axis.size} values)" * (not few)), numbers, _unit(axis))


def _one(value: xr.DataArray) -> str:
    return number(float(value), _unit(value), str(value.name)) if value.dtype.kind == "f" else str(value.item())


SPECIALS = (
    ("fold", "folds"),
    ("period_doubling", "period doublings"),
    ("torus", "tori"),
    ("grazing", "grazing"),
    ("end", "curves end"),
)


def basins(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give each state, the largest share of starts first, and the starts that lead to no state."""
    yield finding("zc", "average distance", float(dataset["zc"]), "m")
    for state in dataset["state"].values:
        one = dataset.sel(state=state).isel(tone=0)
        amplitude, phase = float(one["amplitude"]), float(one["phase"])
        about = f" of the starts, to {number(amplitude, 'm')} and {number(phase, 'degree')}"
        word = regime(one) if "virial" in one else ""
        label = f"state {state}{f', {word}' if word else ''}"
        yield finding("share", label, float(one["share"]), "1", more=about)
    lost = int((dataset["reached"] == 0).sum())
    if lost:
        yield Finding("lost", "starts that lead to none", str(lost), float(lost), "1")


WORDS = {
    Status.NOT_SETTLED: "not settled",
    Status.NOT_REPEATING: "not repeating",
    Status.FAILED: "failed",
    Status.UNRESOLVED: "unresolved",
    Status.INACCURATE: "inaccurate",
    Status.BROKEN: "ended with an error",
    Status.NO_STATE: "without a state",
}
STABLE = {"amplitude": "stable amplitudes", "phase": "stable phase lags"}


def branches(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the range of all states, their special points, and whether any is missing."""
    dataset = _with_scales(dataset)
    along = dataset[str(dataset.attrs["along"])]
    yield _range(along, str(along.name), first_phrase(_label(along)), "")
    if dataset["zc"].ndim == 0:
        yield finding("zc", "average distance", float(dataset["zc"]), "m")
    curves = len(np.unique(dataset["branch"].values))
    yield Finding("curves", "connected curves", str(curves), float(curves), "1")
    for tone in dataset["tone"].values if "amplitude" in dataset else ():
        tag = f", tone {tone}" if dataset.sizes["tone"] > 1 else ""
        stable = dataset.isel(point=np.flatnonzero(dataset["stable"].values)).sel(tone=tone)
        for name in measured(dataset):
            yield _range(
                stable[name], f"{name}_tone{tone}", STABLE.get(name, f"stable {_label(stable[name])}") + tag, ""
            )
    several = dataset["repeat_periods"].values if "repeat_periods" in dataset else np.empty(0)
    for periods in np.unique(several)[1:]:
        of_them = dataset.isel(point=np.flatnonzero(several == periods))
        yield _range(of_them[str(along.name)], f"repeats_{periods}", f"states that repeat after {periods} periods", "")
    for name, label in SPECIALS:
        places = [float(value) for value in along.values[dataset["special"].values == name]]
        if places or name == "fold":
            text = ", ".join(number(value, _unit(along), str(along.name)) for value in places[:5]) or "none"
            more = f", {len(places) - 5} more" if len(places) > 5 else ""
            yield Finding(name, label, text + more, places, _unit(along))
    if "completeness" in dataset.attrs:
        said = str(dataset.attrs["completeness"])
        proven = "index_sum" in dataset and not said.startswith("not ")
        closed = float((dataset["index_sum"].values == 1).mean()) if proven else None
        yield Finding("completeness", "completeness", said, closed, "1")
    yield _points(dataset, "")
    yield from _at_set_points(dataset)


def _range(variable: xr.DataArray, name: str, label: str, way: str) -> Finding:
    values = variable.values[np.isfinite(variable.values)]
    if not values.size:
        return Finding(name, label, "-", None, _unit(variable), way)
    ends: list[float] = [float(values.min()), float(values.max())]
    size = max(map(abs, ends))  # both ends in one unit
    text = " to ".join(dict.fromkeys(number(end, _unit(variable), name, size=size) for end in ends))
    return Finding(name, label, text, ends, _unit(variable), way)


def _points(sweep: xr.Dataset, way: str) -> Finding:
    counted = count_status(sweep)
    total = sum(counted.values())
    computed = total - sum(counted.get(status, 0) for status in (Status.NOT_COMPUTED, Status.BROKEN, *WITHOUT_RESULT))
    words = [str(computed) if computed == total else f"{computed} of {total}"]
    words += [f"{counted[status]} {word}" for status, word in WORDS.items() if status in counted]
    return Finding("points", "points", ", ".join(words), float(computed), "1", way)


def force_curve(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the extremes of a force along a path, and the energy that it took."""
    for way, one in _ways(_with_scales(dataset)):
        yield from _force(one, way)


def _force(sweep: xr.Dataset, way: str) -> Iterator[Finding]:
    force, distance = sweep["force"].values, sweep["distance"].values
    for name, label, chosen in (
        ("min_force", "lowest force", np.nanargmin),
        ("peak_force", "largest force", np.nanargmax),
    ):
        index: Any = chosen(force) if np.isfinite(force).any() else 0
        place = f" at {number(float(distance[index]), 'm', 'distance')}" if abs(force[index]) > 0.0 else ""
        yield finding(name, label, float(force[index]), "N", way, place)
    if "energy" in sweep and way != "approach":  # it is known once the tip is back
        last = sweep.isel(time=-1) if "time" in sweep.dims else sweep
        none = bool(is_none(last, "energy"))
        yield finding("energy", "dissipated energy", float(last["energy"]), "J", way, none=none)
