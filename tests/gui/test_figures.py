"""Figures of results: frames, axes, colors and dashes."""

from __future__ import annotations

import base64
import functools

import numpy as np
import pytest

import dforce as df
from dforce.gui.curves.chart import unit_of, unit_of_size
from dforce.gui.curves.figures import Layer, picture
from dforce.gui.curves.other_figures import basins, force_distance
from dforce.gui.document.document import DATA
from dforce.results.curves import Picture, pictures_of


@functools.cache
def result(name):
    return df.run(df.example(name))


def numbers(packed):
    return np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"])


def test_the_values_drawn_are_those_of_the_result_in_the_unit_of_the_axis():
    dataset = result("figure-3-air-jump")
    drawn = picture([Layer(dataset)], Picture("zc", ("amplitude",)))
    assert drawn.figure["layout"]["yaxis"]["title"]["text"] == "amplitude <i>A</i> (nm)"
    seen = numbers(drawn.figure["data"][0]["y"])  # with a gap at the jump
    np.testing.assert_allclose(seen[np.isfinite(seen)], 1e9 * dataset["amplitude"][:, 0, 0], rtol=1e-12)


def test_a_jump_is_dotted_from_the_point_before_it_to_the_point_behind_it():
    dataset = result("hysteresis")
    drawn = picture([Layer(dataset)], Picture("zc", ("phase",)))
    lines, dotted = ([trace for trace in drawn.figure["data"] if trace["meta"] == meta] for meta in ("phase", "jump"))
    assert len(dotted) == len(lines) == 2 and all(trace["line"]["dash"] == "dot" for trace in dotted)
    for number, (line, jump) in enumerate(zip(lines, dotted, strict=True)):
        zc, phase = dataset["zc"].values, dataset["phase"].values[:, number, 0]
        at = int(np.argmax(np.abs(np.diff(phase))))
        np.testing.assert_allclose(numbers(jump["x"])[:2], 1e9 * zc[[at, at + 1]])
        np.testing.assert_allclose(numbers(jump["y"])[:2], phase[[at, at + 1]])
        assert np.isnan(numbers(line["y"])[at + 1])
    assert drawn.traces[0][1].places[int(np.flatnonzero(np.isnan(numbers(lines[0]["y"])))[0])] == -1


def test_a_curve_without_a_jump_has_no_gap():
    drawn = picture([Layer(result("figure-3-water"))], Picture("zc", ("amplitude",)))
    assert all(trace["meta"] != "jump" and np.isfinite(numbers(trace["y"])).all() for trace in drawn.figure["data"])


def test_one_frame_stands_above_the_other_and_all_have_one_axis_across():
    layout = picture([Layer(result("figure-3-air-jump"))], Picture("zc", ("amplitude", "phase", "peak_force"))).figure[
        "layout"
    ]
    assert layout["yaxis"]["domain"][0] > layout["yaxis2"]["domain"][1] > layout["yaxis3"]["domain"][1]
    assert [name for name in layout if name.startswith("xaxis")] == ["xaxis"]


def test_one_line_across_all_frames_shows_names_values_and_units_at_one_distance():
    drawn = picture([Layer(result("figure-3-air-jump"))], Picture("zc", ("amplitude", "phase")))
    layout, words = drawn.figure["layout"], [trace.get("hovertemplate") for trace in drawn.figure["data"]]
    assert (layout["hovermode"], layout["hoversubplots"], layout["xaxis"]["spikemode"]) == (
        "x unified", "axis", "across",
    )  # fmt: skip
    assert layout["xaxis"]["unifiedhovertitle"]["text"] == "average tip–surface distance %{x:.4g} nm"
    assert "amplitude %{y:.4g} nm, approach<extra></extra>" in words
    assert "phase lag %{y:.4g} °, retract<extra></extra>" in words


def test_a_curve_over_no_axis_of_its_own_is_read_at_the_nearest_point():
    layout = picture([Layer(result("figure-3-air-jump"))], Picture("amplitude_ratio", ("phase",))).figure["layout"]
    assert layout["hovermode"] == "closest"


def test_together_quantities_of_one_unit_share_an_axis_and_others_have_their_own():
    wanted = Picture("zc", ("amplitude", "min_distance", "phase", "peak_force"), together=True)
    drawn = picture([Layer(result("figure-3-air-jump"))], wanted)
    axes = {trace["meta"]: trace["yaxis"] for trace in drawn.figure["data"]}
    assert axes["amplitude"] == axes["min_distance"] == "y"
    assert {axes["phase"], axes["peak_force"]} == {"y2", "y3"}
    assert drawn.figure["layout"]["yaxis2"]["side"] == "right"


def test_unstable_states_are_dashed_and_folds_marked():
    drawn = picture([Layer(result("figure-3-branches"))], Picture("zc", ("amplitude",)))
    dashes = {trace["name"]: trace["line"]["dash"] for trace in drawn.figure["data"] if "line" in trace}
    assert dashes == {"stable": "solid", "unstable": "dash"}
    assert [trace["name"] for trace in drawn.figure["data"] if trace["mode"] == "markers"] == ["fold"]


def test_several_results_have_a_color_each_and_one_that_lacks_the_quantities_is_left_out():
    layers = [
        Layer(result("figure-3-air-jump"), "a", 2),
        Layer(result("figure-3-branches"), "b", 3),
        Layer(result("table-1-am")),
    ]
    drawn = picture(layers, Picture("zc", ("phase",)))
    colors = {
        trace[0].name: data["line"]["color"]
        for trace, data in zip(drawn.traces, drawn.figure["data"], strict=True)
        if trace
    }
    assert colors == {"a": 2, "b": 3}


def test_of_several_results_the_legend_says_each_dash_once_in_gray():
    case = df.example("hysteresis")
    one_way = df.run(case.replace("experiment.direction", "approach"))
    drawn = picture([Layer(df.run(case), "a", 2), Layer(one_way, "b", 3)], Picture("zc", ("phase",)))
    named = [(trace["name"], trace["line"]["color"]) for trace in drawn.figure["data"] if trace["showlegend"]]
    assert named == [("approach", "soft"), ("retract", "soft"), ("jump", "soft")]


def test_no_line_of_the_model_has_the_color_of_measured_points():
    quantities = ("amplitude", "phase", "peak_force", "contact_time", "virial", "power")
    drawn = picture([Layer(result("figure-3-air-jump"))], Picture("zc", quantities, together=True))
    assert DATA not in {trace["line"]["color"] for trace in drawn.figure["data"]}


def test_no_force_has_a_unit_of_forces_at_the_tip():
    law = force_distance(df.force_curve(df.example("figure-3-air").replace(forces=[])))
    assert law["layout"]["yaxis"]["title"]["text"] == "force (nN)"


def test_zoom_is_kept_while_the_same_is_drawn_and_only_then():
    first, again = (
        picture([Layer(result(name))], Picture("zc", ("phase",))) for name in ("figure-3-air-jump", "figure-3-branches")
    )
    other = picture([Layer(result("figure-3-air-jump"))], Picture("zc", ("amplitude",)))
    kept = [drawn.figure["layout"]["uirevision"] for drawn in (first, again, other)]
    assert kept[0] == kept[1] != kept[2]


def test_names_of_results_are_never_html():
    layers = [Layer(result("figure-3-air-jump"), "<img src=x onerror=alert(1)>", n) for n in (1, 2)]
    texts = [
        str(trace.get("hovertemplate")) + str(trace.get("name"))
        for trace in picture(layers, Picture("zc", ("phase",))).figure["data"]
    ]
    assert not any("<img" in text for text in texts)


def test_nothing_in_common_is_said_in_a_sentence():
    drawn = picture([Layer(result("table-1-am"))], Picture("zc", ("phase",)))
    assert "Nothing to draw" in drawn.figure["layout"]["annotations"][0]["text"]


@pytest.mark.slow
def test_basins_have_a_color_for_each_state():
    drawn = basins(result("figure-3-basins"))
    *states, dots = drawn.figure["data"][1:]
    assert [trace["marker"]["color"] for trace in states] == [0, 1]
    assert sorted(text.rpartition(", ")[2] for text in dots["text"]) == ["attractive", "repulsive"]  # a dot for each
    assert {name for _, name in drawn.figure["data"][0]["colorscale"]} == {"grid", 0, 1}


@pytest.mark.parametrize(
    "name", ["figure-3-air-jump", "figure-3-branches", "resonance-curve", "table-1-am", "figure-6"]
)
def test_every_usual_picture_is_drawn(name):
    for wanted in pictures_of(result(name)):
        assert picture([Layer(result(name))], wanted).figure["data"]


def test_rounding_is_drawn_as_nothing_beside_a_quantity_of_the_same_unit():
    dataset = result("figure-3-air")
    small, large = (float(abs(dataset[name]).max()) for name in ("total_dissipated_energy", "total_virial"))
    assert small < 1e-6 * large  # the case is conservative
    layout = picture([Layer(dataset)], Picture("zc", ("total_virial", "total_dissipated_energy"))).figure["layout"]
    assert "range" not in layout["yaxis"]
    assert layout["yaxis2"]["range"][0] == -layout["yaxis2"]["range"][1] < 0.0


def test_the_unit_of_a_quantity_that_is_zero_everywhere_is_the_usual_one():
    dataset = result("figure-3-air")
    assert [unit_of(dataset[name])[1] for name in ("contact_time", "max_indentation")] == ["µs", "nm"]
    assert unit_of_size(0.0, "Hz", "frequency_shift") == (1.0, "Hz")  # as of shifts that are not zero


def test_the_parts_of_a_force_are_thin_lines_that_add_up_to_it():
    curve = df.force_curve(df.example("hysteresis"))
    figure = force_distance(curve, df.force_parts(curve))
    total, *parts = figure["data"]
    assert [part["name"] for part in parts] == ["van der Waals", "elastic contact"]
    assert np.allclose(sum(numbers(part["y"]) for part in parts), numbers(total["y"]), atol=1e-9)
    assert "van der Waals %{y:.3g} nN" in parts[0]["hovertemplate"]
    alone = df.force_curve(df.example("figure-4-soft"))  # one interaction has no parts
    assert len(force_distance(alone, df.force_parts(alone))["data"]) == 1
