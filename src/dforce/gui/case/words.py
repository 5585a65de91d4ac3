"""Sentences about a case file in the words of the forms: fields by their labels, and where something is typed."""

from __future__ import annotations

import re

import dforce as df
from dforce.core.parameters import Parameters
from dforce.core.quantities import OBSERVABLES
from dforce.experiments import EXPERIMENTS
from dforce.gui.case.fields import Field, fields, name_of, spaced, within_sentence
from dforce.gui.document.document import Document, Path, path_of

# what a force says that lacks a value of the instrument
NEEDS = re.compile(r"(\w+) needs ([\w.]+), which is missing; write .* under \[\w+\]")
ABOUT = re.compile(r"(\w+(?:\.\w+)+)(?: \([^)]*\))? (?:= )?(.*)", re.DOTALL)

KEY = re.compile(r"\b[a-z]+(?:_[a-zA-Z\d]+)+\b")
PATH = re.compile(rf"\b(?:{'|'.join(df.Case.model_fields)})(?:\.\w+)+")
CHOICE = re.compile(r'(\w+) = "([^"]*)"(?: under \[\w+\])?')
SECTION = re.compile(r"(?: under)? \[\w+(?:\.\w+)*\]")
COMMAND = re.compile(r" ?\(df\.\w+\)")
ENGLISH = {"capillary", "custom", "electrostatic", "hydration", "solvation"}  # keys of models that are words, too
MODEL = re.compile(
    rf"(?<![.\w])(?:{'|'.join(sorted({*df.forces.REGISTRY} - ENGLISH, key=len, reverse=True))})(?!\.?\w)"
)


def in_words(document: Document, text: str) -> str:
    """Return a sentence of dForce with the labels of fields in the place of paths and sections of a file."""
    said, among, allowed = _about_field(document, text).partition(" is not one of ")
    return capitalized(said + among + plain(allowed))


def _about_field(document: Document, text: str) -> str:
    """Return a sentence that begins with a path, or a force, with the label in its place."""
    if (needs := NEEDS.fullmatch(text)) is not None and needs[1] in df.forces.REGISTRY:
        label = label_of(document, tuple(needs[2].split(".")))
        return f"the force {name_of(df.forces.REGISTRY[needs[1]])} needs a value for: {label or needs[2]}"
    about = ABOUT.fullmatch(text)
    label = label_of(document, path_of(document, text)) if about is not None else ""
    if about is not None and label:
        if about[2] == "is missing":
            return f"{label}: a value is missing"
        rest = about[2] if "'" in about[2] else plain(about[2])  # what a person typed is quoted, and stays
        return f"{label} {rest}" if rest.startswith(("is ", "has ")) else f"{label}: {rest}"
    first, _, rest = text.partition(" ")
    model = df.forces.REGISTRY.get(first)
    if model is None:
        return plain(text)
    labels = {field.key: within_sentence(field.label) for field in fields(model)}
    return f"the force {name_of(model)} {KEY.sub(lambda key: labels.get(key[0], spaced(key[0])), rest)}"


def with_labels(document: Document, text: str) -> str:
    """Return a piece of advice in the words of the window: labels, and names of models and quantities, for those of a file."""

    def label(path: re.Match[str]) -> str:
        found = label_of(document, path_of(document, path[0]))
        return f"“{found}”" if found else path[0]

    text = CHOICE.sub(lambda found: f"“{spaced(found[1])}: {spaced(found[2])}”", PATH.sub(label, text))
    return capitalized(plain(SECTION.sub("", text)))


def plain(text: str) -> str:
    """Return a text with names for readers in the place of the keys of models, quantities and parameters."""
    text = COMMAND.sub("", text)
    return KEY.sub(lambda found: _word(found[0]), MODEL.sub(lambda found: name_of(df.forces.REGISTRY[found[0]]), text))


def _word(key: str) -> str:
    return OBSERVABLES[key].label if key in OBSERVABLES else spaced(key)


def capitalized(text: str) -> str:
    """Return a sentence with a capital at its begin; a symbol, such as f0, stays as it is."""
    is_symbol = re.match(r"[a-z]+\d", text) is not None
    return text if is_symbol else f"{text[:1].upper()}{text[1:]}"


def label_of(document: Document, path: Path) -> str:
    """Return the label of the field that a path leads to, with the force where it is one's; empty where there is none."""
    field = field_at(document, path)
    if field is None:
        return ""
    model = df.forces.REGISTRY.get(str(document.value((*path[:2], "model")))) if path[0] == "forces" else None
    return field.label if model is None else f"{name_of(model)}: {within_sentence(field.label)}"


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
