"""Forces that reach beyond contact: integrals, limits, necks. Published values are held by tests/regression."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from dforce.checks.battery import follow
from dforce.core.errors import ParameterError
from dforce.forces import (
    DLVO,
    Capillary,
    Electrostatic,
    Hydration,
    LennardJones,
    MagneticDipole,
    Morse,
    Solvation,
    VanDerWaals,
)

from .conftest import A0, same

CHARGED = {"hamaker": 1e-20, "debye_length": 0.48e-9, "tip_charge": 0.032, "sample_charge": 0.05}
IN_WATER = {"tip__radius": 10e-9, "medium__permittivity": 78.5, "medium__temperature": 298.15}


def test_charges_and_potentials_are_turned_into_each_other(at, bound):
    def model(variant, **surfaces):
        return DLVO(hamaker=0.0, salt="10 mmol/l", variant=variant, **surfaces)

    weak = bound(model("superposition", tip_potential=1e-3, sample_potential=1e-3), **IN_WATER)
    charges = {"tip_charge": weak.charge("tip"), "sample_charge": weak.charge("sample")}
    linear = at(model("superposition", **charges), 2e-9, **IN_WATER)
    exact = at(model("gouy_chapman", **charges), 2e-9, **IN_WATER)
    # Grahame's equation is linear to the square of 1 mV over 51 mV
    assert exact == same(linear, 1e-3)


def test_dlvo_names_what_is_missing_or_given_twice():
    with pytest.raises(ParameterError, match="one of tip_charge and tip_potential, but has none"):
        DLVO(hamaker=0.0, debye_length=1e-9, sample_charge=0.01)
    with pytest.raises(ParameterError, match="one of debye_length and salt, but has both"):
        DLVO(**CHARGED, salt="0.1 mol/l")


def test_lennard_jones_is_strongest_at_its_distance_and_van_der_waals_far_away(at):
    force = LennardJones(work_of_adhesion=0.05, equilibrium=0.165e-9)
    assert at(force, 0.165e-9) == same(-2.0 * math.pi * 10e-9 * 0.05)
    far = VanDerWaals(hamaker=16.0 * math.pi * 0.05 * 0.165e-9**2)
    assert at(force, 10e-9) == same(at(far, 10e-9), 1e-10)  # the repulsion is (z0/d)^6 of it


def test_lennard_jones_is_the_integral_of_its_pressure(at):
    work, z0, radius, d = 0.05, 0.165e-9, 10e-9, 0.2e-9

    def pressure(u):
        return -8.0 * work / (3.0 * z0) * ((1.0 / u) ** 3 - (1.0 / u) ** 9)

    total = 2.0 * math.pi * radius * z0 * quad(pressure, d / z0, np.inf, epsrel=1e-12)[0]
    assert at(LennardJones(work_of_adhesion=work, equilibrium=z0), d) == same(total, 1e-10)


def test_morse_is_strongest_where_half_the_bond_is_stretched(at):
    force = Morse(bond_energy=2e-19, decay=1.5e10, bond_length=2.4e-10)
    assert at(force, 2.4e-10 + math.log(2.0) / 1.5e10) == same(-1.5e10 * 2e-19 / 2.0)


WET = {"surface_tension": 0.072, "volume": 10e-27, "formation": 0.5e-9}


def neck(bound, **changes):
    return bound(Capillary(**{**WET, **changes}), tip__radius=10e-9)


@pytest.mark.parametrize("meniscus", ["constant_volume", "kelvin"])
def test_capillary_neck_forms_near_and_breaks_far(bound, meniscus):
    force = neck(bound, meniscus=meniscus)
    answer = follow(force, sway, np.linspace(0.0, 1.0, 2001))
    there = answer.latched > 0.5
    assert answer.distance[there][: np.argmin(answer.distance[there])].max() <= 0.5e-9
    assert answer.distance[there].max() == pytest.approx(force.rupture, abs=1.5e-11)
    assert set(answer.force[~there]) == {0.0}


def sway(t):
    return 3e-9 + 2.9e-9 * math.cos(2.0 * math.pi * t), -2.9e-9 * 2.0 * math.pi * math.sin(2.0 * math.pi * t)


def test_kelvin_neck_breaks_where_its_force_ends(bound):
    force = neck(bound, meniscus="kelvin", humidity=0.5)
    radius = 0.072 * 1.8e-5 / (8.31446261815324 * 298.15 * math.log(2.0))
    assert force.rupture == same(2.0 * radius)
    assert force.law(force.rupture, 0.0, 0.0, 1.0, *force.values()) == pytest.approx(0.0, abs=1e-22)
    half = force.law(radius, 0.0, 0.0, 1.0, *force.values())
    assert half == same(-2.0 * math.pi * 10e-9 * 0.072)


def test_a_neck_that_would_break_as_it_forms_is_refused(bound):
    with pytest.raises(ParameterError, match="formation = 3e-09 m is not below"):
        neck(bound, formation=3e-9)


@pytest.mark.parametrize("ratio", [0.01, 0.1, 0.3, 1.0, 10.0, 100.0])
def test_electrostatic_sphere_is_near_the_exact_series(at, ratio):
    d, alpha = ratio * 1e-6, math.acosh(1.0 + ratio)
    n = np.arange(1.0, 40.0 / alpha)
    series = np.sum((1.0 / math.tanh(alpha) - n / np.tanh(n * alpha)) / np.sinh(n * alpha))
    exact = 2.0 * math.pi * 8.8541878128e-12 * series
    assert at(Electrostatic(bias=1.0), d, tip__radius=1e-6) == same(exact, 0.06)


def test_electrostatic_cone_is_the_integral_of_its_field(at):
    radius, angle, height, d = 20e-9, math.radians(10.0), 10e-6, 5e-9
    given = {"tip__radius": radius, "tip__half_angle": angle}
    start = d + radius * (1.0 - math.sin(angle))
    apex = start - radius * math.cos(angle) ** 2 / math.sin(angle)  # of the cone if it had no sphere

    def ring(z):
        field = 1.0 / (z * math.tan(angle) * abs(math.log(math.tan(0.5 * angle))))
        return 0.5 * 8.8541878128e-12 * field**2 * 2.0 * math.pi * (z - apex) * math.tan(angle) ** 2

    cone = quad(ring, start, height, epsrel=1e-10, limit=500)[0]
    both = at(Electrostatic(cone_height=height, geometry="sphere_and_cone"), d, **given)
    area = math.pi * 8.8541878128e-12 * radius**2 * (1.0 - math.sin(angle)) / (d * start)
    # the closed form leaves out the radius over the cone's height
    assert both == same(-(cone + area), 2.0 * 120e-9 / height)


def test_alternating_bias_adds_to_the_constant_one(bound):
    force = bound(Electrostatic(bias=0.5, contact_potential=0.2, ac_bias=1.0, ac_frequency=1e3))
    still = bound(Electrostatic(bias=1.0))
    unit = still.law_function()(5e-9, 0.0, 0.0, *still.values())
    for t, voltage in ((0.0, 1.3), (0.25e-3, 0.3), (0.5e-3, -0.7)):
        assert force.law(5e-9, 0.0, t, *force.values()) == same(unit * voltage**2, 1e-12)
    assert force.timed
    assert not still.timed


def test_hydration_force_is_derjaguins_approximation(at):
    pressure_integral = quad(lambda x: 5e-3 * math.exp(-x), 1e-9 / 0.5e-9, np.inf)[0]
    found = at(Hydration(energy=5e-3, decay=0.5e-9), 1e-9)
    assert found == same(2.0 * math.pi * 10e-9 * pressure_integral, 1e-9)


@pytest.mark.parametrize("force", [Solvation(), Hydration(), MagneticDipole(), Electrostatic(), DLVO(**CHARGED)])
def test_long_range_forces_keep_their_value_in_contact(at, force):
    assert at(force, -1e-9) == same(at(force, math.nextafter(A0, 1.0)), 1e-9)


def test_magnetic_dipoles_attract_when_they_point_the_same_way(at):
    force = at(MagneticDipole(tip_moment=1e-17, sample_moment=2e-17, depth=5e-9), 5e-9)
    assert force == same(-3.0 * 4e-7 * math.pi * 2e-34 / (2.0 * math.pi * 20e-9**4), 1e-9)
    assert at(MagneticDipole(tip_moment=1e-17, sample_moment=-2e-17, depth=5e-9), 5e-9) == same(-force)
