"""What a page draws: pictures chosen, results kept, and the motion at a point."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest
from simulated import click, element, send, show, until, window

import dforce as df
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.kept import DifferencesTable, Strip
from dforce.gui.curves.motion import Drawing
from dforce.gui.curves.panel import Scene
from dforce.gui.curves.plots import Picker
from dforce.gui.document.session import Session
from dforce.results.curves import Picture

CASE = df.example("figure-3-air-jump").set("experiment.zc.points=23")


def test_quantities_and_axis_are_chosen_and_kept_in_the_document(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            session = page.view.session
            show(page, df.run(CASE))
            picker = element(user, Picker)
            assert [one["name"] for one in picker.props["all"]][:2] == ["zc", "amplitude"]
            send(
                picker, "own", {"x": "amplitude", "y": ["peak_force", "phase"], "together": True, "logarithmic": False}
            )
            assert session.document.plots == (Picture("amplitude", ("phase", "peak_force"), True),)
            figure = show(page, page.view.result)
            assert figure["layout"]["xaxis"]["title"]["text"] == "amplitude <i>A</i> (nm)"

    asyncio.run(flow())


def test_a_new_axis_takes_quantities_that_go_along_with_it(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            session = page.view.session
            show(page, df.run(df.example("table-1-am")))
            given = {"x": "frequency", "y": ["deflection", "force"], "together": False, "logarithmic": False}
            send(element(user, Picker), "own", given)
            assert session.document.plots[0].y == ("spectrum",)

    asyncio.run(flow())


@pytest.mark.parametrize("x", ["zc", "phase"])
def test_a_click_on_a_curve_shows_the_motion_of_that_very_point(tmp_path, x):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            session = page.view.session
            result = df.run(CASE)
            session.document = session.document.__class__.of(CASE)
            session.look(session.document.__class__(session.document.table, plots=(Picture(x, ("amplitude",)),)))
            show(page, result)
            clicked = page.plots.drawn.traces
            index = clicked[1][1].places.tolist().index(11)  # there is a gap at the jump
            click(page, curve=1, index=index, x=0, y=0, id="amplitude")
            drawing = element(user, Drawing)
            await until(lambda: drawing.props.get("motion"))
            assert clicked[1][1].direction == "retract"
            point = result.isel(zc=11, direction=1)
            shown = {part["symbol"]: part["text"] for part in drawing.props["places"]}
            assert shown["z<sub>c</sub>"] == f"{1e9 * float(point['zc']):.4g} nm"
            deflection = next(trace for trace in drawing.props["motion"]["traces"] if trace["name"] == "deflection")
            assert deflection["high"] == pytest.approx(1e9 * float(point["max_deflection"]), rel=1e-3)
            page.plots.set_point.open()
            assert drawing.props["motion"] is None  # what is not seen does not move

    asyncio.run(flow())


@pytest.mark.parametrize("state", [1, 2])
@pytest.mark.slow
def test_a_click_on_the_map_of_basins_shows_the_state_that_is_reached_from_there(tmp_path, state):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            result = df.run(df.example("figure-3-basins"))
            show(page, result)
            row, column = map(int, np.argwhere(result["reached"].values == state)[0])
            click(page, curve=0, index=[row, column])
            drawing = element(user, Drawing)
            await until(lambda: drawing.props.get("motion"))
            assert f"state {state}" in [part["text"] for part in drawing.props["places"]]
            deflection = next(trace for trace in drawing.props["motion"]["traces"] if trace["name"] == "deflection")
            wanted = 1e9 * float(result["max_deflection"].sel(state=state))
            assert deflection["high"] == pytest.approx(wanted, rel=1e-3)

    asyncio.run(flow())


def test_the_motion_of_an_unstable_state_says_that_no_experiment_shows_it(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            show(page, df.run(df.example("figure-3-branches")))
            curve = next(n for n, trace in enumerate(page.plots.drawn.traces) if trace and not trace[1].stable)
            line = page.plots.drawn.traces[curve][1]
            click(page, curve=curve, index=int(np.flatnonzero(line.places >= 0)[20]))
            drawing = element(user, Drawing)
            await until(lambda: drawing.props.get("motion"))
            assert "No experiment shows" in drawing.props["note"]

    asyncio.run(flow())


def test_results_are_kept_renamed_hidden_and_removed(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            session = page.view.session
            show(page, df.run(CASE))
            strip = element(user, Strip)
            send(strip, "keep")
            await until(lambda: session.document.results)
            (kept,) = session.document.results
            assert [layer.name for layer in page.plots.kept.layers(page.view.result)] == [kept.name]
            show(page, df.run(CASE.replace("drive.A0", "5 nm")))
            assert [layer.name for layer in page.plots.kept.layers(page.view.result)] == [kept.name, "now"]
            send(strip, "rename", {"id": kept.id, "name": "<b>first</b>"})
            page.plots.differences.open()
            show(page, page.view.result)
            table = element(user, DifferencesTable)
            assert table.props["names"] == ["<b>first</b>", "now"]
            assert [row["values"] for row in table.props["rows"] if row["path"] == "drive.A0"] == [("10 nm", "5 nm")]
            own = df.forces.Custom(**df.forces.Custom.example)
            show(page, df.run(CASE.replace(forces=[own, *CASE.forces])))
            models = [row["values"] for row in table.props["rows"] if row["path"].endswith("model")]
            assert ("–", "Own law") in models
            send(strip, "shown", {"id": kept.id, "shown": False})
            assert [layer.name for layer in page.plots.kept.layers(page.view.result)] == ["now"]
            send(strip, "remove", kept.id)
            await until(lambda: not session.results.names())
            assert session.document.results == ()

    asyncio.run(flow())


def test_results_and_pictures_survive_a_restart_an_undo_and_another_example(tmp_path):
    store: dict[str, object] = {}

    async def flow():
        session = Session(store, tmp_path)
        async with window(tmp_path, session, live=False) as (_, page):
            await session.keep(df.run(CASE))
            session.look(session.document.__class__(session.document.table, results=session.document.results,
                                                    plots=(Picture("zc", ("phase",)),)))  # fmt: skip
            await page._open("table-1-am")
            session.undo()
            kept = session.document.results, session.document.plots
            # they were of another case than the one that was opened: in the list, not in the picture
            assert ([one.shown for one in kept[0]], kept[1]) == ([False], (Picture("zc", ("phase",)),))
            session.close()
            again = Session(store, tmp_path)
            assert (again.document.results, again.document.plots) == kept
            assert again.results.take(kept[0][0].id).sizes["zc"] == 23

    asyncio.run(flow())


def test_each_column_of_a_table_of_two_results_has_a_heading(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            (panel,) = (one for one in page.plots.pane.panels if one.title == "Thermal tune")
            spectrum = df.thermal_spectrum(CASE, "1 s")
            panel.show(Scene([Layer(spectrum, "one"), Layer(spectrum, "other")], Picture("frequency", ("density",))))
            assert panel.sheet.props["heads"] == ["quantity", "one", "other"]

    asyncio.run(flow())


def test_the_numbers_behind_the_curves_stand_in_a_table_when_asked_for(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            result = df.run(CASE)
            show(page, result)
            sheet = page.plots.numbers.sheet
            assert "rows" not in sheet.props
            page.plots.numbers.open()
            heads = ["curve", "average tip–surface distance (nm)", "amplitude (nm)", "phase lag (°)"]
            assert sheet.props["heads"] == heads
            assert len(sheet.props["rows"]) == 2 * 23
            for place, way in ((5, "approach"), (23 + 5, "retract")):
                point = result.isel(zc=5, tone=0).sel(direction=way)
                wanted = [1e9 * float(point["zc"]), 1e9 * float(point["amplitude"]), float(point["phase"])]
                row = sheet.props["rows"][place]
                assert row[0] == way
                assert [float(cell) for cell in row[1:]] == pytest.approx(wanted, rel=1e-5)

    asyncio.run(flow())


def test_am_fm_shows_its_frequency_shift_and_what_its_formulas_find(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            case = df.example("am-fm").set("experiment.zc.points=5")
            page.view.session.document = page.view.session.document.__class__.of(case)
            result = df.run(case)
            figure = show(page, result)
            assert page.plots.shown == Picture("zc", ("frequency_shift", "drive_ratio"))
            names = [line["name"] for line in figure["data"] if line["meta"] == "frequency_shift"]
            assert any("tone 2" in name for name in names)
            page.plots.material.open()
            rows = dict(page.plots.material.sheet.props["rows"])
            assert (rows["effective modulus"], rows["true effective modulus"]) == ("59 MPa", "54.9 MPa")
            assert any("amplitude of tone 2" in row for row in rows)
            page.plots.beside()
            assert page.plots.answer.props["text"] == df.answer(result)
            assert "an effective modulus of 57." in page.plots.answer.props["text"]

    asyncio.run(flow())


def test_the_answer_names_the_field_to_change_as_the_form_does(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            case = df.example("figure-3-air").replace(
                experiment=df.experiments.Approach(zc={"start": "40 nm", "stop": "35 nm", "points": 5})
            )
            page.view.session.document = page.view.session.document.__class__.of(case)
            show(page, df.run(case))
            page.plots.beside()
            assert "Let “Average distances” stop nearer to the sample" in page.plots.answer.props["text"]

    asyncio.run(flow())


def test_the_table_of_states_has_the_stable_and_the_unstable_apart(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            result = df.run(df.example("figure-3-branches"))
            show(page, result)
            page.plots.numbers.open()
            words = [row[0] for row in page.plots.numbers.sheet.props["rows"]]
            assert list(dict.fromkeys(words)) == ["stable", "unstable"]
            # each piece reaches the next point of the curve
            assert result.sizes["point"] <= len(words) <= result.sizes["point"] + 6

    asyncio.run(flow())
