"""The window without a browser: forms from declarations, edits, curves, runs."""

from __future__ import annotations

import asyncio
import gc
import re
import threading
import time
import weakref
from typing import ClassVar

import pytest
from nicegui.testing.user_simulation import user_simulation
from simulated import element, send, until, window

import dforce as df
from dforce.gui.case.entry import Entry, ForceList
from dforce.gui.case.forms import TEXTUAL
from dforce.gui.case.sliders import SliderElement
from dforce.gui.document.compute import Job, Live
from dforce.gui.document.document import Document
from dforce.gui.document.session import Session
from dforce.gui.window.pages import Page
from dforce.results.status import repeats


def entry(user, path):
    """Return the field of a path."""
    with user.client:
        found = [element for element in user.client.elements.values() if isinstance(element, Entry)]
    return next(element for element in found if element.props["path"] == path and element.props["kind"] != "choice")


def type_into(user, path, text, unit=""):
    """Type a text into a field."""
    field = entry(user, path)
    for listener in field._event_listeners.values():
        if listener.type == "typed":
            field._handle_event({"listener_id": listener.id, "args": {"text": text, "unit": unit}})
    return field


def test_what_is_typed_goes_to_the_case_and_mistakes_to_their_field(tmp_path):
    async def flow():
        async with window(tmp_path) as (user, page):
            type_into(user, "drive.A0", "0,5", "um")
            assert page.view.document.case().drive.A0 == 0.5e-6
            field = type_into(user, "drive.A0", "-1", "nm")
            page.view.show(anew=False)
            await until(lambda: "is not above 0 nm" in field.props.get("error", ""))

    asyncio.run(flow())


def test_operation_stands_in_the_form_of_the_drive_and_brings_the_fields_of_a_lock(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            form, keys = page.forms, ("operation", "phase_set_point", "signal")
            unfolded = [key for key in keys if not form._hidden[("drive", key)]]
            assert unfolded == ["operation"]
            send(form.shown[("drive", "operation")][2], "typed", {"text": "fm", "unit": ""})
            assert page.view.document.case().drive.operation == "fm"
            assert [key for key in keys if not form._hidden[("drive", key)]] == list(keys)

    asyncio.run(flow())


@pytest.mark.parametrize("name", ["hysteresis", "figure-6", "resonance-curve"])
def test_each_field_answers_a_wrong_text_and_takes_the_right_one_back(tmp_path, name):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            opened = Document.of(df.example(name))
            page.view.open(opened)
            kinds = {path: shape.kind for path, (_, shape, _) in page.forms.shown.items()}
            numbers = [path for path, kind in kinds.items() if kind in TEXTUAL and kind != "text"]
            assert len(numbers) > 20
            for path in numbers:
                entry = page.forms.shown[path][2]
                before = {"text": entry.props["text"], "unit": entry.props.get("unit") or ""}
                send(entry, "typed", {"text": "zork", "unit": before["unit"]})
                assert "zork" in entry.props["error"], path
                send(entry, "typed", before)
                assert entry.props["error"] == "", path
            assert page.forms.last.wrong == "" and page.view.document.case().problem == opened.case().problem

    asyncio.run(flow())


def test_a_unit_that_is_wrong_is_not_what_the_next_number_is_in(tmp_path):
    async def flow():
        async with window(tmp_path) as (user, page):
            field = type_into(user, "drive.A0", "10 kg", "nm")
            page.view.show(anew=False)
            assert (field.props["text"], field.props["unit"]) == ("10 kg", "nm")

    asyncio.run(flow())


def test_empty_fields_of_a_lever_by_name_show_what_the_library_has(tmp_path):
    def hints(user):
        return {key: entry(user, f"cantilever.{key}").props.get("placeholder", "") for key in ("f0", "k", "Q")}

    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            view, lever = page.view, {"name": "PPP-NCHR", "Q": 400}
            view.edit(view.document.put(("cantilever",), lever), anew=True)
            assert hints(user) == {"f0": "330", "k": "42", "Q": "400"}
            assert entry(user, "cantilever.f0").props["unit"] == "kHz"
            type_into(user, "cantilever.name", "PPP-CONTR")
            probe = df.cantilevers()["PPP-CONTR"]
            assert hints(user)["k"] == f"{probe.k:g}"
            view.edit(view.document.put(("cantilever", "library"), "own.csv"), anew=True)
            assert hints(user) == {"f0": "", "k": "", "Q": ""}

    asyncio.run(flow())


def test_a_comma_that_may_mean_thousands_is_said_at_its_field(tmp_path):
    async def flow():
        async with window(tmp_path) as (user, page):
            field = type_into(user, "drive.A0", "1,000", "nm")
            page.view.show(anew=False)
            assert "thousands" in field.props["error"]

    asyncio.run(flow())


def test_a_new_force_model_appears_by_itself(tmp_path):
    class Spring(df.Force):
        """A spring that pulls back at any distance."""

        name = "window_test_spring"
        example: ClassVar = {"stiffness": "1 mN/m"}
        stiffness: float = df.param(unit="N/m", symbol="k_s", low="0 N/m", doc="stiffness of the test spring")

        @staticmethod
        def law(d: float, rate: float, t: float, stiffness: float) -> float:
            return -stiffness * d

    async def flow():
        async with window(tmp_path) as (user, page):
            user.find("Add a force").click()
            await until(
                lambda: "A spring that pulls back at any distance." in str(element(user, ForceList).props["groups"])
            )
            page.forms._add_force("window_test_spring")
            field = entry(user, "forces.2.stiffness")
            assert (field.props["label"], field.props["text"]) == ("Stiffness of the test spring", "1")
            assert page.view.document.case().forces[1].stiffness == 1e-3

    try:
        asyncio.run(flow())
    finally:
        del df.forces.REGISTRY["window_test_spring"]


@pytest.mark.parametrize(("every", "each"), [(0.0, True), (1e9, False)])
def test_while_something_is_dragged_what_stands_beside_the_curves_is_shown_now_and_then(
    tmp_path, live_as, monkeypatch, every, each
):
    beside, moves = [], iter(range(11, 21))
    result = df.run(df.example("figure-3-air"))

    async def flow():
        async with window(tmp_path) as (_, page):
            view, loop = page.view, asyncio.get_running_loop()
            await until(lambda: view.result is not None and not view._latest.busy and not view._beside.busy)

            def drag():
                if (move := next(moves, None)) is not None:
                    view.edit(view.document.put(("drive", "A0"), f"{move} nm"))

            def live(case, *_):  # the hand is ahead: the next value is there before the curve of this one
                asyncio.run_coroutine_threadsafe(asyncio.to_thread(loop.call_soon_threadsafe, drag), loop).result()
                return Live(result.assign_attrs(asked=case.drive.A0))

            live_as(live)
            monkeypatch.setattr("dforce.gui.window.view.BESIDE_EVERY", every)
            view.on_beside.append(lambda: beside.append(view.result.attrs["asked"]))
            drag()
            await until(lambda: beside and beside[-1] == pytest.approx(20e-9))

    asyncio.run(flow())
    assert (len(beside) > 1) == each  # else only once the hand rests


def test_a_mistake_that_is_typed_while_a_case_compiles_ends_the_word_that_it_computes(tmp_path, live_as):
    compiled = threading.Event()

    def compiles(case, overtaken, say):
        say("compiling ...")
        compiled.wait(20.0)
        return Live(None, gave_up=True, compiled=True)

    async def flow():
        async with window(tmp_path) as (user, page):
            await until(lambda: not page.view._latest.busy)
            live_as(compiles)
            type_into(user, "drive.A0", "7", "nm")
            await until(lambda: page.view.status)
            type_into(user, "cantilever.f0", "1e400", "Hz")
            compiled.set()
            await until(lambda: not page.view._latest.busy)
            assert page.view.said.wrong
            assert page.view.status == ""

    asyncio.run(flow())


def test_a_mistake_is_said_before_the_curve_of_an_earlier_value_has_come(tmp_path, live_as):
    computed, begun = threading.Event(), threading.Event()

    def computes(case, overtaken, say):
        begun.set()
        computed.wait(20.0)
        return Live(None, gave_up=True)

    async def flow():
        async with window(tmp_path) as (user, page):
            await until(lambda: not page.view._latest.busy)
            live_as(computes)
            type_into(user, "drive.A0", "7", "nm")
            await until(begun.is_set)
            assert page.view.status == ""  # nothing is said of it so far
            type_into(user, "cantilever.f0", "1e400", "Hz")
            assert page.view.said.wrong
            computed.set()
            await until(lambda: not page.view._latest.busy)

    asyncio.run(flow())


def test_a_page_that_has_gone_leaves_nothing_in_the_server(tmp_path):
    left = []

    def root():
        page = Page(Session({}, tmp_path))
        page.view._latest.ask = lambda wanted: None
        left.append({"page": weakref.ref(page), "view": weakref.ref(page.view), "chart": weakref.ref(page.view.main)})

    async def flow():
        async with user_simulation(root=root) as user:
            user.javascript_rules[re.compile("return dforce(Unsent|Address)")] = lambda match: ()
            await user.open("/")
            user.client.delete()
            await user.open("/")  # the simulated browser forgets the first page
            await asyncio.sleep(0.1)
            gc.collect()
            gc.collect()
            still = [name for name, ref in left[0].items() if ref() is not None]
            user.client.outbox.stop()
            assert not still

    asyncio.run(flow())


def test_a_slider_hears_what_is_typed_and_not_of_what_it_said_itself(tmp_path):
    async def flow():
        async with window(tmp_path) as (user, page):
            slider, told = element(user, SliderElement), []
            slider.run_method = lambda name, value: told.append(value)
            send(slider, "slide", 7.0)
            assert page.view.document.value(("drive", "A0")) == "7 nm"
            assert (slider.props["given"], told) == (7.0, [])
            for text in ("9", "7"):
                type_into(user, "drive.A0", text, "nm")
            assert told == [9.0, 7.0]

    asyncio.run(flow())


def test_a_run_keeps_its_result(tmp_path):
    async def flow():
        async with window(tmp_path) as (_, page):
            await page.view.run()
            session = page.view.session
            assert session.job.state == "done"
            (kept,) = session.document.results
            assert session.results.take(kept.id).sizes["zc"] == 221

    asyncio.run(flow())


def test_a_run_stops_within_a_second_and_keeps_what_was_computed(tmp_path):
    async def flow():
        session = Session({}, tmp_path)
        # a transient of thousands of periods at each of many distances
        document = session.document.put(("solver",), {"method": "transient", "settle_tolerance": 1e-12})
        session.document = document.put(("experiment", "zc", "points"), 2001)
        async with window(tmp_path, session) as (_, page):
            run = asyncio.create_task(page.view.run())
            await until(lambda: session.job is not None and session.job.done > 3, 60.0)
            begun = asyncio.get_running_loop().time()
            session.stop()
            await until(lambda: not session.job.busy)
            assert asyncio.get_running_loop().time() - begun < 1.2  # and a look every 0.15 s
            await run  # on a busy machine the result comes a little later
            (kept,) = session.document.results
            result = session.results.take(kept.id)
            # errors of the last points may not be known yet
            assert 0 < int(repeats(result["status"].values).sum()) < 4002

    asyncio.run(flow())


def test_an_example_that_takes_long_is_run_when_it_is_opened(tmp_path, live_as):
    live_as(lambda *_: Live(None, gave_up=True))

    async def flow():
        async with window(tmp_path) as (user, page):
            await page._open("figure-3-water")
            await until(lambda: page.view.result is not None)  # it is kept first, then drawn
            assert page.view.result.attrs["title"] == df.example("figure-3-water").title
            type_into(user, "drive.A0", "9", "nm")  # an edit waits for Run
            await until(lambda: "press Run" in page.view.status)
            assert len(page.view.session.document.results) == 1

    asyncio.run(flow())


def test_a_failure_in_a_simulated_window_ends_at_once_although_something_runs(tmp_path):
    async def flow():
        async with window(tmp_path) as (user, page):
            type_into(user, "drive.A0", "5", "nm")
            run = asyncio.create_task(page.view.run())
            await asyncio.sleep(0.1)
            assert not run.done()
            raise ArithmeticError

    with pytest.raises(ArithmeticError):
        asyncio.run(flow())


def test_what_a_run_gives_only_after_it_counts_as_stopped_is_kept():
    job = Job(df.example("figure-3-air"), state="running")

    def work():
        job.stopping.wait(10.0)
        time.sleep(1.0)
        job.result = "late"

    async def flow():
        job.work = work
        run = asyncio.create_task(job.go(lambda: None))
        job.stopping.set()
        await until(lambda: not job.busy)
        assert job.result is None
        await run
        assert job.result == "late"

    asyncio.run(flow())


def test_undo_and_redo_take_edits_back_and_forth(tmp_path):
    async def flow():
        async with window(tmp_path) as (user, page):
            first = page.view.document
            type_into(user, "drive.A0", "5", "nm")
            type_into(user, "tip.radius", "9", "nm")
            second = page.view.document
            page.view.session.undo()
            page.view.session.undo()
            assert page.view.document == first
            page.view.session.redo()
            page.view.session.redo()
            assert page.view.document == second

    asyncio.run(flow())


def test_what_was_typed_is_there_after_a_restart(tmp_path):
    store: dict[str, object] = {}

    async def flow():
        async with window(tmp_path, Session(store, tmp_path)) as (user, page):
            type_into(user, "drive.A0", "5", "nm")
            type_into(user, "tip.radius", "not yet a num", "nm")
            page.view.session.close()

    asyncio.run(flow())
    assert Session(store, tmp_path).document.value(("drive", "A0")) == "5 nm"
    assert Session(store, tmp_path).document.value(("tip", "radius")) == "not yet a num"


def test_what_a_page_could_not_send_is_taken_by_the_next(tmp_path):
    async def flow():
        unsent = [["drive.A0", "7,5", "nm", 1], ["gone.with.the.form", "1", "", 2]]
        async with window(tmp_path, unsent=unsent) as (_, page):
            await until(lambda: page.view.document.value(("drive", "A0")) == "7.5 nm")

    asyncio.run(flow())


def test_every_example_opens(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            for name in df.examples():
                await page._open(name)
                assert page.view.document.case() == df.example(name)

    asyncio.run(flow())
