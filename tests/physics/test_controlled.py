"""A phase-locked loop and an amplitude control in time lead to the locked states of an independent solver."""

import math

import numpy as np
import pytest
from tiers import some_long

import dforce as df
from dforce.solvers.controlled import ToneControllers, follow
from dforce.solvers.integrator import Engine, Motion

NM, E_EFF, RIGHT = 1e-9, 1e9 / 0.91, math.pi / 2.0
DMT, HERTZ = [df.forces.DMT(hamaker="2e-20 J")], [df.forces.Hertz()]
VISCOUS = [df.forces.Hertz(), df.forces.KelvinVoigt(viscosity="100 Pa s")]
SETTINGS = df.SolverSettings(settle_tolerance=1e-11, relative_tolerance=1e-12)


def problem(f0, Q, A0, forces, E_eff=E_EFF):
    return df.Case(
        cantilever={"f0": f0, "k": 0.9, "Q": Q},
        drive={"A0": A0},
        tip={"radius": 2e-9},
        sample={"youngs_modulus": 0.91 * E_eff, "poisson_ratio": 0.3},
        forces=forces,
    ).problem


def followed(one, zc, loops, settings=SETTINGS):
    """Return what loops make of the free motion at resonance."""
    start = Motion((0.0, 1.0), np.zeros(0), np.zeros(0), 0)
    found = follow(Engine(one, settings, 0), [zc], start, [loops])
    return found._replace(**{name: getattr(found, name)[:, 0] for name in ("frequency", "ratio", "amplitude", "phase")})


# (f0, Q, A0, forces, E_eff, zc; divisor of omega0 that is b; frequency shift and its tolerance; drive and amplitude)
ROWS = {
    "S1b": (48.9e3, 255, 10 * NM, DMT, E_EFF, 10.2 * NM, 100, (-44.4831237, 2e-7), 3.5262084049e-11, None),
    "S2a": (48.9e3, 100, 4.2 * NM, HERTZ, E_EFF, 4.0 * NM, 100, (442.8092277, 2e-7), 3.814965522e-11, None),
    "S3a": (48.9e3, 2, 5.0 * NM, HERTZ, E_EFF, 4.5 * NM, 20, (1036.966215, 2e-6), 2.29969616e-9, None),
    "S4a": (49e3, 50, 9.0 * NM, VISCOUS, 50e6 / 0.91, 8.0 * NM, 100, (73.4221824, 2e-7), 1.691291067e-10, None),
    "S7b": (49e3, 50, 9.0 * NM, VISCOUS, 50e6 / 0.91, 8.0 * NM, 100, (47.627398, 2e-6), None, 8.751010037e-9),
}


@pytest.mark.parametrize("name", some_long(ROWS, ["S2a"]))
def test_loops_lead_to_the_locked_state_of_an_independent_solver(name):
    f0, Q, A0, forces, E_eff, zc, divisor, (shift, digits), drive, amplitude = ROWS[name]
    one = problem(f0, Q, A0, forces, E_eff)
    loops = ToneControllers(RIGHT, A0 if amplitude is None else None, f0 / divisor, f0 / divisor)
    found = followed(one, zc, loops)
    assert found.settled
    assert found.frequency[-1] - f0 == pytest.approx(shift, rel=0, abs=digits)
    assert found.amplitude[-1] == pytest.approx(amplitude or A0, rel=1e-9)
    assert one.tones[0].force * found.ratio[-1] == pytest.approx(drive or 0.9 * A0 / Q, rel=1e-8)


@pytest.mark.parametrize("order", some_long([0, 1, 2, 4], [1, 2]))
def test_loops_of_a_sixth_of_the_frequency_settle_with_every_low_pass(order):
    one = problem(48.9e3, 255, 10 * NM, DMT)
    loops = ToneControllers(RIGHT, 10 * NM, 48.9e3 / 6, 48.9e3 / 6, order)
    found = followed(one, 10.2 * NM, loops, df.SolverSettings())
    assert found.settled
    assert found.frequency[-1] - 48.9e3 == pytest.approx(-44.48312, abs=1e-4)


def test_free_loop_follows_a_change_of_set_point_with_its_bandwidth():
    one = problem(48.9e3, 255, 10 * NM, HERTZ)
    loops = ToneControllers(RIGHT, 11 * NM, 50.0, 50.0)
    found = followed(one, 50 * NM, loops)
    left = 11 * NM - found.amplitude
    time = np.cumsum(1.0 / found.frequency)
    later = (left < 0.5 * NM) & (left > 0.05 * NM)
    rate = -np.polyfit(time[later], np.log(left[later]), 1)[0]
    assert rate == pytest.approx(2.0 * math.pi * 50.0, rel=0.01)  # the lock-in is late by a period, 0.6 %


def a_case(operation="fm", **more):
    return df.Case(
        cantilever={"f0": 48.9e3, "k": 0.9, "Q": 100},
        drive={"A0": "4.2 nm", "operation": operation},
        tip={"radius": 2e-9},
        sample={"youngs_modulus": "1 GPa", "poisson_ratio": 0.3},
        forces=HERTZ,
        **more,
    )


def test_dwell_under_controllers_has_the_numbers_of_the_locked_state():
    solved = df.dwell(a_case(), 4 * NM)
    in_time = df.dwell(a_case(experiment={"kind": "dwell", "zc": 4 * NM, "controllers": {}}), 4 * NM)
    assert df.Status(int(in_time.status)) == df.Status.OK
    for name in (
        "frequency_shift",
        "drive_ratio",
        "amplitude",
        "phase",
        "virial",
        "mean_deflection",
        "max_indentation",
    ):
        assert in_time[name].values == pytest.approx(solved[name].values, rel=2e-4), name
    assert in_time.loop_frequency_shift.values[0] == 0.0
    assert in_time.loop_frequency_shift.values[-1] == pytest.approx(float(in_time.frequency_shift[0]))
    assert "frequency shift" in str(df.summary(in_time))
    assert [one.name for one in df.advice(in_time)] == [one.name for one in df.advice(solved)]


def test_dwell_under_controllers_shows_how_many_periods_are_left():
    seen = []
    dwell = a_case(experiment={"kind": "dwell", "zc": 4 * NM, "controllers": {}})
    df.run(dwell, progress=lambda done, total, _: seen.append((done, total)))
    done, total = np.array(seen[2:]).T  # the first two come before the first period
    assert (np.diff(done) >= 0).all() and (done[:-1] < total[:-1]).all() and done[-1] == total[-1]
    assert total.min() > 0.5 * total[-1]  # the time left is right within a factor of two from the first period on


@pytest.mark.parametrize(
    ("operation", "controllers", "sentence"),
    [
        ("am", {}, "experiment.controllers needs one tone with drive.operation"),
        ("fm", {"phase_bandwidth": "9 kHz"}, "phase_bandwidth is above a sixth of the drive frequency"),
    ],
)
def test_controllers_that_cannot_act_are_refused_in_a_sentence(operation, controllers, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        a_case(operation, experiment={"kind": "dwell", "zc": 4 * NM, "controllers": controllers})
