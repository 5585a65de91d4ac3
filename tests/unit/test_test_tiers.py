"""Each test runs somewhere: before a change lands as by hand, or in the slower tier."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def recipe(target):
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    return re.search(rf"^{target}:.*\n((?:\t.*\n)+)", makefile, re.MULTILINE)[1]


def left_out():
    options = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["pytest"]["ini_options"][
        "addopts"
    ]
    return re.findall(r"not (\w+)", options[options.index("-m") + 1])


def test_the_gate_and_make_test_run_the_same_tests():
    gate = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert re.findall(r"^make --no-print-directory test\b(.*)$", gate, re.MULTILINE) == [""]
    assert " -m " not in recipe("test")


def test_make_validate_runs_what_make_test_leaves_out():
    assert left_out()
    assert f'-m "{" or ".join(left_out())}"' in recipe("validate")
