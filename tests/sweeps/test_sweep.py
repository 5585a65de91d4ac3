"""Sweeps: dimensions, coordinates, mistakes, progress and Ctrl-C."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import xarray as xr
from compiled import ProblemBatch

import dforce as df
from dforce.maps._grid import ProblemGrid
from dforce.maps.axes import make_axes
from dforce.validity import advice_in

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

NM = 1e-9


def case(**changes: object) -> df.Case:
    values = {
        "cantilever": df.Cantilever(f0="50 kHz", k=1.0, Q=100.0),
        "drive": df.Drive(A0="8 nm"),
        "tip": df.Tip(radius="5 nm"),
        "sample": df.Sample(youngs_modulus="1 GPa"),
        "forces": [df.forces.DMT(hamaker="3e-20 J")],
        "experiment": df.experiments.Dwell(zc="7 nm"),
    }
    return df.Case(**values | changes)


def test_parameters_by_path_become_the_first_dimensions():
    result = df.sweep(
        case(), over={"sample.youngs_modulus": ["0.5 GPa", "2 GPa"], "experiment.zc": np.array([5.0, 6.0, 7.0]) * NM}
    )
    assert result.amplitude.dims == ("youngs_modulus", "zc", "tone")
    assert result.youngs_modulus.values.tolist() == [0.5e9, 2e9]
    assert result.youngs_modulus.attrs["units"] == "Pa"
    assert result.youngs_modulus.attrs["path"] == "sample.youngs_modulus"
    assert result.status.dims == ("youngs_modulus", "zc")
    assert (result.status == df.Status.OK).all()
    assert result.attrs["over"] == "sample.youngs_modulus experiment.zc"
    single = df.dwell(case().replace("sample.youngs_modulus", "2 GPa"), zc="6 nm")
    # two orbits that miss their starts by 1e-9, times Q / pi
    assert float(result.amplitude.sel(youngs_modulus=2e9).sel(zc=6 * NM, method="nearest")[0]) == pytest.approx(
        float(single.amplitude[0]), rel=1e-6
    )


def test_an_approach_keeps_its_own_dimensions_behind():
    approach = df.experiments.Approach(zc=["9 nm", "7 nm", "8 nm"], direction="both")
    result = df.sweep(case(experiment=approach), over={"forces.dmt.hamaker": [0.0, 5e-20]})
    assert result.amplitude.dims == ("hamaker", "zc", "direction", "tone")
    single = df.run(case(experiment=approach).replace("forces.dmt.hamaker", 5e-20))
    np.testing.assert_array_equal(result.zc, single.zc)
    np.testing.assert_allclose(result.amplitude.sel(hamaker=5e-20), single.amplitude, rtol=1e-6)


def test_the_motion_at_each_point_is_kept_as_a_single_run_keeps_it():
    approach = df.experiments.Approach(zc=["9 nm", "7 nm", "8 nm"], direction="both")
    result = df.sweep(case(experiment=approach), over={"drive.A0": ["6 nm", "8 nm"]})
    single = df.run(case(experiment=approach))
    assert result.motion.dims == ("A0", "zc", "direction", "component")
    assert result.component.values.tolist() == single.component.values.tolist() == ["z_1", "v_1"]
    assert result.component_units.values.tolist() == ["m", "m/s"]
    assert (result.repeat_periods == 1.0).all()
    size = np.abs(single.motion).max(("zc", "direction"))
    assert float((np.abs(result.motion.isel(A0=1, drop=True) - single.motion) / size).max()) < 1e-8
    point = df.motion_at(result.isel(A0=1, zc=0, direction=1))
    assert float(point.amplitude[0]) == pytest.approx(float(single.amplitude[0, 1, 0]), rel=1e-8)


def test_choices_and_solver_settings_are_swept_over_too():
    result = df.sweep(
        case(),
        over={
            "solver.points_per_period": [64, 128],
            "sample.youngs_modulus": [1e9, 2e9, 3e9],
            "solver.method": ["transient", "periodic"],
        },
    )
    assert result.amplitude.dims == ("points_per_period", "youngs_modulus", "method", "tone")
    assert result.method.values.tolist() == ["transient", "periodic"]
    one = case().replace("solver.points_per_period", 128)
    single = df.run(one.replace("sample.youngs_modulus", 3e9))
    swept = result.isel(points_per_period=1, youngs_modulus=2, method=1)
    assert float(swept.phase[0]) == pytest.approx(float(single.phase[0]), abs=1e-4)


def test_curves_that_go_over_their_points_in_another_order_lie_at_their_own_distances():
    approach = case(experiment=df.experiments.Approach(zc=["9 nm", "7 nm", "8 nm"]))
    result = df.sweep(approach, over={"experiment.direction": ["approach", "retract"], "drive.A0": ["8 nm", "9 nm"]})
    for way in ("approach", "retract"):
        single = df.run(approach.replace("experiment.direction", way))
        swept = result.amplitude.sel({"experiment.direction": way}).isel(A0=0)
        np.testing.assert_allclose(swept, single.amplitude, rtol=1e-6)


@pytest.mark.parametrize(
    "other", [{"experiment.direction": ["both", "retract"]}, {"experiment.zc.stop": ["7 nm", "6 nm"]}]
)
def test_curves_over_other_points_are_refused(other):
    approach = df.experiments.Approach(zc={"start": "9 nm", "stop": "7 nm", "points": 3})
    with pytest.raises(df.ParameterError, match="differs from case to case; give all cases the same"):
        df.sweep(case(experiment=approach), over=other)


def test_names_that_would_be_ambiguous_stay_whole():
    base = case(
        cantilever={"modes": [{"f0": "50 kHz", "k": 1.0, "Q": 100.0}, {"f0": "310 kHz", "k": 39.0, "Q": 300.0}]}
    )
    axes = make_axes(base, {"cantilever.modes.1.Q": [50.0], "cantilever.modes.2.Q": [100.0], "drive.phase": [0.0]})
    assert [axis.dim for axis in axes] == ["cantilever.modes.1.Q", "cantilever.modes.2.Q", "drive.phase"]


def test_problems_of_a_grid_are_those_of_the_cases():
    over = {
        "sample.youngs_modulus": [0.5e9, 2e9], "drive.A0": [6e-9, 9e-9], "cantilever.Q": [50.0, 3000.0],
        "contact.a0": [0.165e-9, 0.2e-9], "tip.radius": [5e-9, 8e-9], "forces.dmt.hamaker": [1e-20, 4e-20],
        "cantilever.f0": [50e3, 70e3], "forces.kelvin_voigt.geometry": ["sphere", "cone"],
    }  # fmt: skip
    forces, tip = (
        [df.forces.DMT(hamaker="3e-20 J"), df.forces.KelvinVoigt()],
        df.Tip(radius="5 nm", half_angle="20 deg"),
    )
    base = case(drive=df.Drive(A0="8 nm", frequency="49 kHz", phase="30 deg"), forces=forces, tip=tip)
    grid = ProblemGrid(base, make_axes(base, over))
    problems = []
    for values in itertools.product(*over.values()):
        one = base
        for path, value in zip(over, values, strict=True):
            one = one.replace(path, value)
        problems.append(one.problem)
    wanted, batch = ProblemBatch.of(problems), grid.batch(np.arange(grid.size))
    for name in ("numbers", "tones", "kinks"):
        np.testing.assert_allclose(getattr(batch, name), getattr(wanted, name), rtol=1e-14)
    for number in (0, 17, grid.size - 1):
        assert grid.problem(number).modes == problems[number].modes
        assert grid.problem(number).tones == problems[number].tones


def test_cases_of_different_free_amplitudes_are_not_taken_for_badly_sampled(as_sampled):
    result = df.sweep(case(), over={"drive.A0": ["6 nm", "7 nm", "8 nm"], "experiment.zc": ["5 nm", "6 nm"]})
    assert (result.status == df.Status.OK).all()


def test_many_problems_cost_little_each(monkeypatch):
    base = case()
    built = []
    build = df.problem.Problem.build
    monkeypatch.setattr(df.problem.Problem, "build", classmethod(lambda cls, *args: built.append(1) or build(*args)))
    over = {"sample.youngs_modulus": np.geomspace(1e8, 1e10, 50), "drive.A0": np.linspace(5e-9, 9e-9, 40)}
    grid = ProblemGrid(base, make_axes(base, over))
    assert grid.size == 2000
    # each axis by itself: no piece of a problem depends on both
    assert len(built) < 50 + 40 + 40


def test_cases_that_do_not_fit_into_lanes_are_run_one_by_one():
    fixed = case(solver=df.SolverSettings(settle="fixed", periods=200))
    result = df.sweep(fixed, over={"sample.youngs_modulus": [1e9, 3e9]}, workers=2)
    for modulus in (1e9, 3e9):
        single = df.run(fixed.replace("sample.youngs_modulus", modulus))
        assert float(result.phase.sel(youngs_modulus=modulus)[0]) == float(single.phase[0])


def test_a_number_that_decides_the_law_of_a_force_may_be_swept_over():
    forces = [{"model": "electrostatic", "bias": "0.5 V", "ac_frequency": "48.9 kHz"}, {"model": "hertz"}]
    lever = df.Cantilever(f0="48.9 kHz", k=1.0, Q=20.0)
    biased = case(forces=forces, solver={"method": "transient"}, cantilever=lever)
    swept = df.sweep(biased, over={"forces.electrostatic.ac_bias": [0.0, 0.3]})
    alone = [df.run(biased.replace("forces.electrostatic.ac_bias", bias)) for bias in (0.0, 0.3)]
    assert swept["amplitude"].values.tolist() == [one["amplitude"].values.tolist() for one in alone]
    assert np.ptp(swept["amplitude"].values) > 1e-11


# some of these cases jump, and each of the lever's decays in its own time
@pytest.mark.parametrize(
    "forces",
    [
        [df.forces.DMT(hamaker="3e-20 J")],
        [df.forces.SLS(instant_modulus="2 GPa", relaxed_modulus="1 GPa", relaxation_time="2 us", elements=4)],
    ],
    ids=["smooth", "with memory"],
)
def test_a_case_has_the_same_numbers_whatever_it_is_solved_beside(forces, cases_a_block):
    approach = df.experiments.Approach(
        zc={"start": "18 nm", "stop": "10 nm", "points": 7}, direction="both", start="rest"
    )
    over = {"drive.A0": ["15 nm", "17 nm"], "cantilever.Q": [80.0, 100.0, 180.0]}
    together = df.sweep(case(forces=forces, experiment=approach), over, workers=1)
    assert "jump_zc" in together or forces[0].memory
    cases_a_block(1)
    alone = df.sweep(case(forces=forces, experiment=approach), over, workers=2)
    xr.testing.assert_identical(alone.assign_attrs(date=""), together.assign_attrs(date=""))


def test_quantities_can_be_chosen():
    result = df.sweep(case(), over={"drive.A0": ["6 nm", "7 nm"]}, quantities=["amplitude", "peak_force"])
    assert set(result.data_vars) == {"amplitude", "peak_force", "status"}
    with pytest.raises(df.ParameterError, match="did you mean 'amplitude'"):
        df.sweep(case(), over={"drive.A0": ["6 nm"]}, quantities=["amplitud"])


def test_progress_counts_every_point():
    told = []
    approach = df.experiments.Approach(zc=["9 nm", "8 nm", "7 nm"])
    df.sweep(case(experiment=approach), {"drive.A0": ["6 nm", "7 nm"]}, progress=lambda *at: told.append(at[:2]))
    assert told[0] == (0, 6)
    assert told[-1] == (6, 6)


def test_ctrl_c_keeps_what_is_done(every_look, cases_a_block):
    cases_a_block(2)

    def stop(done: int, total: int, note: str) -> None:
        if done:
            raise KeyboardInterrupt

    over = {"sample.youngs_modulus": np.geomspace(1e8, 1e10, 2000)}
    result = df.sweep(case(solver={"method": "transient"}), over, workers=1, progress=stop)
    assert result.attrs["interrupted"] == 1
    done = result.status == df.Status.OK
    assert 0 < int(done.sum()) < 2000
    assert np.isfinite(result.amplitude.values[done]).all()
    assert np.isnan(result.amplitude.values[result.status == df.Status.NOT_COMPUTED]).all()


@pytest.mark.parametrize(
    ("over", "sentence"),
    [
        ({}, "over must name the parameters to vary"),
        ({"sample.youngs_modulus": []}, "sample.youngs_modulus has no values"),
        ({"sample.youngs_modulus": "1 GPa"}, "sample.youngs_modulus = 1 GPa is not a list of values"),
        ({"sample.youngs_modulus": ["1 GPa", "-1 GPa"]}, "sample.youngs_modulus = -1 GPa is not above 0 GPa"),
        ({"sample.youngs_modulus": ["1 nm"]}, "sample.youngs_modulus"),
        ({"sample.youngs_modulu": [1e9]}, "did you mean 'sample.youngs_modulus'"),
        ({"forces.jkr.surface_energy": [0.1]}, "the case has no 'forces.jkr"),
        ({"solver.integrator": ["rk5"]}, "solver.integrator = 'rk5' is not one of"),
        ({"drive.A0": np.full(6000, 1e-9), "sample.youngs_modulus": np.full(6000, 1e9)}, "at most"),
    ],
)
def test_a_mistake_is_one_sentence(over, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.sweep(case(), over=over)


def test_a_sweep_needs_an_experiment_and_leaves_its_range_of_distances_alone():
    with pytest.raises(df.ParameterError, match="repeats an experiment; give the case one"):
        df.sweep(case(experiment=None), over={"drive.A0": [1e-9]})
    with pytest.raises(df.ParameterError, match="can be swept over where it is one distance"):
        df.sweep(case(experiment=df.experiments.Approach(zc=["9 nm"])), over={"experiment.zc": [1e-9]})


def test_advice_is_given_at_the_corners_of_a_sweep():
    elastic = case(forces=[df.forces.Hertz()], experiment=df.experiments.Dwell(zc="5 nm"))
    result = df.sweep(
        elastic, over={"sample.youngs_modulus": ["10 MPa", "1 GPa", "300 GPa"], "drive.A0": ["8 nm", "9 nm"]}
    )
    piece = next(piece for piece in advice_in(result) if piece.name == "indentation_and_radius")
    assert piece.text.startswith("At sample.youngs_modulus = 10 MPa, drive.A0 = 9 nm: The indentation is")
    assert piece.found == float(result.max_indentation[0, 1])
    assert advice_in(df.sweep(elastic, over={"sample.youngs_modulus": [1e9, 2e9]})) == []


def test_points_of_a_sweep_that_did_not_settle_are_counted_inside_the_grid_too():
    moving = case(forces=[df.forces.Hertz()], experiment=df.experiments.Dwell(zc="5 nm", start="rest"))
    moving = moving.set("solver.method=transient", "solver.max_periods=20")
    result = df.sweep(moving, over={"sample.youngs_modulus": [1e9, 2e9, 3e9]})
    (piece,) = (piece for piece in advice_in(result) if piece.name == "not_settled")
    assert piece.found == 3


def test_a_curve_that_comes_to_repeat_as_another_one_does_takes_its_turn_once():
    """Pressed to a stiff sample the motion loses its period and finds it again, after as many periods as its neighbor's."""
    case = df.Case(
        cantilever=df.Cantilever(f0="25 kHz", k="0.05 N/m", Q=3.0), drive=df.Drive(A0="3 nm"), tip=df.Tip(radius="10 nm"),
        sample=df.Sample(youngs_modulus="2043.8762 MPa", poisson_ratio=0.5), forces=[df.forces.Hertz()],
        experiment=df.experiments.Approach(zc={"start": "5.5 nm", "stop": "-0.5 nm", "points": 121}),
    )  # fmt: skip
    both = df.sweep(case, {"drive.A0": ["0.5 nm", "4 nm"]})
    alone = df.sweep(case, {"drive.A0": ["4 nm"]})
    np.testing.assert_array_equal(both.amplitude.isel(A0=1), alone.amplitude.isel(A0=0))


def test_a_case_with_memory_has_the_errors_that_it_has_alone():
    solid = {"model": "sls", "instant_modulus": "1 GPa", "relaxed_modulus": "0.2 GPa", "relaxation_time": "3 us"}
    distances = {"of": "drive.A0", "start": 1.2, "stop": 0.3, "points": 10}
    case = df.Case(
        cantilever={"f0": "70 kHz", "k": 2, "Q": 400},
        drive={"A0": "20 nm"},
        tip={"radius": "10 nm"},
        forces=[solid],
        experiment={"kind": "approach", "zc": distances, "direction": "both"},
    )
    several = df.sweep(case, over={"drive.A0": ["20 nm", "21 nm", "22 nm"]})
    for number, A0 in enumerate(several.A0.values):
        alone = df.run(case.replace("drive.A0", float(A0)))
        np.testing.assert_allclose(several.error_estimate[number], alone.error_estimate, rtol=1e-6)
        np.testing.assert_array_equal(several.status[number], alone.status)
