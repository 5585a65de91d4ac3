"""SIGTERM, which batch queues, `timeout` and a shutdown send, stops a run as Ctrl-C does: what was computed is kept."""

from __future__ import annotations

import contextlib
import math
import signal
import threading
import time
from collections.abc import Iterator
from types import FrameType
from typing import Any

SAME = 1.0  # s within which a second Ctrl-C is the first one: `timeout` sends it to the process and to its group


class Ending:
    """The end of a run, from its last point until its result is kept: a stop that comes then has to wait.

    Attributes
    ----------
    asked
        Whether a stop came, and waits.
    """

    def __init__(self) -> None:
        self.asked = False
        self._inside = 0
        self._reached = False
        self._stopped = -math.inf
        self._terminated = False

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

    def reached(self, here: bool) -> None:
        """Take note whether the end is reached."""
        self._reached = here and self._inside > 0
        if self.asked and not self._reached:
            self.asked = False
            raise KeyboardInterrupt

    def hear(self, number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt at the first SIGTERM and at each Ctrl-C, unless it has to wait: a handler of signals."""
        before, self._stopped = self._stopped, time.monotonic()
        # no later SIGTERM may disturb what keeps the results; a person who presses Ctrl-C again wants no more of it
        again = self._terminated if number == signal.SIGTERM else self._stopped - before < SAME
        self._terminated |= number == signal.SIGTERM
        if again:
            return
        if self._reached and not self.asked:
            self.asked = True
            return
        raise KeyboardInterrupt

    def forget(self) -> None:
        """Take the next signal for a first one."""
        self._stopped, self._terminated = -math.inf, False


_ending = Ending()


@contextlib.contextmanager
def late_stop_waits() -> Iterator[Ending]:
    """Let a stop (Ctrl-C, SIGTERM) that comes once a run inside has all its points wait until the context ends.

    Before that it ends the run, as :func:`sigterm_as_ctrl_c` says. What the context gives says in `asked` whether one came.
    In another thread than the main one, which hears no signals, nothing waits.
    """
    if not _in_main_thread():
        yield Ending()
        return
    with sigterm_as_ctrl_c(), _ending.lasting():
        yield _ending


def at_end(here: bool) -> None:
    """Say whether a run has all its points.

    Raises
    ------
    KeyboardInterrupt
        When it has not after all, and a stop came since.
    """
    if _in_main_thread():
        _ending.reached(here)


@contextlib.contextmanager
def sigterm_as_ctrl_c() -> Iterator[None]:
    """Raise KeyboardInterrupt at the first SIGTERM while the context lasts; later ones must not disturb what keeps the results.

    A handler that the program has set itself stays, and so does Python's own where this is not the main thread.
    """
    usual: dict[signal.Signals, Any] = {signal.SIGTERM: signal.SIG_DFL, signal.SIGINT: signal.default_int_handler}
    ours = [number for number, handler in usual.items() if _in_main_thread() and signal.getsignal(number) is handler]
    if signal.SIGTERM in ours:
        _ending.forget()
    for number in ours:
        signal.signal(number, _ending.hear)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, usual[number])


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
