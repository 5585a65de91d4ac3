"""Sentences about a case file in the words of the forms: fields by their labels, and where something is typed."""

from __future__ import annotations

import re

import dforce as df
from dforce.core.parameters import Parameters
from dforce.experiments import EXPERIMENTS
from dforce.gui.case.fields import Field, fields, name_of, spaced
from dforce.gui.document.document import Document, Path, path_of

# what a force says that lacks a value of the instrument
NEEDS = re.compile(r"(\w+) needs ([\w.]+), which is missing; write .* under \[\w+\]")
ABOUT = re.compile(r"(\w+(?:\.\w+)+)(?: \([^)]*\))? (?:= )?(.*)", re.DOTALL)

KEY = re.compile(r"\b[a-z]+(?:_[a-z]+)+\b")
PATH = re.compile(rf"\b(?:{'|'.join(df.Case.model_fields)})(?:\.\w+)+")


def in_words(document: Document, text: str) -> str:
    """Return a sentence of dForce with the labels of fields in the place of paths and sections of a file."""
    if (needs := NEEDS.fullmatch(text)) is not None and needs[1] in df.forces.REGISTRY:
        label = label_of(document, tuple(needs[2].split(".")))
        return f"the force {name_of(df.forces.REGISTRY[needs[1]])} needs a value for: {label or needs[2]}"
    about = ABOUT.fullmatch(text)
    label = label_of(document, path_of(document, text)) if about is not None else ""
    if about is not None and label:
        if about[2] == "is missing":
            return f"{label}: a value is missing"
        return f"{label} {about[2]}" if about[2].startswith(("is ", "has ")) else f"{label}: {about[2]}"
    first, _, rest = text.partition(" ")
    model = df.forces.REGISTRY.get(first)
    if model is None:
        return text
    labels = {field.key: f"{field.label[0].lower()}{field.label[1:]}" for field in fields(model)}
    return f"the force {name_of(model)} {KEY.sub(lambda key: labels.get(key[0], spaced(key[0])), rest)}"


def with_labels(document: Document, text: str) -> str:
    """Return a piece of advice with the labels of fields in the place of their paths."""

    def label(path: re.Match[str]) -> str:
        found = label_of(document, path_of(document, path[0]))
        return f"“{found}”" if found else path[0]

    return PATH.sub(label, text)


def label_of(document: Document, path: Path) -> str:
    """Return the label of the field that a path leads to, with the force where it is one's; empty where there is none."""
    field = field_at(document, path)
    if field is None:
        return ""
    model = df.forces.REGISTRY.get(str(document.value((*path[:2], "model")))) if path[0] == "forces" else None
    return field.label if model is None else f"{name_of(model)}: {field.label[0].lower()}{field.label[1:]}"


def field_at(document: Document, path: Path) -> Field | None:
    """Return the field that a path of the document leads to, None when it leads to none now."""
    model: type[Parameters] | None = df.Case
    found: Field | None = None
    walked: tuple[str | int, ...] = ()
    for step in path:
        walked = (*walked, step)
        if isinstance(step, int):
            if walked[0] == "forces":
                model = df.forces.REGISTRY.get(str(document.value((*walked, "model"))))
            continue
        if model is None:
            return None
        if model is df.Case and step in ("forces", "experiment"):
            kind = str(document.value(("experiment", "kind")))
            model = EXPERIMENTS.get(kind) if step == "experiment" else None
            continue
        found = next((field for field in fields(model) if field.key == step), None)
        if found is None:
            return None
        tables = [shape.model for shape in found.shapes if shape.model is not None]
        model = tables[0] if tables else None
    return found
