"""Modulus and viscosity from two tones: a sinusoid by hand, all shapes, and the exact torus."""

import numpy as np
import pytest

import dforce as df
from dforce.case import case_of
from dforce.findings.material import Observed, PowerContact, _observed, estimate, neglected

A, K, F0 = 4e-9, np.array([0.9, 28.0]), np.array([48.9e3, 282e3])
PHASE = np.pi * (np.arange(200_000) + 0.5) / 200_000


def prescribed(contact, E_eff, depth, tau=0.0):
    """Return what both tones see of a contact along a sinusoid; A2 is next to nothing, both tones are locked at 90 degrees."""
    into = np.maximum(depth - A * (1.0 - np.cos(PHASE)), 0.0)
    slope = (
        E_eff * contact.shape * contact.power * np.where(into > 0.0, into, 1.0) ** (contact.power - 1.0) * (into > 0.0)
    )
    virial = np.mean(E_eff * contact.shape * into**contact.power * A * np.cos(PHASE))
    f1 = F0[0] * np.sqrt(1.0 + 2.0 * virial / (K[0] * A**2))
    omega = 2.0 * np.pi * f1
    energy = 2.0 * np.pi * omega * tau * np.mean(slope * A**2 * np.sin(PHASE) ** 2)  # F = tau dF_elastic/dt
    drive = K[0] * A * f1 / F0[0] / 100.0 + energy / (np.pi * A)
    f2 = F0[1] * np.sqrt(1.0 + np.mean(slope) / K[1])
    return Observed(
        K,
        np.array([100.0, 200.0]),
        F0,
        np.array([[f1], [f2]]),
        np.array([[A], [1e-14]]),
        np.array([drive]),
        np.array([np.pi / 2.0]),
    )


@pytest.mark.parametrize(
    ("share", "ratio"), [(0.0025, 1.0006), (0.0125, 1.0031), (0.046, 1.0116), (0.125, 1.0324), (0.25, 1.0671)]
)
def test_formula_of_a_paraboloid_errs_along_a_sinusoid_as_computed_by_hand(share, ratio):
    contact = PowerContact.paraboloid(20e-9)
    found = estimate(prescribed(contact, 1e7, share * A), contact)
    assert found.E_eff[0] / 1e7 == pytest.approx(ratio, abs=2e-4)


@pytest.mark.parametrize("contact", [PowerContact.punch(5e-9), PowerContact.paraboloid(20e-9), PowerContact.cone(0.6)])
def test_each_shape_has_its_modulus_indentation_force_and_viscosity_back(contact):
    tau = 1e-8
    found = estimate(prescribed(contact, 1e7, 1e-3 * A, tau), contact)
    assert found.E_eff[0] == pytest.approx(1e7, rel=2e-3)
    assert found.indentation[0] == pytest.approx(1e-3 * A, rel=2e-3)
    assert found.peak_force[0] == pytest.approx(1e7 * contact.shape * (1e-3 * A) ** contact.power, rel=3e-3)
    assert found.viscosity[0] == pytest.approx(2.0 * tau * 1e7, rel=3e-3)


def test_attraction_has_no_modulus():
    seen = prescribed(PowerContact.punch(5e-9), 1e7, 0.1e-9)
    pulled = seen._replace(frequency=0.999 * F0[:, None])
    assert np.isnan(estimate(pulled, PowerContact.punch(5e-9)).E_eff).all()


def test_answer_of_mode_2_to_harmonics_counts_most_where_one_falls_on_its_resonance():
    contact = PowerContact.paraboloid(20e-9)
    seen = prescribed(contact, 1e9, 0.2e-9)
    tuned = seen._replace(f0=np.array([F0[0], 6.0 * seen.frequency[0, 0]]))
    off = seen._replace(f0=np.array([F0[0], 6.5 * seen.frequency[0, 0]]))
    found = estimate(seen, contact)
    shares = [neglected(one, contact, found)["harmonics"][0] for one in (tuned, off)]
    assert shares[0] > 10.0 * shares[1]


@pytest.fixture(scope="module")
def am_fm_curve():
    """Return the case of B1 along a curve."""
    case = df.Case(
        cantilever={"modes": [{"f0": 48.9e3, "k": 0.9, "Q": 100.0}, {"f0": 282e3, "k": 28.0, "Q": 200.0}]},
        drive={"tones": [{"A0": 7.351847e-9}, {"A0": "0.1 nm", "operation": "fm", "signal": "mode"}]},
        tip={"radius": 20e-9},
        sample={"youngs_modulus": "1 GPa", "poisson_ratio": 0.3},
        forces=[df.forces.Hertz()],
    )
    return df.approach(case, zc=[9e-9, 5e-9, 4e-9])


def test_material_of_a_simulated_curve_has_the_truth_beside_and_the_known_error(am_fm_curve):
    found = df.material(am_fm_curve)
    assert np.isnan(found.E_eff.values[0])
    assert found.E_eff.values[-1] / float(found.true_E_eff) == pytest.approx(0.586, abs=1e-3)
    assert found.true_indentation.values[-1] == pytest.approx(0.264e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("first", "second", "excitation"),
    [
        ({"lag": 0.5}, {"lag": 0.2, "phase_set_point": "80 deg"}, "force"),
        ({}, {"phase_set_point": "60 deg"}, "force"),
        ({}, {"lag": 0.3, "phase_set_point": "110 deg"}, "force"),
        ({}, {"lag": np.pi, "phase_set_point": "75 deg"}, "base"),
    ],
)
def test_material_finds_stiffness_and_virial_of_the_motion_at_any_lag_and_phase(am_fm_curve, first, second, excitation):
    tones = [{"A0": 8e-9, **first}, {"A0": "0.1 nm", "operation": "fm", **second}]
    case = case_of(am_fm_curve).replace("drive", {"tones": tones, "excitation": excitation})
    curve = df.approach(case, zc=[9e-9, 4.5e-9])
    seen = _observed(curve, case)
    assert curve.virial.values[-1, 0] < -1e-19  # a tap
    # a base moves the tip beside mode 1, too: by 1 / (chi Q) of it
    assert seen.virial[-1] == pytest.approx(curve.virial.values[-1, 0], rel=2e-3, abs=0.0)
    assert seen.mean_stiffness[-1] == pytest.approx(curve.mean_stiffness.values[-1, 1], rel=5e-3)


def test_material_says_that_mode_2_answers_a_harmonic(am_fm_curve):
    found = df.material(am_fm_curve)
    assert "Mode 2 also answers harmonics of tone 1" in found.attrs["advice"]
    assert float(found.neglected.sel(effect="harmonics")[-1]) == pytest.approx(0.1, abs=0.02)
    at, *rows = df.summary(found)
    assert (at.label, at.value) == ("at the closest distance", found.zc.values.min())
    assert "true effective modulus" in str(rows)


def test_material_refuses_a_curve_without_a_lock_and_a_tip_without_an_angle(am_fm_curve):
    with pytest.raises(df.ParameterError, match="needs two tones with a lock"):
        df.material(df.dwell(df.example("figure-3-air"), 9e-9))
    with pytest.raises(df.ParameterError, match=r"a cone needs tip\.half_angle"):
        df.material(am_fm_curve, model="cone")


def test_material_of_a_curve_without_a_result_is_not_a_number(am_fm_curve):
    lost = am_fm_curve.assign(
        {name: am_fm_curve[name] * np.nan for name in ("amplitude", "drive_force", "frequency_shift")}
    )
    assert np.isnan(df.material(lost).E_eff).all()
