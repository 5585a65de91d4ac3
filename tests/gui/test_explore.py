"""Results over parameters in the window: plans, sweeps and stores, and states against a number of the case."""

from __future__ import annotations

import asyncio
import base64
import dataclasses
import functools
import io
import json
import zipfile

import numpy as np
import pytest
import xarray as xr
from simulated import element, send, until, window

import dforce as df
from dforce.gui.case.values import rows_of
from dforce.gui.document.document import Document
from dforce.gui.document.store import ResultStore
from dforce.gui.files import file_menu, project, uploads
from dforce.gui.study import explore, pictures
from dforce.gui.study.panel import ExplorePanel
from dforce.gui.study.parameter_study import SECTIONS, Over, PlanJob, SweepJob, Varied, sweep_job
from dforce.validity import advice_in

CASE = df.example("figure-3-air").set("experiment.zc.points=41")
OVER = {"sample.youngs_modulus": ["0.5 GPa", "1 GPa", "2 GPa"], "drive.A0": ["8 nm", "10 nm"]}
KEPT = ("peak_force", "phase", "max_indentation")


@functools.cache
def swept():
    return df.sweep(CASE, over=OVER, quantities=KEPT)


@functools.cache
def states():
    return df.sweep(df.example("hysteresis"), over={"drive.A0": ["18 nm", "20 nm", "22 nm"]}, at_set_point=0.8)


@functools.cache
def planned():
    case = df.example("figure-4-soft")
    grid = {"start": "4 nm", "stop": "12 nm", "points": 5}
    shares = {"start": 0.6, "stop": 0.9, "points": 4}
    return df.plan(case, {"drive.A0": grid}, shares, {"max_indentation": "< 5 nm"})


def test_a_plan_without_a_limit_shows_a_quantity_first_and_no_room_between_limits():
    plan = df.plan(df.example("figure-4-soft"), {"drive.A0": ["8 nm", "10 nm"]}, [0.7, 0.8])
    assert "limit_hit" not in explore.quantities(plan) and not plan.attrs["findings"].startswith("The limits apply")
    names = [trace.get("name") for trace in pictures.figure(plan, explore.fitting(plan, explore.Choice()))["data"]]
    assert "most room" not in names


def numbers(packed):
    values = np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"])
    return values.reshape([int(n) for n in packed["shape"].split(", ")]) if "shape" in packed else values


def test_a_sweep_is_a_map_of_what_is_chosen_at_a_slice():
    result = swept()
    choice = explore.fitting(result, explore.Choice("phase", "A0", "youngs_modulus", {"zc": 7, "direction": 1}))
    trace = pictures.figure(result, choice)["data"][0]
    wanted = result["phase"].isel(zc=7, direction=1, tone=0).transpose("youngs_modulus", "A0").values
    assert np.allclose(numbers(trace["z"]), wanted)
    assert np.allclose(numbers(trace["x"]), [8.0, 10.0])


def test_a_sweep_is_lines_along_one_parameter():
    result = swept()
    choice = explore.fitting(result, explore.Choice("peak_force", "zc", "", {"youngs_modulus": 2}))
    (trace,) = pictures.figure(result, choice)["data"]
    wanted = result["peak_force"].isel(youngs_modulus=2, A0=choice.places["A0"], direction=0).values
    scale = explore.scale_of(result, choice)[0]
    assert np.allclose(numbers(trace["y"]) * scale, wanted, rtol=1e-6)


def test_of_a_store_only_what_is_looked_at_is_read(tmp_path):
    df.sweep(CASE, over=OVER, quantities=KEPT, store=tmp_path / "map.zarr")
    result = df.read(tmp_path / "map.zarr")
    choice = explore.fitting(result, explore.Choice("phase", "A0", "youngs_modulus"))
    figure = pictures.figure(result, choice)
    explore.settings_at(result, explore.picked(result, choice, 8.0, 1.0))
    assert np.allclose(numbers(figure["data"][0]["z"]), numbers(pictures.figure(swept(), choice)["data"][0]["z"]))
    assert not any(result[name].variable._in_memory for name in KEPT)


def test_a_plan_shows_what_is_allowed_and_its_recommended_point():
    plan = planned()
    figure = pictures.figure(plan, explore.fitting(plan, explore.Choice()))
    allowed = plan["allowed"].any("state").transpose("set_point", "A0").values
    fine = np.array(figure["data"][0]["text"])
    steps = [(much - 1) // (few - 1) for much, few in zip(fine.shape, allowed.shape, strict=True)]
    words = fine[:: steps[0], :: steps[1]]
    assert 0 < allowed.sum() < allowed.size
    assert ((words == pictures.NO_LIMIT) == allowed).all()
    (mark,) = [trace for trace in figure["data"] if trace.get("name") == "most room"]
    place = np.argwhere(plan["recommended"].values)[0]
    assert np.isclose(numbers(mark["x"])[0], 1e9 * plan["A0"].values[place[0]])


def test_states_that_are_the_same_in_both_directions_share_a_line():
    result = states()
    choice = explore.fitting(result, explore.Choice("phase", "A0", ""))
    names = [trace["name"] for trace in pictures.figure(result, choice)["data"]]
    assert "repulsive" in names


def test_a_limit_shades_what_it_allows_and_says_where_it_holds():
    result = states()
    choice = explore.fitting(result, explore.Choice("peak_force", "A0", ""))
    force = result["peak_force"].values
    between = 0.5 * float(np.nanmax(force[1]) + np.nanmax(force[2]))
    limit = explore.DrawnLimit(between)
    figure = pictures.figure(result, choice, limit)
    line, shade = figure["layout"]["shapes"]
    scale = explore.scale_of(result, choice)[0]
    assert figure["drag"] and line["y0"] == line["y1"] == pytest.approx(between / scale)
    assert shade["y1"] < line["y0"]
    rising = np.nanmax(force[2]) > np.nanmax(force[1])
    ends = "free amplitude 18 nm to 20 nm" if rising else "free amplitude 22 nm"
    assert ends in explore.allowed(result, choice, limit)
    assert explore.read_limit(result, choice, explore.shown_limit(result, choice, limit), False).value == pytest.approx(
        between, rel=1e-3
    )


@pytest.mark.parametrize("make", [swept, states, planned])
def test_a_file_over_parameters_is_opened_and_a_click_takes_its_settings_over(tmp_path, make):
    data = file_menu.written(lambda path: df.write(make(), path), ".nc")

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            await page.files.open(data, "map.nc")
            panel, explorer = element(user, ExplorePanel), page.plots.explorer
            await until(lambda: explorer.chart.revision > 0)
            assert panel.props["quantities"] and panel.props["x"] == explorer.choice.x
            explorer.choice = explore.fitting(make(), explore.Choice("peak_force", "A0", ""))
            explorer._clicked({"x": 10.0, "y": 0.0})
            assert "Free amplitude" in panel.props["picked"]
            send(panel, "take")
            nearest = make()["A0"].values[np.argmin(np.abs(make()["A0"].values - 10e-9))]
            assert pytest.approx(float(nearest)) == page.view.document.case().drive.A0

    asyncio.run(flow())


def test_a_project_brings_a_result_over_parameters_back_and_what_it_was_computed_of(tmp_path, monkeypatch):
    document, saved = Document.of(CASE), []
    row = next(row for row in rows_of(document, SECTIONS) if row.name == "drive.A0")

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            monkeypatch.setattr(file_menu.ui.download, "content", lambda data, *_: saved.append(data), raising=False)
            study = page.view.session.study
            for over in (Over(swept()), Over(states(), row, document)):
                study.take(over)
                await page.files.save_project()
                study.take(Over(planned()))
                await page.files.open(saved[-1])
                xr.testing.assert_equal(study.result, over.result)
                assert (study.over.row, study.over.document) == (over.row, over.document)
                assert element(user, ExplorePanel).props["quantities"]

    asyncio.run(flow())


@pytest.mark.parametrize("origin", [{"row": "drive.A0"}, {"row": "drive.A0", "document": {"table": []}}])
def test_a_project_with_a_broken_result_over_parameters_is_refused(tmp_path, origin):
    document = Document.of(CASE)
    data = project.packed(document, ResultStore(tmp_path), ResultStore(tmp_path), Over(swept()))
    broken = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(broken, "w") as new:
        plain = json.loads(old.read(project.DOCUMENT)) | {"over": {"origin": origin}}
        new.writestr(project.DOCUMENT, json.dumps(plain))
        new.writestr(project.OVER, old.read(project.OVER))
    with pytest.raises(df.ResultError, match="damaged"):
        project.unpacked(broken.getvalue(), tmp_path)


def test_a_result_over_parameters_that_is_too_large_is_left_out_of_a_project(tmp_path, monkeypatch):
    monkeypatch.setattr(project, "has_room", lambda over: False)
    data = project.packed(Document.of(CASE), ResultStore(tmp_path), ResultStore(tmp_path), Over(swept()))
    assert project.unpacked(data, tmp_path).over is None


def test_a_hostile_file_over_parameters_is_refused(tmp_path):
    result = swept().assign_attrs(over="sample.youngs_modulus")
    result["youngs_modulus"] = result["youngs_modulus"].assign_attrs(units="zorkmid")
    with pytest.raises(df.ResultError, match="cannot be used here"):
        uploads.result_from(file_menu.written(lambda path: df.write(result, path), ".nc"), tmp_path)


def test_states_are_computed_against_a_number_of_the_case(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.view.edit(Document.of(CASE), anew=True)
            explorer, study = page.plots.explorer, page.view.session.study
            explorer.open()
            panel = element(user, ExplorePanel)
            assert "sample.youngs_modulus" in [row["name"] for row in panel.props["rows"]]
            send(panel, "suggest", "drive.A0")
            assert (panel.props["suggested"]["low"], panel.props["suggested"]["high"]) == ("5 nm", "20 nm")
            send(panel, "compute", {"path": "drive.A0", "low": "8 nm", "high": "12 nm", "points": 3})
            await until(lambda: study.result is not None, 60.0)
            shares = {"of": "drive.A0", "start": 1.2, "stop": 0.1, "points": 41}
            case = CASE.replace("experiment.zc", shares)
            wanted = df.sweep(case, over={"drive.A0": ["8 nm", "10 nm", "12 nm"]}, at_set_point=0.8)
            assert np.allclose(study.result["phase"], wanted["phase"], equal_nan=True)
            await until(lambda: panel.props["quantity"] == "peak_force" and panel.props["y"] == "")
            assert panel.props["found"][-1].startswith(
                "The picture shows the states on approach and retract. “All states” adds"
            )
            send(panel, "limit", {"on": True})
            explorer._dragged(1.0)
            scale = explore.scale_of(study.result, explorer.choice)[0]
            assert explorer.limit.value == pytest.approx(scale)
            page.view.edit(page.view.document.put(("drive", "A0"), "9 nm"))
            assert panel.props["note"] == ""
            page.view.edit(page.view.document.put(("cantilever", "Q"), 200.0))
            assert "earlier case" in panel.props["note"]

    asyncio.run(flow())


@pytest.mark.parametrize(
    ("ends", "points", "words"),
    [(("2 nm", "1 nm"), 3, "does not rise"), (("1 nm", "2 nm"), 1, "between 2 and"), (("1 nm", "2 kg"), 3, "kg")],
)
def test_a_range_that_makes_no_sense_is_refused(ends, points, words):
    document = Document.of(CASE)
    row = next(row for row in rows_of(document, ("drive",)) if row.name == "drive.A0")
    with pytest.raises(df.ParameterError, match=words):
        sweep_job(document, CASE, Varied(row, *ends, points))


def test_an_end_without_a_unit_has_the_unit_of_the_parameter():
    row = next(row for row in rows_of(Document.of(CASE), ("drive",)) if row.name == "drive.A0")
    assert Varied(row, "8", "12,5", 3).grid("m") == Varied(row, "8 nm", "12.5 nm", 3).grid("m")


def test_a_case_without_an_approach_gets_one_that_suits_it():
    dwell = df.example("table-1-am")
    document = Document.of(dwell)
    row = next(row for row in rows_of(document, ("drive",)) if row.name == "drive.A0")
    job = sweep_job(document, dwell, Varied(row, "10 nm", "20 nm", 2))
    assert isinstance(job.case.experiment, df.experiments.Approach)


def test_distances_follow_the_free_amplitude_so_that_each_approach_begins_in_free_motion():
    case = df.example("hysteresis").set("experiment.zc.points=101").replace("experiment.direction", "approach")
    document = Document.of(case)
    row = next(row for row in rows_of(document, ("drive",)) if row.name == "drive.A0")
    result = sweep_job(document, case, Varied(row, "20 nm", "26 nm", 2)).compute()
    far = case.replace("drive.A0", "26 nm").replace("experiment.zc", ("31 nm", "10 nm"))
    states = df.at_set_point(df.approach(far, zc={"start": "31.2 nm", "stop": "10 nm", "points": 201}))
    shown = result.isel(A0=1).dropna("crossing", how="all", subset=["peak_force"])
    assert shown["regime"].values.tolist() == states["regime"].values.tolist()
    assert shown["peak_force"].values == pytest.approx(states["peak_force"].values, rel=0.02)
    assert "begins_in_contact" not in {piece.name for piece in advice_in(result)}


async def opened(user, page, result, quantity="peak_force"):
    """Return the panel after a result that was computed here against the free amplitude is shown in it."""
    document = page.view.document
    row = next(row for row in rows_of(document, SECTIONS) if row.name == "drive.A0")
    page.view.session.study.take(Over(result, row, document))
    page.plots.explorer.open()
    page.plots.explorer._changed()
    await until(lambda: element(user, ExplorePanel).props["quantity"] == quantity)
    return element(user, ExplorePanel)


def test_the_panel_names_values_without_a_crossing(tmp_path):
    result = states().copy(deep=True)
    for name in result.data_vars:
        if "crossing" in result[name].dims and result[name].dtype.kind == "f":
            result[name][{"A0": 1}] = np.nan

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            panel = await opened(user, page, result)
            assert "20 nm" in f"{panel.props['note']} {panel.props['allowed']}"

    asyncio.run(flow())


def test_the_panel_shows_its_set_point_and_dims_when_another_one_is_chosen(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            panel = await opened(user, page, states())
            assert panel.props["note"] == ""
            assert "80 %" in str({name: panel.props[name] for name in ("title", "allowed", "slices", "axes")})
            page.view.session.look(dataclasses.replace(page.view.document, set_point=0.5))
            assert panel.props["note"] != ""

    asyncio.run(flow())


def test_the_sentence_of_a_limit_says_which_states_are_meant():
    result = states()
    choice = explore.fitting(result, explore.Choice("peak_force", "A0", ""))
    said = explore.allowed(result, choice, explore.DrawnLimit(float(result["peak_force"].max())))
    assert "approach" in said or "branches" in said


def gap(result, **places):
    """Return a copy of a result without states at some places of its parameters."""
    out = result.copy(deep=True)
    for name in out.data_vars:
        if set(places) <= {*out[name].dims} and out[name].dtype.kind == "f":
            out[name][places] = np.nan
    return out


def test_every_gap_of_lines_and_of_maps_is_named_with_its_settings():
    assert explore.gaps_of(gap(states(), A0=1), "peak_force").endswith("values of free amplitude: 20 nm.")
    whole = planned()
    assert explore.gaps_of(gap(whole, A0=[0, 1, 4], set_point=2), "peak_force") == (
        "No state meets the set point at these values of free amplitude: set point 80 %: 4 nm to 6 nm, 12 nm."
    )


def test_the_values_where_a_limit_holds_are_named_with_the_gap_between_them():
    result = states().copy(deep=True)
    result["peak_force"][:] = np.array([[1.0], [3.0], [1.0]]) * 1e-9
    choice = explore.fitting(result, explore.Choice("peak_force", "A0", ""))
    said = explore.allowed(result, choice, explore.DrawnLimit(2e-9))
    assert said.startswith("The limit holds at free amplitude 18 nm, 22 nm, for ")


def test_the_states_of_a_plan_are_named_once():
    choice = explore.fitting(planned(), explore.Choice("max_indentation", "A0", ""))
    said = explore.allowed(planned(), choice, explore.DrawnLimit(0.0))
    assert said == "The limit holds nowhere here." and planned().attrs["findings"].startswith("The limits apply to ")


def test_a_range_is_suggested_for_a_parameter_left_at_its_default_and_taken_over(tmp_path):
    case = df.example("figure-3-air").replace(forces=[df.forces.DMT(hamaker=2e-20), df.forces.KelvinVoigt()])

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.view.edit(Document.of(case), anew=True)
            page.plots.explorer.open()
            panel = element(user, ExplorePanel)
            send(panel, "suggest", "forces.kelvin_voigt.viscosity")
            assert (panel.props["suggested"]["low"], panel.props["suggested"]["high"]) == ("50 Pa s", "200 Pa s")
            page.view.edit(page.view.document.put(("sample", "youngs_modulus"), "1 GPa"))
            send(panel, "suggest", "sample.youngs_modulus")  # in one unit, that of a number typed without one
            assert (panel.props["suggested"]["low"], panel.props["suggested"]["high"]) == ("0.5 GPa", "2 GPa")
            assert {row["name"]: row["unit"] for row in panel.props["rows"]}["sample.youngs_modulus"] == "GPa"
            over = {"forces.kelvin_voigt.viscosity": ["50 Pa s", "80 Pa s"]}
            page.view.session.study.take(Over(df.sweep(page.view.document.case(), over=over, at_set_point=0.8)))
            page.plots.explorer._changed()
            await until(lambda: panel.props["axes"])
            page.plots.explorer._clicked({"x": 80.0, "y": 0.0})
            send(panel, "take")
            assert page.view.document.case().forces[1].viscosity == pytest.approx(80.0)

    asyncio.run(flow())


def test_the_map_of_limits_in_the_panel_ends_at_the_located_boundary():
    plan = planned()
    drawn = pictures.figure(plan, explore.fitting(plan, explore.Choice()))["data"][0]
    words = np.array(drawn["text"])
    x, y = numbers(drawn["x"]) * 1e-9, numbers(drawn["y"])
    for A0, share in zip(plan["edge_A0"].values, plan["edge_set_point"].values, strict=True):
        row = words[np.argmin(np.abs(y - share))]
        for beyond in (0.98, 1.02):  # one of the two is forbidden, and no cell that holds it is green
            colors = {row[np.argmin(np.abs(x - beyond * A0))]}
            if beyond > 1.0:
                assert colors != {pictures.NO_LIMIT}


def test_a_computation_that_is_stopped_is_no_end_of_the_window(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.view.edit(Document.of(CASE), anew=True)
            page.plots.explorer.open()
            panel, study = element(user, ExplorePanel), page.view.session.study
            asked = {
                "path": "drive.A0",
                "low": "8 nm",
                "high": "12 nm",
                "points": 101,
                "limited": "peak_force",
                "limit": "5",
            }
            send(panel, "compute", asked)
            await until(lambda: study.busy)
            assert study.job.limits == {"peak_force": "< 5 nN"}
            send(panel, "stop")
            await until(lambda: not study.busy)
            assert study.job.state == "stopped"

    asyncio.run(flow())


def test_numbers_at_a_logarithmic_axis_are_written_in_full():
    result = df.sweep(CASE, over={"drive.A0": ["1 nm", "2 nm", "4 nm"]}, at_set_point=0.8)
    assert explore.axis_of(result, "A0")[1]["tickformat"] == "~g"


def test_ranges_are_suggested_anew_for_another_case(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.plots.explorer.open()
            panel, document = element(user, ExplorePanel), page.view.document
            assert panel.props["suggested"]["high"] == "20 nm"
            page.view.session.study.job = SweepJob(
                document.case(), document=document, state="failed", error="no states"
            )
            page.plots.explorer.show()
            assert panel.props["failed"] == "No states."
            page.view.open(Document.of(df.example("figure-3-air").replace("drive.A0", "5 nm")))
            assert panel.props["suggested"]["high"] == "10 nm" and panel.props["failed"] == ""

    asyncio.run(flow())


def test_the_limit_that_a_plan_along_one_parameter_keeps_is_drawn(tmp_path):
    plan = planned().isel(set_point=[0])

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            study, document = page.view.session.study, page.view.document
            study.job = PlanJob(document.case(), document=document, limits={"max_indentation": "< 5 nm"})
            study.job.result = plan
            study.take(Over(plan, rows_of(document, SECTIONS)[0], document))
            page.plots.explorer.open()
            panel = element(user, ExplorePanel)
            assert (panel.props["quantity"], panel.props["limit"]) == ("max_indentation", "5 nm")
            assert panel.props["allowed"].startswith("The limit holds")

    asyncio.run(flow())
