"""Every block of code in the README and in the pages runs as it stands, and the names in the pages exist."""

from __future__ import annotations

import ast
import re
import runpy
import shutil
import tomllib
import warnings
from pathlib import Path

import jsonschema
import matplotlib.pyplot as plt
import pytest
from every import every

import dforce as df
from dforce.case import case_schema
from dforce.core.quantities import AXES, JUMPS, OBSERVABLES, TRACES
from ran_page import BlockError, Page, fences, forget_own_models, ran_blocks

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    path for path in (ROOT / "docs").rglob("*.md") if "_build" not in path.parts and path.name != "validation.md"
)
SCRIPTS = sorted(path for path in (ROOT / "examples").glob("*/*.py") if path.name != "brush.py")
README = (ROOT / "README.md").read_text(encoding="utf-8")
SHOWN = ("", "text", "toml", "powershell", "shell")  # not to be run here: files, installation, other systems
LONG = ("dforce benchmark", "dforce validate")  # take minutes; they have tests of their own


def named(path):
    return path.relative_to(ROOT).as_posix()


@pytest.mark.site
@pytest.mark.parametrize("path", PAGES, ids=named)
def test_every_block_of_a_page_runs(path):
    with Page() as page:
        for language, code, options in ran_blocks(path.read_text(encoding="utf-8")):
            page.run(language, code, options)


def test_a_hidden_block_sets_nothing_up(tmp_path):
    with Page() as page:
        page.run("python", "found = 2.0", {"hidden": ""})
        assert "found" not in page.namespace
        with pytest.raises(BlockError, match="writes files"):
            page.run("python", "open('a.csv', 'w').close()", {"hidden": ""})


@pytest.mark.parametrize(("version", "marked"), [("0.0.1", True), (df.__version__, False)])
def test_a_validation_by_another_version_is_marked(tmp_path, version, marked):
    pytest.importorskip("sphinx")
    from dforce_docs.validation import text

    page = tmp_path / "validation.md"
    page.write_text(f"# Validation\n\n(cores 2, dforce {version}, numpy 2.4)\n", encoding="utf-8")
    assert (f"dForce {version} wrote this page" in text(str(page))) is marked


def test_every_script_begins_with_its_title():
    begins = {
        path: (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n") for path in SCRIPTS
    }
    assert [named(path) for path, lines in begins.items() if lines[1:2] != ["=" * len(lines[0])]] == []


def test_every_room_of_the_architecture_exists():
    source = ROOT / "src" / "dforce"
    picture = re.findall(
        r'class="room[^"]*"[^>]*>([^<]+)<', (ROOT / "docs" / "_static" / "way.svg").read_text(encoding="utf-8")
    )
    page = re.findall(r"`([\w/]+(?:/|\.py))`", (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8"))
    assert len(picture) > 10 and len(page) > 30
    assert [name for name in [*picture, *page] if not (source / name).exists() and not (ROOT / name).exists()] == []


@pytest.mark.parametrize("path", PAGES, ids=named)
def test_no_code_of_a_page_is_left_unrun(path):
    unrun = [head for head, _ in fences(path.read_text(encoding="utf-8")) if not head.startswith("{")]
    assert set(unrun) <= set(SHOWN)


def test_every_block_of_the_readme_runs():
    with Page() as page:
        for language, code in fences(README):
            if language == "python":
                page.python(code)
            if language == "sh":
                lines = [line for line in code.splitlines() if line.startswith("dforce") and not line.startswith(LONG)]
                page.commands("\n".join(lines))


@pytest.mark.parametrize("path", [ROOT / "README.md", *PAGES], ids=named)
def test_every_piece_of_a_case_file_has_only_keys_that_exist(path):
    schema = case_schema()
    schema.pop("required", None)  # a piece may leave out the rest of the case
    for language, body in fences(path.read_text(encoding="utf-8")):
        if language == "toml":
            jsonschema.validate(tomllib.loads(body), schema)


@pytest.mark.parametrize("target", sorted(set(re.findall(r"^make (\w+)", README, re.MULTILINE))))
def test_every_make_target_of_the_readme_exists(target):
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)


@pytest.mark.site
@pytest.mark.parametrize("path", SCRIPTS, ids=named)
def test_every_script_runs_in_an_empty_folder(path, workdir, monkeypatch):
    for asked in re.findall(
        r"literalinclude:: /../examples/(\S+)", path.read_text(encoding="utf-8")
    ):  # "Save this as ..."
        shutil.copy(ROOT / "examples" / asked, workdir)
    monkeypatch.setenv("MPLBACKEND", "agg")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="FigureCanvasAgg is non-interactive")  # of plt.show
        runpy.run_path(str(path), run_name="__main__")
    plt.close("all")
    forget_own_models()


def glossary():
    """Return the columns of the glossary that name places in a case and in a result, a pair for each row."""
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    for row in re.findall(r"^\| (?!-)(.*) \|$", text, re.MULTILINE)[1:]:
        cells = row.split("|")
        yield re.findall(r"`([^`]+)`", cells[1]), re.findall(r"`([^`]+)`", cells[2])


SECTIONS = {
    "cantilever": df.Cantilever,
    "drive": df.Drive,
    "readout": df.Readout,
    "tip": df.Tip,
    "sample": df.Sample,
    "contact": df.Contact,
    "experiment": df.experiments.Approach,
}


@every(sorted({place for places, _ in glossary() for place in places}))
def test_every_place_in_the_glossary_exists(place):
    if place.startswith("kind"):
        assert tomllib.loads(f"[experiment]\n{place}")["experiment"]["kind"] in str(case_schema())
        return
    steps = place.strip("[]").split("[[")[-1].split(".")
    if steps[0] == "forces":
        models = df.forces.REGISTRY.values() if steps[1] == "*" else [df.forces.REGISTRY[steps[1]]]
        assert any(steps[2] in model.model_fields for model in models)
    else:
        assert steps[1] in SECTIONS[steps[0]].model_fields


@every(sorted({name for _, names in glossary() for name in names}))
def test_every_quantity_in_the_glossary_exists(name):
    known = {**OBSERVABLES, **TRACES, **JUMPS, **AXES}
    assert name in known or hasattr(df, name.removeprefix("df."))
