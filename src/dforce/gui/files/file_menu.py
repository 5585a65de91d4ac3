"""The menu File: open and save cases, projects, results, figures and the script; and files dropped onto the window."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import re
import tempfile
import threading
import tomllib
import unicodedata
import weakref
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import events, ui

import dforce as df
from dforce.core.errors import shorten
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.plots import Plots
from dforce.gui.document.document import Document
from dforce.gui.files import project, uploads
from dforce.gui.measured import fitting, reading
from dforce.gui.measured.overlay import shows
from dforce.gui.measured.reading import ask_table
from dforce.gui.study.explore import is_explorable
from dforce.gui.study.parameter_study import Over, with_approach
from dforce.gui.window.dialogs import as_sentence, ask, choice, menu, say, telling, text
from dforce.gui.window.view import View
from dforce.inverse.readers import endings
from dforce.library import measured_data
from dforce.results.curves import Picture
from dforce.results.kinds import is_kind

if TYPE_CHECKING:
    import xarray as xr

ENDING = ".dforce"  # of a project
ACCEPTED = ",".join((".toml", ".nc", ENDING, *endings()))
DEVICES = re.compile(r"con|prn|aux|nul|(com|lpt)\d")  # names that Windows keeps for itself
DPI = 300.0
WIDTH = "85 mm"  # of a figure: one column of a journal
RESULTS = {".nc": "netCDF, complete, to open again", ".csv": "CSV, a table for a spreadsheet"}
TOO_LARGE = (
    "The result over parameters is too large for the project file and is not saved there. Its own file is unchanged."
)
NOTHING = "No result yet; press Run."
MOMENT = 0.8  # s without a word on a file that is read
UNSAVED, UNOPENED = "the file could not be made", "the file could not be opened"
REFUSED = (
    f"Only a case (.toml), a result (.nc), a measured curve ({', '.join(endings())}) or a project ({ENDING}) of at most "
    f"{uploads.MOST_BYTES // 1_000_000} MB can be opened."
)
DRAWING = threading.Lock()  # matplotlib's settings belong to the whole process
SCRIPT = Path(__file__).with_name("drop.js")


class FileMenu:
    """Opens and saves files for one page; the menu's button is made in the container that is open.

    Attributes
    ----------
    plots
        The plots of the page; set once the page has them.
    """

    plots: Plots

    def __init__(self, view: View, new: Callable[[], None]) -> None:
        self.view = view
        self.last = uploads.LastFiles(view.session.results.folder / uploads.LAST)
        self._turn = asyncio.Lock()  # the file that comes last stays open, even if another takes longer
        with ui.button("File", icon="expand_more", color=None).props("flat dense no-caps").classes("df-menu-button"):
            made = menu(
                (
                    ("New", "begin with a question, a lever and a sample", new),
                    ("Open ...", "a case, a result, a measured curve, a project; or drop it here", lambda: None),
                    ("Save project", "the case, all kept results, the measured curve", self.save_project),
                    ("Save case", "for this window, the command line and Python", self.save_case),
                    ("Save result ...", "the numbers, as netCDF or CSV", self.result_dialog),
                    ("Save figure ...", "the picture, as PNG, SVG or PDF at the width of a page", self.figure_dialog),
                    ("Save Python script", "the same computation in Python", self.save_script),
                )
            )
        _, first, *_ = (item for item in made.descendants() if isinstance(item, ui.menu_item))
        # a browser opens its dialog only where a person pressed, so the press must not go to the server and back
        first.on("click", js_handler="() => window.dforceFiles.pick()")
        # the web framework keeps the element's route, and its contents, after the page has gone
        uploaded = weakref.WeakMethod(self._uploaded)

        async def take(event: events.UploadEventArguments) -> None:
            if (there := uploaded()) is not None:
                await there(event)

        self.upload = ui.upload(auto_upload=True, on_upload=take, max_file_size=uploads.MOST_BYTES)
        self.upload.props(f'accept="{ACCEPTED}"').classes("df-upload")
        self.upload.on_rejected(lambda: say(REFUSED))
        self.upload.on("failed", js_handler="() => window.dforceFiles.failed()")
        ui.add_body_html(f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>")

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        if event.file.size() > uploads.MOST_BYTES:
            with self.upload:
                say(REFUSED)
            return
        await self._open_and_keep(event.file.read(), event.file.name)

    async def _open_and_keep(self, read: Awaitable[bytes], name: str) -> None:
        async with self._turn, self._noticing(name):  # from the reading on, which may also end in another order
            data = await read
            await self.open(data, name)
            await asyncio.to_thread(self.last.keep, data, name)

    async def open_last(self, name: str) -> None:
        """Open one of the last files again, or say that it is gone."""
        await self._open_and_keep(asyncio.to_thread(self.last.take, name), name)

    async def open_shipped(self, name: str) -> None:
        """Open an example, or a measured file that is shipped, with the case that fits it."""
        with self._telling(UNOPENED):
            if name in df.examples():
                self.view.open(Document.of(df.example(name)))
                await self.view.session.drop_measured()
                self.view.session.hide_kept()  # they were of another case, and are a press away
                return
            shipped = measured_data()
            text = shipped.get(f"{Path(name).stem}.toml")
            if text is None:
                await self.open(shipped[name], name)
                return
            table = tomllib.loads(text.decode())
            settings = {key: value for key, value in table.pop("data").items() if key in reading.SETTINGS}
            self.view.open(Document.of(with_approach(df.Case(**table))))
            await self.open_measured(shipped[name], name, settings)

    async def open(self, data: bytes, name: str = "") -> None:
        """Open a file by its content.

        Raises
        ------
        DForceError
            With one sentence, and nothing has changed.
        """
        session = self.view.session
        kind = uploads.kind_of(data, name)
        if kind == "measured":
            settings = self.view.document.value(("data",)) or {}
            await self.open_measured(data, name, {key: settings[key] for key in reading.SETTINGS if key in settings})
        elif kind == "case":
            self.view.open(await asyncio.to_thread(uploads.document_from, data))
        elif kind == "result":
            await self._open_result(
                await asyncio.to_thread(uploads.opened_from, data, session.results.folder), data, name
            )
        else:
            opened = await asyncio.to_thread(project.unpacked, data, session.results.folder)
            await session.take_project(opened.document, opened.results)
            if opened.over is not None:
                session.study.open(opened.over)
                self.plots.explorer.open()

    async def _open_result(self, result: xr.Dataset, data: bytes, name: str) -> None:
        """Open a result of any kind that the window shows."""
        session = self.view.session
        if is_kind(result, "measured"):
            await self.open_measured(data, name, {})
            return
        stored = str(result.attrs["start_case" if is_kind(result, "fit") else "case"])
        case = session.limits.check(uploads.case_of(stored))
        if is_kind(result, "fit"):
            self.view.open(Document.of(with_approach(case.replace(data=None))))
            await session.take_fit(result)
            self.plots.show_measured()
        elif is_explorable(result):
            self.view.open(Document.of(with_approach(case)))
            session.study.open(Over(result))
            self.plots.explorer.open()
        else:
            if is_kind(result, "reconstruction"):  # of a measured curve, whose case needs no experiment
                case = with_approach(case.replace(data=None))
            await session.take_result(Document.of(case), result)
            self.view.show_result(result)

    async def open_measured(self, data: bytes, name: str, settings: Mapping[str, object]) -> None:
        """Show a measured curve under the model's curve; ask for information that its file lacks.

        Raises
        ------
        DForceError
            With one sentence, when it holds no curve; nothing has changed then.
        """
        view = self.view
        case: df.Case | None = None
        with contextlib.suppress(df.DForceError, TypeError):  # a case that is being typed
            case = view.document.case()
        try:
            raw = await asyncio.to_thread(reading.curve_from, data, name, settings, case, view.session.results.folder)
        except reading.SpectrumFound:
            await self._open_spectrum(data, name, {})
            return
        except reading.MissingAnswer as question:
            self._ask(question, str(question), data, name, settings)
            return
        if view.session.fresh:  # the first case of a window becomes the curve's, and is no longer the example
            titled = view.document.put(("about",), None).put(("title",), Path(name).stem)
            view.open(dataclasses.replace(titled, opened=titled.table))
        await view.session.take_measured(raw, name, settings)
        self.plots.show_measured()

    def _ask(
        self, question: reading.MissingAnswer, sentence: str, data: bytes, name: str, settings: Mapping[str, object]
    ) -> None:
        """Ask for information that a file lacks, and again, with the error, after an insufficient answer."""

        async def answered(told: dict[str, object]) -> None:
            async with self._noticing(name):
                try:
                    await self.open_measured(data, name, told)
                except df.DForceError as error:
                    self._ask(question, str(error), data, name, told)

        ask_table(f"Read {shorten(name, 60)}", as_sentence(sentence), question.head, settings, question.asked, answered)

    async def _open_spectrum(self, data: bytes, name: str, answers: dict[str, str]) -> None:
        """Show f0, k and Q of a thermal spectrum, and take them for the lever when a person says so."""
        folder = self.view.session.results.folder
        try:
            found = await asyncio.to_thread(reading.tune_from, data, name, answers, folder)
        except df.ParameterError as error:
            fields, why = reading.tune_questions(str(error), answers), as_sentence(str(error))
            if not fields:
                raise
        else:
            fields, why = reading.tune_questions("", answers), fitting.tune_in_words(found)
        shown = dict(fields)

        async def answered(*given: str) -> None:
            told = answers | {key: text for key, text in zip(shown, given, strict=True) if text.strip()}
            with self._telling("the spectrum could not be used"):
                found = await asyncio.to_thread(reading.tune_from, data, name, told, folder)
                self.view.edit(fitting.with_tune(self.view.document, found), anew=True)
                ui.notify(f"The lever now has {fitting.tune_in_words(found)}", type="positive")

        ask(f"Thermal tune {shorten(name, 60)}", list(shown.values()), answered, why=why, button="Take for the lever")

    async def save_project(self) -> None:
        """Save the document with all its results."""
        session, over = self.view.session, self.view.session.study.over
        with self._telling(UNSAVED):
            data = await asyncio.to_thread(
                project.packed, self.view.document, session.results, session.measured.results, over
            )
            if over is not None and not project.has_room(over):
                say(TOO_LARGE)
            ui.download.content(data, self._name(ENDING), "application/zip")

    async def save_case(self) -> None:
        """Save the case as a TOML file."""
        with self._telling(UNSAVED):
            ui.download.content(self.view.document.case().to_toml(), self._name(".toml"), "application/toml")

    async def save_script(self) -> None:
        """Save the script that does the same."""
        with self._telling(UNSAVED):
            ui.download.content(script_of(self.view.document), self._name(".py"), "text/x-python")

    def result_dialog(self) -> None:
        """Ask which result to save, and how."""
        names = self.plots.kept.names(self.view.result)
        if names:
            ask("Save a result", [choice("Result", names), choice("Format", RESULTS)], self.save_result)
        else:
            say(NOTHING)

    async def save_result(self, identifier: str, ending: str) -> None:
        """Save a result of the list, or the result that follows the fields."""
        with self._telling(UNSAVED):
            result = await self.plots.kept.take(identifier)
            data = await asyncio.to_thread(written, lambda path: df.write(result, path), ending)
            ui.download.content(data, f"{stem(str(result.attrs.get('title', '')))}{ending}")

    def figure_dialog(self) -> None:
        """Ask for the format and the width of the figure."""
        formats = {ending: ending[1:].upper() for ending in df.plot.FORMATS}
        if self.plots.kept.layers(self.view.result):
            ask("Save the figure", [choice("Format", formats), text("Width", WIDTH)], self.save_figure)
        else:
            say(NOTHING)

    async def save_figure(self, ending: str, width: str) -> None:
        """Save the picture, as the command line draws it."""
        layers, wanted = self.plots.kept.layers(self.view.result), self.plots.shown
        beside = self.plots.measured.beside()
        points = None if beside is None or wanted is None or not shows(wanted) else beside.moved()
        with self._telling(UNSAVED):
            data = await asyncio.to_thread(figure_file, layers, wanted, ending, width, points)
            ui.download.content(data, self._name(ending))

    @contextlib.asynccontextmanager
    async def _noticing(self, name: str) -> AsyncIterator[None]:
        """Show that a file is read once that takes longer than a moment, and a sentence where it cannot be opened."""
        shown: list[ui.notification] = []

        def show() -> None:
            if not self.upload.is_deleted:
                with self.upload:
                    shown.append(ui.notification(f"Reading {shorten(name, 60)} ...", spinner=True, timeout=None))

        soon = asyncio.get_running_loop().call_later(MOMENT, show)
        try:
            with self._telling(UNOPENED):
                yield
        finally:
            soon.cancel()
            for one in shown:
                one.dismiss()

    @contextlib.contextmanager
    def _telling(self, failure: str) -> Iterator[None]:
        """Show a sentence on why the work inside failed."""
        with self.upload, telling(failure):  # a dialog that asked for it is gone by now
            yield

    def _name(self, ending: str) -> str:
        return f"{stem(self.view.document.title)}{ending}"


def script_of(document: Document) -> str:
    """Return the script that computes a document, and draws its measured curve under an approach.

    Raises
    ------
    ParameterError
        When the input is not a case.
    """
    case, name = document.case(), stem(document.title)
    text = case.to_python(name)
    if document.measured is not None and case.sweep is None and getattr(case.experiment, "kind", "") == "approach":
        fits = f"{name}-fit.png" if document.measured.fit and case.fit is not None and case.fit.free else ""
        text += reading.script_of(document.measured, f"{name}-measured.png", fits)
    return text


def figure_file(
    layers: list[Layer], wanted: Picture | None, ending: str, width: str, points: xr.Dataset | None = None
) -> bytes:
    """Return the file of a figure, with the `points` of a measured curve. Blocking.

    Raises
    ------
    DForceError
        When it cannot be drawn, or the width is invalid.
    """
    results = {layer.name: layer.result for layer in layers}
    with DRAWING:
        try:
            drawn = layers[0].result if len(layers) == 1 else results
            axes = df.plot.draw(drawn, wanted, df.plot.Sheet(), points)
            return written(lambda path: df.plot.save(axes, path, DPI, width), ending)
        except (ValueError, KeyError) as error:
            if isinstance(error, df.DForceError):
                raise
            raise df.ResultError("a figure of this result cannot be drawn") from error


def written(write: Callable[[Path], object], ending: str) -> bytes:
    """Return the bytes that `write` puts in a file with an ending. Blocking."""
    with tempfile.TemporaryDirectory(prefix="dforce-") as place:
        path = Path(place) / f"file{ending}"
        write(path)
        return path.read_bytes()


def stem(title: str) -> str:
    """Return a file's name, without its ending, that every system takes."""
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()  # a letter without its accents
    name = re.sub(r"[^A-Za-z0-9]+", "-", plain)[:60].strip("-").lower() or "dforce"
    return f"dforce-{name}" if DEVICES.fullmatch(name) else name
