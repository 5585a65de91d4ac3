"""Pictures: units for the reader, every mark where it belongs, nothing left open."""

from __future__ import annotations

import functools
import xml.etree.ElementTree

import fitted_curves
import matplotlib
import matplotlib.pyplot as plt
import measured_curve
import numpy as np
import pytest
import synthetic
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine, TightLayoutEngine

import dforce as df
from dforce import plot
from dforce.core.errors import ParameterError, ResultError
from dforce.plot._style import figure_of, thin
from dforce.results.curves import Picture, pictures_of
from dforce.results.status import Status


def texts(axes):
    return [axes.get_xlabel(), axes.get_ylabel()]


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_amplitude_and_phase_are_drawn_in_nm_and_degrees():
    dataset = synthetic.approach(spoiled=False)
    upper, lower = plot.amplitude_phase(dataset)
    assert upper.get_ylabel() == "amplitude $A$ (nm)"
    assert texts(lower) == ["average distance $z_c$ (nm)", r"phase lag $\phi$ (°)"]
    x, y = upper.lines[0].get_data()
    np.testing.assert_allclose(np.sort(dataset.zc.values) * 1e9, x)
    np.testing.assert_allclose(dataset.amplitude.values[0, ::-1, 0] * 1e9, y)
    assert legend(upper) == ["← approach", "retract →"]
    assert upper.get_title() == "Synthetic, in air"


def test_directions_differ_in_color_and_in_dashes():
    upper, _ = plot.amplitude_phase(synthetic.approach(spoiled=False))
    approach, retract = upper.lines[:2]
    assert approach.get_color() != retract.get_color()
    assert approach.is_dashed() != retract.is_dashed()


def test_the_line_between_attraction_and_repulsion_is_always_in_view():
    dataset = synthetic.approach(spoiled=False)
    for phases in (
        np.full(dataset.phase.shape, 20.0),
        np.full(dataset.phase.shape, 175.0),
        np.full(dataset.phase.shape, np.nan),
    ):
        _, lower = plot.amplitude_phase(dataset.assign(phase=(dataset.phase.dims, phases, dataset.phase.attrs)))
        low, high = lower.get_ylim()
        assert low < 90.0 < high


@pytest.mark.parametrize(
    ("path", "value", "free"), [("drive.lag", 0.5, 90.0 + np.degrees(0.5)), ("drive.excitation", "base", 90.224688)]
)
def test_the_line_between_attraction_and_repulsion_is_at_the_free_phase_of_the_case(path, value, free):
    """A base shaken at resonance is 90 degrees + arctan(1/Q) ahead of the deflection; here Q = 255."""
    curve = df.approach(df.example("figure-3-air").replace(path, value), zc=["15 nm", "9 nm"])
    _, lower = plot.amplitude_phase(curve)
    assert [line.get_ydata()[0] for line in lower.lines if line.get_linestyle() == ":"] == pytest.approx(
        [free], abs=1e-5
    )


def test_points_that_failed_or_did_not_settle_are_marked():
    upper, _ = plot.amplitude_phase(synthetic.approach())
    assert legend(upper) == ["← approach", "retract →", "did not settle", "no result"]
    marked = {line.get_label(): line.get_xdata() for line in upper.lines}
    assert len(marked["did not settle"]) == 2
    np.testing.assert_allclose(marked["no result"], [8.0])  # nm; point 40 of the synthetic curve


def test_points_never_computed_have_no_mark():
    dataset = synthetic.approach(spoiled=False)
    dataset["status"][1, :] = Status.NOT_COMPUTED
    upper, _ = plot.amplitude_phase(dataset)
    assert legend(upper) == ["← approach", "retract →"]


def test_a_curve_in_one_direction_needs_no_legend():
    upper, _ = plot.amplitude_phase(synthetic.approach(directions=("approach",), spoiled=False))
    assert upper.get_legend() is None


def test_a_few_points_have_dots():
    upper, _ = plot.amplitude_phase(synthetic.approach(points=5, spoiled=False))
    assert upper.lines[0].get_marker() == "."


def test_quantities_in_other_units_have_axes_of_their_own_color():
    axes = plot.curve(synthetic.approach(), ["peak_force", "total_dissipated_energy", "max_indentation"])
    assert [one.get_ylabel().split()[-1] for one in axes] == ["(pN)", "(eV)", "(nm)"]
    colors = [one.yaxis.label.get_color() for one in axes]
    assert len(set(colors)) == 3
    assert [one.lines[0].get_color() for one in axes] == colors


def test_quantities_in_the_same_unit_share_an_axis_and_every_tone_is_drawn():
    axes = plot.curve(synthetic.approach(tones=2), ["amplitude", "peak_force", "min_force"])
    assert [one.get_ylabel() for one in axes] == ["amplitude $A$ (nm)", "force (pN)"]
    assert legend(axes[-1])[:4] == ["amplitude, tone 1", "amplitude, tone 2", "peak force", "lowest force"]


@functools.cache
def loop():
    case = df.example("hysteresis")
    return df.run(case), df.branches(case, zc=("23 nm", "14 nm"))


@pytest.mark.parametrize("draw", [plot.amplitude_phase, plot.overview])
def test_all_states_lie_behind_a_curve_the_unstable_ones_dashed(draw):
    curve, states = loop()
    upper, lower, *_ = draw(curve, states=states)
    assert legend(upper) == ["← approach", "retract →", "stable states", "unstable states", "fold"]
    (unstable,) = (line for line in lower.lines if line.get_label() == "unstable states")
    assert unstable.is_dashed() and unstable.get_zorder() < lower.lines[0].get_zorder()
    # the piece reaches to the first stable point behind it
    (inside,) = np.nonzero(~states.stable.values)
    reach = np.append(inside, inside[-1] + 1)
    np.testing.assert_allclose(unstable.get_xdata(), 1e9 * states.zc.values[reach])
    np.testing.assert_allclose(unstable.get_ydata(), states.phase.values[reach, 0])
    marks = [line.get_xdata() for line in lower.lines if line.get_label() == "fold"]
    np.testing.assert_allclose(np.sort(marks), [[19.1082, 19.7944]], atol=1e-4)  # nm


def test_states_are_drawn_on_the_axis_of_each_quantity_and_in_its_unit():
    curve, states = loop()
    for axes, name, scale in zip(
        plot.curve(curve, ["amplitude", "peak_force"], states=states),
        ("amplitude", "peak_force"),
        (1e-9, 1e-12),
        strict=True,
    ):
        (unstable,) = (line for line in axes.lines if line.get_label() == "unstable states")
        first = int(np.argmin(states.stable.values))
        assert unstable.get_ydata()[0] == pytest.approx(states[name].values.ravel()[first] / scale)


@pytest.mark.parametrize(
    ("other", "sentence"),
    [
        (lambda: loop()[0], "has no curves of states"),
        (lambda: loop()[1].assign_attrs(along="youngs_modulus"), "lie along youngs_modulus"),
        (lambda: loop()[1].assign_attrs(case=df.example("figure-3-air").to_toml()), "different instruments, samples or forces"),
    ],
)  # fmt: skip
def test_states_that_are_not_those_of_the_curve_are_refused(other, sentence):
    for draw in (plot.amplitude_phase, plot.overview, lambda curve, states: plot.curve(curve, "phase", states=states)):
        with pytest.raises(ParameterError, match=sentence):
            draw(loop()[0], states=other())
    assert plt.get_fignums() == []


def test_states_behind_anything_but_an_approach_are_refused():
    with pytest.raises(ParameterError, match="under the curve of an approach"):
        plot.overview(synthetic.dwell(), states=loop()[1])


def test_the_same_states_belong_to_curves_solved_in_another_way():
    curve, states = loop()
    other = df.example("hysteresis").set("solver.points_per_period=128", "experiment.direction=retract")
    plot.amplitude_phase(curve.assign_attrs(case=other.to_toml()), states=states)


def test_traces_show_deflection_velocity_and_force_in_one_picture():
    dataset = synthetic.dwell()
    axes = plot.traces(dataset)
    assert [one.get_ylabel() for one in axes] == [
        "deflection $z$ (nm)", r"velocity $\dot z$ (mm/s)", "force $F$ (pN)",
    ]  # fmt: skip
    assert axes[0].get_xlabel() == "time $t$ (µs)"
    x, y = axes[2].lines[0].get_data()
    # three periods, and the sample at each end
    assert len(x) == pytest.approx(3 * 256, abs=1)
    np.testing.assert_allclose(y, dataset.force.values[-len(y) :] * 1e12)


def test_the_whole_record_can_be_shown_and_every_mode_is_drawn():
    dataset = synthetic.dwell()
    (axes,) = plot.traces(dataset, "mode_deflection", periods=None)
    assert len(axes.lines) == 1 and len(axes.lines[0].get_xdata()) == dataset.sizes["time"]


def test_a_long_line_is_thinned_but_keeps_its_extremes():
    x = np.arange(1_000_000.0)
    y = np.sin(x)
    y[123_456], y[765_432] = 5.0, -7.0
    few_x, few_y = thin(x, y)
    assert len(few_x) <= 20_000 and np.all(np.diff(few_x) > 0)
    assert few_y.max() == 5.0 and few_y.min() == -7.0


def test_spectrum_marks_the_harmonics_of_the_drive():
    axes = plot.spectrum(synthetic.dwell())
    marks = [line.get_xdata()[0] for line in axes.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(marks, 48.9 * np.arange(1, 11), rtol=1e-6)
    assert axes.get_yscale() == "log" and texts(axes) == ["frequency $f$ (kHz)", "spectrum $A(f)$ (nm)"]


def test_motion_without_a_result_has_no_picture_and_the_reason_is_told():
    law = df.forces.Custom(law="1e-9*exp(-1e12*d)")
    failed = df.run(df.example("table-1-am").replace(forces=[law]))
    with pytest.raises(ParameterError, match="no motion can be drawn: the motion or a force became infinite"):
        plot.overview(failed)


def test_spectrum_in_decibel_is_relative_to_the_largest_line():
    axes = plot.spectrum(synthetic.dwell(), decibel=True)
    assert axes.lines[0].get_ydata().max() == 0.0 and axes.get_yscale() == "linear"


def test_spectrum_of_no_motion_can_be_drawn():
    dataset = synthetic.dwell()
    plot.spectrum(dataset.assign(spectrum=dataset.spectrum * 0.0))


def test_force_against_distance_shows_where_the_force_is_felt():
    dataset = synthetic.dwell()
    axes = plot.force_distance(dataset)
    assert texts(axes) == ["distance $d$ (nm)", "force $F$ (pN)"]
    low, high = axes.get_xlim()
    assert low < float(dataset.distance.min()) * 1e9 and 1.0 < high < 4.0
    assert legend(axes) == ["← approach", "retract →"]


def test_phase_portrait_is_velocity_against_deflection():
    assert texts(plot.phase_portrait(synthetic.dwell())) == ["deflection $z$ (nm)", r"velocity $\dot z$ (mm/s)"]


def without_numbers(result):
    """Return a result whose numbers are all unknown."""
    empty = result.copy(deep=True)
    for variable in empty.data_vars.values():
        if variable.dtype.kind == "f":
            variable.values[...] = np.nan
    return empty


@pytest.mark.parametrize("make", [synthetic.approach, synthetic.dwell, synthetic.force_curve, synthetic.grid])
def test_a_result_without_numbers_is_summed_up_and_drawn_or_refused_in_a_sentence(make, tmp_path):
    result = without_numbers(make())
    assert str(df.report(result))
    for draw in (plot.overview, *(functools.partial(plot.draw, picture=picture) for picture in pictures_of(result))):
        try:
            plot.save(draw(result, figure=plot.Sheet()), tmp_path / "empty.png", dpi=20)
        except ParameterError as refused:
            assert "has no numbers, so it has no picture" in str(refused)


def test_a_reconstructed_force_that_is_zero_or_unknown_everywhere():
    distance, zero = np.linspace(0.0, 2e-9, 21), np.zeros(21)
    found = xr.Dataset(
        {"force": ("distance", zero, {"units": "N"}), "force_error": ("distance", zero, {"units": "N"})}
        | {"gap_low": ("gap", []), "gap_high": ("gap", [])},
        {"distance": ("distance", distance, {"units": "m"})},
    )
    assert plot.reconstruction(found, plot.Sheet()).get_xlim()[1] >= 2.0
    with pytest.raises(ParameterError, match="'force' has no numbers, so it has no picture"):
        plot.reconstruction(without_numbers(found), plot.Sheet())


def test_a_motion_far_inside_the_sample_is_drawn_and_saved(tmp_path):
    motion = synthetic.dwell()
    deep = motion.assign(distance=motion["distance"] - 5e-6, indentation=motion["indentation"] * 0.0 + 5e-6)
    deep["distance"].attrs.update(motion["distance"].attrs)
    axes = plot.force_distance(deep, plot.Sheet())
    assert plot.save(axes, tmp_path / "deep.png").stat().st_size > 1000


def test_force_curve_shades_hysteresis_only_where_there_is_some():
    assert legend(plot.force_curve(synthetic.force_curve())) == ["hysteresis", "← approach", "retract →"]
    assert legend(plot.force_curve(synthetic.force_curve(hysteresis=False))) == ["both directions"]


@pytest.mark.parametrize(
    ("make", "count"),
    [
        (synthetic.approach, 4),
        (lambda: synthetic.approach(tones=2), 6),
        (lambda: synthetic.approach(directions=("retract",)), 4),
        (synthetic.dwell, 6),
        (lambda: synthetic.dwell().drop_vars("spectrum"), 5),  # as of df.motion_at
        (synthetic.force_curve, 1),
    ],
)
@pytest.mark.slow
def test_overview_is_drawn_for_every_kind_of_result(tmp_path, make, count):
    axes = plot.overview(make())
    assert len(axes) == count
    plot.save(axes, tmp_path / "figure.png", dpi=50)


def test_a_title_is_no_formula():
    dataset = synthetic.approach().assign_attrs(title=r"costs $5 or \frac{, 50 % off, " + "very " * 40 + "long")
    upper, _ = plot.amplitude_phase(dataset)
    upper.figure.canvas.draw()
    assert upper.get_title().startswith("costs $5") and upper.get_title().count("\n") == 1


@pytest.mark.parametrize("name", ["figure.png", "figure.pdf", "figure.svg"])
def test_pictures_are_written_whole_in_each_format(tmp_path, name):
    path = plot.save(plot.amplitude_phase(synthetic.approach()), tmp_path / name)
    start = path.read_bytes()[:5]
    assert start in (b"\x89PNG\r", b"%PDF-", b"<?xml")
    if name.endswith("svg"):
        xml.etree.ElementTree.parse(path)
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_a_picture_in_another_format_is_one_sentence(tmp_path):
    with pytest.raises(ResultError, match=r"use a name ending in .png, .pdf, .svg"):
        plot.save(plot.phase_portrait(synthetic.dwell()), tmp_path / "figure.bmp")


def test_a_given_figure_is_drawn_on():
    figure = Figure()
    upper, _ = plot.amplitude_phase(synthetic.approach(), figure=figure)
    assert upper.figure is figure


PICTURES = {
    "amplitude_phase": lambda figure: plot.amplitude_phase(synthetic.approach(), figure=figure),
    "basins": lambda figure: plot.basins(df.run(df.example("figure-3-basins").set(*FEW)), figure=figure),
    "branches": lambda figure: plot.branches(df.run(df.example("figure-3-branches")), figure=figure),
    "curve": lambda figure: plot.curve(synthetic.approach(), ["amplitude", "peak_force", "contact_time"], figure),
    "draw": lambda figure: plot.draw(synthetic.dwell(), Picture("time", ("force", "indentation"), True), figure),
    "fit": lambda figure: plot.fit(fitted_curves.result(), figure),
    "fit_errors": lambda figure: plot.fit_errors(fitted_curves.result(), figure),
    "force_curve": lambda figure: plot.force_curve(synthetic.force_curve(), figure),
    "force_distance": lambda figure: plot.force_distance(synthetic.dwell(), figure),
    "map": lambda figure: plot.map(synthetic.grid(), "A0", "youngs_modulus", "peak_force", figure=figure),
    "measured": lambda figure: plot.measured(df.calibrate(measured_curve.dataset()), figure),
    "overview": lambda figure: plot.overview(synthetic.approach(), figure),
    "phase_portrait": lambda figure: plot.phase_portrait(synthetic.dwell(), figure),
    "resonance": lambda figure: plot.resonance(df.run(df.example("resonance-curve")), figure=figure),
    "spectrum": lambda figure: plot.spectrum(synthetic.dwell(), figure=figure),
    "thermal_spectrum": lambda figure: plot.thermal_spectrum(
        df.thermal_spectrum(df.example("figure-3-air")), figure
    ),
    "traces": lambda figure: plot.traces(synthetic.dwell(), figure=figure),
}  # fmt: skip
FEW = (
    'experiment.amplitude={ start = "0 nm", stop = "10 nm", points = 4 }',
    'experiment.phase={ start = "0 deg", stop = "270 deg", points = 4 }',
)


def test_every_picture_is_tried():
    apart = {"FORMATS", "Sheet", "check_width", "save"} | {"plan", "reconstruction"}  # drawn in tests/inverse
    assert set(plot.__all__) - apart == set(PICTURES)


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.slow
def test_a_picture_is_drawn_on_a_new_figure_of_pyplot(name):
    before = plt.figure()
    figure = figure_of(PICTURES[name](None))
    assert figure is not before
    assert figure is plt.gcf()  # what a notebook shows, and plt.show()


@pytest.mark.parametrize("name", PICTURES)
def test_a_sheet_is_shown_by_nothing_and_gets_the_size_of_its_picture(name):
    sheet = plot.Sheet(figsize=(1.0, 1.0))
    assert figure_of(PICTURES[name](sheet)) is sheet
    assert min(sheet.get_size_inches()) > 3.0
    assert plt.get_fignums() == []


@pytest.mark.parametrize("name", PICTURES)
def test_no_label_is_cut_off_in_a_figure_of_the_user(name):
    """As in a figure made by ``plt.figure(figsize=...)``, whose margins know nothing of a third axis."""
    figure = plt.figure(figsize=(7.0, 5.0))
    PICTURES[name](figure)
    figure.draw_without_rendering()
    drawn, page = figure.get_tightbbox(), figure.bbox_inches
    # a pixel: letters are drawn on whole pixels
    assert drawn.x0 >= -0.01 and drawn.y0 >= -0.01 and drawn.x1 <= page.x1 + 0.01 and drawn.y1 <= page.y1 + 0.01


def test_a_part_of_a_figure_is_drawn_on_and_the_whole_figure_gets_a_layout():
    whole = plt.figure(figsize=(9.0, 5.0))
    left, right = whole.subfigures(1, 2)
    upper, _ = plot.amplitude_phase(synthetic.approach(), figure=left)
    plot.traces(synthetic.dwell(), figure=right)
    assert upper.figure is left and figure_of(upper) is whole
    assert isinstance(whole.get_layout_engine(), ConstrainedLayoutEngine)


def test_a_layout_that_the_user_chose_is_kept():
    figure = plt.figure(layout="tight")
    plot.traces(synthetic.dwell(), figure=figure)
    assert isinstance(figure.get_layout_engine(), TightLayoutEngine)


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (lambda: plot.traces(synthetic.approach()), "this result has no 'deflection'"),
        (lambda: plot.spectrum(synthetic.dwell().drop_vars("spectrum")), "this result has no 'spectrum'"),
        (lambda: plot.traces(synthetic.dwell(), "forse"), "did you mean 'force'"),
        (lambda: plot.traces(synthetic.dwell(), "amplitude"), "'amplitude' is not a trace"),
        (lambda: plot.curve(synthetic.approach(), "force"), "this result has no 'force'"),
        (lambda: plot.curve(synthetic.dwell(), "peak_force"), "no values against zc"),
        (lambda: plot.amplitude_phase(synthetic.approach(), tone=2), "has no tone 2; it has 1"),
        (lambda: plot.amplitude_phase(synthetic.dwell()), "is not a curve against zc"),
        (
            lambda: plot.amplitude_phase(synthetic.approach().expand_dims(sweep=2)),
            "'amplitude' also has the dimension sweep",
        ),
        (lambda: plot.overview(synthetic.approach().drop_vars("amplitude")), "it has no overview"),
    ],
)
def test_what_cannot_be_drawn_is_one_sentence(draw, sentence):
    with pytest.raises(ParameterError, match=sentence):
        draw()


def test_settings_of_matplotlib_are_left_as_they_were(tmp_path):
    before = dict(matplotlib.rcParams)
    plot.save(plot.overview(synthetic.approach()), tmp_path / "figure.svg")
    assert dict(matplotlib.rcParams) == before
