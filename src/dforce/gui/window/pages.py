"""The page: header with menus and run bar, sliders and form at the left, the answer, the chart and its pane at the right."""

from __future__ import annotations

import asyncio
import copy
import gc
import itertools
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import app, ui
from nicegui.elements.mixins.text_element import TextElement
from starlette.requests import Request

import dforce as df
from dforce.gui.case.entry import LONGEST
from dforce.gui.case.forms import Forms
from dforce.gui.case.sliders import Sliders
from dforce.gui.curves.chart import LIBRARY, library_file
from dforce.gui.curves.other_figures import ForceChart
from dforce.gui.curves.plots import Plots, dim
from dforce.gui.document.compute import LIVE, Job
from dforce.gui.document.document import FIRST, Document
from dforce.gui.document.session import Session
from dforce.gui.document.store import Store
from dforce.gui.files.file_menu import FileMenu
from dforce.gui.files.uploads import list_opened
from dforce.gui.measured.panel import FitAtFields
from dforce.gui.study.parameter_study import Over
from dforce.gui.window.address import Address
from dforce.gui.window.classroom import PAGE as CLASS_PAGE
from dforce.gui.window.classroom import Classroom
from dforce.gui.window.dialogs import as_sentence, menu, say
from dforce.gui.window.security import ALONE, GUEST, Limits
from dforce.gui.window.shown import PagePart, Said
from dforce.gui.window.start import StartPage
from dforce.gui.window.view import View
from dforce.library import FOLDERS

if TYPE_CHECKING:
    import xarray as xr

FORGOTTEN = 3600.0  # s after which a session that no page shows is only kept in the storage
CLOSED = 8  # pages, after which their garbage is collected: 4 MB each, which Python alone keeps of some 40 pages
GONE = 1.0  # s after which a closed page is out of use
ANSWERED_WITHIN = 60.0  # s that a browser of a busy computer has to answer
HERE = Path(__file__).parent
SKIPS = {
    "Skip to the sliders": ".df-slider input[type=range]",
    "Skip to the chart": ".df-main .df-chart",
    "Skip to the tabs": ".df-pane [role=tab][aria-selected=true]",
}
SKIP = "(event) => { event.preventDefault(); document.querySelector(PLACE)?.focus(); }"
HELP = "Point at a field to read its meaning."
TO_TOP = f"""document.querySelector(".df-panels").scrollTop = 0; window.scrollTo(0, 0);
    document.getElementById("df-help").replaceChildren("{HELP}")"""
SHEETS = (HERE / "style.css", HERE.parent / "curves" / "plots.css")


def register(
    folder: Path,
    document: Document | None = None,
    limits: Limits = ALONE,
    over: xr.Dataset | None = None,
    classroom: Classroom | None = None,
    file: Path | None = None,
) -> None:
    """Make the page known to the server.

    Parameters
    ----------
    folder
        Folder in which each session has a file for its input and a folder for its results.
    document
        The document on the first page of each session; None: the document of its last visit.
    limits
        Limits of each session.
    over
        A result over parameters that each session looks at first.
    classroom
        The class at the server; None where it is for one person.
    file
        The file of the document, which is listed among the last files of each session.
    """
    sessions: dict[str, Session] = {}
    app.add_static_files(local_directory=HERE / "pictures", url_path="/assets/pictures", max_cache_age=3600)
    app.add_static_file(local_file=library_file(), url_path=LIBRARY, max_cache_age=86400)
    for sheet in SHEETS:
        app.add_static_file(local_file=sheet, url_path=f"/assets/{sheet.name}", max_cache_age=0)

    def session_of_browser(ending: str = "") -> Session:
        name = f"{app.storage.browser['id']}{ending}"
        if name not in sessions:
            for old in [key for key, session in sessions.items() if session.idle(FORGOTTEN)]:
                del sessions[old]  # its document is kept in the storage
            store = Store(folder / "sessions" / f"document-{name}.json")
            sessions[name] = Session(store, folder / "results" / name, limits)
            if document is not None:
                sessions[name].document, sessions[name].fresh = document, False
            if over is not None:
                sessions[name].study.take(Over(over))
            if file is not None:
                list_opened(sessions[name].results.folder, file)
        return sessions[name]

    @app.on_startup
    def warm() -> None:  # the first page must not wait for modules that are loaded only once
        LIVE.submit(lambda: df.run(df.example(FIRST)))

    closed = itertools.count(1)

    @app.on_delete
    def collect() -> None:
        if next(closed) % CLOSED == 0:
            asyncio.get_running_loop().call_later(GONE, gc.collect)

    @ui.page("/", title="dForce")
    def page(request: Request) -> None:
        session = session_of_browser()
        if classroom is not None and request.scope.get(GUEST, True):
            classroom.welcome(session)
        guest = session.person is not None  # a guest who comes to see the class's case
        Page(session, session.fresh and over is None and not guest, None if guest else classroom)

    if classroom is not None:
        # in another session: the teacher's own case stays
        classroom.register(sessions, dress, lambda guest: Page(session_of_browser(f"-{guest}"), classroom=classroom))

    @app.on_shutdown
    def end() -> None:
        for session in sessions.values():
            session.close()


def dress() -> ui.dark_mode:
    """Give a page the looks of the window, and return its choice of light or dark."""
    for sheet in SHEETS:
        ui.add_head_html(f'<link rel="stylesheet" href="/assets/{sheet.name}">')
    ui.colors(primary="#0b5c8f", dark="#1a2127", dark_page="#12171b")
    ui.query(".nicegui-content").classes("df-content")
    return ui.dark_mode(app.storage.user.get("dark"))


class Page:
    """One page of a session: makes the elements and ties them to a view; `start` shows the first page before the case.

    The teacher's pages have a `classroom`.
    """

    files: FileMenu

    def __init__(self, session: Session, start: bool = False, classroom: Classroom | None = None) -> None:
        self.view = View(session)
        self.dark = dress()
        ui.add_body_html(f"<script>{(HERE / 'page.js').read_text(encoding='utf-8')}</script>")
        for words, place in SKIPS.items():
            link = TextElement(tag="a", text=words).classes("df-skip").props('href="#"')
            link.on("click", js_handler=SKIP.replace("PLACE", json.dumps(place)))
        with ui.element("header").classes("df-header"):
            self._header()
            if classroom is not None:
                ui.link("Class", CLASS_PAGE, new_tab=True).classes("df-class-link")
        self.start = StartPage(self.view, self.files, self._open_tab, self._turn_to_start, classroom)
        with ui.element("div").classes("df-body") as self.body:
            with ui.element("aside").classes("df-left").props('aria-label="parameters"') as self.left:
                self._left()
            self.view.shown.mark(PagePart.ADVICE, partial(dim, self.left))
            with ui.element("section").classes("df-right").props('aria-label="result"'):
                self._right()
        self.address = Address(self.view)
        (self.start.show if start else self.start.hide)()
        client = ui.context.client
        client.on_connect(self.view.begin)
        client.on_connect(self._take_unsent)
        client.on_connect(self.address.begin)
        client.on_delete(self.view.end)
        client.on_delete(self.address.end)
        ui.on("left", _leave)

    async def _take_unsent(self) -> None:
        """Take the input that a page before this one could not send."""
        try:
            left = await ui.run_javascript("return dforceUnsent.left()", timeout=ANSWERED_WITHIN)
        except TimeoutError:  # the connection was cut: the next one asks again, and the browser still has it
            return
        for name, text, unit, number in left or ():
            self.forms.typed_elsewhere(str(name), str(text)[:LONGEST], str(unit)[:40])
            ui.run_javascript(f"dforceUnsent.arrived({json.dumps(str(name))}, {int(number)})")

    def _header(self) -> None:
        view = self.view
        with ui.element("h1").classes("df-wordmark"), ui.element("button").props('type="button"') as mark:
            ui.label("dForce")
        mark.props["title"] = "Start page"
        mark.on("click", lambda: self.start.show())
        with (
            ui.button("Examples", icon="expand_more", color=None).props("flat dense no-caps").classes("df-menu-button")
        ):
            examples = df.examples().values()
            folders = [
                [(one.title, one.shows, partial(self._open, one.name)) for one in examples if one.folder == folder]
                for folder in FOLDERS
            ]
            menu(*folders, titles=tuple(FOLDERS.values()))
        self.files = FileMenu(view, lambda: self.start.show())
        undo, redo = _icon("undo", "Undo", view.session.undo), _icon("redo", "Redo", view.session.redo)
        title = ui.input(placeholder="Untitled").props('dense borderless aria-label="title of the case" maxlength=300')
        title.classes("df-title")
        title.on_value_change(
            lambda event: (
                view.edit(view.document.put(("title",), event.value or None), name="title")
                if (event.value or "") != view.document.title
                else None
            )
        )

        def show(anew: bool) -> None:
            undo.set_enabled(bool(view.session.steps))
            redo.set_enabled(bool(view.session.undone))
            title.set_value(view.document.title)

        for step in (undo, redo):
            step.classes("df-step")
        view.on_show.append(show)
        self.run_bar = RunBar(view)
        self.mode = _icon("dark_mode", "Light or dark", self._turn)

    def _turn(self) -> None:
        self.dark.value = not self.dark.value
        app.storage.user["dark"] = self.dark.value

    def _turn_to_start(self, there: bool) -> None:
        """Show the first page in place of the case, or the case again."""
        self.body.set_visibility(not there)
        self.run_bar.frame.set_visibility(not there)

    def _open_tab(self, title: str) -> None:
        next(panel for panel in self.plots.pane.panels if panel.title == title).open()

    async def _open(self, name: str) -> None:
        await self.files.open_shipped(name)

    def _left(self) -> None:
        banner = ui.label().classes("df-banner wrong").props('role="alert"')
        with ui.element("div").classes("df-panels"):
            forms = self.forms = Forms(self.view, (Sliders(self.view), FitAtFields(self.view)))
        with ui.element("div").classes("df-foot"):
            with ui.element("div").classes("df-force"):
                self.view.force = ForceChart()
            ui.label(HELP).classes("df-help").props('id="df-help" aria-hidden="true"')

        def said(said: Said) -> None:
            nowhere = said.wrong if said.wrong and not forms.has(said.where) else ""
            banner.set_text(nowhere)
            banner.set_visibility(bool(nowhere))

        banner.set_visibility(False)
        self.view.on_said.append(said)
        opened = self.view.document.opened

        def show_top(anew: bool) -> None:
            """Show the first parameters of another case."""
            nonlocal opened
            if self.view.document.opened is not opened:
                opened = self.view.document.opened
                self.left.client.run_javascript(TO_TOP)

        self.view.on_show.append(show_top)

    def _right(self) -> None:
        unkept = ui.label().classes("df-banner wrong").props('role="alert"')

        def show_unkept(text: str) -> None:
            unkept.set_text(text)
            unkept.set_visibility(bool(text))

        show_unkept("")
        self.view.on_unkept.append(show_unkept)
        _about(self.view)
        self.plots = self.files.plots = Plots(self.view)
        if self.view.session.study.result is not None:
            self.plots.explorer.open()


def _about(view: View) -> None:
    """Show the sentence on the message of the case, where it has one; an edited case may have another message."""
    line = ui.label().classes("df-about")

    def show(anew: bool) -> None:
        text = "" if view.document.edited else str(view.document.value(("about", "shows")) or "")
        if line.text != text:
            line.set_text(text)
            line.props["title"] = text
        line.set_visibility(bool(text))

    view.on_show.append(show)
    show(True)


def _leave() -> None:
    """Let go of this page as soon as its connection ends: it was left, and will not ask for another."""
    client = ui.context.client
    client.page = copy.copy(client.page)
    client.page.reconnect_timeout = 0.0


class RunBar:
    """Run, Stop, and how far a run is."""

    def __init__(self, view: View) -> None:
        self.view = view
        with ui.element("div").classes("df-run") as self.frame:
            self.progress = ui.element("progress").props('max=1 aria-label="progress of the run"')
            self.text = ui.label().classes("df-run-text").props('role="status"')
            self.stop = ui.button("Stop", icon="stop", on_click=view.session.stop).props(
                "unelevated dense no-caps color=primary"
            )
            self.run = ui.button("Run", icon="play_arrow", on_click=self._run).props(
                "unelevated dense no-caps color=primary"
            )
        view.on_job.append(self.show)
        view.on_show.append(self._forget)
        self.show()

    async def _run(self) -> None:
        """Run, or say why nothing is run."""
        wrong = await self.view.run()
        if wrong:
            say(f"Nothing was run. {as_sentence(wrong)}")

    def _forget(self, anew: bool) -> None:
        """Remove the message on a finished run after an edit."""
        if self.view.session.job is None or not self.view.session.job.busy:
            self.text.set_text("")
        else:
            self.show()

    def show(self) -> None:
        """Show the state of the session's run."""
        job = self.view.session.job
        busy = job is not None and job.busy
        self.progress.set_visibility(busy)
        self.stop.set_visibility(busy)
        self.run.set_visibility(not busy)
        if job is None:
            self.text.set_text("")
            return
        if job.total:
            self.progress.props(f"value={job.share:.3f}")
        else:
            self.progress.props(remove="value")
        self.text.set_text(_words(job, job.is_of(self.view.document)))


def _words(job: Job, here: bool) -> str:
    """Return in words how far a run is; of a case that is no longer here, that it is of another."""
    if here:
        return job.words()
    return (
        "the run of an earlier case has ended; see the list"
        if job.state == "done"
        else f"an earlier case: {job.words()}"
    )


def _icon(icon: str, label: str, press: Callable[[], None]) -> ui.button:
    made = (
        ui.button(icon=icon, on_click=press, color=None)
        .props(f'flat dense round aria-label="{label}"')
        .classes("df-icon")
    )
    made.tooltip(label)
    return made
