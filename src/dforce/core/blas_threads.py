"""Linear algebra of small matrices on one thread: the threads of a BLAS wait for each other longer than they compute."""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Iterator

from threadpoolctl import ThreadpoolController

_lock = threading.Lock()
_inside: list[None] = []  # one for each that computes on one thread now
_limits = contextlib.ExitStack()


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let linear algebra compute on one thread; after the last of those inside it has as many as before."""
    with _lock:
        if not _inside:
            _limits.enter_context(_libraries().limit(limits=1))
        _inside.append(None)
    try:
        yield
    finally:
        with _lock:
            _inside.pop()
            if not _inside:
                _limits.close()


@functools.cache
def _libraries() -> ThreadpoolController:
    import numpy.linalg  # noqa: F401
    import scipy.linalg  # noqa: F401

    return ThreadpoolController().select(user_api="blas")
