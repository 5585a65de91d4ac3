"""Entry functions that Python itself runs, but for a compiled one that they leave the work to: nothing else needs compiling.

The numbers are those of compiled code but for their last digits, because a compiler may fuse a product with a sum.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

import numpy as np


def interpreted(module: ModuleType, compiled: str, entry: Callable[..., Any]) -> dict[str, Callable[..., Any]]:
    """Return a composed module's functions, by name, as Python runs them.

    Parameters
    ----------
    module
        The composed module.
    compiled
        Name of the entry function that is not run by Python. Others call what it is a name for.
    entry
        What they call in its place.
    """
    from numba.core.dispatcher import Dispatcher

    names: dict[str, Any] = dict(vars(module))
    functions = {name: f.py_func.__code__ for name, f in names.items() if isinstance(f, Dispatcher)}
    names |= {name: FunctionType(code, names, name) for name, code in functions.items()}
    [inside] = functions[compiled].co_names
    names |= {compiled: entry, inside: entry}
    return {name: _quiet(names[name]) for name in functions}


def _quiet(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let a function divide by zero without a word, as compiled code does."""

    def run(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):
            return function(*arguments)

    return run
