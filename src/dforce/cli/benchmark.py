"""`dforce benchmark`: the time for a curve, a sweep and a first answer on this machine."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from dforce.cli._options import Json
from dforce.cli._terminal import DONE, console, print_json, say, wrapped
from dforce.core.units import show

WIDE = 1000  # columns: more than any row takes


def benchmark(
    quick: Annotated[bool, typer.Option("--quick", help="Curves alone, in a few seconds.")] = False, json: Json = False
) -> int:
    """Measure the speed of curves, a sweep and a first answer on this machine."""
    from dforce.checks import benchmark as timing

    result = timing.benchmark(quick, say)
    if json:
        print_json(result)
    else:
        _print(result)
    return DONE


def _print(result: dict[str, Any]) -> None:
    """Print the table, in a file or a pipe with one line for each row."""
    from rich.table import Table

    table = Table("work", "time", "points", "in contact", "time a point", "slowest/best", box=None, pad_edge=False)
    for row in result["rows"]:
        points = row["points"]
        of_points = (
            (f"{points}", f"{row['in_contact']:.0%}", show(row["seconds"] / points, "s", 3)) if points else [""] * 3
        )
        table.add_row(row["name"], show(row["seconds"], "s", 3), *of_points, f"{row['spread']:.2f}")
    out = console()
    if not out.is_terminal:
        out.width = WIDE
    out.print(table)
    machine = ", ".join(f"{key} {value}" for key, value in result["machine"].items())
    for text in (machine, result["note"]):
        out.print(wrapped(text, out.width), style="dim")
