"""Programs that are stopped at random moments: a short run of the benchmark."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from dforce.core.parallel import cores

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "stops.py"
WITHIN = 10.0  # s on a machine that does nothing else


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_programs_end_soon_at_a_stop_say_so_and_leave_whole_files():
    within = WITHIN * max(1.0, os.getloadavg()[0] / cores())
    words = [sys.executable, str(SCRIPT), "--stops", "4", "--within", f"{within:.0f}"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=560, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
