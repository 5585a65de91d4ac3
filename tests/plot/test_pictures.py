"""Pictures of any quantities, of several results, and at a chosen width."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.results.curves import Picture, pictures_of
from dforce.results.significance import largest_error


@functools.cache
def result(*settings):
    return df.run(df.example("figure-3-air-jump").set("experiment.zc.points=23", *settings))


def test_the_lines_drawn_are_those_of_the_result_in_the_unit_of_the_axis():
    (axes,) = df.plot.draw(result(), Picture("amplitude", ("peak_force",)))
    first = axes.lines[0]
    np.testing.assert_allclose(first.get_xdata(), 1e9 * result()["amplitude"][:, 0, 0], rtol=1e-12)
    assert axes.get_xlabel() == "amplitude $A$ (nm)"


def test_several_results_have_a_color_and_a_name_in_the_legend_each():
    axes = df.plot.draw(
        {"soft": result(), "stiff $ as it is": result("sample.youngs_modulus=5 GPa")}, Picture("zc", ("phase",))
    )
    words = [text.get_text() for text in axes[0].get_legend().get_texts()]
    assert words == ["soft", r"stiff \$ as it is", "approach", "retract"]
    assert len({line.get_color() for line in axes[0].lines}) == 2


def test_each_of_many_results_has_a_color_of_its_own():
    layers = {str(number): result() for number in range(14)}
    axes = df.plot.draw(layers, Picture("zc", ("phase",)))
    assert len({line.get_color() for line in axes[0].lines}) == 14
    axes[0].figure.canvas.draw()
    [below] = axes[0].figure.legends  # so many lines would cover the axes
    assert below.get_window_extent().y1 < axes[0].get_window_extent().y0 and axes[0].get_legend() is None


def test_each_of_many_columns_of_a_result_has_a_color_of_its_own():
    one = result().isel(direction=[0], harmonic=slice(0, 1), missing_dims="ignore")
    many = one.drop_dims("harmonic").assign(
        high=one["amplitude"][..., 0] * xr.DataArray(np.arange(1.0, 10.0), dims="harmonic")
    )
    many["harmonic"] = np.arange(1, 10)
    (axes,) = df.plot.draw(many, Picture("zc", ("high",)))
    assert len({line.get_color() for line in axes.lines}) == len(axes.lines) == 9


@pytest.mark.parametrize(("points", "title"), [(8, ""), (14, ", 12 of 14 cases")])
def test_a_picture_of_a_sweep_draws_each_case_in_its_color_or_says_that_it_draws_some(points, title):
    case = df.example("figure-3-air-jump").set("experiment.zc.points=3", "experiment.direction=approach")
    sweep = df.sweep(case, {"sample.youngs_modulus": list(np.linspace(1e9, 2e9, points))})
    axes = df.plot.overview(sweep, df.plot.Sheet())
    assert len({line.get_color() for line in axes[0].lines}) == min(points, 12)
    assert axes[0].get_title().replace("\n", " ") == sweep.attrs["title"] + title


@pytest.mark.slow
def test_each_usual_picture_of_each_kind_of_result_can_be_saved(tmp_path):
    for name in ("figure-3-air-jump", "figure-3-branches", "resonance-curve", "table-1-am"):
        dataset = df.run(df.example(name))
        for number, picture in enumerate(pictures_of(dataset)):
            path = df.plot.save(
                df.plot.draw(dataset, picture, df.plot.Sheet()), tmp_path / f"{name}-{number}.png", dpi=30
            )
            assert path.stat().st_size > 1000


@pytest.mark.parametrize(("width", "points"), [("85 mm", 241), (0.18, 510)])
def test_a_picture_has_the_width_asked_for(tmp_path, width, points):
    file = df.plot.save(df.plot.draw(result(), Picture("zc", ("phase",))), tmp_path / "x.svg", width=width)
    found = re.search(r'width="([\d.]+)pt"', file.read_text())
    assert float(found[1]) == pytest.approx(points, abs=1.0)  # 72 points to the inch


@pytest.mark.parametrize(("width", "words"), [("5 mm", "not between"), ("85 kg", "mass"), ("wide", "the width")])
def test_a_width_that_is_none_is_refused_in_a_sentence(tmp_path, width, words):
    with pytest.raises(df.ParameterError, match=words):
        df.plot.save(df.plot.draw(result(), Picture("zc", ("phase",))), tmp_path / "x.png", width=width)
    assert not list(tmp_path.iterdir())


def test_results_without_the_quantities_are_refused_in_a_sentence():
    dwell = df.run(df.example("table-1-am"))
    with pytest.raises(df.ParameterError, match="nothing can be drawn"):
        df.plot.draw({"a": dwell, "b": dwell}, Picture("zc", ("phase",)))


@pytest.mark.parametrize(
    "draw",
    [
        lambda result: df.plot.draw(result, Picture("zc", ("total_virial", "total_dissipated_energy"))),
        lambda result: [None, *df.plot.curve(result, "total_dissipated_energy")],
    ],
)
def test_what_is_rounding_throughout_is_a_line_at_zero(draw):
    result = df.run(df.example("figure-3-air"))  # conservative
    axes = draw(result)[1]
    low, high = axes.get_ylim()
    assert -low == high > 0.0
    assert max(float(np.abs(line.get_ydata()).max()) for line in axes.lines) < 0.5 * high


def test_what_is_small_but_no_rounding_keeps_its_axis():
    result = df.run(df.example("figure-3-air"))
    largest, mean = (float(np.abs(result[name]).max()) for name in ("min_force", "mean_force"))
    assert 0.0 < largest_error(result, "mean_force") < mean < 0.1 * largest
    assert largest_error(result, "drift") == 0.0
