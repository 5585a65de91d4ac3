"""Runs: progress, Ctrl-C, going on later with the same numbers, and what a result says about itself."""

import functools
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tiers import some_long

import dforce as df
from dforce import runs
from dforce.solvers import accuracy, transient

# processes, stops and sweeps, left out by `make check`; progress is reported at each look
pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("every_look")]

CHUNK = 64  # points that a slow change goes through in one stretch, at whose start it can go on


QUICK = df.example("table-1-am").replace("cantilever.Q", 20)


def approach(case=QUICK, integrator="rk4", direction="both", protocol="quasi_static", carry_state=True, **solver):
    experiment = df.experiments.Approach(
        zc=[4.8e-9, 4.5e-9, 4.2e-9, 4e-9], direction=direction, protocol=protocol, carry_state=carry_state, start="rest"
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


def points_of(part):
    return int((part.status != df.Status.NOT_COMPUTED).sum())


def assert_same(rest, whole):
    assert "interrupted" not in rest.attrs
    for name in whole.data_vars:
        np.testing.assert_array_equal(rest[name].values, whole[name].values, err_msg=str(name))
    xr.testing.assert_equal(rest.drop_attrs(), whole.drop_attrs())


SOLVERS = [
    {"integrator": "rk4"},
    {"integrator": "rk4", "protocol": "stepwise", "carry_state": False},
    {"method": "periodic", "protocol": "stepwise"},
    # the motion at the end of 51 periods and 8 measured ones is in the middle of a common period
    {"case": df.example("figure-6"), "direction": "approach", "settle": "fixed", "periods": 51},
    pytest.param(
        {"case": df.example("table-1-bimodal"), "direction": "approach", "settle": "fixed", "periods": 51},
        marks=pytest.mark.long,
    ),
    {"integrator": "rk4", "direction": "approach", "settle": "fixed", "periods": 50},
    {"integrator": "engine", "method": "transient"},
    {"integrator": "lsoda", "direction": "approach", "settle": "fixed", "periods": 50},
    pytest.param({"integrator": "lsoda", "direction": "approach"}, marks=pytest.mark.long),
]


@pytest.mark.parametrize("settings", SOLVERS, ids=lambda one: str({k: v for k, v in one.items() if k != "case"}))
def test_a_run_that_was_stopped_goes_on_to_the_same_numbers_bit_for_bit(settings, tmp_path):
    case = approach(**settings)
    whole = df.run(case)
    for points in (0, 3):
        part = df.run(case, stop_after(points))
        assert part.attrs["interrupted"] == 1
        assert points_of(part) == points
        df.write(part, tmp_path / "part.nc")
        assert_same(df.run(case, resume=df.read(tmp_path / "part.nc")), whole)


def test_points_done_before_ctrl_c_are_those_of_the_whole_run():
    case = approach(direction="approach")
    whole, part = df.run(case), df.run(case, stop_after(2))
    done = (part.status != df.Status.NOT_COMPUTED).values
    assert done.tolist() == [True, True, False, False]
    np.testing.assert_array_equal(part.amplitude.values[done], whole.amplitude.values[done])
    assert np.isnan(part.amplitude.values[~done]).all()


def grid(start, stop, points, unit="nm"):
    return {"start": f"{start} {unit}", "stop": f"{stop} {unit}", "points": points}


STIFF = df.Case(
    cantilever=df.Cantilever(f0="70 kHz", k=2.7, Q=180), drive=df.Drive(A0="30 nm"), tip=df.Tip(radius="8 nm"),
    sample=df.Sample(youngs_modulus="2 GPa"),
    forces=[df.forces.DMT(hamaker="6e-20 J"), df.forces.KelvinVoigt(viscosity="20 Pa s")],
    experiment=df.experiments.Approach(zc=grid(34, 18, 101), direction="both"),
)  # fmt: skip
# a bond that pulls by more than the lever holds: two different taps that repeat together, until that state ends
ALTERNATING = df.Case(
    cantilever=df.Cantilever(f0="50 kHz", k=0.57, Q=28), drive=df.Drive(A0="1.6 nm", frequency="49 kHz"),
    forces=[df.forces.Morse(bond_energy="1.42e-18 J", decay="1.31 1/nm", bond_length="0.62 nm")],
    experiment=df.experiments.Approach(
        zc=grid(2.86, 2.8855, 80), direction="retract", start={"amplitude": "0.17358 nm", "phase": "175.85 deg"}
    ),
)  # fmt: skip
RELAXING = df.Case(
    cantilever=df.Cantilever(f0="63 kHz", k=9.5, Q=2.7), drive=df.Drive(A0="24 nm"), tip=df.Tip(radius="16 nm"),
    sample=df.Sample(poisson_ratio=0.3),
    forces=[df.forces.SLS(instant_modulus="100 MPa", relaxed_modulus="50 MPa", relaxation_time="4 us", elements=4)],
    experiment=df.experiments.Approach(zc=grid(30, 18, 70)),
)  # fmt: skip
BOUNCING = df.Case(  # without any period between 0.32 and 0.14 nm
    cantilever=df.Cantilever(f0="395 kHz", k=0.0853, Q=23.7), drive=df.Drive(A0="3.08 nm", frequency="385.8 kHz"),
    tip=df.Tip(radius="10.7 nm"), sample=df.Sample(youngs_modulus="5.3 GPa"), contact=df.Contact(a0="0.185 nm"),
    forces=[df.forces.Hertz()], experiment=df.experiments.Approach(zc=grid(0.6, 0.06, 90)),
)  # fmt: skip
# cases, how many jumps each has, and after how many periods of the first tone its motion repeats; None: that changes, and
# where a motion without a period is lost and found is chance, decided by rounding
SLOW_CHANGES = {
    "over both folds and back": (STIFF, 2, 1),
    "over four folds of the frequency": (df.example("resonance-curve").set("experiment.frequency.points=101"), 4, 1),
    "of two tones": (df.example("figure-6").replace(experiment=df.experiments.Approach(zc=grid(14, 8, 70))), 0, 5),
    "of two taps": (ALTERNATING, 0, 2),
    "of a force with memory": (RELAXING, 0, 1),
    "of a motion that loses its period": (BOUNCING, None, None),
}


def watched_run(case, resume=None):
    """Return the result of a run, and how many points were done at each look at its progress."""
    told = []
    return df.run(case, lambda done, total, note: told.append(done), resume=resume), told


@functools.cache
def undisturbed(name):
    """Return the result of a run that nothing stops, and the looks at its progress at which others are stopped."""
    whole, told = watched_run(SLOW_CHANGES[name][0])
    at_stretches = {len(told) - told[::-1].index(points) for points in told if points in (0, CHUNK)}
    return whole, sorted(at_stretches | set(np.linspace(1, len(told) - 1, 4).astype(int).tolist()))


@pytest.mark.parametrize(
    "name", some_long(SLOW_CHANGES, {*SLOW_CHANGES} - {"over both folds and back", "of a force with memory"})
)
def test_a_slow_change_stopped_anywhere_goes_on_to_the_same_numbers_bit_for_bit(name, tmp_path, monkeypatch):
    monkeypatch.setattr(transient, "CHUNK_SECONDS", 1e9)  # so that each run looks at its progress at the same places
    monkeypatch.setattr(accuracy, "GRACE", math.inf)  # and so that a busy machine knows as much as another
    (whole, calls), (case, jumps, periods) = undisturbed(name), SLOW_CHANGES[name]
    assert whole.sizes.get("jump", 0) == jumps or jumps is None
    assert (whole.repeat_periods == periods).all() == (periods is not None)
    begun = set()
    for call in calls:
        part = df.run(case, stop_after(0, call))
        if points_of(part) == whole.status.size:  # stopped while the accuracy of the last ones was looked at
            assert_same(part, whole)
            continue
        assert part.attrs["interrupted"] == 1
        df.write(part, tmp_path / "part.nc")
        rest, told = watched_run(case, df.read(tmp_path / "part.nc"))
        # a smooth curve there and back is found anew: its way back takes over states of the way there
        assert told[0] == (0 if "direction" in whole.dims else points_of(part) - points_of(part) % CHUNK)
        begun.add(told[0])
        assert_same(rest, whole)
    assert begun >= {0, CHUNK} or "direction" in whole.dims


@functools.cache
def sudden_steps(method):
    """Return a case, and the result of a run that nothing stops."""
    experiment = {"kind": "approach", "zc": grid(11, 9, 21), "protocol": "stepwise"}
    case = df.example("figure-3-air-jump").replace("solver.method", method, experiment=experiment)
    return case, df.run(case)


@pytest.mark.parametrize("method", ["periodic", "transient"])
@pytest.mark.parametrize("points", range(15, 19))
def test_sudden_steps_stopped_beside_a_jump_find_it_when_they_go_on(points, method):
    case, whole = sudden_steps(method)
    assert whole.jump_zc.values == pytest.approx([9.3e-9])  # from the 17th point to the 18th
    part = df.run(case, stop_after(points))
    assert points_of(part) == points
    assert_same(df.run(case, resume=part), whole)


def test_a_file_of_an_older_version_goes_on_without_errors_of_its_jumps():
    case, whole = sudden_steps("periodic")
    part = df.run(case, stop_after(18)).drop_vars("jump_error")
    assert_same(df.run(case, resume=part), whole)


def test_sudden_steps_stopped_where_a_branch_ends_jump_at_the_same_distance_when_they_go_on():
    """The attractive orbit goes on beside the kink for twenty of these steps, and each kicks the motion off it."""
    start = {"amplitude": 7.130e-9, "phase": np.radians(134.6)}
    experiment = {"kind": "approach", "zc": grid(7.3, 7.17, 25), "start": start, "protocol": "stepwise"}
    case = df.example("figure-3-air-jump").replace(experiment=experiment)
    transient = df.run(case.replace("solver.method", "transient"))
    for points in (15, 20, 21, 22):
        rest = df.run(case, resume=df.run(case, stop_after(points)))
        np.testing.assert_allclose(rest.amplitude.values, transient.amplitude.values, atol=1e-13)


@functools.cache
def resonance_curve_in_steps(method):
    """Return a case, and the result of a run that nothing stops."""
    case = df.example("resonance-curve").set(f"solver.method={method}", "experiment.protocol=stepwise")
    case = case.replace("experiment.frequency", grid(48.5, 49.7, 31, "kHz"))
    return case, df.run(case)


@pytest.mark.parametrize("points", some_long([1, 31, 50], long=[1, 50]))
@pytest.mark.parametrize("method", ["periodic", "transient"])
def test_a_stopped_resonance_curve_in_steps_goes_on_from_where_it_was(points, method, tmp_path):
    case, whole = resonance_curve_in_steps(method)
    part = df.run(case, stop_after(points))
    assert points_of(part) == points
    df.write(part, tmp_path / "part.nc")
    rest, told = watched_run(case, df.read(tmp_path / "part.nc"))
    assert told[0] == points
    assert_same(rest, whole)


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
    with pytest.raises(df.ParameterError, match="another case; load its own by"):
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
    assert curve.sizes == {"zc": 1, "tone": 1, "mode": 1, "harmonic": 3, "component": 2}
    with pytest.raises(df.ParameterError, match="harmonic"):
        df.approach(case, zc="4.5 nm", harmonic=3)


def test_a_run_takes_what_the_command_takes(workdir):
    case = approach()
    df.save_case(case, "case.toml")
    whole, part = df.run(case), df.run(case, stop_after(2))
    assert 0 < points_of(part) < points_of(whole)
    for name, result in (("whole.nc", whole), ("part.nc", part)):
        df.write(result, name)
    for name in ("case.toml", Path("whole.nc"), "part.nc"):
        assert_same(df.run(name), whole)
    assert df.run("table-1-am").attrs["title"] == df.example("table-1-am").title
    with pytest.raises(df.CaseError, match="there is no file 'figure-3-airr'; did you mean the example 'figure-3-air'"):
        df.run("figure-3-airr")
