"""The compiled tip equation: equal to the plain one, compiled once, kept on disk, and never for a parameter's sake."""

import contextlib
import math
import os
import subprocess
import sys
import threading
import time
import types
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numba.core.errors import TypingError

import dforce as df
from dforce import kernel
from dforce.core.log import listening
from dforce.forces import Force
from dforce.integrators import rk4
from dforce.integrators.fitted import fit
from dforce.integrators.lanes import LANES, advance_lanes
from dforce.kernel import cache
from dforce.kernel.codegen import OTHERS, compose
from dforce.observables.measure import FIRST
from dforce.problem import Instrument, Problem
from dforce.solvers.block import Block
from dforce.solvers.integrator import INTEGRATORS, with_amplitudes
from dforce.solvers.period_map import MOTION, NOTHING
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.states import States

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

PROBE = """
import os
import sys
import dforce as df
from dforce import kernel
from dforce.kernel.vocabulary import distance, force, rate_of
from dforce.problem import Instrument, Problem

def probe(y, p):
    return force(distance(y, p), rate_of(y, p), 0.0, y, y, p)

def twice(y, p):
    return 2.0 * force(distance(y, p), rate_of(y, p), 0.0, y, y, p)

if __name__ == "__main__":
    if "LIMIT" in os.environ:
        import resource
        resource.setrlimit(resource.RLIMIT_FSIZE, 2 * (int(os.environ["LIMIT"]),))
    lever, drive = df.Cantilever(f0=5e4, k=0.9, Q=10), df.Drive(A0=1e-8)
    instrument = Instrument(lever, drive, df.Tip(radius=2e-9), df.Sample(youngs_modulus=1e9))
    problem = Problem.build(instrument, forces=[df.forces.Hertz()])
    called = sys.argv[1]
    loaded = kernel.load(problem, {"probe": probe, "twice": twice})
    value = loaded.entry(called)((-0.5, 0.0), kernel.parameters(problem, 4.5e-9))
    stats = getattr(loaded.module, called).stats
    print(value, sum(stats.cache_hits.values()), sum(stats.cache_misses.values()), loaded.module.__file__)
"""


def problem(forces=(), modes=1, Q=10.0, zc_modulus=1e9, hamaker=2e-20, viscosity=50.0):
    forces = forces or [df.forces.DMT(hamaker=hamaker), df.forces.KelvinVoigt(viscosity=viscosity)]
    return Problem.build(
        Instrument(
            df.Cantilever(modes=[{"f0": 5e4 * 6.3**n, "k": 0.9 * 39**n, "Q": Q} for n in range(modes)]),
            df.Drive(A0="10 nm"),
            df.Tip(radius="2 nm"),
            df.Sample(youngs_modulus=zc_modulus),
        ),
        forces=forces,
    )


MARCHES = {"march_rk4": rk4.march}


def plain(problem, entries=MARCHES):
    """Return the composed module run as plain Python: numba's place is taken by a decorator that does nothing."""
    stand_in = types.ModuleType("numba")
    stand_in.njit = lambda **options: lambda function: function
    real, module = sys.modules["numba"], {}
    sys.modules["numba"] = stand_in
    try:
        exec(compose(len(problem.modes), problem.forces, entries, drive=(len(problem.tones), True)), module)
    finally:
        sys.modules["numba"] = real
    return types.SimpleNamespace(**module)


@contextlib.contextmanager
def interpreted_by(ready, functions):
    """Let an integrator call these functions, all of one module, in the place of the compiled ones."""
    with pytest.MonkeyPatch.context() as patch:
        for compiled in (ready.kernel, ready.solvers):
            patch.setattr(compiled, "entry", lambda name: getattr(functions, name))
        patch.setattr(ready, "tip", lambda *names: ready.p)
        yield


def test_compiled_equals_plain_python():
    asked = problem()
    ready = INTEGRATORS["rk4"](asked, df.SolverSettings(method="transient", points_per_period=64), 3)
    ready.place(6e-9)
    start = with_amplitudes(ready, ready.problem.free)
    compiled, rows = ready.observe(start, 1)
    interpreted_module = plain(asked)
    with interpreted_by(ready, interpreted_module):
        interpreted, plain_rows = ready.observe(start, 1)
    # the compiler may fuse and reorder products: some last digits, and many steps
    assert compiled.y == pytest.approx(interpreted.y, rel=1e-11)
    size = np.abs(plain_rows).max() * 1e-13
    assert rows == pytest.approx(plain_rows, rel=1e-9, abs=size)


def test_lanes_feel_the_speed_of_each_tip_as_it_does_alone():
    problems = [problem(viscosity=30.0), problem(viscosity=300.0, zc_modulus=2e8)]
    functions = plain(problems[0], {"advance_lanes": advance_lanes, "march_rk4": rk4.march})
    batch, points, zc = ProblemBatch.of(problems * (LANES // 2)), 64, 6e-9
    angles = math.pi / points * np.arange(2 * points + 1)
    block, numbers, tones = np.empty((points + 1, 3, LANES)), batch.numbers.T.copy(), batch.tones.copy()
    for j in range(LANES):
        fit(numbers[:, j], tones[j], 1, 2.0 * math.pi / points)
    block[0, :2], numbers[0] = batch.free().T, zc
    end = functions.advance_lanes(
        block, (numbers, tones[:, 0, 2:-3].T.copy(), batch.kinks.T.copy(), tones),
        (np.zeros(1), 0, points, np.array([np.cos(angles), -np.sin(angles)])), np.zeros(LANES, dtype=np.int64),
        np.zeros((8, 1)), (*numbers[:OTHERS, 0], numbers[OTHERS:, 0]),
    )  # fmt: skip
    ends = []
    for one in problems:
        ready = INTEGRATORS["rk4"](one, df.SolverSettings(method="transient", points_per_period=points), 3)
        ready.place(zc)
        with interpreted_by(ready, functions):
            ends.append(ready.lock_in(with_amplitudes(ready, ready.problem.free), 1)[0].y)
    # the tables of the drive differ by roundings
    np.testing.assert_allclose(block[end, :2].T, ends * (LANES // 2), atol=1e-12)
    assert abs(ends[0][1] - ends[1][1]) > 1e-3  # they are told apart


def holds_an_array(value):
    return isinstance(value, np.ndarray) or (isinstance(value, tuple) and any(map(holds_an_array, value)))


def test_functions_that_count_no_references_return_no_array(monkeypatch):
    # the caller would give back a reference that was never taken, and numbers in use would be freed
    seen = set()

    def watched(function):
        def told(*arguments):
            found = function(*arguments)
            assert not holds_an_array(found), function.__name__
            seen.add(function.__name__)
            return found

        return told

    stand_in = types.ModuleType("numba")
    stand_in.njit = lambda **options: (lambda function: function) if options.get("_nrt", True) else watched
    monkeypatch.setitem(sys.modules, "numba", stand_in)
    asked = problem([df.forces.VanDerWaals(hamaker=2e-20), df.forces.Hertz(), df.forces.KelvinVoigt()])
    entries = MARCHES | {"advance_lanes": advance_lanes}
    module: dict = {}
    exec(compose(1, asked.forces, entries, drive=(1, True)), module)
    monkeypatch.undo()
    ready = INTEGRATORS["rk4"](asked, df.SolverSettings(method="transient", points_per_period=64), 3)
    ready.place(6e-9)
    with interpreted_by(ready, types.SimpleNamespace(**module)):
        ready.observe(with_amplitudes(ready, ready.problem.free), 2)
    assert {"rk4_cut_at_kink", "steps_divided", "steps_part_step", "events_passed"} <= seen


def test_only_what_somebody_reads_is_measured():
    block = Block.of_one(problem([df.forces.DMT(hamaker=2e-20)]), df.SolverSettings(), 3)
    start = States(block.batch.free().repeat(2, axis=0), np.empty((2, 0)), np.empty((2, 0)))
    slots = block.slots(start, np.full(2, 9e-9))
    slots.case[:], slots.rows[:] = 0, np.nan
    slots.wanted[0] = NOTHING
    block.march(slots, 1, True)
    assert np.isfinite(slots.ends[:, 0]).all()
    assert np.isnan(slots.rows[0]).all()
    assert np.isfinite(slots.rows[1]).all()
    slots.wanted[0] = MOTION
    block.march(slots, 1, True)
    motion, everything = slots.rows[:, 0]
    lock_in = slice(FIRST, FIRST + 4)  # of the mode, and of the whole deflection
    np.testing.assert_array_equal(motion[lock_in], everything[lock_in])
    assert (motion[:FIRST] != 0.0).sum() == 1  # the mean deflection
    assert (everything[:FIRST] != 0.0).sum() > 5


def test_parameters_never_recompile():
    runs = [
        (problem(), "rk4", 64),
        (problem(Q=250.0, hamaker=0.0, viscosity=0.0), "rk4", 320),
        (problem(zc_modulus=1e7, hamaker=1e-19), "rk4", 128),
    ]
    kernels = set()
    for asked, integrator, points in runs:
        chosen = df.SolverSettings(method="transient", integrator=integrator, points_per_period=points)
        ready = INTEGRATORS[integrator](asked, chosen, 1 + points // 64)
        ready.place(points * 1e-10)
        ready.lock_in(with_amplitudes(ready, ready.problem.free), 2)
        kernels |= {ready.kernel, ready.solvers}
    assert len(kernels) == 2
    assert len(ready.kernel.module.advance.signatures) == 1
    assert len(ready.solvers.module.march_rk4.signatures) == 1


def test_the_solvers_are_the_same_for_all_forces_and_compiled_once():
    few = INTEGRATORS["rk4"](problem([df.forces.Hertz()]), df.SolverSettings(), 3)
    many = INTEGRATORS["rk4"](
        problem([df.forces.SLS(elements=4), df.forces.Capillary(formation="1 nm")]), few.settings, 3
    )
    assert few.kernel is not many.kernel
    assert few.solvers is many.solvers
    motions = [ready.lock_in(with_amplitudes(ready, ready.problem.free), 1)[0] for ready in (few, many)]
    assert len(few.solvers.module.march_rk4.signatures) == 1
    assert motions[0].y != motions[1].y


def test_a_memory_that_has_faded_is_nothing_and_no_number_that_takes_the_processor_long():
    forces = [df.forces.SLS(elements=4, relaxation_time="1 us"), df.forces.Capillary(formation="1 nm")]
    ready = INTEGRATORS["rk4"](problem(forces), df.SolverSettings(), 3)
    ready.place(1e-6)  # the tip touches nothing
    start = replace(with_amplitudes(ready, ready.problem.free), memory=np.full(ready.memory_size, 1e-9))
    soon, _ = ready.lock_in(start, 2)
    late, _ = ready.lock_in(start, 2000)
    assert (soon.memory > 1e-30).all()
    assert (late.memory == 0.0).all()


def test_a_force_with_another_number_of_states_or_coefficients_is_another_kernel():
    few, many = df.forces.SLS(elements=6), df.forces.SLS(elements=12)
    bound = [problem([force]).forces[0] for force in (few, many, df.forces.SLS(elements=6, instant_modulus=2e9))]
    assert kernel.signature(bound[0]) != kernel.signature(bound[1])
    assert kernel.signature(bound[0]) == kernel.signature(bound[2])


def test_tuples_of_numbers_reach_the_law_as_they_are():
    """SLS takes tuples between plain numbers; it and the force before it must both get their own."""
    asked = problem([df.forces.SLS(elements=4), df.forces.Capillary(formation="1 nm")])
    neck, sample = asked.forces
    module = plain(asked)
    p = kernel.parameters(asked, 6e-9)
    memory, latched = np.linspace(0.0, 1e-10, sample.memory), np.ones(1)
    for d in (-1e-9, 0.5e-9):
        expected = neck.law(d, 0.0, 0.0, 1.0, *neck.values()) + sample.law(d, 0.0, 0.0, memory, *sample.values())
        assert module.force(d, 0.0, 0.0, memory, latched, p) == expected


def test_solvers_refuse_arrays_that_the_tip_equation_was_not_compiled_for():
    """What is called by its address would read them as what they are not."""
    ready = INTEGRATORS["rk4"](problem([df.forces.Hertz()]), df.SolverSettings(), 3)
    ready.samples = ready.samples.T.copy().T  # other strides
    with pytest.raises(TypingError, match="not with"):
        ready.lock_in(with_amplitudes(ready, ready.problem.free), 1)


class Broken(Force):
    """A law that numba cannot compile is refused before anything is written."""

    @staticmethod
    def law(d, rate, t):
        return PATHS[0]


PATHS = ["text"]


def test_a_law_that_reads_changing_values_is_refused():
    with pytest.raises(df.ForceError, match="a list"):
        compose(1, [Broken()], {})


# --- the store -------------------------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(tmp_path / "not there yet"))
    return tmp_path / "not there yet"


def test_modules_are_named_by_their_text_and_by_what_compiles_it(folder, monkeypatch):
    first, second = cache.place("a = 1\n"), cache.place("a = 2\n")
    assert first != second
    assert first.is_relative_to(folder)
    assert cache.place("a = 1\n") == first
    monkeypatch.setattr(cache.importlib.metadata, "version", lambda name: "another")
    assert cache.place("a = 1\n") != first


def test_a_changed_law_is_a_new_module(tmp_path):
    import importlib.util

    text = "from dforce.forces import Force\n\n"
    text += "class Pull(Force):\n    @staticmethod\n    def law(d, rate, t):\n        return -{}\n"
    names = []
    for number in ("1e-9", "2e-9"):
        path = tmp_path / f"pull_{number}.py"
        path.write_text(text.format(number), encoding="utf-8")
        spec = importlib.util.spec_from_file_location("pull", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        names.append(cache.fingerprint(compose(1, [module.Pull()], {})))
    assert names[0] != names[1]


def test_a_module_cut_short_by_a_crash_is_written_again(folder):
    path = cache.place("c = 1\n")
    path.write_text("c =", encoding="utf-8")
    assert cache.place("c = 1\n") == path
    assert path.read_text(encoding="utf-8") == "c = 1\n"


def test_only_the_oldest_kernels_are_forgotten_and_nothing_else_is_touched(folder, monkeypatch):
    monkeypatch.setattr(cache, "MOST_KERNELS", 3)
    mine = folder / "my photographs"
    mine.mkdir(parents=True)
    (mine / "kernel_of_truth.py").write_text("", encoding="utf-8")
    os.utime(mine, (1, 1))
    paths = [cache.place(f"d = {i}\n") for i in range(3)]
    for age, path in enumerate(paths):
        os.utime(path.parent, (1000.0 + age, 1000.0 + age))
    cache.place("d = 0\n")  # used again: now the newest
    latest = cache.place("d = 3\n")
    assert [path.exists() for path in (*paths, latest)] == [True, False, True, True]
    assert mine.exists()


def slow_to_compile(folder, begun, over):
    """Return a kernel whose only function sets an event when it begins to compile, and takes until another to do it."""

    def function():
        begun.set()
        over.wait()
        return 1.0

    # as numba's, with nothing compiled
    function.signatures, function._cache = [], types.SimpleNamespace(files=list)
    function.compile = lambda types: function()
    module = types.ModuleType("slow")
    module.__file__, module.probe = str(folder / "slow.py"), function
    return kernel.Kernel(module, "a slow one")


def test_who_waits_for_what_another_thread_compiles_is_told_so_and_its_time_counted(tmp_path, capsys):
    begun, over, told = threading.Event(), threading.Event(), []
    loaded = slow_to_compile(tmp_path, begun, over)

    def hear(text):
        told.append((text, time.monotonic()))
        over.set()

    with ThreadPoolExecutor(1) as pool:
        try:
            other = pool.submit(loaded.entry("probe"))
            other.add_done_callback(lambda _: begun.set())  # also if it fails before it compiles
            begun.wait()
            assert other.running(), other.exception()
            assert "Compiling a slow one" in capsys.readouterr().err  # where nobody listens it is printed
            asked = time.monotonic()
            with listening(hear) as heard:
                assert loaded.entry("probe")() == 1.0
            got = time.monotonic()
            assert other.result() == 1.0
        finally:
            over.set()
    [(text, at)] = told
    assert "Compiling a slow one" in text
    assert 0.0 < heard.seconds <= got - asked
    assert asked <= at <= got
    assert capsys.readouterr().err == ""


# --- other processes -------------------------------------------------------------------------------------------------


def start(tmp_path, cache, called="probe", **variables):
    script = tmp_path / "probe.py"
    if not script.exists():  # one that is started beside another finds it whole
        script.write_text(PROBE, encoding="utf-8")
    environment = {**os.environ, "DFORCE_CACHE_DIR": str(cache), "PYTHONPATH": str(Path(df.__file__).parent.parent)}
    environment |= variables
    command = [sys.executable, str(script), called]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finish(process, times=1.0):
    out, err = process.communicate(timeout=500)
    assert process.returncode == 0, err
    value, hits, misses, path = out.split(maxsplit=3)
    depth = 0.165e-9 + 0.5e-9
    assert float(value) / times == pytest.approx(4 / 3 * (1e9 / 0.91) * math.sqrt(2e-9) * depth**1.5, rel=1e-12)
    return int(hits), int(misses), Path(path.strip()), err


def test_a_second_process_starts_without_compiling_and_only_the_first_says_so(tmp_path):
    """Six at once first: they must not trip over each other."""
    cache = tmp_path / "cache"
    with contextlib.ExitStack() as ended:
        processes = [ended.enter_context(start(tmp_path, cache)) for _ in range(6)]
        together = [finish(process) for process in processes]
    assert sorted(counts[:2] for counts in together) == [(0, 1), *[(1, 0)] * 5], "the others wait, and find it compiled"
    [path] = {path for _, _, path, _ in together}
    assert path.is_relative_to(cache)
    assert any("Compiling the tip equation for hertz" in err for *_, err in together)
    hits, misses, found, err = finish(start(tmp_path, cache))
    assert (hits, misses) == (1, 0)
    assert found == path
    assert err == ""


def test_without_a_folder_for_kernels_everything_still_works_and_one_sentence_says_so(tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("", encoding="utf-8")
    hits, misses, path, err = finish(start(tmp_path, taken / "cache"))
    assert (hits, misses) == (0, 1)
    assert err.count("\n") == 2 and "Compiling" in err and "cannot be kept" in err
    assert not path.exists()


@pytest.mark.long
def test_a_cache_of_another_processor_is_left_alone_and_one_says_that_it_compiles(tmp_path):
    cache = tmp_path / "cache"
    finish(start(tmp_path, cache))
    hits, misses, _, err = finish(start(tmp_path, cache, NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES=""))
    assert (hits, misses) == (0, 1) and "Compiling" in err
    assert finish(start(tmp_path, cache))[:2] == (1, 0)


@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
def test_a_cache_that_cannot_be_written_is_used_as_far_as_it_goes(tmp_path):
    """A limit of zero bytes a file is a full disk or a read-only one, for root, too."""
    cache = tmp_path / "cache"
    finish(start(tmp_path, cache))
    before = {path: path.read_bytes() for path in cache.rglob("*.*") if path.is_file() and path.suffix != ".lock"}
    hits, misses, _, err = finish(start(tmp_path, cache, LIMIT="0"))
    assert (hits, misses, err) == (1, 0, "")
    hits, misses, _, err = finish(start(tmp_path, cache, "twice", LIMIT="0"), times=2.0)
    assert (hits, misses) == (0, 1) and "(file too large), so each start compiles it again; set DFORCE_CACHE_DIR" in err
    assert before == {
        path: path.read_bytes() for path in cache.rglob("*.*") if path.is_file() and path.suffix != ".lock"
    }
