"""Which kind of result a Dataset is, beside those of the driven motion of a tip."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

# a variable or an attribute that only this kind has; a fit holds the measured curve, so it comes first
MARKS = {
    "plan": "plan_over",
    "regimes": "map_over",
    "reconstruction": "force_status",
    "fit": "correlation",
    "identification": "verdict",
    "thermal_spectrum": "fitted_density",
    "measured": "height",
}


def kind_of(dataset: xr.Dataset) -> str:
    """Return the kind of a result that is not of the driven motion of a tip, a key of :data:`MARKS`; of others nothing."""
    return next((kind for kind, mark in MARKS.items() if mark in dataset.variables or mark in dataset.attrs), "")
