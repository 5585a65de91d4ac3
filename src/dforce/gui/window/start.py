"""The first page: a question, a lever, a medium and a sample; or a file that is dropped anywhere."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

import dforce as df
from dforce.gui.document.document import FIRST, Document
from dforce.gui.window.error_messages import as_sentence, say
from dforce.gui.window.questions import QUESTIONS, Question, asks_for_q, case_for, lever_labels, sample_labels
from dforce.gui.window.view import View

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
