"""Python in a subprocess that imports this dForce, and no module from its working folder."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def can_start() -> bool:
    """Return whether Python can be started by itself.

    A program that contains Python, as PyInstaller makes them, could only start itself.
    """
    return Path(sys.executable or "").name.lower().startswith("python") and not getattr(sys, "frozen", False)


def command(*arguments: str) -> list[str]:
    """Return the command line that starts Python with arguments; a folder may hold a file with the name of a library."""
    return [sys.executable, "-P", *arguments]


def environment() -> dict[str, str]:
    """Return the environment in which that Python finds this dForce."""
    paths = [str(Path(__file__).resolve().parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
