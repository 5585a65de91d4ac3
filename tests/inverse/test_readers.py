"""Readers of measured files: what a reader knows of its maker stands in its record, and what it does not is asked."""

import importlib.util
import re
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import files
import h5py
import measured_curve
import numpy as np
import pytest
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.core import entries
from dforce.inverse import readers
from dforce.inverse.placing import HEIGHTS
from dforce.inverse.readers import nanosurf
from dforce.inverse.table import Reader

HEIGHT, AMPLITUDE, LAG = measured_curve.numbers()
CONTRIBUTING = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")


@pytest.fixture
def nimbus(tmp_path, monkeypatch):
    """Add the reader that CONTRIBUTING shows, and return the path of a file of its maker."""
    [written] = [block for block in re.findall(r"```python\n(.*?)```", CONTRIBUTING, re.DOTALL) if "READER" in block]
    file = tmp_path / "nimbus.py"
    file.write_text(written, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("dforce.inverse.readers.nimbus", file)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    monkeypatch.setattr(readers, "READERS", [*readers.READERS, module.READER])
    curve = tmp_path / "curve.nim"
    curve.write_bytes(module.START + np.stack([-1e9 * HEIGHT, 1e9 * AMPLITUDE, LAG]).astype("<f4").tobytes())
    return curve


def test_the_reader_of_contributing_is_one_file_and_turns_the_heights_of_its_maker(nimbus):
    data = df.read_measured(nimbus, phase_convention="lag")
    np.testing.assert_allclose(data.height, HEIGHT, rtol=1e-6)  # 32-bit numbers
    np.testing.assert_allclose(data.amplitude, AMPLITUDE, rtol=1e-6)
    assert any("nearer to the sample, as in files of Nimbus" in line for line in data.attrs["history"])
    assert data.attrs["instrument"] == "Nimbus"


def test_a_cut_file_of_the_reader_of_contributing_is_one_sentence(nimbus):
    nimbus.write_bytes(nimbus.read_bytes()[:-1])
    with pytest.raises(df.ResultError, match=r"curve.nim' was cut short$"):
        df.read_measured(nimbus)


def test_window_and_help_find_the_reader_of_contributing(nimbus):
    uploads = pytest.importorskip("dforce.gui.files.uploads")
    assert ".nim" in readers.endings()
    assert uploads.kind_of(nimbus.read_bytes(), "curve.nim") == "measured"
    assert "Nimbus .nim" in readers.in_words()


def test_the_help_lists_every_reader():
    shown = re.sub(r"\s+", " ", CliRunner().invoke(app, ["read", "--help"]).output)
    missing = [one.kind for one in readers.READERS if one.kind not in shown]
    assert not missing


def test_every_record_is_complete():
    for one in readers.READERS:
        assert one.how and one.seen and one.endings, one
        assert set(one.height_grows) <= set(HEIGHTS) and set(one.height_grows.values()) <= {"toward", "away"}
        assert all(ending == ending.lower() and ending.startswith(".") for ending in one.endings)


def test_each_file_of_the_folder_is_a_reader():
    folder = Path(readers.__file__).parent
    names = {file.stem for file in folder.glob("*.py") if not file.name.startswith("_")}
    assert {one.read.__module__.rpartition(".")[2] for one in readers.READERS} <= names
    assert len(names) == len(readers.READERS)


def test_readers_of_other_packages_are_found_and_what_is_none_is_left_out(monkeypatch):
    def points(group):
        values = {"good": "dforce.inverse.readers.nanosurf:READER", "bad": "dforce.inverse.readers.nanosurf:read"}
        return [EntryPoint(name, value, group) for name, value in values.items()]

    said = []
    monkeypatch.setattr(entries.importlib.metadata, "entry_points", points)
    monkeypatch.setattr(entries.log, "announce", said.append)
    assert entries.loaded("dforce.readers", Reader, "reader") == [nanosurf.READER]
    assert said == [
        "The reader 'bad' (dforce.inverse.readers.nanosurf:read) cannot be loaded: TypeError: it is no Reader"
    ]


def table(tmp_path, heights, amplitudes, heading="height_nm,amplitude_nm,phase_deg"):
    path = tmp_path / "curve.csv"
    rows = np.stack([1e9 * heights, 1e9 * amplitudes, LAG], axis=1)
    np.savetxt(path, rows, delimiter=",", header=heading, comments="", fmt="%.5f")
    return path


def test_a_curve_that_does_not_show_where_the_sample_is_asks_for_the_sign(tmp_path):
    path = table(tmp_path, HEIGHT, np.full_like(AMPLITUDE, AMPLITUDE.max()))
    with pytest.raises(df.ParameterError, match=r"does not show the side of the sample.* height_grows = 'toward'"):
        df.read_measured(path, phase_convention="lag")
    away = df.read_measured(path, phase_convention="lag", height_grows="away")
    toward = df.read_measured(path, phase_convention="lag", height_grows="toward")
    np.testing.assert_allclose(np.sort(away.height), np.sort(-toward.height))


def test_a_curve_that_shows_where_the_sample_is_says_so(tmp_path):
    said = df.read_measured(table(tmp_path, HEIGHT, AMPLITUDE), phase_convention="lag").attrs["history"]
    assert "height: larger numbers are farther from the sample, as the amplitude falls toward smaller ones" in said


def test_a_height_whose_name_says_that_it_is_above_the_sample_needs_no_sign(tmp_path):
    flat = np.full_like(AMPLITUDE, AMPLITUDE.max())
    path = table(tmp_path, HEIGHT, flat, "zc (nm),amplitude_nm,phase_deg")
    np.testing.assert_allclose(df.read_measured(path, phase_convention="lag").height, HEIGHT, atol=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_frequency_shift_upside_down_is_refused(tmp_path, sign):
    path = tmp_path / "curve.csv"
    rows = [f"{sign * 1e9 * h:.4f},{-50 * np.exp(-1e9 * (h - HEIGHT.min()) / 5):.5f}" for h in HEIGHT]
    path.write_text("\n".join(["z (nm),df (Hz)", *rows, ""]))
    if sign > 0.0:
        assert df.read_measured(path).height.values[0] == pytest.approx(HEIGHT.max(), abs=1e-13)
    else:
        with pytest.raises(df.ParameterError, match="larger frequency shifts at larger heights"):
            df.read_measured(path)


def test_a_height_that_the_user_names_keeps_the_sign_of_its_maker(tmp_path):
    flat = np.full_like(AMPLITUDE, AMPLITUDE.max())
    wave = tmp_path / "curve.ibw"
    wave.write_bytes(files.igor_wave({"Amp": flat, "Phase": LAG, "ZSnsr": -HEIGHT}, ""))
    data = df.read_measured(wave, columns={"height": "ZSnsr"}, phase_convention="lag")
    np.testing.assert_allclose(data.height, HEIGHT, rtol=1e-6)  # single precision


def test_a_height_of_a_maker_under_an_unknown_name_is_not_guessed(tmp_path):
    flat = np.full_like(AMPLITUDE, AMPLITUDE.max())
    wave = tmp_path / "curve.ibw"
    wave.write_bytes(files.igor_wave({"Amp": flat, "Phase": LAG, "LVDT": -HEIGHT}, ""))
    with pytest.raises(df.ParameterError, match="sign of its heights is unknown"):
        df.read_measured(wave, columns={"height": "LVDT"}, units={"height": "m"}, phase_convention="lag")


def test_hdf5_is_looked_at_by_one_process(tmp_path, monkeypatch):
    import subprocess

    reading = pytest.importorskip("dforce.gui.measured.reading")
    started, run = [], subprocess.run
    monkeypatch.setattr(subprocess, "run", lambda *command, **how: started.append(command) or run(*command, **how))
    path = tmp_path / "curve.h5"
    with h5py.File(path, "w") as file:
        for name, values in (("height", HEIGHT), ("amplitude", AMPLITUDE), ("phase", LAG)):
            file.create_dataset(name, data=values).attrs["units"] = "deg" if name == "phase" else "m"
    reading.curve_from(path.read_bytes(), "curve.h5", {"phase_convention": "lag"}, None, tmp_path / "there")
    assert len(started) == 1
