"""The quantities measured along a curve, by the names that the model has for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dforce.core.arrays import Array

if TYPE_CHECKING:
    import xarray as xr


QUANTITIES = ("zc", "amplitude", "phase", "amplitude_ratio", "total_virial", "total_dissipated_energy")


def moved(curve: xr.Dataset, shift: float, turn: float) -> xr.Dataset:
    """Return a calibrated curve with `shift` (m) added to its heights, and `turn` (degrees) taken off its phases."""
    changes = {"height": shift, "phase": -turn, "phase_2": -turn}
    return curve.assign(
        {name: curve[name].copy(data=curve[name].values + by) for name, by in changes.items() if name in curve}
    )


def by_model(curve: xr.Dataset) -> dict[str, list[Array]]:
    """Return the measured columns by their names in :data:`QUANTITIES`, an array for each tone; heights are `zc`."""

    def tones(name: str) -> list[Array]:
        return [np.asarray(curve[key].values, dtype=float) for key in (name, f"{name}_2") if key in curve]

    found = {"zc": tones("height"), "amplitude": tones("amplitude"), "phase": tones("phase")}
    free = float(curve.attrs.get("free_amplitude", 0.0))
    if free > 0.0:
        found["amplitude_ratio"] = [found["amplitude"][0] / free]
    for name in ("virial", "dissipated_energy"):
        found[f"total_{name}"] = [np.asarray(curve[name].values, dtype=float)] if name in curve else []
    return {name: values for name, values in found.items() if values}
