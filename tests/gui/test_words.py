"""Sentences in the words of the forms."""

from __future__ import annotations

import ast
import asyncio
import itertools
import re
from pathlib import Path

import pytest
from every import every
from simulated import window

import dforce as df
from dforce.core.parameters import Parameters
from dforce.gui.case.fields import fields, in_words, with_labels
from dforce.gui.document.document import Document, path_of
from dforce.gui.window import pages

AIR = Document.of(df.example("figure-3-air"))


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        (("tip", "radius"), None, "The force DMT needs a value for: Radius of the tip's apex"),
        (("forces", 0), {"model": "custom", "law": "-H*d"}, "The force Own law needs a value for: Hamaker constant"),
        (("drive", "A0"), None, "Free amplitude: a value is missing"),
        (("drive", "A0"), "3300 ft", "Free amplitude: 1005.84 m is above 1 mm"),
        (("drive", "A0"), "-1 nm", "Free amplitude: -1 nm is not above 0 nm"),
        (("forces", 0, "hamaker"), "-1 J", "DMT: Hamaker constant: -1 J is below 0 J"),
        (("experiment", "zc", "points"), -3, "Number of distances: -3 is below 1"),
    ],
)  # fmt: skip
def test_a_mistake_is_said_in_the_words_of_the_form(path, value, sentence):
    document = AIR.put(path, value)
    with pytest.raises(df.DForceError) as mistake:
        document.case()
    assert in_words(document, str(mistake.value)) == sentence
    assert path_of(document, str(mistake.value))[: len(path)] == path  # the field at which it stands


def values_of(table, path=()):
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        if isinstance(value, dict | list):
            yield from values_of(value, (*path, key))
        elif path and path[0] not in ("about", "data", "fit") and key not in ("kind", "model", "of"):
            yield (*path, key)


def with_force(model):
    return AIR.put(("forces",), [{"model": model.name, **model.example}])


DOCUMENTS = [*(Document.of(df.example(name)) for name in df.examples()), *map(with_force, df.forces.REGISTRY.values())]
PLACES = [(document, path) for document in DOCUMENTS for path in values_of(document.table)] + [
    (AIR, ("tip", "youngs_modulus"))
]


@every(itertools.product(PLACES, (None, "-1 J", "", "nonsense", "1e300", -1.0, True)))
def test_no_mistake_in_a_field_is_said_in_words_of_the_file(place, value):
    document, path = place
    wrong = document.put(path, value)
    try:
        wrong.case()
    except (df.DForceError, TypeError) as mistake:
        said = in_words(wrong, str(mistake))
        assert not re.search(r"\b[a-z]+\.[a-zA-Z_]+|\[[a-z]+\]|[a-z]_[a-z]", said), said
        assert not said[0].islower(), said


def classes(models):
    """Give classes of parameters, and those of the tables in them."""
    for model in models:
        yield model
        yield from classes(shape.model for field in fields(model) for shape in field.shapes if shape.model is not None)


SECTIONS = [info.annotation for info in df.Case.model_fields.values()]


MODELS = [
    *(one for one in SECTIONS if isinstance(one, type) and issubclass(one, Parameters)),
    *df.experiments.EXPERIMENTS.values(),
    *df.forces.REGISTRY.values(),
]


@every(dict.fromkeys(classes(MODELS)))
def test_no_field_is_explained_in_words_of_the_file(model):
    for field in fields(model):
        shown = [field.label, field.help, *(shape.label for shape in field.shapes)]
        assert not [text for text in shown if re.search(r"(?<![.\w])[a-zA-Z]+_[a-z]|`|\de\+", text)]


def test_advice_names_fields_by_their_labels():
    advice = "Raise solver.points_per_period to 1024, or tip.radius, see forces.1.hamaker; not medium.nothing."
    assert with_labels(AIR, advice) == (
        "Raise “Samples per period of the first tone” to 1024, or “Radius of the tip's apex”, see “DMT: Hamaker constant”; "
        "not medium.nothing."
    )


def test_advice_names_a_kind_of_experiment_as_the_form_does():
    assert with_labels(AIR, 'avoid this range; experiment.kind = "basins" shows their shares.') == (
        "Avoid this range; “kind: basins” shows their shares."
    )


def test_advice_of_a_fit_names_no_command():
    advice = "The value is meaningless and has no error. dforce fit --identify finds a measurement that constrains it."
    assert with_labels(AIR, advice) == "The value is meaningless and has no error."


@pytest.mark.parametrize(("value", "words"), [("-1 nm", "-1 nm is not above 0 nm"), (None, "a value is missing")])
def test_run_with_a_mistake_says_why_nothing_is_run(tmp_path, monkeypatch, value, words):
    said = []
    monkeypatch.setattr(pages, "say", said.append)

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.view.edit(page.view.document.put(("drive", "A0"), value))
            user.find("Run").click()
            while not said:
                await asyncio.sleep(0.01)
            assert said == [f"Nothing was run. Free amplitude: {words}."]
            assert page.view.session.job is None

    asyncio.run(flow())


def templates(path):
    """Give the sentences in the code of a file, with 1 in the place of what is filled in."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    documented = (ast.Module, ast.FunctionDef, ast.ClassDef)
    docs = {ast.get_docstring(node, clean=False) for node in ast.walk(tree) if isinstance(node, documented)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant | ast.JoinedStr):
            parts = [node] if isinstance(node, ast.Constant) else node.values
            text = "".join(str(part.value) if isinstance(part, ast.Constant) else "1" for part in parts)
            if text.count(" ") >= 5 and text not in docs:
                yield text


@pytest.mark.parametrize("name", ["hysteresis", "figure-6"])  # a lever with one mode, and with two
def test_no_advice_has_words_of_the_file(name):
    root, document = Path(df.__file__).parent, Document.of(df.example(name))
    files = [
        *(root / "validity").glob("*.py"),
        root / "inverse" / "fitting" / "advice.py",
        root / "findings" / "answer.py",
    ]
    sentences = [text for file in files for text in templates(file)]
    assert len(sentences) > 50
    for text in sentences:
        said = with_labels(document, text)
        assert not re.search(r"\b[a-z]+\.[a-zA-Z_]+|\[[a-z]+\]|[a-z]_[a-z]", said), said
