"""The page on notebooks, run as a notebook by a kernel of Jupyter: its pictures, tables and bars are there."""

from __future__ import annotations

from pathlib import Path

import pytest

from ran_page import ran_blocks

PAGE = Path(__file__).parents[2] / "docs" / "notebook.md"
CELLS = [code for language, code, _ in ran_blocks(PAGE.read_text(encoding="utf-8")) if language == "python"]


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """The cells of the page after a run, each with what it shows, by the line that it ends with."""
    import nbformat  # what takes long to load waits for the one process that needs it
    from nbclient import NotebookClient

    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MPLBACKEND", raising=False)  # a kernel chooses the one that draws into the notebook
        patch.setenv("IPYTHONDIR", str(tmp_path_factory.mktemp("ipython")))
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code) for code in CELLS])
        folder = tmp_path_factory.mktemp("notebook")
        NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    return {cell.source.splitlines()[-1].strip(): cell.outputs for cell in notebook.cells}


def shown(outputs, kind):
    """Return what a cell shows of a kind, such as image/png."""
    return [output["data"][kind] for output in outputs if kind in output.get("data", {})]


@pytest.mark.parametrize("last", [line for code in CELLS if "df.plot." in (line := code.splitlines()[-1].strip())])
def test_each_plot_is_shown_once_below_its_cell(cells, last):
    pictures = shown(cells[last], "image/png")
    assert len(pictures) == (0 if "Sheet()" in last else 1)
    assert all(len(picture) > 10_000 for picture in pictures)
    assert "<Axes" not in str(shown(cells[last], "text/plain"))


@pytest.mark.parametrize(
    ("last", "words"),
    [("case", "resonance frequency"), ("df.summary(curve)", "largest peak force"), ("df.advice(curve)", "what to know"),
     ("df.report(curve)", "overview of the result")],
)  # fmt: skip
def test_cases_findings_advice_and_reports_are_shown_as_tables(cells, last, words):
    (page,) = shown(cells[last], "text/html")
    assert words in page and "<table>" in page
    assert shown(cells[last], "image/png") == []  # a report holds its own picture


def test_no_cell_complains(cells):
    outputs = [output for one in cells.values() for output in one]
    streams = [output["text"] for output in outputs if output["output_type"] == "stream"]
    assert [text for text in streams if not text.startswith("Compiling")] == []
