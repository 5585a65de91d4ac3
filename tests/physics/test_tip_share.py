"""A detector that reads a share of the motion changes readings alone: searches and ranges go by the motion of the tip."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.inverse.fitting.foresight import _all_unknowns
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.points import MeasuredPoints
from dforce.inverse.fitting.unknowns import start_vector
from dforce.validity import Evidence

SHARE = 0.4  # of the motion, as the detector reads it
MOTION = 20e-9
FREE = ["sample.youngs_modulus", "forces.dmt.hamaker"]


def read_as(share: float, model: str = "dmt") -> df.Case:
    """Return one case, with an optical lever that reads a share of the motion."""
    return df.Case(
        cantilever={"f0": "70 kHz", "k": "2 N/m", "Q": 100},
        drive={"A0": share * MOTION},
        readout={"kind": "optical_lever", "mode_sensitivity": [share]},
        tip={"radius": "10 nm"},
        sample={"youngs_modulus": "1 GPa"},
        forces=[{"model": model, **({"hamaker": "3e-20 J"} if model == "dmt" else {})}],
        experiment={"kind": "approach", "zc": {"start": "23 nm", "stop": "10 nm", "points": 5}},
    )


def test_a_plan_finds_the_same_states_for_any_share():
    found = [
        df.plan(
            read_as(share), {"drive.A0": [0.5 * share * MOTION, share * MOTION]}, [0.8, 0.9], {"peak_force": "< 9 nN"}
        )
        for share in (1.0, SHARE)
    ]
    zc = [one["zc"].values for one in found]
    assert np.isfinite(zc[0]).any(axis=-1).all()
    np.testing.assert_allclose(zc[1], zc[0], rtol=1e-6)
    np.testing.assert_allclose(found[1]["peak_force"], found[0]["peak_force"], rtol=1e-4, atol=1e-14)


def test_identify_expects_the_same_errors_for_any_share():
    whole, part = (df.identify(read_as(share), free=FREE, helps=False) for share in (1.0, SHARE))
    assert list(part["curve"].values) == list(whole["curve"].values)
    np.testing.assert_allclose(part["error"].sel(curve="approach"), whole["error"].sel(curve="approach"), rtol=1e-2)


def test_a_fit_follows_the_branch_of_free_motion_for_any_share():
    heights = np.linspace(0.93, 0.5, 20) * MOTION
    rows = np.ones((20, 1))
    lost = []
    for share in (1.0, SHARE):
        case = read_as(share)
        noise = np.array([1e-3 * share * MOTION]), np.array([0.3])
        data = MeasuredPoints(heights, rows, 90.0 * rows, np.ones(20, np.int64), rows[:, 0] > 0.0, *noise, 0.0, {})
        unknowns = _all_unknowns(case, FREE)
        lost.append(CurveModel(case, unknowns, data).predict(start_vector(unknowns)).lost)
    np.testing.assert_array_equal(*lost)


@pytest.mark.parametrize("kind", ["approach", "branches", "dwell"])
def test_a_suggested_distance_goes_by_the_motion(kind):
    from dforce.experiments import Approach, Branches, Dwell

    plan = {"approach": Approach, "branches": Branches, "dwell": Dwell}[kind]
    whole, part = (plan.suggested(read_as(share).problem)["zc"] for share in (1.0, SHARE))
    assert part == whole


def test_the_expected_indentation_goes_by_the_motion():
    whole, part = (Evidence(read_as(share, "hertz"), None).deepest for share in (1.0, SHARE))
    assert whole is not None
    assert part == pytest.approx(whole, rel=1e-9)


def measured(case: df.Case, offset: float) -> xr.Dataset:
    """Return a measured curve of a case, with heights that are too small by an offset (m)."""
    curve = df.run(
        case.replace(experiment={"kind": "approach", "zc": {"start": "27 nm", "stop": "10 nm", "points": 171}})
    )
    noise = np.random.default_rng(1).normal(size=(2, 171))
    A0 = case.problem.tones[0].A0
    amplitude = curve["amplitude"].values[:, 0] + 1e-3 * A0 * noise[0]
    return xr.Dataset(
        {
            "height": ("point", curve["zc"].values - offset),
            "amplitude": ("point", amplitude),
            "phase": ("point", curve["phase"].values[:, 0] + 0.2 * noise[1]),
        },
        coords={"direction": ("point", np.repeat("approach", 171))},
        attrs={"phase_convention": "lag", "history": ["read: simulated"]},
    )


def test_calibration_and_fit_find_the_heights_for_any_share():
    found = {}
    for share in (1.0, SHARE, 3.0):
        case = read_as(share)
        data = df.calibrate(measured(case, 9e-9), case)
        assert not [line for line in data.attrs["history"] if "impossible" in line]
        fit = df.fit(case, data, free=["forces.dmt.hamaker"], search=False)
        found[share] = data.attrs["height_offset"], float(fit["value"].sel(parameter="zc_offset"))
    assert found[SHARE] == pytest.approx(found[1.0], rel=1e-3)
    assert found[3.0] == pytest.approx(found[1.0], rel=1e-3)
    assert found[1.0] == pytest.approx((9e-9, 9e-9), abs=1e-9)


def test_the_default_range_of_a_force_curve_goes_by_the_motion():
    whole, *parts = (df.force_curve(read_as(share))["distance"].values for share in (1.0, SHARE, 3.0))
    for part in parts:
        np.testing.assert_allclose(part, whole, rtol=1e-9)


def test_the_default_range_of_a_force_curve_goes_by_the_drive_of_the_driven_mode():
    case, second = read_as(1.0), {"f0": "430 kHz", "k": "80 N/m", "Q": 300}
    modes = [{"f0": "70 kHz", "k": "2 N/m", "Q": 100}, second]
    alone = case.replace(cantilever=second, readout={})
    both = case.replace(cantilever={"modes": modes}, readout={}, drive={"A0": MOTION, "mode": 2})
    np.testing.assert_allclose(*(df.force_curve(one)["distance"].values for one in (alone, both)), rtol=1e-9)


def test_basins_start_from_the_same_motions_for_any_share():
    whole, part = (df.experiments.Basins(zc="18 nm").coordinates(read_as(share).problem) for share in (1.0, SHARE))
    np.testing.assert_allclose(part["start_amplitude"], whole["start_amplitude"], rtol=1e-12)
    assert whole["start_amplitude"].max() == pytest.approx(1.2 * MOTION)
