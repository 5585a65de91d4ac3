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
from dforce.core.errors import ChangedResultError

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
        (
            "curve",
            ChangedResultError("overview cannot use this Dataset"),
            3,
            "dforce: overview cannot use this Dataset",
        ),
        ("curve", df.ResultError("no space left"), 2, "dforce: no space left"),
        (
            "curve",
            MemoryError("unable to allocate 5 TiB"),
            2,
            "dforce: not enough memory (unable to allocate 5 TiB); compute",
        ),
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
    monkeypatch.setattr("tempfile.tempdir", ".")
    words, word = COMMANDS[command]
    done = dforce(words)
    assert (done.exit_code, word in done.stdout, "written: " in done.stdout) == (2, True, False), done.output
    assert "dforce: no space left\n" in done.stderr and not list(Path().glob("dforce-*"))


@pytest.mark.slow
@every([name for name, (words, _) in COMMANDS.items() if "kept.nc" in words and "--states" not in words])
def test_a_result_that_finds_no_place_is_kept_with_the_temporary_files(
    command: str, inputs: None, workdir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = df.write

    def write(result: Any, path: Path, **how: bool) -> Path:
        if Path(path).name == "kept.nc":
            raise df.ResultError("no space left")
        return plain(result, path, **how)

    monkeypatch.setattr("dforce.write", write)
    place = workdir / f"temporary-{command}"
    place.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(place))
    done = dforce(COMMANDS[command][0])
    (kept,) = place.glob("dforce-*/result.nc")
    assert done.exit_code == 2 and "written: " not in done.stdout
    assert f"dforce: no space left; the result is in '{kept}' instead, so move it from there\n" in done.stderr
    assert df.summary(df.read(kept))


def failed_dwell(case: df.Case, **_: object) -> Any:
    """Return a dwell whose motion became infinite: it has no record."""
    kept = synthetic.dwell().drop_dims(["time", "frequency"])
    for variable in kept.data_vars.values():
        if variable.dtype.kind == "f":
            variable.values[...] = np.nan
    return kept.assign(status=kept["status"].copy(data=np.int8(df.Status.FAILED))).assign_attrs(case=case.to_toml())


def test_a_point_without_a_result_is_told_as_such_where_it_cannot_be_drawn(workdir: Path, run_as: Any) -> None:
    run_as(failed_dwell)
    done = dforce("run table-1-am -o kept.nc --plot picture.png")
    assert done.exit_code == 1 and "written: kept.nc\n" in done.stdout
    assert "1 of 1 point: the motion or a force became infinite or not a number" in done.stderr
    assert "dforce: no motion can be drawn" in done.stderr
    told = json.loads(dforce("run table-1-am -o kept.nc --plot picture.png --json").stdout)
    assert (told["exit_code"], told["picture"]) == (1, None)


LEVERS = "name,maker,f0,k,Q\nmine,me,48.9 kHz,0.9 N/m,100\n"
HEIGHTS = "height (nm),Q\n1,90\n20,100\n"
NAMED = {  # the files that a case may name, by the lines that name them
    "the measured curve": ("", '[data]\nfile = "input.csv"\n', measured_curve.text()),
    "the rows of a sweep": ("", '[sweep]\nrows = "input.csv"\n', "tip.radius\n2 nm\n3 nm\n"),
    "a list of levers": ('name = "mine"\nlibrary = "input.csv"\n', "", LEVERS),
    "the drift of the lever": ('f0 = "48.9 kHz"\nk = 0.9\nQ = 100\ndrift = { file = "input.csv" }\n', "", HEIGHTS),
}
WRITING = (
    "run case.toml",
    "sweep case.toml",
    "curve case.toml",
    "fit case.toml stiff.csv",
    "plan plan.toml",
    "reconstruct stiff.csv --case case.toml",
    "read stiff.csv --phase lag --case case.toml",
)


@pytest.mark.parametrize("named", NAMED)
@pytest.mark.parametrize("words", WRITING)
def test_no_result_replaces_a_file_that_its_case_names(words: str, named: str, workdir: Path, run_as: Any) -> None:
    lever, table, content = NAMED[named]
    lever = lever or 'f0 = "48.9 kHz"\nk = 0.9\nQ = 100\n'
    case = f'[cantilever]\n{lever}[drive]\nA0 = "10 nm"\n{table}[fit]\nfree = ["cantilever.Q"]\n'
    Path("case.toml").write_text(case)
    Path("plan.toml").write_text(f'{case}[plan]\nvary = {{ "drive.A0" = ["9 nm"] }}\n')
    for name, text in (("input.csv", content), ("stiff.csv", measured_curve.text())):
        Path(name).write_text(text)
    done = dforce(words, "-o", "input.csv")
    refused = "'input.csv' is the input, and would be lost" in done.stderr
    assert refused or "has a table [sweep]" in done.stderr or "has no table [sweep]" in done.stderr, done.output
    assert done.exit_code == 2 and Path("input.csv").read_text() == content


def test_the_case_of_a_measured_curve_is_not_replaced_by_its_force(workdir: Path) -> None:
    df.write(synthetic.approach(), "case.nc")
    Path("stiff.csv").write_text(measured_curve.text())
    for words in ("reconstruct stiff.csv", "read stiff.csv --phase lag"):
        done = dforce(words, "--case", "case.nc", "-o", "case.nc")
        assert done.exit_code == 2 and "'case.nc' is the input, and would be lost" in done.stderr


@pytest.mark.slow
def test_advice_beside_a_table_points_to_its_case(inputs: None) -> None:
    forces = '[[forces]]\nmodel = "dmt"\nhamaker = 2e-20\n[tip]\nradius = "2 nm"\n[sample]\nyoungs_modulus = "1 GPa"\n'
    Path("advised.toml").write_text(
        f'[cantilever]\nf0 = 5e4\nk = 0.9\nQ = 100\n[drive]\nA0 = "10 nm"\n{forces}'
        '[experiment]\nkind = "dwell"\nzc = "11 nm"\n[sweep]\nover = { "drive.A0" = ["9 nm"] }\n'
    )
    done = dforce("sweep advised.toml -o table.csv")
    assert "advice: " in done.stderr and "dforce check advised.toml" in done.stderr, done.output
