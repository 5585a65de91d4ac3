"""Python in a process of its own, which finds this very dForce, and nothing in the folder that it works in."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def can_start() -> bool:
    """Say whether Python can be started by itself.

    In a program that brings Python with it, such as those of PyInstaller, only that whole program could be started.
    """
    return Path(sys.executable or "").name.lower().startswith("python") and not getattr(sys, "frozen", False)


def command(*arguments: str) -> list[str]:
    """Return the command line that starts Python with arguments; a folder may hold a file with the name of a library."""
    return [sys.executable, "-P", *arguments]


def environment() -> dict[str, str]:
    """Return the environment in which that Python finds this dForce."""
    paths = [str(Path(__file__).resolve().parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
