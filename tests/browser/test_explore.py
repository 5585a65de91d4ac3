"""A person looks at states against a parameter, drags a limit, and opens a plan."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

import dforce as df

CHART = ".df-explore-chart"


@pytest.fixture
def panel(window):
    """Give the window at a soft sample, with its panel over parameters."""
    window.start("figure-4-soft")
    window.tab("Against")
    found = window.page.get_by_role("complementary", name="over parameters")
    found.wait_for()
    yield found
    window.tab("Set point")
    expect(found).to_be_hidden()


def line(window):
    """Return where on the page the limit is, and its value as it is drawn."""
    return window.page.evaluate(
        """(chart) => {
            const plot = document.querySelector(chart + " .df-plot"), {shapes, yaxis, _size} = plot._fullLayout;
            const box = plot.getBoundingClientRect();
            return [box.left + _size.l + _size.w / 2, box.top + yaxis._offset + yaxis.d2p(shapes[0].y0), shapes[0].y0];
        }""",
        CHART,
    )


def test_a_limit_is_dragged_along_states_against_a_parameter(window, panel):
    panel.get_by_label("Vary").select_option("sample.youngs_modulus")
    expect(panel.get_by_role("textbox", name="from")).to_have_value("25 MPa")  # half of that of the case
    panel.get_by_role("textbox", name="from").fill("40 MPa")
    panel.get_by_role("textbox", name="to", exact=True).fill("100 MPa")
    panel.get_by_label("values").fill("3")
    with window.redrawn(CHART):
        panel.get_by_role("button", name="Compute").click()
    assert len(window.lines("peak_force", CHART)[0]) == 3
    with window.redrawn(CHART):
        panel.get_by_role("checkbox", name="Limit").check()
    x, y, before = line(window)
    with window.redrawn(CHART):
        window.page.mouse.move(x, y)
        window.page.mouse.down()
        window.page.mouse.move(x, y + 30, steps=4)
        window.page.mouse.up()
    after = line(window)[2]
    assert after < before
    assert float(panel.get_by_label("limit", exact=True).input_value().split()[0]) == pytest.approx(after, rel=1e-3)
    expect(panel.get_by_text("the limit holds")).to_be_visible()


@pytest.mark.long  # tests/gui/test_explore.py says the same of a simulated page
def test_a_plan_is_opened_and_its_settings_are_taken_over(window, panel, tmp_path):
    grid, shares = {"start": "4 nm", "stop": "12 nm", "points": 3}, {"start": 0.6, "stop": 0.9, "points": 2}
    df.write(
        df.plan(df.example("figure-4-soft"), {"drive.A0": grid}, shares, {"max_indentation": "< 5 nm"}),
        tmp_path / "p.nc",
    )
    with window.redrawn(CHART):
        window.page.locator(".df-upload input[type=file]").set_input_files(tmp_path / "p.nc")
    expect(panel.get_by_role("combobox", name="Show")).to_have_value("limit_hit")
    box = window.page.locator(f"{CHART} .nsewdrag").first.bounding_box()
    window.page.mouse.click(box["x"] + 0.9 * box["width"], box["y"] + 0.1 * box["height"])
    panel.get_by_role("button", name="Take over these settings").click()
    expect(window.field("drive.A0").locator("input.df-box")).to_have_value("12")
    window.tab("Set point")
    expect(window.page.get_by_label("set point in percent")).to_have_value("90")
