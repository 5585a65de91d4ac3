"""How far a curve of the model is from measured points."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.findings.jumps import jumps
from dforce.findings.residuals import residuals

SIGMA = {"amplitude": 0.1e-9, "phase": 0.5}


@functools.cache
def model():
    return df.run(df.example("figure-3-air-jump"))  # with a loop: approach and retract differ


def measured(direction, **more):
    """Return the model's own points, halfway between its distances, as measured ones."""
    one = model().sel(direction=direction)
    columns = {
        "height": one["zc"].values,
        "amplitude": one["amplitude"].values[:, 0],
        "phase": one["phase"].values[:, 0],
    }
    data = {name: ("point", 0.5 * (values[1:] + values[:-1])) for name, values in columns.items()}
    ways = ("point", [direction] * (len(columns["height"]) - 1))
    attrs = {f"{name}_error": error for name, error in SIGMA.items()}
    return xr.Dataset(data | more, {"direction": ways}, attrs)


@pytest.mark.parametrize("direction", ["approach", "retract"])
@pytest.mark.parametrize("name", SIGMA)
def test_residuals_are_deviations_from_the_curve_of_the_same_direction_in_standard_deviations(direction, name):
    curve = measured(direction)
    curve[name] = curve[name] - 3.0 * SIGMA[name]
    found = residuals(model(), curve)[name][:, 0]
    known = np.isfinite(found)
    assert np.count_nonzero(~known) == 1  # within the step of the jump
    np.testing.assert_allclose(found[known], 3.0, atol=1e-6)


def test_a_known_branch_chooses_the_curve():
    curve = measured("retract", branch=("point", -np.ones(model().sizes["zc"] - 1)))
    found = residuals(model(), curve.assign_coords(direction=("point", ["approach"] * curve.sizes["point"])))
    assert np.nanmax(np.abs(found["phase"])) < 1e-6


@pytest.mark.parametrize("directions", [["approach", "retract"], ["approach"], ["retract"]])
def test_a_point_is_never_compared_with_the_other_branch(directions):
    """A measured jump lies between both jumps of the model, where its branches differ by 100 standard deviations."""
    snaps = [jumps(model().sel(direction=way), way)[0].before for way in ("approach", "retract")]
    middle = sum(snaps) // 2
    far, near = measured("approach").isel(point=slice(middle)), measured("retract").isel(point=slice(middle, None))
    curve = xr.concat([far, near], "point").assign_attrs(far.attrs)
    curve = curve.assign_coords(branch=("point", np.where(np.arange(curve.sizes["point"]) < middle, 1, -1)))
    found = residuals(model().sel(direction=directions), curve)
    for name in SIGMA:
        assert np.nanmax(np.abs(found[name])) < 1e-6
        assert np.isfinite(found[name]).any()


def test_points_beyond_the_curve_have_no_residual():
    curve = measured("approach")
    curve["height"] = curve["height"] + 1e-6
    assert np.isnan(residuals(model(), curve)["amplitude"]).all()


def test_points_of_unknown_noise_and_other_results_have_none():
    curve = measured("approach")
    assert residuals(model(), curve.assign_attrs(amplitude_error=0.0, phase_error=0.0)) == {}
    assert residuals(df.run(df.example("table-1-am")), curve) == {}
