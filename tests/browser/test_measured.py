"""A person drops a measured curve, says what its file does not tell, and fits it."""

from __future__ import annotations

from importlib.resources import files

import fitted_curves
import numpy as np
import pytest
from playwright.sync_api import expect

import dforce as df

CURVE = files("dforce.library") / "measured" / "stiff.csv"


@pytest.fixture
def measured(window, tmp_path):
    """Give the window with the stiff sample's case and its measured curve, dropped onto it."""
    case = fitted_curves.case_of("stiff").replace(
        "sample.youngs_modulus", 1.9e9,
        experiment=df.experiments.Approach(zc={"start": "34 nm", "stop": "9 nm", "points": 126}),
        fit={"free": ["sample.youngs_modulus"], "search": False},
    )  # fmt: skip
    file = tmp_path / "case.toml"
    df.save_case(case, file)
    window.page.locator(".df-upload input[type=file]").set_input_files(file)
    window.shows(case.replace(fit=None))
    window.page.evaluate(
        """(text) => {
            const data = new DataTransfer();
            data.items.add(new File([text], "stiff.csv"));
            document.dispatchEvent(new DragEvent("drop", {dataTransfer: data}));
        }""",
        CURVE.read_text(),
    )
    page = window.page
    page.get_by_label("Phases in the file").select_option("lag")
    with window.redrawn():
        page.get_by_role("button", name="Read", exact=True).click()
    page.get_by_role("complementary", name="measured curve").wait_for()
    yield window
    page.get_by_role("button", name="Remove the curve").click()
    expect(page.get_by_role("button", name="Open a measured curve")).to_be_visible()


def points(window, name):
    return next(np.array(trace["y"]) for trace in window.traces() if trace["meta"] == name)


@pytest.mark.long  # the story of the experimenter goes the same way
def test_a_dropped_curve_is_asked_about_drawn_fitted_and_taken_over(measured):
    panel = measured.page.get_by_role("complementary", name="measured curve")
    rows = np.loadtxt(CURVE.read_text().splitlines(), delimiter=",")
    assert np.allclose(points(measured, "measured amplitude"), rows[:, 1])
    expect(measured.parameter("sample.youngs_modulus").get_by_role("checkbox", name="fit")).to_be_checked()
    expect(panel.get_by_role("button", name="Fit", exact=True)).to_be_disabled()
    panel.get_by_role("button", name="Confirm lever and tip").click()
    panel.get_by_role("button", name="Fit", exact=True).click()
    take = panel.get_by_role("button", name="Take over these values")
    take.wait_for()
    assert np.isfinite(points(measured, "residual amplitude")).sum() > 50  # of the curve that is drawn
    take.click()
    box = measured.field("sample.youngs_modulus").locator("input.df-box")
    expect(box).not_to_have_value("1.9")
    assert float(box.input_value()) == pytest.approx(2.0, abs=0.14)  # three standard errors
