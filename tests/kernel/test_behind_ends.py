"""What compiles in the background ends with a program that is stopped or killed, and goes on behind one that ends by itself."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="signals of POSIX"),
    pytest.mark.slow,  # three programs are started, and a process by each
]

BEHIND = "import sys, time; from pathlib import Path; from dforce.kernel import behind; behind.end_in_time(); "
BEHIND += "Path('began').touch(); time.sleep(3.0); Path('done').touch()"
PROGRAM = f"""
import signal, sys, time
from pathlib import Path
from dforce.core.stopping import heard, sigterm_as_ctrl_c
signal.signal(signal.SIGINT, signal.default_int_handler)  # as in a terminal, also where the tests run in the background
from dforce.kernel import behind
with sigterm_as_ctrl_c():
    try:
        behind.start({BEHIND!r}, [], Path())
        while not Path("began").exists():
            time.sleep(0.01)
        print("ready", flush=True)
        time.sleep(float(sys.argv[1]))
    except KeyboardInterrupt:
        heard()
"""


@pytest.mark.long
@pytest.mark.parametrize(
    ("number", "goes_on"), [(None, True), (signal.SIGTERM, False), (signal.SIGINT, False), (signal.SIGKILL, False)]
)
def test_the_background_goes_on_behind_a_program_only_where_that_ended_by_itself(number, goes_on, tmp_path):
    words = [sys.executable, "-c", PROGRAM, "60" if number else "0"]
    program = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert program.stdout.readline() == "ready\n"
    if number is not None:
        program.send_signal(number)
    program.communicate(timeout=60)
    time.sleep(5.0)
    assert (tmp_path / "done").exists() == goes_on
