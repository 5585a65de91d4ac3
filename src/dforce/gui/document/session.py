"""A session: one browser's document with its history, kept over a reload, a cut connection and a restart."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import time
import weakref
from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import dforce as df
from dforce.gui.document.compute import Job
from dforce.gui.document.document import LOOKS, Document, KeptResult, MeasuredData
from dforce.gui.document.store import KEY, ResultStore, Saving, color_of, name_of
from dforce.gui.measured.fitting import lever_and_tip, unconfirmed
from dforce.gui.measured.session import FitJob, MeasuredSession, curve_in
from dforce.gui.study.parameter_study import ParameterStudy
from dforce.gui.window.security import ALONE, Limits

if TYPE_CHECKING:
    import xarray as xr

MOST_STEPS = 200  # of undo
TOGETHER = 1.5  # s; edits of one field that follow each other faster are one step of undo
UNREAD = "unread"  # name in the store of unreadable data
LOOKED_EVERY = 0.1  # s between two looks at a run


class PageView(Protocol):
    """The news that a session sends to a page that shows it."""

    def show(self, anew: bool) -> None:
        """Show the session's document; `anew`: its forms have changed, not only values."""

    def show_job(self) -> None:
        """Show how far the session's run is."""

    def show_anew(self) -> None:
        """Draw the same results in another way; nothing is computed."""

    def show_unkept(self) -> None:
        """Show whether the input is kept."""

    def show_result(self, result: xr.Dataset) -> None:
        """Show a result of the document's case."""


class Session:
    """One person's work.

    Parameters
    ----------
    store
        A dict that is kept over a restart; it raises :class:`dforce.ResultError` where it cannot keep a value.
    folder
        The folder for this session's results alone.
    limits
        Limits of the computations.
    """

    def __init__(self, store: MutableMapping[str, object], folder: Path, limits: Limits = ALONE) -> None:
        self.store, self.results, self.limits = store, ResultStore(folder), limits
        self.measured = MeasuredSession(folder / "measured")
        self.study = ParameterStudy()
        self.fresh = KEY not in store  # nothing was typed or opened so far
        self.document = self._kept()
        self._known: dict[str, weakref.ref[xr.Dataset]] = {}
        self.results_of: dict[str, xr.Dataset] = {}  # the drawn results, by identifier
        self.undone: list[Document] = []
        self.steps: list[Document] = []
        self.views: list[PageView] = []
        self.job: Job | None = None
        self.fitting: FitJob | None = None  # the last fit of the measured curve
        self._last = ("", 0.0)
        self._seen = time.monotonic()
        self._keeping = asyncio.Lock()
        self.saving = Saving(store, lambda: self.document, self._show_unkept)
        self.tab = ""  # that was opened last; the next page begins there
        self.person: str | None = None  # the name of a guest of a class; None: whose server it is

    def edit(self, document: Document, *, name: str = "", anew: bool = False) -> None:
        """Take a new document as one step of undo; quick edits of one `name` are one step together."""
        # an edit changes the input; results and their display stay
        document = self._with_looks(document)
        if document == self.document:
            if anew:  # the opened document is shown, and incomplete input goes
                self._take(document, anew)
            return
        together = name and self._last[0] == name and time.monotonic() - self._last[1] < TOGETHER
        if not together:
            self.steps = [*self.steps[-MOST_STEPS + 1 :], self.document]
        self._last = (name, time.monotonic())
        self.undone.clear()
        self._take(document, anew)

    def look(self, document: Document) -> None:
        """Take a document with the same case and another display. Nothing is computed, and it is no step of undo."""
        self.document = document
        self.saving.soon()
        for view in tuple(self.views):
            view.show_anew()

    def hide_kept(self) -> None:
        """Draw none of the results kept; they stay in the list."""
        if any(kept.shown for kept in self.document.results):
            hidden = tuple(dataclasses.replace(kept, shown=False) for kept in self.document.results)
            self.look(dataclasses.replace(self.document, results=hidden))

    def show_kept(self, result: xr.Dataset) -> None:
        """Draw a kept result that was hidden."""
        own = self.kept_as(result)
        if own is not None and not own.shown:
            results = tuple(dataclasses.replace(one, shown=one.shown or one is own) for one in self.document.results)
            self.look(dataclasses.replace(self.document, results=results))

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
        # results are computed, not typed: no step back loses them, nor how they are drawn; another case has its own curve
        own = self.document if document.opened is self.document.opened else document
        self._take(dataclasses.replace(self._with_looks(document), measured=own.measured), anew=True)

    def _with_looks(self, document: Document) -> Document:
        return dataclasses.replace(document, **{name: getattr(self.document, name) for name in LOOKS})

    def _take(self, document: Document, anew: bool) -> None:
        self.fresh = False
        self.document = document
        self.saving.soon()
        for view in tuple(self.views):
            view.show(anew)

    async def run(self, document: Document) -> None:
        """Run a document's case once the session has no other run, and keep its result; partial ones too.

        A run that had to wait is not begun when it has been done, or another case is typed by then. A result is shown
        where the document still holds its case; else it is in the list, and not drawn.

        Raises
        ------
        ParameterError
            When the input is not a case, or exceeds the limits.
        """
        case = self.limits.check(document.case())
        while self.job is not None and self.job.busy:
            await asyncio.sleep(LOOKED_EVERY)
            if self.job.is_of(document) or not document.same_case(self.document):
                return
        job = self.job = Job(case, self.limits.seconds, document)
        await job.go(self.look_at_jobs, LOOKED_EVERY)
        if job.result is not None:
            try:
                # one that was stopped before there was anything is not kept
                if (job.result["status"] != df.Status.NOT_COMPUTED).any():
                    await self.keep(job.result, shown=job.is_of(self.document))
            except df.ResultError as error:
                job.error = f"this result could not be kept: {error}"
            if job is self.job and job.is_of(self.document):  # one that did not stop in time may end after a later one
                for view in tuple(self.views):
                    view.show_result(job.result)
        self.look_at_jobs()

    async def keep(self, result: xr.Dataset, shown: bool = True) -> None:
        """Keep a result in the store and in the list; the oldest ones go where the store is full."""
        async with self._keeping:  # else the later list leaves out a result that is still being written
            await self._keep(result, shown)

    async def _keep(self, result: xr.Dataset, shown: bool) -> None:
        last = self.document.results[-1].id if self.document.results else ""

        def shelve() -> tuple[str, set[str], xr.Dataset | None]:
            before = self.results.take(last) if last in self.results.names() else None
            return self.results.keep(result), set(self.results.names()), before

        identifier, here, before = await asyncio.to_thread(shelve)
        others = [kept for kept in self.document.results if kept.id in here]
        name = name_of(result, before, [kept.name for kept in others])
        self._known[identifier] = weakref.ref(result)
        if shown:
            self.results_of[identifier] = result
        entry = KeptResult(identifier, name, color_of(others), shown)
        self.look(dataclasses.replace(self.document, results=(*others, entry)))

    async def take_result(self, document: Document, result: xr.Dataset) -> None:
        """Replace the shown document by a result and the document of its case.

        Raises
        ------
        ResultError
            When the result cannot be written; nothing has changed then.
        """
        await self.keep(result)
        self.edit(document, anew=True)

    async def take_project(self, document: Document, results: dict[str, xr.Dataset]) -> None:
        """Replace the shown document by a project; results kept before stay in the list, hidden.

        Raises
        ------
        ResultError
            When a result cannot be written; nothing has changed then.
        CaseError
            When the document cannot be shown; nothing has changed then.
        """
        async with self._keeping:
            await self._take_project(document, results)
        self._leave_fit()

    async def _take_project(self, document: Document, results: dict[str, xr.Dataset]) -> None:
        names: dict[str, str] = {}
        before: tuple[Document, list[Document]] | None = None
        try:
            for identifier, result in results.items():
                store = self.results if identifier in {kept.id for kept in document.results} else self.measured.results
                names[identifier] = await asyncio.to_thread(store.keep, result)
            here, before = set(self.results.names()), (self.document, self.steps)
            taken = [dataclasses.replace(kept, id=names[kept.id]) for kept in document.results]
            others = [dataclasses.replace(kept, shown=False) for kept in self.document.results if kept.id in here]
            measured = document.measured
            if measured is not None:
                measured = dataclasses.replace(measured, id=names[measured.id], fit=names.get(measured.fit, ""))
            looks = {name: getattr(document, name) for name in LOOKS}
            looks |= {"results": (*others, *taken), "measured": measured}
            self.document = dataclasses.replace(self.document, **looks)
            self.edit(document, anew=True)
        except Exception as error:
            for store in (self.results, self.measured.results):
                for name in set(names.values()) & set(store.names()):
                    store.drop(name)
            if before is not None:
                document, self.steps = before
                self._take(document, anew=True)
            if isinstance(error, df.DForceError):
                raise
            raise df.CaseError("this project contains a case that cannot be shown") from error
        self.look(self.document)
        await self._tidy_measured()

    def kept_as(self, result: xr.Dataset | None) -> KeptResult | None:
        """Return the entry of a result in the list; None if it is not kept."""
        same = (identifier for identifier, known in self._known.items() if known() is result and result is not None)
        identifier = next(same, "")
        return next((kept for kept in self.document.results if kept.id == identifier), None)

    def kept_of(self, case: df.Case) -> xr.Dataset | None:
        """Return a drawn result of a case that is whole and of this version; None where there is none."""
        wanted = {"case": case.to_toml(complete=True), "dforce_version": df.__version__} if self.results_of else {}
        whole = (result for result in self.results_of.values() if not result.attrs.get("interrupted"))
        return next((result for result in whole if wanted.items() <= result.attrs.items()), None)

    async def drop(self, identifier: str) -> None:
        """Forget a result."""
        results = tuple(kept for kept in self.document.results if kept.id != identifier)
        self.look(dataclasses.replace(self.document, results=results))
        self.results_of.pop(identifier, None)
        with contextlib.suppress(df.ResultError):  # another page was quicker
            await asyncio.to_thread(self.results.drop, identifier)

    async def load_shown(self) -> None:
        """Have the results that are drawn in memory, and no others."""
        wanted = {kept.id for kept in self.document.results if kept.shown}
        for identifier in set(self.results_of) - wanted:
            del self.results_of[identifier]
        for identifier in wanted - set(self.results_of):
            with contextlib.suppress(df.ResultError):  # its file has gone: nothing is drawn
                known = self._known.get(identifier, lambda: None)()
                result = known if known is not None else await asyncio.to_thread(self.results.take, identifier)
                self.results_of[identifier] = result
                self._known[identifier] = weakref.ref(result)

    async def take_measured(self, raw: xr.Dataset, name: str, settings: Mapping[str, object]) -> None:
        """Take a measured curve in place of an earlier one.

        Raises
        ------
        ResultError
            When it cannot be written; nothing has changed then.
        """
        self._leave_fit()
        self.fresh = False
        async with self._keeping:  # a curve or fit that comes meanwhile would remove the file before it has its name
            measured = await self.measured.keep(raw, name, settings)
            self.look(dataclasses.replace(self.document, measured=measured))
            await self._tidy_measured()

    async def take_fit(self, fit: xr.Dataset) -> None:
        """Take a fit that was opened, and the measured curve in it.

        Raises
        ------
        ResultError
            When they cannot be written.
        """
        await self.take_measured(*curve_in(fit))
        await self._keep_fit(fit, self.document.measured)

    async def _keep_fit(self, fit: xr.Dataset, measured: MeasuredData | None) -> None:
        """Keep a fit of a measured curve while that is there."""
        async with self._keeping:
            identifier = await asyncio.to_thread(self.measured.results.keep, fit)
            now = self.document.measured  # with the input during the writing of the file
            if measured is not None and now is not None and now.id == measured.id:
                self.look(dataclasses.replace(self.document, measured=dataclasses.replace(now, fit=identifier)))
            await self._tidy_measured()

    async def drop_measured(self) -> None:
        """Forget the measured curve and its fit."""
        self._leave_fit()
        self.look(dataclasses.replace(self.document, measured=None))
        async with self._keeping:
            await self._tidy_measured()

    async def _tidy_measured(self) -> None:
        await self.measured.tidy(self.document, [*self.steps, self.document, *reversed(self.undone)])

    async def fit(self, document: Document) -> None:
        """Fit the parameters that a document names to its measured curve, and keep the fit; one that is stopped, too.

        Raises
        ------
        ParameterError
            When the input is not a case, or exceeds the limits; and where lever and tip are not
            confirmed for the curve.
        """
        curve = await self.measured.load(document)  # as it is for this instrument: a curve that is drawn may be behind
        if curve is None or (self.fitting is not None and self.fitting.busy):
            return
        case = self.limits.check(document.case())
        if why := unconfirmed(document, lever_and_tip(case)):
            raise df.ParameterError(why)
        job = self.fitting = FitJob(case, self.limits.seconds, document, data=curve)
        await job.go(self.look_at_jobs, LOOKED_EVERY)
        if job.result is not None:
            try:
                await self._keep_fit(job.result, document.measured)
            except df.ResultError as error:
                job.state, job.error = "failed", f"this fit could not be kept: {error}"
        self.look_at_jobs()

    def stop_fit(self) -> None:
        """Stop the current fit; the best so far is kept."""
        if self.fitting is not None:
            self.fitting.stopping.set()

    def _leave_fit(self) -> None:
        """Stop the current fit, and forget it: another curve comes."""
        self.stop_fit()
        self.fitting = None

    def stop(self) -> None:
        """Stop the current run; its finished points are kept."""
        if self.job is not None:
            self.job.stopping.set()

    def look_at_jobs(self) -> None:
        """Have pages show how far everything is."""
        for view in tuple(self.views):
            view.show_job()

    def idle(self, seconds: float) -> bool:
        """Return whether no page has shown the session for so long and nothing runs."""
        jobs = (self.job, self.fitting, self.study.job, self.measured.safe, self.measured.force)
        busy = bool(self.views) or self.saving.waits or any(job is not None and job.busy for job in jobs)
        if busy:
            self._seen = time.monotonic()
        return time.monotonic() - self._seen > seconds

    def close(self) -> None:
        """Stop the run and keep the document; the server ends."""
        self.stop()
        self.stop_fit()
        self.measured.stop()
        self.study.stop()
        self.saving.end()

    def _show_unkept(self) -> None:
        for view in tuple(self.views):
            view.show_unkept()

    def _kept(self) -> Document:
        try:
            return Document.from_plain(self.store[KEY]) if KEY in self.store else Document.first()
        except df.CaseError:
            with contextlib.suppress(df.ResultError):  # reported at the next input
                self.store[UNREAD] = self.store[KEY]  # later input must not write over it
            return Document.first()
