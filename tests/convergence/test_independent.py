"""All integrators against SciPy's DOP853 on the tip equation written a second time, on random cases."""

import math

import numpy as np
import pytest
from compiled import INTEGRATORS, with_amplitudes
from hypothesis import given, settings
from hypothesis import strategies as st

import dforce as df
from dforce.checks.validation.tip_equation import Region, TipEquation, attraction_that_stops, dmt_with_drag, hertz, jkr
from dforce.problem import Instrument, Problem

F0, K, FREE, A0, PERIODS = 5e4, 0.9, 10e-9, 0.165e-9, 6

# In units of the free amplitude, after six periods: some ten times what random cases show. Hard and sticky contacts
# multiply a difference many times in six taps.
# RK4 has 4096 points; the force's root at contact limits it (see test_order).
TIGHT = {
    "engine": ({"relative_tolerance": 1e-12}, 5e-8),
    "lsoda": ({"relative_tolerance": 1e-12}, 1e-7),
    "rk4": ({"points_per_period": 4096}, 1e-5),
}


def build(modes, tones, forces, radius, modulus, **drive):
    return Problem.build(
        Instrument(
            df.Cantilever(modes=[{"f0": f0, "k": k, "Q": Q} for f0, k, Q in modes]),
            df.Drive(tones=tones, **drive),
            df.Tip(radius=radius),
            df.Sample(youngs_modulus=modulus),
        ),
        forces=forces,
    )


def check(problem, equation, integrators=tuple(TIGHT), rtol=1e-12, slack=1.0):
    z, v, memory = equation.follow(*equation.free(), PERIODS / problem.tones[0].frequency, rtol)
    speed = FREE * 2 * math.pi * problem.tones[0].frequency
    expected = np.column_stack([z / FREE, v / speed]).ravel()
    for name in integrators:
        tight, tolerance = TIGHT[name]
        chosen = df.SolverSettings(method="transient", integrator=name, **tight)
        integrator = INTEGRATORS[name](problem, chosen, 1)
        integrator.place(equation.zc)
        motion, _ = integrator.lock_in(with_amplitudes(integrator, integrator.problem.free), PERIODS)
        assert np.array(motion.y) == pytest.approx(expected, abs=slack * tolerance), name
        if len(memory):
            assert motion.memory / equation.memory_size == pytest.approx(
                memory / equation.memory_size, abs=slack * tolerance
            ), name


def drive(modes, amplitudes, everywhere=True):
    """Return the drives that give each mode its free amplitude at its resonance."""
    force = [k * amplitude / Q for (_, k, Q), amplitude in zip(modes, amplitudes, strict=True)]
    count = range(len(modes))
    return [(modes[j][0], [force[j] * (everywhere or n == j) for n in count], 0.0) for j in count]


@settings(max_examples=5, derandomize=True, deadline=None)
@given(
    Q=st.floats(2.0, 300.0), zc=st.floats(3e-9, 9.5e-9), hamaker=st.floats(0.0, 1e-19), viscosity=st.floats(0.0, 300.0),
    log_modulus=st.floats(7.0, 9.5), log_radius=st.floats(-9.0, -7.7),
)  # fmt: skip
def test_dmt_with_viscosity(Q, zc, hamaker, viscosity, log_modulus, log_radius):
    radius, modulus, modes = 10**log_radius, 10**log_modulus, [(F0, K, Q)]
    forces = [df.forces.DMT(hamaker=hamaker), df.forces.KelvinVoigt(viscosity=viscosity)]
    law = dmt_with_drag(radius, modulus / 0.91, hamaker, viscosity, A0)
    equation = TipEquation(modes, drive(modes, [FREE]), zc, law, [Region(A0, A0)])
    check(build(modes, [{"A0": FREE}], forces, radius, modulus), equation)


@settings(max_examples=5, derandomize=True, deadline=None)
@given(
    Q=st.floats(2.0, 300.0), zc=st.floats(3e-9, 9.5e-9), hamaker=st.floats(1e-21, 1e-19),
    log_modulus=st.floats(7.0, 9.5), log_radius=st.floats(-9.0, -7.7),
)  # fmt: skip
def test_attraction_that_jumps_off_at_contact(Q, zc, hamaker, log_modulus, log_radius):
    radius, modulus, modes = 10**log_radius, 10**log_modulus, [(F0, K, Q)]
    forces = [df.forces.VanDerWaals(hamaker=hamaker, inside="off"), df.forces.Hertz()]
    law = attraction_that_stops(radius, modulus / 0.91, hamaker, A0)
    equation = TipEquation(modes, drive(modes, [FREE]), zc, law, [Region(A0, A0)])
    check(build(modes, [{"A0": FREE}], forces, radius, modulus), equation)


@settings(max_examples=5, derandomize=True, deadline=None)
@given(
    Q=st.floats(2.0, 200.0), zc=st.floats(3e-9, 9.5e-9), hamaker=st.floats(0.0, 1e-19),
    log_modulus=st.floats(7.0, 9.7), ratio=st.floats(1.5, 7.0), everywhere=st.booleans(),
)  # fmt: skip
def test_two_modes_and_tones(Q, zc, hamaker, log_modulus, ratio, everywhere):
    radius, modulus = 5e-9, 10**log_modulus
    modes = [(F0, K, Q), (ratio * F0, ratio**2 * K, 2.5 * Q)]
    law = dmt_with_drag(radius, modulus / 0.91, hamaker, 0.0, A0)
    equation = TipEquation(modes, drive(modes, [FREE, 1e-9], everywhere), zc, law, [Region(A0, A0)])
    acts_on = "all_modes" if everywhere else "own_mode"
    problem = build(
        modes, [{"A0": FREE}, {"A0": 1e-9}], [df.forces.DMT(hamaker=hamaker)], radius, modulus, acts_on=acts_on
    )
    check(problem, equation)


@pytest.mark.parametrize(("zc", "gamma"), [(6e-9, 0.02), (8.5e-9, 0.05)])
def test_jkr_with_its_jump_into_contact_and_off(zc, gamma):
    radius, modulus, modes = 10e-9, 1e8, [(F0, K, 30.0)]
    law, region = jkr(gamma, radius, modulus / 0.91, A0)
    equation = TipEquation(modes, drive(modes, [FREE]), zc, law, [region])
    problem = build(modes, [{"A0": FREE}], [df.forces.JKR(surface_energy=gamma)], radius, modulus)
    # at the end of the branch the force goes like the root of the distance to it: steps are short there for all
    check(problem, equation, ("engine", "rk4"), slack=30.0)
    assert len(equation.flips) >= 4


def test_neck_and_viscoelastic_contact_together():
    """A force with a neck and one with memory: latches, kinks and states at once.

    The states follow the library's own law here; that it is the right one is tested with the force.
    """
    radius, modes, tension, volume, on = 10e-9, [(F0, K, 30.0)], 0.05, 20e-27, 1e-9
    solid = {"instant_modulus": 5e8, "relaxed_modulus": 1e8, "relaxation_time": 3e-6, "elements": 6}
    forces = [df.forces.SLS(**solid, max_indentation=4e-9), df.forces.Capillary(
        surface_tension=tension, volume=volume, formation=on
    )]  # fmt: skip
    problem = build(modes, [{"A0": FREE}], forces, radius, 1e9)
    sample = next(force for force in problem.forces if force.name == "sls")  # a problem orders its forces itself

    def force(d, v, flags, memory):
        near = d if not flags[0] else A0
        neck = 4 * math.pi * radius * tension * (1 - near / math.sqrt(near**2 + volume / (math.pi * radius)))
        return sample.law(d, v, 0.0, memory, *sample.values()) - neck * flags[1]

    def flow(d, v, flags, memory):
        change = np.zeros(len(memory))
        sample.evolve(d, v, 0.0, memory, change, *sample.values())
        return change

    equation = TipEquation(
        modes, drive(modes, [FREE]), 6e-9, force, [Region(A0, A0), Region(on, volume ** (1 / 3))],
        memory=sample.memory, flow=flow, memory_size=sample.memory_scale,
    )  # fmt: skip
    # each element's contact is a kink of its own that only step control sees
    check(problem, equation, rtol=1e-11, slack=30.0)
    assert len(equation.flips) >= 4 * PERIODS - 4


def test_hertz_by_hand_is_the_library_s():
    bound = df.forces.Hertz().bind({"tip.radius": 2e-9, "contact.E_eff": 1e9, "contact.a0": A0})
    assert bound.law(-0.5e-9, 0.0, 0.0, *bound.values()) == pytest.approx(hertz(2e-9, 1e9, A0 + 0.5e-9), rel=1e-14)
