"""What a page shows is of the case that is typed, or is seen to be of another."""

from __future__ import annotations

import asyncio
import dataclasses
import functools
import threading

import pytest
from nicegui import ui
from simulated import click, element, show, until, window

import dforce as df
from dforce.gui.curves.motion import Drawing
from dforce.gui.document.compute import Live
from dforce.gui.document.document import Document
from dforce.gui.document.session import Session
from dforce.gui.window import view as views
from dforce.gui.window.shown import PagePart, ShownParts

CASE = df.example("figure-3-air").set("experiment.zc.points=23")
DOCUMENT = Document.of(CASE)
FIRST, SECOND = "figure-3-basins", "resonance-curve"  # as examples are opened from the menu


@functools.cache
def result(amplitude="10 nm"):
    return df.run(CASE.replace("drive.A0", amplitude))


def too_long(*_):
    return Live(None, gave_up=True)


def tried(page):
    """Return the case's amplitude that a page asks a live curve for, and the amplitude of the curve that it shows."""
    return page.view.document.value(("drive", "A0")), page.view.curve and page.view.curve.document.value(
        ("drive", "A0")
    )


@dataclasses.dataclass
class Runs:
    """Stands for df.run: a run takes until it is let go, and gives a curve with the title of its case."""

    begun: list[str] = dataclasses.field(default_factory=list)
    going: threading.Event = dataclasses.field(default_factory=threading.Event)

    def run(self, case, progress):
        self.begun.append(case.title)
        self.going.wait(20.0)
        return result().assign_attrs(title=case.title, case=case.to_toml(complete=True))


@pytest.mark.slow
def test_a_result_never_stands_under_the_title_of_a_case_that_was_opened_meanwhile(tmp_path, run_as, live_as):
    runs = Runs()
    result()
    live_as(too_long)
    run_as(runs.run)
    first, second = (df.example(name).title for name in (FIRST, SECOND))

    async def flow():
        async with window(tmp_path) as (_, page):
            drawn = []
            compose = page.view.compose

            def watched(curve):
                drawn.append((page.view.document.value(("title",)), curve and curve.attrs["title"]))
                return compose(curve)

            page.view.compose = watched
            await page._open(FIRST)
            await until(lambda: runs.begun)
            await page._open(SECOND)
            await until(lambda: page.view.status == views.WAITING)
            runs.going.set()
            await until(lambda: (second, second) in drawn)
            assert all(curve in (None, title) for title, curve in drawn)
            assert runs.begun == [first, second]  # one after the other, and each once
            # the first one's is not lost; a result may be drawn before its file is written
            await until(lambda: len(page.view.document.results) == 2)
            kept = page.view.document.results
            assert [(page.view.session.results.take(one.id).attrs["title"], one.shown) for one in kept] == [
                (first, False),
                (second, True),
            ]

    asyncio.run(flow())


def test_a_curve_that_comes_after_another_case_was_opened_is_not_drawn(tmp_path, live_as):
    """As after a long compilation, which nothing stops."""
    going, given = threading.Event(), [result(), result("5 nm")]

    def live(*_):
        going.wait(20.0)
        return Live(given.pop(0))

    live_as(live)

    async def flow():
        async with window(tmp_path) as (_, page):
            drawn = []
            compose = page.view.compose
            page.view.compose = lambda curve: drawn.append(curve) or compose(curve)
            await until(lambda: page.view._latest.busy and not page.view._latest.overtaken)
            await page._open("table-1-am")
            going.set()
            await until(lambda: not given and not page.view._latest.busy)
            assert not any(curve is result() for curve in drawn)
            assert drawn[-1] is result("5 nm")

    asyncio.run(flow())


def test_the_motion_of_one_case_does_not_run_on_beside_another(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            page.view.session.document = DOCUMENT
            show(page, result())
            page.view.shown.show(PagePart.CURVES, DOCUMENT)
            click(page, curve=0, index=11)
            drawing = element(user, Drawing)
            await until(lambda: drawing.props.get("motion"))
            page.view.edit(DOCUMENT.put(("drive", "A0"), "9 nm"))
            await until(lambda: drawing.props.get("behind"))  # it stands still
            page.view.edit(DOCUMENT)
            assert not drawing.props["behind"]
            await page._open("resonance-curve")
            await until(lambda: drawing.props["motion"] is None)
            assert page.view.curve is None

    asyncio.run(flow())


def test_what_is_of_another_case_is_seen_to_be_until_it_follows(tmp_path, live_as):
    """Curves, table, force and advice, while the next curve is compiled; no longer, once all are there."""
    going = threading.Event()
    going.set()

    def live(case, *_):
        going.wait(20.0)
        return Live(result(f"{1e9 * case.drive.A0:.0f} nm"))

    live_as(live)
    result("10 nm"), result("9 nm")

    async def flow():
        async with window(tmp_path) as (_, page):
            view, dimmed = page.view, dict[str, bool]()
            view.main.dim = lambda behind: dimmed.update(main=behind)
            view.force.dim = lambda behind: dimmed.update(force=behind)

            def seen():
                tables = page.plots.set_point, page.plots.all_states
                table = all("df-behind" in one.element.classes for one in tables)
                advice = "df-behind" in page.left.classes
                return dimmed.get("main", False), dimmed.get("force", False), table, advice

            view.edit(DOCUMENT.put(("cantilever", "Q"), "100"))  # has advice
            await until(lambda: view.said.advice and not view._latest.busy and not view._beside.busy)
            assert seen() == (False,) * 4
            going.clear()
            view.edit(view.document.put(("drive", "A0"), "9 nm"))
            assert seen() == (False,) * 4  # nothing flickers while something is dragged
            await until(lambda: seen() == (True,) * 4)
            going.set()
            await until(lambda: seen() == (False,) * 4)
            assert tried(page) == ("9 nm", "9 nm")

    asyncio.run(flow())


def test_a_law_that_stays_is_drawn_anew_only_once_nothing_changes(tmp_path, live_as):
    """Over other distances, as another free amplitude presses deeper; another modulus is another law."""
    live_as(lambda case, *_: Live(result()))
    drawn = []

    async def flow():
        async with window(tmp_path) as (_, page):
            view, draw = page.view, page.view.force.draw

            def resting():
                return not any(work.busy for work in view._works)

            view.force.draw = lambda figure: drawn.append(figure["data"][0]["x"]) or draw(figure)
            view.edit(DOCUMENT)
            await until(lambda: drawn and resting())
            view.edit(view.document.put(("drive", "A0"), "40 nm"))
            await until(lambda: view.shown.of(PagePart.FORCE) is view.document)
            assert len(drawn) == 1
            await until(resting)
            assert len(drawn) == 2
            assert drawn[0] != drawn[1]
            view.edit(view.document.put(("sample", "youngs_modulus"), "50 MPa"))
            await until(lambda: view.shown.of(PagePart.FORCE) is view.document)
            assert len(drawn) == 3

    asyncio.run(flow())


def test_advice_does_not_wait_for_the_force_which_waits_for_other_pages(tmp_path, live_as):
    live_as(lambda case, *_: Live(result()))

    async def flow():
        async with window(tmp_path) as (_, page):
            view, going = page.view, asyncio.Event()
            view.force.follow = lambda *_: going.wait()
            view.edit(DOCUMENT.put(("cantilever", "Q"), "100"))  # has advice
            await until(lambda: view.said.advice)
            assert view.shown.of(PagePart.FORCE) is None
            going.set()
            await until(lambda: view.shown.of(PagePart.FORCE) is view.document)

    asyncio.run(flow())


def test_advice_on_the_case_before_takes_no_mistake_away(tmp_path, live_as):
    live_as(lambda case, *_: Live(result()))

    async def flow():
        async with window(tmp_path) as (_, page):
            view, going = page.view, asyncio.Event()
            waits, follow = [], view.force.follow

            async def slow(*asked):
                if view._advising.busy:  # the law that is looked at before the advice
                    waits.append(asked)
                    await going.wait()
                return await follow(*asked)

            view.force.follow = slow
            view.edit(DOCUMENT)
            await until(lambda: waits)
            view.edit(DOCUMENT.put(("drive", "A0"), "-1"))
            await until(lambda: view.said.wrong and not view._latest.busy)
            going.set()
            await until(lambda: not view._advising.busy)
            assert view.said.wrong

    asyncio.run(flow())


def test_a_step_back_to_the_case_shown_computes_nothing(tmp_path, live_as):
    asked = []

    def live(case, *_):
        asked.append(case.drive.A0)
        return Live(result()) if case.drive.A0 == 10e-9 else Live(None, gave_up=True)

    live_as(live)

    async def flow():
        async with window(tmp_path) as (_, page):
            await until(lambda: page.view.shown.of(PagePart.CURVES))
            page.view.edit(page.view.document.put(("drive", "A0"), "9 nm"))
            await until(lambda: page.view.status == views.TOO_LONG)
            page.view.session.undo()
            await until(lambda: not page.view.status and not page.view._latest.busy)
            assert tried(page) == ("10 nm", "10 nm")
            assert asked == [10e-9, 9e-9]

    asyncio.run(flow())


def test_a_page_that_is_opened_again_shows_the_result_of_the_run(tmp_path, live_as):
    live_as(too_long)

    async def flow():
        session = Session({}, tmp_path)
        session.document = DOCUMENT
        await session.run(DOCUMENT)
        async with window(tmp_path, session) as (_, page):
            await until(lambda: page.view.shown.of(PagePart.CURVES))
            assert page.view.result is session.job.result

    asyncio.run(flow())


def test_a_case_that_is_opened_again_shows_the_result_of_its_run(tmp_path, live_as):
    """Opening hides all results kept, and the one of this case is among them."""
    live_as(too_long)

    async def flow():
        async with window(tmp_path) as (_, page):
            for _ in range(2):
                page.view.session.hide_kept()
                page.view.open(DOCUMENT)
                await until(lambda: page.view.result is not None and not page.view._latest.busy)
                assert page.view.result is page.view.session.job.result
                assert [layer.result for layer in page.plots.kept.layers(page.view.result)] == [page.view.result]

    asyncio.run(flow())


def test_a_curve_is_asked_for_again_at_once_after_something_was_compiled(tmp_path, live_as):
    given = [Live(None, gave_up=True, compiled=True)] * 2 + [Live(result())]
    live_as(lambda *_: given.pop(0))

    async def flow():
        async with window(tmp_path) as (_, page):
            await until(lambda: page.view.shown.of(PagePart.CURVES), 10.0)  # against 20 s
            assert page.view.status == ""

    asyncio.run(flow())


def test_a_curve_that_took_too_long_is_tried_once_more_by_itself(tmp_path, live_as, monkeypatch):
    given = [Live(None, gave_up=True), Live(result()), Live(None, gave_up=True), Live(None, gave_up=True)]
    live_as(lambda *_: given.pop(0))
    monkeypatch.setattr(views, "TRIED_AGAIN", 0.2)

    async def flow():
        async with window(tmp_path) as (_, page):
            await until(lambda: page.view.status == views.TOO_LONG)
            assert page.plots.waiting.text.text == views.TOO_LONG  # in the middle of the empty plot
            await until(lambda: page.view.shown.of(PagePart.CURVES))
            assert (page.view.status, page.plots.waiting.frame.visible) == ("", False)
            await asyncio.sleep(0.3)
            page.view.edit(page.view.document.put(("drive", "A0"), "9 nm"))
            await until(lambda: not given)
            await asyncio.sleep(0.5)  # a third time it would find nothing to pop, and say so
            assert page.view.status == views.TOO_LONG
            assert page.plots.line.text == views.TOO_LONG  # above the curves that are there

    asyncio.run(flow())


def test_the_last_drawing_is_of_what_is_to_be_shown_last(tmp_path):
    """A redraw waits for the browser, and meanwhile there is another curve."""

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            drawn, going = [], asyncio.Event()

            async def draw(figure):
                await going.wait()
                drawn.append(figure)

            page.view.main.draw = draw
            show(page, result())
            page.plots.redraw()
            await asyncio.sleep(0.05)
            page.view.curve = views.DrawnResult(DOCUMENT, result("5 nm"))
            later = asyncio.create_task(page.view.draw())
            page.plots.redraw()
            await asyncio.sleep(0.05)
            going.set()
            await later
            await until(lambda: len(drawn) == 3)
            last = page.view.compose(result("5 nm"))
            assert [figure["data"] == last["data"] for figure in drawn] == [False, True, True]

    asyncio.run(flow())


def test_a_click_on_a_figure_that_was_replaced_shows_no_motion_of_another(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            show(page, result())
            page.view.main.revision += 1
            click(page, curve=0, index=11, revision=page.view.main.revision - 1)
            assert page.plots.motion.spot is None

    asyncio.run(flow())


@pytest.mark.parametrize(("change", "behind"), [(("title", "Mine"), False), (("tip", {"radius": "3 nm"}), True)])
def test_a_part_is_behind_when_its_case_is_another_and_not_for_its_title(change, behind):
    async def flow():
        current = [DOCUMENT]
        shown, marks = ShownParts(lambda: current[0]), []
        shown.mark(PagePart.CURVES, marks.append)
        shown.show(PagePart.CURVES, DOCUMENT)
        current[0] = DOCUMENT.put(change[:1], change[1])
        shown.look()
        assert marks == []  # not at once
        await asyncio.sleep(PagePart.CURVES.patience + 0.1)
        assert marks == [True] * behind
        shown.show(PagePart.CURVES, current[0])
        assert marks == [True, False] * behind

    asyncio.run(flow())


def test_an_edited_case_goes_without_the_sentence_on_what_the_example_shows(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            await page._open("figure-3-air-jump")
            shows = df.example("figure-3-air-jump").about.shows
            await user.should_see(shows)
            page.view.edit(page.view.document.put(("title",), "Mine"))
            assert page.view.document.case().about.shows == shows
            page.view.edit(page.view.document.put(("drive", "A0"), "5 nm"))
            lines = [one for one in user.find(ui.label).elements if "df-about" in one.classes]
            assert [one.text for one in lines if one.visible] == []
            case = page.view.document.case()
            assert shows not in case.to_toml() + case.to_python() + df.run(case).attrs["case"]
            page.view.edit(page.view.document.put(("drive", "A0"), "10 nm"))  # as by a slider that goes back
            assert page.view.document.case().about.shows == shows
            page.view.edit(page.view.document.switch(0, False))
            assert page.view.document.case().about is None
            again = Document.from_plain(page.view.document.to_plain())
            assert again.case() == page.view.document.case()
            page.view.session.undo()
            assert page.view.document.case().about.shows == shows

    asyncio.run(flow())
