"""The accuracy that is asked for holds, at each point by itself, or the point says so."""

import numpy as np
import pytest

import dforce as df
from dforce.checks.validation.draws import draw
from dforce.observables.deviation import DEVIATIONS, deviations
from dforce.solvers.problem_batch import Lot

FAMILIES = ("Hertz", "DMT", "Hertz, Kelvin–Voigt")
VISCOUS = df.Case(  # a contact that the tip enters so fast that 256 samples leave 1e-3 of the peak force
    cantilever=df.Cantilever(f0="50 kHz", k="0.9 N/m", Q=100), drive=df.Drive(A0="10 nm"), tip=df.Tip(radius="10 nm"),
    sample=df.Sample(youngs_modulus="0.1 GPa"),
    forces=[df.forces.DMT(hamaker="1e-22 J"), df.forces.KelvinVoigt(viscosity="100 Pa s")],
    experiment=df.experiments.Approach(zc=["12 nm", "9 nm", "6 nm"]),
)  # fmt: skip


def off(result, exact, problem):
    """Return how far results of one point are apart, as a share of each quantity's scale."""
    lot = Lot.of([problem])
    columns = [{name: one[name].values[None] for name in DEVIATIONS if name in one} for one in (result, exact)]
    return deviations(problem, lot.numbers, lot.tones, *columns)[0]


@pytest.mark.parametrize("number", range(12))
def test_random_motions_are_as_accurate_as_asked_for(number):
    """Against 32 times the samples: what 256 of them leave is up to 5e-3 in cases like these."""
    drawn = draw(41, number, FAMILIES).case
    found = df.run(drawn)
    exact = df.run(drawn.replace("solver.points_per_period", 8192))
    assert found.status == exact.status == df.Status.OK
    assert off(found, exact, drawn.problem).max() < drawn.solver.accuracy


def test_a_rough_motion_is_found_again_and_a_smooth_one_is_not():
    rough, smooth = draw(77, 5).case, df.example("table-1-am")
    for case, again in ((rough, True), (smooth, False)):
        fixed = df.run(case.replace("solver.points_per_period", 256))
        kept = df.run(case)
        exact = df.run(case.replace("solver.points_per_period", 8192))
        assert fixed.status == kept.status == df.Status.OK
        assert (off(fixed, exact, case.problem).max() > 1e-4) == again
        assert (float(fixed.error_estimate) > 1e-4) == again
        assert off(kept, exact, case.problem).max() < 1e-4
        assert float(kept.error_estimate) < 1e-4
        assert (float(kept.peak_force) == float(fixed.peak_force)) != again


def test_the_estimate_tells_the_error_of_a_smooth_motion():
    case = df.example("table-1-am").replace("forces", [{"model": "electrostatic", "bias": "2 V"}])
    exact = df.run(case.replace("solver.points_per_period", 2048))
    for points in (32, 64, 128):
        found = df.run(case.replace("solver.points_per_period", points))
        error = off(found, exact, case.problem).max()
        assert error / 3.0 < float(found.error_estimate) < 3.0 * error


def test_a_narrow_attraction_is_met_by_shorter_steps_where_q_adds_up_its_errors():
    case = df.Case(
        cantilever=df.Cantilever(f0="19.7 kHz", k="7.95 N/m", Q=3230), drive=df.Drive(A0="845 nm"),
        tip=df.Tip(radius="20.7 nm"), sample=df.Sample(youngs_modulus="1 kPa"), forces=[df.forces.DMT(hamaker="7.03e-21 J")],
        experiment=df.experiments.Approach(zc=["1015 nm", "749 nm"]),
    )  # fmt: skip
    fixed, exact = (df.run(case.replace("solver.points_per_period", points)).isel(zc=1) for points in (256, 8192))
    error = off(fixed, exact, case.problem).max()
    assert error < 1e-4
    assert error / 3.0 < float(fixed.error_estimate) < 3.0 * error


def test_points_do_not_depend_on_those_beside_them():
    whole = df.run(VISCOUS)
    alone = df.run(VISCOUS.replace("experiment.zc", ["12 nm", "6 nm"]))
    assert float(alone.peak_force[1]) == pytest.approx(float(whole.peak_force[2]), rel=1e-8)
    swept = df.sweep(VISCOUS, {"cantilever.Q": [100.0, 120.0]})
    for name in ("peak_force", "error_estimate", "status"):
        np.testing.assert_array_equal(swept[name].isel(Q=0), whole[name])


def test_what_cannot_be_kept_is_told(monkeypatch):
    monkeypatch.setattr("dforce.solvers.accuracy.MOST_SAMPLES", 512)
    found = df.run(VISCOUS.replace("solver.accuracy", 1e-8))
    near = found.isel(zc=2)
    assert near.status == df.Status.INACCURATE
    assert np.isfinite(near.peak_force)
    assert 1e-8 < float(near.error_estimate) < 1e-2
    assert "inaccurate" in str(df.summary(found))
    ratio = float(near.amplitude_ratio) + 1e-3
    assert len(df.at_set_point(found, ratio).crossing) == 1


def test_numbers_that_are_far_off_are_no_numbers(monkeypatch):
    for module in ("accuracy", "sample_counts"):
        monkeypatch.setattr(f"dforce.solvers.{module}.MOST_SAMPLES", 512)
    monkeypatch.setattr("dforce.experiments.table.WORTHLESS", 1e-9)
    found = df.run(VISCOUS.set("solver.accuracy=1e-8", "experiment.zc=['6 nm']"))
    assert (found.status == df.Status.UNRESOLVED).all()
    assert np.isnan(found.peak_force).all()


def test_samples_that_are_given_stay():
    given = VISCOUS.replace("solver.points_per_period", 256)
    assert given.solver.accuracy is None
    assert df.Case.from_toml(given.to_toml(complete=True)).solver.accuracy is None
    assert VISCOUS.set("solver.points_per_period=256", "solver.accuracy=1e-4").solver.accuracy == 1e-4
