"""Viscoelastic contacts: Lee and Radok, Ting, memory between taps, and the limits known in closed form."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import dawsn

from dforce.checks.battery import follow
from dforce.core.errors import ParameterError
from dforce.forces import SLS, GeneralizedMaxwell, Hertz, KelvinVoigt, PowerLaw, SLSSimple

from .conftest import A0, same

RADIUS, E0, E_INF, TAU = 20e-9, 1e9, 0.1e9, 1e-5
SPEED, TURN = 1e-3, 5e-6
# the references are for plane-strain moduli, which Young's moduli are at a Poisson ratio of zero
PLANE = {"tip__radius": RADIUS, "sample__poisson_ratio": 0.0}
SOLID = {"instant_modulus": E0, "relaxed_modulus": E_INF, "relaxation_time": TAU}
TING = {0.5: 2.1592379033e-8, 1.0: 5.6206544045e-8, 1.1: 4.4270280957e-8, 1.25: 2.8448247239e-8, 1.4: 1.5312826869e-8}
DETACHED, TAKEN = 1.6974909030, 4.043533e-17


def triangle(t):
    """Down at constant speed, then up at the same."""
    depth, rate = (SPEED * t, -SPEED) if t <= TURN else (SPEED * (2.0 * TURN - t), SPEED)
    return A0 - depth, rate


def press(force, motion=triangle, stop=2.0 * TURN, steps=2000):
    # the speed jumps at the turn, so the step after it begins just after it
    times = np.union1d(np.linspace(0.0, stop, steps + 1), [np.nextafter(TURN, 1.0)] if stop > TURN else [])
    return follow(force, motion, times, compiled=True)


def at_times(answer, shares):
    return np.interp([share * TURN for share in shares], answer.time, answer.force)


@pytest.fixture(scope="module")
def fine():
    """Return the answers of a standard linear solid of 100 and of 200 elements to the triangle."""
    answers = []
    for elements in (100, 200):
        force = SLS(**SOLID, elements=elements, max_indentation=SPEED * TURN)
        values = {"tip.radius": RADIUS, "sample.poisson_ratio": 0.0, "contact.a0": A0}
        answers.append(press(force.bind(values)))
    return answers


def test_sls_detaches_with_ting_and_never_pulls(fine):
    for answer in fine:
        assert answer.force.min() >= 0.0
        last = answer.time[answer.force > 0.0][-1]
        assert last == pytest.approx(DETACHED * TURN, abs=1.1 * 2.0 * TURN / 2000)


def test_default_elements_are_good_to_a_thousandth(bound):
    answer = press(bound(SLS(**SOLID), **PLANE))
    assert at_times(answer, TING) == pytest.approx(list(TING.values()), rel=1e-3)
    assert answer.energy[-1] == same(TAKEN, 1e-3)


def test_sls_while_loading_is_lee_radok_in_closed_form(bound):
    force = bound(SLS(**SOLID, elements=200, max_indentation=SPEED * TURN), **PLANE)
    answer = press(force, stop=TURN)
    t = answer.time[1:]
    delayed = TAU * np.sqrt(t) - TAU**1.5 * dawsn(np.sqrt(t / TAU))
    expected = 4.0 / 3.0 * math.sqrt(RADIUS) * (E_INF * (SPEED * t) ** 1.5 + 0.9e9 * 1.5 * SPEED**1.5 * delayed)
    # few elements touch at first
    assert answer.force[1:] == pytest.approx(expected, rel=1e-5, abs=1e-5 * expected[-1])


def test_simple_sls_is_exact_while_loading_and_close_after(bound):
    answer = press(bound(SLSSimple(**SOLID), **PLANE))
    assert at_times(answer, [0.5, 1.0]) == pytest.approx([TING[0.5], TING[1.0]], rel=1e-8)
    assert at_times(answer, [1.4])[0] == same(1.4673535878e-8, 1e-8)
    assert answer.force.min() >= 0.0


def test_simple_sls_surface_recovers_as_stated(bound):
    force = bound(SLSSimple(**SOLID), **PLANE)
    share = 1.0 - E_INF / E0
    start = (1e-9) ** 1.5 / share
    change = np.zeros(1)
    force.evolve(1e-8, 0.0, 0.0, np.array([start]), change, *force.values())
    # u^1.5 is share times the state, so du/dt = 2/3 u times the relative rate
    assert 2.0 / 3.0 * 1e-9 * change[0] / start == same(-2.0 / 3.0 * E_INF / E0 * 1e-9 / TAU)


@pytest.mark.parametrize("model", [SLS, SLSSimple])
def test_equal_moduli_are_hertz(bound, at, model):
    force = bound(model(instant_modulus=1e9, relaxed_modulus=1e9), **PLANE)
    answer = press(force, steps=100)
    hertz = [at(Hertz(), d, tip__radius=RADIUS, contact__E_eff=1e9) for d in answer.distance]
    assert answer.force == pytest.approx(hertz, rel=1e-12, abs=1e-12 * max(hertz))


@pytest.mark.parametrize("model", [SLS, SLSSimple])
@pytest.mark.parametrize(("tau", "modulus", "error"), [(1e-8, E_INF, 0.03), (1.0, E0, 1e-4)])
def test_fast_and_slow_relaxation_are_hertz_at_both_ends(bound, at, model, tau, modulus, error):
    force = bound(model(**{**SOLID, "relaxation_time": tau}), **PLANE)
    answer = press(force, steps=4000)
    loading = answer.time <= TURN
    hertz = [at(Hertz(), d, tip__radius=RADIUS, contact__E_eff=modulus) for d in answer.distance[loading]]
    # what is left is the relaxation time over the time of the motion, times the ratio of the moduli
    assert answer.force[loading] == pytest.approx(hertz, rel=error, abs=error * max(hertz))


@pytest.mark.parametrize(
    ("model", "options", "error"),
    [
        (SLSSimple, {}, 1e-4),
        # the pressure ends in a step at the edge of the contact, which falls between two of some 180 elements
        (SLS, {"elements": 200, "max_indentation": 1.5e-9}, 5e-3),
    ],
)
@pytest.mark.slow
def test_a_stiff_and_fast_arm_is_kelvin_voigt(bound, at, model, options, error):
    # E_0 to infinity with the arm's viscosity fixed; 2 eta* is the coefficient of kelvin_voigt
    viscosity, relaxed, stiff = 50.0, 1e9, 2e11
    moduli = {"instant_modulus": stiff, "relaxed_modulus": relaxed}
    force = bound(model(**moduli, relaxation_time=viscosity / (stiff - relaxed), **options), **PLANE)

    def motion(t):
        omega = 2.0 * math.pi * 1e5
        return A0 - 1e-9 * math.sin(omega * t), -1e-9 * omega * math.cos(omega * t)

    answer = press(force, motion, stop=4e-6, steps=20_000)
    expected = [
        at(Hertz(), d, tip__radius=RADIUS, contact__E_eff=relaxed)
        + at(KelvinVoigt(viscosity=2.0 * viscosity), d, rate, tip__radius=RADIUS)
        for d, rate in map(motion, answer.time[::100])
    ]
    # at the first touch the arm has not yet relaxed
    assert answer.force[::100] == pytest.approx(expected, abs=error * max(expected))


def test_second_tap_meets_a_surface_that_has_not_recovered(bound):
    def taps(pause):
        period = 2.0 * TURN + pause

        def motion(t):
            return triangle(t % period) if t % period <= 2.0 * TURN else (A0 + 1e-12, 0.0)

        tap = np.linspace(0.0, 2.0 * TURN, 501)
        rest = np.linspace(2.0 * TURN, period, 501)
        times = np.union1d(np.union1d(tap, rest), period + tap[tap <= TURN])
        return follow(bound(SLS(**SOLID), **PLANE), motion, times, compiled=True)

    soon, late = taps(1e-6), taps(3e-3)  # the surface recovers with the time tau E_0/E_inf = 100 us
    first = soon.force[soon.time <= 2.0 * TURN].max()
    again = soon.force[soon.time > 2.0 * TURN].max()
    recovered = late.force[late.time > 1e-3].max()
    assert again < 0.9 * first
    assert recovered == same(late.force[late.time <= 2.0 * TURN].max(), 0.01)


def test_contact_after_an_incomplete_recovery_begins_at_the_surface_as_it_is(bound):
    force = bound(SLS(**SOLID, elements=100, max_indentation=SPEED * TURN), **PLANE)

    def motion(t):
        if t <= 2.0 * TURN:
            return triangle(t)
        return A0 - SPEED * (t - 2.0 * TURN), -SPEED

    answer = press(force, motion, stop=4.0 * TURN, steps=4000)
    touched = answer.time[(answer.time > 2.0 * TURN) & (answer.force > 0.0)][0]
    depth_left = 2.0 * TURN * (DETACHED / 2.0) - TURN  # time from the turn to detachment
    height = SPEED * (TURN - depth_left)
    recovering = math.exp(-E_INF / E0 / TAU * (touched - DETACHED * TURN))
    # the middle of the surface, where the tip leaves last, recovers exponentially from there
    assert SPEED * (touched - 2.0 * TURN) == pytest.approx(height * recovering, rel=5e-3)


def test_one_arm_of_generalized_maxwell_is_the_standard_linear_solid(bound):
    one = GeneralizedMaxwell(relaxed_modulus=E_INF, arm_moduli=[E0 - E_INF], arm_times=[TAU])
    expected = press(bound(SLS(**SOLID), **PLANE), steps=300)
    found = press(bound(one, **PLANE), steps=300)
    assert found.force == pytest.approx(expected.force, rel=1e-12)


def test_arms_of_generalized_maxwell_add_up_while_loading(bound):
    force = GeneralizedMaxwell(
        relaxed_modulus=E_INF, arm_moduli=[0.5e9, 0.4e9], arm_times=[2e-6, 2e-5], elements=200, max_indentation=5e-9
    )
    answer = press(bound(force, **PLANE), stop=TURN)

    def modulus(age):
        return E_INF + 0.5e9 * math.exp(-age / 2e-6) + 0.4e9 * math.exp(-age / 2e-5)

    expected = (
        2.0
        * math.sqrt(RADIUS)
        * SPEED**1.5
        * quad(lambda s: modulus(TURN * (1.0 - s)) * TURN**1.5 * math.sqrt(s), 0.0, 1.0, epsrel=1e-10)[0]
    )
    assert answer.force[-1] == same(expected, 3e-5)


def test_arms_of_the_power_law_add_up_to_it():
    model = PowerLaw(modulus_at_reference=1e6, reference_time=1e-3, exponent=0.2)
    for age in np.geomspace(3e-7, 1e-3, 30):
        modulus = model.equilibrium() + sum(arm * math.exp(-age / time) for arm, time in model.arms())
        assert modulus == same(1e6 * (age / 1e-3) ** -0.2, 0.01)


@pytest.mark.slow
def test_power_law_creep_of_the_contact_follows_its_exponent(bound):
    force = bound(PowerLaw(modulus_at_reference=1e6, reference_time=1e-3, exponent=0.2, longest_time=0.1), **PLANE)

    def step(t):
        return A0 - 2e-9, 0.0

    early, late = (press(force, step, stop=stop, steps=4000).force[-1] for stop in (1e-5, 1e-4))
    assert math.log10(late / early) == pytest.approx(-0.2, abs=2e-3)


def test_poissons_ratio_turns_youngs_modulus_into_plane_strain(bound):
    soft, stiff = (
        press(bound(SLS(**SOLID), tip__radius=RADIUS, sample__poisson_ratio=nu), steps=200).force for nu in (0.0, 0.5)
    )
    assert stiff == pytest.approx(soft / 0.75, rel=1e-12)


def test_tip_goes_on_as_a_cylinder_beyond_its_elements(bound):
    force = bound(SLS(instant_modulus=1e9, relaxed_modulus=1e9, max_indentation="1 nm"), **PLANE)
    rest = np.zeros(force.memory)
    deep, deeper = (force.law(A0 - depth, 0.0, 0.0, rest, *force.values()) for depth in (2e-9, 3e-9))
    assert deeper - deep == same(2.0 * 1e9 * math.sqrt(RADIUS * 1e-9) * 1e-9)


@pytest.mark.parametrize("model", [SLS, SLSSimple])
def test_a_solid_that_stiffens_as_it_relaxes_is_refused(model):
    with pytest.raises(ParameterError, match="can only relax"):
        model(instant_modulus=1e6, relaxed_modulus=2e6)


def test_arms_must_come_in_pairs():
    with pytest.raises(ParameterError, match="2 arm_moduli and 1 arm_times"):
        GeneralizedMaxwell(arm_moduli=["1 MPa", "2 MPa"], arm_times=["1 us"])
