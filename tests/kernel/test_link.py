"""Functions become text: what is copied, what is refused, and under which names."""

import importlib.util
import math
from pathlib import Path

import numba
import numpy as np
import pytest

from dforce.core.errors import ForceError
from dforce.kernel.linker import Linker, compile_function


@pytest.fixture
def define(tmp_path):
    """Return a function that makes a module of a text and imports it."""
    count = 0

    def make(text, name="laws"):
        nonlocal count
        count += 1
        path = tmp_path / f"{name}_{count}.py"
        path.write_text(text, encoding="utf-8")
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return make


def linked(function):
    """Return the function as it comes out of the composed text, run as plain Python."""
    linker = Linker()
    name = linker.add(function)
    module = {"compiled": lambda f: f, "inlined": lambda f: f, "math": math, "np": np}
    exec("\n\n".join(linker.text), module)
    return module[name], "\n\n".join(linker.text)


def test_numbers_tuples_and_helpers_of_the_file_are_copied(define):
    laws = define('''
from math import pi, sqrt
import math
import numpy as np

SCALE = np.float64(2.0)
COUNT = np.int64(3)
TABLE = ((1.0, 2.0), (3.0, math.inf))

def helper(x: float) -> float:
    """Not copied."""
    return SCALE * sqrt(x)

def law(d: float, t: float = 0.0) -> float:
    """Not copied."""
    total: float = helper(d) + pi * COUNT + math.exp(-d)
    return total + TABLE[0][1] + (1.0 if TABLE[1][1] > 1e300 else 0.0)
''')
    copy, text = linked(laws.law)
    assert copy(4.0) == laws.law(4.0)
    assert "Not copied" not in text
    assert "np.float64" not in text
    assert compile_function(laws.law)(4.0, 0.0) == pytest.approx(laws.law(4.0), rel=1e-15)


def test_a_helper_named_like_a_builtin_stays_the_file_s_own(define):
    laws = define("def round(x):\n    return 2.0 * x\n\ndef law(d):\n    return round(d) + max(d, 1.0)\n")
    copy, _ = linked(laws.law)
    assert copy(0.3) == 1.6


def test_helpers_of_two_files_with_one_name_do_not_mix(define):
    first = define("def helper(d):\n    return 1.0\n\ndef law(d):\n    return helper(d)\n")
    second = define("def helper(d):\n    return 2.0\n\ndef law(d):\n    return helper(d)\n")
    linker = Linker()
    names = linker.add(first.law), linker.add(second.law)
    module = {"compiled": lambda f: f, "inlined": lambda f: f}
    exec("\n\n".join(linker.text), module)
    assert [module[name](0.0) for name in names] == [1.0, 2.0]


def test_a_function_is_compiled_once_whatever_number_it_is_called_with(define):
    """Each literal 0, 1 or False is a type of its own to numba."""
    laws = define("""
def helper(x, count, whole):
    return x + count if whole else x

def law(x, n):
    count, whole = 0, False
    for i in range(n):
        count += i
    return helper(x, 0, True) + helper(x, 1, False) + helper(x, count, whole) + helper(x, n, n > 2)
""")
    linker = Linker()
    linker.add(laws.helper, "helper")
    linker.add_entry(laws.law, "law")
    module = {"compiled": numba.njit, "entry": numba.njit, "np": np}
    exec("\n\n".join(linker.text), module)
    assert module["law"](1.5, 3) == laws.law(1.5, 3)
    assert len(module["helper"].signatures) == 1


def test_a_function_is_copied_once():
    linker = Linker()
    assert linker.add(helper_here) == linker.add(helper_here)
    assert len(linker.text) == 1


def helper_here(x):
    return x


def test_arrays_of_numbers_are_copied_once_and_those_of_two_files_do_not_mix(define):
    text = "import numpy as np\nTABLE = np.array([[1.5, {}], [3.0, 4.0]])\n"
    text += "def other(d):\n    return TABLE[0, 1]\ndef law(d):\n    return d * TABLE[1, 0] + other(d)\n"
    first, second = define(text.format("2.0"), name="one").law, define(text.format("7.0"), name="two").law
    linker = Linker()
    names = [linker.add(first), linker.add(second)]
    module = {"compiled": lambda f: f, "inlined": lambda f: f, "math": math, "np": np}
    exec("\n\n".join(linker.text), module)
    assert [module[name](2.0) for name in names] == [8.0, 13.0]
    assert "\n\n".join(linker.text).count("np.array") == 2
    assert compile_function(first)(2.0) == 8.0


def test_a_law_cannot_take_the_place_of_a_name_of_the_kernel(define):
    """A file drive.py with a function at would be called drive_at, which the kernel has."""
    law = define("def at(d):\n    return d\n", name="drive").at
    assert Linker().add(law) != "drive_at"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("TABLE = [1.0]\ndef law(d):\n    return TABLE[0]", "a list"),
        ("def law(d):\n    return nowhere(d)", "'nowhere', which is not defined"),
        ("def law(d):\n    return (lambda x: x)(d)", "without lambda"),
        ("COUNT = 0\ndef law(d):\n    global COUNT\n    return d", "without lambda, global"),
        ("def law(d):\n    def inner(x):\n        return x\n    return inner(d)", "must not define functions inside"),
        ("import numpy as np\nX = np.array([np.nan])\ndef law(d):\n    return X[0]", "other than finite numbers"),
        ("import numpy as np\nX = np.array(['a'])\ndef law(d):\n    return X[0]", "other than finite numbers"),
        ("import os\ndef law(d):\n    return os.getpid()", "a module"),
    ],
)
def test_what_cannot_be_copied_is_refused_with_a_sentence(define, text, reason):
    with pytest.raises(ForceError, match=reason):
        Linker().add(define(text).law)


@pytest.mark.parametrize(
    "text", ["def law(d):\n    return 7.0 * d\n", "\n\n\ndef law(d):\n    return 4.0 * d\n", "x = 1\n"]
)
def test_a_function_whose_file_was_edited_since_is_refused(define, text):
    module = define("def law(d):\n    return 3.0 * d\n")
    Path(module.__file__).write_text(text, encoding="utf-8")
    with pytest.raises(ForceError, match="has changed since Python read it"):
        Linker().add(module.law)


def test_a_function_without_source_is_refused():
    space = {}
    exec("def law(d):\n    return d", space)
    with pytest.raises(ForceError, match="define it in a file"):
        Linker().add(space["law"])


PAIR = (3, 4)


def unpacks_a_pair(x):
    a, b = PAIR
    return a * x + b


def unpacks_it_as_well(x):
    a, b = PAIR
    return b * x + a


def test_how_one_function_is_compiled_changes_nothing_in_the_text_of_another():
    for function, decorator, first in (
        (unpacks_a_pair, "compiled", "np.int64(3)"),
        (unpacks_it_as_well, "inlined", "3"),
    ):
        linker = Linker()
        linker.add(function, decorator=decorator)
        assert f"({first}, " in linker.text[0]


def test_arrays_that_share_no_memory_are_compiled_as_such():
    from dforce.integrators.lanes import advance_lanes
    from dforce.kernel.unshared import unshared

    def copied(a, b):
        for i in range(a.shape[0]):
            b[i] = a[i]

    texts = []
    for decorator in (numba.njit, unshared(numba.njit)):
        function = decorator(copied)
        function.compile("void(f8[::1],f8[::1])")
        [text] = function.inspect_llvm().values()
        texts.append(next(line for line in text.splitlines() if line.startswith("define") and "copied" in line))
    usual, apart = texts
    assert apart.count("noalias") > usual.count("noalias")
    linker = Linker({"mode_count": 1, "motion_size": 2, "fluid_size": 0, "latch_count": 0, "memory_size": 0})
    linker.add_entry(advance_lanes, "advance_lanes")
    assert linker.text[-1].startswith("@apart\ndef advance_lanes(")
