"""For everyone: screen readers, the keyboard alone, small screens; and nothing of a user is ever run as code."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect
from served import Window, violations

import dforce as df
from dforce.gui.document.document import FIRST

TABS = ("Set point", "Fit", "Against", "Motion", "Numbers", "Advice")


@pytest.mark.parametrize("theme", ["light", pytest.param("dark", marks=pytest.mark.long)])
def test_axe_finds_nothing_in_any_tab(window, theme):
    page = window.page
    dark = "() => document.body.classList.contains('body--dark')"
    if page.evaluate(dark) != (theme == "dark"):
        page.get_by_role("button", name="Light or dark").click()
        page.wait_for_function(f"() => ({dark})() === {str(theme == 'dark').lower()}")
    page.mouse.move(0, 300)
    page.get_by_role("tooltip").wait_for(state="detached")
    assert violations(page) == []
    for tab in TABS[1:]:  # the first is part of the page
        window.tab(tab)
        page.get_by_role("tab", name=tab, selected=True).wait_for()
        assert violations(page, within=".df-pane") == [], tab
    window.unfold()
    assert violations(page, within=".df-panels") == []
    page.locator(".df-slider").wait_for()
    window.type("drive.A0", "-1")
    window.field("drive.A0").locator(".df-error").wait_for()
    assert violations(page, within=".df-form") == []
    page.get_by_role("button", name="Examples").click()
    page.get_by_role("menu").wait_for()
    # a menu lies at the end of the page, outside all regions, and has the focus while it is open
    assert violations(page, "region", within=".q-menu") == []
    page.keyboard.press("Escape")


def test_everything_can_be_done_with_the_keyboard_alone(window):
    page, keyboard = window.page, window.page.keyboard
    page.get_by_role("button", name="Examples").focus()
    keyboard.press("Enter")
    page.wait_for_function("() => document.activeElement.closest('.q-menu')")
    focused = "(title) => document.activeElement.textContent.startsWith(title)"
    for _ in range(1 + list(df.examples()).index("figure-3-water")):
        keyboard.press("ArrowDown")
    assert page.evaluate(focused, df.examples()["figure-3-water"].title)
    keyboard.press("Enter")
    window.shows(df.example("figure-3-water"))
    window.field("cantilever.Q").locator("input").focus()
    while page.evaluate("() => document.activeElement.closest('.df-entry')?.dataset.path") != "drive.A0":
        keyboard.press("Tab")
    keyboard.press("Control+A")
    keyboard.type("8")
    window.shows(df.example("figure-3-water").replace("drive.A0", "8 nm"))
    handle = page.locator('.df-slider[data-path="drive.A0"] input[type="range"]')
    handle.focus()
    keyboard.press("ArrowRight")
    value = handle.input_value()
    assert float(value) > 8.0
    window.shows(df.example("figure-3-water").replace("drive.A0", f"{value} nm"))
    page.get_by_role("button", name="Undo").focus()
    keyboard.press("Enter")
    window.shows(df.example("figure-3-water").replace("drive.A0", "8 nm"))


@pytest.mark.long  # the start page and a sweep
def test_a_story_from_the_start_page_to_the_set_point_with_the_keyboard_alone(visit):
    window = visit(enter=Window.go)
    page, keyboard = window.page, window.page.keyboard
    here = "(place) => document.activeElement.matches(place)"

    def tab_to(place, key="Tab"):
        """Press a key until a place has the focus."""
        for _ in range(60):
            keyboard.press(key)
            if page.evaluate(here, place):
                return
        raise AssertionError(f"{key} does not lead to {place}")

    def skip(number, place):
        """Follow one of the skip links at the begin of the page."""
        page.evaluate("() => document.querySelector('.df-skip').focus()")
        for _ in range(number):
            keyboard.press("Tab")
        keyboard.press("Enter")
        page.wait_for_function(here, arg=place)

    page.get_by_role("button", name="Two states and jumps").wait_for()
    tab_to(".df-question:nth-child(3)")
    keyboard.press("Enter")
    tab_to("[role=combobox][aria-label=Lever]")
    keyboard.type("PPP-NCHR")
    page.get_by_role("option", name="PPP-NCHR: 330 kHz, 42 N/m").wait_for()
    keyboard.press("ArrowDown")
    keyboard.press("Enter")
    tab_to(".df-start .bg-primary")
    keyboard.press("Enter")
    page.wait_for_function(here, arg=".df-main .df-chart")  # where one goes on
    answer = page.get_by_role("status").and_(page.locator(".df-answer"))
    expect(answer).to_contain_text("at 80 %")
    before = answer.inner_text()
    skip(0, ".df-slider input")
    tab_to('.df-entry[data-path="drive.A0"] input', "Shift+Tab")
    keyboard.press("Control+A")
    keyboard.type("15")
    expect(answer).not_to_have_text(before)
    skip(2, "[role=tab]")
    against = page.get_by_role("tab", name="Against")
    tab_to(f"#{against.get_attribute('id')}", "ArrowRight")  # past tabs that are hidden
    keyboard.press("Enter")
    page.get_by_role("tab", name="Against", selected=True).wait_for()
    tab_to(".df-explore .df-main-button")
    keyboard.press("Enter")
    panel = page.get_by_role("complementary", name="over parameters")
    expect(panel).to_contain_text("Click on a point", timeout=60_000)
    skip(2, "[role=tab]")
    keyboard.press("Home")
    keyboard.press("Enter")
    page.get_by_role("tab", name="Set point", selected=True).wait_for()
    tab_to(".df-setpoint input")
    keyboard.press("Control+A")
    keyboard.type("60")
    expect(answer).to_contain_text("at 60 %")


def test_arrow_keys_go_along_a_curve_to_which_a_skip_link_leads(window):
    page, keyboard = window.page, window.page.keyboard
    result = df.run(window.start("figure-3-air"))
    page.evaluate("() => document.activeElement.blur()")
    focused = "(place) => document.activeElement.matches(place)"
    for words, place in (
        ("Skip to the tabs", ".df-pane [role=tab]"),
        ("Skip to the sliders", ".df-slider input"),
        ("Skip to the chart", ".df-main .df-chart"),
    ):
        link = page.locator(".df-skip", has_text=words)
        link.focus()
        assert link.bounding_box()["width"] > 20.0
        keyboard.press("Enter")
        page.wait_for_function(focused, arg=place)
    said = page.locator(".df-main .df-chart [role=status]")
    expect(said).to_contain_text("Arrow keys move along a curve")
    for key, at in (
        ("ArrowRight", 0),
        ("ArrowRight", 1),
        ("PageDown", 11),
        ("ArrowLeft", 10),
        ("End", -1),
        ("Home", 0),
    ):
        keyboard.press(key)
        one = result.isel(zc=at, tone=0, direction=0)
        zc, amplitude = 1e9 * float(one["zc"]), 1e9 * float(one["amplitude"])
        expect(said).to_contain_text(f"zc (nm): {zc:#.4g}, amplitude A (nm): {amplitude:#.4g}")
    keyboard.press("PageDown")
    for _ in range(3):  # retract, then the phase of both
        keyboard.press("ArrowDown")
    phase = float(result["phase"].isel(zc=10, tone=0, direction=1))
    expect(said).to_contain_text(re.compile(rf"retract, .*phase lag φ \(°\): {phase:#.4g}"))
    keyboard.press("Enter")
    expect(page.get_by_role("region", name="motion at a point")).to_contain_text(
        f"{1e9 * float(result['zc'][10]):.3g} nm"
    )
    assert violations(page, within=".df-stage") == []


SCRIPT = "<img src=x onerror='window.hacked=1'><script>window.hacked=1</script>{{ 6*7 }} ${window.hacked=1}"


def test_a_title_is_text_and_never_run(window):
    page = window.page
    page.get_by_label("title of the case").fill(SCRIPT)
    window.type("drive.A0", SCRIPT)
    window.field("drive.A0").locator(".df-error").wait_for()
    window.saved("hacked")
    page.reload()
    window.field("drive.A0").locator(".df-error").wait_for()
    assert page.get_by_label("title of the case").input_value() == SCRIPT
    assert page.evaluate("() => window.hacked") is None


def test_a_long_name_pushes_nothing_out_of_the_window(window):
    window.page.get_by_label("title of the case").fill("A very long title of a case, with every detail " * 6)
    assert window.page.evaluate("() => document.documentElement.scrollWidth") <= 1366
    box = window.page.get_by_role("button", name="Run").bounding_box()
    assert box["x"] + box["width"] < 1366


@pytest.mark.long  # tests/browser/test_class.py says the same of a class
def test_two_people_do_not_see_each_other(window, visit):
    other = visit()
    window.type("drive.A0", "4")
    window.shows(df.example("figure-3-air").replace("drive.A0", "4 nm"))
    assert other.field("drive.A0").locator("input").input_value() == "20"
    other.page.reload()
    other.shows(df.example(FIRST))
    assert other.field("drive.A0").locator("input").input_value() == "20"


def test_two_pages_of_one_person_show_the_same(window):
    from served import Window

    second = Window(window.page.context.new_page(), window.server)
    try:
        second.open()
        window.type("drive.A0", "4")
        second.shows(df.example("figure-3-air").replace("drive.A0", "4 nm"))
        assert second.field("drive.A0").locator("input").input_value() == "4"
    finally:
        second.page.close()
