"""Findings as a table for a reader and as JSON for a program."""

from __future__ import annotations

import dataclasses
import os
import re
import shlex
from typing import TYPE_CHECKING, Any

import dforce as df
from dforce.cli._terminal import console, printable, width, wrapped
from dforce.core import units

if TYPE_CHECKING:
    import xarray as xr

    from dforce.findings.set_point import SetPointState


def print_findings(result: xr.Dataset) -> None:
    """Print the title of a result and a table of its findings, a column for each direction."""
    from rich.table import Table
    from rich.text import Text

    report = df.report(result)
    rows = report.rows()
    table = Table(show_header=False, box=None, pad_edge=False, padding=(0, 3, 0, 0))
    for _ in rows[0] if rows else ():
        table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    terminal = console()
    if report.title:
        terminal.print(Text(wrapped(printable(report.title), width()), style="bold"))
    terminal.print(table)


def counted(result: xr.Dataset) -> dict[df.Status, int]:
    """Return the number of points of each status that occurs."""
    from dforce.results.status import count_status

    return count_status(result)


def states_of(result: xr.Dataset) -> dict[float, list[SetPointState]]:
    """Return the states at each set point of a curve's case."""
    from dforce.findings.motions import states_of as found

    return found(result)


def advice_of(result: xr.Dataset) -> list[df.Advice]:
    """Return the advice that a result carries."""
    from dforce.validity import advice_in

    return advice_in(result)


def status_lines(result: xr.Dataset) -> list[str]:
    """Return a sentence for each kind of faulty points that no advice mentions."""
    counts = counted(result)
    total = sum(counts.values())
    said = {df.Status.OK, df.Status.NOT_COMPUTED}
    if any(piece.name == df.Status.NOT_SETTLED.meaning for piece in advice_of(result)):
        said.add(df.Status.NOT_SETTLED)
    return [
        f"{count} of {total} {'point' if total == 1 else 'points'}: {status.sentence}"
        for status, count in counts.items()
        if status not in said
    ]


def set_point_lines(result: xr.Dataset) -> list[str]:
    """Return a sentence for each set point that no state of a curve has, or several of one direction have."""
    from dforce.findings.set_point import why_none

    lines = []
    for share, found in states_of(result).items():
        ways: dict[str, list[str]] = {}
        for state in found:
            ways.setdefault(state.direction, []).append(units.show(state.zc, "m", 3))
        lines += [
            f"{len(places)} states at {100.0 * share:.4g} %{f' on {way}' if way else ''}: at {', '.join(places)}."
            for way, places in ways.items()
            if len(places) > 1
        ]
        if not found:
            lines.append(why_none(result, share))
    return lines


def states_lines(states: xr.Dataset | None) -> list[str]:
    """Return a sentence where states that were looked for may be missing."""
    if states is None or states.attrs.get("interrupted"):
        return []
    return [f"states: {one.text}" for one in df.summary(states) if one.name == "completeness" and one.value != 1.0]


def advice_lines(result: xr.Dataset, case: str, written: str | os.PathLike[str] | None = None) -> list[str]:
    """Return the findings of all advice in a result, and the command with more on its file, or on its case if named."""
    found = [f"advice: {piece.finding}" for piece in advice_of(result)]
    kept = "" if written is None else str(written)
    name = case if not kept or kept.lower().endswith(".csv") else kept
    return [*found, f"advice with remedies: dforce check {quoted(name)}"] if found and name else found


def quoted(name: str) -> str:
    """Return a name as it is typed in a shell, never as an option."""
    name = f"./{name}" if name.startswith("-") else name
    if re.fullmatch(r"[\w@%+=:,./\\~-]+", name):
        return name
    if os.name == "posix" and set(name) & set('"$`!\\'):  # a shell reads these between double quotes, too
        return shlex.quote(name)
    return f'"{name}"'


def advice_as_json(pieces: list[df.Advice]) -> list[dict[str, Any]]:
    """Return advice for a program."""
    return [dataclasses.asdict(piece) for piece in pieces]


def as_json(result: xr.Dataset) -> dict[str, Any]:
    """Return status, findings and advice for a program: SI numbers beside the text."""
    return {
        "points": {status.meaning: count for status, count in counted(result).items()},
        "found": [
            {
                "name": finding.name,
                "direction": finding.direction or None,
                "label": finding.label,
                "value": finding.value,
                "unit": finding.unit,
                "text": finding.text,
            }
            for finding in df.summary(result)
        ],
        "at_set_point": [
            dataclasses.asdict(state) | {"direction": state.direction or None}
            for found in states_of(result).values()
            for state in found
        ],
        "advice": advice_as_json(advice_of(result)),
    }
