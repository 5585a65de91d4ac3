"""Summaries of results of no experiment: maps, measured curves, and spectra."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.units import show
from dforce.findings.finding import DIGITS, Finding

if TYPE_CHECKING:
    import xarray as xr


def _number(name: str, label: str, value: Any, unit: str = "1", digits: int = DIGITS) -> Finding:
    number = float(value)
    text = show(number, unit, digits) if np.isfinite(number) else "unknown"
    return Finding(name, label, text, number, unit)


def _count(name: str, label: str, count: Any) -> Finding:
    return Finding(name, label, str(int(count)), float(count), "1")


def measured(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the points and the noise of a measured curve."""
    yield _count("points", "points", dataset.sizes["point"])
    for name, label, unit in (
        ("free_amplitude", "free amplitude", "m"),
        ("amplitude_error", "noise of the amplitude", "m"),
        ("phase_error", "noise of the phase", "degree"),
    ):
        if name in dataset.attrs and unit == "m":
            yield _number(name, label, dataset.attrs[name], unit)
        elif name in dataset.attrs:
            value = float(dataset.attrs[name])
            yield Finding(name, label, f"{value:.{DIGITS}g}°", value, unit)


def material(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give modulus, indentation and viscosity at the deepest point, with the true values beside."""
    from dforce.findings.finding import finding

    deepest = dataset
    if "zc" in dataset.dims:
        deepest = dataset.isel(zc=int(np.argmin(dataset["zc"].values)))
        yield finding("zc", "at the closest distance", float(deepest["zc"]), "m")
    for name in ("E_eff", "estimated_indentation", "estimated_viscosity", "loss_tangent"):
        for one in (name, f"true_{name.removeprefix('estimated_')}"):
            if one in dataset:
                row = dataset[one]
                value = float(np.ravel(deepest[one].values)[0])
                yield finding(one, row.attrs["long_name"], value, row.attrs["units"])


def identification(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the smallest error of each parameter that any curve leaves."""
    curves = dataset["error"].isel({dim: 0 for dim in dataset["error"].dims if dim not in ("parameter", "known")})
    for name in dataset["parameter"].values:
        at = curves.sel(parameter=name)
        smallest = float(np.nanmin(at.values)) if np.isfinite(at.values).any() else np.nan
        text = f"{smallest:.2g}" if np.isfinite(smallest) else "not told"
        yield Finding(str(name), f"smallest error of {name}", text, smallest, "1")


def reconstruction(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the lowest force that was found, and the gaps."""
    force = dataset["force"]
    if np.isfinite(force.values).any():
        lowest = int(np.nanargmin(force.values))
        yield _number("lowest_force", "lowest force", force[lowest], "N")
        yield _number("at", "its distance", dataset["distance"][lowest], "m")
    yield _count("gaps", "gaps", dataset.sizes.get("gap", 0))


def regimes(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give how many boundaries a map of regimes has, and how many settings no steady state."""
    yield _count("boundaries", "points of boundaries", dataset.sizes.get("edge", 0))
    states = dataset["states"].values
    yield _count("states", "most stable states at one setting", np.nanmax(states))
    if empty := int((states == 0).sum()):
        text = f"{empty} of {states.size}: the motion may not repeat there"
        yield Finding("without_state", "settings without steady state", text, float(empty), "1")


def thermal_spectrum(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give the fitted values of a thermal spectrum, beside the true values."""
    modes = _each(dataset, "mode")
    for one in modes:
        which = f" of mode {int(one['mode'])}" if len(modes) > 1 else ""
        yield _number("fitted_f0", f"fitted f0{which}", one["fitted_f0"], "Hz", 5)
        yield _number("fitted_Q", f"fitted Q{which}", one["fitted_Q"])
        if len(modes) > 1:
            yield _beside_true(one, "mode_spring_constant", f"k{which}, by its own calibration")
    for one in _each(dataset, "calibration"):
        name = str(one["calibration"].values)
        yield _beside_true(one, "spring_constant", f"k, {name}", f"spring_constant, {name}")
    error = float(dataset["spring_constant_error"])
    text = f"{100.0 * error:.2g} %" if np.isfinite(error) else "unknown"
    yield Finding("spring_constant_error", "error of a thermal k", text, error, "1")


def _each(dataset: xr.Dataset, dim: str) -> list[xr.Dataset]:
    """Return a result at each place along a dimension; the result itself where one was chosen."""
    return [dataset.isel({dim: n}) for n in range(dataset.sizes[dim])] if dim in dataset.dims else [dataset]


def _beside_true(one: xr.Dataset, name: str, label: str, key: str = "") -> Finding:
    """Return a spring constant beside the true one, each as text, and how large it is against that."""
    value, true = float(one[name]), float(one[f"true_{name}"])
    found = f"{show(value, 'N/m', DIGITS)}, {value / true:.3f} of" if np.isfinite(value) else "unknown beside"
    both = f"{found} the true {show(true, 'N/m', DIGITS)}"
    return Finding(key or f"{name}_{int(one['mode'])}", label, both, value, "N/m")
