"""Screen readers: axe-core finds nothing wrong in any state of the window, with its dialogs open, light or dark."""

from __future__ import annotations

from importlib.resources import files

import pytest
from served import Window, violations

DATA = files("dforce.library") / "measured"
DROP = """([text, name]) => {
    const data = new DataTransfer();
    data.items.add(new File([text], name));
    document.dispatchEvent(new DragEvent("drop", {dataTransfer: data}));
}"""
OVERLAYS = ".q-menu, .q-dialog"  # they lie at the end of the page, outside all regions


class States:
    """Goes through the states of a window, and looks at each."""

    def __init__(self, window):
        self.window, self.page, self.seen = window, window.page, {}

    def look(self, name):
        """Look at the page as it is, and at the dialog or menu over it alone where there is one."""
        self.page.mouse.move(0, 300)
        over = [one for one in OVERLAYS.split(", ") if self.page.locator(one).count()]
        self.seen[name] = [
            line for one in over or [None] for line in violations(self.page, *["region"] * bool(over), within=one)
        ]

    def menu(self, name, item):
        """Choose an item of a menu."""
        self.page.get_by_role("button", name=name, exact=True).click()
        self.page.get_by_role("menuitem").filter(has_text=item).click()
        self.page.locator(".q-menu").wait_for(state="detached")

    def leave(self):
        """Close what lies over the page."""
        self.page.keyboard.press("Escape")
        self.page.wait_for_function("(over) => !document.querySelector(over)", arg=OVERLAYS)


@pytest.mark.long
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_in_any_state_or_dialog(visit, theme):
    window = visit(enter=Window.go)
    page, states = window.page, States(window)
    page.locator(".df-start").wait_for()
    if theme == "dark":
        page.get_by_role("button", name="Light or dark").click()
    states.look("first page")
    page.get_by_role("button", name="Teach a class").click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.get_by_role("dialog", name="teach a class").wait_for()
    states.look("teach a class")
    states.leave()
    window.drawn()
    states.look("work page")
    page.get_by_role("button", name="File", exact=True).click()
    page.get_by_role("menu").wait_for()
    states.look("menu of files")
    states.leave()
    states.menu("File", "Save figure")
    page.get_by_role("button", name="Save", exact=True).wait_for()
    states.look("save a figure")
    states.leave()
    states.menu("File", "Save result")
    page.get_by_role("button", name="Save", exact=True).wait_for()
    states.look("save a result")
    states.leave()
    page.get_by_role("button", name="Add a force").click()
    page.get_by_role("dialog", name="add a force").wait_for()
    states.look("add a force")
    states.leave()
    page.get_by_role("button", name="Quantities").click()
    page.locator(".df-against select").wait_for()
    states.look("quantities")
    states.leave()
    page.evaluate(DROP, [(DATA / "thermal.csv").read_text(), "thermal.csv"])
    page.get_by_role("button", name="Take for the lever").wait_for()
    states.look("thermal spectrum")
    states.leave()
    page.evaluate(DROP, [(DATA / "stiff.csv").read_text(), "stiff.csv"])
    page.get_by_label("Phases in the file").select_option("lag")
    states.look("columns of a measured curve")
    page.get_by_role("button", name="Read", exact=True).click()
    page.locator(".df-measured").wait_for()
    states.look("measured curve")
    for tab in ("Reconstruct", "Against", "Motion", "States", "Numbers", "Advice"):
        window.tab(tab)
        page.get_by_role("tab", name=tab, selected=True).wait_for()
        states.look(tab)
    window.tab("Against")
    page.locator(".df-few").first.fill("3")
    page.get_by_role("button", name="Compute").click()
    page.locator(".df-stage.df-over").wait_for()
    states.look("against a parameter, computed")
    window.tab("Set point")
    window.type("drive.A0", "-1")
    window.field("drive.A0").locator(".df-error").wait_for()
    states.look("a mistake")
    assert len(states.seen) >= 12
    assert {name: found for name, found in states.seen.items() if found} == {}
