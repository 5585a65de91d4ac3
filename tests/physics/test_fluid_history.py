"""The memory of the fluid around a beam: against the beam's own response, its equation written anew, and its noise."""

import dataclasses
import math

import numpy as np
import pytest
from compiled import FD_STEP, INTEGRATORS, linear_noise, with_amplitudes
from scipy.integrate import solve_ivp
from scipy.optimize import nnls

import dforce as df
from dforce.core.errors import ParameterError
from dforce.core.quantities import MOTION
from dforce.experiments.base import initial_motion
from dforce.instrument import beam, fluid, history
from dforce.solvers import SolverSettings

SIZES = {"youngs_modulus": 169e9, "density": 2330.0, "length": 225e-6, "width": 28e-6, "thickness": 3e-6}
WATER = {"density": 997.0, "viscosity": 8.59e-4}
R, MODULUS, HAMAKER, A0 = 10e-9, 50e6 / 0.75, 5e-21, 0.165e-9
LOAD = math.pi * 997.0 * 28e-6 / (4.0 * 2330.0 * 3e-6)
VACUUM = beam.vacuum_mode(1, *SIZES.values())
WET = beam.fluid_mode(VACUUM.frequency, 2330.0, 28e-6, 3e-6, 997.0, 8.59e-4)


def case(excitation="force", modes=1, **drive):
    return df.Case(
        cantilever={"beam": SIZES | {"fluid": "history", "modes": modes}},
        drive={"A0": "10 nm", "excitation": excitation} | drive,
        medium=WATER, tip={"radius": R}, sample={"youngs_modulus": 50e6, "poisson_ratio": 0.5},
        forces=[df.forces.DMT(hamaker=HAMAKER)],
    )  # fmt: skip


def gamma(ratio):
    """Return Sader's hydrodynamic function at shares of the wet resonance, as it goes with exp(i w t)."""
    flow = fluid.free_flow(28e-6, 997.0, 8.59e-4)
    return np.conj([flow(float(one) * WET.frequency) for one in np.atleast_1d(ratio)])


def exact(ratio):
    """Return the deflection per force of mode 1 (m/N) with the fluid as it is at each frequency."""
    r = np.asarray(ratio) * WET.frequency / VACUUM.frequency
    return 1.0 / (VACUUM.stiffness * (1.0 - r**2 * (1.0 + LOAD * gamma(ratio))))


def basset(ratio):
    """Return the same with an added mass, Stokes' drag and Basset's history, fitted from 0.3 to 30 resonances."""
    at = np.geomspace(0.3, 30.0, 15)

    def parts(ratio):
        sigma = 1.0 / np.sqrt(
            2.0 * beam.reynolds_number(1.0, 28e-6, 997.0, 8.59e-4) * np.asarray(ratio) * WET.frequency
        )
        return np.stack([np.ones_like(sigma), (1.0 - 1j) * sigma, -1j * sigma**2], axis=1)

    size = gamma(at)
    given = np.concatenate([parts(at).real / size.real[:, None], parts(at).imag / size.imag[:, None]])
    numbers = nnls(given, np.ones(30))[0]
    r = np.asarray(ratio) * WET.frequency / VACUUM.frequency
    return numbers, 1.0 / (VACUUM.stiffness * (1.0 - r**2 * (1.0 + LOAD * parts(ratio) @ numbers)))


def test_memory_answers_as_the_beam_does_and_better_than_a_basset_force():
    (mode,) = case().problem.modes
    ratio = np.append(np.geomspace(0.1, 5.0, 200), 1.0)
    off = np.abs(1.0 / mode.stiffness(ratio * WET.frequency) / exact(ratio) - 1.0)
    numbers, by_basset = basset(ratio)
    assert numbers == pytest.approx([1.0186493, 4.2879887, 0.0], abs=1e-6)
    assert np.abs(by_basset / exact(ratio) - 1.0).max() == pytest.approx(0.027, abs=5e-4)
    assert off.max() < 3e-4
    assert [mode.f0, mode.Q] == pytest.approx([WET.frequency, WET.Q], rel=1e-3)


def test_ten_states_are_the_root_of_a_frequency_over_three_decades():
    low = 1e3

    def root(frequency):  # Γ of a Basset force
        return complex(1.0, 1.0) / math.sqrt(frequency)

    a, c, weights = history.late_flow(root, low, 1e3 * low)
    p = 2j * math.pi * np.geomspace(low, 1e3 * low, 300)
    found = a + c / p + (weights / (p[:, None] + history.rates_of(low, 1e3 * low))).sum(axis=1)
    wanted = (1.0 - 1j) / np.sqrt(np.abs(p) / (2.0 * math.pi))
    assert np.abs(found / wanted - 1.0).max() < 5.5e-3  # what the trapezoidal rule with as many states has
    assert len(weights) == 10
    assert min(a, c, *weights) >= 0.0


@pytest.mark.parametrize("excitation", ["force", "base"])
def test_free_curve_is_that_of_the_beam_in_its_fluid(excitation):
    free = case(excitation)
    f = np.linspace(0.5, 2.5, 9) * WET.frequency
    found = df.frequency_sweep(free, frequency=f.tolist(), zc="1 um", direction="up")
    c = found["amplitude"].values[:, 0] * np.exp(-1j * np.radians(found["phase"].values[:, 0]))
    ratio = f / WET.frequency
    (tone,) = free.problem.tones
    if excitation == "force":
        wanted = tone.force * exact(ratio)
    else:  # the base drives lever and fluid
        mass = VACUUM.stiffness / (2.0 * math.pi * VACUUM.frequency) ** 2
        chi = free.problem.modes[0].base_coupling
        wanted = chi * mass * (2.0 * math.pi * f) ** 2 * (1.0 + LOAD * gamma(ratio)) * exact(ratio) * tone.base
    assert np.abs(c / wanted - 1.0).max() < 1e-3  # what the ten states leave


@pytest.mark.parametrize("follows", [0.0, 0.4, 1.0])
def test_base_drives_the_mass_and_what_of_the_fluid_stays(follows):
    problem = case("base", fluid_follows=follows, frequency=0.7 * WET.frequency).problem
    (mode,), (tone,) = problem.modes, problem.tones
    ratio = tone.frequency / WET.frequency
    mass = VACUUM.stiffness / (2.0 * math.pi * VACUUM.frequency) ** 2
    moved = mass * (2.0 * math.pi * tone.frequency) ** 2 * (1.0 + (1.0 - follows) * LOAD * gamma(ratio)[0])
    assert problem.drive[0, 0] == pytest.approx(mode.base_coupling * moved * tone.base, rel=2e-3, abs=0.0)


def force_at(d):
    """Return the DMT force (N) at a distance."""
    if d < A0:
        return 4.0 / 3.0 * MODULUS * math.sqrt(R) * (A0 - d) ** 1.5 - HAMAKER * R / (6.0 * A0**2)
    return -HAMAKER * R / (6.0 * d**2)


def along(mode, base, omega, zc):
    """Return the equation of lever and fluid over a moving base, as it stands, not as it is solved."""
    memory, chi = mode.memory, mode.base_coupling
    own, rates, weights = 2.0 * math.pi * memory.frequency, np.array(memory.rates), np.array(memory.weights)

    def slopes(t, y):
        phase = np.exp(1j * omega * t)
        Y, V, A = (((1j * omega) ** n * base * phase).real for n in range(3))
        z, v, q = y[0], y[1], y[2:]
        force = force_at(zc + Y + z)
        moved = v + chi * V
        a = force * own**2 / mode.k - own**2 * z - own / memory.Q * moved - chi * A + weights @ q
        return np.concatenate([[v, a], rates * (moved - q)])

    return slopes


@pytest.mark.parametrize(
    "solver",
    [{"points_per_period": 2048}, {"method": "transient", "integrator": "engine", "settle_tolerance": 1e-10}],
    ids=["rk4", "engine"],
)
def test_tapping_over_a_shaken_base_is_the_motion_of_the_equation(solver):
    water = case("base")
    found = df.dwell(water.replace("solver", solver), zc="9 nm")
    (mode,), (tone,), (base,) = water.problem.modes, water.problem.tones, water.problem.base
    omega = 2.0 * math.pi * tone.frequency
    start = found[MOTION].values.copy()
    assert list(found["component"].values[:3]) == ["z_1", "v_1", "fluid_1"]
    # the solver counts the base's motion to the deflection: its fluid has followed the base once, that of the beam chi times
    rates = np.array(mode.memory.rates)
    start[2:] += ((mode.base_coupling - 1.0) * rates / (rates + 1j * omega) * 1j * omega * base).real
    times = np.linspace(0.0, 1.0 / tone.frequency, 4097)
    path = solve_ivp(
        along(mode, base, omega, 9e-9), times[[0, -1]], start, "DOP853", times, rtol=1e-11, atol=1e-16, max_step=1e-7
    )
    scale = np.array([10e-9, *[10e-9 * omega] * 11])
    # contact bends the force, and both step over it: RK4 cuts there, DOP853 is held to short steps
    assert np.abs(path.y[:, -1] - start).max() > 0.0
    assert np.abs((path.y[:, -1] - start) / scale).max() < 1e-7
    c = 2.0 * np.mean(path.y[0, :-1] * np.exp(-1j * omega * times[:-1]))
    assert float(found["amplitude"][0]) == pytest.approx(abs(c), rel=1e-7, abs=0.0)
    assert float(found["phase"][0]) == pytest.approx(-math.degrees(np.angle(c)), abs=1e-5)


def pushed(problem, zc):
    """Return the equation of modes and their fluid under forces."""
    modes, (tone,), drive = problem.modes, problem.tones, problem.drive[0]
    own = 2.0 * math.pi * np.array([mode.memory.frequency for mode in modes])
    k, Q = (np.array(one) for one in zip(*((mode.k, mode.memory.Q) for mode in modes), strict=True))
    rates, weights = (np.array([getattr(mode.memory, name) for mode in modes]) for name in ("rates", "weights"))
    count = 2 * len(modes)

    def slopes(t, y):
        z, v, q = y[:count:2], y[1:count:2], y[count:].reshape(rates.shape)
        force = force_at(zc + z.sum()) + (drive * np.exp(2j * math.pi * tone.frequency * t)).real
        a = own**2 * (force / k - z) - own / Q * v + (weights * q).sum(axis=1)
        return np.concatenate([np.stack([v, a], axis=1).ravel(), (rates * (v[:, None] - q)).ravel()])

    return slopes


def test_the_engine_moves_modes_and_fluid_as_the_equation_does():
    """From rest, in contact: two modes, and a part of the fluid of one that weighs nothing."""
    problem = case(modes=2).problem
    memory = problem.modes[0].memory
    weightless = dataclasses.replace(memory, weights=(*memory.weights[:4], 0.0, *memory.weights[5:]))
    modes = (dataclasses.replace(problem.modes[0], memory=weightless), *problem.modes[1:])
    problem = dataclasses.replace(problem, modes=modes)
    integrator = INTEGRATORS["engine"](problem, SolverSettings(method="transient", integrator="engine"), 1, 256)
    integrator.place(6e-9)
    motion, _ = integrator.lock_in(initial_motion(integrator, "rest"), 6)
    end = 6.0 / problem.tones[0].frequency
    path = solve_ivp(pushed(problem, 6e-9), (0.0, end), np.zeros(24), "DOP853", rtol=1e-11, atol=1e-18, max_step=1e-7)
    length, speed = integrator.scales.length, integrator.scales.speed
    scale = np.array([length, speed, length, speed, *[speed] * 20])
    there = [n for n in range(24) if n != 4 + 4]  # the weightless part moves nothing
    assert np.array(motion.y)[there] == pytest.approx((path.y[:, -1] / scale)[there], abs=1e-8)


def test_multipliers_of_the_free_lever_are_those_of_lever_and_fluid_together():
    free = case()
    found = df.approach(free, zc=["1 um"])
    mode = free.problem.modes[0]
    own, rates, weights = 2.0 * math.pi * mode.memory.frequency, mode.memory.rates, mode.memory.weights
    matrix = np.zeros((12, 12))
    matrix[0, 1], matrix[1, 0], matrix[1, 1], matrix[1, 2:] = 1.0, -(own**2), -own / mode.memory.Q, weights
    matrix[2:, 1], matrix[2:, 2:] = rates, -np.diag(rates)
    scale = np.array([1.0, *[own] * 11])
    wanted = np.exp(np.linalg.eigvals(matrix * scale / scale[:, None]) / free.problem.tones[0].frequency)
    modulus = found["multiplier_modulus"].values[0]
    assert modulus.shape == (12,)
    assert modulus == pytest.approx(np.sort(np.abs(wanted))[::-1], abs=1e-6)


def test_every_state_of_two_modes_in_their_fluid_is_sought():
    asked = case(modes=2)
    found = df.branches(asked, zc=("12 nm", "11 nm"), search=1)
    assert "no single state is missing" in found.attrs["completeness"]
    (at_end,) = np.flatnonzero(found["zc"].values == 11e-9)
    amplitude = df.approach(asked, zc=["11 nm"])["amplitude"].values[0, 0]
    assert float(found["amplitude"][at_end, 0]) == pytest.approx(amplitude, rel=1e-6, abs=0.0)


def test_every_experiment_finds_the_same_motion():
    water = case()
    approach = df.approach(water, zc=[12e-9, 10e-9, 9e-9])
    amplitude = approach["amplitude"].values[:, 0]
    assert list(approach["status"].values) == [0, 0, 0]
    branch = df.branches(water, zc=("12 nm", "9 nm"))
    stable = branch.where(branch["stable"], drop=True).sortby("zc")
    end = stable["zc"].values.argmin()
    assert float(stable["amplitude"][end, 0]) == pytest.approx(amplitude[2], rel=1e-6, abs=0.0)
    slow = df.dwell(water.replace("solver.method", "transient"), zc="9 nm")
    assert float(slow["amplitude"][0]) == pytest.approx(amplitude[2], rel=1e-4, abs=0.0)  # as far as it settles
    reference = water.replace("solver", {"method": "transient", "integrator": "engine"})
    assert float(df.dwell(reference, zc="9 nm")["amplitude"][0]) == pytest.approx(amplitude[2], rel=1e-4, abs=0.0)
    swept = df.sweep(
        water.replace("experiment", {"kind": "approach", "zc": [12e-9, 9e-9]}),
        over={"sample.youngs_modulus": [20e6, 50e6]},
    )
    assert swept["amplitude"].values[1, :, 0] == pytest.approx(amplitude[[0, 2]], rel=1e-9, abs=0.0)
    assert df.motion_at(approach.isel(zc=1))["deflection"].values.max() > 0.9 * amplitude[1]


def test_identities_hold_with_the_fluids_own_drag():
    water = case("base")
    found = df.dwell(water, zc="9 nm")
    (mode,), (tone,) = water.problem.modes, water.problem.tones
    c = found["mode_amplitude"].values[0] * np.exp(-1j * math.radians(found["mode_phase"].values[0]))
    # a mode takes from its drive what it gives to the sample and to the fluid
    given = math.pi * (water.problem.drive[0, 0] * np.conj(c)).imag
    lost = math.pi * mode.stiffness(tone.frequency).imag * abs(c) ** 2
    # RK4 with 256 samples closes it to some 1e-6 of what is given
    assert float(found["dissipated_energy"][0]) == pytest.approx(given - lost, abs=1e-5 * abs(given))


def test_noise_of_the_fluid_keeps_equipartition():
    problem = case().problem
    integrator = INTEGRATORS["rk4"](problem, SolverSettings(), 1, 512)
    integrator.place(1e-6)
    noise = linear_noise(integrator, with_amplitudes(integrator, integrator.problem.free), 1, 1e3, 1)
    (mode,) = problem.modes
    assert noise.state[0, 0] == pytest.approx(problem.noise.kT / mode.k, rel=1e-6, abs=0.0)
    # the mass that follows at once has its share of the velocity
    speed = problem.noise.kT / mode.k * (2.0 * math.pi * mode.memory.frequency) ** 2
    assert noise.state[1, 1] == pytest.approx(
        speed, rel=1e-3, abs=0.0
    )  # Simpson's rule over steps as long as the fastest rate


def test_in_air_the_memory_changes_next_to_nothing():
    air = case().replace("medium", {"name": "air"})
    constant = air.replace("cantilever.beam.fluid", "constant")
    assert pytest.approx(constant.problem.modes[0].Q, rel=2e-3) == air.problem.modes[0].Q
    found = [df.dwell(one, zc="8 nm") for one in (air, constant)]
    # harmonics off resonance feel little of a fluid that takes 1/Q
    assert float(found[0]["amplitude"][0]) == pytest.approx(float(found[1]["amplitude"][0]), rel=1e-3, abs=0.0)


def test_wall_changes_the_memory_as_it_changes_the_resonance():
    near = {"tip_height": "5 um", "tilt": "11 deg"}
    levers = [SIZES | near | {"fluid": kind} for kind in ("history", "constant")]
    problems = [df.Case(cantilever={"beam": one}, drive={"A0": "10 nm"}, medium=WATER).problem for one in levers]
    (mode,), (wet,) = (problem.modes for problem in problems)
    assert [mode.f0, mode.Q] == pytest.approx([wet.f0, wet.Q], rel=2e-3)


def test_peak_is_where_the_free_response_is_largest():
    problem = case("base", frequency="peak").problem
    top, beside = problem.tones[0].frequency, (0.999, 1.001)
    heights = [abs(problem.at_frequency(top * one).free[0, 0]) for one in beside]
    assert max(heights) < abs(problem.free[0, 0])


def test_what_the_memory_cannot_do_is_refused_in_a_sentence():
    with pytest.raises(ParameterError, match='fluid = "history" needs a fluid with density and viscosity'):
        _ = case().replace("medium", {"name": "vacuum"}).problem
    with pytest.raises(ParameterError, match='both Q and fluid = "history"'):
        case().replace("cantilever.beam.Q", [3.0])


@pytest.mark.parametrize(
    ("ratio", "follows", "kind", "wanted"),
    [
        (1.0, 0.0, "deflection", -1.587209759 - 6.582504031j),
        (0.5, 0.0, "deflection", 0.5534623271 - 0.2465311347j),
        (1.0, 0.0, "optical_lever", -1.502222963 - 6.029375845j),
        (1.0, 0.0, "interferometer", -0.587209759 - 6.582504031j),
        (1.0, 1.0, "deflection", -0.003839973341 - 1.189874063j),
    ],
)
def test_modes_with_memory_move_over_a_shaken_base_as_the_whole_beam(ratio, follows, kind, wanted):
    # what the detector reads over Y, at the end of the beam in its fluid, solved as a beam: constants are 18 % off below
    # resonance, and fluid that follows the base takes 5.7 times of the drive
    drive = {"frequency": ratio * 34648.95609714, "fluid_follows": follows}
    asked = case("base", modes=3, **drive).replace("readout", {"kind": kind})
    found = asked.problem.detected_free[0] / asked.problem.base[0]
    # 8e-5 to 2e-4 here: modes that are left out, and the ten states
    assert abs(found / wanted - 1.0) < 3e-4


@pytest.mark.parametrize(
    ("ratio", "wanted", "close"),
    [(1.0, 0.01068691267 - 1.456271227j, 6e-4), (0.5, 0.4802774088 - 0.05490973932j, 1.2e-3)],
)
def test_modes_with_memory_move_under_a_force_as_the_whole_beam(ratio, wanted, close):
    problem = case(modes=3, frequency=ratio * 34648.95609714).problem
    # modes that are left out: constants are 5.4 % off below resonance
    assert abs(problem.free[0].sum() / problem.tones[0].force / wanted - 1.0) < close


SIDE_BY_SIDE = [
    pytest.param("modes", [1, 2], marks=pytest.mark.long),  # two modes in such a fluid have solvers of their own
    ("fluid", ["constant", "history"]),
]


@pytest.mark.parametrize(("path", "values"), SIDE_BY_SIDE)
def test_sweep_holds_levers_of_more_and_of_fewer_numbers_side_by_side(path, values):
    asked = case("base").replace("experiment", {"kind": "approach", "zc": [12e-9, 9e-9]})
    found = df.sweep(asked, over={f"cantilever.beam.{path}": values})
    for place, value in enumerate(values):
        alone = df.run(asked.replace(f"cantilever.beam.{path}", value))
        for name in ("amplitude", "phase", "mode_amplitude", "dissipated_energy", "multiplier_modulus"):
            own = alone[name].values
            row = found[name].values[place]
            same = row[tuple(map(slice, own.shape))]
            # derivatives are differences: a period's rounding, of a thousand steps, over their step
            close = 1e-14 / FD_STEP if name == "multiplier_modulus" else 1e-8
            assert same == pytest.approx(own, rel=1e-8, abs=close * np.abs(own).max()), name
            assert np.isfinite(row).sum() == own.size  # what a lever does not have is left empty
