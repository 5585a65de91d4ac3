"""The first sentence on a fit: a model that does not describe the data never gives an answer that looks right."""

from __future__ import annotations

from importlib.resources import files

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from fitted_curves import ETA, E, H

import dforce as df
from dforce.findings.fits import judged
from dforce.inverse.fitting.independence import independence, lasting
from dforce.inverse.fitting.unknowns import make_unknowns
from dforce.validity import advice_in

FILES = files("dforce.library") / "measured"


@pytest.fixture(scope="module")
def shifted() -> xr.Dataset:
    """A fit of a wrong viscosity, 2 Pa s instead of 5: the modulus makes up for it, and chi2 alone hardly shows it."""
    case = df.load_case(str(FILES / "liquid.toml"))
    data = df.calibrate(df.read_measured(str(FILES / "liquid.csv"), phase_convention="lag"), case)
    return df.fit(case, data, free=[E], search=False, start={E: 48e6})


def test_systematic_residuals_show_a_wrong_model_where_the_noise_is_hardly_known(shifted: xr.Dataset) -> None:
    one = shifted.sel(parameter=E)
    white = float(one["error"]) / np.sqrt(shifted.attrs["inflation"])  # the error if residuals were independent
    away = abs(float(one["value"]) - fc.TRUTH["liquid"][0])
    assert away > 5.0 * white and away < 2.0 * float(one["error"])
    assert [piece.name for piece in advice_in(shifted)] == ["reduced_chi2"]
    first = "The model does not describe the data"
    assert df.answer(shifted).startswith(first) and df.fit_report(shifted).startswith(first)
    assert df.summary(shifted)[0].text.startswith(first)


def test_a_model_far_from_the_data_gives_no_answer_and_no_errors() -> None:
    data = fc.data_of("liquid")
    stretched = data.assign(height=3.0 * data["height"])
    fit = df.fit(fc.case_of("liquid"), stretched, free=[E], search=False)
    assert fit.attrs["chi2"] > 10.0 * fit.attrs["degrees_of_freedom"]
    assert np.isnan(fit["error"]).all() and np.isnan(fit["interval_low"]).all()
    for text in (df.answer(fit), df.fit_report(fit), df.chi2_in_words(fit).replace("χ² is far too large", "No answer")):
        assert text.startswith("No answer"), text
    assert "±" not in df.answer(fit) and "error unknown" in df.answer(fit) and "+-" not in df.fit_report(fit)
    many = df.fit_many(fc.case_of("liquid"), {"good": data, "bad": stretched}, free=[E], search=False)
    table = df.fit_report(many)
    assert "bad: No answer" in table and "good: " not in table
    assert [line.count("no answer") for line in table.splitlines() if line.startswith(("good", "bad"))][:2] == [0, 4]


def test_a_fit_whose_model_has_no_such_curve_keeps_the_curve_near_the_sample_and_gives_no_answer() -> None:
    data = fc.data_of("liquid")
    sticks = fc.case_of("liquid", viscous=False).replace(H, 1e-19)  # the tip stays on the sample at all heights
    fit = df.fit(sticks, data, free=[E], search=False)
    assert abs(float(fit["value"].sel(parameter="zc_offset"))) < 1e-6  # it ran off over 2 mm
    report = df.fit_report(fit)
    assert report.startswith("No answer") and "The other values and errors are valid" not in report


def test_a_wrong_sensitivity_is_named_and_its_given_error_covers_its_effect() -> None:
    data, case = fc.data_of("liquid"), fc.case_of("liquid")
    wrong = data.assign(amplitude=1.05 * data["amplitude"])
    fit = df.fit(
        case.replace("drive.A0", "8.4 nm"), wrong, free=[E], search=False, given={"amplitude_scale": (1.0, 0.05)}
    )
    one = fit.sel(parameter=E)
    away, error, passed = float(one["value"]) - fc.TRUTH["liquid"][0], float(one["error"]), float(one["error_given"])
    assert judged(fit.attrs["chi2"], fit.attrs["degrees_of_freedom"]).word == "as expected"
    assert away > 5.0 * error and away == pytest.approx(passed, abs=3.0 * error)  # 5 % is one standard deviation of it
    assert "a wrong sensitivity and wrong heights scale the forces, and chi2 may hide it" in df.fit_report(fit)


def test_a_table_of_fits_names_parameters_that_are_not_constrained() -> None:
    fit = df.fit(fc.case_of("air"), fc.data_of("air"), free=[E, H], search=False)
    assert "not constrained by these data" in df.answer(fit)
    many = df.fit_many(fc.case_of("air"), {"one": fc.data_of("air")}, free=[E, H], search=False)
    assert "not constrained by these data" in df.fit_report(many) and "none" not in df.fit_report(many)


def test_neighbors_may_be_as_alike_as_in_the_free_part() -> None:
    draw = np.random.default_rng(3)
    found = {}
    for r in (0.0, 0.6):
        few = []
        for _ in range(200):
            noise = draw.normal(size=120)
            for i in range(1, 120):
                noise[i] = r * noise[i - 1] + np.sqrt(1.0 - r * r) * noise[i]
            few.append(_alike(noise, r) < 0.05)
        found[r] = np.mean(few)
    assert found[0.0] < 0.09 and found[0.6] < 0.09, found  # 0.05 expected, with an error of 0.015
    assert _alike(noise, 0.0) < 1e-3  # taken for white


def _alike(noise: np.ndarray, r: float) -> float:
    half = noise.reshape(2, -1)
    count = half.shape[1]
    made = xr.Dataset(
        {
            name: (("point", "tone"), one[:, None])
            for name, one in zip(("amplitude_residual", "phase_residual"), half, strict=True)
        }
        | {
            "used": ("point", np.ones(count, bool)),
            "lost": ("point", np.zeros(count, bool)),
            "height": ("point", np.arange(float(count))),
        },
        {"branch": ("point", np.ones(count))},
        {"neighbor_correlation": r},
    )
    return independence(made)


def test_a_weak_correlation_that_is_long_is_no_noise() -> None:
    """A viscosity that a model lacks leaves such residuals: weaker than the noise, alike over tenths of the curve."""
    draw = np.random.default_rng(4)
    slow = 0.35 * np.sin(np.linspace(0.0, 4.0 * np.pi, 300))
    found = [_alike(draw.normal(size=600) + np.tile(slow, 2), 0.0) for _ in range(20)]
    assert np.mean(np.array(found) < 1e-3) > 0.8
    white = [_alike(draw.normal(size=600), 0.0) for _ in range(200)]
    assert np.mean(np.array(white) < 0.05) < 0.09  # 0.05 expected, with an error of 0.015


def test_correlated_residuals_raise_the_covariance_by_the_length_of_their_correlation_and_white_ones_do_not() -> None:
    draw = np.random.default_rng(8)
    white = [lasting([draw.normal(size=(90, 2)), draw.normal(size=(60, 2))]) for _ in range(400)]
    assert np.mean(np.array(white) > 1.0) < 0.045  # 0.023 expected, with an error of 0.0075
    assert np.mean(np.sqrt(white)) < 1.02
    r, noise = 0.6, draw.normal(size=(60_000, 2))
    for i in range(1, len(noise)):
        noise[i] = r * noise[i - 1] + np.sqrt(1.0 - r**2) * noise[i]
    assert lasting([noise]) == pytest.approx((1.0 + r) / (1.0 - r), rel=0.1)


def test_errors_of_a_fit_under_slow_drift_are_as_large_as_its_values_scatter() -> None:
    case, zc = fc.case_of("air"), np.linspace(12e-9, 2e-9, 101)
    curve, sigma = df.approach(case, zc=zc), fc.SIGMA["air"]
    pulls, wider = [], []
    for seed in range(12):
        noise = _one_over_f(np.random.default_rng(seed), len(zc)) * np.array(sigma)[:, None]
        amplitude, phase = (curve[name].values[:, 0] for name in ("amplitude", "phase"))
        data = fc.dataset(zc, amplitude + noise[0], phase + noise[1], np.ones(len(zc)), sigma)
        one = df.fit(case, data, free=[H], search=False)
        wider.append(one.attrs["inflation"])
        away = (one["value"] - xr.where(one["parameter"] == H, fc.TRUTH["air"][1], 0.0)) / one["error"]
        pulls.append(away.sel(parameter=[H, "zc_offset"]).values)
    assert np.median(wider) > 2.0
    assert np.median(np.abs(pulls)) < 1.0  # 0.67 of normal deviations


def _one_over_f(draw: np.random.Generator, count: int) -> np.ndarray:
    """Return noise of two channels, each the sum of a white and a 1/f part of equal power."""
    frequency = np.arange(1, count // 2 + 1)
    slow = np.zeros((2, count // 2 + 1), complex)
    slow[:, 1:] = (draw.normal(size=(2, count // 2)) + 1j * draw.normal(size=(2, count // 2))) / np.sqrt(frequency)
    pink = np.fft.irfft(slow, count)
    return 0.8 * (pink / pink.std(axis=1, keepdims=True) + draw.normal(size=(2, count)))


def test_the_worst_of_chi2_and_the_residuals_is_the_judgment() -> None:
    assert judged(100.0, 100.0, independence=1e-4).word == "deceptive"
    assert judged(150.0, 100.0, independence=1e-4).word == "too large"
    assert judged(1001.0, 100.0, 10.0).word == "far too large"


def test_the_range_of_an_unknown_is_one_that_the_case_takes() -> None:
    """A fit that ends at a bound is a result, not an error after minutes."""
    case = fc.case_of("liquid")
    for one in make_unknowns(case, 1, [E, H, ETA], ["A0"], {}, {}, {}):
        for edge in (one.low, one.high):
            if np.isfinite(edge) and edge > 0.0:
                value = one.value(one.varied(edge))
                assert one.low <= value <= one.high
                case.replace(one.path, value)
        if np.isfinite(one.high):
            with pytest.raises(df.ParameterError, match="is above"):
                case.replace(one.path, 1.01 * one.high)
    assert case.quantity(H).bounds() == (0.0, 1e-15)


def test_a_point_far_off_a_fit_is_named_where_its_neighbors_are_not() -> None:
    data = fc.data_of("liquid")
    data["phase"][40] += 8.0 * fc.SIGMA["liquid"][1]
    fit = df.fit(fc.case_of("liquid"), data, free=[E, H, ETA], search=False)
    told = next(piece.text for piece in advice_in(fit) if piece.name == "outliers")
    assert f"points at heights {1e9 * float(data['height'][40]):.5g} nm." in told
