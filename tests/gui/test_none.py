"""Amounts below their estimated error: the window shows "none" in place of such a number, and draws 0."""

from __future__ import annotations

import asyncio
import base64
import dataclasses

import numpy as np
import pytest
from simulated import show, window

import dforce as df
from dforce.core.quantities import AMOUNTS
from dforce.core.units import parse
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.setpoint import states_of, table_of
from dforce.gui.study import explore
from dforce.results.curves import Picture, drawable
from dforce.results.significance import error_of


def curve(name):
    """Return the curve of an example with few points, and the names of its amounts."""
    result = df.run(df.example(name).set("experiment.zc.points=24"))
    return result, [amount for amount in AMOUNTS if amount in drawable(result)]


@pytest.mark.parametrize("name", ["figure-3-air", "figure-3-water", "figure-3-air-jump"])
def test_no_number_of_a_curve_is_below_its_estimated_error(tmp_path, name):
    result, amounts = curve(name)

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            for amount in amounts:
                page.view.session.document = dataclasses.replace(page.view.document, plots=(Picture("zc", (amount,)),))
                drawn = [trace for trace in show(page, result)["data"] if trace["meta"] == amount]
                page.plots.numbers.open()
                rows = [row[-1] for row in page.plots.numbers.sheet.props["rows"]]
                errors = np.moveaxis(error_of(result, amount), result[amount].dims.index("zc"), -1).ravel()
                scale = page.plots.drawn.places[amount].scale
                y = np.concatenate([np.frombuffer(base64.b64decode(trace["y"]["bdata"])) for trace in drawn])
                y = y[np.isfinite(y)] * scale
                assert len(y) == len(rows) == len(errors)
                numbers = np.array([0.0 if row == "none" else float(row) * scale for row in rows])
                assert "0" not in rows
                for seen in (y, numbers):
                    assert np.all((seen == 0.0) | (np.abs(seen) > errors * (1.0 - 1e-5))), (
                        amount
                    )  # six digits are shown

    asyncio.run(flow())


@pytest.mark.parametrize("name", ["figure-3-air", "figure-3-water", "figure-3-air-jump"])
@pytest.mark.parametrize("share", [0.5, 0.99])
def test_no_number_at_the_set_point_is_below_its_estimated_error(name, share):
    result, amounts = curve(name)
    layer = Layer(result, states=states_of(result, share, Picture("zc", tuple(amounts))))
    columns, rows = table_of([layer], Picture("zc", tuple(amounts)))
    assert rows
    smallest = {amount: float(error_of(layer.states, amount).min()) for amount in amounts}
    for row in rows:
        for column, cell in zip(columns, row["cells"], strict=True):
            if column.name in amounts and cell != "none":
                stored = layer.states[column.name].attrs["units"]
                assert abs(parse(cell, stored)) > 0.99 * smallest[column.name], (
                    column.name,
                    cell,
                )  # three digits are shown


def test_nothing_that_is_drawn_against_a_parameter_is_below_its_estimated_error():
    case = df.example("figure-3-air").set("experiment.zc.points=48")
    over = df.sweep(case, over={"drive.A0": ["8 nm", "10 nm"]}, at_set_point=0.8)
    choice = explore.fitting(over, explore.Choice("peak_force", "drive.A0"))
    assert (explore.cut(over, "peak_force", choice).values == 0.0).all()  # no contact
    assert (explore.cut(over, "min_force", choice).values < 0.0).all()  # attraction is well above its error
