"""Runs the blocks of a page, as a reader would: in one folder, its Python in one namespace, one after the other.

Used while the pages are built, with the blocks' output, and by the tests. Each of these decides whether a warning is an
error.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import matplotlib as mpl
from matplotlib import pyplot
from typer.testing import CliRunner

from dforce.cli.app import app as program
from dforce.forces import REGISTRY

COLUMNS = "88"  # width of a page beside its lists of contents on a screen of 1366 pixels
FENCE = re.compile(r"^```(?P<head>[^\n`]*)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL)
OPTION = re.compile(r":(?P<key>[a-z]+):[ ]?(?P<value>[^\n]*)\n")


class BlockError(Exception):
    """A block of a page does not do as the page states."""


class Page:
    """The common part of the blocks of a page: a folder and a namespace."""

    def __init__(self) -> None:
        self.temporary = tempfile.TemporaryDirectory(prefix="dforce-docs-")
        self.folder = Path(self.temporary.name)
        self.namespace: dict[str, Any] = {"__name__": "__main__"}

    def __enter__(self) -> Self:
        """Return the page."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the page."""
        self.close()

    def close(self) -> None:
        """Remove the folder, close the figures and forget the force models that the page has defined."""
        self.temporary.cleanup()
        pyplot.close("all")
        forget_own_models()

    def run(self, language: str, code: str, options: dict[str, Any]) -> str:
        """Run a block, or write it to the file of the option `file`, and return its output."""
        if "hidden" in options:
            return self.claims(code)
        if "file" in options:
            (self.folder / options["file"]).write_text(code.rstrip("\n") + "\n", encoding="utf-8")
            return ""
        if language == "sh":
            return self.commands(code, int(options.get("exit", 0)))
        if language == "python":
            return self.python(code)
        raise BlockError(f"a block in {language} cannot be run")

    def commands(self, lines: str, expected: int = 0) -> str:
        """Return the output of commands; every line starts with dforce."""
        printed = []
        for line in lines.splitlines():
            words = shlex.split(line, comments=True)
            if not words:
                continue
            if words[0] != "dforce":
                raise BlockError(f"a command of a page starts with dforce, not with {words[0]}")
            with self._entered():
                done = CliRunner().invoke(program, words[1:], env={"COLUMNS": COLUMNS, "NO_COLOR": "1"})
            if done.exit_code != expected:
                raise BlockError(f"{line} ended with {done.exit_code}: {done.output}") from done.exception
            printed.append(done.output if expected else done.stdout)  # progress and notices are no output
        return "\n".join(printed)

    def claims(self, code: str) -> str:
        """Run code that asserts the statements of the text. It sets up nothing that a reader of the page would not have."""
        names, files = self.namespace, sorted(self.folder.rglob("*"))
        self.namespace = dict(names)
        try:
            printed = self.python(code)
        finally:
            self.namespace = names
        if sorted(self.folder.rglob("*")) != files:
            raise BlockError("a hidden block writes files, which a reader of the page does not have")
        return printed

    def python(self, code: str) -> str:
        """Return the output of Python code."""
        printed = io.StringIO()
        with self._entered(), contextlib.redirect_stdout(printed):
            exec(compile(code, "<a block of the page>", "exec"), self.namespace)
        return printed.getvalue()

    @contextlib.contextmanager
    def _entered(self) -> Iterator[None]:
        """Work in the page's folder, without windows."""
        backend = mpl.get_backend()
        mpl.use("agg")
        try:
            with contextlib.chdir(self.folder):
                yield
        finally:
            mpl.use(backend)


def forget_own_models() -> None:
    """Keep the shipped force models only, so that no page has another page's models."""
    for name, model in list(REGISTRY.items()):
        if not model.__module__.startswith("dforce.forces."):
            del REGISTRY[name]


def fences(text: str) -> Iterator[tuple[str, str]]:
    """Give the language and the body of each fenced block."""
    for match in FENCE.finditer(text):
        yield match["head"].strip(), match["body"]


def ran_blocks(text: str) -> Iterator[tuple[str, str, dict[str, str]]]:
    """Give language, code and options of each block that is run while the page is built."""
    for head, body in fences(text):
        if not head.startswith("{ran}"):
            continue
        options: dict[str, str] = {}
        while match := OPTION.match(body):
            options[match["key"]] = match["value"]
            body = body[match.end() :]
        yield head.removeprefix("{ran}").strip(), body, options
