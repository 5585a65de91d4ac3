"""Syntax trees of Python's text, one at a time: where two threads make them together, Python 3.11 may raise SystemError."""

from __future__ import annotations

import ast
import threading

_MAKING = threading.Lock()


def syntax_tree(text: str) -> ast.Module:
    """Return the syntax tree of a text of statements."""
    with _MAKING:
        return ast.parse(text)


def expression_tree(text: str) -> ast.expr:
    """Return the syntax tree of an expression."""
    with _MAKING:
        return ast.parse(text, mode="eval").body
