"""Paths and virials of known laws, against values of shooting and harmonic balance that share no code with dForce."""

import numpy as np
import pytest

from dforce.inverse.reconstruction._law import laid
from dforce.inverse.reconstruction._path import (
    HARMONICS,
    Motions,
    closest,
    impulse,
    no_paths,
    paths_of,
    rows_of,
    virials,
)

F0, K, Q = 48.9e3, 0.9, 255.0


def dmt(d, radius=2e-9, modulus=1e9 / 0.91, hamaker=2e-20, a0=0.165e-9):
    depth = np.maximum(a0 - d, 0.0)
    return -hamaker * radius / 6.0 / np.maximum(d, a0) ** 2 + 4.0 / 3.0 * modulus * np.sqrt(radius) * depth**1.5


def law_of(force, low=-1.5e-9, high=60e-9):
    """Return a law by 6000 nodes, so many that the nodes do not show."""
    law = laid(low, high, 5e-9, 6000)
    return law._replace(force=force(law.nodes), length=high)


def motions(height, amplitude, frequency, k=K, q=Q, f0=F0):
    ratio = np.arange(HARMONICS + 1) * frequency / f0
    response = 1.0 / (k * (1.0 - ratio**2 + 1j * ratio / q))
    mobility = np.array([(f0 / frequency) ** 2 / k])
    return Motions(np.array([height]), np.array([amplitude]), np.array([frequency]), response[None], mobility)


@pytest.mark.parametrize(
    ("height", "shift", "virial", "tolerance"),
    # what the instants of a path leave grows with the slope of the force
    [(12e-9, -1.2412634564, 2.2845049738e-21, 2e-6), (10.2e-9, -44.4831237, 8.18335419e-20, 1e-4),
     (9.5e-9, 252.15802, -4.6529110e-19, 3e-4)],
)  # fmt: skip
def test_a_phase_locked_motion_along_its_path_has_the_frequency_of_shooting(height, shift, virial, tolerance):
    law, amplitude, frequency = law_of(dmt), 10e-9, F0
    for _ in range(8):
        one = motions(height, amplitude, frequency)
        found = virials(law, one, paths_of(law, one, no_paths(one)))[0]
        frequency = F0 * np.sqrt(1.0 - 2.0 * found / (K * amplitude**2))
    assert found == pytest.approx(virial, rel=tolerance, abs=0.0)
    assert frequency - F0 == pytest.approx(shift, rel=tolerance)


@pytest.mark.parametrize(
    ("d", "amplitude", "phase", "height"),
    [(-0.2e-9, 19.99204927e-9, 91.615625, 19.79330861e-9), (0.0, 19.15711721e-9, 106.693346, 19.1685068e-9),
     (0.3e-9, 19.9187534e-9, 95.166214, 20.22233777e-9)],
)  # fmt: skip
def test_tapping_states_of_one_harmonic_have_their_virial(d, amplitude, phase, height):
    one = motions(d + amplitude, amplitude, F0)
    law = law_of(dmt)
    virial = rows_of(law, one, no_paths(one)).virial @ law.force
    largest = K * amplitude * 20e-9 / (2.0 * Q)  # attraction and repulsion all but cancel; their instants do not
    assert virial[0] == pytest.approx(-largest * np.cos(np.deg2rad(phase)), rel=0.0, abs=2e-4 * largest)
    # the height is that of a lever which the mean force bends
    theta = 2.0 * np.pi * np.arange(40000) / 40000
    mean = np.mean(dmt(d + amplitude * (1.0 + np.cos(theta))))
    assert d + amplitude - mean / K == pytest.approx(height, abs=2e-14)


def test_a_short_contact_pulls_the_turning_point_down_by_half_of_what_the_mean_goes_up():
    one = motions(9.7e-9, 10e-9, F0)
    bend = impulse(one, np.array([-1e-19]))
    mean = 1e-19 / 10e-9 / K
    assert closest(one, bend)[0] == pytest.approx(-0.3e-9 - 0.5 * mean, abs=1e-2 * mean)  # 1/Q turns the phases
    assert rows_of(law_of(dmt), one, bend).closest[0] == closest(one, bend)[0]


def test_a_conservative_law_takes_from_the_fundamental_what_the_harmonics_lose():
    """In water: E = (pi k r / Q) sum of h^2 A_h^2 over h > 1, S3a: 3.114874985e-20 J at 1036.966215 Hz."""
    law = law_of(lambda d: dmt(d, hamaker=0.0))
    one = motions(4.5e-9, 5e-9, 48.9e3 + 1036.966215, q=2.0)
    paths = paths_of(law, one, no_paths(one))
    rows = rows_of(law, one, paths)
    assert (rows.energy @ law.force)[0] == pytest.approx(3.114874985e-20, rel=5e-4, abs=0.0)  # by its instants
    assert (rows.virial @ law.force)[0] == pytest.approx(-4.82190686e-19, rel=5e-5, abs=0.0)
