"""The progress bar: on a terminal or in a notebook, and only once a run has taken a second."""

from __future__ import annotations

import contextlib
import html
import sys
import threading
import time
from types import TracebackType
from typing import Any, Protocol, Self, TextIO, cast

from dforce.core.errors import shorten
from dforce.core.log import Heedless, watching

WAIT = 1.0  # s; quicker work needs no bar
LONGEST = 40  # characters of a title


class _Drawn(Protocol):
    """A bar somewhere on a screen."""

    def show(self) -> None:
        """Draw it."""

    def update(self, title: str, done: int, total: int, note: str) -> None:
        """Draw how far the work of this title is; another title begins anew."""

    def stop(self) -> None:
        """Take it away."""


class ProgressBar:
    """A progress function for :func:`dforce.run` that draws a bar with the time left.

    Use it as a context manager, as ``progress=True`` does. In a notebook the bar is HTML below the cell, on a terminal text
    on stderr. Elsewhere (a file, a pipe) no bar is drawn.

    Parameters
    ----------
    title
        Name of the work.
    shown
        False for no bar.
    """

    def __init__(self, title: str = "", shown: bool = True) -> None:
        self.title, self.shown = shorten(title, LONGEST), shown
        self._bar: _Drawn | None = None
        self._timer: threading.Timer | None = None
        self._watching = contextlib.ExitStack()

    def __enter__(self) -> Self:
        """Start to wait; the bar appears by itself. A first compilation shows its own bar instead."""
        self._watching.enter_context(watching(self._show_once))
        if self.shown:
            self._bar = _NotebookBar(self.title) if in_notebook() else _terminal_bar(self.title)
        if self._bar is not None:
            self._timer = threading.Timer(WAIT, self._bar.show)
            self._timer.daemon = True
            self._timer.start()
        return self

    def __call__(self, done: int, total: int, note: str) -> None:
        """Take note of the points done."""
        if self._bar is not None:
            self._bar.update(self.title, done, total, note)

    def _show_once(self, work: str, share: float) -> None:
        """Show how far work is that is done only once."""
        if self._bar is not None:
            self._bar.update(work, int(100.0 * share), 100, "")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the bar away."""
        self._watching.close()
        if self._timer is not None and self._bar is not None:
            self._timer.cancel()
            self._timer.join()
            self._bar.stop()


def in_notebook() -> bool:
    """Return whether this is a Jupyter kernel, whose cells show HTML."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


class _TerminalBar:
    """A bar on stderr."""

    def __init__(self, title: str, console: Any) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        self.bar = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}", markup=False),
            console=console,
            transient=True,
        )
        self.title = title
        self.task = self.bar.add_task(title, total=None, note="")

    def show(self) -> None:
        self.bar.start()

    def update(self, title: str, done: int, total: int, note: str) -> None:
        if title == self.title:
            self.bar.update(self.task, completed=done, total=total, note=note)
            return
        self.title = title
        self.bar.reset(self.task, completed=done, total=total, description=title, note=note)  # so does the time left

    def stop(self) -> None:
        self.bar.stop()


def _terminal_bar(title: str) -> _TerminalBar | None:
    if sys.stderr is None:
        return None
    from rich.console import Console

    console = Console(file=cast(TextIO, Heedless(sys.stderr)), highlight=False, markup=False, emoji=False)
    return _TerminalBar(title, console) if console.is_terminal else None


class _NotebookBar:
    """A bar below a cell of a notebook, replaced in place; it needs no widgets."""

    def __init__(self, title: str) -> None:
        from IPython.display import HTML, display

        self.start, self.shown, self.html = time.monotonic(), False, HTML
        # made in the cell's own thread, so that it appears below this cell, even if another thread draws it later
        self.handle = display(HTML(""), display_id=True)
        self.last = (title, 0, 0, "")

    def show(self) -> None:
        self.shown = True
        self._draw()

    def update(self, title: str, done: int, total: int, note: str) -> None:
        if title != self.last[0]:
            self.start = time.monotonic()
        self.last = (title, done, total, note)
        if self.shown:
            self._draw()

    def stop(self) -> None:
        self.handle.update(self.html(""))

    def _draw(self) -> None:
        title, done, total, note = self.last
        value = f' value="{done}" max="{total}"' if done else ""
        left = (time.monotonic() - self.start) * (total - done) / done if done else 0.0
        words = [title, *([f"{done}/{total}", f"{left:.0f} s left"] if done else []), note]
        text = html.escape(", ".join(word for word in words if word))
        self.handle.update(self.html(f"<progress{value}></progress> {text}"))


def duration(seconds: float) -> str:
    """Return a time in words."""
    if seconds < 90.0:
        return f"{max(1, round(seconds))} s"
    return f"{round(seconds / 60.0)} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
