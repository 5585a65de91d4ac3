"""After a fit: which free amplitudes press the sample by less than a limit."""

from __future__ import annotations

import fitted_curves as fc
import numpy as np
import pytest

import dforce as df
from dforce.inverse import safety
from dforce.inverse._states import Solver


@pytest.fixture(scope="module")
def stiff():
    return df.safe_settings(fc.case_of("stiff"), "3 nN", "80 %")


def test_the_hardest_state_is_that_of_an_independent_code(stiff):
    # repulsive state at A0 = 30 nm and A/A0 = 0.8 of the reference: 5.011739 nN, 0.972551 nm
    last = stiff.isel(A0=-1)
    assert float(last["A0"]) == pytest.approx(30e-9)
    assert float(last["peak_force"]) == pytest.approx(5.011739e-9, rel=1e-3)
    assert float(last["max_indentation"]) == pytest.approx(0.972551e-9, rel=1e-3)
    assert int(last["states"]) == 2 and not bool(last["allowed"])
    assert stiff.attrs["findings"][0] == (
        "At 80 % of A0 = 30 nm the tip presses with 5.01 nN and indents 0.973 nm. A second state exists."
    )


def test_an_amplitude_that_is_allowed_presses_less_than_the_limit(stiff):
    amplitude = float(stiff["A0"][stiff["allowed"]].max())
    A0 = df.show(amplitude, "m", 3)
    assert f"up to a free amplitude of {A0}." in " ".join(stiff.attrs["findings"])
    case = fc.case_of("stiff").replace("drive.A0", amplitude)
    curve = df.approach(case, zc={"of": "drive.A0", "start": 1.15, "stop": 0.5, "points": 81}, direction="both")
    assert float(df.at_set_point(curve, 0.8)["peak_force"].max()) < 3e-9


def test_an_amplitude_is_not_allowed_where_a_branch_has_no_stable_state(monkeypatch):
    solve = Solver.solve

    def without_repulsive(solver, points):
        found = solve(solver, points)
        found.found &= points.zc > 0.79 * 30e-9  # the repulsive state lies at 23.22 nm
        return found

    monkeypatch.setattr(Solver, "solve", without_repulsive)
    monkeypatch.setattr(safety, "AMPLITUDES", 2)
    monkeypatch.setattr(safety, "SMALLEST", 0.999)
    found = df.safe_settings(fc.case_of("stiff"), "3 nN", "80 %")
    assert found["unsteady"].values.all() and not found["allowed"].values.any()
    assert (found["peak_force"] < 3e-9).all()  # of the attractive state
    assert "2 of 2 free amplitudes (30 nm to 30 nm) a motion exists that alternates" in " ".join(
        found.attrs["findings"]
    )


@pytest.mark.long
def test_a_soft_sample_is_reached_below_the_range_of_a_stiff_one():
    # reference (soft liquid, set point 0.8): 100 pN at A0 = 1.488972 nm, indentation 0.859803 nm
    case = df.Case(
        cantilever={"f0": 20e3, "k": 0.1, "Q": 3.0}, tip={"radius": 5e-9}, drive={"A0": 1.488972e-9},
        sample={"youngs_modulus": 50e6, "poisson_ratio": 0.3},
        forces=[df.forces.DMT(hamaker=1e-21), df.forces.KelvinVoigt(viscosity=5.0)],
    )  # fmt: skip
    last = df.safe_settings(case, "100.1 pN", 0.8).isel(A0=-1)
    assert float(last["peak_force"]) == pytest.approx(100e-12, rel=1e-3)
    assert float(last["max_indentation"]) == pytest.approx(0.859803e-9, rel=1e-3)


@pytest.mark.long
def test_a_fit_gives_its_best_case(stiff):
    fit = fc.result().assign_attrs(case=fc.case_of("stiff").to_toml(complete=True))
    np.testing.assert_array_equal(df.safe_settings(fit, "3 nN", "80 %")["peak_force"], stiff["peak_force"])


def test_doubts_about_a_fit_come_before_the_forces_of_its_best_case(monkeypatch):
    monkeypatch.setattr(safety, "AMPLITUDES", 2)
    fit = fc.result().assign_attrs(case=fc.case_of("air").to_toml(complete=True))
    fit["seen"][0] = False
    findings = df.safe_settings(fit.assign_attrs(lost_points=0, chi2=80.0), "3 nN").attrs["findings"]
    assert findings[0].startswith("The model does not describe the data within their noise")
    assert findings[1].startswith(
        "The data do not constrain sample.youngs_modulus: the forces hold for the value in the case"
    )
    with pytest.raises(df.ParameterError, match="does not describe the data, so its case shows no safe settings"):
        df.safe_settings(fit.assign_attrs(chi2=800.0), "3 nN")


@pytest.mark.parametrize("limit", ["-1 nN", "1 nm", 0.0])
def test_a_limit_is_a_force_above_zero(limit):
    with pytest.raises(df.DForceError, match="limit"):
        df.safe_settings(fc.case_of("air"), limit)
