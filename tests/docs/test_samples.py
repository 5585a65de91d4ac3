"""Samples that no page runs: command lines and pieces of case files in pages, tutorials and README are what dForce takes."""

from __future__ import annotations

import re
import shlex
import shutil
import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from every import every

import dforce as df
from dforce.cli.app import app
from ran_page import Page, fences

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(path for path in (ROOT / "docs").rglob("*.md") if "_build" not in path.parts)]
TUTORIALS = sorted((ROOT / "examples").glob("*/*.py"))
DIRECTIVE = re.compile(r"^# \.\. code-block:: (?P<language>\w+)\n(?P<body>(?:#(?:   .*)?\n)+)", re.MULTILINE)
PROGRAM = typer.main.get_command(app)


def samples(path: Path) -> Iterator[tuple[str, str]]:
    """Give language and text of each sample of a page or a tutorial."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        yield from fences(text)
    for match in DIRECTIVE.finditer(text):
        body = textwrap.dedent(re.sub(r"^# ?", "", match["body"], flags=re.MULTILINE))
        yield match["language"], re.sub(r"^:caption:.*\n", "", body)


def lines(path: Path) -> Iterator[str]:
    """Give the command lines of a page: those of its samples, and those in its text."""
    for language, body in samples(path):
        if language in ("sh", "shell", "powershell"):
            yield from (line for line in body.splitlines() if line.startswith("dforce "))
    yield from re.findall(r"`(dforce [a-z][^`\n]*)`", path.read_text(encoding="utf-8"))


COMMANDS = [(path, line) for path in (*PAGES, *TUTORIALS) for line in lines(path)]
PIECES = [
    (path, body) for path in (*PAGES, *TUTORIALS) for language, body in samples(path)
    if language == "toml" and "[project]" not in body
]  # fmt: skip


@every(COMMANDS)
def test_each_command_line_has_only_options_that_exist(path: Path, line: str) -> None:
    command, words = PROGRAM, shlex.split(line, comments=True)[1:]
    while words and words[0] in getattr(command, "commands", {}):
        command = command.commands[words.pop(0)]
    assert command is not PROGRAM, "there is no such command"
    if words:  # else the text names the command alone
        command.make_context(line, words)


@every(PIECES)
def test_each_piece_of_a_case_file_completes_a_case(path: Path, body: str, workdir: Path) -> None:
    """Values too are what dForce takes; the rest of the case is that of an example."""
    shutil.copy(ROOT / "examples" / "tutorials" / "brush.py", workdir)
    rest = tomllib.loads(df.example("figure-3-air").to_toml())
    piece = tomllib.loads(body)
    lever = piece.get("cantilever", "")
    if "drift" in lever:  # of the lever of that case
        piece |= {"cantilever": rest["cantilever"] | lever}
    elif lever:
        rest = {}
    df.Case(**rest | piece).problem  # noqa: B018 which reads the whole case


def test_a_command_line_and_a_piece_that_dforce_does_not_take_are_found() -> None:
    with pytest.raises(Exception, match="--at-setpoint"):
        PROGRAM.commands["run"].make_context("run", ["tap.toml", "--at-setpoint", "0.8"])
    with pytest.raises(df.ParameterError, match="youngs_modulus"):
        df.Case(**tomllib.loads(df.example("figure-3-air").to_toml()) | {"sample": {"youngs_modulus": "1 nm"}})


@pytest.mark.slow
@pytest.mark.parametrize("name", ["from_my_lever_to_a_peak_force", "your_own_force"])
def test_the_commands_of_a_tutorial_run(name: str) -> None:
    found = list(samples(ROOT / "examples" / "tutorials" / f"{name}.py"))
    with Page() as page:
        shutil.copy(ROOT / "examples" / "tutorials" / "brush.py", page.folder)
        (page.folder / "tap.toml").write_text(next(body for language, body in found if language == "toml"))
        printed = [page.commands(body) for language, body in found if language == "sh"]
    assert printed and all(printed)
