"""The program from end to end: a case computed, written, read and repeated."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import xarray as xr
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.results.status import count_status

GRID = 'experiment.zc={ start = "11 nm", stop = "9 nm", points = 5 }'


@pytest.mark.parametrize(
    ("example", "settings"), [("table-1-am", []), ("figure-3-air", ["--set", GRID])], ids=["dwell", "approach"]
)
@pytest.mark.slow
def test_a_result_repeats_its_own_run_to_the_last_bit(tmp_path, monkeypatch, example, settings):
    monkeypatch.chdir(tmp_path)
    first = CliRunner().invoke(app, ["run", example, "--json", "--plot", "figure.png", *settings])
    assert first.exit_code == 0, first.stderr
    found = json.loads(first.stdout)
    again = CliRunner().invoke(app, ["run", found["file"], "-o", "again.nc"])
    assert again.exit_code == 0, again.stderr
    xr.testing.assert_equal(df.read(found["file"]), df.read("again.nc"))
    assert (tmp_path / "figure.png").stat().st_size > 10_000


LOOP = 'experiment.zc={ start = "21 nm", stop = "18 nm", points = 13 }'


@pytest.mark.slow
def test_states_are_drawn_behind_the_curve_where_they_are_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ranges = []
    branches = df.branches

    def noted(case, zc, progress):
        ranges.append(zc)
        return branches(case, zc=zc, progress=progress)

    monkeypatch.setattr(df, "branches", noted)
    for more in ([], ["--states"]):
        name = "states.png" if more else "alone.png"
        done = CliRunner().invoke(app, ["run", "hysteresis", "-o", "x.nc", "--plot", name, "--set", LOOP, *more])
        assert done.exit_code == 0 and "\nstates:" not in "\n" + done.stderr
    assert ranges == [pytest.approx((21e-9, 18e-9))]
    assert Path("states.png").read_bytes() != Path("alone.png").read_bytes()


def test_states_that_are_stopped_leave_the_curve_and_its_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pictures = []
    save = df.plot.save

    def watched(axes, *arguments, **settings):
        pictures.append({line.get_label() for line in axes[0].lines})
        return save(axes, *arguments, **settings)

    def stop(done, total, note):
        raise KeyboardInterrupt

    branches = df.branches
    monkeypatch.setattr(df.plot, "save", watched)
    monkeypatch.setattr(df, "branches", lambda case, zc, progress: branches(case, zc=zc, progress=stop))
    done = CliRunner().invoke(app, ["run", "hysteresis", "-o", "x.nc", "--plot", "x.png", "--states", "--set", LOOP])
    assert done.exit_code == 130 and "the curve is complete, and drawn without them" in done.stderr
    assert count_status(df.read("x.nc")) == {df.Status.OK: 26}
    assert pictures == [{"← approach", "retract →"}]


@pytest.mark.slow
def test_states_that_may_be_missing_are_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["--set", LOOP, "--set", "forces.dmt.surface_energy=10 mJ/m^2"]  # the force then jumps at contact
    done = CliRunner().invoke(app, ["run", "hysteresis", "-o", "x.nc", "--plot", "x.png", "--states", *words])
    assert done.exit_code == 0 and "states: not proven: dmt jumps at" in done.stderr


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["hysteresis"], "--states are drawn in a picture, and none is drawn; give --plot as well"),
        (["table-1-am", "--plot", "x.png"], "--states are drawn behind the curve of an approach, and this experiment is dwell"),
        (["hysteresis", "--plot", "x.png", "--set", 'experiment.zc=["9 nm"]'], "this approach has only one distance"),
    ],
)  # fmt: skip
def test_states_that_cannot_be_drawn_are_refused_before_the_run(tmp_path, monkeypatch, words, sentence):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["run", *words, "--states"])
    assert done.exit_code == 2 and sentence in done.stderr and list(tmp_path.iterdir()) == []
