"""Modulus and viscosity from two tones: a sinusoid by hand, all shapes, and the exact torus."""

import numpy as np
import pytest

from dforce.inverse.bimodal import Contact, Observed, estimate, neglected

A, K, F0 = 4e-9, (0.9, 28.0), (48.9e3, 282e3)
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
        K, (100.0, 200.0), F0, (np.array([f1]), np.array([f2])), (np.array([A]), np.array([1e-14])), np.array([drive]),
        np.array([np.pi / 2.0]),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("share", "ratio"), [(0.0025, 1.0006), (0.0125, 1.0031), (0.046, 1.0116), (0.125, 1.0324), (0.25, 1.0671)]
)
def test_formula_of_a_paraboloid_errs_along_a_sinusoid_as_computed_by_hand(share, ratio):
    contact = Contact.paraboloid(20e-9)
    found = estimate(prescribed(contact, 1e7, share * A), contact)
    assert found.E_eff[0] / 1e7 == pytest.approx(ratio, abs=2e-4)


@pytest.mark.parametrize("contact", [Contact.punch(5e-9), Contact.paraboloid(20e-9), Contact.cone(0.6)])
def test_each_shape_has_its_modulus_indentation_force_and_viscosity_back(contact):
    tau = 1e-8
    found = estimate(prescribed(contact, 1e7, 1e-3 * A, tau), contact)
    assert found.E_eff[0] == pytest.approx(1e7, rel=2e-3)
    assert found.indentation[0] == pytest.approx(1e-3 * A, rel=2e-3)
    assert found.peak_force[0] == pytest.approx(1e7 * contact.shape * (1e-3 * A) ** contact.power, rel=3e-3)
    assert found.viscosity[0] == pytest.approx(2.0 * tau * 1e7, rel=3e-3)


def test_attraction_has_no_modulus():
    seen = prescribed(Contact.punch(5e-9), 1e7, 0.1e-9)
    pulled = seen._replace(frequency=(np.array([0.999 * F0[0]]), np.array([0.999 * F0[1]])))
    assert np.isnan(estimate(pulled, Contact.punch(5e-9)).E_eff).all()


def test_answer_of_mode_2_to_harmonics_counts_most_where_one_falls_on_its_resonance():
    contact = Contact.paraboloid(20e-9)
    seen = prescribed(contact, 1e9, 0.2e-9)
    tuned = seen._replace(f0=(F0[0], 6.0 * seen.frequency[0][0]))
    off = seen._replace(f0=(F0[0], 6.5 * seen.frequency[0][0]))
    found = estimate(seen, contact)
    shares = [neglected(one, contact, found)["harmonics"][0] for one in (tuned, off)]
    assert shares[0] > 10.0 * shares[1]
