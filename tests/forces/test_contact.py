"""Hertz, DMT, Kelvin–Voigt and van der Waals: integrals, limits, continuity. Published values are held by tests/regression."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from dforce.checks.battery import INSTRUMENT
from dforce.forces import DMT, Hertz, KelvinVoigt, Sneddon, VanDerWaals

from .conftest import A0, same

SHARP = {"tip__radius": 2e-9, "contact__E_eff": 1e9 / 0.91}


@pytest.mark.parametrize("geometry", ["exact_sphere", "capped_cone", "flat"])
@pytest.mark.parametrize("d", [0.2e-9, 1e-9, 30e-9])
def test_van_der_waals_force_is_the_integral_over_the_tip(at, geometry, d):
    radius, angle, hamaker = 10e-9, math.radians(20.0), 1e-19
    join = radius * (1.0 - math.sin(angle))

    def squared(z):
        if geometry == "flat":
            return radius**2
        if geometry == "exact_sphere" or z < join:
            return z * (2.0 * radius - z)
        return (radius * math.cos(angle) + (z - join) * math.tan(angle)) ** 2

    pieces = {"exact_sphere": [(0.0, 2.0 * radius)], "flat": [(0.0, np.inf)]}.get(
        geometry, [(0.0, join), (join, np.inf)]
    )
    total = sum(
        quad(lambda s: squared(s * d) / (1.0 + s) ** 4, low / d, high / d, epsabs=0.0, epsrel=1e-11, limit=500)[0]
        for low, high in pieces
    )
    assert at(VanDerWaals(hamaker=hamaker, geometry=geometry), d) == same(-hamaker / 2.0 * total / d**3, 1e-8)


def test_shapes_of_the_tip_agree_close_to_the_surface(at):
    near = [
        at(VanDerWaals(hamaker=1e-19, geometry=g), 0.2e-9, tip__radius=1e-5)
        for g in ("sphere", "exact_sphere", "capped_cone")
    ]
    assert near == [same(near[0], 1e-3)] * 3  # the distance is 2e-5 of the radius, the cone far away


def test_attraction_in_contact_is_held_or_off_as_asked(at):
    outside = at(VanDerWaals(hamaker=1e-19), math.nextafter(A0, 1.0))
    assert at(VanDerWaals(hamaker=1e-19), -1e-9) == same(outside)
    assert at(VanDerWaals(hamaker=1e-19, inside="off"), -1e-9) == 0.0


@pytest.mark.parametrize(("hamaker", "gamma"), [(0.8e-20, 0.00389727439466), (9e-20, 0.0438443369399)])
def test_surface_energy_and_hamaker_constant_follow_from_each_other(bound, hamaker, gamma):
    assert bound(DMT(hamaker=hamaker)).gamma == same(gamma)
    assert same(hamaker) == bound(DMT(surface_energy=gamma)).H


@pytest.mark.parametrize("d", [-3e-9, 0.0, 0.1e-9, A0, 0.2e-9, 1e-9, 1e-7])
def test_dmt_equals_van_der_waals_plus_hertz(at, d):
    hamaker = 3e-20
    assert at(DMT(hamaker=hamaker), d, **SHARP) == same(
        at(VanDerWaals(hamaker=hamaker), d, **SHARP) + at(Hertz(), d, **SHARP), 1e-14
    )


def test_dmt_uses_both_constants_as_given_and_declares_the_jump(bound, at):
    both = DMT(hamaker=1e-20, surface_energy="20 mJ/m^2")
    assert at(both, A0, **SHARP) == same(-1e-20 * 2e-9 / (6.0 * A0**2))
    assert at(both, A0 - 1e-20, **SHARP) == same(-4.0 * math.pi * 2e-9 * 0.02, 1e-6)
    assert bound(both).jumps() == (A0,)
    assert bound(DMT(hamaker=1e-20)).jumps() == ()
    gamma = bound(DMT(hamaker=1e-20)).gamma
    assert bound(DMT(hamaker=1e-20, surface_energy=gamma)).jumps() == ()


def test_stiffness_of_hertz_is_twice_modulus_times_contact_radius(at):
    depth, h = 1e-9, 1e-13
    slope = (at(Hertz(), A0 - depth - h, **SHARP) - at(Hertz(), A0 - depth + h, **SHARP)) / (2.0 * h)
    assert slope == same(2.0 * 1e9 / 0.91 * math.sqrt(2e-9 * depth), 1e-7)


def test_kelvin_voigt_force(at):
    assert at(KelvinVoigt(viscosity=100.0), A0 - 1e-9, rate=-1e-3, **SHARP) == same(1.41421356237e-10)
    assert at(KelvinVoigt(), A0 + 1e-12, rate=-1e-3, **SHARP) == 0.0


def elastic(geometry):
    return Hertz() if geometry == "sphere" else Sneddon(geometry=geometry)


@pytest.mark.parametrize("geometry", ["sphere", "cone", "pyramid", "punch"])
def test_kelvin_voigt_is_the_rate_of_the_elastic_force_of_its_shape(at, geometry):
    depth, rate, h = 1e-9, -1e-3, 1e-13
    force = elastic(geometry)
    growth = (at(force, A0 - depth - h) - at(force, A0 - depth + h)) / (2.0 * h * INSTRUMENT["contact.E_eff"])
    drag = at(KelvinVoigt(viscosity=2.0 * 50.0, geometry=geometry), A0 - depth, rate=rate)
    assert drag == same(50.0 * growth * -rate, 1e-7)


@pytest.mark.parametrize("geometry", ["sphere", "cone", "pyramid", "punch"])
def test_no_tension_keeps_elastic_and_viscous_force_from_pulling(at, geometry):
    force, drag = elastic(geometry), KelvinVoigt(geometry=geometry, no_tension=True)
    for depth in np.linspace(1e-12, 2e-9, 50):
        push = at(force, A0 - depth)
        # their sum cancels but for the last digits
        assert push + at(drag, A0 - depth, rate=1.0) >= -1e-15 * push
        slow = at(KelvinVoigt(geometry=geometry), A0 - depth, rate=1e-9)
        assert at(drag, A0 - depth, rate=1e-9) == slow
