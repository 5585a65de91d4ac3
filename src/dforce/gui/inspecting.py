"""Has an HDF5 file of unknown origin looked through in a process of its own, before this one reads it."""

from __future__ import annotations

import subprocess
from pathlib import Path

import dforce as df
from dforce.core import child
from dforce.core.errors import shorten
from dforce.gui import inspection

HDF5 = b"\x89HDF\r\n\x1a\n"
MOST_UNPACKED = 200_000_000  # bytes of the data in a file
SECONDS = 40.0  # that looking through one may take


def inspect(path: Path, *groups: str) -> None:
    """Look through a file in another process before it is read here; with another word it may hold groups.

    Raises
    ------
    ResultError
        When it is not to be read, or damaged, or where no process can be started.
    """
    unseen = "this file is not opened: no process could be started that looks through it"
    if not child.can_start():
        raise df.ResultError(unseen)
    try:
        found = subprocess.run(
            child.command(inspection.__file__, str(path), str(MOST_UNPACKED), *groups), stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=SECONDS, env=child.environment(),
        )  # fmt: skip
    except OSError:
        raise df.ResultError(unseen) from None
    except subprocess.TimeoutExpired:
        raise df.ResultError("this file takes too long to read, so it is not opened") from None
    wrong = found.stdout.decode("utf-8", "replace").strip()
    if wrong:
        raise df.ResultError(f"this file is not opened: {shorten(wrong, 200)}")
    if found.returncode:
        raise df.ResultError("this file is damaged or was cut short")
