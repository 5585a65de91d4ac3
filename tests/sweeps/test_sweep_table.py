"""The table `[sweep]` of a case, rows of cases, and states at a set point."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import xarray as xr

import dforce as df

CURVE = df.experiments.Approach(zc={"start": "12 nm", "stop": "4 nm", "points": 9})
MODULI = {"start": "0.5 GPa", "stop": "2 GPa", "points": 3, "spacing": "log"}
OVER = {"sample.youngs_modulus": MODULI, "drive.A0": ["6 nm", "8 nm"]}


def case(**changes: object) -> df.Case:
    values = {
        "cantilever": df.Cantilever(f0="50 kHz", k=1.0, Q=100.0),
        "drive": df.Drive(A0="8 nm"),
        "tip": df.Tip(radius="5 nm"),
        "sample": df.Sample(youngs_modulus="1 GPa"),
        "forces": [df.forces.DMT(hamaker="3e-20 J")],
        "experiment": CURVE,
    }
    return df.Case(**values | changes)


def same(one: xr.Dataset, other: xr.Dataset) -> None:
    """Assert that two results differ in date and case at most."""
    without = ("date", "case")
    one, other = (d.assign_attrs(dict.fromkeys(without, "")) for d in (one, other))
    xr.testing.assert_identical(one, other)


def test_a_table_is_text_script_and_object_without_loss():
    swept = case(sweep={"over": OVER})
    assert df.Case.from_toml(swept.to_toml()) == df.Case.from_toml(swept.to_toml(complete=True)) == swept
    names = {}
    exec(swept.to_python().split("\nresult")[0], names)
    assert names["case"] == swept
    assert "df.sweep(case" in swept.to_python()


def test_a_table_is_the_same_as_its_values_in_python():
    values = {"sample.youngs_modulus": np.geomspace(0.5e9, 2e9, 3), "drive.A0": [6e-9, 8e-9]}
    same(df.sweep(case(sweep={"over": OVER})), df.sweep(case(), over=values))


def test_one_case_of_a_sweep_is_a_case_of_its_own():
    one = df.sweep(case(sweep={"over": OVER})).isel(youngs_modulus=1, A0=1, zc=4)
    assert float(df.motion_at(one).amplitude[0]) == pytest.approx(float(one.amplitude[0]), rel=1e-8)


def test_rows_are_cases_one_by_one(workdir):
    text = "# three samples\nsample.youngs_modulus,drive.A0\n1e9,6 nm\n0.5 GPa,7 nm\n2e9,8e-9\n"
    (workdir / "cases.csv").write_text(text)
    rows = df.sweep(case(sweep={"rows": "cases.csv"}))
    assert rows.amplitude.dims == ("case", "zc", "tone")
    assert rows.A0.dims == ("case",)
    grid = df.sweep(case(), over={"sample.youngs_modulus": [1e9, 0.5e9, 2e9], "drive.A0": [6e-9, 7e-9, 8e-9]})
    for i in range(3):
        np.testing.assert_array_equal(rows.amplitude[i], grid.amplitude[i, i])
    dwells = df.sweep(
        case(experiment=df.experiments.Dwell(zc="7 nm")),
        rows={"experiment.zc": ["6 nm", "7 nm"], "sample.youngs_modulus": [1e9, 2e9]},
    )
    assert dwells.zc.dims == ("case",)
    alone = df.dwell(case().replace("sample.youngs_modulus", 2e9), zc="7 nm")
    assert float(dwells.amplitude[1, 0]) == pytest.approx(float(alone.amplitude[0]), rel=1e-6)


def test_states_at_a_set_point_are_those_of_the_whole_curves():
    curves = df.sweep(case(), over=OVER)
    states = df.sweep(case(), over=OVER, quantities=["peak_force"], at_set_point=0.8)
    wanted = df.at_set_point(curves, 0.8, ["peak_force"])
    np.testing.assert_array_equal(states.peak_force, wanted.peak_force)
    assert states.attrs["set_point"] == 0.8
    assert states.status.dims == ("youngs_modulus", "A0")
    assert str(df.summary(wanted)) == str(df.summary(states))
    assert df.advice(wanted) == df.advice(curves)
    of_rows = df.sweep(case(), rows={"drive.A0": [6e-9, 8e-9]}, at_set_point=0.8)
    assert of_rows.A0.dims == ("case",)


@pytest.mark.parametrize(
    ("sweep", "sentence"),
    [
        ({}, "sweep has neither over nor rows"),
        ({"over": OVER, "rows": "a.csv"}, "sweep has both over and rows"),
        ({"over": {"drive.A": ["1 nm"]}}, "did you mean 'drive.A0'"),
        ({"over": {"drive.A0": "1 nm"}}, "sweep.over.drive.A0 = 1 nm is neither a list of values nor a range"),
        ({"over": {"drive.A0": {"start": 1e-9, "stop": 2e-9, "points": 10**9}}}, "points = 1000000000 is above"),
        ({"over": {"drive.A0": {"start": 1e-9, "stop": 2e-9, "point": 3}}}, "did you mean 'points'"),
    ],
)
def test_a_mistake_in_a_table_is_one_sentence(sweep, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        case(sweep=sweep)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (
            {"over": {"cantilever.Q": [50.0], "cantilever.modes.1.Q": [60.0]}},
            "the same parameter; list its values once",
        ),
        (
            {"over": {"forces.1.hamaker": [0.0], "forces.dmt.hamaker": [1e-20]}},
            "the same parameter; list its values once",
        ),
        (
            {"over": {"drive.A0": {"start": "1 nm", "stop": "-1 nm", "points": 3, "spacing": "log"}}},
            "use linear spacing",
        ),
        (
            {"over": {"drive.A0": {"start": "9 nm", "stop": "9 nm", "points": 3}}},
            "drive.A0 starts and stops at 9 nm, so its 3 points are equal; change stop",
        ),
        ({"over": {"solver.method": {"start": 1, "stop": 2, "points": 3}}}, "not a plain number, so it has no range"),
        ({"rows": {"solver.method": ["periodic"]}}, "cannot differ from case to case"),
        ({"rows": {"drive.A0": [1e-9], "tip.radius": [1e-9, 2e-9]}}, "each case needs one value"),
        ({"over": {"drive.A0": [1e-9]}, "rows": {"drive.A0": [1e-9]}}, "over and rows exclude each other"),
        ({"over": {"drive.A0": [1e-9]}, "at_set_point": 0.0}, "is not above 0"),
        ({"over": {"drive.A0": range(10**9)}}, "has 1000000000 values; at most 10000000 are allowed"),
        ({"over": {"drive.A0": itertools.repeat(1e-9)}}, "has more than 10000000 values"),
    ],
)
def test_a_mistake_in_values_is_one_sentence(values, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.sweep(case(), **values)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("drive.A0\n", "contains no case"),
        ("drive.A0,tip.radius\n1e-9\n", "case 1 of .* has 1 values"),
        ("drive.A0,drive.A0\n1e-9,2e-9\n", "names drive.A0 twice"),
        (None, "there is no file '.*cases.csv'"),
    ],
)
def test_a_mistake_in_a_file_of_rows_is_one_sentence(text, sentence, workdir):
    if text is not None:
        (workdir / "cases.csv").write_text(text)
    with pytest.raises(df.CaseError, match=sentence):
        df.sweep(case(sweep={"rows": "cases.csv"}))


RELATIVE = df.experiments.Approach(zc={"of": "drive.A0", "start": 1.2, "stop": 0.5, "points": 8}, direction="both")


def test_lists_along_cases_are_the_same_as_rows(tmp_path):
    columns = {"sample.youngs_modulus": ["1 GPa", "2 GPa"], "drive.A0": ["6 nm", "8 nm"]}
    listed = df.sweep(case(), over=columns, along="cases")
    assert listed.amplitude.dims == ("case", "zc", "tone")
    same(listed, df.sweep(case(), rows=columns))
    same(listed, df.sweep(case(sweep={"over": columns, "along": "cases"})))
    stored = df.sweep(case(), over=columns, along="cases", store=tmp_path / "cases.zarr")
    np.testing.assert_array_equal(stored.amplitude, listed.amplitude)


def test_distances_as_shares_of_the_free_amplitude_go_with_each_case(tmp_path):
    over = {"drive.A0": ["6 nm", "8 nm"], "sample.youngs_modulus": ["1 GPa", "2 GPa"]}
    shares = df.sweep(case(experiment=RELATIVE), over=over)
    assert shares.zc.dims == ("A0", "zc_ratio")
    np.testing.assert_allclose(shares.zc, np.outer([6e-9, 8e-9], np.linspace(1.2, 0.5, 8)), rtol=1e-15)
    alone = df.approach(case().replace("drive.A0", "6 nm"), zc=shares.zc[0].values, direction="both").amplitude
    np.testing.assert_allclose(shares.amplitude[0, 0], alone, rtol=1e-9)
    stored = df.sweep(case(experiment=RELATIVE), over=over, store=tmp_path / "shares.zarr")
    np.testing.assert_array_equal(stored.amplitude, shares.amplitude)
    np.testing.assert_array_equal(stored.zc, shares.zc)


def test_a_sweep_at_one_free_amplitude_has_distances_in_meters():
    modulus = {"sample.youngs_modulus": ["1 GPa", "2 GPa"]}
    assert df.sweep(case(experiment=RELATIVE), over=modulus).zc.dims == ("zc",)
    np.testing.assert_allclose(df.run(case(experiment=RELATIVE)).zc, 8e-9 * np.linspace(1.2, 0.5, 8), rtol=1e-15)


def test_set_points_and_jumps_of_relative_distances_are_those_of_the_curves_alone():
    sharp = case(
        cantilever=df.Cantilever(f0="70 kHz", k=2.7, Q=180.0),
        tip=df.Tip(radius="8 nm"),
        sample=df.Sample(youngs_modulus="2 GPa"),
        forces=[df.forces.DMT(hamaker="6e-20 J")],
    )
    grid = {"of": "drive.A0", "start": 1.1, "stop": 0.5, "points": 41}
    both = df.experiments.Approach(zc=grid, direction="both")
    shares = df.sweep(sharp.replace(experiment=both), over={"drive.A0": ["30 nm", "34 nm"]})
    for i, A0 in enumerate((30e-9, 34e-9)):
        alone = df.approach(sharp.replace("drive.A0", A0), zc=shares.zc[i].values, direction="both")
        found, wanted = (df.at_set_point(one, 0.8) for one in (shares.isel(A0=i), alone))
        np.testing.assert_allclose(found.zc, wanted.zc, rtol=1e-8)  # the solver's tolerance is 1e-9 of A0
        assert found.sizes["crossing"] == wanted.sizes["crossing"]
        if "jump_zc" in alone:
            noted = shares.jump_zc[i].values
            np.testing.assert_allclose(np.sort(noted[np.isfinite(noted)]), np.sort(alone.jump_zc), rtol=1e-8)
    assert np.isfinite(shares.jump_zc).any()


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"rows": {"drive.A0": [1e-9]}, "along": "cases"}, "along needs over"),
        ({"over": {"drive.A0": [1e-9]}, "along": "case"}, "did you mean 'cases'"),
        ({"over": {"drive.A0": [1e-9], "tip.radius": [1e-9, 2e-9]}, "along": "cases"}, "each case needs one value"),
        ({"over": {"drive": [{"A0": "6 nm"}]}}, "but drive may change A0"),
    ],
)
def test_a_mistake_with_cases_or_shares_is_one_sentence(values, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.sweep(case(experiment=RELATIVE), **values)
