"""The directive `costs`: a table of the costs of dForce on the machine that builds the pages.

It is measured quickly while the pages are built, with few people at the window. To show a longer measurement, name the file
that ``dforce benchmark --json > FILE`` wrote in the environment variable DFORCE_BENCHMARK.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from dforce.checks.benchmark import benchmark
from dforce_docs.declared import list_table

sys.path.insert(0, str(Path(__file__).parents[3] / "benchmarks"))
import many_users


def measured() -> dict[str, Any]:
    """Return the table of a file, or of a quick measurement made now."""
    given = os.environ.get("DFORCE_BENCHMARK")
    if given:
        return json.loads(Path(given).read_text(encoding="utf-8"))
    window = many_users.measures(*many_users.FEW)
    return benchmark(quick=True) | {"window": [asdict(measure) for measure in window]}


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
    """The tables of times and of the window."""

    def run(self) -> list[nodes.Node]:
        """Measure, and return the tables."""
        found = measured()
        machine = ", ".join(f"{key} {value}" for key, value in found["machine"].items())
        rows = []
        for row in found["rows"]:
            points = row["points"]
            of_points = (
                (points, f"{row['in_contact']:.0%}", time_text(row["seconds"] / points)) if points else ("",) * 3
            )
            rows.append((row["name"], time_text(row["seconds"]), *map(str, of_points), f"{row['spread']:.2f}"))
        table = list_table(("work", "best time", "points", "in contact", "time a point", "slowest / best"), rows)
        window = list_table(("the window", "measured"), [(one["name"], measured_text(one)) for one in found["window"]])
        return self.parse_text_to_nodes(f"```{{eval-rst}}\n{table}\n\n{window}\n```\n\n{machine}. {found['note']}")


def setup(app: Sphinx) -> None:
    """Register the directive."""
    app.add_directive("costs", Costs)
