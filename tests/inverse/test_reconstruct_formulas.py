"""The formulas in use, against values of independent quadrature and their exact error on exponentials."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ive

from dforce.inverse.reconstruction._formulas import holscher, payam, sader_jarvis

# error of Sader and Jarvis on exp(-kappa d): the force times s(x), x = kappa A
SCALES = {
    0.01: 1.0036788460, 0.1: 0.9776870169, 0.5: 0.9582349730, 1.0: 0.9889525602, 2.0: 1.0164336442, 5.0: 1.0029846795,
    10.0: 0.9950465836, 100.0: 0.9980266641,
}  # fmt: skip
VDW = (
    (10e-9, -2.257254011e-4, -2.65702583e-11),
    (1e-9, -5.30030928e-3, -2.67538375e-11),
    (0.1e-9, -3.577372507e-2, -2.5756625e-11),
)
MORSE = (
    (0.1e-9, -2.011222362e-3, -1.56540267e-9),
    (0.02e-9, -3.450727049e-3, -1.47202819e-9),
    (0.5e-9, -2.721809075e-4, -1.54914784e-9),
)
E_B, KAPPA, SIGMA = 2.15e-19, 1.55e10, 2.357e-10


def vdw_shift(d, amplitude, k=0.9, h=2e-20, radius=2e-9):
    """Return -V / k A^2 of the attraction -H R / 6 d^2 with closest distance d, in closed form."""
    z = d + amplitude
    return -h * radius / 6.0 / (z**2 - amplitude**2) ** 1.5 / k


def exponential_shift(d, amplitude, kappa, force, k):
    """Return -V / k A^2 of force exp(-kappa d), in closed form: V = -force e^{-kappa d} A e^{-x} I_1(x)."""
    return force * np.exp(-kappa * d) * ive(1, kappa * amplitude) / (k * amplitude)


def morse_shift(d, amplitude, k):
    first = exponential_shift(d, amplitude, KAPPA, -2.0 * KAPPA * E_B * np.exp(KAPPA * SIGMA), k)
    return first + exponential_shift(d, amplitude, 2.0 * KAPPA, 2.0 * KAPPA * E_B * np.exp(2.0 * KAPPA * SIGMA), k)


def test_the_closed_virials_agree_with_quadrature():
    amplitude, d = 1e-9, 0.5e-9

    def force(x):
        return 2.0 * KAPPA * E_B * (np.exp(-2.0 * KAPPA * (x - SIGMA)) - np.exp(-KAPPA * (x - SIGMA)))

    def work(law):
        return quad(
            lambda t: law(d + amplitude * (1.0 + np.cos(t))) * amplitude * np.cos(t) / np.pi, 0.0, np.pi, limit=400
        )[0]

    assert -work(force) / (1800.0 * amplitude**2) == pytest.approx(morse_shift(d, amplitude, 1800.0), rel=1e-8)
    attraction = -work(lambda x: -2e-20 * 2e-9 / 6.0 / x**2) / (0.9 * amplitude**2)
    assert attraction == pytest.approx(vdw_shift(d, amplitude), rel=1e-8)


def beyond(start, length):
    """Return distances that are dense at the start and go far enough for nothing to be left."""
    return start + length * np.concatenate([[0.0], np.geomspace(1e-7, 1e5, 1500)])


@pytest.mark.parametrize(("x", "scale"), SCALES.items())
def test_sader_jarvis_has_its_exact_error_on_an_exponential(x, scale):
    amplitude = 1e-9
    kappa = x / amplitude
    d = np.concatenate([[0.0], np.geomspace(1e-7, 60.0, 1200)]) / kappa
    shift = exponential_shift(d, amplitude, kappa, 1e-9, 10.0)
    found = sader_jarvis(d, shift, np.full(len(d), amplitude), 10.0)[0]
    assert found / 1e-9 == pytest.approx(scale, rel=2e-4)  # straight pieces between points


@pytest.mark.parametrize(("amplitude", "shift", "force"), VDW)
def test_sader_jarvis_on_van_der_waals(amplitude, shift, force):
    d = beyond(0.5e-9, 0.5e-9)
    shifts = vdw_shift(d, amplitude)
    assert shifts[0] == pytest.approx(shift, rel=1e-9)
    assert sader_jarvis(d, shifts, np.full(len(d), amplitude), 0.9)[0] == pytest.approx(force, rel=2e-4)


@pytest.mark.parametrize(("amplitude", "shift", "force"), MORSE)
def test_sader_jarvis_on_morse(amplitude, shift, force):
    d = beyond(0.3e-9, 0.05e-9)
    shifts = morse_shift(d, amplitude, 1800.0)
    assert shifts[0] == pytest.approx(shift, rel=1e-9)
    assert sader_jarvis(d, shifts, np.full(len(d), amplitude), 1800.0)[0] == pytest.approx(force, rel=2e-4)


def test_holscher_and_payam_come_to_the_force_at_large_amplitudes():
    amplitude, kappa = 1e-6, 1e10  # 10000 lengths: the leading error is that of I_1, 3/8x, and what the terms leave out
    d = np.concatenate([[0.0], np.geomspace(1e-7, 60.0, 1200)]) / kappa
    shift = exponential_shift(d, amplitude, kappa, 1e-9, 10.0)
    sizes = np.full(len(d), amplitude)
    for formula in (holscher, payam):
        assert formula(d, shift, sizes, 10.0)[0] == pytest.approx(1e-9, rel=2e-3)
