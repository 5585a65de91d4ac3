"""The experimenter's story, by clicks alone: drop a curve, choose the lever, read modulus, peak force and safe settings."""

from __future__ import annotations

import re
from importlib.resources import files

import numpy as np
import pytest
from playwright.sync_api import expect

DATA = files("dforce.library") / "measured"
MODULUS, HAMAKER = (2.0e9, 6e-20)  # with which the shipped curve was made, at k = 2.7 N/m and R = 8 nm
WAIT = 60_000  # ms for a fit and a sweep on a busy machine
DROP = """([text, name]) => {
    const data = new DataTransfer();
    data.items.add(new File([text], name));
    document.dispatchEvent(new DragEvent("drop", {dataTransfer: data}));
}"""

SPREAD = """() => {
    const all = (document.querySelector(".df-main .df-plot")._fullData ?? []).filter(
        (trace) => trace.meta?.startsWith("residual"));
    const known = all.map((trace) => [...trace.y].filter(Number.isFinite));
    return all.length === 2 && known.every((one) => one.length > 100 && Math.max(...one.map(Math.abs)) < 5);
}"""


def as_an_instrument_writes():
    """Return the shipped curve under headings of its own, with heights that grow toward the sample."""
    rows = np.loadtxt((DATA / "stiff.csv").read_text().splitlines(), delimiter=",")
    return "Piezo Z,Ampl. (nm),Ph\n" + "".join(f"{-h:.4f},{a:.5f},{phase:.4f}\n" for h, a, phase, _ in rows)


def number(text, unit):
    """Return value and error before a unit in a text."""
    found = re.search(rf"([\d.e-]+)\s±\s([\d.e-]+)\s{unit}", text)
    assert found, text
    return float(found[1]), float(found[2])


@pytest.mark.slow
def test_an_experimenter_reads_modulus_peak_force_and_safe_settings_from_a_curve(window, tmp_path):
    page = window.page
    # 1. drop the curve: its columns are guessed, the sign of its heights, too; the sign of the phases is asked for
    page.evaluate(DROP, [as_an_instrument_writes(), "lab.csv"])
    for column, quantity in (("Piezo Z", "height"), ("Ampl.", "amplitude"), ("Ph", "phase")):
        expect(page.get_by_label(f"quantity of {column}")).to_have_value(quantity)
    expect(page.get_by_label("Larger heights are")).to_have_value("toward")
    expect(page.get_by_role("img", name="amplitude against height")).to_be_visible()
    read = page.get_by_role("button", name="Read", exact=True)
    expect(read).to_be_disabled()
    # one column is never two things
    page.get_by_label("quantity of Ph").select_option("height")
    expect(page.get_by_label("quantity of Piezo Z")).to_have_value("")
    expect(page.get_by_text("Choose a column for the phase")).to_be_visible()
    page.get_by_label("quantity of Piezo Z").select_option("height")
    page.get_by_label("quantity of Ph").select_option("phase")
    page.get_by_label("Phases in the file").select_option("lag")
    read.click()
    panel = page.get_by_role("complementary", name="measured curve")
    panel.wait_for()
    # 2. which lever and tip: a thermal spectrum for the lever, the radius by hand; Fit is shut until both are confirmed
    page.evaluate(DROP, [(DATA / "thermal.csv").read_text(), "thermal.csv"])
    page.get_by_role("button", name="Take for the lever").click()
    expect(panel.get_by_label("k of lever and tip")).to_have_value(re.compile(r"^2\.6\d+ N/m$"))
    radius = panel.get_by_label("R of lever and tip")
    radius.fill("8 nm")
    radius.press("Enter")
    expect(window.field("tip.radius").locator("input.df-box")).to_have_value("8")  # before the form is made anew
    with window.remade():
        panel.get_by_role("button", name="Match the experiment").click()
    fit = panel.get_by_role("button", name="Fit", exact=True)
    expect(panel.get_by_text("Tick fit at the fields of the form")).to_be_visible()
    for path in ("sample.youngs_modulus", "forces.1.hamaker"):
        window.parameter(path).get_by_role("checkbox", name="fit").check()
    expect(panel.get_by_text("Finds DMT: Hamaker constant, Young's modulus of the sample")).to_be_visible()
    expect(fit).to_be_disabled()
    panel.get_by_role("button", name="Confirm lever and tip").click()
    # 3. fit, and read the modulus with the k and R for which it holds, and whether the model suits
    fit.click()
    answers = panel.locator(".df-answers")
    expect(answers).to_contain_text("R = 8 nm", timeout=WAIT)
    modulus, error = number(answers.inner_text(), "GPa")
    k = float(re.search(r"k\s=\s([\d.]+)\sN/m", answers.inner_text())[1])
    assert abs(modulus - 1e-9 * MODULUS * k / 2.7) < 3.0 * error  # E scales with k
    expect(panel.get_by_text("χ² is as expected")).to_be_visible()
    # 4. the peak force at the set point, of the state that was fitted
    with window.redrawn():
        panel.get_by_role("button", name="Take over these values").click()
    page.wait_for_function(SPREAD, timeout=WAIT)  # of the curve with these values, near both jumps, too
    # 5. safe settings
    panel.get_by_label("largest peak force").fill("3 nN")
    panel.get_by_role("button", name="Find safe settings").click()
    findings = panel.locator(".df-findings")
    expect(findings).to_contain_text("stays below 3 nN up to a free amplitude of", timeout=WAIT)
    words = " ".join(findings.inner_text().split())  # with spaces at which a line may end
    force = re.search(r"At 80 % of A0 = 30 nm the tip presses with ([\d.]+) nN", words)
    expect(page.locator(".df-answer")).to_contain_text(f"{force[1]} nN")  # as above the chart
    # the force behind the curve, without a model, with its gap
    page.get_by_role("tab", name="Reconstruct").click()
    page.get_by_role("button", name="Reconstruct the force").click()
    expect(page.locator(".df-gaps")).to_contain_text("force unknown", timeout=WAIT)
    expect(page.get_by_role("figure", name="force against distance, reconstructed")).to_be_visible()
    # with all of that open, the window as a whole does not scroll
    assert page.evaluate("() => document.scrollingElement.scrollHeight === innerHeight")
    # 6. the script repeats reading, fit and report
    with page.expect_download() as download:
        page.get_by_role("button", name="File").click()
        page.get_by_text("Save Python script").click()
    script = download.value.path().read_text()
    for line in ("height_grows='toward'", "fit = df.fit(case, measured)", "df.fit_report(fit)"):
        assert line in script
    page.get_by_role("tab", name=re.compile("^Fit")).click()
    panel.get_by_role("button", name="Remove the curve").click()
