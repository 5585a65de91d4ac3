"""The first page: a question, a lever, a medium and a sample make the case; or a file is dropped anywhere."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from nicegui import ui

import dforce as df
from dforce.experiments import EXPERIMENTS
from dforce.gui.document.document import FIRST, Document
from dforce.gui.window.dialogs import as_sentence, say
from dforce.gui.window.view import View


@dataclass(frozen=True)
class Question:
    """A question, the example that answers it, and the tab that comes first; its picture has the same key."""

    key: str
    title: str
    sentence: str
    example: str
    tab: str = ""


QUESTIONS = (
    Question("curve", "Explain my curve", "Modulus and adhesion from a measured curve", "hysteresis", "Fit"),
    Question("safe", "Safe settings", "The amplitude that my sample tolerates", "figure-4-soft", "Against"),
    Question("states", "Two states and jumps", "Jumps of the motion, and their reason", "hysteresis"),
    Question("bimodal", "Bimodal contrast", "Phase of the second mode", "figure-6"),
    Question("thermal", "Thermal tune of a lever", "f0, k and Q from thermal motion", "figure-3-air"),
    Question("class", "Teach a class", "One window for all students", "hysteresis"),
)
ONE_MODE = "Bimodal needs a lever with two modes. Leave the lever empty, then type the modes of yours"


def lever_labels() -> dict[str, str]:
    """Return the levers of the library by name, as a list shows them."""
    return {
        name: f"{name}: {df.show(probe.f0, 'Hz', 3)}, {df.show(probe.k, 'N/m', 3)}"
        for name, probe in df.cantilevers().items()
    }


def sample_labels() -> dict[str, str]:
    """Return the samples of the library by name, as a list shows them."""
    return {
        name: f"{name.replace('_', ' ')}: {df.show(material.youngs_modulus, 'Pa', 3)}"
        for name, material in df.materials().items()
    }


def asks_for_q(lever: str, medium: str) -> bool:
    """Return whether nothing gives the quality factor of a lever in a medium."""
    probe = df.cantilevers().get(lever)
    return probe is not None and probe.Q is None and (probe.width is None or medium not in ("air", "water"))


def case_for(question: Question, lever: str = "", Q: str = "", medium: str = "", sample: str = "") -> df.Case:
    """Return the case of a question; what is empty stays as in its example.

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
    if lever:
        probe = df.cantilevers()[lever]
        if len(table["cantilever"].get("modes", ())) > 1:
            raise df.ParameterError(ONE_MODE)
        table["cantilever"] = {"name": lever, **({"Q": Q} if Q else {})}
        table["drive"] = {"A0": table["drive"]["A0"]}
        if probe.tip_radius is not None:
            table["tip"] = {**table.get("tip", {}), "radius": df.show(probe.tip_radius, "m")}
    if medium:
        table["medium"] = {"name": medium}
    if sample:
        material = df.materials()[sample]
        table["sample"] = {"youngs_modulus": df.show(material.youngs_modulus, "Pa")}
        if material.poisson_ratio is not None:
            table["sample"]["poisson_ratio"] = material.poisson_ratio
    kind = table.pop("experiment")["kind"]
    table["experiment"] = {"kind": kind, **EXPERIMENTS[kind].suggested(df.Case(**table).problem)}
    return df.Case(**table)


MEDIA = {"": "as in the example", "air": "air", "water": "water", "vacuum": "vacuum"}
DROP = "Drop a file anywhere: a measured curve, a thermal spectrum, a case or a project."
KEPT = "Forces and free amplitude are the values of the example."
SHARED = "Start the window with dforce gui --host 0.0.0.0: it prints the address for your students."


class StartPage:
    """The page, in the container that is open when it is made.

    Parameters
    ----------
    view
        Where a case is opened.
    open_tab
        Opens a tab of the pane by its title.
    turn
        Called with True when the page comes, and with False when it goes.
    """

    def __init__(self, view: View, open_tab: Callable[[str], None], turn: Callable[[bool], None]) -> None:
        self.view, self.open_tab, self.turn = view, open_tab, turn
        self.chosen = QUESTIONS[0]
        self.buttons: dict[str, ui.element] = {}
        with ui.element("main").classes("df-start").props('aria-label="start"') as self.element:
            ui.label("Choose your question").classes("df-start-title").props('role="heading" aria-level="2"')
            with ui.element("div").classes("df-questions").props('role="group" aria-label="questions"'):
                for question in QUESTIONS:
                    self._picture(question)
            with ui.element("div").classes("df-choices"):
                self.lever = ui.select(lever_labels(), label="Lever", with_input=True, clearable=True)
                self.medium = ui.select(MEDIA, value="", label="Medium")
                self.sample = ui.select(sample_labels(), label="Sample", with_input=True, clearable=True)
                self.q = ui.input(label="Quality factor Q")
                for one in (self.lever, self.medium, self.sample, self.q):
                    one.props("outlined dense options-dense")
                    one.on_value_change(self._follow)
                ui.button("Start", icon="arrow_forward", on_click=self._start).props("unelevated no-caps color=primary")
            self.note = ui.label().classes("df-text")
            with ui.element("div").classes("df-start-drop"):
                ui.label(DROP)
                with ui.element("button").classes("df-plain").props('type="button"') as button:
                    ui.label("Open a file")
                button.on("click", js_handler="() => window.dforceFiles.pick()")
                with ui.element("button").classes("df-plain").props('type="button"') as self.last:
                    self.words = ui.label()
                self.last.on("click", self.hide)
        self._choose(self.chosen)
        view.on_show.append(lambda anew: self.hide() if anew else None)
        view.on_anew.append(self.hide)  # a measured curve was opened

    def show(self) -> None:
        """Show the page in place of the case."""
        self.words.set_text(f"Back to: {self.view.document.title or 'the case'}")
        self.last.set_visibility(not self.view.session.fresh)
        self.element.set_visibility(True)
        self.turn(True)

    def hide(self) -> None:
        """Show the case."""
        if self.element.visible:
            self.element.set_visibility(False)
            self.turn(False)

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
        self._follow()

    def _follow(self) -> None:
        """Ask for Q where nothing gives it, and say where the values of the sample are from."""
        if self.lever.value and not self.medium.value:  # a lever has its Q from the medium
            self.medium.value = "air"
        self.q.set_visibility(asks_for_q(self.lever.value or "", self.medium.value or ""))
        material = df.materials().get(self.sample.value or "")
        notes = [KEPT] if self.lever.value or material is not None else []
        notes += [f"Nominal values of the sample: {material.source}."] if material is not None else []
        self.note.set_text(" ".join([SHARED] * (self.chosen.key == "class") + notes))

    def _start(self) -> None:
        """Open the case of the question."""
        asks = self.q.visible
        try:
            case = case_for(
                self.chosen,
                self.lever.value or "",
                str(self.q.value or "") if asks else "",
                self.medium.value or "",
                self.sample.value or "",
            )
        except df.DForceError as error:
            say(as_sentence(str(error)))
            return
        self.view.open(Document.first() if case == df.example(FIRST) else Document.of(case))
        self.hide()
        if self.chosen.tab:
            self.open_tab(self.chosen.tab)
