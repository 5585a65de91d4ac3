"""A result in words: what stands above its picture."""

from __future__ import annotations

import fitted_curves
import numpy as np

import dforce as df
from dforce.findings.answer import answer_with


def test_a_fit_names_its_parameters_with_errors_and_units_and_for_which_lever_and_tip():
    fit = fitted_curves.result().assign_attrs(holds_for="cantilever.k = 2.7 N/m, tip.radius = 8 nm")
    assert df.answer(fit) == "Young's modulus of the sample = 1.00 ± 0.10 GPa, for k = 2.7 N/m, R = 8 nm."
    assert df.answer(fit.drop_vars("label")).startswith("E_s = 1.00 ± 0.10 GPa")  # of an older version


def test_each_parameter_of_a_fit_has_its_words():
    case = fitted_curves.case_of("air")
    fit = df.fit(case, fitted_curves.data_of("air"), free=[fitted_curves.E, fitted_curves.ETA], search=False)
    said = df.answer(fit)
    assert said.startswith("Young's modulus of the sample = ") and "viscosity coefficient of the contact = " in said


def test_an_error_that_is_not_known_is_said():
    fit = fitted_curves.result()
    fit["error"][:] = np.inf
    assert df.answer(fit) == "Young's modulus of the sample = 1 GPa, error unknown."


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
    said = answer_with(curve, 0.8, branches=branches)
    assert said == f"Attractive at 80 %: no contact. Another state exists: repulsive, {force}, {depth} deep."
