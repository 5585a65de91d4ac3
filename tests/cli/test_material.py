"""`dforce material`: what the formulas of AM-FM find in a result."""

import json

import pytest
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app


@pytest.fixture(scope="module")
def curve(tmp_path_factory):
    path = tmp_path_factory.mktemp("curves") / "curve.nc"
    df.write(df.run(df.example("am-fm").set("experiment.zc.points=3")), path)
    return path


def test_modulus_and_its_doubts_are_printed_and_written(curve, tmp_path):
    out = tmp_path / "material.nc"
    answer = CliRunner().invoke(app, ["material", str(curve), "-o", str(out)])
    assert answer.exit_code == 0
    assert "true effective modulus" in answer.output and "The indentation is 24 %" in answer.output
    assert df.read(out).E_eff.values == pytest.approx(df.material(df.read(curve)).E_eff.values, nan_ok=True)


def test_model_of_the_tip_is_chosen(curve):
    answers = [
        CliRunner().invoke(app, ["material", str(curve), "--model", one, "--json"]) for one in ("hertz", "punch")
    ]
    hertz, punch = ({row["name"]: row["value"] for row in json.loads(one.stdout)["found"]} for one in answers)
    found = {one.name: one.value for one in df.summary(df.material(df.read(curve), "punch"))}
    assert punch["E_eff"] == found["E_eff"] != hertz["E_eff"]


def test_tapping_curve_is_refused(tmp_path):
    path = tmp_path / "curve.nc"
    df.write(df.run(df.example("figure-3-air").set("experiment.zc.points=3")), path)
    answer = CliRunner().invoke(app, ["material", str(path)])
    assert answer.exit_code == 2 and "the curve needs two tones with a lock" in answer.output
