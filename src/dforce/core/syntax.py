"""Syntax trees of Python source, one thread at a time: Python 3.11 raises SystemError where two threads parse at once."""

from __future__ import annotations

import ast
import contextlib
import gc
import threading
from collections.abc import Iterator

_MAKING = threading.Lock()


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Keep Python from turning to another thread, which it does in the middle of a tree only to collect garbage.

    A lock alone keeps out dForce's own threads, not libraries that make trees of their own.
    """
    with _MAKING:
        collects = gc.isenabled()
        gc.disable()
        try:
            yield
        finally:
            if collects:
                gc.enable()


def syntax_tree(text: str) -> ast.Module:
    """Return the syntax tree of a text of statements."""
    with _undisturbed():
        return ast.parse(text)


def expression_tree(text: str) -> ast.expr:
    """Return the syntax tree of an expression."""
    with _undisturbed():
        return ast.parse(text, mode="eval").body
