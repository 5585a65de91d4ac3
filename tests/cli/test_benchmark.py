"""The benchmark runs, compares in one run, and says on what machine."""

from __future__ import annotations

import asyncio
import importlib.util
import itertools
import json
import sys
import time
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

import dforce as df
from dforce.checks.benchmark import many_users
from dforce.checks.benchmark.server import Server
from dforce.checks.benchmark.table import Table
from dforce.cli import app

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

# the window's packages are left out where the lowest versions of all others are tried
with_window = pytest.mark.skipif(importlib.util.find_spec("nicegui") is None, reason="NiceGUI is not installed")


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
    assert result["window"] == []  # it takes a server and its time: the next test
    assert result["note"].startswith("These figures are rough")


@with_window
def test_few_people_at_the_window_all_see_their_last_value():
    median, late, slowest, behind, *memory = many_users.measures(*many_users.FEW, lambda name: None)
    assert median.name == "the window, 5 people at once for 2 s: a value to its curves, median"
    assert median.value is not None
    assert 0.0 < median.value <= late.value <= slowest.value and median.unit == "s"
    assert behind.value == 0
    assert [measure.unit for measure in memory] == ["MB"] * (sys.platform == "linux")


def test_what_is_short_is_timed_more_often_by_the_clock_of_the_table():
    ticks, runs = itertools.count(), []
    table = Table(2, 0.05, lambda name: None, lambda: float(next(ticks)))

    def work():
        runs.append(None)
        time.sleep(0.004)

    table.time("short", work, count=4)
    assert 3 < len(runs) <= 14  # one that does not count, two at least, and others within 50 ms
    runs.clear()
    table.time("given", work, count=4, repeats=1)
    assert len(runs) == 2
    assert [row.seconds for row in table.rows] == [0.25, 0.25]  # one tick from the start of each to its end


def test_without_what_the_window_needs_the_benchmark_says_so(monkeypatch):
    monkeypatch.setattr(many_users, "NEEDED", ("numpy", "a_package_that_is_not_there"))
    (measure,) = many_users.measures(*many_users.FEW, lambda name: None)
    assert measure.value is None
    assert measure.name == "the window: it needs a_package_that_is_not_there, which is not installed"


@with_window
def test_a_server_that_ends_at_once_is_said_with_its_reason(tmp_path):
    with pytest.raises(RuntimeError, match="no-such-case"):
        Server(tmp_path, "no-such-case")


@with_window
def test_people_are_behind_until_they_see_their_last_value_and_what_was_overtaken_is_not_timed():
    from dforce.gui.chart import packed

    person = many_users.Person(None, 0)
    sent = []

    async def emit(name, message):
        if name == "event":
            sent.append(json.loads(message["args"][0])["text"])

    def figure(amplitude):
        return {"data": [{"y": packed([0.5 * amplitude, amplitude, 0.0])}]}

    person.socket = SimpleNamespace(emit=emit)
    person.field, person.client, person.listener = 1, "client", "listener"
    for value in (5.0, 6.0, 7.0):
        asyncio.run(person.ask(value))
    assert sent == ["5.0", "6.0", "7.0"]
    person.see(figure(6.0))
    assert person.behind and len(person.times) == 1
    person.see(figure(5.0))  # what is older than what was seen is no answer
    person.see(figure(7.0))
    assert not person.behind and len(person.times) == 2


def test_a_table_in_a_pipe_has_a_line_for_each_row(monkeypatch):
    names = [f"{'a long name of what is timed, ' * 3}number {i}" for i in range(3)]
    row = {"seconds": 1e-6, "spread": 1.5, "ratio": 2.0, "to": names[0], "limit": 3.0}
    window = [
        {"name": "the window: how soon", "value": 0.0521, "unit": "s"},
        {"name": "none", "value": None, "unit": ""},
    ]
    table = {
        "rows": [row | {"name": name} for name in names], "window": window, "machine": {"cores": "2"}, "note": "a note " * 40,
    }  # fmt: skip
    monkeypatch.setattr("dforce.checks.benchmark.benchmark", lambda quick, progress: table)
    head, *lines = CliRunner().invoke(app, ["benchmark"], env={"COLUMNS": "80"}).stdout.splitlines()
    assert head.split() == ["what", "time", "ratio", "to", "meant", "to", "be", "below", "slowest/best"]
    assert [line[: len(name)] for line, name in zip(lines, names, strict=False)] == names
    assert lines[3:5] == ["the window: how soon  52.1 ms", "none"]
    assert len(lines) == len(names) + 4


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
