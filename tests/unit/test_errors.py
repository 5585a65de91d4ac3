"""The hints in sentences about names."""

from __future__ import annotations

import pytest

import dforce as df
from dforce.core.errors import nearest


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("figure3", "figure-3-air"), ("figure 3 water", "figure-3-water"), ("FIGURE-4", "figure-4-hard"),
        ("figure7", "figure-7-low"), ("figure-3-airr", "figure-3-air"), ("figur-6", "figure-6"),
        ("resonance", "resonance-curve"), ("table1bimodal", "table-1-bimodal"),
    ],
)  # fmt: skip
def test_the_name_that_begins_alike_is_suggested_before_one_of_like_length(name, meant):
    with pytest.raises(df.ParameterError, match=f"did you mean '{meant}'"):
        df.example(name)


def test_a_letter_or_two_begin_too_many_names_to_suggest_one():
    assert nearest("f", df.examples()).startswith("; known: ")
