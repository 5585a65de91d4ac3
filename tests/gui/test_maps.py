"""Two parameters in the window: limits, boundaries of regimes, and the set point as one of the two."""

from __future__ import annotations

import asyncio
import dataclasses
import functools

import numpy as np
import pytest
from simulated import window

import dforce as df
from dforce.gui.case.values import rows_of
from dforce.gui.document.document import Document
from dforce.gui.document.store import ResultStore
from dforce.gui.files import file_menu, project, uploads
from dforce.gui.study import explore, pictures
from dforce.gui.study.parameter_study import SECTIONS, SET_POINT, Over, ParameterStudy, Varied, choices, plan_job

CASE = df.example("hysteresis")
DOCUMENT = Document.of(CASE)
ROWS = {row.name: row for row in choices(DOCUMENT)}
AMPLITUDE = Varied(ROWS["drive.A0"], "14 nm", "24 nm", 3)
SHARES = Varied(ROWS[SET_POINT], "60 %", "90 %", 3)


@functools.cache
def mapped():
    job = plan_job(DOCUMENT, CASE, AMPLITUDE, SHARES, {"peak_force": "< 300 pN"})
    job.work()
    assert job.state == "done", job.error
    return job


def test_a_map_over_amplitude_and_set_point_is_the_plan_of_dforce_with_its_regimes():
    job = mapped()
    grid = {"start": 14e-9, "stop": 24e-9, "points": 3}
    wanted = df.plan(CASE, {"drive.A0": grid}, {"start": 0.6, "stop": 0.9, "points": 3}, {"peak_force": "< 300 pN"})
    assert np.allclose(job.result["peak_force"], wanted["peak_force"], equal_nan=True)
    assert job.result["limit_hit"].equals(wanted["limit_hit"])
    assert set(job.regimes["regime"].dims) == {"A0", "set_point"}


def test_the_boundaries_of_regimes_lie_on_the_map_where_they_were_solved():
    job = mapped()
    choice = explore.fitting(job.result, explore.Choice("limit_hit", "A0", "set_point"))
    figure = pictures.figure(job.result, choice, regimes=job.regimes)
    names = {trace["name"] for trace in figure["data"] if "name" in trace}
    assert {"net force is zero", "a state ends"} & names
    turned = explore.fitting(job.result, explore.Choice("limit_hit", "set_point", "A0"))
    assert len(pictures.figure(job.result, turned, regimes=job.regimes)["data"]) == len(figure["data"])


def test_the_boundaries_of_a_force_with_two_branches_are_drawn_on_its_map():
    sticky = CASE.replace(forces=[df.forces.Hertz(), df.forces.AdhesionHysteresis()])
    job = plan_job(
        Document.of(sticky), sticky, dataclasses.replace(AMPLITUDE, points=2), dataclasses.replace(SHARES, points=2), {}
    )
    job.work()
    assert job.state == "done", job.error
    figure = pictures.figure(job.result, explore.fitting(job.result, explore.Choice()), regimes=job.regimes)
    assert "the tip just touches" in {trace.get("name") for trace in figure["data"]}


def test_the_point_that_was_clicked_is_marked_on_a_map_and_across_lines():
    result = mapped().result
    choice = explore.fitting(result, explore.Choice("peak_force", "A0", "set_point"))
    point = explore.picked(result, choice, 19.0, 75.0)
    assert explore.words_of(explore.settings_at(result, point), {}).endswith("set_point 75 %")
    ring = pictures.figure(result, choice, picked=point)["data"][-1]
    assert (ring["name"], ring["marker"]["symbol"]) == ("clicked", "circle-open")
    lines = explore.fitting(result, explore.Choice("peak_force", "A0", ""))
    shape = pictures.figure(result, lines, picked=explore.picked(result, lines, 19.0, 0.0))["layout"]["shapes"][-1]
    assert shape["x0"] == shape["x1"] == pytest.approx(19.0)


def test_names_and_units_of_a_point_are_under_the_pointer():
    result = mapped().result
    drawn = pictures.figure(result, explore.fitting(result, explore.Choice("peak_force", "A0", "set_point")))
    assert "free amplitude %{x:.4g} nm, set point %{y:.4g} %: peak force %{z:.4g} " in drawn["data"][0]["hovertemplate"]


def test_the_set_point_alone_goes_along_all_states_of_the_case():
    job = plan_job(DOCUMENT, CASE.replace("drive.A0", "14 nm"), SHARES, None, {})
    job.work()
    assert job.result.sizes["set_point"] == 3
    assert explore.axes_of(job.result, "peak_force") == ["set_point"]
    regimes = set(job.result["regime"].values.ravel().tolist()) - {""}
    assert regimes == {"attractive", "repulsive"}


def test_ten_quantities_come_first_with_the_least_force_beside_the_peak_force():
    names = explore.quantities(mapped().result)
    assert names[1:3] == ["peak_force", "min_force"]
    assert len(explore.FIRST) == 10
    assert set(names[10:]).isdisjoint(explore.FIRST)


@pytest.mark.parametrize(
    ("second", "words"),
    [
        (AMPLITUDE, "varied twice"),
        (Varied(ROWS[SET_POINT], "90 %", "60 %", 4), "does not rise"),
        (Varied(ROWS[SET_POINT], "60 %", "90 %", 102), "not between 2 and"),
    ],
)
def test_two_ranges_that_make_no_sense_are_refused(second, words):
    with pytest.raises(df.ParameterError, match=words):
        plan_job(DOCUMENT, CASE, AMPLITUDE, second, {})


def test_a_map_that_is_too_large_is_refused():
    large = (
        Varied(row, low, high, 100) for row, low, high in ((AMPLITUDE.row, "1 nm", "9 nm"), (SHARES.row, "0.5", "0.9"))
    )
    with pytest.raises(df.ParameterError, match="more than 2000 settings"):
        plan_job(DOCUMENT, CASE, *large, {})


def test_a_map_is_seen_before_the_boundaries_of_its_regimes_are_followed():
    job, seen = plan_job(DOCUMENT, CASE, AMPLITUDE, SHARES, {}), []
    study = ParameterStudy()

    async def flow():
        def look():
            seen.append((study.result is not None, study.over is not None and study.over.regimes is not None))

        await study.compute(job, (AMPLITUDE.row, SHARES.row), look, 0.02)

    asyncio.run(flow())
    assert (True, False) in seen
    assert seen[-1] == (True, True)


def test_what_was_varied_is_no_reason_to_compute_again():
    study = ParameterStudy()
    row = next(row for row in rows_of(DOCUMENT, SECTIONS) if row.name == "drive.A0")
    study.take(Over(mapped().result, row, DOCUMENT, ROWS[SET_POINT]))
    moved = dataclasses.replace(DOCUMENT.put(("drive", "A0"), "21 nm"), set_point=0.66)
    assert study.why_behind(moved) == ""
    assert "earlier case" in study.why_behind(moved.put(("cantilever", "Q"), 300))
    study.take(Over(mapped().result, row, DOCUMENT))
    assert "set point 80 %" in study.why_behind(moved)


def test_a_project_keeps_the_boundaries_of_regimes_beside_their_map(tmp_path):
    over = Over(mapped().result, AMPLITUDE.row, DOCUMENT, SHARES.row, mapped().regimes)
    data = project.packed(DOCUMENT, ResultStore(tmp_path), ResultStore(tmp_path), over)
    found = project.unpacked(data, tmp_path).over
    assert found.regimes.equals(over.regimes)
    assert (found.row.name, found.second.name) == ("drive.A0", SET_POINT)
    other = dataclasses.replace(over, regimes=mapped().result)
    with pytest.raises(df.ResultError, match="damaged"):
        project.unpacked(project.packed(DOCUMENT, ResultStore(tmp_path), ResultStore(tmp_path), other), tmp_path)


def test_a_map_of_regimes_is_opened_with_its_words_and_boundaries(tmp_path):
    data = file_menu.written(lambda path: df.write(mapped().regimes, path), ".nc")
    result = uploads.opened_from(data, tmp_path)
    figure = pictures.figure(result, explore.fitting(result, explore.Choice()))
    words = {word for row in figure["data"][0]["text"] for word in row}
    assert words & {"both", "repulsive"}
    assert "a state ends" in {trace.get("name") for trace in figure["data"]}


def test_what_was_clicked_on_a_map_stays_when_its_boundaries_come(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            study, explorer = page.view.session.study, page.plots.explorer
            study.take(Over(mapped().result, AMPLITUDE.row, page.view.document, SHARES.row))
            explorer.open()
            explorer.choice = explore.fitting(study.result, explore.Choice("peak_force", "A0", "set_point"))
            explorer._clicked({"x": 19.0, "y": 0.8})
            study.take(dataclasses.replace(study.over, regimes=mapped().regimes))
            explorer.show()
            assert (explorer.choice.quantity, explorer.choice.y) == ("peak_force", "set_point")
            assert explorer.picked is not None

    asyncio.run(flow())
