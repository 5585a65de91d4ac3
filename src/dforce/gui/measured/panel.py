"""The measured curve of one page and its fit: the tab with its facts and its shift, and a tick and a prior at each field."""

from __future__ import annotations

import dataclasses
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.arrays import Array
from dforce.core.units import show
from dforce.experiments import Approach
from dforce.gui.case.entry import QuietElement
from dforce.gui.case.fields import Field, in_words, with_labels
from dforce.gui.case.values import ParameterRow, composed
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.document.document import Document, MeasuredData, Path, path_of
from dforce.gui.measured import fitting, overlay
from dforce.gui.measured.fitting import LIMIT, SafeJob
from dforce.gui.window.dialogs import as_sentence, say, telling
from dforce.gui.window.view import View
from dforce.inverse.checks import doubts
from dforce.validity import advice_in

if TYPE_CHECKING:
    import xarray as xr

NM = 1e-9
FEWEST, MOST, EVERY = 51, 501, 0.1e-9  # points of an experiment over the measured heights, and about how far apart
REACH = 3.0  # nm to either side of the shift that the curve itself suggests; more where it was shifted farther
BETWEEN = 0.05  # s between two messages of the shift that is dragged
PRIORS = ("fit", "priors")
LONGEST_PRIOR = 60  # characters
NONE = "Drop a measured curve anywhere onto the window. The chart draws it under the curve of the model; here you can fit it."
MATCH = "Set an approach over the measured distances, with the measured free amplitude"
LOADING = "The curve is calibrated ..."
NOT_HERE = "This picture has no measured quantity; choose amplitude and phase against the distance."
NO_MODEL = "The case has no curve against the distance; press Match the experiment."


class MeasuredPanel(QuietElement, component="measured.js"):
    """The content of the panel."""


class MeasuredCurve(Panel):
    """The measured curve of one page, and its fit."""

    title = "Fit"

    @property
    def label(self) -> str:
        """The title, with the reduced chi2 of a fit."""
        fit = self.view.session.measured.fit if self.view.document.measured is not None else None
        if fit is None or not fit.attrs["degrees_of_freedom"] or not fitting.is_of(fit, self.view.document):
            return self.title
        reduced = fit.attrs["chi2"] / fit.attrs["degrees_of_freedom"]
        return f"{self.title} (χ²/ν {reduced:.2g})" if reduced < 99.5 else f"{self.title} (χ²/ν {reduced:.0f})"

    def make(self) -> None:
        """Make the panel, in the container that is open."""
        with ui.element("div").classes("df-none") as self.none:
            ui.label(NONE).classes("df-text")
            with ui.element("button").classes("df-plain").props('type="button"') as button:
                ui.label("Open a measured curve")
            # a browser opens its dialog only where a person pressed, so the press must not go to the server and back
            button.on("click", js_handler="() => window.dforceFiles.pick()")
        element = self.element = MeasuredPanel()
        element.on("shift", self._shift, throttle=BETWEEN)
        element.on("match", self._match)
        element.on("remove", self._remove)
        element.on("confirm", self._confirm)
        element.on("library", self._library)
        element.on("lever", self._lever)
        element.on("safe", self._safe)
        element.on("unsafe", self.stop_safe)
        element.on("report", self._report)
        element.on("fit", self._fit)
        element.on("stop", self.view.session.stop_fit)
        element.on("take", self._take)
        self.view.on_job.append(self.show)
        self.view.on_show.append(lambda anew: self.show())

    def beside(self) -> overlay.Beside | None:
        """Return the curve to draw beside the model's curve; None where there is none."""
        kept, measured = self.view.session.measured, self.view.document.measured
        if measured is None or kept.curve is None:
            return None
        drawn = self.view.curve
        if drawn is not None and not drawn.document.same_case(self.view.document):
            before = drawn.document.measured
            # a shift that comes with other values waits for their curve
            measured = before if before is not None and before.id == measured.id else measured
        stale = kept.fit is not None and not fitting.is_of(kept.fit, self.view.document)
        return overlay.Beside(kept.curve, measured.shift, measured.turn, kept.fit, stale)

    def show(self, scene: Scene | None = None) -> None:
        """Show the curve of the document, and how far its fit is."""
        measured, kept = self.view.document.measured, self.view.session.measured
        self.element.set_visibility(measured is not None)
        self.none.set_visibility(measured is None)
        if measured is None or not self.in_sight:
            return
        curve = kept.curve
        facts = _facts(curve, measured) if curve is not None else [] if kept.wrong else [LOADING]
        shown = dict[str, Any](name=measured.name, wrong=as_sentence(kept.wrong) if kept.wrong else "", facts=facts)
        shown |= {"hint": self._hint(), "ready": curve is not None, "match": MATCH}
        if curve is not None:
            at, found = measured.shift / NM, float(curve.attrs.get("height_offset", 0.0)) / NM
            reach = max(REACH, 2.0 * abs(at - found))
            shown |= {"at": round(at, 3), "low": round(found - reach, 1), "high": round(found + reach, 1)}
            shown |= {"history": [str(line) for line in curve.attrs.get("history", [])]}
            shown |= {"doubts": [as_sentence(in_words(self.view.document, text)) for text in doubts(curve.attrs)]}
        self.element.show(**shown, **self._of_fit())

    def _hint(self) -> str:
        """Return why the curve cannot be seen, if it cannot."""
        result, wanted = self.view.result, self.view.picture()
        if result is None or wanted is None or self.view.session.measured.curve is None:
            return ""
        if "zc" not in result.dims:
            return NO_MODEL
        return "" if overlay.shows(wanted) else NOT_HERE

    def _of_fit(self) -> dict[str, Any]:
        """Return the panel's texts for a fit."""
        document, session = self.view.document, self.view.session
        job, fit = session.fitting, session.measured.fit
        rows, chosen = fitting.rows(document), fitting.free_paths(document)
        failed = fitting.refused(job, document)
        shown = dict[str, Any](report="", stale=False, notes=[], summary="", others=[], answers=[])
        shown |= {"free": [row.label for row in rows if row.path in chosen]}
        values = fitting.lever_of(document)
        shown |= {"lever": fitting.lever_in_words(values), "unconfirmed": fitting.unconfirmed(document, values)}
        missing = "" if values else as_sentence(in_words(document, fitting.why_no_lever(document)))
        shown |= {"typed": fitting.typed_lever(document), "levers": list(df.cantilevers()), "missing": missing}
        shown |= {"failed": with_labels(document, as_sentence(failed)) if failed else ""}
        busy = job is not None and job.busy
        shown |= {
            "busy": busy,
            "share": job.share if job is not None else 0.0,
            "words": job.words() if job is not None else "",
        }
        if fit is not None:
            shown |= {
                "answers": fitting.answers(fit, rows, document),
                "report": df.fit_report(fit),
                "stale": not fitting.is_of(fit, document),
                "notes": [with_labels(document, one.text) for one in advice_in(fit) if one.name != "reduced_chi2"],
                "summary": _summary(fit),
                "others": fitting.others(fit, rows, document),
            }
        safe = self._safe_for(document)
        shown |= {
            "findings": safe.sentences() if safe is not None and safe.share == document.set_point else [],
            "finding": safe is not None and safe.busy,
            "found": 0.0 if safe is None else safe.share,
            "unsafe": as_sentence(safe.error) if safe is not None and safe.error else "",
            "limit": LIMIT if safe is None else safe.limit,
            "set_point": f"{100.0 * document.set_point:.3g} %",
        }
        return shown

    def _change(self, **changes: Any) -> None:
        """Look at the curve in another way."""
        document = self.view.document
        if document.measured is not None:
            measured = dataclasses.replace(document.measured, **changes)
            self.view.session.look(dataclasses.replace(document, measured=measured))

    def _shift(self, event: GenericEventArguments) -> None:
        self._change(shift=max(-1.0, min(1.0, float(event.args) * NM)))

    def _match(self) -> None:
        curve, measured = self.view.session.measured.curve, self.view.document.measured
        if curve is not None and measured is not None:
            self.view.edit(matched(self.view.document, curve, measured.shift), anew=True)

    async def _remove(self) -> None:
        await self.view.session.drop_measured()

    def _confirm(self) -> None:
        self._change(confirmed=fitting.lever_of(self.view.document))

    def _library(self, event: GenericEventArguments) -> None:
        self.view.edit(fitting.with_library(self.view.document, str(event.args)), anew=True)

    def _lever(self, event: GenericEventArguments) -> None:
        name, text = str(event.args["name"]), str(event.args["text"])
        self.view.edit(fitting.with_value(self.view.document, name, text), anew=True)

    async def _safe(self, event: GenericEventArguments) -> None:
        """Find the safe settings for the sample of the fit."""
        session, document = self.view.session, self.view.document
        await session.measured.load(document)
        fit, before = session.measured.fit, self._safe_for(document)
        if fit is None or (before is not None and before.busy):
            return
        with telling("the safe settings could not be found"):
            case = session.limits.check(df.Case.from_toml(str(fit.attrs["case"])))
            limit, share = composed(str(event.args)[: fitting.LONGEST], "nN"), document.set_point
            self.stop_safe()  # the values of an earlier fit
            job = session.measured.safe = SafeJob(
                case, session.limits.seconds, document, limit=limit, share=share, fit=fit
            )
            await job.go(session.look_at_jobs)

    def _safe_for(self, document: Document) -> SafeJob | None:
        """Return the safe settings for the fit of a document; None where none were asked for."""
        safe = self.view.session.measured.safe
        measured = safe.document.measured if safe is not None and safe.document is not None else None
        same = measured is not None and document.measured is not None and measured.fit == document.measured.fit
        return safe if same else None

    def stop_safe(self) -> None:
        """Stop the computation of safe settings."""
        if (safe := self.view.session.measured.safe) is not None:
            safe.stopping.set()

    def _report(self) -> None:
        fit = self.view.session.measured.fit
        if fit is not None:
            text = f"{df.fit_report(fit)}\n\n{df.chi2_in_words(fit)}\n"
            ui.download.content(
                text, f"{PurePath(str(fit.attrs.get('data_source', 'curve'))).stem}-fit.txt", "text/plain"
            )

    async def _fit(self) -> None:
        with telling("the fit could not be made"):
            try:
                await self.view.session.fit(self.view.document)
            except (df.DForceError, TypeError) as error:
                say(f"Nothing was fitted. {as_sentence(in_words(self.view.document, str(error)))}")

    def _take(self) -> None:
        fit = self.view.session.measured.fit
        if fit is None:
            return
        shift, turn = fitting.offsets(fit)
        document, curve = fitting.taken_over(self.view.document, fit), self.view.session.measured.curve
        if curve is not None and document.measured is not None:
            document = covering(document, curve, document.measured.shift if shift is None else shift)
        self.view.edit(document, anew=True)
        self._change(turn=turn, **({} if shift is None else {"shift": shift}))


class FitAtField(QuietElement, component="at_field.js"):
    """The additions to one field."""


class FitAtFields:
    """The fit at each field of a page's forms, while there is a measured curve; see :class:`Companion`."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.placed: dict[Path, FitAtField] = {}
        self.foreseen = fitting.Foreseen(self.show)
        view.on_job.append(self.show)
        view.on_beside.append(self.show)

    def clear(self) -> None:
        """Forget all fields: they are made anew."""
        self.placed.clear()

    def place(self, path: Path, field: Field) -> None:
        """Make the elements at a field, in the open container."""
        element = FitAtField()
        element.set_visibility(False)
        element.props["label"] = field.label
        element.on("free", lambda event: self._free(path, bool(event.args)))
        element.on("prior", lambda event: self._prior(path, str(event.args)[:LONGEST_PRIOR].strip()))
        self.placed[path] = element

    def show(self) -> None:
        """Show the fit at the fields of parameters that can be fitted."""
        document, session = self.view.document, self.view.session
        rows = {} if document.measured is None else {row.path: row for row in fitting.rows(document)}
        for path, element in self.placed.items():
            element.set_visibility(path in rows)
        if not rows:
            return
        if session.measured.curve is not None:
            self.foreseen.ask(document, session.measured.curve)
        foreseen = {path_of(document, name): text for name, text in self.foreseen.sentences.items()}
        chosen, fit, job = fitting.free_paths(document), session.measured.fit, session.fitting
        failed = fitting.refused(job, document)
        stale = fit is not None and not fitting.is_of(fit, document)
        for path in self.placed.keys() & rows.keys():
            row = rows[path]
            name = "" if fit is None else fitting.name_in(fit, row, document)
            found, note = ("", foreseen.get(path, ""))
            if fit is not None and name:
                found, note = fitting.found_for(fit, name), fitting.note(fit, name)
            self.placed[path].show(
                free=path in chosen,
                busy=job is not None and job.busy,
                found=found,
                note=with_labels(document, as_sentence(failed) if row.name in failed else note),
                stale=stale,
                prior=str(prior_of(document, row)[1] or ""),
                example=example_of(row),
            )

    def _row(self, path: Path) -> ParameterRow | None:
        return next((row for row in fitting.rows(self.view.document) if row.path == path), None)

    def _free(self, path: Path, free: bool) -> None:
        row = self._row(path)
        if row is not None:
            self.view.edit(fitting.with_free(self.view.document, row, free), name="fit")

    def _prior(self, path: Path, text: str) -> None:
        row = self._row(path)
        if row is not None:
            key = prior_of(self.view.document, row)[0]
            if text.endswith(")"):  # a number alone has the unit of the field
                text = f"{text} {row.value.partition(' ')[2]}".strip()
            self.view.edit(self.view.document.put((*PRIORS, key), text or None), name="fit")


def covering(document: Document, curve: xr.Dataset, shift: float) -> Document:
    """Return a document whose approach goes over the heights of a curve; the same one where it does so, or has no approach."""
    try:
        case = document.case()
        if not isinstance(case.experiment, Approach):
            return document
        zc = case.experiment.distances(case.problem.tones[0].A0)
    except (df.DForceError, TypeError):  # typed halfway
        return document
    heights = curve["height"].values + shift
    covers = zc.min() < heights.min() + EVERY and heights.max() - EVERY < zc.max()
    return document if covers else document.put(("experiment", "zc"), _distances(heights))


def _distances(heights: Array) -> dict[str, Any]:
    start, stop = float(heights.max()), float(heights.min())
    points = min(MOST, max(FEWEST, round((start - stop) / EVERY) + 1))
    return {"start": show(round(start, 12), "m"), "stop": show(round(stop, 12), "m"), "points": points}


def matched(document: Document, curve: xr.Dataset, shift: float) -> Document:
    """Return a document whose experiment goes over the heights of a curve, with its free amplitude."""
    experiment = {"kind": "approach", "zc": _distances(curve["height"].values + shift), "direction": "both"}
    document = document.choose(("experiment",), str(document.value(("experiment", "kind")) or ""), "", None)
    document = document.put(("experiment",), experiment)
    if "free_amplitude" in curve.attrs:
        path = ("drive", "tones", 0, "A0") if document.value(("drive", "tones")) else ("drive", "A0")
        document = document.put(path, show(float(curve.attrs["free_amplitude"]), "m", 5))
    return document


def _facts(curve: xr.Dataset, measured: MeasuredData) -> list[str]:
    """Return words for a curve."""
    ways = [word for word in ("approach", "retract") if (curve["direction"].values == word).any()]
    found = [f"{curve.sizes['point']} points, {' and '.join(ways)}"]
    if "free_amplitude" in curve.attrs:
        found.append(f"Free amplitude {show(float(curve.attrs['free_amplitude']), 'm', 4)}")
    noise = [f"{show(float(curve.attrs['amplitude_error']), 'm', 2)}"] if "amplitude_error" in curve.attrs else []
    noise += [f"{float(curve.attrs['phase_error']):.2g}°"] if "phase_error" in curve.attrs else []
    if noise:
        found.append(f"Noise of a point: {' and '.join(noise)}")
    if measured.turn:
        found.append(f"Phases shifted by {-measured.turn:.2f}°, from the fit")
    return found


def _summary(fit: xr.Dataset) -> str:
    """Return how good a fit is."""
    text = df.chi2_in_words(fit)
    lost = int(fit.attrs["lost_points"])
    return f"{text}{f' {lost} points are lost.' if lost else ''}"


def prior_of(document: Document, row: ParameterRow) -> tuple[str, object]:
    """Return under which name a document has the prior of a parameter, and the prior; its own name and None without one."""
    given = document.value(PRIORS)
    names = [name for name in given if path_of(document, str(name)) == row.path] if isinstance(given, dict) else []
    return (str(names[0]), given[names[0]]) if names else (row.name, None)


def example_of(row: ParameterRow) -> str:
    """Return a prior as it is typed: two digits of the value, and in brackets an error of 2 in the second (2 to 20 %)."""
    number, _, unit = row.value.partition(" ")
    try:
        value = float(f"{float(number):.1e}")
        decimals = 1 - int(f"{value:e}".partition("e")[2])
    except ValueError:  # typed halfway
        return "180(4)"
    return f"{value:.{max(0, decimals)}f}({2 * 10 ** max(0, -decimals)}) {unit}".strip()
