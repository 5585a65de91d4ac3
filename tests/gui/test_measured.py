"""Measured curves in the window: read, asked about, drawn under the model, fitted, kept and removed."""

from __future__ import annotations

import asyncio
import base64
import dataclasses
import threading
from importlib.resources import files

import fitted_curves
import h5py
import measured_curve
import numpy as np
import pytest
import xarray as xr
from nicegui import ui
from simulated import element, send, show, until, window

import dforce as df
from dforce.case import case_of
from dforce.gui.curves.figures import Layer, picture
from dforce.gui.document.document import Document, MeasuredData
from dforce.gui.document.session import Session
from dforce.gui.files import file_menu, project, uploads
from dforce.gui.files.file_menu import figure_file, script_of, stem, written
from dforce.gui.measured import fitting, overlay, reading
from dforce.gui.measured.panel import MeasuredPanel, covering, matched
from dforce.gui.measured.session import MeasuredSession
from dforce.gui.window.dialogs import SaveForm, as_sentence
from dforce.results import hdf5
from dforce.results.curves import Picture

CASE = df.example("figure-3-air").set("experiment.zc.points=5")
SCRIPT = files("dforce.gui") / "measured" / "at_field.js"
USUAL = Picture("zc", ("amplitude", "phase"))
LAG = {"phase_convention": "lag"}
MODULUS = ("sample", "youngs_modulus")


def csv(**how):
    """Return the bytes of a measured text."""
    return measured_curve.text(**how).encode()


def raw(**how):
    """Return a curve whose phases are known, before its calibration."""
    return measured_curve.dataset(**how).assign_attrs(phase_convention="lag", source="curve.csv")


def numbers(packed):
    return np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"])


def of(figure, meta):
    """Return the values of the traces of a figure that show something."""
    return [numbers(trace["y"]) for trace in figure["data"] if trace.get("meta") == meta]


@pytest.mark.parametrize(
    ("name", "data", "kind"),
    [("a.csv", csv(), "measured"), ("a.TXT", csv(), "measured"), ("a.txt", CASE.to_toml().encode(), "case"),
     ("a.toml", csv(), "case"), ("a.h5", hdf5.START, "measured"), ("a.nc", hdf5.START, "result")],
)  # fmt: skip
def test_a_text_or_a_file_of_an_instrument_is_a_measured_curve(name, data, kind):
    assert uploads.kind_of(data, name) == kind


def asked(data, settings=None, case=CASE, name="curve.csv", folder=None):
    with pytest.raises(reading.MissingAnswer) as question:
        reading.curve_from(data, name, settings or {}, case, folder)
    return question.value


ASKED = {  # what a file lacks, and the guesses over its columns
    "sign": ({}, ["height", "amplitude", "phase"], []),
    "columns": ({"heading": "one,two,three"}, ["height", "", ""], []),
    "unit": ({"heading": "height,amplitude_nm,phase_deg"}, ["height", "amplitude", "phase"], []),
    "volts": ({"heading": "height_nm,amplitude_V,phase_deg"}, ["height", "amplitude", "phase"], []),
    "two columns": ({"heading": "height_nm,amplitude_nm,amplitude_nm"}, ["height", "amplitude", ""], []),
}


@pytest.mark.parametrize("what", ASKED)
def test_what_a_file_does_not_tell_is_asked_over_its_head(tmp_path, what):
    how, roles, more = ASKED[what]
    question = asked(csv(**how), folder=tmp_path)
    assert [column.quantity for column in question.head.columns] == roles
    assert list(question.asked) == more
    assert "write" not in str(question)  # here there is a form


def answer(roles=("height", "amplitude", "phase"), **more):
    """Return what the dialog sends."""
    usual = {
        "units": ["nm", "nm", "deg"],
        "grows": "away",
        "convention": "lag",
        "amplitude": "",
        "sensitivity": "",
        "more": [],
    }
    return {"roles": list(roles), **usual, **more}


def test_answers_let_a_file_be_read(tmp_path):
    data = csv(heading="one,two,three")
    question = asked(data, folder=tmp_path)
    settings = reading.with_choices(question.head, {}, [], answer())
    assert settings == LAG | {
        "columns": {"height": "one", "amplitude": "two", "phase": "three"},
        "units": {"height": "nm", "amplitude": "nm", "phase": "deg"},
        "read": {"height_grows": "away"},
    }
    curve = reading.curve_from(data, "curve.csv", settings, CASE, tmp_path)
    assert np.allclose(curve["amplitude"], measured_curve.numbers()[1], atol=1e-14)


def test_what_a_reader_does_by_itself_is_not_named(tmp_path):
    question = asked(csv(), folder=tmp_path)
    assert reading.with_choices(question.head, {}, [], answer(convention="lead")) == {"phase_convention": "lead"}
    volts = asked(csv(heading="height_nm,amplitude_V,phase_deg"), folder=tmp_path)
    more = answer(sensitivity="50 nm/V", amplitude="rms", grows="toward")
    assert reading.with_choices(volts.head, {}, [], more) == LAG | {
        "read": {"sensitivity": "50 nm/V", "amplitude_is": "rms", "height_grows": "toward"}
    }


def test_heights_in_volts_ask_for_the_sensitivity_of_the_piezo(tmp_path):
    data = csv(heading="Z (V),amplitude_nm,phase_deg")
    question = asked(data, LAG, folder=tmp_path)
    assert [one["volts"] for one in reading._shown(question.head, LAG, {})["columns"]] == [True, False, False]
    bare = asked(csv(heading="Z,amplitude_nm,phase_deg"), LAG, folder=tmp_path)
    assert not any(one["volts"] for one in reading._shown(bare.head, LAG, {})["columns"])
    settings = reading.with_choices(question.head, LAG, [], answer(units=["20 nm/V", "", ""]))
    assert reading._shown(question.head, settings, {})["piezo"] == "20 nm/V"
    curve = reading.curve_from(data, "curve.csv", settings, CASE, tmp_path)
    assert np.allclose(curve["height"], 20.0 * measured_curve.numbers()[0], atol=1e-12)


def test_a_unit_of_something_else_is_typed_anew(tmp_path):
    question = asked(csv(heading="height_s,amplitude_nm,phase_deg"), LAG, folder=tmp_path)
    assert "is 's', which is a time" in str(question)
    columns = reading._shown(question.head, LAG, {})["columns"]
    assert [one["unit"] for one in columns] == ["", "nm", "deg"] and columns[0]["typed"] == "nm"
    settings = reading.with_choices(question.head, LAG, [], answer(units=["nm", "", ""]))
    curve = reading.curve_from(csv(heading="height_s,amplitude_nm,phase_deg"), "c.csv", settings, CASE, tmp_path)
    assert np.ptp(curve["height"].values) == pytest.approx(np.ptp(measured_curve.numbers()[0]))


def test_a_curve_without_a_free_part_is_asked_for_what_that_would_tell(tmp_path):
    lines = csv().decode().splitlines()
    near = "\n".join([lines[0], *lines[60:], ""]).encode()
    question = asked(near, LAG, folder=tmp_path)
    assert {place[:2] for place in question.asked} == {
        ("calibrate", "free_amplitude"), ("calibrate", "free_phase"), ("calibrate", "errors")}  # fmt: skip
    told = ["20 nm", "90 deg", "30 pm", "0.2 deg"]
    settings = reading.with_choices(question.head, LAG, list(question.asked), answer(more=told))
    assert reading.curve_from(near, "c.csv", settings, CASE, tmp_path).sizes["point"] == 61


def test_what_is_no_curve_is_refused_by_its_name(tmp_path):
    with pytest.raises(df.ResultError, match=r"^notes\.csv contains no table") as refused:
        reading.curve_from(b"a,b\nhello,there\n", "notes.csv", {}, CASE, tmp_path)
    assert not isinstance(refused.value, reading.MissingAnswer)
    assert not list(tmp_path.glob("upload-*"))


def at_fields(page):
    """Return what stands of a fit at the fields of a page, by their paths, where it can be seen."""
    return {path: one for path, one in page.forms.companions[-1].placed.items() if one.visible}


def fit_at(page, path):
    return at_fields(page)[path]


def beside(shift=0.0, turn=0.0, fit=None):
    return overlay.Beside(df.calibrate(raw(), CASE), shift, turn, fit)


def test_points_lie_where_they_were_measured_and_move_with_their_shift():
    drawn = picture([Layer(df.run(CASE))], USUAL)
    figure = overlay.with_measured(drawn, USUAL, beside(shift=1.5e-9, turn=2.0)).figure
    first = figure["data"][0]  # under the lines
    curve = beside().curve
    assert first["meta"] == "measured amplitude"
    assert first["hovertemplate"] == "amplitude %{y:.4g} nm, measured, approach<extra></extra>"
    assert np.allclose(numbers(first["x"]), 1e9 * curve["height"].values + 1.5)
    assert np.allclose(of(figure, "measured amplitude")[0], 1e9 * curve["amplitude"].values)
    assert np.allclose(of(figure, "measured phase")[0], curve["phase"].values - 2.0)


def test_the_curve_of_the_model_has_a_name_beside_what_was_measured():
    drawn = picture([Layer(df.run(CASE.replace("experiment.direction", "approach")))], USUAL)
    data = overlay.with_measured(drawn, USUAL, beside()).figure["data"]
    assert "model" in [one["name"] for one in data if one.get("showlegend")]


def test_residuals_are_of_the_branches_that_the_fit_found_and_points_are_above_a_fit():
    """A measured jump lies between both jumps of the model: the direction of a point does not tell its branch."""
    model = df.run(df.example("figure-3-air-jump"))
    jumped = model["zc"].values < 9.75e-9  # of 10.1 nm on retract and 9.3 nm on approach
    ways = {False: model.sel(direction="approach"), True: model.sel(direction="retract")}
    columns = {name: np.where(jumped, *(np.ravel(ways[one][name].values) for one in (True, False))) for name in USUAL.y}
    curve = xr.Dataset(
        {name: ("point", values) for name, values in columns.items()} | {"height": ("point", model["zc"].values)},
        {"direction": ("point", ["approach"] * len(jumped))},
        {"amplitude_error": 0.1e-9, "phase_error": 0.5},
    )
    fit = curve.drop_vars("direction").assign_coords(branch=("point", np.where(jumped, -1, 1)), tone=[1])
    fit["used"] = ("point", np.full(len(jumped), True))
    drawn = overlay.with_measured(picture([Layer(model)], USUAL), USUAL, overlay.Beside(curve, fit=fit), model).figure
    for name in USUAL.y:
        (left,) = of(drawn, f"residual {name}")
        assert np.nanmax(np.abs(left)) < 1e-6 and np.isfinite(left).mean() > 0.9
    above = {one["meta"].partition(" ")[0]: one.get("zorder", 0) for one in drawn["data"]}
    assert above["measured"] > max(order for kind, order in above.items() if kind != "measured")


@pytest.mark.parametrize("wanted", [USUAL, Picture("amplitude", ("phase", "peak_force"))])
def test_a_figure_that_is_saved_has_the_measured_points(monkeypatch, wanted):
    drawn = []
    monkeypatch.setattr(df.plot, "save", lambda axes, path, *how: drawn.extend(axes) or path.write_bytes(b""))
    moved = beside(shift=1.5e-9, turn=2.0).moved()
    layers = [Layer(df.run(CASE))]
    for some in (layers, [*layers, Layer(df.run(CASE.set("drive.A0=8 nm")), "other")]):
        drawn.clear()
        figure_file(some, wanted, ".png", "85 mm", moved)
        by_name = dict(zip(wanted.y, drawn, strict=True))
        lines = [line for line in by_name["phase"].lines if str(line.get_label()).startswith("measured")]
        found = np.sort(np.concatenate([line.get_ydata() for line in lines]))
        assert found == pytest.approx(np.sort(moved["phase"].values))
        assert found == pytest.approx(np.sort(beside().curve["phase"].values) - 2.0)
        across = 1e9 * (beside().curve["height"].values + 1.5e-9 if wanted is USUAL else moved["amplitude"].values)
        assert np.sort(np.concatenate([line.get_xdata() for line in lines])) == pytest.approx(np.sort(across))
        low, high = by_name["phase"].get_ylim()
        assert low < found.min() and found.max() < high
    assert "peak_force" not in by_name or not any("measured" in str(x.get_label()) for x in by_name["peak_force"].lines)


def test_the_script_of_the_window_draws_the_measured_points(workdir, monkeypatch):
    (workdir / "curve.csv").write_bytes(csv())
    drawn = []
    monkeypatch.setattr(df.plot, "save", lambda axes, path, *how: drawn.append((path, np.ravel(axes))))
    settings = LAG | {"calibrate": {"baseline": "none"}}
    document = dataclasses.replace(Document.of(CASE), measured=MeasuredData("1", "curve.csv", settings, 1.5e-9, 2.0))
    exec(script_of(document), {})
    path, (_, lower) = drawn[-1]
    assert path == f"{stem(CASE.title)}-measured.png" and len(drawn) == 2
    (points,) = (line for line in lower.lines if str(line.get_label()).startswith("measured"))
    curve = df.calibrate(df.read_measured("curve.csv", phase_convention="lag"), CASE, baseline="none")
    assert points.get_xdata() == pytest.approx(1e9 * curve["height"].values + 1.5)
    assert points.get_ydata() == pytest.approx(curve["phase"].values - 2.0)
    dwell = CASE.set('experiment={kind="dwell", zc="5 nm"}')
    assert (
        "measured" not in script_of(dataclasses.replace(document, table=Document.of(dwell).table)).split("result =")[1]
    )


def test_the_script_of_the_window_turns_the_phases_of_all_tones(tmp_path):
    script = script_of(dataclasses.replace(Document.of(CASE), measured=MeasuredData("1", "curve.csv", LAG, 0.0, 2.0)))
    _, _, moves = script.rpartition("df.read_measured")
    lines = moves.splitlines()[1:-1]
    measured = {"phase": np.array([90.0]), "phase_2": np.array([80.0])}
    exec("\n".join(lines), {"measured": measured})
    assert [values.item() for values in measured.values()] == [88.0, 78.0]


@pytest.mark.parametrize("table", ["read", "calibrate"])
def test_no_key_of_a_foreign_project_becomes_code_of_a_script(table):
    settings = LAG | {table: {"x=1); raise SystemExit(": 1}}
    document = dataclasses.replace(Document.of(CASE), measured=MeasuredData("1", "curve.csv", settings))
    with pytest.raises(df.ParameterError, match=table):
        script_of(document)


def test_a_click_finds_its_line_although_points_lie_under_it():
    drawn = picture([Layer(df.run(CASE))], USUAL)
    more = overlay.with_measured(drawn, USUAL, beside())
    assert len(more.traces) == len(more.figure["data"])
    assert [trace["meta"] for trace, what in zip(more.figure["data"], more.traces, strict=True) if what is not None] == [
        trace["meta"] for trace, what in zip(drawn.figure["data"], drawn.traces, strict=True) if what is not None]  # fmt: skip


@pytest.mark.parametrize("wanted", [Picture("zc", ("peak_force",)), Picture("peak_force", ("max_indentation",))])
def test_a_picture_of_what_was_not_measured_stays_as_it_is(wanted):
    drawn = picture([Layer(df.run(CASE))], wanted)
    assert overlay.with_measured(drawn, wanted, beside()) is drawn


async def dropped(page, data=None, name="curve.csv"):
    """Drop a file whose phases are known, and wait for the fields to follow it."""
    page.view.edit(page.view.document.put(("data",), LAG))
    await page.files.open(csv() if data is None else data, name)
    await until(lambda: page.view.session.measured.curve is not None and at_fields(page))


def test_a_file_that_takes_long_to_read_is_named_meanwhile(tmp_path, monkeypatch):
    go, read = threading.Event(), reading.curve_from
    monkeypatch.setattr(file_menu, "MOMENT", 0.0)
    monkeypatch.setattr(ui.notification, "dismiss", lambda self: self.delete())  # as a browser answers
    monkeypatch.setattr(reading, "curve_from", lambda *given: go.wait(20.0) and read(*given))

    def named(user):
        with user.client:
            return [one.message for one in user.client.elements.values() if isinstance(one, ui.notification)]

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.view.edit(page.view.document.put(("data",), LAG))

            async def data():
                return csv()

            opening = asyncio.create_task(page.files._open_and_keep(data(), "große Kurve.csv"))
            await until(lambda: named(user) == ["Reading große Kurve.csv ..."])
            go.set()
            await opening
            await until(lambda: not named(user))
            assert page.view.document.measured is not None

    asyncio.run(flow())


def test_doubts_about_a_curve_are_seen_before_a_fit_and_go_with_their_reason(tmp_path):
    data = (files("dforce.library") / "measured" / "stiff.csv").read_bytes()

    async def flow():
        async with window(tmp_path, stiff(tmp_path), live=False) as (user, page):
            panel = element(user, MeasuredPanel)
            page.view.edit(page.view.document.put(("drive", "A0"), "20 nm"))
            await dropped(page, data, "stiff.csv")
            page.plots.measured.show()
            assert panel.props["doubts"] == ["The free amplitude of the case is 0.667 times the measured value."]
            send(panel, "match")
            await page.view.session.measured.load(page.view.document)
            page.plots.measured.show()
            assert panel.props["doubts"] == []

    asyncio.run(flow())


def test_a_dropped_curve_is_drawn_kept_with_the_case_and_removed(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            session = page.view.session
            await dropped(page)
            figure = show(page, df.run(CASE))
            assert len(of(figure, "measured amplitude")) == 1
            assert page.view.document.case().data.file == "curve.csv"
            again = Session(session.store, tmp_path)
            session.saving.write()
            again = Session(session.store, tmp_path)
            await again.measured.load(again.document)
            assert again.measured.curve.identical(session.measured.curve)
            send(element(user, MeasuredPanel), "remove")
            await until(lambda: session.document.measured is None and session.measured.curve is None)
            assert session.measured.results.names() == []
            assert of(show(page, df.run(CASE)), "measured amplitude") == []

    asyncio.run(flow())


def test_a_step_back_from_an_example_brings_the_measured_curve_back(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            session = page.view.session
            await dropped(page)
            send(element(user, MeasuredPanel), "shift", 1.5)
            before = session.document.measured
            await page.files.open_shipped("figure-3-water")
            assert session.document.measured is None
            session.undo()
            assert session.document.measured == before
            assert (await session.measured.load(session.document)).sizes["point"] == session.measured.curve.sizes[
                "point"
            ]
            session.redo()
            assert session.document.measured is None
            session.undo()
            send(element(user, MeasuredPanel), "remove")  # this is no step
            await until(lambda: session.measured.results.names() == [])
            session.redo()
            session.undo()
            assert session.document.measured is None

    asyncio.run(flow())


def test_the_slider_of_the_shift_lies_about_the_shift_that_the_curve_suggests(tmp_path):
    """Heights of a piezo are often near 500 nm: a slider over a micrometer moved in steps of some nanometers."""
    far = measured_curve.dataset().assign_attrs(phase_convention="lag")

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            panel, session = element(user, MeasuredPanel), page.view.session
            await session.take_measured(far.assign(height=far["height"] + 500e-9), "far.csv", {})
            await until(lambda: session.measured.curve is not None)
            page.plots.measured.open()
            page.plots.measured.show()
            at, low, high = (panel.props[name] for name in ("at", "low", "high"))
            assert -510.0 < at < -490.0 and high - low == pytest.approx(6.0) and low < at < high
            send(panel, "shift", at + 10.0)
            page.plots.measured.show()
            assert panel.props["low"] < panel.props["at"] < panel.props["high"] and panel.props["high"] - low < 30.0

    asyncio.run(flow())


def test_a_second_curve_takes_the_place_of_the_first(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            await dropped(page)
            await dropped(page, csv(points=80), "second.csv")
            session = page.view.session
            await until(lambda: session.measured.curve.sizes["point"] == 80)
            assert session.document.measured.name == "second.csv"
            assert session.measured.results.names() == [session.document.measured.id]

    asyncio.run(flow())


def test_what_is_not_clear_is_asked_in_the_window_and_then_read(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            await page.files.open(csv(), "curve.csv")
            form = element(user, reading.TableForm)
            assert "sign of the phases" in form.props["why"] and "phase_convention" not in form.props["why"]
            assert [column["role"] for column in form.props["columns"]] == ["height", "amplitude", "phase"]
            assert page.view.document.measured is None
            send(form, "read", answer(convention="lead"))
            await until(lambda: page.view.document.measured is not None)
            assert page.view.document.measured.settings == {"phase_convention": "lead"}

    asyncio.run(flow())


def test_an_answer_that_does_not_do_is_asked_for_again_with_what_is_wrong(tmp_path):
    heading, *rows = csv().decode().splitlines()
    lines = [f"{heading},curve", *(f"{row},{number}" for number in (1, 2) for row in rows)]

    def form_of(user):
        with user.client:
            return [one for one in user.client.elements.values() if isinstance(one, reading.TableForm)][-1]

    roles = ["height", "amplitude", "phase", "curve"]

    def told(curve):
        return answer(roles, units=["nm", "nm", "deg", ""], more=[curve] if curve else [])

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            await page.files.open("\n".join([*lines, ""]).encode(), "map.csv")
            for wrong, sentence in (("9", "has no curve 9; it contains 2"), ("first", "is not a whole number")):
                before = form_of(user)
                assert before.props["more"][0]["label"] == "Which curve, 1 to 2"
                send(before, "read", told(wrong))
                await until(lambda before=before: form_of(user) is not before)
                again = form_of(user).props
                assert sentence in again["why"] and again["more"][0]["value"] == wrong
                assert again["convention"] == "lag"
            send(form_of(user), "read", told("2"))
            await until(lambda: page.view.document.measured is not None)
            assert page.view.document.measured.settings == {"phase_convention": "lag", "read": {"curve": 2}}

    asyncio.run(flow())


def test_a_curve_is_calibrated_anew_for_another_instrument(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            await dropped(page)
            before = page.view.session.measured.curve.attrs["k"]
            page.view.edit(page.view.document.put(("cantilever", "k"), "3 N/m"))
            await page.view.draw()
            assert before != page.view.session.measured.curve.attrs["k"] == 3.0

    asyncio.run(flow())


@pytest.mark.parametrize("of", ["curve", "fit"])
def test_what_is_typed_while_a_curve_or_its_fit_is_written_stays(tmp_path, of):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            session, going, writing = page.view.session, threading.Event(), []
            keep, fit = session.measured.results.keep, fitted_curves.result()
            taken = session.take_measured(raw(), "b.csv", LAG) if of == "curve" else session.take_fit(fit)

            def slow(result):
                if of == "curve" or result is fit:
                    writing.append(result)
                    going.wait(20.0)
                return keep(result)

            session.measured.results.keep = slow
            task = asyncio.create_task(taken)
            await until(lambda: writing)
            page.view.edit(page.view.document.put(("cantilever", "k"), "3 N/m"))
            going.set()
            await task
            assert session.document.value(("cantilever", "k")) == "3 N/m"
            assert bool(session.document.measured.fit) == (of == "fit")

    asyncio.run(flow())


@pytest.mark.slow
def test_a_project_holds_the_measured_curve_with_its_shift_and_fit(tmp_path):
    async def flow():
        async with window(tmp_path / "one", live=False) as (_, page):
            session = page.view.session
            await dropped(page)
            page.plots.measured._change(shift=0.4e-9)
            fit = fitted_curves.result().assign_attrs(session.measured.curve.attrs, **fitted_curves.result().attrs)
            await session._keep_fit(fit, session.document.measured)
            data = project.packed(session.document, session.results, session.measured.results)
        async with window(tmp_path / "two", live=False) as (_, page):
            await page.files.open(data)
            session = page.view.session
            await session.measured.load(session.document)
            assert session.document.measured.shift == 0.4e-9
            assert session.measured.curve.sizes["point"] == 120
            assert session.measured.fit.attrs["chi2"] == fitted_curves.result().attrs["chi2"]

    asyncio.run(flow())


def test_a_project_with_settings_of_no_reader_says_so_and_draws_no_curve(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            await dropped(page)
            page.plots.measured._change(settings={"calibrate": {"evil": "1"}})
            await page.view.draw()
            assert page.view.session.measured.curve is None
            assert "no setting 'evil'" in page.view.session.measured.wrong

    asyncio.run(flow())


def test_the_experiment_matches_a_curve():
    document = matched(Document.of(CASE), beside().curve, 0.5e-9)
    case = document.case()
    zc = case.experiment.distances()
    assert np.isclose(zc.max(), 40.5e-9) and np.isclose(zc.min(), 5.5e-9)
    assert np.isclose(case.drive.A0, 20e-9, rtol=1e-3)


def stiff(tmp_path):
    """Return a session at the stiff sample's case beside the true one, with the shipped curve."""
    session = Session({}, tmp_path)
    case = fitted_curves.case_of("stiff").replace("sample.youngs_modulus", 1.9e9)
    fit = {"free": ["sample.youngs_modulus"], "search": False}
    document = Document.of(case).put(("fit",), fit)
    session.document = document.put(("experiment",), {"kind": "approach", "zc": ["34 nm", "20 nm"]})
    return session


def test_a_fit_stays_shut_until_lever_and_tip_are_confirmed(tmp_path):
    data = (files("dforce.library") / "measured" / "stiff.csv").read_bytes()

    async def flow():
        async with window(tmp_path, stiff(tmp_path), live=False) as (user, page):
            session, panel = page.view.session, element(user, MeasuredPanel)
            await dropped(page, data, "stiff.csv")
            page.plots.measured.show()
            assert panel.props["lever"] == "f0 = 70 kHz, k = 2.7 N/m, Q = 180, R = 8 nm"
            assert panel.props["unconfirmed"].startswith("Confirm lever and tip")
            with pytest.raises(df.ParameterError, match="Confirm lever and tip"):
                await session.fit(page.view.document)
            assert session.fitting is None
            send(panel, "confirm")
            page.plots.measured.show()
            assert panel.props["unconfirmed"] == ""
            # another lever, by hand or by another case, is asked about anew, and so is another curve
            page.view.edit(page.view.document.put(("cantilever", "k"), "40 N/m"))
            page.plots.measured.show()
            assert "k = 40 N/m" in panel.props["lever"] and panel.props["unconfirmed"]
            send(panel, "confirm")
            page.plots.measured.show()
            assert panel.props["unconfirmed"] == ""
            await dropped(page, data, "stiff.csv")
            page.plots.measured.show()
            assert panel.props["unconfirmed"]

    asyncio.run(flow())


def test_a_lever_is_chosen_from_the_library_or_typed(tmp_path):
    data = (files("dforce.library") / "measured" / "stiff.csv").read_bytes()

    async def flow():
        async with window(tmp_path, stiff(tmp_path), live=False) as (user, page):
            panel = element(user, MeasuredPanel)
            await dropped(page, data, "stiff.csv")
            send(panel, "confirm")
            send(panel, "library", "PPP-NCHR")
            page.plots.measured.show()
            assert panel.props["lever"] == "" and "Quality factor is missing" in panel.props["missing"]
            send(panel, "lever", {"name": "Q", "text": "400"})
            page.plots.measured.show()
            assert panel.props["lever"] == "f0 = 330 kHz, k = 42 N/m, Q = 400, R = 7 nm" and not panel.props["missing"]
            assert panel.props["unconfirmed"]  # another lever than the one that was confirmed
            send(panel, "lever", {"name": "k", "text": "37 N/m"})
            send(panel, "lever", {"name": "R", "text": "9 nm"})
            page.plots.measured.show()
            assert "k = 37 N/m" in panel.props["lever"] and "R = 9 nm" in panel.props["lever"]
            # without a unit, in the unit that the form shows
            send(panel, "lever", {"name": "f0", "text": "70"})
            send(panel, "lever", {"name": "R", "text": "8,5"})
            await until(lambda: "f0 = 70 kHz" in panel.props["lever"] and "R = 8.5 nm" in panel.props["lever"])
            assert [one["name"] for one in panel.props["typed"]] == ["f0", "k", "Q", "R"]

    asyncio.run(flow())


def test_what_a_range_cannot_tell_stands_at_its_field_before_the_fit(tmp_path):
    data = (files("dforce.library") / "measured" / "air.csv").read_bytes()
    session = Session({}, tmp_path)
    free = [fitted_curves.E, fitted_curves.H]
    document = Document.of(fitted_curves.case_of("air")).put(("fit",), {"free": free, "search": False})
    session.document = document.put(("experiment",), {"kind": "approach", "zc": ["12 nm", "2 nm"]})

    async def flow():
        async with window(tmp_path, session, live=False) as (_, page):
            await dropped(page, data, "air.csv")
            modulus, hamaker = (fit_at(page, path) for path in (MODULUS, ("forces", 0, "hamaker")))
            await until(lambda: modulus.props["note"], 120.0)
            assert "does not depend on it" in modulus.props["note"] and "youngs_modulus" not in modulus.props["note"]
            assert hamaker.props["note"] == ""
            # what is fitted no longer is not spoken of
            send(modulus, "free", False)
            assert modulus.props["note"] == ""

    asyncio.run(flow())


@pytest.mark.long
def test_safe_settings_are_found_for_the_sample_of_a_fit(tmp_path):
    data = (files("dforce.library") / "measured" / "stiff.csv").read_bytes()
    best = fitted_curves.case_of("air").to_toml(complete=True)

    async def flow():
        async with window(tmp_path, stiff(tmp_path), live=False) as (user, page):
            session, panel = page.view.session, element(user, MeasuredPanel)
            await dropped(page, data, "stiff.csv")
            session.measured.fit = fitted_curves.result().assign_attrs(case=best)
            send(panel, "safe", "1 furlong")
            await until(lambda: session.measured.safe is not None and not session.measured.safe.busy)
            page.plots.measured.show()
            assert "limit" in panel.props["unsafe"].lower() and panel.props["findings"] == []
            send(panel, "safe", "0.2")  # in nN, as shown
            await until(lambda: session.measured.safe.result is not None, 120.0)
            page.plots.measured.show()
            told = df.safe_settings(session.measured.fit, "0.2 nN", page.view.document.set_point)
            assert "biased" in told.attrs["findings"][0]  # a point of this fit failed
            assert panel.props["findings"] == told.attrs["findings"] and not panel.props["unsafe"]
            session.look(dataclasses.replace(session.document, set_point=0.6))  # beside the field of another set point
            page.plots.measured.show()
            assert panel.props["set_point"] == "60 %" and panel.props["findings"] == []

    asyncio.run(flow())


@pytest.mark.slow
def test_the_force_behind_a_curve_is_reconstructed_with_its_gaps(tmp_path):
    lines = (files("dforce.library") / "measured" / "stiff.csv").read_bytes().splitlines(keepends=True)
    data = b"".join([*lines[:2], *lines[2::2]])  # half of the points have the gap, too

    async def flow():
        async with window(tmp_path, stiff(tmp_path), live=False) as (user, page):
            session, panel = page.view.session, element(user, MeasuredPanel)
            await dropped(page, data, "stiff.csv")
            force = page.plots.reconstruction
            force.open()
            send(force.element, "start")  # shut until lever and tip are confirmed
            await asyncio.sleep(0.1)
            assert force.job is None and force.element.props["unconfirmed"]
            send(panel, "confirm")
            send(force.element, "start")
            await until(lambda: force.job is not None and force.job.result is not None, 120.0)
            force.show()
            told, shown = (
                df.reconstruct(page.plots.measured.beside().moved(), page.view.document.case()),
                force.element.props,
            )
            gaps = [as_sentence(line) for line in str(told.attrs["notes"]).splitlines()]
            assert shown["gaps"] == gaps and "force unknown" in gaps[0]
            assert shown["holds_for"] == "for k = 2.7 N/m, Q = 180" and not shown["stale"]
            send(force.element, "keep")
            await until(lambda: len(session.document.results) == 1)
            page.plots.measured._change(shift=0.4e-9)
            force.show()
            assert force.element.props["stale"]

    asyncio.run(flow())


def test_the_script_of_the_window_fits_where_there_is_a_fit(workdir, monkeypatch):
    (workdir / "curve.csv").write_bytes(csv())
    drawn, fitted = [], []
    monkeypatch.setattr(df.plot, "save", lambda axes, path, *how: drawn.append(path))
    monkeypatch.setattr(
        df, "fit", lambda case, data: fitted.append((case.fit.free, data.attrs)) or fitted_curves.result()
    )
    free = Document.of(CASE).put(("fit", "free"), [fitted_curves.H])
    for fit, pictures in (("", 2), ("2", 3)):
        drawn.clear()
        document = dataclasses.replace(free, measured=MeasuredData("1", "curve.csv", LAG, 1.5e-9, 2.0, fit=fit))
        exec(script_of(document), {})
        assert len(drawn) == pictures and len(fitted) == pictures - 2
    assert fitted[0][0] == (fitted_curves.H,) and "free_amplitude" in fitted[0][1]


def test_a_parameter_left_at_its_default_can_be_fitted():
    document = Document.of(
        df.example("figure-3-air").replace(forces=[df.forces.DMT(hamaker=2e-20), df.forces.KelvinVoigt()])
    )
    assert document.value(("forces", 1)) == {"model": "kelvin_voigt"}  # nothing typed
    listed = {row.name: row.value for row in fitting.rows(document)}
    assert listed["forces.kelvin_voigt.viscosity"] == "100 Pa s"
    [row] = [row for row in fitting.rows(document) if row.name == "forces.kelvin_voigt.viscosity"]
    assert fitting.with_free(document, row, True).case().fit.free == ("forces.kelvin_voigt.viscosity",)


THERMAL = "frequency (Hz),PSD (m^2/Hz){}\n" + "".join(f"{6e4 + n},1e-24{{}}\n" for n in range(50))


@pytest.mark.parametrize("more", [("", ""), (",fit (m^2/Hz)", ",2e-24"), (",fit (m^2/Hz),residual", ",2e-24,0.5")])
def test_a_thermal_spectrum_is_not_asked_for_heights_that_it_does_not_have(tmp_path, more):
    data = THERMAL.format(more[0], *[more[1]] * 50).encode()
    with pytest.raises(reading.SpectrumFound):
        reading.curve_from(data, "thermal.csv", LAG, CASE, tmp_path)


def test_a_thermal_spectrum_that_is_dropped_becomes_the_lever(tmp_path):
    data = (files("dforce.library") / "measured" / "thermal.csv").read_bytes()
    told = df.thermal_tune(str(files("dforce.library") / "measured" / "thermal.csv"))

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            await page.files.open(data, "thermal.csv")
            form = element(user, SaveForm)
            assert "f0 = " in form.props["why"] and "±" in form.props["why"]
            send(form, "save", ["25 degC", "static"])
            await until(lambda: "given" in (page.view.document.value(("fit",)) or {}))
            case = page.view.document.case()
            for name, (value, error) in told.as_table().items():  # typed with two digits of the error
                assert getattr(case.cantilever, name) == pytest.approx(value, abs=0.05 * error)
            assert case.fit.given["cantilever.k"] == pytest.approx([told.k, told.k_error])

    asyncio.run(flow())


def test_a_spectrum_in_volts_asks_for_its_sensitivity(tmp_path):
    frequency, density = measured_curve.spectrum()
    rows = "".join(f"{f:.3f},{1e14 * s:.6e}\n" for f, s in zip(frequency, density, strict=True))
    data = f"frequency (Hz),PSD (V^2/Hz)\n{rows}".encode()
    with pytest.raises(df.ParameterError) as refused:
        reading.tune_from(data, "volts.csv", {}, tmp_path)
    assert "sensitivity" in reading.tune_questions(str(refused.value), {})
    found = reading.tune_from(data, "volts.csv", {"sensitivity": "100 nm/V", "calibrated": "mode"}, tmp_path)
    assert found.k == pytest.approx(measured_curve.K, rel=0.1)
    bare = {"sensitivity": "100", "calibrated": "mode", "temperature": "25"}  # as the form shows: in nm/V and degC
    assert reading.tune_from(data, "volts.csv", bare, tmp_path) == found


def test_a_file_with_too_few_columns_is_not_asked_for_the_missing_ones(tmp_path):
    data = b"time (s),volts (V)\n" + b"".join(b"%d,%d\n" % (n, n * n % 7) for n in range(30))
    with pytest.raises(df.ResultError, match="has 2 columns of numbers; a curve has height, amplitude and phase"):
        reading.curve_from(data, "notes.csv", LAG, CASE, tmp_path)


def test_a_confirmed_lever_is_kept_with_the_document():
    measured_curve = MeasuredData("1", "curve.csv", LAG, confirmed={"k": "2.7 N/m"})
    document = dataclasses.replace(Document.of(CASE), measured=measured_curve)
    assert Document.from_plain(document.to_plain()) == document


def test_a_value_of_a_fit_names_the_k_and_the_r_for_which_it_holds():
    case = fitted_curves.case_of("stiff").to_toml(complete=True)
    assert fitting.holds_for(case) == "for k = 2.7 N/m, Q = 180, R = 8 nm"
    assert fitting.holds_for(case, ("cantilever.k", "sample.youngs_modulus")) == "for Q = 180, R = 8 nm"
    assert fitting.holds_for(case, ("tip.radius",)) == "for k = 2.7 N/m, Q = 180"


@pytest.mark.slow
def test_a_fit_is_made_told_and_taken_over(tmp_path):
    data = (files("dforce.library") / "measured" / "stiff.csv").read_bytes()

    async def flow():
        async with window(tmp_path, stiff(tmp_path), live=False) as (user, page):
            session, panel = page.view.session, element(user, MeasuredPanel)
            await dropped(page, data, "stiff.csv")
            page.plots.measured.show()
            assert panel.props["free"] == ["Young's modulus of the sample"]
            assert [path for path, one in at_fields(page).items() if one.props["free"]] == [MODULUS]
            send(panel, "confirm")
            send(panel, "fit")
            await until(lambda: session.measured.fit is not None, 60.0)
            fit = session.measured.fit
            value, error = (float(fit[name].sel(parameter="sample.youngs_modulus")) for name in ("value", "error"))
            assert abs(value - 2e9) < 3.0 * error
            await until(lambda: fit_at(page, MODULUS).props["found"])
            page.plots.measured.show()
            found = fit_at(page, MODULUS).props["found"]
            assert "±" in found and found.endswith("GPa for k = 2.7 N/m, Q = 180, R = 8 nm")
            number, _, given = found.partition(" for ")
            assert panel.props["answers"] == [f"Young's modulus of the sample: {number}", f"For {given}"]
            assert not panel.props["stale"]
            used = fit["used"].values
            before = of(show(page, df.run(page.view.document.case())), "measured phase")
            assert page.plots.measured.label == f"Fit (χ²/ν {fit.attrs['chi2'] / fit.attrs['degrees_of_freedom']:.2g})"
            send(panel, "take")
            # the points stay where they are until the curve of the new values is there
            assert of(page.view.compose(page.view.result), "measured phase")[0] == pytest.approx(before[0])
            assert np.isclose(page.view.document.case().sample.youngs_modulus, value, rtol=1e-5)
            shift = page.view.document.measured.shift
            assert shift == float(fit["value"].sel(parameter="zc_offset"))
            heights = session.measured.curve["height"].values + shift
            zc = page.view.document.case().experiment.distances()
            assert zc.min() < heights.min() + 0.1e-9 and zc.max() > heights.max() - 0.1e-9  # it was from 34 nm to 20 nm
            page.plots.measured.show()
            assert not panel.props["stale"]
            # with what was taken over the model passes through the measured points
            best = df.Case.from_toml(fit.attrs["case"]).experiment
            both = df.run(page.view.document.case().replace(experiment=best))
            left = of(show(page, both), "residual phase")[0]
            assert np.allclose(left, fit["phase_residual"].values[used, 0], atol=0.1)
            softer = df.run(case_of(both).replace("sample.youngs_modulus", "1 GPa"))
            moved = of(show(page, softer), "residual phase")[0]  # those of the curve that is drawn
            assert np.nanstd(moved) > 2.0 * np.std(left)
            model = both.sel(direction="retract")
            turned = session.measured.curve["phase"].values - page.view.document.measured.turn
            near = np.flatnonzero((session.measured.curve["branch"].values == -1) & used)
            zc = session.measured.curve["height"].values + page.view.document.measured.shift
            order = np.argsort(model["zc"].values)
            told = np.interp(zc[near], model["zc"].values[order], np.ravel(model["phase"].values)[order])
            assert abs(np.mean(turned[near] - told)) < 4.0 * 0.3 / np.sqrt(len(near))
            lines = {one.get("name") for one in page.view.compose(both)["data"]}
            page.view.edit(page.view.document.put(("cantilever", "k"), "3 N/m"))
            page.plots.measured.show()
            assert panel.props["stale"] and page.plots.measured.label == "Fit"  # the χ² is of another case
            assert lines - {one.get("name") for one in page.view.compose(both)["data"]} == {"best fit"}

    asyncio.run(flow())


@pytest.mark.slow
def test_a_fit_that_is_stopped_keeps_the_best_so_far(tmp_path):
    data = (files("dforce.library") / "measured" / "stiff.csv").read_bytes()

    async def flow():
        session = stiff(tmp_path)
        session.document = session.document.put(("fit", "search"), True)
        async with window(tmp_path, session, live=False) as (user, page):
            await dropped(page, data, "stiff.csv")
            send(element(user, MeasuredPanel), "confirm")
            running = asyncio.create_task(session.fit(page.view.document))
            await until(lambda: session.fitting is not None and (session.fitting.done > 0 or running.done()), 60.0)
            assert session.fitting.error == ""
            send(element(user, MeasuredPanel), "stop")
            await asyncio.wait_for(running, 60.0)
            assert session.measured.fit is None or session.measured.fit.attrs["interrupted"]
            await session.measured.load(session.document)
            assert session.measured.fit.attrs["interrupted"]
            page.plots.measured.show()
            panel = element(user, MeasuredPanel).props
            assert "stopped" in panel["answers"][0] and "stopped" not in panel["summary"]  # once

    asyncio.run(flow())


def test_what_cannot_be_known_is_said_beside_its_row():
    fit = fitted_curves.result()
    name = str(fit["parameter"].values[0])
    assert fitting.note(fit.assign(seen=fit["seen"].copy(data=[False, True])), name) == fitting.NOT_SEEN
    endless = fit.assign(error=fit["error"].copy(data=[np.inf, 1e-11])).assign_attrs(products=f"{name} x tip.radius")
    assert fitting.note(endless, name) == f"Only a product is constrained: {name} x tip.radius"
    assert (fitting.found(endless, name), "±" in fitting.found(fit, name)) == ("", True)


def test_a_value_without_a_unit_is_taken_over_with_as_many_digits_as_others():
    fit = fitted_curves.result()
    fit = fit.isel(parameter=[0]).assign_coords(parameter=["cantilever.Q"], unit=("parameter", ["1"]))
    fit = fit.assign(value=fit["value"].copy(data=[26.6025462713874]))
    taken = fitting.taken_over(Document.of(CASE), fit)
    assert taken.value(("cantilever", "Q")) == 26.6025


def test_a_fit_with_a_given_value_is_of_the_case_that_asked_for_it():
    asked = fitted_curves.case_of("air").replace(
        fit={"free": [fitted_curves.H], "search": False, "given": {"cantilever.k": "1.0(1) N/m"}}
    )
    fit = df.fit(asked, fitted_curves.data_of("air"))
    assert fitting.is_of(fit, Document.of(asked))
    assert not fitting.is_of(fit, Document.of(asked.replace("cantilever.Q", 100)))


def test_a_refusal_of_a_fit_stands_at_the_parameter_that_it_is_about(tmp_path):
    data = (files("dforce.library") / "measured" / "stiff.csv").read_bytes()

    async def flow():
        async with window(tmp_path, stiff(tmp_path), live=False) as (user, page):
            await dropped(page, data, "stiff.csv")
            panel = element(user, MeasuredPanel)
            send(panel, "confirm")
            radius = fit_at(page, ("tip", "radius"))
            send(radius, "free", True)
            send(panel, "fit")
            await until(lambda: page.view.session.fitting is not None and not page.view.session.fitting.busy)
            await until(lambda: "product" in radius.props["note"] or "tip" in radius.props["note"].lower())
            assert page.view.session.measured.fit is None
            failed = panel.props["failed"]  # where Fit was pressed, too
            assert failed.startswith(
                "“Radius of the tip's apex” and “Young's modulus of the sample” cannot both be fitted"
            )
            send(radius, "free", False)  # what was refused is no longer asked for
            page.plots.measured.show()
            assert not panel.props["failed"]

    asyncio.run(flow())


def test_advice_on_a_fit_names_only_what_the_window_has_a_field_for(tmp_path):
    data = (files("dforce.library") / "measured" / "stiff.csv").read_bytes()

    async def flow():
        async with window(tmp_path, stiff(tmp_path), live=False) as (user, page):
            await dropped(page, data, "stiff.csv")
            panel = element(user, MeasuredPanel)
            send(panel, "confirm")
            radius = fit_at(page, ("tip", "radius"))
            send(radius, "free", True)
            send(panel, "fit")
            await until(lambda: radius.props["note"])
            return radius.props["note"]

    note = asyncio.run(flow())
    assert "prior" not in note.lower() or "prior" in SCRIPT.read_text(encoding="utf-8").lower()


def test_a_case_that_is_saved_says_how_its_curve_is_read(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            await dropped(page)
            text = page.view.document.case().to_toml()
            (tmp_path / "curve.csv").write_bytes(csv())
            (tmp_path / "case.toml").write_text(text)
            case = df.load_case(tmp_path / "case.toml")
            from dforce.inverse.fitting.load import measured_curve as loaded

            assert loaded(case, None).sizes["point"] == 120

    asyncio.run(flow())


@pytest.mark.slow
def test_a_fit_is_opened_with_its_curve_and_its_case_and_its_report_is_saved(tmp_path, catch):
    case = fitted_curves.case_of("stiff")
    fit = df.fit(case, fitted_curves.data_of("stiff"), free=["sample.youngs_modulus"], search=False)
    data = written(lambda path: df.write(fit, path), ".nc")

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            await page.files.open(data, "fit.nc")
            session = page.view.session
            await session.measured.load(session.document)
            assert session.measured.curve.sizes["point"] == fit.sizes["point"]
            page.plots.measured.show()
            panel = element(user, MeasuredPanel)
            assert not panel.props["stale"] and panel.props["report"] == df.fit_report(fit)
            sent = catch()
            send(panel, "report")
            assert sent == [("curve-fit.txt", f"{df.fit_report(fit)}\n\n{df.chi2_in_words(fit)}\n")]
            send(panel, "take")
            value = float(fit["value"].sel(parameter="sample.youngs_modulus"))
            assert page.view.document.case().sample.youngs_modulus == pytest.approx(value, rel=1e-5)

    asyncio.run(flow())


def test_values_of_a_fit_come_with_a_range_that_covers_the_measured_curve():
    curve, shift = beside().curve, 0.5e-9
    wide = matched(Document.of(CASE), curve, shift)
    assert covering(wide, curve, shift) is wide
    assert covering(wide, curve, shift + 0.05e-9) is wide
    narrow = wide.put(("experiment", "zc"), ["30 nm", "20 nm"]).put(("drive", "A0"), "19 nm")
    case = covering(narrow, curve, shift).case()
    assert case.experiment == wide.case().experiment and case.drive.A0 == 19e-9  # as it was fitted
    halfway, sweep = narrow.put(("drive", "A0"), "-"), Document.of(df.example("resonance-curve"))
    assert covering(halfway, curve, shift) is halfway and covering(sweep, curve, shift) is sweep


def test_a_measured_curve_as_dforce_wrote_it_is_opened(tmp_path):
    data = written(lambda path: df.write(df.calibrate(raw(), CASE), path), ".nc")

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            await page.files.open(data, "curve.nc")
            await page.view.session.measured.load(page.view.document)
            assert page.view.session.measured.curve.sizes["point"] == 120

    asyncio.run(flow())


def grouped(folder, change=lambda file: None):
    """Return the bytes of an HDF5 file with a curve in a group, as instruments write them."""
    path = folder / "grouped.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("curve")
        for name, values, unit in zip(("height", "amplitude", "phase"), measured_curve.numbers(), "mm°", strict=True):
            group.create_dataset(name, data=values).attrs["units"] = unit
        change(file)
    return path.read_bytes()


def test_a_curve_in_a_group_of_an_hdf5_file_is_read(tmp_path):
    curve = reading.curve_from(grouped(tmp_path), "curve.h5", LAG, CASE, tmp_path / "there")
    assert np.allclose(curve["amplitude"], measured_curve.numbers()[1])


def test_a_measured_file_that_points_to_another_file_is_not_read(tmp_path):
    link = h5py.ExternalLink("/etc/passwd", "/x")
    data = grouped(tmp_path, lambda file: file["curve"].__setitem__("more", link))
    with pytest.raises(df.ResultError, match="points to other"):
        reading.curve_from(data, "curve.h5", LAG, CASE, tmp_path / "there")


def test_a_place_in_the_same_file_is_read_once(tmp_path):
    data = grouped(tmp_path, lambda file: file.__setitem__("again", h5py.SoftLink("/curve")))
    assert reading.curve_from(data, "curve.h5", LAG, CASE, tmp_path / "there").sizes["point"] == 120


def test_a_file_that_is_too_large_for_a_curve_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "MOST_BYTES", 100)
    with pytest.raises(df.ResultError, match="too many for a curve"):
        reading.curve_from(csv(), "curve.csv", LAG, CASE, tmp_path)


def test_the_name_of_a_file_or_a_key_begins_a_sentence_as_it_is_written():
    assert as_sentence("map.csv holds 2 curves") == "map.csv holds 2 curves."
    assert as_sentence("mode_sensitivity goes with it") == "mode_sensitivity goes with it."
    assert as_sentence("there is no file") == "There is no file."


def test_a_curve_of_a_file_with_a_long_name_is_there_after_a_restart(tmp_path):
    measured = asyncio.run(MeasuredSession(tmp_path).keep(raw(), f"{'long-' * 60}.csv", LAG))
    document = dataclasses.replace(Document.first(), measured=measured)
    assert Document.from_plain(document.to_plain()) == document
    assert document.measured.name.endswith("long-.csv")


def test_a_curve_that_is_opened_first_gives_the_case_its_name(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            await page.files.open_measured(csv(), "lab.csv", {"phase_convention": "lag", "height_grows": "away"})
            assert page.view.document.measured.name == "lab.csv"
            assert page.view.document.title == "lab" and page.view.document.value(("about",)) is None

    asyncio.run(flow())
