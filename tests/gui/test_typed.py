"""What people type into fields."""

from __future__ import annotations

import pytest

import dforce as df
from dforce.gui.case.values import composed, in_unit, taken_apart


@pytest.mark.parametrize(
    ("text", "unit", "meant"),
    [
        ("10", "nm", "10 nm"), ("0,5", "nm", "0.5 nm"), (",5", "nm", "0.5 nm"), ("10 um", "nm", "10 um"),
        ("1e-9", "m", "1e-9 m"), ("1,5e3", "Hz", "1.5e3 Hz"), ("255", "1", "255"), ("0,165", "nm", "0.165 nm"),
        ("-3", "mV", "-3 mV"), ("4e", "nm", "4e"), ("", "nm", ""),
    ],
)  # fmt: skip
def test_a_number_takes_the_unit_beside_it_unless_it_brings_one(text, unit, meant):
    assert composed(text, unit) == meant


def test_a_comma_that_may_separate_thousands_is_refused():
    with pytest.raises(df.ParameterError, match="thousands"):
        composed("1,000", "nm")


def test_a_text_is_shown_as_number_and_unit():
    assert taken_apart("10 nm", "m") == ("10", "nm")
    assert taken_apart("10", "1") == ("10", "1")
    assert taken_apart("abc", "nm") == ("abc", "nm")


@pytest.mark.parametrize(
    ("text", "old", "new", "stored", "shown"),
    [("10", "nm", "um", "m", "0.01"), ("25", "degC", "K", "K", "298.15"), ("x", "nm", "um", "m", "x")],
)
def test_another_unit_shows_the_same_quantity(text, old, new, stored, shown):
    assert in_unit(text, old, new, stored) == shown
