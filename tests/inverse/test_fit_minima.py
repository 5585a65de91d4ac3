"""Fits of few points with much noise: several minima, folds just behind the last points, and what the result says of them."""

import functools
import sys
from collections.abc import Callable
from pathlib import Path

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from fitted_curves import ETA

import dforce as df
from dforce.inverse.fitting.folds import fold_beside, lowest
from dforce.inverse.fitting.minimize import Objective, jacobian
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.selection import PointSelection, measured
from dforce.inverse.fitting.unknowns import make_unknowns, start_vector
from dforce.validity import advice_in

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from fit_kinds import FREE, E, H, Set, stiff_sets

NUISANCE = ("zc_offset", "A0", "phase_offset")


@pytest.fixture(scope="module")
def sets() -> dict[int, Set]:
    made = stiff_sets()
    return {number: made(number) for number in (7, 13)}


@pytest.fixture(scope="module")
def fits(sets: dict[int, Set]) -> Callable[[int], xr.Dataset]:
    """Give a function that fits a set, once."""
    return functools.cache(lambda number: df.fit(sets[number].start, sets[number].data, free=FREE))


def model_of(made: Set) -> tuple[CurveModel, np.ndarray]:
    """Return the model of a set, and what is varied at the truth."""
    unknowns = make_unknowns(made.start, 1, FREE, NUISANCE, {}, {}, {})
    return CurveModel(made.start, unknowns, measured(made.data, PointSelection())), np.array(
        [one.varied(made.truth[one.name]) for one in unknowns]
    )


def within(fit: xr.Dataset, name: str, truth: float) -> bool:
    one = fit.sel(parameter=name)
    return float(one["interval_low"]) < truth < float(one["interval_high"])


def test_a_fit_loses_no_measured_point_and_its_interval_holds_the_modulus(
    sets: dict[int, Set], fits: Callable[[int], xr.Dataset]
) -> None:
    fit = fits(13)
    assert fit.attrs["lost_points"] == 0 and fit.attrs["points"] == 75
    assert within(fit, E, sets[13].truth[E])


def test_steps_along_a_fold_go_on_where_plain_steps_lose_a_point(sets: dict[int, Set]) -> None:
    model, truth = model_of(sets[13])
    plain = Objective(model, truth).minimize()
    found = lowest(Objective(model, truth))
    assert plain.lost > 0 and found.lost == 0
    assert found.chi2 < plain.chi2
    fold = fold_beside(model, jacobian(model, found.varied, found.prediction))
    assert fold is not None and fold.root < 0.1


@pytest.mark.long
def test_minima_that_are_not_excluded_lie_within_the_intervals_and_are_named(fits: Callable[[int], xr.Dataset]) -> None:
    fit = fits(7)
    kept = ~fit["minimum_excluded"].values
    assert kept.sum() >= 2 and kept[0]
    assert (fit["minimum_chi2"].values[kept] < fit.attrs["chi2"] + 3.85).all()
    values = fit["minimum_value"].sel(parameter=E).values[kept]
    one = fit.sel(parameter=E)
    assert abs(values[1] - values[0]) > 0.5 * float(one["error"])
    assert ((float(one["interval_low"]) < values) & (values < float(one["interval_high"]))).all()
    told = next(piece for piece in advice_in(fit) if piece.name == "second_minimum")
    assert f"chi2 {fit['minimum_chi2'].values[1]:.1f} at {E} = {values[1] / 1e9:.3g} GPa" in told.text
    assert "The data do not distinguish them" in told.text
    report = df.fit_report(fit)
    assert "minima not excluded by the data" in report and "interval of 95 %" in report


def test_a_fit_says_for_which_lever_and_radius_its_values_hold(fits: Callable[[int], xr.Dataset]) -> None:
    fit = fits(13)
    assert fit.attrs["holds_for"] == "cantilever.k = 2.7 N/m, cantilever.Q = 180, tip.radius = 8 nm"
    assert "parameters, for cantilever.k = 2.7 N/m, cantilever.Q = 180, tip.radius = 8 nm" in df.fit_report(fit)


# the covariance knows one slope for both sides: how much wider the upper one is than by it, and than the lower one
@pytest.mark.parametrize(
    ("number", "wider", "higher"), [(13, 2.5, 3.0), pytest.param(7, 3.0, 5.0, marks=pytest.mark.long)]
)
def test_the_interval_of_the_hamaker_constant_follows_chi2_where_the_fold_bends_it(
    number: int, wider: float, higher: float, sets: dict[int, Set], fits: Callable[[int], xr.Dataset]
) -> None:
    one = fits(number).sel(parameter=H)
    low, high = float(one["value"] - one["interval_low"]), float(one["interval_high"] - one["value"])
    assert within(fits(number), H, sets[number].truth[H])
    assert high > wider * 1.96 * float(one["error"]) and high > higher * low


def soft(seed: int) -> tuple[df.Case, xr.Dataset]:
    """Return a soft sample in a liquid, and a noisy curve with indentations of nanometers."""
    case, zc, draw = fc.case_of("liquid"), np.linspace(10e-9, 2e-9, 90), np.random.default_rng(seed)
    curve, (noise, turn) = df.approach(case, zc=zc), fc.SIGMA["liquid"]
    amplitude, phase = (curve[name].values[:, 0] for name in ("amplitude", "phase"))
    data = {"amplitude": amplitude + noise * draw.normal(size=90), "phase": phase + turn * draw.normal(size=90)}
    data = {name: ("point", values) for name, values in {"height": zc, **data}.items()}
    return case, xr.Dataset(data, attrs={"amplitude_error": noise, "phase_error": turn})


def test_a_fit_to_a_soft_sample_that_starts_at_its_values_stays_there() -> None:
    """Its least amplitudes are nanometers above the distances: the guess for stiff samples led to E = 92 Pa."""
    case, data = soft(1)
    fit = df.fit(case, data, free=[E, H, ETA], search=False, nuisance=["zc_offset"])
    assert fit.attrs["chi2"] < 1.1 * fit.attrs["degrees_of_freedom"]
    truth = np.array([*fc.TRUTH["liquid"][:3], 0.0])
    assert (np.abs(fit["value"].values - truth) < 2.0 * fit["error"].values).all()


def test_parameters_that_a_false_minimum_did_not_see_are_fitted_at_the_lower_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    case, data = soft(2)
    settings = {"free": [E, H, ETA], "nuisance": ["zc_offset"]}
    wanted = df.fit(case, data, **settings)

    def faint(model: CurveModel, *_: object) -> list[object]:
        objective = Objective(
            model, start_vector(model.unknowns) - [0.0, 20.0, 20.0, 0.0]
        )  # logarithms of H and viscosity
        objective.residuals(objective.start)
        return [objective.best]

    monkeypatch.setattr("dforce.inverse.fitting.run.refined", faint)
    found = df.fit(case, data, search=False, **settings)
    assert found["seen"].all()
    assert found.attrs["chi2"] == pytest.approx(wanted.attrs["chi2"], abs=0.01)  # 0.45 above, with both at their start
