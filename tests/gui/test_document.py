"""The document: immutable edits, undoing, and where a sentence of dForce points."""

from __future__ import annotations

import json

import pytest

import dforce as df
from dforce.gui.document import Document, Slider, path_of

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


@pytest.mark.parametrize("plain", [None, {}, {"table": 3}, {"table": {}, "sliders": [1]}])
def test_what_is_no_document_is_refused_in_a_sentence(plain):
    with pytest.raises(df.CaseError, match="cannot be read"):
        Document.from_plain(plain)


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
