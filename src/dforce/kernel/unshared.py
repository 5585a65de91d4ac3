"""Declares to the compiler that the arrays among a function's arguments share no memory.

Before the compiler turns a loop into vector instructions, it ensures that written memory is not read elsewhere, with a check
at run time for each pair of rows. With over 128 checks the loop stays scalar; two modes over a base that is shaken at two
tones need more. Without checks there is no such limit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def unshared(decorate: Callable[..., Any]) -> Callable[..., Any]:
    """Return a decorator that compiles as `decorate` does, with arrays that share no memory.

    A numba without this option compiles as usual.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = decorate(function)
        compiler = getattr(dispatcher, "_compiler", None)
        usual = getattr(compiler, "_customize_flags", None)
        if compiler is None or usual is None:
            return dispatcher

        def flags_of(given: Any) -> Any:
            flags = usual(given)
            flags.noalias = True
            return flags

        compiler._customize_flags = flags_of
        return dispatcher

    return compiled
