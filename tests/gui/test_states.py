"""All states behind a curve: what is found once nothing changes, and how it is drawn."""

from __future__ import annotations

import asyncio
import dataclasses
import threading

import numpy as np
import pytest
from simulated import element, send, until, window

import dforce as df
from dforce.findings import set_point
from dforce.findings.coexisting import coexisting
from dforce.findings.set_point import at_distance
from dforce.gui.curves import states
from dforce.gui.curves.states import StatesTable
from dforce.gui.document import compute
from dforce.gui.document.compute import Overtaken
from dforce.gui.document.document import Document

CASE = df.example("hysteresis").set("experiment.zc.points=41")


def test_states_behind_an_approach_hold_those_that_the_approach_does_not_meet():
    curve = df.approach(CASE, direction="approach")
    states = coexisting(curve)
    stable = states.isel(point=states["stable"].values)
    zc, phase = stable["zc"].values, stable["phase"].values[:, 0]
    near = np.abs(zc[:, None] - zc) < 0.3e-9
    assert np.abs(phase[:, None] - phase)[near].max() > 15.0  # attractive and repulsive at one distance
    assert not states["stable"].values.all()


def test_states_behind_a_curve_are_solved_for_the_answer_outside_the_event_loop(tmp_path, monkeypatch):
    solve, threads = set_point._states, []

    def solved(result, *how):
        if "branch" in result:
            threads.append(threading.current_thread())
        return solve(result, *how)

    monkeypatch.setattr(set_point, "_states", solved)

    async def flow():
        async with window(tmp_path) as (_, page):
            page.view.edit(Document.of(CASE), anew=True)
            await until(lambda: page.plots.states.of(page.view.curve) is not None and threads, 120.0)
            page.view.session.look(dataclasses.replace(page.view.document, set_point=0.97))
            await until(lambda: "97 %" in page.plots.answer.props.get("text", ""))
            assert "nother state" in page.plots.answer.props["text"]
            assert threading.main_thread() not in threads

    asyncio.run(flow())


def test_the_tab_lists_all_states_of_a_resonance_curve_and_shows_the_motion_of_one(tmp_path):
    async def flow():
        async with window(tmp_path) as (_, page):
            page.view.open(Document.of(df.example("resonance-curve").set("experiment.frequency.points=61")))
            panel = page.plots.all_states
            await until(lambda: page.plots.states.of(page.view.curve) is not None, 120.0)
            panel.open()
            assert [row["stable"] for row in panel.element.props["rows"]].count(True) >= 2
            send(panel.element, "motion", 0)
            assert page.plots.motion.spot.result is page.plots.states.of(page.view.curve)

    asyncio.run(flow())


def test_the_tab_lists_all_states_at_a_distance_and_shows_the_motion_of_one(tmp_path):
    async def flow():
        async with window(tmp_path) as (user, page):
            page.view.edit(Document.of(CASE), anew=True)
            panel = page.plots.all_states
            await until(lambda: page.plots.states.of(page.view.curve) is not None, 120.0)
            panel.open()
            send(element(user, StatesTable), "distance", "19,3 nm")
            rows = panel.element.props["rows"]
            states = page.plots.states.of(page.view.curve)
            there = at_distance(states, 19.3e-9)
            assert len(rows) == there.sizes["crossing"] > 1
            assert [row["stable"] for row in rows] == sorted(there["stable"].values.tolist(), reverse=True)
            assert {row["state"] for row in rows} == {"attractive", "repulsive"}
            send(element(user, StatesTable), "distance", "19.3")
            assert panel.element.props["rows"] == rows
            send(panel.element, "motion", 0)
            assert page.plots.motion.spot.result is states
            panel.open()
            send(panel.element, "distance", "5 GPa")
            assert "not a length" in panel.element.props["text"] and not panel.element.props["rows"]
            send(panel.element, "distance", "")
            assert panel.element.props["share"] == "80 %" and panel.element.props["rows"]

    asyncio.run(flow())


def test_the_tab_asks_for_a_distance_where_a_controller_keeps_the_amplitude(tmp_path):
    held = df.run(df.example("fm-afm"))

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            panel = page.plots.all_states
            panel.states = lambda: held
            panel.open()
            assert panel.element.props["text"] == "A controller keeps this amplitude constant; choose a distance."

    asyncio.run(flow())


def test_states_behind_a_frequency_sweep_go_along_its_frequency():
    case = df.example("hysteresis")
    f0 = case.problem.modes[0].f0
    sweep = df.frequency_sweep(case, zc="18 nm", frequency=np.linspace(0.98 * f0, 1.02 * f0, 21))
    states = coexisting(sweep)
    assert "frequency" in states.coords
    assert states["frequency"].max() == pytest.approx(float(sweep["frequency"].max()), rel=1e-6)


def test_a_dwell_has_no_states_behind_it():
    with pytest.raises(df.ParameterError, match="not a curve against"):
        coexisting(df.dwell(CASE, zc="18 nm"))


def test_faint_states_come_under_the_curve_once_nothing_changes(tmp_path):
    async def flow():
        async with window(tmp_path) as (_, page):
            page.view.edit(Document.of(CASE), anew=True)
            plots = page.plots
            await until(lambda: plots.states.of(page.view.curve) is not None, 120.0)
            await until(lambda: any("states" in str(trace.get("meta")) for trace in plots.drawn.figure["data"]))
            drawn = plots.drawn
            below = [n for n, trace in enumerate(drawn.figure["data"]) if str(trace.get("meta")).startswith("states")]
            assert all(drawn.figure["data"][n]["zorder"] < 0 and drawn.traces[n] is None for n in below)
            assert below == sorted(drawn.behind)  # behind the curves, whose numbers stay as they were
            words = {drawn.figure["data"][n]["hovertemplate"] for n in below}
            assert "amplitude %{y:.4g} nm, a stable state at %{x:.4g} nm<extra></extra>" in words
            line = drawn.behind[below[0]]
            place = int(np.flatnonzero(np.isfinite(line.y))[0])
            plots._clicked({"curve": below[0], "index": place}, plots.drawn.figure)
            spot = plots.motion.spot
            assert float(spot.result["zc"][spot.places["point"]]) == line.x[place]
            page.view.edit(page.view.document.put(("drive", "A0"), "19 nm"), name="slide A0")
            assert plots.states.of(dataclasses.replace(page.view.curve, document=page.view.document)) is None

    asyncio.run(flow())


def test_a_search_for_states_that_is_overtaken_ends_without_a_result(tmp_path, monkeypatch):
    searches = []

    def searching(curve, progress):
        searches.append("begun")
        try:
            found = coexisting(curve, progress)
        except Overtaken:
            searches.append("given up")
            raise
        searches.append("done")
        return found

    monkeypatch.setattr(states, "coexisting", searching)

    async def flow():
        async with window(tmp_path) as (_, page):
            page.view.edit(Document.of(CASE), anew=True)
            await until(lambda: searches[-1:] == ["begun"], 120.0)
            before = len(searches)
            page.view.edit(page.view.document.put(("drive", "A0"), "19 nm"), name="slide A0")
            await until(lambda: len(searches) > before, 120.0)
            assert searches[before] == "given up"
            await until(lambda: page.plots.states.of(page.view.curve) is not None, 120.0)

    asyncio.run(flow())


def test_no_states_are_looked_for_while_any_page_follows_a_slider(tmp_path, monkeypatch):
    begun = []

    def searching(curve, progress):
        begun.append(curve)
        return coexisting(curve, progress)

    monkeypatch.setattr(states, "coexisting", searching)

    async def flow():
        async with window(tmp_path) as (_, page):
            with compute.LIVE_CURVES.one_more():  # of another page
                page.view.edit(Document.of(CASE), anew=True)
                await until(
                    lambda: page.view.curve is not None and page.view.curve.document == page.view.document, 60.0
                )
                await asyncio.sleep(4.0 * states.REST)
                assert not begun
            await until(lambda: page.plots.states.of(page.view.curve) is not None, 120.0)
            assert len(begun) == 1

    asyncio.run(flow())


def test_states_that_one_page_found_are_not_looked_for_by_another(tmp_path, monkeypatch):
    async def flow():
        async with window(tmp_path / "one") as (_, page):
            await until(lambda: page.plots.states.of(page.view.curve) is not None, 120.0)
            found = page.plots.states.of(page.view.curve)
        monkeypatch.setattr(states, "coexisting", pytest.fail)
        async with window(tmp_path / "other") as (_, page):
            await until(lambda: page.plots.states.of(page.view.curve) is not None)
            assert page.plots.states.of(page.view.curve).equals(found)

    asyncio.run(flow())
