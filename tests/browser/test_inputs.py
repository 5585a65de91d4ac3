"""What a person does with the forms."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

import dforce as df
from dforce.gui.case.fields import name_of

AMPLITUDE = "drive.A0"


def wrong(window, path):
    """Return the sentence at a field, waiting for one."""
    error = window.field(path).locator(".df-error")
    error.wait_for()
    return error.inner_text()


def test_an_example_from_the_menu_shows_its_curves(window):
    window.start("figure-3-water")


TYPED = ((" 12 nm", "nm", "12 nm"), ("8,5", "nm", "8.5 nm"), ("0.02 um", "um", "20 nm"), ("1.1e-8 m", "m", "11 nm"))
MISTAKES = (
    ("-1", "is not above 0 nm"), ("abc", "is not a number"), ("10 kg", "kg"), ("__import__('os')", "is not a number"),
    ("1,000", "thousands"), ("<img src=x onerror=alert(1)>", "is not a number"), ("", "missing"),
    ("12 nm**9**9**9**9", "is not a unit"),
)  # fmt: skip


def test_what_is_typed_is_what_is_computed(window):
    for text, unit, meant in TYPED:
        window.type(AMPLITUDE, text)
        window.shows(df.example("figure-3-air").replace(AMPLITUDE, meant))
        assert window.field(AMPLITUDE).locator(".df-unit").input_value() == unit, text


def test_a_mistake_is_said_at_its_field_and_the_curve_waits(window):
    for text, sentence in MISTAKES:
        window.type(AMPLITUDE, text)
        expect(window.field(AMPLITUDE).locator(".df-error")).to_contain_text(sentence)
        assert window.field(AMPLITUDE).locator("input").get_attribute("aria-invalid") == "true", text
        window.page.locator(".df-main .df-chart.stale").wait_for()
        window.page.locator(
            ".df-behind[aria-label='at the set point']"
        ).wait_for()  # the numbers below it turn gray by this
    window.type(AMPLITUDE, "8")
    window.shows(df.example("figure-3-air").replace(AMPLITUDE, "8 nm"))
    assert window.field(AMPLITUDE).locator(".df-error").count() == 0
    window.page.wait_for_function("() => !document.querySelector('.df-chart.stale, .df-behind')")


def test_another_unit_shows_another_number_for_the_same_curve(window):
    window.field(AMPLITUDE).locator(".df-unit").select_option("um")
    window.page.wait_for_function(
        "(field) => field.value === '0.01'", arg=window.field(AMPLITUDE).locator("input").element_handle()
    )
    window.shows(df.example("figure-3-air"))


def test_a_mistake_opens_the_fold_that_it_stands_in(window):
    fold = window.page.locator(".df-form details", has_text="More settings").last
    tolerance = window.field("solver.relative_tolerance")
    assert fold.get_attribute("open") is None
    window.page.evaluate("() => document.querySelectorAll('.df-form details').forEach((one) => { one.open = true; })")
    for _ in range(2):
        tolerance.locator("input").evaluate("""(box) => {  // typed and folded at once: the answer comes after both
            box.focus();  // else what a figure brings takes the place of what is typed
            box.value = "-1";
            box.dispatchEvent(new Event("input", {bubbles: true}));
            document.querySelectorAll(".df-form details").forEach((one) => { one.open = false; });
        }""")
        tolerance.locator(".df-error").wait_for()
        tolerance.locator("input").fill("")
        tolerance.locator(".df-error").wait_for(state="detached")


@pytest.mark.long
def test_each_force_model_brings_its_fields_with_units_and_goes_again(window):
    window.type(AMPLITUDE, "")  # what is incomplete is not computed, so that no model is compiled here
    window.page.get_by_role("button", name="remove DMT").click()
    window.page.locator(".df-card").wait_for(state="detached")
    for name, model in sorted(df.forces.REGISTRY.items()):
        words = name_of(model)
        window.page.get_by_role("button", name="Add a force").click()
        window.page.get_by_role("menuitem").filter(has=window.page.get_by_text(words, exact=True)).click()
        card = window.page.locator(".df-card")
        card.wait_for()
        window.unfold()
        shown = set(
            card.locator(".df-entry").evaluate_all("(all) => all.map((one) => one.dataset.path.split('.').pop())")
        )
        own = {key for key, quantity in model.quantities().items() if key in model.keys()}  # noqa: SIM118
        assert not model.ways or shown & own
        if not model.ways:
            assert own <= shown, name
        units = card.locator(".df-entry:has(input.number)").evaluate_all(
            "(all) => all.filter((one) => one.dataset.unit && !one.querySelector('.df-unit')).map((one) => one.dataset.path)"
        )
        assert units == [], name
        assert card.locator(".df-error").count() == 0, name
        card.get_by_role("button", name=f"remove {words}").first.click()
        card.wait_for(state="detached")


def test_a_force_that_is_switched_off_is_left_out_of_the_curves(window):
    both = df.example("figure-3-air")
    window.page.get_by_role("button", name="Add a force").click()
    with window.remade():
        window.page.get_by_role("menuitem").filter(has=window.page.get_by_text("Kelvin–Voigt", exact=True)).click()
    with window.remade():
        window.page.get_by_role("switch", name="Kelvin–Voigt takes part").click()
    window.shows(both)


def test_a_letter_in_a_field_that_is_made_anew_comes_back_with_no_later_page(window):
    window.type(AMPLITUDE, "5")
    window.shows(df.example("figure-3-air").replace(AMPLITUDE, "5 nm"))
    with window.remade():
        window.field(AMPLITUDE).locator("input").evaluate("""(box) => {  // typed and undone at once
            box.focus();
            box.value = "77";
            box.dispatchEvent(new Event("input", {bubbles: true}));
            document.querySelector("[aria-label='Undo']").click();
        }""")
    window.page.wait_for_timeout(300)  # longer than a letter waits
    assert window.page.evaluate("() => dforceUnsent.left()") == []
    window.page.reload()
    window.shows(df.example("figure-3-air"))


def test_undo_and_redo_go_through_the_edits(window):
    page = window.page
    window.type(AMPLITUDE, "5")
    window.shows(df.example("figure-3-air").replace(AMPLITUDE, "5 nm"))
    page.get_by_role("button", name="Undo").click()
    window.shows(df.example("figure-3-air"))
    page.get_by_role("button", name="Redo").click()
    window.shows(df.example("figure-3-air").replace(AMPLITUDE, "5 nm"))


def test_advice_stands_beside_the_field_that_it_is_about(window):
    window.type("cantilever.Q", "1.2")
    piece = next(
        piece
        for piece in df.advice(df.example("figure-3-air").replace("cantilever.Q", 1.2))
        if "cantilever.Q" in piece.about
    )
    window.field("cantilever.Q").locator(".df-advice", has_text=piece.text.split(",")[0]).wait_for()


def test_a_reload_keeps_what_was_typed_even_half_typed(window):
    window.type("tip.radius", "12 n")
    wrong(window, "tip.radius")
    window.page.reload()
    assert window.field("tip.radius").locator("input").input_value() == "12 n"
    expect(window.page.get_by_label("title of the case")).to_have_value(f"{df.example('figure-3-air').title}, edited")


def test_a_law_that_is_not_entered_stays_a_draft_of_its_own_case(window):
    page, typed = window.page, "-P1*exp("
    law = page.get_by_label("The force", exact=True)

    def add():
        page.get_by_role("button", name="Add a force").click()
        page.get_by_role("searchbox", name="search the forces").fill("own")
        page.get_by_role("menuitem", name="Own law").click()
        expect(law).to_be_focused()

    add()
    law.fill(typed)
    page.get_by_text("is not an expression").wait_for()
    page.reload()
    window.drawn()
    expect(law).to_have_value(typed)
    page.get_by_text("is not an expression").wait_for()
    page.get_by_role("button", name="Undo").click()  # of the force: no law was entered
    expect(law).to_have_count(0)
    with window.remade():
        window.example("figure-3-water")
    add()
    expect(law).to_have_value(df.forces.Custom.example["law"])


def test_a_force_is_found_by_its_words(window):
    page = window.page
    page.get_by_role("button", name="Add a force").click()
    page.get_by_role("dialog", name="add a force").wait_for()
    page.get_by_role("searchbox", name="search the forces").fill("cells gel")
    assert page.get_by_role("menuitem").all_inner_texts()[0].startswith("Power-law rheology")
    assert page.get_by_role("menuitem").count() == 1
    page.get_by_role("searchbox", name="search the forces").fill("prony")
    page.get_by_role("menuitem", name="Generalized Maxwell solid").wait_for()
    assert page.get_by_role("menuitem").count() == 1
    page.get_by_role("searchbox", name="search the forces").fill("no such force")
    page.get_by_text("No force has these words").wait_for()
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="detached")


def test_a_refused_end_of_a_slider_gives_way_to_the_end_in_use(window):
    end = window.page.locator(".df-slider-end").last
    before = end.input_value()
    end.fill("2e400")
    end.press("Enter")
    expect(end).to_have_value(before)
