"""What stands on a terminal: no word is split at its edge, one voice for every mistake, one line for each model."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys

import pytest
import synthetic
from every import every
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.core import log
from dforce.validity import attributes

SAID = df.Advice(
    "soft", 2e-9, 1e-9, "The indentation of the experiment is larger than the sample's thickness allows, so that the "
    "support of the sample takes part, and with it the uncomfortably stiff sample-holder. Use another.", "this test",
    ("sample",), "m",
)  # fmt: skip
TITLE = (
    "Amplitude modulation of an incompressible polydimethylsiloxane-like sample beneath a comparatively "
    "indestructible experimental cantilever"
)


@pytest.fixture
def ran(workdir, run_as):
    """Replace the computation by a result with a long title and long advice."""

    def run(case, progress=None, resume=None):
        return synthetic.approach().assign_attrs(case=case.to_toml(), **attributes([SAID]) | {"title": TITLE})

    run_as(run)


def invoke(*words, columns=None):
    return CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": columns and str(columns)})


PRINTED = {
    "help": ["--help"],
    "help-of-run": ["run", "--help"],
    "help-of-models": ["models", "--help"],
    "help-of-check": ["check", "--help"],
    "help-of-curve": ["curve", "--help"],
    "help-of-gui": ["gui", "--help"],
    "models": ["models"],
    "models-long": ["models", "--long"],
    "models-one": ["models", "dlvo"],
    "examples": ["examples"],
    "check": ["check", "figure-3-water"],
    "error": ["check", "figure-3-air", "--set", "sample.youngs_modulus=1 kilometer-per-fortnight"],
    "run": ["run", "figure-3-air", "-o", "out.nc"],
}


@every(itertools.product([60, 100], PRINTED))
def test_no_word_is_split_at_the_edge_of_a_terminal(columns, name, ran):
    shown, wide = (invoke(*PRINTED[name], columns=room).output for room in (columns, 1000))
    # the terminal itself splits what is too long for it
    assert [line for line in shown.split("\n") if len(line) > columns] == []
    # a shortened sentence ends in a word of its own
    assert set(shown.split()) - {"…"} <= set(wide.split())
    assert len(shown.split()) > 5


def on_a_terminal(columns, words):
    """Return what stands on a terminal of so many columns, both streams together."""
    import fcntl
    import pty
    import struct
    import termios

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    environment = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES")}
    code = "import sys; from dforce.cli import main; sys.argv[0] = 'dforce'; main()"
    with subprocess.Popen(
        [sys.executable, "-c", code, *words], stdin=theirs, stdout=theirs, stderr=theirs,
        env=environment | {"NO_COLOR": "1", "TERM": "dumb"},
    ):  # fmt: skip
        os.close(theirs)
        pieces = []
        while True:
            try:
                piece = os.read(ours, 65536)
            except OSError:  # the other side is closed: how Linux ends a terminal
                break
            if not piece:
                break
            pieces.append(piece)
    os.close(ours)
    return b"".join(pieces).decode().replace("\r\n", "\n")


@pytest.mark.skipif(os.name != "posix", reason="a terminal of a given width is made with pty")
@pytest.mark.slow
def test_the_width_is_that_of_the_terminal():
    # a word more would not fit: longer lines would be split by the terminal, much shorter ones ignore its width
    for columns in (60, 90):
        shown = on_a_terminal(
            columns, ["check", "figure-3-air", "--set", "sample.youngs_modulus=1 kilometer-per-fortnight"]
        )
        first, second = shown.split("\n")[:2]
        assert first.startswith("dforce: ") and len(first) <= columns < len(f"{first} {second.split()[0]}")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["rnu", "figure-3-air"], "there is no command 'rnu'; did you mean 'run'?"),
        (["run", "figure-3-ari"], "there is no file 'figure-3-ari'; did you mean the example 'figure-3-air'?"),
        (["models", "dmmt"], "there is no force model 'dmmt'; did you mean 'dmt'?"),
        (["models", "zz"], "there is no force model 'zz'; dforce models lists all"),
        (["cantilevers", "zz"], "there is no cantilever 'zz'; dforce cantilevers lists all"),
        (["zz"], "there is no command 'zz'; dforce --help lists all"),
        (["run", "figure-3-air", "--plto", "x.png"], "there is no option '--plto'; did you mean '--plot'?"),
        (["--versoin"], "there is no option '--versoin'; did you mean '--version'?"),
        (["run"], "missing argument 'CASE'; see dforce run --help"),
        (["run", "figure-3-air", "figure-2"], "'figure-2' is one word too many; see dforce run --help"),
        (["run", "figure-3-air", "-o"], "option '-o' requires an argument"),
        (["curve", "figure-3-air", "--points", "many"], "--points is 'many', not a whole number from 2 to 1000000"),
        (["curve", "figure-3-air", "--points", "1"], "--points is '1', not a whole number from 2 to 1000000"),
        (["gui", "--port", "99999999999999"], "--port is '99999999999999', not a whole number from 1 to 65535"),
    ],
)
def test_every_mistake_in_a_command_is_answered_in_one_voice(words, sentence):
    done = invoke(*words)
    assert (done.exit_code, done.stdout, done.stderr) == (2, "", f"dforce: {sentence}\n")


@every([("vdw", "van_der_waals"), ("KV", "kelvin_voigt"), ("JKR", "jkr"), ("lj", "lennard_jones")])
def test_initials_show_the_page_of_a_model(word, name):
    assert invoke("models", word).stdout == invoke("models", name).stdout != ""


def test_the_program_alone_shows_what_there_is():
    assert invoke().exit_code == 0 and invoke().stdout == invoke("--help").stdout


@every(["", *(command.name or "" for command in app.registered_commands)])
def test_help_shows_no_types_of_a_programming_language(command):
    shown = invoke(*filter(None, [command]), "--help").stdout
    assert shown and not re.search(r"<\w+>|\bbool\b|\bTEXT\b|\bINTEGER\b|\{\w+\}", shown)


def test_models_are_one_line_each_under_the_headings_that_group_them():
    lines = invoke("models", columns=80).stdout.splitlines()
    listed = [line.split()[0] for line in lines if line.startswith("  ")]
    assert sorted(listed) == sorted(df.forces.REGISTRY)
    headings = list(df.forces.grouped(df.forces.REGISTRY.values()))
    assert len(headings) > 3 and [line for line in lines if line in headings] == headings
    # beside models and headings: a blank line after each group, and two hints
    assert len(lines) == len(listed) + 2 * len(headings) + 2


def test_models_with_their_parameters_are_the_long_list():
    long = invoke("models", "--long").stdout
    for model in df.forces.REGISTRY.values():
        assert all(re.search(rf"^      {key}\b", long, re.MULTILINE) for key in model.keys())  # noqa: SIM118 a method


def test_what_is_compiled_in_parts_is_told_once(workdir, run_as):
    def run(case, progress=None, resume=None):
        for name in ("hertz", "the solvers") * 2:
            log.announce(f"Compiling {name}")
        return synthetic.approach()

    run_as(run)
    said = invoke("run", "figure-3-air").stderr.splitlines()
    assert [line for line in said if line.startswith("Compiling")] == ["Compiling hertz", "Compiling the solvers"]
