"""Errors to both sides of a fit, and the branches that they are found on."""

from dataclasses import replace
from types import SimpleNamespace

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from fitted_curves import ETA, E, H

import dforce as df
from dforce.inverse.fitting import profile
from dforce.inverse.fitting.minimize import Minimum
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.selection import PointSelection, checked_reading, measured
from dforce.inverse.fitting.unknowns import make_unknowns, start_vector
from dforce.inverse.free_part import stretch

NAMES = ("amplitude", "phase")
NUISANCE = ("zc_offset", "A0", "phase_offset")
ERRORS = (0.06, 0.045, 0.25, 5e-4, 4e-4, 0.06)  # of E, H, eta by their logarithms, offset and A0 in A0, phase: about


@pytest.fixture(scope="module")
def plain() -> xr.Dataset:
    return df.fit(fc.case_of("stiff"), fc.data_of("stiff"), free=[E, H, ETA], search=False)


@pytest.fixture(scope="module")
def profiled() -> xr.Dataset:
    return df.fit(fc.case_of("stiff"), fc.data_of("stiff"), free=[E, H, ETA], search=False, profile=[H])


@pytest.mark.long
def test_errors_to_both_sides_are_those_of_a_profile(plain: xr.Dataset, profiled: xr.Dataset) -> None:
    one, there = plain.sel(parameter=H), profiled.sel(parameter=H)
    error = float(one["error"])
    for name in ("error_low", "error_high"):
        assert float(one[name]) == pytest.approx(float(there[name]), rel=0.05, abs=0.0), name
        # the curve is steeper on one side, where the branch of free motion ends, which the covariance does not know
        assert abs(float(one[name]) / error - 1.0) > 0.15, name
    for name in ("interval_low", "interval_high"):
        away, right = (float(fit[name]) - float(one["value"]) for fit in (one, there))
        assert away == pytest.approx(right, rel=0.03, abs=0.0), name


def test_intervals_of_offset_and_modulus_are_those_of_a_profile_beside_a_parameter_that_is_hardly_known() -> None:
    case = fc.case_of("liquid", viscous=False).replace(H, 2e-22)
    zc = np.linspace(9.2e-9, 2e-9, 91)
    curve, draw = df.approach(case, zc=zc), np.random.default_rng(3)
    sigma = fc.SIGMA["liquid"]
    data = fc.dataset(
        zc,
        curve["amplitude"].values[:, 0] + draw.normal(0.0, sigma[0], len(zc)),
        curve["phase"].values[:, 0] + draw.normal(0.0, sigma[1], len(zc)),
        np.ones(len(zc)),
        sigma,
    )
    usual = df.fit(case, data, free=[E, H], search=False)
    there = df.fit(case, data, free=[E, H], search=False, profile=["zc_offset", E])
    assert float((usual["error"] / usual["value"]).sel(parameter=H)) > 0.5
    for name in ("zc_offset", E):
        one, right = usual.sel(parameter=name), there.sel(parameter=name)
        for end in ("interval_low", "interval_high"):
            away, known = (float(each[end] - each["value"]) for each in (one, right))
            assert away == pytest.approx(known, rel=0.02, abs=0.0), (name, end)


def test_an_interval_away_from_a_fold_close_by_ends_where_chi2_rises_so_far() -> None:
    """At its minimum the curve is so steep that derivatives there lead to ends far too near on the flat side."""
    case, draw = fc.case_of("stiff"), np.random.default_rng([5, 25])
    zc, sigma = np.linspace(43.5e-9, 9e-9, 100), fc.SIGMA["stiff"]
    curve = df.approach(case.replace("solver.points_per_period", 512), zc=zc, direction="both").isel(tone=0)
    rows = []
    for way, order in (("approach", slice(None)), ("retract", slice(None, None, -1))):
        one = curve.sel(direction=way).isel(zc=order)
        values = [one[name].values + draw.normal(0.0, size, 100) for name, size in zip(NAMES, sigma, strict=True)]
        columns = {"height": one["zc"].values - 0.35e-9, **dict(zip(NAMES, values, strict=True))}
        rows.append(
            xr.Dataset({name: ("point", column) for name, column in columns.items()}).assign_coords(
                direction=("point", np.full(100, way))
            )
        )
    data = xr.concat(rows, "point").assign_attrs(phase_convention="lag", history=["read: simulated"])
    data = df.calibrate(data, case)
    fit = df.fit(case, data, free=[E, H, ETA], search=False)
    end = float(fit["interval_high"].sel(parameter=H))
    there = df.fit(case.replace(H, end), data, free=[E, ETA], search=False)
    # 3.84 for known noise, and some more for noise from 63 free points
    assert there.attrs["chi2"] - fit.attrs["chi2"] == pytest.approx(4.1, abs=0.8)


def test_errors_to_both_sides_are_alike_where_the_model_is_straight(plain: xr.Dataset) -> None:
    for name in ("A0", "phase_offset"):
        one = plain.sel(parameter=name)
        for side in ("error_low", "error_high"):
            assert float(one[side]) == pytest.approx(float(one["error"]), rel=0.03, abs=0.0), name
        assert float(one["interval_high"] - one["interval_low"]) == pytest.approx(
            3.92 * float(one["error"]), rel=0.05, abs=0.0
        )


def test_correlated_noise_widens_the_errors_to_both_sides(plain: xr.Dataset) -> None:
    data = fc.data_of("stiff").assign_attrs(neighbor_correlation=0.5)
    wide = df.fit(fc.case_of("stiff"), data, free=[E, H, ETA], search=False)
    for name in ("zc_offset", "phase_offset"):  # the others are varied by their logarithms
        ratio = float((wide["error_low"] / plain["error_low"]).sel(parameter=name))
        assert ratio == pytest.approx(np.sqrt(3.0), rel=1e-6), name


def test_no_curve_beside_the_best_loses_a_branch_at_an_edge_of_the_map() -> None:
    case, data = fc.case_of("stiff"), measured(fc.data_of("stiff"), checked_reading("measured", 2, None, None, ""))
    unknowns = make_unknowns(case, 1, [E, H, ETA], NUISANCE, {}, {}, {"zc_offset": 0.35e-9, "phase_offset": 1.2})
    best = start_vector(unknowns)
    places = best + 0.7 * np.array(ERRORS) * np.random.default_rng(5).standard_normal((150, len(best)))
    lost = [int(told.lost.sum()) for told in CurveModel(case, unknowns, data).predict_many(places)]
    assert max(lost) < 3  # one or two lie behind the fold; a branch cut at an edge loses a dozen


def test_intervals_hold_their_share_of_truths_where_few_points_show_the_noise() -> None:
    draw, count, trials = np.random.default_rng(1), 11, 6000
    wider = replace(measured(fc.data_of("liquid"), PointSelection()), noise_points=count).widening
    height = np.arange(float(count))
    noise = np.array([stretch(height, draw.normal(size=count)).noise for _ in range(trials)])
    away = np.abs(draw.normal(size=trials)) / noise
    for level, share, plain in ((wider[0], 0.683, 0.65), (1.96 * wider[1], 0.95, 0.91)):
        error = np.sqrt(share * (1.0 - share) / trials)
        assert (away < level).mean() == pytest.approx(share, abs=3.0 * error + 0.005)  # t is an approximation
        assert (away < level / (wider[0] if share < 0.9 else wider[1])).mean() < plain + 0.015 < share


def test_few_points_of_noise_widen_intervals_and_no_error() -> None:
    case, data = fc.case_of("liquid"), fc.data_of("liquid")
    known = df.fit(case, data, free=[E], search=False)
    few = df.fit(case, data.assign_attrs(noise_points=11), free=[E], search=False, profile=[E])
    given = {"amplitude": fc.SIGMA["liquid"][0], "phase": fc.SIGMA["liquid"][1]}
    told = df.fit(case, data.assign_attrs(noise_points=11), free=[E], search=False, errors=given)
    assert np.array_equal(few["error"], known["error"]) and np.array_equal(told["error_low"], known["error_low"])
    one, most = 1.0779474, 1.2101414  # quantiles of t with 6.9 degrees of freedom over normal ones
    for name in (E, "zc_offset", "A0"):
        wide, usual, same = (fit.sel(parameter=name) for fit in (few, known, told))
        assert float(wide["error_low"] / usual["error_low"]) == pytest.approx(one, rel=0.01)
        span = float(usual["interval_high"] - usual["interval_low"])
        assert float(wide["interval_high"] - wide["interval_low"]) / span == pytest.approx(most, rel=0.01)
        assert float(same["interval_high"] - same["interval_low"]) == span
    assert few.attrs["interval_rises"] == pytest.approx([one**2, 3.84 * most**2], rel=1e-6)


def test_noise_that_is_set_in_the_calibration_is_known() -> None:
    data = fc.data_of("liquid").drop_vars("branch").assign_coords(direction=("point", ["approach"] * 91))
    data = data.assign_attrs(phase_convention="lag")
    assert df.calibrate(data, fc.case_of("liquid")).attrs["noise_points"] > 9
    given = {"amplitude": fc.SIGMA["liquid"][0], "phase": fc.SIGMA["liquid"][1]}
    assert "noise_points" not in df.calibrate(data, fc.case_of("liquid"), errors=given).attrs


def test_a_profile_counts_the_correlation_of_the_noise() -> None:
    case, data = fc.case_of("liquid"), fc.data_of("liquid").assign_attrs(neighbor_correlation=0.5)
    usual, there = (df.fit(case, data, free=[E], search=False, profile=names) for names in ([], [E]))
    assert usual.attrs["inflation"] == pytest.approx(3.0)
    for name in ("error_low", "error_high", "interval_low", "interval_high"):
        one, other = (float(fit[name].sel(parameter=E)) for fit in (usual, there))
        assert one == pytest.approx(other, rel=0.01), name


def test_an_end_is_not_where_a_first_search_was_stuck(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a fold the first search, from far off, ended at a root of 2.8 in place of 1.1: the interval ended just before."""
    goal, steep, runs = 1.96, 15.0, []

    def beside(objective: SimpleNamespace, stuck: float) -> Minimum:
        runs.append(objective.start[0])
        root = 2.8 if len(runs) == 1 else steep * objective.start[0]
        return Minimum(objective.start, root**2, SimpleNamespace(lost=np.zeros(1, bool)))

    monkeypatch.setattr(profile, "_beside", beside)
    monkeypatch.setattr(profile, "Objective", lambda model, start, *_: SimpleNamespace(start=start))
    monkeypatch.setattr(profile, "limits", lambda unknowns: (np.full(1, -9.0), np.full(1, 9.0)))
    best = Minimum(np.zeros(1), 0.0)
    way = profile.Way(0, np.ones(1), [], 0.07, goal)
    end = profile.end_of(SimpleNamespace(unknowns=[]), best, way, 0.0, profile.ProfilePoint([], []), print)
    assert end.reach(goal) == pytest.approx(goal / steep, rel=1e-6)
