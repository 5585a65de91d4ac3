"""Thermal motion of a lever whose fluid has memory: exact statements about the step, and fluctuation with dissipation."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from compiled import (
    RK4,
    Langevin,
    free_motion,
    linear_noise,
    linear_step,
    noise_root,
    normals,
    step_noise,
    with_amplitudes,
)
from scipy.integrate import quad
from scipy.linalg import solve_discrete_lyapunov
from scipy.optimize import minimize
from scipy.signal import welch
from tiers import some_long

import dforce as df
from dforce.instrument import beam
from dforce.instrument.noise import time_constant
from dforce.solvers import SolverSettings

SIZES = {"youngs_modulus": 169e9, "density": 2330.0, "length": 225e-6, "width": 28e-6, "thickness": 3e-6}
WATER = {"density": 997.0, "viscosity": 8.59e-4}
FLUIDS = {
    "water": WATER,
    "thick": {"density": 1100.0, "viscosity": 5e-3},
    "air": {"density": 1.18, "viscosity": 1.86e-5},
}
NOISY = {"integrator": "langevin", "points_per_period": 64}
KT = 1.380649e-23 * 298.15


def case(forces=(), modes=1, medium=WATER, solver=NOISY, **others):
    drive = {"A0": "10 nm"} | others.pop("drive", {})
    return df.Case(
        cantilever={"beam": SIZES | {"fluid": "history", "modes": modes}}, drive=drive, medium=medium,
        tip={"radius": 10e-9}, sample={"youngs_modulus": 50e6, "poisson_ratio": 0.5}, forces=list(forces),
        solver=solver, **others,
    )  # fmt: skip


def started(asked, zc, cls=Langevin):
    integrator = cls(asked.problem, asked.solver, 1)
    integrator.place(zc)
    return integrator, with_amplitudes(integrator, integrator.problem.free)


def equilibrium(mode):
    """Return the mean squares of deflection, velocity and each part of the fluid: kT over its stiffness or its mass."""
    memory = mode.memory
    mass = mode.k / (2.0 * math.pi * memory.frequency) ** 2
    parts = mass * np.array(memory.weights) / np.array(memory.rates)
    return KT / np.array([mode.k, mass, *parts])


def density(mode, frequency):
    """Return the one-sided density (m^2/Hz) that fluctuation and dissipation ask for, from the response alone."""
    return 4.0 * KT / (2.0 * math.pi * frequency) * -(1.0 / mode.stiffness(frequency)).imag


# the step


@pytest.mark.parametrize("fluid", FLUIDS)
@pytest.mark.parametrize("turns", [1.0 / 512.0, 1.0 / 64.0, 1.0 / 32.0])
def test_step_keeps_equipartition_of_lever_and_fluid(fluid, turns):
    (mode,) = case(medium=FLUIDS[fluid]).problem.modes
    h = turns / mode.f0
    wanted = equilibrium(mode)
    unit = np.sqrt(wanted)
    assert np.isfinite(unit).all()
    M, S = linear_step(mode, h) * unit / unit[:, None], step_noise(mode, h, KT) / np.outer(unit, unit)
    # as many digits as are left of a sum over the decay time, that of the slowest part of the fluid or of the lever
    assert np.abs(solve_discrete_lyapunov(M, S) - np.eye(12)).max() < 1e-10


def test_part_of_the_fluid_that_weighs_nothing_shakes_nothing():
    (mode,) = case().problem.modes
    weights = list(mode.memory.weights)
    weights[2] = weights[3] = weights[9] = 0.0
    lighter = replace(mode, memory=replace(mode.memory, weights=tuple(weights)))
    h = 1.0 / (64.0 * mode.f0)
    unit = np.sqrt(equilibrium(mode))
    M, S = linear_step(lighter, h) * unit / unit[:, None], step_noise(lighter, h, KT) / np.outer(unit, unit)
    pushed = [k for k in range(12) if k not in (4, 5, 11)]
    assert np.abs(solve_discrete_lyapunov(M, S)[np.ix_(pushed, pushed)] - np.eye(9)).max() < 1e-10


def test_density_of_the_step_is_that_of_fluctuation_and_dissipation():
    for mode in case(modes=2).problem.modes:
        h = 1.0 / (64.0 * mode.f0)
        M, S = linear_step(mode, h), step_noise(mode, h, KT)
        aliases = np.arange(-400, 401) / h
        for ratio in (0.01, 0.1, 0.5, 1.0, 1.3, 3.0, 10.0):
            f = ratio * mode.f0
            response = np.linalg.inv(np.exp(2j * math.pi * f * h) * np.eye(12) - M)[0]
            found = 2.0 * h * (response @ S @ response.conj()).real
            # a motion that is sampled shows what lies above folded down, up to 400 times the rate here: the rest is 1e-8 of it
            assert found == pytest.approx(density(mode, np.abs(f + aliases)).sum(), rel=1e-7, abs=0.0)


def test_step_in_contact_is_that_of_the_equations_and_of_order_two():
    spring = df.forces.Custom(law="-P1*(d - 20e-9)", P1=2.0)
    asked = case([spring])
    (mode,) = asked.problem.modes
    own = 2.0 * math.pi * mode.memory.frequency
    unit, stiff = np.sqrt(equilibrium(mode)), mode.k + 2.0
    off = []
    for points in (64, 128, 256):
        h = 1.0 / (points * asked.problem.tones[0].frequency)
        K = np.eye(12)
        K[1, 0] = -0.5 * h * own**2 * 2.0 / mode.k
        M, S = linear_step(mode, h), step_noise(mode, h, KT)
        # the compiled step is that one: its map of a period, by differences of motions with the same noise
        integrator, start = started(asked.replace("solver.points_per_period", points), 20e-9)
        assert integrator.points == points
        scale = np.array([integrator.scales.length, *[integrator.scales.speed] * 11])
        aside = 1e-3 * np.vstack([np.zeros(12), np.eye(12)])
        ends = np.array([integrator.lock_in(replace(start, y=tuple(start.y + one)), 1)[0].y for one in aside])
        found = (ends[1:] - ends[0]).T / 1e-3 * scale[:, None] / scale
        wanted = np.linalg.matrix_power(K @ M @ K, points)
        assert np.abs((found - wanted) * unit / unit[:, None]).max() < 1e-9
        step, noise = (K @ M @ K) * unit / unit[:, None], K @ S @ K.T / np.outer(unit, unit)
        P = solve_discrete_lyapunov(step, noise)
        off.append([P[0, 0] * stiff / mode.k - 1.0, P[1, 1] - 1.0])
    assert np.array(off[:-1]) / off[1:] == pytest.approx(4.0, rel=0.03)
    assert np.abs(off[-1]).max() < 1e-3


@pytest.mark.parametrize("modes", [1, 2])
def test_compiled_step_adds_the_noise_that_is_derived(modes):
    asked = case(modes=modes)
    integrator, start = started(asked, 50e-9)
    problem, points = asked.problem, integrator.points
    h = 1.0 / (points * problem.tones[0].frequency)
    scale = np.array([integrator.scales.length, *[integrator.scales.speed] * 11])
    places = [[2 * n, 2 * n + 1, *range(2 * modes + 10 * n, 2 * modes + 10 * (n + 1))] for n in range(modes)]
    matrices = [(linear_step(mode, h), noise_root(mode, h, KT)) for mode in problem.modes]
    apart, random, key = np.zeros(12 * modes), np.empty(12 * modes), integrator.key(problem.noise.seed)
    for step in range(points):
        normals(step, *key, random)
        for (moved, kicked), own in zip(matrices, places, strict=True):
            apart[own] = (moved @ (apart[own] * scale) + kicked @ random[own]) / scale
    found = np.array(integrator.lock_in(start, 1)[0].y) - start.y
    assert found == pytest.approx(apart, abs=1e-11)
    assert np.abs(apart).min() > 1e-6


@pytest.mark.parametrize("drive", [{}, {"excitation": "base"}, {"excitation": "base", "fluid_follows": 0.4}])
def test_driven_free_lever_has_no_error_at_any_step(drive):
    asked = case(solver=NOISY | {"points_per_period": 32}, medium=WATER | {"temperature": "1e-20 K"}, drive=drive)
    integrator, start = started(asked, 50e-9)
    motion, c = integrator.lock_in(start, 100)
    assert np.abs(np.array(motion.y) - start.y).max() < 1e-9
    found, wanted = c[-1, 0] * integrator.scales.length, asked.problem.free[0, 0] + asked.problem.base[0]
    assert abs(found / wanted - 1.0) < 1e-9


# lanes and runs


def test_many_lanes_are_the_single_runs_to_the_last_bit():
    asked = case([df.forces.DMT(hamaker=5e-21)])
    integrator, start = started(asked, 8e-9)
    lanes, c = integrator.run(integrator.lanes([start] * 200, range(200)), 3)
    assert np.unique(lanes.y[:, 11]).size == 200
    for seed in (*range(16), 100, *range(192, 200)):  # each place of a vector, and the last ones
        alone, own = started(asked.replace("noise.seed", seed), 8e-9)
        motion, single = alone.lock_in(own, 3)
        assert np.array_equal(np.array(motion.y), lanes.y[seed])
        assert np.array_equal(single, c[seed])


def test_dwell_under_noise_scatters_about_the_steady_motion():
    asked = case([df.forces.DMT(hamaker=5e-21)], drive={"excitation": "base"})
    noisy = df.dwell(asked, zc="8 nm", recorded_periods=20)
    steady = df.dwell(asked.replace("solver", {}), zc="8 nm")
    assert int(noisy.status) == 0
    assert noisy.amplitude.item() != steady.amplitude.item()
    sigma = df.noise(steady, "10 kHz").amplitude_noise.item()
    assert noisy.amplitude.item() == pytest.approx(steady.amplitude.item(), abs=5.0 * sigma)
    again = df.dwell(asked, zc="8 nm", recorded_periods=20)
    assert np.array_equal(again.deflection.values, noisy.deflection.values)


# along curves


@pytest.mark.parametrize("modes", some_long([1, 2], [2]))
def test_noise_of_the_free_lever_is_its_equilibrium(modes):
    problem = case(modes=modes, solver={}).problem
    integrator = RK4(problem, SolverSettings(), 1, 2048)
    integrator.place(1e-6)
    found = linear_noise(integrator, with_amplitudes(integrator, integrator.problem.free), 1, 1e3, 1)
    wanted = np.concatenate([equilibrium(mode)[:2] for mode in problem.modes])
    unit = np.sqrt(wanted)
    # Simpson's rule over each step leaves 1.2e-6
    assert np.abs(found.state / np.outer(unit, unit) - np.eye(2 * modes)).max() < 3e-6


@pytest.mark.parametrize(("bandwidth", "poles"), [(200.0, 1), (2e3, 1), (2e3, 2)])
def test_noise_of_the_free_lever_is_the_integral_over_its_spectrum(bandwidth, poles):
    problem = case(solver={}).problem
    (mode,), (tone,) = problem.modes, problem.tones
    integrator = RK4(problem, SolverSettings(), 1, 1024)
    integrator.place(1e-6)
    found = linear_noise(integrator, with_amplitudes(integrator, integrator.problem.free), 1, bandwidth, poles)
    pole = time_constant(bandwidth, poles)

    def seen(f):
        # both sidebands of a lock-in of so many poles
        passed = sum((1.0 + (2.0 * math.pi * (f - side * tone.frequency) * pole) ** 2) ** -poles for side in (1, -1))
        return density(mode, f) * passed

    ends = [1e-3, 1e4, *(tone.frequency + np.array([-1e4, -1e3, -1e2, 1e2, 1e3, 1e4])), 1e5, 1e6, 1e7]
    wanted = sum(quad(seen, *pair, epsabs=0.0, epsrel=1e-10, limit=400)[0] for pair in itertools.pairwise(ends))
    assert np.trace(found.quadratures[0]) / 2.0 == pytest.approx(wanted, rel=1e-6, abs=0.0)


@pytest.mark.long
def test_noise_along_a_curve_agrees_with_lanes():
    # cold, so that the noise is small against the lengths on which the force changes
    asked = case(
        [df.forces.DMT(hamaker=5e-21)], solver={"points_per_period": 256}, medium=WATER | {"temperature": "3 K"}
    )
    point = df.noise(df.dwell(asked, zc="8 nm"), "2 kHz")
    lanes = df.noisy_motion(point, seeds=100, periods=200, bandwidth="2 kHz")
    for name in ("amplitude", "phase"):
        runs = lanes[name].values[..., 0]
        squares = ((runs - runs.mean()) ** 2).mean(axis=1)
        spread = squares.std(ddof=1) / math.sqrt(len(squares))
        assert point[f"{name}_noise"].values[0] ** 2 == pytest.approx(squares.mean(), abs=3.5 * spread)


# the thermal spectrum


def test_thermal_spectrum_is_that_of_the_exact_motion_of_lever_and_fluid():
    asked = case(modes=2, solver={}, noise={"seed": 7, "detector": "100 fm/Hz^0.5"})
    found = df.thermal_spectrum(asked, duration="60 ms")
    rate, random = found.attrs["sampling_rate"], np.random.Generator(np.random.Philox(7))
    count = int(0.06 * rate)
    reading = np.zeros(count)
    for seen, mode in zip((0.917670323115, 3.187185606808), asked.problem.modes, strict=True):
        M, root = linear_step(mode, 1.0 / rate), noise_root(mode, 1.0 / rate, KT)
        y, shaken = (
            np.sqrt(equilibrium(mode)) * random.standard_normal(12),
            random.standard_normal((count, 12)) @ root.T,
        )
        for i in range(count):
            y = M @ y + shaken[i] if i else y
            reading[i] += seen * y[0]
    reading += 100e-15 * math.sqrt(0.5 * rate) * random.standard_normal(count)
    width = found["frequency"].values[0]
    wanted = welch(reading, rate, nperseg=round(rate / width), detrend="constant")[1]
    np.testing.assert_allclose(found["spectral_density"], wanted[1 : found.sizes["frequency"] + 1], rtol=1e-8)


def test_recorded_density_is_that_of_fluctuation_and_dissipation():
    asked = case(solver={})
    found = df.thermal_spectrum(asked, duration="4 s")
    (mode,) = asked.problem.modes
    f, seen = found["frequency"].values, 0.917670323115**2
    ratio = found["spectral_density"].values / (seen * density(mode, f))
    for low, high in ((0.2, 0.5), (0.5, 0.8), (0.8, 1.2), (1.2, 1.5)):
        band = (f > low * mode.f0) & (f < high * mode.f0)
        # so many times the record tells a line of the spectrum, whose windows overlap by half
        assert ratio[band].mean() == pytest.approx(1.0, abs=4.0 / math.sqrt(4.0 * (high - low) * mode.f0)), low


def test_calibrations_in_a_liquid_take_one_resonance_for_what_the_fluid_makes_of_it():
    asked = case(solver={})
    found = df.thermal_spectrum(asked, duration="10 s")
    (mode,) = asked.problem.modes
    f = np.linspace(0.6 * mode.f0, 1.4 * mode.f0, 400)
    wanted = density(mode, f)

    def unlikely(logs):  # of the density without scatter
        f0, Q, square, white = np.exp(logs)
        form = 2.0 * square / (math.pi * f0 * Q) / ((1.0 - (f / f0) ** 2) ** 2 + (f / f0 / Q) ** 2) + white
        return float(np.mean(np.log(form / wanted) + wanted / form))

    start = np.log([mode.f0, mode.Q, KT / mode.k, 0.01 * wanted.max()])
    f0, Q, square, _ = np.exp(minimize(unlikely, start, method="Nelder-Mead", options={"maxiter": 4000}).x)
    ratio, error = found.spring_constant_ratio.to_pandas(), found.spring_constant_error.item()
    assert ratio["each mode"] == pytest.approx(KT / square / mode.k, abs=3.5 * error)
    by_flow = beam.sader_stiffness(f0, Q, 225e-6, 28e-6, *WATER.values()) / (mode.k / beam.static_factor())
    # frequency and Q scatter by 1.6 times the mean square
    assert ratio["Sader"] == pytest.approx(by_flow, abs=3.5 * 1.6 * error)
    assert KT / square / mode.k == pytest.approx(1.0, abs=0.03)  # of one that calibrates so in water


# across a barrier

SOFT = df.Case(
    cantilever={"beam": SIZES | {"thickness": 1.4e-6, "fluid": "history"}}, drive={"A0": "0.1 pm"}, tip={"radius": 20e-9},
    medium={"density": 1000.0, "viscosity": 3e-3}, forces=[df.forces.VanDerWaals(hamaker=4e-20)],
    solver=NOISY | {"points_per_period": 128},
)  # fmt: skip


def test_rate_across_a_barrier_is_that_of_lever_and_fluid_together():
    constant = df.snap_in_rate(SOFT.replace("cantilever.beam.fluid", "constant"), "1.6 nm")
    found = df.snap_in_rate(SOFT, "1.6 nm")
    assert found.barrier.item() == constant.barrier.item()
    (mode,) = SOFT.problem.modes
    A, _ = free_motion(mode)
    wells = []
    for d in (found.rest_distance.item(), found.barrier_distance.item()):
        wells.append(mode.k - 2.0 * 4e-20 * 20e-9 / (6.0 * d**3))  # of the spring and the attraction
    A[1, 0] = -wells[1] / mode.k
    # the one way in which lever and fluid fall off the barrier
    (growing,) = [float(rate.real) for rate in np.linalg.eigvals(A) if rate.real > 0.0]
    falls = growing * 2.0 * math.pi * mode.oscillator[0]
    rate = falls / (2.0 * math.pi) * math.sqrt(wells[0] / -wells[1]) * math.exp(-found.barrier.item() / KT)
    assert found.switching_rate.item() == pytest.approx(rate, rel=1e-7)
    assert found.switching_rate.item() > 1.1 * constant.switching_rate.item()


@pytest.mark.long
def test_simulated_lanes_of_lever_and_fluid_snap_in_at_that_rate():
    integrator, start = started(SOFT, 1.6e-9)
    expected = df.snap_in_rate(SOFT, 1.6e-9)
    running = integrator.lanes([start] * 500, range(500))
    events, at_risk = 0, 0
    for period in range(300):
        running, _ = integrator.run(running, 1)
        gone = running.lowest < expected.barrier_distance.item() - 0.15e-9
        if period >= 20:
            events, at_risk = events + int(gone.sum()), at_risk + len(gone)
        running = running.part(np.flatnonzero(~gone))
    rate = events / at_risk * SOFT.problem.tones[0].frequency
    # so high a barrier has a rate some 10 % below the formula, with a constant load of the fluid as well
    assert rate == pytest.approx(0.9 * expected.switching_rate.item(), rel=3.0 / math.sqrt(events) + 0.04)
