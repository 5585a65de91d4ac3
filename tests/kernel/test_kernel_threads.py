"""Many threads that want the same kernel at the same moment."""

from __future__ import annotations

import itertools
import threading
import time

import pytest
from numba.core.registry import cpu_target

import dforce as df
from dforce.kernel import Kernel, cache, whole
from dforce.solvers.compiled import TipFunctions

THREADS = 8
NUMBERS = itertools.count(5000)
TEXT = """
from numba import njit

@njit(no_cpython_wrapper=True)
def inner(x):
    return x + {number}.0

@njit
def outer(x):
    return 2.0 * inner(x)
"""


@pytest.fixture
def kernel(tmp_path, monkeypatch):
    """Return a kernel of which one function lies in memory as a part of another one, without machine code of its own."""
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(tmp_path))
    kernel = Kernel(cache.load(TEXT.format(number=next(NUMBERS))), "what a test asks for")
    kernel.entry("outer")(1.0)
    return kernel


def test_threads_that_ask_for_one_address_at_the_same_moment_all_get_it(kernel, monkeypatch):
    with whole.compiled():
        library = cpu_target.target_context.codegen()._library_class
    optimize = library._optimize_final_module

    def slowly(part):
        time.sleep(0.1)  # so that each of them comes while the first is at work
        optimize(part)

    monkeypatch.setattr(library, "_optimize_final_module", slowly)
    found: list[object] = []
    together = threading.Barrier(THREADS)

    def ask():
        together.wait()
        try:
            found.append(kernel.address("inner", "float64(float64)"))
        except Exception as error:  # such as the KeyError of numba  # noqa: BLE001
            found.append(error)

    threads = [threading.Thread(target=ask) for _ in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == THREADS
    assert len(set(found)) == 1, found
    assert found[0]


def test_a_run_does_not_wait_until_another_one_has_compiled(monkeypatch):
    """Who waits there hears nothing of the compilation."""
    compiles, goes_on, compiled = threading.Event(), threading.Event(), TipFunctions.at

    def slowly(self, *what):
        if not compiles.is_set():
            compiles.set()
            goes_on.wait()
        return compiled(self, *what)

    monkeypatch.setattr(TipFunctions, "at", slowly)
    first, second = (threading.Thread(target=df.dwell, args=(df.example("figure-3-air"), "8 nm")) for _ in range(2))
    first.start()
    compiles.wait()
    second.start()
    second.join(60.0)
    waits = second.is_alive()
    goes_on.set()
    first.join()
    second.join()
    assert not waits
