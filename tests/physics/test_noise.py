"""Thermal motion and noise: deterministic statements about the step, its statistics in seconds, and what follows from it."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from compiled import RK4, Langevin, linear_noise, linear_step, normals, philox, step_noise, with_amplitudes
from last_bits import put_levers_off
from scipy.integrate import quad, solve_ivp
from scipy.linalg import solve_discrete_lyapunov
from tiers import some_long

import dforce as df
from dforce.core.errors import ParameterError, ResultError
from dforce.instrument import ModeNumbers
from dforce.instrument.noise import BOLTZMANN, time_constant
from dforce.procedures.motion import motion_of
from dforce.validity import advice_in

KT = BOLTZMANN * 298.15
AIR = ModeNumbers(75e3, 2.8, 200.0)
NOISY = {"integrator": "langevin", "points_per_period": 64}


def thermal_density(f, f0, k, Q, kT):
    """The one-sided spectral density (m^2/Hz) of a mode's thermal motion."""
    return 2.0 * kT / (math.pi * k * f0 * Q) / ((1.0 - (f / f0) ** 2) ** 2 + (f / f0 / Q) ** 2)


def case(forces=(), solver=NOISY, Q=50, A0="20 nm", **others):
    return df.Case(
        cantilever={"f0": 75e3, "k": 2.8, "Q": Q}, drive={"A0": A0}, tip={"radius": 10e-9},
        sample={"youngs_modulus": 1e9, "poisson_ratio": 0.3}, forces=list(forces), solver=solver, **others,
    )  # fmt: skip


def langevin(asked, zc):
    integrator = Langevin(asked.problem, asked.solver, 1)
    integrator.place(zc)
    return integrator, with_amplitudes(integrator, integrator.problem.free)


# random numbers


@pytest.mark.parametrize(
    ("counter", "key", "words"),
    [  # the known answers that are published with Random123
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344), (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)  # fmt: skip
def test_philox_gives_its_published_words(counter, key, words):
    assert philox(*counter, *key) == words


def test_normal_numbers_have_the_moments_of_a_normal_distribution():
    out = np.empty((5000, 4))
    for step in range(len(out)):
        normals(step, 1, 2, out[step])
    spread = 1.0 / math.sqrt(len(out))
    assert np.abs(out.mean(axis=0)).max() < 4.0 * spread
    assert np.abs((out**2).mean(axis=0) - 1.0).max() < 4.0 * math.sqrt(2.0) * spread
    apart = np.corrcoef(out.T) - np.eye(4)
    assert np.abs(apart).max() < 4.0 * spread


# the step


def test_step_of_the_free_lever_and_its_noise_have_their_exact_values():
    h = 1.0 / 75e3 / 50.0
    M, S = linear_step(AIR, h), step_noise(AIR, h, KT)
    assert (
        pytest.approx(
            np.array([[0.9921163521134, 2.6588184408531e-7], [-59043.34391747, 0.9914898827773]]), rel=1e-12, abs=0.0
        )
        == M
    )
    assert [S[0, 0], S[0, 1], S[1, 1]] == pytest.approx(
        [9.6892933768e-27, 5.4378951448e-20, 4.0784475447e-13], rel=1e-10, abs=0.0
    )


@pytest.mark.parametrize("turns", [1e-3, 0.1, 0.9])
def test_noise_of_a_step_keeps_equipartition(turns):
    h = turns / 75e3
    P = np.diag([KT / AIR.k, KT * (2.0 * math.pi * AIR.f0) ** 2 / AIR.k])
    M, S = linear_step(AIR, h), step_noise(AIR, h, KT)
    scale = np.sqrt(np.outer(np.diag(P), np.diag(P)))
    assert np.abs(S - (P - M @ P @ M.T)).max() < 1e-14 * scale.max()
    assert (S + M @ P @ M.T) / scale == pytest.approx(P / scale, abs=1e-13)


@pytest.mark.parametrize(
    ("points", "place", "speed"),
    [(16, 1.02019010825, 0.97402973906), (32, 1.00487403033, 0.99355790135), (64, 1.00120818334, 0.99839258600)],
)
def test_equipartition_in_contact_has_the_second_order_error_that_is_derived(points, place, speed):
    spring = df.forces.Custom(law="-P1*(d - 20e-9)", P1=2.8)
    asked = case([spring], {"integrator": "langevin", "points_per_period": points}, Q=200)
    h, omega = 1.0 / 75e3 / points, 2.0 * math.pi * 75e3
    M, S = linear_step(AIR, h), step_noise(AIR, h, KT)
    K = np.array([[1.0, 0.0], [-0.5 * h * omega**2, 1.0]])
    # the compiled step is that one: its map of a period, by differences of motions with the same noise
    integrator, start = langevin(asked, 20e-9)
    assert integrator.points == (max(points, 32))
    if integrator.points == points:
        ends = []
        for aside in ((0.0, 0.0), (1e-3, 0.0), (0.0, 1e-3)):
            begun = replace(start, y=tuple(np.add(start.y, aside)))
            ends.append(np.array(integrator.lock_in(begun, 1)[0].y))
        scale = np.array([1.0, integrator.scales.omega])
        found = np.stack([ends[1] - ends[0], ends[2] - ends[0]], axis=1) / 1e-3 * scale[:, None] / scale
        assert found == pytest.approx(np.linalg.matrix_power(K @ M @ K, points), rel=1e-8, abs=1e-8)
    unit = np.array([1.0, omega])  # so that both numbers are alike
    P = solve_discrete_lyapunov(
        K @ M @ K * unit / unit[:, None], K @ S @ K.T / np.outer(unit, unit) / KT, method="direct"
    )
    assert P[0, 0] * 5.6 == pytest.approx(place, abs=2e-11)
    assert P[1, 1] * 2.8 == pytest.approx(speed, abs=2e-11)


def test_step_is_of_order_two_in_contact():
    cold = {"temperature": "1e-6 K"}
    ends = []
    for points in (128, 256, 512, 4096):
        asked = case([df.forces.DMT(hamaker=2e-20)], NOISY | {"points_per_period": points}, medium=cold)
        integrator, start = langevin(asked, 18e-9)
        ends.append(np.array(integrator.lock_in(start, 20)[0].y))
    errors = [np.abs(end - ends[-1]).max() for end in ends[:-1]]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # where the steps fall beside the kink of the force differs, which scatters the error
    assert 1.5 < orders.mean() < 2.6
    assert errors[-1] < 1e-3


def test_driven_free_lever_has_no_error_at_any_step():
    asked = case(solver={"integrator": "langevin", "points_per_period": 32}, medium={"temperature": "1e-20 K"})
    integrator, start = langevin(asked, 50e-9)
    motion, c = integrator.lock_in(start, 300)
    assert np.abs(np.array(motion.y) - start.y).max() < 1e-9
    assert np.abs(c[-1, 0] - (-1j)) < 1e-9  # amplitude A0, lag 90 degrees


# lanes


SOME_LANES = (*range(16), 100, *range(192, 200))  # of 200: each place of a vector, and the last ones


def test_many_lanes_are_the_single_runs_to_the_last_bit():
    asked = case([df.forces.DMT(hamaker=2e-20)])
    integrator, start = langevin(asked, 18e-9)
    lanes, c = integrator.run(integrator.lanes([start] * 200, range(200)), 3)
    for seed in SOME_LANES:
        alone, own = langevin(asked.replace("noise.seed", seed), 18e-9)
        motion, single = alone.lock_in(own, 3)
        assert np.array_equal(np.array(motion.y), lanes.y[seed])
        assert np.array_equal(single, c[seed])


def test_run_goes_on_from_any_period_to_the_last_bit_and_seeds_differ():
    integrator, start = langevin(case([df.forces.DMT(hamaker=2e-20)]), 18e-9)
    whole, _ = integrator.lock_in(start, 50)
    half, _ = integrator.lock_in(start, 17)
    assert integrator.lock_in(half, 33)[0].y == whole.y
    other, _ = langevin(case([df.forces.DMT(hamaker=2e-20)], noise={"seed": 2}), 18e-9)
    assert other.lock_in(start, 50)[0].y != whole.y
    integrator.place(18.1e-9)  # another distance has noise of its own
    assert abs(integrator.lock_in(start, 1)[0].y[0] - langevin(case([df.forces.DMT(hamaker=2e-20)]), 18e-9)[0]
               .lock_in(start, 1)[0].y[0]) > 1e-6  # fmt: skip


def test_equipartition_holds_in_a_long_run():
    integrator, start = langevin(case(), 50e-9)
    lanes, _ = integrator.run(integrator.lanes([start] * 2000, range(2000)), 160)  # ten decay times
    apart = (lanes.y - np.array(start.y)) * [integrator.scales.length, integrator.scales.speed]
    omega, spread = 2.0 * math.pi * 75e3, math.sqrt(2.0 / 2000)
    assert (apart[:, 0] ** 2).mean() * 2.8 / KT == pytest.approx(1.0, abs=3.5 * spread)
    assert (apart[:, 1] ** 2).mean() * 2.8 / omega**2 / KT == pytest.approx(1.0, abs=3.5 * spread)


# spectra and lock-in


@pytest.mark.parametrize("poles", [1, 2, 4])
def test_bandwidth_is_that_of_so_many_poles(poles):
    tau = time_constant(100.0, poles)
    assert quad(lambda f: (1.0 + (2.0 * math.pi * f * tau) ** 2) ** -poles, 0.0, np.inf)[0] == pytest.approx(
        100.0, rel=1e-8
    )


def orbit(asked, zc):
    """The integrator and the periodic motion of a case at a distance, and what was found of it."""
    found = df.dwell(asked, zc=zc)
    integrator = RK4(asked.problem, asked.solver, 1)
    integrator.place(zc)
    return integrator, motion_of(found, asked.problem), found


@pytest.mark.parametrize(("tau", "poles"), [(1e-3, 1), (1e-4, 1), (1e-5, 1), (1e-4, 2)])
def test_noise_of_the_free_lever_is_the_integral_over_its_spectrum(tau, poles):
    asked = case(solver={"points_per_period": 512}, Q=200)
    integrator, motion, _ = orbit(asked, 50e-9)
    bandwidth = 0.25 / tau
    found = linear_noise(integrator, motion, 1, bandwidth, poles)
    pole = time_constant(bandwidth, poles)

    def seen(f):
        # both sidebands of a lock-in of so many poles
        passed = sum((1.0 + (2.0 * math.pi * (f - side * 75e3) * pole) ** 2) ** -poles for side in (1.0, -1.0))
        return thermal_density(f, 75e3, 2.8, 200.0, KT) * passed

    ends = [0.0, 60e3, 74e3, 74.8e3, 75e3, 75.2e3, 76e3, 90e3, 1e6]
    wanted = sum(quad(seen, *pair, epsabs=0.0, epsrel=1e-10, limit=400)[0] for pair in itertools.pairwise(ends))
    assert np.trace(found.quadratures[0]) / 2.0 == pytest.approx(wanted, rel=1e-6, abs=0.0)
    omega = 2.0 * math.pi * 75e3
    assert np.diag(found.state) == pytest.approx([KT / 2.8, KT / 2.8 * omega**2], rel=1e-6, abs=0.0)


def test_covariance_of_a_tapping_lever_is_that_of_the_equations_along_its_orbit():
    asked = case([df.forces.DMT(hamaker=1e-40)], {"points_per_period": 4096})
    integrator, motion, found = orbit(asked, 15e-9)
    assert np.array(motion.y) * [20.0, 20e-3 * 2.0 * math.pi * 75e3 * 1e-3] == pytest.approx(
        [9.7709836905, 5.899884535], rel=2e-9
    )
    assert found.multiplier_modulus.values == pytest.approx(abs(0.9119062608 + 0.2243620952j), rel=1e-7)
    state = linear_noise(integrator, motion, 1, 1e3, 1).state * 1e18
    values = [state[0, 0], state[0, 1] * 1e-6, state[1, 1] * 1e-12]
    # what a tap of the Runge-Kutta method itself is off by
    assert values == pytest.approx([0.0128156336, -0.0039652721, 0.0014728902], rel=5e-6)
    assert values == pytest.approx(_covariance(motion, integrator), rel=5e-6)


def _covariance(motion, integrator):
    """The same by the equations of the covariance, by DOP853 from contact to contact, in nm and microseconds."""
    k, Q, w, zc, n, a0 = 2.8, 50.0, 2.0 * math.pi * 75e3, 15e-9, 4.0 / 3.0 / 0.91e-9 * math.sqrt(10e-9), 0.165e-9
    m, F0 = k / w**2, k * 20e-9 / Q

    def right(t, y):
        z, v = y[:2]
        depth = max(a0 - zc - z, 0.0)
        J = np.array([[0.0, 1.0], [-(k + 1.5 * n * math.sqrt(depth)) / m, -w / Q]])
        P, M = y[2:6].reshape(2, 2), y[6:].reshape(2, 2)
        grown = J @ P + P @ J.T + np.diag([0.0, 2.0 * KT * w / (Q * m)])
        return [v, (F0 * math.cos(w * t) + n * depth**1.5 - k * z) / m - w / Q * v, *grown.ravel(), *(J @ M).ravel()]

    def touches(t, y):
        return y[0] + zc - a0

    y = np.array([*np.array(motion.y) * [integrator.scales.length, integrator.scales.speed], 0, 0, 0, 0, 1, 0, 0, 1])
    now, end = 0.0, 1.0 / 75e3
    touches.terminal = True
    while now < end:
        scale = np.array([1e-9, 1e-3, 1e-21, 1e-15, 1e-15, 1e-9, 1.0, 1e-6, 1e6, 1.0])
        way = solve_ivp(right, (now, end), y, "DOP853", events=touches, rtol=1e-11, atol=1e-12 * scale)
        now, y = float(way.t[-1]), way.y[:, -1]
        if way.status == 1:
            step = 1e-15
            y = y + step * np.array(right(now, y))
            now += step
    M, D = y[6:].reshape(2, 2), y[2:6].reshape(2, 2)
    scale = np.diag([1e9, 1e3])
    M, D = scale @ M @ np.linalg.inv(scale), scale @ D @ scale
    P = np.linalg.solve(np.eye(4) - np.kron(M, M), D.ravel()).reshape(2, 2)
    return [P[0, 0], P[0, 1], P[1, 1]]


# along curves


def test_noise_along_a_curve_agrees_with_lanes():
    # cold, so that the noise is small against the lengths on which the force changes
    asked = case([df.forces.DMT(hamaker=2e-20)], solver={"points_per_period": 512}, medium={"temperature": "3 K"})
    _compare(asked, ["17 nm", "12 nm"])


def _compare(asked, zc):
    curve = df.noise(df.approach(asked, zc=zc), "2 kHz", poles=2)
    for place in range(len(zc)):
        lanes = df.noisy_motion(curve.isel(zc=place), seeds=100, periods=200, bandwidth="2 kHz", poles=2)
        for name in ("amplitude", "phase"):
            runs = lanes[name].values[..., 0]
            squares = ((runs - runs.mean()) ** 2).mean(axis=1)
            spread = squares.std(ddof=1) / math.sqrt(len(squares))
            assert curve[f"{name}_noise"].values[place, 0] ** 2 == pytest.approx(squares.mean(), abs=3.5 * spread)


def test_unstable_states_have_no_noise_and_fragile_ones_much():
    states = df.noise(df.run(df.example("figure-3-branches")), "1 kHz")
    known = np.isfinite(states.phase_noise.values[:, 0])
    assert not known[~states.stable.values].any()
    assert known[states.stable.values].mean() > 0.9
    fragile = states.where(states.stable, drop=True)
    nearest = fragile.phase_noise.values[np.nanargmin(fragile.escape.values), 0]
    assert nearest > 3.0 * np.nanmedian(fragile.phase_noise.values)


@pytest.mark.parametrize("ulps", some_long([0, 1, -1, 2, -2], [1, 2, -2]))
def test_stability_multipliers_escape_and_noise_are_one_decision_whatever_the_last_bits(monkeypatch, ulps):
    put_levers_off(monkeypatch, ulps)
    states = df.run(df.example("figure-3-branches"))
    [fold] = np.flatnonzero(states.special.values == "fold")
    beside = df.noise(states.isel(point=slice(fold - 5, fold + 6)), "1 kHz")
    stable = beside.stable.values
    assert len(set(stable[:5])) == len(set(stable[6:])) == 1 and stable[0] != stable[-1]
    assert not stable[5]  # where both meet there is neither
    assert np.array_equal(beside.multiplier_modulus.values.max(axis=1) < 1.0, stable)
    assert np.array_equal(np.isfinite(beside.phase_noise.values[:, 0]), stable)
    assert np.array_equal(np.isfinite(beside.escape.values), stable)
    assert beside.multiplier_modulus.values[5].max() == pytest.approx(1.0, abs=1e-5)


def test_detector_adds_its_density_times_the_bandwidth():
    asked = case(noise={"detector": "100 fm/Hz^0.5", "bandwidth": "500 Hz"})
    quiet = case(noise={"bandwidth": "500 Hz"})
    curves = [df.noise(df.dwell(one.replace("solver", {}), zc="50 nm")) for one in (asked, quiet)]
    squares = [one.amplitude_noise.item() ** 2 for one in curves]
    assert squares[0] - squares[1] == pytest.approx(2.0 * (100e-15) ** 2 * 500.0, rel=1e-6, abs=0.0)
    still = df.noise(df.dwell(asked.replace("solver", {}).replace("noise.thermal", False), zc="50 nm"))
    assert still.amplitude_noise.item() == pytest.approx(100e-15 * math.sqrt(1000.0), rel=1e-9, abs=0.0)


@pytest.mark.long
def test_noise_of_two_tones_and_modes_is_that_of_each():
    modes = [{"f0": 50e3, "k": 1.0, "Q": 100}, {"f0": 300e3, "k": 40.0, "Q": 300}]
    asked = df.Case(cantilever={"modes": modes}, drive={"tones": [{"A0": 10e-9}, {"A0": 1e-9}], "acts_on": "own_mode"})
    found = df.noise(df.dwell(asked, zc="30 nm"), "100 Hz").amplitude_noise.values
    for n, mode in enumerate(modes):
        ringing, tau = mode["Q"] / (math.pi * mode["f0"]), 0.25 / 100.0
        # of a lock-in of one pole, at resonance, for high Q, of one mode
        wanted = math.sqrt(KT / mode["k"] * ringing / (ringing + tau))
        assert found[n] == pytest.approx(wanted, rel=2e-3, abs=0.0)


@pytest.mark.long
def test_force_with_memory_has_noise_as_its_lanes():
    soft = df.forces.SLSSimple(instant_modulus="1 GPa", relaxed_modulus="0.3 GPa", relaxation_time="3 us")
    _compare(case([soft], solver={"points_per_period": 256}, medium={"temperature": "3 K"}), ["15 nm"])


# calibration and switching


def test_each_calibration_gives_the_spring_constant_that_it_should():
    beam = {
        "youngs_modulus": 169e9,
        "density": 2330,
        "length": "225 um",
        "width": "28 um",
        "thickness": "3 um",
        "modes": 2,
    }
    lever = df.Case(cantilever={"beam": beam}, medium="air", drive={"A0": "10 nm"}, noise={"detector": "30 fm/Hz^0.5"})
    found = df.thermal_spectrum(lever, duration="0.5 s")
    error = found.spring_constant_error.item()
    first = lever.problem.modes[0]
    # the scatter of some 200 points of the spectrum tells it to a tenth, a fit takes a tenth more than the record's length
    assert error == pytest.approx(math.sqrt(first.Q / (math.pi * first.f0 * 0.5)), rel=0.3)
    ratio = found.spring_constant_ratio.to_pandas()
    assert ratio["static, 0.817"] == pytest.approx(1.0, abs=3.5 * error)
    assert ratio["static, no factor"] / ratio["static, 0.817"] == pytest.approx(1.0 / 0.8174347867, rel=1e-9)
    assert ratio["each mode"] == pytest.approx(ratio["static, 0.817"], rel=1e-9)
    assert ratio["each mode, 0.817"] / ratio["each mode"] == pytest.approx(0.8174347867 * 1.03019694736, rel=1e-9)
    assert ratio["Sader"] == pytest.approx(1.0, abs=5.0 * error)
    assert found.fitted_f0.values == pytest.approx([mode.f0 for mode in lever.problem.modes], rel=1e-3)
    sure = math.sqrt(lever.problem.modes[1].Q / (math.pi * lever.problem.modes[1].f0 * 0.5))
    assert found.mode_spring_constant.values[1] == pytest.approx(lever.problem.modes[1].k, rel=4.0 * sure)


def test_a_record_without_a_length_is_long_enough_for_the_resonance():
    def stop(*_):
        raise KeyboardInterrupt

    for Q, seconds in ((200, 1.0), (3000, 2.0 * 4.0 * 12.0 * 3000 / 70e3)):
        lever = df.Case(cantilever={"f0": "70 kHz", "k": "2 N/m", "Q": Q}, drive={"A0": "10 nm"})
        asked = df.Case.from_toml(df.thermal_spectrum(lever, progress=stop).attrs["case"]).experiment
        assert asked.duration == pytest.approx(seconds, rel=5e-3)  # three digits


SNAP = df.Case(
    cantilever={"f0": 20e3, "k": 0.3, "Q": 1}, drive={"A0": "0.1 pm"}, tip={"radius": 20e-9},
    forces=[df.forces.VanDerWaals(hamaker=4e-20)], solver=NOISY | {"points_per_period": 128},
)  # fmt: skip


@pytest.mark.parametrize(
    ("zc", "barrier", "rate"),
    [(1.55e-9, 2.7857407, 598.8347), (1.60e-9, 4.9625221, 75.962895), (1.65e-9, 7.5416573, 6.2089786)],
)
def test_snap_in_by_thermal_motion_has_kramers_rate(zc, barrier, rate):
    found = df.snap_in_rate(SNAP, zc)
    assert found.barrier.item() / KT == pytest.approx(barrier, abs=1e-7)
    assert found.switching_rate.item() == pytest.approx(rate, rel=1e-7)
    assert bool(found.attrs["note"]) == (barrier < 3.0)


def test_simulated_lanes_snap_in_at_that_rate():
    integrator, start = langevin(SNAP, 1.6e-9)
    kramers = df.snap_in_rate(SNAP, 1.6e-9)
    running = integrator.lanes([start] * 500, range(500))
    events, at_risk = 0, 0
    for period in range(300):
        running, _ = integrator.run(running, 1)
        gone = running.lowest < kramers.barrier_distance.item() - 0.15e-9
        if period >= 10:
            events, at_risk = events + int(gone.sum()), at_risk + len(gone)
        running = running.part(np.flatnonzero(~gone))
    rate = events / at_risk * 20e3
    # Kramers' rate is 4 % above that of long simulations, 72.8(2.7)
    assert rate == pytest.approx(72.8, rel=3.0 / math.sqrt(events) + 0.04)


def test_fragile_state_switches_more_often_when_it_is_warmer():
    air = df.example("figure-3-air").replace("solver.points_per_period", 128)
    repulsive = df.dwell(air, zc="9.5 nm")
    attractive = df.dwell(air, zc="9.5 nm", start={"amplitude": "10.5 nm", "phase": "60 deg"})
    found = df.switching_rate(repulsive, attractive, lanes=100, periods=1000, temperature=["400 K", "800 K"])
    rates = found.switches.values / found.watched_time.values
    assert rates[1] > 1.5 * rates[0]
    assert (found.switching_rate_low.values <= rates).all() and (rates < found.switching_rate_high.values).all()
    known = found.switches.values >= 10
    assert known[1] and np.array_equal(np.isfinite(found.switching_rate.values), known)
    with pytest.raises(ParameterError, match="the same state"):
        df.switching_rate(repulsive, repulsive)


# a dwell, and what is refused


def test_dwell_under_noise_scatters_about_the_steady_motion():
    asked = case([df.forces.DMT(hamaker=2e-20)])
    noisy = df.dwell(asked, zc="18 nm", recorded_periods=20)
    steady = df.dwell(asked.replace("solver", {}), zc="18 nm")
    assert noisy.attrs["case"] and int(noisy.status) == 0
    assert not {piece.name for piece in advice_in(noisy)} & {"sampling", "step_error", "energy_gained"}
    assert noisy.amplitude.item() != steady.amplitude.item()
    sigma = df.noise(steady, "10 kHz").amplitude_noise.item()
    assert noisy.amplitude.item() == pytest.approx(steady.amplitude.item(), abs=5.0 * sigma)
    again = df.dwell(asked, zc="18 nm", recorded_periods=20)
    assert np.array_equal(again.deflection.values, noisy.deflection.values)
    with pytest.raises(ResultError, match="never repeats"):
        df.motion_at(noisy)


def biased(given):
    """Return the case with an alternating voltage."""
    return given.replace(
        "forces", [*given.forces, df.forces.Electrostatic(bias="0 V", ac_bias="0.1 V", ac_frequency="20 kHz")]
    )


@pytest.mark.parametrize(
    ("do", "message"),
    [
        (lambda: df.approach(case(), zc=["20 nm"]), "simulates a dwell, not approach"),
        (lambda: df.dwell(case(noise={"thermal": False}), zc="20 nm"), "but noise.thermal = false"),
        (lambda: df.noise(df.dwell(case(solver={}), zc="20 nm")), 'pass for example bandwidth = "1 kHz"'),
        (lambda: df.noise(df.dwell(case(solver={}), zc="20 nm"), "80 kHz"), "is not between 0 Hz and the drive frequency"),
        (lambda: df.noise(df.dwell(case(solver={}), zc="20 nm"), "1 kHz", poles=9), "poles = 9 is not a whole number"),
        (lambda: case(noise={"bandwidth": "76 kHz"}), "noise.bandwidth = 76 kHz is above the drive frequency, 75 kHz"),
        (lambda: case(noise={"thermal": False}), "but noise.thermal = false"),
        (lambda: df.thermal_spectrum(case(), "1 ms"), "is too short to resolve the resonance; use"),
        (lambda: df.snap_in_rate(biased(SNAP), "1.6 nm"), "electrostatic depends on time, so the energy is not a function"),
        (lambda: df.snap_in_distance(biased(SNAP), "1 um/s"), "electrostatic depends on time"),
        (lambda: df.snap_in_rate(SNAP, "5 nm").close() or df.snap_in_rate(SNAP, "1 nm"), "has no barrier to the surface"),
        (
            lambda: df.dwell(case([df.forces.DMT(hamaker=2e-20)]).replace("sample.youngs_modulus", "10 TPa"), zc="15 nm"),
            "is too few for the stiffness of the contact",
        ),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_a_sentence(do, message):
    with pytest.raises(ParameterError) as raised:
        do()
    assert message in str(raised.value)


def test_sader_means_the_lever_and_thermal_motion_what_it_is_across_the_sample():
    beam = {"youngs_modulus": 169e9, "density": 2330, "length": "225 um", "width": "28 um", "thickness": "3 um"}
    asked = df.Case(cantilever={"beam": beam}, medium="air", drive={"A0": "10 nm"})
    flat, tilted = (
        df.thermal_spectrum(one, duration="0.5 s") for one in (asked, asked.replace("cantilever.beam.tilt", "11 deg"))
    )  # of the same noise
    stiffer = tilted.true_spring_constant / flat.true_spring_constant
    assert stiffer.sel(calibration="static, 0.817").item() == pytest.approx(
        math.cos(math.radians(11.0)) ** -2, rel=1e-12
    )
    assert stiffer.sel(calibration="Sader").item() == pytest.approx(1.0, rel=1e-12)
    # the fit stops within 1e-7
    assert tilted.spring_constant_ratio.values == pytest.approx(flat.spring_constant_ratio.values, rel=1e-5)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"seeds": [1, -1]}, "seed = -1 is not between 0 and 2^62"),
        ({"seeds": [2**70]}, "is not between 0 and 2^62"),
        ({"seeds": [3, 1, 3]}, "seeds contains 3 twice"),
        ({"seeds": 2, "settling": -5}, "settling = -5 is below 0"),
    ],
)
def test_runs_that_would_be_none_of_ones_own_are_refused(given, message):
    with pytest.raises(ParameterError) as raised:
        df.noisy_motion(case(solver={}, noise={"detector": "1 fm/Hz^0.5"}), "50 nm", periods=2, **given)
    assert message in str(raised.value)


def test_numbers_of_seeds_are_whole_numbers_of_any_kind():
    asked = case(solver={})
    found = df.noisy_motion(asked, "50 nm", seeds=np.int64(2), periods=np.int64(3), settling=0)
    assert found.equals(df.noisy_motion(asked, "50 nm", seeds=np.array([1, 2]), periods=3, settling=0))


def test_dwell_under_noise_is_not_asked_for_the_balances_of_a_steady_motion():
    modes = [{"f0": 25e3, "k": 0.1, "Q": 2.5}, {"f0": 160e3, "k": 4.0, "Q": 5}]
    drive = {"tones": [{"A0": 10e-9}, {"A0": 1e-9}], "excitation": "base"}
    asked = df.Case(
        cantilever={"modes": modes}, drive=drive, tip={"radius": 10e-9}, forces=[df.forces.DMT(hamaker=5e-21)],
        sample={"youngs_modulus": 50e6, "poisson_ratio": 0.5}, solver={"integrator": "langevin", "points_per_period": 256},
    )  # fmt: skip
    # over some periods thermal motion bends so soft a lever more than the mean force does
    for seed in range(1, 5):
        noisy = df.dwell(asked.replace("noise.seed", seed), zc="8 nm", recorded_periods=2)
        assert int(noisy.status) == 0
        assert np.isfinite(noisy.amplitude).all() and np.isfinite(noisy.total_dissipated_energy)
        assert noisy.amplitude.values[0] == pytest.approx(9.74e-9, rel=0.05)


@pytest.mark.parametrize("way", ["noisy_motion", "snap_in_rate"])
def test_noise_finds_the_lever_as_it_is_at_its_distance(way):
    lever = {"f0": 20e3, "k": 0.3, "Q": 1.0}
    asked = SNAP.replace("cantilever", lever | {"drift": {"zc": ["0 nm", "10 nm"], "Q": [0.8, 2.8]}}).replace(
        "drive.A0", "1 nm"
    )
    alone = SNAP.replace("cantilever", lever | {"Q": 1.12}).replace(
        "drive.A0", "1.12 nm"
    )  # at 1.6 nm, by the same force

    def found(case):
        if way == "snap_in_rate":
            return df.snap_in_rate(case, "1.6 nm").switching_rate.item()
        cold = case.replace("medium.temperature", "1 uK").replace("forces", [])
        return df.noisy_motion(cold, "1.6 nm", seeds=1, periods=3).amplitude.values

    # between the distances given the damping f0 / Q changes linearly in 64 parts
    assert found(asked) == pytest.approx(found(alone), rel=1e-4)


def test_detector_adds_its_own_noise_to_what_a_noisy_dwell_reads():
    quiet, loud = (case(noise={"detector": detector}) for detector in ("0 fm/Hz^0.5", "20 pm/Hz^0.5"))
    periods = quiet.solver.measured_periods
    added = []
    for seed in range(1, 21):
        one, other = (
            df.dwell(asked.replace("noise.seed", seed), zc="50 nm", recorded_periods=1) for asked in (quiet, loud)
        )
        assert np.array_equal(one.deflection, other.deflection)  # that is of the lever itself
        c, d = (found.amplitude.item() * np.exp(-1j * math.radians(found.phase.item())) for found in (one, other))
        added += [(d - c).real, (d - c).imag]
        assert other.amplitude_ratio.item() == pytest.approx(other.amplitude.item() / 20e-9, rel=1e-12)
        assert other.apparent_dissipated_energy.item() != one.apparent_dissipated_energy.item()
    # a lock-in over a time T has the bandwidth 1 / 2T
    assert np.mean(np.square(added)) == pytest.approx((20e-12) ** 2 * 75e3 / periods, rel=4.0 * math.sqrt(2.0 / 40))
    again = df.noisy_motion(loud, "50 nm", seeds=[20], periods=periods, settling=0).amplitude
    still = df.noisy_motion(quiet, "50 nm", seeds=[20], periods=periods, settling=0).amplitude
    assert (again != still).all()


# on the way to the surface


def test_snap_in_of_a_ramp_is_the_survival_that_the_rates_leave():
    found = df.snap_in_distance(SNAP, ["20 nm/s", "1 um/s"])
    end = found.static_snap_in_zc.item()
    assert end == pytest.approx(1.4422495703074e-9, rel=1e-12)  # 1.5 (H R / 3 k)^(1/3)
    k, strength, gamma = 0.3, 4e-20 * 20e-9 / 6.0, 2.0 * math.pi * 20e3
    mass = k / gamma**2

    def rate(zc):  # of the attraction -strength / d^2, in closed form
        roots = np.roots([1.0, -zc, 0.0, strength / k])
        top, rest = np.sort(roots.real[roots.real > 0.0])
        height = 0.5 * k * ((top - zc) ** 2 - (rest - zc) ** 2) - strength * (1.0 / top - 1.0 / rest)
        crest, well = (math.sqrt(abs(k - 2.0 * strength / d**3) / mass) for d in (top, rest))
        return (
            (math.sqrt(0.25 * gamma**2 + crest**2) - 0.5 * gamma)
            / crest
            * well
            / (2.0 * math.pi)
            * math.exp(-height / KT)
        )

    for place, v in enumerate((20e-9, 1e-6)):
        zc = end + np.geomspace(1e-14, 0.6e-9, 20001)[::-1]
        way = np.append(zc, end)
        hazard = np.append([rate(one) for one in zc], 0.0) / v
        left = np.exp(-np.concatenate([[0.0], np.cumsum(-0.5 * np.diff(way) * (hazard[1:] + hazard[:-1]))]))
        gone = np.append(-np.diff(left), left[-1])  # the rest snaps in where the barrier ends
        middle = np.append(0.5 * (way[1:] + way[:-1]), end)
        mean = gone @ middle
        assert found.snap_in_zc.values[place] == pytest.approx(mean, abs=1e-4 * (mean - end))
        assert found.snap_in_spread.values[place] == pytest.approx(math.sqrt(gone @ (middle - mean) ** 2), rel=1e-3)


def test_simulated_lanes_on_their_way_to_the_surface_snap_in_there():
    integrator, start = langevin(SNAP, 1.75e-9)
    running, places = integrator.lanes([start] * 400, range(400)), []
    steps = np.arange(1.75e-9, 1.44e-9, -1e-12)
    for zc in steps:  # by 1 pm a period
        integrator.place(zc)
        running, _ = integrator.run(running._replace(lowest=np.full(len(running.y), np.inf)), 1)
        gone = running.lowest < 0.6e-9  # the barrier is at 0.85 to 0.96 nm
        places += [zc] * int(gone.sum())
        running = running.part(np.flatnonzero(~gone))
        if not len(running.y):
            break
    assert len(places) == 400
    found = df.snap_in_distance(SNAP, 1e-12 * 20e3)
    sure = found.snap_in_spread.item() / math.sqrt(len(places))
    # Kramers' rate is up to 10 % high, which is 2 to 3 pm of a rate that changes e-fold in 25 pm
    assert np.mean(places) == pytest.approx(found.snap_in_zc.item(), abs=3.5 * sure + 3e-12)
    assert np.std(places) == pytest.approx(found.snap_in_spread.item(), rel=3.5 / math.sqrt(2.0 * len(places)) + 0.1)


@pytest.mark.parametrize(
    ("asked", "speed", "message"),
    [
        (SNAP, 0.0, "speed needs speeds of the approach above 0 m/s"),
        (SNAP, [], "speed needs speeds of the approach above 0 m/s"),
        (SNAP, "1 nm", "speed is '1 nm', which is a length"),
        (SNAP.replace("cantilever.k", "30 kN/m"), "1 um/s", "the lever does not snap in: it is stiffer than the attraction"),
        (SNAP.replace("forces", []), "1 um/s", "the lever does not snap in"),
        (SNAP.replace("solver", {}).replace("noise.thermal", False), "1 um/s", "noise.thermal = false"),
        (
            SNAP.replace("cantilever.drift", {"zc": [0.0, 1e-6], "Q": [1.0, 2.0]}), "1 um/s",
            "the snap-in distance needs a lever that is constant",
        ),
    ],
)  # fmt: skip
def test_ramps_that_make_no_sense_are_refused(asked, speed, message):
    with pytest.raises(ParameterError) as raised:
        df.snap_in_distance(asked, speed)
    assert message in str(raised.value)


@pytest.mark.parametrize(("kelvin", "speed"), [(298.15, "1 m/s"), (298.15, "1e5 m/s"), (1e-6, "1 um/s")])
def test_an_approach_too_fast_or_too_cold_for_thermal_motion_snaps_in_where_the_barrier_ends(kelvin, speed):
    found = df.snap_in_distance(SNAP.replace("medium.temperature", kelvin), speed)
    end = found.static_snap_in_zc.item()
    assert end == pytest.approx(1.5 * (4e-20 * 20e-9 / (3 * 0.3)) ** (1 / 3), rel=1e-9)  # 3/2 of where the slope is k
    assert 0.0 <= found.snap_in_zc.item() - end < 2e-3 * end and found.snap_in_spread.item() < 2e-3 * end


def test_noise_is_refused_where_a_motion_is_of_another_case_or_has_lost_its_parameter():
    experiment = {"kind": "approach", "zc": ["12 nm", "10 nm"]}
    case = df.example("figure-3-air").replace(experiment=experiment)
    swept = df.sweep(case, {"drive.A0": ["10 nm", "11 nm"]})
    wanted = df.noise(df.run(case.replace("drive.A0", "11 nm")), "1 kHz").amplitude_noise
    np.testing.assert_allclose(df.noise(swept.isel(A0=1), "1 kHz").amplitude_noise, wanted, rtol=1e-9)
    with pytest.raises(ParameterError, match=r"has lost its value of drive\.A0; choose it without drop=True"):
        df.noise(swept.isel(A0=1, drop=True), "1 kHz")
    joined = xr.concat(
        [df.run(case), df.run(case.replace("drive.A0", "11 nm"))], "run"
    )  # with the attributes of the first
    df.noise(joined.isel(run=0), "1 kHz")
    for part in (joined.isel(run=1), joined.isel(run=0).assign_coords(zc=joined.zc * 1.01)):
        with pytest.raises(
            ParameterError, match="does not repeat in the case of this result; pass the result as dForce"
        ):
            df.noise(part, "1 kHz")
