"""Declared parameters: units, bounds, names, and the sentences that refuse the rest."""

import math

import pydantic
import pytest
from every import every

from dforce.core.errors import ParameterError, shorten
from dforce.core.parameters import Parameters, param, shared


class Knob(Parameters):
    """A thing with every kind of field."""

    size: float = param("2 nm", symbol="s", above="0 nm", high="1 um", doc="size of it")
    ratio: float = param(0.3, low=0.0, high=0.5, doc="a ratio")
    rate: float | None = param(None, unit="Hz", below="1 MHz", doc="how often")
    many: tuple[float, ...] = param((), unit="m", doc="several sizes")
    count: int = pydantic.Field(1, ge=1, le=10, description="how many")
    free: bool = False
    given: float = shared("tip.radius")


class Box(Parameters):
    """Holds knobs."""

    knob: Knob
    others: tuple[Knob, ...] = ()


def refusal(call, *args, **kwargs):
    with pytest.raises(ParameterError) as raised:
        call(*args, **kwargs)
    message = str(raised.value)
    assert "\n" not in message
    assert len(message) < 300
    return message


def test_text_with_a_unit_and_si_numbers_mean_the_same():
    assert Knob(size="5 nm") == Knob(size=5e-9)
    assert Knob().size == 2e-9
    assert Knob(many=["1 nm", 2e-9]).many == (1e-9, 2e-9)


def test_parameters_are_frozen():
    with pytest.raises(ParameterError, match=r"knob\.size cannot be changed"):
        Knob().size = 1.0


def test_replacing_makes_a_new_validated_object():
    knob = Knob()
    assert knob.replace(size="3 nm").size == 3e-9
    assert knob.size == 2e-9
    assert refusal(knob.replace, size=-1) == "knob.size = -1 m is not above 0 nm"


@every(
    [
        ({"size": "-2 nm"}, "knob.size = -2 nm is not above 0 nm"),
        ({"size": "0 nm"}, "knob.size = 0 m is not above 0 nm"),
        ({"size": "2 mm"}, "knob.size = 2 mm is above 1 um"),
        ({"size": "3300 ft"}, "knob.size = 1005.84 m is above 1 um"),
        ({"size": "1.0000000000001 um"}, "knob.size = 1.0000000000001 um is above 1 um"),
        ({"ratio": 0.6}, "knob.ratio = 0.6 is above 0.5"),
        ({"ratio": -0.1}, "knob.ratio = -0.1 is below 0"),
        ({"rate": "1 MHz"}, "knob.rate = 1 MHz is not below 1 MHz"),
        ({"size": math.nan}, "knob.size is nan, which is not a finite number"),
        ({"size": math.inf}, "knob.size is inf, which is not a finite number"),
        ({"size": True}, "knob.size is true, which is neither a number nor text"),
        ({"size": ["2 nm"]}, "knob.size = (2e-09,) is not a number"),
        ({"size": {}}, "knob.size = {} is not a number"),
        ({"size": "48.9 kHz"}, "which is a frequency, not a length (for example in nm)"),
        ({"many": ["1 nm", "2 V"]}, "knob.many is '2 V', which is a voltage, not a length"),
        ({"count": 0}, "knob.count = 0 is below 1"),
        ({"count": 11}, "knob.count = 11 is above 10"),
        ({"count": 1.5}, "knob.count = 1.5 is not a whole number"),
        ({"count": True}, "knob.count = true is not allowed here"),
        ({"count": "many"}, "knob.count = 'many' is not a whole number"),
        ({"free": "perhaps"}, "knob.free = 'perhaps' is neither true nor false"),
        ({"siez": 1}, "knob has no parameter 'siez'; did you mean 'size'?"),
        ({"xyz": 1}, "knob has no parameter 'xyz'; known: count, free, many, rate, ratio, size"),
        ({"x" * 100_000: 1}, "knob has no parameter 'xxx"),
        ({"given": 1}, "knob takes 'given' from the instrument: set tip.radius instead"),
    ]
)
def test_what_is_not_allowed_is_one_sentence_with_what_and_why(given, message):
    assert message in refusal(Knob, **given)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "box.knob is missing"),
        ({"knob": {"size": -1}}, "box.knob.size = -1 m is not above 0 nm"),
        ({"knob": {}, "others": [{}, {"size": -1}]}, "box.others.2.size = -1 m is not above 0 nm"),
        ({"knob": {}, "others": [{}, {"siez": 1}]}, "box.others.2 has no parameter 'siez'; did you mean 'size'?"),
        ({"knob": 3}, "box.knob = 3 is not a table of parameters"),
        ({"knob": {}, "others": 3}, "box.others = 3 is not a list"),
    ],
)
def test_a_mistake_inside_names_its_whole_path(given, message):
    assert refusal(Box, **given) == message


def test_a_schema_has_units_symbols_bounds_and_sentences():
    size = Knob.model_json_schema()["properties"]["size"]
    assert (size["unit"], size["symbol"], size["description"]) == ("m", "s", "size of it")
    assert size["anyOf"][0] == {"type": "number", "exclusiveMinimum": 0.0, "maximum": 1e-6}


def test_declarations_can_be_read_back():
    quantity = Knob.quantities()["size"]
    assert (quantity.unit, quantity.bounds()) == ("m", (0.0, 1e-6))
    assert Knob.quantities()["rate"].bounds() == (-math.inf, 1e6)
    assert Knob.shared_fields() == {"given": "tip.radius"}
    assert "given" not in Knob.keys()  # noqa: SIM118 the method of Parameters


def test_an_object_shows_itself_as_it_would_be_typed():
    assert repr(Knob(size=3e-9)) == "Knob(size='3 nm', ratio=0.3, count=1, free=False)"


@pytest.mark.parametrize("value", [10**5000, list(range(10**6)), "x" * 10**6, {"a": "b" * 10**6}], ids=shorten)
def test_a_huge_value_is_shortened_in_a_sentence(value):
    assert len(shorten(value)) <= 60
