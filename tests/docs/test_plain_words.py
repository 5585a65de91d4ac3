"""Users' sentences are plain: none has a pattern that is refused, and none is longer than 30 words."""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import re
import tokenize
import tomllib
from pathlib import Path

from every import every
from plain_words import Sentence, blocks, faults, of_page, of_script, of_source, sentences

import dforce as df
from dforce.core.parameters import Parameters

ROOT = Path(__file__).parents[2]
EXCEPTIONS = tomllib.loads(Path(__file__).with_name("plain_words_exceptions.toml").read_text(encoding="utf-8"))[
    "exception"
]
MOST_EXCEPTIONS = 40
MADE = ("_build", "generated", "forces", "tutorials", "paper")  # folders of docs that a build writes
PLAIN_CASES = ("title", "shows", "unsaid")  # what a shipped case shows to users


def pages():
    """Give the sentences of the README, of CONTRIBUTING and of the pages."""
    for name in ("README.md", "CONTRIBUTING.md"):
        yield from of_page(ROOT / name, ROOT)
    for path in sorted((ROOT / "docs").rglob("*.md")):
        if not set(MADE) & set(path.relative_to(ROOT / "docs").parts) and path.name != "validation.md":
            yield from of_page(path, ROOT)


def made_pages():
    """Give the sentences that a build of the documentation writes into its pages."""
    for path in sorted((ROOT / "docs" / "_ext").rglob("*.py")):
        yield from of_source(path, ROOT)


def scripts():
    """Give the sentences of the tutorials and of the paper's figures."""
    for path in sorted((ROOT / "examples").rglob("*.py")):
        yield from of_script(path, ROOT)


def texts():
    """Give the sentences of advice, errors, help and meanings of parameters: of every text in the program."""
    for path in sorted((ROOT / "src" / "dforce").rglob("*.py")):
        yield from of_source(path, ROOT)


def helps():
    """Give the sentences of the commands' help: the docstrings of the files of the command line."""
    for path in sorted((ROOT / "src" / "dforce" / "cli").glob("[a-z]*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                for _, block in blocks(ast.get_docstring(node) or ""):
                    yield from (Sentence(path.name, node.lineno, sentence) for sentence in sentences(block))


def cases():
    """Give the sentences of the shipped cases."""
    for path in sorted((ROOT / "src" / "dforce" / "library" / "examples").rglob("*.toml")):
        case = tomllib.loads(path.read_text(encoding="utf-8"))
        for text in (case.get("title"), *(case.get("about", {}).get(key) for key in PLAIN_CASES)):
            yield from (Sentence(path.name, 1, sentence) for sentence in sentences(text or ""))


def public_objects():
    """Give the objects of the page of the Python reference, the force models, and the tables of a case file, by name."""
    module = "dforce"
    for line in (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8").splitlines():
        if (found := re.match(r"\.\. currentmodule:: (\S+)", line)) is not None:
            module = found[1]
        elif (found := re.match(r" {3}([\w.]+)$", line)) is not None:
            thing = importlib.import_module(module)
            for part in found[1].split("."):
                inner = getattr(thing, part, None)
                thing = importlib.import_module(f"{thing.__name__}.{part}") if inner is None else inner
            yield f"{module}.{found[1]}", thing
    yield from ((f"dforce.forces.{model.__name__}", model) for model in df.forces.REGISTRY.values())
    yield from ((f"{one.__module__}.{one.__name__}", one) for one in below(Parameters))  # the page of a case file


def below(kind):
    """Give the classes that derive from a class and have no other class below them."""
    for one in kind.__subclasses__():
        yield from below(one) if one.__subclasses__() else [one]


def docstrings():
    """Give the sentences in the docstrings of public names."""
    for name, thing in public_objects():
        members = {key: value for key, value in vars(thing).items() if key[0] != "_"} if isinstance(thing, type) else {}
        for where, one in {name: thing, **{f"{name}.{key}": value for key, value in members.items()}}.items():
            one = one.__func__ if isinstance(one, classmethod | staticmethod) else getattr(one, "fget", one)
            own = vars(one).get("__doc__") if isinstance(one, type) else getattr(one, "__doc__", None)
            if own and getattr(one, "__module__", "").startswith("dforce"):
                for line, block in blocks(inspect.cleandoc(own)):
                    yield from (Sentence(where, line, sentence) for sentence in sentences(block))


NAMELESS = re.compile(
    r"\b(?:what|th(?:at|ose) of|those that|the ones? that|(?:who|what|which|where)ever)\b", re.IGNORECASE
)


def notes(path):
    """Give the docstrings and the comments of a source file, each with its line."""
    with path.open("rb") as file:
        for token in tokenize.tokenize(file.readline):
            if token.type == tokenize.COMMENT or token.string.startswith(('"""', 'r"""')):
                yield token.start[0], token.string


def test_docstrings_and_comments_name_the_thing():
    files = [
        path for folder in ("src", "docs/_ext", "benchmarks", "examples") for path in (ROOT / folder).rglob("*.py")
    ]
    assert len(files) > 400
    found = [(path, line) for path in files for line, text in notes(path) if NAMELESS.search(text)]
    assert not found, "name the thing:\n" + "\n".join(f"{path.relative_to(ROOT)}:{line}" for path, line in found)


ROOMS = (pages, made_pages, scripts, texts, helps, cases, docstrings)


@functools.cache
def read(room):
    """Return the sentences of a room, each with the patterns that it has."""
    return [(sentence, faults(sentence.text)) for sentence in room()]


def is_let_pass(sentence):
    return any(one["place"] == sentence.place and sentence.text.startswith(one["start"]) for one in EXCEPTIONS)


@every(ROOMS, lambda room: room.__name__)
def test_every_sentence_is_plain(room):
    said = read(room)
    assert len(said) > 30, f"{room.__name__} is empty: the check looks in the wrong place"
    found = [(sentence, wrong) for sentence, wrong in said if wrong and not is_let_pass(sentence)]
    assert not found, "\n".join(f"{s.place}:{s.line}: {', '.join(wrong)}: {s.text}" for s, wrong in found)


def test_the_pages_have_shorter_sentences():
    found = [s for s, _ in read(pages) if faults(s.text, longest=27) and not is_let_pass(s)]
    assert not found, "\n".join(f"{s.place}:{s.line}: {s.text}" for s in found)


def test_each_exception_has_a_reason_and_is_needed():
    assert len(EXCEPTIONS) <= MOST_EXCEPTIONS
    wrong = [sentence for room in ROOMS for sentence, found in read(room) if found]
    for one in EXCEPTIONS:
        assert len(one["reason"].split()) > 3
        assert any(s.place == one["place"] and s.text.startswith(one["start"]) for s in wrong), one


@every(
    [
        ("In Python, with what a thermal tune told of the lever:", "what ... of"),
        ("The fit finds what it is.", "what it is"),
        ("This is different from what the formulas give.", "what as a noun"),
        ("What became of each case", "what as a subject"),
        ("The amplitude is that of the detector.", "that of"),
        ("Of these it takes those that repel.", "those that"),
        ("The file keeps values such as are needed.", "such as are"),
        ("The curve does not tell the force there.", "tells"),
        ("The report says so.", "says"),
        ("A fit knows only the slope.", "knows"),
        ("The value stands in the table.", "stands"),
        ("The unit is given in brackets.", "is given"),
        ("The tip moves otherwise than it deflects.", "otherwise than"),
        ("The matrix holds the other systems for whoever hosts the repository.", "whoever"),
        ("An earlier run of the very same case", "the very"),
        ("Read the unit and give it.", "give it"),
        (f"The tip {'moves up and down ' * 8}.", "34 words"),
    ]
)
def test_each_pattern_is_found(written, fault):
    assert fault in faults(written)


@every(
    [
        "What is the peak force of my lever?",
        "You may say which you prefer.",
        "If something is missing, dForce asks.",
        "Two errors: random (each point) and systematic (common to all).",
        "A standing wave has nodes.",
        "which parameters the curve does not constrain",
    ]
)
def test_plain_sentences_pass(written):
    assert faults(written) == []


def test_sentences_are_taken_out_of_markup():
    page = """# Title

Read `a.b` first. Then
fit [it](x.md):

- one item
  in two lines

```sh
what it is
```

| a | b |
| - | - |
| c d | e |
"""
    said = [sentence for _, block in blocks(page) for sentence in sentences(block)]
    assert said[:4] == ["Title", "Read CODE first.", "Then fit it:", "one item in two lines"]
    assert {"c d", "e"} <= set(said) and not any("what" in sentence for sentence in said)


def test_texts_are_joined_and_docstrings_left_out(tmp_path):
    path = tmp_path / "a.py"
    path.write_text(
        'def f(x):\n    """Say what it is of all."""\n    raise ValueError(f"the curve {x} has " "no free part of '
        'its own")\n'
    )
    assert [sentence.text for sentence in of_source(path, tmp_path)] == ["the curve VALUE has no free part of its own"]
