"""What dForce says while it works, beside results and errors."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar

from dforce.errors import checked


class Listening:
    """One who listens, see :func:`listening`.

    Attributes
    ----------
    seconds
        Time (s) that went into what is done only once, such as compiling, or into waiting for another thread that did it.
    """

    def __init__(self, listener: Callable[[str], None]) -> None:
        self.listener, self.seconds = listener, 0.0
        self._heard = ""

    def hear(self, text: str) -> None:
        """Tell the listener a sentence, but not the same one twice in a row."""
        if text != self._heard:
            self._heard = text
            self.listener(text)


_listening: ContextVar[Listening | None] = ContextVar("listening", default=None)


def announce(text: str) -> None:
    """Print a sentence on the error stream, or hand it to who listens (:func:`listening`)."""
    one = _listening.get()
    if one is None:
        print(text, file=sys.stderr, flush=True)
    else:
        one.hear(text)


@checked
@contextlib.contextmanager
def listening(listener: Callable[[str], None]) -> Iterator[Listening]:
    """Hand to a function, in this thread, what dForce says while the context lasts, such as that it compiles."""
    one = Listening(listener)
    token = _listening.set(one)
    try:
        yield one
    finally:
        _listening.reset(token)


@contextlib.contextmanager
def done_once() -> Iterator[None]:
    """Count the time of what is done only once, for who listens, apart from that of computing."""
    one, begun = _listening.get(), time.monotonic()
    try:
        yield
    finally:
        if one is not None:
            one.seconds += time.monotonic() - begun


def is_heard() -> bool:
    """Say whether somebody listens in this thread."""
    return _listening.get() is not None
