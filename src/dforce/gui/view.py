"""One page of a session: what is typed goes to the document, the document to errors, advice, live curve and run bar."""

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
from dforce.gui import figures
from dforce.gui.chart import Chart
from dforce.gui.compute import LIVE, Job, Latest, in_thread, live_curve
from dforce.gui.document import Document, Path, path_of
from dforce.gui.session import Session

if TYPE_CHECKING:
    import xarray as xr

T = TypeVar("T")

log = logging.getLogger("dforce.gui")

TRIED_AGAIN = 20.0  # s after which a slow experiment gets another chance to be live
BESIDE_EVERY = 0.5  # s between two looks of what stands beside the curves, while something is dragged
DIM_AFTER, SAY_AFTER = 0.3, 1.0  # s after which a plot that does not follow is dimmed, and a word says why
COMPUTING = "Computing ..."
TOO_LONG = "This takes longer than a live curve may; press Run."


@dataclasses.dataclass(frozen=True)
class Said:
    """What is said about a document: what is wrong, where, and the advice on its case."""

    wrong: str = ""
    where: Path = ()
    advice: tuple[tuple[Path, str], ...] = ()


class View:
    """Ties a session to the elements of one page.

    The page sets the attributes `main` and `force` (charts) and the hooks below, then calls :meth:`begin` once the browser
    is there.

    Attributes
    ----------
    on_show
        Hooks called as ``hook(anew)`` when the document has changed: forms, sliders, title.
    on_said
        Hooks called with a :class:`Said` when errors and advice are known.
    on_status
        Hooks called with a sentence about the live curve; empty when all is well.
    on_job
        Hooks called while a run goes on and when it ends.
    on_anew
        Hooks called when results are drawn in another way: others, or other quantities of them.
    compose
        Makes the figure of the main chart from the result that it shows.
    on_beside
        Hooks called when the browser has drawn the main chart: they show what stands beside it, and while something is
        dragged they wait for a pause, so that the curves come first.
    """

    main: Chart
    force: Chart

    def __init__(self, session: Session) -> None:
        self.session = session
        self.on_show: list[Callable[[bool], None]] = []
        self.on_said: list[Callable[[Said], None]] = []
        self.on_status: list[Callable[[str], None]] = []
        self.on_job: list[Callable[[], None]] = []
        self.on_anew: list[Callable[[], None]] = []
        self.on_beside: list[Callable[[], None]] = []
        self.compose: Callable[[xr.Dataset | None], figures.Figure] = lambda result: figures.empty("")
        self.result: xr.Dataset | None = None
        self.slow: tuple[Any, float] = (None, 0.0)  # experiment and solver too slow for a live curve, and when that was
        self.said, self.status = Said(), ""
        self._opened: Document | None = None  # what was opened last, until its curve is there
        self._latest = Latest(self._safely(self._compute))
        self._beside = Latest(self._safely(self._show_beside))
        self._beside_at = -BESIDE_EVERY

    @property
    def document(self) -> Document:
        """The session's document."""
        return self.session.document

    def begin(self) -> None:
        """Show everything once the browser is there, also after a connection was cut."""
        if self not in self.session.views:
            self.session.views.append(self)
        self.show(anew=False)
        self.show_job()

    def end(self) -> None:
        """Let go of the session when the page is gone."""
        if self in self.session.views:
            self.session.views.remove(self)

    def edit(self, document: Document, name: str = "", anew: bool = False) -> None:
        """Take a new document; see :meth:`Session.edit`."""
        self.session.edit(document, name=name, anew=anew)

    def open(self, document: Document) -> None:
        """Show a document from elsewhere; where its curve takes long, it is run at once."""
        self.edit(document, anew=True)
        self._opened = self.document

    def show(self, anew: bool) -> None:
        """Show the session's document, and ask for its curve."""
        for hook in self.on_show:
            hook(anew)
        self._latest.ask(self.document)

    def show_job(self) -> None:
        """Show how far the session's run is."""
        for hook in self.on_job:
            hook()

    def show_anew(self) -> None:
        """Draw what is shown in another way; nothing is computed."""
        for hook in self.on_anew:
            hook()

    async def run(self) -> None:
        """Run the case as it stands."""
        try:
            case = self.session.limits.check(self.document.case())
        except df.DForceError as error:
            self._say(Said(str(error), path_of(self.document, str(error))))
            return
        await self.session.run(case, self._finished)

    def _finished(self, job: Job) -> None:
        """Show what a run gave in all pages of the session, a partial result too."""
        self.session._look()
        if job.result is None:
            return
        for view in self.session.views:
            if isinstance(view, View):
                view.show_result(job.result)

    def show_result(self, result: xr.Dataset) -> None:
        """Show the result of a run in the main chart."""
        self._latest.ask(Shown(result))

    async def _compute(self, wanted: Document | Shown) -> None:
        """Do what was asked for last: a curve that follows the document, or the result of a run."""
        if isinstance(wanted, Shown):
            await self._draw(wanted.result)
            self._status("Stopped: this is what was computed." if wanted.result.attrs.get("interrupted") else "")
            self.show_beside()
        else:
            await self._follow(wanted)

    async def _follow(self, document: Document) -> None:
        """Compute and draw the live curve of a document, and ask for what stands beside it."""
        with self._saying_what_is_wrong(document):
            case = self.session.limits.check(document.case())
            if case.experiment is None:
                raise df.ParameterError("experiment is missing; choose one in the tab Experiment")
            if self.said.wrong:
                self._say(Said())
            result = await self._live(case)
            if document is self._opened and not self._latest.overtaken:
                self._opened = None
                if result is None:
                    await self._run_opened()
            self._beside.ask(Followed(document, case, result))

    async def _show_beside(self, followed: Followed) -> None:
        """Show what stands beside the curves, the force, and at last the advice."""
        await self.main.drawn()
        await self._latest.rest(self._beside_at + BESIDE_EVERY - time.monotonic())
        if self._beside.overtaken or self.said.wrong:  # of a later document, which asks for nothing beside
            return
        self._beside_at = time.monotonic()
        self.show_beside()
        with self._saying_what_is_wrong(followed.document):
            await self._draw_force(followed.case)
            if self._latest.busy or self._beside.overtaken or self.said.wrong:
                return
            advice = df.advice(followed.case) if followed.result is None else df.advice_in(followed.result)
            self._say(Said(advice=_places(followed.document, advice)))

    def show_beside(self) -> None:
        """Show what stands beside the curves."""
        for hook in self.on_beside:
            hook()

    def _safely(self, work: Callable[[T], Awaitable[None]]) -> Callable[[T], Awaitable[None]]:
        """Return work after which, whatever happens, the next edit finds a page that follows it."""

        async def safe(thing: T) -> None:
            try:
                await work(thing)
            except Exception:
                log.exception("the page could not follow")
                self._status("an error inside dForce, please report it")

        return safe

    @contextlib.contextmanager
    def _saying_what_is_wrong(self, document: Document) -> Iterator[None]:
        """Show what is wrong with a document, and dim what does not follow it."""
        try:
            yield
        except (df.DForceError, TypeError) as error:
            self._say(Said(str(error), path_of(document, str(error))))
            self.main.dim()
            self.force.dim()

    async def _live(self, case: df.Case) -> xr.Dataset | None:
        """Draw the live curve and return its result; None, with a word on why, when it takes too long."""
        key = (case.experiment, case.solver)
        if self.slow[0] == key and time.monotonic() - self.slow[1] < TRIED_AGAIN:
            self._status(TOO_LONG)
            self.main.dim()
            return None
        say = self._status_from_thread()
        late = asyncio.get_running_loop().create_task(self._when_late())
        try:
            live = await in_thread(LIVE, lambda: live_curve(case, lambda: self._latest.overtaken, say))
        finally:
            late.cancel()
        if live.gave_up or live.result is None:
            if not self._latest.overtaken:
                self.slow = (key, time.monotonic())
                self._status(TOO_LONG)
            self.main.dim()
            return None
        self._status("")
        await self._draw(live.result)
        return live.result

    async def _run_opened(self) -> None:
        """Take away the curves of another case, and run what was opened."""
        await self._draw(None)
        self._status("")
        background_tasks.create(self.run(), name="run what was opened")

    async def _draw_force(self, case: df.Case) -> None:
        curve = await in_thread(LIVE, lambda: df.force_curve(case))
        await self.force.draw(figures.force_distance(curve))

    async def _draw(self, result: xr.Dataset | None) -> None:
        self.result = result
        await self.main.draw(self.compose(result))

    async def _when_late(self) -> None:
        """Dim the plot when it does not follow at once, and say why when it takes long."""
        await asyncio.sleep(DIM_AFTER)
        self.main.dim()
        await asyncio.sleep(SAY_AFTER - DIM_AFTER)
        if not self.status:
            self._status(COMPUTING)

    def _status_from_thread(self) -> Callable[[str], None]:
        loop = asyncio.get_running_loop()

        def say(text: str) -> None:
            loop.call_soon_threadsafe(self._status, text)

        return say

    def _status(self, text: str) -> None:
        self.status = text
        for hook in self.on_status:
            hook(text)

    def _say(self, said: Said) -> None:
        self.said = said
        for hook in self.on_said:
            hook(said)


@dataclasses.dataclass(frozen=True)
class Shown:
    """A result to be shown instead of a live curve."""

    result: xr.Dataset


@dataclasses.dataclass(frozen=True)
class Followed:
    """A document whose live curve was computed: its case, and its result unless that takes too long."""

    document: Document
    case: df.Case
    result: xr.Dataset | None


def _places(document: Document, advice: list[df.Advice]) -> tuple[tuple[Path, str], ...]:
    """Return each piece of advice with the path of the first field that it is about."""
    found = []
    for piece in advice:
        about = [path for path in (path_of(document, name) for name in piece.about) if path]
        found.append((about[0] if about else (), piece.text))
    return tuple(found)
