"""Modes of operation of one tone: FM-AFM, constant excitation and phase modulation.

The values are those of two independent programs, harmonic balance and shooting with located kinks, which share nothing with
dForce; each has the digits that both agree on.
"""

import math

import numpy as np
import pytest
from tiers import some_long

import dforce as df
from dforce.findings.set_point import at_distance
from dforce.forces import REGISTRY
from dforce.solvers.controlled import ToneControllers
from dforce.solvers.controlled import follow as controlled
from dforce.solvers.integrator import Engine, Motion
from dforce.solvers.newton import solve_each

AIR = {"f0": "48.9 kHz", "k": "0.9 N/m", "Q": 255}
HERTZ = {"model": "hertz"}
DMT = {"model": "dmt", "hamaker": "2e-20 J"}
DRAG = {"model": "kelvin_voigt", "viscosity": "100 Pa s"}
SHARP = {"radius": "2 nm"}
STIFF = {"youngs_modulus": "1 GPa", "poisson_ratio": 0.3}
TWO_MODES = [{"f0": "48.9 kHz", "k": "0.9 N/m"}, {"f0": "282 kHz", "k": "28 N/m"}]


def two_modes(*Q):
    return {"modes": [mode | {"Q": one} for mode, one in zip(TWO_MODES, Q, strict=True)]}


def case(lever, forces, zc, tip=SHARP, sample=STIFF, solver=None, **drive):
    return df.Case(
        cantilever=lever,
        drive={"operation": "fm"} | drive,
        tip=tip,
        sample=sample,
        forces=forces,
        experiment={"kind": "approach", "zc": [zc]},
        solver=solver or {},
    )


ROWS = {
    "S1a": (
        {"lever": AIR, "forces": [DMT], "zc": "12 nm", "A0": "10 nm"},
        {
            "frequency_shift": "-1.2412634564",
            "drive_force": "3.5293221777e-11",
            "mean_deflection": "-3.0459811858e-13",
            "virial": "2.2845049738e-21",
            "second_harmonic": "1.23155819e-13",
        },
    ),
    "S1b": (
        {"lever": AIR, "forces": [DMT], "zc": "10.2 nm", "A0": "10 nm"},
        {
            "frequency_shift": "-44.4831237",
            "drive_force": "3.5262084049e-11",
            "mean_deflection": "-9.2761992e-12",
            "virial": "8.18335419e-20",
            "second_harmonic": "5.7929652e-12",
        },
    ),
    "S1c": (
        {"lever": AIR, "forces": [DMT], "zc": "9.5 nm", "A0": "10 nm"},
        {
            "frequency_shift": "252.15802",
            "drive_force": "3.54789277e-11",
            "mean_deflection": "5.1595464e-11",
            "virial": "-4.6529110e-19",
            "second_harmonic": "3.407754e-11",
        },
    ),
    "S2a": (
        {"lever": AIR | {"Q": 100}, "forces": [HERTZ], "zc": "4 nm", "A0": "4.2 nm"},
        {
            "frequency_shift": "442.8092277",
            "drive_force": "3.814965522e-11",
            "mean_deflection": "3.87286455e-11",
            "virial": "-1.44414503e-19",
            "second_harmonic": "2.38643e-11",
            "dissipated_energy": "9.7126e-23",
        },
    ),
    "S3a": (
        {"lever": AIR | {"Q": 2}, "forces": [HERTZ], "zc": "4.5 nm", "A0": "5 nm"},
        {
            "frequency_shift": "1036.966215",
            "drive_force": "2.29969616e-9",
            "mean_deflection": "1.092488281e-10",
            "virial": "-4.82190686e-19",
            "dissipated_energy": "3.114874985e-20",
            "second_harmonic": "6.06701446e-11",
        },
    ),
    "S3b": (
        {
            "lever": AIR | {"Q": 2},
            "forces": [HERTZ],
            "zc": "4.5 nm",
            "A0": "5 nm",
            "phase_set_point": "75.036782567 deg",
        },
        {
            "drive_frequency": "46808.0471112",
            "drive_force": "2.2321495708e-9",
            "virial": "-4.98880501e-19",
            "dissipated_energy": "4.2676336e-20",
        },
    ),
    "S4a": (
        {
            "lever": {"f0": "49 kHz", "k": "0.9 N/m", "Q": 50},
            "forces": [HERTZ, DRAG],
            "zc": "8 nm",
            "A0": "9 nm",
            "sample": STIFF | {"youngs_modulus": "50 MPa"},
        },
        {
            "frequency_shift": "73.4221824",
            "drive_force": "1.691291067e-10",
            "mean_deflection": "1.38026759e-11",
            "virial": "-1.093160655e-19",
            "dissipated_energy": "1.94707353e-19",
        },
    ),
    "S5a": (
        {
            "lever": {"f0": "300 kHz", "k": "40 N/m", "Q": 300},
            "forces": [{"model": "lennard_jones", "work_of_adhesion": "0.05 J/m^2"}],
            "zc": "10.3 nm",
            "A0": "10 nm",
            "tip": {"radius": "10 nm"},
        },
        {
            "frequency_shift": "-56.771273197",
            "drive_force": "1.3330811258e-9",
            "mean_deflection": "-1.9491696e-12",
            "virial": "7.5687868758e-19",
        },
    ),
    "S6a": (
        {
            "lever": {"f0": "30 kHz", "k": "1800 N/m", "Q": 1e4},
            "forces": [{"model": "morse"}],
            "zc": "0.4 nm",
            "A0": "0.1 nm",
        },
        {
            "frequency_shift": "-60.569869399",
            "drive_force": "1.7963665814e-11",
            "mean_deflection": "-3.7343466186e-13",
            "virial": "3.6305234549e-20",
        },
    ),
    "S7a": (
        {"lever": AIR, "forces": [DMT], "zc": "9.5 nm", "A0": "10 nm", "operation": "ce_fm"},
        {"amplitude": "9.9572247e-9", "frequency_shift": "207.3166", "mean_force": "3.78947549e-11"},
    ),
    "S7b": (
        {
            "lever": {"f0": "49 kHz", "k": "0.9 N/m", "Q": 50},
            "forces": [HERTZ, DRAG],
            "zc": "8 nm",
            "A0": "9 nm",
            "sample": STIFF | {"youngs_modulus": "50 MPa"},
            "operation": "ce_fm",
        },
        {"amplitude": "8.751010037e-9", "frequency_shift": "47.627398", "dissipated_energy": "1.19005464e-19"},
    ),
    "S8a": (
        {"lever": AIR, "forces": [DMT], "zc": "10.2 nm", "A0": "10 nm", "operation": "pm"},
        {"phase": "114.8817476", "drive_force": "3.8905469805e-11"},
    ),
    "S9a": (
        {
            "lever": two_modes(100, 200),
            "forces": [HERTZ],
            "zc": "4 nm",
            "A0": "4.2 nm",
            "tip": {"radius": "20 nm"},
            "signal": "mode",
        },
        {
            "frequency_shift": "1152.46933",
            "drive_force": "3.9155216e-11",
            "amplitude": "4.193353821e-9",
            "phase": "89.980422",
        },
    ),
    "S9b": (
        {"lever": two_modes(100, 200), "forces": [HERTZ], "zc": "4 nm", "A0": "4.2 nm", "tip": {"radius": "20 nm"}},
        {"drive_frequency": "50083.88608", "drive_force": "3.92599445e-11", "reference_frequency": "48900.0810258"},
    ),
    "S9c": (
        {
            "lever": two_modes(100, 200),
            "forces": [HERTZ],
            "zc": "4 nm",
            "A0": "4.2 nm",
            "tip": {"radius": "20 nm"},
            "signal": "mode",
            "acts_on": "own_mode",
        },
        {"frequency_shift": "1152.46262", "drive_force": "3.90932325e-11"},
    ),
    "S10a": (
        {"lever": two_modes(2, 5), "forces": [HERTZ], "zc": "4.5 nm", "A0": "5 nm"},
        {"drive_frequency": "50075.3415669", "drive_force": "2.3137814594e-9", "reference_frequency": "49103.6769838"},
    ),
    "S10b": (
        {"lever": two_modes(2, 5), "forces": [HERTZ], "zc": "4.5 nm", "A0": "5 nm", "signal": "mode"},
        {"frequency_shift": "961.5063582", "drive_force": "2.301627375e-9"},
    ),
}


SHARED = 2e-8  # digits behind the eighth are those of shooting alone


def value_of(curve, name):
    if name == "reference_frequency":
        return curve.attrs[name]
    if name == "second_harmonic":
        return float(curve["harmonic_amplitude"].values[0, 1])
    return float(np.ravel(curve[name].values)[0])


def last_digit(text):
    mantissa, _, exponent = text.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


@pytest.mark.parametrize("row", ROWS)
def test_locked_states_have_the_values_of_two_other_programs(row):
    given, expected = ROWS[row]
    curve = df.run(case(**given, solver={"integrator": "engine", "accuracy": 1e-11}))
    found = {name: (value_of(curve, name), text) for name, text in expected.items()}

    def is_near(value, text):
        return abs(value - float(text)) <= max(2.0 * last_digit(text), SHARED * abs(float(text)))

    wrong = {name: pair for name, pair in found.items() if not is_near(*pair)}
    assert not wrong


@pytest.mark.parametrize("row", ROWS)
def test_the_default_accuracy_is_kept_by_locked_states(row):
    given, expected = ROWS[row]
    asked = case(**given)
    curve, mode = df.run(asked), asked.problem.modes[0]
    amplitude = asked.problem.tones[0].A0
    energy = mode.k * amplitude**2 / mode.Q
    scales = {
        "frequency_shift": mode.f0 / mode.Q,
        "drive_frequency": mode.f0 / mode.Q,
        "reference_frequency": mode.f0 / mode.Q,
        "drive_force": mode.k * amplitude / mode.Q,
        "mean_force": float(np.abs(curve[["peak_force", "min_force"]].to_array()).sum()),
        "virial": energy,
        "dissipated_energy": energy,
        "phase": 57.3,
    }
    assert int(curve["status"].values[0]) == 0
    for name, text in expected.items():
        assert value_of(curve, name) == pytest.approx(float(text), abs=1e-4 * scales.get(name, amplitude)), name


def imbalance(curve, problem):
    """Return by how much a mode's equation at its tone is missed, in units of the drive at resonance."""
    mode, first = problem.modes[0], {"mode": 0, "tone": 0}
    one = curve.isel(first)
    A, phase = one["mode_amplitude"], np.radians(one["mode_phase"])
    r, F0 = one["drive_frequency"] / mode.f0, one["drive_force"]
    in_phase = mode.k * A * (1.0 - r**2) - F0 * np.cos(phase) - 2.0 * one["virial"] / A
    quadrature = mode.k * A * r / mode.Q - F0 * np.sin(phase) + one["dissipated_energy"] / (np.pi * A)
    return float(np.hypot(in_phase, quadrature).max() * mode.Q / (mode.k * problem.tones[0].A0))


STIFF_LEVER = {"f0": "300 kHz", "k": "40 N/m", "Q": 400}
FORCES = {
    "memory": [{"model": "sls"}],
    "a branch": [{"model": "jkr", "surface_energy": "0.02 J/m^2"}],
    "a neck": [HERTZ, {"model": "capillary"}],
}


@pytest.mark.parametrize("forces", FORCES)
@pytest.mark.parametrize("operation", ["fm", "pm"])
def test_locked_states_obey_the_equation_of_motion_whatever_the_force_remembers(forces, operation):
    asked = case(
        STIFF_LEVER,
        FORCES[forces],
        "20 nm",
        tip={"radius": "10 nm"},
        sample=STIFF | {"youngs_modulus": "2 GPa"},
        A0="20 nm",
        operation=operation,
    ).replace("experiment", {"kind": "approach", "zc": ["21 nm", "19 nm", "16 nm"], "direction": "both"})
    curve = df.run(asked)
    assert (curve["status"].values == 0).all()
    assert imbalance(curve, asked.problem) < 1e-5


SHIPPED = sorted(set(REGISTRY) - {"custom"})
OK, UNRESOLVED, NO_STATE = 0, 5, 8
STEEP = "lennard_jones"  # a wall of rigid bodies, which no number of samples may resolve


def random_case(force, seed):
    """Return a case with levers of air and water, from free motion to light contact."""
    chosen = np.random.default_rng([seed, SHIPPED.index(force)])
    k, Q, A = 10.0 ** chosen.uniform([0.0, 0.3, -8.3], [2.0, 2.7, -7.3])
    return df.Case(
        cantilever={"f0": "100 kHz", "k": k, "Q": Q},
        drive={"A0": A, "operation": ["fm", "ce_fm", "pm"][seed % 3]},
        tip={"radius": "10 nm", "youngs_modulus": "170 GPa", "poisson_ratio": 0.28, "half_angle": "20 deg"},
        sample=STIFF | {"thickness": "500 nm", "radius": "50 nm"},
        medium={"temperature": 298.15, "permittivity": 78.5},
        forces=[REGISTRY[force](**REGISTRY[force].example)],
        experiment={"kind": "approach", "zc": [1.5 * A + 2e-9, 1.1 * A + 1e-9, 1.02 * A, 0.99 * A]},
    )


@pytest.mark.parametrize("force", some_long(SHIPPED, set(SHIPPED) - {"dmt", "hertz", "jkr", "sls"}))
def test_random_locked_states_obey_the_equation_of_motion_under_every_force(force):
    remembers = bool(REGISTRY[force](**REGISTRY[force].example).memory)
    for seed in range(3):
        asked = random_case(force, seed)
        curve = df.run(asked)
        status = curve["status"].values
        # a drive may be too weak for the losses, or the tip stick to the sample
        assert set(status.tolist()) <= {OK, NO_STATE, UNRESOLVED if force == STEEP else OK}
        assert (status[:2] == OK).all()
        assert imbalance(curve.isel(zc=status == OK), asked.problem) < 1e-5
        if not remembers:  # the engine finds no orbit with a memory
            exact = df.run(asked.replace(solver={"integrator": "engine", "accuracy": 1e-11}))
            assert imbalance(exact, asked.problem) < 1e-9


def test_equations_with_many_small_pivots_have_a_solution():
    pivots = np.full(40, 1e-9)  # the numbers of a force with many states: their product is no number above 0
    solved = solve_each(np.stack([np.diag(pivots), np.zeros((40, 40))]), np.ones((2, 40, 1)))
    np.testing.assert_allclose(solved[0, :, 0], 1e9, rtol=1e-12)
    assert np.isnan(solved[1]).all()


def test_a_driven_base_is_locked_by_the_signal_of_the_detector():
    asked = case(AIR | {"Q": 2}, [HERTZ], "4.5 nm", A0="5 nm", excitation="base")
    curve = df.run(asked)
    assert int(curve["status"].values[0]) == 0
    assert float(curve["phase"].values[0, 0]) == pytest.approx(90.0, abs=1e-6)
    assert float(curve["amplitude"].values[0, 0]) == pytest.approx(5e-9, rel=1e-8)
    # the same motion in amplitude modulation, at the frequency and the base that were found
    found = asked.replace("drive.operation", "am")
    ratio = float(curve["drive_ratio"].values[0, 0])
    base = ratio * asked.problem.tones[0].base
    again = df.run(
        found.replace(
            "drive",
            {"base_amplitude": base, "frequency": float(curve["drive_frequency"].values[0, 0]), "excitation": "base"},
        )
    )
    for name in ("amplitude", "phase", "peak_force", "mean_deflection"):
        np.testing.assert_allclose(again[name].values, curve[name].values, rtol=2e-4)


def test_a_curve_in_fm_passes_through_the_bistable_range_of_tapping_without_a_jump():
    asked = df.load_case("hysteresis").replace("drive.operation", "fm")
    curve = df.run(asked).sel(direction="approach")
    assert (curve["status"].values == 0).all()
    within = (
        curve.sel(zc=slice(19.11e-9, 19.79e-9))
        if curve["zc"][0] < curve["zc"][-1]
        else curve.sel(zc=slice(19.79e-9, 19.11e-9))
    )
    assert within.sizes["zc"] > 5
    slopes = np.abs(np.diff(within["frequency_shift"].values[:, 0]))
    assert slopes.max() < 3.0 * np.median(slopes) + 5.0  # Hz between neighbors
    assert imbalance(curve, asked.problem) < 1e-5


def test_a_dwell_records_the_motion_that_is_locked():
    dwell = df.run(case(AIR, [DMT], "9.5 nm", A0="10 nm").replace("experiment", {"kind": "dwell", "zc": "9.5 nm"}))
    deflection = dwell["deflection"].values
    assert np.ptp(deflection) / 2.0 == pytest.approx(float(dwell["half_peak_to_peak"]), rel=1e-3)
    period = 1.0 / float(dwell["drive_frequency"].values[0])
    steps = np.diff(dwell["time"].values)
    assert steps[0] * dwell.attrs["samples_per_period"] == pytest.approx(period, rel=1e-9)
    each = int(dwell.attrs["samples_per_period"])
    np.testing.assert_allclose(deflection[:each], deflection[each : 2 * each], atol=1e-6 * 10e-9)


def test_a_sweep_of_locked_curves_has_the_curves_of_its_cases():
    asked = case(AIR, [DMT], "9.5 nm", A0="10 nm")
    swept = df.sweep(asked, over={"sample.youngs_modulus": [0.1e9, 1e9]})
    one = df.run(asked)
    np.testing.assert_array_equal(swept["frequency_shift"].values[1], one["frequency_shift"].values)
    assert swept["frequency_shift"].values[0, 0, 0] < swept["frequency_shift"].values[1, 0, 0]


def test_mean_stiffness_and_normalized_shift_follow_from_the_frequency_that_is_found():
    curve = df.run(case(AIR, [DMT], "9.5 nm", A0="10 nm"))
    f0, k, f = 48.9e3, 0.9, float(curve["drive_frequency"].values[0, 0])
    # relative to the resonance's width, k/Q
    assert float(curve["mean_stiffness"].values[0, 0]) == pytest.approx(k * ((f / f0) ** 2 - 1.0), abs=1e-4 * k / 255)
    normalized = k * 10e-9**1.5 * (f - f0) / f0
    assert float(curve["normalized_frequency_shift"].values[0, 0]) == pytest.approx(normalized, rel=1e-6, abs=0.0)
    # an optical lever that was calibrated by a force curve reads 0.917670 of the motion
    optical = case(AIR, [DMT], "9.5 nm", A0=9.17670323115e-9).replace("readout", {"kind": "optical_lever"})
    read = df.run(optical)["normalized_frequency_shift"].values[0, 0]
    assert read == pytest.approx(normalized, rel=1e-4, abs=0.0)


def test_a_mode_without_a_tone_has_no_mean_stiffness():
    modes = [{"f0": "48.9 kHz", "k": "0.9 N/m", "Q": 255}, {"f0": "306 kHz", "k": "35 N/m", "Q": 500}]
    curve = df.run(case(AIR, [DMT], "9.5 nm", A0="10 nm").replace(cantilever={"modes": modes}))
    first, second = curve["mean_stiffness"].values[0]
    assert np.isfinite(first)
    assert np.isnan(second)  # its motion at the first tone is an answer to all forces: -2 V/A^2 was -28.7 N/m


def test_states_at_a_frequency_shift_lie_on_the_curve():
    zc = {"start": "12 nm", "stop": "9.4 nm", "points": 261}
    asked = case(AIR, [DMT], "9.5 nm", A0="10 nm").replace("experiment", {"kind": "approach", "zc": zc})
    states = df.at_set_point(df.run(asked), frequency_shift="-40 Hz")
    assert states.sizes["crossing"] == 2
    for at in states["zc"].values:
        there = df.run(asked.replace("experiment", {"kind": "approach", "zc": [float(at)]}))
        assert float(there["frequency_shift"].values[0, 0]) == pytest.approx(-40.0, abs=0.1)
    with pytest.raises(df.ParameterError, match="write frequency_shift"):
        df.at_set_point(df.run(asked), set_point=0.8)  # of an amplitude that is held


def test_states_at_a_set_point_are_solved_with_the_distance_as_an_unknown():
    coarse = {"start": "12 nm", "stop": "9.4 nm", "points": 14}
    asked = case(AIR, [DMT], "9.5 nm", A0="10 nm").replace("experiment", {"kind": "approach", "zc": coarse})
    weak = case(
        {"f0": "49 kHz", "k": "0.9 N/m", "Q": 50},
        [HERTZ, DRAG],
        "8 nm",
        A0="9 nm",
        sample=STIFF | {"youngs_modulus": "50 MPa"},
        operation="ce_fm",
    ).replace("experiment", {"kind": "approach", "zc": {"start": "9.5 nm", "stop": "6 nm", "points": 8}})
    for case_, name, wanted, set_point in (
        (asked, "frequency_shift", -40.0, {"frequency_shift": "-40 Hz"}),
        (weak, "amplitude_ratio", 0.9, {"set_point": 0.9}),
    ):
        states = df.at_set_point(df.run(case_), **set_point)
        assert states.sizes["crossing"] == (2 if case_ is asked else 1)
        assert np.ravel(states[name].values) == pytest.approx(wanted, rel=1e-9)
        for at, force in zip(states["zc"].values.tolist(), states["peak_force"].values.tolist(), strict=True):
            there = df.run(case_.replace("experiment", {"kind": "approach", "zc": [at]}))
            assert float(np.ravel(there[name].values)[0]) == pytest.approx(wanted, rel=1e-5)
            assert force == pytest.approx(float(there["peak_force"].values[0]), rel=1e-4)


def test_a_drive_too_weak_for_the_sample_ends_the_state_and_says_so():
    sticky, zc = FORCES["a branch"], {"start": "6 nm", "stop": "1 nm", "points": 26}
    asked = case(STIFF_LEVER, sticky, "2 nm", A0="2 nm", tip={"radius": "10 nm"}, operation="ce_fm").replace(
        "experiment", {"kind": "approach", "zc": zc}
    )
    curve = df.run(asked)
    status = curve["status"].values[np.argsort(-curve["zc"].values)]
    ended = status == 8
    assert status[0] == 0 and ended.any()
    assert (np.diff(ended.astype(int)) >= 0).all()  # and it does not come back
    assert np.isnan(curve["amplitude"].values[curve["status"].values == 8]).all()


SNAPPING = {  # the spring at full amplitude, 6.4 nN, is weaker than the adhesion, 7.6 nN
    "lever": {"f0": "100 kHz", "k": "10.6 N/m", "Q": 14.5},
    "forces": [{"model": "dmt", "hamaker": "5.25e-20 J"}],
    "zc": "1 nm",
    "tip": {"radius": "23.7 nm"},
    "sample": STIFF | {"youngs_modulus": "108 MPa"},
    "A0": "0.604 nm",
    "operation": "ce_fm",
}


def test_where_the_mean_deflection_snaps_a_curve_jumps_to_the_state_behind_and_back_at_another_distance():
    asked, zc = case(**SNAPPING), np.linspace(1.0e-9, 0.9e-9, 41)
    curve = df.approach(asked, zc=zc, direction="both")
    assert (curve["status"].values == 0).all()
    assert imbalance(curve.stack(point=("zc", "direction")), asked.problem) < 1e-5
    jumped = dict(zip(curve["jump_direction"].values.tolist(), curve["jump_zc"].values.tolist(), strict=True))
    assert jumped["approach"] < jumped["retract"]
    apart = np.abs(np.ptp(curve["frequency_shift"].values[..., 0], axis=1))
    between = (zc > jumped["approach"]) & (zc < jumped["retract"])
    assert (apart[between] > 5e3).all()  # Hz: other states than on the way back
    assert (apart[~between] < 1.0).all()


def test_branches_show_the_states_of_both_directions_and_an_unstable_one_between():
    asked = case(**SNAPPING)
    states = df.branches(asked, zc=("1 nm", "0.9 nm"))
    assert (states["status"].values == 0).all()
    folds = np.sort(states["zc"].values[states["special"].values == "fold"])
    curve = df.approach(asked, zc=[1.0e-9, 0.5 * (folds[0] + folds[-1]), 0.9e-9], direction="both")
    np.testing.assert_allclose(np.sort(curve["jump_zc"].values), folds[[0, -1]], atol=1e-4 * 0.604e-9)
    found = at_distance(states, float(curve["zc"].values[1]), ["frequency_shift"])
    shifts, stable = found["frequency_shift"].values[:, 0], found["stable"].values
    assert len(shifts) == 3
    assert stable[np.argsort(shifts)].tolist() == [True, False, True]
    np.testing.assert_allclose(np.sort(shifts[stable]), np.sort(curve["frequency_shift"].values[1].ravel()), rtol=3e-3)


STICKY = {  # a neck takes energy at each tap
    "lever": {"f0": "70 kHz", "k": "2 N/m", "Q": 100},
    "forces": [{"model": "capillary"}, HERTZ],
    "zc": "12 nm",
    "A0": "20 nm",
    "tip": {"radius": "20 nm"},
    "sample": STIFF | {"youngs_modulus": "2 GPa"},
    "operation": "ce_fm",
}


def in_time(one, amplitude, loops):
    """Return what loops make of a motion of an amplitude (m)."""
    start = Motion((0.0, amplitude / one.tones[0].A0), np.zeros(0), np.zeros(len(one.forces) - 1), 0)
    found = controlled(Engine(one, df.SolverSettings(settle_tolerance=1e-5), 0), [12e-9], start, [loops])
    assert found.settled
    return found.amplitude[-1, 0], found.frequency[-1, 0]


def test_branches_find_the_states_that_no_curve_connects_with_the_free_lock():
    asked = case(**STICKY)
    states = df.branches(asked, zc=("25 nm", "5 nm"))
    assert states.attrs["completeness"].startswith("not proven: a lock")
    first, second = (states.isel(point=states["branch"].values == number) for number in (1, 2))
    assert first["zc"].min() > 20e-9 > 19e-9 > second["zc"].max()
    there = second.isel(point=second["stable"].values)
    x, order = there["zc"].values, np.argsort(there["zc"].values)
    amplitude, frequency = in_time(
        asked.problem.unlocked, 6e-9, ToneControllers(math.pi / 2.0, None, phase_bandwidth=3500.0)
    )
    # straight lines between points of the curve, up to 0.2 nm apart
    for name, found in (("amplitude", amplitude), ("drive_frequency", frequency)):
        assert np.interp(12e-9, x[order], there[name].values[order, 0]) == pytest.approx(found, rel=1e-3)


def test_a_curve_goes_on_where_controllers_lead_behind_the_end_of_a_state():
    asked = case(**STICKY)
    curve = df.approach(asked, zc=["22 nm", "20 nm", "19.5 nm", "18 nm", "12 nm"])
    assert (curve["status"].values == df.Status.NO_STATE).tolist() == [False, True, True, False, False]
    [jump] = curve["jump_zc"].values
    assert jump == pytest.approx(20.5e-9, abs=1e-3 * 20e-9)  # the neck forms at 0.5 nm
    loops = ToneControllers(math.pi / 2.0, None, phase_bandwidth=3500.0)
    amplitude, frequency = in_time(asked.problem.unlocked, 6e-9, loops)
    assert float(curve["amplitude"][-1, 0]) == pytest.approx(amplitude, rel=1e-4)
    assert float(curve["drive_frequency"][-1, 0]) == pytest.approx(frequency, rel=1e-5)


def test_a_search_for_states_of_a_lock_finds_none_where_all_motions_lead_to_the_one_that_is_known():
    asked = case(AIR, [DMT], "9.6 nm", A0="10 nm")
    states = df.branches(asked, zc=("12 nm", "9.4 nm"), search=3)
    assert len(states["searched"]) == 3 and set(states["branch"].values.tolist()) == {1}


def test_a_sweep_in_phase_modulation_passes_the_phase_of_fm_at_its_frequency_and_drive():
    asked = case(AIR, [DMT], "9.5 nm", A0="10 nm")
    fm = df.run(asked)
    found = float(fm["drive_frequency"].values[0, 0])
    sweep = df.frequency_sweep(
        asked.replace("drive.operation", "pm"), zc="9.5 nm", frequency=[48.5e3, found, 49.5e3], direction="up"
    )
    assert (sweep["status"].values == 0).all()
    np.testing.assert_allclose(sweep["drive_frequency"].values[:, 0], sweep["frequency"].values, rtol=1e-12)
    assert float(sweep["phase"].values[1, 0]) == pytest.approx(90.0, abs=1e-4)
    assert float(sweep["drive_force"].values[1, 0]) == pytest.approx(float(fm["drive_force"].values[0, 0]), rel=1e-6)
    np.testing.assert_allclose(sweep["amplitude"].values, 10e-9, rtol=1e-7)  # a thousandth of the accuracy
    assert imbalance(sweep, asked.problem) < 1e-5


REFUSED = {
    "a frequency": ({"frequency": "49 kHz"}, "remove frequency"),
    "no phase": ({"operation": "pm", "phase_set_point": "80 deg"}, "holds no phase"),
    "a phase of 180 degrees": ({"phase_set_point": "180 deg"}, "not below 180 deg"),
    "a signal without a lock": ({"operation": "am", "signal": "mode"}, "remove signal"),
    "a base amplitude": ({"A0": None, "base_amplitude": "1 nm", "excitation": "base"}, "write A0 instead"),
    "an unknown operation": ({"operation": "dam"}, "operation"),
    "an operation in capitals": ({"operation": "FM"}, "did you mean 'fm'"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_lock_that_nothing_can_hold_is_refused_in_a_sentence(what):
    given, words = REFUSED[what]
    with pytest.raises(df.ParameterError, match=words):
        case(AIR, [DMT], "9 nm", **({"A0": "10 nm"} | given))


def test_what_does_not_suit_a_lock_is_refused_in_a_sentence():
    asked = case(AIR, [DMT], "9.5 nm", A0="10 nm")
    with pytest.raises(df.ParameterError, match=r"experiment\.parameter = tip\.radius needs drive\.operation"):
        df.branches(asked, zc="9 nm", parameter="tip.radius", start="2 nm", stop="3 nm")
    curve = df.run(asked)
    grid = {"drive.A0": ["9 nm", "10 nm"], "sample.youngs_modulus": ["1 GPa", "2 GPa"]}
    for attempt in (
        lambda: df.frequency_sweep(asked, zc="9.5 nm", frequency=("48 kHz", "49 kHz")),
        lambda: df.basins(asked, zc="9.5 nm"),
        lambda: df.noise(curve, bandwidth="1 kHz"),
        lambda: df.reconstruct(curve),
        lambda: df.regimes(asked, over=grid, set_points=[0.8]),
        lambda: asked.replace("solver.method", "transient"),
        lambda: df.approach(asked, zc=["9.5 nm"], protocol="stepwise"),
        lambda: df.dwell(asked, zc="9.5 nm", record="all"),
    ):
        with pytest.raises(df.ParameterError, match=r"drive\.operation"):
            attempt()
