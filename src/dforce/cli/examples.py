"""`dforce examples`: the cases that are shipped."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import dforce as df
from dforce.cli._names import complete_examples
from dforce.cli._options import Json, option
from dforce.cli._terminal import DONE, console, print_json, width, wrapped
from dforce.core.files import check_target, write_whole


def examples(
    name: Annotated[
        str | None,
        typer.Argument(autocompletion=complete_examples, show_default=False, help="Show this example's case file."),
    ] = None,
    write: Annotated[
        Path | None, option("--write", "FILE.toml", "Write the example to a new file, to change it.")
    ] = None,
    json: Json = False,
) -> int:
    """List the examples, or show or write one."""
    known = df.examples()
    if name is None:
        if write is not None:
            raise df.ParameterError("--write needs the name of an example")
        return _list(json)
    df.example(name)  # an unknown name is answered with the nearest
    example = known[name]
    if write is not None:
        _write(example.text, write)
    elif json:
        print_json(vars(example))
    else:
        typer.echo(example.text, nl=not example.text.endswith("\n"))
    return DONE


def _list(json: bool) -> int:
    known = df.examples().values()
    if json:
        print_json([vars(example) for example in known])
        return DONE
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), show_header=False)
    table.add_column(no_wrap=True, style="bold")
    table.add_column()
    for example in known:
        table.add_row(example.name, f"{example.title}. {example.shows}")
    terminal = console()
    terminal.print(table, soft_wrap=False)
    terminal.print()
    for hint in ("run an example: dforce run NAME", "change an example: dforce examples NAME --write my-case.toml"):
        terminal.print(wrapped(hint, width()))
    return DONE


def _write(text: str, path: Path) -> None:
    target = check_target(path, (".toml",))
    try:
        write_whole(target, text.encode(), overwrite=False)
    except FileExistsError:
        raise df.ResultError(f"'{path}' exists already; choose another name") from None
    typer.echo(f"written: {path}")
