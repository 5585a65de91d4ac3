"""`dforce read`: from a file of a measured curve to a table, a file and a picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import measured_curve
import numpy as np
import pytest
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app


def dforce(*words: str) -> Any:
    return CliRunner().invoke(app, ["read", *words])


@pytest.fixture(autouse=True)
def folder(workdir: Path) -> Path:
    Path("curve.csv").write_text(measured_curve.text())
    Path("thermal.csv").write_text(measured_curve.spectrum_text())
    return workdir


def test_a_curve_is_read_calibrated_written_and_drawn():
    done = dforce("curve.csv", "--phase", "lag", "-o", "out.nc", "--plot", "out.png")
    assert done.exit_code == 0, done.stderr
    assert "free amplitude" in done.stdout and "check without a model" in done.stdout
    assert "written: out.nc, out.png" in done.stdout
    assert df.read_measured("out.nc").attrs["free_amplitude"] == pytest.approx(measured_curve.A0, rel=1e-3)
    assert Path("out.png").read_bytes().startswith(b"\x89PNG")


def test_without_the_sign_of_the_phase_the_curve_is_read_and_the_question_asked():
    done = dforce("curve.csv", "-o", "out.csv")
    assert done.exit_code == 1
    assert "not calibrated: the sign of the phases is unknown" in done.stderr
    assert "points" in done.stdout and Path("out.csv").exists()


def test_a_program_reads_the_answer():
    done = dforce("curve.csv", "--phase", "lag", "--json", "--thermal", "thermal.csv", "--calibrated", "mode")
    answer = json.loads(done.stdout)
    assert answer["points"] == 120 and answer["calibrated"] is True
    assert answer["attributes"]["k"] == pytest.approx(2.0, rel=0.2)
    assert answer["columns"]["dissipated_energy"] == "J"
    assert any(line.startswith("free part") for line in answer["history"])


def test_columns_units_and_the_rest_are_taken():
    Path("odd.csv").write_text(measured_curve.text(heading="U,V,W"))
    words = ("--columns", "height=U", "--columns", "amplitude=V", "--columns", "phase=W")
    units = ("--units", "height=nm", "--units", "amplitude=V", "--units", "phase=deg")
    done = dforce(
        "odd.csv", *words, *units, "--sensitivity", "2 nm/V", "--amplitude-is", "rms", "--phase", "lag", "-o", "o.nc"
    )
    assert done.exit_code == 0, done.stderr
    data = df.read_measured("o.nc")
    expected = 2.0 * np.sqrt(2.0) * measured_curve.numbers()[1]
    np.testing.assert_allclose(data.amplitude, expected, rtol=1e-4)


def test_what_a_sentence_asks_for_is_an_option_of_that_name():
    asked = dforce("curve.csv").stderr
    assert "write phase_convention = 'lag'" in " ".join(asked.split())
    assert dforce("curve.csv", "--phase-convention", "lag").exit_code == 0


def test_a_case_gives_k_and_the_free_lag():
    done = dforce("curve.csv", "--phase", "lag", "--case", "figure-3-air")
    assert done.exit_code == 0, done.stderr
    assert "spring constant k" in done.stdout and "the free lag of the case" in " ".join(done.stdout.split())


def test_a_case_says_how_its_curve_is_read_and_what_is_typed_goes_before():
    Path("odd.csv").write_text(measured_curve.text(heading="U,amplitude_V,phase_deg"))
    table = {
        "columns": {"height": "U"}, "units": {"height": "nm"}, "phase_convention": "lag", "read": {"sensitivity": "2 nm/V"},
        "calibrate": {"free_amplitude": "40 nm"},
    }  # fmt: skip
    df.save_case(df.example("figure-3-air").replace(data=table), "case.toml")
    done = dforce("odd.csv", "--case", "case.toml", "-o", "o.nc")
    assert done.exit_code == 0, done.stderr
    data = df.read_measured("o.nc")
    np.testing.assert_allclose(data.amplitude, 2.0 * measured_curve.numbers()[1], rtol=1e-4)
    assert data.attrs["free_amplitude"] == 40e-9
    dforce("odd.csv", "--case", "case.toml", "--sensitivity", "4 nm/V", "-o", "o.nc")
    np.testing.assert_allclose(df.read_measured("o.nc").amplitude, 4.0 * measured_curve.numbers()[1], rtol=1e-4)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("nothing.csv",), "there is no file 'nothing.csv'"),
        (("curve.csv", "--columns", "height"), "--columns 'height' is not NAME=VALUE"),
        (("curve.csv", "--columns", "hight=U"), "there is no quantity 'hight'; did you mean 'height'?"),
        (("curve.csv", "--phase", "sideways"), "phase_convention = 'sideways' is not one of lag, lag-90, 90-lag, lead"),
        (("curve.csv", "--curve", "two"), "--curve is 'two', not a whole number"),
        (("curve.csv", "--temperature", "25 degC"), "also write --thermal"),
        (("curve.csv", "-o", "out.xlsx"), "use a name ending in .nc, .csv"),
    ],
)
def test_a_mistake_is_one_sentence(words, sentence):
    done = dforce(*words)
    assert done.exit_code == 2
    assert sentence in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "words", [["read", "stiff.csv", "--phase", "lag"], ["reconstruct", "stiff.csv"], ["fit", "case.toml", "stiff.csv"]]
)
def test_no_command_writes_over_the_curve_that_it_reads(folder, words):
    (folder / "stiff.csv").write_text(measured_curve.text())
    (folder / "case.toml").write_text(
        '[cantilever]\nf0 = "70 kHz"\nk = 2.7\nQ = 180\n[drive]\nA0 = "30 nm"\n[fit]\nfree = ["cantilever.Q"]\n'
    )
    before = (folder / "stiff.csv").read_bytes()
    done = CliRunner().invoke(app, [*words, "-o", "stiff.csv"])
    assert done.exit_code == 2 and "'stiff.csv' is the input, and would be lost" in done.stderr
    assert (folder / "stiff.csv").read_bytes() == before
