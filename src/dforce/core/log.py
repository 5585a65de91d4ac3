"""Messages of dForce while it works, beside results and errors."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any, TextIO

from dforce.core.errors import checked


class Listening:
    """A listener, see :func:`listening`.

    Attributes
    ----------
    seconds
        Time (s) for work that is done only once, such as compiling, or for waiting until another thread has done it.
    """

    def __init__(self, listener: Callable[[str], None]) -> None:
        self.listener, self.seconds = listener, 0.0
        self._heard = ""

    def hear(self, text: str) -> None:
        """Pass a sentence on to the listener, but not the same sentence twice in a row."""
        if text != self._heard:
            self._heard = text
            self.listener(text)

    def watch(self, work: str, share: float) -> None:
        """Pass on the progress of work that is done only once, see :func:`watching`."""
        self.hear(f"{work}: {100.0 * share:.0f} %")


class Heedless:
    """A stream that drops text which it cannot write: a full disk or a closed stream must not end a run."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        """Be the stream in all the rest."""
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write text, if that can be done; return its length."""
        with contextlib.suppress(OSError, ValueError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush the stream, if possible."""
        with contextlib.suppress(OSError, ValueError):
            self._stream.flush()


_listening: ContextVar[Listening | None] = ContextVar("listening", default=None)
_watching: ContextVar[Callable[[str, float], None] | None] = ContextVar("watching", default=None)


def announce(text: str) -> None:
    """Print a sentence on the error stream, or hand it to who listens (:func:`listening`)."""
    one = _listening.get()
    if one is not None:
        one.hear(text)
    elif sys.stderr is not None:
        print(text, file=Heedless(sys.stderr), flush=True)


@checked
@contextlib.contextmanager
def listening(listener: Callable[[str], None]) -> Iterator[Listening]:
    """Pass the messages of dForce in this thread, such as on compiling, to a function while the context lasts."""
    one = Listening(listener)
    token = _listening.set(one)
    try:
        yield one
    finally:
        _listening.reset(token)


def show_progress(work: str, share: float) -> None:
    """Hand the name of work that is done only once, and the share that is done, to who watches (:func:`watching`)."""
    watcher = _watching.get()
    if watcher is not None:
        watcher(work, share)


@contextlib.contextmanager
def watching(watcher: Callable[[str, float], None]) -> Iterator[None]:
    """Hand to a function, in this thread, how far work is that is done only once, while the context lasts."""
    token = _watching.set(watcher)
    try:
        yield
    finally:
        _watching.reset(token)


@contextlib.contextmanager
def done_once() -> Iterator[None]:
    """Count the time of work that is done only once, for the listener, apart from the computing time."""
    one, begun = _listening.get(), time.monotonic()
    try:
        yield
    finally:
        if one is not None:
            one.seconds += time.monotonic() - begun


def is_heard() -> bool:
    """Return whether this thread has a listener."""
    return _listening.get() is not None
