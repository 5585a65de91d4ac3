"""The states at a set point: where they lie, what they are, and where there is none."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from synthetic import approach

import dforce as df


@functools.cache
def result(name):
    return df.run(df.example(name))


def test_the_amplitude_ratio_is_the_amplitude_over_the_free_amplitude():
    for name in ("figure-3-air-jump", "figure-3-branches", "resonance-curve"):
        A0 = df.example(name).drive.A0
        np.testing.assert_allclose(
            result(name)["amplitude_ratio"], result(name)["amplitude"].isel(tone=0) / A0, rtol=1e-12
        )


def test_of_several_tones_the_ratio_is_that_of_the_first():
    case = df.example("figure-6")
    curve, A0 = df.approach(case, zc=["10 nm", "8 nm"]), case.drive.tones[0].A0
    np.testing.assert_allclose(curve["amplitude_ratio"], curve["amplitude"].isel(tone=0) / A0, rtol=1e-12)


def test_a_sweep_has_the_same_ratio():
    case = df.example("figure-3-air").set("experiment.zc.points=21")
    grid = df.sweep(case, over={"drive.A0": [5e-9, 8e-9]}, quantities=["amplitude", "amplitude_ratio"])
    np.testing.assert_allclose(grid["amplitude_ratio"], grid["amplitude"].isel(tone=0) / grid["A0"], rtol=1e-12)


@pytest.mark.parametrize("set_point", [0.5, 0.8, 0.95])
def test_the_motion_at_the_distance_found_has_the_amplitude_and_the_force_said(set_point):
    case = df.example("figure-3-air")
    state = df.at_set_point(result("figure-3-air"), set_point).isel(crossing=0)
    on_the_way = [zc for zc in case.experiment.distances() if zc > float(state["zc"])]
    there = df.approach(case, zc=[*on_the_way, float(state["zc"])], direction="approach").isel(zc=-1)
    # a straight line between points 0.05 nm apart
    assert float(there["amplitude_ratio"]) == pytest.approx(set_point, abs=1e-4)
    assert float(there["min_force"]) == pytest.approx(float(state["min_force"]), rel=1e-2)


def test_every_state_at_the_set_point_is_listed_with_its_regime_and_stability():
    states = df.at_set_point(result("figure-3-branches"), 0.8)
    found = sorted(zip(states["regime"].values.tolist(), states["stable"].values.tolist(), strict=True))
    assert found == [("attractive", False), ("attractive", True), ("repulsive", True)]
    for regime, phase in zip(states["regime"].values, states["phase"].values[:, 0], strict=True):
        assert (phase > 90.0) == (regime == "attractive")
    assert states["peak_force"].values[states["regime"].values == "repulsive"] > 100e-12


def test_a_jump_over_the_set_point_is_no_state():
    curve = result("figure-3-air-jump")
    ratio = curve["amplitude_ratio"].values
    place = curve["zc"].values
    for number, way in enumerate(("approach", "retract")):
        (at,) = (
            zc for zc, word in zip(curve["jump_zc"].values, curve["jump_direction"].values, strict=True) if word == way
        )
        after = int(np.searchsorted(-place, -at))
        within = ratio[after - 1 : after + 1, number]
        states = df.at_set_point(curve, float(within.mean()), ["amplitude"])
        away = np.abs(states["zc"].values[states["direction"].values == way] - at)
        assert (away > 0.1e-9).all()  # a step


def test_a_point_that_did_not_settle_is_no_end_of_a_line():
    curve = approach(directions=("approach",), spoiled=False)
    curve["amplitude_ratio"] = curve["amplitude"].isel(tone=0) / 10e-9
    (found,) = df.at_set_point(curve, 0.5, [])["zc"].values
    curve["status"][int(np.abs(curve["zc"].values - found).argmin())] = df.Status.NOT_SETTLED
    assert df.at_set_point(curve, 0.5, []).sizes["crossing"] == 0


def test_the_order_of_the_distances_does_not_matter():
    case = df.example("figure-3-air").set("experiment.direction=approach")
    zc = case.experiment.distances()[::4]
    mixed = np.concatenate([zc[1::2], zc[::2]])
    sorted_, unsorted = (df.at_set_point(df.approach(case, zc=one), 0.8, ["phase"]) for one in (zc, mixed))
    np.testing.assert_allclose(unsorted["zc"], sorted_["zc"], rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "set_point", "names", "words"),
    [
        ("table-1-am", 0.8, None, "no curve of amplitudes"),
        ("figure-3-air-jump", 0.0, None, "not above 0"),
        ("figure-3-air-jump", 0.8, ["peak_forse"], "did you mean 'peak_force'"),
    ],
)
def test_what_cannot_be_asked_is_said_in_a_sentence(name, set_point, names, words):
    with pytest.raises(df.ParameterError, match=words):
        df.at_set_point(result(name), set_point, names)


def test_a_motion_without_forces_is_in_no_regime():
    case = df.example("figure-3-air").replace("forces", ()).set("solver.method=transient")
    assert df.regime(df.dwell(case, zc="20 nm")) == ""
