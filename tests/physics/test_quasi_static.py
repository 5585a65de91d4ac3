"""The quasi-static protocol: curves do not depend on their grids, and jumps are the ends of states."""

import numpy as np
import pytest
import xarray as xr
from compiled import Block, States
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st
from tiers import some_long

import dforce as df
from dforce.checks.validation.draws import draw
from dforce.checks.validation.tip_equation import Region, TipEquation, dmt_with_drag
from dforce.solvers import quasi_static_walk, settling, transient

# one kernel each; a force that jumps at contact, a sudden neck and a memory besides those that are smooth or have a kink
FAMILIES = {
    "dmt": [df.forces.DMT(hamaker="1e-19 J")],
    "viscous": [df.forces.DMT(hamaker="6e-20 J"), df.forces.KelvinVoigt(viscosity="20 Pa s")],
    "jumping": [df.forces.VanDerWaals(hamaker="1e-19 J", inside="off"), df.forces.Hertz()],
    "capillary": [df.forces.Hertz(), df.forces.Capillary()],
    "sagging": [df.forces.VanDerWaals(hamaker="5e-20 J"), df.forces.SLS(elements=6, relaxation_time="3 us")],
}
# where samples pass an edge of the force the map has small folds of its own: fewer samples shift jumps by more than 1e-6 of A0
# curves beside a neck are solved anew with 1024 where 256 mislead, and differ then by 1.5e-8 of A0
SAMPLES = {"sagging": 256}
SAME, SAME_PHASE, SAME_JUMP = 1e-8, 1e-6, 1e-6  # of the free amplitude; degrees times A0/A; of the free amplitude
AT_A_TOUCH = (
    1e-5  # of the free amplitude: a touch of a force that jumps, which the derivatives feel before, ends a state
)
NEUTRAL = 1e-4  # from the unit circle: beside a multiplier so near to it rounding is not forgotten


def lever(family, A0=20e-9, f0=70e3, k=2.7, Q=180.0, youngs_modulus=2e9, radius=8e-9, **solver):
    return df.Case(
        cantilever=df.Cantilever(f0=f0, k=k, Q=Q), drive=df.Drive(A0=A0), tip=df.Tip(radius=radius),
        sample=df.Sample(youngs_modulus=youngs_modulus, poisson_ratio=0.3), forces=FAMILIES[family],
        solver=df.SolverSettings(**solver),
    )  # fmt: skip


def jumps_of(result):
    if "jump_zc" not in result:
        return []
    return sorted(zip(result.jump_direction.values.tolist(), result.jump_zc.values.tolist(), strict=True))


def check_same_curve(one, other, a0, same_jump=SAME_JUMP):
    """Agree at the distances that both hold, where the motion repeats, and in the jumps between motions that do."""
    if all((curve.repeat_periods == 1).all() for curve in (one, other)):
        assert [way for way, _ in jumps_of(one)] == [way for way, _ in jumps_of(other)]
        for (_, first), (_, second) in zip(jumps_of(one), jumps_of(other), strict=True):
            assert first == pytest.approx(second, abs=same_jump * a0)
    shared = np.intersect1d(one.zc, other.zc)
    one, other = one.sel(zc=shared), other.sel(zc=shared)
    repeats = (one.repeat_periods == 1) & (other.repeat_periods == 1)
    assert repeats.sum() >= 2
    firm = repeats & (abs(one.multiplier_modulus - 1.0) > NEUTRAL).all("multiplier")
    apart = abs(one.amplitude - other.amplitude).isel(tone=0).where(firm, 0.0)
    turned = (abs(one.phase - other.phase) * one.amplitude / a0).isel(tone=0).where(firm, 0.0)
    assert float(apart.max()) < SAME * a0
    assert float(turned.max()) < SAME_PHASE


@pytest.mark.parametrize("family", some_long(FAMILIES, ["sagging", "capillary"]))
@settings(max_examples=6, derandomize=True, phases=[Phase.explicit, Phase.generate])
@example(A0=20e-9, k=10.0, Q=80.0, modulus=2e9, turn=0.3)
@given(
    A0=st.sampled_from([5e-9, 10e-9, 30e-9]), k=st.floats(4.0, 40.0), Q=st.floats(5.0, 100.0),
    modulus=st.floats(0.2e9, 20e9), turn=st.floats(0.2, 0.9),
)  # fmt: skip
def test_a_curve_does_not_depend_on_its_grid(family, A0, k, Q, modulus, turn):
    case = lever(family, A0=A0, k=k, Q=Q, youngs_modulus=modulus, points_per_period=SAMPLES.get(family, 1024))
    zc = np.linspace(1.1 * A0 + 3e-9, turn * A0, 46)
    coarse, fine = (df.approach(case, zc=grid, direction="both") for grid in (zc[::9], zc))
    check_same_curve(coarse, fine, A0, AT_A_TOUCH if family == "jumping" else SAME_JUMP)


@pytest.mark.parametrize(
    ("A0", "k", "Q", "modulus", "turn", "jumps"),
    [
        (30e-9, 22.455716419678, 76.33116560651534, 11872334206.507442, 0.5239388420647773, []),
        (30e-9, 37.71191422631211, 57.83517867572022, 4954679500.394961, 0.7189951690194689, []),
        (5e-9, 15.392275146561646, 19.1586654356878, 14030537408.302553, 0.5139808705322633, ["approach", "retract"]),
        (10e-9, 7.855221860942313, 70.76111609125884, 12780658637.836073, 0.46355876791138456, []),
    ],
)  # fmt: skip
def test_the_loss_of_a_state_beside_a_neck_is_no_jump_on_any_grid(A0, k, Q, modulus, turn, jumps):
    """A neck forms where the motion touches, takes energy, and so ends the touch: the motion repeats no more, nor jumps.

    Behind that it repeats again. Only the jumps of the bistable contact are left.
    """
    case = lever("capillary", A0=A0, k=k, Q=Q, youngs_modulus=modulus, points_per_period=256)
    zc = np.linspace(1.1 * A0 + 3e-9, turn * A0, 46)
    coarse, fine = (jumps_of(df.approach(case, zc=grid, direction="both")) for grid in (zc[::9], zc))
    assert [way for way, _ in coarse] == [way for way, _ in fine] == jumps
    assert [at for _, at in coarse] == pytest.approx([at for _, at in fine], abs=SAME_JUMP * A0)


@pytest.mark.parametrize("points", [31, 62])
def test_a_motion_that_comes_back_to_its_state_some_periods_later_has_not_jumped(points):
    """Over adhesion hysteresis states repeat after several periods, end, and are met again at another of these."""
    forces = [df.forces.Hertz(), df.forces.AdhesionHysteresis(approach_energy=0.012, retract_energy=0.018)]
    case = df.Case(
        cantilever={"f0": 20e3, "k": 0.3, "Q": 3.0},
        drive={"A0": 10e-9},
        tip={"radius": 10e-9},
        sample={"youngs_modulus": 50e6, "poisson_ratio": 0.3},
        forces=forces,
    )
    curve = df.approach(case, zc=np.linspace(14e-9, 3e-9, points), direction="both")
    if "jump_zc" in curve:
        assert float(np.abs(curve["jump_after"] - curve["jump_before"]).min()) > 1e-3 * 10e-9


def test_a_motion_beside_a_neck_moves_with_the_distance_where_it_does_not_repeat():
    case = lever("capillary", A0=10e-9, k=7.9, Q=71.0, youngs_modulus=13e9, points_per_period=256, method="transient")
    curve = df.approach(case, zc=np.linspace(10.28e-9, 10.23e-9, 6), direction="approach", protocol="stepwise")
    assert (curve.repeat_periods != 1).all()
    assert curve.amplitude.values[:, 0] == pytest.approx(curve.zc.values - 0.5e-9, abs=1e-3 * 10e-9)


def test_a_jump_from_a_motion_that_does_not_repeat_to_another_motion_is_found():
    # which of two motions close to each other it comes to hangs on last bits
    case = draw(28, 40).case
    slow, curve = (
        df.approach(
            case, zc=np.linspace(0.713e-9, 0.7205e-9, points), direction="retract", protocol=protocol, start="rest"
        )
        for points, protocol in ((16, "stepwise"), (3, "quasi_static"))
    )
    slow = slow.sortby("zc")
    changes, repeats = np.abs(np.diff(slow.amplitude.values[:, 0])), np.isfinite(slow.repeat_periods.values)
    place = int(np.argmax(changes))
    assert changes[place] > 20.0 * np.median(changes[repeats[1:] & repeats[:-1]])
    assert (curve.repeat_periods[:2] != 1).all()
    assert len(jumps_of(curve)) > 0
    off = abs(curve.jump_zc - slow.zc[place])
    assert float((off - curve.jump_error * case.problem.tones[0].A0).min()) < 0.0


def test_a_way_back_takes_over_states_of_the_way_there_and_is_the_curve_of_a_way_back_alone():
    case = lever("viscous", A0=30e-9)
    zc = np.linspace(34e-9, 18e-9, 101)
    both = df.approach(case, zc=zc, direction="both")
    there, back = both.sel(direction="approach"), both.sel(direction="retract")
    last = there.sel(zc=zc[-1])
    start = {"amplitude": float(last.amplitude[0]), "phase": f"{float(last.phase[0])} deg"}
    alone = df.approach(case, zc=zc, direction="retract", start=start)
    assert [way for way, _ in jumps_of(both)] == ["approach", "retract"]
    (_, low), (_, high) = jumps_of(both)
    assert high == pytest.approx(jumps_of(alone)[0][1], abs=SAME_JUMP * 30e-9)
    assert alone.sortby("zc").amplitude.values == pytest.approx(back.sortby("zc").amplitude.values, abs=SAME * 30e-9)
    differs = (zc > low) & (zc < high)
    assert differs.sum() >= 3
    for name in ("amplitude", "phase", "peak_force"):
        taken_over = (there[name] == back[name]).values.reshape(len(zc), -1).all(axis=1)
        assert not taken_over[differs].any()
        assert taken_over[~differs].sum() >= (~differs).sum() - 1  # the first one that the motion lands on is found


def test_steps_are_longer_where_orbits_may_be_farther_from_their_predictions_and_the_orbits_the_same():
    # on a finer grid its points bound the steps
    problem, zc = lever("viscous", A0=30e-9).problem, np.linspace(34e-9, 24e-9, 12)
    found = []
    for predicted in (1e-4, 1e-1):
        block = Block.of_one(problem, df.SolverSettings(), 1)
        block.predicted = predicted
        start = States(block.batch.at_heights(zc[:1]).free(), np.empty((1, 0)), np.empty((1, 0)))
        found.append(block.follow(np.zeros(1, int), start, zc[:1], zc[None]))
    assert found[0].done[0] == found[1].done[0] == len(zc)
    assert found[1].x == pytest.approx(found[0].x, abs=SAME)
    # Newton's method has a longer way from predictions that are farther off
    assert found[1].steps.sum() > 1.1 * found[0].steps.sum()


@pytest.mark.parametrize("family", ["viscous", "jumping", "sagging"])
def test_a_curve_has_the_same_bits_however_long_the_calls_last_that_follow_it(monkeypatch, family):
    case = lever(family, A0=10e-9, Q=60.0, points_per_period=256)
    found, zc = [], np.linspace(12e-9, 4e-9, 9)
    for seconds in (0.0, 1e9):  # a call a march; all in a few calls
        monkeypatch.setattr(transient, "CHUNK_SECONDS", seconds)
        found.append(df.approach(case, zc=zc))
    xr.testing.assert_identical(*(curve.drop_attrs(deep=False) for curve in found))
    assert found[0].amplitude.min() < 5e-9


def test_whether_a_state_changes_suddenly_at_a_fold_does_not_depend_on_the_last_orbit_before_it():
    """On the way back the two states are 0.0195 of A0 apart at the fold, and farther where the first was last met."""
    case = lever(
        "jumping", A0=5e-9, k=24.150042634328447, Q=24.707441724712837, youngs_modulus=1.5e9, points_per_period=1024
    )
    zc = np.linspace(8.5e-9, 0.27461387988531477 * 5e-9, 46)
    coarse, fine = (df.approach(case, zc=grid, direction="both") for grid in (zc[::9], zc))
    check_same_curve(coarse, fine, 5e-9, AT_A_TOUCH)


@pytest.mark.parametrize("points", [45, 56, 111, 221])
def test_a_state_that_all_but_touches_a_force_that_jumps_has_no_end(points):
    """The tip turns 1 to 3 pm before contact, where the attraction would be off; the motion between two samples is longer."""
    air = df.example("figure-3-air-jump")
    curve = df.approach(air, zc=np.linspace(12e-9, 1e-9, points), direction="both", protocol="quasi_static")
    assert jumps_of(curve) == []
    assert (curve.status == df.Status.OK).all()
    assert float(curve.min_distance.min()) > 0.165e-9


def test_multipliers_are_smooth_where_the_tip_comes_to_touch_a_force_that_bends():
    """A step that dips into contact is left whole there: a cut would change its error, and so the map, at once."""
    polymer = df.Case(
        cantilever=df.Cantilever(f0="75 kHz", k="2.8 N/m", Q=180), drive=df.Drive(A0="25 nm"), tip=df.Tip(radius="10 nm"),
        sample=df.Sample(youngs_modulus="2 GPa"), forces=[df.forces.DMT(hamaker="4e-20 J")],
    )  # fmt: skip
    states = df.branches(polymer, zc={"start": "26 nm", "stop": "22 nm"}, search=1)
    (touch,) = np.flatnonzero(states.special.values == "grazing")
    assert 0 < touch < states.sizes["point"] - 1
    moduli = states.multiplier_modulus.values[touch - 1 : touch + 2]
    assert np.ptp(moduli) < 1e-4
    assert states.stable.values[touch]


DOUBLED = df.Case(
    cantilever=df.Cantilever(f0=70e3, k=0.684013, Q=11.92171), drive=df.Drive(A0=10e-9), tip=df.Tip(radius=31.3039e-9),
    sample=df.Sample(youngs_modulus=218.124e6, poisson_ratio=0.3),
    forces=[df.forces.DMT(hamaker=4.24312e-20), df.forces.KelvinVoigt(viscosity=10.0)],
)  # fmt: skip


@pytest.mark.parametrize("points", [57, 301])
def test_behind_a_period_doubling_the_doubled_state_goes_on(points):
    """From 7.898 to 7.735 nm the state that has lost its stability stands between the two taps of another one."""
    curve = df.approach(DOUBLED, zc=np.linspace(16e-9, 3e-9, points), direction="approach")
    doubled = (curve.zc < 7.895e-9) & (curve.zc > 7.74e-9)
    assert doubled.any()
    assert (curve.repeat_periods.values.ravel()[doubled.values] == 2.0).all()
    assert [way for way, jump in jumps_of(curve) if jump > 7.735e-9] == []


def test_a_doubled_state_has_the_error_by_which_many_samples_differ_and_becomes_as_accurate_as_asked_for():
    zc = np.linspace(16e-9, 3e-9, 57)
    zc = zc[zc > 7.74e-9]
    asked = ("solver.accuracy=1e-4", "solver.accuracy=1e-6", "solver.points_per_period=8192")
    curves = [df.approach(DOUBLED.set(one), zc=zc, direction="approach").isel(zc=-1) for one in asked]
    assert [one.repeat_periods.item() for one in curves] == [2.0, 2.0, 2.0]
    loose, strict, exact = curves
    own = DOUBLED.problem
    scale = own.modes[0].k * own.tones[0].A0 ** 2 / own.modes[0].Q
    off, less = (abs(one.total_virial.item() - exact.total_virial.item()) / scale for one in (loose, strict))
    assert off / 3.0 < loose.error_estimate.item() < 1e-4
    assert less < strict.error_estimate.item() * 3.0 < 1.5e-6 < 3.0 * loose.error_estimate.item()


def test_leaps_end_where_a_motion_has_no_orbit_to_come_to():
    """No leap leads over more than a period there: thousands of them took longer than the motion takes to settle in time."""
    case = df.Case(
        cantilever=df.Cantilever(f0=138e3, k=9.17, Q=18.1), drive=df.Drive(A0=3.24e-9), tip=df.Tip(radius=15.6e-9),
        sample=df.Sample(youngs_modulus=80e6, poisson_ratio=0.3),
        forces=[df.forces.DMT(hamaker=1.417e-19), df.forces.KelvinVoigt(viscosity=0.4776)],
    )  # fmt: skip
    block, at = Block.of_one(case.problem, case.solver, 1), np.array([1.6e-9])
    start = States(block.batch.at_heights(at).free(), np.empty((1, 0)), np.empty((1, 0)))
    _, arrived, periods = block.relax(np.array([0]), start, at)
    assert not arrived[0]
    assert periods[0] < 2 * transient.LEAST_MOST


def test_a_motion_that_settled_in_time_has_an_estimated_error(monkeypatch):
    def not_found(*given):
        found = settling.polished(*given)
        found.done[:] = 0
        return found

    def not_settled(block, cases, start, at):
        return start, not_found(block, cases, start, at), np.zeros(len(cases), bool), np.zeros(len(cases))

    case, zc = lever("viscous"), [20e-9, 19.9e-9]
    monkeypatch.setattr("dforce.solvers.quasi_static_walk.polished", not_found)
    monkeypatch.setattr("dforce.solvers.quasi_static_walk.settled", not_settled)
    curve = df.approach(case, zc=zc, direction="approach")
    assert (curve.status == df.Status.OK).all()
    assert ((curve.error_estimate > 0.0) & (curve.error_estimate < case.solver.accuracy)).all()


def test_a_force_too_rough_to_be_followed_is_settled_in_time():
    """A ripple of 10 fm on the force leaves the map an edge in every step that is tried: nothing crawls along them."""
    curves = [
        df.approach(
            df.Case(
                cantilever=df.Cantilever(f0="50 kHz", k="1 N/m", Q=100), drive=df.Drive(A0="8 nm"),
                forces=[df.forces.Custom(law="-P1*exp(-d/1e-9) + P2*sin(d/1e-14)", P1=1e-9, P2=ripple)],
            ), zc=[10.1e-9, 10.06e-9],
        ) for ripple in (0.0, 1e-13)
    ]  # fmt: skip
    assert np.abs(curves[0].amplitude - curves[1].amplitude).max() < 1e-4 * 8e-9
    assert jumps_of(curves[1]) == []


def test_a_motion_that_does_not_repeat_settles_some_times_between_values_however_far_apart(monkeypatch):
    """Of an amplitude of 5 nm, between distances 2.5 nm apart: a stride for each 2 % of the amplitude would be 25."""
    settled, steady = [], quasi_static_walk.steady

    def counted(*given):
        settled.append(given)
        assert len(settled) <= 3 * quasi_static_walk.MOST_STRIDES
        return steady(*given)

    monkeypatch.setattr(quasi_static_walk, "steady", counted)
    df.approach(lever("capillary", A0=5e-9, f0=50e3, k=2.0, Q=300.0, max_periods=300), zc=[5e-9, 2.5e-9, 0.25e-9])
    assert len(settled) > 5  # of strides: the motion does not repeat


def test_the_stiff_sample_has_one_jump_at_its_fold_whatever_the_step():
    case = lever("viscous", A0=30e-9)
    states = df.branches(case, zc={"start": "40 nm", "stop": "14 nm"})
    folds = states.zc.values[states.special.values == "fold"]
    for step in (0.2125e-9, 0.2e-9, 0.05e-9):
        curve = df.approach(case, zc=np.arange(34e-9, 19e-9, -step), direction="approach")
        (jump,) = curve.jump_zc.values
        # with 1024 samples or more; 7e-5 of the free amplitude less with those that the curve begins with
        assert jump == pytest.approx(23.10384e-9, abs=1e-5 * 30e-9)
        assert np.abs(folds - jump).min() < case.solver.accuracy * 30e-9
        assert 0.0 < curve.jump_error.item() < case.solver.accuracy


LINGERING = df.Case(  # at its second fold, on the way back, the motion leaves so slowly that it seems to have settled
    cantilever=df.Cantilever(f0="350 kHz", k="40 N/m", Q=400), drive=df.Drive(A0="30 nm"), tip=df.Tip(radius="20 nm"),
    sample=df.Sample(youngs_modulus="1.2 GPa", poisson_ratio=0.3), forces=[df.forces.DMT(hamaker="7.1e-20 J")],
)  # fmt: skip


@pytest.mark.parametrize("points", [22, 201, 211])
def test_a_jump_is_listed_where_the_motion_lingers_beside_its_fold(points):
    zc = np.linspace(36e-9, 15e-9, points)
    found = df.approach(LINGERING, zc=zc, direction="both")
    exact = df.approach(LINGERING.replace("solver.points_per_period", 2048), zc=zc, direction="both")
    assert found.jump_direction.values.tolist() == ["approach", "retract"]
    assert exact.jump_direction.values.tolist() == ["approach", "retract"]
    for name in ("jump_zc", "jump_before", "jump_after"):
        np.testing.assert_allclose(found[name], exact[name], rtol=0, atol=1e-3 * 30e-9)


def test_two_jumps_between_the_same_points_are_both_listed_as_on_a_fine_curve():
    case = lever("dmt", A0=5.6e-9, f0=300e3, k=45.0, Q=800.0, youngs_modulus=2.57e9, radius=5.5e-9)
    case = case.set("drive.frequency=299.853 kHz", "forces.dmt.hamaker=7.6e-20 J")
    fine, coarse = (df.approach(case, zc=np.linspace(8.4e-9, 3.36e-9, points), direction="both") for points in (201, 3))
    assert coarse.jump_direction.values.tolist() == ["approach", "retract", "retract"]
    first, second = coarse.jump_zc.values[1:]
    assert coarse.zc.values[1] < first < second < coarse.zc.values[0]
    for name, share in (("jump_zc", SAME_JUMP), ("jump_before", 2e-4), ("jump_after", SAME_JUMP)):
        np.testing.assert_allclose(coarse[name], fine[name], rtol=0, atol=share * 5.6e-9)
    back = fine.amplitude.sel(direction="retract").isel(tone=0)
    assert coarse.jump_after.values[1:] == pytest.approx(
        [float(back[back.zc >= jump].sel(zc=jump, method="nearest")) for jump in (first, second)], abs=0.003 * 5.6e-9
    )


def neighbors(result, block):
    """Give the numbers of neighbors that are ok, and whether the state of the first, followed, is that of the second."""
    zc, one, nothing = result.zc.values, np.array([0]), np.empty((1, 0))
    x = result.motion.values / block.scales_of(one, zc[:1])
    for i in np.flatnonzero((result.status.values[:-1] == 0) & (result.status.values[1:] == 0)):
        found = block.follow(one, States(x[[i]], nothing, nothing), zc[[i]], zc[None, [i + 1]])
        yield i, found.done[0] == 1 and np.abs(found.last_x[0] - x[i + 1]).max() < 1e-3


def soft_or_stiff(number):
    """Return a random case of DMT."""
    rng = np.random.default_rng([7, number])
    A0, R, f0, k, Q, modulus, hamaker = (
        np.exp(rng.uniform(*np.log(limits)))
        for limits in ((5e-9, 60e-9), (5e-9, 40e-9), (5e4, 4e5), (1, 50), (50, 800), (2e8, 2e10), (1e-20, 3e-19))
    )  # fmt: skip
    return df.Case(
        cantilever=df.Cantilever(f0=f0, k=k, Q=Q), drive=df.Drive(A0=A0), tip=df.Tip(radius=R),
        sample=df.Sample(youngs_modulus=modulus), forces=[df.forces.DMT(hamaker=hamaker)],
    )  # fmt: skip


# with 256 samples the map has dozens of small folds of its own there, at which the state seems to end; with 1024 it has none
SMALL_FOLDS = pytest.mark.xfail(
    strict=True, reason="small folds of the steps' own end a state that goes on behind them"
)
FOLDED = [pytest.param(number, marks=SMALL_FOLDS) for number in (9, 17)]


@pytest.mark.parametrize("number", [*range(24, 32), *FOLDED])
def test_neighbors_on_different_states_have_a_jump_between_them(number):
    case = soft_or_stiff(number)
    A0, block = case.problem.tones[0].A0, Block.of_one(case.problem, case.solver, 10)
    for way, zc in (("approach", np.linspace(1.3, 0.3, 24) * A0), ("retract", np.linspace(0.3, 1.3, 24) * A0)):
        found = df.approach(case, zc=zc, direction=way)
        listed = found.jump_zc.values if "jump_zc" in found else np.empty(0)
        for i, same in neighbors(found, block):
            low, high = sorted(found.zc.values[[i, i + 1]])
            assert same or ((listed >= low) & (listed <= high)).any()


@pytest.mark.parametrize("number", [25, *FOLDED])
def test_a_jump_lies_where_many_samples_have_it(number):
    case = soft_or_stiff(number)
    A0 = case.problem.tones[0].A0
    curves = (case, case.replace("solver.points_per_period", 4096))
    found, exact = (df.approach(one, zc=np.linspace(0.3, 1.3, 24) * A0, direction="retract").jump_zc for one in curves)
    np.testing.assert_allclose(found, exact, rtol=0, atol=case.solver.accuracy * A0)


NARROW_WINDOWS = {  # of instability by period doubling, between the points of a curve
    "soft": (0.3483241730178477, 241.48822857602755, 2.4443942749343748, 26.91091630335434, 1.1290022106020006,
             3.3271766349781124e-21, 1.0, 41),
    "off resonance": (0.35196455758806977, 625.8463119289113, 3.5151202489237807, 8.375438991410409, 0.4493176096259809,
                      3.604606189659021e-20, 1.0060053231195376, 69),
}  # fmt: skip


@pytest.mark.parametrize("window", NARROW_WINDOWS.values(), ids=NARROW_WINDOWS)
def test_a_state_ends_in_a_window_of_instability_that_is_narrower_than_a_step(window):
    k, Q, A0, R, modulus, hamaker, off, points = window
    zc = {"start": f"{1.25 * A0 + 1} nm", "stop": f"{0.25 * A0} nm", "points": points}
    case = df.Case(
        cantilever={"f0": "100 kHz", "k": f"{k} N/m", "Q": Q},
        drive={"A0": f"{A0} nm", "frequency": f"{off * 100} kHz"},
        tip={"radius": f"{R} nm"}, sample={"youngs_modulus": f"{modulus} GPa", "poisson_ratio": 0.3},
        forces=[{"model": "dmt", "hamaker": f"{hamaker} J"}],
        experiment={"kind": "approach", "direction": "both", "zc": zc},
    )  # fmt: skip
    found, dense = (df.run(one).jump_zc for one in (case, case.replace("experiment.zc.points", 8 * points)))
    np.testing.assert_allclose(found, dense, rtol=0, atol=case.solver.accuracy * A0 * 1e-9)


def test_a_curve_of_a_sweep_is_its_single_run_to_the_last_bit_however_dense():
    case = df.example("hysteresis").replace("experiment.zc.points", 101)
    alone, swept = df.run(case), df.sweep(case, {"cantilever.Q": [case.cantilever.Q, 300.0]}, workers=1)
    for name in ("amplitude", "phase", "peak_force", "status"):
        np.testing.assert_array_equal(swept[name].isel(Q=0), alone[name])


def test_a_motion_that_creeps_beside_a_fold_is_followed_until_it_leaves():
    """With the default samples the map has small folds before the last one; beside each a motion takes thousands of periods."""
    case = df.Case(
        cantilever={"f0": "350 kHz", "k": "40 N/m", "Q": 400},
        drive={"A0": "30 nm"},
        tip={"radius": "20 nm"},
        sample={"youngs_modulus": "1.2 GPa", "poisson_ratio": 0.3},
        forces=[{"model": "dmt", "hamaker": "7.1e-20 J"}],
    )
    curves = (case, case.replace("solver.points_per_period", 1024))
    found, exact = (df.approach(one, zc=np.linspace(24e-9, 32e-9, 81), direction="retract") for one in curves)
    assert found.jump_zc.values == pytest.approx(exact.jump_zc.values, abs=2e-5 * 30e-9)
    assert found.jump_before.values == pytest.approx(exact.jump_before.values, abs=5e-4 * 30e-9)
    assert (found.status == 0).all()


def test_escape_falls_like_a_square_root_towards_a_fold():
    case = df.example("hysteresis")
    states = df.branches(case, zc={"start": "25 nm", "stop": "8 nm"})
    folds = states.zc.values[states.special.values == "fold"]
    curve = df.approach(case)
    assert len(folds) == 2
    for way, fold in zip(("approach", "retract"), np.sort(folds), strict=True):
        ((_, jump),) = (pair for pair in jumps_of(curve) if pair[0] == way)
        assert jump == pytest.approx(fold, abs=SAME_JUMP * 20e-9)
        near = (abs(states.zc - fold) < 0.05e-9) & states.stable & (states.escape > 0.0)
        before = abs(states.zc - fold).values[near.values]
        escape = states.escape.values[near.values]
        kept = escape < 2.0 * escape.min() if len(escape) > 3 else escape > 0.0
        shares = escape[kept] / np.sqrt(before[kept])
        assert np.ptp(shares) < 0.2 * shares.max()


@pytest.mark.long
def test_behind_a_fold_the_motion_goes_where_another_integrator_takes_it():
    """DOP853, from the last motion before the fold and a hair behind it, comes to the state that the curve goes on with."""
    a0, f0, k, Q, modulus, hamaker = 20e-9, 70e3, 2.7, 40.0, 1e9, 1e-19
    case = lever("dmt", A0=a0, f0=f0, k=k, Q=Q, youngs_modulus=modulus, points_per_period=1024)
    (fold,) = df.approach(case, zc=np.linspace(24e-9, 10e-9, 15), direction="approach").jump_zc.values
    curve = df.approach(case, zc=[24e-9, fold + 1e-5 * a0, fold - 1e-3 * a0], direction="approach")
    left, reached = curve.isel(zc=1), curve.isel(zc=2)
    law = dmt_with_drag(8e-9, modulus / 0.91, hamaker, 0.0, 0.165e-9)
    equation = TipEquation(
        [(f0, k, Q)], [(f0, [k * a0 / Q], 0.0)], float(reached.zc), law, [Region(0.165e-9, 0.165e-9)], length=a0
    )
    z, v = left.motion.values[:1], left.motion.values[1:]
    z, v, _ = equation.follow(z, v, 300 / f0, rtol=1e-8)
    there = equation.measure(z, v, 1 / f0, rtol=1e-10)
    assert there["amplitude"] == pytest.approx(float(reached.amplitude[0]), abs=1e-4 * a0)
    assert abs(float(left.amplitude[0]) - float(reached.amplitude[0])) > 0.02 * a0
