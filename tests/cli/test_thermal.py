"""`dforce thermal`: from a spectrum to a lever."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import measured_curve
import pytest
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app


def dforce(*words: str) -> Any:
    return CliRunner().invoke(app, ["thermal", *words])


@pytest.fixture(autouse=True)
def folder(workdir: Path) -> None:
    Path("thermal.csv").write_text(measured_curve.spectrum_text())


def test_a_lever_is_tuned_drawn_and_written_as_a_case_takes_it() -> None:
    done = dforce("thermal.csv", "--calibrated", "mode", "--plot", "tune.png")
    assert done.exit_code == 0, done.stderr
    tune = df.thermal_tune("thermal.csv", calibrated="mode")
    [line] = re.findall(r"cantilever = \{.*\}", done.stdout)
    case = df.load_case(_written(line))
    (mode,) = case.problem.modes
    assert (mode.f0, mode.k, mode.Q) == pytest.approx((tune.f0, tune.k, tune.Q), rel=1e-3)
    assert Path("tune.png").read_bytes().startswith(b"\x89PNG")


def _written(lever: str) -> str:
    text = (
        f'{lever}\ndrive = {{ A0 = "10 nm" }}\ntip = {{ radius = "2 nm" }}\nsample = {{ youngs_modulus = "1 GPa" }}\n'
    )
    Path("case.toml").write_text(text + 'forces = [{ model = "hertz" }]\n', encoding="utf-8")
    return "case.toml"


def test_json_holds_the_numbers_in_si() -> None:
    told = json.loads(dforce("thermal.csv", "--json").stdout)
    tune = df.thermal_tune("thermal.csv")
    assert {name: told[name] for name in ("f0", "k", "Q", "k_static")} == {
        name: getattr(tune, name) for name in ("f0", "k", "Q", "k_static")
    }


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("nothing.csv", "there is no file 'nothing.csv'"),
        ("thermal.csv --band 60kHz", "is not the lowest and the highest frequency"),
        ("thermal.csv --temperature cold", "temperature"),
        ("thermal.csv --calibrated thermal", "is not one of static, mode"),
        ("thermal.csv --plot thermal.csv", "ends in '.csv'"),
    ],
)
def test_bad_input_gets_one_sentence(words: str, sentence: str) -> None:
    done = dforce(*words.split())
    assert done.exit_code == 2
    assert sentence in " ".join(done.stderr.split())
