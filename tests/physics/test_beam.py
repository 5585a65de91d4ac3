"""Modes of a rectangular cantilever, in vacuum and in fluids, against reference values."""

import math

import pytest

from dforce import beam
from dforce.errors import ParameterError

# Printed values have 10 to 12 digits; half a unit of the last printed one.
DIGITS = 1e-10

SILICON = {"youngs_modulus": 169e9, "density": 2330.0, "length": 225e-6, "width": 28e-6, "thickness": 3e-6}
AIR, WATER = (1.18, 1.86e-5), (997.0, 8.59e-4)


def in_fluid(n, fluid):
    free = beam.vacuum_mode(n, **SILICON)
    return beam.fluid_mode(free.frequency, 2330.0, 28e-6, 3e-6, *fluid)


@pytest.mark.parametrize(
    ("n", "kappa"),
    [(1, 1.87510406871), (2, 4.69409113297), (3, 7.85475743824), (4, 10.9955407349), (5, 14.1371683910)],
)
def test_wavenumbers_are_the_tabulated_roots(n, kappa):
    assert beam.wavenumber(n) == pytest.approx(kappa, rel=DIGITS)


@pytest.mark.parametrize("n", [1, 2, 3, 6, 10, 40])
def test_wavenumbers_solve_the_equation_of_the_free_end(n):
    kappa = beam.wavenumber(n)
    # the slope of cos + 1/cosh is about one, so this is the error of kappa itself: some rounding of 2n pi
    assert math.cos(kappa) + 1 / math.cosh(kappa) == pytest.approx(0.0, abs=4e-16 * max(kappa, 4))


@pytest.mark.parametrize(
    ("n", "over_static"), [(1, 1.03019694736), (2, 40.4599015428), (3, 317.212188866), (4, 1218.10610876)]
)
def test_mode_stiffness_over_static_stiffness(n, over_static):
    static = beam.static_stiffness(169e9, 225e-6, 28e-6, 3e-6)
    assert beam.vacuum_mode(n, **SILICON).stiffness / static == pytest.approx(over_static, rel=DIGITS)


@pytest.mark.parametrize(
    ("n", "frequency", "stiffness"),
    [
        (1, 81527.0769001, 2.88882486217),
        (2, 510921.469642, 113.455557985),
        (3, 1430594.90928, 889.509971978),
    ],
)
def test_silicon_beam_has_the_reference_modes(n, frequency, stiffness):
    mode = beam.vacuum_mode(n, **SILICON)
    assert mode.frequency == pytest.approx(frequency, rel=DIGITS)
    assert mode.stiffness == pytest.approx(stiffness, rel=DIGITS)
    assert beam.static_stiffness(169e9, 225e-6, 28e-6, 3e-6) == pytest.approx(2.80414814815, rel=DIGITS)


@pytest.mark.parametrize(
    ("n", "stiffness", "frequency"),
    [(2, 39.2739481965, 6.26689302577), (3, 307.914122323, 17.5474819368), (4, 1182.40120191, 34.3860611572)],
)
def test_ratios_of_higher_modes_to_the_first(n, stiffness, frequency):
    first, mode = beam.vacuum_mode(1, **SILICON), beam.vacuum_mode(n, **SILICON)
    assert mode.stiffness / first.stiffness == pytest.approx(stiffness, rel=DIGITS)
    assert mode.frequency / first.frequency == pytest.approx(frequency, rel=DIGITS)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_every_mode_moves_a_quarter_of_the_mass(n):
    mode = beam.vacuum_mode(n, **SILICON)
    mass = mode.stiffness / (2 * math.pi * mode.frequency) ** 2
    assert mass == pytest.approx(2330 * 225e-6 * 28e-6 * 3e-6 / 4, rel=1e-14)


@pytest.mark.parametrize(
    ("n", "slope", "lever"),
    [
        (1, 1.37650548467, 0.917670323115),
        (2, 4.78077841021, 3.18718560681),
        (3, 7.84866604649, 5.23244403099),
    ],
)
def test_slope_at_the_end_and_optical_lever_factor(n, slope, lever):
    assert beam.end_slope(n) == pytest.approx(slope, rel=DIGITS)
    assert beam.lever_factor(n) == pytest.approx(lever, rel=DIGITS)


def test_end_slope_is_that_of_the_mode_shape():
    kappa = beam.wavenumber(2)
    sigma = (math.cosh(kappa) + math.cos(kappa)) / (math.sinh(kappa) + math.sin(kappa))

    def shape(x):
        return math.cosh(x) - math.cos(x) - sigma * (math.sinh(x) - math.sin(x))

    h = 1e-5  # central difference: error h^2, some 1e-10
    slope = (shape(kappa * (1 + h)) - shape(kappa * (1 - h))) / (2 * h) / shape(kappa)
    assert beam.end_slope(2) == pytest.approx(slope, rel=1e-8)


@pytest.mark.parametrize(
    ("reynolds", "value"),
    [
        (1.0, 3.73395949305 + 4.07461083367j),
        (10.0, 1.91831810625 + 0.981621970169j),
        (100.0, 1.32627225087 + 0.296101706219j),
    ],
)
def test_hydrodynamic_function_has_the_reference_values(reynolds, value):
    assert beam.hydrodynamic_function(reynolds) == pytest.approx(value, rel=DIGITS)


def test_hydrodynamic_function_stays_finite_at_extreme_reynolds_numbers():
    for reynolds in (1e-6, 1e8):
        value = beam.hydrodynamic_function(reynolds)
        assert math.isfinite(value.real)
        assert math.isfinite(value.imag)


@pytest.mark.parametrize(
    ("n", "fluid", "frequency", "Q"),
    [
        (1, AIR, 81206.41043, 213.1937688),
        (2, AIR, 509512.3199, 577.7382003),
        (1, WATER, 34648.9561, 4.206747536),
        (2, WATER, 234808.2607, 9.074328027),
    ],
)
def test_silicon_beam_in_fluids_has_the_reference_resonances(n, fluid, frequency, Q):
    mode = in_fluid(n, fluid)
    assert mode.frequency == pytest.approx(frequency, rel=1e-9)
    assert pytest.approx(Q, rel=1e-9) == mode.Q


def test_a_thin_gas_leaves_the_beam_as_in_vacuum():
    free = beam.vacuum_mode(1, **SILICON)
    mode = in_fluid(1, (1.18e-6, 1.86e-5))
    # a gas keeps its viscosity when thinned, so some 1e-5 of the beam's mass still moves along
    assert mode.frequency == pytest.approx(free.frequency, rel=1e-4)
    assert mode.Q > 1e3


@pytest.mark.parametrize("fluid", [AIR, WATER])
def test_sader_method_recovers_the_static_stiffness(fluid):
    mode = in_fluid(1, fluid)
    stiffness = beam.sader_stiffness(mode.frequency, mode.Q, 225e-6, 28e-6, *fluid)
    # 0.1906 is printed with four digits
    assert stiffness == pytest.approx(2.80414814815, rel=3e-4)


def test_a_fluid_too_thick_for_a_resonance_is_refused_in_a_sentence():
    with pytest.raises(ParameterError, match="no resonance in this medium"):
        in_fluid(1, (1000.0, 1e12))
