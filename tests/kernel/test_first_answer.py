"""Answers that come before the code of their combination of forces is compiled: the same numbers, and nothing broken."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from tiers import some_long
from typer.testing import CliRunner

import dforce as df
from dforce import kernel
from dforce.cli.app import app
from dforce.core import first_answer
from dforce.core.first_answer import early_answers, may_be_early
from dforce.core.parallel import Crew
from dforce.gui.document.compute import Job, live_curve
from dforce.kernel import behind, cache
from dforce.kernel.tip import TipFunctions
from dforce.solvers import beside
from dforce.solvers.integrator import CALLED, load_kernels

LANES = ("advance_lanes", "measure_force")
TOLERANCE = 1e-9  # of each quantity's scale
MODES = [{"f0": "50 kHz", "k": "0.9 N/m", "Q": 50}, {"f0": "315 kHz", "k": "35 N/m", "Q": 150}]
VISCOUS = [{"model": "dmt", "hamaker": "2e-20 J"}, {"model": "kelvin_voigt", "viscosity": "50 Pa s"}]
LAYER = [{"model": "hertz"}, {"model": "morse", "energy": "5e-19 J", "equilibrium": "0.3 nm", "decay": "0.1 nm"}]
RELAXING = [{"model": "sls", "elements": 4}, {"model": "van_der_waals", "hamaker": "2e-20 J"}]
POINT = {"kind": "approach", "zc": ["7 nm"]}
APPROACH = {"kind": "approach", "zc": ["9 nm", "7 nm", "5 nm"]}


def case(forces=VISCOUS, modes=1, experiment=APPROACH, **rest):
    """Return a case of one tone a mode."""
    tones = [{"A0": A0, "mode": n + 1} for n, A0 in enumerate(("8 nm", "0.5 nm")[:modes])]
    frequencies = [{"frequency": f"{mode['f0'].split()[0]} kHz"} for mode in MODES[:modes]]
    return df.Case.model_validate(
        {
            "cantilever": {"modes": MODES[:modes]},
            "drive": {"tones": [tone | frequency for tone, frequency in zip(tones, frequencies, strict=True)]},
            "tip": {"radius": "5 nm"}, "sample": {"youngs_modulus": "1 GPa", "poisson_ratio": 0.3},
            "forces": forces, "experiment": experiment, **rest,
        }
    )  # fmt: skip


@pytest.fixture(autouse=True)
def allowed(monkeypatch):
    """Let answers come early, in the folder of kernels that all tests share, and compile no solvers beside."""
    monkeypatch.setattr(beside, "cores", lambda: 1)
    monkeypatch.setenv(first_answer.VARIABLE, "early")


@pytest.fixture
def begun(monkeypatch):
    """What would be compiled in the background: nothing is, so that every answer is early once that of any force is there."""
    asked = []

    def begin(file, functions, words=""):
        asked.append((file, functions, words))
        return True

    monkeypatch.setattr(behind, "begin", begin)
    return asked


@pytest.fixture
def nothing_compiled(begun, monkeypatch):
    """As if of all tip equations that of any force alone were compiled."""
    monkeypatch.setattr(kernel.Kernel, "is_ready", lambda self, name: "any force" in self.what)
    return begun


def early(run):
    """Return what an early answer gives, beside what all others do."""
    with early_answers():
        return run()


ROUNDINGS = {
    "drift",
    "corrections",
    "power",
}  # how far from repeating, how often corrected; the last is an energy's, too
# by differences over 2e-7 of the free amplitude; a fold is where they grow without bound
DERIVATIVES = {"multiplier_modulus", "multiplier_angle", "jump_zc", "jump_before", "jump_after"}


def assert_same(early, full):
    """Compare two results, each quantity to its scale."""
    energy = max(float(np.abs(full[name]).max()) for name in full if str(name).endswith(("energy", "virial")))
    for name in set(full.data_vars) - ROUNDINGS:
        if full[name].dtype.kind not in "fc":
            np.testing.assert_array_equal(early[name], full[name], err_msg=str(name))
            continue
        scale = energy if str(name).endswith(("energy", "virial")) else np.abs(full[name]).max()
        if name == "harmonic_phase":
            scale = np.degrees(1.0) * full.harmonic_amplitude.max() / full.harmonic_amplitude
        if (
            name == "multiplier_angle"
        ):  # differences err by 1.1e-8 of the map's largest derivative, hundreds for two modes
            scale = np.degrees(10.0) / full.multiplier_modulus
        if name == "error_estimate":  # a share of the scales
            scale = 1.0
        tolerance = 1e-6 if name in DERIVATIVES else TOLERANCE
        np.testing.assert_array_equal(np.isnan(early[name]), np.isnan(full[name]), err_msg=str(name))
        assert not bool((np.abs(early[name] - full[name]) > tolerance * scale).any()), name


SEVERAL = {
    "one mode, along the distance": case([{"model": "dmt", "hamaker": "2e-20 J"}]),
    "a root": case(),
    "two modes and tones": case(modes=2),
    "the time": case(
        [{"model": "hertz"}, {"model": "electrostatic", "bias": "0.5 V", "ac_bias": "0.2 V", "ac_frequency": "50 kHz"}]
    ),
    "along the frequency": case(
        experiment={"kind": "frequency_sweep", "zc": "6 nm", "frequency": ["49 kHz", "50 kHz"]}
    ),
    "branches": case([{"model": "jkr", "surface_energy": 0.02}], experiment=POINT),
    "memory": case(RELAXING, experiment=POINT),
    "no orbit": case(experiment={"kind": "dwell", "zc": "6 nm"}, solver={"method": "transient"}),
}


@pytest.mark.slow  # each kernel of any force is compiled once
@pytest.mark.parametrize("name", some_long(SEVERAL, ["a root", "two modes and tones", "memory"]))
def test_forces_called_by_their_address_give_the_same_numbers(name, nothing_compiled):
    asked = SEVERAL[name]
    full = df.run(asked)
    assert not nothing_compiled
    assert_same(early(lambda: df.run(asked)), full)
    assert nothing_compiled, "no function of any force was called"


def new():
    """Return a case whose combination of forces was never used before."""
    return case([{"model": "hertz"}, {"model": "custom", "law": f"-{time.time_ns()}e-30 * exp(-max(d, a0)/1e-9)"}])


@pytest.mark.slow  # a kernel of any force is compiled once
def test_a_new_combination_is_answered_without_its_own_code(begun):
    asked = new()
    own, _ = load_kernels(asked.problem)
    TipFunctions(own, asked.problem, CALLED).prepare(LANES)
    result = early(lambda: df.run(asked))
    assert np.isfinite(result.amplitude).all()
    assert not [name for name in CALLED if getattr(own.module, name).signatures]
    assert {file for file, _, _ in begun} == {own.file}
    assert {name for _, functions, _ in begun for name in functions} == set(LANES)


def test_what_calls_any_force_is_left_to_the_background_where_it_is_not_compiled(begun, monkeypatch):
    asked, made = case(), []
    full = df.run(asked)
    monkeypatch.setattr(kernel.Kernel, "is_ready", lambda self, name: bool(made.append(name)))
    assert_identical(early(lambda: df.run(asked)), full)
    assert made and {file for file, _, _ in begun} == {kernel.load_any(asked.problem, CALLED).file}
    assert {name for _, functions, _ in begun for name in functions} == set(LANES)


def test_the_own_code_answers_where_nothing_can_be_done_in_the_background(nothing_compiled, monkeypatch):
    asked = case()
    full = df.run(asked)
    monkeypatch.setattr(behind, "begin", lambda *given: False)
    assert_identical(early(lambda: df.run(asked)), full)


@pytest.mark.slow  # a kernel of any force is compiled once
def test_a_run_goes_over_to_its_own_code_once_that_is_there(nothing_compiled, monkeypatch):
    asked = case()
    own, _ = load_kernels(asked.problem)
    tip = TipFunctions(own, asked.problem, CALLED)
    tip.prepare(LANES)
    p, names = kernel.parameters(asked.problem, 6e-9), ("advance_lanes",)
    first = early(lambda: tip.at(p, names))
    monkeypatch.setattr(kernel.Kernel, "is_ready", lambda self, name: True)
    second = early(lambda: tip.at(p, names))
    address = own.address("advance_lanes", tip._types["advance_lanes"])
    assert address not in first[6:] and address in second[6:]


def assert_identical(one, other):
    """Compare two results bit for bit."""
    for name in other.data_vars:
        np.testing.assert_array_equal(one[name], other[name], err_msg=str(name))


# --- solvers that Python runs -----------------------------------------------------------------------------------------


class Going:
    """A process that compiles and is not done."""

    code = None

    def poll(self):
        return self.code


@pytest.fixture
def no_solvers(monkeypatch):
    """As if of all solvers a process compiled all but the one that does the work."""
    process, real = Going(), kernel.Kernel.is_ready
    monkeypatch.setattr(beside, "cores", lambda: 2)
    monkeypatch.setattr(beside, "_BEHIND", {})
    monkeypatch.setattr(beside, "_BESIDE", set())
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: None)
    monkeypatch.setattr(behind, "start", lambda *what: process)
    monkeypatch.setattr(
        kernel.Kernel, "is_ready", lambda self, name: "the solvers" not in self.what and real(self, name)
    )
    return process


RUN_BY_PYTHON = {
    **{name: asked for name, asked in SEVERAL.items() if name != "no orbit"},
    "jumps": df.example("hysteresis").replace("experiment.zc", np.linspace(25e-9, 15e-9, 21)),
}


@pytest.mark.parametrize("name", some_long(RUN_BY_PYTHON, ["memory", "two modes and tones"]))
def test_solvers_run_by_python_give_the_same_numbers(name, no_solvers, monkeypatch):
    asked, used = RUN_BY_PYTHON[name], []
    full = df.run(asked)
    real = kernel.Kernel.interpreted
    monkeypatch.setattr(
        kernel.Kernel, "interpreted", lambda self, name, work: used.append(name) or real(self, name, work)
    )
    assert_same(early(lambda: df.run(asked)), full)
    assert used


def test_many_orbits_at_once_wait_for_the_compiled_solvers(no_solvers, monkeypatch):
    used, real = [], kernel.Kernel.entry
    monkeypatch.setattr(kernel.Kernel, "entry", lambda self, name: used.append(name) or real(self, name))
    asked = case(experiment={"kind": "approach", "zc": np.linspace(20e-9, 5e-9, 60)})
    early(lambda: df.run(asked))
    assert "follow" not in used
    monkeypatch.setattr(beside, "FEW", {"follow": 50})
    early(lambda: df.run(asked))
    assert "follow" in used


def test_where_the_process_has_ended_early_the_compiled_solvers_answer(no_solvers, monkeypatch):
    monkeypatch.setattr(kernel.Kernel, "interpreted", lambda *given: pytest.fail("Python runs the solvers for ever"))
    no_solvers.code = -9
    assert_identical(early(lambda: df.run(case())), df.run(case()))


# --- who is answered early -------------------------------------------------------------------------------------------


def test_answers_are_early_where_a_person_waits_and_nowhere_else(monkeypatch, tmp_path):
    found = []

    def run(*given, **more):
        found.append(may_be_early())
        raise df.ParameterError("seen enough")

    path = tmp_path / "case.toml"
    path.write_text(case().to_toml(), encoding="utf-8")
    monkeypatch.setattr(df, "run", run)
    assert "seen enough" in CliRunner().invoke(app, ["run", str(path)]).stderr
    for asked in (lambda: Job(case()).compute(), lambda: live_curve(case(), bool, print), lambda: df.run(case())):
        with pytest.raises(df.ParameterError, match="seen enough"):
            asked()
    assert found == [True, True, True, False]


def test_threads_of_a_run_are_answered_as_it_is():
    found = []
    with early_answers():
        Crew(1, lambda *told: None).run([lambda: found.append(may_be_early())])
    Crew(1, lambda *told: None).run([lambda: found.append(may_be_early())])
    assert found == [True, False]


def test_the_environment_turns_it_off_and_a_wrong_word_is_told(monkeypatch):
    monkeypatch.setenv(first_answer.VARIABLE, "full")
    with early_answers():
        assert not may_be_early()
    monkeypatch.setenv(first_answer.VARIABLE, "soon")
    with pytest.raises(df.ParameterError, match="'soon'; it may be early or full"), early_answers():
        pass


# --- the background --------------------------------------------------------------------------------------------------

NUMBERS = itertools.count(1)
TEXT = """
from numba import njit

@njit(no_cpython_wrapper=True)
def inner(x):
    return x + {number}.0
"""
INNER = {"inner": "f8(f8)"}


@pytest.fixture
def file(tmp_path, monkeypatch):
    """The text of a small kernel, in a folder of its own."""
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(tmp_path / "cache"))
    return cache.place(TEXT.format(number=next(NUMBERS)))


def compiled(file):
    return list(file.parent.glob("inner-*.code"))


@pytest.mark.slow  # a process
def test_a_process_of_its_own_compiles_and_keeps_what_is_asked_for_once(file, monkeypatch):
    monkeypatch.chdir(file.parent.parent.parent)
    monkeypatch.setenv("DFORCE_CACHE_DIR", "cache")  # the process begins elsewhere
    begun, start = [], behind.start
    monkeypatch.setattr(behind, "start", lambda *what: begun.append(start(*what)))
    assert behind.begin(file, INNER) and behind.begin(file, INNER)
    [process] = begun
    if sys.platform != "win32":
        assert os.getsid(process.pid) != os.getsid(0), "Ctrl-C would end it"
    assert process.wait(300) == 0
    assert len(compiled(file)) == 1


def test_a_process_that_ends_leaves_the_list_of_the_system(tmp_path):
    process, end = behind.start("", [], tmp_path), time.monotonic() + 60.0
    while process.returncode is None and time.monotonic() < end:
        time.sleep(0.01)
    assert process.returncode == 0


def test_a_process_is_started_where_no_thread_is_left_to_wait_for_it(tmp_path, monkeypatch):
    def none_left(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", none_left)
    assert behind.start("", [], tmp_path).wait(60) == 0


def test_a_process_takes_no_file_of_its_folder_for_a_library(tmp_path):
    (tmp_path / "numba.py").write_text("raise SystemExit(1)")
    assert behind.start("import numba", [], tmp_path).wait(60) == 0


def test_python_warns_of_no_process_that_goes_on(tmp_path):
    code = f"from dforce.kernel import behind; behind.start('import time; time.sleep(3)', [], {str(tmp_path)!r})"
    told = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True)
    assert told.stderr == ""


@pytest.mark.parametrize(
    ("frozen", "executable"), [(True, sys.executable), (False, "/opt/microscope/bin/program"), (False, "")]
)
def test_a_program_that_is_not_python_itself_is_not_started_anew(file, monkeypatch, frozen, executable):
    monkeypatch.setattr(sys, "frozen", frozen, raising=False)
    monkeypatch.setattr(sys, "executable", executable)
    monkeypatch.setattr(subprocess, "Popen", lambda *command, **how: pytest.fail(f"{command} was started"))
    assert not behind.begin(file, INNER)


def test_what_cannot_be_begun_is_said_so_and_begun_anew(file, monkeypatch):
    assert not behind.begin(file.with_name("missing.py"), INNER)
    started = []

    def start(command, **how):
        started.append(command)
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(subprocess, "Popen", start)
    assert not behind.begin(file, INNER) and not behind.begin(file, INNER)
    assert len(started) == 2


def test_a_text_of_other_versions_is_left_alone(file):
    other = file.with_name("kernel_of_another_version.py")
    other.write_bytes(file.read_bytes())
    behind.compile_all(other, INNER)
    assert not compiled(file)
    behind.compile_all(file, INNER)
    assert compiled(file)
