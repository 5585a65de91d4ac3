"""Forms know every parameter from its declaration."""

from __future__ import annotations

import asyncio
import json
import re

import pytest
from every import every
from simulated import window

import dforce as df
from dforce.core.units import parse
from dforce.gui.case.fields import fields, name_of, spaced, start_of, with_models, within_sentence
from dforce.gui.case.values import check, read, shown, units_of, usual_unit
from dforce.gui.document.document import Document

MODELS = [
    df.Cantilever, df.Mode, df.Beam, df.Drive, df.Tone, df.Medium, df.Tip, df.Sample, df.Contact, df.SolverSettings,
    *df.experiments.EXPERIMENTS.values(), *df.forces.REGISTRY.values(),
]  # fmt: skip
FIELDS = [(model, field) for model in MODELS for field in fields(model)]


def named(case):
    return f"{case[0].__name__}.{case[1].key}"


@every(MODELS)
def test_every_parameter_that_a_user_may_give_has_a_field(model):
    shown_keys = {field.key for field in fields(model)}
    assert shown_keys == {key for key in model.keys() if key != "kind"}  # noqa: SIM118


@every(FIELDS, named)
def test_every_field_has_a_short_label_and_a_sentence(model, field):
    assert 0 < len(field.label) < 70
    assert field.help.endswith(".")
    assert field.label[0] == field.label[0].upper()
    assert all(shape.kind for shape in field.shapes)


@every(FIELDS, named)
def test_no_label_is_a_word_of_the_file(model, field):
    words = re.findall(r"[\w']+", field.label.lower())
    assert words[0] not in ("path", "zc", "settle", "inside", "variant", "record", "acts", "fm")
    assert "_" not in field.label
    if field.shapes[0].kind == "choice" and field.label.lower() == field.key.replace("_", " "):
        assert field.key in (
            "method",
            "integrator",
            "direction",
            "operation",
        )  # words of the field as well as of the file


@every([case for case in FIELDS if case[1].quantity is not None], named)
def test_every_unit_offered_measures_the_quantity(model, field):
    for unit in units_of(field, usual_unit(field)):
        text = "1" if unit == "1" else f"1 {unit}"
        assert parse(text, field.unit) >= 0.0


@pytest.mark.parametrize("name", list(df.experiments.EXPERIMENTS))
def test_every_experiment_starts_with_values_that_suit_the_instrument(name):
    case = df.example("figure-3-air")
    kind = df.experiments.EXPERIMENTS[name]
    assert case.replace(experiment=kind(**kind.suggested(case.problem))).experiment.kind == name


@every(list(df.forces.REGISTRY))
def test_every_force_starts_with_values_that_it_accepts(name):
    model = df.forces.REGISTRY[name]
    assert model(**model.example)


def field(model, key):
    """Return one field of a model."""
    return next(found for found in fields(model) if found.key == key)


@pytest.mark.parametrize(
    ("typed", "unit", "sentence"),
    [
        ("5", "nm", ""), ("0,5", "um", ""), ("-1", "nm", "is not above 0 nm"), ("2", "m", "is above 1 mm"),
        ("5 GPa", "nm", "which is a pressure or modulus, not a length"), ("abc", "nm", "not a number with a unit"),
        ("3300", "ft", "1005.84 m is above 1 mm"), ("1,000", "nm", "the comma may mean"),
    ],
)  # fmt: skip
def test_a_field_says_at_once_what_is_wrong_with_it(typed, unit, sentence):
    A0 = field(df.Tone, "A0")
    said = check(A0, A0.shapes[0], read(A0, A0.shapes[0], typed, unit))
    assert sentence in said
    assert bool(said) == bool(sentence)


def test_a_field_that_needs_a_value_says_so():
    k = field(df.Mode, "k")
    assert "this needs a value" in check(k, k.shapes[0], read(k, k.shapes[0], "", "N/m"))


def test_a_list_of_values_is_typed_with_semicolons():
    zc = field(df.experiments.EXPERIMENTS["approach"], "zc")
    numbers = next(shape for shape in zc.shapes if shape.kind == "numbers")
    assert read(zc, numbers, "12; 11,5; 1000 pm", "nm") == ["12 nm", "11.5 nm", "1000 pm"]
    assert shown(zc, ["12 nm", "11.5 nm"]) == ("12; 11.5", "nm")


def test_a_number_of_a_case_without_a_unit_is_shown_in_si():
    assert shown(field(df.Mode, "f0"), "70") == ("70", "Hz")
    assert shown(field(df.Mode, "Q"), "70") == ("70", "1")
    assert shown(field(df.Mode, "f0"), "4e") == ("4e", "kHz")  # typed halfway


def test_a_whole_number_stays_one():
    points = field(df.experiments.Grid, "points")
    assert read(points, points.shapes[0], "221", "") == 221
    assert "whole number" in check(points, points.shapes[0], read(points, points.shapes[0], "2.5", ""))


@pytest.mark.parametrize("typed", ["9" * 30, "1e400", "-1e300", "1e999", "inf", "nan", "-inf"])
@pytest.mark.parametrize("key", ["max_periods", "settle_tolerance"])
def test_a_number_that_cannot_be_kept_stays_a_text_and_is_said(typed, key):
    one = field(df.SolverSettings, key)
    value = read(one, one.shapes[0], typed, "")
    assert value == typed
    assert check(one, one.shapes[0], value)
    plain = Document.first().put(("solver", key), value).to_plain()
    assert Document.from_plain(json.loads(json.dumps(plain))).value(("solver", key)) == typed


def test_names_of_models_are_words():
    assert name_of(df.forces.KelvinVoigt) == "Kelvin–Voigt"
    assert name_of(df.forces.DMT) == "DMT"


def test_people_keep_their_capital_inside_a_sentence():
    assert within_sentence("Free amplitude") == "free amplitude"
    assert within_sentence("Hamaker constant") == "Hamaker constant"


def test_modes_of_operation_are_written_as_people_write_them():
    assert [spaced(word) for word in ("am", "ce_fm", "own_mode")] == ["AM", "CE FM", "own mode"]
    (field,) = (field for field in fields(df.Drive) if field.key == "operation")
    assert field.help.startswith("AM: constant drive")


def test_forces_have_their_names_where_something_is_compiled():
    assert with_models("Compiling the tip equation for custom + dmt") == "Compiling the tip equation for Own law + DMT"


@pytest.mark.parametrize("name", df.examples())
def test_no_example_shows_an_error_at_its_fields(tmp_path, name):
    """Distances as shares of A0 were shown in meters, beyond their bounds."""

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            page.view.open(Document.of(df.example(name)))
            entries = {path: entry.props.get("error") for path, (_, _, entry) in page.forms.shown.items()}
            assert {path: error for path, error in entries.items() if error} == {}

    asyncio.run(flow())


def test_distances_as_shares_of_the_free_amplitude_can_be_chosen_in_place_of_lengths():
    zc = next(field for field in fields(df.experiments.Approach) if field.key == "zc")
    shape = zc.shapes[2]
    assert [one.label for one in zc.shapes] == ["start, stop ...", "list of values", "shares of A0"]
    start = start_of(shape.model, {"start": "23 nm", "stop": "9 nm", "points": 31})
    assert start["points"] == 31 and zc.shape_of(start) == shape
    df.example("hysteresis").replace("experiment.zc", start)
