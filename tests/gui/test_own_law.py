"""An own law: its force curve follows what is typed, and it is computed with once it is entered."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest
from simulated import element, send, window

import dforce as df
from dforce.forces._expression import MOTION, PARAMETERS
from dforce.forces.custom import NAMES_IN_LAW, Custom
from dforce.gui.case.entry import OwnLaw
from dforce.kernel import linker

CASE = df.example("figure-3-air").replace(forces=[Custom(**Custom.example)])


def test_each_name_of_a_law_is_offered_with_its_unit():
    assert set(NAMES_IN_LAW) == {*MOTION, *PARAMETERS}
    assert NAMES_IN_LAW["E_eff"].unit == "Pa"


def test_a_force_curve_of_an_own_law_compiles_nothing(monkeypatch):
    monkeypatch.setattr(linker, "compile_function", pytest.fail)
    distance = np.linspace(10e-9, -1e-9, 300)
    case = CASE.replace("forces.custom.law", "-P1*exp(-max(d, a0)/P2) + 3*P3*sqrt(R)*indentation**1.5")
    assert np.isfinite(df.force_curve(case, distance)["force"]).all()


def test_while_a_law_is_typed_its_force_is_drawn_and_the_case_stays(tmp_path, monkeypatch):
    drawn = []

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            document = page.view.document.put(("forces",), [{"model": "custom", **Custom.example}])
            page.view.edit(document, anew=True)
            law = element(user, OwnLaw)

            async def draw(figure):
                drawn.append(figure)

            monkeypatch.setattr(page.view.force, "draw", draw)
            send(law, "draft", "-P1*exp(-d/P2")
            await law._preview.task
            assert (
                law.props["mistake"] == "Own law: the force is not an expression: '(' was never closed at character 8"
            )
            assert not drawn
            send(law, "draft", "-2*P1*exp(-d/P2)")
            await law._preview.task
            assert law.props["mistake"] == ""
            assert len(drawn) == 1
            assert page.view.document == document
            send(law, "typed", {"text": "-2*P1 * exp(-d/P2)", "unit": "", "number": 1})
            assert page.view.document.value(("forces", 0, "law")) == "-2*P1 * exp(-d/P2)"
            assert law.props["text"] == "-2*P1 * exp(-d/P2)"

    asyncio.run(flow())
