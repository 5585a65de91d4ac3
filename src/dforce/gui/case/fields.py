"""Parameters in words: the form of a class, read from its declarations alone, and sentences with these labels."""

from __future__ import annotations

import functools
import inspect
import re
import types
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import dforce as df
from dforce.core.notation import first_phrase, first_sentence
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.parameters import Parameters
from dforce.core.quantities import OBSERVABLES
from dforce.core.units import show
from dforce.experiments import EXPERIMENTS
from dforce.gui.document.document import Document, Path, path_of

PEOPLE = ("Debye", "Hamaker", "Poisson", "Young")  # at the beginning of labels
DEFAULT = re.compile(r"default: ([^;]+)")
KEY = re.compile(r"\b[a-z]+(?:_[a-zA-Z\d]+)+\b")  # a word of case files
KEY_ALONE = re.compile(r"(?<![.\w])[a-z]+(?:_[a-z\d]+)+(?![.\w])")  # one with dots is a path, to be typed
SHORT = re.compile(r"\b(?:am|ce|fm|pm)\b")  # modes of operation, which people write in capitals
BOUNDS = {"low": "at least", "above": "above", "high": "at most", "below": "below"}


@dataclass(frozen=True)
class Shape:
    """One form that a value can take.

    Attributes
    ----------
    kind
        "quantity", "numbers" (several quantities), "whole", "number", "text", "switch", "choice" (one of `words`),
        "word" (this word alone), "table" (of `model`) or "tables" (a list of them).
    label
        Name of this form among several.
    """

    kind: str
    label: str = ""
    words: tuple[str, ...] = ()
    model: type[Parameters] | None = None


@dataclass(frozen=True)
class Field:
    """One parameter: how it is labeled, explained and bounded, and the shapes that its value can take."""

    key: str
    label: str
    help: str
    shapes: tuple[Shape, ...]
    required: bool = False
    default: Any = None
    symbol: str = ""
    quantity: ParameterQuantity | None = None
    placeholder: str = ""
    examples: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """SI unit of the quantity; empty for any other kind."""
        return self.quantity.unit if self.quantity is not None else ""

    def shape_of(self, value: object) -> Shape:
        """Return the shape that a value of a document has."""
        if len(self.shapes) == 1:
            return self.shapes[0]
        given = self.default if value is None else value
        if given is None:
            return self.shapes[0]
        for shape in self.shapes:
            if _fits(shape, given):
                return shape
        return self.shapes[0]


def _fits(shape: Shape, value: object) -> bool:
    if shape.kind == "word":
        return bool(value == shape.words[0])
    if shape.kind == "table":
        return isinstance(value, Mapping) and (shape.model is None or value.keys() <= {*shape.model.keys()})
    if shape.kind in ("tables", "numbers"):
        return isinstance(value, list | tuple)
    return not isinstance(value, Mapping | list | tuple)


@functools.cache  # asked for at each edit
def fields(model: type[Parameters]) -> tuple[Field, ...]:
    """Return the fields of a class that a person may set, in order, without fields that have only one value."""
    found = [_field(model, key) for key in model.keys()]  # noqa: SIM118 a method of Parameters
    return tuple(field for field in found if field.shapes)


def _field(model: type[Parameters], key: str) -> Field:
    info, quantity = model.model_fields[key], model.quantities().get(key)
    doc = info.description or spaced(key)
    shapes = tuple(_shapes(info.annotation, quantity))
    default = None if info.is_required() else info.get_default(call_default_factory=True)
    left_out = DEFAULT.search(doc)
    return Field(
        key=key,
        label=info.title or _label(key, doc),
        help=f"{_help(doc)}{_bounds(quantity) if quantity else ''}",
        shapes=shapes,
        required=info.is_required(),
        default=default,
        symbol=quantity.symbol if quantity else "",
        quantity=quantity,
        examples=tuple(map(str, info.examples or ())),
        placeholder=left_out[1] if left_out else "",
    )


def within_sentence(label: str) -> str:
    """Return a label as it is written inside a sentence: people keep their capital."""
    return label if label.startswith(PEOPLE) else f"{label[0].lower()}{label[1:]}"


def _label(key: str, doc: str) -> str:
    """Return the first phrase of a sentence as a label; the key where the sentence explains words to choose from."""
    first = first_phrase(doc)
    explains = doc[len(first) :].startswith(": ") and " " not in first
    label = spaced(key) if explains else first
    return f"{label[0].upper()}{label[1:]}"


def _help(doc: str) -> str:
    """Return the explanation of a parameter as a sentence, with the words that the forms show in place of a file's."""
    text = SHORT.sub(lambda short: short[0].upper(), KEY_ALONE.sub(lambda key: spaced(key[0]), doc)).replace("`", "")
    return f"{text[0].upper()}{text[1:]}."


def spaced(word: str) -> str:
    """Return a word of a case file as the forms show it: "own mode", "FM"."""
    return SHORT.sub(lambda short: short[0].upper(), word.replace("_", " "))


def _bounds(quantity: ParameterQuantity) -> str:
    words = []
    for name, sign in BOUNDS.items():
        bound = getattr(quantity, name)
        if bound is not None:
            words.append(f"{sign} {bound if isinstance(bound, str) else _plain(bound, quantity.unit)}")
    text = " and ".join(words)
    return f" {text[0].upper()}{text[1:]}." if text else ""


def _plain(bound: float, unit: str) -> str:
    return f"{bound:,.12g}" if unit == "1" else show(bound, unit)


def _shapes(annotation: object, quantity: ParameterQuantity | None) -> list[Shape]:
    parts = get_args(annotation) if get_origin(annotation) in (Union, types.UnionType) else (annotation,)
    parts = tuple(get_args(part)[0] if get_origin(part) is Annotated else part for part in parts)
    parts = tuple(part for part in parts if part is not type(None))
    shapes: list[Shape] = []
    for part in parts:
        shapes += _part(part, quantity, alone=len(parts) == 1)
    # a number or text for one value: the text covers both
    kinds = [shape.kind for shape in shapes]
    if "text" in kinds and "number" in kinds:
        shapes = [shape for shape in shapes if shape.kind != "number"]
    return shapes


def _part(part: Any, quantity: ParameterQuantity | None, alone: bool) -> list[Shape]:
    if get_origin(part) is Literal:
        words = tuple(map(str, get_args(part)))
        if alone:
            return [Shape("choice", words=words)] if len(words) > 1 else []
        return [Shape("word", label=word, words=(word,)) for word in words]
    if get_origin(part) is tuple:
        inner = get_args(part)[0]
        if _is_parameters(inner):
            return [Shape("tables", label="list", model=inner)]
        return [Shape("numbers", label="list of values")] if quantity is not None else [Shape("texts")]
    if _is_parameters(part):
        first, more = list(part.keys())[:2], len(part.keys()) > 2
        label = str(getattr(part, "title", "")) or spaced(", ".join(first)) + " ..." * more
        return [Shape("table", label=label, model=part)]
    if quantity is not None:
        return [Shape("quantity", label="one value")]
    return [Shape({bool: "switch", int: "whole", float: "number"}.get(part, "text"))]


def _is_parameters(part: object) -> bool:
    return inspect.isclass(part) and issubclass(part, Parameters)


def start_of(model: type[Parameters], typed: object) -> dict[str, Any]:
    """Return a table to start a form with: typical values, and earlier input of their type under the same name."""
    known, typical = typed if isinstance(typed, Mapping) else {}, model.example
    fits = [key for key in model.keys() if key in known and isinstance(known[key], type(typical.get(key, known[key])))]  # noqa: SIM118
    return {**typical, **{key: known[key] for key in fits}}


def name_of(model: type[Parameters]) -> str:
    """Return the name of a class as words: its title, or else its name, such as "Generalized Maxwell"."""
    title = str(getattr(model, "title", ""))
    return title or re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", model.__name__)


def first_line(model: type[Parameters]) -> str:
    """Return the first sentence of a class's documentation."""
    return first_sentence(model.__doc__ or "")


def carried(given: Mapping[str, object], model: type[Parameters], keys: tuple[str, ...]) -> dict[str, Any]:
    """Return the values that another way takes over: single values as the first item of a list, or the first item."""
    found: dict[str, Any] = {}
    listed = [
        value[0] for value in given.values() if isinstance(value, list) and value and isinstance(value[0], Mapping)
    ]
    source = {**given, **(listed[0] if listed else {})}
    for field in fields(model):
        if field.key not in keys:
            continue
        shape = field.shapes[0]
        if shape.kind == "tables" and shape.model is not None:
            found[field.key] = [start_of(shape.model, source)]
        elif shape.kind == "table":
            found[field.key] = start_of(shape.model, {}) if shape.model is not None else {}
        elif field.key in source:
            found[field.key] = source[field.key]
    return found


# the error of a force that lacks a value, of its own or of the instrument
NEEDS = re.compile(r"(\w+) needs ([\w.]+), which is missing(?:; write .* under \[\w+\])?")
ABOUT = re.compile(r"(\w+(?:\.\w+)+)(?: \([^)]*\))? (?:= )?(.*)", re.DOTALL)

PATH = re.compile(rf"\b(?:{'|'.join(df.Case.model_fields)})(?:\.\w+)+")
CHOICE = re.compile(r'(?:\w+\.)*(\w+) = "([^"]*)"(?: under \[\w+\])?')
SECTION = re.compile(r"(?: under)? \[\w+(?:\.\w+)*\]")
COMMAND = re.compile(r" ?\(df\.\w+\)| dforce \w+ --\w+[^.]*\.")
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
        model = df.forces.REGISTRY[needs[1]]
        own = {field.key: field.label for field in fields(model)}
        label = own.get(needs[2]) or label_of(document, tuple(needs[2].split(".")))
        return f"the force {name_of(model)} needs a value for: {label or needs[2]}"
    about = ABOUT.fullmatch(text)
    label = label_of(document, path_of(document, text)) if about is not None else ""
    if about is not None and label:
        if about[2] == "is missing":
            return f"{label}: a value is missing"
        rest = about[2] if "'" in about[2] else plain(about[2])  # input is quoted, and stays
        return f"{label} {rest}" if rest.startswith(("is ", "has ")) else f"{label}: {rest}"
    first, _, rest = text.partition(" ")
    named = df.forces.REGISTRY.get(first)
    if named is None:
        return plain(text)
    labels = {field.key: within_sentence(field.label) for field in fields(named)}
    return f"the force {name_of(named)} {KEY.sub(lambda key: labels.get(key[0], spaced(key[0])), rest)}"


def with_labels(document: Document, text: str) -> str:
    """Return a piece of advice in the words of the window: labels, and names of models and quantities, instead of keys."""

    def label(path: re.Match[str]) -> str:
        found = label_of(document, path_of(document, path[0]))
        return f"“{found}”" if found else path[0]

    text = CHOICE.sub(lambda found: f"“{spaced(found[1])}: {spaced(found[2])}”", PATH.sub(label, text))
    return capitalized(plain(SECTION.sub("", text)))


def plain(text: str) -> str:
    """Return a text with names for readers in the place of the keys of models, quantities and parameters."""
    text = COMMAND.sub("", text)
    return KEY.sub(lambda found: _word(found[0]), MODEL.sub(lambda found: name_of(df.forces.REGISTRY[found[0]]), text))


def with_models(text: str) -> str:
    """Return a text with the names of all force models in the place of their keys."""
    models = df.forces.REGISTRY
    return re.sub(r"\w+", lambda found: name_of(models[found[0]]) if found[0] in models else found[0], text)


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
