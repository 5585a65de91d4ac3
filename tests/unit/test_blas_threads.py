"""Linear algebra on one thread, and on as many as before afterwards."""

import ctypes
import importlib

import pytest

from dforce.core.blas_threads import LINKED, one_blas_thread


def counts():
    libraries = [(ctypes.CDLL(importlib.import_module(module).__file__), name.format("get")) for module, name in LINKED]
    return [getattr(library, name)() for library, name in libraries if hasattr(library, name)]


@pytest.mark.skipif(max(counts(), default=1) < 2, reason="no OpenBLAS, or one core")
def test_threads_are_given_back_when_the_last_of_two_has_ended():
    before = counts()
    first, second = one_blas_thread(), one_blas_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert counts() == [1] * len(before)
    second.__exit__(None, None, None)
    assert counts() == before
