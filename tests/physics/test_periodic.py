"""Periodic orbits: the steady state by shooting is the one that the transient settles to."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tiers import some_long

import dforce as df
from dforce.checks.validation.curves import SAME, agreement, both_ways, random_case
from dforce.validity import advice_in

NM = 1e-9
SEEDS = range(6)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_curve_of_orbits_is_the_curve_of_transients(seed):
    found = agreement(*random_case(seed))
    assert found.sound > 0.9
    assert found.apart < SAME
    # a jump may come one step sooner or later, and so the loop may be wider by as much each way
    assert found.shift <= 1.0
    assert found.area < 2.0


# without a look at where the step kicks the motion, each of these curves stays on a branch that its transient leaves
@pytest.mark.parametrize(
    ("seed", "step"),
    [(11, 0.1), (15, 0.3), (33, 0.3), (48, 0.35), (50, 0.5), (55, 0.55), (15, 1.0), (402, 0.1), (418, 0.1)],
)
def test_coarse_steps_of_the_distance_kick_the_motion_as_they_do_in_a_transient(seed, step):
    case, zc = random_case(seed, step * NM)
    orbits, transients = both_ways(case, zc)
    sound = (orbits.status == df.Status.OK) & (transients.status == df.Status.OK)
    assert sound.mean() > 0.9
    apart = np.abs(orbits.amplitude - transients.amplitude).where(sound, 0.0)
    assert float(apart.max()) < SAME * case.problem.tones[0].A0


# most periods are leapt over on the way; the starts lead to either of the two states at 8.5 and 9.2 nm
@pytest.mark.parametrize("zc", [8.5, 9.2, 12.0])
@pytest.mark.parametrize(("amplitude", "phase"), [(5.5, 50.0), (7.0, 75.0), (8.4, 120.0), (8.4, 65.0)])
def test_a_start_far_from_every_state_ends_where_the_transient_does_at_a_high_quality_factor(zc, amplitude, phase):
    start = {"amplitude": amplitude * NM, "phase": np.radians(phase)}
    case = df.example("figure-3-air").replace("cantilever.Q", 3000.0)
    case = case.replace(experiment={"kind": "approach", "zc": [zc * NM], "start": start})
    found, transient = df.run(case), df.run(case.replace("solver.method", "transient"))
    assert found.status.item() == transient.status.item() == df.Status.OK
    # the time that it takes, though leapt over; the transient settles to a thousandth of what is near for Newton's method
    assert 0.3 < found.settling_periods.item() / transient.settling_periods.item() < 1.0
    assert found.amplitude.item() == pytest.approx(transient.amplitude.item(), abs=SAME * 10.0 * NM)


def test_table_1_has_its_multipliers_amplitude_and_phase():
    result = df.run(df.example("table-1-am").replace("solver.points_per_period", 2048))
    assert result.amplitude.item() == pytest.approx(4.0553735 * NM, abs=1e-6 * NM)
    assert result.phase.item() == pytest.approx(54.20379, abs=1e-4)
    assert result.multiplier_modulus.values[0] == pytest.approx(0.9691, abs=5e-5)
    # a conservative force keeps areas, so the damping alone decides their product
    assert np.prod(result.multiplier_modulus.values) == pytest.approx(np.exp(-2.0 * np.pi / 100.0), abs=1e-6)


def test_an_orbit_ends_where_it_started():
    curve = df.approach(df.example("figure-3-air"), zc=np.linspace(11 * NM, 3 * NM, 41))
    assert (curve.status == df.Status.OK).all()
    assert (curve.drift < 1e-9).all()
    assert (curve.multiplier_modulus < 1.0).all()


def test_a_jump_within_a_coarse_step_is_listed_though_newton_s_method_lands_behind_it():
    case = df.example("figure-3-air").replace("drive.A0", 14 * NM)
    coarse, fine = (
        df.approach(case, zc=np.linspace(17 * NM, 5 * NM, points), direction="both") for points in (15, 211)
    )
    assert list(coarse.jump_direction.values) == ["approach", "retract"]
    assert (abs(coarse.jump_after - coarse.jump_before) > 0.2 * NM).all()
    assert coarse.jump_zc.values == pytest.approx(fine.jump_zc.values, abs=1e-6 * 14 * NM)
    assert coarse.jump_after.values == pytest.approx(fine.jump_after.values, abs=1e-6 * 14 * NM)


def test_a_jump_is_located_to_better_than_the_step():
    case = df.example("figure-3-air").replace("experiment.start", {"amplitude": "9.1 nm", "phase": "70 deg"})
    coarse = df.approach(case, zc=np.linspace(9.0 * NM, 10.6 * NM, 17), direction="retract")
    # docs/theory/states.md: in steps of 0.1 nm the retract keeps the repulsive branch up to 9.70 nm
    assert coarse.phase.sel(zc=9.7 * NM, method="nearest") < 90.0 < coarse.phase.sel(zc=9.8 * NM, method="nearest")
    assert coarse.jump_direction.values.tolist() == ["retract"]
    # the transient in steps twenty times finer finds where the branch ends
    transient = case.replace("solver.method", "transient")
    there = np.concatenate([np.linspace(9.0, 9.75, 16), np.linspace(9.77, 9.82, 11)]) * NM
    fine = df.approach(transient, zc=there, direction="retract")
    last = float(fine.zc[fine.phase.squeeze("tone") < 90.0].max())
    assert last < coarse.jump_zc.item() < last + 0.005 * NM


def test_a_jump_is_reported_although_the_point_behind_it_did_not_settle():
    case = df.example("figure-3-air").replace("drive.A0", 14 * NM).replace("solver.max_periods", 200)
    zc = np.concatenate([np.linspace(17.0, 11.75, 8), np.linspace(11.738, 11.735, 8)]) * NM  # around the fold
    curve = df.approach(case, zc=zc, direction="approach")
    assert (curve.status.values[:8] == df.Status.OK).all()
    assert curve.status.values[8] == df.Status.NOT_SETTLED  # it needs more periods than are allowed
    assert curve.status.values[-1] == df.Status.OK
    patient = df.approach(case.replace("solver.max_periods", None), zc=zc, direction="approach")
    assert curve.jump_zc.values == pytest.approx(patient.jump_zc.values, abs=1e-6 * 14 * NM)


SLOW = {
    "settled": {"method": "transient"}, "engine": {"integrator": "engine", "method": "transient"},
    "longer": {"settle": "fixed", "periods": 1500}, "not settled": {"settle": "fixed", "periods": 400},
}  # fmt: skip


@pytest.mark.parametrize("settings", some_long(SLOW, ["engine"]))
def test_a_transient_lists_the_jumps_that_the_orbits_have(settings):
    zc = np.linspace(10.5 * NM, 9 * NM, 16)
    case = df.example("figure-3-air-jump")
    orbits, slow = (
        df.approach(one, zc=zc, direction="both", protocol="stepwise")
        for one in (case, case.replace("solver", SLOW[settings]))
    )
    assert slow.jump_direction.values.tolist() == orbits.jump_direction.values.tolist() == ["approach", "retract"]
    settled = np.isin(slow.status.values, [df.Status.OK, df.Status.INACCURATE])
    for which, at in enumerate(orbits.jump_zc.values):
        # a jump is noted between settled motions: as many steps of 0.1 nm as it takes until there is one
        sound = zc[settled[:, which]]
        room = sound[sound > at].min() - sound[sound < at].max()
        assert abs(slow.jump_zc.values[which] - at) <= room
    told = {found.direction: found.value for found in df.summary(slow) if found.name == "jumps"}
    assert told == {"approach": [slow.jump_zc.values[0]], "retract": [slow.jump_zc.values[1]]}
    if (slow.status == df.Status.OK).all():
        assert slow.jump_zc.values == pytest.approx(orbits.jump_zc.values, abs=0.1 * NM / 256)
        assert slow.jump_before.values == pytest.approx(orbits.jump_before.values, abs=1e-3 * NM)
        assert slow.jump_after.values == pytest.approx(orbits.jump_after.values, abs=1e-3 * NM)


def test_a_transient_that_settles_nowhere_lists_no_jump_and_one_that_moves_smoothly_neither():
    case = df.example("figure-3-air-jump")
    fixed = case.replace("solver", {"settle": "fixed", "periods": 50})  # of the thousand that it needs
    hasty = df.approach(fixed, zc=np.linspace(10.5 * NM, 9 * NM, 16), direction="both")
    assert (hasty.status == df.Status.NOT_SETTLED).all()
    smooth = df.approach(case.replace("solver.method", "transient"), zc=np.linspace(9.0 * NM, 3 * NM, 7))
    assert (np.abs(np.diff(smooth.amplitude.values[:, 0])) > 0.05 * 10 * NM).all()  # far from point to point, and yet
    for curve in (hasty, smooth):
        assert "jump_zc" not in curve


@pytest.mark.parametrize("method", ["periodic", "transient"])
def test_long_steps_along_one_state_are_no_jumps(method):
    """Steps of an eighth of the range kick hard, but where the state goes on, it goes on in finer steps as well."""
    case = df.example("figure-3-air").set("cantilever.Q=400", 'drive.A0="35.53 nm"', f'solver.method="{method}"')
    zc = {"start": "46.19 nm", "stop": "3.553 nm", "points": 9}
    curve = df.approach(case, zc=zc, direction="both", protocol="stepwise")
    # on a fine grid as well there is one each way, between the states of high and of low amplitude
    ways = {
        str(way): after.item() - before.item()
        for way, before, after in zip(curve.jump_direction.values, curve.jump_before, curve.jump_after, strict=True)
    }
    assert len(curve.jump_zc) == 2
    assert ways["approach"] < -1e-9
    assert ways["retract"] > 1e-9


@pytest.mark.parametrize("method", ["periodic", "transient"])
def test_a_motion_that_repeats_after_three_periods_says_so_and_is_measured_over_whole_threes(method):
    frequency = 0.5632 * 12.7e3
    # other states coexist; from elsewhere rounding decides which of them a run comes to
    on_it = {"amplitude": 9.25e-9, "phase": math.radians(-32.4)}
    case = df.Case(
        cantilever={"f0": 12.7e3, "k": 2.05, "Q": 119}, drive={"A0": 5.55e-9, "frequency": frequency},
        tip={"radius": 2.54e-9}, sample={"youngs_modulus": 38e9, "poisson_ratio": 0.3}, contact={"a0": 0.345e-9},
        forces=[df.forces.Hertz()], experiment={"kind": "dwell", "zc": 5.28e-9, "start": on_it},
        solver={"method": method},
    )  # fmt: skip
    found = df.run(case)
    assert found.status.item() == df.Status.NOT_REPEATING
    turned = found.deflection.values * np.exp(-2j * np.pi * frequency * found.time.values)

    def amplitude(periods):
        """Return the amplitude over the first periods of the trace."""
        return 2.0 * abs(turned[: periods * found.attrs["samples_per_period"]].mean())

    # the amplitude of an orbit may come from more samples than its trace has
    assert found.amplitude.item() == pytest.approx(amplitude(3), rel=1e-5)
    assert found.amplitude.item() == pytest.approx(amplitude(6), rel=1e-5)
    # over 8 periods, which are no whole threes, the amplitude depends on the first of them
    assert found.amplitude.item() != pytest.approx(amplitude(8), rel=1e-4)


def test_a_chaotic_motion_is_not_asked_for_more_periods_and_one_that_only_needs_more_is():
    bouncing = df.Case(
        cantilever={"f0": 395e3, "k": 0.0853, "Q": 23.7}, drive={"A0": 3.08e-9, "frequency": 0.9767 * 395e3},
        tip={"radius": 10.7e-9}, sample={"youngs_modulus": 5.3e9, "poisson_ratio": 0.3}, contact={"a0": 0.185e-9},
        forces=[df.forces.Hertz()], experiment={"kind": "dwell", "zc": 0.0863e-9},
    )  # fmt: skip
    chaotic = df.run(bouncing)
    assert chaotic.status.item() == df.Status.NOT_REPEATING
    assert "not_settled" not in {piece.name for piece in advice_in(chaotic)}
    hurried = df.example("figure-3-air").set('solver.method="transient"', "solver.max_periods=300")
    hurried = df.dwell(hurried, zc="9 nm", start="rest")
    assert hurried.status.item() == df.Status.NOT_SETTLED
    assert "not_settled" in {piece.name for piece in advice_in(hurried)}


def test_two_tones_share_a_common_period():
    """Figure 6: the second frequency is 6.2 times the first, so that the motion repeats after five periods."""
    case = df.example("figure-6").replace("solver.points_per_period", 256)  # of both the same
    orbit, transient = (df.dwell(case.replace("solver.method", method), "8 nm") for method in ("periodic", "transient"))
    assert orbit.drift.item() < 1e-9
    assert orbit.amplitude.values == pytest.approx(transient.amplitude.values, rel=2e-5)
    assert orbit.phase.values == pytest.approx(transient.phase.values, abs=2e-3)


def test_settings_that_only_a_transient_has_choose_it_or_are_refused():
    assert df.SolverSettings().method == "periodic"
    assert df.SolverSettings(integrator="lsoda").method == "transient"
    assert df.SolverSettings(settle="fixed").method == "transient"
    with pytest.raises(df.ParameterError, match="needs method"):
        df.SolverSettings(method="periodic", integrator="lsoda")
    with pytest.raises(df.ParameterError, match="a periodic orbit has no settling"):
        df.SolverSettings(method="periodic", settle="fixed")


@pytest.mark.long
def test_an_orbit_is_measured_with_the_memory_that_belongs_to_it():
    """From the free motion over a rested sample the corrections take the memory along."""
    case = df.Case(
        cantilever=df.Cantilever(f0="63 kHz", k="9.5 N/m", Q=2.7), drive=df.Drive(A0="24 nm"),
        tip=df.Tip(radius="16 nm"), sample=df.Sample(poisson_ratio=0.3),
        forces=[
            df.forces.SLS(instant_modulus="100 MPa", relaxed_modulus="50 MPa", relaxation_time="4 us", elements=6),
            df.forces.Capillary(),
        ],
    )  # fmt: skip
    settled = case.replace(solver=df.SolverSettings(method="transient", settle_tolerance=1e-10))
    orbit, reference = df.dwell(case, "17 nm"), df.dwell(settled, "17 nm")
    assert orbit.drift.item() < 1e-9
    assert orbit.amplitude.item() == pytest.approx(reference.amplitude.item(), rel=1e-7)
    assert orbit.peak_force.item() == pytest.approx(reference.peak_force.item(), rel=1e-6)
    assert orbit.total_dissipated_energy.item() == pytest.approx(reference.total_dissipated_energy.item(), rel=1e-5)


def test_an_orbit_has_the_memory_that_hundreds_of_periods_would_bring():
    """Arms of up to 300 periods are foretold; integration through 20 times as many is the reference."""
    case = df.Case(
        cantilever={"f0": "30 kHz", "k": "0.5 N/m", "Q": 2}, drive={"A0": "10 nm"}, tip={"radius": "10 nm"},
        sample={"poisson_ratio": 0.3},
        forces=[df.forces.PowerLaw(modulus_at_reference="50 MPa", shortest_time="1 us", elements=4)],
    )  # fmt: skip
    in_time = df.SolverSettings(method="transient", settle="fixed", periods=8000)
    orbit, reference = df.dwell(case, "6 nm"), df.dwell(case.replace(solver=in_time), "6 nm")
    assert orbit.status.item() == df.Status.OK and orbit.drift.item() < 1e-9
    for name in ("amplitude", "peak_force", "total_dissipated_energy"):
        assert orbit[name].item() == pytest.approx(reference[name].item(), rel=1e-9)
    assert orbit.error_estimate.item() < 1e-4, "only an orbit that Newton's method has found has one"


def test_a_motion_from_rest_ends_where_a_slow_memory_has_come_to_rest():
    """A memory of 9000 periods and more creeps so slowly that the motion seems settled long before it."""
    case = df.Case(
        cantilever={"f0": "300 kHz", "k": "40 N/m", "Q": 20}, drive={"A0": "20 nm"}, tip={"radius": "10 nm"},
        forces=[{"model": "sls_simple", "relaxation_time": "1 ms"}], experiment={"kind": "dwell", "zc": "18 nm"},
    )  # fmt: skip
    in_time = df.SolverSettings(method="transient", settle="fixed", periods=15_000)  # 50 relaxation times
    reference = df.run(case.replace(solver=in_time))
    for time in (0.03, 1.0):
        found = df.run(case.replace("forces.sls_simple.relaxation_time", time))
        assert found.status == df.Status.OK and found.error_estimate < 1e-4
        assert found.peak_force.item() == pytest.approx(reference.peak_force.item(), rel=1e-3)
        assert found.settling_periods > 300e3 * time, "its memory needs that long"


def test_a_voltage_that_does_not_repeat_with_the_drive_is_left_to_time():
    """The mean force follows from the mean square of the voltage at any frequency, not from the voltage at one instant."""

    def case(frequency, method):
        return df.Case(
            cantilever={"f0": "70 kHz", "k": "40 N/m", "Q": 10}, drive={"A0": "2 nm"}, tip={"radius": "30 nm"},
            forces=[df.forces.Electrostatic(bias="1 V", ac_bias="1 V", ac_frequency=frequency)],
            experiment={"kind": "dwell", "zc": "12 nm"}, solver={"method": method},
        )  # fmt: skip

    for frequency in ("1 kHz", "35 kHz", "70.1 kHz"):
        with pytest.raises(
            df.ParameterError, match=r'electrostatic alternates at .* write solver.method = "transient"'
        ):
            case(frequency, "periodic")
    both, in_time = (df.run(case("140 kHz", method)) for method in ("periodic", "transient"))
    assert both.amplitude.values == pytest.approx(in_time.amplitude.values, rel=1e-5)
    alone = df.run(case("140 kHz", "periodic").replace("forces.electrostatic.ac_bias", 0.0))
    assert float(df.run(case("35 kHz", "transient")).mean_force) == pytest.approx(
        1.5 * float(alone.mean_force), rel=0.02
    )
    with pytest.raises(df.ParameterError, match=r"at drive\.frequency = 71 kHz: the force electrostatic alternates"):
        df.sweep(case("70 kHz", "periodic"), over={"drive.frequency": [70e3, 71e3]})
    with pytest.raises(df.ParameterError, match=r"electrostatic, which depends on time, needs drive\.operation"):
        case("70 kHz", "periodic").replace("drive.operation", "fm")


def test_a_surface_that_does_not_return_is_left_to_time():
    """Each tap deepens it, until the tip no longer touches: there is no motion to be compared with on the way there."""

    def case(force, method="periodic"):
        return df.Case(
            cantilever={"f0": "300 kHz", "k": "40 N/m", "Q": 20}, drive={"A0": "20 nm"}, tip={"radius": "10 nm"},
            forces=[force], experiment={"kind": "dwell", "zc": "18 nm"}, solver={"method": method},
        )  # fmt: skip

    liquid = {"model": "generalized_maxwell", "relaxed_modulus": "0 Pa", "elements": 8}
    with pytest.raises(df.ParameterError, match=r'generalized_maxwell never returns, .* solver.method = "transient"'):
        case(liquid)
    for model in ("sls", "sls_simple"):
        with pytest.raises(df.ParameterError, match=rf"surface of {model} takes 90 s to return"):
            case({"model": model, "relaxation_time": "10 s"})
        case({"model": model, "relaxation_time": "1 s"})
    found = df.run(case(liquid, "transient"))
    assert found.status == df.Status.OK
    assert found.samples_per_period == 256, "more samples change nothing"
    assert found.amplitude.item() == pytest.approx(20e-9, rel=1e-3)
    assert found.peak_force.item() > 0.0, "it still touches"
