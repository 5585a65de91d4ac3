"""Files of results: whole or not at all, and back without loss."""

from __future__ import annotations

import csv
import os
import stat
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pandas
import pytest
import synthetic
import xarray as xr

from dforce.core import files
from dforce.core.errors import ResultError
from dforce.results import dataset
from dforce.results.dataset import describe
from dforce.results.files import read, write
from dforce.results.status import Status

READ = 5e-16  # the table is exact; the fast number reader of pandas may miss the last binary digit or two


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("make", [synthetic.approach, synthetic.dwell, synthetic.force_curve])
def test_netcdf_gives_back_every_number_word_and_attribute(tmp_path, make):
    dataset = make()
    back = read(write(dataset, tmp_path / "out.nc"))
    xr.testing.assert_identical(back, dataset)
    assert {k: type(v) for k, v in back.attrs.items()} == {k: type(v) for k, v in dataset.attrs.items()}
    for name, variable in dataset.variables.items():
        assert back[name].dtype.kind == variable.dtype.kind


def test_netcdf_keeps_awkward_attributes(tmp_path):
    dataset = synthetic.dwell()
    awkward = {"yes": True, "no": False, "empty": "", "unicode": "Å, ° und 中", "lines": "a\nb\n", "many": 2**40}
    awkward["long"] = "x" * 1_000_000  # HDF5 holds only 64 kB in an attribute itself
    dataset.attrs.update(awkward)
    back = read(write(dataset, tmp_path / "out.nc"))
    assert {key: back.attrs[key] for key in awkward} == awkward
    assert back.attrs["yes"] is True and back.attrs["no"] is False
    xr.testing.assert_identical(read(write(back, tmp_path / "again.nc")), back)


def test_netcdf_gives_back_states_that_have_no_version(tmp_path):
    states = synthetic.approach().isel(zc=[3]).drop_attrs(deep=False)
    xr.testing.assert_identical(read(write(states, tmp_path / "states.nc")), states)


def test_netcdf_holds_booleans_text_and_no_value(tmp_path):
    dataset = synthetic.approach()
    dataset["tried"] = ("zc", np.arange(dataset.sizes["zc"]) % 2 == 0)
    dataset["note"] = ("zc", np.array([f"point {i}" for i in range(dataset.sizes["zc"])]))
    back = read(write(dataset, tmp_path / "out.nc"))
    assert back["tried"].dtype == bool and back["note"].dtype.kind == "U"
    xr.testing.assert_identical(back, dataset)


def test_a_zero_byte_in_a_title_does_not_stop_the_writing(tmp_path):
    dataset = synthetic.dwell().assign_attrs(title="a\0b")
    assert read(write(dataset, tmp_path / "out.nc")).attrs["title"] == "a\N{REPLACEMENT CHARACTER}b"


def test_table_of_an_approach_has_a_row_for_each_distance_and_direction(tmp_path):
    dataset = synthetic.approach(tones=2)
    path = write(dataset, tmp_path / "out.csv")
    table = pandas.read_csv(path, comment="#")
    assert len(table) == 2 * dataset.sizes["zc"]
    assert {"zc (m)", "direction", "amplitude_tone1 (m)", "phase_tone2 (degree)"} <= set(table)
    assert {"peak_force (N)", "virial_mode1 (J)", "status"} <= set(table)
    for direction in ("approach", "retract"):
        rows = table[table["direction"] == direction]
        wanted = dataset.sel(direction=direction)
        np.testing.assert_allclose(rows["zc (m)"], wanted.zc, rtol=READ)
        np.testing.assert_allclose(rows["amplitude_tone2 (m)"], wanted.amplitude.sel(tone=2), rtol=READ)
    assert table["status"].value_counts().to_dict() == {"ok": 219, "not_settled": 2, "failed": 1}


def test_the_motion_from_which_a_run_goes_on_is_left_out_of_a_table(tmp_path):
    dataset = synthetic.approach()
    alone = write(dataset, tmp_path / "alone.csv").read_bytes()
    motion = np.zeros((dataset.sizes["direction"], dataset.sizes["zc"], 2))
    dataset["motion"] = ("direction", "zc", "component"), motion
    coords = {"component": ["z_1", "v_1"], "component_units": ("component", ["m", "m/s"])}
    assert write(dataset.assign_coords(coords), tmp_path / "whole.csv").read_bytes() == alone


def test_table_of_a_dwell_holds_traces_spectrum_and_numbers(tmp_path):
    dataset = synthetic.dwell()
    path = write(dataset, tmp_path / "out.csv")
    table = pandas.read_csv(path, comment="#")
    np.testing.assert_allclose(table["force (N)"], dataset.force, rtol=READ)
    np.testing.assert_allclose(table["mode_deflection_mode1 (m)"], dataset.deflection, rtol=READ)
    np.testing.assert_allclose(table["spectrum (m)"].dropna(), dataset.spectrum, rtol=READ)
    header = [line for line in path.read_text("utf-8").splitlines() if line.startswith("#")]
    assert f"# amplitude_tone1 (m) = {4.05e-9!r}" in header
    assert "# status = ok" in header
    assert '# title = "Synthetic, in air"' in header  # the case


def test_table_without_traces_is_one_row(tmp_path):
    dataset = synthetic.dwell().drop_dims(["time", "frequency"])
    table = pandas.read_csv(write(dataset, tmp_path / "out.csv"), comment="#")
    assert len(table) == 1 and table["zc (m)"][0] == 4e-9


def test_jumps_of_a_sweep_are_columns_of_its_table(tmp_path):
    sweep = xr.concat([synthetic.approach().isel(direction=0, drop=True)] * 2, xr.Variable("Q", [100.0, 200.0]))
    sweep["jump_zc"] = ("Q", "jump"), np.array([[4e-9, 3e-9], [5e-9, np.nan]]), {"units": "m"}
    table = pandas.read_csv(write(sweep, tmp_path / "out.csv"), comment="#")
    assert len(table) == sweep.sizes["Q"] * sweep.sizes["zc"]
    of_second = table[table["Q"] == 200.0]
    assert (of_second["jump_zc_jump1 (m)"] == 5e-9).all() and of_second["jump_zc_jump2 (m)"].isna().all()


def test_table_is_as_in_rfc_4180(tmp_path):
    dataset = synthetic.approach()
    dataset["note"] = ("zc", np.array(['a "word", and more'] * dataset.sizes["zc"]))
    raw = write(dataset, tmp_path / "out.csv").read_bytes()
    assert raw.count(b"\n") == raw.count(b"\r\n")
    lines = raw.decode("utf-8").split("\r\n")
    rows = list(csv.reader(line for line in lines if line and not line.startswith("#")))
    assert len({len(row) for row in rows}) == 1
    assert rows[1][rows[0].index("note")] == 'a "word", and more'


def test_a_line_break_in_a_title_stays_inside_the_comment(tmp_path):
    dataset = synthetic.approach().assign_attrs(title="one\ntwo\r\nthree")
    table = pandas.read_csv(write(dataset, tmp_path / "out.csv"), comment="#")
    assert table.columns[0] == "zc (m)"


@pytest.mark.parametrize("name", ["out.nc", "out.csv"])
def test_a_failure_while_writing_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, name):
    path = tmp_path / name
    path.write_text("old")

    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(files.os, "fsync", stopped)
    with pytest.raises(KeyboardInterrupt):
        write(synthetic.dwell(), path)
    assert names(tmp_path) == [name] and path.read_text() == "old"


def test_a_full_disk_is_one_sentence_and_leaves_nothing(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full)
    with pytest.raises(ResultError, match="could not be written: no space left on device"):
        write(synthetic.dwell(), tmp_path / "out.nc")
    assert names(tmp_path) == []


@pytest.mark.parametrize("times", [2, 9])
def test_a_file_that_another_program_holds_is_tried_again_and_then_named(tmp_path, monkeypatch, times):
    path, left, replace = tmp_path / "out.csv", [*range(times)], Path.replace
    path.write_text("old")

    def held(self, target):
        if left:
            left.pop()
            raise PermissionError(13, "Access is denied")  # as on Windows
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", held)
    if times > 2:
        with pytest.raises(ResultError, match="could not be written: access is denied; close it in other programs"):
            write(synthetic.dwell(), path)
        assert path.read_text() == "old"
    else:
        write(synthetic.dwell(), path)
        assert path.read_text().startswith("# Synthetic dwell")
    assert names(tmp_path) == ["out.csv"]


@pytest.mark.skipif(os.name != "posix", reason="file modes and links of POSIX")
def test_a_replaced_file_keeps_its_mode_and_a_link_stays_a_link(tmp_path):
    real, link = tmp_path / "real.nc", tmp_path / "link.nc"
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to(real)
    write(synthetic.dwell(), link)
    assert link.is_symlink() and stat.S_IMODE(real.stat().st_mode) == 0o640
    assert read(real).attrs["title"] == "Synthetic dwell"


def test_a_file_is_not_replaced_when_overwriting_is_off(tmp_path):
    path = tmp_path / "out.csv"
    path.write_text("old")
    with pytest.raises(FileExistsError):
        write(synthetic.dwell(), path, overwrite=False)
    assert path.read_text() == "old" and names(tmp_path) == ["out.csv"]
    write(synthetic.dwell(), tmp_path / "new.csv", overwrite=False)
    assert names(tmp_path) == ["new.csv", "out.csv"]


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("out.xlsx", r"ends in '.xlsx'; use a name ending in .nc, .csv"),
        ("out", r"has no ending"),
        ("", r"the name of the file to write is empty; use a name ending in .nc, .csv"),
        ("no/such/out.nc", r"there is no folder"),
        ("folder.nc", r"it is not a file"),
    ],
)
def test_a_place_that_cannot_be_written_is_one_sentence(tmp_path, name, sentence):
    (tmp_path / "folder.nc").mkdir()
    with pytest.raises(ResultError, match=sentence):
        write(synthetic.dwell(), name and tmp_path / name)
    assert names(tmp_path) == ["folder.nc"]


def _not_written_by_dforce(path):
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(path, engine="h5netcdf")


def _plain_hdf5(path):
    with h5py.File(path, "w") as file:
        file["x"] = [1, 2, 3]


def _cut(share):
    def make(path):
        write(synthetic.dwell(), path)
        content = path.read_bytes()
        path.write_bytes(content[: int(len(content) * share)])

    return make


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda path: None, "there is no file"),
        (lambda path: path.mkdir(), "is a folder, not a file"),
        (lambda path: path.write_bytes(b""), "is empty"),
        (lambda path: path.write_text("a,b\n1,2\n"), "is not a netCDF file"),
        (lambda path: path.write_bytes(b"CDF\x01" + bytes(40)), "netCDF-3"),
        (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(40)), "is damaged or was cut short"),
        (_cut(0.01), "is damaged or was cut short"),
        (_cut(0.5), "is damaged or was cut short"),
        (_cut(0.99), "is damaged or was cut short"),
        (_not_written_by_dforce, "is not a file of dForce"),
        (_plain_hdf5, "is not a file of dForce"),
    ],
)
def test_a_file_that_is_no_result_is_one_sentence(tmp_path, make, sentence):
    path = tmp_path / "out.nc"
    make(path)
    with pytest.raises(ResultError, match=sentence) as caught:
        read(path)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
@pytest.mark.slow
def test_a_process_killed_while_writing_leaves_the_old_file(tmp_path):
    path = tmp_path / "out.nc"
    write(synthetic.dwell(), path)
    old = path.read_bytes()
    code = (
        "import os, signal, sys; sys.path.insert(0, sys.argv[1])\n"
        "import synthetic; from dforce.results import files as results\n"
        "os.fsync = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
        "results.write(synthetic.approach(), sys.argv[2])\n"
    )
    here = str(Path(synthetic.__file__).parent)
    done = subprocess.run([sys.executable, "-c", code, here, str(path)], check=False)
    assert done.returncode < 0 and path.read_bytes() == old


def test_every_status_has_a_flag_a_word_and_a_sentence():
    attrs = synthetic.approach().status.attrs
    assert attrs["flag_values"].tolist() == [s.value for s in Status]
    assert attrs["flag_meanings"].split() == [s.meaning for s in Status]
    assert attrs["flag_sentences"].split("\n") == [s.sentence for s in Status]
    assert all(s.sentence and Status(s.value) is s for s in Status)


def test_variables_say_their_unit_name_and_symbol():
    dataset = describe(xr.Dataset({"peak_force": 1e-10, "deflection": ("time", [0.0])}, {"time": [0.0]}))
    assert dataset.peak_force.attrs["units"] == "N" and dataset.time.attrs["units"] == "s"
    assert dataset.deflection.attrs["symbol"] == "z" and dataset.deflection.attrs["long_name"] == "deflection"


@pytest.mark.parametrize(
    ("size", "unit", "name", "shown"),
    [
        (4e-9, "m", "", "nm"), (14e-12, "m", "", "pm"), (2e-10, "N", "", "pN"), (1e-9, "N", "", "nN"),
        (48.9e3, "Hz", "", "kHz"), (1.4e-4, "m/s", "", "µm/s"), (2e-6, "s", "", "µs"), (3e-15, "W", "", "fW"),
        (0.0, "J", "", "eV"), (1e-21, "J", "", "meV"), (3.4e-19, "J", "", "eV"), (1e-15, "J", "", "fJ"),
        (0.1, "1", "contact_fraction", "%"), (90.0, "degree", "", "°"),
    ],
)  # fmt: skip
def test_the_unit_suits_the_reader(size, unit, name, shown):
    assert dataset.unit_for(size, unit, name)[1] == shown


def test_the_scale_of_a_readers_unit_is_right():
    assert 1.602176634e-19 / dataset.unit_for(1.602176634e-19, "J")[0] == pytest.approx(1.0)
    assert dataset.reader_unit(synthetic.dwell().velocity) == (pytest.approx(1e-3), "mm/s")
