"""Sneddon's shapes, the small sphere and the thin sample: limits and continuity.

Published values are held by tests/regression.
"""

import math

import numpy as np
import pytest

from dforce.checks.battery import INSTRUMENT
from dforce.forces import BottomEffect, Hertz, Sneddon, Tatara
from dforce.forces._layer import contact

from .conftest import A0, same


@pytest.mark.parametrize("size", [1e-5, 0.01, 0.3, 0.9, 0.999999])
def test_sneddon_finds_the_contact_of_a_sphere_at_any_depth(at, size):
    radius = 1.0
    artanh = math.atanh(size)
    depth, force = size * artanh, (size**2 + 1.0) * artanh - size
    given = {"contact__E_eff": 1.0, "tip__radius": radius, "contact__a0": 0.0}
    # the two terms of the force cancel to the cube of the contact radius
    assert at(Sneddon(geometry="exact_sphere"), -depth, **given) == same(force, 1e-11 + 1e-15 / size**2)


def test_sneddon_sphere_goes_over_into_hertz_when_shallow(at):
    depth = 1e-13
    assert at(Sneddon(geometry="exact_sphere"), A0 - depth) == same(at(Hertz(), A0 - depth), 1e-4)


def test_punch_is_as_stiff_as_its_contact_radius(at):
    assert at(Sneddon(geometry="punch"), A0 - 1e-9, tip__radius=5e-9, contact__E_eff=1e9) == same(1e-8)


SMALL = {
    "tip__radius": 5e-9,
    "tip__youngs_modulus": 170e9,
    "tip__poisson_ratio": 0.28,
    "sample__radius": 10e-9,
    "sample__youngs_modulus": 100e6,
    "sample__poisson_ratio": 0.3,
    "contact__E_eff": 1.0 / ((1.0 - 0.28**2) / 170e9 + (1.0 - 0.3**2) / 100e6),
}


@pytest.mark.parametrize("share", [0.01, 0.3, 0.8])
def test_tatara_force_solves_its_implicit_law(bound, share):
    force = bound(Tatara(), **SMALL)
    depth = share * 8.0 * force.n_c**2 / (27.0 * force.n**2)
    found = force.law(A0 - depth, 0.0, 0.0, *force.values())
    assert (found / force.n) ** (2.0 / 3.0) - found / force.n_c == same(0.5 * depth, 1e-9)


def test_tatara_is_two_contacts_in_series_for_small_compressions(at):
    depth = 1e-15
    radius = 1.0 / (1.0 / 5e-9 + 1.0 / 10e-9)
    hertz = at(Hertz(), A0 - 0.5 * depth, **{**SMALL, "tip__radius": radius})
    assert at(Tatara(), A0 - depth, **SMALL) == same(hertz, 1e-3)


def test_tatara_goes_on_along_its_tangent(bound):
    force = bound(Tatara(), **SMALL)
    limit, h = force.limit, 1e-13
    inside, at_limit, outside = (force.law(A0 - limit + s * h, 0.0, 0.0, *force.values()) for s in (1, 0, -1))
    assert outside - at_limit == same(at_limit - inside, 1e-4)


@pytest.mark.parametrize("geometry", ["sphere", "cone"])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_bottom_effect_holds_as_far_as_its_table(at, geometry, poisson):
    thickness, angle, radius = 1e-6, math.radians(30.0), 10e-6
    given = {
        "tip__radius": radius,
        "tip__half_angle": angle,
        "sample__thickness": thickness,
        "sample__poisson_ratio": poisson,
    }
    half_space = Hertz() if geometry == "sphere" else Sneddon()
    for size in np.linspace(0.05, 3.0, 30):
        reach, ratio = contact(geometry, poisson, size)
        if reach > (2.0 if geometry == "sphere" else 3.0):
            break
        depth = (reach * thickness) ** 2 / radius if geometry == "sphere" else reach * thickness / math.tan(angle)
        found = at(BottomEffect(geometry=geometry), A0 - depth, **given) / at(half_space, A0 - depth, **given)
        assert found == pytest.approx(ratio, rel=1e-3)


@pytest.mark.parametrize("geometry", ["sphere", "cone", "punch"])
@pytest.mark.parametrize("form", ["numerical", "series"])
def test_thick_samples_are_half_spaces(at, geometry, form):
    given = {"sample__thickness": 1e-3}
    half_space = Hertz() if geometry == "sphere" else Sneddon(geometry=geometry)
    found = at(BottomEffect(geometry=geometry, form=form), A0 - 1e-9, **given)
    assert found == same(at(half_space, A0 - 1e-9, **given), 1e-4)


@pytest.mark.parametrize("geometry", ["sphere", "cone"])
@pytest.mark.parametrize("form", ["numerical", "series"])
def test_bottom_effect_goes_on_along_its_tangent(bound, geometry, form):
    force = bound(BottomEffect(geometry=geometry, form=form), sample__thickness=20e-9, tip__radius=10e-9)
    deepest, h = force.deepest, 1e-6 * force.deepest
    inside, middle, outside = (
        force.law(INSTRUMENT["contact.a0"] - deepest + s * h, 0.0, 0.0, *force.values()) for s in (1, 0, -1)
    )
    assert outside - middle == same(middle - inside, 1e-4)
