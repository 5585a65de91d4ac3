"""A lever that changes on its way to the sample: each point is that of a lever which is so everywhere."""

import re

import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.core.errors import ParameterError
from dforce.instrument import Heights

LEVER = {"f0": 25e3, "k": 0.1, "Q": 2.5}
DRIFT = {"zc": ["0 nm", "20 nm", "1 um"], "Q": [2.0, 2.2, 3.0], "A0": ["8 nm", "9 nm", "12 nm"]}
ZC = [15e-9, 9e-9, 6e-9]
SIZES = {"youngs_modulus": 169e9, "density": 2330.0, "length": 225e-6, "width": 28e-6, "thickness": 3e-6}


def case(drift=None, lever=LEVER, excitation="force", free=False, medium=None):
    force = df.forces.Hertz() if free else df.forces.DMT(hamaker=5e-21)
    return df.Case(
        cantilever=lever if drift is None else lever | {"drift": drift},
        drive={"A0": "10 nm", "excitation": excitation}, medium=medium or {},
        tip={"radius": "10 nm"}, sample={"youngs_modulus": 50e6, "poisson_ratio": 0.5}, forces=[force],
    )  # fmt: skip


@pytest.mark.parametrize("excitation", ["force", "base"])
def test_each_point_of_an_approach_is_that_of_a_lever_with_these_numbers(excitation):
    curve = df.approach(case(DRIFT, excitation=excitation), zc=ZC)
    alone = case(excitation=excitation)
    assert list(curve["status"].values) == [0, 0, 0]
    for i, zc in enumerate(ZC):
        Q, A0 = np.interp(zc, [0.0, 20e-9], [2.0, 2.2]), np.interp(zc, [0.0, 20e-9], [8e-9, 9e-9])
        other = df.dwell(alone.replace("cantilever.Q", Q).replace("drive.A0", A0), zc=zc)
        here = curve.isel(zc=i)
        # between places of the table, where Q changes by 0.1 %, Q and what moves with it are off by 3e-7; the mean
        # deflection, which is small beside the amplitude, by some ten times that
        for name in ("amplitude", "phase", "mean_deflection", "peak_force"):
            assert np.ravel(here[name])[0] == pytest.approx(np.ravel(other[name])[0], rel=2e-5, abs=0.0), name
        energies = [float(one["apparent_dissipated_energy"][0]) for one in (here, other)]
        assert energies[0] == pytest.approx(
            energies[1], rel=0.0, abs=1e-6 * np.pi * 0.1 * A0**2 / Q
        )  # of what the fluid takes
        assert float(here["quality_factor"][0]) == pytest.approx(Q, rel=1e-5)
        assert float(here["free_amplitude"][0]) == pytest.approx(A0, rel=1e-5, abs=0.0)


def test_transient_and_periodic_motions_see_the_same_lever():
    drifting = case(DRIFT)
    orbit, slow = df.dwell(drifting, zc=9e-9), df.dwell(drifting.replace("solver.method", "transient"), zc=9e-9)
    curve = df.approach(drifting, zc=ZC)
    assert float(curve["amplitude"][1, 0]) == pytest.approx(float(orbit["amplitude"][0]), rel=1e-9, abs=0.0)
    assert float(slow["amplitude"][0]) == pytest.approx(float(orbit["amplitude"][0]), rel=1e-4, abs=0.0)
    again = df.motion_at(curve.isel(zc=1))["deflection"].values
    assert again.max() == pytest.approx(float(orbit["max_deflection"]), rel=1e-3, abs=0.0)  # of samples


def test_drive_stays_where_only_q_is_known():
    curve = df.approach(case({"zc": DRIFT["zc"], "Q": DRIFT["Q"]}, free=True), zc=["2 um", "1 um", "0.5 um"])
    Q = np.interp([2e-6, 1e-6, 0.5e-6], [0.0, 20e-9, 1e-6], [2.0, 2.2, 3.0])
    # 10 nm at the lever's own 2.5; the drive is at its resonance
    assert curve["amplitude"].values[:, 0] == pytest.approx(10e-9 * Q / 2.5, rel=1e-5, abs=0.0)


@pytest.mark.parametrize(
    ("zc", "Q"), [([0.0, 1e-6], [2.0, 10.0]), ([0.0, 2e-6], [10.0, 100.0]), ([0.0, 1e-6], [9.0, 0.6])]
)
def test_q_is_linear_between_two_rows_however_different_they_are(zc, Q):
    given = case({"zc": zc, "Q": Q, "A0": [8e-9, 40e-9]}).problem
    for place in np.concatenate([np.linspace(*zc, 41), zc[1] * np.geomspace(1e-4, 1e-1, 31)]):
        modes, (tone,) = given.heights.at(place)
        wanted = np.interp(place, zc, Q)
        # a step of 0.1 % makes Q wrong by a quarter of its square, and A0 / Q by twice that at most
        assert pytest.approx(wanted, rel=4e-7) == modes[0].Q
        assert tone.force == pytest.approx(0.1 * np.interp(place, zc, [8e-9, 40e-9]) / wanted, rel=8e-7)


def test_a_beam_near_the_sample_is_slowed_down_on_its_way():
    lever = {"beam": SIZES | {"tip_height": "15 um", "tilt": "11 deg", "wall": "at_distance"}}
    heights = [40e-6, 10e-6, 1e-6]
    curve = df.approach(case(lever=lever, free=True, medium="water"), zc=heights)
    for i, zc in enumerate(heights):
        fixed = {"beam": lever["beam"] | {"tip_height": 15e-6 + zc, "wall": "at_sample"}}
        (mode,) = case(lever=fixed, medium="water").problem.modes
        assert float(curve["resonance_frequency"][i, 0]) == pytest.approx(mode.f0, rel=2e-5)
        assert float(curve["quality_factor"][i, 0]) == pytest.approx(mode.Q, rel=1e-4)
        drive = case(lever=lever, medium="water").problem.tones[0]
        wanted = drive.force / abs(mode.stiffness(drive.frequency))
        assert float(curve["amplitude"][i, 0]) == pytest.approx(wanted, rel=1e-4, abs=0.0)
    at_sample = case(lever=lever, medium="water").problem.at_height(0.0)
    assert pytest.approx(case(lever=lever, medium="water").problem.modes[0].Q, rel=1e-12) == at_sample.modes[0].Q
    assert (np.diff(curve["quality_factor"].values[:, 0]) < 0.0).all()


def test_a_flat_beam_has_the_q_of_its_height_at_any_distance():
    lever = {"beam": SIZES | {"tip_height": "10 um"}}
    changing = case(lever={"beam": lever["beam"] | {"wall": "at_distance"}}, medium="water").problem
    for zc in (80e-9, 0.31e-6, 1.3e-6, 9e-6):
        (there,) = case(lever={"beam": SIZES | {"tip_height": 10e-6 + zc}}, medium="water").problem.modes
        # between 80 heights at which the flow is computed cubics are right within 5e-5
        assert pytest.approx(there.Q, rel=1e-4) == changing.at_height(zc).modes[0].Q


def test_a_low_tip_is_no_hindrance_where_the_lever_still_oscillates():
    # flat above the sample at 2.5 um, where no tip of 5 um lets it come, its Q would be 0.2
    lever = {"beam": SIZES | {"tip_height": "5 um", "wall": "at_distance"}}
    problem = case(lever=lever, medium="water").problem
    assert pytest.approx(problem.modes[0].Q, rel=1e-12) == problem.at_height(0.0).modes[0].Q
    assert problem.at_height(5e-6).modes[0].Q > 1.5 * problem.modes[0].Q
    with pytest.raises(ParameterError, match=r"Q = 0\.\d+ in this medium; it must be above 0.5"):
        case(lever={"beam": lever["beam"] | {"tip_height": "2.5 um"}}, medium="water")


def test_lever_stays_beyond_the_distances_that_are_known():
    problem = case(DRIFT).problem
    assert isinstance(problem.heights, Heights)
    assert pytest.approx(3.0) == problem.at_height(1.0).modes[0].Q
    assert pytest.approx(2.0) == problem.at_height(-1.0).modes[0].Q
    assert problem.at_height(20e-9).heights is None
    assert pytest.approx(2.5) == case().problem.at_height(1.0).modes[0].Q


def test_drift_is_written_and_read_again():
    given = case(DRIFT)
    assert df.Case.from_toml(given.to_toml()) == given
    typed = df.Drift(zc=["0 nm", "20 nm", "1 um"], Q=[2.0, 2.2, 3.0], A0=["8 nm", "9 nm", "12 nm"])
    assert given.cantilever.drift == typed


def test_what_cannot_drift_is_refused_in_a_sentence():
    for wrong, words in (
        ({"zc": ["1 nm"], "Q": [2.0]}, "two distances or more"),
        ({"zc": ["1 nm", "1 nm"], "Q": [2.0, 2.0]}, "in rising order"),
        ({"zc": ["0 nm", "1 nm"]}, "neither Q nor A0"),
        ({"zc": ["0 nm", "1 nm"], "Q": [2.0]}, "has 1 values for 2 distances"),
    ):
        with pytest.raises(ParameterError, match=words):
            case(wrong)
    with pytest.raises(ParameterError, match="needs one mode and one tone"):
        case(DRIFT, {"modes": [LEVER, LEVER | {"f0": 160e3}]})
    with pytest.raises(ParameterError, match=r"needs cantilever.*tip_height"):
        case(lever={"beam": SIZES | {"wall": "at_distance"}}, medium="water")
    with pytest.raises(ParameterError, match='excludes fluid = "history"'):
        case(lever={"beam": SIZES | {"wall": "at_distance", "tip_height": 5e-6, "fluid": "history"}}, medium="water")
    with pytest.raises(ParameterError, match="a search for operating points needs a lever that is constant"):
        df.regimes(case(DRIFT), over={"tip.radius": [5e-9, 10e-9]}, set_points=[0.5, 0.8])
    data = measured(df.approach(case(DRIFT), zc={"start": "15 nm", "stop": "6 nm", "points": 10}))
    for name, path in (("Q", "cantilever.Q"), ("A0", "drive.A0")):
        with pytest.raises(
            ParameterError, match=f"drift.{name} sets {name} at each distance, so the data do not constrain {path}"
        ):
            df.fit(case(DRIFT), data, free=[path], nuisance=[])


def same(a, b):
    """Say which quantities of two results differ in any bit."""
    kinds = {name: a[name].dtype.kind == "f" for name in a.data_vars if name in b}
    return [name for name, nan in kinds.items() if not np.array_equal(a[name].values, b[name].values, equal_nan=nan)]


@pytest.mark.parametrize("excitation", ["force", "base"])
def test_a_curve_of_a_sweep_is_that_of_its_single_run(excitation):
    asked = case(DRIFT, excitation=excitation).replace("experiment", {"kind": "approach", "zc": ZC})
    # one axis that the lever does not know, and one that changes it
    swept = df.sweep(asked, over={"sample.youngs_modulus": [50e6, 80e6], "cantilever.k": [0.1, 0.13]})
    for i, modulus in enumerate((50e6, 80e6)):
        for j, k in enumerate((0.1, 0.13)):
            alone = df.run(asked.replace("sample.youngs_modulus", modulus).replace("cantilever.k", k))
            assert same(swept.isel(youngs_modulus=i, k=j), alone) == []
    assert float(abs(swept["amplitude"].diff("k")).min()) > 0.0


def test_a_dwell_of_a_sweep_is_that_with_the_lever_there():
    swept = df.sweep(case(DRIFT).replace("experiment", {"kind": "dwell", "zc": 9e-9}), over={"experiment.zc": ZC})
    for i, zc in enumerate(ZC):
        assert same(swept.isel(zc=i), df.dwell(case(DRIFT), zc=zc)) == []


def test_states_fold_where_an_approach_jumps():
    hysteresis = df.example("hysteresis")
    levers = {"zc": ["0 nm", "15 nm", "25 nm"], "Q": [230.0, 245.0, 255.0], "A0": ["19 nm", "19.7 nm", "20 nm"]}
    drifting = hysteresis.replace("cantilever.drift", levers)
    curve = df.run(drifting)
    states = df.branches(drifting, zc=("20.2 nm", "18.5 nm"))
    folds = states["zc"].values[states["special"].values == "fold"]
    # a state is followed to within 1e-7 A0 of its end, and sought up to four times that behind
    assert curve["jump_zc"].values == pytest.approx(folds, rel=0.0, abs=4e-7 * 20e-9)
    assert len(folds) == 2
    without = df.run(hysteresis)["jump_zc"].values
    assert np.abs(curve["jump_zc"].values - without).min() > 1e-10
    at = int(np.flatnonzero(states["stable"].values)[0])
    Q = np.interp(float(states["zc"][at]), [0.0, 15e-9, 25e-9], levers["Q"])
    assert float(states["quality_factor"][at, 0]) == pytest.approx(Q, rel=1e-5)
    again = df.motion_at(states.isel(point=at))["deflection"].values
    assert again.max() == pytest.approx(float(states["max_deflection"][at]), rel=1e-3, abs=0.0)  # of samples


def test_states_along_a_parameter_are_those_with_the_lever_at_their_distance():
    along = {"zc": 9e-9, "start": 49e6, "stop": 51e6}
    found = df.branches(case(DRIFT), parameter="sample.youngs_modulus", search=0, **along)
    point = found.isel(point=int(np.argmin(np.abs(found["youngs_modulus"].values - 50e6))))
    there = case(DRIFT).replace("sample.youngs_modulus", float(point["youngs_modulus"]))
    wanted = df.dwell(there, zc=9e-9)
    assert float(point["amplitude"][0]) == pytest.approx(float(wanted["amplitude"][0]), rel=1e-7, abs=0.0)
    tuned = df.branches(case(DRIFT), zc=9e-9, parameter="drive.frequency", start=24.9e3, stop=25.1e3, search=0)
    swept = df.frequency_sweep(case(DRIFT), zc=9e-9, frequency=tuned["frequency"].values[::10].tolist())
    assert tuned["amplitude"].values[::10, 0] == pytest.approx(swept["amplitude"].values[:, 0, 0], rel=1e-6, abs=0.0)


def measured(curve):
    """Return a curve as it would be measured, without noise."""
    columns = {"height": curve["zc"].values, "amplitude": curve["amplitude"].values[:, 0]}
    columns |= {"phase": curve["phase"].values[:, 0], "branch": np.ones(curve.sizes["zc"])}
    errors = {"amplitude_error": 1e-11, "phase_error": 0.1}
    return xr.Dataset({name: ("point", column) for name, column in columns.items()}, attrs=errors)


def test_a_fit_finds_the_sample_below_a_lever_that_drifts():
    data = measured(df.approach(case(DRIFT, excitation="base"), zc=np.linspace(18e-9, 4e-9, 25).tolist()))
    begun = case(DRIFT, excitation="base").replace("sample.youngs_modulus", 80e6)
    found = df.fit(begun, data, free=["sample.youngs_modulus"])
    assert list(found["parameter"].values) == ["sample.youngs_modulus", "zc_offset", "phase_offset"]
    # the search ends where it gains less than 1e-3 of a standard deviation
    assert float(found["value"][0]) == pytest.approx(50e6, abs=1e-2 * float(found["error"][0]))
    assert found.attrs["chi2"] < 1e-3
    steady = case({"zc": [0.0, 1e-3], "Q": [2.5, 2.5]}, excitation="base").replace("sample.youngs_modulus", 80e6)
    other = df.fit(steady, data, free=["sample.youngs_modulus"], nuisance=["zc_offset", "phase_offset"])
    assert other.attrs["chi2"] > 1e3


def test_drift_comes_from_the_columns_of_a_file(workdir):
    (workdir / "seen.csv").write_text("# from afar\nheight [nm],Q,A0 (nm)\n1000,3,12\n20,2.2,9\n0,2,8\n")
    given = case({"file": "seen.csv"})
    assert given.cantilever.drift == df.Drift(**DRIFT)
    (workdir / "seen.csv").unlink()
    assert df.Case.from_toml(given.to_toml()) == given  # the case holds what the file says
    many = "height [nm],Q\n" + "".join(f"{i},{2 + 1e-3 * i}\n" for i in range(1001))
    (workdir / "many.csv").write_text(many)
    lever = case({"file": "many.csv"}).problem
    assert pytest.approx(2.0075, rel=1e-6) == lever.at_height(7.5e-9).modes[0].Q


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty; its first line names the columns: height, Q, A0"),
        ("z,Q\n0,2\n1,3\n", "has a column 'z'; allowed are height, Q, A0"),
        ("Q\n2\n3\n", "has no column 'height'"),
        ("height,Q,Q\n", "has two columns 'Q'"),
        ("height [kHz],Q\n", "the unit of height is '1 kHz', which is a frequency, not a length"),
        ("height [nm],Q\n0,2\n1\n", "line 3: it has 1 cells for 2 columns"),
        ("height [nm],Q\n0,two\n", "line 2: Q is 'two', which is not a number"),
        ("height [nm],Q\n0,2\n", "needs two distances or more"),
        ("height [nm],Q\n0,2\n0,3\n", "in rising order"),
        ("height [nm]\n0\n1\n", "neither Q nor A0"),
    ],
)
def test_a_mistake_in_a_file_is_one_sentence(text, words, workdir):
    (workdir / "seen.csv").write_text(text)
    with pytest.raises(ParameterError, match=re.escape(words)):
        df.Drift(file="seen.csv")


def test_a_file_that_is_none_and_one_beside_numbers_are_refused(workdir):
    for given, words in (
        ({"file": "none.csv"}, "there is no such file"),
        ({"file": "seen.txt"}, "its name must end in .csv"),
        ({"file": "seen.csv", "Q": [2.0, 3.0]}, "has both file and Q; write only one of them"),
        ({"Q": [2.0, 3.0]}, "zc"),
    ):
        with pytest.raises(ParameterError, match=words):
            df.Drift(**given)
