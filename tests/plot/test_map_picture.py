"""Pictures of a quantity over two parameters."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic
from matplotlib import pyplot as plt
from matplotlib.collections import QuadMesh

import dforce as df


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def mesh(axes) -> QuadMesh:
    return next(one for one in axes.collections if isinstance(one, QuadMesh))


def test_an_axis_of_equal_factors_is_logarithmic_and_its_cells_end_halfway_on_it():
    axes = df.plot.map(synthetic.grid(), "A0", "youngs_modulus", "peak_force")
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    assert axes.get_xlabel() == "free amplitude (nm)"
    modulus = np.geomspace(0.1, 10, 9)  # GPa
    x, y = np.moveaxis(mesh(axes).get_coordinates(), 2, 0)
    assert x[0].tolist() == pytest.approx([4, 6, 8, 10, 12, 14, 16])
    np.testing.assert_allclose(y[1:-1, 0] ** 2, modulus[1:] * modulus[:-1])
    assert mesh(axes).get_array().shape == (9, 6)


def test_the_neutral_color_is_at_resonance_for_a_phase_and_at_0_for_both_signs():
    for name, middle in (("phase", 90.0), ("virial", 0.0)):
        norm = mesh(df.plot.map(synthetic.grid(), "A0", "youngs_modulus", name)).norm
        assert norm.vcenter == middle
        assert norm.vmax - middle == pytest.approx(middle - norm.vmin)


def test_lines_lie_where_the_quantity_has_their_value():
    grid = synthetic.grid()
    axes = df.plot.map(grid, "A0", "youngs_modulus", "peak_force", levels=[1e-9])
    (line,) = [one for one in axes.collections if not isinstance(one, QuadMesh)]
    x, y = line.get_paths()[0].vertices.T
    # F = 1 nN sqrt(E / GPa) A0 / 10 nm; on straight lines between values a factor of 1.8 apart
    assert np.sqrt(y) * x / 10.0 == pytest.approx(np.ones(len(x)), rel=0.05)


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (("A1", "youngs_modulus", "peak_force"), "no parameter 'A1'"),
        (("A0", "A0", "peak_force"), "a map is over two parameters"),
        (("A0", "youngs_modulus", "peak"), "has no 'peak'"),
    ],
)
def test_a_mistake_is_one_sentence(names, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.plot.map(synthetic.grid(), *names)
    with pytest.raises(df.ParameterError, match="also has the dimension youngs_modulus"):
        df.plot.map(synthetic.grid().assign_coords(zc=("zc", [1.0, 2.0])), "A0", "zc", "peak_force")


def test_a_gap_stays_a_gap():
    grid = synthetic.grid()
    grid["peak_force"][3, 2] = np.nan
    assert np.ma.count_masked(mesh(df.plot.map(grid, "A0", "youngs_modulus", "peak_force")).get_array()) == 1
    df.plot.map(grid.assign(peak_force=grid.peak_force * 0.0), "A0", "youngs_modulus", "peak_force")


def test_states_at_a_set_point_over_two_parameters_are_maps_but_of_the_amplitude_that_is_given():
    case = df.example("figure-3-air").set('experiment.zc={ start = "12 nm", stop = "4 nm", points = 9 }')
    over = {"sample.youngs_modulus": np.geomspace(0.5e9, 2e9, 3), "drive.A0": [8e-9, 9e-9, 10e-9]}
    found = df.sweep(case, over, at_set_point=0.8)
    every = df.plot.overview(found)
    labels = [bar.get_ylabel() for axes in every for bar in axes.figure.axes if bar is not axes]
    assert labels == ["phase lag $\\phi$ (°)", "peak force $F_\\mathrm{max}$ (N)"]
    assert {axes.get_yscale() for axes in every} == {"log"}
    (only,) = df.plot.overview(found[["peak_force"]])
    assert only.figure.axes[1].get_ylabel().startswith("peak force")


def test_a_force_below_its_error_is_none_and_makes_no_scale_of_two_sides():
    grid = synthetic.grid()
    force = grid.peak_force.where(grid.peak_force > grid.peak_force.mean(), -1e-18)
    colors = df.plot.map(grid.assign(peak_force=force), "A0", "youngs_modulus", "peak_force").collections[0]
    assert colors.get_cmap().name == "viridis" and colors.norm.vmin == 0.0


def test_states_at_a_set_point_over_one_parameter_are_lines():
    case = df.example("hysteresis").set("experiment.zc.points=41")
    found = df.sweep(case, {"drive.A0": [15e-9, 20e-9]}, at_set_point=0.8)
    phase, *_, peak = df.plot.overview(found)
    assert peak.get_xlabel() == "free amplitude $A_0$ (nm)" and phase.get_ylabel().startswith("phase lag")
    drawn = [line.get_xydata() for line in df.plot.overview(found[["peak_force"]])[0].lines]
    wanted = np.stack([found["A0"] * 1e9, found["peak_force"].isel(crossing=0) * 1e12], axis=1)
    assert len(drawn) == found.sizes["crossing"] == 2 and drawn[0] == pytest.approx(wanted, rel=1e-12, abs=0.0)
