"""The flow around a beam: free, near a wall, and what it makes of a lever; and what users type of one."""

import cmath
import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad

import dforce as df
from dforce.core.errors import ParameterError
from dforce.instrument import beam, fluid

WATER = {"density": 997.0, "viscosity": 8.59e-4}
SIZES = {"youngs_modulus": 169e9, "density": 2330.0, "length": 225e-6, "width": 28e-6, "thickness": 3e-6}
ARGUMENTS = (2330.0, 28e-6, 3e-6, 997.0, 8.59e-4)


# of a thin blade, by another solution, which is good to some 1e-8 (3e-8 at Re = 1000)
BLADE = {
    0.1: 10.48494809247 + 21.82692995651j, 1.0: 3.733874504091 + 4.074672667376j,
    10.0: 1.918340098891 + 0.981709691692j, 100.0: 1.326333554963 + 0.296143032935j,
    1000.0: 1.11745895557 + 0.10068760476j,
}  # fmt: skip


@pytest.mark.parametrize(
    ("reynolds", "real", "imaginary"),
    [(0.1, 4e-5, 9e-5), (1.0, 9e-5, 9e-5), (10.0, 9e-5, 9e-5), (100.0, 1.4e-4, 1.4e-4)],
)
def test_published_fit_is_within_its_error_of_the_blade(reynolds, real, imaginary):
    fit, exact = beam.hydrodynamic_function(reynolds), BLADE[reynolds]
    assert abs(fit.real / exact.real - 1.0) < real
    assert abs(fit.imag / exact.imag - 1.0) < imaginary
    assert abs(beam.hydrodynamic_function(1000.0).imag / BLADE[1000.0].imag - 1.0) == pytest.approx(7.6e-4, abs=1e-5)


@pytest.mark.parametrize(("n", "ratio", "digits"), [(1, 0.99999503, 1e-7), (2, 1.00002, 1e-6)])
def test_thermal_motion_in_the_fluid_keeps_equipartition(n, ratio, digits):
    free = beam.vacuum_mode(n, 169e9, 2330.0, 225e-6, 28e-6, 3e-6)
    load = math.pi * 997.0 * 28e-6 / (4.0 * 2330.0 * 3e-6)

    def weight(log):
        r = math.exp(log)
        gamma = beam.hydrodynamic_function(beam.reynolds_number(r * free.frequency, 28e-6, 997.0, 8.59e-4))
        return 2.0 / math.pi * (1.0 / (1.0 - r * r * (1.0 + load * gamma))).imag

    places = (-14.0, -3.0, -1.0, 0.5, 9.0)
    parts = [quad(weight, *ends, limit=400, epsabs=1e-12, epsrel=1e-10)[0] for ends in itertools.pairwise(places)]
    assert sum(parts) == pytest.approx(ratio, abs=digits)


def test_exact_beam_and_one_mode_differ_away_from_resonance_as_advice_says():
    E, rho, L, b, h = SIZES.values()
    free = beam.vacuum_mode(1, E, rho, L, b, h)
    wet = beam.fluid_mode(free.frequency, rho, b, h, 997.0, 8.59e-4)
    load, inertia = math.pi * 997.0 * b / (4.0 * rho * h), b * h**3 / 12.0

    def response(f):
        gamma = beam.hydrodynamic_function(beam.reynolds_number(f, b, 997.0, 8.59e-4))
        q = ((2.0 * math.pi * f) ** 2 * L**4 * rho * b * h * (1.0 + load * gamma) / (E * inertia)) ** 0.25
        top = cmath.sin(q) * cmath.cosh(q) - cmath.cos(q) * cmath.sinh(q)
        return (L**3 / (E * inertia) * top / (q**3 * (1.0 + cmath.cos(q) * cmath.cosh(q)))).conjugate()

    assert response(wet.frequency) == pytest.approx(0.01068691267 - 1.456271227j, rel=1e-8)
    assert response(0.5 * wet.frequency) == pytest.approx(0.4802774088 - 0.05490973932j, rel=1e-8)


@pytest.mark.parametrize(
    ("reynolds", "gap", "gamma", "digits"),
    [
        (1.0, 0.5, 2.811534910565 + 14.50305331941j, 1e-9), (10.0, 0.1, 3.19676157965 + 46.71044093846j, 1e-9),
        (10.0, 0.5, 2.02636249166 + 1.83237967054j, 1e-9), (10.0, 1.0, 1.975683984025 + 1.136509844658j, 1e-9),
        (100.0, 0.2, 1.968975092038 + 1.084109324609j, 1e-9),
        (50.0, 0.5, 1.638268807587 + 0.602350866833j, 2e-4),  # between the places of the table
    ],
)  # fmt: skip
def test_flow_near_a_wall_has_its_values(reynolds, gap, gamma, digits):
    found = fluid.near_wall(reynolds, gap)
    assert found.real == pytest.approx(gamma.real, rel=digits)
    assert found.imag == pytest.approx(gamma.imag, rel=digits)


def test_flow_far_from_the_wall_is_that_without_one_and_continuous():
    assert fluid.near_wall(10.0, 1e4) == pytest.approx(BLADE[10.0], rel=1e-6)
    assert fluid.near_wall(10.0, 10.0 + 1e-9) == pytest.approx(fluid.near_wall(10.0, 10.0 - 1e-9), rel=1e-8)


def test_nearest_flow_approaches_that_of_lubrication():
    # (b/g)^3 / (pi Re) (1 + 3.9 H), the end of a slow squeeze
    found, H = fluid.near_wall(0.01, 0.05), 0.05
    assert found.imag * math.pi * 0.01 * H**3 == pytest.approx(1.2060997, abs=5e-8)
    assert found.imag * math.pi * 0.01 * H**3 == pytest.approx(1.0 + 3.9 * H, rel=0.02)


def test_shape_of_a_mode_is_one_at_the_end_and_orthogonal_to_others():
    nodes, weights = np.polynomial.legendre.leggauss(60)
    x = 0.5 * (nodes + 1.0)
    shapes = np.array([beam.shape(n, x) for n in range(1, 6)])
    assert [float(beam.shape(n, 1.0)) for n in range(1, 6)] == pytest.approx([1.0] * 5, rel=1e-12)
    assert (shapes * weights * 0.5) @ shapes.T == pytest.approx(np.eye(5) / 4.0, abs=1e-10)
    assert 0.5 * weights @ shapes.T / 0.25 == pytest.approx([beam.base_coupling(n) for n in range(1, 6)], rel=1e-9)


def test_lever_far_above_a_wall_is_the_free_one_and_slows_down_near_it():
    free = beam.vacuum_mode(1, *SIZES.values())
    far = fluid.mode_near_wall(1, free.frequency, *ARGUMENTS, fluid.Wall(0.1, 0.0, 225e-6))
    alone = beam.fluid_mode(free.frequency, *ARGUMENTS)
    assert far.frequency == pytest.approx(alone.frequency, rel=3e-4)  # the table's spline, and the fit
    assert pytest.approx(alone.Q, rel=3e-4) == far.Q
    near = [
        fluid.mode_near_wall(1, free.frequency, *ARGUMENTS, fluid.Wall(h, math.radians(11.0), 225e-6))
        for h in (30e-6, 10e-6, 3e-6)
    ]
    assert alone.Q > near[0].Q > near[1].Q > near[2].Q
    assert alone.frequency > near[0].frequency > near[1].frequency


def test_case_takes_the_wall_from_the_height_of_the_tip():
    def mode(**more):
        return df.Case(cantilever={"beam": SIZES | more}, drive={"A0": "10 nm"}, medium="water").problem.modes[0]

    free = beam.vacuum_mode(1, *SIZES.values())
    medium = df.Medium(name="water")
    wet = fluid.mode_near_wall(
        1,
        free.frequency,
        2330.0,
        28e-6,
        3e-6,
        medium.density,
        medium.viscosity,
        fluid.Wall(15e-6, math.radians(11.0), 225e-6),
    )
    found = mode(tip_height="15 um", tilt="11 deg")
    assert (found.f0, found.Q, found.added_mass) == (wet.frequency, wet.Q, wet.added_mass)
    assert found.Q < mode().Q
    with pytest.raises(ParameterError, match=r"mode 1 of cantilever.beam at tip_height: the gap is 0.0357 widths"):
        mode(tip_height="1 um")
    with pytest.raises(ParameterError, match="the known range of the flow at a wall"):
        mode(tip_height="15 um", width="200 um", length="1 mm", thickness="20 um")


@pytest.mark.parametrize(
    ("beam", "A0", "zc", "refused"),
    [
        ({"tip_height": "5 um"}, "10 nm", "4.98 um", False), ({"tip_height": "5 um"}, "10 nm", "5 um", True),
        ({"tip_height": "5 um"}, "4 um", "1.5 um", True), ({}, "6 um", "9 um", False),
        ({"tip_height": "5 um", "wall": "at_distance"}, "10 nm", "9 um", False),
        ({"tip_height": "5 um", "wall": "at_distance"}, "6 um", "9 um", True),
    ],
)  # fmt: skip
def test_tip_that_is_no_higher_than_its_motion_is_refused(beam, A0, zc, refused):
    def build(experiment):
        return df.Case(cantilever={"beam": SIZES | beam}, drive={"A0": A0}, medium="water", experiment=experiment)

    for experiment in (
        {"kind": "dwell", "zc": zc},
        {"kind": "approach", "zc": {"start": zc, "stop": "0 nm", "points": 3}},
    ):
        if refused:
            with pytest.raises(ParameterError, match=r"tip_height = 5 um is not above the path of the tip"):
                build(experiment)
        else:
            build(experiment)


def test_tilted_lever_is_stiffer_across_the_sample():
    upright = {"f0": 75e3, "k": 2.8, "Q": 100}
    found = df.Case(cantilever=upright | {"tilt": "11 deg"}, drive={"A0": "10 nm"}).problem.modes[0]
    assert found.k == pytest.approx(2.8 / math.cos(math.radians(11.0)) ** 2, rel=1e-14)
    assert found.k / 2.8 == pytest.approx(1.0378, abs=1e-4)
    with pytest.raises(ParameterError, match="for a beam write"):
        df.Case(cantilever={"beam": SIZES, "tilt": "11 deg"}, drive={"A0": "10 nm"}, medium="water")


@pytest.mark.parametrize(
    ("readout", "moves", "reads"),
    [
        ({}, 30e-9 / 0.917670323115, 30e-9 / 0.917670323115),  # 1.09 for the first mode
        ({"kind": "optical_lever"}, 30e-9 / 0.917670323115, 30e-9),
        ({"kind": "optical_lever", "calibrated": "each_mode"}, 30e-9 / 0.917670323115, 30e-9 / 0.917670323115),
    ],
)
def test_amplitude_in_volts_is_what_the_detector_shows(readout, moves, reads):
    lever = {"f0": 75e3, "k": 2.8, "Q": 100}
    case = df.Case(cantilever=lever, drive={"A0": "0.5 V"}, readout={"invols": "60 nm/V"} | readout)
    assert abs(case.problem.free[0, 0]) == pytest.approx(moves, rel=1e-11)
    assert abs(case.problem.detected_free[0]) == pytest.approx(reads, rel=1e-11)
    assert df.Case.from_toml(case.to_toml()) == case


def test_volts_of_two_tones_take_the_sensitivity_of_each_mode_and_need_one():
    modes = [{"f0": 75e3, "k": 2.8, "Q": 100}, {"f0": 470e3, "k": 110, "Q": 300}]
    drive = {"tones": [{"A0": "0.5 V"}, {"A0": "20 mV"}]}
    case = df.Case(cantilever={"modes": modes}, drive=drive, readout={"invols": "60 nm/V"})
    assert [tone.A0 for tone in case.drive.tones] == pytest.approx(
        [30e-9 / 0.917670323115, 1.2e-9 / 3.187185606808], rel=1e-11
    )
    with pytest.raises(ParameterError, match=r"drive.tones.1.A0 is in volts: also write the sensitivity"):
        df.Case(cantilever={"modes": modes}, drive=drive)
