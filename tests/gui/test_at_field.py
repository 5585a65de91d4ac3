"""What stands at the field of a number: its slider, and the fit of a measured curve."""

from __future__ import annotations

import asyncio
import dataclasses
import math

import pytest
from simulated import element, send, until, window

import dforce as df
from dforce.gui.case.fields import field_at
from dforce.gui.case.sliders import SliderElement, toggle
from dforce.gui.document.document import Document, MeasuredData
from dforce.gui.measured import fitting
from dforce.gui.measured.panel import FitAtField, example_of
from dforce.inverse.values import value_and_error


def fits(user):
    """Return the elements of the fit that can be seen, by their labels."""
    with user.client:
        found = [one for one in user.client.elements.values() if isinstance(one, FitAtField) and one.visible]
    return {one.props["label"]: one for one in found}


def test_every_number_of_the_active_forces_can_be_fitted_at_its_field_while_there_is_a_curve(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            assert fits(user) == {}
            measured = MeasuredData("none", "curve.csv")
            page.view.session.look(dataclasses.replace(page.view.document, measured=measured))
            await until(lambda: fits(user))
            found = fits(user)
            assert {"Hamaker constant", "Young's modulus of the sample"} & {*found} or len(found) > 3
            label, one = next((label, one) for label, one in found.items() if "amaker" in label)
            send(one, "free", True)
            assert page.view.document.value(("fit", "free")) == ["forces.dmt.hamaker"], label
            assert one.props["free"]
            send(one, "prior", "2e-20(1e-21) J")
            assert page.view.document.value(("fit", "priors")) == {"forces.dmt.hamaker": "2e-20(1e-21) J"}
            assert one.props["prior"] == "2e-20(1e-21) J"
            send(one, "prior", "60(4)")
            assert page.view.document.value(("fit", "priors")) == {"forces.dmt.hamaker": "60(4) zJ"}
            send(one, "prior", "")
            assert not page.view.document.value(("fit", "priors"))
            send(one, "free", False)
            assert page.view.document.value(("fit", "free")) == []

    asyncio.run(flow())


@pytest.mark.parametrize("name", ["hysteresis", "figure-3-water", "figure-4-soft"])
def test_the_prior_shown_as_an_example_can_be_typed(name):
    document = Document.of(df.example(name))
    for row in fitting.rows(document):
        value, error = value_and_error(row.name, example_of(row), document.case().quantity(row.name).unit)
        meant = df.parse(row.value, document.case().quantity(row.name).unit)
        assert value == pytest.approx(meant, rel=0.05) and error > 0.0
        assert value == 0.0 or error < 0.21 * abs(value)  # 2 in the second digit


def test_each_opening_has_a_slider_that_follows_what_is_typed_beyond_its_range(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            for name in ("hysteresis", "figure-4-soft"):
                page.view.open(Document.of(df.example(name)))
                slider = element(user, SliderElement)
                assert slider.props["path"] == "drive.A0"
                page.view.edit(page.view.document.put(("drive", "A0"), "90 nm"))
                assert slider.props["given"] == slider.props["high"] == 90.0
                page.view.session.undo()
                await until(lambda: element(user, SliderElement).props["high"] < 90.0)
                page.view.edit(page.view.document.put(("drive", "A0"), "-1 nm"))
                assert element(user, SliderElement).props["low"] > 0.0  # as the amplitude itself

    asyncio.run(flow())


def test_the_ends_of_a_slider_follow_the_unit_of_its_field(tmp_path):
    """10 nm on a slider from 6 to 11 nm became 0.01 um on a slider to 11 um."""

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.view.open(Document.of(df.example("figure-3-air")))
            for unit, scale in (("um", 1e-3), ("pm", 1e3), ("nm", 1.0)):
                entry = next(entry for path, (_, _, entry) in page.forms.shown.items() if path == ("drive", "A0"))
                send(entry, "unit", unit)
                slider = element(user, SliderElement).props
                assert [slider[name] for name in ("low", "high", "given")] == pytest.approx(
                    [6 * scale, 11 * scale, 10 * scale]
                )
            send(entry, "typed", {"text": "0.008 um", "unit": "nm", "number": 1})
            send(element(user, SliderElement), "range", ["?", ""])  # refused
            slider = element(user, SliderElement).props
            assert [slider[name] for name in ("low", "high")] == pytest.approx([6e-3, 11e-3])

    asyncio.run(flow())


@pytest.mark.parametrize("typed", ["1 nm", "NaN GPa", "1e400 GPa", "x", "7 x"])
def test_no_slider_starts_from_a_text_that_is_no_value_of_its_field(tmp_path, typed):
    path = ("sample", "youngs_modulus")

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            document = page.view.document.put(path, typed)
            page.view.session.look(document)
            toggle(page.view, path, field_at(document, path))
            assert page.view.document.sliders == document.sliders

    asyncio.run(flow())


@pytest.mark.parametrize("typed", ["1 GPa", "NaN nm", "1e400 nm", "x"])
def test_the_range_of_a_slider_can_be_typed_while_its_field_has_no_value(tmp_path, typed):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.view.open(Document.of(df.example("hysteresis")))
            page.view.edit(page.view.document.put(("drive", "A0"), typed))
            send(element(user, SliderElement), "range", ["12", "30"])
            assert [(one.low, one.high) for one in page.view.document.sliders] == [(12.0, 30.0)]
            numbers = [element(user, SliderElement).props[name] for name in ("low", "high", "step", "given")]
            assert all(math.isfinite(number) for number in numbers)  # others come to the browser as null

    asyncio.run(flow())
