"""The calibration of measured curves, on curves whose truth is known."""

from __future__ import annotations

from contextlib import suppress
from importlib import resources

import measured_curve
import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.inverse.checks import doubts
from dforce.inverse.energies import Lever, dissipated_energy, virial
from dforce.inverse.free_part import stretch
from dforce.inverse.values import measured, show

SETS = 40
TUNE = {"f0": "70.00(1) kHz", "k": "2.0(1) N/m", "Q": "100(2)"}


def test_the_noise_is_found_and_errors_are_right():
    """Over many draws: the noise without bias, and what was found minus the truth in units of its error about 1."""
    found = [df.calibrate(measured_curve.dataset(seed=seed)).attrs for seed in range(SETS)]
    noise = np.array([one["amplitude_error"] for one in found]) / measured_curve.NOISE
    turn = np.array([one["phase_error"] for one in found]) / measured_curve.TURN
    pull = np.array([(one["free_amplitude"] - measured_curve.A0) / one["free_amplitude_error"] for one in found])
    # some 40 differences each: 13 % of a noise, and its mean over 40 draws within 3 x 2 %
    assert abs(noise.mean() - 1.0) < 0.07 and abs(turn.mean() - 1.0) < 0.07
    assert noise.std() < 0.2
    assert 0.7 < pull.std() < 1.4 and abs(pull.mean()) < 0.5
    # the error of the offset holds what may change along the free part, too: it is wide, never too small
    offset = np.array([one["phase_offset"] / one["phase_offset_error"] for one in found])
    assert np.abs(offset).max() < 2.0


def test_an_offset_of_the_phase_is_taken_out():
    data = measured_curve.dataset()
    data["phase"] = data["phase"] - 37.0
    shifted, plain = df.calibrate(data), df.calibrate(measured_curve.dataset())
    np.testing.assert_allclose(shifted.phase, plain.phase, atol=1e-9)
    assert abs(shifted.attrs["phase_offset"] - plain.attrs["phase_offset"] + 37.0) < 1e-9


def test_the_free_part_ends_before_the_forces_begin():
    data = df.calibrate(measured_curve.dataset())
    assert float(data.height.where(data.free).min()) > 24e-9
    assert data.free.sum() > 20


def test_the_lag_of_the_free_motion_is_that_of_the_case():
    case = df.Case.from_toml(
        """
        cantilever = { f0 = "70 kHz", k = 2.0, Q = 100.0 }
        drive = { A0 = "20 nm", frequency = "69.8 kHz" }
        """
    )
    r = 69.8 / 70.0
    lag = np.degrees(np.arctan2(r / 100.0, 1.0 - r * r))
    data = df.calibrate(measured_curve.dataset(), case)
    assert abs(float(data.phase.where(data.free).mean()) - lag) < 1e-9
    assert data.attrs["drive_frequency"] == pytest.approx(69.8e3)
    by_hand = measured_curve.dataset().assign_attrs(drive_frequency=69.8e3)
    by_hand = df.calibrate(by_hand, thermal={"f0": "70 kHz", "Q": 100})
    np.testing.assert_allclose(by_hand.phase, data.phase, atol=1e-9)


def test_a_thermal_tune_stands_in_the_attributes_with_its_errors():
    attrs = df.calibrate(measured_curve.dataset(), thermal=TUNE).attrs
    assert [attrs[name] for name in ("f0", "k", "Q")] == [70e3, 2.0, 100.0]
    assert [attrs[f"{name}_error"] for name in ("f0", "k", "Q")] == pytest.approx([10.0, 0.1, 2.0])


def test_the_check_without_a_model_sees_what_cannot_be():
    def doubts(data):
        return [line for line in df.calibrate(data).attrs["history"] if line.startswith("doubt: sin")]

    good = measured_curve.dataset()
    assert not doubts(good)
    wrong = good.copy(deep=True)  # a free amplitude that is too small: the repulsive part seems to gain energy
    wrong["amplitude"] = wrong["amplitude"].where(wrong["height"] > 25e-9, 1.02 * wrong["amplitude"])
    assert "wrong free amplitude" in doubts(wrong)[0]


def test_energies_of_a_conservative_sample_vanish_within_their_errors():
    """The virial follows from the identity at resonance, V = -k A A0 cos(phase) / 2Q; a loss is not there."""
    data = df.calibrate(measured_curve.dataset(), thermal=TUNE)
    off = data.dissipated_energy / np.hypot(data.dissipated_energy_error, data.dissipated_energy_common_error)
    assert float(np.abs(off).max()) < 5.0
    expected = -2.0 * data.amplitude * data.attrs["free_amplitude"] * np.cos(np.radians(data.phase)) / 200.0
    np.testing.assert_allclose(data.virial, expected, rtol=1e-12)
    # k is known to 5 %, Q to 2 %: virials that are large are known no better
    large = np.abs(data.virial) > 0.5 * float(np.abs(data.virial).max())
    share = (data.virial_common_error / np.abs(data.virial)).where(large, drop=True)
    assert float(share.min()) > 0.05 and float(share.max()) < 0.1


def test_energies_are_those_of_the_simulated_motion():
    """Exact identities: amplitude and phase of a result give the virial and the loss that its forces do."""
    case = df.example("figure-5").set(
        'experiment={ kind = "approach", zc = { start = "9 nm", stop = "4 nm", points = 11 } }'
    )
    result = df.run(case)
    mode, tone = case.problem.modes[0], case.problem.tones[0]
    lever = Lever(mode.k, mode.Q, tone.A0, tone.frequency / mode.f0)
    amplitude, lag = result.amplitude.sel(tone=1).values, np.radians(result.phase.sel(tone=1).values)
    scale = np.pi * mode.k * tone.A0**2 / mode.Q  # what the drive gives per period; a run promises 1e-4 of it
    np.testing.assert_allclose(virial(lever, amplitude, lag), result.virial.sel(mode=1), atol=1e-4 * scale)
    np.testing.assert_allclose(
        dissipated_energy(lever, amplitude, lag), result.dissipated_energy.sel(mode=1), atol=1e-4 * scale
    )
    assert float(result.dissipated_energy.max()) > 0.1 * scale


def drifting(slope, **how):
    data = measured_curve.dataset(**how)
    data["amplitude"] = data["amplitude"] + slope * measured_curve.A0 * (data["height"] - 40e-9) / 35e-9
    return data


@pytest.mark.parametrize(
    "changes",
    [
        {"drive.lag": 0.5},
        {"drive.frequency": 69.5e3, "readout.phase_reference": "free"},
        {"drive.frequency": "peak", "cantilever.Q": 3.0},
        {"readout.kind": "optical_lever"},
        {"drive.excitation": "base"},
    ],
)
def test_energies_count_from_the_free_motion_of_the_case(changes):
    """Whatever phase and amplitude count from, virial and energy are those of the force along the simulated motion."""
    case = df.Case(
        cantilever={"f0": 70e3, "k": 2.0, "Q": 80.0},
        drive={"A0": 20e-9},
        tip={"radius": 10e-9},
        sample={"youngs_modulus": 0.5e9, "poisson_ratio": 0.3},
        forces=[df.forces.Hertz(), df.forces.KelvinVoigt(viscosity=20.0)],
        solver={"accuracy": 1e-6},
    )
    for path, value in changes.items():
        case = case.replace(path, value)
    curve = df.approach(case, zc=np.linspace(40e-9, 14e-9, 53))
    named = {name: ("point", curve[name].values[:, 0]) for name in ("amplitude", "phase")}
    data = xr.Dataset(
        {"height": ("point", curve.zc.values), **named},
        {"direction": ("point", ["approach"] * 53)},
        {"phase_convention": "lag"},
    )
    found = df.calibrate(data, case, errors={"amplitude": 1e-13, "phase": 1e-3})
    for name in ("virial", "dissipated_energy"):
        true = curve[name].values[:, 0]
        np.testing.assert_allclose(found[name].values, true, atol=1e-4 * np.abs(true).max())
    assert not [line for line in found.attrs["history"] if line.startswith("doubt: sin")]
    if changes.keys() != {"drive.frequency", "readout.phase_reference"}:
        with pytest.raises(df.ParameterError, match="belong to the case of their calibration; pass this case"):
            df.reconstruct(found)


def test_a_long_drift_is_subtracted_and_said():
    data = df.calibrate(drifting(0.02, points=400))
    assert any(line.startswith("drift: the amplitude") and "subtracted" in line for line in data.attrs["history"])
    plain = df.calibrate(measured_curve.dataset(points=400))
    # what is left is the error of the slope, times the way to the surface: 30 pm / sqrt(170) x sqrt(12) x 2.3, twice
    apart = (data.amplitude - data.attrs["free_amplitude"]) - (plain.amplitude - plain.attrs["free_amplitude"])
    assert float(np.abs(apart).max()) < 2.0 * 18e-12 < 0.1 * 0.02 * measured_curve.A0
    with pytest.raises(df.ParameterError, match="baseline = 'line' subtracts"):
        df.calibrate(drifting(0.02, points=400), baseline="none")


def test_a_drift_is_found_although_noise_hides_it_over_a_short_stretch():
    found, plain = (
        [df.calibrate(drifting(slope, points=120, seed=seed)) for seed in range(SETS)] for slope in (0.02, 0.0)
    )
    told = [any("the line is subtracted" in line for line in data.attrs["history"]) for data in found]
    assert sum(told) > 0.9 * SETS
    assert not any("is subtracted" in line for data in plain for line in data.attrs["history"])


@pytest.mark.parametrize(("tail", "least", "most"), [(True, 0, 3), (False, 30, SETS)])
def test_a_phase_drifts_along_a_straight_line_and_the_tail_of_a_force_does_not(tail, least, most):
    """Both shift the phase by 3 degrees up to 25 nm; the tail falls by e**2 along the free part."""
    said = []
    for seed in range(SETS):
        data = measured_curve.dataset(points=60, seed=seed)
        depth = (40e-9 - data["height"]) / 15e-9
        data["phase"] = data["phase"] + 3.0 * (np.exp(2.0 * (depth - 1.0)) if tail else depth)
        said.append("\n".join(df.calibrate(data).attrs["history"]))
    drift = "drift: the phase of the approach"
    assert least <= sum(drift in history for history in said) <= most


def test_a_drift_between_approach_and_retract_is_doubted():
    there, back = (measured_curve.dataset(points=120, seed=seed) for seed in (1, 2))
    back = back.isel(point=slice(None, None, -1)).assign_coords(direction=("point", np.repeat("retract", 120)))

    def told(later):
        data = xr.concat([there, back.assign(amplitude=later * back["amplitude"])], "point").assign_attrs(there.attrs)
        return [line for line in doubts(df.calibrate(data).attrs) if line.startswith("the free amplitude drifts, by")]

    assert len(told(1.02)) == 1 and not told(1.0)


def test_a_sign_of_the_phase_by_which_the_tip_is_repelled_first_is_doubted():
    for both in (True, False):  # attracted first, or not at all
        data = measured_curve.dataset(both=both)
        assert not any("its sign may be wrong" in line for line in doubts(df.calibrate(data).attrs))
        flipped = df.calibrate(data.assign(phase=180.0 - data["phase"]))
        assert any("its sign may be wrong" in line for line in doubts(flipped.attrs)) == both


def test_the_tail_of_a_force_is_no_drift():
    """A curve that starts within reach of the attraction: a straight line there would take 7 degrees from the phase."""
    path = resources.files("dforce") / "library" / "measured" / "air.csv"
    data = df.read_measured(str(path), phase_convention="lag")
    found = df.calibrate(data)
    moved = found.phase - data.phase + found.attrs["phase_offset"]
    np.testing.assert_allclose(moved, 0.0, atol=1e-9)  # one offset, and nothing else
    # its first line says that the offset is 0
    assert abs(found.attrs["phase_offset"]) < 3.0 * found.attrs["phase_offset_error"]
    assert any("cannot be distinguished from long-range forces" in line for line in found.attrs["history"])


@pytest.mark.parametrize(("name", "truth"), [("stiff", 1.2), ("air", 0.0), ("liquid", -0.8)])
def test_the_error_of_the_offset_holds_the_truth_of_the_shipped_curves(name, truth):
    path = resources.files("dforce") / "library" / "measured" / f"{name}.csv"
    attrs = df.calibrate(df.read_measured(str(path), phase_convention="lag")).attrs
    assert abs(attrs["phase_offset"] - truth) < 2.0 * attrs["phase_offset_error"]


def test_a_curve_without_a_free_part_asks_for_what_is_missing():
    data = measured_curve.dataset(noise=0.0).isel(point=slice(60, None))
    with pytest.raises(df.ParameterError, match=r"no free part.*pass free_amplitude, free_phase, errors of amplitude"):
        df.calibrate(data)
    found = df.calibrate(
        data, free_amplitude="20 nm", free_phase=90.0, errors={"amplitude": "30 pm", "phase": "0.2 deg"}
    )
    assert found.attrs["free_amplitude"] == 20e-9 and found.attrs["amplitude_error"] == 30e-12
    assert found.attrs["phase_error"] == pytest.approx(0.2) and not found.free.any()
    np.testing.assert_allclose(found.phase, data.phase)


def test_a_free_part_may_be_given():
    data = df.calibrate(measured_curve.dataset(), free_part=("30 nm", "40 nm"))
    assert float(data.height.where(data.free).min()) >= 30e-9
    with pytest.raises(df.ParameterError, match="fewer than 3 points lie from 50 nm to 60 nm"):
        df.calibrate(measured_curve.dataset(), free_part=("50 nm", "60 nm"))


@pytest.mark.parametrize("how", [{"speed": "100 nm/s"}, {}])
def test_the_delay_of_the_lock_in_is_taken_from_the_heights(how):
    """Way in and way out of a curve read late are apart by twice the delay times the speed; corrected they agree."""
    speed, delay = 100e-9, 0.01
    height, amplitude, lag = measured_curve.numbers(noise=0.02)
    data = measured_curve.dataset()
    both = np.concatenate([height - speed * delay, (height + speed * delay)[::-1]])
    step = float(height[0] - height[1]) / speed
    time = np.arange(2 * len(height)) * step
    data = data.isel(point=[0] * len(both)).assign(
        height=("point", both), amplitude=("point", np.concatenate([amplitude, amplitude[::-1]])),
        phase=("point", np.concatenate([lag, lag[::-1]])), time=("point", time),
    )  # fmt: skip
    data["direction"] = ("point", np.repeat(["approach", "retract"], len(height)))
    found = df.calibrate(data, delay="10 ms", **how)
    way_in, way_out = (found.where(found.direction == word, drop=True) for word in ("approach", "retract"))
    np.testing.assert_allclose(way_in.height, height, atol=1e-15)
    np.testing.assert_allclose(way_out.height, height[::-1], atol=1e-15)


def test_correlated_neighbors_are_counted():
    data = measured_curve.dataset(points=600, noise=0.0)
    draw = np.random.default_rng(2)
    for name, size in (("amplitude", measured_curve.NOISE), ("phase", measured_curve.TURN)):
        noise = np.zeros(600)
        for place in range(1, 600):
            noise[place] = 0.7 * noise[place - 1] + np.sqrt(1.0 - 0.49) * draw.normal()
        data[name] = data[name] + size * noise
    attrs = df.calibrate(data).attrs
    assert 0.5 < attrs["neighbor_correlation"] < 0.85
    assert attrs["amplitude_error"] == pytest.approx(measured_curve.NOISE, rel=0.35)


def test_a_second_tone_is_calibrated_too():
    data = measured_curve.dataset()
    draw = np.random.default_rng(5)
    data["amplitude_2"] = ("point", 1e-9 + 5e-12 * draw.normal(size=120))
    data["phase_2"] = ("point", 70.0 + 0.3 * draw.normal(size=120))
    attrs = df.calibrate(data).attrs
    assert attrs["free_amplitude_2"] == pytest.approx(1e-9, rel=0.01)
    assert attrs["phase_2_offset"] == pytest.approx(-20.0, abs=0.3)
    assert attrs["phase_2_error"] == pytest.approx(0.3, rel=0.4)
    assert any("two tones may exchange energy" in line for line in attrs["history"])


def test_a_free_amplitude_that_looks_like_rms_is_doubted():
    case = df.Case(cantilever={"f0": 70e3, "k": 2.0, "Q": 100}, drive={"A0": np.sqrt(2.0) * 20e-9})
    said = df.calibrate(measured_curve.dataset(), case).attrs["history"]
    assert any("the file may contain rms" in line for line in said)


def test_a_slope_above_one_is_doubted():
    data = measured_curve.dataset()
    data["amplitude"] = 1.1 * data["amplitude"]
    said = df.calibrate(data).attrs["history"]
    assert any(line.startswith("doubt: slope") and "sensitivity" in line for line in said)


def test_permutations_do_not_matter_and_heights_may_be_shifted():
    data = df.calibrate(measured_curve.dataset())
    moved = measured_curve.dataset()
    moved["height"] = moved["height"] + 1e-6
    again = df.calibrate(moved)
    np.testing.assert_allclose(again.phase, data.phase)
    assert again.attrs["height_offset"] == pytest.approx(data.attrs["height_offset"] - 1e-6, abs=1e-15)


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ({"phase_convention": "lag"}, "was set when the curve was read"),
        ({"thermal": {"q": 100}}, "'q' is not one of f0, k, Q"),
        ({"thermal": {"k": "2 kHz"}}, "thermal: k is '2 kHz'"),
        ({"thermal": {"k": (2.0, -1.0)}}, "thermal: k has an error that is not above 0"),
        ({"errors": {"deflection": 1e-12}}, "'deflection' is not one of amplitude, phase"),
        ({"errors": {"amplitude": 0}}, "errors: amplitude = 0 is not above 0"),
        ({"baseline": "spline"}, "not one of line, none"),
        ({"free_part": ("30 nm",)}, "is not the lowest and the highest height"),
        ({"free_amplitude": "20 kHz"}, "free_amplitude is '20 kHz'"),
        ({"speed": "1 um/s"}, "speed is used only with delay"),
        ({"delay": "1 ms"}, "because the curve has no time"),
    ],
)
def test_what_cannot_be_calibrated_is_one_sentence(how, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.calibrate(measured_curve.dataset(), **how)


def test_a_curve_is_calibrated_once_and_its_sign_must_be_known():
    with pytest.raises(df.ParameterError, match="is already calibrated"):
        df.calibrate(df.calibrate(measured_curve.dataset()))
    with pytest.raises(df.ParameterError, match="the sign of the phases is unknown"):
        df.calibrate(measured_curve.dataset().assign_attrs(phase_convention="unknown"))
    with pytest.raises(df.ParameterError, match=r"has no k and no Q: first calibrate the curve with df\.calibrate"):
        df.energy(df.calibrate(measured_curve.dataset()))


@pytest.mark.parametrize(
    ("given", "value", "error"),
    [
        ("2.7(2) N/m", 2.7, 0.2), ("2.70(15) N/m", 2.7, 0.15), ("180(4) N/m", 180.0, 4.0), ("180(4.5) N/m", 180.0, 4.5),
        ("2.7(2) kN/m", 2700.0, 200.0), ("1.5(2)e3 N/m", 1500.0, 200.0), ((2.7, 0.2), 2.7, 0.2),
        (("2.7 N/m", "200 mN/m"), 2.7, 0.2), (2.7, 2.7, None),
    ],
)  # fmt: skip
def test_a_value_with_its_error_is_read_as_people_write_it(given, value, error):
    found = measured(given, "N/m", "k")
    assert found.value == pytest.approx(value)
    assert found.error == (None if error is None else pytest.approx(error))


def test_errors_are_shown_to_two_digits():
    assert show(29.98612e-9, 0.0138e-9, "m") == "29.986 ± 0.014 nm"
    assert show(180.0, 4.0, "1") == "180.0 ± 4.0"
    assert show(69.9999999999e3, 2e-11, "Hz") == "70.000000 ± 2e-14 kHz"  # no digit that nobody reads
    assert show(0.0, 2e-9, "m") == "0.0 ± 2.0 nm"


def test_the_slope_of_a_stretch_has_the_error_that_its_noise_makes():
    draw = np.random.default_rng(7)
    height = np.linspace(0.0, 1.0, 200)
    pulls = [stretch(height, 0.3 * height + draw.normal(size=200)) for _ in range(200)]
    spread = np.std([(one.slope - 0.3) / one.slope_error for one in pulls])
    assert 0.85 < spread < 1.2


def test_radians_that_were_read_as_degrees_and_heights_of_a_wrong_unit_are_doubted():
    """Phases near 90 degrees pass the check sin(phase) >= A/A0, as if all energy were lost."""
    data = measured_curve.dataset()
    assert not doubts(df.calibrate(data).attrs)
    radians = data.assign(phase=np.radians(data["phase"]))
    assert ["radians" in text for text in doubts(df.calibrate(radians).attrs)] == [True]
    micrometers = data.assign(height=1e3 * data["height"])
    assert ["no sample is so soft" in text for text in doubts(df.calibrate(micrometers).attrs)] == [True]


CURVE = measured_curve.dataset()


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (CURVE.drop_vars("direction"), r"has no coordinate 'direction': data.assign_coords"),
        (
            CURVE.assign_coords(direction=("point", ["down"] * 120)),
            "the direction 'down' of data is neither approach nor",
        ),
        (CURVE.isel(point=slice(None, None, -1)), "heights of the approach do not fall from point to point"),
        (CURVE.isel(point=np.random.default_rng(1).permutation(120)), "heights of the approach do not fall"),
        (CURVE.assign(height=1e9 * CURVE["height"]), "the height of data reaches 35 m; lengths are in m"),
        (CURVE.assign(amplitude=-CURVE["amplitude"]), "the amplitude of data is below zero at point 1"),
        (CURVE.assign(phase=CURVE["phase"].astype(str)), "the phase of data is not a row of real numbers"),
        (CURVE.assign(phase=1j * CURVE["phase"]), "the phase of data is not a row of real numbers"),
        (
            CURVE.assign(phase=CURVE["phase"].where(CURVE["phase"] < 100.0)),
            "the phase of data is not a finite number at point",
        ),
        (CURVE.assign(phase_2=np.nan * CURVE["phase"]), "the phase_2 of data is not a finite number at point 1"),
        (CURVE.isel(point=slice(5)), "has 5 points, but a curve needs 8"),
    ],
)
def test_a_dataset_made_by_hand_is_a_curve_or_a_sentence(data, sentence):
    with pytest.raises(df.DForceError, match=sentence):
        df.calibrate(data)


@pytest.mark.parametrize(("points", "place"), [(25, 3), (120, 4)])
def test_a_spike_in_the_free_part_is_doubted_and_moves_nothing(points, place):
    data = measured_curve.dataset(points=points)
    height = float(data["height"][place])
    plain = df.calibrate(data).attrs
    data["amplitude"][place] += 5e-9
    found = df.calibrate(data).attrs
    assert abs(found["free_amplitude"] - measured_curve.A0) < 3.0 * plain["free_amplitude_error"]
    assert found["amplitude_error"] < 1.5 * measured_curve.NOISE
    assert any(f"a spike at {1e9 * height:.5g} nm" in line for line in doubts(found))


@pytest.mark.parametrize("name", ["amplitude", "phase"])
@pytest.mark.parametrize("place", [60, 85, 110])  # attracted, and repelled
def test_a_spike_beyond_the_free_part_is_doubted(name, place):
    data = measured_curve.dataset()
    assert not any("spike" in line for line in doubts(df.calibrate(data).attrs))
    data[name][place] += {"amplitude": 3e-9, "phase": 15.0}[name]
    at = f"{1e9 * float(data['height'][place]):.5g} nm"
    found = df.calibrate(data)
    # and nothing else is wrong
    assert doubts(found.attrs) == [f"the {name} of the approach has a spike at {at}; a fit leaves out this point"]
    assert np.flatnonzero(found["spike"]).tolist() == [place]


def test_a_jump_or_a_slope_between_missing_points_is_no_spike():
    for seed in range(SETS):
        data = measured_curve.dataset(points=150, seed=seed)
        kept = np.random.default_rng(seed).random(150) > 0.35
        assert not any("spike" in line for line in doubts(df.calibrate(data.isel(point=kept)).attrs)), seed


def coarse(name, seed, shift):
    """Return a curve with a channel in steps of 8 times its noise, whose places are shifted by a share of a step."""
    data = measured_curve.dataset(seed=seed)
    step = 8.0 * {"amplitude": measured_curve.NOISE, "phase": measured_curve.TURN}[name]
    return data.assign({name: (np.round(data[name] / step + shift) - shift) * step}), step


@pytest.mark.parametrize("shift", [0.1, 0.2])
@pytest.mark.parametrize(("name", "offset"), [("amplitude", "free_amplitude"), ("phase", "phase_offset")])
def test_a_free_part_in_few_steps_of_the_digitization_is_found_with_the_error_of_its_rounding(name, offset, shift):
    """A few points one step off the others are neither far off nor spikes, and no mean is better than the rounding."""
    true = {"amplitude": measured_curve.A0, "phase": 0.0}[name]
    for seed in range(SETS):
        data, step = coarse(name, seed, shift)
        found = df.calibrate(data).attrs
        assert found[f"{name}_error"] >= 0.99 * step / 12**0.5
        assert abs(found[offset] - true) < 3.0 * found[f"{offset}_error"]


def test_a_free_part_of_equal_points_needs_the_error_of_a_point_alone():
    refused = 0
    for seed in range(SETS):
        data, step = coarse("amplitude", seed, 0.5)
        try:
            df.calibrate(data)
        except df.ParameterError as error:
            assert "the amplitude is equal at every point of the free part" in str(error)
            assert "free_amplitude" in df.calibrate(data, errors={"amplitude": step / 12**0.5}).attrs
            refused += 1
    assert refused > 0.1 * SETS


def test_few_points_without_a_drift_are_left_as_they_are():
    sets = []
    for seed in range(SETS):
        with suppress(df.ParameterError):  # the slopes of noise, too, may look like forces
            sets.append(df.calibrate(measured_curve.dataset(points=25, seed=seed)).attrs["history"])
    assert len(sets) > 0.9 * SETS
    # by chance: beyond 3 errors, found in some 10 points, of either quantity
    assert sum("is subtracted" in line for history in sets for line in history) <= 2
    assert not any("a spike" in line for history in sets for line in history)


@pytest.mark.parametrize("seed", range(3))
def test_the_first_points_of_a_force_are_no_noise(seed):
    """One attracted point between free and repulsive ones, as on a stiff sample, made the noise 10 times larger."""
    data = measured_curve.dataset(points=25, seed=seed)
    data["phase"][8] += 6.0
    data["amplitude"][10:] -= 1e-9
    with pytest.raises(df.ParameterError, match="no 10 points at its far end are all alike"):
        df.calibrate(data)


def test_the_excitation_keeps_the_unit_of_its_file():
    data = measured_curve.dataset()
    data["excitation"] = ("point", np.full(data.sizes["point"], 0.25), {"units": "V"})
    assert df.calibrate(data).excitation.attrs["units"] == "V"
