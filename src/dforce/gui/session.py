"""A session: one browser's document with its history, kept over a reload, a cut connection and a restart."""

from __future__ import annotations

import asyncio
import dataclasses
import time
from collections.abc import Callable, MutableMapping
from pathlib import Path
from typing import Any, Protocol

import dforce as df
from dforce.gui.compute import Job
from dforce.gui.document import Document
from dforce.gui.limits import ALONE, Limits
from dforce.gui.results import Shelf

MOST_STEPS = 200  # of undo
TOGETHER = 1.5  # s; edits of one field that follow each other faster are one step of undo
SAVED_AFTER = 0.5  # s
KEY = "document"


class View(Protocol):
    """What a session tells a page that shows it."""

    def show(self, anew: bool) -> None:
        """Show the session's document; `anew`: its forms have changed, not only values."""

    def show_job(self) -> None:
        """Show how far the session's run is."""


class Session:
    """One person's work.

    Parameters
    ----------
    store
        A dict that is kept over a restart.
    folder
        The folder for this session's results alone.
    limits
        What may be asked for.
    """

    def __init__(self, store: MutableMapping[str, Any], folder: Path, limits: Limits = ALONE) -> None:
        self.store, self.shelf, self.limits = store, Shelf(folder), limits
        self.document = self._kept()
        self.undone: list[Document] = []
        self.steps: list[Document] = []
        self.views: list[View] = []
        self.job: Job | None = None
        self._last = ("", 0.0)
        self._saving: asyncio.TimerHandle | None = None

    def edit(self, document: Document, *, name: str = "", anew: bool = False) -> None:
        """Take a new document as one step of undo; quick edits of one `name` are one step together."""
        if document == self.document:
            return
        together = name and self._last[0] == name and time.monotonic() - self._last[1] < TOGETHER
        if not together:
            self.steps = [*self.steps[-MOST_STEPS + 1 :], self.document]
        self._last = (name, time.monotonic())
        self.undone.clear()
        self._take(document, anew)

    def undo(self) -> None:
        """Go back a step."""
        if self.steps:
            self.undone.append(self.document)
            self._back_to(self.steps.pop())

    def redo(self) -> None:
        """Take an undone step again."""
        if self.undone:
            self.steps.append(self.document)
            self._back_to(self.undone.pop())

    def _back_to(self, document: Document) -> None:
        self._last = ("", 0.0)
        # results are computed, not typed: no step back loses them
        self._take(dataclasses.replace(document, results=self.document.results), anew=True)

    def _take(self, document: Document, anew: bool) -> None:
        self.document = document
        self.save_soon()
        for view in tuple(self.views):
            view.show(anew)

    async def run(self, case: df.Case, finished: Callable[[Job], None]) -> None:
        """Run a case, one at a time for each session, and keep its result; partial ones too."""
        if self.job is not None and self.job.busy:
            return
        job = self.job = Job(case, self.limits.seconds)
        await job.go(self._look)
        if job.result is not None:
            name = await asyncio.to_thread(self.shelf.keep, job.result)
            self.document = dataclasses.replace(self.document, results=(*self.document.results, name))
            self.save_soon()
        finished(job)

    def stop(self) -> None:
        """Stop the run under way; what it has computed is kept."""
        if self.job is not None:
            self.job.stopping.set()

    def _look(self) -> None:
        for view in tuple(self.views):
            view.show_job()

    def save_soon(self) -> None:
        """Keep the document, at most twice a second while it changes."""
        if self._saving is None:
            self._saving = asyncio.get_running_loop().call_later(SAVED_AFTER, self._save)

    def _save(self) -> None:
        self._saving = None
        self.store[KEY] = self.document.to_plain()

    def close(self) -> None:
        """Stop what runs and keep the document; the server ends."""
        self.stop()
        if self._saving is not None:
            self._saving.cancel()
            self._save()

    def _kept(self) -> Document:
        try:
            return Document.from_plain(self.store[KEY]) if KEY in self.store else Document.first()
        except df.CaseError:
            return Document.first()
