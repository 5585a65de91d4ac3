"""Sliders, runs, and what happens when the connection or the server goes away."""

from __future__ import annotations

import contextlib
import itertools

import numpy as np
import pytest
from served import served
from tiers import some_long

import dforce as df
from dforce.gui.document.document import FIRST

AMPLITUDE = "drive.A0"
DROP = """() => {
    const data = new DataTransfer();
    data.items.add(new File(["1"], "curve.csv"));
    document.dispatchEvent(new DragEvent("drop", {dataTransfer: data}));
}"""
# paths of lines and rings after a move of the slider, and after a full redraw; not before a newer move or height is drawn
BOTH_WAYS = """() => {
    const chart = document.querySelector(".df-main .df-chart"), plot = chart.querySelector(".df-plot");
    const seen = () => [...plot.querySelectorAll(".js-line, .shapelayer path")].map((one) => one.getAttribute("d"));
    const animate = Plotly.animate;
    let begun = 0, drawn = 0, told = 0, sent = [];
    window.moves = [];
    Plotly.animate = (...all) => { begun += 1; sent = all[1].data; return animate(...all); };
    plot.on("plotly_transitioning", () => { drawn = begun; });
    new MutationObserver(() => {
        if (Math.abs(plot._fullLayout.height - chart.clientHeight) > 1) return;
        if (drawn !== begun || drawn === told || sent.some((one, n) => one.y?.bdata !== plot.data[n].y?.bdata)) return;
        told = drawn;
        const followed = seen();
        const ring = plot.layout.shapes[0].yanchor, free = Math.max(...plot._fullData[0].y);
        Plotly.redraw(plot);
        window.moves.push([followed, seen(), ring / free]);
    }).observe(chart, {attributeFilter: ["data-revision"]});
}"""


def slider(window, path):
    """Put a parameter on a slider; the free amplitude has one from the beginning."""
    if not window.page.locator(f'.df-slider[data-path="{path}"]').count():
        window.field(path).get_by_role("button", name="put on a slider").click()
    handle = window.page.locator(f'.df-slider[data-path="{path}"] input[type="range"]')
    handle.wait_for()
    return handle


def drag(window, handle, stop, steps=25):
    """Drag a slider from where it is to a share of its length, as a hand does."""
    begin, middle, box = window.grip(handle)
    end = box["x"] + box["width"] * stop
    with window.redrawn():
        window.page.mouse.move(0.5 * (begin + end), middle, steps=steps)
    with window.redrawn():
        window.page.mouse.move(end, middle, steps=steps)
    window.page.mouse.up()
    return handle.evaluate("(one) => one.value")


def test_the_curves_follow_a_slider_to_where_it_is_let_go(window):
    before = window.revision()
    value = drag(window, slider(window, AMPLITUDE), 0.2)
    assert float(value) < 8.0
    window.shows(df.example("figure-3-air").replace(AMPLITUDE, f"{value} nm"))
    assert window.revision() - before > 1  # while it was dragged, too
    assert float(window.field(AMPLITUDE).locator("input").input_value()) == float(value)
    window.page.get_by_role("button", name="Undo").click()  # a drag is one step
    window.shows(df.example("figure-3-air"))


def test_the_lines_that_follow_a_slider_are_those_of_a_chart_that_is_drawn_anew(window):
    handle = slider(window, AMPLITUDE)
    window.page.evaluate(BOTH_WAYS)
    _, middle, box = window.grip(handle)
    for share in (0.2, 0.25, 0.3, 0.35):
        with window.redrawn():
            window.page.mouse.move(box["x"] + share * box["width"], middle)
    moves = window.page.evaluate("() => window.moves")
    window.page.mouse.up()
    assert len({str(followed) for followed, _, _ in moves}) > 1
    for followed, anew, share in moves:
        assert followed == anew
        assert share == pytest.approx(
            0.8, rel=1e-3
        )  # the ring of this curve at its set point, not that of the one before


def test_a_chart_fills_its_room_where_that_changes_while_a_slider_is_held(window):
    chart = window.page.locator(".df-main .df-chart")
    _, middle, box = window.grip(slider(window, AMPLITUDE))
    with window.redrawn():
        window.page.mouse.move(box["x"] + 0.2 * box["width"], middle)
    chart.evaluate(
        """(one) => {
            const plot = one.querySelector(".df-plot");
            window.beyond = [];
            new MutationObserver(() => window.beyond.push(Math.round(plot._fullLayout.height - one.clientHeight)))
                .observe(one, {attributeFilter: ["data-revision"]});
            one.style.height = "80%";  // as a longer answer above it takes room
        }"""
    )
    for share in (0.3, 0.4):
        with window.redrawn():
            window.page.mouse.move(box["x"] + share * box["width"], middle)
    beyond = window.page.evaluate("() => window.beyond")
    chart.evaluate("(one) => { one.style.height = ''; }")
    window.page.mouse.up()
    assert len(beyond) > 1
    assert not any(beyond)


def test_the_curve_from_which_a_slider_came_stays_where_it_was(visit):
    window = visit()
    curve = """(ghost) => { const traces = document.querySelector(".df-main .df-plot")._fullData;
                            return [...traces.find((one) => (one.meta === "ghost") === ghost).y]; }"""
    before = window.page.evaluate(curve, False)
    window.page.evaluate(
        """() => {
            document.querySelector(".df-main .df-chart").style.height = "80%";  // drawn anew with its ghost before it moves
            window.dispatchEvent(new Event("df-hold"));
        }"""
    )
    window.page.wait_for_function(
        "() => document.querySelector('.df-main .df-plot')._fullData.some((one) => one.meta === 'ghost')"
    )
    _, middle, box = window.grip(slider(window, AMPLITUDE))
    for share in (0.2, 0.3, 0.4):
        with window.redrawn():
            window.page.mouse.move(box["x"] + share * box["width"], middle)
    window.page.evaluate("() => Plotly.redraw(document.querySelector('.df-main .df-plot'))")
    ghost, now = (window.page.evaluate(curve, which) for which in (True, False))
    window.page.mouse.up()
    assert ghost == before != now


def test_a_slider_sends_the_newest_value_and_no_two_messages_close_together(window):
    handle = slider(window, AMPLITUDE)
    sent = handle.evaluate(
        """async (one) => {
            const sent = [], emit = window.socket.emit;
            window.socket.emit = function (name, ...all) {
                if (name === "event") sent.push([performance.now(), all[0].args]);
                return emit.call(this, name, ...all);
            };
            for (let n = 0; n <= 100; n++) {
                one.value = 6 + 0.02 * n;
                one.dispatchEvent(new Event("input"));
                await new Promise((then) => setTimeout(then, 4));
            }
            await new Promise((then) => setTimeout(then, 200));
            window.socket.emit = emit;
            return sent;
        }"""
    )
    times = [time for time, _ in sent]
    assert min(after - before for before, after in itertools.pairwise(times)) > 30.0  # ms; 30 a second at most
    assert "8" in str(sent[-1][1])


def test_a_slider_shows_what_is_typed_right_after_it_was_dragged(window):
    handle = slider(window, AMPLITUDE)
    drag(window, handle, 0.2)
    window.type(AMPLITUDE, "9")
    window.page.wait_for_function("(one) => one.valueAsNumber === 9", arg=handle.element_handle())
    window.shows(df.example("figure-3-air").replace(AMPLITUDE, "9 nm"))


@pytest.mark.long  # tests/gui/test_shown.py says the same of a simulated page
def test_the_result_of_a_run_is_not_drawn_under_the_title_of_the_next_example(window):
    page = window.page
    window.unfold()
    window.field("solver.method").locator("select").select_option("transient")
    window.type("experiment.zc.points", "101")
    page.get_by_role("status").filter(has_text="press Run").wait_for()
    page.get_by_role("button", name="Run").click()
    page.get_by_text("of 202").wait_for()
    window.example("resonance-curve")
    stop = page.get_by_role("button", name="Stop")
    stop.wait_for(state="hidden")
    page.wait_for_function(  # it is drawn in the end, by itself
        """() => Object.entries(document.querySelector(".df-main .df-plot")._fullLayout ?? {}).some(
            ([name, axis]) => name.startsWith("xaxis") && axis.title?.text?.includes("frequency"))"""
    )
    title = page.get_by_role("textbox", name="title of the case")
    assert title.input_value() == df.examples()["resonance-curve"].title


def test_a_zoom_survives_a_redraw(window):
    zoom = "() => document.querySelector('.df-main .df-plot').layout.xaxis.range.map((x) => Math.round(x))"
    window.page.evaluate("() => Plotly.relayout(document.querySelector('.df-main .df-plot'), {'xaxis.range': [4, 6]})")
    window.type(AMPLITUDE, "9")
    window.shows(df.example("figure-3-air").replace(AMPLITUDE, "9 nm"))
    assert window.page.evaluate(zoom) == [4, 6]


def test_a_run_shows_how_far_it_is_stops_within_a_second_and_keeps_what_it_has(window):
    page = window.page
    window.unfold()
    window.field("solver.method").locator("select").select_option("transient")
    window.type("solver.settle_tolerance", "1e-12")
    window.type("experiment.zc.points", "2001")
    page.get_by_role("status").filter(has_text="press Run").wait_for()
    page.get_by_role("button", name="Run").click()
    page.get_by_text("of 4002").wait_for()  # both directions
    bar = page.get_by_role("progressbar", name="progress of the run")
    page.wait_for_function("(bar) => bar.value > 0", arg=bar.element_handle())
    before = window.revision()
    stop = page.get_by_role("button", name="Stop")
    page.evaluate("() => { window.stopped = performance.now(); }")
    stop.click()
    stop.wait_for(state="hidden")
    seconds = page.evaluate("() => (performance.now() - window.stopped) / 1000")
    page.get_by_text("stopped at").wait_for()
    window.drawn(before)
    reached = [sum(y == y for y in line) for line in window.lines("amplitude")]
    assert 0 < sum(reached) < 4002
    assert seconds < 5.0  # a second on a machine that is not busy: see benchmarks/window.py
    page.reload()
    page.get_by_text("stopped at").wait_for()


@contextlib.contextmanager
def cut(window):
    """Cut the connection of a page, and bring it back."""
    window.page.context.set_offline(True)
    window.page.evaluate("() => window.socket.io.engine.close()")
    window.page.get_by_text("Connection lost").wait_for()
    try:
        yield
    finally:
        window.page.context.set_offline(False)
    window.page.get_by_text("Connection lost").wait_for(state="hidden")


@pytest.mark.long  # the test below says the same of a server that is gone
def test_what_is_typed_without_a_connection_arrives_when_it_is_back(visit):
    window = visit(lost=True)
    with cut(window):
        window.type(AMPLITUDE, "7")
    window.shows(df.example(FIRST).replace(AMPLITUDE, "7 nm"))
    assert window.field(AMPLITUDE).locator("input").input_value() == "7"


def test_a_server_that_was_killed_and_started_again_has_what_was_typed(visit, tmp_path):
    with served(tmp_path) as server:
        window = visit(server, lost=True)
        window.type(AMPLITUDE, "6")
        window.type("cantilever.Q", "20 N/m")  # not yet a value
        window.field("cantilever.Q").locator(".df-error").wait_for()
        window.saved("20 N/m")
        server.kill()
        window.page.get_by_text("Connection lost").wait_for()
        window.page.evaluate(DROP)
        said = window.page.get_by_text("The server does not answer, or its disk is full, so the file was not opened.")
        said.wait_for()
        window.page.get_by_role("button", name="Close").click()
        said.wait_for(state="detached")
        curve = {"name": "curve.csv", "mimeType": "text/csv", "buffer": b"1"}  # chosen, in the dialog of the menu
        window.page.locator(".df-upload input[type=file]").set_input_files(curve)
        said.wait_for()
        window.type("cantilever.k", "0.8")  # while there is no server
        window.field("cantilever.k").locator("input").press("Tab")
        window.page.wait_for_timeout(600)  # a field that was left shows the value read, once there is one
        assert window.field("cantilever.k").locator("input").input_value() == "0.8"
        with window.page.expect_event("load"):  # the page finds its server again by itself
            server.start()
        assert window.field("cantilever.Q").locator("input").input_value() == "20 N/m"
        window.type("cantilever.Q", "255")
        window.shows(df.example(FIRST).replace(AMPLITUDE, "6 nm").replace("cantilever.k", 0.8))


def test_what_could_not_be_sent_stays_in_the_browser_until_the_server_has_it(window):
    asked = """() => {
        const number = dforceUnsent.put("gone.with.the.form", "1", "");
        const left = [dforceUnsent.left(), dforceUnsent.left()].map((all) => all.map((one) => one[0]));
        dforceUnsent.arrived("gone.with.the.form", number);
        return [...left, dforceUnsent.left().map((one) => one[0])];
    }"""
    first, again, after = window.page.evaluate(asked)
    assert first == again
    assert "gone.with.the.form" in first and "gone.with.the.form" not in after


@pytest.mark.parametrize("width", some_long([1366, 1024, 620], long=[1024]))
def test_nothing_is_wider_than_the_window(window, width):
    window.page.set_viewport_size({"width": width, "height": 768})
    try:
        for tab in window.page.get_by_role("tab").all():
            tab.click()
            window.page.wait_for_function("(width) => document.documentElement.scrollWidth <= width", arg=width)
    finally:
        window.page.set_viewport_size({"width": 1366, "height": 768})


def test_on_a_narrow_screen_the_form_comes_first_and_then_the_chart(window):
    window.page.set_viewport_size({"width": 800, "height": 768})
    try:
        form, chart = (window.page.locator(name).bounding_box() for name in (".df-left", ".df-main"))
        assert form["y"] < chart["y"] < 768 - 320  # the chart stays in sight while the form scrolls behind it
        assert form["width"] == 800 and chart["width"] > 760
    finally:
        window.page.set_viewport_size({"width": 1366, "height": 768})


def test_the_forms_have_one_scroll_bar(window):
    scrolling = """() => [...document.querySelectorAll(".df-left *")].filter((one) =>
        ["auto", "scroll"].includes(getComputedStyle(one).overflowY) && one.scrollHeight > one.clientHeight + 1
    ).map((one) => one.className)"""
    assert len(window.page.evaluate(scrolling)) == 1


def test_a_thermal_spectrum_is_chosen_drawn_on_two_logarithmic_axes_and_told_in_numbers(window):
    page = window.page
    kinds = page.locator("select").filter(has_text="thermal spectrum").first
    with window.redrawn():
        kinds.select_option(label="thermal spectrum")
    page.wait_for_function("() => document.querySelector('.df-main .df-plot').layout.xaxis.type === 'log'")
    density, fitted = (np.array(window.lines(name)[0], float) for name in ("spectral_density", "fitted_density"))
    near = np.isfinite(fitted)
    assert 0 < near.sum() < len(density) == len(fitted)
    assert np.mean(density[near] / fitted[near]) == pytest.approx(1.0, abs=0.05)
    case = df.example("figure-3-air")
    window.tab("Thermal tune")
    told = page.get_by_role("region", name="numbers of the fit")
    for finding in df.summary(df.thermal_spectrum(case, "1 s")):
        told.get_by_text(finding.text, exact=True).first.wait_for()
    page.get_by_role("button", name="Undo").click()
    window.shows(case)
    told.wait_for(state="hidden")
