"""A fit as a result: it is written, read and repeated, told, drawn, compared, stopped, and made of many curves."""

import math
from pathlib import Path

import fitted_curves as fc
import matplotlib
import numpy as np
import pytest
import xarray as xr
from fitted_curves import ETA, E, H

import dforce as df
from dforce.findings.fits import judged
from dforce.inverse.fitting.minimize import Objective
from dforce.inverse.fitting.selection import checked_reading, measured
from dforce.inverse.values import value_and_error
from dforce.validity import advice_in

FILES = Path(df.__file__).parent / "library" / "measured"


@pytest.fixture(scope="module")
def air() -> xr.Dataset:
    return df.fit(fc.case_of("air"), fc.data_of("air"), free=[H], profile=[H], search=False)


def test_a_fit_is_read_back_as_it_was_written_and_repeats_itself(air: xr.Dataset, tmp_path: Path) -> None:
    path = df.write(air, tmp_path / "fit.nc")
    back = df.read(path)
    xr.testing.assert_identical(back["value"], air["value"])
    again = df.fit_again(back)
    for name in ("value", "error", "correlation", "amplitude_residual", "profile_chi2"):
        np.testing.assert_array_equal(again[name].values, air[name].values, err_msg=name)
    assert again.attrs["chi2"] == air.attrs["chi2"]


def test_a_fit_says_where_its_searches_began_and_which_minima_they_met(air: xr.Dataset) -> None:
    np.testing.assert_array_equal(air["minimum_value"].isel(minimum=0), air["value"])
    assert air["search_value"].sel(parameter=H).values.tolist() == pytest.approx([2e-20], rel=1e-9)  # of the case


def test_a_fit_is_no_measured_curve(air: xr.Dataset, tmp_path: Path) -> None:
    path = df.write(air, tmp_path / "fit.nc")
    with pytest.raises(df.ResultError, match="is a fit, not a measured curve; dforce fit repeats it"):
        df.read_measured(path)
    for call in (lambda: df.fit(fc.case_of("air"), air, free=[H]), lambda: df.reconstruct(air)):
        with pytest.raises(df.ParameterError, match="a fit; pass its measured curve"):
            call()


@pytest.mark.long
def test_a_fit_done_again_gives_the_same_advice() -> None:
    # noise found in few points is as uncertain the second time: no advice on a chi2 that it explains
    case = fc.case_of("stiff")
    data = df.calibrate(df.read_measured(FILES / "stiff.csv", phase_convention="lag"), case)
    first = df.fit(case, data, free=[E, H, ETA], search=False)
    assert [piece.name for piece in advice_in(df.fit_again(first))] == [piece.name for piece in advice_in(first)]


def test_the_case_of_a_fit_is_the_best_one_and_runs(air: xr.Dataset, tmp_path: Path) -> None:
    case = df.load_case(df.write(air, tmp_path / "fit.nc"))
    assert case.forces[0].hamaker == float(air["value"].sel(parameter=H))
    assert float(air["value"].sel(parameter="A0")) == case.drive.A0
    curve = df.run(case)
    model = air["amplitude_fit"].values[:, 0]
    # between 201 points of the curve, by a straight line
    zc, amplitude = curve["zc"].values[::-1], curve["amplitude"].sel(direction="approach").values[::-1, 0]
    assert np.interp(air["zc"].values, zc, amplitude) == pytest.approx(model, abs=2e-12)


def test_a_profile_agrees_with_the_covariance_where_the_problem_is_nearly_linear(air: xr.Dataset) -> None:
    one = air.sel(parameter=H)
    assert float(one["error_low"]) == pytest.approx(float(one["error"]), rel=0.1)
    low, high = float(one["interval_low"]), float(one["interval_high"])
    assert high - low == pytest.approx(2.0 * 1.96 * float(one["error"]), rel=0.05)
    assert low < float(one["value"]) < high


def test_residuals_are_those_of_noise(air: xr.Dataset) -> None:
    chi2 = float((air["amplitude_residual"] ** 2 + air["phase_residual"] ** 2).sum())
    assert chi2 == pytest.approx(air.attrs["chi2"], rel=1e-9)
    assert air.attrs["independence"] > 0.01
    assert air.attrs["aic"] == pytest.approx(air.attrs["chi2"] + 2 * air.sizes["parameter"])
    assert air.attrs["degrees_of_freedom"] == 2 * 101 - 4


def test_a_report_tells_values_errors_and_correlations(air: xr.Dataset) -> None:
    text = df.fit_report(air)
    for words in (H, "19.96", "+- 0.72 zJ (3.6 %)", "chi2", "198.76", "AIC, BIC", f"zc_offset, {H}: +0.905"):
        assert words in text, words


def test_what_is_doubted_about_the_curve_is_advice_on_the_fit() -> None:
    data = fc.data_of("air").assign_attrs(history=["read: text", "doubt: the free amplitude is half of the case's"])
    fit = df.fit(fc.case_of("air"), data, free=[H], search=False)
    assert [piece.name for piece in advice_in(fit)] == ["doubted_data"]
    assert "advice: doubts about the measured curve: the free amplitude is half of the case's." in df.fit_report(fit)


def test_a_report_says_what_widened_the_errors_and_that_the_fit_was_stopped() -> None:
    made = fc.result()
    assert "noise: neighbors" not in df.fit_report(made) and "stopped" not in df.fit_report(made)
    text = df.fit_report(made.assign_attrs(inflation=4.0, interrupted=1))
    assert "neighbors are correlated, so all errors are 2.00 times as large" in text
    assert "The fit was stopped" in text


def test_pictures_of_a_fit_show_data_model_residuals_and_profiles(air: xr.Dataset, tmp_path: Path) -> None:
    with matplotlib.rc_context({"backend": "agg"}):
        axes = df.plot.fit(air, df.plot.Sheet())
        assert len(axes) == 4
        assert df.plot.save(axes, tmp_path / "fit.png").stat().st_size > 10_000
        assert len(df.plot.fit_errors(air, df.plot.Sheet())) == 2
        assert len(df.plot.overview(air, df.plot.Sheet())) == 4
    with pytest.raises(df.ParameterError, match="not a fit"):
        df.plot.fit(xr.Dataset())


def test_many_fits_start_alike_and_a_bad_curve_does_not_stop_them() -> None:
    data = fc.data_of("air")
    curves = {"first": data, "bad": data.isel(point=slice(0, 5)), "none": "nowhere.csv", "second": data}
    many = df.fit_many(fc.case_of("air"), curves, free=[H], search=False)
    assert many["curve"].values.tolist() == list(curves)
    assert "at least 8" in str(many["message"].sel(curve="bad").values)
    assert "there is no file" in str(many["message"].sel(curve="none").values)
    # what was fitted before does not count
    np.testing.assert_array_equal(many["value"].sel(curve="first"), many["value"].sel(curve="second"))
    assert np.isnan(many["value"].sel(curve="bad")).all()
    assert "with advice" not in df.fit_report(many)
    advised = df.fit_report(many.assign(advised=("curve", [False, False, False, True])))
    assert advised.splitlines()[-1] == "with advice; fit this curve alone to read it: second"
    below = [line for line in df.fit_report(many).splitlines() if line.startswith("not fitted: ")]
    assert [line.split(": ")[1] for line in below] == ["bad", "none"] and "there is no file" in below[1]
    assert max(len(line) for line in df.fit_report(many).splitlines() if line not in below) <= 100


def test_all_curves_of_a_map_are_fitted_with_their_places(tmp_path: Path) -> None:
    rows = [line.split(",") for line in (FILES / "air.csv").read_text().splitlines() if not line.startswith("#")]
    lines = ["height_nm,amplitude_nm,phase_deg,x_um,y_um"]
    for x in range(3):
        lines += [
            ",".join([row[0], "nan" if (x, i) == (1, 5) else row[1], row[2], str(x), "7"]) for i, row in enumerate(rows)
        ]
    (tmp_path / "map.csv").write_text("\n".join([*lines, ""]))
    case = fc.case_of("air").replace(data={"phase_convention": "lag"})
    many = df.fit_many(case, {"map": tmp_path / "map.csv"}, free=[H], search=False)
    assert many["curve"].values.tolist() == ["map, curve 1", "map, curve 2", "map, curve 3"]
    assert [bool(text) for text in many["message"].values] == [False, True, False]
    np.testing.assert_allclose(many["x"], [0.0, np.nan, 2e-6])
    chosen = case.replace(data={"phase_convention": "lag", "read": {"curve": 3}})
    assert df.fit_many(chosen, {"map": tmp_path / "map.csv"}, free=[H], search=False)["curve"].values.tolist() == [
        "map"
    ]


def test_ctrl_c_keeps_the_best_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, calls = Objective.residuals, 0
    met: list[float] = []

    def stopped(self: Objective, free: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        if calls == 4:
            raise KeyboardInterrupt
        found = plain(self, free)
        met.append(self.best.chi2)
        return found

    monkeypatch.setattr(Objective, "residuals", stopped)
    case = fc.case_of("air").replace("forces.dmt.hamaker", "3e-20 J")
    fit = df.fit(case, fc.data_of("air"), free=[H], search=False)
    first = (3e-20, 60_000.0)  # where it starts chi2 is far larger
    assert fit.attrs["interrupted"] == 1
    assert np.isfinite(fit["value"]).all()
    # on the way there is no minimum, and so no error and no judgment of the model
    assert np.isnan(fit["error"]).all() and not advice_in(fit)
    assert "The fit was stopped" in df.fit_report(fit) and "nan" not in df.fit_report(fit)
    assert fit.attrs["chi2"] == pytest.approx(min(met[:3])) and min(met[:3]) < met[0] < first[1]
    assert float(fit["value"].sel(parameter=H)) != first[0]
    # of many curves those are kept that were done
    calls = 0

    def later(self: Objective, free: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        if calls == most:
            raise KeyboardInterrupt
        return plain(self, free)

    most = 10_000
    monkeypatch.setattr(Objective, "residuals", later)
    df.fit_many(case, {"first": fc.data_of("air")}, free=[H], search=False)
    most, calls = calls + 3, 0
    many = df.fit_many(case, {"first": fc.data_of("air"), "second": fc.data_of("air")}, free=[H], search=False)
    assert many["curve"].values.tolist() == ["first"]
    assert many.attrs["interrupted"] == 1
    most, calls = 4, 0
    with pytest.raises(KeyboardInterrupt):
        df.fit_many(case, {"first": fc.data_of("air")}, free=[H], search=False)


def test_an_error_that_nobody_expected_stops_no_other_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, failed = Objective.residuals, []

    def failing(self: Objective, free: np.ndarray) -> np.ndarray:
        if not failed:
            failed.append(free)
            raise np.linalg.LinAlgError("SVD did not converge")
        return plain(self, free)

    monkeypatch.setattr(Objective, "residuals", failing)
    curves = {"bad": fc.data_of("air"), "good": fc.data_of("air")}
    many = df.fit_many(fc.case_of("air"), curves, free=[H], search=False)
    assert many["message"].values.tolist() == ["LinAlgError: SVD did not converge", ""]
    assert "interrupted" not in many.attrs


def test_stretches_are_cut_out_by_ranges_of_heights() -> None:
    data, kept = fc.data_of("air"), {"height": [["12.3 nm", "10.05 nm"], ["2.05 nm", "9.05 nm"]]}
    case = fc.case_of("air").replace(data={"use": kept})
    fit = df.fit(df.Case.from_toml(case.to_toml()), data, free=[H], search=False)
    height = data["height"].values
    np.testing.assert_array_equal(fit["used"], (height > 10.05e-9) | ((height > 2.05e-9) & (height < 9.05e-9)))
    for wrong in ("5 nm", 5e-9, ["5 nm"], [["1 nm", "5 nm"], "7 nm"], []):
        with pytest.raises(df.ParameterError, match="is neither a range, such as"):
            df.fit(case.replace(data={"use": {"height": wrong}}), data, free=[H])


@pytest.mark.long
def test_the_noise_of_heights_counts_where_the_curve_is_steep() -> None:
    data, error = fc.data_of("stiff"), 0.1e-9
    flat = measured(data, checked_reading("measured", 2, {"height": 0.0}, None, ""))
    steep = measured(data, checked_reading("measured", 2, {"height": "0.1 nm"}, None, ""))
    behind, free = data["height"].values < 20e-9, data["height"].values > 33e-9
    np.testing.assert_array_equal(flat.spread, np.broadcast_to(flat.sigma, (126, 2)))
    # behind the jump the amplitude of a stiff sample falls as the height
    np.testing.assert_allclose(steep.spread[behind, 0], np.hypot(0.06e-9, error), rtol=0.1)
    np.testing.assert_allclose(steep.spread[free, 0], 0.06e-9, rtol=0.05)
    noisy = data.assign(height=data["height"] + error * np.random.default_rng(2).normal(size=126))
    fits = [
        df.fit(fc.case_of("stiff"), noisy.assign_attrs(height_error=unsure), free=[E, H, ETA], search=False)
        for unsure in (0.0, error)
    ]
    assert fits[0].attrs["chi2"] > 1.8 * fits[0].attrs["degrees_of_freedom"]
    assert not {"reduced_chi2"} & {piece.name for piece in advice_in(fits[1])}
    assert "noise: heights have an error of 0.1 nm" in df.fit_report(fits[1])
    with pytest.raises(df.ParameterError, match="error of 'height' is -1 m"):
        df.fit(fc.case_of("stiff"), data, free=[E], errors={"height": -1.0})


def test_a_phase_without_a_unit_is_in_degrees_as_a_number_or_as_text() -> None:
    for given in (0.3, "0.3", "0.3 deg", "0.3°"):
        found = measured(fc.data_of("stiff"), checked_reading("measured", None, {"phase": given}, None, ""))
        assert found.phase_error[0] == pytest.approx(0.3, rel=1e-12), given
    assert value_and_error("priors.phase_offset", "1.20(15)", "degree") == pytest.approx((1.2, 0.15), rel=1e-12)
    assert value_and_error("priors.cantilever.k", "2.7(2) N/m", "N/m") == pytest.approx((2.7, 0.2), rel=1e-12)


def test_chi2_is_as_expected_or_too_small_in_words(air: xr.Dataset) -> None:
    assert df.chi2_in_words(air).startswith("χ² is as expected, ") and "as expected" in df.fit_report(air)
    doubled = {"amplitude": 0.04e-9, "phase": 0.6}
    fit = df.fit(fc.case_of("air"), fc.data_of("air"), free=[H], search=False, errors=doubled)
    assert df.chi2_in_words(fit).startswith("χ² is too small, ")
    [said] = [piece.text for piece in advice_in(fit) if piece.name == "reduced_chi2"]
    assert said.partition(": ")[2] == df.chi2_in_words(fit).partition(": ")[2]
    # 1.5 is 3.5 of its standard deviations, unless the noise itself is known from 10 points alone
    assert [judged(150.0, 100.0, points).word for points in (math.inf, 10.0)] == ["too large", "as expected"]


def test_a_comparison_needs_the_same_data(air: xr.Dataset, tmp_path: Path) -> None:
    back = df.read(df.write(air, tmp_path / "fit.nc"))
    assert df.compare_fits({"a": air, "b": back})["delta_aic"].values.tolist() == [0.0, 0.0]
    other = df.fit(fc.case_of("air"), fc.data_of("air").isel(point=slice(0, 90)), free=[H], search=False)
    with pytest.raises(df.ParameterError, match="different points"):
        df.compare_fits({"a": air, "b": other})
    for noise in ({"phase_error": [0.6]}, {"height_error": 1e-10}):
        with pytest.raises(df.ParameterError, match="different points or errors"):
            df.compare_fits({"a": air, "b": air.assign_attrs(noise)})
    with pytest.raises(df.ParameterError, match="at least two"):
        df.compare_fits({"a": air})


def test_lost_points_are_no_success() -> None:
    case = fc.case_of("stiff")
    fit = df.fit(
        case, fc.data_of("stiff"), free=[ETA], nuisance=["phase_offset"], start={ETA: 20.0}, search=False, margin=0
    )  # the heights are off by 0.35 nm, so the branch ends too early
    assert fit.attrs["lost_points"] > 0 or fit.attrs["chi2"] > 1000.0
    assert {"lost_points", "reduced_chi2"} & {piece.name for piece in advice_in(fit)}


def test_a_curve_is_read_and_calibrated_as_the_case_says(tmp_path: Path) -> None:
    (tmp_path / "curve.csv").write_bytes((FILES / "air.csv").read_bytes())
    table = {"file": "curve.csv", "phase_convention": "lag"}
    text = fc.case_of("air").replace(data=table, fit={"free": [H], "search": False}).to_toml()
    (tmp_path / "case.toml").write_text(text)
    fit = df.fit(df.load_case(tmp_path / "case.toml"))
    assert float(fit["value"].sel(parameter=H)) == pytest.approx(1.996e-20, rel=0.02)
    assert fit.attrs["data_sha256"]
    with pytest.raises(df.ParameterError, match=r"no setting 'sensivity'.*sensitivity"):
        df.fit(fc.case_of("air").replace(data=table | {"read": {"sensivity": 1.0}}), tmp_path / "curve.csv", free=[H])
    with pytest.raises(df.ParameterError, match="the measured curve is missing"):
        df.fit(fc.case_of("air"), free=[H])


def test_a_side_on_which_chi2_does_not_rise_has_no_end_in_the_report() -> None:
    made = fc.result()
    made["error_high"][:] = [6e35, 1e-11]
    text = df.fit_report(made)
    assert "-0.090 GPa, no end above (10 %)" in text and "e+" not in text
    made["error_low"][:] = [np.inf, 1e-11]
    assert "+- 0.10 GPa (10 %)" in df.fit_report(made)
