"""Runs: progress, Ctrl-C, going on later with the same numbers, and what a result says about itself."""

import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce import runs


@pytest.fixture(autouse=True)
def every_call_of_progress(monkeypatch):
    monkeypatch.setattr(runs, "LOOKS_A_SECOND", 1e9)


def approach(integrator="rk4", direction="both", carry_state=True, **solver):
    case = df.example("table-1-am").replace("cantilever.Q", 20)
    experiment = df.Approach(
        zc=[4.8e-9, 4.5e-9, 4.2e-9, 4e-9], direction=direction, carry_state=carry_state, start="rest"
    )
    settings = df.SolverSettings(**{"method": "transient", "integrator": integrator, **solver})
    return case.replace(experiment=experiment, solver=settings)


def stop_after(points, calls=2):
    """Return a progress function that presses Ctrl-C a little after so many points."""
    seen = 0

    def progress(done, total, note):
        nonlocal seen
        if done >= points:
            seen += 1
            if seen == calls:
                raise KeyboardInterrupt

    return progress


SOLVERS = [
    {"integrator": "rk4"},
    {"integrator": "rk4", "carry_state": False},
    {"integrator": "rk4", "direction": "approach", "settle": "fixed", "periods": 50},
    {"integrator": "adaptive"},
    {"integrator": "lsoda", "direction": "approach"},
]


@pytest.mark.parametrize("settings", SOLVERS, ids=str)
@pytest.mark.parametrize("points", [0, 3])
def test_a_run_that_was_stopped_goes_on_to_the_same_numbers_bit_for_bit(settings, points, tmp_path):
    case = approach(**settings)
    whole = df.run(case)
    part = df.run(case, stop_after(points))
    assert part.attrs["interrupted"] == 1
    assert int((part.status != df.Status.NOT_COMPUTED).sum()) == points
    df.write(part, tmp_path / "part.nc")
    rest = df.run(case, resume=df.read(tmp_path / "part.nc"))
    assert "interrupted" not in rest.attrs
    for name in whole.data_vars:
        np.testing.assert_array_equal(rest[name].values, whole[name].values, err_msg=str(name))
    xr.testing.assert_equal(rest.drop_attrs(), whole.drop_attrs())


def test_points_done_before_ctrl_c_are_those_of_the_whole_run():
    case = approach(direction="approach")
    whole, part = df.run(case), df.run(case, stop_after(2))
    done = (part.status != df.Status.NOT_COMPUTED).values
    assert done.tolist() == [True, True, False, False]
    np.testing.assert_array_equal(part.amplitude.values[done], whole.amplitude.values[done])
    assert np.isnan(part.amplitude.values[~done]).all()


@pytest.mark.parametrize(("method", "points"), [*(("periodic", points) for points in range(15, 18)), ("transient", 17)])
def test_a_run_stopped_beside_a_jump_finds_it_when_it_goes_on(points, method):
    case = (
        df.example("figure-3-air-jump")
        .replace("solver.method", method)
        .replace(experiment={"kind": "approach", "zc": {"start": "11 nm", "stop": "9 nm", "points": 21}})
    )
    whole = df.run(case)
    assert whole.sizes["jump"] == 1  # between 9.4 and 9.3 nm: points 17 and 18
    rest = df.run(case, resume=df.run(case, stop_after(points)))
    np.testing.assert_allclose(rest.amplitude.values, whole.amplitude.values, rtol=1e-8)
    for name in ("jump_zc", "jump_before", "jump_after"):
        np.testing.assert_allclose(rest[name].values, whole[name].values, rtol=1e-8)


def test_a_run_stopped_where_a_branch_ends_jumps_at_the_same_distance_when_it_goes_on():
    """The attractive orbit goes on beside the kink for twenty of these steps, and each kicks the motion off it."""
    distances = {"start": "7.3 nm", "stop": "7.17 nm", "points": 25}
    start = {"amplitude": 7.130e-9, "phase": np.radians(134.6)}
    case = df.example("figure-3-air-jump").replace(
        experiment={"kind": "approach", "zc": distances, "start": start, "direction": "approach"}
    )
    transient = df.run(case.replace("solver.method", "transient"))
    for points in (15, 20, 21, 22):
        rest = df.run(case, resume=df.run(case, stop_after(points)))
        np.testing.assert_allclose(rest.amplitude.values, transient.amplitude.values, atol=1e-13)


@pytest.mark.parametrize(
    ("method", "points"), [("periodic", 1), ("periodic", 15), ("periodic", 31), ("periodic", 50), ("transient", 31)]
)
def test_a_stopped_resonance_curve_goes_on_from_where_it_was(points, method, tmp_path):
    frequency = {"start": "48.5 kHz", "stop": "49.7 kHz", "points": 31}
    case = df.example("resonance-curve").set(f"solver.method={method}").replace("experiment.frequency", frequency)
    whole, part = df.run(case), df.run(case, stop_after(points))
    assert int((part.status != df.Status.NOT_COMPUTED).sum()) == points
    df.write(part, tmp_path / "part.nc")
    calls = []
    rest = df.run(case, lambda done, total, note: calls.append(done), resume=df.read(tmp_path / "part.nc"))
    assert calls[0] == points and "interrupted" not in rest.attrs
    # orbits are sought anew from where the run was stopped: they miss their starts by 1e-10, times Q / pi
    tolerance = 1e-7 if method == "periodic" else 0.0
    np.testing.assert_allclose(rest.amplitude.values, whole.amplitude.values, rtol=tolerance)
    np.testing.assert_array_equal(rest.status.values, whole.status.values)


def test_a_run_can_be_stopped_twice():
    case = approach(direction="approach")
    first = df.run(case, stop_after(1))
    second = df.run(case, stop_after(3), resume=first)
    assert int((second.status != df.Status.NOT_COMPUTED).sum()) == 3
    last = df.run(case, resume=second)
    np.testing.assert_array_equal(last.amplitude.values, df.run(case).amplitude.values)


def test_ctrl_c_during_a_dwell_gives_a_result_that_says_so():
    case = df.example("table-1-am").replace("solver.method", "transient")
    result = df.run(case, stop_after(0))
    assert result.attrs["interrupted"] == 1
    assert int(result.status) == df.Status.NOT_COMPUTED


def test_only_an_unfinished_run_of_the_same_case_goes_on():
    case = approach(direction="approach")
    part, whole = df.run(case, stop_after(1)), df.run(case)
    with pytest.raises(df.ParameterError, match="complete"):
        df.run(case, resume=whole)
    with pytest.raises(df.ParameterError, match="another case"):
        df.run(case.replace("cantilever.k", "1 N/m"), resume=part)
    with pytest.raises(df.ParameterError, match="experiment"):
        df.run(case.replace(experiment=None))
    with pytest.raises(df.ParameterError, match="sweep"):
        df.run(case, resume=part.assign_attrs(over="drive.A0"))


def test_a_result_holds_its_case_and_repeats_itself_from_it():
    result = df.run(approach(direction="approach"))
    again = df.run(df.Case.from_toml(result.attrs["case"]))
    np.testing.assert_array_equal(again.amplitude.values, result.amplitude.values)
    assert result.attrs["dforce_version"] == df.__version__
    assert result.amplitude.attrs["units"] == "m"
    assert result.phase.attrs["units"] == "degree"


def test_progress_is_throttled_but_the_end_is_always_told(monkeypatch):
    monkeypatch.setattr(runs, "LOOKS_A_SECOND", 1e-3)
    calls = []
    df.run(approach(), lambda done, total, note: calls.append((done, total)))
    assert calls[0] == (0, 8)
    assert calls[-1] == (8, 8)
    assert len(calls) == 2


def test_settings_given_in_python_override_those_of_the_case():
    case = approach(direction="approach")
    curve = df.approach(case, zc="4.5 nm", harmonics=3)
    assert curve.sizes == {"zc": 1, "tone": 1, "mode": 1, "harmonic": 3}
    with pytest.raises(df.ParameterError, match="harmonic"):
        df.approach(case, zc="4.5 nm", harmonic=3)
