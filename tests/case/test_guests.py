"""A guest's case reads no file of the server: of each key that may hold text it is known whether it names one."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, get_args

import pytest

import dforce as df
from dforce.core import files
from dforce.core.marks import FileName, Words, file_name, holds_text, words
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.parameters import Parameters, Shared, param
from dforce.experiments import EXPERIMENTS
from dforce.forces import REGISTRY

LEVER = {"f0": "48.9 kHz", "k": "0.9 N/m", "Q": 255}
AIR: dict[str, Any] = {"cantilever": LEVER, "drive": {"A0": "10 nm"}}
SECRET = "its 3rd cell is a secret"
REFUSED = "is a file on the server, and guests may not read it"


def models(annotation: Any) -> Iterator[type[Parameters]]:
    """Give the classes of parameters that an annotation mentions, and all those in their fields."""
    if isinstance(annotation, type) and issubclass(annotation, Parameters):
        yield annotation
        for field in annotation.model_fields.values():
            yield from models(field.annotation)
    for inner in get_args(annotation):
        yield from models(inner)


def keys() -> dict[str, Any]:
    """Return every key of every model of a case with its field, by the model's section and the key."""
    known = {*models(df.Case), *(m for kind in EXPERIMENTS.values() for m in models(kind))}
    known |= {force for force in REGISTRY.values() if force.__module__.startswith("dforce.forces.")}
    return {f"{model.section()}.{key}": field for model in known for key, field in model.model_fields.items()}


def test_every_key_that_may_hold_text_says_whether_it_names_a_file():
    # a case's own kinds and forces are chosen from lists; each class that can be chosen is in the list of models
    unsaid = [
        key
        for key, field in keys().items()
        if holds_text(field.annotation)
        and not isinstance(field.json_schema_extra, FileName | Words | ParameterQuantity | Shared)
        and key != "experiment.kind"  # of the class that all experiments are made from: each has a choice of one
    ]
    assert unsaid == []


def built(changes: Mapping[str, Any]) -> df.Case:
    return df.Case(**(AIR | changes))


# what a case holds so that the file named by a key is read; each is called with the file's name
READ = {
    "case.plugins": lambda name: built({"plugins": [name]}),
    "cantilever.library": lambda name: built({"cantilever": {"name": "mine", "library": name}}),
    "cantilever.drift.file": lambda name: built({"cantilever": LEVER | {"drift": {"file": name}}}),
    "sweep.rows": lambda name: df.sweep(
        built({"sweep": {"rows": name}, "experiment": {"kind": "dwell", "zc": "5 nm"}})
    ),
    "data.file": lambda name: df.fit(built({"data": {"file": name}, "fit": {"free": ["drive.A0"]}})),
}


@pytest.fixture
def guests(monkeypatch):
    """Let nobody but guests be there, whose plug-ins do not outlive a test."""
    monkeypatch.setattr(files, "guests_only", True)
    monkeypatch.setattr("dforce.forces._contract.REGISTRY", dict(REGISTRY))


def test_it_is_known_how_each_file_that_a_case_names_is_read():
    assert sorted(READ) == sorted(key for key, field in keys().items() if isinstance(field.json_schema_extra, FileName))


@pytest.mark.parametrize("key", READ)
def test_the_owner_of_the_computer_is_told_what_is_wrong_with_a_file(key, workdir):
    Path("there.csv").write_text(SECRET)
    Path("there.py").write_text(SECRET)
    ending = ".py" if key == "case.plugins" else ".csv"
    sentences = []
    for name in (f"there{ending}", f"missing{ending}"):
        with pytest.raises((df.DForceError, df.ForceError)) as raised:
            READ[key](name)
        sentences.append(str(raised.value).replace("missing", "there"))
    assert sentences[0] != sentences[1]
    assert not any(REFUSED in sentence for sentence in sentences)


def noting(function: Callable[..., Any], places: list[object]) -> Callable[..., Any]:
    """Return a function of the system that notes which place it looks at."""

    def noted(path: Any, *rest: Any, **more: Any) -> Any:
        places.append(path)
        return function(path, *rest, **more)

    return noted


@pytest.mark.parametrize("key", READ)
def test_a_guest_learns_no_cell_of_a_file_nor_whether_it_exists(key, workdir, monkeypatch, guests):
    for ending in (".csv", ".py"):
        Path(f"there{ending}").write_text(SECRET)
    looked_at: list[object] = []
    for function in ("stat", "open"):
        monkeypatch.setattr(os, function, noting(getattr(os, function), looked_at))
    sentences = []
    for name in ("there.csv", "missing.csv", str(workdir / "there.csv"), "../there.csv", "there.py", "/etc/passwd"):
        with pytest.raises(df.ParameterError) as raised:
            READ[key](name)
        sentences.append(str(raised.value))
    assert set(sentences) == {f"{key.removeprefix('case.')} {files.FOR_GUESTS}"}
    assert not [path for path in looked_at if str(path).endswith(("there.csv", "missing.csv", "there.py", "passwd"))]


@pytest.mark.parametrize("declared", ["file_name", "nothing", "path"])
def test_a_guest_may_not_name_a_file_for_a_plug_in_either(declared, guests):
    how = {"file_name": file_name("", description="a table"), "nothing": "", "path": Path()}[declared]
    space = {
        "__module__": "test_guests.plugin", "__annotations__": {"table": Path if declared == "path" else str, "size": float},
        "name": "of_a_table", "table": how, "size": param("1 nN", doc="size"),
        "law": staticmethod(lambda d, rate, t, size: size),
    }  # fmt: skip
    model = type("OfATable", (df.Force,), space)
    assert model(size="2 nN").size == 2e-9
    with pytest.raises(df.ParameterError, match=f"of_a_table.table {REFUSED}"):
        model(table="/etc/passwd")


def test_a_guest_may_set_words_of_a_plug_in(guests):
    space = {
        "__module__": "test_guests.plugin", "__annotations__": {"note": str}, "name": "of_words",
        "note": words("", description="a note"), "law": staticmethod(lambda d, rate, t: 0.0),
    }  # fmt: skip
    assert type("OfWords", (df.Force,), space)(note="as seen").note == "as seen"


def test_a_case_that_holds_what_its_library_says_is_open_to_guests(workdir, monkeypatch):
    Path("own.csv").write_text("name,f0,k,Q\nmine,48.9 kHz,0.9 N/m,255\n")
    case = built({"cantilever": {"name": "mine", "library": "own.csv"}})
    monkeypatch.setattr(files, "guests_only", True)
    assert df.Case.from_toml(case.to_toml()) == case


@pytest.mark.parametrize("name", list(df.examples()))
def test_every_example_is_open_to_guests(name, guests):
    assert df.Case.from_toml(df.example(name).to_toml()) == df.example(name)


def test_a_sweep_of_a_guest_reads_no_file_either(guests):
    case = built({"experiment": {"kind": "dwell", "zc": "5 nm"}})
    with pytest.raises(df.ParameterError, match=REFUSED):
        df.sweep(case, over={"cantilever": [{"name": "mine", "library": "own.csv"}, LEVER]})
