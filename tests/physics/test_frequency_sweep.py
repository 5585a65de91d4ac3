"""Resonance curves: exact where there is no force, shifted by a small one, and with two ways through a strong one."""

import numpy as np
import pytest

import dforce as df
from dforce.checks.validation.curves import random_case
from dforce.core.errors import ParameterError


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


@pytest.fixture(scope="module")
def states(case):
    """All states, of which folds are found with as many samples as they need."""
    return df.branches(case, zc="9 nm", parameter="drive.frequency", start="48 kHz", stop="50 kHz", search=5)


def jumps_by_frequency(swept):
    return swept[["jump_frequency", "jump_before", "jump_after", "jump_direction", "jump_error"]].sortby(
        "jump_frequency"
    )


def folds_of(states):
    return states.isel(point=np.flatnonzero(states["special"].values == "fold")).sortby("frequency")


def test_the_jumps_lie_at_the_folds_of_the_curve_of_all_states_and_lead_to_states_of_it(case, both_ways, states):
    jumps, folds = jumps_by_frequency(both_ways), folds_of(states)
    assert jumps["jump_direction"].values.tolist() == ["down", "up", "down", "up"]
    width = 48.9e3 / 255  # of the resonance
    # with the samples that the curve begins with one fold is 3e-4 of that away
    assert jumps["jump_frequency"].values == pytest.approx(folds["frequency"].values, abs=1e-4 * width)
    assert (jumps["jump_error"].values < 1e-4).all()
    # the amplitude nears that at the fold as the square root of the way that is left
    assert jumps["jump_before"].values == pytest.approx(folds["amplitude"].values[:, 0], abs=2e-3 * 10e-9)
    f, amplitude, stable = (states[name].values for name in ("frequency", "amplitude", "stable"))
    for at, after in zip(jumps["jump_frequency"].values, jumps["jump_after"].values, strict=True):
        beside = np.flatnonzero((f[:-1] - at) * (f[1:] - at) <= 0.0)
        shares = (at - f[beside]) / (f[beside + 1] - f[beside])
        there = amplitude[beside, 0] + shares * (amplitude[beside + 1, 0] - amplitude[beside, 0])
        # straight lines between points of the curve of all states
        assert np.abs(there[stable[beside] & stable[beside + 1]] - after).min() < 1e-3 * 10e-9
    found = {(finding.name, finding.direction): finding.value for finding in df.summary(both_ways)}
    assert sorted([*found["jumps", "up"], *found["jumps", "down"]]) == jumps["jump_frequency"].values.tolist()


@pytest.mark.parametrize("method", ["periodic", "transient"])
def test_sudden_steps_jump_at_the_first_frequency_behind_a_fold(case, states, method):
    swept = df.run(
        case.set(f"solver.method={method}", "experiment.protocol=stepwise", "experiment.frequency.points=51")
    )
    frequency, jumps = swept["frequency"].values, jumps_by_frequency(swept.sortby("frequency"))
    folds = dict(zip(["down", "up", "down", "up"], [[], [], [], []], strict=True))
    for at, way in zip(folds_of(states)["frequency"].values, ["down", "up", "down", "up"], strict=True):
        behind = np.searchsorted(frequency, at) - (way == "down")
        folds[way].append((frequency[behind], swept["amplitude"].sel(direction=way).values[behind, 0]))
    for way, wanted in folds.items():
        of_way = jumps.isel(jump=np.flatnonzero(jumps["jump_direction"].values == way))
        assert [*zip(of_way["jump_frequency"].values, of_way["jump_after"].values, strict=True)] == wanted


def test_a_frequency_sweep_in_steps_stopped_beside_a_jump_finds_it_when_it_goes_on(case, every_look):
    upward = case.set("experiment.direction=up", "experiment.frequency.points=26", "experiment.protocol=stepwise")
    whole = df.run(upward)
    assert whole.sizes["jump"] == 2
    last = int(np.searchsorted(whole["frequency"].values, whole["jump_frequency"].values[0]))

    def stop(done, total, note):
        if done == last:
            raise KeyboardInterrupt

    part = df.run(upward, progress=stop)
    assert "jump_frequency" not in part
    rest = df.run(upward, resume=part)
    for name in ("jump_frequency", "jump_before", "jump_after"):
        np.testing.assert_array_equal(rest[name].values, whole[name].values)


@pytest.mark.parametrize("method", ["periodic", "transient"])
def test_no_jump_is_listed_where_a_long_step_leads_along_one_state(case, method):
    far = df.run(case.set("experiment.zc=40 nm", "experiment.frequency.points=9", f"solver.method={method}"))
    assert np.abs(np.diff(far["amplitude"].values[:, 0, 0])).max() > 4e-9
    assert "jump_frequency" not in far


def test_frequencies_from_a_start_of_their_own_each_list_no_jump(case):
    alone = df.run(
        case.set("experiment.protocol=stepwise", "experiment.carry_state=false", "experiment.frequency.points=26")
    )
    assert "jump_frequency" not in alone


def test_every_state_at_a_set_point_of_a_frequency_sweep_exists(both_ways, states):
    some = 0
    for set_point in (0.2, 0.5, 0.7, 0.8, 0.9, 0.95):
        real = df.at_set_point(states, set_point, ["phase"])
        for found in df.at_set_point(both_ways, set_point, ["phase"]).transpose("crossing", ...)["phase"]:
            # straight lines between points 10 Hz apart, where an interpolated jump is off by tens of degrees
            near = (np.abs(real["phase"].values[:, 0] - float(found[0])) < 1.0) & (
                np.abs(real["frequency"].values - float(found["frequency"])) < 2.0
            )
            assert near.any(), f"at {set_point} of A0 there is no state at {float(found['frequency']):.1f} Hz"
            some += 1
    assert some >= 10  # two flanks up and two down for each set point, but for those that a jump takes


def test_orbits_are_the_states_that_the_transient_settles_to(case, both_ways):
    frequency = both_ways["frequency"].values[::4]
    sampled = case.replace("solver.points_per_period", 256)
    slow = df.frequency_sweep(sampled.replace("solver.method", "transient"), frequency=frequency)
    fast = df.frequency_sweep(sampled, frequency=frequency)
    # settled to 1e-6 of A0 a period of decay; 10 nm
    assert np.abs(slow["amplitude"] - fast["amplitude"]).max() < 1e-6 * 10e-9
    assert np.abs(slow["phase"] - fast["phase"]).max() < 1e-3
    assert "multiplier_modulus" in fast
    assert (fast["multiplier_modulus"] < 1.0).all()


def test_every_frequency_may_start_anew(case):
    anew = df.frequency_sweep(
        case, frequency=["49.2 kHz", "49.4 kHz"], protocol="stepwise", carry_state=False, direction="both"
    )
    assert anew["phase"].sel(direction="up").values == pytest.approx(anew["phase"].sel(direction="down").values)


def test_two_tones_settle_in_time():
    case = df.example("figure-6")
    swept = df.frequency_sweep(case, frequency=["49.9 kHz", "50 kHz"], zc="14 nm", direction="up")
    assert swept["amplitude"].shape == (2, 2)
    assert (swept["status"] == df.Status.OK).all()
    # out of reach of the force, which is 1e-14 N there
    for frequency, found in zip((49.9e3, 50e3), swept["amplitude"].values, strict=True):
        free = np.abs(case.problem.at_frequency(frequency).free.sum(axis=1))  # the second tone stays where it is
        assert found == pytest.approx(free, rel=1e-4, abs=0.0)


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
        df.frequency_sweep(case.replace("solver.method", method), frequency=grid, zc=share * A0, protocol="stepwise")
        for method in ("periodic", "transient")
    )
    assert (orbits["status"] == 0).all() and (transients["status"] == 0).all()
    # a transient settles to 1e-6, and what is left is more where multipliers are near one
    assert float(np.abs(orbits["amplitude"] - transients["amplitude"]).max()) < 2e-5 * A0
