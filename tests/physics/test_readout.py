"""What a detector reads of the motion, against the motion itself."""

import math

import numpy as np
import pytest

import dforce as df
from dforce.core.errors import ParameterError
from dforce.instrument import beam

WATER = {"f0": 25e3, "k": 0.1, "Q": 2.5}
SECOND = {"f0": 160e3, "k": 4.0, "Q": 5}
SENSITIVITIES = (0.917670323115, 3.187185606808)  # slope at the end over 3/2, of a uniform beam


def case(drive=None, readout=None, **others):
    return df.Case(
        cantilever={"modes": [WATER, SECOND]}, drive=drive or {"A0": 10e-9}, readout=readout or {},
        tip={"radius": 10e-9}, sample={"youngs_modulus": 50e6, "poisson_ratio": 0.5},
        forces=[{"model": "dmt", "hamaker": 0.5e-20}], **others,
    )  # fmt: skip


def complex_of(amplitude, phase):
    return np.asarray(amplitude) * np.exp(-1j * np.radians(phase))


def moves(found):
    return complex_of(found.mode_amplitude.values, found.mode_phase.values)


def read(found):
    return complex_of(found.amplitude.values, found.phase.values)


def test_a_lever_of_light_sees_slopes():
    more = (*SENSITIVITIES, 5.232444030993, 7.330606447348)
    assert [beam.lever_factor(n) for n in range(1, 5)] == pytest.approx(more, abs=1e-12)
    found = df.dwell(case(readout={"kind": "optical_lever"}), zc="7 nm")
    z = moves(found)
    assert read(found)[0] == pytest.approx(SENSITIVITIES @ z, rel=1e-10)
    tip = complex_of(found.tip_amplitude.values, found.tip_phase.values)
    assert tip[0] == pytest.approx(z.sum(), rel=1e-10)


def test_parts_of_the_modes_in_what_a_static_calibration_sees_of_thermal_motion_add_up_to_four_thirds():
    # of kT over the static spring constant
    parts = [beam.lever_factor(n) ** 2 / (beam.wavenumber(n) ** 4 / 12.0) for n in range(1, 41)]
    assert parts[:4] == pytest.approx([0.81743, 0.25107, 0.08631, 0.04412], abs=5e-6)
    assert parts[0] == pytest.approx(0.8174347867, abs=5e-11)
    assert sum(parts) == pytest.approx(1.31982, abs=5e-6)


def test_modes_calibrated_each_by_itself_are_read_as_if_all_were_the_tones():
    found = df.dwell(case(readout={"kind": "optical_lever", "calibrated": "each_mode"}), zc="7 nm")
    z = moves(found)
    assert read(found)[0] == pytest.approx(z[0] + SENSITIVITIES[1] / SENSITIVITIES[0] * z[1], rel=1e-10)


def test_given_sensitivities_take_the_place_of_those_of_a_beam():
    readout = {"kind": "optical_lever", "mode_sensitivity": [1.0, -2.0]}
    found = df.dwell(case(readout=readout), zc="7 nm")
    assert read(found)[0] == pytest.approx(np.array([1.0, -2.0]) @ moves(found), rel=1e-10)


def test_an_interferometer_sees_where_the_tip_is():
    found = df.dwell(case({"A0": 10e-9, "excitation": "base"}, {"kind": "interferometer"}), zc="7 nm")
    assert found.amplitude.item() == pytest.approx(found.tip_amplitude.item(), rel=1e-12)
    assert found.phase.item() == pytest.approx(found.tip_phase.item(), abs=1e-9)
    deflection = df.dwell(case({"base_amplitude": found.base_amplitude.item(), "excitation": "base"}), zc="7 nm")
    assert deflection.tip_amplitude.item() == pytest.approx(found.tip_amplitude.item(), rel=1e-9)


@pytest.mark.parametrize("kind", ["deflection", "optical_lever", "interferometer"])
@pytest.mark.parametrize("excitation", ["force", "base"])
def test_the_free_amplitude_of_one_mode_is_what_the_detector_reads(kind, excitation):
    drive = {"A0": 10e-9, "excitation": excitation}
    one = df.Case(cantilever=WATER, drive=drive, readout={"kind": kind, "phase_reference": "free"})
    found = df.dwell(one, zc="30 nm")
    assert abs(one.problem.detected_free[0]) == pytest.approx(10e-9, rel=1e-12)
    assert found.amplitude_ratio.item() == pytest.approx(1.0, abs=1e-7)  # of the steps
    assert found.phase.item() == pytest.approx(90.0, abs=1e-5)


def test_second_mode_of_a_statically_calibrated_lever_reads_three_and_a_half_times_too_large():
    drive = {"tones": [{"A0": 10e-9}, {"A0": 1e-9}]}
    static, each = (
        case(drive, {"kind": "optical_lever", "calibrated": way}).problem.free for way in ("static", "each_mode")
    )
    ratio = abs(each[1, 1] / each[0, 0]) / abs(static[1, 1] / static[0, 0])
    assert ratio == pytest.approx(3.187185606808 / 0.917670323115, rel=1e-10)


@pytest.mark.long
def test_the_reference_stays_where_it_was_set():
    drive = {"A0": 10e-9, "excitation": "base", "frequency": "peak"}
    tuned, plain = case(drive), case(drive, {"phase_reference": "drive"})
    assert tuned.problem.tones == plain.problem.tones
    assert np.degrees(-np.angle(tuned.problem.detected_free)) % 360.0 > 91.0
    grid = {"frequency": ["20 kHz", "30 kHz"], "zc": "30 nm", "direction": "up"}
    away, lag = df.frequency_sweep(tuned, **grid), df.frequency_sweep(plain, **grid)
    shift = away.phase.values - lag.phase.values
    free = math.degrees(-np.angle(plain.problem.detected_free[0]))
    assert shift.ravel() == pytest.approx([90.0 - free] * 2, abs=1e-9)
    at_peak = df.dwell(tuned.replace(forces=[]), zc="30 nm")
    assert at_peak.phase.item() == pytest.approx(90.0, abs=1e-5)


def test_a_set_point_is_of_what_the_detector_reads():
    curve = df.approach(case(readout={"kind": "optical_lever"}), zc={"start": "12 nm", "stop": "4 nm", "points": 17})
    assert curve.amplitude_ratio.values == pytest.approx(curve.amplitude.values[:, 0] / 10e-9, rel=1e-12)
    state = df.at_set_point(curve, 0.8, ["amplitude"])
    assert state.amplitude.values[0, 0] == pytest.approx(8e-9, rel=1e-12)


def test_a_sweep_reads_what_single_runs_do():
    asked = case(
        {"A0": 10e-9, "excitation": "base"}, {"kind": "optical_lever", "phase_reference": "free"},
        experiment={"kind": "dwell", "zc": 7e-9},
    )  # fmt: skip
    grid = df.sweep(asked, over={"cantilever.modes.1.Q": [2.0, 4.0]})
    for place, Q in enumerate((2.0, 4.0)):
        alone = df.run(asked.replace("cantilever.modes.1.Q", Q))
        for name in ("amplitude", "phase", "tip_phase", "apparent_dissipated_energy"):
            assert grid[name].values[place] == pytest.approx(alone[name].values, rel=1e-8)


@pytest.mark.parametrize(
    ("readout", "message"),
    [
        ({"mode_sensitivity": [1.0, 2.0]}, 'readout.mode_sensitivity needs kind = "optical_lever"'),
        ({"calibrated": "each_mode"}, 'readout.calibrated needs kind = "optical_lever"'),
        ({"kind": "optical_lever", "mode_sensitivity": [1.0]}, "has 1 values for 2 modes; write one for each"),
        ({"kind": "optical_lever", "mode_sensitivity": [1.0, 0.0]}, "readout.mode_sensitivity has a 0"),
    ],
)
def test_a_detector_that_makes_no_sense_is_refused(readout, message):
    with pytest.raises(ParameterError) as raised:
        case(readout=readout)
    assert message in str(raised.value)
