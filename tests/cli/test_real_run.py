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
def test_a_result_repeats_its_own_run_to_the_last_bit(workdir, example, settings):
    first = CliRunner().invoke(app, ["run", example, "--json", "--plot", "figure.png", *settings])
    assert first.exit_code == 0, first.stderr
    found = json.loads(first.stdout)
    again = CliRunner().invoke(app, ["run", found["file"], "-o", "again.nc"])
    assert again.exit_code == 0, again.stderr
    xr.testing.assert_equal(df.read(found["file"]), df.read("again.nc"))
    assert (workdir / "figure.png").stat().st_size > 10_000


LOOP = 'experiment.zc={ start = "21 nm", stop = "18 nm", points = 13 }'


@pytest.mark.slow
def test_states_are_drawn_behind_the_curve_where_they_are_asked_for(workdir, monkeypatch):
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


def test_states_that_are_stopped_leave_the_curve_and_its_picture(workdir, monkeypatch):
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
def test_states_that_may_be_missing_are_told(workdir):
    words = ["--set", LOOP, "--set", "forces.dmt.surface_energy=10 mJ/m^2"]  # the force then jumps at contact
    done = CliRunner().invoke(app, ["run", "hysteresis", "-o", "x.nc", "--plot", "x.png", "--states", *words])
    assert done.exit_code == 0 and "states: not proven: dmt jumps at" in done.stderr


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["hysteresis"], "--states needs a picture; also write --plot"),
        (["table-1-am", "--plot", "x.png"], "--states needs the curve of an approach; this experiment is dwell"),
        (["hysteresis", "--plot", "x.png", "--set", 'experiment.zc=["9 nm"]'], "this approach has only one distance"),
    ],
)  # fmt: skip
def test_states_that_cannot_be_drawn_are_refused_before_the_run(workdir, words, sentence):
    done = CliRunner().invoke(app, ["run", *words, "--states"])
    assert done.exit_code == 2 and sentence in done.stderr and list(workdir.iterdir()) == []


LEVER = """
cantilever = { f0 = "50 kHz", k = 1.0, Q = 100 }
drive = { A0 = "8 nm" }
tip = { radius = "5 nm" }
sample = { youngs_modulus = "1 GPa" }
forces = [{ model = "dmt", hamaker = "3e-20 J" }]
"""


def at_set_point(shares, *more, text=LEVER):
    """Run a case at set points."""
    Path("case.toml").write_text(text, encoding="utf-8")
    asked = [] if shares is None else ["--at-set-point", shares]
    return CliRunner().invoke(app, ["run", "case.toml", "-o", "x.nc", *asked, *more])


def test_a_case_without_an_experiment_gives_the_peak_force_at_a_set_point(workdir):
    done = at_set_point("80 %,0.6", "--json")
    assert done.exit_code == 0, done.stderr
    states = json.loads(done.stdout)["at_set_point"]
    assert sorted({state["set_point"] for state in states}) == [0.6, 0.8]
    assert {state["direction"] for state in states} == {"approach", "retract"}
    one = df.at_set_point(df.read("x.nc"), 0.8).isel(crossing=0)
    first = next(state for state in states if state["set_point"] == 0.8)
    assert first["peak_force"] == float(one["peak_force"])
    assert first["zc"] == float(one["zc"])


def test_a_table_has_a_row_for_each_state_at_the_set_points_of_a_case(workdir):
    text = LEVER + 'experiment = { kind = "branches", zc = ["9.6 nm", "6 nm"], search = 3, set_point = ["80 %", 0.9] }'
    done = at_set_point(None, text=text)
    assert done.exit_code == 0, done.stderr
    states = df.at_set_point(df.read("x.nc"), 0.8)
    rows = [line for line in done.stdout.splitlines() if line.startswith("peak force at 80 %")]
    assert len(rows) == states.sizes["crossing"] > 1
    assert sum("unstable" in row for row in rows) == (~states["stable"].values).sum() == 1
    assert any(line.startswith("peak force at 90 %") for line in done.stdout.splitlines())
    assert f"{states.sizes['crossing']} states at 80 %" in done.stderr


FAR = 'experiment={ kind = "approach", zc = { start = "9 nm", stop = "8 nm", points = 5 } }'


@pytest.mark.parametrize(
    ("shares", "more", "code", "sentence"),
    [
        ("0.8", ["--set", FAR], 2, "Let experiment.zc stop nearer to the sample"),
        ("0.8,0.97", ["--set", FAR], 0, "No state at 80 %: A/A0 on this curve is"),
        ("0.8", ["--set", FAR.replace("9 nm", "5 nm").replace("8 nm", "3 nm")], 2, "start farther from the sample"),
        ("80", [], 2, "did you mean 0.8 or '80 %'?"),
        ("0,8", [], 2, "0,8 has a share of 0; write decimals with a point, such as 0.8"),
        ("0.8", ["--set", 'experiment={ kind = "dwell", zc = "4 nm" }'], 2, "this experiment is dwell"),
    ],
)
def test_a_set_point_without_a_state_is_answered_in_a_sentence(workdir, shares, more, code, sentence):
    done = at_set_point(shares, *more)
    assert done.exit_code == code, done.output
    assert sentence in done.stderr
