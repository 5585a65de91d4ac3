"""Results that are none of an experiment have a summary, a report and a picture, or say that there is none."""

from __future__ import annotations

import importlib
from pathlib import Path

import fitted_curves
import measured_curve
import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.results.kinds import KINDS, is_kind, kind_of


def identification() -> xr.Dataset:
    error = xr.DataArray([[0.1, np.nan]], dims=("curve", "parameter"), coords={"parameter": ["E", "R"]})
    return xr.Dataset({"error": error, "verdict": ("parameter", ["told", "dead"])})


RESULTS = {
    "measured": measured_curve.dataset,
    "fit": fitted_curves.result,
    "identification": identification,
    "thermal_spectrum": lambda: df.thermal_spectrum(df.example("figure-3-air")),
}


@pytest.fixture(scope="module", params=sorted(RESULTS))
def known(request: pytest.FixtureRequest) -> tuple[str, xr.Dataset]:
    return request.param, RESULTS[request.param]()


def test_a_kind_is_known_and_its_numbers_are_told(known: tuple[str, xr.Dataset]) -> None:
    kind, result = known
    assert is_kind(result, kind)
    found = df.summary(result)
    assert len(found) > 0 and all(one.text for one in found)
    assert found[0].label in repr(df.report(result))
    assert "<table" in df.report(result)._repr_html_()


def test_results_of_experiments_are_no_other_kind() -> None:
    assert is_kind(df.dwell(df.example("figure-3-air"), zc="8 nm"), "dwell")


def test_where_there_is_no_picture_a_sentence_says_so() -> None:
    with pytest.raises(df.ParameterError, match="lists its numbers"):
        df.plot.overview(identification())


def test_the_window_says_that_it_does_not_show_other_results(tmp_path: Path) -> None:
    checks = pytest.importorskip("dforce.gui.files.uploads")
    with pytest.raises(df.ResultError, match="another kind \\(identification\\)"):
        checks.validate_upload(identification(), tmp_path)


def test_every_row_of_the_kinds_leads_to_its_functions() -> None:
    for kind in KINDS:
        for path in filter(None, (kind.summary, kind.picture)):
            module, name = path.split(":")
            assert callable(getattr(importlib.import_module(f"dforce.{module}"), name)), path
        assert kind.panel in ("curves", "parameters", "measured", "")


def test_a_name_that_no_kind_has_is_a_mistake_of_the_program() -> None:
    with pytest.raises(ValueError, match="unknown kind of result: fits"):
        is_kind(xr.Dataset(), "fits")
    assert kind_of(xr.Dataset()) is None
