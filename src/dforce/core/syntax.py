"""Syntax trees of Python source, one thread at a time: Python 3.11 raises SystemError where two threads parse at once."""

from __future__ import annotations

import ast
import contextlib
import gc
import inspect
import threading
from collections.abc import Callable, Iterator
from types import CodeType
from typing import Any

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


def is_as_loaded(function: Callable[..., Any]) -> bool:
    """Return whether the file of a function, or its cell of a notebook, still has the code that Python loaded."""
    code = function.__code__
    text = "".join(inspect.findsource(function)[0])
    try:
        with _undisturbed():
            found = [compile(text, code.co_filename, "exec", ast.PyCF_ALLOW_TOP_LEVEL_AWAIT, dont_inherit=True)]
    except SyntaxError:
        return False
    for part in found:
        found += [inner for inner in part.co_consts if isinstance(inner, CodeType)]
    return any(_plain(part) == _plain(code) for part in found)


def _plain(code: CodeType) -> tuple[object, ...]:
    constants = [part for part in code.co_consts if not isinstance(part, CodeType)]
    return code.co_qualname, code.co_code, code.co_names, code.co_varnames, repr(constants)
