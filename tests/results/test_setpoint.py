"""The states at a set point: where they lie, what they are, and where there is none."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import xarray as xr
from every import every
from synthetic import approach

import dforce as df
from dforce.findings import set_point

STEPWISE = "experiment.protocol=stepwise"


@functools.cache
def result(name, *settings):
    return df.run(df.example(name).set(*settings))


@pytest.mark.slow
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
    assert float(there["amplitude_ratio"]) == pytest.approx(set_point, abs=1e-8)
    assert float(there["min_force"]) == pytest.approx(float(state["min_force"]), rel=1e-6)


def test_every_state_at_the_set_point_is_listed_with_its_regime_and_stability():
    states = df.at_set_point(result("figure-3-branches"), 0.8)
    found = sorted(zip(states["regime"].values.tolist(), states["stable"].values.tolist(), strict=True))
    assert found == [("attractive", False), ("attractive", True), ("repulsive", True)]
    for regime, phase in zip(states["regime"].values, states["phase"].values[:, 0], strict=True):
        assert (phase > 90.0) == (regime == "attractive")
    assert states["peak_force"].values[states["regime"].values == "repulsive"] > 100e-12


# of sudden steps, and at the ends of the states themselves
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("figure-3-air-jump", [STEPWISE]),
        ("figure-3-air", ['drive.A0="14 nm"', 'experiment.zc.start="17 nm"', "experiment.direction=both"]),
    ],
)
@pytest.mark.slow
def test_a_jump_over_the_set_point_is_no_state(name, settings):
    curve = result(name, *settings)
    step, A0 = abs(float(curve["zc"][1] - curve["zc"][0])), df.Case.from_toml(curve.attrs["case"]).drive.A0
    ways = curve["jump_direction"].values.tolist()
    assert sorted(ways) == ["approach", "retract"]
    for at, way, before, after in zip(
        *(curve[f"jump_{of}"].values.tolist() for of in ("zc", "direction", "before", "after")), strict=True
    ):
        states = df.at_set_point(curve, 0.5 * (before + after) / A0, ["amplitude"])
        away = np.abs(states["zc"].values[states["direction"].values == way] - at)
        assert (away > step).all()


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


@pytest.mark.parametrize("direction", ["approach", "retract"])
def test_a_jump_of_a_curve_in_one_direction_is_no_state(direction):
    curve = result("figure-3-air-jump", STEPWISE, f"experiment.direction={direction}")
    before, after = sorted([float(curve["jump_before"][0]), float(curve["jump_after"][0])])
    states = df.at_set_point(curve, 0.5 * (before + after) / 10e-9, ["amplitude"])
    assert (np.abs(states["zc"].values - float(curve["jump_zc"][0])) > 0.1e-9).all()  # a step


def test_a_state_is_read_across_no_sudden_step_of_states_that_are_not_carried():
    curve = approach(directions=("approach",), spoiled=False)
    anew = df.experiments.Approach(zc=[9e-9], protocol="stepwise", carry_state=False)
    case = df.Case.from_toml(curve.attrs["case"]).replace("experiment", anew)
    curve = curve.assign(amplitude_ratio=curve["amplitude"].isel(tone=0) / 10e-9, corrections=curve["peak_force"] * 0.0)
    carried = curve.assign_attrs(case=case.set("experiment.carry_state=true").to_toml(complete=True))
    alone = curve.assign_attrs(case=case.to_toml(complete=True))
    within = 0.5 * float(curve["amplitude_ratio"].sel(zc=[7.2e-9, 7.3e-9], method="nearest").sum())
    at = [df.at_set_point(one, within, [])["zc"].values for one in (carried, alone)]
    # where orbits were followed, and no jump noted, the curve is just steep
    assert [int(np.sum((zc > 7.2e-9) & (zc < 7.3e-9))) for zc in at] == [1, 0]


def random_curve(draw):
    """Return a rough curve over frequency in two directions, with points that failed or did not settle, and jumps."""
    points = int(draw.integers(5, 60))
    x = draw.choice([draw.permutation, np.sort, lambda some: -np.sort(-some)])(draw.uniform(48e3, 50e3, points))
    ratio = np.round(draw.uniform(0.2, 1.0, (points, 2)), int(draw.choice([1, 6])))  # round ones lie on the set point
    lag = draw.uniform(-90.0, 270.0, (points, 2, 1))
    status = draw.choice([0, 0, 0, 0, int(df.Status.NOT_SETTLED)], (points, 2)).astype(np.int8)
    jumps = int(draw.integers(1, 4))
    data = {
        "amplitude_ratio": (("frequency", "direction"), ratio), "status": (("frequency", "direction"), status),
        "harmonic_phase": (("frequency", "direction", "harmonic"), lag, {"units": "degree"}),
        "virial": (("frequency", "direction", "mode"), draw.normal(0.0, 1e-20, (points, 2, 1))),
        "jump_frequency": ("jump", draw.uniform(48e3, 50e3, jumps)),
        "jump_direction": ("jump", draw.choice(["up", "down"], jumps)),
    }  # fmt: skip
    return xr.Dataset(data, {"frequency": x, "direction": ["up", "down"]})


def by_hand(curve, way, set_point):
    """Return frequency and phase of each state, point by point."""
    one = curve.sel(direction=way).sortby("frequency")
    x, off, lag = (one[name].values.tolist() for name in ("frequency", "amplitude_ratio", "harmonic_phase"))
    on = zip(one["jump_frequency"].values.tolist(), one["jump_direction"].values.tolist(), strict=True)
    jumps = [at for at, word in on if word == way]
    for i, good in enumerate(one["status"].values == df.Status.OK):
        if good and off[i] == set_point:
            yield x[i], lag[i][0]
        if i + 1 == len(x) or not good or one["status"].values[i + 1] != df.Status.OK:
            continue
        low, high = sorted([off[i], off[i + 1]])
        if low < set_point < high and not any(x[i] < at < x[i + 1] for at in jumps):
            share = (set_point - off[i]) / (off[i + 1] - off[i])
            turn = np.exp(1j * np.radians(lag[i + 1][0] - lag[i][0]))
            yield x[i] + share * (x[i + 1] - x[i]), lag[i][0] + share * np.degrees(np.angle(turn))


@every(range(60))
def test_states_are_those_found_point_by_point(seed):
    curve = random_curve(np.random.default_rng(seed))
    states = df.at_set_point(curve, 0.6, ["harmonic_phase"])
    for way in ("up", "down"):
        found = states.isel(crossing=np.flatnonzero(states["direction"].values == way))
        frequency, lag = np.array([*by_hand(curve, way, 0.6)]).reshape(-1, 2).T
        np.testing.assert_allclose(found["frequency"].values, frequency, rtol=1e-12)
        # an angle is one up to whole turns, and lies where phase lags do
        apart = np.exp(1j * np.radians(found["harmonic_phase"].values[:, 0] - lag))
        np.testing.assert_allclose(apart, 1.0, atol=1e-9)
        assert ((found["harmonic_phase"] > -90.0 - 1e-9) & (found["harmonic_phase"] <= 270.0 + 1e-9)).all()


OVER = {"drive.A0": ["5 nm", "10 nm", "12 nm"], "sample.youngs_modulus": ["1 GPa", "2 GPa"]}


@functools.cache
def grid(*kept):
    case = df.example("figure-3-air-jump").set("experiment.zc.points=56", STEPWISE)
    return df.sweep(case, over=OVER, quantities=kept or None)


@pytest.mark.parametrize("set_point", [0.5, 0.8, 0.96])
@pytest.mark.slow
def test_a_sweep_gives_the_states_of_each_of_its_cases(set_point):
    states = df.at_set_point(grid(), set_point)
    assert states["peak_force"].dims == ("A0", "youngs_modulus", "crossing")
    assert states["phase"].dims == ("A0", "youngs_modulus", "crossing", "tone")
    most = 0
    for place in np.ndindex(3, 2):
        at = dict(zip(("A0", "youngs_modulus"), place, strict=True))
        alone, one = df.at_set_point(grid().isel(at), set_point), states.isel(at, drop=True)
        count = alone.sizes["crossing"]
        most = max(most, count)
        xr.testing.assert_equal(one.isel(crossing=slice(count)).drop_vars("status"), alone)
        assert int(one["status"]) == int(grid().isel(at)["status"].max())
        rest = one.isel(crossing=slice(count, None))
        assert rest["zc"].isnull().all() and rest["peak_force"].isnull().all()
        assert (rest["regime"] == "").all() and (rest["direction"] == "").all()
    assert states.sizes["crossing"] == most > 0


@pytest.mark.slow
def test_a_sweep_that_keeps_few_quantities_reads_across_no_jump_either():
    few = df.at_set_point(grid("amplitude_ratio", "peak_force"), 0.96, ["peak_force"])
    whole = df.at_set_point(grid(), 0.96, ["peak_force"])
    np.testing.assert_allclose(few["zc"], whole["zc"], atol=1e-11)
    assert whole["solved"].any() and not few["solved"].any()
    assert "regime" not in few and grid()["jump_zc"].notnull().any()


def test_a_sweep_without_the_ratio_says_how_to_keep_it():
    without = grid().drop_vars("amplitude_ratio")
    with pytest.raises(df.ParameterError, match="has no 'amplitude_ratio'; add it to the quantities"):
        df.at_set_point(without, 0.8)


def test_a_sweep_of_dwells_over_the_distance_alone_is_a_curve():
    case = df.example("figure-3-air").replace("experiment", df.experiments.Dwell(zc="8 nm"))
    zc = np.linspace(9e-9, 5e-9, 21)
    states = df.at_set_point(df.sweep(case, over={"drive.A0": ["8 nm"], "experiment.zc": zc}), 0.8, ["peak_force"])
    anew = df.approach(case.replace("drive.A0", 8e-9), zc=zc, protocol="stepwise", carry_state=False)
    wanted = df.at_set_point(anew, 0.8, ["peak_force"])
    assert states["zc"].values.shape == (1, 1)
    assert states["zc"].values[0] == pytest.approx(wanted["zc"].values)


@pytest.mark.parametrize(
    ("name", "set_point", "names", "words"),
    [
        ("table-1-am", 0.8, None, "not a curve of amplitudes"),
        ("figure-3-air-jump", 0.0, None, "not above 0"),
        ("figure-3-air-jump", 0.8, ["peak_forse"], "did you mean 'peak_force'"),
    ],
)
def test_what_cannot_be_asked_is_said_in_a_sentence(name, set_point, names, words):
    with pytest.raises(df.ParameterError, match=words):
        df.at_set_point(result(name), set_point, names)


def test_a_motion_without_forces_is_in_no_regime():
    case = df.example("figure-3-air").replace("forces", ()).set("solver.method=transient")
    assert set_point.regime(df.dwell(case, zc="20 nm")) == ""


@pytest.mark.parametrize(
    ("ratios", "sentence"),
    [
        ([1.0, 0.95, 0.4, 0.3], "the amplitude jumps across this set point"),
        ([1.0, 0.95], "A/A0 on this curve is 95 to 100 %. Let experiment.zc stop nearer to the sample."),
        ([0.75, 0.5], "A/A0 on this curve is 50 to 75 %. Let experiment.zc start farther from the sample."),
        ([np.nan, 0.5], "Let experiment.zc start farther"),
        (
            [np.nan, np.nan],
            "no point of this curve has a result: the motion or a force became infinite or not a number.",
        ),
    ],
)
def test_a_set_point_without_a_state_has_its_reason(ratios, sentence):
    status = np.where(np.isnan(ratios), df.Status.FAILED, df.Status.OK).astype(np.int8)
    curve = xr.Dataset({"amplitude_ratio": ("zc", ratios), "status": ("zc", status)})
    assert sentence in set_point.why_none(curve, 0.8)


def test_a_set_point_among_motions_that_need_longer_to_settle_says_so():
    curve = xr.Dataset({"amplitude_ratio": ("zc", [np.nan]), "status": ("zc", np.int8([df.Status.NOT_SETTLED]))})
    assert "settled. Raise the number of periods to settle." in set_point.why_none(curve, 0.8)


def test_a_set_point_among_motions_that_do_not_repeat_has_its_reason():
    status = np.array([df.Status.OK, df.Status.NOT_REPEATING, df.Status.NOT_REPEATING, df.Status.OK], dtype=np.int8)
    curve = xr.Dataset({"amplitude_ratio": ("zc", [1.0, 0.9, 0.6, 0.3]), "status": ("zc", status)})
    assert "does not repeat from period to period" in set_point.why_none(curve, 0.8)
    assert "jumps across" in set_point.why_none(curve, 0.5)


def test_one_case_of_a_sweep_shows_its_states_at_the_set_point():
    case = df.example("figure-3-air").set("experiment.zc.points=23", "experiment.direction=approach")
    grid = df.sweep(case, over={"drive.A0": [8e-9, 10e-9]})
    (row,) = (line for line in df.summary(grid.isel(A0=1)) if line.name == "at_set_point")
    assert row.label == "peak force at 80 %"
    assert row.text.startswith("none at ")
    assert f"{1e9 * float(df.at_set_point(grid.isel(A0=1), 0.8).zc[0]):.3g} nm" in row.text
