"""The files that a person opened last, kept with the session: a browser cannot open a file again by its name."""

from __future__ import annotations

import base64
import contextlib
import datetime
from dataclasses import dataclass
from pathlib import Path

import dforce as df
from dforce.core.errors import shorten
from dforce.gui.document.store import why

FOLDER = "last"  # in that of a session
MOST = 6
MOST_BYTES = 100_000_000  # of all of them
LONGEST = 180  # bytes of a name; a longer one keeps its end


@dataclass(frozen=True)
class LastFile:
    """A file that was opened: its name, and when (s since 1970)."""

    name: str
    opened: float

    def words(self, now: datetime.datetime) -> str:
        """Return its name with the day, or the time of today."""
        at = datetime.datetime.fromtimestamp(self.opened)
        days = (now.date() - at.date()).days
        when = f"{at:%H:%M}" if days == 0 else "yesterday" if days == 1 else f"{at.day} {at:%b}"
        return f"{shorten(self.name, 40)} ({when})"


class LastFiles:
    """The files of one session; one that is opened again takes the place of its earlier content.

    Parameters
    ----------
    folder
        Where they are kept; it is made when the first one comes.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def keep(self, data: bytes, name: str) -> None:
        """Keep a file; the oldest ones go when there are too many. Blocking.

        Raises
        ------
        ResultError
            When it cannot be written.
        """
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._path(name).write_bytes(data)
            sizes = [path.stat().st_size for path in self._paths()]
            for number, path in enumerate(self._paths()):
                if number and (number >= MOST or sum(sizes[: number + 1]) > MOST_BYTES):
                    path.unlink(missing_ok=True)
        except OSError as error:
            raise df.ResultError(f"the file is open, but cannot be listed for the next time: {why(error)}") from error

    def take(self, name: str) -> bytes:
        """Return a file. Blocking.

        Raises
        ------
        ResultError
            When it is no longer kept.
        """
        try:
            return self._path(name).read_bytes()
        except OSError:
            raise df.ResultError(
                f"the file '{shorten(name, 60)}' is no longer kept here; open it from your disk"
            ) from None

    def listed(self) -> list[LastFile]:
        """Return the files, the last one first."""
        return [LastFile(_name_of(path), path.stat().st_mtime) for path in self._paths()]

    def forget(self) -> None:
        """Remove all of them."""
        for path in self._paths():
            path.unlink(missing_ok=True)

    def _path(self, name: str) -> Path:
        cut = name.encode(errors="replace")[-LONGEST:].decode(errors="ignore")
        return self.folder / f"file-{base64.urlsafe_b64encode(cut.encode()).decode('ascii')}"

    def _paths(self) -> list[Path]:
        return sorted(self.folder.glob("file-*"), key=lambda path: path.stat().st_mtime, reverse=True)


def list_opened(session: Path, file: Path) -> None:
    """List a file of this computer that was named at the start; one that is gone or too large is not listed. Blocking."""
    with contextlib.suppress(OSError, df.ResultError):
        if file.stat().st_size <= MOST_BYTES:
            LastFiles(session / FOLDER).keep(file.read_bytes(), file.name)


def _name_of(path: Path) -> str:
    return base64.urlsafe_b64decode(path.name.removeprefix("file-")).decode(errors="replace")
