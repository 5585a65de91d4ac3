"""What a person does with results: choose what is drawn, click on a curve, keep and compare."""

from __future__ import annotations

import pytest

import dforce as df
from dforce.core.units import parse
from dforce.gui.document.document import FIRST

AMPLITUDE = "drive.A0"


def test_a_click_on_a_curve_shows_the_motion_there(window):
    case = window.start("figure-3-air-jump")
    along = window.click(0, 0.45)
    motion = window.page.locator(".df-motion[data-state='done']")
    motion.wait_for()
    result = df.run(case).sel(zc=along * 1e-9, method="nearest").sel(direction="retract")
    force = motion.get_by_role("img", name="force over time").get_attribute("aria-label")
    assert force is not None
    largest = float(force.split(" to ")[1].split()[0])
    assert largest * 1e-12 == pytest.approx(float(result.peak_force), rel=0.02)  # three digits are said
    depth = motion.get_by_role("img", name="tip above the sample").get_attribute("aria-label")
    assert float(depth.split()[-2]) * 1e-9 == pytest.approx(float(result.max_indentation), rel=0.02)
    # a frame that began before the press: the page's console stays empty
    window.page.evaluate("() => { performance.now = () => Performance.prototype.now.call(performance) + 200; }")
    motion.get_by_role("button", name="Play").click()
    window.page.wait_for_function("() => document.querySelector('.df-motion-play input').valueAsNumber > 0")
    window.page.evaluate("() => { delete performance.now; }")
    window.tab("Set point")
    motion.wait_for(state="hidden")


def test_results_kept_are_drawn_over_each_other_and_their_difference_is_listed(visit):
    window = visit()
    page = window.page
    page.get_by_role("button", name="Keep", exact=True).click()
    page.locator(".df-chip").first.wait_for()
    window.type(AMPLITUDE, "8")
    far_away = """() => document.querySelector('.df-main .df-plot')._fullData.filter((one) => one.meta === 'amplitude')
        .map((one) => Math.round(Math.max(...[...one.y].filter(Number.isFinite)))).sort().join()"""
    page.wait_for_function(f"() => ({far_away})() === '20,20,8,8'")
    window.tab("What differs")
    table = page.get_by_role("region", name="differences").get_by_role("table")
    table.wait_for()
    assert "8 nm" in table.inner_text()
    assert "20 nm" in table.inner_text()
    page.locator(".df-kept").get_by_role("button", name="remove").click()
    window.shows(df.example(FIRST).replace(AMPLITUDE, "8 nm"))


@pytest.mark.long
def test_the_free_amplitude_that_keeps_the_force_low_at_the_set_point_is_found_with_the_slider(visit):
    window = visit()
    forces = window.page.locator(".df-setpoint tbody td:nth-child(3)")
    handle = window.page.locator('.df-slider input[type="range"]')
    forces.first.wait_for()
    while True:
        before = forces.all_inner_texts()
        if max(0.0 if text == "none" else parse(text, "N") for text in before) < 200e-12:
            break
        handle.press("PageDown")  # whatever has the focus in a page that opens
        window.page.wait_for_function(  # the table comes after the curves
            """(before) => [...document.querySelectorAll(".df-setpoint tbody td:nth-child(3)")]
                .map((one) => one.innerText).join() !== before""",
            arg=",".join(before),
        )
    found = float(handle.input_value())
    assert 12.0 <= found < 13.0  # below, the repulsive state is never reached
    case = df.example(FIRST).replace(AMPLITUDE, f"{found} nm")
    states = df.at_set_point(df.run(case), 0.8, ["peak_force"])
    assert float(states["peak_force"].max()) < 200e-12


def test_no_button_of_a_chart_sends_it_away(window):
    buttons = window.page.locator(".df-main .modebar-btn").evaluate_all("(all) => all.map((one) => one.dataset.title)")
    assert buttons == ["Zoom", "Pan", "Zoom in", "Zoom out", "Autoscale", "Reset axes"]


def test_any_quantity_is_drawn_against_any_other(window):
    page = window.page
    page.get_by_label("picture", exact=True).select_option(label="forces")
    page.wait_for_function(
        "() => document.querySelector('.df-main .df-plot')._fullData.some((one) => one.meta === 'peak_force')"
    )
    page.get_by_role("button", name="Quantities").click()
    page.locator(".df-against select").select_option("amplitude")
    page.keyboard.press("Escape")
    page.wait_for_function(
        "() => document.querySelector('.df-main .df-plot').layout.xaxis.title?.text?.includes('amplitude')"
    )
    page.get_by_label("picture", exact=True).select_option(label="amplitude and phase")
