"""What of a result can be drawn against what."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import dforce as df
from dforce.results.curves import drawable, lines_of, pictures_of


@functools.cache
def result(name):
    return df.run(df.example(name))


def test_a_curve_in_both_directions_has_a_line_for_each():
    dataset = result("figure-3-air-jump")
    there, back = lines_of(dataset, "zc", "amplitude")
    assert (there.direction, back.direction) == ("approach", "retract")
    np.testing.assert_array_equal(there.y, dataset["amplitude"].sel(direction="approach", tone=1))
    np.testing.assert_array_equal(back.y, dataset["amplitude"].sel(direction="retract", tone=1))


def test_each_point_of_a_line_leads_back_to_its_place_in_the_result():
    for name, x in (("figure-3-air-jump", "zc"), ("figure-3-branches", "zc"), ("figure-3-air-jump", "phase")):
        dataset = result(name)
        for line in lines_of(dataset, x, "amplitude"):
            for n in np.flatnonzero(line.places >= 0)[::9]:
                point = dataset.isel({line.row: int(line.places[n]), **line.chosen}).isel(tone=0)
                assert (float(point[x]), float(point["amplitude"])) == (line.x[n], line.y[n])


@pytest.mark.parametrize("name", ["table-1-am", "figure-3-air", "figure-3-branches"])
def test_the_motion_from_which_a_run_goes_on_is_no_quantity_to_draw(name):
    assert "motion" in result(name) and "motion" not in drawable(result(name))


def test_stable_and_unstable_states_are_apart_and_folds_are_marked():
    dataset = result("figure-3-branches")
    lines = {line.stable: line for line in lines_of(dataset, "zc", "amplitude")}
    # apart from where a piece reaches the next point, a line holds states of its kind alone
    for stable, line in lines.items():
        kinds = dataset["stable"].values[line.places[line.places >= 0]]
        assert (kinds == stable).mean() > 0.95
    marks = [mark for line in lines.values() for mark in line.marks.values()]
    assert marks.count("fold") == int((dataset["special"] == "fold").sum()) > 0


def test_the_tones_of_a_bimodal_curve_are_lines_of_their_own():
    dataset = result("figure-6").expand_dims(zc=[1e-9, 2e-9]).drop_dims(("time", "frequency"))
    assert [line.name for line in lines_of(dataset, "zc", "amplitude")] == ["tone 1", "tone 2"]


@pytest.mark.parametrize("name", ["figure-3-air-jump", "figure-3-branches", "resonance-curve", "table-1-am"])
def test_the_usual_pictures_can_be_drawn(name):
    pictures = pictures_of(result(name))
    assert len(pictures) >= 3
    for picture in pictures:
        assert [line for y in picture.y for line in lines_of(result(name), picture.x, y)]


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        ("zc", "amplitud", "did you mean 'amplitude'"),
        ("zc", "jump_zc", "no 'jump_zc'"),
        ("status", "phase", "no 'status'"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(x, y, words):
    with pytest.raises(df.ParameterError, match=words):
        list(lines_of(result("figure-3-air-jump"), x, y))


def test_quantities_along_different_dimensions_do_not_go_together():
    with pytest.raises(df.ParameterError, match="its values lie along time"):
        list(lines_of(result("table-1-am"), "frequency", "deflection"))
