"""The folders where dForce keeps what is this user's own, and whether they are."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Literal

from dforce.core.errors import ParameterError


def user_folder(what: Literal["cache", "data"]) -> Path:
    """Return the folder of this user for what can be made again, or for what cannot; it may not exist.

    Raises
    ------
    ParameterError
        When the user has no home, as in a container that runs as somebody unknown there.
    """
    import platformdirs

    find = {"cache": platformdirs.user_cache_dir, "data": platformdirs.user_data_dir}[what]
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
    """Return why others may have put what lies at a place; empty where only this user or root can have, or nothing lies there.

    Code that another user may have written is not run, as ssh uses no keys in such a folder.
    """
    try:
        return not_own_by(place.stat())
    except OSError:
        return ""


def not_own_by(found: os.stat_result) -> str:
    """Return the same, by what the system knows of a file or a folder; Windows keeps the folders of its users apart."""
    if os.name != "posix":
        return ""
    if found.st_uid not in (0, os.geteuid()):
        return "it belongs to another user"
    return "other users may write to it" if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH) else ""
