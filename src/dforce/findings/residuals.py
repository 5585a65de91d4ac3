"""How far a curve of the model is from measured points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dforce.core.arrays import Array
from dforce.findings.jumps import jumps
from dforce.results.curves import goes_along
from dforce.results.kinds import swept
from dforce.results.measured import by_model

if TYPE_CHECKING:
    import xarray as xr

WAYS = {1: "approach", -1: "retract"}  # the curve of free motion, and of the branch behind a jump


def residuals(model: xr.Dataset, curve: xr.Dataset) -> dict[str, Array]:
    """Return (model - measured) / standard deviation of `amplitude` and `phase`, each of shape (points, tones).

    The curve of the model is a straight line between its points. Measured branches, where they are known, choose between
    approach and retract; else the directions of the points do. A residual is NaN beyond the curve, across a jump, and where the
    curve has left the branch of a point.

    Parameters
    ----------
    model
        Result of an approach of one case.
    curve
        A calibrated curve (:func:`dforce.calibrate`) whose heights are average distances; see :func:`moved`.

    Returns
    -------
    dict
        Empty where the model has no curve against the distance, or the noise of the points is not known.
    """
    if goes_along(model) != "zc" or swept(model) or "point" in model.dims:
        return {}
    there, found = by_model(curve), dict[str, Array]()
    for name in ("amplitude", "phase"):
        errors = [curve.attrs.get(f"{name}{ending}_error", 0.0) for ending in ("", "_2")]
        tones = list(zip(there.get(name, []), errors, strict=False))[: model.sizes.get("tone", 1)]
        if tones and all(error > 0.0 for _, error in tones):
            columns = [
                (_at(model, name, tone, curve, there["zc"][0]) - values) / error
                for tone, (values, error) in enumerate(tones)
            ]
            found[name] = np.column_stack(columns)
    return found


def _at(model: xr.Dataset, name: str, tone: int, curve: xr.Dataset, zc: Array) -> Array:
    """Return a quantity of the model at the distances of measured points."""
    ways, branches = curve["direction"].values.astype(str), np.zeros(len(zc))
    if "branch" in curve:
        branches = np.sign(curve["branch"].values)
        ways = np.array([WAYS[int(one)] for one in branches])
    out = np.full(len(zc), np.nan)
    known = model["direction"].values.tolist() if "direction" in model.dims else []
    for way in np.unique(ways):
        taken = next((one for one in known if one == way), known[0] if known else "")
        one = model.sel(direction=taken) if known else model
        x, y = one["zc"].values, one[name].values.reshape(one.sizes["zc"], -1)[:, tone]
        rows, order = np.flatnonzero(ways == way), np.argsort(x)
        out[rows] = np.interp(zc[rows], x[order], y[order], left=np.nan, right=np.nan)
        for jump in jumps(one, taken):
            low, high = sorted((x[jump.before], x[jump.after]))
            # below a jump the curve has left free motion, above it the branch behind the jump
            left = (zc > np.where(branches > 0, -np.inf, low)) & (zc < np.where(branches < 0, np.inf, high))
            out[rows[left[rows]]] = np.nan
    return out
