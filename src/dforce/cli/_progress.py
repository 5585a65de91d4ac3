"""The progress bar: on stderr, on a terminal, and only once a run has taken a second."""

from __future__ import annotations

import threading
from types import TracebackType
from typing import TYPE_CHECKING, Self

import dforce as df
from dforce.cli._terminal import console

if TYPE_CHECKING:
    from rich.progress import Progress

WAIT = 1.0  # s; what is quicker needs no bar


class Bar:
    """A progress function for :func:`dforce.run` that draws a bar with the time left."""

    def __init__(self, title: str, shown: bool = True) -> None:
        self.title = title
        self.bar: Progress | None = None
        self.timer: threading.Timer | None = None
        self.shown = shown

    def __enter__(self) -> Self:
        """Start to wait; the bar appears on its own, even while nothing is reported (a first compilation)."""
        terminal = console(stderr=True)
        if self.shown and terminal.is_terminal:
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            self.bar = Progress(
                TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(),
                TimeRemainingColumn(), TextColumn("{task.fields[note]}", markup=False),
                console=terminal, transient=True,
            )  # fmt: skip
            self.task = self.bar.add_task(df.shorten(self.title, 40), total=None, note="")
            self.timer = threading.Timer(WAIT, self.bar.start)
            self.timer.daemon = True
            self.timer.start()
        return self

    def __call__(self, done: int, total: int, note: str) -> None:
        """Take note of the points done."""
        if self.bar is not None:
            self.bar.update(self.task, completed=done, total=total, note=note)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the bar away."""
        if self.timer is not None and self.bar is not None:
            self.timer.cancel()
            self.timer.join()
            self.bar.stop()
