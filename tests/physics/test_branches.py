"""Curves of states: what they must agree with is the transient, the identities of docs/theory/identities.md, and each other."""

import collections
import math

import numpy as np
import pytest
from tiers import some_long

import dforce as df
from dforce.core.errors import ParameterError
from dforce.solvers import continuation

NM = 1e-9
# of figure 3 with DMT: the transient with steps of its own keeps the repulsive state at 9.78 nm and jumps before 9.80 nm
FOLD = 9.794e-9


@pytest.fixture(scope="module")
def case():
    return df.example("figure-3-branches")


@pytest.fixture(scope="module")
def states(case):
    return df.run(case)


def of_curve(states, number):
    return states.isel(point=np.flatnonzero(states["branch"].values == number))


def at(states, zc):
    """Return amplitude (m), phase (degrees) and stability of all states at a distance, by linear interpolation."""
    found = []
    for number in np.unique(states["branch"]):
        curve = of_curve(states, number)
        x, a, phi = curve["zc"].values, curve["amplitude"].values[:, 0], curve["phase"].values[:, 0]
        for i in np.flatnonzero((x[:-1] - zc) * (x[1:] - zc) <= 0):
            s = (zc - x[i]) / (x[i + 1] - x[i])
            found.append((a[i] + s * (a[i + 1] - a[i]), phi[i] + s * (phi[i + 1] - phi[i]), bool(curve["stable"][i])))
    return sorted(found)


def test_the_repulsive_branch_of_figure_3_folds_where_the_transient_loses_it(case, states):
    folds = states["zc"].values[states["special"].values == "fold"]
    assert folds == pytest.approx([FOLD], abs=1e-4 * NM)
    zc = np.array([9.5, 9.6, 9.7, 9.75, 9.78, 9.81]) * NM
    start = {"amplitude": "9.74 nm", "phase": "77 deg"}
    slow = df.approach(case.replace("solver.method", "transient"), zc=zc, direction="retract", start=start)
    assert (slow["phase"].values[:-1, 0] < 90).all()
    assert slow["phase"].values[-1, 0] > 100


def test_two_stable_states_and_an_unstable_one_between_them_exist_at_8_nm(states):
    attractive, unstable, repulsive = at(states, 8 * NM)
    assert (attractive[2], unstable[2], repulsive[2]) == (True, False, True)
    assert attractive[1] > unstable[1] > 90 > repulsive[1]
    assert [len(at(states, zc * NM)) for zc in (2, 5, 9.7, 9.9, 11)] == [3, 3, 3, 1, 1]


def test_the_repulsive_branch_is_detached_from_the_attractive_one_and_found_by_the_search(states):
    assert list(np.unique(states["branch"])) == [1, 2]
    first, second = of_curve(states, 1), of_curve(states, 2)
    assert first["zc"].values[[0, -1]] == pytest.approx([12 * NM, 1 * NM], abs=1e-18)
    assert first["stable"].all()
    assert second["zc"].values[[0, -1]] == pytest.approx([1 * NM, 1 * NM], abs=1e-18)


@pytest.mark.parametrize(("number", "direction"), [(1, "approach"), (2, "retract")])
def test_stable_states_are_those_of_the_transient(case, states, number, direction):
    curve = of_curve(states, number)
    # in steps small enough that the transient stays on its branch
    there = curve["stable"].values & (curve["zc"].values > 7.5 * NM) & (curve["zc"].values < 9.7 * NM)
    chosen = curve.isel(point=np.flatnonzero(there)[::3]).sortby("zc")
    first = chosen.isel(point=0 if direction == "retract" else -1)
    start = {"amplitude": float(first["amplitude"][0]), "phase": np.radians(float(first["phase"][0]))}
    settings = case.replace("solver", {"method": "transient", "settle_tolerance": 1e-8})
    slow = df.approach(settings, zc=chosen["zc"].values, direction=direction, start=start)
    assert slow["amplitude"].values[:, 0] == pytest.approx(chosen["amplitude"].values[:, 0], abs=1e-7 * 10 * NM)
    assert slow["phase"].values[:, 0] == pytest.approx(chosen["phase"].values[:, 0], abs=1e-5)


def test_the_identities_hold_on_every_orbit_stable_or_not(case, states):
    mode, tone = case.problem.modes[0], case.problem.tones[0]
    a, phi = states["amplitude"].values[:, 0], np.radians(states["phase"].values[:, 0])
    energy = np.pi * tone.force * a
    force = np.abs(states["min_force"].values) * states["contact_fraction"].values.clip(0.01)
    assert (~states["stable"]).sum() > 100
    assert np.abs(mode.k * states["mean_deflection"] - states["mean_force"]).max() < 1e-4 * force.max()
    virial = -mode.k * a * tone.A0 * np.cos(phi) / (2 * mode.Q)
    assert states["virial"].values[:, 0] == pytest.approx(virial, abs=1e-5 * energy.max())
    loss = np.pi * mode.k * a / mode.Q * (tone.A0 * np.sin(phi) - a)
    assert states["dissipated_energy"].values[:, 0] == pytest.approx(loss, abs=1e-5 * energy.max())
    # DMT takes nothing from the motion
    assert np.abs(states["total_dissipated_energy"].values).max() < 1e-5 * energy.max()


def test_multipliers_multiply_to_the_damping_of_one_period(case, states):
    error = np.abs(states["multiplier_modulus"].values.prod(axis=1) * np.exp(2 * np.pi / case.problem.modes[0].Q) - 1)
    assert np.median(error) < 2e-6
    # an orbit that grazes the surface has neighbors that touch it and others that do not
    assert error.max() < 1e-4


def test_a_multiplier_passes_one_at_a_fold(states):
    fold = states.isel(point=np.flatnonzero(states["special"].values == "fold"))
    assert fold["multiplier_modulus"].values[:, 0] == pytest.approx(1.0, abs=1e-5)
    assert fold["multiplier_angle"].values[:, 0] == pytest.approx(0.0, abs=1e-9)


def test_the_fold_is_the_same_with_an_integrator_that_controls_its_steps(case):
    near = {"zc": ("9.9 nm", "9.3 nm"), "search": 2, "largest_step": 0.05}
    engine = df.branches(case.replace("solver", {"integrator": "engine", "method": "transient"}), **near)
    fold = engine["zc"].values[engine["special"].values == "fold"]
    assert fold == pytest.approx([FOLD], abs=1e-4 * NM)


def test_the_estimated_error_of_a_fold_is_how_far_it_lies_from_where_it_is(case):
    near = {"zc": ("9.9 nm", "9.3 nm"), "search": 2, "largest_step": 0.05}
    found = [df.branches(case.replace("solver.points_per_period", points), **near) for points in (128, 4096)]
    folds = [one.isel(point=int(np.flatnonzero(one["special"].values == "fold")[0])) for one in found]
    away = abs(float(folds[0]["zc"] - folds[1]["zc"])) / case.problem.tones[0].A0
    assert 1e-6 < away < 3.0 * float(folds[0]["error_estimate"])
    assert float(folds[1]["error_estimate"]) < 1e-6


def test_branches_along_a_parameter_meet_those_along_the_distance(case):
    along_zc = df.branches(case, zc=("12 nm", "9 nm"), largest_step=0.04, search=3)
    stiffer = df.branches(
        case.replace(experiment=None), zc="9 nm", parameter="sample.youngs_modulus", start="1 GPa", stop="2 GPa",
        largest_step=0.04, search=2,
    )  # fmt: skip
    assert stiffer["youngs_modulus"].attrs["units"] == "Pa"
    assert float(stiffer["zc"]) == 9e-9
    here = np.sort(along_zc["amplitude"].values[np.isclose(along_zc["zc"], 9e-9, rtol=1e-12, atol=0.0), 0])
    there = np.sort(stiffer["amplitude"].values[np.isclose(stiffer["youngs_modulus"], 1e9, rtol=1e-12), 0])
    assert len(here) == 3
    assert there == pytest.approx(here, rel=1e-7, abs=0.0)


def test_branches_without_a_search_say_that_no_state_is_near_the_free_motion(case):
    moduli = {"parameter": "sample.youngs_modulus", "start": "0.5 GPa", "stop": "2 GPa"}
    with pytest.raises(df.ParameterError, match="search = 0 looks near the free motion alone, where no state is"):
        df.branches(case, zc="5 nm", search=0, **moduli)


def test_an_s_shaped_curve_along_the_free_amplitude_is_followed_through_both_folds(case):
    curve = df.branches(case, zc="9 nm", parameter="drive.A0", start="2 nm", stop="20 nm", search=0)
    assert set(np.unique(curve["branch"])) == {1}
    folds = curve["A0"].values[curve["special"].values == "fold"]
    assert len(folds) == 2
    low, high = sorted(folds)
    slow = case.replace("solver.method", "transient")
    # below the folds there is the attractive state alone, above them the repulsive one
    repulsive, attractive = {"amplitude": "9.26 nm", "phase": "68 deg"}, {"amplitude": "8.9 nm", "phase": "118 deg"}
    below = df.dwell(slow.replace("drive.A0", 0.99 * low), zc="9 nm", start=repulsive)
    above = df.dwell(slow.replace("drive.A0", 1.01 * high), zc="9 nm", start=attractive)
    assert float(below["phase"][0]) > 90 > float(above["phase"][0])


def test_the_drive_frequency_is_varied_at_constant_force(case):
    far = df.branches(
        case, zc="60 nm", parameter="drive.frequency", start="48.8 kHz", stop="49 kHz", search=0, largest_step=0.05
    )
    mode, force = case.problem.modes[0], case.problem.tones[0].force
    r = far["frequency"].values / mode.f0
    exact = force / mode.k / np.abs(1 - r**2 + 1j * r / mode.Q)
    # the attraction at 60 nm shifts the resonance by H R / (18 k d^3) = 1e-8, times Q on the flanks
    assert far["amplitude"].values[:, 0] == pytest.approx(exact, rel=1e-5, abs=0.0)


@pytest.mark.long
def test_a_curve_that_closes_ends_where_it_began(case):
    # with fewer samples the instants at which the neck forms and breaks fold the curve a few times more
    fine = case.replace("solver.points_per_period", 4096)
    sticky = fine.replace("forces", [df.forces.JKR(surface_energy="30 mJ/m^2")])
    loop = df.branches(sticky, zc=("12 nm", "1 nm"), search=3)
    closed = of_curve(loop, 2)
    for name in ("zc", "amplitude", "phase"):
        assert closed[name].values[0] == pytest.approx(closed[name].values[-1], rel=1e-12, abs=0.0)
    assert (closed["special"].values == "fold").sum() == 2
    assert np.unique(loop["branch"]).size == 2


def test_tones_without_a_common_period_are_refused_in_one_sentence():
    case = df.example("table-1-bimodal").replace("drive.tones.2.frequency", 282e3 * 1.00012345)
    with pytest.raises(ParameterError, match="have no common period of up to 200 periods"):
        df.branches(case, zc=("12 nm", "3 nm"))
    with pytest.raises(ParameterError, match="ratio of the tones' frequencies changes"):
        df.branches(
            df.example("figure-6"), zc="8 nm", parameter="drive.tones.1.frequency", start="49 kHz", stop="51 kHz"
        )


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"zc": "9 nm"}, "one distance; write a range, or a parameter"),
        ({"zc": ("9 nm", "9 nm")}, "starts and stops at one distance"),
        ({"zc": ("9 nm", "8 nm"), "start": 1.0}, "start and stop need a parameter"),
        ({"zc": ("9 nm", "8 nm"), "parameter": "drive.A0"}, "is a range, and so is the range of drive.A0"),
        ({"zc": "9 nm", "parameter": "drive.A0", "start": "1 nm"}, "experiment.start and stop .* are missing"),
        ({"zc": "9 nm", "parameter": "drive.frequncy", "start": 1e4, "stop": 2e4}, "did you mean 'drive.frequency'"),
        (
            {"zc": "9 nm", "parameter": "drive.A0", "start": "1 GPa", "stop": 2e-9},
            "start is '1 GPa', which is a pressure",
        ),
        ({"zc": "9 nm", "parameter": "cantilever.Q", "start": 0.1, "stop": 9.0}, "is not above 0.5"),
        ({"zc": "9 nm", "parameter": "solver.method", "start": 1.0, "stop": 2.0}, "is not a quantity"),
    ],
)
def test_a_range_that_makes_no_sense_is_refused_in_one_sentence(case, settings, sentence):
    with pytest.raises(ParameterError, match=sentence):
        df.branches(case.replace(experiment=None), **settings)


def test_ctrl_c_keeps_the_points_that_are_done(case):
    calls = 0

    def stop_soon(done, total, note):
        nonlocal calls
        calls += 1
        if calls > 3:
            raise KeyboardInterrupt

    part = df.run(case.replace("experiment.largest_step", 0.001), progress=stop_soon)
    assert part.attrs["interrupted"] == 1
    assert 1 < part.sizes["point"] < 1000
    assert np.isfinite(part["amplitude"]).all()


def stopped(case, when, resume=None):
    """Return the branches of a case, stopped where `when` says yes to the searches done, the curve, and looks at it."""
    looks = collections.Counter()

    def progress(done, total, note):
        curve = note.split(",")[0]
        looks[curve] += 1
        if when(done, curve, looks[curve]):
            raise KeyboardInterrupt

    return df.run(case, progress, resume)


def assert_same(rest, whole):
    assert set(rest.variables) == set(whole.variables) and "interrupted" not in rest.attrs
    for name in whole.variables:
        np.testing.assert_array_equal(rest[name].values, whole[name].values, err_msg=str(name))


STICKY = {  # a neck takes energy at each tap: too much for a state between 20.5 and 19 nm
    "cantilever": {"f0": "70 kHz", "k": "2 N/m", "Q": 100},
    "drive": {"A0": "20 nm", "operation": "ce_fm"},
    "tip": {"radius": "20 nm"},
    "sample": {"youngs_modulus": "2 GPa", "poisson_ratio": 0.3},
    "forces": [{"model": "capillary"}, {"model": "hertz"}],
    "experiment": {"kind": "branches", "zc": {"start": "25 nm", "stop": "5 nm"}},
}
# two curves: the first from far away, the second found by the second of three searches
SHORT = {"search": 3, "largest_step": 0.05}
MOMENTS = {
    "at the first look": lambda done, curve, look: True,
    "within the first curve": lambda done, curve, look: look == 12,
    "in a search that finds nothing": lambda done, curve, look: done == 1,
    "as the second curve is found": lambda done, curve, look: curve == "curve 2",
    "within the second curve": lambda done, curve, look: curve == "curve 2" and look == 30,
    "far along the second curve": lambda done, curve, look: curve == "curve 2" and look == 70,
    "in the last search": lambda done, curve, look: done == 3,
    "when all is done": lambda done, curve, look: done == 5,
}


@pytest.fixture(scope="module")
def detached(case):
    """Return cases whose second curve is open or closed, all their states, and how often progress was looked at."""
    short = case.replace(experiment=case.experiment.replace(**SHORT))
    sticky = df.Case(**STICKY)
    locked = sticky.replace(experiment=sticky.experiment.replace(**SHORT))
    cases = {
        "open": short,
        "locked": locked,
        "closed": short.replace("forces", [df.forces.JKR(surface_energy="30 mJ/m^2")]),
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dforce.runs.LOOKS_A_SECOND", math.inf)  # as in the tests: at each look
        return {name: (one, *looked_at(one)) for name, one in cases.items()}


def looked_at(case, resume=None):
    """Return the branches of a case, and how many looks there were at the progress."""
    looks = []
    return df.run(case, lambda *look: looks.append(look), resume), len(looks)


STOPS = {f"{moment}, {second}": (moment, second) for second in ("open", "closed", "locked") for moment in MOMENTS}
del STOPS["when all is done, locked"]  # which has no doublings to search
# one of each kind is quick: at the begin, along an open and a closed curve, in a search, at the end
QUICK = {
    "as the second curve is found, locked",
    "at the first look, open",
    "in the last search, open",
    "when all is done, open",
} | {f"within the second curve, {second}" for second in ("open", "closed")}


@pytest.mark.parametrize("name", some_long(STOPS, {*STOPS} - QUICK))
def test_stopped_curves_go_on_to_the_same_states_bit_for_bit(detached, name, every_look, tmp_path):
    moment, second = STOPS[name]
    case, whole, looks = detached[second]
    part = stopped(case, MOMENTS[moment])
    assert part.attrs["interrupted"] == 1
    rest, looks_at_rest = looked_at(case, df.read(df.write(part, tmp_path / "part.nc")))
    assert_same(rest, whole)
    # a search that is done again takes a dozen; of the points kept only starts and special ones take none by themselves
    assert looks_at_rest <= looks - part.sizes["point"] + 20


def test_curves_may_be_stopped_again_while_an_old_search_is_done_again(detached, every_look):
    case, whole, _ = detached["open"]
    first = stopped(case, MOMENTS["within the second curve"])
    second = stopped(case, MOMENTS["at the first look"], first)
    assert second.sizes["point"] == first.sizes["point"] > (whole["branch"] == 1).sum()
    assert_same(df.run(case, resume=second), whole)


def test_a_curve_goes_on_even_where_its_search_finds_it_no_more(detached, every_look, monkeypatch):
    case, whole, _ = detached["open"]
    part = stopped(case, MOMENTS["within the second curve"])
    monkeypatch.setattr("dforce.procedures.branches.search", lambda *others: iter(()))
    assert_same(df.run(case, resume=part), whole)


def test_branches_survive_being_written_and_read(states, tmp_path):
    assert df.read(df.write(states, tmp_path / "states.nc")).identical(states)
    lines = df.write(states, tmp_path / "states.csv").read_text(encoding="utf-8").splitlines()
    header = next(line for line in lines if line.startswith("point,"))
    assert {"zc (m)", "branch", "stable", "special"} <= set(header.split(","))


def test_branches_have_a_picture_and_a_summary(states):
    upper, lower, *_ = df.plot.overview(states)
    assert len(upper.get_lines()) == 4  # attractive, repulsive, unstable, and the mark of the fold
    assert lower.get_xlabel().startswith("average distance")
    found = {finding.name: finding for finding in df.summary(states)}
    assert found["fold"].value == pytest.approx([FOLD], abs=1e-4 * NM)
    assert found["fold"].text == "9.794 nm"
    assert found["curves"].value == 2


def test_a_curve_that_closes_from_the_other_side_alone_holds_each_orbit_once(monkeypatch):
    def trace(among, points, way, *others):
        points += ["ahead"] if way > 0 else ["behind", "ahead", "start"]
        return way < 0

    monkeypatch.setattr(continuation, "trace", trace)
    curve = continuation.Curve("start")
    curve.grow(None, 1.0, 100, lambda: None)
    assert curve.points == ["start", "ahead", "behind", "start"]


def test_a_curve_that_closed_behind_its_start_is_whole_when_it_is_restored(monkeypatch):
    class Orbit:
        def __init__(self, *u):
            self.u = np.array(u)

    around = [Orbit(0.0, 0.0), Orbit(-1.0, 1.0), Orbit(-2.0, 0.0), Orbit(-1.0, -1.0), Orbit(0.0, 0.0)]
    curve = continuation.Curve.of_points(around[::-1], len(around))
    monkeypatch.setattr(continuation, "trace", None)  # would lead around once more
    curve.grow(None, 1.0, 100, lambda: None)
    assert curve.points == around[::-1]
    assert curve.begun == 5
