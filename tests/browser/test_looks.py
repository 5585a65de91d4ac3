"""For everyone: screen readers, the keyboard alone, small screens; and nothing of a user is ever run as code."""

from __future__ import annotations

import pytest
from served import violations

import dforce as df
from dforce.gui.document.document import FIRST

TABS = ("Set point", "Fit", "Against", "Motion", "Numbers", "Advice")


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_in_any_tab(window, theme):
    page = window.page
    dark = "() => document.body.classList.contains('body--dark')"
    if page.evaluate(dark) != (theme == "dark"):
        page.get_by_role("button", name="Light or dark").click()
        page.wait_for_function(f"() => ({dark})() === {str(theme == 'dark').lower()}")
    page.mouse.move(0, 300)
    page.get_by_role("tooltip").wait_for(state="detached")
    assert violations(page) == []
    for tab in TABS:
        window.tab(tab)
        page.get_by_role("tab", name=tab, selected=True).wait_for()
        assert violations(page, within=".df-pane") == [], tab
    window.unfold()
    assert violations(page, within=".df-panels") == []
    page.locator(".df-slider").wait_for()
    window.type("drive.A0", "-1")
    window.field("drive.A0").locator(".df-error").wait_for()
    assert violations(page, within=".df-body") == []
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
