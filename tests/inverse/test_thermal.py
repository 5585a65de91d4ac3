"""The thermal tune, on spectra of a lever that is known."""

from __future__ import annotations

import measured_curve
import numpy as np
import pytest
from scipy import integrate, linalg, signal
from tiers import some_long

import dforce as df
from dforce.instrument import beam
from dforce.inverse.thermal import BOLTZMANN

K, Q, F0 = 2.0, 100.0, 70e3
DRAWS = 30


def written(tmp_path, text=None, **how):
    path = tmp_path / "thermal.csv"
    path.write_text(text or measured_curve.spectrum_text(**how))
    return path


def table(frequency, density, heading="frequency (Hz),PSD (m^2/Hz)"):
    rows = [f"{f:.6f},{s:.9e}" for f, s in zip(frequency, density, strict=True)]
    return "\n".join([heading, *rows, ""])


def test_without_noise_the_truth_comes_back(tmp_path):
    frequency = np.linspace(50e3, 90e3, 4001)
    tune = df.thermal_tune(written(tmp_path, table(frequency, measured_curve.density(frequency))), calibrated="mode")
    assert tune.f0 == pytest.approx(F0, rel=1e-7)
    assert abs(tune.Q - Q) < 1e-5 * Q
    assert tune.k == pytest.approx(K, rel=1e-5)
    assert tune.background == pytest.approx(1e-28, rel=1e-3)
    # sqrt(S) at the peak, 75 kHz, 2.8 N/m, Q 200, is 1.57980855077e-12 m/sqrt(Hz) at 298.15 K
    peak = measured_curve.density(np.array([75e3]), k=2.8, Q=200.0, f0=75e3, background=0.0)
    assert np.sqrt(peak[0]) == pytest.approx(1.57980855077e-12, rel=1e-10)


@pytest.mark.parametrize(("highest", "scale"), [(74e3, "linear"), (700e3, "log")])
def test_a_narrow_spectrum_has_a_linear_axis(tmp_path, highest, scale):
    frequency = np.linspace(66e3 if scale == "linear" else 7e3, highest, 4000)
    tune = df.thermal_tune(written(tmp_path, table(frequency, measured_curve.density(frequency))), calibrated="mode")
    assert df.plot.thermal_spectrum(tune.dataset()).get_xscale() == scale


@pytest.mark.parametrize(
    ("heading", "power", "scale"),
    [
        ("Frequency (Hz),ASD (pm/rtHz)", 0.5, 1e12), ("Freq,PSD [m^2/Hz]", 1.0, 1.0), ("f (Hz),PSD (pm²/Hz)", 1.0, 1e24),
        ("f,Amplitude spectral density (fm/√Hz)", 0.5, 1e15), ("f,ASD [fm/sqrt(Hz)]", 0.5, 1e15),
        ("f,ASD (nm/Hz^1/2)", 0.5, 1e9), ("f,ASD (nm/Hz^(1/2))", 0.5, 1e9),
    ],
)  # fmt: skip
def test_headings_as_people_write_them_tell_the_unit(tmp_path, heading, power, scale):
    frequency = np.linspace(50e3, 90e3, 801)
    density = measured_curve.density(frequency)
    tune = df.thermal_tune(written(tmp_path, table(frequency, density**power * scale, heading)), calibrated="mode")
    assert tune.k == pytest.approx(K, rel=1e-4)


def test_arrays_are_tuned_like_a_file(tmp_path):
    frequency = np.linspace(50e3, 90e3, 801)
    density = measured_curve.density(frequency) * np.random.default_rng(1).gamma(50, 1 / 50, len(frequency))
    of_file = df.thermal_tune(written(tmp_path, table(frequency, density)), temperature="30(2) degC")
    of_arrays = df.thermal_tune(frequency, np.sqrt(density) * 1e12, unit="pm/rtHz", temperature="30(2) degC")
    for name, pair in of_file.as_table().items():
        assert of_arrays.as_table()[name] == pytest.approx(pair, rel=1e-4)
    data = of_arrays.dataset()
    np.testing.assert_allclose(data["spectral_density"], density, rtol=1e-12)
    np.testing.assert_allclose(data["fitted_density"], density, rtol=0.8)
    assert data["spectral_density"].attrs["units"] == "m^2/Hz"


@pytest.mark.parametrize(
    ("given", "how", "sentence"),
    [
        (([1.0, 2.0], [1.0, 2.0]), {}, "has no unit"),
        (([1.0, 2.0],), {}, "pass a file, or two arrays"),
        (("thermal.csv", [1.0, 2.0]), {"unit": "m^2/Hz"}, "pass a file, or two arrays"),
        (([1.0, 2.0], [1.0]), {"unit": "m^2/Hz"}, "2 frequencies and 1 densities"),
        (([1.0, "a"], [1.0, 2.0]), {"unit": "m^2/Hz"}, "frequency is not an array of numbers"),
        ((np.ones((2, 2)), np.ones((2, 2))), {"unit": "m^2/Hz"}, "frequency has 2 dimensions"),
        (([1.0, 2.0], [1.0, 2.0]), {"unit": "kg"}, "is not a density"),
        (([1.0, 2.0], [1.0, 2.0]), {"unit": "12 nm**9**9"}, "is not a known unit"),
        ((np.ones(99), np.full(99, np.nan)), {"unit": "m^2/Hz"}, "'density' contains no numbers"),
        ((np.arange(99.0), np.zeros(99)), {"unit": "m^2/Hz"}, "'density' contains no value above 0 in its 99 points"),
        ((np.arange(99.0), np.full(99, -1.0)), {"unit": "pm/rtHz"}, "'density' contains no value above 0"),
        ((np.full(99, np.nan), np.ones(99)), {"unit": "m^2/Hz"}, "'frequency' contains no numbers"),
        (
            (np.full(99, 5e4), np.arange(99.0)),
            {"unit": "m^2/Hz"},
            "densities above 0 at 1 frequency, but a fit needs 12",
        ),
    ],
)
def test_arrays_that_are_no_spectrum_are_refused(given, how, sentence):
    with pytest.raises(df.DForceError, match=sentence):
        df.thermal_tune(*given, **how)


def test_the_density_integrates_to_equipartition():
    frequency = np.linspace(10.0, 3e6, 3_000_001)
    area = integrate.trapezoid(measured_curve.density(frequency, background=0.0), frequency)
    assert area == pytest.approx(BOLTZMANN * 298.15 / K, rel=2e-4)  # the rest lies above 43 f0 and below 10 Hz


@pytest.mark.parametrize("averages", some_long([1, 20], [20]))
def test_errors_are_right_over_many_spectra(tmp_path, averages):
    pulls = []
    for seed in range(DRAWS):
        tune = df.thermal_tune(written(tmp_path, seed=seed, averages=averages), calibrated="mode")
        pulls.append([(tune.f0 - F0) / tune.f0_error, (tune.Q - Q) / tune.Q_error, (tune.k - K) / tune.k_error])
        assert 0.6 < tune.averages / averages < 1.7  # by the scatter of 380 points
    # 30 draws know a spread to 13 %, and a mean to 0.18
    assert (np.std(pulls, axis=0) < 1.4).all() and (np.std(pulls, axis=0) > 0.65).all()
    assert (np.abs(np.mean(pulls, axis=0)) < 0.6).all()


def test_a_lever_of_light_calibrated_by_a_force_curve_reads_mode_1_differently(tmp_path):
    """k_static = 0.8174347867 k_B T / <z*^2>, and k of mode 1 is 1.03019694736 times that: Butt and Jaschke 1995."""
    path = written(tmp_path)
    mode, static = df.thermal_tune(path, calibrated="mode"), df.thermal_tune(path)
    share = BOLTZMANN * 298.15 / static.mean_square
    assert static.k_static == pytest.approx(0.8174347867 * share, rel=1e-9)
    assert static.k == pytest.approx(1.03019694736 * static.k_static, rel=1e-9)
    assert static.k / mode.k == pytest.approx(beam.lever_factor(1) ** 2, rel=1e-12)


def test_units_and_the_error_of_the_sensitivity_count(tmp_path):
    frequency, power = measured_curve.spectrum()
    plain = df.thermal_tune(written(tmp_path, table(frequency, power)))
    roots = written(tmp_path, table(frequency / 1e3, 1e12 * np.sqrt(power), "Frequency (kHz),ASD (pm/√Hz)"))
    assert df.thermal_tune(roots).k == pytest.approx(plain.k, rel=1e-6)
    volts = written(
        tmp_path, table(frequency, np.sqrt(power) / 50e-9, "Frequency (Hz),Amplitude spectral density (V/sqrt(Hz))")
    )
    with pytest.raises(df.ParameterError, match="write the sensitivity"):
        df.thermal_tune(volts)
    tune = df.thermal_tune(volts, sensitivity="50(1) nm/V")
    assert tune.k == pytest.approx(plain.k, rel=1e-6)
    assert tune.k_error / tune.k == pytest.approx(np.hypot(plain.k_error / plain.k, 0.04), rel=1e-3)
    warm = df.thermal_tune(written(tmp_path, table(frequency, power)), temperature="40 degC")
    assert warm.k / plain.k == pytest.approx(313.15 / 298.15)


def test_a_peak_that_drifted_is_doubted_and_its_errors_grow(tmp_path):
    frequency = np.linspace(50e3, 90e3, 4001)
    two = 0.5 * (measured_curve.density(frequency, f0=69.5e3) + measured_curve.density(frequency, f0=70.5e3))
    noise = np.random.default_rng(1).gamma(100, 0.01, size=len(frequency))
    tune = df.thermal_tune(written(tmp_path, table(frequency, two * noise)))
    assert any("not the peak of one steady resonance" in line for line in tune.history)
    assert not any("doubt" in line for line in df.thermal_tune(written(tmp_path)).history)


def test_a_tune_goes_into_a_calibration(tmp_path):
    tune = df.thermal_tune(written(tmp_path), calibrated="mode")
    attrs = df.calibrate(measured_curve.dataset(), thermal=tune).attrs
    assert (attrs["k"], attrs["k_error"]) == (tune.k, tune.k_error)
    assert (attrs["Q"], attrs["f0_error"]) == (tune.Q, tune.f0_error)


def test_a_spectrum_of_nanosurf_is_read(tmp_path):
    import files

    power = measured_curve.spectrum()[1]
    content = files.nanosurf(
        [((50e3, 40e3), {"Amplitude Spectral Density": np.sqrt(power)[None]})], {"Amplitude Spectral Density": "m/sqrt(Hz)"},
        heights=("Frequency", "Hz"), frames=("Spectrum FFT",),
    )  # fmt: skip
    path = tmp_path / "thermal.nid"
    path.write_bytes(content)
    assert df.thermal_tune(path).k == pytest.approx(df.thermal_tune(written(tmp_path)).k, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "how", "sentence"),
    [
        (table(np.linspace(1e3, 2e3, 400), np.ones(400)), {}, "has no peak above"),
        (table(np.linspace(1e3, 2e3, 9), np.ones(9)), {}, "has densities above 0 at 9 frequencies, but a fit needs 12"),
        (table(*measured_curve.spectrum(), "frequency (Hz),PSD (m/s)"), {}, "is not a density"),
        (table(*measured_curve.spectrum(), "frequency (Hz),PSD"), {}, "has no unit for the density"),
        (table(*measured_curve.spectrum(), "U,V"), {}, r"frequency; name it with .* or --columns frequency=\.\.\."),
        (None, {"columns": {"frequenzy": "x"}}, "neither frequency nor density"),
        (None, {"columns": {"density": "x"}}, "no column 'x' for the density"),
        (None, {"calibrated": "dynamic"}, "not one of static, mode"),
        (None, {"temperature": "-5 K"}, "must be above 0"),
        (None, {"band": ("1 kHz",)}, "not the lowest and the highest frequency"),
        (None, {"band": ("1 kHz", "2 kHz")}, "above 0 at 0 frequencies in the band"),
    ],
)
def test_what_is_no_thermal_tune_is_one_sentence(tmp_path, text, how, sentence):
    with pytest.raises(df.DForceError, match=sentence):
        df.thermal_tune(written(tmp_path, text), **how)


def test_a_windowed_spectrum_of_one_resonance_is_not_doubted_and_its_errors_hold(tmp_path):
    lever = df.Case(cantilever={"f0": F0, "k": K, "Q": 50}, drive={"A0": "10 nm"})
    pulls = []
    for seed in range(12):
        found = df.thermal_spectrum(lever.replace("noise.seed", seed), "0.4 s")  # by Hann's window
        tune = df.thermal_tune(df.write(found, tmp_path / "tune.nc"))
        assert not any("doubt" in line for line in tune.history)
        pulls.append([(tune.f0 - F0) / tune.f0_error, (tune.Q - 50) / tune.Q_error, (tune.k - K) / tune.k_error])
    assert any("as after windowing of the spectra" in line for line in tune.history)
    assert (np.std(pulls, axis=0) < 1.7).all() and (np.std(pulls, axis=0) > 0.45).all()  # 12 draws know it to 20 %


def simulated(Q, f0, rate, length, averages, window, draw):
    """Return the spectrum of a record of thermal motion, by the exact steps of a damped oscillator."""
    omega, h, count = 2.0 * np.pi * f0, 1.0 / rate, length * averages
    step = linalg.expm(omega * h * np.array([[0.0, 1.0], [-1.0, -1.0 / Q]]))
    root = np.linalg.cholesky(np.eye(2) - step @ step.T)
    rates, ways = np.linalg.eig(step)
    kicks = draw.normal(size=(count, 2)) @ root.T @ np.linalg.inv(ways)[0]
    motion = 2.0 * (ways[0, 0] * signal.lfilter([1.0], [1.0, -rates[0]], kicks)).real * np.sqrt(BOLTZMANN * 298.15 / K)
    frequency, density = signal.welch(motion, rate, window, length, noverlap=0)
    return frequency[1:], density[1:]


def test_a_spectrum_too_coarse_for_its_peak_is_doubted():
    """A segment without a window makes a peak wider by the spacing of the frequencies over pi."""
    draw, coarse = np.random.default_rng(4), "Q may be too low by up to"
    for length, doubted in ((2**14, False), (2**11, True)):
        f, density = simulated(200.0, 75e3, 5e5, length, 2**18 // length, "boxcar", draw)
        tune = df.thermal_tune(f, density, unit="m^2/Hz", calibrated="mode")
        assert any(coarse in line for line in tune.history) == doubted
        low = 5e5 / length / (np.pi * 375.0)
        assert abs(tune.Q / 200.0 - 1.0 / (1.0 + low)) < 3.0 * tune.Q_error / 200.0


def test_errors_hold_for_spectra_with_few_points_in_a_windowed_peak():
    draw, off = np.random.default_rng(3), []
    for _ in range(DRAWS):
        f, density = simulated(8.0, 20e3, 2e5, 2**9, 100, "hann", draw)
        tune = df.thermal_tune(f, density, unit="m^2/Hz", calibrated="mode")
        off += [(tune.k - K) / tune.k_error, (tune.f0 - 20e3) / tune.f0_error]
    # of independent points they are too small by 1.4; 60 values show their scatter to 9 %
    assert np.std(off) < 1.2


def test_another_result_of_dforce_is_no_spectrum(tmp_path):
    other = df.write(df.dwell(df.example("figure-3-air"), "9 nm"), tmp_path / "dwell.nc")
    with pytest.raises(df.ResultError, match=r"is a result of dForce without .* without a thermal spectrum"):
        df.thermal_tune(other)


def test_a_tune_shows_its_numbers_with_errors(tmp_path):
    tune = df.thermal_tune(written(tmp_path), calibrated="mode")
    assert repr(tune).startswith("<ThermalTune f0 = ") and repr(tune).count(" ± ") == 3 and len(repr(tune)) < 100
