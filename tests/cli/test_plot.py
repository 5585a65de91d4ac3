"""`dforce plot`: kept results drawn anew, from the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import synthetic
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app

SWEEP = {"drive.A0": ["10 nm", "15 nm"], "sample.youngs_modulus": ["1 GPa", "2 GPa", "4 GPa"]}


def dforce(*words: str) -> Any:
    return CliRunner().invoke(app, ["plot", *words])


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a curve, curves of a sweep, and the same at a set point."""
    folder = tmp_path_factory.mktemp("kept")
    df.write(synthetic.approach(), folder / "curve.nc")
    case = df.example("hysteresis").set("sample.poisson_ratio=0.3")
    zc = {"start": "16 nm", "stop": "6 nm", "points": 11}
    case = case.replace(experiment={"kind": "approach", "zc": zc, "direction": "approach"})
    for name, share in (("sweep", None), ("at", 0.8)):
        df.write(df.sweep(case, over=SWEEP, at_set_point=share), folder / f"{name}.nc")
    return folder


@pytest.fixture
def here(kept: Path, workdir: Path) -> Path:
    return kept


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("curve", ""),
        ("curve", "--quantity peak_force,max_indentation --width 85mm"),
        ("curve", "--quantity peak_force --over amplitude"),
        ("sweep", ""),
        ("sweep", "--quantity peak_force"),
        ("sweep", "--quantity peak_force --over amplitude_ratio"),
        ("at", ""),
        ("at", "--quantity peak_force --over A0"),
        ("at", "--quantity peak_force --over A0,youngs_modulus"),
    ],
)
def test_a_kept_result_is_drawn_beside_other_files(here: Path, name: str, words: str) -> None:
    other = Path(f"{name}.png")
    other.write_bytes(b"of another")
    done = dforce(str(here / f"{name}.nc"), *words.split())
    assert (done.exit_code, done.stdout) == (0, f"written: {name}-2.png\n"), done.stderr
    assert Path(f"{name}-2.png").read_bytes().startswith(b"\x89PNG")
    assert other.read_bytes() == b"of another"


@pytest.mark.parametrize(
    ("name", "words", "sentence"),
    [
        ("curve", "--quantity peakforce", "has no 'peakforce' to draw; did you mean 'peak_force'?"),
        ("curve", "--over A0", "name the quantity with --quantity"),
        (
            "sweep",
            "--quantity peak_force --over A0",
            "is not a curve over 'A0': it goes along A0 and youngs_modulus and zc",
        ),
        ("curve", "--quantity phase,amplitude --over A0,k", "a map draws one --quantity over two parameters"),
        ("nothing", "", "there is no file"),
        ("curve", "-o curve.gif", "ends in '.gif'"),
        ("curve", "--width 3km", "is not between"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_one_sentence(here: Path, name: str, words: str, sentence: str) -> None:
    done = dforce(str(here / f"{name}.nc"), *words.split())
    assert done.exit_code == 2
    assert sentence in " ".join(done.stderr.split())
    assert not list(Path().iterdir())


def test_a_case_is_to_be_run_first() -> None:
    done = dforce("hysteresis")
    assert done.exit_code == 2
    assert "dforce run hysteresis --plot FIG.png" in " ".join(done.stderr.split())


def test_the_lines_of_a_sweep_are_those_of_its_cases(kept: Path) -> None:
    from dforce.results.curves import Picture

    result = df.read(kept / "at.nc")
    (axes,) = df.plot.draw(result, Picture("A0", ("peak_force",)), df.plot.Sheet())
    first = result["peak_force"].isel(crossing=0)
    drawn = [line.get_ydata() for line in axes.get_lines()]
    shown = [first.isel(youngs_modulus=i).values for i in range(3)]
    assert len(drawn) == len(shown)
    for got, wanted in zip(drawn, shown, strict=True):
        ratio = got / wanted
        assert ratio == pytest.approx(ratio[0])
