"""`dforce sweep`: from a case with a table `[sweep]` to a file."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.results.significance import is_none

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

CASE = """
[cantilever]
f0 = "50 kHz"
k = 1.0
Q = 100.0
[drive]
A0 = "8 nm"
[tip]
radius = "5 nm"
[sample]
youngs_modulus = "1 GPa"
[[forces]]
model = "dmt"
hamaker = "3e-20 J"
[experiment]
kind = "approach"
zc = { start = "12 nm", stop = "4 nm", points = 9 }
[sweep]
over = { "sample.youngs_modulus" = { start = "0.5 GPa", stop = "2 GPa", points = 4, spacing = "log" } }
"""


def dforce(*words: str) -> Any:
    return CliRunner().invoke(app, list(words))


@pytest.fixture(autouse=True)
def folder(workdir: Path) -> Path:
    Path("map.toml").write_text(CASE)
    return workdir


def test_a_case_with_a_table_becomes_a_file_and_repeats_itself():
    done = dforce("sweep", "map.toml", "-o", "map.nc", "--keep", "amplitude,phase", "--plot", "map.png", "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["sizes"]["youngs_modulus"] == 4
    assert found["points"] == {"ok": 36}
    assert Path("map.png").stat().st_size > 10_000
    result = df.read("map.nc")
    assert set(result.data_vars) == {"amplitude", "phase", "status"}
    again = dforce("sweep", "map.nc", "-o", "again.nc", "--keep", "amplitude,phase")
    assert again.exit_code == 0, again.output
    xr.testing.assert_equal(result, df.read("again.nc"))
    assert "36 points in" in again.stdout


def test_states_at_a_set_point_are_kept_alone():
    done = dforce(
        "sweep", "map.toml", "-o", "map.nc", "--at-set-point", "0.8", "--keep", "peak_force", "--workers", "1"
    )
    assert done.exit_code == 0, done.output
    kept = df.read("map.nc")
    assert kept.peak_force.dims == ("youngs_modulus", "crossing")
    lines = [line for line in done.stdout.splitlines() if line.startswith("youngs_modulus ")]
    assert len(lines) == np.isfinite(kept.peak_force).sum()
    assert "youngs_modulus 500 MPa, zc " in lines[0]
    again = dforce("sweep", "map.toml", "-o", "map.nc", "--at-set-point", "80 %", "--json")
    states = json.loads(again.stdout)["at_set_point"]
    found = kept.peak_force.values
    assert [state["peak_force"] for state in states] == found[np.isfinite(found)].tolist()
    assert df.summary(df.read("map.nc"))


def test_a_peak_force_below_its_error_is_none_in_the_list_of_states():
    Path("map.toml").write_text(CASE.replace("over = {", 'over = { "forces.dmt.hamaker" = ["1e-22 J", "2e-20 J"],'))
    done = dforce("sweep", "map.toml", "-o", "map.nc", "--at-set-point", "80 %")
    kept = df.read("map.nc")
    none = is_none(kept, "peak_force")[np.isfinite(kept.zc.values)]
    lines = [line for line in done.stdout.splitlines() if line.startswith("hamaker ")]
    assert ["peak_force none" in line for line in lines] == none.tolist()
    assert none.any() and not none.all()


def test_cases_whose_curves_do_not_meet_the_set_point_are_named():
    Path("map.toml").write_text(CASE.replace("over = {", 'over = { "drive.A0" = ["6 nm", "8 nm", "16 nm"],'))
    done = dforce("sweep", "map.toml", "-o", "map.nc", "--at-set-point", "80 %", "--set", "experiment.zc.start=9 nm")
    assert done.exit_code == 0, done.output
    assert "set point not met: A0 = 16 nm, youngs_modulus = 500 MPa;" in done.stdout and "; 1 more\n" in done.stdout
    none = dforce("sweep", "map.toml", "-o", "none.nc", "--at-set-point", "0.1")
    assert "set point not met: A0 = 6 nm" in none.stdout and "9 more\n12 points in" in none.stdout
    assert dforce("check", "none.nc").exit_code == 0


@pytest.mark.parametrize("share", [[], ["--at-set-point", "0.8"]])
def test_the_check_of_a_sweep_repeats_the_advice_of_its_cases_and_makes_none_of_all_together(share):
    Path("map.toml").write_text(CASE.replace("over = {", 'over = { "cantilever.k" = ["0.5 N/m", "2 N/m"],'))
    done = dforce("sweep", "map.toml", "-o", "map.nc", *share)
    assert "dforce check map.nc" in done.stderr
    checked = dforce("check", "map.nc", "--json")
    assert checked.exit_code == 0, checked.output
    carried = json.loads(df.read("map.nc").attrs["advice_pieces"])
    assert [piece["name"] for piece in json.loads(checked.stdout)["advice"]] == [piece["name"] for piece in carried]
    assert not {"step_error", "sampling"} & {piece["name"] for piece in carried}


def test_a_sweep_that_goes_on_claims_no_time_for_points_that_it_did_not_compute():
    for output in ("map.zarr", "map.nc"):
        assert " points in " in dforce("sweep", "map.toml", "-o", output, "--keep", "amplitude").stdout
        again = dforce("sweep", "map.toml", "-o", output, "--keep", "amplitude", "--resume")
        assert again.exit_code == 0 and "nothing was computed" in again.stderr
        assert "36 points, over youngs_modulus 4, zc 9\n" in again.stdout


def test_a_store_is_written_read_and_repeated():
    done = dforce("sweep", "map.toml", "-o", "map.zarr", "--keep", "amplitude,phase", "--plot", "map.png", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["points"] == {"ok": 36}
    again = dforce("sweep", "map.zarr", "-o", "again.nc", "--keep", "amplitude,phase")
    assert again.exit_code == 0, again.output
    np.testing.assert_array_equal(df.read("map.zarr").amplitude, df.read("again.nc").amplitude)
    done = dforce("sweep", "map.toml", "-o", "map.zarr")
    assert done.exit_code == 2
    assert "exists already; continue it" in done.stderr
    done = dforce("run", "map.zarr")
    assert "dforce sweep repeats" in done.stderr


def test_a_store_at_a_url_is_written_read_and_listed(folder):
    url = (folder / "map.zarr").as_uri()
    done = dforce("sweep", "map.toml", "-o", url, "--keep", "amplitude")
    assert done.exit_code == 0, done.output
    assert f"written: {url}" in done.stdout
    assert df.read("map.zarr").status.size == 36
    assert dforce("check", url).exit_code == 0
    again = dforce("sweep", url, "-o", "again.nc", "--keep", "amplitude")
    assert again.exit_code == 0, again.output


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["-o", "map.zarr", "--set", "cantilever.k=2 N/m", "--at-set-point", "0.8"],
            'map.toml --set "cantilever.k=2 N/m" -o map.zarr --at-set-point 0.8 --resume',
        ),
        (
            ["-o", "map.nc", "--at-set-point", "0.8"],
            "with --at-set-point only a store can be continued: write -o OUT.zarr",
        ),
    ],
)
def test_a_sweep_that_was_stopped_says_how_to_go_on(words, sentence, monkeypatch):
    sweep = df.sweep

    def stopped(*given: Any, **settings: Any) -> xr.Dataset:
        return sweep(*given, **settings).assign_attrs(interrupted=1)

    monkeypatch.setattr(df, "sweep", stopped)
    done = dforce("sweep", "map.toml", *words)
    assert done.exit_code == 130
    assert sentence in done.stderr


def test_a_sweep_that_was_stopped_counts_only_the_points_that_are_done(monkeypatch):
    sweep = df.sweep

    def stopped(*given: Any, **settings: Any) -> xr.Dataset:
        result = sweep(*given, **settings)
        result["status"].values.flat[7:] = df.Status.NOT_COMPUTED
        return result.assign_attrs(interrupted=1)

    monkeypatch.setattr(df, "sweep", stopped)
    assert "7 of 36 points in " in dforce("sweep", "map.toml", "-o", "map.nc").stdout


def test_the_command_for_many_cases_is_told_where_one_is_expected():
    done = dforce("run", "map.toml")
    assert done.exit_code == 2
    assert "dforce sweep map.toml -o map.nc" in done.stderr
    assert dforce("sweep", "map.toml", "-o", "map.nc", "--keep", "amplitude").exit_code == 0
    done = dforce("run", "map.nc")
    assert done.exit_code == 2
    assert "dforce sweep repeats" in done.stderr


@pytest.mark.parametrize(
    ("over", "sentence"),
    [
        (
            '{ "cantilever.Q" = [90, 110], "cantilever.modes.1.Q" = [100] }',
            "are the same parameter; list its values once",
        ),
        ('{ "drive.A0" = { start = "1 nm", stop = "9 nm", points = 1_000_000_000 } }', "points = 1000000000 is above"),
    ],
)
def test_a_table_that_cannot_be_meant_is_one_sentence(over, sentence):
    Path("wrong.toml").write_text(CASE.split("over =", maxsplit=1)[0] + f"over = {over}\n")
    for words in (["-o", "x.nc"], ["-o", "x.zarr"]):
        done = dforce("sweep", "wrong.toml", *words)
        assert done.exit_code == 2
        assert sentence in " ".join(done.stderr.split())
        assert not list(Path().glob("x.*"))


def test_a_store_that_another_process_writes_is_one_sentence():
    held = "import sys; from dforce.results.store_writer import Writer\nwith Writer('map.zarr'): print(flush=True); "
    held += "sys.stdin.read()"
    with subprocess.Popen([sys.executable, "-c", held], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline()
        done = dforce("sweep", "map.toml", "-o", "map.zarr")
        assert done.exit_code == 2
        assert done.stderr == "dforce: the store 'map.zarr' is open in another run\n"
        other.kill()  # and a lock that a killed process leaves behind holds nobody up
    assert dforce("sweep", "map.toml", "-o", "map.zarr", "--keep", "amplitude").exit_code == 0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["figure-3-air", "-o", "x.nc"], "has no table [sweep]"),
        (["map.toml", "-o", "x.txt"], "use a name ending in"),
        (["map.toml", "-o", "x.nc", "--workers", "0"], "--workers is '0'"),
        (["map.toml", "-o", "x.nc", "--at-set-point", "high"], "not a number"),
        (["map.toml", "-o", "x.nc", "--keep", "amplitud"], "did you mean 'amplitude'"),
        (["map.toml", "-o", "x.nc", "--resume"], "there is no file 'x.nc'"),
        (["map.toml"], "missing option"),
    ],
)
def test_a_mistake_is_one_sentence(words, sentence):
    done = dforce("sweep", *words)
    assert done.exit_code == 2
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1
