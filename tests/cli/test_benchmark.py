"""The benchmark runs, compares in one run, and says on what machine."""

from __future__ import annotations

import asyncio
import importlib.util
import itertools
import json
import os
import subprocess
import sys
import time
from types import SimpleNamespace

import many_users
import pytest
import synthetic
from served import Server
from table import Table
from typer.testing import CliRunner

from dforce.cli.app import app

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

# the window's packages are left out where the lowest versions of all others are tried
with_window = pytest.mark.skipif(importlib.util.find_spec("nicegui") is None, reason="NiceGUI is not installed")


def test_a_quick_benchmark_gives_times_spread_contact_and_machine():
    done = CliRunner().invoke(app, ["benchmark", "--quick", "--json"])
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert {"platform", "cores", "numba"} <= set(result["machine"])
    far, near = result["rows"]
    assert all(row["seconds"] > 0.0 and row["spread"] >= 1.0 for row in (far, near))
    assert far["points"] == 402 and far["in_contact"] == 0.0
    assert near["points"] == 562 and near["in_contact"] > 0.5


def test_a_run_that_is_stopped_ends_a_benchmark(monkeypatch):
    monkeypatch.setattr("dforce.checks.benchmark.run", lambda case: synthetic.approach().assign_attrs(interrupted=1))
    done = CliRunner().invoke(app, ["benchmark", "--quick"])
    assert done.exit_code == 130 and done.stderr.splitlines()[1:] == ["dforce: stopped"]


STOPPED_JUDGE = """
import os, signal, sys
import dforce as df, judge
from ending import end_with

signal.signal(signal.SIGINT, signal.default_int_handler)

def stopped(work):
    return lambda *args, **settings: work(*args, **settings, progress=lambda *at: os.kill(os.getpid(), signal.SIGINT))

df.run, df.approach = stopped(df.run), stopped(df.approach)
sys.argv = ["judge.py", *sys.argv[1:]]
end_with(judge.main)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals as a terminal sends them")
@pytest.mark.parametrize(
    ("words", "first"),
    [
        (("--freeze", "frozen.npz"), ""),
        (("--fresh", "3"), "0 held against SciPy: estimate right within 3 in 0, too low in 0"),
        (("--times", "a"), f"{os.cpu_count()} cores"),
    ],
    ids=["freeze", "fresh", "times"],
)
def test_one_ctrl_c_in_a_run_ends_the_judge_with_130_and_lines_before_stay(tmp_path, words, first):
    done = subprocess.run(
        [sys.executable, "-c", STOPPED_JUDGE, *words], capture_output=True, text=True, cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "stopped\n")
    assert done.stdout.startswith(first)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
@with_window
def test_few_people_at_the_window_all_see_their_last_value():
    median, late, slowest, behind, *memory = many_users.measures(*many_users.FEW)
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
    (measure,) = many_users.measures(*many_users.FEW)
    assert measure.value is None
    assert measure.name == "the window: it needs a_package_that_is_not_there, which is not installed"


@with_window
def test_a_server_that_ends_at_once_is_said_with_its_reason(tmp_path):
    with pytest.raises(RuntimeError, match="no-such-case"):
        Server(tmp_path, "no-such-case")


@with_window
def test_people_are_behind_until_they_see_their_last_value_and_what_was_overtaken_is_not_timed():
    from dforce.gui.curves.chart import packed

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
    names = [f"{'a long name of the work, ' * 4}number {i}" for i in range(3)]
    row = {"seconds": 1e-3, "spread": 1.5, "points": 100, "in_contact": 0.71}
    rows = [row | {"name": name} for name in names]
    rows[2] |= {"points": 0}
    table = {"rows": rows, "machine": {"cores": "2"}, "note": "a note " * 40}
    monkeypatch.setattr("dforce.checks.benchmark.benchmark", lambda quick, progress: table)
    head, *lines = CliRunner().invoke(app, ["benchmark"], env={"COLUMNS": "80"}).stdout.splitlines()
    assert head.split() == ["work", "time", "points", "in", "contact", "time", "a", "point", "slowest/best"]
    assert [line[: len(name)] for line, name in zip(lines, names, strict=False)] == names
    assert lines[0].split()[-5:] == ["100", "71%", "10", "us", "1.50"]
    assert lines[2].split()[-3:] == ["1", "ms", "1.50"]
    assert len(lines) == len(names) + 2
