"""What was found, as a table for a reader and as JSON for a program."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dforce as df
from dforce.cli._terminal import console

if TYPE_CHECKING:
    import xarray as xr


def print_findings(result: xr.Dataset) -> None:
    """Print the title of a result and a table of what was found, a column for each direction."""
    from rich.table import Table
    from rich.text import Text

    findings = df.summary(result)
    ways = list(dict.fromkeys(finding.direction for finding in findings))
    table = Table(show_header=len(ways) > 1, box=None, pad_edge=False, padding=(0, 3, 0, 0))
    for heading in ("", *ways):
        table.add_column(Text(heading), overflow="fold")
    rows: dict[str, dict[str, str]] = {}
    for finding in findings:
        rows.setdefault(finding.label, {})[finding.direction] = finding.text
    for label, texts in rows.items():
        table.add_row(Text(label), *(Text(texts.get(way, "")) for way in ways))
    terminal = console()
    title = str(result.attrs.get("title", ""))
    if title:
        terminal.print(Text("".join(c if c.isprintable() else "?" for c in title), style="bold"))
    terminal.print(table)


def status_lines(result: xr.Dataset) -> list[str]:
    """Return a sentence for each way in which points are not as they should be."""
    counted = df.count_status(result)
    total = sum(counted.values())
    return [
        f"{count} of {total} {'point' if total == 1 else 'points'}: {status.sentence}"
        for status, count in counted.items()
        if status not in (df.Status.OK, df.Status.NOT_COMPUTED)
    ]


def advice(result: xr.Dataset) -> list[str]:
    """Return the advice that a result carries, a sentence each."""
    return [f"advice: {line}" for line in str(result.attrs.get("advice", "")).splitlines()]


def as_json(result: xr.Dataset) -> dict[str, Any]:
    """Return status, findings and advice for a program: SI numbers beside the text."""
    return {
        "points": {status.meaning: count for status, count in df.count_status(result).items()},
        "found": [
            {
                "name": finding.name, "direction": finding.direction or None, "label": finding.label,
                "value": finding.value, "unit": finding.unit, "text": finding.text,
            }
            for finding in df.summary(result)
        ],
        "advice": str(result.attrs.get("advice", "")).splitlines(),
    }  # fmt: skip
