"""A student asks: why does the phase jump? Behind the curve are all states; the one that ends is seen, and its motion."""

from __future__ import annotations

import itertools
import urllib.parse

import pytest
from playwright.sync_api import expect

from dforce.gui.document.document import Document
from dforce.gui.window.address import from_link

RANGES = """() => {
    const layout = document.querySelector(".df-main .df-plot")._fullLayout;
    return ["xaxis", "yaxis", "yaxis2"].map((one) => layout[one].range);
}"""


def typed_in(link):
    """Return the drive of a link's case as text, nothing where there is no link."""
    text = urllib.parse.urlsplit(link).fragment
    return str(from_link(text, Document.first()).table["drive"]) if text else ""


def number_of(window, meta, name):
    """Wait for a trace of the chart, and return its number."""
    return window.page.wait_for_function(
        """([meta, name]) => {
            const found = document.querySelector(".df-main .df-plot")._fullData ?? [];
            const place = found.findIndex((trace) => trace.meta === meta && trace.name === name);
            return place >= 0 ? String(place) : null;
        }""",
        arg=[meta, name],
    ).json_value()


def click_on(window, number, share):
    """Click on a line at a share of its points that are seen."""
    left, top = window.page.evaluate(
        """([number, share]) => {
            const plot = document.querySelector(".df-main .df-plot"), trace = plot._fullData[number];
            const [x, y] = [trace.xaxis, trace.yaxis].map((name) => plot._fullLayout[name[0] + "axis" + name.slice(1)]);
            const seen = [...trace.x.keys()].filter((n) => Number.isFinite(trace.y[n]));
            const n = seen[Math.floor(share * (seen.length - 1))], box = plot.getBoundingClientRect();
            return [box.left + x._offset + x.d2p(trace.x[n]), box.top + y._offset + y.d2p(trace.y[n])];
        }""",
        [int(number), share],
    )
    window.page.mouse.move(left, top)
    window.page.locator(".df-main .hoverlayer .legend").first.wait_for()
    window.page.mouse.click(left, top)


def test_a_student_sees_the_state_that_ends_where_the_phase_jumps(window):
    page = window.page
    window.start("hysteresis")
    unstable = number_of(window, "states phase", "unstable states")
    number_of(window, "states phase", "stable states")
    jumps = [trace["y"] for trace in window.traces() if trace["meta"] == "jump"]
    assert max(abs(a - b) for line in jumps for a, b in itertools.pairwise(line)) > 10.0  # degrees
    click_on(window, unstable, 0.5)  # between both: what no experiment shows
    motion = page.get_by_role("region", name="motion at a point")
    expect(motion.get_by_text("it is unstable")).to_be_visible()
    ring = page.evaluate(
        "() => document.querySelector('.df-main .df-plot').layout.shapes.some((one) => one.name === 'clicked')"
    )
    assert ring
    phase = next(n for n, trace in enumerate(window.traces()) if trace["meta"] == "phase")
    click_on(window, phase, 0.9)
    for part in ("van der Waals", "elastic contact"):
        expect(motion.locator(".df-part-name").filter(has_text=part)).to_be_visible()


def test_axes_stand_still_while_a_student_drags_and_a_ghost_shows_where_the_curve_was(window):
    page = window.page
    window.start("hysteresis")
    number_of(window, "states phase", "unstable states")  # which are drawn later, and need room
    handle = page.locator('.df-slider[data-path="drive.A0"] input[type="range"]')
    at, middle, box = window.grip(handle)
    before, amplitude = page.evaluate(RANGES), window.lines("amplitude")[0]  # held from now on
    with window.redrawn():
        page.mouse.move(at - 0.3 * box["width"], middle, steps=10)
    page.wait_for_function(
        "() => document.querySelector('.df-main .df-plot')._fullData.some((trace) => trace.meta === 'ghost')"
    )
    assert page.evaluate(RANGES) == [[pytest.approx(end) for end in axis] for axis in before]
    assert window.lines("ghost")[0] == pytest.approx(amplitude, nan_ok=True)
    assert window.lines("amplitude")[0] != pytest.approx(amplitude, nan_ok=True)
    page.mouse.up()
    page.wait_for_function(  # the hand is off: the axes follow again
        "(before) => document.querySelector('.df-main .df-plot')._fullLayout.yaxis.range[1] < before - 1e-3",
        arg=before[1][1],
    )


def test_a_slider_plays_and_stops(window):
    window.start("figure-4-soft")
    window.page.get_by_role("button", name="play the slider: Free amplitude").click()
    with window.redrawn():
        pass
    with window.redrawn():
        pass
    window.page.get_by_role("button", name="stop the slider: Free amplitude").click()
    value = window.field("drive.A0").locator("input.df-box")
    expect(value).not_to_have_value("10")


@pytest.mark.long  # tests/browser/test_class.py opens a link, too
def test_a_link_opens_the_case_for_another_person(window, visit):
    window.start("figure-4-soft")
    window.type("drive.A0", "8.5")
    while "8.5" not in typed_in(window.page.url):  # the address follows what is typed
        window.page.wait_for_timeout(50)
    link = window.page.url
    other = visit()
    with other.redrawn():
        other.page.goto(link)
    expect(other.field("drive.A0").locator("input.df-box")).to_have_value("8.5")
    expect(other.page.get_by_label("title of the case")).to_have_value(
        window.page.get_by_label("title of the case").input_value()
    )
