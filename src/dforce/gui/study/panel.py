"""Results over parameters in one page: a plan, a sweep, or states at the set point against any number of the case."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nicegui import background_tasks, ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.quantities import OBSERVABLES
from dforce.core.units import show
from dforce.findings.set_point import states_meant
from dforce.gui.case.entry import QuietElement
from dforce.gui.case.fields import in_words, with_labels, within_sentence
from dforce.gui.case.values import ParameterRow, composed, in_unit, taken_apart
from dforce.gui.curves.chart import Chart
from dforce.gui.curves.figures import Figure
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.document.compute import LIVE, in_thread
from dforce.gui.document.document import HIGHEST_SET_POINT, LOWEST_SET_POINT, path_of
from dforce.gui.document.session import LOOKED_EVERY
from dforce.gui.study import explore, pictures
from dforce.gui.study.parameter_study import (
    FIRST_AMPLITUDE,
    MOST_VALUES,
    SET_POINT,
    PlanJob,
    SweepJob,
    Varied,
    choices,
    plan_job,
    share,
    sweep_job,
)
from dforce.gui.window.dialogs import as_sentence, say
from dforce.gui.window.view import View
from dforce.inverse.wishes import limited

if TYPE_CHECKING:
    import xarray as xr

DIGITS = 6
MEANT = "The picture shows {}. “All states” adds states that no approach meets."
NO_RANGE = {"path": "", "low": "", "high": ""}
ENDS = {"low": "50 %", "high": "95 %"}  # of the set point, as suggested


class ExplorePanel(QuietElement, component="explore.js"):
    """The content of the panel, around its chart."""


class Explorer(Panel):
    """The panel of one page; its chart takes the stage, where :meth:`stage` makes it."""

    title = "Against"

    def __init__(self, view: View) -> None:
        super().__init__(view)
        self.study = view.session.study
        self.choice = explore.Choice()
        self.limit: explore.DrawnLimit | None = None
        self.picked: explore.Choice | None = None
        self.suggested: dict[str, Any] = {}
        self._opened: object = None  # the case for which ranges were suggested
        self.second = dict(NO_RANGE)
        self.seen = 0
        self._looked_at: xr.Dataset | None = None
        self._figure: Figure = {}  # drawn last
        self.on_stage: Callable[[], None] = lambda: None  # called when its chart may take the stage, or leave it
        self._latest = view.latest(self._draw)

    def stage(self) -> None:
        """Make the chart, in the container that is open."""
        with ui.element("div").classes("df-explore-chart") as self.place:
            self.chart = Chart("quantity over parameters", on_point=self._clicked_on, on_limit=self._dragged)

    @property
    def takes_the_stage(self) -> bool:
        """Whether its chart takes the place of the curves."""
        return self.in_sight and self.study.result is not None and bool(self.choice.quantity)

    def make(self) -> None:
        """Make the panel, in the container that is open."""
        element = self.element = ExplorePanel()
        element.on("suggest", lambda event: self._suggest(str(event.args)))
        element.on("second", lambda event: self._suggest(str(event.args), second=True))
        element.on("compute", self._compute)
        element.on("stop", self.study.stop)
        element.on("choose", self._choose)
        element.on("limit", self._limit)
        element.on("take", self._take)
        self.view.on_job.append(self.show)
        self.view.on_show.append(lambda anew: self.show())
        self.view.on_anew.append(self.show)

    def show(self, scene: Scene | None = None) -> None:
        """Show the choices, and the progress of a computation."""
        if not self.in_sight:
            return
        if self._opened is not self.view.document.opened:
            self._opened = self.view.document.opened
            self.second = dict(NO_RANGE)
            names = [row.name for row in self._rows()]
            self._suggest(next((name for name in FIRST_AMPLITUDE if name in names), names[0]))
        if self.seen != self.study.number:
            self._take_in()
        job, document = self.study.job, self.view.document
        rows = [{"name": row.name, "label": row.label, "unit": _unit_of(row)} for row in self._rows()]
        shown = dict[str, Any](rows=rows, most=MOST_VALUES)
        shown |= {"suggested": self.suggested, "second": self.second, "limitable": _limitable()}
        shown |= {"busy": self.study.busy, "share": job.share if job is not None else 0.0}
        shown |= {"words": job.words() if job is not None and job.state != "failed" else ""}
        failed = job is not None and job.state == "failed" and job.is_of(document)
        shown["failed"] = as_sentence(in_words(document, job.error)) if job is not None and failed else ""
        self.element.show(**shown, **self._of_result())
        behind = self.study.result is not None and bool(self.study.why_behind(self.view.document))
        self.place.classes(add="df-behind" if behind else "", remove="" if behind else "df-behind")
        self.on_stage()

    def close(self) -> None:
        """Leave the stage to the curves."""
        self.on_stage()

    def _rows(self) -> list[ParameterRow]:
        return choices(self.view.document)

    def _take_in(self) -> None:
        """Look at another result."""
        self.seen = self.study.number
        result = self.study.result
        if result is not None and result is self._looked_at:  # the boundaries of its regimes have come
            self.draw()
            return
        self._looked_at, self.limit, self.picked = result, None, None
        if result is not None:
            wanted = dataclasses.replace(self.choice, x="", y="", places={})
            self.choice = explore.fitting(result, wanted if self._computed() else explore.Choice())
            self._take_limit(result)
            self.draw()

    def _take_limit(self, result: xr.Dataset) -> None:
        """Draw the limit that a plan along one parameter keeps."""
        job = self.study.job
        limits = job.limits if isinstance(job, PlanJob) and job.result is result else {}
        name = next((name for name in limits if name in explore.quantities(result)), "")
        if name and not self.choice.y:
            self.choice = explore.fitting(result, dataclasses.replace(self.choice, quantity=name))
            side, text = limits[name].split(maxsplit=1)
            self.limit = explore.read_limit(result, self.choice, text, side == ">")

    def _computed(self) -> bool:
        """Return whether the result was computed here."""
        return self.study.over is not None and self.study.over.row is not None

    def _title(self) -> str:
        """Return the parameters of the result, or its title where it was opened."""
        over = self.study.over
        if over is None:
            return ""
        if over.row is None or over.document is None:
            return str(over.result.attrs.get("title", "")) or "Over parameters"
        labels = [row.label for row in (over.row, over.second) if row is not None]
        at = (
            ""
            if "set_point" in explore.paths_of(over.result)
            else f", at the set point {share(over.document.set_point)}"
        )
        at = "" if SET_POINT in (over.row.name, over.second.name if over.second else "") else at
        return f"Against {' and '.join(map(within_sentence, labels))}{at}"

    def _of_result(self) -> dict[str, Any]:
        result, choice = self.study.result, self.choice
        if result is None or not choice.quantity:
            return {"quantities": [], "title": "", "note": "", "picked": "", "allowed": "", "found": []}
        axes, behind = explore.axes_of(result, choice.quantity), self.study.why_behind(self.view.document)

        def words(names: list[str]) -> list[dict[str, str]]:
            return [{"name": name, "label": explore.label_of(result, name)} for name in names]

        slices = [
            one | {"at": choice.places[one["name"]], "places": explore.places_of(result, one["name"])}
            for one in words(list(choice.places))
        ]
        shown: dict[str, Any] = {"title": self._title(), "here": self._computed(), "axes": words(axes)}
        shown |= {"quantities": words(explore.quantities(result)), "few": len(explore.FIRST)}
        found = str(result.attrs.get("findings", "")).splitlines()
        if self._computed() and "plan_over" not in result.attrs:  # a plan has this attribute
            found.append(MEANT.format(states_meant(result)))
        shown |= {"found": [as_sentence(with_labels(self.view.document, line)) for line in found]}
        shown |= {"quantity": choice.quantity, "x": choice.x, "y": choice.y, "slices": slices}
        shown |= {
            "lines": choice.quantity not in explore.WORDS,
            "behind": bool(behind),
            "note": f"{behind} {explore.gaps_of(result, choice.quantity)}".strip(),
        }
        shown |= {"limited": self.limit is not None, "limit": "", "allowed": ""}
        if self.limit is not None and not choice.y:
            shown |= {"above": self.limit.above, "allowed": explore.allowed(result, choice, self.limit)}
            shown |= {"limit": explore.shown_limit(result, choice, self.limit)}
        labels = {row.name: row.label for row in self._rows()} | {"set_point": "set point"}
        settings = {} if self.picked is None else explore.settings_at(result, self.picked)
        return shown | {"picked": explore.words_of(settings, labels)}

    def draw(self) -> None:
        """Draw the choice."""
        if self.study.result is not None and self.in_sight:
            self._latest.ask(self.choice)

    async def _draw(self, choice: explore.Choice) -> None:
        over, limit, picked = self.study.over, self.limit, self.picked
        if over is None or not choice.quantity:
            return
        try:
            figure = await in_thread(LIVE, lambda: pictures.figure(over.result, choice, limit, over.regimes, picked))
        except (df.DForceError, OSError) as error:
            say(as_sentence(f"this result cannot be read: {error}"))
            return
        self._figure = figure
        await self.chart.draw(figure)

    def _changed(self) -> None:
        self.show()
        self.draw()

    def _suggest(self, name: str, second: bool = False) -> None:
        """Suggest a range around the value of a parameter."""
        row = next((row for row in self._rows() if row.name == name), None)
        suggested = NO_RANGE | {"path": name}
        if name == SET_POINT:
            suggested |= ENDS
        elif row is not None:
            try:
                unit = self.view.document.case().quantity(row.name).unit
                value = df.parse(row.value, unit)
            except (df.DForceError, TypeError):  # typed halfway: the ends are left for the person
                value = 0.0
            if value > 0.0:
                own = _unit_of(row) or unit  # of both ends, and of a number that is typed without one
                ends = (in_unit(f"{factor * value:.4g}", unit, own, unit) for factor in (0.5, 2.0))
                suggested |= dict(zip(("low", "high"), (explore.with_unit(end, own) for end in ends), strict=True))
        if second:
            self.second = suggested
        else:
            self.suggested = suggested
        self.show()

    async def _compute(self, event: GenericEventArguments) -> None:
        given, document, session = event.args, self.view.document, self.view.session
        rows = {row.name: row for row in self._rows()}
        if given["path"] not in rows or self.study.busy:
            return
        self.suggested = {"path": given["path"], **_ends(given)}
        self.second = {"path": str(given.get("second") or ""), **_ends(given, "2")}
        try:
            case = session.limits.check(document.case())
            first = Varied(rows[given["path"]], **_ends(given), points=int(given["points"] or 0))
            second = None
            if self.second["path"] in rows:
                second = Varied(rows[self.second["path"]], **_ends(given, "2"), points=int(given["points2"] or 0))
            limits = _limits(given)
            if second is not None or limits or given.get("all") or first.row.name == SET_POINT:
                job: SweepJob | PlanJob = await asyncio.to_thread(plan_job, document, case, first, second, limits)
            else:
                job = await asyncio.to_thread(sweep_job, document, case, first)
        except (df.DForceError, TypeError, ValueError) as error:
            say(f"Nothing was computed. {as_sentence(in_words(document, str(error)))}")
            return
        job.seconds = session.limits.seconds
        self.choice = explore.Choice() if second is not None else dataclasses.replace(self.choice, y="")
        rows_varied = first.row, None if second is None else second.row
        background_tasks.create(
            self.study.compute(job, rows_varied, session.look_at_jobs, LOOKED_EVERY), name="against parameters"
        )

    def _choose(self, event: GenericEventArguments) -> None:
        result, given = self.study.result, dict(event.args)
        if result is None:
            return
        places = {**self.choice.places, **{str(dim): int(at) for dim, at in dict(given.pop("places", {})).items()}}
        asked = {key: str(value) for key, value in given.items() if key in ("quantity", "x", "y")}
        if asked.get("quantity", self.choice.quantity) != self.choice.quantity:
            self.limit = None
        self.choice = explore.fitting(result, dataclasses.replace(self.choice, places=places, **asked))
        self.picked = None
        self._changed()

    def _limit(self, event: GenericEventArguments) -> None:
        """Set, move or take away the limit."""
        result, given = self.study.result, dict(event.args)
        if result is None or self.choice.y:
            return
        above = bool(given.get("above", self.limit.above if self.limit is not None else False))
        if given.get("on") is False:
            self.limit = None
        elif self.limit is None:
            self.limit = explore.usual_limit(result, self.choice, above)
        else:
            self.limit = dataclasses.replace(self.limit, above=above)
        if self.limit is not None and "text" in given:
            try:
                self.limit = explore.read_limit(result, self.choice, str(given["text"])[:40], above)
            except df.DForceError as error:
                say(as_sentence(str(error)))
        self._changed()

    def _dragged(self, value: float) -> None:
        if self.study.result is not None and self.limit is not None and not self.choice.y:
            scale, _ = explore.scale_of(self.study.result, self.choice)
            self.limit = dataclasses.replace(self.limit, value=value * scale)
            self._changed()

    def _clicked_on(self, event: dict[str, Any], figure: Figure) -> None:
        if figure == self._figure:  # one before it may be of other parameters
            self._clicked(event)

    def _clicked(self, event: dict[str, Any]) -> None:
        result = self.study.result
        if result is not None and all(isinstance(event[key], int | float) for key in ("x", "y")):
            self.picked = explore.picked(result, self.choice, float(event["x"]), float(event["y"]))
            self._changed()

    def _take(self) -> None:
        """Put the settings of the point that was clicked into the case."""
        result = self.study.result
        if result is None or self.picked is None:
            return
        document, share = self.view.document, self.view.document.set_point
        for path, (value, unit) in explore.settings_at(result, self.picked).items():
            place = path_of(document, path)
            if path == "set_point":
                share = min(max(value, LOWEST_SET_POINT), HIGHEST_SET_POINT)
            elif any(row.path == place for row in self._rows()):
                document = document.put(place, value if unit == "1" else show(value, unit, DIGITS))
        self.view.edit(document, anew=True)
        self.view.session.look(dataclasses.replace(self.view.document, set_point=share))


def _unit_of(row: ParameterRow) -> str:
    """Return the unit of a parameter's value; empty for a number alone, and for a share."""
    return "" if row.name == SET_POINT else taken_apart(row.value, "")[1]


def _ends(given: dict[str, Any], which: str = "") -> dict[str, str]:
    """Return the ends of a range as typed."""
    return {end: str(given.get(f"{end}{which}") or "")[:40] for end in ("low", "high")}


def _limits(given: dict[str, Any]) -> dict[str, str]:
    """Return the limits that were typed, as :func:`dforce.plan` takes them."""
    name, regime = str(given.get("limited") or ""), str(given.get("regime") or "")
    found = {"regime": regime} if regime else {}
    if name:
        limit = composed(str(given.get("limit") or "")[:40], OBSERVABLES[name].shown)
        found[name] = f"{'>' if given.get('above') else '<'} {limit}"
    return found


def _limitable() -> list[dict[str, str]]:
    """Return the quantities that a limit may hold for, with their words."""
    names = [name for name in explore.FIRST if name in limited()]
    return [{"name": name, "label": OBSERVABLES[name].label, "unit": OBSERVABLES[name].shown} for name in names]
