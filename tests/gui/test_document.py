"""The document: immutable edits, undoing, and where a sentence of dForce points."""

from __future__ import annotations

import json

import pytest
from every import every

import dforce as df
from dforce.gui.document.document import Document, Slider, path_of

WATER = "figure-3-water"
AIR = Document.of(df.example("figure-3-air"))


@pytest.mark.parametrize("name", list(df.examples()))
def test_the_document_of_every_example_gives_the_same_case(name):
    case = df.example(name)
    assert Document.of(case).case() == case


def test_a_document_survives_json():
    document = Document.of(df.example(WATER)).switch(0, False)
    document = document.choose(("experiment",), "approach", "dwell", {"kind": "dwell", "zc": "4 nm"})
    again = Document.from_plain(json.loads(json.dumps(document.to_plain())))
    assert again == document


def test_what_a_document_may_hold_is_read_off_its_class_once(monkeypatch):
    plain = AIR.to_plain()
    Document.from_plain(plain)
    monkeypatch.setattr("dforce.gui.document.document.TypeAdapter", None)
    assert Document.from_plain(plain) == AIR


@pytest.mark.parametrize("plain", [None, {}, {"table": 3}, {"table": {}, "sliders": [1]}])
def test_what_is_no_document_is_refused_in_a_sentence(plain):
    with pytest.raises(df.CaseError, match="cannot be read"):
        Document.from_plain(plain)


PLAIN = json.loads(json.dumps(Document.first().to_plain()))
KEPT = {"id": "0123456789abcdef", "name": "one", "color": 1, "shown": True}
PICTURE = {"x": "zc", "y": ["phase"], "together": False, "logarithmic": False}
SLIDER = PLAIN["sliders"][0]


def nested(depth):
    return {"a": nested(depth - 1)} if depth else 1


OUT_OF_BOUNDS = {
    "color": {"results": [KEPT | {"color": 10**30}]}, "negative color": {"results": [KEPT | {"color": -1}]},
    "color of no theme": {"results": [KEPT | {"color": 6}]}, "color as text": {"results": [KEPT | {"color": "1"}]},
    "name": {"results": [KEPT | {"name": "x" * 121}]}, "name of no text": {"results": [KEPT | {"name": ["x"]}]},
    "half a letter": {"results": [KEPT | {"name": "\ud800"}]}, "many results": {"results": [KEPT] * 51},
    "results as table": {"results": {"a": KEPT}}, "set point": {"set_point": float("nan")},
    "set point 1e400": {"set_point": 1e400},
    "picture of nothing": {"plots": [PICTURE | {"y": []}]}, "picture of letters": {"plots": [PICTURE | {"y": "phase"}]},
    "picture of numbers": {"plots": [PICTURE | {"x": 3}]}, "many pictures": {"plots": [PICTURE] * 11},
    "slider without range": {"sliders": [SLIDER | {"low": 3.0, "high": 3.0}]},
    "slider upside down": {"sliders": [SLIDER | {"low": SLIDER["high"] + 1.0}]},
    "slider without end": {"sliders": [SLIDER | {"high": 1e308}]},
    "slider of nothing": {"sliders": [SLIDER | {"low": float("nan")}]},
    "slider of no path": {"sliders": [SLIDER | {"path": [{"a": 1}]}]},
    "slider of a word": {"sliders": [SLIDER | {"path": "drive"}]},
    "slider before the first": {"sliders": [SLIDER | {"path": ["forces", -1, "hamaker"]}]}, "off": {"off": [10**30]},
    "off before the first": {"off": [-1]}, "off as text": {"off": "012"}, "table of lists": {"table": []},
    "number": {"table": {"cantilever": {"Q": 10**30}}}, "endless number": {"table": {"cantilever": {"Q": float("inf")}}},
    "text": {"table": {"title": "x" * 5000}}, "key": {"table": {"x" * 5000: 1}}, "deep": {"table": nested(50)},
    "deeper": {"aside": nested(900)}, "many forces": {"table": {"forces": [{"model": "dmt"}] * 5000}},
    "many values": {"table": {"a": [0] * 700_000}}, "aside": {"aside": [1]},
}  # fmt: skip


@every(OUT_OF_BOUNDS)
def test_a_document_out_of_bounds_is_refused_in_a_sentence(name):
    assert Document.from_plain(PLAIN) == Document.first()
    with pytest.raises(df.CaseError, match="cannot be read"):
        Document.from_plain(PLAIN | OUT_OF_BOUNDS[name])


@pytest.mark.parametrize("name", list(df.examples()))
def test_the_document_of_every_example_is_within_bounds(name):
    document = Document.of(df.example(name))
    assert Document.from_plain(document.to_plain()) == document


@pytest.mark.slow
def test_a_case_as_large_as_can_be_is_within_bounds():
    longest = AIR.case().replace("experiment.zc", [place / 1e9 for place in range(1, 200_000)])
    document = Document.of(longest)
    assert Document.from_plain(json.loads(json.dumps(document.to_plain()))) == document


def test_an_edit_leaves_the_document_before_as_it_was():
    before = AIR
    after = before.put(("drive", "A0"), "5 nm")
    assert (before.case().drive.A0, after.case().drive.A0) == (10e-9, 5e-9)


def test_nothing_at_a_path_takes_the_key_away():
    assert "poisson_ratio" not in AIR.put(("sample", "poisson_ratio"), None).table["sample"]


def test_a_force_that_is_switched_off_is_not_in_the_case():
    document = AIR.add(("forces",), {"model": "kelvin_voigt", "viscosity": "10 Pa s"})
    assert [force.name for force in document.case().forces] == ["dmt", "kelvin_voigt"]
    assert [force.name for force in document.switch(0, False).case().forces] == ["kelvin_voigt"]
    assert document.switch(0, False).switch(0, True) == document


def test_removing_a_force_moves_sliders_and_switches_behind_it():
    document = AIR.add(("forces",), {"model": "kelvin_voigt", "viscosity": "10 Pa s"}).switch(1, False)
    sliders = (Slider(("forces", 0, "hamaker"), 0.0, 1.0), Slider(("forces", 1, "viscosity"), 0.0, 1.0))
    document = Document(document.table, document.off, sliders=sliders).remove(("forces", 0))
    assert document.off == (0,)
    assert [slider.path for slider in document.sliders] == [("forces", 0, "viscosity")]


def test_what_was_typed_for_a_choice_comes_back_with_it():
    first = AIR
    typed = first.value(("experiment",))
    other = first.choose(("experiment",), "approach", "dwell", {"kind": "dwell", "zc": "4 nm"})
    assert other.case().experiment.kind == "dwell"
    assert other.choose(("experiment",), "dwell", "approach", {}).value(("experiment",)) == typed


@pytest.mark.parametrize(
    ("path", "value", "where"),
    [
        (("sample", "youngs_modulus"), "-1 GPa", ("sample", "youngs_modulus")),
        (("forces", 0, "hamaker"), "1 nm", ("forces", 0, "hamaker")),
        (("experiment", "zc", "start"), "x", ("experiment", "zc", "start")),
        (("cantilever", "Q"), None, ("cantilever", "Q")),
    ],
)
def test_a_mistake_is_found_at_its_field(path, value, where):
    document = AIR.put(path, value)
    with pytest.raises(df.DForceError) as mistake:
        document.case()
    assert path_of(document, str(mistake.value)) == where


def test_what_a_force_misses_is_found_at_the_field_that_lacks_it():
    document = AIR.put(("forces",), [{"model": "bottom_effect"}])
    with pytest.raises(df.DForceError, match="bottom_effect needs") as mistake:
        document.case()
    assert path_of(document, str(mistake.value)) == ("sample", "thickness")


def test_a_mistake_is_found_behind_a_force_that_is_switched_off():
    document = AIR.add(("forces",), {"model": "kelvin_voigt", "viscosity": "-1 Pa s"}).switch(0, False)
    with pytest.raises(df.DForceError) as mistake:
        document.case()
    assert path_of(document, str(mistake.value)) == ("forces", 1, "viscosity")


def test_plugins_of_an_opened_case_are_not_run():
    with pytest.raises(df.ParameterError, match="not run here"):
        AIR.put(("plugins",), ["evil.py"]).case()


def test_an_edited_example_states_its_result_and_its_figure_no_longer():
    document = Document.of(df.example("figure-7-high"))
    edited = document.put(("drive", "tones", 0, "A0"), "9 nm")
    assert (document.case().title, edited.case().title) == (document.title, f"{document.title}, edited")
    for text in (edited.case().to_toml(), edited.case().to_python("edited")):
        assert "distinguishes Hamaker constants" not in text and ", edited" in text
    assert edited.put(("title",), "My own").case().title == "My own"
    assert edited.put(("drive", "tones", 0, "A0"), document.value(("drive", "tones", 0, "A0"))).title == document.title
    assert Document.of(df.example("figure-3-air").replace(about=None)).put(("drive", "A0"), "9 nm").title == (
        df.example("figure-3-air").title
    )
