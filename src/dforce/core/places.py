"""The folders where dForce keeps what is this user's own."""

from __future__ import annotations

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
            "this user has no home, where dForce keeps files; set the environment variable HOME to a folder"
        )
    return Path(folder)
