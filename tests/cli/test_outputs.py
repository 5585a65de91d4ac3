"""A file that cannot be written hides nothing of the result that a command has computed."""

from __future__ import annotations

import json
import shutil
from importlib.resources import files
from pathlib import Path
from typing import Any

import measured_curve
import numpy as np
import pytest
import synthetic
from every import every
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app

FIT = """
fit = { free = ["forces.1.hamaker"], search = false }
data = { file = "air.csv", phase_convention = "lag" }
"""
PLAN = """
[plan]
set_points = [0.7, 0.8]
vary = { "drive.A0" = ["9 nm", "10 nm"] }
limits = { peak_force = "< 1 uN" }
"""
# the commands with --plot or -o: their words, and a word of their report
COMMANDS = {
    "run": ("run figure-3-air --set experiment.zc.points=9 -o kept.nc", "points"),
    "run-with-states": ("run figure-3-air --set experiment.zc.points=9 --states -o kept.nc", "points"),
    "sweep": ("sweep sweep.toml -o kept.nc", "2 points"),
    "plan": ("plan plan.toml -o kept.nc", "states are allowed"),
    "curve": ("curve figure-3-air --points 9 -o kept.nc", "force"),
    "read": ("read curve.csv --phase lag -o kept.nc", "free amplitude"),
    "thermal": ("thermal thermal.csv", "static spring constant"),
    "fit": ("fit fit.toml -o kept.nc", "chi2"),
    "material": ("material am-fm.nc -o kept.nc", "loss tangent"),
    "reconstruct": ("reconstruct approach.nc -o kept.nc", "force"),
}


def dforce(words: str, *more: str) -> Any:
    return CliRunner().invoke(app, [*words.split(), *more])


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with files for the commands."""
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "curve.csv").write_text(measured_curve.text())
    (folder / "thermal.csv").write_text(measured_curve.spectrum_text())
    (folder / "air.csv").write_bytes((files("dforce.library") / "measured" / "air.csv").read_bytes())
    dwell = df.example("table-1-am").to_toml()
    (folder / "sweep.toml").write_text(
        dwell + '\n[sweep]\nover = { "drive.A0" = ["5 nm", "6 nm"] }\n', encoding="utf-8"
    )
    case = df.example("figure-3-air").to_toml()
    (folder / "fit.toml").write_text(FIT + case, encoding="utf-8")
    (folder / "plan.toml").write_text(df.example("figure-4-soft").to_toml() + PLAN, encoding="utf-8")
    df.write(df.run(df.example("am-fm").set("experiment.zc.points=3")), folder / "am-fm.nc")
    df.write(df.run(df.example("figure-3-air").set("experiment.zc.points=41")), folder / "approach.nc")
    return folder


@pytest.fixture
def inputs(made: Path, workdir: Path) -> None:
    """A copy of these files in the test's own folder."""
    shutil.copytree(made, workdir, dirs_exist_ok=True)


INSIDE = (RuntimeError("raster overflow"), 3, "dforce: an error inside dForce, please report it: RuntimeError")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "error", "code", "sentence"),
    [
        *((command, *INSIDE) for command in COMMANDS if command != "material"),
        ("curve", df.ResultError("no space left"), 2, "dforce: no space left"),
        ("curve", KeyboardInterrupt(), 130, "dforce: stopped"),
    ],
)
def test_a_result_is_reported_whatever_becomes_of_its_picture(
    command: str, error: BaseException, code: int, sentence: str, inputs: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def save(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("dforce.plot.save", save)
    words, word = COMMANDS[command]
    done = dforce(words, "--plot", "picture.png")
    assert (done.exit_code, word in done.stdout, sentence in done.stderr) == (code, True, True), done.output
    assert "picture.png" not in done.stdout
    assert Path("kept.nc").exists() == ("kept.nc" in words)


@pytest.mark.slow
@every([name for name, (words, _) in COMMANDS.items() if "kept.nc" in words and "--states" not in words])
def test_a_result_is_reported_where_it_cannot_be_written(
    command: str, inputs: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write(*_: object, **__: object) -> None:
        raise df.ResultError("no space left")

    monkeypatch.setattr("dforce.write", write)
    words, word = COMMANDS[command]
    done = dforce(words)
    assert (done.exit_code, word in done.stdout, "written: " in done.stdout) == (2, True, False), done.output
    assert "dforce: no space left\n" in done.stderr


def failed_dwell(case: df.Case, **_: object) -> Any:
    """Return a dwell whose motion grew beyond all bounds: it has no record."""
    kept = synthetic.dwell().drop_dims(["time", "frequency"])
    for variable in kept.data_vars.values():
        if variable.dtype.kind == "f":
            variable.values[...] = np.nan
    return kept.assign(status=kept["status"].copy(data=np.int8(df.Status.FAILED))).assign_attrs(case=case.to_toml())


def test_a_point_without_a_result_is_told_as_such_where_it_cannot_be_drawn(workdir: Path, run_as: Any) -> None:
    run_as(failed_dwell)
    done = dforce("run table-1-am -o kept.nc --plot picture.png")
    assert done.exit_code == 1 and "written: kept.nc\n" in done.stdout
    assert "1 of 1 point: the motion grew beyond all bounds" in done.stderr
    assert "dforce: no motion can be drawn" in done.stderr
    told = json.loads(dforce("run table-1-am -o kept.nc --plot picture.png --json").stdout)
    assert (told["exit_code"], told["picture"]) == (1, None)
