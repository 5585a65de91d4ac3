"""Solvers that processes of their own compile while a first run compiles its tip equation."""

from __future__ import annotations

import base64
import multiprocessing
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
from tiers import some_long

import dforce as df
from dforce import kernel
from dforce.core import first_answer
from dforce.core.first_answer import early_answers
from dforce.kernel import behind
from dforce.kernel.tip import TipFunctions
from dforce.solvers import beside
from dforce.solvers.integrator import CALLED, load_kernels

CASES = ("figure-3-air", "table-1-bimodal")
NAMES = (beside.WORK, *beside.LATER)


def short(name):
    """Return an example with a curve of two points."""
    return df.example(name).replace("experiment", {"kind": "approach", "zc": np.array([10e-9, 8e-9])})


class Going:
    """A process that compiles and is not done."""

    def poll(self):
        return None


@pytest.fixture
def started(monkeypatch):
    """What is begun, and not done, as if it were the first time and two cores were free."""
    begun = []
    monkeypatch.setenv(first_answer.VARIABLE, "early")
    monkeypatch.setattr(beside, "cores", lambda: 2)
    monkeypatch.setattr(beside, "_BESIDE", set())
    monkeypatch.setattr(beside, "_BEHIND", {})
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: None)
    monkeypatch.setattr(behind, "start", lambda *what: begun.append(what) or Going())
    return begun


def types_of(problem):
    """Return how many kinds of arguments each solver is compiled for in this process."""
    module = load_kernels(problem)[1].module
    return {name: len(getattr(module, name).overloads) for name in NAMES}


def order(arguments):
    """Return what a process is to compile."""
    return pickle.loads(base64.b64decode(arguments[0]))


@pytest.mark.parametrize("name", some_long(CASES, [CASES[1]]))
def test_solvers_are_compiled_for_the_very_arguments_of_runs(name, started, monkeypatch):
    case = short(name)
    df.run(case)
    df.run(case.replace("experiment", {"kind": "branches", "zc": np.array([10e-9, 9.5e-9])}))
    ran = types_of(case.problem)
    assert {solver for solver, count in ran.items() if count} >= {"follow", "remeasure", "find_orbits", "march"}
    assert max(ran.values()) == 1
    beside.compile_beside(case.problem)
    beside.compile_behind(case.problem, TipFunctions(load_kernels(case.problem)[0], case.problem, CALLED))
    for name in ("give_way", "end_in_time"):  # this process does neither
        monkeypatch.setattr(behind, name, lambda: None)
    for code, arguments, _ in started:
        assert code == beside.RUN
        monkeypatch.setattr(sys, "argv", ["-c", *arguments])
        beside.main()
    assert types_of(case.problem) == dict.fromkeys(NAMES, 1)


def test_the_first_curve_begins_to_compile_its_solvers_once(started, monkeypatch):
    case, real = short(CASES[0]), kernel.Kernel.is_ready
    df.run(case)
    assert not started
    monkeypatch.setattr(kernel.Kernel, "is_ready", lambda self, name: name != "follow" and real(self, name))
    df.run(case)
    df.run(case)
    assert [order(arguments).solvers for _, arguments, _ in started] == list(beside.PROCESSES)


def test_an_early_answer_begins_to_compile_what_it_waits_for_and_the_rest_after_it(started, monkeypatch):
    case, real = short(CASES[0]), kernel.Kernel.is_ready
    with early_answers():
        df.run(case)
        assert not started
        monkeypatch.setattr(kernel.Kernel, "is_ready", lambda self, name: name != "follow" and real(self, name))
        df.run(case)
        df.run(case)
    [(_, arguments, _)] = started
    asked = order(arguments)
    assert asked.solvers == [beside.WORK] and list(asked.functions) == ["measure_force"]
    assert asked.file == load_kernels(case.problem)[0].file
    assert set(asked.later) == set(NAMES) - {beside.WORK}


def test_nothing_is_begun_where_the_environment_says_so_or_no_core_is_free(started, monkeypatch):
    problem = df.example(CASES[0]).problem
    for place, name, nothing in (
        (beside, "cores", lambda: 1),
        (multiprocessing, "parent_process", lambda: "a pool"),
        (sys, "executable", ""),
        (os, "access", lambda folder, mode: False),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(place, name, nothing)
            beside.compile_beside(problem)
        assert not started
    monkeypatch.setenv(first_answer.VARIABLE, "full")
    beside.compile_beside(problem)
    assert not started
    monkeypatch.setenv(first_answer.VARIABLE, "early")
    beside.compile_beside(problem)
    assert started


def test_a_system_without_room_for_processes_is_no_reason_to_fail(started, monkeypatch):
    def none_left(*what):
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(behind, "start", none_left)
    beside.compile_beside(df.example(CASES[0]).problem)


@pytest.mark.skipif(not behind.AUTOGROUP.exists(), reason="only Linux groups processes by their session")
def test_what_compiles_in_the_background_gives_way_with_its_whole_session():
    code = f"from dforce.kernel import behind; behind.give_way(); print(open({str(behind.AUTOGROUP)!r}).read())"
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, start_new_session=True, check=True
    )
    assert f"nice {behind.NICE}" in told.stdout
