"""`dforce examples`: the cases that are shipped."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import dforce as df
from dforce.cli._names import complete_examples
from dforce.cli._options import Json, option
from dforce.cli._terminal import DONE, console, print_json, width, wrapped
from dforce.core.files import check_target, read_input, write_whole
from dforce.library import FOLDERS, measured_data


def examples(
    name: Annotated[
        str | None,
        typer.Argument(autocompletion=complete_examples, show_default=False, help="Show this example's case file."),
    ] = None,
    write: Annotated[
        Path | None, option("--write", "FILE.toml", "Write the example to a new file, to change it.")
    ] = None,
    data: Annotated[
        bool, typer.Option("--data", help="Copy the measured curves that are shipped, each with a case that fits it.")
    ] = False,
    json: Json = False,
) -> int:
    """List the examples, or show or write one."""
    known = df.examples()
    if data:
        if name is not None or write is not None:
            raise df.ParameterError("--data copies all measured files; leave out the name and --write")
        return _copy_data(json)
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


def _copy_data(json: bool) -> int:
    """Copy measured curves, a thermal spectrum and the cases that fit the curves into the working folder."""
    shipped = measured_data()
    most = max(map(len, shipped.values()))
    for name in sorted(shipped):
        if Path(name).exists() and read_input(name, "measured curve", 100 * most, df.ResultError) != shipped[name]:
            raise df.ResultError(f"'{name}' is there already, with other content; go to an empty folder")
    for name, content in shipped.items():
        write_whole(Path(name), content)
    if json:
        print_json({"files": sorted(shipped)})
        return DONE
    typer.echo(f"written: {', '.join(sorted(shipped))}")
    for line in (
        "fit a curve: dforce fit stiff.toml -o fit.nc --plot fit.png",
        "reconstruct its force: dforce reconstruct stiff.csv --case stiff.toml -o force.nc --plot force.png",
        "tune the lever: dforce thermal thermal.csv",
    ):
        typer.echo(line)
    return DONE


def _list(json: bool) -> int:
    known = df.examples().values()
    if json:
        print_json([vars(example) for example in known])
        return DONE
    from rich.table import Table

    widest = max(len(example.name) for example in known)
    terminal = console()
    for folder, title in FOLDERS.items():
        table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), show_header=False)
        table.add_column(no_wrap=True, style="bold", min_width=widest)
        table.add_column()
        for example in known:
            if example.folder == folder:
                table.add_row(example.name, f"{example.title}. {example.shows}")
        terminal.print(title, style="underline")
        terminal.print(table, soft_wrap=False)
        terminal.print()
    for hint in (
        "run an example: dforce run NAME",
        "change an example: dforce examples NAME --write my-case.toml",
        "copy measured curves: dforce examples --data",
    ):
        terminal.print(wrapped(hint, width()))
    return DONE


def _write(text: str, path: Path) -> None:
    target = check_target(path, (".toml",))
    try:
        write_whole(target, text.encode(), overwrite=False)
    except FileExistsError:
        raise df.ResultError(f"'{path}' exists already; choose another name") from None
    typer.echo(f"written: {path}")
