"""Computing off the event loop: the newest request wins, and what takes long is given up or stopped."""

from __future__ import annotations

import asyncio
import threading
import time
import types
from concurrent.futures import ThreadPoolExecutor

import pytest

import dforce as df
from dforce.core import log
from dforce.gui.document import compute
from dforce.gui.document.compute import Job, Latest, Overtaken, RecentCurves, in_thread, key_of, live_curve
from dforce.gui.document.document import Document
from dforce.gui.document.session import Session

SLOW = {"method": "transient", "settle_tolerance": 1e-12}  # thousands of periods at each distance


def slow_case():
    """Return a case that takes minutes."""
    return df.example("figure-3-air").replace(solver=SLOW).replace("experiment.zc.points", 20_001)


def test_of_many_requests_only_the_one_under_way_and_the_newest_are_done():
    done = []

    async def flow():
        gate = asyncio.Event()

        async def work(thing):
            await gate.wait()
            done.append(thing)

        latest = Latest(work)
        latest.ask(0)
        await asyncio.sleep(0)
        for thing in range(1, 10):
            latest.ask(thing)
        assert latest.overtaken
        gate.set()
        await latest.task

    asyncio.run(flow())
    assert done == [0, 9]


def test_two_requests_never_overlap():
    async def flow():
        at_once, most = 0, 0

        async def work(thing):
            nonlocal at_once, most
            at_once += 1
            most = max(most, at_once)
            await asyncio.sleep(0.001)
            at_once -= 1

        latest = Latest(work)
        for thing in range(20):
            latest.ask(thing)
            await asyncio.sleep(0.0007)
        await latest.task
        return most

    assert asyncio.run(flow()) == 1


def test_a_rest_ends_when_nothing_is_under_way_or_its_time_is_over():
    async def flow():
        gate = asyncio.Event()
        latest = Latest(lambda thing: gate.wait())
        await latest.rest(60.0)
        latest.ask(0)
        await latest.rest(0.01)
        assert latest.busy
        asyncio.get_running_loop().call_later(0.01, gate.set)
        async with asyncio.timeout(30.0):
            await latest.rest(60.0)
        assert not latest.busy

    asyncio.run(flow())


def test_a_curve_that_takes_too_long_is_given_up():
    live = live_curve(slow_case(), lambda: False, lambda text: None, patience=0.2)
    assert live.gave_up


def test_a_curve_that_waits_for_the_machine_is_given_more_time(run_as):
    """Its thread sleeps, as where others compute: that is no time of its own, but its end comes, too."""
    result = df.run(df.example("figure-3-air").set("experiment.zc.points=5"))
    limits = {"patience": 0.2, "latest": 2.0}

    def sleeping(seconds):
        def run(case, progress):
            try:
                for done in range(10):
                    progress(done, 10, "")
                    time.sleep(seconds)
            except KeyboardInterrupt:
                return result.assign_attrs(interrupted=1)
            return result

        return run

    run_as(sleeping(0.03))
    assert not live_curve(slow_case(), lambda: False, lambda text: None, **limits).gave_up
    run_as(sleeping(0.3))
    assert live_curve(slow_case(), lambda: False, lambda text: None, **limits).gave_up


def test_a_curve_is_given_up_when_something_newer_waits():
    begun = time.monotonic()
    live = live_curve(slow_case(), lambda: True, lambda text: None)
    assert live.gave_up
    assert time.monotonic() - begun < 60.0  # against minutes; the time to load the kernel is in it


def test_the_time_in_which_code_is_compiled_is_no_time_of_a_curve(run_as, monkeypatch):
    """Each of two functions takes longer to compile than a curve may, one of them after the first points."""
    now = [0.0]
    clock = types.SimpleNamespace(
        monotonic=lambda: now[0], thread_time=lambda: now[0]
    )  # a busy machine's would count what others take
    monkeypatch.setattr(compute, "time", clock)
    monkeypatch.setattr(log, "time", clock)
    result = df.run(df.example("figure-3-air").set("experiment.zc.points=5"))
    heard = []

    def compiling(case, progress):
        progress(0, 10, "")
        try:
            for done in range(10):
                if done in (0, 5):
                    with log.done_once():
                        log.announce(f"Compiling {done}")
                        log.show_progress("Compiling", 0.1 * done + 0.2)
                        now[0] += 2.0 * compute.PATIENCE
                now[0] += 0.05 * compute.PATIENCE
                progress(done, 10, "")
        except KeyboardInterrupt:
            return result.assign_attrs(interrupted=1)
        return result

    run_as(compiling)
    live = live_curve(df.example("figure-3-air"), lambda: False, heard.append)
    assert (live.gave_up, live.compiled) == (False, True)
    assert heard == ["Compiling 0", "Compiling: 20 %", "Compiling 5", "Compiling: 70 %"]


def test_a_quick_curve_is_whole():
    live = live_curve(df.example("figure-3-air"), lambda: False, lambda text: None)
    assert not live.gave_up
    assert int((live.result["status"] == df.Status.OK).sum()) == 442


def test_what_stands_behind_gives_way_while_a_curve_of_any_page_is_computed(run_as):
    began, over = threading.Event(), threading.Event()

    def waiting(case, progress):
        began.set()
        assert over.wait(10.0)
        return df.dwell(df.example("figure-3-air"), zc="5 nm")

    run_as(waiting)
    with ThreadPoolExecutor(2) as threads:
        curve = threads.submit(live_curve, df.example("figure-3-air"), lambda: False, lambda text: None)
        assert began.wait(10.0)
        behind = threads.submit(compute.LIVE_CURVES.give_way, lambda: False)
        with pytest.raises(Overtaken):
            compute.LIVE_CURVES.give_way(lambda: True)
        time.sleep(2.0 * compute.LULL)
        assert not behind.done()
        over.set()
        curve.result(10.0)
        behind.result(10.0)


def test_the_event_loop_is_free_while_a_thread_computes():
    async def flow():
        computing = asyncio.ensure_future(in_thread(compute.LIVE, lambda: time.sleep(0.3)))
        turns = 0
        while not computing.done():
            await asyncio.sleep(0.001)
            turns += 1
        return turns

    assert asyncio.run(flow()) > 10


def test_runs_wait_for_their_turn_in_order(one_worker, run_as):
    """One worker, three runs: they come one after the other, as they were asked for."""
    order = []

    def remembering(case, progress):
        order.append(case.title)
        return df.dwell(df.example("figure-3-air"), zc="5 nm")

    run_as(remembering)
    jobs = [Job(df.example("figure-3-air").replace("title", name)) for name in "abc"]

    async def flow():
        await asyncio.gather(*(job.go(lambda: None) for job in jobs))

    asyncio.run(flow())
    assert order == ["a", "b", "c"]
    assert {job.state for job in jobs} == {"done"}


@pytest.fixture
def one_worker(monkeypatch):
    """Let one run compute at a time, in turns of 0.05 s."""
    monkeypatch.setattr(compute, "TURNS", compute.ComputeQueue(1))
    monkeypatch.setattr(compute, "TURN", 0.05)


@pytest.fixture
def order(one_worker, run_as):
    """Let a run be a count of looks at its progress, the number in its title, some 10 ms apart; give who is done."""
    done_runs = []
    result = df.dwell(df.example("figure-3-air"), zc="5 nm")

    def counting(case, progress):
        name, count = case.title.split()
        try:
            for done in range(int(count)):
                progress(done, int(count), "")
                time.sleep(0.01)
        except KeyboardInterrupt:
            return result.assign_attrs(interrupted=1)
        done_runs.append(name)
        return result

    run_as(counting)
    return done_runs


def job(title):
    return Job(df.example("figure-3-air").replace("title", title))


def test_a_long_run_of_one_person_does_not_keep_another_waiting(order):

    async def flow():
        long = asyncio.ensure_future(job("long 300").go(lambda: None))
        await asyncio.sleep(0.1)
        await job("short 5").go(lambda: None, every=0.01)
        assert not long.done()
        await long

    # its turn comes after 0.05 s, and it takes 0.05 s; the long one takes 3 s
    asyncio.run(flow())
    assert order == ["short", "long"]


def test_the_next_run_of_a_person_goes_behind_those_of_others(order, monkeypatch, tmp_path):
    monkeypatch.setattr(compute, "TURN", 60.0)  # nobody has to pass on

    async def flow():
        def named(title):
            return Document.of(df.example("figure-3-air").replace("title", title))

        one = Session({}, tmp_path / "one")

        async def twice():
            await one.run(named("first 20"))
            await one.run(named("second 2"))

        going = asyncio.ensure_future(twice())
        await asyncio.sleep(0.05)
        waiting = [Session({}, tmp_path / str(n)) for n in range(3)]
        await asyncio.gather(going, *(session.run(named(f"other{n} 20")) for n, session in enumerate(waiting)))
        for session in (one, *waiting):
            session.close()

    asyncio.run(flow())
    assert order == ["first", "other0", "other1", "other2", "second"]


def test_the_time_of_others_is_no_part_of_a_runs_own(order):
    one = job("one 60")
    one.seconds = 2.0  # alone it takes some 0.7 s, with the others' turns four times that

    async def flow():
        await asyncio.gather(*(each.go(lambda: None) for each in (one, job("a 60"), job("b 60"), job("c 60"))))

    asyncio.run(flow())
    assert one.state == "done"


def test_a_run_over_its_time_keeps_what_was_computed():
    job = Job(slow_case(), seconds=0.3)
    asyncio.run(job.go(lambda: None))
    assert job.state == "stopped"
    assert int((job.result["status"] == df.Status.OK).sum()) > 0


def test_what_cannot_be_stopped_counts_as_stopped_and_still_gives_what_it_has(run_as):
    """As a compilation, which asks nobody while it lasts."""
    over, result = threading.Event(), df.dwell(df.example("figure-3-air"), zc="5 nm")

    def deaf(case, progress):
        assert over.wait(60.0)
        return result

    run_as(deaf)
    job = Job(df.example("figure-3-air"))

    async def flow():
        going = asyncio.ensure_future(job.go(lambda: None))
        await asyncio.sleep(0.3)
        job.stopping.set()
        async with asyncio.timeout(30.0):
            while job.busy:
                await asyncio.sleep(0.01)
        assert not going.done()
        over.set()
        await going

    asyncio.run(flow())
    assert job.result is result


@pytest.mark.parametrize("error", [df.ParameterError("a sentence"), RuntimeError("a defect")])
def test_a_run_that_fails_says_so(run_as, error):
    def failing(case, progress):
        raise error

    run_as(failing)
    job = Job(df.example("figure-3-air"))
    asyncio.run(job.go(lambda: None))
    assert job.state == "failed"
    assert str(error) in job.error


def test_time_left_follows_from_the_pace():
    job = Job(df.example("figure-3-air"), done=25, total=100, began=time.monotonic() - 10.0)
    assert job.time_left() == pytest.approx(30.0, abs=1.0)
    assert Job(df.example("figure-3-air"), done=0, total=100).time_left() is None


def test_a_curve_of_late_is_given_again_for_the_same_case_alone():
    case, curves = df.example("figure-3-air"), RecentCurves(10_000_000)
    curve = df.run(case)
    curves.keep(key_of(case), curve)
    again = curves.take(key_of(df.Case.from_toml(case.to_toml())))
    assert again is not curve and again.identical(curve)
    again.attrs["title"] = "changed by whoever has it"
    assert curves.take(key_of(case)).identical(curve)
    for path, value in (("drive.A0", "9 nm"), ("solver.accuracy", 1e-3), ("experiment.zc.points", 50)):
        assert curves.take(key_of(case.replace(path, value))) is None


def test_the_curves_that_nobody_asked_for_make_room():
    cases = [df.example("figure-3-air").replace("drive.A0", f"{size} nm") for size in (8, 9, 10)]
    curve = df.run(cases[0])
    curves = RecentCurves(2 * curve.nbytes)
    for case in cases[:2]:
        curves.keep(key_of(case), curve)
    curves.take(key_of(cases[0]))
    curves.keep(key_of(cases[2]), curve)
    assert [curves.take(key_of(case)) is not None for case in cases] == [True, False, True]


def test_when_a_page_is_gone_nothing_more_is_done_for_it():
    begun: list[int] = []

    async def flow():
        gate = asyncio.Event()

        async def work(thing):
            begun.append(thing)
            await gate.wait()
            begun.append(-thing)

        latest = Latest(work)
        latest.ask(1)
        await asyncio.sleep(0)
        latest.ask(2)
        latest.end()
        latest.ask(3)
        gate.set()
        await asyncio.sleep(0.05)
        assert not latest.busy

    asyncio.run(flow())
    assert begun == [1]
