"""Back, reload and a second tab at each step of a story: nothing is lost, and all pages of a person show the same."""

from __future__ import annotations

from importlib.resources import files

import pytest
from playwright.sync_api import expect
from served import Window

WAIT = 120_000  # ms for a fit on a busy machine
DATA = files("dforce.library") / "measured"
MODULUS = "sample.youngs_modulus"


def ticked(window):
    return window.parameter(MODULUS).get_by_role("checkbox", name="fit")


def reloaded(window):
    """Reload a page, and open its tab of the fit again."""
    window.page.reload()
    window.drawn()
    window.page.get_by_role("tab", name="Fit").click()
    return window.page.get_by_role("complementary", name="measured curve")


@pytest.mark.long
def test_a_story_goes_on_after_reload_and_back_and_in_a_second_tab(visit):
    window = visit(enter=Window.go)
    page = window.page
    # the first page, reloaded, asks again; nothing was begun
    page.get_by_role("button", name="Explain my curve").click()
    page.reload()
    page.get_by_role("button", name="Explain my curve").click()
    with window.remade():
        page.get_by_role("button", name="A stiff sample in air, measured").click()
    page.locator(".df-measured").wait_for()
    panel = reloaded(window)
    expect(panel.get_by_text("126 points, approach")).to_be_visible()
    ticked(window).check()
    panel.get_by_role("button", name="Confirm lever and tip").click()
    panel = reloaded(window)
    expect(ticked(window)).to_be_checked()
    expect(panel.get_by_text("Confirmed for this curve")).to_be_visible()
    # a fit goes on while its page is loaded anew; a second tab sees how it ends
    panel.get_by_role("button", name="Fit", exact=True).click()
    panel = reloaded(window)
    second = Window(page.context.new_page(), window.server)
    second.open()
    other = second.page.get_by_role("complementary", name="measured curve")
    second.page.get_by_role("tab", name="Fit").click()
    for one in (panel, other):
        expect(one.get_by_role("button", name="Take over these values")).to_be_visible(timeout=WAIT)
    other.get_by_role("button", name="Take over these values").click()
    box = second.field(MODULUS).locator("input.df-box")
    expect(box).not_to_have_value("1.9")
    expect(window.field(MODULUS).locator("input.df-box")).to_have_value(box.input_value())
    # back and forward between two addresses of the window, and away from it
    address = page.url
    page.goto("about:blank")
    page.go_back()
    window.drawn()
    assert page.url.partition("#")[0] == address.partition("#")[0]
    expect(window.field(MODULUS).locator("input.df-box")).to_have_value(box.input_value())


@pytest.mark.long
def test_what_is_typed_in_a_pane_its_tab_and_a_curve_that_was_dropped_stay_when_the_page_is_loaded_anew(visit):
    window = visit(enter=Window.go)
    page = window.page
    page.get_by_role("button", name="Explain my curve").click()
    page.locator(".df-upload input[type=file]").set_input_files(str(DATA / "stiff.csv"))
    page.get_by_label("Phases in the file").select_option("lag")
    page.get_by_role("button", name="Read", exact=True).click()
    page.locator(".df-measured").wait_for()
    panel = page.get_by_role("complementary", name="over parameters")
    window.tab("Against")
    panel.get_by_label("quantity to keep within a limit").select_option("peak_force")
    panel.get_by_label("limit to keep").fill("123 pN")
    page.reload()
    page.get_by_role("tab", name="Against", selected=True).wait_for()  # no first page, whatever was dropped on it
    expect(panel.get_by_label("limit to keep")).to_have_value("123 pN")
    second = page.context.new_page()
    second.goto(window.server.home)
    second.get_by_role("tab", name="Against", selected=True).wait_for()
    page.get_by_role("tab", name="Fit").click()
    page.locator(".df-measured").wait_for()
