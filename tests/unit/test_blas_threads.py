"""Linear algebra on one thread, and on as many as before afterwards."""

import ctypes
import importlib

import pytest

from dforce.core.blas_threads import LINKED, one_blas_thread


def each(word, *numbers):
    libraries = [(ctypes.CDLL(importlib.import_module(module).__file__), name.format(word)) for module, name in LINKED]
    return [getattr(library, name)(*numbers) for library, name in libraries if hasattr(library, name)]


def counts():
    return each("get")


@pytest.fixture
def two_threads():
    """Give OpenBLAS two threads, whatever tests have."""
    before = counts()
    each("set", 2)
    yield
    for count in set(before):
        each("set", count)


@pytest.mark.skipif(not counts(), reason="no OpenBLAS")
def test_threads_are_given_back_when_the_last_of_two_has_ended(two_threads):
    before = counts()
    assert before == [2] * len(before)
    first, second = one_blas_thread(), one_blas_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert counts() == [1] * len(before)
    second.__exit__(None, None, None)
    assert counts() == before
