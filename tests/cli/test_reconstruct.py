"""`dforce reconstruct`: what it refuses before it computes."""

from importlib.resources import files

import pytest
from typer.testing import CliRunner

import dforce as df
from dforce.cli._app import app
from dforce.cli.reconstruct import _read


@pytest.fixture
def curve(tmp_path):
    path = tmp_path / "curve.nc"
    df.write(df.force_curve(df.example("figure-3-air")), path)
    return path


def test_a_force_curve_is_no_tapping_curve(curve):
    answer = CliRunner().invoke(app, ["reconstruct", str(curve)])
    assert answer.exit_code == 2
    assert "no curve over the distance" in answer.output


def test_formulas_need_a_picture(curve):
    answer = CliRunner().invoke(app, ["reconstruct", str(curve), "--formulas"])
    assert answer.exit_code == 2
    assert "give --plot as well" in answer.output


def test_an_unknown_direction_is_answered_with_the_known_ones(curve):
    answer = CliRunner().invoke(app, ["reconstruct", str(curve), "--direction", "sideways"])
    assert answer.exit_code == 2
    assert "is not one of approach, retract" in answer.output


def test_a_measured_text_is_read_as_the_case_says_and_refused_without_one(tmp_path):
    table, case = tmp_path / "stiff.csv", tmp_path / "case.toml"
    table.write_bytes((files("dforce.library") / "measured" / "stiff.csv").read_bytes())
    case.write_text(
        '[cantilever]\nf0 = "70 kHz"\nk = "2.7 N/m"\nQ = 180\n[drive]\nA0 = "30 nm"\n[data]\nphase_convention = "lag"\n',
        encoding="utf-8",
    )
    answer = CliRunner().invoke(app, ["reconstruct", str(table)])
    assert answer.exit_code == 2
    assert "is no result: give the instrument by --case" in answer.output
    read = _read(table, df.load_case(case))
    assert read.attrs["amplitude_error"] > 0.0
