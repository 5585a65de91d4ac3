"""What a command prints may have nowhere to go: a full disk, a stream that is closed, a reader that has gone."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tiers import some_long

import dforce as df
from dforce.cli._report import quoted
from dforce.cli._streams import Outlet

FULL = Path("/dev/full")
CODE = "import sys; from dforce.cli import main; sys.argv[0] = 'dforce'; main()"
NO_ROOM = "dforce: the output could not be written: no space left on device\n"
PRINTING = [
    ["--help"],
    ["--version"],
    ["run", "--help"],
    ["models"],
    ["check", "hysteresis"],
    ["schema"],
    ["cache", "--json"],
]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not FULL.exists(), reason="Linux alone has a file that is always full"),
]


def ran(*words, redirected="", cwd=None, **new):
    """Run a command by a shell that redirects its streams, with new variables in its environment."""
    command = f'"$0" -c "$1" "${{@:2}}" {redirected}'
    return subprocess.run(
        ["bash", "-c", command, sys.executable, CODE, *words],
        capture_output=True, text=True, cwd=cwd, env=os.environ | new,
    )  # fmt: skip


@pytest.mark.parametrize("words", PRINTING, ids=" ".join)
def test_a_full_disk_behind_the_output_is_told_in_a_sentence(words):
    done = ran(*words, redirected=">/dev/full")
    assert (done.returncode, done.stderr) == (2, NO_ROOM)


@pytest.mark.parametrize("words", PRINTING, ids=" ".join)
def test_a_command_whose_output_is_closed_does_its_work(words):
    done = ran(*words, redirected=">&-")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


ALONE = (">/dev/full", "2>/dev/full", ">&-", "2>&-")  # one stream, the other is as usual


@pytest.mark.parametrize("streams", some_long([">/dev/full 2>&1", ">&- 2>&-", *ALONE], ALONE))
def test_a_result_is_kept_wherever_the_words_about_it_go(streams, tmp_path):
    # with an empty cache there is more to tell while it runs, that it compiles
    new = {"DFORCE_CACHE_DIR": str(tmp_path / "cache")} if streams == "2>/dev/full" else {}
    settings = ["--set", "experiment.zc.points=3", "--set", "solver.periods=20", "--set", "solver.settle=fixed"]
    done = ran("run", "figure-3-air", *settings, "-o", "curve.nc", redirected=streams, cwd=tmp_path, **new)
    assert df.read(tmp_path / "curve.nc").sizes["zc"] == 3
    assert done.returncode == (2 if ">/dev/full" in streams.split() else 0)
    assert "Traceback" not in done.stderr and "report" not in done.stderr


NAMES = [
    "curve.nc",
    "my curve.nc",
    "it's.nc",
    "a \"b\" 'c'.nc",
    "$HOME `date`.nc",
    "a\\b c.nc",
    "now!! or never.nc",
    "-x.nc",
]


@pytest.mark.parametrize("name", NAMES)
def test_a_name_is_printed_as_a_shell_takes_it(name):
    shown = subprocess.run(["bash", "-c", f"printf %s {quoted(name)}"], capture_output=True, text=True, check=True)
    assert Path(shown.stdout) == Path(name) and not shown.stdout.startswith("-")  # no option


def test_a_mistake_keeps_its_exit_code_where_it_cannot_be_told():
    for streams in ("2>/dev/full", "2>&-"):
        assert ran("check", "nowhere.toml", redirected=streams).returncode == 2


@pytest.mark.parametrize("words", PRINTING[2:-1], ids=" ".join)
def test_a_reader_that_has_seen_enough_is_no_error(words):
    # the command's own exit code; the reader is gone before the command prints
    done = ran(*words, redirected="| true; exit ${PIPESTATUS[0]}")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_closed_pipe_of_windows_is_a_reader_that_has_gone():
    class Pipe(io.StringIO):
        def write(self, text):
            raise OSError(errno.EINVAL, "Invalid argument")

        def flush(self):
            self.write("")

    outlet = Outlet(Pipe(), needed=True)
    assert outlet.write("text") == 4
    outlet.flush()


@pytest.mark.parametrize("redirected", [">/dev/full", "| true; exit ${PIPESTATUS[0]}"])
def test_streams_of_ascii_end_as_others_do(redirected):
    done = ran("schema", redirected=redirected, PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == ((2, NO_ROOM) if "full" in redirected else (0, ""))
