"""The quantities at the set point, beside the curves."""

from __future__ import annotations

import asyncio
import dataclasses
import functools
import threading

import numpy as np
import pytest
from simulated import element, send, show, until, window

import dforce as df
from dforce.core.units import parse
from dforce.findings.crossings import Crossings
from dforce.gui.case.sliders import SliderElement
from dforce.gui.curves import setpoint
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.setpoint import SetPointTable, states_of, table_of, three_digits
from dforce.gui.document.document import FIRST, Document
from dforce.gui.document.session import Session
from dforce.gui.window.shown import DrawnResult
from dforce.results.curves import Picture


@functools.cache
def states():
    return df.run(df.example("figure-3-branches"))


def rows(user):
    """Return what the table says: a dict by the words above its columns for each row."""
    props = element(user, SetPointTable).props
    heads = [column["label"] for column in props["columns"]]
    return [
        dict(zip(heads, row["cells"], strict=True)) | {"state": row["state"], "ways": row["ways"]}
        for row in props["rows"]
    ]


def test_beside_curves_without_a_result_the_table_sends_nobody_farther_from_the_surface(tmp_path):
    result = df.run(df.example("figure-3-air").set("experiment.zc.points=5"))

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            show(page, result.where(False).assign(status=result["status"] * 0 + int(df.Status.FAILED)))
            assert element(user, SetPointTable).props["text"] == setpoint.NO_STATE

    asyncio.run(flow())


def test_frequencies_at_the_set_point_are_told_apart_within_a_resonance():
    result = df.run(df.example("resonance-curve").set("experiment.frequency.points=41", "drive.A0=5 nm"))
    picture = Picture("frequency", ("amplitude",))
    found = states_of(result, 0.8, picture)
    columns, shown = table_of([Layer(result, states=found)], picture)
    assert columns[0].name == "frequency"
    for row in shown:  # five digits are shown, of a line 190 Hz wide
        nearest = abs(found["frequency"].values - parse(row["cells"][0], "Hz")).min()
        assert nearest <= 0.5


def test_the_force_at_the_set_point_stands_beside_the_curves(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            result = df.run(df.example("figure-3-air-jump").set("experiment.zc.points=56"))
            figure = show(page, result)
            wanted = df.at_set_point(result, 0.8).isel(crossing=0)
            (row,) = rows(user)
            assert (row["state"], row["ways"]) == ("repulsive", "approach and retract")
            # three digits are shown: the last one is off by half of itself, 5e-3 of 1.00
            assert parse(row["peak force"], "N") == pytest.approx(float(wanted["peak_force"]), rel=5e-3)
            assert parse(row["average tip–surface distance"], "m") == pytest.approx(float(wanted["zc"]), rel=5e-3)
            rings = figure["layout"]["shapes"]  # of both directions, in both frames
            assert [ring["xanchor"] for ring in rings] == pytest.approx([1e9 * float(wanted["zc"])] * 4, rel=1e-3)
            for ring, name in zip(rings, ["amplitude"] * 2 + ["phase"] * 2, strict=True):  # on the straight lines drawn
                line = result.sel(direction="approach")[name].squeeze("tone").sortby("zc")
                drawn = np.interp(ring["xanchor"], 1e9 * line["zc"], line) * {"amplitude": 1e9}.get(name, 1.0)
                assert ring["yanchor"] == pytest.approx(drawn, rel=1e-6)  # both directions are one state there

    asyncio.run(flow())


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0"), (9.424, "9.42"), (-23.78, "-23.8"), (1234.5, "1230"), (0.00123, "0.00123"), (-2.378e-5, "-2.38 × 10⁻⁵"),
        (4.2e17, "4.2 × 10¹⁷"), (100.0, "100"), (99.96, "100"),
    ],
)  # fmt: skip
def test_a_number_has_three_digits_and_no_e(value, shown):
    assert three_digits(value) == shown


def test_each_number_has_the_unit_in_which_it_reads_best_and_below_its_error_there_is_none():
    result = df.run(df.example("figure-3-air").set("experiment.zc.points=12"))
    picture = Picture("zc", ("amplitude", "peak_force", "min_force", "phase", "total_dissipated_energy"))
    layer = Layer(result, states=states_of(result, 0.8, picture))
    layer.states["min_force"][:] = -2.378e-14
    (row,) = table_of([layer], picture)[1][:1]
    words = dict(zip([column.name for column in table_of([layer], picture)[0]], row["cells"], strict=True))
    assert words["amplitude"] == "8 nm"
    assert words["min_force"] == "-23.8 fN"
    assert words["phase"].endswith("°")
    assert words["total_dissipated_energy"] == "none"  # DMT is conservative
    assert not any("e-" in cell or "e+" in cell for cell in row["cells"])


def test_another_set_point_is_read_off_at_once_and_kept(tmp_path):
    store: dict[str, object] = {}

    async def flow():
        session = Session(store, tmp_path)
        async with window(tmp_path, session, live=False) as (user, page):
            show(page, states())
            before = rows(user)
            send(element(user, SetPointTable), "percent", 50)
            show(page, page.view.result)
            assert [row["state"] for row in rows(user)] == [row["state"] for row in before]
            assert [row["amplitude"] for row in rows(user)] == ["5 nm", "5 nm", "5 nm"]
            session.undo()
            await page._open("figure-3-water")
            assert session.document.set_point == 0.5
            session.close()
            assert Session(store, tmp_path).document.set_point == 0.5

    asyncio.run(flow())


def test_every_state_is_listed_and_an_unstable_one_is_called_so(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            show(page, states())
            assert sorted(row["state"] for row in rows(user)) == ["attractive", "repulsive", "unstable attractive"]

    asyncio.run(flow())


def test_where_the_curve_begins_too_near_the_surface_it_says_so(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            case = df.example("figure-3-air").set("experiment.zc.start=6 nm", "experiment.zc.points=12")
            show(page, df.run(case))
            assert rows(user) == []
            assert "farther from the surface" in element(user, SetPointTable).props["text"]

    asyncio.run(flow())


def test_no_state_is_solved_on_the_event_loop_where_another_curve_comes_meanwhile(tmp_path, monkeypatch):
    case = df.example("figure-3-air").set("experiment.zc.points=56")
    curves, threads = [df.run(case), df.run(case.replace("drive.A0", "19 nm"))], []

    async def flow():
        async with window(tmp_path, live=False) as (_user, page):
            loop, plots = asyncio.get_running_loop(), page.plots
            composed = threading.Event()

            def compose():
                plots.compose(curves[1])
                composed.set()

            def solved(*asked):
                threads.append(threading.current_thread())
                if len(threads) == 1:
                    loop.call_soon_threadsafe(compose)
                    assert composed.wait(20.0)
                return states_of(*asked)

            plots.compose(curves[0])
            monkeypatch.setattr(setpoint, "states_of", solved)
            page.view.curve = DrawnResult(page.view.document, curves[0])
            await plots._redraw()
            plots.beside()

    asyncio.run(flow())
    assert threads and threading.main_thread() not in threads


@pytest.mark.parametrize("name", ["table-1-am", "figure-3-basins"])
@pytest.mark.slow
def test_what_is_no_curve_has_no_set_point(tmp_path, name):
    async def flow():
        async with window(tmp_path, live=False) as (_user, page):
            show(page, df.run(df.example(name)))
            assert not page.plots.set_point.in_sight

    asyncio.run(flow())


def test_a_set_point_out_of_range_is_not_taken(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            show(page, states())
            for percent in (0, 101, -3):
                send(element(user, SetPointTable), "percent", percent)
            assert page.view.document.set_point == 0.8

    asyncio.run(flow())
    plain = dataclasses.replace(Document.first(), set_point=0.7).to_plain()
    assert Document.from_plain(plain).set_point == 0.7
    for wrong in (-5.0, 1.0, float("nan"), "0.8"):
        with pytest.raises(df.CaseError):
            Document.from_plain(plain | {"set_point": wrong})


@pytest.mark.parametrize("by", ["hand", "slider"])
def test_curves_do_not_wait_for_their_states_which_are_solved_once_they_are_drawn(tmp_path, monkeypatch, by):
    solving, drawn = [], []
    solve = Crossings.solved
    monkeypatch.setattr(Crossings, "solved", lambda *args: solving.append(args[1].attrs["case"]) or solve(*args))

    df.at_set_point(df.run(df.example(FIRST)), 0.8)  # compiled before anything is waited for

    def solved():
        return sum('A0 = "7 nm"' in case for case in solving)

    async def flow():
        async with window(tmp_path) as (user, page):
            await until(lambda: solving and not any(work.busy for work in page.view._works))
            compose = page.view.compose

            def composed(curve):
                figure = compose(curve)
                if page.view.curve.document.value(("drive", "A0")) == "7 nm":
                    drawn.append((solved(), figure))
                return figure

            page.view.compose = composed
            if by == "hand":
                page.view.edit(page.view.document.put(("drive", "A0"), "7 nm"))
            else:
                send(element(user, SliderElement), "slide", 7.0)
            await until(lambda: drawn)
            assert drawn[0][0] == 0
            wanted = df.at_set_point(page.view.result, 0.8)
            # rings of both directions and frames: on the straight lines between 221 points
            for place, key in ((1e9 * wanted["zc"].values, "xanchor"), (wanted["phase"].values[:, 0], "yanchor")):
                rings = [ring[key] for ring in drawn[0][1]["layout"]["shapes"]]
                assert sorted(rings[-len(place) :]) == pytest.approx(sorted(place), rel=1e-3)
            # a figure is composed anew, without its states, where the states behind the curve come meanwhile
            await until(lambda: solved() and page.plots.layers[-1].states is not None)
            assert page.plots.layers[-1].states["solved"].all()

    asyncio.run(flow())
