"""Many cases side by side: the same numbers as single runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dforce as df
from dforce.experiments._experiment import initial_motion
from dforce.observables import measure
from dforce.solvers.batch import Block
from dforce.solvers.crew import Stopped
from dforce.solvers.find import make_finder
from dforce.solvers.integrator import Motion, load_kernels, sample_count
from dforce.solvers.lot import Lot, fits
from dforce.solvers.orbit import MISS
from dforce.solvers.side_by_side import SideBySide

NM = 1e-9
# Two orbits that miss their starts by MISS lie apart by up to MISS divided by 1 minus the largest multiplier: Q / pi
APART = 10 * MISS * 100.0
WIDE = [0.4e9, 1e9, 3e9, 10e9, 1.7e9]  # moduli; five, so that one vector is not full


def case(modulus: float = 1e9, **solver: object) -> df.Case:
    return df.Case(
        cantilever=df.Cantilever(f0="50 kHz", k=1.0, Q=100.0), drive=df.Drive(A0="8 nm"), tip=df.Tip(radius="5 nm"),
        sample=df.Sample(youngs_modulus=modulus),
        forces=[df.forces.DMT(hamaker="3e-20 J")],
        experiment=df.Approach(zc={"start": "11 nm", "stop": "3 nm", "points": 33}), solver=dict(solver),
    )  # fmt: skip


def nothing() -> None:
    """Let a run go on."""


def lanes_of(cases: list[df.Case]) -> SideBySide:
    lot = Lot.of([one.problem for one in cases])
    return SideBySide(lot, cases[0].solver, 10, int(lot.samples(cases[0].solver)[0]), nothing)


def test_a_lot_knows_what_its_problems_know():
    problems = [case(E).problem for E in WIDE] + [case().replace("cantilever.Q", 9000.0).problem]
    lot, settings = Lot.of(problems), case().solver
    assert lot.samples(settings).tolist() == [sample_count(problem, settings) for problem in problems]
    assert lot.samples(settings)[-1] > settings.points_per_period - 1
    finder = make_finder(problems[0], settings, 10)
    np.testing.assert_allclose(lot.free()[0], initial_motion(finder.integrator, "free").y, atol=1e-12)
    start = df.InitialMotion(amplitude="3 nm", phase="20 deg")
    np.testing.assert_allclose(
        lot.moving(0, start.amplitude, start.phase)[0], initial_motion(finder.integrator, start).y, atol=1e-12
    )


def test_only_problems_with_one_tone_and_forces_of_the_motion_alone_fit_into_lanes():
    assert fits(case().problem, case().solver)
    assert not fits(case().replace(forces=[df.forces.JKR(surface_energy=0.05)]).problem, case().solver)
    assert not fits(case().problem, df.SolverSettings(integrator="lsoda"))
    assert not fits(case().problem, df.SolverSettings(settle="fixed"))
    timed = case().replace(forces=[df.forces.Custom(law="1e-12 * cos(t)")])
    assert not fits(timed.problem, timed.solver)


def test_orbits_side_by_side_and_all_that_is_measured_on_them_equal_those_of_single_runs():
    cases = [case(E) for E in WIDE]
    lanes, zc = lanes_of(cases), np.linspace(3.0, 7.0, 21) * NM
    rough = lanes.settle(np.arange(5), lanes.lot.free() * 0.0, np.full(5, zc[0]), 1e-3)
    found = lanes.follow(np.arange(5), rough.motions, np.tile(zc, (5, 1)))
    assert (found.done == 21).all()
    assert found.infos[:, :, 0].max() < MISS
    for i, one in enumerate(cases):
        finder = make_finder(one.problem, one.solver, 10)
        alone = list(finder.along(Motion(tuple(rough.motions[i]), np.zeros(0), np.zeros(0), 0), zc, nothing))
        orbits = np.array([point.motion.y for point in alone])
        np.testing.assert_allclose(found.orbits[i], orbits, atol=APART)
        for name, column in (
            ("peak_force", measure.F_MAX),
            ("min_distance", measure.D_MIN),
            ("peak_velocity", measure.V_MAX),
        ):
            single = np.array([point.values[name] for point in alone])
            # an indentation of a hundredth of the amplitude: relative to it an orbit is a hundred times as far off
            np.testing.assert_allclose(found.rows[i, :, column], single, rtol=100.0 * APART)


def test_lanes_measure_the_same_orbit_as_the_scalar_loop_to_rounding():
    cases = [case(E) for E in WIDE]
    lanes = lanes_of(cases)
    start = lanes.settle(np.arange(5), lanes.lot.free() * 0.0, np.full(5, 4 * NM), 1e-3).motions
    found = lanes.follow(np.arange(5), start, np.full((5, 1), 4 * NM))
    for i, one in enumerate(cases):
        integrator = make_finder(one.problem, one.solver, 10).integrator
        integrator.place(4 * NM)
        motion = Motion(tuple(found.orbits[i, 0]), np.zeros(0), np.zeros(0), 0)
        _, rows = integrator.observe(motion, 1)
        # cuts at kinks land within 2e-6 of a step of each other, and the force is bent there but does not jump
        np.testing.assert_allclose(found.rows[i, 0], rows[0], rtol=1e-8, atol=1e-10 * np.abs(rows[0]).max())


def test_tangents_side_by_side_shrink_areas_as_the_damping_says():
    lanes = lanes_of([case(E) for E in WIDE])
    start = lanes.settle(np.arange(5), lanes.lot.free() * 0.0, np.full(5, 4 * NM), 1e-3).motions
    found = lanes.follow(np.arange(5), start, np.full((5, 1), 4 * NM))
    # a conservative force leaves the area of phase space to the damping; the neighbors are 2e-7 away and the force is stiff
    np.testing.assert_allclose(np.linalg.det(found.tangents[:, 0]), np.exp(-2 * np.pi / 100.0), atol=1e-4)


def test_lanes_that_are_done_make_room_for_the_next_motions(monkeypatch):
    monkeypatch.setattr("dforce.solvers.side_by_side.LANES", 8)
    cases = [case(E) for E in np.geomspace(0.3e9, 10e9, 21)]
    lanes = lanes_of(cases)
    which, zc = np.arange(21), np.full(21, 5 * NM)
    few = lanes.settle(which, lanes.lot.free() * 0.0, zc, 1e-4)
    monkeypatch.undo()
    many = lanes.settle(which, lanes.lot.free() * 0.0, zc, 1e-4)
    assert few.settled.all()
    np.testing.assert_array_equal(few.periods, many.periods)
    np.testing.assert_allclose(few.motions, many.motions, atol=1e-12)


def test_motions_settle_side_by_side_where_a_single_transient_settles():
    one = case().replace("solver.method", "transient")
    lanes = lanes_of([one] * 2)
    found = lanes.settle(np.arange(2), lanes.lot.free() * 0.0, np.array([5.0, 9.0]) * NM, 1e-6)
    for zc, y in zip((5 * NM, 9 * NM), found.motions, strict=True):
        finder = make_finder(one.problem, one.solver, 10)
        single = next(finder.along(initial_motion(finder.integrator, "rest"), np.array([zc]), nothing))
        # not cut at kinks: what 256 samples a period leave there, times Q / pi
        np.testing.assert_allclose(y, single.motion.y, atol=2e-4)


@pytest.mark.parametrize("method", ["periodic", "transient"])
def test_a_curve_of_a_sweep_is_the_curve_of_its_single_run(method):
    base = case(method=method)
    sweep = df.sweep(base, over={"sample.youngs_modulus": WIDE})
    assert sweep.amplitude.dims == ("youngs_modulus", "zc", "tone")
    tolerance = (
        APART if method == "periodic" else 1e-4
    )  # the transient stops where 1e-6 is still to come, by its estimate
    for modulus in WIDE[:2]:
        single = df.run(base.replace("sample.youngs_modulus", modulus))
        swept = sweep.sel(youngs_modulus=modulus)
        np.testing.assert_array_equal(swept.status, single.status)
        np.testing.assert_allclose(swept.amplitude, single.amplitude, atol=tolerance * 8 * NM)
        np.testing.assert_allclose(swept.phase, single.phase, atol=np.degrees(2 * tolerance))
        np.testing.assert_allclose(
            swept.peak_force, single.peak_force, atol=20 * tolerance * float(abs(single.min_force).max())
        )


def test_kernels_of_lanes_and_of_single_runs_are_loaded_once():
    problem = case().problem
    assert load_kernels(problem) == load_kernels(case(2e9).problem)


def test_coarse_steps_kick_motions_side_by_side_as_they_do_alone():
    coarse = df.example("figure-3-air").replace(
        experiment={"kind": "approach", "zc": {"start": "12 nm", "stop": "2 nm", "points": 15}, "direction": "both"}
    )
    moduli = np.geomspace(0.2e9, 5e9, 8)
    together = df.sweep(coarse, over={"sample.youngs_modulus": moduli})
    alone = [df.run(coarse.replace("sample.youngs_modulus", E)) for E in moduli]
    # there are both branches among them, and curves that change from one to the other
    assert (together.phase > 90.0).any() and (together.phase < 90.0).any()
    for i, one in enumerate(alone):
        assert together.amplitude[i].values == pytest.approx(one.amplitude.values, abs=1e-6 * 10 * NM)


# in lanes; one by one, as the force jumps
@pytest.mark.parametrize("name", ["figure-3-air", "figure-3-air-jump"])
@pytest.mark.parametrize("method", ["periodic", "transient"])
def test_jumps_of_a_sweep_are_those_of_its_single_runs(name, method):
    case = df.example(name).replace("solver.method", method).replace(
        experiment={"kind": "approach", "zc": {"start": "11 nm", "stop": "9 nm", "points": 21}, "direction": "retract",
                    "start": {"amplitude": "9.1 nm", "phase": "70 deg"}}
    )  # fmt: skip
    moduli = [0.2e9, 1e9, 2.5e9]
    together = df.sweep(case, over={"sample.youngs_modulus": moduli})
    assert together.jump_zc.dims == ("youngs_modulus", "jump")
    assert np.isfinite(together.jump_zc[1]).any()
    for i, E in enumerate(moduli):
        alone, of_sweep = df.run(case.replace("sample.youngs_modulus", E)), together.isel(youngs_modulus=i)
        jumps = [np.array(one.get("jump_zc", [])) for one in (alone, of_sweep)]
        count = len(jumps[0])
        # two searches for the end of the branch, each to 1/512 of the step
        assert jumps[1][:count] == pytest.approx(jumps[0], abs=0.1 * NM / 512)
        assert np.isnan(jumps[1][count:]).all()
        for which in ("jump_before", "jump_after") if count else ():
            assert of_sweep[which].values[:count] == pytest.approx(alone[which].values, abs=1e-3 * NM)
        told = [[found.text for found in df.summary(one) if found.name == "jumps"] for one in (alone, of_sweep)]
        assert told[0] == told[1]


def test_a_block_that_is_stopped_has_the_jumps_of_the_points_that_it_has(monkeypatch):
    one = df.example("figure-3-air").replace(
        experiment={"kind": "approach", "zc": {"start": "11 nm", "stop": "9 nm", "points": 21}, "direction": "retract",
                    "start": {"amplitude": "9.1 nm", "phase": "70 deg"}}
    )  # fmt: skip
    single, start = df.run(one), one.experiment.start
    zc = np.sort(single.zc.values)
    zc = np.tile(zc[: np.searchsorted(zc, float(single.jump_zc[0])) + 1], (2, 1))  # ends behind the jump
    lot = Lot.of([one.problem] * 2)
    motions = lot.moving(0, start.amplitude, start.phase)

    def block() -> Block:
        return Block(lot, lambda i: one.problem, one.solver, 10, int(lot.samples(one.solver)[0]), nothing)

    whole, stopped = block(), block()
    whole.walk(motions, zc, lambda points: None)
    settle = SideBySide.settle

    def settle_but_the_second_at_the_last(lanes: SideBySide, which, begun, there, tolerance):
        rough = settle(lanes, which, begun, there, tolerance)
        return replace(rough, settled=rough.settled & ~((which == 1) & (there == zc[0, -1])))

    def stop(*_: object) -> None:
        raise Stopped

    monkeypatch.setattr(SideBySide, "settle", settle_but_the_second_at_the_last)
    monkeypatch.setattr("dforce.solvers.batch.steady", stop)
    with pytest.raises(Stopped):
        stopped.walk(motions, zc, lambda points: None)
    assert stopped.points.orbit[0].all() and np.flatnonzero(~stopped.points.orbit[1]).tolist() == [zc.shape[1] - 1]
    assert stopped.jumps == [whole.jumps[0], []] and len(whole.jumps[0]) == 1
