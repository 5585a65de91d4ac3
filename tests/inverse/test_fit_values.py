"""Fits of the shipped curves reach the values, errors and sums of squares of an independent reference."""

import re

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from fitted_curves import ETA, E, H
from tiers import some_long

import dforce as df
from dforce.inverse.fitting.load import measured_curve
from dforce.inverse.fitting.minimize import EXACT, MOST, ROUGH, Minimum, Objective
from dforce.inverse.fitting.run import fitted as find
from dforce.inverse.fitting.run import settings_of
from dforce.validity import advice_in

# value, error of the reference, which integrates with other steps: its curve differs from dForce's by 1 % of the noise
STIFF = {
    E: (2.0416e9, 0.11e9), H: (5.925e-20, 2.6e-21), ETA: (14.92, 4.6), "zc_offset": (0.36304e-9, 0.016e-9),
    "A0": (29.9886e-9, 0.011e-9), "phase_offset": (1.2673, 0.059),
}  # fmt: skip
AIR = {
    H: (1.9964e-20, 7.2e-22), "zc_offset": (-0.20053e-9, 0.0051e-9), "A0": (9.99786e-9, 0.0041e-9),
    "phase_offset": (0.0113, 0.041),
}  # fmt: skip
LIQUID = {
    E: (50.28e6, 0.62e6), H: (9.92e-22, 1.7e-22), ETA: (6.13, 1.3), "zc_offset": (0.1132e-9, 0.035e-9),
    "A0": (7.99959e-9, 0.0026e-9), "phase_offset": (-0.854, 0.093),
}  # fmt: skip


def fitted(name: str, free: list[str], **settings: object) -> xr.Dataset:
    """Return a fit of a shipped curve with all its points."""
    return df.fit(fc.case_of(name, ETA in free or name != "liquid"), fc.data_of(name), free=free, margin=0, **settings)


def check(fit: xr.Dataset, reference: dict[str, tuple[float, float]], chi2: float) -> None:
    """Compare within a tenth of the errors, these within 10 % (as many digits as the reference gives), chi2 within 0.5."""
    assert fit.attrs["chi2"] == pytest.approx(chi2, abs=0.5)
    assert fit.attrs["lost_points"] == 0
    for name, (value, error) in reference.items():
        one = fit.sel(parameter=name)
        assert float(one["value"]) == pytest.approx(value, abs=0.1 * error), name
        assert float(one["error"]) == pytest.approx(error, rel=0.10, abs=0.0), name


@pytest.fixture(scope="module")
def stiff() -> xr.Dataset:
    return fitted("stiff", [E, H, ETA])


def test_stiff_curve_gives_the_reference_values(stiff: xr.Dataset) -> None:
    check(stiff, STIFF, 201.55)
    assert float(stiff["correlation"].sel(parameter=E, parameter_2="zc_offset")) == pytest.approx(0.9197, abs=0.01)


@pytest.mark.long
def test_stiff_curve_with_a_prior_of_Q_gives_the_reference_values() -> None:
    fit = fitted("stiff", [E, H, ETA], priors={"cantilever.Q": (180.0, 3.6)})
    reference = STIFF | {E: (2.0416e9, 0.12e9), H: (5.925e-20, 2.9e-21), "cantilever.Q": (179.99, 3.6)}
    check(fit, reference, 201.55)
    assert float(fit["correlation"].sel(parameter=E, parameter_2=H)) == pytest.approx(0.9257, abs=0.01)


def test_attractive_curve_gives_the_reference_values_and_does_not_see_the_modulus() -> None:
    fit = fitted("air", [E, H])
    check(fit, AIR, 198.76)
    assert float(fit["correlation"].sel(parameter=H, parameter_2="zc_offset")) == pytest.approx(0.9053, abs=0.01)
    assert not bool(fit["seen"].sel(parameter=E))
    assert np.isnan(float(fit["error"].sel(parameter=E)))
    assert float(fit["value"].sel(parameter=E)) == pytest.approx(fc.TRUTH["air"][0], rel=1e-12)  # where it started
    assert [piece.name for piece in advice_in(fit)] == ["not_seen"]
    assert "not constrained by these data" in df.fit_report(fit)
    assert "The other values and errors are valid for sample.youngs_modulus = 1 GPa only." in df.fit_report(fit)


@pytest.mark.parametrize("name", ["liquid", "stiff"])
def test_a_model_without_dissipation_is_told_the_viscosity_that_its_residuals_show(name) -> None:
    """It is what a fit with this force finds; chi2 alone is as expected, and H is off by up to three errors."""
    fit = df.fit(fc.case_of(name, viscous=False), fc.data_of(name), free=[E, H])
    viscous = df.fit(fc.case_of(name), fc.data_of(name), free=[E, H, ETA])
    [told] = advice_in(fit)
    assert told.name == "missing_viscosity" and "reduced_chi2" not in fit.attrs["advice_pieces"]
    assert told.found**2 == pytest.approx(fit.attrs["chi2"] - viscous.attrs["chi2"], rel=0.1)
    found = viscous.sel(parameter=ETA)
    value, error = re.search(r"viscosity of ([.\d]+) ± ([.\d]+) Pa s", told.text).groups()
    assert float(value) == pytest.approx(float(found["value"]), abs=0.3 * float(found["error"]))
    assert float(error) == pytest.approx(float(found["error"]), rel=0.15)


def test_noise_over_an_elastic_sample_shows_no_viscosity() -> None:
    """The deviation of the score test is normal: over 12 draws of the size of noise."""
    case, deviations = fc.case_of("liquid", viscous=False), []
    model = df.fit(case, fc.data_of("liquid"), free=[E, H], search=False)
    truth = np.stack([model["amplitude_fit"].values[:, 0], model["phase_fit"].values[:, 0]])
    for draw in range(12):
        noise = np.random.default_rng(draw).standard_normal(truth.shape) * np.array(fc.SIGMA["liquid"])[:, None]
        data = fc.dataset(model["height"].values, *(truth + noise), model["branch"].values, fc.SIGMA["liquid"])
        found = find(case, measured_curve(case, data), settings_of(case, [E, H], {"search": False}), lambda *_: None)
        deviations.append(found.missing.deviation)
    assert 0.5 < np.sqrt(np.mean(np.square(deviations))) < 1.6


def test_attractive_curve_without_nuisance_gives_the_reference_values() -> None:
    fit = fitted("air", [H], nuisance=["zc_offset"])
    check(fit, {H: (1.9932e-20, 6.7e-22), "zc_offset": (-0.20069e-9, 0.0050e-9)}, 199.04)
    assert float(fit["correlation"].sel(parameter=H, parameter_2="zc_offset")) == pytest.approx(0.9282, abs=0.01)


def test_liquid_curve_gives_the_reference_values_and_prefers_viscosity() -> None:
    whole = fitted("liquid", [E, H, ETA])
    check(whole, LIQUID, 177.21)
    simple = fitted("liquid", [E, H])
    check(simple, {E: (51.30e6, 0.74e6), H: (4.67e-22, 1.7e-22), "zc_offset": (0.1887e-9, 0.040e-9)}, 196.74)
    table = df.compare_fits({"elastic": simple, "viscous": whole})
    assert table["model"].values.tolist() == ["viscous", "elastic"]
    assert float(table["delta_aic"].sel(model="elastic")) == pytest.approx(17.5, abs=0.5)
    assert not bool(table["not_excluded"].sel(model="elastic"))


@pytest.mark.parametrize("seed", some_long([1, 2, 5], [1, 2]))  # from 5 one of the searches ends in a false minimum
def test_a_start_far_off_finds_the_same_minimum(seed: int, stiff: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    # 30 of 30 in benchmarks/fit_starts.py
    rng = np.random.default_rng(seed)
    off = np.exp(rng.uniform(-np.log(5.0), np.log(5.0), 3))
    start = {E: 2e9 * off[0], H: 6e-20 * off[1], ETA: 20.0 * off[2], "zc_offset": rng.uniform(-1e-9, 1e-9)}
    tolerances, minimize = [], Objective.minimize

    def asked(self: Objective, tolerance: float = EXACT, most: int = MOST) -> Minimum:
        tolerances.append(tolerance)
        return minimize(self, tolerance, most)

    monkeypatch.setattr(Objective, "minimize", asked)
    fit = fitted("stiff", [E, H, ETA], start=start)
    assert fit.attrs["chi2"] == pytest.approx(stiff.attrs["chi2"], abs=1e-3)
    apart = (fit["value"] - stiff["value"]) / stiff["error"]
    assert float(abs(apart).max()) < 0.01
    # last digits are sought of the best minimum alone; how many evaluations they take hangs on the last bits of chi2
    assert len(tolerances) > 3
    assert sum(tolerance < ROUGH for tolerance in tolerances) == 1


def test_forgotten_phase_offset_shows_in_chi2() -> None:
    # reference: H = 1.375e-19 instead of 6e-20 J with an error of 6 %, chi2 513.5 for 100 numbers
    fit = fitted("stiff", [H], nuisance=["zc_offset", "A0"], branch="attractive")
    assert float(fit["value"].sel(parameter=H)) > 1.2e-19
    assert fit.attrs["chi2"] > 400.0
    assert "reduced_chi2" in [piece.name for piece in advice_in(fit)]
    assert df.chi2_in_words(fit).startswith("χ² is too large, ") and "too large" in df.fit_report(fit)


def test_heights_of_a_soft_sample_are_found_where_the_amplitude_hardly_falls() -> None:
    offset = -17e-9
    case = df.Case(
        cantilever={"f0": 30e3, "k": 0.1, "Q": 3.0}, drive={"A0": 10e-9}, tip={"radius": 10e-9},
        sample={"youngs_modulus": 1e6, "poisson_ratio": 0.5}, forces=[df.forces.Hertz()],
    )  # fmt: skip
    curve = df.approach(case, zc=np.linspace(18e-9, 1e-9, 100), direction="approach")
    rng, sigma = np.random.default_rng(1), (0.1e-9, 0.5)
    amplitude, phase = (
        curve[name].values.ravel() + rng.normal(0.0, error, 100)
        for name, error in zip(("amplitude", "phase"), sigma, strict=True)
    )
    assert amplitude.min() > 0.9 * 10e-9
    data = fc.dataset(curve["zc"].values - offset, amplitude, phase, np.ones(100), sigma)
    fit = df.fit(case.replace("sample.youngs_modulus", 2e7), data, free=[E])
    for name, truth in ((E, 1e6), ("zc_offset", offset)):
        one = fit.sel(parameter=name)
        assert abs(float(one["value"]) - truth) < 3.0 * float(one["error"]), name
    assert fit.attrs["chi2"] < 1.3 * fit.attrs["degrees_of_freedom"]
