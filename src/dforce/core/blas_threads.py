"""Linear algebra of small matrices on one thread: the threads of OpenBLAS wait for each other longer than they compute."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import threading
from collections.abc import Callable, Iterator
from importlib import import_module

# modules that are linked with OpenBLAS, and the names of its functions there; other builds keep their threads
LINKED = (
    ("numpy.linalg._umath_linalg", "scipy_openblas_{}_num_threads64_"),
    ("scipy.linalg._flapack", "scipy_openblas_{}_num_threads"),
)

_lock = threading.Lock()
_inside: list[None] = []  # one for each that computes on one thread now
_giving_back: list[Callable[[], object]] = []  # once the last of them has ended


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let OpenBLAS compute on one thread; afterwards it has as many as before."""
    with _lock:
        if not _inside:
            _giving_back.extend(_to_one())
        _inside.append(None)
    try:
        yield
    finally:
        with _lock:
            _inside.pop()
            while not _inside and _giving_back:
                _giving_back.pop()()


def _to_one() -> Iterator[Callable[[], object]]:
    for module, name in LINKED:
        try:
            library = ctypes.CDLL(import_module(module).__file__)
            count, change = (getattr(library, name.format(word)) for word in ("get", "set"))
        except (ImportError, OSError, AttributeError):
            continue
        before = count()
        change(1)
        yield functools.partial(change, before)
