"""Tells the compiler that the arrays which a function is given share no memory.

Before a loop is turned into vector instructions, the compiler makes sure that what is written is not what is read elsewhere:
by a check at run time for each pair of rows. Over 128 such checks the loop stays as it is; two modes over a base that
is shaken at two tones need more. With nothing to check there is no such limit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def unshared(decorate: Callable[..., Any]) -> Callable[..., Any]:
    """Return a decorator that compiles as this one does, with arrays that share no memory.

    A numba that cannot be told so compiles as usual.
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
