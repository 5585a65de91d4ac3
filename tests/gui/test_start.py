"""The first page: a question with a lever, a medium and a sample becomes a case."""

from __future__ import annotations

import asyncio

import pytest
from simulated import window

import dforce as df
from dforce.gui.document.document import Document
from dforce.gui.document.session import Session
from dforce.gui.window.start import QUESTIONS, asks_for_q, case_for, lever_labels, sample_labels

BY_KEY = {question.key: question for question in QUESTIONS}


def test_each_lever_and_sample_of_the_library_is_offered():
    assert set(lever_labels()) == set(df.cantilevers()) and set(sample_labels()) == set(df.materials())


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda one: one.key)
def test_each_question_opens_a_case_that_can_be_computed(question):
    case = case_for(question)
    assert case.problem.modes and case.experiment is not None


@pytest.mark.parametrize("key", ["curve", "safe", "states", "thermal", "class"])
def test_lever_medium_and_sample_go_into_the_case(key):
    case = case_for(BY_KEY[key], "PPP-NCHR", "", "air", "polystyrene")
    probe, material = df.cantilevers()["PPP-NCHR"], df.materials()["polystyrene"]
    assert (case.problem.modes[0].f0, case.problem.modes[0].k) == (probe.f0, probe.k)
    assert case.sample.youngs_modulus == material.youngs_modulus
    assert case.tip.radius == pytest.approx(probe.tip_radius)


def test_a_quality_factor_is_asked_for_where_nothing_gives_it():
    assert asks_for_q("OTESPA", "air") and asks_for_q("PPP-NCHR", "vacuum") and not asks_for_q("PPP-NCHR", "air")
    assert case_for(BY_KEY["curve"], "OTESPA", "300").problem.modes[0].Q == 300.0
    with pytest.raises(df.DForceError, match="Q"):
        case_for(BY_KEY["curve"], "OTESPA")


def test_bimodal_with_one_mode_is_refused_in_a_sentence():
    with pytest.raises(df.ParameterError, match="needs a lever with two modes"):
        case_for(BY_KEY["bimodal"], "PPP-NCHR", "", "air")


def test_a_named_lever_stands_in_its_field():
    document = Document.of(case_for(BY_KEY["curve"], "PPP-NCHR", "", "air"))
    assert document.value(("cantilever", "name")) == "PPP-NCHR" and document.value(("medium", "name")) == "air"


def test_start_opens_the_case_and_the_tab_of_its_question(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            page.start.show()
            assert not page.body.visible and not page.run_bar.frame.visible
            page.start._choose(BY_KEY["safe"])
            page.start.lever.value = "PPP-NCHR"
            assert page.start.medium.value == "air"  # the lever has its Q from the medium
            page.start._start()
            assert page.body.visible and not page.start.element.visible
            assert page.view.document.case().problem.modes[0].k == 42.0
            assert page.plots.pane.current.title == "Against"

    asyncio.run(flow())


def test_a_file_that_is_opened_takes_the_first_page_away(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            page.start.show()
            await page.files.open(df.example("figure-3-air").to_toml().encode(), "case.toml")
            assert page.body.visible and not page.start.element.visible

    asyncio.run(flow())
