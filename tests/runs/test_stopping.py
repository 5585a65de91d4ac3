"""SIGTERM stops a run as Ctrl-C does, and what was computed is kept."""

import ast
import ctypes
import importlib
import os
import signal
import sys
import threading
import time
from pathlib import Path

import pytest

import dforce as df
from dforce import runs
from dforce.core import stopping
from dforce.core.parallel import Crew
from dforce.core.stopping import SAME, at_end, heard, late_stop_waits, look, sigterm_as_ctrl_c, unbroken
from dforce.results.status import count_status
from dforce.solvers import transient

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


@pytest.fixture(autouse=True)
def ctrl_c():
    """Have Python's own Ctrl-C, also where the tests run in the background of a shell."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def terminate(number=signal.SIGTERM):
    os.kill(os.getpid(), number)


@ctypes.CFUNCTYPE(None)
def terminate_unheard():
    """Be terminated in a function that C calls: what it raises goes no further."""
    terminate()


swallowing = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_run_keeps_what_was_computed_however_often_it_is_told_to_stop(name, every_look):
    """A closed terminal sends SIGHUP."""
    number = signal.Signals[name]

    def stop_soon(done, total, note):
        if done:
            terminate(number)
            terminate(number)

    before = signal.signal(number, signal.SIG_DFL)  # under nohup SIGHUP is ignored
    try:
        result = df.run(df.example("figure-3-air"), progress=stop_soon)
        assert signal.getsignal(number) is signal.SIG_DFL
    finally:
        signal.signal(number, before)
    found = count_status(result)
    assert result.attrs["interrupted"] and found[df.Status.NOT_COMPUTED]


def test_a_run_keeps_what_was_computed_at_ctrl_break(every_look, monkeypatch):
    """Windows has this signal: Ctrl-Break, and the only one that another process can send."""
    monkeypatch.setattr(signal, "SIGBREAK", signal.SIGUSR1, raising=False)
    result = df.run(df.example("figure-3-air"), progress=lambda done, *_: terminate(signal.SIGUSR1) if done else None)
    assert result.attrs["interrupted"] and count_status(result)[df.Status.NOT_COMPUTED]
    assert signal.getsignal(signal.SIGUSR1) is signal.SIG_DFL


def test_a_run_under_nohup_goes_on_without_its_terminal(every_look):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        result = df.run(df.example("figure-3-air"), progress=lambda *_: terminate(signal.SIGHUP))
    finally:
        signal.signal(signal.SIGHUP, before)
    assert "interrupted" not in result.attrs


def test_a_run_is_stopped_in_the_midst_of_a_stretch_that_is_followed(monkeypatch, every_look):
    """64 points are followed from one on which a run can go on: a force with memory takes minutes for them."""
    monkeypatch.setattr(transient, "CHUNK_SECONDS", 0.0)
    forces = [df.forces.PowerLaw(modulus_at_reference="50 MPa", shortest_time="1 us", elements=4)]
    lever = df.Cantilever(f0="30 kHz", k="0.5 N/m", Q=2)
    case = df.Case(cantilever=lever, drive={"A0": "10 nm"}, tip={"radius": "10 nm"}, forces=forces,
                   sample={"poisson_ratio": 0.3})  # fmt: skip
    case = case.replace("experiment", {"kind": "approach", "zc": {"start": "11 nm", "stop": "5 nm", "points": 40}})
    places = []

    def stop_at_ten(done, total, note):
        places.append(done)
        if done == 10:
            terminate()

    stopped = df.run(case, progress=stop_at_ten)
    assert stopped.attrs["interrupted"] and set(range(1, 11)) <= set(places)
    whole = df.run(case)
    assert (stopped.amplitude == whole.amplitude)[:10].all() and stopped.amplitude[11:].isnull().all()
    assert count_status(stopped)[df.Status.OK] == 10


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


@swallowing
def test_a_stop_that_somebody_swallows_is_raised_at_the_next_look(every_look):

    def stop_soon(done, total, note):
        if done and not swallowed:
            swallowed.append(done)
            terminate_unheard()

    swallowed = []
    result = df.run(df.example("figure-3-air"), progress=stop_soon)
    assert swallowed
    assert result.attrs["interrupted"] and count_status(result)[df.Status.NOT_COMPUTED]


class Ending:
    """An object at whose end a signal arrives, and behind a stop an error."""

    def __del__(self):
        terminate()


class HalfMade:
    """An object that was broken off in its making."""

    def __del__(self):
        raise AttributeError("half made")


def test_a_stop_at_the_end_of_an_object_is_raised_soon_and_nothing_else_is_told(capfd):
    with sigterm_as_ctrl_c():
        with pytest.raises(KeyboardInterrupt):
            Ending()
            time.sleep(5.0)
        HalfMade()
        heard()
        HalfMade()
    assert capfd.readouterr().err == ""


@swallowing
def test_a_stop_behind_one_that_was_swallowed_is_raised_anew(monkeypatch):
    monkeypatch.setattr(stopping, "SAME", 0.0)
    with sigterm_as_ctrl_c():
        terminate_unheard()
        with pytest.raises(KeyboardInterrupt):
            terminate()
        heard()
        terminate()  # one that was heard is followed by what keeps the results


def test_a_run_forgets_the_stop_that_ended_the_one_before():
    with pytest.raises(KeyboardInterrupt), late_stop_waits():
        terminate()
    with late_stop_waits():
        look()
        at_end(True)


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Return a function that writes a module which can be imported."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(name, *lines):
        monkeypatch.delitem(sys.modules, name, raising=False)
        (tmp_path / f"{name}.py").write_text("\n".join(["import os, signal", *lines]), encoding="utf-8")

    return write


def test_an_import_is_not_broken_off_and_the_stop_comes_right_behind(module):
    module("stopped_here", "os.kill(os.getpid(), signal.SIGTERM)", "whole = True")
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt), sigterm_as_ctrl_c():
        found = importlib.import_module("stopped_here")
        while time.monotonic() < begun + 60.0:
            time.sleep(0.01)
    assert found.whole
    assert time.monotonic() - begun < 30.0


def test_a_stop_that_waited_for_an_import_is_heard_where_the_program_waits_for_a_lock_then(module):
    module("stopped_before_a_lock", "os.kill(os.getpid(), signal.SIGTERM)")
    lock, begun = threading.Lock(), time.monotonic()
    lock.acquire()
    late = threading.Timer(60.0, lock.release)
    late.start()
    with pytest.raises(KeyboardInterrupt), sigterm_as_ctrl_c():
        importlib.import_module("stopped_before_a_lock")
        lock.acquire()
    late.cancel()
    assert time.monotonic() - begun < 30.0


def test_a_program_that_is_itself_imported_is_stopped_at_once(module):
    module(
        "a_program", "from dforce.core.stopping import sigterm_as_ctrl_c", "with sigterm_as_ctrl_c():",
        "    os.kill(os.getpid(), signal.SIGTERM)", "    raise AssertionError('this went on')",
    )  # fmt: skip
    with pytest.raises(KeyboardInterrupt):
        importlib.import_module("a_program")


def test_a_compilation_is_not_broken_off_and_the_stop_comes_right_behind():
    done = []
    with sigterm_as_ctrl_c():
        with pytest.raises(KeyboardInterrupt), unbroken():
            terminate()
            done.append(1)
        heard()
        look()
    assert done


def test_a_stop_that_ends_the_program_breaks_off_a_compilation():
    done = []
    with pytest.raises(KeyboardInterrupt), sigterm_as_ctrl_c(ends_program=True), unbroken():
        terminate()
        done.append(1)
    assert not done
    with pytest.raises(KeyboardInterrupt), sigterm_as_ctrl_c():  # the next program's stop waits again
        with unbroken():
            terminate()
            done.append(1)
        look()
    assert done


def test_a_stop_that_ends_the_program_does_not_break_off_a_call_of_llvm():
    """LLVM calls back with each code that it has made: half done it has none, and crashes."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    machine = binding.Target.from_default_triple().create_target_machine(jit=True)
    engine = binding.create_mcjit_compiler(binding.parse_assembly("define i32 @one() { ret i32 1 }"), machine)
    made = []

    def keep(module, code):
        terminate()
        made.append(code)

    engine.set_object_cache(keep, lambda module: None)
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt), sigterm_as_ctrl_c(ends_program=True):
        engine.finalize_object()
        time.sleep(30.0)
    assert made
    assert time.monotonic() - begun < 10.0


def test_a_job_that_compiles_ends_where_it_looks_once_the_work_is_stopped():
    reached, ended = threading.Event(), []

    def job():
        reached.set()
        try:
            while True:
                look()
                time.sleep(0.01)
        finally:
            ended.append(1)

    def stop(*_):
        if reached.is_set():
            raise KeyboardInterrupt

    assert not Crew(1, lambda *_: stop() if not ended else None, 1).run([job])
    assert ended


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_program_that_goes_on_is_told_that_its_result_was_stopped(number, capsys):
    df.run(df.example("figure-3-air"), progress=lambda *_: os.kill(os.getpid(), number))
    told = capsys.readouterr().err
    assert "Stopped by " + ("SIGTERM" if number == signal.SIGTERM else "Ctrl-C") in told
    assert "attrs['interrupted'] = 1" in told
    df.run(df.example("figure-3-air"))
    assert "Stopped" not in capsys.readouterr().err


def test_whoever_catches_a_stop_says_that_it_was_heard_or_ends_the_program():
    catches = [
        (f"{file.name}:{node.lineno}", ast.unparse(node))
        for file in Path(df.__file__).parent.rglob("*.py")
        if "gui" not in file.relative_to(Path(df.__file__).parent).parts  # whose threads hear no signals
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.ExceptHandler)
        and node.type is not None
        and "KeyboardInterrupt" in ast.unparse(node.type)
    ]
    assert catches
    assert [place for place, text in catches if "heard()" not in text and "sys.exit(STOPPED)" not in text] == []


@pytest.fixture
def slow_estimates(monkeypatch):
    """Let the estimate of errors take without end, with looks, and return what happens meanwhile, in order."""
    seen = []

    def without_end(block, values, points):
        seen.append(points.cycles.shape[1])
        while True:
            terminate()
            block.check_cancelled()
            time.sleep(0.01)

    monkeypatch.setattr("dforce.solvers.accuracy.assure", without_end)
    monkeypatch.setattr("dforce.procedures.curve.assure", without_end)
    monkeypatch.setattr("dforce.solvers.accuracy.GRACE", 0.2)
    return seen


def test_a_stop_after_the_last_point_waits_for_no_estimates_and_all_points_are_kept(slow_estimates, tmp_path):
    case = df.example("figure-3-air").replace("experiment.direction", "approach")
    begun = time.monotonic()
    part = df.run(case, progress=lambda *_: None)
    assert time.monotonic() - begun < 60.0
    assert slow_estimates[0] == part.sizes["zc"], "all points were there"
    assert part.attrs["interrupted"] and count_status(part) == {df.Status.INACCURATE: part.sizes["zc"]}
    assert part.amplitude.notnull().all() and part.error_estimate.isnull().all()


def test_a_run_goes_on_with_points_whose_errors_are_not_known(slow_estimates, monkeypatch):
    case = df.example("figure-3-air").replace("experiment.direction", "approach")
    part = df.run(case, progress=lambda *_: None)
    monkeypatch.undo()
    rest, whole = df.run(case, resume=part), df.run(case)
    assert rest.equals(whole)
    assert count_status(rest) == {df.Status.OK: whole.sizes["zc"]}
