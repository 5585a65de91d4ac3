"""Advice speaks where a model or a result stops meaning what it says, and is silent elsewhere."""

from __future__ import annotations

import pytest

import dforce as df

CALM = df.example("figure-3-air")


def test_a_calm_case_gives_no_advice():
    assert df.advice(CALM) == []


def test_hamaker_constant_and_surface_energy_that_disagree():
    case = CALM.replace("forces.dmt.surface_energy", "50 mJ/m^2")
    (piece,) = df.advice(case)
    assert piece.name == "hamaker_and_surface_energy"
    assert piece.found == 0.05
    # gamma(H) is proportional to H, and 0.8e-20 J gives 0.00389727439466 J/m^2
    assert piece.limit == pytest.approx(0.00389727439466 * 2e-20 / 0.8e-20, rel=1e-11)
    assert "jumps at contact" in piece.text
    assert piece.about == ("forces.dmt.surface_energy", "forces.dmt.hamaker")
    assert piece.unit == "J/m^2"


def test_hamaker_constant_and_surface_energy_that_agree_to_a_printed_digit():
    implied = 0.00389727439466 * 2e-20 / 0.8e-20
    assert df.advice(CALM.replace("forces.dmt.surface_energy", round(implied, 5))) == []


def test_points_that_had_not_settled():
    case = df.example("table-1-am").set("solver.method=transient", "solver.max_periods=40", "experiment.start=rest")
    result = df.run(case)
    assert result.status == df.Status.NOT_SETTLED
    assert [piece.name for piece in df.advice(case, result)] == ["not_settled"]
    assert "raise solver.max_periods" in result.attrs["advice"]
    assert df.run(df.example("table-1-am")).attrs["advice"] == ""
