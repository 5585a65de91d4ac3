"""One page of a session: input goes to the document, the document to errors, advice, live curve and run bar."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import logging
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import TYPE_CHECKING, Any, TypeVar

from nicegui import background_tasks

import dforce as df
from dforce.gui.case.fields import with_models
from dforce.gui.curves import figures
from dforce.gui.curves.chart import Chart
from dforce.gui.curves.other_figures import ForceChart
from dforce.gui.document.compute import LIVE, RECENT, Latest, Live, in_thread, key_of, live_curve
from dforce.gui.document.document import Document
from dforce.gui.document.session import Session
from dforce.gui.window.shown import DrawnResult, Followed, PagePart, Said, ShownParts, Waiting, WantedResult
from dforce.results.curves import Picture
from dforce.validity import advice_in

if TYPE_CHECKING:
    import xarray as xr

T = TypeVar("T")
log = logging.getLogger("dforce.gui")

TRIED_AGAIN = 20.0  # s after which a slow experiment gets another chance to be live
ADVICE_AFTER = 0.4  # s without a change
BESIDE_EVERY = 0.5  # s between two updates of the parts beside the curves, while something is dragged
SAY_AFTER = 1.0  # s after which a message explains the delay
COMPUTING = "Computing ..."
TOO_LONG = "This curve takes too long for live drawing; press Run."
STOPPED = "Stopped: the finished points are shown."
UNKNOWN = "an error inside dForce, please report it"
STANDING = (TOO_LONG, STOPPED, UNKNOWN)  # after which nothing runs
NOTHING = "No result yet."
WAITING = "Another run is in progress; this run begins after it."


class View:
    """Ties a session to the elements of one page.

    The page sets the attributes `main` and `force` (charts), `prepare` and the hooks below, then calls :meth:`begin` once the
    browser is there.

    Attributes
    ----------
    shown
        The document of each part of the page; parts that are behind are marked.
    curve
        The curve of the main chart beside the results kept; None while there is none.
    on_show
        Hooks called as ``hook(anew)`` when the document has changed: forms, sliders, title.
    on_said
        Hooks called with a :class:`Said` when errors and advice are known.
    on_status
        Hooks called with a new sentence about the live curve (`status`); empty without a problem.
    on_job
        Hooks called while a run goes on and when it ends.
    on_anew
        Hooks called when results are drawn in another way: others, or other quantities of them.
    on_unkept
        Hooks called with a sentence when the input cannot be kept; empty when it is again.
    compose
        Makes the figure of the main chart from the result that it shows.
    prepare
        Solves the states that the table and the words show.
    picture
        Returns the picture of the main chart; None for a map, or nothing.
    on_beside
        Hooks called when the browser has drawn the main chart: they show the parts beside it. While something is dragged
        they wait for a pause, so that the curves come first.
    """

    main: Chart
    force: ForceChart
    prepare: Callable[[], Awaitable[None]]

    def __init__(self, session: Session) -> None:
        self.session = session
        self.on_show: list[Callable[[bool], None]] = []
        self.on_said: list[Callable[[Said], None]] = []
        self.on_status: list[Callable[[], None]] = []
        self.on_job: list[Callable[[], None]] = []
        self.on_anew: list[Callable[[], None]] = []
        self.on_unkept: list[Callable[[str], None]] = []
        self.on_beside: list[Callable[[], None]] = []
        self.compose: Callable[[xr.Dataset | None], figures.Figure] = lambda result: figures.empty("")
        self.picture: Callable[[], Picture | None] = lambda: None
        self.shown = ShownParts(lambda: self.document)
        self.shown.mark(PagePart.CURVES, self._mark_curves)
        self.shown.mark(PagePart.FORCE, lambda behind: self.force.dim(behind))
        self.curve: DrawnResult | None = None
        self.slow: tuple[Any, float] = (None, 0.0)  # experiment and solver too slow for a live curve, and when that was
        self.said, self._told = Said(), ""
        self._drawing = asyncio.Lock()
        self._works: list[Latest[Any]] = []
        self._latest = self.latest(self._safely(self._follow))
        self._beside = self.latest(self._safely(self._show_beside))
        self._beside_at = -BESIDE_EVERY
        self._made: tuple[Document, df.Case] | None = None  # the last case, and its document
        self._forcing = self.latest(self._safely(self._follow_force))
        self._advising = self.latest(self._safely(self._advise))

    @property
    def document(self) -> Document:
        """The session's document."""
        return self.session.document

    @property
    def result(self) -> xr.Dataset | None:
        """The result that the main chart is to show beside the kept results."""
        return None if self.curve is None else self.curve.result

    @property
    def status(self) -> str:
        """The sentence about the live curve; of a case that is none nothing is waited for."""
        return "" if self.said.wrong else self._told

    @property
    def waiting(self) -> Waiting:
        """The work waited for: none after a mistake, else the last message, else the run of this case."""
        job = self.session.job
        if self.said.wrong:
            return Waiting(NOTHING)
        if self.status:
            return Waiting(self.status, None if self.status in STANDING else 0.0)
        if job is not None and job.busy and job.is_of(self.document):
            return Waiting(f"Running: {job.words()}", job.share)
        return Waiting()

    def begin(self) -> None:
        """Show everything once the browser is there, also after a connection was cut."""
        if self not in self.session.views:
            self.session.views.append(self)
        if self.curve is not None or any(kept.shown for kept in self.document.results):
            self.show_anew()
        self.show(anew=False)
        self.show_job()
        self.show_unkept()

    def latest(self, work: Callable[[T], Awaitable[None]]) -> Latest[T]:
        """Return a worker for the newest request, as long as the page is there."""
        made = Latest(work)
        self._works.append(made)
        return made

    def end(self) -> None:
        """Let go of the session when the page is gone."""
        if self in self.session.views:
            self.session.views.remove(self)
        for work in self._works:
            work.end()
        self.shown.end()

    def edit(self, document: Document, name: str = "", anew: bool = False) -> None:
        """Take a new document; see :meth:`Session.edit`."""
        self.session.edit(document, name=name, anew=anew)

    def open(self, document: Document) -> None:
        """Show a document from elsewhere; where its curve takes long, it is run at once."""
        self.edit(document, anew=True)
        self._latest.ask(WantedResult(self.document, run=True))

    def show(self, anew: bool) -> None:
        """Show the session's document, and ask for its curve."""
        self.shown.look()
        for hook in self.on_show:
            hook(anew)
        if self._latest.busy:  # with long work; an error is shown at once
            with self._saying_what_is_wrong(self.document):
                self._case(self.document)
                if self.said.wrong:
                    self._say(Said(), self.document)
        self._latest.ask(WantedResult(self.document))

    def show_job(self) -> None:
        """Show how far the session's run is."""
        job = self.session.job
        if self.status == WAITING and job is not None and job.is_of(self.document):
            self._status("")
        for hook in self.on_job:
            hook()

    def show_anew(self) -> None:
        """Draw the same results in another way; nothing is computed."""
        for hook in self.on_anew:
            hook()

    def show_unkept(self) -> None:
        """Show whether the input is kept."""
        for hook in self.on_unkept:
            hook(self.session.saving.unkept)

    def show_result(self, result: xr.Dataset) -> None:
        """Show a result of the document's case in the main chart."""
        self._latest.ask(WantedResult(self.document, result))

    async def run(self) -> str:
        """Run the case; input that is not a case is not run, and the error is returned."""
        document = self.document
        if self.session.job is not None and self.session.job.busy:
            self._status(WAITING)
        try:
            await self.session.run(document)
        except (df.DForceError, TypeError) as error:
            self._say(said := Said.of_error(document, error), document)
            return said.wrong
        return ""

    def _case(self, document: Document) -> df.Case:
        """Return the case of a document: made once, for the word on a mistake and for the curve."""
        if self._made is None or self._made[0] is not document:
            self._made = document, document.case()
        return self._made[1]

    async def _follow(self, wanted: WantedResult) -> None:
        """Draw the curve of a document, and ask for the parts beside it."""
        with self._saying_what_is_wrong(wanted.document, curves=True):
            case = self.session.limits.check(self._case(wanted.document))
            if case.experiment is None:
                raise df.ParameterError("experiment is missing; choose one under Experiment")
            if self.said.wrong:
                self._say(Said(), wanted.document)
            result = wanted.result if wanted.result is not None else await self._there(wanted.document, case)
            if result is None:
                result = await self._live(case, wanted)
            if wanted.document.opened != self.document.opened:  # the result belongs under another title
                return
            if result is not None:
                if wanted.run or result is not self.result:  # opening a case hides all results kept, its own among them
                    self.session.show_kept(result)
                self._status(STOPPED if result is wanted.result and result.attrs.get("interrupted") else "")
                self.curve = DrawnResult(wanted.document, result)
                await self.draw()
            self._beside.ask(Followed(wanted.document, case, result))

    async def _there(self, document: Document, case: df.Case) -> xr.Dataset | None:
        """Return the result of a document's case that need not be computed: the one shown, of the last run, or kept."""
        job = self.session.job
        if self.curve is not None and self.curve.document.same_case(document):
            return self.curve.result
        if job is not None and job.state == "done" and job.is_of(document):
            return job.result
        await self.session.load_shown()
        return self.session.kept_of(case)

    async def _show_beside(self, followed: Followed) -> None:
        """Show the parts beside the curves, and ask for the force and the advice."""
        await self.main.drawn()
        await self._latest.rest(self._beside_at + BESIDE_EVERY - time.monotonic())
        if self._beside.overtaken or self.said.wrong:  # of a later document, which asks for nothing beside
            return
        self._beside_at = time.monotonic()
        await self.prepare()
        self.show_beside()
        if self.force.has_law(followed.case):
            self.shown.show(PagePart.FORCE, followed.document)
        self._forcing.ask(followed)
        self._advising.ask(followed)

    async def _follow_force(self, followed: Followed) -> None:
        """Show the force; over other distances alone once nothing has changed for a moment."""
        if self.force.has_law(followed.case):
            await asyncio.sleep(ADVICE_AFTER)
        if not self._forcing.overtaken:
            with self._saying_what_is_wrong(followed.document):
                if await self.force.follow(followed.case, lambda: self._forcing.overtaken):
                    self.shown.show(PagePart.FORCE, followed.document)

    async def _advise(self, followed: Followed) -> None:
        """Show the advice once nothing has changed for a moment: while something is dragged nobody reads it."""
        await asyncio.sleep(ADVICE_AFTER)
        if self._advising.overtaken or self._latest.busy or self._beside.busy or self.said.wrong:
            return
        with self._saying_what_is_wrong(followed.document):
            advice = df.advice(followed.case) if followed.result is None else advice_in(followed.result)
            self._say(Said.of_advice(followed.document, advice), followed.document)

    def show_beside(self) -> None:
        """Show the parts beside the curves."""
        for hook in self.on_beside:
            hook()
        self.shown.show(PagePart.BESIDE, self.shown.of(PagePart.CURVES))

    def _safely(self, work: Callable[[T], Awaitable[None]]) -> Callable[[T], Awaitable[None]]:
        """Return work after which the page follows the next edit, even after an error."""

        async def safe(thing: T) -> None:
            try:
                await work(thing)
            except Exception:
                log.exception("the page could not be updated")
                self._status(UNKNOWN)

        return safe

    @contextlib.contextmanager
    def _saying_what_is_wrong(self, document: Document, curves: bool = False) -> Iterator[None]:
        """Show the error of a document; its `curves` are not computed then."""
        try:
            yield
        except (df.DForceError, TypeError) as error:
            self._say(Said.of_error(document, error), document)
            if curves:
                self._status("")

    async def _live(self, case: df.Case, wanted: WantedResult) -> xr.Dataset | None:
        """Return the live curve; None, with a word on why, when it takes too long: it is run then, or tried again."""
        key = (case.experiment, case.solver)
        if self.slow[0] != key or time.monotonic() - self.slow[1] >= TRIED_AGAIN:
            late = asyncio.get_running_loop().create_task(self._say_when_late())
            try:
                say = self._status_from_thread()
                live = await in_thread(LIVE, lambda: self._recent_or_live(case, say))
            finally:
                late.cancel()
            if not live.gave_up:
                return live.result
            if self._latest.overtaken:
                return None
            if live.compiled:  # and perhaps waited for: compiled code costs no time now
                self._latest.ask(wanted)
                return None
            self.slow = (key, time.monotonic())
        if wanted.run:
            self._status("")
            background_tasks.create(self.run(), name="run the opened case")
            return None
        self._status(TOO_LONG)
        if not wanted.again:  # the machine may have been busy
            asyncio.get_running_loop().call_later(TRIED_AGAIN, self._try_again, wanted)
        return None

    def _recent_or_live(self, case: df.Case, say: Callable[[str], None]) -> Live:
        """Return the curve of a case; a curve that a page has computed recently is not computed again."""
        recent = RECENT.take(key := key_of(case))
        if recent is not None:
            return Live(recent)
        live = live_curve(case, lambda: self._latest.overtaken, say)
        if live.result is not None and not live.gave_up:
            RECENT.keep(key, live.result)
        return live

    def _try_again(self, wanted: WantedResult) -> None:
        """Ask once more for a curve that was given up, if it is still missing."""
        if self in self.session.views and self.status == TOO_LONG and wanted.document.same_case(self.document):
            self._latest.ask(dataclasses.replace(wanted, again=True))

    async def draw(self) -> None:
        """Draw the wanted result with the results kept; one drawing after the other."""
        async with self._drawing:
            await self.session.load_shown()
            await self.session.measured.load(self.document)
            curve = self.curve
            await self.main.draw(self.compose(self.result))
            self.shown.show(PagePart.CURVES, None if curve is None else curve.document)

    def _mark_curves(self, behind: bool) -> None:
        """Dim curves that are behind; remove curves of another case than the opened case."""
        self.main.dim(behind)
        if behind and self.curve is not None and self.curve.document.opened != self.document.opened:
            self.curve = None
            self.show_anew()

    async def _say_when_late(self) -> None:
        """Say that a curve takes a while when it does."""
        await asyncio.sleep(SAY_AFTER)
        if not self.status:
            self._status(COMPUTING)

    def _status_from_thread(self) -> Callable[[str], None]:
        loop = asyncio.get_running_loop()

        def say(text: str) -> None:
            loop.call_soon_threadsafe(self._status, with_models(text))

        return say

    def _status(self, text: str) -> None:
        self._told = text
        for hook in self.on_status:
            hook()

    def _say(self, said: Said, document: Document) -> None:
        """Show errors and advice on a document, unless another case has been typed meanwhile, which has its own."""
        if not document.same_case(self.document):
            return
        self.said = said
        self.shown.show(PagePart.ADVICE, document if said.advice else None)
        for hook in self.on_said:
            hook(said)
