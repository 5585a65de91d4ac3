"""A base that is shaken: against independent integrators, and every experiment against every other."""

import math

import numpy as np
import pytest
from compiled import ProblemBatch, retune
from tiers import some_long

import dforce as df
from dforce import kernel
from dforce.checks.validation.comparison import find
from dforce.checks.validation.draws import FAMILIES, draw
from dforce.checks.validation.identities import closures, limit
from dforce.core.errors import ParameterError
from dforce.experiments import InitialMotion
from dforce.forces import REGISTRY
from dforce.instrument import beam

WATER = {"f0": 25e3, "k": 0.1, "Q": 2.5}
SECOND = {"f0": 160e3, "k": 4.0, "Q": 5}
BASE = {"A0": 10e-9, "excitation": "base"}
DMT = {"model": "dmt", "hamaker": 0.5e-20}
CASES = {
    "force": (WATER, {"A0": 10e-9}, []),
    "point mass": (WATER | {"base_coupling": 1.0}, BASE, []),
    "beam": (WATER, BASE, []),
    "20 kHz": (WATER, BASE | {"frequency": 20e3}, []),
    "viscous": (WATER, BASE, [{"model": "kelvin_voigt", "viscosity": 5.0}]),
    "fluid follows": (WATER | {"added_mass": 0.8}, BASE | {"fluid_follows": 1.0}, []),
    "two modes": ({"modes": [WATER, SECOND]}, BASE, []),
    "two modes, force": ({"modes": [WATER, SECOND]}, {"A0": 10e-9}, []),
}
# Y, A, phase, tip amplitude, tip phase, mean deflection, E_1, E_base, E, what a user's formula gives: SciPy's DOP853 and
# LSODA, piecewise between the crossings of a0, agree to nine digits
EXPECTED = {
    "force": (0.0, 9.3150345748e-9, 70.8005851, 0.0, 0.0, 0.6520042535e-9, 1.50724705e-19, 0.0, 0.0, 1.50724705e-19),
    "point mass": (
        3.713906763541e-9, 8.8716751995e-9, 100.6397062, 8.9628661695e-9, 76.6080046, 0.4173377778e-9,
        1.0470341174e-18, -9.68832779e-19, 0.0, 1.0662415042e-18,
    ),
    "beam": (
        2.371612941576e-9, 9.0762897742e-9, 99.0085364, 9.0145773971e-9, 83.9478931, 0.4509642931e-9,
        7.7042478e-19, -6.83291396e-19, 0.0, 9.1285929e-19,
    ),
    "20 kHz": (
        4.298548456606e-9, 6.4341943168e-9, 64.8462064, 9.1317113627e-9, 39.6266218, 0.8668582344e-9,
        1.86989211e-18, -1.25936075e-18, 0.0, 1.6930971e-18,
    ),
    "viscous": (
        2.371612941576e-9, 9.0763477519e-9, 99.4934648, 8.9946643883e-9, 84.4199750, 0.4357429294e-9,
        7.91339997e-19, -6.60692623e-19, 4.74853183e-20, 8.9728040e-19,
    ),
    "fluid follows": (
        12.771526549e-9, 1.5902490488e-9, 203.5818272, 11.331952215e-9, 356.7816387 - 360.0, 2.187442671e-9,
        None, 2.3390817e-18, 0.0, -1.117252936e-18,
    ),
    "two modes": (
        2.371612941576e-9, 9.1675378692e-9, 102.7364796, 8.9488303810e-9, 87.7555012, 0.3432389435e-9,
        (7.23664109e-19, 8.504127e-21), -5.19808384e-19, 0.0, 6.7555525e-19,
    ),
    "two modes, force": (
        0.0, 9.3145667050e-9, 73.1423808, 0.0, 0.0, 0.5669759410e-9,
        (3.37492433e-19, -3.345831e-20), 0.0, 0.0, 2.9931727e-19,
    ),
}  # fmt: skip
# eight digits are given of energies; the harmonics of an error of 1e-9 in the motion cost them two
LENGTH, ANGLE, ENERGY = 3e-8, 3e-6, 1e-25
EXACT = {"method": "transient", "integrator": "engine", "relative_tolerance": 1e-10}


def case(lever=WATER, drive=BASE, more=(), **others):
    return df.Case(
        cantilever=lever, drive=drive, tip={"radius": 10e-9}, sample={"youngs_modulus": 50e6, "poisson_ratio": 0.5},
        forces=[DMT, *more], **others,
    )  # fmt: skip


@pytest.mark.parametrize("name", some_long(CASES, ["viscous", "two modes", "two modes, force"]))
def test_motion_and_energies_are_those_of_independent_integrators(name):
    lever, drive, more = CASES[name]
    base, amplitude, phase, tip, tip_phase, mean, energy, through, total, apparent = EXPECTED[name]
    asked = case(lever, drive, more, solver=EXACT)
    found = df.dwell(asked, zc="7 nm")
    assert abs(asked.problem.base[0]) == pytest.approx(base, rel=1e-11)
    assert found.amplitude.item() == pytest.approx(amplitude, rel=LENGTH)
    assert found.phase.item() == pytest.approx(phase, abs=ANGLE)
    assert found.mean_deflection.item() == pytest.approx(mean, rel=10.0 * LENGTH)
    if base:
        assert found.tip_amplitude.item() == pytest.approx(tip, rel=LENGTH)
        assert found.tip_phase.item() == pytest.approx(tip_phase, abs=ANGLE)
        assert found.base_energy.item() == pytest.approx(through, abs=10.0 * ENERGY, rel=1e-6)
    if energy is not None:
        assert found.dissipated_energy.values == pytest.approx(np.atleast_1d(energy), rel=1e-6, abs=ENERGY)
    assert found.total_dissipated_energy.item() == pytest.approx(total, abs=1e-24, rel=1e-6)
    assert found.apparent_dissipated_energy.item() == pytest.approx(apparent, rel=1e-6)


def test_both_modes_over_a_base_move_as_given():
    found = df.dwell(case({"modes": [WATER, SECOND]}, BASE, solver=EXACT), zc="7 nm")
    assert found.mode_amplitude.values == pytest.approx([9.2398138737e-9, 0.0997266136e-9], rel=1e-7)
    assert found.mode_phase.values == pytest.approx([102.3087107, 238.9695139], abs=1e-5)


def test_a_base_drives_the_tip_of_a_point_mass_as_a_force_does():
    many = {"points_per_period": 1024}  # the lever alone is exact in both, the force to h^4
    shaken = df.dwell(case(WATER | {"base_coupling": 1.0}, solver=many), zc="7 nm")
    base = shaken.base_amplitude.item()
    forced = df.dwell(case(WATER, {"A0": base * WATER["Q"]}, solver=many), zc="7 nm")
    assert shaken.tip_amplitude.item() == pytest.approx(forced.amplitude.item(), rel=1e-12)
    assert shaken.tip_phase.item() == pytest.approx(forced.phase.item(), abs=1e-9)


def test_free_motion_lags_by_90_degrees_and_a_part_that_falls_with_Q():
    for Q in (2.0, 300.0):
        problem = df.Case(cantilever=WATER | {"Q": Q}, drive=BASE).problem
        lag = -math.degrees(np.angle(problem.free[0, 0])) % 360.0
        assert lag == pytest.approx(90.0 + math.degrees(math.atan(1.0 / Q)), abs=1e-10)
        assert abs(problem.free[0, 0]) == pytest.approx(10e-9, rel=1e-13)
        moved = 10e-9 / (1.565983512079 * math.hypot(1.0, Q))
        assert abs(problem.base[0]) == pytest.approx(moved, rel=1e-11)


def test_couplings_of_a_uniform_beam_add_up_to_one():
    expected = (1.565983512079, -0.867871790221, 0.508850593732, -0.363796043274, 0.282941681799)
    assert [beam.base_coupling(n) for n in range(1, 6)] == pytest.approx(expected, abs=1e-12)
    # what is left out falls as the last one
    assert sum(beam.base_coupling(n) for n in range(1, 10)) == pytest.approx(1.0, abs=0.1)


def test_three_modes_of_a_beam_in_water_respond_as_the_equations_say():
    size = {"youngs_modulus": 169e9, "density": 2330.0, "length": 225e-6, "width": 28e-6, "thickness": 3e-6}
    water = {"density": 997.0, "viscosity": 8.59e-4}
    drive = {"base_amplitude": "1 nm", "excitation": "base"}

    def response(**changes):
        # direct modes at another frequency, each with the mass and the Q that it has at its own resonance
        lever = df.Case(cantilever={"beam": size | {"modes": 3}}, drive=drive | changes, medium=water)
        return complex(lever.problem.free.sum()) / 1e-9

    assert df.Case(cantilever={"beam": size}, drive=drive, medium=water).problem.tones[0].frequency == pytest.approx(
        34648.95609714, rel=1e-12
    )
    assert response(frequency=34648.95609714) == pytest.approx(-1.583713504 - 6.574826141j, rel=1e-9)
    assert response(frequency=0.5 * 34648.95609714) == pytest.approx(0.4664838662 - 0.3165861994j, rel=1e-9)


def test_the_tables_of_a_lot_are_those_of_each_problem():
    asked = case(
        {"modes": [WATER, SECOND]},
        {"tones": [{"A0": 10e-9, "phase": 0.3}, {"A0": 1e-9, "lag": 0.2}], "excitation": "base"},
        experiment={"kind": "dwell", "zc": 7e-9},
    )
    over = {"drive.tones.1.A0": [5e-9, 12e-9], "cantilever.modes.1.Q": [2.0, 30.0], "sample.youngs_modulus": [1e7, 1e9]}
    from dforce.maps._grid import ProblemGrid
    from dforce.maps.axes import make_axes

    grid = ProblemGrid(asked, make_axes(asked, over))
    numbers = np.arange(grid.size)
    together, apart = grid.batch(numbers), ProblemBatch.of([grid.problem(int(i)) for i in numbers])
    np.testing.assert_allclose(together.tones, apart.tones, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(together.numbers, apart.numbers, rtol=1e-12)


@pytest.mark.parametrize("start", ["free", "rest", InitialMotion(amplitude="5 nm", phase="40 deg")])
def test_a_sweep_starts_and_finds_what_single_runs_do(start):
    asked = case(experiment={"kind": "approach", "zc": ["9 nm", "7 nm"], "start": start})
    grid = df.sweep(asked, over={"drive.A0": [8e-9, 10e-9]})
    for place, A0 in enumerate((8e-9, 10e-9)):
        alone = df.run(asked.replace("drive.A0", A0))
        for name in ("amplitude", "phase", "tip_phase", "base_energy", "min_deflection", "motion"):
            size = float(np.abs(alone[name]).max())
            np.testing.assert_allclose(grid[name].values[place], alone[name].values, atol=1e-9 * size)


def test_vectorized_starts_are_those_of_single_runs():
    from dforce.experiments.base import initial_motion
    from dforce.solvers.block import Block

    asked = case(drive=BASE | {"phase": 0.7})
    block = Block.of_one(asked.problem, asked.solver, 1)
    ready, batch = block.integrator(0, 7e-9), ProblemBatch.of([asked.problem])
    assert batch.free()[0] == pytest.approx(initial_motion(ready, "free").y, abs=1e-14)
    assert batch.moving(0, 0.0, 0.0)[0] == pytest.approx(initial_motion(ready, "rest").y, abs=1e-14)
    start = InitialMotion(amplitude="5 nm", phase="40 deg")
    assert batch.moving(0, 5e-9, math.radians(40.0))[0] == pytest.approx(initial_motion(ready, start).y, abs=1e-14)


@pytest.mark.parametrize("piezo", [None, {"f0": 60e3, "Q": 8.0}])
def test_retuned_tables_are_those_of_the_problem_at_the_frequency(piezo):
    drive = BASE | {"phase": 0.4, "lag": 0.1, "fluid_follows": 0.3} | ({"piezo": piezo} if piezo else {})
    problem = case(
        {"modes": [WATER | {"added_mass": 0.8}, SECOND | {"added_mass": 0.6}]}, drive | {"frequency": 24e3}
    ).problem
    there = problem.at_frequency(31e3)
    row = kernel.tone_table(problem)[0]
    retune(row, kernel.responses(problem)[0], 2, 31.0 / 24.0)
    assert row == pytest.approx(kernel.tone_table(there)[0], rel=1e-12, abs=1e-15)


def test_a_frequency_sweep_shakes_the_base_by_the_same_amplitude():
    asked = case(drive=BASE | {"piezo": {"f0": 60e3, "Q": 8.0}})
    swept = df.frequency_sweep(asked, frequency=["18 kHz", "25 kHz", "32 kHz"], zc="7 nm", direction="up")
    assert swept.base_amplitude.values[1, 0] == pytest.approx(2.371612941576e-9, rel=1e-11)
    static = swept.base_amplitude.values[1, 0] / abs(asked.problem.shaken.piezo_response(25e3))
    for place, frequency in enumerate((18e3, 25e3, 32e3)):
        moved = static * abs(asked.problem.shaken.piezo_response(frequency))
        drive = {"base_amplitude": moved, "frequency": frequency, "excitation": "base"}
        at = df.dwell(asked.replace(drive=df.Drive(**drive, piezo={"f0": 60e3, "Q": 8.0})), zc="7 nm")
        for name in ("amplitude", "phase", "tip_amplitude", "mean_deflection", "base_energy", "motion"):
            expected = np.atleast_1d(at[name].values)
            np.testing.assert_allclose(
                np.atleast_1d(swept[name].values[place]), expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max()
            )


def test_branches_and_basins_find_the_states_of_an_approach():
    asked = case().replace("solver.points_per_period", 256)  # in all of them
    curve = df.approach(asked, zc=["9 nm", "8 nm", "7 nm"])
    along = df.branches(asked, zc=("9 nm", "7 nm"))
    assert float(along.amplitude.values[-1, 0]) == pytest.approx(float(curve.amplitude[-1, 0]), rel=1e-6)
    assert float(along.phase.values[-1, 0]) == pytest.approx(float(curve.phase[-1, 0]), abs=1e-4)
    few = {"amplitude": {"start": "0 nm", "stop": "9 nm", "points": 3}, "phase": {"points": 4}}
    reached = df.basins(asked, zc="7 nm", **few)
    assert reached.sizes["state"] == 1
    assert float(reached.amplitude.values[0, 0]) == pytest.approx(float(curve.amplitude[-1, 0]), rel=1e-6)


def test_the_motion_of_a_point_is_found_anew():
    curve = df.approach(case().replace("solver.points_per_period", 256), zc=["9 nm", "7 nm"])
    again = df.motion_at(curve.isel(zc=1))
    assert again.amplitude.item() == pytest.approx(float(curve.amplitude[1, 0]), rel=1e-8, abs=0.0)
    z, v = again.deflection.values[0], again.base.values[0]
    assert curve.motion.values[1, 0] == pytest.approx(z, abs=1e-15)
    assert v == pytest.approx(curve.base_amplitude.values[1, 0], rel=1e-12)


def test_traces_hold_the_base_apart_from_the_deflection():
    asked = case().replace("solver.points_per_period", 256)  # the trace's own: no number is found again with others
    trace = df.dwell(asked, zc="7 nm", recorded_periods=1)
    np.testing.assert_allclose(trace.distance, 7e-9 + trace.base + trace.deflection, atol=1e-20)
    samples, A = trace.sizes["time"], trace.amplitude.item()
    # between samples the deflection rises by no more than its bend over half a step
    bend = 2.0 * A * (math.pi / samples) ** 2
    assert 0.0 <= trace.max_deflection.item() - trace.deflection.max().item() < bend
    assert 0.0 <= trace.deflection.min().item() - trace.min_deflection.item() < bend
    c = 2.0 * np.mean(trace.deflection.values * np.exp(-2j * math.pi * np.arange(samples) / samples))
    assert abs(c) == pytest.approx(A, rel=1e-9, abs=0.0)
    at = np.searchsorted(trace.frequency.values, 24e3)
    assert trace.spectrum.values[at : at + 9].max() == pytest.approx(A, rel=1e-9, abs=0.0)


QUICK = ("DMT", "DMT, bimodal")
EVERY = [
    *(pytest.param(name, 3, marks=pytest.mark.slow) for name in QUICK),
    *(pytest.param(name, 2, marks=pytest.mark.long) for name in FAMILIES if name not in QUICK),
]


@pytest.mark.parametrize(("family", "draws"), EVERY)
def test_balances_close_over_random_bases(family, draws):
    rng = np.random.default_rng([5, list(FAMILIES).index(family)])
    closed = 0
    for number in range(draws):
        drawn = draw(11, number, (family,))
        levers = [mode.replace(added_mass=float(rng.uniform(0.0, 0.9))) for mode in drawn.case.cantilever.modes]
        drive = df.Drive(
            tones=[{"A0": tone.A0} for tone in drawn.case.drive.tones],
            excitation="base",
            fluid_follows=float(rng.uniform()),
        )
        asked = drawn.case.replace(cantilever=df.Cantilever(modes=levers), drive=drive)
        found = find(asked, drawn.zc, 4096)
        if found is None:  # it does not repeat with the tones
            continue
        for what, error in closures(asked.problem, found.values, found.mean_squares()).items():
            assert error < limit(what), (number, what)
        # as a user asks for it, with as many samples as that takes: results hold no squares of velocities, of which the
        # total energy is made, and no accuracy is promised of multipliers
        state = df.dwell(asked.replace("solver", {"accuracy": 1e-6}), zc=drawn.zc)
        assert int(state.status) == 0
        values = {name: state[name].values for name in state}
        for what, error in closures(asked.problem, values, np.full(len(levers), np.nan)).items():
            assert what in ("total energy", "multipliers") or error < limit(what), (number, what)
        closed += 1
    assert closed


def test_random_sums_hold_every_force():
    rng = np.random.default_rng(5)
    drawn = {table.name for name in FAMILIES for table in draw(11, int(rng.integers(9)), (name,)).case.forces}
    assert drawn == {name for name, model in REGISTRY.items() if model.__module__.startswith("dforce.forces.")}


def test_the_peak_is_where_the_free_response_is_largest():
    for excitation in ("force", "base"):
        for Q in (1.2, 2.5, 40.0):
            asked = df.Case(
                cantilever=WATER | {"Q": Q}, drive={"A0": 10e-9, "excitation": excitation, "frequency": "peak"}
            )
            there = asked.problem
            peak = there.tones[0].frequency
            beside = [abs(there.at_frequency(peak * (1.0 + share)).free[0, 0]) for share in (-1e-4, 0.0, 1e-4)]
            assert beside[1] > max(beside[0], beside[2])
    with pytest.raises(ParameterError, match=r"has no peak at Q = 0\.6"):
        df.Case(cantilever=WATER | {"Q": 0.6}, drive={"A0": 10e-9, "frequency": "peak"})


def test_a_lag_of_the_drive_turns_the_phase_alone():
    plain = df.dwell(case(WATER, {"A0": 10e-9}), zc="7 nm")
    late = df.dwell(case(WATER, {"A0": 10e-9, "lag": "45 deg"}), zc="7 nm")
    assert late.amplitude.item() == pytest.approx(plain.amplitude.item(), rel=1e-10)
    assert late.phase.item() == pytest.approx(plain.phase.item() + 45.0, abs=1e-7)  # by whole samples
    for name in ("total_dissipated_energy", "dissipated_energy", "apparent_dissipated_energy"):
        assert late[name].item() == pytest.approx(plain[name].item(), rel=1e-6, abs=1e-25)


def test_an_interferometer_that_sees_the_base_move_does_not_take_it_for_a_drive():
    with pytest.raises(ParameterError, match="the base cannot drive mode 1"):
        case(WATER | {"base_coupling": 0.0}, readout={"kind": "interferometer"})


def test_a_sweep_over_the_lag_knows_that_only_some_cases_lag():
    asked = case(WATER, {"A0": 10e-9}, experiment={"kind": "dwell", "zc": 7e-9})
    phase = df.sweep(asked, over={"drive.lag": [0.0, math.pi / 4.0]}).phase.values.ravel()
    assert phase[1] - phase[0] == pytest.approx(45.0, abs=1e-6)


def test_peak_force_tapping_is_a_base_that_is_shaken_slowly():
    """Against SciPy's DOP853 and LSODA, which agree to nine digits: the deflection at each quarter of the path of the base."""
    instrument = {
        "tip": {"radius": 20e-9},
        "sample": {"youngs_modulus": 20e6, "poisson_ratio": 0.5},
        "forces": [DMT],
        "experiment": {"kind": "dwell", "zc": 94e-9},
    }
    base = {"excitation": "base", "base_amplitude": 100e-9, "frequency": 2e3}
    asked = df.Case(cantilever={"f0": 25e3, "k": 0.1, "Q": 2.0}, drive=base, **instrument)
    found = df.motion_at(df.run(asked))
    assert pytest.approx(6.37929901e-9, rel=1e-8) == asked.problem.tones[0].A0
    quarters = found.deflection.values[: found.sizes["time"] // 2 : found.sizes["time"] // 8]
    assert quarters[:3] == pytest.approx([0.75232373e-9, 6.33459591e-9, 2.13598197e-9], abs=1e-4 * 6.4e-9)
    assert found.peak_force.item() == pytest.approx(7.556e-10, rel=5e-4)  # the largest of 1024 samples is 7.55398e-10


def test_the_error_far_below_resonance_counts_on_the_scale_of_the_base_not_of_the_small_deflection():
    soft = {"f0": 70e3, "k": 0.4, "Q": 20.0}
    slow = {"excitation": "base", "base_amplitude": 20e-9, "frequency": 7e3}
    asked = case(soft, slow, experiment={"kind": "dwell", "zc": 19e-9})
    found, exact = (df.run(asked.replace("solver.points_per_period", n)) for n in (256, 8192))
    (tone,) = asked.problem.tones
    work = soft["k"] * tone.A0 * 20e-9  # the force on the base over the path of the base
    speed = 2.0 * math.pi * 7e3 * 20e-9
    off = max(
        abs((found.base_energy - exact.base_energy).item()) / work,
        abs((found.peak_velocity - exact.peak_velocity).item()) / speed,
        abs((found.max_deflection - exact.max_deflection).item()) / tone.A0,
    )
    assert off / 3.0 < found.error_estimate.item() < 3.0 * off


@pytest.mark.parametrize(
    ("lever", "drive", "message"),
    [
        (WATER, BASE | {"acts_on": "own_mode"}, "drive.acts_on needs a force"),
        (WATER, BASE | {"base_amplitude": 1e-9}, "drive has both A0 and base_amplitude"),
        (WATER, {"excitation": "base"}, "drive.A0 (free amplitude) is missing"),
        (WATER, {"A0": 1e-9, "fluid_follows": 0.5}, 'write excitation = "base"'),
        (WATER, {"base_amplitude": 1e-9}, 'drive.base_amplitude needs base excitation; write excitation = "base"'),
        (WATER, {"tones": [{"mode": 1}]}, "drive.tones.1 has neither A0 (free amplitude) nor base_amplitude"),
        (WATER | {"base_coupling": 0.0}, BASE, "drive: the base cannot drive mode 1 at 25000 Hz"),
        (WATER, BASE | {"fluid_follows": 0.5}, "of mode 1: write cantilever.added_mass, or"),
        ({"modes": [WATER | {"added_mass": 0.8}, SECOND]}, BASE | {"fluid_follows": 0.5}, "cantilever.modes.2.added_mass"),
        (WATER, BASE | {"frequency": 10.0}, "the base cannot drive mode 1 at 10 Hz"),
        (WATER | {"base_coupling": 0.0}, BASE, "the base cannot drive mode 1"),
        (WATER | {"added_mass": 1.0}, BASE, "cantilever.added_mass = 1 is not below 1"),
    ],
)  # fmt: skip
def test_a_base_that_makes_no_sense_is_refused(lever, drive, message):
    with pytest.raises(ParameterError) as raised:
        case(lever, drive)
    assert message in str(raised.value)
