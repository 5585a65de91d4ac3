"""What happens in a page while something else is under way: a file that is written, a job that ends late, another case."""

from __future__ import annotations

import asyncio
import dataclasses
import threading

import fitted_curves
import measured_curve
import pytest
from simulated import element, send, until, window

import dforce as df
from dforce.gui.curves.motion import Drawing
from dforce.gui.document.compute import ComputeQueue, Job
from dforce.gui.document.document import Document
from dforce.gui.measured import fitting, reading
from dforce.gui.measured.fitting import SafeJob
from dforce.gui.measured.panel import MeasuredPanel
from dforce.gui.measured.session import MeasuredSession, ReconstructJob
from dforce.gui.study.parameter_study import Over, SweepJob
from dforce.gui.window.shown import DrawnResult

LAG = {"phase_convention": "lag"}


def raw(folder, **how):
    """Return a measured curve as it is read, before its calibration."""
    return reading.curve_from(measured_curve.text(**how).encode(), "curve.csv", LAG, None, folder)


def fit_of(session, **attrs):
    """Return a fit as it lies in a file, made up by hand."""
    fit = fitted_curves.result()
    return fit.assign_attrs(session.measured.curve.attrs, **fit.attrs, **attrs)


def confirm(session):
    """Confirm the lever and the tip of the document."""
    measured = dataclasses.replace(session.document.measured, confirmed=fitting.lever_of(session.document))
    session.look(dataclasses.replace(session.document, measured=measured))


class Held:
    """Work that begins and then waits until it may go on."""

    def __init__(self, work):
        self.work, self.begun, self.going = work, threading.Event(), threading.Event()

    def __call__(self, *args, **more):
        self.begun.set()
        self.going.wait(20.0)
        return self.work(*args, **more)


@pytest.mark.parametrize("what", ["fit", "reconstruct"])
def test_a_curve_is_fitted_and_reconstructed_as_it_is_calibrated_for_the_instrument_that_is_typed(
    tmp_path, monkeypatch, what
):
    given = []

    def take(case, data, progress):
        given.extend((case, data) if what == "fit" else (data, case))
        raise df.ParameterError("enough")

    monkeypatch.setattr(df, what, take)

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            session = page.view.session
            await session.take_measured(raw(tmp_path), "a.csv", LAG)
            await session.measured.load(session.document)
            page.view.edit(page.view.document.put(("cantilever", "Q"), 250.0))  # no curve is drawn after it
            confirm(session)
            if what == "fit":
                await session.fit(page.view.document)
            else:
                await page.plots.reconstruction.start()
            case, data = given
            assert case.problem.modes[0].Q == data.attrs["Q"] == 250.0

    asyncio.run(flow())


def test_a_force_is_reconstructed_at_the_shift_that_is_typed_and_not_at_that_of_the_curve_before(tmp_path, monkeypatch):
    given = []

    def take(data, case, progress):
        given.append(data)
        raise df.ParameterError("enough")

    monkeypatch.setattr(df, "reconstruct", take)

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            session = page.view.session
            await session.take_measured(raw(tmp_path), "a.csv", LAG)
            await session.measured.load(session.document)
            page.view.curve = DrawnResult(page.view.document, df.run(page.view.document.case()))
            page.view.edit(page.view.document.put(("sample", "youngs_modulus"), "5 GPa"))
            page.plots.measured._change(shift=0.7e-9)
            confirm(session)
            await page.plots.reconstruction.start()
            heights = session.measured.curve["height"].values
            assert given[0]["height"].values == pytest.approx(heights + 0.7e-9)
            page.plots.reconstruction.open()
            assert page.plots.reconstruction.element.props["failed"] == "Enough."
            page.plots.measured._change(shift=0.8e-9)  # of another input nothing is known
            page.plots.reconstruction.show()
            assert page.plots.reconstruction.element.props["failed"] == ""

    asyncio.run(flow())


@pytest.mark.parametrize("meanwhile", ["fit", "curve"])
def test_the_file_of_a_curve_stays_although_another_one_or_a_fit_is_written_meanwhile(tmp_path, meanwhile):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            session = page.view.session
            await session.take_measured(raw(tmp_path), "a.csv", LAG)
            before, second = session.document.measured, raw(tmp_path, points=80)
            keep = session.measured.results.keep
            held = Held(lambda name: name)

            def slow(result):
                name = keep(result)
                return held(name) if result is second else name

            session.measured.results.keep = slow
            late = asyncio.create_task(session.take_measured(second, "b.csv", LAG))
            await asyncio.to_thread(held.begun.wait, 20.0)
            other = (
                session._keep_fit(fitted_curves.result(), before)
                if meanwhile == "fit"
                else session.take_measured(raw(tmp_path, points=60), "c.csv", LAG)
            )
            other = asyncio.create_task(other)
            await asyncio.wait({other}, timeout=1.0)
            held.going.set()
            await asyncio.gather(late, other)
            assert session.document.measured.id in session.measured.results.names()

    asyncio.run(flow())


def test_safe_settings_are_shown_for_the_fit_alone_that_they_are_of(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            session, panel = page.view.session, element(user, MeasuredPanel)
            await session.take_measured(raw(tmp_path), "a.csv", LAG)
            await session.measured.load(session.document)
            await session._keep_fit(fit_of(session), session.document.measured)
            await session.measured.load(session.document)
            page.plots.measured.open()
            job = SafeJob(
                page.view.document.case(), document=page.view.document, fit=session.measured.fit, state="done"
            )
            job.result = fitted_curves.result().assign_attrs(findings=["At 80 % the peak force is 0.3 nN."])
            session.measured.safe = job
            page.plots.measured.show()
            assert panel.props["findings"]
            # an instrument that is typed calibrates anew, and the fit is the same
            page.view.edit(page.view.document.put(("cantilever", "Q"), 250.0))
            await session.measured.load(session.document)
            page.plots.measured.show()
            assert panel.props["findings"]
            await session._keep_fit(fit_of(session, data_source="b.csv"), session.document.measured)
            await session.measured.load(session.document)
            page.plots.measured.show()
            assert panel.props["report"] and not panel.props["findings"]

    asyncio.run(flow())


def test_a_result_over_parameters_that_is_opened_stays_when_an_earlier_computation_ends(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            study, late, opened = page.view.session.study, fitted_curves.result(), fitted_curves.result()
            job = SweepJob(page.view.document.case(), document=page.view.document)
            held = Held(lambda: late)
            job.compute = held
            running = asyncio.create_task(study.compute(job, (None, None), lambda: None, 0.02))
            await asyncio.to_thread(held.begun.wait, 20.0)
            study.open(Over(opened))
            held.going.set()
            await running
            assert study.result is opened
            assert not study.busy and job.stopping.is_set()

    asyncio.run(flow())


def test_what_a_project_holds_is_not_followed_by_the_fit_of_the_case_before(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            session = page.view.session
            session.fitting = Job(page.view.document.case(), state="running")
            job = session.fitting
            await session.take_project(Document.first(), {})
            assert job.stopping.is_set() and session.fitting is None

    asyncio.run(flow())


def test_a_run_that_ended_after_a_later_one_began_takes_no_place_in_the_chart(tmp_path, monkeypatch):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            session, shown = page.view.session, []
            page.view.show_result = shown.append
            whole = df.run(page.view.document.case())
            results = [whole.assign_attrs(interrupted=1), whole]
            held = Held(lambda: results[0])
            work = iter([held, lambda: results[1]])
            monkeypatch.setattr(Job, "compute", lambda job: next(work)())
            monkeypatch.setattr("dforce.gui.document.compute.TURNS", ComputeQueue(2))
            first = asyncio.create_task(session.run(page.view.document))
            await asyncio.to_thread(held.begun.wait, 20.0)
            session.stop()
            await until(lambda: session.job.state == "stopped")  # it does not stop in time, and counts as stopped
            await session.run(page.view.document)
            held.going.set()
            await first
            assert shown == [whole]
            assert len(session.document.results) == 2

    asyncio.run(flow())


def test_what_is_drawn_is_looked_up_in_the_thread_in_which_it_changes(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            result, threads = df.run(page.view.document.case()), []
            layers = page.plots.kept.layers

            def looked(one):
                threads.append(threading.current_thread())
                return layers(one)

            page.plots.kept.layers = looked
            page.view.curve = DrawnResult(page.view.document, result)
            await page.view.draw()
            assert set(threads) == {threading.current_thread()}

    asyncio.run(flow())


def test_a_curve_is_there_although_the_page_that_began_to_load_it_is_gone(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            session = page.view.session
            await session.take_measured(raw(tmp_path), "a.csv", LAG)
            other = MeasuredSession(session.measured.results.folder)
            held = other.results.take = Held(other.results.take)
            loading = asyncio.create_task(other.load(session.document))
            await asyncio.to_thread(held.begun.wait, 20.0)
            loading.cancel()
            held.going.set()
            await asyncio.wait({loading})
            assert await other.load(session.document) is not None

    asyncio.run(flow())


def test_a_second_press_of_compute_begins_no_second_computation(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            study, begun = page.view.session.study, []
            jobs = [SweepJob(page.view.document.case(), document=page.view.document) for _ in range(2)]
            for job in jobs:
                job.compute = lambda job=job: begun.append(job) or fitted_curves.result()
            await asyncio.gather(*(study.compute(job, (None, None), lambda: None, 0.02) for job in jobs))
            assert begun == jobs[:1]

    asyncio.run(flow())


def test_safe_settings_and_a_reconstruction_go_on_without_their_page_and_end_with_the_session(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            session, case = page.view.session, page.view.document.case()
            jobs = session.measured.safe, session.measured.force = SafeJob(case), ReconstructJob(case)
            user.client.delete()
            assert not any(job.stopping.is_set() for job in jobs)
            session._seen -= 100.0  # s, in which no page has shown the session
            assert not session.idle(60.0)
            session.close()
            assert all(job.stopping.is_set() for job in jobs)

    asyncio.run(flow())


def test_a_click_while_the_next_figure_is_on_its_way_shows_the_motion_there(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (user, page):
            view, plots, case = page.view, page.plots, page.view.document.case()
            view.curve = DrawnResult(view.document, df.run(case))
            await view.draw()
            await view.main.drawn()
            on_screen, going = view.main.revision, asyncio.Event()
            first = next(n for n, trace in enumerate(plots.drawn.traces) if trace is not None)
            index = plots.drawn.traces[first][1].places.tolist().index(11)

            async def slow(*given, **more):
                await going.wait()

            view.main.run_method = slow
            view.edit(view.document.put(("drive", "A0"), "9 nm"))
            view.curve = DrawnResult(view.document, df.run(view.document.case()))
            await view.draw()
            await until(lambda: view.main.revision == on_screen + 1)
            send(view.main, "point", {"revision": on_screen, "curve": first, "index": index, "x": 0, "y": 0, "id": ""})
            drawing = element(user, Drawing)
            await until(lambda: drawing.props.get("motion"))
            plots.motion.follow(view.curve, plots.layers)  # the same place of the newer curve
            assert plots.motion.spot.result is view.curve.result and plots.motion.spot.places["zc"] == 11
            going.set()

    asyncio.run(flow())
