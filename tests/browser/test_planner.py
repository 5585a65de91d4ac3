"""A planner asks: which free amplitude and set point keep the peak force below 100 pN?"""

from __future__ import annotations

import numpy as np
from playwright.sync_api import expect

import dforce as df

CHART = ".df-explore-chart"
LIMIT = 100e-12
WAIT = 300_000  # ms, until the boundaries of the regimes are followed


def words(window):
    """Return the words that the map shows."""
    return window.page.evaluate(
        "(chart) => [...new Set((document.querySelector(chart + ' .df-plot')._fullData?.[0]?.text ?? []).flat())]",
        CHART,
    )


def click_on(window, name):
    """Click on the mark of a name on the map."""
    left, top = window.page.evaluate(
        """([chart, name]) => {
            const plot = document.querySelector(chart + " .df-plot"), {xaxis, yaxis} = plot._fullLayout;
            const mark = plot._fullData.find((trace) => trace.name === name), box = plot.getBoundingClientRect();
            return [box.left + xaxis._offset + xaxis.d2p(mark.x[0]), box.top + yaxis._offset + yaxis.d2p(mark.y[0])];
        }""",
        [CHART, name],
    )
    window.page.mouse.click(left, top)


def test_a_planner_finds_amplitude_and_set_point_that_keep_the_peak_force_low(visit):
    window = visit()
    page = window.page
    window.start("figure-4-soft")
    window.tab("Against")
    panel = page.get_by_role("complementary", name="over parameters")
    expect(panel.get_by_label("Vary")).to_have_value("drive.A0")  # asked for most
    panel.get_by_label("second parameter").select_option("set_point")
    expect(panel.get_by_label("second from")).to_have_value("50 %")
    panel.get_by_label("quantity to keep within a limit").select_option("peak_force")
    limit = panel.get_by_label("limit to keep")
    limit.fill("0.1")
    limit.press("Tab")
    expect(limit).to_have_value("0.1 nN")  # the unit in which it is read
    panel.get_by_role("spinbutton", name="in values", exact=True).fill("4")
    panel.get_by_label("second values").fill("3")
    panel.get_by_role("button", name="Compute").click()
    expect(panel.get_by_text("No setting is allowed")).to_be_visible(timeout=WAIT)
    expect(panel.get_by_text("Search beyond, or relax the limit")).to_be_visible()  # so down from the suggested range
    expect(panel.get_by_role("button", name="Compute")).to_be_visible(timeout=WAIT)
    low = panel.get_by_role("textbox", name="from", exact=True)
    low.fill("0,3")
    low.press("Tab")
    expect(low).to_have_value("0,3 nm")
    panel.get_by_role("textbox", name="to", exact=True).fill("3 nm")
    panel.get_by_role("button", name="Compute").click()
    page.wait_for_function(
        "(chart) => (document.querySelector(chart + ' .df-plot')._fullData ?? []).some((trace) => trace.name === 'most room')",
        arg=CHART,
        timeout=WAIT,
    )
    assert {"all limits hold", "peak_force"} <= set(words(window))
    click_on(window, "most room")
    expect(panel.get_by_text("free amplitude", exact=False).last).to_be_visible()
    panel.get_by_role("button", name="Take over these settings").click()
    amplitude = window.field("drive.A0").locator("input.df-box")
    expect(amplitude).not_to_have_value("10")
    unit = window.field("drive.A0").locator("select.df-unit").input_value()
    chosen = df.parse(f"{amplitude.input_value()} {unit}", "m")
    share = 0.01 * float(page.get_by_label("set point in percent").input_value())
    case = df.example("figure-4-soft").replace("drive.A0", chosen)
    curve = df.approach(case, zc=np.linspace(1.3, -1.0, 251) * chosen)
    force = df.at_set_point(curve, share)["peak_force"].values
    assert 0.0 < force.max() < LIMIT
