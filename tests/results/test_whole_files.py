"""Files on a full disk, damaged, with odd names, or left by a killed process: one sentence, and nothing is lost."""

from __future__ import annotations

import csv
import io
import os
import random
import re
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic
import xarray as xr

import dforce as df
from dforce.core import files
from dforce.core.errors import CaseError, ResultError
from dforce.results.files import SEAL_LENGTH

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

HERE = str(Path(synthetic.__file__).parent)
POSIX = pytest.mark.skipif(os.name != "posix", reason="limits, locks and signals of POSIX")


def child(code, *words):
    """Run Python beside the tests' helpers."""
    # a module that is first imported on a full disk would be kept cut short
    start = f"import sys; sys.dont_write_bytecode = True; sys.path.insert(0, {HERE!r})\n"
    return subprocess.run([sys.executable, "-c", start + code, *map(str, words)], capture_output=True, text=True)


FULL = """
import gc, resource
import numpy as np, xarray as xr
import dforce as df, synthetic
large = xr.Dataset({"a": ("x", np.arange(40_000.0))})
small = synthetic.approach(spoiled=False)
axes = df.plot.overview(small)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
for name in ("out.nc", "out.csv", "again.nc"):
    try:
        df.write(large, f"{sys.argv[1]}/{name}")
    except df.ResultError as error:
        print(error)
for name in ("figure.png", "figure.pdf", "figure.svg"):
    try:
        df.plot.save(axes, f"{sys.argv[1]}/{name}")
    except df.ResultError as error:
        print(error)
resource.setrlimit(resource.RLIMIT_FSIZE, (300, 20_000))
try:
    df.save_case(df.example("figure-2"), f"{sys.argv[1]}/case.toml")
except df.CaseError as error:
    print(error)
gc.collect()
print("still here")
"""


@POSIX
def test_a_full_disk_is_one_sentence_a_file_and_the_process_lives_on(tmp_path):
    (tmp_path / "again.nc").write_text("old")
    done = child(FULL, tmp_path)
    assert done.returncode == 0, done.stderr
    *sentences, last = done.stdout.splitlines()
    assert last == "still here" and len(sentences) >= 5
    assert all(re.fullmatch("'.*' could not be written: file too large", sentence) for sentence in sentences)
    assert "Traceback" not in done.stderr
    assert (tmp_path / "again.nc").read_text() == "old"
    assert not list(tmp_path.glob(".dforce-*"))


@POSIX
def test_the_command_on_a_full_disk_says_so_in_one_sentence(tmp_path):
    code = (
        "import resource; import dforce as df, synthetic; from dforce.cli import main\n"
        "df.run = lambda *_, **__: synthetic.approach()\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
        "sys.argv = ['dforce', 'run', 'figure-3-air', '-o', sys.argv[1]]\n"
        "main()"
    )
    done = child(code, tmp_path / "out.nc")
    assert done.returncode == 2
    said = " ".join(done.stderr.split())  # a long name of the folder is wrapped
    assert said.endswith("could not be written: file too large") and said.count("dforce:") == 1
    assert list(tmp_path.iterdir()) == []


def damaged(content):
    """Give copies of a file that were cut, flipped or blanked in places drawn by chance, before the hash at its end."""
    chance, end = random.Random(1), len(content) - SEAL_LENGTH
    for _ in range(20):
        yield content[: chance.randrange(end)]
        flipped = bytearray(content)
        for _ in range(chance.choice([1, 3, 30])):
            flipped[chance.randrange(end)] ^= 1 << chance.randrange(8)
        yield bytes(flipped)
        start, size = chance.randrange(end - 4096), chance.choice([16, 512, 4096])
        yield content[:start] + bytes(len(content[start : start + size])) + content[start + size :]


READ_ALL = """
import gc
import dforce as df
for path in sys.argv[1:]:
    for read in (df.read, df.load_case):
        try:
            read(path)
            print("read")
        except df.DForceError as error:
            print(error)
gc.collect()
"""


def test_a_damaged_file_is_found_before_its_numbers_are_used_and_nothing_else_is_printed(tmp_path):
    content = df.write(synthetic.approach(), tmp_path / "good.nc").read_bytes()
    paths = []
    for number, bad in enumerate(damaged(content)):
        paths.append(tmp_path / f"{number}.nc")
        paths[-1].write_bytes(bad)
    done = child(READ_ALL, *paths)
    assert done.returncode == 0 and done.stderr == ""
    answers = done.stdout.splitlines()
    assert len(answers) == 2 * len(paths)
    for path, *two in zip(paths, answers[::2], answers[1::2], strict=True):
        same = path.read_bytes() == content  # zeros over zeros
        expected = (
            {"read"} if same else {"damaged", "empty", "not a netCDF file", "not a file of results", "is not a case"}
        )
        assert all(any(word in answer for word in expected) for answer in two), two


def test_a_damaged_file_of_another_program_is_one_sentence_and_nothing_else(tmp_path):
    """Without the hash at its end: the attributes lie in the heap at the end of the file."""
    plain = io.BytesIO(df.write(synthetic.approach(), tmp_path / "good.nc").read_bytes())
    with h5py.File(plain, "r+") as file:
        file.attrs["history"] = "changed"
    content = plain.getvalue()
    assert content[-200:] != (tmp_path / "good.nc").read_bytes()[-200:]
    (tmp_path / "whole.nc").write_bytes(content)
    assert df.read(tmp_path / "whole.nc").attrs["history"] == "changed"
    paths = []
    for place in (b"FRHP", b"FHDB", b"BTHD"):  # signatures of HDF5's heaps and trees
        paths.append(tmp_path / f"without {place.decode()}.nc")
        paths[-1].write_bytes(content.replace(place, b"\0\0\0\0"))
    done = child(READ_ALL, *paths)
    answers = done.stdout.splitlines()[::2]
    assert done.stderr == "" and len(answers) == len(paths)
    assert all(answer.endswith("is damaged or was cut short") for answer in answers), answers


def test_other_programs_read_the_file_as_netcdf(tmp_path):
    path = df.write(synthetic.approach(), tmp_path / "out.nc")
    with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as opened:
        np.testing.assert_array_equal(opened.amplitude, synthetic.approach().amplitude)
    with h5py.File(path) as opened:
        assert opened.attrs["title"] == synthetic.approach().attrs["title"]


WRITER = """
import os, signal, time
import dforce as df, synthetic
def wait(*_):
    print("writing", flush=True)
    time.sleep(60)
os.fsync = wait
df.write(synthetic.dwell(), sys.argv[1])
"""


@POSIX
def test_what_a_killed_writer_left_goes_at_the_next_write_and_nothing_else_does(tmp_path):
    code = f"import sys; sys.path.insert(0, {HERE!r})\n" + WRITER
    command = [sys.executable, "-c", code]
    killed, living = (
        subprocess.Popen([*command, str(tmp_path / name)], stdout=subprocess.PIPE) for name in ("a.nc", "b.nc")
    )
    try:
        for process in (killed, living):
            assert process.stdout.readline() == b"writing\n"
        killed.send_signal(signal.SIGKILL)
        killed.wait()
        mine = [tmp_path / ".dforce-notes.tmp", tmp_path / ".dforce-0123456789abcdef.tmp.txt"]
        for path in mine:
            path.write_text("mine")
            os.utime(path, (1, 1))
        assert len(list(tmp_path.glob(".dforce-*.tmp"))) == 3
        df.write(synthetic.dwell(), tmp_path / "c.nc")
        assert all(path.exists() for path in mine)
        assert len(list(tmp_path.glob(".dforce-*.tmp"))) == 2  # one is being written
    finally:
        for process in (killed, living):
            process.kill()
            process.communicate()


@POSIX
def test_where_locks_do_not_tell_only_old_files_go(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "_lock", lambda file: None)
    old, young = (tmp_path / f".dforce-{digit * 16}.tmp" for digit in "01")
    for path in (old, young):
        path.write_text("left")
    age = old.stat().st_mtime - 2.0 * files.ABANDONED
    os.utime(old, (age, age))
    df.write(synthetic.dwell(), tmp_path / "c.nc")
    assert not old.exists() and young.exists()


@POSIX
def test_a_temporary_file_taken_for_abandoned_in_its_first_moment_is_made_again(tmp_path, monkeypatch):
    real, taken = files._lock, []

    def lock(file):
        if not taken:
            taken.append(file.name)
            Path(file.name).unlink()  # as another process would
        return real(file)

    monkeypatch.setattr(files, "_lock", lock)
    assert df.read(df.write(synthetic.dwell(), tmp_path / "c.nc")).attrs["title"] == "Synthetic dwell"
    assert taken


LONG = "x" * 300


@pytest.mark.parametrize(
    "use",
    [
        lambda: df.write(synthetic.dwell(), f"{LONG}.nc"),
        lambda: df.read(f"{LONG}.nc"),
        lambda: df.load_case(f"{LONG}.toml"),
        lambda: df.save_case(df.example("figure-2"), f"{LONG}.toml"),
        lambda: df.write(synthetic.dwell(), "a\0b.nc"),
        lambda: df.read("a\0b.nc"),
        lambda: df.load_case("a\0b.toml"),
    ],
)
def test_a_name_that_the_system_refuses_is_one_sentence(workdir, use):
    with pytest.raises((ResultError, CaseError), match=r"too long|null byte|there is no file") as caught:
        use()
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300
    assert list(workdir.iterdir()) == []


FORMULA = re.compile(r"""[\s"]*[=+@＝＋－＠-]""")
NUMBER = re.compile(r"""\s*[+-]?[\d.]+(e[+-]?\d+)?( [\w/^µ°%]+)?[\s"'\]})]*""", re.IGNORECASE)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_no_cell_of_a_table_is_a_formula(tmp_path, separator):
    """A spreadsheet splits the comment lines, too; a number with its unit can do nothing there."""
    evil = [f"x{separator}{word}" for word in ("=HYPERLINK(1)", " +1+cmd|' /C calc'!A0", '"@SUM(1)"', "-2+3", "＝1+1")]
    dataset = synthetic.approach().assign_attrs(title=evil[0], case="\n".join(["a = [1, -2]", *evil]), note=evil[1])
    dataset["note"] = ("zc", np.array(["=1+1"] * dataset.sizes["zc"]))
    dataset = dataset.rename(peak_force="=cmd()")
    lines = df.write(dataset, tmp_path / "out.csv").read_text("utf-8").splitlines()
    assert any("HYPERLINK" in line for line in lines)
    for row in csv.reader(lines, delimiter=separator):
        for cell in row:
            assert not FORMULA.match(cell) or NUMBER.fullmatch(cell), cell
    assert "# a = [1, -2]" in lines  # numbers stay as they are
