"""Linear algebra of small matrices on one thread: the threads of OpenBLAS wait for each other longer than they compute."""

from __future__ import annotations

import contextlib
import ctypes
import threading
from collections.abc import Callable, Iterator
from importlib import import_module

# modules that are linked with OpenBLAS, and what its functions are called there; other builds keep their threads
LINKED = (
    ("numpy.linalg._umath_linalg", "scipy_openblas_{}_num_threads64_"),
    ("scipy.linalg._flapack", "scipy_openblas_{}_num_threads"),
)

_lock = threading.Lock()
_waiting: list[Callable[[], object]] = []  # what gives the threads back once the last of several has ended
_inside = 0


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let OpenBLAS compute on one thread; afterwards it has as many as before."""
    global _inside
    with _lock:
        if not _inside:
            _waiting.extend(_to_one())
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            while not _inside and _waiting:
                _waiting.pop()()


def _to_one() -> Iterator[Callable[[], object]]:
    for module, name in LINKED:
        try:
            library = ctypes.CDLL(import_module(module).__file__)
            count, change = (getattr(library, name.format(word)) for word in ("get", "set"))
        except (ImportError, OSError, AttributeError):
            continue
        before = count()
        change(1)
        yield lambda change=change, before=before: change(before)
