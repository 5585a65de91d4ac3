"""The form of a case, made from the declarations of its parameters: sections, fields, lists, choices, forces."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

import dforce as df
from dforce.core.errors import shorten
from dforce.core.notation import html_symbol
from dforce.core.parameters import Parameters
from dforce.experiments import EXPERIMENTS
from dforce.gui.case import values
from dforce.gui.case.entry import Caption, Companion, Entry, OwnLaw, button, choose_force, heading
from dforce.gui.case.fields import Field, Shape, carried, fields, first_line, name_of, spaced, start_of
from dforce.gui.case.sliders import toggle
from dforce.gui.case.values import check, nominal_value, read, shown, units_of
from dforce.gui.document.document import Path, written
from dforce.gui.window.shown import Said
from dforce.gui.window.view import View

LEFT_OUT = "left out"
MORE = "More"
FIRST = ("cantilever", "drive", "tip", "sample", "forces", "experiment")  # sections that every case shows
LATER = ("contact", "medium", "readout", "noise", "solver")  # behind "More" while nothing is typed in them
SWITCH = "Switch off for comparison"
TEXTUAL = ("quantity", "numbers", "whole", "number", "text")


class Forms:
    """The forms of one page.

    The sections and fields that a case uses come first, the others are behind "More". The fields register themselves by path,
    so that values, errors and advice find them. To add a field for a new shape see :meth:`_shape`.
    """

    def __init__(self, view: View, companions: Sequence[Companion] = ()) -> None:
        self.view, self.companions = view, companions
        self.shown: dict[Path, tuple[Field, Shape, Entry | OwnLaw]] = {}
        self._fresh: dict[Path, tuple[Any, ...]] = {}  # the values that each field shows, and whether it has a slider
        self._looked_at: dict[Path, tuple[Any, str]] = {}  # the value last seen at a path, and its error
        self.frame = ui.element("div").classes("df-form")
        self._folds: list[ui.element] = []  # the open folds around the element that is being made
        self._hidden: dict[Path, tuple[ui.element, ...]] = {}  # the folds around each field
        self._unfolding: set[Path] = set()  # fields that others appear with
        self._build()
        view.on_show.append(self.show)
        view.on_said.append(self.said)
        self.last = Said()

    def _build(self) -> None:
        """Fill the form anew."""
        self.frame.clear()
        self.shown.clear()
        self._fresh.clear()
        self._looked_at.clear()
        self._hidden.clear()
        used = [name for name in LATER if self.view.document.value((name,))]
        with self.frame:
            for name in (*FIRST, *used):
                self._section_of_case(name)
            with self._fold("More settings"):
                for name in LATER:
                    if name not in used:
                        self._section_of_case(name)

    @contextlib.contextmanager
    def _fold(self, title: str) -> Iterator[None]:
        """Hide the elements made inside behind a line that opens them."""
        with ui.element("details").classes("df-folded") as fold:
            TextElement(tag="summary", text=title)
            self._folds.append(fold)
            try:
                yield
            finally:
                self._folds.pop()

    def show(self, anew: bool) -> None:
        """Show the document: every field, or the forms anew."""
        if anew:
            for companion in self.companions:
                companion.clear()
            self._build()
            self.frame.client.run_javascript("dforceUnsent.forget()")  # else a later page types it into another case
        changed = [path for path in self.shown if self._refresh(path) or anew]
        for companion in self.companions:
            companion.show()
        self._mark(changed)  # a field's own mistake is shown at once, a mistake of the case after its check

    def said(self, said: Said) -> None:
        """Show errors and advice at the fields that they are about; nothing newer waits then."""
        before, self.last = self.last, said
        places = [path for one in (before, said) for path in (one.where, *(path for path, _ in one.advice))]
        self._mark({self._nearest(path) for path in places} & self.shown.keys())
        for _, _, entry in self.shown.values():
            entry.settle()

    def _mark(self, paths: Iterable[Path]) -> None:
        """Show errors and advice at fields; a field's own error comes first."""
        said = self.last
        advice: dict[Path, list[str]] = {}
        for path, text in said.advice:
            advice.setdefault(self._nearest(path), []).append(text)
        wrong_at = self._nearest(said.where) if said.wrong else ()
        for path in paths:
            field, shape, entry = self.shown[path]
            wrong = self._wrong(path, field, shape) or (said.wrong if path == wrong_at else "")
            told = {"error": wrong, "advice": advice.get(path, [])}
            is_new = any(told.values()) and any(entry.props.get(key) != one for key, one in told.items())
            entry.show(**told)
            for fold in self._hidden.get(path, ()) if is_new else ():
                fold.props["open"] = True
                fold.run_method("setAttribute", "open", "")  # a person may have shut it since it was opened

    def _wrong(self, path: Path, field: Field, shape: Shape) -> str:
        """Return the error of the value at a path by itself; checked once for each value."""
        value = self.view.document.value(path)
        seen = self._looked_at.get(path)
        if seen is None or seen[0] != value:
            seen = value, check(field, shape, value) if shape.kind in TEXTUAL else ""
            self._looked_at[path] = seen
        return seen[1]

    def has(self, path: Path) -> bool:
        """Return whether something is shown for a path, so that an error about it is seen there."""
        return self._nearest(path) != ()

    def _nearest(self, path: Path) -> Path:
        """Return the path itself where it has a field, else the first field below it; () when there is none."""
        if path in self.shown:
            return path
        return next((other for other in self.shown if path and other[: len(path)] == path), ())

    def _section_of_case(self, name: str) -> None:
        info = df.Case.model_fields[name]
        model = info.annotation
        if name == "forces":
            self._forces()
        elif name == "experiment":
            self._experiment()
        elif inspect.isclass(model) and issubclass(model, Parameters):
            heading(spaced(name).capitalize())
            self._table((name,), model)

    def _table(self, path: Path, model: type[Parameters]) -> None:
        """Show the fields of a class at a path; of its ways only the chosen one."""
        hidden = set()
        if model.ways:
            way = self._way(path, model)
            words = {name: name for name in model.ways}
            label = f"{str(path[-1]).capitalize()} given as"
            self._choice(path, label, words, way, lambda new: self._take_way(path, model, way, new))
            hidden = {key for name, keys in model.ways.items() if name != way for key in keys}
        self._unfolding |= {(*path, key) for key in model.unfolded}
        folded = [field for field in self._unused(path, model) if field.key not in hidden]
        if len(folded) == 1 or len(folded) == len(fields(model)) - len(hidden):  # nothing is gained by a fold
            folded = []
        for field in fields(model):
            if field.key in hidden or field in folded:
                continue
            if model.ways and model.ways[way] == (field.key,):  # the way has been chosen, so there is no more to choose
                self._shape((*path, field.key), field, field.shapes[0])
            else:
                self._field((*path, field.key), field)
        if folded:
            with self._fold(MORE):
                for field in folded:
                    self._field((*path, field.key), field)

    def _unused(self, path: Path, model: type[Parameters]) -> list[Field]:
        """Return the empty fields that need no value, without fields that are always shown."""
        given, shown = self.view.document.value(path) or {}, {*model.unfolded}
        shown |= {key for first, others in model.unfolded.items() if first in given for key in others}
        return [field for field in fields(model) if not field.required and field.key not in shown.union(given)]

    def _way(self, path: Path, model: type[Parameters]) -> str:
        given = self.view.document.value(path) or {}
        fits = (name for name, keys in model.ways.items() if any(key in given for key in keys))
        return next(fits, next(iter(model.ways)))

    def _take_way(self, path: Path, model: type[Parameters], old: str, new: str) -> None:
        """Change to another way of the same input; values with the same name are carried over."""
        document = self.view.document
        given = document.value(path) or {}
        earlier = [document.aside[key] for key in document.aside if key.rpartition("/")[0] == ".".join(map(str, path))]
        grouped = {key for keys in model.ways.values() for key in keys}
        common = {key: value for key, value in given.items() if key not in grouped}
        known = {key: value for table in (*earlier, given) for key, value in (table or {}).items() if key in grouped}
        start = carried(known, model, model.ways[new])
        document = document.choose(path, old, new, common | start)
        self.view.edit(document, anew=True)

    def _field(self, path: Path, field: Field) -> None:
        """Show one field: a row for a plain value, a choice where it may have several shapes, a group for a table."""
        value = self.view.document.value(path)
        optional = not field.required and field.default is None
        table = any(shape.kind in ("table", "tables") for shape in field.shapes)
        choosing = len(field.shapes) > 1 or (table and optional and field.shapes[0].kind == "table")
        if not choosing:
            self._shape(path, field, field.shapes[0])
            return
        labels = {shape.label: shape.label for shape in field.shapes}
        if optional and table:
            labels = {LEFT_OUT: LEFT_OUT, **labels}
        shape = field.shape_of(value)
        chosen = LEFT_OUT if optional and table and value is None else shape.label
        self._choice(
            path, field.label, labels, chosen, lambda new: self._take_shape(path, field, chosen, new), field.help
        )
        if chosen != LEFT_OUT and shape.kind != "word":
            with ui.element("div").classes("df-group"):
                self._shape(path, field, shape)

    def _take_shape(self, path: Path, field: Field, old: str, new: str) -> None:
        shape = next((shape for shape in field.shapes if shape.label == new), None)
        start: Any = None
        if shape is not None:
            given = self.view.document.value(path)
            if shape.kind == "table" and shape.model is not None:
                start = start_of(shape.model, given)
            elif shape.kind == "word":
                start = shape.words[0]
            elif shape.kind == "numbers":
                start = [given["start"], given["stop"]] if isinstance(given, Mapping) and "stop" in given else []
            elif shape.kind == "quantity":
                start = given.get("start", "") if isinstance(given, Mapping) else ""
        self.view.edit(self.view.document.choose(path, old, new, start), anew=True)

    def _shape(self, path: Path, field: Field, shape: Shape) -> None:
        """Show a value of one shape."""
        if shape.kind == "table" and shape.model is not None:
            self._table(path, shape.model)
        elif shape.kind == "tables" and shape.model is not None:
            self._tables(path, field, shape.model)
        elif shape.kind == "choice":
            words = {word: spaced(word) for word in shape.words}
            chosen = str(self.view.document.value(path) or field.default)
            take = partial(self._put, path, anew=path in self._unfolding)
            entry = self._choice(path, field.label, words, chosen, take, field.help)
            self._register(path, field, shape, entry)
        elif path[0] == "forces" and field.key == "law":
            self._register(path, field, shape, OwnLaw(self.view, path, field))
            self._refresh(path)
        else:
            self._row(path, field, shape)

    def _row(self, path: Path, field: Field, shape: Shape) -> None:
        numeric = shape.kind in TEXTUAL and shape.kind != "text"
        slidable = shape.kind in ("quantity", "whole", "number")
        with ui.element("div").classes("df-parameter"):
            entry = Entry(
                written(path),
                Caption(field.label, html_symbol(field.symbol), field.help),
                on_typed=lambda text, unit: self._typed(path, field, shape, text, unit),
                kind="switch" if shape.kind == "switch" else "text",
                known=field.examples,
                numeric=numeric,
                on_unit=lambda unit: self._in_unit(path, field, unit),
                on_slider=(lambda: toggle(self.view, path, field)) if slidable else None,
            )
            for companion in self.companions if slidable else ():
                companion.place(path, field)
        self._register(path, field, shape, entry)
        self._refresh(path)

    def _register(self, path: Path, field: Field, shape: Shape, entry: Entry | OwnLaw) -> None:
        self.shown[path] = (field, shape, entry)
        self._hidden[path] = tuple(self._folds)

    def _refresh(self, path: Path) -> bool:
        """Show the document's value at a path; return whether it is new."""
        field, shape, entry = self.shown[path]
        value, nominal = self.view.document.value(path), nominal_value(self.view.document, path)
        sliding = any(slider.path == path for slider in self.view.document.sliders)
        if self._fresh.get(path) == (value, nominal, sliding):
            return False
        self._fresh[path] = value, nominal, sliding
        if shape.kind == "switch":
            entry.show(text="true" if (field.default if value is None else value) else "false")
        elif shape.kind == "choice":
            entry.show(text=str(field.default if value is None else value))
        elif shape.kind in ("quantity", "numbers"):
            default, usual = shown(field, field.default if nominal is None else nominal)
            text, unit = ("", usual) if value is None and nominal is not None else shown(field, value)
            placeholder = (field.placeholder if nominal is None else "") or default
            entry.show(text=text, unit=unit, units=units_of(field, unit), placeholder=placeholder, sliding=sliding)
        else:
            default = "" if field.default is None else str(field.default)
            text = "" if value is None else str(value)
            entry.show(text=text, placeholder=field.placeholder or default, sliding=sliding)
        return True

    def _typed(self, path: Path, field: Field, shape: Shape, text: str, unit: str) -> None:
        self._put(path, read(field, shape, text, unit), name=".".join(map(str, path)))

    def _in_unit(self, path: Path, field: Field, unit: str) -> None:
        text, old = shown(field, self.view.document.value(path))
        if unit not in units_of(field, old) or field.quantity is None:
            return
        if not text:
            self.shown[path][2].show(unit=unit)
            return
        numbers = [values.in_unit(part, old, unit, field.quantity.unit) for part in text.split("; ")]
        parts = [values.composed(number, unit) for number in numbers]
        self._put(path, parts if self.shown[path][1].kind == "numbers" else parts[0])

    def typed_elsewhere(self, name: str, text: str, unit: str) -> None:
        """Take the input of a named field in a page that could not send it."""
        for path, (field, shape, entry) in list(self.shown.items()):
            if entry.props["path"] == name:
                self._typed(path, field, shape, text, unit)

    def _put(self, path: Path, value: object, name: str = "", anew: bool = False) -> None:
        self.view.edit(self.view.document.put(path, value), anew=anew, name=name)

    def _choice(
        self, path: Path, label: str, words: Mapping[str, str], chosen: str, take: Callable[[str], None], help: str = ""
    ) -> Entry:
        name, caption = written(path), Caption(label, help=help or label)
        entry = Entry(name, caption, kind="choice", on_typed=lambda word, _: take(word) if word in words else None)
        entry.show(text=chosen, options=[{"value": word, "label": shown_} for word, shown_ in words.items()])
        return entry

    def _tables(self, path: Path, field: Field, model: type[Parameters]) -> None:
        """Show a list of tables, such as modes: each with its number, a way to remove it, and one to add another."""
        items = self.view.document.value(path) or []
        noun = name_of(model).lower()
        for place in range(len(items)):
            with ui.element("div").classes("df-card"):
                with ui.element("div").classes("df-card-head"):
                    ui.label(f"{noun.capitalize()} {place + 1}").classes("df-card-title")
                    self._remove((*path, place), f"{noun} {place + 1}")
                self._table((*path, place), model)
        last = dict(items[-1]) if items else {}
        button(f"Add a {noun}", "add", lambda: self.view.edit(self.view.document.add(path, last), anew=True))

    def _remove(self, path: Path, noun: str) -> None:
        button("", "close", lambda: self.view.edit(self.view.document.remove(path), anew=True), f"remove {noun}")

    def _forces(self) -> None:
        """Show the forces, each with its switch, and a menu of all models that there are."""
        heading("Forces between tip and sample")
        for place, given in enumerate(self.view.document.value(("forces",)) or []):
            self._force(place, given)
        button("Add a force", "add", lambda: choose_force(self._add_force))

    def _force(self, place: int, given: Mapping[str, object]) -> None:
        name = str(given.get("model", ""))
        model = df.forces.REGISTRY.get(name)
        on = place not in self.view.document.off
        with ui.element("div").classes("df-card" if on else "df-card off"):
            with ui.element("div").classes("df-card-head"):
                title = name_of(model) if model is not None else name
                ui.label(title).classes("df-card-title").props["title"] = first_line(model) if model is not None else ""
                switch = ui.switch(value=on, on_change=lambda event: self._switch(place, bool(event.value)))
                switch.props.update({"dense": True, "aria-label": f"{title} takes part", "title": SWITCH})
                self._remove(("forces", place), title)
            if model is None:
                ui.label(f"There is no force model '{shorten(name)}' here.").classes("df-error")
            elif on:
                self._table(("forces", place), model)

    def _switch(self, place: int, on: bool) -> None:
        self.view.edit(self.view.document.switch(place, on), anew=True)

    def _add_force(self, name: str) -> None:
        model = df.forces.REGISTRY[name]
        self.view.edit(self.view.document.add(("forces",), {"model": name, **model.example}), anew=True)

    def _experiment(self) -> None:
        """Show the choice of the experiment, and the fields of the one chosen."""
        heading("Experiment")
        kind = self.view.document.value(("experiment", "kind")) or ""
        words = {name: spaced(name) for name in EXPERIMENTS}
        if kind not in words:
            words = {"": "choose one", **words}
        self._choice(("experiment",), "Kind", words, str(kind), lambda new: self._take_experiment(str(kind), new))
        model = EXPERIMENTS.get(kind)
        if model is not None:
            ui.label(first_line(model)).classes("df-text")
            self._table(("experiment",), model)

    def _take_experiment(self, old: str, new: str) -> None:
        """Change to another experiment, with values that suit the instrument where nothing was typed for it yet."""
        if new not in EXPERIMENTS:
            return
        document = self.view.document
        try:
            suggested = EXPERIMENTS[new].suggested(document.put(("experiment",), None).case().problem)
        except df.DForceError:  # an instrument that is not yet right suggests nothing
            suggested = {}
        self.view.edit(document.choose(("experiment",), old, new, {"kind": new, **suggested}), anew=True)
