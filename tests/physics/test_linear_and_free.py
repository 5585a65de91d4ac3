"""Motion known in closed form: without force, with a linear force, with a small amplitude; docs/theory."""

import cmath
import math

import numpy as np
import pytest

import dforce as df

FAR = "1 um"  # nothing here reaches so far: Hertz contact and DMT without attraction
SAMPLE = {"sample": df.Sample(youngs_modulus="1 GPa"), "tip": df.Tip(radius="2 nm", half_angle="20 deg")}
HERTZ, NO_ATTRACTION = df.forces.Hertz(), df.forces.DMT(hamaker="0 J")
TWO_MODES = df.Cantilever(modes=[{"f0": "50 kHz", "k": 0.9, "Q": 10}, {"f0": "310 kHz", "k": 35.2, "Q": 60}])


def single(drive, forces=(HERTZ,), Q=100.0, **solver):
    cantilever = df.Cantilever(f0="50 kHz", k="1 N/m", Q=Q)
    return df.Case(
        cantilever=cantilever, drive=drive, forces=forces, **SAMPLE, solver={"method": "transient", **solver}
    )


def bimodal(acts_on="all_modes", phase="0 deg", f2=None, **solver):
    tones = [{"A0": "10 nm"}, {"A0": "1 nm", "phase": phase, "frequency": f2}]
    return df.Case(
        cantilever=TWO_MODES, drive=df.Drive(tones=tones, acts_on=acts_on), forces=[NO_ATTRACTION], **SAMPLE,
        solver={"method": "transient", **solver},
    )  # fmt: skip


def response(case, t):
    """Return the deflection of each mode at times (s) after a start from rest: docs/theory/motion.md, free motion."""
    z = np.zeros((len(case.problem.modes), len(t)))
    for n, mode in enumerate(case.problem.modes):
        w0 = 2 * math.pi * mode.f0
        g, wd = w0 / (2 * mode.Q), w0 * math.sqrt(1 - 1 / (4 * mode.Q**2))
        for tone in case.problem.tones:
            if case.drive.acts_on == "own_mode" and tone.mode != n:
                continue
            r, own = tone.frequency / mode.f0, case.problem.modes[tone.mode]
            ro = tone.frequency / own.f0
            force = own.k * tone.A0 * math.hypot(1 - ro**2, ro / own.Q)
            x = force / mode.k / complex(1 - r * r, r / mode.Q) * cmath.exp(1j * tone.phase)
            w = 2 * math.pi * tone.frequency
            c, s = -x.real, (-(1j * w * x).real - g * x.real) / wd
            z[n] += (x * np.exp(1j * w * t)).real
            z[n] += np.exp(-g * t) * (c * np.cos(wd * t) + s * np.sin(wd * t))
    return z


def from_rest(case, periods):
    case = case.replace("solver.settle", "fixed").replace("solver.periods", periods - 8)
    return df.dwell(case, FAR, start="rest", record="all", recorded_periods=8)


# Steps of RK4 are exact for the lever alone up to an error of the first one, which is of order 4.
@pytest.mark.parametrize(
    "solver", [{"points_per_period": 2048}, {"integrator": "engine"}, {"integrator": "lsoda"}], ids=str
)
def test_start_from_rest_has_the_reference_values(solver):
    case = single(df.Drive(A0="10 nm"), **solver)
    assert case.problem.drive[0, 0] == pytest.approx(1e-10, rel=1e-14)
    trace = from_rest(case, 60)
    points = trace.attrs["samples_per_period"]
    # eight digits of the motion's size: the second value happens to be near a passage through zero
    for turns, expected in ((10.25, 2.75302585734e-9), (50.5, -8.11667590666e-12)):
        at = round(turns * points)
        assert trace.time.values[at] == pytest.approx(turns / 50e3, rel=1e-12)
        assert trace.deflection.values[at] == pytest.approx(expected, abs=1e-8 * 3e-9)


@pytest.mark.parametrize("acts_on", ["all_modes", "own_mode"])
def test_two_modes_and_tones_start_from_rest_as_the_formula_says(acts_on):
    case = bimodal(acts_on, phase="70 deg", f2="301 kHz", points_per_period=4096)
    trace = from_rest(case, 30)
    expected = response(case, trace.time.values)
    assert trace.mode_deflection.values == pytest.approx(expected, abs=1e-8 * 10e-9)


def test_drive_off_resonance_still_gives_the_free_amplitude_asked_for():
    for r in (0.9, 1.0, 1.07):
        case = single(df.Drive(A0="10 nm", frequency=r * 50e3), Q=20.0, points_per_period=1024)
        result = df.dwell(case, FAR)
        lag = math.degrees(math.atan2(r / 20.0, 1 - r * r))
        # the motion starts as the free one, so nothing has to settle
        assert float(result.amplitude[0]) == pytest.approx(10e-9, rel=1e-8)
        assert float(result.phase[0]) == pytest.approx(lag, abs=1e-6)


@pytest.mark.parametrize("method", ["periodic", "transient"])
@pytest.mark.parametrize("r", [0.99997, 1.0])
def test_few_steps_move_the_lever_alone_exactly_whatever_its_q(method, r):
    """Steps as they are would turn the phase by 2 Q (2 pi / 64)^4 / 120 at resonance: 2.3 degrees.

    An orbit is accepted with a residual of 1e-11, which Q / pi periods add up.
    """
    case = single(df.Drive(A0="10 nm", frequency=r * 50e3), Q=26e3, points_per_period=64, method=method)
    found = df.dwell(case, FAR)
    assert found.attrs["samples_per_period"] == 64
    assert float(found.amplitude[0]) == pytest.approx(10e-9, rel=1e-7)
    assert float(found.phase[0]) == pytest.approx(math.degrees(math.atan2(r / 26e3, 1 - r * r)), abs=2e-5)


def test_few_steps_follow_the_lever_alone_from_rest():
    """The error of the first step, 1e-6, stays; unfitted steps add up 2e-4 over 50 periods."""
    case = single(df.Drive(A0="10 nm"), points_per_period=64)
    trace = from_rest(case, 60)
    assert trace.deflection.values == pytest.approx(response(case, trace.time.values)[0], abs=2e-6 * 3e-9)


def test_phase_lag_is_behind_the_tone_whatever_the_phase_of_the_tone():
    plain = df.dwell(single(df.Drive(A0="10 nm")), FAR)
    turned = df.dwell(single(df.Drive(A0="10 nm", phase="125 deg")), FAR)
    assert float(turned.phase[0]) == pytest.approx(float(plain.phase[0]), abs=1e-6)
    # z = A cos(wt + theta - 90 deg): the motion itself starts 125 degrees further on
    assert float(turned.deflection[0]) == pytest.approx(10e-9 * math.cos(math.radians(125 - 90)), rel=1e-6)
    assert float(turned.velocity[0]) == pytest.approx(
        -2 * math.pi * 50e3 * 10e-9 * math.sin(math.radians(125 - 90)), rel=1e-6
    )


@pytest.mark.parametrize("acts_on", ["all_modes", "own_mode"])
def test_free_bimodal_amplitudes_are_those_of_the_sum_of_the_modes(acts_on):
    case = bimodal(acts_on, phase="-40 deg", points_per_period=2048)
    result = df.dwell(case, FAR)
    free = np.zeros((2, 2), dtype=complex)  # by tone and mode, relative to the tone's phase
    for j, tone in enumerate(case.problem.tones):
        for n, mode in enumerate(case.problem.modes):
            if acts_on == "all_modes" or n == j:
                r, own = tone.frequency / mode.f0, case.problem.modes[j]
                free[j, n] = own.k * tone.A0 / own.Q / mode.k / complex(1 - r * r, r / mode.Q)
    total = free.sum(axis=1)
    assert result.amplitude.values == pytest.approx(abs(total), rel=1e-7)
    assert result.phase.values == pytest.approx(-np.degrees(np.angle(total)), abs=1e-5)
    assert result.mode_amplitude.values == pytest.approx(abs(np.diag(free)), rel=1e-7)
    assert result.mode_phase.values == pytest.approx([90.0, 90.0], abs=1e-5)
    # acting on all modes, drive 2 moves mode 1 by k2 A02/(Q2 k1 r^2): so the choice can be seen
    assert (abs(free[1, 0]) > 1e-12) == (acts_on == "all_modes")


@pytest.mark.parametrize("integrator", ["rk4", "engine"])
def test_linear_force_gives_the_exact_orbit(integrator):
    """A flat punch always in contact is a spring; pressed 20 nm in, the reference with zc - d* = -20 nm."""
    stiffness = 0.05
    case = single(df.Drive(A0="10 nm"), [df.forces.Sneddon(geometry="punch")], integrator=integrator)
    # 2 E_eff R = 0.05 N/m with a rigid tip
    case = case.replace("sample.youngs_modulus", stiffness / (2 * 2e-9) * (1 - 0.3**2))
    case = case.replace("solver.points_per_period", 1024).replace("solver.settle_tolerance", 1e-10)
    result = df.dwell(case, 0.165e-9 - 20e-9)
    assert float(result.amplitude[0]) == pytest.approx(1.9611613514e-9, rel=1e-8)
    assert float(result.phase[0]) == pytest.approx(11.30993247, abs=1e-6)
    assert float(result.mean_deflection) == pytest.approx(0.9523809524e-9, rel=1e-8)
    assert float(result.contact_fraction) == 1.0
    assert float(result.total_dissipated_energy) == pytest.approx(0.0, abs=1e-28)  # of a virial of 1e-19 J
    # V = -kappa <z^2> about the mean, of all harmonics
    assert float(result.total_virial) == pytest.approx(-stiffness * 1.9611613514e-9**2 / 2, rel=1e-7)


def test_small_amplitude_feels_the_gradient_of_the_force():
    """The force acts as a spring -dF/dd at the mean distance, up to the square of A/d."""
    hamaker, radius, zc = 1e-19, 2e-9, 3e-9
    case = single(df.Drive(A0="0.2 pm"), [df.forces.DMT(hamaker=hamaker)], integrator="engine", method="transient")
    result = df.dwell(case.replace("solver.settle_tolerance", 1e-9), zc)
    d = zc + float(result.mean_deflection)
    spring = -hamaker * radius / (3 * d**3)
    x = (1.0 / 100.0) / complex(spring, 1.0 / 100.0)  # k = 1 N/m, at resonance
    assert float(result.amplitude[0]) == pytest.approx(abs(x) * 0.2e-12, rel=1e-6)
    assert float(result.phase[0]) == pytest.approx(-math.degrees(cmath.phase(x)), abs=1e-4)
    assert float(result.mean_deflection) == pytest.approx(-hamaker * radius / (6 * d * d), rel=1e-6)


def test_start_with_amplitude_and_phase_is_where_it_says():
    case = single(df.Drive(A0="10 nm", phase="20 deg"), settle="fixed", periods=1)
    start = {"amplitude": "3 nm", "phase": "40 deg"}
    trace = df.dwell(case, FAR, start=start, record="all")
    # z = A cos(wt + theta - phase)
    angle = math.radians(20 - 40)
    assert float(trace.deflection[0]) == pytest.approx(3e-9 * math.cos(angle), rel=1e-12)
    assert float(trace.velocity[0]) == pytest.approx(-2 * math.pi * 50e3 * 3e-9 * math.sin(angle), rel=1e-12)
