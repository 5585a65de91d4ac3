"""The figure of a reconstructed force: its band, its gaps, and the law where it is known."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import background_tasks

import dforce as df
from dforce.gui.case.entry import QuietElement
from dforce.gui.curves.chart import Chart, packed, title, unit_of
from dforce.gui.curves.figures import MARGIN, Drawn, Figure
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.document.document import Document
from dforce.gui.measured import fitting
from dforce.gui.measured.session import ReconstructJob
from dforce.gui.window.dialogs import as_sentence, telling
from dforce.gui.window.view import View
from dforce.results.measured import moved

if TYPE_CHECKING:
    import xarray as xr

BAND = 2.0  # errors
FILL = "rgba(128,128,128,0.25)"


def figure_of(result: xr.Dataset) -> Drawn:
    """Return force against distance with a band of two errors; gaps are shaded, the law, if known, is beside it."""
    (x_scale, x_unit), (scale, unit) = unit_of(result["distance"]), unit_of(result["force"])
    x, force, error = (np.asarray(result[name].values, dtype=float) for name in ("distance", "force", "force_error"))
    data: list[Figure] = []

    def add(y: Any, meta: str, name: str, line: Figure) -> None:
        data.append(
            {
                "x": packed(x / x_scale),
                "y": packed(y / scale),
                "type": "scatter",
                "mode": "lines",
                "meta": meta,
                "name": name,
                "line": line,
                "hovertemplate": f"%{{x:.3g}} {x_unit}, %{{y:.3g}} {unit}<extra>{name}</extra>",
            }
        )

    known = np.isfinite(force) & np.isfinite(error)
    for part in np.split(np.flatnonzero(known), np.flatnonzero(np.diff(np.flatnonzero(known)) > 1) + 1):
        around = np.concatenate([force[part] + BAND * error[part], (force[part] - BAND * error[part])[::-1]])
        data.append(
            {
                "x": packed(np.concatenate([x[part], x[part][::-1]]) / x_scale),
                "y": packed(around / scale),
                "type": "scatter",
                "mode": "lines",
                "meta": "force_error",
                "name": "two errors",
                "line": {"color": "soft", "width": 0},
                "fill": "toself",
                "fillcolor": FILL,
                "hoverinfo": "skip",
                "showlegend": False,
            }
        )
    if "law_force" in result:
        add(result["law_force"].values, "law_force", "law", {"color": "soft", "dash": "dash", "width": 2})
    add(force, "force", "reconstructed; band: ±2 errors", {"color": 0, "dash": "solid", "width": 2})
    gaps: list[Figure] = [
        {
            "type": "rect",
            "xref": "x",
            "yref": "paper",
            "x0": float(low / x_scale),
            "x1": float(high / x_scale),
            "y0": 0,
            "y1": 1,
            "layer": "below",
            "line": {"width": 0},
            "fillcolor": FILL,
        }
        for low, high in zip(result["gap_low"].values, result["gap_high"].values, strict=True)
    ]
    words = [
        {
            "text": "force unknown",
            "x": 0.5 * (gap["x0"] + gap["x1"]),
            "y": 1,
            "yref": "paper",
            "yanchor": "top",
            "showarrow": False,
            "textangle": -90,
        }
        for gap in gaps
    ]
    layout = {
        "margin": MARGIN,
        "hovermode": "closest",
        "showlegend": True,
        "shapes": gaps,
        "annotations": words,
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.0, "yanchor": "bottom"},
        "xaxis": {"title": {"text": title(result["distance"], x_unit)}},
        "yaxis": {"title": {"text": title(result["force"], unit)}, "zeroline": True},
    }
    return Drawn({"data": data, "layout": layout, "bar": "hover"}, (None,) * len(data))


UNCONFIRMED = "Confirm lever and tip on the tab Fit: the force is proportional to k, and to 1/Q."
NO_GAP = "No gap: the force is known over the whole range."


class ReconstructionShown(QuietElement, component="reconstructing.js"):
    """The content of the tab, around its chart."""


class Reconstruction(Panel):
    """The tab of one page."""

    title = "Reconstruct"

    def __init__(self, view: View) -> None:
        super().__init__(view)
        self._drawn: xr.Dataset | None = None

    @property
    def job(self) -> ReconstructJob | None:
        """The session's reconstruction."""
        return self.view.session.measured.force

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
        """Show the reconstruction, and its progress."""
        document, job = self.view.document, self.job
        if document.measured is None or not self.in_sight:
            return
        result = None if job is None else job.result
        here = job is not None and job.of == _input(document)
        self.element.show(
            name=document.measured.name,
            unconfirmed=UNCONFIRMED if fitting.unconfirmed(document, fitting.lever_of(document)) else "",
            busy=job is not None and job.busy,
            share=job.share if job is not None else 0.0,
            failed=as_sentence(job.error) if job is not None and here and job.error else "",
            done=result is not None,
            stale=result is not None and not here,
            holds_for="" if job is None else job.holds_for,
            gaps=[] if result is None else [as_sentence(line) for line in notes_of(result)],
        )
        if result is not None and (scene is not None or result is not self._drawn):  # the chart may have been hidden
            self._drawn = result
            background_tasks.create(self.chart.draw(figure_of(result).figure))

    async def start(self) -> None:
        """Reconstruct the force of the curve at the shift that is typed, for the lever that was confirmed."""
        session, document = self.view.session, self.view.document
        curve, measured = await session.measured.load(document), document.measured
        if curve is None or measured is None or (self.job is not None and self.job.busy):
            return
        with telling("the force could not be reconstructed"):
            case = session.limits.check(document.case())
            values = fitting.lever_and_tip(case)
            if why := fitting.unconfirmed(document, values):
                raise df.ParameterError(why)
            exact = {name: value for name, value in values.items() if name[0] in "kQ"}  # the force scales with k / Q
            job = session.measured.force = ReconstructJob(
                case,
                session.limits.seconds,
                curve=moved(curve, measured.shift, measured.turn),
                of=_input(document),
                holds_for=f"for {fitting.lever_in_words(exact)}",
            )
            await job.go(session.look_at_jobs)

    def stop(self) -> None:
        """Stop the running reconstruction."""
        if self.job is not None:
            self.job.stopping.set()

    async def keep(self) -> None:
        """Keep the force in the list of results, from where it is drawn and saved."""
        if self.job is not None and self.job.result is not None:
            with telling("the force could not be kept"):
                title = f"Force behind {self.job.result.attrs.get('source', 'the curve')}"
                await self.view.session.keep(self.job.result.assign_attrs(title=title), shown=False)


def _input(document: Document) -> object:
    """Return the input of a reconstruction: the measured curve, its shift, and the lever."""
    measured = document.measured
    looks = None if measured is None else (measured.id, measured.shift, measured.turn)
    return looks, fitting.lever_of(document)


def notes_of(result: xr.Dataset) -> list[str]:
    """Return the sentences on the gaps of a reconstruction."""
    notes = [line for line in str(result.attrs.get("notes", "")).splitlines() if line]
    return notes or ([] if result.sizes.get("gap", 0) else [NO_GAP])
