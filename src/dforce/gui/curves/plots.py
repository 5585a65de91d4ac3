"""The plots of a page: the drawn quantities and results, and the response to a click on a curve."""

from __future__ import annotations

import asyncio
import dataclasses
import logging
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import background_tasks, ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.notation import html_symbol, plain_math
from dforce.findings.answer import answer_with
from dforce.gui.case.fields import with_labels, within_sentence
from dforce.gui.curves import figures
from dforce.gui.curves.chart import Chart, ring, unit_of
from dforce.gui.curves.kept import Differences, KeptResults
from dforce.gui.curves.motion import MotionPanel
from dforce.gui.curves.numbers import FitNumbers, MaterialNumbers, Numbers
from dforce.gui.curves.panel import AdvicePanel, Pane, Scene
from dforce.gui.curves.setpoint import SetPoint
from dforce.gui.curves.states import CoexistingStates, StatesPanel, with_states
from dforce.gui.document.document import MOST_PLOTS
from dforce.gui.measured import fitting, overlay
from dforce.gui.measured.panel import MeasuredCurve
from dforce.gui.measured.reconstruction import Reconstruction
from dforce.gui.study.panel import Explorer
from dforce.gui.window.shown import DrawnResult, PagePart, Waiting
from dforce.gui.window.view import View
from dforce.results.curves import Picture, drawable, pictures_of, row_of
from dforce.results.kinds import is_kind, kind_of, loaded

if TYPE_CHECKING:
    import xarray as xr

log = logging.getLogger("dforce.gui")

SHOWN = 3  # figures: one that the browser shows, one on its way, and one that waits
FEW = 3  # frames for which the usual height is enough
UNDRAWN = "An error inside dForce: these results cannot be drawn. Please report it."


class Picker(ui.element, component="picker.js"):
    """Chooses the picture: one of the usual pictures, or any quantities against any other."""


class Answer(ui.element, component="answer.js"):
    """The result in words."""

    def show(self, text: str) -> None:
        """Show a text; nothing is sent where it is the same."""
        if text != self.props.get("text", ""):
            with self.props.suspend_updates():
                self.props["text"] = text
            self.run_method("take", text)


class WaitingWords:
    """A sign of the work that is waited for, in the middle of the container that is open when it is made."""

    def __init__(self) -> None:
        with ui.element("div").classes("df-waiting") as self.frame:
            self.bar = ui.element("progress").props('max=1 aria-label="progress"')
            self.text = ui.label().props('role="status"')
        self.shown: Waiting | None = None

    def show(self, waiting: Waiting) -> None:
        """Show the sentence, with a bar during a computation."""
        if waiting == self.shown:
            return
        self.shown = waiting
        self.frame.set_visibility(bool(waiting.text))
        self.text.set_text(waiting.text)
        self.bar.set_visibility(waiting.share is not None)
        if waiting.share:
            self.bar.props(f"value={waiting.share:.3f}")
        else:
            self.bar.props(remove="value")


@dataclasses.dataclass(frozen=True)
class Composed:
    """A figure with its sources: the results, the curve that follows the fields, and the states behind the curve."""

    drawn: figures.Drawn
    layers: Sequence[figures.Layer]
    behind: Sequence[figures.Layer]
    curve: DrawnResult | None


class Plots:
    """The plots of one page, in the container that is open when it is made."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.drawn = figures.Drawn({})
        self.shown: Picture | None = None  # None: a map, or nothing
        self.usual: list[Picture] = []
        self.names: tuple[str, ...] = ()  # of the quantities that the picker offers
        self.result: xr.Dataset | None = None
        self.layers: list[figures.Layer] = []
        self.composed: list[Composed] = []  # the last figures: the browser shows one of them
        self.answer = Answer()
        self.line = ui.label().classes("df-status").props('role="status"')
        with ui.element("div").classes("df-plotbar"):
            self.picker = Picker()
            self.picker.on("picture", self._picture)
            self.picker.on("own", self._own)
            self.kept = KeptResults(view)
        self.set_point, self.fit_numbers, self.motion = SetPoint(view), FitNumbers(view), MotionPanel(view)
        self.material = MaterialNumbers(view)
        self.measured, self.explorer, self.numbers = MeasuredCurve(view), Explorer(view), Numbers(view)
        self.reconstruction, self.differences = Reconstruction(view), Differences(view)
        with ui.element("div").classes("df-stage") as self.stage:
            with ui.element("div").classes("df-main"):
                view.main = Chart("result", on_point=self._clicked, holds=True)
                self.waiting = WaitingWords()
            self.explorer.stage()
        self.explorer.on_stage = self._set_stage
        self.states = CoexistingStates(view)
        self.all_states = StatesPanel(
            view,
            self._all_states,
            lambda: self.states.is_looking(view.curve),
            lambda layer, places: self._open_motion(layer, places, view.curve),
        )
        panels = (
            self.set_point,
            self.fit_numbers,
            self.material,
            self.measured,
            self.reconstruction,
            self.explorer,
            self.motion,
            self.all_states,
            self.numbers,
            self.differences,
            AdvicePanel(view),
        )
        self.pane = Pane(view, panels)
        view.compose, view.prepare = self.compose, self.prepare
        view.picture = lambda: self.shown
        for element in (
            self.answer,
            self.set_point.element,
            self.fit_numbers.sheet,
            self.material.sheet,
            self.numbers.sheet,
            self.differences.element,
            self.all_states.element,
        ):
            view.shown.mark(PagePart.BESIDE, partial(dim, element))
        view.on_beside.append(self.beside)
        view.on_anew.append(self.redraw)
        view.on_status.append(self.wait)
        view.on_job.append(self.wait)
        view.on_said.append(lambda said: self.wait())
        self.wait()

    async def prepare(self) -> None:
        """Solve, in a thread, the states at the set point, which are remembered until table and words are made.

        Where another figure is composed meanwhile, its states are solved, too.
        """
        layers: Sequence[figures.Layer] = ()
        while (shown := self.shown) is not None and layers is not self.layers:
            layers, curve, share = self.layers, self.view.curve, self.view.document.set_point
            await asyncio.to_thread(self._solve, layers, shown, curve, share)

    def _solve(self, layers: Sequence[figures.Layer], shown: Picture, curve: DrawnResult | None, share: float) -> None:
        """Solve the states of layers and of a curve at a set point. Blocking."""
        self.set_point.marked(layers, shown)
        self.states.met(curve, share)

    def compose(self, result: xr.Dataset | None) -> figures.Figure:
        """Return the figure of a result with the kept results drawn beside it."""
        self.result, self.shown = result, None
        self.layers = self.kept.layers(result)
        first = self.layers[-1].result if self.layers else None
        if first is None:
            self.drawn = figures.Drawn(figures.empty(""))
        elif (kind := kind_of(first)) is not None and kind.figure:
            self.drawn = loaded(kind.figure)(first)
        elif not (usual := pictures_of(first)):  # stopped
            self.drawn = figures.Drawn(figures.empty("The run was stopped before its first result."))
        else:
            self.usual, self.shown = usual, self.wanted(first, usual)
            self.layers = self.set_point.ringed(self.layers, self.shown)
            self.drawn = figures.picture(self.layers, self.shown)
            points = [self.motion.place_in(layer.result) for layer in (*self.layers, *self._behind())]
            self.drawn = clicked(self.drawn, self.shown, points)
            if (beside := self.measured.beside()) is not None:
                self.drawn = overlay.with_measured(self.drawn, self.shown, beside, first)
            for layer in self._behind():
                self.drawn = with_states(self.drawn, self.shown, layer.result)
        self.wait()
        others = [one for one in self.composed if one.drawn.figure != self.drawn.figure]
        self.composed = [*others, Composed(self.drawn, self.layers, self._behind(), self.view.curve)][-SHOWN:]
        return self.drawn.figure

    def beside(self) -> None:
        """Show the elements beside the figure composed last."""
        self.kept.show(self.result)
        self._set_stage()
        if self.shown is not None:
            self.layers = self.set_point.marked(self.layers, self.shown)
            self._offer(self.layers[-1].result, self.shown)
        self.picker.set_visibility(self.shown is not None)
        self.answer.show(self._answer())
        self.motion.follow(self.view.curve, (*self.layers, *self._behind()))
        self.pane.show(Scene(self.layers, self.shown, self.drawn))

    def _all_states(self) -> xr.Dataset | None:
        """Return all states of the top result: a result of branches has them, a curve has its states behind it."""
        if self.layers and "branch" in self.layers[-1].result:
            return self.layers[-1].result
        return self.states.of(self.view.curve)

    def _behind(self) -> list[figures.Layer]:
        """Return the states behind the curve, once they are known."""
        states = self.states.of(self.view.curve)
        return [] if states is None else [figures.Layer(states)]

    def _answer(self) -> str:
        """Return words for the top result, after the results of a fit of this case."""
        if not self.layers:
            return ""
        document, fit = self.view.document, self.view.session.measured.fit
        top = self.layers[-1]
        try:
            others = self.states.met(self.view.curve, document.set_point) if top.result is self.result else []
            text = with_labels(document, answer_with(top.result, document.set_point, top.states, others))
            if document.measured is not None and fit is not None and fitting.is_of(fit, document):
                if fitting.taken_over(document, fit).same_case(document):
                    return f"{df.answer(fit)} {text}"
                return f"{df.answer(fit)} With the values of the form: {within_sentence(text)}"
            return text
        except df.DForceError:  # a run that was stopped before its first result
            return ""

    def _set_stage(self) -> None:
        """Let a map take the stage, where the curves step down to a strip; or give many frames more height."""
        over = self.explorer.takes_the_stage
        tall = not over and self.shown is not None and not self.shown.together and len(self.shown.y) > FEW
        looks = {"df-over": over, "df-tall": tall}
        self.stage.classes(replace=" ".join(["df-stage", *(name for name, there in looks.items() if there)]))

    def show_measured(self) -> None:
        """Show a measured curve that has just come: its panel, and amplitude and phase against the distance."""
        self.measured.open()
        if self.result is not None and self.shown is not None and not overlay.shows(self.shown):
            usual = next((one for one in pictures_of(self.result) if overlay.shows(one)), None)
            if usual is not None:
                self._choose(usual)

    def wait(self) -> None:
        """Show the reason for waiting: above the curves, or in the middle of an empty plot."""
        empty = not self.layers
        self.line.set_text("" if empty else self.view.status)
        self.line.set_visibility(bool(self.line.text))
        self.waiting.show(self.view.waiting if empty else Waiting())

    def wanted(self, result: xr.Dataset, usual: Sequence[Picture]) -> Picture:
        """Return the picture that was last chosen for such a result, else the most useful picture."""
        plots = self.view.document.plots
        known = set(drawable(result)) if plots else set()
        return next((picture for picture in reversed(plots) if {picture.x, *picture.y} <= known), usual[0])

    def redraw(self) -> None:
        """Draw the same results in another way."""
        background_tasks.create(self._redraw(), name="redraw")

    async def _redraw(self) -> None:
        try:
            await self.view.draw()
            await self.prepare()
            self.view.show_beside()
        except Exception:  # an unchanged plot would show another choice
            log.exception("the results could not be drawn")
            await self.view.main.draw(figures.empty(UNDRAWN))

    def _offer(self, result: xr.Dataset, wanted: Picture) -> None:
        """Show in the picker the possible pictures, and the drawn one."""
        names = tuple(drawable(result))
        if names != self.names:
            self.names = names
            self.picker.props["all"] = [_words(result, name) for name in names]
        changed = {
            "titles": [picture.title for picture in self.usual],
            "x": wanted.x,
            "y": list(wanted.y),
            "chosen": self.usual.index(wanted) if wanted in self.usual else -1,
            "together": wanted.together,
            "logarithmic": wanted.logarithmic,
        }
        if any(self.picker.props.get(key) != value for key, value in changed.items()):
            self.picker.props.update(changed)
            self.picker.update()

    def _picture(self, event: GenericEventArguments) -> None:
        number = int(event.args)
        if 0 <= number < len(self.usual):
            self._choose(self.usual[number])

    def _own(self, event: GenericEventArguments) -> None:
        """Take a choice; a quantity that fits a new axis replaces others that do not."""
        given: dict[str, Any] = event.args
        result, x = self._first(), str(given["x"])
        if result is None or x not in self.names:
            return
        able = [name for name in drawable(result, x) if name != x]
        y = tuple(name for name in map(str, given["y"]) if name in able) or self._beside(x) or tuple(able[:1])
        if y:
            y = tuple(sorted(y, key=self.names.index))
            self._choose(Picture(x, y, bool(given["together"]), bool(given["logarithmic"])))

    def _beside(self, x: str) -> tuple[str, ...]:
        """Return the quantities that are usually drawn against a quantity."""
        return next((picture.y for picture in self.usual if picture.x == x), ())

    def _choose(self, picture: Picture) -> None:
        document = self.view.document
        others = [other for other in document.plots if other.x != picture.x][-MOST_PLOTS + 1 :]
        self.view.session.look(dataclasses.replace(document, plots=(*others, picture)))

    def _first(self) -> xr.Dataset | None:
        layers = self.kept.layers(self.view.result)
        return layers[-1].result if layers else None

    def _clicked(self, event: dict[str, Any], figure: figures.Figure) -> None:
        """Show the motion at the point of a curve that was clicked, also where another figure has been made since."""
        there = next((one for one in self.composed if one.drawn.figure == figure), None)
        if there is None:
            return
        if isinstance(event["index"], list):
            self._start_clicked(there, *map(int, event["index"]))
            return
        curve, place, drawn = int(event["curve"]), int(event["index"]), there.drawn
        trace = drawn.traces[curve] if curve < len(drawn.traces) else None
        if curve in drawn.behind and there.behind:
            trace = there.behind[0], drawn.behind[curve]
        if trace is None or not 0 <= place < len(trace[1].places):
            return
        layer, line = trace
        if line.places[place] >= 0:
            self._open_motion(layer, {line.row: int(line.places[place]), **line.chosen}, there.curve)

    def _start_clicked(self, there: Composed, row: int, column: int) -> None:
        """Show the motion of the state that is reached from a start on the map of basins."""
        layers = there.layers
        if not layers or not is_kind(layers[-1].result, "basins"):
            return
        reached = layers[-1].result["reached"].values
        if 0 <= row < reached.shape[0] and 0 <= column < reached.shape[1] and reached[row, column] > 0:
            self._open_motion(layers[-1], {"state": int(reached[row, column]) - 1}, there.curve)

    def _open_motion(self, layer: figures.Layer, places: dict[str, int], curve: DrawnResult | None) -> None:
        """Show the motion at a point of a result, and of the curve that follows the fields where that is the result."""
        self.motion.take(layer, places, curve.document if curve is not None and curve.result is layer.result else None)
        self.redraw()  # with a ring around the point


def clicked(drawn: figures.Drawn, wanted: Picture, points: Sequence[xr.Dataset | None]) -> figures.Drawn:
    """Return a figure with a ring around the points that were clicked."""
    shapes = list(drawn.figure["layout"].get("shapes", []))
    for point in points:
        for name, (x_axis, y_axis, scale, _) in drawn.places.items() if point is not None else ():
            if point is not None and {name, wanted.x} <= {*point.variables}:
                x, y = (float(np.ravel(point[one].values)[0]) for one in (wanted.x, name))
                at = ring(x / drawn.x_scale, y / scale, 2 * figures.RING)
                shapes.append({"xref": x_axis, "yref": y_axis, "name": "clicked", **at})
    layout = {**drawn.figure["layout"], "shapes": shapes}
    return dataclasses.replace(drawn, figure={**drawn.figure, "layout": layout})


def dim(element: ui.element, behind: bool) -> None:
    """Dim an element that is behind."""
    element.classes(add="df-behind" if behind else "", remove="" if behind else "df-behind")


def _words(result: xr.Dataset, name: str) -> dict[str, str]:
    """Return the picker's words for a quantity."""
    variable = result[name]
    label, symbol = str(variable.attrs.get("long_name", name)), str(variable.attrs.get("symbol", ""))
    unit = unit_of(variable)[1]
    return {
        "name": name,
        "label": label,
        "symbol": html_symbol(symbol),
        "unit": "" if unit == "1" else unit,
        "row": row_of(result, name),
        "text": f"{label} {plain_math(symbol)}".strip(),
        "help": str(variable.attrs.get("description", "")),
    }
