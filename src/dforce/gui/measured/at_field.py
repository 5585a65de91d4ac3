"""The fit of a parameter at its field: a tick, what the last fit found, and what is known beforehand."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from dforce.gui.case.fields import Field
from dforce.gui.case.values import ParameterRow
from dforce.gui.case.words import with_labels
from dforce.gui.document.document import Document, Path, path_of
from dforce.gui.measured import fitting
from dforce.gui.window.dialogs import as_sentence
from dforce.gui.window.view import View

PRIORS = ("fit", "priors")
LONGEST = 60  # characters of a prior


class FitAtField(ui.element, component="at_field.js"):
    """What stands at one field."""

    def show(self, **changed: Any) -> None:
        """Show other words; nothing is sent where nothing changed."""
        self.props.update({key: value for key, value in changed.items() if self.props.get(key) != value})


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
        """Make what stands at a field, in the container that is open."""
        element = FitAtField()
        element.set_visibility(False)
        element.props["label"] = field.label
        element.on("free", lambda event: self._free(path, bool(event.args)))
        element.on("prior", lambda event: self._prior(path, str(event.args)[:LONGEST].strip()))
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
        failed = job.error if job is not None and job.state == "failed" else ""
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
            self.view.edit(self.view.document.put((*PRIORS, key), text or None), name="fit")


def prior_of(document: Document, row: ParameterRow) -> tuple[str, object]:
    """Return under which name a document has the prior of a parameter, and the prior; its own name and None without one."""
    given = document.value(PRIORS)
    names = [name for name in given if path_of(document, str(name)) == row.path] if isinstance(given, dict) else []
    return (str(names[0]), given[names[0]]) if names else (row.name, None)


def example_of(row: ParameterRow) -> str:
    """Return a prior as it is typed: the value with the error of its last digit in brackets."""
    number, _, unit = row.value.partition(" ")
    try:
        return f"{float(f'{float(number):.2g}'):g}(1) {unit}".strip()
    except ValueError:  # typed halfway
        return "180(4)"
