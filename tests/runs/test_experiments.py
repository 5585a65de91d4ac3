"""Approach and dwell: the order of the distances, the start at each, what settling means, and points that fail."""

import dataclasses
import math
import tracemalloc

import numpy as np
import pytest

import dforce as df
from dforce.runs import carry_out
from dforce.solvers import transient

STATUS = df.Status
TRANSIENT = {"method": "transient"}


def tapping(**solver):
    """Figure 3 with a quick lever, and no experiment yet."""
    case = df.example("figure-3-air").replace("cantilever.Q", 50).replace(experiment=None)
    return case.replace(solver=df.SolverSettings(**{**TRANSIENT, **solver}))


def quiet(done, total, note):
    pass


# --- approach --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("direction", "order"), [("approach", [9, 7, 5]), ("retract", [5, 7, 9]), ("both", [9, 7, 5, 5, 7, 9])]
)
def test_distances_are_visited_from_far_to_near_or_back_and_stored_as_given(direction, order):
    experiment = df.experiments.Approach(zc=["7 nm", "9 nm", "5 nm"], direction=direction)
    plan = experiment.plan(tapping().problem)
    assert [round(plan.values[place[0]] * 1e9) for place in plan.visits] == order
    curve = df.approach(tapping(), zc=["7 nm", "9 nm", "5 nm"], direction=direction)
    assert curve.zc.values == pytest.approx([7e-9, 9e-9, 5e-9])
    assert ("direction" in curve.dims) == (direction == "both")
    amplitude = curve.amplitude.values[..., 0]
    assert (amplitude[1] > amplitude[0]).all()
    assert (amplitude[0] > amplitude[2]).all()


def test_each_distance_can_be_started_anew():
    case = tapping()
    together = df.approach(case, zc=["8.5 nm", "6 nm"], protocol="stepwise", carry_state=False, start="rest")
    for i, zc in enumerate(("8.5 nm", "6 nm")):
        alone = df.dwell(case, zc, start="rest")
        # the same number of periods from the same start: equal but for where in time the tone's phase is rounded
        assert float(together.amplitude[i, 0]) == pytest.approx(float(alone.amplitude[0]), rel=1e-9)
        assert float(together.settling_periods[i]) == float(alone.settling_periods)


def test_carried_motion_stays_on_its_branch_where_a_fresh_start_finds_the_other():
    case = df.example("figure-3-air").replace("solver.method", "transient").replace(experiment=None)
    zc = np.linspace(10e-9, 8e-9, 21)
    carried = df.approach(case, zc=zc)
    fresh = df.approach(case, zc=zc[-1:], protocol="stepwise", carry_state=False)
    assert float(carried.phase[-1, 0]) > 90.0 > float(fresh.phase[-1, 0])


def test_start_of_a_retract_chooses_the_branch():
    case = df.example("figure-3-air").replace("solver.method", "transient").replace(experiment=None)
    zc = np.linspace(8e-9, 8.2e-9, 3)
    for phase, low, high in (("56 deg", 0.0, 90.0), ("128 deg", 90.0, 180.0)):
        start = {"amplitude": "8.1 nm", "phase": phase}
        curve = df.approach(case, zc=zc, direction="retract", start=start)
        assert ((low < curve.phase) & (curve.phase < high)).all()


def test_progress_counts_the_points():
    seen = []
    case = tapping(settle="fixed", periods=2, measured_periods=1)
    case = case.replace(experiment=df.experiments.Approach(zc=[9e-9, 8e-9, 7e-9]))
    carry_out(case, lambda *call: seen.append(call))
    assert [done for done, _, _ in seen] == sorted(done for done, _, _ in seen)
    assert {done for done, _, _ in seen} == {0, 1, 2, 3}
    assert seen[-1][:2] == (3, 3)
    assert any("8 nm" in note for _, _, note in seen)


# --- settling --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("measured", [1, 3])
@pytest.mark.parametrize(("periods", "status"), [(37, STATUS.NOT_SETTLED), (600, STATUS.OK)])
def test_a_fixed_count_is_kept_and_says_when_it_was_too_short(periods, status, measured):
    case = tapping(settle="fixed", periods=periods, measured_periods=measured)
    curve = df.approach(case, zc=["8 nm", "7 nm"])
    assert np.isfinite(curve.amplitude).all()
    assert (curve.settling_periods == periods).all()
    assert (curve.status == status).all()


def test_settled_means_within_the_tolerance_of_where_a_long_run_ends():
    long = df.dwell(tapping(settle="fixed", periods=4000), "7 nm", start="rest")
    for tolerance in (1e-4, 1e-6):
        result = df.dwell(tapping(settle_tolerance=tolerance), "7 nm", start="rest")
        assert int(result.status) == STATUS.OK
        assert float(result.drift) < tolerance
        c = [float(r.amplitude[0]) * np.exp(-1j * math.radians(float(r.phase[0]))) for r in (result, long)]
        assert abs(c[0] - c[1]) < tolerance * 10e-9


def test_a_motion_that_has_not_settled_says_so():
    case = tapping(max_periods=40).replace("cantilever.Q", 2000)
    curve = df.approach(case, zc=["8 nm", "7 nm"], start="rest")
    assert (curve.status == STATUS.NOT_SETTLED).all()
    assert np.isfinite(curve.amplitude).all()
    sentences = str(curve.status.attrs["flag_sentences"]).splitlines()
    assert "did not settle" in sentences[STATUS.NOT_SETTLED]


def test_results_do_not_depend_on_how_often_the_watch_is_looked_at(monkeypatch):
    """Runs are cut into pieces by the clock; with LSODA a piece must not start its history anew."""
    for integrator in ("rk4", "engine", "lsoda"):
        solver = df.SolverSettings(integrator=integrator, settle="fixed", periods=60, measured_periods=20)
        case = df.example("table-1-am").replace(solver=solver)
        amplitudes = []
        for seconds in (0.0, 10.0):
            monkeypatch.setattr(transient, "CHUNK_SECONDS", seconds)
            result = df.dwell(case, "4 nm", start="rest")
            amplitudes.append((float(result.amplitude[0]), float(result.total_dissipated_energy)))
        assert amplitudes[0] == amplitudes[1], integrator


# --- points that fail ------------------------------------------------------------------------------------------------


def with_hole(experiment, **solver):
    """Return a case without a force, but with nothing that is a number below 6.5 nm, which no user can write."""
    case = df.Case(
        cantilever=df.Cantilever(f0="50 kHz", k="1 N/m", Q=5), drive=df.Drive(A0="1 nm"), tip=df.Tip(radius="2 nm"),
        sample=df.Sample(youngs_modulus="1 GPa"), contact=df.Contact(a0="6.5 nm"), forces=[df.forces.Hertz()],
        experiment=experiment, solver=df.SolverSettings(**solver),
    )  # fmt: skip
    hole = case.problem.forces[0].model_copy(update={"E_eff": math.nan})
    case.__dict__["problem"] = dataclasses.replace(case.problem, forces=(hole,))
    return case


@pytest.mark.parametrize(
    "solver",
    [{}, {"integrator": "engine"}, {"integrator": "engine", "method": "transient"}, {"integrator": "lsoda"}],
    ids=str,
)
@pytest.mark.parametrize(
    "motion", [{}, {"protocol": "stepwise"}, {"protocol": "stepwise", "carry_state": False}], ids=str
)
def test_a_point_that_fails_is_nan_and_the_run_goes_on(solver, motion):
    # near the edge the orbit runs into the hole; then far again, on the way back
    experiment = df.experiments.Approach(zc=["8 nm", "7.2 nm", "7.1 nm"], direction="both", **motion)
    curve = carry_out(with_hole(experiment, **solver), quiet)
    status = curve.status.transpose("direction", "zc").values
    assert status.tolist() == [[STATUS.OK, STATUS.FAILED, STATUS.FAILED]] * 2
    failed = curve.status == STATUS.FAILED
    assert np.isnan(curve.amplitude.where(failed, drop=True)).all()
    assert np.isnan(curve.peak_force.where(failed, drop=True)).all()
    assert "jump_zc" not in curve  # a motion that is lost has not jumped anywhere
    # the way back ends where nothing is in the way, started as at the beginning
    assert curve.amplitude.sel(direction="retract").values[0, 0] == pytest.approx(1e-9, rel=1e-5)


def test_a_dwell_that_fails_has_no_traces_and_does_not_raise():
    result = carry_out(with_hole(df.experiments.Dwell(zc="7 nm"), **TRANSIENT), quiet)
    assert int(result.status) == STATUS.FAILED
    assert np.isnan(float(result.amplitude[0]))
    assert "deflection" not in result


# --- dwell -----------------------------------------------------------------------------------------------------------


def test_traces_of_a_dwell_belong_together():
    case = tapping()
    result = df.dwell(case, "7 nm", recorded_periods=4)
    assert result.sizes["time"] == 4 * result.attrs["samples_per_period"]
    t, z, v = (result[name].values for name in ("time", "deflection", "velocity"))
    assert t[1] == pytest.approx(1 / 48.9e3 / result.attrs["samples_per_period"], rel=1e-12)
    assert result.distance.values == pytest.approx(7e-9 + z, abs=1e-24)
    assert result.indentation.values == pytest.approx(np.maximum(0.165e-9 - 7e-9 - z, 0.0), abs=1e-24)
    assert result.mode_deflection.values[0] == pytest.approx(z, abs=1e-24)
    # the velocity is the slope: central differences of a motion sampled 256 times err by (2 pi h)²/6 of it
    assert v[1:-1] == pytest.approx((z[2:] - z[:-2]) / (t[2] - t[0]), abs=1e-3 * np.abs(v).max())
    law = case.problem.forces[0]
    at = [law.law(d, 0.0, 0.0, *law.values()) for d in result.distance.values]
    assert result.force.values == pytest.approx(at, abs=1e-12 * np.abs(at).max())
    assert float(result.max_deflection) == pytest.approx(z.max(), abs=1e-3 * z.max())


def test_spectrum_shows_the_harmonics():
    result = df.dwell(tapping(), "7 nm", recorded_periods=4)
    for h in (1, 2, 5):
        line = result.spectrum.sel(frequency=h * 48.9e3, method="nearest")
        assert float(line) == pytest.approx(float(result.harmonic_amplitude[h - 1]), rel=1e-4)
    assert float(result.spectrum[0]) == pytest.approx(abs(float(result.mean_deflection)), rel=1e-4)


def test_record_of_everything_starts_at_the_start():
    case = tapping(settle="fixed", periods=20)
    result = df.dwell(case, "1 um", start="rest", record="all", recorded_periods=5)
    assert result.sizes["time"] == 25 * result.attrs["samples_per_period"]
    assert float(result.deflection[0]) == 0.0
    assert int(result.attrs["record_start_period"]) == 0


def test_the_motion_that_is_kept_is_that_at_the_start_of_a_common_period():
    """Tones whose frequencies are as 5 to 31, of which 51 periods and 10 measured ones are no whole common periods."""
    case = df.example("figure-6").replace(solver=df.SolverSettings(settle="fixed", periods=51))
    result = df.dwell(case, "8 nm")
    assert int(result.attrs["record_start_period"]) == 65
    kept = result.motion.sel(component=["z_1", "z_2"]).values
    np.testing.assert_array_equal(kept, result.mode_deflection.isel(time=0).values)


def test_a_record_too_long_for_memory_is_refused():
    with pytest.raises(df.ParameterError, match="too long"):
        df.dwell(tapping(), "7 nm", recorded_periods=100_000)


# --- memory ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_memory_does_not_grow_with_points_times_periods():
    """What a point leaves behind is its row of results; periods leave nothing."""

    def peak(points, periods):
        case = tapping(settle="fixed", periods=periods, measured_periods=4)
        case = case.replace(experiment=df.experiments.Approach(zc=np.linspace(9e-9, 8e-9, points)))
        tracemalloc.start()
        carry_out(case, quiet)
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size

    peak(2, 10_000)  # what is loaded once
    few, long, many = peak(4, 100), peak(4, 10_000), peak(80, 100)
    # what is computed between two checks for a stop, not a trace, which would take 80 megabytes
    assert long - few < 1_000_000
    assert many - few < 76 * 20_000  # some 40 quantities a point, held one by one until the end
