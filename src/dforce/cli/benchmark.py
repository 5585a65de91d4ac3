"""`dforce benchmark`: what the parts of dForce cost on this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from dforce.cli._terminal import DONE, Json, Traceback, console, print_json, say, wrapped
from dforce.core.units import show

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

WIDE = 1000  # columns: more than any row takes


def benchmark(
    quick: Annotated[bool, typer.Option("--quick", help="Rough figures in a moment, without the window.")] = False,
    accuracy: Annotated[bool, typer.Option("--accuracy", help="What accuracy costs, for each method.")] = False,
    json: Json = False,
    traceback: Traceback = False,
) -> int:
    """Time dForce on this machine, as ratios to loops written by hand."""
    from dforce.checks import benchmark as timing
    from dforce.checks.benchmark.accuracy import cost_of_accuracy

    result = cost_of_accuracy(quick, say) if accuracy else timing.benchmark(quick, say)
    if json:
        print_json(result)
    elif accuracy:
        _print_accuracy(result)
    else:
        _print(result)
    return DONE


def _print_accuracy(result: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table(
        "case", "method", "samples or tolerance", "time", "amplitude error", "phase error", box=None, pad_edge=False
    )
    for row in result["rows"]:
        table.add_row(
            row["case"], row["method"], f"{row['setting']:g}", show(row["seconds"], "s", 3),
            f"{1e9 * row['amplitude_error']:.1e} nm", f"{row['phase_error']:.1e}°",
        )  # fmt: skip
    out = _printed(table)
    for case, row in result["cheapest"].items():
        found = f"{row['method']} at {row['setting']:g}, {show(row['seconds'], 's', 3)}" if row else "none of these"
        out.print(f"{case}, amplitude to 1e-6 nm and phase to 1e-4°: {found}")


def _print(result: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table("what", "time", "ratio", "to", "meant to be below", "slowest/best", box=None, pad_edge=False)
    for row in result["rows"]:
        ratio = "" if row["ratio"] is None else f"{row['ratio']:.3g}"
        limit = "" if row["limit"] is None else f"{row['limit']:.3g}{'' if ratio else ' s'}"
        table.add_row(row["name"], show(row["seconds"], "s", 3), ratio, row["to"], limit, f"{row['spread']:.2f}")
    out = _printed(table)
    for measure in result["window"]:
        out.print(
            measure["name"] + ("" if measure["value"] is None else f"  {_number(measure['value'], measure['unit'])}")
        )
    machine = ", ".join(f"{key} {value}" for key, value in result["machine"].items())
    for text in (machine, result["note"]):
        out.print(wrapped(text, out.width), style="dim")


def _number(value: float, unit: str) -> str:
    return show(value, "s", 3) if unit == "s" else f"{value:.3g} {unit}".strip()


def _printed(table: Table) -> Console:
    """Print a table, in a file or a pipe with one line for each row, and return the console for what follows."""
    out = console()
    if not out.is_terminal:
        out.width = WIDE
    out.print(table)
    return out
