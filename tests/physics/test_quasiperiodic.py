"""Bimodal motion with tones that never repeat together, or only after many periods: docs/observables.md."""

import math
from functools import cache

import numpy as np
import pytest
from compiled import INTEGRATORS, common_period, finish, weights, window_length

import dforce as df
from dforce.experiments.base import initial_motion

TWO_MODES = df.Cantilever(modes=[{"f0": "50 kHz", "k": 0.9, "Q": 10}, {"f0": "310 kHz", "k": 35.2, "Q": 60}])


def bimodal(ratio, phase="0 deg", **solver):
    tones = [{"A0": "10 nm"}, {"A0": "1 nm", "frequency": ratio * 50e3, "phase": phase}]
    return df.Case(
        cantilever=TWO_MODES, drive=df.Drive(tones=tones), forces=[df.forces.DMT(hamaker="0 J")],
        tip=df.Tip(radius="2 nm"), sample=df.Sample(youngs_modulus="1 GPa"), solver={"method": "transient", **solver},
    )  # fmt: skip


@cache
def tapping(ratio, phase="0 deg"):
    return df.dwell(bimodal(ratio, phase), "8 nm", recorded_periods=1)


def test_common_period_of_commensurate_tones():
    assert common_period([50e3, 310e3]) == 5
    assert common_period([50e3, 310e3, 125e3]) == 10
    assert common_period([48.9e3, 6.26689302577 * 48.9e3]) is None
    assert common_period([50e3]) == 1


def test_window_holds_twelve_turns_of_the_slowest_beat():
    assert window_length([1.0, 6.001 + 1e-7]) == pytest.approx(12_000, rel=1e-3)
    assert window_length([1.0, 2.5003 + 1e-7]) == pytest.approx(12 / 6e-4, rel=1e-3)
    assert window_length([1.0, 5.618]) == 256
    # two tones that beat with each other, though neither beats with the first
    assert window_length([1.0, math.sqrt(40.0), math.sqrt(40.0) + 1.001]) >= 12_000


@pytest.mark.parametrize("cycles", [12.0, 12.4, 30.7])
def test_weighted_average_leaves_a_beat_of_twelve_turns_3e_7(cycles):
    periods = 4000
    beat = np.exp(2j * math.pi * cycles * np.arange(periods) / periods)
    weight = weights([1.0, math.sqrt(40.0)], periods)
    assert weight.sum() == pytest.approx(1.0, rel=1e-12)
    assert abs(weight @ beat) < 4e-7
    # the plain average leaves a part in forty of twelve and a half turns
    assert abs(np.exp(2j * math.pi * 12.5 * np.arange(periods) / periods).mean()) > 0.02


@pytest.mark.parametrize("ratio", [6.2, math.sqrt(39.0), 6.011 + 1e-6, 4.003])
def test_linear_motion_has_its_exact_amplitudes_and_phases(ratio):
    """Without a force the amplitudes are those of the free modes; the averages mix in at most 4e-7 of the other tone."""
    case = bimodal(ratio, phase="33 deg", points_per_period=1024)
    result = df.dwell(case, "1 um", recorded_periods=1)
    relative = case.problem.free * np.exp(-1j * np.array([tone.phase for tone in case.problem.tones]))[:, None]
    total = relative.sum(axis=1)
    assert int(result.status) == df.Status.OK
    # of the larger amplitude, 10 nm; RK4's own error is 5e-7 of tone 2
    assert result.amplitude.values == pytest.approx(abs(total), abs=4e-7 * 10e-9)
    assert result.phase.values == pytest.approx(-np.degrees(np.angle(total)), abs=math.degrees(4e-7 * 10))


def test_commensurate_tones_are_averaged_over_their_common_period_exactly():
    """Figure 6: five periods; another start of the window gives the same to the settling tolerance."""
    case = df.example("figure-6").replace("solver.method", "transient").replace("solver.settle_tolerance", 1e-9)
    once = df.dwell(case.replace("solver.measured_periods", 5), "8 nm", recorded_periods=5)
    more = df.dwell(case.replace("solver.measured_periods", 40), "8 nm", recorded_periods=5)
    assert once.amplitude.values == pytest.approx(more.amplitude.values, rel=2e-8)
    assert once.phase.values == pytest.approx(more.phase.values, abs=1e-6)
    # lock-in by hand over the recorded five periods, both tones
    t, z = once.time.values, once.deflection.values
    for j, tone in enumerate(case.problem.tones):
        c = 2 * np.mean(z * np.exp(-2j * math.pi * tone.frequency * t))
        assert abs(c) == pytest.approx(float(once.amplitude[j]), rel=1e-8)
        assert -math.degrees(np.angle(c)) == pytest.approx(float(once.phase[j]), abs=1e-5)


def test_nonlinear_motion_agrees_with_a_very_long_plain_window():
    """A plain window of N periods leaves beats of order 1/N; the weighted one is compared with 20,000 of them."""
    ratio = math.sqrt(39.0)
    case = bimodal(ratio)
    result = tapping(ratio)
    assert int(result.status) == df.Status.OK
    integrator = INTEGRATORS["rk4"](case.problem, case.solver, 10)
    integrator.place(8e-9)
    motion, _ = integrator.lock_in(initial_motion(integrator, "free"), 600)
    count = 20_000
    _, rows = integrator.observe(motion, count)
    plain = finish(case.problem, 10, rows, np.full(count, 1 / count))
    # beats of size below 0.3 nm and a turn of at least 0.05 a period: what is left is 0.3 nm / (0.05 pi N)
    assert result.amplitude.values == pytest.approx(plain["amplitude"], abs=1e-13)
    assert result.phase.values == pytest.approx(plain["phase"], abs=0.01)
    for name in ("mean_deflection", "mean_force", "contact_fraction", "total_virial"):
        assert float(result[name]) == pytest.approx(float(plain[name]), rel=2e-4)
    assert result.virial.values == pytest.approx(plain["virial"], rel=2e-3)
    # a window's largest force is never above that of a longer one, and comes close to it
    assert 0.99 * plain["peak_force"] < float(result.peak_force) <= plain["peak_force"]


@pytest.mark.parametrize("ratio", [6.0455, 6.143, 6.4446])
def test_slow_beats_of_a_high_order_are_averaged_over_a_longer_window(ratio):
    """The 22nd, 7th and 9th multiple of the second tone are near a multiple of the first."""
    result = tapping(ratio)
    assert int(result.status) == df.Status.OK
    long = df.dwell(bimodal(ratio, settle="fixed", periods=3000, measured_periods=24_000), "8 nm", recorded_periods=1)
    assert result.amplitude.values == pytest.approx(long.amplitude.values, rel=1e-5)
    assert result.phase.values == pytest.approx(long.phase.values, abs=1e-3)
    assert result.virial.values == pytest.approx(long.virial.values, rel=1e-4)


def test_incommensurate_tones_do_not_care_for_the_phase_between_them():
    """All phases between the tones are met in time, so the averages cannot depend on the one at the start."""
    ratio = math.sqrt(39.0)
    first, second = tapping(ratio), tapping(ratio, "100 deg")
    assert second.amplitude.values == pytest.approx(first.amplitude.values, rel=1e-6)
    assert second.phase.values == pytest.approx(first.phase.values, abs=1e-4)


def test_commensurate_tones_do_care_for_the_phase_between_them():
    """With f2 = 6 f1 the motion repeats every period, and differs with the phase of the second tone."""
    first, second = tapping(6.0), tapping(6.0, "100 deg")
    assert abs(float(second.amplitude[1]) / float(first.amplitude[1]) - 1.0) > 0.01


def test_spectrum_shows_both_tones_of_a_motion_that_never_repeats():
    ratio = math.sqrt(39.0)
    spectrum = df.dwell(bimodal(ratio), "1 um").spectrum
    step = float(spectrum.frequency[1])
    for frequency, amplitude in ((50e3, 10e-9), (ratio * 50e3, 1e-9)):
        near = spectrum.sel(frequency=slice(frequency - 3 * step, frequency + 3 * step))
        assert abs(float(near.idxmax()) - frequency) <= step
        # a line between two places of the spectrum loses at most a fifth of its height to them
        assert 0.8 * amplitude < float(near.max()) < 1.02 * amplitude
