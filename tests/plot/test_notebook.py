"""What a notebook shows: cases, results, progress bars."""

from __future__ import annotations

import base64
import html.parser
import time

import matplotlib.pyplot as plt
import numpy as np
import pytest
import synthetic
from IPython.core.formatters import DisplayFormatter
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output

import dforce as df
from dforce.core import log, progress
from dforce.core.progress import ProgressBar
from dforce.core.units import show
from dforce.validity import advice_in


class Reader(html.parser.HTMLParser):
    """Collects the cells of a table, and the tags."""

    def __init__(self, text):
        super().__init__()
        self.cells, self.tags, self.open = [], [], []
        self.feed(text)
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag in ("td", "th"):
            self.cells.append("")
        if tag not in ("br", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if {"td", "th"} & set(self.open):
            self.cells[-1] += data


@pytest.fixture
def notebook(monkeypatch):
    """A shell like that of a Jupyter kernel."""
    shell = InteractiveShell.instance()
    monkeypatch.setattr(shell, "kernel", object(), raising=False)
    yield shell
    InteractiveShell.clear_instance()


def test_a_case_is_a_table_of_symbols_values_and_meanings():
    cells = Reader(df.example("figure-6")._repr_html_()).cells
    row = cells.index("cantilever.modes.2")
    assert cells[row + 1 : row + 5] == ["f0", "f0", "310 kHz", "resonance frequency without damping"]
    assert "forces.dmt" in cells and "40 zJ" in cells and "recorded_periods" in cells


def test_a_case_shows_what_a_user_wrote_as_text():
    nasty = "<script>alert(1)</script>"
    case = df.example("table-1-am").replace(title=nasty, about={"shows": nasty})
    case = case.replace(forces=[df.forces.Custom(law="P1 if d < 1e-9 else 0", P1=1e-10)])
    read = Reader(case._repr_html_())
    assert "script" not in read.tags
    assert "P1 if d < 1e-9 else 0" in read.cells


@pytest.mark.parametrize("name", list(df.examples()))
def test_every_example_has_a_table(name):
    case = df.example(name)
    cells = Reader(case._repr_html_()).cells
    if case.cantilever.beam is None:  # whose sizes are shown in its place
        assert show(case.problem.modes[0].k, "N/m") in cells
    assert {f"forces.{force.name}" for force in case.forces} <= set(cells)


@pytest.mark.slow
def test_a_result_is_shown_with_a_picture_findings_and_advice():
    case = df.example("figure-3-air-jump")
    report = df.report(df.run(case))
    read = Reader(report._repr_html_())
    assert "deepest indentation" in read.cells and "approach" in read.cells
    assert "img" in read.tags and read.tags.count("li") == len(report.advice) > 0
    assert report.picture().startswith(b"\x89PNG")
    assert base64.b64encode(report.picture()[:30]).decode() in report._repr_html_()
    assert plt.get_fignums() == []  # else a notebook would show the picture a second time
    text = str(report)
    assert text.startswith(case.title) and "deepest indentation" in text and report.advice[0].text in text


def shown(value):
    """What IPython shows of a value: the text of a terminal, and the HTML of a notebook."""
    data, _ = DisplayFormatter().format(value)
    return data["text/plain"], data.get("text/html", "")


def test_a_summary_is_a_table_and_a_list_all_the_same():
    found = df.summary(synthetic.approach(spoiled=False))
    text, page = shown(found)
    assert isinstance(found, list) and [*found] == found and found[0].label == "free amplitude"
    cells = Reader(page).cells
    assert cells[:3] == ["", "approach", "retract"] and "largest peak force" in cells
    assert "Finding(" not in text and str(found) == repr(found) == text
    assert text.splitlines()[0].split() == ["approach", "retract"]
    assert len({len(line.split("nm")[0]) for line in text.splitlines() if line.startswith("free")}) == 1
    assert type(found[:2]) is type(found) and len(shown(found[:2])[0]) < len(text)


def test_advice_is_a_table_in_a_notebook_and_paragraphs_on_a_terminal():
    pieces = df.advice(df.example("figure-3-air").replace("cantilever.Q", 1.2))
    text, page = shown(pieces)
    assert isinstance(pieces, list) and len(pieces) > 0
    assert "Advice(" not in text and max(map(len, text.splitlines())) <= 100
    assert all(f"{piece.name}: {piece.figures}" in text.splitlines() for piece in pieces)
    assert " ".join(pieces[0].text.split()) in " ".join(text.split())
    assert {piece.text for piece in pieces} <= set(Reader(page).cells)
    assert shown(advice_in(synthetic.approach())) == ("no advice", "<p>no advice</p>")


def test_the_examples_are_a_table_and_a_dict_all_the_same():
    text, page = shown(df.examples())
    assert isinstance(df.examples(), dict) and "[cantilever]" not in text
    assert {*df.examples(), *(one.shows for one in df.examples().values())} <= set(Reader(page).cells)
    assert all(f"{name}: {one.title}" in text for name, one in df.examples().items())


def test_what_a_user_wrote_is_text_in_every_table():
    from dforce.core.listing import html_table

    assert "script" not in Reader(html_table([("<script>alert(1)</script>",)], ("<script>",))).tags


def test_a_report_shows_a_title_as_text():
    result = synthetic.dwell().assign_attrs(title="<script>alert(1)</script>")
    assert "script" not in Reader(df.report(result)._repr_html_()).tags


@pytest.mark.parametrize(
    ("experiment", "kept"),
    [
        ({"kind": "dwell", "zc": "8 nm"}, None),
        ({"kind": "dwell", "zc": "8 nm"}, ["peak_force"]),
        ({"kind": "approach", "zc": ["10 nm", "9 nm", "8 nm"]}, None),
        ({"kind": "approach", "zc": ["10 nm", "9 nm"], "direction": "both"}, ["amplitude_ratio"]),
    ],
)
def test_a_sweep_is_reported_with_a_picture_and_findings(experiment, kept):
    case = df.example("figure-3-air").replace("experiment", experiment)
    result = df.sweep(case, over={"sample.youngs_modulus": [1e9, 2e9], "drive.A0": ["9 nm"]}, quantities=kept)
    report = df.report(result)
    assert "1 GPa, 2 GPa" in Reader(report._repr_html_()).cells
    assert report.picture().startswith(b"\x89PNG")
    assert df.report(result.isel(youngs_modulus=0, A0=0, drop=True)).title == case.title


def updates(captured):
    """The texts that a bar had, one after the other."""
    return [output.data["text/html"] for output in captured.outputs]


def test_a_bar_in_a_notebook_is_replaced_in_place_and_taken_away(notebook):
    with capture_output() as captured, ProgressBar("a <b>long</b> run") as bar:
        bar(1, 4, "zc = 5 nm")
        bar._bar.show()
        bar(2, 4, "zc = 4 nm")
    first, shown, later, last = updates(captured)
    assert first == last == ""
    assert 'value="1" max="4"' in shown and "1/4" in shown and "zc = 5 nm" in shown
    assert 'value="2" max="4"' in later and "s left" in later
    assert "b" not in Reader(later).tags
    assert [output.update for output in captured.outputs] == [False, True, True, True]
    assert len({output.transient["display_id"] for output in captured.outputs}) == 1


def test_a_quick_run_in_a_notebook_shows_no_bar(notebook, monkeypatch):
    monkeypatch.setattr(progress, "WAIT", 100.0)  # so that every run is quick, the first one with its imports too
    with capture_output() as captured:
        df.run(df.example("table-1-am"), progress=True)
    assert all("<progress" not in text for text in updates(captured))


def test_a_bar_appears_by_itself_while_nothing_is_reported(notebook, monkeypatch):
    monkeypatch.setattr(progress, "WAIT", 0.0)
    with capture_output() as captured, ProgressBar("compiling"):
        time.sleep(0.3)
    assert any("<progress></progress> compiling" in text for text in updates(captured))


def test_a_compilation_has_a_bar_of_its_own_until_points_are_reported_again(notebook):
    with capture_output() as captured, ProgressBar("a run") as bar:
        bar._bar.show()
        log.show_progress("Compiling a law, once", 0.43)
        bar(1, 4, "zc = 5 nm")
    log.show_progress("Compiling a law, once", 0.5)  # nobody watches any more
    *_, compiling, running, last = updates(captured)
    assert 'value="43" max="100"' in compiling and "Compiling a law, once" in compiling and "a run" not in compiling
    assert "a run, 1/4" in running and last == ""


def test_progress_is_asked_for_by_true(monkeypatch):
    seen = []

    class Bar(progress.ProgressBar):
        def __call__(self, done, total, note):
            seen.append((self.title, done, total))

    monkeypatch.setattr("dforce.runs.ProgressBar", Bar)
    case = df.example("figure-3-air").replace(
        title="curve", experiment=df.experiments.Approach(zc=np.linspace(9e-9, 8e-9, 3))
    )
    df.run(case, progress=True)
    assert seen[-1] == ("curve", 3, 3)
    df.sweep(case, over={"sample.youngs_modulus": [1e9, 2e9]}, progress=True)
    assert seen[-1] == ("curve", 6, 6)
    count = len(seen)
    df.run(case, progress=False)
    assert len(seen) == count


def test_there_is_no_bar_where_nobody_looks(capsys):
    with ProgressBar("into a file") as bar:
        assert bar._bar is None
        bar(1, 2, "")
    assert capsys.readouterr().err == ""
