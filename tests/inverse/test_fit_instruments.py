"""Fits with the drive and the read-out as they were: shaken base, lever of light, two tones; and forces with memory."""

import fitted_curves as fc
import numpy as np
import pytest
from fitted_curves import E, H

import dforce as df
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.selection import PointSelection, measured
from dforce.inverse.fitting.unknowns import make_unknowns

HEIGHTS = np.linspace(9.2e-9, 2e-9, 31)
OFFSET = 0.1e-9


def simulated(case: df.Case, noise: float = 0.0) -> object:
    """Return a curve of a case without jumps, as `df.approach` computes it."""
    curve = df.approach(case, zc=HEIGHTS)
    assert "jump_zc" not in curve
    data = fc.dataset(
        HEIGHTS - OFFSET, curve["amplitude"].values[:, 0], curve["phase"].values[:, 0], np.ones(31), (0.016e-9, 0.3)
    )
    if curve.sizes["tone"] > 1:
        data["amplitude_2"] = ("point", curve["amplitude"].values[:, 1])
        data["phase_2"] = ("point", curve["phase"].values[:, 1])
        data.attrs |= {"amplitude_2_error": 5e-12, "phase_2_error": 0.3}
    return data


@pytest.mark.long
@pytest.mark.parametrize("kind", ["deflection", "optical_lever"])
def test_a_shaken_base_in_liquid_is_part_of_the_model(kind: str) -> None:
    case = fc.case_of("liquid")
    case = case.replace(drive={"A0": "8 nm", "excitation": "base"}, readout={"kind": kind})
    case = case.replace("solver.points_per_period", 256)
    fit = df.fit(case, simulated(case), free=[E, H], start={E: 70e6, H: 0.7e-21}, search=False)
    assert fit.attrs["chi2"] < 1e-4
    for name, value in ((E, 50e6), (H, 1e-21), ("zc_offset", OFFSET), ("A0", 8e-9)):
        assert float(fit["value"].sel(parameter=name)) == pytest.approx(value, rel=1e-4), name
    # a force at the tip instead would not describe the curve
    other = df.fit(case.replace(drive={"A0": "8 nm"}), simulated(case), free=[E, H], search=False)
    assert other.attrs["chi2"] > 1000.0


def test_two_tones_tell_the_modulus_and_Q() -> None:
    modes = [{"f0": "20 kHz", "k": "0.3 N/m", "Q": 3}, {"f0": "124 kHz", "k": "11.8 N/m", "Q": 7.5}]
    case = fc.case_of("liquid").replace(
        cantilever={"modes": modes},
        drive={"tones": [{"A0": "8 nm"}, {"A0": "0.3 nm"}]},
        solver={"points_per_period": 256},
    )
    data = simulated(case)
    fit = df.fit(
        case, data, free=[E, "cantilever.modes.1.Q"], start={E: 60e6, "cantilever.modes.1.Q": 3.2}, search=False
    )
    assert fit.sizes["tone"] == 2
    assert {"A0_2", "phase_offset_2"} <= set(fit["parameter"].values.tolist())
    again = df.fit_again(fit)
    np.testing.assert_array_equal(again["value"], fit["value"])
    assert fit.attrs["chi2"] < 1e-3
    assert float(fit["value"].sel(parameter=E)) == pytest.approx(50e6, rel=1e-3)
    assert float(fit["value"].sel(parameter="cantilever.modes.1.Q")) == pytest.approx(3.0, rel=1e-3)


@pytest.mark.long
def test_forces_with_two_branches_are_followed_anew_on_both_sides() -> None:
    adhesion = df.forces.AdhesionHysteresis(approach_energy="0.05 mJ/m^2", retract_energy="0.1 mJ/m^2")
    case = df.Case(
        **fc.INSTRUMENTS["liquid"], drive={"A0": "8 nm"}, sample={"youngs_modulus": "50 MPa", "poisson_ratio": 0.3},
        forces=[adhesion, df.forces.Hertz()],
    )  # fmt: skip
    data = fc.dataset(HEIGHTS[::4] - OFFSET, np.full(8, 8e-9), np.full(8, 90.0), np.ones(8), (0.016e-9, 0.3))
    unknowns = make_unknowns(case, 1, [E], ("zc_offset",), {}, {}, {})
    model = CurveModel(case, unknowns, measured(data, PointSelection(margin=0)))
    varied = np.array([one.varied(one.start) for one in unknowns])
    told = model.predict(varied)
    assert not model.curves.is_smooth and not told.lost.any()
    slopes = model.slopes(varied, told)
    for i, one in enumerate(unknowns):
        above, below = varied.copy(), varied.copy()
        above[i] += 300.0 * one.step
        below[i] -= 300.0 * one.step
        plain = (model.predict(above).values - model.predict(below).values) / (600.0 * one.step)
        apart = np.abs(slopes[:, :, i] - plain).max(axis=0)
        assert (apart < 0.01 * np.abs(plain).max(axis=0) + 1e-15).all(), one.name


def test_an_amplitude_scale_is_fitted_on_request() -> None:
    case = fc.case_of("liquid").replace("solver.points_per_period", 256)
    data = simulated(case)
    wrong = data.assign(amplitude=1.02 * data["amplitude"])
    fit = df.fit(
        case, wrong, free=[E], nuisance=["zc_offset", "amplitude_scale", "phase_offset"], search=False,
        start={"zc_offset": OFFSET},
    )  # fmt: skip
    assert float(fit["value"].sel(parameter="amplitude_scale")) == pytest.approx(1.02, rel=1e-4)
