"""The page of all commands and their options, from the program itself."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import typer
from sphinx.application import Sphinx

from dforce.cli.app import app as program
from dforce_docs.declared import list_table


def _name(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        shown = parameter.metavar or parameter.name.upper()
        return f"``{shown}``"
    names = ", ".join(f"``{name}``" for name in parameter.opts)
    return names if parameter.is_flag else f"{names} ``{parameter.metavar or 'NUMBER'}``"


def _command(name: str, command: Any) -> str:
    title = f"dforce {name}"
    rows = [
        (_name(parameter), (parameter.help or "").replace("*", r"\*"))
        for parameter in command.params
        if parameter.name not in ("help", "install_completion", "show_completion")
    ]
    about = inspect.cleandoc(command.help or "")
    return f"{title}\n{'-' * len(title)}\n\n{about}\n\n{list_table(('', ''), rows)}"


def text() -> str:
    """Return the page in reStructuredText."""
    group: Any = typer.main.get_command(program)
    parts = [
        "Commands\n========",
        "``dforce COMMAND --help`` prints the same. Examples: :doc:`/how-to`. Exit codes: :doc:`/batch`.",
        *(_command(name, command) for name, command in group.commands.items()),
    ]
    return "\n\n".join(parts)


def write_page(app: Sphinx) -> None:
    """Write the page into the folder of the reference."""
    (Path(app.srcdir) / "reference" / "commands.rst").write_text(text(), encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Write the page before any page is read."""
    app.connect("builder-inited", write_page)
