"""The parts of a force: each interaction by itself, along a force curve and along a motion."""

from __future__ import annotations

import numpy as np
import pytest

import dforce as df

CASE = df.example("hysteresis")


def test_parts_of_a_force_curve_are_those_of_the_models_that_hold_one_interaction_each():
    curve = df.force_curve(CASE)
    parts = df.force_parts(curve)["force_part"]
    dmt = next(force for force in CASE.forces if force.name == "dmt")
    others = [force for force in CASE.forces if force.name != "dmt"]
    apart = [df.forces.VanDerWaals(hamaker=dmt.hamaker), df.forces.Hertz(), *others]
    model = df.force_curve(CASE.replace(forces=apart), curve["distance"].values)["partial_force"]
    np.testing.assert_allclose(parts.sel(interaction="van der Waals"), model.sel(model="van_der_waals"), rtol=1e-12)
    np.testing.assert_allclose(parts.sel(interaction="elastic contact"), model.sel(model="hertz"), rtol=1e-12)
    np.testing.assert_allclose(parts.sum("interaction"), curve["force"], rtol=1e-9, atol=1e-20)


def test_parts_of_a_motion_add_up_to_its_force_and_the_viscous_part_takes_the_energy():
    viscous = df.forces.KelvinVoigt(viscosity="30 Pa s")
    case = CASE.replace(forces=[*CASE.forces, viscous])
    dwell = df.dwell(case, zc="15 nm")
    parts = df.force_parts(dwell)["force_part"]
    np.testing.assert_allclose(parts.sum("interaction"), dwell["force"], rtol=1e-6, atol=1e-15)
    power = -parts.sel(interaction="contact viscosity") * dwell["velocity"]
    a_period = float(power.mean()) / case.problem.tones[0].frequency
    assert a_period == pytest.approx(float(dwell["total_dissipated_energy"]), rel=5e-3)  # a mean over samples at a kink


def test_a_motion_at_a_point_holds_the_parts_of_its_force():
    curve = df.approach(CASE, zc={"start": "23 nm", "stop": "17 nm", "points": 13})
    motion = df.motion_at(curve.sel(zc=17e-9, method="nearest").isel(direction=0, drop=False))
    np.testing.assert_allclose(motion["force_part"].sum("interaction"), motion["force"], rtol=1e-6, atol=1e-15)
    assert motion["interaction"].values.tolist() == ["van der Waals", "elastic contact"]


def test_a_force_with_memory_is_what_the_others_leave():
    case = CASE.replace(forces=[df.forces.VanDerWaals(hamaker="2e-20 J"), df.forces.SLS(**df.forces.SLS.example)])
    curve = df.force_curve(case, np.linspace(2e-9, -0.2e-9, 45))
    parts = df.force_parts(curve)["force_part"]
    np.testing.assert_allclose(
        parts.sel(interaction="elastic contact"), curve["partial_force"].sel(model="sls"), atol=1e-18
    )


def test_a_result_without_a_force_over_a_distance_has_no_parts():
    with pytest.raises(df.ParameterError, match="no force over a distance"):
        df.force_parts(df.approach(CASE, zc=["30 nm", "29 nm"]))
