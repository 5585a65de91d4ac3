"""Files that are no text: HDF5, Igor's binary waves, Nanosurf's .nid, and results of dForce."""

from __future__ import annotations

import sys

import files
import h5py
import measured_curve
import numpy as np
import pytest

import dforce as df

HEIGHT, AMPLITUDE, LAG = measured_curve.numbers()
NOTE = "\r".join([
    "ImagingMode: AC Mode", "SpringConstant: 2.7", "DriveFrequency: 70000", "ThermalQ: 180", "MicroscopeModel: Cypher",
    "Indexes: 0,119,239", "Direction: NaN,1,-1", "Temperature: 25°",
])  # fmt: skip


def both(values):
    return np.concatenate([values, values[::-1]])


def wave(**how):
    # the sensor and the piezo of these instruments grow toward the sample
    columns = {"Raw": -both(HEIGHT) + 1e-6, "Defl": 0 * both(HEIGHT), "Amp": both(AMPLITUDE), "Phase": both(LAG),
               "ZSnsr": -both(HEIGHT)}  # fmt: skip
    return files.igor_wave(columns, NOTE, **how)


def nid():
    channels = [
        {
            "Amplitude": np.stack([values[1]] * 2),
            "Phase": np.stack([values[2]] * 2),
            "Z-Axis Sensor": np.stack([-values[0]] * 2),
        }
        for values in [(HEIGHT, AMPLITUDE, LAG)] * 2  # the way back is stored in the order of the way in
    ]
    steps = (-float(HEIGHT[0]), float(np.ptp(HEIGHT)))
    return files.nanosurf([(steps, one) for one in channels], {"Amplitude": "m", "Phase": "°", "Z-Axis Sensor": "m"})


def written(tmp_path, content, name):
    path = tmp_path / name
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_binary_wave_of_igor_is_read(tmp_path, order):
    data = df.read_measured(written(tmp_path, wave(order=order), "curve.ibw"), phase_convention="lag")
    way_in = data.where(data.direction == "approach", drop=True)
    np.testing.assert_allclose(way_in.height, HEIGHT, rtol=1e-6)  # the file holds single precision
    np.testing.assert_allclose(way_in.amplitude, AMPLITUDE, rtol=1e-6)
    np.testing.assert_allclose(way_in.phase, LAG, rtol=1e-6)
    assert data.sizes["point"] == 240 and (np.diff(data.height[120:]) > 0.0).all()
    assert (data.attrs["k"], data.attrs["Q"], data.attrs["drive_frequency"]) == (2.7, 180.0, 70000.0)
    assert data.attrs["instrument"] == "Cypher" and data.attrs["height_kind"] == "sensor"
    said = data.attrs["history"]
    assert any("larger numbers are nearer to the sample" in line for line in said)
    assert "height: of the sensor; the piezo is not used" in said


def test_the_piezo_of_a_binary_wave_is_taken_when_asked_for(tmp_path):
    data = df.read_measured(written(tmp_path, wave(), "curve.ibw"), phase_convention="lag", height="piezo")
    np.testing.assert_allclose(data.height[:120] - data.height[119], HEIGHT - HEIGHT[-1], atol=3e-13)
    assert data.attrs["height_kind"] == "piezo"


def test_without_igor2_the_sentence_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "igor2", None)
    with pytest.raises(df.ResultError, match=r'pip install "dforce\[readers\]"'):
        df.read_measured(written(tmp_path, wave(), "curve.ibw"))


def test_a_wave_without_channels_is_one_sentence(tmp_path):
    path = written(tmp_path, files.igor_wave({"": HEIGHT}, ""), "wave.ibw")
    with pytest.raises(df.ResultError, match="no named channels"):
        df.read_measured(path)


def test_a_nid_file_is_read(tmp_path):
    path = written(tmp_path, nid(), "curve.nid")
    curves = df.read_curves(path, phase_convention="lag")
    assert len(curves) == 2
    data = curves[1]
    way_in = data.where(data.direction == "approach", drop=True)
    np.testing.assert_allclose(way_in.height, HEIGHT, atol=1e-16)
    np.testing.assert_allclose(way_in.amplitude, AMPLITUDE, atol=1e-16)
    np.testing.assert_allclose(way_in.phase, LAG, atol=1e-6)
    assert (np.diff(data.height[120:]) > 0.0).all()
    assert data.attrs["k"] == 2.0 and data.attrs["instrument"] == "FlexAFM"
    piezo = df.read_measured(path, curve=1, height="piezo", phase_convention="lag")
    np.testing.assert_allclose(piezo.height[:120], HEIGHT, atol=1e-14)


def test_lines_of_a_nid_file_may_be_shorter_than_the_block(tmp_path):
    values = np.zeros((2, len(HEIGHT)))
    values[:, :100] = AMPLITUDE[:100]
    steps = (-float(HEIGHT[0]), float(HEIGHT[0] - HEIGHT[99]))
    phase = np.zeros((2, len(HEIGHT)))
    phase[:, :100] = LAG[:100]
    content = files.nanosurf(
        [(steps, {"Amplitude": values, "Phase": phase})], {"Amplitude": "m", "Phase": "°"}, lines=(100, 100)
    )
    data = df.read_measured(written(tmp_path, content, "short.nid"), curve=1, phase_convention="lag")
    np.testing.assert_allclose(data.height, HEIGHT[:100], atol=1e-15)
    np.testing.assert_allclose(data.amplitude, AMPLITUDE[:100], atol=1e-16)


@pytest.mark.parametrize(
    "change", [lambda c: c[:-1], lambda c: c + b"x", lambda c: c[: len(c) // 2], lambda c: c[:400]]
)
def test_a_nid_file_of_another_length_is_refused(tmp_path, change):
    with pytest.raises(df.ResultError, match="damaged or was cut short"):
        df.read_curves(written(tmp_path, change(nid()), "curve.nid"))


def test_hdf5_holds_a_curve_in_each_group(tmp_path):
    path = tmp_path / "curves.h5"
    with h5py.File(path, "w") as file:
        file.attrs["k"] = "2.7 N/m"
        for number in range(2):
            group = file.create_group(f"curve{number}")
            for name, values, unit in (
                ("height", HEIGHT, "nm"),
                ("amplitude", AMPLITUDE, "m"),
                ("phase_deg", LAG, None),
            ):
                group[name] = values * (1e9 if unit == "nm" else 1.0)
                if unit:
                    group[name].attrs["units"] = unit
    curves = df.read_curves(path, phase_convention="lag")
    assert len(curves) == 2 and curves[0].attrs["k"] == 2.7
    np.testing.assert_allclose(curves[1].height, HEIGHT, rtol=1e-12)
    np.testing.assert_allclose(curves[1].phase, LAG)


def small_hdf5(folder):
    path = folder / "curve.h5"
    with h5py.File(path, "w") as file:
        for name, values in (("height", HEIGHT), ("amplitude", AMPLITUDE), ("phase_deg", LAG)):
            file[name] = values
        file["height"].attrs["units"] = file["amplitude"].attrs["units"] = "m"
    return path


def test_hdf5_is_read_in_a_folder_whose_files_have_the_names_of_libraries(workdir):
    for name in ("dforce", "h5py", "numpy"):
        (workdir / f"{name}.py").write_text("raise SystemExit(1)")
    curve = df.read_measured(small_hdf5(workdir), phase_convention="lag")
    np.testing.assert_array_equal(curve.height, HEIGHT)


def test_hdf5_is_not_called_damaged_where_no_process_can_be_started(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    with pytest.raises(df.ResultError, match="the process that checks it could not start"):
        df.read_measured(small_hdf5(tmp_path), phase_convention="lag")


def test_an_approach_of_dforce_is_a_measured_curve(tmp_path):
    case = df.example("figure-3-air").set(
        'experiment.zc={ start = "12 nm", stop = "5 nm", points = 15 }', "experiment.direction=both"
    )
    result = df.run(case)
    df.write(result, tmp_path / "run.nc")
    data = df.read_measured(tmp_path / "run.nc")
    assert data.sizes["point"] == 30 and data.attrs["phase_convention"] == "lag"
    way_in, way_out = (data.where(data.direction == word, drop=True) for word in ("approach", "retract"))
    np.testing.assert_array_equal(way_in.amplitude, result.amplitude.sel(direction="approach", tone=1))
    np.testing.assert_array_equal(way_out.phase, result.phase.sel(direction="retract", tone=1)[::-1])
    with pytest.raises(df.ResultError, match="without amplitude and phase"):
        df.write(df.dwell(case, zc="8 nm"), tmp_path / "dwell.nc")
        df.read_measured(tmp_path / "dwell.nc")


@pytest.mark.parametrize("ending", ["nc", "csv"])
def test_a_calibrated_curve_survives_its_file(tmp_path, ending):
    (tmp_path / "curve.csv").write_text(measured_curve.text())
    data = df.calibrate(
        df.read_measured(tmp_path / "curve.csv", phase_convention="lag"), thermal={"k": "2.0(1) N/m", "Q": 100}
    )
    df.write(data, tmp_path / f"kept.{ending}")
    again = df.read_measured(tmp_path / f"kept.{ending}")
    for name in ("height", "amplitude", "phase"):
        np.testing.assert_array_equal(again[name], data[name])
    assert again.attrs["phase_convention"] == "lag"
    if ending == "nc":
        assert again.attrs["history"] == data.attrs["history"]
        assert again.attrs["amplitude_error"] == data.attrs["amplitude_error"]
        np.testing.assert_array_equal(again.free, data.free)
