"""Compiled code on disk: looked through before it is used, and made again when anything is wrong with it."""

from __future__ import annotations

import ctypes
import itertools
import marshal
import os
import pickle
import subprocess
import sys

import numba
import numpy as np
import platformdirs
import pytest
from numba.core.registry import cpu_target

import dforce as df
from dforce.core import log, units
from dforce.core.errors import ParameterError
from dforce.core.places import not_own, not_own_by
from dforce.kernel import Kernel, cache, whole
from dforce.kernel.cache_files import CODE, keep, kept
from dforce.kernel.texts import remembered

NUMBERS = itertools.count()
TEXT = """
import numpy as np
from numba import njit

@njit(no_cpython_wrapper=True)
def inner(x):
    return x + {number}.0

@njit
def outer(x):
    return 2.0 * inner(x)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def text(folder):
    """A module of its own for each test."""
    return TEXT.format(number=next(NUMBERS) + 1000)


def started(text):
    """Load a module as a new process would."""
    sys.modules.pop(f"kernel_{cache.fingerprint(text)}", None)
    return cache.load(text)


def counts(module):
    stats = module.outer.stats
    return sum(stats.cache_hits.values()), sum(stats.cache_misses.values())


def kind(folder, function):
    """Return how the code of a function lies on disk."""
    [path] = folder.rglob(f"{function}-*{CODE}")
    _, ((_, found, _), *_) = pickle.loads(kept(path))
    return found


DAMAGE = {
    "empty": lambda content: b"",
    "cut short": lambda content: content[: len(content) // 2],
    "cut by a byte": lambda content: content[:-1],
    "one bit flipped": lambda content: content[:-500] + bytes([content[-500] ^ 1]) + content[-499:],
    "blanked": lambda content: bytes(len(content)),
    "something else": lambda content: b"not compiled code",
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_damaged_code_is_compiled_once_more_and_kept_again(folder, text, damage):
    wanted = started(text).outer(1.0)
    files = list(folder.rglob(f"*{CODE}"))
    assert len(files) == 2  # of two functions, which numba compiles in its own way here
    for path in files:
        path.write_bytes(damage(path.read_bytes()))
    again = started(text)
    assert not cache.is_compiled(again, "outer")  # so that it announces itself, and other processes wait
    assert again.outer(1.0) == wanted and counts(again) == (0, 1)
    third = started(text)
    assert cache.is_compiled(third, "outer")
    assert third.outer(1.0) == wanted and counts(third) == (1, 0)


@pytest.mark.parametrize("content", [b"no pickle", pickle.dumps(7), pickle.dumps(("(float64,)", (1, 2)))])
def test_code_that_is_whole_but_cannot_be_used_is_compiled_once_more(folder, text, content):
    wanted = started(text).outer(1.0)
    for path in folder.rglob(f"*{CODE}"):
        keep(path, content)
    assert started(text).outer(1.0) == wanted
    assert counts(third := started(text)) == (0, 0)
    assert third.outer(1.0) == wanted and counts(third) == (1, 0)


def test_a_text_that_is_damaged_is_never_run(folder, text):
    path = next(folder.glob("*/*.py"), None) or cache.place(text)
    wanted = started(text).outer(1.0)
    path.write_text("raise SystemExit", encoding="utf-8")
    assert started(text).outer(1.0) == wanted
    assert path.read_text(encoding="utf-8") == text


def test_an_entry_by_address_lies_on_disk_with_all_that_it_calls(folder, text):
    def address(kernel):
        return kernel.address("inner", "f8(f8)")

    number = float(text.split("x + ")[1].split("\n")[0])
    for _ in range(2):
        module = started(text)
        function = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_double), ctypes.c_void_p, ctypes.c_double)
        found = ctypes.c_double()
        assert function(address(Kernel(module, "a test")))(ctypes.byref(found), None, 1.0) == 0
        assert found.value == 1.0 + number
        assert kind(folder, "inner") == "object"
    assert sum(module.inner.stats.cache_hits.values()) == 1


def test_who_watches_a_compilation_sees_its_share_rise_over_all_that_belongs_together(text):
    two = text + "\n@njit\ndef other(x):\n    return 3.0 * inner(x)\n"
    loaded, shares = Kernel(started(two), "a test", usual=("outer", "other")), []
    with log.listening(lambda text: None), log.watching(lambda work, share: shares.append((work, share))):
        loaded.entry("outer")(1.0)
        one = shares[-1]
        loaded.entry("other")(1.0)
    assert {work for work, _ in shares} == {"Compiling a test, once"}
    assert 0.0 < shares[0][1] < one[1] < 0.9  # `outer` and what it calls, of three functions
    assert shares == sorted(shares) and shares[-1][1] == pytest.approx(1.0)


def test_functions_that_others_call_become_no_machine_code_of_their_own(folder, text):
    module = started(text)
    outer = Kernel(module, "a test").entry("outer")
    assert outer(1.0) == 2.0 * module.inner.py_func(1.0)
    [part] = module.inner.overloads.values()
    assert whole.is_part(part.library)
    assert [path.name.partition("-")[0] for path in folder.rglob(f"*-*{CODE}")] == ["outer"]
    again = started(text)
    assert Kernel(again, "a test").entry("outer")(1.0) == outer(1.0) and counts(again) == (1, 0)


def test_a_kernel_whose_compilation_was_cut_off_is_compiled_when_it_is_wanted_again(text, monkeypatch):
    def interrupt(library):
        monkeypatch.undo()
        raise KeyboardInterrupt

    kernel = Kernel(started(text), "a test")
    with whole.compiled():
        library = cpu_target.target_context.codegen()._library_class
    monkeypatch.setattr(library, "_optimize_final_module", interrupt)
    with pytest.raises(KeyboardInterrupt):
        kernel.address("inner", "f8(f8)")
    assert kernel.address("inner", "f8(f8)") != 0
    assert kernel.entry("outer")(1.0) == 2.0 * kernel.module.inner.py_func(1.0)


def test_code_that_a_kernel_left_as_a_part_serves_a_users_own_function(text):
    module = started(text + "\n@njit\ndef room(n):\n    return np.full(n, 7.0).sum()\n")
    assert Kernel(module, "a test").entry("room")(3) == 21.0

    @numba.njit
    def own(n):
        return np.full(n, 7.0).sum()

    assert own(4) == 28.0


@pytest.mark.slow
def test_code_from_disk_runs_without_the_compilers_tables_which_come_when_it_compiles(folder, text):
    code = """
import sys
from dforce.kernel import Kernel, cache
number = Kernel(cache.load(sys.argv[1]), "a test").entry("outer")(1.0)
print(number, "numba.np.arraymath" in sys.modules)
from numba import njit
import numpy as np
print(njit(lambda x: np.full(3, x).sum())(2.0))
"""
    found = [
        subprocess.run([sys.executable, "-c", code, text], capture_output=True, text=True, check=True).stdout.split()
        for _ in range(2)
    ]
    assert [tables for _, tables, _ in found] == ["True", "False"]
    assert found[0][0] == found[1][0] and {own for _, _, own in found} == {"6.0"}


def test_a_numba_without_what_is_used_compiles_in_its_own_way(text, monkeypatch):
    wanted, name = started(text).outer(1.0), cache.fingerprint(text)
    monkeypatch.setattr(whole, "USED", (*whole.USED, "gone"))
    whole.way.cache_clear()
    try:
        assert whole.way() == "in parts" and cache.fingerprint(text) != name
        module = started(text)
        assert Kernel(module, "a test").entry("outer")(1.0) == wanted
        [part] = module.inner.overloads.values()
        assert not whole.is_part(part.library)
    finally:
        whole.way.cache_clear()


POSIX = pytest.mark.skipif(os.name != "posix", reason="Windows keeps the folders of its users apart")


def give_away(place, monkeypatch):
    """Let a file or a folder belong to another user than the one who runs dForce."""
    if os.geteuid() == 0:
        os.chown(place, 12345, -1)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: 12345)


def opened(place, monkeypatch):
    """Let others write to a file or a folder."""
    place.chmod(place.stat().st_mode | 0o020)


OTHERS = {
    "a folder of another user": (lambda folder: folder, give_away, "belongs to another user"),
    "a folder that a group may write to": (lambda folder: folder, opened, "other users may write to it"),
    "a kernel's folder of another user": (lambda folder: next(folder.glob("*/kernel_*.py")).parent, give_away, "another user"),
    "a kernel's folder for a group": (lambda folder: next(folder.glob("*/kernel_*.py")).parent, opened, "may write to it"),
}  # fmt: skip


@POSIX
@pytest.mark.parametrize("which", OTHERS)
def test_code_that_others_may_have_written_is_not_run_and_that_is_said_once(folder, text, which, monkeypatch):
    assert started(text).outer(1.0) > 0.0
    find, change, words = OTHERS[which]
    heard = []
    cache._say_not_used.cache_clear()
    with log.listening(heard.append):
        change(find(folder), monkeypatch)
        for _ in range(2):
            module = started(text)
            assert module.outer(1.0) > 0.0
    assert not str(module.__file__).startswith(str(folder))
    assert len(heard) == 1
    assert words in heard[0]
    assert str(find(folder)) in heard[0]


@POSIX
@pytest.mark.parametrize("change", [give_away, opened])
def test_a_file_of_code_that_others_may_have_written_is_passed_over(folder, text, change, monkeypatch):
    assert counts_after(text) == (0, 1)
    [path] = folder.rglob(f"outer-*{CODE}")
    change(path, monkeypatch)
    assert kept(path) is None
    assert path.exists()


def counts_after(text):
    module = started(text)
    module.outer(1.0)
    return counts(module)


@POSIX
@pytest.mark.parametrize("umask", [0o002, 0o000])
def test_what_is_kept_is_open_to_its_owner_alone_and_used_again(tmp_path, text, umask, monkeypatch):
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(tmp_path / "deep" / "kernels"))
    before = os.umask(umask)
    try:
        assert counts_after(text) == (0, 1)
        assert counts_after(text) == (1, 0)
    finally:
        os.umask(before)
    assert not_own(tmp_path / "deep" / "kernels") == ""


@POSIX
def test_texts_of_others_are_not_composed_into_code(folder, monkeypatch):
    force = df.forces.Hertz().bind({"tip.radius": 2e-9, "contact.a0": 0.2e-9, "contact.E_eff": 1e9})
    assert remembered(["a test"], [force], lambda: "own text") == "own text"
    [file] = (folder / cache.TEXTS).iterdir()
    keep(file, b"text of others")
    assert remembered(["a test"], [force], lambda: "own text") == "text of others"
    opened(folder / cache.TEXTS, monkeypatch)
    assert remembered(["a test"], [force], lambda: "own text") == "own text"


@POSIX
def test_definitions_of_units_that_others_may_have_written_are_not_loaded(tmp_path, monkeypatch):
    place = tmp_path / "units"
    place.mkdir(mode=0o700)
    asked = []
    monkeypatch.setattr(units, "_cache_folder", lambda where: place)
    monkeypatch.setattr("pint.UnitRegistry", lambda cache_folder=None: asked.append(cache_folder))
    units.registry.__wrapped__()
    opened(place, monkeypatch)
    units.registry.__wrapped__()
    assert asked == [place, None]


def test_windows_has_no_owners_to_ask(tmp_path, monkeypatch):
    found = os.stat_result((0o100777, 0, 0, 1, 12345, 0, 0, 0, 0, 0))
    monkeypatch.setattr("dforce.core.places.os.name", "nt")
    assert not_own_by(found) == ""


@pytest.mark.parametrize(
    ("owner", "user", "words"),
    [(0, 1000, ""), (1000, 1000, ""), (1000, 0, "another user"), (1001, 1000, "another user")],
)
def test_root_is_no_stranger_and_a_user_is_one_to_root(owner, user, words, monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: user, raising=False)
    monkeypatch.setattr("dforce.core.places.os.name", "posix")
    said = not_own_by(os.stat_result((0o40700, 0, 0, 1, owner, 0, 0, 0, 0, 0)))
    assert said == (f"it belongs to {words}" if words else "")


def test_code_of_other_python_is_passed_over(folder, text):
    path = cache.place(text).with_suffix(CODE)
    keep(path, marshal.dumps("no code"))
    assert started(text).outer(1.0) > 2000.0


def test_a_kernel_removed_while_it_is_in_use_goes_on_and_is_not_half_written(folder, text):
    module = started(text)
    df.clear_kernel_cache()
    assert list(folder.iterdir()) == []
    assert module.outer(1.0) > 2000.0
    assert list(folder.iterdir()) == []


def test_the_reason_why_code_cannot_be_kept_is_told_once(folder, text, monkeypatch):
    def refuse(path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(cache, "make_folder", refuse)
    said = []
    with log.listening(said.append):
        assert started(text).outer(1.0) > 2000.0
    (sentence,) = [one for one in said if "cannot be kept" in one]
    assert "(permission denied)" in sentence


def test_a_full_disk_leaves_no_half_file(folder, monkeypatch):
    keep(folder / "a", b"content")
    assert kept(folder / "a") == b"content"

    def full(path, content):
        with path.open("wb") as file:
            file.write(content[:3])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(type(folder), "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        keep(folder / "a", b"other content")
    assert kept(folder / "a") == b"content" and len(list(folder.iterdir())) == 1


def test_a_setting_of_numba_that_changes_the_code_is_another_kernel(monkeypatch):
    import numba

    first = cache.fingerprint("a = 1\n")
    monkeypatch.setattr(numba.config, "BOUNDSCHECK", 1)
    assert cache.fingerprint("a = 1\n") != first


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("NUMBA_DISABLE_JIT", "1", "NUMBA_DISABLE_JIT turns off numba"),
        ("NUMBA_NUM_THREADS", "0", "check the environment variable NUMBA_NUM_THREADS"),
        pytest.param(
            "NUMBA_NUM_THREADS", "-3", "check the environment variable NUMBA_NUM_THREADS", marks=pytest.mark.long
        ),
        ("NUMBA_NUM_THREADS", "x", "its associated value 'x' could not be parsed; check the environment variable"),
    ],
)
def test_an_environment_in_which_numba_cannot_compile_is_one_sentence(tmp_path, variable, value, words):
    code = "import sys; from dforce.cli import main; sys.argv = ['dforce', 'run', 'table-1-am', '-o', 'out.nc']; main()"
    environment = {**{k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}, variable: value}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 2 and words in done.stderr
    assert done.stderr.count("\n") == 1 and done.stdout == "" and list(tmp_path.iterdir()) == []


def test_numba_that_cannot_be_loaded_says_why(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba.np.ufunc.parallel", None)
    with pytest.raises(ParameterError, match=r"numba, the compiler of dForce, cannot be loaded: .*parallel"):
        cache.check_compiler()


@pytest.mark.parametrize("nobody", [RuntimeError("no home"), "~/.cache/dforce"], ids=["now", "older platformdirs"])
def test_a_user_without_a_home_is_told_what_to_set(nobody, monkeypatch):
    def found(*name, **how):
        if isinstance(nobody, str):
            return nobody
        raise nobody

    monkeypatch.delenv("DFORCE_CACHE_DIR", raising=False)
    monkeypatch.setattr(platformdirs, "user_cache_dir", found)
    with pytest.raises(ParameterError, match="set the environment variable HOME"):
        cache.kernel_cache()
    assert units.registry.__wrapped__()("1 inch").to("m").magnitude == pytest.approx(0.0254)
