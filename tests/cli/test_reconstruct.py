"""`dforce reconstruct`: what it refuses before it computes."""

import pytest
from typer.testing import CliRunner

import dforce as df
from dforce.cli._app import app


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
