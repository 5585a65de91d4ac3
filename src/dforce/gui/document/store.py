"""What a visit leaves, in a file of its own: written whole at each change, so that the next one finds it."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

import dforce as df
from dforce.core.files import write_whole

ASIDE = ".unread"  # ending of what could not be read; it is kept, for nothing typed is thrown away


class Store(dict[str, Any]):
    """A dict that a file keeps.

    Parameters
    ----------
    file
        Where it is kept; it need not be there yet. One that cannot be read is put aside.
    """

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.file = file
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
            if not isinstance(found, dict):
                raise ValueError("no table")
            self.update(found)
        except FileNotFoundError:
            pass
        except (OSError, ValueError, RecursionError):
            with contextlib.suppress(
                OSError
            ):  # one that can be neither read nor moved cannot be written, which is said
                file.replace(file.with_suffix(ASIDE))

    def __setitem__(self, key: str, value: object) -> None:
        """Take a value, and write the file. Blocking.

        Raises
        ------
        ResultError
            When the file cannot be written; it is then as it was.
        """
        super().__setitem__(key, value)
        try:
            self.file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(self.file, json.dumps(dict(self)).encode())
            self.file.chmod(0o600)
        except (OSError, ValueError, TypeError, RecursionError, df.ResultError) as error:
            raise df.ResultError(why(error)) from error


def why(error: BaseException) -> str:
    """Return in words why a file could not be written, without its place: on a server that is nobody's business."""
    cause = error.__cause__ if isinstance(error, df.DForceError) and error.__cause__ is not None else error
    if isinstance(cause, OSError):
        return (cause.strerror or str(cause)).lower()
    return str(error)
