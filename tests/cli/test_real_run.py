"""The program from end to end: a case computed, written, read and repeated."""

from __future__ import annotations

import json

import pytest
import xarray as xr
from typer.testing import CliRunner

import dforce as df
from dforce.cli import app

GRID = 'experiment.zc={ start = "11 nm", stop = "9 nm", points = 5 }'


@pytest.mark.parametrize(
    ("example", "settings"),
    [("table-1-am", []), ("figure-3-air", ["--set", GRID])],
    ids=["dwell", "approach"],
)
def test_a_result_repeats_its_own_run_to_the_last_bit(tmp_path, monkeypatch, example, settings):
    monkeypatch.chdir(tmp_path)
    first = CliRunner().invoke(app, ["run", example, "--json", "--plot", "figure.png", *settings])
    assert first.exit_code == 0, first.stderr
    found = json.loads(first.stdout)
    again = CliRunner().invoke(app, ["run", found["file"], "-o", "again.nc"])
    assert again.exit_code == 0, again.stderr
    xr.testing.assert_equal(df.read(found["file"]), df.read("again.nc"))
    assert (tmp_path / "figure.png").stat().st_size > 10_000
