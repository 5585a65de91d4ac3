"""Plans: operating points against reference values, limits, margins, goals, and what is refused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.colors import to_hex
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.inverse._plan_words import missing_damping
from dforce.inverse._states import Solver
from dforce.plot import plans
from dforce.solvers.continuation import Curve


def hertz(modulus: float, k: float = 1.0, Q: float = 100.0, A0: float = 20e-9, f0: float = 50e3) -> df.Case:
    return df.Case(
        cantilever=df.Cantilever(f0=f0, k=k, Q=Q),
        drive=df.Drive(A0=A0),
        tip=df.Tip(radius="10 nm"),
        sample=df.Sample(youngs_modulus=modulus, poisson_ratio=0.3),
        forces=[df.forces.Hertz()],
        solver=df.SolverSettings(accuracy=1e-6),
    )


def viscous(f0: str, k: str, Q: float, A0: str, radius: str, modulus: str, hamaker: str, viscosity: str) -> df.Case:
    return df.Case(
        cantilever=df.Cantilever(f0=f0, k=k, Q=Q),
        drive=df.Drive(A0=A0),
        tip=df.Tip(radius=radius),
        sample=df.Sample(youngs_modulus=modulus, poisson_ratio=0.3),
        forces=[df.forces.DMT(hamaker=hamaker), df.forces.KelvinVoigt(viscosity=viscosity)],
        solver=df.SolverSettings(accuracy=1e-6),
    )


STIFF = viscous("70 kHz", "2.7 N/m", 180.0, "30 nm", "8 nm", "2 GPa", "6e-20 J", "20 Pa s")
SOFT = viscous("20 kHz", "0.1 N/m", 3.0, "3 nm", "5 nm", "50 MPa", "1e-21 J", "5 Pa s")
SHARES = [0.5, 0.8, 0.9]

# of an independent integrator with 4096 samples a period: distance (nm), phase (deg), peak force (nN), indentation (nm)
REFERENCE = {
    "stiff": (
        STIFF,
        [14.197840, 23.220219, 26.261923],
        [30.34728, 53.49762, 64.59035],
        [5.403870, 5.011739, 4.452471],
        [1.004300, 0.972551, 0.926391],
    ),
    "hertz": (
        hertz(1e9),
        [9.694763, 15.730467, 17.784174],
        [30.00674, 53.13321, 64.16012],
        [1.576504, 1.400126, 1.143315],
        [0.487377, np.nan, 0.393410],
    ),
    "soft hertz": (
        hertz(0.05e9),
        [7.989089, 14.159231, 16.412685],
        [30.00462, 53.13248, 64.15970],
        [0.737647, 0.658278, 0.538597],
        [np.nan, np.nan, 1.754948],
    ),
}


def repulsive(found, name: str):
    """Return a quantity of the repulsive state at each set point of a plan of one case."""
    one = found.isel(A0=0)
    values = one[name].values.reshape(*one["regime"].shape, -1)[..., 0]
    return np.where(one["regime"] == "repulsive", values, 0.0).sum(axis=1, where=np.isfinite(values))


@pytest.mark.parametrize("name", REFERENCE)
def test_operating_points_are_those_of_an_independent_integrator(name):
    case, zc, phase, force, depth = REFERENCE[name]
    found = df.plan(case, {"drive.A0": [case.drive.A0]}, SHARES)
    np.testing.assert_allclose(repulsive(found, "zc"), np.array(zc) * 1e-9, rtol=1e-6)
    np.testing.assert_allclose(repulsive(found, "phase"), phase, rtol=1e-5)
    # extremes of the reference are those of its samples, up to 2e-5 low; ours are met between samples
    np.testing.assert_allclose(repulsive(found, "peak_force"), np.array(force) * 1e-9, rtol=2e-5)
    known = np.isfinite(depth)
    np.testing.assert_allclose(repulsive(found, "max_indentation")[known], np.array(depth)[known] * 1e-9, rtol=1e-5)


def test_the_peak_force_of_hertz_is_that_of_its_deepest_indentation():
    found = df.plan(hertz(1e9), {"drive.A0": ["20 nm"]}, SHARES)
    law = 4.0 / 3.0 * 1e9 / 0.91 * np.sqrt(10e-9) * found.max_indentation**1.5
    np.testing.assert_allclose(found.peak_force, law, rtol=1e-9)


@pytest.mark.parametrize(
    ("modulus", "k", "Q", "A0", "f0", "ratios"),
    [
        (1e9, 1.0, 1000.0, 20e-9, 50e3, {0.5: 1.0097, 0.8: 1.0056, 0.9: 1.0042}),
        (1e9, 1.0, 100.0, 20e-9, 50e3, {0.5: 1.0488, 0.8: 1.0284, 0.9: 1.0211}),
        (1e9, 10.0, 1000.0, 100e-9, 50e3, {0.5: 1.0085, 0.8: 1.0049, 0.9: 1.0037}),
        (50e6, 0.3, 3.0, 8e-9, 20e3, {0.8: 1.144, 0.9: 1.104}),
    ],
)
def test_peak_forces_go_to_their_asymptote(modulus, k, Q, A0, f0, ratios):
    found = df.plan(hertz(modulus, k, Q, A0, f0), {"drive.A0": [A0]}, list(ratios))
    alpha = 4.0 / 3.0 * modulus / 0.91 * np.sqrt(10e-9)
    for share, ratio in ratios.items():
        work = (4.0 * np.sqrt(2.0) / 3.0) * (k / Q) * A0**1.5 * np.sqrt(share * (1.0 - share**2))
        asymptote = alpha**0.25 * work**0.75  # from the virial of a short Hertzian contact
        assert float(found.peak_force.sel(set_point=share)[0, 0]) / asymptote == pytest.approx(ratio, abs=6e-4)


def test_the_free_amplitude_at_a_force_limit_is_solved_between_values_of_the_grid():
    found = df.plan(
        SOFT, {"drive.A0": {"start": "1 nm", "stop": "3 nm", "points": 5}}, [0.8, 0.9], {"peak_force": "< 100 pN"}
    )
    edges = {round(float(s), 6): float(a) for s, a in zip(found.edge_set_point, found.edge_A0, strict=True)}
    assert edges[0.8] == pytest.approx(1.488972e-9, rel=5e-6)
    assert edges[0.9] == pytest.approx(1.821234e-9, rel=5e-6)
    assert set(found.edge_kind.values.tolist()) == {"peak_force"}


def test_a_lever_is_planned_as_well():
    found = df.plan(SOFT, {"cantilever.k": [0.02, 0.05, 0.1]}, [0.9])
    np.testing.assert_allclose(found.peak_force[:, 0, 0], [67.786e-12, 107.965e-12, 166.685e-12], rtol=1e-5)
    np.testing.assert_allclose(found.max_indentation[:, 0, 0], [0.71180e-9, 0.89437e-9, 1.13192e-9], rtol=1e-5)


def test_phase_shows_no_contrast_without_loss_and_some_with_it():
    goal = {"maximize": "slope_of_phase:sample.youngs_modulus"}
    without = df.plan(hertz(1e9).replace("solver.accuracy", 1e-8), {"drive.A0": ["20 nm"]}, [0.5, 0.8], None, goal)
    # work of the drive = losses of the lever: sin(phase) = A/A0 (1 + sum of (n A_n / A)^2 over the harmonics), so that the
    # modulus shows in the small loss of the harmonics alone, here less than a thousandth of a degree
    assert float(np.abs(without.slope_of_phase).max()) < 1e-3
    for j, share in enumerate((0.5, 0.8)):
        sines = []
        for factor in (np.exp(0.005), np.exp(-0.005)):
            case = hertz(1e9 * factor).replace("solver.accuracy", 1e-8)
            alone = df.plan(case, {"drive.A0": ["20 nm"]}, [share])
            dwell = df.dwell(case, zc=float(alone.zc[0, 0, 0]), harmonics=60)
            harmonics = dwell.harmonic * dwell.harmonic_amplitude / dwell.amplitude[0]
            sines.append(share * float((harmonics**2).sum()))
        predicted = np.degrees(np.diff(np.arcsin(sines[::-1]))[0]) / 0.01
        assert float(without.slope_of_phase[0, j, 0]) == pytest.approx(predicted, rel=0.02)


def test_contrast_is_the_slope_at_constant_amplitude():
    goal = {"maximize": "slope_of_phase:sample.youngs_modulus"}
    lossy = df.plan(STIFF, {"drive.A0": ["30 nm"]}, [0.8], None, goal).isel(A0=0, set_point=0)
    state = lossy.isel(state=int(np.flatnonzero(lossy.regime == "repulsive")[0]))
    zc = float(state.zc)
    start = {"amplitude": float(np.ravel(state.amplitude)[0]), "phase": np.radians(float(np.ravel(state.phase)[0]))}

    def at(distance, factor):
        dwell = df.dwell(STIFF.replace("sample.youngs_modulus", 2e9 * factor), zc=distance, start=start)
        return np.array([float(dwell.phase[0]), float(dwell.amplitude[0])])

    by_modulus = (at(zc, np.exp(0.005)) - at(zc, np.exp(-0.005))) / 0.01
    by_distance = (at(zc + 0.05e-9, 1.0) - at(zc - 0.05e-9, 1.0)) / 0.1e-9
    # d phase / d ln E at constant amplitude, from the slopes at constant distance and by the distance
    expected = by_modulus[0] - by_distance[0] * by_modulus[1] / by_distance[1]
    assert float(state.slope_of_phase) == pytest.approx(expected, rel=0.02)
    assert abs(expected) > 0.02


@pytest.fixture(scope="module")
def protein():
    limits = {"peak_force": "< 100 pN", "states": "one", "margin": {"set_point": 0.03, "drive.A0": "5 %"}}
    case = SOFT.replace("solver.accuracy", 1e-4)
    vary = {"drive.A0": {"start": "1 nm", "stop": "2 nm", "points": 7}}
    return df.plan(case, vary, [0.75, 0.8, 0.85, 0.9], limits, {"minimize": "peak_force"})


def test_limits_hold_at_every_corner_of_the_margins(protein):
    (at,) = np.argwhere(protein.recommended.values)
    point = protein.isel(A0=at[0], set_point=at[1])
    assert bool(point.allowed.any())
    corners = df.plan(
        SOFT,
        {"drive.A0": [float(point.A0) / 1.05, float(point.A0), float(point.A0) * 1.05]},
        [float(point.set_point) + d for d in (-0.03, 0.0, 0.03)],
    )
    assert float(corners.peak_force.isel(state=0).max()) < 100e-12
    assert (protein.limit_hit == "margin: peak_force").any()
    assert not (protein.allowed & (protein.peak_force >= 100e-12)).any()


def test_the_recommended_point_has_the_most_room_and_its_motion(protein):
    assert int(protein.recommended.sum()) == 1
    assert float(protein.room.where(protein.recommended).max()) == float(protein.room.where(protein.allowed).max())
    assert float(protein.room.where(protein.allowed, 1.0).min()) >= 0.0
    dwell = df.run(df.Case.from_toml(protein.attrs["recommended_case"]))
    marked = protein.peak_force.where(protein.recommended).max()
    assert float(dwell.peak_force) == pytest.approx(float(marked), rel=1e-3)
    np.testing.assert_allclose(protein.force, dwell.force)
    best = protein.peak_force.where(protein.allowed).min()
    assert float(protein.peak_force.where(protein.best).max()) == float(best)


def test_a_point_of_the_front_is_beaten_by_none():
    vary = {"drive.A0": {"start": "1 nm", "stop": "3 nm", "points": 5}}
    goal = {"minimize": "peak_force", "maximize": "total_dissipated_energy"}
    found = df.plan(SOFT.replace("solver.accuracy", 1e-4), vary, [0.7, 0.8, 0.9], None, goal)
    force, loss = (
        found.peak_force.values[found.pareto.values],
        found.total_dissipated_energy.values[found.pareto.values],
    )
    order = np.argsort(force)
    assert 1 < len(force) < int(found.allowed.sum())
    assert (np.diff(loss[order]) > 0.0).all()  # more loss costs more force along the front


def test_two_stable_states_at_one_distance_are_told():
    found = df.plan(STIFF.replace("solver.accuracy", 1e-4), {"drive.A0": ["30 nm"]}, [0.6, 0.8], {"states": "one"})
    one = found.isel(A0=0)
    # the folds are at 23.102 and 29.365 nm: at 0.6 the repulsive state lies before both, at 0.8 within
    assert one.limit_hit.sel(set_point=0.6).values[0] == ""
    assert set(one.limit_hit.sel(set_point=0.8).values.tolist()) == {"states"}


def test_a_picture_shows_the_plan(protein):
    axes = df.plot.plan(protein)
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert {"all limits hold", "peak force", "most room", "best by the goal", "its margins"} <= set(words)
    plt.close("all")


def color_at(axes, x, y):
    canvas = axes.figure.canvas
    canvas.draw()
    column, row = axes.transData.transform((x, y))
    return to_hex(np.asarray(canvas.buffer_rgba())[-1 - round(row), round(column), :3] / 255.0)


def test_the_picture_is_green_up_to_the_located_boundaries_and_not_beyond():
    vary = {"drive.A0": {"start": "1 nm", "stop": "3 nm", "points": 5}}
    found = df.plan(SOFT.replace("solver.accuracy", 1e-4), vary, [0.7, 0.8, 0.9], {"peak_force": "< 100 pN"})
    axes = df.plot.plan(found)
    across = found.edge_set_point.isin(found.set_point) & (found.edge_set_point < 0.9) & (found.edge_set_point > 0.7)
    assert across.any()
    step = 0.15 * 0.5  # nm, of the grid's step
    for A0, share in zip(1e9 * found.edge_A0[across].values, 100.0 * found.edge_set_point[across].values, strict=True):
        assert color_at(axes, A0 - step, share) == plans.ALLOWED
        assert color_at(axes, A0 + step, share) != plans.ALLOWED
    plt.close("all")


def test_green_ends_a_margin_before_the_located_boundary():
    vary = {"drive.A0": {"start": "1 nm", "stop": "3 nm", "points": 5}}
    limits = {"peak_force": "< 100 pN", "margin": {"drive.A0": "5 %"}}
    found = df.plan(SOFT.replace("solver.accuracy", 1e-4), vary, [0.8, 0.9, 0.95], limits)
    axes = df.plot.plan(found)
    edge = 1e9 * float(found.edge_A0[found.edge_set_point == 0.9][0])  # 1.821 nm: with its margin 1.734 nm
    assert color_at(axes, edge / 1.045, 90.0) != plans.ALLOWED
    assert color_at(axes, edge / 1.06, 90.0) == plans.ALLOWED
    plt.close("all")


AIR = df.example("figure-3-air")


def test_a_plan_knows_stable_states_that_no_approach_meets():
    vary, limits = {"drive.A0": ["8 nm", "10 nm", "12 nm"]}, {"peak_force": "< 200 pN"}
    found = df.plan(AIR, vary, [0.7, 0.8, 0.9], limits)
    one = found.sel(set_point=0.8).isel(A0=1)
    branches = df.branches(AIR, zc=("16 nm", "3 nm"))
    states = df.at_set_point(branches, 0.8)
    wanted = sorted(states.peak_force.values[states.stable.values].tolist())
    np.testing.assert_allclose(sorted(one.peak_force.values.tolist()), wanted, rtol=2e-3, atol=1e-14)
    assert one.limit_hit.values.tolist() == ["", "peak_force"]
    assert one.others.values.all()
    assert "stable states on the branches" in found.attrs["findings"]
    where = 1e9 * float(one.zc[one.limit_hit.values.tolist().index("peak_force")])
    said = f"another stable state, at zc = {where:.4g} nm, fails a limit: peak_force, 398 pN"
    assert said in found.attrs["findings"]
    alone = df.plan(AIR, {"drive.A0": ["10 nm"]}, [0.8], limits | {"states": "one"})
    assert not alone.allowed.any()


def test_a_plan_knows_a_state_on_an_isolated_branch_of_a_soft_lever_in_liquid():
    """The bias pulls the tip in; the states in contact lie on a branch of their own, between 1.4 nm and 4.5 nm."""
    case = df.Case(
        cantilever={"f0": "10 kHz", "k": 0.27, "Q": 2.8},
        drive={"A0": "4.7 nm"},
        tip={"radius": "3.9 nm"},
        sample={"youngs_modulus": "0.7 GPa"},
        forces=[df.forces.DMT(hamaker="25 zJ"), df.forces.Electrostatic(bias="1.9 V")],
    )
    found = df.plan(case, {"drive.A0": ["4.7 nm"]}, [0.6, 0.7, 0.8])
    assert found.zc.shape == (1, 3, 1)
    for share in (0.6, 0.7, 0.8):
        state = found.sel(set_point=share).isel(A0=0, state=0)
        start = {"amplitude": float(np.ravel(state.amplitude)[0]), "phase": np.radians(float(np.ravel(state.phase)[0]))}
        settled = df.dwell(case.replace("solver.method", "transient"), zc=float(state.zc), start=start)
        assert float(np.ravel(settled.amplitude_ratio)[0]) == pytest.approx(share, abs=1e-3)


def test_a_plan_without_a_stable_state_is_refused(monkeypatch):
    solve = Solver.solve

    def none(solver, points):
        found = solve(solver, points)
        found.found[:] = False
        return found

    monkeypatch.setattr(Solver, "solve", none)
    with pytest.raises(df.ParameterError, match="no curve has a stable state at any of the set points"):
        df.plan(hertz(1e9), {"drive.A0": ["20 nm"]}, [0.8])


def test_a_plan_of_one_state_at_a_distance_says_where_the_set_point_has_another_that_fails_a_limit():
    limits = {"regime": "repulsive", "states": "one"}
    vary = {"drive.A0": ["34.9 nm", "35 nm", "35.1 nm"]}
    found = df.plan(STIFF, vary, [0.895, 0.9, 0.905], limits)
    other = found.isel(A0=1, set_point=1)
    assert other.regime.values.tolist() == ["attractive", "repulsive"] and other.recommended.values.tolist() == [
        False,
        True,
    ]
    assert f"state, at zc = {1e9 * float(other.zc[0]):.4g} nm, fails a limit: regime." in found.attrs["findings"]


def test_a_plan_says_that_another_state_keeps_a_limit_but_not_within_the_margins():
    limits = {"peak_force": "< 410 pN", "margin": {"set_point": 0.05, "drive.A0": "5 %"}}
    found = df.plan(AIR, {"drive.A0": ["9.9 nm", "10 nm", "10.1 nm"]}, [0.79, 0.8, 0.81], limits)
    assert "fails a limit within the margins: peak_force, 398 pN" in found.attrs["findings"]


def sls(A0="20 nm", **numbers):
    lever = {"k": "2.7 N/m", "f0": "70 kHz", "Q": 180}
    solid = df.forces.SLS(instant_modulus="1 GPa", relaxed_modulus="0.5 GPa", relaxation_time="1 us", elements=4)
    forces = [solid, df.forces.VanDerWaals(hamaker="6e-20 J")]
    return df.Case(cantilever=lever, drive={"A0": A0}, tip={"radius": "8 nm"}, forces=forces, **numbers)


@pytest.mark.long
def test_a_plan_of_forces_with_memory_has_the_states_that_a_transient_settles_to():
    one = df.plan(sls(), {"drive.A0": ["20 nm"]}, [0.8], {"peak_force": "< 1 nN"}).isel(A0=0, set_point=0)
    assert sorted(one.regime.values.tolist()) == ["attractive", "repulsive"]
    assert one.limit_hit.values.tolist() == ["", "peak_force"]
    for state in range(one.sizes["state"]):
        here = one.isel(state=state)
        start = {"amplitude": 0.8 * 20e-9, "phase": float(np.radians(here.phase[0]))}
        settled = df.run(
            sls(solver={"method": "transient"}, experiment=df.experiments.Dwell(zc=float(here.zc), start=start))
        )
        assert float(settled.amplitude[0]) == pytest.approx(16e-9, rel=1e-5)
        assert float(settled.peak_force) == pytest.approx(float(here.peak_force), rel=1e-3, abs=1e-15)


@pytest.fixture(scope="module")
def larger():
    """Return a plan over free amplitudes larger than the A0 of its case."""
    return df.plan(STIFF, {"drive.A0": ["40 nm", "45 nm", "50 nm", "55 nm", "60 nm"]}, [0.7, 0.75, 0.8, 0.85, 0.9])


def test_the_advice_on_a_plan_is_about_its_recommended_settings_and_not_about_its_case(larger):
    said = {piece.name: piece.text for piece in df.advice(larger)}
    assert "amplitude_beyond_the_drive" not in said  # 60 nm are not beyond the drive of that setting
    wanted = df.advice(df.run(df.Case.from_toml(larger.attrs["recommended_case"])))
    assert said == {piece.name: f"At the recommended settings: {piece.text}" for piece in wanted}
    assert "tabor_of_dmt" in said
    assert df.advice(STIFF, larger) == df.advice(larger)


def test_the_answer_of_a_plan_counts_states_and_names_the_recommended_settings(larger):
    point, fewer = larger.where(larger.recommended, drop=True).squeeze(), larger.copy(deep=True)
    fewer["allowed"][0, 0], fewer["limit_hit"][0, 0] = False, "no state"
    lines = {line.name: line.text for line in df.summary(fewer)}
    assert lines["allowed"] == "24 of 24"
    assert f"A0 {1e9 * float(point.A0):g} nm, set point {100.0 * float(point.set_point):g} %" in lines["recommended"]
    assert f"Most room: {lines['recommended']}." in df.answer(fewer)


def test_of_many_cases_a_plan_says_which_states_are_meant(monkeypatch):
    monkeypatch.setattr("dforce.inverse.planner.MOST_WALKED", 0)
    found = df.plan(AIR, {"drive.A0": ["10 nm"]}, [0.8], {"peak_force": "< 200 pN"})
    assert "the states on approach and retract; with fewer cases" in found.attrs["findings"]
    assert found.sizes["state"] == 1


def test_a_plan_of_many_cases_names_a_hard_state_beside_the_points_it_chooses(monkeypatch):
    vary, limits, goal = {"drive.A0": ["8 nm", "10 nm", "12 nm"]}, {"peak_force": "< 200 pN"}, {"maximize": "phase"}
    whole = df.plan(AIR, vary, [0.7, 0.75, 0.8, 0.85], limits, goal)
    monkeypatch.setattr("dforce.inverse.planner.MOST_WALKED", 2)
    found = df.plan(AIR, vary, [0.7, 0.75, 0.8, 0.85], limits, goal)
    for name in ("recommended", "best"):
        place = np.argwhere(found[name].values)[0]
        np.testing.assert_array_equal(place, np.argwhere(whole[name].values)[0])
        here, there = found.isel(A0=place[0]), whole.isel(A0=place[0])
        for quantity in ("zc", "peak_force", "room", "slope_of_phase" if "slope_of_phase" in found else "phase"):
            np.testing.assert_allclose(here[quantity], there[quantity], rtol=1e-6, atol=1e-13, err_msg=quantity)
        np.testing.assert_array_equal(here.limit_hit, there.limit_hit)
    assert "fails a limit: peak_force" in found.attrs["findings"]
    assert "the states on the branches count only where" in found.attrs["findings"]


def test_a_plan_of_many_cases_takes_the_next_point_where_branches_have_another_state_beside_the_first(monkeypatch):
    vary, shares = {"drive.A0": ["5 nm", "6 nm", "8 nm", "10 nm", "12 nm"]}, [0.85, 0.9, 0.95, 0.97]
    whole = df.plan(AIR, vary, shares, {"states": "one"})
    monkeypatch.setattr("dforce.inverse.planner.MOST_WALKED", 4)
    found = df.plan(AIR, vary, shares, {"states": "one"})
    np.testing.assert_array_equal(found.recommended.any("state"), whole.recommended.any("state"))
    assert not found.others.values[found.recommended.values].any()


def test_a_gentle_state_holds_within_its_margins_and_up_to_where_its_branch_ends():
    limits = {"peak_force": "< 200 pN", "margin": {"set_point": 0.03}}
    found = df.plan(AIR, {"drive.A0": ["10 nm", "14 nm"]}, [0.7, 0.8, 0.9], limits)
    assert (found.limit_hit.sel(A0=10e-9)[:, 0] == "").all()
    branches = df.branches(AIR.replace("drive.A0", "14 nm"), zc=("22 nm", "5 nm"))
    gentle = branches.stable.values & (branches.peak_force.values < 200e-12)
    lowest = branches.amplitude_ratio.values.reshape(len(gentle), -1)[gentle, 0].min()
    edge = found.edge_set_point.values[found.edge_A0 == 14e-9]
    assert edge == pytest.approx(lowest, abs=1e-3)


def test_a_plan_follows_no_motion_of_several_periods_which_it_does_not_use(monkeypatch):
    followed, grow = [], Curve.grow

    def recorded(curve, *arguments):
        followed.append(curve.repeats)
        grow(curve, *arguments)

    monkeypatch.setattr(Curve, "grow", recorded)
    monkeypatch.setattr("dforce.maps.seeds.FAR", 2.0)  # a period doubling lies at 2.9 nm
    bond = df.forces.Morse(bond_energy="1.42e-18 J", decay="1.31 1/nm", bond_length="0.62 nm")
    case = df.Case(
        cantilever={"f0": "50 kHz", "k": 0.57, "Q": 28}, drive={"A0": "1.6 nm", "frequency": "49 kHz"}, forces=[bond]
    )
    found = df.plan(case, {"drive.A0": ["1.6 nm"]}, [0.9])
    assert "stable states on the branches" in found.attrs["findings"]
    assert set(followed) == {1}


@pytest.fixture(scope="module")
def rough():
    """Return a plan at settings at which the repulsive state is stable only here and there."""
    case = df.Case(
        cantilever={"k": "0.98 N/m", "f0": "297 kHz", "Q": 308}, drive={"A0": "23.4 nm"}, tip={"radius": "17.7 nm"},
        sample={"youngs_modulus": "27 MPa", "poisson_ratio": 0.3}, forces=[df.forces.DMT(hamaker="3.2e-20 J")],
    )  # fmt: skip
    return df.plan(case, {"drive.A0": ["23.4 nm"]}, [0.7, 0.9], {"peak_force": "< 125 pN"}).isel(A0=0)


def test_a_hard_state_is_found_beside_a_gentle_one_whatever_lies_between_its_neighbors(rough):
    # a curve on retract taps at 0.9 A0 with 2.20 nN, at 0.48 A0; beside it motions do not repeat after each period
    there = rough.sel(set_point=0.9)
    assert there.limit_hit.values.tolist() == ["", "peak_force"]
    assert float(there.peak_force[1]) == pytest.approx(2.2e-9, rel=0.01)
    assert float(there.zc[1]) == pytest.approx(0.479 * 23.4e-9, rel=0.01)
    assert not rough.unsteady.any()


def test_a_hard_state_is_found_nearer_than_the_gentle_one_at_which_curves_end(rough):
    # the gentle one comes to 0.7 A0 at 0.72 A0, the hard one below 0.3 A0
    there = rough.sel(set_point=0.7)
    assert float(there.peak_force[1]) == pytest.approx(2.15e-9, rel=0.01)
    assert float(there.zc[1]) < 0.3 * 23.4e-9


def test_progress_of_a_plan_counts_the_cases_whose_branches_are_followed():
    told = []
    df.plan(AIR, {"drive.A0": ["8 nm", "10 nm", "12 nm"]}, [0.8], progress=lambda *one: told.append(one))
    assert {total for _, total, _ in told} == {9}
    assert told[-1] == (9, 9, "")


@pytest.mark.parametrize(
    ("case", "said"),
    [
        (hertz(1e9), ["dissipates no energy"]),
        (SOFT, ["squeezed between lever and sample"]),
        (SOFT.replace(forces=[{"model": "hertz"}]), ["dissipates no energy", "squeezed between lever and sample"]),
        (SOFT.replace("cantilever.Q", 30.0), []),
    ],
)  # fmt: skip
def test_a_plan_names_the_damping_that_a_case_leaves_out(case, said):
    found = list(missing_damping(case))
    assert len(found) == len(said)
    for text, words in zip(found, said, strict=True):
        assert words in text


def test_a_plan_whose_curves_reach_no_set_point_says_how_far_they_come_and_what_is_missing():
    soft = SOFT.replace(forces=[{"model": "hertz"}]).replace("sample.youngs_modulus", "10 kPa")
    with pytest.raises(df.ParameterError) as error:
        df.plan(soft, {"drive.A0": ["1 nm"]}, [0.3], {"peak_force": "< 1 pN"})
    (ratio,) = re.findall(r"the lowest A/A0 down to zc = -1.2 A0 is ([\d.]+) %;", str(error.value))
    assert 30.0 < float(ratio) <= 100.0
    assert "dissipates no energy" in str(error.value)


def test_a_plan_whose_curves_jump_across_the_set_points_says_so():
    snapping = hertz(1e9, k=0.1, Q=3.0, A0=1e-9).replace(forces=[{"model": "dmt", "hamaker": "2e-19 J"}])
    with pytest.raises(df.ParameterError, match=r"jumps across them \(the lowest A/A0 down to zc = -1.2 A0 is \d"):
        df.plan(snapping, {"drive.A0": ["1 nm"]}, [0.6], {"peak_force": "< 1 nN"})


def test_a_setting_without_room_is_not_recommended_and_a_sentence_says_what_would_help(tmp_path: Path):
    file = tmp_path / "plan.toml"
    file.write_text(TEXT.replace("points = 4", "points = 2").replace("0.85, ", ""))
    done = dforce(str(file))
    assert done.exit_code == 0
    assert "most room" not in done.stdout
    assert "No setting is recommended" in done.stdout and "Widen these ranges" in done.stdout
    assert "drive.A0 1 nm to 2 nm" in done.stdout


VARY = {"drive.A0": ["1 nm", "2 nm", "3 nm"]}


@pytest.mark.parametrize(
    ("vary", "limits", "goal", "sentence"),
    [
        ({"drive.A": ["1 nm"]}, None, None, "did you mean 'drive.A0'"),
        ({"drive.A0": []}, None, None, "drive.A0 has no values"),
        ({"solver.method": ["periodic"]}, None, None, "is not a plain number"),
        ({"drive.A0": [1e-9], "tip.radius": [1e-9], "cantilever.k": [1.0]}, None, None, "one or two are allowed"),
        ({"drive.A0": {"start": 1e-9, "stop": 2e-9, "points": 10**6}}, None, None, "at most 50000 are allowed"),
        (VARY, {"peak_forc": "< 1 pN"}, None, "did you mean 'peak_force'"),
        (VARY, {"peak_force": "< 100"}, None, 'has no unit; write for example "< 100 pN"'),
        (VARY, {"peak_force": 1e-10}, None, "is not a limit"),
        (VARY, {"peak_force": "< 1 nm"}, None, "is a length, not a force"),
        (VARY, {"peak_force": "< __import__('os')"}, None, "not a number with a unit"),
        (VARY, {"max_indentation": "< 20 % of sample.thickness"}, None, "but the case has no such value"),
        (VARY, {"max_indentation": "< 20 % of sample.youngs_modulus"}, None, "in Pa, not in m"),
        (VARY, {"regime": "repuls"}, None, "is not attractive or repulsive"),
        (VARY, {"margin": {"tip.radius": "5 %"}}, None, "a margin for a parameter that does not vary"),
        (VARY, {"margin": {"set_point": 3}}, None, "set_point = 3 is not above 0 and below 1"),
        (VARY, None, {"minimise": "peak_force"}, "did you mean 'minimize'"),
        (VARY, None, {"minimize": "peak"}, "did you mean 'peak_force'"),
        (VARY, None, {"maximize": "slope_of_phase"}, "needs a parameter"),
    ],
)
def test_a_mistake_in_a_plan_is_one_sentence(vary, limits, goal, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.plan(SOFT, vary, None, limits, goal)


@pytest.mark.parametrize("shares", [[], [1.0], ["a"], {"start": 0.5}, {"start": 0.5, "stop": 0.9, "points": 10**6}])
def test_set_points_are_shares(shares):
    with pytest.raises(df.ParameterError, match="set_points"):
        df.plan(SOFT, VARY, shares)


TEXT = f"""{SOFT.replace("solver.accuracy", 1e-4).to_toml()}
[plan]
vary = {{ "drive.A0" = {{ start = "1 nm", stop = "2 nm", points = 4 }} }}
set_points = [0.8, 0.85, 0.9]
[plan.limits]
peak_force = "< 100 pN"
"""


def dforce(*words: str):
    return CliRunner().invoke(app, ["plan", *words])


def test_a_plan_file_becomes_a_table_a_file_and_a_picture(workdir):
    Path("plan.toml").write_text(TEXT)
    done = dforce("plan.toml", "-o", "map.nc", "--plot", "map.png")
    assert done.exit_code == 0, done.output
    assert re.search(r"most room: A0 .* nm, set point 8[05] %, zc ", done.stdout)
    assert Path("map.png").stat().st_size > 5000
    assert int(df.read("map.nc").recommended.sum()) == 1
    low = "advice: At the recommended settings: Mode 1 has Q = "
    assert low in done.stderr and done.stderr.endswith("advice with remedies: dforce check map.nc\n")
    bare = dforce("plan.toml")
    assert low in bare.stderr and "dforce check" not in bare.stderr
    assert "low_Q" in {piece["name"] for piece in json.loads(dforce("plan.toml", "--json").stdout)["advice"]}
    Path("none.toml").write_text(TEXT.replace("100 pN", "1 fN"))
    none = dforce("none.toml")
    assert none.exit_code == 1
    assert re.search(
        r"holds nowhere: the best value is [\d.]+ pN, [\d.e+]+ times its limit, at drive.A0 = 1 nm, set point 90 %",
        none.stdout,
    )
    assert "The search covered drive.A0 1 nm to 2 nm, set points 80 % to 90 %" in none.stdout
    assert "the limit that fails is peak_force" in none.stderr
    assert "least violation: A0" in none.stdout


def test_a_stopped_plan_keeps_the_states_that_are_solved(workdir: Path, monkeypatch):
    Path("plan.toml").write_text(TEXT.replace("100 pN", "150 pN") + "margin = { set_point = 0.1 }\n")
    assert dforce("plan.toml", "-o", "whole.nc").exit_code == 0

    def stop(work, judged, holds):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("dforce.inverse.planner._Work._edges", stop)
        stopped = dforce("plan.toml", "-o", "part.nc", "--plot", "part.png")
    assert stopped.exit_code == 130
    assert "the states are kept" in stopped.stderr
    assert Path("part.png").stat().st_size > 5000
    part, whole = df.read("part.nc"), df.read("whole.nc")
    assert part.attrs["interrupted"] == 1 and "interrupted" not in whole.attrs
    assert not part.recommended.any() and int(whole.recommended.sum()) == 1
    for name in ("zc", "peak_force", "phase"):
        np.testing.assert_array_equal(part[name], whole[name])
    failed = whole.limit_hit.str.startswith("margin")
    assert failed.any() and part.allowed.values[failed.values].all()

    def at_once(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("dforce.inverse.planner._Work._states", at_once)
    nothing = dforce("plan.toml", "-o", "nothing.nc")
    assert (nothing.exit_code, Path("nothing.nc").exists()) == (130, False)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("[plan", "[plot"), "the table [plan] is missing"),
        (('vary = { "drive.A0"', 'vari = { "drive.A0"'), "did you mean 'vary'"),
        (("[plan]", "[plan"), "cannot be read"),
    ],
)
def test_a_bad_plan_file_is_one_sentence(tmp_path: Path, change, sentence):
    (tmp_path / "plan.toml").write_text(TEXT.replace(*change))
    done = dforce(str(tmp_path / "plan.toml"))
    assert done.exit_code == 2
    assert sentence in done.stderr
    assert dforce(str(tmp_path / "nothing.toml")).exit_code == 2


def test_a_plan_file_taken_for_a_case_is_sent_to_the_command_for_plans(tmp_path: Path):
    (tmp_path / "plan.toml").write_text(TEXT)
    with pytest.raises(df.CaseError, match=r"a file with a table \[plan\] is a plan; type dforce plan FILE"):
        df.load_case(tmp_path / "plan.toml")


def test_of_an_example_a_plan_asks_for_the_table_and_not_for_a_file():
    done = dforce("figure-3-air")
    assert done.exit_code == 2 and "figure-3-air: the table [plan] is missing" in done.stderr
