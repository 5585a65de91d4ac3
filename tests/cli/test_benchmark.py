"""The benchmark runs, compares in one run, and says on what machine."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

import dforce as df
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


def test_a_table_in_a_pipe_has_a_line_for_each_row(monkeypatch):
    names = [f"{'a long name of what is timed, ' * 3}number {i}" for i in range(3)]
    row = {"seconds": 1e-6, "spread": 1.5, "ratio": 2.0, "to": names[0], "limit": 3.0}
    table = {"rows": [row | {"name": name} for name in names], "machine": {"cores": "2"}, "note": "a note " * 40}
    monkeypatch.setattr(df, "benchmark", lambda quick, progress: table)
    head, *lines = CliRunner().invoke(app, ["benchmark"], env={"COLUMNS": "80"}).stdout.splitlines()
    assert head.split() == ["what", "time", "ratio", "to", "meant", "to", "be", "below", "slowest/best"]
    assert [line[: len(name)] for line, name in zip(lines, names, strict=False)] == names
    assert len(lines) == len(names) + 2


def test_accuracy_has_a_price_and_the_exact_values_of_table_1_are_met():
    done = CliRunner().invoke(app, ["benchmark", "--accuracy", "--quick", "--json"])
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    # from an independent solution, to the digits known
    assert result["reference"]["table-1-am"] == pytest.approx([4.0553735e-9, 54.20379], rel=2e-8, abs=5e-6)
    own = {row["setting"]: row for row in result["rows"] if row["method"] == "periodic rk4"}
    assert own[1024]["amplitude_error"] < 0.1 * own[128]["amplitude_error"]
    cheapest = result["cheapest"]["table-1-am"]
    assert cheapest["amplitude_error"] <= 1e-15 and cheapest["phase_error"] <= 1e-4
    left, right = df.plot.cost_of_accuracy(result)
    assert [line.get_label() for line in left.lines] == [line.get_label() for line in right.lines]
    assert {row["method"] for row in result["rows"]} == {line.get_label() for line in left.lines}
