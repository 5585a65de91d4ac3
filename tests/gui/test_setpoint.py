"""The quantities at the set point, beside the curves."""

from __future__ import annotations

import asyncio
import dataclasses
import functools

import numpy as np
import pytest
from simulated import element, send, window

import dforce as df
from dforce.gui.document import Document
from dforce.gui.session import Session
from dforce.gui.setpoint import Readout


@functools.cache
def states():
    return df.run(df.example("figure-3-branches"))


def show(page, result):
    """Show a result as if it had just been computed."""
    page.view.result = result
    figure = page.view.compose(result)
    page.view.show_beside()
    return figure


def rows(user):
    """Return what the table says: a dict by the words above its columns for each row."""
    props = element(user, Readout).props
    heads = [f"{column['label']} ({column['unit']})" for column in props["columns"]]
    return [
        dict(zip(heads, row["cells"], strict=True)) | {"state": row["state"], "ways": row["ways"]}
        for row in props["rows"]
    ]


def test_the_force_at_the_set_point_stands_beside_the_curves(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            result = df.run(df.example("figure-3-air-jump").set("experiment.zc.points=56"))
            figure = show(page, result)
            wanted = df.at_set_point(result, 0.8).isel(crossing=0)
            (row,) = rows(user)
            assert (row["state"], row["ways"]) == ("repulsive", "approach and retract")
            assert float(row["peak force (pN)"]) == pytest.approx(1e12 * float(wanted["peak_force"]), rel=1e-3)
            assert float(row["average tip–surface distance (nm)"]) == pytest.approx(1e9 * float(wanted["zc"]), rel=1e-3)
            rings = figure["layout"]["shapes"]  # of both directions, in both frames
            assert [ring["yanchor"] for ring in rings] == pytest.approx(
                [8.0, 8.0, *np.repeat(wanted["phase"].values, 2)]
            )
            assert [ring["xanchor"] for ring in rings] == pytest.approx([1e9 * float(wanted["zc"])] * 4)

    asyncio.run(flow())


def test_another_set_point_is_read_off_at_once_and_kept(tmp_path):
    store: dict[str, object] = {}

    async def flow():
        session = Session(store, tmp_path)
        async with window(tmp_path, session, live=False) as (user, page):
            show(page, states())
            before = rows(user)
            send(element(user, Readout), "percent", 50)
            show(page, page.view.result)
            assert [row["state"] for row in rows(user)] == [row["state"] for row in before]
            assert [row["amplitude (nm)"] for row in rows(user)] == ["5", "5", "5"]
            session.undo()
            page._open("figure-3-water")
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
            assert "farther from the surface" in element(user, Readout).props["text"]

    asyncio.run(flow())


@pytest.mark.parametrize("name", ["table-1-am", "figure-3-basins"])
def test_what_is_no_curve_has_no_set_point(tmp_path, name):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            show(page, df.run(df.example(name)))
            assert not element(user, Readout).visible

    asyncio.run(flow())


def test_a_set_point_out_of_range_is_not_taken(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            show(page, states())
            for percent in (0, 101, -3):
                send(element(user, Readout), "percent", percent)
            assert page.view.document.set_point == 0.8

    asyncio.run(flow())
    plain = dataclasses.replace(Document.first(), set_point=0.7).to_plain()
    assert Document.from_plain(plain).set_point == 0.7
    assert 0.0 < Document.from_plain(plain | {"set_point": -5.0}).set_point < 1.0
