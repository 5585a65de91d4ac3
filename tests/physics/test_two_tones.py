"""AM-FM and FM-FM from a case: values of an independent torus balance, runs in time, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import dforce as df
from dforce.observables.averaging import weights
from dforce.observables.finish import finish
from dforce.procedures.in_time import InTime
from dforce.procedures.two_tones import TwoTones
from dforce.solvers import transient

LEVER = {"modes": [{"f0": 48.9e3, "k": 0.9, "Q": 100.0}, {"f0": 282e3, "k": 28.0, "Q": 200.0}]}


def case(tones, radius=20e-9, **more):
    return df.Case(
        cantilever=LEVER,
        drive={"tones": tones},
        tip={"radius": radius},
        sample={"youngs_modulus": "1 GPa", "poisson_ratio": 0.3},
        forces=[df.forces.Hertz()],
        **more,
    )


AM_FM = case([{"A0": 7.351847e-9}, {"A0": "0.1 nm", "operation": "fm", "signal": "mode"}])
OF_MODES = {"operation": "fm", "signal": "mode"}
FM_FM = case([{"A0": "4.2 nm", **OF_MODES}, {"A0": "0.1 nm", **OF_MODES}], radius=2e-9)


@pytest.fixture(scope="module")
def am_fm():
    return df.dwell(AM_FM, 4e-9, recorded_periods=40)


def test_am_fm_dwell_has_the_values_of_an_independent_balance_within_the_accuracy(am_fm):
    assert df.Status(int(am_fm.status)) == df.Status.OK
    assert am_fm.mode_amplitude.values[0] == pytest.approx(4e-9, abs=1e-4 * 7.35e-9)
    assert am_fm.mode_phase.values[0] == pytest.approx(33.06728, abs=0.01)
    assert am_fm.frequency_shift.values == pytest.approx([0.0, 1193.665], abs=0.05)
    assert am_fm.drive_force.values[1] == pytest.approx(1.405994e-11, rel=1e-4)
    assert am_fm.virial.values == pytest.approx([-1.108993e-19, -1.187708e-21], rel=1e-4)


def test_fm_fm_curve_passes_the_values_of_an_independent_balance():
    found = df.approach(FM_FM, zc=[6e-9, 4.3e-9, 4e-9]).isel(zc=-1)
    assert found.frequency_shift.values == pytest.approx([439.5042, 892.375], abs=0.1)
    assert found.drive_force.values == pytest.approx([3.82213e-11, 1.399995e-11], rel=1e-4)
    assert found.phase.values[0] == pytest.approx(90.0, abs=0.1)


def test_set_points_of_two_tones_are_solved_with_the_distance_as_an_unknown():
    coarse = {"kind": "approach", "zc": {"start": "7 nm", "stop": "3 nm", "points": 11}}
    am_fm_case = df.example("am-fm").replace("experiment", coarse)
    fm_fm_case = FM_FM.replace(
        "experiment", {"kind": "approach", "zc": {"start": "4.4 nm", "stop": "4 nm", "points": 5}}
    )
    for case_, name, wanted, asked in (
        (am_fm_case, "amplitude_ratio", 0.8, {"set_point": 0.8}),
        (fm_fm_case, "frequency_shift", 300.0, {"frequency_shift": "300 Hz"}),
    ):
        met = df.at_set_point(df.run(case_), **asked)
        assert met.sizes["crossing"] == 1 and met["solved"].all()
        assert float(np.ravel(met[name])[0]) == pytest.approx(wanted, rel=1e-9)
        there = df.dwell(case_, float(met["zc"][0]))
        assert float(np.ravel(there[name])[0]) == pytest.approx(wanted, rel=1e-5)
        assert float(there["peak_force"]) == pytest.approx(float(met["peak_force"][0]), rel=1e-4)
        np.testing.assert_allclose(there["frequency_shift"], met["frequency_shift"].values[0], rtol=1e-5, atol=1e-3)


def test_torus_is_the_motion_that_stays_in_time_without_controllers(am_fm):
    tones = [{"A0": 7.351847e-9}, {"A0": 0.1e-9, "frequency": float(am_fm.drive_frequency[1])}]
    free = case(tones).problem.tones[1].force
    tones[1]["A0"] *= float(am_fm.drive_force[1]) / free
    settings = {"method": "transient", "integrator": "engine", "settle_tolerance": 1e-8}
    later = df.dwell(case(tones, solver=settings), 4e-9)
    assert later.mode_amplitude.values == pytest.approx(am_fm.mode_amplitude.values, rel=2e-4)
    assert later.mode_phase.values == pytest.approx(am_fm.mode_phase.values, abs=0.02)


def test_recorded_motion_of_a_torus_stays_between_its_extremes(am_fm):
    assert float(am_fm.distance.min()) == pytest.approx(float(am_fm.min_distance), abs=2e-11)
    assert float(am_fm.distance.min()) > float(am_fm.min_distance) - 1e-13
    assert float(am_fm.deflection.max()) < float(am_fm.max_deflection) + 1e-13


TAPPING = [{"A0": 7.351847e-9}, {"A0": "0.1 nm", "operation": "fm"}]


def test_drive_force_of_each_tone_over_a_base_is_the_push_of_its_own_mode():
    """The base by Y pushes a mode by chi k |r^2 - i r/Q| Y."""
    couplings = (1.2, -0.7)
    modes = [mode | {"base_coupling": chi} for mode, chi in zip(LEVER["modes"], couplings, strict=True)]
    tones = [{"A0": 7e-9}, {"A0": 1e-10, "operation": "fm", "lag": np.pi}]
    found = df.dwell(
        AM_FM.replace("cantilever.modes", modes).replace("drive", {"tones": tones, "excitation": "base"}), 6e-9
    )
    for j, (mode, chi) in enumerate(zip(modes, couplings, strict=True)):
        r = found.drive_frequency.values[j] / mode["f0"]
        push = abs(chi) * mode["k"] * abs(r**2 - 1j * r / mode["Q"]) * found.base_amplitude.values[j]
        assert found.drive_force.values[j] == pytest.approx(push, rel=1e-6, abs=0.0)


@pytest.mark.long
def test_controllers_in_time_find_the_torus(am_fm):
    one = AM_FM.replace("solver.integrator", "engine").replace("solver.accuracy", 1e-6)
    start = one.problem.unlocked, np.ones(2), None
    found, became = InTime(one.problem, one.solver, lambda *_: None, 8e-9, *start).at(4e-9)
    assert became == df.Status.OK
    assert found["frequency_shift"] == pytest.approx([0.0, 1193.665], abs=0.01)
    assert found["mode_phase"] == pytest.approx([33.06728, 90.0], abs=1e-3)
    for name in ("mode_amplitude", "drive_ratio", "virial", "mean_deflection"):
        assert found[name] == pytest.approx(am_fm[name].values, rel=2e-4), name


@pytest.mark.long
@pytest.mark.parametrize("seed", range(6))
def test_controllers_in_time_find_the_tori_of_random_cases(seed):
    draw = np.random.default_rng(seed).uniform
    modes = [
        {"f0": 48.9e3, "k": 0.9 * draw(0.7, 3.0), "Q": draw(20, 150)},
        {"f0": 48.9e3 * draw(5.6, 6.7), "k": 28.0 * draw(0.7, 3.0), "Q": draw(40, 250)},
    ]
    first = {"A0": draw(3e-9, 8e-9)} | ({"operation": "fm"} if seed % 2 else {})
    second = {"A0": draw(0.02, 0.04) * first["A0"], "operation": "fm", "phase_set_point": draw(1.3, 1.7)}
    viscous = [df.forces.KelvinVoigt(viscosity=draw(1.0, 30.0))] if seed % 3 else []
    one = AM_FM.replace(cantilever={"modes": modes}, drive={"tones": [first, second]}, tip={"radius": draw(2e-9, 9e-9)})
    one = one.replace("sample.youngs_modulus", 10.0 ** draw(7.5, 9.0)).replace(forces=[df.forces.Hertz(), *viscous])
    zc = draw(0.75, 0.95) * first["A0"]
    torus, became = TwoTones(one.problem, one.solver, lambda *_: None).at(zc)
    assert became == df.Status.OK and "settling_periods" not in torus
    one = one.replace("solver.integrator", "engine")
    found, became = InTime(
        one.problem, one.solver, lambda *_: None, 2.0 * zc, one.problem.unlocked, np.ones(2), None
    ).at(zc)
    assert became == df.Status.OK
    for name in ("frequency_shift", "amplitude", "drive_force", "virial", "mean_deflection"):
        scale = np.abs(torus[name]).max() if name == "frequency_shift" else np.abs(torus[name])
        assert np.all(np.abs(found[name] - torus[name]) < 5e-4 * scale), name
    assert found["phase"] == pytest.approx(torus["phase"], abs=0.02)


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(
            {
                "forces": [df.forces.JKR(surface_energy="10 mJ/m^2")],
                "drive": {"tones": TAPPING},
                "tip": {"radius": 2e-9},
            },
            marks=pytest.mark.long,
        ),
        {"drive": {"excitation": "base", "tones": [TAPPING[0], TAPPING[1] | {"lag": "180 deg"}]}},
    ],
    ids=["branches", "base"],
)
def test_motions_without_a_torus_are_found_in_time_and_advice_says_so(change):
    found = df.dwell(AM_FM.replace(**change), 5e-9)
    assert df.Status(int(found.status)) == df.Status.OK
    assert found.phase.values[1] == pytest.approx(90.0, abs=1e-3)
    assert found.amplitude.values[1] == pytest.approx(1e-10, rel=1e-5)
    assert found.frequency_shift.values[1] > 500.0
    assert "found_in_time" in [one.name for one in df.advice(found)]
    assert np.ptp(found.deflection.values) == pytest.approx(2.0 * float(found.half_peak_to_peak), rel=0.05)


def test_a_motion_that_becomes_infinite_fails_alone_and_the_next_one_starts_from_the_free_lock():
    shaken = AM_FM.replace(drive={"excitation": "base", "tones": [TAPPING[0], TAPPING[1] | {"lag": "180 deg"}]})
    lock = InTime(shaken.problem, shaken.solver, lambda *_: None, 8e-9, shaken.problem.unlocked, np.ones(2), None)
    lock.motion = replace(lock.motion, y=(1e200, 0.0, 0.0, 0.0))
    found, became = lock.at(6e-9)
    assert became == df.Status.FAILED
    assert np.isnan(found["amplitude"]).all()
    found, became = lock.at(5e-9)
    assert became == df.Status.OK
    assert found["phase"][1] == pytest.approx(90.0, abs=1e-3)


def test_the_refusal_of_an_inverted_signal_names_the_lag():
    with pytest.raises(df.ParameterError, match="the signal is inverted: add 180 deg to the lag of this tone"):
        AM_FM.replace(drive={"excitation": "base", "tones": TAPPING})


@pytest.mark.long
def test_motion_that_a_neck_makes_irregular_has_the_means_of_a_long_run_and_says_that_it_does_not_repeat():
    sticky = AM_FM.replace(drive={"tones": [{"A0": "6 nm"}, TAPPING[1]]}, tip={"radius": 5e-9})
    sticky = sticky.replace(forces=[df.forces.Capillary(), df.forces.Hertz()])
    lock = InTime(sticky.problem, sticky.solver, lambda *_: None, 8e-9, sticky.problem.unlocked, np.ones(2), None)
    found, became = lock.at(5.4e-9)
    assert became == df.Status.NOT_REPEATING
    # at most 75 windows of 256 periods; it took 200, and gave the numbers of the last one
    assert found["settling_periods"] < 20_000
    integrator = lock.integrator
    _, rows = integrator.observe(lock.motion, 25_600)  # at constant drive and frequency
    even = weights([tone.frequency for tone in integrator.problem.tones], len(rows))
    free = finish(integrator.problem, 0, rows, even)
    # windows of 256 periods differ by 0.4 %, means of 64 of them by less
    assert found["amplitude"][0] == pytest.approx(free["amplitude"][0], rel=5e-3)
    assert found["phase"][0] == pytest.approx(free["phase"][0], abs=1.0)
    assert found["total_dissipated_energy"] == pytest.approx(free["total_dissipated_energy"], rel=0.02)


def test_curve_of_am_fm_goes_on_behind_a_fold_of_its_tori():
    dmt = AM_FM.replace(forces=[df.forces.DMT(hamaker="2e-20 J")], drive={"tones": TAPPING}, tip={"radius": 2e-9})
    found = df.approach(dmt, zc=["9 nm", "7 nm", "6 nm"])
    in_time = np.isfinite(found.settling_periods.values)
    assert in_time.tolist() == [False, False, True]
    assert found.phase.values[2, 0] < 90.0 < found.phase.values[:2, 0].min()
    assert found.status.values.tolist() == 3 * [int(df.Status.OK)]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"forces": [df.forces.Custom(law="-1e-12 * t")]}, "custom, which depends on time, needs"),
        (
            {"drive": {"tones": [{"A0": "4 nm", **OF_MODES}, {"A0": "1 nm", "mode": 1}]}},
            "both tones of drive drive mode 1",
        ),
        ({"drive": {"tones": [{"A0": "4 nm", **OF_MODES}] + 2 * [{"A0": "1 nm", "mode": 2}]}}, "a lock allows two"),
    ],
)
def test_two_tones_with_a_lock_refuse_what_has_no_torus(change, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.dwell(AM_FM.replace(**change), 4e-9)


def test_a_motion_that_only_trembles_by_the_errors_of_its_steps_has_settled(monkeypatch):
    monkeypatch.setattr(transient, "LONGEST", 0)  # a longer window would average it
    case = df.Case(
        cantilever={"modes": [{"f0": "70 kHz", "k": 2, "Q": 150}, {"f0": "437.3 kHz", "k": 80, "Q": 400}]},
        drive={"tones": [{"A0": "20 nm"}, {"A0": "1 nm"}]},
        tip={"radius": "10 nm"},
        sample={"youngs_modulus": "1 GPa", "poisson_ratio": 0.3},
        forces=[{"model": "dmt", "hamaker": "5e-20 J"}],
        solver={"method": "transient", "max_periods": 20_000},
    )
    rough, fine = (df.dwell(case.set(f"solver.points_per_period={points}"), "18.5 nm") for points in (256, 1024))
    assert int(rough.status) == int(fine.status) == df.Status.OK
    assert 1e-6 < float(rough.drift) < 1e-4 and float(fine.drift) < 1e-6
    np.testing.assert_allclose(rough.amplitude, fine.amplitude, rtol=2e-4)
