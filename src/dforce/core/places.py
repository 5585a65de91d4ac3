"""The folders for the user's own files, and a check that they belong to the user."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Literal

from dforce.core.errors import ParameterError


def user_folder(kind: Literal["cache", "data"]) -> Path:
    """Return the user's folder for files that can be made again (cache) or that cannot (data); it may not exist.

    Raises
    ------
    ParameterError
        When the user has no home, as in a container that runs as an unknown user.
    """
    import platformdirs

    find = {"cache": platformdirs.user_cache_dir, "data": platformdirs.user_data_dir}[kind]
    try:
        folder = find("dforce", appauthor=False)
    except RuntimeError:
        folder = "~"
    if folder.startswith("~"):  # as older versions of platformdirs leave it
        raise ParameterError(
            "this user has no home folder for the files of dForce; set the environment variable HOME to a folder"
        )
    return Path(folder)


def not_own(place: Path) -> str:
    """Return why others may have written a file or folder; empty if only this user or root can have, or if it is missing.

    Code that another user may have written is not run, as ssh uses no keys in such a folder.
    """
    try:
        return not_own_by(place.stat())
    except OSError:
        return ""


def not_own_by(found: os.stat_result) -> str:
    """Return the same from the status of a file or folder; Windows separates the folders of its users."""
    if os.name != "posix":
        return ""
    if found.st_uid not in (0, os.geteuid()):
        return "it belongs to another user"
    return "other users may write to it" if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH) else ""
