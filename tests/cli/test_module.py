"""The package run as a module does what the command does."""

from __future__ import annotations

import subprocess
import sys


def test_the_package_runs_as_a_module():
    result = subprocess.run([sys.executable, "-m", "dforce", "--version"], capture_output=True, text=True, check=True)
    assert result.stdout.startswith("dForce ")
