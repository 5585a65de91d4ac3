"""The force behind a measured curve: reconstructed on a tab of its panel, with its gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nicegui import background_tasks

import dforce as df
from dforce.gui.curves.chart import Chart
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


class Reconstructing:
    """The reconstruction of one page; its chart is made in the container that is open.

    Parameters
    ----------
    view
        The page.
    beside
        Returns the measured curve as it is drawn; None without one.
    look
        Called when there is something else to show.
    """

    def __init__(self, view: View, beside: Callable[[], overlay.Beside | None], look: Callable[[], None]) -> None:
        self.view, self.beside, self.look = view, beside, look
        self.chart = Chart("force against distance, reconstructed")
        self.job: ReconstructJob | None = None
        self.holds_for = ""
        self._of: object = None  # of which curve and lever the result is

    def shown(self) -> dict[str, Any]:
        """Return what the panel shows."""
        job = self.job
        result = None if job is None else job.result
        return {
            "rebuilding": job is not None and job.busy,
            "rebuilt_share": job.share if job is not None else 0.0,
            "unbuilt": as_sentence(job.error) if job is not None and job.error else "",
            "gaps": [] if result is None else [as_sentence(line) for line in notes_of(result)],
            "rebuilt": result is not None,
            "rebuilt_for": self.holds_for,
            "rebuilt_stale": result is not None and self._of != self._now(),
        }

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
            self._of = self._now()
            job = self.job = ReconstructJob(case, self.view.session.limits.seconds, curve=beside.moved())
            exact = {name: value for name, value in lever.items() if name[0] in "kQ"}  # the force scales with k / Q
            self.holds_for = f"for {confirming.in_words(exact)}"
            await job.go(self.look)
            if job.result is not None:
                await self.chart.draw(figure_of(job.result).figure)

    def draw(self) -> None:
        """Draw the force again, on a chart that was hidden."""
        if self.job is not None and self.job.result is not None:
            background_tasks.create(self.chart.draw(figure_of(self.job.result).figure))

    async def keep(self) -> None:
        """Keep the force in the list of results, from where it is drawn and saved."""
        if self.job is not None and self.job.result is not None:
            with telling("the force could not be kept"):
                title = f"Force behind {self.job.result.attrs.get('source', 'the curve')}"
                await self.view.session.keep(self.job.result.assign_attrs(title=title), shown=False)

    def stop(self) -> None:
        """Stop the reconstruction under way."""
        if self.job is not None:
            self.job.stopping.set()

    def _now(self) -> object:
        document = self.view.document
        measured = document.measured
        looks = None if measured is None else (measured.id, measured.shift, measured.turn)
        return looks, confirming.asked(document)


def notes_of(result: xr.Dataset) -> list[str]:
    """Return what a reconstruction says of its gaps, a sentence each."""
    notes = [line for line in str(result.attrs.get("notes", "")).splitlines() if line]
    return notes or ([] if result.sizes.get("gap", 0) else [NO_GAP])
