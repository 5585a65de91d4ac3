"""Sneddon's shapes, the small sphere and the thin sample: reference values and limits."""

import math

import numpy as np
import pytest

from dforce.forces import BottomEffect, Hertz, Sneddon, Tatara
from dforce.forces._layer import contact, kernel_moments
from dforce.forces.bottom_effect import coefficients
from dforce.testing import INSTRUMENT

from .conftest import A0, same

STIFF, SOFT = 1e9 / 0.91, 10e3 / 0.75


@pytest.mark.parametrize(
    ("geometry", "modulus", "angle", "depth", "force"),
    [
        ("cone", STIFF, 20.0, 1e-9, 2.5462708537e-10),
        ("pyramid", STIFF, 20.0, 1e-9, 2.82819583296e-10),
        ("cone", SOFT, 35.0, 500e-9, 1.48588654528e-9),
        ("pyramid", SOFT, 35.0, 500e-9, 1.65040499502e-9),
    ],
)
def test_sneddon_force_of_sharp_tips(at, geometry, modulus, angle, depth, force):
    given = {"contact__E_eff": modulus, "tip__half_angle": math.radians(angle)}
    assert at(Sneddon(geometry=geometry), A0 - depth, **given) == same(force)


@pytest.mark.parametrize(
    ("modulus", "radius", "depth", "force"),
    [(STIFF, 20e-9, 1.27706405941e-9, 9.39609346184e-9), (SOFT, 2.5e-6, 4.23648930194e-7, 7.61939658538e-9)],
)
def test_sneddon_force_of_an_exact_sphere(at, modulus, radius, depth, force):
    given = {"contact__E_eff": modulus, "tip__radius": radius}
    assert at(Sneddon(geometry="exact_sphere"), A0 - depth, **given) == same(force, 1e-11)


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


@pytest.mark.parametrize(
    ("form", "force"),
    [("implicit", 1.0178671118e-10), ("series", 1.01732529852e-10), ("series_15", 1.01575987354e-10)],
)
def test_tatara_force(at, form, force):
    assert at(Tatara(form=form), A0 - 1e-9, **SMALL) == same(force, 5e-11)


def test_tatara_constants(bound):
    force = bound(Tatara(), **SMALL)
    assert (force.n, force.n_c) == (same(8454.30808746), same(4.02294515833))


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


MOMENTS = {
    0.0: (-1.2110617184874, 0.4696954251458),
    0.3: (-1.3768541654558, 0.62755166138425),
    0.4: (-1.5187080140683, 0.7475515100371),
    0.49: (-1.7374540168627, 0.9301778742178),
    0.5: (-1.770216773366, 0.95776928889808),
}
TABLE = {
    ("sphere", 0.0): (0.7709858355, 0.6934890184, 0.3599944112, -0.0359613090),
    ("cone", 0.0): (0.4908248271, 0.3011362637, 0.1297770580, 0.0198122768),
    ("punch", 0.0): (0.7709858355, 0.5944191586, 0.0595988922, -0.2614343328),
    ("sphere", 0.3): (0.8765325854, 0.8963609355, 0.5715551235, 0.0518076415),
    ("cone", 0.3): (0.5580179750, 0.3892300755, 0.2009973824, 0.0532004174),
    ("punch", 0.3): (0.8765325854, 0.7683093733, 0.1407658069, -0.3435276597),
    ("sphere", 0.4): (0.9668395502, 1.090575168, 0.8313017203, 0.2630868271),
    ("cone", 0.4): (0.6155091744, 0.4735644297, 0.2852869430, 0.1122388349),
    ("punch", 0.4): (0.9668395502, 0.9347787158, 0.2692396036, -0.3531882530),
    ("sphere", 0.49): (1.106097581, 1.427360501, 1.373177791, 0.8768878785),
    ("cone", 0.49): (0.7041635901, 0.6198079519, 0.4582376368, 0.2688372581),
    ("punch", 0.49): (1.106097581, 1.223451858, 0.5636976383, -0.2498252611),
    ("sphere", 0.5): (1.126954999, 1.481698832, 1.470007134, 1.004677678),
    ("cone", 0.5): (0.7174418351, 0.6434034835, 0.4889273259, 0.3004307974),
    ("punch", 0.5): (1.126954999, 1.27002757, 0.6182840975, -0.2194133203),
}


@pytest.mark.parametrize(("poisson", "moments"), MOMENTS.items())
def test_moments_of_the_layer_kernel(poisson, moments):
    assert kernel_moments(poisson) == tuple(same(value, 1e-12) for value in moments)


@pytest.mark.parametrize(("shape", "values"), TABLE.items())
def test_coefficients_of_the_bottom_effect(shape, values):
    assert coefficients(*shape) == tuple(pytest.approx(value, rel=5e-10, abs=6e-11) for value in values)


THIN = {
    "sample__thickness": 5e-6,
    "sample__poisson_ratio": 0.5,
    "contact__E_eff": 1e3 / 0.75,
    "tip__radius": 2.5e-6,
}


@pytest.mark.parametrize(
    ("geometry", "force"),
    [("sphere", 1.3366981955637e-9), ("cone", 1.5654787090144e-10), ("punch", 6.4818552397868e-9)],
)
def test_series_of_the_bottom_effect(at, geometry, force):
    model = BottomEffect(geometry=geometry, form="series")
    # a0 - depth costs four digits of sixteen at this depth
    assert at(model, A0 - 0.5e-6, tip__half_angle=math.radians(35.0), **THIN) == same(force, 1e-12)


DIRECT = [
    (geometry, reach, ratio)
    for geometry, ratios in {
        "sphere": (1.129082, 1.518216, 2.156215, 5.115374),
        "cone": (1.078698, 1.288939, 1.600211, 3.044374),
        "punch": (1.125987, 1.466222, 1.932934, 3.618736),
    }.items()
    for reach, ratio in zip((0.1, 0.3, 0.5, 1.0), ratios, strict=True)
]


@pytest.mark.parametrize(("geometry", "reach", "ratio"), DIRECT)
def test_bottom_effect_follows_the_direct_numerical_solution(at, geometry, reach, ratio):
    thickness, angle = 1e-6, math.radians(30.0)
    radius = reach * thickness if geometry == "punch" else 10e-6
    depth = {
        "sphere": (reach * thickness) ** 2 / radius,
        "cone": reach * thickness / math.tan(angle),
        "punch": 10e-9,
    }[geometry]
    given = {
        "tip__radius": radius,
        "tip__half_angle": angle,
        "sample__thickness": thickness,
        "sample__poisson_ratio": 0.5,
        "contact__E_eff": 1e4,
    }
    half_space = Hertz() if geometry == "sphere" else Sneddon(geometry=geometry)
    found = at(BottomEffect(geometry=geometry), A0 - depth, **given) / at(half_space, A0 - depth, **given)
    assert found == pytest.approx(ratio, rel=1e-6 if geometry == "punch" else 1e-3)


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
