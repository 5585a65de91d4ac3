"""What a curve can tell is known before it is measured: the table of an independent code, to its digits."""

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from fitted_curves import ETA, E, H

import dforce as df

Q = "cantilever.Q"
# 100 points, 0.2 % of A0 and 0.3 degrees; two digits are given
AIR = {
    "sample": {H: 0.034, "zc_offset": 0.0051e-9}, "all": {H: 0.80, "zc_offset": 0.0054e-9, Q: 0.80},
    "prior": {H: 0.041, "zc_offset": 0.0051e-9, Q: 0.020},
}  # fmt: skip
LIQUID = {
    "sample": {E: 0.0115, H: 0.109, ETA: 0.13, "zc_offset": 0.030e-9},
    "all": {E: 0.086, H: 0.167, ETA: 0.44, "zc_offset": 0.042e-9, Q: 0.059},
}


def errors(result: xr.Dataset, known: str, name: str, curve: str = "approach") -> float:
    return float(result["error"].sel(curve=curve, known=known, parameter=name))


@pytest.fixture(scope="module")
def stiff() -> xr.Dataset:
    return df.identify(fc.case_of("stiff"), np.linspace(34.5e-9, 9e-9, 151), [E, H, ETA], helps=False)


def test_a_tip_that_never_touches_tells_no_modulus() -> None:
    found = df.identify(fc.case_of("air"), np.linspace(12e-9, 2e-9, 100), [E, H, ETA], helps=False)
    assert found["curve"].values.tolist() == ["approach"]
    for known, row in AIR.items():
        for name, value in row.items():
            assert errors(found, known, name) == pytest.approx(value, rel=0.04), (known, name)
        for name in (E, ETA):
            assert str(found["verdict"].sel(curve="approach", known=known, parameter=name).values) == "not seen"
    pairs = found["worst_correlation"].sel(curve="approach")
    assert abs(float(pairs.sel(known="sample"))) == pytest.approx(0.928, abs=0.002)
    assert float(pairs.sel(known="all")) == pytest.approx(-0.9990, abs=0.0005)


def test_a_liquid_cell_of_low_Q_tells_the_modulus_and_even_Q() -> None:
    found = df.identify(fc.case_of("liquid"), np.linspace(9.2e-9, 2e-9, 100), [E, H, ETA], helps=False)
    for known, row in LIQUID.items():
        for name, value in row.items():
            assert errors(found, known, name) == pytest.approx(value, rel=0.05), (known, name)
    assert float(found["worst_correlation"].sel(known="all")[0]) == pytest.approx(-0.990, abs=0.003)


def test_both_branches_tell_far_more_than_the_one_behind_the_jump(stiff: xr.Dataset) -> None:
    alone, both = (errors(stiff, "sample", E, curve) for curve in ("behind the jump", "approach and retract"))
    assert both < 0.05 < 0.2 < alone
    assert errors(stiff, "all", E, "approach and retract") > 1.0  # only forces over k / Q
    assert abs(float(stiff["worst_correlation"].sel(curve="approach and retract", known="all"))) > 0.999


def test_a_radius_is_dead_and_the_products_that_are_known_are_named() -> None:
    found = df.identify(fc.case_of("liquid"), np.linspace(9.2e-9, 2e-9, 100), [E, H, ETA, "tip.radius"], helps=False)
    verdicts = found["verdict"].sel(curve="approach", known="sample")
    for name in (E, H, ETA, "tip.radius"):
        assert str(verdicts.sel(parameter=name).values) == "only a product", name
    (line,) = [line for line in found.attrs["products"].splitlines() if line.startswith("approach, sample:")]
    for product in (f"{E} * tip.radius^0.5", f"{H} * tip.radius^1", f"{ETA} * tip.radius^0.5"):
        assert product in line
    assert "only products are constrained" in df.identify_report(found, "sample")


@pytest.mark.long
def test_other_amplitudes_are_tried_and_told() -> None:
    found = df.identify(fc.case_of("air"), free=[E, H, ETA])
    assert {"half the free amplitude", "twice the free amplitude", "with a second tone"} <= set(
        found["curve"].values.tolist()
    )
    # twice the amplitude makes the tip touch
    assert errors(found, "sample", E, "twice the free amplitude") < 0.5
    assert errors(found, "sample", E, "with a second tone") < 0.05
    text = df.identify_report(found)
    assert "not seen" in text and "twice the free amplitude" in text


def test_what_is_expected_is_what_a_fit_finds(stiff: xr.Dataset) -> None:
    # the errors of a fit at the same points, of the same noise
    data = fc.data_of("stiff")
    fit = df.fit(fc.case_of("stiff"), data, free=[E, H, ETA], search=False)
    relative = float(fit["error"].sel(parameter=E)) / 2e9
    assert errors(stiff, "prior", E, "approach") == pytest.approx(relative, rel=0.5)


def test_shares_are_shares_of_the_free_amplitude() -> None:
    case, shares = fc.case_of("air"), {"of": "drive.A0", "start": 1.15, "stop": 0.5, "points": 21}
    zc = np.linspace(1.15, 0.5, 21) * case.problem.tones[0].A0
    by_share, by_length = (df.identify(case, given, [H], helps=False) for given in (shares, zc))
    assert errors(by_share, "sample", H) == pytest.approx(errors(by_length, "sample", H), rel=1e-4)
    with pytest.raises(df.ParameterError, match="shares of A0"):
        df.experiments.Approach(zc=shares).distances()


def test_a_report_tells_modes_apart_and_what_brackets_mean() -> None:
    row = df.identify(fc.case_of("air"), np.linspace(12e-9, 9e-9, 30), [H], helps=False).sel(known=["sample"])
    assert "in brackets" not in df.identify_report(row, "sample")
    pair = np.full((1, 1), "cantilever.modes.1.Q, cantilever.modes.2.Q")
    text = df.identify_report(
        row.assign(worst_pair=(("curve", "known"), pair), error=0.0 * row["error"] + 0.8), "sample"
    )
    assert "modes.1.Q, modes.2.Q" in text
    assert "(80 %)" in text and "in brackets: so large that the parameter is not constrained" in text


def test_a_measured_curve_gives_its_own_range_and_noise() -> None:
    case, data = fc.case_of("air"), fc.data_of("air").assign_attrs(height_offset=-0.2e-9)
    heights = data["height"].values + data.attrs["height_offset"]
    noise = {"amplitude": data.attrs["amplitude_error"], "phase": data.attrs["phase_error"]}
    found, typed = (
        df.identify(case, data, [E, H], helps=False),
        df.identify(case, heights, [E, H], errors=noise, helps=False),
    )
    xr.testing.assert_equal(found, typed)
    half = df.identify(case, data, [E, H], errors={"phase": 0.5 * data.attrs["phase_error"]}, helps=False)
    assert errors(half, "prior", H) < errors(found, "prior", H)


def test_what_a_range_does_not_constrain_is_a_sentence_at_its_path(stiff: xr.Dataset) -> None:
    assert df.identify_in_words(stiff) == {}
    before = df.identify_in_words(stiff, curve="before the jump")
    share = 100.0 * errors(stiff, "prior", E, "before the jump")
    assert before[E] == f"This range does not constrain {E}: the error would be {share:.0f} %."
    assert before[ETA] == f"This range does not constrain {ETA}: the curve does not depend on it."
    assert H not in before
    with pytest.raises(df.ParameterError, match="no curve 'both'"):
        df.identify_in_words(stiff, curve="both")


def test_a_radius_beside_a_modulus_is_only_a_product_in_words() -> None:
    found = df.identify(fc.case_of("liquid"), np.linspace(9.2e-9, 2e-9, 40), [E, H, ETA, "tip.radius"], helps=False)
    said = df.identify_in_words(found, known="sample")
    assert "tip.radius" in said and all("only a product" in sentence for sentence in said.values())
