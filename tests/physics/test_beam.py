"""Modes of a rectangular cantilever, in vacuum and in fluids. Published values are held by tests/regression."""

import math

import pytest

from dforce.core.errors import ParameterError
from dforce.instrument import beam

SILICON = {"youngs_modulus": 169e9, "density": 2330.0, "length": 225e-6, "width": 28e-6, "thickness": 3e-6}
AIR, WATER = (1.18, 1.86e-5), (997.0, 8.59e-4)


def in_fluid(n, fluid):
    free = beam.vacuum_mode(n, **SILICON)
    return beam.fluid_mode(free.frequency, 2330.0, 28e-6, 3e-6, *fluid)


@pytest.mark.parametrize("n", [1, 2, 3, 6, 10, 40])
def test_wavenumbers_solve_the_equation_of_the_free_end(n):
    kappa = beam.wavenumber(n)
    # the slope of cos + 1/cosh is about one, so this is the error of kappa itself: some rounding of 2n pi
    assert math.cos(kappa) + 1 / math.cosh(kappa) == pytest.approx(0.0, abs=4e-16 * max(kappa, 4))


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_every_mode_moves_a_quarter_of_the_mass(n):
    mode = beam.vacuum_mode(n, **SILICON)
    mass = mode.stiffness / (2 * math.pi * mode.frequency) ** 2
    assert mass == pytest.approx(2330 * 225e-6 * 28e-6 * 3e-6 / 4, rel=1e-14)


def test_end_slope_is_that_of_the_mode_shape():
    kappa = beam.wavenumber(2)
    sigma = (math.cosh(kappa) + math.cos(kappa)) / (math.sinh(kappa) + math.sin(kappa))

    def shape(x):
        return math.cosh(x) - math.cos(x) - sigma * (math.sinh(x) - math.sin(x))

    h = 1e-5  # central difference: error h^2, some 1e-10
    slope = (shape(kappa * (1 + h)) - shape(kappa * (1 - h))) / (2 * h) / shape(kappa)
    assert beam.end_slope(2) == pytest.approx(slope, rel=1e-8)


def test_hydrodynamic_function_stays_finite_at_extreme_reynolds_numbers():
    for reynolds in (1e-6, 1e8):
        value = beam.hydrodynamic_function(reynolds)
        assert math.isfinite(value.real)
        assert math.isfinite(value.imag)


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
