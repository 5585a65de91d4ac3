"""What a result holds in a few lines: the numbers that a reader looks for first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.errors import DForceError
from dforce.results import Status, unit_for

if TYPE_CHECKING:
    import xarray as xr

DIGITS = 5
LEAST = 0.001
JUMP = 0.1  # smallest jump that is reported, as a share of the free (or largest) amplitude


@dataclass(frozen=True)
class Finding:
    """A line of a summary: what it is, as text for a reader and as an SI number for a machine."""

    name: str
    label: str
    text: str
    value: float | list[float] | None
    unit: str
    direction: str = ""


@dataclass(frozen=True)
class Jump:
    """A sudden change of the first tone's motion from one distance (or frequency) to the next, in order of travel."""

    at: float
    phase_before: float
    phase_after: float


def summary(dataset: xr.Dataset) -> list[Finding]:
    """Return what a reader looks for first in the result of any experiment."""
    if "point" in dataset.dims:
        return list(_branches(dataset))
    if "reached" in dataset:
        return list(_basins(dataset))
    if "zc" not in dataset.coords:
        return [finding for way, sweep in _ways(dataset) for finding in _force_curve(sweep, way)]
    if _along(dataset) == "frequency":
        return [finding for way, sweep in _ways(dataset) for finding in (_peak(sweep, way), *_curve(sweep, way))]
    if dataset["zc"].ndim == 0:
        return list(_dwell(dataset))
    return [finding for way, sweep in _ways(dataset) for finding in _curve(sweep, way)]


def _along(dataset: xr.Dataset) -> str:
    """Return what a curve goes along: the distance or the frequency."""
    swept = "frequency" in dataset.dims and "amplitude" in dataset and "frequency" in dataset["amplitude"].dims
    return "frequency" if swept else "zc"


def count_status(dataset: xr.Dataset) -> dict[Status, int]:
    """Return how many points have each status; a status that no point has is left out."""
    values = np.ravel(dataset["status"].values) if "status" in dataset else np.array([])
    return {status: int(np.sum(values == status)) for status in Status if np.any(values == status)}


def number(value: float, unit: str, name: str = "") -> str:
    """Return an SI number as a reader likes it: ``217.99 pN``, ``54.204°``, ``10.4 %``."""
    if not np.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    scale, shown = unit_for(abs(value), unit, name)
    suffix = "" if shown == "1" else shown if shown == "°" else f" {shown}"
    if abs(value) < LEAST * scale and unit != "1":  # below the smallest unit that anyone uses
        return f"< {LEAST}{suffix}"
    return f"{value / scale:.{DIGITS}g}{suffix}"


def free_amplitudes(dataset: xr.Dataset) -> list[float]:
    """Return the amplitude (m) of each tone far from the sample, from the case that a result carries."""
    from dforce.case import Case

    try:
        free = Case.from_toml(str(dataset.attrs.get("case", ""))).problem.free
    except DForceError:  # the case of a version that knew other keys: still worth a summary
        return []
    return [float(amplitude) for amplitude in np.abs(free.sum(axis=1))]


def jumps(sweep: xr.Dataset, direction: str = "") -> list[Jump]:
    """Return the jumps of a curve over distance or frequency in one direction.

    Where orbits were followed, or jumps noted, those that were noted on the way count. Else a jump is a step of the first
    tone's complex amplitude of at least a tenth of the largest amplitude, three times larger than the steps before and
    after it and twice the median step: a coarse grid shows none.
    """
    along = _along(sweep)
    rising = np.argsort(sweep[along].values)
    order = rising if direction in ("retract", "up") else rising[::-1]
    first = sweep.isel({along: order, "tone": 0})
    x, amplitude, phase = first[along].values, first["amplitude"].values, first["phase"].values
    there = np.isfinite(amplitude) & np.isfinite(phase)
    x, amplitude, phase = x[there], amplitude[there], phase[there]
    if along == "zc" and ("corrections" in sweep or "jump_zc" in sweep):
        return list(_noted(sweep, direction, x, phase))
    if len(x) < 5:
        return []
    steps = np.abs(np.diff(amplitude * np.exp(-1j * np.radians(phase))))
    beside = np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
    large = (steps > JUMP * amplitude.max()) & (steps > 3.0 * beside) & (steps > 2.0 * np.median(steps))
    return [Jump(float(x[i + 1]), float(phase[i]), float(phase[i + 1])) for i in np.flatnonzero(large)]


def _noted(sweep: xr.Dataset, direction: str, x: np.ndarray[Any, Any], phase: np.ndarray[Any, Any]) -> Iterator[Jump]:
    """Give the jumps noted in a result that belong to a direction, with the phases at the points on either side."""
    if "jump_zc" not in sweep:
        return
    for at, way in zip(sweep["jump_zc"].values, sweep["jump_direction"].values, strict=True):
        after = int(np.argmax((x <= at) if way == "approach" else (x >= at)))
        if direction in ("", way) and after > 0:
            yield Jump(float(at), float(phase[after - 1]), float(phase[after]))


def _ways(dataset: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    if "direction" not in dataset.dims:
        yield "", dataset
        return
    for way in dataset["direction"].values:
        yield str(way), dataset.sel(direction=way, drop=True)


def _finding(name: str, label: str, value: float, unit: str, way: str = "", more: str = "") -> Finding:
    text = number(value, unit, name) + more
    return Finding(name, label, text, value if np.isfinite(value) else None, unit, way)


def _label(variable: xr.DataArray) -> str:
    return str(variable.attrs.get("long_name", variable.name))


def _unit(variable: xr.DataArray) -> str:
    return str(variable.attrs.get("units", "1"))


DWELL = (
    "amplitude", "phase", "mean_deflection", "half_peak_to_peak", "peak_force", "min_force",
    "mean_force", "min_distance", "max_indentation", "contact_fraction", "contact_time", "peak_velocity",
    "total_virial", "total_dissipated_energy", "power", "settling_periods",
)  # fmt: skip


def _dwell(dataset: xr.Dataset) -> Iterator[Finding]:
    yield _finding("zc", "average distance", float(dataset["zc"]), "m")
    for name in (name for name in DWELL if name in dataset):
        variable = dataset[name]
        if "tone" not in variable.dims:
            yield _finding(name, _label(variable), float(variable), _unit(variable))
            continue
        for tone in variable["tone"].values:
            several = variable.sizes["tone"] > 1
            label = f"{_label(variable)}, tone {tone}" if several else _label(variable)
            key = f"{name}_tone{tone}"
            yield _finding(key, label, float(variable.sel(tone=tone)), _unit(variable))


EXTREMES = (
    ("peak_force", "largest peak force"),
    ("min_force", "lowest force"),
    ("max_indentation", "deepest indentation"),
    ("contact_fraction", "longest contact"),
    ("total_dissipated_energy", "most dissipated energy"),
)


def _curve(sweep: xr.Dataset, way: str) -> Iterator[Finding]:
    along = sweep[_along(sweep)]
    free = free_amplitudes(sweep)
    for index, tone in enumerate(sweep["tone"].values):
        one = sweep.sel(tone=tone)
        tag = f", tone {tone}" if sweep.sizes["tone"] > 1 else ""
        if index < len(free):
            yield _finding(f"free_amplitude_tone{tone}", f"free amplitude{tag}", free[index], "m", way)
        for name, label in (("amplitude", "amplitude"), ("phase", "phase lag")):
            yield _range(one[name], f"{name}_tone{tone}", label + tag, way)
    found = jumps(sweep, way)
    texts = [
        f"{number(jump.at, _unit(along))} ({jump.phase_before:.0f}° to {jump.phase_after:.0f}°)" for jump in found[:3]
    ] + ([f"{len(found) - 3} more"] if len(found) > 3 else [])
    yield Finding("jumps", "jumps", "; ".join(texts) or "none", [jump.at for jump in found], _unit(along), way)
    for name, label in EXTREMES:
        if name in sweep and np.isfinite(sweep[name].values).any():
            values = sweep[name].values
            index = int(np.nanargmin(values) if name == "min_force" else np.nanargmax(values))
            place = f" at {number(float(along[index]), _unit(along))}" if values[index] else ""
            yield _finding(name, label, float(values[index]), _unit(sweep[name]), way, place)
    yield _points(sweep, way)


def _peak(sweep: xr.Dataset, way: str) -> Finding:
    amplitude = sweep["amplitude"].isel(tone=0).values
    if not np.isfinite(amplitude).any():
        return Finding("resonance", "resonance", "-", None, "Hz", way)
    index = int(np.nanargmax(amplitude))
    more = f" ({number(float(amplitude[index]), 'm')})"
    return _finding("resonance", "resonance", float(sweep["frequency"][index]), "Hz", way, more)


SPECIALS = (
    ("fold", "folds"), ("period_doubling", "period doublings"), ("torus", "tori"), ("grazing", "grazing"),
    ("end", "curves end"),
)  # fmt: skip


def _basins(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give each state, the one that most starts lead to first, and the starts that lead to none."""
    yield _finding("zc", "average distance", float(dataset["zc"]), "m")
    for state in dataset["state"].values:
        one = dataset.sel(state=state).isel(tone=0)
        amplitude, phase = float(one["amplitude"]), float(one["phase"])
        about = f" of the starts, to {number(amplitude, 'm')} and {number(phase, 'degree')}"
        yield _finding("share", f"state {state}", float(one["share"]), "1", more=about)
    lost = int((dataset["reached"] == 0).sum())
    if lost:
        yield Finding("lost", "starts that lead to none", str(lost), float(lost), "1")


def _branches(dataset: xr.Dataset) -> Iterator[Finding]:
    along = dataset[str(dataset.attrs["along"])]
    yield _range(along, str(along.name), _label(along), "")
    if dataset["zc"].ndim == 0:
        yield _finding("zc", "average distance", float(dataset["zc"]), "m")
    curves = len(np.unique(dataset["branch"].values))
    yield Finding("curves", "connected curves", str(curves), float(curves), "1")
    for tone in dataset["tone"].values if "amplitude" in dataset else ():
        tag = f", tone {tone}" if dataset.sizes["tone"] > 1 else ""
        stable = dataset.isel(point=np.flatnonzero(dataset["stable"].values)).sel(tone=tone)
        for name, label in (("amplitude", "stable amplitudes"), ("phase", "stable phase lags")):
            yield _range(stable[name], f"{name}_tone{tone}", label + tag, "")
    for name, label in SPECIALS:
        places = [float(value) for value in along.values[dataset["special"].values == name]]
        if places or name == "fold":
            text = ", ".join(number(value, _unit(along)) for value in places[:5]) or "none"
            more = f", {len(places) - 5} more" if len(places) > 5 else ""
            yield Finding(name, label, text + more, places, _unit(along))
    yield _points(dataset, "")


def _range(variable: xr.DataArray, name: str, label: str, way: str) -> Finding:
    values = variable.values[np.isfinite(variable.values)]
    if not values.size:
        return Finding(name, label, "-", None, _unit(variable), way)
    ends: list[float] = [float(values.min()), float(values.max())]
    text = " to ".join(number(end, _unit(variable)) for end in ends)
    return Finding(name, label, text, ends, _unit(variable), way)


def _points(sweep: xr.Dataset, way: str) -> Finding:
    counted = count_status(sweep)
    total = sum(counted.values())
    computed = total - counted.get(Status.NOT_COMPUTED, 0) - counted.get(Status.FAILED, 0)
    words = [str(computed) if computed == total else f"{computed} of {total}"]
    words += [
        f"{counted[status]} {word}"
        for status, word in ((Status.NOT_SETTLED, "not settled"), (Status.FAILED, "failed"))
        if status in counted
    ]
    return Finding("points", "points", ", ".join(words), float(computed), "1", way)


def _force_curve(sweep: xr.Dataset, way: str) -> Iterator[Finding]:
    force, distance = sweep["force"].values, sweep["distance"].values
    for name, label, chosen in (
        ("min_force", "lowest force", np.nanargmin), ("peak_force", "largest force", np.nanargmax),
    ):  # fmt: skip
        index: Any = chosen(force)
        place = f" at {number(float(distance[index]), 'm')}" if force[index] else ""
        yield _finding(name, label, float(force[index]), "N", way, place)
    if "energy" in sweep and way != "approach":  # it is known once the tip is back
        yield _finding("energy", "energy taken", float(sweep["energy"]), "J", way)
