"""The force behind a measured curve: reconstructed on a tab of its panel, with its gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nicegui import background_tasks, ui

import dforce as df
from dforce.gui.curves.chart import Chart
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.document.compute import Job
from dforce.gui.measured import confirming, overlay
from dforce.gui.measured.reconstructed import figure_of
from dforce.gui.window.error_messages import as_sentence, telling
from dforce.gui.window.view import View

if TYPE_CHECKING:
    import xarray as xr

NO_GAP = "No gap: the force is known over the whole range."


@dataclass
class ReconstructJob(Job):
    """A reconstruction under way, of a curve whose heights are average distances."""

    curve: xr.Dataset | None = None

    def compute(self) -> xr.Dataset:
        """Reconstruct the force."""
        if self.curve is None:
            raise df.ParameterError("there is no measured curve")
        return df.reconstruct(self.curve, self.case, progress=self._watch)


class ReconstructionShown(ui.element, component="reconstructing.js"):
    """What the tab shows, around its chart."""


class Reconstruction(Panel):
    """The tab of one page; `beside` returns the measured curve as it is drawn, None without one."""

    title = "Reconstruct"

    def __init__(self, view: View, beside: Callable[[], overlay.Beside | None]) -> None:
        super().__init__(view)
        self.beside = beside
        self.job: ReconstructJob | None = None
        self.holds_for = ""
        self._of: object = None  # of which curve and lever the result is

    def suits(self, scene: Scene) -> bool:
        """Return whether there is a measured curve."""
        return self.view.document.measured is not None

    def make(self) -> None:
        """Make the tab, in the container that is open."""
        self.element = ReconstructionShown()
        with self.element:
            self.chart = Chart("force against distance, reconstructed")
        self.element.on("start", self.start)
        self.element.on("stop", self.stop)
        self.element.on("keep", self.keep)
        self.view.on_job.append(self.show)
        self.view.on_show.append(lambda anew: self.show())

    def show(self, scene: Scene | None = None) -> None:
        """Show what was reconstructed, and how far it is."""
        document, job = self.view.document, self.job
        if document.measured is None or not self.in_sight:
            return
        result = None if job is None else job.result
        confirmed = confirming.is_confirmed(document, confirming.asked(document))
        shown = {
            "name": document.measured.name,
            "unconfirmed": "" if confirmed else confirming.UNCONFIRMED,
            "busy": job is not None and job.busy,
            "share": job.share if job is not None else 0.0,
            "failed": as_sentence(job.error) if job is not None and job.error else "",
            "done": result is not None,
            "stale": result is not None and self._of != self._now(),
            "holds_for": self.holds_for,
            "gaps": [] if result is None else [as_sentence(line) for line in notes_of(result)],
        }
        if any(self.element.props.get(key) != value for key, value in shown.items()):
            self.element.props.update(shown)
            self.element.update()
        if scene is not None:  # the chart was hidden, perhaps before it was drawn
            self._draw()

    async def start(self) -> None:
        """Reconstruct the force of the curve as it is drawn, for the lever that was confirmed."""
        beside = self.beside()
        if beside is None or (self.job is not None and self.job.busy):
            return
        with telling("the force could not be reconstructed"):
            case = self.view.session.limits.check(self.view.document.case())
            lever = confirming.lever_and_tip(case)
            if not confirming.is_confirmed(self.view.document, lever):
                raise df.ParameterError(confirming.UNCONFIRMED)
            exact = {name: value for name, value in lever.items() if name[0] in "kQ"}  # the force scales with k / Q
            self._of, self.holds_for = self._now(), f"for {confirming.in_words(exact)}"
            self.job = ReconstructJob(case, self.view.session.limits.seconds, curve=beside.moved())
            await self.job.go(self.show)
            self._draw()

    def stop(self) -> None:
        """Stop the reconstruction under way."""
        if self.job is not None:
            self.job.stopping.set()

    async def keep(self) -> None:
        """Keep the force in the list of results, from where it is drawn and saved."""
        if self.job is not None and self.job.result is not None:
            with telling("the force could not be kept"):
                title = f"Force behind {self.job.result.attrs.get('source', 'the curve')}"
                await self.view.session.keep(self.job.result.assign_attrs(title=title), shown=False)

    def _draw(self) -> None:
        if self.job is not None and self.job.result is not None:
            background_tasks.create(self.chart.draw(figure_of(self.job.result).figure))

    def _now(self) -> object:
        document = self.view.document
        measured = document.measured
        looks = None if measured is None else (measured.id, measured.shift, measured.turn)
        return looks, confirming.asked(document)


def notes_of(result: xr.Dataset) -> list[str]:
    """Return what a reconstruction says of its gaps, a sentence each."""
    notes = [line for line in str(result.attrs.get("notes", "")).splitlines() if line]
    return notes or ([] if result.sizes.get("gap", 0) else [NO_GAP])
