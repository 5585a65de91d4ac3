"""The benchmark runs, compares in one run, and says on what machine."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from dforce.cli import app


def test_a_quick_benchmark_gives_ratios_spread_and_machine():
    done = CliRunner().invoke(app, ["benchmark", "--quick", "--json"])
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert {"platform", "cores", "numba"} <= set(result["machine"])
    rows = {row["name"]: row for row in result["rows"]}
    assert all(row["seconds"] > 0.0 and row["spread"] >= 1.0 for row in rows.values())
    for row in rows.values():
        if row["to"]:
            assert row["ratio"] == row["seconds"] / rows[row["to"]]["seconds"]
