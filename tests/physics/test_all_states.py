"""All states at a distance: held against a search on a fine grid, with SciPy's DOP853 and by the sum of the indices."""

import functools
import itertools
import math

import numpy as np
import pytest
from compiled import Known, ParameterRange, States, search, why_unproven
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import argrelmin

import dforce as df

NM = 1e-9
NARROW = ("2.905 nm", "2.895 nm")  # so narrow that no curve connects the states
TAU = 2.0 * math.pi
# amplitude (nm), phase (degrees) and multipliers of the five states at 2.9 nm, by DOP853 at a relative tolerance of 1e-12
FIVE = (
    (0.0824859, 178.04347, (4.38377, 0.18143)),  # saddle
    (0.0970140, 177.69853, (-0.33517 + 0.82644j, -0.33517 - 0.82644j)),
    (0.1030279, 177.55450, (-1.16417, -0.68318)),  # flip saddle
    (1.8543020, 124.84471, (1.46241, 0.54386)),  # saddle
    (1.9085143, 58.76611, (0.79723 + 0.39971j, 0.79723 - 0.39971j)),
)


@pytest.fixture(scope="module")
def adhesive():
    """Return a lever driven below its resonance whose bond pulls by 39 pN/nm more than the lever holds."""
    return df.Case(
        cantilever=df.Cantilever(f0="50 kHz", k=0.57, Q=28),
        drive=df.Drive(A0="1.6 nm", frequency="49 kHz"),
        forces=[df.forces.Morse(bond_energy="1.42e-18 J", decay="1.31 1/nm", bond_length="0.62 nm")],
    )


@pytest.fixture(scope="module")
def near(adhesive):
    """Return all states in a range so narrow that no curve of states connects them."""
    return df.branches(adhesive, zc=NARROW, search=3, largest_step=0.1)


def complex_multipliers(point):
    return point["multiplier_modulus"].values * np.exp(1j * np.radians(point["multiplier_angle"].values))


def equation(case, zc):
    """Return the equation of motion over a bond in units of the free amplitude and the drive, and its derivative."""
    mode, tone, bond = case.problem.modes[0], case.problem.tones[0], case.problem.forces[0]
    r, length, k = mode.f0 / tone.frequency, tone.A0, mode.k

    def force(d):
        x = math.exp(-bond.decay * (max(d, 0.0) - bond.bond_length))
        return 2.0 * bond.decay * bond.bond_energy * x * (x - 1.0)

    def change(t, y):
        pull = tone.force * math.cos(t) + force(zc + length * y[0])
        return [y[1], r * r * (pull / (k * length) - y[0]) - r / mode.Q * y[1]]

    def after(y, periods=1):
        return solve_ivp(change, (0.0, TAU * periods), y, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]

    def monodromy(y, periods=1):
        columns = [(after(y + h, periods) - after(y - h, periods)) / 2e-5 for h in 1e-5 * np.eye(2)]
        return np.column_stack(columns)

    return after, monodromy


def fixed_point(after, monodromy, y, periods=1):
    for _ in range(4):
        y = y + np.linalg.solve(np.eye(2) - monodromy(y, periods), after(y, periods) - y)
    return y


def at(states, zc):
    """Return the state on each curve that is interpolated to a distance, as points beside it."""
    x, branch = states["zc"].values, states["branch"].values
    return [
        i
        for i in range(len(x) - 1)
        if branch[i] == branch[i + 1] and (x[i] - zc) * (x[i + 1] - zc) <= 0.0 != x[i + 1] - zc
    ]


def test_all_five_states_over_a_strongly_adhesive_contact_are_found(near):
    # 2.9 nm is the middle of three searched values: found curves start there or cross it
    assert near["searched"].values == pytest.approx([2.905 * NM, 2.9 * NM, 2.895 * NM], rel=1e-12)
    single = near.isel(point=np.flatnonzero(near["repeat_periods"].values == 1))
    places = at(single, 2.9 * NM)
    assert len(places) == len(FIVE)
    found = sorted((float(single["amplitude"][i, 0]), i) for i in places)
    for (amplitude, i), (reference, phase, multipliers) in zip(found, FIVE, strict=True):
        # the nearest point of a curve is up to a tenth of the range away, over which these amplitudes change by up to 1 %
        assert amplitude == pytest.approx(reference * NM, rel=0.02)
        assert float(single["phase"][i, 0]) == pytest.approx(phase, abs=0.3)
        assert bool(single["stable"][i]) == (max(map(abs, multipliers)) < 1.0)
    flips = [i for _, i in found if single["multiplier_angle"].values[i, 0] == 180.0]
    assert len(flips) == 1


def test_the_reference_states_are_those_of_an_independent_integrator(adhesive):
    after, monodromy = equation(adhesive, 2.9 * NM)
    starts = ((-0.79457, 0.00176), (-0.59286, 0.00239), (-0.99849, 0.00293), (-0.74829, 1.04590), (0.47406, 0.86815))
    indices = 0
    for start, (_, _, multipliers) in zip(starts, FIVE, strict=True):
        y = fixed_point(after, monodromy, np.array(start))
        assert np.abs(y - start).max() < 1e-4  # as printed
        m = monodromy(y)
        # differences over 1e-5 with maps good to 1e-11
        assert np.sort_complex(np.linalg.eigvals(m)) == pytest.approx(np.sort_complex(np.array(multipliers)), abs=2e-4)
        indices += int(np.sign(np.linalg.det(np.eye(2) - m)))
    assert indices == 1


def test_the_sum_of_the_indices_says_whether_a_state_is_missing(near):
    assert (near["index_sum"].values == 1).all()
    assert near.attrs["completeness"].startswith("no single state is missing")
    found = {finding.name: finding for finding in df.summary(near)}
    assert found["completeness"].text.startswith("no single state is missing")
    assert found["completeness"].value == 1.0


def test_the_result_says_where_states_are_missing(adhesive, monkeypatch):
    from dforce.solvers import search

    monkeypatch.setattr(search, "ROUNDS", 0)
    monkeypatch.setattr(search, "EDGE_TRIES", 0)
    monkeypatch.setattr(search, "LAGS", (60.0,))
    few = df.branches(adhesive, zc=NARROW, search=2, largest_step=0.1)
    assert (few["index_sum"].values != 1).all()
    assert few.attrs["completeness"].startswith("states are missing")
    assert next(one for one in df.summary(few) if one.name == "completeness").value == 0.0


def test_a_doubled_state_is_followed_from_each_period_doubling(adhesive, near):
    single = near["repeat_periods"].values == 1
    [there] = near["zc"].values[(near["special"].values == "period_doubling") & single]
    doubled = near.isel(point=np.flatnonzero(near["repeat_periods"].values == 2))
    assert len(np.unique(doubled["branch"])) == 1
    # it begins where the single one loses its stability, and is stable itself there: the doubling is supercritical
    assert np.abs(doubled["zc"].values - there).min() < 0.01 * 0.01 * NM
    assert doubled["stable"].values.any()
    assert (doubled["status"] == df.Status.NOT_REPEATING).all()


def test_a_doubled_state_is_that_of_an_independent_integrator(adhesive, near):
    of_two = np.flatnonzero(near["repeat_periods"].values == 2)
    doubled = near.isel(point=of_two[np.argmin(np.abs(near["zc"].values[of_two] - 2.899 * NM))])
    after, monodromy = equation(adhesive, float(doubled["zc"]))
    y = fixed_point(after, monodromy, np.array([-0.99849, 0.00293]))  # the single state that it comes from
    values, vectors = np.linalg.eig(monodromy(y))
    y = y + 0.003 * vectors[:, np.argmin(values)].real
    for _ in range(300):
        y = after(y)
    y = fixed_point(after, monodromy, y, 2)
    assert np.abs(after(y) - y).max() > 0.01  # it alternates
    multipliers = np.sort(np.abs(np.linalg.eigvals(monodromy(y, 2))))
    # RK4 with 256 steps errs by some 1e-5; differences over 1e-5 with maps good to 1e-11
    assert multipliers == pytest.approx(np.sort(doubled["multiplier_modulus"].values), abs=2e-4)


class Map:
    """The map over a period over a random bond, and what the search finds there."""

    def __init__(self, Q, A0, k, excess, decay, length, height, **solver):
        bond = df.forces.Morse(bond_energy=4.0 * k * (1.0 + excess) / decay**2, decay=decay, bond_length=length)
        self.case = df.Case(
            cantilever=df.Cantilever(f0="50 kHz", k=k, Q=Q), drive=df.Drive(A0=A0, frequency="49 kHz"), forces=[bond]
        )
        zc = length + height * A0
        self.among = ParameterRange(lambda _: self.case.problem, zc - A0, zc + A0, df.SolverSettings(**solver), 1)
        self.value = zc / self.among.span

    def states(self):
        curves = []
        known = Known(self.among, curves, self.value)
        for curve in search(known, lambda: None):
            curves.append(curve)
        return known

    def after(self, motions):
        none = np.zeros((len(motions), 0))
        return self.among.later(States(motions, none, none), self.value, 1).x


random_bonds = functools.partial(
    st.builds, Map, Q=st.floats(2.0, 40.0), A0=st.floats(0.5e-9, 5e-9), k=st.floats(0.1, 2.0), excess=st.floats(-0.5, 0.3),
    decay=st.floats(0.8e9, 4e9), length=st.floats(0.3e-9, 1e-9), height=st.floats(0.1, 1.5),
)  # fmt: skip
bonds = random_bonds()
FINE = 2048  # samples that resolve how a wall throws back a motion far larger than the states


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@example(
    Map(
        Q=2.0,
        A0=5.000000015259679e-10,
        k=1.0,
        excess=0.0,
        decay=3777532275.0,
        length=9.98625182546676e-10,
        height=1.0,
        points_per_period=FINE,
    )
)
@example(  # with few samples the wall throws motions back anyhow
    Map(
        Q=3.0,
        A0=6.994049923092709e-10,
        k=1.0,
        excess=0.0,
        decay=3879858425.0,
        length=9.986251825466762e-10,
        height=1.0,
        points_per_period=FINE,
    )
)
@example(  # half a turn within 1e-4 of the circle
    Map(
        Q=37.0,
        A0=5e-10,
        k=1.0,
        excess=0.25,
        decay=3871086779.0,
        length=9.999954982444316e-10,
        height=0.25,
        points_per_period=FINE,
    )
)
@given(random_bonds(points_per_period=st.just(FINE)))
def test_the_indices_of_random_smooth_forces_add_up_to_one_along_a_large_circle(drawn):
    # the turns of P(x) - x along a circle are the sum of the indices inside; no bond reaches ten free amplitudes
    angles = np.linspace(0.0, TAU, 721)
    for _ in range(24):
        circle = 10.0 * np.column_stack([np.cos(angles), np.sin(angles)])
        moves = drawn.after(circle) - circle
        turned = np.diff(np.unwrap(np.arctan2(moves[:, 1], moves[:, 0])))
        coarse = np.abs(turned) >= 1.0
        angles = np.sort(np.append(angles, 0.5 * (angles[1:] + angles[:-1])[coarse]))
        if not coarse.any():
            break
    assert not coarse.any()  # fine enough to count
    assert round(turned.sum() / TAU) == 1


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@example(  # both ends of the edge settle on stable states before the last period
    Map(Q=40.0, A0=2.7e-9, k=1.07, excess=3e-10, decay=4e9, length=0.3e-9, height=0.125)
)
@example(  # one in a basin that random starts of Newton's method missed
    Map(Q=17.5, A0=2.682e-9, k=0.99563, excess=0.197362, decay=1.241716e9, length=5.96961e-10, height=0.8488769)
)
@given(bonds)
def test_the_states_found_over_random_smooth_forces_are_complete_and_each_is_one(drawn):
    known = drawn.states()
    orbits = known.single()
    for a, b in itertools.combinations(orbits, 2):
        assert np.abs(a.u - b.u).max() > 1e-5
    for orbit in orbits:
        assert np.abs(drawn.after(orbit.x[None]) - orbit.x).max() < 1e-8
        assert orbit.index == np.sign(np.prod(1.0 - orbit.multipliers).real)
    assert known.index_sum == 1


def test_the_index_along_a_curve_is_that_of_the_monodromy_matrix(adhesive):
    states = df.branches(adhesive, zc=("6 nm", "2.8 nm"), search=0, largest_step=0.05)
    single = states["repeat_periods"].values == 1
    x, mu = (
        states["zc"].values[single],
        np.array([complex_multipliers(states.isel(point=i)) for i in np.flatnonzero(single)]),
    )
    index = np.sign(np.prod(1.0 - mu, axis=1).real)
    folds = states["special"].values[single] == "fold"
    there = ~(folds[:-1] | folds[1:])
    assert set(index[:-1][there]) == {-1.0, 1.0}
    way = np.sign(np.diff(x))
    assert abs((way * index[:-1])[there].sum()) == there.sum()


@pytest.mark.parametrize(
    ("forces", "reason"),
    [
        ([df.forces.JKR(surface_energy="30 mJ/m^2")], "jkr has two branches"),
        ([df.forces.DMT(hamaker="2e-20 J", surface_energy="50 mJ/m^2")], "dmt jumps at 0.165 nm"),
        (
            [df.forces.Custom(law="-P1 * sign(velocity) * exp(-max(d, 0) / P2)", P1=1e-10, P2=1e-9)],
            "custom jumps where the tip turns",
        ),
    ],
)  # fmt: skip
def test_a_force_that_jumps_or_has_branches_proves_nothing_and_the_result_says_so(forces, reason):
    case = df.example("figure-3-branches").replace("forces", forces)
    assert why_unproven(case.problem) == reason
    assert why_unproven(df.example("figure-3-branches").problem) == ""


def test_doubled_states_have_a_look_of_their_own_in_the_picture(near):
    upper, *_ = df.plot.branches(near)
    widths = {line.get_linewidth() for line in upper.get_lines() if line.get_linestyle() != "None"}
    assert len(widths) == 2
    labels = [text.get_text() for text in upper.get_legend().get_texts()]
    assert "repeats after 2 periods" in labels


def test_the_motion_of_a_doubled_state_alternates_between_two_taps(near):
    of_two = np.flatnonzero(near["repeat_periods"].values == 2)
    point = near.isel(point=of_two[np.argmin(np.abs(near["zc"].values[of_two] - 2.898 * NM))])
    motion = df.motion_at(point)
    d = motion["distance"].values[:-1]
    taps = d[argrelmin(d, mode="wrap")]
    assert len(taps) == 2
    # the least of 256 samples a period is up to 1e-4 of the swing above the turning point
    assert taps.min() == pytest.approx(float(point["min_distance"]), abs=1e-4 * NM)
    assert np.ptp(taps) > 0.05 * NM


def test_a_run_stopped_within_a_doubled_state_goes_on_to_the_same_states(adhesive, near, every_look):
    [curve] = np.unique(near["branch"].values[near["repeat_periods"].values == 2])
    looks = 0

    def stop(done, total, note):
        nonlocal looks
        looks += note.startswith(f"curve {curve},")
        if looks == 12:
            raise KeyboardInterrupt

    case = adhesive.replace(
        experiment={"kind": "branches", "zc": {"start": NARROW[0], "stop": NARROW[1]}, "search": 3, "largest_step": 0.1}
    )
    part = df.run(case, stop)
    assert part.attrs["completeness"] == "not checked: the run was stopped"
    assert (part["repeat_periods"].values == 2).any()
    rest = df.run(case, resume=part)
    for name in near.variables:
        np.testing.assert_array_equal(rest[name].values, near[name].values, err_msg=str(name))
    assert rest.attrs["completeness"] == near.attrs["completeness"]


def test_the_summary_says_why_nothing_is_proven():
    sticky = df.example("figure-3-branches").replace("forces", [df.forces.JKR(surface_energy="30 mJ/m^2")])
    states = df.branches(sticky, zc=("12 nm", "11 nm"), search=2, largest_step=0.3)
    assert states.attrs["completeness"].startswith("not proven: jkr has two branches")
    assert next(one for one in df.summary(states) if one.name == "completeness").value is None
