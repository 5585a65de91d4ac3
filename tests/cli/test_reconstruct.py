"""`dforce reconstruct`: what it refuses before it computes."""

from importlib.resources import files

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.cli.reconstruct import _found, _read


@pytest.fixture
def curve(tmp_path):
    path = tmp_path / "curve.nc"
    df.write(df.force_curve(df.example("figure-3-air")), path)
    return path


def test_a_force_curve_is_no_tapping_curve(curve):
    answer = CliRunner().invoke(app, ["reconstruct", str(curve)])
    assert answer.exit_code == 2
    assert "not a curve over the distance" in answer.output


def test_formulas_need_a_picture(curve):
    answer = CliRunner().invoke(app, ["reconstruct", str(curve), "--formulas"])
    assert answer.exit_code == 2
    assert "also write --plot" in answer.output


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
    assert "is not a result: write --case" in answer.output
    read = _read(table, df.load_case(case))
    assert read.attrs["amplitude_error"] > 0.0


def found_with(status):
    """Return a reconstructed force whose distances have a status each."""
    zeros = np.zeros(len(status))
    return xr.Dataset(
        dict.fromkeys(("force", "force_error", "sample_energy"), ("distance", zeros))
        | {"force_status": ("distance", np.array(status, np.int8)), "sample_energy": ("point", np.zeros(9))},
        {"distance": np.arange(len(status)) * 1e-10, "gap_low": ("gap", []), "gap_high": ("gap", [])},
        {"chi2": 9.0, "notes": ""},
    )


@pytest.mark.parametrize(("status", "code"), [((0, 1, 2), 0), ((1, 2, 2), 1)])
def test_a_gap_is_no_failure_and_a_curve_that_determines_nothing_is(curve, monkeypatch, status, code):
    monkeypatch.setattr(df, "reconstruct", lambda *given, **more: found_with(status), raising=False)
    answer = CliRunner().invoke(app, ["reconstruct", str(curve), "--json"])
    assert answer.exit_code == code
    assert f'"exit_code": {code}' in answer.output


def test_the_lowest_force_that_is_told_is_one_that_the_curve_determines():
    distance, point = np.linspace(0.0, 3e-10, 4), np.zeros(9)
    columns = {"force": [-9e-9, np.nan, -2e-9, -1e-9], "force_error": [5e-9, np.nan, 1e-10, 1e-10]}
    found = xr.Dataset(
        {name: ("distance", np.array(column)) for name, column in columns.items()}
        | {"force_status": ("distance", np.array([2, 1, 0, 0], np.int8)), "sample_energy": ("point", point)},
        {"distance": distance, "gap_low": ("gap", [0.0]), "gap_high": ("gap", [2e-10])},
        {"chi2": 9.0},
    )
    assert _found(found)["lowest_force"] == -2e-9
    found["force_status"][:] = 2
    assert _found(found)["lowest_force"] == -9e-9
