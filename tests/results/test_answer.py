"""A result in words: what stands above its picture."""

from __future__ import annotations

import fitted_curves
import numpy as np
import pytest

import dforce as df
from dforce.findings.answer import answer_with
from dforce.findings.set_point import states_at


def test_a_fit_names_its_parameters_with_errors_and_units_and_for_which_lever_and_tip():
    fit = fitted_curves.result().assign_attrs(lost_points=0, holds_for="cantilever.k = 2.7 N/m, tip.radius = 8 nm")
    assert df.answer(fit) == "Young's modulus of the sample = 1.00 ± 0.10 GPa, for k = 2.7 N/m, R = 8 nm."
    assert df.answer(fit.drop_vars("label")).startswith("E_s = 1.00 ± 0.10 GPa")  # of an older version


@pytest.mark.parametrize(
    ("held", "words"),
    [("cantilever.k = 2.7 N/m, cantilever.Q = 180, tip.radius = 8 nm", "for k = 2.7 N/m, Q = 180, R = 8 nm."),
     ("cantilever.modes.1.Q = 180, cantilever.modes.2.k = 9 N/m", "for Q of mode 1 = 180, k of mode 2 = 9 N/m.")],
)  # fmt: skip
def test_each_value_that_a_fit_holds_for_has_its_own_symbol(held, words):
    assert df.answer(fitted_curves.result().assign_attrs(lost_points=0, holds_for=held)).endswith(words)


def test_each_parameter_of_a_fit_has_its_words():
    case = fitted_curves.case_of("air")
    fit = df.fit(case, fitted_curves.data_of("air"), free=[fitted_curves.E, fitted_curves.ETA], search=False)
    said = df.answer(fit)
    assert (
        said.startswith("Young's modulus of the sample is not")
        and "viscosity coefficient of the contact is not" in said
    )


def test_an_error_that_is_not_known_is_said():
    fit = fitted_curves.result().assign_attrs(lost_points=0)
    for error, words in ((np.nan, "= 1 GPa, error unknown"), (np.inf, "is 1 GPa, constrained only as a product")):
        fit["error"][:] = error
        assert df.answer(fit) == f"Young's modulus of the sample {words}."


def test_a_parameter_that_the_data_do_not_constrain_has_no_value():
    fit = fitted_curves.result().assign_attrs(lost_points=0)
    fit["seen"] = ("parameter", np.zeros(fit.sizes["parameter"], dtype=bool))
    assert df.answer(fit) == "Young's modulus of the sample is not constrained by these data."


def test_a_parameter_with_an_error_above_its_value_has_no_value_but_an_offset_has():
    fit = fitted_curves.result().assign_attrs(lost_points=0)
    fit["error"][:] = [3e12, 3e-10]
    assert df.answer(fit) == "Young's modulus of the sample is not constrained by these data."
    text = df.fit_report(fit)
    assert "+- 0.30 nm" in text and "GPa   not constrained by these data" in text and "TPa" not in text


def test_a_curve_gives_its_state_at_the_set_point_with_force_and_depth():
    curve = df.run(df.example("figure-3-water"))
    states = df.at_set_point(curve, 0.8, ["peak_force", "max_indentation"])
    force, depth = (
        float(np.unique(np.round(states[name].values, 15))[0]) for name in ("peak_force", "max_indentation")
    )
    assert df.answer(curve, "80 %") == (f"Repulsive at 80 %: {df.show(force, 'N', 3)}, {df.show(depth, 'm', 3)} deep.")


def test_a_state_that_the_curve_does_not_meet_is_named_where_all_states_are_known():
    curve, branches = (df.run(df.example(name)) for name in ("figure-3-air", "figure-3-branches"))
    assert df.answer(curve) == "Attractive at 80 %: no contact."
    at = df.at_set_point(branches, 0.8)
    (one,) = np.flatnonzero(at["stable"].values & (at["regime"].values == "repulsive"))
    force, depth = (
        df.show(float(at[name][one]), unit, 3) for name, unit in (("peak_force", "N"), ("max_indentation", "m"))
    )
    said = answer_with(curve, 0.8, all_states=states_at(branches, 0.8))
    assert said == f"Attractive at 80 %: no contact. Another state exists: repulsive, {force}, {depth} deep."


@pytest.fixture(scope="module")
def am_fm_curve():
    return df.run(df.example("am-fm").set("experiment.zc.points=9"))


def test_am_fm_gives_the_effective_modulus_that_material_finds_at_the_set_point(am_fm_curve):
    found, point = df.material(am_fm_curve), 6
    said = df.answer(am_fm_curve, float(am_fm_curve["amplitude_ratio"][point]))
    modulus, true = (df.show(float(one), "Pa", 3) for one in (found["E_eff"][point], found["true_E_eff"]))
    end = f"The frequency shift of mode 2 gives an effective modulus of {modulus}; the true one is {true}."
    assert said.startswith("Repulsive at ") and said.endswith(f" deep. {end}")


def test_effective_modulus_in_the_answer_is_what_the_virial_and_the_shift_give_by_hand(am_fm_curve):
    deep = am_fm_curve.isel(zc=6)
    A, f2, shift = (
        float(deep[name].values[n])
        for name, n in (("mode_amplitude", 0), ("drive_frequency", 1), ("frequency_shift", 1))
    )
    stiffness = 28.0 * ((f2 / (f2 - shift)) ** 2 - 1.0)
    free = float(am_fm_curve["mode_amplitude"].values[0, 0])
    depth = 0.9 / 100.0 * free * np.cos(np.radians(float(deep["mode_phase"].values[0]))) / stiffness
    by_hand = np.sqrt(2.0 * A / 5e-9) * stiffness / depth
    said = df.answer(am_fm_curve, float(deep["amplitude_ratio"]))
    assert f"gives an effective modulus of {df.show(by_hand, 'Pa', 3)};" in said


@pytest.mark.parametrize("set_point", [0.9999, 1.0])
def test_am_fm_gives_no_modulus_where_the_indentation_is_below_the_amplitude_of_tone_2(am_fm_curve, set_point):
    said = df.answer(am_fm_curve, set_point)
    assert said.startswith("Repulsive at ") and "modulus" not in said


def test_am_fm_gives_no_modulus_for_a_tip_without_a_radius():
    case = df.example("am-fm").replace(tip=df.Tip(half_angle="20 deg"), forces=[df.forces.Sneddon()])
    said = df.answer(df.run(case.set("experiment.zc.points=5")), "90 %")
    assert said.startswith("Repulsive at 90 %") and "modulus" not in said


@pytest.mark.parametrize(
    ("start", "stop", "side"), [("48.4 kHz", "48.8 kHz", "above"), ("49 kHz", "49.4 kHz", "below")]
)
def test_a_resonance_outside_of_a_sweep_has_no_frequency(start, stop, side):
    sweep = df.frequency_sweep(
        df.example("figure-3-air"), {"start": start, "stop": stop, "points": 5}, "20 nm", direction="up"
    )
    end = stop if side == "above" else start
    found = next(line for line in df.summary(sweep) if line.name == "resonance")
    assert found.value is None and found.text.startswith(f"{side} {end} (") and found.text.endswith(" nm there)")
    assert df.answer(sweep).startswith(f"Resonance: {side} {end} (")


def test_numbers_of_advice_have_no_exponent_below_a_million():
    soft = df.example("figure-3-air").replace("sample.youngs_modulus", "1 kPa")
    assert any(piece.text.startswith("The Tabor parameter is 5200,") for piece in df.advice(soft))


def test_an_answer_keeps_the_letter_of_a_symbol():
    over = {"contact.a0": ["0.15 nm", "0.165 nm"], "cantilever.k": ["1 N/m", "2 N/m"]}
    sweep = df.sweep(df.example("table-1-am"), over=over)
    assert df.answer(sweep).startswith("a0: 0.15 nm, 0.165 nm. k: 1 N/m, 2 N/m. Cases: 4.")


def test_an_answer_names_the_direction_of_each_line_where_there_are_two():
    sticky = df.example("table-1-am").replace("forces", [{"model": "jkr", "surface_energy": "20 mJ/m^2"}])
    said = df.answer(df.force_curve(sticky))
    assert said.count("Lowest force (approach): ") == said.count("Lowest force (retract): ") == 1


def test_the_parameter_of_branches_has_a_short_name():
    case = df.example("table-1-am")
    states = df.branches(case, "4 nm", parameter="drive.A0", start="4.5 nm", stop="5 nm", search=1)
    assert df.answer(states).startswith("Free amplitude: 4.5 nm to 5 nm. Average distance: 4 nm.")
