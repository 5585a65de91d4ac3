"""Amplitudes of files, zero to peak, rms or peak to peak: the reader converts them to zero to peak, or says why not."""

import measured_curve
import numpy as np
import pytest

import dforce as df

AMPLITUDE = measured_curve.numbers()[1]


def read(tmp_path, heading, **how):
    path = tmp_path / "curve.csv"
    path.write_text(measured_curve.text(heading=heading), encoding="utf-8")
    return df.read_measured(path, **how)


@pytest.mark.parametrize(
    "name", ["Amp p-p (nm)", "Amplitude_pp_nm", "Amplitude pk-pk [nm]", "Amplitude peak-to-peak (nm)"]
)
def test_an_amplitude_that_is_named_peak_to_peak_is_halved(tmp_path, name):
    found = read(tmp_path, f"height_nm,{name},phase_deg")
    np.testing.assert_allclose(found.amplitude, 0.5 * AMPLITUDE, atol=1e-13)
    assert "amplitude: peak to peak in the file, halved" in found.attrs["history"]
    with pytest.raises(df.ParameterError, match="but amplitude_is = 'peak'"):
        read(tmp_path, f"height_nm,{name},phase_deg", amplitude_is="peak")


def test_an_amplitude_of_another_name_is_halved_on_request_or_by_the_name_of_its_column(tmp_path):
    asked = read(tmp_path, "height_nm,amplitude_nm,phase_deg", amplitude_is="peak-to-peak")
    named = read(tmp_path, "height_nm,Vpp (nm),phase_deg", columns={"amplitude": "Vpp"})
    for found in (asked, named):
        np.testing.assert_allclose(found.amplitude, 0.5 * AMPLITUDE, atol=1e-13)


@pytest.mark.parametrize(
    ("name", "scale"),
    [
        ("Amp (nm rms)", np.sqrt(2.0)),
        ("Amplitude [nmrms]", np.sqrt(2.0)),
        ("Amplitude (nm_RMS)", np.sqrt(2.0)),
        ("Amp (nm p-p)", 0.5),
        ("Amp [nmpp]", 0.5),
        ("Amplitude (nm pk)", 1.0),
        ("Amplitude 0-pk (nm)", 1.0),
    ],
)
def test_the_unit_of_an_amplitude_shows_its_kind(tmp_path, name, scale):
    found = read(tmp_path, f"height_nm,{name},phase_deg")
    np.testing.assert_allclose(found.amplitude, scale * AMPLITUDE, atol=1e-13)


def test_a_line_of_units_shows_the_kind_of_an_amplitude(tmp_path):
    found = read(tmp_path, "height,amplitude,phase\nnm,mVrms,deg", sensitivity="1 nm/mV")
    np.testing.assert_allclose(found.amplitude, np.sqrt(2.0) * AMPLITUDE, atol=1e-13)
    named = read(
        tmp_path,
        "height_nm,Lock-in R (mVrms),phase_deg",
        sensitivity="1 nm/mV",
        columns={"amplitude": "Lock-in R (mVrms)"},
    )
    np.testing.assert_allclose(named.amplitude, np.sqrt(2.0) * AMPLITUDE, atol=1e-13)


def test_a_heading_in_another_language_is_known(tmp_path):
    assert read(tmp_path, "Höhe (nm),Amplitude (nm),Phase (Grad)").phase[0] == pytest.approx(90.0, abs=1.0)


@pytest.mark.parametrize("heading", ["Phase_Deg", "Phase (Deg)", "Phase [DEG]", "Phase (Degrees)"])
def test_degrees_are_known_in_capitals(tmp_path, heading):
    assert read(tmp_path, f"height_nm,amplitude_nm,{heading}").phase[0] == pytest.approx(90.0, abs=1.0)


def test_a_sensitivity_without_its_unit_is_the_reason_of_an_amplitude_of_meters(tmp_path):
    with pytest.raises(df.ResultError, match="write the sensitivity with its unit, such as '52 nm/V'"):
        read(tmp_path, "height_nm,amplitude_V,phase_deg", sensitivity=50)


def test_a_sensitivity_that_no_column_needs_is_said_to_be_unused(tmp_path):
    found = read(tmp_path, "height_nm,amplitude_nm,phase_deg", sensitivity="50 nm/V")
    np.testing.assert_allclose(found.amplitude, AMPLITUDE, atol=1e-13)
    assert "amplitude: column 'amplitude' in nm; the sensitivity is not used" in found.attrs["history"]
    (tmp_path / "psd.csv").write_text(
        "frequency_Hz,ASD (pm/sqrt(Hz))\n"
        + "\n".join(f"{f},{(1 + 1e4 / (9 + (f - 5000) ** 2)) ** 0.5}" for f in range(4800, 5200))
    )
    said = df.thermal_tune(tmp_path / "psd.csv", sensitivity="50 nm/V").history
    assert any(line.endswith("the sensitivity is not used") for line in said)
