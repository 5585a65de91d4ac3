"""Stops: Ctrl-C, SIGTERM, which batch queues, `timeout` and a shutdown send, and SIGHUP, which a closed terminal sends.

Computed points are kept.

A stop raises KeyboardInterrupt at once. An import and a compilation are not interrupted: half done, they break later code.
There the stop waits, and is raised right afterwards. A stop that ends the program also interrupts a compilation, because
nothing is compiled afterwards, but no call of LLVM: half done, it crashes the program. Other code may swallow an exception.
So a stop is due until the code that keeps the computed points calls :func:`heard`; each :func:`look` raises a stop that is
still due.
"""

from __future__ import annotations

import _thread
import contextlib
import functools
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from types import FrameType
from typing import Any

from dforce.core import log

SAME = 1.0  # s within which a second signal is the first one: `timeout` sends it to the process and to its group
AGAIN = 0.05  # s between tries to raise a stop that waits for an import or a compilation
# in the names of files: Python's importer, calls of LLVM
UNBROKEN = "<frozen importlib", f"llvmlite{os.sep}binding{os.sep}"
SENTENCE = "Stopped by {}: the finished points are kept. An incomplete result has attrs['interrupted'] = 1."
_watching: ContextVar[Callable[[], None] | None] = ContextVar("watching", default=None)


class Ending:
    """The end of a run, from its last point until its result is saved: a stop has to wait there.

    Attributes
    ----------
    asked
        Whether a stop is waiting.
    is_due, is_heard
        Whether a stop is still to be handled, and whether one was handled.
    by
        Name of the last signal that was a stop.
    """

    def __init__(self) -> None:
        self.asked, self.by = False, ""
        self._inside = 0
        self._reached = False
        self._unbroken = 0
        self.ends_program = False  # once it was heard nothing is compiled any more: a compilation may be broken off
        self._around = 0  # running imports around the outermost context
        self.forget()

    def forget(self, around: int = 0) -> None:
        """Take the next signal for a first one, inside of `around` imports."""
        self._came, self._number, self._around = -math.inf, 0, around
        self.is_due = self._waits = self._tried_again = self.is_heard = False

    @contextlib.contextmanager
    def lasting(self) -> Iterator[None]:
        """Let a stop wait once the end is reached, until the outermost of these contexts has ended."""
        if not self._inside:
            self.asked = False
        self._inside += 1
        try:
            yield
        finally:
            self._inside -= 1
            self._reached = self._reached and self._inside > 0

    @contextlib.contextmanager
    def unbroken(self) -> Iterator[None]:
        """Let a stop wait until the context ends."""
        self._unbroken += 1
        try:
            yield
        finally:
            self._unbroken -= 1
        self.look()

    def reached(self, here: bool) -> None:
        """Take note whether the end is reached."""
        self._reached = here and self._inside > 0
        if self.asked and not self._reached:
            self.asked, self.is_heard, self.is_due = False, False, True
        self.look()

    def come(self, number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt at a stop, unless it has to wait: a handler of signals."""
        if self._tried_again:
            self._tried_again = False
            if self._waits:
                self._raise(frame)
            return
        now = time.monotonic()
        # no later signal of a system may disturb the saving of results; a second Ctrl-C may
        if now - self._came < SAME or (self.is_heard and number != signal.SIGINT):
            return
        self._came, self._number, self.by = now, number, signal.Signals(number).name
        if self._reached and not self.asked:
            self.asked = self.is_heard = True
            return
        self.is_due, self.is_heard = True, False
        self._raise(frame)

    def _raise(self, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt, or try again soon where an import, a compilation or LLVM would be broken off."""
        compiles = self._unbroken > 0 and not self.ends_program
        self._waits = compiles or unbroken_around(frame) > self._around
        if not self._waits:
            raise KeyboardInterrupt
        self._raise_soon()

    def _raise_soon(self) -> None:
        # `threading` itself may be interrupted here while it holds a lock
        _thread.start_new_thread(self._try_again, (signal.Signals(self._number),))

    def _try_again(self, number: signal.Signals) -> None:
        time.sleep(AGAIN)
        self._tried_again = True
        if signal.getsignal(number) != self.come:  # the system's own handler would end the program at once
            return
        if hasattr(signal, "pthread_kill"):  # a signal wakes a thread that waits for a lock
            signal.pthread_kill(threading.main_thread().ident or 0, number)
        else:
            _thread.interrupt_main(number)

    def swallowed(self, usual: Callable[..., None], *error: Any) -> None:
        """Raise a stop again that Python could not pass on: a hook for errors in finalizers, in place of the usual hook.

        An object that a stop left unfinished may raise errors at its end; they are dropped.
        """
        if not (self.is_due or self.is_heard):
            usual(*error)
        elif self.is_due and not self._waits:
            self._waits = True
            self._raise_soon()

    def look(self) -> None:
        """Raise KeyboardInterrupt where a stop is due."""
        if self.is_due:
            self._waits = False
            raise KeyboardInterrupt

    def hear(self) -> None:
        """Take a stop that is due for heard."""
        self.is_heard |= self.is_due
        self.is_due = self._waits = False


_ending = Ending()


@contextlib.contextmanager
def late_stop_waits() -> Iterator[Ending]:
    """Let a stop (Ctrl-C, SIGTERM, SIGHUP) wait until the context ends, once a run inside has all its points.

    Before that it ends the run, as in :func:`sigterm_as_ctrl_c`. `asked` of the context's value shows whether a stop came.
    Only the main thread receives signals; in another thread nothing waits. In a program, which goes on with the result, a
    message reports the stop.
    """
    if not _in_main_thread():
        yield Ending()
        return
    with sigterm_as_ctrl_c() as outermost, _ending.lasting():
        yield _ending
        if outermost and _ending.is_heard:
            log.announce(SENTENCE.format("Ctrl-C" if _ending.by == signal.SIGINT.name else _ending.by))


def at_end(here: bool) -> None:
    """Note whether a run has all its points; look for a stop as well.

    Raises
    ------
    KeyboardInterrupt
        When a stop is due, or waited for an end that was not the end after all.
    """
    if _in_main_thread():
        _ending.reached(here)


def look() -> None:
    """Look whether the work of this thread is to stop; work that takes seconds calls this.

    Raises
    ------
    KeyboardInterrupt
        In the main thread, when a stop is due; elsewhere any error of the function given to :func:`watching`.
    """
    if _in_main_thread():
        _ending.look()
    check_cancelled = _watching.get()
    if check_cancelled is not None:
        check_cancelled()


@contextlib.contextmanager
def watching(check_cancelled: Callable[[], None]) -> Iterator[None]:
    """Let each :func:`look` in this thread call a function as well, which raises when the work is to stop."""
    token = _watching.set(check_cancelled)
    try:
        yield
    finally:
        _watching.reset(token)


def heard() -> None:
    """Mark a stop as handled, after the computed points are kept: no look raises it again."""
    if _in_main_thread():
        _ending.hear()


class Stop:
    """Whether a stop `came`."""

    came = False


@contextlib.contextmanager
def until_stopped() -> Iterator[Stop]:
    """End the work inside at a stop and mark the stop as handled; the context's value shows whether a stop came."""
    stop = Stop()
    try:
        yield stop
    except KeyboardInterrupt:
        heard()
        stop.came = True


@contextlib.contextmanager
def unbroken() -> Iterator[None]:
    """Let a stop wait until the context ends, then raise it: for work that must not be interrupted."""
    if not _in_main_thread():
        yield
        return
    with _ending.unbroken():
        yield


@contextlib.contextmanager
def sigterm_as_ctrl_c(ends_program: bool = False) -> Iterator[bool]:
    """Raise KeyboardInterrupt at the first SIGTERM or SIGHUP in the context; later ones do not disturb the saving of results.

    The context keeps a handler of the program itself, and outside the main thread also Python's handler. It yields True if it
    is the outermost handler of stops. With `ends_program` a stop also cancels a compilation.
    """
    usual: dict[signal.Signals, Any] = {signal.SIGTERM: signal.SIG_DFL, signal.SIGINT: signal.default_int_handler}
    for name in ("SIGHUP", "SIGBREAK"):  # the second on Windows alone, the first elsewhere: nohup ignores it
        if hasattr(signal, name):
            usual[getattr(signal, name)] = signal.SIG_DFL
    ours = [number for number, handler in usual.items() if _in_main_thread() and signal.getsignal(number) is handler]
    if ours:
        _ending.forget(unbroken_around(sys._getframe()))
        _ending.ends_program = ends_program
    for number in ours:
        signal.signal(number, _ending.come)
    hooks = sys.unraisablehook, sys.excepthook  # compiled code of others calls both
    if ours:
        sys.unraisablehook, sys.excepthook = (functools.partial(_ending.swallowed, hook) for hook in hooks)
    try:
        yield bool(ours)
    finally:
        sys.unraisablehook, sys.excepthook = hooks
        for number in ours:
            signal.signal(number, usual[number])


def unbroken_around(frame: FrameType | None) -> int:
    """Return how many frames around one are Python's importer or LLVM at work."""
    count = 0
    while frame is not None:
        count += any(name in frame.f_code.co_filename for name in UNBROKEN)
        frame = frame.f_back
    return count


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
