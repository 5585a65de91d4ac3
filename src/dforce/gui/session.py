"""A session: one browser's document with its history, kept over a reload, a cut connection and a restart."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import time
import weakref
from collections.abc import Callable, MutableMapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import dforce as df
from dforce.gui import compare
from dforce.gui.compute import Job
from dforce.gui.document import Document, Kept
from dforce.gui.limits import ALONE, Limits
from dforce.gui.results import Shelf

if TYPE_CHECKING:
    import xarray as xr

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

    def show_anew(self) -> None:
        """Draw what is shown in another way; nothing is computed."""


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
        self._known: dict[str, weakref.ref[xr.Dataset]] = {}
        self.results_of: dict[str, xr.Dataset] = {}  # those that are drawn, by identifier
        self.undone: list[Document] = []
        self.steps: list[Document] = []
        self.views: list[View] = []
        self.job: Job | None = None
        self._last = ("", 0.0)
        self._seen = time.monotonic()
        self._saving: asyncio.TimerHandle | None = None

    def edit(self, document: Document, *, name: str = "", anew: bool = False) -> None:
        """Take a new document as one step of undo; quick edits of one `name` are one step together."""
        # an edit changes what is typed; results and how they are drawn stay
        document = self._with_looks(document)
        if document == self.document:
            if anew:  # what is opened is shown, and what was typed halfway goes
                self._take(document, anew)
            return
        together = name and self._last[0] == name and time.monotonic() - self._last[1] < TOGETHER
        if not together:
            self.steps = [*self.steps[-MOST_STEPS + 1 :], self.document]
        self._last = (name, time.monotonic())
        self.undone.clear()
        self._take(document, anew)

    def look(self, document: Document) -> None:
        """Take a document whose case is the same: what is drawn, and how. Nothing is computed, and it is no step of undo."""
        self.document = document
        self.save_soon()
        for view in tuple(self.views):
            view.show_anew()

    def hide_kept(self) -> None:
        """Draw none of the results kept; they stay in the list."""
        if any(kept.shown for kept in self.document.results):
            hidden = tuple(dataclasses.replace(kept, shown=False) for kept in self.document.results)
            self.look(dataclasses.replace(self.document, results=hidden))

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
        # results are computed, not typed: no step back loses them, nor how they are drawn
        self._take(self._with_looks(document), anew=True)

    def _with_looks(self, document: Document) -> Document:
        mine = self.document
        return dataclasses.replace(document, results=mine.results, plots=mine.plots, set_point=mine.set_point)

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
            await self.keep(job.result)
        finished(job)

    async def keep(self, result: xr.Dataset) -> None:
        """Keep a result on the shelf and in the list; the oldest ones go where the shelf is full."""
        last = self.document.results[-1].id if self.document.results else ""

        def shelve() -> tuple[str, set[str], xr.Dataset | None]:
            before = self.shelf.take(last) if last in self.shelf.names() else None
            return self.shelf.keep(result), set(self.shelf.names()), before

        identifier, here, before = await asyncio.to_thread(shelve)
        others = [kept for kept in self.document.results if kept.id in here]
        name = compare.name_of(result, before, [kept.name for kept in others])
        self.results_of[identifier] = result
        self._known[identifier] = weakref.ref(result)
        entry = Kept(identifier, name, compare.color_of(others))
        self.look(dataclasses.replace(self.document, results=(*others, entry)))

    async def take_project(self, document: Document, results: dict[str, xr.Dataset]) -> None:
        """Take a project in place of what is shown; results kept before stay in the list, hidden.

        Raises
        ------
        ResultError
            When a result cannot be written; nothing has changed then.
        CaseError
            When the document cannot be shown; nothing has changed then.
        """
        names: dict[str, str] = {}
        before, steps = self.document, self.steps
        try:
            for identifier, result in results.items():
                names[identifier] = await asyncio.to_thread(self.shelf.keep, result)
            here = set(self.shelf.names())
            taken = [dataclasses.replace(kept, id=names[kept.id]) for kept in document.results]
            others = [dataclasses.replace(kept, shown=False) for kept in self.document.results if kept.id in here]
            self.document = dataclasses.replace(
                self.document, results=(*others, *taken), plots=document.plots, set_point=document.set_point
            )
            self.edit(document, anew=True)
        except Exception as error:
            for name in set(names.values()) & set(self.shelf.names()):
                self.shelf.drop(name)
            self.steps = steps
            self._take(before, anew=True)
            if isinstance(error, df.DForceError):
                raise
            raise df.CaseError("this project holds a case that cannot be shown") from error
        self.look(self.document)

    def kept_as(self, result: xr.Dataset | None) -> Kept | None:
        """Return the entry of a result in the list; None for one that is not kept."""
        same = (identifier for identifier, known in self._known.items() if known() is result and result is not None)
        identifier = next(same, "")
        return next((kept for kept in self.document.results if kept.id == identifier), None)

    async def drop(self, identifier: str) -> None:
        """Forget a result."""
        results = tuple(kept for kept in self.document.results if kept.id != identifier)
        self.look(dataclasses.replace(self.document, results=results))
        self.results_of.pop(identifier, None)
        with contextlib.suppress(df.ResultError):  # another page was quicker
            await asyncio.to_thread(self.shelf.drop, identifier)

    async def load_shown(self) -> None:
        """Have the results that are drawn in memory, and no others."""
        wanted = {kept.id for kept in self.document.results if kept.shown}
        for identifier in set(self.results_of) - wanted:
            del self.results_of[identifier]
        for identifier in wanted - set(self.results_of):
            with contextlib.suppress(df.ResultError):  # its file has gone; the list says so by drawing nothing
                known = self._known.get(identifier, lambda: None)()
                result = known if known is not None else await asyncio.to_thread(self.shelf.take, identifier)
                self.results_of[identifier] = result
                self._known[identifier] = weakref.ref(result)

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

    def idle(self, seconds: float) -> bool:
        """Return whether no page has shown the session for so long and nothing runs."""
        busy = bool(self.views) or self._saving is not None or (self.job is not None and self.job.busy)
        if busy:
            self._seen = time.monotonic()
        return time.monotonic() - self._seen > seconds

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
