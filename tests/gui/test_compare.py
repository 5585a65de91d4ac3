"""What differs between results, and what they are called."""

from __future__ import annotations

import functools

import dforce as df
from dforce.gui.document.document import DATA, KeptResult
from dforce.gui.document.store import color_of, differences, name_of


@functools.cache
def result(*settings):
    return df.run(df.example("figure-3-air").set("experiment.zc.points=5", *settings))


def test_only_what_differs_is_listed_with_symbol_and_units():
    rows = differences([result(), result("sample.youngs_modulus=2 GPa")])
    assert [(row.path, row.symbol, row.values) for row in rows] == [
        ("sample.youngs_modulus", "E_s", ("1 GPa", "2 GPa"))
    ]


def test_a_parameter_that_a_case_lacks_is_a_dash():
    other = df.run(df.example("figure-3-water").set("experiment.zc.points=5"))
    row = next(
        row for row in differences([result(), other]) if row.path == "forces.hertz.radius" or "forces.dmt" in row.path
    )
    assert "–" in row.values


def test_the_same_twice_differs_in_nothing():
    assert differences([result(), result()]) == []


def test_a_result_is_named_after_what_differs_from_the_one_before():
    assert name_of(result(), None, []) == "Figure 3 of the 2015 paper, in air"
    assert name_of(result("drive.A0=5 nm"), result(), []) == "A₀ = 5 nm"


def test_no_two_results_have_one_name():
    first = name_of(result(), None, [])
    assert name_of(result(), result(), [first]) == f"{first} (2)"


def test_the_next_color_is_one_that_is_not_used():
    assert color_of([KeptResult("a", "a", 2), KeptResult("b", "b", 4)]) == 3


def test_no_result_has_the_color_of_measured_points():
    kept = []
    for number in range(12):
        kept.append(KeptResult(str(number), str(number), color_of(kept)))
    assert DATA not in {one.color for one in kept}
