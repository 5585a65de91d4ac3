"""The chart has the stage whatever is open, and no text lies over another."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect
from served import Window
from tiers import some_long

LEAST = 320  # px, height of the chart at 1366 x 768
OTHERS = [pytest.param(*size, marks=pytest.mark.long) for size in ((1920, 1080), (800, 900))]  # one size, 15 s
TABS = ("Set point", "Fit", "Against", "Motion", "Numbers", "What differs", "Advice")
# texts with the boxes of their lines, cut to what can be seen; glyphs fill about two thirds of a line
OVERLAPS = """() => {
    const boxes = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const node = walker.currentNode, owner = node.parentElement;
        if (!node.data.trim() || !owner.checkVisibility({visibilityProperty: true, opacityProperty: true})) continue;
        if (owner.closest(".df-hidden, title, script, style, option, .q-tooltip, .hoverlayer")) continue;
        const range = document.createRange();
        range.selectNodeContents(node);
        for (const one of range.getClientRects()) {
            let [left, top, right, bottom] = [one.left, one.top + one.height / 6, one.right, one.bottom - one.height / 6];
            for (let up = owner; up && up !== document.body; up = up.parentElement) {
                for (const head of up.children) { // what is scrolled under a heading that stays is covered by it
                    if (getComputedStyle(head).position !== "sticky" || head.contains(owner)) continue;
                    top = Math.max(top, head.getBoundingClientRect().bottom);
                }
                if (up instanceof SVGElement || getComputedStyle(up).overflow === "visible") continue;
                const box = up.getBoundingClientRect();
                [left, top] = [Math.max(left, box.left), Math.max(top, box.top)];
                [right, bottom] = [Math.min(right, box.right), Math.min(bottom, box.bottom)];
            }
            const text = node.data.trim().slice(0, 40);
            if (right - left > 1 && bottom - top > 1) boxes.push({text, owner, left, top, right, bottom});
        }
    }
    const found = [];
    for (const [n, one] of boxes.entries()) for (const other of boxes.slice(n + 1)) {
        const across = Math.min(one.right, other.right) - Math.max(one.left, other.left);
        const up = Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top);
        if (across > 1.5 && up > 1.5 && one.owner !== other.owner) found.push(one.text + " | " + other.text);
    }
    return found;
}"""
# buttons in the color of the accent, by their words without the name of an icon
FILLED = """() => [...document.querySelectorAll("button")].filter((one) =>
    one.checkVisibility({visibilityProperty: true, opacityProperty: true})
    && ["rgb(11, 92, 143)", "rgb(35, 119, 173)"].includes(getComputedStyle(one).backgroundColor)
).map((one) => one.innerText.split("\\n").at(-1))"""
SCROLLING = """() => [...document.querySelectorAll(".df-body *")].filter((one) => {
    const scrolls = (it) =>
        ["auto", "scroll"].includes(getComputedStyle(it).overflowY) && it.scrollHeight > it.clientHeight + 1;
    const all = [one];
    for (let up = one.parentElement; up; up = up.parentElement) all.push(up);
    return scrolls(one) && all.slice(1).some(scrolls);
}).map((one) => one.className)"""


# texts of the chart that reach beyond it
CUT = """() => {
    const frame = document.querySelector(".df-main").getBoundingClientRect();
    return [...document.querySelectorAll(".df-main svg text")].filter((one) => {
        const {width, left, right, top, bottom} = one.getBoundingClientRect();
        return width && (left < frame.left || right > frame.right || top < frame.top || bottom > frame.bottom);
    }).map((one) => one.textContent);
}"""
LONG_NAMES = (  # of quantities, in the order of the list
    "highest deflection", "peak force", "contact time", "apparent dissipated energy", "total dissipated energy",
)  # fmt: skip


@pytest.mark.parametrize("theme", some_long(("light", "dark"), long=["dark"]))
@pytest.mark.parametrize(("width", "height"), [(1366, 768), *OTHERS])
def test_the_chart_has_the_stage_and_no_text_lies_over_another(visit, width, height, theme):
    window = visit(width=width, height=height)
    page = window.page
    keep = page.get_by_role("button", name="Keep", exact=True)
    page.wait_for_function(
        "() => document.querySelector('.df-chip') || !document.querySelector('.df-kept button').disabled"
    )
    if keep.is_enabled():  # else a busy machine has run the case, and kept it
        keep.click()
    page.locator(".df-chip").first.wait_for()
    with window.redrawn():
        window.type("drive.A0", "14")
    if theme == "dark":
        page.get_by_role("button", name="Light or dark").click()
        page.locator("body.body--dark").wait_for()
    for tab in TABS:
        window.tab(tab)
        page.get_by_role("tab", name=tab, selected=True).wait_for()
        page.wait_for_timeout(300)  # the chart is fitted to its place
        assert page.locator(".df-main").bounding_box()["height"] >= LEAST, tab
        assert page.evaluate(OVERLAPS) == [], tab
        assert page.evaluate(SCROLLING) == [], tab
    stage, body = (page.locator(name).bounding_box() for name in (".df-stage", ".df-body"))
    assert stage["width"] >= (2 / 3 if width > 900 else 0.95) * body["width"]
    if width > 900:  # all of a motion is in sight
        window.tab("Motion")
        window.click(0, 0.9)
        page.locator(".df-tip").wait_for()
        panel = page.get_by_role("tabpanel", name="Motion")
        assert panel.evaluate("(one) => one.scrollHeight - one.clientHeight") == 0


def test_beside_a_form_above_it_the_chart_stays_in_sight_with_the_field_in_use_and_its_buttons_hide_no_text(visit):
    window = visit(width=800, height=900)
    page, chart = window.page, window.page.locator(".df-main")
    slider = window.parameter("drive.A0").locator("input[type=range]")
    with window.redrawn():
        slider.press("ArrowLeft")
    chart.get_by_text("before").wait_for()  # the longest legend
    buttons = chart.locator(".modebar").bounding_box()
    for text in chart.locator(".legendtext, .xtitle").all():
        box = text.bounding_box()
        assert box["x"] + box["width"] < buttons["x"] or box["y"] + box["height"] < buttons["y"]
    for _ in range(30):
        page.keyboard.press("Tab")
        bottom = page.evaluate(
            "() => document.activeElement.closest('.df-left') && document.activeElement.getBoundingClientRect().bottom"
        )
        top = page.locator(".df-stage").bounding_box()
        assert top["y"] + top["height"] <= 900 and (bottom is None or bottom <= top["y"])


@pytest.mark.parametrize(("width", "height"), [(1366, 640), pytest.param(800, 900, marks=pytest.mark.long)])
def test_no_choice_of_quantities_sets_one_text_of_the_chart_over_another(visit, width, height):
    window = visit(width=width, height=height)
    page = window.page
    switch = page.locator(".df-switches").get_by_role("checkbox")

    def look(what):
        page.mouse.move(0, 0)
        page.wait_for_timeout(400)  # the chart is fitted to its place
        assert page.locator(".df-stage").bounding_box()["height"] >= LEAST, what
        assert page.locator(".df-main svg").get_by_text("(nm)").first.is_visible(), what
        assert (page.evaluate(OVERLAPS), page.evaluate(CUT)) == ([], []), what

    def press(box):
        with window.redrawn():
            box.click()

    def looks(what):
        page.keyboard.press("Escape")
        look(what)
        page.evaluate("() => document.querySelector('.df-stage').classList.add('df-over')")  # beside a map
        look(f"{what}, beside a map")
        page.evaluate("() => document.querySelector('.df-stage').classList.remove('df-over')")
        page.get_by_role("button", name="Quantities").click()

    page.get_by_role("button", name="Quantities").click()
    for number, name in enumerate(LONG_NAMES, start=3):
        press(page.locator(".df-checks").get_by_role("checkbox", name=name).first)
        looks(number)
    press(switch.last)  # logarithmic
    looks("logarithmic")
    press(switch.last)
    press(switch.first)  # together, with an axis for each unit
    looks("together")


@pytest.mark.parametrize(("width", "height"), [(800, 900), pytest.param(1366, 768, marks=pytest.mark.long)])
def test_with_everything_open_the_chart_keeps_its_height_and_one_button_is_filled(visit, width, height):
    """A measured curve, all folds, a result over a parameter and a motion, one after the other."""
    window = visit(width=width, height=height, enter=Window.go)
    page = window.page

    def look(what):
        page.wait_for_timeout(400)  # the chart is fitted to its place
        stage = page.locator(".df-stage").bounding_box()
        assert stage["height"] >= LEAST, what
        assert page.evaluate(OVERLAPS) == [], what
        assert page.evaluate(SCROLLING) == [], what
        assert page.evaluate(FILLED) == ["Run"], what

    page.get_by_role("button", name="Explain my curve").click()
    assert page.evaluate(FILLED) == ["Start"]
    page.get_by_role("button", name="A stiff sample in air, measured").click()
    page.locator(".df-measured").wait_for()
    window.drawn()
    window.unfold()
    if width > 900:  # without scrolling, before lever and tip are told, too
        pane, fit = (page.locator(place).bounding_box() for place in (".df-pane", ".df-measured .df-main-button"))
        assert fit["y"] + fit["height"] < pane["y"] + pane["height"]
    page.get_by_role("button", name="Confirm lever and tip").click()
    look("fit")
    window.tab("Reconstruct")
    look("reconstruct")
    window.tab("Against")
    page.locator(".df-few").first.fill("3")
    page.get_by_role("button", name="Compute").click()
    page.locator(".df-stage.df-over").wait_for()
    page.get_by_role("button", name="Compute").wait_for()
    look("against")
    window.tab("Motion")
    page.locator(".df-stage.df-over").wait_for(state="detached")
    window.drawn()
    window.click(2, 0.95)  # of the model, where nothing was measured
    page.locator(".df-tip").wait_for()
    look("motion")


def test_a_dialog_has_the_one_button_that_is_filled(visit):
    window = visit()
    page = window.page
    page.get_by_role("button", name="File").click()
    page.get_by_role("menuitem").filter(has_text="Save figure").click()
    page.get_by_role("button", name="Save", exact=True).wait_for()
    assert page.evaluate(FILLED) == ["Save"]
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Save", exact=True).wait_for(state="detached")
    expect(page.get_by_role("button", name="File", exact=True)).to_be_focused()  # the keyboard goes on from there
    assert page.evaluate(FILLED) == ["Run"]


# words of choices that have no room in their box, beside its arrow
CUT_CHOICES = """() => {
    const pen = document.createElement("canvas").getContext("2d");
    return [...document.querySelectorAll(".df-form select.df-box")].flatMap((one) => {
        const look = getComputedStyle(one), room = one.clientWidth - 24;
        [pen.font, pen.letterSpacing] = [look.font, look.letterSpacing];
        return [...one.options].map((option) => option.label).filter((words) => pen.measureText(words).width > room);
    });
}"""


def test_no_choice_of_the_form_is_cut(window):
    window.unfold()
    window.page.get_by_text("Solver", exact=True).wait_for()
    assert window.page.evaluate(CUT_CHOICES) == []


def test_no_sentence_on_a_field_is_cut(window):
    window.page.locator(".df-entry").first.hover()
    cut = window.page.locator("#df-help").evaluate(
        """(help) => [...document.querySelectorAll(".df-entry")].filter((entry) => {
            entry.dispatchEvent(new MouseEvent("mouseover", {bubbles: true}));
            return help.scrollHeight > help.clientHeight || help.getBoundingClientRect().bottom > innerHeight;
        }).map((entry) => entry.dataset.name)"""
    )
    assert cut == []
    last = window.page.locator("#df-help code").inner_text()
    window.open_example("figure-3-air")
    expect(window.page.locator("#df-help")).not_to_contain_text(last)  # of a field of the case before


def test_number_and_unit_of_a_field_have_one_frame_while_it_is_typed(window):
    field = window.field("drive.A0")
    field.locator("input.df-box").focus()
    box, unit = field.locator("input.df-box"), field.locator(".df-unit")
    color = "(one) => getComputedStyle(one).borderTopColor"
    assert box.evaluate("(one) => getComputedStyle(one).outlineStyle") == "none"  # which would cover the unit
    assert (
        box.evaluate(color) == unit.evaluate(color) != window.field("cantilever.Q").locator(".df-box").evaluate(color)
    )


@pytest.mark.parametrize(("width", "height"), [(1093, 614), (911, 512)])  # of a small laptop, at 125 % and 150 %
def test_in_a_short_window_the_chart_is_no_taller_than_the_window(window, width, height):
    page = window.page
    page.set_viewport_size({"width": width, "height": height})
    try:
        page.wait_for_timeout(300)  # the chart is fitted to its place
        assert LEAST <= page.locator(".df-main").bounding_box()["height"] < height
    finally:
        page.set_viewport_size({"width": 1366, "height": 768})


def test_no_sentence_of_the_answer_to_a_fit_is_cut(window):
    text = "The fit was stopped: these are the best values so far. " + "Hamaker constant = 373 ± 87 zJ, " * 8
    cut = """(one, text) => {
        const other = one.cloneNode();
        other.classList.add("df-long");
        other.textContent = text;
        one.after(other);
        const hidden = other.scrollHeight - other.clientHeight;
        other.remove();
        return hidden;
    }"""
    assert window.page.locator(".df-answer").evaluate(cut, text) <= 1


def test_no_line_of_the_answer_ends_between_a_number_and_its_error_or_unit(window):
    answer = window.page.locator(".df-answer")
    expect(answer).to_contain_text("deep")  # of the state that is found a moment later
    said = answer.text_content()
    assert "at 80\N{NO-BREAK SPACE}%: " in said and "\N{NO-BREAK SPACE}nm deep" in said
    whole = window.page.evaluate("(text) => dforceWhole(text)", "E of contact = 14.6 ± 5.2 Pa s, R = 8 nm")
    assert whole.split(" ") == [
        "E",
        "of",
        *(part.replace(" ", "\N{NO-BREAK SPACE}") for part in ("contact = 14.6 ± 5.2 Pa s,", "R = 8 nm")),
    ]


@pytest.mark.parametrize("width", [800, pytest.param(1366, marks=pytest.mark.long)])
def test_no_text_of_the_first_page_lies_over_another(visit, width):
    window = visit(width=width)
    window.page.get_by_role("button", name="dForce").click()
    window.page.locator(".df-start").wait_for()
    assert window.page.evaluate(OVERLAPS) == []


# words of defaults that have no room in their box
CUT_DEFAULTS = """() => {
    const pen = document.createElement("canvas").getContext("2d");
    return [...document.querySelectorAll(".df-form input.df-box:placeholder-shown")].filter((one) => {
        const look = getComputedStyle(one, "::placeholder");
        pen.font = `${look.fontStyle} ${look.fontSize} ${look.fontFamily}`;
        return pen.measureText(one.placeholder).width > one.clientWidth - 8;
    }).map((one) => one.placeholder);
}"""


def test_no_default_of_the_form_is_cut(window):
    window.unfold()
    window.page.get_by_text("Solver", exact=True).wait_for()
    assert window.page.evaluate(CUT_DEFAULTS) == []


def test_the_fields_of_the_first_page_and_its_button_share_a_line(visit):
    window = visit(enter=Window.go)
    page = window.page
    page.get_by_role("button", name="Safe settings").click()
    page.get_by_role("combobox", name="Lever").click()
    page.get_by_role("option", name="OTESPA").first.click()
    sample = page.get_by_role("combobox", name="Sample")
    sample.fill("borosil")
    sample.press("Enter")  # takes the first that matches, marked yet or not
    page.get_by_text("Nominal values of the sample").wait_for()
    boxes = [page.get_by_label("Quality factor Q"), page.get_by_role("button", name="Start", exact=True)]
    middles = [box["y"] + box["height"] / 2 for box in (one.bounding_box() for one in boxes)]
    assert abs(middles[0] - middles[1]) < 12
    for name in ("Undo", "Redo"):  # of a case that is not in sight
        assert not page.get_by_role("button", name=name).is_visible()


def test_a_name_typed_on_the_first_page_without_enter_is_taken_or_said_to_match_nothing(visit):
    window = visit(enter=Window.go)
    page, start = window.page, window.page.get_by_role("button", name="Start", exact=True)
    page.get_by_role("button", name="Safe settings").click()
    lever, sample = (page.get_by_role("combobox", name=name, exact=True) for name in ("Lever", "Sample"))
    lever.click()
    lever.press_sequentially("ppp-nchr")
    start.click()  # at once: the lever is taken before the case is made
    expect(window.field("cantilever.name").locator("input")).to_have_value("PPP-NCHR")
    page.get_by_role("button", name="dForce").click()
    start.wait_for()
    sample.click()
    sample.press_sequentially("xyz")
    start.click()
    page.get_by_text("No sample matches “xyz”; type your values after Start.").wait_for()
    assert lever.input_value().startswith("PPP-NCHR")
    tops = [one.locator("xpath=ancestor::label").bounding_box()["y"] for one in (lever, sample)]
    assert abs(tops[0] - tops[1]) < 1.0  # the sentence below one field moves no other
    lever.click()
    lever.fill("otespa")
    page.get_by_role("option", name="OTESPA").first.wait_for()
    lever.press("Escape")  # the lever stays
    expect(lever).to_have_value(re.compile("PPP-NCHR"))
    sample.click()
    sample.press_sequentially("borosil")
    sample.press("Tab")  # before the match is marked
    expect(sample).to_have_value(re.compile("orosilicate"))
    sample.fill("xyz")
    start.click()
    page.get_by_text("No sample matches “xyz”; type your values after Start.").wait_for()
    start.click()  # once more, with an empty field
    start.wait_for(state="hidden")


def test_on_a_phone_a_case_begins_at_its_top_and_no_button_lies_over_a_title(visit):
    window = visit(width=375, height=740)
    assert window.page.evaluate("() => window.scrollY") == 0
    chart = window.page.locator(".df-main")
    chart.scroll_into_view_if_needed()
    chart.hover()
    window.page.wait_for_timeout(300)
    expect(chart.locator(".modebar-btn")).to_have_count(0)
    chart.locator(".df-chart").press("ArrowRight")
    chart.locator(".df-chart").press("Enter")
    window.page.locator(".df-tip").wait_for()
    motion = window.page.get_by_role("tabpanel", name="Motion")
    assert motion.evaluate("(one) => one.scrollWidth - one.clientWidth") <= 0
    for amplitude in ("14", "16"):
        window.page.get_by_role("button", name="Keep", exact=True).click()
        with window.redrawn():
            window.type("drive.A0", amplitude)
    expect(window.page.locator(".df-chip")).to_have_count(3)
    names = window.page.locator(".df-chip-name").evaluate_all("(all) => all.map((one) => one.clientWidth)")
    assert min(names) > 25
    window.page.get_by_role("button", name="dForce").click()
    mark, mode = (window.page.get_by_role("button", name=name).bounding_box() for name in ("dForce", "Light or dark"))
    assert abs(mark["y"] - mode["y"]) < 20  # one line of the header


def test_one_sentence_at_a_time_lies_over_the_page_and_a_mistake_dims_the_answer(window):
    page, notes = window.page, window.page.locator(".q-notification")
    for name in ("one.csv", "two.csv", "three.csv"):
        page.locator(".df-upload input[type=file]").set_input_files(
            {"name": name, "mimeType": "text/csv", "buffer": b"hello,world\n" * 30}
        )
        notes.filter(has_text=name).wait_for()
    expect(notes).to_have_count(1)
    notes.get_by_role("button", name="Close").click()
    color = "(one) => getComputedStyle(one).color"
    answer = page.locator(".df-answer")
    before = answer.evaluate(color)
    window.type("drive.A0", "-1")
    page.locator(".df-answer.df-behind").wait_for()
    assert answer.evaluate(color) != before
