"""What a person saves can be read back, and what is no good is refused in a sentence."""

from __future__ import annotations

import csv
import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from tiers import some_long

import dforce as df
from dforce.gui.document.document import EDITED, FIRST, Document
from dforce.gui.window.address import to_link
from dforce.gui.window.security import MOST_BYTES
from dforce.results.files import encoded

AMPLITUDE = "drive.A0"


def save(window, tmp_path, entry, **answers):
    """Save by an entry of the menu File, and return the file."""
    page = window.page
    with page.expect_download() as download:
        page.get_by_role("button", name="File").click()
        page.get_by_role("menuitem", name=entry).click()
        if answers:
            form = page.locator(".df-save")
            for label, answer in answers.items():
                form.get_by_label(label).select_option(answer)
            form.get_by_role("button", name="Save").click()
    file = tmp_path / download.value.suggested_filename
    download.value.save_as(file)
    return file


def open_file(window, file):
    """Open a file as the dialog of the browser would hand it over."""
    window.page.locator(".df-upload input[type=file]").set_input_files(file)


@pytest.fixture
def typed(lasting):
    """Give the window with a value of its own, unless it is there from the test before, and the case that it shows."""
    window, visitor = lasting
    case = df.example("figure-3-air").replace(AMPLITUDE, "9 nm")
    case = case.replace(title=f"{case.title}{EDITED}")
    if not window.holds(case):
        window.start()
        window.type(AMPLITUDE, "9")
    window.shows(case)
    yield window, case
    visitor.check()


def test_a_case_is_saved_and_opened_again(typed, tmp_path):
    window, case = typed
    file = save(window, tmp_path, "Save case")
    assert df.load_case(file) == case
    window.start("figure-3-water")
    open_file(window, file)
    window.shows(case)


def test_a_result_is_saved_as_netcdf_with_every_number(typed, tmp_path):
    window, case = typed
    result, wanted = df.read(save(window, tmp_path, "Save result", Format=".nc")), df.run(case)
    for name in ("amplitude", "phase", "peak_force", "virial"):
        assert np.allclose(result[name], wanted[name], rtol=1e-6, atol=1e-25, equal_nan=True)


def test_a_result_is_saved_as_a_table_with_every_point(typed, tmp_path):
    window, case = typed
    file, wanted = save(window, tmp_path, "Save result", Format=".csv"), df.run(case)
    lines = (line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    rows = list(csv.DictReader(lines))
    for direction in ("approach", "retract"):
        column = [float(row["amplitude_tone1 (m)"]) for row in rows if row["direction"] == direction]
        assert np.allclose(column, wanted.amplitude.sel(direction=direction).values.ravel(), rtol=1e-6)


FIGURES = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


@pytest.mark.parametrize("ending", some_long(FIGURES, long=(".png", ".svg")))
def test_a_figure_is_saved(typed, tmp_path, ending):
    assert save(typed[0], tmp_path, "Save figure", Format=ending).read_bytes().startswith(FIGURES[ending])


def test_the_script_that_is_saved_computes_the_same(typed, tmp_path):
    window, case = typed
    script = save(window, tmp_path, "Save Python script")
    ends = "\nprint(repr(case == df.load_case('wanted.toml')))\n"
    (tmp_path / "wanted.toml").write_text(case.to_toml(), encoding="utf-8")
    script.write_text(script.read_text(encoding="utf-8") + ends, encoding="utf-8")
    done = subprocess.run([sys.executable, script.name], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "True"


@pytest.mark.long  # tests/gui/test_files.py says the same of a simulated page
def test_a_project_brings_back_the_case_and_the_results(visit, tmp_path):
    window = visit()
    window.page.get_by_role("button", name="Keep", exact=True).click()
    window.page.locator(".df-chip").first.wait_for()
    window.type(AMPLITUDE, "8")
    file = save(window, tmp_path, "Save project")
    other = visit()
    open_file(other, file)
    other.page.locator(".df-chip", has_text=df.example(FIRST).title).wait_for()
    box = other.field(AMPLITUDE).locator("input")
    other.page.wait_for_function("(box) => box.value === '8'", arg=box.element_handle())


HOSTILE = {
    "cut.nc": lambda: encoded(df.run(df.example("figure-3-air")), ".nc")[:20_000],
    "nonsense.txt": lambda: b"Colorless green ideas\nsleep furiously\n" * 200,
    "broken.dforce": lambda: b"PK\x03\x04 and then nothing",
    "broken.nc": lambda: b"\x89HDF\r\n\x1a\n" + b"\0" * 64,
    "broken.toml": lambda: b"[cantilever\nf0 = ",
    "plugin.toml": lambda: b'plugins = ["evil.py"]\n' + df.example("figure-3-air").to_toml().encode(),
    "large.toml": lambda: bytes(MOST_BYTES + 1),
}


@pytest.mark.parametrize("name", some_long(HOSTILE, long={*HOSTILE} - {"broken.nc", "large.toml"}))
def test_a_file_that_is_no_good_is_refused_in_a_sentence_and_changes_nothing(typed, tmp_path, name):
    window, case = typed
    (tmp_path / name).write_bytes(HOSTILE[name]())
    open_file(window, tmp_path / name)
    note = window.page.locator(".q-notification")
    note.wait_for()
    assert "Error" not in note.inner_text() and "Traceback" not in note.inner_text()
    note.get_by_role("button", name="Close").click()
    note.wait_for(state="detached")
    assert window.holds(case)
    window.shows(case)


def link(**lacking):
    """Return the link of a case that names what dForce lacks."""
    document = Document.of(df.example("figure-3-air"))
    return to_link(dataclasses.replace(document, table=document.table | lacking))


LINKS = {
    "no link": lambda: "colorless-green-ideas",
    "cut short": lambda: link()[:-40],
    "no such experiment": lambda: link(experiment={"kind": "figure-99"}),
    "no such force": lambda: link(forces=[{"model": "phlogiston"}]),
    "no such lever": lambda: link(cantilever="figure-99"),
}


@pytest.mark.parametrize("name", some_long(LINKS, long={*LINKS} - {"cut short", "no such force"}))
def test_a_link_that_is_no_good_is_answered_in_a_sentence(window, name):
    window.page.evaluate("(link) => { location.hash = link; }", LINKS[name]())
    note = window.page.locator(".q-notification, .df-form .df-error, .df-banner.wrong").locator("visible=true").first
    note.wait_for()
    assert note.inner_text() and "Error" not in note.inner_text() and "Traceback" not in note.inner_text()
    window.start()


def test_a_link_is_answered_where_the_page_writes_its_own_address_before_it_has_looked(window):
    window.page.wait_for_function("location.hash.length > 100")
    own = window.page.evaluate("location.hash.slice(1)")
    window.page.evaluate("(own) => { location.hash = 'colorless-green-ideas'; dforceAddress.show(own); }", own)
    window.page.locator(".q-notification").locator("visible=true").first.wait_for()
    window.start()


def test_a_path_in_the_name_of_a_file_leads_nowhere(typed):
    window, _ = typed
    content = df.example("figure-3-water").to_toml()
    upload = {"name": "../../../evil.toml", "mimeType": "application/toml", "buffer": content.encode()}
    window.page.locator(".df-upload input[type=file]").set_input_files(upload)
    window.shows(df.example("figure-3-water"))
    assert list(window.server.folder.parent.rglob("evil*")) == []
