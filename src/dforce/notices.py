"""What dForce says while it works, beside results and errors."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from contextvars import ContextVar

_listener: ContextVar[Callable[[str], None] | None] = ContextVar("listener", default=None)


def announce(text: str) -> None:
    """Print a sentence on the error stream, or hand it to who listens (:func:`listening`)."""
    listener = _listener.get()
    if listener is None:
        print(text, file=sys.stderr, flush=True)
    else:
        listener(text)


@contextlib.contextmanager
def listening(listener: Callable[[str], None]) -> Iterator[None]:
    """Hand to a function, in this thread, what dForce says while the context lasts, such as that it compiles."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
