"""The torus of two tones: values of an independent torus balance, exact relations of each tone, and free motion."""

import functools

import numpy as np
import pytest
from tiers import some_long

import dforce as df
from dforce.engine.laws import force_over, laws_of
from dforce.findings.material import Observed, PowerContact, estimate, neglected
from dforce.solvers.torus import TONES, Held, TorusBalance, TwoToneLever, over_phases

NM, E_EFF, RIGHT = 1e-9, 1e9 / 0.91, np.pi / 2.0
HERTZ, VISCOUS = [df.forces.Hertz()], [df.forces.Hertz(), df.forces.KelvinVoigt(viscosity="100 Pa s")]
K, F0 = np.array([0.9, 28.0]), np.array([48.9e3, 282e3])
AIR, WATER = (100.0, 200.0), (2.0, 5.0)
MODES = np.eye(2)


def case(forces, radius, E_eff, Q=AIR, f0=F0):
    return df.Case(
        cantilever={"modes": [{"f0": f, "k": k, "Q": q} for f, k, q in zip(f0, K, Q, strict=True)]},
        drive={"tones": [{"A0": "5 nm"}, {"A0": "0.1 nm"}]},
        tip={"radius": radius},
        sample={"youngs_modulus": 0.91 * E_eff, "poisson_ratio": 0.3},
        forces=forces,
    )


def balance(problem, zc, held, sees=MODES):
    """Return the equations in units of 1 nm, the first mode's stiffness and angular frequency."""
    laws, numbers = laws_of(problem.forces), np.array([n for force in problem.forces for n in force.numbers()])
    speed, unit = NM * 2.0 * np.pi * F0[0], K[0] * NM
    lever = TwoToneLever(problem.modes, F0[0], K[0], np.ones((2, 2)), sees)
    return TorusBalance(
        lever, held, lambda z, v: force_over(laws, numbers, zc, zc + NM * z, speed * v) / unit, laws.rate
    )


def approached(problem, zc, held, grid, tolerance, sees=MODES):
    """Return the motion at a distance, from where the tip does not touch on."""
    last, step = None, 0.05 * NM
    for place in zc + step * np.arange(8, -1, -1):
        equations = balance(problem, place, held, sees)
        last = equations.find(last.torus if last else equations.free(grid, F0 / F0[0]), tolerance)
        assert last.mismatch <= tolerance
    return equations, last


def numbers_of(equations, found):
    """Return what the rows of the tables show, in SI."""
    torus, force = found.torus, K[0] * NM
    at_tones = 2.0 * force * found.force[TONES]
    modes = equations.lever.driven(torus.omega, torus.drive, found.force[TONES])
    read = (modes * equations.lever.sees).sum(axis=1)
    work = at_tones * NM * np.array([modes[0, 0], modes[1, 1]]).conj()
    Q = equations.lever.modes[0].Q
    return {
        "frequency shift": F0[0] * torus.omega - F0,
        "A01": abs(torus.drive[0]) * Q * NM,
        "phase": np.degrees(np.angle(torus.drive / read)),
        "drive": np.abs(torus.drive) * force,
        "z0": torus.z[0, 0].real * NM,
        "V": 0.5 * work.real,
        "E": -np.pi * work.imag,
    }


def am_fm(A1, A2):
    """Amplitude A1 (nm) at the first resonance, whose drive is then read off; amplitude A2 and 90 degrees of the second."""
    return Held(frequency=1.0, amplitude=A1), Held(amplitude=A2, phase=RIGHT)


FINE, COARSE = (4096, 32), (512, 32)
DMT = [df.forces.DMT(hamaker="2e-20 J")]
# (forces, radius, E_eff, Q, held, sees, grid; values with two units of their last digit)
ROWS = {
    "B1": (HERTZ, 20e-9, E_EFF, AIR, am_fm(4.0, 0.1), MODES, FINE, {
        ("frequency shift", 1): (1193.665, 2e-3), ("A01",): (7.351847e-9, 2e-15), ("phase", 0): (33.06728, 2e-5),
        ("drive", 1): (1.405994e-11, 2e-17), ("z0",): (3.203755e-11, 2e-17), ("V", 0): (-1.108993e-19, 2e-25),
        ("V", 1): (-1.187708e-21, 2e-27)}),
    "B10": (HERTZ, 20e-9, E_EFF, AIR, am_fm(4.0, 0.1), np.array([[1.0, 0.0], [1.0, 1.0]]), FINE, {
        ("frequency shift", 1): (1190.21, 0.02), ("A01",): (7.34304e-9, 2e-14), ("phase", 0): (33.1120, 2e-4)}),
    "B2": (HERTZ, 20e-9, E_EFF, AIR, am_fm(4.0, 0.3), MODES, COARSE, {
        ("frequency shift", 1): (1302.1, 0.2), ("A01",): (1.2220e-8, 2e-12), ("phase", 0): (19.175, 2e-3)}),
    "B4": (DMT, 2e-9, E_EFF, AIR, am_fm(4.2, 0.1), MODES, FINE, {
        ("frequency shift", 1): (667.14, 0.02), ("A01",): (4.24636e-9, 2e-14), ("phase", 0): (82.172, 2e-3),
        ("V", 0): (-1.0930e-20, 2e-24)}),
    "B5": (HERTZ, 5e-9, 50e6 / 0.91, WATER, am_fm(4.5, 0.2), MODES, FINE, {
        ("frequency shift", 1): (140.837, 2e-3), ("A01",): (4.500937e-9, 2e-15), ("phase", 0): (89.477378, 2e-6),
        ("drive", 1): (1.1195565e-9, 2e-16), ("z0",): (1.088868e-11, 2e-17)}),
    "B6": (VISCOUS, 2e-9, 50e6 / 0.91, AIR, am_fm(4.6, 0.1), MODES, FINE, {
        ("frequency shift", 1): (98.84, 0.02), ("A01",): (5.31434e-9, 2e-14), ("phase", 0): (72.192, 2e-3),
        ("E", 0): (5.979e-20, 2e-23)}),
    "B7": (HERTZ, 2e-9, E_EFF, AIR, (Held(amplitude=4.2, phase=RIGHT), Held(amplitude=0.1, phase=RIGHT)), MODES, FINE, {
        ("frequency shift", 0): (439.5042, 2e-4), ("frequency shift", 1): (892.375, 2e-3),
        ("drive", 0): (3.82213e-11, 2e-16), ("drive", 1): (1.399995e-11, 2e-17), ("z0",): (3.968914e-11, 2e-17)}),
}  # fmt: skip


# modulus by the formulas of AM-FM from the exact observables, over the true one
RATIOS = {"B1": 0.586, "B2": 0.372, "B4": 6.30, "B5": 1.034, "B6": 1.029, "B7": 0.861}


@functools.cache
def row(name):
    """Return the equations of a row and their solution."""
    forces, radius, E_eff, Q, held, sees, grid, _ = ROWS[name]
    return approached(case(forces, radius, E_eff, Q).problem, 4.0 * NM, held, grid, 1e-9, sees)


@pytest.mark.parametrize("name", some_long(ROWS, ["B10"]))
def test_torus_equals_values_of_an_independent_balance_to_two_units_of_their_last_digit(name):
    found = numbers_of(*row(name))
    for (key, *place), (value, digits) in ROWS[name][-1].items():
        assert (found[key][place[0]] if place else found[key]) == pytest.approx(value, rel=0, abs=digits), key


def observed(name):
    """Return the observables of a row."""
    equations, motion = row(name)
    found, Q = numbers_of(equations, motion), np.array(ROWS[name][3])
    A = NM * np.array([[one.amplitude] for one in ROWS[name][4]])
    f = (F0 + found["frequency shift"])[:, None]
    return Observed(K, Q, F0, f, A, found["drive"][:1], np.radians(found["phase"][:1]))


@pytest.mark.parametrize("name", RATIOS)
def test_formulas_of_am_fm_err_as_the_exact_motion_says(name):
    contact = PowerContact.paraboloid(ROWS[name][1])
    found = estimate(observed(name), contact).E_eff[0] / ROWS[name][2]
    assert found == pytest.approx(RATIOS[name], abs=0.6 * 10.0 ** -(2 if name == "B4" else 3))


@pytest.mark.parametrize(
    ("f02", "A2", "ratio"), [(282e3, 0.005, 0.6455), (6.5 * 48.9e3, 0.02, 0.909)], ids=["B0", "B0b"]
)
def test_formulas_of_am_fm_err_by_harmonics_however_small_the_second_amplitude(f02, A2, ratio):
    f0 = np.array([F0[0], f02])
    problem = case(HERTZ, 20e-9, E_EFF, f0=f0).problem
    found = numbers_of(*approached(problem, 4.0 * NM, am_fm(4.0, A2), (2048, 32), 1e-9))
    f, A = (F0 + found["frequency shift"])[:, None], NM * np.array([[4.0], [A2]])
    seen = Observed(K, np.array(AIR), f0, f, A, found["drive"][:1], np.radians(found["phase"][:1]))
    E_eff = estimate(seen, PowerContact.paraboloid(20e-9)).E_eff[0]
    assert E_eff / E_EFF == pytest.approx(ratio, abs=5e-4 if A2 > 0.01 else 5e-5)


def test_what_the_formulas_neglect_is_large_where_they_err_and_small_where_they_hold():
    shares = {}
    for name in ("B1", "B5", "B6"):
        contact = PowerContact.paraboloid(ROWS[name][1])
        seen = observed(name)
        shares[name] = neglected(seen, contact, estimate(seen, contact))
    assert shares["B1"]["harmonics"][0] > 0.05
    assert max(shares[name]["harmonics"][0] for name in ("B5", "B6")) < 0.05


def test_viscosity_of_am_fm_errs_as_the_modulus_and_the_loss_tangent_do():
    contact = PowerContact.paraboloid(2e-9)
    found = estimate(observed("B6"), contact)
    assert found.viscosity[0] / found.E_eff[0] * ROWS["B6"][2] == pytest.approx(101.2, abs=0.06)  # the law has 100 Pa s


def test_locked_tones_obey_their_virial_and_energy_relations():
    problem = case(VISCOUS, 2e-9, 50e6 / 0.91).problem
    held = Held(amplitude=4.6, phase=1.2), Held(amplitude=0.1, phase=RIGHT)
    equations, motion = approached(problem, 4.0 * NM, held, (256, 16), 1e-11)
    found, A, Q = numbers_of(equations, motion), np.array([4.6, 0.1]) * NM, np.array(AIR)
    r, phase, E = 1.0 + found["frequency shift"] / F0, np.array([1.2, RIGHT]), found["E"]
    in_phase = found["drive"] * np.cos(phase) + 2.0 * found["V"] / A
    in_quadrature = found["drive"] * np.sin(phase) - E / (np.pi * A)
    assert K * A * (1.0 - r**2) == pytest.approx(in_phase, rel=1e-6, abs=1e-9 * K[0] * A[0])
    assert K * A * r / Q == pytest.approx(in_quadrature, rel=1e-7)


def test_drives_give_the_energy_that_sample_and_medium_take():
    problem = case(VISCOUS, 2e-9, 50e6 / 0.91).problem
    equations, motion = approached(problem, 4.0 * NM, am_fm(4.6, 0.1), (256, 16), 1e-11)
    torus, lever, frequencies = motion.torus, equations.lever, motion.torus.frequencies
    sample = -np.mean(over_phases(motion.force) * torus.velocity())
    pushes = np.repeat(motion.force[None], 2, axis=0)
    pushes[:, TONES[0], TONES[1]] += 0.5 * torus.drive
    pushes[:, -1, 0] = pushes[:, 1, 0].conj()
    speeds = 1j * frequencies * lever.responses(frequencies) * pushes
    damping = [mode.k / K[0] / (mode.Q * mode.f0 / F0[0]) for mode in lever.modes]
    medium = sum(c * np.mean(over_phases(speed) ** 2) for c, speed in zip(damping, speeds, strict=True))
    given = (torus.drive * speeds[:, TONES[0], TONES[1]].sum(axis=0).conj()).real.sum()
    assert sample > 0.05 * given
    assert given == pytest.approx(sample + medium, rel=1e-9)


def test_free_tones_lock_at_the_resonances_of_their_modes():
    far = balance(
        case(HERTZ, 2e-9, E_EFF).problem, 20.0 * NM, (Held(amplitude=4.0, phase=RIGHT), Held(drive=0.02, phase=RIGHT))
    )
    found = far.find(far.free((32, 16), F0 / F0[0] * 1.001), 1e-13)
    assert found.torus.omega == pytest.approx(F0 / F0[0], rel=1e-11)
    assert found.torus.drive[0].imag == pytest.approx(4.0 / 100.0, rel=1e-9)


def test_a_tone_far_below_all_resonances_has_a_torus():
    slow = F0[0] / 50.0
    held = Held(drive=4.0, frequency=slow / F0[0]), Held(drive=0.02, phase=RIGHT)
    near = balance(case(HERTZ, 2e-9, E_EFF).problem, 3.9 * NM, held)
    found = near.find(near.free((256, 32), np.array([slow, F0[1]]) / F0[0]), 1e-9)
    assert found.torus.omega[0] == pytest.approx(slow / F0[0], rel=1e-9)
    assert found.mismatch <= 1e-9
    assert np.abs(found.force).max() > 1e-3  # the tip touches the sample


def test_a_start_too_far_away_leaves_its_mismatch_and_raises_nothing():
    near = balance(case(HERTZ, 20e-9, E_EFF).problem, 1.0 * NM, am_fm(4.0, 0.1))
    found = near.find(near.free((64, 16), F0 / F0[0]), 1e-9, most=3)
    assert not found.mismatch <= 1e-9


def test_sum_of_laws_over_points_is_that_of_the_plain_laws():
    forces = case(VISCOUS, 2e-9, E_EFF).problem.forces
    d, rate = np.array([[1e-10, 2e-10], [-1e-10, 1e-11]]), np.array([[1e-4, 1e-4], [-2e-4, 3e-4]])
    numbers = np.array([n for force in forces for n in force.numbers()])
    found = force_over(laws_of(forces), numbers, 1e-9, d, rate)
    plain = [
        sum(f.law_function()(x, v, 0.0, *f.values()) for f in forces) for x, v in zip(d.flat, rate.flat, strict=True)
    ]
    assert found.ravel() == pytest.approx(plain, rel=1e-12)
