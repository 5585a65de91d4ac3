"""The first page: a question, a lever, a medium and a sample make the case; or a file is dropped anywhere."""

from __future__ import annotations

import datetime
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

import dforce as df
from dforce.experiments import EXPERIMENTS
from dforce.gui.case.fields import in_words
from dforce.gui.document.document import FIRST, Document
from dforce.gui.files.file_menu import FileMenu
from dforce.gui.window.classroom import PAGE as CLASS_PAGE
from dforce.gui.window.classroom import Classroom, limits_in_words
from dforce.gui.window.dialogs import as_sentence, dialog, say
from dforce.gui.window.name_field import NameField
from dforce.gui.window.security import SHARED
from dforce.gui.window.view import View
from dforce.library import FOLDERS, measured_data


@dataclass(frozen=True)
class Question:
    """A question, the example that answers it, and the tab that comes first; its picture has the same key.

    The examples of the folder of its key, and `also` other examples and measured files, are offered beside it.
    """

    key: str
    title: str
    sentence: str
    example: str
    tab: str = "Set point"
    also: tuple[str, ...] = ()

    def offers(self) -> dict[str, str]:
        """Return the titles of its examples by name."""
        known, measured = df.examples(), measured_data()
        names = [*(one.name for one in known.values() if one.folder == self.key), *self.also]
        texts = {name: measured.get(f"{name.partition('.')[0]}.toml") for name in names if name in measured}
        titles = {name: tomllib.loads(text.decode())["title"] for name, text in texts.items() if text is not None}
        return {name: known[name].title if name in known else titles.get(name, f"Measured: {name}") for name in names}


QUESTIONS = (
    Question(
        "curve",
        "Explain my curve",
        "Modulus and adhesion from a measured curve",
        "hysteresis",
        "Fit",
        ("stiff.csv", "liquid.csv", "air.csv"),
    ),
    Question(
        "safe",
        FOLDERS["safe"],
        "The amplitude that my sample tolerates",
        "figure-4-soft",
        "Against",
        ("figure-4-soft", "figure-4-hard"),
    ),
    Question(
        "states",
        FOLDERS["states"],
        "Jumps of the motion, and their reason",
        "hysteresis",
        also=("figure-3-branches", "figure-3-basins"),
    ),
    Question(
        "bimodal",
        "Bimodal contrast",
        "Phase or frequency of the second mode",
        "figure-6",
        also=("figure-6", "figure-7-low", "figure-7-high", "am-fm", "fm-afm"),
    ),
    Question(
        "thermal",
        "Thermal tune of a lever",
        "f0, k and Q from thermal motion",
        "figure-3-air",
        tab="Thermal tune",
        also=("thermal.csv",),
    ),
    Question(
        "class", "Teach a class", "One window for all students", "hysteresis", also=("figure-3-air", "figure-3-water")
    ),
)
TIP = "borosilicate_glass"  # for the native oxide of a silicon tip
SHORT = ("hopg", "ldpe", "pdms", "pmma")  # names of samples that are abbreviations
NO_LEVER = "Choose a lever, too: Q depends on the medium, and the example has no Q for this medium"


def lever_labels(bimodal: bool = False) -> dict[str, str]:
    """Return the levers of the library by name, as a list shows them; `bimodal`: levers with two known modes."""
    return {
        name: f"{name}: {df.show(probe.f0, 'Hz', 3)}, {df.show(probe.k, 'N/m', 3)}"
        for name, probe in df.cantilevers().items()
        if not bimodal or probe.width is not None
    }


def sample_labels() -> dict[str, str]:
    """Return the samples of the library by name, as a list shows them."""
    return {
        name: f"{name.upper() if name in SHORT else name.replace('_', ' ')}: {df.show(material.youngs_modulus, 'Pa', 3)}"
        for name, material in df.materials().items()
    }


def asks_for_q(lever: str, medium: str) -> bool:
    """Return whether nothing gives the quality factor of a lever in a medium."""
    probe = df.cantilevers().get(lever)
    return probe is not None and probe.Q is None and (probe.width is None or medium not in ("air", "water"))


def case_for(question: Question, lever: str = "", Q: str = "", medium: str = "", sample: str = "") -> df.Case:
    """Return the case of a question; empty answers keep the values of its example.

    Raises
    ------
    ParameterError
        When lever, medium and sample make no case.
    """
    table: dict[str, Any] = tomllib.loads(df.example(question.example).to_toml())
    if question.key == "thermal":
        table["experiment"] = {"kind": "thermal_spectrum"}
    elif not (lever or medium or sample):
        return df.example(question.example)
    table.pop("about", None)
    table["title"] = question.title
    if medium and not lever and medium != table.get("medium"):
        raise df.ParameterError(NO_LEVER)
    if lever:
        probe = df.cantilevers()[lever]
        tones = table["drive"].get("tones", ())
        table["cantilever"] = {"name": lever, **({"Q": Q} if Q else {})}
        if tones:
            table["cantilever"]["higher_modes"] = len(tones) - 1
        table["drive"] = {"tones": tones} if tones else {"A0": table["drive"]["A0"]}
        if probe.tip_radius is not None:
            table["tip"] = {**table.get("tip", {}), "radius": df.show(probe.tip_radius, "m")}
    if medium:
        table["medium"] = {"name": medium}
    if sample:
        material = df.materials()[sample]
        table["sample"] = {"youngs_modulus": df.show(material.youngs_modulus, "Pa")}
        if material.poisson_ratio is not None:
            table["sample"]["poisson_ratio"] = material.poisson_ratio
        given = table.get("medium") or {}
        hamaker = material.hamaker_with(
            df.materials()[TIP], given if isinstance(given, str) else given.get("name", "air")
        )
        for force in table["forces"]:
            if "hamaker" in force and hamaker is not None:
                force["hamaker"] = df.show(hamaker, "J", 3)
    kind = table.pop("experiment")["kind"]
    table["experiment"] = {"kind": kind, **EXPERIMENTS[kind].suggested(df.Case(**table).problem)}
    return df.Case(**table)


MEDIA = {"": "as in the example", "air": "air", "water": "water", "vacuum": "vacuum"}
DROP = "Drop a file anywhere: a measured curve, a thermal spectrum, a case or a project."
KEPT = "Forces and free amplitude are the values of the example."
ATTRACTED = "The Hamaker constant is the geometric mean of sample and glass, as for a silicon tip with its oxide."
TWO_MODES = "The second mode belongs to an ideal beam in air: f2 = 6.27 f1, k2 = 39.3 k1."
# the keyboard focus moves to the chart, because its element is gone
TO_CHART = 'dforceFocus.before?.closest(".df-start") && dforceFocus.go(".df-main .df-chart", true)'
NO_Q = "The library has no quality factor of this lever. Type your value at “Quality factor Q”."
COMMAND = "dforce gui --host 0.0.0.0"
HOW_TO_TEACH = (
    "This window is for you alone. For a class, type this command in a terminal. It opens a window for everyone in your "
    "network, with a short address and a QR code for your students, and a page that shows who is there."
)
HOW_TO_JOIN = (
    "Students in this network scan the code or type the address. The address of your page is a link to your case for all who "
    "have joined. The link Class opens the page that shows who is there."
)


class StartPage:
    """The page, in the container that is open when it is made.

    Parameters
    ----------
    view
        Where a case is opened.
    files
        Opens examples, and the last files again.
    open_tab
        Opens a tab of the pane by its title.
    turn
        Called with True when the page comes, and with False when it goes.
    classroom
        The class that this person teaches; None where the window is for one person, or this is a guest.
    """

    def __init__(
        self,
        view: View,
        files: FileMenu,
        open_tab: Callable[[str], None],
        turn: Callable[[bool], None],
        classroom: Classroom | None = None,
    ) -> None:
        self.view, self.files, self.open_tab, self.turn, self.classroom = view, files, open_tab, turn, classroom
        self.chosen = QUESTIONS[0]
        self.offered: Question | None = None
        self.buttons: dict[str, ui.element] = {}
        with ui.element("section").classes("df-start").props('aria-label="start"') as self.element:
            ui.label("Choose your question").classes("df-start-title").props('role="heading" aria-level="2"')
            with ui.element("div").classes("df-questions").props('role="group" aria-label="questions"'):
                for question in QUESTIONS:
                    if question.key != "class" or view.session.person is None:  # a guest teaches nobody
                        self._picture(question)
            with ui.element("div").classes("df-choices"):
                self.lever = NameField(lever_labels(), "lever")
                self.medium = ui.select(MEDIA, value="", label="Medium")
                self.sample = NameField(sample_labels(), "sample")
                self.q = ui.input(label="Quality factor Q")
                for one in (self.lever, self.medium, self.sample, self.q):
                    one.props("outlined dense options-dense")
                    one.on_value_change(self._follow)
                ui.button("Start", icon="arrow_forward", on_click=self._start).props("unelevated no-caps color=primary")
            self.note = ui.label().classes("df-text")
            self.offers = ui.element("div").classes("df-offers").props('role="group" aria-label="examples"')
            with ui.element("div").classes("df-start-drop"):
                ui.label(DROP)
                quiet("Open a file").on("click", js_handler="() => window.dforceFiles.pick()")
                self.back = quiet("").on("click", self.hide)
                self.last = ui.element("div").classes("df-offers").props('role="group" aria-label="last files"')
        self._choose(self.chosen)
        view.on_show.append(lambda anew: self.hide() if anew else None)
        view.on_anew.append(self._leave_for_curve)
        self._measured = view.document.measured

    def show(self) -> None:
        """Show the page in place of the case."""
        self.back.set_text(f"Back to: {self.view.document.title or 'the case'}")
        self.back.set_visibility(not self.view.session.fresh)
        self._list_last()
        self.element.set_visibility(True)
        self.turn(True)

    def _leave_for_curve(self) -> None:
        """Show the case where a measured curve was opened; results that are drawn anew behind this page change nothing."""
        before, self._measured = self._measured, self.view.document.measured
        if self._measured is not None and (before is None or before.id != self._measured.id):
            self.hide()

    def hide(self) -> None:
        """Show the case."""
        if self.element.visible:
            self.element.set_visibility(False)
            self.turn(False)
            self.element.client.run_javascript(TO_CHART)

    def _picture(self, question: Question) -> None:
        with ui.element("button").classes("df-question").props('type="button"') as button:
            ui.element("img").props["src"] = f"/assets/pictures/{question.key}.svg"
            ui.label(question.title).classes("df-question-title")
            ui.label(question.sentence).classes("df-question-text")
        next(iter(button.default_slot.children)).props["alt"] = ""
        button.on("click", lambda: self._choose(question))
        self.buttons[question.key] = button

    def _choose(self, question: Question) -> None:
        self.chosen = question
        for key, button in self.buttons.items():
            button.props["aria-pressed"] = "true" if key == question.key else "false"
        levers = lever_labels(question.key == "bimodal")
        self.lever.set_options(levers, value=self.lever.value if self.lever.value in levers else None)
        if self.offered is not question:  # a button that is made anew loses a press
            self._offer(question)
        self._follow()

    def _offer(self, question: Question) -> None:
        """Offer the examples of a question."""
        self.offered = question
        self.offers.clear()
        with self.offers:
            ui.label("Or open an example:")
            for name, title in question.offers().items():
                quiet(title).on("click", partial(self.files.open_shipped, name))

    def _list_last(self) -> None:
        """Show the last files."""
        files, now = self.files.last.listed(), datetime.datetime.now()
        self.last.clear()
        self.last.set_visibility(bool(files))
        with self.last:
            ui.label("Last files:")
            for one in files:
                quiet(one.words(now)).on("click", partial(self._open_last, one.name))
            quiet("Forget them").on("click", self._forget)

    async def _open_last(self, name: str) -> None:
        await self.files.open_last(name)
        self._list_last()

    def _forget(self) -> None:
        self.files.last.forget()
        self._list_last()

    def _follow(self) -> None:
        """Ask for Q where it is unknown, and show the source of the sample's values."""
        if self.lever.value and not self.medium.value:  # a lever has its Q from the medium
            self.medium.value = "air"
        self.q.set_visibility(asks := asks_for_q(self.lever.value or "", self.medium.value or ""))
        material = df.materials().get(self.sample.value or "")
        notes = [NO_Q] if asks and not self.q.value else []
        notes += [TWO_MODES] if self.chosen.key == "bimodal" and self.lever.value else []
        notes += [KEPT] if self.lever.value or material is not None else []
        if material is not None:
            medium = self.medium.value or "air"
            notes += [ATTRACTED] if material.hamaker_with(df.materials()[TIP], medium) is not None else []
            notes.append(f"Nominal values of the sample: {material.source}.")
        self.note.set_text(" ".join(notes))

    async def _start(self) -> None:
        """Open the case of the question without the results and the curve of another; a curve to explain stays."""
        for field in (self.lever, self.sample):
            if field.error:
                field.run_method("focus")
                return
        asks = self.q.visible
        if asks and not self.q.value:
            say(NO_Q)
            return
        try:
            case = case_for(
                self.chosen,
                self.lever.value or "",
                str(self.q.value or "") if asks else "",
                self.medium.value or "",
                self.sample.value or "",
            )
        except df.DForceError as error:
            say(as_sentence(in_words(self.view.document, str(error))))
            return
        session = self.view.session
        self.view.open(Document.first() if case == df.example(FIRST) else Document.of(case))
        session.hide_kept()
        if self.chosen.tab != "Fit":
            await session.drop_measured()
        self.hide()
        self.open_tab(self.chosen.tab)
        if self.chosen.key == "class":
            self._teach()

    def _teach(self) -> None:
        """Show the address of the class; where the window is for one person, the command that starts one for a class."""
        with dialog("teach a class") as made:
            with ui.element("div").classes("df-save wide"):
                TextElement(tag="h2", text="Teach a class")
                if self.classroom is not None:
                    self.classroom.invitation()
                    ui.label(HOW_TO_JOIN).classes("df-text")
                    name = "See who is there"
                    press: Callable[[], None] = partial(ui.navigate.to, CLASS_PAGE, new_tab=True)
                else:
                    ui.label(HOW_TO_TEACH).classes("df-text")
                    TextElement(tag="code", text=COMMAND).classes("df-command")
                    name, press = "Copy the command", self._copy
                ui.label(f"Your students read: “{limits_in_words(SHARED)}”").classes("df-text")
                with ui.element("div").classes("df-save-buttons"):
                    quiet("Close").on("click", made.close)
                    quiet(name).classes("df-main-button").on("click", press)

    def _copy(self) -> None:
        ui.clipboard.write(COMMAND)
        ui.notify("The command is copied.")


def quiet(text: str) -> TextElement:
    """Show a button without color."""
    return TextElement(tag="button", text=text).classes("df-plain").props('type="button"')
