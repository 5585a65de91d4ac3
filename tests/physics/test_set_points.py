"""States at a set point: solved with the distance unknown, and held against motions that another method finds there."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import dforce as df

SHARE = 0.8
STIFF = {"youngs_modulus": "2 GPa", "poisson_ratio": 0.3}
SOFT = {"youngs_modulus": "50 MPa", "poisson_ratio": 0.4}
STICKY = {"youngs_modulus": "500 MPa", "poisson_ratio": 0.4}
TONES = [{"A0": "20 nm"}, {"A0": "1 nm", "mode": 2, "frequency": "310 kHz"}]
MODES = [{"f0": "50 kHz", "k": "1 N/m", "Q": 100.0}, {"f0": "310 kHz", "k": "40 N/m", "Q": 300.0}]


def case(lever, drive, sample, forces, start, stop, points, direction="approach"):
    return df.Case(
        cantilever=lever,
        drive=drive,
        tip={"radius": "8 nm"},
        sample=sample,
        forces=forces,
        experiment={
            "kind": "approach",
            "zc": {"start": f"{start} nm", "stop": f"{stop} nm", "points": points},
            "direction": direction,
        },
    )


def lever(f0, k, Q):
    return {"f0": f"{f0} kHz", "k": f"{k} N/m", "Q": Q}


DRAG = {"model": "kelvin_voigt", "viscosity": "30 Pa s"}
DMT = [{"model": "dmt", "hamaker": "6e-20 J"}]
CASES = {  # and how many states each direction has
    "water": (case(lever(25, 0.1, 2.0), {"A0": "10 nm"}, SOFT, [{"model": "hertz"}], 12, 2, 21), 1),
    "two states": (case(lever(70, 2.7, 180.0), {"A0": "30 nm"}, STIFF, DMT, 36, 15, 43, "both"), 2),
    "viscous": (case(lever(70, 2.0, 150.0), {"A0": "12 nm"}, SOFT, [{"model": "hertz"}, DRAG], 14, 4, 21), 1),
    "adhesive": (
        case(
            lever(150, 10, 100.0),
            {"A0": "20 nm"},
            STICKY,
            [{"model": "jkr", "surface_energy": "20 mJ/m^2"}],
            24,
            10,
            29,
        ),
        1,
    ),
    "two tones": (
        case({"modes": MODES}, {"tones": TONES}, STIFF, [{"model": "dmt", "hamaker": "2e-20 J"}], 24, 10, 29),
        1,
    ),
}


@functools.cache
def curve(name):
    return df.run(CASES[name][0])


@pytest.mark.parametrize("name", CASES)
def test_the_state_at_a_set_point_is_the_motion_that_settles_in_time_at_its_distance(name):
    asked, count = CASES[name]
    states = df.at_set_point(curve(name), SHARE)
    assert states.sizes["crossing"] == count and states["solved"].all()
    np.testing.assert_allclose(states["amplitude_ratio"], SHARE, atol=1e-9)
    in_time = asked.replace("solver", {"method": "transient", "integrator": "engine", "settle_tolerance": 1e-9})
    for i in range(count):
        one = states.isel(crossing=i)
        start = {"amplitude": float(one["amplitude"][0]), "phase": f"{float(one['phase'][0])} deg"}
        there = df.dwell(in_time, float(one["zc"]), start=start)
        # the accuracy of the curve is 1e-4; motions in time settle to 1e-9 times Q
        error = max(float(one["error_estimate"]), 1e-6)
        assert error < 1e-4
        assert float(there["amplitude"][0]) == pytest.approx(SHARE * asked.problem.tones[0].A0, rel=error)
        assert float(there["phase"][0]) == pytest.approx(float(one["phase"][0]), abs=2e-4)
        assert float(there["peak_force"]) == pytest.approx(float(one["peak_force"]), rel=1e-4, abs=1e-15)
        assert float(there["contact_time"]) == pytest.approx(float(one["contact_time"]), rel=2e-4)


def test_a_coarse_curve_gives_the_states_of_a_fine_one():
    asked, _ = CASES["two states"]
    fine = df.at_set_point(df.run(asked.set("experiment.zc.points=421")), SHARE)
    coarse = df.at_set_point(curve("two states"), SHARE)
    assert coarse["direction"].values.tolist() == fine["direction"].values.tolist() == ["approach", "retract"]
    for name in ("zc", "peak_force", "max_indentation", "total_dissipated_energy", "phase"):
        np.testing.assert_allclose(coarse[name], fine[name], rtol=1e-7, atol=1e-25, err_msg=name)


def test_the_distance_is_the_one_that_bisection_finds():
    asked, _ = CASES["viscous"]
    low, high = 8e-9, 10e-9
    while high - low > 1e-15:
        zc = 0.5 * (low + high)
        ratio = float(df.dwell(asked, zc)["amplitude_ratio"])
        low, high = (zc, high) if ratio < SHARE else (low, zc)
    assert float(df.at_set_point(curve("viscous"), SHARE)["zc"][0]) == pytest.approx(low, abs=1e-15)


def test_no_state_lies_between_the_points_beside_a_jump():
    found = curve("two states")
    grid, seen = np.sort(found["zc"].values), 0
    for at, way, before, after in zip(
        *(found[f"jump_{name}"].values.tolist() for name in ("zc", "direction", "before", "after")), strict=True
    ):
        states = df.at_set_point(found, 0.5 * (before + after) / 30e-9)
        assert states["solved"].all()
        zc = states["zc"].values[states["direction"].values == way]
        assert (np.searchsorted(grid, zc) != np.searchsorted(grid, at)).all()
        seen += 1
    assert seen == 2


def test_motions_found_in_time_are_read_between_points():
    asked = CASES["water"][0].replace("solver", {"method": "transient"})
    states = df.at_set_point(df.run(asked), SHARE)
    assert states.sizes["crossing"] == 1 and not states["solved"].any()
    assert float(states["zc"][0]) == pytest.approx(float(df.at_set_point(curve("water"), SHARE)["zc"][0]), abs=5e-12)


@pytest.mark.parametrize("name", ["two states", pytest.param("adhesive", marks=pytest.mark.slow)])
def test_a_sweep_has_the_same_states_alone_together_and_from_its_curves(name, tmp_path):
    path, moduli = "sample.youngs_modulus", [0.5e9, 1e9, 2e9]
    asked = CASES[name][0].set("experiment.zc.points=22")
    together = df.sweep(asked, over={path: moduli}, at_set_point=SHARE)
    stored = df.sweep(asked, over={path: moduli}, at_set_point=SHARE, store=str(tmp_path / "cut.zarr"))
    curves = df.at_set_point(df.sweep(asked, over={path: moduli}), SHARE)
    assert together["solved"].any()
    for i, modulus in enumerate(moduli):
        alone = df.sweep(asked, over={path: [modulus]}, at_set_point=SHARE).isel(youngs_modulus=0)
        single = df.at_set_point(df.run(asked.replace(path, modulus)), SHARE)
        count = single.sizes["crossing"]
        for quantity in ("zc", "peak_force", "phase", "solved", "error_estimate"):
            wanted = alone[quantity].values[:count]
            for other in (together, stored, curves):
                np.testing.assert_array_equal(other[quantity].values[i, :count], wanted, err_msg=quantity)
            if quantity != "error_estimate":  # a single curve looks ahead, which leaves other roundings
                np.testing.assert_allclose(single[quantity].values, wanted, rtol=1e-6, atol=1e-15, err_msg=quantity)


def test_a_sweep_of_locked_curves_has_the_states_of_each():
    drive = {"A0": "12 nm", "operation": "ce_fm"}
    asked, path = CASES["viscous"][0].replace("drive", drive).set("experiment.zc.points=8"), "sample.youngs_modulus"
    moduli = [30e6, 60e6]
    states = df.sweep(asked, over={path: moduli}, at_set_point=0.9, quantities=["peak_force"])
    for i, modulus in enumerate(moduli):
        alone = df.at_set_point(df.run(asked.replace(path, modulus)), 0.9)
        assert alone["solved"].all() and states["solved"].values[i].all()
        np.testing.assert_allclose(states["zc"].values[i], alone["zc"], rtol=1e-9)
        np.testing.assert_allclose(states["peak_force"].values[i], alone["peak_force"], rtol=1e-9)


def test_states_of_branches_are_those_that_a_phase_modulation_holds_stable_or_not():
    asked = df.example("figure-3-branches")
    states = df.at_set_point(df.run(asked), SHARE)
    assert states["solved"].all() and sorted(states["stable"].values) == [False, True, True]
    np.testing.assert_allclose(states["amplitude_ratio"], SHARE, atol=1e-9)
    held = asked.replace("drive", {"A0": SHARE * 10e-9, "operation": "pm"}).replace(
        "experiment", {"kind": "dwell", "zc": 8e-9}
    )
    for i in range(3):
        there = df.dwell(held, float(states["zc"][i]))
        # this drive gives 10 nm far away
        assert float(np.ravel(there["drive_ratio"])[0]) == pytest.approx(1.0 / SHARE, rel=1e-5)
        assert float(np.ravel(there["phase"])[0]) == pytest.approx(float(states["phase"][i, 0]), abs=2e-3)
        assert float(there["min_force"]) == pytest.approx(float(states["min_force"][i]), rel=1e-4)


def test_a_set_point_along_a_parameter_of_branches_is_solved_for_the_parameter():
    asked, path = df.example("figure-3-air"), "sample.youngs_modulus"
    curve = df.branches(
        asked.replace(experiment=None), zc="7.6 nm", parameter=path, start="0.3 GPa", stop="3 GPa", search=1
    )
    ratio = curve["amplitude_ratio"].values
    share = float(0.5 * (ratio.min() + ratio.max()))
    states = df.at_set_point(curve, share)
    assert states.sizes["crossing"] and states["solved"].all()
    np.testing.assert_allclose(states["amplitude_ratio"], share, atol=1e-9)
    for one in (states.isel(crossing=i) for i in range(states.sizes["crossing"]) if bool(states["stable"][i])):
        start = {"amplitude": float(one["amplitude"][0]), "phase": f"{float(one['phase'][0])} deg"}
        there = df.dwell(asked.replace(path, float(one["youngs_modulus"])), "7.6 nm", start=start)
        assert float(there["amplitude_ratio"]) == pytest.approx(share, abs=2e-5)
        assert float(there["peak_force"]) == pytest.approx(float(one["peak_force"]), rel=1e-3)


def test_a_sweep_of_branches_asks_for_one_of_its_cases():
    lever_in_air = case(lever(50, 5, 60), {"A0": "5 nm"}, STIFF, [{"model": "hertz"}], 5.5, 2, 3)
    branches = lever_in_air.replace("experiment", {"kind": "branches", "zc": {"start": "5.5 nm", "stop": "3 nm"}})
    swept = df.sweep(branches, {"tip.radius": ["8 nm", "12 nm"]}, workers=1)
    with pytest.raises(df.ParameterError, match=r"choose a case with \.isel\(radius=0\)"):
        df.at_set_point(swept, SHARE)
    alone = df.at_set_point(df.branches(branches.replace("tip.radius", "12 nm")), SHARE)
    np.testing.assert_array_equal(df.at_set_point(swept.isel(radius=1), SHARE).zc, alone.zc)
    with pytest.raises(df.ParameterError, match="these branches have no points: their range has no state"):
        df.summary(swept.isel(radius=1, point=[]))
