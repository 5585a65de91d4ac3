"""JKR, Maugis–Dugdale and hysteretic adhesion: branches, Tabor limits, loss over a cycle.

Published values are held by tests/regression.
"""

import math

import numpy as np
import pytest

from dforce.checks.battery import follow
from dforce.core.errors import ParameterError
from dforce.forces import DMT, JKR, AdhesionHysteresis, MaugisDugdale
from dforce.forces.jkr import DEPTH_PULL_OFF, Q_PULL_OFF, contact_size
from dforce.forces.maugis_dugdale import contact

from .conftest import A0, same

BLUNT = {"tip__radius": 20e-9, "contact__E_eff": 1e9 / 0.91}


@pytest.fixture
def jkr(bound):
    return bound(JKR(surface_energy=0.05), **BLUNT)


def on_branch(force, depth):
    return force.law(A0 - depth, 0.0, 0.0, 1.0, *force.values())


def slow(zc, amplitude):
    """Return a motion from far away and back in one second."""
    return lambda t: (
        zc + amplitude * math.cos(2.0 * math.pi * t),
        -2.0 * math.pi * amplitude * math.sin(2.0 * math.pi * t),
    )


def test_jkr_pulls_hardest_at_its_unit_of_length_and_comes_off_at_the_end_of_the_branch(jkr):
    depths = np.linspace(-2.0, 1.0, 3001) * jkr.length
    forces = [on_branch(jkr, depth) for depth in depths]
    assert min(forces) == same(-9.42477796077e-9)
    assert depths[int(np.argmin(forces))] == same(-jkr.length, 1e-3)  # the grid's step
    pull_off = 8.83484169187e-10
    for step, sign in ((-1e-6, -1.0), (1e-6, 1.0)):
        let_go = jkr.switch(1.0, A0 + pull_off * (1.0 + step), 0.0, 0.0, *jkr.values())
        assert math.copysign(1.0, let_go) == sign
    # the branch ends like a square root, so 12 digits of the distance are 6 of the force
    assert on_branch(jkr, -pull_off) == same(-5.23598775598e-9, 3e-6)


def test_the_contact_of_jkr_solves_its_equation_at_every_depth():
    for depth in (*(DEPTH_PULL_OFF * (1.0 - np.geomspace(1e-12, 0.99, 50))), *np.geomspace(1e-6, 1e9, 200)):
        q = contact_size(depth)
        assert q >= Q_PULL_OFF
        # the start leaves most, 1.4e-15 of q, at depths of 1e5 units; rounding leaves some 4e-16
        assert 3.0 * q**4 - 4.0 * q == pytest.approx(
            depth, abs=(2e-15 if depth > 1e4 else 5e-16) * (12.0 * q**4 + 4.0 * q)
        )
    assert contact_size(DEPTH_PULL_OFF) == contact_size(-10.0) == Q_PULL_OFF


def test_jkr_holds_on_beyond_first_contact_and_lets_go_beyond_pull_off(jkr):
    answer = follow(jkr, slow(4e-9, 6e-9), np.linspace(0.0, 1.0, 1001))
    coming, going = answer.distance[:500], answer.distance[501:]
    assert coming[answer.latched[:500] > 0.5].max() <= A0
    assert going[answer.latched[501:] > 0.5].max() == pytest.approx(A0 + 8.83484169187e-10, abs=4e-11)
    assert answer.force[answer.latched < 0.5].tolist() == [0.0] * int(np.sum(answer.latched < 0.5))


def test_jkr_attraction_outside_is_never_more_than_in_first_contact(bound):
    force = bound(JKR(surface_energy=0.05, hamaker=1e-17), **BLUNT)
    near = force.law(1.001 * A0, 0.0, 0.0, 0.0, *force.values())
    assert near == same(on_branch(force, 0.0))
    assert force.law(10e-9, 0.0, 0.0, 0.0, *force.values()) == same(-1e-17 * 20e-9 / (6.0 * 10e-9**2))


@pytest.mark.parametrize("surface_energy", [1e-4, 5e-3, 0.05, 0.5])
def test_maugis_dugdale_force_is_that_of_its_equations(bound, surface_energy):
    force = bound(MaugisDugdale(surface_energy=surface_energy), **BLUNT)
    last = math.inf
    for spread in np.linspace(-4.0, 3.0, 15):
        _, expected, depth = (float(value) for value in contact(spread, force.transition))
        if depth > last:
            break  # past pull-off, where the branch turns back
        last = depth
        assert on_branch(force, depth * force.length) == pytest.approx(
            force.strength * expected, rel=5e-5, abs=5e-5 * force.strength
        )


def test_maugis_dugdale_meets_jkr_for_soft_samples(bound):
    soft = {"tip__radius": 20e-9, "contact__E_eff": 1e6}
    jkr = bound(JKR(surface_energy=0.05), **soft)
    force = bound(MaugisDugdale(surface_energy=0.05), **soft)
    assert force.transition > 50.0
    for depth in np.linspace(-1.9, 10.0, 30) * jkr.length:
        # the next order in 1/lambda
        assert on_branch(force, depth) == pytest.approx(on_branch(jkr, depth), abs=0.02 * jkr.strength)


@pytest.mark.parametrize("modulus", [1e11, 1e12, 1e13])
def test_maugis_dugdale_meets_dmt_for_stiff_samples(bound, modulus):
    stiff = {"tip__radius": 2e-9, "contact__E_eff": modulus}
    dmt = bound(DMT(surface_energy=0.005), **stiff)
    force = bound(MaugisDugdale(surface_energy=0.005), **stiff)
    # the ring of adhesion presses the surface down by the root of the transition parameter
    nearness = math.sqrt(force.transition)
    adhesion = 4.0 * math.pi * 2e-9 * 0.005
    for depth in np.linspace(0.0, 2.0, 30) * force.length:
        expected = dmt.law(A0 - depth, 0.0, 0.0, *dmt.values())
        assert on_branch(force, depth) == pytest.approx(expected, abs=2.0 * nearness * adhesion)
    assert -force.pull_off < 2.0 * nearness * force.length
    for d in (1.01 * A0, 1e-9):
        outside = force.law(d, 0.0, 0.0, 0.0, *force.values())
        assert outside == pytest.approx(dmt.law(d, 0.0, 0.0, *dmt.values()), abs=2.0 * nearness * adhesion)


def test_maugis_dugdale_loses_ever_less_towards_dmt(bound):
    shares = []
    for modulus in (1e7, 1e9, 1e11, 1e13):
        stiff = {"tip__radius": 2e-9, "contact__E_eff": modulus}
        force = bound(MaugisDugdale(surface_energy=0.005), **stiff)
        energy = follow(force, slow(8e-9, 8e-9), np.linspace(0.0, 1.0, 2001)).energy[-1]
        shares.append(energy / (force.strength * A0))
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] < 0.02


def test_adhesion_hysteresis_outside_contact_adds_its_own_loss(bound):
    force = bound(AdhesionHysteresis(approach_energy=0.02, retract_energy=0.03), tip__radius=10e-9)
    energy = follow(force, slow(A0 + 2e-9, 3e-9), np.linspace(0.0, 1.0, 8001)).energy[-1]
    inside = 4.0 * math.pi * 10e-9 * 0.01 * 1e-9
    outside = 4.0 * math.pi * 10e-9 * 0.01 * A0**2 * (1.0 / A0 - 1.0 / (A0 + 5e-9))
    assert energy == same(inside + outside, 1e-6)  # Simpson's rule over the kink at a0


def test_adhesion_hysteresis_that_gives_energy_is_refused(bound):
    with pytest.raises(ParameterError, match=r"retract_energy = 0\.01 J/m\^2 is below"):
        bound(AdhesionHysteresis(approach_energy=0.02, retract_energy=0.01))
