"""SIGTERM stops a run as Ctrl-C does, and what was computed is kept."""

import math
import os
import signal
import threading
import time

import pytest

import dforce as df
from dforce import runs
from dforce.core.stopping import SAME, at_end, late_stop_waits, sigterm_as_ctrl_c
from dforce.findings.summary import count_status

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


@pytest.fixture(autouse=True)
def ctrl_c():
    """Have Python's own Ctrl-C, also where the tests run in the background of a shell."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def terminate():
    os.kill(os.getpid(), signal.SIGTERM)


def test_a_run_keeps_what_was_computed_however_often_it_is_told_to_stop(monkeypatch):
    monkeypatch.setattr("dforce.runs.LOOKS_A_SECOND", math.inf)  # else a quick run is over before its second look

    def watch(done, total, note):
        if done:
            terminate()
            terminate()

    result = df.run(df.example("figure-3-air"), progress=watch)
    found = count_status(result)
    assert result.attrs["interrupted"] and found[df.Status.NOT_COMPUTED]
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_a_sweep_keeps_what_was_computed():
    case = df.example("figure-3-air").replace("experiment.direction", "approach")
    result = df.sweep(case, {"drive.A0": [8e-9, 9e-9]}, progress=lambda done, total, note: terminate())
    assert result.attrs["interrupted"]


def test_a_handler_of_the_program_stays():
    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: heard.append(number))
    try:
        with sigterm_as_ctrl_c():
            terminate()
        assert heard == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)


def test_another_thread_leaves_signals_alone():
    found = []

    def work():
        with sigterm_as_ctrl_c():
            found.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [signal.SIG_DFL]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_stop_after_the_last_point_waits_for_the_result(monkeypatch, number):
    put_together = runs.advice

    def late(*args):
        os.kill(os.getpid(), number)
        return put_together(*args)

    monkeypatch.setattr(runs, "advice", late)
    result = df.run(df.example("figure-3-air"))
    assert df.Status.NOT_COMPUTED not in count_status(result)
    assert result.attrs["interrupted"], "a script that asks whether it is to end is told"
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    monkeypatch.setattr(runs, "advice", put_together)
    assert "interrupted" not in df.run(df.example("figure-3-air")).attrs, "the next run is another one"


def test_a_stop_that_came_when_only_one_part_was_done_ends_what_follows():
    with late_stop_waits() as stop, pytest.raises(KeyboardInterrupt):
        at_end(True)
        terminate()
        assert stop.asked
        at_end(False)


def test_a_second_ctrl_c_does_not_wait():
    with late_stop_waits() as stop, pytest.raises(KeyboardInterrupt):
        at_end(True)
        os.kill(os.getpid(), signal.SIGINT)
        assert stop.asked
        time.sleep(1.1 * SAME)
        os.kill(os.getpid(), signal.SIGINT)


def test_a_ctrl_c_that_is_sent_twice_at_once_is_one():
    with late_stop_waits():
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)


def test_a_result_without_a_point_says_so_wherever_it_is_read():
    def stop(*_):
        raise KeyboardInterrupt

    empty = df.approach(df.example("hysteresis"), progress=stop)
    assert count_status(empty) == {df.Status.NOT_COMPUTED: empty.status.size}
    assert "0 of 281" in str(df.summary(empty))
    for reader in (
        df.at_set_point,
        df.plot.overview,
        df.plot.amplitude_phase,
        lambda it: df.plot.curve(it, "amplitude"),
    ):
        with pytest.raises(df.ParameterError, match="stopped before its first point"):
            reader(empty)
