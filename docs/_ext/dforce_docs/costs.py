"""The directive `costs`: what dForce costs on the machine that builds the pages, as a picture and a table.

It is measured quickly while the pages are built, with few people at the window. To show a longer measurement, name the file
that ``dforce benchmark --json > FILE`` wrote in the environment variable DFORCE_BENCHMARK.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from dforce.checks.benchmark import benchmark, many_users
from dforce_docs.declared import list_table

PICTURE = "generated/pictures/costs.png"


def measured() -> dict[str, Any]:
    """Return the table of a file, or of a quick measurement made now."""
    given = os.environ.get("DFORCE_BENCHMARK")
    if given:
        return json.loads(Path(given).read_text(encoding="utf-8"))
    window = many_users.measures(*many_users.FEW, lambda name: None)
    return benchmark(quick=True) | {"window": [asdict(measure) for measure in window]}


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Draw the times as bars on a logarithmic axis, the first row on top."""
    figure, axes = plt.subplots(figsize=(8.0, 0.32 * len(rows) + 0.8), layout="constrained")
    names = [row["name"] for row in rows]
    axes.barh(range(len(rows)), [row["seconds"] * 1e6 for row in rows], color="#4477aa")
    axes.set(xscale="log", xlabel="time (µs)", ylim=(len(rows) - 0.4, -0.6))
    axes.set_yticks(range(len(rows)), names, fontsize="small")
    axes.grid(axis="x", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=160)
    plt.close(figure)


def time_text(seconds: float) -> str:
    """Return a time with three digits."""
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def measured_text(measure: dict[str, Any]) -> str:
    """Return a number with its unit, nothing where there is none."""
    if measure["value"] is None:
        return ""
    return (
        time_text(measure["value"]) if measure["unit"] == "s" else f"{measure['value']:.3g} {measure['unit']}".strip()
    )


class Costs(SphinxDirective):
    """The picture and the table."""

    def run(self) -> list[nodes.Node]:
        """Measure, draw, and return both."""
        found = measured()
        draw(found["rows"], Path(self.env.srcdir) / PICTURE)
        machine = ", ".join(f"{key} {value}" for key, value in found["machine"].items())
        rows = [
            (
                row["name"],
                time_text(row["seconds"]),
                f"{row['spread']:.2f}",
                f"{row['ratio']:.3g} × {row['to']}" if row["ratio"] else "",
            )
            for row in found["rows"]
        ]
        table = list_table(("what", "best time", "slowest / best", "compared"), rows)
        caption = f"Best time of each row of the table, on a logarithmic axis: shorter is better. {machine}."
        many_users = list_table(
            ("the window", "measured"), [(one["name"], measured_text(one)) for one in found["window"]]
        )
        figure = f".. figure:: /{PICTURE}\n   :alt: times\n   :class: force-figure\n\n   {caption}\n"
        return self.parse_text_to_nodes(f"```{{eval-rst}}\n{figure}\n{table}\n\n{many_users}\n```\n\n{found['note']}")


def setup(app: Sphinx) -> None:
    """Register the directive."""
    app.add_directive("costs", Costs)
