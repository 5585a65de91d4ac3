"""Resonance curves: exact where there is no force, shifted by a small one, and with two ways through a strong one."""

import numpy as np
import pytest

import dforce as df
from dforce.errors import ParameterError
from dforce.validation.curves import random_case


@pytest.fixture(scope="module")
def case():
    return df.example("resonance-curve")


@pytest.fixture(scope="module")
def both_ways(case):
    return df.run(case)


def response(mode, force, frequency, stiffness=0.0):
    """Return the complex amplitude (m) of a harmonic oscillator with some stiffness added."""
    r = frequency / mode.f0
    return force / (mode.k * (1 - r**2 + 1j * r / mode.Q) + stiffness)


def test_the_free_curve_is_that_of_the_harmonic_oscillator(case):
    # far from a contact, which acts on nothing there
    free = df.frequency_sweep(case.replace("forces", [df.forces.Hertz()]), zc="1 um", direction="up")
    exact = response(case.problem.modes[0], case.problem.tones[0].force, free["frequency"].values)
    # RK4 with 256 points a period shifts the resonance by 3e-9, which Q = 255 makes 2e-6 on the flanks
    assert free["amplitude"].values[:, 0] == pytest.approx(np.abs(exact), rel=3e-6, abs=0.0)
    assert free["phase"].values[:, 0] == pytest.approx(-np.degrees(np.angle(exact)), abs=2e-4)


def test_the_driving_force_is_the_one_that_gives_a0_at_the_cases_own_frequency(case):
    off = case.replace("drive.frequency", "48 kHz").replace("forces", [df.forces.Hertz()])
    swept = df.frequency_sweep(off, frequency=["48 kHz", "48.9 kHz"], zc="1 um", direction="up")
    assert swept["amplitude"].values[0, 0] == pytest.approx(10e-9, rel=3e-6, abs=0.0)
    # 10 nm off resonance takes ten times the force, and so 93 nm at resonance
    assert swept["amplitude"].values[1, 0] == pytest.approx(off.problem.tones[0].force / 0.9 * 255, rel=3e-6, abs=0.0)


def test_a_small_motion_sees_the_gradient_of_the_force_as_a_stiffness(case):
    zc = 3e-9
    forces = [df.forces.VanDerWaals(hamaker="2e-20 J"), df.forces.Hertz()]  # out of reach of the contact
    small = case.replace("drive.A0", "1 pm").replace("forces", forces)
    swept = df.frequency_sweep(small, frequency={"start": 48e3, "stop": 49.5e3, "points": 61}, zc=zc, direction="up")
    mode = small.problem.modes[0]
    gradient = 2e-20 * 2e-9 / (3 * (zc + float(swept["mean_deflection"][0])) ** 3)
    exact = response(mode, small.problem.tones[0].force, swept["frequency"].values, -gradient)
    # the next term of the force is smaller by (A/d)^2 = 1e-7
    assert swept["amplitude"].values[:, 0] == pytest.approx(np.abs(exact), rel=1e-5, abs=0.0)


def test_the_curves_up_and_down_differ_where_two_states_exist(both_ways):
    f = both_ways["frequency"].values
    up, down = both_ways["phase"].sel(direction="up")[:, 0], both_ways["phase"].sel(direction="down")[:, 0]
    apart = f[np.abs(up - down) > 1.0]
    # contact carries the upward curve to higher frequencies, attraction the downward one to lower
    assert (up.values[(f > 49.0e3) & (f < 49.6e3)] < 90).all()
    assert (down.values[(f > 49.0e3) & (f < 49.6e3)] > 90).all()
    assert 48.74e3 < apart.min() < 48.77e3
    assert 49.62e3 < apart.max() < 49.65e3
    assert (both_ways["status"] == df.Status.OK).all()


def test_the_jumps_lie_at_the_folds_of_the_curve_of_all_states(case, both_ways):
    states = df.branches(case, zc="9 nm", parameter="drive.frequency", start="48 kHz", stop="50 kHz", search=5)
    folds = states["frequency"].values[states["special"].values == "fold"]
    found = {(finding.name, finding.direction): finding.value for finding in df.summary(both_ways)}
    jumps = [*found["jumps", "up"], *found["jumps", "down"]]
    assert len(jumps) == 4
    for jump in jumps:
        # a jump is noted at the first frequency (10 Hz apart) on the other side
        assert np.abs(folds - jump).min() < 10.0


def test_orbits_are_the_states_that_the_transient_settles_to(case, both_ways):
    frequency = both_ways["frequency"].values[::4]
    slow = df.frequency_sweep(case.replace("solver.method", "transient"), frequency=frequency)
    fast = df.frequency_sweep(case, frequency=frequency)
    # settled to 1e-6 of A0 a period of decay; 10 nm
    assert np.abs(slow["amplitude"] - fast["amplitude"]).max() < 1e-6 * 10e-9
    assert np.abs(slow["phase"] - fast["phase"]).max() < 1e-3
    assert "multiplier_modulus" in fast
    assert (fast["multiplier_modulus"] < 1.0).all()


def test_every_frequency_may_start_anew(case):
    anew = df.frequency_sweep(case, frequency=["49.2 kHz", "49.4 kHz"], carry_state=False, direction="both")
    assert anew["phase"].sel(direction="up").values == pytest.approx(anew["phase"].sel(direction="down").values)


def test_two_tones_settle_in_time():
    case = df.example("figure-6")
    swept = df.frequency_sweep(case, frequency=["49.9 kHz", "50 kHz"], zc="14 nm", direction="up")
    assert swept["amplitude"].shape == (2, 2)
    assert (swept["status"] == df.Status.OK).all()
    # out of reach of the force, which is 1e-14 N there
    free = np.abs(case.problem.free.sum(axis=1))
    assert swept["amplitude"].values[1] == pytest.approx(free, rel=1e-4, abs=0.0)


def test_ctrl_c_keeps_the_frequencies_that_are_done(case):
    calls = 0

    def stop_soon(done, total, note):
        nonlocal calls
        calls += 1
        if calls > 1:
            raise KeyboardInterrupt

    part = df.frequency_sweep(case, progress=stop_soon, frequency={"start": 48e3, "stop": 50e3, "points": 2001})
    assert part.attrs["interrupted"] == 1
    done = part["status"] == df.Status.OK
    assert 0 < int(done.sum()) < 4002
    assert np.isfinite(part["amplitude"].values[..., 0][done.values]).all()


@pytest.mark.parametrize(
    ("frequency", "sentence"),
    [
        ([], "has 0 frequencies"),
        ("9 nm", "not frequency|is a length"),
        ([-1.0], "is not above 0 Hz"),
        ({"start": "48 kHz"}, "experiment.frequency.stop .* is missing"),
        ({"start": "48 kHz", "stop": "50 kHz", "points": 0}, "is below 1"),
    ],
)
def test_frequencies_that_make_no_sense_are_refused_in_one_sentence(case, frequency, sentence):
    with pytest.raises(ParameterError, match=sentence):
        df.frequency_sweep(case, frequency=frequency)


def test_a_sweep_survives_being_written_and_read_and_has_a_picture(both_ways, tmp_path):
    assert df.read(df.write(both_ways, tmp_path / "curve.nc")).identical(both_ways)
    assert "frequency (Hz)" in df.write(both_ways, tmp_path / "curve.csv").read_text(encoding="utf-8")
    upper, _ = df.plot.overview(both_ways)
    assert [line.get_label() for line in upper.get_lines()] == ["up →", "← down"]


# a step of the frequency throws the motion elsewhere although its orbit goes on: Q from 12 to 194
@pytest.mark.parametrize(
    ("seed", "points", "share"), [(87, 25, 0.45), (158, 61, 0.77), (213, 11, 0.48), (230, 25, 0.81), (402, 11, 0.7)]
)
def test_coarse_steps_of_the_frequency_kick_the_motion_as_they_do_in_a_transient(seed, points, share):
    case, _ = random_case(seed)
    mode, A0 = case.problem.modes[0], case.problem.tones[0].A0
    half = min(2.5 * mode.f0 / mode.Q, 0.6 * mode.f0)
    grid = {"start": mode.f0 - half, "stop": mode.f0 + half, "points": points}
    orbits, transients = (
        df.frequency_sweep(case.replace("solver.method", method), frequency=grid, zc=share * A0)
        for method in ("periodic", "transient")
    )
    assert (orbits["status"] == 0).all() and (transients["status"] == 0).all()
    # a transient settles to 1e-6, and what is left is more where multipliers are near one
    assert float(np.abs(orbits["amplitude"] - transients["amplitude"]).max()) < 2e-5 * A0
