"""The first page: a question with a lever, a medium and a sample becomes a case."""

from __future__ import annotations

import asyncio
import dataclasses
import datetime
import os

import pytest
from simulated import window

import dforce as df
from dforce.gui.case.values import nominal_value
from dforce.gui.document.document import Document, MeasuredData
from dforce.gui.document.session import Session
from dforce.gui.files.uploads import MOST_LAST, LastFile, LastFiles
from dforce.gui.window import start
from dforce.gui.window.classroom import Classroom
from dforce.gui.window.security import SHARED
from dforce.gui.window.start import QUESTIONS, asks_for_q, case_for, lever_labels, sample_labels
from dforce.library import FOLDERS, measured_data

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


@pytest.mark.parametrize("lever", lever_labels(bimodal=True))
def test_a_lever_of_the_library_is_driven_in_two_modes(lever):
    case = case_for(BY_KEY["bimodal"], lever, "", "air", "polystyrene")
    first, second = case.problem.modes
    assert first.f0 == df.cantilevers()[lever].f0 and second.f0 / first.f0 == pytest.approx(6.27, abs=0.01)
    assert [tone.frequency for tone in case.problem.tones] == [first.f0, second.f0]


def test_two_modes_in_a_liquid_are_refused_in_a_sentence():
    with pytest.raises(df.ParameterError, match="nominal in air"):
        case_for(BY_KEY["bimodal"], "PPP-NCHR", "", "water")


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda one: one.key)
def test_a_medium_alone_is_refused_for_the_q_of_an_example_is_not_that_of_another_medium(question):
    with pytest.raises(df.ParameterError, match="lever"):
        case_for(question, medium="water")


def test_a_named_lever_stands_in_its_field():
    document = Document.of(case_for(BY_KEY["curve"], "PPP-NCHR", "", "air"))
    assert document.value(("cantilever", "name")) == "PPP-NCHR" and document.value(("medium", "name")) == "air"
    nominal = nominal_value(document, ("cantilever", "Q"))  # of the medium
    assert nominal == pytest.approx(document.case().problem.modes[0].Q, rel=5e-3)
    assert nominal_value(document.put(("drive", "A0"), "-"), ("cantilever", "Q")) is None
    assert nominal_value(document.put(("cantilever",), "figure-99"), ("cantilever", "Q")) is None  # of a link


def test_start_opens_the_case_and_the_tab_of_its_question(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            page.start.show()
            assert not page.body.visible and not page.run_bar.frame.visible
            page.start._choose(BY_KEY["safe"])
            page.start.lever.value = "PPP-NCHR"
            assert page.start.medium.value == "air"  # the lever has its Q from the medium
            await page.start._start()
            assert page.body.visible and not page.start.element.visible
            assert page.view.document.case().problem.modes[0].k == 42.0
            assert page.plots.pane.current.title == "Against"

    asyncio.run(flow())


def test_a_bimodal_case_is_opened_with_a_lever_whose_two_modes_are_known(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            page.start.show()
            page.start.lever.value = "OTESPA"  # of which nothing gives the Q of its second mode
            page.start._choose(BY_KEY["bimodal"])
            assert page.start.lever.value is None and "OTESPA" not in page.start.lever.options
            page.start.lever.value = "PPP-NCHR"
            assert "ideal beam" in page.start.note.text
            await page.start._start()
            assert len(page.view.document.case().problem.modes) == 2

    asyncio.run(flow())


def test_results_that_are_drawn_behind_the_first_page_leave_it_there(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            page.start.show()
            page.view.show_anew()
            assert page.start.element.visible

    asyncio.run(flow())


@pytest.mark.parametrize("sample", list(df.materials()))
@pytest.mark.parametrize("medium", ["", "air", "water"])
def test_a_sample_sets_its_hamaker_constant_where_a_source_has_one_and_a_force_uses_it(sample, medium):
    material, glass = df.materials()[sample], df.materials()["borosilicate_glass"]
    for question in QUESTIONS:
        before = {force.name: force for force in case_for(question).forces}
        given = ("PPP-NCHR", "5", medium) if medium and question.key != "bimodal" else ("", "", "")
        wanted = material.hamaker_with(glass, given[2] or "air")
        for force in case_for(question, *given, sample).forces:
            if hasattr(force, "hamaker"):
                assert force.hamaker == pytest.approx(wanted or before[force.name].hamaker, rel=5e-3)


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda one: one.key)
def test_each_question_offers_examples_and_measured_files_that_are_shipped(question):
    offers = question.offers()
    assert offers and set(offers) <= {*df.examples(), *measured_data()}
    assert all(len(title) > 5 for title in offers.values())


def test_each_folder_of_examples_has_a_heading_and_the_paper_has_its_own():
    assert {one.folder for one in df.examples().values()} == set(FOLDERS)
    assert all((one.folder == "paper") == ("2015 paper" in one.title) for one in df.examples().values())


def test_a_shipped_curve_opens_with_the_case_that_fits_it(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            page.start.show()
            await page.files.open_shipped("stiff.csv")
            document = page.view.document
            assert document.measured.name == "stiff.csv" and document.value(("fit", "free"))
            assert page.body.visible and document.case().experiment is not None
            await page.files.open_shipped("hysteresis")
            assert page.view.document.measured is None  # it was of another case

    asyncio.run(flow())


def test_the_last_files_are_listed_and_opened_again_and_one_that_is_gone_says_so(tmp_path, said):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            text = df.example("figure-3-water").to_toml().encode()
            await page.files._open_and_keep(asyncio.sleep(0, text), "my case.toml")
            page.start.show()
            [one] = page.files.last.listed()
            assert one.name == "my case.toml" and page.start.last.visible
            await page.files.open_shipped("hysteresis")
            await page.files.open_last("my case.toml")
            assert page.view.document.case() == df.example("figure-3-water")
            page.start._forget()
            assert not page.start.last.visible
            await page.files.open_last("my case.toml")
            assert said == ["The file 'my case.toml' is no longer kept here; open it from your disk."]

    asyncio.run(flow())


def test_last_files_are_few_and_of_one_session_alone(tmp_path):
    mine, others = LastFiles(tmp_path / "mine"), LastFiles(tmp_path / "others")
    for number in range(MOST_LAST + 3):
        mine.keep(b"1", f"{number}.csv")
        os.utime(mine._path(f"{number}.csv"), (number, number))
    mine.keep(b"2", "../../a name, with ümlauts and / in it.csv")
    names = [one.name for one in mine.listed()]
    assert len(names) == MOST_LAST and names[0] == "../../a name, with ümlauts and / in it.csv"
    assert mine.take(names[0]) == b"2" and others.listed() == []
    assert sorted(path.parent for path in tmp_path.rglob("file-*")) == [tmp_path / "mine"] * MOST_LAST
    with pytest.raises(df.ResultError, match="no longer kept"):
        others.take(names[0])


def test_a_last_file_says_when_it_was_opened():
    now = datetime.datetime(2026, 3, 5, 12, 0)
    at = now.timestamp()
    assert LastFile("a.csv", at - 3600).words(now) == "a.csv (11:00)"
    assert LastFile("a.csv", at - 86400).words(now) == "a.csv (yesterday)"
    assert LastFile("a.csv", at - 3 * 86400).words(now) == "a.csv (2 Mar)"


def test_teaching_a_class_shows_the_command_of_a_window_for_one_person(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (user, page):
            page.start.show()
            page.start._choose(BY_KEY["class"])
            await page.start._start()
            await user.should_see("dforce gui --host 0.0.0.0")
            await user.should_see("Copy the command")

    asyncio.run(flow())


def test_teaching_a_class_shows_the_address_of_a_window_that_is_shared(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (user, page):
            page.start.classroom = Classroom("192.168.1.2:8080/abcd2345", SHARED)
            page.start._teach()
            await user.should_see("192.168.1.2:8080/")
            await user.should_see("abcd2345")
            await user.should_see("See who is there")
            await user.should_not_see("--host 0.0.0.0")

    asyncio.run(flow())


def test_a_lever_without_a_quality_factor_opens_nothing_until_it_is_typed(tmp_path, monkeypatch):
    said = []
    monkeypatch.setattr(start, "say", said.append)

    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            page.start.show()
            page.start._choose(BY_KEY["states"])
            page.start.lever.value = "OTESPA"
            await page.start._start()
            assert page.start.element.visible and "Quality factor Q" in said[0]
            page.start.q.value = "300"
            await page.start._start()
            assert not page.start.element.visible and page.view.document.case().problem.modes[0].Q == 300.0
            assert page.plots.pane.current.title == "Set point"

    asyncio.run(flow())


def test_a_file_that_is_opened_takes_the_first_page_away(tmp_path):
    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            page.start.show()
            await page.files.open(df.example("figure-3-air").to_toml().encode(), "case.toml")
            assert page.body.visible and not page.start.element.visible

    asyncio.run(flow())


def test_a_question_begins_without_the_curve_and_the_results_of_another_case(tmp_path):
    curve = df.run(df.example("figure-3-air").set("experiment.zc.points=5"))

    async def flow():
        async with window(tmp_path, Session({}, tmp_path), live=False) as (_, page):
            session = page.view.session
            await session.keep(curve)
            for key in ("curve", "safe"):
                session.look(dataclasses.replace(session.document, measured=MeasuredData("1", "lab.csv")))
                page.start._choose(BY_KEY[key])
                await page.start._start()
                assert not any(kept.shown for kept in session.document.results)
                assert (session.document.measured is None) == (key == "safe")

    asyncio.run(flow())


def test_samples_are_written_as_people_write_them():
    words = sample_labels()
    assert words["pmma"].startswith("PMMA: ") and words["fused_silica"].startswith("fused silica: ")
