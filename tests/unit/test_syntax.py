"""Syntax trees made in several threads."""

from __future__ import annotations

import ast
import contextlib
import gc
import sys
import threading

import pytest

from dforce.core.syntax import expression_tree, syntax_tree

THREADS, TIMES = 4, 60
TERMS = " + ".join(f"({n} * (x - {n}) / (1.0 + x * x))" for n in range(60))


@pytest.fixture
def restless():
    """Let threads take turns as often as can be, in the middle of a tree, too: collecting garbage runs Python."""

    def collected(phase, info):
        sum(range(300))

    interval, thresholds = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(1e-6)
    gc.set_threshold(50)
    gc.callbacks.append(collected)
    yield
    gc.callbacks.remove(collected)
    gc.set_threshold(*thresholds)
    sys.setswitchinterval(interval)


@pytest.fixture
def others():
    """Let another thread make trees without a word to anybody, as a library does that reads a text with ast.literal_eval."""

    def make():
        while not over.is_set():
            with contextlib.suppress(SystemError):  # its own fault
                ast.literal_eval(str(list(range(300))))

    over, thread = threading.Event(), threading.Thread(target=make)
    thread.start()
    yield
    over.set()
    thread.join()


def test_a_tree_is_made_while_a_library_makes_others(restless, others):
    for _ in range(TIMES):
        assert syntax_tree(f"y = {TERMS}").body


def test_threads_that_make_trees_at_the_same_moment_all_get_them(restless):
    wrong = []

    def make():
        try:
            for _ in range(TIMES):
                assert syntax_tree(f"y = {TERMS}").body and expression_tree(TERMS)
        except SystemError as error:
            wrong.append(str(error))

    threads = [threading.Thread(target=make) for _ in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
